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

/* Of a mesh that has positions. */
static inline void k_prefetch_position(const loxo_mesh_view *m, loxo_index v)
{
    if (m->position != NULL)
        __builtin_prefetch(&m->position[v], 0, 3);
    else
        __builtin_prefetch(&m->position_float[v], 0, 3);
}

/* One walk waits for memory at each half-edge. So K_BESIDE vertices are walked around side by side, and their rings written
 * down: neighbours counter-clockwise, as k_around_next gives them. A ring of more than K_RING is not written down. */
#define K_BESIDE 16
#define K_RING   12
typedef struct k_rings {
    int n;
    loxo_index vertex[K_BESIDE];
    int n_spokes[K_BESIDE]; /* 0: a vertex without faces; K_RING + 1: too many */
    bool is_open[K_BESIDE];
    loxo_index to[K_RING + 1][K_BESIDE];
    loxo_index halfedge[K_RING + 1]
                       [K_BESIDE]; /* along the spoke, from the vertex; of the last of an open ring, to it */
} k_rings;

/* The rings of n <= K_BESIDE vertices. by_vertex: an array whose elements of the neighbours will be looked at, of `size` bytes. */
static inline void k_rings_walk(const loxo_mesh_view *m, k_rings *r, const void *by_vertex, size_t size)
{
    int walking[K_BESIDE], n = 0;
    loxo_index at[K_BESIDE], first[K_BESIDE];
    for (int i = 0; i < r->n; ++i) {
        at[i] = first[i] = m->vertex_halfedge[r->vertex[i]];
        r->n_spokes[i] = 0;
        r->is_open[i] = false;
        walking[n] = i;
        n += at[i] >= 0;
    }
    for (int k = 0; n > 0 && k < K_RING; ++k) {
        int n_left = 0;
        for (int j = 0; j < n; ++j) {
            const int i = walking[j];
            const loxo_index h = at[i], back = k_previous(h), to = k_head(m, h), after = m->halfedge_twin[back];
            r->to[k][i] = to;
            r->halfedge[k][i] = h;
            r->n_spokes[i] = k + 1;
            __builtin_prefetch((const char *)by_vertex + (size_t)to * size, 0, 3);
            at[i] = after;
            if (after >= 0) {
                walking[n_left] = i;
                n_left += after != first[i];
                continue;
            }
            r->is_open[i] = true;
            r->n_spokes[i] = k + 2;
            r->to[k + 1][i] = m->halfedge_vertex[back];
            r->halfedge[k + 1][i] = back;
        }
        n = n_left;
    }
    for (int j = 0; j < n; ++j)
        r->n_spokes[walking[j]] = K_RING + 1;
}

#endif
