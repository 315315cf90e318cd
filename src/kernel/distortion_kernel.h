/* SPDX-License-Identifier: MIT
 * What a linear map does to one triangle: its angles, its conformal energy and its Beltrami coefficient, from squares and without
 * differences of large numbers, so that they keep their digits on maps that are nearly conformal.
 *
 * Lay the triangle T into the plane, its longest side from 0 to (x1, 0), its third corner at (x2, y2). With e1, e2 the images of the two
 * sides from the first corner, the map's derivatives are a = e1 / x1 along x and b = (e2 - x2 a) / y2 along y. Let n be the unit normal
 * of a x b; then n x a is a turned by a right angle, |n x a| = |a|, and b . (n x a) = n . (a x b) = |a x b|, so that
 *
 *     E_T = 1/2 |T| (|a|^2 + |b|^2) - |T| |a x b| = 1/2 |T| |b - n x a|^2 = 1/2 |T| (s1 - s2)^2,
 *
 * s1 >= s2 the singular values: the triangle's part of E_C(f) = 1/2 <L f, f> - A(f), (3.3), as the cotangent matrix L is the Dirichlet
 * energy of linear maps. Likewise |b + n x a| = s1 + s2, and as f_zbar = 1/2 (a + n x b), f_z = 1/2 (a - n x b) in the image's plane,
 *
 *     mu = f_zbar / f_z = (|a|^2 - |b|^2 + 2 i a . b) / |b + n x a|^2,   |mu| = (s1 - s2) / (s1 + s2).
 *
 * An error of n tilts it by some d and changes E_T by d^2 only. L takes a face flatter than K_LEAST_FLATNESS for one of that height h
 * (laplacian_kernel.h): with u = y2 b, that is x1 (y2^2 |a|^2 + |u|^2) / (4 h) in place of 1/2 |T| (|a|^2 + |b|^2), and
 *
 *     E_T = x1 / (4 h) |u - y2 n x a|^2 - (1 - y2 / h) A,   A the area of the image.
 *
 * source  Tan, Li, Lin, Yau 2024, section 3; Choi, Lam, Lui 2015, FLASH, for mu of maps between triangle meshes */
#ifndef LOXO_KERNEL_DISTORTION_KERNEL_H
#define LOXO_KERNEL_DISTORTION_KERNEL_H

#include "kernel/laplacian_kernel.h"

/* Sides and corners. S = twice_area and C = along[k] are sine and cosine of the angle at corner k, times the lengths of its sides. */
typedef struct k_triangle {
    loxo_vec3 edge[3]; /* opposite to corner k, counter-clockwise */
    loxo_vec3 normal;  /* as long as twice the area */
    double along[3];
    double twice_area;
    int longest; /* side; of equals the first */
} k_triangle;

/* The normal from the two shorter sides: on needles longer ones would lose digits. Written out, as sides picked by a computed index
 * would have to go through memory. */
static inline k_triangle k_triangle_of(loxo_vec3 a, loxo_vec3 b, loxo_vec3 c)
{
    const loxo_vec3 e0 = v3_sub(c, b), e1 = v3_sub(a, c), e2 = v3_sub(b, a);
    const double s0 = v3_dot(e0, e0), s1 = v3_dot(e1, e1), s2 = v3_dot(e2, e2);
    const int longest = s1 > s0 ? (s2 > s1 ? 2 : 1) : (s2 > s0 ? 2 : 0);
    const loxo_vec3 u = longest == 0 ? e1 : longest == 1 ? e2 : e0, v = longest == 0 ? e2 : longest == 1 ? e0 : e1;
    const loxo_vec3 normal = v3_cross(u, v);
    return (k_triangle){.edge = {e0, e1, e2},
                        .normal = normal,
                        .along = {-v3_dot(e1, e2), -v3_dot(e2, e0), -v3_dot(e0, e1)},
                        .twice_area = v3_norm(normal),
                        .longest = longest};
}

/* sine and cosine, times one positive number, of |alpha - alpha(f)| at corner k: by addition theorems, so that small differences keep their
 * digits. Beside a side of the image without length its angle counts as a right one. */
static inline void k_angle_error(const k_triangle *face, const k_triangle *image, int k, double *sine, double *cosine)
{
    const double c = face->along[k], ci = image->along[k], s = face->twice_area, si = image->twice_area;
    *sine = fabs(s * ci - c * si);
    *cosine = c * ci + s * si;
    if (*sine + fabs(*cosine) > 0.0) return;
    *sine = fabs(c);
    *cosine = s;
}

/* A number that grows with the angle, 0 at 0 and 2 at pi, for ranks without arc functions; and the angle that has it. */
static inline double k_angle_rank(double sine, double cosine)
{
    const double t = sine / (sine + fabs(cosine));
    return cosine >= 0.0 ? t : 2.0 - t;
}

static inline double k_angle_of_rank(double t) { return t <= 1.0 ? atan2(t, 1.0 - t) : atan2(2.0 - t, 1.0 - t); }

typedef struct k_distortion {
    double energy; /* E_T, the area of the image taken without a sign */
    double mu
        [2]; /* in the plane of the face with its first half-edge along x; of a face that is turned over that of its mirror image */
    double size;      /* |mu|, at most 1; 1 where the image is a point */
    double dirichlet; /* energy + area of the image, not by this sum */
} k_distortion;

/* Of a face of area 0 only the energies are of use. */
static inline k_distortion k_distortion_of(const k_triangle *face, const k_triangle *image)
{
    const int k = face->longest, l = (k + 1) % 3, m = (k + 2) % 3;
    const double image_area = 0.5 * image->twice_area, x1 = v3_norm(face->edge[k]);
    k_distortion d = {.energy = -image_area, .size = 1.0};
    if (!(x1 > 1e-290)) return d;
    /* Corner l at the origin, m on the x axis, k above it. */
    const double x2 = face->along[l] / x1, y2 = face->twice_area / x1, h = fmax(y2, K_LEAST_FLATNESS * x1);
    const loxo_vec3 a = v3_scale(1.0 / x1, image->edge[k]), u = v3_axpy(v3_scale(-1.0, image->edge[m]), -x2, a);
    loxo_vec3 turned = {0.0, 0.0, 0.0}; /* y2 n x a */
    if (image->twice_area > 0.0) turned = v3_scale(y2 / image->twice_area, v3_cross(image->normal, a));
    const loxo_vec3 p = v3_sub(u, turned), q = v3_add(u, turned);
    const double aa = y2 * y2 * v3_dot(a, a), uu = v3_dot(u, u);
    const bool has_area = image->twice_area > 0.0;
    const double pp = has_area ? v3_dot(p, p) : aa + uu, qq = has_area ? v3_dot(q, q) : aa + uu;
    d.dirichlet = 0.25 * x1 / h * (aa + uu);
    d.energy = 0.25 * x1 / h * pp - (1.0 - y2 / h) * image_area;
    if (!(qq > 0.0)) return d;
    d.size = fmin(sqrt(pp / qq), 1.0);
    /* In the frame of the longest side, then turned: mu goes as exp(-2 i angle of the first half-edge). */
    const loxo_vec3 ya = v3_scale(y2, a);
    const double re = v3_dot(v3_sub(ya, u), v3_add(ya, u)) / qq, im = 2.0 * v3_dot(ya, u) / qq;
    const double along_x = k == 2 ? x1 : k == 0 ? -x2 : x2 - x1, along_y = k == 2 ? 0.0 : k == 0 ? -y2 : y2;
    const double square = along_x * along_x + along_y * along_y;
    if (!(square > 0.0)) return d;
    const double c = (along_x - along_y) * (along_x + along_y) / square, s = 2.0 * along_x * along_y / square;
    d.mu[0] = re * c + im * s;
    d.mu[1] = im * c - re * s;
    return d;
}

#endif
