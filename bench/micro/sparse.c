/* SPDX-License-Identifier: MIT
 * Passes over sparse rows: the product of conjugate gradients, and the smoother of multigrid on its finest level. */
#include "sparse.h"

#include "../bench.h"
#include "algebra/multigrid_internal.h"
#include "base/os.h"
#include "operator/laplacian.h"

#include <omp.h>
#include <string.h>

#define N_INNER 4 /* runs a sample */

typedef struct subject {
    loxo_csr a;
    loxo_multigrid *mg;
    double *x, *y, *b;
} subject;

static void product(const subject *s, int64_t begin, int64_t end)
{
    k_csr_multiply(s->a.begin, s->a.column, s->a.value, s->a.diagonal, begin, end, s->x, s->y);
}

static void forward(const subject *s, int64_t begin, int64_t end)
{
    const k_smooth_level rows = mg_rows(&s->mg->level[0]);
    k_smooth_forward(&rows, begin, end, s->b, s->x);
}

static void residual(const subject *s, int64_t begin, int64_t end)
{
    const k_smooth_level rows = mg_rows(&s->mg->level[0]);
    k_smooth_residual(&rows, begin, end, s->b, s->x, s->y);
}

static void backward(const subject *s, int64_t begin, int64_t end)
{
    const k_smooth_level rows = mg_rows(&s->mg->level[0]);
    k_smooth_backward(&rows, begin, end, s->b, s->y, s->x);
}

/* Bytes a row of six entries that must be read and written once; neighbours' numbers count once. */
static const struct {
    const char *name;
    void (*run)(const subject *s, int64_t begin, int64_t end);
    double bytes;
} kernels[] = {
    /* offset 8, columns 24, values 48, diagonal 8; x read, y written */
    {"sparse product", product, 8 + 24 + 48 + 8 + 16},
    /* offset 8, columns 24, weights 24, inverse 4; b read, x written */
    {"smoothing forward", forward, 8 + 24 + 24 + 4 + 16},
    /* the same with excess for inverse; b and x read, y written */
    {"smoothing residual", residual, 8 + 24 + 24 + 4 + 24},
    {"smoothing backward", backward, 8 + 24 + 24 + 8 + 24},
};
#define N_KERNELS ((int)(sizeof kernels / sizeof kernels[0]))

static double run_once(const subject *s, int kernel, int n_threads)
{
    const int64_t n = s->a.n_rows, block = s->mg->level[0].block_rows, n_blocks = (n + block - 1) / block;
    const double start = loxo_os_clock_s();
    for (int turn = 0; turn < N_INNER; ++turn) {
#pragma omp parallel for num_threads(n_threads) schedule(static)
        for (int64_t k = 0; k < n_blocks; ++k)
            kernels[kernel].run(s, k * block, (k + 1) * block < n ? (k + 1) * block : n);
    }
    return (loxo_os_clock_s() - start) / N_INNER;
}

static void measure(bench *b, const subject *s, bench_table *table, int kernel, const bench_triad *triad)
{
    double ns[BENCH_MAX_REPEATS], share[BENCH_MAX_REPEATS];
    char text[2][64];
    for (int k = -1; k < b->settings.repeats; ++k) { /* the warm-up is overwritten */
        const int at = k < 0 ? 0 : k;
        const double rate = bench_triad_run(triad);
        ns[at] = 1e9 * run_once(s, kernel, triad->n_threads) / (double)s->a.n_rows;
        share[at] = 100.0 * kernels[kernel].bytes / ns[at] / rate;
    }
    const bench_stat stat = bench_stat_of(b->settings.repeats, ns), of = bench_stat_of(b->settings.repeats, share);
    bench_table_row(table, "%s|baseline|%d|vertex|%s|%.0f|%.1f|%s", kernels[kernel].name, triad->n_threads,
                    bench_stat_text(stat, 1.0, text[0], sizeof text[0]), kernels[kernel].bytes,
                    kernels[kernel].bytes / stat.median, bench_stat_text(of, 1.0, text[1], sizeof text[1]));
    bench_record(b, "kernels",
                 json_pack("{s:s, s:s, s:i, s:s, s:o, s:f, s:o}", "kernel", kernels[kernel].name, "isa", "baseline",
                           "threads", triad->n_threads, "element", "vertex", "ns", bench_stat_json(stat), "bytes",
                           kernels[kernel].bytes, "percent_of_triad", bench_stat_json(of)));
}

static loxo_status open_subject(bench *b, const loxo_mesh_view *m, subject *s)
{
    double **const arrays[] = {&s->x, &s->y, &s->b};
    loxo_status status = loxo_laplacian_create(b->ctx, m, &s->a, NULL);
    if (status >= 0) status = loxo_multigrid_create(b->ctx, &s->a, NULL, &s->mg);
    for (int k = 0; k < 3 && status >= 0; ++k) {
        *arrays[k] = loxo_allocate(b->ctx, m->n_vertices, sizeof **arrays[k]);
        if (*arrays[k] == NULL)
            status = LOXO_ERR_MEMORY;
        else
            memset(*arrays[k], 0, (size_t)m->n_vertices * sizeof **arrays[k]);
    }
    return status;
}

loxo_status bench_micro_sparse(bench *b, const loxo_mesh_view *m, bench_table *table)
{
    subject s = {0};
    loxo_status status = open_subject(b, m, &s);
    for (int t = 0; t < b->n_threads && status >= 0; ++t) {
        bench_triad triad;
        if ((status = bench_triad_open(b, b->threads[t], &triad)) < 0) break;
        for (int kernel = 0; kernel < N_KERNELS; ++kernel)
            measure(b, &s, table, kernel, &triad);
        bench_triad_close(b, &triad);
    }
    loxo_release(b->ctx, s.x);
    loxo_release(b->ctx, s.y);
    loxo_release(b->ctx, s.b);
    loxo_multigrid_destroy(s.mg);
    loxo_csr_destroy(b->ctx, &s.a);
    return status;
}
