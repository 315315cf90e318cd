/* SPDX-License-Identifier: MIT
 * Newton's method on unit vectors: the least energy of all maps whose area-weighted mean is the centre. README.md, «newton». */
#include "base/allocate.h"
#include "kernel/conformal_kernel.h"
#include "optim/steihaug.h"
#include "par/range.h"
#include "solver/sphere/tangent.h"

#include <string.h>

#define EIGHT_PI 25.132741228718345
/* Relative residual of the linear systems: this, or the residual itself where that is less, for quadratic convergence. */
#define LOOSEST_FORCING   0.1
#define TIGHTEST_FORCING  1e-8
#define FORCING_FACTOR    1e-3
#define LEAST_SHIFT       0.25
#define MOST_SHIFT        1e6
#define MOST_LINEAR_STEPS 500
/* Falls of the energy below this share of 4 pi cannot be told from rounding. */
#define ROUNDING 2e-14
/* A vertex whose steps had to be changed so many times on end, while the gradient was below CALM, is held. */
#define MARKS_TO_HOLD 3
#define CALM          1e-2
/* A step is found to more digits where it turns over faces at more than one vertex in so many; it is shortened down to this share. */
#define FEW            1000
#define SHORTEST_SCALE 1e-3

typedef struct newton_state {
    sphere_tangent tangent;
    sphere_map f, trial;
    double *d, *work;
    unsigned char *mark, *n_marks; /* [n] of the last step; how many times on end */
    double value;
    sphere_energy energy;
    double shift, forcing;
    int64_t n_evaluations, n_linear_steps, n_held;
} newton_state;

size_t sphere_newton_bytes(int64_t n_vertices, int64_t n_faces)
{
    const size_t vectors = 3 * (2 + LOXO_STEIHAUG_WORK) * sizeof(double);
    return (size_t)n_vertices * (vectors + 2) + sphere_tangent_bytes(n_vertices, n_faces);
}

static loxo_status begin(newton_state *s, const sphere_problem *p, const sphere_pull *pull, sphere_map f)
{
    const int64_t n = p->m.n_vertices;
    loxo_context *ctx = p->ctx;
    *s = (newton_state){.f = f, .tangent.p = p};
    const loxo_status status = sphere_tangent_create(p, pull, (sphere_const_map)f, &s->tangent);
    if (status < 0) return status;
    s->trial = loxo_allocate(ctx, n, sizeof *s->trial);
    s->d = loxo_allocate(ctx, 3 * n, sizeof *s->d);
    s->work = loxo_allocate(ctx, 3 * n * LOXO_STEIHAUG_WORK, sizeof *s->work);
    s->mark = loxo_allocate_zero(ctx, n, sizeof *s->mark);
    s->n_marks = loxo_allocate_zero(ctx, n, sizeof *s->n_marks);
    if (s->trial == NULL || s->d == NULL || s->work == NULL || s->mark == NULL || s->n_marks == NULL)
        return LOXO_ERR_MEMORY;
    return LOXO_OK;
}

static void end(newton_state *s)
{
    loxo_context *ctx = s->tangent.p->ctx;
    loxo_release(ctx, s->n_marks);
    loxo_release(ctx, s->mark);
    loxo_release(ctx, s->work);
    loxo_release(ctx, s->d);
    loxo_release(ctx, s->trial);
    sphere_tangent_destroy(&s->tangent);
}

/* The preconditioner is the inverse of L up to a factor: makes that about 1, so that norms of steps are those of Dirichlet energies. */
static loxo_status calibrate(newton_state *s)
{
    sphere_tangent *t = &s->tangent;
    const int64_t n = 3 * t->p->m.n_vertices;
    double *z = s->work, *hz = s->work + n, rz, zhz;
    const double *g = t->gradient[0];
    sphere_tangent_precondition(t, g, z);
    loxo_status status = sphere_tangent_hessian(t, z, hz);
    if (status >= 0) status = loxo_dot(t->p->ctx, n, g, z, &rz);
    if (status >= 0) status = loxo_dot(t->p->ctx, n, z, hz, &zhz);
    if (status < 0) return status;
    if (zhz > 0.0 && rz > 0.0 && isfinite(rz / zhz)) t->precondition_scale = exp2((double)ilogb(rz / zhz));
    return LOXO_OK;
}

/* Holds vertices whose steps are changed again and again, so that the others can converge. */
static void count_marks(newton_state *s)
{
    const int64_t n = s->tangent.p->m.n_vertices;
    for (int64_t i = 0; i < n; ++i) {
        s->n_marks[i] = (unsigned char)(s->mark[i] != 0 ? s->n_marks[i] + 1 : 0);
        if (s->n_marks[i] < MARKS_TO_HOLD || s->tangent.is_held[i]) continue;
        s->tangent.is_held[i] = true;
        ++s->n_held;
    }
}

static int64_t few(const sphere_problem *p) { return p->m.n_vertices / FEW + 3; }

/* The model's step. Where it turns over many faces, it is found again to more digits: what is small in the image is moved along with
 * what it hangs on, and so has to be moved as accurately as it is small. */
static loxo_status find_step(newton_state *s, double forcing, loxo_steihaug_info *how)
{
    sphere_tangent *t = &s->tangent;
    const sphere_problem *p = t->p;
    const loxo_quadratic model = {.ctx = p->ctx,
                                  .n = 3 * p->m.n_vertices,
                                  .state = t,
                                  .hessian_times = sphere_tangent_hessian,
                                  .precondition = sphere_tangent_precondition};
    const double floor = p->settings.tolerance * sqrt(EIGHT_PI);
    double asked = fmin(forcing, s->forcing);
    for (;;) {
        t->shift = s->shift;
        const loxo_status status =
            loxo_steihaug(&model, t->gradient[0], HUGE_VAL, asked, floor, MOST_LINEAR_STEPS, s->work, s->d, how);
        t->shift = 0.0;
        if (status < 0 || how->n_iterations == 0) return status;
        s->n_linear_steps += how->n_iterations;
        if (how->stop_reason == LOXO_STEIHAUG_MONITOR) return LOXO_STOPPED;
        if (how->stop_reason != LOXO_STEIHAUG_CURVATURE) {
            sphere_move(p, (sphere_const_map)s->f, s->d, s->trial);
            if (sphere_mark_bad(p, (sphere_const_map)s->f, (sphere_const_map)s->trial, s->mark) <= few(p))
                return LOXO_OK;
            if (asked > TIGHTEST_FORCING) {
                s->forcing = asked = fmax(TIGHTEST_FORCING, FORCING_FACTOR * asked);
                continue;
            }
        }
        if (s->shift >= MOST_SHIFT) return LOXO_OK;
        s->shift = fmax(LEAST_SHIFT, 4.0 * s->shift);
    }
}

/* The longest of d, d/2, d/4 ... that can be made to turn no face over. *scale: of d. */
static loxo_status guard(newton_state *s, double *scale, bool *is_changed)
{
    const sphere_problem *p = s->tangent.p;
    const int64_t n = p->m.n_vertices;
    double *whole = s->work + 9 * n;
    memcpy(whole, s->d, 3 * (size_t)n * sizeof *whole);
    for (*scale = 1.0; *scale > SHORTEST_SCALE; *scale *= 0.5) {
        int64_t n_bad;
        for (int64_t i = 0; i < 3 * n; ++i)
            s->d[i] = *scale * whole[i];
        const loxo_status status =
            sphere_guard(p, (sphere_const_map)s->f, s->d, n / 10 + 3, s->work, s->mark, s->trial, &n_bad);
        if (status != LOXO_OK) return status;
        if (n_bad > 0) continue;
        *is_changed = *scale < 1.0 || memchr(s->mark, 1, (size_t)n) != NULL;
        return LOXO_OK;
    }
    *scale = 0.0;
    return LOXO_OK;
}

/* What the model says of the step as it was made. */
static loxo_status find_fall(newton_state *s, double *fall)
{
    const sphere_problem *p = s->tangent.p;
    const int64_t n = p->m.n_vertices;
    double slope, curvature, *hd = s->work;
    loxo_status status = sphere_tangent_hessian(&s->tangent, s->d, hd);
    if (status >= 0) status = loxo_dot(p->ctx, 3 * n, s->tangent.gradient[0], s->d, &slope);
    if (status >= 0) status = loxo_dot(p->ctx, 3 * n, s->d, hd, &curvature);
    if (status >= 0) *fall = -(slope + 0.5 * curvature);
    return status;
}

/* One step: *is_taken, and what the region's radius becomes. */
static loxo_status step(newton_state *s, double forcing, bool *is_taken, loxo_steihaug_info *how)
{
    sphere_tangent *t = &s->tangent;
    const sphere_problem *p = t->p;
    double scale;
    bool is_changed = false;
    *is_taken = false;
    loxo_status status = find_step(s, forcing, how);
    if (status != LOXO_OK || how->n_iterations == 0) return status;
    if ((status = guard(s, &scale, &is_changed)) != LOXO_OK) return status;
    how->norm *= scale;
    if (scale == 0.0) {
        s->shift = fmax(LEAST_SHIFT, 16.0 * s->shift);
        return LOXO_OK;
    }
    if ((is_changed || s->shift > 0.0) && (status = find_fall(s, &how->fall)) < 0) return status;
    if (is_changed && how->gradient_norm < CALM) count_marks(s);
    sphere_energy energy;
    double value;
    if ((status = sphere_tangent_value(t, (sphere_const_map)s->trial, &energy, &value)) < 0) return status;
    ++s->n_evaluations;
    const double fell = s->value - value, noise = ROUNDING * EIGHT_PI;
    const double ratio = fabs(how->fall) < noise && fabs(fell) < noise ? 1.0 : fell / how->fall;
    *is_taken = how->fall > -noise && ratio > 1e-4;
    if (!*is_taken || ratio < 0.25)
        s->shift = fmax(LEAST_SHIFT, 4.0 * s->shift);
    else if (ratio > 0.75 && scale == 1.0)
        s->shift = s->shift > LEAST_SHIFT ? 0.25 * s->shift : 0.0;
    if (!*is_taken) return LOXO_OK;
    s->energy = energy;
    memcpy(s->f, s->trial, (size_t)p->m.n_vertices * sizeof *s->f);
    return LOXO_OK;
}

static loxo_status iterate(newton_state *s, loxo_sphere_info *info)
{
    const sphere_problem *p = s->tangent.p;
    bool is_taken = true;
    double residual = 1.0;
    info->stop_reason = LOXO_SPHERE_STOP_MAX_ITERATIONS;
    while (info->n_iterations < p->settings.max_iterations) {
        loxo_steihaug_info how;
        loxo_status status = LOXO_OK;
        if (is_taken) {
            status = sphere_tangent_go(&s->tangent, (sphere_const_map)s->f);
            if (status >= 0) status = sphere_tangent_value(&s->tangent, (sphere_const_map)s->f, &s->energy, &s->value);
            if (status >= 0 && info->n_iterations == 0) status = calibrate(s);
        }
        if (status < 0) return status;
        const double forcing = fmax(TIGHTEST_FORCING, fmin(LOOSEST_FORCING, residual));
        status = step(s, forcing, &is_taken, &how);
        if (status < 0) return status;
        residual = how.gradient_norm / sqrt(EIGHT_PI);
        info->residual = residual;
        if (how.n_iterations == 0) {
            info->stop_reason = LOXO_SPHERE_STOP_TOLERANCE;
            return LOXO_OK;
        }
        ++info->n_iterations;
        const loxo_progress progress = {.phase = "map",
                                        .fraction = -1.0,
                                        .iteration = info->n_iterations,
                                        .n_iterations = p->settings.max_iterations,
                                        .objective = s->energy.energy,
                                        .residual = residual};
        if (loxo_progress_tell(p->ctx, &progress, true) || status == LOXO_STOPPED) {
            info->stop_reason = LOXO_SPHERE_STOP_MONITOR;
            return LOXO_STOPPED;
        }
        if (s->shift > MOST_SHIFT) {
            info->stop_reason = LOXO_SPHERE_STOP_ROUNDING;
            return LOXO_OK;
        }
    }
    return LOXO_NOT_CONVERGED;
}

loxo_status sphere_map_newton(const sphere_problem *p, const sphere_pull *pull, sphere_map f, loxo_sphere_info *info)
{
    newton_state s;
    loxo_status status = begin(&s, p, pull, f);
    sphere_note_bytes(p, info);
    s.forcing = LOOSEST_FORCING;
    info->n_iterations = 0;
    if (status >= 0) status = iterate(&s, info);
    info->n_evaluations += s.n_evaluations;
    info->n_linear_steps += s.n_linear_steps;
    info->n_held = s.n_held;
    info->energy = s.energy.energy;
    end(&s);
    return status;
}
