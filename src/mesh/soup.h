/* SPDX-License-Identifier: MIT
 * What check, repair and the half-edge mesh share about triangle soup: validation, faces sorted by their smallest
 * vertex, duplicates. Everything here is linear in time and gives the same result for every number of threads. */
#ifndef LOXO_MESH_SOUP_H
#define LOXO_MESH_SOUP_H

#include "base/context.h"

#include <loxo/mesh.h>

#include <math.h>

static inline bool loxo_is_degenerate(const loxo_index *corner)
{
    return corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0];
}

static inline loxo_index loxo_smallest_corner(const loxo_index *corner)
{
    const loxo_index m = corner[0] < corner[1] ? corner[0] : corner[1];
    return m < corner[2] ? m : corner[2];
}

/* Position of vertex v in double, from whichever array is there. */
static inline void loxo_arrays_position(const loxo_mesh_arrays *arrays, int64_t v, double p[3])
{
    for (int k = 0; k < 3; ++k)
        p[k] = arrays->position != NULL ? arrays->position[3 * v + k] : (double)arrays->position_float[3 * v + k];
}

static inline bool loxo_arrays_finite(const loxo_mesh_arrays *arrays, int64_t v)
{
    double p[3];
    loxo_arrays_position(arrays, v, p);
    return isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]);
}

/* Pointers, counts, alignment: LOXO_ERR_ARGUMENT, LOXO_ERR_LIMIT (ids run out). Reads no element. */
loxo_status loxo_arrays_check_counts(loxo_context *ctx, const char *who, const loxo_mesh_arrays *arrays);

/* Every vertex number of every face is in range (else LOXO_ERR_MALFORMED naming the first such face); counts the
 * degenerate faces on the way. first_degenerate is -1 when there is none. */
loxo_status loxo_arrays_check_ids(loxo_context *ctx, const loxo_mesh_arrays *arrays, int64_t *n_degenerate,
                                  int64_t *first_degenerate);

/* Every vertex that a face uses is finite, else LOXO_ERR_MALFORMED naming the lowest. Ids must be in range. */
loxo_status loxo_arrays_check_finite(loxo_context *ctx, const loxo_mesh_arrays *arrays);

/* Faces by (smallest vertex, number): face_order[n_faces] out, begin[n_vertices + 1] out: the faces whose smallest
 * vertex is v are face_order[begin[v]..begin[v + 1] - 1], ascending. Allocates nothing. */
void loxo_sort_faces(loxo_context *ctx, int64_t n_vertices, int64_t n_faces, const loxo_index *triangle,
                     loxo_index *face_order, int64_t *begin);

/* The middle step of a counting sort into n buckets, begin[n + 1]: on entry begin[0] is 0 and begin[i + 1] the size of
 * bucket i, on return begin[i + 1] is where bucket i starts. Filling moves it on to where bucket i ends. */
void loxo_bucket_starts(loxo_context *ctx, int64_t n, int64_t *begin);

/* duplicate[f] = 1 where a face of a lower number has the same three vertices, in either orientation, else 0.
 * Degenerate faces are never marked. */
loxo_status loxo_mark_duplicate_faces(loxo_context *ctx, int64_t n_vertices, int64_t n_faces,
                                      const loxo_index *triangle, uint8_t *duplicate);

/* first[v] = lowest vertex with the same position (v itself when there is none lower); -0 equals 0; vertices that are
 * not finite are only equal to themselves. */
loxo_status loxo_find_duplicate_vertices(loxo_context *ctx, const loxo_mesh_arrays *arrays, loxo_index *first);

/* A new array, to[i] = from[origin[i]], i < n, for items of size bytes; NULL without memory. */
void *loxo_gather(loxo_context *ctx, const void *from, const loxo_index *origin, int64_t n, size_t size);

/* The soup's vertices become those in origin[n], in that order, with positions and fields; triangles are left. The
 * soup changes only when all of it is there. LOXO_OK, LOXO_ERR_MEMORY. */
loxo_status loxo_soup_gather_vertices(loxo_context *ctx, loxo_soup *soup, const loxo_index *origin, int64_t n);

#endif
