/* SPDX-License-Identifier: MIT */
#include "base/context.h"

#include "base/allocate.h"
#include "base/os.h"

#include <limits.h>
#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Below this much work a parallel region costs more than it saves. */
#define MIN_WORK_PER_THREAD_NS 20000.0
#define MAX_THREADS            4096
#define PROGRESS_INTERVAL_S    0.02

#undef loxo_fail /* macros of these names help analyzers elsewhere */
#undef loxo_fail_at

static bool isa_is_here(loxo_isa isa)
{
    switch (isa) {
    case LOXO_ISA_AUTO:
    case LOXO_ISA_BASELINE: return true;
#if defined(__x86_64__)
    case LOXO_ISA_AVX2: return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    case LOXO_ISA_AVX512:
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
               __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw");
#else
    case LOXO_ISA_AVX2:
    case LOXO_ISA_AVX512: return false;
#endif
    }
    return false;
}

static loxo_isa widest_isa(void)
{
    if (isa_is_here(LOXO_ISA_AVX512)) return LOXO_ISA_AVX512;
    if (isa_is_here(LOXO_ISA_AVX2)) return LOXO_ISA_AVX2;
    return LOXO_ISA_BASELINE;
}

/* OMP_NUM_THREADS when it is a plain positive number (or a list that starts with one), else the processors that this
 * process may use. Read here and not from the OpenMP runtime, which takes the machine's count for garbage. */
static int default_n_threads(void)
{
    const int n_processors = loxo_os_n_processors();
    const char *text = getenv("OMP_NUM_THREADS");
    if (text != NULL) {
        char *end = NULL;
        const long n = strtol(text, &end, 10);
        if (end != text && (*end == '\0' || *end == ',') && n >= 1)
            return n < n_processors ? (int)n : n_processors; /* more threads than processors only slow down */
    }
    return n_processors;
}

loxo_context_settings loxo_context_settings_default(void) { return (loxo_context_settings){.isa = LOXO_ISA_AUTO}; }

loxo_status loxo_context_create(const loxo_context_settings *settings, loxo_context **out)
{
    const loxo_context_settings s = settings != NULL ? *settings : loxo_context_settings_default();
    loxo_context *ctx = NULL;
    if (out == NULL) return LOXO_ERR_ARGUMENT;
    *out = NULL;
    if (s.n_threads < 0 || s.n_threads > MAX_THREADS || (int)s.isa < 0 || s.isa > LOXO_ISA_AVX512)
        return LOXO_ERR_ARGUMENT;
    if (!isa_is_here(s.isa) || (s.allocator.allocate == NULL) != (s.allocator.release == NULL))
        return LOXO_ERR_ARGUMENT;

    ctx = s.allocator.allocate != NULL ? s.allocator.allocate(s.allocator.user, sizeof *ctx) : malloc(sizeof *ctx);
    if (ctx == NULL) return LOXO_ERR_MEMORY;
    memset(ctx, 0, sizeof *ctx);
    ctx->settings = s;
    ctx->n_threads = s.n_threads > 0 ? s.n_threads : default_n_threads();
    ctx->isa = s.isa == LOXO_ISA_AUTO ? widest_isa() : s.isa;
    ctx->limit_bytes = s.memory_limit_bytes;
    if (ctx->limit_bytes == 0) {
        const size_t granted = loxo_os_memory_limit();
        ctx->limit_bytes = granted > 0 ? granted / 5 * 4 : SIZE_MAX / 2;
    }
    ctx->call_start_s = -1.0;
    loxo_context_clear(ctx);
    *out = ctx;
    return LOXO_OK;
}

void loxo_context_destroy(loxo_context *ctx)
{
    if (ctx == NULL) return;
    const loxo_allocator a = ctx->settings.allocator;
    loxo_os_gather_abandon(ctx);
    if (a.release != NULL)
        a.release(a.user, ctx, sizeof *ctx);
    else
        free(ctx);
}

const loxo_failure *loxo_context_failure(const loxo_context *ctx) { return &ctx->failure; }

void loxo_context_clear(loxo_context *ctx)
{
    ctx->failure = (loxo_failure){.status = LOXO_OK, .byte = -1, .element = -1};
    ctx->n_warnings = 0;
}

int loxo_context_n_warnings(const loxo_context *ctx) { return ctx->n_warnings; }

const loxo_warning *loxo_context_warning(const loxo_context *ctx, int i)
{
    return i >= 0 && i < ctx->n_warnings ? &ctx->warnings[i] : NULL;
}

loxo_memory loxo_context_memory(const loxo_context *ctx)
{
    return (loxo_memory){.current_bytes = __atomic_load_n(&ctx->current_bytes, __ATOMIC_RELAXED),
                         .peak_bytes = __atomic_load_n(&ctx->peak_bytes, __ATOMIC_RELAXED),
                         .limit_bytes = ctx->limit_bytes};
}

void loxo_context_reset_peak(loxo_context *ctx)
{
    __atomic_store_n(&ctx->peak_bytes, __atomic_load_n(&ctx->current_bytes, __ATOMIC_RELAXED), __ATOMIC_RELAXED);
}

int loxo_context_n_threads(const loxo_context *ctx) { return ctx->n_threads; }

loxo_isa loxo_context_isa(const loxo_context *ctx) { return ctx->isa; }

void loxo_context_set_monitor(loxo_context *ctx, loxo_monitor_fn monitor, void *user)
{
    ctx->settings.monitor = monitor;
    ctx->settings.monitor_user = user;
}

/* Control bytes would let a file name or a file's content drive the reader's terminal. */
static void escape_controls(char *text, size_t n)
{
    char raw[sizeof((loxo_failure *)0)->text];
    size_t used = 0;
    snprintf(raw, sizeof raw, "%s", text);
    for (const char *p = raw; *p != '\0'; ++p) {
        const unsigned char c = (unsigned char)*p;
        const bool is_control = c < 0x20 || c == 0x7f;
        if (used + (is_control ? 4 : 1) >= n) break;
        if (is_control) {
            static const char digits[] = "0123456789abcdef";
            text[used++] = '\\';
            text[used++] = 'x';
            text[used++] = digits[c >> 4];
            text[used++] = digits[c & 15];
        } else {
            text[used++] = *p;
        }
    }
    text[used] = '\0';
}

static void set_file(loxo_failure *failure, const char *file)
{
    const size_t n = strlen(file), room = sizeof failure->file - 1;
    snprintf(failure->file, sizeof failure->file, "%s%s", n > room ? "..." : "",
             n > room ? file + (n - room + 3) : file);
    escape_controls(failure->file, sizeof failure->file);
}

static __attribute__((format(printf, 4, 0))) loxo_status fail_with(loxo_context *ctx, loxo_status status,
                                                                   loxo_place place, const char *format, va_list args)
{
    if (ctx == NULL) return status;
    ctx->failure = (loxo_failure){.status = status, .line = place.line, .byte = place.byte, .element = place.element};
    if (place.file != NULL) set_file(&ctx->failure, place.file);
    vsnprintf(ctx->failure.text, sizeof ctx->failure.text, format, args);
    escape_controls(ctx->failure.text, sizeof ctx->failure.text);
    return status;
}

loxo_status loxo_fail(loxo_context *ctx, loxo_status status, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    fail_with(ctx, status, LOXO_NOWHERE, format, args);
    va_end(args);
    return status;
}

loxo_status loxo_fail_at(loxo_context *ctx, loxo_status status, loxo_place place, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    fail_with(ctx, status, place, format, args);
    va_end(args);
    return status;
}

void loxo_failure_set_file(loxo_context *ctx, const char *file)
{
    if (ctx != NULL && file != NULL && ctx->failure.file[0] == '\0') set_file(&ctx->failure, file);
}

void loxo_warn(loxo_context *ctx, const char *kind, int64_t count, const char *format, ...)
{
    int i = 0;
    while (i < ctx->n_warnings && strcmp(ctx->warning_kinds[i], kind) != 0)
        ++i;
    if (i == LOXO_MAX_WARNINGS) return;
    if (i == ctx->n_warnings) {
        snprintf(ctx->warning_kinds[i], sizeof ctx->warning_kinds[i], "%s", kind);
        ++ctx->n_warnings;
    }
    va_list args;
    va_start(args, format);
    ctx->warnings[i].count = count;
    vsnprintf(ctx->warnings[i].text, sizeof ctx->warnings[i].text, format, args);
    va_end(args);
    escape_controls(ctx->warnings[i].text, sizeof ctx->warnings[i].text);
}

int loxo_threads(const loxo_context *ctx, double work_ns)
{
    const double most = work_ns / MIN_WORK_PER_THREAD_NS;
    if (omp_in_parallel() || most < 2.0) return 1;
    return most < (double)ctx->n_threads ? (int)most : ctx->n_threads;
}

void loxo_progress_begin(loxo_context *ctx)
{
    if (ctx->settings.monitor == NULL || ctx->n_outer_calls > 0) return;
    ctx->call_start_s = loxo_os_clock_s();
    ctx->last_progress_s = ctx->call_start_s;
}

void loxo_progress_enter(loxo_context *ctx)
{
    loxo_progress_begin(ctx);
    ++ctx->n_outer_calls;
}

void loxo_progress_leave(loxo_context *ctx) { --ctx->n_outer_calls; }

bool loxo_progress_tell(loxo_context *ctx, const loxo_progress *progress, bool always)
{
    if (ctx->settings.monitor == NULL) return false;
    const double now = loxo_os_clock_s();
    if (ctx->call_start_s < 0.0) ctx->call_start_s = now;
    if (!always && now - ctx->last_progress_s < PROGRESS_INTERVAL_S) return false;
    ctx->last_progress_s = now;
    loxo_progress p = *progress;
    p.elapsed_s = now - ctx->call_start_s;
    return ctx->settings.monitor(ctx->settings.monitor_user, &p) != 0;
}

bool loxo_stop_wanted(loxo_context *ctx, const char *phase, double fraction)
{
    if (ctx->settings.monitor == NULL) return false;
    return loxo_progress_tell(
        ctx, &(loxo_progress){.phase = phase, .fraction = fraction, .objective = NAN, .residual = NAN}, false);
}
