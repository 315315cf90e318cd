/* SPDX-License-Identifier: MIT
 * Growth: from a PLY file to distances in a file at two sizes, every round in a process of its own. */
#include "bench.h"

#include <stdio.h>

typedef struct growth {
    bench_stat time_ns, bytes; /* a vertex */
    bench_stat phase_ns[LOXO_GEODESIC_N_PHASES];
} growth;

static loxo_status measure(bench *b, bench_table *table, int64_t n_wanted, const char *method, int n_threads, growth *g)
{
    char mesh[BENCH_PATH], out[BENCH_PATH + 32], text[6][64];
    static const char *const keys[] = {"read_s", "mesh_s", "create_s", "write_s", "total_s"};
    double phase_ns[LOXO_GEODESIC_N_PHASES][BENCH_MAX_REPEATS];
    double sample[5][BENCH_MAX_REPEATS], solve_s[BENCH_MAX_REPEATS], time_ns[BENCH_MAX_REPEATS],
        bytes[BENCH_MAX_REPEATS], n = 1.0;
    loxo_status status = bench_generate(b, LOXO_SHAPE_BUMPY, n_wanted, mesh);
    snprintf(out, sizeof out, "%s/scale.npy", b->work);
    for (int k = -1; k < b->settings.repeats && status >= 0; ++k) {
        const int at = k < 0 ? 0 : k; /* the warm-up is overwritten */
        json_t *result = NULL;
        status = bench_worker_run(b, n_threads, (const char *const[]){"solve", mesh, method, "1", out, NULL}, &result);
        if (status < 0) break;
        n = bench_number(result, "n_vertices");
        for (int q = 0; q < 5; ++q)
            sample[q][at] = bench_number(result, keys[q]);
        const json_t *solve = json_array_get(json_object_get(result, "solves"), 0);
        solve_s[at] = bench_number(solve, "solve_s");
        for (int p = 0; p < LOXO_GEODESIC_N_PHASES; ++p)
            phase_ns[p][at] = 1e9 * bench_number(solve, loxo_geodesic_phase_name((loxo_geodesic_phase)p)) / n;
        time_ns[at] = 1e9 * sample[4][at] / n;
        bytes[at] = bench_number(result, "peak_bytes") / n;
        json_decref(result);
    }
    if (status < 0) return status;
    const int repeats = b->settings.repeats;
    g->time_ns = bench_stat_of(repeats, time_ns);
    g->bytes = bench_stat_of(repeats, bytes);
    for (int p = 0; p < LOXO_GEODESIC_N_PHASES; ++p)
        g->phase_ns[p] = bench_stat_of(repeats, phase_ns[p]);
    for (int q = 0; q < 5; ++q)
        bench_stat_text(bench_stat_of(repeats, sample[q]), 1.0, text[q], sizeof text[q]);
    bench_stat_text(bench_stat_of(repeats, solve_s), 1.0, text[5], sizeof text[5]);
    bench_table_row(table, "%.0f|%s|%d|%s|%s|%s|%s|%s|%s|%.0f|%.1f", n, method, n_threads, text[0], text[1], text[2],
                    text[5], text[3], text[4], g->time_ns.median, g->bytes.median);
    bench_record(b, "scale",
                 json_pack("{s:f, s:s, s:i, s:o, s:o, s:o, s:o}", "n_vertices", n, "method", method, "threads",
                           n_threads, "total_s", bench_stat_json(bench_stat_of(repeats, sample[4])), "solve_s",
                           bench_stat_json(bench_stat_of(repeats, solve_s)), "ns_per_vertex",
                           bench_stat_json(g->time_ns), "bytes_per_vertex", bench_stat_json(g->bytes)));
    return LOXO_OK;
}

static void show_phases(bench_table *table, const char *method, const growth *small, const growth *large)
{
    for (int p = 0; p < LOXO_GEODESIC_N_PHASES; ++p) {
        char a[64], c[64];
        const bench_stat from = small->phase_ns[p], to = large->phase_ns[p];
        bench_table_row(table, "%s|%s|%s|%s|%.2f", method, loxo_geodesic_phase_name((loxo_geodesic_phase)p),
                        bench_stat_text(from, 1.0, a, sizeof a), bench_stat_text(to, 1.0, c, sizeof c),
                        to.median / from.median);
    }
}

loxo_status bench_scale(bench *b)
{
    static bench_table table, phases; /* large */
    const int n_threads = b->threads[b->n_threads - 1];
    bench_table_begin(&table, "vertices|method|threads|read, s|half-edges, s|create, s|solve, s|write, s|in all, s|"
                              "ns/vertex|peak B/vertex");
    bench_table_begin(&phases, "method|phase|smaller, ns/vertex|larger, ns/vertex|growth");
    for (int i = 0; i < b->n_methods; ++i) {
        const char *method = b->methods[i];
        growth small, large;
        loxo_status status = measure(b, &table, b->settings.vertices, method, n_threads, &small);
        if (status >= 0) status = measure(b, &table, b->settings.largest, method, n_threads, &large);
        if (status < 0) return status;
        printf("%s: a vertex of the larger mesh costs %.2f times the time and %.2f times the bytes; wanted: at most "
               "1.3\n",
               method, large.time_ns.median / small.time_ns.median, large.bytes.median / small.bytes.median);
        show_phases(&phases, method, &small, &large);
        bench_record(b, "growth",
                     json_pack("{s:s, s:f, s:f}", "method", method, "time", large.time_ns.median / small.time_ns.median,
                               "bytes", large.bytes.median / small.bytes.median));
    }
    putchar('\n');
    bench_table_print(b, &table);
    bench_table_print(b, &phases);
    puts("The paper, Table 1, 997,635 to 9,884,764 vertices, 8 threads: a vertex costs 1.83 (edge) and 1.91 (face) "
         "times "
         "the time,\n0.90 and 0.89 times the bytes.");
    return LOXO_OK;
}
