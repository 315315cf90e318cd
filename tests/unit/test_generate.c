/* SPDX-License-Identifier: MIT
 * Generators: counts, closedness, genus, orientation, areas in closed form, the same bits from every way of making. */
#include "../test.h"
#include "base/context.h"
#include "mesh/generate_internal.h"
#include "par/range.h"

#include <loxo/mesh.h>

#define PI 3.141592653589793

static loxo_generate_settings settings_of(loxo_shape shape, int64_t n_vertices)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    settings.shape = shape;
    settings.n_vertices = n_vertices;
    settings.seed = 7;
    return settings;
}

static loxo_soup generate(const loxo_generate_settings *settings)
{
    loxo_soup soup;
    CHECK_OK(loxo_generate(test_context, settings, false, &soup));
    return soup;
}

static void drop(loxo_soup *soup)
{
    loxo_release(test_context, soup->position);
    loxo_release(test_context, soup->position_float);
    loxo_release(test_context, soup->triangle);
    *soup = (loxo_soup){0};
}

typedef struct facts {
    int64_t n_boundary_edges, euler;
    double area, volume, least_normal_z, mean_edge;
    double sum[3], box[2][3];
} facts;

static double length(const double a[3], const double b[3])
{
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

static void add_face(const loxo_soup *soup, int64_t f, facts *x)
{
    const double *p[3];
    double n[3], u[3], w[3];
    for (int c = 0; c < 3; ++c)
        p[c] = soup->position + (int64_t)3 * soup->triangle[3 * f + c];
    for (int c = 0; c < 3; ++c) {
        u[c] = p[1][c] - p[0][c];
        w[c] = p[2][c] - p[0][c];
    }
    for (int c = 0; c < 3; ++c)
        n[c] = u[(c + 1) % 3] * w[(c + 2) % 3] - u[(c + 2) % 3] * w[(c + 1) % 3];
    const double twice = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    CHECK(twice > 0.0);
    x->area += 0.5 * twice;
    x->volume += (p[0][0] * n[0] + p[0][1] * n[1] + p[0][2] * n[2]) / 6.0;
    if (n[2] / twice < x->least_normal_z) x->least_normal_z = n[2] / twice;
    for (int c = 0; c < 3; ++c)
        x->mean_edge += length(p[c], p[(c + 1) % 3]);
}

/* Sorts the directed edges by their ends: each must be there once, and its reverse once or, at a boundary, not at all.
 * Every vertex must be in a face. */
static facts look(const loxo_soup *soup)
{
    const int64_t n = 3 * soup->n_faces;
    uint64_t *key = malloc((size_t)n * sizeof *key);
    uint32_t *payload = malloc((size_t)n * sizeof *payload);
    unsigned char *used = calloc((size_t)soup->n_vertices, 1);
    facts x = {.least_normal_z = 1.0, .box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}}};
    int64_t n_edges = 0;
    for (int64_t h = 0; h < n; ++h) {
        const uint64_t a = (uint64_t)soup->triangle[h], b = (uint64_t)soup->triangle[h % 3 == 2 ? h - 2 : h + 1];
        CHECK(a < (uint64_t)soup->n_vertices);
        CHECK(a != b);
        used[a] = 1;
        key[h] = a < b ? a << 33 | b << 1 : b << 33 | a << 1 | 1;
        payload[h] = (uint32_t)h;
    }
    CHECK_OK(loxo_sort_u64(test_context, n, key, payload, 64));
    for (int64_t i = 0; i < n; ++i) {
        CHECK(i == 0 || key[i] != key[i - 1]);
        const bool has_twin =
            key[i] % 2 == 0 ? i + 1 < n && key[i + 1] == key[i] + 1 : i > 0 && key[i - 1] == key[i] - 1;
        n_edges += key[i] % 2 == 0 || !has_twin;
        x.n_boundary_edges += !has_twin;
    }
    for (int64_t v = 0; v < soup->n_vertices; ++v)
        CHECK(used[v]);
    for (int64_t f = 0; f < soup->n_faces; ++f)
        add_face(soup, f, &x);
    x.mean_edge /= (double)n;
    for (int64_t i = 0; i < 3 * soup->n_vertices; ++i) {
        const int c = (int)(i % 3);
        x.sum[c] += soup->position[i];
        x.box[0][c] = fmin(x.box[0][c], soup->position[i]);
        x.box[1][c] = fmax(x.box[1][c], soup->position[i]);
    }
    x.euler = soup->n_vertices - n_edges + soup->n_faces;
    free(used);
    free(payload);
    free(key);
    return x;
}

static const struct {
    loxo_shape shape;
    int64_t euler;
    int64_t n_loops; /* of the boundary; 0: closed */
    bool is_flat;
} expected[] = {
    {LOXO_SHAPE_ICOSPHERE, 2, 0, false}, {LOXO_SHAPE_LATLONG, 2, 0, false},  {LOXO_SHAPE_ELLIPSOID, 2, 0, false},
    {LOXO_SHAPE_TORUS, 0, 0, false},     {LOXO_SHAPE_GENUS, -2, 0, false},   {LOXO_SHAPE_BUMPY, 2, 0, false},
    {LOXO_SHAPE_NOISY, 2, 0, false},     {LOXO_SHAPE_DISK, 1, 1, true},      {LOXO_SHAPE_GRID, 1, 1, true},
    {LOXO_SHAPE_STRIP, 1, 1, true},      {LOXO_SHAPE_CYLINDER, 0, 2, false}, {LOXO_SHAPE_ANNULUS, 0, 2, true},
    {LOXO_SHAPE_BRAIN, 2, 0, false},
};

TEST(every_shape_is_a_closed_or_bordered_surface_turned_outward)
{
    static const int64_t sizes[] = {50, 51, 333, 2000, 5000};
    CHECK(sizeof expected == LOXO_N_SHAPES * sizeof expected[0]);
    for (int s = 0; s < LOXO_N_SHAPES; ++s) {
        for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; ++k) {
            const loxo_generate_settings settings = settings_of(expected[s].shape, sizes[k]);
            loxo_soup soup = generate(&settings);
            const facts x = look(&soup);
            CHECK_EQUAL(x.euler, expected[s].euler);
            CHECK((x.n_boundary_edges == 0) == (expected[s].n_loops == 0));
            if (expected[s].n_loops == 0) CHECK(x.volume > 0.0);
            if (expected[s].is_flat) CHECK_EQUAL(x.least_normal_z, 1.0);
            if (expected[s].shape == LOXO_SHAPE_CYLINDER) CHECK(x.volume > 0.0);
            CHECK(2 * soup.n_vertices > sizes[k] && soup.n_vertices < 2 * sizes[k]);
            drop(&soup);
        }
    }
}

TEST(the_smallest_meshes)
{
    static const int64_t smallest[LOXO_N_SHAPES] = {12, 5, 12, 9, 48, 12, 12, 7, 4, 4, 6, 18, 12};
    for (int s = 0; s < LOXO_N_SHAPES; ++s) {
        loxo_generate_settings settings = settings_of((loxo_shape)s, smallest[s]);
        loxo_soup soup = generate(&settings);
        CHECK_EQUAL(soup.n_vertices, smallest[s]);
        CHECK_EQUAL(look(&soup).euler, expected[s].euler);
        drop(&soup);
        settings.n_vertices = smallest[s] - 1;
        CHECK_STATUS(test_context, loxo_generate(test_context, &settings, false, &soup), LOXO_ERR_ARGUMENT);
        CHECK_EQUAL(soup.n_vertices, 0);
        settings.n_vertices = (int64_t)LOXO_INDEX_MAX;
        CHECK_STATUS(test_context, loxo_generate(test_context, &settings, false, &soup), LOXO_ERR_LIMIT);
        settings.n_vertices = INT64_MAX;
        CHECK_STATUS(test_context, loxo_generate(test_context, &settings, false, &soup), LOXO_ERR_LIMIT);
        settings.n_vertices = -1;
        CHECK_STATUS(test_context, loxo_generate(test_context, &settings, false, &soup), LOXO_ERR_ARGUMENT);
    }
}

TEST(genus_is_exact)
{
    for (int g = 0; g < 60; g = 2 * g + 1) {
        for (int64_t n = (int64_t)16 * (g + 1); n < 5000; n = 2 * n + 37) {
            loxo_generate_settings settings = settings_of(LOXO_SHAPE_GENUS, n);
            settings.params[0] = g;
            loxo_soup soup = generate(&settings);
            const facts x = look(&soup);
            CHECK_EQUAL(x.euler, 2 - 2 * g);
            CHECK_EQUAL(x.n_boundary_edges, 0);
            CHECK(x.volume > 0.0);
            drop(&soup);
        }
    }
}

TEST(counts_come_near_what_was_wanted)
{
    /* Spheres: between two frequencies, 10 n^2 + 2. Grids: the rounding of one side. */
    const loxo_generate_settings sphere = settings_of(LOXO_SHAPE_ICOSPHERE, 1010),
                                 disk = settings_of(LOXO_SHAPE_DISK, 900);
    loxo_soup soup = generate(&sphere);
    CHECK_EQUAL(soup.n_vertices, 1002);
    CHECK_EQUAL(soup.n_faces, 2000);
    drop(&soup);
    soup = generate(&disk);
    CHECK_EQUAL(soup.n_vertices, 919);
    drop(&soup);
    for (int64_t n = 100; n < 4000; n += 271) {
        static const loxo_shape shapes[] = {LOXO_SHAPE_GRID, LOXO_SHAPE_TORUS, LOXO_SHAPE_CYLINDER, LOXO_SHAPE_LATLONG};
        for (int s = 0; s < 4; ++s) {
            const loxo_generate_settings settings = settings_of(shapes[s], n);
            soup = generate(&settings);
            CHECK_NEAR((double)soup.n_vertices, (double)n, sqrt((double)n));
            drop(&soup);
        }
    }
}

TEST(areas_and_volumes_tend_to_closed_forms)
{
    /* Inscribed triangles miss area and volume by O(edge^2): 4000 vertices have edges of 0.06 on the unit sphere. */
    loxo_generate_settings settings = settings_of(LOXO_SHAPE_ICOSPHERE, 5000);
    loxo_soup soup = generate(&settings);
    facts x = look(&soup);
    CHECK_NEAR(x.area, 4.0 * PI, 0.02);
    CHECK_NEAR(x.volume, 4.0 / 3.0 * PI, 0.01);
    drop(&soup);
    settings.shape = LOXO_SHAPE_LATLONG;
    soup = generate(&settings);
    CHECK_NEAR(look(&soup).area, 4.0 * PI, 0.02);
    drop(&soup);
    settings.shape = LOXO_SHAPE_ELLIPSOID;
    soup = generate(&settings);
    CHECK_NEAR(look(&soup).volume, 4.0 / 3.0 * PI * 0.8 * 0.6, 0.005);
    drop(&soup);
    settings.shape = LOXO_SHAPE_TORUS;
    soup = generate(&settings);
    x = look(&soup);
    CHECK_NEAR(x.area, 4.0 * PI * PI * 0.4, 0.05);
    CHECK_NEAR(x.volume, 2.0 * PI * PI * 0.16, 0.02);
    drop(&soup);
    settings.shape = LOXO_SHAPE_CYLINDER;
    soup = generate(&settings);
    CHECK_NEAR(look(&soup).area, 4.0 * PI, 0.01);
    drop(&soup);
    settings.shape = LOXO_SHAPE_ANNULUS;
    soup = generate(&settings);
    CHECK_NEAR(look(&soup).area, 0.75 * PI, 0.005);
    drop(&soup);
    settings.shape = LOXO_SHAPE_DISK;
    soup = generate(&settings);
    CHECK_NEAR(look(&soup).area, PI, 0.005);
    drop(&soup);
    settings.shape = LOXO_SHAPE_GRID;
    soup = generate(&settings);
    CHECK_NEAR(look(&soup).area, 1.0, 1e-12); /* flat: rounding of 10^4 sums only */
    drop(&soup);
    settings.shape = LOXO_SHAPE_STRIP;
    soup = generate(&settings);
    CHECK_EQUAL(soup.n_vertices, 5000);
    CHECK_EQUAL(look(&soup).area, 2499.0);
    drop(&soup);
}

/* The file of the benchmarks has the same formula in another numbering. */
TEST(bumpy_sphere_is_that_of_the_benchmarks)
{
    const char *path = test_shared("meshes/surfaces/bumpy250k.ply");
    if (path == NULL || LOXO_INDEX_MAX < 3 * 499280) SKIP();
    const loxo_generate_settings settings = settings_of(LOXO_SHAPE_BUMPY, 249642);
    loxo_soup soup = generate(&settings), file = {.n_vertices = 249642, .n_faces = 499280};
    char line[256];
    CHECK_EQUAL(soup.n_vertices, file.n_vertices);
    CHECK_EQUAL(soup.n_faces, file.n_faces);
    FILE *f = fopen(path, "rb");
    CHECK(f != NULL);
    do
        CHECK(fgets(line, sizeof line, f) != NULL);
    while (strcmp(line, "end_header\n") != 0);
    file.position = loxo_allocate(test_context, file.n_vertices, 3 * sizeof(double));
    file.triangle = loxo_allocate(test_context, file.n_faces, 3 * sizeof(loxo_index));
    CHECK(fread(file.position, 3 * sizeof(double), (size_t)file.n_vertices, f) == (size_t)file.n_vertices);
    for (int64_t t = 0; t < file.n_faces; ++t) {
        int32_t corner[3] = {0};
        CHECK(fgetc(f) == 3 && fread(corner, sizeof corner, 1, f) == 1);
        for (int c = 0; c < 3; ++c)
            file.triangle[3 * t + c] = (loxo_index)corner[c];
    }
    fclose(f);
    const facts x = look(&soup), y = look(&file);
    CHECK_NEAR(x.area, y.area, 1e-9);
    CHECK_NEAR(x.volume, y.volume, 1e-9);
    CHECK_NEAR(x.mean_edge, y.mean_edge, 1e-12);
    CHECK_NEAR3(x.sum, y.sum, 1e-6); /* 2.5e5 terms near 1, rounded at 1e-16 each */
    CHECK_NEAR3(x.box[0], y.box[0], 1e-12);
    CHECK_NEAR3(x.box[1], y.box[1], 1e-12);
    drop(&soup);
    drop(&file);
}

/* Faces from all over a mesh that is never made: ids in range, edges of the length that the area grants. */
TEST(two_hundred_million_vertices)
{
    enum { N = 64 };
    if (LOXO_INDEX_MAX < 3 * (int64_t)400000000) SKIP();
    for (int s = 0; s < LOXO_N_SHAPES; ++s) {
        const loxo_generate_settings settings = settings_of((loxo_shape)s, 200000000);
        loxo_generator g;
        CHECK_OK(loxo_generator_make(test_context, &settings, &g));
        CHECK_NEAR((double)g.n_vertices, 2e8, 1e5);
        /* The area is below 50, the strip's edges are 1; slopes of the bumps and folds stretch edges by a few. */
        const double longest = s == LOXO_SHAPE_STRIP ? 1.5 : 20.0 * sqrt(50.0 / (double)g.n_faces);
        for (int64_t k = 0; k <= 97; ++k) {
            loxo_index triangle[N][3];
            const int64_t begin = (g.n_faces - N) / 97 * k + (k == 97 ? (g.n_faces - N) % 97 : 0);
            g.faces(&g, begin, begin + N, triangle);
            for (int f = 0; f < N; ++f) {
                double p[3][3];
                for (int c = 0; c < 3; ++c) {
                    CHECK(triangle[f][c] >= 0 && triangle[f][c] < g.n_vertices);
                    g.positions(&g, triangle[f][c], (int64_t)triangle[f][c] + 1, &p[c]);
                }
                for (int c = 0; c < 3; ++c)
                    CHECK(length(p[c], p[(c + 1) % 3]) < longest && length(p[c], p[(c + 1) % 3]) > 0.0);
            }
        }
    }
}

TEST(the_same_bits_for_any_number_of_threads)
{
    static const int ladder[] = {1, 2, 3, 7};
    for (int s = 0; s < LOXO_N_SHAPES; ++s) {
        const loxo_generate_settings settings = settings_of((loxo_shape)s, 5000);
        uint64_t hash[4];
        for (int k = 0; k < 4; ++k) {
            loxo_context *ctx = test_context_with_threads(ladder[k]);
            loxo_soup soup;
            CHECK_STATUS(ctx, loxo_generate(ctx, &settings, k % 2 == 1, &soup), LOXO_OK);
            hash[k] = test_hash(soup.triangle, (size_t)soup.n_faces * 3 * sizeof(loxo_index));
            for (int64_t i = 0; i < 3 * soup.n_vertices; ++i) {
                const float x = soup.position != NULL ? (float)soup.position[i] : soup.position_float[i];
                hash[k] = hash[k] * 31 + test_hash(&x, sizeof x);
            }
            loxo_release(ctx, soup.position);
            loxo_release(ctx, soup.position_float);
            loxo_release(ctx, soup.triangle);
            loxo_context_destroy(ctx);
            CHECK_EQUAL(hash[k], hash[0]);
        }
    }
}

/* The file's data, byte for byte, made of the arrays. */
static unsigned char *ply_bytes(const loxo_soup *soup, size_t *n)
{
    const void *position = soup->position != NULL ? (const void *)soup->position : soup->position_float;
    const size_t position_bytes =
        (size_t)soup->n_vertices * 3 * (soup->position != NULL ? sizeof(double) : sizeof(float));
    *n = position_bytes + (size_t)soup->n_faces * 13;
    unsigned char *bytes = malloc(*n), *p = bytes + position_bytes;
    memcpy(bytes, position, position_bytes);
    for (int64_t f = 0; f < soup->n_faces; ++f) {
        *p = 3;
        for (int64_t c = 0; c < 3; ++c) {
            const int32_t id = soup->triangle[3 * f + c];
            memcpy(p + 1 + 4 * c, &id, 4);
        }
        p += 13;
    }
    return bytes;
}

static void check_streamed(const loxo_generate_settings *settings, bool is_float, const char *path)
{
    loxo_soup soup;
    CHECK_OK(loxo_generate(test_context, settings, is_float, &soup));
    size_t n = 0;
    unsigned char *wanted = ply_bytes(&soup, &n), *got = malloc(n + 1);
    int64_t n_vertices = 0, n_faces = 0;
    char line[256], counts[2][64];
    CHECK_OK(loxo_generate_to_ply(test_context, settings, is_float, path, &n_vertices, &n_faces));
    CHECK_EQUAL(n_vertices, soup.n_vertices);
    CHECK_EQUAL(n_faces, soup.n_faces);
    snprintf(counts[0], sizeof counts[0], "element vertex %lld\n", (long long)n_vertices);
    snprintf(counts[1], sizeof counts[1], "element face %lld\n", (long long)n_faces);
    int n_counts = 0;
    FILE *f = fopen(path, "rb");
    CHECK(f != NULL);
    do {
        CHECK(fgets(line, sizeof line, f) != NULL);
        n_counts += strcmp(line, counts[0]) == 0 || strcmp(line, counts[1]) == 0;
    } while (strcmp(line, "end_header\n") != 0);
    CHECK_EQUAL(n_counts, 2);
    CHECK_EQUAL(fread(got, 1, n + 1, f), n);
    CHECK(memcmp(got, wanted, n) == 0);
    fclose(f);
    free(got);
    free(wanted);
    drop(&soup);
}

TEST(streamed_ply_holds_the_same_bytes)
{
    for (int s = 0; s < LOXO_N_SHAPES; ++s) {
        const loxo_generate_settings settings = settings_of((loxo_shape)s, 3000);
        check_streamed(&settings, false, test_scratch("mesh.ply"));
        check_streamed(&settings, true, test_scratch("mesh.ply"));
    }
    if (LOXO_INDEX_MAX > 6 * 400000) { /* more than one block */
        const loxo_generate_settings settings = settings_of(LOXO_SHAPE_GRID, 300000);
        check_streamed(&settings, false, test_scratch("mesh.ply"));
        check_streamed(&settings, true, test_scratch("mesh.ply"));
    }
}

static int stop_at_once(void *user, const loxo_progress *p)
{
    (void)user;
    (void)p;
    return 1;
}

TEST(a_stopped_stream_leaves_no_file)
{
    if (LOXO_INDEX_MAX < 6 * 300000) SKIP();
    /* The monitor is asked every 20 ms at most: two blocks that take longer. */
    const loxo_generate_settings settings = settings_of(LOXO_SHAPE_BRAIN, 300000);
    const char *path = test_scratch("stopped.ply");
    loxo_soup soup;
    loxo_context_set_monitor(test_context, stop_at_once, NULL);
    CHECK_STATUS(test_context, loxo_generate_to_ply(test_context, &settings, false, path, NULL, NULL),
                 LOXO_ERR_STOPPED);
    CHECK(access(path, F_OK) != 0);
    CHECK_STATUS(test_context, loxo_generate(test_context, &settings, false, &soup), LOXO_ERR_STOPPED);
    loxo_context_set_monitor(test_context, NULL, NULL);
    CHECK_STATUS(test_context,
                 loxo_generate_to_ply(test_context, &settings, true, test_scratch("no/such/folder.ply"), NULL, NULL),
                 LOXO_ERR_WRITE);
}

TEST(bad_params_are_named)
{
    static const struct {
        loxo_shape shape;
        double params[4];
    } bad[] = {
        {LOXO_SHAPE_TORUS, {1.0, 1.0, NAN, NAN}},   {LOXO_SHAPE_TORUS, {-1.0, NAN, NAN, NAN}},
        {LOXO_SHAPE_GENUS, {1.5, NAN, NAN, NAN}},   {LOXO_SHAPE_GENUS, {-1, NAN, NAN, NAN}},
        {LOXO_SHAPE_ANNULUS, {1.0, 0.5, NAN, NAN}}, {LOXO_SHAPE_CYLINDER, {INFINITY, NAN, NAN, NAN}},
        {LOXO_SHAPE_DISK, {1.0, NAN, NAN, NAN}},    {LOXO_SHAPE_BRAIN, {1.0, NAN, NAN, NAN}},
        {LOXO_N_SHAPES, {NAN, NAN, NAN, NAN}},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        loxo_generate_settings settings = settings_of(bad[i].shape, 1000);
        loxo_soup soup;
        memcpy(settings.params, bad[i].params, sizeof settings.params);
        CHECK_STATUS(test_context, loxo_generate(test_context, &settings, false, &soup), LOXO_ERR_ARGUMENT);
    }
}

TEST(names_lead_back_to_shapes)
{
    loxo_shape shape = LOXO_N_SHAPES;
    for (int s = 0; s < LOXO_N_SHAPES; ++s) {
        CHECK(loxo_shape_from_name(loxo_shape_name((loxo_shape)s), &shape));
        CHECK_EQUAL(shape, s);
        CHECK(strlen(loxo_shape_help(shape)) > 10);
    }
    CHECK(!loxo_shape_from_name("cube", &shape));
    CHECK(!loxo_shape_from_name(NULL, &shape));
    CHECK_TEXT(loxo_shape_name(LOXO_N_SHAPES), "unknown");
}

/* Distance between two points that need not be vertices of the mesh. */
static double distance_between(loxo_shape shape, const double a[3], const double b[3])
{
    const loxo_generate_settings settings = settings_of(shape, 100);
    double points[6] = {a[0], a[1], a[2], b[0], b[1], b[2]}, distance[2];
    const loxo_soup soup = {.n_vertices = 2, .position = points};
    CHECK_OK(loxo_generate_exact_distance(test_context, &settings, &soup, 0, distance));
    CHECK_EQUAL(distance[0], 0.0);
    return distance[1];
}

TEST(exact_distances_of_small_cases)
{
    const double x[3] = {1, 0, 0}, y[3] = {0, 1, 0}, z[3] = {0, 0, 1}, minus_x[3] = {-1, 0, 0},
                 near_x[3] = {1, 1e-9, 0};
    CHECK_NEAR(distance_between(LOXO_SHAPE_ICOSPHERE, x, y), 0.5 * PI, 1e-15);
    CHECK_NEAR(distance_between(LOXO_SHAPE_LATLONG, x, minus_x), PI, 1e-15);
    CHECK_NEAR(distance_between(LOXO_SHAPE_ICOSPHERE, x, near_x), 1e-9, 1e-24); /* the cosine is 1 here */
    CHECK_NEAR(distance_between(LOXO_SHAPE_DISK, x, y), sqrt(2.0), 1e-15);
    CHECK_NEAR(distance_between(LOXO_SHAPE_STRIP, x, z), sqrt(2.0), 1e-15);
    const double up[3] = {-1, 0, 1}, right[3] = {0, -1, 2};
    CHECK_NEAR(distance_between(LOXO_SHAPE_CYLINDER, x, up), sqrt(PI * PI + 1.0), 1e-15);
    CHECK_NEAR(distance_between(LOXO_SHAPE_CYLINDER, x, right), sqrt(0.25 * PI * PI + 4.0), 1e-15);
    /* Annulus of radii 1/2 and 1. Opposite points of the outer rim: two tangents of sqrt(3)/2, and an arc of 1/3 of half
     * the hole's rim: 1/2 (pi - 2 acos(1/2)) = pi / 6. A quarter turn: the chord passes at sqrt(1/2), free. */
    CHECK_NEAR(distance_between(LOXO_SHAPE_ANNULUS, x, minus_x), sqrt(3.0) + PI / 6.0, 1e-15);
    CHECK_NEAR(distance_between(LOXO_SHAPE_ANNULUS, x, y), sqrt(2.0), 1e-15);
    const double rim[3] = {0.5, 0, 0}, other_rim[3] = {0, 0.5, 0};
    CHECK_NEAR(distance_between(LOXO_SHAPE_ANNULUS, rim, other_rim), 0.25 * PI, 1e-15);
}

/* On the surface no way along edges is shorter than the exact distance, and it is 1-Lipschitz along flat edges. */
TEST(exact_distance_rises_by_no_more_than_the_edge)
{
    static const loxo_shape shapes[] = {LOXO_SHAPE_DISK, LOXO_SHAPE_ANNULUS, LOXO_SHAPE_GRID, LOXO_SHAPE_STRIP};
    for (int s = 0; s < 4; ++s) {
        const loxo_generate_settings settings = settings_of(shapes[s], 2000);
        loxo_soup soup = generate(&settings);
        double *d = malloc((size_t)soup.n_vertices * sizeof *d);
        CHECK_OK(loxo_generate_exact_distance(test_context, &settings, &soup, 17, d));
        for (int64_t h = 0; h < 3 * soup.n_faces; ++h) {
            const loxo_index a = soup.triangle[h], b = soup.triangle[h % 3 == 2 ? h - 2 : h + 1];
            const double edge = length(soup.position + 3 * (int64_t)a, soup.position + 3 * (int64_t)b);
            /* Chords of the hole's rim are shorter than its arc by O(edge^3) < 1e-4 at edges of 0.05. */
            CHECK(fabs(d[a] - d[b]) <= edge + (shapes[s] == LOXO_SHAPE_ANNULUS ? 1e-4 : 1e-14 * d[a] + 1e-15));
        }
        free(d);
        drop(&soup);
    }
}

TEST(exact_distance_refuses_what_it_does_not_know)
{
    const loxo_generate_settings torus = settings_of(LOXO_SHAPE_TORUS, 1000), grid = settings_of(LOXO_SHAPE_GRID, 1000);
    loxo_soup soup = generate(&torus);
    double *d = malloc((size_t)soup.n_vertices * sizeof *d);
    CHECK_STATUS(test_context, loxo_generate_exact_distance(test_context, &torus, &soup, 0, d), LOXO_ERR_UNSUPPORTED);
    CHECK_STATUS(test_context, loxo_generate_exact_distance(test_context, &grid, &soup, -1, d), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_generate_exact_distance(test_context, &grid, &soup, (loxo_index)soup.n_vertices, d),
                 LOXO_ERR_ARGUMENT);
    free(d);
    drop(&soup);
}

static loxo_status generate_and_drop(loxo_context *ctx, void *arg)
{
    loxo_soup soup;
    loxo_status status = loxo_generate(ctx, arg, false, &soup);
    if (status >= 0) status = loxo_generate_to_ply(ctx, arg, true, test_scratch("failing.ply"), NULL, NULL);
    loxo_release(ctx, soup.position);
    loxo_release(ctx, soup.triangle);
    return status;
}

TEST(every_allocation_may_fail)
{
    loxo_generate_settings settings = settings_of(LOXO_SHAPE_ICOSPHERE, 500);
    CHECK(test_each_allocation_fails(generate_and_drop, &settings) >= 4);
}

TEST(a_limit_is_checked_before_the_work)
{
    loxo_context_settings limited = loxo_context_settings_default();
    const loxo_generate_settings settings = settings_of(LOXO_SHAPE_ICOSPHERE, 5000);
    loxo_context *ctx = NULL;
    loxo_soup soup;
    limited.memory_limit_bytes = 100000;
    CHECK_STATUS(NULL, loxo_context_create(&limited, &ctx), LOXO_OK);
    CHECK_STATUS(ctx, loxo_generate(ctx, &settings, false, &soup), LOXO_ERR_MEMORY);
    CHECK_EQUAL(loxo_context_memory(ctx).peak_bytes, 0);
    loxo_context_destroy(ctx);
}
