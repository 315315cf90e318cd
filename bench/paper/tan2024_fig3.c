/* SPDX-License-Identifier: MIT
 * Figure 3: energy, largest entry of the gradient and move (4.4) of the paper's method against its steps.
 * source  Tan, Li, Lin, Yau 2024, A robust Hessian-based trust region algorithm for spherical conformal parameterizations, section 5.1 */
#include "maps.h"

#include <math.h>
#include <stdio.h>

static loxo_status plot(bench *b, const char *mesh, const paper_map_curve *c)
{
    char suffix[64], title[128];
    const loxo_plot_series energy = {.style = LOXO_PLOT_BOTH, .n = c->n, .x = c->step, .y = c->energy};
    const loxo_plot_series errors[2] = {
        {.name = "largest entry of the gradient", .style = LOXO_PLOT_BOTH, .n = c->n, .x = c->step, .y = c->gradient},
        {.name = "move, eq. (4.4)", .style = LOXO_PLOT_BOTH, .n = c->n, .x = c->step, .y = c->move}};
    loxo_plot p = loxo_plot_default();
    snprintf(title, sizeof title, "Figure 3: HBTR on %s", mesh);
    p.title = title;
    p.x_title = "step";
    p.y_title = "conformal energy E_C";
    p.n_series = 1;
    p.series = &energy;
    snprintf(suffix, sizeof suffix, "%s-energy", mesh);
    const loxo_status status = paper_plot(b, suffix, &p);
    if (status < 0) return status;
    p.y_title = "gradient, move";
    p.y_scale = LOXO_PLOT_LOG;
    p.n_series = 2;
    p.series = errors;
    snprintf(suffix, sizeof suffix, "%s-errors", mesh);
    return paper_plot(b, suffix, &p);
}

static loxo_status measure(bench *b, const char *name, bench_table *table)
{
    static paper_map_curve c; /* large */
    const loxo_sphere_settings settings = paper_map_settings(LOXO_SPHERE_HBTR, LOXO_SPHERE_START_SCEM);
    char text[3][32];
    paper_subject s;
    paper_map map;
    loxo_status status = paper_subject_open(b, name, 0.0, false, &s);
    if (status < 0) return status == LOXO_ERR_UNSUPPORTED ? LOXO_OK : status;
    status = paper_map_make(&s, &settings, &c, &map);
    if (status >= 0 && (map.map == NULL || c.n == 0)) {
        bench_table_row(table, "%s|%s", name, loxo_status_name(map.status));
    } else if (status >= 0) {
        for (int k = 0; k < 3; ++k) /* the last three moves */
            paper_number(c.n > 3 - k ? c.move[c.n - 3 + k] : (double)NAN, text[k], sizeof text[k]);
        bench_table_row(table, "%s|%lld|%d|%.4e|%.4e|%.1e|%s|%s|%s|%s", name, (long long)map.info.n_iterations, c.n - 1,
                        c.energy[0], c.energy[c.n - 1], c.gradient[c.n - 1], text[0], text[1], text[2],
                        paper_map_note(&map));
        for (int i = 0; i < c.n; ++i)
            bench_record(b, "fig3",
                         json_pack("{s:s, s:f, s:f, s:f, s:o}", "mesh", name, "step", c.step[i], "energy", c.energy[i],
                                   "gradient", c.gradient[i], "move", paper_json(c.move[i])));
        status = plot(b, name, &c);
    }
    paper_map_close(&map);
    paper_subject_close(&s);
    return status < 0 ? status : paper_keep(b);
}

loxo_status paper_tan2024_fig3(bench *b)
{
    static bench_table table; /* large */
    bench_table_begin(&table, "mesh|steps|taken|E_C, first|E_C, last|gradient|move, 3rd last|2nd last|last|note");
    loxo_status status = LOXO_OK;
    for (int i = 0; paper_map_models[i].name != NULL && status >= 0; ++i)
        status = measure(b, paper_map_models[i].name, &table);
    if (status < 0) return status;
    bench_table_row(&table, "Brain (paper)||27|||1e-10|7.4e-4|9.3e-6|5.9e-10");
    bench_table_print(b, &table);
    bench_say(b,
              "From the SCEM map, to a move of 1e-9 or --solve-seconds (%g). The paper shows curves, and prints the "
              "last three moves of Brain.\nWhat differs: meshes but Fandisk; the rule for the radius, which the paper "
              "does not print. Which of the chart's false critical\npoints is met, and after how many steps, hangs on "
              "that rule.\n",
              b->settings.solve_seconds);
    return LOXO_OK;
}
