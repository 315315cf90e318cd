/* SPDX-License-Identifier: MIT
 * Vertices that Poisson equations hold at given values: where a component has several sources, all of these, at 0; for
 * factors, one vertex of each other component. */
#include "base/allocate.h"
#include "kernel/unfold_kernel.h"
#include "par/range.h"
#include "solver/geodesic/poisson/poisson_internal.h"

#include <string.h>

static int64_t set_of(const poisson *p, int64_t v) { return p->label != NULL ? p->label[v] : 0; }

static int64_t vertex_of(const poisson *p, const geodesic_seed *seed)
{
    return seed->vertex >= 0 ? seed->vertex : p->m.halfedge_vertex[(int64_t)3 * seed->face];
}

/* Components with two seeds and more. */
static void find_sets(poisson *p, const geodesic_seed *seeds, int64_t n_seeds)
{
    for (int64_t s = 0; s < p->n_sets; ++s)
        p->set_seed[s] = POISSON_NO_SEED;
    for (int64_t i = 0; i < n_seeds; ++i) {
        const int64_t s = set_of(p, vertex_of(p, &seeds[i]));
        p->set_seed[s] = p->set_seed[s] == POISSON_NO_SEED ? POISSON_ONE_SEED : POISSON_HELD;
    }
}

/* In the order of vertices, each once, with the least of its values. */
static loxo_status sort_held(poisson *p, poisson_held *held)
{
    uint64_t *key = loxo_allocate(p->ctx, held->n, sizeof *key);
    uint32_t *order = loxo_allocate(p->ctx, held->n, sizeof *order);
    double *value = loxo_allocate(p->ctx, held->n, sizeof *value);
    loxo_status status = key == NULL || order == NULL || value == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
    int64_t n = 0;
    for (int64_t k = 0; k < held->n && status >= 0; ++k) {
        key[k] = (uint64_t)held->vertex[k];
        order[k] = (uint32_t)k;
        value[k] = held->value[k];
    }
    if (status >= 0) status = loxo_sort_u64(p->ctx, held->n, key, order, 32);
    for (int64_t k = 0; k < held->n && status >= 0; ++k) {
        const double mine = value[order[k]];
        if (n > 0 && (uint64_t)held->vertex[n - 1] == key[k]) {
            held->value[n - 1] = mine < held->value[n - 1] ? mine : held->value[n - 1];
            continue;
        }
        held->vertex[n] = (loxo_index)key[k];
        held->value[n++] = mine;
    }
    if (status >= 0) held->n = n;
    loxo_release(p->ctx, key);
    loxo_release(p->ctx, order);
    loxo_release(p->ctx, value);
    return status;
}

void poisson_release_held(poisson *p, poisson_held *held)
{
    loxo_release(p->ctx, held->vertex);
    loxo_release(p->ctx, held->value);
    *held = (poisson_held){0};
}

/* A point inside a face holds its corners at their straight distances. */
static void list_held(const poisson *p, const geodesic_seed *seeds, int64_t n_seeds, poisson_held *held)
{
    for (int64_t i = 0; i < n_seeds; ++i) {
        double length[3];
        if (p->set_seed[set_of(p, vertex_of(p, &seeds[i]))] != POISSON_HELD) continue;
        if (seeds[i].vertex >= 0) {
            held->vertex[held->n] = seeds[i].vertex;
            held->value[held->n++] = 0.0;
            continue;
        }
        k_face_lengths(&p->m, seeds[i].face, length);
        const k_layout face = k_layout_of(length);
        for (int k = 0; k < 3; ++k) {
            held->vertex[held->n] = p->m.halfedge_vertex[(int64_t)3 * seeds[i].face + k];
            held->value[held->n++] = k_distance_to_corner(face, seeds[i].weight, k);
        }
    }
    if (p->settings.factor != LOXO_FACTOR_CHOLESKY) return;
    int64_t n_seen = 0;
    for (int64_t v = 0; v < p->m.n_vertices && n_seen < p->n_sets; ++v) {
        if (set_of(p, v) != n_seen) continue; /* sets count in the order of their first vertices */
        if (p->set_seed[n_seen++] == POISSON_HELD) continue;
        held->vertex[held->n] = (loxo_index)v;
        held->value[held->n++] = 0.0;
    }
}

static bool is_same(const poisson_held *a, const poisson_held *b)
{
    return a->n == b->n && (a->n == 0 || memcmp(a->vertex, b->vertex, (size_t)a->n * sizeof *a->vertex) == 0);
}

loxo_status poisson_hold(poisson *p, const geodesic_seed *seeds, int64_t n_seeds)
{
    poisson_held held = {0};
    find_sets(p, seeds, n_seeds);
    const int64_t most = 3 * n_seeds + p->n_sets;
    held.vertex = loxo_allocate(p->ctx, most, sizeof *held.vertex);
    held.value = loxo_allocate(p->ctx, most, sizeof *held.value);
    loxo_status status = held.vertex == NULL || held.value == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
    if (status >= 0) {
        list_held(p, seeds, n_seeds, &held);
        status = sort_held(p, &held);
    }
    if (status < 0) {
        poisson_release_held(p, &held);
        return status;
    }
    const bool is_ready = p->is_ready && is_same(&held, &p->held);
    poisson_release_held(p, &p->held);
    p->held = held;
    return is_ready ? LOXO_OK : poisson_renew(p);
}

void poisson_take_held(poisson *p, double *distance)
{
    const loxo_mesh_view *m = &p->m;
    for (int64_t k = 0; k < p->held.n; ++k) {
        const loxo_index v = p->held.vertex[k], first = m->vertex_halfedge[v];
        distance[v] = 0.0;
        for (loxo_index h = first; h >= 0 && p->held.value[k] != 0.0;) {
            const loxo_index before = k_previous(h);
            p->field[h] += p->held.value[k];
            p->field[before] -= p->held.value[k];
            h = m->halfedge_twin[before];
            if (h == first) break;
        }
    }
}

void poisson_put_held(const poisson *p, double *distance)
{
    for (int64_t k = 0; k < p->held.n; ++k)
        distance[p->held.vertex[k]] = p->held.value[k];
}
