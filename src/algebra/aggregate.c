/* SPDX-License-Identifier: MIT
 * Which variables become one on the next level. */
#include "algebra/multigrid_internal.h"
#include "base/allocate.h"

#include <string.h>

/* A variable that stands so firmly by itself needs no coarse level: of (A x)_i at most this share comes from others. */
#define FIRM 5.0
/* Aggregates are grown inside zones of so many rows, which threads take one by one ... */
#define ZONE_ROWS 32768
/* ... unless more than this share of entries leaves its zone: the order of the rows then says nothing of who is near
 * whom, and there is one zone. */
#define MOST_LEAVING 0.2

typedef struct growing {
    const mg_level *level;
    loxo_index *aggregate;
    int64_t zone_rows;
} growing;

#define FREE ((loxo_index)-2)

static bool is_strong(const mg_level *l, float weight, int64_t i, int64_t j)
{
    return weight > 0.0f && weight >= MG_STRONG * l->strongest[i] && weight >= MG_STRONG * l->strongest[j];
}

static void look_at_rows(loxo_context *ctx, const mg_level *l, loxo_index *aggregate)
{
#pragma omp parallel num_threads(loxo_threads_for(ctx, l->n, 10.0))
    {
        const loxo_range r = loxo_thread_range(l->n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            float sum = 0.0f;
            for (int64_t k = l->row[i]; k < l->row[i + 1]; ++k) {
                const float w = l->weight[k];
                sum += w < 0.0f ? -w : w;
            }
            aggregate[i] = l->strongest[i] > 0.0f && mg_excess(l, i) < FIRM * (double)sum ? FREE : MG_NONE;
        }
    }
}

/* A free variable whose strong neighbours are all free becomes the root of an aggregate with them. Numbers count from 0
 * in each zone; returns how many. */
static int64_t grow_zone(const growing *g, int64_t begin, int64_t end)
{
    const mg_level *l = g->level;
    int64_t n = 0;
    for (int64_t i = begin; i < end; ++i) {
        bool is_root = g->aggregate[i] == FREE, has_neighbour = false;
        for (int64_t k = l->row[i]; k < l->row[i + 1] && is_root; ++k) {
            const int64_t j = l->column[k];
            if (j < begin || j >= end || !is_strong(l, l->weight[k], i, j)) continue;
            if (g->aggregate[j] == MG_NONE) continue;
            is_root = g->aggregate[j] == FREE;
            has_neighbour = true;
        }
        if (!is_root || !has_neighbour) continue;
        g->aggregate[i] = (loxo_index)n;
        for (int64_t k = l->row[i]; k < l->row[i + 1]; ++k) {
            const int64_t j = l->column[k];
            if (j >= begin && j < end && g->aggregate[j] == FREE && is_strong(l, l->weight[k], i, j))
                g->aggregate[j] = (loxo_index)n;
        }
        ++n;
    }
    return n;
}

/* The aggregate of the neighbour that i hangs on most; strong ones first. */
static loxo_index best_aggregate(const growing *g, const loxo_index *given, int64_t i)
{
    const mg_level *l = g->level;
    float best = 0.0f;
    bool is_best_strong = false;
    loxo_index found = MG_NONE;
    for (int64_t k = l->row[i]; k < l->row[i + 1]; ++k) {
        const int64_t j = l->column[k];
        const float w = l->weight[k];
        if (given[j] < 0 || !(w > 0.0f)) continue;
        const bool strong = is_strong(l, w, i, j);
        if (strong < is_best_strong || (strong == is_best_strong && w <= best)) continue;
        best = w;
        is_best_strong = strong;
        found = given[j];
    }
    return found;
}

/* What is still free joins the aggregate next to it, as they were grown; then what is left becomes aggregates of itself
 * with what is free around it. */
static loxo_status join_rest(loxo_context *ctx, const growing *g, int64_t *n_aggregates)
{
    const mg_level *l = g->level;
    loxo_index *given = loxo_allocate(ctx, l->n, sizeof *given);
    if (given == NULL) return LOXO_ERR_MEMORY;
    memcpy(given, g->aggregate, (size_t)l->n * sizeof *given);
#pragma omp parallel num_threads(loxo_threads_for(ctx, l->n, 10.0))
    {
        const loxo_range r = loxo_thread_range(l->n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            const loxo_index found = given[i] == FREE ? best_aggregate(g, given, i) : MG_NONE;
            if (found >= 0) g->aggregate[i] = found;
        }
    }
    loxo_release(ctx, given);
    for (int64_t i = 0; i < l->n; ++i) {
        if (g->aggregate[i] != FREE) continue;
        const loxo_index found = best_aggregate(g, g->aggregate, i);
        g->aggregate[i] = found >= 0 ? found : (loxo_index)(*n_aggregates)++;
    }
    return LOXO_OK;
}

static bool has_local_order(loxo_context *ctx, const mg_level *l)
{
    int64_t n_leaving = 0;
#pragma omp parallel num_threads(loxo_threads_for(ctx, l->n, 5.0)) reduction(+ : n_leaving)
    {
        const loxo_range r = loxo_thread_range(l->n);
        for (int64_t i = r.begin; i < r.end; ++i)
            for (int64_t k = l->row[i]; k < l->row[i + 1]; ++k)
                n_leaving += l->column[k] / ZONE_ROWS != i / ZONE_ROWS;
    }
    return (double)n_leaving <= MOST_LEAVING * (double)l->row[l->n];
}

loxo_status mg_aggregate(loxo_context *ctx, const mg_level *level, loxo_index *aggregate, int64_t *n_aggregates)
{
    growing g = {.level = level, .aggregate = aggregate, .zone_rows = ZONE_ROWS};
    const int64_t n = level->n;
    *n_aggregates = 0;
    look_at_rows(ctx, level, aggregate);
    if (!has_local_order(ctx, level)) g.zone_rows = n;
    const int64_t n_zones = n > 0 ? (n + g.zone_rows - 1) / g.zone_rows : 0;
    int64_t *zone = loxo_allocate(ctx, n_zones + 1, sizeof *zone);
    if (zone == NULL) return LOXO_ERR_MEMORY;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 30.0))
    {
        const loxo_range r = loxo_thread_range(n_zones);
        for (int64_t i = r.begin; i < r.end; ++i)
            zone[i] = grow_zone(&g, i * g.zone_rows, i + 1 < n_zones ? (i + 1) * g.zone_rows : n);
    }
    *n_aggregates = loxo_scan_in_place(ctx, n_zones, zone);
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 1.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i)
            if (aggregate[i] >= 0) aggregate[i] = (loxo_index)(aggregate[i] + zone[i / g.zone_rows]);
    }
    loxo_release(ctx, zone);
    return join_rest(ctx, &g, n_aggregates);
}
