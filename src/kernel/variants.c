/* SPDX-License-Identifier: MIT
 * Compiled once per instruction set; K_VARIANT names the table, K_VARIANT_TEXT the set. */
#include "kernel/variants.h"

#include "kernel/admm_kernel.h"
#include "kernel/ball_kernel.h"
#include "kernel/descent_kernel.h"
#include "kernel/lane_kernel.h"
#include "kernel/moment_kernel.h"

static void relax_blocks(const k_row *row, const k_entry *entry, const float *constant, double *value, int64_t begin,
                         int64_t end, int64_t block_rows, unsigned parity, k_change *change)
{
    for (int64_t b = begin; b < end; b += block_rows, ++change) {
        const int64_t block_end = b + block_rows < end ? b + block_rows : end;
        if (constant == NULL)
            k_relax_block(row + (b - begin), entry, NULL, value, b, block_end, parity, change);
        else
            k_relax_block(row + (b - begin), entry, constant, value, b, block_end, parity, change);
    }
}

static void ring_weights(int n_corners, k_spokes *spokes) { k_ring_weights(n_corners, spokes); }

static void unfold_corners(k_corners *corners) { k_unfold_corners(corners); }

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
            (void)k_batch_differences(&b, i, own);
            for (int k = 0; k < 3; ++k)
                d[k][i] = own[k];
        }
        for (int64_t i = 0; i < n; ++i)
            for (int k = 0; k < 3; ++k)
                difference[3 * (f + i) + k] = d[k][i];
    }
}

static void face_targets(const loxo_mesh_view *m, const double *value, const int32_t *scale, int64_t begin, int64_t end,
                         double *area, double (*square)[3], double (*target)[2], double *push)
{
    k_face_batch b;
    double d[3][K_BATCH], areas[K_BATCH], squares[3][K_BATCH];
    for (int64_t f = begin; f < end; f += K_BATCH) {
        const int64_t n = end - f < K_BATCH ? end - f : K_BATCH;
        k_gather_batch(m, value, scale, f, n, &b);
        for (int i = 0; i < K_BATCH; ++i) {
            double own[3];
            areas[i] = k_batch_differences(&b, i, own);
            for (int k = 0; k < 3; ++k) {
                const loxo_vec3 e = k_batch_edge(&b, i, k, k == 2 ? 0 : k + 1);
                squares[k][i] = v3_dot(e, e);
                d[k][i] = own[k];
            }
        }
        for (int64_t i = 0; i < n; ++i) {
            area[f + i] = areas[i];
            for (int k = 0; k < 3; ++k) {
                square[f + i][k] = squares[k][i];
                push[3 * (f + i) + k] = k < 2 ? d[k][i] : k_third(d[0][i], d[1][i]);
                if (k < 2) target[f + i][k] = d[k][i];
            }
        }
    }
}

static void admm_edge(const loxo_mesh_view *m, double theta, int64_t begin, int64_t end, const double *closure,
                      double *a, const double *potential, double *potential_next)
{
    k_admm_edge(m, theta, begin, end, closure, a, potential, potential_next);
}

static void admm_face(const loxo_mesh_view *m, double penalty, int64_t begin, int64_t end, const double *area,
                      const double (*square)[3], const double (*target)[2], const double (*x)[2], double (*x_next)[2],
                      const double *push, double *push_next)
{
    k_admm_face(m, penalty, begin, end, area, square, target, x, x_next, push, push_next);
}

static void look(k_looks *batch) { k_look(batch); }

static void moments2(const double *atom, const double *weight, int64_t n, const double w[2], double co, double sums[6])
{
    if (weight == NULL)
        k_moments2(atom, NULL, n, w, co, sums);
    else
        k_moments2(atom, weight, n, w, co, sums);
}

static void moments3(const double *atom, const double *weight, int64_t n, const double w[3], double co, double sums[10])
{
    if (weight == NULL)
        k_moments3(atom, NULL, n, w, co, sums);
    else
        k_moments3(atom, weight, n, w, co, sums);
}

static void first_moments(int d, const double *atom, const double *weight, int64_t n, double *sums, k_first_look *look)
{
    if (d == 3 && weight == NULL)
        k_first_moments(3, atom, NULL, n, sums, look);
    else if (d == 3)
        k_first_moments(3, atom, weight, n, sums, look);
    else if (weight == NULL)
        k_first_moments(2, atom, NULL, n, sums, look);
    else
        k_first_moments(2, atom, weight, n, sums, look);
}

static void lanes(k_lanes *job) { k_lanes_run(job); }

static bool lanes_first(const k_lanes *job, k_lane_table table) { return k_lanes_first(job, table); }

static void lanes_again(const k_lanes *job, const double *w, double co, k_lane_table table)
{
    k_lanes_again(job, w, co, table);
}

static void lanes_last(k_lanes *job, const double *w, double co, bool fixes, bool writes)
{
    k_lanes_last(job, w, co, fixes, writes);
}

static void lanes_one_step(int d, double tolerance, double ahead, const double sums[9], k_lane_point *point)
{
    k_lanes_one_step(d, tolerance, ahead, sums, point);
}

static void shifts3(int n_shifts, const double (*w)[3], const double *co, int64_t n, const double *x, double *y)
{
    k_ball_shifts3(n_shifts, w, co, n, x, y);
}

static void poisson_weights(int64_t n, const double *x, const double *y, const double z[2], double co, double *p)
{
    k_poisson_weights(n, x, y, z, co, p);
}

static void moved2(const k_moved *moved, double *atom) { k_moved_atoms(2, moved, atom); }

static void moved3(const k_moved *moved, double *atom) { k_moved_atoms(3, moved, atom); }

static void jet_arrivals(k_jet_batch *batch) { k_jet_arrivals(batch); }

static void ring_corners(int64_t n, double *spoke, const double *rim, double *cosine, double *sine)
{
    k_ring_corners(n, spoke, rim, cosine, sine);
}

extern const k_variant K_VARIANT;
const k_variant K_VARIANT = {.name = K_VARIANT_TEXT,
                             .relax_blocks = relax_blocks,
                             .ring_weights = ring_weights,
                             .unfold_corners = unfold_corners,
                             .face_differences = face_differences,
                             .face_targets = face_targets,
                             .admm_edge = admm_edge,
                             .admm_face = admm_face,
                             .look = look,
                             .moments2 = moments2,
                             .moments3 = moments3,
                             .first_moments = first_moments,
                             .lanes = lanes,
                             .lanes_first = lanes_first,
                             .lanes_again = lanes_again,
                             .lanes_last = lanes_last,
                             .lanes_one_step = lanes_one_step,
                             .shifts3 = shifts3,
                             .poisson_weights = poisson_weights,
                             .moved2 = moved2,
                             .moved3 = moved3,
                             .jet_arrivals = jet_arrivals,
                             .ring_corners = ring_corners};
