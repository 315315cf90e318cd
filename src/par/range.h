/* SPDX-License-Identifier: MIT
 * Each thread its own range; sums in fixed blocks; prefix sums; stable radix sort. All give the same bits for every
 * number of threads. */
#ifndef LOXO_PAR_RANGE_H
#define LOXO_PAR_RANGE_H

#include "base/context.h"

#include <stdint.h>

typedef struct loxo_range {
    int64_t begin, end;
} loxo_range;

/* Range i of n_ranges of 0..n-1, in order, sizes differing by one at most. */
static inline loxo_range loxo_range_of(int64_t n, int64_t i, int64_t n_ranges)
{
    const int64_t q = n / n_ranges, r = n % n_ranges;
    const int64_t begin = q * i + (i < r ? i : r);
    return (loxo_range){begin, begin + q + (i < r ? 1 : 0)};
}

/* Of the calling thread inside a parallel region; everything outside one. */
loxo_range loxo_thread_range(int64_t n);
int loxo_thread_id(void);
int loxo_thread_count(void);

#define LOXO_SUM_BLOCK 4096
#define LOXO_SUM_MAX   8

/* Adds up to LOXO_SUM_MAX sums over 0..n-1. partial is called for each block of LOXO_SUM_BLOCK and adds to sums; the
 * blocks are added in order. */
typedef void (*loxo_partial_fn)(int64_t begin, int64_t end, const void *arg, double *sums);
loxo_status loxo_sum(loxo_context *ctx, int64_t n, int n_sums, loxo_partial_fn partial, const void *arg, double *sums);

/* offset[i] = count[0] + ... + count[i-1], in place and one longer than counts: [n + 1], offset[n] the total. */
int64_t loxo_scan_i32(loxo_context *ctx, int64_t n, const int32_t *count, int64_t *offset);
int64_t loxo_scan_in_place(loxo_context *ctx, int64_t n, int64_t *offset);

/* Sorts keys ascending, stably, and payload with them. [n] each; allocates as much again. key_bits: only that many low
 * bits are looked at. */
loxo_status loxo_sort_u64(loxo_context *ctx, int64_t n, uint64_t *key, uint32_t *payload, int key_bits);

#endif
