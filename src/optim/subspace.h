/* SPDX-License-Identifier: MIT
 * A trust region whose steps are sought in the plane of the gradient and of Newton's step. */
#ifndef LOXO_OPTIM_SUBSPACE_H
#define LOXO_OPTIM_SUBSPACE_H

#include "base/context.h"

#include <stdint.h>

/* A function of n variables. Calls give LOXO_OK or fail; the function ends with what they return. */
typedef struct loxo_subspace_problem {
    loxo_context *ctx;
    int64_t n;
    void *state;
    /* rounding out: what the value may be off by. */
    loxo_status (*value)(void *state, const double *x, double *value, double *rounding);
    /* The gradient at x; products and steps are of that x until the next call. */
    loxo_status (*derivatives)(void *state, const double *x, double *gradient);
    loxo_status (*hessian_times)(void *state, const double *v, double *hv);
    /* H step = -gradient. LOXO_NOT_CONVERGED where H is singular: the plane is then a line. */
    loxo_status (*newton)(void *state, const double *gradient, double *step);
    /* How far x moved, as the tolerance counts it. */
    loxo_status (*move)(void *state, const double *from, const double *to, double *move);
} loxo_subspace_problem;

typedef struct loxo_subspace_settings {
    const char *phase;      /* for the monitor; static storage */
    double tolerance;       /* of move, of a step that was taken and that the radius did not cut short */
    int64_t max_iterations; /* steps tried */
    double radius;          /* the first, > 0: most that |d| may be */
} loxo_subspace_settings;

typedef enum loxo_subspace_stop {
    LOXO_SUBSPACE_TOLERANCE,
    LOXO_SUBSPACE_ROUNDING, /* no step lowers the value by more than it may be off by, nor the gradient */
    LOXO_SUBSPACE_MAX_ITERATIONS,
    LOXO_SUBSPACE_MONITOR,
} loxo_subspace_stop;

typedef struct loxo_subspace_info {
    loxo_subspace_stop stop_reason;
    int64_t n_iterations, n_taken, n_evaluations;
    double value;
    double move;          /* of the last step that was taken; infinite before */
    double gradient_norm; /* largest entry in size */
    double radius;
} loxo_subspace_info;

/* Makes the value at x small. A step d minimises 1/2 d . H d + g . d over |d| <= radius in the plane of g and Newton's step, where H may have
 * any sign, and is taken where the value falls. Where less is to be gained than the value may be off by, steps that do not raise it by more
 * than that are taken as long as they halve the gradient: in flat directions x is then still far off.
 * With the ratio of the fall to that of the model, below 1/4 the radius becomes half of the step's length, above 3/4 at least twice it.
 * The monitor hears of every point, its gradient and the radius.
 *   x          [n] in: where to begin; out: the best point
 * returns      LOXO_OK; LOXO_ERR_NUMERIC: the value or gradient where it begins is not finite; LOXO_ERR_MEMORY; what a call returned
 * cost         an iteration: a Newton step and two products where the last step was taken, a value; takes 6 vectors. Same bits for any number
 *              of threads as far as the calls have them
 * source       Shultz, Schnabel, Byrd 1985, A family of trust-region-based algorithms for unconstrained minimization */
loxo_status loxo_subspace_minimize(const loxo_subspace_problem *problem, const loxo_subspace_settings *settings,
                                   double *x, loxo_subspace_info *info);

/* The least 1/2 y . H y + g . y over |y| <= radius, H = [h[0] h[1]; h[1] h[2]] of any sign. Returns by how much that lies below 0. */
double loxo_disk_minimize(const double h[3], const double g[2], double radius, double y[2]);

#endif
