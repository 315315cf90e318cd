/* SPDX-License-Identifier: MIT
 * Defaults and options table of the picture. */
#include "base/options.h"

#include <loxo/draw.h>

#include <math.h>

loxo_draw_settings loxo_draw_settings_default(void)
{
    return (loxo_draw_settings){
        .width = 1000,
        .height = 800,
        .supersample = 3,
        .colormap = LOXO_COLORMAP_VIRIDIS,
        .n_isolines = 20,
        .value_min = -INFINITY,
        .value_max = INFINITY,
        .scale_bar = true,
        .up = LOXO_DRAW_UP_Z,
        .azimuth_deg = 30.0,
        .elevation_deg = 20.0,
        .zoom = 1.0,
    };
}

static const char *const colormap_names[] = {"viridis", "cividis", "gray", NULL};
static const char *const up_names[] = {"z", "y", "x", NULL};

#define FIELD(field) .offset = offsetof(loxo_draw_settings, field)

const loxo_option loxo_draw_options[] = {
    {.name = "width", .type = LOXO_OPTION_INT, FIELD(width), .min = 16, .max = 16384, .help = "width in pixels"},
    {.name = "height", .type = LOXO_OPTION_INT, FIELD(height), .min = 16, .max = 16384, .help = "height in pixels"},
    {.name = "supersample",
     .type = LOXO_OPTION_INT,
     FIELD(supersample),
     .min = 1,
     .max = 4,
     .help = "samples a pixel along each axis"},
    {.name = "colormap",
     .type = LOXO_OPTION_CHOICE,
     FIELD(colormap),
     .choices = colormap_names,
     .help = "colours of the field: viridis, cividis or gray"},
    {.name = "isolines",
     .type = LOXO_OPTION_INT,
     FIELD(n_isolines),
     .min = 0,
     .max = 1000,
     .help = "about how many lines of equal value; 0: none"},
    {.name = "value-min",
     .type = LOXO_OPTION_DOUBLE,
     FIELD(value_min),
     .min = -INFINITY,
     .max = INFINITY,
     .help = "value at the lower end of the colours (default: the least finite one)"},
    {.name = "value-max",
     .type = LOXO_OPTION_DOUBLE,
     FIELD(value_max),
     .min = -INFINITY,
     .max = INFINITY,
     .help = "value at the upper end of the colours (default: the greatest finite one)"},
    {.name = "scale-bar", .type = LOXO_OPTION_BOOL, FIELD(scale_bar), .help = "draw the colour bar with its numbers"},
    {.name = "up",
     .type = LOXO_OPTION_CHOICE,
     FIELD(up),
     .choices = up_names,
     .help = "axis of the mesh that points up: z, y or x"},
    {.name = "azimuth",
     .type = LOXO_OPTION_DOUBLE,
     FIELD(azimuth_deg),
     .min = -360.0,
     .max = 360.0,
     .help = "camera, degrees around the up axis"},
    {.name = "elevation",
     .type = LOXO_OPTION_DOUBLE,
     FIELD(elevation_deg),
     .min = -90.0,
     .max = 90.0,
     .help = "camera, degrees above the horizon"},
    {.name = "zoom",
     .type = LOXO_OPTION_DOUBLE,
     FIELD(zoom),
     .min = 0.01,
     .max = 32.0,
     .help = "1: the mesh just fills its part of the picture"},
    {.name = NULL},
};
