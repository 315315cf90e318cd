/* SPDX-License-Identifier: MIT
 * Compiled once per instruction set; K_VARIANT names the table, K_VARIANT_TEXT the set. */
#include "kernel/variants.h"

#include "kernel/admm_kernel.h"
#include "kernel/descent_kernel.h"

static void relax_blocks(const k_row *row, const k_entry *entry, const float *constant, double *value, int64_t begin,
                         int64_t end, int64_t block_rows, unsigned parity, k_change *change)
{
    for (int64_t b = begin; b < end; b += block_rows, ++change) {
        const int64_t block_end = b + block_rows < end ? b + block_rows : end;
        if (constant == NULL)
            k_relax_block(row, entry, NULL, value, b, block_end, parity, change);
        else
            k_relax_block(row, entry, constant, value, b, block_end, parity, change);
    }
}

static void face_differences(const loxo_mesh_view *m, const double *value, const int32_t *scale, int64_t begin,
                             int64_t end, double *difference)
{
    k_face_batch b;
    double d[3][K_BATCH];
    for (int64_t f = begin; f < end; f += K_BATCH) {
        const int64_t n = end - f < K_BATCH ? end - f : K_BATCH;
        k_gather_batch(m, value, scale, f, n, &b);
        for (int i = 0; i < K_BATCH; ++i) {
            double own[3];
            k_batch_differences(&b, i, own);
            for (int k = 0; k < 3; ++k)
                d[k][i] = own[k];
        }
        for (int64_t i = 0; i < n; ++i)
            for (int k = 0; k < 3; ++k)
                difference[3 * (f + i) + k] = d[k][i];
    }
}

static void face_directions(const loxo_mesh_view *m, const double *value, const int32_t *scale, int64_t begin,
                            int64_t end, double (*direction)[3])
{
    for (int64_t f = begin; f < end; ++f) {
        k_prefetch_corners(m, value, scale, f);
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
