/* SPDX-License-Identifier: MIT
 * Breadth-first levels D_0, D_1, ... of eq. (6), and the rows of the heat system brought into their order.
 *
 * A vertex belongs to the first place, in breadth-first order, that it is a neighbour of, and stands behind those that
 * were found before it. With several threads a wide level takes three phases: its places claim the neighbours that
 * nobody has, the lowest place wins; each chunk of places counts what it won; knowing where its own begin, it numbers
 * them. That gives the order of one thread. */
#include "base/allocate.h"
#include "par/phases.h"
#include "par/range.h"
#include "solver/geodesic/parallel_heat/parallel_heat_internal.h"

#include <string.h>

#define PREFETCH_BEGIN 24 /* places ahead */
#define PREFETCH_FAN   12
#define PREFETCH_RANK  6
#define CHUNK          INT64_C(256)
#define WIDE           (2 * CHUNK) /* levels from here on are shared out, */
#define MOST_NARROW    256         /* levels without a phase: in an empty one somebody may poll */
#define MIN_THREADS    3           /* among so many: it takes twice the work of one thread */
#define UNKNOWN        ((loxo_index)-1)
#define LOWEST         ((loxo_index)(-LOXO_INDEX_MAX - 1))

typedef enum stage { STAGE_BEGIN, STAGE_CLAIM, STAGE_COUNT, STAGE_NUMBER, STAGE_PAUSE, STAGE_END } stage;

typedef struct chunk_sum {
    int64_t n_found, n_entries; /* won by the chunk; then where its own begin */
} chunk_sum;

typedef struct search {
    parallel_heat *g;
    int n_threads;
    stage stage;
    int64_t begin, end, tail;     /* the level whose neighbours are looked for, and the end of what was found */
    int64_t last_begin, last_end; /* the level before, as long as its entries are not written */
    int64_t n_entries;            /* of places up to tail */
    int64_t n_last_chunks;        /* of the phase, come first */
    chunk_sum *sum;               /* a chunk of the level; in the room of the blocks' reach, which comes later */
    int64_t progress;             /* places, for the poll */
    int64_t n_narrow;             /* levels since the last phase */
    loxo_status status;
} search;

static inline uint32_t degree_of(const parallel_heat *g, int64_t v) { return g->fan[v + 1].begin - g->fan[v].begin; }

static inline const k_entry *fan_of(const parallel_heat *g, loxo_index v, uint32_t *n)
{
    *n = degree_of(g, v);
    return &g->fan_entry[g->fan[v].begin];
}

static inline void prefetch(const parallel_heat *g, int64_t place, int64_t end)
{
    if (place + PREFETCH_BEGIN < end) __builtin_prefetch(&g->fan[g->order[place + PREFETCH_BEGIN]]);
    if (place + PREFETCH_FAN < end) {
        const k_entry *fan = &g->fan_entry[g->fan[g->order[place + PREFETCH_FAN]].begin];
        __builtin_prefetch(fan);
        __builtin_prefetch(fan + 6);
    }
    if (place + PREFETCH_RANK < end) {
        uint32_t n;
        const k_entry *fan = fan_of(g, g->order[place + PREFETCH_RANK], &n);
        for (uint32_t k = 0; k < n; ++k)
            __builtin_prefetch(&g->rank[fan[k].slot]);
    }
}

/* One thread: finds the neighbours of the level's places and writes the entries at once. */
static void expand_alone(search *s)
{
    parallel_heat *g = s->g;
    int64_t tail = s->tail, n_entries = g->row[s->begin].begin;
    for (int64_t p = s->begin; p < s->end; ++p) {
        uint32_t n;
        const loxo_index v = g->order[p];
        const k_entry *fan = fan_of(g, v, &n);
        k_entry *entry = &g->entry[n_entries];
        prefetch(g, p, tail);
        for (uint32_t k = 0; k < n; ++k) {
            loxo_index place = g->rank[fan[k].slot];
            if (place < 0) {
                place = (loxo_index)tail;
                g->rank[fan[k].slot] = place;
                g->order[tail] = (loxo_index)fan[k].slot;
                g->parent[tail++] = (loxo_index)p;
            }
            entry[k] = (k_entry){(uint32_t)place, fan[k].coefficient};
        }
        g->row[p].begin = (uint32_t)n_entries;
        g->row[p].weight = g->fan[v].area;
        n_entries += n;
    }
    s->tail = tail;
    g->row[s->end].begin = (uint32_t)n_entries;
    /* where the entries of what was found will stand is known here only when all of it is expanded alone, too */
    s->n_entries = n_entries;
    for (int64_t p = s->end; p < tail && s->n_threads > 1; ++p) {
        g->row[p].begin = (uint32_t)s->n_entries;
        s->n_entries += degree_of(g, g->order[p]);
    }
}

static loxo_range chunk_range(int64_t begin, int64_t end, int64_t chunk)
{
    const int64_t from = begin + chunk * CHUNK;
    return (loxo_range){from, from + CHUNK < end ? from + CHUNK : end};
}

static int64_t n_chunks(int64_t begin, int64_t end) { return (end - begin + CHUNK - 1) / CHUNK; }

/* The lowest place has the lowest code; a known vertex has a rank, which is none. */
static loxo_index claim_code(int64_t place) { return (loxo_index)(LOWEST + place); }

static void claim(parallel_heat *g, loxo_range r)
{
    for (int64_t p = r.begin; p < r.end; ++p) {
        uint32_t n;
        const k_entry *fan = fan_of(g, g->order[p], &n);
        const loxo_index code = claim_code(p);
        uint32_t claimed = 0;
        prefetch(g, p, r.end);
        for (uint32_t k = 0; k < n; ++k) {
            loxo_index *rank = &g->rank[fan[k].slot], now = __atomic_load_n(rank, __ATOMIC_RELAXED);
            if (now >= 0 || code >= now) continue;
            claimed |= k < 32 ? UINT32_C(1) << k : 0;
            while (now < 0 && code < now &&
                   !__atomic_compare_exchange_n(rank, &now, code, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
            }
        }
        g->scale[p] = (int32_t)claimed; /* nobody needs scales before the diffusion */
    }
}

/* Whether place p, with that code, won neighbour k: a look at what it claimed spares most looks at ranks. */
static inline bool has_won(const parallel_heat *g, int64_t p, loxo_index code, uint32_t k, uint32_t v)
{
    if (k < 32 && ((uint32_t)g->scale[p] >> k & 1u) == 0) return false;
    return __atomic_load_n(&g->rank[v], __ATOMIC_RELAXED) == code;
}

static chunk_sum count(const parallel_heat *g, loxo_range r)
{
    chunk_sum sum = {0, 0};
    for (int64_t p = r.begin; p < r.end; ++p) {
        uint32_t n;
        const k_entry *fan = fan_of(g, g->order[p], &n);
        const loxo_index code = claim_code(p);
        for (uint32_t k = 0; k < n; ++k) {
            if (!has_won(g, p, code, k, fan[k].slot)) continue;
            ++sum.n_found;
            sum.n_entries += degree_of(g, fan[k].slot);
        }
    }
    return sum;
}

static void number(parallel_heat *g, loxo_range r, chunk_sum at)
{
    for (int64_t p = r.begin; p < r.end; ++p) {
        uint32_t n;
        const k_entry *fan = fan_of(g, g->order[p], &n);
        const loxo_index code = claim_code(p);
        for (uint32_t k = 0; k < n; ++k) {
            const uint32_t v = fan[k].slot;
            if (!has_won(g, p, code, k, v)) continue;
            __atomic_store_n(&g->rank[v], (loxo_index)at.n_found, __ATOMIC_RELAXED);
            g->order[at.n_found] = (loxo_index)v;
            g->parent[at.n_found] = (loxo_index)p;
            g->row[at.n_found++].begin = (uint32_t)at.n_entries;
            at.n_entries += degree_of(g, v);
        }
    }
}

/* Entries of places all whose neighbours have their own. */
static void write_entries(parallel_heat *g, loxo_range r)
{
    for (int64_t p = r.begin; p < r.end; ++p) {
        uint32_t n;
        const loxo_index v = g->order[p];
        const k_entry *fan = fan_of(g, v, &n);
        k_entry *entry = &g->entry[g->row[p].begin];
        for (uint32_t k = 0; k < n; ++k)
            entry[k] = (k_entry){(uint32_t)g->rank[fan[k].slot], fan[k].coefficient};
        g->row[p].weight = g->fan[v].area;
    }
}

static void search_work(void *arg, int64_t chunk)
{
    search *s = arg;
    if (s->stage == STAGE_PAUSE) return;
    if (chunk < s->n_last_chunks) {
        write_entries(s->g, chunk_range(s->last_begin, s->last_end, chunk));
        return;
    }
    chunk -= s->n_last_chunks;
    const loxo_range r = chunk_range(s->begin, s->end, chunk);
    if (s->stage == STAGE_CLAIM) claim(s->g, r);
    if (s->stage == STAGE_COUNT) s->sum[chunk] = count(s->g, r);
    if (s->stage == STAGE_NUMBER) number(s->g, r, s->sum[chunk]);
}

static void place_chunks(search *s)
{
    for (int64_t c = 0; c < n_chunks(s->begin, s->end); ++c) {
        const chunk_sum own = s->sum[c];
        s->sum[c] = (chunk_sum){s->tail, s->n_entries};
        s->tail += own.n_found;
        s->n_entries += own.n_entries;
    }
    s->g->row[s->tail].begin = (uint32_t)s->n_entries;
}

/* Where the level begins, or, behind the last one, where that ends. */
static bool note_level(search *s)
{
    parallel_heat *g = s->g;
    const bool is_over = s->begin == s->end;
    if (!is_over && g->n_levels == g->most_levels) {
        const int64_t twice = 2 * g->most_levels, most = twice < g->m.n_vertices ? twice : g->m.n_vertices;
        loxo_index *larger = loxo_reallocate(g->ctx, g->more_levels, most + 1, sizeof *larger);
        if (larger == NULL) {
            s->status = LOXO_ERR_MEMORY;
            return false;
        }
        if (g->more_levels == NULL) memcpy(larger, g->level_begin, (size_t)g->n_levels * sizeof *larger);
        g->level_begin = g->more_levels = larger;
        g->most_levels = most;
    }
    g->level_begin[g->n_levels] = (loxo_index)s->begin;
    g->n_levels += is_over ? 0 : 1;
    return true;
}

/* The level that was found is next. Returns the number of chunks of the phase. */
static int64_t open_level(search *s)
{
    parallel_heat *g = s->g;
    s->begin = s->end;
    s->end = s->tail;
    __atomic_store_n(&s->progress, s->end, __ATOMIC_RELAXED);
    const bool is_over = s->begin == s->end, is_wide = s->n_threads > 1 && s->end - s->begin >= WIDE;
    if (!note_level(s)) return -1;
    if (is_over || is_wide) {
        s->n_narrow = 0;
        s->n_last_chunks = n_chunks(s->last_begin, s->last_end);
        s->stage = is_over ? STAGE_END : STAGE_CLAIM;
        return is_over && s->n_last_chunks == 0 ? -1 : s->n_last_chunks + n_chunks(s->begin, s->end);
    }
    if (s->last_end > s->last_begin) write_entries(g, (loxo_range){s->last_begin, s->last_end});
    s->last_begin = s->last_end = s->end;
    expand_alone(s);
    if (s->n_threads == 1 || ++s->n_narrow < MOST_NARROW) return 0;
    s->stage = STAGE_PAUSE;
    return s->n_threads;
}

static int64_t search_advance(void *arg)
{
    search *s = arg;
    switch (s->stage) {
    case STAGE_BEGIN: return open_level(s);
    case STAGE_CLAIM:
        s->stage = STAGE_COUNT;
        s->n_last_chunks = 0;
        s->last_begin = s->begin;
        s->last_end = s->end;
        return n_chunks(s->begin, s->end);
    case STAGE_COUNT:
        s->stage = STAGE_NUMBER;
        place_chunks(s);
        return n_chunks(s->begin, s->end);
    case STAGE_PAUSE:
        s->n_narrow = 0;
        s->stage = STAGE_BEGIN;
        return open_level(s);
    case STAGE_NUMBER: s->stage = STAGE_BEGIN; return open_level(s);
    case STAGE_END: break;
    }
    return -1;
}

static bool search_poll(void *arg)
{
    const search *s = arg;
    const double done = (double)__atomic_load_n(&s->progress, __ATOMIC_RELAXED);
    return loxo_stop_wanted(s->g->ctx, "levels", done / (double)s->g->m.n_vertices);
}

loxo_status heat_find_levels(parallel_heat *g, const loxo_index *sources, int64_t n_sources)
{
    const int64_t n = g->m.n_vertices;
    const int most_threads = loxo_threads_for(g->ctx, n, 40.0),
              n_threads = most_threads < MIN_THREADS ? 1 : most_threads;
    search s = {.g = g, .n_threads = n_threads, .tail = n_sources, .sum = (chunk_sum *)(void *)g->reach};
    const loxo_phases phases = {search_advance, search_work, search_poll, &s};
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, n, 0.3))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t v = r.begin; v < r.end; ++v)
            g->rank[v] = UNKNOWN;
    }
    g->row[0].begin = 0;
    for (int64_t i = 0; i < n_sources; ++i) {
        g->rank[sources[i]] = (loxo_index)i;
        g->order[i] = sources[i];
        g->parent[i] = -1;
        g->row[i + 1].begin = g->row[i].begin + degree_of(g, sources[i]);
    }
    s.n_entries = g->row[n_sources].begin;
    g->n_levels = 0;
    if (loxo_phases_run(&phases, n_threads))
        return loxo_fail(g->ctx, LOXO_ERR_STOPPED, "geodesic: stopped before there was any distance");
    if (s.status < 0) return s.status;
    g->n_reached = s.tail;
    return LOXO_OK;
}
