/* SPDX-License-Identifier: MIT
 * Vertices that Poisson equations hold at given values: where a component has several sources, all of these, at 0. Matrices
 * of multigrid pin them. Factors pin one vertex of each component, its ground, and ties do the rest; where ties would cost
 * as much as another factor, that is made, with the held vertices pinned. */
#include "base/allocate.h"
#include "kernel/unfold_kernel.h"
#include "par/range.h"
#include "solver/geodesic/poisson/poisson_internal.h"

#include <string.h>

/* Held vertices, of all components, up to which ties are cheaper than a factor. */
#define MOST_TIED 150

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
        const int64_t s = poisson_set_of(p, vertex_of(p, &seeds[i]));
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
        if (p->set_seed[poisson_set_of(p, vertex_of(p, &seeds[i]))] != POISSON_HELD) continue;
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
}

static bool is_same(const poisson_held *a, const poisson_held *b)
{
    return a->n == b->n && (a->n == 0 || memcmp(a->vertex, b->vertex, (size_t)a->n * sizeof *a->vertex) == 0);
}

/* What the matrix or factor is to pin: the vertices held, unless they are tied; of factors, the grounds of the other
 * components too. */
static loxo_status list_pinned(poisson *p, bool is_tied, poisson_held *pinned)
{
    const bool has_grounds = p->settings.factor == LOXO_FACTOR_CHOLESKY;
    const int64_t n_held = is_tied ? 0 : p->held.n;
    int64_t k = 0;
    *pinned = (poisson_held){0};
    pinned->vertex = loxo_allocate(p->ctx, n_held + (has_grounds ? p->n_sets : 0), sizeof *pinned->vertex);
    if (pinned->vertex == NULL) return LOXO_ERR_MEMORY;
    for (int64_t s = 0; s < p->n_sets && has_grounds; ++s) {
        if (!is_tied && p->set_seed[s] == POISSON_HELD) continue;
        while (k < n_held && p->held.vertex[k] < p->ground[s])
            pinned->vertex[pinned->n++] = p->held.vertex[k++];
        pinned->vertex[pinned->n++] = p->ground[s];
    }
    while (k < n_held)
        pinned->vertex[pinned->n++] = p->held.vertex[k++];
    return LOXO_OK;
}

/* A factor that pins just these vertices serves as it is, with ties or without. */
static loxo_status make_ready(poisson *p, bool is_tied)
{
    poisson_held pinned;
    const loxo_status status = list_pinned(p, is_tied, &pinned);
    if (status < 0) return status;
    const bool is_ready = p->is_ready && is_same(&pinned, &p->pinned);
    poisson_release_held(p, &p->pinned);
    p->pinned = pinned;
    return is_ready ? LOXO_OK : poisson_renew(p);
}

/* Whether held vertices are worth ties: not where the factor as it is pins them already. */
static loxo_status choose_ties(poisson *p, bool *is_tied)
{
    poisson_held pinned;
    *is_tied = p->settings.factor == LOXO_FACTOR_CHOLESKY && p->held.n > 0 && p->held.n <= MOST_TIED;
    if (!*is_tied || !p->is_ready) return LOXO_OK;
    const loxo_status status = list_pinned(p, false, &pinned);
    if (status < 0) return status;
    *is_tied = !is_same(&pinned, &p->pinned);
    poisson_release_held(p, &pinned);
    return LOXO_OK;
}

loxo_status poisson_hold(poisson *p, const geodesic_seed *seeds, int64_t n_seeds)
{
    bool is_tied = false;
    find_sets(p, seeds, n_seeds);
    poisson_release_ties(p);
    poisson_release_held(p, &p->held);
    p->held.vertex = loxo_allocate(p->ctx, 3 * n_seeds, sizeof *p->held.vertex);
    p->held.value = loxo_allocate(p->ctx, 3 * n_seeds, sizeof *p->held.value);
    if (p->held.vertex == NULL || p->held.value == NULL) return LOXO_ERR_MEMORY;
    list_held(p, seeds, n_seeds, &p->held);
    loxo_status status = sort_held(p, &p->held);
    if (status >= 0) status = choose_ties(p, &is_tied);
    if (status >= 0) status = make_ready(p, is_tied);
    if (status < 0 || !is_tied) return status;
    if ((status = poisson_tie(p, &is_tied)) < 0 || is_tied) return status;
    return make_ready(p, false);
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
