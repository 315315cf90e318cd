/* SPDX-License-Identifier: MIT
 * Douady and Earle's extension. Facts: if the curve is the boundary of a holomorphic map f of the disk to itself, then the extension is f: seen
 * from f(z), gamma is the boundary of sigma_f(z) o f, whose mean under the harmonic measure of z is its value there, 0. So
 * identity, rotations, powers, Moebius maps and Blaschke products are closed forms. */
#include "../test.h"
#include "base/rng.h"
#include "kernel/ball_kernel.h"
#include "solver/barycenter/extension_internal.h"
#include "stopper.h"

#include <loxo/extension.h>

#include <complex.h>

#define PI 3.14159265358979323846

typedef double complex (*circle_map)(double complex);

/* x + i y; CMPLX is not everywhere. */
static double complex number(double x, double y)
{
    const double parts[2] = {x, y};
    double complex z;
    memcpy(&z, parts, sizeof z);
    return z;
}

static double complex unit(double t) { return number(cos(t), sin(t)); }
static double complex identity(double complex z) { return z; }
static double complex turned(double complex z) { return unit(0.7) * z; }
static double complex square(double complex z) { return z * z; }
static double complex cube(double complex z) { return z * z * z; }
static double complex factor(double complex a, double complex z) { return (z - a) / (1.0 - conj(a) * z); }
static double complex moebius(double complex z) { return unit(1.3) * factor(number(0.4, -0.3), z); }
static double complex blaschke(double complex z)
{
    return factor(number(0.5, 0.2), z) * factor(number(0.0, -0.3), z) * factor(number(-0.4, 0.1), z);
}

/* Samples of a map of the circle to itself, put into a plane of R^d: the first two axes. */
static double *samples(circle_map f, int64_t n, int d, const double *angle)
{
    double *x = loxo_allocate(test_context, n * d, sizeof *x);
    memset(x, 0, (size_t)(n * d) * sizeof *x);
    for (int64_t i = 0; i < n; ++i) {
        const double complex w = f(unit(angle != NULL ? angle[i] : 2.0 * PI * (double)i / (double)n));
        x[i * d] = creal(w) / cabs(w);
        x[i * d + 1] = cimag(w) / cabs(w);
    }
    return x;
}

/* A closed curve in space. */
static double *space_curve(int64_t n)
{
    double *x = loxo_allocate(test_context, 3 * n, sizeof *x);
    for (int64_t i = 0; i < n; ++i) {
        const double t = 2.0 * PI * (double)i / (double)n;
        double *p = x + 3 * i;
        p[0] = cos(t) * (1.0 + 0.3 * cos(3.0 * t));
        p[1] = sin(t) * (1.0 + 0.2 * sin(2.0 * t));
        p[2] = 0.7 * sin(2.0 * t) + 0.4 * cos(5.0 * t);
        const double norm = sqrt(k_ball_dot(3, p, p));
        for (int k = 0; k < 3; ++k)
            p[k] /= norm;
    }
    return x;
}

/* Points all over the disk, n of them. */
static double *points(int64_t n)
{
    double *z = loxo_allocate(test_context, 2 * n, sizeof *z);
    for (int64_t i = 0; i < n; ++i) {
        const double r = sqrt(loxo_random_unit(3, (uint64_t)i)), t = 2.0 * PI * loxo_random_unit(4, (uint64_t)i);
        z[2 * i] = r * cos(t);
        z[2 * i + 1] = r * sin(t);
    }
    z[0] = z[1] = 0.0;
    return z;
}

typedef struct run {
    double *w, *co, *bound, *error;
    unsigned char *kind;
    loxo_extension_info info;
} run;

static run run_make(loxo_context *ctx, int64_t n, int d)
{
    run r = {.w = loxo_allocate(ctx, n * d, sizeof(double))};
    r.co = loxo_allocate(ctx, n, sizeof(double));
    r.bound = loxo_allocate(ctx, n, sizeof(double));
    r.error = loxo_allocate(ctx, n, sizeof(double));
    r.kind = loxo_allocate(ctx, n, 1);
    return r;
}

static void run_free(loxo_context *ctx, run *r)
{
    loxo_release(ctx, r->w);
    loxo_release(ctx, r->co);
    loxo_release(ctx, r->bound);
    loxo_release(ctx, r->error);
    loxo_release(ctx, r->kind);
}

static loxo_status extend(loxo_context *ctx, const loxo_curve *curve, const loxo_extension_settings *settings,
                          int64_t n, const double *z, const double *co, run *r)
{
    loxo_extension *extension;
    loxo_status status = loxo_extension_create(ctx, curve, settings, &extension);
    if (status < 0) return status;
    const loxo_extension_values values = {
        .w = r->w, .co = r->co, .bound = r->bound, .error = r->error, .kind = r->kind};
    status = loxo_extension_evaluate(extension, n, z, co, &values, &r->info);
    loxo_extension_destroy(extension);
    return status;
}

/* Hyperbolic distance of points whose co is known. */
static double distance(int d, const double *a, double co_a, const double *b, double co_b)
{
    double sum = 0.0;
    for (int k = 0; k < d; ++k)
        sum += (a[k] - b[k]) * (a[k] - b[k]);
    return 2.0 * asinh(sqrt(sum / (co_a * co_b)));
}

/* What graded nodes may miss where the curve comes back to near the value (EXTENSION.md): some nodes' weight there, h beta each, h = 2 K / n with K
 * about log(4 / beta). */
static double slack(int64_t n, const double z[2])
{
    const double beta = fmax(1.0 - hypot(z[0], z[1]), 1e-16) / (1.0 + hypot(z[0], z[1]));
    return beta < 0.1 ? 10.0 * log(4.0 / beta) * beta / (double)n : 0.0;
}

/* Largest hyperbolic distance from f, less what great arcs do beside the curve, chord / co, and nodes far from z. */
static double off_by(circle_map f, int64_t n, const double *z, const run *r, int d, double chord)
{
    double most = 0.0;
    for (int64_t i = 0; i < n; ++i) {
        const double complex w = f(number(z[2 * i], z[2 * i + 1]));
        const double want[2] = {creal(w), cimag(w)}, co = (1.0 - cabs(w)) * (1.0 + cabs(w));
        CHECK(r->kind[i] == LOXO_EXTENSION_INSIDE);
        CHECK_NEAR(r->co[i], 1.0 - k_ball_dot(d, r->w + i * d, r->w + i * d), 4e-15);
        const double off = distance(2, want, co, r->w + i * d, r->co[i]);
        most = fmax(most, chord > 0.0 ? off - chord / co - slack(720, z + 2 * i) : off);
        for (int k = 2; k < d; ++k)
            most = fmax(most, fabs(r->w[i * d + k]));
    }
    return most;
}

/* The samples of a rotation give the rotation, whatever their number: what is left is the search's tolerance, and where nodes stay, |z|^n. */
TEST(rotations_are_exact)
{
    enum { N = 500 };
    double *z = points(N);
    for (int d = 2; d <= 5; ++d)
        for (int m = 0; m < 2; ++m)
            for (int rule = LOXO_EXTENSION_AUTO; rule <= LOXO_EXTENSION_MOVING; ++rule) {
                double *x = samples(m == 0 ? identity : turned, 7 + d, d, NULL);
                const loxo_curve curve = {.n = 7 + d, .d = d, .x = x};
                loxo_extension_settings settings = loxo_extension_settings_default();
                run r = run_make(test_context, N, d);
                settings.rule = (loxo_extension_rule)rule;
                settings.tolerance = 1e-11;
                CHECK_OK(extend(test_context, &curve, &settings, N, z, NULL, &r));
                CHECK(off_by(m == 0 ? identity : turned, N, z, &r, d, 0.0) <=
                      (rule == LOXO_EXTENSION_AUTO ? 1e-7 : 2e-11));
                CHECK(r.info.n_points == N && r.info.bound_max <= 1e-11);
                CHECK((r.info.n_fixed > 0) == (rule == LOXO_EXTENSION_AUTO));
                run_free(test_context, &r);
                loxo_release(test_context, x);
            }
    loxo_release(test_context, z);
}

/* Between samples a great arc differs from f by an eighth of the square of a step times a second derivative, 20 at most here: 1e-7, against 1 - |f|^2. */
TEST(holomorphic_maps_extend_to_themselves)
{
    enum { N = 400, SAMPLES = 30000 };
    static const circle_map maps[] = {square, cube, moebius, blaschke};
    double *z = points(N);
    for (int m = 0; m < 4; ++m)
        for (int rule = LOXO_EXTENSION_AUTO; rule <= LOXO_EXTENSION_GRADED; ++rule) {
            double *x = samples(maps[m], SAMPLES, 2, NULL);
            const loxo_curve curve = {.n = SAMPLES, .d = 2, .x = x};
            loxo_extension_settings settings = loxo_extension_settings_default();
            run r = run_make(test_context, N, 2);
            settings.rule = (loxo_extension_rule)rule;
            CHECK_OK(extend(test_context, &curve, &settings, N, z, NULL, &r));
            CHECK(off_by(maps[m], N, z, &r, 2, 1e-7) <= 2e-8);
            run_free(test_context, &r);
            loxo_release(test_context, x);
        }
    loxo_release(test_context, z);
}

/* The error falls with the square of the samples' step, for each rule: the curve between them, not the nodes, decides. */
TEST(few_samples_converge_quadratically)
{
    enum { N = 200 };
    double *z = points(N);
    for (int64_t i = 0; i < 2 * N; ++i)
        z[i] *= 0.9;
    for (int rule = LOXO_EXTENSION_MOVING; rule <= LOXO_EXTENSION_FIXED; ++rule) {
        double before = 0.0;
        for (int64_t n = 90; n <= 720; n *= 2) {
            double *x = samples(blaschke, n, 2, NULL);
            const loxo_curve curve = {.n = n, .d = 2, .x = x};
            loxo_extension_settings settings = loxo_extension_settings_default();
            run r = run_make(test_context, N, 2);
            settings.rule = (loxo_extension_rule)rule;
            settings.n_nodes = 8 * n;
            CHECK_OK(extend(test_context, &curve, &settings, N, z, NULL, &r));
            const double off = off_by(blaschke, N, z, &r, 2, 0.0);
            if (n > 90) CHECK(before / off > 3.6 && before / off < 4.4);
            before = off;
            run_free(test_context, &r);
            loxo_release(test_context, x);
        }
    }
    loxo_release(test_context, z);
}

/* With what one rule says of a polyline the other agrees, as far as its own estimate of its error tells, which is not far too high. */
TEST(both_rules_agree_on_polylines)
{
    enum { N = 300 };
    static const int64_t n_samples[] = {5, 50, 300, 720, 1000};
    double *z = points(N);
    for (int64_t i = 0; i < 2 * N; ++i)
        z[i] *= 0.8;
    for (int s = 0; s < 5; ++s) {
        double *x = space_curve(n_samples[s]);
        const loxo_curve curve = {.n = n_samples[s], .d = 3, .x = x};
        loxo_extension_settings settings = loxo_extension_settings_default();
        run moving = run_make(test_context, N, 3), fixed = run_make(test_context, N, 3),
            fine = run_make(test_context, N, 3);
        settings.rule = LOXO_EXTENSION_FIXED;
        CHECK_OK(extend(test_context, &curve, &settings, N, z, NULL, &fixed));
        settings.rule = LOXO_EXTENSION_MOVING;
        CHECK_OK(extend(test_context, &curve, &settings, N, z, NULL, &moving));
        settings.n_nodes = 23040;
        settings.tolerance = 1e-11;
        CHECK_OK(extend(test_context, &curve, &settings, N, z, NULL, &fine));
        double most_fixed = 0.0, most_moving = 0.0;
        for (int64_t i = 0; i < N; ++i) {
            most_fixed = fmax(most_fixed, distance(3, fine.w + 3 * i, fine.co[i], fixed.w + 3 * i, fixed.co[i]));
            most_moving = fmax(most_moving, distance(3, fine.w + 3 * i, fine.co[i], moving.w + 3 * i, moving.co[i]));
        }
        CHECK(most_moving <= moving.info.error_max && most_moving <= 2e-4);
        CHECK(most_fixed <= 2e-4);
        run_free(test_context, &moving);
        run_free(test_context, &fixed);
        run_free(test_context, &fine);
        loxo_release(test_context, x);
    }
    loxo_release(test_context, z);
}

/* E(phi o gamma) = phi(E(gamma)) for a Moebius map phi of the ball: great arcs between samples are not mapped to great arcs, which for 20000
 * samples is 1e-8 of a turn; and nodes of equal weight stay what they are. */
TEST(moebius_maps_behind_pass_through)
{
    enum { N = 200, SAMPLES = 20000 };
    const double a[3] = {0.3, -0.5, 0.4};
    double *z = points(N), *x = space_curve(SAMPLES), *y = loxo_allocate(test_context, 3 * SAMPLES, sizeof *y),
           *want = loxo_allocate(test_context, 3 * N, sizeof *want),
           *want_co = loxo_allocate(test_context, N, sizeof *want_co);
    loxo_moebius phi;
    run r = run_make(test_context, N, 3), s = run_make(test_context, N, 3);
    loxo_curve curve = {.n = SAMPLES, .d = 3, .x = x};
    CHECK_OK(loxo_moebius_set_identity(test_context, 3, &phi));
    CHECK_OK(loxo_moebius_append_shift(test_context, &phi, a, 0.0));
    CHECK_OK(loxo_moebius_map_sphere(test_context, &phi, SAMPLES, x, y));
    CHECK_OK(extend(test_context, &curve, NULL, N, z, NULL, &r));
    curve.x = y;
    CHECK_OK(extend(test_context, &curve, NULL, N, z, NULL, &s));
    CHECK_OK(loxo_moebius_map_ball(test_context, &phi, N, r.w, r.co, want, want_co));
    for (int64_t i = 0; i < N; ++i)
        CHECK(distance(3, want + 3 * i, want_co[i], s.w + 3 * i, s.co[i]) <= 2e-8 + 3e-7 / s.co[i]);
    run_free(test_context, &r);
    run_free(test_context, &s);
    loxo_release(test_context, z);
    loxo_release(test_context, x);
    loxo_release(test_context, y);
    loxo_release(test_context, want);
    loxo_release(test_context, want_co);
}

/* E(gamma o phi) = E(gamma) o phi for a Moebius map phi of the disk, by samples at the angles that phi puts them to. */
TEST(moebius_maps_before_pass_through)
{
    enum { N = 200, SAMPLES = 20000 };
    const double complex a = number(0.5, -0.3);
    double *z = points(N), *image = loxo_allocate(test_context, 2 * N, sizeof *image), *x = space_curve(SAMPLES);
    double *angle = loxo_allocate(test_context, SAMPLES, sizeof *angle);
    run r = run_make(test_context, N, 3), s = run_make(test_context, N, 3);
    loxo_curve curve = {.n = SAMPLES, .d = 3, .x = x};
    for (int64_t i = 0; i < N; ++i) {
        const double complex w = factor(a, number(z[2 * i], z[2 * i + 1]));
        image[2 * i] = creal(w);
        image[2 * i + 1] = cimag(w);
    }
    for (int64_t i = 0; i < SAMPLES; ++i) { /* phi^-1 of even angles: there gamma o phi has the samples of gamma */
        const double complex w = factor(-a, unit(2.0 * PI * (double)i / SAMPLES));
        angle[i] = carg(w);
        while (i > 0 && angle[i] < angle[i - 1])
            angle[i] += 2.0 * PI;
    }
    CHECK_OK(extend(test_context, &curve, NULL, N, image, NULL, &r));
    curve.angle = angle;
    CHECK_OK(extend(test_context, &curve, NULL, N, z, NULL, &s));
    for (int64_t i = 0; i < N; ++i)
        CHECK(distance(3, r.w + 3 * i, r.co[i], s.w + 3 * i, s.co[i]) <=
              2e-8 + 3e-7 / s.co[i] + slack(720, z + 2 * i) + slack(720, image + 2 * i));
    run_free(test_context, &r);
    run_free(test_context, &s);
    loxo_release(test_context, z);
    loxo_release(test_context, image);
    loxo_release(test_context, x);
    loxo_release(test_context, angle);
}

/* A rotation is exact at any 1 - |z|, as relatively to it as z's own rounding lets it; of a Blaschke product 1 - |f|^2 is |f'| (1 - |z|^2) at
 * the circle, and great arcs know f' to a step's length. */
TEST(nothing_is_lost_near_the_circle)
{
    static const int exponents[] = {1, 2, 3, 4, 5, 6, 8, 10, 12, 14, 15, 16, 30, 300};
    for (int j = 0; j < 14; ++j) {
        const int e = exponents[j];
        const double gap = pow(10.0, -e), co = gap * (2.0 - gap);
        for (int i = 0; i < 12; ++i) {
            const double t = 0.1 + 0.5 * i, z[2] = {(1.0 - gap) * cos(t), (1.0 - gap) * sin(t)};
            for (int m = 0; m < 2; ++m) {
                const int64_t n = m == 0 ? 50 : 40000;
                double *x = samples(m == 0 ? turned : blaschke, n, 2, NULL);
                const loxo_curve curve = {.n = n, .d = 2, .x = x};
                loxo_extension_settings settings = loxo_extension_settings_default();
                run r = run_make(test_context, 1, 2);
                settings.n_nodes = 960;
                settings.rule = i % 2 == 0 ? LOXO_EXTENSION_GRADED : LOXO_EXTENSION_AUTO;
                CHECK_OK(extend(test_context, &curve, &settings, 1, z, &co, &r));
                const double complex on = unit(t), w = (m == 0 ? turned : blaschke)((1.0 - gap) * on);
                const double most = m == 0 ? 1e-8 * gap + 1e-15 : 20.0 * slack(960, z) * gap + 1e-5 * gap + 1e-8;
                CHECK_NEAR(r.w[0], creal(w), most);
                CHECK_NEAR(r.w[1], cimag(w), most);
                if (m == 0) CHECK_NEAR(r.co[0] / co, 1.0, 2e-8);
                if (m == 1 && e >= 6) {
                    const double h = 1e-5;
                    const double speed = cabs(blaschke(on * unit(h)) - blaschke(on * unit(-h))) / (2.0 * h);
                    CHECK_NEAR(r.co[0] / (speed * co), 1.0, 2e-3);
                }
                CHECK(r.kind[0] == LOXO_EXTENSION_INSIDE && r.info.n_near == (gap < 1.9e-4));
                run_free(test_context, &r);
                loxo_release(test_context, x);
            }
        }
    }
}

/* The nodes as differences are the plain ones, shifted. */
TEST(near_nodes_are_the_moved_ones)
{
    enum { N = 64 };
    for (int d = 2; d <= 4; ++d) {
        const double direction[2] = {0.8, -0.6}, beta = 0.05;
        double *x = loxo_allocate(test_context, (int64_t)40 * d, sizeof *x);
        double plain[N * 4], near[N * 4], w[4];
        for (int64_t i = 0; i < 40; ++i) {
            for (int k = 0; k < d; ++k)
                x[i * d + k] = loxo_random_unit(9, (uint64_t)(i * d + k)) - 0.5 + 2.0 * (k == 0);
            const double norm = sqrt(k_ball_dot(d, x + i * d, x + i * d));
            for (int k = 0; k < d; ++k)
                x[i * d + k] /= norm;
        }
        const loxo_curve given = {.n = 40, .d = d, .x = x};
        extension_curve curve;
        extension_nodes nodes;
        CHECK_OK(extension_curve_create(test_context, &given, &curve));
        CHECK_OK(extension_nodes_create(test_context, &curve, N, &nodes));
        const extension_seen seen = {.n = N, .cosine = nodes.cosine, .sine = nodes.sine};
        for (int isa = LOXO_ISA_BASELINE; isa <= (int)loxo_context_isa(test_context); ++isa) {
            extension_move_nodes(k_variant_get((loxo_isa)isa), &curve, &seen, direction, beta, plain);
            const double co = extension_move_nodes_near(&curve, &seen, direction, beta, near, w);
            CHECK(co > 0.0 && co < 1.0);
            for (int i = 0; i < N; ++i) {
                double image[4];
                k_ball_shift(d, w, co, plain + (ptrdiff_t)i * d, image);
                for (int k = 0; k < d; ++k)
                    CHECK_NEAR(image[k], near[i * d + k], 1e-11);
            }
        }
        extension_curve_destroy(test_context, &curve);
        extension_nodes_destroy(test_context, &nodes);
        loxo_release(test_context, x);
    }
}

TEST(on_the_circle_it_is_the_curve)
{
    double *x = space_curve(11);
    const loxo_curve curve = {.n = 11, .d = 3, .x = x};
    run r = run_make(test_context, 11, 3);
    double z[22];
    for (int i = 0; i < 11; ++i) {
        z[2 * i] = cos(2.0 * PI * i / 11.0);
        z[2 * i + 1] = sin(2.0 * PI * i / 11.0);
    }
    const double co[11] = {0.0};
    CHECK_OK(extend(test_context, &curve, NULL, 11, z, co, &r));
    CHECK(r.info.n_curve == 11 && memcmp(r.w, x, 33 * sizeof *x) == 0);
    for (int i = 0; i < 11; ++i)
        CHECK(r.kind[i] == LOXO_EXTENSION_CURVE && r.co[i] == 0.0 && r.bound[i] == 0.0);
    run_free(test_context, &r);
    loxo_release(test_context, x);
}

/* A curve that rests at one point over the angles from 0 to 0.8 pi: where that arc has half of the harmonic measure or more, on one side of the circle
 * through its ends that meets the unit circle at right angles turned by ..., the value is that point; and nearby it comes near it. */
TEST(where_the_curve_rests)
{
    enum { N = 101, SAMPLES = 200 };
    const int64_t n_rest = 81; /* samples 0 to 80 */
    double x[2 * SAMPLES], z[2 * N];
    for (int i = 0; i < SAMPLES; ++i) {
        const double t = i < n_rest ? 0.0 : 2.0 * PI * (double)(i - n_rest + 1) / (SAMPLES - (double)n_rest + 1.0);
        x[2 * i] = cos(t);
        x[2 * i + 1] = sin(t);
    }
    const double middle = 0.4 * PI;
    const loxo_curve curve = {.n = SAMPLES, .d = 2, .x = x};
    for (int i = 0; i < N; ++i) { /* from the far side to the middle of the arc */
        z[2 * i] = (0.02 * i - 1.0) * cos(middle);
        z[2 * i + 1] = (0.02 * i - 1.0) * sin(middle);
    }
    run r = run_make(test_context, N, 2);
    CHECK_OK(extend(test_context, &curve, NULL, N, z, NULL, &r));
    double last = 0.0;
    int64_t n_rests = 0;
    for (int i = 1; i < N - 1; ++i) {
        /* tan of half the angle of the arc, moved by the Moebius map of z: (1 - r) / (1 + r) tan(0.2 pi) */
        const double s = 0.02 * i - 1.0, share = 2.0 * atan(tan(0.2 * PI) * (1.0 + s) / (1.0 - s)) / PI;
        CHECK((r.kind[i] == LOXO_EXTENSION_RESTING) == (share >= 0.5));
        if (share >= 0.5) {
            CHECK(r.w[2 * i] == 1.0 && r.w[2 * i + 1] == 0.0 && r.co[i] == 0.0);
            ++n_rests;
        } else {
            CHECK(r.kind[i] == LOXO_EXTENSION_INSIDE && r.co[i] > 0.0);
            if (share > 0.4) CHECK(r.w[2 * i] >= last);
            last = r.w[2 * i];
        }
    }
    CHECK(n_rests == r.info.n_resting && n_rests > 20 && last > 0.9);
    run_free(test_context, &r);
    /* all of it at one point */
    for (int i = 0; i < SAMPLES; ++i)
        memcpy(x + 2 * i, (const double[2]){0.6, -0.8}, 2 * sizeof *x);
    r = run_make(test_context, N, 2);
    CHECK_OK(extend(test_context, &curve, NULL, N, z, NULL, &r));
    CHECK(r.info.n_resting == N - 2 && r.info.n_curve == 2);
    for (int i = 0; i < N; ++i)
        CHECK(r.w[2 * i] == 0.6 && r.w[2 * i + 1] == -0.8);
    run_free(test_context, &r);
    /* it rests there twice: shares add up */
    for (int i = 0; i < SAMPLES; ++i) {
        const bool rests = i % 100 <= 60;
        const double t = rests ? 0.0 : 2.0 * PI * (i % 100 - 60) / 40.0;
        x[2 * i] = cos(t);
        x[2 * i + 1] = sin(t);
    }
    r = run_make(test_context, 1, 2);
    CHECK_OK(extend(test_context, &curve, NULL, 1, (const double[2]){0.0, 0.0}, NULL, &r));
    CHECK(r.kind[0] == LOXO_EXTENSION_RESTING && r.w[0] == 1.0);
    run_free(test_context, &r);
}

/* The certificate holds against a search that goes as far as doubles do, on the same nodes. */
TEST(bounds_hold)
{
    enum { N = 500 };
    double *z = points(N), *x = space_curve(60);
    const loxo_curve curve = {.n = 60, .d = 3, .x = x};
    loxo_extension_settings settings = loxo_extension_settings_default();
    run exact = run_make(test_context, N, 3), r = run_make(test_context, N, 3);
    settings.tolerance = 0.0;
    settings.rule = LOXO_EXTENSION_MOVING;
    CHECK_OK(extend(test_context, &curve, &settings, N, z, NULL, &exact));
    CHECK(exact.info.bound_max <= 1e-12);
    for (int e = 2; e <= 10; e += 2) {
        settings.tolerance = pow(10.0, -e);
        CHECK_OK(extend(test_context, &curve, &settings, N, z, NULL, &r));
        for (int64_t i = 0; i < N; ++i) {
            CHECK(r.bound[i] <= settings.tolerance);
            CHECK(distance(3, exact.w + 3 * i, exact.co[i], r.w + 3 * i, r.co[i]) <=
                  r.bound[i] + exact.bound[i] + 1e-15 / r.co[i]);
        }
    }
    settings.tolerance = 1e-17; /* more than doubles can certify: told */
    CHECK_STATUS(test_context, extend(test_context, &curve, &settings, N, z, NULL, &r), LOXO_NOT_CONVERGED);
    CHECK(r.info.n_open > 0 && r.kind[0] == LOXO_EXTENSION_OPEN && r.bound[0] < 1e-13);
    settings.tolerance = 1e-12;
    settings.max_iterations = 1;
    CHECK_STATUS(test_context, extend(test_context, &curve, &settings, N, z, NULL, &r), LOXO_NOT_CONVERGED);
    run_free(test_context, &exact);
    run_free(test_context, &r);
    loxo_release(test_context, z);
    loxo_release(test_context, x);
}

/* The estimate of the error is none too small for curves in space that wind k times: truth by many nodes, on samples so dense that arcs between
 * them make nothing of what is asked. EXTENSION.md says which curves deceive it. */
TEST(errors_of_winding_curves_are_not_underestimated)
{
    enum { N = 46080, POINTS = 40 };
    double *x = loxo_allocate(test_context, (int64_t)3 * N, sizeof *x), *z = points(POINTS);
    run truth = run_make(test_context, POINTS, 3), r = run_make(test_context, POINTS, 3);
    int64_t n_seen = 0;
    for (int k = 1; k <= 9; k += 2) {
        const loxo_curve curve = {.n = N, .d = 3, .x = x};
        loxo_extension_settings settings = loxo_extension_settings_default();
        for (int64_t i = 0; i < N; ++i) {
            const double t = 2.0 * PI * (double)i / N, a = k * t + 0.8 * sin(t + 1.0) + 0.3 * sin(3.0 * t);
            const double p[3] = {cos(a), sin(a), 0.7 * cos((k + 1) * t + 0.3) + 0.2 * sin(2.0 * t)};
            const double norm = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
            for (int c = 0; c < 3; ++c)
                x[3 * i + c] = p[c] / norm;
        }
        settings.rule = LOXO_EXTENSION_GRADED;
        settings.tolerance = 1e-10;
        settings.n_nodes = 8192;
        CHECK_OK(extend(test_context, &curve, &settings, POINTS, z, NULL, &truth));
        for (settings.n_nodes = 256; settings.n_nodes <= 720; settings.n_nodes += 464) {
            CHECK_OK(extend(test_context, &curve, &settings, POINTS, z, NULL, &r));
            for (int64_t i = 0; i < POINTS; ++i) {
                if (r.kind[i] != LOXO_EXTENSION_INSIDE) continue;
                const double off = distance(3, r.w + 3 * i, r.co[i], truth.w + 3 * i, truth.co[i]);
                if (off < 1e-7 + 1e-8 * (k * k + 9) / truth.co[i]) continue;
                CHECK(off <= r.error[i]);
                ++n_seen;
            }
        }
    }
    CHECK(n_seen > 20);
    loxo_release(test_context, x);
    loxo_release(test_context, z);
    run_free(test_context, &truth);
    run_free(test_context, &r);
}

TEST(arc_tangents)
{
    for (int i = 0; i <= 1000; ++i)
        CHECK_NEAR(k_atan_unit(i / 1000.0), atan(i / 1000.0), 5e-14);
}

typedef struct job {
    loxo_curve curve;
    int64_t n;
    const double *z;
} job;

static uint64_t hash_extension(loxo_context *ctx, const void *arg)
{
    const job *j = arg;
    run r = run_make(ctx, j->n, j->curve.d);
    CHECK_STATUS(ctx, extend(ctx, &j->curve, NULL, j->n, j->z, NULL, &r), LOXO_OK);
    const uint64_t hash = test_hash(r.w, (size_t)(j->n * j->curve.d) * sizeof *r.w) ^
                          (3 * test_hash(r.bound, (size_t)j->n * sizeof *r.bound)) ^
                          (5 * test_hash(r.co, (size_t)j->n * sizeof *r.co));
    run_free(ctx, &r);
    return hash;
}

TEST(every_number_of_threads_gives_the_same_bits)
{
    enum { N = 3000 };
    double *z = points(N), *x = space_curve(200);
    job j = {{.n = 200, .d = 3, .x = x}, N, z};
    uint64_t first = 0;
    test_same_for_any_threads(hash_extension, &j);
    for (int isa = LOXO_ISA_BASELINE; isa <= (int)loxo_context_isa(test_context); ++isa) {
        loxo_context_settings settings = loxo_context_settings_default();
        loxo_context *ctx;
        settings.isa = (loxo_isa)isa;
        CHECK_STATUS(NULL, loxo_context_create(&settings, &ctx), LOXO_OK);
        const uint64_t now = hash_extension(ctx, &j);
        first = isa == LOXO_ISA_BASELINE ? now : first;
        CHECK(now == first);
        loxo_context_destroy(ctx);
    }
    /* a point's value does not depend on the others */
    run all = run_make(test_context, N, 3), one = run_make(test_context, 1, 3);
    CHECK_OK(extend(test_context, &j.curve, NULL, N, z, NULL, &all));
    for (int64_t i = 0; i < N; i += 500) {
        CHECK_OK(extend(test_context, &j.curve, NULL, 1, z + 2 * i, NULL, &one));
        CHECK(memcmp(one.w, all.w + 3 * i, 3 * sizeof *one.w) == 0 && one.bound[0] == all.bound[i]);
    }
    run_free(test_context, &all);
    run_free(test_context, &one);
    loxo_release(test_context, z);
    loxo_release(test_context, x);
}

static loxo_status call(loxo_context *ctx, void *arg)
{
    const job *j = arg;
    double w[3 * 50];
    loxo_extension *extension;
    loxo_status status = loxo_extension_create(ctx, &j->curve, NULL, &extension);
    const loxo_extension_values values = {.w = w};
    if (status >= 0) status = loxo_extension_evaluate(extension, j->n, j->z, NULL, &values, NULL);
    loxo_extension_destroy(extension);
    return status;
}

TEST(every_allocation_may_fail)
{
    double *z = points(50), *x = space_curve(20);
    memcpy(x + 3, x, 3 * sizeof *x); /* it rests */
    job j = {{.n = 20, .d = 3, .x = x}, 50, z};
    CHECK(test_each_allocation_fails(call, &j) >= 12);
    loxo_release(test_context, z);
    loxo_release(test_context, x);
}

TEST(the_monitor_can_stop_it)
{
    enum { N = 100000 };
    double *z = points(N), *x = space_curve(100);
    loxo_context *ctx = test_context_with_threads(1);
    double *w = loxo_allocate(ctx, 3 * N, sizeof *w);
    const loxo_curve curve = {.n = 100, .d = 3, .x = x};
    const loxo_extension_values values = {.w = w};
    loxo_extension *extension;
    loxo_extension_info info;
    stopper stop;
    CHECK_STATUS(ctx, loxo_extension_create(ctx, &curve, NULL, &extension), LOXO_OK);
    stopper_begin(&stop, ctx, 2);
    CHECK_STATUS(ctx, loxo_extension_evaluate(extension, N, z, NULL, &values, &info), LOXO_STOPPED);
    stopper_end(&stop);
    CHECK(info.n_points == 65536 && isfinite(w[0]) && isnan(w[3 * N - 1]));
    loxo_extension_destroy(extension);
    loxo_release(ctx, w);
    loxo_context_destroy(ctx);
    loxo_release(test_context, z);
    loxo_release(test_context, x);
}

static void check_refused(loxo_curve curve, const loxo_extension_settings *settings, int64_t element)
{
    loxo_extension *extension;
    loxo_context_clear(test_context);
    CHECK_STATUS(test_context, loxo_extension_create(test_context, &curve, settings, &extension), LOXO_ERR_ARGUMENT);
    CHECK(extension == NULL);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, element);
}

TEST(bad_curves_are_named)
{
    double *x = space_curve(6);
    double angle[6] = {0.0, 1.0, 2.0, 3.0, 4.0, 5.0};
    const loxo_curve good = {.n = 6, .d = 3, .x = x, .angle = angle};
    loxo_curve bad = good;
    loxo_extension_settings settings = loxo_extension_settings_default();
    CHECK_STATUS(test_context, loxo_extension_create(test_context, &good, NULL, NULL), LOXO_ERR_ARGUMENT);
    bad.n = 2;
    check_refused(bad, NULL, -1);
    bad = good;
    bad.x = NULL;
    check_refused(bad, NULL, -1);
    bad = good;
    bad.d = 1;
    check_refused(bad, NULL, -1);
    bad.d = 65;
    check_refused(bad, NULL, -1);
    static const double wrong[] = {2.0, 0.0, NAN, INFINITY};
    for (int i = 0; i < 4; ++i) {
        const double keep = x[9];
        x[9] = wrong[i];
        check_refused(good, NULL, 3);
        x[9] = keep;
    }
    const double keep[3] = {x[6], x[7], x[8]};
    for (int k = 0; k < 3; ++k)
        x[6 + k] = -x[3 + k];
    check_refused(good, NULL, 1);
    memcpy(x + 6, keep, sizeof keep);
    static const double angles[] = {1.0, 0.5, NAN, -INFINITY, 4.3, 1e9};
    for (int i = 0; i < 6; ++i) {
        angle[2] = angles[i];
        check_refused(good, NULL, 1);
    }
    angle[2] = 2.0;
    angle[5] = 6.5; /* beyond a turn */
    check_refused(good, NULL, 5);
    angle[5] = 5.0;
    settings.n_nodes = 8;
    check_refused(good, &settings, -1);
    settings = loxo_extension_settings_default();
    settings.tolerance = NAN;
    check_refused(good, &settings, -1);
    settings.tolerance = -1.0;
    check_refused(good, &settings, -1);
    loxo_release(test_context, x);
}

TEST(bad_points_are_named)
{
    double *x = space_curve(6), w[9];
    const loxo_curve curve = {.n = 6, .d = 3, .x = x};
    const loxo_extension_values values = {.w = w}, nowhere = {.w = NULL};
    loxo_extension *e;
    CHECK_OK(loxo_extension_create(test_context, &curve, NULL, &e));
    CHECK_OK(loxo_extension_evaluate(e, 0, NULL, NULL, NULL, NULL));
    CHECK_STATUS(test_context, loxo_extension_evaluate(e, -1, x, NULL, &values, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_extension_evaluate(e, 1, NULL, NULL, &values, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_extension_evaluate(e, 1, x, NULL, NULL, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_extension_evaluate(e, 1, x, NULL, &nowhere, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(NULL, loxo_extension_evaluate(NULL, 1, x, NULL, &values, NULL), LOXO_ERR_ARGUMENT);
    static const double wrong[][2] = {{1.01, 0.0}, {NAN, 0.0}, {0.0, INFINITY}, {0.0, -1e300}};
    for (int i = 0; i < 4; ++i) {
        const double z[6] = {0.0, 0.5, 0.1, 0.1, wrong[i][0], wrong[i][1]};
        CHECK_STATUS(test_context, loxo_extension_evaluate(e, 3, z, NULL, &values, NULL), LOXO_ERR_ARGUMENT);
        CHECK_EQUAL(loxo_context_failure(test_context)->element, 2);
    }
    static const double cos_wrong[] = {-0.1, 0.9, NAN};
    for (int i = 0; i < 3; ++i) {
        const double z[4] = {0.0, 0.0, 0.6, 0.0}, co[2] = {1.0, cos_wrong[i]};
        CHECK_STATUS(test_context, loxo_extension_evaluate(e, 2, z, co, &values, NULL), LOXO_ERR_ARGUMENT);
        CHECK_EQUAL(loxo_context_failure(test_context)->element, 1);
    }
    loxo_extension_destroy(e);
    loxo_extension_destroy(NULL);
    loxo_release(test_context, x);
}
