/* SPDX-License-Identifier: MIT
 * Random directions in space, for what is measured of barycenters. */
#ifndef LOXO_BENCH_DIRECTIONS_H
#define LOXO_BENCH_DIRECTIONS_H

#include <stdint.h>

/* Directions number first .. first + n - 1 of a seed. kappa 0: uniform; else by von Mises and Fisher's density, proportional to
 * exp(kappa z), around the pole. x [n][3] out. */
void bench_directions(uint64_t seed, double kappa, int64_t first, int64_t n, double *x);
/* The same by so many threads. */
void bench_directions_many(int n_threads, uint64_t seed, double kappa, int64_t n, double *x);

#endif
