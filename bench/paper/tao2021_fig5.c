/* SPDX-License-Identifier: MIT
 * Figure 5: the distance after so many iterations of ADMM, and its mean relative error (29).
 * source  Tao et al. 2021, Parallel and Scalable Heat Methods, Fig. 5 */
#include "paper.h"

#include <math.h>
#include <stdio.h>

static const int iterations[] = {0, 1, 2, 3, 5, 7, 10, 15, 20, 30, 50, 100, 200, 500, 1000};
#define N_POINTS ((int)(sizeof iterations / sizeof iterations[0]))

static const char *const methods[2] = {"edge", "face"};

typedef struct curve {
    double at[N_POINTS], percent[N_POINTS]; /* of iterations; error (29) */
} curve;

static loxo_status measure(paper_subject *s, const char *name, curve *c)
{
    const loxo_index source = 0;
    loxo_status status = LOXO_OK;
    for (int i = 0; i < N_POINTS && status >= 0; ++i) {
        char method[128], text[32], title[128], suffix[64];
        snprintf(method, sizeof method, "%s,primal-tolerance=0,dual-tolerance=0,iterations=%d", name, iterations[i]);
        if ((status = paper_subject_solve(s, method, &source, 1, NULL)) < 0) return status;
        c->at[i] = iterations[i] > 0 ? iterations[i] : 0.5; /* 0 has no place on a logarithmic axis */
        const double error = paper_subject_error(s, s->truth);
        c->percent[i] = 100.0 * error;
        bench_record(s->b, "fig5",
                     json_pack("{s:s, s:s, s:i, s:o}", "mesh", s->mesh.model->name, "method", name, "iterations",
                               iterations[i], "mean_relative", paper_json(error)));
        if (iterations[i] != 0 && iterations[i] != 10 && iterations[i] != 100) continue;
        snprintf(title, sizeof title, "%s, %s, %d iterations, error %s", s->mesh.model->name, name, iterations[i],
                 paper_percent(error, text, sizeof text));
        snprintf(suffix, sizeof suffix, "%s-%d", name, iterations[i]);
        status = paper_picture(s, suffix, title);
    }
    return status;
}

static loxo_status plot(bench *b, const char *mesh, const curve *c)
{
    char title[128];
    loxo_plot_series series[2];
    loxo_plot p = loxo_plot_default();
    for (int m = 0; m < 2; ++m)
        series[m] = (loxo_plot_series){
            .name = methods[m], .style = LOXO_PLOT_BOTH, .n = N_POINTS, .x = c[m].at, .y = c[m].percent};
    snprintf(title, sizeof title, "Figure 5: error after iterations of ADMM, %s (left end: none)", mesh);
    p.title = title;
    p.x_title = "iterations";
    p.y_title = "mean relative error, eq. (29), %";
    p.x_scale = LOXO_PLOT_LOG;
    p.n_series = 2;
    p.series = series;
    return paper_plot(b, "error", &p);
}

loxo_status paper_tao2021_fig5(bench *b)
{
    static bench_table table; /* large */
    static curve c[2];
    paper_subject s;
    loxo_status status = paper_subject_open_either(b, "igea", "sphere", 134345.0, true, &s);
    if (status < 0) return status;
    for (int m = 0; m < 2 && status >= 0; ++m)
        status = measure(&s, methods[m], &c[m]);
    if (status >= 0) status = plot(b, s.mesh.model->name, c);
    paper_subject_close(&s);
    if (status < 0) return status;
    bench_table_begin(&table, "iterations|edge: error, eq. 29|face: error, eq. 29");
    for (int i = 0; i < N_POINTS; ++i) {
        char text[2][32];
        bench_table_row(&table, "%d|%s|%s", iterations[i], paper_percent(0.01 * c[0].percent[i], text[0], 32),
                        paper_percent(0.01 * c[1].percent[i], text[1], 32));
    }
    bench_table_print(b, &table);
    bench_say(
        b, "Paper: pictures of one face-based field, each with its error; the numbers are part of the pictures. Its "
           "choice\n"
           "of 10 iterations comes from there. What differs: another mesh; both methods; a table and a curve besides\n"
           "pictures at 0, 10 and 100 iterations.\n");
    return LOXO_OK;
}
