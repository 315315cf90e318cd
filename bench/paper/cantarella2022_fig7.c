/* SPDX-License-Identifier: MIT
 * Figure 7: the extension of a curve by Abikoff and Ye's iteration, stopped after 1000 steps, beside Newton methods, on the same 720 moved
 * nodes; and the library's own extension.
 * source  Cantarella, Schumacher 2022, Computing the conformal barycenter, Fig. 7, section 6.1 */
#include "base/os.h"
#include "surface.h"

#include <loxo/barycenter.h>
#include <loxo/extension.h>

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <string.h>

#define N_NODES    720
#define TOLERANCE  1e-8
#define MOST_STEPS 1000
#define PI         3.141592653589793

typedef struct outcome {
    int64_t n_inside, n_open, n_steps, most; /* open: not certified */
    double seconds;
} outcome;

/* One method at all points of the disk, each with its own atoms. */
static loxo_status solve_all(paper_surface *s, loxo_barycenter_method method, outcome *out)
{
    const double start = loxo_os_clock_s();
    int64_t n_inside = 0, n_open = 0, n_steps = 0, most = 0;
    int worst = 0;
#pragma omp parallel num_threads(loxo_context_n_threads(s->b->ctx)) reduction(+ : n_inside, n_open, n_steps)           \
    reduction(max : most) reduction(min : worst)
    {
        loxo_context_settings own = loxo_context_settings_default();
        loxo_barycenter_settings settings = loxo_barycenter_settings_default();
        loxo_barycenter_info info;
        loxo_context *ctx = NULL;
        double node[2], moved[2], x[3 * N_NODES];
        own.n_threads = 1;
        settings.method = method;
        settings.tolerance = TOLERANCE;
        settings.max_iterations = MOST_STEPS;
        worst = loxo_context_create(&own, &ctx);
#pragma omp for schedule(dynamic, 16)
        for (int64_t i = 0; i < s->n; ++i) {
            const loxo_atoms atoms = {.n = N_NODES, .d = 3, .x = x};
            if (worst < 0) continue;
            s->value[i] = 0.0;
            if (hypot(s->z[i][0], s->z[i][1]) > 1.0 - 1e-9) {
                paper_curve_at(s->z[i], s->w[i]);
                continue;
            }
            for (int k = 0; k < N_NODES; ++k) {
                node[0] = cos(2.0 * PI * k / N_NODES);
                node[1] = sin(2.0 * PI * k / N_NODES);
                paper_move_node(s->z[i], node, moved);
                paper_curve_at(moved, x + (ptrdiff_t)3 * k);
            }
            const loxo_status status = loxo_barycenter(ctx, &atoms, &settings, &info);
            if (status < 0) worst = status;
            for (int k = 0; k < 3; ++k)
                s->w[i][k] = info.w[k];
            s->value[i] = log10((double)(info.n_iterations > 1 ? info.n_iterations : 1));
            n_inside += 1;
            n_open += status != LOXO_OK;
            n_steps += info.n_iterations;
            most = info.n_iterations > most ? info.n_iterations : most;
        }
        loxo_context_destroy(ctx);
    }
    *out = (outcome){n_inside, n_open, n_steps, most, loxo_os_clock_s() - start};
    return worst;
}

/* Painted with the steps; and, of others than the first, with how far they are from it. kept [n][3]: what the first one gave. */
static loxo_status draw(paper_surface *s, const char *name, bool is_first, double (*kept)[3], double *most_apart)
{
    char suffix[64], title[128];
    snprintf(title, sizeof title, "Figure 7: %s, steps (at most %d)", name, MOST_STEPS);
    const loxo_status status = paper_surface_draw(s, name, title, "log10");
    *most_apart = 0.0;
    if (is_first) memcpy(kept, s->w, (size_t)s->n * sizeof *kept);
    if (status < 0 || is_first) return status;
    for (int64_t i = 0; i < s->n; ++i) {
        const double e[3] = {s->w[i][0] - kept[i][0], s->w[i][1] - kept[i][1], s->w[i][2] - kept[i][2]};
        const double apart = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]);
        *most_apart = fmax(*most_apart, apart);
        s->value[i] = log10(fmax(apart, 1e-16));
    }
    snprintf(title, sizeof title, "Figure 7: %s, distance from damped", name);
    snprintf(suffix, sizeof suffix, "%s-apart", name);
    return paper_surface_draw(s, suffix, title, "log10");
}

/* The library's extension: seconds of evaluating all points. */
static loxo_status extend(paper_surface *s, loxo_extension_info *info)
{
    double x[8][3], corner[2];
    const loxo_curve curve = {.n = 8, .d = 3, .x = &x[0][0]};
    const loxo_extension_values values = {.w = &s->w[0][0]};
    loxo_extension *extension = NULL;
    for (int k = 0; k < 8; ++k) {
        corner[0] = cos(PI * k / 4.0);
        corner[1] = sin(PI * k / 4.0);
        paper_curve_at(corner, x[k]);
    }
    loxo_status status = loxo_extension_create(s->b->ctx, &curve, NULL, &extension);
    if (status >= 0) status = loxo_extension_evaluate(extension, s->n, &s->z[0][0], NULL, &values, info);
    loxo_extension_destroy(extension);
    return status;
}

loxo_status paper_cantarella2022_fig7(bench *b)
{
    static const loxo_barycenter_method methods[] = {LOXO_BARYCENTER_DAMPED, LOXO_BARYCENTER_REGULARIZED,
                                                     LOXO_BARYCENTER_ABIKOFF_YE};
    static bench_table table; /* large */
    loxo_extension_info info;
    paper_surface s;
    char text[2][32];
    loxo_status status = paper_surface_open(b, 64309.0 * b->settings.share, &s);
    double(*kept)[3] = loxo_allocate(b->ctx, s.n, sizeof *kept);
    if (status >= 0 && kept == NULL) status = LOXO_ERR_MEMORY;
    bench_table_begin(&table, "method|points inside|steps: mean|most|not certified|apart from damped|seconds");
    for (int m = 0; m < 3 && status >= 0; ++m) {
        const char *name = loxo_barycenter_method_name(methods[m]);
        outcome o;
        if ((status = solve_all(&s, methods[m], &o)) < 0) {
            (void)bench_fail(b, status, "%s: a barycenter could not be searched for", name);
            break;
        }
        double apart;
        if ((status = draw(&s, name, m == 0, kept, &apart)) < 0) break;
        const double mean = (double)o.n_steps / (double)o.n_inside;
        bench_table_row(&table, "%s|%lld|%s|%lld|%lld|%.1e|%s", name, (long long)o.n_inside,
                        paper_number(mean, text[0], 32), (long long)o.most, (long long)o.n_open, apart,
                        paper_number(o.seconds, text[1], 32));
        bench_record(b, "fig7",
                     json_pack("{s:s, s:I, s:f, s:I, s:I, s:f, s:f}", "method", name, "points", (json_int_t)o.n_inside,
                               "mean_steps", mean, "most_steps", (json_int_t)o.most, "not_certified",
                               (json_int_t)o.n_open, "apart_from_damped", apart, "seconds", o.seconds));
    }
    if (status >= 0 && (status = extend(&s, &info)) >= 0) {
        bench_table_row(&table, "extension|%lld|||%lld||%s", (long long)(info.n_points - info.n_curve),
                        (long long)info.n_open, paper_number(info.total_s, text[0], 32));
        bench_record(b, "fig7",
                     json_pack("{s:s, s:I, s:f}", "method", "extension", "points", (json_int_t)info.n_points, "seconds",
                               info.total_s));
    }
    loxo_release(b->ctx, kept);
    paper_surface_close(&s);
    if (status < 0) return status;
    bench_table_row(&table, "paper, DRNM, 4 cores|64309|about 2|4|||2.6");
    bench_say(b, "\n");
    bench_table_print(b, &table);
    bench_say(b,
              "%d nodes, tolerance 1e-8, at most %d steps; %d threads, seconds by the clock. The first three rows: "
              "barycenters of atoms made for "
              "each point, making\nthem included; extension: the library's own way. regularized is the paper's DRNM; "
              "its first step, to the "
              "mean, counts as one here.\nWhat differs: another curve, eight great arcs.\n",
              N_NODES, MOST_STEPS, loxo_context_n_threads(b->ctx));
    return LOXO_OK;
}
