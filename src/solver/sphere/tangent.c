/* SPDX-License-Identifier: MIT
 * Value, gradient and Hessian of the conformal energy on unit vectors, with the gauge and with points that are pulled. */
#include "solver/sphere/tangent.h"

#include "base/allocate.h"
#include "kernel/conformal_kernel.h"
#include "optim/steihaug.h"
#include "par/range.h"

#include <string.h>

/* Of the penalty on the mean position, beside the multipliers. With 20 a boost costs about as much as the image's area times its
 * square (README.md), between the rotations' 0 and the 4 of what comes next. */
#define GAUGE_STIFFNESS 20.0

size_t sphere_tangent_bytes(int64_t n_vertices, int64_t n_faces)
{
    return (size_t)n_vertices * 7 * sizeof(double) + (size_t)n_vertices + (size_t)n_faces * 6 * sizeof(double);
}

static loxo_status precondition_by_factor(sphere_tangent *t, const loxo_csr *matrix)
{
    const loxo_status status = loxo_cholesky_create(t->p->ctx, matrix, NULL, &t->cholesky);
    return status < 0 ? status : loxo_cholesky_factor(t->cholesky, matrix);
}

/* Of L + diag(image's areas), which unlike L maps no constant to 0. All but the diagonal is the problem's. */
static loxo_status make_preconditioner(sphere_tangent *t, sphere_const_map f)
{
    const sphere_problem *p = t->p;
    const int64_t n = p->m.n_vertices;
    t->shifted = p->laplacian;
    if ((t->shifted.diagonal = loxo_allocate(p->ctx, n, sizeof *t->shifted.diagonal)) == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < n; ++i)
        t->shifted.diagonal[i] = p->laplacian.diagonal[i];
    for (int64_t face = 0; face < p->m.n_faces; ++face) {
        const loxo_index *v = &p->m.halfedge_vertex[3 * face];
        double side;
        const double third = v3_norm(k_image_normal(v3_load(f[v[0]]), v3_load(f[v[1]]), v3_load(f[v[2]]), &side)) / 6.0;
        for (int k = 0; k < 3; ++k)
            t->shifted.diagonal[v[k]] += third;
    }
    if (p->settings.factor == LOXO_SPHERE_CHOLESKY) return precondition_by_factor(t, &t->shifted);
    return loxo_multigrid_create(p->ctx, &t->shifted, NULL, &t->multigrid);
}

loxo_status sphere_tangent_create(const sphere_problem *p, const sphere_pull *pull, sphere_const_map f,
                                  sphere_tangent *t)
{
    const int64_t n = p->m.n_vertices, n_faces = p->m.n_faces;
    *t = (sphere_tangent){.p = p, .pull = pull, .is_gauged = !p->settings.is_free, .precondition_scale = 1.0};
    t->normal = loxo_allocate(p->ctx, n_faces, sizeof *t->normal);
    t->cotangent = loxo_allocate(p->ctx, n_faces, sizeof *t->cotangent);
    t->gradient = loxo_allocate(p->ctx, n, sizeof *t->gradient);
    t->radial = loxo_allocate(p->ctx, n, sizeof *t->radial);
    t->is_held = loxo_allocate_zero(p->ctx, n, sizeof *t->is_held);
    t->r = loxo_allocate(p->ctx, n, sizeof *t->r);
    t->z = loxo_allocate(p->ctx, n, sizeof *t->z);
    loxo_status status = LOXO_OK;
    if (t->normal == NULL || t->cotangent == NULL || t->gradient == NULL || t->radial == NULL || t->is_held == NULL ||
        t->r == NULL || t->z == NULL)
        status = LOXO_ERR_MEMORY;
    if (status >= 0) status = make_preconditioner(t, f);
    if (status < 0) sphere_tangent_destroy(t);
    return status;
}

void sphere_tangent_destroy(sphere_tangent *t)
{
    loxo_context *ctx = t->p->ctx;
    loxo_multigrid_destroy(t->multigrid);
    loxo_cholesky_destroy(t->cholesky);
    loxo_release(ctx, t->shifted.diagonal);
    loxo_release(ctx, t->z);
    loxo_release(ctx, t->r);
    loxo_release(ctx, t->is_held);
    loxo_release(ctx, t->radial);
    loxo_release(ctx, t->gradient);
    loxo_release(ctx, t->cotangent);
    loxo_release(ctx, t->normal);
    *t = (sphere_tangent){.p = t->p};
}

/* ---- the pull -------------------------------------------------------------------------------------------------- */

static loxo_vec3 pulled_point(const sphere_pull *pull, int64_t i, sphere_const_map f)
{
    loxo_vec3 x = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; ++k)
        if (pull->share[i][k] != 0.0) x = v3_axpy(x, pull->share[i][k], v3_load(f[pull->vertex[i][k]]));
    return x;
}

double sphere_pull_loss(const sphere_pull *pull, sphere_const_map f)
{
    double sum = 0.0;
    for (int64_t i = 0; i < pull->n; ++i) {
        const loxo_vec3 away = v3_sub(pulled_point(pull, i, f), v3_load(pull->target[i]));
        sum += v3_dot(away, away);
    }
    return pull->n == 0 ? 0.0 : 0.5 * sum / (double)pull->n;
}

/* g += its gradient at v, of which the targets are left out where v is a move: it is linear. */
static void add_pull(const sphere_pull *pull, sphere_const_map v, bool has_targets, double (*g)[3])
{
    const double scale = pull->n == 0 ? 0.0 : pull->weight / (double)pull->n;
    for (int64_t i = 0; i < pull->n; ++i) {
        loxo_vec3 away = pulled_point(pull, i, v);
        if (has_targets) away = v3_sub(away, v3_load(pull->target[i]));
        for (int k = 0; k < 3; ++k) {
            double *mine = g[pull->vertex[i][k]];
            if (pull->share[i][k] != 0.0) v3_store(mine, v3_axpy(v3_load(mine), scale * pull->share[i][k], away));
        }
    }
}

/* ---- sums over the vertices -------------------------------------------------------------------------------------- */

typedef struct seen_vectors {
    const sphere_tangent *t;
    sphere_const_map x;
} seen_vectors;

static void add_mean(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const seen_vectors *seen = arg;
    for (int64_t i = begin; i < end; ++i)
        for (int k = 0; k < 3; ++k)
            sums[k] += seen->t->p->area[i] * seen->x[i][k];
}

static loxo_status find_mean(const sphere_tangent *t, sphere_const_map x, double mean[3])
{
    const seen_vectors seen = {.t = t, .x = x};
    return loxo_sum(t->p->ctx, t->p->m.n_vertices, 3, add_mean, &seen, mean);
}

/* What the gradient of the energy does along the three boosts P_i e_k: sums of P_i g_i; and the same of the mean position,
 * sum of A_i P_i, six numbers less one, as its trace is 2. */
static void add_boosts(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const sphere_tangent *t = ((const seen_vectors *)arg)->t;
    for (int64_t i = begin; i < end; ++i) {
        const double *x = t->f[i], a = t->p->area[i];
        for (int k = 0; k < 3; ++k)
            sums[k] += t->gradient[i][k];
        sums[3] += a * x[0] * x[0];
        sums[4] += a * x[1] * x[1];
        sums[5] += a * x[0] * x[1];
        sums[6] += a * x[0] * x[2];
        sums[7] += a * x[1] * x[2];
    }
}

/* x = S^-1 b by Cramer, S symmetric and positive definite. */
static loxo_vec3 solve3(loxo_vec3 s0, loxo_vec3 s1, loxo_vec3 s2, loxo_vec3 b)
{
    const double inverse = 1.0 / v3_dot(s0, v3_cross(s1, s2));
    const loxo_vec3 x = {v3_dot(b, v3_cross(s1, s2)), v3_dot(s0, v3_cross(b, s2)), v3_dot(s0, v3_cross(s1, b))};
    return v3_scale(inverse, x);
}

/* Multipliers with which the boosts change nothing: sum of P_i (g_i + A_i mu) = 0. */
static loxo_status find_multipliers(sphere_tangent *t)
{
    const seen_vectors seen = {.t = t};
    double sum[8];
    const loxo_status status = loxo_sum(t->p->ctx, t->p->m.n_vertices, 8, add_boosts, &seen, sum);
    if (status < 0) return status;
    const loxo_vec3 s0 = {1.0 - sum[3], -sum[5], -sum[6]}, s1 = {-sum[5], 1.0 - sum[4], -sum[7]};
    const loxo_vec3 s2 = {-sum[6], -sum[7], sum[3] + sum[4]};
    v3_store(t->multiplier, solve3(s0, s1, s2, (loxo_vec3){-sum[0], -sum[1], -sum[2]}));
    return LOXO_OK;
}

/* ---- going to a map -------------------------------------------------------------------------------------------- */

static void make_faces(sphere_tangent *t)
{
    const loxo_index *v = t->p->m.halfedge_vertex;
#pragma omp parallel num_threads(loxo_threads_for(t->p->ctx, t->p->m.n_faces, 12.0))
    {
        const loxo_range r = loxo_thread_range(t->p->m.n_faces);
        for (int64_t f = r.begin; f < r.end; ++f) {
            const k_image_face face =
                k_image_face_of(v3_load(t->f[v[3 * f]]), v3_load(t->f[v[3 * f + 1]]), v3_load(t->f[v[3 * f + 2]]));
            v3_store(t->normal[f], face.normal);
            for (int k = 0; k < 3; ++k)
                t->cotangent[f][k] = face.cotangent[k];
        }
    }
}

/* (L x)_i of a row of differences. */
static loxo_vec3 times_laplacian(const loxo_csr *a, int64_t i, sphere_const_map x)
{
    const loxo_vec3 mine = v3_load(x[i]);
    loxo_vec3 sum = {0.0, 0.0, 0.0};
    for (int64_t e = a->begin[i]; e < a->begin[i + 1]; ++e)
        sum = v3_axpy(sum, a->value[e], v3_sub(v3_load(x[a->column[e]]), mine));
    return sum;
}

/* Cartesian gradient of the energy, (3.10). */
static void find_gradient(sphere_tangent *t)
{
    const loxo_mesh_view *m = &t->p->m;
#pragma omp parallel num_threads(loxo_threads_for(t->p->ctx, m->n_vertices, 30.0))
    {
        const loxo_range r = loxo_thread_range(m->n_vertices);
        for (int64_t i = r.begin; i < r.end; ++i) {
            const loxo_index first = m->vertex_halfedge[i];
            loxo_vec3 g = times_laplacian(&t->p->laplacian, i, t->f);
            loxo_index h = first;
            do {
                const loxo_index after = k_next(h), before = k_previous(h);
                const loxo_vec3 edge =
                    v3_sub(v3_load(t->f[m->halfedge_vertex[before]]), v3_load(t->f[m->halfedge_vertex[after]]));
                g = v3_axpy(g, -0.5, v3_cross(v3_load(t->normal[k_face_of(h)]), edge));
                h = m->halfedge_twin[before];
            } while (h != first);
            v3_store(t->gradient[i], g);
        }
    }
}

/* Parts along and across x; with the gauge's share from `push` on. */
static void split_gradient(sphere_tangent *t, loxo_vec3 push, bool is_added)
{
    const int64_t n = t->p->m.n_vertices;
#pragma omp parallel num_threads(loxo_threads_for(t->p->ctx, n, 3.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            const loxo_vec3 x = v3_load(t->f[i]), g = v3_axpy(v3_load(t->gradient[i]), t->p->area[i], push);
            const double along = v3_dot(x, g);
            t->radial[i] = is_added ? t->radial[i] + along : along;
            v3_store(t->gradient[i], v3_axpy(g, -along, x));
        }
    }
}

loxo_status sphere_tangent_go(sphere_tangent *t, sphere_const_map f)
{
    static const loxo_vec3 none = {0.0, 0.0, 0.0};
    t->f = f;
    make_faces(t);
    find_gradient(t);
    if (t->pull != NULL) add_pull(t->pull, f, true, t->gradient);
    split_gradient(t, none, false);
    if (!t->is_gauged) return LOXO_OK;
    loxo_status status = find_mean(t, f, t->mean);
    if (status >= 0) status = find_multipliers(t);
    if (status < 0) return status;
    /* What is added to a tangent vector has its radial part taken out again. */
    split_gradient(t, v3_axpy(v3_load(t->multiplier), GAUGE_STIFFNESS, v3_load(t->mean)), true);
    return LOXO_OK;
}

loxo_status sphere_tangent_value(const sphere_tangent *t, sphere_const_map g, sphere_energy *energy, double *value)
{
    double mean[3];
    loxo_status status = sphere_find_energy(t->p, g, energy);
    if (status < 0) return status;
    *value = energy->energy;
    if (t->pull != NULL) *value += t->pull->weight * sphere_pull_loss(t->pull, g);
    if (!t->is_gauged) return LOXO_OK;
    if ((status = find_mean(t, g, mean)) < 0) return status;
    const loxo_vec3 c = v3_load(mean);
    *value += v3_dot(v3_load(t->multiplier), c) + 0.5 * GAUGE_STIFFNESS * v3_dot(c, c);
    return LOXO_OK;
}

/* ---- products -------------------------------------------------------------------------------------------------- */

/* Row i of the second derivatives of the signed area, times v. */
static loxo_vec3 times_area_hessian(const sphere_tangent *t, int64_t i, sphere_const_map v)
{
    const loxo_mesh_view *m = &t->p->m;
    const loxo_index first = m->vertex_halfedge[i];
    const loxo_vec3 mine = v3_load(v[i]);
    loxo_vec3 sum = {0.0, 0.0, 0.0};
    loxo_index h = first;
    do {
        const loxo_index after = k_next(h), before = k_previous(h);
        const int64_t f = k_face_of(h);
        const loxo_vec3 n = v3_load(t->normal[f]);
        const loxo_vec3 vj = v3_load(v[m->halfedge_vertex[after]]), vl = v3_load(v[m->halfedge_vertex[before]]);
        /* diagonal[k] = -(cotangent[j] + cotangent[l]), as the edges sum to zero. */
        const double along = t->cotangent[f][before - 3 * f] * v3_dot(n, v3_sub(vj, mine)) +
                             t->cotangent[f][after - 3 * f] * v3_dot(n, v3_sub(vl, mine));
        sum = v3_axpy(v3_axpy(sum, along, n), 0.5, v3_cross(n, v3_sub(vl, vj)));
        h = m->halfedge_twin[before];
    } while (h != first);
    return sum;
}

loxo_status sphere_tangent_hessian(void *state, const double *v, double *hv)
{
    const sphere_tangent *t = state;
    const sphere_const_map x = (sphere_const_map)v;
    const int64_t n = t->p->m.n_vertices;
    double(*out)[3] = (double(*)[3])hv, mean[3] = {0.0, 0.0, 0.0};
    if (t->failure < 0) return t->failure;
    if (t->is_gauged) {
        const loxo_status status = find_mean(t, x, mean);
        if (status < 0) return status;
    }
    if (t->pull != NULL) {
        memset(hv, 0, (size_t)n * sizeof *out);
        add_pull(t->pull, x, false, out);
    }
    const loxo_vec3 push = v3_scale(GAUGE_STIFFNESS, v3_load(mean));
#pragma omp parallel num_threads(loxo_threads_for(t->p->ctx, n, 50.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            loxo_vec3 y = v3_scale(1.0 + t->shift, times_laplacian(&t->p->laplacian, i, x));
            y = v3_sub(y, times_area_hessian(t, i, x));
            if (t->pull != NULL) y = v3_add(y, v3_load(out[i]));
            y = k_tangent(v3_load(t->f[i]), v3_axpy(y, t->p->area[i], push));
            v3_store(out[i], v3_axpy(y, -t->radial[i], v3_load(x[i])));
        }
    }
    return LOXO_OK;
}

/* One coordinate of r, and of z with its radial part. */
static void precondition_one(sphere_tangent *t, int k, const double *r, double *z)
{
    const int64_t n = t->p->m.n_vertices;
#pragma omp parallel num_threads(loxo_threads_for(t->p->ctx, n, 1.0))
    {
        const loxo_range range = loxo_thread_range(n);
        for (int64_t i = range.begin; i < range.end; ++i)
            t->r[i] = t->is_held[i] ? 0.0 : r[3 * i + k];
    }
    if (t->multigrid != NULL) {
        loxo_multigrid_apply(t->multigrid, t->r, t->z);
    } else {
        const loxo_status status = loxo_cholesky_solve(t->cholesky, t->r, t->z);
        if (status < 0) t->failure = status;
    }
#pragma omp parallel num_threads(loxo_threads_for(t->p->ctx, n, 1.0))
    {
        const loxo_range range = loxo_thread_range(n);
        for (int64_t i = range.begin; i < range.end; ++i)
            z[3 * i + k] = t->precondition_scale * t->z[i];
    }
}

void sphere_tangent_precondition(void *state, const double *r, double *z)
{
    sphere_tangent *t = state;
    const int64_t n = t->p->m.n_vertices;
    for (int k = 0; k < 3; ++k)
        precondition_one(t, k, r, z);
#pragma omp parallel num_threads(loxo_threads_for(t->p->ctx, n, 2.0))
    {
        const loxo_range range = loxo_thread_range(n);
        for (int64_t i = range.begin; i < range.end; ++i) {
            const loxo_vec3 y = k_tangent(v3_load(t->f[i]), v3_load(&z[3 * i]));
            v3_store(&z[3 * i], t->is_held[i] ? (loxo_vec3){0.0, 0.0, 0.0} : y);
        }
    }
}
