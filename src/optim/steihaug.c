/* SPDX-License-Identifier: MIT
 * Conjugate gradients inside a trust region. */
#include "optim/steihaug.h"

#include "par/range.h"

#include <math.h>
#include <string.h>

typedef struct two_vectors {
    const double *a, *b;
} two_vectors;

static void add_dot(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const two_vectors *v = arg;
    double sum[4] = {0.0, 0.0, 0.0, 0.0};
    int64_t i = begin;
    for (; i + 4 <= end; i += 4)
        for (int k = 0; k < 4; ++k)
            sum[k] += v->a[i + k] * v->b[i + k];
    for (; i < end; ++i)
        sum[0] += v->a[i] * v->b[i];
    sums[0] += (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

loxo_status loxo_dot(loxo_context *ctx, int64_t n, const double *a, const double *b, double *dot)
{
    const two_vectors v = {.a = a, .b = b};
    return loxo_sum(ctx, n, 1, add_dot, &v, dot);
}

/* y <- y + a x; the second pair likewise where x2 is not NULL. */
static void add_both(loxo_context *ctx, int64_t n, double a, const double *x, double *y, const double *x2, double *y2)
{
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 1.5))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i)
            y[i] += a * x[i];
        for (int64_t i = r.begin; i < r.end && x2 != NULL; ++i)
            y2[i] += a * x2[i];
    }
}

/* p <- b p - z */
static void turn(loxo_context *ctx, int64_t n, double b, const double *z, double *p)
{
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 1.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i)
            p[i] = b * p[i] - z[i];
    }
}

loxo_status loxo_steihaug(const loxo_quadratic *q, const double *g, const loxo_steihaug_settings *settings,
                          double *work, double *d, loxo_steihaug_info *info)
{
    const double radius = settings->radius, floor = settings->floor;
    loxo_context *ctx = q->ctx;
    const int64_t n = q->n;
    double *r = work, *z = work + n, *p = work + 2 * n, *hp = work + 3 * n;
    double rz, dd = 0.0, dp = 0.0; /* d . M^-1 d, d . M^-1 p */
    *info = (loxo_steihaug_info){.stop_reason = LOXO_STEIHAUG_MAX_ITERATIONS};
    memset(d, 0, (size_t)n * sizeof *d);
    memset(p, 0, (size_t)n * sizeof *p);
    memcpy(r, g, (size_t)n * sizeof *r);
    q->precondition(q->state, r, z);
    turn(ctx, n, 0.0, z, p);
    loxo_status status = loxo_dot(ctx, n, r, z, &rz);
    if (status < 0) return status;
    if (!(rz >= 0.0) || !isfinite(rz))
        return loxo_fail(ctx, LOXO_ERR_NUMERIC, "trust region: the gradient is not finite");
    double share = settings->tolerance;
    if (settings->unit > 0.0) share = fmin(share, sqrt(rz) / settings->unit);
    const double enough = fmax(share * share * rz, floor * floor);
    double pp = rz; /* p . M^-1 p */
    info->gradient_norm = sqrt(rz);
    if (rz <= floor * floor) {
        info->stop_reason = LOXO_STEIHAUG_TOLERANCE;
        return LOXO_OK;
    }
    while (info->n_iterations < settings->max_iterations) {
        double curvature;
        if (loxo_stop_wanted(ctx, "map", -1.0)) {
            info->stop_reason = LOXO_STEIHAUG_MONITOR;
            break;
        }
        if ((status = q->hessian_times(q->state, p, hp)) < 0) return status;
        if ((status = loxo_dot(ctx, n, p, hp, &curvature)) < 0) return status;
        if (!isfinite(curvature)) return loxo_fail(ctx, LOXO_ERR_NUMERIC, "trust region: a product is not finite");
        ++info->n_iterations;
        const double step = curvature > 0.0 ? rz / curvature : HUGE_VAL;
        const double next = curvature > 0.0 ? dd + step * (2.0 * dp + step * pp) : HUGE_VAL;
        if (!(curvature > 0.0) && isinf(radius)) {
            info->stop_reason = LOXO_STEIHAUG_CURVATURE;
            break;
        }
        if (!(next < radius * radius)) {
            const double room = fmax(radius * radius - dd, 0.0);
            const double to_border = room / (dp + sqrt(dp * dp + pp * room));
            add_both(ctx, n, to_border, p, d, NULL, NULL);
            info->fall += to_border * (rz - 0.5 * to_border * curvature);
            info->stop_reason = curvature > 0.0 ? LOXO_STEIHAUG_RADIUS : LOXO_STEIHAUG_CURVATURE;
            dd = radius * radius;
            break;
        }
        add_both(ctx, n, step, p, d, hp, r);
        info->fall += 0.5 * step * rz;
        dd = next;
        q->precondition(q->state, r, z);
        const double before = rz;
        if ((status = loxo_dot(ctx, n, r, z, &rz)) < 0) return status;
        if (!isfinite(rz)) return loxo_fail(ctx, LOXO_ERR_NUMERIC, "trust region: a residual is not finite");
        if (rz <= enough) {
            info->stop_reason = LOXO_STEIHAUG_TOLERANCE;
            break;
        }
        const double beta = rz / before;
        turn(ctx, n, beta, z, p);
        dp = beta * (dp + step * pp);
        pp = rz + beta * beta * pp;
    }
    info->norm = sqrt(dd);
    return LOXO_OK;
}
