/* SPDX-License-Identifier: MIT
 * Recovery by unfolding: the heat tells only which of two neighbours comes first, lengths are measured on the faces. A
 * vertex is done when all its hotter neighbours are; its distance is the least of the ways along its edges and of the
 * straight lines across the faces around it (k_arrival). Who waits for whom depends on the heat alone, so whatever order
 * the vertices are done in that no one need wait, their distances have the same bits.
 *
 * All that can be done at once are a round: no two of them are neighbours but in the first. The queue keeps the rounds, and
 * later passes go through them again and do what was done too early because the heat has the order wrong. */
#include "kernel/around_kernel.h"
#include "kernel/unfold_kernel.h"
#include "par/phases.h"
#include "par/range.h"
#include "solver/geodesic/parallel_heat/tree.h"

#include <string.h>

#define CHUNK                64
#define MOST_FOUND           512 /* a chunk keeps so many before it claims room in the queue for them */
#define MIN_ROUND_PER_THREAD 256 /* rounds smaller than this on average are not worth sharing out */
#define MOST_PASSES          30
#define FEW_OF               2000    /* a pass is not worth it for one vertex of so many */
#define AGAIN                (-1000) /* in the place of a number of edges to wait for */
/* Measured, see README.md. How far beyond an edge's end a line may cross it, in lengths of the edge: where a line just misses,
 * the next face sees it from the side, over distances that are less certain. */
#define REACH 0.3
/* What was done before a neighbour that is nearer by so many lengths of the edge is done again. */
#define EARLY      0.3
#define LEAST_GAIN 1e-3 /* mean edge lengths: what gains less does not tell its neighbours */
/* Heat as an integer in units of 2^-FRACTION_BITS octaves, modulo 2^32: neighbours are less than 2^19 octaves apart. */
#define FRACTION_BITS 12
#define COLDER        20 /* octaves: heat that is not positive counts as so much below its scale */

/* The first of a round stands in the queue as ~v. */
typedef struct unfolding {
    parallel_heat *g;
    double *distance;
    int n_threads;
    int64_t begin, end, tail; /* of the queue: this round, and what was found for the next */
    int64_t n_sources;
    int64_t pass;
    int64_t progress; /* the poll looks at it */
    int64_t n_again;  /* to be done again in the next pass, some counted twice */
} unfolding;

static uint32_t heat_key(double value, int32_t scale)
{
    if (!(value >= 0x1p-1000 && value < HUGE_VAL)) return ((uint32_t)scale - COLDER) << FRACTION_BITS;
    const int exponent = k_exponent(value);
    const double fraction = value * k_power_of_two(-(int64_t)exponent) - 1.0; /* in [0, 1) */
    return (((uint32_t)scale + (uint32_t)exponent) << FRACTION_BITS) + (uint32_t)(fraction * (1 << FRACTION_BITS));
}

/* Whether a is the hotter of two neighbours. */
static inline bool is_hotter(const uint32_t *heat, loxo_index a, loxo_index b)
{
    const uint32_t difference = heat[a] - heat[b];
    return difference == 0 ? a < b : difference < UINT32_C(1) << 31;
}

static bool is_source(const parallel_heat *g, loxo_index v) { return g->rank[v] < g->level_begin[1]; }

/* Distances of level 0 and heat by vertices. */
static void begin_vertices(const parallel_heat *g, double *distance)
{
    const int64_t n = g->m.n_vertices;
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, n, 4.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t v = r.begin; v < r.end; ++v) {
            const int64_t p = g->rank[v], soon = v + PLACES_AHEAD < n ? g->rank[v + PLACES_AHEAD] : -1;
            if (soon >= 0) {
                __builtin_prefetch(&g->value[2 * soon], 0, 2);
                __builtin_prefetch(&g->scale[soon], 0, 2);
            }
            g->heat_key[v] = p >= 0 ? heat_key(g->value[2 * p], g->scale[p]) : 0;
            g->waits_for[v] = 0;
            distance[v] = HUGE_VAL;
            if (p >= 0 && p < g->level_begin[1]) distance[v] = g->start_distance != NULL ? g->start_distance[p] : 0.0;
        }
    }
}

/* Each edge once: its colder end waits for the hotter one. Level 0 waits for nobody. */
static void count_hotter(const unfolding *s)
{
    const parallel_heat *g = s->g;
    const loxo_mesh_view *m = &g->m;
#pragma omp parallel num_threads(s->n_threads)
    {
        const loxo_range r = loxo_thread_range(m->n_faces);
        for (int64_t h = 3 * r.begin; h < 3 * r.end; ++h) {
            if (m->halfedge_twin[h] > h) continue;
            const loxo_index a = m->halfedge_vertex[h], b = k_head(m, (loxo_index)h);
            if (a == b || g->rank[a] < 0 || g->rank[b] < 0) continue;
            const loxo_index colder = is_hotter(g->heat_key, a, b) ? b : a;
            if (s->n_threads == 1)
                ++g->waits_for[colder];
            else
                __atomic_add_fetch(&g->waits_for[colder], 1, __ATOMIC_RELAXED);
        }
    }
}

/* The first round: the sources. In the second, with what these release, is what else is hotter than all around it: no two of
 * that are neighbours, but one may be a source's. */
static void find_first(unfolding *s)
{
    const parallel_heat *g = s->g;
    for (int64_t v = 0; v < g->m.n_vertices; ++v)
        if (g->rank[v] >= 0 && is_source(g, (loxo_index)v)) g->queue[s->tail++] = (loxo_index)v;
    s->n_sources = s->tail;
    for (int64_t v = 0; v < g->m.n_vertices; ++v)
        if (g->rank[v] >= 0 && g->waits_for[v] == 0 && !is_source(g, (loxo_index)v))
            g->queue[s->tail++] = (loxo_index)v;
}

typedef struct found_list {
    int n;
    loxo_index vertex[MOST_FOUND];
} found_list;

static void hand_over(unfolding *s, found_list *found)
{
    const int64_t at = __atomic_fetch_add(&s->tail, found->n, __ATOMIC_RELAXED);
    memcpy(&s->g->queue[at], found->vertex, (size_t)found->n * sizeof *found->vertex);
    found->n = 0;
}

static double edge_length(const loxo_mesh_view *m, loxo_index h)
{
    if (m->halfedge_length != NULL) return m->halfedge_length[h];
    return v3_norm(v3_sub(k_position(m, k_head(m, h)), k_position(m, m->halfedge_vertex[h])));
}

/* Tells neighbour w, over half-edge h, of v, which was done just now. In the first pass w waits for an edge less; if it is
 * done, and farther than v by a good part of the edge, it was done too early, or is to hear of v's new distance. */
static inline void tell(unfolding *s, loxo_index v, loxo_index w, loxo_index h, found_list *found)
{
    loxo_index *waits_for = &s->g->waits_for[w];
    const double behind = s->distance[w] - s->distance[v];
    if (s->distance[w] < HUGE_VAL) {
        if (behind <= 0.0 || is_source(s->g, w) || behind <= EARLY * edge_length(&s->g->m, h)) return;
        __atomic_store_n(waits_for, AGAIN, __ATOMIC_RELAXED);
        __atomic_add_fetch(&s->n_again, 1, __ATOMIC_RELAXED);
    } else if (s->pass == 0 && is_hotter(s->g->heat_key, v, w)) { /* else it does not wait for v: a source */
        const loxo_index left = s->n_threads == 1 ? --*waits_for : __atomic_sub_fetch(waits_for, 1, __ATOMIC_RELAXED);
        if (left != 0) return;
        if (found->n == MOST_FOUND) hand_over(s, found);
        found->vertex[found->n++] = w;
    }
}

static void tell_neighbours(unfolding *s, loxo_index v, found_list *found)
{
    const loxo_mesh_view *m = &s->g->m;
    const loxo_index first = m->vertex_halfedge[v];
    loxo_index h = first, back = -1;
    do {
        back = k_previous(h);
        tell(s, v, k_head(m, h), h, found);
        h = m->halfedge_twin[back];
    } while (h >= 0 && h != first);
    if (h < 0) tell(s, v, m->halfedge_vertex[back], back, found);
}

static inline loxo_index queued(const parallel_heat *g, int64_t i)
{
    return g->queue[i] < 0 ? (loxo_index)~g->queue[i] : g->queue[i];
}

/* For the arrivals at the next vertices of the queue: of the hotter ones around them also where they are. */
static void fetch_around(const unfolding *s, int64_t begin, int64_t end)
{
    const loxo_mesh_view *m = &s->g->m;
    k_walks walks = {.n = 0};
    for (int64_t i = begin; i < end && walks.n < K_BESIDE; ++i)
        k_walks_add(m, &walks, queued(s->g, i));
    for (int step = 0; step < K_STEPS; ++step) {
        k_walks_step(m, &walks);
        for (int i = 0; i < walks.n; ++i)
            if (walks.to[i] >= 0 && s->distance[walks.to[i]] < HUGE_VAL) k_prefetch_position(m, walks.to[i]);
    }
}

static void do_first(unfolding *s, loxo_range r, found_list *found)
{
    for (int64_t i = r.begin; i < r.end; ++i) {
        const loxo_index v = queued(s->g, i);
        if ((i - r.begin) % K_BESIDE == 0) fetch_around(s, i, r.end);
        if (!is_source(s->g, v)) s->distance[v] = k_arrival(&s->g->m, v, s->distance, REACH);
        tell_neighbours(s, v, found);
    }
}

static void do_again(unfolding *s, loxo_range r, found_list *found)
{
    const parallel_heat *g = s->g;
    for (int64_t i = r.begin; i < r.end; ++i) {
        const loxo_index v = queued(g, i);
        if (g->waits_for[v] != AGAIN && s->distance[v] < HUGE_VAL) continue;
        const double old = s->distance[v], now = k_arrival(&g->m, v, s->distance, REACH);
        g->waits_for[v] = 0;
        if (!(now < old)) continue;
        s->distance[v] = now;
        if (old - now > LEAST_GAIN * g->mean_edge_length) tell_neighbours(s, v, found);
    }
}

static void unfold_work(void *arg, int64_t chunk)
{
    unfolding *s = arg;
    const int64_t begin = s->begin + chunk * CHUNK;
    const loxo_range r = {begin, begin + CHUNK < s->end ? begin + CHUNK : s->end};
    found_list found;
    found.n = 0;
    if (s->pass == 0)
        do_first(s, r, &found);
    else
        do_again(s, r, &found);
    if (found.n > 0) hand_over(s, &found);
}

/* Whether there is another pass over the queue, and if so, its beginning. What has no way yet lies behind vertices that were
 * hotter than all around them; these hear of one in the second pass. */
static bool begin_pass(unfolding *s)
{
    const int64_t few = s->g->n_reached / FEW_OF;
    if ((s->n_again <= few && s->pass > 0) || s->pass + 1 == MOST_PASSES) return false;
    s->n_again = 0;
    s->end = 0;
    ++s->pass;
    return true;
}

static int64_t unfold_advance(void *arg)
{
    unfolding *s = arg;
    loxo_index *queue = s->g->queue;
    if (s->end == s->tail && (s->tail == 0 || !begin_pass(s))) return -1;
    s->begin = s->end;
    if (s->pass == 0) {
        s->end = s->begin == 0 && s->n_sources > 0 ? s->n_sources : s->tail;
        queue[s->begin] = (loxo_index)~queue[s->begin];
    } else {
        do {
            ++s->end;
        } while (s->end < s->tail && queue[s->end] >= 0);
    }
    __atomic_store_n(&s->progress, s->pass * s->tail + s->begin, __ATOMIC_RELAXED);
    return (s->end - s->begin + CHUNK - 1) / CHUNK;
}

static bool unfold_poll(void *arg)
{
    const unfolding *s = arg;
    const double done = (double)__atomic_load_n(&s->progress, __ATOMIC_RELAXED);
    return loxo_stop_wanted(s->g->ctx, "unfold", fmin(1.0, done / (double)s->g->n_reached));
}

/* What was not reached or is too far is infinite. What found no way or overflowed is not a number, but at the rim of a limited
 * solve and after a stop. */
static void finish(const parallel_heat *g, bool is_stopped, double *distance)
{
    const int64_t n = g->m.n_vertices;
    const bool is_part = g->last_needed > 0 && g->last_needed < g->n_levels;
    const int64_t judged = is_stopped ? 0 : is_part ? g->level_begin[g->last_needed] : n;
    const double most = g->problem->settings.max_distance;
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, n, 1.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t v = r.begin; v < r.end; ++v)
            if (!isfinite(distance[v]))
                distance[v] = g->rank[v] >= 0 && g->rank[v] < judged ? (double)NAN : HUGE_VAL;
            else if (distance[v] > most)
                distance[v] = HUGE_VAL;
    }
}

bool heat_unfold(parallel_heat *g, double *distance, int64_t *n_passes)
{
    const int64_t per_round = g->n_reached / (2 * g->n_levels), most = per_round / MIN_ROUND_PER_THREAD;
    const int n_threads = loxo_threads_for(g->ctx, g->n_reached, 100.0);
    unfolding s = {.g = g, .distance = distance, .n_threads = most < 1 ? 1 : most < n_threads ? (int)most : n_threads};
    const loxo_phases phases = {unfold_advance, unfold_work, unfold_poll, &s};
    begin_vertices(g, distance);
    count_hotter(&s);
    find_first(&s);
    const bool is_stopped = loxo_phases_run(&phases, s.n_threads);
    finish(g, is_stopped, distance);
    *n_passes = s.pass + 1;
    return is_stopped;
}
