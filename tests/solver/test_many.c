/* SPDX-License-Identifier: MIT
 * Series of solves: farthest points cover, matrices are symmetric where the surface is flat. */
#include "solver/geodesic/geodesic_internal.h"
#include "surfaces.h"

#include <loxo/geodesic.h>

#define N_POINTS 40

/* The points and radii against the definition, with whole solves: radius i is the largest of the least distances, and
 * point i + 1 has it. */
static void check_farthest(loxo_shape shape, int64_t n_vertices, int method)
{
    NEEDS_IDS(6 * n_vertices);
    surface s = surface_make(test_context, shape, n_vertices, NAN);
    const int64_t n = s.soup.n_vertices;
    const loxo_geodesic_settings settings = unjudged_settings((loxo_geodesic_method)method);
    const loxo_index start[2] = {3, 3};
    loxo_index point[N_POINTS];
    double radius[N_POINTS], *least = surface_numbers(&s), *distance = surface_numbers(&s), *one = surface_numbers(&s);
    loxo_geodesic *g = NULL;
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_OK(loxo_geodesic_farthest_points(g, start, 2, N_POINTS, point, radius, distance));
    CHECK_EQUAL(point[0], 3);
    CHECK_EQUAL(radius[0], radius[1]);
    for (int64_t v = 0; v < n; ++v)
        least[v] = HUGE_VAL;
    for (int i = 1; i < N_POINTS; ++i) {
        double farthest = 0.0;
        CHECK_OK(loxo_geodesic_solve(g, &point[i], 1, one, NULL));
        for (int64_t v = 0; v < n; ++v) {
            least[v] = fmin(least[v], one[v]);
            farthest = fmax(farthest, least[v]);
        }
        CHECK_EQUAL(radius[i], farthest);
        CHECK(radius[i] <= radius[i - 1]);
        if (i + 1 < N_POINTS) CHECK_EQUAL(least[point[i + 1]], farthest);
    }
    CHECK(memcmp(least, distance, (size_t)n * sizeof *least) == 0);
    print_message("%s: radius %.4f to %.4f\n", loxo_shape_name(shape), radius[0], radius[N_POINTS - 1]);
    loxo_geodesic_destroy(g);
    loxo_release(test_context, least);
    loxo_release(test_context, distance);
    loxo_release(test_context, one);
    surface_destroy(&s);
}

TEST(farthest_points_of_a_sphere) { check_farthest(LOXO_SHAPE_ICOSPHERE, 10000, LOXO_GEODESIC_EDGE); }

TEST(farthest_points_of_a_grid) { check_farthest(LOXO_SHAPE_GRID, 5000, LOXO_GEODESIC_FACE); }

/* n points at least a radius apart cover a square: discs of half the radius around them do not meet, discs of the radius
 * cover it: n pi r^2 / 4 <= (1 + r)^2 and n pi r^2 >= 1. */
TEST(farthest_points_are_spread)
{
    NEEDS_IDS(6 * 10000);
    surface s = surface_make(test_context, LOXO_SHAPE_GRID, 10000, NAN);
    const loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    const loxo_index start = 0;
    loxo_index point[100];
    double radius[100];
    loxo_geodesic *g = NULL;
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_OK(loxo_geodesic_farthest_points(g, &start, 1, 100, point, radius, NULL));
    for (int i = 9; i < 100; i += 30) {
        const double r = radius[i], n = i + 1;
        print_message("%g points, radius %.4f\n", n, r);
        CHECK(n * 3.1416 * 0.9 * r * r / 4.0 <= (1.0 + r) * (1.0 + r)); /* distances may be short by a few percent */
        CHECK(n * 3.1416 * 1.1 * r * r >= 1.0);
    }
    loxo_geodesic_destroy(g);
    surface_destroy(&s);
}

TEST(farthest_points_that_are_none)
{
    /* two triangles that do not touch, and a vertex without a face */
    static const double position[21] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 5.0, 0.0,
                                        0.0, 6.0, 0.0, 0.0, 5.0, 1.0, 0.0, 9.0, 9.0, 9.0};
    static const loxo_index triangle[6] = {0, 1, 2, 3, 4, 5};
    surface s = surface_small(test_context, 7, position, 2, triangle);
    loxo_geodesic *g = NULL;
    loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    loxo_index point[7];
    double radius[7], distance[7];
    const loxo_index start = 1, bad = 9;
    settings.max_distance = 100.0;
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_OK(loxo_geodesic_farthest_points(g, &start, 1, 3, point, radius, distance));
    CHECK_EQUAL(point[1], 3); /* the other piece comes first, at its lowest number */
    CHECK_EQUAL(radius[0], HUGE_VAL);
    CHECK(isfinite(radius[1]) && radius[2] <= radius[1]);
    CHECK_EQUAL(distance[6], HUGE_VAL);
    CHECK_OK(loxo_geodesic_farthest_points(g, &start, 1, 6, point, radius, NULL));
    CHECK_EQUAL(radius[5], 0.0);
    CHECK_STATUS(test_context, loxo_geodesic_farthest_points(g, &start, 1, 7, point, radius, NULL), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 6);
    CHECK_STATUS(test_context, loxo_geodesic_farthest_points(g, &start, 1, 0, point, radius, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_geodesic_farthest_points(g, &bad, 1, 2, point, radius, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_geodesic_farthest_points(g, NULL, 0, 2, point, radius, NULL), LOXO_ERR_ARGUMENT);
    loxo_polylines lines;
    const loxo_surface_point target = {{0, -1, -1}, {1.0, 0.0, 0.0}};
    CHECK_STATUS(test_context, loxo_geodesic_paths(g, &target, 1, &lines), LOXO_ERR_ARGUMENT); /* no solve of a call */
    loxo_geodesic_destroy(g);
    surface_destroy(&s);
}

/* ---- matrices ------------------------------------------------------------------------------------------------ */

/* On flat meshes: near the straight distances, symmetric as far as those are near (bound: of an entry's relative error in
 * the mean and of its asymmetry; 1.5 times what is measured). */
static void check_matrix(loxo_shape shape, int method, double bound)
{
    enum { N = 24 };
    NEEDS_IDS(6 * 5000);
    surface s = surface_make(test_context, shape, 5000, NAN);
    const loxo_geodesic_settings settings = unjudged_settings((loxo_geodesic_method)method);
    loxo_surface_point point[N];
    double matrix[N][N], position[N][3], error = 0.0, asymmetry = 0.0;
    loxo_geodesic *g = NULL;
    for (int64_t i = 0; i < N; ++i) {
        const int64_t f = (int64_t)(977 * i * i + 13) % s.soup.n_faces;
        const double w = i % 3 == 0 ? 1.0 : i % 3 == 1 ? 0.5 : 0.4;
        point[i] =
            (loxo_surface_point){{s.soup.triangle[3 * f], s.soup.triangle[3 * f + 1], s.soup.triangle[3 * f + 2]},
                                 {w, i % 3 == 2 ? 0.35 : 1.0 - w, i % 3 == 2 ? 0.25 : 0.0}};
        for (int j = 0; j < 3; ++j) {
            position[i][j] = 0.0;
            for (int k = 0; k < 3; ++k)
                position[i][j] += point[i].weight[k] * s.soup.position[3 * point[i].vertex[k] + j];
        }
    }
    point[5] = point[2];
    memcpy(position[5], position[2], sizeof position[5]);
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_OK(loxo_geodesic_matrix(g, point, N, &matrix[0][0]));
    for (int i = 0; i < N; ++i)
        for (int j = 0; j < N; ++j) {
            const double x = position[i][0] - position[j][0], y = position[i][1] - position[j][1];
            const double straight = sqrt(x * x + y * y);
            if (straight == 0.0) {
                CHECK_NEAR(matrix[i][j], 0.0, 1e-15);
                continue;
            }
            error += fabs(matrix[i][j] / straight - 1.0) / (N * N);
            asymmetry += fabs(matrix[i][j] - matrix[j][i]) / (matrix[i][j] + matrix[j][i]) / (N * N);
        }
    print_message("%s, %s: off by %.3f %%, asymmetric by %.3f %%\n", loxo_shape_name(shape), method_names[method],
                  100.0 * error, 100.0 * asymmetry);
    CHECK(error < bound && asymmetry < bound);
    loxo_geodesic_destroy(g);
    surface_destroy(&s);
}

TEST(matrix_of_a_disk)
{
    check_matrix(LOXO_SHAPE_DISK, LOXO_GEODESIC_EDGE, 0.02);
    check_matrix(LOXO_SHAPE_DISK, LOXO_GEODESIC_FACE, 0.02);
}

TEST(matrix_of_a_grid) { check_matrix(LOXO_SHAPE_GRID, LOXO_GEODESIC_EDGE, 0.02); }

/* Two faces of a square: of points on their common edge, on other edges and inside, those that are in one face are a straight
 * line apart, whichever face the edge is counted to. */
/* Points inside the faces of a flat grid: exactly the straight line, both ways round. */
TEST(matrix_between_points_of_a_plane)
{
    surface s = surface_make(test_context, LOXO_SHAPE_GRID, 900, NAN);
    const loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EXACT);
    enum { N = 12 };
    loxo_surface_point point[N];
    double x[N][2], matrix[N][N];
    loxo_geodesic *g = NULL;
    for (int i = 0; i < N; ++i) {
        const int64_t f = (int64_t)(i * 131 + 7) % s.soup.n_faces;
        const double weight[3] = {0.2 + 0.04 * i, 0.1, 0.7 - 0.04 * i};
        x[i][0] = x[i][1] = 0.0;
        for (int k = 0; k < 3; ++k) {
            point[i].vertex[k] = s.soup.triangle[3 * f + k];
            point[i].weight[k] = weight[k];
            for (int c = 0; c < 2; ++c)
                x[i][c] += weight[k] * s.soup.position[3 * (int64_t)point[i].vertex[k] + c];
        }
    }
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_OK(loxo_geodesic_matrix(g, point, N, &matrix[0][0]));
    for (int i = 0; i < N; ++i)
        for (int j = 0; j < N; ++j)
            CHECK_NEAR(matrix[i][j], hypot(x[i][0] - x[j][0], x[i][1] - x[j][1]), 1e-13);
    /* within one face it is the straight line, though its corners are beyond the limit; to another face there is none */
    point[1] = point[0];
    point[1].weight[0] += 1e-6;
    point[1].weight[2] -= 1e-6;
    CHECK_OK(loxo_geodesic_limit(g, 1e-5));
    CHECK_OK(loxo_geodesic_matrix(g, point, N, &matrix[0][0]));
    CHECK(matrix[0][1] > 0.0 && matrix[0][1] < 1e-5);
    CHECK(matrix[0][2] == HUGE_VAL);
    loxo_geodesic_destroy(g);
    surface_destroy(&s);
}

TEST(matrix_inside_a_face)
{
    static const double position[12] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0};
    static const loxo_index triangle[6] = {0, 1, 2, 0, 2, 3};
    static const loxo_surface_point point[6] = {{{0, 2, -1}, {0.5, 0.5, 0.0}},   {{0, 1, 2}, {0.45, 0.05, 0.5}},
                                                {{0, 3, 2}, {0.45, 0.05, 0.5}},  {{0, 1, -1}, {0.75, 0.25, 0.0}},
                                                {{0, 3, -1}, {0.75, 0.25, 0.0}}, {{3, -1, -1}, {1.0, 0.0, 0.0}}};
    static const double x[6][2] = {{0.5, 0.5}, {0.55, 0.5}, {0.5, 0.55}, {0.25, 0.0}, {0.0, 0.25}, {0.0, 1.0}};
    static const int faces[6] = {3, 1, 2, 1, 2, 2}; /* a bit for each that has it */
    surface s = surface_small(test_context, 4, position, 2, triangle);
    for (int method = 0; method < LOXO_GEODESIC_N_METHODS; ++method) {
        const loxo_geodesic_settings settings = unjudged_settings((loxo_geodesic_method)method);
        double matrix[6][6];
        loxo_geodesic *g = NULL;
        CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
        CHECK_OK(loxo_geodesic_matrix(g, point, 6, &matrix[0][0]));
        const bool is_exact = method == LOXO_GEODESIC_EXACT || method == LOXO_GEODESIC_FAST;
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 5; ++j) { /* at a vertex it is what the method says */
                const double line = hypot(x[i][0] - x[j][0], x[i][1] - x[j][1]);
                if ((faces[i] & faces[j]) == 0) continue;
                CHECK(matrix[i][j] <= line + 1e-15); /* others may say less between vertices */
                if (is_exact) CHECK_NEAR(matrix[i][j], line, 4e-15);
            }
        loxo_geodesic_destroy(g);
    }
    surface_destroy(&s);
}

/* All that a method says is NaN. */
static loxo_status solve_nothing(void *state, const geodesic_seed *seeds, int64_t n_seeds, double *distance,
                                 loxo_index *nearest, loxo_geodesic_info *info)
{
    (void)state, (void)seeds, (void)n_seeds, (void)nearest, (void)info;
    for (int v = 0; v < 4; ++v)
        distance[v] = NAN;
    return LOXO_OK;
}

TEST(series_of_what_is_not_finite)
{
    static const double position[12] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0};
    static const loxo_index triangle[6] = {0, 1, 2, 0, 2, 3};
    const loxo_surface_point points[2] = {{{0, -1, -1}, {1.0, 0.0, 0.0}}, {{0, 2, 3}, {0.25, 0.25, 0.5}}};
    const loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    surface s = surface_small(test_context, 4, position, 2, triangle);
    loxo_geodesic *g = NULL;
    loxo_index point[3];
    double matrix[4], distance[4];
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    geodesic_engine broken = *g->engine;
    broken.solve = solve_nothing;
    broken.touched = NULL;
    g->engine = &broken;
    CHECK_STATUS(test_context, loxo_geodesic_solve(g, (const loxo_index[]){0}, 1, distance, NULL), LOXO_ERR_NUMERIC);
    CHECK_STATUS(test_context, loxo_geodesic_matrix(g, points, 2, matrix), LOXO_ERR_NUMERIC);
    CHECK_STATUS(test_context, loxo_geodesic_farthest_points(g, (const loxo_index[]){0}, 1, 3, point, NULL, NULL),
                 LOXO_ERR_NUMERIC);
    loxo_geodesic_destroy(g);
    surface_destroy(&s);
}

TEST(matrices_that_are_none)
{
    surface s = surface_make(test_context, LOXO_SHAPE_DISK, 100, NAN);
    const loxo_surface_point good = {{0, -1, -1}, {1.0, 0.0, 0.0}}, bad[2] = {good, {{0, -1, -1}, {0.5, 0.0, 0.0}}};
    double matrix[4];
    loxo_geodesic *g = NULL;
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, NULL, &g));
    CHECK_STATUS(test_context, loxo_geodesic_matrix(g, bad, 2, matrix), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 1);
    CHECK_STATUS(test_context, loxo_geodesic_matrix(g, NULL, 2, matrix), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_geodesic_matrix(g, &good, 1, NULL), LOXO_ERR_ARGUMENT);
    CHECK_OK(loxo_geodesic_matrix(g, &good, 1, matrix));
    CHECK_EQUAL(matrix[0], 0.0);
    loxo_geodesic_destroy(g);
    surface_destroy(&s);
}

static loxo_status run_series(loxo_context *ctx, void *arg)
{
    const surface *s = arg;
    const loxo_surface_point points[2] = {{{0, -1, -1}, {1.0, 0.0, 0.0}}, {{5, -1, -1}, {1.0, 0.0, 0.0}}};
    const loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    loxo_mesh *mesh = NULL;
    loxo_geodesic *g = NULL;
    loxo_index point[4];
    double matrix[4];
    loxo_status status = loxo_mesh_create(ctx, &s->arrays, LOXO_BORROW, NULL, NULL, &mesh);
    if (status >= 0) status = loxo_geodesic_create(ctx, mesh, &settings, &g);
    if (status >= 0) status = loxo_geodesic_farthest_points(g, (const loxo_index[]){0}, 1, 4, point, NULL, NULL);
    if (status >= 0) status = loxo_geodesic_matrix(g, points, 2, matrix);
    loxo_geodesic_destroy(g);
    loxo_mesh_destroy(mesh);
    return status;
}

TEST(each_allocation_fails)
{
    surface s = surface_make(test_context, LOXO_SHAPE_GRID, 100, NAN);
    CHECK(test_each_allocation_fails(run_series, &s) > 20);
    surface_destroy(&s);
}

static uint64_t hash_on(loxo_context *ctx, const void *arg)
{
    const loxo_soup *soup = arg;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    const loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    const loxo_surface_point points[3] = {
        {{0, -1, -1}, {1.0, 0.0, 0.0}},
        {{soup->triangle[30], soup->triangle[31], soup->triangle[32]}, {0.2, 0.3, 0.5}},
        {{70, -1, -1}, {1.0, 0.0, 0.0}}};
    loxo_mesh *mesh = NULL;
    loxo_geodesic *g = NULL;
    loxo_polylines lines;
    loxo_index point[12];
    double radius[12], matrix[9], *distance = loxo_allocate(ctx, soup->n_vertices, sizeof *distance);
    CHECK_STATUS(ctx, loxo_mesh_create(ctx, &arrays, LOXO_BORROW, NULL, NULL, &mesh), LOXO_OK);
    CHECK_STATUS(ctx, loxo_geodesic_create(ctx, mesh, &settings, &g), LOXO_OK);
    CHECK_STATUS(ctx, loxo_geodesic_farthest_points(g, (const loxo_index[]){9}, 1, 12, point, radius, NULL), LOXO_OK);
    CHECK_STATUS(ctx, loxo_geodesic_matrix(g, points, 3, matrix), LOXO_OK);
    uint64_t hash =
        test_hash(point, sizeof point) ^ test_hash(radius, sizeof radius) ^ test_hash(matrix, sizeof matrix);
    CHECK_STATUS(ctx, loxo_geodesic_solve_points(g, &points[1], 1, distance, NULL), LOXO_OK);
    CHECK_STATUS(ctx, loxo_geodesic_paths(g, points, 3, &lines), LOXO_OK);
    hash ^= test_hash(lines.position, (size_t)lines.n_points * sizeof *lines.position);
    loxo_polylines_destroy(ctx, &lines);
    const double level = 0.5;
    CHECK_STATUS(ctx, loxo_isolines(ctx, mesh, distance, &level, 1, &lines), LOXO_OK);
    hash ^= test_hash(lines.position, (size_t)lines.n_points * sizeof *lines.position);
    loxo_polylines_destroy(ctx, &lines);
    loxo_release(ctx, distance);
    loxo_geodesic_destroy(g);
    loxo_mesh_destroy(mesh);
    return hash;
}

TEST(same_bits_for_any_number_of_threads)
{
    NEEDS_IDS(6 * 20000);
    loxo_soup soup = soup_make(test_context, LOXO_SHAPE_BUMPY, 20000, NAN);
    test_same_for_any_threads(hash_on, &soup);
    loxo_soup_destroy(test_context, &soup);
}
