/* SPDX-License-Identifier: MIT
 * Preconditioned conjugate gradients for symmetric positive definite and semidefinite systems. */
#ifndef LOXO_ALGEBRA_CG_H
#define LOXO_ALGEBRA_CG_H

#include "algebra/csr.h"

/* z = M r, M symmetric and positive definite on what the matrix does not map to 0. */
typedef struct loxo_preconditioner {
    void (*apply)(void *state, const double *r, double *z);
    void *state;
} loxo_preconditioner;

/* z_i = r_i / a_ii; state is the loxo_diagonal. Only a yardstick: use multigrid. */
typedef struct loxo_diagonal {
    loxo_context *ctx;
    const loxo_csr *matrix;
} loxo_diagonal;
void loxo_diagonal_apply(void *diagonal, const double *r, double *z);

typedef struct loxo_cg_settings {
    double tolerance; /* |b - A x| / |b| */
    int64_t max_iterations;
    /* Called after every iteration with x as it then is and the relative residual; may be NULL. */
    void (*look)(void *user, int64_t iteration, const double *x, double residual);
    void *look_user;
} loxo_cg_settings;

loxo_cg_settings loxo_cg_settings_default(void); /* 1e-8, 500 */

typedef enum loxo_cg_stop {
    LOXO_CG_TOLERANCE,
    LOXO_CG_MAX_ITERATIONS,
    LOXO_CG_MONITOR,
    LOXO_CG_INDEFINITE, /* p . A p or r . M r was not positive: the matrix or the preconditioner is not definite */
    LOXO_CG_STALLED,    /* the residual that was carried along met the tolerance, the true one will not: rounding */
} loxo_cg_stop;

typedef struct loxo_cg_info {
    loxo_cg_stop stop_reason;
    int64_t n_iterations;
    double residual;     /* |b - A x| / |b| of the x returned, computed anew; b without what no x can meet */
    double inconsistent; /* share of |b| that lay in the null space and was taken out */
} loxo_cg_info;

typedef struct loxo_cg loxo_cg;

/* Prepares solves with a matrix, which must outlive it. The sets of variables that entries join are found; a set whose
 * rows all sum to zero is singular: its constants are the null space (natural boundary conditions, each component of its
 * own). Of b its mean is taken out there, and the x returned has mean zero. Variables that are not there get 0. */
loxo_status loxo_cg_create(loxo_context *ctx, const loxo_csr *matrix, loxo_cg **out);
void loxo_cg_destroy(loxo_cg *cg);
size_t loxo_cg_bytes(int64_t n_rows); /* of the workspace: 24 a row; 4 more where there are several components */
int64_t loxo_cg_n_singular(const loxo_cg *cg); /* sets whose constants are free */

/* x [n_rows]: in, where to start; out, the solution.
 * Of 2^k b, and a start times as much, the solution has the same bits but for its exponents.
 * returns  LOXO_OK; LOXO_NOT_CONVERGED, LOXO_STOPPED: x is the last state; LOXO_ERR_NUMERIC: b, the start or the solution
 *          is not finite, or the start 10^150 times as large as what b asks for
 * cost     an iteration reads the matrix once and moves 88 bytes a row; same bits for any thread count
 * source   Hestenes, Stiefel 1952 */
loxo_status loxo_cg_solve(loxo_cg *cg, const loxo_preconditioner *m, const loxo_cg_settings *settings, const double *b,
                          double *x, loxo_cg_info *info);

#endif
