/* SPDX-License-Identifier: MIT
 * Landmarks out of files, in memory and on disk, and on a mesh; points of surfaces and values there. */
#include "io/landmarks.h"
#include "reading.h"

#include <loxo/mesh.h>

#define N_VERTICES 100

/* "CS 5:0.5 6:0.25 7:0.25, 8:1 | IPS closed ..." : curves, points, vertices with their weights. */
static void landmarks_text(const loxo_landmarks *l, char *text, size_t n)
{
    size_t used = 0;
    text[0] = 0;
    for (int64_t c = 0; c < l->n_curves; ++c) {
        used += (size_t)snprintf(text + used, n - used, "%s%s%s", c == 0 ? "" : " | ", l->name[c],
                                 l->is_closed[c] ? " closed" : "");
        for (int64_t i = l->curve_begin[c]; i < l->curve_begin[c + 1]; ++i) {
            used += (size_t)snprintf(text + used, n - used, "%s", i == l->curve_begin[c] ? "" : ",");
            if (l->point[i].vertex[0] < 0 && l->point[i].vertex[1] < 0 && l->point[i].vertex[2] < 0)
                used += (size_t)snprintf(text + used, n - used, " at %g %g %g", l->position[i][0], l->position[i][1],
                                         l->position[i][2]);
            for (int k = 0; k < 3; ++k)
                if (l->point[i].vertex[k] >= 0)
                    used += (size_t)snprintf(text + used, n - used, " %d:%g", (int)l->point[i].vertex[k],
                                             l->point[i].weight[k]);
            CHECK(used < n);
        }
    }
}

typedef struct good_landmarks {
    const char *bytes, *name, *landmarks;
} good_landmarks;

#define HEAD "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
#define FILE_OF(n, inside)                                                                                             \
    HEAD "<BorderFile Version=\"3\" Structure=\"CORTEX_LEFT\" SurfaceNumberOfVertices=\"" n                            \
         "\">\n<Class Name=\"???\" Red=\"1\">\n" inside "</Class>\n</BorderFile>"
#define BORDER(name, inside) "<Border Name=\"" name "\" Red=\"0\">\n" inside "</Border>\n"
#define PART(closed, vertices, weights)                                                                                \
    "<BorderPart Closed=\"" closed "\">\n<Vertices>" vertices "</Vertices>\n<Weights>" weights                         \
    "</Weights>\n</BorderPart>\n"

static const good_landmarks good[] = {
    {"a,5\na,6\nb,7\n", "a.csv", "a 5:1, 6:1 | b 7:1"},
    {"\xef\xbb\xbfname;vertex\r\n\r\n# comment\r\n a b ; 5\r\n", "a.csv", "a b 5:1"},
    {"a,0\na,1\na,2\na,0\nb,3\nb,3", "a.csv", "a closed 0:1, 1:1, 2:1 | b 3:1, 3:1"},
    {"a,5\nb,6\na,7\n", "a.csv", "a 5:1 | b 6:1 | a 7:1"},
    {"p,1,-2.5,3e1\np,0,0,0\n", "a.csv", "p at 1 -2.5 30, at 0 0 0"},
    {"p,1,2,3,1,1,2\n", "a.csv", "p 1:0.25 2:0.25 3:0.5"},
    {"name,v,v,v,w,w,w\np,1,2,3,1,0,0\n", "a.txt", "p 1:1 2:0 3:0"},
#ifdef LOXO_WITH_EXPAT
    {FILE_OF("100", BORDER("CS", PART("False", "5 6 7\n8 9 10\n", "0.5 0.25 0.25\n2 1 1\n"))), "a.border",
     "CS 5:0.5 6:0.25 7:0.25, 8:0.5 9:0.25 10:0.25"},
    {FILE_OF("100", BORDER("CS", PART("True", "1 2 3", "1 0 0") PART("False", "4 5 6", "0 0 1"))
                        BORDER("a &amp; b", PART("False", "7 8 9 1 2 3", "1 1 2 0 1 0"))),
     "a.xml", "CS closed 1:1 2:0 3:0 | CS 4:0 5:0 6:1 | a & b 7:0.25 8:0.25 9:0.5, 1:0 2:1 3:0"},
    {"<BorderFile Version=\"3\"><MetaData><MD><Name>x</Name></MD></MetaData>" BORDER(
         "s", PART("False", "1 2 3", "1 1 2")) "</BorderFile>",
     "a.border", "s 1:0.25 2:0.25 3:0.5"},
#endif
};

TEST(good_files)
{
    for (size_t i = 0; i < sizeof good / sizeof good[0]; ++i) {
        char text[1024];
        loxo_landmarks l = {0};
        CHECK_OK(loxo_read_landmarks_bytes(test_context, (const uint8_t *)good[i].bytes, strlen(good[i].bytes),
                                           good[i].name, N_VERTICES, &l));
        landmarks_text(&l, text, sizeof text);
        CHECK_TEXT(text, good[i].landmarks);
        loxo_landmarks_destroy(test_context, &l);
        CHECK(l.n_curves == 0 && l.point == NULL);
        const char *path = test_scratch(good[i].name);
        write_scratch(path, good[i].bytes, strlen(good[i].bytes));
        CHECK_OK(loxo_read_landmarks(test_context, path, N_VERTICES, &l));
        landmarks_text(&l, text, sizeof text);
        CHECK_TEXT(text, good[i].landmarks);
        loxo_landmarks_destroy(test_context, &l);
    }
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 0);
}

static const bad_file bad[] = {
    {"empty", BYTES(""), LOXO_ERR_MALFORMED, 0, 0, -1, "empty file"},
    {"no row", BYTES("# nothing\n\n"), LOXO_ERR_MALFORMED, 0, -1, -1, "no landmark"},
    {"header only", BYTES("name,vertex\n"), LOXO_ERR_MALFORMED, 0, -1, -1, "no landmark"},
    {"three columns", BYTES("a,1,2\n"), LOXO_ERR_MALFORMED, 1, -1, 0, "3 columns"},
    {"nine columns", BYTES("a,1,2,3,4,5,6,7,8\n"), LOXO_ERR_MALFORMED, 1, -1, 0, "9 columns"},
    {"columns differ", BYTES("a,1\na,1,2,3\n"), LOXO_ERR_MALFORMED, 2, -1, 1,
     "4 columns where the lines before have 2"},
    {"out of range", BYTES("a,1\n\na,100\n"), LOXO_ERR_MALFORMED, 3, -1, 1, "\"100\" is no vertex"},
    {"negative", BYTES("a,-1\n"), LOXO_ERR_MALFORMED, 1, -1, 0, "\"-1\" is no vertex"},
    {"wraps", BYTES("a,4294967297\n"), LOXO_ERR_MALFORMED, 1, -1, 0, "is no vertex"},
    {"many digits", BYTES("a,99999999999999999999999\n"), LOXO_ERR_MALFORMED, 1, -1, 0, "is no vertex"},
    {"fraction", BYTES("a,1.5\n"), LOXO_ERR_MALFORMED, 1, -1, 0, "\"1.5\" is not a vertex number"},
    {"empty vertex", BYTES("a,1\na,\n"), LOXO_ERR_MALFORMED, 2, -1, 1, "is not a vertex number"},
    {"no name", BYTES(",1\n"), LOXO_ERR_MALFORMED, 1, -1, 0, "is no name"},
    {"not a number", BYTES("a,1,2,3\na,1,x,2\n"), LOXO_ERR_MALFORMED, 2, -1, 1, "\"x\" is not a finite number"},
    {"not finite", BYTES("a,1,nan,2\n"), LOXO_ERR_MALFORMED, 1, -1, 0, "\"nan\" is not a finite number"},
    {"overflow", BYTES("a,1,1e400,2\n"), LOXO_ERR_MALFORMED, 1, -1, 0, "is not a finite number"},
    {"negative weight", BYTES("a,1,2,3,1,-1,1\n"), LOXO_ERR_MALFORMED, 1, -1, 0, "negative or all 0"},
    {"no weight", BYTES("a,1,2,3,0,0,0\n"), LOXO_ERR_MALFORMED, 1, -1, 0, "negative or all 0"},
    {"NUL", BYTES("a\0b,1\n"), LOXO_ERR_MALFORMED, 1, -1, 0, "NUL"},
    {"UTF-16",
     BYTES("\xff\xfe"
           "a\0,\0"),
     LOXO_ERR_MALFORMED, 0, -1, -1, "UTF-16"},
#ifdef LOXO_WITH_EXPAT
    {"other XML", BYTES("<?xml version=\"1.0\"?><GIFTI/>"), LOXO_ERR_MALFORMED, 1, 21, -1, "no borders"},
    {"version", BYTES(HEAD "<BorderFile Version=\"1\"/>"), LOXO_ERR_UNSUPPORTED, 2, 39, -1, "version \"1\""},
    {"no version", BYTES(HEAD "<BorderFile/>"), LOXO_ERR_UNSUPPORTED, 2, 39, -1, "version \"\""},
    {"another surface", BYTES(FILE_OF("32492", "")), LOXO_ERR_MALFORMED, 2, 39, -1, "32492 vertices, the mesh has 100"},
    {"no border", BYTES(FILE_OF("100", "")), LOXO_ERR_MALFORMED, 0, -1, -1, "no landmark"},
    {"cut", BYTES(HEAD "<BorderFile Version=\"3\"><Class>"), LOXO_ERR_MALFORMED, 2, 70, -1, "XML: "},
    {"no name", BYTES(HEAD "<BorderFile Version=\"3\"><Border/></BorderFile>"), LOXO_ERR_MALFORMED, 2, 63, -1,
     "without a Name"},
    {"vertex", BYTES(FILE_OF("100", BORDER("CS", PART("False", "1 2 3\n4 5 100", "1 1 1 1 1 1")))), LOXO_ERR_MALFORMED,
     7, -1, 1, "border \"CS\": \"100\" is no vertex"},
    {"no vertex number", BYTES(FILE_OF("100", BORDER("CS", PART("False", "1 2 x", "1 1 1")))), LOXO_ERR_MALFORMED, 6,
     -1, 0, "\"x\" is not a vertex number"},
    {"two of three", BYTES(FILE_OF("100", BORDER("CS", PART("False", "1 2", "1 1 1")))), LOXO_ERR_MALFORMED, 6, -1, 0,
     "fewer than three vertices"},
    {"few weights", BYTES(FILE_OF("100", BORDER("CS", PART("False", "1 2 3", "1 1")))), LOXO_ERR_MALFORMED, 7, -1, 0,
     "fewer weights"},
    {"many weights", BYTES(FILE_OF("100", BORDER("CS", PART("False", "1 2 3", "1 1\n1 7")))), LOXO_ERR_MALFORMED, 8, -1,
     1, "\"7\" is one weight too many"},
    {"bad weight", BYTES(FILE_OF("100", BORDER("CS", PART("False", "1 2 3", "1 1,5 1")))), LOXO_ERR_MALFORMED, 7, -1, 0,
     "\"1,5\" is not a finite number"},
    {"weights sum to 0", BYTES(FILE_OF("100", BORDER("CS", PART("False", "1 2 3", "0 0 0")))), LOXO_ERR_MALFORMED, 7,
     -1, 0, "negative or all 0"},
    {"no weights", BYTES(FILE_OF("100", BORDER("CS", "<BorderPart><Vertices>1 2 3</Vertices></BorderPart>"))),
     LOXO_ERR_MALFORMED, 5, 210, -1, "without Vertices or without Weights"},
    {"entity", BYTES(HEAD "<!DOCTYPE a [<!ENTITY x \"y\">]><BorderFile Version=\"3\"/>"), LOXO_ERR_MALFORMED, 2, 51, -1,
     "DOCTYPE"},
#endif
};

/* What was read before stays as it is. */
TEST(bad_files)
{
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        const char *name = i >= 20 ? "a.border" : "a.csv", *path = test_scratch(name);
        char text[256];
        loxo_landmarks l = {0};
        loxo_context_clear(test_context);
        check_failure(
            test_context, &bad[i],
            loxo_read_landmarks_bytes(test_context, (const uint8_t *)bad[i].bytes, bad[i].n, name, N_VERTICES, &l),
            name);
        CHECK(l.n_curves == 0 && l.point == NULL && l.name == NULL);
        CHECK_OK(
            loxo_read_landmarks_bytes(test_context, (const uint8_t *)"a,1\na,2\na,3\n", 12, "x.csv", N_VERTICES, &l));
        write_scratch(path, bad[i].bytes, bad[i].n);
        check_failure(test_context, &bad[i], loxo_read_landmarks(test_context, path, N_VERTICES, &l), path);
        landmarks_text(&l, text, sizeof text);
        CHECK_TEXT(text, "a 1:1, 2:1, 3:1");
        CHECK_OK(loxo_read_landmarks_bytes(test_context, (const uint8_t *)"a,4\n", 4, "x.csv", N_VERTICES, &l));
        landmarks_text(&l, text, sizeof text);
        CHECK_TEXT(text, "a 1:1, 2:1, 3:1 | a 4:1");
        loxo_landmarks_destroy(test_context, &l);
    }
    loxo_landmarks l = {0};
    CHECK_STATUS(test_context, loxo_read_landmarks(test_context, NULL, 1, &l), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_read_landmarks(test_context, test_scratch("none"), 1, &l), LOXO_ERR_READ);
    loxo_landmarks_destroy(test_context, NULL);
}

static loxo_status read_many(loxo_context *ctx, void *arg)
{
    loxo_landmarks l = {0};
    const char *text = arg;
    loxo_status status = LOXO_OK;
    for (int i = 0; i < 3 && status >= 0; ++i)
        status = loxo_read_landmarks_bytes(ctx, (const uint8_t *)text, strlen(text), "a.csv", N_VERTICES, &l);
    loxo_landmarks_destroy(ctx, &l);
    return status;
}

TEST(every_allocation_may_fail)
{
    char rows[] = "a,1\na,2\na,3\nb,4\na,5\nc,6\nd,7\n";
    CHECK(test_each_allocation_fails(read_many, rows) > 10);
#ifdef LOXO_WITH_EXPAT
    char border[] = FILE_OF("100", BORDER("CS", PART("False", "1 2 3", "1 1 1")));
    CHECK(test_each_allocation_fails(read_many, border) > 10);
#endif
}

/* The four sulci of the shared atlas; their weights do not always sum to 1 as they stand there. */
TEST(shared_borders)
{
    static const char *const names[] = {"CS", "IPS", "PoCS", "SF"};
    static const int64_t n_points[] = {20, 20, 14, 13};
    loxo_landmarks l = {0};
    NEEDS_IDS(32492);
#ifndef LOXO_WITH_EXPAT
    SKIP();
#endif
    for (int i = 0; i < 4; ++i) {
        char file[128];
        snprintf(file, sizeof file, "meshes/surfaces/fs_LR.32k.L.border-%s.border", names[i]);
        if (test_shared(file) == NULL) SKIP();
        CHECK_OK(loxo_read_landmarks(test_context, test_shared(file), 32492, &l));
        CHECK_EQUAL(l.n_curves, i + 1);
        CHECK_TEXT(l.name[i], names[i]);
        CHECK(!l.is_closed[i]);
        CHECK_EQUAL(l.curve_begin[i + 1] - l.curve_begin[i], n_points[i]);
    }
    for (int64_t i = 0; i < l.n_points; ++i)
        CHECK_NEAR(l.point[i].weight[0] + l.point[i].weight[1] + l.point[i].weight[2], 1.0, 4e-16);
    loxo_landmarks_destroy(test_context, &l);
}

/* ---- on a mesh ------------------------------------------------------------------------------------------------- */

static loxo_mesh *tetrahedron(loxo_context *ctx)
{
    static const double position[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 5, 5, 5}; /* the last is in no face */
    static const loxo_index triangle[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    const loxo_mesh_arrays arrays = {.n_vertices = 5, .n_faces = 4, .position = position, .triangle = triangle};
    loxo_mesh *mesh = NULL;
    CHECK_STATUS(ctx, loxo_mesh_create(ctx, &arrays, LOXO_COPY, NULL, NULL, &mesh), LOXO_OK);
    return mesh;
}

static loxo_landmarks read_text(const char *text)
{
    loxo_landmarks l = {0};
    CHECK_OK(loxo_read_landmarks_bytes(test_context, (const uint8_t *)text, strlen(text), "a.csv", 5, &l));
    return l;
}

TEST(positions_become_points)
{
    loxo_mesh *mesh = tetrahedron(test_context);
    loxo_landmarks l = read_text("a,0.25,0.25,-0.5\nb,0,0,2\n");
    char text[256];
    double away = 0.0;
    CHECK_OK(loxo_landmarks_locate(mesh, &l, &away));
    landmarks_text(&l, text, sizeof text);
    CHECK_TEXT(text, "a 0:0.5 2:0.25 1:0.25 | b 3:1");
    CHECK_NEAR(away, 1.0, 1e-15);
    CHECK_OK(loxo_landmarks_locate(mesh, &l, &away)); /* again changes nothing */
    CHECK(away == 0.0);
    l.point[0].weight[0] = 1.5; /* of a sum of 2 */
    CHECK_OK(loxo_landmarks_locate(mesh, &l, NULL));
    CHECK_NEAR(l.point[0].weight[0], 0.75, 1e-15);
    loxo_landmarks_destroy(test_context, &l);
    loxo_mesh_destroy(mesh);
}

TEST(points_that_are_none)
{
    loxo_mesh *mesh = tetrahedron(test_context);
    loxo_landmarks l = read_text("a,1\na,2\n");
    static const struct {
        loxo_index vertex;
        double weight;
    } wrong[] = {{4, 1.0}, {5, 1.0}, {1, -1.0}, {1, NAN}, {1, 0.0}, {1, INFINITY}};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
        l.point[1].vertex[0] = wrong[i].vertex;
        l.point[1].weight[0] = wrong[i].weight;
        CHECK_STATUS(test_context, loxo_landmarks_locate(mesh, &l, NULL), LOXO_ERR_ARGUMENT);
        CHECK_EQUAL(loxo_context_failure(test_context)->element, 1);
    }
    l.point[1].vertex[0] = -1;
    l.position[1][2] = NAN;
    CHECK_STATUS(test_context, loxo_landmarks_locate(mesh, &l, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_landmarks_locate(mesh, NULL, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_landmarks_locate(NULL, &l, NULL), LOXO_ERR_ARGUMENT);
    loxo_landmarks_destroy(test_context, &l);
    loxo_mesh_destroy(mesh);
}

TEST(values_at_points)
{
    const loxo_surface_point point[2] = {{{0, 1, 2}, {0.5, 0.25, 0.25}}, {{-1, 3, -1}, {NAN, 1.0, NAN}}};
    const double field[8] = {4, 8, 0, 4, 8, 0, 1, 2};
    double value[4];
    CHECK_OK(loxo_surface_interpolate(test_context, 2, point, 4, 2, field, value));
    CHECK(value[0] == 4.0 && value[1] == 5.0 && value[2] == 1.0 && value[3] == 2.0);
    CHECK_STATUS(test_context, loxo_surface_interpolate(test_context, 2, point, 3, 2, field, value), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 1);
    CHECK_STATUS(test_context, loxo_surface_interpolate(test_context, 2, NULL, 4, 2, field, value), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_surface_interpolate(test_context, -1, point, 4, 2, field, value),
                 LOXO_ERR_ARGUMENT);
    CHECK_OK(loxo_surface_interpolate(test_context, 0, NULL, 0, 2, NULL, NULL));
}
