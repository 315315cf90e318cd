/* SPDX-License-Identifier: MIT
 * Points of the open unit ball as points of hyperbolic space (Poincare's ball, curvature -1): shifts, composition, distance.
 * A point near the sphere is kept as its coordinates and co = 1 - |w|^2, which they have lost.
 * source  Cantarella, Schumacher 2022, Computing the conformal barycenter, section 2 */
#ifndef LOXO_KERNEL_BALL_KERNEL_H
#define LOXO_KERNEL_BALL_KERNEL_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

static inline double k_ball_dot(int d, const double *a, const double *b)
{
    double sum = 0.0;
    for (int i = 0; i < d; ++i)
        sum += a[i] * b[i];
    return sum;
}

/* sigma_w(x) of a point x of the sphere, (8) by differences: y = co (x - w) / |x - w|^2 - w. Loses eps / (1 - |w|) of y, where the form in print
 * loses its square. The result is put back on the sphere. y may be x. */
static inline void k_ball_shift(int d, const double *w, double co, const double *x, double *y)
{
    double square = 0.0, norm = 0.0;
    for (int i = 0; i < d; ++i) {
        const double e = x[i] - w[i];
        square += e * e;
    }
    const double f = co / square;
    for (int i = 0; i < d; ++i) {
        y[i] = f * (x[i] - w[i]) - w[i];
        norm += y[i] * y[i];
    }
    const double inverse = 1.0 / sqrt(norm);
    for (int i = 0; i < d; ++i)
        y[i] *= inverse;
}

/* The same for n points of space [n][3], one shift after the other; to the same bits. y may be x. */
static inline void k_ball_shifts3(int n_shifts, const double (*w)[3], const double *co, int64_t n, const double *x,
                                  double *y)
{
    enum { SIDE_BY_SIDE = 16 };
    for (int64_t begin = 0; begin < n; begin += SIDE_BY_SIDE) {
        const int64_t rest = n - begin, here = rest < SIDE_BY_SIDE ? rest : SIDE_BY_SIDE;
        double p[3][SIDE_BY_SIDE] = {{0.0}};
        for (int64_t l = 0; l < here; ++l)
            for (int k = 0; k < 3; ++k)
                p[k][l] = x[3 * (begin + l) + k];
        for (int s = 0; s < n_shifts; ++s)
            for (int l = 0; l < SIDE_BY_SIDE; ++l) {
                const double a = p[0][l] - w[s][0], b = p[1][l] - w[s][1], c = p[2][l] - w[s][2];
                const double f = co[s] / (a * a + b * b + c * c);
                const double u = f * a - w[s][0], v = f * b - w[s][1], t = f * c - w[s][2];
                const double inverse = 1.0 / sqrt(u * u + v * v + t * t);
                p[0][l] = u * inverse;
                p[1][l] = v * inverse;
                p[2][l] = t * inverse;
            }
        for (int64_t l = 0; l < here; ++l)
            for (int k = 0; k < 3; ++k)
                y[3 * (begin + l) + k] = p[k][l];
    }
}

/* sigma_(-w)(z), (6): the point that is z as seen from w. With a = |w + z|^2 + co_w it is (a w + co_w z) / (|w + z|^2 + co_w co_z), and its co
 * is co_w co_z over the same: nothing is lost near the sphere. out may be w or z; returns its co. */
static inline double k_ball_compose(int d, const double *w, double co_w, const double *z, double co_z, double *out)
{
    double square = 0.0;
    for (int i = 0; i < d; ++i)
        square += (w[i] + z[i]) * (w[i] + z[i]);
    const double inverse = 1.0 / (square + co_w * co_z);
    for (int i = 0; i < d; ++i)
        out[i] = ((square + co_w) * w[i] + co_w * z[i]) * inverse;
    return co_w * co_z * inverse;
}

/* 1 - |w| */
static inline double k_ball_gap(double co) { return co / (1.0 + sqrt(co < 1.0 ? 1.0 - co : 0.0)); }

/* Distance from the centre, 2 artanh |w|. */
static inline double k_ball_radius(double co)
{
    const double r = sqrt(co < 1.0 ? 1.0 - co : 0.0);
    return co > 0.5 ? 2.0 * atanh(r) : 2.0 * log1p(r) - log(co);
}

/* Whether a given 1 - |z|^2 is that of the coordinates, `own`, but for what |z|^2 of doubles may tell differently. */
#define K_BALL_SAME_CO 1e-6
static inline bool k_ball_is_co(double own, double given)
{
    return given >= 0.0 && fabs(own - given) <= K_BALL_SAME_CO * given + 1e-14;
}

#endif
