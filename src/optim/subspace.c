/* SPDX-License-Identifier: MIT
 * A trust region of two dimensions. */
#include "optim/subspace.h"

#include "base/allocate.h"
#include "par/range.h"

#include <math.h>
#include <string.h>

#define N_VECTORS 6

/* ---- the plane's problem ------------------------------------------------------------------------------------- */

/* Where the minimum lies on the circle, (H + mu) y = -g with mu >= -lambda of the least eigenvalue, and |y| falls with mu: Newton on
 * 1/|y|, which is nearly linear in mu (Reinsch 1971), halving where it leaves what is known. lambda ascends; c: g along the eigenvectors. */
static void find_on_circle(const double lambda[2], const double c[2], double radius, double z[2])
{
    const double least = fmax(0.0, -lambda[0]), apart = lambda[1] + least, size = hypot(c[0], c[1]);
    double low = 0.0, high = size / radius, t = high; /* mu = least + t */
    /* No part of g along the lowest eigenvector: the circle is reached along that one, either way. */
    if (lambda[0] <= 0.0 && fabs(c[0]) <= 1e-14 * size && (size == 0.0 || fabs(c[1]) <= radius * apart)) {
        z[1] = apart > 0.0 ? -c[1] / apart : 0.0;
        z[0] = copysign(sqrt(fmax(0.0, radius * radius - z[1] * z[1])), -c[0]);
        return;
    }
    for (int i = 0; i < 200 && low < high; ++i) {
        const double d[2] = {lambda[0] + least + t, apart + t};
        z[0] = -c[0] / d[0];
        z[1] = -c[1] / d[1];
        const double norm = hypot(z[0], z[1]);
        if (fabs(norm - radius) <= 1e-14 * radius) break;
        if (norm > radius)
            low = t;
        else
            high = t;
        const double slope = z[0] * z[0] / d[0] + z[1] * z[1] / d[1];
        t += norm * norm / slope * (norm / radius - 1.0);
        if (!(t > low && t < high)) t = 0.5 * (low + high);
    }
    const double scale = radius / hypot(z[0], z[1]);
    z[0] *= scale;
    z[1] *= scale;
}

double loxo_disk_minimize(const double h[3], const double g[2], double radius, double y[2])
{
    const double mean = 0.5 * (h[0] + h[2]), off = hypot(0.5 * (h[0] - h[2]), h[1]);
    const double angle = 0.5 * atan2(2.0 * h[1], h[0] - h[2]), cosine = cos(angle), sine = sin(angle);
    const double lambda[2] = {mean - off, mean + off};
    const double c[2] = {cosine * g[1] - sine * g[0], cosine * g[0] + sine * g[1]};
    double z[2] = {-c[0] / lambda[0], -c[1] / lambda[1]};
    if (!(lambda[0] > 0.0 && hypot(z[0], z[1]) <= radius)) find_on_circle(lambda, c, radius, z);
    y[0] = cosine * z[1] - sine * z[0];
    y[1] = cosine * z[0] + sine * z[1];
    return -(c[0] * z[0] + c[1] * z[1] + 0.5 * (lambda[0] * z[0] * z[0] + lambda[1] * z[1] * z[1]));
}

/* ---- vectors ------------------------------------------------------------------------------------------------- */

typedef struct plane_vectors {
    const double *g, *s, *hg, *hs; /* s and hs NULL: no Newton step */
} plane_vectors;

/* sums: g.g, g.Hg, s.s, s.g, s.Hg, s.Hs */
static void add_products(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const plane_vectors *v = arg;
    double sum[6] = {0.0};
    for (int64_t i = begin; i < end; ++i) {
        sum[0] += v->g[i] * v->g[i];
        sum[1] += v->g[i] * v->hg[i];
        if (v->s == NULL) continue;
        sum[2] += v->s[i] * v->s[i];
        sum[3] += v->s[i] * v->g[i];
        sum[4] += v->s[i] * v->hg[i];
        sum[5] += v->s[i] * v->hs[i];
    }
    for (int k = 0; k < 6; ++k)
        sums[k] += sum[k];
}

static double largest_of(int64_t n, const double *g)
{
    double most = 0.0;
    for (int64_t i = 0; i < n; ++i) {
        if (!isfinite(g[i])) return (double)NAN;
        most = fmax(most, fabs(g[i]));
    }
    return most;
}

/* to = x + a s + b g */
static void step_to(loxo_context *ctx, int64_t n, const double *x, double a, const double *s, double b, const double *g,
                    double *to)
{
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 2.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i)
            to[i] = x[i] + (a != 0.0 ? a * s[i] : 0.0) + b * g[i];
    }
}

/* ---- the model around a point, in an orthonormal basis of the plane --------------------------------------------------- */

/* The basis: q1 = s / |s| and q2 = (g - (g . q1) q1) / rest; q1 = g / |g| alone where there is no s, s alone where g lies along it. */
typedef struct plane_model {
    bool has_newton, is_line;
    double length;      /* of what q1 is made of */
    double along, rest; /* g . q1, g . q2 */
    double h[3], g[2];  /* H and g in the basis */
} plane_model;

/* Less than this of |g|^2 beside the Newton step is rounding. */
#define LEAST_ANGLE 1e-10

static loxo_status build_model(const loxo_subspace_problem *p, const plane_vectors *v, plane_model *m)
{
    double sum[6];
    const loxo_status status = loxo_sum(p->ctx, p->n, 6, add_products, v, sum);
    if (status < 0) return status;
    *m = (plane_model){.has_newton = v->s != NULL && sum[2] > 0.0 && isfinite(sum[2]) && isfinite(sum[5])};
    if (!m->has_newton) {
        m->is_line = true;
        m->length = m->along = sqrt(sum[0]);
        m->h[0] = sum[1] / sum[0];
    } else {
        m->length = sqrt(sum[2]);
        m->along = sum[3] / m->length;
        const double square = sum[0] - m->along * m->along;
        const double q_hg = sum[4] / m->length; /* q1 . H g */
        m->h[0] = sum[5] / sum[2];
        m->is_line = !(square > LEAST_ANGLE * sum[0]);
        if (!m->is_line) {
            m->rest = sqrt(square);
            m->h[1] = (q_hg - m->along * m->h[0]) / m->rest;
            m->h[2] = (sum[1] - 2.0 * m->along * q_hg + m->along * m->along * m->h[0]) / square;
        }
    }
    m->g[0] = m->along;
    m->g[1] = m->rest;
    return LOXO_OK;
}

/* A step of at most that length: a s + b g, and how much the model falls. */
static double choose_step(const plane_model *m, double radius, double *a, double *b, double *length)
{
    double y[2];
    double fall;
    if (m->is_line) { /* not by the plane's way, which would take any second direction for a real one */
        const double newton = m->h[0] > 0.0 ? -m->g[0] / m->h[0] : -copysign(radius, m->g[0]);
        y[0] = fmax(-radius, fmin(radius, newton));
        y[1] = 0.0;
        fall = -y[0] * (m->g[0] + 0.5 * m->h[0] * y[0]);
    } else {
        fall = loxo_disk_minimize(m->h, m->g, radius, y);
    }
    *length = hypot(y[0], y[1]);
    if (!m->has_newton) {
        *a = 0.0;
        *b = y[0] / m->length;
    } else {
        *b = m->is_line ? 0.0 : y[1] / m->rest;
        *a = (y[0] - *b * m->along) / m->length;
    }
    return fall;
}

/* ---- steps --------------------------------------------------------------------------------------------------- */

static bool tell(const loxo_subspace_problem *p, const loxo_subspace_settings *settings, const loxo_subspace_info *info)
{
    const double most = (double)settings->max_iterations;
    const loxo_progress progress = {.phase = settings->phase,
                                    .fraction = most > 0.0 ? (double)info->n_iterations / most : 1.0,
                                    .iteration = info->n_iterations,
                                    .n_iterations = settings->max_iterations,
                                    .objective = info->value,
                                    .residual = info->move,
                                    .gradient_norm = info->gradient_norm,
                                    .radius = info->radius};
    return loxo_progress_tell(p->ctx, &progress, true);
}

/* Newton's step and the products that the model needs. */
static loxo_status find_plane(const loxo_subspace_problem *p, const double *g, double *s, double *hg, double *hs,
                              plane_model *model)
{
    plane_vectors v = {.g = g, .hg = hg};
    loxo_status status = p->newton(p->state, g, s);
    if (status < 0) return status;
    if (status == LOXO_OK) {
        v.s = s;
        v.hs = hs;
        if ((status = p->hessian_times(p->state, s, hs)) < 0) return status;
    }
    if ((status = p->hessian_times(p->state, g, hg)) < 0) return status;
    return build_model(p, &v, model);
}

/* Whether there is nothing more to do at a point just reached, whose gradient is known. is_free: by a step that the radius did not cut
 * short; is_stuck: the value tells nothing any more, and the gradient does not fall either. */
static bool is_done(const loxo_subspace_problem *p, const loxo_subspace_settings *settings, bool is_free, bool is_stuck,
                    loxo_subspace_info *info)
{
    const bool is_stopped = tell(p, settings, info);
    if ((is_free && info->move <= settings->tolerance) || info->gradient_norm == 0.0)
        info->stop_reason = LOXO_SUBSPACE_TOLERANCE;
    else if (is_stuck)
        info->stop_reason = LOXO_SUBSPACE_ROUNDING;
    else if (is_stopped)
        info->stop_reason = LOXO_SUBSPACE_MONITOR;
    else
        return false;
    return true;
}

loxo_status loxo_subspace_minimize(const loxo_subspace_problem *p, const loxo_subspace_settings *settings, double *x,
                                   loxo_subspace_info *info)
{
    loxo_context *ctx = p->ctx;
    const int64_t n = p->n;
    const size_t bytes = (size_t)n * sizeof(double);
    plane_model model = {0};
    double rounding = 0.0, a, b, length;
    bool is_new = true, is_free = false, at_rounding = false;
    *info = (loxo_subspace_info){.move = HUGE_VAL, .radius = settings->radius, .n_evaluations = 1};
    double *work = loxo_allocate(ctx, n, N_VECTORS * sizeof *work);
    if (work == NULL) return LOXO_ERR_MEMORY;
    double *g = work, *s = g + n, *hg = s + n, *hs = hg + n, *at = hs + n, *to = at + n;
    memcpy(at, x, bytes);
    loxo_status status = p->value(p->state, at, &info->value, &rounding);
    if (status >= 0 && !isfinite(info->value))
        status = loxo_fail(ctx, LOXO_ERR_NUMERIC, "%s: the value at the start is not finite", settings->phase);
    while (status >= 0) {
        if (is_new) {
            if ((status = p->derivatives(p->state, at, g)) < 0) break;
            const double before = info->gradient_norm;
            info->gradient_norm = largest_of(n, g);
            if (!isfinite(info->gradient_norm)) {
                status = loxo_fail(ctx, LOXO_ERR_NUMERIC, "%s: the gradient is not finite at step %lld",
                                   settings->phase, (long long)info->n_iterations);
                break;
            }
            const bool is_stuck = at_rounding && info->gradient_norm > 0.5 * before;
            if (is_done(p, settings, is_free, is_stuck, info)) break;
        }
        if (info->n_iterations >= settings->max_iterations) {
            info->stop_reason = LOXO_SUBSPACE_MAX_ITERATIONS;
            break;
        }
        if (is_new && (status = find_plane(p, g, s, hg, hs, &model)) < 0) break;
        if (!is_new && tell(p, settings, info)) {
            info->stop_reason = LOXO_SUBSPACE_MONITOR;
            break;
        }
        double value, error;
        const double fall = choose_step(&model, info->radius, &a, &b, &length);
        is_free = length < 0.99 * info->radius;
        step_to(ctx, n, at, a, s, b, g, to);
        ++info->n_iterations;
        ++info->n_evaluations;
        if ((status = p->value(p->state, to, &value, &error)) < 0) break;
        at_rounding = !(fall > fmax(error, rounding));
        const double ratio = (info->value - value) / fall; /* a value that is not finite makes it that */
        is_new = at_rounding ? value <= info->value + error : value < info->value;
        if (at_rounding && !is_new) {
            info->stop_reason = LOXO_SUBSPACE_ROUNDING;
            break;
        }
        if (!at_rounding && !(ratio >= 0.25))
            info->radius = 0.5 * length;
        else if (!at_rounding && ratio > 0.75)
            info->radius = fmax(info->radius, 2.0 * length);
        if (!is_new) continue;
        if ((status = p->move(p->state, at, to, &info->move)) < 0) break;
        ++info->n_taken;
        info->value = value;
        rounding = error;
        memcpy(at, to, bytes);
    }
    memcpy(x, at, bytes);
    loxo_release(ctx, work);
    return status;
}
