/* SPDX-License-Identifier: MIT
 * The hot kernels as a table of functions, compiled once per instruction set from one source. Contraction is off and
 * no sum is reordered, so every variant gives the same bits; the baseline is the reference. */
#ifndef LOXO_KERNEL_VARIANTS_H
#define LOXO_KERNEL_VARIANTS_H

#include "kernel/check_kernel.h"
#include "kernel/diffusion_kernel.h"
#include "kernel/extension_kernel.h"
#include "kernel/jet_kernel.h"
#include "kernel/lanes.h"
#include "kernel/moments.h"
#include "kernel/unfold_kernel.h"

#include <loxo/context.h>

typedef struct k_variant {
    const char *name;
    /* Relaxes whole blocks of block_rows, see k_relax_block; change: one a block. */
    void (*relax_blocks)(const k_row *row, const k_entry *entry, const float *constant, double *value, int64_t begin,
                         int64_t end, int64_t block_rows, unsigned parity, k_change *change);
    /* Faces begin..end-1: products of the unit direction h = -grad u / |grad u| with the three half-edges; */
    void (*face_differences)(const loxo_mesh_view *m, const double *value, const int32_t *scale, int64_t begin,
                             int64_t end, double *difference);
    /* ... and all that the face-based ADMM starts from, see admm_kernel.h. */
    void (*face_targets)(const loxo_mesh_view *m, const double *value, const int32_t *scale, int64_t begin, int64_t end,
                         double *area, double (*square)[3], double (*target)[2], double *push);
    void (*ring_weights)(int n_corners, k_spokes *spokes); /* see diffusion_kernel.h */
    void (*unfold_corners)(k_corners *corners);            /* see unfold_kernel.h */
    /* One ADMM iteration on faces begin..end-1, see admm_kernel.h. */
    void (*admm_edge)(const loxo_mesh_view *m, double theta, int64_t begin, int64_t end, const double *closure,
                      double *a, const double *potential, double *potential_next);
    void (*admm_face)(const loxo_mesh_view *m, double penalty, int64_t begin, int64_t end, const double *area,
                      const double (*square)[3], const double (*target)[2], const double (*x)[2], double (*x_next)[2],
                      const double *push, double *push_next);
    void (*look)(k_looks *batch); /* see check_kernel.h */
    /* see moment_kernel.h */
    void (*moments2)(const double *atom, const double *weight, int64_t n, const double w[2], double co, double sums[6]);
    void (*moments3)(const double *atom, const double *weight, int64_t n, const double w[3], double co,
                     double sums[10]);
    void (*first_moments)(int d, const double *atom, const double *weight, int64_t n, double *sums, k_first_look *look);
    void (*lanes)(k_lanes *job); /* see lane_kernel.h */
    bool (*lanes_first)(const k_lanes *job, k_lane_table table);
    void (*lanes_again)(const k_lanes *job, const double *w, double co, k_lane_table table);
    void (*lanes_last)(k_lanes *job, const double *w, double co, bool fixes, bool writes);
    void (*lanes_one_step)(int d, double tolerance, double ahead, const double sums[9], k_lane_point *point);
    /* see ball_kernel.h */
    void (*shifts3)(int n_shifts, const double (*w)[3], const double *co, int64_t n, const double *x, double *y);
    /* see extension_kernel.h */
    void (*poisson_weights)(int64_t n, const double *x, const double *y, const double z[2], double co, double *p);
    void (*moved2)(const k_moved *moved, double *atom);
    void (*moved3)(const k_moved *moved, double *atom);
    /* see jet_kernel.h */
    void (*jet_arrivals)(k_jet_batch *batch);
    void (*ring_corners)(int64_t n, double *spoke, const double *rim, double *cosine, double *sine);
} k_variant;

/* The table for an instruction set of this processor (loxo_context_isa). */
const k_variant *k_variant_get(loxo_isa isa);

#endif
