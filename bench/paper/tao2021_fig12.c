/* SPDX-License-Identifier: MIT
 * Figure 12: the four steps of the face-based method for each number of threads, with the paper's 600 sweeps and 10
 * iterations; and the same with our marching window.
 * source  Tao et al. 2021, Parallel and Scalable Heat Methods, Fig. 12 */
#include "paper.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const struct {
    const char *model;
    double n_vertices;
} subjects[] = {{"igea", 134345.0}, {"armadillo", 50000.0}, {"bumpy", 250000.0}, {"brain", 500000.0}};
#define N_SUBJECTS (sizeof subjects / sizeof subjects[0])

static const char *const diffusions[2] = {"face,diffusion=sweeps,sweeps=600", "face"};
static const char *const diffusion_names[2] = {"600 sweeps", "marching"};

enum { INITIALISE, DIFFUSE, OPTIMISE, INTEGRATE, N_STEPS };
static const char *const step_names[N_STEPS] = {"initialisation", "heat diffusion", "gradient optimisation",
                                                "integration"};

#define MOST_COLUMNS ((int)N_SUBJECTS * BENCH_MAX_THREADS)

typedef struct columns {
    int n;
    char name[MOST_COLUMNS][32];
    double at[MOST_COLUMNS], foot[N_STEPS][MOST_COLUMNS], top[N_STEPS][MOST_COLUMNS];
} columns;

/* The paper's steps from our phases: what is ready before heat flows is initialisation. */
static void steps_of(const paper_job *job, double step[N_STEPS])
{
    const bench_stat *p = job->phase_s;
    step[INITIALISE] = job->create_s.median + p[LOXO_GEODESIC_PHASE_LEVELS].median;
    step[DIFFUSE] = p[LOXO_GEODESIC_PHASE_DIFFUSION].median;
    step[OPTIMISE] = p[LOXO_GEODESIC_PHASE_GRADIENT].median + p[LOXO_GEODESIC_PHASE_ADMM].median;
    step[INTEGRATE] = p[LOXO_GEODESIC_PHASE_INTEGRATE].median;
}

static loxo_status plot(bench *b, const columns *c, int diffusion)
{
    char title[128];
    const char *names[MOST_COLUMNS];
    loxo_plot_series series[N_STEPS];
    loxo_plot p = loxo_plot_default();
    for (int i = 0; i < c->n; ++i)
        names[i] = c->name[i];
    for (int k = 0; k < N_STEPS; ++k)
        series[k] = (loxo_plot_series){.name = step_names[k],
                                       .style = LOXO_PLOT_COLUMNS,
                                       .n = c->n,
                                       .x = c->at,
                                       .y = c->top[k],
                                       .low = c->foot[k]};
    snprintf(title, sizeof title, "Figure 12: steps of the face-based method, %s", diffusion_names[diffusion]);
    p.title = title;
    p.x_title = "mesh, threads";
    p.y_title = "time, s";
    p.n_x_names = c->n;
    p.x_names = names;
    p.n_series = N_STEPS;
    p.series = series;
    return paper_plot(b, diffusion == 0 ? "sweeps" : "marching", &p);
}

/* The same mesh with every number of threads, in turns. */
static loxo_status measure(bench *b, size_t subject, int diffusion, bench_table *table, columns *c)
{
    static paper_job jobs[PAPER_MAX_JOBS]; /* large */
    paper_mesh mesh;
    const paper_model *model = paper_model_find(subjects[subject].model);
    const double n_wanted = subjects[subject].n_vertices * (model->file == NULL ? b->settings.share : 1.0);
    loxo_status status = paper_mesh_make(b, model, n_wanted, false, &mesh);
    if (status == LOXO_ERR_UNSUPPORTED) {
        if (paper_wants(b, model->name)) bench_table_row(table, "%s|%s", model->name, bench_message(b));
        return LOXO_OK;
    }
    if (status < 0) return status;
    memset(jobs, 0, sizeof jobs);
    for (int t = 0; t < b->n_threads; ++t) {
        jobs[t].n_threads = b->threads[t];
        snprintf(jobs[t].method, sizeof jobs[t].method, "%s", diffusions[diffusion]);
    }
    if ((status = paper_rounds(b, &mesh, b->n_threads, jobs)) < 0) return status;
    for (int t = 0; t < b->n_threads; ++t) {
        double step[N_STEPS], sum = 0.0;
        char text[N_STEPS][48], total[64];
        if (jobs[t].failure[0] != '\0') {
            bench_table_row(table, "%s|%lld|%s|%d|%s", model->name, (long long)mesh.n_vertices,
                            diffusion_names[diffusion], b->threads[t], jobs[t].failure);
            continue;
        }
        steps_of(&jobs[t], step);
        const int column = c->n++;
        snprintf(c->name[column], sizeof c->name[column], "%s %d", model->name, b->threads[t]);
        c->at[column] = column;
        for (int k = 0; k < N_STEPS; ++k) {
            c->foot[k][column] = sum;
            sum += step[k];
            c->top[k][column] = sum;
        }
        for (int k = 0; k < N_STEPS; ++k)
            snprintf(text[k], sizeof text[k], "%.4f (%.0f %%)", step[k], 100.0 * step[k] / sum);
        bench_table_row(table, "%s|%lld|%s|%d|%s|%s|%s|%s|%s|%.2f", model->name, (long long)mesh.n_vertices,
                        diffusion_names[diffusion], b->threads[t], text[0], text[1], text[2], text[3],
                        bench_stat_text(jobs[t].total_s, 1.0, total, sizeof total),
                        jobs[0].total_s.median / jobs[t].total_s.median);
        bench_record(b, "fig12",
                     json_pack("{s:s, s:I, s:s, s:i, s:f, s:f, s:f, s:f, s:o}", "mesh", model->name, "n_vertices",
                               (json_int_t)mesh.n_vertices, "diffusion", diffusion_names[diffusion], "threads",
                               b->threads[t], step_names[0], step[0], step_names[1], step[1], step_names[2], step[2],
                               step_names[3], step[3], "seconds", bench_stat_json(jobs[t].total_s)));
    }
    return LOXO_OK;
}

loxo_status paper_tao2021_fig12(bench *b)
{
    static bench_table table; /* large */
    static columns c;
    loxo_status status = LOXO_OK;
    bench_table_begin(&table, "mesh|vertices|diffusion|threads|initialisation|heat diffusion|gradient optimisation|"
                              "integration|in all, s|faster than the first");
    for (int d = 0; d < 2 && status >= 0; ++d) {
        memset(&c, 0, sizeof c);
        for (size_t i = 0; i < N_SUBJECTS && status >= 0; ++i)
            status = measure(b, i, d, &table, &c);
        if (status >= 0) status = plot(b, &c, d);
    }
    if (status < 0) return status;
    bench_table_print(b, &table);
    bench_say(b,
              "Paper: four models on 1, 2, 4 and 8 threads; time «approximately inversely proportional» to their "
              "number, the\n"
              "sequential initialisation a small share; percentages in the picture only. What differs: other meshes;\n"
              "initialisation holds the rows of the heat system, which we make once for all sources; «in all» also\n"
              "holds the check of the answer, which the paper has not.\n");
    return LOXO_OK;
}
