/* SPDX-License-Identifier: MIT
 * METIS: parts of a mesh, and its nested dissection. Seen only here. METIS takes memory of its own (checked against the
 * context's limit beforehand by a measured figure), draws from rand() after seeding it, and for the time of the call
 * catches SIGABRT and SIGTERM: it is used only where it is asked for. */
#ifndef LOXO_MESH_PARTITION_H
#define LOXO_MESH_PARTITION_H

#include <loxo/mesh.h>

/* part [n_vertices]: 0..n_parts-1, sizes even to 3 %, few edges between parts.
 * returns  LOXO_OK, LOXO_ERR_UNSUPPORTED (METIS is off), LOXO_ERR_LIMIT (more arcs than METIS's numbers reach),
 *          LOXO_ERR_MEMORY
 * cost     about 2 us a vertex, 130 bytes a vertex */
loxo_status loxo_partition_parts(loxo_context *ctx, const loxo_mesh_arrays *arrays, int64_t n_parts, loxo_index *part);
/* new_to_old [n_vertices]: an order of little fill for a direct solver; vertices that are not used go last. */
loxo_status loxo_partition_dissect(loxo_context *ctx, const loxo_mesh_arrays *arrays, const unsigned char *is_used,
                                   loxo_index *new_to_old);

#endif
