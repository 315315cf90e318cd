/* SPDX-License-Identifier: MIT
 * Adds the passes over sparse rows to the table of kernels. */
#ifndef LOXO_BENCH_MICRO_SPARSE_H
#define LOXO_BENCH_MICRO_SPARSE_H

#include "../bench.h"

loxo_status bench_micro_sparse(bench *b, const loxo_mesh_view *m, bench_table *table);

#endif
