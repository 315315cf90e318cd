/* SPDX-License-Identifier: MIT
 * What `loxo geodesic --estimate` predicts, against what the same command then takes, from file to file, at growing sizes. */
#include "bench.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define MOST_SIZES 12

/* The command of the same build. */
static loxo_status command_path(bench *b, char path[BENCH_PATH])
{
    char folder[BENCH_PATH];
    snprintf(folder, sizeof folder, "%s", b->self);
    for (int up = 0; up < 2; ++up) {
        char *slash = strrchr(folder, '/');
        if (slash == NULL) return bench_fail(b, LOXO_ERR_READ, "%s: in no folder", b->self);
        *slash = '\0';
    }
    const int n = snprintf(path, BENCH_PATH, "%s/tools/loxo", folder);
    if (n > 0 && n < BENCH_PATH && access(path, X_OK) == 0) return LOXO_OK;
    return bench_fail(b, LOXO_ERR_READ, "%s: the command is not built", path);
}

/* One run of the command; its JSON, when it prints one. */
static loxo_status run(bench *b, const char *const *argv, bench_child *child, json_t **report)
{
    loxo_status status = bench_child_run(b->ctx, argv, child);
    if (status < 0) return status;
    *report = json_loads(child->text, 0, NULL);
    loxo_release(b->ctx, child->text);
    /* 8: the answer was written and fails its check */
    if ((child->exit_code != 0 && child->exit_code != 8) || *report == NULL)
        status = bench_fail(b, LOXO_ERR_UNSUPPORTED, "%s ended with exit code %d", argv[0], child->exit_code);
    return status;
}

typedef struct prediction {
    double bytes, seconds, took_s; /* took_s: of predicting */
} prediction;

/* First predicted, then run: so that what else goes on is much the same for both. */
static loxo_status measure_once(bench *b, const char *command, const char *mesh, const char *method, int n_threads,
                                prediction *p, double *seconds, double *bytes)
{
    char threads[16], out[BENCH_PATH + 32], memory[32];
    bench_child child;
    json_t *report = NULL;
    snprintf(threads, sizeof threads, "%d", n_threads);
    snprintf(out, sizeof out, "%s/estimate.npy", b->work);
    snprintf(memory, sizeof memory, "%zu", b->settings.max_memory);
    const char *const predict[] = {command,     "geodesic", mesh,         "-s",      "0",      "--method", method,
                                   "--threads", threads,    "--estimate", "--quiet", "--json", "-",        NULL};
    loxo_status status = run(b, predict, &child, &report);
    if (status >= 0) {
        const json_t *estimate = json_object_get(report, "estimate");
        *p = (prediction){bench_number(estimate, "process_bytes"), bench_number(estimate, "seconds"), child.wall_s};
    }
    json_decref(report);
    if (status < 0) return status;
    const char *const solve[] = {command, "geodesic", mesh, "-s",      "0",      "--method", method, "--threads",
                                 threads, "-o",       out,  "--quiet", "--json", "-",        NULL};
    status = run(b, solve, &child, &report);
    json_decref(report);
    unlink(out);
    *seconds = child.wall_s;
    *bytes = (double)child.peak_bytes;
    return status;
}

static loxo_status measure(bench *b, const char *command, double n_wanted, const char *method, int n_threads,
                           bench_table *table)
{
    char mesh[BENCH_PATH], text[2][64];
    double seconds[BENCH_MAX_REPEATS], predicted[BENCH_MAX_REPEATS], off[BENCH_MAX_REPEATS], bytes = 0.0, took = 0.0;
    prediction p = {0};
    loxo_status status = bench_generate(b, LOXO_SHAPE_BUMPY, (int64_t)n_wanted, mesh);
    for (int k = -1; k < b->settings.repeats && status >= 0;
         ++k) { /* the first is thrown away: the file is then cached */
        const int at = k < 0 ? 0 : k;
        status = measure_once(b, command, mesh, method, n_threads, &p, &seconds[at], &bytes);
        predicted[at] = p.seconds;
        off[at] = p.seconds / seconds[at] - 1.0;
        took = p.took_s;
    }
    if (status < 0) return status;
    const bench_stat measured = bench_stat_of(b->settings.repeats, seconds);
    const bench_stat guessed = bench_stat_of(b->settings.repeats, predicted);
    const bench_stat error = bench_stat_of(b->settings.repeats, off);
    const double bytes_off = p.bytes / bytes - 1.0;
    bench_table_row(table, "%.0f|%s|%d|%.1f|%.1f|%+.1f %%|%s|%s|%+.0f %% [%+.0f..%+.0f]|%.2f", n_wanted, method,
                    n_threads, 1e-6 * p.bytes, 1e-6 * bytes, 100.0 * bytes_off,
                    bench_stat_text(guessed, 1.0, text[0], sizeof text[0]),
                    bench_stat_text(measured, 1.0, text[1], sizeof text[1]), 100.0 * error.median, 100.0 * error.min,
                    100.0 * error.max, took);
    bench_record(b, "estimate",
                 json_pack("{s:f, s:s, s:i, s:f, s:f, s:o, s:o}", "n_vertices", n_wanted, "method", method, "threads",
                           n_threads, "predicted_bytes", p.bytes, "peak_bytes", bytes, "predicted_s",
                           bench_stat_json(guessed), "seconds", bench_stat_json(measured)));
    return LOXO_OK;
}

loxo_status bench_estimate(bench *b)
{
    static bench_table table; /* large */
    char command[BENCH_PATH];
    double n = fmin(100000.0, (double)b->settings.vertices);
    loxo_status status = command_path(b, command);
    if (status < 0) return status;
    bench_table_begin(&table,
                      "vertices|method|threads|predicted MB|taken|off|predicted s|taken|off|predicting took, s");
    for (int i = 0; i < MOST_SIZES && n < 1.001 * (double)b->settings.largest; ++i, n *= sqrt(10.0))
        for (int m = 0; m < b->n_methods; ++m)
            for (int t = 0; t < b->n_threads; ++t)
                if ((status = measure(b, command, n, b->methods[m], b->threads[t], &table)) < 0) return status;
    bench_table_print(b, &table);
    bench_say(
        b, "The command, PLY file to .npy file, bumpy sphere from vertex 0; bytes: most resident ones of the process.\n"
           "Wanted of the edge-based method: within 10 %% in bytes and 30 %% in seconds.\n");
    return LOXO_OK;
}
