/* SPDX-License-Identifier: MIT
 * loxo extend with --map: the extension of a map of a triangulated sphere to the ball, at points. */
#ifndef LOXO_TOOLS_EXTEND_BALL_H
#define LOXO_TOOLS_EXTEND_BALL_H

#include "run.h"

/* The operand is the sphere, --map its image with the same faces, --at the points; tables go to -o. Files have been checked. */
loxo_status cli_extend_ball(cli_run *run, const loxo_sphere_extension_settings *settings);
/* Rows of a table and what each value is: z [n][n_z], w [n][d], 1 - |w|^2, bound, error, kind. */
loxo_status cli_write_values(cli_run *run, int64_t n, int n_z, const double *z, int d,
                             const loxo_extension_values *values);
bool cli_is_table(const char *path);
/* The arrays of values; LOXO_ERR_MEMORY. */
loxo_status cli_values_create(cli_run *run, int64_t n, int d, loxo_extension_values *values);
void cli_values_destroy(cli_run *run, loxo_extension_values *values);
/* Points of `--at`: rows of n_z coordinates, and perhaps 1 - |z|^2, which goes to *co (else NULL). */
loxo_status cli_read_places(cli_run *run, const char *path, int n_z, double **z, double **co, int64_t *n);

#endif
