/* SPDX-License-Identifier: MIT
 * A triangulation that vertices are taken out of by collapses of half-edges, and put back into in the opposite order. A collapse
 * only relabels what is left and re-pairs four half-edges; the two faces that go keep their corners and twins, so that it can be undone. */
#include "solver/sphere/embedding.h"

#include <string.h>

#define MANY 256 /* neighbours */

static void lay_out(sphere_embedding *e)
{
    const int64_t n = e->p->m.n_vertices, n_halfedges = 3 * e->p->m.n_faces;
    loxo_arena *arena = &e->arena;
    e->corner = loxo_arena_take(arena, n_halfedges, sizeof *e->corner);
    e->twin = loxo_arena_take(arena, n_halfedges, sizeof *e->twin);
    e->first = loxo_arena_take(arena, n, sizeof *e->first);
    e->degree = loxo_arena_take(arena, n, sizeof *e->degree);
    e->lock = loxo_arena_take(arena, n, sizeof *e->lock);
    e->listed = loxo_arena_take(arena, n, sizeof *e->listed);
    e->list = loxo_arena_take(arena, n, sizeof *e->list);
    e->next_list = loxo_arena_take(arena, n, sizeof *e->next_list);
    e->leaving = loxo_arena_take(arena, n, sizeof *e->leaving);
    e->removed = loxo_arena_take(arena, n, sizeof *e->removed);
    e->removed_round = loxo_arena_take(arena, n, sizeof *e->removed_round);
    e->free = loxo_arena_take(arena, n, sizeof *e->free);
    e->is_forced = loxo_arena_take(arena, n, sizeof *e->is_forced);
    e->is_free = loxo_arena_take(arena, n, sizeof *e->is_free);
}

loxo_status sphere_embedding_create(const sphere_problem *p, sphere_map f, sphere_embedding *out)
{
    *out = (sphere_embedding){.p = p, .f = f};
    lay_out(out);
    const loxo_status status = loxo_arena_reserve(p->ctx, &out->arena, "embedding on the sphere");
    if (status < 0) return status;
    lay_out(out);
    sphere_embedding_reset(out);
    return LOXO_OK;
}

void sphere_embedding_destroy(sphere_embedding *e) { loxo_arena_destroy(e->p->ctx, &e->arena); }

void sphere_embedding_reset(sphere_embedding *e)
{
    const loxo_mesh_view *m = &e->p->m;
    const size_t n = (size_t)m->n_vertices, n_halfedges = (size_t)(3 * m->n_faces);
    memcpy(e->corner, m->halfedge_vertex, n_halfedges * sizeof *e->corner);
    memcpy(e->twin, m->halfedge_twin, n_halfedges * sizeof *e->twin);
    memcpy(e->first, m->vertex_halfedge, n * sizeof *e->first);
    memset(e->degree, 0, n * sizeof *e->degree);
    memset(e->lock, 0, n * sizeof *e->lock);
    memset(e->listed, 0, n * sizeof *e->listed);
    memset(e->is_forced, 0, n * sizeof *e->is_forced);
    memset(e->is_free, 0, n * sizeof *e->is_free);
    for (size_t h = 0; h < n_halfedges; ++h)
        e->degree[e->corner[h]] += 1;
    e->n_there = 0;
    for (size_t v = 0; v < n; ++v)
        e->n_there += e->degree[v] > 0;
    e->n_list = e->n_removed = e->n_free = e->n_failed = 0;
    e->round = 0;
}

static bool are_neighbours(const sphere_embedding *e, loxo_index v, loxo_index w, bool is_patient)
{
    const loxo_index center = e->degree[v] <= e->degree[w] ? v : w, other = center == v ? w : v;
    const int64_t n = e->degree[center];
    if (n > MANY && !is_patient) return true;
    loxo_index h = e->first[center];
    for (int64_t i = 0; i < n; ++i, h = embedding_turn(e, h))
        if (e->corner[k_next(h)] == other) return true;
    return false;
}

bool sphere_embedding_can_collapse(const sphere_embedding *e, loxo_index h, bool is_patient)
{
    if (e->n_there <= 4) return false;
    /* the neighbours of both that the two faces of h have are the next and the last around its start; none of the others may be one */
    const loxo_index v = e->corner[h], u = e->corner[k_next(h)];
    const int64_t n = e->degree[v];
    loxo_index k = embedding_turn(e, h);
    for (int64_t i = 2; i < n - 1; ++i) {
        k = embedding_turn(e, k);
        if (are_neighbours(e, e->corner[k_next(k)], u, is_patient)) return false;
    }
    return true;
}

void sphere_embedding_collapse(sphere_embedding *e, loxo_index h)
{
    /* the faces (v, u, a) and (u, v, b) go; a-v becomes a-u, b-v becomes b-u */
    const loxo_index g = e->twin[h], hn = k_next(h), hp = k_previous(h), gn = k_next(g), gp = k_previous(g);
    const loxo_index v = e->corner[h], u = e->corner[g], a = e->corner[hp], b = e->corner[gp];
    const loxo_index tn = e->twin[hn], tp = e->twin[hp], sn = e->twin[gn], sp = e->twin[gp];
    for (loxo_index k = tp; k != gn; k = embedding_turn(e, k))
        e->corner[k] = u;
    e->twin[tn] = tp;
    e->twin[tp] = tn;
    e->twin[sn] = sp;
    e->twin[sp] = sn;
    e->first[u] = tp;
    e->first[a] = tn;
    e->first[b] = sn;
    e->degree[u] = (loxo_index)(e->degree[u] + e->degree[v] - 4);
    e->degree[a] = (loxo_index)(e->degree[a] - 1);
    e->degree[b] = (loxo_index)(e->degree[b] - 1);
    e->degree[v] = 0;
    e->removed[e->n_removed] = h;
    e->removed_round[e->n_removed++] = e->round;
    e->n_there -= 1;
}

loxo_index sphere_embedding_restore(sphere_embedding *e)
{
    const loxo_index h = e->removed[--e->n_removed];
    const loxo_index g = e->twin[h], hn = k_next(h), hp = k_previous(h), gn = k_next(g), gp = k_previous(g);
    const loxo_index v = e->corner[h], u = e->corner[g], a = e->corner[hp], b = e->corner[gp];
    int64_t n = 2;
    e->twin[e->twin[hn]] = hn;
    e->twin[e->twin[hp]] = hp;
    e->twin[e->twin[gn]] = gn;
    e->twin[e->twin[gp]] = gp;
    for (loxo_index k = e->twin[hp]; k != gn; k = embedding_turn(e, k), ++n)
        e->corner[k] = v;
    e->first[v] = h;
    e->first[u] = g;
    e->degree[v] = (loxo_index)n;
    e->degree[u] = (loxo_index)(e->degree[u] - (n - 4));
    e->degree[a] = (loxo_index)(e->degree[a] + 1);
    e->degree[b] = (loxo_index)(e->degree[b] + 1);
    e->n_there += 1;
    return v;
}
