/* SPDX-License-Identifier: MIT
 * Orders of vertices in memory, and the parts that fit a core's cache. */
#ifndef LOXO_MESH_REORDER_H
#define LOXO_MESH_REORDER_H

#include <loxo/mesh.h>

typedef struct loxo_reordering {
    loxo_order order;              /* the one taken; never LOXO_ORDER_AUTO */
    loxo_index *vertex_new_to_old; /* [n_vertices]; NULL when as given */
    int64_t n_parts;               /* at least 1 */
    int64_t *part_vertex;          /* [n_parts + 1] ranges in the new numbering, from 0 to n_vertices */
} loxo_reordering;

/* Computes an order and parts. The triangles may be any soup whose ids are in 0..n_vertices-1; positions may hold
 * values that are not finite at vertices that no triangle uses.
 *   part_bytes  size of a part's data; 0: what fits one core's L2
 *   out         owns two arrays of loxo_allocate; {0} on failure
 * returns  LOXO_OK; LOXO_ERR_UNSUPPORTED (METIS where it is off), LOXO_ERR_MEMORY, LOXO_ERR_STOPPED */
loxo_status loxo_reorder(loxo_context *ctx, const loxo_mesh_arrays *arrays, loxo_order order, size_t part_bytes,
                         loxo_reordering *out);
void loxo_reordering_destroy(loxo_context *ctx, loxo_reordering *r); /* frees the arrays, clears the struct */

#endif
