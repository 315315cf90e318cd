/* SPDX-License-Identifier: MIT
 * Prolongation, its transpose, and the matrix of the next level. */
#include "algebra/multigrid_internal.h"
#include "base/allocate.h"

#include <math.h>
#include <string.h>

/* Adds up numbers by column, in the order in which columns first came: open addressing over a table that grows with the
 * row, so that long rows cost no more an entry than short ones. */
typedef struct adder {
    int64_t n;          /* entries so far */
    uint64_t mask;      /* slots in use, less one */
    int64_t capacity;   /* slots, a power of two */
    int32_t *slot;      /* [capacity] number of the entry, -1: free; all are free between rows */
    int32_t *place;     /* [capacity / 2] slot of an entry */
    loxo_index *column; /* [capacity / 2] */
    double *value;      /* [capacity / 2] */
} adder;

#define FEWEST_SLOTS 64

/* Enough for rows of `most` different columns. */
static loxo_status adder_create(loxo_context *ctx, int64_t most, adder *a)
{
    *a = (adder){.mask = FEWEST_SLOTS - 1, .capacity = FEWEST_SLOTS};
    while (a->capacity / 2 < most)
        a->capacity *= 2;
    a->slot = loxo_allocate(ctx, a->capacity, sizeof *a->slot);
    a->place = loxo_allocate(ctx, a->capacity / 2, sizeof *a->place);
    a->column = loxo_allocate(ctx, a->capacity / 2, sizeof *a->column);
    a->value = loxo_allocate(ctx, a->capacity / 2, sizeof *a->value);
    if (a->slot == NULL || a->place == NULL || a->column == NULL || a->value == NULL) return LOXO_ERR_MEMORY;
    memset(a->slot, -1, (size_t)a->capacity * sizeof *a->slot);
    return LOXO_OK;
}

static void adder_destroy(loxo_context *ctx, adder *a)
{
    loxo_release(ctx, a->slot);
    loxo_release(ctx, a->place);
    loxo_release(ctx, a->column);
    loxo_release(ctx, a->value);
}

static inline uint64_t find_slot(const adder *a, loxo_index column)
{
    uint64_t s = (((uint64_t)(uint32_t)column * 0x9e3779b9u) >> 7) & a->mask;
    while (a->slot[s] >= 0 && a->column[a->slot[s]] != column)
        s = (s + 1) & a->mask;
    return s;
}

static void empty_slots(adder *a)
{
    for (int64_t k = 0; k < a->n; ++k)
        a->slot[a->place[k]] = -1;
}

static void widen(adder *a)
{
    empty_slots(a);
    a->mask = 2 * a->mask + 1;
    for (int64_t k = 0; k < a->n; ++k) {
        const uint64_t s = find_slot(a, a->column[k]);
        a->slot[s] = (int32_t)k;
        a->place[k] = (int32_t)s;
    }
}

static inline void adder_add(adder *a, loxo_index column, double value)
{
    uint64_t s = find_slot(a, column);
    if (a->slot[s] >= 0) {
        a->value[a->slot[s]] += value;
        return;
    }
    if (2 * (a->n + 1) > (int64_t)a->mask + 1) {
        widen(a);
        s = find_slot(a, column);
    }
    a->slot[s] = (int32_t)a->n;
    a->place[a->n] = (int32_t)s;
    a->column[a->n] = column;
    a->value[a->n++] = value;
}

static void adder_clear(adder *a)
{
    empty_slots(a);
    a->n = 0;
    a->mask = FEWEST_SLOTS - 1;
}

static void destroy_adders(loxo_context *ctx, int n, adder *adders)
{
    for (int t = 0; t < n && adders != NULL; ++t)
        adder_destroy(ctx, &adders[t]);
    loxo_release(ctx, adders);
}

/* One a thread; NULL: no memory. */
static adder *create_adders(loxo_context *ctx, int n, int64_t most)
{
    adder *adders = loxo_allocate_zero(ctx, n, sizeof *adders);
    for (int t = 0; t < n && adders != NULL; ++t)
        if (adder_create(ctx, most, &adders[t]) < 0) {
            destroy_adders(ctx, n, adders);
            return NULL;
        }
    return adders;
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

/* ---- prolongation ------------------------------------------------------------------------------------------------ */

/* One damped Jacobi step on the aggregates' own functions, with the strong edges of the row only:
 *   p_i = (1 - omega) e(aggregate of i) + omega sum_j (w_ij / sum_k w_ik) e(aggregate of j).
 * Rows are convex combinations, so that constants stay constants; omega = 2/3 is 4/3 over the bound 2 of the spectral
 * radius of D^-1 (D - W). */
#define OMEGA (2.0 / 3.0)
/* A row that would depend on more aggregates, of a hub, keeps to its own: it would join all of them on the next level. */
#define MOST_ENTRIES 10
/* Entries are whole numbers of 1 / GRAIN, so that single precision holds them exactly, and rows sum to 1 without rounding:
 * on a long strip a constant can be 10^9 times as large as what it stands for on the finer level. */
#define GRAIN 0x1p22

static void add_row(const mg_level *l, const loxo_index *aggregate, const float *strongest, int64_t i, adder *a)
{
    double sum = 0.0;
    if (aggregate[i] < 0) return;
    adder_add(a, aggregate[i], 0.0);
    for (int64_t k = l->row[i]; k < l->row[i + 1]; ++k) {
        const float w = l->weight[k];
        const loxo_index other = aggregate[l->column[k]];
        if (!(w > 0.0f) || w < MG_STRONG * strongest[i] || other < 0) continue;
        adder_add(a, other, (double)w);
        sum += (double)w;
    }
    if (a->n > MOST_ENTRIES) {
        const loxo_index own = a->column[0];
        adder_clear(a);
        adder_add(a, own, 1.0);
        return;
    }
    double first = 1.0;
    for (int64_t k = 1; k < a->n; ++k) {
        a->value[k] = rint(OMEGA * a->value[k] / sum * GRAIN) / GRAIN;
        first -= a->value[k];
    }
    a->value[0] = first;
}

static loxo_status allocate_map(loxo_context *ctx, mg_map *map, int64_t n_entries)
{
    if (n_entries > (int64_t)UINT32_MAX)
        return loxo_fail(ctx, LOXO_ERR_LIMIT, "multigrid: the prolongation has over 2^32 entries");
    map->column = loxo_allocate(ctx, n_entries, sizeof *map->column);
    map->value = loxo_allocate(ctx, n_entries, sizeof *map->value);
    return map->column == NULL || map->value == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
}

/* Offsets from counts: begin[i + 1] holds the count of row i. Returns the total, which may not fit. */
static int64_t add_counts(mg_map *map)
{
    int64_t total = 0;
    map->begin[0] = 0;
    for (int64_t i = 0; i < map->n_rows; ++i) {
        total += map->begin[i + 1];
        map->begin[i + 1] = (uint32_t)total;
    }
    return total;
}

static loxo_status make_up(loxo_context *ctx, mg_level *l, const loxo_index *aggregate, const float *strongest)
{
    mg_map *up = &l->up;
    const int n_threads = loxo_threads_for(ctx, l->n, 50.0);
    loxo_status status = LOXO_ERR_MEMORY;
    adder *adders = create_adders(ctx, n_threads, longest_row(l) + 1);
    if (adders == NULL) return LOXO_ERR_MEMORY;
    if ((up->begin = loxo_allocate(ctx, l->n + 1, sizeof *up->begin)) == NULL) goto done;
    for (int turn = 0; turn < 2; ++turn) { /* counts, then entries */
#pragma omp parallel num_threads(n_threads)
        {
            const loxo_range r = loxo_thread_range(l->n);
            adder *a = &adders[loxo_thread_id()];
            for (int64_t i = r.begin; i < r.end; ++i) {
                add_row(l, aggregate, strongest, i, a);
                if (turn == 0) up->begin[i + 1] = (uint32_t)a->n;
                for (int64_t k = 0; k < a->n && turn == 1; ++k) {
                    up->column[up->begin[i] + k] = a->column[k];
                    up->value[up->begin[i] + k] = (float)a->value[k];
                }
                adder_clear(a);
            }
        }
        if (turn == 0 && (status = allocate_map(ctx, up, add_counts(up))) < 0) goto done;
    }
    status = LOXO_OK;
done:
    destroy_adders(ctx, n_threads, adders);
    return status;
}

/* Each thread looks at all entries and places those of its own rows: rows come out in ascending order of the columns,
 * whatever the threads. */
static loxo_status make_down(loxo_context *ctx, mg_level *l)
{
    const mg_map *up = &l->up;
    mg_map *down = &l->down;
    const int64_t n_entries = up->begin[l->n];
    loxo_status status = allocate_map(ctx, down, n_entries);
    if (status < 0) return status;
    if ((down->begin = loxo_allocate_zero(ctx, down->n_rows + 1, sizeof *down->begin)) == NULL) return LOXO_ERR_MEMORY;
    uint32_t *next = loxo_allocate(ctx, down->n_rows, sizeof *next);
    if (next == NULL) return LOXO_ERR_MEMORY;
    for (int64_t k = 0; k < n_entries; ++k)
        ++down->begin[up->column[k] + 1];
    (void)add_counts(down);
    memcpy(next, down->begin, (size_t)down->n_rows * sizeof *next);
#pragma omp parallel num_threads(loxo_threads_for(ctx, n_entries, 5.0))
    {
        const loxo_range r = loxo_thread_range(down->n_rows);
        for (int64_t i = 0; i < l->n; ++i)
            for (uint32_t k = up->begin[i]; k < up->begin[i + 1]; ++k) {
                if (up->column[k] < r.begin || up->column[k] >= r.end) continue;
                const uint32_t at = next[up->column[k]]++;
                down->column[at] = (loxo_index)i;
                down->value[at] = up->value[k];
            }
    }
    loxo_release(ctx, next);
    return LOXO_OK;
}

loxo_status mg_make_maps(loxo_context *ctx, mg_level *l, const loxo_index *aggregate, const float *strongest,
                         int64_t n_aggregates)
{
    l->up.n_rows = l->down.n_columns = l->n;
    l->up.n_columns = l->down.n_rows = n_aggregates;
    const loxo_status status = make_up(ctx, l, aggregate, strongest);
    return status < 0 ? status : make_down(ctx, l);
}

/* ---- the next level ---------------------------------------------------------------------------------------------- */

#define GUESSED_ROW 12 /* entries a row that the first turn has room for */

/* Rows of the product go where there is room next, by whichever thread, and are put in order at the end. */
typedef struct product {
    const mg_level *fine;
    mg_level *coarse;
    int64_t room, used; /* entries; used counts on past the room */
    loxo_index *column; /* [room] */
    float *weight;      /* [room] */
    int64_t *place;     /* [coarse->n] of a row's first entry */
} product;

/* Row i of P^T A P, as an excess, which is returned, and entries; the diagonal's is of no use. With A = L + S, L from the
 * weights and S the excesses, and rows of P that sum to 1: L and P^T L P map constants to 0, so what P^T A P makes of them
 * is P^T S P 1 = P^T s. */
static double add_product_row(const mg_level *l, int64_t i, adder *a)
{
    double total = 0.0;
    for (uint32_t e = l->down.begin[i]; e < l->down.begin[i + 1]; ++e) {
        const int64_t from = l->down.column[e];
        const double share = (double)l->down.value[e], excess = (double)l->excess[from];
        double diagonal = excess;
        for (int64_t k = l->row[from]; k < l->row[from + 1]; ++k) {
            const double w = (double)l->weight[k];
            const loxo_index j = l->column[k];
            diagonal += w;
            for (uint32_t q = l->up.begin[j]; q < l->up.begin[j + 1]; ++q)
                adder_add(a, l->up.column[q], share * w * (double)l->up.value[q]);
        }
        for (uint32_t q = l->up.begin[from]; q < l->up.begin[from + 1]; ++q)
            adder_add(a, l->up.column[q], -share * diagonal * (double)l->up.value[q]);
        total += share * excess;
    }
    return total;
}

/* Rows begin..end-1; coarse->row[i + 1] gets the count of row i. */
static void make_rows(product *p, int64_t begin, int64_t end, adder *a)
{
    mg_level *c = p->coarse;
    for (int64_t i = begin; i < end; ++i) {
        c->excess[i] = (float)add_product_row(p->fine, i, a);
        int64_t n = 0;
        for (int64_t k = 0; k < a->n; ++k)
            n += a->column[k] != i && (float)a->value[k] != 0.0f;
        c->row[i] = n;
        p->place[i] = __atomic_fetch_add(&p->used, n, __ATOMIC_RELAXED);
        int64_t to = p->place[i];
        for (int64_t k = 0; k < a->n && p->place[i] + n <= p->room; ++k) {
            if (a->column[k] == i || (float)a->value[k] == 0.0f) continue;
            p->column[to] = a->column[k];
            p->weight[to++] = (float)a->value[k];
        }
        adder_clear(a);
    }
}

static void put_in_order(loxo_context *ctx, const product *p)
{
    const mg_level *c = p->coarse;
#pragma omp parallel num_threads(loxo_threads_for(ctx, c->n, 100.0))
    {
        const loxo_range r = loxo_thread_range(c->n);
        for (int64_t i = r.begin; i < r.end; ++i)
            for (int64_t k = 0; k < c->row[i + 1] - c->row[i]; ++k) { /* by insertion: rows are short */
                const loxo_index column = p->column[p->place[i] + k];
                int64_t to = c->row[i] + k;
                for (; to > c->row[i] && c->column[to - 1] > column; --to) {
                    c->column[to] = c->column[to - 1];
                    c->weight[to] = c->weight[to - 1];
                }
                c->column[to] = column;
                c->weight[to] = p->weight[p->place[i] + k];
            }
    }
}

loxo_status mg_make_coarse(loxo_context *ctx, const mg_level *fine, mg_level *coarse)
{
    const int64_t n = fine->down.n_rows;
    const int n_threads = loxo_threads_for(ctx, n, 1000.0);
    product p = {.fine = fine, .coarse = coarse, .room = GUESSED_ROW * n};
    loxo_status status = LOXO_ERR_MEMORY;
    adder *adders = create_adders(ctx, n_threads, n);
    if (adders == NULL) return LOXO_ERR_MEMORY;
    coarse->n = n;
    coarse->row = loxo_allocate(ctx, n + 1, sizeof *coarse->row);
    coarse->excess = loxo_allocate(ctx, n, sizeof *coarse->excess);
    p.place = loxo_allocate(ctx, n, sizeof *p.place);
    if (coarse->row == NULL || coarse->excess == NULL || p.place == NULL) goto done;
    for (;;) {
        p.column = loxo_allocate(ctx, p.room, sizeof *p.column);
        p.weight = loxo_allocate(ctx, p.room, sizeof *p.weight);
        if (p.column == NULL || p.weight == NULL) goto done;
        p.used = 0;
#pragma omp parallel num_threads(n_threads)
        {
            const loxo_range r = loxo_thread_range(n);
            make_rows(&p, r.begin, r.end, &adders[loxo_thread_id()]);
        }
        if (p.used <= p.room) break;
        loxo_release(ctx, p.column);
        loxo_release(ctx, p.weight);
        p.room = p.used;
    }
    const int64_t n_entries = loxo_scan_in_place(ctx, n, coarse->row);
    coarse->column = loxo_allocate(ctx, n_entries, sizeof *coarse->column);
    coarse->weight = loxo_allocate(ctx, n_entries, sizeof *coarse->weight);
    if (coarse->column == NULL || coarse->weight == NULL) goto done;
    put_in_order(ctx, &p);
    status = LOXO_OK;
done:
    loxo_release(ctx, p.column);
    loxo_release(ctx, p.weight);
    loxo_release(ctx, p.place);
    destroy_adders(ctx, n_threads, adders);
    return status;
}
