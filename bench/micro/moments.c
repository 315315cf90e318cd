/* SPDX-License-Identifier: MIT
 * The pass of the conformal barycenter: bytes against triad, and operations against what the processor can do at most. */
#include "moments.h"

#include "../directions.h"
#include "base/os.h"
#include "kernel/variants.h"

#include <omp.h>
#include <string.h>

#define N_IN_CACHE 1024 /* atoms; 24 KB */

/* Operations an atom that it cannot do without, the division among them. In space: differences 3, |x - w|^2 5, factor 1, v 3, sums of v 3,
 * of squares and products 12, less 2 for the one square that follows from the trace; with weights 4 more. */
static const struct {
    const char *name;
    int d;
    bool has_weights;
    double operations, bytes;
} kernels[] = {
    {"moments, plane", 2, false, 14, 16},
    {"moments, space", 3, false, 25, 24},
    {"the same, weighted", 3, true, 29, 32},
};
#define N_KERNELS ((int)(sizeof kernels / sizeof kernels[0]))

/* The most that additions and multiplications can do where none waits for another: twelve chains x = x c + e, not contracted. */
#define N_CHAINS 12
#define N_LINKS  2000000

#define DEFINE_CHAINS(name, n_bytes, how)                                                                              \
    how static __attribute__((noinline)) double name(double c, double e)                                               \
    {                                                                                                                  \
        typedef double wide __attribute__((vector_size(n_bytes)));                                                     \
        wide x[N_CHAINS];                                                                                              \
        double sum = 0.0;                                                                                              \
        for (int k = 0; k < N_CHAINS; ++k)                                                                             \
            x[k] = (wide){(double)k};                                                                                  \
        for (int i = 0; i < N_LINKS; ++i)                                                                              \
            for (int k = 0; k < N_CHAINS; ++k)                                                                         \
                x[k] = x[k] * c + e;                                                                                   \
        for (int k = 0; k < N_CHAINS; ++k)                                                                             \
            for (size_t l = 0; l < (n_bytes) / sizeof(double); ++l)                                                    \
                sum += x[k][l];                                                                                        \
        return sum;                                                                                                    \
    }

DEFINE_CHAINS(chains_baseline, 16, )
#if defined(__x86_64__)
DEFINE_CHAINS(chains_avx2, 32, __attribute__((target("avx2"))))
DEFINE_CHAINS(chains_avx512, 64, __attribute__((target("avx512f"))))
#endif

static double run_chains(loxo_isa isa, double c, double e)
{
#if defined(__x86_64__)
    if (isa == LOXO_ISA_AVX512) return chains_avx512(c, e);
    if (isa == LOXO_ISA_AVX2) return chains_avx2(c, e);
#endif
    (void)isa;
    return chains_baseline(c, e);
}

static int n_lanes(loxo_isa isa) { return isa == LOXO_ISA_AVX512 ? 8 : isa == LOXO_ISA_AVX2 ? 4 : 2; }

/* Seconds of one thread are its processor time: neighbours on the machine count less. */
static double now_s(int n_threads) { return n_threads == 1 ? loxo_os_thread_cpu_s() : loxo_os_clock_s(); }

/* GFLOP/s of all threads. sink: so that nothing is left out. */
static double find_peak(loxo_isa isa, int n_threads, double *sink)
{
    double sums[BENCH_MAX_THREADS * 64] = {0};
    const double start = now_s(n_threads);
#pragma omp parallel num_threads(n_threads)
    sums[omp_get_thread_num() % (BENCH_MAX_THREADS * 64)] = run_chains(isa, 0.999, *sink);
    const double seconds = now_s(n_threads) - start;
    *sink += 1e-300 * sums[0];
    return 2e-9 * N_CHAINS * N_LINKS * n_lanes(isa) * n_threads / seconds;
}

/* ns an atom, wall: by the clock, as triad's. turns: passes over the same atoms. */
static double run_once(int kernel, const k_variant *k, const double *x, const double *weight, int64_t n, int turns,
                       int n_threads, double *wall, double *sink)
{
    const int d = kernels[kernel].d;
    const double w[3] = {1e-3, 2e-3, 3e-3};
    double total = 0.0;
    const double start = now_s(n_threads), clock = loxo_os_clock_s();
#pragma omp parallel num_threads(n_threads) reduction(+ : total)
    {
        const int64_t i = omp_get_thread_num(), of = omp_get_num_threads();
        const int64_t begin = turns > 1 ? 0 : n * i / of,
                      end = turns > 1 ? n : n * (i + 1) / of; /* in cache: all, each */
        for (int turn = 0; turn < turns; ++turn) {
            double sums[10];
            const double *p = kernels[kernel].has_weights ? weight + begin : NULL;
            if (d == 2)
                k->moments2(x + d * begin, p, end - begin, w, 1.0, sums);
            else
                k->moments3(x + d * begin, p, end - begin, w, 1.0, sums);
            total += sums[1];
        }
    }
    const double seconds = now_s(n_threads) - start;
    const double scale = 1e9 / ((double)n * turns * (turns > 1 ? n_threads : 1));
    *wall = scale * (loxo_os_clock_s() - clock);
    *sink += 1e-300 * total;
    return scale * seconds;
}

/* Kernel, triad and chains in turns: a neighbour on the machine slows all three. */
static void measure(bench *b, bench_table *table, int kernel, loxo_isa isa, const double *x, const double *weight,
                    int64_t n, const bench_triad *triad)
{
    const k_variant *variant = k_variant_get(isa);
    const bool in_cache = n == N_IN_CACHE;
    double ns[BENCH_MAX_REPEATS], share[BENCH_MAX_REPEATS], rate[BENCH_MAX_REPEATS], of_peak[BENCH_MAX_REPEATS],
        sink = 1e-3;
    char text[4][64];
    for (int k = -1; k < b->settings.repeats; ++k) { /* the warm-up is overwritten */
        const int at = k < 0 ? 0 : k;
        const double bandwidth = bench_triad_run(triad), peak = find_peak(isa, triad->n_threads, &sink);
        double wall = 1.0;
        ns[at] = run_once(kernel, variant, x, weight, n, in_cache ? 2000 : 1, triad->n_threads, &wall, &sink);
        share[at] = 100.0 * kernels[kernel].bytes / wall / bandwidth;
        rate[at] = kernels[kernel].operations / ns[at];
        of_peak[at] = 100.0 * rate[at] / peak;
    }
    const bench_stat stat = bench_stat_of(b->settings.repeats, ns), flops = bench_stat_of(b->settings.repeats, rate),
                     of = bench_stat_of(b->settings.repeats, share), most = bench_stat_of(b->settings.repeats, of_peak);
    bench_table_row(
        table, "%s|%s|%d|%s|%s|%.1f|%s|%s|%s", kernels[kernel].name, variant->name, triad->n_threads,
        in_cache ? "cache" : "memory", bench_stat_text(stat, 1.0, text[0], sizeof text[0]),
        kernels[kernel].bytes / stat.median, in_cache ? "" : bench_stat_text(of, 1.0, text[1], sizeof text[1]),
        bench_stat_text(flops, 1.0, text[2], sizeof text[2]), bench_stat_text(most, 1.0, text[3], sizeof text[3]));
    bench_record(b, "moments",
                 json_pack("{s:s, s:s, s:i, s:I, s:o, s:f, s:f, s:o, s:o, s:o}", "kernel", kernels[kernel].name, "isa",
                           variant->name, "threads", triad->n_threads, "atoms", (json_int_t)n, "ns",
                           bench_stat_json(stat), "bytes", kernels[kernel].bytes, "operations",
                           kernels[kernel].operations, "percent_of_triad", bench_stat_json(of), "gflops",
                           bench_stat_json(flops), "percent_of_peak", bench_stat_json(most)));
}

loxo_status bench_micro_moments(bench *b)
{
    static bench_table table; /* large */
    loxo_machine machine;
    loxo_status status = loxo_machine_get(b->ctx, &machine);
    if (status < 0) return status;
    int64_t n = 4 * (int64_t)machine.l3_bytes / 24; /* four times the last cache, as triad */
    if (n > 4 * b->settings.vertices) n = 4 * b->settings.vertices;
    if (n < 2 * N_IN_CACHE) n = 2 * N_IN_CACHE;
    double *x = loxo_allocate(b->ctx, 3 * n, sizeof *x), *weight = loxo_allocate(b->ctx, n, sizeof *weight);
    status = x == NULL || weight == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
    if (status >= 0) {
        bench_directions_many(b->threads[b->n_threads - 1], 1, 0.0, n, x);
        for (int64_t i = 0; i < n; ++i)
            weight[i] = 1.0;
    }
    bench_table_begin(&table, "pass over atoms|set|threads|from|ns/atom|GB/s|% of triad|GFLOP/s|% of peak");
    for (int t = 0; t < b->n_threads && status >= 0; ++t) {
        bench_triad triad;
        if ((status = bench_triad_open(b, b->threads[t], &triad)) < 0) break;
        for (int kernel = 0; kernel < N_KERNELS; ++kernel)
            for (int isa = LOXO_ISA_BASELINE; isa <= (int)loxo_context_isa(b->ctx); ++isa) {
                measure(b, &table, kernel, (loxo_isa)isa, x, weight, n, &triad);
                measure(b, &table, kernel, (loxo_isa)isa, x, weight, N_IN_CACHE, &triad);
            }
        bench_triad_close(b, &triad);
    }
    loxo_release(b->ctx, x);
    loxo_release(b->ctx, weight);
    if (status < 0) return status;
    bench_table_print(b, &table);
    bench_say(
        b,
        "%lld atoms in memory, %d in cache. 16, 24 or 32 bytes and 14, 25 or 29 operations an atom, one of them a "
        "division. Peak: multiplications\nand additions in turns, twelve chains of them on each thread, in the "
        "same instruction set.\n",
        (long long)n, N_IN_CACHE);
    return LOXO_OK;
}
