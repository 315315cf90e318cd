/* SPDX-License-Identifier: MIT
 * Nodes of a quadrature on the circle as seen from a point z of the disk, and a curve's points at them. Derived in
 * src/solver/barycenter/EXTENSION.md.
 * source  Cantarella, Schumacher 2022, section 6.1 */
#ifndef LOXO_KERNEL_EXTENSION_KERNEL_H
#define LOXO_KERNEL_EXTENSION_KERNEL_H

#include <math.h>
#include <stdint.h>

#define K_NODES 16 /* are worked on side by side */

/* Poisson's kernel co / |x - z|^2 at n nodes (x, y), n a multiple of K_NODES. */
static inline void k_poisson_weights(int64_t n, const double *restrict x, const double *restrict y, const double z[2],
                                     double co, double *restrict p)
{
    for (int64_t i = 0; i < n; i += K_NODES)
        for (int l = 0; l < K_NODES; ++l) {
            const double a = x[i + l] - z[0], b = y[i + l] - z[1];
            p[i + l] = co / (a * a + b * b);
        }
}

/* atan(u), 0 <= u <= 1, to 5e-14: the polynomial of least greatest error in u^2 for atan(u) / u. */
static inline double k_atan_unit(double u)
{
    const double v = u * u;
    double p = -0.00010950133737292665;
    p = p * v + 0.0009961348991062624;
    p = p * v - 0.0042695010966784085;
    p = p * v + 0.011594726016119614;
    p = p * v - 0.02279206378279654;
    p = p * v + 0.0354478304883713;
    p = p * v - 0.047005235904944216;
    p = p * v + 0.056826465091119466;
    p = p * v - 0.06613494495894422;
    p = p * v + 0.07681984916045911;
    p = p * v - 0.0908950250900279;
    p = p * v + 0.11110983774962185;
    p = p * v - 0.14285707246678706;
    p = p * v + 0.19999999793953496;
    p = p * v - 0.33333333330931053;
    p = p * v + 0.9999999999999531;
    return p * u;
}

/* Nodes at angles psi from the direction of z, carried by the Moebius map of z; a curve of segments that are all of one length on the circle,
 * each the directions of a linear map of the plane. */
typedef struct k_moved {
    int64_t n;                   /* nodes, a multiple of K_NODES */
    const double *cosine, *sine; /* of psi / 2, cosine >= 0 */
    double beta;                 /* (1 - |z|) / (1 + |z|) */
    double direction[2];         /* z / |z| */
    double place;                /* of that among the segments, 0 to n_segments */
    double per_radian;           /* n_segments / pi: half angles to places */
    int64_t n_segments;
    const double *row; /* [n_segments][2][stride]: image of the first and of the second axis */
} k_moved;

/* Where a node lands: tan(tau / 2) = beta tan(psi / 2). */
static inline void k_move_nodes(const k_moved *m, int64_t i, double *restrict x, double *restrict y,
                                double *restrict place)
{
    const double half_pi = 1.57079632679489661923, n = (double)m->n_segments;
    for (int l = 0; l < K_NODES; ++l) {
        const double c = m->cosine[i + l], b = m->beta * m->sine[i + l], size = fabs(b);
        const double re = c * c - b * b, im = 2.0 * c * b;
        const double high = size > c ? size : c, low = size > c ? c : size;
        const double arc = k_atan_unit(low / high), half = size > c ? half_pi - arc : arc;
        const double at = m->place + (b < 0.0 ? -half : half) * m->per_radian;
        x[l] = m->direction[0] * re - m->direction[1] * im;
        y[l] = m->direction[1] * re + m->direction[0] * im;
        place[l] = at < 0.0 ? at + n : at >= n ? at - n : at;
    }
}

/* The curve at the moved nodes, unit vectors [n][d], d = 2 or 3; stride of the rows: d rounded up to 4. */
static inline void k_moved_atoms(int d, const k_moved *m, double *restrict atom)
{
    double x[K_NODES], y[K_NODES], place[K_NODES], out[3][K_NODES] = {{0.0}};
    for (int64_t i = 0; i < m->n; i += K_NODES) {
        k_move_nodes(m, i, x, y, place);
        for (int l = 0; l < K_NODES; ++l) {
            int64_t j = (int64_t)place[l];
            j = j < m->n_segments ? j : m->n_segments - 1;
            const double *row = m->row + 8 * j;
            for (int k = 0; k < d; ++k)
                out[k][l] = row[k] * x[l] + row[4 + k] * y[l];
        }
        for (int l = 0; l < K_NODES; ++l) {
            double square = out[0][l] * out[0][l];
            for (int k = 1; k < d; ++k)
                square += out[k][l] * out[k][l];
            const double inverse = 1.0 / sqrt(square);
            for (int k = 0; k < d; ++k)
                out[k][l] *= inverse;
        }
        for (int l = 0; l < K_NODES; ++l)
            for (int k = 0; k < d; ++k)
                atom[d * (i + l) + k] = out[k][l];
    }
}

#endif
