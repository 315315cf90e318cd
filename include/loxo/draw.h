/* SPDX-License-Identifier: MIT
 * Picture of a mesh with a field on it, as PNG, without a display. */
#ifndef LOXO_DRAW_H
#define LOXO_DRAW_H

#include <loxo/mesh.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum loxo_colormap { LOXO_COLORMAP_VIRIDIS, LOXO_COLORMAP_CIVIDIS, LOXO_COLORMAP_GRAY } loxo_colormap;

typedef struct loxo_draw_settings {
    int width, height; /* pixels, 16 to 16384 */
    int supersample;   /* samples a pixel along each axis, 1 to 4 */
    loxo_colormap colormap;
    int n_isolines;                    /* about how many; steps are 1, 2 or 5 times a power of ten; 0: none */
    double value_min, value_max;       /* NaN: of the finite values */
    bool scale_bar;                    /* colour bar with numbers */
    double azimuth_deg, elevation_deg; /* camera on a sphere around the mesh, z up; both 0 looks along -x from +x */
    double zoom;                       /* 1: the bounding sphere fills the picture */
    const char *title;                 /* ASCII, may be NULL */
    const char *unit;                  /* beside the scale bar, may be NULL */
} loxo_draw_settings;

LOXO_API loxo_draw_settings loxo_draw_settings_default(void);

/* Draws into rgb, [height][width][3]. value [n_vertices] may be NULL (plain shading); not finite: grey. */
LOXO_API loxo_status loxo_draw(loxo_context *ctx, const loxo_mesh_arrays *mesh, const double *value,
                               const loxo_draw_settings *settings, uint8_t *rgb);
/* Draws and writes a PNG, atomically. LOXO_ERR_UNSUPPORTED where libpng is off. */
LOXO_API loxo_status loxo_draw_png(loxo_context *ctx, const loxo_mesh_arrays *mesh, const double *value,
                                   const loxo_draw_settings *settings, const char *path);

#ifdef __cplusplus
}
#endif
#endif
