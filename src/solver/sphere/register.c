/* SPDX-License-Identifier: MIT
 * Registration, Algorithm 3: both surfaces to the sphere, the moving one's map drawn to the landmarks of the fixed one's, and back. */
#include "base/allocate.h"
#include "base/options.h"
#include "base/os.h"
#include "kernel/conformal_kernel.h"
#include "par/range.h"
#include "solver/sphere/hbtr_internal.h"
#include "solver/sphere/register_internal.h"
#include "solver/sphere/sphere_internal.h"

#include <inttypes.h>
#include <string.h>

struct loxo_register {
    loxo_context *ctx;
    loxo_register_settings settings;
    int64_t n_vertices;
    loxo_index *order;      /* [n_vertices] the fixed mesh's number of each caller's vertex */
    double *position, *map; /* [n_vertices][3], caller's order */
    loxo_sphere_locator *locator;
    loxo_landmarks landmarks;
};

/* ---- the fixed surface --------------------------------------------------------------------------------------- */

/* An own block of n items; NULL: no memory. */
static void *copy_of(loxo_context *ctx, const void *from, int64_t n, size_t size)
{
    void *to = loxo_allocate(ctx, n, size);
    if (to != NULL && n > 0) memcpy(to, from, (size_t)n * size);
    return to;
}

static loxo_status copy_landmarks(loxo_context *ctx, const loxo_landmarks *from, loxo_landmarks *to)
{
    *to = (loxo_landmarks){.n_curves = from->n_curves, .n_points = from->n_points};
    to->name = copy_of(ctx, from->name, from->n_curves, sizeof *from->name);
    to->is_closed = copy_of(ctx, from->is_closed, from->n_curves, sizeof *from->is_closed);
    to->curve_begin = copy_of(ctx, from->curve_begin, from->n_curves + 1, sizeof *from->curve_begin);
    to->point = copy_of(ctx, from->point, from->n_points, sizeof *from->point);
    to->position = copy_of(ctx, from->position, from->n_points, sizeof *from->position);
    return to->name == NULL || to->is_closed == NULL || to->curve_begin == NULL || to->point == NULL ||
                   to->position == NULL
               ? LOXO_ERR_MEMORY
               : LOXO_OK;
}

/* Landmarks of a surface with all points on it. to: cleared; to be destroyed after a failure, too. */
static loxo_status take_landmarks(loxo_context *ctx, const loxo_mesh *mesh, const loxo_landmarks *from,
                                  loxo_landmarks *to)
{
    if (from == NULL || from->n_curves < 1 || from->n_points < from->n_curves || from->name == NULL ||
        from->is_closed == NULL || from->curve_begin == NULL || from->point == NULL || from->position == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "register: there are no landmarks");
    for (int64_t i = 0; i < from->n_curves; ++i)
        if (from->curve_begin[0] != 0 || from->curve_begin[i + 1] <= from->curve_begin[i] ||
            from->curve_begin[i + 1] > from->n_points || memchr(from->name[i], 0, sizeof *from->name) == NULL)
            return loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, (loxo_place){.byte = -1, .element = i},
                                "register: landmark curve %" PRId64 " has no points, or a name without an end", i);
    const loxo_status status = copy_landmarks(ctx, from, to);
    return status < 0 ? status : loxo_landmarks_locate(mesh, to, NULL);
}

static loxo_status fill(loxo_register *r, const loxo_mesh *fixed, const loxo_landmarks *landmarks,
                        loxo_sphere_info *info)
{
    loxo_context *ctx = r->ctx;
    loxo_sphere *sphere = NULL;
    r->map = loxo_allocate(ctx, 3 * r->n_vertices, sizeof *r->map);
    r->order = loxo_allocate(ctx, r->n_vertices, sizeof *r->order);
    if (r->map == NULL || r->order == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = take_landmarks(ctx, fixed, landmarks, &r->landmarks);
    if (status < 0) return status;
    if ((status = loxo_mesh_vertex_order(fixed, r->order)) < 0) return status;
    if ((r->position = register_positions(ctx, fixed, r->order)) == NULL) return LOXO_ERR_MEMORY;
    status = loxo_sphere_create(ctx, fixed, &r->settings.sphere, &sphere);
    if (status >= 0) status = loxo_sphere_solve(sphere, NULL, r->map, info);
    loxo_sphere_destroy(sphere);
    if (status < 0) return status;
    const loxo_status made = loxo_sphere_locator_create(ctx, fixed, r->map, &r->locator);
    return made < 0 ? made : status;
}

loxo_status loxo_register_create(loxo_context *ctx, const loxo_mesh *fixed, const loxo_landmarks *landmarks,
                                 const loxo_register_settings *settings, loxo_sphere_info *info, loxo_register **out)
{
    const loxo_register_settings chosen = settings != NULL ? *settings : loxo_register_settings_default();
    if (ctx == NULL || out == NULL) return LOXO_ERR_ARGUMENT;
    *out = NULL;
    if (fixed == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "register: the fixed mesh is NULL");
    loxo_status status = loxo_options_check(ctx, "register", loxo_register_options, &chosen);
    if (status < 0) return status;
    loxo_register *r = loxo_allocate_zero(ctx, 1, sizeof *r);
    if (r == NULL) return LOXO_ERR_MEMORY;
    r->ctx = ctx;
    r->settings = chosen;
    r->n_vertices = loxo_mesh_n_vertices(fixed);
    loxo_progress_enter(ctx);
    status = fill(r, fixed, landmarks, info);
    loxo_progress_leave(ctx);
    if (status < 0) {
        loxo_register_destroy(r);
        return status;
    }
    *out = r;
    return status;
}

void loxo_register_destroy(loxo_register *r)
{
    if (r == NULL) return;
    loxo_landmarks_destroy(r->ctx, &r->landmarks);
    loxo_sphere_locator_destroy(r->locator);
    loxo_release(r->ctx, r->map);
    loxo_release(r->ctx, r->position);
    loxo_release(r->ctx, r->order);
    loxo_release(r->ctx, r);
}

const double *loxo_register_fixed_map(const loxo_register *r) { return r == NULL ? NULL : r->map; }

/* ---- the moving surface -------------------------------------------------------------------------------------- */

/* One solve. */
typedef struct moving_surface {
    const loxo_register *r;
    const loxo_mesh *mesh;
    int64_t n;         /* caller's vertices */
    loxo_index *order; /* [n] */
    loxo_landmarks landmarks;
    sphere_problem problem;
    sphere_map f; /* [problem.m.n_vertices], the mesh's order */
    loxo_sphere_locator *locator;
    double *position; /* [n][3] */
    double *map;      /* [n][3], the caller's */
    register_pairs pairs;
    sphere_pull pull;
    loxo_index (*vertex)[3]; /* of the pull */
    double (*share)[3], (*target)[3];
    double clock_s;
} moving_surface;

static void clock_phase(moving_surface *s, loxo_register_phase phase, loxo_register_info *info)
{
    const double now = loxo_os_clock_s();
    info->phase_s[phase] += now - s->clock_s;
    s->clock_s = now;
}

/* What steps on the map need, once the solver that made it is gone. */
static loxo_status make_problem(moving_surface *s)
{
    loxo_context *ctx = s->r->ctx;
    sphere_problem *p = &s->problem;
    const loxo_mesh_view m = loxo_mesh_get_view(s->mesh);
    const loxo_status status = sphere_problem_create(ctx, &m, &m, &s->r->settings.sphere, p);
    if (status < 0) return status;
    if ((s->f = loxo_allocate(ctx, m.n_vertices, sizeof *s->f)) == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < p->m.n_vertices; ++i) {
        const int64_t v = p->m.vertex_origin != NULL ? p->m.vertex_origin[i] : i;
        memcpy(s->f[i], &s->map[3 * v], sizeof *s->f);
    }
    return LOXO_OK;
}

static loxo_status map_moving(moving_surface *s, const loxo_landmarks *landmarks, loxo_register_info *info)
{
    loxo_context *ctx = s->r->ctx;
    loxo_sphere *sphere = NULL;
    s->order = loxo_allocate(ctx, s->n, sizeof *s->order);
    if (s->order == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = loxo_mesh_vertex_order(s->mesh, s->order);
    if (status >= 0) status = take_landmarks(ctx, s->mesh, landmarks, &s->landmarks);
    if (status >= 0) status = loxo_sphere_create(ctx, s->mesh, &s->r->settings.sphere, &sphere);
    if (status >= 0) status = loxo_sphere_solve(sphere, NULL, s->map, &info->moving);
    loxo_sphere_destroy(sphere);
    if (status < 0) return status;
    const loxo_status made = make_problem(s);
    return made < 0 ? made : status;
}

/* Landmarks in pairs, as what pulls at the map. */
static loxo_status sample(moving_surface *s, loxo_register_info *info)
{
    const loxo_register *r = s->r;
    loxo_context *ctx = r->ctx;
    if ((s->position = register_positions(ctx, s->mesh, s->order)) == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = loxo_sphere_locator_create(ctx, s->mesh, s->map, &s->locator);
    if (status < 0) return status;
    const register_side fixed = {ctx, &r->landmarks, r->n_vertices, r->position, r->map, r->locator};
    const register_side moving = {ctx, &s->landmarks, s->n, s->position, s->map, s->locator};
    if ((status = register_pair(&fixed, &moving, r->settings.n_samples, &s->pairs)) < 0) return status;
    const int64_t n = s->pairs.n;
    s->vertex = loxo_allocate(ctx, n, sizeof *s->vertex);
    s->share = loxo_allocate(ctx, n, sizeof *s->share);
    s->target = loxo_allocate(ctx, n, sizeof *s->target);
    if (s->vertex == NULL || s->share == NULL || s->target == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < n; ++i) {
        const loxo_surface_point *p = &s->pairs.moving[i];
        for (int k = 0; k < 3; ++k) {
            const bool is_used = p->vertex[k] >= 0 && p->weight[k] > 0.0;
            s->vertex[i][k] = is_used ? s->order[p->vertex[k]] : 0;
            s->share[i][k] = is_used ? p->weight[k] : 0.0;
        }
    }
    status = loxo_surface_interpolate(ctx, n, s->pairs.fixed, r->n_vertices, 3, r->map, s->target[0]);
    s->pull = (sphere_pull){n, (const loxo_index(*)[3])s->vertex, (const double(*)[3])s->share,
                            (const double(*)[3])s->target, r->settings.lambda};
    info->n_curves = s->pairs.n_curves;
    info->n_unpaired = s->pairs.n_unpaired;
    info->n_landmarks = n;
    return status;
}

static loxo_vec3 image_of(const sphere_pull *pull, int64_t i, sphere_const_map f)
{
    loxo_vec3 x = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; ++k)
        x = v3_axpy(x, pull->share[i][k], v3_load(f[pull->vertex[i][k]]));
    return x;
}

/* Turns the map such that its landmarks are nearest to the targets (line 4). */
static void turn(const sphere_problem *p, const sphere_pull *pull, sphere_map f)
{
    double m[3][3] = {{0.0}}, r[3][3];
    for (int64_t i = 0; i < pull->n; ++i) {
        double x[3];
        v3_store(x, image_of(pull, i, (sphere_const_map)f));
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b)
                m[a][b] += pull->target[i][a] * x[b];
    }
    sphere_find_rotation((const double(*)[3])m, r);
#pragma omp parallel num_threads(loxo_threads_for(p->ctx, p->m.n_vertices, 8.0))
    {
        const loxo_range range = loxo_thread_range(p->m.n_vertices);
        for (int64_t i = range.begin; i < range.end; ++i) {
            const loxo_vec3 x = v3_load(f[i]);
            const loxo_vec3 y = {v3_dot(v3_load(r[0]), x), v3_dot(v3_load(r[1]), x), v3_dot(v3_load(r[2]), x)};
            v3_store(f[i], v3_scale(1.0 / v3_norm(y), y));
        }
    }
}

/* Lines 4 to 12: from the moving surface's own map to the least of (6.1). */
static loxo_status move(moving_surface *s, loxo_register_info *info)
{
    const sphere_problem *p = &s->problem;
    const sphere_map f = s->f;
    const double lambda = s->pull.weight;
    loxo_sphere_info steps = {.n_iterations = 0};
    sphere_energy energy;
    sphere_folds folds;
    turn(p, &s->pull, f);
    loxo_status done = LOXO_OK, status = sphere_find_energy(p, (sphere_const_map)f, &energy);
    if (status < 0) return status;
    info->energy_start = energy.energy;
    info->loss_start = sphere_pull_loss(&s->pull, (sphere_const_map)f);
    if (lambda > 0.0) {
        done = sphere_map_newton(p, &s->pull, f, &steps);
        if (done < 0) return done;
    }
    if ((status = sphere_find_folds(p, (sphere_const_map)f, NULL, &folds)) < 0) return status;
    if (folds.n > 0 && p->settings.is_unfolded && done != LOXO_STOPPED) {
        /* No step folds: what is folded was so in the moving surface's own map. */
        const loxo_status mended = sphere_unfold(p, f, &steps);
        if (mended < 0 || mended == LOXO_STOPPED) return mended;
        if ((status = sphere_find_folds(p, (sphere_const_map)f, NULL, &folds)) < 0) return status;
    }
    if ((status = sphere_find_energy(p, (sphere_const_map)f, &energy)) < 0) return status;
    info->stop_reason = steps.stop_reason;
    info->n_iterations = steps.n_iterations;
    info->n_evaluations = steps.n_evaluations;
    info->residual = steps.residual;
    info->n_linear_steps = steps.n_linear_steps;
    info->n_held = steps.n_held;
    info->workspace_bytes = steps.workspace_bytes;
    info->energy = energy.energy;
    info->loss = sphere_pull_loss(&s->pull, (sphere_const_map)f);
    info->objective = info->energy + lambda * info->loss;
    info->n_folds = folds.n;
    info->degree = folds.degree;
    for (int64_t i = 0; i < s->pull.n; ++i) {
        const loxo_vec3 away = v3_sub(image_of(&s->pull, i, (sphere_const_map)f), v3_load(s->pull.target[i]));
        info->landmark_max = fmax(info->landmark_max, v3_norm(away));
    }
    for (int64_t i = 0; i < s->n; ++i)
        memcpy(&s->map[3 * i], f[s->order[i]], sizeof *f);
    return done;
}

/* Line 13: the inverse of f_0. */
static loxo_status find_places(moving_surface *s, loxo_surface_point *point, double *position, loxo_register_info *info)
{
    const loxo_register *r = s->r;
    loxo_surface_point *place = point;
    double *away = loxo_allocate(r->ctx, s->n, sizeof *away);
    loxo_status status = LOXO_ERR_MEMORY;
    if (place == NULL) place = loxo_allocate(r->ctx, s->n, sizeof *place);
    if (away == NULL || place == NULL) goto done;
    status = loxo_sphere_locate(r->locator, s->n, s->map, place, away);
    for (int64_t i = 0; i < s->n && status >= 0; ++i)
        info->n_outside += away[i] > 0.0;
    if (status >= 0 && position != NULL)
        status = loxo_surface_interpolate(r->ctx, s->n, place, r->n_vertices, 3, r->position, position);
done:
    if (place != point) loxo_release(r->ctx, place);
    loxo_release(r->ctx, away);
    return status;
}

static loxo_status stopped(const moving_surface *s)
{
    return loxo_fail(s->r->ctx, LOXO_ERR_STOPPED, "stopped while registering");
}

static loxo_status solve(moving_surface *s, const loxo_landmarks *landmarks, loxo_surface_point *point,
                         double *position, loxo_register_info *info)
{
    loxo_status status = map_moving(s, landmarks, info);
    if (status < 0) return status;
    if (status == LOXO_STOPPED) return stopped(s);
    clock_phase(s, LOXO_REGISTER_PHASE_MAP, info);
    if ((status = sample(s, info)) < 0) return status;
    clock_phase(s, LOXO_REGISTER_PHASE_SAMPLE, info);
    const loxo_status moved = move(s, info);
    if (moved < 0) return moved;
    if (moved == LOXO_STOPPED) return stopped(s);
    clock_phase(s, LOXO_REGISTER_PHASE_MOVE, info);
    if ((status = find_places(s, point, position, info)) < 0) return status;
    clock_phase(s, LOXO_REGISTER_PHASE_LOCATE, info);
    if (moved != LOXO_OK || (info->n_folds == 0 && info->degree == 1)) return moved;
    return loxo_fail(s->r->ctx, LOXO_CHECK_FAILED,
                     "register: %" PRId64 " triangles are turned over; the map covers the sphere %d times",
                     info->n_folds, info->degree);
}

static void let_go(moving_surface *s)
{
    loxo_context *ctx = s->r->ctx;
    loxo_release(ctx, s->target);
    loxo_release(ctx, s->share);
    loxo_release(ctx, s->vertex);
    register_pairs_destroy(ctx, &s->pairs);
    loxo_sphere_locator_destroy(s->locator);
    loxo_release(ctx, s->position);
    sphere_problem_destroy(&s->problem);
    loxo_release(ctx, s->f);
    loxo_landmarks_destroy(ctx, &s->landmarks);
    loxo_release(ctx, s->order);
}

loxo_status loxo_register_solve(loxo_register *r, const loxo_mesh *moving, const loxo_landmarks *landmarks, double *map,
                                loxo_surface_point *point, double *position, loxo_register_info *info)
{
    loxo_register_info own = {.n_curves = 0};
    if (r == NULL) return LOXO_ERR_ARGUMENT;
    if (moving == NULL || map == NULL)
        return loxo_fail(r->ctx, LOXO_ERR_ARGUMENT, "register: the moving mesh or the place for its map is NULL");
    moving_surface s = {.r = r, .mesh = moving, .n = loxo_mesh_n_vertices(moving), .map = map};
    const double start_s = s.clock_s = loxo_os_clock_s();
    loxo_progress_enter(r->ctx);
    const loxo_status status = solve(&s, landmarks, point, position, &own);
    loxo_progress_leave(r->ctx);
    let_go(&s);
    own.total_s = loxo_os_clock_s() - start_s;
    own.peak_bytes = loxo_context_memory(r->ctx).peak_bytes;
    if (info != NULL) *info = own;
    return status;
}
