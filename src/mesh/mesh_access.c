/* SPDX-License-Identifier: MIT
 * Settings, estimate and the ways into and out of a finished mesh. */
#include "base/allocate.h"
#include "base/options.h"
#include "mesh/components.h"
#include "mesh/mesh_internal.h"
#include "par/range.h"

#include <math.h>
#include <string.h>

static const char *const order_names[] = {"auto", "given", "morton", "hilbert", "bfs", "metis", "metis-nd", NULL};

const loxo_option loxo_mesh_options[] = {
    {.name = "order",
     .type = LOXO_OPTION_CHOICE,
     .offset = offsetof(loxo_mesh_settings, order),
     .choices = order_names,
     .help = "order of the vertices in memory"},
    {.name = "part-bytes",
     .type = LOXO_OPTION_SIZE,
     .offset = offsetof(loxo_mesh_settings, part_bytes),
     .max = 0x1p60,
     .help = "size of a part's data in bytes; 0: what fits one core's second-level cache"},
    {.name = "repair",
     .type = LOXO_OPTION_BOOL,
     .offset = offsetof(loxo_mesh_settings, repair),
     .help = "weld duplicate vertices, drop duplicate faces, split non-manifold edges and vertices"},
    {.name = NULL},
};

loxo_mesh_settings loxo_mesh_settings_default(void)
{
    return (loxo_mesh_settings){
        .order = LOXO_ORDER_AUTO,
        .part_bytes = 0,
        .repair = false,
    };
}

void loxo_mesh_destroy(loxo_mesh *mesh)
{
    if (mesh == NULL) return;
    loxo_context *ctx = mesh->ctx;
    loxo_release(ctx, mesh->position);
    loxo_release(ctx, mesh->position_float);
    loxo_release(ctx, mesh->halfedge_vertex);
    loxo_release(ctx, mesh->halfedge_twin);
    loxo_release(ctx, mesh->vertex_halfedge);
    loxo_release(ctx, mesh->vertex_origin);
    loxo_release(ctx, mesh->part_vertex);
    loxo_release(ctx, mesh->part_face);
    if (mesh->surface == NULL) loxo_release(ctx, mesh->caller_to_mesh);
    loxo_release(ctx, mesh->halfedge_length);
    loxo_release(ctx, mesh->crossing);
    loxo_release(ctx, mesh->surface_next);
    loxo_release(ctx, mesh);
}

int64_t loxo_mesh_n_vertices(const loxo_mesh *mesh) { return mesh->n_caller_vertices; }

int64_t loxo_mesh_n_faces(const loxo_mesh *mesh) { return mesh->view.n_faces; }

loxo_mesh_view loxo_mesh_get_view(const loxo_mesh *mesh) { return mesh->view; }

/* ---- estimate ------------------------------------------------------------------------------------------------ */

/* In double: no overflow, exact up to 2^53 bytes, and 2^62 are far beyond any machine. */
static void add_bytes(double *sum, int64_t count, size_t size) { *sum += (double)count * (double)size; }

loxo_status loxo_mesh_estimate(int64_t n_vertices, int64_t n_faces, bool is_float, const loxo_mesh_settings *settings,
                               size_t *mesh_bytes, size_t *peak_bytes)
{
    const loxo_mesh_settings defaults = loxo_mesh_settings_default();
    const loxo_mesh_settings *s = settings == NULL ? &defaults : settings;
    const size_t id = sizeof(loxo_index), position = 3 * (is_float ? sizeof(float) : sizeof(double));
    if (n_vertices < 0 || n_faces < 0) return LOXO_ERR_ARGUMENT;

    double mesh = 0.0, moved = 0.0, peak = 64 * 1024;                    /* parts, small blocks */
    add_bytes(&mesh, n_vertices, position + id);                         /* positions, vertex_halfedge */
    add_bytes(&mesh, n_faces, 6 * id);                                   /* halfedge_vertex, halfedge_twin */
    if (s->order != LOXO_ORDER_GIVEN) add_bytes(&moved, n_vertices, id); /* the permutation */
    if (s->repair) add_bytes(&moved, n_vertices, 2 * id);                /* what became of each vertex, both ways */
    mesh += moved;
    /* Most is held while half-edges are matched: buckets instead of vertex_halfedge, and what the order added. */
    peak += mesh;
    add_bytes(&peak, n_vertices, sizeof(int64_t));
    add_bytes(&peak, n_faces, 3 * id);
    if (s->order != LOXO_ORDER_GIVEN) add_bytes(&peak, n_faces, id); /* the caller's numbers of faces, for messages */
    if (s->order == LOXO_ORDER_METIS || s->order == LOXO_ORDER_METIS_ND) add_bytes(&peak, n_vertices, 130);
    if (s->repair) {
        add_bytes(&peak, n_vertices, position + id); /* old and new positions, another map */
        add_bytes(&peak, n_faces, 3 * id);           /* old and new faces */
    }
    if (peak > 0x1p62) return LOXO_ERR_LIMIT;
    if (mesh_bytes != NULL) *mesh_bytes = (size_t)mesh;
    if (peak_bytes != NULL) *peak_bytes = (size_t)peak;
    return LOXO_OK;
}

/* ---- numbers of the caller and of the mesh ------------------------------------------------------------------- */

loxo_status loxo_mesh_vertex_order(const loxo_mesh *mesh, loxo_index *original_to_mesh)
{
    const loxo_index *origin = mesh->view.vertex_origin;
    const int64_t n = mesh->n_caller_vertices;
    if (original_to_mesh == NULL) return loxo_fail(mesh->ctx, LOXO_ERR_ARGUMENT, "mesh: no place for its order");
#pragma omp parallel num_threads(loxo_threads_for(mesh->ctx, n, 3))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            if (mesh->caller_to_mesh != NULL)
                original_to_mesh[i] = mesh->caller_to_mesh[i];
            else if (origin != NULL)
                original_to_mesh[origin[i]] = (loxo_index)i;
            else
                original_to_mesh[i] = (loxo_index)i;
        }
    }
    return LOXO_OK;
}

loxo_status loxo_mesh_components(const loxo_mesh *mesh, loxo_index *component, int64_t *n_components)
{
    const loxo_mesh_view *m = &mesh->view;
    int64_t n_found = 0;
    loxo_status status = loxo_mesh_vertex_order(mesh, component);
    if (status < 0) return status;
    loxo_index *parent = loxo_allocate(mesh->ctx, m->n_vertices, sizeof *parent);
    if (parent == NULL) return LOXO_ERR_MEMORY;
    (void)loxo_join_faces(mesh->ctx, m->n_vertices, m->n_faces, m->halfedge_vertex, parent);
    for (int64_t v = 0; v < mesh->n_caller_vertices; ++v) {
        const loxo_index own = component[v];
        component[v] = -1;
        if (own < 0 || m->vertex_halfedge[own] < 0) continue;
        const loxo_index root = parent[own] < 0 ? own : parent[own];
        if (parent[root] >= 0) parent[root] = (loxo_index)(-1 - n_found++); /* from here on its number */
        component[v] = (loxo_index)(-1 - parent[root]);
    }
    loxo_release(mesh->ctx, parent);
    if (n_components != NULL) *n_components = n_found;
    return LOXO_OK;
}

/* With welds and splits: every caller's vertex takes the smallest over the copies of the vertex it became. */
static void scatter_repaired(const loxo_mesh *mesh, const double *own, double *caller)
{
    const loxo_index *origin = mesh->view.vertex_origin, *to_mesh = mesh->caller_to_mesh;
    const int64_t n = mesh->n_caller_vertices;
    for (int64_t v = 0; v < n; ++v)
        caller[v] = to_mesh[v] >= 0 ? own[to_mesh[v]] : (double)INFINITY;
    for (int64_t i = 0; i < mesh->view.n_vertices; ++i)
        if (own[i] < caller[origin[i]]) caller[origin[i]] = own[i];
    for (int64_t v = 0; v < n; ++v)
        if (to_mesh[v] >= 0) caller[v] = caller[origin[to_mesh[v]]];
}

void loxo_mesh_scatter_to_caller(const loxo_mesh *mesh, const double *own, double *caller)
{
    const loxo_index *origin = mesh->view.vertex_origin;
    if (mesh->caller_to_mesh != NULL) {
        scatter_repaired(mesh, own, caller);
        return;
    }
#pragma omp parallel num_threads(loxo_threads_for(mesh->ctx, mesh->view.n_vertices, 3))
    {
        const loxo_range r = loxo_thread_range(mesh->view.n_vertices);
        for (int64_t i = r.begin; i < r.end; ++i)
            caller[origin != NULL ? origin[i] : i] = own[i];
    }
}

loxo_index loxo_mesh_index_from_caller(const loxo_mesh *mesh, int64_t caller_vertex)
{
    const loxo_index *origin = mesh->view.vertex_origin;
    if (caller_vertex < 0 || caller_vertex >= mesh->n_caller_vertices) return -1;
    if (mesh->caller_to_mesh != NULL) return mesh->caller_to_mesh[caller_vertex];
    if (origin == NULL) return (loxo_index)caller_vertex;
    int64_t i = 0;
    while (origin[i] != caller_vertex)
        ++i;
    return (loxo_index)i;
}

loxo_status loxo_mesh_indices_from_caller(const loxo_mesh *mesh, int64_t n, const loxo_index *caller, loxo_index *own)
{
    enum { FEW = 8 };
    loxo_index *inverse = NULL;
    if (n > FEW && mesh->view.vertex_origin != NULL && mesh->caller_to_mesh == NULL) {
        inverse = loxo_allocate(mesh->ctx, mesh->n_caller_vertices, sizeof *inverse);
        if (inverse == NULL) return LOXO_ERR_MEMORY;
        loxo_mesh_vertex_order(mesh, inverse);
    }
    for (int64_t i = 0; i < n; ++i) {
        const loxo_index v = caller[i];
        if (inverse == NULL || v < 0 || v >= mesh->n_caller_vertices)
            own[i] = loxo_mesh_index_from_caller(mesh, v);
        else
            own[i] = inverse[v];
    }
    loxo_release(mesh->ctx, inverse);
    return LOXO_OK;
}
