/* SPDX-License-Identifier: MIT
 * The shape of one face, by nothing but the lengths of its edges: the same for straight triangles between positions and
 * for the faces of an intrinsic triangulation. */
#ifndef LOXO_KERNEL_LAYOUT_KERNEL_H
#define LOXO_KERNEL_LAYOUT_KERNEL_H

#include "kernel/vec3.h"

/* Lengths of half-edges 3 f, 3 f + 1, 3 f + 2; those of twins have the same bits. */
static inline void k_face_lengths(const loxo_mesh_view *m, int64_t f, double length[3])
{
    if (m->halfedge_length != NULL) {
        for (int k = 0; k < 3; ++k)
            length[k] = m->halfedge_length[3 * f + k];
        return;
    }
    const loxo_index *v = &m->halfedge_vertex[3 * f];
    const loxo_vec3 a = k_position(m, v[0]), b = k_position(m, v[1]), c = k_position(m, v[2]);
    length[0] = v3_norm(v3_sub(b, a));
    length[1] = v3_norm(v3_sub(c, b));
    length[2] = v3_norm(v3_sub(a, c));
}

/* A face unfolded into the plane: corner 0 at the origin, corner 1 at (x1, 0), corner 2 at (x2, y2), y2 >= 0. */
typedef struct k_layout {
    double x1, x2, y2;
} k_layout;

/* From the lengths of its half-edges. Heights from Kahan's form of Heron's formula, which loses no digits on needles:
 * 16 area^2 = (a + (b + c)) (c - (a - b)) (c + (a - b)) (a + (b - c)), a >= b >= c. Lengths that break the triangle
 * inequality by rounding give a flat face. */
static inline k_layout k_layout_of(const double length[3])
{
    double a = length[0], b = length[1], c = length[2], swap;
    if (a < b) swap = a, a = b, b = swap;
    if (b < c) swap = b, b = c, c = swap;
    if (a < b) swap = a, a = b, b = swap;
    const double product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
    const double base = length[0], left = length[2], right = length[1];
    if (!(base > 0.0)) return (k_layout){0.0, left, 0.0};
    return (k_layout){base, 0.5 * (base + (left - right) * (left + right) / base),
                      product > 0.0 ? 0.5 * sqrt(product) / base : 0.0};
}

/* Its area, by the same formula. */
static inline double k_area_of(const double length[3])
{
    double a = length[0], b = length[1], c = length[2], swap;
    if (a < b) swap = a, a = b, b = swap;
    if (b < c) swap = b, b = c, c = swap;
    if (a < b) swap = a, a = b, b = swap;
    const double product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
    return product > 0.0 ? 0.25 * sqrt(product) : 0.0;
}

/* Cotangents of the angles opposite its half-edges, (b^2 + c^2 - a^2) / (4 area); not finite where there is no area. With
 * b <= c, c^2 - a^2 is a product: no digits are lost on needles. */
static inline void k_cotangents_of(const double length[3], double cotangent[3])
{
    const double inverse = 0.25 / k_area_of(length);
    for (int k = 0; k < 3; ++k) {
        const double a = length[k], b = length[k == 2 ? 0 : k + 1], c = length[k == 0 ? 2 : k - 1];
        const double low = b < c ? b : c, high = b < c ? c : b;
        cotangent[k] = (low * low + (high - a) * (high + a)) * inverse;
    }
}

/* tau of eq. (27) of Tao et al. 2021 for one face: 2 sqrt(3) inradius / longest edge; 1 where all sides are alike. */
static inline double k_quality_of(const double length[3])
{
    const double sum = length[0] + length[1] + length[2];
    const double longest = fmax(length[0], fmax(length[1], length[2]));
    return sum > 0.0 ? 3.46410161513775458705 * (2.0 * k_area_of(length) / sum) / longest : 0.0;
}

/* Corners of face f in three dimensions: where they are, or, where the mesh has lengths, unfolded into the plane z = 0. What looks
 * at one face alone does not see the difference. */
static inline void k_face_corners(const loxo_mesh_view *m, int64_t f, loxo_vec3 corner[3])
{
    if (m->halfedge_length != NULL) {
        const k_layout face = k_layout_of(&m->halfedge_length[3 * f]);
        corner[0] = (loxo_vec3){0.0, 0.0, 0.0};
        corner[1] = (loxo_vec3){face.x1, 0.0, 0.0};
        corner[2] = (loxo_vec3){face.x2, face.y2, 0.0};
        return;
    }
    for (int k = 0; k < 3; ++k)
        corner[k] = k_position(m, m->halfedge_vertex[3 * f + k]);
}

/* The face of half-edge h with h at the bottom, and the lengths of h, of the next and of the previous half-edge. From
 * positions, where there are any: a height is then known to a rounding error of the edges, by lengths alone only to one of
 * the height's square over the edges. */
static inline k_layout k_layout_at(const loxo_mesh_view *m, loxo_index h, double length[3])
{
    const loxo_index next = k_next(h), previous = k_previous(h);
    if (m->halfedge_length != NULL) {
        length[0] = m->halfedge_length[h];
        length[1] = m->halfedge_length[next];
        length[2] = m->halfedge_length[previous];
        return k_layout_of(length);
    }
    const loxo_vec3 a = k_position(m, m->halfedge_vertex[h]), b = k_position(m, m->halfedge_vertex[next]);
    const loxo_vec3 c = k_position(m, m->halfedge_vertex[previous]), ab = v3_sub(b, a), ac = v3_sub(c, a);
    length[0] = v3_norm(ab);
    length[1] = v3_norm(v3_sub(c, b));
    length[2] = v3_norm(ac);
    if (!(length[0] > 0.0)) return (k_layout){0.0, length[2], 0.0};
    return (k_layout){length[0], v3_dot(ab, ac) / length[0], v3_norm(v3_cross(ab, ac)) / length[0]};
}

#endif
