/* SPDX-License-Identifier: MIT
 * The cotangent matrix and the lumped areas of a mesh. */
#ifndef LOXO_OPERATOR_LAPLACIAN_H
#define LOXO_OPERATOR_LAPLACIAN_H

#include "algebra/csr.h"

#include <loxo/mesh.h>

/* C, positive semidefinite, with c_ij = -(cot a + cot b) / 2 for the angles opposite edge ij: u . C u is twice the
 * Dirichlet energy of the piecewise linear function u. Only lengths are used: on an intrinsic triangulation several
 * edges between two vertices are added up, and an edge from a vertex to itself adds nothing. At a boundary an edge has
 * one angle (natural, Neumann conditions). How faces without area are bounded stands in laplacian_kernel.h.
 *   a        out, freed by loxo_csr_destroy; rows in the mesh's order; a vertex without faces has an empty row
 *   mass     [n_vertices] out, a third of the areas of the faces around; may be NULL
 * returns  LOXO_OK, LOXO_ERR_MEMORY, LOXO_ERR_STOPPED
 * cost     linear; 72 bytes a vertex of workspace beside the matrix; same bits for any thread count */
loxo_status loxo_laplacian_create(loxo_context *ctx, const loxo_mesh_view *m, loxo_csr *a, double *mass);
/* Bytes that it takes at most while it works, the matrix included. */
size_t loxo_laplacian_bytes(int64_t n_vertices, int64_t n_faces, int64_t n_boundary_edges);

#endif
