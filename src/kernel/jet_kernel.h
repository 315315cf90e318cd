/* SPDX-License-Identifier: MIT
 * Distance that crosses an edge, and when it arrives at the vertex beyond; directions around a vertex. Derived in
 * src/solver/geodesic/fast/README.md.
 *
 * Along an edge of length l, x = t l from end A, the distance is known by its values and slopes at both ends. With an
 * offset sigma, the same for both, the square of the rest, q(t) = (d(t) - sigma)^2, is the cubic that meets them
 * (Hermite). Where all rays come from one point at distance sigma, q is a quadratic polynomial and the cubic is exact,
 * at any distance from that point; else it is right to fourth order in l. The vertex beyond, unfolded at (px, py),
 * hears
 *
 *     G(t) = sigma + sqrt(q(t)) + sqrt((t l - px)^2 + py^2)
 *
 * at its least. */
#ifndef LOXO_KERNEL_JET_KERNEL_H
#define LOXO_KERNEL_JET_KERNEL_H

#include <math.h>
#include <stdint.h>

/* So many are worked on side by side; several vectors, as in descent_kernel.h. */
#define K_JETS 64

/* Newton steps for the crossing, which begin where one circular front through both ends would cross. G is flat at its least:
 * what is left of t counts squared. The last step is taken in doubles, for directions where the last leg is short. */
#define K_JET_STEPS 2

typedef struct k_jet_batch {
    double base_square[K_JETS], a_square[K_JETS], b_square[K_JETS];    /* of AB, of the vertex beyond to A and to B */
    double d_a[K_JETS], d_b[K_JETS], slope_a[K_JETS], slope_b[K_JETS]; /* slopes into the edge, from A and from B */
    double sigma[K_JETS];
    /* out: G, t, the length of the last leg; what may be wrong with G; NaN: no such edge */
    double arrival[K_JETS], crossing[K_JETS], way[K_JETS], doubt[K_JETS];
} k_jet_batch;

/* Doubt in an arrival: what the cubic term of q changes it by at most, and how far q is from the parabola of one circular
 * front through both ends. The true error is of the next order, so these are taken with small factors, which were fitted
 * to 22 scans and 15 generated surfaces (src/solver/geodesic/fast/README.md). */
#define K_JET_DOUBT_CUBIC 0.0155
#define K_JET_DOUBT_FRONT 0.023
#define K_JET_DOUBT_MOST  0.1 /* of the edge */
#define K_JET_DOUBT_LEAST                                                                                              \
    1e-5 /* of the last leg: gains that are not worth going back for, corners that are rounded off */

/* Distances beyond sigma in units of l, q(t) in units of l^2, and the third vertex: at (foot, height) in units of l. */
typedef struct k_jet_edge {
    double r_a, r_b, q[4], foot, height_square, length;
} k_jet_edge;

static inline k_jet_edge k_jet_edge_of(const k_jet_batch *b, int i)
{
    const double length = sqrt(b->base_square[i]), inverse = 1.0 / length, inverse_square = inverse * inverse;
    const double x = 0.5 * (1.0 + (b->a_square[i] - b->b_square[i]) * inverse_square);
    const double h = b->a_square[i] * inverse_square - x * x;
    const double r_a = (b->d_a[i] - b->sigma[i]) * inverse, r_b = (b->d_b[i] - b->sigma[i]) * inverse;
    const double q_a = r_a * r_a, q_b = r_b * r_b;
    const double g_a = 2.0 * r_a * b->slope_a[i], g_b = -2.0 * r_b * b->slope_b[i];
    return (k_jet_edge){r_a,
                        r_b,
                        {q_a, g_a, 3.0 * (q_b - q_a) - 2.0 * g_a - g_b, g_a + g_b - 2.0 * (q_b - q_a)},
                        x,
                        h > 0.0 ? h : 0.0,
                        length};
}

/* One Newton step for G'(t) = 0, kept within the edge. The curvature that the front adds counts as far as it leaves three
 * tenths of the leg's own, which is positive: so the step always goes down. The same in both widths. */
#define K_JET_STEP(name, real, root)                                                                                   \
    static inline real name(real t, const real q[4], real foot, real height_square)                                    \
    {                                                                                                                  \
        const real square = q[0] + t * (q[1] + t * (q[2] + t * q[3])), tiny = (real)1e-12;                             \
        const real slope = q[1] + t * ((real)2.0 * q[2] + (real)3.0 * q[3] * t);                                       \
        const real bend = (real)2.0 * q[2] + (real)6.0 * q[3] * t;                                                     \
        const real inverse = (real)1.0 / root(square > tiny ? square : tiny);                                          \
        const real e = t - foot, leg_square = e * e + height_square;                                                   \
        const real leg_inverse = (real)1.0 / root(leg_square > tiny ? leg_square : tiny);                              \
        const real gradient = (real)0.5 * slope * inverse + e * leg_inverse;                                           \
        const real leg_bend = height_square * leg_inverse * leg_inverse * leg_inverse;                                 \
        const real front_bend = (real)0.5 * bend * inverse - (real)0.25 * slope * slope * inverse * inverse * inverse; \
        const real least = (real)0.3 * leg_bend + (real)1e-6, sum = leg_bend + front_bend;                             \
        const real next = t - gradient / (sum > least ? sum : least);                                                  \
        return next < (real)0.0 ? (real)0.0 : next > (real)1.0 ? (real)1.0 : next;                                     \
    }
K_JET_STEP(k_jet_step_float, float, sqrtf)
K_JET_STEP(k_jet_step_double, double, sqrt)
#undef K_JET_STEP

/* The coefficients of q need doubles, since near parallel rays they are small differences of large squares; the search
 * for t needs them at its end only. */
static inline void k_jet_arrivals(k_jet_batch *restrict b)
{
    float q[4][K_JETS], foot[K_JETS], height_square[K_JETS], t[K_JETS];
    for (int i = 0; i < K_JETS; ++i) {
        const k_jet_edge edge = k_jet_edge_of(b, i);
        const double q_b = edge.q[0] + edge.q[1] + edge.q[2] + edge.q[3];
        for (int k = 0; k < 4; ++k)
            q[k][i] = (float)edge.q[k];
        foot[i] = (float)edge.foot;
        height_square[i] = (float)edge.height_square;
        /* the point at these distances from both ends, and the line from there */
        const double x = 0.5 * (1.0 + edge.q[0] - q_b), y_square = edge.q[0] - x * x;
        const double y = sqrt(y_square > 0.0 ? y_square : 0.0), height = sqrt(edge.height_square);
        const double start = x + (edge.foot - x) * y / (y + height > 1e-12 ? y + height : 1e-12);
        t[i] = (float)(start < 0.0 ? 0.0 : start > 1.0 ? 1.0 : start);
    }
    for (int i = 0; i < K_JETS; ++i) {
        const float own[4] = {q[0][i], q[1][i], q[2][i], q[3][i]};
        float next = t[i];
        for (int step = 0; step < K_JET_STEPS; ++step)
            next = k_jet_step_float(next, own, foot[i], height_square[i]);
        t[i] = next;
    }
    for (int i = 0; i < K_JETS; ++i) {
        const k_jet_edge edge = k_jet_edge_of(b, i);
        const double s = k_jet_step_double((double)t[i], edge.q, edge.foot, edge.height_square);
        const double q_b = edge.q[0] + edge.q[1] + edge.q[2] + edge.q[3];
        const double square = edge.q[0] + s * (edge.q[1] + s * (edge.q[2] + s * edge.q[3]));
        const double circle = edge.q[0] + s * (q_b - edge.q[0]) - s * (1.0 - s);
        /* no point of the edge is nearer than the ends' distances allow */
        const double by_a = edge.r_a - s, by_b = edge.r_b - (1.0 - s), least = by_a > by_b ? by_a : by_b;
        const double root = sqrt(square > 0.0 ? square : 0.0), radius = root > least ? root : least;
        const double off = radius - sqrt(circle > 0.0 ? circle : 0.0), steep = fabs(edge.q[3]) / (radius + 1e-6);
        const double leg = sqrt((s - edge.foot) * (s - edge.foot) + edge.height_square);
        b->way[i] = edge.length * leg;
        b->crossing[i] = s;
        b->arrival[i] = b->sigma[i] + edge.length * (radius + leg);
        const double doubt = K_JET_DOUBT_CUBIC * steep + K_JET_DOUBT_FRONT * fabs(off) + K_JET_DOUBT_LEAST * leg;
        b->doubt[i] = edge.length * (doubt < K_JET_DOUBT_MOST ? doubt : K_JET_DOUBT_MOST);
    }
}

/* Corners 0..n-1 of fans of faces, laid one after the other: spoke [n + 1] in: squared lengths, out: lengths; rim [n]
 * squared lengths across corner i, between the ends of spokes i and i + 1; cosine, sine [n] out, of the corner. A corner
 * with a spoke of no length is none: angle 0. */
static inline void k_ring_corners(int64_t n, double *restrict spoke, const double *restrict rim,
                                  double *restrict cosine, double *restrict sine)
{
    for (int64_t i = 0; i <= n; ++i)
        spoke[i] = sqrt(spoke[i]);
    for (int64_t i = 0; i < n; ++i) {
        const double product = 2.0 * spoke[i] * spoke[i + 1];
        const double sum = spoke[i] * spoke[i] + spoke[i + 1] * spoke[i + 1] - rim[i];
        const double ratio = sum / (product > 0.0 ? product : 1.0);
        const double c = product > 0.0 ? (ratio > 1.0 ? 1.0 : ratio < -1.0 ? -1.0 : ratio) : 1.0;
        cosine[i] = c;
        sine[i] = sqrt(1.0 - c * c);
    }
}

#endif
