/* SPDX-License-Identifier: MIT
 * Heat after the time t = m h^2, and the directions in which it falls: by factors of A + t C, or by the marching
 * diffusion of the parallel heat method. */
#include "base/allocate.h"
#include "kernel/descent_kernel.h"
#include "kernel/unfold_kernel.h"
#include "operator/laplacian.h"
#include "par/range.h"
#include "solver/geodesic/poisson/poisson_internal.h"

#include <float.h>
#include <inttypes.h>
#include <math.h>
#include <string.h>

static bool is_at_boundary(const loxo_mesh_view *m, int64_t v)
{
    return m->vertex_halfedge[v] >= 0 && m->halfedge_twin[m->vertex_halfedge[v]] < 0;
}

/* A + t C in units of the mean edge's size, a power of two, factored; with heat 0 at the boundary when is_pinned. What is
 * lost of the heat then does not depend on the unit of length. */
static loxo_status factor_heat(poisson *p, bool is_pinned, loxo_cholesky **factor)
{
    const int64_t n = p->m.n_vertices;
    const double size = exp2((double)ilogb(p->problem->mean_edge_length)), h = p->problem->mean_edge_length / size;
    loxo_csr a = {0};
    bool *is_rim = NULL;
    double *mass = loxo_allocate(p->ctx, n, sizeof *mass);
    loxo_status status = mass == NULL ? LOXO_ERR_MEMORY : loxo_laplacian_create(p->ctx, &p->m, &a, mass);
    if (status < 0) goto done;
    for (int64_t v = 0; v < n; ++v)
        mass[v] = mass[v] / size / size;
    loxo_csr_scale_shift(p->ctx, &a, p->settings.time_factor * h * h, mass);
    if (is_pinned) {
        if ((is_rim = loxo_allocate(p->ctx, n, sizeof *is_rim)) == NULL) {
            status = LOXO_ERR_MEMORY;
            goto done;
        }
        for (int64_t v = 0; v < n; ++v)
            is_rim[v] = is_at_boundary(&p->m, v);
        loxo_csr_pin(p->ctx, &a, is_rim);
    }
    loxo_cholesky_info info;
    if ((status = loxo_cholesky_create(p->ctx, &a, &info, factor)) < 0) goto done;
    p->factor_bytes[0] += info.factor_bytes;
    status = loxo_cholesky_factor(*factor, &a);
done:
    loxo_release(p->ctx, is_rim);
    loxo_release(p->ctx, mass);
    loxo_csr_destroy(p->ctx, &a);
    return status;
}

loxo_status poisson_prepare_heat(poisson *p)
{
    const int64_t n = p->m.n_vertices, n_faces = p->m.n_faces;
    loxo_status status;
    if (p->settings.factor == LOXO_FACTOR_MULTIGRID) {
        p->marching_problem = *p->problem;
        p->marching_problem.settings.method = LOXO_GEODESIC_EDGE;
        p->marching_problem.settings.max_distance = HUGE_VAL;
        p->marching_problem.settings.global_constraints = false;
        p->marching_problem.settings.recovery = LOXO_RECOVERY_ADMM; /* its room is where the field goes */
        void *state = NULL;
        status = geodesic_engine_edge.create(&p->marching_problem, &state);
        p->marching = state;
        if (status < 0) return status;
        p->field = p->marching->difference;
        return LOXO_OK;
    }
    p->heat = loxo_allocate(p->ctx, n, sizeof *p->heat);
    p->heat_scale = loxo_allocate(p->ctx, n, sizeof *p->heat_scale);
    p->field = p->own_field = loxo_allocate(p->ctx, 3 * n_faces, sizeof *p->own_field);
    if (p->heat == NULL || p->heat_scale == NULL || p->own_field == NULL) return LOXO_ERR_MEMORY;
    if ((status = factor_heat(p, false, &p->heat_factor[0])) < 0) return status;
    return p->problem->n_boundary_edges > 0 ? factor_heat(p, true, &p->heat_factor[1]) : LOXO_OK;
}

/* A point inside a face heats its corners by its weights. */
static void set_sources(const poisson *p, const geodesic_seed *seeds, int64_t n_seeds, double *b)
{
    memset(b, 0, (size_t)p->m.n_vertices * sizeof *b);
    for (int64_t i = 0; i < n_seeds; ++i) {
        if (seeds[i].vertex >= 0) {
            b[seeds[i].vertex] = 1.0;
            continue;
        }
        for (int k = 0; k < 3; ++k)
            b[p->m.halfedge_vertex[(int64_t)3 * seeds[i].face + k]] += seeds[i].weight[k];
    }
}

/* Faces with points inside want the differences of straight distances. Seeds of one face follow each other. */
static void aim_from_points(const poisson *p, const geodesic_seed *seeds, int64_t n_seeds)
{
    for (int64_t i = 0; i < n_seeds;) {
        double nearest[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, length[3];
        const int64_t f = seeds[i].face;
        if (seeds[i].vertex >= 0) {
            ++i;
            continue;
        }
        k_face_lengths(&p->m, f, length);
        const k_layout face = k_layout_of(length);
        for (; i < n_seeds && seeds[i].vertex < 0 && seeds[i].face == f; ++i)
            for (int k = 0; k < 3; ++k)
                nearest[k] = fmin(nearest[k], k_distance_to_corner(face, seeds[i].weight, k));
        for (int k = 0; k < 3; ++k)
            p->field[3 * f + k] = nearest[k == 2 ? 0 : k + 1] - nearest[k];
    }
}

/* As value * 2^scale, value near 1, so that small heat does not vanish when it is squared. Counts heat that is not
 * positive, and heat that is below the range of doubles, where digits or all of it are lost. */
static void normalise(poisson *p, loxo_geodesic_info *info)
{
    int64_t n_lost = 0, n_negative = 0;
#pragma omp parallel num_threads(loxo_threads_for(p->ctx, p->m.n_vertices, 3.0)) reduction(+ : n_lost, n_negative)
    {
        const loxo_range r = loxo_thread_range(p->m.n_vertices);
        for (int64_t v = r.begin; v < r.end; ++v) {
            const double u = p->heat[v];
            p->heat_scale[v] = K_NOT_REACHED;
            if (p->m.vertex_halfedge[v] < 0 || (p->label != NULL && p->set_shift[p->label[v]] == HUGE_VAL)) continue;
            n_negative += u < 0.0;
            n_lost += fabs(u) < DBL_MIN;
            if (!(fabs(u) >= DBL_MIN)) continue;
            p->heat_scale[v] = k_exponent(u);
            p->heat[v] = u * k_power_of_two(-(int64_t)p->heat_scale[v]);
        }
    }
    info->n_nonpositive_heat = n_negative;
    info->n_lost_heat = n_lost;
}

static loxo_status find_heat(poisson *p, const geodesic_seed *seeds, int64_t n_seeds, double *work,
                             loxo_geodesic_info *info)
{
    const int64_t n = p->m.n_vertices;
    set_sources(p, seeds, n_seeds, p->right_side);
    loxo_status status = loxo_cholesky_solve(p->heat_factor[0], p->right_side, p->heat);
    if (status < 0) return status;
    if (p->heat_factor[1] != NULL) {
        for (int64_t v = 0; v < n; ++v)
            if (is_at_boundary(&p->m, v)) p->right_side[v] = 0.0;
        if ((status = loxo_cholesky_solve(p->heat_factor[1], p->right_side, work)) < 0) return status;
        for (int64_t v = 0; v < n; ++v)
            p->heat[v] = 0.5 * (p->heat[v] + work[v]);
    }
    normalise(p, info);
    return LOXO_OK;
}

static loxo_status march_heat(poisson *p, const geodesic_seed *seeds, int64_t n_seeds, loxo_geodesic_info *info)
{
    parallel_heat *g = p->marching;
    diffusion_result diffusion = {0};
    loxo_status status = heat_begin(g, seeds, n_seeds);
    if (status < 0) return status;
    poisson_clock(p, LOXO_GEODESIC_PHASE_LEVELS, info);
    status = g->settings.diffusion == LOXO_DIFFUSION_MARCHING ? heat_march(g, &diffusion) : heat_sweep(g, &diffusion);
    if (status < 0) return status;
    if (diffusion.stopped) return loxo_fail(p->ctx, LOXO_ERR_STOPPED, "geodesic: stopped before there was any heat");
    info->n_levels = g->n_levels;
    info->n_evaluations = diffusion.n_updates;
    info->max_window = diffusion.max_window;
    info->diffusion_converged = diffusion.is_settled;
    info->diffusion_change = diffusion.change;
    info->n_nonpositive_heat = diffusion.n_nonpositive;
    poisson_clock(p, LOXO_GEODESIC_PHASE_DIFFUSION, info);
    heat_to_vertices(g);
    return LOXO_OK;
}

loxo_status poisson_find_field(poisson *p, const geodesic_seed *seeds, int64_t n_seeds, double *work,
                               loxo_geodesic_info *info)
{
    const bool is_marching = p->marching != NULL;
    const double h = p->problem->mean_edge_length;
    loxo_status status = is_marching ? march_heat(p, seeds, n_seeds, info) : find_heat(p, seeds, n_seeds, work, info);
    if (status < 0) goto done;
    if (!is_marching) poisson_clock(p, LOXO_GEODESIC_PHASE_DIFFUSION, info);
    info->time = p->settings.time_factor * h * h;
    const k_variant *kernels = k_variant_get(loxo_context_isa(p->ctx));
    const double *value = is_marching ? p->marching->vertex_value : p->heat;
    const int32_t *scale = is_marching ? p->marching->vertex_scale : p->heat_scale;
#pragma omp parallel num_threads(loxo_threads_for(p->ctx, p->m.n_faces, 8.0))
    {
        const loxo_range r = loxo_thread_range(p->m.n_faces);
        kernels->face_differences(&p->m, value, scale, r.begin, r.end, p->field);
    }
    if (is_marching) status = heat_fill_flat_faces(p->marching, p->field);
    aim_from_points(p, seeds, n_seeds);
    poisson_clock(p, LOXO_GEODESIC_PHASE_GRADIENT, info);
done:
    if (is_marching) heat_end(p->marching);
    return status;
}
