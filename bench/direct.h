/* SPDX-License-Identifier: MIT
 * The heat equation (4) by a sparse direct solve that keeps relative accuracy: what the diffusion is compared with.
 * Needs CHOLMOD; this file's users are built only where it is found. */
#ifndef LOXO_BENCH_DIRECT_H
#define LOXO_BENCH_DIRECT_H

#include <loxo/mesh.h>

typedef struct bench_direct_info {
    double time;             /* t = m h^2 */
    double mean_edge_length; /* h, over the edges */
    int64_t n_factor;        /* entries of L */
    double factor_s, solve_s;
    double residual;       /* largest |b - S u|_i / (|S| |u| + |b|)_i after refinement: relative at every vertex */
    int64_t n_nonpositive; /* heats that are not positive (negative cotangent weights make them) */
} bench_direct_info;

/* Solves (A + t C) u = delta; A a third of the triangles' areas at a vertex, C the cotangent matrix with weights
 * (cot a + cot b) / 2. The matrix is factored as L D L^T in double; the triangular solves and two steps of refinement
 * are in long double, whose exponent reaches 1e-4932 on x86-64.
 *   value, scale   [n_vertices] out: u = value * 2^scale, |value| in [0.5, 1)
 * returns          LOXO_OK; LOXO_ERR_MEMORY; LOXO_ERR_NUMERIC: no positive pivot, or a heat that vanished: the mesh is
 *                  wider than about 11,000 edges, or of several pieces, or has unreferenced vertices */
loxo_status bench_direct_heat(loxo_context *ctx, const loxo_mesh_arrays *mesh, double time_factor,
                              const loxo_index *sources, int64_t n_sources, double *value, int32_t *scale,
                              bench_direct_info *info);

#endif
