/* SPDX-License-Identifier: MIT
 * Figures 4 and 5: histograms of the angle error, corner by corner, and of the Beltrami coefficient, face by face, of the paper's method.
 * source  Tan, Li, Lin, Yau 2024, A robust Hessian-based trust region algorithm for spherical conformal parameterizations, section 5.1 */
#include "maps.h"

#include <math.h>
#include <stdio.h>

#define N_BINS 50

typedef struct histogram {
    double middle[N_BINS], share[N_BINS]; /* of all numbers; the last bin has those beyond, too */
    double below;                         /* share under the bound that the paper names */
} histogram;

static void count(const double *value, int64_t n, double most, double bound, histogram *h)
{
    int64_t n_all = 0, n_below = 0, n_in[N_BINS] = {0};
    for (int64_t i = 0; i < n; ++i) {
        if (!isfinite(value[i])) continue;
        const double bin = value[i] / most * N_BINS;
        ++n_in[bin < N_BINS - 1 ? (int)bin : N_BINS - 1];
        ++n_all;
        n_below += value[i] < bound;
    }
    for (int k = 0; k < N_BINS; ++k) {
        h->middle[k] = (k + 0.5) * most / N_BINS;
        h->share[k] = n_all > 0 ? (double)n_in[k] / (double)n_all : 0.0;
    }
    h->below = n_all > 0 ? (double)n_below / (double)n_all : (double)NAN;
}

static loxo_status plot(bench *b, const char *mesh, const char *what, const char *x_title, const histogram *h)
{
    char suffix[64], title[128];
    const double low = 0.0, width = h->middle[1] - h->middle[0];
    double x[4 * N_BINS], y[4 * N_BINS];
    loxo_plot p = loxo_plot_default();
    for (int k = 0; k < N_BINS; ++k) /* the outline of a column */
        for (int c = 0; c < 4; ++c) {
            x[4 * k + c] = h->middle[k] + (c < 2 ? -0.5 : 0.5) * width;
            y[4 * k + c] = c == 0 || c == 3 ? low : h->share[k];
        }
    const loxo_plot_series series = {.style = LOXO_PLOT_LINE, .n = (int64_t)4 * N_BINS, .x = x, .y = y};
    snprintf(suffix, sizeof suffix, "%s-%s", mesh, what);
    snprintf(title, sizeof title, "HBTR on %s", mesh);
    p.title = title;
    p.x_title = x_title;
    p.y_title = "share";
    p.x_min = p.y_min = 0.0;
    p.n_series = 1;
    p.series = &series;
    return paper_plot(b, suffix, &p);
}

static loxo_status draw(paper_subject *s, const paper_map *map, double *angle, double *mu, bench_table *table)
{
    bench *b = s->b;
    const char *name = s->mesh.model->name;
    const int64_t n_faces = s->soup.n_faces;
    const loxo_sphere_map_fields fields = {.corner_angle_error_deg = angle, .face_beltrami = mu};
    loxo_sphere_map_measure m;
    histogram h[2];
    loxo_status status = loxo_measure_sphere_map(b->ctx, &s->arrays, map->map, &m, &fields);
    if (status < 0) return status;
    for (int64_t f = 0; f < n_faces; ++f)
        mu[f] = hypot(mu[2 * f], mu[2 * f + 1]); /* in place: behind what is read */
    count(angle, 3 * n_faces, 10.0, 5.0, &h[0]);
    count(mu, n_faces, 0.2, 0.1, &h[1]);
    bench_table_row(table, "%s|%.2f %%|%.2f|%.2f %%|%.4f|%s", name, 100.0 * h[0].below, m.angle_error_deg.max,
                    100.0 * h[1].below, m.beltrami.max, paper_map_note(map));
    for (int k = 0; k < N_BINS; ++k)
        bench_record(b, "fig4_5",
                     json_pack("{s:s, s:f, s:f, s:f, s:f}", "mesh", name, "angle", h[0].middle[k], "angle_share",
                               h[0].share[k], "mu", h[1].middle[k], "mu_share", h[1].share[k]));
    status = plot(b, name, "angle", "angle error, degrees (last: all above)", &h[0]);
    return status < 0 ? status : plot(b, name, "mu", "|mu| (last: all above)", &h[1]);
}

static loxo_status measure(bench *b, const char *name, bench_table *table)
{
    const loxo_sphere_settings settings = paper_map_settings(LOXO_SPHERE_HBTR, LOXO_SPHERE_START_SCEM);
    double *angle = NULL, *mu = NULL;
    paper_subject s;
    paper_map map;
    loxo_status status = paper_subject_open(b, name, 0.0, false, &s);
    if (status < 0) return status == LOXO_ERR_UNSUPPORTED ? LOXO_OK : status;
    status = paper_map_make(&s, &settings, NULL, &map);
    if (status >= 0 && map.map == NULL) {
        bench_table_row(table, "%s|%s", name, loxo_status_name(map.status));
    } else if (status >= 0) {
        angle = loxo_allocate(b->ctx, s.soup.n_faces, 3 * sizeof *angle);
        mu = loxo_allocate(b->ctx, s.soup.n_faces, 2 * sizeof *mu);
        status = angle != NULL && mu != NULL ? draw(&s, &map, angle, mu, table) : LOXO_ERR_MEMORY;
    }
    loxo_release(b->ctx, angle);
    loxo_release(b->ctx, mu);
    paper_map_close(&map);
    paper_subject_close(&s);
    return status < 0 ? status : paper_keep(b);
}

loxo_status paper_tan2024_fig4_5(bench *b)
{
    static bench_table table; /* large */
    bench_table_begin(&table, "mesh|angle errors below 5 degrees|largest|mu below 0.1|largest|note");
    loxo_status status = LOXO_OK;
    for (int i = 0; paper_map_models[i].name != NULL && status >= 0; ++i)
        status = measure(b, paper_map_models[i].name, &table);
    if (status < 0) return status;
    bench_table_print(b, &table);
    bench_say(b, "The paper shows histograms: «most» of the angle errors are below 5 degrees and most of the Beltrami "
                 "coefficients below 0.1.\nWhat differs: meshes but Fandisk.\n");
    return LOXO_OK;
}
