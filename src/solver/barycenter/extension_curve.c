/* SPDX-License-Identifier: MIT
 * A closed curve on the sphere, by samples: the linear map of each segment, and where the curve rests. */
#include "base/allocate.h"
#include "base/context.h"
#include "base/sort.h"
#include "kernel/ball_kernel.h"
#include "solver/barycenter/extension_internal.h"

#include <inttypes.h>
#include <string.h>

#define PI          3.14159265358979323846
#define OFF_SPHERE  1e-6
#define OPPOSITE    1e-12 /* 1 + <a, b> of neighbours below which no great arc joins them that could be told */
#define LONGEST_ARC (PI - 1e-6)
#define HALF        (0.5 - 1e-14) /* of the harmonic measure */

static loxo_status wrong(loxo_context *ctx, int64_t i, const char *what)
{
    return loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, (loxo_place){.byte = -1, .element = i},
                        "extension: sample %" PRId64 " %s", i, what);
}

static loxo_status copy_samples(loxo_context *ctx, const loxo_curve *given, double *sample)
{
    const int d = given->d;
    for (int64_t i = 0; i < given->n; ++i) {
        const double *x = given->x + i * d;
        const double norm = sqrt(k_ball_dot(d, x, x)), away = fabs(norm - 1.0);
        if (!(away <= OFF_SPHERE)) return wrong(ctx, i, "is not on the unit sphere within 1e-6");
        for (int k = 0; k < d; ++k)
            sample[i * d + k] = away <= 2.3e-16 ? x[k] : x[k] / norm;
    }
    for (int64_t i = 0; i < given->n; ++i) {
        const double *a = sample + i * d, *b = sample + (i + 1 < given->n ? i + 1 : 0) * d;
        if (!(1.0 + k_ball_dot(d, a, b) > OPPOSITE)) return wrong(ctx, i, "is opposite to the next one");
    }
    return LOXO_OK;
}

static loxo_status set_angles(loxo_context *ctx, const loxo_curve *given, extension_curve *c)
{
    const int64_t n = c->n;
    for (int64_t i = 0; i < n; ++i)
        c->angle[i] = given->angle == NULL ? 2.0 * PI * (double)i / (double)n : given->angle[i];
    c->angle[n] = c->angle[0] + 2.0 * PI;
    for (int64_t i = 0; i < n; ++i) {
        const double step = c->angle[i + 1] - c->angle[i];
        if (!(fabs(c->angle[i]) <= 1e3)) return wrong(ctx, i, "has an angle that is not within 1000");
        if (!(step > 0.0) || !(step < LONGEST_ARC))
            return wrong(ctx, i, "has an angle that is not below the next one by less than pi");
        c->on_circle[2 * i] = cos(c->angle[i]);
        c->on_circle[2 * i + 1] = sin(c->angle[i]);
    }
    return LOXO_OK;
}

/* The linear map that takes both points of the circle to both samples. */
static void set_row(const extension_curve *c, int64_t j, double *row)
{
    const int64_t next = j + 1 < c->n ? j + 1 : 0;
    const double *a = c->sample + j * c->d, *b = c->sample + next * c->d;
    const double step = c->angle[j + 1] - c->angle[j], cosine = cos(step), sine = sin(step);
    const double x = c->on_circle[2 * j], y = c->on_circle[2 * j + 1];
    for (int k = 0; k < c->d; ++k) {
        const double across =
            (b[k] - a[k] + (1.0 - cosine) * a[k]) / sine; /* of the direction at right angles, ahead */
        row[k] = x * a[k] - y * across;
        row[c->stride + k] = y * a[k] + x * across;
    }
}

static bool is_same(const extension_curve *c, int64_t i, int64_t j)
{
    for (int k = 0; k < c->d; ++k)
        if (c->sample[i * c->d + k] < c->sample[j * c->d + k] || c->sample[i * c->d + k] > c->sample[j * c->d + k])
            return false;
    return true;
}

/* By coordinates, then by place. */
static bool is_less(const void *arg, const void *a, const void *b)
{
    const extension_curve *c = arg;
    const extension_run *r = a, *s = b;
    const double *x = c->sample + r->first * c->d, *y = c->sample + s->first * c->d;
    for (int k = 0; k < c->d; ++k)
        if (x[k] < y[k] || x[k] > y[k]) return x[k] < y[k];
    return r->first < s->first;
}

static loxo_status find_runs(loxo_context *ctx, extension_curve *c)
{
    const int64_t n = c->n;
    int64_t start = 0, n_runs = 0, at = -1;
    while (start < n && is_same(c, start, start == 0 ? n - 1 : start - 1))
        ++start;
    for (int64_t i = 0; i < n; ++i)
        n_runs += is_same(c, i, i + 1 < n ? i + 1 : 0) && !is_same(c, i, i == 0 ? n - 1 : i - 1);
    if (start == n) n_runs = 1; /* one point */
    c->n_runs = c->n_groups = 0;
    if (n_runs == 0) return LOXO_OK;
    if ((c->runs = loxo_allocate(ctx, n_runs, sizeof *c->runs)) == NULL) return LOXO_ERR_MEMORY;
    if (start == n) {
        c->runs[0] = (extension_run){.n = n};
        c->n_runs = c->n_groups = 1;
        return LOXO_OK;
    }
    for (int64_t k = 0; k < n; ++k) {
        const int64_t i = start + k < n ? start + k : start + k - n;
        if (!is_same(c, i, i + 1 < n ? i + 1 : 0)) {
            at = -1;
            continue;
        }
        if (at < 0) {
            at = c->n_runs++;
            c->runs[at] = (extension_run){.first = i};
        }
        c->runs[at].n += 1;
    }
    loxo_sort(c->runs, c->n_runs, sizeof *c->runs, is_less, c);
    for (int64_t r = 0; r < c->n_runs; ++r) {
        c->n_groups += r == 0 || !is_same(c, c->runs[r].first, c->runs[r - 1].first);
        c->runs[r].group = c->n_groups - 1;
    }
    return LOXO_OK;
}

loxo_status extension_curve_create(loxo_context *ctx, const loxo_curve *given, extension_curve *c)
{
    const int64_t n = given->n;
    *c = (extension_curve){
        .n = n, .d = given->d, .stride = given->d < 4 ? 4 : given->d, .is_even = given->angle == NULL};
    c->sample = loxo_allocate(ctx, n * c->d, sizeof *c->sample);
    c->angle = loxo_allocate(ctx, n + 1, sizeof *c->angle);
    c->on_circle = loxo_allocate(ctx, 2 * n, sizeof *c->on_circle);
    c->row = loxo_allocate_zero(ctx, 2 * n * c->stride, sizeof *c->row);
    if (c->sample == NULL || c->angle == NULL || c->on_circle == NULL || c->row == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = copy_samples(ctx, given, c->sample);
    if (status >= 0) status = set_angles(ctx, given, c);
    if (status >= 0) status = find_runs(ctx, c);
    for (int64_t j = 0; j < n && status >= 0; ++j)
        set_row(c, j, c->row + 2 * j * c->stride);
    return status;
}

void extension_curve_destroy(loxo_context *ctx, extension_curve *c)
{
    loxo_release(ctx, c->sample);
    loxo_release(ctx, c->angle);
    loxo_release(ctx, c->on_circle);
    loxo_release(ctx, c->row);
    loxo_release(ctx, c->runs);
}

/* a x b */
static double cross(const double a[2], const double b[2]) { return a[0] * b[1] - a[1] * b[0]; }

int64_t extension_segment_at(const extension_curve *c, const double direction[2])
{
    const int64_t n = c->n;
    double angle = atan2(direction[1], direction[0]);
    while (angle < c->angle[0])
        angle += 2.0 * PI;
    while (angle >= c->angle[n])
        angle -= 2.0 * PI;
    int64_t low = 0, high = n; /* angle[low] <= angle < angle[high] but for rounding */
    while (high - low > 1) {
        const int64_t middle = low + (high - low) / 2;
        if (angle < c->angle[middle])
            high = middle;
        else
            low = middle;
    }
    /* rounding of angles: the samples' own points decide */
    const int64_t next = low + 1 < n ? low + 1 : 0;
    if (cross(c->on_circle + 2 * low, direction) < 0.0 && c->angle[low + 1] - angle > angle - c->angle[low])
        return low > 0 ? low - 1 : n - 1;
    if (cross(c->on_circle + 2 * next, direction) >= 0.0 && c->angle[low + 1] - angle < angle - c->angle[low])
        return next;
    return low;
}

void extension_curve_at(const extension_curve *c, const double direction[2], double *x)
{
    const int64_t j = extension_segment_at(c, direction);
    const double *row = c->row + 2 * j * c->stride, *own = c->on_circle + 2 * j;
    if (cross(own, direction) == 0.0 || is_same(c, j, j + 1 < c->n ? j + 1 : 0)) { /* that sample, to the bit */
        memcpy(x, c->sample + j * c->d, (size_t)c->d * sizeof *x);
        return;
    }
    double square = 0.0;
    for (int k = 0; k < c->d; ++k) {
        x[k] = direction[0] * row[k] + direction[1] * row[c->stride + k];
        square += x[k] * x[k];
    }
    const double inverse = 1.0 / sqrt(square);
    for (int k = 0; k < c->d; ++k)
        x[k] *= inverse;
}

/* psi / 2 of the node that z moves to an angle tau from its own direction: tan(psi / 2) = tan(tau / 2) / beta; from -pi / 2 to pi / 2. */
static double half_angle_before(double tau, double beta)
{
    const double half = 0.5 * remainder(tau, 2.0 * PI);
    return atan2(sin(half), beta * cos(half));
}

int64_t extension_find_resting(const extension_curve *c, const double direction[2], double beta, double *mass)
{
    const double own = atan2(direction[1], direction[0]);
    memset(mass, 0, (size_t)c->n_groups * sizeof *mass);
    for (int64_t r = 0; r < c->n_runs; ++r) {
        const int64_t first = c->runs[r].first, last = first + c->runs[r].n;
        if (c->runs[r].n == c->n) return first;
        const double begin = half_angle_before(c->angle[first] - own, beta);
        const double end =
            half_angle_before((last <= c->n ? c->angle[last] : c->angle[last - c->n] + 2.0 * PI) - own, beta);
        const double share = (end - begin) / PI;
        double *m = &mass[c->runs[r].group];
        *m += share < 0.0 ? share + 1.0 : share;
        if (*m >= HALF) return first;
    }
    return -1;
}
