/* SPDX-License-Identifier: MIT
 * Newton's method on unit vectors: the least energy of all maps whose area-weighted mean is the centre. README.md, «newton». */
#include "base/allocate.h"
#include "kernel/conformal_kernel.h"
#include "optim/steihaug.h"
#include "par/range.h"
#include "solver/sphere/tangent.h"

#include <inttypes.h>
#include <string.h>

#define EIGHT_PI 25.132741228718345
/* Relative residual of the linear systems: this, or the gradient itself where that is less, for quadratic convergence. */
#define LOOSEST_FORCING   0.1
#define TIGHTEST_FORCING  1e-6
#define FORCING_FACTOR    1e-3
#define LEAST_SHIFT       1e-3
#define MOST_SHIFT        1e6
#define MOST_LINEAR_STEPS 500
/* Falls of the energy below this share of 8 pi cannot be told from rounding. */
#define ROUNDING    2e-14
#define NOISY_STEPS 4 /* so many of them on end, and there is no more to be had */
/* A vertex whose steps had to be changed so many times, while the residual was below CALM, is held. */
#define MARKS_TO_HOLD 3
#define CALM          1e-2
/* A step is found to more digits where it turns over faces at more than one vertex in so many; it is halved so often at most. */
#define FEW           1000
#define MOST_HALVINGS 10
/* Of a step that turns over one face in so many vertices, or fewer, these are mended. */
#define MENDED 4

typedef struct newton_state {
    sphere_tangent tangent;
    sphere_map f, trial;
    double *d, *work;
    unsigned char *mark, *n_marks; /* [n] of the last step; how many times on end */
    double value;
    sphere_energy energy;
    double shift, forcing;
    int64_t n_evaluations, n_linear_steps, n_held;
    int n_noisy; /* steps on end whose falls cannot be told from rounding */
} newton_state;

size_t sphere_newton_bytes(int64_t n_vertices, int64_t n_faces)
{
    const size_t vectors = (size_t)3 * (2 + LOXO_STEIHAUG_WORK) * sizeof(double);
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

/* Holds vertices whose steps are changed again and again, so that the others can converge. Only a whole step of Newton's that is taken
 * and leaves a vertex alone clears its count: shorter ones get by what blocks the long ones. */
static void count_marks(newton_state *s, bool clears)
{
    const int64_t n = s->tangent.p->m.n_vertices;
    for (int64_t i = 0; i < n; ++i) {
        if (s->mark[i] != 0 && s->n_marks[i] < MARKS_TO_HOLD)
            ++s->n_marks[i];
        else if (s->mark[i] == 0 && clears)
            s->n_marks[i] = 0;
        if (s->n_marks[i] < MARKS_TO_HOLD || s->tangent.is_held[i]) continue;
        s->tangent.is_held[i] = true;
        ++s->n_held;
    }
}

/* trial: f moved by d. */
static void move(newton_state *s)
{
    const loxo_mesh_view *m = &s->tangent.p->m;
#pragma omp parallel num_threads(loxo_threads_for(s->tangent.p->ctx, m->n_vertices, 8.0))
    {
        const loxo_range r = loxo_thread_range(m->n_vertices);
        for (int64_t i = r.begin; i < r.end; ++i)
            v3_store(s->trial[i], k_retract(v3_load(s->f[i]), v3_load(&s->d[3 * i])));
    }
}

static int64_t few(const sphere_problem *p) { return p->m.n_vertices / FEW + 3; }

/* The model's step. Where it turns over many faces, it is found again to more digits: what is small in the image is moved along with
 * what it hangs on, and so has to be moved as accurately as it is small. */
static loxo_status find_step(newton_state *s, int64_t max_iterations, loxo_steihaug_info *how)
{
    sphere_tangent *t = &s->tangent;
    const sphere_problem *p = t->p;
    const loxo_quadratic model = {.ctx = p->ctx,
                                  .n = 3 * p->m.n_vertices,
                                  .state = t,
                                  .hessian_times = sphere_tangent_hessian,
                                  .precondition = sphere_tangent_precondition};
    loxo_steihaug_settings settings = {.radius = HUGE_VAL,
                                       .tolerance = s->forcing,
                                       .unit = sqrt(EIGHT_PI),
                                       .floor = p->settings.tolerance * sqrt(EIGHT_PI),
                                       .max_iterations = max_iterations};
    for (;;) {
        t->shift = s->shift;
        const loxo_status status = loxo_steihaug(&model, t->gradient[0], &settings, s->work, s->d, how);
        t->shift = 0.0;
        if (status < 0) return status;
        s->n_linear_steps += how->n_iterations;
        if (how->stop_reason == LOXO_STEIHAUG_MONITOR) return LOXO_STOPPED;
        if (how->n_iterations == 0) return LOXO_OK;
        if (how->stop_reason != LOXO_STEIHAUG_CURVATURE) {
            move(s);
            sphere_folds folds;
            const loxo_status found = sphere_find_folds(p, (sphere_const_map)s->trial, NULL, &folds);
            if (found < 0 || folds.n <= few(p) || settings.tolerance <= TIGHTEST_FORCING) return found;
            s->forcing = settings.tolerance = fmax(TIGHTEST_FORCING, FORCING_FACTOR * settings.tolerance);
            continue;
        }
        if (s->shift >= MOST_SHIFT) return LOXO_OK;
        s->shift = fmax(LEAST_SHIFT, 8.0 * s->shift);
    }
}

/* Marks vertices that are elsewhere than d takes them, and makes d the step to where they are. */
static bool take_changes(newton_state *s)
{
    bool is_any = false;
    for (int64_t i = 0; i < s->tangent.p->m.n_vertices; ++i) {
        const loxo_vec3 x = v3_load(s->f[i]), y = v3_load(s->trial[i]);
        const loxo_vec3 expected = k_retract(x, v3_load(&s->d[3 * i]));
        s->mark[i] = y.x != expected.x || y.y != expected.y || y.z != expected.z;
        if (s->mark[i] == 0) continue;
        is_any = true;
        /* x + d along y: the retraction undone; of what went a quarter of the way around, just what is tangent. */
        const double along = v3_dot(x, y);
        v3_store(&s->d[3 * i], along > 0.1 ? v3_sub(v3_scale(1.0 / along, y), x) : k_tangent(x, y));
    }
    return is_any;
}

/* The longest of d, d/2, d/4 ... that turns no face over, or so few that they can be mended. *scale: of d; 0: none. */
static loxo_status guard(newton_state *s, double *scale, bool *is_changed)
{
    const sphere_problem *p = s->tangent.p;
    const int64_t n = p->m.n_vertices;
    *scale = 1.0;
    for (int k = 0; k < MOST_HALVINGS; ++k) {
        sphere_folds folds;
        loxo_sphere_info mended = {.n_folds = 0};
        move(s);
        loxo_status status = sphere_find_folds(p, (sphere_const_map)s->trial, NULL, &folds);
        if (status < 0) return status;
        *is_changed = *scale < 1.0;
        if (folds.n == 0 && folds.degree == 1) return LOXO_OK;
        if (folds.n <= n / MENDED + 8 && folds.degree == 1) {
            if ((status = sphere_unfold(p, s->trial, &mended)) != LOXO_OK) return status;
            if (mended.n_folds == 0) {
                *is_changed = take_changes(s) || *is_changed;
                return LOXO_OK;
            }
        }
        *scale *= 0.5;
        for (int64_t i = 0; i < 3 * n; ++i)
            s->d[i] *= 0.5;
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

/* Whether a step is taken, and what that says of the next ones. */
static bool decide(newton_state *s, double fall, double fell, bool is_whole)
{
    const double noise = ROUNDING * EIGHT_PI;
    const bool is_noisy = fabs(fall) < noise && fabs(fell) < noise;
    const double ratio = is_noisy ? 1.0 : fall > 0.0 ? fell / fall : -1.0;
    const bool is_taken = ratio > 1e-4 && fell > -noise;
    s->n_noisy = is_noisy ? s->n_noisy + 1 : 0;
    if (!is_taken || ratio < 0.25)
        s->shift = fmax(LEAST_SHIFT, 8.0 * s->shift);
    else if (ratio > 0.75 && is_whole)
        s->shift = s->shift > LEAST_SHIFT ? 0.125 * s->shift : 0.0;
    return is_taken;
}

/* One step. how->n_iterations 0: none is needed. */
static loxo_status step(newton_state *s, bool *is_taken, loxo_steihaug_info *how)
{
    sphere_tangent *t = &s->tangent;
    const sphere_problem *p = t->p;
    double scale;
    bool is_changed = false;
    *is_taken = false;
    memset(s->mark, 0, (size_t)p->m.n_vertices);
    loxo_status status = find_step(s, MOST_LINEAR_STEPS, how);
    if (status != LOXO_OK || how->n_iterations == 0) return status;
    if ((status = guard(s, &scale, &is_changed)) != LOXO_OK) return status;
    if (scale == 0.0) {
        s->shift = fmax(LEAST_SHIFT, 16.0 * s->shift);
        return LOXO_OK;
    }
    if ((is_changed || s->shift > 0.0) && (status = find_fall(s, &how->fall)) < 0) return status;
    sphere_energy energy;
    double value;
    if ((status = sphere_tangent_value(t, (sphere_const_map)s->trial, &energy, &value)) < 0) return status;
    ++s->n_evaluations;
    const bool is_newtons = s->shift == 0.0 && scale == 1.0;
    *is_taken = decide(s, how->fall, s->value - value, scale == 1.0);
    if (scale == 1.0 && how->gradient_norm < CALM * sqrt(EIGHT_PI)) count_marks(s, *is_taken && is_newtons);
    if (!*is_taken) return LOXO_OK;
    s->energy = energy;
    memcpy(s->f, s->trial, (size_t)p->m.n_vertices * sizeof *s->f);
    return LOXO_OK;
}

/* Goes to the map as it is. */
static loxo_status arrive(newton_state *s, bool is_first)
{
    loxo_status status = sphere_tangent_go(&s->tangent, (sphere_const_map)s->f);
    if (status >= 0) status = sphere_tangent_value(&s->tangent, (sphere_const_map)s->f, &s->energy, &s->value);
    ++s->n_evaluations;
    return status >= 0 && is_first ? calibrate(s) : status;
}

static loxo_status iterate(newton_state *s, loxo_sphere_info *info)
{
    const sphere_problem *p = s->tangent.p;
    bool is_taken = true;
    for (;;) {
        loxo_steihaug_info how;
        const bool is_last = info->n_iterations >= p->settings.max_iterations;
        loxo_status status = is_taken ? arrive(s, info->n_iterations == 0) : LOXO_OK;
        if (status >= 0) status = is_last ? find_step(s, 0, &how) : step(s, &is_taken, &how);
        if (status < 0) return status;
        info->residual = how.gradient_norm / sqrt(EIGHT_PI);
        info->energy = s->energy.energy;
        if (status == LOXO_STOPPED || (how.n_iterations > 0 && sphere_tell(p, "map", true, info))) {
            info->stop_reason = LOXO_SPHERE_STOP_MONITOR;
            return LOXO_STOPPED;
        }
        if (how.n_iterations == 0 && (!is_last || info->residual <= p->settings.tolerance)) {
            info->stop_reason = LOXO_SPHERE_STOP_TOLERANCE;
            return LOXO_OK;
        }
        if (s->n_noisy >= NOISY_STEPS) {
            info->stop_reason = LOXO_SPHERE_STOP_ROUNDING;
            return LOXO_OK;
        }
        info->stop_reason = is_last ? LOXO_SPHERE_STOP_MAX_ITERATIONS : LOXO_SPHERE_STOP_STALLED;
        if (is_last || s->shift > MOST_SHIFT)
            return loxo_fail(
                p->ctx, LOXO_NOT_CONVERGED, "sphere: newton ended after %" PRId64 " steps with a residual of %.2g: %s",
                info->n_iterations, info->residual, is_last ? "no more were allowed" : "no step lowers the energy");
        ++info->n_iterations;
    }
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
