/* SPDX-License-Identifier: MIT
 * The inverse of a map from a surface to the sphere: where on the surface is what is mapped to a point of the sphere? */
#ifndef LOXO_LOCATE_H
#define LOXO_LOCATE_H

#include <loxo/mesh.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct loxo_sphere_locator loxo_sphere_locator;

/* Prepares questions about the inverse of a map to the sphere.
 *   mesh     of the surface, with faces; must outlive the locator
 *   map      [n][3] directions, caller's order; copied
 * returns    LOXO_OK; LOXO_ERR_ARGUMENT: NULL, an intrinsic triangulation, a direction that is 0 or not finite (element); LOXO_ERR_MESH: no
 *            faces; LOXO_ERR_MEMORY
 * cost       a sort of the faces; 64 bytes a vertex held, 106 at the peak */
LOXO_API loxo_status loxo_sphere_locator_create(loxo_context *ctx, const loxo_mesh *mesh, const double *map,
                                                loxo_sphere_locator **out);
LOXO_API void loxo_sphere_locator_destroy(loxo_sphere_locator *locator);

/* The points of the surface that are mapped to points of the sphere: in which spherical triangle a direction lies, and its
 * weights there: the weighted sum of the corners' images has that direction. On an edge or at a vertex weights are 0 to the bit as rounding
 * has it; a vertex' own image gives that vertex. Of several triangles that hold it, as in a folded map, the first face that is not
 * turned over is taken; where there is none, as in a map that does not cover the sphere, the nearest point of the flat triangles.
 *   direction   [n][3] of any length
 *   point       [n] out, caller's vertices; -1 where the weight is 0
 *   away        [n] out, 0, or how far the nearest point is; may be NULL
 * returns       LOXO_OK; LOXO_ERR_ARGUMENT: NULL, a direction that is 0 or not finite (element); LOXO_ERR_STOPPED
 * cost          logarithmic a direction, on all threads; allocates nothing; same bits for any number of threads */
LOXO_API loxo_status loxo_sphere_locate(const loxo_sphere_locator *locator, int64_t n, const double *direction,
                                        loxo_surface_point *point, double *away);

#ifdef __cplusplus
}
#endif
#endif
