/* SPDX-License-Identifier: MIT
 * Global constraints: sums along chains of edges that must vanish, eqs. (23) to (26). */
#ifndef LOXO_GEODESIC_PARALLEL_HEAT_CHAINS_H
#define LOXO_GEODESIC_PARALLEL_HEAT_CHAINS_H

#include "solver/geodesic/parallel_heat/parallel_heat_internal.h"

/* An edge that chains pass: its own x is kept, since its update differs from that of all other edges. */
typedef struct special_edge {
    loxo_index halfedge; /* the lower of its two */
    int32_t n_chains;    /* passes, counted with repeats */
    double average;      /* hbar along the half-edge */
    double x;
    double correction; /* x minus what the potentials say */
    double pull;       /* sum over its passes of sign * r of the chain / length of the chain */
} special_edge;

typedef struct special_edges {
    int64_t n;
    special_edge *edge;
    int64_t *of_element; /* [chain elements] -> edge */
    double *a;           /* [n_chains] multiplier of each chain, see admm_kernel.h */
} special_edges;

loxo_status special_edges_create(loxo_context *ctx, const loxo_mesh_view *m, const loxo_chains *chains,
                                 special_edges *out);
void special_edges_destroy(loxo_context *ctx, special_edges *s);

/* +1 when element i of the chains is walked along the lower half-edge of its edge, -1 against it. */
double chain_sign(const loxo_mesh_view *m, const loxo_chains *chains, int64_t i);

#endif
