/* SPDX-License-Identifier: MIT
 * What the steps of one picture share: the mesh, the camera, the vertices as the camera sees them.
 *
 * Space: points are moved and scaled so that the mesh lies in the unit ball, then split along the camera's axes. The
 * screen: x to the right, y down, from the picture's upper left corner, in samples. */
#ifndef LOXO_DRAW_SCENE_H
#define LOXO_DRAW_SCENE_H

#include "base/context.h"
#include "draw/canvas.h"

#include <loxo/draw.h>

/* Screen coordinates are whole numbers of 1/256 sample: edges shared by two triangles are then exactly the same line,
 * and every sample belongs to one of them. 2^14 pixels * 4 samples * 256 * zoom 32 / 2 stays below 2^29, products of
 * two differences below 2^60. */
#define LOXO_DRAW_SUBSAMPLE      256
#define LOXO_DRAW_MAX_COORDINATE (1 << 29)

typedef struct loxo_draw_scene {
    const loxo_mesh_arrays *mesh;
    const double *value; /* may be NULL */
    const loxo_draw_settings *settings;

    double centre[3], radius;          /* of the mesh's bounding box */
    double right[3], up[3], toward[3]; /* unit vectors in the mesh's space; toward: from the mesh to the camera */
    double scale, shift[2];            /* screen = scale * tangent + shift */
    double middle_depth;               /* of the mesh, from the camera, in radii */

    int32_t (*xy)[2];     /* [n_vertices] screen */
    float *inverse_depth; /* [n_vertices] 1 / distance in front of the camera, in radii; 0: not drawn */
    uint64_t *normal;     /* [n_vertices] sums of face normals, three fields of 21 bits (normals.c) */
    bool inside_out;      /* closed, and all faces turned inward: they are drawn as if turned outward */

    loxo_draw_rectangle clip;    /* nothing of the mesh is drawn outside */
    double value_min, value_max; /* ends of the colour map */
    bool has_range;              /* some value is finite; else everything is grey */
    bool has_gaps;               /* some value is not finite */
    double isoline_step;         /* 0: none */
} loxo_draw_scene;

/* Place of a value between the ends of the map, 0 to 1 for those between; NaN when it is not finite. */
static inline double loxo_draw_place(const loxo_draw_scene *scene, double value)
{
    /* Halves: the difference of two finite values may overflow. */
    const double half_span = 0.5 * scene->value_max - 0.5 * scene->value_min;
    return (0.5 * value - 0.5 * scene->value_min) / half_span;
}

static inline void loxo_draw_point(const loxo_mesh_arrays *mesh, int64_t v, double p[3])
{
    if (mesh->position != NULL) {
        const double *x = &mesh->position[3 * v];
        p[0] = x[0], p[1] = x[1], p[2] = x[2];
    } else {
        const float *x = &mesh->position_float[3 * v];
        p[0] = (double)x[0], p[1] = (double)x[1], p[2] = (double)x[2];
    }
}

/* In the unit ball. */
static inline void loxo_draw_unit_point(const loxo_draw_scene *scene, int64_t v, double p[3])
{
    loxo_draw_point(scene->mesh, v, p);
    for (int k = 0; k < 3; ++k)
        p[k] = (p[k] - scene->centre[k]) / scene->radius;
}

static inline double loxo_draw_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void loxo_draw_cross(const double a[3], const double b[3], double c[3])
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

/* camera.c: marks the vertices that faces use (inverse_depth 1, else 0). LOXO_ERR_MALFORMED. */
loxo_status loxo_draw_mark_vertices(loxo_context *ctx, loxo_draw_scene *scene);
/* Aims the camera, fits the mesh into the rectangle (pixels) and fills xy and inverse_depth. n_drawn: how many vertices
 * there are to draw; n_nonfinite: used ones that are not finite. */
loxo_status loxo_draw_project(loxo_context *ctx, loxo_draw_scene *scene, const loxo_draw_rectangle *fit,
                              int64_t *n_drawn, int64_t *n_nonfinite);

/* normals.c: sums face normals, weighted by the corner's angle, at the vertices, and sees whether the surface is closed
 * and inside out. */
loxo_status loxo_draw_sum_normals(loxo_context *ctx, loxo_draw_scene *scene);
/* The sum at a vertex, as a unit vector; false when it vanishes. */
bool loxo_draw_vertex_normal(const loxo_draw_scene *scene, int64_t v, double normal[3]);

/* raster.c: for the rows of samples row_begin..row_end-1, what each sample sees: the float bits of the inverse depth in
 * the upper half, ~face in the lower, so that the largest number is the nearest face and, among equals, the one of the
 * lowest number; 0: nothing. visible is [row_end - row_begin][width * supersample], cleared by the caller. */
loxo_status loxo_draw_rasterise(loxo_context *ctx, const loxo_draw_scene *scene, int64_t row_begin, int64_t row_end,
                                uint64_t *visible);

#endif
