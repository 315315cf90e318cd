/* SPDX-License-Identifier: MIT
 * Edge flips in an intrinsic triangulation. */
#ifndef LOXO_MESH_INTRINSIC_FLIP_H
#define LOXO_MESH_INTRINSIC_FLIP_H

#include <loxo/mesh.h>

/* A triangulation that is being changed: arrays of a view, its own. */
typedef struct loxo_flips {
    loxo_context *ctx;
    int64_t n_vertices, n_faces;
    loxo_index *halfedge_vertex, *halfedge_twin, *vertex_halfedge;
    double *length;           /* [3 n_faces] twins the same bits */
    double *cotangent;        /* [3 n_faces] of the opposite angles */
    int32_t *crossing;        /* [3 n_faces] as in intrinsic.h, and */
    loxo_index *surface_next; /* [3 n_faces]; both NULL: not kept */
    const loxo_index *surface_twin;
    double tolerance;
    int64_t most_flips; /* 0: as many as it takes */
    int64_t n_flips;
} loxo_flips;

/* Flips edges until the cotangents of the angles opposite each interior edge sum to -tolerance at least, or rounding
 * leaves no flip that makes the triangles rounder. cotangent is to be filled before.
 * returns  LOXO_OK; LOXO_NOT_CONVERGED (most_flips); LOXO_ERR_STOPPED; LOXO_ERR_LIMIT (an edge that is crossed by more
 *          than 2^31 - 1). The triangulation is whole in any case. */
loxo_status loxo_flip_to_delaunay(loxo_flips *t);

#endif
