/* SPDX-License-Identifier: MIT
 * The first part of unfolding. */
#ifndef LOXO_SOLVER_SPHERE_UNFOLD_H
#define LOXO_SOLVER_SPHERE_UNFOLD_H

#include "solver/sphere/sphere_internal.h"

/* Algorithm 2, cluster by cluster, as long as that leaves fewer triangles turned over. is_folded, folds: of f, in and out.
 * returns  LOXO_OK; LOXO_STOPPED; LOXO_ERR_MEMORY */
loxo_status sphere_unfold_mean_value(const sphere_problem *p, sphere_map f, bool *is_folded, sphere_folds *folds);

#endif
