/* SPDX-License-Identifier: MIT
 * Sparse Cholesky factors by CHOLMOD, where the build has it. Its supernodal module is under the GPL: no method of the
 * library's own needs it. */
#ifndef LOXO_ALGEBRA_CHOLESKY_H
#define LOXO_ALGEBRA_CHOLESKY_H

#include "algebra/csr.h"

typedef struct loxo_cholesky loxo_cholesky;

/* Known after the analysis, before any number is computed. */
typedef struct loxo_cholesky_info {
    size_t factor_bytes; /* of the factor and of the work on it, once it is there */
    double n_entries;    /* of the factor */
    double n_flops;
} loxo_cholesky_info;

/* Bytes of a factor of a mesh's Laplacian, without a look at it: a line through those of bumpy spheres, of 71, 96 and 90
 * entries a row at 1e4, 2.5e5 and 1e6 vertices (CHOLMOD takes the best of several orders); grids take a tenth less. */
size_t loxo_cholesky_guess_bytes(int64_t n_rows);

/* Whether this build knows CHOLMOD and it can be loaded; without it create gives LOXO_ERR_UNSUPPORTED. */
bool loxo_cholesky_is_there(void);

/* Fill-reducing order and symbolic factor of a positive definite matrix. Variables that are not there count as rows of
 * the identity, singular ones must have been pinned. CHOLMOD allocates by itself, outside of the context's meter; but what the
 * factor will take is held against the context's limit.
 *   info     may be NULL; set also where the factor would not fit
 * returns  LOXO_OK; LOXO_ERR_MEMORY; LOXO_ERR_LIMIT; LOXO_ERR_UNSUPPORTED */
loxo_status loxo_cholesky_create(loxo_context *ctx, const loxo_csr *matrix, loxo_cholesky_info *info,
                                 loxo_cholesky **out);
/* The same for symmetric matrices of any sign: A = L D L^T, D diagonal with negative entries, too, without exchanges of rows for the sake of
 * numbers. Where a pivot is much smaller than the entries below it, digits are lost: look at the residual of a solve. Columns one
 * by one, some 10 times slower than above; no BLAS, so the same bits always.
 *   fixed   a variable that is known, its row and column as of the identity; -1: none */
loxo_status loxo_cholesky_create_indefinite(loxo_context *ctx, const loxo_csr *matrix, int64_t fixed,
                                            loxo_cholesky_info *info, loxo_cholesky **out);
/* Computes the factor from a matrix with the entries that were analyzed; again for other values. LOXO_ERR_NUMERIC: not
 * positive definite, or of an indefinite one a pivot that is 0 or not finite (element is a variable where that shows). Its bits may
 * depend on the threads of the BLAS. */
loxo_status loxo_cholesky_factor(loxo_cholesky *cholesky, const loxo_csr *matrix);
/* x = A^-1 b; may be in place. Allocates some vectors. */
loxo_status loxo_cholesky_solve(loxo_cholesky *cholesky, const double *b, double *x);
/* Of a positive definite matrix: blocks of A^-1, one a group of variables: group g has n = begin[g + 1] - begin[g] of them, variable[begin[g]] and on. inverse
 * out: of each group the rows of its block's lower triangle, n (n + 1) / 2 numbers. A unit vector meets only its ancestors
 * in the elimination tree on its way through L, which costs little beside a solve, and n^2 / 2 products of such vectors.
 * returns  LOXO_OK, LOXO_ERR_MEMORY; takes 12 bytes a row while it works, and as many an ancestor of each variable */
loxo_status loxo_cholesky_inverse(const loxo_cholesky *cholesky, int64_t n_groups, const int64_t *begin,
                                  const loxo_index *variable, double *inverse);
void loxo_cholesky_destroy(loxo_cholesky *cholesky);

#endif
