/* SPDX-License-Identifier: MIT
 * Blocks of windows, in chunks. */
#include "base/allocate.h"
#include "solver/geodesic/exact/exact_internal.h"

#define CHUNK_BLOCKS ((int64_t)1 << EXACT_CHUNK_BITS)

static void link_chunk(exact_pool *pool, int64_t chunk)
{
    for (int64_t batch = CHUNK_BLOCKS - EXACT_BATCH; batch >= 0; batch -= EXACT_BATCH) {
        exact_block *block = &pool->chunk[chunk][batch];
        const uint32_t id = (uint32_t)(chunk * CHUNK_BLOCKS + batch);
        for (int64_t i = 0; i < EXACT_BATCH; ++i)
            block[i].next = i + 1 < EXACT_BATCH ? id + (uint32_t)i + 1 : EXACT_NONE;
        block->round = pool->first_batch;
        pool->first_batch = id;
    }
}

static loxo_status add_chunk(loxo_context *ctx, exact_pool *pool)
{
    /* The last chunk would hold the number that means «none». */
    if (pool->n_chunks + 1 >= ((int64_t)UINT32_MAX + 1) / CHUNK_BLOCKS)
        return loxo_fail(ctx, LOXO_ERR_MEMORY, "geodesic: more than %lld blocks of windows at once",
                         (long long)(pool->n_chunks * CHUNK_BLOCKS));
    if (pool->n_chunks == pool->capacity) {
        const int64_t capacity = pool->capacity == 0 ? 16 : 2 * pool->capacity;
        exact_block **chunk = loxo_reallocate(ctx, pool->chunk, capacity, sizeof(void *));
        if (chunk == NULL) return LOXO_ERR_MEMORY;
        pool->chunk = chunk;
        pool->capacity = capacity;
    }
    pool->chunk[pool->n_chunks] = loxo_allocate(ctx, CHUNK_BLOCKS, sizeof(exact_block));
    if (pool->chunk[pool->n_chunks] == NULL) return LOXO_ERR_MEMORY;
    link_chunk(pool, pool->n_chunks);
    pool->n_chunks += 1;
    return LOXO_OK;
}

loxo_status exact_pool_grow(loxo_context *ctx, exact_pool *pool, int64_t n_blocks)
{
    loxo_status status = LOXO_OK;
    for (int64_t n = 0; n < n_blocks && status >= 0; n += CHUNK_BLOCKS)
        status = add_chunk(ctx, pool);
    return status;
}

void exact_pool_clear(exact_pool *pool)
{
    pool->first_batch = EXACT_NONE;
    pool->n_live = 0;
    for (int64_t c = pool->n_chunks - 1; c >= 0; --c)
        link_chunk(pool, c);
}

size_t exact_pool_bytes(const exact_pool *pool)
{
    return (size_t)pool->n_chunks * CHUNK_BLOCKS * sizeof(exact_block) + (size_t)pool->capacity * sizeof(void *);
}

void exact_pool_destroy(loxo_context *ctx, exact_pool *pool)
{
    for (int64_t c = 0; c < pool->n_chunks; ++c)
        loxo_release(ctx, pool->chunk[c]);
    loxo_release(ctx, pool->chunk);
}
