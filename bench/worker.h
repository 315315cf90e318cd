/* SPDX-License-Identifier: MIT
 * Tasks of the child processes; what they take and print is said at bench_worker_run. */
#ifndef LOXO_BENCH_WORKER_H
#define LOXO_BENCH_WORKER_H

#include "bench.h"

/* Prints the object, which it takes over, on one line. */
loxo_status bench_print_json(bench *b, json_t *object);
/* The mesh takes over the arrays of the soup. */
loxo_status bench_mesh_of(bench *b, loxo_soup *soup, const loxo_mesh_settings *settings, loxo_mesh_info *info,
                          loxo_mesh **mesh);

loxo_status bench_task_generate(bench *b, char **argv);
loxo_status bench_task_subdivide(bench *b, char **argv);
loxo_status bench_task_shuffle(bench *b, char **argv);
loxo_status bench_task_closed_form(bench *b, char **argv);
loxo_status bench_task_build(bench *b, char **argv);
loxo_status bench_task_order(bench *b, char **argv);
loxo_status bench_task_search(bench *b, char **argv);
loxo_status bench_task_laplace(bench *b, char **argv);

#endif
