/* SPDX-License-Identifier: MIT
 * The comparison with a reference, as loxo measure and loxo geodesic --exact both show it. */
#ifndef LOXO_TOOLS_MEASURE_ROWS_H
#define LOXO_TOOLS_MEASURE_ROWS_H

#include "run.h"

/* Reads the reference field and reports the errors of distance [n]. */
loxo_status cli_measure_against(cli_run *run, const char *path, const double *distance, int64_t n);

#endif
