/* SPDX-License-Identifier: MIT
 * Nodes for windows, in chunks, and the queue. */
#include "base/allocate.h"
#include "solver/geodesic/exact/exact_internal.h"

#define CHUNK_NODES ((int64_t)1 << EXACT_CHUNK_BITS)

static void link_chunk(exact_pool *pool, int64_t chunk)
{
    for (int64_t i = CHUNK_NODES - 1; i >= 0; --i) {
        pool->chunk[chunk][i].next = pool->first_free;
        pool->first_free = (uint32_t)(chunk * CHUNK_NODES + i);
    }
}

loxo_status exact_pool_grow(loxo_context *ctx, exact_pool *pool)
{
    if (pool->first_free != EXACT_NONE) return LOXO_OK;
    /* The last chunk would hold the number that means «none». */
    if (pool->n_chunks + 1 >= ((int64_t)UINT32_MAX + 1) / CHUNK_NODES)
        return loxo_fail(ctx, LOXO_ERR_MEMORY, "geodesic: more than %lld windows at once",
                         (long long)(pool->n_chunks * CHUNK_NODES));
    if (pool->n_chunks == pool->capacity) {
        const int64_t capacity = pool->capacity == 0 ? 16 : 2 * pool->capacity;
        exact_node **chunk = loxo_reallocate(ctx, pool->chunk, capacity, sizeof *chunk);
        if (chunk == NULL) return LOXO_ERR_MEMORY;
        pool->chunk = chunk;
        pool->capacity = capacity;
    }
    pool->chunk[pool->n_chunks] = loxo_allocate(ctx, CHUNK_NODES, sizeof(exact_node));
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
    return (size_t)pool->n_chunks * CHUNK_NODES * sizeof(exact_node) + (size_t)pool->capacity * sizeof *pool->chunk;
}

void exact_pool_destroy(loxo_context *ctx, exact_pool *pool)
{
    for (int64_t c = 0; c < pool->n_chunks; ++c)
        loxo_release(ctx, pool->chunk[c]);
    loxo_release(ctx, pool->chunk);
}

static inline bool before(exact_entry a, exact_entry b) { return a.key < b.key || (a.key == b.key && a.item < b.item); }

loxo_status exact_queue_push(loxo_context *ctx, exact_queue *queue, exact_entry entry)
{
    int64_t i = queue->n;
    if (i == queue->capacity) {
        const int64_t capacity = queue->capacity == 0 ? 1024 : 2 * queue->capacity;
        exact_entry *heap = loxo_reallocate(ctx, queue->heap, capacity, sizeof *heap);
        if (heap == NULL) return LOXO_ERR_MEMORY;
        queue->heap = heap;
        queue->capacity = capacity;
    }
    queue->n += 1;
    while (i > 0) {
        const int64_t up = (i - 1) / 4;
        if (!before(entry, queue->heap[up])) break;
        queue->heap[i] = queue->heap[up];
        i = up;
    }
    queue->heap[i] = entry;
    return LOXO_OK;
}

exact_entry exact_queue_pop(exact_queue *queue)
{
    const exact_entry first = queue->heap[0], last = queue->heap[queue->n - 1];
    const int64_t n = queue->n - 1;
    exact_entry *heap = queue->heap;
    int64_t i = 0;
    queue->n = n;
    for (int64_t down = 1; down < n; down = 4 * i + 1) {
        const int64_t end = down + 4 < n ? down + 4 : n;
        int64_t least = down;
        for (int64_t k = down + 1; k < end; ++k)
            if (before(heap[k], heap[least])) least = k;
        if (!before(heap[least], last)) break;
        heap[i] = heap[least];
        i = least;
    }
    if (n > 0) heap[i] = last;
    return first;
}

void exact_queue_destroy(loxo_context *ctx, exact_queue *queue) { loxo_release(ctx, queue->heap); }
