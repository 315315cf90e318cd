/* SPDX-License-Identifier: MIT
 * Passes over atoms of the sphere, in memory and in cache, and the arithmetic that the processor can do at most. */
#ifndef LOXO_BENCH_MICRO_MOMENTS_H
#define LOXO_BENCH_MICRO_MOMENTS_H

#include "../bench.h"

loxo_status bench_micro_moments(bench *b);

#endif
