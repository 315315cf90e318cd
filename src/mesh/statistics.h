/* SPDX-License-Identifier: MIT
 * Extremes and percentiles of many numbers that are computed on the fly, twice, and never stored. */
#ifndef LOXO_MESH_STATISTICS_H
#define LOXO_MESH_STATISTICS_H

#include "base/context.h"

/* Writes the numbers of item i (a face) to value, at most three, none of them NaN; returns how many. */
typedef int (*loxo_sample_fn)(const void *arg, int64_t i, double value[3]);

#define LOXO_MOST_QUANTILES 4

typedef struct loxo_quantiles {
    int64_t n;
    double min, max;                      /* exact; NaN when n is 0 */
    double quantile[LOXO_MOST_QUANTILES]; /* nearest rank, known to one part in 2^20, within min..max */
} loxo_quantiles;

/* Quantiles over items 0..n_items-1: the upper 16 bits of the numbers are counted, then the next 16 in the bins that hold
 * the wanted ranks. Counts are integers, so the result is the same for every number of threads.
 *   per_cent   [n_quantiles] 0 to 100, n_quantiles 1 to LOXO_MOST_QUANTILES
 * LOXO_OK, LOXO_ERR_MEMORY; 256 KiB a thread and quantile of workspace. */
loxo_status loxo_quantiles_find(loxo_context *ctx, int64_t n_items, loxo_sample_fn sample, const void *arg,
                                int n_quantiles, const int *per_cent, loxo_quantiles *quantiles);

#endif
