/* SPDX-License-Identifier: MIT
 * laplace FILE SOLVER: the cotangent matrix of a mesh, and one solver on it: set-up, one solve to 1e-8 from noise. */
#include "algebra/cg.h"
#include "algebra/cholesky.h"
#include "algebra/multigrid.h"
#include "base/os.h"
#include "laplace.h"
#include "operator/laplacian.h"
#include "worker.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

double laplace_clock_s(const loxo_context *ctx)
{
    return loxo_context_n_threads(ctx) == 1 ? loxo_os_cpu_s() : loxo_os_clock_s();
}

size_t laplace_resident_bytes(void)
{
    long pages = 0, resident = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (file == NULL) return 0;
    if (fscanf(file, "%ld %ld", &pages, &resident) != 2) resident = 0;
    fclose(file);
    return (size_t)resident * (size_t)sysconf(_SC_PAGESIZE);
}

static loxo_status by_cg(bench *b, const loxo_csr *a, bool is_multigrid, const double *right, double *x,
                         laplace_result *result)
{
    loxo_multigrid *mg = NULL;
    loxo_multigrid_info grid = {0};
    loxo_cg *cg = NULL;
    loxo_cg_info info = {0};
    loxo_diagonal diagonal = {b->ctx, a};
    loxo_preconditioner m = {loxo_diagonal_apply, &diagonal};
    loxo_cg_settings settings = loxo_cg_settings_default();
    const size_t before = loxo_context_memory(b->ctx).current_bytes;
    loxo_context_reset_peak(b->ctx);
    double clock = laplace_clock_s(b->ctx);
    loxo_status status = is_multigrid ? loxo_multigrid_create(b->ctx, a, &grid, &mg) : LOXO_OK;
    if (status >= 0) status = loxo_cg_create(b->ctx, a, &cg);
    if (is_multigrid) m = (loxo_preconditioner){loxo_multigrid_apply, mg};
    settings.max_iterations = 100000;
    settings.tolerance = LAPLACE_TOLERANCE;
    result->setup_s = laplace_clock_s(b->ctx) - clock;
    clock = laplace_clock_s(b->ctx);
    if (status >= 0) status = loxo_cg_solve(cg, &m, &settings, right, x, &info);
    result->solve_s = laplace_clock_s(b->ctx) - clock;
    result->held_bytes = loxo_context_memory(b->ctx).peak_bytes - before;
    result->n_steps = info.n_iterations;
    result->levels = grid.n_levels;
    result->complexity = grid.operator_complexity;
    loxo_cg_destroy(cg);
    loxo_multigrid_destroy(mg);
    return status;
}

static loxo_status by_cholesky(bench *b, const loxo_csr *a, const double *right, double *x, laplace_result *result)
{
    loxo_cholesky *c = NULL;
    const size_t before = laplace_resident_bytes();
    double clock = laplace_clock_s(b->ctx);
    omp_set_num_threads(loxo_context_n_threads(b->ctx)); /* of the BLAS under it */
    loxo_status status = loxo_cholesky_create(b->ctx, a, NULL, &c);
    if (status >= 0) status = loxo_cholesky_factor(c, a);
    result->setup_s = laplace_clock_s(b->ctx) - clock;
    clock = laplace_clock_s(b->ctx);
    if (status >= 0) status = loxo_cholesky_solve(c, right, x);
    result->solve_s = laplace_clock_s(b->ctx) - clock;
    result->held_bytes = laplace_resident_bytes() - before;
    loxo_cholesky_destroy(c);
    return status;
}

/* One vertex held at 0: others want a definite matrix. */
static loxo_status pin_first(bench *b, loxo_csr *a)
{
    bool *is_pinned = loxo_allocate(b->ctx, a->n_rows, sizeof *is_pinned);
    if (is_pinned == NULL) return LOXO_ERR_MEMORY;
    memset(is_pinned, 0, (size_t)a->n_rows * sizeof *is_pinned);
    is_pinned[0] = true;
    loxo_csr_pin(b->ctx, a, is_pinned);
    loxo_release(b->ctx, is_pinned);
    return LOXO_OK;
}

static double residual_of(bench *b, const loxo_csr *a, const double *right, const double *x, double *work)
{
    double rr = 0.0, bb = 0.0;
    loxo_csr_multiply(b->ctx, a, x, work);
    for (int64_t i = 0; i < a->n_rows; ++i) {
        rr += (right[i] - work[i]) * (right[i] - work[i]);
        bb += right[i] * right[i];
    }
    return sqrt(rr / bb);
}

static loxo_status run(bench *b, const char *solver, loxo_csr *a, double matrix_s)
{
    const int64_t n = a->n_rows;
    double *right, *x, *work, mean = 0.0;
    uint64_t state = 7;
    laplace_result result = {0};
    const bool is_own = strcmp(solver, "multigrid") == 0 || strcmp(solver, "diagonal") == 0;
    const loxo_memory memory = loxo_context_memory(b->ctx);
    if (strcmp(solver, "cholesky") == 0 && memory.current_bytes + loxo_cholesky_guess_bytes(n) > memory.limit_bytes)
        return bench_print_json(b, json_pack("{s:I, s:I}", "n_vertices", (json_int_t)n, "needs_bytes",
                                             (json_int_t)loxo_cholesky_guess_bytes(n)));
    right = loxo_allocate(b->ctx, n, sizeof *right);
    x = loxo_allocate(b->ctx, n, sizeof *x);
    work = loxo_allocate(b->ctx, n, sizeof *work);
    loxo_status status = right == NULL || x == NULL || work == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
    if (status < 0) goto done;
    for (int64_t i = 0; i < n; ++i) {
        state = state * 6364136223846793005u + 1442695040888963407u; /* Knuth's */
        right[i] = (double)(state >> 11) * 0x1p-53 - 0.5;
        mean += right[i] / (double)n;
        x[i] = work[i] = 0.0; /* touched */
    }
    for (int64_t i = 0; i < n; ++i)
        right[i] -= mean;
    if (!is_own && (status = pin_first(b, a)) < 0) goto done;
    if (!is_own) right[0] = 0.0;
    if (is_own)
        status = by_cg(b, a, strcmp(solver, "multigrid") == 0, right, x, &result);
    else if (strcmp(solver, "cholesky") == 0)
        status = by_cholesky(b, a, right, x, &result);
#ifdef LOXO_BENCH_WITH_HYPRE
    else if (strcmp(solver, "hypre") == 0)
        status = laplace_by_hypre(b->ctx, a, right, x, &result);
#endif
    else
        status = bench_fail(b, LOXO_ERR_UNSUPPORTED, "laplace: no solver %s in this build", solver);
    if (status < 0) goto done;
    status = bench_print_json(
        b, json_pack("{s:I, s:I, s:f, s:f, s:f, s:I, s:f, s:f, s:f, s:I, s:I}", "n_vertices", (json_int_t)n,
                     "n_entries", (json_int_t)a->begin[n], "matrix_s", matrix_s, "setup_s", result.setup_s, "solve_s",
                     result.solve_s, "n_steps", (json_int_t)result.n_steps, "residual",
                     residual_of(b, a, right, x, work), "levels", result.levels, "complexity", result.complexity,
                     "held_bytes", (json_int_t)result.held_bytes, "matrix_bytes", (json_int_t)loxo_csr_bytes(a)));
done:
    loxo_release(b->ctx, work);
    loxo_release(b->ctx, x);
    loxo_release(b->ctx, right);
    return status;
}

loxo_status bench_task_laplace(bench *b, char **argv)
{
    loxo_soup soup = {0};
    loxo_mesh *mesh = NULL;
    loxo_csr a = {0};
    loxo_status status = loxo_read_mesh(b->ctx, argv[0], NULL, &soup);
    if (status >= 0) status = bench_mesh_of(b, &soup, NULL, NULL, &mesh);
    loxo_soup_destroy(b->ctx, &soup);
    if (status < 0) return status;
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    const double clock = laplace_clock_s(b->ctx);
    status = loxo_laplacian_create(b->ctx, &m, &a, NULL);
    const double matrix_s = laplace_clock_s(b->ctx) - clock;
    loxo_mesh_destroy(mesh);
    if (status >= 0) status = run(b, argv[1], &a, matrix_s);
    loxo_csr_destroy(b->ctx, &a);
    return status;
}
