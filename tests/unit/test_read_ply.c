/* SPDX-License-Identifier: MIT */
#include "reading.h"

#define TEXT_HEADER(nv, nf)                                                                                            \
    "ply\nformat ascii 1.0\nelement vertex " nv "\nproperty float x\nproperty float y\nproperty float z\n"             \
    "element face " nf "\nproperty list uchar int vertex_indices\nend_header\n"
#define BINARY_HEADER(nv, nf)                                                                                          \
    "ply\nformat binary_little_endian 1.0\nelement vertex " nv "\nproperty float x\nproperty float y\n"                \
    "property float z\nelement face " nf "\nproperty list uchar int vertex_indices\nend_header\n"
/* 0 0 0, 1 0 0, 0 1 0 as little-endian floats */
#define F0         "\0\0\0\0"
#define F1         "\0\0\x80\x3f"
#define V0         F0 F0 F0
#define V1         F1 F0 F0
#define V2         F0 F1 F0
#define FNAN       "\0\0\xc0\x7f"
#define FACE_012   "\3\0\0\0\0\1\0\0\0\2\0\0\0"
#define VERTICES   "0 0 0\n1 0 0\n0 1 0\n"
#define TRIANGLE   "0 0 0, 1 0 0, 0 1 0 | 0 1 2"
#define BINARY_END ((int64_t)sizeof(BINARY_HEADER("3", "1")) - 1)

TEST(text_that_is_read)
{
    static const good_file files[] = {
        {"plain", BYTES(TEXT_HEADER("3", "1") VERTICES "3 0 1 2\n"), TRIANGLE, NULL},
        {"no last line end", BYTES(TEXT_HEADER("3", "1") VERTICES "3 0 1 2"), TRIANGLE, NULL},
        {"mark in front", BYTES("\xef\xbb\xbf" TEXT_HEADER("3", "1") VERTICES "3 0 1 2\n"), TRIANGLE, NULL},
        {"spaces, blank lines", BYTES(TEXT_HEADER("3", "1") "\n  0\t0 0 \n\n1 0 0\n0 1 0\n \n3 0 1 2\n\n"), TRIANGLE,
         NULL},
        {"CR LF",
         BYTES("ply\r\nformat ascii 1.0\r\ncomment x\r\nelement vertex 3\r\nproperty float x\r\nproperty float y\r\n"
               "property float z\r\nelement face 1\r\nproperty list uchar int vertex_indices\r\nend_header\r\n"
               "0 0 0\r\n1 0 0\r\n0 1 0\r\n3 0 1 2\r\n"),
         TRIANGLE, NULL},
        {"CR",
         BYTES("ply\rformat ascii 1.0\relement vertex 3\rproperty float x\rproperty float y\rproperty float z\r"
               "element face 1\rproperty list uchar int vertex_index\rend_header\r0 0 0\r1 0 0\r0 1 0\r3 0 1 2\r"),
         TRIANGLE, NULL},
        {"another order, colours, fields",
         BYTES("ply\nformat ascii 1.0\nelement vertex 3\nproperty uchar red\nproperty double z\nproperty double heat\n"
               "property double y\nproperty double x\nproperty float nx\nelement face 1\nproperty uchar flags\n"
               "property list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n"
               "255 0 1.5 0 0 1\n255 0 2.5 0 1 1\n255 0 inf 1 0 1\n7 3 0 1 2 6 0 0 0 0 0 0\n"),
         TRIANGLE " | heat 1.5 2.5 inf", NULL},
        {"faces first, a quadrangle",
         BYTES("ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nelement vertex 4\n"
               "property float x\nproperty float y\nproperty float z\nend_header\n4 0 1 2 3\n0 0 0\n1 0 0\n1 1 0\n0 1 "
               "0\n"),
         "0 0 0, 1 0 0, 1 1 0, 0 1 0 | 0 1 2, 0 2 3", NULL},
        {"a quadrangle with a dent at its second corner",
         BYTES(TEXT_HEADER("4", "1") "0 0 0\n1 1 0\n2 0 0\n1 3 0\n4 0 1 2 3\n"),
         "0 0 0, 1 1 0, 2 0 0, 1 3 0 | 1 2 3, 3 0 1", NULL},
        {"a strip with a new start",
         BYTES("ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
               "element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 0 "
               "0\n"
               "9 0 1 2 3 3 -1 1 4 3\n"),
         "0 0 0, 1 0 0, 0 1 0, 1 1 0, 2 0 0 | 0 1 2, 2 1 3, 1 4 3", NULL},
        {"small faces", BYTES(TEXT_HEADER("3", "4") VERTICES "2 0 1\n3 0 1 2\n0\n1 2\n"), TRIANGLE,
         "3 faces with fewer than 3 corners dropped (first: face 0)"},
        {"a repeated corner stays", BYTES(TEXT_HEADER("3", "1") VERTICES "3 0 1 1\n"), "0 0 0, 1 0 0, 0 1 0 | 0 1 1",
         NULL},
        {"a quadrangle that crosses itself", BYTES(TEXT_HEADER("4", "1") "0 0 0\n2 0 0\n0 1 0\n1 2 0\n4 0 1 2 3\n"),
         "0 0 0, 2 0 0, 0 1 0, 1 2 0 | 0 1 2, 2 3 0", "cross themselves"},
        {"not finite and unused", BYTES(TEXT_HEADER("4", "1") VERTICES "nan 0 0\n3 0 1 2\n"),
         "0 0 0, 1 0 0, 0 1 0, nan 0 0 | 0 1 2", "1 vertices that no face uses"},
        {"lines behind the end", BYTES(TEXT_HEADER("3", "1") VERTICES "3 0 1 2\n\n3 0 1 2\nrest\n"), TRIANGLE,
         "2 lines behind the last row are ignored (first: line 15)"},
        {"no faces", BYTES(TEXT_HEADER("1", "0") "0 0 0\n"), "0 0 0", "no faces"},
        {"nothing", BYTES(TEXT_HEADER("0", "0")), "", "no faces"},
        {"another element is skipped",
         BYTES(
             "ply\nformat ascii 1.0\nelement material 2\nproperty list uchar int a\nelement vertex 3\nproperty float "
             "x\n"
             "property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
             "2 7 8\n0\n" VERTICES "3 0 1 2\n"),
         TRIANGLE, "element \"material\" is skipped"},
        {"numbers of all kinds", BYTES(TEXT_HEADER("3", "1") "+0 -0 .0\n1. 1e-400 0\n0 1E0 0\n3 0 +1 002\n"),
         "0 -0 0, 1 0 0, 0 1 0 | 0 1 2", NULL},
    };
    check_good_files(files, sizeof files / sizeof files[0], "a.ply");
}

TEST(bytes_that_are_read)
{
    static const good_file files[] = {
        {"plain", BYTES(BINARY_HEADER("3", "1") V0 V1 V2 FACE_012), TRIANGLE, NULL},
        {"CR LF header, data that begin with LF",
         BYTES("ply\r\nformat binary_little_endian 1.0\r\nelement vertex 3\r\nproperty char x\r\nproperty char y\r\n"
               "property char z\r\nelement face 1\r\nproperty list uchar uchar vertex_indices\r\nend_header\r\n"
               "\n\r\0\1\0\0\0\1\0\3\0\1\2"),
         "10 13 0, 1 0 0, 0 1 0 | 0 1 2", NULL},
        {"CR header, data that begin with LF",
         BYTES("ply\rformat binary_little_endian 1.0\relement vertex 3\rproperty char x\rproperty char y\r"
               "property char z\relement face 1\rproperty list uchar uchar vertex_indices\rend_header\r"
               "\n\r\0\1\0\0\0\1\0\3\0\1\2"),
         "10 13 0, 1 0 0, 0 1 0 | 0 1 2", NULL},
        {"big-endian",
         BYTES("ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty double y\n"
               "property short z\nelement face 1\nproperty list ushort uint vertex_indices\nend_header\n" F0 F0 F0
               "\0\0"
               "\x3f\x80\0\0" F0 F0 "\0\0" F0 "\x3f\xf0\0\0\0\0\0\0"
               "\0\7"
               "\0\3\0\0\0\0\0\0\0\1\0\0\0\2"),
         "0 0 0, 1 0 0, 0 1 7 | 0 1 2", NULL},
        {"a field, a list in the vertices, faces with more columns",
         BYTES("ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty uchar red\nproperty float x\n"
               "property float y\nproperty float z\nproperty list uchar short links\nproperty float heat\n"
               "element face 1\nproperty uchar flag\nproperty list uchar int vertex_indices\nproperty short more\n"
               "end_header\n\7" V0 "\2abcd" F1 "\7" V1 "\0" F0 "\7" V2 "\1ab" F1 "\7" FACE_012 "ab"),
         TRIANGLE " | heat 1 0 1", NULL},
        {"two lists in a face",
         BYTES("ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
               "property float z\nelement face 1\nproperty list uchar float uv\n"
               "property list uchar int vertex_indices\nend_header\n" V0 V1 V2 "\1" F1 FACE_012),
         TRIANGLE, NULL},
        {"a quadrangle and a triangle",
         BYTES(BINARY_HEADER("3", "3") V0 V1 V2 "\4\0\0\0\0\1\0\0\0\2\0\0\0\2\0\0\0" FACE_012 "\0"),
         "0 0 0, 1 0 0, 0 1 0 | 0 1 2, 2 2 0, 0 1 2", "1 faces with fewer than 3 corners dropped (first: face 2)"},
        {"faces first, a quadrangle",
         BYTES("ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uchar uchar vertex_indices\n"
               "element vertex 4\nproperty char x\nproperty char y\nproperty char z\nend_header\n"
               "\4\0\1\2\3\0\0\0\1\0\0\1\1\0\0\1\0"),
         "0 0 0, 1 0 0, 1 1 0, 0 1 0 | 0 1 2, 0 2 3", NULL},
        {"faces and a strip",
         BYTES("ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty char x\nproperty char y\n"
               "property char z\nelement face 1\nproperty list uchar uchar vertex_indices\nelement tristrips 1\n"
               "property list uchar char vertex_indices\nend_header\n"
               "\0\0\0\1\0\0\1\1\0\0\1\0\3\0\1\2\6\0\1\xff\0\2\3"),
         "0 0 0, 1 0 0, 1 1 0, 0 1 0 | 0 1 2, 0 2 3", NULL},
        {"a strip alone",
         BYTES("ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty char x\nproperty char y\n"
               "property char z\nelement tristrips 1\nproperty list uchar char vertex_indices\nend_header\n"
               "\0\0\0\1\0\0\1\1\0\0\1\0\10\0\1\2\3\xff\0\2\3"),
         "0 0 0, 1 0 0, 1 1 0, 0 1 0 | 0 1 2, 2 1 3, 0 2 3", NULL},
        {"bytes behind the end", BYTES(BINARY_HEADER("3", "1") V0 V1 V2 FACE_012 "ab"), TRIANGLE,
         "2 bytes behind the last row are ignored"},
        {"not finite and unused", BYTES(BINARY_HEADER("4", "1") V0 V1 V2 F0 F0 FNAN FACE_012),
         "0 0 0, 1 0 0, 0 1 0, 0 0 nan | 0 1 2", "1 vertices that no face uses"},
        {"an element of no bytes",
         BYTES("ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
               "property float z\nelement other 9000000000000000000\nelement face 1\n"
               "property list uchar int vertex_indices\nend_header\n" V0 V1 V2 FACE_012),
         TRIANGLE, "element \"other\" is skipped"},
    };
    check_good_files(files, sizeof files / sizeof files[0], "a.ply");
}

TEST(text_that_is_refused)
{
    static const bad_file files[] = {
        {"index = nv", BYTES(TEXT_HEADER("3", "2") VERTICES "3 0 1 2\n3 0 1 3\n"), LOXO_ERR_MALFORMED, 14, -1, 1,
         "face 1: vertex index 3 not in 0..2"},
        {"counted from 1", BYTES(TEXT_HEADER("3", "1") VERTICES "3 1 2 3\n"), LOXO_ERR_MALFORMED, 13, -1, 0,
         "counted from 1?"},
        {"negative index", BYTES(TEXT_HEADER("3", "1") VERTICES "3 0 1 -1\n"), LOXO_ERR_MALFORMED, 13, -1, 0,
         "vertex index -1 not in 0..2"},
        {"index that wraps to 1", BYTES(TEXT_HEADER("3", "1") VERTICES "3 0 4294967297 2\n"), LOXO_ERR_MALFORMED, 13,
         -1, 0, "vertex index 4294967297 not in"},
        {"index of 23 digits", BYTES(TEXT_HEADER("3", "1") VERTICES "3 0 1 99999999999999999999999\n"),
         LOXO_ERR_MALFORMED, 13, -1, 0, "vertex index 99999999999999999999999 not in"},
        {"fractional index", BYTES(TEXT_HEADER("3", "1") VERTICES "3 0 1.5 2\n"), LOXO_ERR_MALFORMED, 13, -1, 0,
         "\"1.5\" is not an integer"},
        {"word as index", BYTES(TEXT_HEADER("3", "1") VERTICES "3 0 one 2\n"), LOXO_ERR_MALFORMED, 13, -1, 0,
         "\"one\" is not an integer"},
        {"no vertices", BYTES(TEXT_HEADER("0", "1") "3 0 1 2\n"), LOXO_ERR_MALFORMED, 10, -1, 0,
         "there are no vertices"},
        {"negative length", BYTES(TEXT_HEADER("3", "1") VERTICES "-3 0 1 2\n"), LOXO_ERR_MALFORMED, 13, -1, 0,
         "\"-3\" is not the length of a list"},
        {"length 255 with 3 there", BYTES(TEXT_HEADER("3", "1") VERTICES "255 0 1 2\n"), LOXO_ERR_MALFORMED, 13, -1, 0,
         "3 values where 255 are needed"},
        {"length 2^63", BYTES(TEXT_HEADER("3", "1") VERTICES "9223372036854775808 0\n"), LOXO_ERR_MALFORMED, 13, -1, 0,
         "is not the length of a list"},
        {"one value too many in a face", BYTES(TEXT_HEADER("3", "1") VERTICES "3 0 1 2 2\n"), LOXO_ERR_MALFORMED, 13,
         -1, 0, "more than 1 values"},
        {"too few coordinates", BYTES(TEXT_HEADER("3", "1") "0 0 0\n1 0\n0 1 0\n3 0 1 2\n"), LOXO_ERR_MALFORMED, 11, -1,
         1, "vertex 1: 2 values where 3 are needed"},
        {"too many coordinates", BYTES(TEXT_HEADER("3", "1") "0 0 0 1 0 0\n0 1 0\n3 0 1 2\n"), LOXO_ERR_MALFORMED, 10,
         -1, 0, "vertex 0: more than 3 values"},
        {"decimal comma", BYTES(TEXT_HEADER("3", "1") "0,5 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), LOXO_ERR_MALFORMED, 10, -1,
         0, "\"0,5\" is not a number"},
        {"rest of a number", BYTES(TEXT_HEADER("3", "1") "1.5abc 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), LOXO_ERR_MALFORMED, 10,
         -1, 0, "\"1.5abc\" is not a number"},
        {"NUL", BYTES(TEXT_HEADER("3", "1") "0 0 0\n1 \0 0\n0 1 0\n3 0 1 2\n"), LOXO_ERR_MALFORMED, 11, -1, 1,
         "NUL byte"},
        {"NaN that is used", BYTES(TEXT_HEADER("3", "1") "0 0 0\n1 0 0\n\n0 nan 0\n3 0 1 2\n"), LOXO_ERR_MALFORMED, 13,
         -1, 2, "vertex 2: a coordinate is not finite"},
        {"1e400 that is used", BYTES(TEXT_HEADER("3", "1") "0 0 1e400\n1 0 0\n0 1 0\n3 0 1 2\n"), LOXO_ERR_MALFORMED,
         10, -1, 0, "not finite"},
        {"1e39 is no float", BYTES(TEXT_HEADER("3", "1") "0 0 1e39\n1 0 0\n0 1 0\n3 0 1 2\n"), LOXO_ERR_MALFORMED, 10,
         -1, 0, "not finite"},
        {"cut in the vertices", BYTES(TEXT_HEADER("3", "1") "0 0 0\n1 0 0\n"), LOXO_ERR_MALFORMED, 12, -1, 2,
         "3 rows of \"vertex\" declared, 2 found"},
        {"cut in the faces", BYTES(TEXT_HEADER("3", "2") VERTICES "3 0 1 2\n"), LOXO_ERR_MALFORMED, 14, -1, 1,
         "2 rows of \"face\" declared, 1 found"},
        {"cut in a line", BYTES(TEXT_HEADER("3", "1") VERTICES "3 0 1"), LOXO_ERR_MALFORMED, 13, -1, 0,
         "2 values where 3 are needed"},
        {"2e9 vertices", BYTES(TEXT_HEADER("2000000000", "1") VERTICES), LOXO_ERR_MALFORMED, 13, -1, 3,
         "2000000000 rows of \"vertex\" declared, 3 found"},
        {"2^63 - 1 vertices", BYTES(TEXT_HEADER("9223372036854775807", "1") VERTICES "3 0 1 2\n"), LOXO_ERR_MALFORMED,
         14, -1, 4, "9223372036854775807 rows"},
        {"2e9 faces", BYTES(TEXT_HEADER("3", "2000000000") VERTICES "3 0 1 2\n"), LOXO_ERR_MALFORMED, 14, -1, 1,
         "2000000000 rows of \"face\" declared, 1 found"},
    };
    check_bad_files(files, sizeof files / sizeof files[0], "a.ply");
}

TEST(headers_that_are_refused)
{
    static const bad_file files[] = {
        {"2^64 - 1 vertices", BYTES(TEXT_HEADER("18446744073709551615", "1") VERTICES), LOXO_ERR_LIMIT, 3, -1, -1,
         "more than any file holds"},
        {"1e30 vertices", BYTES(TEXT_HEADER("1e30", "1") VERTICES), LOXO_ERR_MALFORMED, 3, -1, -1, "\"1e30\" is not"},
        {"-1 vertices", BYTES(TEXT_HEADER("-1", "1") VERTICES), LOXO_ERR_MALFORMED, 3, -1, -1, "\"-1\" is not"},
        {"no end", BYTES("ply\nformat ascii 1.0\nelement vertex 3\n"), LOXO_ERR_MALFORMED, 4, -1, -1, "no end_header"},
        {"no format",
         BYTES("ply\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n"),
         LOXO_ERR_MALFORMED, 6, -1, -1, "no format line"},
        {"two formats", BYTES("ply\nformat ascii 1.0\nformat ascii 1.0\n"), LOXO_ERR_MALFORMED, 3, -1, -1,
         "second format"},
        {"unknown format", BYTES("ply\nformat binary 1.0\n"), LOXO_ERR_MALFORMED, 2, -1, -1,
         "unknown format \"binary\""},
        {"version 2", BYTES("ply\nformat ascii 2.0\n"), LOXO_ERR_UNSUPPORTED, 2, -1, -1, "version"},
        {"no vertices", BYTES("ply\nformat ascii 1.0\nend_header\n"), LOXO_ERR_MALFORMED, 3, -1, -1,
         "no element \"vertex\""},
        {"vertices twice", BYTES("ply\nformat ascii 1.0\nelement vertex 0\nelement vertex 0\n"), LOXO_ERR_MALFORMED, 4,
         -1, -1, "element \"vertex\" twice"},
        {"no z", BYTES("ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nend_header\n"),
         LOXO_ERR_MALFORMED, 6, -1, -1, "no property \"z\""},
        {"x twice", BYTES("ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty int x\n"),
         LOXO_ERR_MALFORMED, 5, -1, -1, "property \"x\" twice"},
        {"unknown type", BYTES("ply\nformat ascii 1.0\nelement vertex 0\nproperty real x\n"), LOXO_ERR_MALFORMED, 4, -1,
         -1, "unknown type \"real\""},
        {"length of type float",
         BYTES("ply\nformat ascii 1.0\nelement face 0\nproperty list float int vertex_indices\n"), LOXO_ERR_MALFORMED,
         4, -1, -1, "integer type"},
        {"indices of type float",
         BYTES("ply\nformat ascii 1.0\nelement face 0\nproperty list uchar float vertex_indices\n"), LOXO_ERR_MALFORMED,
         4, -1, -1, "integer type"},
        {"no list in the faces",
         BYTES("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
               "element face 1\nproperty int flag\nend_header\n0 0 0\n1\n"),
         LOXO_ERR_MALFORMED, 9, -1, -1, "no list \"vertex_indices\""},
        {"a property too early", BYTES("ply\nformat ascii 1.0\nproperty float x\n"), LOXO_ERR_MALFORMED, 3, -1, -1,
         "before the first element"},
        {"unknown line", BYTES("ply\nformat ascii 1.0\nhello\n"), LOXO_ERR_MALFORMED, 3, -1, -1, "\"hello\""},
    };
    check_bad_files(files, sizeof files / sizeof files[0], "a.ply");
}

TEST(bytes_that_are_refused)
{
    static const bad_file files[] = {
        {"index = nv", BYTES(BINARY_HEADER("3", "1") V0 V1 V2 "\3\0\0\0\0\3\0\0\0\2\0\0\0"), LOXO_ERR_MALFORMED, 0,
         BINARY_END + 36 + 5, 0, "face 0: vertex index 3 not in 0..2"},
        {"negative index", BYTES(BINARY_HEADER("3", "1") V0 V1 V2 "\3\0\0\0\0\xff\xff\xff\xff\2\0\0\0"),
         LOXO_ERR_MALFORMED, 0, BINARY_END + 36 + 5, 0, "vertex index -1 not in 0..2"},
        {"bad index in a quadrangle", BYTES(BINARY_HEADER("3", "1") V0 V1 V2 "\4\0\0\0\0\1\0\0\0\2\0\0\0\3\0\0\0"),
         LOXO_ERR_MALFORMED, 0, BINARY_END + 36 + 13, 0, "vertex index 3 not in 0..2"},
        {"length 255 with 3 there", BYTES(BINARY_HEADER("3", "1") V0 V1 V2 "\xff\0\0\0\0\1\0\0\0\2\0\0\0"),
         LOXO_ERR_MALFORMED, 0, BINARY_END + 36, 0, "a list of 255 entries"},
        {"cut in the vertices", BYTES(BINARY_HEADER("3", "1") V0 V1 "abcdefg"), LOXO_ERR_MALFORMED, 0, BINARY_END + 31,
         2, "3 rows of \"vertex\" declared, 2 found"},
        {"cut at the last byte", BYTES(BINARY_HEADER("3", "1") V0 V1 V2 "\3\0\0\0\0\1\0\0\0\2\0\0"), LOXO_ERR_MALFORMED,
         0, BINARY_END + 36, 0, "a list of 3 entries"},
        {"no faces there", BYTES(BINARY_HEADER("3", "1") V0 V1 V2), LOXO_ERR_MALFORMED, 0, BINARY_END + 36, 0,
         "1 rows of \"face\" declared, 0 found"},
        {"2e9 vertices", BYTES(BINARY_HEADER("2000000000", "1") V0 V1 V2), LOXO_ERR_MALFORMED, 0, BINARY_END + 9 + 36,
         3, "2000000000 rows of \"vertex\" declared, 3 found"},
        {"a product that wraps", BYTES(BINARY_HEADER("1537228672809129302", "1") V0 V1 V2), LOXO_ERR_LIMIT, 0,
         BINARY_END + 18, -1, "more than any file holds"},
        {"2e9 faces", BYTES(BINARY_HEADER("3", "2000000000") V0 V1 V2 FACE_012), LOXO_ERR_MALFORMED, 0,
         BINARY_END + 9 + 36 + 13, 13, "2000000000 rows of \"face\" declared"},
        {"NaN that is used", BYTES(BINARY_HEADER("3", "1") V0 V1 F0 FNAN F0 FACE_012), LOXO_ERR_MALFORMED, 0,
         BINARY_END + 24, 2, "vertex 2: a coordinate is not finite"},
        {"negative length",
         BYTES("ply\nformat binary_little_endian 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
               "property float z\nelement face 1\nproperty list char int vertex_indices\nend_header\n\375abcdefghijk"),
         LOXO_ERR_MALFORMED, 0, 168, 0, "a list of -3 entries"},
        {"length 2^32 - 1",
         BYTES("ply\nformat binary_little_endian 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
               "property float z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n\xff\xff\xff\xff"
               "abcd"),
         LOXO_ERR_MALFORMED, 0, 168, 0, "a list of 4294967295 entries"},
    };
    check_bad_files(files, sizeof files / sizeof files[0], "a.ply");
}

/* A grid of n x n vertices; bad_vertex and bad_face get a fault. */
static void write_grid(text_buffer *b, int n, bool quads, int bad_vertex, int bad_face)
{
    const int n_faces = (n - 1) * (n - 1) * (quads ? 1 : 2);
    int face = 0;
    text_add(b, "ply\nformat ascii 1.0\nelement vertex %d\nproperty double x\nproperty double y\nproperty double z\n",
             n * n);
    text_add(b, "element face %d\nproperty list uchar int vertex_indices\nend_header\n", n_faces);
    for (int i = 0; i < n * n; ++i)
        text_add(b, "%.17g %.9g %s\n", i % n / 7.0, floor((double)i / n) / 3.0, i == bad_vertex ? "1e" : "0.25");
    for (int i = 0; i < n - 1; ++i) {
        for (int k = 0; k < n - 1; ++k) {
            const int v = i * n + k;
            if (quads) {
                text_add(b, "4 %d %d %d %d\n", face++ == bad_face ? -5 : v, v + 1, v + n + 1, v + n);
            } else {
                text_add(b, "3 %d %d %d\n", face++ == bad_face ? -5 : v, v + 1, v + n);
                text_add(b, "3 %d %d %d\n", face++ == bad_face ? -5 : v + 1, v + n + 1, v + n);
            }
        }
    }
}

TEST(threads_change_neither_the_mesh_nor_the_message)
{
    for (int quads = 0; quads < 2; ++quads) {
        text_buffer good = {0}, bad = {0}, worse = {0};
        write_grid(&good, 150, quads != 0, -1, -1);
        check_thread_ladder(good.text, good.n, "a.ply", NULL);
        write_grid(&bad, 150, quads != 0, -1, 20000);
        check_thread_ladder(bad.text, bad.n, "a.ply",
                            &(bad_file){.what = "a face in the middle",
                                        .status = LOXO_ERR_MALFORMED,
                                        .line = 9 + 150 * 150 + 20001,
                                        .byte = -1,
                                        .element = 20000,
                                        .text = "vertex index -5"});
        write_grid(&worse, 150, quads != 0, 22000, 20);
        check_thread_ladder(worse.text, worse.n, "a.ply",
                            &(bad_file){.what = "of two faults the first",
                                        .status = LOXO_ERR_MALFORMED,
                                        .line = 9 + 22001,
                                        .byte = -1,
                                        .element = 22000,
                                        .text = "\"1e\" is not a number"});
        text_free(&good);
        text_free(&bad);
        text_free(&worse);
    }
}

/* The same grid in bytes: a double to each coordinate, an extra column where the rows shall not be plain. */
static void write_binary_grid(text_buffer *b, int n, bool quads, bool extra, int bad_face)
{
    const int n_faces = (n - 1) * (n - 1) * (quads ? 1 : 2);
    int face = 0;
    text_add(b, "ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty double x\nproperty double y\n",
             n * n);
    text_add(b, "property double z\n%selement face %d\n", extra ? "property uchar red\n" : "", n_faces);
    text_add(b, "property list uchar int vertex_indices\nend_header\n");
    for (int i = 0; i < n * n; ++i) {
        const double p[3] = {i % n / 7.0, floor((double)i / n) / 3.0, 0.25};
        bytes_add(b, p, sizeof p);
        if (extra) bytes_add(b, "r", 1);
    }
    for (int i = 0; i < n - 1; ++i) {
        for (int k = 0; k < n - 1; ++k) {
            const int32_t v = i * n + k, w = n;
            if (quads) {
                bytes_add(b, "\4", 1);
                bytes_add(b, (int32_t[4]){face++ == bad_face ? -5 : v, v + 1, v + w + 1, v + w}, 16);
            } else {
                bytes_add(b, "\3", 1);
                bytes_add(b, (int32_t[3]){face++ == bad_face ? -5 : v, v + 1, v + w}, 12);
                bytes_add(b, "\3", 1);
                bytes_add(b, (int32_t[3]){face++ == bad_face ? -5 : v + 1, v + w + 1, v + w}, 12);
            }
        }
    }
}

TEST(bytes_and_threads)
{
    NEEDS_IDS(40000);
    uint64_t hash[2] = {0, 0};
    for (int kind = 0; kind < 4; ++kind) {
        const bool quads = kind % 2 != 0, extra = kind / 2 != 0;
        text_buffer good = {0}, bad = {0};
        write_binary_grid(&good, 150, quads, extra, -1);
        const uint64_t mine = check_thread_ladder(good.text, good.n, "a.ply", NULL);
        if (!extra) hash[quads] = mine;
        CHECK(mine == hash[quads]);
        write_binary_grid(&bad, 150, quads, extra, 15001);
        const int64_t row = quads ? 17 : 13, n_faces = (int64_t)149 * 149 * (quads ? 1 : 2);
        check_thread_ladder(bad.text, bad.n, "a.ply",
                            &(bad_file){.what = "a face in the middle",
                                        .status = LOXO_ERR_MALFORMED,
                                        .byte = (int64_t)bad.n - (n_faces - 15001) * row + 1,
                                        .element = 15001,
                                        .text = "vertex index -5"});
        text_free(&good);
        text_free(&bad);
    }
}

TEST(a_binary_file_costs_no_more_than_its_mesh)
{
    NEEDS_IDS(250000);
    text_buffer b = {0};
    loxo_soup soup;
    const char *path = test_scratch("peak.ply");
    write_binary_grid(&b, 180, false, false, -1);
    write_scratch(path, b.text, b.n);
    CHECK_OK(loxo_read_mesh(test_context, path, NULL, &soup));
    const size_t mesh_bytes = (size_t)soup.n_vertices * 24 + (size_t)soup.n_faces * 12;
    /* On top: the head, one header, one block a thread. */
    const size_t n_threads = (size_t)loxo_context_n_threads(test_context);
    CHECK(loxo_context_memory(test_context).peak_bytes < mesh_bytes + 300000 + n_threads * 270000);
    loxo_soup_destroy(test_context, &soup);
    text_free(&b);
}

TEST(every_allocation_may_fail)
{
    text_buffer b = {0};
    write_grid(&b, 8, true, -1, -1);
    CHECK(test_each_allocation_fails(read_memory_file, &(memory_file){b.text, b.n, "a.ply"}) >= 5);
    text_free(&b);
    for (int kind = 0; kind < 4; ++kind) {
        const char *path = test_scratch("b.ply");
        write_binary_grid(&b, 8, kind % 2 != 0, kind / 2 != 0, -1);
        write_scratch(path, b.text, b.n);
        CHECK(test_each_allocation_fails(read_disk_file, &(memory_file){.name = path}) >= 4);
        text_free(&b);
    }
}

static int stop_at_once(void *user, const loxo_progress *progress)
{
    (void)progress;
    *(int *)user += 1;
    return 1;
}

TEST(the_monitor_stops_it_and_nothing_is_left)
{
    NEEDS_IDS(360000);
    text_buffer b = {0};
    loxo_soup soup;
    int n_calls = 0;
    write_grid(&b, 180, false, -1, -1); /* may be done before the monitor is asked, after 20 ms */
    loxo_context_set_monitor(test_context, stop_at_once, &n_calls);
    const loxo_status status = loxo_read_mesh_memory(test_context, b.text, b.n, "a.ply", NULL, &soup);
    CHECK(n_calls > 0 ? status == LOXO_ERR_STOPPED : status == LOXO_OK);
    loxo_soup_destroy(test_context, &soup);
    text_free(&b);
}

TEST(shared_surfaces)
{
    static const shared_file files[] = {
        {"meshes/surfaces/david11k.ply", 10671, 21338},        {"meshes/surfaces/hippocampus6k.ply", 6002, 12000},
        {"meshes/surfaces/bimba25k.ply", 25002, 50000},        {"meshes/surfaces/brain48k.ply", 48487, 96970},
        {"meshes/surfaces/moai48k-slivers.ply", 47812, 95620}, {"meshes/surfaces/igea134k.ply", 134345, 268686},
        {"meshes/surfaces/bumpy250k.ply", 249642, 499280},     {"meshes/surfaces/kitten10k.ply", 9996, 19992}};
    check_shared_files(files, sizeof files / sizeof files[0]);
}
