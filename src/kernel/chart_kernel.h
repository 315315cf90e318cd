/* SPDX-License-Identifier: MIT
 * Maps to the unit sphere by angles: the paper's chart (3.11), the gradient (3.15) and the blocks of the Hessian of Theorem 3.
 *
 * f = (cos theta sin phi, sin theta sin phi, cos phi): theta is the longitude, phi the angle to the north pole. With t = df/dtheta, df/dphi and
 * M the second derivative in Cartesian coordinates, the block of vertices i and j is t_i^T M_ij t_j; where i = j comes what the chart's own
 * bending adds, -K of (3.18). Written out for one triangle, A = |f(T)| and e_i opposite to i, (3.32) holds
 *
 *     -1/(4 A) t_i . ((2 dA/df_i) (2 dA/df_j)^T + 2 f_ki f_jk^T - f_jk f_ki^T) t_j
 *
 * for minus the derivative of the cotangents alone, and -w_ij(f) t_i . t_j for the matrix that they make. With 2 dA/df_i = n x e_i, and of
 * vectors in the plane of the triangle (n x a) (n x b)^T = (a . b) (1 - n n^T) - b a^T, the bracket is (e_i . e_j) (1 - n n^T) + 2 A [n]x. As
 * w_ij(f) = -(e_i . e_j) / (4 A) of the triangle, the part along the identity drops out, and
 *
 *     t_i . ((e_i . e_j) / (4 A) n n^T - 1/2 [n]x) t_j
 *
 * is left, the block of conformal_kernel.h between the two frames: what is computed here. t_i . [n]x t_j = n . (t_j x t_i).
 *
 * source  Tan, Li, Lin, Yau 2024, section 3 */
#ifndef LOXO_KERNEL_CHART_KERNEL_H
#define LOXO_KERNEL_CHART_KERNEL_H

#include "kernel/conformal_kernel.h"

/* A point with the chart's derivatives, (3.11) and (3.12): theta = (-y, x, 0), phi = (u, v, -w). */
typedef struct k_chart_frame {
    loxo_vec3 f, theta, phi;
} k_chart_frame;

static inline k_chart_frame k_chart_frame_of(double theta, double phi)
{
    const double ct = cos(theta), st = sin(theta), cp = cos(phi), sp = sin(phi);
    return (k_chart_frame){
        .f = {ct * sp, st * sp, cp}, .theta = {-st * sp, ct * sp, 0.0}, .phi = {ct * cp, st * cp, -sp}};
}

/* The angles of a direction: theta in -pi .. pi, 0 at the poles; phi in 0 .. pi. */
static inline void k_chart_angles(loxo_vec3 f, double *theta, double *phi)
{
    *theta = atan2(f.y, f.x);
    *phi = atan2(hypot(f.x, f.y), f.z);
}

/* The image of a face as the paper has it, its area without a sign: A in place of s A. */
static inline k_image_face k_chart_face_of(loxo_vec3 a, loxo_vec3 b, loxo_vec3 c)
{
    k_image_face face = k_image_face_of(a, b, c);
    if (!(face.area < 0.0)) return face;
    face.normal = v3_scale(-1.0, face.normal);
    face.area = -face.area;
    face.inverse = -face.inverse;
    for (int k = 0; k < 3; ++k) {
        face.cotangent[k] = -face.cotangent[k];
        face.diagonal[k] = -face.diagonal[k];
    }
    return face;
}

/* Of (p, q, r), the gradient in Cartesian coordinates at this vertex, its parts along theta and phi: (3.15). */
static inline void k_chart_gradient(const k_chart_frame *at, loxo_vec3 p, double gradient[2])
{
    gradient[0] = v3_dot(at->theta, p);
    gradient[1] = v3_dot(at->phi, p);
}

/* K of (3.18), p as before: minus p along the second derivatives of f. */
static inline void k_chart_bending(const k_chart_frame *at, loxo_vec3 p, double block[4])
{
    block[0] = p.x * at->f.x + p.y * at->f.y;
    block[1] = block[2] = p.x * at->phi.y - p.y * at->phi.x;
    block[3] = v3_dot(p, at->f);
}

/* block += weight t_i . t_j: what an entry of a matrix that acts on each coordinate alike, L, gives. */
static inline void k_chart_add_matrix(double weight, const k_chart_frame *at_i, const k_chart_frame *at_j,
                                      double block[4])
{
    block[0] += weight * v3_dot(at_i->theta, at_j->theta);
    block[1] += weight * v3_dot(at_i->theta, at_j->phi);
    block[2] += weight * v3_dot(at_i->phi, at_j->theta);
    block[3] += weight * v3_dot(at_i->phi, at_j->phi);
}

/* block -= t_i^T (second derivative of the face's area by corners i and j) t_j: rows theta_i, phi_i, columns theta_j, phi_j. The block of
 * j and i is the transpose, to the bit. */
static inline void k_chart_add_area(const k_image_face *face, int i, const k_chart_frame *at_i, int j,
                                    const k_chart_frame *at_j, double block[4])
{
    const loxo_vec3 n = face->normal, row[2] = {at_i->theta, at_i->phi}, column[2] = {at_j->theta, at_j->phi};
    const double along = i == j ? face->diagonal[i] : face->cotangent[3 - i - j];
    const double turn = i == j ? 0.0 : j == (i + 1) % 3 ? 0.5 : -0.5;
    for (int a = 0; a < 2; ++a)
        for (int b = 0; b < 2; ++b)
            block[2 * a + b] -=
                along * (v3_dot(n, row[a]) * v3_dot(n, column[b])) + turn * v3_dot(n, v3_cross(row[a], column[b]));
}

#endif
