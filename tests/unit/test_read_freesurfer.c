/* SPDX-License-Identifier: MIT
 * FreeSurfer's binary surfaces: good ones, and a table of bad ones with the status and place each must give. */
#include "test.h"

#include <loxo/io.h>

static uint8_t file[4096];
static size_t n_file;

static void put(const void *bytes, size_t n)
{
    CHECK(n_file + n <= sizeof file);
    memcpy(file + n_file, bytes, n);
    n_file += n;
}

static void put_u32(uint32_t value)
{
    const uint8_t bytes[4] = {(uint8_t)(value >> 24), (uint8_t)(value >> 16), (uint8_t)(value >> 8), (uint8_t)value};
    put(bytes, 4);
}

static void put_float(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, 4);
    put_u32(bits);
}

/* A tetrahedron of 4 vertices, 4 faces: 3 + 11 + 8 + 48 + 48 bytes. */
static void make(const char *comment, uint32_t n_vertices, uint32_t n_faces)
{
    const float position[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1.5f};
    const uint32_t triangle[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    n_file = 0;
    put("\xff\xff\xfe", 3);
    put(comment, strlen(comment));
    put_u32(n_vertices);
    put_u32(n_faces);
    for (int i = 0; i < 12; ++i)
        put_float(position[i]);
    for (int i = 0; i < 12; ++i)
        put_u32(triangle[i]);
}

#define COMMENT   "by a test\n\n"
#define AT_COUNTS 14
#define AT_VERTEX 22
#define AT_FACE   70

static loxo_status read_file(loxo_soup *soup)
{
    return loxo_read_mesh_memory(test_context, file, n_file, "lh.test", NULL, soup);
}

static void check_good(int64_t n_vertices, int64_t n_faces)
{
    loxo_soup soup;
    CHECK_OK(read_file(&soup));
    CHECK_EQUAL(soup.n_vertices, n_vertices);
    CHECK_EQUAL(soup.n_faces, n_faces);
    CHECK(soup.position == NULL);
    CHECK_EQUAL(soup.position_float[11], 1.5f);
    CHECK_EQUAL(soup.triangle[1], 2);
    CHECK_EQUAL(soup.triangle[11], 3);
    loxo_soup_destroy(test_context, &soup);
}

TEST(a_tetrahedron_is_read)
{
    make(COMMENT, 4, 4);
    check_good(4, 4);
    put("FreeSurfer's tags may follow", 28);
    check_good(4, 4);
    make("one line end only\n", 4, 4);
    check_good(4, 4);
    make("\n\n", 4, 4);
    check_good(4, 4);
}

static void check_bad(loxo_status expected, int64_t byte, int64_t element, const char *text)
{
    loxo_soup soup;
    const loxo_failure *failure;
    loxo_context_clear(test_context);
    CHECK_STATUS(test_context, read_file(&soup), expected);
    failure = loxo_context_failure(test_context);
    CHECK_TEXT(failure->file, "lh.test");
    CHECK_EQUAL(failure->byte, byte);
    CHECK_EQUAL(failure->element, element);
    if (strstr(failure->text, text) == NULL) CHECK_TEXT(failure->text, text);
    CHECK(soup.position_float == NULL && soup.triangle == NULL && soup.n_vertices == 0 && soup.n_faces == 0);
}

TEST(counts_that_the_file_cannot_bear)
{
    const uint32_t bad[][2] = {{5, 4}, {4, 5}, {0xffffffffu, 4}, {4, 0xffffffffu}, {0x80000000u, 0x80000000u}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        loxo_context_reset_peak(test_context);
        make(COMMENT, bad[i][0], bad[i][1]);
        check_bad(LOXO_ERR_MALFORMED, AT_COUNTS, -1, "(is the file cut?)");
        CHECK(loxo_context_memory(test_context).peak_bytes < 1000);
    }
    make(COMMENT, 0x04000000u, 0x04000000u);
    check_bad(LOXO_ERR_MALFORMED, AT_COUNTS, -1, "(byte order?)");
}

TEST(bad_indices_and_coordinates)
{
    make(COMMENT, 4, 4);
    file[AT_FACE + 12 * 2 + 4 + 3] = 4;
    check_bad(LOXO_ERR_MALFORMED, AT_FACE + 12 * 2 + 4, 2, "face 2: vertex index 4 not in 0..3");
    make(COMMENT, 4, 4);
    file[AT_FACE] = 0xff;
    check_bad(LOXO_ERR_MALFORMED, AT_FACE, 0, "face 0: vertex index -16777216 not in 0..3");
    make(COMMENT, 4, 4);
    for (int i = 0; i < 12; ++i)
        file[AT_FACE + 4 * i + 3]++;
    check_bad(LOXO_ERR_MALFORMED, AT_FACE + 12 + 8, 1, "(are they counted from 1?)");
    make(COMMENT, 4, 4);
    memcpy(file + AT_VERTEX + 12 + 4, "\x7f\x80\x00\x00", 4);
    check_bad(LOXO_ERR_MALFORMED, AT_VERTEX + 12, 1, "vertex 1: a coordinate is not a finite number");
}

TEST(other_magic_and_cuts)
{
    loxo_read_settings settings = loxo_read_settings_default();
    loxo_soup soup;
    make(COMMENT, 4, 4);
    file[2] = 0xff;
    check_bad(LOXO_ERR_UNSUPPORTED, 0, -1, "quadrangles");
    settings.format = LOXO_FORMAT_FREESURFER;
    for (size_t cut = 0; cut < AT_FACE + 48; ++cut) {
        make(COMMENT, 4, 4);
        CHECK_STATUS(test_context, loxo_read_mesh_memory(test_context, file, cut, "x", &settings, &soup),
                     LOXO_ERR_MALFORMED);
    }
    make("no line end", 4, 4);
    for (size_t i = 0; i < n_file; ++i)
        if (file[i] == '\n') file[i] = ' ';
    check_bad(LOXO_ERR_MALFORMED, (int64_t)n_file, -1, "the file ends within the comment line");
}

TEST(an_unused_vertex_may_be_nan)
{
    loxo_soup soup;
    make(COMMENT, 4, 1); /* the other faces are bytes behind the end */
    memcpy(file + AT_VERTEX + 36, "\x7f\xc0\x00\x00", 4);
    CHECK_OK(read_file(&soup));
    CHECK_EQUAL(soup.n_faces, 1);
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 1);
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

TEST(the_template_of_freesurfer)
{
    const char *path = test_shared("meshes/surfaces/fsaverage5.lh.white");
    loxo_soup soup;
    if (path == NULL) SKIP();
    CHECK_OK(loxo_read_mesh(test_context, path, NULL, &soup));
    CHECK_EQUAL(soup.n_vertices, 10242);
    CHECK_EQUAL(soup.n_faces, 20480);
    CHECK(volume_of(&soup) > 1e5 && volume_of(&soup) < 1e6); /* a hemisphere in cubic millimetres, turned outwards */
    loxo_soup_destroy(test_context, &soup);
}

static loxo_status read_once(loxo_context *ctx, void *arg)
{
    loxo_soup soup;
    (void)arg;
    const loxo_status status = loxo_read_mesh_memory(ctx, file, n_file, "lh.test", NULL, &soup);
    loxo_soup_destroy(ctx, &soup);
    return status;
}

TEST(every_allocation_may_fail)
{
    make(COMMENT, 4, 4);
    CHECK(test_each_allocation_fails(read_once, NULL) >= 2);
}
