/* SPDX-License-Identifier: MIT
 * Random directions in space: the height z is drawn by inverting its distribution, the angle is uniform.
 * source  Archimedes for kappa = 0; for other kappa P(height <= z) = (e^(kappa z) - e^-kappa) / (e^kappa - e^-kappa), solved for z */
#include "directions.h"

#include "base/rng.h"

#include <math.h>
#include <omp.h>

void bench_directions(uint64_t seed, double kappa, int64_t first, int64_t n, double *x)
{
    const double two_pi = 6.283185307179586;
    for (int64_t i = 0; i < n; ++i) {
        const uint64_t k = 2 * (uint64_t)(first + i);
        const double u = loxo_random_unit(seed, k), angle = two_pi * loxo_random_unit(seed, k + 1);
        const double z = kappa > 0.0 ? 1.0 + log(u + (1.0 - u) * exp(-2.0 * kappa)) / kappa : 2.0 * u - 1.0;
        const double r = sqrt(fmax(0.0, (1.0 - z) * (1.0 + z)));
        x[3 * i] = r * cos(angle);
        x[3 * i + 1] = r * sin(angle);
        x[3 * i + 2] = z;
    }
}

void bench_directions_many(int n_threads, uint64_t seed, double kappa, int64_t n, double *x)
{
#pragma omp parallel num_threads(n_threads)
    {
        const int64_t i = omp_get_thread_num(), of = omp_get_num_threads();
        const int64_t begin = n / of * i + n % of * i / of, end = n / of * (i + 1) + n % of * (i + 1) / of;
        bench_directions(seed, kappa, begin, end - begin, x + 3 * begin);
    }
}
