/* SPDX-License-Identifier: MIT
 * Vertices and points that files name: lists, FreeSurfer labels, GIFTI regions, rows of coordinates; good and bad. */
#include "io/field.h"
#include "io/vertices.h"
#include "loxo_config.h"
#include "reading.h"

#define N_VERTICES 12

static loxo_index *vertex;
static double *position;
static int64_t n_read;

static loxo_status read_named(const void *bytes, size_t n, const char *name, const char *key)
{
    loxo_context_clear(test_context);
    return loxo_read_vertices_bytes(test_context, bytes, n, name, key, N_VERTICES, &vertex, &n_read);
}

static loxo_status read_label(const char *text) { return read_named(text, strlen(text), "a.label", NULL); }

/* Expected: numbers with blanks between them. */
static void check_read(loxo_status status, const char *expected)
{
    char text[256] = "";
    size_t used = 0;
    CHECK_STATUS(test_context, status, LOXO_OK);
    for (int64_t i = 0; i < n_read; ++i)
        used += (size_t)snprintf(text + used, sizeof text - used, "%s%d", i > 0 ? " " : "", (int)vertex[i]);
    CHECK_TEXT(text, expected);
    loxo_release(test_context, vertex);
    vertex = NULL;
}

static void check_fails(loxo_status status, loxo_status expected, int64_t line, const char *part)
{
    const loxo_failure *failure = loxo_context_failure(test_context);
    CHECK_STATUS(test_context, status, expected);
    CHECK(vertex == NULL && n_read == 0);
    CHECK_EQUAL(failure->line, line);
    if (strstr(failure->text, part) == NULL) print_error("%s: %s\n", failure->text, part);
    CHECK(strstr(failure->text, part) != NULL);
}

TEST(lists)
{
    static const char *const good[] = {"1 2 11", "1,2,11", "# first\n1\n2 # more\n\n11", " 1 ,\t2\r\n11\r\n",
                                       "\xef\xbb\xbf 1 2 11"};
    for (int i = 0; i < 5; ++i)
        check_read(read_named(good[i], strlen(good[i]), "a.txt", NULL), "1 2 11");
    check_read(read_named(BYTES("3 3"), "a", NULL), "3 3");
    check_fails(read_named(BYTES(""), "a", NULL), LOXO_ERR_MALFORMED, 0, "no vertex in it");
    check_fails(read_named(BYTES("# nothing\n\n"), "a", NULL), LOXO_ERR_MALFORMED, 0, "no vertex in it");
    check_fails(read_named(BYTES("1\n2x\n"), "a", NULL), LOXO_ERR_MALFORMED, 2, "'2x' is not a vertex number");
    check_fails(read_named(BYTES("1\n2.0\n"), "a", NULL), LOXO_ERR_MALFORMED, 2, "'2.0' is not a vertex number");
    check_fails(read_named(BYTES("1\n\n12"), "a", NULL), LOXO_ERR_ARGUMENT, 3, "'12' is not in 0..11");
    check_fails(read_named(BYTES("-1"), "a", NULL), LOXO_ERR_ARGUMENT, 1, "'-1' is not in 0..11");
    check_fails(read_named(BYTES("4294967297"), "a", NULL), LOXO_ERR_ARGUMENT, 1, "not in 0..11");
    check_fails(read_named(BYTES("99999999999999999999999"), "a", NULL), LOXO_ERR_ARGUMENT, 1, "not in 0..11");
    check_fails(read_named("1\0"
                           "2",
                           3, "a", NULL),
                LOXO_ERR_MALFORMED, 1, "is not a vertex number");
}

TEST(labels)
{
    check_read(read_label("#!ascii label  , from subject bert vox2ras=TkReg\n2\n5  -1.5 2 3e1  0.0000000000\n"
                          "11  0 0 0 1\n"),
               "5 11");
    check_read(read_label("# any comment\r\n 1 \r\n\r\n  7 1 2 3 0\r\n\r\n"), "7");
    check_read(read_label("#\r1\r3 0 0 0 0"), "3");
    check_read(read_label("\xef\xbb\xbf#!ascii label\n1\n0 nan inf 1e400 0\n"), "0");         /* nobody uses these */
    check_read(read_named(BYTES("#!ascii label\n1\n4 0 0 0 0\n"), "regions.txt", NULL), "4"); /* by the content */
    check_read(read_label("#\n1\n3 0 0 0 0\n9 0 0 0 0\n"), "3");
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 1);
    CHECK(strstr(loxo_context_warning(test_context, 0)->text, "more behind the 1 entries (first: line 4)") != NULL);
}

TEST(bad_labels)
{
    static const struct {
        const char *text;
        loxo_status status;
        int64_t line;
        const char *part;
    } rows[] = {
        {"", LOXO_ERR_MALFORMED, 0, "empty file"},
        {"2\n5 0 0 0 0\n", LOXO_ERR_MALFORMED, 1, "does not begin with #"},
        {"#", LOXO_ERR_MALFORMED, 1, "number of entries is missing"},
        {"#\n", LOXO_ERR_MALFORMED, 2, "number of entries is missing"},
        {"#\n\n1\n5 0 0 0 0\n", LOXO_ERR_MALFORMED, 2, "number of entries is missing"},
        {"#\ntwo\n", LOXO_ERR_MALFORMED, 2, "\"two\" is not a number of entries"},
        {"#\n1.0\n", LOXO_ERR_MALFORMED, 2, "\"1.0\" is not a number of entries"},
        {"#\n-1\n", LOXO_ERR_MALFORMED, 2, "\"-1\" is not a number of entries"},
        {"#\n1 2\n", LOXO_ERR_MALFORMED, 2, "is not a number of entries"},
        {"#\n2000000000\n5 0 0 0 0\n", LOXO_ERR_MALFORMED, 2, "2000000000 entries announced"},
        {"#\n18446744073709551616\n5 0 0 0 0\n", LOXO_ERR_MALFORMED, 2, "entries announced"},
        {"#\n0\n", LOXO_ERR_MALFORMED, 0, "no vertex in it"},
        {"#\n2\n5 0 0 0 0\n", LOXO_ERR_MALFORMED, 0, "2 entries announced, 1 found"},
        {"#\n1\n5 0 0 0\n", LOXO_ERR_MALFORMED, 3, "4 values where 5 are needed"},
        {"#\n1\n5 0 0 0 0 0\n", LOXO_ERR_MALFORMED, 3, "more than 5 values"},
        {"#\n1\n5 0 0 0x0 0\n", LOXO_ERR_MALFORMED, 3, "\"0x0\" is not a number"},
        {"#\n1\n5 0,0 0 0\n", LOXO_ERR_MALFORMED, 3, "\"0,0\" is not a number"},
        {"#\n1\n5.5 0 0 0 0\n", LOXO_ERR_MALFORMED, 3, "\"5.5\" is not an integer"},
        {"#\n1\n12 0 0 0 0\n", LOXO_ERR_MALFORMED, 3, "vertex index 12 not in 0..11"},
        {"#\n1\n-2 0 0 0 0\n", LOXO_ERR_MALFORMED, 3, "vertex index -2 not in 0..11"},
        {"#\n1\n4294967297 0 0 0 0\n", LOXO_ERR_MALFORMED, 3, "vertex index 4294967297 not in"},
        {"#\n2\n1 0 0 0 0\n\n-1 3 4 5 0\n", LOXO_ERR_UNSUPPORTED, 5, "coordinates only"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; ++i)
        check_fails(read_label(rows[i].text), rows[i].status, rows[i].line, rows[i].part);
    check_fails(read_named("#\n1\n5 0 0 \0 0\n", 14, "a.label", NULL), LOXO_ERR_MALFORMED, 3, "NUL byte");
}

#ifdef LOXO_WITH_EXPAT
#define GIFTI(type, n, data)                                                                                           \
    "<?xml version=\"1.0\"?><GIFTI NumberOfDataArrays=\"1\"><LabelTable><Label Key=\"0\">none</Label>\n"               \
    "<Label Key=\"3\" Red=\"1\"> V1 </Label><Label Index=\"7\"><![CDATA[V2: & more]]></Label>\n"                       \
    "<Label Key=\"-7\">below</Label><Label Key=\"x\">nothing</Label></LabelTable>"                                     \
    "<DataArray Intent=\"NIFTI_INTENT_LABEL\" DataType=\"NIFTI_TYPE_" type "\" Dimensionality=\"1\" Dim0=\"" n         \
    "\" Encoding=\"ASCII\"><Data>" data "</Data></DataArray></GIFTI>"

TEST(gifti_regions)
{
    static const char labels[] = GIFTI("INT32", "12", "0 3 3 0 7 0 0 0 0 -7 0 3");
    static const char shape[] = GIFTI("FLOAT32", "12", "0 0.5 -0 nan 0 0 1e-30 0 0 0 0 2.5");
    static const char few[] = GIFTI("INT32", "2", "1 1");
    static const char other[] = GIFTI("UINT8", "2", "1 1");
    check_read(read_named(BYTES(labels), "a.label.gii", NULL), "1 2 4 9 11");
    check_read(read_named(BYTES(labels), "a.label.gii", "3"), "1 2 11");
    check_read(read_named(BYTES(labels), "a.label.gii", "-7"), "9");
    check_read(read_named(BYTES(labels), "a.label.gii", "V1"), "1 2 11");
    check_read(read_named(BYTES(labels), "a.label.gii", "V2: & more"), "4");
    check_read(read_named(BYTES(labels), "a.label.gii", "below"), "9");
    check_read(read_named(BYTES(shape), "a.shape.gii", NULL), "1 6 11");
    check_read(read_named(BYTES(shape), "a.shape.gii", "2.5"), "11");
    check_fails(read_named(BYTES(labels), "a.gii", "V3"), LOXO_ERR_MALFORMED, 0, "there is no label called 'V3'");
    check_fails(read_named(BYTES(labels), "a.gii", "nothing"), LOXO_ERR_MALFORMED, 0, "there is no label called");
    check_fails(read_named(BYTES(labels), "a.gii", "5"), LOXO_ERR_MALFORMED, 0, "no vertex has the key '5'");
    check_fails(read_named(BYTES(few), "a.gii", NULL), LOXO_ERR_MALFORMED, 3, "2 values for 12 vertices");
    check_fails(read_named(BYTES(other), "a.gii", NULL), LOXO_ERR_MALFORMED, 0, "without an array of one number");
    check_fails(read_named(BYTES("<GIFTI>"), "a.gii", NULL), LOXO_ERR_MALFORMED, 1, "XML");
    check_fails(read_named(BYTES(""), "a.gii", NULL), LOXO_ERR_MALFORMED, 0, "empty file");
}

TEST(key_behind_a_name)
{
    static const char labels[] = GIFTI("INT32", "12", "0 3 3 0 7 0 0 0 0 0 0 3");
    char path[4200];
    write_scratch(test_scratch("a.label.gii"), BYTES(labels));
    snprintf(path, sizeof path, "%s:V1", test_scratch("a.label.gii"));
    check_read(loxo_read_vertices(test_context, path, N_VERTICES, &vertex, &n_read), "1 2 11");
    snprintf(path, sizeof path, "%s:V2: & more", test_scratch("a.label.gii"));
    check_read(loxo_read_vertices(test_context, path, N_VERTICES, &vertex, &n_read), "4");
    check_read(loxo_read_vertices(test_context, test_scratch("a.label.gii"), N_VERTICES, &vertex, &n_read), "1 2 4 11");
}
#endif

TEST(files_of_vertices)
{
    loxo_index *none = NULL;
    int64_t n = 0;
    write_scratch(test_scratch("lh.V1.label"), BYTES("#!ascii label\n1\n4 0 0 0 0\n"));
    check_read(loxo_read_vertices(test_context, test_scratch("lh.V1.label"), N_VERTICES, &vertex, &n_read), "4");
    CHECK_STATUS(test_context, loxo_read_vertices(test_context, test_scratch("absent"), 5, &none, &n), LOXO_ERR_READ);
    CHECK_STATUS(test_context, loxo_read_vertices(test_context, NULL, 5, &none, &n), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(NULL, loxo_read_vertices(NULL, "a", 5, &none, &n), LOXO_ERR_ARGUMENT);
}

static loxo_status read_all_kinds(loxo_context *ctx, void *arg)
{
    loxo_index *list = NULL;
    double *points = NULL;
    int64_t n = 0;
    (void)arg;
    loxo_status status = loxo_read_vertices_bytes(ctx, (const uint8_t *)"1 2 3", 5, "a", NULL, N_VERTICES, &list, &n);
    loxo_release(ctx, list);
    static const char label[] = "#\n1\n4 0 0 0 0\n";
    if (status >= 0)
        status = loxo_read_label(ctx, (const uint8_t *)label, sizeof label - 1, "a", N_VERTICES, &list, &n);
    if (status >= 0) loxo_release(ctx, list);
    if (status >= 0) status = loxo_read_points_bytes(ctx, (const uint8_t *)"1 2 3", 5, "a", &points, &n);
    loxo_release(ctx, points);
    return status;
}

TEST(each_allocation_fails) { CHECK(test_each_allocation_fails(read_all_kinds, NULL) >= 3); }

/* ---- points -------------------------------------------------------------------------------------------------- */

static loxo_status read_points(const void *bytes, size_t n)
{
    loxo_context_clear(test_context);
    return loxo_read_points_bytes(test_context, bytes, n, "a.csv", &position, &n_read);
}

static void check_points(loxo_status status, int64_t n, const double *expected)
{
    CHECK_STATUS(test_context, status, LOXO_OK);
    CHECK_EQUAL(n_read, n);
    for (int64_t i = 0; i < 3 * n; ++i)
        CHECK_EQUAL(position[i], expected[i]);
    loxo_release(test_context, position);
    position = NULL;
}

TEST(rows_of_points)
{
    static const double expected[6] = {1.0, -2.5, 3e2, 0.0, 0.5, 1.0};
    static const char *const good[] = {"1,-2.5,3e2\n0,.5,1\n", "x,y,z\n1, -2.5, 3e2\n\n0, .5, 1.",
                                       "# c\n-x .y z\n1 -2.5 300 # d\n0 0.5 1", "1;-2.5;300\r\n0;0.5;1\r\n"};
    for (int i = 0; i < 4; ++i)
        check_points(read_points(good[i], strlen(good[i])), 2, expected);
    char npy[256] = "\x93NUMPY\x01\x00";
    const char *head[2] = {"{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }",
                           "{'descr': '<f8', 'fortran_order': True, 'shape': (2, 3), }"};
    for (int order = 0; order < 2; ++order) {
        const size_t n_head = strlen(head[order]);
        npy[8] = (char)n_head;
        npy[9] = 0;
        memcpy(npy + 10, head[order], n_head);
        for (int i = 0; i < 6; ++i)
            memcpy(npy + 10 + n_head + 8 * (size_t)i, &expected[order == 0 ? i : 3 * (i % 2) + i / 2], 8);
        check_points(read_points(npy, 10 + n_head + 48), 2, expected);
        CHECK_STATUS(test_context, read_points(npy, 10 + n_head + 47), LOXO_ERR_MALFORMED);
    }
}

TEST(bad_rows_of_points)
{
    static const struct {
        const char *text;
        int64_t line;
        const char *part;
    } rows[] = {
        {"", 0, "no point in it"},
        {"x,y,z\n", 0, "no point in it"},
        {"1 2\n", 1, "2 values where 3 are needed"},
        {"1 2 3 4\n", 1, "more than 3 values"},
        {"1 2 3\na b c\n", 2, "\"a\" is not a number"},
        {"1 2 3\n1 2 nan\n", 2, "\"nan\" is not a number"},
        {"1 2 3\n1,,3\n", 2, "is not a number"},
        {"1,5 2,5 3,5\n", 1, "more than 3 values"},
        {"1 2 1e400\n", 1, "is not a number"},
        {"1.5abc 2 3\n4 5 6\n", 1, "\"1.5abc\" is not a number"}, /* no header */
        {"-0x1p0 2 3\n4 5 6\n", 1, "\"-0x1p0\" is not a number"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; ++i) {
        const loxo_failure *failure = loxo_context_failure(test_context);
        CHECK_STATUS(test_context, read_points(rows[i].text, strlen(rows[i].text)), LOXO_ERR_MALFORMED);
        CHECK(position == NULL && n_read == 0);
        CHECK_EQUAL(failure->line, rows[i].line);
        if (strstr(failure->text, rows[i].part) == NULL) print_error("%s: %s\n", failure->text, rows[i].part);
        CHECK(strstr(failure->text, rows[i].part) != NULL);
    }
}

/* ---- arrays -------------------------------------------------------------------------------------------------- */

static loxo_status read_array(const void *bytes, size_t n, loxo_array *array)
{
    loxo_context_clear(test_context);
    return loxo_read_array_bytes(test_context, bytes, n, "a.npy", array);
}

/* A .npy of a text as header and doubles 0, 1, 2, ... */
static size_t make_npy(char *npy, const char *head, int n_numbers)
{
    const size_t n_head = strlen(head);
    memcpy(npy, "\x93NUMPY\x01\x00", 8);
    npy[8] = (char)n_head;
    npy[9] = 0;
    memcpy(npy + 10, head, n_head);
    for (int i = 0; i < n_numbers; ++i)
        memcpy(npy + 10 + n_head + 8 * (size_t)i, &(double){i}, 8);
    return 10 + n_head + 8 * (size_t)n_numbers;
}

TEST(arrays_of_one_to_three_dimensions)
{
    static const struct {
        const char *head;
        int n_dimensions;
        int64_t shape[3], n;
    } cases[] = {
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (24,), }", 1, {24, 0, 0}, 24},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (6, 4), }", 2, {6, 4, 0}, 24},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3, 4), }", 3, {2, 3, 4}, 24},
        {"{'descr': '<f8', 'fortran_order': True, 'shape': (2, 3, 4), }", 3, {2, 3, 4}, 24},
    };
    char npy[512];
    for (int i = 0; i < 4; ++i) {
        loxo_array a;
        const size_t n = make_npy(npy, cases[i].head, 24);
        CHECK_OK(read_array(npy, n, &a));
        CHECK_EQUAL(a.n_dimensions, cases[i].n_dimensions);
        for (int k = 0; k < 3; ++k)
            CHECK_EQUAL(a.shape[k], cases[i].shape[k]);
        for (int64_t k = 0; k < 24; ++k) /* the last index fastest; of the last case it was the first */
            CHECK_EQUAL(a.value[k], i < 3 ? k : (k % 4 * 3 + k / 4 % 3) * 2 + k / 12);
        loxo_array_destroy(test_context, &a);
        CHECK_STATUS(test_context, read_array(npy, n - 1, &a), LOXO_ERR_MALFORMED);
        CHECK(a.value == NULL);
    }
    loxo_array a;
    CHECK_OK(read_array("# c\nx,y\n1,2\n3 4 # d\n", 20, &a));
    CHECK(a.n_dimensions == 2 && a.shape[0] == 2 && a.shape[1] == 2 && a.value[3] == 4.0);
    loxo_array_destroy(test_context, &a);
}

TEST(bad_arrays)
{
    static const struct {
        const char *head;
        loxo_status status;
    } cases[] = {
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (), }", LOXO_ERR_UNSUPPORTED},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1, 1, 1), }", LOXO_ERR_UNSUPPORTED},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (0, 3), }", LOXO_ERR_MALFORMED},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (9000000000000000000, 2), }", LOXO_ERR_MALFORMED},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (2, 9, 2), }", LOXO_ERR_MALFORMED},
        {"{'descr': '<c16', 'fortran_order': False, 'shape': (2, 2), }", LOXO_ERR_UNSUPPORTED},
    };
    char npy[512];
    loxo_array a;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i)
        CHECK_STATUS(test_context, read_array(npy, make_npy(npy, cases[i].head, 24), &a), cases[i].status);
    CHECK_STATUS(test_context, read_array("1 2\n3\n", 6, &a), LOXO_ERR_MALFORMED);
    CHECK_STATUS(test_context, read_array("1 2\n3 4 5\n", 10, &a), LOXO_ERR_MALFORMED);
    CHECK_STATUS(test_context, read_array("1,,2\n", 5, &a), LOXO_ERR_MALFORMED);
    CHECK_STATUS(test_context, read_array("", 0, &a), LOXO_ERR_MALFORMED);
}

TEST(arrays_there_and_back)
{
    double value[24];
    for (int i = 0; i < 24; ++i)
        value[i] = sin(i);
    for (int n_dimensions = 1; n_dimensions <= 3; ++n_dimensions)
        for (int k = 0; k < 2; ++k) {
            static const int64_t shapes[3][3] = {{24}, {8, 3}, {4, 2, 3}};
            const char *path = test_scratch(k == 0 ? "a.npy" : "a.csv");
            loxo_array a;
            CHECK_OK(loxo_write_array(test_context, path, value, n_dimensions, shapes[n_dimensions - 1]));
            CHECK_OK(loxo_read_array(test_context, path, &a));
            CHECK_EQUAL(a.n_dimensions, k == 0 ? n_dimensions : 2);
            CHECK(memcmp(a.value, value, sizeof value) == 0);
            loxo_array shape;
            size_t peak_bytes = 0;
            CHECK_OK(loxo_read_array_shape(test_context, path, &shape, &peak_bytes));
            CHECK(shape.value == NULL && shape.n_dimensions == a.n_dimensions && peak_bytes >= sizeof value);
            CHECK(memcmp(shape.shape, a.shape, (size_t)a.n_dimensions * sizeof *a.shape) == 0);
            loxo_array_destroy(test_context, &a);
        }
    CHECK_STATUS(test_context,
                 loxo_write_array(test_context, test_scratch("a.npy"), value, 4, (const int64_t[4]){1, 1, 1, 1}),
                 LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context,
                 loxo_write_array(test_context, test_scratch("a.npy"), value, 2, (const int64_t[2]){-1, 3}),
                 LOXO_ERR_ARGUMENT);
}
