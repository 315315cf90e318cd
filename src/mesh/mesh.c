/* SPDX-License-Identifier: MIT
 * loxo_mesh_create: arrays in, directed edges out. */
#include "base/allocate.h"
#include "base/options.h"
#include "base/os.h"
#include "mesh/components.h"
#include "mesh/halfedge.h"
#include "mesh/mesh_internal.h"
#include "mesh/reorder.h"
#include "mesh/repair.h"
#include "mesh/soup.h"
#include "par/range.h"

#include <string.h>

/* What is being built: the arrays as they are after the steps so far, and whose they are. */
typedef struct builder {
    loxo_context *ctx;
    const loxo_mesh_settings *settings;
    loxo_mesh *mesh;
    loxo_mesh_arrays arrays;
    bool owns_position, owns_triangle; /* then they came from loxo_allocate and may be changed and freed */
    loxo_index *face_origin;           /* [n_faces] the caller's number of each face; NULL: the same */
    loxo_mesh_info info;
} builder;

static void replace_triangles(builder *b, loxo_index *triangle, int64_t n_faces)
{
    if (b->owns_triangle) loxo_release(b->ctx, (void *)b->arrays.triangle);
    b->arrays.triangle = triangle;
    b->arrays.n_faces = n_faces;
    b->owns_triangle = true;
}

static int64_t face_number(const builder *b, int64_t f) { return b->face_origin == NULL ? f : b->face_origin[f]; }

static int64_t vertex_number(const builder *b, int64_t v)
{
    return b->mesh->vertex_origin == NULL ? v : b->mesh->vertex_origin[v];
}

static loxo_status stop(const builder *b, const char *phase)
{
    if (!loxo_stop_wanted(b->ctx, phase, 0.0)) return LOXO_OK;
    return loxo_fail(b->ctx, LOXO_ERR_STOPPED, "mesh: stopped by the monitor before it was built");
}

/* Copies n items of size bytes in parallel, so that each thread first touches its own range. */
static void *copy_array(loxo_context *ctx, const void *from, int64_t n, size_t size)
{
    unsigned char *to = loxo_allocate(ctx, n, size);
    if (to == NULL) return NULL;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 2))
    {
        const loxo_range r = loxo_thread_range(n);
        if (r.end > r.begin)
            memcpy(to + (size_t)r.begin * size, (const unsigned char *)from + (size_t)r.begin * size,
                   (size_t)(r.end - r.begin) * size);
    }
    return to;
}

static loxo_status own_positions(builder *b)
{
    if (b->owns_position) return LOXO_OK;
    const int64_t n = b->arrays.n_vertices;
    if (b->arrays.position_float != NULL) {
        float *copy = copy_array(b->ctx, b->arrays.position_float, n, 3 * sizeof *copy);
        if (copy == NULL) return LOXO_ERR_MEMORY;
        b->arrays.position_float = copy;
    } else if (b->arrays.position != NULL) {
        double *copy = copy_array(b->ctx, b->arrays.position, n, 3 * sizeof *copy);
        if (copy == NULL) return LOXO_ERR_MEMORY;
        b->arrays.position = copy;
    }
    b->owns_position = true;
    return LOXO_OK;
}

static loxo_status own_triangles(builder *b)
{
    if (b->owns_triangle) return LOXO_OK;
    loxo_index *copy = copy_array(b->ctx, b->arrays.triangle, b->arrays.n_faces, 3 * sizeof *copy);
    if (copy == NULL) return LOXO_ERR_MEMORY;
    replace_triangles(b, copy, b->arrays.n_faces);
    return LOXO_OK;
}

/* ---- mending ------------------------------------------------------------------------------------------------- */

static loxo_status drop_degenerate(builder *b, int64_t n_degenerate)
{
    const int64_t n_faces = b->arrays.n_faces - n_degenerate;
    loxo_index *triangle = loxo_allocate(b->ctx, n_faces, 3 * sizeof *triangle);
    if (triangle == NULL) return LOXO_ERR_MEMORY;
    b->face_origin = loxo_allocate(b->ctx, n_faces, sizeof *b->face_origin);
    if (b->face_origin == NULL) {
        loxo_release(b->ctx, triangle);
        return LOXO_ERR_MEMORY;
    }
    int64_t n = 0;
    for (int64_t f = 0; f < b->arrays.n_faces; ++f) {
        if (loxo_is_degenerate(&b->arrays.triangle[3 * f])) continue;
        memcpy(&triangle[3 * n], &b->arrays.triangle[3 * f], 3 * sizeof *triangle);
        b->face_origin[n++] = (loxo_index)f;
    }
    replace_triangles(b, triangle, n_faces);
    return LOXO_OK;
}

static loxo_status repair(builder *b)
{
    const loxo_repair_settings settings = loxo_repair_settings_default();
    loxo_index *vertex_result = NULL;
    loxo_status status = own_positions(b);
    if (status < 0) return status;
    if ((status = own_triangles(b)) < 0) return status;
    loxo_soup soup = {
        .n_vertices = b->arrays.n_vertices,
        .n_faces = b->arrays.n_faces,
        .position = (double *)b->arrays.position,
        .position_float = (float *)b->arrays.position_float,
        .triangle = (loxo_index *)b->arrays.triangle,
    };
    status = loxo_repair(b->ctx, &soup, &settings, &b->mesh->vertex_origin, &vertex_result, &b->face_origin,
                         &b->info.repair);
    b->arrays = loxo_soup_arrays(&soup);
    b->mesh->caller_to_mesh = vertex_result;
    return status;
}

/* Validates, and mends what is asked or harmless. */
static loxo_status make_sound(builder *b)
{
    int64_t n_degenerate, first_degenerate;
    loxo_status status = loxo_arrays_check_ids(b->ctx, &b->arrays, &n_degenerate, &first_degenerate);
    if (status < 0) return status;
    if ((status = loxo_arrays_check_finite(b->ctx, &b->arrays)) < 0) return status;
    if (b->settings->repair) return repair(b);
    if (n_degenerate == 0) return LOXO_OK;
    b->info.repair.n_degenerate_dropped = n_degenerate;
    loxo_warn_degenerate(b->ctx, n_degenerate, first_degenerate);
    return drop_degenerate(b, n_degenerate);
}

/* ---- order --------------------------------------------------------------------------------------------------- */

static loxo_status invert(loxo_context *ctx, int64_t n, const loxo_index *new_to_old, loxo_index **old_to_new)
{
    loxo_index *inverse = loxo_allocate(ctx, n, sizeof *inverse);
    *old_to_new = inverse;
    if (inverse == NULL) return LOXO_ERR_MEMORY;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 3))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i)
            inverse[new_to_old[i]] = (loxo_index)i;
    }
    return LOXO_OK;
}

static loxo_status renumber_triangles(builder *b, const loxo_index *old_to_new)
{
    const int64_t n = 3 * b->arrays.n_faces;
    const loxo_index *old = b->arrays.triangle;
    loxo_index *triangle = loxo_allocate(b->ctx, n, sizeof *triangle);
    if (triangle == NULL) return LOXO_ERR_MEMORY;
#pragma omp parallel num_threads(loxo_threads_for(b->ctx, n, 2))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t h = r.begin; h < r.end; ++h)
            triangle[h] = old_to_new[old[h]];
    }
    replace_triangles(b, triangle, b->arrays.n_faces);
    return LOXO_OK;
}

static loxo_status permute_positions(builder *b, const loxo_index *new_to_old)
{
    const int64_t n = b->arrays.n_vertices;
    const bool is_float = b->arrays.position_float != NULL;
    const size_t size = 3 * (is_float ? sizeof(float) : sizeof(double));
    const void *from = is_float ? (const void *)b->arrays.position_float : (const void *)b->arrays.position;
    void *to = loxo_gather(b->ctx, from, new_to_old, n, size);
    if (to == NULL) return LOXO_ERR_MEMORY;
    if (b->owns_position) loxo_release(b->ctx, (void *)from);
    if (is_float)
        b->arrays.position_float = to;
    else
        b->arrays.position = to;
    b->owns_position = true;
    return LOXO_OK;
}

/* The permutation goes over what a repair has left. Takes new_to_old. */
static void compose_origin(builder *b, loxo_index *new_to_old, const loxo_index *old_to_new)
{
    loxo_mesh *mesh = b->mesh;
    if (mesh->vertex_origin != NULL) {
        for (int64_t i = 0; i < b->arrays.n_vertices; ++i)
            new_to_old[i] = mesh->vertex_origin[new_to_old[i]];
        loxo_release(b->ctx, mesh->vertex_origin);
    }
    mesh->vertex_origin = new_to_old;
    for (int64_t v = 0; mesh->caller_to_mesh != NULL && v < mesh->n_caller_vertices; ++v)
        if (mesh->caller_to_mesh[v] >= 0) mesh->caller_to_mesh[v] = old_to_new[mesh->caller_to_mesh[v]];
}

static bool are_faces_sorted(const builder *b)
{
    const loxo_index *triangle = b->arrays.triangle;
    int64_t n_wrong = 0;
#pragma omp parallel num_threads(loxo_threads_for(b->ctx, b->arrays.n_faces, 2)) reduction(+ : n_wrong)
    {
        const loxo_range r = loxo_thread_range(b->arrays.n_faces);
        for (int64_t f = r.begin > 0 ? r.begin : 1; f < r.end; ++f)
            n_wrong += loxo_smallest_corner(&triangle[3 * f]) < loxo_smallest_corner(&triangle[3 * (f - 1)]);
    }
    return n_wrong == 0;
}

/* Faces in the order of their smallest vertex, so that those of a part stand together. */
static loxo_status sort_faces(builder *b)
{
    loxo_context *ctx = b->ctx;
    const int64_t n_faces = b->arrays.n_faces;
    const loxo_index *old = b->arrays.triangle;
    loxo_status status = LOXO_ERR_MEMORY;
    loxo_index *order = NULL, *triangle = NULL;
    int64_t *begin = loxo_allocate(ctx, b->arrays.n_vertices + 1, sizeof *begin);
    if (begin == NULL) goto done;
    order = loxo_allocate(ctx, n_faces, sizeof *order);
    if (order == NULL) goto done;
    triangle = loxo_allocate(ctx, n_faces, 3 * sizeof *triangle);
    if (triangle == NULL) goto done;
    loxo_sort_faces(ctx, b->arrays.n_vertices, n_faces, old, order, begin);
#pragma omp parallel num_threads(loxo_threads_for(ctx, n_faces, 5))
    {
        const loxo_range r = loxo_thread_range(n_faces);
        for (int64_t f = r.begin; f < r.end; ++f) {
            const loxo_index from = order[f];
            memcpy(&triangle[3 * f], &old[(int64_t)3 * from], 3 * sizeof *triangle);
            if (b->face_origin != NULL) order[f] = b->face_origin[from];
        }
    }
    replace_triangles(b, triangle, n_faces);
    loxo_release(ctx, b->face_origin);
    b->face_origin = order;
    order = NULL;
    status = LOXO_OK;
done:
    loxo_release(ctx, order);
    loxo_release(ctx, begin);
    return status;
}

/* First face whose smallest vertex is v or higher; faces are sorted. */
static int64_t first_face_from(const builder *b, int64_t v)
{
    int64_t low = 0, high = b->arrays.n_faces;
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (loxo_smallest_corner(&b->arrays.triangle[3 * middle]) < v)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static loxo_status make_part_faces(builder *b)
{
    loxo_mesh *mesh = b->mesh;
    const int64_t n_parts = mesh->view.n_parts;
    mesh->part_face = loxo_allocate(b->ctx, n_parts + 1, sizeof *mesh->part_face);
    if (mesh->part_face == NULL) return LOXO_ERR_MEMORY;
    mesh->part_face[0] = 0;
    for (int64_t p = 1; p < n_parts; ++p)
        mesh->part_face[p] = first_face_from(b, mesh->part_vertex[p]);
    mesh->part_face[n_parts] = b->arrays.n_faces;
    return LOXO_OK;
}

static loxo_status apply_order(builder *b, loxo_reordering *r)
{
    loxo_status status = LOXO_OK;
    const bool is_moved = r->vertex_new_to_old != NULL;
    if (is_moved) {
        loxo_index *old_to_new = NULL;
        if ((status = invert(b->ctx, b->arrays.n_vertices, r->vertex_new_to_old, &old_to_new)) < 0) return status;
        status = renumber_triangles(b, old_to_new);
        if (status >= 0) status = permute_positions(b, r->vertex_new_to_old);
        if (status >= 0) {
            compose_origin(b, r->vertex_new_to_old, old_to_new);
            r->vertex_new_to_old = NULL;
        }
        loxo_release(b->ctx, old_to_new);
        if (status < 0) return status;
    }
    if ((is_moved || r->n_parts > 1) && !are_faces_sorted(b))
        if ((status = sort_faces(b)) < 0) return status;
    b->mesh->part_vertex = r->part_vertex;
    b->mesh->view.n_parts = r->n_parts;
    r->part_vertex = NULL;
    return make_part_faces(b);
}

static loxo_status put_in_order(builder *b)
{
    loxo_reordering r = {0};
    const double start_s = loxo_os_clock_s();
    loxo_status status = loxo_reorder(b->ctx, &b->arrays, b->settings->order, b->settings->part_bytes, &r);
    if (status < 0) return status;
    b->info.order = r.order;
    status = apply_order(b, &r);
    loxo_reordering_destroy(b->ctx, &r);
    b->info.reorder_s = loxo_os_clock_s() - start_s;
    return status;
}

/* ---- half-edges ---------------------------------------------------------------------------------------------- */

static loxo_status fail_nonmanifold_edge(const builder *b, const loxo_edge_counts *counts)
{
    const loxo_index h = (loxo_index)counts->first_nonmanifold;
    const loxo_index *triangle = b->arrays.triangle;
    const int64_t face = face_number(b, h / 3);
    int64_t n = 0;
    loxo_index i = h;
    do {
        ++n;
        i = b->mesh->halfedge_twin[i];
    } while (i != h);
    return loxo_fail_at(
        b->ctx, LOXO_ERR_MESH, (loxo_place){.byte = -1, .element = face},
        "non-manifold edge: %lld faces meet at the edge between vertices %lld and %lld (one is face %lld); "
        "%lld such edges; --repair splits them",
        (long long)n, (long long)vertex_number(b, triangle[h]),
        (long long)vertex_number(b, triangle[loxo_halfedge_next(h)]), (long long)face,
        (long long)counts->n_nonmanifold);
}

static loxo_status turn_faces(builder *b)
{
    const int64_t n_faces = b->arrays.n_faces;
    int64_t n_turned = 0, conflict = -1, first = INT64_MAX;
    uint8_t *turn = loxo_allocate(b->ctx, n_faces, sizeof *turn);
    if (turn == NULL) return LOXO_ERR_MEMORY;
    loxo_status status =
        loxo_find_orientation(b->ctx, n_faces, b->arrays.triangle, b->mesh->halfedge_twin, turn, &n_turned, &conflict);
    if (status < 0) goto done;
    if (conflict >= 0) {
        conflict = face_number(b, conflict);
        status = loxo_fail_at(b->ctx, LOXO_ERR_MESH, (loxo_place){.byte = -1, .element = conflict},
                              "not orientable: a way around the surface comes back to face %lld turned over",
                              (long long)conflict);
        goto done;
    }
    for (int64_t f = 0; f < n_faces; ++f)
        if (turn[f] && face_number(b, f) < first) first = face_number(b, f);
    if ((status = own_triangles(b)) < 0) goto done;
    loxo_turn_faces(b->ctx, n_faces, turn, (loxo_index *)b->arrays.triangle);
    b->info.repair.n_faces_turned += n_turned;
    loxo_warn_turned(b->ctx, n_turned, first);
done:
    loxo_release(b->ctx, turn);
    return status;
}

static loxo_status match(builder *b, loxo_edge_counts *counts)
{
    loxo_mesh *mesh = b->mesh;
    const int64_t n_faces = b->arrays.n_faces;
    mesh->halfedge_twin = loxo_allocate(b->ctx, 3 * n_faces, sizeof *mesh->halfedge_twin);
    if (mesh->halfedge_twin == NULL) return LOXO_ERR_MEMORY;
    loxo_status status =
        loxo_match_halfedges(b->ctx, b->arrays.n_vertices, n_faces, b->arrays.triangle, mesh->halfedge_twin, counts);
    if (status < 0) return status;
    if (counts->n_nonmanifold > 0) return fail_nonmanifold_edge(b, counts);
    if (counts->n_same_way == 0) return LOXO_OK;
    if ((status = turn_faces(b)) < 0) return status;
    return loxo_match_halfedges(b->ctx, b->arrays.n_vertices, n_faces, b->arrays.triangle, mesh->halfedge_twin, counts);
}

/* Only called when there is one. */
static loxo_status fail_nonmanifold_vertex(const builder *b)
{
    const loxo_index *triangle = b->arrays.triangle;
    int64_t n_bad = 0, first = INT64_MAX;
    int32_t *degree = loxo_allocate_zero(b->ctx, b->arrays.n_vertices, sizeof *degree);
    if (degree == NULL) return LOXO_ERR_MEMORY;
    for (int64_t h = 0; h < 3 * b->arrays.n_faces; ++h)
        degree[triangle[h]] += 1;
    for (int64_t v = 0; v < b->arrays.n_vertices; ++v) {
        const loxo_index h = b->mesh->vertex_halfedge[v];
        if (h < 0 || loxo_fan_size(triangle, b->mesh->halfedge_twin, h) == degree[v]) continue;
        n_bad += 1;
        if (vertex_number(b, v) < first) first = vertex_number(b, v);
    }
    loxo_release(b->ctx, degree);
    return loxo_fail_at(b->ctx, LOXO_ERR_MESH, (loxo_place){.byte = -1, .element = first},
                        "non-manifold vertex: more than one fan of faces meets at vertex %lld; %lld such vertices; "
                        "--repair splits them",
                        (long long)first, (long long)n_bad);
}

static loxo_status link_vertices(builder *b)
{
    loxo_mesh *mesh = b->mesh;
    const int64_t n_vertices = b->arrays.n_vertices, n_faces = b->arrays.n_faces;
    mesh->vertex_halfedge = loxo_allocate(b->ctx, n_vertices, sizeof *mesh->vertex_halfedge);
    if (mesh->vertex_halfedge == NULL) return LOXO_ERR_MEMORY;
    const int64_t n_met =
        loxo_link_vertices(b->ctx, n_vertices, n_faces, b->arrays.triangle, mesh->halfedge_twin, mesh->vertex_halfedge);
    return n_met == 3 * n_faces ? LOXO_OK : fail_nonmanifold_vertex(b);
}

static loxo_status count_topology(builder *b, const loxo_edge_counts *edges)
{
    const loxo_mesh *mesh = b->mesh;
    const int64_t n_vertices = b->arrays.n_vertices, n_faces = b->arrays.n_faces;
    int64_t n_unreferenced = 0, first = INT64_MAX;
    loxo_index *parent = loxo_allocate(b->ctx, n_vertices, sizeof *parent);
    if (parent == NULL) return LOXO_ERR_MEMORY;
#pragma omp parallel num_threads(loxo_threads_for(b->ctx, n_vertices, 1)) reduction(+ : n_unreferenced)                \
    reduction(min : first)
    {
        const loxo_range r = loxo_thread_range(n_vertices);
        for (int64_t v = r.begin; v < r.end; ++v) {
            if (mesh->vertex_halfedge[v] >= 0) continue;
            n_unreferenced += 1;
            if (vertex_number(b, v) < first) first = vertex_number(b, v);
        }
    }
    loxo_mesh_info *info = &b->info;
    const int64_t n_used = n_vertices - n_unreferenced;
    info->n_unreferenced = n_unreferenced;
    info->n_components = n_used - loxo_join_faces(b->ctx, n_vertices, n_faces, b->arrays.triangle, parent);
    if (edges->n_boundary > 0)
        info->n_boundary_loops = edges->n_boundary - loxo_join_boundary(b->ctx, n_vertices, n_faces, b->arrays.triangle,
                                                                        mesh->halfedge_twin, parent);
    loxo_release(b->ctx, parent);
    info->euler = n_used - edges->n_edges + n_faces;
    /* euler = 2 - 2 genus - loops, summed over the components */
    info->genus = (2 * info->n_components - info->n_boundary_loops - info->euler) / 2;
    if (n_unreferenced > 0)
        loxo_warn(b->ctx, "unreferenced", n_unreferenced, "%lld vertices belong to no face (first: vertex %lld)",
                  (long long)n_unreferenced, (long long)first);
    if (info->n_components > 1)
        loxo_warn(b->ctx, "components", info->n_components, "the mesh has %lld components that do not touch",
                  (long long)info->n_components);
    if (n_faces == 0) loxo_warn(b->ctx, "no-faces", 1, "the mesh has no faces");
    return LOXO_OK;
}

/* ---- all of it ----------------------------------------------------------------------------------------------- */

static size_t array_bytes(const loxo_mesh_arrays *arrays)
{
    const size_t coordinate = arrays->position != NULL ? sizeof(double) : sizeof(float);
    return (size_t)arrays->n_vertices * 3 * coordinate + (size_t)arrays->n_faces * 3 * sizeof(loxo_index);
}

static void hand_over(builder *b)
{
    loxo_mesh *mesh = b->mesh;
    loxo_mesh_view *view = &mesh->view;
    if (b->owns_position) {
        mesh->position = (double *)b->arrays.position;
        mesh->position_float = (float *)b->arrays.position_float;
    }
    if (b->owns_triangle) mesh->halfedge_vertex = (loxo_index *)b->arrays.triangle;
    b->owns_position = b->owns_triangle = false;
    view->n_vertices = b->arrays.n_vertices;
    view->n_faces = b->arrays.n_faces;
    view->position = (const double(*)[3])b->arrays.position;
    view->position_float = (const float(*)[3])b->arrays.position_float;
    view->halfedge_vertex = b->arrays.triangle;
    view->halfedge_twin = mesh->halfedge_twin;
    view->vertex_halfedge = mesh->vertex_halfedge;
    view->vertex_origin = mesh->vertex_origin;
    view->part_vertex = mesh->part_vertex;
    view->part_face = mesh->part_face;

    loxo_mesh_info *info = &b->info;
    view->genus = info->genus;
    view->n_boundary_loops = info->n_boundary_loops;
    info->mesh_bytes = array_bytes(&b->arrays) + (size_t)view->n_faces * 3 * sizeof(loxo_index) +
                       (size_t)view->n_vertices * sizeof(loxo_index);
    info->order_bytes = 2 * ((size_t)view->n_parts + 1) * sizeof(int64_t);
    if (mesh->vertex_origin != NULL) info->order_bytes += (size_t)view->n_vertices * sizeof(loxo_index);
    if (mesh->caller_to_mesh != NULL) info->order_bytes += (size_t)mesh->n_caller_vertices * sizeof(loxo_index);
}

static loxo_status build(builder *b, loxo_ownership ownership)
{
    loxo_edge_counts edges;
    loxo_status status;
    if ((status = stop(b, "check")) < 0) return status;
    if ((status = make_sound(b)) < 0) return status;
    if ((status = stop(b, "order")) < 0) return status;
    if ((status = put_in_order(b)) < 0) return status;
    if (ownership == LOXO_COPY && (status = own_positions(b)) < 0) return status;
    if (ownership == LOXO_COPY && (status = own_triangles(b)) < 0) return status;
    if ((status = stop(b, "half-edges")) < 0) return status;

    const double start_s = loxo_os_clock_s();
    if ((status = match(b, &edges)) < 0) return status;
    if ((status = link_vertices(b)) < 0) return status;
    b->info.halfedge_s = loxo_os_clock_s() - start_s;
    if ((status = stop(b, "components")) < 0) return status;
    return count_topology(b, &edges);
}

/* The estimate against what is left of the limit, before any work. */
static loxo_status check_memory(const builder *b, loxo_ownership ownership)
{
    size_t peak_bytes = 0;
    const size_t adopted_bytes = ownership == LOXO_ADOPT ? array_bytes(&b->arrays) : 0;
    const loxo_status status = loxo_mesh_estimate(b->arrays.n_vertices, b->arrays.n_faces, b->arrays.position == NULL,
                                                  b->settings, NULL, &peak_bytes);
    if (status < 0) return loxo_fail(b->ctx, status, "mesh: its size in bytes overflows");
    return loxo_memory_check(b->ctx, peak_bytes > adopted_bytes ? peak_bytes - adopted_bytes : 0, "the mesh");
}

loxo_status loxo_mesh_create(loxo_context *ctx, const loxo_mesh_arrays *arrays, loxo_ownership ownership,
                             const loxo_mesh_settings *settings, loxo_mesh_info *info, loxo_mesh **out)
{
    const loxo_mesh_settings defaults = loxo_mesh_settings_default();
    const double start_s = loxo_os_clock_s();
    builder b = {.ctx = ctx, .settings = settings == NULL ? &defaults : settings};
    loxo_status status;
    if (out != NULL) *out = NULL;
    if (ctx == NULL || arrays == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "mesh: no context or no arrays");
    loxo_progress_begin(ctx);
    b.arrays = *arrays;
    b.owns_position = b.owns_triangle = ownership == LOXO_ADOPT;
    size_t before_bytes = ctx->current_bytes;
    const size_t peak_before_bytes = ctx->peak_bytes;

    if (out == NULL || (unsigned)ownership > LOXO_ADOPT) {
        status = loxo_fail(ctx, LOXO_ERR_ARGUMENT, "mesh: no place for it, or an unknown kind of ownership");
        goto fail;
    }
    if ((status = loxo_options_check(ctx, "mesh", loxo_mesh_options, b.settings)) < 0) goto fail;
    if ((status = loxo_arrays_check_counts(ctx, "mesh", &b.arrays)) < 0) goto fail;
    if ((status = check_memory(&b, ownership)) < 0) goto fail;
    if (ownership == LOXO_ADOPT) before_bytes -= array_bytes(&b.arrays);
    loxo_context_reset_peak(ctx);
    b.mesh = loxo_allocate(ctx, 1, sizeof *b.mesh);
    if (b.mesh == NULL) {
        status = LOXO_ERR_MEMORY;
        goto fail;
    }
    *b.mesh = (loxo_mesh){.ctx = ctx, .n_caller_vertices = arrays->n_vertices};
    if ((status = build(&b, ownership)) < 0) goto fail;
    hand_over(&b);
    b.info.peak_bytes = ctx->peak_bytes - before_bytes;
    b.info.total_s = loxo_os_clock_s() - start_s;
    if (info != NULL) *info = b.info;
    *out = b.mesh;
    b.mesh = NULL;
    if (loxo_repair_changed_surface(&b.info.repair)) status = LOXO_REPAIRED;
fail:
    if (ctx->peak_bytes < peak_before_bytes) ctx->peak_bytes = peak_before_bytes;
    loxo_release(ctx, b.face_origin);
    if (b.owns_triangle) loxo_release(ctx, (void *)b.arrays.triangle);
    if (b.owns_position) loxo_release(ctx, (void *)b.arrays.position);
    if (b.owns_position) loxo_release(ctx, (void *)b.arrays.position_float);
    loxo_mesh_destroy(b.mesh);
    return status;
}
