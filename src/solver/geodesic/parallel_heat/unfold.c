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
#define FEW_OF               1000    /* a pass is not worth it for one vertex of so many */
#define AGAIN                (-1000) /* in the place of a number of edges to wait for */
/* Measured, see README.md. How far beyond an edge's end a line may cross it, in lengths of the edge: where a line just misses,
 * the next face sees it from the side, over distances that are less certain. */
#define REACH 0.3
/* What was done before a neighbour that is nearer by so many lengths of the edge is done again. */
#define EARLY       0.3
#define LEAST_GAIN  1e-3 /* mean edge lengths, and */
#define LEAST_SHARE 1e-5 /* of the distance: what gains less does not tell its neighbours */
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
    int64_t n_found;  /* that found a way in this pass, after the first */
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

/* The i-th of the rings tells its neighbours. */
static void tell_ring(unfolding *s, const k_rings *r, int i, found_list *found)
{
    const loxo_mesh_view *m = &s->g->m;
    if (r->n_spokes[i] <= K_RING) {
        for (int k = 0; k < r->n_spokes[i]; ++k)
            tell(s, r->vertex[i], r->to[k][i], r->halfedge[k][i], found);
        return;
    }
    k_around around = k_around_vertex(m, r->vertex[i]);
    for (loxo_index h = around.first, to; (to = k_around_next(m, &around)) >= 0;
         h = around.next >= 0 ? around.next : around.back)
        tell(s, r->vertex[i], to, h, found);
}

static inline loxo_index queued(const parallel_heat *g, int64_t i)
{
    return g->queue[i] < 0 ? (loxo_index)~g->queue[i] : g->queue[i];
}

/* Up to K_BESIDE vertices that are no neighbours of each other, and what arrives at them. */
typedef struct arrivals {
    k_rings rings;
    k_corners corners;
    double least[K_BESIDE];
} arrivals;

/* A spoke whose end has a distance. */
typedef struct spoke {
    double at, square, reach; /* distance of its end; squared length; how far beyond its end a line may pass */
    loxo_vec3 vector;
    loxo_index halfedge;
} spoke;

static void flush(const unfolding *s, arrivals *a)
{
    k_corners *c = &a->corners;
    s->g->kernels->unfold_corners(c);
    for (int i = 0; i < c->n_edges; ++i)
        if (c->edge_arrival[i] < a->least[c->edge_owner[i]]) a->least[c->edge_owner[i]] = c->edge_arrival[i];
    for (int i = 0; i < c->n; ++i)
        if (c->arrival[i] < a->least[c->owner[i]]) a->least[c->owner[i]] = c->arrival[i];
    c->n_edges = c->n = 0;
}

/* Of vertex x at own, its i-th of a batch: the way along half-edge h, which joins it and its neighbour either way. */
static spoke lay_spoke(const loxo_mesh_view *m, k_corners *c, int i, loxo_vec3 own, loxo_index to, loxo_index h,
                       double at, double reach)
{
    spoke e = {.at = at, .reach = reach, .halfedge = h};
    if (!(at < HUGE_VAL)) return e; /* most of what is not known yet is not looked up */
    if (m->halfedge_length != NULL) {
        e.square = m->halfedge_length[h] * m->halfedge_length[h];
    } else {
        e.vector = v3_sub(k_position(m, to), own);
        e.square = v3_dot(e.vector, e.vector);
    }
    c->edge_owner[c->n_edges] = (uint8_t)i;
    c->edge_at[c->n_edges] = at;
    c->edge_square[c->n_edges++] = e.square;
    return e;
}

/* The corner between two spokes, the first along a half-edge that starts in it. */
static void lay_corner(const loxo_mesh_view *m, k_corners *c, int i, const spoke *a, const spoke *b)
{
    if (!(a->at < HUGE_VAL) || !(b->at < HUGE_VAL)) return;
    const int k = c->n++;
    if (m->halfedge_length != NULL) {
        const double base = m->halfedge_length[k_next(a->halfedge)];
        c->base[k] = base * base;
    } else {
        const loxo_vec3 base = v3_sub(b->vector, a->vector);
        c->base[k] = v3_dot(base, base);
    }
    c->left[k] = a->square;
    c->right[k] = b->square;
    c->at_a[k] = a->at;
    c->at_b[k] = b->at;
    c->reach_a[k] = a->reach;
    c->reach_b[k] = b->reach;
    c->owner[k] = (uint8_t)i;
}

/* What the neighbours of the i-th vertex have to tell. No line comes from beyond a boundary. */
static void lay_ring(const unfolding *s, arrivals *a, int i)
{
    const loxo_mesh_view *m = &s->g->m;
    const k_rings *r = &a->rings;
    const double *distance = s->distance;
    const int n = r->n_spokes[i];
    const double at_ends = r->is_open[i] ? 0.0 : REACH;
    const loxo_vec3 own = m->halfedge_length != NULL ? (loxo_vec3){0.0, 0.0, 0.0} : k_position(m, r->vertex[i]);
    const loxo_index to = r->to[0][i];
    const spoke first = lay_spoke(m, &a->corners, i, own, to, r->halfedge[0][i], distance[to], at_ends);
    spoke before = first;
    for (int k = 1; k < n; ++k) {
        const loxo_index w = r->to[k][i];
        const spoke now =
            lay_spoke(m, &a->corners, i, own, w, r->halfedge[k][i], distance[w], k + 1 < n ? REACH : at_ends);
        lay_corner(m, &a->corners, i, &before, &now);
        before = now;
    }
    if (!r->is_open[i]) lay_corner(m, &a->corners, i, &before, &first);
}

/* The same for more neighbours than a ring holds. */
static void lay_large_ring(const unfolding *s, arrivals *a, int i)
{
    const loxo_mesh_view *m = &s->g->m;
    const loxo_index v = a->rings.vertex[i], h_first = m->vertex_halfedge[v], to = k_head(m, h_first);
    const loxo_vec3 own = m->halfedge_length != NULL ? (loxo_vec3){0.0, 0.0, 0.0} : k_position(m, v);
    spoke before =
        lay_spoke(m, &a->corners, i, own, to, h_first, s->distance[to], m->halfedge_twin[h_first] < 0 ? 0.0 : REACH);
    loxo_index h = h_first;
    do {
        const loxo_index back = k_previous(h), w = m->halfedge_vertex[back], twin = m->halfedge_twin[back];
        if (a->corners.n_edges == K_CORNERS || a->corners.n == K_CORNERS) flush(s, a);
        spoke now = lay_spoke(m, &a->corners, i, own, w, back, s->distance[w], twin < 0 ? 0.0 : REACH);
        lay_corner(m, &a->corners, i, &before, &now);
        now.halfedge = twin;
        before = now;
        h = twin;
    } while (h >= 0 && h != h_first);
}

/* Shortest arrivals at the vertices of the batch: along an edge from a neighbour, or straight across a face around it, from
 * the distances that its neighbours have; HUGE_VAL where none has one. */
static void find_arrivals(const unfolding *s, arrivals *a)
{
    const loxo_mesh_view *m = &s->g->m;
    const k_rings *r = &a->rings;
    for (int i = 0; i < r->n && m->halfedge_length == NULL; ++i)
        for (int k = 0; k < r->n_spokes[i] && k < K_RING; ++k)
            if (s->distance[r->to[k][i]] < HUGE_VAL) k_prefetch_position(m, r->to[k][i]);
    a->corners.n_edges = a->corners.n = 0;
    for (int i = 0; i < r->n; ++i) {
        a->least[i] = HUGE_VAL;
        if (is_source(s->g, r->vertex[i]) || r->n_spokes[i] == 0) continue;
        if (a->corners.n_edges + K_RING > K_CORNERS || a->corners.n + K_RING > K_CORNERS) flush(s, a);
        if (r->n_spokes[i] <= K_RING)
            lay_ring(s, a, i);
        else
            lay_large_ring(s, a, i);
    }
    flush(s, a);
}

static void do_first(unfolding *s, loxo_range r, found_list *found)
{
    arrivals a;
    k_rings *rings = &a.rings;
    for (int64_t i = r.begin; i < r.end; i += K_BESIDE) {
        rings->n = (int)(r.end - i < K_BESIDE ? r.end - i : K_BESIDE);
        for (int k = 0; k < rings->n; ++k)
            rings->vertex[k] = queued(s->g, i + k);
        k_rings_walk(&s->g->m, rings, s->distance, sizeof *s->distance);
        find_arrivals(s, &a);
        for (int k = 0; k < rings->n; ++k) {
            const loxo_index v = rings->vertex[k];
            if (is_source(s->g, v)) continue;
            s->distance[v] = a.least[k];
            if (!(a.least[k] < HUGE_VAL)) s->g->waits_for[v] = AGAIN; /* hotter than all around it */
        }
        for (int k = 0; k < rings->n; ++k)
            tell_ring(s, rings, k, found);
    }
}

/* Those of a batch that were marked. */
static void do_batch_again(unfolding *s, arrivals *a, found_list *found)
{
    const parallel_heat *g = s->g;
    k_rings *rings = &a->rings;
    k_rings_walk(&g->m, rings, s->distance, sizeof *s->distance);
    find_arrivals(s, a);
    for (int k = 0; k < rings->n; ++k) {
        const loxo_index v = rings->vertex[k];
        const double old = s->distance[v], now = a->least[k];
        g->waits_for[v] = now < HUGE_VAL ? 0 : AGAIN;
        if (!(now < old)) continue;
        s->distance[v] = now;
        if (old == HUGE_VAL) __atomic_add_fetch(&s->n_found, 1, __ATOMIC_RELAXED);
        if (old - now > fmax(LEAST_GAIN * g->mean_edge_length, LEAST_SHARE * now)) tell_ring(s, rings, k, found);
    }
}

static void do_again(unfolding *s, loxo_range r, found_list *found)
{
    const parallel_heat *g = s->g;
    arrivals a;
    a.rings.n = 0;
    for (int64_t i = r.begin; i < r.end; ++i)
        __builtin_prefetch(&g->waits_for[queued(g, i)]);
    for (int64_t i = r.begin; i < r.end; ++i) {
        const loxo_index v = queued(g, i);
        if (g->waits_for[v] != AGAIN) continue;
        a.rings.vertex[a.rings.n++] = v;
        if (a.rings.n < K_BESIDE) continue;
        do_batch_again(s, &a, found);
        a.rings.n = 0;
    }
    if (a.rings.n > 0) do_batch_again(s, &a, found);
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

/* A given heat may differ by more octaves between neighbours than keys tell apart, so that some wait for each other in a circle:
 * they follow in the queue, each a round of its own. */
static void queue_the_rest(unfolding *s)
{
    const parallel_heat *g = s->g;
    for (int64_t v = 0; v < g->m.n_vertices && s->tail < g->n_reached; ++v) {
        if (g->rank[v] < 0 || g->waits_for[v] <= 0 || is_source(g, (loxo_index)v)) continue;
        g->waits_for[v] = AGAIN;
        g->queue[s->tail++] = (loxo_index)~v;
    }
}

/* Whether there is another pass over the queue, and if so, its beginning. What has no way yet lies behind vertices that were
 * hotter than all around them; these hear of one in a later pass, at least one of them in each. */
static bool begin_pass(unfolding *s)
{
    const int64_t few = s->g->n_reached / FEW_OF;
    const bool is_done = s->n_again <= few || s->pass + 1 >= MOST_PASSES;
    if (s->pass > 0 && is_done && s->n_found == 0) return false;
    if (s->pass == 0) queue_the_rest(s);
    s->n_again = s->n_found = 0;
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
