/* SPDX-License-Identifier: MIT
 * Inside of the orders: one function each. All give the same for any number of threads. */
#ifndef LOXO_MESH_REORDER_INTERNAL_H
#define LOXO_MESH_REORDER_INTERNAL_H

#include "mesh/reorder.h"

/* The corners at each vertex: corner[offset[v]] .. corner[offset[v + 1] - 1] are half-edge numbers 3 f + c, ascending. */
typedef struct loxo_fans {
    loxo_index *offset; /* [n_vertices + 1] */
    loxo_index *corner; /* [3 n_faces] */
} loxo_fans;

loxo_status loxo_fans_make(loxo_context *ctx, const loxo_mesh_arrays *arrays, loxo_fans *fans);
void loxo_fans_destroy(loxo_context *ctx, loxo_fans *fans);

/* Orders fill new_to_old [n_vertices]. is_used [n_vertices]: whether a triangle has the vertex; the others go last, in
 * their own order. */

/* Along a space-filling curve through the box of the used vertices: Hilbert's, or Morton's. */
loxo_status loxo_order_curve(loxo_context *ctx, const loxo_mesh_arrays *arrays, const unsigned char *is_used,
                             bool is_hilbert, loxo_index *new_to_old);
/* Breadth-first, component by component, each from a vertex far from its others. With part [n_vertices] (values in
 * 0..n_parts-1), part by part and breadth-first inside each; then part_vertex [n_parts + 1] receives the ranges, the
 * last one taking in the vertices that are not used. */
loxo_status loxo_order_bfs(loxo_context *ctx, const loxo_mesh_arrays *arrays, const unsigned char *is_used,
                           const loxo_index *part, int64_t n_parts, int64_t *part_vertex, loxo_index *new_to_old);

/* How often, for each vertex, a pass over the faces in their order reaches for a vertex that is neither in what a
 * second-level cache still holds nor beside it: from samples. 0 for rows, about 3 for numbers drawn at random. */
loxo_status loxo_count_jumps(loxo_context *ctx, const loxo_mesh_arrays *arrays, double *jumps_a_vertex);

#endif
