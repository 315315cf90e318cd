/* SPDX-License-Identifier: MIT
 * The queue of half-edges and vertices: a radix heap. */
#include "base/allocate.h"
#include "solver/geodesic/exact/exact_internal.h"

#include <string.h>

static inline int bin_of(const exact_queue *queue, uint32_t key)
{
    const uint32_t differs = key ^ queue->last;
    return differs == 0 ? 0 : 32 - __builtin_clz(differs);
}

static inline void put(exact_queue *queue, uint32_t i)
{
    const int bin = bin_of(queue, queue->entry[i].key);
    queue->entry[i].next = queue->bin[bin];
    queue->bin[bin] = i;
}

void exact_queue_clear(exact_queue *queue)
{
    for (int b = 0; b < EXACT_BINS; ++b)
        queue->bin[b] = EXACT_NONE;
    queue->n = 0;
    queue->last = 0;
    queue->first_free = EXACT_NONE;
    for (int64_t i = queue->room - 1; i >= 0; --i) {
        queue->entry[i].next = queue->first_free;
        queue->first_free = (uint32_t)i;
    }
}

static loxo_status grow(loxo_context *ctx, exact_queue *queue)
{
    const int64_t room = queue->room == 0 ? 1024 : 2 * queue->room;
    if (room >= UINT32_MAX) return loxo_fail(ctx, LOXO_ERR_MEMORY, "geodesic: the queue of the front is full");
    exact_entry *entry = loxo_reallocate(ctx, queue->entry, room, sizeof *entry);
    if (entry == NULL) return LOXO_ERR_MEMORY;
    queue->entry = entry;
    for (int64_t i = room - 1; i >= queue->room; --i) {
        entry[i].next = queue->first_free;
        queue->first_free = (uint32_t)i;
    }
    queue->room = room;
    return LOXO_OK;
}

loxo_status exact_queue_push(loxo_context *ctx, exact_queue *queue, double key, uint32_t item)
{
    const float rounded = (float)key;
    uint32_t bits, i;
    if (queue->first_free == EXACT_NONE) {
        const loxo_status status = grow(ctx, queue);
        if (status < 0) return status;
    }
    memcpy(&bits, &rounded, sizeof bits);
    i = queue->first_free;
    queue->first_free = queue->entry[i].next;
    queue->entry[i].key = bits > queue->last ? bits : queue->last;
    queue->entry[i].item = item;
    queue->n += 1;
    put(queue, i);
    return LOXO_OK;
}

uint32_t exact_queue_pop(exact_queue *queue)
{
    if (queue->bin[0] == EXACT_NONE) {
        int b = 1;
        while (queue->bin[b] == EXACT_NONE)
            ++b;
        uint32_t i = queue->bin[b], least = UINT32_MAX;
        queue->bin[b] = EXACT_NONE;
        for (uint32_t k = i; k != EXACT_NONE; k = queue->entry[k].next)
            if (queue->entry[k].key < least) least = queue->entry[k].key;
        queue->last = least;
        while (i != EXACT_NONE) {
            const uint32_t next = queue->entry[i].next;
            put(queue, i);
            i = next;
        }
    }
    const uint32_t first = queue->bin[0];
    queue->bin[0] = queue->entry[first].next;
    queue->entry[first].next = queue->first_free;
    queue->first_free = first;
    queue->n -= 1;
    return queue->entry[first].item;
}

void exact_queue_destroy(loxo_context *ctx, exact_queue *queue) { loxo_release(ctx, queue->entry); }
