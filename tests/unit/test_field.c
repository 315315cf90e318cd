/* SPDX-License-Identifier: MIT
 * Fields from .npy, text, GIFTI and PLY: every type and byte order, and bad files with status and place. */
#include "io/field.h"
#include "loxo_config.h"

#ifdef LOXO_WITH_EXPAT
#define ALL_FILES "f.npy", "f.csv", "f.shape.gii"
#else
#define ALL_FILES "f.npy", "f.csv"
#endif
#include "test.h"

#include <loxo/io.h>

static char file[4096];
static size_t n_file;
static double *value;
static int64_t n_values;

static void make_npy(const char *dictionary, const void *data, size_t n_data)
{
    const size_t n = strlen(dictionary);
    memcpy(file, "\x93NUMPY\x01\x00", 8);
    file[8] = (char)(n & 255);
    file[9] = (char)(n >> 8);
    memcpy(file + 10, dictionary, n);
    memcpy(file + 10 + n, data, n_data);
    n_file = 10 + n + n_data;
}

static loxo_status read_npy(void)
{
    loxo_context_clear(test_context);
    return loxo_read_field_bytes(test_context, (const uint8_t *)file, n_file, "a.npy", &value, &n_values);
}

static loxo_status read_text(const char *text)
{
    loxo_context_clear(test_context);
    return loxo_read_field_bytes(test_context, (const uint8_t *)text, strlen(text), "a.csv", &value, &n_values);
}

static void release(void)
{
    loxo_release(test_context, value);
    value = NULL;
}

TEST(npy_of_every_type_and_byte_order)
{
    static const struct {
        const char *type;
        const char *bytes; /* of -2 and 3, or 2 and 3 where there is no sign */
        size_t n;
        double first;
    } rows[] = {
        {"<f8", "\0\0\0\0\0\0\0\xc0\0\0\0\0\0\0\x08\x40", 16, -2},
        {">f8", "\xc0\0\0\0\0\0\0\0\x40\x08\0\0\0\0\0\0", 16, -2},
        {"<f4", "\0\0\0\xc0\0\0\x40\x40", 8, -2},
        {">f4", "\xc0\0\0\0\x40\x40\0\0", 8, -2},
        {"<f2", "\0\xc0\0\x42", 4, -2},
        {">f2", "\xc0\0\x42\0", 4, -2},
        {"|i1", "\xfe\x03", 2, -2},
        {"|u1", "\x02\x03", 2, 2},
        {"<i2", "\xfe\xff\x03\0", 4, -2},
        {">i2", "\xff\xfe\0\x03", 4, -2},
        {"<u2", "\x02\0\x03\0", 4, 2},
        {"<i4", "\xfe\xff\xff\xff\x03\0\0\0", 8, -2},
        {">u4", "\0\0\0\x02\0\0\0\x03", 8, 2},
        {"<i8", "\xfe\xff\xff\xff\xff\xff\xff\xff\x03\0\0\0\0\0\0\0", 16, -2},
        {">i8", "\xff\xff\xff\xff\xff\xff\xff\xfe\0\0\0\0\0\0\0\x03", 16, -2},
        {"<u8", "\x02\0\0\0\0\0\0\0\x03\0\0\0\0\0\0\0", 16, 2},
    };
    const char *shapes[] = {"(2,)", "(2, 1)", "(2L,)", "(2,1,1,)"};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; ++i) {
        char dictionary[128];
        snprintf(dictionary, sizeof dictionary, "{'descr': '%s', 'fortran_order': %s, 'shape': %s, }   \n",
                 rows[i].type, i % 2 == 0 ? "False" : "True", shapes[i % 4]);
        make_npy(dictionary, rows[i].bytes, rows[i].n);
        CHECK_OK(read_npy());
        CHECK_EQUAL(n_values, 2);
        CHECK_EQUAL(value[0], rows[i].first);
        CHECK_EQUAL(value[1], 3.0);
        release();
    }
    make_npy("{\"shape\":(3,),\"fortran_order\":False,\"descr\":\"|b1\"}", "\0\1\1", 3);
    CHECK_OK(read_npy());
    CHECK_EQUAL(value[0] + value[1] + value[2], 2.0);
    release();
    make_npy("{'descr': '<f2', 'fortran_order': False, 'shape': (4,)}", "\x01\0\0\x7c\0\x7e\xff\x7b", 8);
    CHECK_OK(read_npy());
    CHECK_EQUAL(value[0], 0x1p-24);
    CHECK(isinf(value[1]) && isnan(value[2]));
    CHECK_EQUAL(value[3], 65504.0);
    release();
}

#define GOOD "{'descr': '<f8', 'fortran_order': False, 'shape': (1,)}"

TEST(bad_npy)
{
    static const struct {
        loxo_status status;
        const char *reason, *dictionary;
    } rows[] = {
        {LOXO_ERR_MALFORMED, "2000000000 numbers are announced, the file holds 1",
         "{'descr': '<f8', 'fortran_order': False, 'shape': (2000000000,)}"},
        {LOXO_ERR_MALFORMED, "are announced",
         "{'descr': '<f8', 'fortran_order': False, 'shape': (2305843009213693953,)}"},
        {LOXO_ERR_MALFORMED, "dictionary",
         "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999,)}"},
        {LOXO_ERR_MALFORMED, "dictionary", "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,)}"},
        {LOXO_ERR_MALFORMED, "dictionary", "{'descr': '<f8', 'fortran_order': False}"},
        {LOXO_ERR_MALFORMED, "dictionary", "{'descr': '<f8', 'descr': '<f8', 'fortran_order': False, 'shape': (1,)}"},
        {LOXO_ERR_MALFORMED, "dictionary", "{'descr': '<f8', 'fortran_order': False, 'shape': (1,), 'x': 1}"},
        {LOXO_ERR_MALFORMED, "dictionary", "{'descr': '<f8', 'fortran_order': False, 'shape': (1,)} x"},
        {LOXO_ERR_MALFORMED, "dictionary", "{'descr': '<f8"},
        {LOXO_ERR_MALFORMED, "dictionary", ""},
        {LOXO_ERR_UNSUPPORTED, "not of one dimension", "{'descr': '<f8', 'fortran_order': False, 'shape': (1,2)}"},
        {LOXO_ERR_UNSUPPORTED, "not of one dimension", "{'descr': '<f8', 'fortran_order': False, 'shape': ()}"},
        {LOXO_ERR_UNSUPPORTED, "neither", "{'descr': '<c8', 'fortran_order': False, 'shape': (1,)}"},
        {LOXO_ERR_UNSUPPORTED, "neither", "{'descr': '<f16', 'fortran_order': False, 'shape': (1,)}"},
        {LOXO_ERR_UNSUPPORTED, "neither", "{'descr': '|O', 'fortran_order': False, 'shape': (1,)}"},
        {LOXO_ERR_UNSUPPORTED, "records", "{'descr': [('x', '<f8')], 'fortran_order': False, 'shape': (1,)}"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; ++i) {
        loxo_context_reset_peak(test_context);
        make_npy(rows[i].dictionary, "\0\0\0\0\0\0\0\0", 8);
        CHECK_STATUS(test_context, read_npy(), rows[i].status);
        if (strstr(loxo_context_failure(test_context)->text, rows[i].reason) == NULL)
            CHECK_TEXT(loxo_context_failure(test_context)->text, rows[i].reason);
        CHECK_TEXT(loxo_context_failure(test_context)->file, "a.npy");
        CHECK(loxo_context_memory(test_context).peak_bytes < 1000);
    }
    make_npy(GOOD, "\0\0\0\0\0\0\0\0", 8);
    const size_t n_all = n_file;
    for (n_file = 0; n_file < n_all; ++n_file)
        CHECK_STATUS(test_context, read_npy(), LOXO_ERR_MALFORMED);
    n_file = n_all;
    file[6] = 4;
    CHECK_STATUS(test_context, read_npy(), LOXO_ERR_UNSUPPORTED);
    CHECK_EQUAL(loxo_context_failure(test_context)->byte, 6);
    make_npy(GOOD, "\0\0\0\0\0\0\0\0xy", 10);
    CHECK_OK(read_npy());
    CHECK_EQUAL(loxo_context_warning(test_context, 0)->count, 2);
    release();
}

TEST(text_in_its_forms)
{
    static const char *const rows[] = {
        "1\n2.5\n-inf\n",
        "1\r\n2.5\r\n-inf",
        "1\r2.5\r-inf\r",
        "\xef\xbb\xbfheat\n1\n2.5\n-inf\n",
        "# made by hand\n\n  1\n2.5  \n\n-inf\n",
        "vertex,heat\n0,1\n1,2.5\n2,-inf\n",
        "vertex , \"he,at\"\n0 , 1\n1 , 2.5\n2 , -inf\n",
        "geodesic distance (mm)\n1\n2.5\n-inf\n",
        "vertex heat\n0 1\n1 2.5\n2 -inf\n",
        "1;1\n2;2.5\n3;-inf\n",
        "0 1\n1\t2.5\n2  -inf\n",
        "x,y,heat\n7,8,1\n9,7,2.5\n1,2,-inf\n",
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; ++i) {
        CHECK_OK(read_text(rows[i]));
        CHECK_EQUAL(n_values, 3);
        CHECK_EQUAL(value[0], 1.0);
        CHECK_EQUAL(value[1], 2.5);
        CHECK(isinf(value[2]) && value[2] < 0);
        release();
    }
}

TEST(bad_text)
{
    static const struct {
        int64_t line;
        const char *reason, *text;
    } rows[] = {
        {0, "empty file", ""},
        {0, "no number", "\n\n"},
        {0, "no number", "heat\n"},
        {1, "decimal comma", "3,5\n2,5\n"},
        {3, "decimal comma", "0,5\n1,5\n1,5\n"},
        {2, "\"1.5abc\" is not a number", "1\n1.5abc\n"},
        {2, "\"0x10\" is not a number", "1\n0x10\n"},
        {3, "2 columns where the lines before have 1", "heat\n1\n1 2\n"},
        {4, "in the first column", "vertex,heat\n0,1\n1,2\n3,3\n"},
        {2, "2 columns where", "1\n2,\n"},
        {1, "neither a number nor a name", "1.5x\n2\n"},
        {2, "\"two\" is not a number", "one\ntwo\n3\n"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; ++i) {
        const loxo_status status = read_text(rows[i].text);
        const loxo_failure *failure = loxo_context_failure(test_context);
        if (status != LOXO_ERR_MALFORMED || failure->line != rows[i].line ||
            strstr(failure->text, rows[i].reason) == NULL) {
            print_error("row %zu: line %lld: %s\n", i, (long long)failure->line, failure->text);
            CHECK_TEXT(failure->text, rows[i].reason);
            CHECK(false);
        }
    }
    loxo_context_clear(test_context);
    CHECK_STATUS(test_context,
                 loxo_read_field_bytes(test_context, (const uint8_t *)"1\n\0002\n", 6, "a", &value, &n_values),
                 LOXO_ERR_MALFORMED);
    CHECK(strstr(loxo_context_failure(test_context)->text, "NUL") != NULL);
    CHECK_STATUS(test_context,
                 loxo_read_field_bytes(test_context,
                                       (const uint8_t *)"\xff\xfe"
                                                        "1\0\n\0",
                                       6, "a", &value, &n_values),
                 LOXO_ERR_MALFORMED);
    CHECK(strstr(loxo_context_failure(test_context)->text, "UTF-16") != NULL);
}

/* Every writer of fields, and back. */
TEST(fields_come_back)
{
    const char *names[] = {ALL_FILES};
    double out[1000];
    for (int i = 0; i < 1000; ++i)
        out[i] = i % 7 == 0 ? (double)INFINITY : sqrt(i) * pow(10.0, i % 40 - 20);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        const char *path = test_scratch(names[i]);
        CHECK_OK(loxo_write_field(test_context, path, "a & <b>", out, 1000, NULL));
        CHECK_OK(loxo_read_field(test_context, path, &value, &n_values));
        CHECK_EQUAL(n_values, 1000);
        CHECK(memcmp(value, out, sizeof out) == 0);
        release();
    }
}

TEST(a_property_of_a_ply)
{
    const char ply[] =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "property double heat\nproperty double mark\nelement face 1\nproperty list uchar int vertex_indices\n"
        "end_header\n0 0 0 0.5 7\n1 0 0 1.5 8\n0 1 0 2.5 9\n3 0 1 2\n";
    char path[4200];
    CHECK_OK(loxo_write_bytes(test_context, test_scratch("p.ply"), ply, sizeof ply - 1));
    snprintf(path, sizeof path, "%s:heat", test_scratch("p.ply"));
    CHECK_OK(loxo_read_field(test_context, path, &value, &n_values));
    CHECK_EQUAL(n_values, 3);
    CHECK_EQUAL(value[2], 2.5);
    release();
    snprintf(path, sizeof path, "%s:cold", test_scratch("p.ply"));
    CHECK_STATUS(test_context, loxo_read_field(test_context, path, &value, &n_values), LOXO_ERR_MALFORMED);
    CHECK_STATUS(test_context, loxo_read_field(test_context, test_scratch("p.ply"), &value, &n_values),
                 LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_read_field(test_context, test_scratch("none.npy"), &value, &n_values),
                 LOXO_ERR_READ);
    CHECK_STATUS(test_context, loxo_read_field(test_context, NULL, &value, &n_values), LOXO_ERR_ARGUMENT);
}

TEST(exact_distances_beside_the_project)
{
    const char *path = test_shared("meshes/exact/igea_from0.npy");
    if (path == NULL) SKIP();
    CHECK_OK(loxo_read_field(test_context, path, &value, &n_values));
    CHECK_EQUAL(n_values, 134345);
    CHECK_EQUAL(value[0], 0.0);
    release();
}

static loxo_status read_all(loxo_context *ctx, void *arg)
{
    const char *names[] = {ALL_FILES};
    loxo_status status = LOXO_OK;
    (void)arg;
    for (size_t i = 0; i < sizeof names / sizeof names[0] && status >= 0; ++i) {
        double *field;
        int64_t n;
        status = loxo_read_field(ctx, test_scratch(names[i]), &field, &n);
        loxo_release(ctx, field);
    }
    return status;
}

TEST(every_allocation_may_fail)
{
    const char *names[] = {ALL_FILES};
    double out[3000];
    for (int i = 0; i < 3000; ++i)
        out[i] = sqrt(i);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i)
        CHECK_OK(loxo_write_field(test_context, test_scratch(names[i]), "x", out, 3000, NULL));
    CHECK(test_each_allocation_fails(read_all, NULL) >= 6);
}
