/* SPDX-License-Identifier: MIT
 * Figure 10: scans subdivided again and again, until only the edge-based method fits; and the exact method on the scans
 * themselves.
 * source  Tao et al. 2021, Parallel and Scalable Heat Methods, Fig. 10 */
#include "paper.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const char *const models[] = {"bunny", "igea", "armadillo", "kitten"};
#define N_MODELS (sizeof models / sizeof models[0])
/* The paper's largest has over 200 million vertices. */
#define MOST_VERTICES 215e6

/* Seconds and MB of each method on each mesh; NaN where it did not run. */
typedef struct marks {
    int n_methods;
    char method[PAPER_MAX_JOBS][48];
    double at[N_MODELS], seconds[PAPER_MAX_JOBS][N_MODELS], megabytes[PAPER_MAX_JOBS][N_MODELS];
} marks;

static loxo_status plot(bench *b, const marks *m, bool is_bytes)
{
    loxo_plot_series series[PAPER_MAX_JOBS];
    loxo_plot p = loxo_plot_default();
    for (int i = 0; i < m->n_methods; ++i)
        series[i] = (loxo_plot_series){.name = m->method[i],
                                       .style = LOXO_PLOT_POINTS,
                                       .n = N_MODELS,
                                       .x = m->at,
                                       .y = is_bytes ? m->megabytes[i] : m->seconds[i]};
    p.title = is_bytes ? "Figure 10: peak memory on subdivided meshes" : "Figure 10: time on subdivided meshes";
    p.x_title = "mesh";
    p.y_title = is_bytes ? "memory, MB" : "preparation and one solve, s";
    p.y_scale = LOXO_PLOT_LOG;
    p.n_x_names = N_MODELS;
    p.x_names = models;
    p.n_series = m->n_methods;
    p.series = series;
    return paper_plot(b, is_bytes ? "memory" : "time", &p);
}

/* The bottom row of the paper's figure: exact distances on the mesh that is subdivided. */
static loxo_status draw_base(bench *b, const char *name)
{
    const loxo_index source = 0;
    char title[128];
    paper_subject s;
    loxo_status status = paper_subject_open(b, name, 0.0, false, &s);
    if (status < 0) return status;
    snprintf(title, sizeof title, "%s, %lld vertices, exact", name, (long long)s.soup.n_vertices);
    if ((status = paper_subject_solve(&s, "exact", &source, 1, NULL)) >= 0) status = paper_picture(&s, name, title);
    paper_subject_close(&s);
    return status < 0 ? status : LOXO_OK;
}

static void add_rows(bench *b, bench_table *table, const paper_mesh *mesh, const paper_job *jobs, int n)
{
    for (int i = 0; i < n; ++i) {
        const paper_job *job = &jobs[i];
        char text[3][64], error[32];
        if (job->failure[0] != '\0')
            bench_table_row(table, "%s|%d|%lld|%s|%s", mesh->model->name, mesh->n_subdivisions,
                            (long long)mesh->n_vertices, job->method, job->failure);
        else
            bench_table_row(table, "%s|%d|%lld|%s|%s|%s|%s|%s|%s", mesh->model->name, mesh->n_subdivisions,
                            (long long)mesh->n_vertices, job->method,
                            bench_stat_text(job->total_s, 1.0, text[0], sizeof text[0]),
                            paper_number(1e-6 * job->peak_bytes.median, text[1], sizeof text[1]),
                            paper_number(job->peak_bytes.median / (double)mesh->n_vertices, text[2], sizeof text[2]),
                            paper_percent(job->error, error, sizeof error), job->note);
        bench_record(b, "fig10",
                     json_pack("{s:s, s:i, s:I, s:s, s:s, s:o, s:o, s:o}", "mesh", mesh->model->name, "subdivisions",
                               mesh->n_subdivisions, "n_vertices", (json_int_t)mesh->n_vertices, "method", job->method,
                               "failure", job->failure, "seconds", bench_stat_json(job->total_s), "peak_bytes",
                               bench_stat_json(job->peak_bytes), "mean_relative", paper_json(job->error)));
    }
}

static loxo_status measure(bench *b, int model, bench_table *table, marks *m)
{
    const char *name = models[model];
    static paper_job jobs[PAPER_MAX_JOBS]; /* large */
    const int n_threads = b->threads[b->n_threads - 1];
    const double most = fmin((double)b->settings.largest, MOST_VERTICES * b->settings.share);
    const char *methods[PAPER_MAX_METHODS];
    const int n_methods = paper_columns(b, methods);
    paper_mesh base, mesh;
    loxo_status status = paper_mesh_make(b, paper_model_find(name), 1.0, true, &base);
    if (status == LOXO_ERR_UNSUPPORTED) {
        bench_table_row(table, "%s|%s", name, bench_message(b));
        return LOXO_OK;
    }
    if (status < 0) return status;
    int n_subdivisions = 0;
    while ((double)base.n_vertices * pow(4.0, n_subdivisions + 1) <= most)
        n_subdivisions += 1;
    if (paper_has_method("exact")) {
        memset(jobs, 0, sizeof jobs);
        jobs[0].n_threads = n_threads;
        snprintf(jobs[0].method, sizeof jobs[0].method, "exact");
        if ((status = paper_rounds(b, &base, 1, jobs)) < 0) return status;
        add_rows(b, table, &base, jobs, 1);
        if (b->out != NULL && (status = draw_base(b, name)) < 0) return status;
    }
    status = paper_mesh_make(b, base.model, (double)base.n_vertices * pow(4.0, n_subdivisions), true, &mesh);
    if (status < 0) return status;
    int n = 0;
    memset(jobs, 0, sizeof jobs);
    for (int i = 0; i < n_methods; ++i) {
        if (strcmp(methods[i], "exact") == 0 || strncmp(methods[i], "variational", 11) == 0) continue;
        jobs[n].n_threads = n_threads;
        snprintf(jobs[n++].method, sizeof jobs[0].method, "%s", methods[i]);
    }
    n = paper_add_peers(b, n_threads, n, jobs);
    if ((status = paper_rounds(b, &mesh, n, jobs)) < 0) return status;
    add_rows(b, table, &mesh, jobs, n);
    m->n_methods = n;
    for (int i = 0; i < n; ++i) {
        snprintf(m->method[i], sizeof m->method[i], "%.*s", (int)sizeof m->method[i] - 1, jobs[i].method);
        if (jobs[i].failure[0] != '\0') continue;
        m->seconds[i][model] = jobs[i].total_s.median;
        m->megabytes[i][model] = 1e-6 * jobs[i].peak_bytes.median;
    }
    return LOXO_OK;
}

loxo_status paper_tao2021_fig10(bench *b)
{
    static bench_table table; /* large */
    static marks m;
    loxo_status status = LOXO_OK;
    for (size_t k = 0; k < N_MODELS; ++k) {
        m.at[k] = (double)k;
        for (int i = 0; i < PAPER_MAX_JOBS; ++i)
            m.seconds[i][k] = m.megabytes[i][k] = (double)NAN;
    }
    static const int width[] = {9, 10, 9, 28, 20, 7, 8, 13, 20};
    bench_table_begin_live(b, &table, "mesh|subdivided|vertices|method|seconds|RAM, MB|B/vertex|error, eq. 29|", width);
    for (int i = 0; i < (int)N_MODELS && status >= 0; ++i) {
        if (!paper_wants(b, models[i])) continue;
        status = measure(b, i, &table, &m);
        if (status >= 0) status = paper_keep(b);
    }
    if (status < 0) return status;
    bench_say(b, "\n");
    bench_say(b,
              "Paper: the edge-based method on subdivided models of over 200 million vertices on 128 GB, where its\n"
              "face-based one runs out of memory; numbers in the picture only. What differs: our scans; as large as\n"
              "--largest (%lld) and the memory allow; the face-based method and the others are run where they fit.\n",
              (long long)b->settings.largest);
    status = plot(b, &m, false);
    return status < 0 ? status : plot(b, &m, true);
}
