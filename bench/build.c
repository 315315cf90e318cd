/* SPDX-License-Identifier: MIT
 * The half-edges of a mesh in memory, and its intrinsic Delaunay triangulation, for every thread count. */
#include "bench.h"

#include <stdio.h>

static bench_stat stat_of(const json_t *result, const char *key)
{
    double sample[BENCH_MAX_REPEATS];
    const json_t *list = json_object_get(result, key);
    int n = 0;
    for (; n < BENCH_MAX_REPEATS && n < (int)json_array_size(list); ++n)
        sample[n] = json_number_value(json_array_get(list, (size_t)n));
    return bench_stat_of(n, sample);
}

loxo_status bench_build(bench *b)
{
    static const char *const keys[] = {"halfedge_s", "reorder_s", "total_s", "intrinsic_s"};
    static bench_table table; /* large */
    char mesh[BENCH_PATH], repeats[16], text[4][64];
    bench_table_begin(
        &table,
        "vertices|threads|half-edges, s|order, s|in all, s|ns/vertex|mesh B/vertex|peak B/vertex|intrinsic, s|flips");
    loxo_status status = bench_generate(b, LOXO_SHAPE_BUMPY, b->settings.vertices, mesh);
    if (status < 0) return status;
    snprintf(repeats, sizeof repeats, "%d", b->settings.repeats);
    for (int t = 0; t < b->n_threads; ++t) {
        json_t *result = NULL;
        status = bench_worker_run(b, b->threads[t], (const char *const[]){"build", mesh, repeats, NULL}, &result);
        if (status < 0) return status;
        const double n = bench_number(result, "n_vertices");
        const bench_stat total = stat_of(result, "total_s");
        for (int q = 0; q < 4; ++q)
            bench_stat_text(stat_of(result, keys[q]), 1.0, text[q], sizeof text[q]);
        bench_table_row(&table, "%.0f|%d|%s|%s|%s|%.1f|%.1f|%.1f|%s|%.0f", n, b->threads[t], text[0], text[1], text[2],
                        1e9 * total.median / n,
                        (bench_number(result, "mesh_bytes") + bench_number(result, "order_bytes")) / n,
                        bench_number(result, "peak_bytes") / n, text[3], bench_number(result, "n_flips"));
        bench_record(b, "build",
                     json_pack("{s:f, s:i, s:o, s:o, s:f, s:f}", "n_vertices", n, "threads", b->threads[t], "total_s",
                               bench_stat_json(total), "intrinsic_s", bench_stat_json(stat_of(result, "intrinsic_s")),
                               "mesh_bytes", bench_number(result, "mesh_bytes"), "peak_bytes",
                               bench_number(result, "peak_bytes")));
        json_decref(result);
    }
    bench_table_print(b, &table);
    puts("The mesh keeps a copy of positions and triangles. Wanted at 1M vertices and two threads: at most 0.15 s.");
    return LOXO_OK;
}
