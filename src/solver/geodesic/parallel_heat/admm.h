/* SPDX-License-Identifier: MIT
 * What both recoveries share: iterations, tests for stopping, an end asked for by the monitor. */
#ifndef LOXO_GEODESIC_PARALLEL_HEAT_ADMM_H
#define LOXO_GEODESIC_PARALLEL_HEAT_ADMM_H

#include "solver/geodesic/parallel_heat/parallel_heat_internal.h"

/* One of the two problems. Its state that neighbours read is kept twice, the iterate of number k in copy k & 1; that of
 * number 0 is where the first iteration starts. */
typedef struct admm_problem {
    parallel_heat *g;
    void *arg;
    double face_ns; /* of an iteration, a face */
    /* From iterate number `from` of faces begin..end-1 and their neighbours to the next. */
    void (*iterate)(void *arg, int64_t begin, int64_t end, int64_t from);
    /* Chains: before and after each iteration, with the number of the iterate that there is. May be NULL. */
    void (*before)(void *arg, int64_t number);
    void (*after)(void *arg, int64_t number);
    /* Residuals and objective of the iterate into info. */
    loxo_status (*test)(void *arg, int64_t number, loxo_geodesic_info *info);
} admm_problem;

/* Iterates until the tolerances are met, the iterations are used up or the monitor asks for the end; the number of
 * iterations stands in info then. */
loxo_status heat_iterate(const admm_problem *problem, loxo_geodesic_info *info);

#endif
