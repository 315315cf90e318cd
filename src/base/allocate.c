/* SPDX-License-Identifier: MIT
 * Each block carries its size in front, so that release can meter it and a caller's allocator gets its bytes back.
 * Layout: [raw ... pad][header][payload, 64-byte aligned].
 *
 * Large blocks are pages of the system's own. From malloc they would come off the heap once its threshold has grown
 * (glibc: up to 32 MiB), and what was released between others that stay would count as resident for good: some 20 bytes
 * a vertex at a million. */
#include "base/allocate.h"

#include "base/arena.h"
#include "base/context.h"
#include "base/os.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

/* A sanitizer sees overruns of what malloc gave, and of nothing else. */
#if defined(__SANITIZE_ADDRESS__)
#define MAPS_LARGE_BLOCKS 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define MAPS_LARGE_BLOCKS 0
#endif
#endif
#ifndef MAPS_LARGE_BLOCKS
#define MAPS_LARGE_BLOCKS 1
#endif

#define ALIGN    ((size_t)64)
#define OVERHEAD (2 * ALIGN) /* header and room to align, whatever the raw pointer's alignment */
#define LARGE_BLOCK                                                                                                    \
    ((size_t)4 << 20) /* raw bytes; two large pages: below, mapping and faults cost more than they save */

typedef struct block_header {
    void *raw;
    size_t n_bytes; /* of the payload; the raw block is OVERHEAD larger */
    bool is_mapped;
} block_header;

static block_header *header_of(void *payload) { return (block_header *)(void *)((unsigned char *)payload - ALIGN); }

static void *place_header(void *raw, size_t n_bytes, bool is_mapped)
{
    const uintptr_t start = (uintptr_t)raw;
    unsigned char *payload = (unsigned char *)raw + ((start + ALIGN + ALIGN - 1) / ALIGN * ALIGN - start);
    *header_of(payload) = (block_header){raw, n_bytes, is_mapped};
    return payload;
}

/* A block of the default allocator with its header: the payload, or NULL. */
static void *take_block(size_t n_bytes)
{
    const size_t raw_bytes = n_bytes + OVERHEAD;
    void *raw = NULL;
    if (MAPS_LARGE_BLOCKS && raw_bytes >= LARGE_BLOCK) raw = loxo_os_map(raw_bytes);
    if (raw != NULL) return place_header(raw, n_bytes, true);
    raw = malloc(raw_bytes);
    return raw != NULL ? place_header(raw, n_bytes, false) : NULL;
}

static void give_block(block_header h)
{
    if (h.is_mapped)
        loxo_os_unmap(h.raw, h.n_bytes + OVERHEAD);
    else
        free(h.raw);
}

/* Adds to the meter; false when the limit forbids it. */
static bool meter_add(loxo_context *ctx, size_t n_bytes)
{
    const size_t now = __atomic_add_fetch(&ctx->current_bytes, n_bytes, __ATOMIC_RELAXED);
    if (now > ctx->limit_bytes || now < n_bytes) {
        __atomic_sub_fetch(&ctx->current_bytes, n_bytes, __ATOMIC_RELAXED);
        return false;
    }
    size_t peak = __atomic_load_n(&ctx->peak_bytes, __ATOMIC_RELAXED);
    while (now > peak &&
           !__atomic_compare_exchange_n(&ctx->peak_bytes, &peak, now, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
    }
    return true;
}

static void meter_sub(loxo_context *ctx, size_t n_bytes)
{
    __atomic_sub_fetch(&ctx->current_bytes, n_bytes, __ATOMIC_RELAXED);
}

static loxo_status refuse(loxo_context *ctx, size_t n_bytes, const char *what)
{
    const size_t used = loxo_context_memory(ctx).current_bytes;
    return loxo_fail(ctx, LOXO_ERR_MEMORY,
                     "%s needs %zu bytes more; %zu are in use and the limit is %zu (--max-memory)", what, n_bytes, used,
                     ctx->limit_bytes);
}

void *loxo_allocate(loxo_context *ctx, int64_t count, size_t size)
{
    size_t n_bytes, raw_bytes;
    if (count < 0 || !loxo_mul(&n_bytes, (size_t)count, size) || !loxo_add(&raw_bytes, n_bytes, OVERHEAD)) {
        loxo_fail(ctx, LOXO_ERR_MEMORY, "an array of %" PRId64 " times %zu bytes is beyond any memory", count, size);
        return NULL;
    }
    if (!meter_add(ctx, raw_bytes)) {
        refuse(ctx, raw_bytes, "an array");
        return NULL;
    }
    const loxo_allocator a = ctx->settings.allocator;
    void *payload = NULL;
    if (a.allocate != NULL) {
        void *raw = a.allocate(a.user, raw_bytes);
        if (raw != NULL) payload = place_header(raw, n_bytes, false);
    } else {
        payload = take_block(n_bytes);
    }
    if (payload == NULL) {
        meter_sub(ctx, raw_bytes);
        loxo_fail(ctx, LOXO_ERR_MEMORY, "the allocator has no %zu bytes", raw_bytes);
    }
    return payload;
}

void *loxo_allocate_zero(loxo_context *ctx, int64_t count, size_t size)
{
    void *block = loxo_allocate(ctx, count, size);
    if (block != NULL) memset(block, 0, (size_t)count * size);
    return block;
}

void loxo_release(loxo_context *ctx, void *block)
{
    if (block == NULL) return;
    const block_header h = *header_of(block);
    const loxo_allocator a = ctx->settings.allocator;
    meter_sub(ctx, h.n_bytes + OVERHEAD);
    if (a.release != NULL)
        a.release(a.user, h.raw, h.n_bytes + OVERHEAD);
    else
        give_block(h);
}

/* realloc; the payload's offset in the raw block may change. */
static void *reallocate_small(block_header h, void *old_payload, size_t n_bytes)
{
    const size_t old_offset = (size_t)((unsigned char *)old_payload - (unsigned char *)h.raw);
    void *raw = realloc(h.raw, n_bytes + OVERHEAD);
    if (raw == NULL) return NULL;
    const uintptr_t start = (uintptr_t)raw;
    const size_t offset = (start + ALIGN + ALIGN - 1) / ALIGN * ALIGN - start;
    const size_t kept = h.n_bytes < n_bytes ? h.n_bytes : n_bytes;
    if (offset != old_offset) memmove((unsigned char *)raw + offset, (unsigned char *)raw + old_offset, kept);
    return place_header(raw, n_bytes, false);
}

/* Large blocks move by page tables; one that becomes large or small is copied. */
static void *reallocate_block(block_header h, void *old_payload, size_t n_bytes)
{
    const bool was_large = h.n_bytes + OVERHEAD >= LARGE_BLOCK, is_large = n_bytes + OVERHEAD >= LARGE_BLOCK;
    if (h.is_mapped && is_large) {
        void *raw = loxo_os_remap(h.raw, h.n_bytes + OVERHEAD, n_bytes + OVERHEAD);
        if (raw != NULL) return place_header(raw, n_bytes, true);
    } else if (!h.is_mapped && (!MAPS_LARGE_BLOCKS || was_large || !is_large)) {
        return reallocate_small(h, old_payload, n_bytes);
    }
    void *moved = take_block(n_bytes);
    if (moved == NULL) return NULL;
    memcpy(moved, old_payload, h.n_bytes < n_bytes ? h.n_bytes : n_bytes);
    give_block(h);
    return moved;
}

void *loxo_reallocate(loxo_context *ctx, void *block, int64_t count, size_t size)
{
    size_t n_bytes, raw_bytes;
    if (block == NULL) return loxo_allocate(ctx, count, size);
    if (count < 0 || !loxo_mul(&n_bytes, (size_t)count, size) || !loxo_add(&raw_bytes, n_bytes, OVERHEAD)) {
        loxo_fail(ctx, LOXO_ERR_MEMORY, "an array of %" PRId64 " times %zu bytes is beyond any memory", count, size);
        return NULL;
    }
    const block_header h = *header_of(block);
    if (ctx->settings.allocator.allocate != NULL) {
        void *moved = loxo_allocate(ctx, count, size);
        if (moved == NULL) return NULL;
        memcpy(moved, block, h.n_bytes < n_bytes ? h.n_bytes : n_bytes);
        loxo_release(ctx, block);
        return moved;
    }
    const bool grows = n_bytes > h.n_bytes;
    if (grows && !meter_add(ctx, n_bytes - h.n_bytes)) {
        refuse(ctx, n_bytes - h.n_bytes, "a growing array");
        return NULL;
    }
    void *moved = reallocate_block(h, block, n_bytes);
    if (moved == NULL) {
        if (grows) meter_sub(ctx, n_bytes - h.n_bytes);
        loxo_fail(ctx, LOXO_ERR_MEMORY, "the allocator has no %zu bytes", raw_bytes);
        return NULL;
    }
    if (!grows) meter_sub(ctx, h.n_bytes - n_bytes);
    return moved;
}

loxo_status loxo_memory_check(loxo_context *ctx, size_t n_bytes, const char *what)
{
    const size_t used = loxo_context_memory(ctx).current_bytes;
    size_t sum;
    if (!loxo_add(&sum, used, n_bytes) || sum > ctx->limit_bytes) return refuse(ctx, n_bytes, what);
    return LOXO_OK;
}

void *loxo_arena_take(loxo_arena *arena, int64_t count, size_t size)
{
    size_t n_bytes, end;
    const size_t begin = arena->used;
    if (count < 0 || !loxo_mul(&n_bytes, (size_t)count, size) || !loxo_add(&end, begin, n_bytes) ||
        !loxo_add(&end, end, ALIGN - 1)) {
        arena->overflow = true;
        return NULL;
    }
    end = end / ALIGN * ALIGN;
    if (arena->block != NULL && end > arena->size) {
        arena->overflow = true;
        return NULL;
    }
    arena->used = end;
    if (arena->block == NULL) {
        if (end > arena->size) arena->size = end;
        return NULL;
    }
    return arena->block + begin;
}

loxo_status loxo_arena_reserve(loxo_context *ctx, loxo_arena *arena, const char *what)
{
    if (arena->overflow || arena->size > PTRDIFF_MAX)
        return loxo_fail(ctx, LOXO_ERR_MEMORY, "%s is beyond any memory", what);
    const loxo_status status = loxo_memory_check(ctx, arena->size + OVERHEAD, what);
    if (status < 0) return status;
    arena->block = loxo_allocate(ctx, (int64_t)arena->size, 1);
    arena->used = 0;
    return arena->block != NULL ? LOXO_OK : LOXO_ERR_MEMORY;
}

void loxo_arena_destroy(loxo_context *ctx, loxo_arena *arena)
{
    loxo_release(ctx, arena->block);
    *arena = (loxo_arena){0};
}
