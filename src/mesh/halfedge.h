/* SPDX-License-Identifier: MIT
 * Half-edges from triangles: who is whose twin, where a vertex's fan begins, how faces must be turned to agree.
 * Half-edge h = 3 f + c runs from corner c of face f to the next corner. */
#ifndef LOXO_MESH_HALFEDGE_H
#define LOXO_MESH_HALFEDGE_H

#include <loxo/mesh.h>

static inline loxo_index loxo_halfedge_next(loxo_index h) { return (loxo_index)(h % 3 == 2 ? h - 2 : h + 1); }
static inline loxo_index loxo_halfedge_previous(loxo_index h) { return (loxo_index)(h % 3 == 0 ? h + 2 : h - 1); }

/* What the half-edges between the same two vertices, taken together as an edge, are like. */
typedef struct loxo_edge_counts {
    int64_t n_edges;
    int64_t n_boundary;        /* one half-edge */
    int64_t n_nonmanifold;     /* more than two */
    int64_t n_same_way;        /* two, both in the same direction: their faces are oriented against each other */
    int64_t first_nonmanifold; /* lowest half-edge on such an edge, -1 */
} loxo_edge_counts;

/* Links the half-edges of every edge: twin[h] = -1 at a boundary, the other one where there are two (whatever their
 * directions); more than two form a ring, each linked to the next lower one and the lowest to the highest, so that in
 * every case the lowest half-edge h of an edge is the one with twin[h] < 0 or twin[h] > h.
 * Degenerate faces take no part: the twins of their half-edges are LOXO_NO_EDGE.
 *   triangle  [n_faces][3], ids in range
 *   twin      [3 n_faces] out
 * returns  LOXO_OK, LOXO_ERR_MEMORY
 * cost     linear time (a vertex with k edges: k log k); 12 bytes a face and 8 a vertex of workspace
 * How: half-edges are counted into buckets of the lower one of their two vertices; all half-edges of an edge then meet
 * in one bucket, where they are matched by the other vertex. Buckets are independent of each other. */
#define LOXO_NO_EDGE ((loxo_index)-2)
loxo_status loxo_match_halfedges(loxo_context *ctx, int64_t n_vertices, int64_t n_faces, const loxo_index *triangle,
                                 loxo_index *twin, loxo_edge_counts *counts);

/* True where h is one of exactly two half-edges of its edge. */
static inline bool loxo_is_paired(const loxo_index *twin, loxo_index h) { return twin[h] >= 0 && twin[twin[h]] == h; }

/* A half-edge that leaves each vertex, the lowest one without a twin if there is one, else the lowest; -1 at vertices
 * without faces. Pairs must run against each other, and there must be no edge with more than two half-edges.
 * Returns the number of half-edges met by turning around all vertices: less than 3 n_faces when some vertex has more
 * than one fan. Allocates nothing. */
int64_t loxo_link_vertices(loxo_context *ctx, int64_t n_vertices, int64_t n_faces, const loxo_index *triangle,
                           const loxo_index *twin, loxo_index *vertex_halfedge);

/* Corners of vertex v that turning both ways around it from corner h (a half-edge that starts at v) meets, over paired
 * edges only, whatever the directions of the half-edges. */
int64_t loxo_fan_size(const loxo_index *triangle, const loxo_index *twin, loxo_index h);

/* Which faces must be turned so that faces on both sides of every paired edge agree; in every piece of faces joined by
 * paired edges the fewer are turned (at a tie the lowest face of the piece stays as it is).
 *   turn        [n_faces] out, 0 or 1
 *   n_turned    out
 *   conflict    out: -1, or the face where a breadth-first walk met itself the wrong way round: not orientable; turn
 *               then holds the walk's state, and other pieces are still right
 * returns  LOXO_OK, LOXO_ERR_MEMORY; 4 bytes a face of workspace */
loxo_status loxo_find_orientation(loxo_context *ctx, int64_t n_faces, const loxo_index *triangle,
                                  const loxo_index *twin, uint8_t *turn, int64_t *n_turned, int64_t *conflict);

/* Swaps two corners of the marked faces. Twins are to be matched anew. */
void loxo_turn_faces(loxo_context *ctx, int64_t n_faces, const uint8_t *turn, loxo_index *triangle);

#endif
