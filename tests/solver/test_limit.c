/* SPDX-License-Identifier: MIT
 * Solves within a largest distance: inside the ball the bits of the whole solve, outside infinity, and work that grows
 * with the ball. */
#include "base/options.h"
#include "surfaces.h"

#include <loxo/geodesic.h>

/* The first sources of n, spread over the vertices, or points of faces. */
static loxo_status solve_some(loxo_geodesic *g, const surface *s, int64_t n, bool as_points, double *distance,
                              loxo_geodesic_info *info)
{
    loxo_surface_point points[40];
    loxo_index sources[40];
    for (int64_t i = 0; i < n; ++i) {
        const int64_t f = (31 + 997 * i) % s->soup.n_faces;
        sources[i] = s->soup.triangle[3 * f];
        points[i] = (loxo_surface_point){
            {s->soup.triangle[3 * f], s->soup.triangle[3 * f + 1], s->soup.triangle[3 * f + 2]}, {0.5, 0.25, 0.25}};
        if (i % 3 == 1) points[i].weight[0] = 0.0, points[i].weight[1] = 0.75;
    }
    return as_points ? loxo_geodesic_solve_points(g, points, n, distance, info)
                     : loxo_geodesic_solve(g, sources, n, distance, info);
}

/* shares: of the farthest distance. */
static void check_limits(loxo_shape shape, int64_t n_vertices, int method, int64_t n_sources, bool as_points)
{
    static const double shares[] = {0.03, 0.1, 0.2, 0.5, 0.95};
    NEEDS_IDS(6 * n_vertices);
    surface s = surface_make(test_context, shape, n_vertices, NAN);
    double *whole = surface_numbers(&s), *part = surface_numbers(&s);
    loxo_geodesic_settings settings = unjudged_settings((loxo_geodesic_method)method);
    loxo_geodesic *g = NULL;
    loxo_geodesic_info info, of_part;
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_OK(solve_some(g, &s, n_sources, as_points, whole, &info));
    for (int i = 0; i < 5; ++i) {
        const double limit = shares[i] * info.distance_max;
        int64_t n_inside = 0;
        CHECK_OK(loxo_geodesic_limit(g, limit));
        CHECK_OK(solve_some(g, &s, n_sources, as_points, part, &of_part));
        for (int64_t v = 0; v < s.soup.n_vertices; ++v) {
            CHECK(memcmp(&part[v], whole[v] <= limit ? &whole[v] : &(const double){HUGE_VAL}, sizeof *part) == 0);
            n_inside += whole[v] <= limit;
        }
        CHECK_EQUAL(of_part.n_unreached, s.soup.n_vertices - n_inside);
        CHECK(of_part.distance_max <= limit);
        CHECK_EQUAL(of_part.workspace_bytes, info.workspace_bytes);
        print_message("%s within %.2f: %lld vertices, %.1f %% of the updates\n", method_names[method], shares[i],
                      (long long)n_inside, 100.0 * (double)of_part.n_evaluations / (double)info.n_evaluations);
    }
    CHECK_OK(loxo_geodesic_limit(g, HUGE_VAL)); /* what is left of a limited solve does no harm */
    CHECK_OK(solve_some(g, &s, n_sources, as_points, part, NULL));
    CHECK(memcmp(whole, part, (size_t)s.soup.n_vertices * sizeof *part) == 0);
    loxo_geodesic_destroy(g);
    loxo_release(test_context, whole);
    loxo_release(test_context, part);
    surface_destroy(&s);
}

TEST(limits_on_a_sphere_edge) { check_limits(LOXO_SHAPE_ICOSPHERE, 20000, LOXO_GEODESIC_EDGE, 1, false); }

TEST(limits_on_a_sphere_face) { check_limits(LOXO_SHAPE_ICOSPHERE, 20000, LOXO_GEODESIC_FACE, 1, false); }

TEST(limits_on_bumps) { check_limits(LOXO_SHAPE_BUMPY, 20000, LOXO_GEODESIC_EDGE, 1, false); }

TEST(limits_on_an_annulus) { check_limits(LOXO_SHAPE_ANNULUS, 20000, LOXO_GEODESIC_FACE, 1, true); }

TEST(limits_from_points) { check_limits(LOXO_SHAPE_TORUS, 20000, LOXO_GEODESIC_EDGE, 3, true); }

TEST(limits_from_many) { check_limits(LOXO_SHAPE_GRID, 20000, LOXO_GEODESIC_EDGE, 40, false); }

TEST(limits_on_a_long_strip) { check_limits(LOXO_SHAPE_STRIP, 8000, LOXO_GEODESIC_EDGE, 1, false); }

/* What is solved is the ball, its margin, and little else. */
TEST(work_grows_with_the_ball)
{
    NEEDS_IDS(6 * 100000);
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 100000, NAN);
    double *distance = surface_numbers(&s);
    loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    loxo_geodesic *g = NULL;
    loxo_geodesic_info whole, part;
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_OK(loxo_geodesic_solve(g, (const loxo_index[]){1000}, 1, distance, &whole));
    CHECK_OK(loxo_geodesic_limit(g, 0.1));
    CHECK_OK(loxo_geodesic_solve(g, (const loxo_index[]){1000}, 1, distance, &part));
    print_message("levels %lld of %lld\n", (long long)part.n_levels, (long long)whole.n_levels);
    CHECK(part.n_levels < whole.n_levels / 4);
    CHECK(part.n_evaluations < whole.n_evaluations / 20);
    loxo_geodesic_destroy(g);
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

static uint64_t hash_on(loxo_context *ctx, const void *arg)
{
    const loxo_soup *soup = arg;
    loxo_soup copy = *soup;
    surface s = {.ctx = ctx, .soup = copy, .arrays = loxo_soup_arrays(&copy)};
    loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_FACE);
    loxo_geodesic *g = NULL;
    loxo_index *nearest = loxo_allocate(ctx, soup->n_vertices, sizeof *nearest);
    double *distance = surface_numbers(&s);
    settings.max_distance = 0.4;
    settings.nearest = true;
    CHECK_STATUS(ctx, loxo_mesh_create(ctx, &s.arrays, LOXO_BORROW, NULL, NULL, &s.mesh), LOXO_OK);
    CHECK_STATUS(ctx, loxo_geodesic_create(ctx, s.mesh, &settings, &g), LOXO_OK);
    CHECK_STATUS(ctx, solve_some(g, &s, 5, true, distance, NULL), LOXO_OK);
    CHECK_STATUS(ctx, loxo_geodesic_nearest(g, nearest), LOXO_OK);
    const uint64_t hash = test_hash(distance, (size_t)soup->n_vertices * sizeof *distance) ^
                          test_hash(nearest, (size_t)soup->n_vertices * sizeof *nearest);
    loxo_release(ctx, distance);
    loxo_release(ctx, nearest);
    loxo_geodesic_destroy(g);
    loxo_mesh_destroy(s.mesh);
    return hash;
}

TEST(same_bits_for_any_number_of_threads)
{
    NEEDS_IDS(6 * 20000);
    loxo_soup soup = soup_make(test_context, LOXO_SHAPE_NOISY, 20000, NAN);
    test_same_for_any_threads(hash_on, &soup);
    loxo_soup_destroy(test_context, &soup);
}

static loxo_status solve_limited(loxo_context *ctx, void *arg)
{
    const surface *s = arg;
    loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    loxo_mesh *mesh = NULL;
    loxo_geodesic *g = NULL;
    double *distance = loxo_allocate(ctx, s->soup.n_vertices, sizeof *distance);
    settings.max_distance = 2.0;
    settings.n_iterations = 2;
    loxo_status status = distance == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
    if (status >= 0) status = loxo_mesh_create(ctx, &s->arrays, LOXO_BORROW, NULL, NULL, &mesh);
    if (status >= 0) status = loxo_geodesic_create(ctx, mesh, &settings, &g);
    if (status >= 0) status = solve_some(g, s, 1, true, distance, NULL);
    loxo_geodesic_destroy(g);
    loxo_mesh_destroy(mesh);
    loxo_release(ctx, distance);
    return status;
}

TEST(each_allocation_of_a_limited_solve_fails)
{
    surface s = surface_make(test_context, LOXO_SHAPE_STRIP, 1000, NAN);
    CHECK(test_each_allocation_fails(solve_limited, &s) > 5);
    surface_destroy(&s);
}

TEST(limits_that_are_none)
{
    surface s = surface_make(test_context, LOXO_SHAPE_DISK, 100, NAN);
    loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    loxo_geodesic *g = NULL;
    CHECK_OK(loxo_options_set(test_context, "geodesic", loxo_geodesic_options, &settings, "max-distance", "0.5"));
    CHECK_EQUAL(settings.max_distance, 0.5);
    CHECK_OK(loxo_options_set(test_context, "geodesic", loxo_geodesic_options, &settings, "max-distance", "inf"));
    CHECK_EQUAL(settings.max_distance, HUGE_VAL);
    CHECK_STATUS(test_context,
                 loxo_options_set(test_context, "geodesic", loxo_geodesic_options, &settings, "time-factor", "inf"),
                 LOXO_ERR_ARGUMENT);
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_STATUS(test_context, loxo_geodesic_limit(g, 0.0), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_geodesic_limit(g, -1.0), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_geodesic_limit(g, NAN), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(NULL, loxo_geodesic_limit(NULL, 1.0), LOXO_ERR_ARGUMENT);
    loxo_geodesic_destroy(g);
    surface_destroy(&s);
}
