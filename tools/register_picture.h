/* SPDX-License-Identifier: MIT
 * A picture of a registration. */
#ifndef LOXO_TOOLS_REGISTER_PICTURE_H
#define LOXO_TOOLS_REGISTER_PICTURE_H

#include "run.h"

/* A surface as the command holds it. */
typedef struct cli_surface {
    loxo_soup soup;
    loxo_mesh *mesh;
    loxo_landmarks landmarks;
    double *map; /* [n][3] on the sphere */
} cli_surface;

/* Beside each other: the moving surface, its registered map on the sphere, the moving surface on the fixed one (position), and the fixed
 * one; each with its landmarks, a colour a curve. */
loxo_status cli_register_picture(cli_run *run, const cli_surface *fixed, const cli_surface *moving,
                                 const double *position, const loxo_draw_settings *settings, const char *path);

#endif
