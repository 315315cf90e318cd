/* SPDX-License-Identifier: MIT
 * Compiled once per instruction set; K_VARIANT names the table, K_VARIANT_TEXT the set. */
#include "kernel/variants.h"

#include "kernel/admm_kernel.h"
#include "kernel/descent_kernel.h"

static void relax_blocks(const k_row *row, const k_entry *entry, double *value, int64_t begin, int64_t end,
                         int64_t block_rows, unsigned parity, float *partial)
{
    for (int64_t b = begin; b < end; b += block_rows, partial += PARTIAL_SIZE) {
        const int64_t block_end = b + block_rows < end ? b + block_rows : end;
        k_relax_block(row, entry, value, b, block_end, parity, partial);
    }
}

/* Asks for what the faces some way ahead will look up; faces are ordered by their vertices, about two to one. */
static inline void prefetch_corners(const loxo_mesh_view *m, const double *value, const int32_t *scale, int64_t f)
{
    const int64_t v = (int64_t)m->halfedge_vertex[3 * f] + K_AHEAD / 2;
    if (v >= m->n_vertices) return;
    __builtin_prefetch(&value[v], 0, 2);
    __builtin_prefetch(&scale[v], 0, 2);
    if (m->position != NULL)
        __builtin_prefetch(&m->position[v], 0, 2);
    else
        __builtin_prefetch(&m->position_float[v], 0, 2);
}

static void face_differences(const loxo_mesh_view *m, const double *value, const int32_t *scale, int64_t begin,
                             int64_t end, double *difference)
{
    for (int64_t f = begin; f < end; ++f) {
        const loxo_index *corner = &m->halfedge_vertex[3 * f];
        prefetch_corners(m, value, scale, f);
        const loxo_vec3 a = k_position(m, corner[0]), b = k_position(m, corner[1]), c = k_position(m, corner[2]);
        const loxo_vec3 h = k_heat_descent(m, corner, value, scale);
        difference[3 * f] = v3_dot(h, v3_sub(b, a));
        difference[3 * f + 1] = v3_dot(h, v3_sub(c, b));
        difference[3 * f + 2] = v3_dot(h, v3_sub(a, c));
    }
}

static void face_directions(const loxo_mesh_view *m, const double *value, const int32_t *scale, int64_t begin,
                            int64_t end, double (*direction)[3])
{
    for (int64_t f = begin; f < end; ++f) {
        prefetch_corners(m, value, scale, f);
        v3_store(direction[f], k_heat_descent(m, &m->halfedge_vertex[3 * f], value, scale));
    }
}

static void admm_edge(const loxo_mesh_view *m, double theta, int64_t begin, int64_t end, const double *closure,
                      double *a, const double *potential, double *potential_next)
{
    k_admm_edge(m, theta, begin, end, closure, a, potential, potential_next);
}

static void admm_face(const loxo_mesh_view *m, double penalty, bool is_first, int64_t begin, int64_t end,
                      const double *area, const double (*target)[3], const double (*gradient)[3],
                      double (*gradient_next)[3], double *jump)
{
    k_admm_face(m, penalty, is_first, begin, end, area, target, gradient, gradient_next, jump);
}

extern const k_variant K_VARIANT;
const k_variant K_VARIANT = {.name = K_VARIANT_TEXT,
                             .relax_blocks = relax_blocks,
                             .face_differences = face_differences,
                             .face_directions = face_directions,
                             .admm_edge = admm_edge,
                             .admm_face = admm_face};
