/* SPDX-License-Identifier: MIT
 * Conformal barycenter of weighted points of the unit sphere of R^d, 2 <= d <= 64: the point of the ball, as hyperbolic space, from
 * which the points are balanced. After the Moebius map that takes it to the centre the points' weighted mean is 0.
 *
 * source  Cantarella, Schumacher 2022, Computing the conformal barycenter, SIAM J. Appl. Algebra Geom.; numbers in parentheses are
 *         that paper's. What differs, and the proofs, are in src/hyperbolic/README.md and src/solver/barycenter/README.md */
#ifndef LOXO_BARYCENTER_H
#define LOXO_BARYCENTER_H

#include <loxo/moebius.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LOXO_BARYCENTER_MOST_DIMENSIONS LOXO_MOEBIUS_MOST_DIMENSIONS

/* Every method, its name on the command line and what it is: the one list. */
#define LOXO_BARYCENTER_METHOD_LIST(X)                                                                                 \
    X(DAMPED, "damped", "Newton's direction, a length that always descends; full steps where those do")                \
    X(REGULARIZED, "regularized", "the paper's (34)-(36): regularised Newton steps and a line search")                 \
    X(NEWTON, "newton", "the paper's (16): full Newton steps; may fail to converge")                                   \
    X(ABIKOFF_YE, "abikoff-ye", "steps to the mean, of linear convergence; the baseline")

typedef enum loxo_barycenter_method {
#define LOXO_BARYCENTER_METHOD_ROW(NAME, name, help) LOXO_BARYCENTER_##NAME,
    LOXO_BARYCENTER_METHOD_LIST(LOXO_BARYCENTER_METHOD_ROW)
#undef LOXO_BARYCENTER_METHOD_ROW
        LOXO_BARYCENTER_N_METHODS
} loxo_barycenter_method;

/* "damped"; "unknown" outside the list. */
LOXO_API const char *loxo_barycenter_method_name(loxo_barycenter_method method);

typedef struct loxo_barycenter_settings {
    loxo_barycenter_method method;
    double tolerance; /* of the certified hyperbolic distance; 0: as far as doubles go */
    int64_t max_iterations;
    double regularization; /* alpha of (29), of LOXO_BARYCENTER_REGULARIZED */
} loxo_barycenter_settings;

LOXO_API loxo_barycenter_settings loxo_barycenter_settings_default(void);

/* Points of the sphere, read where they lie; the caller's. */
typedef struct loxo_atoms {
    int64_t n;
    int d;                /* 2 to LOXO_BARYCENTER_MOST_DIMENSIONS */
    const double *x;      /* [n][d]: unit vectors within 1e-6, taken as directions; or NULL and */
    const float *x_float; /* [n][d], the same */
    const double *weight; /* [n], >= 0; NULL: all alike */
} loxo_atoms;

/* How much of the weight sits in one point decides whether there is a barycenter (definition 5.1). */
typedef enum loxo_barycenter_class {
    LOXO_BARYCENTER_STABLE,     /* no point has half of the weight: there is one */
    LOXO_BARYCENTER_NOT_UNIQUE, /* two points have half each: every point of the geodesic between them is one */
    LOXO_BARYCENTER_NONE /* another point has half of it or more: there is none, the search would run to that point */
} loxo_barycenter_class;

LOXO_API const char *loxo_barycenter_class_name(loxo_barycenter_class kind);

typedef enum loxo_barycenter_stop {
    LOXO_BARYCENTER_STOP_BOUND,      /* the certified distance is within the tolerance */
    LOXO_BARYCENTER_STOP_ROUNDING,   /* what is left is rounding of doubles */
    LOXO_BARYCENTER_STOP_ITERATIONS, /* as many as were allowed */
    LOXO_BARYCENTER_STOP_IDEAL,      /* not LOXO_BARYCENTER_STABLE: nothing to search for */
    LOXO_BARYCENTER_STOP_MONITOR
} loxo_barycenter_stop;

LOXO_API const char *loxo_barycenter_stop_name(loxo_barycenter_stop stop);

typedef struct loxo_barycenter_info {
    loxo_barycenter_stop stop_reason;
    int64_t n_iterations;
    double residual; /* |F|_g, (3), of the atoms where the map takes them: length of their mean */
    double total_s;
    size_t peak_bytes; /* of the context */

    loxo_barycenter_class kind;
    double w[LOXO_BARYCENTER_MOST_DIMENSIONS]; /* the barycenter; not unique: the one nearest to the centre; none: the
                                                          ideal point */
    double direction[LOXO_BARYCENTER_MOST_DIMENSIONS]; /* w / |w|; 0 where w is */
    double co, gap, radius;                            /* 1 - |w|^2, 1 - |w|, 2 artanh |w|, with all their digits */
    double end[2][LOXO_BARYCENTER_MOST_DIMENSIONS];    /* not unique: the ends of the geodesic */
    loxo_moebius map; /* takes w to the centre; where there is no barycenter the identity */

    /* At w. Infinite: nothing is certified */
    double lambda_min;  /* least eigenvalue of -grad F (15) */
    double q;           /* 4 |F|_g / lambda_min^2 (17); below 1 Newton's full steps converge */
    double bound;       /* certified distance of w from the barycenter, what doubles lose near the sphere with it */
    double frame_bound; /* of the centre from the barycenter of the atoms where the map takes them */
    double kantorovich_bound;       /* what (18) says of that distance, for comparison */
    double wasserstein;             /* (10): from those atoms to the centred measure, any p */
    double kantorovich_wasserstein; /* what (18) says of it */
} loxo_barycenter_info;

/* The conformal barycenter of one measure. Atoms with the same coordinates count as one, those without weight not at all.
 *   settings   NULL: the defaults
 *   info       out: the answer
 * returns      LOXO_OK; LOXO_NOT_CONVERGED: a tolerance that doubles cannot certify there (LOXO_BARYCENTER_STOP_ROUNDING), iterations
 *              used up, or different atoms so near that the search reached the sphere: the last state is in info;
 *              LOXO_CHECK_FAILED: not unique or none; LOXO_STOPPED;
 *              LOXO_ERR_ARGUMENT: no atoms, d or a setting out of its range, with the number as element: an atom off the sphere or not
 *              finite, a weight that is negative or not finite; weights that add up to less than 1e-290 or more than 1e290;
 *              LOXO_ERR_MEMORY
 * cost         three to six passes over the atoms, 25 operations and 24 bytes an atom each in space; 16 bytes for 4096 atoms and
 *              d^2, near the sphere a copy of the atoms; same bits for any number of threads and instruction set */
LOXO_API loxo_status loxo_barycenter(loxo_context *ctx, const loxo_atoms *atoms,
                                     const loxo_barycenter_settings *settings, loxo_barycenter_info *info);

#ifdef __cplusplus
}
#endif
#endif
