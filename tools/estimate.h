/* SPDX-License-Identifier: MIT
 * What a command would take, told before it is done. An estimate runs without a limit of memory (cli_run_begin), so that it
 * is never refused for lack of what it only speaks of, and takes little. */
#ifndef LOXO_TOOLS_ESTIMATE_H
#define LOXO_TOOLS_ESTIMATE_H

#include "run.h"

/* Counts the mesh of a file and reports them; run->input is set. */
loxo_status cli_count_mesh(cli_run *run, const char *path, loxo_mesh_counts *counts);
#define CLI_ESTIMATE_FIXED ((size_t)1 << 18) /* bytes of a run that do not grow with its input */

/* The shape of an array's file, and bytes that reading it takes; run->input is set. "-" is used up. */
loxo_status cli_count_array(cli_run *run, const char *path, loxo_array *array, size_t *read_bytes);
/* Bytes of its arrays once it is read. */
size_t cli_counts_bytes(const loxo_mesh_counts *counts);
/* A part of an estimate, and then the most of it at any time against the limit, with a warning where that is less; seconds NaN where
 * nobody knows. */
void cli_estimate_part(cli_run *run, const char *what, size_t n_bytes);
void cli_estimate(cli_run *run, size_t peak_bytes, double seconds);
/* calibrate.c: seconds from file to file of a geodesic solve, by a small one that is timed now, and with the first touch
 * of peak_bytes; NaN where that fails. */
double cli_estimate_seconds(cli_run *run, const char *path, const loxo_mesh_counts *counts,
                            const loxo_mesh_settings *mesh, const loxo_geodesic_settings *geodesic, size_t peak_bytes);

/* Before a mesh is read: the counts, where the head of the file tells them at no cost worth speaking of; false where it
 * does not, or not rightly. Never fails: reading says what is wrong. */
bool cli_peek_counts(cli_run *run, const char *path, loxo_mesh_counts *counts);

#endif
