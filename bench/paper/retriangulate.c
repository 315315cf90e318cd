/* SPDX-License-Identifier: MIT
 * Other triangulations of the same surface, worse ones, for experiments. */
#include "kernel/vec3.h"
#include "paper.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static loxo_status mesh_as_given(loxo_context *ctx, const loxo_mesh_arrays *arrays, loxo_mesh **mesh)
{
    loxo_mesh_settings settings = loxo_mesh_settings_default();
    settings.order = LOXO_ORDER_GIVEN;
    return loxo_mesh_create(ctx, arrays, LOXO_BORROW, &settings, NULL, mesh);
}

/* The new vertex of the edge between a and b, from the lower number at a share of the way. */
static void split_edge(const loxo_mesh_arrays *from, double share, loxo_index a, loxo_index b, double *position)
{
    const int64_t low = a < b ? a : b, high = a < b ? b : a;
    for (int k = 0; k < 3; ++k) {
        const double p =
            from->position != NULL ? from->position[3 * low + k] : (double)from->position_float[3 * low + k];
        const double q =
            from->position != NULL ? from->position[3 * high + k] : (double)from->position_float[3 * high + k];
        position[k] = p + share * (q - p);
    }
}

/* Every face in four. Edges have the numbers that their lower half-edges come in. */
static loxo_status split(loxo_context *ctx, const loxo_mesh *mesh, const loxo_mesh_arrays *from, double share,
                         loxo_soup *to)
{
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    int64_t n = m.n_vertices;
    loxo_index *middle = loxo_allocate(ctx, 3 * m.n_faces, sizeof *middle);
    *to = (loxo_soup){0};
    if (middle == NULL) return LOXO_ERR_MEMORY;
    for (int64_t h = 0; h < 3 * m.n_faces; ++h) {
        const loxo_index twin = m.halfedge_twin[h];
        middle[h] = twin >= 0 && twin < h ? middle[twin] : (loxo_index)n++;
    }
    *to = (loxo_soup){.n_vertices = n, .n_faces = 4 * m.n_faces};
    to->position = loxo_allocate(ctx, n, 3 * sizeof *to->position);
    to->triangle = loxo_allocate(ctx, 4 * m.n_faces, 3 * sizeof *to->triangle);
    if (to->position == NULL || to->triangle == NULL) {
        loxo_release(ctx, middle);
        return LOXO_ERR_MEMORY;
    }
    for (int64_t v = 0; v < m.n_vertices; ++v)
        split_edge(from, 0.0, (loxo_index)v, (loxo_index)v, &to->position[3 * v]);
    for (int64_t f = 0; f < m.n_faces; ++f) {
        const loxo_index *v = &m.halfedge_vertex[3 * f], *w = &middle[3 * f];
        const loxo_index four[12] = {v[0], w[0], w[2], v[1], w[1], w[0], v[2], w[2], w[1], w[0], w[1], w[2]};
        memcpy(&to->triangle[12 * f], four, sizeof four);
        for (int k = 0; k < 3; ++k)
            split_edge(from, share, v[k], v[(k + 1) % 3], &to->position[3 * (int64_t)w[k]]);
    }
    loxo_release(ctx, middle);
    return LOXO_OK;
}

loxo_status paper_split_edges(loxo_context *ctx, const loxo_mesh_arrays *arrays, double share, loxo_soup *soup)
{
    loxo_mesh *mesh = NULL;
    *soup = (loxo_soup){0};
    loxo_status status = mesh_as_given(ctx, arrays, &mesh);
    if (status >= 0) status = split(ctx, mesh, arrays, share, soup);
    loxo_mesh_destroy(mesh);
    return status;
}

/* ---- longer edges -------------------------------------------------------------------------------------------- */

/* Some number in [0, 1) for h, the same at every run: its multiple of the golden ratio. */
static double drawn(int64_t h) { return fmod(0.618033988749895 * (double)h, 1.0); }

/* Triangles of a soup with the twins of their half-edges. */
typedef struct flat_flips {
    const double *position;
    loxo_index *vertex, *twin;
} flat_flips;

static loxo_vec3 position_of(const flat_flips *t, loxo_index v) { return v3_load(&t->position[3 * (int64_t)v]); }

/* Whether the faces of h, i to j, lie in one plane, and the other diagonal, k to l, is longer and inside. */
static bool is_to_lengthen(const flat_flips *t, loxo_index h)
{
    const loxo_index twin = t->twin[h];
    if (twin < h) return false;
    const loxo_vec3 i = position_of(t, t->vertex[h]), j = position_of(t, t->vertex[twin]);
    const loxo_vec3 k = position_of(t, t->vertex[k_previous(h)]), l = position_of(t, t->vertex[k_previous(twin)]);
    const loxo_vec3 a = v3_cross(v3_sub(j, i), v3_sub(k, i)), b = v3_cross(v3_sub(l, i), v3_sub(j, i));
    const loxo_vec3 c = v3_cross(v3_sub(l, i), v3_sub(k, i)), d = v3_cross(v3_sub(k, j), v3_sub(l, j));
    const double flat = 1e-9 * (v3_dot(a, a) + v3_dot(b, b)), least = 0.01 * v3_norm(v3_add(a, b));
    const loxo_vec3 bend = v3_cross(a, b);
    if (!(v3_norm(bend) < flat) || !(v3_dot(a, b) > 0.0)) return false;
    if (!(v3_norm(v3_sub(k, l)) > 1.0001 * v3_norm(v3_sub(j, i)))) return false;
    return v3_dot(c, a) > least * v3_norm(a) && v3_dot(d, a) > least * v3_norm(a);
}

static void set_twin(flat_flips *t, loxo_index h, loxo_index a)
{
    t->twin[h] = a;
    if (a >= 0) t->twin[a] = h;
}

/* Faces (i, j, k) and (j, i, l) become (i, l, k) and (j, k, l). */
static void flip(flat_flips *t, loxo_index ij)
{
    const loxo_index ji = t->twin[ij], jk = k_next(ij), ki = k_previous(ij), il = k_next(ji), lj = k_previous(ji);
    const loxo_index k = t->vertex[ki], l = t->vertex[lj], beyond_il = t->twin[il], beyond_jk = t->twin[jk];
    t->vertex[jk] = l;
    t->vertex[il] = k;
    set_twin(t, ij, beyond_il);
    set_twin(t, ji, beyond_jk);
    set_twin(t, jk, il);
}

loxo_status paper_lengthen_edges(loxo_context *ctx, const loxo_mesh_arrays *arrays, double share, loxo_soup *soup)
{
    loxo_soup half = {0};
    loxo_mesh *mesh = NULL;
    *soup = (loxo_soup){0};
    loxo_status status = paper_split_edges(ctx, arrays, 0.5, &half);
    const loxo_mesh_arrays once = loxo_soup_arrays(&half);
    if (status >= 0) status = paper_split_edges(ctx, &once, 0.5, soup);
    loxo_soup_destroy(ctx, &half);
    const loxo_mesh_arrays twice = loxo_soup_arrays(soup);
    if (status >= 0) status = mesh_as_given(ctx, &twice, &mesh);
    if (status < 0) return status;
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    loxo_index *twin = loxo_allocate(ctx, 3 * m.n_faces, sizeof *twin);
    if (twin == NULL) {
        loxo_mesh_destroy(mesh);
        return LOXO_ERR_MEMORY;
    }
    memcpy(twin, m.halfedge_twin, (size_t)m.n_faces * 3 * sizeof *twin);
    memcpy(soup->triangle, m.halfedge_vertex, (size_t)m.n_faces * 3 * sizeof *twin);
    flat_flips t = {soup->position, soup->triangle, twin};
    int64_t n_flips = share > 0.0 ? 1 : 0;
    while (n_flips > 0) { /* edges only grow: it ends */
        n_flips = 0;
        for (int64_t h = 0; h < 3 * m.n_faces; ++h) {
            if (drawn(h) >= share || !is_to_lengthen(&t, (loxo_index)h)) continue;
            flip(&t, (loxo_index)h);
            ++n_flips;
        }
    }
    loxo_release(ctx, twin);
    loxo_mesh_destroy(mesh);
    return LOXO_OK;
}
