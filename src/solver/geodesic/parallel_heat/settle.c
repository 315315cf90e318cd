/* SPDX-License-Identifier: MIT
 * After the march. Where heat flows around a patch of small triangles faster than through it, it reaches the patch from
 * outside, when the inner levels have long been left. Such places show as rows that are not satisfied; they and what
 * they touch are relaxed in place, outward and inward by turns, until they are calm. On a regular mesh there are none,
 * as the march has seen. Rows of the whole mesh are made again for it, where those of the window stood. */
#include "par/range.h"
#include "solver/geodesic/parallel_heat/parallel_heat_internal.h"

#define CELL_ROWS           64     /* places are woken and put to rest by so many */
#define WAKE_OVER_TOLERANCE 4.0    /* a cell wakes when one relaxing would change it by more than so many tolerances, */
#define STIR_OVER_TOLERANCE 1.0    /* wakes its neighbours while it changes by more than so many, */
#define REST_OVER_TOLERANCE 0.5    /* and rests when it is to change by less in all passes to come */
#define MAX_ROUNDS          8      /* of waking, each from half the change on */
#define MAX_RATIO           0.9999 /* of the changes of two passes the same way */
/* It gives up after so many passes, or so many entries of rows looked at: some 10 s, and 10 us a vertex. */
#define MAX_PASSES        400000
#define MAX_WORK          1e10
#define MAX_WORK_A_VERTEX 1e4

/* Stands in the room of the blocks' reach, which the march does not need any more. */
typedef struct cell {
    float before[2]; /* change in the last pass inward and in the last outward */
    float rest;      /* change to come when it was relaxed last, -1: never */
    bool is_awake;
} cell;

_Static_assert(sizeof(cell) <= sizeof(block_reach), "cells must fit where the blocks' reach was");

static loxo_range places_of(const parallel_heat *g, int64_t c)
{
    const int64_t begin = c * CELL_ROWS, end = begin + CELL_ROWS;
    return (loxo_range){begin, end < g->n_reached ? end : g->n_reached};
}

static double row_step(const parallel_heat *g, int64_t place)
{
    const double constant = place < g->level_begin[1] ? (double)g->first[place] : 0.0;
    return k_row_step(&g->row[place], g->entry, constant, g->value, place);
}

/* Root mean square of what changed, weighted by area; HUGE_VAL where something is not finite. */
static double relative(double moved, double size)
{
    if (size == 0.0) return 0.0;
    const double square = moved / size;
    return square < HUGE_VAL ? sqrt(square) : HUGE_VAL;
}

/* Relative change of a cell if it were relaxed now. */
static double cell_change(const parallel_heat *g, int64_t c)
{
    const loxo_range r = places_of(g, c);
    double moved = 0.0, size = 0.0;
    for (int64_t p = r.begin; p < r.end; ++p) {
        const double step = row_step(g, p), weight = (double)g->row[p].weight;
        moved += weight * (step * step);
        size += weight * (g->value[2 * p] * g->value[2 * p]);
    }
    return relative(moved, size);
}

static double relax_cell(parallel_heat *g, int64_t c, bool is_inward)
{
    const loxo_range r = places_of(g, c);
    double moved = 0.0, size = 0.0;
    for (int64_t i = r.begin; i < r.end; ++i) {
        const int64_t p = is_inward ? r.begin + r.end - 1 - i : i;
        const double step = row_step(g, p), weight = (double)g->row[p].weight;
        g->value[2 * p] += step;
        moved += weight * (step * step);
        size += weight * (g->value[2 * p] * g->value[2 * p]);
    }
    return relative(moved, size);
}

static void wake_neighbours(const parallel_heat *g, int64_t c, cell *cells)
{
    const loxo_range r = places_of(g, c);
    for (uint32_t k = g->row[r.begin].begin; k < g->row[r.end].begin; ++k)
        cells[(g->entry[k].slot >> 1) / CELL_ROWS].is_awake = true;
}

/* All changes still to come, from this one and the one two passes before, the same way: a geometric series, of which each
 * ratio stands for two passes. */
static double change_to_come(double now, double before)
{
    double square = MAX_RATIO * MAX_RATIO;
    if (now < square * before) square = now / before;
    const double ratio = sqrt(square);
    return now * ratio / (1.0 - ratio);
}

/* One pass over what is awake. Returns the largest change, 0 when nothing is awake any more; HUGE_VAL: values are not
 * finite. */
static double pass(parallel_heat *g, cell *cells, int64_t n_cells, double tolerance, bool is_inward, int64_t *n_updates,
                   double *work)
{
    double most = 0.0;
    for (int64_t i = 0; i < n_cells; ++i) {
        const int64_t c = is_inward ? n_cells - 1 - i : i;
        if (!cells[c].is_awake) continue;
        const double change = relax_cell(g, c, is_inward);
        if (change == HUGE_VAL) return HUGE_VAL;
        const double rest = change_to_come(change, (double)cells[c].before[is_inward]);
        const loxo_range r = places_of(g, c);
        *n_updates += r.end - r.begin;
        *work += (double)(g->row[r.end].begin - g->row[r.begin].begin);
        const bool stirs = change > STIR_OVER_TOLERANCE * tolerance;
        if (stirs) wake_neighbours(g, c, cells); /* some may have had their turn in this pass */
        cells[c].before[is_inward] = (float)change;
        cells[c].rest = (float)rest;
        cells[c].is_awake = rest > REST_OVER_TOLERANCE * tolerance;
        if ((cells[c].is_awake || stirs) && change > most) most = change;
    }
    return most;
}

/* Relative change to come, root mean square over all places, weighted by area as everywhere. */
static double estimate(const parallel_heat *g, const cell *cells, int64_t n_cells)
{
    double moved = 0.0, size = 0.0;
    for (int64_t c = 0; c < n_cells; ++c) {
        const loxo_range r = places_of(g, c);
        double weight = 0.0;
        for (int64_t p = r.begin; p < r.end; ++p)
            weight += (double)g->row[p].weight * (g->value[2 * p] * g->value[2 * p]);
        const double rest = cells[c].rest >= 0.0f ? (double)cells[c].rest : cell_change(g, c);
        moved += weight * (rest * rest);
        size += weight;
    }
    return relative(moved, size);
}

/* Wakes what one relaxing would change by more than `most`. */
static int64_t wake(const parallel_heat *g, cell *cells, int64_t n_cells, double most)
{
    int64_t n_awake = 0;
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, g->n_reached, 8.0)) reduction(+ : n_awake)
    {
        const loxo_range r = loxo_thread_range(n_cells);
        for (int64_t c = r.begin; c < r.end; ++c) {
            const bool is_awake = cell_change(g, c) > most;
            cells[c] = (cell){.rest = -1.0f, .is_awake = is_awake};
            n_awake += is_awake ? 1 : 0;
        }
    }
    return n_awake;
}

/* Passes until nothing is awake. False: stopped, or given up. */
static bool relax_awake(parallel_heat *g, cell *cells, int64_t n_cells, double tolerance, diffusion_result *result)
{
    const double most_work = MAX_WORK + MAX_WORK_A_VERTEX * (double)g->n_reached;
    double change = 1.0, work = 0.0;
    for (int64_t n = 1; change > 0.0; ++n) {
        if (!(change < HUGE_VAL) || n > MAX_PASSES || work > most_work) return false;
        change = pass(g, cells, n_cells, tolerance, n % 2 == 1, &result->n_updates, &work);
        const double share = (double)n / MAX_PASSES, done = work / most_work; /* of what it takes at most */
        result->stopped = loxo_stop_wanted(g->ctx, "diffusion", done > share ? done : share);
        if (result->stopped) return false;
    }
    return true;
}

void heat_settle(parallel_heat *g, double tolerance, diffusion_result *result)
{
    const int64_t n_cells = (g->n_reached + CELL_ROWS - 1) / CELL_ROWS, n_before = result->n_updates;
    cell *cells = (cell *)(void *)g->reach;
    g->row = g->ring_row;
    g->entry = g->ring_entry;
    heat_make_all_rows(g, g->row, g->entry);
    bool is_done = result->n_forced == 0, is_good = true;
    double most = WAKE_OVER_TOLERANCE * tolerance;
    for (int round = 0; is_good && round < MAX_ROUNDS; ++round) {
        const int64_t n_awake = wake(g, cells, n_cells, most);
        if (n_awake == 0 && is_done) return;
        if (n_awake > 0) is_good = relax_awake(g, cells, n_cells, tolerance, result);
        result->change = estimate(g, cells, n_cells);
        is_done = is_good && result->change <= tolerance;
        if (is_done) break;
        most *= 0.5; /* the many that change by little are too many */
    }
    for (int64_t c = 0; c < n_cells && !is_done && !result->stopped; ++c)
        result->n_unsettled += is_good || cells[c].is_awake ? 1 : 0;
    if (result->n_updates == n_before) return;
#pragma omp parallel for num_threads(loxo_threads_for(g->ctx, g->n_reached, 1.0))
    for (int64_t p = 0; p < g->n_reached; ++p)
        g->value[2 * p + 1] = g->value[2 * p];
}
