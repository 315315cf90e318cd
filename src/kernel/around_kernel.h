/* SPDX-License-Identifier: MIT
 * Walks around vertices, over half-edges and their twins. */
#ifndef LOXO_KERNEL_AROUND_KERNEL_H
#define LOXO_KERNEL_AROUND_KERNEL_H

#include "kernel/vec3.h"

/* Neighbours of a vertex one after the other, counter-clockwise; at a boundary the last by the half-edge that arrives. */
typedef struct k_around {
    loxo_index first, next, back;
} k_around;

static inline k_around k_around_vertex(const loxo_mesh_view *m, loxo_index v)
{
    return (k_around){m->vertex_halfedge[v], m->vertex_halfedge[v], -1};
}

/* -1: that were all. */
static inline loxo_index k_around_next(const loxo_mesh_view *m, k_around *a)
{
    loxo_index to = -1;
    if (a->next >= 0) {
        to = k_head(m, a->next);
        a->back = k_previous(a->next);
        a->next = m->halfedge_twin[a->back];
        if (a->next == a->first) a->next = a->back = -1;
    } else if (a->back >= 0) {
        to = m->halfedge_vertex[a->back];
        a->back = -1;
    }
    return to;
}

/* One walk waits for memory at each half-edge. So what will be walked around soon is walked around K_BESIDE vertices at a
 * time, side by side, K_STEPS half-edges of each, ahead of the work, to have it in the cache. */
#define K_BESIDE 16
#define K_STEPS  7
typedef struct k_walks {
    int n;
    loxo_index first[K_BESIDE], at[K_BESIDE];
    loxo_index to[K_BESIDE]; /* neighbour that the last step went by; -1: the walk is over */
} k_walks;

static inline void k_walks_add(const loxo_mesh_view *m, k_walks *w, loxo_index v)
{
    w->at[w->n] = w->first[w->n] = m->vertex_halfedge[v];
    ++w->n;
}

static inline void k_walks_step(const loxo_mesh_view *m, k_walks *w)
{
    for (int i = 0; i < w->n; ++i) {
        w->to[i] = -1;
        if (w->at[i] < 0) continue;
        const loxo_index back = k_previous(w->at[i]);
        w->to[i] = m->halfedge_vertex[back];
        w->at[i] = m->halfedge_twin[back];
        if (w->at[i] == w->first[i]) w->at[i] = -1;
    }
}

static inline void k_prefetch_position(const loxo_mesh_view *m, loxo_index v)
{
    if (m->position != NULL)
        __builtin_prefetch(&m->position[v], 0, 3);
    else if (m->position_float != NULL)
        __builtin_prefetch(&m->position_float[v], 0, 3);
}

#endif
