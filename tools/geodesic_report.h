/* SPDX-License-Identifier: MIT
 * What loxo geodesic tells of mesh and solve. */
#ifndef LOXO_TOOLS_GEODESIC_REPORT_H
#define LOXO_TOOLS_GEODESIC_REPORT_H

#include "run.h"

void cli_report_mesh(cli_run *run, const loxo_mesh_info *info, const loxo_mesh_view *view);
/* settings: those of the check. */
void cli_report_geodesic(cli_run *run, const loxo_geodesic_info *info, const loxo_geodesic_settings *settings,
                         int64_t n_vertices);

#endif
