/* SPDX-License-Identifier: MIT
 * Picture of a mesh with a field on it, as PNG, without a display. */
#ifndef LOXO_DRAW_H
#define LOXO_DRAW_H

#include <loxo/mesh.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum loxo_colormap { LOXO_COLORMAP_VIRIDIS, LOXO_COLORMAP_CIVIDIS, LOXO_COLORMAP_GRAY } loxo_colormap;

/* The axis of the mesh that points up in the picture. Scans of objects are often y up, brains and buildings z up. */
typedef enum loxo_draw_up { LOXO_DRAW_UP_Z, LOXO_DRAW_UP_Y, LOXO_DRAW_UP_X } loxo_draw_up;

typedef struct loxo_draw_settings {
    int width, height; /* pixels, 16 to 16384 */
    int supersample;   /* samples a pixel along each axis, 1 to 4 */
    loxo_colormap colormap;
    int n_isolines;              /* about how many; steps are 1, 2 or 5 times a power of ten; 0: none */
    double value_min, value_max; /* ends of the colour map; -infinity, +infinity: those of the finite values */
    bool scale_bar;              /* colour bar with numbers; only when there is a field */
    loxo_draw_up up;
    double azimuth_deg, elevation_deg; /* camera on a sphere around the mesh; z up, both 0: looks along -x from +x */
    double zoom;                       /* 1: the mesh just fills its part of the picture; 0.01 to 32 */
    const char *title;                 /* over the picture; ASCII, may be NULL */
    const char *unit;                  /* over the scale bar; ASCII, may be NULL */
} loxo_draw_settings;

LOXO_API loxo_draw_settings loxo_draw_settings_default(void);

/* Draws into rgb.
 *   mesh     any triangles: open, non-manifold, of any size; inner sides of open surfaces are drawn darker. Faces with
 *            a vertex that is not finite are left out, with a counted warning; a mesh without faces gives an empty
 *            picture, with a warning
 *   value    [n_vertices], or NULL for plain shading; faces with a corner that is not finite are grey
 *   rgb      [height][width][3] out, sRGB, rows from the top; its content is undefined when the call fails
 * returns    LOXO_OK; LOXO_ERR_ARGUMENT; LOXO_ERR_MALFORMED (a vertex number out of range: element is the face);
 *            LOXO_ERR_LIMIT; LOXO_ERR_MEMORY; LOXO_ERR_STOPPED
 * cost       linear time; 20 bytes a vertex, at most 530 MiB for the picture; same bits for any thread count */
LOXO_API loxo_status loxo_draw(loxo_context *ctx, const loxo_mesh_arrays *mesh, const double *value,
                               const loxo_draw_settings *settings, uint8_t *rgb);
/* Draws and writes a PNG, atomically; path "-" is standard output. Beside the statuses of loxo_draw: LOXO_ERR_WRITE;
 * LOXO_ERR_UNSUPPORTED where libpng is off, before any work. */
LOXO_API loxo_status loxo_draw_png(loxo_context *ctx, const loxo_mesh_arrays *mesh, const double *value,
                                   const loxo_draw_settings *settings, const char *path);

#ifdef __cplusplus
}
#endif
#endif
