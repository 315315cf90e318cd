/* SPDX-License-Identifier: MIT
 * Symmetric sparse matrices, by rows. */
#ifndef LOXO_ALGEBRA_CSR_H
#define LOXO_ALGEBRA_CSR_H

#include "base/context.h"
#include "par/range.h"

/* Both triangles are stored, so that a row can be gathered. The diagonal stands apart: it is what smoothers, pins and
 * shifts want, and entries are then edges. Entries of row i are begin[i] .. begin[i + 1] - 1, their columns ascend and
 * are not i. A row without entries and with diagonal 0 belongs to a variable that is not there: solvers set it to 0.
 * 16 bytes a row and 12 an entry: 88 a vertex of a closed mesh. */
typedef struct loxo_csr {
    int64_t n_rows;
    int64_t *begin;     /* [n_rows + 1] */
    loxo_index *column; /* [begin[n_rows]] */
    double *value;      /* [begin[n_rows]] */
    double *diagonal;   /* [n_rows] */
} loxo_csr;

void loxo_csr_destroy(loxo_context *ctx, loxo_csr *a); /* frees the arrays and clears the struct */
size_t loxo_csr_bytes(const loxo_csr *a);

/* y = A x, [n_rows] each, not overlapping. */
void loxo_csr_multiply(loxo_context *ctx, const loxo_csr *a, const double *x, double *y);

/* Rows of thread i of n: shares of like cost, whole blocks of LOXO_SUM_BLOCK rows. */
loxo_range loxo_csr_share(const loxo_csr *a, int64_t i, int64_t n);

/* Sum of row i; 0 where that is within the rounding of its own terms. */
double loxo_csr_excess(const loxo_csr *a, int64_t i);

/* A <- factor A + diag(shift); shift may be NULL. Of a variable that is not there the row stays 0 where the shift is. */
void loxo_csr_scale_shift(loxo_context *ctx, loxo_csr *a, double factor, const double *shift);

/* Takes variables out: their rows and columns become those of the identity. The others keep their diagonals, as where
 * these variables are known to be 0. is_pinned [n_rows]. */
void loxo_csr_pin(loxo_context *ctx, loxo_csr *a, const bool *is_pinned);

/* Whether a solver can take it: counts, columns in range and ascending, all numbers finite, diagonals >= 0, and every
 * entry with the same value at its mirrored place (symmetric: up to 1e-12 of the diagonals).
 * returns  LOXO_OK; LOXO_ERR_ARGUMENT, naming the row
 * cost     a binary search an entry */
loxo_status loxo_csr_check(loxo_context *ctx, const loxo_csr *a);

/* Sets of variables that entries join. label [n_rows] out: the number of the set, 0 .. *n_sets - 1 in the order of their
 * lowest variables. */
loxo_status loxo_csr_components(loxo_context *ctx, const loxo_csr *a, loxo_index *label, int64_t *n_sets);

#endif
