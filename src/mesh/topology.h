/* SPDX-License-Identifier: MIT
 * Cycles that a surface cannot be cut free of: what line integrals must vanish along so that a closed field of
 * differences is that of a function. */
#ifndef LOXO_MESH_TOPOLOGY_H
#define LOXO_MESH_TOPOLOGY_H

#include <loxo/mesh.h>

/* Chains of half-edges, head to tail. */
typedef struct loxo_chains {
    int64_t n_chains, n_left_out; /* left out: those that would have made the chains longer than the mesh */
    int64_t *chain_begin;         /* [n_chains + 1] */
    loxo_index *halfedge;
    int8_t *sign; /* +1 the half-edge is walked along its direction, -1 against it */
} loxo_chains;

/* A basis of the cycles that bound nothing: 2 genus + (boundary loops - 1 where there are any) a component, closed
 * chains, short by way of breadth-first trees. None, at no cost, where the view says genus 0 and at most one loop.
 * Together the chains have at most about a quarter as many elements as the mesh has vertices; the rest is left out and
 * counted: surfaces of high genus would need chains longer than the mesh.
 *   out      freed by loxo_chains_destroy; all NULL where there is none
 * returns  LOXO_OK, LOXO_ERR_MEMORY, LOXO_ERR_STOPPED
 * cost     linear in the mesh plus the chains' length; 24 bytes a vertex of workspace
 * source   Eppstein 2003, Dynamic Generators of Topologically Embedded Graphs (tree-cotree decomposition) */
loxo_status loxo_cycle_basis(loxo_context *ctx, const loxo_mesh_view *mesh, loxo_chains *out);
/* Bytes that it takes at most while it works. */
size_t loxo_cycle_basis_bytes(int64_t n_vertices, int64_t n_faces, int64_t n_boundary_edges);
void loxo_chains_destroy(loxo_context *ctx, loxo_chains *chains);

#endif
