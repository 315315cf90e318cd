/* SPDX-License-Identifier: MIT
 * Heat diffusion: the rows of (A + t C) u = u_0, A the lumped areas, C the positive semidefinite cotangent matrix, in
 * breadth-first order and scaled per vertex, and their relaxation.
 * source  Tao et al. 2021, eqs. (4), (6), (7) */
#ifndef LOXO_KERNEL_DIFFUSION_KERNEL_H
#define LOXO_KERNEL_DIFFUSION_KERNEL_H

#include "kernel/scaled.h"
#include "kernel/vec3.h"

/* One vertex of the system, divided by its diagonal and times its relaxation factor omega:
 *   value <- keep * value + constant + sum over entries coefficient * value[neighbour],  keep = 1 - omega.
 * Rows stand in breadth-first order; the entries of row p are begin[p] .. begin[p+1]-1. */
typedef struct k_row {
    uint32_t begin;
    float keep;
    float weight;   /* of this vertex in the change of its level: area / first value^2 */
    float constant; /* the source's heat */
} k_row;

/* Values are kept twice, for even and for odd steps: value[2 p + (step & 1)]. An entry's slot is 2 p + kind; xor with
 * the step's parity picks the value of this step (kind 0) or of the step before (kind 1). */
typedef struct k_entry {
    uint32_t slot;
    float coefficient;
} k_entry;

/* Cotangent weights (cot a + cot b) / 2 of the edges from vertex v to its n neighbours, whose numbers stand
 * counter-clockwise in entry[].slot, into entry[].coefficient; is_closed: the last neighbour shares a face with the
 * first. Returns one third of the area of the faces around v. Cotangents come from differences at v: cot at p_i in face
 * (v, p_i, p_j) is (|e_i|^2 - e_i . e_j) / |e_i x e_j|. A face without area contributes nothing. */
static inline double k_cotangent_row(const loxo_mesh_view *m, loxo_index v, k_entry *restrict entry, uint32_t n,
                                     bool is_closed)
{
    const loxo_vec3 p = k_position(m, v);
    const loxo_vec3 e_first = v3_sub(k_position(m, (loxo_index)entry[0].slot), p);
    const double ee_first = v3_dot(e_first, e_first);
    const uint32_t n_faces = is_closed ? n : n - 1;
    double carry = 0.0, weight_first = 0.0, twice_area_sum = 0.0, ee = ee_first;
    loxo_vec3 e = e_first;
    for (uint32_t k = 0; k < n_faces; ++k) {
        const bool is_last = k + 1 == n;
        const loxo_vec3 e_next = is_last ? e_first : v3_sub(k_position(m, (loxo_index)entry[k + 1].slot), p);
        const double ee_next = is_last ? ee_first : v3_dot(e_next, e_next), along = v3_dot(e, e_next);
        const double twice_area = v3_norm(v3_cross(e, e_next));
        const double inverse = twice_area > 0.0 ? 0.5 / twice_area : 0.0;
        const double weight = carry + (ee_next - along) * inverse;
        if (k == 0) weight_first = weight;
        entry[k].coefficient = (float)weight;
        carry = (ee - along) * inverse;
        twice_area_sum += twice_area;
        e = e_next;
        ee = ee_next;
    }
    if (is_closed)
        entry[0].coefficient = (float)(weight_first + carry);
    else
        entry[n - 1].coefficient = (float)carry;
    return twice_area_sum / 6.0;
}

#define PARTIAL_SIZE 3

/* Relaxes rows begin..end-1 of one block once: first every other row, then those between, so that neighbours in a level,
 * which mostly stand side by side, are not waited for. partial[parity] receives the block's sum of weight * (change)^2,
 * partial[2] that of weight * value^2. */
static inline void k_relax_block(const k_row *restrict row, const k_entry *restrict entry, double *value, int64_t begin,
                                 int64_t end, unsigned parity, float *partial)
{
    double moved = 0.0, size = 0.0;
    for (int64_t start = begin; start < begin + 2; ++start) {
        for (int64_t p = start; p < end; p += 2) {
            const double old = value[(2 * p + 1) ^ parity];
            const k_entry *e = &entry[row[p].begin], *const e_end = &entry[row[p + 1].begin];
            double sum = (double)row[p].constant + (double)row[p].keep * old;
            for (; e + 2 < e_end; e += 3) {
                sum += (double)e[0].coefficient * value[e[0].slot ^ parity];
                sum += (double)e[1].coefficient * value[e[1].slot ^ parity];
                sum += (double)e[2].coefficient * value[e[2].slot ^ parity];
            }
            for (; e < e_end; ++e)
                sum += (double)e->coefficient * value[e->slot ^ parity];
            value[(2 * p) ^ parity] = sum;
            moved += (double)row[p].weight * ((sum - old) * (sum - old));
            size += (double)row[p].weight * (sum * sum);
        }
    }
    partial[parity] = (float)moved;
    partial[2] = (float)size;
}

/* Right side minus left side of row p: what relaxing it now would add to its value. */
static inline double k_row_step(const k_row *restrict row, const k_entry *restrict entry, const double *value,
                                int64_t p)
{
    double sum = (double)row[p].constant + (double)row[p].keep * value[2 * p];
    for (uint32_t k = row[p].begin; k < row[p + 1].begin; ++k)
        sum += (double)entry[k].coefficient * value[entry[k].slot & ~1u];
    return sum - value[2 * p];
}

#endif
