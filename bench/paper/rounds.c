/* SPDX-License-Identifier: MIT
 * Solves of one mesh by several methods and peers in turns, so that what else the machine does hits all of them alike. */
#include "base/os.h"
#include "paper.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* Samples of one job, round by round. */
typedef struct samples {
    int n, n_ratios;
    double used_s; /* with reading and all */
    double total[BENCH_MAX_REPEATS], create[BENCH_MAX_REPEATS], solve[BENCH_MAX_REPEATS], peak[BENCH_MAX_REPEATS];
    double ratio[BENCH_MAX_REPEATS], phase[LOXO_GEODESIC_N_PHASES][BENCH_MAX_REPEATS];
} samples;

void paper_method_text(const char *method, char *text, size_t size)
{
    snprintf(text, size, "%s%s", method, strstr(method, "recovery=") != NULL ? "" : ",recovery=admm");
}

loxo_status paper_method_settings(bench *b, const char *method, loxo_geodesic_settings *settings)
{
    char text[BENCH_PATH];
    paper_method_text(method, text, sizeof text);
    return bench_method_settings(b, text, settings);
}

int paper_add_peers(const bench *b, int n_threads, int n_jobs, paper_job jobs[PAPER_MAX_JOBS])
{
    for (int i = 0; i < b->n_peers && n_jobs < PAPER_MAX_JOBS; ++i) {
        if (n_threads > 1 && strstr(b->peers[i].command, "{threads}") == NULL) continue; /* it runs as it likes */
        jobs[n_jobs] = (paper_job){.peer = &b->peers[i], .n_threads = n_threads};
        snprintf(jobs[n_jobs].method, sizeof jobs[n_jobs].method, "%s", b->peers[i].name);
        n_jobs += 1;
    }
    return n_jobs;
}

/* Why the last child ended. */
static void note_failure(const bench *b, paper_job *job)
{
    for (int status = LOXO_ERR_ARGUMENT; status >= LOXO_ERR_STOPPED; --status)
        if (b->child_exit > 0 && loxo_status_exit_code((loxo_status)status) == b->child_exit) {
            snprintf(job->failure, sizeof job->failure, "%s", loxo_status_text((loxo_status)status));
            return;
        }
    snprintf(job->failure, sizeof job->failure, "exit code %d", b->child_exit);
}

static loxo_status our_round(bench *b, const paper_mesh *mesh, paper_job *job, samples *s, int k)
{
    char out[BENCH_PATH + 32] = "-";
    json_t *result = NULL;
    char method[BENCH_PATH];
    paper_method_text(job->method, method, sizeof method);
    if (k == 0 && mesh->truth[0] != '\0') snprintf(out, sizeof out, "%s/job.npy", b->work);
    loxo_status status = bench_worker_run(b, job->n_threads,
                                          (const char *const[]){"solve", mesh->path, method, "1", out, NULL}, &result);
    if (status < 0) {
        note_failure(b, job);
        return b->child_exit >= 128 ? status : LOXO_OK; /* what a signal ended, ends us */
    }
    const json_t *solve = json_array_get(json_object_get(result, "solves"), 0);
    s->create[k] = bench_number(result, "create_s");
    s->solve[k] = bench_number(solve, "solve_s");
    s->total[k] = s->create[k] + s->solve[k];
    s->peak[k] = bench_number(result, "peak_bytes");
    for (int p = 0; p < LOXO_GEODESIC_N_PHASES; ++p)
        s->phase[p][k] = bench_number(solve, loxo_geodesic_phase_name((loxo_geodesic_phase)p));
    const char *said = json_string_value(json_object_get(result, "status"));
    snprintf(job->note, sizeof job->note, "%s", said == NULL || strcmp(said, "LOXO_OK") == 0 ? "" : said);
    job->updates = bench_number(result, "n_updates") / (double)mesh->n_vertices;
    json_decref(result);
    if (k != 0 || out[0] == '-') return LOXO_OK;
    job->error = paper_error(b, mesh, out);
    unlink(out);
    return LOXO_OK;
}

/* A peer's distances are turned into a file of ours for the comparison. */
static loxo_status peer_round(bench *b, const paper_mesh *mesh, paper_job *job, samples *s, const char *method, int k)
{
    char out[BENCH_PATH + 32], own[BENCH_PATH + 32], name[128];
    bench_peer_result result;
    double *distance = NULL;
    snprintf(out, sizeof out, "%s/peer.out", b->work);
    snprintf(own, sizeof own, "%s/peer.npy", b->work);
    snprintf(name, sizeof name, "%.*s", (int)strcspn(method, ","), method);
    if (bench_peer_run(b, job->peer, mesh->path, out, job->n_threads, name, &result) < 0) {
        bench_say(b, "%s\n", bench_message(b));
        snprintf(job->failure, sizeof job->failure, "it failed");
        return LOXO_OK;
    }
    s->total[k] = s->solve[k] = result.seconds;
    s->create[k] = (double)NAN;
    s->peak[k] = result.peak_bytes > 0 ? (double)result.peak_bytes : (double)NAN;
    if (k != 0 || mesh->truth[0] == '\0') return LOXO_OK;
    if (!result.has_written) {
        bench_say(b, "%s: wrote no distances to %s: their error is not known\n", job->peer->name, out);
        return LOXO_OK;
    }
    loxo_status status = bench_read_distances(b, out, mesh->n_vertices, &distance);
    if (status == LOXO_ERR_MALFORMED || status == LOXO_ERR_READ) { /* the others' rows are worth having all the same */
        bench_say(b, "%s: %s: their error is not known\n", job->peer->name, bench_message(b));
        return LOXO_OK;
    }
    if (status >= 0) status = loxo_write_field(b->ctx, own, "distance", distance, mesh->n_vertices, NULL);
    loxo_release(b->ctx, distance);
    if (status >= 0) job->error = paper_error(b, mesh, own);
    unlink(out);
    unlink(own);
    return status;
}

/* Whether it is to be run; failure says why not. */
static bool fits(bench *b, const paper_mesh *mesh, paper_job *job)
{
    if (job->peer != NULL) return true;
    const size_t bytes = paper_predict_bytes(b, job->method, mesh->n_vertices, mesh->n_faces);
    if (bytes > paper_memory_limit(b)) {
        snprintf(job->failure, sizeof job->failure, "out of memory, %zu bytes predicted", bytes);
        return false;
    }
    if (job->predicted_s == 0.0) job->predicted_s = paper_predict_seconds(b, mesh, job->method, job->n_threads);
    if (!(job->predicted_s > b->settings.solve_seconds)) return true;
    snprintf(job->failure, sizeof job->failure, "not run: one solve is predicted %.0f s", job->predicted_s);
    return false;
}

static loxo_status run_job(bench *b, const paper_mesh *mesh, paper_job *job, samples *s, const char *first_method)
{
    const double start_s = loxo_os_clock_s();
    const loxo_status status =
        job->peer == NULL ? our_round(b, mesh, job, s, s->n) : peer_round(b, mesh, job, s, first_method, s->n);
    s->used_s += loxo_os_clock_s() - start_s;
    if (status >= 0 && job->failure[0] == '\0') s->n += 1;
    return status;
}

static void conclude(const bench *b, paper_job *job, const samples *s)
{
    const size_t used = strlen(job->note);
    job->total_s = bench_stat_of(s->n, s->total);
    job->create_s = bench_stat_of(s->n, s->create);
    job->solve_s = bench_stat_of(s->n, s->solve);
    job->peak_bytes = bench_stat_of(s->n, s->peak);
    if (s->n_ratios > 0) job->ratio = bench_stat_of(s->n_ratios, s->ratio);
    for (int p = 0; p < LOXO_GEODESIC_N_PHASES && job->peer == NULL; ++p)
        job->phase_s[p] = bench_stat_of(s->n, s->phase[p]);
    if (s->n < b->settings.repeats)
        snprintf(job->note + used, sizeof job->note - used, "%s%d round%s", used > 0 ? ", " : "", s->n,
                 s->n == 1 ? "" : "s");
}

loxo_status paper_rounds(bench *b, const paper_mesh *mesh, int n_jobs, paper_job *jobs)
{
    static samples all[PAPER_MAX_JOBS]; /* large */
    for (int j = 0; j < n_jobs; ++j) {
        jobs[j].failure[0] = jobs[j].note[0] = '\0';
        jobs[j].error = jobs[j].updates = (double)NAN;
        jobs[j].ratio = (bench_stat){(double)NAN, (double)NAN, (double)NAN, 0};
        all[j].n = all[j].n_ratios = 0;
        all[j].used_s = 0.0;
        (void)fits(b, mesh, &jobs[j]);
    }
    for (int k = 0; k < b->settings.repeats; ++k)
        for (int j = 0; j < n_jobs; ++j) {
            samples *s = &all[j];
            if (jobs[j].failure[0] != '\0' || (k > 0 && s->used_s > b->settings.solve_seconds)) continue;
            const loxo_status status = run_job(b, mesh, &jobs[j], s, jobs[0].method);
            if (status < 0) return status;
            if (jobs[j].failure[0] == '\0' && all[0].n == k + 1) /* the first ran in this round, too */
                s->ratio[s->n_ratios++] = s->total[k] / all[0].total[k];
        }
    for (int j = 0; j < n_jobs; ++j)
        if (jobs[j].failure[0] == '\0') conclude(b, &jobs[j], &all[j]);
    return LOXO_OK;
}
