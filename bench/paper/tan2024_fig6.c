/* SPDX-License-Identifier: MIT
 * Figure 6: Gauss curvature, mean angle error and mean Beltrami coefficient at vertices, on the surface; and how nearly the three are in
 * proportion.
 * source  Tan, Li, Lin, Yau 2024, A robust Hessian-based trust region algorithm for spherical conformal parameterizations, section 5.1 */
#include "maps.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

typedef enum field { CURVATURE, ANGLE, BELTRAMI, N_FIELDS } field;
static const char *const names[N_FIELDS] = {"curvature", "angle", "mu"};
static const char *const titles[N_FIELDS] = {"square root of |Gauss curvature|", "mean angle error, degrees",
                                             "mean |mu|"};

/* Pearson's, over vertices where both are there; power: of the first. */
static double correlation(int64_t n, const double *x, double power, const double *y)
{
    double sum[5] = {0.0}, k = 0.0;
    for (int64_t i = 0; i < n; ++i) {
        if (!isfinite(x[i]) || !isfinite(y[i])) continue;
        const double a = pow(x[i], power);
        k += 1.0;
        sum[0] += a;
        sum[1] += y[i];
        sum[2] += a * a;
        sum[3] += y[i] * y[i];
        sum[4] += a * y[i];
    }
    return (k * sum[4] - sum[0] * sum[1]) / sqrt((k * sum[2] - sum[0] * sum[0]) * (k * sum[3] - sum[1] * sum[1]));
}

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The number that 99 % do not exceed: where the colours end, as a few vertices would darken all others. */
static loxo_status find_end(bench *b, int64_t n, const double *value, double *end)
{
    int64_t n_finite = 0;
    double *sorted = loxo_allocate(b->ctx, n, sizeof *sorted);
    if (sorted == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < n; ++i)
        if (isfinite(value[i])) sorted[n_finite++] = value[i];
    qsort(sorted, (size_t)n_finite, sizeof *sorted, compare);
    *end = n_finite > 0 ? sorted[n_finite * 99 / 100] : 1.0;
    loxo_release(b->ctx, sorted);
    return LOXO_OK;
}

static loxo_status draw(paper_subject *s, const paper_map *map, double *const value[N_FIELDS], bench_table *table)
{
    bench *b = s->b;
    const char *name = s->mesh.model->name;
    const int64_t n = s->soup.n_vertices;
    const loxo_sphere_map_fields fields = {.vertex_curvature_rad = value[CURVATURE],
                                           .vertex_angle_error_deg = value[ANGLE],
                                           .vertex_beltrami = value[BELTRAMI]};
    loxo_sphere_map_measure m;
    loxo_status status = loxo_measure_sphere_map(b->ctx, &s->arrays, map->map, &m, &fields);
    if (status < 0) return status;
    for (int64_t i = 0; i < n; ++i)
        value[CURVATURE][i] = sqrt(fabs(value[CURVATURE][i]));
    const double r[3] = {correlation(n, value[ANGLE], 1.0, value[BELTRAMI]),
                         correlation(n, value[CURVATURE], 1.0, value[ANGLE]),
                         correlation(n, value[CURVATURE], 2.0, value[ANGLE])};
    bench_table_row(table, "%s|%.3f|%.3f|%.3f|%s", name, r[0], r[1], r[2], paper_map_note(map));
    bench_record(b, "fig6",
                 json_pack("{s:s, s:o, s:o, s:o}", "mesh", name, "mu_angle", paper_json(r[0]), "root_curvature_angle",
                           paper_json(r[1]), "curvature_angle", paper_json(r[2])));
    for (int k = 0; k < N_FIELDS && status >= 0; ++k) {
        char suffix[64], title[128];
        loxo_draw_settings settings = loxo_draw_settings_default();
        snprintf(suffix, sizeof suffix, "%s-%s", name, names[k]);
        snprintf(title, sizeof title, "%s: %s", name, titles[k]);
        settings.title = title;
        settings.n_isolines = 0;
        settings.value_min = 0.0;
        if ((status = find_end(b, n, value[k], &settings.value_max)) < 0) break;
        status = paper_draw(b, suffix, &s->arrays, value[k], &settings);
    }
    return status;
}

static loxo_status measure(bench *b, const char *name, bench_table *table)
{
    const loxo_sphere_settings settings = paper_map_settings(LOXO_SPHERE_HBTR, LOXO_SPHERE_START_SCEM);
    double *value[N_FIELDS] = {NULL, NULL, NULL};
    paper_subject s;
    paper_map map;
    loxo_status status = paper_subject_open(b, name, 0.0, false, &s);
    if (status < 0) return status == LOXO_ERR_UNSUPPORTED ? LOXO_OK : status;
    status = paper_map_make(&s, &settings, NULL, &map);
    for (int k = 0; k < N_FIELDS && status >= 0; ++k)
        if ((value[k] = loxo_allocate(b->ctx, s.soup.n_vertices, sizeof *value[k])) == NULL) status = LOXO_ERR_MEMORY;
    if (status >= 0 && map.map == NULL)
        bench_table_row(table, "%s|%s", name, loxo_status_name(map.status));
    else if (status >= 0)
        status = draw(&s, &map, value, table);
    for (int k = 0; k < N_FIELDS; ++k)
        loxo_release(b->ctx, value[k]);
    paper_map_close(&map);
    paper_subject_close(&s);
    return status < 0 ? status : paper_keep(b);
}

loxo_status paper_tan2024_fig6(bench *b)
{
    static const char *const models[] = {"fandisk", "horse", "brain48k"};
    static bench_table table; /* large */
    bench_table_begin(&table, "mesh|mu and angle|angle and root of curvature|angle and curvature|note");
    loxo_status status = LOXO_OK;
    for (int i = 0; i < 3 && status >= 0; ++i)
        status = measure(b, models[i], &table);
    if (status < 0) return status;
    bench_table_print(b, &table);
    bench_say(b,
              "Correlations over the vertices; colours end where 99 %% of them do. The paper shows pictures, and reads "
              "from them that |mu|, the\nangle error and the root of the curvature are in proportion, on Brain |mu|, "
              "the angle error and the curvature itself. What\ndiffers: Horse has another size, the brain is another "
              "one, Arnold is not here.\n");
    return LOXO_OK;
}
