/* SPDX-License-Identifier: MIT
 * Measurements that run in a process of their own: their peak of memory is then theirs alone. Each prints one JSON
 * object on standard output. The parent stays small, because a child's recorded peak begins at its parent's. */
#define _POSIX_C_SOURCE 200809L /* setenv */

#include "worker.h"

#include "base/options.h"
#include "base/os.h"
#include "bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

double bench_number(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    return json_is_number(value) ? json_number_value(value) : (double)NAN;
}

loxo_status bench_print_json(bench *b, json_t *object)
{
    char *text = json_dumps(object, JSON_COMPACT | JSON_REAL_PRECISION(17));
    json_decref(object);
    if (text == NULL) return bench_fail(b, LOXO_ERR_MEMORY, "no memory for the report");
    puts(text);
    free(text);
    return LOXO_OK;
}

loxo_status bench_method_settings(bench *b, const char *method, loxo_geodesic_settings *settings)
{
    char text[512], *rest = text;
    *settings = loxo_geodesic_settings_default();
    if (snprintf(text, sizeof text, "method=%s", method) >= (int)sizeof text)
        return bench_fail(b, LOXO_ERR_ARGUMENT, "too long: %s", method);
    while (rest != NULL) {
        char *name = rest, *end = strchr(rest, ','), *value;
        rest = end != NULL ? end + 1 : NULL;
        if (end != NULL) *end = '\0';
        if ((value = strchr(name, '=')) != NULL) *value++ = '\0';
        const loxo_status status = loxo_options_set(b->ctx, "geodesic", loxo_geodesic_options, settings, name, value);
        if (status < 0) return status;
    }
    return LOXO_OK;
}

/* One solve's clock time and phases, appended to the result. */
static loxo_status solve_once(const bench *b, loxo_geodesic *geodesic, double *distance, json_t *solves,
                              loxo_geodesic_info *info)
{
    const loxo_index source = (loxo_index)b->settings.source;
    const double start = loxo_os_clock_s();
    const loxo_status status = loxo_geodesic_solve(geodesic, &source, 1, distance, info);
    json_t *solve = json_pack("{s:f}", "solve_s", loxo_os_clock_s() - start);
    for (int p = 0; p < LOXO_GEODESIC_N_PHASES; ++p)
        json_object_set_new(solve, loxo_geodesic_phase_name((loxo_geodesic_phase)p), json_real(info->phase_s[p]));
    json_array_append_new(solves, solve);
    return status;
}

/* solve FILE METHOD N OUT: the whole way from file to distances (written when OUT is not "-"); N solves, the first of
 * them on memory that was never touched. */
static loxo_status solve(bench *b, char **argv)
{
    loxo_soup soup = {0};
    loxo_mesh *mesh = NULL;
    loxo_mesh_info mesh_info = {0};
    loxo_geodesic *geodesic = NULL;
    loxo_geodesic_info info = {0};
    loxo_geodesic_settings settings = loxo_geodesic_settings_default();
    double *distance = NULL;
    json_t *solves = json_array();
    const int n_solves = (int)strtol(argv[2], NULL, 10);
    double clock[6] = {loxo_os_clock_s()};
    loxo_status status = bench_method_settings(b, argv[1], &settings);
    if (status >= 0) status = loxo_read_mesh(b->ctx, argv[0], NULL, &soup);
    clock[1] = loxo_os_clock_s();
    if (status < 0 || (status = bench_mesh_of(b, &soup, NULL, &mesh_info, &mesh)) < 0) goto done;
    clock[2] = loxo_os_clock_s();
    const int64_t n = loxo_mesh_n_vertices(mesh);
    if ((status = loxo_geodesic_create(b->ctx, mesh, &settings, &geodesic)) < 0) goto done;
    clock[3] = loxo_os_clock_s();
    if ((distance = loxo_allocate(b->ctx, n, sizeof *distance)) == NULL) {
        status = LOXO_ERR_MEMORY;
        goto done;
    }
    for (int k = 0; k < n_solves; ++k)
        if ((status = solve_once(b, geodesic, distance, solves, &info)) < 0) goto done;
    const loxo_status solve_status = status;
    clock[4] = loxo_os_clock_s();
    if (strcmp(argv[3], "-") != 0 && (status = loxo_write_field(b->ctx, argv[3], "distance", distance, n, NULL)) < 0)
        goto done;
    clock[5] = loxo_os_clock_s();
    json_t *result = json_pack("{s:s, s:I, s:I, s:f, s:f, s:f, s:f, s:f, s:O, s:I, s:I, s:I, s:I, s:I}", "status",
                               loxo_status_name(solve_status), "n_vertices", (json_int_t)n, "n_faces",
                               (json_int_t)loxo_mesh_n_faces(mesh), "read_s", clock[1] - clock[0], "mesh_s",
                               clock[2] - clock[1], "create_s", clock[3] - clock[2], "write_s", clock[5] - clock[4],
                               "total_s", clock[5] - clock[0], "solves", solves, "peak_bytes",
                               (json_int_t)loxo_os_peak_rss(), "workspace_bytes", (json_int_t)info.workspace_bytes,
                               "mesh_bytes", (json_int_t)mesh_info.mesh_bytes + (json_int_t)mesh_info.order_bytes,
                               "n_levels", (json_int_t)info.n_levels, "n_updates", (json_int_t)info.n_evaluations);
    status = bench_print_json(b, result);
done:
    json_decref(solves);
    loxo_release(b->ctx, distance);
    loxo_geodesic_destroy(geodesic);
    loxo_mesh_destroy(mesh);
    loxo_soup_destroy(b->ctx, &soup);
    return status;
}

/* error CASE FILE: mean relative error of the distances in FILE on a named case. */
static loxo_status error_of(bench *b, char **argv)
{
    for (int i = 0; i < bench_n_cases(b); ++i) {
        const bench_case c = bench_case_get(b, i);
        loxo_soup soup;
        double *exact = NULL, *distance = NULL;
        loxo_distance_error error = {0};
        if (strcmp(c.name, argv[0]) != 0) continue;
        loxo_status status = bench_case_load(b, &c, &soup, &exact);
        if (status >= 0 && exact == NULL)
            status = bench_fail(b, LOXO_ERR_UNSUPPORTED, "%s: the true distances are not known", c.name);
        if (status >= 0) status = bench_read_distances(b, argv[1], soup.n_vertices, &distance);
        if (status >= 0) status = loxo_measure_distance_error(b->ctx, distance, exact, soup.n_vertices, &error);
        loxo_release(b->ctx, distance);
        loxo_release(b->ctx, exact);
        loxo_soup_destroy(b->ctx, &soup);
        if (status < 0) return status;
        return bench_print_json(b, json_pack("{s:f}", "mean_relative", error.mean_relative));
    }
    return bench_fail(b, LOXO_ERR_ARGUMENT, "no case of that name: %s", argv[0]);
}

/* compare TRUTH FILE: mean relative error (29) over the vertices that TRUTH has, the first ones of FILE. */
static loxo_status compare(bench *b, char **argv)
{
    double *exact = NULL, *distance = NULL;
    int64_t n_exact = 0, n = 0;
    loxo_distance_error error = {0};
    loxo_status status = loxo_read_field(b->ctx, argv[0], &exact, &n_exact);
    if (status >= 0) status = loxo_read_field(b->ctx, argv[1], &distance, &n);
    if (status >= 0 && n < n_exact)
        status = bench_fail(b, LOXO_ERR_MALFORMED, "%s: %lld values, the truth has %lld", argv[1], (long long)n,
                            (long long)n_exact);
    if (status >= 0) status = loxo_measure_distance_error(b->ctx, distance, exact, n_exact, &error);
    loxo_release(b->ctx, distance);
    loxo_release(b->ctx, exact);
    if (status < 0) return status;
    return bench_print_json(
        b, json_pack("{s:f, s:I}", "mean_relative", error.mean_relative, "n_compared", (json_int_t)error.n_compared));
}

static const struct {
    const char *name;
    int n_arguments;
    loxo_status (*run)(bench *b, char **argv);
} tasks[] = {{"generate", 3, bench_task_generate},
             {"subdivide", 3, bench_task_subdivide},
             {"shuffle", 2, bench_task_shuffle},
             {"closed-form", 3, bench_task_closed_form},
             {"build", 2, bench_task_build},
             {"order", 4, bench_task_order},
             {"solve", 4, solve},
             {"error", 2, error_of},
             {"compare", 2, compare},
             {"search", 4, bench_task_search},
             {"laplace", 2, bench_task_laplace}};

loxo_status bench_worker(bench *b, int argc, char **argv)
{
    b->keep_work = true; /* the folder is the parent's */
    for (size_t i = 0; i < sizeof tasks / sizeof tasks[0]; ++i)
        if (argc >= 1 && strcmp(tasks[i].name, argv[0]) == 0 && argc == 1 + tasks[i].n_arguments)
            return tasks[i].run(b, argv + 1);
    return bench_fail(b, LOXO_ERR_ARGUMENT, "worker: no such task");
}

loxo_status bench_worker_run(bench *b, int n_threads, const char *const *task, json_t **result)
{
    char threads[16], vertices[32], source[32], memory[32], search[32];
    const char *argv[48] = {b->self, "worker"};
    int n = 2;
    bench_child child;
    *result = NULL;
    while (*task != NULL && n < 32)
        argv[n++] = *task++;
    snprintf(threads, sizeof threads, "%d", n_threads);
    snprintf(vertices, sizeof vertices, "%lld", (long long)b->settings.vertices);
    snprintf(source, sizeof source, "%lld", (long long)b->settings.source);
    snprintf(memory, sizeof memory, "%zu", b->settings.max_memory);
    snprintf(search, sizeof search, "%.17g", b->settings.search_seconds);
    const char *const options[] = {"--threads", threads, "--vertices",   vertices, "--source",         source,
                                   "--work",    b->work, "--max-memory", memory,   "--search-seconds", search};
    for (size_t i = 0; i < sizeof options / sizeof options[0]; ++i)
        argv[n++] = options[i];
    const char *const optional[][2] = {
        {"--shared", b->shared[0] != '\0' ? b->shared : NULL}, {"--mesh", b->mesh}, {"--exact", b->exact}};
    for (size_t i = 0; i < sizeof optional / sizeof optional[0]; ++i) {
        if (optional[i][1] == NULL) continue;
        argv[n++] = optional[i][0];
        argv[n++] = optional[i][1];
    }
    argv[n] = NULL;
    setenv("OMP_NUM_THREADS", threads, 1); /* also of the BLAS in there */
    const loxo_status status = bench_child_run(b->ctx, argv, &child);
    if (status < 0) return status;
    b->child_exit = child.exit_code;
    if (child.exit_code == 0) *result = json_loads(child.text, 0, NULL);
    loxo_release(b->ctx, child.text);
    if (*result != NULL) return LOXO_OK;
    return bench_fail(b, LOXO_ERR_UNSUPPORTED, "the child `%s` ended with exit code %d", argv[2], child.exit_code);
}
