/* SPDX-License-Identifier: MIT
 * The function whose gradient is nearest to a field: C d = div, natural boundary conditions. */
#include "base/allocate.h"
#include "kernel/poisson_kernel.h"
#include "kernel/unfold_kernel.h"
#include "operator/laplacian.h"
#include "par/range.h"
#include "solver/geodesic/poisson/poisson_internal.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

#define MAX_STEPS 2000
/* Rounding may end it before; up to here that is only worth a warning. */
#define MOST_ROUNDED 1e-4

static loxo_status make_matrix(poisson *p)
{
    loxo_csr_destroy(p->ctx, &p->matrix);
    const loxo_status status = loxo_laplacian_create(p->ctx, &p->m, &p->matrix, NULL);
    p->is_whole = status >= 0;
    return status;
}

static loxo_status pin(poisson *p)
{
    if (p->pinned.n == 0) return LOXO_OK;
    bool *is_pinned = loxo_allocate_zero(p->ctx, p->m.n_vertices, sizeof *is_pinned);
    if (is_pinned == NULL) return LOXO_ERR_MEMORY;
    for (int64_t k = 0; k < p->pinned.n; ++k)
        is_pinned[p->pinned.vertex[k]] = true;
    p->is_whole = false;
    loxo_csr_pin(p->ctx, &p->matrix, is_pinned);
    loxo_release(p->ctx, is_pinned);
    return LOXO_OK;
}

static loxo_status label_components(poisson *p)
{
    const int64_t n = p->m.n_vertices;
    if ((p->label = loxo_allocate(p->ctx, n, sizeof *p->label)) == NULL) return LOXO_ERR_MEMORY;
    const loxo_status status = loxo_csr_components(p->ctx, &p->matrix, p->label, &p->n_sets);
    if (status < 0) return status;
    if (p->n_sets == 1) {
        loxo_release(p->ctx, p->label);
        p->label = NULL;
    }
    p->set_shift = loxo_allocate(p->ctx, p->n_sets, sizeof *p->set_shift);
    p->set_seed = loxo_allocate(p->ctx, p->n_sets, sizeof *p->set_seed);
    p->ground = loxo_allocate(p->ctx, p->n_sets, sizeof *p->ground);
    if (p->set_shift == NULL || p->set_seed == NULL || p->ground == NULL) return LOXO_ERR_MEMORY;
    int64_t n_seen = 0;
    for (int64_t v = 0; v < n && n_seen < p->n_sets; ++v) /* sets count in the order of their first vertices */
        if (p->label == NULL || p->label[v] == n_seen) p->ground[n_seen++] = (loxo_index)v;
    return LOXO_OK;
}

/* From the matrix, which factors take the place of. */
static loxo_status make_solver(poisson *p)
{
    loxo_status status = pin(p);
    if (status < 0) return status;
    if (p->settings.factor == LOXO_FACTOR_MULTIGRID) {
        if ((status = loxo_multigrid_create(p->ctx, &p->matrix, NULL, &p->multigrid)) < 0) return status;
        status = loxo_cg_create(p->ctx, &p->matrix, &p->cg);
    } else {
        loxo_cholesky_info info;
        if (p->poisson_factor == NULL) {
            if ((status = loxo_cholesky_create(p->ctx, &p->matrix, &info, &p->poisson_factor)) < 0) return status;
            p->factor_bytes[1] = info.factor_bytes;
        }
        status = loxo_cholesky_factor(p->poisson_factor, &p->matrix);
        loxo_csr_destroy(p->ctx, &p->matrix);
        p->is_whole = false;
    }
    p->is_ready = status >= 0;
    return status;
}

loxo_status poisson_prepare_recovery(poisson *p)
{
    const int64_t n = p->m.n_vertices;
    if ((p->right_side = loxo_allocate(p->ctx, n, sizeof *p->right_side)) == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = make_matrix(p);
    if (status < 0 || (status = label_components(p)) < 0) return status;
    return poisson_hold(p, NULL, 0);
}

loxo_status poisson_renew(poisson *p)
{
    p->is_ready = false;
    loxo_cg_destroy(p->cg);
    loxo_multigrid_destroy(p->multigrid);
    p->cg = NULL;
    p->multigrid = NULL;
    const loxo_status status = p->is_whole ? LOXO_OK : make_matrix(p);
    return status < 0 ? status : make_solver(p);
}

static void find_divergence(poisson *p)
{
#pragma omp parallel num_threads(loxo_threads_for(p->ctx, p->m.n_faces, 40.0))
    {
        const loxo_range r = loxo_thread_range(p->m.n_faces);
        k_weigh_field(&p->m, r.begin, r.end, p->field);
    }
#pragma omp parallel num_threads(loxo_threads_for(p->ctx, p->m.n_vertices, 20.0))
    {
        const loxo_range r = loxo_thread_range(p->m.n_vertices);
        for (int64_t v = r.begin; v < r.end; ++v)
            p->right_side[v] = k_divergence_at(&p->m, p->field, v);
    }
}

loxo_status poisson_solve_field(poisson *p, double *distance, loxo_geodesic_info *info)
{
    loxo_status status;
    poisson_take_held(p, distance);
    find_divergence(p);
    for (int64_t k = 0; k < p->pinned.n; ++k)
        p->right_side[p->pinned.vertex[k]] = 0.0;
    if (p->cg == NULL) {
        status = loxo_cholesky_solve(p->poisson_factor, p->right_side, distance);
        if (status >= 0 && p->ties.n_groups > 0) status = poisson_pull_ties(p, distance);
        poisson_put_held(p, distance);
        return status;
    }
    const loxo_preconditioner m = {loxo_multigrid_apply, p->multigrid};
    const loxo_cg_settings settings = {.tolerance = POISSON_TOLERANCE, .max_iterations = MAX_STEPS};
    loxo_cg_info cg;
    if ((status = loxo_cg_solve(p->cg, &m, &settings, p->right_side, distance, &cg)) < 0) return status;
    poisson_put_held(p, distance);
    info->n_poisson_steps += cg.n_iterations;
    info->poisson_residual = cg.residual;
    if (status == LOXO_STOPPED) return loxo_fail(p->ctx, LOXO_STOPPED, "geodesic: stopped during the Poisson equation");
    const bool is_by_rounding = cg.stop_reason != LOXO_CG_MAX_ITERATIONS && cg.residual <= MOST_ROUNDED;
    if (status == LOXO_NOT_CONVERGED && is_by_rounding) {
        ++p->n_rounded;
        p->worst = fmax(p->worst, cg.residual);
    }
    if (status == LOXO_NOT_CONVERGED && !is_by_rounding)
        return loxo_fail(p->ctx, LOXO_NOT_CONVERGED,
                         "geodesic: the Poisson equation was solved to %.2g only, in %" PRId64 " steps", cg.residual,
                         cg.n_iterations);
    return LOXO_OK;
}

static void lower(const poisson *p, int64_t v, double value)
{
    double *shift = &p->set_shift[poisson_set_of(p, v)];
    *shift = fmin(*shift, value);
}

/* The lowest seed of a component gets 0, where they are not held. */
loxo_status poisson_shift(poisson *p, const geodesic_seed *seeds, int64_t n_seeds, double *distance)
{
    const double most = p->problem->settings.max_distance;
    for (int64_t s = 0; s < p->n_sets; ++s)
        p->set_shift[s] = HUGE_VAL;
    for (int64_t i = 0; i < n_seeds; ++i) {
        if (seeds[i].vertex >= 0) {
            lower(p, seeds[i].vertex, distance != NULL ? distance[seeds[i].vertex] : 0.0);
            continue;
        }
        double length[3];
        k_face_lengths(&p->m, seeds[i].face, length);
        const k_layout face = k_layout_of(length);
        for (int k = 0; k < 3; ++k) {
            const loxo_index v = p->m.halfedge_vertex[(int64_t)3 * seeds[i].face + k];
            lower(p, v, distance != NULL ? distance[v] - k_distance_to_corner(face, seeds[i].weight, k) : 0.0);
        }
    }
    if (distance == NULL) return LOXO_OK;
    for (int64_t s = 0; s < p->n_sets; ++s)
        if (p->set_seed[s] == POISSON_HELD) p->set_shift[s] = 0.0;
#pragma omp parallel num_threads(loxo_threads_for(p->ctx, p->m.n_vertices, 2.0))
    {
        const loxo_range r = loxo_thread_range(p->m.n_vertices);
        for (int64_t v = r.begin; v < r.end; ++v) {
            const double shift = p->set_shift[poisson_set_of(p, v)];
            distance[v] = shift < HUGE_VAL ? distance[v] - shift : HUGE_VAL;
            if (distance[v] > most) distance[v] = HUGE_VAL;
        }
    }
    return LOXO_OK;
}
