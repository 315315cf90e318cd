/* SPDX-License-Identifier: MIT
 * One vertex among its neighbours on the unit sphere: where it may stand so that no triangle around it is turned over, and where it
 * stands best. Edges are arcs of great circles; faces (v, ring_i, ring_i+1), counter-clockwise from outside.
 *
 * source  Hormann, Greiner 2000, MIPS: An Efficient Global Parametrization Method (the energy) */
#ifndef LOXO_KERNEL_STAR_KERNEL_H
#define LOXO_KERNEL_STAR_KERNEL_H

#include "kernel/vec3.h"

#include <stdbool.h>

#define K_STAR_MOST 64 /* neighbours */

/* Axes at a point of the sphere. */
typedef struct k_frame {
    loxo_vec3 x, y, up;
} k_frame;

static inline k_frame k_frame_at(loxo_vec3 up)
{
    const double ax = fabs(up.x), ay = fabs(up.y), az = fabs(up.z);
    const loxo_vec3 least = ax <= ay && ax <= az ? (loxo_vec3){1.0, 0.0, 0.0}
                            : ay <= az           ? (loxo_vec3){0.0, 1.0, 0.0}
                                                 : (loxo_vec3){0.0, 0.0, 1.0};
    const loxo_vec3 across = v3_cross(least, up), x = v3_scale(1.0 / v3_norm(across), across);
    return (k_frame){.x = x, .y = v3_cross(up, x), .up = up};
}

/* p in the axes of the frame. From the difference p - up: near it x and y are as exact as p is, however small they are. */
static inline loxo_vec3 k_frame_in(const k_frame *frame, loxo_vec3 p)
{
    const loxo_vec3 d = v3_sub(p, frame->up);
    return (loxo_vec3){v3_dot(frame->x, d), v3_dot(frame->y, d), 1.0 + v3_dot(frame->up, d)};
}

/* The point of the sphere in direction q. */
static inline loxo_vec3 k_frame_out(const k_frame *frame, loxo_vec3 q)
{
    const loxo_vec3 p = v3_axpy(v3_axpy(v3_scale(q.z, frame->up), q.x, frame->x), q.y, frame->y);
    return v3_scale(1.0 / v3_norm(p), p);
}

static inline loxo_vec3 k_unit(loxo_vec3 a) { return v3_scale(1.0 / v3_norm(a), a); }

/* A corner of a convex cone; all that is done to it multiplies it by positive numbers. */
typedef struct k_cone {
    int n;
    loxo_vec3 corner[K_STAR_MOST + 4]; /* unit vectors in turn */
} k_cone;

/* Cuts off what has not side . p > 0. A corner between p inside and q outside is (side . p) q - (side . q) p. */
static inline void k_cone_cut(k_cone *cone, loxo_vec3 side)
{
    k_cone left = {.n = 0};
    for (int i = 0; i < cone->n && left.n + 2 <= K_STAR_MOST + 4; ++i) {
        const loxo_vec3 p = cone->corner[i], q = cone->corner[i + 1 < cone->n ? i + 1 : 0];
        const double at_p = v3_dot(side, p), at_q = v3_dot(side, q);
        if (at_p >= 0.0) left.corner[left.n++] = p;
        if ((at_p > 0.0 && at_q < 0.0) || (at_p < 0.0 && at_q > 0.0)) {
            const loxo_vec3 cut = v3_axpy(v3_scale(fabs(at_p), q), fabs(at_q), p);
            const double length = v3_norm(cut);
            if (length > 0.0) left.corner[left.n++] = v3_scale(1.0 / length, cut);
        }
    }
    *cone = left;
}

/* The middle of the kernel: of all points that see every edge of the ring from inside.
 *
 * The ring has to be a polygon whose triangles to ring[0] are not turned over: ring[0] sees all of it. Then there are points near ring[0]
 * that see it from inside, so the kernel has an interior. It lies between the great circles of the two edges at ring[0]; this lune is
 * cut by the great circles of the other edges. A point p is inside of an edge from a to b where (a x b) . p > 0, a cone of directions,
 * so a ring may be larger than a half sphere. All products are in axes at ring[0], where the numbers of a small ring are small and exact:
 * with a and b of size e the first two coordinates of a x b are of size e, the third of e^2, each to the last digits, and so is the
 * product with a point of size e. false: nothing is left, by rounding or since the ring is none. */
static inline bool k_star_center(int n, const loxo_vec3 *ring, loxo_vec3 *center)
{
    const k_frame frame = k_frame_at(ring[0]);
    loxo_vec3 at[K_STAR_MOST];
    if (n < 3 || n > K_STAR_MOST) return false;
    at[0] = (loxo_vec3){0.0, 0.0, 1.0};
    for (int i = 1; i < n; ++i)
        at[i] = k_frame_in(&frame, ring[i]);

    /* directions at ring[0]: left of its first edge, and right of its last */
    loxo_vec3 from = {at[1].x, at[1].y, 0.0}, to = {at[n - 1].x, at[n - 1].y, 0.0};
    const double from_length = v3_norm(from), to_length = v3_norm(to);
    if (!(from_length > 0.0 && to_length > 0.0)) return false;
    from = v3_scale(1.0 / from_length, from);
    to = v3_scale(1.0 / to_length, to);
    if (from.x * to.y - from.y * to.x < 0.0) { /* more than half a turn from one to the other */
        const loxo_vec3 back = v3_scale(-1.0, to);
        to = v3_scale(-1.0, from);
        from = back;
    }
    k_cone cone = {.n = 4, .corner = {at[0], from, {0.0, 0.0, -1.0}, to}};
    for (int i = 1; i + 1 < n && cone.n > 0; ++i)
        k_cone_cut(&cone, v3_cross(at[i], at[i + 1]));
    if (cone.n < 3) return false;
    loxo_vec3 sum = {0.0, 0.0, 0.0};
    for (int i = 0; i < cone.n; ++i)
        sum = v3_add(sum, cone.corner[i]);
    if (!(v3_norm(sum) > 0.0)) return false;
    *center = k_frame_out(&frame, sum);
    return true;
}

/* The triangles around a vertex, in a plane.
 *
 * The Dirichlet energy D of the linear map from a triangle of the surface to (x, b, c) and the area A of the image satisfy
 *
 *     D - A = 1/2 s |x - apex|^2,    s = (cot at b + cot at c) / 2 = base / (2 height) on the surface,
 *
 * with apex the place of x where (apex, b, c) is similar to the triangle: D is quadratic in x with the second derivative s, and D >= A
 * with equality at the apex. So D / A - 1 = s |x - apex|^2 / (2 A): a square over a linear function, convex where the area
 * is positive, and infinite where it ends. Their sum over the star with the surface's areas as weights, MIPS, has one least point in the
 * kernel. Weight times s is proportional to base^2. */
typedef struct k_star {
    int n;
    double ring[K_STAR_MOST][2];
    double apex[K_STAR_MOST][2];
    double stiffness[K_STAR_MOST]; /* s times the area on the surface */
} k_star;

/* Apex and stiffness of face i, whose corners b = ring[i] and c = ring[i + 1] are there; lengths on the surface from the vertex to b, to c, and of bc.
 * All three are taken longer by K_STAR_PLUMP of the longest: slivers then have a shape that an image can be given. */
#define K_STAR_PLUMP 3e-4
static inline void k_star_set_face(k_star *star, int i, double to_b, double to_c, double base)
{
    const int next = i + 1 < star->n ? i + 1 : 0;
    const double longest = fmax(base, fmax(to_b, to_c)), more = longest > 0.0 ? K_STAR_PLUMP * longest : 1.0;
    const double left = (to_b + more) / (base + more), right = (to_c + more) / (base + more);
    /* over the base as unit: the apex is at `along` on it, `height` above */
    const double along = 0.5 * (1.0 + (left - right) * (left + right));
    const double height = sqrt(fmax((left - along) * (left + along), 1e-12));
    const double dx = star->ring[next][0] - star->ring[i][0], dy = star->ring[next][1] - star->ring[i][1];
    star->apex[i][0] = star->ring[i][0] + along * dx - height * dy;
    star->apex[i][1] = star->ring[i][1] + along * dy + height * dx;
    star->stiffness[i] = 0.25 * (base + more) * (base + more);
}

/* Sum of the weighted D / A - 1; HUGE_VAL where a triangle is turned over. */
static inline double k_star_energy(const k_star *star, double x, double y)
{
    double energy = 0.0;
    for (int i = 0; i < star->n; ++i) {
        const double *b = star->ring[i], *c = star->ring[i + 1 < star->n ? i + 1 : 0];
        const double area = (c[0] - b[0]) * (y - b[1]) - (c[1] - b[1]) * (x - b[0]);
        const double rx = x - star->apex[i][0], ry = y - star->apex[i][1];
        if (!(area > 0.0)) return HUGE_VAL;
        energy += star->stiffness[i] * (rx * rx + ry * ry) / area;
    }
    return energy;
}

/* One step of Newton's method, halved until the energy falls; of phi = s g / a, with g = |r|^2, r = x - apex and m the gradient of a:
 *     d phi  = s (2 r / a - g m / a^2)
 *     d2 phi = 2 s / a (I - (r m^T + m r^T) / a + g m m^T / a^2)
 * false: x is as it was. *energy: at x, in and out. */
static inline bool k_star_step(const k_star *star, double x[2], double *energy)
{
    double gx = 0.0, gy = 0.0, hxx = 0.0, hxy = 0.0, hyy = 0.0;
    for (int i = 0; i < star->n; ++i) {
        const double *b = star->ring[i], *c = star->ring[i + 1 < star->n ? i + 1 : 0];
        const double mx = b[1] - c[1], my = c[0] - b[0];
        const double inverse = 1.0 / (mx * (x[0] - b[0]) + my * (x[1] - b[1]));
        const double rx = (x[0] - star->apex[i][0]) * inverse, ry = (x[1] - star->apex[i][1]) * inverse;
        const double g = rx * rx + ry * ry, s = star->stiffness[i], h = 2.0 * s * inverse;
        gx += s * (2.0 * rx - g * mx);
        gy += s * (2.0 * ry - g * my);
        hxx += h * (1.0 - 2.0 * rx * mx + g * mx * mx);
        hxy += h * (g * mx * my - rx * my - ry * mx);
        hyy += h * (1.0 - 2.0 * ry * my + g * my * my);
    }
    const double determinant = hxx * hyy - hxy * hxy;
    if (!(determinant > 0.0) || !isfinite(determinant)) return false;
    const double dx = (hxy * gy - hyy * gx) / determinant, dy = (hxy * gx - hxx * gy) / determinant;
    double length = 1.0;
    for (int k = 0; k < 30; ++k) {
        const double now = k_star_energy(star, x[0] + length * dx, x[1] + length * dy);
        if (now < *energy) {
            x[0] += length * dx;
            x[1] += length * dy;
            *energy = now;
            return true;
        }
        length *= 0.5;
    }
    return false;
}

/* tan of half the angle between a and b: sin / (1 + cos), |a x b| / (|a| |b| + a . b). At most K_MOST_HALF_TANGENT. */
#define K_MOST_HALF_TANGENT 1e7
static inline double k_half_tangent(loxo_vec3 a, loxo_vec3 b)
{
    const double across = v3_norm(v3_cross(a, b)), along = v3_norm(a) * v3_norm(b) + v3_dot(a, b);
    return across < K_MOST_HALF_TANGENT * along ? across / along : across > 0.0 ? K_MOST_HALF_TANGENT : 0.0;
}

#endif
