/* SPDX-License-Identifier: MIT
 * What is asked of distances once they are there: nearest sources, isolines, paths, matrices. */
#ifndef LOXO_TOOLS_QUERIES_H
#define LOXO_TOOLS_QUERIES_H

#include "sources.h"

typedef struct cli_queries {
    const char *nearest_path, *lines_path, *path_path, *matrix_path; /* files; NULL: not asked */
    double *nearest;                                                 /* [n_vertices] */
    double *matrix;                                                  /* [n_matrix][n_matrix] */
    int64_t n_matrix;
    bool is_matrix_there; /* it was filled */
    double *level;        /* [n_levels] of --level, or evenly spaced ones */
    int64_t n_levels;
    loxo_surface_point *target; /* [n_targets] of --path */
    int64_t n_targets;
    loxo_polylines isolines, paths;
} cli_queries;

#define CLI_QUERY_FLAGS                                                                                                \
    {.name = "nearest-output",                                                                                         \
     .values = "FILE",                                                                                                 \
     .n_values = 1,                                                                                                    \
     .help = "which source is nearest, from 0 in their order, -1: none: .npy .csv .shape.gii"},                        \
        {.name = "lines-output",                                                                                       \
         .values = "FILE",                                                                                             \
         .n_values = 1,                                                                                                \
         .help = "lines of equal distance: .obj .vtp .csv; at --level, or ten of them"},                               \
        {.name = "level", .values = "D,..", .n_values = 1, .repeats = true, .help = "distances of the lines"},         \
        {.name = "path",                                                                                               \
         .values = "V|X,Y,Z",                                                                                          \
         .n_values = 1,                                                                                                \
         .repeats = true,                                                                                              \
         .help = "the way from a vertex, or the point nearest to a position, to its source"},                          \
        {.name = "path-output", .values = "FILE", .n_values = 1, .help = "the ways as lines: .obj .vtp .csv"},         \
    {                                                                                                                  \
        .name = "matrix", .values = "FILE", .n_values = 1,                                                             \
        .help = "distances between all sources, a solve each: .npy .csv; row i is from source i"                       \
    }

/* Before anything is read: whether words and files can be what they must; announces the files. */
loxo_status cli_queries_check(cli_run *run, cli_queries *queries);
/* Before the solve: lists the levels, finds the targets of --path, takes the room for the matrix. */
loxo_status cli_queries_prepare(cli_run *run, const loxo_mesh *surface, const cli_sources *sources,
                                cli_queries *queries);
/* Whether anything is asked that is written or told. */
bool cli_queries_any(const cli_run *run);
/* After a solve: finds what is asked and tells it. surface: the mesh itself, where the solver has an intrinsic
 * triangulation of it. */
loxo_status cli_queries_ask(cli_run *run, loxo_geodesic *geodesic, const loxo_mesh *surface, const cli_sources *sources,
                            const double *distance, double farthest, cli_queries *queries);
/* What was found; after a solve that was stopped that is nothing. */
loxo_status cli_queries_write(cli_run *run, const loxo_mesh *surface, const cli_queries *queries);
void cli_queries_destroy(cli_run *run, cli_queries *queries);

#endif
