/* SPDX-License-Identifier: MIT
 * Tables 1 and 2: sizes of the meshes, conformal energy and percentiles of the angle error by FLASH, SCEM and HBTR, and by our own.
 * source  Tan, Li, Lin, Yau 2024, A robust Hessian-based trust region algorithm for spherical conformal parameterizations, section 5.2 */
#include "maps.h"

#include <stdio.h>

/* What the paper printed: energy, 50th and 75th percentile of the angle error in degrees. */
typedef struct printed {
    double energy, median, percentile_75;
} printed;

/* Of paper_map_models, in their order: FLASH, SCEM, HBTR. */
static const printed prints[][3] = {
    {{3.50e-2, 1.071, 1.974}, {1.39e-2, 0.936, 1.646}, {1.34e-2, 0.936, 1.640}},
    {{1.71e-3, 0.311, 0.578}, {1.19e-3, 0.245, 0.457}, {1.13e-3, 0.231, 0.446}},
    {{4.58e-3, 1.027, 2.292}, {4.30e-3, 1.020, 2.283}, {4.18e-3, 1.010, 2.283}},
    {{1.93e-3, 0.343, 0.759}, {1.90e-3, 0.339, 0.746}, {1.85e-3, 0.363, 0.735}},
    {{2.69e-2, 0.821, 1.849}, {2.36e-2, 0.729, 1.694}, {2.33e-2, 0.729, 1.694}},
    {{6.66e-3, 0.666, 1.186}, {3.54e-3, 0.453, 0.831}, {3.27e-3, 0.442, 0.821}},
};

static void add_cell(char *text, size_t n, double value, double paper)
{
    if (paper > 0.0)
        snprintf(text, n, "%.3e (%.2e)", value, paper);
    else
        snprintf(text, n, "%.3e", value);
}

static void add_degrees(char *text, size_t n, double value, double paper)
{
    if (paper > 0.0)
        snprintf(text, n, "%.3f (%.3f)", value, paper);
    else
        snprintf(text, n, "%.3f", value);
}

static loxo_status add_row(paper_subject *s, bench_table *table, const char *label,
                           const loxo_sphere_settings *settings, const printed *paper)
{
    static const printed none = {0.0, 0.0, 0.0};
    char cell[3][BENCH_CELL];
    paper_map map;
    if (paper == NULL) paper = &none;
    const loxo_status status = paper_map_make(s, settings, NULL, &map);
    if (status >= 0 && map.map == NULL) {
        bench_table_row(table, "%s|%s|%s", s->mesh.model->name, label, loxo_status_name(map.status));
    } else if (status >= 0) {
        const loxo_sphere_map_measure *m = &map.raw;
        add_cell(cell[0], sizeof cell[0], m->energy, paper->energy);
        add_degrees(cell[1], sizeof cell[1], m->angle_error_deg.median, paper->median);
        add_degrees(cell[2], sizeof cell[2], m->angle_error_deg.percentile_75, paper->percentile_75);
        bench_table_row(table, "%s|%s|%s|%s|%s|%.3e|%lld|%lld|%.2f|%s", s->mesh.model->name, label, cell[0], cell[1],
                        cell[2], map.centred.energy, (long long)m->n_folds, (long long)map.info.n_iterations,
                        map.info.total_s, paper_map_note(&map));
        bench_record(s->b, "table2",
                     json_pack("{s:s, s:s, s:I, s:f, s:f, s:f, s:f, s:I, s:I, s:f}", "mesh", s->mesh.model->name,
                               "method", label, "vertices", (json_int_t)s->soup.n_vertices, "energy", m->energy,
                               "energy_centred", map.centred.energy, "angle_50", m->angle_error_deg.median, "angle_75",
                               m->angle_error_deg.percentile_75, "folds", (json_int_t)m->n_folds, "steps",
                               (json_int_t)map.info.n_iterations, "seconds", map.info.total_s));
    }
    paper_map_close(&map);
    return status;
}

static loxo_status measure(bench *b, const paper_map_model *m, const printed paper[3], bench_table *sizes,
                           bench_table *table)
{
    paper_subject s;
    loxo_status status = paper_subject_open(b, m->name, 0.0, false, &s);
    if (status < 0) return status == LOXO_ERR_UNSUPPORTED ? LOXO_OK : status;
    loxo_sphere_settings settings = paper_map_settings(LOXO_SPHERE_FLASH, LOXO_SPHERE_START_AUTO);
    bench_table_row(sizes, "%s|%lld|%lld|%s|%d|%d", m->name, (long long)s.soup.n_vertices, (long long)s.soup.n_faces,
                    m->printed_name, m->n_printed, 2 * m->n_printed - 4);
    status = add_row(&s, table, "flash", &settings, &paper[0]);
    settings.method = LOXO_SPHERE_SCEM;
    if (status >= 0) status = add_row(&s, table, "scem", &settings, &paper[1]);
    settings = paper_map_settings(LOXO_SPHERE_HBTR, LOXO_SPHERE_START_SCEM);
    if (status >= 0) status = add_row(&s, table, "hbtr", &settings, &paper[2]);
    settings = paper_map_settings(LOXO_SPHERE_NEWTON, LOXO_SPHERE_START_SCEM);
    settings.is_free = true;
    if (status >= 0) status = add_row(&s, table, "newton, free", &settings, NULL);
    settings = paper_map_settings(LOXO_SPHERE_NEWTON, LOXO_SPHERE_START_AUTO);
    if (status >= 0) status = add_row(&s, table, "newton", &settings, NULL);
    paper_subject_close(&s);
    return status < 0 ? status : paper_keep(b);
}

loxo_status paper_tan2024_table1_2(bench *b)
{
    static const int width[] = {9, 12, 22, 15, 15, 10, 6, 6, 8, 16};
    static bench_table sizes, table; /* large */
    bench_table_begin(&sizes, "mesh|vertices|faces|the paper's|vertices|faces");
    bench_table_begin_live(b, &table,
                           "mesh|method|E_C (paper)|angle, 50 %|angle, 75 %|centred|folds|steps|seconds|note", width);
    loxo_status status = LOXO_OK;
    for (int i = 0; paper_map_models[i].name != NULL && status >= 0; ++i)
        status = measure(b, &paper_map_models[i], prints[i], &sizes, &table);
    if (status < 0) return status;
    bench_say(b, "\n");
    bench_table_print(b, &sizes);
    bench_say(b,
              "E_C of the map as the method leaves it, with the paper's number in brackets; centred: E_C after the "
              "area-weighted mean was\nmoved to the centre by a Moebius map, which is what may be compared. Angle "
              "errors in degrees, before centring. HBTR and\nnewton, free begin with the SCEM map, newton with its own "
              "start; a solve ends after --solve-seconds (%g).\nWhat differs: only Fandisk is the paper's mesh; the "
              "others are of the same objects at other sizes, Brain another brain. HBTR\nends with vertices on the "
              "chart's poles, where the chart's gradient vanishes but not the energy's: newton, free goes on to\nthe "
              "minimum beside it. Apple and Arnold are not here.\n",
              b->settings.solve_seconds);
    return LOXO_OK;
}
