/* SPDX-License-Identifier: MIT
 * Time and memory: a mesh in memory to distances, every round in a process of its own, peers in turns with us. */
#include "bench.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

typedef enum quantity {
    READ,
    MESH,
    CREATE,
    FIRST,
    AGAIN,
    JOB,
    PEAK, /* JOB: CREATE + FIRST */
    PHASE_FIRST,
    PHASE_AGAIN = PHASE_FIRST + LOXO_GEODESIC_N_PHASES,
    N_QUANTITIES = PHASE_AGAIN + LOXO_GEODESIC_N_PHASES
} quantity;

typedef struct peer_samples {
    double seconds[BENCH_MAX_REPEATS], ratio[BENCH_MAX_REPEATS], diffusion_ratio[BENCH_MAX_REPEATS];
    double bytes;
} peer_samples;

typedef struct measurement {
    bench *b;
    const bench_case *c;
    const char *method;
    int n_threads;
    char mesh[BENCH_PATH];
    double n_vertices, error;
    char status[64];
    double sample[N_QUANTITIES][BENCH_MAX_REPEATS];
    peer_samples peer[BENCH_MAX_PEERS];
    double peer_error[BENCH_MAX_PEERS];
} measurement;

static bench_stat stat_of(const measurement *m, int q) { return bench_stat_of(m->b->settings.repeats, m->sample[q]); }

/* Mean relative error of the distances in a file, by a child so that this process stays small; NaN where the truth is
 * not known. */
static double error_of(bench *b, const bench_case *c, const char *file)
{
    json_t *result = NULL;
    if (b->settings.source != 0 || (!c->has_closed_form && c->exact == NULL)) return NAN;
    const loxo_status status = bench_worker_run(b, 1, (const char *const[]){"error", c->name, file, NULL}, &result);
    const double error = status < 0 ? (double)NAN : bench_number(result, "mean_relative");
    json_decref(result);
    return error;
}

static loxo_status our_round(measurement *m, int k, const char *out)
{
    json_t *result = NULL;
    const loxo_status status = bench_worker_run(
        m->b, m->n_threads, (const char *const[]){"solve", m->mesh, m->method, "2", out, NULL}, &result);
    if (status < 0) return status;
    const json_t *solves = json_object_get(result, "solves");
    const json_t *first = json_array_get(solves, 0), *again = json_array_get(solves, 1);
    const char *said = json_string_value(json_object_get(result, "status"));
    m->n_vertices = bench_number(result, "n_vertices");
    snprintf(m->status, sizeof m->status, "%s", said != NULL ? said : "?");
    m->sample[READ][k] = bench_number(result, "read_s");
    m->sample[MESH][k] = bench_number(result, "mesh_s");
    m->sample[CREATE][k] = bench_number(result, "create_s");
    m->sample[FIRST][k] = bench_number(first, "solve_s");
    m->sample[AGAIN][k] = bench_number(again, "solve_s");
    m->sample[JOB][k] = m->sample[CREATE][k] + m->sample[FIRST][k];
    m->sample[PEAK][k] = bench_number(result, "peak_bytes");
    for (int p = 0; p < LOXO_GEODESIC_N_PHASES; ++p) {
        const char *name = loxo_geodesic_phase_name((loxo_geodesic_phase)p);
        m->sample[PHASE_FIRST + p][k] = bench_number(first, name);
        m->sample[PHASE_AGAIN + p][k] = bench_number(again, name);
    }
    json_decref(result);
    return LOXO_OK;
}

/* Peers that cannot be told the number of threads run beside our one-thread rows only. */
static bool peer_runs(const measurement *m, const bench_peer *peer)
{
    return m->n_threads == 1 || strstr(peer->command, "{threads}") != NULL;
}

static loxo_status peer_round(measurement *m, int k, int i)
{
    char out[BENCH_PATH + 32];
    bench_peer_result result;
    peer_samples *p = &m->peer[i];
    snprintf(out, sizeof out, "%s/peer%d.out", m->b->work, i);
    const loxo_status status = bench_peer_run(m->b, &m->b->peers[i], m->mesh, out, m->n_threads, m->method, &result);
    if (status < 0) return status;
    p->seconds[k] = result.seconds;
    p->ratio[k] = result.seconds / m->sample[JOB][k];
    const double own_s = m->sample[PHASE_FIRST + LOXO_GEODESIC_PHASE_DIFFUSION][k]; /* 0: a method without */
    p->diffusion_ratio[k] = own_s > 0.0 ? result.diffusion_s / own_s : (double)NAN;
    p->bytes = (double)result.peak_bytes;
    if (k > 0) return LOXO_OK;
    m->peer_error[i] = result.has_written ? error_of(m->b, m->c, out) : (double)NAN;
    if (!result.has_written)
        bench_say(m->b, "%s: wrote no distances to %s: their error is not known\n", m->b->peers[i].name, out);
    return LOXO_OK;
}

/* A warm-up round of ours, then rounds A B A B. */
static loxo_status run_rounds(measurement *m)
{
    char out[BENCH_PATH + 32];
    snprintf(out, sizeof out, "%s/ours.npy", m->b->work);
    loxo_status status = our_round(m, 0, out);
    if (status < 0) return status;
    m->error = error_of(m->b, m->c, out);
    for (int k = 0; k < m->b->settings.repeats; ++k) {
        if ((status = our_round(m, k, "-")) < 0) return status;
        for (int i = 0; i < m->b->n_peers; ++i)
            if (peer_runs(m, &m->b->peers[i]) && (status = peer_round(m, k, i)) < 0) return status;
    }
    return LOXO_OK;
}

static const char *percent(double share, char *text, size_t n)
{
    snprintf(text, n, isnan(share) ? "-" : "%.4f %%", 100.0 * share);
    return text;
}

static void show_peer(const measurement *m, bench_table *table, int i)
{
    const peer_samples *p = &m->peer[i];
    const int n = m->b->settings.repeats;
    char seconds[64], ratio[64], diffusion[64], error[32], bytes[32];
    const bench_stat s = bench_stat_of(n, p->seconds), r = bench_stat_of(n, p->ratio),
                     d = bench_stat_of(n, p->diffusion_ratio);
    snprintf(bytes, sizeof bytes, p->bytes > 0.0 ? "%.0f" : "-", p->bytes / m->n_vertices);
    bench_table_row(table, "%s|%s|%d|%s|%s|%s|%s|%s|%s", m->c->name, m->method, m->n_threads, m->b->peers[i].name,
                    bench_stat_text(s, 1.0, seconds, sizeof seconds), bytes,
                    percent(m->peer_error[i], error, sizeof error), bench_stat_text(r, 1.0, ratio, sizeof ratio),
                    bench_stat_text(d, 1.0, diffusion, sizeof diffusion));
    bench_record(m->b, "peers",
                 json_pack("{s:s, s:s, s:i, s:s, s:o, s:o, s:o, s:f}", "case", m->c->name, "method", m->method,
                           "threads", m->n_threads, "peer", m->b->peers[i].name, "seconds", bench_stat_json(s), "ratio",
                           bench_stat_json(r), "diffusion_ratio", bench_stat_json(d), "peak_bytes", p->bytes));
}

static void show(const measurement *m, bench_table *times, bench_table *phases, bench_table *peers)
{
    char a[4][64], error[32];
    json_t *row = json_pack("{s:s, s:s, s:i, s:f, s:s}", "case", m->c->name, "method", m->method, "threads",
                            m->n_threads, "n_vertices", m->n_vertices, "status", m->status);
    static const char *const keys[] = {"read_s", "mesh_s", "create_s", "first_s", "again_s", "job_s", "peak_bytes"};
    for (int q = READ; q <= PEAK; ++q)
        json_object_set_new(row, keys[q], bench_stat_json(stat_of(m, q)));
    bench_table_row(times, "%s|%.0f|%s|%d|%s|%s|%s|%s|%.1f|%s|%s", m->c->name, m->n_vertices, m->method, m->n_threads,
                    bench_stat_text(stat_of(m, MESH), 1.0, a[0], sizeof a[0]),
                    bench_stat_text(stat_of(m, CREATE), 1.0, a[1], sizeof a[1]),
                    bench_stat_text(stat_of(m, FIRST), 1.0, a[2], sizeof a[2]),
                    bench_stat_text(stat_of(m, AGAIN), 1.0, a[3], sizeof a[3]), stat_of(m, PEAK).median / m->n_vertices,
                    percent(m->error, error, sizeof error), m->status);
    for (int p = 0; p < LOXO_GEODESIC_N_PHASES; ++p) {
        const bench_stat first = stat_of(m, PHASE_FIRST + p), again = stat_of(m, PHASE_AGAIN + p);
        const char *name = loxo_geodesic_phase_name((loxo_geodesic_phase)p);
        bench_table_row(phases, "%s|%s|%d|%s|%s|%s|%.1f", m->c->name, m->method, m->n_threads, name,
                        bench_stat_text(first, 1e3, a[0], sizeof a[0]), bench_stat_text(again, 1e3, a[1], sizeof a[1]),
                        1e9 * again.median / m->n_vertices);
        json_object_set_new(row, name, bench_stat_json(first));
    }
    if (!isnan(m->error)) json_object_set_new(row, "mean_relative", json_real(m->error));
    bench_record(m->b, "time", row);
    for (int i = 0; i < m->b->n_peers; ++i)
        if (peer_runs(m, &m->b->peers[i])) show_peer(m, peers, i);
}

static loxo_status measure_case(bench *b, const bench_case *c, bench_table *times, bench_table *phases,
                                bench_table *peers)
{
    static measurement m; /* large */
    m = (measurement){.b = b, .c = c};
    loxo_status status = bench_case_path(b, c, m.mesh);
    for (int i = 0; i < b->n_methods && status >= 0; ++i) {
        double one = NAN;
        m.method = b->methods[i];
        for (int t = 0; t < b->n_threads && status >= 0; ++t) {
            m.n_threads = b->threads[t];
            if ((status = run_rounds(&m)) < 0) break;
            show(&m, times, phases, peers);
            if (m.n_threads == 1) one = stat_of(&m, AGAIN).median;
            if (m.n_threads > 1 && !isnan(one))
                printf("%s, %s: %d threads are %.2f times one\n", c->name, m.method, m.n_threads,
                       one / stat_of(&m, AGAIN).median);
        }
    }
    return status;
}

loxo_status bench_time(bench *b)
{
    static bench_table times, phases, peers; /* large */
    bench_table_begin(&times, "case|vertices|method|threads|half-edges, s|create, s|first solve, s|again, s|"
                              "peak B/vertex|error, eq. 29|status");
    bench_table_begin(&phases, "case|method|threads|phase|first solve, ms|again, ms|ns/vertex");
    bench_table_begin(&peers, "case|method|threads|peer|its seconds|B/vertex|error, eq. 29|its time / ours|"
                              "its diffusion / ours");
    for (int i = 0; i < bench_n_cases(b); ++i) {
        const bench_case c = bench_case_get(b, i);
        if (!bench_case_wanted(b, &c, BENCH_TIME)) continue;
        if (!bench_case_present(b, &c)) {
            bench_table_row(&times, "%s|skipped: no mesh here", c.name);
            continue;
        }
        const loxo_status status = measure_case(b, &c, &times, &phases, &peers);
        if (status < 0) return status;
    }
    putchar('\n');
    bench_table_print(b, &times);
    bench_table_print(b, &phases);
    if (b->n_peers > 0) {
        bench_table_print(b, &peers);
        puts("its time / ours: peer's seconds over our create and first solve, round by round; reading and half-edges "
             "are in neither.");
    }
    puts("first solve: on memory never touched before; again: the same solve once more. peak: of the whole process,\n"
         "file reading included. The paper, Table 1, Triomphe, 997,635 vertices, 8 threads at 3.6 GHz: edge 2.06 s,\n"
         "543 MB, 0.77 %; face 3.44 s, 1,071 MB, 0.48 %.");
    return LOXO_OK;
}
