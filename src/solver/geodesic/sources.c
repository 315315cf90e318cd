/* SPDX-License-Identifier: MIT
 * From the caller's sources to seeds: in the mesh's numbers, sorted, each once. */
#include "base/allocate.h"
#include "base/sort.h"
#include "kernel/vec3.h"
#include "mesh/intrinsic/overlay.h"
#include "solver/geodesic/geodesic_internal.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

#define WEIGHTS_WITHIN 1e-6 /* of a sum of 1 */

/* A repair may have split a vertex of the caller into several: the copies of all that were, by origin. NULL: no repair. */
typedef struct copy_lists {
    int64_t *begin;     /* [n_caller + 1] */
    loxo_index *vertex; /* [n_vertices] */
} copy_lists;

typedef struct seed_list {
    const geodesic_problem *problem;
    copy_lists copies;
    int64_t n, capacity;
    geodesic_seed *seed;
} seed_list;

static loxo_status list_copies(const geodesic_problem *problem, copy_lists *lists)
{
    const int64_t n = problem->m.n_vertices, n_caller = loxo_mesh_n_vertices(problem->mesh);
    const loxo_index *origin = problem->m.vertex_origin;
    if (problem->mesh->caller_to_mesh == NULL || origin == NULL) return LOXO_OK;
    lists->begin = loxo_allocate_zero(problem->ctx, n_caller + 1, sizeof *lists->begin);
    lists->vertex = loxo_allocate(problem->ctx, n, sizeof *lists->vertex);
    if (lists->begin == NULL || lists->vertex == NULL) return LOXO_ERR_MEMORY;
    for (int64_t v = 0; v < n; ++v)
        ++lists->begin[origin[v] + 1];
    for (int64_t i = 0; i < n_caller; ++i)
        lists->begin[i + 1] += lists->begin[i];
    for (int64_t v = n - 1; v >= 0; --v) /* ends become beginnings */
        lists->vertex[--lists->begin[origin[v] + 1]] = (loxo_index)v;
    memmove(lists->begin, lists->begin + 1, (size_t)n_caller * sizeof *lists->begin);
    lists->begin[n_caller] = n;
    return LOXO_OK;
}

static void destroy_list(seed_list *list)
{
    loxo_context *ctx = list->problem->ctx;
    loxo_release(ctx, list->copies.begin);
    loxo_release(ctx, list->copies.vertex);
    loxo_release(ctx, list->seed);
}

static loxo_status append(seed_list *list, geodesic_seed seed)
{
    if (list->n == list->capacity) {
        const int64_t capacity = 2 * list->capacity + 4;
        geodesic_seed *larger = loxo_reallocate(list->problem->ctx, list->seed, capacity, sizeof *larger);
        if (larger == NULL) return LOXO_ERR_MEMORY;
        list->seed = larger;
        list->capacity = capacity;
    }
    list->seed[list->n++] = seed;
    return LOXO_OK;
}

/* The copies of a vertex of the mesh: itself, where no repair was. */
static const loxo_index *copies_of(const seed_list *list, const loxo_index *own, int64_t *n)
{
    *n = 1;
    if (list->copies.begin == NULL) return own;
    const int64_t begin = list->copies.begin[list->problem->m.vertex_origin[*own]];
    *n = list->copies.begin[list->problem->m.vertex_origin[*own] + 1] - begin;
    return &list->copies.vertex[begin];
}

static bool is_copy_of(const seed_list *list, loxo_index v, loxo_index of)
{
    const loxo_index *origin = list->problem->m.vertex_origin;
    return list->copies.begin == NULL ? v == of : origin[v] == origin[of];
}

static loxo_status append_vertex(seed_list *list, const loxo_index *own, loxo_index source)
{
    const loxo_mesh_view *m = &list->problem->m;
    int64_t n;
    const loxo_index *copy = copies_of(list, own, &n);
    for (int64_t i = 0; i < n; ++i) {
        const loxo_index h = m->vertex_halfedge[copy[i]];
        if (h < 0) continue;
        geodesic_seed seed = {.vertex = copy[i], .face = (loxo_index)(h / 3), .source = source};
        seed.weight[h % 3] = 1.0;
        const loxo_status status = append(list, seed);
        if (status < 0) return status;
    }
    return LOXO_OK;
}

/* Half-edge h stands for its edge: it is the lower of the two. */
static bool is_lower(const loxo_mesh_view *m, loxo_index h)
{
    return m->halfedge_twin[h] < 0 || m->halfedge_twin[h] > h;
}

/* Sources are points of the surface; on an intrinsic triangulation they lie in faces of other corners. */
static geodesic_seed on_mesh(const loxo_mesh *mesh, geodesic_seed seed)
{
    loxo_face_point p = {seed.face, {seed.weight[0], seed.weight[1], seed.weight[2]}};
    if (mesh->surface == NULL) return seed;
    p = loxo_to_intrinsic(mesh, &p);
    seed.face = p.face;
    for (int k = 0; k < 3; ++k)
        seed.weight[k] = p.weight[k];
    return seed;
}

/* A point inside the edge from own[0] to own[1] or inside the face of own[0..2]: one seed for each such edge, in the face
 * of its lower half-edge, or for each such face. A cut surface may have several, one without a repair at most one; none:
 * nothing is appended. */
static loxo_status append_inside(seed_list *list, int n_corners, const loxo_index *own, const double *weight,
                                 loxo_index source)
{
    const loxo_mesh *mesh = list->problem->mesh;
    const loxo_mesh_view *m = mesh->surface != NULL ? &mesh->surface->view : &list->problem->m;
    int64_t n;
    const loxo_index *copy = copies_of(list, own, &n);
    for (int64_t i = 0; i < n; ++i) {
        const loxo_index start = m->vertex_halfedge[copy[i]];
        for (loxo_index h = start, last; h >= 0; h = last != start ? last : -1) {
            const loxo_index next = k_next(h), before = k_previous(h);
            const loxo_index b = m->halfedge_vertex[next], c = m->halfedge_vertex[before];
            geodesic_seed seed = {.vertex = -1, .face = (loxo_index)(h / 3), .source = source};
            bool is_there = false;
            seed.weight[h % 3] = weight[0];
            last = m->halfedge_twin[before];
            if (n_corners == 3) {
                const bool turned = is_copy_of(list, b, own[2]) && is_copy_of(list, c, own[1]);
                is_there = turned || (is_copy_of(list, b, own[1]) && is_copy_of(list, c, own[2]));
                seed.weight[next % 3] = weight[turned ? 2 : 1];
                seed.weight[before % 3] = weight[turned ? 1 : 2];
            } else if (is_copy_of(list, b, own[1]) && is_lower(m, h)) {
                is_there = true;
                seed.weight[next % 3] = weight[1];
            } else if (is_copy_of(list, c, own[1]) && is_lower(m, before)) {
                is_there = true;
                seed.weight[before % 3] = weight[1];
            }
            const loxo_status status = is_there ? append(list, on_mesh(mesh, seed)) : LOXO_OK;
            if (status < 0) return status;
        }
    }
    return LOXO_OK;
}

static bool comes_before(const void *arg, const void *a, const void *b)
{
    const geodesic_seed *x = a, *y = b;
    (void)arg;
    if (x->vertex != y->vertex) return x->vertex < y->vertex;
    if (x->vertex < 0 && x->face != y->face) return x->face < y->face;
    for (int k = 0; k < 3 && x->vertex < 0; ++k)
        if (x->weight[k] != y->weight[k]) return x->weight[k] < y->weight[k];
    return x->source < y->source;
}

static bool is_same_point(const geodesic_seed *x, const geodesic_seed *y)
{
    if (x->vertex != y->vertex) return false;
    return x->vertex >= 0 || (x->face == y->face && x->weight[0] == y->weight[0] && x->weight[1] == y->weight[1] &&
                              x->weight[2] == y->weight[2]);
}

/* Sorts, keeps each point once, and hands the seeds out; or destroys the list. */
static loxo_status finish(seed_list *list, loxo_status status, geodesic_seed **seeds, int64_t *n_seeds)
{
    int64_t n_kept = 0;
    if (status >= 0) {
        loxo_sort(list->seed, list->n, sizeof *list->seed, comes_before, NULL);
        for (int64_t i = 0; i < list->n; ++i)
            if (i == 0 || !is_same_point(&list->seed[i], &list->seed[n_kept - 1])) list->seed[n_kept++] = list->seed[i];
        *seeds = list->seed;
        *n_seeds = n_kept;
        list->seed = NULL;
    }
    destroy_list(list);
    return status;
}

static loxo_status fail_at(const geodesic_problem *problem, loxo_status status, int64_t element, const char *what,
                           int64_t number)
{
    const loxo_place place = {.byte = -1, .element = element};
    return loxo_fail_at(problem->ctx, status, place, "geodesic: %s %" PRId64, what, number);
}

#define NO_FACE (-2) /* in the place of the number of a vertex without faces */

/* Vertices of the caller in the mesh's numbers, in place; -1, where they are allowed, stays. LOXO_ERR_ARGUMENT: out of
 * range; LOXO_ERR_MESH: without a face, where it has to have one. */
static loxo_status to_own(const geodesic_problem *problem, int64_t n, int n_each, bool needs_faces, loxo_index *vertex)
{
    const loxo_mesh_view *m = &problem->m;
    const int64_t n_caller = loxo_mesh_n_vertices(problem->mesh);
    for (int64_t i = 0; i < n; ++i)
        if (vertex[i] >= n_caller || vertex[i] < (n_each == 1 ? 0 : -1)) {
            const loxo_place place = {.byte = -1, .element = n_each == 1 ? vertex[i] : i / n_each};
            return loxo_fail_at(problem->ctx, LOXO_ERR_ARGUMENT, place,
                                "geodesic: source %" PRId64 " is not in 0..%" PRId64, (int64_t)vertex[i], n_caller - 1);
        }
    loxo_index *own = loxo_allocate(problem->ctx, n, sizeof *own);
    if (own == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = loxo_mesh_indices_from_caller(problem->mesh, n, vertex, own);
    for (int64_t i = 0; i < n && status >= 0; ++i)
        if (vertex[i] >= 0 && (own[i] < 0 || m->vertex_halfedge[own[i]] < 0)) {
            own[i] = NO_FACE;
            if (!needs_faces) continue;
            const loxo_place place = {.byte = -1, .element = n_each == 1 ? vertex[i] : i / n_each};
            status = loxo_fail_at(problem->ctx, LOXO_ERR_MESH, place, "geodesic: source %" PRId64 " belongs to no face",
                                  (int64_t)vertex[i]);
        }
    if (status >= 0) memcpy(vertex, own, (size_t)n * sizeof *own);
    loxo_release(problem->ctx, own);
    return status;
}

loxo_status geodesic_seeds_from_vertices(const geodesic_problem *problem, const loxo_index *sources, int64_t n_sources,
                                         geodesic_seed **seeds, int64_t *n_seeds)
{
    seed_list list = {.problem = problem};
    *seeds = NULL;
    *n_seeds = 0;
    if (sources == NULL || n_sources < 1)
        return loxo_fail(problem->ctx, LOXO_ERR_ARGUMENT, "geodesic: there is no source");
    if (n_sources > LOXO_INDEX_MAX) return loxo_fail(problem->ctx, LOXO_ERR_LIMIT, "geodesic: more sources than ids");
    loxo_index *own = loxo_allocate(problem->ctx, n_sources, sizeof *own);
    if (own == NULL) return LOXO_ERR_MEMORY;
    memcpy(own, sources, (size_t)n_sources * sizeof *own);
    loxo_status status = to_own(problem, n_sources, 1, true, own);
    if (status >= 0) status = list_copies(problem, &list.copies);
    for (int64_t i = 0; i < n_sources && status >= 0; ++i)
        status = append_vertex(&list, &own[i], (loxo_index)i);
    loxo_release(problem->ctx, own);
    return finish(&list, status, seeds, n_seeds);
}

/* Corners with a weight, each once, and their weights, which then add up to 1. Returns how many; 0: weights that are
 * none. */
static int corners_of(const loxo_surface_point *point, const loxo_index *own, loxo_index *corner, double *weight)
{
    double sum = 0.0;
    int n = 0;
    for (int k = 0; k < 3; ++k) {
        const double w = point->weight[k];
        if (own[k] < 0) continue;
        if (!isfinite(w) || w < 0.0) return 0;
        sum += w;
        if (w == 0.0) continue;
        int at = 0;
        while (at < n && corner[at] != own[k])
            ++at;
        if (at == n) {
            corner[n] = own[k];
            weight[n++] = 0.0;
        }
        weight[at] += w;
    }
    if (!(fabs(sum - 1.0) <= WEIGHTS_WITHIN)) return 0;
    for (int k = 0; k < n; ++k)
        weight[k] /= sum;
    return n;
}

static bool is_faceless(const loxo_surface_point *point, const loxo_index *own)
{
    for (int k = 0; k < 3; ++k)
        if (own[k] == NO_FACE && fabs(point->weight[k] - 1.0) <= WEIGHTS_WITHIN) return true;
    return false;
}

/* Of a vertex without faces, where it is allowed, nothing. */
static loxo_status append_point(seed_list *list, const loxo_surface_point *point, const loxo_index *own, int64_t i)
{
    if (is_faceless(point, own)) return LOXO_OK;
    loxo_index corner[3];
    double weight[3];
    const int64_t before = list->n;
    const int n = corners_of(point, own, corner, weight);
    if (n == 0)
        return fail_at(list->problem, LOXO_ERR_ARGUMENT, i,
                       "weights that are negative, not finite, or do not add up to 1, of point", i);
    if (n == 1) return append_vertex(list, corner, (loxo_index)i);
    if (list->problem->mesh->surface != NULL && !loxo_is_traceable(list->problem->mesh))
        return fail_at(list->problem, LOXO_ERR_ARGUMENT, i,
                       "the intrinsic triangulation is not traceable: no way to point", i);
    const loxo_status status = append_inside(list, n, corner, weight, (loxo_index)i);
    if (status < 0 || list->n > before) return status;
    return fail_at(list->problem, LOXO_ERR_ARGUMENT, i, "no face has all vertices of point", i);
}

/* Seeds of all points, in their order. */
static loxo_status list_points(seed_list *list, const loxo_surface_point *points, int64_t n_points, bool needs_faces)
{
    const geodesic_problem *problem = list->problem;
    if (points == NULL || n_points < 1)
        return loxo_fail(problem->ctx, LOXO_ERR_ARGUMENT, "geodesic: there is no source");
    if (n_points > LOXO_INDEX_MAX) return loxo_fail(problem->ctx, LOXO_ERR_LIMIT, "geodesic: more points than ids");
    loxo_index *own = loxo_allocate(problem->ctx, 3 * n_points, sizeof *own);
    if (own == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < 3 * n_points; ++i)
        own[i] = points[i / 3].vertex[i % 3];
    loxo_status status = to_own(problem, 3 * n_points, 3, needs_faces, own);
    if (status >= 0) status = list_copies(problem, &list->copies);
    for (int64_t i = 0; i < n_points && status >= 0; ++i)
        status = append_point(list, &points[i], &own[3 * i], i);
    loxo_release(problem->ctx, own);
    return status;
}

loxo_status geodesic_seeds_from_points(const geodesic_problem *problem, const loxo_surface_point *points,
                                       int64_t n_points, geodesic_seed **seeds, int64_t *n_seeds)
{
    seed_list list = {.problem = problem};
    *seeds = NULL;
    *n_seeds = 0;
    return finish(&list, list_points(&list, points, n_points, true), seeds, n_seeds);
}

loxo_status geodesic_seeds_by_point(const geodesic_problem *problem, const loxo_surface_point *points, int64_t n_points,
                                    bool needs_faces, geodesic_seed **seeds, int64_t **begin)
{
    seed_list list = {.problem = problem};
    *seeds = NULL;
    *begin = NULL;
    loxo_status status = list_points(&list, points, n_points, needs_faces);
    if (status >= 0 && (*begin = loxo_allocate(problem->ctx, n_points + 1, sizeof **begin)) == NULL)
        status = LOXO_ERR_MEMORY;
    if (status >= 0) {
        for (int64_t i = 0, k = 0; i <= n_points; ++i) {
            (*begin)[i] = k;
            while (k < list.n && list.seed[k].source == i)
                ++k;
            loxo_sort(&list.seed[(*begin)[i]], k - (*begin)[i], sizeof *list.seed, comes_before, NULL);
        }
        *seeds = list.seed;
        list.seed = NULL;
    }
    destroy_list(&list);
    return status;
}
