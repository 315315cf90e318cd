/* SPDX-License-Identifier: MIT
 * What every method starts from: the matrix, the areas, and what is told on the way. */
#include "base/allocate.h"
#include "operator/laplacian.h"
#include "solver/sphere/sphere_internal.h"

#include <math.h>

/* Shares of the area. */
static loxo_status normalise_areas(const sphere_problem *p)
{
    double sum = 0.0;
    for (int64_t i = 0; i < p->m.n_vertices; ++i)
        sum += p->area[i];
    if (!(sum > 0.0) || !isfinite(sum))
        return loxo_fail(p->ctx, LOXO_ERR_MESH, "sphere: the surface has no area, or one that is not finite");
    for (int64_t i = 0; i < p->m.n_vertices; ++i)
        p->area[i] /= sum;
    return LOXO_OK;
}

loxo_status sphere_problem_create(loxo_context *ctx, const loxo_mesh_view *m, const loxo_mesh_view *weights,
                                  const loxo_sphere_settings *settings, sphere_problem *p)
{
    const size_t base_bytes = loxo_context_memory(ctx).current_bytes;
    *p = (sphere_problem){.ctx = ctx, .m = *m, .settings = *settings, .base_bytes = base_bytes};
    if ((p->area = loxo_allocate(ctx, m->n_vertices, sizeof *p->area)) == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = loxo_laplacian_create(ctx, weights, &p->laplacian, p->area);
    if (status >= 0) status = normalise_areas(p);
    if (status < 0) sphere_problem_destroy(p);
    return status;
}

void sphere_problem_destroy(sphere_problem *p)
{
    if (p->ctx == NULL) return;
    loxo_csr_destroy(p->ctx, &p->laplacian);
    loxo_release(p->ctx, p->area);
    p->area = NULL;
}

void sphere_note_bytes(const sphere_problem *p, loxo_sphere_info *info)
{
    const size_t now = loxo_context_memory(p->ctx).current_bytes;
    if (now > p->base_bytes && now - p->base_bytes > info->workspace_bytes) info->workspace_bytes = now - p->base_bytes;
}

bool sphere_tell(const sphere_problem *p, const char *phase, bool always, const loxo_sphere_info *info)
{
    const loxo_progress progress = {.phase = phase,
                                    .fraction = -1.0,
                                    .iteration = info->n_iterations,
                                    .n_iterations = p->settings.max_iterations,
                                    .objective = info->energy,
                                    .residual = info->residual};
    return loxo_progress_tell(p->ctx, &progress, always);
}
