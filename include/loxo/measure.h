/* SPDX-License-Identifier: MIT
 * Facts about results: errors against a reference, for reports, tests and the bench. */
#ifndef LOXO_MEASURE_H
#define LOXO_MEASURE_H

#include <loxo/mesh.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct loxo_distance_error {
    double mean_relative; /* eq. (29) of the parallel heat paper; vertices where the reference is 0 count as 0 */
    double max_relative;
    double max_absolute;
    int64_t n_compared;   /* both finite */
    int64_t n_mismatched; /* one finite, the other not */
} loxo_distance_error;

/* Compares distances [n] with a reference [n]. Values that are not finite in both (unreached) are not counted.
 * returns  LOXO_OK; LOXO_ERR_ARGUMENT; LOXO_ERR_MEMORY
 * source   Tao et al. 2021, Parallel and Scalable Heat Methods for Geodesic Distance Computation, eq. (29) */
LOXO_API loxo_status loxo_measure_distance_error(loxo_context *ctx, const double *distance, const double *reference,
                                                 int64_t n, loxo_distance_error *error);

/* Root of the area-weighted mean square of |h - h*| over the faces: h and h* the unit directions of minus the gradient
 * of two heats given as value * 2^scale [n_vertices] (scale may be NULL: 0). 0 where all agree, at most 2. A direction
 * that does not exist (equal or not finite values) counts as the zero vector.
 * returns  LOXO_OK; LOXO_ERR_ARGUMENT; LOXO_ERR_MALFORMED (a vertex number out of range: element is the face);
 *          LOXO_ERR_NUMERIC (the area is not finite); LOXO_ERR_MEMORY
 * source   the same, eq. (8) */
LOXO_API loxo_status loxo_measure_direction_error(loxo_context *ctx, const loxo_mesh_arrays *mesh, const double *value,
                                                  const int32_t *scale, const double *reference_value,
                                                  const int32_t *reference_scale, double *error);

#ifdef __cplusplus
}
#endif
#endif
