/* SPDX-License-Identifier: MIT
 * Chains of global constraints: the mesh's cycle basis, and paths that join the sources (section 5.2). */
#include "solver/geodesic/parallel_heat/chains.h"

#include "base/allocate.h"
#include "par/range.h"

#include <string.h>

/* Paths are found on the breadth-first forest: an edge whose ends belong to different trees joins two sources by the
 * way up one tree and down the other. Going through the edges from the lowest level outward and joining each pair of
 * trees once gives n_sources - 1 short paths on a connected surface. */
typedef struct forest {
    const parallel_heat *g;
    loxo_index *root;   /* [n_reached] place of the source above */
    loxo_index *leader; /* [n_sources] union-find */
} forest;

static loxo_index find_leader(forest *f, loxo_index i)
{
    while (f->leader[i] != i) {
        f->leader[i] = f->leader[f->leader[i]];
        i = f->leader[i];
    }
    return i;
}

/* Elements from `place` up to its source. */
static int64_t way_length(const parallel_heat *g, int64_t place)
{
    int64_t n = 0;
    for (; g->parent[place] >= 0; place = g->parent[place])
        ++n;
    return n;
}

static loxo_status add_elements(loxo_context *ctx, loxo_chains *chains, int64_t n_more, int64_t *room)
{
    const int64_t n = chains->chain_begin[chains->n_chains];
    if (n + n_more <= *room) return LOXO_OK;
    const int64_t size = 2 * (n + n_more) + 64;
    loxo_index *halfedge = loxo_reallocate(ctx, chains->halfedge, size, sizeof *halfedge);
    if (halfedge == NULL) return LOXO_ERR_MEMORY;
    chains->halfedge = halfedge;
    int8_t *sign = loxo_reallocate(ctx, chains->sign, size, sizeof *sign);
    if (sign == NULL) return LOXO_ERR_MEMORY;
    chains->sign = sign;
    *room = size;
    return LOXO_OK;
}

/* Element i of the chains is the tree's edge to a place, walked to it (direction 1) or from it (-1). */
static void set_element(const parallel_heat *g, loxo_chains *chains, int64_t i, int64_t place, int direction)
{
    const loxo_index v = g->order[place], parent = g->order[g->parent[place]];
    loxo_index h = g->m.vertex_halfedge[v];
    int sign = -direction; /* of the half-edges that leave v */
    while (k_head(&g->m, h) != parent) {
        const loxo_index back = k_previous(h);
        if (g->m.halfedge_vertex[back] == parent) {
            h = back;
            sign = direction;
            break;
        }
        h = g->m.halfedge_twin[back];
    }
    chains->halfedge[i] = h;
    chains->sign[i] = (int8_t)sign;
}

/* Path from the source above p to the one above q over the half-edge `across` from p's vertex to q's. */
static void append_path(const parallel_heat *g, loxo_chains *chains, int64_t p, loxo_index across, int64_t q)
{
    const int64_t up = way_length(g, p);
    int64_t i = chains->chain_begin[chains->n_chains] + up;
    chains->halfedge[i] = across;
    chains->sign[i] = 1;
    for (int64_t k = i - 1, place = p; g->parent[place] >= 0; place = g->parent[place], --k)
        set_element(g, chains, k, place, 1);
    for (int64_t place = q; g->parent[place] >= 0; place = g->parent[place])
        set_element(g, chains, ++i, place, -1);
    ++chains->n_chains;
    chains->chain_begin[chains->n_chains] = i + 1;
}

static loxo_status join_sources(parallel_heat *g, int64_t n_sources, forest *f, loxo_chains *chains, int64_t *room,
                                int64_t most_elements)
{
    const loxo_mesh_view *m = &g->m;
    int64_t n_joined = 0;
    for (int64_t p = 0; p < g->n_reached; ++p) {
        if (g->parent[p] < 0)
            f->root[p] = (loxo_index)p;
        else
            f->root[p] = f->root[g->parent[p]];
    }
    for (int64_t p = 0; p < g->n_reached && n_joined < n_sources - 1; ++p) {
        const loxo_index first = m->vertex_halfedge[g->order[p]];
        loxo_index h = first;
        do {
            const int64_t q = g->rank[k_head(m, h)]; /* -1 beyond the front of a diffusion that was stopped */
            const loxo_index a = find_leader(f, f->root[p]), b = q >= 0 ? find_leader(f, f->root[q]) : a;
            if (a != b) {
                const int64_t n = way_length(g, p) + way_length(g, q) + 1;
                f->leader[a < b ? b : a] = a < b ? a : b;
                ++n_joined;
                if (chains->chain_begin[chains->n_chains] + n > most_elements) {
                    ++chains->n_left_out;
                } else {
                    const loxo_status status = add_elements(g->ctx, chains, n, room);
                    if (status < 0) return status;
                    append_path(g, chains, p, h, q);
                }
            }
            h = m->halfedge_twin[k_previous(h)];
        } while (h >= 0 && h != first);
    }
    return LOXO_OK;
}

loxo_status heat_find_chains(parallel_heat *g, int64_t n_sources, loxo_chains *chains)
{
    const loxo_chains *cycles = &g->cycles;
    const int64_t n_elements = cycles->n_chains > 0 ? cycles->chain_begin[cycles->n_chains] : 0;
    /* Many sources on a coarse mesh would make chains as long as the mesh; those are left out. */
    const int64_t most_elements = n_elements + g->m.n_vertices / 4 + 2 * g->n_levels + 64;
    int64_t room = n_elements + 64;
    forest f = {.g = g};
    loxo_status status = LOXO_ERR_MEMORY;
    *chains = (loxo_chains){0};
    chains->chain_begin = loxo_allocate_zero(g->ctx, cycles->n_chains + n_sources + 1, sizeof *chains->chain_begin);
    chains->halfedge = loxo_allocate(g->ctx, room, sizeof *chains->halfedge);
    chains->sign = loxo_allocate(g->ctx, room, sizeof *chains->sign);
    if (chains->chain_begin == NULL || chains->halfedge == NULL || chains->sign == NULL) goto fail;
    chains->n_left_out = cycles->n_left_out;
    if (n_elements > 0) {
        memcpy(chains->chain_begin, cycles->chain_begin, (size_t)(cycles->n_chains + 1) * sizeof *cycles->chain_begin);
        memcpy(chains->halfedge, cycles->halfedge, (size_t)n_elements * sizeof *cycles->halfedge);
        memcpy(chains->sign, cycles->sign, (size_t)n_elements * sizeof *cycles->sign);
        chains->n_chains = cycles->n_chains;
    }
    status = LOXO_OK;
    if (n_sources > 1) {
        status = LOXO_ERR_MEMORY;
        f.root = loxo_allocate(g->ctx, g->n_reached, sizeof *f.root);
        f.leader = loxo_allocate(g->ctx, n_sources, sizeof *f.leader);
        if (f.root == NULL || f.leader == NULL) goto fail;
        for (int64_t i = 0; i < n_sources; ++i)
            f.leader[i] = (loxo_index)i;
        status = join_sources(g, n_sources, &f, chains, &room, most_elements);
    }
fail:
    loxo_release(g->ctx, f.leader);
    loxo_release(g->ctx, f.root);
    if (status < 0) loxo_chains_destroy(g->ctx, chains);
    return status;
}

static loxo_index lower_halfedge(const loxo_mesh_view *m, loxo_index h)
{
    const loxo_index t = m->halfedge_twin[h];
    return t >= 0 && t < h ? t : h;
}

double chain_sign(const loxo_mesh_view *m, const loxo_chains *chains, int64_t i)
{
    const loxo_index h = chains->halfedge[i];
    return lower_halfedge(m, h) == h ? chains->sign[i] : -chains->sign[i];
}

loxo_status special_edges_create(loxo_context *ctx, const loxo_mesh_view *m, const loxo_chains *chains,
                                 special_edges *out)
{
    const int64_t n = chains->n_chains > 0 ? chains->chain_begin[chains->n_chains] : 0;
    uint64_t *key = loxo_allocate(ctx, n, sizeof *key);
    uint32_t *element = loxo_allocate(ctx, n, sizeof *element);
    loxo_status status = LOXO_ERR_MEMORY;
    *out = (special_edges){0};
    out->edge = loxo_allocate(ctx, n, sizeof *out->edge);
    out->of_element = loxo_allocate(ctx, n, sizeof *out->of_element);
    out->a = loxo_allocate_zero(ctx, chains->n_chains, sizeof *out->a);
    if (key == NULL || element == NULL || out->edge == NULL || out->of_element == NULL || out->a == NULL) goto done;
    for (int64_t i = 0; i < n; ++i) {
        key[i] = (uint64_t)lower_halfedge(m, chains->halfedge[i]);
        element[i] = (uint32_t)i;
    }
    if ((status = loxo_sort_u64(ctx, n, key, element, 33)) < 0) goto done;
    for (int64_t i = 0; i < n; ++i) {
        if (i == 0 || key[i] != key[i - 1]) {
            out->edge[out->n] = (special_edge){.halfedge = (loxo_index)key[i]};
            ++out->n;
        }
        ++out->edge[out->n - 1].n_chains;
        out->of_element[element[i]] = out->n - 1;
    }
done:
    loxo_release(ctx, element);
    loxo_release(ctx, key);
    if (status < 0) special_edges_destroy(ctx, out);
    return status;
}

void special_edges_destroy(loxo_context *ctx, special_edges *s)
{
    loxo_release(ctx, s->a);
    loxo_release(ctx, s->of_element);
    loxo_release(ctx, s->edge);
    *s = (special_edges){0};
}
