/* SPDX-License-Identifier: MIT
 * A surface and its map to the sphere, face by face. */
#ifndef LOXO_MEASURE_SPHERE_MAP_H
#define LOXO_MEASURE_SPHERE_MAP_H

#include "kernel/distortion_kernel.h"
#include "mesh/soup.h"

#include <loxo/measure.h>

typedef struct measured_map {
    const loxo_mesh_arrays *mesh;
    const double *map;
    double log_total; /* log of all image area over the surface's */
    double shift[3];  /* numbers near the means of angle errors, |mu|, |log|: sums of squares go by differences */
} measured_map;

static inline k_triangle map_source(const measured_map *m, int64_t f)
{
    double p[3][3];
    for (int k = 0; k < 3; ++k)
        loxo_arrays_position(m->mesh, m->mesh->triangle[3 * f + k], p[k]);
    return k_triangle_of(v3_load(p[0]), v3_load(p[1]), v3_load(p[2]));
}

static inline loxo_vec3 map_point(const measured_map *m, int64_t corner)
{
    return v3_load(m->map + (int64_t)3 * m->mesh->triangle[corner]);
}

static inline k_triangle map_image(const measured_map *m, int64_t f)
{
    return k_triangle_of(map_point(m, 3 * f), map_point(m, 3 * f + 1), map_point(m, 3 * f + 2));
}

/* Log of the share of the image over the share of the face; -infinity where the image has no area. */
static inline double map_area_log(const measured_map *m, const k_triangle *face, const k_triangle *image)
{
    return log(image->twice_area / face->twice_area) - m->log_total;
}

static inline double map_angle_error(const k_triangle *face, const k_triangle *image, int k)
{
    double sine, cosine;
    k_angle_error(face, image, k, &sine, &cosine);
    return atan2(sine, cosine);
}

#define DEGREES 57.295779513082320877 /* in a radian */

/* sphere_map_fields.c */
loxo_status measure_fill_fields(loxo_context *ctx, const measured_map *m, const loxo_sphere_map_fields *fields);

#endif
