/* SPDX-License-Identifier: MIT */
#include "reading.h"

#define VERTICES "0 0 0\n1 0 0\n0 1 0\n"
#define TRIANGLE "0 0 0, 1 0 0, 0 1 0 | 0 1 2"
#define B0       "\0\0\0\0"
#define B1       "\0\0\0\1"
#define B2       "\0\0\0\2"
#define B3       "\0\0\0\3"
#define FLOAT_1  "\x3f\x80\0\0"
#define POINTS   B0 B0 B0 FLOAT_1 B0 B0 B0 FLOAT_1 B0
#define COUNTS   B3 B1 B3 /* 3 vertices, 1 face, 3 edges */

TEST(text_that_is_read)
{
    static const good_file files[] = {
        {"plain", BYTES("OFF\n3 1 3\n" VERTICES "3 0 1 2\n"), TRIANGLE, NULL},
        {"no last line end", BYTES("OFF\n3 1 3\n" VERTICES "3 0 1 2"), TRIANGLE, NULL},
        {"no number of edges", BYTES("OFF\n3 1\n" VERTICES "3 0 1 2\n"), TRIANGLE, NULL},
        {"glued", BYTES("OFF3 1 3\n" VERTICES "3 0 1 2\n"), TRIANGLE, NULL},
        {"counts on the first line", BYTES("OFF 3 1 3\n" VERTICES "3 0 1 2\n"), TRIANGLE, NULL},
        {"comments and blank lines",
         BYTES("# a\n\nOFF # b\n\n# c\n3 1 3 # d\n\n0 0 0 # e\n#\n1 0 0\n0 1 0\n\n3 0 1 2 # f\n#\n"), TRIANGLE, NULL},
        {"mark, CR LF", BYTES("\xef\xbb\xbfOFF\r\n3 1 3\r\n0 0 0\r\n1 0 0\r\n0 1 0\r\n3 0 1 2\r\n"), TRIANGLE, NULL},
        {"CR", BYTES("OFF\r3 1 3\r0 0 0\r1 0 0\r0 1 0\r3 0 1 2\r"), TRIANGLE, NULL},
        {"colours of vertices", BYTES("COFF\n3 1 3\n0 0 0 255 0 0\n1 0 0 1 0 0 1\n0 1 0 0 0 0 0\n3 0 1 2\n"), TRIANGLE,
         NULL},
        {"normals", BYTES("NOFF\n3 1 3\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n"), TRIANGLE, NULL},
        {"textures", BYTES("STOFF\n3 1 3\n0 0 0 0 1\n1 0 0 0 1\n0 1 0 0 1\n3 0 1 2\n"), TRIANGLE, NULL},
        {"all of them", BYTES("STCNOFF\n1 0 0\n0 0 0 0 0 1 255 0 0 255 0 1\n"), "0 0 0", "no faces"},
        {"three dimensions said", BYTES("nOFF\n3\n3 1 3\n" VERTICES "3 0 1 2\n"), TRIANGLE, NULL},
        {"colours of faces", BYTES("OFF\n3 4 0\n" VERTICES "3 0 1 2 7\n3 0 1 2 1 0 0\n3 0 1 2 1.0 0 0 0.5\n3 0 1 2\n"),
         TRIANGLE ", 0 1 2, 0 1 2, 0 1 2", NULL},
        {"a quadrangle with a dent", BYTES("OFF\n4 1 0\n0 0 0\n1 1 0\n2 0 0\n1 3 0\n4 0 1 2 3\n"),
         "0 0 0, 1 1 0, 2 0 0, 1 3 0 | 1 2 3, 3 0 1", NULL},
        {"small faces", BYTES("OFF\n3 2 3\n" VERTICES "1 0\n3 0 1 2\n"), TRIANGLE,
         "1 faces with fewer than 3 corners dropped (first: face 0)"},
        {"normals that are not finite", BYTES("NOFF\n3 1 3\n0 0 0 0 0 nan\n1 0 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n"),
         TRIANGLE, "1 values that are not finite"},
        {"lines behind the end", BYTES("OFF\n3 1 3\n" VERTICES "3 0 1 2\n3 0 1 2\n"), TRIANGLE,
         "1 lines behind the last"},
        {"nothing", BYTES("OFF\n0 0 0\n"), "", "no faces"},
    };
    check_good_files(files, sizeof files / sizeof files[0], "a.off");
}

TEST(text_that_is_refused)
{
    static const bad_file files[] = {
        {"index = nv", BYTES("OFF\n3 1 3\n" VERTICES "3 0 1 3\n"), LOXO_ERR_MALFORMED, 6, -1, 0,
         "face 0: vertex index 3 not in 0..2"},
        {"counted from 1", BYTES("OFF\n3 1 3\n" VERTICES "3 1 2 3\n"), LOXO_ERR_MALFORMED, 6, -1, 0, "counted from 1?"},
        {"negative", BYTES("OFF\n3 1 3\n" VERTICES "3 0 1 -1\n"), LOXO_ERR_MALFORMED, 6, -1, 0, "-1 not in 0..2"},
        {"fractional", BYTES("OFF\n3 1 3\n" VERTICES "3 0 1 2.0\n"), LOXO_ERR_MALFORMED, 6, -1, 0, "not an integer"},
        {"too few corners", BYTES("OFF\n3 1 3\n" VERTICES "4 0 1 2\n"), LOXO_ERR_MALFORMED, 6, -1, 0,
         "3 values where 4 are needed"},
        {"too long a colour", BYTES("OFF\n3 1 3\n" VERTICES "3 0 1 2 1 1 1 1 1\n"), LOXO_ERR_MALFORMED, 6, -1, 0,
         "more than 5 values"},
        {"a word as colour", BYTES("OFF\n3 1 3\n" VERTICES "3 0 1 2 red\n"), LOXO_ERR_MALFORMED, 6, -1, 0,
         "\"red\" is not a number"},
        {"too few coordinates", BYTES("OFF\n3 1 3\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n"), LOXO_ERR_MALFORMED, 4, -1, 1,
         "2 values where 3 are needed"},
        {"too many coordinates", BYTES("OFF\n3 1 3\n0 0 0\n1 0 0 0\n0 1 0\n3 0 1 2\n"), LOXO_ERR_MALFORMED, 4, -1, 1,
         "more than 3 values"},
        {"colours promised", BYTES("CNOFF\n3 1 3\n" VERTICES "3 0 1 2\n"), LOXO_ERR_MALFORMED, 3, -1, 0,
         "3 values where 9 are needed"},
        {"decimal comma", BYTES("OFF\n3 1 3\n0,5 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), LOXO_ERR_MALFORMED, 3, -1, 0,
         "\"0,5\" is not a number"},
        {"NaN that is used", BYTES("OFF\n3 1 3\n0 0 0\n# a\n1 0 NaN\n0 1 0\n3 0 1 2\n"), LOXO_ERR_MALFORMED, 5, -1, 1,
         "vertex 1: a coordinate is not finite"},
        {"cut", BYTES("OFF\n3 1 3\n0 0 0\n1 0 0\n"), LOXO_ERR_MALFORMED, 5, -1, 2,
         "3 rows of \"vertex\" declared, 2 found"},
        {"cut in the counts", BYTES("OFF\n3\n"), LOXO_ERR_MALFORMED, 3, -1, -1, "inside the counts"},
        {"four counts", BYTES("OFF\n3 1 3 3\n"), LOXO_ERR_MALFORMED, 2, -1, -1, "more than three counts"},
        {"negative count", BYTES("OFF\n-3 1 3\n"), LOXO_ERR_MALFORMED, 2, -1, -1, "negative count"},
        {"fractional count", BYTES("OFF\n3.5 1 3\n"), LOXO_ERR_MALFORMED, 2, -1, -1, "\"3.5\" is not an integer"},
        {"2^64 - 1", BYTES("OFF\n18446744073709551615 1 3\n"), LOXO_ERR_LIMIT, 2, -1, -1, "more than any file holds"},
        {"2e9 vertices", BYTES("OFF\n2000000000 1 3\n" VERTICES), LOXO_ERR_MALFORMED, 6, -1, 3, "2000000000 rows"},
        {"four dimensions", BYTES("4OFF\n1 0 0\n0 0 0 1\n"), LOXO_ERR_UNSUPPORTED, 1, -1, -1, "three dimensions"},
        {"five dimensions", BYTES("nOFF\n5\n1 0 0\n0 0 0 1 1\n"), LOXO_ERR_UNSUPPORTED, 2, -1, -1, "three dimensions"},
        {"no magic", BYTES("3 1 3\n" VERTICES "3 0 1 2\n"), LOXO_ERR_MALFORMED, 0, -1, -1,
         "does not begin as a off file"},
    };
    check_bad_files(files, sizeof files / sizeof files[0], "a.off");
}

TEST(bytes)
{
    static const good_file good[] = {
        {"plain", BYTES("OFF BINARY\n" COUNTS POINTS B3 B0 B1 B2 B0), TRIANGLE, NULL},
        {"CR LF", BYTES("OFF BINARY\r\n" COUNTS POINTS B3 B0 B1 B2 B0), TRIANGLE, NULL},
        {"normals, a colour", BYTES("NOFF BINARY\n" B1 B0 B0 FLOAT_1 B0 B0 B0 B0 FLOAT_1), "1 0 0", "no faces"},
        {"a colour of three", BYTES("OFF BINARY\n" COUNTS POINTS B3 B0 B1 B2 B3 B0 B0 B0), TRIANGLE, NULL},
        {"behind the end", BYTES("OFF BINARY\n" COUNTS POINTS B3 B0 B1 B2 B0 "ab"), TRIANGLE,
         "2 bytes behind the last"},
    };
    static const bad_file bad[] = {
        {"cut in the counts", BYTES("OFF BINARY\n" B3 B1), LOXO_ERR_MALFORMED, 0, 19, -1, "inside the counts"},
        {"negative count", BYTES("OFF BINARY\n\xff\0\0\0" B1 B3), LOXO_ERR_MALFORMED, 0, 11, -1, "byte order?"},
        {"cut in the vertices", BYTES("OFF BINARY\n" COUNTS B0 B0 B0 B0), LOXO_ERR_MALFORMED, 0, 39, 1,
         "3 vertices declared, 1 found"},
        {"2^31 - 1 vertices", BYTES("OFF BINARY\n\x7f\xff\xff\xff" B1 B3 POINTS), LOXO_ERR_MALFORMED, 0, 59, 3,
         "2147483647 vertices declared, 3 found"},
        {"cut in the face", BYTES("OFF BINARY\n" COUNTS POINTS B3 B0 B1), LOXO_ERR_MALFORMED, 0, 59, 0,
         "beyond the file"},
        {"no colour count", BYTES("OFF BINARY\n" COUNTS POINTS B3 B0 B1 B2), LOXO_ERR_MALFORMED, 0, 75, 0,
         "ends early"},
        {"a long colour", BYTES("OFF BINARY\n" COUNTS POINTS B3 B0 B1 B2 B3 B0), LOXO_ERR_MALFORMED, 0, 75, 0,
         "colour"},
        {"index = nv", BYTES("OFF BINARY\n" COUNTS POINTS B3 B0 B1 B3 B0), LOXO_ERR_MALFORMED, 0, 71, 0,
         "vertex index 3 not in 0..2"},
        {"2^31 - 1 faces", BYTES("OFF BINARY\n" B3 "\x7f\xff\xff\xff" B0 POINTS B3 B0 B1 B2 B0), LOXO_ERR_MALFORMED, 0,
         79, 1, "inside the faces"},
        {"NaN that is used",
         BYTES("OFF BINARY\n" COUNTS B0 B0 B0 FLOAT_1 B0 "\x7f\xc0\0\0" B0 FLOAT_1 B0 B3 B0 B1 B2 B0),
         LOXO_ERR_MALFORMED, 0, 35, 1, "not finite"},
    };
    check_good_files(good, sizeof good / sizeof good[0], "a.off");
    check_bad_files(bad, sizeof bad / sizeof bad[0], "a.off");
}

TEST(every_allocation_may_fail)
{
    static const char text[] = "OFF\n4 1 0\n0 0 0\n1 1 0\n2 0 0\n1 3 0\n4 0 1 2 3\n";
    static const char bytes[] = "OFF BINARY\n" COUNTS POINTS B3 B0 B1 B2 B0;
    CHECK(test_each_allocation_fails(read_memory_file, &(memory_file){BYTES(text), "a.off"}) >= 5);
    CHECK(test_each_allocation_fails(read_memory_file, &(memory_file){BYTES(bytes), "a.off"}) >= 3);
}

TEST(shared_surfaces)
{
    static const shared_file files[] = {{"meshes/surfaces/horse20k.off.gz", 19851, 39698},
                                        {"meshes/surfaces/bunny35k-slivers.off.gz", 34835, 69666},
                                        {"meshes/surfaces/venus50k.off.gz", 50002, 100000},
                                        {"meshes/surfaces/camel10k.off.gz", 9770, 19536}};
    check_shared_files(files, sizeof files / sizeof files[0]);
}
