/* SPDX-License-Identifier: MIT
 * Points of space to the nearest points of the surface: every face is looked at, every thread keeps the best of its own. */
#include "base/allocate.h"
#include "base/context.h"
#include "kernel/closest_kernel.h"
#include "mesh/mesh_internal.h"
#include "par/range.h"

#include <inttypes.h>

#define FACES_A_LOOK 65536 /* between two looks at the monitor */

typedef struct best_face {
    double square;
    int64_t face;
    double weight[3];
} best_face;

/* Squared distance to the box around a triangle: not more than to the triangle but for rounding, and cheap. */
static double to_box(loxo_vec3 p, loxo_vec3 a, loxo_vec3 b, loxo_vec3 c)
{
    const double x = fmax(fmax(fmin(fmin(a.x, b.x), c.x) - p.x, p.x - fmax(fmax(a.x, b.x), c.x)), 0.0);
    const double y = fmax(fmax(fmin(fmin(a.y, b.y), c.y) - p.y, p.y - fmax(fmax(a.y, b.y), c.y)), 0.0);
    const double z = fmax(fmax(fmin(fmin(a.z, b.z), c.z) - p.z, p.z - fmax(fmax(a.z, b.z), c.z)), 0.0);
    return x * x + y * y + z * z;
}

static void look(const loxo_mesh_view *m, loxo_range faces, int64_t n, const double (*position)[3], best_face *best)
{
    for (int64_t f = faces.begin; f < faces.end; ++f) {
        const loxo_index *v = &m->halfedge_vertex[3 * f];
        const loxo_vec3 a = k_position(m, v[0]), b = k_position(m, v[1]), c = k_position(m, v[2]);
        for (int64_t i = 0; i < n; ++i) {
            const loxo_vec3 p = v3_load(position[i]);
            double weight[3] = {0.0, 0.0, 0.0};
            const double box = to_box(p, a, b, c);
            if (!(box < best[i].square)) continue;
            /* What rounding puts below the box counts as at it: else whether a face is looked at, which depends on the
             * faces that this thread has seen, would change the answer. */
            const double square = fmax(k_closest_in_triangle(p, a, b, c, weight), box);
            if (!(square < best[i].square)) continue;
            best[i] = (best_face){square, f, {weight[0], weight[1], weight[2]}};
        }
    }
}

/* best [n_threads][n] */
static bool look_at_all(const loxo_mesh *mesh, int64_t n, const double (*position)[3], best_face *best, int n_threads)
{
    const loxo_mesh_view *m = &mesh->view;
    bool is_stopped = false;
    for (int64_t begin = 0; begin < m->n_faces && !is_stopped; begin += FACES_A_LOOK * (int64_t)n_threads) {
        const int64_t rest = m->n_faces - begin, most = FACES_A_LOOK * (int64_t)n_threads;
        const int64_t n_now = rest < most ? rest : most;
#pragma omp parallel num_threads(n_threads)
        {
            const loxo_range r = loxo_thread_range(n_now);
            look(m, (loxo_range){begin + r.begin, begin + r.end}, n, position, &best[loxo_thread_id() * n]);
        }
        is_stopped = loxo_stop_wanted(mesh->ctx, "nearest points", (double)begin / (double)m->n_faces);
    }
    return is_stopped;
}

static loxo_surface_point point_of(const loxo_mesh_view *m, const best_face *best)
{
    loxo_surface_point point = {.vertex = {-1, -1, -1}};
    for (int k = 0; k < 3; ++k) {
        const loxo_index v = m->halfedge_vertex[3 * best->face + k];
        if (best->weight[k] == 0.0) continue;
        point.vertex[k] = m->vertex_origin != NULL ? m->vertex_origin[v] : v;
        point.weight[k] = best->weight[k];
    }
    return point;
}

loxo_status loxo_mesh_nearest_points(const loxo_mesh *mesh, int64_t n, const double (*position)[3],
                                     loxo_surface_point *point, double *away)
{
    if (mesh == NULL) return LOXO_ERR_ARGUMENT;
    loxo_context *ctx = mesh->ctx;
    if (n < 0 || (n > 0 && (position == NULL || point == NULL)))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "nearest points: an array is NULL");
    if (mesh->view.halfedge_length != NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "nearest points: ask the surface of an intrinsic triangulation");
    if (mesh->view.n_faces == 0) return loxo_fail(ctx, LOXO_ERR_MESH, "nearest points: the mesh has no faces");
    for (int64_t i = 0; i < 3 * n; ++i)
        if (!isfinite(position[i / 3][i % 3])) {
            const loxo_place place = {.byte = -1, .element = i / 3};
            return loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, place, "nearest points: position %" PRId64 " is not finite",
                                i / 3);
        }
    loxo_progress_begin(ctx);
    const int n_threads = loxo_threads_for(ctx, mesh->view.n_faces, 5.0 * (double)n);
    best_face *best = loxo_allocate(ctx, n * n_threads, sizeof *best);
    if (best == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < n * n_threads; ++i)
        best[i] = (best_face){.square = HUGE_VAL, .face = -1};
    const bool is_stopped = look_at_all(mesh, n, position, best, n_threads);
    loxo_status status =
        is_stopped ? loxo_fail(ctx, LOXO_ERR_STOPPED, "stopped while looking for nearest points") : LOXO_OK;
    for (int64_t i = 0; i < n && status >= 0; ++i) {
        best_face *b = &best[i];
        for (int64_t t = 1; t < n_threads; ++t) {
            const best_face *other = &best[t * n + i];
            if (other->face < 0) continue;
            if (other->square < b->square || (other->square == b->square && other->face < b->face)) *b = *other;
        }
        if (b->face < 0) { /* so far off that squares overflow */
            const loxo_place place = {.byte = -1, .element = i};
            status = loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, place,
                                  "nearest points: position %" PRId64 " is too far off to compute with", i);
            break;
        }
        point[i] = point_of(&mesh->view, b);
        if (away != NULL) away[i] = sqrt(b->square);
    }
    loxo_release(ctx, best);
    return status;
}
