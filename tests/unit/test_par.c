/* SPDX-License-Identifier: MIT
 * Ranges, sums, prefix sums and the sort: right, and the same bits for every number of threads. */
#include "base/allocate.h"
#include "base/rng.h"
#include "par/range.h"
#include "test.h"

TEST(ranges_cover_everything_once)
{
    for (int64_t n = 0; n < 40; ++n) {
        for (int64_t n_ranges = 1; n_ranges < 9; ++n_ranges) {
            int64_t next = 0;
            for (int64_t i = 0; i < n_ranges; ++i) {
                const loxo_range r = loxo_range_of(n, i, n_ranges);
                CHECK_EQUAL(r.begin, next);
                CHECK(r.end - r.begin == n / n_ranges || r.end - r.begin == n / n_ranges + 1);
                next = r.end;
            }
            CHECK_EQUAL(next, n);
        }
    }
}

static void add_values(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const double *value = arg;
    for (int64_t i = begin; i < end; ++i) {
        sums[0] += value[i];
        sums[1] += value[i] * value[i];
    }
}

TEST(sums_have_the_same_bits_for_every_thread_count)
{
    enum { N = 1000003 };
    double *value = loxo_allocate(test_context, N, sizeof *value);
    double first[2] = {0}, sums[2];
    const int ladder[] = {1, 2, 3, 7};
    for (int64_t i = 0; i < N; ++i)
        value[i] = loxo_random_unit(5, (uint64_t)i) * 1e3 - 499.0;
    for (int k = 0; k < 4; ++k) {
        loxo_context *ctx = test_context_with_threads(ladder[k]);
        CHECK_STATUS(ctx, loxo_sum(ctx, N, 2, add_values, value, sums), LOXO_OK);
        if (k == 0) memcpy(first, sums, sizeof first);
        CHECK_EQUAL(test_hash(sums, sizeof sums), test_hash(first, sizeof first));
        loxo_context_destroy(ctx);
    }
    CHECK_NEAR(first[0] / N, 1.0, 1.0); /* mean of 1e6 uniform numbers of width 1000: deviation 0.3 */
    CHECK_OK(loxo_sum(test_context, 0, 2, add_values, value, sums));
    CHECK_EQUAL(sums[0], 0.0);
    loxo_release(test_context, value);
}

TEST(prefix_sums_are_the_same_for_every_thread_count)
{
    enum { N = 300001 };
    int32_t *count = loxo_allocate(test_context, N, sizeof *count);
    int64_t *offset = loxo_allocate(test_context, N + 1, sizeof *offset);
    const int ladder[] = {1, 2, 3, 7};
    for (int64_t i = 0; i < N; ++i)
        count[i] = (int32_t)(loxo_random_u64(9, (uint64_t)i) % 1000);
    for (int k = 0; k < 4; ++k) {
        loxo_context *ctx = test_context_with_threads(ladder[k]);
        const int64_t total = loxo_scan_i32(ctx, N, count, offset);
        int64_t sum = 0;
        for (int64_t i = 0; i < N; ++i) {
            CHECK(offset[i] == sum);
            sum += count[i];
        }
        CHECK_EQUAL(total, sum);
        CHECK_EQUAL(offset[N], sum);
        loxo_context_destroy(ctx);
    }
    offset[0] = 5;
    CHECK_EQUAL(loxo_scan_in_place(test_context, 0, offset), 0);
    CHECK_EQUAL(offset[0], 0);
    loxo_release(test_context, offset);
    loxo_release(test_context, count);
}

typedef struct sort_case {
    int64_t n;
    int key_bits;
    uint64_t *key;
    uint32_t *payload;
} sort_case;

static void fill(sort_case *c)
{
    for (int64_t i = 0; i < c->n; ++i) {
        c->key[i] = loxo_random_u64(3, (uint64_t)i) >> (64 - c->key_bits);
        if (i % 3 == 0) c->key[i] &= 7; /* repeats, to see stability */
        c->payload[i] = (uint32_t)i;
    }
}

static loxo_status sort_it(loxo_context *ctx, void *arg)
{
    sort_case *c = arg;
    fill(c);
    return loxo_sort_u64(ctx, c->n, c->key, c->payload, c->key_bits);
}

TEST(sort_is_stable_and_right)
{
    enum { N = 200003 };
    const int ladder[] = {1, 2, 3, 7}, bits[] = {3, 11, 12, 33, 64};
    sort_case c = {.n = N};
    c.key = loxo_allocate(test_context, N, sizeof *c.key);
    c.payload = loxo_allocate(test_context, N, sizeof *c.payload);
    for (int b = 0; b < 5; ++b) {
        for (int k = 0; k < 4; ++k) {
            loxo_context *ctx = test_context_with_threads(ladder[k]);
            c.key_bits = bits[b];
            CHECK_STATUS(ctx, sort_it(ctx, &c), LOXO_OK);
            for (int64_t i = 1; i < N; ++i) {
                CHECK(c.key[i - 1] <= c.key[i]);
                if (c.key[i - 1] == c.key[i]) CHECK(c.payload[i - 1] < c.payload[i]);
            }
            loxo_context_destroy(ctx);
        }
    }
    c.n = 1000;
    CHECK(test_each_allocation_fails(sort_it, &c) >= 3);
    c.n = 0;
    CHECK_OK(sort_it(test_context, &c));
    loxo_release(test_context, c.payload);
    loxo_release(test_context, c.key);
}
