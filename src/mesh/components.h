/* SPDX-License-Identifier: MIT
 * Union-find over vertices, by several threads at once. A root is the lowest number of its set, and the number of
 * unions that joined two sets is the same in every order, so results do not depend on the threads.
 * source  Anderson, Woll 1991, Wait-free Parallel Algorithms for the Union-Find Problem */
#ifndef LOXO_MESH_COMPONENTS_H
#define LOXO_MESH_COMPONENTS_H

#include <loxo/mesh.h>

/* Root of a, halving the path on the way. */
static inline loxo_index loxo_set_find(loxo_index *parent, loxo_index a)
{
    for (;;) {
        loxo_index p = __atomic_load_n(&parent[a], __ATOMIC_RELAXED);
        if (p == a) return a;
        const loxo_index q = __atomic_load_n(&parent[p], __ATOMIC_RELAXED);
        if (q == p) return p;
        __atomic_compare_exchange_n(&parent[a], &p, q, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED);
        a = q;
    }
}

/* Joins the sets of a and b; true when they were two. */
static inline bool loxo_set_unite(loxo_index *parent, loxo_index a, loxo_index b)
{
    for (;;) {
        a = loxo_set_find(parent, a);
        b = loxo_set_find(parent, b);
        if (a == b) return false;
        const loxo_index low = a < b ? a : b;
        loxo_index high = a < b ? b : a;
        if (__atomic_compare_exchange_n(&parent[high], &high, low, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED))
            return true;
    }
}

/* Sets of vertices that faces join: parent[n_vertices] out, each vertex's the lowest of its component. Degenerate faces
 * join nothing. Returns the number of unions: components that have faces = vertices that have faces - unions. */
int64_t loxo_join_faces(loxo_context *ctx, int64_t n_vertices, int64_t n_faces, const loxo_index *triangle,
                        loxo_index *parent);

/* The same along half-edges without a twin only; where every vertex has none or two of them, loops = n_boundary -
 * unions. parent is workspace. */
int64_t loxo_join_boundary(loxo_context *ctx, int64_t n_vertices, int64_t n_faces, const loxo_index *triangle,
                           const loxo_index *twin, loxo_index *parent);

#endif
