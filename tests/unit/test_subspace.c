/* SPDX-License-Identifier: MIT
 * The trust region of two dimensions: its model problem against a search, and functions that it makes small. */
#include "base/rng.h"
#include "optim/subspace.h"
#include "test.h"

static double model(const double h[3], const double g[2], const double y[2])
{
    return 0.5 * (h[0] * y[0] * y[0] + 2.0 * h[1] * y[0] * y[1] + h[2] * y[1] * y[1]) + g[0] * y[0] + g[1] * y[1];
}

/* Against 2000 points of the circle, and the inner minimum where there is one. */
static void check_disk(const double h[3], const double g[2], double radius)
{
    const double size = fabs(h[0]) + fabs(h[1]) + fabs(h[2]), det = h[0] * h[2] - h[1] * h[1];
    const double scale = size * radius * radius + (fabs(g[0]) + fabs(g[1])) * radius;
    double y[2], least = 0.0;
    const double fall = loxo_disk_minimize(h, g, radius, y);
    CHECK(hypot(y[0], y[1]) <= radius * (1.0 + 1e-12));
    CHECK_NEAR(-fall, model(h, g, y), 1e-13 * scale);
    for (int i = 0; i < 2000; ++i) {
        const double z[2] = {radius * cos(6.283185307179586 * i / 2000), radius * sin(6.283185307179586 * i / 2000)};
        least = fmin(least, model(h, g, z));
    }
    if (h[0] > 0.0 && det > 0.0) {
        const double z[2] = {-(h[2] * g[0] - h[1] * g[1]) / det, -(h[0] * g[1] - h[1] * g[0]) / det};
        if (hypot(z[0], z[1]) <= radius) least = fmin(least, model(h, g, z));
    }
    CHECK(-fall <= least + 1e-12 * scale);
}

TEST(the_model_is_made_as_small_as_a_search_makes_it)
{
    for (uint64_t seed = 0; seed < 400; ++seed) {
        double r[6];
        for (uint64_t k = 0; k < 6; ++k)
            r[k] = 2.0 * loxo_random_unit(seed, k) - 1.0;
        const double h[3] = {r[0], r[1], r[2]}, g[2] = {r[3], r[4]};
        check_disk(h, g, pow(10.0, 3.0 * r[5]));
    }
}

/* The gradient has no part, or hardly any, along the lowest eigenvector. */
TEST(the_hard_case)
{
    static const double lean[] = {0.0, 1e-300, 1e-20, 1e-16, 1e-13, 1e-8};
    for (int k = 0; k < 6; ++k) {
        const double h[3] = {-1.0, 0.0, 2.0}, g[2] = {lean[k], 1.0};
        double y[2];
        check_disk(h, g, 5.0);
        (void)loxo_disk_minimize(h, g, 5.0, y);
        CHECK_NEAR(hypot(y[0], y[1]), 5.0, 1e-12); /* negative curvature: the border */
        check_disk(h, g, 0.1);
    }
    const double flat[3] = {0.0, 0.0, 0.0}, down[3] = {-1.0, 0.0, -1.0}, none[2] = {0.0, 0.0}, g[2] = {3.0, 4.0};
    check_disk(flat, g, 2.0);
    check_disk(down, g, 2.0);
    check_disk(down, none, 2.0);
}

/* ---- functions of two variables, with their Hessians ---- */

typedef struct function {
    void (*of)(const double *x, double *value, double *g, double *h);
    double h[3];
    bool has_no_newton;
} function;

static loxo_status value_of(void *state, const double *x, double *value, double *rounding)
{
    function *f = state;
    double g[2], h[3];
    f->of(x, value, g, h);
    *rounding = 1e-16 * (1.0 + fabs(*value));
    return LOXO_OK;
}

static loxo_status derivatives_of(void *state, const double *x, double *g)
{
    function *f = state;
    double value;
    f->of(x, &value, g, f->h);
    return LOXO_OK;
}

static loxo_status multiply(void *state, const double *v, double *hv)
{
    const function *f = state;
    const double x = v[0], y = v[1];
    hv[0] = f->h[0] * x + f->h[1] * y;
    hv[1] = f->h[1] * x + f->h[2] * y;
    return LOXO_OK;
}

static loxo_status newton_of(void *state, const double *g, double *step)
{
    const function *f = state;
    const double det = f->h[0] * f->h[2] - f->h[1] * f->h[1];
    if (f->has_no_newton || det == 0.0) return LOXO_NOT_CONVERGED;
    step[0] = -(f->h[2] * g[0] - f->h[1] * g[1]) / det;
    step[1] = -(f->h[0] * g[1] - f->h[1] * g[0]) / det;
    return LOXO_OK;
}

static loxo_status move_of(void *state, const double *from, const double *to, double *move)
{
    (void)state;
    *move = hypot(to[0] - from[0], to[1] - from[1]);
    return LOXO_OK;
}

static void rosenbrock(const double *x, double *value, double *g, double *h)
{
    const double a = x[1] - x[0] * x[0], b = 1.0 - x[0];
    *value = 100.0 * a * a + b * b;
    g[0] = -400.0 * a * x[0] - 2.0 * b;
    g[1] = 200.0 * a;
    h[0] = 1200.0 * x[0] * x[0] - 400.0 * x[1] + 2.0;
    h[1] = -400.0 * x[0];
    h[2] = 200.0;
}

/* x^2 - y^2 + y^4: a saddle at 0, minima at y = +-sqrt(1/2). */
static void saddle(const double *x, double *value, double *g, double *h)
{
    const double y = x[1];
    *value = x[0] * x[0] - y * y + y * y * y * y;
    g[0] = 2.0 * x[0];
    g[1] = -2.0 * y + 4.0 * y * y * y;
    h[0] = 2.0;
    h[1] = 0.0;
    h[2] = -2.0 + 12.0 * y * y;
}

static void endless(const double *x, double *value, double *g, double *h)
{
    *value = x[0];
    g[0] = 1.0;
    g[1] = h[0] = h[1] = h[2] = 0.0;
}

static void nowhere(const double *x, double *value, double *g, double *h)
{
    *value = (double)NAN;
    g[0] = g[1] = x[0];
    h[0] = h[1] = h[2] = 0.0;
}

static loxo_status minimize(function *f, int64_t max_iterations, double tolerance, double *x, loxo_subspace_info *info)
{
    const loxo_subspace_problem p = {test_context, 2, f, value_of, derivatives_of, multiply, newton_of, move_of};
    const loxo_subspace_settings settings = {"test", tolerance, max_iterations, 0.5};
    return loxo_subspace_minimize(&p, &settings, x, info);
}

TEST(a_bent_valley_is_followed)
{
    function f = {.of = rosenbrock};
    double x[2] = {-1.2, 1.0};
    loxo_subspace_info info;
    CHECK_OK(minimize(&f, 100, 1e-9, x, &info));
    CHECK_EQUAL(info.stop_reason, LOXO_SUBSPACE_TOLERANCE);
    CHECK(info.n_iterations < 60 && info.n_taken <= info.n_iterations);
    CHECK_EQUAL(info.n_evaluations, info.n_iterations + 1);
    CHECK_NEAR(x[0], 1.0, 1e-12); /* quadratic: the last step of 1e-9 leaves its square, times the condition of 2500 */
    CHECK_NEAR(x[1], 1.0, 1e-12);
}

TEST(a_saddle_is_left)
{
    function f = {.of = saddle};
    double x[2] = {0.3, 1e-4};
    loxo_subspace_info info;
    CHECK_OK(minimize(&f, 100, 1e-10, x, &info));
    CHECK_NEAR(fabs(x[1]), sqrt(0.5), 1e-12);
    CHECK_NEAR(info.value, -0.25, 1e-15);
}

TEST(without_newton_steps_the_gradient_serves)
{
    function f = {.of = saddle, .has_no_newton = true};
    double x[2] = {0.3, 0.1};
    loxo_subspace_info info;
    CHECK_OK(minimize(&f, 1000, 0.0, x, &info));
    CHECK_EQUAL(info.stop_reason, LOXO_SUBSPACE_ROUNDING);
    CHECK_NEAR(x[0], 0.0, 1e-7); /* a value within 1e-16 */
    CHECK_NEAR(fabs(x[1]), sqrt(0.5), 1e-7);
}

TEST(what_has_no_bottom_ends_at_the_last_step)
{
    function f = {.of = endless};
    double x[2] = {0.0, 0.0};
    loxo_subspace_info info;
    CHECK_OK(minimize(&f, 7, 1e-9, x, &info));
    CHECK_EQUAL(info.stop_reason, LOXO_SUBSPACE_MAX_ITERATIONS);
    CHECK_EQUAL(info.n_iterations, 7);
    CHECK_NEAR(x[0], -63.5, 1e-12); /* the radius doubles: 0.5 + 1 + ... + 32 */
}

TEST(a_start_without_a_value_is_refused)
{
    function f = {.of = nowhere};
    double x[2] = {1.0, 1.0};
    loxo_subspace_info info;
    CHECK_STATUS(test_context, minimize(&f, 7, 1e-9, x, &info), LOXO_ERR_NUMERIC);
    CHECK_EQUAL(x[0], 1.0);
}
