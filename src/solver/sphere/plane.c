/* SPDX-License-Identifier: MIT
 * Stereographic projection, and the harmonic map of all faces but one to the plane. */
#include "solver/sphere/plane.h"

#include "base/allocate.h"
#include "kernel/layout_kernel.h"
#include "par/range.h"

#include <inttypes.h>
#include <string.h>

/* Far triangles of the plane's image are smaller than the face left out by as much as a vertex is smaller than the surface, and
 * their energy by the square root of that again. */
#define HARMONIC_TOLERANCE 1e-10
#define NEAR_POLE          1e-8

loxo_status plane_map_create(loxo_context *ctx, int64_t n, plane_map *h)
{
    *h = (plane_map){.x = loxo_allocate_zero(ctx, n, sizeof *h->x), .y = loxo_allocate_zero(ctx, n, sizeof *h->y)};
    if (h->x != NULL && h->y != NULL) return LOXO_OK;
    plane_map_destroy(ctx, h);
    return LOXO_ERR_MEMORY;
}

void plane_map_destroy(loxo_context *ctx, plane_map *h)
{
    loxo_release(ctx, h->x);
    loxo_release(ctx, h->y);
    *h = (plane_map){0};
}

void plane_to_sphere(loxo_context *ctx, int64_t n, const plane_map *h, plane_pole pole, const bool *is_kept,
                     sphere_map f)
{
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 6.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            if (is_kept != NULL && is_kept[i]) continue;
            const double square = h->x[i] * h->x[i] + h->y[i] * h->y[i], inverse = 1.0 / (1.0 + square);
            f[i][0] = 2.0 * h->x[i] * inverse;
            f[i][1] = 2.0 * h->y[i] * inverse;
            f[i][2] = (double)pole * (1.0 - square) * inverse;
        }
    }
}

void plane_from_sphere(loxo_context *ctx, int64_t n, sphere_const_map f, plane_pole pole, plane_map *h)
{
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 6.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            double x = f[i][0], y = f[i][1];
            const double z = (double)pole * f[i][2];
            if (z < 0.0 && x * x + y * y < NEAR_POLE * NEAR_POLE) {
                x = NEAR_POLE;
                y = 0.0;
            }
            /* 1 + z = (x^2 + y^2) / (1 - z) does not cancel. */
            const double inverse = z < 0.0 ? (1.0 - z) / (x * x + y * y) : 1.0 / (1.0 + z);
            h->x[i] = x * inverse;
            h->y[i] = y * inverse;
        }
    }
}

/* ---- the map without a face --------------------------------------------------------------------------------------- */

/* Corners of the face on the unit circle, mirrored. */
static loxo_status place_corners(const sphere_problem *p, int64_t face, plane_map *h)
{
    double length[3];
    k_face_lengths(&p->m, face, length);
    const k_layout l = k_layout_of(length);
    const double corner[3][2] = {{0.0, 0.0}, {l.x1, 0.0}, {l.x2, l.y2}};
    const double middle[2] = {0.5 * l.x1, 0.5 * (l.y2 + l.x2 * (l.x2 - l.x1) / l.y2)};
    const double radius = hypot(middle[0], middle[1]);
    if (!(l.y2 > 0.0) || !isfinite(radius))
        return loxo_fail_at(p->ctx, LOXO_ERR_MESH, (loxo_place){.byte = -1, .element = face},
                            "sphere: the most regular face, %" PRId64 ", has no area", face);
    for (int k = 0; k < 3; ++k) {
        const loxo_index v = p->m.halfedge_vertex[3 * face + k];
        h->x[v] = (corner[k][0] - middle[0]) / radius;
        h->y[v] = -(corner[k][1] - middle[1]) / radius;
    }
    return LOXO_OK;
}

loxo_status plane_map_without_face(const sphere_problem *p, int64_t face, plane_map *h, loxo_sphere_info *info)
{
    const int64_t n = p->m.n_vertices;
    plane_solver *solver = NULL;
    bool *is_held = loxo_allocate_zero(p->ctx, n, sizeof *is_held);
    loxo_status status = LOXO_ERR_MEMORY;
    if (is_held == NULL) goto done;
    memset(h->x, 0, (size_t)n * sizeof *h->x);
    memset(h->y, 0, (size_t)n * sizeof *h->y);
    if ((status = place_corners(p, face, h)) < 0) goto done;
    for (int k = 0; k < 3; ++k)
        is_held[p->m.halfedge_vertex[3 * face + k]] = true;
    if ((status = plane_solver_create(p, is_held, &solver)) < 0) goto done;
    status = plane_solver_solve(solver, HARMONIC_TOLERANCE, h, info);
    if (status == LOXO_STOPPED) status = LOXO_ERR_STOPPED; /* there is no map yet */
done:
    plane_solver_destroy(solver);
    loxo_release(p->ctx, is_held);
    return status;
}

/* Sum of the distances of its corners from 0. */
static double find_distance(const sphere_problem *p, const plane_map *h, int64_t face)
{
    double sum = 0.0;
    for (int k = 0; k < 3; ++k) {
        const loxo_index v = p->m.halfedge_vertex[3 * face + k];
        sum += hypot(h->x[v], h->y[v]);
    }
    return sum;
}

/* But for one; of faces that are equally near the first, whatever the threads. */
static int64_t find_nearest_face(const sphere_problem *p, const plane_map *h, int64_t but)
{
    int64_t nearest = but == 0 ? 1 : 0;
    double least = HUGE_VAL;
#pragma omp parallel num_threads(loxo_threads_for(p->ctx, p->m.n_faces, 20.0))
    {
        const loxo_range r = loxo_thread_range(p->m.n_faces);
        int64_t own_face = -1;
        double own = HUGE_VAL;
        for (int64_t t = r.begin; t < r.end; ++t) {
            const double now = t != but ? find_distance(p, h, t) : HUGE_VAL;
            if (!(now < own)) continue;
            own = now;
            own_face = t;
        }
#pragma omp critical(loxo_sphere_nearest_face)
        if (own_face >= 0 && (own < least || (own == least && own_face < nearest))) {
            least = own;
            nearest = own_face;
        }
    }
    return nearest;
}

/* Perimeter of a face; is_inverted: after h -> 1 / conj(h), which makes |a - b| / (|a| |b|) of |a - b|. A corner at 0 itself would go to
 * infinity: none counts as nearer than a tenth of the mean side. */
static double find_perimeter(const sphere_problem *p, const plane_map *h, int64_t face, bool is_inverted)
{
    const loxo_index *v = &p->m.halfedge_vertex[3 * face];
    double side[3], size[3], sum = 0.0, inverted = 0.0;
    for (int k = 0; k < 3; ++k) {
        const loxo_index a = v[k], b = v[(k + 1) % 3];
        side[k] = hypot(h->x[a] - h->x[b], h->y[a] - h->y[b]);
        sum += side[k];
    }
    for (int k = 0; k < 3; ++k)
        size[k] = fmax(hypot(h->x[v[k]], h->y[v[k]]), sum / 30.0);
    for (int k = 0; k < 3; ++k)
        inverted += side[k] / (size[k] * size[(k + 1) % 3]);
    return is_inverted ? inverted : sum;
}

static void add_coordinates(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const plane_map *h = arg;
    for (int64_t i = begin; i < end; ++i) {
        sums[0] += h->x[i];
        sums[1] += h->y[i];
    }
}

loxo_status plane_balance(const sphere_problem *p, int64_t face, plane_map *h)
{
    const int64_t n = p->m.n_vertices;
    double sums[2];
    const loxo_status status = loxo_sum(p->ctx, n, 2, add_coordinates, h, sums);
    if (status < 0) return status;
    const double mean[2] = {sums[0] / (double)n, sums[1] / (double)n};
    for (int64_t i = 0; i < n; ++i) {
        h->x[i] -= mean[0];
        h->y[i] -= mean[1];
    }
    const int64_t inner = find_nearest_face(p, h, face);
    const double scale = sqrt(find_perimeter(p, h, inner, true) / find_perimeter(p, h, face, false));
    if (!isfinite(scale) || !(scale > 0.0))
        return loxo_fail(p->ctx, LOXO_ERR_NUMERIC, "sphere: the harmonic map is flat at face %" PRId64, inner);
    for (int64_t i = 0; i < n; ++i) {
        h->x[i] *= scale;
        h->y[i] *= scale;
    }
    return LOXO_OK;
}
