/* SPDX-License-Identifier: MIT
 * --intrinsic: the intrinsic Delaunay triangulation of a command's mesh, and what is told of it. */
#ifndef LOXO_TOOLS_INTRINSIC_H
#define LOXO_TOOLS_INTRINSIC_H

#include "run.h"

/* Makes it, and reports flips and quality before and after. Warnings and status as of loxo_mesh_create_intrinsic;
 * LOXO_NOT_CONVERGED goes into the exit code. */
loxo_status cli_make_intrinsic(cli_run *run, const loxo_mesh *surface, const loxo_intrinsic_settings *settings,
                               loxo_mesh **out);

#endif
