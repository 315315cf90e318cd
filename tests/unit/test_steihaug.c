/* SPDX-License-Identifier: MIT
 * Conjugate gradients in a trust region: the minimum where there is one inside, the border where there is none. */
#include "../test.h"
#include "optim/steihaug.h"

enum { N = 5 };

/* H diagonal, M as well. */
typedef struct diagonal_model {
    double h[N], m[N];
} diagonal_model;

static loxo_status times(void *state, const double *v, double *hv)
{
    for (int i = 0; i < N; ++i)
        hv[i] = ((const diagonal_model *)state)->h[i] * v[i];
    return LOXO_OK;
}

static void precondition(void *state, const double *r, double *z)
{
    for (int i = 0; i < N; ++i)
        z[i] = ((const diagonal_model *)state)->m[i] * r[i];
}

static const double gradient[N] = {1.0, -2.0, 0.5, 3.0, -0.25};

static loxo_steihaug_info solve(diagonal_model *m, const loxo_steihaug_settings *settings, double *d)
{
    const loxo_quadratic q = {
        .ctx = test_context, .n = N, .state = m, .hessian_times = times, .precondition = precondition};
    double work[LOXO_STEIHAUG_WORK * N];
    loxo_steihaug_info info;
    CHECK_OK(loxo_steihaug(&q, gradient, settings, work, d, &info));
    double fall = 0.0, norm = 0.0;
    for (int i = 0; i < N; ++i) {
        fall -= gradient[i] * d[i] + 0.5 * m->h[i] * d[i] * d[i];
        norm += d[i] * d[i] / m->m[i];
    }
    CHECK_NEAR(info.fall, fall, 1e-13 * (1.0 + fabs(fall)));
    if (isfinite(settings->radius)) {
        CHECK_NEAR(info.norm, sqrt(norm), 1e-13 * (1.0 + info.norm));
        CHECK(info.norm <= settings->radius * (1.0 + 1e-14));
    }
    return info;
}

/* N directions at most: H^-1 of the gradient, but for rounding. */
TEST(the_minimum_inside)
{
    diagonal_model m = {.h = {1, 2, 3, 4, 5}, .m = {1, 0.5, 1, 0.125, 0.25}};
    const loxo_steihaug_settings settings = {.radius = HUGE_VAL, .tolerance = 1e-13, .max_iterations = 50};
    double d[N];
    const loxo_steihaug_info info = solve(&m, &settings, d);
    CHECK(info.stop_reason == LOXO_STEIHAUG_TOLERANCE && info.n_iterations <= N);
    for (int i = 0; i < N; ++i)
        CHECK_NEAR(d[i], -gradient[i] / m.h[i], 1e-12);
}

/* Any radius below the minimum's norm is filled, and a larger one never falls less. */
TEST(the_border)
{
    diagonal_model m = {.h = {1, 2, 3, 4, 5}, .m = {1, 1, 1, 1, 1}};
    double before = 0.0, d[N];
    for (int k = 1; k <= 10; ++k) {
        const loxo_steihaug_settings settings = {.radius = 0.15 * k, .tolerance = 1e-12, .max_iterations = 50};
        const loxo_steihaug_info info = solve(&m, &settings, d);
        const bool is_inside = settings.radius > 1.63; /* |H^-1 g| = 1.615 */
        CHECK(info.stop_reason == (is_inside ? LOXO_STEIHAUG_TOLERANCE : LOXO_STEIHAUG_RADIUS));
        if (!is_inside) CHECK_NEAR(info.norm, settings.radius, 1e-13);
        CHECK(info.fall >= before);
        before = info.fall;
    }
}

/* Along negative curvature to the border; without one the step ends where it was found. */
TEST(negative_curvature)
{
    diagonal_model m = {.h = {1, 2, -3, 4, 5}, .m = {1, 1, 1, 1, 1}};
    loxo_steihaug_settings settings = {.radius = 2.0, .tolerance = 1e-12, .max_iterations = 50};
    double d[N];
    loxo_steihaug_info info = solve(&m, &settings, d);
    CHECK(info.stop_reason == LOXO_STEIHAUG_CURVATURE || info.stop_reason == LOXO_STEIHAUG_RADIUS);
    CHECK_NEAR(info.norm, 2.0, 1e-13);
    settings.radius = HUGE_VAL;
    info = solve(&m, &settings, d);
    CHECK(info.stop_reason == LOXO_STEIHAUG_CURVATURE && info.n_iterations > 1 && info.fall > 0.0);
    m = (diagonal_model){.h = {-1, -1, -1, -1, -1}, .m = {1, 1, 1, 1, 1}};
    info = solve(&m, &settings, d);
    CHECK(info.stop_reason == LOXO_STEIHAUG_CURVATURE && info.n_iterations == 1 && info.fall == 0.0);
    for (int i = 0; i < N; ++i)
        CHECK_EQUAL(d[i], 0.0);
}

/* The floor, the unit and the limit each end it; of no iterations the norm of the gradient is told. */
TEST(what_ends_it)
{
    diagonal_model m = {.h = {1, 2, 3, 4, 5}, .m = {1, 1, 1, 1, 1}};
    loxo_steihaug_settings settings = {.radius = HUGE_VAL, .tolerance = 0.5, .floor = 4.0, .max_iterations = 50};
    double d[N], norm = 0.0;
    for (int i = 0; i < N; ++i)
        norm += gradient[i] * gradient[i];
    CHECK(norm < 16.0);
    loxo_steihaug_info info = solve(&m, &settings, d);
    CHECK(info.n_iterations == 0 && info.stop_reason == LOXO_STEIHAUG_TOLERANCE);
    CHECK_NEAR(info.gradient_norm, sqrt(norm), 1e-14);
    settings.floor = 0.0;
    const int64_t loose = solve(&m, &settings, d).n_iterations;
    settings.unit = 1e12 * sqrt(norm);
    CHECK(solve(&m, &settings, d).n_iterations > loose);
    settings.max_iterations = 0;
    info = solve(&m, &settings, d);
    CHECK(info.n_iterations == 0 && info.stop_reason == LOXO_STEIHAUG_MAX_ITERATIONS);
    CHECK_NEAR(info.gradient_norm, sqrt(norm), 1e-14);
}
