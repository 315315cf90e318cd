/* SPDX-License-Identifier: MIT
 * The context: allocator, memory limit and meter, threads, monitor, warnings, last failure. Every call that can fail
 * takes one. A context belongs to one thread at a time; two contexts share no state. The library has no global state. */
#ifndef LOXO_CONTEXT_H
#define LOXO_CONTEXT_H

#include <loxo/base.h>
#include <loxo/monitor.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct loxo_context loxo_context;

/* The caller's allocator. allocate returns NULL when it has nothing; release takes what allocate gave, with the same
 * number of bytes. Both are called from the thread that uses the context. */
typedef struct loxo_allocator {
    void *(*allocate)(void *user, size_t n_bytes);
    void (*release)(void *user, void *block, size_t n_bytes);
    void *user;
} loxo_allocator;

/* Instruction set of the hot kernels. The bits of every result are the same for all of them. */
typedef enum loxo_isa { LOXO_ISA_AUTO, LOXO_ISA_BASELINE, LOXO_ISA_AVX2, LOXO_ISA_AVX512 } loxo_isa;

typedef struct loxo_context_settings {
    size_t memory_limit_bytes; /* 0: 80 % of what the machine or its control group grants */
    int n_threads;             /* 0: the processors this process may use, fewer if OMP_NUM_THREADS is a lower number */
    loxo_isa isa;              /* LOXO_ISA_AUTO: the widest that the processor has */
    loxo_allocator allocator;  /* {0}: malloc, and pages of the system for large blocks */
    loxo_monitor_fn monitor;   /* may be NULL */
    void *monitor_user;
} loxo_context_settings;

LOXO_API loxo_context_settings loxo_context_settings_default(void);

/* Makes a context. settings may be NULL (the defaults).
 * returns  LOXO_OK; LOXO_ERR_ARGUMENT (n_threads < 0 or > 4096, out NULL, an isa this processor lacks); LOXO_ERR_MEMORY */
LOXO_API loxo_status loxo_context_create(const loxo_context_settings *settings, loxo_context **out);
/* Frees it; NULL is allowed. Everything made with it must have been destroyed before. */
LOXO_API void loxo_context_destroy(loxo_context *ctx);

/* The place and reason of the last failure. status is LOXO_OK and text "" when there was none. */
typedef struct loxo_failure {
    loxo_status status;
    char file[256];  /* "" when no file is concerned; longer names are cut in front */
    int64_t line;    /* from 1; 0 when unknown */
    int64_t byte;    /* offset from 0; -1 when unknown */
    int64_t element; /* vertex or face number; -1 when unknown */
    char text[512];  /* one line, no control characters */
} loxo_failure;

LOXO_API const loxo_failure *loxo_context_failure(const loxo_context *ctx);
LOXO_API void loxo_context_clear(loxo_context *ctx); /* forgets failure and warnings */

/* Warnings: one line per kind, with a count; kept in order of first appearance, at most 64 kinds. */
typedef struct loxo_warning {
    int64_t count;
    char text[256]; /* as "3 degenerate faces dropped (first: face 17)" */
} loxo_warning;

LOXO_API int loxo_context_n_warnings(const loxo_context *ctx);
LOXO_API const loxo_warning *loxo_context_warning(const loxo_context *ctx, int i); /* NULL outside 0..n-1 */

typedef struct loxo_memory {
    size_t current_bytes; /* allocated through this context now */
    size_t peak_bytes;    /* most so far, since the context was made or the peak was reset */
    size_t limit_bytes;
} loxo_memory;

LOXO_API loxo_memory loxo_context_memory(const loxo_context *ctx);
LOXO_API void loxo_context_reset_peak(loxo_context *ctx);
LOXO_API int loxo_context_n_threads(const loxo_context *ctx);
LOXO_API loxo_isa loxo_context_isa(const loxo_context *ctx);
LOXO_API void loxo_context_set_monitor(loxo_context *ctx, loxo_monitor_fn monitor, void *user);

/* count * size bytes, 64-byte aligned, not cleared; NULL (and the failure set) when it does not fit the limit or the
 * product overflows. Zero bytes give a valid pointer. Freed by loxo_release, which takes NULL. */
LOXO_API void *loxo_allocate(loxo_context *ctx, int64_t count, size_t size);
LOXO_API void loxo_release(loxo_context *ctx, void *block);

/* What hwloc, or the operating system where hwloc is off, says of the machine. */
typedef struct loxo_machine {
    int n_processors; /* this process may use */
    int n_cores;
    int n_numa_nodes;
    size_t l1_bytes, l2_bytes, l3_bytes; /* of one core's path; 0 when unknown */
    size_t memory_bytes;                 /* of the machine */
    size_t memory_limit_bytes;           /* what the control group grants; memory_bytes when unlimited */
    bool from_hwloc;
} loxo_machine;

LOXO_API loxo_status loxo_machine_get(loxo_context *ctx, loxo_machine *machine);

#ifdef __cplusplus
}
#endif
#endif
