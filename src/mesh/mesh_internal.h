/* SPDX-License-Identifier: MIT
 * Inside of a mesh, and the way of numbers between the caller's vertices and the mesh's own. Solvers work on the view
 * and use the last three functions. */
#ifndef LOXO_MESH_MESH_INTERNAL_H
#define LOXO_MESH_MESH_INTERNAL_H

#include <loxo/mesh.h>

struct loxo_mesh {
    loxo_context *ctx;
    loxo_mesh_view view;
    int64_t n_caller_vertices; /* what results are given for */
    /* What the view shows and the mesh frees; NULL where it is the caller's or absent. */
    double *position;
    float *position_float;
    loxo_index *halfedge_vertex, *halfedge_twin, *vertex_halfedge, *vertex_origin;
    int64_t *part_vertex, *part_face;
    /* [n_caller_vertices] the mesh's number of each, -1 where the vertex was dropped; only where a repair welded or
     * split, so that vertex_origin is no permutation. */
    loxo_index *caller_to_mesh;
    /* Of an intrinsic triangulation; NULL in other meshes. What the view shows and the surface has, stays the surface's:
     * positions, vertex_origin, caller_to_mesh, parts. */
    const loxo_mesh *surface;
    double *halfedge_length;
    int32_t *crossing;        /* [3 n_faces] and */
    loxo_index *surface_next; /* [3 n_faces] as in intrinsic/crossings.h; NULL: not traceable */
    double lengthened;        /* added to every edge of the surface */
};

/* Results per vertex, from the mesh's order to the caller's: own [view.n_vertices], caller [n_caller_vertices], not
 * overlapping. Vertices that a repair welded share one result; of a vertex that it split, the smallest is given. */
void loxo_mesh_scatter_to_caller(const loxo_mesh *mesh, const double *own, double *caller);

/* The mesh's number of a caller's vertex, -1 when it is out of range or was dropped. Looks through the permutation
 * where there is one: for a few. */
loxo_index loxo_mesh_index_from_caller(const loxo_mesh *mesh, int64_t caller_vertex);

/* Many at once: own[i] of caller[i], -1 as above. May be in place. Allocates an inverse permutation for its time.
 * LOXO_OK, LOXO_ERR_MEMORY. */
loxo_status loxo_mesh_indices_from_caller(const loxo_mesh *mesh, int64_t n, const loxo_index *caller, loxo_index *own);

#endif
