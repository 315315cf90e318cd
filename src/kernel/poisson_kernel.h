/* SPDX-License-Identifier: MIT
 * From a wanted direction on each face to the right side of a Poisson equation, and the steps of the variational method.
 *
 * The function d whose gradient is nearest to vectors X minimises sum over faces and half-edges of weight_k
 * (rise_k(d) - X . e_k)^2, with the weights of laplacian_kernel.h: both sides are Dirichlet products of linear functions
 * on a face. So C d = b with b_v the sum of weight_k X . e_k over half-edges that end at v, less that over those that
 * start there: the integrated divergence. A field is kept as its products with the half-edges of each face. */
#ifndef LOXO_KERNEL_POISSON_KERNEL_H
#define LOXO_KERNEL_POISSON_KERNEL_H

#include "kernel/laplacian_kernel.h"

/* field[3 f + k]: X . e_k, out: weight_k X . e_k.
 * source  Crane, Weischedel, Wardetzky 2013, Geodesics in Heat, section 3.2.1 */
static inline void k_weigh_field(const loxo_mesh_view *m, int64_t begin, int64_t end, double *field)
{
    for (int64_t f = begin; f < end; ++f) {
        double length[3], weight[3];
        k_face_lengths(m, f, length);
        (void)k_face_weights(length, weight);
        for (int k = 0; k < 3; ++k)
            field[3 * f + k] *= weight[k];
    }
}

/* b of vertex v, from the weighted field. */
static inline double k_divergence_at(const loxo_mesh_view *m, const double *field, int64_t v)
{
    const loxo_index first = m->vertex_halfedge[v];
    double sum = 0.0;
    loxo_index h = first;
    while (h >= 0) {
        const loxo_index before = k_previous(h);
        sum += field[before] - field[h];
        h = m->halfedge_twin[before];
        if (h == first) break;
    }
    return sum;
}

/* One face of the ADMM that minimises 1/2 integral of (|p| - 1)^2 with p = grad d: of v = grad d + q the new
 * p = v (1 + r |v|) / ((1 + r) |v|), which minimises 1/2 (|p| - 1)^2 + r/2 |p - v|^2, and the new q = v - p. rise: of d along the half-edges
 * 0 and 2; q: its products with these, in and out; field: products of p - q with all three, of which d is next made.
 * Sums, times the area: (|grad d| - 1)^2, |grad d - p|^2, 1. A face flatter than a tenmillionth wants nothing.
 * source  Belyaev, Fayolle 2015, On Variational and PDE-Based Distance Function Approximations, section on ADMM */
static inline void k_variational_face(const double length[3], const double rise[2], double r, double q[2],
                                      double field[3], double sums[3])
{
    const k_layout face = k_layout_of(length);
    const double area = 0.5 * face.x1 * face.y2, longest = fmax(length[0], fmax(length[1], length[2]));
    field[0] = field[1] = field[2] = 0.0;
    if (!(2.0 * area > K_LEAST_FLATNESS * longest * longest)) {
        q[0] = q[1] = 0.0;
        return;
    }
    const double v[2] = {rise[0] + q[0], rise[1] + q[1]};
    const double vx = v[0] / face.x1, vy = (-v[1] - face.x2 * vx) / face.y2, size = sqrt(vx * vx + vy * vy);
    const double gx = rise[0] / face.x1, gy = (-rise[1] - face.x2 * gx) / face.y2;
    const double share = size > 0.0 ? (1.0 + r * size) / ((1.0 + r) * size) : 1.0;
    const double off = sqrt(gx * gx + gy * gy) - 1.0, px = gx - share * vx, py = gy - share * vy;
    sums[0] += area * off * off;
    sums[1] += area * (px * px + py * py);
    sums[2] += area;
    for (int k = 0; k < 2; ++k)
        q[k] = (1.0 - share) * v[k];
    field[0] = (2.0 * share - 1.0) * v[0];
    field[2] = (2.0 * share - 1.0) * v[1];
    field[1] = -(field[0] + field[2]);
}

#endif
