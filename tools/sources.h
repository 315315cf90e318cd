/* SPDX-License-Identifier: MIT
 * Sources of a geodesic run: -s lists, --sources files, positions by --source-point and --source-points. */
#ifndef LOXO_TOOLS_SOURCES_H
#define LOXO_TOOLS_SOURCES_H

#include "run.h"

typedef struct cli_sources {
    loxo_surface_point
        *point; /* from loxo_allocate; in the order of the words: -s, --sources, --source-point, -points */
    int64_t n, capacity;
    int64_t n_vertices; /* of the mesh: the bound */
    bool at_vertices;   /* all of them */
} cli_sources;

/* The flags, for the lists of commands that take sources. */
#define CLI_SOURCE_FLAGS                                                                                               \
    {.name = "source",                                                                                                 \
     .letter = 's',                                                                                                    \
     .values = "V,..",                                                                                                 \
     .n_values = 1,                                                                                                    \
     .repeats = true,                                                                                                  \
     .help = "source vertices, from 0"},                                                                               \
        {.name = "sources",                                                                                            \
         .values = "FILE",                                                                                             \
         .n_values = 1,                                                                                                \
         .repeats = true,                                                                                              \
         .reads = true,                                                                                                \
         .help = "the same from a text file, a FreeSurfer .label, or GIFTI: nonzero, or FILE.gii:KEY"},                \
        {.name = "source-point",                                                                                       \
         .values = "X,Y,Z",                                                                                            \
         .n_values = 1,                                                                                                \
         .repeats = true,                                                                                              \
         .help = "the point of the surface nearest to a point"},                                                       \
    {                                                                                                                  \
        .name = "source-points", .values = "FILE", .n_values = 1, .repeats = true, .reads = true,                      \
        .help = "the same for each row of a .csv or .npy file"                                                         \
    }

/* Before anything is read: whether sources were named, and in words that can be numbers. */
loxo_status cli_sources_check(cli_run *run);
/* Reads the vertices of the command line, checked against sources->n_vertices. Repeats stay. */
loxo_status cli_sources_read(cli_run *run, cli_sources *sources);
/* Adds the points of the surface nearest to the positions, and says which and how far off. Tells all
 * sources to the report. */
loxo_status cli_sources_locate(cli_run *run, const loxo_mesh *mesh, cli_sources *sources);
/* Solves from all of them. */
loxo_status cli_sources_solve(cli_run *run, const cli_sources *sources, loxo_geodesic *geodesic, double *distance,
                              loxo_geodesic_info *info);
void cli_sources_destroy(cli_run *run, cli_sources *sources);

#endif
