/* SPDX-License-Identifier: MIT
 * Counts of a file without reading it. Every file of the readers' own tests is counted there (reading.h); here is what
 * they do not hold: sizes, gzip, streams, memory, what goes wrong. */
#include "reading.h"

#include <fcntl.h>

static loxo_mesh_counts count(const char *path, bool is_thorough)
{
    loxo_mesh_counts counts;
    CHECK_OK(loxo_read_counts(test_context, path, NULL, is_thorough, &counts));
    return counts;
}

/* A fan of n - 2 triangles around a polygon of n corners; as one polygon, or cut. */
static void fan_off(text_buffer *b, int n, bool is_cut)
{
    text_add(b, "OFF # a fan\n%d %d 0\n", n, is_cut ? n - 2 : 1);
    for (int i = 0; i < n; ++i)
        text_add(b, "%.17g %.17g 0\n", cos(2 * i * 3.14159265358979 / n), sin(2 * i * 3.14159265358979 / n));
    if (!is_cut) text_add(b, "\n# one face\n%d", n);
    for (int i = 0; i < n && !is_cut; ++i)
        text_add(b, " %d", i);
    for (int i = 1; i < n - 1 && is_cut; ++i)
        text_add(b, "3 0 %d %d\n", i, i + 1);
    text_add(b, "\n");
}

TEST(a_pass_finds_what_a_head_cannot_tell)
{
    const int n = 20000; /* more than the head holds */
    for (int is_cut = 0; is_cut < 2; ++is_cut) {
        const char *path = test_scratch("fan.off");
        text_buffer b = {0};
        fan_off(&b, n, is_cut != 0);
        write_scratch(path, b.text, b.n);
        loxo_mesh_counts counts = count(path, false);
        CHECK_EQUAL(counts.format, LOXO_FORMAT_OFF);
        CHECK_EQUAL(counts.n_vertices, n);
        CHECK_EQUAL(counts.n_faces, is_cut != 0 ? n - 2 : 1);
        loxo_context_reset_peak(test_context);
        counts = count(path, true);
        CHECK(loxo_context_memory(test_context).peak_bytes < 1000000);
        CHECK_EQUAL(counts.n_vertices, n);
        CHECK_EQUAL(counts.n_faces, n - 2);
        CHECK(!counts.is_float);
        loxo_soup soup;
        loxo_context_reset_peak(test_context);
        CHECK_OK(loxo_read_mesh(test_context, path, NULL, &soup));
        const double peak = (double)loxo_context_memory(test_context).peak_bytes;
        if (is_cut != 0) CHECK_NEAR((double)counts.read_bytes, peak, 0.2e6); /* small blocks */
        loxo_soup_destroy(test_context, &soup);
        text_free(&b);
    }
}

TEST(polygons_of_a_binary_file_are_told_by_its_size)
{
    static const char header[] = "ply\nformat binary_little_endian 1.0\nelement vertex 6\nproperty float x\n"
                                 "property float y\nproperty float z\nproperty float heat\nelement face 2\n"
                                 "property list uchar int vertex_indices\nproperty uchar flag\nend_header\n";
    static const float vertices[6][4] = {{0, 0, 0, 1}, {1, 0, 0, 1}, {2, 0, 0, 1},
                                         {2, 1, 0, 1}, {1, 1, 0, 1}, {0, 1, 0, 1}};
    const int32_t quad[] = {0, 1, 4, 5}, triangle[] = {1, 2, 3};
    const char *path = test_scratch("two.ply");
    text_buffer b = {0};
    bytes_add(&b, header, sizeof header - 1);
    bytes_add(&b, vertices, sizeof vertices);
    bytes_add(&b, "\4", 1);
    bytes_add(&b, quad, sizeof quad);
    bytes_add(&b, "\0\3", 2);
    bytes_add(&b, triangle, sizeof triangle);
    bytes_add(&b, "\0", 1);
    write_scratch(path, b.text, b.n);
    const loxo_mesh_counts counts = count(path, false);
    CHECK_EQUAL(counts.n_vertices, 6);
    CHECK_EQUAL(counts.n_faces, 3);
    CHECK_EQUAL(counts.n_fields, 1);
    CHECK(counts.is_float);
    text_free(&b);
}

TEST(what_the_file_cannot_hold_is_no_count)
{
    static const char *const lies[] = {
        "ply\nformat binary_little_endian 1.0\nelement vertex 2000000000\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\nabc",
        "OFF\n5 4000000000 0\n0 0 0\n",
        "\xff\xff\xfe"
        "by hand\n\n\x7f\x7f\x7f\x7f\0\0\0\1",
    };
    for (size_t i = 0; i < 3; ++i) {
        loxo_mesh_counts counts = {.n_vertices = 7};
        const char *path = test_scratch("lie");
        write_scratch(path, lies[i], i == 2 ? 20 : strlen(lies[i]));
        const loxo_status status = loxo_read_counts(test_context, path, NULL, i % 2 != 0, &counts);
        CHECK(status < 0 || counts.n_vertices == -1);
    }
}

TEST(arguments_that_cannot_be)
{
    loxo_mesh_counts counts;
    const loxo_read_settings odd = {.format = (loxo_format)77};
    const char *path = test_scratch("a.obj");
    CHECK_STATUS(test_context, loxo_read_counts(test_context, NULL, NULL, true, &counts), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_read_counts(test_context, path, NULL, true, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_read_counts(test_context, path, &odd, true, &counts), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_read_counts(test_context, path, NULL, true, &counts), LOXO_ERR_READ);
    CHECK_TEXT(loxo_context_failure(test_context)->file, path);
    write_scratch(path, "", 0);
    CHECK_STATUS(test_context, loxo_read_counts(test_context, path, NULL, true, &counts), LOXO_ERR_MALFORMED);
}

static int stop_at_once(void *user, const loxo_progress *progress)
{
    (void)user;
    return strcmp(progress->phase, "count") == 0;
}

static loxo_status count_file(loxo_context *ctx, void *name)
{
    loxo_mesh_counts counts;
    return loxo_read_counts(ctx, test_scratch(name), NULL, true, &counts);
}

TEST(a_pass_is_stopped_and_every_allocation_may_fail)
{
    static char long_name[] = "long.obj", fan_name[] = "fan.off";
    text_buffer b = {0};
    for (int i = 0; i < 3000000; ++i)
        bytes_add(&b, "v 1 2 3\n", 8);
    write_scratch(test_scratch(long_name), b.text, b.n);
    loxo_context_set_monitor(test_context, stop_at_once, NULL);
    CHECK_STATUS(test_context, count_file(test_context, long_name), LOXO_ERR_STOPPED);
    loxo_context_set_monitor(test_context, NULL, NULL);
    CHECK_EQUAL(count(test_scratch(long_name), true).n_vertices, 3000000);
    write_scratch(test_scratch(long_name), b.text, 8000);
    CHECK(test_each_allocation_fails(count_file, long_name) >= 2);
    text_free(&b);
    fan_off(&b, 10, true);
    write_scratch(test_scratch(fan_name), b.text, b.n);
    CHECK(test_each_allocation_fails(count_file, fan_name) >= 2);
    text_free(&b);
}

TEST(a_dash_is_counted_as_it_comes)
{
    const int kept = dup(STDIN_FILENO);
    text_buffer b = {0};
    fan_off(&b, 5000, false);
    const char *path = test_scratch("in.off");
    write_scratch(path, b.text, b.n);
    const int fd = open(path, O_RDONLY);
    CHECK(fd >= 0 && dup2(fd, STDIN_FILENO) == STDIN_FILENO);
    const loxo_mesh_counts counts = count("-", true);
    dup2(kept, STDIN_FILENO);
    close(kept);
    close(fd);
    CHECK_EQUAL(counts.n_vertices, 5000);
    CHECK_EQUAL(counts.n_faces, 4998);
    text_free(&b);
}

#ifdef LOXO_WITH_ZLIB

TEST(gzip_is_unpacked_on_the_way)
{
    static char name[] = "fan.off.gz";
    text_buffer b = {0}, packed = {0};
    loxo_mesh_counts counts;
    const char *path = test_scratch(name);
    fan_off(&b, 30000, false);
    gzip_add(&packed, b.text, 70000); /* two members, cut anywhere */
    gzip_add(&packed, b.text + 70000, b.n - 70000);
    bytes_add(&packed, "\0\0\0\0", 4);
    write_scratch(path, packed.text, packed.n);
    counts = count(path, true);
    CHECK_EQUAL(counts.n_vertices, 30000);
    CHECK_EQUAL(counts.n_faces, 29998);
    CHECK(counts.read_bytes > b.n + packed.n);
    CHECK_EQUAL(count(path, false).n_vertices, 30000);
    CHECK(test_each_allocation_fails(count_file, name) >= 3);
    for (size_t n = 2; n < packed.n - 4; n = n * 2 + 1) { /* a cut shows, if not in the head */
        write_scratch(path, packed.text, n);
        CHECK_STATUS(test_context, loxo_read_counts(test_context, path, NULL, true, &counts), LOXO_ERR_MALFORMED);
    }
    text_free(&packed);
    text_free(&b);
}

#endif
