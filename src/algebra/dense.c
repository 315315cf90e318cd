/* SPDX-License-Identifier: MIT
 * A few hundred unknowns, once a hierarchy. LAPACK's factor would stop at the pivots that are looked at here, and
 * threaded BLAS may add in an order that depends on the threads. */
#include "algebra/dense.h"

#include <math.h>

int64_t loxo_dense_factor(int64_t n, double *a, double tolerance)
{
    int64_t n_grounded = 0;
    for (int64_t j = 0; j < n; ++j) {
        double *row = a + j * (j + 1) / 2;
        const double before = row[j];
        double pivot = before;
        /* Row j of L: first as L D, so that one product serves both. */
        for (int64_t i = 0; i < j; ++i) {
            double sum = row[i];
            const double *other = a + i * (i + 1) / 2;
            for (int64_t k = 0; k < i; ++k)
                sum -= row[k] * other[k];
            row[i] = sum;
        }
        for (int64_t i = 0; i < j; ++i) {
            const double scaled = row[i] / a[i * (i + 1) / 2 + i];
            pivot -= row[i] * scaled;
            row[i] = scaled;
        }
        if (!(pivot > tolerance * before)) {
            pivot = HUGE_VAL;
            ++n_grounded;
        }
        row[j] = pivot;
    }
    return n_grounded;
}

void loxo_dense_solve(int64_t n, const double *factor, double *x)
{
    const double *row = factor;
    for (int64_t i = 0; i < n; row += ++i)
        for (int64_t k = 0; k < i; ++k)
            x[i] -= row[k] * x[k];
    row = factor;
    for (int64_t i = 0; i < n; row += ++i)
        x[i] /= row[i];
    for (int64_t i = n - 1; i >= 0; --i) {
        row -= i + 1;
        for (int64_t k = 0; k < i; ++k)
            x[k] -= row[k] * x[i];
    }
}
