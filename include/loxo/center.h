/* SPDX-License-Identifier: MIT
 * Moebius centring of a map from a surface to the unit sphere: of all maps that differ by a Moebius map of the sphere the one, up to a
 * rotation, whose area-weighted mean position is the centre of the ball.
 *
 * source  Cantarella, Schumacher 2022, Computing the conformal barycenter; what centring means for areas is derived in
 *         src/solver/barycenter/README.md */
#ifndef LOXO_CENTER_H
#define LOXO_CENTER_H

#include <loxo/barycenter.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct loxo_center_settings {
    double off_sphere; /* how far from the unit sphere a vertex may be; it is put onto it */
    double tolerance;  /* of the certified hyperbolic distance; 0: as far as doubles go */
    int64_t max_iterations;
} loxo_center_settings;

LOXO_API loxo_center_settings loxo_center_settings_default(void); /* 1e-5, 0, 100 */

typedef struct loxo_center_info {
    loxo_barycenter_info barycenter; /* w that was moved to the centre, its co, gap and bound; the map; the class */
    double turn
        [3]
        [3]; /* rows; the map is this rotation after sigma_w. It is taken back, so that centred is sigma_w of the sphere */
    double off_sphere;              /* the farthest that a vertex was from the unit sphere */
    double mean_before, mean_after; /* length of the weighted mean position */
    double total_s;
    size_t peak_bytes; /* of the context */
} loxo_center_info;

/* Centres positions of vertices on the unit sphere, weighted by the areas that they stand for on the surface (loxo_mesh_vertex_areas
 * of it). What is done is sigma_w, which moves the barycenter w to the centre along a radius and turns nothing.
 *   sphere         [n][3], or NULL and
 *   sphere_float   [n][3]
 *   area           [n], >= 0, in any unit; NULL: all alike
 *   settings       NULL: the defaults
 *   centred        [n][3] out, unit vectors to rounding; may be sphere
 *   info           out, may be NULL
 * returns          LOXO_OK: the weighted mean of centred is 0 to rounding; LOXO_NOT_CONVERGED, LOXO_STOPPED: as far as the search
 *                  came; LOXO_CHECK_FAILED: half of the area or more stands at one point, centred is the map as it was;
 *                  LOXO_ERR_MESH: a vertex that is off the sphere or not finite (element); LOXO_ERR_ARGUMENT: n < 1, NULL, a setting
 *                  out of its range, an area that is negative or not finite (element), no area at all; LOXO_ERR_MEMORY; of centred
 *                  nothing is of use then
 * cost             five to eight passes of 24 to 48 bytes a vertex; a copy of the positions where 1 - |w| is below 0.05. Same bits for
 *                  any number of threads and instruction set */
LOXO_API loxo_status loxo_moebius_center(loxo_context *ctx, int64_t n, const double *sphere, const float *sphere_float,
                                         const double *area, const loxo_center_settings *settings, double *centred,
                                         loxo_center_info *info);

#ifdef __cplusplus
}
#endif
#endif
