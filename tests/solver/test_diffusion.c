/* SPDX-License-Identifier: MIT
 * Heat diffusion against a dense direct solve of (A + t C) u = delta, on meshes of good and of bad triangles, and where
 * the heat is far below the smallest double. */
#include "dense.h"
#include "kernel/diffusion_kernel.h"
#include "surfaces.h"

#include <loxo/geodesic.h>
#include <loxo/measure.h>

typedef struct heat {
    double *value;
    int32_t *scale;
} heat;

static heat heat_allocate(const surface *s)
{
    return (heat){surface_numbers(s), loxo_allocate(s->ctx, s->soup.n_vertices, sizeof(int32_t))};
}

static void heat_release(heat *u)
{
    loxo_release(test_context, u->value);
    loxo_release(test_context, u->scale);
}

/* Returns the number of positive entries off the diagonal: edges of negative weight, from both ends. */
static int64_t direct_heat(const surface *s, double time_factor, const loxo_index *sources, int64_t n_sources, heat *u)
{
    const int64_t n = s->soup.n_vertices;
    const long double h = dense_mean_edge(s->mesh), time = (long double)time_factor * h * h;
    long double *matrix = loxo_allocate(test_context, n * n, sizeof *matrix);
    long double *x = loxo_allocate(test_context, n, sizeof *x);
    int64_t n_negative = 0;
    memset(x, 0, (size_t)n * sizeof *x);
    for (int64_t i = 0; i < n_sources; ++i)
        x[sources[i]] = 1.0L;
    dense_matrix(&s->arrays, 1.0L, time, matrix);
    for (int64_t i = 0; i < n * n; ++i)
        n_negative += i % (n + 1) != 0 && matrix[i] > 1e-15L * h * h ? 1 : 0;
    dense_solve(n, matrix, x);
    for (int64_t v = 0; v < n; ++v) {
        int exponent;
        u->value[v] = (double)frexpl(x[v], &exponent);
        u->scale[v] = exponent;
    }
    loxo_release(test_context, matrix);
    loxo_release(test_context, x);
    return n_negative;
}

static loxo_geodesic_info solve_heat(const surface *s, const loxo_geodesic_settings *settings,
                                     const loxo_index *sources, int64_t n_sources, heat *u)
{
    double *distance = surface_numbers(s);
    loxo_geodesic_info info;
    loxo_geodesic *g;
    CHECK_OK(loxo_geodesic_create(test_context, s->mesh, settings, &g));
    CHECK_OK(loxo_geodesic_solve(g, sources, n_sources, distance, &info));
    CHECK_OK(loxo_geodesic_heat(g, u->value, u->scale));
    loxo_geodesic_destroy(g);
    loxo_release(test_context, distance);
    return info;
}

/* Eq. (8) between two heats. */
static double error_between(const surface *s, const heat *u, const heat *reference)
{
    double error = -1.0;
    CHECK_OK(loxo_measure_direction_error(test_context, &s->arrays, u->value, u->scale, reference->value,
                                          reference->scale, &error));
    return error;
}

/* Marching to each tolerance meets it. */
static void check_marching(const char *name, const surface *s, double time_factor, const loxo_index *sources,
                           int64_t n_sources, bool has_negative)
{
    static const double tolerances[] = {1e-2, 1e-3, 1e-5};
    heat truth = heat_allocate(s), u = heat_allocate(s);
    const int64_t n_negative = direct_heat(s, time_factor, sources, n_sources, &truth);
    if (has_negative) CHECK(n_negative > 0);
    for (int i = 0; i < (time_factor > 10.0 ? 2 : 3); ++i) {
        loxo_geodesic_settings settings = admm_settings(LOXO_GEODESIC_EDGE);
        settings.time_factor = time_factor;
        settings.diffusion_tolerance = tolerances[i];
        const loxo_geodesic_info info = solve_heat(s, &settings, sources, n_sources, &u);
        const double error = error_between(s, &u, &truth);
        print_message("%s, m %g, %lld negative: tolerance %.0e, error %.1e, %.1f updates a vertex\n", name, time_factor,
                      (long long)n_negative, tolerances[i], error,
                      (double)info.n_evaluations / (double)s->soup.n_vertices);
        CHECK(info.diffusion_converged);
        if (time_factor <= 10.0)
            CHECK(info.diffusion_change <= tolerances[i]); /* later, settling makes good what is left */
        CHECK(error < tolerances[i]);
    }
    heat_release(&truth);
    heat_release(&u);
}

static void check_shape(loxo_shape shape, int64_t n_vertices, double param, bool has_negative)
{
    surface s = surface_make(test_context, shape, n_vertices, param);
    check_marching(loxo_shape_name(shape), &s, 1.0, (const loxo_index[]){7}, 1, has_negative);
    surface_destroy(&s);
}

TEST(marching_on_an_icosphere) { check_shape(LOXO_SHAPE_ICOSPHERE, 642, NAN, false); }

TEST(marching_on_a_disk) { check_shape(LOXO_SHAPE_DISK, 500, NAN, false); }

TEST(marching_on_a_cylinder) { check_shape(LOXO_SHAPE_CYLINDER, 500, NAN, false); }

TEST(marching_on_a_torus) { check_shape(LOXO_SHAPE_TORUS, 500, NAN, false); }

TEST(marching_on_a_bumpy_sphere) { check_shape(LOXO_SHAPE_BUMPY, 642, NAN, false); }

TEST(marching_with_obtuse_triangles) { check_shape(LOXO_SHAPE_NOISY, 642, 0.3, true); }

TEST(marching_with_very_obtuse_triangles) { check_shape(LOXO_SHAPE_NOISY, 642, 0.6, true); }

TEST(marching_from_several_sources)
{
    surface s = surface_make(test_context, LOXO_SHAPE_NOISY, 642, 0.3);
    check_marching("noisy", &s, 1.0, (const loxo_index[]){7, 300, 301, 600}, 4, true);
    surface_destroy(&s);
}

TEST(marching_for_short_and_long_times)
{
    static const double factors[] = {0.1, 10.0, 50.0};
    surface ball = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 642, NAN);
    surface noisy = surface_make(test_context, LOXO_SHAPE_NOISY, 362, 0.3);
    for (int i = 0; i < 3; ++i) {
        check_marching("icosphere", &ball, factors[i], (const loxo_index[]){7}, 1, false);
        check_marching("noisy", &noisy, factors[i], (const loxo_index[]){7}, 1, true);
    }
    surface_destroy(&ball);
    surface_destroy(&noisy);
}

/* The longer the time, the slower it settles: what is left undone is told, and the heat is given all the same. */
TEST(not_converged_is_told)
{
    surface s = surface_make(test_context, LOXO_SHAPE_NOISY, 362, 0.3);
    loxo_geodesic_settings settings = admm_settings(LOXO_GEODESIC_EDGE);
    heat truth = heat_allocate(&s), u = heat_allocate(&s);
    double *distance = surface_numbers(&s);
    loxo_geodesic_info info;
    loxo_geodesic *g;
    direct_heat(&s, 1e4, (const loxo_index[]){7}, 1, &truth);
    settings.time_factor = 1e4;
    settings.diffusion_tolerance = 1e-12;
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_STATUS(test_context, loxo_geodesic_solve(g, (const loxo_index[]){7}, 1, distance, &info), LOXO_NOT_CONVERGED);
    CHECK_OK(loxo_geodesic_heat(g, u.value, u.scale));
    CHECK(!info.diffusion_converged);
    CHECK(error_between(&s, &u, &truth) < 1e-5);
    loxo_geodesic_destroy(g);
    heat_release(&truth);
    heat_release(&u);
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

TEST(many_sweeps_reach_the_direct_solve)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 642, NAN);
    loxo_geodesic_settings settings = admm_settings(LOXO_GEODESIC_EDGE);
    heat truth = heat_allocate(&s), swept = heat_allocate(&s), marched = heat_allocate(&s);
    double before = 2.0;
    CHECK_EQUAL(direct_heat(&s, 1.0, (const loxo_index[]){7}, 1, &truth), 0);
    settings.diffusion = LOXO_DIFFUSION_SWEEPS;
    for (int64_t n_sweeps = 1; n_sweeps <= 243; n_sweeps *= 3) {
        settings.n_sweeps = n_sweeps;
        const loxo_geodesic_info info = solve_heat(&s, &settings, (const loxo_index[]){7}, 1, &swept);
        const double error = error_between(&s, &swept, &truth);
        print_message("%lld sweeps: %.1e\n", (long long)n_sweeps, error);
        CHECK_EQUAL(info.n_evaluations, n_sweeps * s.soup.n_vertices);
        CHECK(error < before || error < 1e-5);
        before = error;
    }
    CHECK(before < 1e-5);
    settings.diffusion = LOXO_DIFFUSION_MARCHING;
    settings.diffusion_tolerance = 1e-5;
    solve_heat(&s, &settings, (const loxo_index[]){7}, 1, &marched);
    CHECK(error_between(&s, &swept, &marched) < 2e-5);
    heat_release(&truth);
    heat_release(&swept);
    heat_release(&marched);
    surface_destroy(&s);
}

/* Around the ring heat comes by ways of very different decay, and the first sweep sees each alone: what it then keeps
 * apart by hundreds of octaves the others bring together. */
TEST(sweeps_bring_together_what_came_by_different_ways)
{
    NEEDS_IDS(6 * 20000);
    surface s = surface_make(test_context, LOXO_SHAPE_TORUS, 20000, NAN);
    loxo_geodesic_settings settings = admm_settings(LOXO_GEODESIC_EDGE);
    heat swept = heat_allocate(&s), marched = heat_allocate(&s);
    settings.diffusion_tolerance = 1e-5;
    solve_heat(&s, &settings, (const loxo_index[]){0}, 1, &marched);
    settings.diffusion = LOXO_DIFFUSION_SWEEPS;
    settings.n_sweeps = 1000;
    solve_heat(&s, &settings, (const loxo_index[]){0}, 1, &swept);
    const double error = error_between(&s, &swept, &marched);
    print_message("torus, 1000 sweeps against marching: %.1e\n", error);
    CHECK(error < 1e-4);
    heat_release(&swept);
    heat_release(&marched);
    surface_destroy(&s);
}

/* The heat falls by some 2^-25,000 along it; a double ends at 2^-1074. */
TEST(no_underflow_on_a_strip_of_20000_edges)
{
    const int64_t n = 40002;
    NEEDS_IDS(3 * n);
    surface s = surface_make(test_context, LOXO_SHAPE_STRIP, n, NAN);
    double *distance = surface_numbers(&s), *truth = surface_numbers(&s);
    heat u = heat_allocate(&s);
    CHECK_EQUAL(s.soup.n_vertices, n);
    surface_exact(&s, LOXO_SHAPE_STRIP, 0, truth);
    for (int method = 0; method < 2; ++method) {
        loxo_geodesic_settings settings = loxo_geodesic_settings_default();
        loxo_geodesic_info info;
        loxo_geodesic *g;
        double farthest = 0.0, worst = 0.0;
        settings.method = (loxo_geodesic_method)method;
        CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
        CHECK_OK(loxo_geodesic_solve(g, (const loxo_index[]){0}, 1, distance, &info));
        CHECK_OK(loxo_geodesic_heat(g, u.value, u.scale));
        for (int64_t v = 1; v < n; ++v) {
            CHECK(isfinite(distance[v]) && distance[v] > 0.0);
            CHECK(u.value[v] > 0.0 && u.value[v] < 1e6); /* its power of two is kept in scale */
            if (truth[v] > 100.0) worst = fmax(worst, fabs(distance[v] / truth[v] - 1.0));
            farthest = fmax(farthest, truth[v]);
        }
        print_message("strip, %s: worst beyond 100 edges %.1e, scale at the end %d\n", method_names[method], worst,
                      u.scale[n - 1]);
        CHECK(farthest > 19999.0);
        CHECK(worst < 0.01);
        CHECK(u.scale[n - 1] < -10000);
        CHECK_EQUAL(info.n_nonpositive_heat, 0);
        CHECK_EQUAL(info.n_unreached, 0);
        loxo_geodesic_destroy(g);
    }
    /* From rung to rung it falls by the same factor: at one side of the strip the logarithm of the heat is a line. */
    for (int64_t v = 0; v < n; ++v)
        truth[v] = log2(u.value[v]) + (double)u.scale[v];
    for (int64_t a = 0; a < n; a += 997) {
        for (int64_t b = 1; b < n; b += 991) {
            const double *p = s.soup.position + 3 * a, *q = s.soup.position + 3 * b;
            if (q[0] > p[0] + 2.0) CHECK(truth[b] < truth[a]);
        }
    }
    heat_release(&u);
    loxo_release(test_context, distance);
    loxo_release(test_context, truth);
    surface_destroy(&s);
}

static void check_rows(loxo_shape shape, int64_t n_vertices)
{
    loxo_mesh_report report;
    surface s = surface_from_soup(test_context, soup_make(test_context, shape, n_vertices, NAN), LOXO_ORDER_GIVEN);
    const int64_t n = s.soup.n_vertices;
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    long double *c = loxo_allocate(test_context, n * n, sizeof *c), *a = loxo_allocate(test_context, n * n, sizeof *a);
    double *row = surface_numbers(&s), *weights = loxo_allocate(test_context, n * n, sizeof *weights), area = 0.0;
    k_entry entry[64];
    dense_matrix(&s.arrays, 0.0L, 1.0L, c);
    dense_matrix(&s.arrays, 1.0L, 0.0L, a);
    memset(weights, 0, (size_t)(n * n) * sizeof *weights);
    for (int64_t v = 0; v < n; ++v) {
        const uint32_t degree = k_degree(&m, (loxo_index)v);
        const double own = k_cotangent_row(&m, (loxo_index)v, entry);
        double sum = 0.0;
        CHECK_NEAR(own, (double)a[v * n + v], 1e-14 * own);
        area += own;
        for (uint32_t k = 0; k < degree; ++k) {
            weights[v * n + entry[k].slot] = (double)entry[k].coefficient;
            sum += (double)entry[k].coefficient;
        }
        CHECK_NEAR(sum, (double)c[v * n + v], 1e-6 * (1.0 + fabs(sum))); /* so that the row sums to 0 */
    }
    CHECK_OK(loxo_mesh_check(test_context, &s.arrays, &report));
    CHECK_NEAR(area, report.area, 1e-12 * report.area);
    for (int64_t i = 0; i < n; ++i) {
        long double sum = 0.0L;
        for (int64_t k = 0; k < n; ++k) {
            sum += c[i * n + k];
            if (k == i) continue;
            CHECK_NEAR(weights[i * n + k], -(double)c[i * n + k], 2e-7 * (1.0 + fabs((double)c[i * n + k])));
            CHECK_NEAR(weights[i * n + k], weights[k * n + i], 2e-7 * (1.0 + fabs(weights[k * n + i])));
        }
        CHECK_NEAR((double)sum, 0.0, 1e-16);
    }
    loxo_release(test_context, c);
    loxo_release(test_context, a);
    loxo_release(test_context, row);
    loxo_release(test_context, weights);
    surface_destroy(&s);
}

TEST(rows_of_the_cotangent_matrix)
{
    check_rows(LOXO_SHAPE_BUMPY, 252);
    check_rows(LOXO_SHAPE_NOISY, 252);
    check_rows(LOXO_SHAPE_DISK, 200);
    check_rows(LOXO_SHAPE_ANNULUS, 200);
}

TEST(there_is_no_heat_before_the_first_solve)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 42, NAN);
    heat u = heat_allocate(&s);
    loxo_geodesic *g;
    const loxo_geodesic_settings settings = admm_settings(LOXO_GEODESIC_EDGE);
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_STATUS(test_context, loxo_geodesic_heat(g, u.value, u.scale), LOXO_ERR_ARGUMENT);
    loxo_geodesic_destroy(g);
    heat_release(&u);
    surface_destroy(&s);
}
