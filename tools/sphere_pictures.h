/* SPDX-License-Identifier: MIT
 * Pictures of maps to the sphere: front and back with a field, and histograms. */
#ifndef LOXO_TOOLS_SPHERE_PICTURES_H
#define LOXO_TOOLS_SPHERE_PICTURES_H

#include "run.h"

/* The picture that both sides of a sphere with a scale bar fill. */
loxo_draw_settings cli_sphere_draw_default(void);

/* Draws the image of the surface from the camera and from opposite, side by side, and notes the file. settings: of both; their title is
 * replaced by what with the side.
 *   value   [n_vertices] or NULL */
loxo_status cli_sphere_picture(cli_run *run, const loxo_mesh_arrays *image, const double *value, const char *what,
                               const loxo_draw_settings *settings, const char *path);

/* Shares of corners by angle error and of faces by |mu|, side by side, and notes the file. NaN does not count.
 *   angle_error_deg   [n_faces][3]
 *   mu                [n_faces][2] */
loxo_status cli_sphere_histograms(cli_run *run, int64_t n_faces, const double *angle_error_deg, const double *mu,
                                  const loxo_sphere_map_measure *m, const char *path);

#endif
