/* SPDX-License-Identifier: MIT
 * Small dense systems. */
#ifndef LOXO_ALGEBRA_DENSE_H
#define LOXO_ALGEBRA_DENSE_H

#include <stdint.h>

/* L D L^T = A in place, A symmetric and positive semidefinite; a [n (n + 1) / 2]: the rows of its lower triangle, one after
 * the other. L has a unit diagonal, and D stands in its place. A pivot that is not above tolerance times the diagonal that it was before elimination belongs to a
 * direction that A maps to zero, within rounding: it is replaced by infinity, and solving gives 0 there. For a Laplacian
 * that grounds one variable a component. Returns how many were. */
int64_t loxo_dense_factor(int64_t n, double *a, double tolerance);
/* x = A^- x; x [n] */
void loxo_dense_solve(int64_t n, const double *factor, double *x);

#endif
