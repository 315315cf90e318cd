/* SPDX-License-Identifier: MIT
 * Moebius maps of the unit ball of R^d and of its sphere: the motions of hyperbolic space in Poincare's ball (curvature -1) and
 * what they do at infinity.
 *
 * Points of the ball come with co = 1 - |w|^2, which the coordinates of a point near the sphere have lost.
 *
 * source  Cantarella, Schumacher 2022, Computing the conformal barycenter, section 2; how digits are kept is derived in
 *         src/hyperbolic/README.md */
#ifndef LOXO_MOEBIUS_H
#define LOXO_MOEBIUS_H

#include <loxo/context.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LOXO_MOEBIUS_MOST_DIMENSIONS 64
#define LOXO_MOEBIUS_MOST_SHIFTS     16

/* Shifts one after the other, shift[0] first: each is sigma_w of (6), which moves w to the centre along their geodesic. A map near the
 * sphere stays several shifts: one alone would have lost what tells the points near its pole apart. */
typedef struct loxo_moebius {
    int d;        /* of the space, 2 to LOXO_MOEBIUS_MOST_DIMENSIONS */
    int n_shifts; /* 0: the identity */
    double shift[LOXO_MOEBIUS_MOST_SHIFTS][LOXO_MOEBIUS_MOST_DIMENSIONS];
    double co[LOXO_MOEBIUS_MOST_SHIFTS]; /* 1 - |shift|^2 */
} loxo_moebius;

/* The identity; n_shifts 0. LOXO_ERR_ARGUMENT: d out of its range. */
LOXO_API loxo_status loxo_moebius_set_identity(loxo_context *ctx, int d, loxo_moebius *map);
/* Appends sigma_w: what map did, then the shift that moves w to the centre.
 *   w          [map->d]
 *   co         1 - |w|^2 > 0; 0: from the coordinates
 * returns      LOXO_OK; LOXO_ERR_ARGUMENT: w is not finite or not inside, or co is not that of w; LOXO_ERR_LIMIT: too many shifts;
 *              map is untouched */
LOXO_API loxo_status loxo_moebius_append_shift(loxo_context *ctx, loxo_moebius *map, const double *w, double co);
/* first, then second. out may be either. LOXO_ERR_ARGUMENT: different d; LOXO_ERR_LIMIT: too many shifts; out is untouched */
LOXO_API loxo_status loxo_moebius_compose(loxo_context *ctx, const loxo_moebius *first, const loxo_moebius *second,
                                          loxo_moebius *out);
/* out may be map. */
LOXO_API loxo_status loxo_moebius_invert(loxo_context *ctx, const loxo_moebius *map, loxo_moebius *out);

/* Images of points of the sphere.
 *   x          [n][map->d], unit vectors
 *   y          [n][map->d] out, unit vectors to rounding; may be x
 * returns      LOXO_OK; LOXO_ERR_ARGUMENT: n < 0, a map that is none
 * cost         2 d + 20 operations a shift and point; same bits for any number of threads. Relatively to the sphere each shift loses
 *              eps / (1 - |w|) */
LOXO_API loxo_status loxo_moebius_map_sphere(loxo_context *ctx, const loxo_moebius *map, int64_t n, const double *x,
                                             double *y);
/* Images of points of the ball.
 *   z          [n][map->d], inside
 *   co         [n] 1 - |z|^2; NULL: from the coordinates
 *   out        [n][map->d] out; may be z
 *   out_co     [n] out; may be co, may be NULL
 * returns      LOXO_OK; LOXO_ERR_ARGUMENT: a point that is not inside (element): out is untouched */
LOXO_API loxo_status loxo_moebius_map_ball(loxo_context *ctx, const loxo_moebius *map, int64_t n, const double *z,
                                           const double *co, double *out, double *out_co);
/* Distance from the centre of a point with this co: 2 artanh |w|. And 1 - |w|. */
LOXO_API double loxo_moebius_radius(double co);
LOXO_API double loxo_moebius_gap(double co);

#ifdef __cplusplus
}
#endif
#endif
