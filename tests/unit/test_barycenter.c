/* SPDX-License-Identifier: MIT
 * Conformal barycenters: closed forms, equivariance under shifts, certificates against a reference in long doubles, the sphere's
 * neighbourhood, measures that have none. */
#include "base/allocate.h"
#include "base/rng.h"
#include "hyperbolic/hyperbolic.h"
#include "kernel/ball_kernel.h"
#include "kernel/variants.h"
#include "test.h"

#define MOST_ATOMS 4096
#define PI         3.14159265358979323846

typedef struct cloud {
    hyper_atoms atoms;
    double *x, *weight;
} cloud;

static cloud cloud_make(int64_t n, int d, bool has_weights)
{
    cloud c = {.atoms = {.n = n, .d = d, .is_unit = true}};
    c.x = loxo_allocate(test_context, n * d, sizeof *c.x);
    c.weight = has_weights ? loxo_allocate(test_context, n, sizeof *c.weight) : NULL;
    c.atoms.x = c.x;
    c.atoms.weight = c.weight;
    return c;
}

static void cloud_free(cloud *c)
{
    loxo_release(test_context, c->x);
    loxo_release(test_context, c->weight);
}

/* Independent normal numbers, by the sum of twelve uniform ones. */
static double normal(uint64_t seed, uint64_t i)
{
    double sum = -6.0;
    for (uint64_t k = 0; k < 12; ++k)
        sum += loxo_random_unit(seed, 12 * i + k);
    return sum;
}

/* Uniform on the sphere, drawn towards the first axis by `pull`; weights in 0.5 to 1.5. */
static cloud cloud_random(int64_t n, int d, uint64_t seed, double pull, bool has_weights)
{
    cloud c = cloud_make(n, d, has_weights);
    for (int64_t i = 0; i < n; ++i) {
        long double square = 0.0L;
        for (int k = 0; k < d; ++k) {
            c.x[i * d + k] = normal(seed, (uint64_t)(i * d + k)) + (k == 0 ? pull : 0.0);
            square += (long double)c.x[i * d + k] * (long double)c.x[i * d + k];
        }
        for (int k = 0; k < d; ++k)
            c.x[i * d + k] = (double)((long double)c.x[i * d + k] / sqrtl(square));
        if (has_weights) c.weight[i] = 0.5 + loxo_random_unit(seed + 1, (uint64_t)i);
    }
    return c;
}

/* sigma_(-a) of every atom, a = (1 - gap) e, in long doubles: the barycenter moves along. */
static void cloud_move(cloud *c, const double *e, long double gap)
{
    const int d = c->atoms.d;
    const long double r = 1.0L - gap, co = gap * (2.0L - gap);
    for (int64_t i = 0; i < c->atoms.n; ++i) {
        long double y[HYPER_MOST_DIMENSIONS], square = 0.0L, norm = 0.0L, f;
        for (int k = 0; k < d; ++k) {
            y[k] = (long double)c->x[i * d + k] + r * (long double)e[k];
            square += y[k] * y[k];
        }
        f = co / square;
        for (int k = 0; k < d; ++k) {
            y[k] = f * y[k] + r * (long double)e[k];
            norm += y[k] * y[k];
        }
        for (int k = 0; k < d; ++k)
            c->x[i * d + k] = (double)(y[k] / sqrtl(norm));
    }
}

static hyper_result solve(const cloud *c, hyper_method method, double tolerance, loxo_status expected)
{
    hyper_settings settings = hyper_settings_default();
    hyper_atoms atoms = c->atoms;
    hyper_moments first;
    hyper_result r;
    settings.method = method;
    settings.tolerance = tolerance;
    settings.max_iterations = 5000;
    CHECK_OK(hyper_check_atoms(test_context, "test", &atoms, &first));
    CHECK_STATUS(test_context, hyper_barycenter(test_context, &atoms, &first, &settings, &r), expected);
    return r;
}

/* Distance of points of the ball: sinh^2(t / 2) = |a - b|^2 / (co_a co_b). */
static double distance(int d, const double *a, double co_a, const double *b, double co_b)
{
    double square = 0.0;
    for (int k = 0; k < d; ++k)
        square += (a[k] - b[k]) * (a[k] - b[k]);
    return 2.0 * asinh(sqrt(square / (co_a * co_b)));
}

TEST(moments_are_those_of_the_shifted_atoms)
{
    for (int d = 2; d <= 6; ++d) {
        cloud c = cloud_random(1003, d, 3, 0.4, d % 2 == 0);
        double w[6] = {0.1, -0.5, 0.3, 0.2, -0.1, 0.3}, co = 1.0 - k_ball_dot(d, w, w);
        hyper_moments m;
        long double mean[6] = {0}, second[6][6] = {{0}}, weight = 0.0L;
        CHECK_OK(hyper_find_moments(test_context, &c.atoms, w, co, &m));
        for (int64_t i = 0; i < c.atoms.n; ++i) {
            double y[6];
            const long double p = c.weight == NULL ? 1.0L : (long double)c.weight[i];
            k_ball_shift(d, w, co, c.x + i * d, y);
            weight += p;
            for (int k = 0; k < d; ++k) {
                mean[k] += p * (long double)y[k];
                for (int j = 0; j < d; ++j)
                    second[k][j] += p * (long double)y[k] * (long double)y[j];
            }
        }
        CHECK_NEAR(m.weight, (double)weight, 1e-12 * (double)weight);
        const double *row = m.second;
        for (int k = 0; k < d; ++k) {
            CHECK_NEAR(m.mean[k], (double)(mean[k] / weight), 2e-15);
            for (int j = k; j < d; ++j)
                CHECK_NEAR(*row++, (double)(second[k][j] / weight), 4e-15);
        }
        cloud_free(&c);
    }
}

/* Unit vectors in doubles are taken as they are; others are put on the sphere, wherever the first of them stands. */
TEST(the_check_looks_from_the_centre)
{
    static const double centre[6] = {0.0};
    for (int d = 2; d <= 6; ++d)
        for (int off = 0; off < 3; ++off) {
            cloud c = cloud_random(9001, d, 3, 0.4, d % 2 == 0);
            hyper_moments first, m;
            for (int k = 0; k < d && off > 0; ++k)
                c.x[(off == 1 ? 20 : 8999) * d + k] *= 1.0 + 1e-7;
            CHECK_OK(hyper_check_atoms(test_context, "test", &c.atoms, &first));
            if (off > 0) CHECK(!c.atoms.is_unit);
            CHECK_OK(hyper_find_moments(test_context, &c.atoms, centre, 1.0, &m));
            CHECK_NEAR(first.weight, m.weight, 1e-15 * m.weight);
            for (int k = 0; k < d; ++k)
                CHECK_NEAR(first.mean[k], m.mean[k], 4e-16); /* |x|^2 is off 1 by 8e-16 at most */
            for (int k = 0; k < d * (d + 1) / 2; ++k)
                CHECK_NEAR(first.second[k], m.second[k], 1e-15);
            cloud_free(&c);
        }
}

TEST(same_bits_for_all_instruction_sets_and_threads)
{
    uint64_t hash[2] = {0, 0};
    for (int d = 2; d <= 3; ++d)
        for (int isa = LOXO_ISA_BASELINE; isa <= LOXO_ISA_AVX512; ++isa)
            for (int n_threads = 1; n_threads <= 7; n_threads += 2) {
                loxo_context_settings settings = loxo_context_settings_default();
                loxo_context *ctx;
                hyper_result r;
                const hyper_settings how = hyper_settings_default();
                settings.isa = (loxo_isa)isa;
                settings.n_threads = n_threads;
                if (loxo_context_create(&settings, &ctx) != LOXO_OK) continue; /* not of this processor */
                cloud c = cloud_random(100001, d, 17, 0.7, d == 2);
                hyper_moments first;
                CHECK_STATUS(ctx, hyper_check_atoms(ctx, "test", &c.atoms, &first), LOXO_OK);
                CHECK_STATUS(ctx, hyper_barycenter(ctx, &c.atoms, &first, &how, &r), LOXO_OK);
                const uint64_t own = test_hash(r.w, (size_t)d * sizeof *r.w) ^ test_hash(&r.bound, sizeof r.bound);
                if (hash[d - 2] == 0) hash[d - 2] = own;
                CHECK(own == hash[d - 2]);
                cloud_free(&c);
                loxo_context_destroy(ctx);
            }
}

/* Regular polygons have the centre; three points of the circle the centre of their ideal triangle, to which any is moved. */
TEST(closed_forms)
{
    for (int n = 3; n <= 11; n += 4) {
        cloud c = cloud_make(n, 2, false);
        for (int i = 0; i < n; ++i)
            c.x[2 * i] = cos(2.0 * PI * i / n), c.x[2 * i + 1] = sin(2.0 * PI * i / n);
        hyper_result r = solve(&c, HYPER_DAMPED, 0.0, LOXO_OK);
        CHECK_NEAR(r.w[0], 0.0, 2e-16);
        CHECK_NEAR(r.w[1], 0.0, 2e-16);
        cloud_move(&c, (const double[]){0.6, 0.8}, 0.3L);
        r = solve(&c, HYPER_DAMPED, 0.0, LOXO_OK);
        CHECK_NEAR(r.w[0], 0.42, 4e-16);
        CHECK_NEAR(r.w[1], 0.56, 4e-16);
        CHECK(r.n_iterations <= 8);
        cloud_free(&c);
    }
    /* 1, i, -1: the centre of the ideal triangle, mirrored onto itself, on the axis at r: its shift of 1 and i makes an angle of 120 degrees */
    cloud c = cloud_make(3, 2, false);
    const double x[6] = {1.0, 0.0, 0.0, 1.0, -1.0, 0.0};
    memcpy(c.x, x, sizeof x);
    const hyper_result r = solve(&c, HYPER_DAMPED, 0.0, LOXO_OK);
    CHECK_NEAR(r.w[0], 0.0, 2e-16);
    CHECK_NEAR(r.w[1], 2.0 - sqrt(3.0), 2e-16);
    cloud_free(&c);
}

/* All methods, all dimensions, with and without weights, tight or spread: the same point, each certified. */
TEST(methods_agree)
{
    for (int d = 2; d <= 8; ++d)
        for (int k = 0; k < 4; ++k) {
            cloud c = cloud_random(k % 2 == 0 ? 17 : 300, d, (uint64_t)(10 * d + k), k < 2 ? 0.2 : 1.5, k % 2 == 0);
            const hyper_result a = solve(&c, HYPER_DAMPED, 1e-10, LOXO_OK);
            CHECK(a.bound <= 1e-10 && a.n_iterations <= 8);
            for (int method = HYPER_REGULARIZED; method <= HYPER_ABIKOFF_YE; ++method) {
                if (method == HYPER_NEWTON && a.co < 0.5) continue; /* far from where it is known to converge */
                const hyper_result b = solve(&c, (hyper_method)method, 1e-10, LOXO_OK);
                CHECK(b.bound <= 1e-10);
                CHECK(distance(d, a.w, a.co, b.w, b.co) <= a.bound + b.bound);
            }
            cloud_free(&c);
        }
}

/* However near the sphere: at most eight steps (nine in the plane), nothing left of the mean but rounding, and within what is stated. */
TEST(near_the_sphere)
{
    for (int d = 2; d <= 4; ++d)
        for (int k = 2; k <= 12; k += 2) {
            const long double gap = powl(10.0L, -k);
            double e[4] = {0.48, 0.6, 0.64, 0.0};
            if (d == 2) e[0] = 0.6, e[1] = 0.8;
            cloud c = cloud_random(64, d, 5, 0.0, false);
            const hyper_result at = solve(&c, HYPER_DAMPED, 0.0, LOXO_OK);
            cloud_move(&c, e, gap);
            const hyper_result r = solve(&c, HYPER_DAMPED, 0.0, LOXO_OK);
            /* the barycenter moves along: sigma_(-a) of what it was */
            double a[4] = {0}, truth[4];
            for (int i = 0; i < d; ++i)
                a[i] = (double)(1.0L - gap) * e[i];
            const double co_a = (double)(gap * (2.0L - gap)), co = k_ball_compose(d, a, co_a, at.w, at.co, truth);
            CHECK_NEAR(r.co, co, 40.0 * 2.3e-16 / (double)gap * co); /* a and e have their own rounding */
            CHECK(r.n_iterations <= (d == 2 ? 9 : 8));
            CHECK(r.residual <= 1e-14);
            CHECK(r.bound <= 16.0 * 2.3e-16 / k_ball_gap(r.co) + 1e-14);
            cloud_free(&c);
        }
}

/* Of one step the certificate is above the distance to the end, and where that of Newton and Kantorovich holds, so does this one. */
TEST(certificates_hold)
{
    int n_ours = 0, n_theirs = 0;
    for (uint64_t seed = 1; seed <= 60; ++seed) {
        cloud c = cloud_random(16, 2 + (int)(seed % 3), seed, 0.05 * (double)(seed % 7), seed % 2 == 0);
        const hyper_result end = solve(&c, HYPER_DAMPED, 0.0, LOXO_OK);
        for (int64_t most = 0; most < 4; ++most) {
            hyper_settings settings = hyper_settings_default();
            hyper_result r;
            settings.max_iterations = most;
            settings.tolerance = 1e-300; /* never met */
            (void)hyper_barycenter(test_context, &c.atoms, NULL, &settings, &r);
            const double truth = distance(c.atoms.d, r.w, r.co, end.w, end.co);
            if (r.frame_bound < HUGE_VAL) CHECK(r.bound >= truth - end.bound);
            if (r.q < 1.0) CHECK(r.frame_bound <= 0.5 * r.lambda * r.q + 1e-14);
            if (most == 0) n_ours += r.frame_bound < HUGE_VAL, n_theirs += r.q < 1.0;
        }
        cloud_free(&c);
    }
    print_message("of 60 at the centre: %d certified, %d by Newton and Kantorovich\n", n_ours, n_theirs);
    CHECK(n_ours > n_theirs);
}

static double potential(const cloud *c, const double *w, double co)
{
    const int d = c->atoms.d;
    double sum = 0.0, weight = 0.0;
    for (int64_t i = 0; i < c->atoms.n; ++i) {
        double square = 0.0;
        for (int k = 0; k < d; ++k)
            square += (c->x[i * d + k] - w[k]) * (c->x[i * d + k] - w[k]);
        sum += (c->weight == NULL ? 1.0 : c->weight[i]) * log(square / co);
        weight += c->weight == NULL ? 1.0 : c->weight[i];
    }
    return sum / weight;
}

/* A full step from the centre leaves |F|_g of at most L^2 / 2 and a least eigenvalue of at least what it was less L; Psi falls if L <= 1/2. */
TEST(what_a_full_step_leaves)
{
    double most = 0.0;
    for (uint64_t seed = 1; seed <= 80; ++seed) {
        const int d = 2 + (int)(seed % 4);
        cloud c = cloud_random(8 + (int64_t)(seed % 3) * 20, d, seed, 0.1 * (double)(seed % 5), seed % 2 == 0);
        hyper_moments m;
        double w[5] = {0}, a[25], value[2][5], v[25], u[5] = {0}, co = 1.0, length = 0.0;
        for (int step = 0; step < 2; ++step) {
            CHECK_OK(hyper_find_moments(test_context, &c.atoms, w, co, &m));
            const double *row = m.second;
            for (int i = 0; i < d; ++i)
                for (int j = i; j < d; ++j) {
                    a[i * d + j] = a[j * d + i] = (i == j ? 1.0 : 0.0) - *row;
                    ++row;
                }
            hyper_eigen(d, a, value[step], v);
            if (step == 1) break;
            for (int i = 0; i < d; ++i)
                for (int k = 0; k < d; ++k)
                    u[k] += 0.5 * k_ball_dot(d, v + (ptrdiff_t)i * d, m.mean) / value[0][i] * v[i * d + k];
            length = 2.0 * sqrt(k_ball_dot(d, u, u));
            for (int k = 0; k < d; ++k)
                w[k] = length > 0.0 ? u[k] * (tanh(0.5 * length) / (0.5 * length)) : 0.0;
            co = 1.0 / (cosh(0.5 * length) * cosh(0.5 * length));
        }
        const double residual = sqrt(k_ball_dot(d, m.mean, m.mean));
        CHECK(residual <= 0.5 * length * length + 1e-15);
        CHECK(value[1][0] >= value[0][0] - length - 1e-15);
        if (length <= 0.5) CHECK(potential(&c, w, co) < 0.0);
        most = fmax(most, residual / (0.5 * length * length));
        cloud_free(&c);
    }
    print_message("residual after a full step: up to %.2f of its bound\n", most);
}

/* Nearly two points, and others: every damped step lowers the potential. */
TEST(steps_descend)
{
    for (uint64_t seed = 1; seed <= 30; ++seed) {
        cloud c = cloud_random(20, 3, seed, 0.0, true);
        for (int64_t i = 0; i < 20 && seed % 2 == 0; ++i) { /* two bundles */
            double square = 0.0;
            for (int k = 0; k < 3; ++k) {
                c.x[3 * i + k] *= 1e-3;
                if (k == (i % 2 == 0 ? 0 : 1)) c.x[3 * i + k] += 1.0;
                square += c.x[3 * i + k] * c.x[3 * i + k];
            }
            for (int k = 0; k < 3; ++k)
                c.x[3 * i + k] /= sqrt(square);
        }
        double before = 0.0;
        const hyper_result end = solve(&c, HYPER_DAMPED, 0.0, LOXO_OK);
        for (int64_t most = 1; most <= end.n_iterations; ++most) {
            hyper_settings settings = hyper_settings_default();
            hyper_result r;
            settings.max_iterations = most;
            settings.tolerance = 1e-300;
            (void)hyper_barycenter(test_context, &c.atoms, NULL, &settings, &r);
            const double now = potential(&c, r.w, r.co);
            CHECK(now <= before + 1e-12);
            before = now;
        }
        cloud_free(&c);
    }
}

/* The shifts of the result centre the atoms. */
TEST(shifts_centre_the_atoms)
{
    for (int k = 0; k <= 10; k += 5) {
        cloud c = cloud_random(50, 3, 9, 0.3, false);
        if (k > 0) cloud_move(&c, (const double[]){0.0, 0.6, -0.8}, powl(10.0L, -k));
        const hyper_result r = solve(&c, HYPER_DAMPED, 0.0, LOXO_OK);
        for (int i = 0; i < r.n_shifts; ++i)
            for (int64_t v = 0; v < 50; ++v)
                k_ball_shift(3, r.shift[i], r.shift_co[i], c.x + 3 * v, c.x + 3 * v);
        long double mean[3] = {0};
        for (int64_t v = 0; v < 50; ++v)
            for (int i = 0; i < 3; ++i)
                mean[i] += (long double)c.x[3 * v + i] / 50.0L;
        for (int i = 0; i < 3; ++i)
            CHECK_NEAR((double)mean[i], 0.0, k == 0 ? 1e-14 : 1e-15);
        cloud_free(&c);
    }
}

TEST(measures_without_a_barycenter)
{
    static const double axis[][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}};
    static const struct {
        int n, at[6];
        double weight[6];
        hyper_class kind;
    } cases[] = {
        {1, {1}, {2}, HYPER_NONE},
        {2, {1, 1}, {1, 1}, HYPER_NONE},
        {2, {0, 1}, {1, 1}, HYPER_NOT_UNIQUE},
        {2, {0, 3}, {1, 1}, HYPER_NOT_UNIQUE},
        {2, {0, 1}, {1, 3}, HYPER_NONE},
        {3, {0, 1, 2}, {2, 1, 1}, HYPER_NONE},
        {4, {0, 1, 0, 1}, {0.1, 0.3, 0.2, 0.0}, HYPER_NOT_UNIQUE},
        {6, {2, 0, 1, 2, 2, 0}, {1, 1, 2, 1, 2, 1}, HYPER_NONE},
        {3, {0, 1, 2}, {1.999999, 1, 1}, HYPER_STABLE},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        cloud c = cloud_make(cases[i].n, 3, true);
        for (int k = 0; k < cases[i].n; ++k) {
            memcpy(c.x + 3 * k, axis[cases[i].at[k]], 3 * sizeof(double));
            c.weight[k] = cases[i].weight[k];
        }
        const hyper_result r =
            solve(&c, HYPER_DAMPED, 0.0, cases[i].kind == HYPER_STABLE ? LOXO_OK : LOXO_CHECK_FAILED);
        CHECK_EQUAL(r.kind, cases[i].kind);
        if (r.kind == HYPER_NONE) {
            CHECK_NEAR(k_ball_dot(3, r.w, r.w), 1.0, 0.0);
            CHECK_EQUAL(r.co, 0.0);
        }
        if (r.kind == HYPER_NOT_UNIQUE) { /* both ends, and a point between */
            hyper_moments m;
            CHECK_NEAR(k_ball_dot(3, r.shift[0], r.shift[0]), 1.0, 0.0);
            CHECK_NEAR(k_ball_dot(3, r.other, r.other), 1.0, 0.0);
            CHECK_OK(hyper_find_moments(test_context, &c.atoms, r.w, r.co, &m));
            for (int k = 0; k < 3; ++k)
                CHECK_NEAR(m.mean[k], 0.0, 1e-15);
        }
        cloud_free(&c);
    }
}

TEST(bad_atoms_are_named)
{
    for (int k = 0; k < 6; ++k) {
        cloud c = cloud_random(5000, 3, 2, 0.0, true);
        if (k == 0) c.weight[4321] = -1.0;
        if (k == 1) c.weight[4321] = (double)NAN;
        if (k == 2) c.x[3 * 4321 + 1] = HUGE_VAL;
        if (k == 3) c.x[3 * 4321] = c.x[3 * 4321 + 1] = c.x[3 * 4321 + 2] = 0.0;
        if (k == 4) c.x[3 * 4321 + 2] *= 1.1;
        for (int64_t i = 0; i < 5000 && k == 5; ++i)
            c.weight[i] = 0.0;
        hyper_moments first;
        CHECK_STATUS(test_context, hyper_check_atoms(test_context, "test", &c.atoms, &first), LOXO_ERR_ARGUMENT);
        if (k < 5) CHECK_EQUAL(loxo_context_failure(test_context)->element, 4321);
        cloud_free(&c);
    }
}

/* Floats are directions: their own length does not matter. */
TEST(floats_are_directions)
{
    cloud c = cloud_random(777, 3, 4, 0.5, false);
    float *x = loxo_allocate(test_context, 3 * 777, sizeof *x);
    for (int64_t i = 0; i < 3 * 777; ++i)
        x[i] = (float)c.x[i];
    for (int64_t i = 0; i < 777; ++i) {
        /* in long doubles: gcc 12.2 at -O3 -fno-math-errno takes the last of a known number of such roots in single precision */
        long double square = 0.0L;
        for (int k = 0; k < 3; ++k)
            square += (long double)x[3 * i + k] * (long double)x[3 * i + k];
        for (int k = 0; k < 3; ++k)
            c.x[3 * i + k] = (double)((long double)x[3 * i + k] / sqrtl(square));
    }
    const hyper_result a = solve(&c, HYPER_DAMPED, 0.0, LOXO_OK);
    c.atoms.x = NULL;
    c.atoms.x_float = x;
    const hyper_result b = solve(&c, HYPER_DAMPED, 0.0, LOXO_OK);
    CHECK(distance(3, a.w, a.co, b.w, b.co) <= 1e-14);
    loxo_release(test_context, x);
    cloud_free(&c);
}

TEST(a_tolerance_beyond_doubles_is_said)
{
    cloud c = cloud_random(100, 3, 8, 0.0, false);
    cloud_move(&c, (const double[]){1.0, 0.0, 0.0}, 1e-6L);
    const hyper_result r = solve(&c, HYPER_DAMPED, 1e-12, LOXO_NOT_CONVERGED);
    CHECK_EQUAL(r.stop, HYPER_STOP_ROUNDING);
    CHECK(r.bound > 1e-12 && r.bound < 1e-8 && r.n_iterations < 10);
    cloud_free(&c);
}

static loxo_status solve_with_allocations(loxo_context *ctx, void *arg)
{
    const hyper_settings settings = hyper_settings_default();
    hyper_result r;
    return hyper_barycenter(ctx, arg, NULL, &settings, &r);
}

TEST(each_allocation_fails)
{
    cloud c = cloud_random(300, 3, 6, 0.0, false);
    cloud_move(&c, (const double[]){0.0, 0.0, 1.0}, 1e-4L); /* so that atoms are carried */
    CHECK(test_each_allocation_fails(solve_with_allocations, &c.atoms) > 3);
    cloud_free(&c);
}
