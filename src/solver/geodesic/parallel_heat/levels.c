/* SPDX-License-Identifier: MIT
 * Breadth-first levels D_0, D_1, ... of eq. (6), and how many neighbours everyone has.
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

#define CHUNK       INT64_C(256)
#define WIDE        (2 * CHUNK) /* levels from here on are shared out, */
#define MOST_NARROW 256         /* levels without a phase: in an empty one somebody may poll */
#define MIN_THREADS 3           /* among so many: it takes twice the work of one thread */
#define UNKNOWN     ((loxo_index)-1)
#define LOWEST      ((loxo_index)(-LOXO_INDEX_MAX - 1))

typedef enum stage { STAGE_BEGIN, STAGE_CLAIM, STAGE_COUNT, STAGE_NUMBER, STAGE_PAUSE } stage;

typedef struct search {
    parallel_heat *g;
    int n_threads;
    stage stage;
    int64_t begin, end, tail; /* the level whose neighbours are looked for, and the end of what was found */
    int64_t *sum;     /* won by a chunk of the level, then where its own begin; where the blocks' reach comes later */
    int64_t progress; /* places, for the poll */
    int64_t n_narrow; /* levels since the last phase */
    loxo_status status;
} search;

/* The rings of the next places, up to end. */
static void lay_rings(const parallel_heat *g, int64_t begin, int64_t end, k_rings *r)
{
    for (r->n = 0; r->n < K_BESIDE && begin + r->n < end; ++r->n)
        r->vertex[r->n] = g->order[begin + r->n];
    k_rings_walk(&g->m, r, g->rank, sizeof *g->rank);
}

static inline void find(parallel_heat *g, int64_t place, loxo_index v, int64_t *tail)
{
    if (g->rank[v] >= 0) return;
    g->rank[v] = (loxo_index)*tail;
    g->order[*tail] = v;
    g->parent[(*tail)++] = (loxo_index)place;
}

/* One thread: finds and numbers the neighbours of the level's places. */
static void expand_alone(search *s)
{
    parallel_heat *g = s->g;
    int64_t tail = s->tail;
    k_rings r;
    for (int64_t p = s->begin; p < s->end; ++p) {
        const int i = (int)((p - s->begin) % K_BESIDE);
        if (i == 0) lay_rings(g, p, s->end, &r);
        uint32_t n = (uint32_t)r.n_spokes[i];
        if (n <= K_RING) {
            for (uint32_t k = 0; k < n; ++k)
                find(g, p, r.to[k][i], &tail);
        } else {
            n = 0;
            k_around around = k_around_vertex(&g->m, g->order[p]);
            for (loxo_index to; (to = k_around_next(&g->m, &around)) >= 0; ++n)
                find(g, p, to, &tail);
        }
        g->degree[p] = n;
    }
    s->tail = tail;
}

static loxo_range chunk_range(int64_t begin, int64_t end, int64_t chunk)
{
    const int64_t from = begin + chunk * CHUNK;
    return (loxo_range){from, from + CHUNK < end ? from + CHUNK : end};
}

static int64_t n_chunks(int64_t begin, int64_t end) { return (end - begin + CHUNK - 1) / CHUNK; }

/* The lowest place has the lowest code; a known vertex has a rank, which is none. */
static loxo_index claim_code(int64_t place) { return (loxo_index)(LOWEST + place); }

/* 1 where it may have won v. */
static uint32_t claim_one(parallel_heat *g, loxo_index code, loxo_index v)
{
    loxo_index *rank = &g->rank[v], now = __atomic_load_n(rank, __ATOMIC_RELAXED);
    if (now >= 0 || code >= now) return 0;
    while (now < 0 && code < now &&
           !__atomic_compare_exchange_n(rank, &now, code, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
    }
    return 1;
}

static void claim(parallel_heat *g, loxo_range r)
{
    k_rings rings;
    for (int64_t p = r.begin; p < r.end; ++p) {
        if ((p - r.begin) % K_BESIDE == 0) lay_rings(g, p, r.end, &rings);
        const int i = (int)((p - r.begin) % K_BESIDE);
        const loxo_index code = claim_code(p);
        const uint32_t n = (uint32_t)rings.n_spokes[i];
        uint32_t claimed = 0, k = 0;
        if (n <= K_RING) {
            for (; k < n; ++k)
                claimed |= claim_one(g, code, rings.to[k][i]) << k;
        } else {
            k_around around = k_around_vertex(&g->m, g->order[p]);
            for (loxo_index to; (to = k_around_next(&g->m, &around)) >= 0; ++k) {
                const uint32_t is_claimed = claim_one(g, code, to);
                claimed |= k < 32 ? is_claimed << k : 0;
            }
        }
        g->degree[p] = k;
        g->scale[p] = (int32_t)claimed; /* nobody needs scales before the diffusion */
    }
}

/* Whether place p, with that code, won neighbour k: a look at what it claimed spares most looks at ranks. */
static inline bool has_won(const parallel_heat *g, int64_t p, loxo_index code, uint32_t k, loxo_index v)
{
    if (k < 32 && ((uint32_t)g->scale[p] >> k & 1u) == 0) return false;
    return __atomic_load_n(&g->rank[v], __ATOMIC_RELAXED) == code;
}

static int64_t count(const parallel_heat *g, loxo_range r)
{
    int64_t n = 0;
    for (int64_t p = r.begin; p < r.end; ++p) {
        const loxo_index code = claim_code(p);
        uint32_t k = 0;
        if (g->scale[p] == 0 && g->degree[p] <= 32) continue;
        k_around around = k_around_vertex(&g->m, g->order[p]);
        for (loxo_index to; (to = k_around_next(&g->m, &around)) >= 0; ++k)
            n += has_won(g, p, code, k, to) ? 1 : 0;
    }
    return n;
}

static void number(parallel_heat *g, loxo_range r, int64_t at)
{
    for (int64_t p = r.begin; p < r.end; ++p) {
        const loxo_index code = claim_code(p);
        uint32_t k = 0;
        if (g->scale[p] == 0 && g->degree[p] <= 32) continue;
        k_around around = k_around_vertex(&g->m, g->order[p]);
        for (loxo_index to; (to = k_around_next(&g->m, &around)) >= 0; ++k) {
            if (!has_won(g, p, code, k, to)) continue;
            __atomic_store_n(&g->rank[to], (loxo_index)at, __ATOMIC_RELAXED);
            g->order[at] = to;
            g->parent[at++] = (loxo_index)p;
        }
    }
}

static void search_work(void *arg, int64_t chunk)
{
    search *s = arg;
    if (s->stage == STAGE_PAUSE) return;
    const loxo_range r = chunk_range(s->begin, s->end, chunk);
    if (s->stage == STAGE_CLAIM) claim(s->g, r);
    if (s->stage == STAGE_COUNT) s->sum[chunk] = count(s->g, r);
    if (s->stage == STAGE_NUMBER) number(s->g, r, s->sum[chunk]);
}

static void place_chunks(search *s)
{
    for (int64_t c = 0; c < n_chunks(s->begin, s->end); ++c) {
        const int64_t own = s->sum[c];
        s->sum[c] = s->tail;
        s->tail += own;
    }
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
    s->begin = s->end;
    s->end = s->tail;
    __atomic_store_n(&s->progress, s->end, __ATOMIC_RELAXED);
    const bool is_over = s->begin == s->end, is_wide = s->n_threads > 1 && s->end - s->begin >= WIDE;
    if (!note_level(s)) return -1;
    if (is_over) return -1;
    if (is_wide) {
        s->n_narrow = 0;
        s->stage = STAGE_CLAIM;
        return n_chunks(s->begin, s->end);
    }
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
    case STAGE_CLAIM: s->stage = STAGE_COUNT; return n_chunks(s->begin, s->end);
    case STAGE_COUNT:
        s->stage = STAGE_NUMBER;
        place_chunks(s);
        return n_chunks(s->begin, s->end);
    case STAGE_PAUSE:
        s->n_narrow = 0;
        s->stage = STAGE_BEGIN;
        return open_level(s);
    case STAGE_NUMBER: s->stage = STAGE_BEGIN; return open_level(s);
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
    search s = {.g = g, .n_threads = n_threads, .tail = n_sources, .sum = (int64_t *)(void *)g->reach};
    const loxo_phases phases = {search_advance, search_work, search_poll, &s};
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, n, 0.3))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t v = r.begin; v < r.end; ++v)
            g->rank[v] = UNKNOWN;
    }
    for (int64_t i = 0; i < n_sources; ++i) {
        g->rank[sources[i]] = (loxo_index)i;
        g->order[i] = sources[i];
        g->parent[i] = -1;
    }
    g->n_levels = 0;
    if (loxo_phases_run(&phases, n_threads))
        return loxo_fail(g->ctx, LOXO_ERR_STOPPED, "geodesic: stopped before there was any distance");
    if (s.status < 0) return s.status;
    g->n_reached = s.tail;
    return LOXO_OK;
}
