/* SPDX-License-Identifier: MIT */
#include "reading.h"

#define FACET(a, b, c)                                                                                                 \
    "facet normal 0 0 1\n outer loop\n  vertex " a "\n  vertex " b "\n  vertex " c "\n endloop\nendfacet\n"
#define TWO_FACETS FACET("0 0 0", "1 0 0", "0 1 0") FACET("1 0 0", "1 1 0", "0 1 -0")
#define TWO_JOINED "0 0 0, 1 0 0, 0 1 0, 1 1 0 | 0 1 2, 1 3 2"
#define Z          "\0\0\0\0"
#define ONE        "\0\0\x80\x3f"
#define MINUS_Z    "\0\0\0\x80"
#define NAN_4      "\0\0\xc0\x7f"
#define HEAD_80    "0123456789012345678901234567890123456789012345678901234567890123456789012345678\0"
#define HEAD_SOLID "solid 6789012345678901234567890123456789012345678901234567890123456789012345678\0"
#define HEAD_MARK                                                                                                      \
    "\xef\xbb\xbf"                                                                                                     \
    "solid 9012345678901234567890123456789012345678901234567890123456789012345678\0"
#define BINARY_1 Z Z ONE Z Z Z ONE Z Z Z ONE Z "\xff\xff"
#define BINARY_2 Z Z ONE ONE Z Z ONE ONE Z Z ONE MINUS_Z "\0\0"

TEST(files_that_are_read)
{
    static const good_file files[] = {
        {"text", BYTES("solid\n" TWO_FACETS "endsolid\n"), TWO_JOINED, NULL},
        {"a name of several words, upper case, no last line end",
         BYTES("SOLID facet of a stone\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 0 0 0\nVERTEX 1 0 0\nVERTEX 0 1 "
               "0\nENDLOOP\n"
               "ENDFACET\nENDSOLID facet of a stone"),
         "0 0 0, 1 0 0, 0 1 0 | 0 1 2", NULL},
        {"two solids",
         BYTES("solid a\n" FACET("0 0 0", "1 0 0", "0 1 0") "endsolid a\nsolid b\n" FACET("1 0 0", "1 1 0",
                                                                                          "0 1 0") "endsolid b\n"),
         TWO_JOINED, NULL},
        {"mark, CR LF, one line a facet",
         BYTES("\xef\xbb\xbfsolid\r\nfacet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop "
               "endfacet\r\nendsolid\r\n"),
         "0 0 0, 1 0 0, 0 1 0 | 0 1 2", NULL},
        {"normals that are not finite",
         BYTES("solid\nfacet normal nan -nan(ind) 1.#QNAN\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
               "0\nendloop\n"
               "endfacet\nendsolid\n"),
         "0 0 0, 1 0 0, 0 1 0 | 0 1 2", "1 normals are not finite"},
        {"text without facets", BYTES("solid\nendsolid\n"), "", "no faces"},
        {"binary", BYTES(HEAD_80 "\2\0\0\0" BINARY_1 BINARY_2), TWO_JOINED, NULL},
        {"binary that says solid", BYTES(HEAD_SOLID "\2\0\0\0" BINARY_1 BINARY_2), TWO_JOINED, NULL},
        {"binary with a mark", BYTES(HEAD_MARK "\2\0\0\0" BINARY_1 BINARY_2), TWO_JOINED, NULL},
        {"a repeated corner", BYTES(HEAD_80 "\1\0\0\0" Z Z ONE Z Z Z ONE Z Z ONE Z Z "\0\0"), "0 0 0, 1 0 0 | 0 1 1",
         NULL},
        {"binary without facets", BYTES(HEAD_80 "\0\0\0\0"), "", "no faces"},
        {"binary with bytes behind", BYTES(HEAD_80 "\1\0\0\0" BINARY_1 "abc"), "0 0 0, 1 0 0, 0 1 0 | 0 1 2",
         "3 bytes behind the last facet"},
    };
    check_good_files(files, sizeof files / sizeof files[0], "a.stl");
}

TEST(files_that_are_refused)
{
    static const bad_file files[] = {
        {"no endsolid", BYTES("solid\n" TWO_FACETS), LOXO_ERR_MALFORMED, 16, -1, 2, "no \"endsolid\" behind 2 facets"},
        {"cut in a facet",
         BYTES("solid\n" FACET("0 0 0", "1 0 0", "0 1 0") "facet normal 0 0 1\nouter loop\nvertex 0 0"),
         LOXO_ERR_MALFORMED, 11, -1, 1, "ends inside a facet"},
        {"a loop of two",
         BYTES("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\n"
               "endsolid\n"),
         LOXO_ERR_MALFORMED, 6, -1, 0, "three times \"vertex\" expected"},
        {"a loop of four",
         BYTES(
             "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\n"
             "endfacet\nendsolid\n"),
         LOXO_ERR_MALFORMED, 7, -1, 0, "\"endloop\" expected"},
        {"no number", BYTES("solid\n" FACET("0 0 0", "1 O 0", "0 1 0") "endsolid\n"), LOXO_ERR_MALFORMED, 5, -1, 0,
         "\"O\" is not a number"},
        {"two numbers", BYTES("solid\n" FACET("0 0 0", "1 0", "0 1 0") "endsolid\n"), LOXO_ERR_MALFORMED, 6, -1, 0,
         "\"vertex\" is not a number"},
        {"NaN", BYTES("solid\n" FACET("0 0 0", "1 0 0", "0 nan 0") "endsolid\n"), LOXO_ERR_MALFORMED, 6, -1, 0,
         "not finite"},
        {"a word between facets", BYTES("solid\n" FACET("0 0 0", "1 0 0", "0 1 0") "hello\nendsolid\n"),
         LOXO_ERR_MALFORMED, 9, -1, 1, "expected"},
        {"too short", BYTES("hello"), LOXO_ERR_MALFORMED, 0, 5, -1, "too few for a binary STL"},
        {"binary, cut", BYTES(HEAD_80 "\2\0\0\0" BINARY_1 "abc"), LOXO_ERR_MALFORMED, 0, 137, 1,
         "2 facets declared, 1 found"},
        {"binary, 2^32 - 1", BYTES(HEAD_80 "\xff\xff\xff\xff" BINARY_1), LOXO_ERR_MALFORMED, 0, 134, 1,
         "4294967295 facets declared, 1 found"},
        {"binary, big-endian", BYTES(HEAD_80 "\0\0\0\1" BINARY_1), LOXO_ERR_UNSUPPORTED, 0, 80, -1, "byte order"},
        {"binary, NaN", BYTES(HEAD_80 "\1\0\0\0" Z Z ONE Z Z Z ONE Z Z Z NAN_4 Z "\0\0"), LOXO_ERR_MALFORMED, 0, 120, 0,
         "face 0: corner 2 has a coordinate that is not finite"},
    };
    check_bad_files(files, sizeof files / sizeof files[0], "a.stl");
}

/* Two facets for each cell of a grid of n x n points. */
static void write_grid(text_buffer *b, int n, bool is_text)
{
    const uint32_t n_facets = (uint32_t)(2 * (n - 1) * (n - 1));
    if (is_text)
        text_add(b, "solid grid\n");
    else
        bytes_add(b, HEAD_80, 80), bytes_add(b, &n_facets, 4);
    for (int i = 0; i < n - 1; ++i) {
        for (int k = 0; k < n - 1; ++k) {
            static const int corners[2][3][2] = {{{0, 0}, {0, 1}, {1, 0}}, {{0, 1}, {1, 1}, {1, 0}}};
            for (int t = 0; t < 2; ++t) {
                float p[12] = {0.0f, 0.0f, 1.0f};
                for (int c = 0; c < 3; ++c) {
                    p[3 + 3 * c] = (float)(k + corners[t][c][1]) / 7.0f;
                    p[4 + 3 * c] = (float)(i + corners[t][c][0]) / 3.0f;
                    p[5 + 3 * c] = (k + t) % 2 == 0 ? 0.0f : -0.0f;
                }
                if (!is_text) {
                    bytes_add(b, p, sizeof p);
                    bytes_add(b, "\0\0", 2);
                    continue;
                }
                text_add(b, "facet normal 0 0 1\nouter loop\n");
                for (int c = 0; c < 3; ++c)
                    text_add(b, "vertex %.9g %.9g %g\n", (double)p[3 + 3 * c], (double)p[4 + 3 * c],
                             (double)p[5 + 3 * c]);
                text_add(b, "endloop\nendfacet\n");
            }
        }
    }
    if (is_text) text_add(b, "endsolid grid\n");
}

TEST(points_are_joined_exactly_and_in_order_of_appearance)
{
    for (int is_text = 0; is_text < 2; ++is_text) {
        const int n = 120;
        text_buffer b = {0};
        loxo_soup soup;
        int64_t n_seen = 0;
        write_grid(&b, n, is_text != 0);
        check_thread_ladder(b.text, b.n, "a.stl", NULL);
        CHECK_OK(loxo_read_mesh_memory(test_context, b.text, b.n, "a.stl", NULL, &soup));
        CHECK_EQUAL(soup.n_vertices, n * n);
        CHECK_EQUAL(soup.n_faces, 2 * (n - 1) * (n - 1));
        for (int64_t c = 0; c < 3 * soup.n_faces; ++c) {
            CHECK(soup.triangle[c] <= n_seen);
            n_seen += soup.triangle[c] == n_seen;
        }
        loxo_soup_destroy(test_context, &soup);
        text_free(&b);
    }
}

TEST(a_stream_of_bytes_without_a_name)
{
    const int kept = dup(STDIN_FILENO);
    int ends[2];
    loxo_soup soup;
    static const char bytes[] = HEAD_SOLID "\2\0\0\0" BINARY_1 BINARY_2;
    CHECK(pipe(ends) == 0);
    CHECK(write(ends[1], bytes, sizeof bytes - 1) == (ssize_t)sizeof bytes - 1);
    close(ends[1]);
    CHECK(dup2(ends[0], STDIN_FILENO) == STDIN_FILENO);
    close(ends[0]);
    CHECK_OK(loxo_read_mesh(test_context, "-", NULL, &soup));
    CHECK_EQUAL(soup.n_vertices, 4);
    loxo_soup_destroy(test_context, &soup);
    dup2(kept, STDIN_FILENO);
    close(kept);
}

TEST(every_allocation_may_fail)
{
    for (int is_text = 0; is_text < 2; ++is_text) {
        text_buffer b = {0};
        write_grid(&b, 5, is_text != 0);
        CHECK(test_each_allocation_fails(read_memory_file, &(memory_file){b.text, b.n, "a.stl"}) >= 5);
        text_free(&b);
    }
}
