/* SPDX-License-Identifier: MIT
 * The trust region's step by preconditioned conjugate gradients, which may meet negative curvature. */
#ifndef LOXO_OPTIM_STEIHAUG_H
#define LOXO_OPTIM_STEIHAUG_H

#include "base/context.h"

#include <stdint.h>

/* A quadratic model m(d) = g . d + 1/2 d . H d of n variables. The space may be a subspace that both callbacks keep to, with M
 * positive definite in it. */
typedef struct loxo_quadratic {
    loxo_context *ctx;
    int64_t n;
    void *state;
    loxo_status (*hessian_times)(void *state, const double *v, double *hv);
    void (*precondition)(void *state, const double *r, double *z); /* z = M r */
} loxo_quadratic;

typedef enum loxo_steihaug_stop {
    LOXO_STEIHAUG_TOLERANCE,
    LOXO_STEIHAUG_RADIUS,    /* the step ends at the trust region's border */
    LOXO_STEIHAUG_CURVATURE, /* the same, along a direction of negative curvature */
    LOXO_STEIHAUG_MAX_ITERATIONS,
    LOXO_STEIHAUG_MONITOR, /* the step so far */
} loxo_steihaug_stop;

typedef struct loxo_steihaug_info {
    loxo_steihaug_stop stop_reason;
    int64_t n_iterations; /* products with H */
    double gradient_norm; /* sqrt(g . M g) */
    double fall;          /* -m(d), not negative */
    double norm;          /* of d, sqrt(d . M^-1 d) */
} loxo_steihaug_info;

typedef struct loxo_steihaug_settings {
    double radius;    /* > 0; infinity: none, and no step goes along a direction of negative curvature */
    double tolerance; /* stops at sqrt(r . M r) <= tolerance sqrt(g . M g), */
    double unit;      /* and at (g . M g) / unit at the latest, which makes Newton's steps quadratic; 0: not asked */
    double floor;     /* and where sqrt(r . M r) is no more than this: with d = 0 where g is so small already */
    int64_t max_iterations;
} loxo_steihaug_settings;

/* Room for the vectors that it works with: [4 n]. */
#define LOXO_STEIHAUG_WORK 4

/* Finds d with |d| <= radius, |d|^2 = d . M^-1 d, that lowers the model: in a finite radius at least as much as the best multiple of -M g
 * does. Without one d is 0 where the first direction has negative curvature.
 *   g, d         [n], d out
 *   work         [LOXO_STEIHAUG_WORK n]
 * returns        LOXO_OK; LOXO_ERR_NUMERIC: a number that is not finite; LOXO_ERR_MEMORY
 * cost           a product and a precondition an iteration; same bits for any number of threads
 * source         Steihaug 1983, The conjugate gradient method and trust regions in large scale optimization; norms by the recurrences of Conn,
 *                Gould, Toint 2000, section 7.5.1 */
loxo_status loxo_steihaug(const loxo_quadratic *q, const double *g, const loxo_steihaug_settings *settings,
                          double *work, double *d, loxo_steihaug_info *info);

/* a . b, in fixed blocks. */
loxo_status loxo_dot(loxo_context *ctx, int64_t n, const double *a, const double *b, double *dot);

#endif
