/* SPDX-License-Identifier: MIT
 * Figure 13: accuracy against time of conjugate gradients with the diagonal as preconditioner, of the parallel heat method's
 * own iterations, and of a factor. Left: the heat equation, by its residual (30). Right: the distance from the same
 * directions, by its difference (31) from the direct solution.
 * source  Tao et al. 2021, Parallel and Scalable Heat Methods, Fig. 13 and section 6.4 */
#include "../direct.h"
#include "algebra/cg.h"
#include "algebra/cholesky.h"
#include "base/os.h"
#include "operator/laplacian.h"
#include "paper.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define MOST_POINTS 400

typedef struct curve {
    int n;
    double seconds[MOST_POINTS], error[MOST_POINTS];
} curve;

typedef struct subject {
    paper_subject s;
    loxo_mesh *mesh; /* in the order of its file, so that rows and heats have one numbering */
    loxo_mesh_view m;
    double time;            /* of the diffusion */
    loxo_csr heat, poisson; /* A + t C; C with the source pinned */
    double *delta, *divergence, *direct, *x, *residual;
    double *heat_value;
    int32_t *heat_scale;
} subject;

static void add_point(curve *c, double seconds, double error)
{
    if (c->n == MOST_POINTS) return;
    c->seconds[c->n] = seconds;
    c->error[c->n++] = error;
}

static double norm_of_difference(int64_t n, const double *a, const double *b)
{
    double sum = 0.0;
    for (int64_t i = 0; i < n; ++i)
        sum += (a[i] - b[i]) * (a[i] - b[i]);
    return sqrt(sum);
}

/* |(A + t C) u - u_0|, (30). */
static double heat_residual(subject *p, const double *u)
{
    loxo_csr_multiply(p->s.b->ctx, &p->heat, u, p->residual);
    return norm_of_difference(p->m.n_vertices, p->residual, p->delta);
}

/* |d - d*| / n, (31). */
static double distance_error(const subject *p, const double *d)
{
    return norm_of_difference(p->m.n_vertices, d, p->direct) / (double)p->m.n_vertices;
}

/* ---- conjugate gradients ---- */

typedef struct looking {
    subject *p;
    curve *c;
    double start_s, looked_s; /* looking does not count */
    bool is_heat;
} looking;

static void look(void *user, int64_t iteration, const double *x, double residual)
{
    looking *l = user;
    const double now = loxo_os_clock_s();
    (void)residual;
    /* Every iteration at first, then ever fewer of them. */
    if (iteration <= 50 || iteration % (iteration / 25) == 0) {
        const double error = l->is_heat ? heat_residual(l->p, x) : distance_error(l->p, x);
        add_point(l->c, now - l->start_s - l->looked_s, error);
    }
    l->looked_s += loxo_os_clock_s() - now;
}

static loxo_status run_cg(subject *p, const loxo_csr *matrix, const double *b, bool is_heat, curve *c)
{
    loxo_cg *cg = NULL;
    loxo_cg_info info;
    loxo_diagonal diagonal = {p->s.b->ctx, matrix};
    const loxo_preconditioner m = {loxo_diagonal_apply, &diagonal};
    looking l = {.p = p, .c = c, .is_heat = is_heat};
    loxo_cg_settings settings = loxo_cg_settings_default();
    settings.tolerance = 1e-13;
    settings.max_iterations = 5000;
    settings.look = look;
    settings.look_user = &l;
    memset(p->x, 0, (size_t)p->m.n_vertices * sizeof *p->x);
    loxo_status status = loxo_cg_create(p->s.b->ctx, matrix, &cg);
    l.start_s = loxo_os_clock_s();
    if (status >= 0) status = loxo_cg_solve(cg, &m, &settings, b, p->x, &info);
    loxo_cg_destroy(cg);
    return status;
}

/* ---- a factor ---- */

/* Solves and adds the one point; the solution stays in x. LOXO_ERR_UNSUPPORTED without CHOLMOD. */
static loxo_status run_factor(subject *p, const loxo_csr *matrix, const double *b, double *x, double *seconds)
{
    loxo_cholesky *factor = NULL;
    const double start = loxo_os_clock_s();
    loxo_status status = loxo_cholesky_create(p->s.b->ctx, matrix, NULL, &factor);
    if (status >= 0) status = loxo_cholesky_factor(factor, matrix);
    if (status >= 0) status = loxo_cholesky_solve(factor, b, x);
    *seconds = loxo_os_clock_s() - start;
    loxo_cholesky_destroy(factor);
    return status;
}

/* ---- the parallel heat method ---- */

/* Heat of a setting as plain numbers: the residual cares for the large ones only, which lie near the source. */
static loxo_status add_heat(subject *p, const char *method, curve *c)
{
    const loxo_index source = 0;
    loxo_context *ctx = p->s.b->ctx;
    loxo_geodesic_settings settings;
    loxo_geodesic *geodesic = NULL;
    loxo_geodesic_info info = {0};
    loxo_status status = paper_method_settings(p->s.b, method, &settings);
    if (status >= 0) status = loxo_geodesic_create(ctx, p->mesh, &settings, &geodesic);
    if (status >= 0) status = loxo_geodesic_solve(geodesic, &source, 1, p->s.distance, &info);
    if (status >= 0 || status == LOXO_ERR_NUMERIC) status = loxo_geodesic_heat(geodesic, p->heat_value, p->heat_scale);
    if (status >= 0) {
        for (int64_t v = 0; v < p->m.n_vertices; ++v)
            p->x[v] = ldexp(p->heat_value[v], p->heat_scale[v]) / (info.mean_edge_length * info.mean_edge_length);
        add_point(c, info.phase_s[LOXO_GEODESIC_PHASE_LEVELS] + info.phase_s[LOXO_GEODESIC_PHASE_DIFFUSION],
                  heat_residual(p, p->x));
    }
    loxo_geodesic_destroy(geodesic);
    return status;
}

static loxo_status run_diffusion(subject *p, curve *sweeps, curve *window)
{
    loxo_status status = LOXO_OK;
    char method[96];
    for (int n = 1; n <= 600 && status >= 0; n += n < 20 ? 1 : n < 200 ? 10 : 50) {
        snprintf(method, sizeof method, "edge,iterations=0,diffusion=sweeps,sweeps=%d", n);
        status = add_heat(p, method, sweeps);
    }
    for (int k = 0; k <= 16 && status >= 0; ++k) {
        snprintf(method, sizeof method, "edge,iterations=0,diffusion-tolerance=%g", pow(10.0, -0.75 * k));
        status = add_heat(p, method, window);
    }
    return status;
}

static loxo_status run_admm(subject *p, const char *name, curve *c)
{
    static const int iterations[] = {1, 2, 3, 5, 7, 10, 15, 20, 30, 50, 75, 100, 150, 200, 300, 500, 1000, 2000};
    const loxo_index source = 0;
    loxo_status status = LOXO_OK;
    for (size_t i = 0; i < sizeof iterations / sizeof iterations[0] && status >= 0; ++i) {
        char method[128];
        loxo_geodesic_settings settings;
        loxo_geodesic *geodesic = NULL;
        loxo_geodesic_info info = {0};
        snprintf(method, sizeof method, "%s,primal-tolerance=0,dual-tolerance=0,iterations=%d", name, iterations[i]);
        status = paper_method_settings(p->s.b, method, &settings);
        if (status >= 0) status = loxo_geodesic_create(p->s.b->ctx, p->mesh, &settings, &geodesic);
        if (status >= 0)
            status =
                loxo_geodesic_solve_from_heat(geodesic, &source, 1, p->heat_value, p->heat_scale, p->s.distance, &info);
        loxo_geodesic_destroy(geodesic);
        if (status >= 0)
            add_point(c,
                      info.phase_s[LOXO_GEODESIC_PHASE_GRADIENT] + info.phase_s[LOXO_GEODESIC_PHASE_ADMM] +
                          info.phase_s[LOXO_GEODESIC_PHASE_INTEGRATE],
                      distance_error(p, p->s.distance));
    }
    return status;
}

/* ---- systems ---- */

static void load(const loxo_mesh_view *m, loxo_index v, double x[3])
{
    for (int k = 0; k < 3; ++k)
        x[k] = m->position != NULL ? m->position[v][k] : (double)m->position_float[v][k];
}

static void cross(const double a[3], const double b[3], double c[3])
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

/* Right side of (9) for the least squares of |grad d - h|^2: b_i = sum over its faces of area grad phi_i . h, with
 * grad phi_i = n x e_i / (2 area), e_i the side opposite i, n the unit normal, and h = -grad u / |grad u|. On one face
 * heats are taken in the unit of the largest, since they may differ by more than a double holds. */
static void find_divergence(subject *p)
{
    const loxo_mesh_view *m = &p->m;
    memset(p->divergence, 0, (size_t)m->n_vertices * sizeof *p->divergence);
    for (int64_t f = 0; f < m->n_faces; ++f) {
        const loxo_index *v = &m->halfedge_vertex[3 * f];
        double x[3][3], side[3][3], normal[3], turned[3][3], gradient[3] = {0.0, 0.0, 0.0}, length = 0.0;
        int32_t scale = p->heat_scale[v[0]];
        for (int c = 0; c < 3; ++c) {
            load(m, v[c], x[c]);
            if (p->heat_scale[v[c]] > scale) scale = p->heat_scale[v[c]];
        }
        for (int c = 0; c < 3; ++c)
            for (int k = 0; k < 3; ++k)
                side[c][k] = x[(c + 2) % 3][k] - x[(c + 1) % 3][k];
        cross(side[0], side[1], normal);
        const double double_area = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
        if (!(double_area > 0.0)) continue;
        for (int k = 0; k < 3; ++k)
            normal[k] /= double_area;
        for (int c = 0; c < 3; ++c) {
            const double u = ldexp(p->heat_value[v[c]], p->heat_scale[v[c]] - scale);
            cross(normal, side[c], turned[c]);
            for (int k = 0; k < 3; ++k)
                gradient[k] += u * turned[c][k];
        }
        for (int k = 0; k < 3; ++k)
            length += gradient[k] * gradient[k];
        length = sqrt(length);
        if (!(length > 0.0)) continue;
        for (int c = 0; c < 3; ++c)
            for (int k = 0; k < 3; ++k)
                p->divergence[v[c]] -= 0.5 * turned[c][k] * gradient[k] / length;
    }
}

static loxo_status open_subject(bench *b, const char *model, double n_wanted, subject *p)
{
    loxo_mesh_settings given = loxo_mesh_settings_default();
    bench_direct_info info;
    const loxo_index source = 0;
    *p = (subject){0};
    loxo_status status = paper_subject_open(b, model, n_wanted, false, &p->s);
    if (status < 0) return status;
    const int64_t n = p->s.soup.n_vertices;
    given.order = LOXO_ORDER_GIVEN;
    if ((status = loxo_mesh_create(b->ctx, &p->s.arrays, LOXO_BORROW, &given, NULL, &p->mesh)) < 0) return status;
    p->m = loxo_mesh_get_view(p->mesh);
    double **const arrays[] = {&p->delta, &p->divergence, &p->direct, &p->x, &p->residual, &p->heat_value};
    for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; ++i)
        if ((*arrays[i] = loxo_allocate(b->ctx, n, sizeof **arrays[i])) == NULL) return LOXO_ERR_MEMORY;
    p->heat_scale = loxo_allocate(b->ctx, n, sizeof *p->heat_scale);
    bool *is_pinned = loxo_allocate(b->ctx, n, sizeof *is_pinned);
    if (p->heat_scale == NULL || is_pinned == NULL) {
        loxo_release(b->ctx, is_pinned);
        return LOXO_ERR_MEMORY;
    }
    for (int64_t v = 0; v < n; ++v) {
        p->delta[v] = v == source ? 1.0 : 0.0;
        is_pinned[v] = v == source;
    }
    status = loxo_laplacian_create(b->ctx, &p->m, &p->poisson, NULL);
    if (status >= 0) status = loxo_laplacian_create(b->ctx, &p->m, &p->heat, p->x);
    if (status >= 0)
        status = bench_direct_heat(b->ctx, &p->s.arrays, 1.0, &source, 1, p->heat_value, p->heat_scale, &info);
    if (status >= 0) {
        p->time = info.time;
        loxo_csr_scale_shift(b->ctx, &p->heat, p->time, p->x);
        loxo_csr_pin(b->ctx, &p->poisson, is_pinned);
        find_divergence(p);
        p->divergence[source] = 0.0;
    }
    loxo_release(b->ctx, is_pinned);
    return status;
}

static void close_subject(bench *b, subject *p)
{
    double *const arrays[] = {p->delta, p->divergence, p->direct, p->x, p->residual, p->heat_value};
    for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; ++i)
        loxo_release(b->ctx, arrays[i]);
    loxo_release(b->ctx, p->heat_scale);
    loxo_csr_destroy(b->ctx, &p->heat);
    loxo_csr_destroy(b->ctx, &p->poisson);
    loxo_mesh_destroy(p->mesh);
    if (p->s.b != NULL) paper_subject_close(&p->s);
}

/* ---- tables and plots ---- */

/* The least seconds in which a curve was below shares of the reference, which is where conjugate gradients start. */
static void add_rows(bench *b, bench_table *table, const char *mesh, const char *what, const curve *c, double reference)
{
    char text[4][32];
    int best = -1;
    for (int i = 0; i < c->n; ++i)
        if (best < 0 || c->error[i] < c->error[best]) best = i;
    const double bounds[] = {1e-2, 1e-4, 1e-6};
    for (int k = 0; k < 3; ++k) {
        double seconds = (double)NAN;
        for (int i = 0; i < c->n; ++i)
            if (c->error[i] <= bounds[k] * reference) seconds = fmin(seconds, c->seconds[i]);
        paper_number(seconds, text[k], 32);
    }
    paper_number(best < 0 ? (double)NAN : c->error[best], text[3], 32);
    bench_table_row(table, "%s|%s|%s|%s|%s|%s", mesh, what, text[0], text[1], text[2], text[3]);
    for (int i = 0; i < c->n; ++i)
        bench_record(b, "fig13",
                     json_pack("{s:s, s:s, s:f, s:o}", "mesh", mesh, "curve", what, "seconds", c->seconds[i], "error",
                               paper_json(c->error[i])));
}

static loxo_status plot(bench *b, const char *mesh, const char *what, const char *title, const char *y_title, int n,
                        const curve *const *curves, const char *const *names)
{
    char text[128], suffix[64];
    loxo_plot_series series[4];
    loxo_plot p = loxo_plot_default();
    for (int i = 0; i < n; ++i)
        series[i] = (loxo_plot_series){.name = names[i],
                                       .style = curves[i]->n < 40 ? LOXO_PLOT_BOTH : LOXO_PLOT_LINE,
                                       .n = curves[i]->n,
                                       .x = curves[i]->seconds,
                                       .y = curves[i]->error};
    snprintf(text, sizeof text, "Figure 13: %s, %s", title, mesh);
    snprintf(suffix, sizeof suffix, "%s-%s", what, mesh);
    p.title = text;
    p.x_title = "time, s";
    p.y_title = y_title;
    p.x_scale = p.y_scale = LOXO_PLOT_LOG;
    p.y_max = 10.0 * curves[0]->error[0]; /* sweeps may diverge, out of the picture */
    p.n_series = n;
    p.series = series;
    return paper_plot(b, suffix, &p);
}

static loxo_status measure(bench *b, const char *model, double n_wanted, bench_table *table)
{
    static curve cg, sweeps, window, factor, poisson_cg, face, edge, poisson_factor; /* large */
    static curve *const all[] = {&cg, &sweeps, &window, &factor, &poisson_cg, &face, &edge, &poisson_factor};
    static const char *const heat_names[] = {"conjugate gradients", "the paper's sweeps", "marching window", "factor"};
    static const char *const distance_names[] = {"conjugate gradients", "face-based ADMM", "edge-based ADMM",
                                                 "factor, the reference itself"};
    subject p;
    double seconds = 0.0;
    for (size_t i = 0; i < sizeof all / sizeof all[0]; ++i)
        all[i]->n = 0;
    loxo_status status = open_subject(b, model, n_wanted, &p);
    if (status < 0) {
        close_subject(b, &p);
        return status == LOXO_ERR_UNSUPPORTED ? LOXO_OK : status;
    }
    bench_say(b, "%s, %lld vertices\n", model, (long long)p.m.n_vertices);
    /* The distances first: their directions come from the directly solved heat, which the diffusion then overwrites. */
    if ((status = run_factor(&p, &p.poisson, p.divergence, p.direct, &seconds)) < 0) goto done;
    if ((status = run_cg(&p, &p.poisson, p.divergence, false, &poisson_cg)) < 0) goto done;
    for (int i = 0; i < 2; ++i) /* as an upright line: its error is 0 */
        add_point(&poisson_factor, seconds, i == 0 ? poisson_cg.error[0] : poisson_cg.error[poisson_cg.n - 1]);
    if ((status = run_admm(&p, "face", &face)) < 0 || (status = run_admm(&p, "edge", &edge)) < 0) goto done;
    if ((status = run_factor(&p, &p.heat, p.delta, p.x, &seconds)) < 0) goto done;
    add_point(&factor, seconds, heat_residual(&p, p.x));
    if ((status = run_cg(&p, &p.heat, p.delta, true, &cg)) < 0) goto done;
    if ((status = run_diffusion(&p, &sweeps, &window)) < 0) goto done;

    const curve *const heats[] = {&cg, &sweeps, &window, &factor}, *const distances[] = {&poisson_cg, &face, &edge,
                                                                                         &poisson_factor};
    for (int i = 0; i < 3; ++i)
        add_rows(b, table, model,
                 i == 0   ? "heat: conjugate gradients"
                 : i == 1 ? "heat: sweeps (7)"
                          : "heat: marching",
                 heats[i], cg.error[0]);
    for (int i = 0; i < 3; ++i)
        add_rows(b, table, model,
                 i == 0   ? "distance: conjugate gradients"
                 : i == 1 ? "distance: ADMM on faces"
                          : "distance: ADMM on edges",
                 distances[i], poisson_cg.error[0]);
    bench_say(b, "factor and one solve: heat %.3f s, residual %.1e; distance %.3f s\n", factor.seconds[0],
              factor.error[0], poisson_factor.seconds[0]);
    status = plot(b, model, "heat", "residual of the heat equation", "residual, eq. (30)", 4, heats, heat_names);
    if (status >= 0)
        status = plot(b, model, "distance", "distance from the same directions", "difference, eq. (31)", 4, distances,
                      distance_names);
done:
    if (status == LOXO_ERR_UNSUPPORTED) bench_say(b, "%s: %s\n", model, bench_message(b));
    close_subject(b, &p);
    return status == LOXO_ERR_UNSUPPORTED ? LOXO_OK : status;
}

loxo_status paper_tao2021_fig13(bench *b)
{
    static bench_table table; /* large */
    bench_table_begin(&table, "mesh|curve|1e-2 of CG's start, s|1e-4, s|1e-6, s|least");
    loxo_status status = measure(b, "armadillo", 50000.0, &table);
    if (status >= 0) status = measure(b, "bumpy", 250000.0 * b->settings.share, &table);
    if (status < 0) return status;
    bench_say(b, "\n");
    bench_table_print(b, &table);
    bench_say(
        b,
        "Paper: curves without numbers, where sweeps and ADMM gain accuracy faster than conjugate gradients. What\n"
        "differs: matrices are assembled before the clock starts, for all alike; h comes from the directly solved\n"
        "heat for the right half. The residual (30) is decided near the source, where heat is large: it says little\n"
        "of the directions far away, which Figure 2 shows; our rows are in single precision, so it stays at 2e-8.\n"
        "On the scan, some of whose cotangent weights are negative, the paper's sweeps diverge in the end. (31) "
        "compares\n"
        "with the Poisson solution, to which ADMM converges in its face-based form (10), (11); the edge-based one\n"
        "minimises another sum (20).\n");
    return LOXO_OK;
}
