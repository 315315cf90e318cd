/* SPDX-License-Identifier: MIT
 * The breadth-first tree, walked vertex by vertex in the mesh's order: of all that an edge of it needs, only what stands
 * at the vertex's place is then far away in memory, and that is asked for ahead. Walked place by place it would be the
 * mesh's arrays, four times as many lines. */
#ifndef LOXO_SOLVER_GEODESIC_TREE_H
#define LOXO_SOLVER_GEODESIC_TREE_H

#include "solver/geodesic/geodesic_internal.h"

#define PLACES_AHEAD 24

/* The edge that leads to a vertex. */
typedef struct tree_edge {
    int64_t place;       /* of the vertex */
    loxo_index halfedge; /* -1: the vertex is a source */
    loxo_index parent;   /* the vertex that it comes from */
    double sign;         /* +1: the half-edge leads to the vertex; -1: away from it */
} tree_edge;

/* Asks for what geodesic_tree_edge and its caller need some vertices later. */
static inline void geodesic_prefetch_place(const loxo_geodesic *g, int64_t v)
{
    if (v + PLACES_AHEAD >= g->m.n_vertices) return;
    const int64_t p = g->rank[v + PLACES_AHEAD];
    if (p < 0) return;
    __builtin_prefetch(&g->parent[p], 1, 2);
    __builtin_prefetch(&g->value[2 * p + 1], 1, 2);
}

/* false: v was not reached. */
static inline bool geodesic_tree_edge(const loxo_geodesic *g, int64_t v, tree_edge *e)
{
    const int64_t p = g->rank[v];
    if (p < 0) return false;
    const loxo_index h = g->parent[p];
    *e = (tree_edge){.place = p, .halfedge = h, .parent = -1, .sign = 1.0};
    if (h < 0) return true;
    e->parent = g->m.halfedge_vertex[h];
    if (e->parent == v) {
        e->parent = k_head(&g->m, h);
        e->sign = -1.0;
    }
    return true;
}

/* A number of vertices that grows with f from 0 to all of them, so that the vertices of each range of faces are near
 * them: at a part's faces the part's vertices. */
int64_t geodesic_vertices_before(const loxo_geodesic *g, int64_t f);

#endif
