/* SPDX-License-Identifier: MIT */
#include "reading.h"

#define VERTICES "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
#define TRIANGLE "0 0 0, 1 0 0, 0 1 0 | 0 1 2"

TEST(files_that_are_read)
{
    static const good_file files[] = {
        {"plain", BYTES(VERTICES "f 1 2 3\n"), TRIANGLE, NULL},
        {"no last line end", BYTES(VERTICES "f 1 2 3"), TRIANGLE, NULL},
        {"mark, CR LF, comments",
         BYTES("\xef\xbb\xbf# hi\r\nv 0 0 0 # a\r\nv 1 0 0\r\nv 0 1 0\r\n\r\nf 1 2 3 #f 1 2 3\r\n"), TRIANGLE, NULL},
        {"CR", BYTES("v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r"), TRIANGLE, NULL},
        {"all forms of corners",
         BYTES(VERTICES "vt 0 0\nvn 0 0 1\nf 1/1 2/ 3/1/\nf 1//1 2/1/1 3//\nf -3/-1 -2//-1 -1\n"),
         TRIANGLE ", 0 1 2, 0 1 2", NULL},
        {"vertices behind their faces", BYTES("f 1 2 3\n" VERTICES), TRIANGLE, NULL},
        {"negative ones count from their line", BYTES(VERTICES "f -3 -2 -1\nv 5 5 5\n"),
         "0 0 0, 1 0 0, 0 1 0, 5 5 5 | 0 1 2", NULL},
        {"weights and colours", BYTES("v 0 0 0 1\nv 1 0 0 1 0.5 0.5\nv 0 1 0 1 0 0 0\nf 1 2 3\n"), TRIANGLE, NULL},
        {"lines go on behind a backslash", BYTES("v 0 0\\\n 0\nv 1 0 0\nv 0 \\ \r\n1 0\nf 1\\\n2 \\\n\\\n3\n"),
         TRIANGLE, NULL},
        {"a comment goes on too", BYTES(VERTICES "# a \\\nf 9 9 9\nf 1 2 3\n"), TRIANGLE, NULL},
        {"known lines are passed over",
         BYTES("mtllib ../../etc/passwd\nmtllib /dev/zero\no a\ng b\ns off\nusemtl c\n" VERTICES
               "l 1 2\np 9\nf 1 2 3\n"),
         TRIANGLE, NULL},
        {"unknown lines too, counted", BYTES("call /bin/sh\ncsh rm\n" VERTICES "f 1 2 3\n"), TRIANGLE,
         "2 lines of an unknown kind are skipped (first: line 1, \"call\")"},
        {"a pentagon with a dent", BYTES("v 0 0 0\nv 2 0 0\nv 1 1 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4 5\n"),
         "0 0 0, 2 0 0, 1 1 0, 2 2 0, 0 2 0 | 0 1 2, 2 3 4, 4 0 2", NULL},
        {"small faces", BYTES(VERTICES "f 1 2\nf 1 2 3\nf\n"), TRIANGLE,
         "2 faces with fewer than 3 corners dropped (first: face 0)"},
        {"not finite and unused", BYTES(VERTICES "v nan 0 0\nf 1 2 3\n"), "0 0 0, 1 0 0, 0 1 0, nan 0 0 | 0 1 2",
         "1 vertices that no face uses"},
        {"only vertices", BYTES("v 1 2 3\n"), "1 2 3", "no faces"},
    };
    check_good_files(files, sizeof files / sizeof files[0], "a.obj");
}

TEST(files_that_are_refused)
{
    static const bad_file files[] = {
        {"index 0", BYTES(VERTICES "f 0 1 2\n"), LOXO_ERR_MALFORMED, 4, -1, 0, "face 0: vertex index 0 not in 1..3"},
        {"index nv + 1", BYTES(VERTICES "f 1 2 3\nf 1 2 4\n"), LOXO_ERR_MALFORMED, 5, -1, 1,
         "vertex index 4 not in 1..3"},
        {"-9", BYTES(VERTICES "f 1 2 -9\n"), LOXO_ERR_MALFORMED, 4, -1, 0, "vertex index -9 not in -3..-1"},
        {"-1 before any vertex", BYTES("f -1 -1 -1\n" VERTICES), LOXO_ERR_MALFORMED, 1, -1, 0, "there are no vertices"},
        {"INT_MIN", BYTES(VERTICES "f 1 2 -2147483648\n"), LOXO_ERR_MALFORMED, 4, -1, 0, "-2147483648 not in -3..-1"},
        {"INT64_MIN", BYTES(VERTICES "f 1 2 -9223372036854775808\n"), LOXO_ERR_MALFORMED, 4, -1, 0,
         "-9223372036854775808 not in"},
        {"2^32 + 1", BYTES(VERTICES "f 1 2 4294967297\n"), LOXO_ERR_MALFORMED, 4, -1, 0, "4294967297 not in 1..3"},
        {"23 digits", BYTES(VERTICES "f 1 2 99999999999999999999999\n"), LOXO_ERR_MALFORMED, 4, -1, 0,
         "99999999999999999999999 not in"},
        {"fractional", BYTES(VERTICES "f 1 2 3.0\n"), LOXO_ERR_MALFORMED, 4, -1, 0, "\"3.0\" is not an integer"},
        {"a word", BYTES(VERTICES "f 1 2 x\n"), LOXO_ERR_MALFORMED, 4, -1, 0, "\"x\" is not an integer"},
        {"a word behind a slash", BYTES(VERTICES "f 1 2 3/x\n"), LOXO_ERR_MALFORMED, 4, -1, 0,
         "\"3/x\" is not an integer"},
        {"too many slashes", BYTES(VERTICES "f 1 2 3/1/1/1\n"), LOXO_ERR_MALFORMED, 4, -1, 0, "is not an integer"},
        {"a backslash inside", BYTES(VERTICES "f 1 2 3\\4\n"), LOXO_ERR_MALFORMED, 4, -1, 0, "is not an integer"},
        {"a backslash at the end", BYTES(VERTICES "f 1 2 3 \\"), LOXO_ERR_MALFORMED, 4, -1, 0, "is not an integer"},
        {"two coordinates", BYTES("v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n"), LOXO_ERR_MALFORMED, 2, -1, 1,
         "vertex 1: 2 values where 3 are needed"},
        {"eight coordinates", BYTES("v 0 0 0 0 0 0 0 0\n"), LOXO_ERR_MALFORMED, 1, -1, 0, "more than 7 values"},
        {"decimal comma", BYTES("v 0,5 0 0\n"), LOXO_ERR_MALFORMED, 1, -1, 0, "\"0,5\" is not a number"},
        {"hexadecimal", BYTES("v 0x1p0 0 0\n"), LOXO_ERR_MALFORMED, 1, -1, 0, "\"0x1p0\" is not a number"},
        {"Fortran", BYTES("v 0 1.0D+00 0\n"), LOXO_ERR_MALFORMED, 1, -1, 0, "\"1.0D+00\" is not a number"},
        {"NUL", BYTES("v 0 \0 0\n"), LOXO_ERR_MALFORMED, 1, -1, 0, "NUL byte"},
        {"NaN that is used", BYTES(VERTICES "v 0 -nan 0\nf 1 2 4\n"), LOXO_ERR_MALFORMED, 4, -1, 3,
         "vertex 3: a coordinate is not finite"},
        {"old infinity that is used", BYTES(VERTICES "v 0 1.#INF 0\nf 1 2 4\n"), LOXO_ERR_MALFORMED, 4, -1, 3,
         "not finite"},
        {"nothing of OBJ", BYTES("vn 0 0 1\n"), LOXO_ERR_MALFORMED, 0, -1, -1, "this is no OBJ file"},
    };
    check_bad_files(files, sizeof files / sizeof files[0], "a.obj");
}

/* n random-looking but regular quadrangles and triangles; a fault in a face or vertex where asked. */
static void write_fans(text_buffer *b, int n, int bad_line)
{
    for (int i = 0; i < n; ++i) {
        if (i == bad_line) text_add(b, "v 1 2 three\n");
        text_add(b, "v %.17g 0 0\nv %d 1 0\nv %d 1 \\\n 1\nv 0 %g 7\n", i / 3.0, i, i + 1, i * 0.1);
        if (i % 3 == 0)
            text_add(b, "f -4 -3 -2 -1\n");
        else
            text_add(b, "f %d/1 %d/2 %d/3\n", 4 * i + 1, 4 * i + 2, 4 * i + 4);
    }
}

TEST(threads_change_neither_the_mesh_nor_the_message)
{
    NEEDS_IDS(48000);
    text_buffer good = {0}, bad = {0};
    write_fans(&good, 8000, -1);
    check_thread_ladder(good.text, good.n, "a.obj", NULL);
    write_fans(&bad, 8000, 7000);
    check_thread_ladder(bad.text, bad.n, "a.obj",
                        &(bad_file){.what = "a vertex in the middle",
                                    .status = LOXO_ERR_MALFORMED,
                                    .line = 7000 * 6 + 1,
                                    .byte = -1,
                                    .element = 28000,
                                    .text = "\"three\" is not a number"});
    text_free(&good);
    text_free(&bad);
}

/* Twice the signed area of the triangles of a flat soup. */
static double signed_area(const loxo_soup *soup, double *smallest)
{
    double sum = 0.0;
    *smallest = INFINITY;
    for (int64_t f = 0; f < soup->n_faces; ++f) {
        const double *a = &soup->position[(int64_t)3 * soup->triangle[3 * f]],
                     *b = &soup->position[(int64_t)3 * soup->triangle[3 * f + 1]],
                     *c = &soup->position[(int64_t)3 * soup->triangle[3 * f + 2]];
        const double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        sum += area;
        *smallest = fmin(*smallest, area);
    }
    return sum;
}

TEST(a_polygon_of_20000_corners_on_one_line)
{
    /* A comb, a star and a spiral: no triangle may be turned, and their areas add up to the polygon's. */
    for (int shape = 0; shape < 3; ++shape) {
        const int n = 20000;
        text_buffer b = {0};
        loxo_soup soup;
        double smallest, area = 0.0;
        double(*p)[2] = allocate_or_abort((size_t)n * sizeof *p);
        for (int i = 0; i < n; ++i) {
            const double angle = 2.0 * 3.141592653589793 * i / n;
            const int half = i < n / 2 ? i : n - 1 - i; /* there and back */
            const double turn = 0.002 * half, radius = 1.0 + 0.0005 * half + (i < n / 2 ? 0.0 : -0.3);
            if (shape == 0) {
                p[i][0] = i == 0 ? 0.0 : i == n - 1 ? (double)n : i;
                p[i][1] = i == 0 || i == n - 1 ? 10.0 : i % 2 == 0 ? 9.0 : -100.0;
            } else if (shape == 1) {
                p[i][0] = (i % 2 == 0 ? 1.0 : 0.3) * cos(angle);
                p[i][1] = (i % 2 == 0 ? 1.0 : 0.3) * sin(angle);
            } else {
                p[i][0] = radius * cos(turn);
                p[i][1] = radius * sin(turn);
            }
            text_add(&b, "v %.17g %.17g 0\n", p[i][0], p[i][1]);
        }
        text_add(&b, "f");
        for (int i = 0; i < n; ++i) {
            const int k = (i + 1) % n;
            area += p[i][0] * p[k][1] - p[i][1] * p[k][0];
            text_add(&b, " %d", i + 1);
        }
        CHECK_OK(loxo_read_mesh_memory(test_context, b.text, b.n, "a.obj", NULL, &soup));
        CHECK_EQUAL(soup.n_faces, n - 2);
        CHECK_EQUAL(loxo_context_n_warnings(test_context), 0);
        const double sum = signed_area(&soup, &smallest);
        CHECK_NEAR(sum, area, 1e-9 * fabs(area)); /* rounding of 20 000 terms */
        CHECK(area > 0.0 && smallest > 0.0);
        loxo_soup_destroy(test_context, &soup);
        text_free(&b);
        free(p);
    }
}

TEST(every_allocation_may_fail)
{
    text_buffer b = {0};
    write_fans(&b, 10, -1);
    CHECK(test_each_allocation_fails(read_memory_file, &(memory_file){b.text, b.n, "a.obj"}) >= 4);
    const char *path = test_scratch("b.obj");
    write_scratch(path, b.text, b.n);
    CHECK(test_each_allocation_fails(read_disk_file, &(memory_file){.name = path}) >= 5);
    text_free(&b);
}

TEST(shared_surfaces)
{
    static const shared_file files[] = {
        {"meshes/surfaces/fandisk.obj.gz", 6475, 12946},   {"meshes/surfaces/maxplanck10k.obj.gz", 10000, 19996},
        {"meshes/surfaces/bunny35k.obj.gz", 34817, 69630}, {"meshes/surfaces/armadillo50k.obj.gz", 49990, 99976},
        {"meshes/surfaces/spot3k.obj.gz", 2930, 5856},     {"meshes/surfaces/homer6k.obj.gz", 6002, 12000}};
    check_shared_files(files, sizeof files / sizeof files[0]);
}
