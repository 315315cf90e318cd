/* SPDX-License-Identifier: MIT
 * Blocks of windows, in chunks. */
#include "base/allocate.h"
#include "solver/geodesic/exact/exact_internal.h"

#define CHUNK_BLOCKS ((int64_t)1 << EXACT_CHUNK_BITS)

static void link_chunk(exact_pool *pool, int64_t chunk)
{
    for (int64_t i = CHUNK_BLOCKS - 1; i >= 0; --i) {
        pool->chunk[chunk][i].next = pool->first_free;
        pool->first_free = (uint32_t)(chunk * CHUNK_BLOCKS + i);
    }
}

loxo_status exact_pool_grow(loxo_context *ctx, exact_pool *pool)
{
    if (pool->first_free != EXACT_NONE) return LOXO_OK;
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

void exact_pool_clear(exact_pool *pool)
{
    pool->first_free = EXACT_NONE;
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
