/* SPDX-License-Identifier: MIT
 * The rotation that brings one map nearest to another, and how far they are then apart. */
#include "hyperbolic/hyperbolic.h"
#include "kernel/vec3.h"
#include "par/range.h"
#include "solver/sphere/hbtr_internal.h"

#include <string.h>

/* Of unit quaternions q the one with the largest q . N q, where sum to_i . (q from_i q*) = q . N q: the singular value decomposition of m gives
 * the same rotation, with a case for reflections that this does not need. Where several are as good, as for points on one line through the centre, the
 * one that turns least: of the greatest eigenvectors, to rounding, the nearest to (1, 0, 0, 0). */
void sphere_find_rotation(const double m[3][3], double r[3][3])
{
    const double trace = m[0][0] + m[1][1] + m[2][2];
    double n[4][4], value[4], v[4][4];
    n[0][0] = trace;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        n[0][i + 1] = n[i + 1][0] = m[k][j] - m[j][k];
        n[i + 1][i + 1] = 2.0 * m[i][i] - trace;
        n[j + 1][k + 1] = n[k + 1][j + 1] = m[j][k] + m[k][j];
    }
    hyper_eigen(4, &n[0][0], value, &v[0][0]);
    double q[4] = {0.0, 0.0, 0.0, 0.0}, square = 0.0;
    for (int k = 0; k < 4; ++k)
        for (int i = 0; i < 4; ++i)
            if (value[k] >= value[3] - 1e-12 * fmax(value[3], -value[0])) q[i] += v[k][0] * v[k][i];
    for (int i = 0; i < 4; ++i)
        square += q[i] * q[i];
    const bool is_half_turn = !(square > 1e-20);
    for (int i = 0; i < 4; ++i)
        q[i] = is_half_turn ? v[3][i] : q[i] / sqrt(square);
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const double a = q[0], b = q[i + 1], c = q[j + 1], d = q[k + 1];
        r[i][i] = a * a + b * b - c * c - d * d;
        r[i][j] = 2.0 * (b * c - a * d);
        r[i][k] = 2.0 * (b * d + a * c);
    }
}

typedef struct two_maps {
    sphere_const_map from, to;
    double r[3][3];
} two_maps;

/* sums: rows of the first eight entries of sum to_i from_i^T. */
static void add_products(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const two_maps *maps = arg;
    double sum[8] = {0.0};
    for (int64_t i = begin; i < end; ++i)
        for (int k = 0; k < 8; ++k)
            sum[k] += maps->to[i][k / 3] * maps->from[i][k % 3];
    for (int k = 0; k < 8; ++k)
        sums[k] += sum[k];
}

/* sums: the ninth. */
static void add_last_product(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const two_maps *maps = arg;
    double sum = 0.0;
    for (int64_t i = begin; i < end; ++i)
        sum += maps->to[i][2] * maps->from[i][2];
    sums[0] += sum;
}

/* sums: squares of what is left. */
static void add_rest(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const two_maps *maps = arg;
    double sum = 0.0;
    for (int64_t i = begin; i < end; ++i) {
        const loxo_vec3 x = v3_load(maps->from[i]);
        for (int k = 0; k < 3; ++k) {
            const double d = maps->to[i][k] - v3_dot(v3_load(maps->r[k]), x);
            sum += d * d;
        }
    }
    sums[0] += sum;
}

loxo_status sphere_find_move(loxo_context *ctx, int64_t n, sphere_const_map from, sphere_const_map to, double *move)
{
    two_maps maps = {.from = from, .to = to};
    double m[3][3];
    loxo_status status = loxo_sum(ctx, n, 8, add_products, &maps, &m[0][0]);
    if (status >= 0) status = loxo_sum(ctx, n, 1, add_last_product, &maps, &m[2][2]);
    if (status < 0) return status;
    sphere_find_rotation((const double(*)[3])m, maps.r);
    return loxo_sum(ctx, n, 1, add_rest, &maps, move);
}
