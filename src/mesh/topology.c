/* SPDX-License-Identifier: MIT
 * Tree-cotree: a spanning tree of the vertices, and one of the faces that crosses no edge of the first. The edges that
 * are in neither generate the cycles. A boundary loop counts as a face (its cap); the loops themselves, but one a
 * component, are the rest of the basis. */
#include "mesh/topology.h"

#include "base/allocate.h"
#include "base/context.h"
#include "mesh/halfedge.h"

#define MIN_ELEMENTS 4096 /* small meshes keep all their cycles */

enum { CROSSED = 1, LOOP_SEEN = 2, LOOP_TAKEN = 4 };

typedef struct trees {
    loxo_context *ctx;
    const loxo_mesh_view *m;
    loxo_index *parent; /* [n_vertices] half-edge of the edge towards the root; -1 at roots and unreferenced vertices */
    loxo_index *component; /* [n_vertices] -1 unreferenced */
    loxo_index *queue;     /* [max(n_vertices, n_faces + n_boundary)] */
    uint8_t *flag;         /* [3 n_faces] of half-edges */
    bool *is_face_seen;    /* [n_faces] */
    int64_t n_components;
    int64_t n_steps; /* since the monitor was asked */
    bool is_stopped;
} trees;

#define STEPS_BETWEEN_LOOKS 65536

static bool stop_wanted(trees *t)
{
    if (++t->n_steps < STEPS_BETWEEN_LOOKS) return false;
    t->n_steps = 0;
    t->is_stopped = t->is_stopped || loxo_stop_wanted(t->ctx, "cycles", -1.0);
    return t->is_stopped;
}

static loxo_index head_of(const loxo_mesh_view *m, loxo_index h) { return m->halfedge_vertex[loxo_halfedge_next(h)]; }

/* The other end of the edge of half-edge h. */
static loxo_index across(const loxo_mesh_view *m, loxo_index h, loxo_index v)
{
    return m->halfedge_vertex[h] == v ? head_of(m, h) : m->halfedge_vertex[h];
}

static void visit(trees *t, loxo_index neighbour, loxo_index h, loxo_index component, int64_t *tail)
{
    if (t->component[neighbour] >= 0) return;
    t->component[neighbour] = component;
    t->parent[neighbour] = h;
    t->queue[(*tail)++] = neighbour;
}

static void grow_vertex_trees(trees *t)
{
    const loxo_mesh_view *m = t->m;
    for (int64_t v = 0; v < m->n_vertices; ++v)
        t->component[v] = t->parent[v] = -1;
    for (int64_t root = 0; root < m->n_vertices; ++root) {
        if (t->component[root] >= 0 || m->vertex_halfedge[root] < 0) continue;
        const loxo_index component = (loxo_index)t->n_components++;
        int64_t tail = 0;
        visit(t, (loxo_index)root, -1, component, &tail);
        for (int64_t i = 0; i < tail; ++i) {
            if (stop_wanted(t)) return;
            const loxo_index first = m->vertex_halfedge[t->queue[i]];
            loxo_index h = first, back = -1;
            do {
                visit(t, head_of(m, h), h, component, &tail);
                back = loxo_halfedge_previous(h);
                h = m->halfedge_twin[back];
            } while (h >= 0 && h != first);
            if (h < 0) visit(t, m->halfedge_vertex[back], back, component, &tail);
        }
    }
}

static bool is_in_tree(const trees *t, loxo_index h)
{
    const loxo_index a = t->parent[t->m->halfedge_vertex[h]], b = t->parent[head_of(t->m, h)];
    const loxo_index twin = t->m->halfedge_twin[h];
    return a == h || b == h || (twin >= 0 && (a == twin || b == twin));
}

/* The half-edge after h along its boundary loop. */
static loxo_index next_on_loop(const loxo_mesh_view *m, loxo_index h) { return m->vertex_halfedge[head_of(m, h)]; }

static void cross_to_face(trees *t, loxo_index h, int64_t face, int64_t *tail)
{
    if (t->is_face_seen[face]) return;
    t->is_face_seen[face] = true;
    t->flag[h] |= CROSSED;
    if (t->m->halfedge_twin[h] >= 0) t->flag[t->m->halfedge_twin[h]] |= CROSSED;
    t->queue[(*tail)++] = (loxo_index)face;
}

static void expand_face(trees *t, int64_t face, int64_t *tail)
{
    for (int c = 0; c < 3; ++c) {
        const loxo_index h = (loxo_index)(3 * face + c), twin = t->m->halfedge_twin[h];
        if (is_in_tree(t, h)) continue;
        if (twin >= 0) {
            cross_to_face(t, h, twin / 3, tail);
        } else if ((t->flag[h] & LOOP_SEEN) == 0) {
            loxo_index on = h;
            do {
                t->flag[on] |= LOOP_SEEN;
                on = next_on_loop(t->m, on);
            } while (on != h);
            t->flag[h] |= CROSSED;
            t->queue[(*tail)++] = (loxo_index)(-1 - h);
        }
    }
}

static void expand_cap(trees *t, loxo_index h, int64_t *tail)
{
    loxo_index on = h;
    do {
        if (!is_in_tree(t, on)) cross_to_face(t, on, on / 3, tail);
        on = next_on_loop(t->m, on);
    } while (on != h);
}

static void grow_face_trees(trees *t)
{
    for (int64_t root = 0; root < t->m->n_faces; ++root) {
        if (t->is_face_seen[root]) continue;
        int64_t tail = 0;
        t->is_face_seen[root] = true;
        t->queue[tail++] = (loxo_index)root;
        for (int64_t i = 0; i < tail; ++i) {
            if (stop_wanted(t)) return;
            if (t->queue[i] >= 0)
                expand_face(t, t->queue[i], &tail);
            else
                expand_cap(t, (loxo_index)(-1 - t->queue[i]), &tail);
        }
    }
}

static int64_t depth_of(const trees *t, loxo_index v)
{
    int64_t depth = 0;
    for (; t->parent[v] >= 0; v = across(t->m, t->parent[v], v))
        ++depth;
    return depth;
}

/* Room for n_more elements in a chain to come. */
static loxo_status make_room(loxo_context *ctx, loxo_chains *chains, int64_t n_more, int64_t *n_room,
                             int64_t *n_chain_room)
{
    if (chains->n_chains + 2 > *n_chain_room) {
        const int64_t n = 2 * *n_chain_room + 16;
        int64_t *begin = loxo_reallocate(ctx, chains->chain_begin, n, sizeof *begin);
        if (begin == NULL) return LOXO_ERR_MEMORY;
        if (chains->chain_begin == NULL) begin[0] = 0;
        chains->chain_begin = begin;
        *n_chain_room = n;
    }
    const int64_t used = chains->chain_begin[chains->n_chains];
    if (used + n_more <= *n_room) return LOXO_OK;
    const int64_t n = 2 * (used + n_more);
    loxo_index *halfedge = loxo_reallocate(ctx, chains->halfedge, n, sizeof *halfedge);
    if (halfedge == NULL) return LOXO_ERR_MEMORY;
    chains->halfedge = halfedge;
    int8_t *sign = loxo_reallocate(ctx, chains->sign, n, sizeof *sign);
    if (sign == NULL) return LOXO_ERR_MEMORY;
    chains->sign = sign;
    *n_room = n;
    return LOXO_OK;
}

static void put(const trees *t, loxo_chains *chains, int64_t at, loxo_index h, loxo_index from)
{
    chains->halfedge[at] = h;
    chains->sign[at] = t->m->halfedge_vertex[h] == from ? 1 : -1;
}

/* Along h, then up the tree from its head to where the ways of both ends meet, and down to its tail. */
static void append_generator(const trees *t, loxo_chains *chains, loxo_index h, int64_t depth_tail, int64_t depth_head)
{
    const loxo_index tail_vertex = t->m->halfedge_vertex[h];
    loxo_index down = tail_vertex, up = head_of(t->m, h);
    int64_t n = chains->chain_begin[chains->n_chains], n_down = 0;
    put(t, chains, n++, h, tail_vertex);
    while (up != down) {
        if (depth_head >= depth_tail) {
            put(t, chains, n++, t->parent[up], up);
            up = across(t->m, t->parent[up], up);
            --depth_head;
        } else {
            ++n_down;
            down = across(t->m, t->parent[down], down);
            --depth_tail;
        }
    }
    down = tail_vertex;
    for (int64_t i = n + n_down - 1; i >= n; --i) { /* from the tail upward: the last elements first */
        const loxo_index parent = across(t->m, t->parent[down], down);
        put(t, chains, i, t->parent[down], parent);
        down = parent;
    }
    chains->chain_begin[++chains->n_chains] = n + n_down;
}

static bool is_full(const trees *t, const loxo_chains *chains, int64_t n_more)
{
    const int64_t used = chains->chain_begin != NULL ? chains->chain_begin[chains->n_chains] : 0;
    return used + n_more > t->m->n_vertices / 4 + MIN_ELEMENTS;
}

static loxo_status collect_generators(trees *t, loxo_chains *chains, int64_t *n_room, int64_t *n_chain_room)
{
    for (int64_t i = 0; i < 3 * t->m->n_faces; ++i) {
        const loxo_index h = (loxo_index)i, twin = t->m->halfedge_twin[h];
        if (stop_wanted(t)) return LOXO_OK;
        if ((twin >= 0 && twin < h) || (t->flag[h] & CROSSED) != 0 || is_in_tree(t, h)) continue;
        if (is_full(t, chains, 1)) {
            ++chains->n_left_out;
            continue;
        }
        const int64_t a = depth_of(t, t->m->halfedge_vertex[h]), b = depth_of(t, head_of(t->m, h));
        if (is_full(t, chains, a + b + 1)) {
            ++chains->n_left_out;
            continue;
        }
        const loxo_status status = make_room(t->ctx, chains, a + b + 1, n_room, n_chain_room);
        if (status < 0) return status;
        append_generator(t, chains, h, a, b);
    }
    return LOXO_OK;
}

/* Boundary loops, but the first of every component. queue says which components had theirs. */
static loxo_status collect_loops(trees *t, loxo_chains *chains, int64_t *n_room, int64_t *n_chain_room)
{
    for (int64_t c = 0; c < t->n_components; ++c)
        t->queue[c] = 0;
    for (int64_t i = 0; i < 3 * t->m->n_faces; ++i) {
        loxo_index on = (loxo_index)i;
        if (stop_wanted(t)) return LOXO_OK;
        if (t->m->halfedge_twin[i] >= 0 || (t->flag[i] & LOOP_TAKEN) != 0) continue;
        int64_t n = 0;
        do {
            t->flag[on] |= LOOP_TAKEN;
            on = next_on_loop(t->m, on);
            ++n;
        } while (on != i);
        loxo_index *had = &t->queue[t->component[t->m->halfedge_vertex[i]]];
        if ((*had)++ == 0) continue;
        if (is_full(t, chains, n)) {
            ++chains->n_left_out;
            continue;
        }
        const loxo_status status = make_room(t->ctx, chains, n, n_room, n_chain_room);
        if (status < 0) return status;
        int64_t at = chains->chain_begin[chains->n_chains];
        do {
            put(t, chains, at++, on, t->m->halfedge_vertex[on]);
            on = next_on_loop(t->m, on);
        } while (on != i);
        chains->chain_begin[++chains->n_chains] = at;
    }
    return LOXO_OK;
}

loxo_status loxo_cycle_basis(loxo_context *ctx, const loxo_mesh_view *mesh, loxo_chains *out)
{
    trees t = {.ctx = ctx, .m = mesh};
    int64_t n_room = 0, n_chain_room = 0, n_boundary = 0;
    loxo_status status = LOXO_ERR_MEMORY;
    *out = (loxo_chains){0};
    if (mesh->genus == 0 && mesh->n_boundary_loops <= 1) return LOXO_OK;
    for (int64_t h = 0; h < 3 * mesh->n_faces; ++h)
        n_boundary += mesh->halfedge_twin[h] < 0 ? 1 : 0;
    const int64_t n_nodes = mesh->n_faces + n_boundary;
    t.parent = loxo_allocate(ctx, mesh->n_vertices, sizeof *t.parent);
    t.component = loxo_allocate(ctx, mesh->n_vertices, sizeof *t.component);
    t.queue = loxo_allocate(ctx, n_nodes > mesh->n_vertices ? n_nodes : mesh->n_vertices, sizeof *t.queue);
    t.flag = loxo_allocate_zero(ctx, 3 * mesh->n_faces, sizeof *t.flag);
    t.is_face_seen = loxo_allocate_zero(ctx, mesh->n_faces, sizeof *t.is_face_seen);
    if (t.parent == NULL || t.component == NULL || t.queue == NULL || t.flag == NULL || t.is_face_seen == NULL)
        goto done;
    status = LOXO_OK;
    grow_vertex_trees(&t);
    if (!t.is_stopped) grow_face_trees(&t);
    if (!t.is_stopped) status = collect_generators(&t, out, &n_room, &n_chain_room);
    if (!t.is_stopped && status >= 0) status = collect_loops(&t, out, &n_room, &n_chain_room);
    if (t.is_stopped && status >= 0)
        status = loxo_fail(ctx, LOXO_ERR_STOPPED, "stopped by the monitor while cycles were looked for");
done:
    loxo_release(ctx, t.is_face_seen);
    loxo_release(ctx, t.flag);
    loxo_release(ctx, t.queue);
    loxo_release(ctx, t.component);
    loxo_release(ctx, t.parent);
    if (status < 0) loxo_chains_destroy(ctx, out);
    return status;
}

size_t loxo_cycle_basis_bytes(int64_t n_vertices, int64_t n_faces, int64_t n_boundary_edges)
{
    const int64_t n_nodes = n_faces + n_boundary_edges, n_queue = n_nodes > n_vertices ? n_nodes : n_vertices;
    const int64_t n_elements = n_vertices / 4 + MIN_ELEMENTS; /* of all chains; their arrays grow by doubling */
    return (size_t)(2 * n_vertices + n_queue) * sizeof(loxo_index) + (size_t)(4 * n_faces) +
           (size_t)(2 * n_elements) * (sizeof(loxo_index) + sizeof(int8_t));
}

void loxo_chains_destroy(loxo_context *ctx, loxo_chains *chains)
{
    loxo_release(ctx, chains->sign);
    loxo_release(ctx, chains->halfedge);
    loxo_release(ctx, chains->chain_begin);
    *chains = (loxo_chains){0};
}
