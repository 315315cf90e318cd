/* SPDX-License-Identifier: MIT
 * Solvers of a Laplacian side by side. */
#ifndef LOXO_BENCH_LAPLACE_H
#define LOXO_BENCH_LAPLACE_H

#include "algebra/csr.h"

#define LAPLACE_TOLERANCE 1e-8

typedef struct laplace_result {
    double setup_s, solve_s;
    int64_t n_steps; /* 0: direct */
    double levels, complexity;
    size_t held_bytes; /* resident after the solve, less before the set-up; of ours the most that was allocated */
} laplace_result;

/* Seconds: of one thread its processor time, which others on the machine disturb less. */
double laplace_clock_s(const loxo_context *ctx);
size_t laplace_resident_bytes(void); /* of this process, now */
/* BoomerAMG of hypre below its own conjugate gradients, one process. The matrix is definite. */
loxo_status laplace_by_hypre(loxo_context *ctx, const loxo_csr *a, const double *b, double *x, laplace_result *result);

#endif
