/* SPDX-License-Identifier: MIT
 * Source vertices of a geodesic run: -s lists, --sources files, --source-point positions. */
#ifndef LOXO_TOOLS_SOURCES_H
#define LOXO_TOOLS_SOURCES_H

#include "run.h"

typedef struct cli_sources {
    loxo_index *vertex; /* from loxo_allocate */
    int64_t n, capacity;
    int64_t n_vertices; /* of the mesh: the bound */
} cli_sources;

/* Before anything is read: whether sources were named, and in words that can be numbers. */
loxo_status cli_sources_check(cli_run *run);
/* Reads the texts and files of the command line, checked against sources->n_vertices. Repeats stay. */
loxo_status cli_sources_read(cli_run *run, cli_sources *sources);
/* Adds the vertex nearest to each --source-point, among those with faces, and says which. */
loxo_status cli_sources_nearest(cli_run *run, const loxo_mesh_view *mesh, cli_sources *sources);
void cli_sources_destroy(cli_run *run, cli_sources *sources);

#endif
