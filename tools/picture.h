/* SPDX-License-Identifier: MIT
 * The caller's mesh again, from the half-edges, and pictures of it. */
#ifndef LOXO_TOOLS_PICTURE_H
#define LOXO_TOOLS_PICTURE_H

#include "run.h"

/* Positions and triangles in the caller's numbering, so that they need not be kept twice while the solver works. Faces
 * come in the mesh's own order, dropped ones are gone. */
loxo_status cli_soup_of_mesh(cli_run *run, const loxo_mesh *mesh, loxo_soup *soup);

/* Draws and writes a PNG, and notes the file. */
loxo_status cli_picture(cli_run *run, const loxo_soup *soup, const double *value, const loxo_draw_settings *settings,
                        const char *path);

#endif
