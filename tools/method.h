/* SPDX-License-Identifier: MIT
 * --method auto of a command that solves: what the options that were given, the mesh and the memory leave, and what is told
 * of it. */
#ifndef LOXO_TOOLS_METHOD_H
#define LOXO_TOOLS_METHOD_H

#include "run.h"

typedef struct cli_method {
    bool is_auto;
    char because[160];        /* of the options given; "": they leave it open */
    double share_nondelaunay; /* of the mesh's edges, once it was looked at, and whether */
    bool is_intrinsic_worth;  /* an intrinsic triangulation is worth its making, by that */
} cli_method;

/* By the options: where there is no --method, those that only some methods have choose the first of these. An option that
 * changes nothing there is a warning, here or, where the method is left open, once the mesh has chosen it; options that no one method has are LOXO_ERR_ARGUMENT. */
loxo_status cli_method_by_options(cli_run *run, loxo_geodesic_settings *settings, cli_method *method);

/* By the mesh and by how many solves there will be; says what and why. is_intrinsic becomes true where that is worth its
 * making and fits into memory; a command that cannot gives NULL for intrinsic and is_intrinsic. Where a method was
 * named the mesh is only looked at. */
loxo_status cli_method_by_mesh(cli_run *run, cli_method *method, const loxo_mesh *mesh, int64_t n_solves,
                               loxo_geodesic_settings *settings, const loxo_intrinsic_settings *intrinsic,
                               bool *is_intrinsic);

/* After a solve on the mesh as it is: a row that tells of --intrinsic where that would have been worth its making, or after a
 * failed check (status) might have helped. */
void cli_method_hint(cli_run *run, const cli_method *method, loxo_geodesic_method solved_with, loxo_status status);

#endif
