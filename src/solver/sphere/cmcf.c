/* SPDX-License-Identifier: MIT
 * Conformalized mean curvature flow: the surface flows by the Laplacian of its first shape, and by the areas of the present one.
 *
 *     (M_k + d L_0) x_{k+1} = M_k x_k,   M_k the lumped areas of x_k, whose sum is kept at 4 pi
 *
 * solved for the move, (L_0 + M_k / d) (x_{k+1} - x_k) = -L_0 x_k: the matrix is L with another diagonal. What it rests at is
 * L_0 x = M x, a sphere up to the mesh's size.
 * source  Kazhdan, Solomon, Ben-Chen 2012, Can Mean-Curvature Flow be Modified to be Non-singular?; BASELINES.md */
#include "algebra/cg.h"
#include "algebra/cholesky.h"
#include "algebra/multigrid.h"
#include "base/allocate.h"
#include "kernel/vec3.h"
#include "par/range.h"
#include "solver/sphere/plane.h"

#include <inttypes.h>
#include <string.h>

#define SPHERE_AREA 12.566370614359172
/* Near a sphere the slowest part of the error, of degree 2, shrinks by 0.80 a step with this, and by 0.71 with the longest; coarse
 * meshes swing with long steps. */
#define TIME_STEP 0.2
/* It is halved when so many steps in turn have moved the map no less than one before. */
#define PATIENCE 20
/* Of equations, until the flow is at rest; then for so many steps. What was lost before on long limbs, whose images are small, comes
 * back in these. */
#define LOOSE     1e-3
#define TIGHT     1e-11
#define N_TIGHT   2
#define MAX_STEPS 2000
/* Root mean square deviation from a sphere, over its radius, below which the shape counts as one. */
#define ROUND 0.2

typedef struct cmcf {
    const sphere_problem *p;
    double *x[3];       /* [n] */
    double *mass;       /* [n] M_k */
    double *face_area;  /* [n_faces] twice */
    double *right_side; /* [n] */
    double *move;       /* [n] of one coordinate, backwards */
    sphere_map image;   /* [n] x put on the sphere */
    loxo_csr matrix;    /* L + M / d: pattern and entries are those of L */
    loxo_multigrid *multigrid;
    loxo_cg *cg;
    loxo_cholesky *cholesky;
    double roundness;
    double time_step;
    double tolerance;  /* of equations */
    double least_move; /* of a step with this time step; and how many were since */
    int n_since;
} cmcf;

static void release(cmcf *s)
{
    loxo_context *ctx = s->p->ctx;
    loxo_cg_destroy(s->cg);
    loxo_multigrid_destroy(s->multigrid);
    loxo_cholesky_destroy(s->cholesky);
    for (int k = 0; k < 3; ++k)
        loxo_release(ctx, s->x[k]);
    loxo_release(ctx, s->mass);
    loxo_release(ctx, s->face_area);
    loxo_release(ctx, s->right_side);
    loxo_release(ctx, s->move);
    loxo_release(ctx, s->image);
    loxo_release(ctx, s->matrix.diagonal);
}

static loxo_status reserve(cmcf *s)
{
    loxo_context *ctx = s->p->ctx;
    const int64_t n = s->p->m.n_vertices;
    double **const vectors[] = {&s->x[0], &s->x[1], &s->x[2], &s->mass, &s->move, &s->right_side, &s->matrix.diagonal};
    s->matrix = s->p->laplacian;
    s->matrix.diagonal = NULL;
    for (size_t k = 0; k < sizeof vectors / sizeof vectors[0]; ++k)
        if ((*vectors[k] = loxo_allocate(ctx, n, sizeof(double))) == NULL) return LOXO_ERR_MEMORY;
    s->face_area = loxo_allocate(ctx, s->p->m.n_faces, sizeof *s->face_area);
    s->image = loxo_allocate(ctx, n, sizeof *s->image);
    return s->face_area == NULL || s->image == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
}

/* ---- the present shape ------------------------------------------------------------------------------------------- */

static loxo_vec3 point_of(const cmcf *s, int64_t v) { return (loxo_vec3){s->x[0][v], s->x[1][v], s->x[2][v]}; }

/* A third of the areas around each vertex. */
static void find_mass(cmcf *s)
{
    const loxo_mesh_view *m = &s->p->m;
#pragma omp parallel num_threads(loxo_threads_for(s->p->ctx, m->n_faces, 20.0))
    {
        const loxo_range r = loxo_thread_range(m->n_faces);
        for (int64_t t = r.begin; t < r.end; ++t) {
            const loxo_index *v = &m->halfedge_vertex[3 * t];
            const loxo_vec3 a = point_of(s, v[0]);
            s->face_area[t] = v3_norm(v3_cross(v3_sub(point_of(s, v[1]), a), v3_sub(point_of(s, v[2]), a)));
        }
    }
#pragma omp parallel num_threads(loxo_threads_for(s->p->ctx, m->n_vertices, 20.0))
    {
        const loxo_range r = loxo_thread_range(m->n_vertices);
        for (int64_t v = r.begin; v < r.end; ++v) {
            const loxo_index first = m->vertex_halfedge[v];
            loxo_index h = first;
            double sum = 0.0;
            do {
                sum += s->face_area[k_face_of(h)];
                h = m->halfedge_twin[k_previous(h)];
            } while (h != first);
            s->mass[v] = sum / 6.0;
        }
    }
}

/* sums: area, its first moments. */
static void add_mass(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const cmcf *s = arg;
    for (int64_t i = begin; i < end; ++i) {
        sums[0] += s->mass[i];
        for (int k = 0; k < 3; ++k)
            sums[k + 1] += s->mass[i] * s->x[k][i];
    }
}

/* sums: area, |x| and |x|^2 over it. */
static void add_radius(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const cmcf *s = arg;
    for (int64_t i = begin; i < end; ++i) {
        const double radius = v3_norm(point_of(s, i));
        sums[0] += s->mass[i];
        sums[1] += s->mass[i] * radius;
        sums[2] += s->mass[i] * radius * radius;
    }
}

/* Masses; then the middle of the area goes to 0, and the area to that of the unit sphere. */
static loxo_status take_shape(cmcf *s)
{
    loxo_context *ctx = s->p->ctx;
    const int64_t n = s->p->m.n_vertices;
    double sums[4], radius[3];
    find_mass(s);
    loxo_status status = loxo_sum(ctx, n, 4, add_mass, s, sums);
    if (status < 0) return status;
    const double scale = sqrt(SPHERE_AREA / sums[0]);
    if (!isfinite(scale) || !(scale > 0.0) || !isfinite(sums[1] + sums[2] + sums[3]))
        return loxo_fail(ctx, LOXO_ERR_NUMERIC, "cmcf: the surface has collapsed: its area is %g", sums[0]);
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 4.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            s->mass[i] *= scale * scale;
            for (int k = 0; k < 3; ++k)
                s->x[k][i] = scale * (s->x[k][i] - sums[k + 1] / sums[0]);
        }
    }
    if ((status = loxo_sum(ctx, n, 3, add_radius, s, radius)) < 0) return status;
    const double mean = radius[1] / radius[0];
    s->roundness = sqrt(fmax(0.0, radius[2] / radius[0] - mean * mean)) / mean;
    return LOXO_OK;
}

/* s->image: x on the sphere, seen from the middle, and centred: energies of maps that differ by a boost cannot be compared. */
static loxo_status find_image(cmcf *s, sphere_energy *energy, loxo_sphere_info *info)
{
    const int64_t n = s->p->m.n_vertices;
#pragma omp parallel num_threads(loxo_threads_for(s->p->ctx, n, 6.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            const loxo_vec3 x = point_of(s, i);
            const double norm = v3_norm(x);
            v3_store(s->image[i], norm > 0.0 ? v3_scale(1.0 / norm, x) : (loxo_vec3){0.0, 0.0, 1.0});
        }
    }
    const loxo_status status = sphere_center(s->p, s->image, NULL);
    if (status < 0 || status == LOXO_STOPPED) return status < 0 ? status : LOXO_ERR_STOPPED;
    info->n_evaluations += 1;
    return sphere_find_energy(s->p, (sphere_const_map)s->image, energy);
}

/* ---- a step ------------------------------------------------------------------------------------------------------ */

/* One hierarchy serves all steps: the sum of M stays what it is, and where it lies matters to no fine level. */
static loxo_status make_multigrid(cmcf *s)
{
    const loxo_status status = loxo_multigrid_create(s->p->ctx, &s->matrix, NULL, &s->multigrid);
    return status < 0 ? status : loxo_cg_create(s->p->ctx, &s->matrix, &s->cg);
}

static loxo_status prepare_step(cmcf *s)
{
    const int64_t n = s->p->m.n_vertices;
    loxo_status status = LOXO_OK;
    for (int64_t i = 0; i < n; ++i)
        s->matrix.diagonal[i] = s->p->laplacian.diagonal[i] + s->mass[i] / s->time_step;
    if (s->p->settings.factor == LOXO_SPHERE_MULTIGRID) return s->cg != NULL ? LOXO_OK : make_multigrid(s);
    if (s->cholesky == NULL) status = loxo_cholesky_create(s->p->ctx, &s->matrix, NULL, &s->cholesky);
    return status < 0 ? status : loxo_cholesky_factor(s->cholesky, &s->matrix);
}

/* move = matrix^-1 right_side */
static loxo_status find_move(cmcf *s, loxo_sphere_info *info)
{
    if (s->cholesky != NULL) return loxo_cholesky_solve(s->cholesky, s->right_side, s->move);
    const loxo_preconditioner m = {loxo_multigrid_apply, s->multigrid};
    const loxo_cg_settings settings = {.tolerance = s->tolerance, .max_iterations = MAX_STEPS};
    loxo_cg_info cg;
    memset(s->move, 0, (size_t)s->p->m.n_vertices * sizeof *s->move);
    const loxo_status status = loxo_cg_solve(s->cg, &m, &settings, s->right_side, s->move, &cg);
    if (status < 0) return status;
    info->n_linear_steps += cg.n_iterations;
    if (status == LOXO_NOT_CONVERGED) plane_tell_unsolved(s->p->ctx, s->tolerance, &cg);
    return status == LOXO_NOT_CONVERGED ? LOXO_OK : status;
}

static loxo_status step(cmcf *s, loxo_sphere_info *info)
{
    loxo_context *ctx = s->p->ctx;
    const int64_t n = s->p->m.n_vertices;
    loxo_status status = prepare_step(s);
    for (int k = 0; k < 3 && status == LOXO_OK; ++k) {
        loxo_csr_multiply(ctx, &s->p->laplacian, s->x[k], s->right_side);
        if ((status = find_move(s, info)) != LOXO_OK) return status;
        for (int64_t i = 0; i < n; ++i)
            s->x[k][i] -= s->move[i];
    }
    return status != LOXO_OK ? status : take_shape(s);
}

/* ---- the flow ---------------------------------------------------------------------------------------------------- */

/* One step and its image. */
static loxo_status advance(cmcf *s, sphere_energy *energy, loxo_sphere_info *info)
{
    loxo_status status = sphere_tell(s->p, "cmcf", info->n_iterations == 0, info) ? LOXO_STOPPED : step(s, info);
    if (status == LOXO_OK) status = find_image(s, energy, info);
    if (status != LOXO_STOPPED && status != LOXO_ERR_STOPPED) return status;
    info->stop_reason = LOXO_SPHERE_STOP_MONITOR;
    return LOXO_STOPPED;
}

typedef struct two_maps {
    const sphere_problem *p;
    sphere_const_map a, b;
} two_maps;

/* sums: |a - b|^2, by area. */
static void add_move(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const two_maps *m = arg;
    for (int64_t i = begin; i < end; ++i) {
        const loxo_vec3 d = v3_sub(v3_load(m->a[i]), v3_load(m->b[i]));
        sums[0] += m->p->area[i] * v3_dot(d, d);
    }
}

static void choose_time_step(cmcf *s, double move)
{
    const bool is_less = move < s->least_move;
    s->n_since = is_less ? 0 : s->n_since + 1;
    if (is_less) s->least_move = move;
    if (s->n_since < PATIENCE) return;
    s->time_step *= 0.5;
    s->least_move = HUGE_VAL;
    s->n_since = 0;
}

static loxo_status flow(cmcf *s, sphere_map f, loxo_sphere_info *info)
{
    const sphere_problem *p = s->p;
    int n_tight = 0;
    const two_maps maps = {.p = p, .a = (sphere_const_map)f, .b = (sphere_const_map)s->image};
    sphere_energy energy;
    loxo_status status = take_shape(s);
    if (status < 0 || (status = find_image(s, &energy, info)) < 0) return status;
    memcpy(f, s->image, (size_t)p->m.n_vertices * sizeof *f);
    info->energy = energy.energy;
    info->residual = HUGE_VAL;
    info->stop_reason = LOXO_SPHERE_STOP_MAX_ITERATIONS;
    for (int64_t k = 0; k < p->settings.max_iterations; ++k) {
        if ((status = advance(s, &energy, info)) != LOXO_OK) return status;
        if ((status = loxo_sum(p->ctx, p->m.n_vertices, 1, add_move, &maps, &info->residual)) < 0) return status;
        memcpy(f, s->image, (size_t)p->m.n_vertices * sizeof *f);
        info->energy = energy.energy;
        info->n_iterations = k + 1;
        if (s->roundness < ROUND && info->residual <= p->settings.tolerance) {
            s->tolerance = TIGHT;
            if (n_tight++ < N_TIGHT) continue;
            info->stop_reason = LOXO_SPHERE_STOP_TOLERANCE;
            return LOXO_OK;
        }
        choose_time_step(s, info->residual);
    }
    return loxo_fail(p->ctx, LOXO_NOT_CONVERGED,
                     "cmcf: not at rest after %" PRId64 " steps: %.3g off a sphere, the last step moved by %.3g",
                     info->n_iterations, s->roundness, sqrt(info->residual));
}

loxo_status sphere_map_cmcf(const sphere_problem *p, sphere_map f, loxo_sphere_info *info)
{
    cmcf s = {.p = p, .time_step = TIME_STEP, .tolerance = LOOSE, .least_move = HUGE_VAL};
    loxo_status status = reserve(&s);
    for (int64_t v = 0; v < p->m.n_vertices && status >= 0; ++v) {
        const loxo_vec3 x = k_position(&p->m, (loxo_index)v);
        s.x[0][v] = x.x;
        s.x[1][v] = x.y;
        s.x[2][v] = x.z;
    }
    if (status >= 0) status = flow(&s, f, info);
    release(&s);
    return status;
}
