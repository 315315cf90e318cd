/* SPDX-License-Identifier: MIT */
#include "solver/geodesic/parallel_heat/admm.h"

#include "par/range.h"

#define CHECK_EVERY 10 /* iterations between tests for stopping: a test costs nearly an iteration */

loxo_status heat_iterate(const admm_problem *problem, loxo_geodesic_info *info)
{
    const parallel_heat *g = problem->g;
    const loxo_geodesic_settings *settings = &g->settings;
    loxo_status status = LOXO_OK;
    int64_t iteration = 0;
    info->stop_reason = LOXO_STOP_MAX_ITERATIONS;
    while (iteration < settings->n_iterations && info->stop_reason == LOXO_STOP_MAX_ITERATIONS) {
        if (problem->before != NULL) problem->before(problem->arg, iteration);
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, g->m.n_faces, problem->face_ns))
        {
            const loxo_range r = loxo_thread_range(g->m.n_faces);
            problem->iterate(problem->arg, r.begin, r.end, iteration);
        }
        ++iteration;
        if (problem->after != NULL) problem->after(problem->arg, iteration);
        const bool is_tested = iteration == settings->n_iterations || iteration % CHECK_EVERY == 0;
        if (is_tested) {
            if ((status = problem->test(problem->arg, iteration, info)) < 0) return status;
            if (info->residual <= settings->primal_tolerance && info->dual_residual <= settings->dual_tolerance)
                info->stop_reason = LOXO_STOP_TOLERANCE;
        }
        if (!heat_tell_iteration(problem->g, iteration, info)) continue;
        info->stop_reason = LOXO_STOP_MONITOR;
        if (!is_tested && (status = problem->test(problem->arg, iteration, info)) < 0) return status;
    }
    info->n_iterations = iteration;
    return status;
}
