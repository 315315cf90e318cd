/* SPDX-License-Identifier: MIT
 * What a map to the sphere does, corner by corner, face by face and around each vertex. */
#include "base/allocate.h"
#include "base/context.h"
#include "measure/sphere_map.h"
#include "mesh/gather.h"

#define TWO_PI 6.283185307179586477

static void fill_faces(const measured_map *m, loxo_range r, const loxo_sphere_map_fields *to)
{
    for (int64_t f = r.begin; f < r.end; ++f) {
        const k_triangle face = map_source(m, f), image = map_image(m, f);
        const bool has_area = face.twice_area > 0.0;
        for (int k = 0; k < 3 && to->corner_angle_error_deg != NULL; ++k)
            to->corner_angle_error_deg[3 * f + k] =
                has_area ? DEGREES * map_angle_error(&face, &image, k) : (double)NAN;
        if (to->face_beltrami != NULL) {
            const k_distortion d = k_distortion_of(&face, &image);
            for (int k = 0; k < 2; ++k)
                to->face_beltrami[2 * f + k] = has_area ? d.mu[k] : (double)NAN;
        }
        if (to->face_area_log != NULL) to->face_area_log[f] = has_area ? map_area_log(m, &face, &image) : (double)NAN;
    }
}

typedef struct vertex_sums {
    const measured_map *m;
    const loxo_sphere_map_fields *to;
    int32_t *n_faces; /* [n_vertices] with area, around it */
} vertex_sums;

static void take(void *arg, int64_t begin, int64_t end, loxo_range own)
{
    const vertex_sums *s = arg;
    const loxo_sphere_map_fields *to = s->to;
    for (int64_t f = begin; f < end; ++f) {
        const loxo_index *v = &s->m->mesh->triangle[3 * f];
        if (!loxo_is_own(own, v[0]) && !loxo_is_own(own, v[1]) && !loxo_is_own(own, v[2])) continue;
        const k_triangle face = map_source(s->m, f);
        if (!(face.twice_area > 0.0)) continue;
        const k_triangle image = map_image(s->m, f);
        const double size = to->vertex_beltrami != NULL ? k_distortion_of(&face, &image).size : 0.0;
        for (int k = 0; k < 3; ++k) {
            if (!loxo_is_own(own, v[k])) continue;
            s->n_faces[v[k]] += 1;
            if (to->vertex_angle_error_deg != NULL)
                to->vertex_angle_error_deg[v[k]] += DEGREES * map_angle_error(&face, &image, k);
            if (to->vertex_beltrami != NULL) to->vertex_beltrami[v[k]] += size;
            if (to->vertex_curvature_rad != NULL)
                to->vertex_curvature_rad[v[k]] -= atan2(face.twice_area, face.along[k]);
        }
    }
}

/* Sets the sums to what they are of no face, or divides them by the number of faces. */
static void begin_or_end(const vertex_sums *s, loxo_range r, bool is_end)
{
    double *const mean[2] = {s->to->vertex_angle_error_deg, s->to->vertex_beltrami};
    double *const curvature = s->to->vertex_curvature_rad;
    for (int64_t v = r.begin; v < r.end; ++v) {
        if (!is_end) s->n_faces[v] = 0;
        const double n = s->n_faces[v] > 0 ? (double)s->n_faces[v] : (double)NAN;
        for (int k = 0; k < 2; ++k)
            if (mean[k] != NULL) mean[k][v] = is_end ? mean[k][v] / n : 0.0;
        if (curvature != NULL && !is_end) curvature[v] = TWO_PI;
        if (curvature != NULL && is_end && s->n_faces[v] == 0) curvature[v] = (double)NAN;
    }
}

static loxo_status fill_vertices(loxo_context *ctx, const measured_map *m, const loxo_sphere_map_fields *to)
{
    const int64_t n = m->mesh->n_vertices;
    vertex_sums s = {m, to, loxo_allocate(ctx, n, sizeof *s.n_faces)};
    loxo_status status = LOXO_OK;
    if (s.n_faces == NULL) return LOXO_ERR_MEMORY;
    for (int end = 0; end < 2 && status >= 0; ++end) {
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 4.0))
        begin_or_end(&s, loxo_thread_range(n), end == 1);
        if (end == 0) status = loxo_gather_faces(ctx, m->mesh, 200.0, take, &s);
    }
    loxo_release(ctx, s.n_faces);
    return status;
}

loxo_status measure_fill_fields(loxo_context *ctx, const measured_map *m, const loxo_sphere_map_fields *fields)
{
    const int64_t n_faces = m->mesh->n_faces;
    loxo_status status = LOXO_OK;
    if (loxo_stop_wanted(ctx, "measure", 0.8))
        return loxo_fail(ctx, LOXO_ERR_STOPPED, "measure: stopped by the monitor");
    if (fields->corner_angle_error_deg != NULL || fields->face_beltrami != NULL || fields->face_area_log != NULL) {
#pragma omp parallel num_threads(loxo_threads_for(ctx, n_faces, 100.0))
        fill_faces(m, loxo_thread_range(n_faces), fields);
    }
    if (fields->vertex_angle_error_deg != NULL || fields->vertex_beltrami != NULL ||
        fields->vertex_curvature_rad != NULL)
        status = fill_vertices(ctx, m, fields);
    return status;
}
