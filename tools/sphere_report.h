/* SPDX-License-Identifier: MIT
 * Maps to the sphere: read from files, and what was measured of them in rows and JSON. */
#ifndef LOXO_TOOLS_SPHERE_REPORT_H
#define LOXO_TOOLS_SPHERE_REPORT_H

#include "run.h"

/* Reads a map of the surface: a mesh of as many vertices, of which the positions count, or a table of points (.npy, .csv, .txt). A mesh
 * with other faces is a warning.
 *   is_normalized   points are directions of any length but 0
 *   map             [surface->n_vertices][3] out, from loxo_allocate */
loxo_status cli_read_sphere_map(cli_run *run, const char *path, const loxo_soup *surface, bool is_normalized,
                                double **map);

/* Everything under a key of the report, and rows with it: all of them, or energy and angles behind a label. */
void cli_tell_sphere_map(cli_run *run, const char *key, const char *label, bool is_short,
                         const loxo_sphere_map_measure *m);

#endif
