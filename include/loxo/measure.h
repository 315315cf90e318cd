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

/* ---- maps to the sphere ---------------------------------------------------------------------------------------- */

/* Many numbers in a few. Percentiles are the numbers of nearest rank, known to one part in 2^20; max is exact. All NaN where n is 0. */
typedef struct loxo_distribution {
    int64_t n;
    double mean, sd; /* root of the mean square off the mean */
    double median, percentile_75, percentile_95, percentile_99, max;
} loxo_distribution;

/* Folds are counted by differences of corners and hold for faces of area 1e-20, too. Where no face is turned over the two energies
 * are one. */
typedef struct loxo_sphere_map_measure {
    int64_t n_faces;
    int64_t n_flat;           /* faces of the surface without area: they have no angles, no mu and no share of area */
    int64_t n_image_flat;     /* faces whose image has no area */
    int64_t n_folds;          /* faces whose image is turned over, or has no area */
    int degree;               /* how many times the image covers the sphere, by solid angles */
    double area;              /* of the surface */
    double image_area;        /* A(f): of the flat triangles of the image, all positive */
    double image_area_signed; /* those that look inward negative */
    double dirichlet;         /* 1/2 <L f, f> */
    double energy; /* E_C(f) = 1/2 <L f, f> - A(f), (3.3), by a sum of squares: no digits are lost where it is small */
    double energy_signed;              /* with the signed area, as loxo_sphere has it */
    loxo_distribution angle_error_deg; /* |alpha - alpha(f)|, degrees, over all corners of faces with area */
    loxo_distribution
        beltrami; /* |mu| of those faces, 0 to 1: of a face that is turned over that of its mirror image */
    loxo_distribution
        area_log; /* |log| of the image's share of all image area over the face's share of the surface; images without area
                                   left out */
} loxo_sphere_map_measure;

/* Arrays to be filled, in the caller's order; each may be NULL. NaN on faces without area, and at vertices without other faces. */
typedef struct loxo_sphere_map_fields {
    double *corner_angle_error_deg; /* [n_faces][3] |alpha - alpha(f)| */
    double *face_beltrami; /* [n_faces][2] mu, in the plane of the face with its first side along the real axis */
    double *face_area_log; /* [n_faces] log of the shares' ratio; -infinity: the image has no area */
    double *vertex_angle_error_deg; /* [n_vertices] mean over the corners at the vertex: epsilon_alpha of Figure 6 */
    double *vertex_beltrami;        /* [n_vertices] mean of |mu| over the faces around: the third of that figure */
    double *
        vertex_curvature_rad; /* [n_vertices] 2 pi less the angles at the vertex: kappa, the discrete Gauss curvature */
} loxo_sphere_map_fields;

/* How far a map from a closed, oriented surface of any genus to the unit sphere is from a conformal one.
 *   mesh     the surface; its faces without area, or with a vertex repeated, are counted
 *   map      [n_vertices][3], at vertices that faces use within 1e-5 of the unit sphere; taken as it is
 *   fields   may be NULL
 * L is that of the library's solvers, which take a face flatter than 1e-7 of its longest side for that flat.
 * returns    LOXO_OK; LOXO_ERR_MESH: an open or inconsistently oriented surface, no faces, no area, a vertex off the unit sphere (element);
 *            LOXO_ERR_MALFORMED: a vertex number out of range (element is the face), a coordinate of the surface that is not finite;
 *            LOXO_ERR_NUMERIC: areas that are not finite; LOXO_ERR_ARGUMENT; LOXO_ERR_LIMIT; LOXO_ERR_MEMORY; LOXO_ERR_STOPPED
 * cost       nine passes over the faces; 1 MiB a thread, and 4 bytes a vertex with vertex fields. Same bits for any number of threads.
 *            Whether the surface is closed is seen from a sum of random numbers over its half-edges: it takes an open one for closed
 *            with a chance of 2^-64
 * source     Tan, Li, Lin, Yau 2024, A robust Hessian-based trust region algorithm for spherical conformal parameterizations, (3.3) and
 *            section 5.1 */
LOXO_API loxo_status loxo_measure_sphere_map(loxo_context *ctx, const loxo_mesh_arrays *mesh, const double *map,
                                             loxo_sphere_map_measure *measure, const loxo_sphere_map_fields *fields);

#ifdef __cplusplus
}
#endif
#endif
