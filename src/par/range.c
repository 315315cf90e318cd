/* SPDX-License-Identifier: MIT */
#include "par/range.h"

#include "base/allocate.h"

#include <inttypes.h>
#include <omp.h>
#include <string.h>

loxo_range loxo_thread_range(int64_t n) { return loxo_range_of(n, omp_get_thread_num(), omp_get_num_threads()); }

int loxo_thread_id(void) { return omp_get_thread_num(); }

int loxo_thread_count(void) { return omp_get_num_threads(); }

/* Blocks are taken in groups, so that the partial sums fit a fixed array on the stack and nothing is allocated. */
#define GROUP 64

loxo_status loxo_sum(loxo_context *ctx, int64_t n, int n_sums, loxo_partial_fn partial, const void *arg, double *sums)
{
    const int64_t n_blocks = (n + LOXO_SUM_BLOCK - 1) / LOXO_SUM_BLOCK;
    const int n_threads = loxo_threads_for(ctx, n, 2.0);
    const int64_t group = (int64_t)GROUP * n_threads;
    for (int k = 0; k < n_sums; ++k)
        sums[k] = 0.0;
    if (n_threads == 1) {
        /* A region of its own, so that partial is thread 0 also where the host has regions around us. */
#pragma omp parallel num_threads(1)
        for (int64_t b = 0; b < n_blocks; ++b) {
            double part[LOXO_SUM_MAX] = {0};
            const int64_t begin = b * LOXO_SUM_BLOCK;
            partial(begin, begin + LOXO_SUM_BLOCK < n ? begin + LOXO_SUM_BLOCK : n, arg, part);
            for (int k = 0; k < n_sums; ++k)
                sums[k] += part[k];
        }
        return LOXO_OK;
    }
    double(*parts)[LOXO_SUM_MAX] = loxo_allocate(ctx, group, sizeof *parts);
    if (parts == NULL) return LOXO_ERR_MEMORY;
    for (int64_t first = 0; first < n_blocks; first += group) {
        const int64_t count = n_blocks - first < group ? n_blocks - first : group;
#pragma omp parallel num_threads(n_threads)
        {
            const loxo_range r = loxo_thread_range(count);
            for (int64_t i = r.begin; i < r.end; ++i) {
                const int64_t begin = (first + i) * LOXO_SUM_BLOCK;
                memset(parts[i], 0, sizeof parts[i]);
                partial(begin, begin + LOXO_SUM_BLOCK < n ? begin + LOXO_SUM_BLOCK : n, arg, parts[i]);
            }
        }
        for (int64_t i = 0; i < count; ++i)
            for (int k = 0; k < n_sums; ++k)
                sums[k] += parts[i][k];
    }
    loxo_release(ctx, parts);
    return LOXO_OK;
}

/* Two passes over thread ranges: sums of ranges, then each range from its start. Integers: any split gives the same. */
#define MAX_RANGES 256

int64_t loxo_scan_in_place(loxo_context *ctx, int64_t n, int64_t *offset)
{
    int n_threads = loxo_threads_for(ctx, n, 1.0);
    if (n_threads > MAX_RANGES) n_threads = MAX_RANGES;
    int64_t start[MAX_RANGES + 1] = {0};
#pragma omp parallel num_threads(n_threads)
    {
        const int t = omp_get_thread_num();
        const loxo_range r = loxo_thread_range(n);
        int64_t sum = 0;
        for (int64_t i = r.begin; i < r.end; ++i)
            sum += offset[i];
        start[t + 1] = sum;
#pragma omp barrier
#pragma omp single
        for (int i = 0; i < omp_get_num_threads(); ++i)
            start[i + 1] += start[i];
        sum = start[t];
        for (int64_t i = r.begin; i < r.end; ++i) {
            const int64_t count = offset[i];
            offset[i] = sum;
            sum += count;
        }
        if (t == omp_get_num_threads() - 1) start[MAX_RANGES] = sum;
    }
    offset[n] = start[MAX_RANGES];
    return offset[n];
}

int64_t loxo_scan_i32(loxo_context *ctx, int64_t n, const int32_t *count, int64_t *offset)
{
    const int n_threads = loxo_threads_for(ctx, n, 1.0);
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i)
            offset[i] = count[i];
    }
    return loxo_scan_in_place(ctx, n, offset);
}

/* Least significant digit first. Each thread counts and moves its own range; the places are handed out digit by digit,
 * within a digit thread by thread, so the order is that of the input and the same for any number of threads. */
#define DIGIT_BITS 11
#define N_DIGITS   (1 << DIGIT_BITS)

typedef struct sort_buffers {
    uint64_t *key[2];
    uint32_t *payload[2];
    int64_t *place; /* [n_threads][N_DIGITS] */
} sort_buffers;

static void sort_pass(const sort_buffers *b, int from, int64_t n, int shift, int n_threads)
{
    const uint64_t *key = b->key[from];
    const uint32_t *payload = b->payload[from];
    uint64_t *key_out = b->key[1 - from];
    uint32_t *payload_out = b->payload[1 - from];
#pragma omp parallel num_threads(n_threads)
    {
        const int t = omp_get_thread_num(), n_team = omp_get_num_threads();
        const loxo_range r = loxo_thread_range(n);
        int64_t *place = b->place + (int64_t)t * N_DIGITS;
        memset(place, 0, N_DIGITS * sizeof *place);
        for (int64_t i = r.begin; i < r.end; ++i)
            ++place[(key[i] >> shift) & (N_DIGITS - 1)];
#pragma omp barrier
#pragma omp single
        {
            int64_t sum = 0;
            for (int64_t digit = 0; digit < N_DIGITS; ++digit) {
                for (int64_t other = 0; other < n_team; ++other) {
                    int64_t *p = &b->place[other * N_DIGITS + digit];
                    const int64_t count = *p;
                    *p = sum;
                    sum += count;
                }
            }
        }
        for (int64_t i = r.begin; i < r.end; ++i) {
            const int64_t to = place[(key[i] >> shift) & (N_DIGITS - 1)]++;
            key_out[to] = key[i];
            payload_out[to] = payload[i];
        }
    }
}

loxo_status loxo_sort_u64(loxo_context *ctx, int64_t n, uint64_t *key, uint32_t *payload, int key_bits)
{
    const int n_threads = loxo_threads_for(ctx, n, 10.0);
    loxo_status status = LOXO_ERR_MEMORY;
    sort_buffers b = {.key = {key, NULL}, .payload = {payload, NULL}};
    int from = 0;
    b.key[1] = loxo_allocate(ctx, n, sizeof *key);
    b.payload[1] = loxo_allocate(ctx, n, sizeof *payload);
    b.place = loxo_allocate(ctx, (int64_t)n_threads * N_DIGITS, sizeof *b.place);
    if (b.key[1] == NULL || b.payload[1] == NULL || b.place == NULL) goto done;
    for (int shift = 0; shift < key_bits; shift += DIGIT_BITS) {
        sort_pass(&b, from, n, shift, n_threads);
        from = 1 - from;
    }
    if (from == 1 && n > 0) {
        memcpy(key, b.key[1], (size_t)n * sizeof *key);
        memcpy(payload, b.payload[1], (size_t)n * sizeof *payload);
    }
    status = LOXO_OK;
done:
    loxo_release(ctx, b.place);
    loxo_release(ctx, b.payload[1]);
    loxo_release(ctx, b.key[1]);
    return status;
}
