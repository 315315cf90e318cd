/* SPDX-License-Identifier: MIT */
#include "mesh/statistics.h"

#include "base/allocate.h"
#include "par/range.h"

#include <math.h>
#include <string.h>

#define N_BINS 65536

/* Upper 32 bits of a number, so that their order as integers is the order of the numbers: of a negative one all bits
 * are turned, of the others the sign. Zeros are made one first. */
static uint32_t key_of(double x)
{
    uint64_t bits;
    const double one_zero = x + 0.0;
    memcpy(&bits, &one_zero, sizeof bits);
    bits = bits >> 63 != 0 ? ~bits : bits | (uint64_t)1 << 63;
    return (uint32_t)(bits >> 32);
}

/* The number in the middle of those with this key. */
static double value_of(uint32_t key)
{
    uint64_t bits = (uint64_t)key << 32 | (uint64_t)1 << 31;
    double x;
    bits = bits >> 63 != 0 ? bits & ~((uint64_t)1 << 63) : ~bits;
    memcpy(&x, &bits, sizeof x);
    return x;
}

typedef struct pass {
    int64_t n_items;
    loxo_sample_fn sample;
    const void *arg;
    int n_chosen;                         /* 0: all numbers, by upper half; else those in chosen bins, by lower half */
    uint32_t chosen[LOXO_MOST_QUANTILES]; /* upper halves */
} pass;

/* Histograms of a range of items: bins[n_chosen or 1][N_BINS]. */
static void count_range(const pass *p, loxo_range r, uint32_t *bins, double *min, double *max)
{
    for (int64_t i = r.begin; i < r.end; ++i) {
        double value[3];
        const int n = p->sample(p->arg, i, value);
        for (int k = 0; k < n; ++k) {
            const uint32_t key = key_of(value[k]);
            if (value[k] < *min) *min = value[k];
            if (value[k] > *max) *max = value[k];
            if (p->n_chosen == 0) ++bins[key >> 16];
            for (int j = 0; j < p->n_chosen; ++j)
                if (key >> 16 == p->chosen[j]) ++bins[j * N_BINS + (int)(key & 0xffff)];
        }
    }
}

/* Counts with all threads; the first thread's histograms hold the sum afterwards. */
static void count_all(const pass *p, int n_threads, uint32_t *bins, double *min, double *max)
{
    const int64_t n_bins = (int64_t)N_BINS * (p->n_chosen == 0 ? 1 : p->n_chosen);
    double low = (double)INFINITY, high = -(double)INFINITY;
#pragma omp parallel num_threads(n_threads) reduction(min : low) reduction(max : high)
    {
        uint32_t *own = bins + loxo_thread_id() * n_bins;
        memset(own, 0, (size_t)n_bins * sizeof *own);
        count_range(p, loxo_thread_range(p->n_items), own, &low, &high);
#pragma omp barrier
        const loxo_range r = loxo_thread_range(n_bins);
        for (int t = 1; t < loxo_thread_count(); ++t)
            for (int64_t i = r.begin; i < r.end; ++i)
                bins[i] += bins[t * n_bins + i];
    }
    *min = low;
    *max = high;
}

/* The bin that holds rank (from 0), and the rank within it. */
static uint32_t find_bin(const uint32_t *bins, int64_t *rank)
{
    uint32_t b = 0;
    while (b < N_BINS - 1 && *rank >= bins[b])
        *rank -= bins[b++];
    return b;
}

loxo_status loxo_quantiles_find(loxo_context *ctx, int64_t n_items, loxo_sample_fn sample, const void *arg,
                                int n_quantiles, const int *per_cent, loxo_quantiles *quantiles)
{
    int n_threads = loxo_threads_for(ctx, n_items, 30);
    if (n_threads > 64) n_threads = 64; /* histograms would outgrow the mesh */
    pass p = {.n_items = n_items, .sample = sample, .arg = arg};
    int64_t rank[LOXO_MOST_QUANTILES], n = 0;
    uint32_t *bins = loxo_allocate(ctx, (int64_t)n_threads * N_BINS * n_quantiles, sizeof *bins);
    if (bins == NULL) return LOXO_ERR_MEMORY;
    *quantiles = (loxo_quantiles){.n = 0};
    for (int q = 0; q < n_quantiles; ++q)
        quantiles->quantile[q] = (double)NAN;
    count_all(&p, n_threads, bins, &quantiles->min, &quantiles->max);
    for (int i = 0; i < N_BINS; ++i)
        n += bins[i];
    quantiles->n = n;
    if (n == 0) {
        quantiles->min = quantiles->max = (double)NAN;
        goto done;
    }
    for (int q = 0; q < n_quantiles; ++q) {
        rank[q] = (n * per_cent[q] + 99) / 100 - 1; /* nearest rank: ceil(n q / 100), from 0 */
        if (rank[q] < 0) rank[q] = 0;
        p.chosen[q] = find_bin(bins, &rank[q]);
    }
    p.n_chosen = n_quantiles;
    double low, high;
    count_all(&p, n_threads, bins, &low, &high);
    for (int q = 0; q < n_quantiles; ++q) {
        const uint32_t lower = find_bin(bins + (int64_t)q * N_BINS, &rank[q]);
        quantiles->quantile[q] = fmin(fmax(value_of(p.chosen[q] << 16 | lower), quantiles->min), quantiles->max);
    }
done:
    loxo_release(ctx, bins);
    return LOXO_OK;
}
