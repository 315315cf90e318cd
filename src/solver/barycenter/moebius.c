/* SPDX-License-Identifier: MIT
 * Moebius maps as lists of shifts. */
#include "base/context.h"
#include "kernel/ball_kernel.h"
#include "kernel/variants.h"
#include "par/range.h"

#include <loxo/moebius.h>

#include <string.h>

static bool is_map(const loxo_moebius *map)
{
    return map != NULL && map->d >= 2 && map->d <= LOXO_MOEBIUS_MOST_DIMENSIONS && map->n_shifts >= 0 &&
           map->n_shifts <= LOXO_MOEBIUS_MOST_SHIFTS;
}

static loxo_status no_map(loxo_context *ctx)
{
    return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "moebius: not a map of a ball of 2 to %d dimensions",
                     LOXO_MOEBIUS_MOST_DIMENSIONS);
}

/* 1 - |w|^2, of the coordinates; (1 - |w|) (1 + |w|) keeps what they have of it. */
static double co_of(int d, const double *w)
{
    const double r = sqrt(k_ball_dot(d, w, w));
    return (1.0 - r) * (1.0 + r);
}

loxo_status loxo_moebius_set_identity(loxo_context *ctx, int d, loxo_moebius *map)
{
    if (map == NULL || d < 2 || d > LOXO_MOEBIUS_MOST_DIMENSIONS) return no_map(ctx);
    memset(map, 0, sizeof *map);
    map->d = d;
    return LOXO_OK;
}

loxo_status loxo_moebius_append_shift(loxo_context *ctx, loxo_moebius *map, const double *w, double co)
{
    if (!is_map(map) || w == NULL) return no_map(ctx);
    const double own = co_of(map->d, w);
    if (!(co > 0.0 ? k_ball_is_co(own, co) : co >= 0.0 && own > 0.0))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "moebius: a point to be shifted is not inside the ball");
    if (map->n_shifts == LOXO_MOEBIUS_MOST_SHIFTS)
        return loxo_fail(ctx, LOXO_ERR_LIMIT, "moebius: more than %d shifts", LOXO_MOEBIUS_MOST_SHIFTS);
    memcpy(map->shift[map->n_shifts], w, (size_t)map->d * sizeof *w);
    map->co[map->n_shifts++] = co > 0.0 ? co : own;
    return LOXO_OK;
}

loxo_status loxo_moebius_compose(loxo_context *ctx, const loxo_moebius *first, const loxo_moebius *second,
                                 loxo_moebius *out)
{
    if (!is_map(first) || !is_map(second) || out == NULL) return no_map(ctx);
    if (first->d != second->d) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "moebius: maps of different balls");
    if (first->n_shifts + second->n_shifts > LOXO_MOEBIUS_MOST_SHIFTS)
        return loxo_fail(ctx, LOXO_ERR_LIMIT, "moebius: more than %d shifts", LOXO_MOEBIUS_MOST_SHIFTS);
    const int n = first->n_shifts, n_more = second->n_shifts;
    memmove(out->shift + n, second->shift, (size_t)n_more * sizeof out->shift[0]);
    memmove(out->co + n, second->co, (size_t)n_more * sizeof out->co[0]);
    if (out != first) {
        memcpy(out->shift, first->shift, (size_t)n * sizeof out->shift[0]);
        memcpy(out->co, first->co, (size_t)n * sizeof out->co[0]);
    }
    out->d = first->d;
    out->n_shifts = n + n_more;
    return LOXO_OK;
}

/* sigma_w^-1 is sigma_(-w): the list backwards, with the other sign. */
loxo_status loxo_moebius_invert(loxo_context *ctx, const loxo_moebius *map, loxo_moebius *out)
{
    if (!is_map(map) || out == NULL) return no_map(ctx);
    const int n = map->n_shifts, d = map->d;
    if (out != map) *out = *map;
    for (int i = 0; 2 * i < n; ++i) {
        const int j = n - 1 - i;
        const double swap_co = out->co[i];
        out->co[i] = out->co[j];
        out->co[j] = swap_co;
        for (int k = 0; k < d; ++k) {
            const double swap = out->shift[i][k];
            out->shift[i][k] = -out->shift[j][k];
            out->shift[j][k] = -swap;
        }
    }
    return LOXO_OK;
}

/* Points of space, by the kernel. */
static void map_space(loxo_context *ctx, const loxo_moebius *map, int64_t n, const double *x, double *y)
{
    const k_variant *kernels = k_variant_get(loxo_context_isa(ctx));
    double w[LOXO_MOEBIUS_MOST_SHIFTS][3];
    for (int s = 0; s < map->n_shifts; ++s)
        memcpy(w[s], map->shift[s], sizeof w[s]);
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 2.0 * (map->n_shifts + 1)))
    {
        const loxo_range r = loxo_thread_range(n);
        kernels->shifts3(map->n_shifts, (const double(*)[3])w, map->co, r.end - r.begin, x + 3 * r.begin,
                         y + 3 * r.begin);
    }
}

loxo_status loxo_moebius_map_sphere(loxo_context *ctx, const loxo_moebius *map, int64_t n, const double *x, double *y)
{
    if (!is_map(map)) return no_map(ctx);
    if (n < 0 || (n > 0 && (x == NULL || y == NULL)))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "moebius: no points to map");
    const int d = map->d;
    if (d == 3) {
        map_space(ctx, map, n, x, y);
        return LOXO_OK;
    }
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 2.0 * d * (map->n_shifts + 1)))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            double own[LOXO_MOEBIUS_MOST_DIMENSIONS];
            memcpy(own, x + i * d, (size_t)d * sizeof *own);
            for (int s = 0; s < map->n_shifts; ++s)
                k_ball_shift(d, map->shift[s], map->co[s], own, own);
            memcpy(y + i * d, own, (size_t)d * sizeof *own);
        }
    }
    return LOXO_OK;
}

/* The first point that is not inside; n: none. */
static int64_t find_outside(int d, int64_t n, const double *z, const double *co)
{
    for (int64_t i = 0; i < n; ++i) {
        const double own = co_of(d, z + i * d);
        if (!(co == NULL ? own > 0.0 : co[i] > 0.0 && k_ball_is_co(own, co[i]))) return i;
    }
    return n;
}

loxo_status loxo_moebius_map_ball(loxo_context *ctx, const loxo_moebius *map, int64_t n, const double *z,
                                  const double *co, double *out, double *out_co)
{
    if (!is_map(map)) return no_map(ctx);
    if (n < 0 || (n > 0 && (z == NULL || out == NULL)))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "moebius: no points to map");
    const int d = map->d;
    const int64_t outside = find_outside(d, n, z, co);
    if (outside < n)
        return loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, (loxo_place){.byte = -1, .element = outside},
                            "moebius: point %lld is not inside the ball", (long long)outside);
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 2.0 * d * (map->n_shifts + 1)))
    {
        const loxo_range r = loxo_thread_range(n);
        double back[LOXO_MOEBIUS_MOST_DIMENSIONS], own[LOXO_MOEBIUS_MOST_DIMENSIONS];
        for (int64_t i = r.begin; i < r.end; ++i) {
            double own_co = co == NULL ? co_of(d, z + i * d) : co[i];
            memcpy(own, z + i * d, (size_t)d * sizeof *own);
            for (int s = 0; s < map->n_shifts; ++s) {
                for (int k = 0; k < d; ++k)
                    back[k] = -map->shift[s][k];
                own_co = k_ball_compose(d, back, map->co[s], own, own_co, own); /* sigma_w is sigma_(-(-w)) */
            }
            memcpy(out + i * d, own, (size_t)d * sizeof *own);
            if (out_co != NULL) out_co[i] = own_co;
        }
    }
    return LOXO_OK;
}

double loxo_moebius_radius(double co) { return k_ball_radius(co); }

double loxo_moebius_gap(double co) { return k_ball_gap(co); }
