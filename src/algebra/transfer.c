/* SPDX-License-Identifier: MIT
 * Prolongation and its transpose. */
#include "algebra/adder.h"
#include "algebra/multigrid_internal.h"
#include "base/allocate.h"

#include <math.h>
#include <string.h>

/* One damped Jacobi step on the aggregates' own functions, with the strong edges of the row only:
 *   p_i = (1 - omega) e(aggregate of i) + omega sum_j (w_ij / (sum_k w_ik + e_i)) e(aggregate of j).
 * Where the excess e_i is 0, rows are convex combinations and constants stay constants; near variables that are held, of
 * which excesses are left, the functions fall towards them. omega = 2/3 is 4/3 over the bound 2 of the spectral radius of
 * D^-1 (D - W). */
#define OMEGA (2.0 / 3.0)
/* ... strong here when at least this share of the row's largest weight: fewer entries than aggregates are grown by. */
#define REACH 0.3f
/* A row that would depend on more aggregates, of a hub, keeps to its own: it would join all of them on the next level. */
#define MOST_ENTRIES 10
/* Then one step towards less energy of the columns of P, inside the pattern that they have (Mandel, Brezina, Vanek 1999):
 *   p_ic <- p_ic - tau (g_ic - (sum over c of g_ic - g_i) / n_c),   g_ic = (A P)_ic / d_i,   g_i = (A P 1)_i / d_i,
 * A of all edges, weak and negative ones too, d its diagonal. What is taken off is what lies outside of the pattern: rows
 * sum to what they would without one, to 1 where there is no excess near. */
#define TAU 0.5
/* ... not where entries would grow beyond this, or d_i is what large weights of both signs leave. */
#define LARGEST     1.5
#define LEAST_SHARE 0.1

static void add_row(const mg_level *l, const loxo_index *aggregate, int64_t i, mg_adder *a)
{
    double sum = 0.0;
    if (aggregate[i] < 0) return;
    mg_adder_add(a, aggregate[i], 0.0);
    for (int64_t k = l->row[i]; k < l->row[i + 1]; ++k) {
        const float w = l->weight[k];
        const loxo_index other = aggregate[l->column[k]];
        if (!(w > 0.0f) || w < REACH * l->strongest[i] || other < 0) continue;
        mg_adder_add(a, other, (double)w);
        sum += (double)w;
    }
    if (a->n > MOST_ENTRIES) {
        const loxo_index own = a->column[0];
        mg_adder_clear(a);
        mg_adder_add(a, own, 1.0);
        return;
    }
    const double excess = fmax(mg_excess(l, i), 0.0);
    double first = sum > 0.0 ? 1.0 - rint(OMEGA * excess / (sum + excess) * MG_ONE) / MG_ONE : 1.0;
    for (int64_t k = 1; k < a->n; ++k) {
        a->value[k] = rint(OMEGA * a->value[k] / (sum + excess) * MG_ONE) / MG_ONE;
        first -= a->value[k];
    }
    a->value[0] = first;
}

/* Offsets from counts, of which begin[i + 1] holds that of row i; and room for so many entries. */
static loxo_status lay_out(loxo_context *ctx, mg_map *map)
{
    int64_t n_entries = 0;
    for (int64_t i = 0; i < map->n_rows; ++i)
        n_entries += map->begin[i + 1];
    if (n_entries > (int64_t)UINT32_MAX)
        return loxo_fail(ctx, LOXO_ERR_LIMIT, "multigrid: the prolongation has over 2^32 entries");
    map->begin[0] = 0;
    for (int64_t i = 0; i < map->n_rows; ++i)
        map->begin[i + 1] += map->begin[i];
    map->column = loxo_allocate(ctx, n_entries, sizeof *map->column);
    map->value = loxo_allocate(ctx, n_entries, sizeof *map->value);
    return map->column == NULL || map->value == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
}

/* The entries of row i after the step; false: they stay. */
static bool improve_row(const mg_level *l, int64_t i, int16_t *improved)
{
    const mg_map *up = &l->up;
    const uint32_t begin = up->begin[i], n = up->begin[i + 1] - begin;
    const loxo_index *column = up->column + begin;
    const double excess = mg_excess(l, i);
    double flow[MOST_ENTRIES] = {0.0}, d = excess, size = fabs(excess), outside = 0.0, change = 0.0;
    double own = 0.0;
    if (n < 2) return false;
    for (uint32_t c = 0; c < n; ++c)
        own += (double)up->value[begin + c];
    change = excess * own;
    for (int64_t k = l->row[i]; k < l->row[i + 1]; ++k) {
        const double w = (double)l->weight[k];
        const loxo_index j = l->column[k];
        int32_t sum = 0;
        d += w;
        size += fabs(w);
        for (uint32_t q = up->begin[j]; q < up->begin[j + 1]; ++q) {
            sum += up->value[q];
            for (uint32_t c = 0; c < n; ++c)
                if (column[c] == up->column[q]) flow[c] += w * (double)up->value[q];
        }
        change += w * (own - (double)sum);
    }
    if (!(d > LEAST_SHARE * size)) return false;
    for (uint32_t c = 0; c < n; ++c) {
        flow[c] = (double)up->value[begin + c] - flow[c] / d;
        outside += flow[c];
    }
    outside = (outside - change / d) / (double)n;
    double first = own - rint(TAU * change / d);
    for (uint32_t c = n; c-- > 0;) {
        const double value = rint((double)up->value[begin + c] - TAU * (flow[c] - outside));
        const double taken = c > 0 ? value : first;
        if (!(fabs(value) <= LARGEST * MG_ONE) || !(fabs(taken) <= LARGEST * MG_ONE)) return false;
        improved[c] = (int16_t)taken;
        first -= value;
    }
    return true;
}

static loxo_status improve(loxo_context *ctx, mg_level *l)
{
    mg_map *up = &l->up;
    int16_t *value = loxo_allocate(ctx, up->begin[l->n], sizeof *value);
    if (value == NULL) return LOXO_ERR_MEMORY;
#pragma omp parallel num_threads(loxo_threads_for(ctx, l->n, 50.0))
    {
        const loxo_range r = loxo_thread_range(l->n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            const uint32_t begin = up->begin[i];
            if (!improve_row(l, i, value + begin))
                memcpy(value + begin, up->value + begin, (up->begin[i + 1] - begin) * sizeof *value);
        }
    }
    loxo_release(ctx, up->value);
    up->value = value;
    return LOXO_OK;
}

static int64_t longest_row(const mg_level *l)
{
    int64_t most = 0;
    for (int64_t i = 0; i < l->n; ++i) {
        const int64_t n = l->row[i + 1] - l->row[i];
        most = n > most ? n : most;
    }
    return most;
}

static loxo_status make_up(loxo_context *ctx, mg_level *l, const loxo_index *aggregate)
{
    mg_map *up = &l->up;
    const int n_threads = loxo_threads_for(ctx, l->n, 50.0);
    loxo_status status = LOXO_ERR_MEMORY;
    mg_adder *adders = mg_create_adders(ctx, n_threads, longest_row(l) + 1);
    if (adders == NULL) return LOXO_ERR_MEMORY;
    if ((up->begin = loxo_allocate(ctx, l->n + 1, sizeof *up->begin)) == NULL) goto done;
    for (int turn = 0; turn < 2; ++turn) { /* counts, then entries */
#pragma omp parallel num_threads(n_threads)
        {
            const loxo_range r = loxo_thread_range(l->n);
            mg_adder *a = &adders[loxo_thread_id()];
            for (int64_t i = r.begin; i < r.end; ++i) {
                add_row(l, aggregate, i, a);
                if (turn == 0) up->begin[i + 1] = (uint32_t)a->n;
                for (int64_t k = 0; k < a->n && turn == 1; ++k) {
                    up->column[up->begin[i] + k] = a->column[k];
                    up->value[up->begin[i] + k] = (int16_t)(a->value[k] * MG_ONE);
                }
                mg_adder_clear(a);
            }
        }
        if (turn == 0 && (status = lay_out(ctx, up)) < 0) goto done;
    }
    status = LOXO_OK;
done:
    mg_destroy_adders(ctx, n_threads, adders);
    return status;
}

/* Rows come in blocks that know between which columns their entries lie. Each thread goes through the blocks that have
 * entries of its own columns, and counts or places these: the rows of the transpose come out in ascending order of their
 * columns, whatever the threads. */
#define BLOCK_ROWS 1024

typedef struct span {
    loxo_index low, high; /* low > high: no entries */
} span;

static void find_spans(loxo_context *ctx, const mg_map *up, int64_t n_blocks, span *spans)
{
#pragma omp parallel num_threads(loxo_threads_for(ctx, up->n_rows, 3.0))
    {
        const loxo_range r = loxo_thread_range(n_blocks);
        for (int64_t b = r.begin; b < r.end; ++b) {
            const int64_t end = (b + 1) * BLOCK_ROWS < up->n_rows ? (b + 1) * BLOCK_ROWS : up->n_rows;
            span s = {LOXO_INDEX_MAX, 0};
            for (uint32_t k = up->begin[b * BLOCK_ROWS]; k < up->begin[end]; ++k) {
                s.low = up->column[k] < s.low ? up->column[k] : s.low;
                s.high = up->column[k] > s.high ? up->column[k] : s.high;
            }
            spans[b] = s;
        }
    }
}

/* Entries of columns mine.begin..mine.end-1 in rows begin..end-1. */
static void place_entries(const mg_map *up, mg_map *down, loxo_range mine, int64_t begin, int64_t end, uint32_t *next)
{
    for (int64_t i = begin; i < end; ++i)
        for (uint32_t k = up->begin[i]; k < up->begin[i + 1]; ++k) {
            if (up->column[k] < mine.begin || up->column[k] >= mine.end) continue;
            const uint32_t at = next[up->column[k]]++;
            if (down->column == NULL) continue; /* counting */
            down->column[at] = (loxo_index)i;
            down->value[at] = up->value[k];
        }
}

static loxo_status make_down(loxo_context *ctx, mg_level *l)
{
    const mg_map *up = &l->up;
    mg_map *down = &l->down;
    const int64_t n_blocks = (l->n + BLOCK_ROWS - 1) / BLOCK_ROWS;
    loxo_status status = LOXO_ERR_MEMORY;
    span *spans = loxo_allocate(ctx, n_blocks, sizeof *spans);
    uint32_t *next = loxo_allocate(ctx, down->n_rows, sizeof *next);
    down->begin = loxo_allocate_zero(ctx, down->n_rows + 1, sizeof *down->begin);
    if (spans == NULL || next == NULL || down->begin == NULL) goto done;
    find_spans(ctx, up, n_blocks, spans);
    for (int turn = 0; turn < 2; ++turn) { /* counts, then entries */
        uint32_t *at = turn == 0 ? down->begin + 1 : next;
#pragma omp parallel num_threads(loxo_threads_for(ctx, l->n, 5.0))
        {
            const loxo_range mine = loxo_thread_range(down->n_rows);
            for (int64_t b = 0; b < n_blocks; ++b) {
                const int64_t end = (b + 1) * BLOCK_ROWS < l->n ? (b + 1) * BLOCK_ROWS : l->n;
                if (spans[b].high < mine.begin || spans[b].low >= mine.end) continue;
                place_entries(up, down, mine, b * BLOCK_ROWS, end, at);
            }
        }
        if (turn == 1) break;
        if ((status = lay_out(ctx, down)) < 0) goto done;
        memcpy(next, down->begin, (size_t)down->n_rows * sizeof *next);
    }
    status = LOXO_OK;
done:
    loxo_release(ctx, next);
    loxo_release(ctx, spans);
    return status;
}

loxo_status mg_make_maps(loxo_context *ctx, mg_level *l, const loxo_index *aggregate, int64_t n_aggregates)
{
    l->up.n_rows = l->n;
    l->down.n_rows = n_aggregates;
    loxo_status status = make_up(ctx, l, aggregate);
    if (status >= 0) status = improve(ctx, l);
    return status < 0 ? status : make_down(ctx, l);
}
