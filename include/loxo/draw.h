/* SPDX-License-Identifier: MIT
 * Picture of a mesh with a field on it, and plots of numbers, as PNG, without a display. */
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

/* Writes any picture rgb [height][width][3], sRGB, rows from the top, as a PNG, atomically: several views or plots beside each other,
 * too. LOXO_OK; LOXO_ERR_ARGUMENT (NULL, no pixels, more than 16384 a side); LOXO_ERR_MEMORY; LOXO_ERR_WRITE; LOXO_ERR_UNSUPPORTED. */
LOXO_API loxo_status loxo_picture_write(loxo_context *ctx, const char *path, const uint8_t *rgb, int width, int height);

/* ---- plots --------------------------------------------------------------------------------------------------- */

typedef enum loxo_plot_scale { LOXO_PLOT_LINEAR, LOXO_PLOT_LOG } loxo_plot_scale;

typedef enum loxo_plot_style {
    LOXO_PLOT_LINE,    /* low and high: a band around it */
    LOXO_PLOT_POINTS,  /* low and high: error bars */
    LOXO_PLOT_BOTH,    /* a line with its points; low and high: error bars */
    LOXO_PLOT_COLUMNS, /* a column at each x, 0.7 wide; low: where it starts, so that columns can be stacked */
    LOXO_PLOT_BARS,    /* of a histogram: a bar from each x to the next; the last x only ends the one before */
} loxo_plot_style;

typedef struct loxo_plot_series {
    const char *name; /* in the legend; ASCII; NULL or "": not in it */
    loxo_plot_style style;
    bool is_dashed;
    int color; /* 0: by its place among the series; k >= 1: colour and mark k; from 9 on, colours come again with other marks */
    int64_t n;
    const double *x, *y;      /* [n]; where one is not finite the line is broken */
    const double *low, *high; /* [n] ends of the range around y; may be NULL */
} loxo_plot_series;

typedef struct loxo_plot {
    int width, height;                     /* pixels, 64 to 16384 */
    const char *title, *x_title, *y_title; /* ASCII, may be NULL; an axis' title with its unit */
    loxo_plot_scale x_scale, y_scale;
    double x_min, x_max, y_min, y_max; /* NaN: from the data */
    int n_x_names;
    const char *const *x_names; /* [n_x_names] stand under x = 0, 1, 2, ... in place of numbers; ASCII */
    int n_series;
    const loxo_plot_series *series;
} loxo_plot;

LOXO_API loxo_plot loxo_plot_default(void); /* 1200 x 800, linear, nothing in it */

/* Draws a plot into rgb [height][width][3], sRGB, rows from the top. Colours can be told apart by colour-blind readers, and
 * every series has its own mark.
 * returns  LOXO_OK (points that are not positive are left out of logarithmic axes, with a counted warning);
 *          LOXO_ERR_ARGUMENT: rgb is untouched
 * cost     linear in pixels and points; allocates nothing */
LOXO_API loxo_status loxo_plot_draw(loxo_context *ctx, const loxo_plot *plot, uint8_t *rgb);
/* Draws and writes a PNG, atomically; path "-" is standard output. LOXO_ERR_ARGUMENT, LOXO_ERR_MEMORY, LOXO_ERR_WRITE;
 * LOXO_ERR_UNSUPPORTED where libpng is off. */
LOXO_API loxo_status loxo_plot_png(loxo_context *ctx, const loxo_plot *plot, const char *path);

#ifdef __cplusplus
}
#endif
#endif
