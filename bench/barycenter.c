/* SPDX-License-Identifier: MIT
 * Polygons closed a second, the barycenter of many atoms against triad, and barycenters near the sphere. */
#include "base/os.h"
#include "bench.h"
#include "directions.h"

#include <loxo/barycenter.h>
#include <loxo/polygon.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

#define TOLERANCE 1e-12 /* of the certified hyperbolic distance */

/* ---- closing ---- */

typedef struct batch {
    bench *b;
    int64_t n_edges, n_polygons, turns; /* turns: calls a sample */
    bool is_written;                    /* else barycenters are certified, and that is all */
    double *x, *out[BENCH_MAX_THREADS];
    loxo_context *ctx[BENCH_MAX_THREADS]; /* one a number of threads */
    char path[BENCH_PATH];                /* of x, for peers */
} batch;

/* Seconds of one thread are its processor time: neighbours on the machine count less. */
static double now_s(int n_threads) { return n_threads == 1 ? loxo_os_thread_cpu_s() : loxo_os_clock_s(); }

/* wall: seconds by the clock, for ratios of threads. */
static double close_all(const batch *a, int at, loxo_polygon_info *info, double *wall, loxo_status *status)
{
    const loxo_polygons polygons = {
        .n_polygons = a->n_polygons, .n_edges = a->n_edges, .d = 3, .form = LOXO_POLYGON_DIRECTIONS, .x = a->x};
    loxo_polygon_settings settings = loxo_polygon_settings_default();
    settings.tolerance = TOLERANCE;
    settings.edges = true;
    const double start = now_s(a->b->threads[at]), clock = loxo_os_clock_s();
    for (int64_t turn = 0; turn < a->turns && *status >= 0; ++turn)
        *status = loxo_polygon_close(a->ctx[at], &polygons, &settings, a->is_written ? a->out[at] : NULL, NULL,
                                     a->is_written ? NULL : a->out[at], info);
    const double seconds = (now_s(a->b->threads[at]) - start) / (double)a->turns;
    *wall = loxo_os_clock_s() - clock;
    if (*status < 0) (void)bench_fail(a->b, *status, "%s", loxo_context_failure(a->ctx[at])->text);
    return seconds;
}

static loxo_status open_batch(bench *b, int64_t n_edges, int64_t n_polygons, bool is_written, batch *a)
{
    const int64_t most = 4 * b->settings.vertices / (n_edges * n_polygons);
    *a = (batch){
        .b = b, .n_edges = n_edges, .n_polygons = n_polygons, .turns = most > 1 ? most : 1, .is_written = is_written};
    const int64_t n = 3 * n_edges * n_polygons;
    if ((a->x = loxo_allocate(b->ctx, n, sizeof *a->x)) == NULL) return LOXO_ERR_MEMORY;
    bench_directions_many(b->threads[b->n_threads - 1], 1, 0.0, n_edges * n_polygons, a->x);
    for (int t = 0; t < b->n_threads; ++t) {
        loxo_context_settings settings = loxo_context_settings_default();
        settings.n_threads = b->threads[t];
        const loxo_status status = loxo_context_create(&settings, &a->ctx[t]);
        if (status < 0) return status;
        if ((a->out[t] = loxo_allocate(b->ctx, n, sizeof *a->out[t])) == NULL) return LOXO_ERR_MEMORY;
    }
    if (b->n_peers == 0) return LOXO_OK;
    if (snprintf(a->path, BENCH_PATH, "%s/directions-%lld.raw", b->work, (long long)n_edges) >= BENCH_PATH)
        return bench_fail(b, LOXO_ERR_ARGUMENT, "--work: the name is too long");
    return loxo_write_bytes(b->ctx, a->path, a->x, (size_t)n * sizeof *a->x);
}

static void close_batch(batch *a)
{
    loxo_release(a->b->ctx, a->x);
    for (int t = 0; t < a->b->n_threads; ++t) {
        loxo_release(a->b->ctx, a->out[t]);
        loxo_context_destroy(a->ctx[t]);
    }
}

static void add_row(bench *b, bench_table *table, const batch *a, const char *who, int n_threads, int n,
                    const double *rate, const double *ratio, const char *note)
{
    char text[2][64];
    const bench_stat stat = bench_stat_of(n, rate), to_one = bench_stat_of(n, ratio);
    bench_table_row(table, "%lld|%lld|%s|%d|%s|%s|%s", (long long)a->n_edges, (long long)a->n_polygons, who, n_threads,
                    bench_stat_text(stat, 1e-3, text[0], sizeof text[0]),
                    bench_stat_text(to_one, 1.0, text[1], sizeof text[1]), note);
    bench_record(b, "closing",
                 json_pack("{s:I, s:I, s:s, s:i, s:o, s:o, s:s}", "edges", (json_int_t)a->n_edges, "polygons",
                           (json_int_t)a->n_polygons, "who", who, "threads", n_threads, "polygons_per_second",
                           bench_stat_json(stat), "ratio_to_one_thread", bench_stat_json(to_one), "note", note));
}

/* Ours for each number of threads and peers with one, in turns; ratios round by round. */
static loxo_status measure_closing(bench *b, bench_table *table, int64_t n_edges, int64_t n_polygons, bool is_written)
{
    static double ours[BENCH_MAX_THREADS][BENCH_MAX_REPEATS], ratio[BENCH_MAX_THREADS][BENCH_MAX_REPEATS],
        theirs[BENCH_MAX_PEERS][BENCH_MAX_REPEATS], to_ours[BENCH_MAX_PEERS][BENCH_MAX_REPEATS];
    loxo_polygon_info info = {0};
    double first_wall = 1.0;
    bool is_same = true, has_run[BENCH_MAX_PEERS];
    char note[96], edges[32], nowhere[BENCH_PATH];
    batch a;
    loxo_status status = open_batch(b, n_edges, n_polygons, is_written, &a);
    for (int p = 0; p < b->n_peers; ++p)
        has_run[p] = true;
    snprintf(edges, sizeof edges, "%lld", (long long)n_edges);
    if (snprintf(nowhere, BENCH_PATH, "%.*s/closed.raw", BENCH_PATH - 16, b->work) < 0) status = LOXO_ERR_ARGUMENT;
    for (int k = -1; k < b->settings.repeats && status >= 0; ++k) { /* the warm-up is overwritten */
        const int at = k < 0 ? 0 : k;
        for (int t = 0; t < b->n_threads && status >= 0; ++t) {
            double wall = 1.0;
            ours[t][at] = (double)n_polygons / close_all(&a, t, &info, &wall, &status);
            if (t == 0) first_wall = wall;
            ratio[t][at] = first_wall / wall;
        }
        for (int p = 0; p < b->n_peers && status >= 0; ++p) {
            bench_peer_result peer;
            has_run[p] = has_run[p] && bench_peer_run(b, &b->peers[p], a.path, nowhere, 1, edges, &peer) >= 0;
            theirs[p][at] = has_run[p] ? (double)n_polygons / peer.seconds : 1.0;
            to_ours[p][at] = theirs[p][at] / ours[0][at];
        }
    }
    const size_t n_bytes = (size_t)n_polygons * (size_t)(is_written ? n_edges : 1) * 3 * sizeof(double);
    for (int t = 1; t < b->n_threads && status >= 0; ++t)
        is_same = is_same && memcmp(a.out[0], a.out[t], n_bytes) == 0;
    snprintf(note, sizeof note, "%s%lld certified, bound %.1e%s", is_written ? "written, " : "",
             (long long)(info.bound_max <= TOLERANCE ? info.n_closed : 0), info.bound_max,
             is_same ? "" : ", NOT THE SAME BITS");
    for (int t = 0; t < b->n_threads && status >= 0; ++t)
        add_row(b, table, &a, "loxo", b->threads[t], b->settings.repeats, ours[t], ratio[t], note);
    for (int p = 0; p < b->n_peers && status >= 0; ++p)
        if (has_run[p])
            add_row(b, table, &a, b->peers[p].name, 1, b->settings.repeats, theirs[p], to_ours[p], "");
        else
            bench_table_row(table, "%lld|%lld|%s||failed", (long long)n_edges, (long long)n_polygons, b->peers[p].name);
    close_batch(&a);
    return status;
}

static loxo_status closing(bench *b)
{
    static bench_table table; /* large */
    static const int64_t edges[] = {64, 1024, 100000};
    loxo_status status = LOXO_OK;
    bench_table_begin(&table, "edges|polygons|program|threads|thousands a second|of one thread of ours|");
    for (size_t i = 0; i < sizeof edges / sizeof edges[0] && status >= 0; ++i) {
        const int64_t few = b->settings.vertices / 50 / edges[i], many = 4 * b->settings.vertices / edges[i];
        for (int k = 0; k < 3 && status >= 0; ++k) { /* 1 MB with what is written, twice, and 192 MB */
            const int64_t n_polygons = k < 2 ? few : many;
            status = measure_closing(b, &table, edges[i],
                                     n_polygons > 8   ? n_polygons / 8 * 8
                                     : n_polygons > 0 ? n_polygons
                                                      : 1,
                                     k > 0);
        }
    }
    if (status < 0) return status;
    bench_say(b, "Equal edges of independent uniform directions in space, certified to 1e-12, and closed where it says "
                 "written. Seconds of one\nthread are processor time, a peer's as it tells them; ratios of threads are "
                 "by the clock.\n");
    bench_table_print(b, &table);
    return LOXO_OK;
}

/* ---- one measure of many atoms ---- */

static loxo_status many_atoms(bench *b)
{
    static bench_table table; /* large */
    const int64_t n = b->settings.largest;
    static loxo_barycenter_info info[BENCH_MAX_THREADS];
    double seconds[BENCH_MAX_REPEATS], share[BENCH_MAX_REPEATS];
    char text[2][64];
    loxo_barycenter_settings settings = loxo_barycenter_settings_default();
    settings.tolerance = TOLERANCE;
    double *x = loxo_allocate(b->ctx, 3 * n, sizeof *x);
    loxo_status status = x == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
    bench_table_begin(&table, "atoms|threads|seconds|reads|GB/s|% of triad|bound|same bits");
    if (status >= 0) bench_directions_many(b->threads[b->n_threads - 1], 2, 1.0, n, x);
    for (int t = 0; t < b->n_threads && status >= 0; ++t) {
        const loxo_atoms atoms = {.n = n, .d = 3, .x = x};
        loxo_context_settings own = loxo_context_settings_default();
        loxo_context *ctx = NULL;
        bench_triad triad;
        own.n_threads = b->threads[t];
        if ((status = loxo_context_create(&own, &ctx)) < 0) break;
        if ((status = bench_triad_open(b, b->threads[t], &triad)) < 0) {
            loxo_context_destroy(ctx);
            break;
        }
        double reads = 0.0;
        for (int k = -1; k < b->settings.repeats && status >= 0; ++k) { /* the warm-up is overwritten */
            const int at = k < 0 ? 0 : k;
            const double rate = bench_triad_run(&triad), start = now_s(b->threads[t]), clock = loxo_os_clock_s();
            status = loxo_barycenter(ctx, &atoms, &settings, &info[t]);
            seconds[at] = now_s(b->threads[t]) - start;
            const double wall = loxo_os_clock_s() - clock;
            reads =
                (double)info[t].n_iterations + 1.0; /* a look before each step and at the end; the first one checks */
            share[at] = 100.0 * 24e-9 * reads * (double)n / wall / rate;
        }
        bench_triad_close(b, &triad);
        loxo_context_destroy(ctx);
        if (status < 0) break;
        const bench_stat stat = bench_stat_of(b->settings.repeats, seconds),
                         of = bench_stat_of(b->settings.repeats, share);
        const bool is_same = memcmp(info[0].w, info[t].w, sizeof info[t].w) == 0;
        bench_table_row(&table, "%lld|%d|%s|%.0f|%.1f|%s|%.1e|%s", (long long)n, b->threads[t],
                        bench_stat_text(stat, 1.0, text[0], sizeof text[0]), reads,
                        24e-9 * reads * (double)n / stat.median, bench_stat_text(of, 1.0, text[1], sizeof text[1]),
                        info[t].bound, is_same ? "yes" : "NO");
        bench_record(b, "many_atoms",
                     json_pack("{s:I, s:i, s:o, s:f, s:o, s:f, s:b}", "atoms", (json_int_t)n, "threads", b->threads[t],
                               "seconds", bench_stat_json(stat), "reads", reads, "percent_of_triad",
                               bench_stat_json(of), "bound", info[t].bound, "same_bits", is_same));
    }
    loxo_release(b->ctx, x);
    if (status < 0) return status;
    bench_say(
        b, "Barycenter of one measure, atoms by von Mises and Fisher's density, kappa 1, tolerance 1e-12. Reads: one a "
           "look; the first checks the atoms.\n");
    bench_table_print(b, &table);
    return LOXO_OK;
}

/* ---- near the sphere ---- */

/* Steps and where they led: "7, 3e-17"; of what failed, why. */
static void describe(loxo_status status, const loxo_barycenter_info *info, double d, char text[BENCH_CELL])
{
    if (status == LOXO_OK && info->gap < 2.0 * d && info->gap > 0.5 * d)
        snprintf(text, BENCH_CELL, "%lld", (long long)info->n_iterations);
    else
        snprintf(text, BENCH_CELL, "fails after %lld: %s", (long long)info->n_iterations,
                 loxo_barycenter_stop_name(info->stop_reason));
}

static loxo_status near_the_sphere(bench *b)
{
    static bench_table table; /* large */
    static loxo_barycenter_info info[LOXO_BARYCENTER_N_METHODS];
    static const double e[3] = {0.48, 0.6, 0.64};
    double x[3 * 1000], y[3 * 1000];
    const int64_t n = 1000;
    loxo_status status = LOXO_OK;
    bench_directions(3, 0.0, 0, n, x);
    bench_table_begin(&table, "d|steps|residual|d found|bound|16 eps / d|regularized|newton|abikoff-ye");
    for (int k = 2; k <= 12 && status >= 0; k += 2) {
        const double d = pow(10.0, -k), away[3] = {-(1.0 - d) * e[0], -(1.0 - d) * e[1], -(1.0 - d) * e[2]};
        char text[LOXO_BARYCENTER_N_METHODS][BENCH_CELL];
        loxo_moebius map;
        const loxo_atoms atoms = {.n = n, .d = 3, .x = y};
        if ((status = loxo_moebius_set_identity(b->ctx, 3, &map)) < 0 ||
            (status = loxo_moebius_append_shift(b->ctx, &map, away, d * (2.0 - d))) < 0 ||
            (status = loxo_moebius_map_sphere(b->ctx, &map, n, x, y)) < 0)
            break;
        for (int m = 0; m < LOXO_BARYCENTER_N_METHODS && status >= 0; ++m) {
            loxo_barycenter_settings settings = loxo_barycenter_settings_default();
            settings.method = (loxo_barycenter_method)m;
            settings.max_iterations = 10000;
            status = loxo_barycenter(b->ctx, &atoms, &settings, &info[m]);
            describe(status, &info[m], d, text[m]);
        }
        const loxo_barycenter_info *ours = &info[LOXO_BARYCENTER_DAMPED];
        const double stated = 16.0 * 0x1p-52 / d;
        bench_table_row(&table, "%.0e|%s|%.1e|%.6e|%.2e|%.2e|%s|%s|%s", d, text[LOXO_BARYCENTER_DAMPED], ours->residual,
                        ours->gap, ours->bound, stated, text[LOXO_BARYCENTER_REGULARIZED], text[LOXO_BARYCENTER_NEWTON],
                        text[LOXO_BARYCENTER_ABIKOFF_YE]);
        bench_record(b, "near_the_sphere",
                     json_pack("{s:f, s:I, s:f, s:f, s:f, s:f, s:s, s:s, s:s}", "d", d, "steps",
                               (json_int_t)ours->n_iterations, "residual", ours->residual, "gap", ours->gap, "bound",
                               ours->bound, "stated", stated, "regularized", text[LOXO_BARYCENTER_REGULARIZED],
                               "newton", text[LOXO_BARYCENTER_NEWTON], "abikoff_ye", text[LOXO_BARYCENTER_ABIKOFF_YE]));
    }
    if (status < 0) return status;
    bench_say(b, "Near the sphere: 1000 uniform atoms about a centre that is moved to 1 - |w| = d; d found: of their "
                 "barycenter. Steps, residual and\nbound are of the method damped; the last columns are steps of the "
                 "others.\n");
    bench_table_print(b, &table);
    return LOXO_OK;
}

loxo_status bench_barycenter(bench *b)
{
    loxo_status status = near_the_sphere(b);
    if (status >= 0) status = closing(b);
    return status < 0 ? status : many_atoms(b);
}
