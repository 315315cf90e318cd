/* SPDX-License-Identifier: MIT
 * After the march. Where heat flows around a patch of small triangles faster than through it, it reaches the patch from
 * outside, when the inner levels have long been left. Such places show as rows that are not satisfied; they and what
 * they touch are relaxed in place, outward and inward by turns, until they are calm. On a regular mesh there are none
 * and this costs one look at every row. */
#include "par/range.h"
#include "solver/geodesic/geodesic_internal.h"

#include <string.h>

#define CELL_ROWS              64  /* places are woken and put to rest by so many */
#define WAKE_OVER_TOLERANCE    4.0 /* a cell wakes when one relaxing would change it by more than so many tolerances, */
#define STIR_OVER_TOLERANCE    1.0 /* wakes its neighbours while it changes by more than so many, */
#define REST_OVER_TOLERANCE    0.1 /* and rests when it changes by less */
#define MAX_UPDATES_PER_VERTEX 100000

/* Relative change of a cell, root mean square weighted by area, if it were relaxed now. */
static double cell_change(const loxo_geodesic *g, int64_t cell)
{
    const int64_t begin = cell * CELL_ROWS, end = begin + CELL_ROWS < g->n_reached ? begin + CELL_ROWS : g->n_reached;
    const int64_t n_sources = g->level_begin[1];
    double moved = 0.0, size = 0.0;
    for (int64_t p = begin; p < end; ++p) {
        const double step = k_row_step(g->row, g->entry, p < n_sources ? (double)g->first[p] : 0.0, g->value, p),
                     weight = (double)g->row[p].weight;
        moved += weight * (step * step);
        size += weight * (g->value[2 * p] * g->value[2 * p]);
    }
    return size > 0.0 ? sqrt(moved / size) : size == 0.0 ? 0.0 : HUGE_VAL;
}

static double relax_cell(loxo_geodesic *g, int64_t cell, bool is_inward)
{
    const int64_t begin = cell * CELL_ROWS, end = begin + CELL_ROWS < g->n_reached ? begin + CELL_ROWS : g->n_reached;
    const int64_t n_sources = g->level_begin[1];
    double moved = 0.0, size = 0.0;
    for (int64_t i = begin; i < end; ++i) {
        const int64_t p = is_inward ? begin + end - 1 - i : i;
        const double step = k_row_step(g->row, g->entry, p < n_sources ? (double)g->first[p] : 0.0, g->value, p),
                     weight = (double)g->row[p].weight;
        g->value[2 * p] += step;
        moved += weight * (step * step);
        size += weight * (g->value[2 * p] * g->value[2 * p]);
    }
    return size > 0.0 ? sqrt(moved / size) : size == 0.0 ? 0.0 : HUGE_VAL;
}

static void wake_neighbours(const loxo_geodesic *g, int64_t cell, bool *awake)
{
    const int64_t begin = cell * CELL_ROWS, end = begin + CELL_ROWS < g->n_reached ? begin + CELL_ROWS : g->n_reached;
    for (uint32_t k = g->row[begin].begin; k < g->row[end].begin; ++k)
        awake[(g->entry[k].slot >> 1) / CELL_ROWS] = true;
}

void geodesic_settle(loxo_geodesic *g, double tolerance, diffusion_result *result)
{
    const int64_t n_cells = (g->n_reached + CELL_ROWS - 1) / CELL_ROWS;
    bool *awake = (bool *)g->reach; /* the march is over */
    int64_t n_awake = 0, n_updates = 0;
    bool is_inward = true;
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, g->n_reached, 8.0)) reduction(+ : n_awake)
    {
        const loxo_range r = loxo_thread_range(n_cells);
        for (int64_t c = r.begin; c < r.end; ++c) {
            awake[c] = !(cell_change(g, c) <= WAKE_OVER_TOLERANCE * tolerance);
            n_awake += awake[c] ? 1 : 0;
        }
    }
    while (n_awake > 0 && n_updates < MAX_UPDATES_PER_VERTEX * g->n_reached) {
        n_awake = 0;
        for (int64_t i = 0; i < n_cells; ++i) {
            const int64_t c = is_inward ? n_cells - 1 - i : i;
            if (!awake[c]) continue;
            const double change = relax_cell(g, c, is_inward);
            n_updates += CELL_ROWS;
            if (!(change <= STIR_OVER_TOLERANCE * tolerance)) wake_neighbours(g, c, awake);
            awake[c] = !(change <= REST_OVER_TOLERANCE * tolerance);
            n_awake += awake[c] ? 1 : 0;
        }
        is_inward = !is_inward;
        if (loxo_stop_wanted(g->ctx, "diffusion", 1.0)) {
            result->stopped = true;
            break;
        }
    }
    if (n_updates > 0) { /* what the march said of the levels that it gave up does not hold any more */
        double change = 0.0;
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, g->n_reached, 8.0))
        {
#pragma omp for
            for (int64_t p = 0; p < g->n_reached; ++p)
                g->value[2 * p + 1] = g->value[2 * p];
#pragma omp for reduction(max : change)
            for (int64_t c = 0; c < n_cells; ++c)
                change = fmax(change, cell_change(g, c));
        }
        result->change = change;
    }
    result->n_updates += n_updates;
    if (n_awake > 0 && !result->stopped) result->n_unsettled = n_awake;
}
