/* SPDX-License-Identifier: MIT
 * The heat method and the variational method: heat, directions, a Poisson equation. Factors or a multigrid hierarchy are
 * made once and serve any number of sources. */
#include "base/allocate.h"
#include "base/os.h"
#include "operator/laplacian.h"
#include "solver/geodesic/poisson/poisson_internal.h"

#include <inttypes.h>

void poisson_clock(poisson *p, loxo_geodesic_phase phase, loxo_geodesic_info *info)
{
    const double now = loxo_os_clock_s();
    info->phase_s[phase] += now - p->clock_s;
    p->clock_s = now;
}

static void poisson_destroy(void *state)
{
    poisson *p = state;
    if (p == NULL) return;
    loxo_context *ctx = p->ctx;
    loxo_cholesky_destroy(p->poisson_factor);
    loxo_cholesky_destroy(p->heat_factor[0]);
    loxo_cholesky_destroy(p->heat_factor[1]);
    loxo_cg_destroy(p->cg);
    loxo_multigrid_destroy(p->multigrid);
    loxo_csr_destroy(ctx, &p->matrix);
    geodesic_engine_edge.destroy(p->marching);
    loxo_release(ctx, p->label);
    loxo_release(ctx, p->set_shift);
    loxo_release(ctx, p->set_seed);
    loxo_release(ctx, p->ground);
    poisson_release_held(p, &p->held);
    poisson_release_held(p, &p->pinned);
    poisson_release_ties(p);
    loxo_release(ctx, p->heat);
    loxo_release(ctx, p->heat_scale);
    loxo_release(ctx, p->own_field);
    loxo_release(ctx, p->right_side);
    loxo_release(ctx, p->dual);
    loxo_release(ctx, p);
}

/* What a call has allocated and kept counts, released what another had counts off. */
static void count_held(poisson *p, size_t bytes_before)
{
    p->metered_bytes += loxo_context_memory(p->ctx).current_bytes - bytes_before;
}

static loxo_status prepare(poisson *p)
{
    loxo_status status;
    if (p->settings.factor == LOXO_FACTOR_CHOLESKY && !loxo_cholesky_is_there())
        return loxo_fail(p->ctx, LOXO_ERR_UNSUPPORTED,
                         "geodesic: this build has no CHOLMOD; --factor multigrid does without");
    if (p->settings.method == LOXO_GEODESIC_VARIATIONAL) {
        p->dual = loxo_allocate(p->ctx, 2 * p->m.n_faces, sizeof *p->dual);
        if (p->dual == NULL) return LOXO_ERR_MEMORY;
    }
    if ((status = poisson_prepare_recovery(p)) < 0) return status;
    if (loxo_stop_wanted(p->ctx, "factor", 0.5)) return loxo_fail(p->ctx, LOXO_ERR_STOPPED, "geodesic: stopped");
    return poisson_prepare_heat(p);
}

static loxo_status poisson_create(const geodesic_problem *problem, void **state)
{
    const size_t before = loxo_context_memory(problem->ctx).current_bytes;
    poisson *p = loxo_allocate_zero(problem->ctx, 1, sizeof *p);
    *state = p;
    if (p == NULL) return LOXO_ERR_MEMORY;
    p->problem = problem;
    p->ctx = problem->ctx;
    p->m = problem->m;
    p->settings = problem->settings;
    const loxo_status status = prepare(p);
    count_held(p, before);
    return status;
}

static loxo_status judge(const poisson *p, loxo_status status, const loxo_geodesic_info *info)
{
    if (info->n_nonpositive_heat > 0)
        loxo_warn(p->ctx, "geodesic-nonpositive", info->n_nonpositive_heat,
                  "the heat of %" PRId64 " vertices is not positive (obtuse triangles); distances near them suffer",
                  info->n_nonpositive_heat);
    if (p->n_rounded > 0)
        loxo_warn(p->ctx, "geodesic-rounding", p->n_rounded,
                  "rounding ended the Poisson equation at a residual of %.1g, over %.0g (very flat triangles)",
                  p->worst, POISSON_TOLERANCE);
    if (info->n_lost_heat > 0)
        return loxo_fail(p->ctx, LOXO_CHECK_FAILED,
                         "geodesic: the heat of %" PRId64
                         " vertices is below the range of numbers: their distances mean "
                         "nothing; --factor multigrid, or a larger --time-factor, reaches them",
                         info->n_lost_heat);
    if (status == LOXO_OK && p->marching != NULL && p->settings.diffusion == LOXO_DIFFUSION_MARCHING &&
        !info->diffusion_converged)
        return loxo_fail(p->ctx, LOXO_NOT_CONVERGED, "geodesic: the diffusion did not settle");
    return status;
}

static loxo_status solve(poisson *p, const geodesic_seed *seeds, int64_t n_seeds, double *distance, loxo_index *nearest,
                         loxo_geodesic_info *info)
{
    const int64_t n = p->m.n_vertices;
    p->clock_s = loxo_os_clock_s();
    p->n_rounded = 0;
    p->worst = 0.0;
    info->stop_reason = LOXO_STOP_TOLERANCE;
    loxo_status status = poisson_hold(p, seeds, n_seeds);
    if (status >= 0) status = poisson_shift(p, seeds, n_seeds, NULL); /* which components have sources */
    if (status >= 0) status = poisson_find_field(p, seeds, n_seeds, distance, info);
    if (status < 0) return status;
    for (int64_t v = 0; v < n; ++v)
        distance[v] = 0.0;
    status = poisson_solve_field(p, distance, info);
    poisson_clock(p, LOXO_GEODESIC_PHASE_POISSON, info);
    if (status == LOXO_STOPPED) return loxo_fail(p->ctx, LOXO_ERR_STOPPED, "geodesic: stopped");
    if (status == LOXO_OK && p->dual != NULL) {
        status = poisson_vary(p, distance, info);
        if (status == LOXO_STOPPED) info->stop_reason = LOXO_STOP_MONITOR;
        poisson_clock(p, LOXO_GEODESIC_PHASE_ADMM, info);
    }
    if (status < 0) return status;
    const loxo_status of_solve = status;
    if ((status = poisson_shift(p, seeds, n_seeds, distance)) < 0) return status;
    if (nearest != NULL && (status = geodesic_label_nearest(p->problem, seeds, n_seeds, distance, nearest)) < 0)
        return status;
    poisson_clock(p, LOXO_GEODESIC_PHASE_INTEGRATE, info);
    return judge(p, of_solve, info);
}

static loxo_status poisson_solve(void *state, const geodesic_seed *seeds, int64_t n_seeds, double *distance,
                                 loxo_index *nearest, loxo_geodesic_info *info)
{
    poisson *p = state;
    const size_t before = loxo_context_memory(p->ctx).current_bytes;
    const loxo_status status = solve(p, seeds, n_seeds, distance, nearest, info);
    count_held(p, before); /* other vertices held are another matrix, and another hierarchy */
    info->workspace_bytes = p->metered_bytes + p->factor_bytes[0] + p->factor_bytes[1];
    return status;
}

/* While the last factor is made: a matrix of ours, CHOLMOD's half of it twice; and the pages of its libraries. */
#define WHILE_FACTORING 200
#define LIBRARY_BYTES   3000000

/* Of a hierarchy, a vertex, the most there is: 92 on even triangles, up to 123 on obtuse ones; 5 more where several sources
 * are held. And the dense factor of its coarsest level, with what does not grow. */
#define HIERARCHY_BYTES 128
#define COARSEST        200
#define FIXED_BYTES     16384

static size_t poisson_bytes(const geodesic_problem *problem)
{
    const int64_t n = problem->m.n_vertices, n_faces = problem->m.n_faces;
    size_t bytes = (size_t)n * 8 + (problem->settings.method == LOXO_GEODESIC_VARIATIONAL ? (size_t)n_faces * 16 : 0);
    if (problem->settings.factor == LOXO_FACTOR_CHOLESKY) {
        const size_t n_factors = problem->n_boundary_edges > 0 ? 3 : 2;
        return bytes + (size_t)n * (12 + WHILE_FACTORING) + (size_t)n_faces * 24 +
               n_factors * loxo_cholesky_guess_bytes(n) + LIBRARY_BYTES;
    }
    geodesic_problem marching = *problem;
    marching.settings.method = LOXO_GEODESIC_EDGE;
    marching.settings.global_constraints = false;
    marching.settings.recovery = LOXO_RECOVERY_ADMM;
    const int64_t n_coarsest = n < COARSEST ? n : COARSEST;
    bytes += geodesic_engine_edge.bytes(&marching) + (size_t)(n_coarsest * (n_coarsest + 1) / 2) * 8 + FIXED_BYTES;
    return bytes + loxo_laplacian_bytes(n, n_faces, problem->n_boundary_edges) - (size_t)n_faces * 32 +
           (size_t)n * HIERARCHY_BYTES + loxo_cg_bytes(n);
}

/* vertex_ns: by multigrid at 1M vertices, as for the edge-based method. */
const geodesic_engine geodesic_engine_heat = {
    .bytes = poisson_bytes,
    .vertex_ns = 1000.0,
    .create = poisson_create,
    .solve = poisson_solve,
    .destroy = poisson_destroy,
};

const geodesic_engine geodesic_engine_variational = {
    .bytes = poisson_bytes,
    .vertex_ns = 6000.0,
    .create = poisson_create,
    .solve = poisson_solve,
    .destroy = poisson_destroy,
};
