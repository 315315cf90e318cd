/* SPDX-License-Identifier: MIT
 * Preloaded into the command: the allocation of number FAIL_AT finds no memory, and with FAIL_KEEP all after it. With
 * FAIL_LOG the number of allocations is told at the end. For glibc. */
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#define EXPORT __attribute__((visibility("default")))

void *__libc_malloc(size_t n_bytes);
void *__libc_calloc(size_t n, size_t size);
void *__libc_realloc(void *block, size_t n_bytes);

static long count, fail_at = -1;
static int keep;

static int is_to_fail(void)
{
    if (fail_at < 0) {
        const char *text = getenv("FAIL_AT");
        fail_at = text != NULL ? strtol(text, NULL, 10) : 0;
        keep = getenv("FAIL_KEEP") != NULL;
    }
    ++count;
    return fail_at > 0 && (keep ? count >= fail_at : count == fail_at);
}

EXPORT void *malloc(size_t n_bytes) { return is_to_fail() ? NULL : __libc_malloc(n_bytes); }

EXPORT void *calloc(size_t n, size_t size) { return is_to_fail() ? NULL : __libc_calloc(n, size); }

EXPORT void *realloc(void *block, size_t n_bytes) { return is_to_fail() ? NULL : __libc_realloc(block, n_bytes); }

__attribute__((destructor)) static void tell(void)
{
    if (getenv("FAIL_LOG") != NULL) (void)fprintf(stderr, "%ld allocations\n", count);
}
