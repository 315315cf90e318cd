/* SPDX-License-Identifier: MIT
 * One workspace block per solver: first planned, then allocated once, then handed out in the same order. Pieces are
 * 64-byte aligned. mark and release give a phase's pieces back to the next phase. */
#ifndef LOXO_BASE_ARENA_H
#define LOXO_BASE_ARENA_H

#include <loxo/context.h>

typedef struct loxo_arena {
    unsigned char *block; /* NULL while planning: pieces are then NULL and only sizes add up */
    size_t used, size;    /* size: the largest that used has been, while planning */
    bool overflow;        /* a size was too big, or a piece did not fit */
} loxo_arena;

/* Next piece: NULL while planning. */
void *loxo_arena_take(loxo_arena *arena, int64_t count, size_t size);
static inline size_t loxo_arena_mark(const loxo_arena *arena) { return arena->used; }
static inline void loxo_arena_release(loxo_arena *arena, size_t mark) { arena->used = mark; }
/* After planning: allocates the block and rewinds. */
loxo_status loxo_arena_reserve(loxo_context *ctx, loxo_arena *arena, const char *what);
void loxo_arena_destroy(loxo_context *ctx, loxo_arena *arena);

#endif
