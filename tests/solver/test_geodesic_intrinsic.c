/* SPDX-License-Identifier: MIT
 * Distances on intrinsic triangulations: the same as on the surface where nothing is flipped, the same bits for every
 * number of threads on meshes that are no simplicial complexes, positive heat and smaller errors on badly shaped triangles. */
#include "../shapes.h"
#include "kernel/diffusion_kernel.h"
#include "mesh/mesh_internal.h"
#include "solver/geodesic/geodesic_internal.h"

#include <loxo/geodesic.h>
#include <loxo/io.h>
#include <loxo/measure.h>

static loxo_mesh *mesh_of(loxo_context *ctx, loxo_soup *soup)
{
    loxo_mesh *mesh = NULL;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    const loxo_status status = loxo_mesh_create(ctx, &arrays, LOXO_ADOPT, NULL, NULL, &mesh);
    *soup = (loxo_soup){0};
    CHECK_STATUS(ctx, status, LOXO_OK);
    return mesh;
}

static loxo_mesh *intrinsic_of(loxo_context *ctx, const loxo_mesh *surface)
{
    loxo_mesh *mesh = NULL;
    CHECK_STATUS(ctx, loxo_mesh_create_intrinsic(ctx, surface, NULL, NULL, &mesh), LOXO_OK);
    return mesh;
}

static loxo_soup generate(loxo_context *ctx, loxo_shape shape, int64_t n_vertices, double parameter, double stretch)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    loxo_soup soup = {0};
    settings.shape = shape;
    settings.n_vertices = n_vertices;
    settings.params[0] = parameter;
    CHECK_STATUS(ctx, loxo_generate(ctx, &settings, false, &soup), LOXO_OK);
    for (int64_t v = 0; v < soup.n_vertices; ++v)
        soup.position[3 * v] *= stretch;
    return soup;
}

static loxo_geodesic_settings settings_of(loxo_geodesic_method method, bool has_constraints)
{
    loxo_geodesic_settings settings = loxo_geodesic_settings_default();
    settings.method = method;
    settings.global_constraints = has_constraints;
    return settings;
}

static const loxo_geodesic_method methods[2] = {LOXO_GEODESIC_EDGE, LOXO_GEODESIC_FACE};

TEST(a_face_has_the_shape_that_its_lengths_tell)
{
    loxo_soup soup = generate(test_context, LOXO_SHAPE_NOISY, 1000, 0.3, 1.0);
    loxo_mesh *surface = mesh_of(test_context, &soup);
    const loxo_mesh_view m = loxo_mesh_get_view(surface);
    double *length = malloc((size_t)m.n_faces * 3 * sizeof *length);
    loxo_mesh_view by_length = m;
    by_length.halfedge_length = length;
    for (int64_t f = 0; f < m.n_faces; ++f)
        k_face_lengths(&m, f, &length[3 * f]);
    for (int64_t f = 0; f < m.n_faces; ++f) {
        const k_face_shape a = k_shape_of_face(&m, f), b = k_shape_of_face(&by_length, f);
        CHECK_NEAR(a.twice_area, b.twice_area, 1e-13 * a.twice_area); /* angles of a few degrees at least */
        for (int k = 0; k < 3; ++k)
            CHECK_NEAR(a.cotangent[k], b.cotangent[k], 1e-12 * (1.0 + a.cotangent[k] * a.cotangent[k]));
    }
    free(length);
    loxo_mesh_destroy(surface);
}

/* Weights are floats, and where rounding differs a level may be left an update earlier: a hundredth
 * of the method's own error. */
TEST(where_nothing_is_flipped_the_distances_are_the_same)
{
    for (int i = 0; i < 4; ++i) {
        loxo_soup soup = i < 2 ? generate(test_context, LOXO_SHAPE_ICOSPHERE, 1000, (double)NAN, 1.0)
                               : shape_annulus(test_context, 60, 14);
        const loxo_geodesic_settings settings = settings_of(methods[i % 2], true);
        const loxo_index sources[2] = {3, 700};
        loxo_mesh *surface = mesh_of(test_context, &soup), *mesh;
        loxo_intrinsic_info intrinsic;
        const int64_t n = loxo_mesh_n_vertices(surface);
        CHECK_OK(loxo_mesh_create_intrinsic(test_context, surface, NULL, &intrinsic, &mesh));
        CHECK_EQUAL(intrinsic.n_flips, 0);
        double *a = calloc((size_t)n, sizeof *a), *b = calloc((size_t)n, sizeof *b);
        loxo_geodesic_info info_a, info_b;
        CHECK_OK(loxo_geodesic_distance(test_context, surface, &settings, sources, 2, a, &info_a));
        CHECK_OK(loxo_geodesic_distance(test_context, mesh, &settings, sources, 2, b, &info_b));
        CHECK_NEAR(info_a.mean_edge_length, info_b.mean_edge_length, 1e-14);
        CHECK_EQUAL(info_a.n_constraints, info_b.n_constraints);
        CHECK_NEAR(info_a.residual, info_b.residual, 1e-6);
        for (int64_t v = 0; v < n; ++v)
            CHECK_NEAR(a[v], b[v], 1e-4);
        free(a);
        free(b);
        loxo_mesh_destroy(mesh);
        loxo_mesh_destroy(surface);
    }
}

/* Needles: many edges join a vertex to itself, many pairs of vertices are joined by several edges. */
static uint64_t hash_on(loxo_context *ctx, const void *settings)
{
    const loxo_index sources[3] = {0, 999, 20000};
    loxo_soup soup = generate(ctx, LOXO_SHAPE_NOISY, 40000, 0.5, 30.0);
    loxo_mesh *surface = mesh_of(ctx, &soup), *mesh = intrinsic_of(ctx, surface);
    const int64_t n = loxo_mesh_n_vertices(surface);
    double *distance = calloc((size_t)n, sizeof *distance);
    loxo_geodesic_info info;
    const loxo_status status = loxo_geodesic_distance(ctx, mesh, settings, sources, 3, distance, &info);
    CHECK(status == LOXO_OK || status == LOXO_CHECK_FAILED);
    CHECK_EQUAL(info.n_nonpositive_heat, 0);
    CHECK(info.diffusion_converged);
    const uint64_t hash = test_hash(distance, (size_t)n * sizeof *distance);
    free(distance);
    loxo_mesh_destroy(mesh);
    loxo_mesh_destroy(surface);
    return hash;
}

TEST(every_number_of_threads_gives_the_same_bits)
{
    NEEDS_IDS(250000);
    for (int i = 0; i < 2; ++i) {
        const loxo_geodesic_settings settings = settings_of(methods[i], true);
        test_same_for_any_threads(hash_on, &settings);
    }
}

/* Shortest ways do not depend on how a surface is cut into triangles: exact distances agree but for rounding, from
 * vertices and from points inside faces. */
TEST(exact_distances_are_those_of_the_surface)
{
    for (int i = 0; i < 6; ++i) {
        loxo_soup soup = i == 0   ? generate(test_context, LOXO_SHAPE_NOISY, 1000, 0.5, 1.0)
                         : i == 1 ? generate(test_context, LOXO_SHAPE_NOISY, 600, 0.4, 10.0)
                         : i == 2 ? generate(test_context, LOXO_SHAPE_DISK, 800, (double)NAN, 10.0)
                         : i == 3 ? shape_torus(test_context, 40, 9)
                         : i == 4 ? shape_annulus(test_context, 40, 3)
                                  : generate(test_context, LOXO_SHAPE_CYLINDER, 120, 0.05, 1.0);
        const loxo_geodesic_settings settings = settings_of(LOXO_GEODESIC_EXACT, false);
        const loxo_index *t = &soup.triangle[3 * 17];
        const loxo_surface_point points[3] = {{{t[0], t[1], t[2]}, {0.2, 0.5, 0.3}},
                                              {{t[3], t[4], -1}, {0.75, 0.25, 0.0}},
                                              {{t[8], -1, -1}, {1.0, 0.0, 0.0}}};
        loxo_mesh *surface = mesh_of(test_context, &soup), *mesh = intrinsic_of(test_context, surface);
        const int64_t n = loxo_mesh_n_vertices(surface);
        double *distance[2] = {calloc((size_t)n, sizeof(double)), calloc((size_t)n, sizeof(double))};
        for (int64_t n_points = 0; n_points < 4; ++n_points) {
            loxo_geodesic_info info = {0};
            for (int k = 0; k < 2; ++k) {
                loxo_geodesic *g = NULL;
                const loxo_index source = 5;
                CHECK_OK(loxo_geodesic_create(test_context, k == 0 ? surface : mesh, &settings, &g));
                if (n_points == 0)
                    CHECK_OK(loxo_geodesic_solve(g, &source, 1, distance[k], &info));
                else
                    CHECK_OK(loxo_geodesic_solve_points(g, points, n_points, distance[k], &info));
                loxo_geodesic_destroy(g);
            }
            for (int64_t v = 0; v < n; ++v)
                CHECK_NEAR(distance[0][v], distance[1][v], 1e-10 * info.distance_max);
        }
        free(distance[0]);
        free(distance[1]);
        loxo_mesh_destroy(mesh);
        loxo_mesh_destroy(surface);
    }
}

/* Distances of a method on the needles below, in *distance; their hash with that of the nearest sources. */
static uint64_t solve_on_needles(loxo_geodesic_method method, int n_threads, double **distance, int64_t *n)
{
    loxo_context *ctx = test_context_with_threads(n_threads);
    loxo_soup soup = generate(ctx, LOXO_SHAPE_NOISY, 4000, 0.4, 10.0);
    loxo_mesh *surface = mesh_of(ctx, &soup), *mesh = intrinsic_of(ctx, surface);
    loxo_geodesic_settings settings = settings_of(method, false);
    const loxo_index sources[2] = {0, 2000};
    loxo_geodesic *g = NULL;
    *n = loxo_mesh_n_vertices(surface);
    *distance = calloc((size_t)*n, sizeof **distance);
    loxo_index *nearest = calloc((size_t)*n, sizeof *nearest);
    settings.nearest = true;
    CHECK_STATUS(ctx, loxo_geodesic_create(ctx, mesh, &settings, &g), LOXO_OK);
    const loxo_status status = loxo_geodesic_solve(g, sources, 2, *distance, NULL);
    if (status != LOXO_CHECK_FAILED) CHECK_STATUS(ctx, status, LOXO_OK);
    CHECK_STATUS(ctx, loxo_geodesic_nearest(g, nearest), LOXO_OK);
    const uint64_t hash =
        test_hash(*distance, (size_t)*n * sizeof **distance) ^ test_hash(nearest, (size_t)*n * sizeof *nearest);
    free(nearest);
    loxo_geodesic_destroy(g);
    loxo_mesh_destroy(mesh);
    loxo_mesh_destroy(surface);
    loxo_context_destroy(ctx);
    return hash;
}

/* All of them, those to come too, on a mesh with edges from vertices to themselves and several between two vertices. */
TEST(every_method_runs_on_needles)
{
    double *exact, *distance[2];
    int64_t n;
    (void)solve_on_needles(LOXO_GEODESIC_EXACT, 1, &exact, &n);
    for (int m = 0; m < LOXO_GEODESIC_N_METHODS; ++m) {
        const loxo_geodesic_method method = (loxo_geodesic_method)m;
        loxo_distance_error error;
        const uint64_t one = solve_on_needles(method, 1, &distance[0], &n);
        const uint64_t three = solve_on_needles(method, 3, &distance[1], &n);
        CHECK_OK(loxo_measure_distance_error(test_context, distance[0], exact, n, &error));
        if (error.mean_relative > 0.1 || one != three)
            print_error("method %s: error %g\n", loxo_geodesic_method_name(method), error.mean_relative);
        CHECK(one == three);
        CHECK(error.mean_relative < 0.1); /* measured: 0.01 to 0.03 with heat */
        free(distance[0]);
        free(distance[1]);
    }
    free(exact);
}

TEST(a_limited_solve_has_the_bits_of_the_whole)
{
    NEEDS_IDS(250000);
    for (int i = 0; i < 4; ++i) {
        loxo_soup soup = generate(test_context, LOXO_SHAPE_NOISY, 40000, 0.5, 20.0);
        const loxo_index *t = &soup.triangle[3 * 1234];
        const loxo_surface_point point = {{t[0], t[1], t[2]}, {0.2, 0.5, 0.3}};
        const loxo_index source = t[0];
        loxo_mesh *surface = mesh_of(test_context, &soup), *mesh = intrinsic_of(test_context, surface);
        const int64_t n = loxo_mesh_n_vertices(surface);
        loxo_geodesic_settings settings = settings_of(methods[i % 2], false);
        double *distance[2] = {calloc((size_t)n, sizeof(double)), calloc((size_t)n, sizeof(double))};
        const double limit = 1.5;
        int64_t n_inside = 0;
        loxo_geodesic_info info[2];
        for (int k = 0; k < 2; ++k) {
            loxo_geodesic *g = NULL;
            settings.max_distance = k == 0 ? HUGE_VAL : limit;
            CHECK_OK(loxo_geodesic_create(test_context, mesh, &settings, &g));
            if (i < 2)
                CHECK(loxo_geodesic_solve(g, &source, 1, distance[k], &info[k]) >= 0);
            else
                CHECK(loxo_geodesic_solve_points(g, &point, 1, distance[k], &info[k]) >= 0);
            loxo_geodesic_destroy(g);
        }
        for (int64_t v = 0; v < n; ++v) {
            n_inside += distance[0][v] <= limit;
            CHECK_EQUAL(distance[1][v], distance[0][v] <= limit ? distance[0][v] : HUGE_VAL);
        }
        CHECK(n_inside > 50 && n_inside < n / 4);
        CHECK(info[1].n_levels < info[0].n_levels / 2);
        free(distance[0]);
        free(distance[1]);
        loxo_mesh_destroy(mesh);
        loxo_mesh_destroy(surface);
    }
}

TEST(points_need_the_way_back)
{
    loxo_soup soup = shape_torus(test_context, 20, 9);
    const loxo_surface_point point = {{soup.triangle[0], soup.triangle[1], soup.triangle[2]}, {0.2, 0.5, 0.3}};
    loxo_mesh *surface = mesh_of(test_context, &soup), *mesh = NULL;
    loxo_intrinsic_settings settings = loxo_intrinsic_settings_default();
    loxo_geodesic *g = NULL;
    double distance[180];
    settings.traceable = false;
    CHECK_OK(loxo_mesh_create_intrinsic(test_context, surface, &settings, NULL, &mesh));
    CHECK_OK(loxo_geodesic_create(test_context, mesh, NULL, &g));
    CHECK_STATUS(test_context, loxo_geodesic_solve_points(g, &point, 1, distance, NULL), LOXO_ERR_ARGUMENT);
    loxo_geodesic_destroy(g);
    loxo_mesh_destroy(mesh);
    loxo_mesh_destroy(surface);
}

static double worst_in_plane(const double *distance, const loxo_mesh *mesh, loxo_index source, double *mean)
{
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    double worst = 0.0, sum = 0.0;
    const loxo_vec3 at = k_position(&m, source);
    for (int64_t v = 0; v < m.n_vertices; ++v) {
        const double truth = v3_norm(v3_sub(k_position(&m, (loxo_index)v), at));
        if (!(truth > 0.0)) continue;
        const int64_t to = m.vertex_origin != NULL ? m.vertex_origin[v] : v;
        const double error = fabs(distance[to] - truth) / truth;
        worst = fmax(worst, error);
        sum += error;
    }
    *mean = sum / (double)(m.n_vertices - 1);
    return worst;
}

/* A disk of triangles ten times as long as high. */
TEST(a_stretched_disk_gets_its_distances_back)
{
    for (int i = 0; i < 2; ++i) {
        loxo_soup soup = generate(test_context, LOXO_SHAPE_DISK, 5000, (double)NAN, 10.0);
        loxo_mesh *surface = mesh_of(test_context, &soup), *mesh = intrinsic_of(test_context, surface);
        const int64_t n = loxo_mesh_n_vertices(surface);
        const loxo_geodesic_settings settings = settings_of(methods[i], false);
        const loxo_index source = 0;
        double *distance = calloc((size_t)n, sizeof *distance), mean[2];
        loxo_geodesic_info info;
        CHECK(loxo_geodesic_distance(test_context, surface, &settings, &source, 1, distance, &info) >= 0);
        (void)worst_in_plane(distance, surface, source, &mean[0]);
        CHECK(loxo_geodesic_distance(test_context, mesh, &settings, &source, 1, distance, &info) >= 0);
        (void)worst_in_plane(distance, mesh, source, &mean[1]);
        CHECK_EQUAL(info.n_nonpositive_heat, 0);
        CHECK(mean[1] < 0.035); /* measured 0.029 and 0.026; 0.86 and 0.95 as it was given */
        CHECK(mean[1] < 0.05 * mean[0]);
        free(distance);
        loxo_mesh_destroy(mesh);
        loxo_mesh_destroy(surface);
    }
}

static loxo_mesh *read_mesh(const char *name)
{
    const char *path = test_shared(name);
    loxo_soup soup = {0};
    if (path == NULL) SKIP();
    CHECK_OK(loxo_read_mesh(test_context, path, NULL, &soup));
    loxo_mesh *mesh = mesh_of(test_context, &soup);
    return mesh;
}

/* On the first two the solve does not converge, or fails its check, with the triangles as they are. */
TEST(scans_of_slivers_have_positive_heat)
{
    static const char *const names[4] = {"meshes/surfaces/moai48k-slivers.ply", "meshes/surfaces/camel10k.off.gz",
                                         "meshes/surfaces/bunny35k-slivers.off.gz", "meshes/surfaces/igea134k.ply"};
    const loxo_geodesic_settings settings = settings_of(LOXO_GEODESIC_EDGE, false);
    const loxo_index source = 0;
    NEEDS_IDS(1000000);
    for (int i = 0; i < 4; ++i) {
        loxo_mesh *surface = read_mesh(names[i]), *mesh = intrinsic_of(test_context, surface);
        double *distance = calloc((size_t)loxo_mesh_n_vertices(surface), sizeof *distance);
        loxo_geodesic_info info;
        loxo_context_clear(test_context);
        CHECK_OK(loxo_geodesic_distance(test_context, mesh, &settings, &source, 1, distance, &info));
        CHECK_EQUAL(info.n_nonpositive_heat, 0);
        CHECK(info.diffusion_converged && info.check_passed);
        free(distance);
        loxo_mesh_destroy(mesh);
        loxo_mesh_destroy(surface);
    }
}

/* Mean relative error (29) against exact polyhedral distances: edge-based 0.112 % given, 0.105 % intrinsic on igea; face-
 * based 0.668 and 0.675 %; kitten is Delaunay as it is: 0.160 % and 0.473 %. */
TEST(errors_against_exact_distances_do_not_grow)
{
    static const char *const names[2][2] = {{"meshes/surfaces/igea134k.ply", "meshes/exact/igea_from0.npy"},
                                            {"meshes/surfaces/kitten10k.ply", "meshes/exact/kitten_from0.npy"}};
    static const double most[2][2] = {{0.0011, 0.0068}, {0.0017, 0.0048}};
    const loxo_index source = 0;
    NEEDS_IDS(1000000);
    for (int i = 0; i < 2; ++i) {
        const char *path = test_shared(names[i][1]);
        loxo_mesh *surface = read_mesh(names[i][0]), *mesh = intrinsic_of(test_context, surface);
        const int64_t n = loxo_mesh_n_vertices(surface);
        double *exact = NULL, *distance = calloc((size_t)n, sizeof *distance);
        int64_t n_exact;
        if (path == NULL) SKIP();
        CHECK_OK(loxo_read_field(test_context, path, &exact, &n_exact));
        CHECK_EQUAL(n_exact, n);
        for (int k = 0; k < 2; ++k) {
            const loxo_geodesic_settings settings = settings_of(methods[k], false);
            loxo_distance_error error;
            CHECK_OK(loxo_geodesic_distance(test_context, mesh, &settings, &source, 1, distance, NULL));
            CHECK_OK(loxo_measure_distance_error(test_context, distance, exact, n, &error));
            CHECK(error.mean_relative < most[i][k]);
        }
        loxo_release(test_context, exact);
        free(distance);
        loxo_mesh_destroy(mesh);
        loxo_mesh_destroy(surface);
    }
}

/* A triangle rolled up: two of its sides are one edge, the third is the rim and joins a vertex to itself. The look at all faces and
 * that by vertices see the same: one edge that is breached by 4, one that is not. */
TEST(the_check_sees_faces_that_repeat_a_vertex)
{
    static const loxo_index vertices[2] = {0, 1}, vertex[2][3] = {{1, 0, 0}, {0, 1, 0}},
                            twin[2][3] = {{2, -1, 0}, {1, 0, -1}};
    static const loxo_index first[2][2] = {{1, 0}, {2, 1}};
    static const double length[2][3] = {{1.0, 0.5, 1.0}, {1.0, 1.0, 0.5}}, distance[2] = {0.0, 5.0};
    for (int turn = 0; turn < 2; ++turn) {
        geodesic_problem problem = {.ctx = test_context,
                                    .m = {.n_vertices = 2,
                                          .n_faces = 1,
                                          .halfedge_vertex = vertex[turn],
                                          .halfedge_twin = twin[turn],
                                          .vertex_halfedge = first[turn],
                                          .halfedge_length = length[turn]},
                                    .settings = loxo_geodesic_settings_default(),
                                    .mean_edge_length = 1.0};
        loxo_geodesic_info all = {0}, listed = {0};
        CHECK_OK(geodesic_check(&problem, distance, NULL, 0, &all));
        CHECK_OK(geodesic_check(&problem, distance, vertices, 2, &listed));
        CHECK_EQUAL(all.breach_max, 4.0);
        CHECK_EQUAL(listed.breach_max, 4.0);
        CHECK_EQUAL(all.gradient_share, 1.0);
        CHECK_EQUAL(listed.gradient_share, 1.0);
    }
}
