/* SPDX-License-Identifier: MIT
 * Breadth-first levels D_0, D_1, ... of eq. (6). */
#include "par/range.h"
#include "solver/geodesic/geodesic_internal.h"

#define PREFETCH_VERTEX   24 /* places ahead */
#define PREFETCH_HALFEDGE 12
#define PREFETCH_FACES    6

static inline void meet(loxo_geodesic *g, loxo_index neighbour, loxo_index halfedge, int64_t *tail)
{
    if (g->rank[neighbour] >= 0) return;
    g->rank[neighbour] = (loxo_index)*tail;
    g->order[*tail] = neighbour;
    g->parent[*tail] = halfedge;
    ++*tail;
}

/* Takes in the neighbours of the vertex at a place that nobody found before, and notes all of them, counter-clockwise, as
 * the entries of its row: walking around a vertex waits for memory at every step, so it is done once. Returns the
 * degree. */
static inline uint32_t expand(loxo_geodesic *g, int64_t place, k_entry *entry, int64_t *tail)
{
    const loxo_mesh_view *m = &g->m;
    const loxo_index first = m->vertex_halfedge[g->order[place]];
    loxo_index h = first, back = -1;
    uint32_t degree = 0;
    do {
        const loxo_index neighbour = k_head(m, h);
        entry[degree++].slot = (uint32_t)neighbour;
        meet(g, neighbour, h, tail);
        back = k_previous(h);
        h = m->halfedge_twin[back];
    } while (h >= 0 && h != first);
    if (h < 0) { /* the last neighbour at a boundary: only the half-edge towards us exists */
        entry[degree++].slot = (uint32_t)m->halfedge_vertex[back];
        meet(g, m->halfedge_vertex[back], back, tail);
    }
    return degree;
}

static inline void prefetch(const loxo_geodesic *g, int64_t place, int64_t tail)
{
    if (place + PREFETCH_VERTEX < tail) __builtin_prefetch(&g->m.vertex_halfedge[g->order[place + PREFETCH_VERTEX]]);
    if (place + PREFETCH_HALFEDGE < tail) {
        const int64_t h = g->m.vertex_halfedge[g->order[place + PREFETCH_HALFEDGE]];
        __builtin_prefetch(&g->m.halfedge_vertex[h]);
        __builtin_prefetch(&g->m.halfedge_twin[h]);
    }
    if (place + PREFETCH_FACES < tail) { /* the faces on both sides of the first one around the vertex */
        const loxo_index h = g->m.vertex_halfedge[g->order[place + PREFETCH_FACES]];
        const loxo_index left = g->m.halfedge_twin[k_previous(h)], right = g->m.halfedge_twin[h];
        __builtin_prefetch(&g->m.halfedge_vertex[left < 0 ? h : left]);
        __builtin_prefetch(&g->m.halfedge_twin[left < 0 ? h : left]);
        __builtin_prefetch(&g->m.halfedge_vertex[right < 0 ? h : right]);
        __builtin_prefetch(&g->m.halfedge_twin[right < 0 ? h : right]);
    }
}

loxo_status geodesic_find_levels(loxo_geodesic *g, const loxo_index *sources, int64_t n_sources)
{
    int64_t tail = 0, n_levels = 0;
    const int64_t n = g->m.n_vertices;
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, n, 0.3))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t v = r.begin; v < r.end; ++v)
            g->rank[v] = -1;
    }
    for (int64_t i = 0; i < n_sources; ++i) {
        g->rank[sources[i]] = (loxo_index)i;
        g->order[i] = sources[i];
        g->parent[i] = -1;
    }
    tail = n_sources;
    uint32_t n_entries = 0;
    for (int64_t begin = 0; begin < tail;) {
        const int64_t end = tail;
        g->level_begin[n_levels++] = (loxo_index)begin;
        for (int64_t p = begin; p < end; ++p) {
            g->row[p].begin = n_entries;
            prefetch(g, p, tail);
            n_entries += expand(g, p, &g->entry[n_entries], &tail);
        }
        begin = end;
        if (loxo_stop_wanted(g->ctx, "levels", (double)begin / (double)n))
            return loxo_fail(g->ctx, LOXO_ERR_STOPPED, "geodesic: stopped before there was any distance");
    }
    g->level_begin[n_levels] = (loxo_index)tail;
    g->row[tail].begin = n_entries;
    g->n_levels = n_levels;
    g->n_reached = tail;
    return LOXO_OK;
}
