/* SPDX-License-Identifier: MIT
 * Heat diffusion: the rows of (A + t C) u = u_0, A the lumped areas, C the positive semidefinite cotangent matrix, in
 * breadth-first order and scaled per vertex, and their relaxation.
 * source  Tao et al. 2021, eqs. (4), (6), (7) */
#ifndef LOXO_KERNEL_DIFFUSION_KERNEL_H
#define LOXO_KERNEL_DIFFUSION_KERNEL_H

#include "kernel/around_kernel.h"
#include "kernel/layout_kernel.h"
#include "kernel/scaled.h"

/* One vertex of the system, divided by its diagonal and times its relaxation factor omega:
 *   value <- keep * value + constant + sum over entries coefficient * value[neighbour].
 * Rows stand in breadth-first order; the entries of row p are begin[p] .. begin[p+1]-1. keep is 1 - omega in exact
 * arithmetic. It is computed from the coefficients as they were rounded, and in double: where two vertices are all but
 * one, their common decay is the small difference 1 - keep - sum of coefficients, which must not be lost. */
typedef struct k_row {
    uint32_t begin;
    float weight; /* of this vertex in the change of its level: area / first value^2 */
    double keep;
} k_row;

/* Values are kept twice, for even and for odd steps: value[2 p + (step & 1)]. An entry's slot is 2 p + kind; xor with
 * the step's parity picks the value of this step (kind 0) or of the step before (kind 1). */
typedef struct k_entry {
    uint32_t slot;
    float coefficient;
} k_entry;

/* Of one face: cotangents of the angles opposite its half-edges, and twice its area. */
typedef struct k_face_shape {
    double cotangent[3], twice_area;
} k_face_shape;

/* A face without area has cotangents 0: it contributes nothing. */
static inline k_face_shape k_shape_of_face(const loxo_mesh_view *m, int64_t f)
{
    loxo_vec3 corner[3];
    k_face_corners(m, f, corner);
    const loxo_vec3 ab = v3_sub(corner[1], corner[0]), bc = v3_sub(corner[2], corner[1]);
    const loxo_vec3 ca = v3_sub(corner[0], corner[2]);
    const double twice_area = v3_norm(v3_cross(ab, ca));
    const double minus_inverse = twice_area > 0.0 ? -1.0 / twice_area : 0.0;
    return (k_face_shape){
        {v3_dot(bc, ca) * minus_inverse, v3_dot(ca, ab) * minus_inverse, v3_dot(ab, bc) * minus_inverse}, twice_area};
}

/* Number of neighbours, or rather of edges: an intrinsic triangulation may have several to one neighbour, and some from a
 * vertex to itself, which both leave it and arrive. */
static inline uint32_t k_degree(const loxo_mesh_view *m, loxo_index v)
{
    const loxo_index first = m->vertex_halfedge[v];
    uint32_t n = 0;
    if (first < 0) return 0;
    loxo_index h = first;
    do {
        ++n;
        h = m->halfedge_twin[k_previous(h)];
    } while (h >= 0 && h != first);
    return h < 0 ? n + 1 : n;
}

/* Entries of vertex v, which has faces: neighbours counter-clockwise with the cotangent weights (cot a + cot b) / 2 of the
 * edges, the same seen from both ends. Returns one third of the area of the faces around. */
static inline double k_cotangent_row(const loxo_mesh_view *m, loxo_index v, k_entry *entry)
{
    const loxo_index first = m->vertex_halfedge[v];
    loxo_index h = first, back = -1;
    double twice_area = 0.0, before = 0.0, of_first = 0.0;
    uint32_t n = 0;
    do {
        const int64_t f = k_face_of(h);
        const k_face_shape s = k_shape_of_face(m, f);
        back = k_previous(h);
        entry[n].slot = (uint32_t)k_head(m, h);
        entry[n++].coefficient = (float)(0.5 * (before + s.cotangent[h - 3 * f]));
        if (n == 1) of_first = s.cotangent[h - 3 * f];
        before = s.cotangent[back - 3 * f];
        twice_area += s.twice_area;
        h = m->halfedge_twin[back];
    } while (h >= 0 && h != first);
    if (h < 0) { /* the last neighbour at a boundary: only the half-edge towards us exists */
        entry[n].slot = (uint32_t)m->halfedge_vertex[back];
        entry[n].coefficient = (float)(0.5 * before);
    } else {
        entry[0].coefficient = (float)(0.5 * (before + of_first));
    }
    return twice_area / 6.0;
}

/* Rings of K_BESIDE vertices side by side: spokes from the vertex to its neighbours, one after the other; behind the last of a
 * closed ring the first again, then zeros. What comes of them: the cotangent weight of each spoke, that of the first of a closed
 * ring in two parts, in front and behind; twice the area of the faces. */
typedef struct k_spokes {
    double x[K_RING + 2][K_BESIDE], y[K_RING + 2][K_BESIDE], z[K_RING + 2][K_BESIDE];
    double weight[K_RING + 2][K_BESIDE], twice_area[K_BESIDE];
} k_spokes;

/* Corners between the spokes 0 .. n_corners of each ring: the same numbers as k_shape_of_face, by one division and one root a
 * corner and without asking which face it is in. */
static inline void k_ring_weights(int n_corners, k_spokes *s)
{
    for (int i = 0; i < K_BESIDE; ++i)
        s->twice_area[i] = s->weight[0][i] = 0.0;
    for (int k = 0; k < n_corners; ++k)
        for (int i = 0; i < K_BESIDE; ++i) {
            const loxo_vec3 u = {s->x[k][i], s->y[k][i], s->z[k][i]};
            const loxo_vec3 w = {s->x[k + 1][i], s->y[k + 1][i], s->z[k + 1][i]};
            const loxo_vec3 across = v3_sub(w, u);
            const double twice_area = v3_norm(v3_cross(u, w));
            const double half_inverse = twice_area > 0.0 ? 0.5 / twice_area : 0.0;
            s->twice_area[i] += twice_area;
            s->weight[k][i] += v3_dot(w, across) * half_inverse;
            s->weight[k + 1][i] = -v3_dot(u, across) * half_inverse;
        }
}

/* Of a block of rows: the squared relative change of its values, root mean square weighted by area, in the last even and
 * the last odd step; and the weight of its values. */
typedef struct k_change {
    float square[2], size;
} k_change;

/* Relaxes places begin..end-1 of one block once; row[0] is that of begin: first every other row, then those between,
 * so that neighbours in a level, which mostly stand side by side, are not waited for. constant[p] is the heat of row
 * p, a source; NULL: there is none. */
static inline void k_relax_block(const k_row *restrict row, const k_entry *restrict entry, const float *constant,
                                 double *value, int64_t begin, int64_t end, unsigned parity, k_change *change)
{
    double moved = 0.0, size = 0.0;
    for (int64_t start = begin; start < begin + 2; ++start) {
        for (int64_t p = start; p < end; p += 2) {
            const double old = value[(2 * p + 1) ^ parity];
            const k_row *own = &row[p - begin];
            const k_entry *e = &entry[own[0].begin], *const e_end = &entry[own[1].begin];
            double sum = own->keep * old;
            if (constant != NULL) sum += (double)constant[p];
            for (; e + 2 < e_end; e += 3) {
                sum += (double)e[0].coefficient * value[e[0].slot ^ parity];
                sum += (double)e[1].coefficient * value[e[1].slot ^ parity];
                sum += (double)e[2].coefficient * value[e[2].slot ^ parity];
            }
            for (; e < e_end; ++e)
                sum += (double)e->coefficient * value[e->slot ^ parity];
            value[(2 * p) ^ parity] = sum;
            moved += (double)own->weight * ((sum - old) * (sum - old));
            size += (double)own->weight * (sum * sum);
        }
    }
    change->square[parity] = size > 0.0 ? (float)(moved / size) : size == 0.0 ? 0.0f : HUGE_VALF;
    change->size = (float)size;
}

/* Right side minus left side of the row of place p, whose heat is constant: what relaxing it now would add to its
 * value. */
static inline double k_row_step(const k_row *restrict row, const k_entry *restrict entry, double constant,
                                const double *value, int64_t p)
{
    double sum = constant + row[0].keep * value[2 * p];
    for (uint32_t k = row[0].begin; k < row[1].begin; ++k)
        sum += (double)entry[k].coefficient * value[entry[k].slot & ~1u];
    return sum - value[2 * p];
}

#endif
