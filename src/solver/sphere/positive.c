/* SPDX-License-Identifier: MIT
 * A map without folds of any closed surface of genus 0: the surface is taken down to four vertices, and all others are put back one by
 * one, each where it turns no triangle over. README.md has the argument. */
#include "solver/sphere/embedding.h"

#include <string.h>

#define N_SWEEPS      3       /* over all vertices, each time there are more by a share */
#define N_LAST_SWEEPS 10      /* when all are there */
#define LEAST_RADIUS  0x1p-36 /* no star is made smaller than that: later steps need digits */

/* The area-weighted mean goes to 0, unless that turns something over. */
static loxo_status center(const sphere_problem *p, sphere_map f)
{
    const size_t bytes = (size_t)p->m.n_vertices * sizeof *f;
    sphere_folds folds;
    sphere_map saved = loxo_allocate(p->ctx, p->m.n_vertices, sizeof *saved);
    if (saved == NULL) return LOXO_ERR_MEMORY;
    memcpy(saved, f, bytes);
    loxo_status status = sphere_center(p, f, NULL);
    if (status >= 0) {
        const loxo_status counted = sphere_find_folds(p, (sphere_const_map)f, NULL, &folds);
        if (counted < 0) status = counted;
    }
    if (status < 0 || folds.n > 0) memcpy(f, saved, bytes);
    loxo_release(p->ctx, saved);
    return status < 0 || status == LOXO_STOPPED ? status : LOXO_OK;
}

loxo_status sphere_map_positive(const sphere_problem *p, sphere_map f, loxo_sphere_info *info)
{
    sphere_embedding e;
    if (p->m.n_vertices < 4)
        return loxo_fail(p->ctx, LOXO_ERR_MESH, "sphere: %lld vertices are too few for triangles on a sphere",
                         (long long)p->m.n_vertices);
    loxo_status status = sphere_embedding_create(p, f, &e);
    if (status < 0) return status;
    sphere_note_bytes(p, info);
    e.least_radius = LEAST_RADIUS;
    for (int64_t v = 0; v < p->m.n_vertices; ++v)
        v3_store(f[v], (loxo_vec3){0.0, 0.0, 1.0});
    status = sphere_embed(&e, true, N_SWEEPS);
    for (int k = 0; status == LOXO_OK && k < N_LAST_SWEEPS; ++k) {
        for (int64_t i = 0; i < e.n_free; ++i)
            sphere_relax_vertex(&e, e.free[i]);
        if (loxo_stop_wanted(p->ctx, "embed", (double)k / N_LAST_SWEEPS)) status = LOXO_STOPPED;
    }
    sphere_embedding_destroy(&e);
    return status == LOXO_OK ? center(p, f) : status;
}
