/* SPDX-License-Identifier: MIT
 * Spherical maps by way of the plane: stereographic projection from either pole, Laplace equations with some vertices held, and the
 * harmonic map of all faces but one. The two coordinates of the plane have arrays of their own, since equations are solved for each
 * alone. BASELINES.md */
#ifndef LOXO_SPHERE_PLANE_H
#define LOXO_SPHERE_PLANE_H

#include "algebra/cg.h"
#include "solver/sphere/sphere_internal.h"

typedef struct plane_map {
    double *x, *y; /* [n_vertices] */
} plane_map;

loxo_status plane_map_create(loxo_context *ctx, int64_t n, plane_map *h);
void plane_map_destroy(loxo_context *ctx, plane_map *h);

/* The pole of the sphere that is the plane's origin; the other one is at infinity. Seen from outside of the sphere, triangles turn
 * as they do in the plane of the north pole, and the other way round in that of the south pole. */
typedef enum plane_pole { PLANE_SOUTH = -1, PLANE_NORTH = 1 } plane_pole;

/* f = (2 x, 2 y, pole (1 - |h|^2)) / (1 + |h|^2). is_kept [n]: vertices whose f is left as it is; NULL: none. */
void plane_to_sphere(loxo_context *ctx, int64_t n, const plane_map *h, plane_pole pole, const bool *is_kept,
                     sphere_map f);
/* h = (f_x, f_y) / (1 + pole f_z), to rounding at either pole. What lies on the far pole is put beside it, at |h| = 2e8. */
void plane_from_sphere(loxo_context *ctx, int64_t n, sphere_const_map f, plane_pole pole, plane_map *h);

/* ---- Laplace equations ------------------------------------------------------------------------------------------ */

/* L_II h_I = -L_IB h_B, B the vertices held, I the others; by multigrid or a factor as the settings ask. It knows nothing but I:
 * one solver serves many h. */
typedef struct plane_solver plane_solver;

/* is_held [n_vertices], one at least; not kept.
 * returns  LOXO_OK; LOXO_ERR_MEMORY, LOXO_ERR_STOPPED, LOXO_ERR_NUMERIC, of factors LOXO_ERR_UNSUPPORTED and LOXO_ERR_LIMIT
 * cost     linear but for factors: 88 bytes a free vertex, and 130 for multigrid and conjugate gradients */
loxo_status plane_solver_create(const sphere_problem *p, const bool *is_held, plane_solver **out);
void plane_solver_destroy(plane_solver *s);
/* Moves the free vertices of h until |L h| there is at most tolerance times what it was (factors: as far as they go). Steps of
 * conjugate gradients are added to info->n_linear_steps; what rounding or 2000 steps end before the tolerance is warned of.
 * returns  LOXO_OK; LOXO_STOPPED, LOXO_ERR_NUMERIC: h is of no use; LOXO_ERR_MEMORY */
loxo_status plane_solver_solve(plane_solver *s, double tolerance, plane_map *h, loxo_sphere_info *info);

/* Warns of an equation that ended before its tolerance, unless that was by rounding and far enough. */
void plane_tell_unsolved(loxo_context *ctx, double tolerance, const loxo_cg_info *cg);

/* ---- the map without a face ------------------------------------------------------------------------------------- */

/* The harmonic map of all other faces, the corners of this one held on the unit circle in its own shape, seen from behind: the
 * others turn as they do on the surface, and this one is what lies outside.
 * returns  as the solver's; LOXO_ERR_MESH: the face is flat; LOXO_ERR_STOPPED */
loxo_status plane_map_without_face(const sphere_problem *p, int64_t face, plane_map *h, loxo_sphere_info *info);
/* Moves the mean of the vertices to 0, and scales so that the face at infinity and the one nearest to 0, seen from the other pole,
 * are of one size. */
loxo_status plane_balance(const sphere_problem *p, int64_t face, plane_map *h);
#endif
