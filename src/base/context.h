/* SPDX-License-Identifier: MIT
 * Inside of the context: failures, warnings, metered memory, progress. */
#ifndef LOXO_BASE_CONTEXT_H
#define LOXO_BASE_CONTEXT_H

#include <loxo/context.h>

#include <stdarg.h>

#define LOXO_MAX_WARNINGS 64
#define LOXO_MAX_GATHERED 64

/* Where a failure is. Unknown: file NULL, line 0, byte -1, element -1. */
typedef struct loxo_place {
    const char *file;
    int64_t line, byte, element;
} loxo_place;

#define LOXO_NOWHERE ((loxo_place){.byte = -1, .element = -1})

struct loxo_context {
    loxo_context_settings settings;
    int n_threads;                                 /* at least 1 */
    loxo_isa isa;                                  /* never LOXO_ISA_AUTO */
    size_t current_bytes, peak_bytes, limit_bytes; /* touched atomically */
    loxo_failure failure;
    int n_warnings;
    loxo_warning warnings[LOXO_MAX_WARNINGS];
    char warning_kinds[LOXO_MAX_WARNINGS][48];
    loxo_machine machine; /* of loxo_machine_get, which looks once a context */
    bool machine_is_known;
    bool is_gathering; /* outputs are kept until all of them get their names */
    int n_gathered;
    struct loxo_os_output *gathered[LOXO_MAX_GATHERED];
    int n_outer_calls;      /* public functions at work that call other public ones */
    double call_start_s;    /* clock when the outermost library call began */
    double last_progress_s; /* clock of the last call of the monitor */
};

/* Records the failure in ctx (NULL allowed) and returns status, so that `return loxo_fail(...)` reads well. The text is
 * cut to fit; control characters in it are escaped. */
loxo_status loxo_fail(loxo_context *ctx, loxo_status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
loxo_status loxo_fail_at(loxo_context *ctx, loxo_status status, loxo_place place, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
/* An analyzer that cannot see into them shall know what they return. */
#ifdef __clang_analyzer__
#define LOXO_FIRST_OF(first, ...) (first)
#define loxo_fail(ctx, ...)       (loxo_fail((ctx), __VA_ARGS__), LOXO_FIRST_OF(__VA_ARGS__, 0))
#define loxo_fail_at(ctx, ...)    (loxo_fail_at((ctx), __VA_ARGS__), LOXO_FIRST_OF(__VA_ARGS__, 0))
#endif
/* Fills in the file name of the last failure when it has none yet. */
void loxo_failure_set_file(loxo_context *ctx, const char *file);
/* Counts a warning of a kind (a short fixed key); the text of the last call of a kind stands: callers give the total. */
void loxo_warn(loxo_context *ctx, const char *kind, int64_t count, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* Threads for a parallel region now: 1 inside somebody else's parallel region, or when the work is small.
 * work is about the number of nanoseconds on one thread. */
int loxo_threads(const loxo_context *ctx, double work_ns);

/* Threads for n items of about ns_each. */
static inline int loxo_threads_for(const loxo_context *ctx, int64_t n, double ns_each)
{
    return loxo_threads(ctx, (double)n * ns_each);
}

/* Call at the start of a public function that works long. */
void loxo_progress_begin(loxo_context *ctx);
/* Around the work of a public function that calls such ones: the time that the monitor is told runs on through them. */
void loxo_progress_enter(loxo_context *ctx);
void loxo_progress_leave(loxo_context *ctx);
/* Tells the monitor, at most every 20 ms unless `always`; true when the work shall stop. */
bool loxo_progress_tell(loxo_context *ctx, const loxo_progress *progress, bool always);
/* The same with just phase and fraction. */
bool loxo_stop_wanted(loxo_context *ctx, const char *phase, double fraction);

#endif
