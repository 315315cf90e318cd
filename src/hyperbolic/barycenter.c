/* SPDX-License-Identifier: MIT
 * The search. A step is made as seen from the present point, where the atoms' mean m and second moment M give F = m / 2 and
 * A = -grad F = 1 - M. Near the sphere the atoms themselves are shifted, and the search goes on from the centre: so what is left of m is
 * rounding of numbers near 1, however near the sphere the barycenter is. */
#include "base/allocate.h"
#include "base/context.h"
#include "hyperbolic/hyperbolic.h"
#include "kernel/ball_kernel.h"
#include "par/range.h"

#include <string.h>

#define EPS         2.3e-16
#define NOISE       (4.0 * EPS)  /* of a mean of unit vectors, as it is computed */
#define LOST        (8.0 * EPS)  /* of a distance, over 1 - |w| */
#define NEAR_SPHERE (16.0 * EPS) /* 1 - |w|^2 below which a point cannot be told from the sphere */
#define FULL_STEP   0.25         /* |u| below which full steps descend, README.md */
#define ARMIJO      1e-4
#define WOLFE       0.9
#define MOST_TRIALS 60

typedef struct search {
    loxo_context *ctx;
    const hyper_settings *settings;
    const hyper_atoms *given;
    hyper_atoms atoms;                   /* as they are carried */
    double *carried;                     /* [n][d]; NULL: where the caller has them */
    double w[HYPER_MOST_DIMENSIONS], co; /* the present point, seen from where the atoms were carried to */
    const hyper_moments *first;          /* of the first look, where it has been taken */
    hyper_moments moments;
    double a[HYPER_MOST_DIMENSIONS * HYPER_MOST_DIMENSIONS], vector[HYPER_MOST_DIMENSIONS * HYPER_MOST_DIMENSIONS];
    double value[HYPER_MOST_DIMENSIONS];
    double residual, noise;
    hyper_result *out;
} search;

hyper_settings hyper_settings_default(void)
{
    return (hyper_settings){
        .method = HYPER_DAMPED, .tolerance = 0.0, .max_iterations = 100, .regularization = 1.0, .carry = 0.05};
}

static double norm(int d, const double *a) { return sqrt(k_ball_dot(d, a, a)); }

/* Moments and eigenvalues at the present point. */
static loxo_status look(search *s)
{
    const int d = s->atoms.d;
    if (s->first != NULL) {
        memcpy(s->moments.mean, s->first->mean, (size_t)d * sizeof(double));
        memcpy(s->moments.second, s->first->second, (size_t)d * (size_t)(d + 1) / 2 * sizeof(double));
        s->first = NULL;
    } else {
        const loxo_status status = hyper_find_moments(s->ctx, &s->atoms, s->w, s->co, &s->moments);
        if (status < 0) return status;
    }
    const double *row = s->moments.second;
    for (int i = 0; i < d; ++i)
        for (int j = i; j < d; ++j) {
            const double m = *row++;
            s->a[i * d + j] = s->a[j * d + i] = (i == j ? 1.0 : 0.0) - m;
        }
    hyper_eigen(d, s->a, s->value, s->vector);
    s->residual = norm(d, s->moments.mean);
    s->noise = NOISE / k_ball_gap(s->co);
    return LOXO_OK;
}

/* u = (A + shift)^-1 m / 2; returns |u|. */
static double solve(const search *s, double shift, double *u)
{
    const int d = s->atoms.d;
    memset(u, 0, (size_t)d * sizeof *u);
    for (int i = 0; i < d; ++i) {
        const double *v = s->vector + (ptrdiff_t)i * d, value = (s->value[i] > EPS ? s->value[i] : EPS) + shift;
        const double c = 0.5 * k_ball_dot(d, v, s->moments.mean) / value;
        for (int k = 0; k < d; ++k)
            u[k] += c * v[k];
    }
    return norm(d, u);
}

/* Puts z, from the direction of u and the length of the step in the ball, given as r and 1 - r^2. */
static double put(int d, const double *u, double length, double r, double co, double *z)
{
    for (int k = 0; k < d; ++k)
        z[k] = length > 0.0 ? u[k] * (r / length) : 0.0;
    return length > 0.0 ? co : 1.0;
}

/* exp_0(t u) = tanh(|t u|) of its direction. */
static double exponential(int d, const double *u, double length, double t, double *z)
{
    const double r = tanh(t * length), c = cosh(t * length);
    return put(d, u, length, r, 1.0 / (c * c), z);
}

/* README.md, «A step that always descends»: s = sqrt(1 + 4 |u|), r = (s - 1) / (s + 1), 1 - r^2 = 4 s / (s + 1)^2. */
static double damped(int d, const double *u, double length, double *z)
{
    const double s = sqrt(1.0 + 4.0 * length);
    return put(d, u, length, 4.0 * length / ((s + 1.0) * (s + 1.0)), 4.0 * s / ((s + 1.0) * (s + 1.0)), z);
}

/* Sum over a block: of p log(|x - z|^2 / co), (25). */
typedef struct potential_arg {
    const hyper_atoms *atoms;
    const double *z;
    double co;
} potential_arg;

static void partial_potential(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const potential_arg *a = arg;
    const int d = a->atoms->d;
    for (int64_t i = begin; i < end; ++i) {
        double square = 0.0;
        for (int k = 0; k < d; ++k) {
            const double e = a->atoms->x[i * d + k] - a->z[k];
            square += e * e;
        }
        const double p = a->atoms->weight == NULL ? 1.0 : a->atoms->weight[i];
        sums[0] += p * log(square / a->co);
        sums[1] += p;
    }
}

/* The step (30) with (31), (32) along exp_0(t u), by halving and doubling, from atoms that stand around the present point. */
static loxo_status search_line(search *s, const double *u, double length, double *z, double *co)
{
    const int d = s->atoms.d;
    const double slope = -2.0 * k_ball_dot(d, s->moments.mean, u);
    double low = 0.0, high = HUGE_VAL, t = 1.0;
    for (int trial = 0; trial < MOST_TRIALS; ++trial) {
        double sums[2] = {0.0, 0.0};
        hyper_moments there;
        *co = exponential(d, u, length, t, z);
        const potential_arg arg = {&s->atoms, z, *co};
        loxo_status status = loxo_sum(s->ctx, s->atoms.n, 2, partial_potential, &arg, sums);
        if (status >= 0) status = hyper_find_moments(s->ctx, &s->atoms, z, *co, &there);
        if (status < 0) return status;
        if (!(sums[0] / sums[1] <= ARMIJO * t * slope))
            high = t;
        else if (-2.0 * k_ball_dot(d, there.mean, u) < WOLFE * slope)
            low = t;
        else
            return LOXO_OK;
        t = high < HUGE_VAL ? 0.5 * (low + high) : 2.0 * t;
    }
    return LOXO_OK; /* rounding: the last trial */
}

/* (17): full steps converge, quadratically from the first. */
static bool is_certain(const search *s) { return 4.0 * s->residual < s->value[0] * s->value[0]; }

/* The next point z as seen from the present one. */
static loxo_status find_step(search *s, double *z, double *co)
{
    const int d = s->atoms.d;
    double u[HYPER_MOST_DIMENSIONS];
    if (s->settings->method == HYPER_ABIKOFF_YE) {
        *co = put(d, s->moments.mean, s->residual, s->residual, (1.0 - s->residual) * (1.0 + s->residual), z);
        return LOXO_OK;
    }
    const bool is_regular = s->settings->method == HYPER_REGULARIZED && !is_certain(s);
    const double shift = is_regular ? s->settings->regularization * s->residual * s->residual : 0.0;
    const double length = solve(s, shift, u);
    if (s->settings->method == HYPER_DAMPED && length > FULL_STEP) {
        *co = damped(d, u, length, z);
        return LOXO_OK;
    }
    if (is_regular) return search_line(s, u, length, z, co);
    *co = exponential(d, u, length, 1.0, z);
    return LOXO_OK;
}

/* Where z, as seen from where the atoms were carried to, is seen from where the caller has them; its co. */
static double see_from_outside(const hyper_result *r, int d, const double *z, double co, double *out)
{
    memmove(out, z, (size_t)d * sizeof *z);
    for (int i = r->n_shifts; i-- > 0;)
        co = k_ball_compose(d, r->shift[i], r->shift_co[i], out, co, out);
    return co;
}

static void note_shift(hyper_result *out, int d, const double *w, double co)
{
    memcpy(out->shift[out->n_shifts], w, (size_t)d * sizeof *w);
    out->shift_co[out->n_shifts++] = co;
}

/* Shifts the atoms, so that the present point is the centre. After many shifts (of the slow methods) one from the beginning. */
static loxo_status carry(search *s)
{
    hyper_result *out = s->out;
    const int d = s->atoms.d;
    const bool is_first = s->carried == NULL;
    if (is_first && (s->carried = loxo_allocate(s->ctx, s->atoms.n * d, sizeof *s->carried)) == NULL)
        return LOXO_ERR_MEMORY;
    if (out->n_shifts == HYPER_MOST_SHIFTS - 1) {
        s->co = see_from_outside(out, d, s->w, s->co, s->w);
        s->atoms = *s->given;
        out->n_shifts = 0;
    }
    hyper_shift_atoms(s->ctx, &s->atoms, s->w, s->co, s->carried);
    s->atoms.x = s->carried;
    s->atoms.x_float = NULL;
    s->atoms.is_unit = true;
    note_shift(out, d, s->w, s->co);
    memset(s->w, 0, sizeof s->w);
    s->co = 1.0;
    return LOXO_OK;
}

/* The result as of the present point. */
static void note(search *s)
{
    hyper_result *out = s->out;
    out->co = see_from_outside(out, s->atoms.d, s->w, s->co, out->w);
    out->residual = s->residual;
    out->lambda = s->value[0];
    out->q = s->value[0] > 0.0 ? 4.0 * s->residual / (s->value[0] * s->value[0]) : HUGE_VAL;
    out->frame_bound = hyper_certificate(s->residual + s->noise, s->value[0] - 8.0 * EPS);
    out->bound = out->frame_bound + LOST / k_ball_gap(out->co);
}

/* No barycenter, or many: what is known of it. */
static loxo_status tell_class(search *s)
{
    hyper_result *out = s->out;
    const int d = s->atoms.d;
    out->stop = HYPER_STOP_IDEAL;
    out->bound = out->frame_bound = HUGE_VAL;
    if (out->kind == HYPER_NONE) {
        out->co = 0.0;
        return LOXO_CHECK_FAILED;
    }
    /* the point of the geodesic that is nearest to the centre: at (1 - sin) / cos of half the angle between its ends */
    double sum = 0.0, apart = 0.0;
    for (int k = 0; k < d; ++k) {
        const double e = out->w[k], f = out->other[k];
        sum += 0.25 * (e + f) * (e + f);
        apart += 0.25 * (e - f) * (e - f);
    }
    memcpy(out->shift[0], out->w, (size_t)d * sizeof *out->w);
    const double c = sqrt(sum), r = c > 0.0 ? c / (1.0 + sqrt(apart)) : 0.0;
    for (int k = 0; k < d; ++k)
        out->w[k] = c > 0.0 ? 0.5 * (out->shift[0][k] + out->other[k]) * (r / c) : 0.0;
    out->co = (1.0 - r) * (1.0 + r);
    return LOXO_CHECK_FAILED;
}

/* Whether the search is over: sets stop. previous: residual of the step before. */
static bool is_over(search *s, double previous)
{
    hyper_result *out = s->out;
    const double tolerance = s->settings->tolerance;
    if (tolerance > 0.0 && out->bound <= tolerance) {
        out->stop = HYPER_STOP_BOUND;
        return true;
    }
    const bool is_rounding = s->residual <= 2.0 * s->noise ||
                             (out->frame_bound < 0.5 && s->residual > 0.5 * previous && s->residual <= 64.0 * s->noise);
    if (is_rounding && !(s->co < 1.0 && k_ball_gap(s->co) < s->settings->carry)) {
        out->stop = HYPER_STOP_ROUNDING;
        return true;
    }
    return false;
}

/* A last step that is not looked at: what was left when a look could tell no more. The bound of the point before holds for both ends of it. */
static void step_blindly(search *s)
{
    const int d = s->atoms.d;
    double u[HYPER_MOST_DIMENSIONS], z[HYPER_MOST_DIMENSIONS];
    if (!(s->out->frame_bound < 1e-3)) return;
    const double length = solve(s, 0.0, u), co = exponential(d, u, length, 1.0, z);
    s->co = k_ball_compose(d, s->w, s->co, z, co, s->w);
    s->out->co = see_from_outside(s->out, d, s->w, s->co, s->out->w);
}

static loxo_status run(search *s)
{
    hyper_result *out = s->out;
    const bool always = s->settings->method != HYPER_DAMPED; /* (34) to (36), and atoms as the line search wants them */
    double previous = HUGE_VAL, z[HYPER_MOST_DIMENSIONS], co;
    const int d = s->atoms.d;
    for (;; ++out->n_iterations) {
        loxo_status status = look(s);
        if (status < 0) return status;
        note(s);
        if (out->n_iterations == 0 && !(out->frame_bound < HUGE_VAL)) {
            out->kind = hyper_classify(&s->atoms, out->w, out->other);
            if (out->kind != HYPER_STABLE) return tell_class(s);
            memset(out->w, 0, sizeof out->w);
        }
        if (is_over(s, previous)) break;
        if (out->n_iterations == s->settings->max_iterations) {
            out->stop = HYPER_STOP_ITERATIONS;
            return LOXO_NOT_CONVERGED;
        }
        if (loxo_stop_wanted(s->ctx, "barycenter", 0.0)) {
            out->stop = HYPER_STOP_MONITOR;
            return LOXO_STOPPED;
        }
        previous = s->residual;
        if (out->n_iterations == 0 && s->settings->method == HYPER_REGULARIZED) /* begins at the centre of mass */
            co = put(d, s->moments.mean, s->residual, s->residual, (1.0 - s->residual) * (1.0 + s->residual), z);
        else if ((status = find_step(s, z, &co)) < 0)
            return status;
        s->co = k_ball_compose(d, s->w, s->co, z, co, s->w);
        if (see_from_outside(out, d, s->w, s->co, z) <
            NEAR_SPHERE) { /* points too near to each other to be told apart: as if they were one */
            out->stop = HYPER_STOP_ROUNDING;
            return LOXO_NOT_CONVERGED;
        }
        if ((always || k_ball_gap(s->co) < s->settings->carry) && (status = carry(s)) < 0) return status;
    }
    if (out->stop == HYPER_STOP_ROUNDING) step_blindly(s);
    return out->stop == HYPER_STOP_ROUNDING && s->settings->tolerance > 0.0 ? LOXO_NOT_CONVERGED : LOXO_OK;
}

loxo_status hyper_barycenter(loxo_context *ctx, const hyper_atoms *atoms, const hyper_moments *first,
                             const hyper_settings *settings, hyper_result *out)
{
    search *s = loxo_allocate_zero(ctx, 1, sizeof *s);
    if (s == NULL) return LOXO_ERR_MEMORY;
    memset(out, 0, sizeof *out);
    *s = (search){
        .ctx = ctx, .settings = settings, .given = atoms, .atoms = *atoms, .co = 1.0, .first = first, .out = out};
    out->co = 1.0;
    out->kind = HYPER_STABLE;
    const loxo_status status = run(s);
    if (status >= 0 && out->kind == HYPER_STABLE && s->co < 1.0)
        note_shift(out, atoms->d, s->w, s->co); /* what is left to shift */
    loxo_release(ctx, s->carried);
    loxo_release(ctx, s);
    return status;
}
