/* SPDX-License-Identifier: MIT
 * The list of tables and figures, and what becomes of one: text, JSON, plots. */
#define _POSIX_C_SOURCE 200809L /* stat */

#include "paper.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const struct {
    const char *name, *help, *models; /* models: NULL: it needs no mesh */
    loxo_status (*run)(bench *b);
} figures[] = {
    {"tao2021-table1", "time, memory, error, best m of all methods on meshes of growing size",
     "bumpy igea brain kitten bumpy250k horse bunny bimba", paper_tao2021_table1},
#ifdef LOXO_BENCH_WITH_CHOLMOD /* its truth is a direct solve */
    {"tao2021-fig2", "error of the heat's directions against sweeps and time", "armadillo bumpy", paper_tao2021_fig2},
#endif
    {"tao2021-fig4", "residuals of ADMM against iterations", "armadillo bumpy", paper_tao2021_fig4},
    {"tao2021-fig5", "error of the distance against iterations of ADMM", "igea sphere", paper_tao2021_fig5},
    {"tao2021-fig7", "genus eight, with and without the conditions on cycles", "genus", paper_tao2021_fig7},
    {"tao2021-fig8", "several sources, with and without the conditions on paths", "sphere igea", paper_tao2021_fig8},
    {"tao2021-fig9", "three triangulations of one geometry, with and without the intrinsic one", "kitten igea",
     paper_tao2021_fig9},
    {"tao2021-fig10", "subdivided meshes, too large for the other methods", "bunny igea armadillo kitten",
     paper_tao2021_fig10},
    {"tao2021-fig11", "time and memory against size, three shapes, all methods", "bumpy igea brain",
     paper_tao2021_fig11},
    {"tao2021-fig12", "the four steps of the face-based method for each number of threads",
     "igea armadillo bumpy brain", paper_tao2021_fig12},
#ifdef LOXO_BENCH_WITH_CHOLMOD
    {"tao2021-fig13", "conjugate gradients against sweeps and ADMM: accuracy over time", "armadillo bumpy",
     paper_tao2021_fig13},
#endif
    {"cantarella2022-fig2", "an open polygon, its directions, shifted, closed", NULL, paper_cantarella2022_fig2},
    {"cantarella2022-fig4", "how often the certificates hold for random points of the sphere", NULL,
     paper_cantarella2022_fig4},
    {"cantarella2022-fig6", "extensions of a curve, Moebius maps before and behind", NULL, paper_cantarella2022_fig6},
    {"cantarella2022-fig7", "extension by Abikoff and Ye's iteration, stopped at 1000 steps, beside ours", NULL,
     paper_cantarella2022_fig7},
    {"cantarella2022-fig8", "steps and time of closing polygons against accuracy", NULL, paper_cantarella2022_fig8},
    {"tan2024-table1-2", "spherical maps: energy and angle errors of the paper's methods and ours",
     "fandisk planck horse bunny brain48k venus", paper_tan2024_table1_2},
    {"tan2024-table3-fig7", "spherical maps of two ellipsoids at six sizes: orders of convergence", NULL,
     paper_tan2024_table3_fig7},
    {"tan2024-table4", "spherical maps with triangles turned over, before and after they are mended",
     "bimba fsaverage5 horse camel moai", paper_tan2024_table4},
    {"tan2024-table5", "registrations of brain surfaces by four sulci against the weight of the landmarks",
     "conte69 white pial", paper_tan2024_table5},
    {"tan2024-fig3", "the paper's method step by step: energy, gradient, move",
     "fandisk planck horse bunny brain48k venus", paper_tan2024_fig3},
    {"tan2024-fig4-5", "histograms of the angle error and of the Beltrami coefficient",
     "fandisk planck horse bunny brain48k venus", paper_tan2024_fig4_5},
    {"tan2024-fig6", "curvature, angle error and Beltrami coefficient at vertices", "fandisk horse brain48k",
     paper_tan2024_fig6},
};
#define N_FIGURES ((int)(sizeof figures / sizeof figures[0]))

loxo_status bench_paper_list(bench *b)
{
    for (int i = 0; i < N_FIGURES; ++i) {
        bench_say(b, "%-19s %s\n", figures[i].name, figures[i].help);
        if (figures[i].models != NULL) bench_say(b, "%-19s on %s\n", "", figures[i].models);
    }
    bench_say(b,
              "\ntao2021: Tao et al. 2021, Parallel and Scalable Heat Methods for Geodesic Distance Computation, IEEE "
              "TPAMI 43(2)\ncantarella2022: Cantarella, Schumacher 2022, Computing the conformal barycenter, SIAM J. "
              "Appl. Algebra Geom.\ntan2024: Tan, Li, Lin, Yau 2024, A robust Hessian-based trust region algorithm for "
              "spherical conformal parameterizations\n");
    return LOXO_OK;
}

bool paper_wants(const bench *b, const char *model)
{
    return b->case_filter == NULL || strstr(model, b->case_filter) != NULL;
}

/* Whether --case leaves it a mesh. */
static bool has_wanted(const bench *b, int figure)
{
    if (figures[figure].models == NULL) return b->case_filter == NULL;
    for (const paper_model *m = paper_models; m->name != NULL; ++m) {
        const char *at = figures[figure].models;
        const size_t n = strlen(m->name);
        while ((at = strstr(at, m->name)) != NULL &&
               !((at == figures[figure].models || at[-1] == ' ') && (at[n] == ' ' || at[n] == '\0')))
            at += n;
        if (at != NULL && paper_wants(b, m->name)) return true;
    }
    return false;
}

static bool is_named(int figure, int n_names, char **names)
{
    for (int i = 0; i < n_names; ++i)
        if (strcmp(names[i], "all") == 0 || strcmp(names[i], figures[figure].name) == 0) return true;
    return false;
}

static loxo_status out_path(bench *b, const char *suffix, char path[BENCH_PATH])
{
    const int n = snprintf(path, BENCH_PATH, "%s/%s%s", b->out, b->figure, suffix);
    return n > 0 && n < BENCH_PATH ? LOXO_OK : bench_fail(b, LOXO_ERR_ARGUMENT, "--out: the name is too long");
}

loxo_status paper_keep(bench *b)
{
    char path[BENCH_PATH];
    if (b->out == NULL) return LOXO_OK;
    loxo_status status = out_path(b, ".json", path);
    if (status < 0) return status;
    char *text = json_dumps(b->report, JSON_INDENT(2) | JSON_REAL_PRECISION(17));
    if (text == NULL) return LOXO_ERR_MEMORY;
    status = loxo_write_bytes(b->ctx, path, text, strlen(text));
    free(text);
    return status;
}

static loxo_status make(bench *b, int figure)
{
    char path[BENCH_PATH];
    loxo_status status = LOXO_OK;
    b->figure = figures[figure].name;
    if (b->out != NULL) {
        if ((status = out_path(b, ".txt", path)) < 0) return status;
        if ((b->text = fopen(path, "w")) == NULL) return bench_fail(b, LOXO_ERR_WRITE, "%s: cannot be written", path);
    }
    bench_say(b, "%s: %s\n\n", figures[figure].name, figures[figure].help);
    status = bench_machine(b);
    if (status >= 0 && figures[figure].models != NULL) bench_tell_shared(b);
    json_object_set_new(b->report, "figure", json_string(b->figure));
    if (status >= 0) status = figures[figure].run(b);
    if (b->text != NULL && fclose(b->text) != 0 && status >= 0)
        status = bench_fail(b, LOXO_ERR_WRITE, "%s: cannot be written", path);
    b->text = NULL;
    return status < 0 ? status : paper_keep(b);
}

/* Whether what is asked for can be done at all, before anything is. */
static loxo_status check(bench *b, int n_names, char **names)
{
    bool is_left = false;
    for (int i = 0; i < n_names; ++i) {
        bool is_there = strcmp(names[i], "all") == 0;
        for (int k = 0; k < N_FIGURES; ++k)
            is_there = is_there || strcmp(names[i], figures[k].name) == 0;
        if (!is_there)
            return bench_fail(b, LOXO_ERR_ARGUMENT, "no such table or figure: %s; see `loxo-bench paper --list`",
                              names[i]);
    }
    if (b->mesh != NULL || b->exact != NULL)
        return bench_fail(b, LOXO_ERR_ARGUMENT,
                          "--%s is not of paper, whose tables name their meshes; choose by --case",
                          b->mesh != NULL ? "mesh" : "exact");
    for (int k = 0; k < N_FIGURES; ++k)
        is_left = is_left || (is_named(k, n_names, names) && has_wanted(b, k));
    if (!is_left)
        return bench_fail(b, LOXO_ERR_ARGUMENT,
                          "--case: no mesh of these has '%s' in its name; `loxo-bench paper --list` names them",
                          b->case_filter);
    struct stat folder;
    if (b->out != NULL && (stat(b->out, &folder) != 0 || !S_ISDIR(folder.st_mode)))
        return bench_fail(b, LOXO_ERR_WRITE, "--out: there is no folder %s; make it first: mkdir -p %s", b->out,
                          b->out);
    if (b->out != NULL && access(b->out, W_OK | X_OK) != 0)
        return bench_fail(b, LOXO_ERR_WRITE, "--out: files cannot be made in %s", b->out);
    return LOXO_OK;
}

loxo_status bench_paper(bench *b, int n_names, char **names)
{
    const loxo_status checked = check(b, n_names, names);
    if (checked < 0) return checked;
    for (int k = 0; k < N_FIGURES; ++k) {
        if (!is_named(k, n_names, names)) continue;
        if (!has_wanted(b, k)) {
            bench_say(b, "%s: left out, none of its meshes has '%s' in its name\n\n", figures[k].name, b->case_filter);
            continue;
        }
        json_t *head = json_deep_copy(b->report); /* each has a report of its own */
        const loxo_status status = make(b, k);
        if (status < 0 || b->json_path != NULL) {
            json_decref(head);
            if (status < 0) return status;
            continue; /* --json: all in one */
        }
        json_decref(b->report);
        b->report = head;
    }
    return bench_report_write(b);
}

/* A build without libpng makes the tables all the same. */
static loxo_status told_once(const bench *b, loxo_status status)
{
    static bool is_told;
    if (status != LOXO_ERR_UNSUPPORTED) return status;
    if (!is_told) bench_say(b, "No pictures: %s\n", loxo_context_failure(b->ctx)->text);
    is_told = true;
    return LOXO_OK;
}

loxo_status paper_plot(bench *b, const char *suffix, const loxo_plot *plot)
{
    char path[BENCH_PATH], ending[128];
    if (b->out == NULL) return LOXO_OK;
    snprintf(ending, sizeof ending, "-%s.png", suffix);
    const loxo_status status = out_path(b, ending, path);
    return status < 0 ? status : told_once(b, loxo_plot_png(b->ctx, plot, path));
}

loxo_status paper_draw(bench *b, const char *suffix, const loxo_mesh_arrays *mesh, const double *value,
                       const loxo_draw_settings *settings)
{
    char path[BENCH_PATH], ending[128];
    if (b->out == NULL) return LOXO_OK;
    snprintf(ending, sizeof ending, "-%s.png", suffix);
    const loxo_status status = out_path(b, ending, path);
    return status < 0 ? status : told_once(b, loxo_draw_png(b->ctx, mesh, value, settings, path));
}

loxo_status paper_picture(const paper_subject *s, const char *suffix, const char *title)
{
    loxo_draw_settings settings = loxo_draw_settings_default();
    settings.title = title;
    settings.n_isolines = 30;
    if (s->mesh.model != NULL && s->mesh.model->file != NULL) settings.up = LOXO_DRAW_UP_Y; /* as scans are */
    return paper_draw(s->b, suffix, &s->arrays, s->distance, &settings);
}

const char *paper_percent(double share, char *text, size_t n)
{
    if (isnan(share))
        snprintf(text, n, "-");
    else
        snprintf(text, n, share < 0.00995 ? "%.3f %%" : "%.2f %%", 100.0 * share);
    return text;
}

const char *paper_number(double value, char *text, size_t n)
{
    if (isnan(value))
        snprintf(text, n, "-");
    else if (fabs(value) >= 1000.0 && fabs(value) < 1e7)
        snprintf(text, n, "%.0f", value);
    else
        snprintf(text, n, "%.3g", value);
    return text;
}

json_t *paper_json(double value) { return isfinite(value) ? json_real(value) : json_null(); }

bool paper_has_method(const char *name)
{
    for (int m = 0; m < LOXO_GEODESIC_N_METHODS; ++m)
        if (strcmp(loxo_geodesic_method_name((loxo_geodesic_method)m), name) == 0) return true;
    return false;
}

int paper_columns(const bench *b, const char *columns[PAPER_MAX_METHODS])
{
    static const struct {
        const char *method, *column[2];
    } twice[] = {{"edge", {"edge,recovery=admm", "edge,recovery=unfold"}},
                 {"heat", {"heat,factor=cholesky", "heat,factor=multigrid"}},
                 {"variational", {"variational,factor=cholesky", "variational,factor=multigrid"}}};
    int n = 0;
    for (int i = 0; i < b->n_methods; ++i) {
        const int before = n;
        for (size_t k = 0; k < sizeof twice / sizeof twice[0]; ++k)
            for (int c = 0; c < 2 && strcmp(b->methods[i], twice[k].method) == 0; ++c)
                columns[n++] = twice[k].column[c];
        if (n == before) columns[n++] = b->methods[i];
    }
    return n;
}
