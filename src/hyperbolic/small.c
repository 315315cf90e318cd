/* SPDX-License-Identifier: MIT
 * Matrices of the dimension of the space. */
#include "hyperbolic/hyperbolic.h"

#include <math.h>

#define MOST_SWEEPS 30

/* Jacobi's rotations, in cyclic order, until nothing is left beside the diagonal: small eigenvalues keep their digits as far as the matrix has them. */
void hyper_eigen(int d, double *a, double *value, double *v)
{
    for (int i = 0; i < d * d; ++i)
        v[i] = i % (d + 1) == 0 ? 1.0 : 0.0;
    for (int sweep = 0; sweep < MOST_SWEEPS; ++sweep) {
        bool is_done = true;
        for (int p = 0; p < d; ++p)
            for (int q = p + 1; q < d; ++q) {
                const double off = a[p * d + q], gap = a[q * d + q] - a[p * d + p];
                if (fabs(off) <= 1e-17 * sqrt(fabs(a[p * d + p] * a[q * d + q]))) continue;
                is_done = false;
                const double theta = gap / (2.0 * off), sign = theta < 0.0 ? -1.0 : 1.0;
                const double t = sign / (fabs(theta) + sqrt(theta * theta + 1.0)), c = 1.0 / sqrt(t * t + 1.0),
                             s = t * c;
                a[p * d + p] -= t * off;
                a[q * d + q] += t * off;
                a[p * d + q] = a[q * d + p] = 0.0;
                for (int k = 0; k < d; ++k) {
                    const double x = v[p * d + k], y = v[q * d + k];
                    v[p * d + k] = c * x - s * y;
                    v[q * d + k] = s * x + c * y;
                    if (k == p || k == q) continue;
                    const double g = a[k * d + p], h = a[k * d + q];
                    a[k * d + p] = a[p * d + k] = c * g - s * h;
                    a[k * d + q] = a[q * d + k] = s * g + c * h;
                }
            }
        if (is_done) break;
    }
    for (int i = 0; i < d; ++i)
        value[i] = a[i * d + i];
    for (int i = 0; i < d; ++i) { /* ascending */
        int least = i;
        for (int k = i + 1; k < d; ++k)
            if (value[k] < value[least]) least = k;
        if (least == i) continue;
        const double swap = value[i];
        value[i] = value[least];
        value[least] = swap;
        for (int k = 0; k < d; ++k) {
            const double x = v[i * d + k];
            v[i * d + k] = v[least * d + k];
            v[least * d + k] = x;
        }
    }
}

double hyper_certificate(double residual, double lambda)
{
    const double share = 2.0 * residual / lambda;
    return lambda > 0.0 && share < 1.0 ? -0.5 * log1p(-share) : HUGE_VAL;
}
