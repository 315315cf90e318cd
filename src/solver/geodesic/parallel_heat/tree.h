/* SPDX-License-Identifier: MIT
 * The breadth-first tree, read face by face in the mesh's order: there an edge of it has its two faces' numbers at hand,
 * and only the place that the step along it goes to is far away in memory. That is asked for ahead. */
#ifndef LOXO_GEODESIC_PARALLEL_HEAT_TREE_H
#define LOXO_GEODESIC_PARALLEL_HEAT_TREE_H

#include "solver/geodesic/parallel_heat/parallel_heat_internal.h"

#define PLACES_AHEAD 24 /* vertices */
#define FACES_AHEAD  48 /* they are ordered by their vertices, about two to one */

static inline bool heat_comes_first(const double *length, loxo_index a, loxo_index b)
{
    return length[a] < length[b] || (length[a] == length[b] && a < b);
}

/* Of several edges of an intrinsic triangulation between the same two vertices the shortest is the tree's, of equally long
 * ones that of the lowest half-edge. h is compared with the others at v; like h they are those that lead to v, or the only
 * ones of their edges. Turning begins at h: the first half-edge at v is not known in a part of a mesh. */
static inline bool heat_is_shortest(const loxo_mesh_view *m, loxo_index h, loxo_index v)
{
    const loxo_index *twin = m->halfedge_twin, *start = m->halfedge_vertex;
    const loxo_index from = start[h] == v ? k_head(m, h) : start[h], first = start[h] == v ? h : k_next(h);
    loxo_index leaving = first;
    do { /* counter-clockwise */
        const loxo_index back = k_previous(leaving), arriving = twin[leaving] >= 0 ? twin[leaving] : leaving;
        if (k_head(m, leaving) == from && heat_comes_first(m->halfedge_length, arriving, h)) return false;
        leaving = twin[back];
        if (leaving < 0 && start[back] == from && heat_comes_first(m->halfedge_length, back, h)) return false;
    } while (leaving >= 0 && leaving != first);
    if (leaving >= 0) return true;
    for (leaving = first; twin[leaving] >= 0;) { /* there is a boundary: clockwise, too */
        leaving = k_next(twin[leaving]);
        const loxo_index arriving = twin[leaving] >= 0 ? twin[leaving] : leaving;
        if (k_head(m, leaving) == from && heat_comes_first(m->halfedge_length, arriving, h)) return false;
    }
    return true;
}

/* The vertex to which half-edge h leads in the tree; -1: none. At a boundary an edge may have but the half-edge that
 * leads away from it: then *sign is -1, else +1. */
static inline loxo_index heat_led_to(const parallel_heat *g, loxo_index h, double *sign)
{
    const loxo_index from = g->m.halfedge_vertex[h], to = k_head(&g->m, h);
    loxo_index led_to = -1;
    *sign = 1.0;
    if (__atomic_load_n(&g->found_by[to], __ATOMIC_RELAXED) == from) {
        led_to = to;
    } else if (g->m.halfedge_twin[h] < 0 && __atomic_load_n(&g->found_by[from], __ATOMIC_RELAXED) == to) {
        *sign = -1.0;
        led_to = from;
    }
    if (led_to < 0 || g->m.halfedge_length == NULL || heat_is_shortest(&g->m, h, led_to)) return led_to;
    return -1;
}

/* Where the half-edge of the tree's edge to a vertex is known, it replaces the vertex above. No other half-edge is that
 * edge's, so it does not matter to whoever looks at it meanwhile that there is no vertex of such a number. */
static inline void heat_keep_halfedge(const parallel_heat *g, loxo_index v, loxo_index h)
{
    __atomic_store_n(&g->found_by[v], (loxo_index)(-2 - h), __ATOMIC_RELAXED);
}

/* -1: none. */
static inline loxo_index heat_kept_halfedge(const parallel_heat *g, int64_t v)
{
    return g->found_by[v] <= -2 ? (loxo_index)(-2 - g->found_by[v]) : -1;
}

/* Asks for the places of the vertices of some faces later. */
static inline void heat_prefetch_steps(const parallel_heat *g, int64_t f)
{
    if (f + FACES_AHEAD >= g->m.n_faces) return;
    const int64_t p = g->rank[g->m.halfedge_vertex[3 * (f + FACES_AHEAD)]];
    if (p >= 0) __builtin_prefetch(&g->value[2 * p + 1], 1, 2);
}

#endif
