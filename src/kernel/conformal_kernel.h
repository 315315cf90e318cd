/* SPDX-License-Identifier: MIT
 * Conformal energy of maps to the unit sphere, face by face: areas of the flat triangles of the image, their gradients and second
 * derivatives in Cartesian coordinates, tangent vectors.
 *
 * With corners f_i, f_j, f_k in turn, e_i = f_k - f_j opposite to i, N = (f_j - f_i) x (f_k - f_i), n = N / |N| and A = |N| / 2:
 *
 *     dA/df_i          = 1/2 n x e_i                                            (3.8)
 *     d2A/df_i df_i    = e_i . e_i / (4 A) n n^T
 *     d2A/df_i df_j    = e_i . e_j / (4 A) n n^T - 1/2 [n]x                     j after i in the face
 *     d2A/df_i df_k    = e_i . e_k / (4 A) n n^T + 1/2 [n]x                     k before i
 *
 * The first is dN = e_i x df_i put into dA = n . dN / 2. The second is its derivative: only the part of df_j along n tilts the triangle,
 * dn = -(n . df_j) n x e_j / (2 A), and (n x e_j) x e_i = -n (e_i . e_j). These are (3.28) and (3.29) of the paper, summed.
 * A signed area is s A with s the side of the triangle that looks outward; then n stands for s n, and A for s A.
 *
 * source  Tan, Li, Lin, Yau 2024, section 3 */
#ifndef LOXO_KERNEL_CONFORMAL_KERNEL_H
#define LOXO_KERNEL_CONFORMAL_KERNEL_H

#include "kernel/vec3.h"

#include <stdbool.h>

/* The image of a face. */
typedef struct k_image_face {
    loxo_vec3 normal; /* s n; 0 where there is no area */
    double area;      /* s A */
    double inverse;   /* 1 / (4 s A); 0 where there is no area */
    double cotangent
        [3]; /* e_i . e_j / (4 s A) of corners i = 1, 2, 0 and j = 2, 0, 1: minus half the signed cotangent at the third */
    double diagonal[3]; /* e_i . e_i / (4 s A) */
    loxo_vec3 edge[3];  /* e_i */
} k_image_face;

/* Side and twice the area: N . (f_i + f_j + f_k) is three times the determinant of the corners, but by differences of corners, which
 * keeps its sign on faces of area 1e-20. */
static inline loxo_vec3 k_image_normal(loxo_vec3 a, loxo_vec3 b, loxo_vec3 c, double *side)
{
    const loxo_vec3 n = v3_cross(v3_sub(b, a), v3_sub(c, a));
    *side = v3_dot(n, v3_add(a, v3_add(b, c)));
    return n;
}

/* b - s a and *s: the nearer one of b - a and b + a. */
static inline loxo_vec3 k_nearer_difference(loxo_vec3 a, loxo_vec3 b, double *s)
{
    *s = v3_dot(a, b) < 0.0 ? -1.0 : 1.0;
    return v3_axpy(b, -*s, a);
}

/* Solid angle of the spherical triangle, in (-2 pi, 2 pi): signed as the side is,
 *
 *     tan(Omega / 2) = det(a, b, c) / (1 + a . b + b . c + c . a).
 *
 * Where two corners are nearly opposite to the third both are differences of numbers near 1. So they are made of what is small: det(a, b, c)
 * = det(a, b - s a, c - t a), and a . b = s - s |b - s a|^2 / 2 for s = 1 or -1 and unit vectors. Van Oosterom, Strackee 1983. */
static inline double k_solid_angle(loxo_vec3 a, loxo_vec3 b, loxo_vec3 c)
{
    double s, t, u;
    const loxo_vec3 ab = k_nearer_difference(a, b, &s), ac = k_nearer_difference(a, c, &t);
    const loxo_vec3 bc = k_nearer_difference(b, c, &u);
    const double small = s * v3_dot(ab, ab) + t * v3_dot(ac, ac) + u * v3_dot(bc, bc);
    return 2.0 * atan2(v3_dot(a, v3_cross(ab, ac)), (1.0 + s + t + u) - 0.5 * small);
}

static inline k_image_face k_image_face_of(loxo_vec3 a, loxo_vec3 b, loxo_vec3 c)
{
    double side;
    const loxo_vec3 n = k_image_normal(a, b, c, &side);
    const double twice = copysign(v3_norm(n), side);
    k_image_face face = {.edge = {v3_sub(c, b), v3_sub(a, c), v3_sub(b, a)}, .area = 0.5 * twice};
    const bool is_there = twice != 0.0 && isfinite(1.0 / twice);
    face.normal = v3_scale(is_there ? 1.0 / twice : 0.0, n);
    face.inverse = is_there ? 0.5 / twice : 0.0;
    for (int k = 0; k < 3; ++k) {
        const loxo_vec3 e = face.edge[(k + 1) % 3], g = face.edge[(k + 2) % 3];
        face.cotangent[k] = face.inverse * v3_dot(e, g);
        face.diagonal[k] = face.inverse * v3_dot(face.edge[k], face.edge[k]);
    }
    return face;
}

/* d(s A)/df of corner k, (3.8). */
static inline loxo_vec3 k_image_area_gradient(const k_image_face *face, int k)
{
    return v3_scale(0.5, v3_cross(face->normal, face->edge[k]));
}

/* The row of corner k of the second derivative of s A, applied to moves of the corners. */
static inline loxo_vec3 k_image_area_hessian(const k_image_face *face, int k, const loxo_vec3 move[3])
{
    const int j = (k + 1) % 3, l = (k + 2) % 3;
    const double along = face->diagonal[k] * v3_dot(face->normal, move[k]) +
                         face->cotangent[l] * v3_dot(face->normal, move[j]) +
                         face->cotangent[j] * v3_dot(face->normal, move[l]);
    const loxo_vec3 across = v3_cross(face->normal, v3_sub(move[l], move[j]));
    return v3_axpy(v3_scale(along, face->normal), 0.5, across);
}

/* v without its part along the unit vector x. */
static inline loxo_vec3 k_tangent(loxo_vec3 x, loxo_vec3 v) { return v3_axpy(v, -v3_dot(x, v), x); }

/* x moved by the tangent vector v, back on the sphere. */
static inline loxo_vec3 k_retract(loxo_vec3 x, loxo_vec3 v)
{
    const loxo_vec3 y = v3_add(x, v);
    return v3_scale(1.0 / v3_norm(y), y);
}

#endif
