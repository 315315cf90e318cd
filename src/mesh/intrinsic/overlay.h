/* SPDX-License-Identifier: MIT
 * From an intrinsic triangulation to its surface and back: which edges cross which, where a point of one lies on the
 * other, straight lines of one as polylines on the other. All for meshes of loxo_mesh_create_intrinsic that are traceable;
 * thread-safe, nothing is allocated. */
#ifndef LOXO_MESH_INTRINSIC_OVERLAY_H
#define LOXO_MESH_INTRINSIC_OVERLAY_H

#include "mesh/mesh_internal.h"

/* Inside a face or on its rim: a barycentric combination of the corners of half-edges 3 face, 3 face + 1, 3 face + 2;
 * weights >= 0, sum 1. */
typedef struct loxo_face_point {
    loxo_index face;
    double weight[3];
} loxo_face_point;

/* On an edge, at a share of half-edge h from its start. */
typedef struct loxo_edge_point {
    loxo_index halfedge;
    double share;
} loxo_edge_point;

/* Receives the points where a line leaves one face for the next, in order: h is of the face that is left. */
typedef void (*loxo_crossing_fn)(void *user, loxo_edge_point point);

static inline bool loxo_is_traceable(const loxo_mesh *mesh) { return mesh->crossing != NULL; }

/* Edges of the surface that the edge of h crosses; 0 where it is one of them. */
static inline int64_t loxo_edge_n_crossings(const loxo_mesh *mesh, loxo_index h)
{
    return mesh->crossing[h] > 0 ? mesh->crossing[h] : 0;
}

/* Intrinsic half-edge h as a line over the surface, from the vertex where it starts to the one where it ends: where it crosses the
 * surface's edges, [loxo_edge_n_crossings] out. Which edges those are, and that it ends at its vertex, is whole numbers and
 * always right. Returns its length as the surface tells it, which is that of h up to rounding.
 * cost  the sum, over the surface's edges that it crosses, of how often they are crossed themselves */
double loxo_trace_edge(const loxo_mesh *mesh, loxo_index h, loxo_edge_point *crossing);

/* The surface's half-edge h over the intrinsic triangulation, likewise: the crossings are told to sink, which may be NULL. */
double loxo_trace_surface_edge(const loxo_mesh *mesh, loxo_index h, loxo_crossing_fn sink, void *user);

/* The same place on the other side. Right up to the rounding of the angles at the corner from where it is looked for, the
 * nearest of its face; always a point of some face, and a corner is exactly a corner. */
loxo_face_point loxo_to_intrinsic(const loxo_mesh *mesh, const loxo_face_point *on_surface);
loxo_face_point loxo_to_surface(const loxo_mesh *mesh, const loxo_face_point *on_mesh);

/* A straight line inside one face of the intrinsic triangulation as a line over the surface: where it crosses the
 * surface's edges goes to sink, its ends to `ends`, either of which may be NULL. from and to are points of the same face. */
void loxo_trace_segment(const loxo_mesh *mesh, const loxo_face_point *from, const loxo_face_point *to,
                        loxo_crossing_fn sink, void *user, loxo_face_point ends[2]);

#endif
