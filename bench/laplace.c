/* SPDX-License-Identifier: MIT
 * Our multigrid beside a sparse factor and hypre's BoomerAMG, on Laplacians of meshes. */
#include "laplace.h"

#include "bench.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

static const char *const solvers[] = {
    "multigrid",
#ifdef LOXO_BENCH_WITH_CHOLMOD
    "cholesky",
#endif
#ifdef LOXO_BENCH_WITH_HYPRE
    "hypre",
#endif
};
#define N_SOLVERS (sizeof solvers / sizeof solvers[0])

/* Scans of the folder of the meshes. */
static const char *const scans[] = {"fandisk.obj.gz",          "bunny35k.obj.gz", "bunny35k-slivers.off.gz",
                                    "armadillo50k.obj.gz",     "igea134k.ply",    "fsLR32k.L.pial.surf.gii",
                                    "moai48k-slivers.ply",     "camel10k.off.gz", "venus50k.off.gz",
                                    "fsLR32k.L.white.surf.gii"};
#define N_SCANS (sizeof scans / sizeof scans[0])

/* Rounds of one solver on one mesh, each a process. */
static loxo_status measure(bench *b, bench_table *table, const char *name, const char *path, const char *solver,
                           int n_threads)
{
    double setup[BENCH_MAX_REPEATS], solve[BENCH_MAX_REPEATS], n = 0.0;
    char text[2][64], complexity[32];
    json_t *result = NULL;
    for (int k = 0; k < b->settings.repeats; ++k) {
        json_decref(result);
        const char *const task[] = {"laplace", path, solver, NULL};
        if (bench_worker_run(b, n_threads, task, &result) < 0) {
            bench_table_row(table, "%s|-|%s|%d|did not end (exit %d)", name, solver, n_threads, b->child_exit);
            return LOXO_OK;
        }
        if (bench_number(result, "needs_bytes") > 0.0) {
            bench_table_row(table, "%s|%.0f|%s|%d|out of memory, %.0f bytes predicted", name,
                            bench_number(result, "n_vertices"), solver, n_threads, bench_number(result, "needs_bytes"));
            bench_record(b, "laplace", json_pack("{s:s, s:s, s:O}", "mesh", name, "solver", solver, "last", result));
            json_decref(result);
            return LOXO_OK;
        }
        setup[k] = bench_number(result, "setup_s");
        solve[k] = bench_number(result, "solve_s");
    }
    n = bench_number(result, "n_vertices");
    const bench_stat of_setup = bench_stat_of(b->settings.repeats, setup);
    const bench_stat of_solve = bench_stat_of(b->settings.repeats, solve);
    snprintf(complexity, sizeof complexity, "%.2f", bench_number(result, "complexity"));
    bench_table_row(table, "%s|%.0f|%s|%d|%s|%s|%.0f|%.1e|%.0f|%s", name, n, solver, n_threads,
                    bench_stat_text(of_setup, 1.0, text[0], sizeof text[0]),
                    bench_stat_text(of_solve, 1.0, text[1], sizeof text[1]), bench_number(result, "n_steps"),
                    bench_number(result, "residual"), bench_number(result, "held_bytes") / n,
                    bench_number(result, "complexity") > 0.0 ? complexity : "-");
    bench_record(b, "laplace",
                 json_pack("{s:s, s:s, s:i, s:o, s:o, s:O}", "mesh", name, "solver", solver, "threads", n_threads,
                           "setup_s", bench_stat_json(of_setup), "solve_s", bench_stat_json(of_solve), "last", result));
    json_decref(result);
    return LOXO_OK;
}

static loxo_status measure_mesh(bench *b, bench_table *table, const char *name, const char *path)
{
    loxo_status status = LOXO_OK;
    if (b->case_filter != NULL && strstr(name, b->case_filter) == NULL) return LOXO_OK;
    for (int t = 0; t < b->n_threads && status >= 0; ++t)
        for (size_t i = 0; i < N_SOLVERS && status >= 0; ++i)
            if (strcmp(solvers[i], "hypre") != 0 || b->threads[t] == 1) /* it is one process with one thread here */
                status = measure(b, table, name, path, solvers[i], b->threads[t]);
    return status;
}

loxo_status bench_laplace(bench *b)
{
    static bench_table table; /* large */
    static const loxo_shape shapes[] = {LOXO_SHAPE_ICOSPHERE, LOXO_SHAPE_BUMPY, LOXO_SHAPE_BRAIN, LOXO_SHAPE_GRID};
    char path[BENCH_PATH];
    loxo_status status = LOXO_OK;
    bench_table_begin(&table,
                      "mesh|vertices|solver|threads|set-up, s|solve, s|steps|residual|bytes a vertex|complexity");
    if (b->mesh != NULL) {
        status = measure_mesh(b, &table, "given", b->mesh);
    } else {
        for (size_t i = 0; i < sizeof shapes / sizeof shapes[0] && status >= 0; ++i) {
            if (b->case_filter != NULL && strstr(loxo_shape_name(shapes[i]), b->case_filter) == NULL) continue;
            status = bench_generate(b, shapes[i], b->settings.vertices, path);
            if (status >= 0) status = measure_mesh(b, &table, loxo_shape_name(shapes[i]), path);
        }
        for (size_t i = 0; i < N_SCANS && status >= 0 && b->shared[0] != '\0'; ++i) {
            if (snprintf(path, sizeof path, "%s/surfaces/%s", b->shared, scans[i]) >= (int)sizeof path) continue;
            if (access(path, R_OK) == 0) status = measure_mesh(b, &table, scans[i], path);
        }
    }
    if (status < 0) return status;
    bench_table_print(b, &table);
    bench_say(b, "Seconds of one thread are processor time. Right side: noise. residual: |b - A x| / |b| computed "
                 "anew. bytes: ours the most that was allocated\n"
                 "on top of the matrix, others' resident after the solve, less before the set-up. Direct solves have "
                 "no steps; they and hypre get one vertex pinned. "
                 "hypre's bytes count its\n"
                 "own copy of the matrix, too, some 90.\n");
    return LOXO_OK;
}
