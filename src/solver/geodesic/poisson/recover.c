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

#define TOLERANCE 1e-8
#define MAX_STEPS 2000

/* One vertex of each component is held at 0: the constants are shifted afterwards anyhow. */
static loxo_status pin_components(poisson *p, loxo_csr *a)
{
    const int64_t n = a->n_rows;
    bool *is_pinned = loxo_allocate_zero(p->ctx, n, sizeof *is_pinned);
    bool *is_seen = loxo_allocate_zero(p->ctx, p->n_sets, sizeof *is_seen);
    if (is_pinned != NULL && is_seen != NULL) {
        for (int64_t v = 0; v < n; ++v) {
            const int64_t set = p->label != NULL ? p->label[v] : 0;
            is_pinned[v] = !is_seen[set];
            is_seen[set] = true;
        }
        loxo_csr_pin(p->ctx, a, is_pinned);
    }
    const bool is_done = is_pinned != NULL && is_seen != NULL;
    loxo_release(p->ctx, is_seen);
    loxo_release(p->ctx, is_pinned);
    return is_done ? LOXO_OK : LOXO_ERR_MEMORY;
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
    return p->set_shift == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
}

loxo_status poisson_prepare_recovery(poisson *p)
{
    const int64_t n = p->m.n_vertices;
    if ((p->right_side = loxo_allocate(p->ctx, n, sizeof *p->right_side)) == NULL) return LOXO_ERR_MEMORY;
    p->workspace_bytes += (size_t)n * sizeof *p->right_side;
    loxo_status status = loxo_laplacian_create(p->ctx, &p->m, &p->matrix, NULL);
    if (status < 0 || (status = label_components(p)) < 0) return status;
    if (p->settings.factor == LOXO_FACTOR_MULTIGRID) {
        loxo_multigrid_info grid;
        if ((status = loxo_multigrid_create(p->ctx, &p->matrix, &grid, &p->multigrid)) < 0) return status;
        p->workspace_bytes += loxo_csr_bytes(&p->matrix) + grid.bytes + loxo_cg_bytes(n);
        return loxo_cg_create(p->ctx, &p->matrix, &p->cg);
    }
    loxo_cholesky_info info;
    if ((status = pin_components(p, &p->matrix)) < 0) return status;
    if ((status = loxo_cholesky_create(p->ctx, &p->matrix, &info, &p->poisson_factor)) < 0) return status;
    p->workspace_bytes += info.factor_bytes;
    status = loxo_cholesky_factor(p->poisson_factor, &p->matrix);
    loxo_csr_destroy(p->ctx, &p->matrix);
    return status;
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

/* Of the pinned vertices: the first of each component, as pin_components. */
static void clear_pinned(const poisson *p, double *b)
{
    int64_t n_seen = 0;
    for (int64_t v = 0; v < p->m.n_vertices && n_seen < p->n_sets; ++v)
        if (p->label == NULL || p->label[v] == n_seen) { /* sets count in the order of their first vertices */
            b[v] = 0.0;
            ++n_seen;
        }
}

loxo_status poisson_solve_field(poisson *p, double *distance, loxo_geodesic_info *info)
{
    find_divergence(p);
    if (p->cg == NULL) {
        clear_pinned(p, p->right_side);
        return loxo_cholesky_solve(p->poisson_factor, p->right_side, distance);
    }
    const loxo_preconditioner m = {loxo_multigrid_apply, p->multigrid};
    const loxo_cg_settings settings = {.tolerance = TOLERANCE, .max_iterations = MAX_STEPS};
    loxo_cg_info cg;
    const loxo_status status = loxo_cg_solve(p->cg, &m, &settings, p->right_side, distance, &cg);
    if (status < 0) return status;
    info->n_poisson_steps += cg.n_iterations;
    info->poisson_residual = cg.residual;
    if (status == LOXO_STOPPED) return loxo_fail(p->ctx, LOXO_STOPPED, "geodesic: stopped during the Poisson equation");
    /* Rounding ends it close to the tolerance where triangles are very flat: say so only when that matters. */
    if (status != LOXO_OK && !(cg.residual <= 1e-4))
        return loxo_fail(p->ctx, LOXO_NOT_CONVERGED,
                         "geodesic: the Poisson equation was solved to %.2g only, in %" PRId64 " steps", cg.residual,
                         cg.n_iterations);
    return LOXO_OK;
}

static void lower(const poisson *p, int64_t v, double value)
{
    double *shift = &p->set_shift[p->label != NULL ? p->label[v] : 0];
    *shift = fmin(*shift, value);
}

/* The lowest seed of a component gets 0. */
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
#pragma omp parallel num_threads(loxo_threads_for(p->ctx, p->m.n_vertices, 2.0))
    {
        const loxo_range r = loxo_thread_range(p->m.n_vertices);
        for (int64_t v = r.begin; v < r.end; ++v) {
            const double shift = p->set_shift[p->label != NULL ? p->label[v] : 0];
            distance[v] = shift < HUGE_VAL ? distance[v] - shift : HUGE_VAL;
            if (distance[v] > most) distance[v] = HUGE_VAL;
        }
    }
    return LOXO_OK;
}
