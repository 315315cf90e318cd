/* SPDX-License-Identifier: MIT
 * Algorithm 1: the conformal energy in the angles of the sphere, by a trust region in the plane of the gradient and of Newton's step.
 *
 * source  Tan, Li, Lin, Yau 2024, section 4 */
#include "algebra/cholesky.h"
#include "base/allocate.h"
#include "optim/subspace.h"
#include "par/range.h"
#include "solver/sphere/hbtr_internal.h"

#include <float.h>
#include <string.h>

/* The first radius: that of a mean angle's change by so much. */
#define FIRST_MOVE 0.1
/* Newton's step is mended once where its residual is above this share of the gradient: factors without exchanges lose digits. */
#define RESIDUAL_TO_MEND 1e-12

typedef struct hbtr_state {
    const sphere_problem *p;
    loxo_sphere_info *info;
    loxo_csr h;
    loxo_cholesky *factor;
    k_chart_frame *frame;    /* [n] of the angles that derivatives were last asked for */
    double (*f)[3], (*g)[3]; /* [n] maps */
    double *rest;            /* [2 n] */
} hbtr_state;

/* f out: the map of angles x. */
static void find_map(const sphere_problem *p, const double *x, sphere_map f)
{
    const int64_t n = p->m.n_vertices;
#pragma omp parallel num_threads(loxo_threads_for(p->ctx, n, 60.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i)
            v3_store(f[i], k_chart_frame_of(x[2 * i], x[2 * i + 1]).f);
    }
}

/* sums: area of the image, all of it positive. */
static void add_area(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const hbtr_state *s = arg;
    const loxo_index *v = s->p->m.halfedge_vertex + 3 * begin;
    double area = 0.0;
    for (int64_t t = begin; t < end; ++t, v += 3) {
        double side;
        area += 0.5 * v3_norm(k_image_normal(v3_load(s->f[v[0]]), v3_load(s->f[v[1]]), v3_load(s->f[v[2]]), &side));
    }
    sums[0] += area;
}

/* (3.3) as the paper has it. With signs the area of a flat triangle jumps where it turns over, by that of its plane's slant: steps end there
 * that the derivatives would have go on. */
static loxo_status find_value(void *state, const double *x, double *value, double *rounding)
{
    hbtr_state *s = state;
    sphere_energy energy;
    find_map(s->p, x, s->f);
    double area;
    loxo_status status = sphere_find_energy(s->p, (sphere_const_map)s->f, &energy);
    if (status >= 0) status = loxo_sum(s->p->ctx, s->p->m.n_faces, 1, add_area, s, &area);
    if (status < 0) return status;
    *value = energy.dirichlet - area;
    *rounding =
        64.0 * DBL_EPSILON * energy.dirichlet; /* the difference of two sums of that size, from blocks of 4096 terms */
    return LOXO_OK;
}

static loxo_status find_derivatives(void *state, const double *x, double *gradient)
{
    hbtr_state *s = state;
    hbtr_find_frames(s->p, x, s->frame);
    hbtr_fill(s->p, s->frame, gradient, &s->h);
    sphere_note_bytes(s->p, s->info);
    return LOXO_OK;
}

static loxo_status multiply(void *state, const double *v, double *hv)
{
    hbtr_state *s = state;
    loxo_csr_multiply(s->p->ctx, &s->h, v, hv);
    return LOXO_OK;
}

/* rest = -g - H step, without the first; returns the largest entry in size. */
static double find_residual(hbtr_state *s, const double *g, const double *step)
{
    double most = 0.0;
    loxo_csr_multiply(s->p->ctx, &s->h, step, s->rest);
    for (int64_t i = 0; i < s->h.n_rows; ++i) {
        s->rest[i] = i == 0 ? 0.0 : -g[i] - s->rest[i];
        most = fmax(most, fabs(s->rest[i]));
    }
    return most;
}

/* (4.2): theta of the first vertex stays, since turning all of them changes nothing (Theorem 4). */
static loxo_status find_newton_step(void *state, const double *g, double *step)
{
    hbtr_state *s = state;
    const int64_t n = s->h.n_rows;
    double most = 0.0;
    loxo_status status = loxo_cholesky_factor(s->factor, &s->h);
    if (status == LOXO_ERR_NUMERIC) return LOXO_NOT_CONVERGED;
    if (status < 0) return status;
    for (int64_t i = 0; i < n; ++i) {
        step[i] = i == 0 ? 0.0 : -g[i];
        most = fmax(most, fabs(g[i]));
    }
    if ((status = loxo_cholesky_solve(s->factor, step, step)) < 0) return status;
    if (find_residual(s, g, step) > RESIDUAL_TO_MEND * most) {
        if ((status = loxo_cholesky_solve(s->factor, s->rest, s->rest)) < 0) return status;
        for (int64_t i = 0; i < n; ++i)
            step[i] += s->rest[i];
    }
    for (int64_t i = 0; i < n; ++i)
        if (!isfinite(step[i])) return LOXO_NOT_CONVERGED;
    return LOXO_OK;
}

/* (4.4) */
static loxo_status find_move(void *state, const double *from, const double *to, double *move)
{
    hbtr_state *s = state;
    find_map(s->p, from, s->g);
    find_map(s->p, to, s->f);
    return sphere_find_move(s->p->ctx, s->p->m.n_vertices, (sphere_const_map)s->g, (sphere_const_map)s->f, move);
}

static loxo_status prepare(const sphere_problem *p, loxo_sphere_info *info, hbtr_state *s, loxo_cholesky_info *factor)
{
    loxo_context *ctx = p->ctx;
    const int64_t n = p->m.n_vertices;
    *s = (hbtr_state){.p = p, .info = info};
    if (!loxo_cholesky_is_there())
        return loxo_fail(ctx, LOXO_ERR_UNSUPPORTED,
                         "hbtr: its linear systems are solved by CHOLMOD, which is not there");
    loxo_status status = hbtr_create_pattern(p, &s->h);
    if (status < 0) return status;
    memset(s->h.value, 0, (size_t)s->h.begin[2 * n] * sizeof *s->h.value);
    memset(s->h.diagonal, 0, (size_t)(2 * n) * sizeof *s->h.diagonal);
    if ((status = loxo_cholesky_create_indefinite(ctx, &s->h, 0, factor, &s->factor)) < 0) return status;
    s->frame = loxo_allocate(ctx, n, sizeof *s->frame);
    s->f = loxo_allocate(ctx, n, sizeof *s->f);
    s->g = loxo_allocate(ctx, n, sizeof *s->g);
    s->rest = loxo_allocate(ctx, 2 * n, sizeof *s->rest);
    return s->frame != NULL && s->f != NULL && s->g != NULL && s->rest != NULL ? LOXO_OK : LOXO_ERR_MEMORY;
}

static void release(loxo_context *ctx, hbtr_state *s)
{
    loxo_csr_destroy(ctx, &s->h);
    loxo_cholesky_destroy(s->factor);
    loxo_release(ctx, s->frame);
    loxo_release(ctx, s->f);
    loxo_release(ctx, s->g);
    loxo_release(ctx, s->rest);
}

static loxo_sphere_stop stop_of(loxo_subspace_stop stop)
{
    switch (stop) {
    case LOXO_SUBSPACE_TOLERANCE: return LOXO_SPHERE_STOP_TOLERANCE;
    case LOXO_SUBSPACE_ROUNDING: return LOXO_SPHERE_STOP_ROUNDING;
    case LOXO_SUBSPACE_MONITOR: return LOXO_SPHERE_STOP_MONITOR;
    default: return LOXO_SPHERE_STOP_MAX_ITERATIONS;
    }
}

loxo_status sphere_map_hbtr(const sphere_problem *p, sphere_map f, loxo_sphere_info *info)
{
    loxo_context *ctx = p->ctx;
    const int64_t n = p->m.n_vertices;
    hbtr_state s;
    loxo_cholesky_info factor = {0};
    loxo_subspace_info found;
    const loxo_subspace_problem problem = {.ctx = ctx,
                                           .n = 2 * n,
                                           .state = &s,
                                           .value = find_value,
                                           .derivatives = find_derivatives,
                                           .hessian_times = multiply,
                                           .newton = find_newton_step,
                                           .move = find_move};
    const loxo_subspace_settings settings = {.phase = "hbtr",
                                             .tolerance = p->settings.tolerance,
                                             .max_iterations = p->settings.max_iterations,
                                             .radius = FIRST_MOVE * sqrt(2.0 * (double)n)};
    double *x = NULL;
    loxo_status status = prepare(p, info, &s, &factor);
    if (status >= 0 && (x = loxo_allocate(ctx, 2 * n, sizeof *x)) == NULL) status = LOXO_ERR_MEMORY;
    if (status < 0) goto done;
    for (int64_t i = 0; i < n; ++i)
        k_chart_angles(v3_load(f[i]), &x[2 * i], &x[2 * i + 1]);
    if ((status = loxo_subspace_minimize(&problem, &settings, x, &found)) < 0) goto done;
    find_map(p, x, f);
    info->stop_reason = stop_of(found.stop_reason);
    info->n_iterations = found.n_iterations;
    info->n_evaluations = found.n_evaluations;
    info->objective = found.value;
    info->residual = found.move;
    info->workspace_bytes += factor.factor_bytes; /* CHOLMOD's, which the context does not see */
    if (found.stop_reason == LOXO_SUBSPACE_MAX_ITERATIONS) status = LOXO_NOT_CONVERGED;
    if (found.stop_reason == LOXO_SUBSPACE_MONITOR) status = LOXO_STOPPED;
done:
    loxo_release(ctx, x);
    release(ctx, &s);
    return status;
}
