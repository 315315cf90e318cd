/* SPDX-License-Identifier: MIT
 * Figure 11: time and peak memory against the number of vertices, three shapes, all methods.
 * source  Tao et al. 2021, Parallel and Scalable Heat Methods, Fig. 11 */
#include "paper.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const char *const models[] = {"bumpy", "igea", "brain"};
#define N_MODELS   (sizeof models / sizeof models[0])
#define SMALLEST   134345.0 /* igea as it is; others alike, each next one four times as large */
#define MOST_SIZES 8
#define MOST_LINES PAPER_MAX_JOBS

typedef struct curves {
    int n_sizes, n_lines;
    char name[MOST_LINES][64];
    double size[MOST_SIZES], time[MOST_LINES][3][MOST_SIZES], bytes[MOST_LINES][MOST_SIZES]; /* time: median min max */
} curves;

static loxo_status plot(bench *b, const char *model, const curves *c, bool is_bytes)
{
    char title[128], suffix[64];
    loxo_plot_series series[MOST_LINES];
    loxo_plot p = loxo_plot_default();
    for (int i = 0; i < c->n_lines; ++i) {
        series[i] = (loxo_plot_series){.name = c->name[i], .style = LOXO_PLOT_BOTH, .n = c->n_sizes, .x = c->size};
        series[i].y = is_bytes ? c->bytes[i] : c->time[i][0];
        if (!is_bytes) series[i].low = c->time[i][1], series[i].high = c->time[i][2];
    }
    snprintf(title, sizeof title, "Figure 11: %s, %s", is_bytes ? "peak memory" : "preparation and one solve", model);
    snprintf(suffix, sizeof suffix, "%s-%s", is_bytes ? "memory" : "time", model);
    p.title = title;
    p.x_title = "vertices";
    p.y_title = is_bytes ? "memory, MB" : "time, s";
    p.x_scale = p.y_scale = LOXO_PLOT_LOG;
    p.n_series = c->n_lines;
    p.series = series;
    return paper_plot(b, suffix, &p);
}

/* Least squares of log y over log x; NaN with fewer than two points. */
static double exponent_of(int n, const double *x, const double *y)
{
    double sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0, count = 0.0;
    for (int i = 0; i < n; ++i) {
        if (!(y[i] > 0.0)) continue;
        const double a = log(x[i]), c = log(y[i]);
        sx += a, sy += c, sxx += a * a, sxy += a * c, count += 1.0;
    }
    return count < 2.0 ? (double)NAN : (count * sxy - sx * sy) / (count * sxx - sx * sx);
}

static loxo_status measure_size(bench *b, const paper_model *model, double n_wanted, bench_table *table, curves *c)
{
    static paper_job jobs[PAPER_MAX_JOBS]; /* large */
    const int n_threads = b->threads[b->n_threads - 1];
    const char *methods[PAPER_MAX_METHODS];
    const int n_methods = paper_columns(b, methods);
    paper_mesh mesh;
    int n = 0;
    loxo_status status = paper_mesh_make(b, model, n_wanted, model->file != NULL, &mesh);
    if (status < 0) return status;
    memset(jobs, 0, sizeof jobs);
    for (; n < n_methods; ++n) {
        jobs[n].n_threads = n_threads;
        snprintf(jobs[n].method, sizeof jobs[n].method, "%s", methods[n]);
    }
    n = paper_add_peers(b, n_threads, n, jobs);
    if ((status = paper_rounds(b, &mesh, n, jobs)) < 0) return status;
    const int at = c->n_sizes++;
    c->n_lines = n;
    c->size[at] = (double)mesh.n_vertices;
    for (int i = 0; i < n; ++i) {
        const paper_job *job = &jobs[i];
        char text[4][64], error[32];
        snprintf(c->name[i], sizeof c->name[i], "%s", job->method);
        c->time[i][0][at] = c->time[i][1][at] = c->time[i][2][at] = c->bytes[i][at] = (double)NAN;
        if (job->failure[0] != '\0') {
            bench_table_row(table, "%s|%lld|%s|%s", model->name, (long long)mesh.n_vertices, job->method, job->failure);
        } else {
            c->time[i][0][at] = job->total_s.median;
            c->time[i][1][at] = job->total_s.min;
            c->time[i][2][at] = job->total_s.max;
            c->bytes[i][at] = 1e-6 * job->peak_bytes.median;
            bench_table_row(table, "%s|%lld|%s|%s|%.0f|%s|%s|%s|%s|%s", model->name, (long long)mesh.n_vertices,
                            job->method, bench_stat_text(job->total_s, 1.0, text[0], sizeof text[0]),
                            1e9 * job->total_s.median / (double)mesh.n_vertices,
                            paper_number(c->bytes[i][at], text[2], sizeof text[2]),
                            paper_number(job->peak_bytes.median / (double)mesh.n_vertices, text[3], sizeof text[3]),
                            bench_stat_text(job->ratio, 1.0, text[1], sizeof text[1]),
                            paper_percent(job->error, error, sizeof error), job->note);
        }
        bench_record(b, "fig11",
                     json_pack("{s:s, s:I, s:s, s:s, s:o, s:o, s:o}", "mesh", model->name, "n_vertices",
                               (json_int_t)mesh.n_vertices, "method", job->method, "failure", job->failure, "seconds",
                               bench_stat_json(job->total_s), "peak_bytes", bench_stat_json(job->peak_bytes),
                               "mean_relative", paper_json(job->error)));
    }
    return LOXO_OK;
}

static loxo_status measure(bench *b, const char *name, bench_table *table, bench_table *growth)
{
    static curves c; /* large */
    const paper_model *model = paper_model_find(name);
    loxo_status status = LOXO_OK;
    memset(&c, 0, sizeof c);
    for (double n = SMALLEST * b->settings.share; c.n_sizes < MOST_SIZES; n *= 4.0) {
        if (c.n_sizes > 0 && n > (double)b->settings.largest) break;
        status = measure_size(b, model, model->file != NULL ? fmax(n, SMALLEST * pow(4.0, c.n_sizes)) : n, table, &c);
        if (status == LOXO_ERR_UNSUPPORTED) {
            bench_table_row(table, "%s|%s", name, bench_message(b));
            return LOXO_OK;
        }
        if (status < 0 || (status = paper_keep(b)) < 0) return status;
        if (model->file != NULL && SMALLEST * pow(4.0, c.n_sizes) > (double)b->settings.largest) break;
    }
    for (int i = 0; i < c.n_lines; ++i) {
        char text[2][32];
        bench_table_row(growth, "%s|%s|%s|%s", name, c.name[i],
                        paper_number(exponent_of(c.n_sizes, c.size, c.time[i][0]), text[0], 32),
                        paper_number(exponent_of(c.n_sizes, c.size, c.bytes[i]), text[1], 32));
    }
    status = plot(b, name, &c, false);
    return status < 0 ? status : plot(b, name, &c, true);
}

loxo_status paper_tao2021_fig11(bench *b)
{
    static bench_table table, growth; /* large */
    static const int width[] = {5, 9, 28, 20, 9, 7, 8, 28, 13, 20};
    bench_table_begin_live(b, &table,
                           "mesh|vertices|method|seconds|ns/vertex|RAM, MB|B/vertex|time over the first method's|"
                           "error, eq. 29|",
                           width);
    bench_table_begin(&growth, "mesh|method|time grows as n to the|memory as n to the");
    for (size_t i = 0; i < N_MODELS; ++i) {
        if (!paper_wants(b, models[i])) continue;
        const loxo_status status = measure(b, models[i], &table, &growth);
        if (status < 0) return status;
    }
    bench_say(b, "\n");
    bench_table_print(b, &growth);
    bench_say(
        b,
        "Paper: curves without numbers; time of VTP grows as n^2, memory of the heat method faster than n, its own\n"
        "methods «nearly linear». From its Table 1, 997,635 to 9,884,764 vertices: edge n^1.26, face n^1.28, VTP\n"
        "n^1.51, HM's factorisation n^1.18. What differs: generated shapes and a subdivided scan; up to --largest.\n");
    return LOXO_OK;
}
