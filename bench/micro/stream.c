/* SPDX-License-Identifier: MIT
 * STREAM triad: the memory bandwidth that kernels are measured against.
 * source  McCalpin 1995, Memory Bandwidth and Machine Balance in Current High Performance Computers */
#include "../bench.h"
#include "base/os.h"

#include <omp.h>

/* Where thread i's share of 0..n-1 begins. */
static int64_t share(int64_t n, int i)
{
    const int of = omp_get_num_threads();
    return n / of * i + n % of * i / of;
}

/* noinline: a measured loop must not be merged with its check. */
static __attribute__((noinline)) void triad(int n_threads, int64_t n, double s, const double *restrict b,
                                            const double *restrict c, double *restrict a)
{
#pragma omp parallel num_threads(n_threads)
    {
        const int64_t end = share(n, omp_get_thread_num() + 1);
        for (int64_t i = share(n, omp_get_thread_num()); i < end; ++i)
            a[i] = b[i] + s * c[i];
    }
}

loxo_status bench_triad_open(bench *b, int n_threads, bench_triad *t)
{
    loxo_machine machine;
    *t = (bench_triad){.n_threads = n_threads};
    const loxo_status status = loxo_machine_get(b->ctx, &machine);
    if (status < 0) return status;
    /* An array each of at least four times the last cache, so that nothing stays in it between rounds. */
    size_t array_bytes = 4 * machine.l3_bytes;
    if (array_bytes < (size_t)64 << 20) array_bytes = (size_t)64 << 20;
    if (array_bytes > machine.memory_limit_bytes / 8) array_bytes = machine.memory_limit_bytes / 8;
    t->n = (int64_t)(array_bytes / sizeof(double));
    for (int i = 0; i < 3; ++i)
        if ((t->array[i] = loxo_allocate(b->ctx, t->n, sizeof *t->array[i])) == NULL) {
            bench_triad_close(b, t);
            return LOXO_ERR_MEMORY;
        }
#pragma omp parallel num_threads(n_threads)
    {
        const int64_t end = share(t->n, omp_get_thread_num() + 1); /* first touch by the thread that works there */
        for (int64_t i = share(t->n, omp_get_thread_num()); i < end; ++i) {
            t->array[0][i] = 0.0;
            t->array[1][i] = (double)(i & 1023);
            t->array[2][i] = 1.0;
        }
    }
    return LOXO_OK;
}

double bench_triad_run(const bench_triad *t)
{
    const double start = loxo_os_clock_s();
    triad(t->n_threads, t->n, 3.0, t->array[1], t->array[2], t->array[0]);
    const double seconds = loxo_os_clock_s() - start;
    const bool is_right = t->array[0][t->n - 1] == t->array[1][t->n - 1] + 3.0;
    return is_right ? 24e-9 * (double)t->n / seconds : 0.0;
}

void bench_triad_close(bench *b, bench_triad *t)
{
    for (int i = 0; i < 3; ++i)
        loxo_release(b->ctx, t->array[i]);
    *t = (bench_triad){0};
}
