/* SPDX-License-Identifier: MIT
 * Algebraic multigrid by smoothed aggregation, as a preconditioner: for Laplacians of meshes, and for what is like them.
 * It knows nothing but the matrix. */
#ifndef LOXO_ALGEBRA_MULTIGRID_H
#define LOXO_ALGEBRA_MULTIGRID_H

#include "algebra/csr.h"

typedef struct loxo_multigrid loxo_multigrid;

typedef struct loxo_multigrid_info {
    int n_levels;       /* the matrix itself included */
    int64_t n_coarsest; /* variables there */
    int64_t n_grounded; /* pivots of the coarsest level that were zero: one a singular component that got there */
    double operator_complexity; /* entries of all levels over those of the first */
    size_t bytes;               /* of the hierarchy and its vectors, the matrix not counted; set-up takes no more */
} loxo_multigrid_info;

/* Makes the hierarchy. The matrix is borrowed: level 0 uses its pattern, and keeps its values in single precision.
 * Symmetric; positive definite, or semidefinite with constants on components as the null space. Entries of either sign.
 *   info     may be NULL
 * returns  LOXO_OK; LOXO_ERR_NUMERIC: a value is not finite or a diagonal negative; LOXO_ERR_MEMORY; LOXO_ERR_STOPPED;
 *          LOXO_ERR_LIMIT: prolongation of more than 2^32 entries (out of reach of 32-bit ids on meshes)
 * cost     linear; same bits for any thread count
 * source   Vanek, Mandel, Brezina 1996, Algebraic Multigrid by Smoothed Aggregation; what differs: README.md */
loxo_status loxo_multigrid_create(loxo_context *ctx, const loxo_csr *matrix, loxo_multigrid_info *info,
                                  loxo_multigrid **out);
void loxo_multigrid_destroy(loxo_multigrid *mg);
/* z = M r: one cycle from zero; symmetric, and positive on what the matrix does not map to 0. M is about the inverse, but
 * for a power of two. state is the loxo_multigrid; this is a loxo_preconditioner's apply. Allocates nothing. */
void loxo_multigrid_apply(void *state, const double *r, double *z);

#endif
