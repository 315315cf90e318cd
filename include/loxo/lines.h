/* SPDX-License-Identifier: MIT
 * Lines on a surface: where a field has a value, and ways that go down a field. */
#ifndef LOXO_LINES_H
#define LOXO_LINES_H

#include <loxo/mesh.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Lines of points that lie at vertices, on edges, and at the ends of ways also inside faces; two neighbours of a line lie in
 * one face. All arrays come from loxo_allocate. */
typedef struct loxo_polylines {
    int64_t n_lines, n_points;
    int64_t *line_begin; /* [n_lines + 1] points of line i are line_begin[i] .. line_begin[i + 1] - 1: two at least, or
                            none, of a way that there is not */
    double *value;       /* [n_lines] what the line is of: the field's value on it, or where it begins */
    bool *is_closed;     /* [n_lines] the first point stands at the end again, to the bit */
    loxo_surface_point *point; /* [n_points] */
    double (*position)[3];     /* [n_points] */
} loxo_polylines;

LOXO_API void loxo_polylines_destroy(loxo_context *ctx,
                                     loxo_polylines *lines); /* frees the arrays and clears the struct */
LOXO_API double loxo_polyline_length(const loxo_polylines *lines, int64_t line);

/* Where a field, linear on every face, has given values.
 * A vertex that has the value exactly counts as a little above it: so every line is a closed loop or ends at the boundary
 * twice, no lines meet, and no line runs along both sides of a face that has the value all over. Lines have what is above on
 * their right, seen from outside. Faces with a corner that is not finite are as if they were not there.
 *   field    [n_vertices] caller's order
 *   level    [n_levels] finite; repeats are fine
 *   lines    out, level by level; freed by loxo_polylines_destroy
 * returns    LOXO_OK; LOXO_ERR_ARGUMENT: NULL, a level not finite (element), an intrinsic triangulation; LOXO_ERR_MEMORY;
 *            LOXO_ERR_STOPPED
 * cost       a pass over the faces a level, some 5 ns a face, and the lines */
LOXO_API loxo_status loxo_isolines(loxo_context *ctx, const loxo_mesh *mesh, const double *field, const double *level,
                                   int64_t n_levels, loxo_polylines *lines);

/* ---- landmarks ------------------------------------------------------------------------------------------------ */

/* Named points and curves of a surface: what is one point is a point, what is more is a curve through them in their order. Several may
 * have one name. All arrays come from loxo_allocate. */
typedef struct loxo_landmarks {
    int64_t n_curves, n_points;
    char (*name)[64];     /* [n_curves] longer ones are cut */
    bool *is_closed;      /* [n_curves] the curve goes on from its last point to its first */
    int64_t *curve_begin; /* [n_curves + 1] points of curve i: curve_begin[i] .. curve_begin[i + 1] - 1, one at least */
    loxo_surface_point *point; /* [n_points] caller's vertices; all three are -1 where a point is not located yet ... */
    double (*position)[3];     /* [n_points] ... and is the surface's nearest to this */
} loxo_landmarks;

LOXO_API void loxo_landmarks_destroy(loxo_context *ctx,
                                     loxo_landmarks *landmarks); /* frees the arrays and clears the struct */
/* Points that are given by position go to the surface (loxo_mesh_nearest_points); the others are checked: vertices of the mesh that
 * have faces, weights >= 0, made to sum to 1.
 *   away     out, how far the farthest was from the surface; may be NULL
 * returns    LOXO_OK; LOXO_ERR_ARGUMENT (element: the point), LOXO_ERR_MESH, LOXO_ERR_MEMORY, LOXO_ERR_STOPPED */
LOXO_API loxo_status loxo_landmarks_locate(const loxo_mesh *mesh, loxo_landmarks *landmarks, double *away);

#ifdef __cplusplus
}
#endif
#endif
