/* SPDX-License-Identifier: MIT
 * The Hessian of the conformal energy in the chart, assembled; how far two maps are apart. */
#ifndef LOXO_SOLVER_SPHERE_HBTR_INTERNAL_H
#define LOXO_SOLVER_SPHERE_HBTR_INTERNAL_H

#include "kernel/chart_kernel.h"
#include "solver/sphere/sphere_internal.h"

/* Angles are kept vertex by vertex, theta_i in place 2 i and phi_i in 2 i + 1, so that H is made of 2 x 2 blocks where L has entries (Theorem 1,
 * Remark 3). */

/* frame [n_vertices] out: the points at angles x [2 n_vertices]. */
void hbtr_find_frames(const sphere_problem *p, const double *x, k_chart_frame *frame);

/* Rows and columns of H, values not set: of the entries of L and the edges of the mesh, which are the same unless the weights are those of
 * another triangulation.
 *   h        out, freed by loxo_csr_destroy
 * returns    LOXO_OK; LOXO_ERR_LIMIT: twice the vertices are more than ids can tell apart; LOXO_ERR_MEMORY */
loxo_status hbtr_create_pattern(const sphere_problem *p, loxo_csr *h);

/* Gradient (3.15), [2 n_vertices] out, and the values of H, Theorem 3, at the points of the frames; h NULL: the gradient alone. Both
 * triangles have the same bits. Linear. */
void hbtr_fill(const sphere_problem *p, const k_chart_frame *frame, double *gradient, loxo_csr *h);

/* ---- rotation.c ------------------------------------------------------------------------------------------------ */

/* The rotation r with the least sum |to_i - r from_i|^2, from m = sum to_i from_i^T; where several do, the one that turns least. Horn 1987. */
void sphere_find_rotation(const double m[3][3], double r[3][3]);
/* (4.4): that sum, squares of the differences that are left. */
loxo_status sphere_find_move(loxo_context *ctx, int64_t n, sphere_const_map from, sphere_const_map to, double *move);

#endif
