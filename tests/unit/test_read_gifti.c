/* SPDX-License-Identifier: MIT
 * GIFTI surfaces: encodings, orders and byte orders that mean the same, and a table of bad files. */
#include "io/base64.h"
#include "io/formats.h"
#include "test.h"

#include <loxo/io.h>

#define HEAD    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
#define DOCTYPE "<!DOCTYPE GIFTI SYSTEM \"http://www.nitrc.org/frs/download.php/115/gifti.dtd\">\n"
#define ROOT    "<GIFTI Version=\"1.0\" NumberOfDataArrays=\"2\">\n"
#define POINTS(type, order, dim0, encoding, endian)                                                                    \
    "<DataArray Intent=\"NIFTI_INTENT_POINTSET\" DataType=\"NIFTI_TYPE_" type "\" ArrayIndexingOrder=\"" order         \
    "\" Dimensionality=\"2\" Dim0=\"" dim0 "\" Dim1=\"3\" Encoding=\"" encoding "\" Endian=\"" endian "\">"
#define TRIANGLES(order, dim0, encoding, endian)                                                                       \
    "<DataArray Intent=\"NIFTI_INTENT_TRIANGLE\" DataType=\"NIFTI_TYPE_INT32\" ArrayIndexingOrder=\"" order            \
    "\" Dimensionality=\"2\" Dim0=\"" dim0 "\" Dim1=\"3\" Encoding=\"" encoding "\" Endian=\"" endian "\">"
#define ROW             "RowMajorOrder"
#define COLUMN          "ColumnMajorOrder"
#define LITTLE          "LittleEndian"
#define END             "</Data></DataArray>\n"
#define ASCII_POINTS    POINTS("FLOAT32", ROW, "4", "ASCII", LITTLE) "<Data>0 0 0  1 0 0\n0 1 0  0 0 1.5" END
#define ASCII_TRIANGLES TRIANGLES(ROW, "4", "ASCII", LITTLE) "<Data>0 2 1 0 1 3 1 2 3 2 0 3" END
#define FOOT            "</GIFTI>\n"

static loxo_status read_text(const char *text, loxo_soup *soup)
{
    loxo_context_clear(test_context);
    return loxo_read_gifti(test_context, (const uint8_t *)text, strlen(text), "t.surf.gii", soup);
}

/* The tetrahedron, in whatever coding. */
static void check_tetrahedron(const char *text, bool is_double)
{
    static const int triangle[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    static const double position[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1.5};
    loxo_soup soup;
    CHECK_OK(read_text(text, &soup));
    CHECK_EQUAL(soup.n_vertices, 4);
    CHECK_EQUAL(soup.n_faces, 4);
    CHECK((soup.position != NULL) == is_double && (soup.position_float != NULL) != is_double);
    for (int i = 0; i < 12; ++i) {
        CHECK_EQUAL(is_double ? soup.position[i] : (double)soup.position_float[i], position[i]);
        CHECK_EQUAL(soup.triangle[i], triangle[i]);
    }
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 0);
    loxo_soup_destroy(test_context, &soup);
}

/* 12 numbers of 4 bytes as Base64; the text is valid for two calls. */
static const char *base64(const uint32_t *bits, bool is_big, bool is_column)
{
    static char texts[2][80];
    static int next;
    char *text = texts[next++ % 2];
    uint8_t bytes[48];
    for (int i = 0; i < 12; ++i) {
        const uint32_t v = bits[is_column ? 3 * (i % 4) + i / 4 : i];
        for (int k = 0; k < 4; ++k)
            bytes[4 * i + k] = (uint8_t)(v >> 8 * (is_big ? 3 - k : k));
    }
    text[loxo_base64_encode(bytes, sizeof bytes, (unsigned char *)text)] = '\0';
    return text;
}

TEST(all_codings_say_the_same)
{
    static const uint32_t triangle[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    static const uint32_t position[12] = {0, 0, 0, 0x3f800000, 0, 0, 0, 0x3f800000, 0, 0, 0, 0x3fc00000};
    char text[4096];
    check_tetrahedron(HEAD DOCTYPE ROOT ASCII_POINTS ASCII_TRIANGLES FOOT, false);
    check_tetrahedron(ROOT ASCII_TRIANGLES ASCII_POINTS FOOT, false);
    check_tetrahedron(HEAD ROOT POINTS("FLOAT64", ROW, "4", "ASCII",
                                       LITTLE) "<Data>0 0 0 1 0 0 0 1 0 0 0 15e-1" END ASCII_TRIANGLES FOOT,
                      true);
    check_tetrahedron(
        HEAD ROOT POINTS("FLOAT32", COLUMN, "4", "ASCII", LITTLE) "<Data>0 1 0 0 0 0 1 0 0 0 0 1.5" END TRIANGLES(
            COLUMN, "4", "ASCII", LITTLE) "<Data>0 0 1 2 2 1 2 0 1 3 3 3" END FOOT,
        false);
    for (int i = 0; i < 4; ++i) {
        const bool is_big = i % 2 == 1, is_column = i / 2 == 1;
        const char *order = is_column ? COLUMN : ROW, *endian = is_big ? "BigEndian" : LITTLE;
        snprintf(text, sizeof text,
                 HEAD ROOT POINTS("FLOAT32", "%s", "4", "Base64Binary", "%s") "<Data>%s" END TRIANGLES(
                     "%s", "4", "Base64Binary", "%s") "<Data>\n  %s\n" END FOOT,
                 order, endian, base64(position, is_big, is_column), order, endian,
                 base64(triangle, is_big, is_column));
        check_tetrahedron(text, false);
    }
    /* zlib's own wrapping, as Python writes it */
    check_tetrahedron(HEAD ROOT POINTS("FLOAT32", ROW, "4", "GZipBase64Binary",
                                       LITTLE) "<Data>eJxjYEAGDfYMePkH7AEoPQJ+" END ASCII_TRIANGLES FOOT,
                      false);
}

typedef struct bad_file {
    loxo_status status;
    int64_t line;
    const char *reason; /* part of the failure's text */
    const char *text;
} bad_file;

#define BASE64_POINTS(dim0, data) POINTS("FLOAT32", ROW, dim0, "Base64Binary", LITTLE) "<Data>" data END
#define GZIP_POINTS(dim0, data)   POINTS("FLOAT32", ROW, dim0, "GZipBase64Binary", LITTLE) "<Data>" data END

static const bad_file bad_files[] = {
    {LOXO_ERR_MALFORMED, 1, "no GIFTI", "<?xml version=\"1.0\"?><GIFT></GIFT>"},
    {LOXO_ERR_MALFORMED, 5, "XML: ", HEAD ROOT ASCII_POINTS},
    {LOXO_ERR_MALFORMED, 2, "XML: mismatched tag", HEAD "<GIFTI></GIFTY>"},
    {LOXO_ERR_MALFORMED, 0, "without a pointset", HEAD ROOT ASCII_TRIANGLES FOOT},
    {LOXO_ERR_MALFORMED, 0, "without triangles", HEAD ROOT ASCII_POINTS FOOT},
    {LOXO_ERR_UNSUPPORTED, 5, "a second pointset", HEAD ROOT ASCII_POINTS ASCII_POINTS ASCII_TRIANGLES FOOT},
    /* dimensions */
    {LOXO_ERR_MALFORMED, 3, "its dimensions make 6000000000 numbers, the data holds",
     HEAD ROOT TRIANGLES(ROW, "2000000000", "ASCII", LITTLE) "<Data>0 2 1" END ASCII_POINTS FOOT},
    {LOXO_ERR_LIMIT, 3, "more numbers than any file",
     HEAD ROOT POINTS("FLOAT32", ROW, "9223372036854775807", "ASCII", LITTLE) "<Data>0" END ASCII_TRIANGLES FOOT},
    {LOXO_ERR_MALFORMED, 3, "not a count",
     HEAD ROOT POINTS("FLOAT32", ROW, "99999999999999999999", "ASCII", LITTLE) "<Data>0" END FOOT},
    {LOXO_ERR_MALFORMED, 3, "not a count", HEAD ROOT POINTS("FLOAT32", ROW, "-4", "ASCII", LITTLE) "<Data>0" END FOOT},
    {LOXO_ERR_MALFORMED, 3, "not a count", HEAD ROOT POINTS("FLOAT32", ROW, "4.0", "ASCII", LITTLE) "<Data>0" END FOOT},
    {LOXO_ERR_MALFORMED, 3, "its dimensions make 15 numbers, the data holds 12",
     HEAD ROOT POINTS("FLOAT32", ROW, "5", "ASCII", LITTLE) "<Data>0 0 0 1 0 0 0 1 0 0 0 1.5      " END FOOT},
    {LOXO_ERR_MALFORMED, 3, "its dimensions make 9 numbers, the data holds more than 9",
     HEAD ROOT POINTS("FLOAT32", ROW, "3", "ASCII", LITTLE) "<Data>0 0 0 1 0 0 0 1 0 0 0 1.5" END FOOT},
    {LOXO_ERR_MALFORMED, 3, "without 3 columns",
     HEAD ROOT "<DataArray Intent=\"NIFTI_INTENT_POINTSET\" DataType=\"NIFTI_TYPE_FLOAT32\" Dimensionality=\"2\" "
               "Dim0=\"3\" Dim1=\"4\" Encoding=\"ASCII\"><Data>0" END FOOT},
    {LOXO_ERR_UNSUPPORTED, 3, "another type", HEAD ROOT POINTS("INT32", ROW, "4", "ASCII", LITTLE) "<Data>0" END FOOT},
    {LOXO_ERR_MALFORMED, 3, "Encoding is missing", HEAD ROOT POINTS("FLOAT32", ROW, "4", "base64", LITTLE) END FOOT},
    {LOXO_ERR_MALFORMED, 3, "Endian is missing",
     HEAD ROOT POINTS("FLOAT32", ROW, "4", "Base64Binary", "Middle") "<Data/></DataArray>" FOOT},
    {LOXO_ERR_MALFORMED, 3, "ArrayIndexingOrder", HEAD ROOT POINTS("FLOAT32", "x", "4", "ASCII", LITTLE) END FOOT},
    {LOXO_ERR_MALFORMED, 3, "it has no Data",
     HEAD ROOT POINTS("FLOAT32", ROW, "4", "ASCII", LITTLE) "</DataArray>" FOOT},
    {LOXO_ERR_MALFORMED, 3, "a second Data",
     HEAD ROOT POINTS("FLOAT32", ROW, "0", "ASCII", LITTLE) "<Data></Data><Data>" END FOOT},
    {LOXO_ERR_MALFORMED, 3, "an element inside Data",
     HEAD ROOT POINTS("FLOAT32", ROW, "4", "ASCII", LITTLE) "<Data>0 <b/>" END FOOT},
    /* numbers */
    {LOXO_ERR_MALFORMED, 3, "number 3 is none of its type",
     HEAD ROOT POINTS("FLOAT32", ROW, "2", "ASCII", LITTLE) "<Data>0 0 0 1,5 0 0" END FOOT},
    {LOXO_ERR_MALFORMED, 5, "number 2 is none of its type",
     HEAD ROOT ASCII_POINTS TRIANGLES(ROW, "1", "ASCII", LITTLE) "<Data>0 1 1.5" END FOOT},
    {LOXO_ERR_MALFORMED, 5, "number 2 is none of its type",
     HEAD ROOT ASCII_POINTS TRIANGLES(ROW, "1", "ASCII", LITTLE) "<Data>0 1 4294967298" END FOOT},
    {LOXO_ERR_MALFORMED, 5, "face 0: vertex index 4 not in 0..3",
     HEAD ROOT ASCII_POINTS TRIANGLES(ROW, "1", "ASCII", LITTLE) "<Data>0 1 4" END FOOT},
    {LOXO_ERR_MALFORMED, 5, "face 0: vertex index -1 not in 0..3",
     HEAD ROOT ASCII_POINTS TRIANGLES(ROW, "1", "ASCII", LITTLE) "<Data>0 1 -1" END FOOT},
    {LOXO_ERR_MALFORMED, 3, "vertex 1: a coordinate is not a finite number",
     HEAD ROOT POINTS("FLOAT32", ROW, "4", "ASCII", LITTLE) "<Data>0 0 0 1 nan 0 0 1 0 0 0 1" END ASCII_TRIANGLES FOOT},
    /* Base64 and zlib */
    {LOXO_ERR_MALFORMED, 3, "not valid Base64", HEAD ROOT BASE64_POINTS("1", "AAAAAAAAAAAAAAA*") FOOT},
    {LOXO_ERR_MALFORMED, 3, "not valid Base64", HEAD ROOT BASE64_POINTS("1", "AAAAAAAAAAAAAAA") FOOT},
    {LOXO_ERR_MALFORMED, 3, "not valid Base64", HEAD ROOT BASE64_POINTS("1", "AAAA=AAA") FOOT},
    {LOXO_ERR_MALFORMED, 3, "make 12 bytes, the data holds 3", HEAD ROOT BASE64_POINTS("1", "AAAA") FOOT},
    {LOXO_ERR_MALFORMED, 3, "make 12 bytes, the data holds more than 12",
     HEAD ROOT BASE64_POINTS("1", "AAAAAAAAAAAAAAAAAAAA") FOOT},
    {LOXO_ERR_MALFORMED, 3, "ends early", HEAD ROOT GZIP_POINTS("4", "eJxjYEAGDfYMePkH7AEo") FOOT},
    {LOXO_ERR_MALFORMED, 3, "compressed data", HEAD ROOT GZIP_POINTS("4", "eJxjYEAGDfYMePkH7AEoPQJ3") FOOT},
    {LOXO_ERR_MALFORMED, 3, "compressed data", HEAD ROOT GZIP_POINTS("4", "AAAAAAAAAAAAAAAA") FOOT},
    {LOXO_ERR_MALFORMED, 3, "make 36 bytes, the data holds more than 36",
     HEAD ROOT GZIP_POINTS("3", "eJxjYEAGDfYMePkH7AEoPQJ+") FOOT},
    {LOXO_ERR_MALFORMED, 3, "make 24000000000 bytes, the data holds 48",
     HEAD ROOT GZIP_POINTS("2000000000", "eJxjYEAGDfYMePkH7AEoPQJ+") FOOT},
    /* attacks */
    {LOXO_ERR_UNSUPPORTED, 3, "never opened",
     HEAD ROOT "<DataArray Intent=\"NIFTI_INTENT_POINTSET\" DataType=\"NIFTI_TYPE_FLOAT32\" Dimensionality=\"2\" "
               "Dim0=\"4\" Dim1=\"3\" Encoding=\"ExternalFileBinary\" Endian=\"LittleEndian\" "
               "ExternalFileName=\"../../etc/passwd\" ExternalFileOffset=\"0\"><Data/></DataArray>" FOOT},
    {LOXO_ERR_MALFORMED, 2, "declarations of its own",
     HEAD "<!DOCTYPE GIFTI [<!ENTITY x SYSTEM \"file:///etc/passwd\">]>\n" ROOT ASCII_POINTS "&x;" FOOT},
    {LOXO_ERR_MALFORMED, 2, "declarations of its own",
     HEAD "<!DOCTYPE GIFTI [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;&a;\">]>\n" ROOT ASCII_POINTS
          "&b;" FOOT},
    {LOXO_ERR_MALFORMED, 4, "an entity that is not defined", HEAD DOCTYPE ROOT "&lol;" ASCII_POINTS FOOT},
    {LOXO_ERR_MALFORMED, 3, "XML: undefined entity", HEAD ROOT "&lol;" ASCII_POINTS FOOT},
};

TEST(bad_files_say_what_and_where)
{
    int n_wrong = 0;
    for (size_t i = 0; i < sizeof bad_files / sizeof bad_files[0]; ++i) {
        const bad_file *bad = &bad_files[i];
        loxo_soup soup;
        loxo_context_reset_peak(test_context);
        const loxo_status status = read_text(bad->text, &soup);
        const loxo_failure *failure = loxo_context_failure(test_context);
        if (status != bad->status || failure->line != bad->line || strstr(failure->text, bad->reason) == NULL) {
            print_error("row %zu: %s, line %lld: %s\nwanted %s, line %lld: %s\n", i, loxo_status_name(status),
                        (long long)failure->line, failure->text, loxo_status_name(bad->status), (long long)bad->line,
                        bad->reason);
            ++n_wrong;
        }
        CHECK_TEXT(failure->file, "t.surf.gii");
        CHECK(soup.position_float == NULL && soup.triangle == NULL);
        CHECK(loxo_context_memory(test_context).peak_bytes < 1 << 18);
        CHECK_EQUAL(loxo_context_memory(test_context).current_bytes, 0);
    }
    CHECK_EQUAL(n_wrong, 0);
}

TEST(every_cut_is_an_error)
{
    const char good[] = HEAD DOCTYPE ROOT ASCII_POINTS ASCII_TRIANGLES FOOT;
    for (size_t n = 0; n + 2 < sizeof good; ++n) {
        loxo_soup soup;
        CHECK_STATUS(test_context, loxo_read_gifti(test_context, (const uint8_t *)good, n, "cut", &soup),
                     LOXO_ERR_MALFORMED);
    }
}

TEST(depth_and_long_tags_are_bounded)
{
    const size_t n = (size_t)3 << 20, n_head = sizeof HEAD ROOT - 1;
    char *text = malloc(n + 1);
    loxo_soup soup;
    CHECK(text != NULL);
    memcpy(text, HEAD ROOT, n_head);
    for (size_t i = 0; i + 3 <= n - n_head; i += 3)
        memcpy(text + n_head + i, "<a>", 3);
    text[n_head + (n - n_head) / 3 * 3] = '\0';
    CHECK_STATUS(test_context, read_text(text, &soup), LOXO_ERR_LIMIT);
    CHECK_EQUAL(loxo_context_failure(test_context)->line, 3);
    memset(text + n_head, 'x', n - n_head);
    memcpy(text + n_head, "<a b=\"", 6);
    CHECK_STATUS(test_context, read_text(text, &soup), LOXO_ERR_LIMIT);
    CHECK(strstr(loxo_context_failure(test_context)->text, "1 MiB") != NULL);
    free(text);
}

TEST(a_wrong_number_of_arrays_is_a_warning)
{
    loxo_soup soup;
    CHECK_OK(read_text(HEAD "<GIFTI NumberOfDataArrays=\"3\">" ASCII_POINTS ASCII_TRIANGLES FOOT, &soup));
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 1);
    loxo_soup_destroy(test_context, &soup);
}

TEST(a_column_of_floats_becomes_a_field)
{
    loxo_soup soup;
    CHECK_OK(read_text(HEAD "<GIFTI>" ASCII_POINTS ASCII_TRIANGLES
                            "<DataArray Intent=\"NIFTI_INTENT_SHAPE\" DataType=\"NIFTI_TYPE_FLOAT64\" "
                            "Dimensionality=\"1\" Dim0=\"4\" Encoding=\"ASCII\"><MetaData><MD><Name>Name</Name>"
                            "<Value><![CDATA[thick & thin]]></Value></MD><MD><Name>b</Name><Value>c</Value></MD>"
                            "</MetaData><Data>1 2 inf 0.1" END FOOT,
                       &soup));
    CHECK_EQUAL(soup.n_fields, 1);
    CHECK_TEXT(soup.fields[0].name, "thick & thin");
    CHECK_EQUAL(soup.fields[0].value[3], 0.1);
    CHECK(isinf(soup.fields[0].value[2]));
    loxo_soup_destroy(test_context, &soup);
}

/* Of a closed surface, signed. */
static double volume_of(const loxo_soup *soup)
{
    double sum = 0.0;
    for (int64_t f = 0; f < soup->n_faces; ++f) {
        double p[3][3];
        for (int c = 0; c < 9; ++c)
            p[c / 3][c % 3] = (double)soup->position_float[3 * (int64_t)soup->triangle[3 * f + c / 3] + c % 3];
        sum += p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) + p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
               p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
    }
    return sum / 6.0;
}

TEST(real_surfaces)
{
    const char *names[] = {"meshes/surfaces/fsLR32k.L.white.surf.gii", "meshes/surfaces/fsLR32k.L.pial.surf.gii",
                           "meshes/surfaces/conte69.L.32k.gii"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        const char *path = test_shared(names[i]);
        loxo_soup soup;
        if (path == NULL) SKIP();
        CHECK_OK(loxo_read_mesh(test_context, path, NULL, &soup));
        CHECK_EQUAL(soup.n_vertices, 32492);
        CHECK_EQUAL(soup.n_faces, 64980);
        CHECK(volume_of(&soup) > 1e5 &&
              volume_of(&soup) < 1e6); /* a hemisphere in cubic millimetres, turned outwards */
        loxo_soup_destroy(test_context, &soup);
    }
}

static loxo_status read_once(loxo_context *ctx, void *arg)
{
    loxo_soup soup;
    const char *text = arg;
    const loxo_status status = loxo_read_gifti(ctx, (const uint8_t *)text, strlen(text), "t.surf.gii", &soup);
    loxo_soup_destroy(ctx, &soup);
    return status;
}

TEST(every_allocation_may_fail)
{
    char text[] = HEAD ROOT GZIP_POINTS("4", "eJxjYEAGDfYMePkH7AEoPQJ+") ASCII_TRIANGLES FOOT;
    CHECK(test_each_allocation_fails(read_once, text) >= 6);
}
