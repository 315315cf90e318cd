/* SPDX-License-Identifier: MIT
 * Metered allocation. loxo_allocate and loxo_release are public (context.h); these are the rest. */
#ifndef LOXO_BASE_ALLOCATE_H
#define LOXO_BASE_ALLOCATE_H

#include <loxo/context.h>

/* As loxo_allocate, cleared. */
void *loxo_allocate_zero(loxo_context *ctx, int64_t count, size_t size);
/* Grows or shrinks a block of loxo_allocate, keeping the common part; block NULL allocates. On failure NULL is returned
 * and the old block still stands. With the default allocator large blocks move by page tables, not by copying. */
void *loxo_reallocate(loxo_context *ctx, void *block, int64_t count, size_t size);
/* LOXO_OK when n_bytes more would fit the limit now, else LOXO_ERR_MEMORY with a message that names what and the bytes. */
loxo_status loxo_memory_check(loxo_context *ctx, size_t n_bytes, const char *what);

/* *product = a * b * ...; false when it does not fit. */
static inline bool loxo_mul(size_t *product, size_t a, size_t b) { return !__builtin_mul_overflow(a, b, product); }
static inline bool loxo_add(size_t *sum, size_t a, size_t b) { return !__builtin_add_overflow(a, b, sum); }

#endif
