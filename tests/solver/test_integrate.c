/* SPDX-License-Identifier: MIT
 * Integration of an exact field is exact: heat that falls at the same rate everywhere has directions that already are
 * the gradient of a function, so nothing is left for ADMM to change and the distances are that function. */
#include "surfaces.h"

#include <loxo/geodesic.h>

/* Heat 4 - direction . x, spread over several powers of two. */
static void linear_heat(const surface *s, const double direction[3], double *value, int32_t *scale)
{
    for (int64_t v = 0; v < s->soup.n_vertices; ++v) {
        const double *x = s->soup.position + 3 * v;
        scale[v] = (int32_t)(v % 5) - 2000;
        value[v] = ldexp(4.0 - (direction[0] * x[0] + direction[1] * x[1] + direction[2] * x[2]), -(int)(v % 5));
    }
}

/* From sources that lie on one level of the heat, every distance is direction . (x - source). */
static void check_linear(const surface *s, const double direction[3], const loxo_index *sources, int64_t n_sources)
{
    double *value = surface_numbers(s), *distance = surface_numbers(s);
    int32_t *scale = loxo_allocate(test_context, s->soup.n_vertices, sizeof *scale);
    linear_heat(s, direction, value, scale);
    for (int method = 0; method < 2; ++method) {
        const loxo_geodesic_settings settings = admm_settings((loxo_geodesic_method)method);
        const double *from = s->soup.position + 3 * (int64_t)sources[0];
        loxo_geodesic_info info;
        loxo_geodesic *g;
        CHECK_OK(loxo_geodesic_create(test_context, s->mesh, &settings, &g));
        CHECK_OK(loxo_geodesic_solve_from_heat(g, sources, n_sources, value, scale, distance, &info));
        for (int64_t v = 0; v < s->soup.n_vertices; ++v) {
            const double *x = s->soup.position + 3 * v;
            double truth = 0.0;
            for (int k = 0; k < 3; ++k)
                truth += direction[k] * (x[k] - from[k]);
            CHECK_NEAR(distance[v], truth, 1e-12); /* differences of heat keep 4 / 0.03 roundings */
        }
        CHECK(info.residual < 1e-12);
        CHECK_EQUAL(info.stop_reason, LOXO_STOP_TOLERANCE);
        CHECK(info.gradient_share < 1e-12); /* its gradient has length 1 everywhere */
        CHECK_EQUAL(info.n_sources, n_sources);
        loxo_geodesic_destroy(g);
    }
    loxo_release(test_context, value);
    loxo_release(test_context, distance);
    loxo_release(test_context, scale);
}

TEST(constant_field_on_a_grid)
{
    surface s = surface_make(test_context, LOXO_SHAPE_GRID, 1000, NAN);
    check_linear(&s, (const double[]){1.0, 0.0, 0.0}, (const loxo_index[]){0}, 1);
    check_linear(&s, (const double[]){0.6, 0.8, 0.0}, (const loxo_index[]){500}, 1); /* negative behind the source */
    surface_destroy(&s);
}

TEST(constant_field_on_a_disk)
{
    surface s = surface_make(test_context, LOXO_SHAPE_DISK, 1000, NAN);
    check_linear(&s, (const double[]){0.8, -0.6, 0.0}, (const loxo_index[]){17}, 1);
    surface_destroy(&s);
}

TEST(height_on_a_cylinder_from_its_whole_rim)
{
    surface s = surface_make(test_context, LOXO_SHAPE_CYLINDER, 1200, NAN);
    loxo_index *rim = loxo_allocate(test_context, s.soup.n_vertices, sizeof *rim);
    int64_t n_rim = 0;
    double lowest = HUGE_VAL;
    for (int64_t v = 0; v < s.soup.n_vertices; ++v)
        lowest = fmin(lowest, s.soup.position[3 * v + 2]);
    for (int64_t v = 0; v < s.soup.n_vertices; ++v)
        if (s.soup.position[3 * v + 2] == lowest) rim[n_rim++] = (loxo_index)v;
    CHECK(n_rim > 10);
    check_linear(&s, (const double[]){0.0, 0.0, 1.0}, rim, 1);
    check_linear(&s, (const double[]){0.0, 0.0, 1.0}, rim, n_rim);
    loxo_release(test_context, rim);
    surface_destroy(&s);
}

TEST(without_a_direction_nothing_is_added)
{
    surface s = surface_make(test_context, LOXO_SHAPE_GRID, 100, NAN);
    double *value = surface_numbers(&s), *distance = surface_numbers(&s);
    for (int64_t v = 0; v < s.soup.n_vertices; ++v)
        value[v] = 1.0;
    for (int method = 0; method < 2; ++method) {
        const loxo_geodesic_settings settings = admm_settings((loxo_geodesic_method)method);
        loxo_geodesic *g;
        CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
        CHECK_OK(loxo_geodesic_solve_from_heat(g, (const loxo_index[]){3}, 1, value, NULL, distance, NULL));
        for (int64_t v = 0; v < s.soup.n_vertices; ++v)
            CHECK_EQUAL(distance[v], 0.0);
        loxo_geodesic_destroy(g);
    }
    loxo_release(test_context, value);
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

/* Hills in the given heat, many rings wide and hotter than all around: their inside hears of a way only from the foot. And heats so
 * far apart that who is hotter goes in circles: keys are of 32 bits. Distances are found all the same. */
TEST(unfolding_finds_ways_into_hills_and_circles)
{
    NEEDS_IDS(10000);
    surface s = surface_make(test_context, LOXO_SHAPE_GRID, 2500, NAN);
    const int64_t n = s.soup.n_vertices;
    double *value = surface_numbers(&s), *distance = surface_numbers(&s);
    int32_t *scale = loxo_allocate(test_context, n, sizeof *scale);
    const loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    const double *x = s.soup.position, *end = x + 3 * (n - 1), size = hypot(end[0] - x[0], end[1] - x[1]);
    loxo_geodesic *g;
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    for (int kind = 0; kind < 2; ++kind) {
        for (int64_t v = 0; v < n; ++v) {
            const double *p = x + 3 * v, from = hypot(p[0] - x[0], p[1] - x[1]) / size;
            const double hill = hypot(p[0] - 0.5 * (x[0] + end[0]), p[1] - 0.5 * (x[1] + end[1])) / size;
            value[v] = 1.0;
            scale[v] = kind == 0 ? -(int32_t)(1000.0 * from) + (hill < 0.2 ? (int32_t)(1e4 * (0.2 - hill)) : 0)
                                 : (int32_t)(v % 3 - 1) * 350000;
        }
        CHECK_OK(loxo_geodesic_solve_from_heat(g, (const loxo_index[]){0}, 1, value, scale, distance, NULL));
        for (int64_t v = 0; v < n; ++v) {
            const double *p = x + 3 * v, truth = hypot(p[0] - x[0], p[1] - x[1]);
            CHECK_NEAR(distance[v], truth, 2e-3 * truth);
        }
    }
    loxo_geodesic_destroy(g);
    loxo_release(test_context, value);
    loxo_release(test_context, distance);
    loxo_release(test_context, scale);
    surface_destroy(&s);
}

TEST(heat_that_is_not_finite_is_refused)
{
    surface s = surface_make(test_context, LOXO_SHAPE_GRID, 100, NAN);
    double *value = surface_numbers(&s), *distance = surface_numbers(&s);
    loxo_geodesic *g;
    for (int64_t v = 0; v < s.soup.n_vertices; ++v)
        value[v] = v == 42 ? HUGE_VAL : 1.0 + (double)v, distance[v] = -7.0;
    const loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_STATUS(test_context,
                 loxo_geodesic_solve_from_heat(g, (const loxo_index[]){3}, 1, value, NULL, distance, NULL),
                 LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 42);
    CHECK_EQUAL(distance[0], -7.0);
    CHECK_STATUS(test_context, loxo_geodesic_solve_from_heat(g, (const loxo_index[]){3}, 1, NULL, NULL, distance, NULL),
                 LOXO_ERR_ARGUMENT);
    loxo_geodesic_destroy(g);
    loxo_release(test_context, value);
    loxo_release(test_context, distance);
    surface_destroy(&s);
}
