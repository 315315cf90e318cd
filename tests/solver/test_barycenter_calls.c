/* SPDX-License-Identifier: MIT
 * The public call of the barycenter: every bad input has its status, every answer its certificates; what moves the atoms moves it. */
#include "base/rng.h"
#include "stopper.h"
#include "test.h"

#include <loxo/barycenter.h>

#define PI 3.14159265358979323846

/* Random directions [n][d], drawn towards the first axis. */
static void set_atoms(int64_t n, int d, uint64_t seed, double pull, double *x)
{
    for (int64_t i = 0; i < n; ++i) {
        long double square = 0.0L;
        for (int k = 0; k < d; ++k) {
            const uint64_t at = (uint64_t)(2 * (i * d + k));
            const double r = sqrt(-2.0 * log(1.0 - loxo_random_unit(seed, at)));
            x[i * d + k] = r * cos(2.0 * PI * loxo_random_unit(seed, at + 1)) + (k == 0 ? pull : 0.0);
            square += (long double)x[i * d + k] * (long double)x[i * d + k];
        }
        for (int k = 0; k < d; ++k)
            x[i * d + k] = (double)((long double)x[i * d + k] / sqrtl(square));
    }
}

static double distance(const loxo_barycenter_info *a, const double *b, double co_b, int d)
{
    double square = 0.0;
    for (int k = 0; k < d; ++k)
        square += (a->w[k] - b[k]) * (a->w[k] - b[k]);
    return 2.0 * asinh(sqrt(square / (a->co * co_b)));
}

/* The barycenter of moved atoms is the moved barycenter, to the bounds of both. */
TEST(equivariance)
{
    enum { N = 200 };
    static double x[N * 8], y[N * 8];
    for (int d = 2; d <= 8; ++d)
        for (int e = 0; e <= 6; e += 3) {
            loxo_barycenter_info before, after;
            loxo_moebius map;
            double a[8] = {0}, image[8], co = 0.0;
            const double gap = e == 0 ? 0.4 : pow(10.0, -e);
            a[0] = -0.6 * (1.0 - gap);
            a[1] = 0.8 * (1.0 - gap);
            set_atoms(N, d, (uint64_t)d, 0.3, x);
            CHECK_OK(loxo_moebius_set_identity(test_context, d, &map));
            CHECK_OK(loxo_moebius_append_shift(test_context, &map, a, gap * (2.0 - gap)));
            CHECK_OK(loxo_moebius_map_sphere(test_context, &map, N, x, y));
            CHECK_OK(loxo_barycenter(test_context, &(loxo_atoms){.n = N, .d = d, .x = x}, NULL, &before));
            CHECK_OK(loxo_barycenter(test_context, &(loxo_atoms){.n = N, .d = d, .x = y}, NULL, &after));
            CHECK_OK(loxo_moebius_map_ball(test_context, &map, 1, before.w, &before.co, image, &co));
            CHECK(distance(&after, image, co, d) <= before.bound + after.bound);
            CHECK(after.residual <= 1e-14);
            /* its map centres the atoms */
            CHECK_OK(loxo_moebius_map_sphere(test_context, &after.map, N, y, y));
            for (int k = 0; k < d; ++k) {
                long double mean = 0.0L;
                for (int64_t i = 0; i < N; ++i)
                    mean += (long double)y[i * d + k] / N;
                CHECK_NEAR((double)mean, 0.0, 1e-14);
            }
        }
}

/* F is minus the gradient of Psi and A its Hessian (25), (26): by differences of Psi along geodesics through the centre. */
TEST(psi_by_differences)
{
    enum { N = 50, D = 3 };
    double x[N * D], mean[D] = {0}, second[D][D] = {{0}};
    set_atoms(N, D, 77, 0.5, x);
    for (int i = 0; i < N; ++i)
        for (int k = 0; k < D; ++k) {
            mean[k] += x[i * D + k] / N;
            for (int j = 0; j < D; ++j)
                second[k][j] += x[i * D + k] * x[i * D + j] / N;
        }
    for (uint64_t seed = 0; seed < 5; ++seed) {
        double e[D], psi[3] = {0}, slope = 0.0, curve = 1.0;
        const double t = 1e-3;
        set_atoms(1, D, 1000 + seed, 0.0, e);
        for (int s = 0; s < 3; ++s) {
            const double r = tanh(0.5 * t * (s - 1)); /* distance t (s - 1) */
            for (int i = 0; i < N; ++i) {
                double square = 0.0;
                for (int k = 0; k < D; ++k)
                    square += (x[i * D + k] - r * e[k]) * (x[i * D + k] - r * e[k]);
                psi[s] += log(square / (1.0 - r * r)) / N;
            }
        }
        for (int k = 0; k < D; ++k) {
            slope -= mean[k] * e[k]; /* dPsi(e) = -g(F, e) with e of unit g-length */
            for (int j = 0; j < D; ++j)
                curve -= second[k][j] * e[k] * e[j];
        }
        CHECK_NEAR((psi[2] - psi[0]) / (2.0 * t), slope, 2e-6);                     /* t^2 / 6 times f''' <= 2 */
        CHECK_NEAR((psi[2] - 2.0 * psi[1] + psi[0]) / (t * t), curve, 1e-6 + 1e-9); /* t^2 / 12 f'''' and 4 eps / t^2 */
    }
}

/* w of 1, i, -1 is 2 - sqrt(3) up the axis: all that is told of it. */
TEST(what_is_told_of_a_triangle)
{
    const double x[6] = {1.0, 0.0, 0.0, 1.0, -1.0, 0.0}, r = 2.0 - sqrt(3.0);
    loxo_barycenter_info info;
    CHECK_OK(loxo_barycenter(test_context, &(loxo_atoms){.n = 3, .d = 2, .x = x}, NULL, &info));
    CHECK_EQUAL(info.kind, LOXO_BARYCENTER_STABLE);
    CHECK_NEAR(info.w[1], r, 2e-16);
    CHECK_NEAR(info.direction[0], 0.0, 1e-15);
    CHECK_NEAR(info.direction[1], 1.0, 1e-15);
    CHECK_NEAR(info.gap, 1.0 - r, 1e-15);
    CHECK_NEAR(info.radius, 2.0 * atanh(r), 1e-15);
    CHECK_NEAR(info.lambda_min, 0.5, 1e-14); /* three directions at 120 degrees */
    CHECK(info.q <= 1e-14 && info.bound <= 1e-14 && info.frame_bound <= info.bound);
    CHECK_NEAR(info.wasserstein, 2.0 * info.frame_bound, 0.0);
    CHECK_NEAR(info.kantorovich_bound, 2.0 * info.residual / info.lambda_min, 1e-28);
    CHECK_EQUAL(info.stop_reason, LOXO_BARYCENTER_STOP_ROUNDING);
    CHECK_EQUAL(info.map.n_shifts, 1);
    loxo_barycenter_settings settings = loxo_barycenter_settings_default();
    settings.tolerance = 1e-6;
    CHECK_OK(loxo_barycenter(test_context, &(loxo_atoms){.n = 3, .d = 2, .x = x}, &settings, &info));
    CHECK_EQUAL(info.stop_reason, LOXO_BARYCENTER_STOP_BOUND);
    settings.max_iterations = 0;
    CHECK_STATUS(test_context, loxo_barycenter(test_context, &(loxo_atoms){.n = 3, .d = 2, .x = x}, &settings, &info),
                 LOXO_NOT_CONVERGED);
    CHECK_EQUAL(info.stop_reason, LOXO_BARYCENTER_STOP_ITERATIONS);
    CHECK(info.w[0] == 0.0 && info.w[1] == 0.0 && info.direction[0] == 0.0 && info.co == 1.0 && info.gap == 1.0);
}

static bool is_finite(const loxo_barycenter_info *info, int d)
{
    bool good = isfinite(info->gap) && isfinite(info->co) && isfinite(info->residual) && isfinite(info->lambda_min) &&
                !isnan(info->radius) && !isnan(info->q) && !isnan(info->bound) && !isnan(info->frame_bound) &&
                !isnan(info->wasserstein) && !isnan(info->kantorovich_bound);
    for (int k = 0; k < d; ++k)
        good = good && isfinite(info->w[k]) && isfinite(info->direction[k]);
    return good;
}

/* A status and a class each, never NaN, never a loop. */
TEST(measures_of_every_kind)
{
    static const double east[] = {1, 0, 0}, north[] = {0, 0, 1}, west[] = {-1, 0, 0}, front[] = {0, 1, 0};
    static const double near_east[] = {1, 1e-17, 0}, nearer[] = {1, 1e-9, 0};
    static const double *const e = east, *const n = north, *const w = west, *const f = front;
    static const struct {
        const char *what;
        int n;
        const double *atom[6];
        double weight[6];
        loxo_status status;
        loxo_barycenter_class kind;
    } cases[] = {
        {"one atom", 1, {e}, {1}, LOXO_CHECK_FAILED, LOXO_BARYCENTER_NONE},
        {"one atom twice", 2, {e, e}, {1, 1}, LOXO_CHECK_FAILED, LOXO_BARYCENTER_NONE},
        {"opposite atoms", 2, {e, w}, {1, 1}, LOXO_CHECK_FAILED, LOXO_BARYCENTER_NOT_UNIQUE},
        {"two atoms", 2, {e, n}, {1, 1}, LOXO_CHECK_FAILED, LOXO_BARYCENTER_NOT_UNIQUE},
        {"two atoms, one heavier", 2, {e, n}, {1, 1.5}, LOXO_CHECK_FAILED, LOXO_BARYCENTER_NONE},
        {"half in one", 3, {e, n, w}, {2, 1, 1}, LOXO_CHECK_FAILED, LOXO_BARYCENTER_NONE},
        {"half in each of two, in parts", 4, {e, n, e, n}, {1, 3, 2, 0}, LOXO_CHECK_FAILED, LOXO_BARYCENTER_NOT_UNIQUE},
        {"zero weights do not count", 4, {e, n, w, f}, {1, 1, 1, 0}, LOXO_OK, LOXO_BARYCENTER_STABLE},
        {"nearly half", 3, {e, n, w}, {2, 1, 1.0000001}, LOXO_OK, LOXO_BARYCENTER_STABLE},
        {"tiny weights", 3, {e, n, w}, {1e-280, 1e-280, 1e-280}, LOXO_OK, LOXO_BARYCENTER_STABLE},
        {"huge weights", 3, {e, n, w}, {1e280, 1e280, 1e280}, LOXO_OK, LOXO_BARYCENTER_STABLE},
        {"too near for doubles", 4, {e, near_east, n, w}, {1, 1, 1, 1e-9}, LOXO_NOT_CONVERGED, LOXO_BARYCENTER_STABLE},
        {"near", 4, {e, nearer, n, n}, {1, 1, 1, 0.9}, LOXO_OK, LOXO_BARYCENTER_STABLE},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i)
        for (int method = 0; method < LOXO_BARYCENTER_N_METHODS; ++method) {
            double x[18];
            loxo_barycenter_info info;
            loxo_barycenter_settings settings = loxo_barycenter_settings_default();
            settings.method = (loxo_barycenter_method)method;
            for (int k = 0; k < cases[i].n; ++k)
                memcpy(x + 3 * (ptrdiff_t)k, cases[i].atom[k], 3 * sizeof *x);
            const loxo_status status =
                loxo_barycenter(test_context, &(loxo_atoms){.n = cases[i].n, .d = 3, .x = x, .weight = cases[i].weight},
                                &settings, &info);
            const bool is_hard = cases[i].kind == LOXO_BARYCENTER_STABLE && method != LOXO_BARYCENTER_DAMPED;
            if (!is_hard && (status != cases[i].status || info.kind != cases[i].kind))
                print_error("%s: %s, %s, stopped by %s\n", cases[i].what, loxo_status_name(status),
                            loxo_barycenter_class_name(info.kind), loxo_barycenter_stop_name(info.stop_reason));
            CHECK(is_hard ? status >= 0 : status == cases[i].status && info.kind == cases[i].kind);
            CHECK(is_finite(&info, 3));
            CHECK(info.n_iterations <= 100);
            if (info.kind == LOXO_BARYCENTER_NONE) CHECK(info.co == 0.0 && info.gap == 0.0 && info.map.n_shifts == 0);
        }
}

TEST(bad_calls)
{
    double x[15] = {1, 0, 0, 0, 1, 0, 0, 0, 1, -1, 0, 0, 0, -1, 0}, weight[5] = {1, 1, 1, 1, 1};
    const float one[3] = {1.0F, 0.0F, 0.0F};
    loxo_barycenter_info info;
    loxo_barycenter_settings settings = loxo_barycenter_settings_default();
    const loxo_atoms good = {.n = 5, .d = 3, .x = x, .weight = weight};
    loxo_atoms bad = good;
#define REFUSED(call) CHECK_STATUS(test_context, call, LOXO_ERR_ARGUMENT)
    REFUSED(loxo_barycenter(test_context, NULL, NULL, &info));
    REFUSED(loxo_barycenter(test_context, &good, NULL, NULL));
    bad.n = 0;
    REFUSED(loxo_barycenter(test_context, &bad, NULL, &info));
    bad.n = -3;
    REFUSED(loxo_barycenter(test_context, &bad, NULL, &info));
    bad = good;
    bad.d = 1;
    REFUSED(loxo_barycenter(test_context, &bad, NULL, &info));
    bad.d = 65;
    REFUSED(loxo_barycenter(test_context, &bad, NULL, &info));
    bad = good;
    bad.x = NULL;
    REFUSED(loxo_barycenter(test_context, &bad, NULL, &info));
    bad = good;
    bad.x_float = one;
    REFUSED(loxo_barycenter(test_context, &bad, NULL, &info));
    bad = good;
    bad.n = INT64_MAX / 2;
    CHECK_STATUS(test_context, loxo_barycenter(test_context, &bad, NULL, &info), LOXO_ERR_LIMIT);
    static const double off[] = {1.00001, (double)NAN, HUGE_VAL, -2.0};
    for (size_t i = 0; i < sizeof off / sizeof *off; ++i) {
        x[10] = off[i];
        REFUSED(loxo_barycenter(test_context, &good, NULL, &info));
        CHECK_EQUAL(loxo_context_failure(test_context)->element, 3);
        x[10] = 0.0;
        if (i == 0) continue;
        weight[2] = off[i];
        REFUSED(loxo_barycenter(test_context, &good, NULL, &info));
        CHECK_EQUAL(loxo_context_failure(test_context)->element, 2);
        weight[2] = 1.0;
    }
    static const double none[] = {0.0, 1e-300, 1e295};
    for (size_t i = 0; i < sizeof none / sizeof *none; ++i) {
        for (int k = 0; k < 5; ++k)
            weight[k] = none[i];
        REFUSED(loxo_barycenter(test_context, &good, NULL, &info));
    }
    for (int k = 0; k < 5; ++k)
        weight[k] = 1.0;
    settings.tolerance = -1.0;
    REFUSED(loxo_barycenter(test_context, &good, &settings, &info));
    settings.tolerance = (double)NAN;
    REFUSED(loxo_barycenter(test_context, &good, &settings, &info));
    settings = loxo_barycenter_settings_default();
    settings.max_iterations = -1;
    REFUSED(loxo_barycenter(test_context, &good, &settings, &info));
    settings = loxo_barycenter_settings_default();
    settings.method = LOXO_BARYCENTER_N_METHODS;
    REFUSED(loxo_barycenter(test_context, &good, &settings, &info));
    CHECK_OK(loxo_barycenter(test_context, &good, NULL, &info));
}

TEST(names)
{
    static const char *const names[] = {"damped", "regularized", "newton", "abikoff-ye", "unknown"};
    for (int i = 0; i <= LOXO_BARYCENTER_N_METHODS; ++i)
        CHECK(strcmp(loxo_barycenter_method_name((loxo_barycenter_method)i), names[i]) == 0);
}

/* The order of the atoms changes rounding only. */
TEST(the_order_does_not_matter)
{
    enum { N = 3000 };
    static double x[3 * N], y[3 * N];
    loxo_barycenter_info a, b;
    set_atoms(N, 3, 8, 0.8, x);
    for (int64_t i = 0; i < N; ++i)
        memcpy(y + 3 * i, x + 3 * ((i * 1009) % N), 3 * sizeof *x);
    CHECK_OK(loxo_barycenter(test_context, &(loxo_atoms){.n = N, .d = 3, .x = x}, NULL, &a));
    CHECK_OK(loxo_barycenter(test_context, &(loxo_atoms){.n = N, .d = 3, .x = y}, NULL, &b));
    CHECK(distance(&a, b.w, b.co, 3) <= a.bound + b.bound);
}

static uint64_t hash_of_answer(loxo_context *ctx, const void *arg)
{
    loxo_barycenter_info info;
    CHECK_OK(loxo_barycenter(ctx, arg, NULL, &info));
    return test_hash(info.w, 3 * sizeof *info.w) ^ test_hash(&info.bound, sizeof info.bound);
}

TEST(the_same_for_any_threads)
{
    enum { N = 60000 };
    double *x = loxo_allocate(test_context, (int64_t)3 * N, sizeof *x);
    set_atoms(N, 3, 9, 1.0, x);
    test_same_for_any_threads(hash_of_answer, &(loxo_atoms){.n = N, .d = 3, .x = x});
    loxo_release(test_context, x);
}

static loxo_status solve(loxo_context *ctx, void *arg)
{
    loxo_barycenter_info info;
    return loxo_barycenter(ctx, arg, NULL, &info);
}

TEST(each_allocation_fails)
{
    double x[300];
    set_atoms(100, 3, 9, 5.0, x); /* far off the centre, so that atoms are carried */
    CHECK(test_each_allocation_fails(solve, &(loxo_atoms){.n = 100, .d = 3, .x = x}) >= 3);
}

TEST(the_monitor_stops_it)
{
    double x[300];
    loxo_barycenter_info info;
    stopper stop;
    set_atoms(100, 3, 9, 1.0, x);
    stopper_begin(&stop, test_context, 1);
    CHECK_STATUS(test_context, loxo_barycenter(test_context, &(loxo_atoms){.n = 100, .d = 3, .x = x}, NULL, &info),
                 LOXO_STOPPED);
    stopper_end(&stop);
    CHECK_EQUAL(info.stop_reason, LOXO_BARYCENTER_STOP_MONITOR);
    CHECK(is_finite(&info, 3));
}
