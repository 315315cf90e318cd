/* SPDX-License-Identifier: MIT
 * Figure 2: an open polygon of the plane, its edges' directions with their barycenter, the same shifted, and the closed polygon.
 * source  Cantarella, Schumacher 2022, Computing the conformal barycenter, Fig. 2 */
#include "paper.h"

#include <loxo/polygon.h>

#include <math.h>

#define N_EDGES  9
#define N_CIRCLE 181

/* The circle, a ray to each direction's point, and the barycenter. */
static loxo_status draw_measure(bench *b, const char *suffix, const char *title, double (*edge)[2], const double *w)
{
    double circle[2][N_CIRCLE], point[2][N_EDGES];
    loxo_plot p = loxo_plot_default();
    for (int i = 0; i < N_CIRCLE; ++i) {
        circle[0][i] = cos(6.283185307179586 * i / (N_CIRCLE - 1));
        circle[1][i] = sin(6.283185307179586 * i / (N_CIRCLE - 1));
    }
    for (int i = 0; i < N_EDGES; ++i)
        for (int k = 0; k < 2; ++k)
            point[k][i] = edge[i][k] / hypot(edge[i][0], edge[i][1]);
    const loxo_plot_series series[] = {
        {.n = N_CIRCLE, .x = circle[0], .y = circle[1]},
        {.name = "directions of edges", .style = LOXO_PLOT_POINTS, .n = N_EDGES, .x = point[0], .y = point[1]},
        {.name = "barycenter", .style = LOXO_PLOT_POINTS, .n = 1, .x = &w[0], .y = &w[1]}};
    p.width = 800; /* the axes are as long as each other */
    p.height = 871;
    p.title = title;
    p.x_min = p.y_min = -1.1;
    p.x_max = p.y_max = 1.1;
    p.n_series = 3;
    p.series = series;
    return paper_plot(b, suffix, &p);
}

static loxo_status draw_polygon(bench *b, const char *suffix, const char *title, double (*edge)[2])
{
    double x[2][N_EDGES + 1] = {{0.0}}, low[2] = {0.0, 0.0}, high[2] = {0.0, 0.0};
    loxo_plot p = loxo_plot_default();
    for (int i = 0; i < N_EDGES; ++i)
        for (int k = 0; k < 2; ++k)
            x[k][i + 1] = x[k][i] + edge[i][k];
    for (int i = 0; i <= N_EDGES; ++i)
        for (int k = 0; k < 2; ++k) {
            low[k] = fmin(low[k], x[k][i]);
            high[k] = fmax(high[k], x[k][i]);
        }
    const double half = 0.55 * fmax(high[0] - low[0], high[1] - low[1]);
    const loxo_plot_series series = {.style = LOXO_PLOT_BOTH, .n = N_EDGES + 1, .x = x[0], .y = x[1]};
    p.width = 800; /* the axes are as long as each other */
    p.height = 846;
    p.title = title;
    p.x_min = 0.5 * (low[0] + high[0]) - half;
    p.x_max = p.x_min + 2.0 * half;
    p.y_min = 0.5 * (low[1] + high[1]) - half;
    p.y_max = p.y_min + 2.0 * half;
    p.n_series = 1;
    p.series = &series;
    return paper_plot(b, suffix, &p);
}

loxo_status paper_cantarella2022_fig2(bench *b)
{
    static bench_table table;                                                            /* large */
    static const double turn[N_EDGES] = {-0.5, -0.3, 0.2, 0.5, 0.9, 1.1, 1.4, 2.0, 2.6}, /* directions, rad */
        length[N_EDGES] = {1.0, 0.8, 1.2, 0.6, 1.0, 0.9, 0.7, 1.1, 1.0};
    static const double centre[2] = {0.0, 0.0};
    double open[N_EDGES][2], closed[N_EDGES][2], w[2];
    loxo_polygon_report report;
    loxo_polygon_settings settings = loxo_polygon_settings_default();
    const loxo_polygons polygons = {
        .n_polygons = 1, .n_edges = N_EDGES, .d = 2, .form = LOXO_POLYGON_EDGES, .x = &open[0][0]};
    settings.edges = true;
    for (int i = 0; i < N_EDGES; ++i) {
        open[i][0] = length[i] * cos(turn[i]);
        open[i][1] = length[i] * sin(turn[i]);
    }
    loxo_status status = loxo_polygon_close(b->ctx, &polygons, &settings, &closed[0][0], &report, w, NULL);
    if (status < 0 || (status = draw_polygon(b, "a-open", "Figure 2 (a): an open polygon", open)) < 0 ||
        (status = draw_measure(b, "b-measure", "Figure 2 (b): directions of its edges", open, w)) < 0 ||
        (status = draw_measure(b, "c-shifted", "Figure 2 (c): shifted", closed, centre)) < 0 ||
        (status = draw_polygon(b, "d-closed", "Figure 2 (d): closed, the same lengths", closed)) < 0)
        return status;
    double most = 0.0;
    for (int i = 0; i < N_EDGES; ++i)
        most = fmax(most, fabs(hypot(closed[i][0], closed[i][1]) / length[i] - 1.0));
    bench_table_begin(&table, "edges|barycenter|bound|gap over length|largest change of a length");
    bench_table_row(&table, "%d|%.6f, %.6f|%.1e|%.1e|%.1e", N_EDGES, w[0], w[1], report.bound,
                    report.gap / report.length, most);
    bench_table_print(b, &table);
    bench_say(b, "What differs: another polygon.\n");
    bench_record(b, "fig2",
                 json_pack("{s:f, s:f, s:f}", "bound", report.bound, "gap", report.gap, "length_change", most));
    return LOXO_OK;
}
