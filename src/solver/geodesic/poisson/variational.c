/* SPDX-License-Identifier: MIT
 * The variational method: less of the integral of (|grad d| - 1)^2, by ADMM from the heat method's distance. */
#include "kernel/poisson_kernel.h"
#include "par/range.h"
#include "solver/geodesic/poisson/poisson_internal.h"

#include <math.h>
#include <string.h>

typedef struct step_arg {
    const poisson *p;
    const double *distance;
    double r;
} step_arg;

/* sums: as k_variational_face. */
static void partial_step(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const step_arg *a = arg;
    const loxo_mesh_view *m = &a->p->m;
    for (int64_t f = begin; f < end; ++f) {
        const loxo_index *v = &m->halfedge_vertex[3 * f];
        const double *d = a->distance, rise[2] = {d[v[1]] - d[v[0]], d[v[0]] - d[v[2]]};
        double length[3];
        k_face_lengths(m, f, length);
        k_variational_face(length, rise, a->r, &a->p->dual[2 * f], &a->p->field[3 * f], sums);
    }
}

loxo_status poisson_vary(poisson *p, double *distance, loxo_geodesic_info *info)
{
    const step_arg arg = {p, distance, 0.01 * p->settings.penalty};
    loxo_status status = LOXO_OK, of_solve = LOXO_OK; /* of the last solve, which the distances are from */
    memset(p->dual, 0, (size_t)(2 * p->m.n_faces) * sizeof *p->dual);
    info->stop_reason = LOXO_STOP_MAX_ITERATIONS;
    for (;; ++info->n_iterations) {
        double sums[3];
        if ((status = loxo_sum(p->ctx, p->m.n_faces, 3, partial_step, &arg, sums)) < 0) return status;
        info->objective = 0.5 * sums[0];
        info->residual = sums[2] > 0.0 ? sqrt(sums[1] / sums[2]) : 0.0;
        if (info->n_iterations == p->settings.n_iterations) return of_solve;
        if (info->residual <= p->settings.primal_tolerance) {
            info->stop_reason = LOXO_STOP_TOLERANCE;
            return of_solve;
        }
        const loxo_progress progress = {.phase = "ADMM",
                                        .fraction = (double)info->n_iterations / (double)p->settings.n_iterations,
                                        .iteration = info->n_iterations,
                                        .n_iterations = p->settings.n_iterations,
                                        .objective = info->objective,
                                        .residual = info->residual};
        if (loxo_progress_tell(p->ctx, &progress, false)) {
            info->stop_reason = LOXO_STOP_MONITOR;
            return loxo_fail(p->ctx, LOXO_STOPPED, "geodesic: stopped; the distances are those of the last state");
        }
        if ((of_solve = poisson_solve_field(p, distance, info)) < 0 || of_solve == LOXO_STOPPED) return of_solve;
    }
}
