/* SPDX-License-Identifier: MIT
 * Landmarks on a mesh: every point becomes a barycentric combination of vertices that are there. */
#include "base/allocate.h"
#include "base/context.h"
#include "mesh/mesh_internal.h"

#include <loxo/lines.h>

#include <inttypes.h>
#include <math.h>

void loxo_landmarks_destroy(loxo_context *ctx, loxo_landmarks *landmarks)
{
    if (landmarks == NULL) return;
    loxo_release(ctx, landmarks->name);
    loxo_release(ctx, landmarks->is_closed);
    loxo_release(ctx, landmarks->curve_begin);
    loxo_release(ctx, landmarks->point);
    loxo_release(ctx, landmarks->position);
    *landmarks = (loxo_landmarks){0};
}

static bool is_on_surface(const loxo_surface_point *p)
{
    return p->vertex[0] >= 0 || p->vertex[1] >= 0 || p->vertex[2] >= 0;
}

/* own [n_vertices]: the mesh's numbers. */
static loxo_status check(const loxo_mesh *mesh, const loxo_index *own, int64_t i, loxo_surface_point *point)
{
    const loxo_place place = {.byte = -1, .element = i};
    double sum = 0.0;
    for (int k = 0; k < 3; ++k) {
        const loxo_index v = point->vertex[k];
        if (v < 0) {
            point->weight[k] = 0.0;
            continue;
        }
        if (v >= mesh->n_caller_vertices)
            return loxo_fail_at(mesh->ctx, LOXO_ERR_ARGUMENT, place,
                                "landmarks: point %" PRId64 ": vertex %" PRId64 " not in 0..%" PRId64, i, (int64_t)v,
                                mesh->n_caller_vertices - 1);
        if (own[v] < 0 || mesh->view.vertex_halfedge[own[v]] < 0)
            return loxo_fail_at(mesh->ctx, LOXO_ERR_ARGUMENT, place,
                                "landmarks: point %" PRId64 ": vertex %" PRId64 " has no faces", i, (int64_t)v);
        if (!(point->weight[k] >= 0.0))
            return loxo_fail_at(mesh->ctx, LOXO_ERR_ARGUMENT, place,
                                "landmarks: point %" PRId64 ": weight %g of vertex %" PRId64, i, point->weight[k],
                                (int64_t)v);
        sum += point->weight[k];
    }
    if (!(sum > 0.0 && isfinite(sum)))
        return loxo_fail_at(mesh->ctx, LOXO_ERR_ARGUMENT, place, "landmarks: point %" PRId64 ": weights sum to %g", i,
                            sum);
    for (int k = 0; k < 3; ++k)
        point->weight[k] /= sum;
    return LOXO_OK;
}

loxo_status loxo_landmarks_locate(const loxo_mesh *mesh, loxo_landmarks *landmarks, double *away)
{
    if (mesh == NULL) return LOXO_ERR_ARGUMENT;
    loxo_context *ctx = mesh->ctx;
    if (landmarks == NULL || (landmarks->n_points > 0 && landmarks->point == NULL))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "landmarks: an array is NULL");
    const int64_t n = landmarks->n_points;
    loxo_index *own = loxo_allocate(ctx, mesh->n_caller_vertices, sizeof *own);
    double(*position)[3] = loxo_allocate(ctx, n, sizeof *position);
    double *distance = loxo_allocate(ctx, n, sizeof *distance);
    loxo_surface_point *nearest = loxo_allocate(ctx, n, sizeof *nearest);
    loxo_status status = LOXO_ERR_MEMORY;
    int64_t n_far = 0;
    if (own == NULL || position == NULL || distance == NULL || nearest == NULL) goto done;
    if ((status = loxo_mesh_vertex_order(mesh, own)) < 0) goto done;
    for (int64_t i = 0; i < n; ++i) {
        if (is_on_surface(&landmarks->point[i])) continue;
        for (int k = 0; k < 3; ++k)
            position[n_far][k] = landmarks->position[i][k];
        ++n_far;
    }
    if (n_far > 0 &&
        (status = loxo_mesh_nearest_points(mesh, n_far, (const double(*)[3])position, nearest, distance)) < 0)
        goto done;
    double farthest = 0.0;
    for (int64_t i = 0, k = 0; i < n; ++i) {
        if (!is_on_surface(&landmarks->point[i])) {
            landmarks->point[i] = nearest[k];
            farthest = fmax(farthest, distance[k++]);
        } else if ((status = check(mesh, own, i, &landmarks->point[i])) < 0) {
            goto done;
        }
    }
    if (away != NULL) *away = farthest;
done:
    loxo_release(ctx, nearest);
    loxo_release(ctx, distance);
    loxo_release(ctx, position);
    loxo_release(ctx, own);
    return status;
}
