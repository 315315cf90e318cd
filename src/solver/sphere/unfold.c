/* SPDX-License-Identifier: MIT
 * Unfolding: Algorithm 2; where that leaves triangles turned over, the vertices around them are taken out and put back anew; where
 * there is no room for that, more of them. */
#include "solver/sphere/unfold.h"

#include "solver/sphere/embedding.h"

#include <string.h>

#define N_SWEEPS     3       /* over the vertices put back, each time there are more by a share */
#define LEAST_RADIUS 0x1p-44 /* smaller stars have no digits left to be relaxed with */

/* Forces all vertices that were put back or are at triangles turned over still, and n_rings more around them. How many are forced. */
static int64_t force_patches(sphere_embedding *e, const bool *is_folded, int64_t n_rings)
{
    const loxo_mesh_view *m = &e->p->m;
    loxo_index *reached = e->list; /* of no use between two embeddings */
    int64_t n = 0;
    for (int64_t t = 0; t < m->n_faces; ++t)
        for (int k = 0; is_folded[t] && k < 3; ++k)
            e->is_free[m->halfedge_vertex[3 * t + k]] = true;
    for (int64_t v = 0; v < m->n_vertices; ++v)
        if (e->is_free[v]) reached[n++] = (loxo_index)v;
    sphere_embedding_reset(e);
    for (int64_t i = 0; i < n; ++i)
        e->is_forced[reached[i]] = true;
    for (int64_t i = 0, end = n; n_rings > 0 && i < end; --n_rings, end = n) {
        for (; i < end; ++i) {
            loxo_index h = m->vertex_halfedge[reached[i]];
            do {
                const loxo_index w = k_head(m, h);
                if (!e->is_forced[w]) reached[n++] = w;
                e->is_forced[w] = true;
                h = m->halfedge_twin[k_previous(h)];
            } while (h != m->vertex_halfedge[reached[i]]);
        }
    }
    return n;
}

/* New places for the vertices around the folds, on patches that grow until there is no fold left, or the patch is all. */
static loxo_status embed_patches(const sphere_problem *p, sphere_map f, bool *is_folded, sphere_folds *folds,
                                 loxo_sphere_info *info)
{
    const size_t bytes = (size_t)p->m.n_vertices * sizeof *f;
    const sphere_folds before = *folds;
    sphere_embedding e;
    loxo_status status = sphere_embedding_create(p, f, &e);
    if (status < 0) return status;
    sphere_map saved = loxo_allocate(p->ctx, p->m.n_vertices, sizeof *saved);
    if (saved == NULL) {
        status = LOXO_ERR_MEMORY;
        goto done;
    }
    sphere_note_bytes(p, info);
    memcpy(saved, f, bytes);
    e.least_radius = LEAST_RADIUS;
    bool is_whole = false;
    for (int64_t n_rings = 1;; n_rings *= 2) {
        status = sphere_embed(&e, is_whole, N_SWEEPS);
        if (status != LOXO_OK) break;
        status = sphere_find_folds(p, (sphere_const_map)f, is_folded, folds);
        if (status < 0 || (folds->n == 0 && folds->degree == 1) || is_whole) break;
        const int64_t n_all = e.n_there;
        is_whole = force_patches(&e, is_folded, n_rings) == n_all;
        memcpy(f, saved, bytes);
    }
    if (status != LOXO_OK || folds->n > before.n) {
        memcpy(f, saved, bytes);
        *folds = before;
    }
done:
    loxo_release(p->ctx, saved);
    sphere_embedding_destroy(&e);
    return status;
}

loxo_status sphere_unfold(const sphere_problem *p, sphere_map f, loxo_sphere_info *info)
{
    sphere_folds folds = {0};
    bool *is_folded = loxo_allocate(p->ctx, p->m.n_faces, sizeof *is_folded);
    if (is_folded == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = sphere_find_folds(p, (sphere_const_map)f, is_folded, &folds);
    if (status >= 0 && folds.n > 0) status = sphere_unfold_mean_value(p, f, is_folded, &folds);
    if (status == LOXO_OK && folds.n > 0 && p->m.n_vertices >= 4) status = embed_patches(p, f, is_folded, &folds, info);
    info->n_folds = folds.n;
    loxo_release(p->ctx, is_folded);
    return status;
}
