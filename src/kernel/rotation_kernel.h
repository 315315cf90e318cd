/* SPDX-License-Identifier: MIT
 * The rotation that brings points nearest to others: the R of least sum of |R p_i - t_i|^2, that is of greatest sum of t_i . R p_i.
 *
 * With the unit quaternion q of R that sum is q . N q, N linear in the entries of S = sum of p_i t_i^T; its greatest eigenvector is the
 * answer. It is what the singular value decomposition S = U D V^T gives, R = V diag(1, 1, det V U^T) U^T, and never a reflection.
 * source  Horn 1987, Closed-form solution of absolute orientation using unit quaternions */
#ifndef LOXO_KERNEL_ROTATION_KERNEL_H
#define LOXO_KERNEL_ROTATION_KERNEL_H

#include "kernel/vec3.h"

#include <string.h>

/* One rotation of Jacobi's that makes a[p][q] 0; v gathers them in its columns. */
static inline void k_jacobi_turn(double a[4][4], double v[4][4], int p, int q)
{
    if (a[p][q] == 0.0) return;
    const double theta = 0.5 * (a[q][q] - a[p][p]) / a[p][q];
    const double t = copysign(1.0, theta) / (fabs(theta) + sqrt(theta * theta + 1.0));
    const double c = 1.0 / sqrt(t * t + 1.0), s = isfinite(theta) ? t * c : 0.0;
    for (int k = 0; k < 4; ++k) {
        const double x = a[k][p], y = a[k][q];
        a[k][p] = c * x - s * y;
        a[k][q] = s * x + c * y;
    }
    for (int k = 0; k < 4; ++k) {
        const double x = a[p][k], y = a[q][k], g = v[k][p], h = v[k][q];
        a[p][k] = c * x - s * y;
        a[q][k] = s * x + c * y;
        v[k][p] = c * g - s * h;
        v[k][q] = s * g + c * h;
    }
    a[p][q] = a[q][p] = 0.0;
}

/* Eigenvalues of a symmetric matrix, on its diagonal then, and eigenvectors, the columns of v. */
static inline void k_jacobi4(double a[4][4], double v[4][4])
{
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            v[i][j] = i == j ? 1.0 : 0.0;
    for (int sweep = 0; sweep < 12; ++sweep) /* quadratic: six are enough */
        for (int p = 0; p < 3; ++p)
            for (int q = p + 1; q < 4; ++q)
                k_jacobi_turn(a, v, p, q);
}

/* s[a][b] = sum of p_a t_b; rows of r out. Where several rotations are as good, as with points on one line through the origin, the one
 * that turns least: of all greatest eigenvectors the nearest to that of no rotation. */
static inline void k_best_rotation(double s[3][3], double r[3][3])
{
    double n[4][4] = {{s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]},
                      {0.0, s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]},
                      {0.0, 0.0, s[1][1] - s[0][0] - s[2][2], s[1][2] + s[2][1]},
                      {0.0, 0.0, 0.0, s[2][2] - s[0][0] - s[1][1]}};
    double v[4][4], q[4] = {0.0, 0.0, 0.0, 0.0}, size = 0.0, most = -HUGE_VAL, square = 0.0;
    int first = 0;
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < i; ++j)
            n[i][j] = n[j][i];
    k_jacobi4(n, v);
    for (int k = 0; k < 4; ++k) {
        size = fmax(size, fabs(n[k][k]));
        if (!(n[k][k] > most)) continue;
        most = n[k][k];
        first = k;
    }
    for (int k = 0; k < 4; ++k) {
        if (!(n[k][k] >= most - 1e-12 * size)) continue;
        for (int i = 0; i < 4; ++i)
            q[i] += v[0][k] * v[i][k];
    }
    for (int i = 0; i < 4; ++i)
        square += q[i] * q[i];
    if (!(square > 1e-20)) { /* half turns only */
        square = 1.0;
        for (int i = 0; i < 4; ++i)
            q[i] = v[i][first];
    }
    const double scale = 1.0 / sqrt(square), w = scale * q[0], x = scale * q[1], y = scale * q[2], z = scale * q[3];
    const double turn[3][3] = {{w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)},
                               {2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)},
                               {2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z}};
    memcpy(r, turn, sizeof turn);
}

#endif
