/* SPDX-License-Identifier: MIT
 * Marching diffusion: a window of breadth-first levels moves outward once; every step takes in one level and relaxes
 * the window once, from the inside out; a level is final when its values stop changing and all levels inside it are.
 *
 * Parallel without a barrier per level and sweep. Let (l, n) be the relaxing of level l in step n. It needs (l-1, n),
 * (l, n-1) and (l+1, n-1); so all (l, n) with the same time l + 2 n are independent of each other: about a third of the
 * window at once. Level n is built at time 3 n - 2, linked at 3 n - 1, first relaxed at 3 n. What is due at one time is a
 * phase, its blocks are shared out in chunks. What is read and written depends on (l, n) only: the bits are the same for
 * every number of threads. */
#include "base/allocate.h"
#include "par/phases.h"
#include "par/range.h"
#include "solver/geodesic/parallel_heat/parallel_heat_internal.h"

#include <string.h>

#define CHUNK_BLOCKS             4
#define CALM_OVER_TOLERANCE      0.25 /* a block that changes by less is not relaxed, see is_calm */
#define WORST_BLOCK              2.0
#define UNSETTLED_OVER_TOLERANCE 3.0
#define MIN_RATIO                0.4
#define MAX_RATIO                0.98
#define RING                     512 /* steps in flight: at most MAX_UPDATES / 2 + 2; a power of two */
/* A relative change e of the values, root mean square over a level, turns the directions by about 3 e sqrt(m), eq. (8):
 * where values settle evenly, and by up to five times that on a scan with patches of small triangles, measured against
 * converged solutions: the estimate is made to hold for both. */
#define DIRECTIONS_PER_CHANGE 8.0
/* Levels smaller than this on average are not worth sharing out. */
#define MIN_LEVEL_PER_THREAD 192

typedef enum act {
    ACT_BUILD,
    ACT_BUILD_PLAIN,
    ACT_LINK,
    ACT_LINK_OUTWARD,
    ACT_LINK_OUTWARD_AND_RELAX,
    ACT_RELAX,
    ACT_RELAX_ALL, /* calm blocks, too */
    ACT_FINISH,
    ACT_CHECK
} act;

typedef struct unit {
    act act;
    int64_t level, step;
    bool is_inner_moving; /* the level inside is relaxed in this step, too */
} unit;

/* Where each step stands: the first level that it relaxes, and how far levels from there on were found final. */
typedef struct march {
    parallel_heat *g;
    double tolerance; /* relative change */
    float calm;       /* square of the relative change that is next to nothing */
    int64_t time;
    int64_t first[RING], final[RING];
    bool settles;                  /* where the heat gives only an order, what settles late does not matter */
    int64_t n_finished, n_checked; /* levels: final; and looked at once more, with the levels around them final */
    bool is_unsettled;             /* some block was not satisfied */
    loxo_status status;
    int n_units;
    unit units[RING];
    int64_t chunk_begin[RING + 1]; /* of the units */
    diffusion_result result;
} march;

static int64_t level_size(const parallel_heat *g, int64_t level)
{
    return g->level_begin[level + 1] - g->level_begin[level];
}

static int64_t n_blocks(const parallel_heat *g, int64_t level)
{
    return (level_size(g, level) + BLOCK_ROWS - 1) / BLOCK_ROWS;
}

static int64_t block_size(const parallel_heat *g, int64_t level, int64_t b)
{
    const int64_t rest = level_size(g, level) - b * BLOCK_ROWS;
    return rest < BLOCK_ROWS ? rest : BLOCK_ROWS;
}

/* Relaxes blocks first..last-1 of a level. */
static void relax(parallel_heat *g, unit u, int64_t first, int64_t last)
{
    const float *constant = u.level == 0 ? g->first : NULL;
    const int64_t base = g->level_begin[u.level], end = g->level_begin[u.level + 1];
    while (first < last) { /* twice where the ring ends */
        const int64_t at = heat_block(g, u.level, first), room = g->n_ring - at;
        const int64_t until = first + room < last ? first + room : last;
        const int64_t stop = base + until * BLOCK_ROWS < end ? base + until * BLOCK_ROWS : end;
        const int64_t begin = base + first * BLOCK_ROWS;
        g->kernels->relax_blocks(heat_row(g, u.level, begin), g->entry, constant, g->value, begin, stop, BLOCK_ROWS,
                                 (unsigned)u.step & 1u, &g->change[at]);
        first = until;
    }
}

/* Square of the change that a block would still make: its last two changes give a geometric series. */
static double square_to_come(double now, double before)
{
    double ratio = MAX_RATIO;
    if (now < MAX_RATIO * MAX_RATIO * before) ratio = now > 0.0 ? fmax(sqrt(now / before), MIN_RATIO) : 0.0;
    const double rest = ratio / (1.0 - ratio);
    return now * rest * rest;
}

/* Whether a block is to change by next to nothing, and all blocks that it looks at changed by as little when they were
 * relaxed last. It then keeps its values. A level is in motion until everything around it has been relaxed at least
 * twice. */
static bool is_calm(const parallel_heat *g, unit u, int64_t b, float calm)
{
    if (u.step - u.level < 4) return false;
    const int64_t at = heat_block(g, u.level, b);
    for (int side = 0; side < 3; ++side) {
        const unsigned parity = (unsigned)(side == 0 ? u.step : u.step - 1) & 1u;
        if (side == 0 && !u.is_inner_moving) continue;
        for (int64_t i = g->reach[at].first[side]; i <= g->reach[at].last[side]; ++i)
            if (!(g->change[heat_block(g, u.level + side - 1, i)].square[parity] <= calm)) return false;
    }
    const float *square = g->change[at].square;
    return square_to_come((double)square[1 - (u.step & 1)], (double)square[u.step & 1]) <= (double)calm;
}

#define KEPT (-1.0f) /* in the place of a change: the values are those of the step before */

static void keep_values(parallel_heat *g, unit u, int64_t b)
{
    const int64_t begin = g->level_begin[u.level] + b * BLOCK_ROWS, end = begin + block_size(g, u.level, b);
    const int64_t parity = u.step & 1;
    k_change *change = &g->change[heat_block(g, u.level, b)];
    if (change->square[1 - parity] != KEPT) /* else both values of a place are alike */
        for (int64_t p = begin; p < end; ++p)
            g->value[(2 * p) ^ parity] = g->value[(2 * p + 1) ^ parity];
    change->square[parity] = KEPT;
}

/* Blocks first..last-1; runs of those that are not calm together. Returns the number of places that were left alone. */
static int64_t relax_moving(parallel_heat *g, unit u, int64_t first, int64_t last, float calm)
{
    int64_t run = first, n_kept = 0;
    for (int64_t b = first; b < last; ++b) {
        if (!is_calm(g, u, b, calm)) continue;
        relax(g, u, run, b);
        keep_values(g, u, b);
        n_kept += block_size(g, u.level, b);
        run = b + 1;
    }
    relax(g, u, run, last);
    return n_kept;
}

/* Does blocks first.. of a unit, CHUNK_BLOCKS at most. Returns the number of places that were left alone. */
static int64_t do_blocks(parallel_heat *g, unit u, int64_t first, float calm)
{
    const int64_t n = n_blocks(g, u.level), last = first + CHUNK_BLOCKS < n ? first + CHUNK_BLOCKS : n;
    const int64_t begin = g->level_begin[u.level] + first * BLOCK_ROWS, most = begin + (last - first) * BLOCK_ROWS;
    const int64_t level_end = g->level_begin[u.level + 1], end = most < level_end ? most : level_end;
    const int64_t parity = u.step & 1;
    switch (u.act) {
    case ACT_BUILD: heat_build_rows(g, u.level, begin, end, false); break;
    case ACT_BUILD_PLAIN: heat_build_rows(g, u.level, begin, end, true); break;
    case ACT_LINK: heat_link_level(g, u.level, begin, end); break;
    case ACT_LINK_OUTWARD_AND_RELAX:
        heat_link_outward(g, u.level, begin, end);
        relax(g, u, first, last);
        break;
    case ACT_LINK_OUTWARD:
        heat_link_level(g, u.level, begin, end);
        heat_link_outward(g, u.level, begin, end);
        break;
    case ACT_RELAX: return relax_moving(g, u, first, last, calm);
    case ACT_RELAX_ALL: relax(g, u, first, last); break;
    case ACT_FINISH:
        for (int64_t p = begin; p < end; ++p)
            g->value[(2 * p) ^ parity] = g->value[(2 * p + 1) ^ parity];
        break;
    case ACT_CHECK: break; /* march_work */
    }
    return 0;
}

/* Whether one relaxing would still change a block of a level that is final, and its neighbours too, by so much that the
 * settling is to look at it: it does so by cells of as many places, which the last block of a level is but a part of. */
static bool is_unsettled(const parallel_heat *g, int64_t level, int64_t block, double tolerance)
{
    const int64_t begin = g->level_begin[level] + block * BLOCK_ROWS, end = begin + block_size(g, level, block);
    const k_row *row = heat_row(g, level, begin);
    double moved = 0.0, size = 0.0;
    for (int64_t p = begin; p < end; ++p, ++row) {
        const double step = k_row_step(row, g->entry, level == 0 ? (double)g->first[p] : 0.0, g->value, p);
        moved += (double)row->weight * (step * step);
        size += (double)row->weight * (g->value[2 * p] * g->value[2 * p]);
    }
    const double most = UNSETTLED_OVER_TOLERANCE * tolerance;
    return size != 0.0 && !(moved * (double)(end - begin) <= most * most * size * BLOCK_ROWS);
}

static void check_blocks(march *s, int64_t level, int64_t first)
{
    const int64_t n = n_blocks(s->g, level), last = first + CHUNK_BLOCKS < n ? first + CHUNK_BLOCKS : n;
    for (int64_t b = first; b < last; ++b)
        if (is_unsettled(s->g, level, b, s->tolerance)) __atomic_store_n(&s->is_unsettled, true, __ATOMIC_RELAXED);
}

/* Relative change of a level that later updates would still make, root mean square weighted by area. Every block's
 * squared change in this step and the one before give a geometric series of its own: where a small patch settles slowly,
 * its own ratio shows it when the level's as a whole does not. */
static double change_to_come(const parallel_heat *g, int64_t level, int64_t step)
{
    double sum = 0.0, size = 0.0, worst = 0.0;
    for (int64_t b = 0; b < n_blocks(g, level); ++b) {
        const k_change *change = &g->change[heat_block(g, level, b)];
        const double now = (double)change->square[step & 1], before = (double)change->square[1 - (step & 1)];
        const double square = square_to_come(now, before);
        if (!(square < HUGE_VAL)) return HUGE_VAL;
        sum += (double)change->size * square;
        worst = fmax(worst, square);
        size += (double)change->size;
    }
    return size > 0.0 ? fmax(sqrt(sum / size), sqrt(worst) / WORST_BLOCK) : size == 0.0 ? 0.0 : HUGE_VAL;
}

/* What is due at a time. Returns the number of units. */
static int due(march *s, unit *units)
{
    const parallel_heat *g = s->g;
    const int64_t time = s->time;
    int n_units = 0;
    const int64_t n_levels = g->n_levels;
    const int64_t to_check = s->n_finished == n_levels ? n_levels : s->n_finished - 1;
    for (int64_t level = s->n_checked; s->settles && level < to_check; ++level)
        units[n_units++] = (unit){.act = ACT_CHECK, .level = level};
    if (s->n_finished == n_levels) return n_units;
    const int64_t build = (time + 2) / 3, link = (time + 1) / 3;
    if ((time + 2) % 3 == 0 && build < n_levels)
        units[n_units++] = (unit){.act = ACT_BUILD, .level = build, .step = build};
    if ((time + 1) % 3 == 0 && link < n_levels) units[n_units++] = (unit){.act = ACT_LINK, .level = link, .step = link};
    int64_t step = time <= 0 ? 0 : (time + 2) / 3;
    if (2 * step < time - (n_levels - 1)) step = (time - n_levels + 2) / 2;
    for (; time - 2 * step >= 0 && n_units < RING; ++step) {
        const int64_t level = time - 2 * step;
        const int64_t final = step > 0 ? s->final[(step - 1) & (RING - 1)] : 0;
        const int64_t first = step > 0 ? s->first[(step - 1) & (RING - 1)] : 0;
        if (level < final) {
            if (level >= first) units[n_units++] = (unit){.act = ACT_FINISH, .level = level, .step = step};
            break; /* further in, everything was finished before */
        }
        if (level == final) s->first[step & (RING - 1)] = s->final[step & (RING - 1)] = final;
        units[n_units++] = (unit){.act = step == level + 1 ? ACT_LINK_OUTWARD_AND_RELAX : ACT_RELAX,
                                  .level = level,
                                  .step = step,
                                  .is_inner_moving = level > s->first[step & (RING - 1)]};
    }
    return n_units;
}

/* Moves the front of final levels past what was just relaxed. */
static void conclude(march *s)
{
    for (int i = 0; i < s->n_units; ++i) {
        const unit u = s->units[i];
        if (u.act == ACT_FINISH) s->n_finished = u.level + 1;
        if (u.act == (s->settles ? ACT_CHECK : ACT_FINISH)) s->n_checked = u.level + 1;
        if (u.act != ACT_RELAX && u.act != ACT_LINK_OUTWARD_AND_RELAX) continue;
        const int64_t n_updates = u.step - u.level + 1;
        s->result.n_updates += level_size(s->g, u.level);
        if (u.level != s->final[u.step & (RING - 1)] || n_updates < 2) continue;
        const double change = change_to_come(s->g, u.level, u.step);
        const bool is_settled = change <= s->tolerance;
        if (!is_settled && n_updates < MAX_UPDATES) continue;
        s->final[u.step & (RING - 1)] = u.level + 1;
        if (u.level == s->g->last_needed) s->result.needed_step = u.step;
        if (!is_settled) ++s->result.n_forced;
        if (change > s->result.change) s->result.change = change;
        if (n_updates > s->result.max_window) s->result.max_window = n_updates;
    }
}

/* Cuts units into chunks of blocks. */
static int64_t cut_units(const parallel_heat *g, const unit *units, int n_units, int64_t *chunk_begin)
{
    chunk_begin[0] = 0;
    for (int i = 0; i < n_units; ++i)
        chunk_begin[i + 1] = chunk_begin[i] + (n_blocks(g, units[i].level) + CHUNK_BLOCKS - 1) / CHUNK_BLOCKS;
    return chunk_begin[n_units];
}

static int64_t march_advance(void *arg)
{
    march *s = arg;
    conclude(s);
    heat_window_leave(s->g, s->n_checked);
    if (s->n_checked == s->g->n_levels) return -1;
    __atomic_store_n(&s->time, s->time + 1, __ATOMIC_RELAXED); /* the poll looks at it */
    s->n_units = due(s, s->units);
    for (int i = 0; i < s->n_units; ++i)
        if (s->units[i].act == ACT_BUILD && (s->status = heat_window_take_in(s->g, s->units[i].level)) < 0) return -1;
    return cut_units(s->g, s->units, s->n_units, s->chunk_begin);
}

static void march_work(void *arg, int64_t chunk)
{
    march *s = arg;
    int i = 0;
    while (chunk >= s->chunk_begin[i + 1])
        ++i;
    if (s->units[i].act == ACT_CHECK) {
        check_blocks(s, s->units[i].level, (chunk - s->chunk_begin[i]) * CHUNK_BLOCKS);
        return;
    }
    const int64_t n_kept = do_blocks(s->g, s->units[i], (chunk - s->chunk_begin[i]) * CHUNK_BLOCKS, s->calm);
    if (n_kept > 0) __atomic_sub_fetch(&s->result.n_updates, n_kept, __ATOMIC_RELAXED);
}

static bool march_poll(void *arg)
{
    const march *s = arg;
    const int64_t level = __atomic_load_n(&s->time, __ATOMIC_RELAXED) / 3;
    const loxo_progress p = {.phase = "diffusion",
                             .fraction = fmin(1.0, (double)level / (double)s->g->n_levels),
                             .iteration = level,
                             .n_iterations = s->g->n_levels,
                             .objective = NAN,
                             .residual = NAN};
    return loxo_progress_tell(s->g->ctx, &p, false);
}

static int64_t count_nonpositive(const parallel_heat *g)
{
    int64_t n = 0;
#pragma omp parallel for num_threads(loxo_threads_for(g->ctx, g->n_reached, 1.0)) reduction(+ : n)
    for (int64_t p = 0; p < g->n_reached; ++p)
        n += !(g->value[2 * p] > 0.0);
    return n;
}

static int threads_for_levels(const parallel_heat *g)
{
    const int64_t per_level = g->n_reached / g->n_levels, most = per_level / MIN_LEVEL_PER_THREAD;
    const int n_threads = loxo_threads_for(g->ctx, g->n_reached, 100.0);
    return most < 1 ? 1 : most < n_threads ? (int)most : n_threads;
}

/* After a stop: what lies beyond the front counts as not reached; at its rim both values of a place are alike. */
static void cut_at_front(parallel_heat *g, int64_t n_levels)
{
    if (n_levels < 1) n_levels = 1;
    for (int64_t p = g->level_begin[n_levels]; p < g->n_reached; ++p)
        g->rank[g->order[p]] = -1;
    g->n_levels = n_levels;
    g->n_reached = g->level_begin[n_levels];
    for (int64_t p = 0; p < g->n_reached; ++p)
        g->value[2 * p + 1] = g->value[2 * p];
}

static void clear_values(parallel_heat *g)
{
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, g->n_reached, 1.0))
    {
        const loxo_range r = loxo_thread_range(g->n_reached);
        if (r.end > r.begin) memset(g->value + 2 * r.begin, 0, (size_t)(r.end - r.begin) * 2 * sizeof *g->value);
    }
}

loxo_status heat_march(parallel_heat *g, diffusion_result *result)
{
    loxo_status status = LOXO_OK;
    march *s = loxo_allocate_zero(g->ctx, 1, sizeof *s);
    if (s == NULL) return LOXO_ERR_MEMORY;
    const double directions = DIRECTIONS_PER_CHANGE * sqrt(g->settings.time_factor);
    const loxo_phases phases = {march_advance, march_work, march_poll, s};
    s->g = g;
    s->settles = !heat_unfolds(&g->settings);
    s->tolerance = heat_tolerance(&g->settings) / directions;
    s->calm = (float)((CALM_OVER_TOLERANCE * s->tolerance) * (CALM_OVER_TOLERANCE * s->tolerance));
    s->time = -3;
    clear_values(g);
    if ((status = heat_window_begin(g, false)) < 0) goto done;
    const bool is_stopped = loxo_phases_run(&phases, threads_for_levels(g));
    if ((status = s->status) < 0) goto done;
    if (is_stopped) cut_at_front(g, s->time / 3 < g->n_levels ? s->time / 3 : g->n_levels);
    *result = s->result;
    result->stopped = is_stopped;
    result->n_reached = g->n_reached;
    heat_window_end(g);
    if (!is_stopped && s->settles && (s->is_unsettled || result->n_forced > 0)) heat_settle(g, s->tolerance, result);
    result->is_settled = !is_stopped && result->n_unsettled == 0 && result->change <= s->tolerance;
    result->change *= directions;
    result->n_nonpositive = count_nonpositive(g);
done:
    heat_window_end(g);
    loxo_release(g->ctx, s);
    return status;
}

/* Levels one after the other: first built, then linked, then relaxed n_sweeps - 1 times. */
typedef struct sweeping {
    parallel_heat *g;
    unit unit;
    loxo_status status;
} sweeping;

/* Sweeps take in all levels before they relax any: ways of different decay meet with values hundreds of octaves apart,
 * and the ratios of scales that follow values so far would not fit the coefficients, which are floats. */
static void even_out_scales(parallel_heat *g, int64_t level)
{
    const int64_t begin = g->level_begin[level], end = g->level_begin[level + 1];
    int32_t most = g->scale[begin];
    for (int64_t p = begin; p < end; ++p)
        if (g->scale[p] > most) most = g->scale[p];
    for (int64_t p = begin; p < end; ++p) {
        const int32_t raise = most - OCTAVES_APART - g->scale[p];
        if (raise <= 0) continue;
        const double factor = k_power_of_two(-(int64_t)raise);
        g->scale[p] += raise;
        g->value[2 * p] *= factor;
        g->value[2 * p + 1] *= factor;
        g->first[p] = (float)((double)g->first[p] * factor);
        const k_row *row = heat_row(g, level, p);
        for (uint32_t k = row[0].begin; k < row[1].begin; ++k) /* the others are not linked yet */
            if ((int64_t)(g->entry[k].slot >> 1) < begin)
                g->entry[k].coefficient = (float)((double)g->entry[k].coefficient * factor);
    }
}

static int64_t sweep_advance(void *arg)
{
    sweeping *s = arg;
    if (s->unit.act == ACT_BUILD_PLAIN && s->unit.level >= 0) even_out_scales(s->g, s->unit.level);
    if (++s->unit.level == s->g->n_levels) {
        s->unit.level = 0;
        if (s->unit.act == ACT_BUILD_PLAIN)
            s->unit.act = ACT_LINK_OUTWARD;
        else {
            s->unit.act = ACT_RELAX_ALL;
            __atomic_store_n(&s->unit.step, s->unit.step + 1, __ATOMIC_RELAXED); /* the poll looks at it */
            if (s->unit.step >= s->g->settings.n_sweeps) return -1;
        }
    }
    if (s->unit.act == ACT_BUILD_PLAIN && (s->status = heat_window_take_in(s->g, s->unit.level)) < 0) return -1;
    return (n_blocks(s->g, s->unit.level) + CHUNK_BLOCKS - 1) / CHUNK_BLOCKS;
}

static void sweep_work(void *arg, int64_t chunk)
{
    const sweeping *s = arg;
    do_blocks(s->g, s->unit, chunk * CHUNK_BLOCKS, 0.0f);
}

static bool sweep_poll(void *arg)
{
    const sweeping *s = arg;
    const int64_t step = __atomic_load_n(&s->unit.step, __ATOMIC_RELAXED), n_sweeps = s->g->settings.n_sweeps;
    const loxo_progress p = {.phase = "diffusion",
                             .fraction = (double)step / (double)n_sweeps,
                             .iteration = step,
                             .n_iterations = n_sweeps,
                             .objective = NAN,
                             .residual = NAN};
    return loxo_progress_tell(s->g->ctx, &p, false);
}

/* The paper's iteration (7): the first sweep is the taking in of the levels, each later one updates every level from
 * the inside out, all vertices of a level from the values that their level had before. */
loxo_status heat_sweep(parallel_heat *g, diffusion_result *result)
{
    sweeping s = {.g = g, .unit = {.act = ACT_BUILD_PLAIN, .level = -1}};
    const loxo_phases phases = {sweep_advance, sweep_work, sweep_poll, &s};
    clear_values(g);
    loxo_status status = heat_window_begin(g, true);
    if (status < 0) return status;
    const bool is_stopped = loxo_phases_run(&phases, threads_for_levels(g));
    heat_window_end(g);
    if (s.status < 0) return s.status;
    if (s.unit.act == ACT_BUILD_PLAIN) cut_at_front(g, s.unit.level);
    /* A stop inside a sweep leaves levels that it has reached, and behind them those as the sweep before has left them. */
    const bool is_within = is_stopped && s.unit.act == ACT_RELAX_ALL;
    const int64_t n_whole = s.unit.act == ACT_RELAX_ALL ? s.unit.step : 1;
    const int64_t n_more = is_within ? g->level_begin[s.unit.level + 1] : 0;
    for (int64_t p = 0; p < g->n_reached; ++p) {
        const int64_t parity = (n_whole - (p < n_more ? 0 : 1)) & 1;
        g->value[(2 * p + 1) ^ parity] = g->value[(2 * p) ^ parity];
    }
    *result = (diffusion_result){.n_updates = n_whole * g->n_reached + n_more,
                                 .max_window = g->n_levels,
                                 .n_nonpositive = count_nonpositive(g),
                                 .change = NAN,
                                 .stopped = is_stopped};
    return LOXO_OK;
}
