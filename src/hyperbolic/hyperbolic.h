/* SPDX-License-Identifier: MIT
 * Conformal barycenter of weighted points of the sphere S^(d-1), in Poincare's ball; see README.md for what is used and why it
 * is true. */
#ifndef LOXO_HYPERBOLIC_HYPERBOLIC_H
#define LOXO_HYPERBOLIC_HYPERBOLIC_H

#include <loxo/context.h>

#include <stdint.h>

#define HYPER_MOST_DIMENSIONS 64
#define HYPER_MOST_SHIFTS     16

/* Points of the sphere, read where they lie. */
typedef struct hyper_atoms {
    int64_t n;
    int d;                /* of the space, 2 to HYPER_MOST_DIMENSIONS */
    const double *x;      /* [n][d]; or */
    const float *x_float; /* [n][d] */
    const double *weight; /* [n]; NULL: all alike */
    bool is_unit;         /* |x| is 1 to rounding of doubles; else x / |x| is meant */
} hyper_atoms;

/* Mean and mean of squares of the atoms as seen from a point of the ball. */
typedef struct hyper_moments {
    double weight;                      /* of all atoms */
    double mean[HYPER_MOST_DIMENSIONS]; /* sum of p y over the weight: 2 F, |F|_g = |mean| */
    double second[HYPER_MOST_DIMENSIONS * (HYPER_MOST_DIMENSIONS + 1) /
                  2]; /* sum of p y y^T, rows of the upper triangle */
} hyper_moments;

/* moments.c: LOXO_ERR_MEMORY. The same bits for any number of threads. */
loxo_status hyper_find_moments(loxo_context *ctx, const hyper_atoms *atoms, const double *w, double co,
                               hyper_moments *out);
/* Adds p, p v and p v v^T (rows of the upper triangle) of n unit vectors x [n][d], as kernel/moment_kernel.h does for d = 2, 3. */
void hyper_add_moments(int d, const double *x, const double *weight, int64_t n, const double *w, double co,
                       double *sums);
/* Looks at the atoms, and from the centre, in one read of them. LOXO_ERR_ARGUMENT, with the atom's number as element: a weight that is negative
 * or not finite, a point that is not within 1e-6 of the sphere; no weight at all. LOXO_ERR_MEMORY. is_unit is set; first: out. */
loxo_status hyper_check_atoms(loxo_context *ctx, const char *who, hyper_atoms *atoms, hyper_moments *first);
/* y = sigma_w(x), [n][d]; the same atoms shifted. */
void hyper_shift_atoms(loxo_context *ctx, const hyper_atoms *atoms, const double *w, double co, double *y);

/* How much of the weight sits in one point decides whether there is a barycenter (README.md). */
typedef enum hyper_class {
    HYPER_STABLE,     /* no point has half of the weight: there is one */
    HYPER_NOT_UNIQUE, /* two points have half of it each: every point of the geodesic between them is one */
    HYPER_NONE        /* another point has half of it or more: none; that point is where the search would run to */
} hyper_class;

/* classes.c: two passes over the atoms. first: the heaviest point; second: the other end where not unique. [d] each */
hyper_class hyper_classify(const hyper_atoms *atoms, double *first, double *second);

typedef enum hyper_method { HYPER_DAMPED, HYPER_REGULARIZED, HYPER_NEWTON, HYPER_ABIKOFF_YE } hyper_method;

typedef struct hyper_settings {
    hyper_method method;
    double tolerance; /* of the certified distance; 0: as far as doubles go */
    int64_t max_iterations;
    double regularization; /* alpha of (29) */
    double carry;          /* 1 - |w| below which the atoms are shifted in place and carried on */
} hyper_settings;

typedef enum hyper_stop {
    HYPER_STOP_BOUND,
    HYPER_STOP_ROUNDING,
    HYPER_STOP_ITERATIONS,
    HYPER_STOP_IDEAL,
    HYPER_STOP_MONITOR
} hyper_stop;

typedef struct hyper_result {
    hyper_class kind;
    hyper_stop stop;
    int64_t n_iterations;
    double
        w[HYPER_MOST_DIMENSIONS]; /* the barycenter; of HYPER_NONE the ideal point, of HYPER_NOT_UNIQUE one of many */
    double other[HYPER_MOST_DIMENSIONS]; /* of HYPER_NOT_UNIQUE: an end of the geodesic, the other one is in shift[0] */
    double co;                           /* 1 - |w|^2, which w may have lost */
    double residual;                     /* |F|_g of the atoms as they are carried */
    double lambda;                       /* least eigenvalue of -grad F there */
    double q;                            /* 4 |F|_g / lambda^2, (17) */
    double frame_bound; /* certified distance of the carried atoms' barycenter from 0; infinite: none */
    double bound;       /* certified distance from w to the barycenter, what doubles lose near the sphere with it */
    /* the shift that was carried out: sigma of shift[n - 1] after ... after sigma of shift[0] */
    int n_shifts;
    double shift[HYPER_MOST_SHIFTS][HYPER_MOST_DIMENSIONS], shift_co[HYPER_MOST_SHIFTS];
} hyper_result;

/* barycenter.c: atoms have been checked. first: as hyper_check_atoms saw them; NULL: it looks itself. LOXO_OK; LOXO_NOT_CONVERGED: HYPER_STOP_ROUNDING before the tolerance, or
 * HYPER_STOP_ITERATIONS; LOXO_CHECK_FAILED: not HYPER_STABLE; LOXO_STOPPED; LOXO_ERR_MEMORY. */
loxo_status hyper_barycenter(loxo_context *ctx, const hyper_atoms *atoms, const hyper_moments *first,
                             const hyper_settings *settings, hyper_result *out);
hyper_settings hyper_settings_default(void);

/* small.c: eigenvalues ascending and their vectors (rows of v) of a symmetric matrix a [d][d], which is destroyed. */
void hyper_eigen(int d, double *a, double *value, double *v);
/* Distance within which a zero of F lies, certified by |F|_g and lambda at this point; infinite: by them none is. */
double hyper_certificate(double residual, double lambda);

#endif
