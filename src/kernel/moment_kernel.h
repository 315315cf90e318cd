/* SPDX-License-Identifier: MIT
 * Moments of weighted points of the sphere as seen from a point w of the ball: with v = co (x - w) / |x - w|^2, co = 1 - |w|^2, the sums
 * of p, p v and p v v^T. The shifted atom is y = v - w, so the moments of y follow from these: y is never formed.
 * source  Cantarella, Schumacher 2022, (8), (15), example 3.1
 *
 * Eight sums run side by side, atom i in the sum i mod 8, and are added in one order: every instruction set gives the same bits. */
#ifndef LOXO_KERNEL_MOMENT_KERNEL_H
#define LOXO_KERNEL_MOMENT_KERNEL_H

#include "kernel/moments.h"

#include <stddef.h>
#include <stdint.h>

#if defined(__AVX512F__)
#define K_WIDE 8
#else
#define K_WIDE 4 /* where vectors are shorter, compilers split these well; longer ones they do not */
#endif
#define K_HALVES (8 / K_WIDE)
typedef double k_wide __attribute__((vector_size(8 * K_WIDE)));
typedef int64_t k_wide_bits __attribute__((vector_size(8 * K_WIDE)));
typedef double k_wide_anywhere __attribute__((vector_size(8 * K_WIDE), aligned(8), may_alias));

/* A macro: functions that return vectors have no agreed way to do so on every processor. */
#define K_WIDE_LOAD(p) (*(const k_wide_anywhere *)(const void *)(p))
/* mask is all ones or all zeros a lane */
#define K_WIDE_CHOOSE(mask, a, b) ((k_wide)(((mask) & (k_wide_bits)(a)) | (~(mask) & (k_wide_bits)(b))))

/* Coordinates of K_WIDE atoms, which stand one behind the other. */
static inline void k_load_atoms3(const double *p, k_wide *x, k_wide *y, k_wide *z)
{
    const k_wide a = K_WIDE_LOAD(p), b = K_WIDE_LOAD(p + K_WIDE), c = K_WIDE_LOAD(p + K_WIDE + K_WIDE);
#if K_WIDE == 8
    /* a: x0 y0 z0 x1 y1 z1 x2 y2  b: z2 x3 y3 z3 x4 y4 z4 x5  c: y5 z5 x6 y6 z6 x7 y7 z7 */
    *x =
        __builtin_shufflevector(__builtin_shufflevector(a, b, 0, 3, 6, 9, 12, 15, -1, -1), c, 0, 1, 2, 3, 4, 5, 10, 13);
    *y = __builtin_shufflevector(__builtin_shufflevector(a, b, 1, 4, 7, 10, 13, -1, -1, -1), c, 0, 1, 2, 3, 4, 8, 11,
                                 14);
    *z = __builtin_shufflevector(__builtin_shufflevector(a, b, 2, 5, 8, 11, 14, -1, -1, -1), c, 0, 1, 2, 3, 4, 9, 12,
                                 15);
#else
    /* a: x0 y0 z0 x1  b: y1 z1 x2 y2  c: z2 x3 y3 z3 */
    const k_wide low = __builtin_shufflevector(a, b, 0, 1, 6, 7);    /* x0 y0 x2 y2 */
    const k_wide middle = __builtin_shufflevector(a, c, 2, 3, 4, 5); /* z0 x1 z2 x3 */
    const k_wide high = __builtin_shufflevector(b, c, 0, 1, 6, 7);   /* y1 z1 y3 z3 */
    *x = __builtin_shufflevector(low, middle, 0, 5, 2, 7);
    *y = __builtin_shufflevector(low, high, 1, 4, 3, 6);
    *z = __builtin_shufflevector(middle, high, 0, 5, 2, 7);
#endif
}

static inline void k_load_atoms2(const double *p, k_wide *x, k_wide *y)
{
    const k_wide a = K_WIDE_LOAD(p), b = K_WIDE_LOAD(p + K_WIDE);
#if K_WIDE == 8
    *x = __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14);
    *y = __builtin_shufflevector(a, b, 1, 3, 5, 7, 9, 11, 13, 15);
#else
    *x = __builtin_shufflevector(a, b, 0, 2, 4, 6);
    *y = __builtin_shufflevector(a, b, 1, 3, 5, 7);
#endif
}

/* One atom, into sums k of lane `lane`; as the vectors do it. */
static inline void k_add_atom(int d, const double *x, double p, const double *w, double co, double *lanes, int lane)
{
    double e[3], square = 0.0;
    int k = 0;
    for (int i = 0; i < d; ++i) {
        e[i] = x[i] - w[i];
        square = i == 0 ? e[i] * e[i] : square + e[i] * e[i];
    }
    const double f = co / square;
    for (int i = 0; i < d; ++i)
        e[i] *= f;
    lanes[8 * k++ + lane] += p;
    for (int i = 0; i < d; ++i)
        lanes[8 * k++ + lane] += p * e[i];
    for (int i = 0; i < d; ++i)
        for (int j = i; j < d; ++j)
            lanes[8 * k++ + lane] += p * e[i] * e[j];
}

static inline double k_add_lanes(const double *s)
{
    return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
}

/* Atoms [n][3]; weight [n], NULL: 1 each. sums: p; p v; p v v^T by rows of its upper triangle. */
static inline void k_moments3(const double *atom, const double *weight, int64_t n, const double w[3], double co,
                              double sums[10])
{
    const int64_t eights = n / 8, whole = 8 * eights;
    k_wide s[10][K_HALVES];
    for (int k = 0; k < 10; ++k)
        for (int h = 0; h < K_HALVES; ++h)
            s[k][h] = (k_wide){0};
    for (int64_t i = 0; i < whole; i += 8) {
        __builtin_prefetch(atom + 3 * i + 512);
        __builtin_prefetch(atom + 3 * i + 520);
        __builtin_prefetch(atom + 3 * i + 528);
        for (int h = 0; h < K_HALVES; ++h) {
            k_wide x, y, z;
            k_load_atoms3(atom + 3 * (i + (int64_t)K_WIDE * h), &x, &y, &z);
            x -= w[0];
            y -= w[1];
            z -= w[2];
            const k_wide f = co / (x * x + y * y + z * z);
            x *= f;
            y *= f;
            z *= f;
            if (weight == NULL) {
                s[1][h] += x;
                s[2][h] += y;
                s[3][h] += z;
                s[4][h] += x * x;
                s[5][h] += x * y;
                s[6][h] += x * z;
                s[7][h] += y * y;
                s[8][h] += y * z;
                s[9][h] += z * z;
            } else {
                const k_wide p = K_WIDE_LOAD(weight + i + (int64_t)K_WIDE * h), px = p * x, py = p * y, pz = p * z;
                s[0][h] += p;
                s[1][h] += px;
                s[2][h] += py;
                s[3][h] += pz;
                s[4][h] += px * x;
                s[5][h] += px * y;
                s[6][h] += px * z;
                s[7][h] += py * y;
                s[8][h] += py * z;
                s[9][h] += pz * z;
            }
        }
    }
    double lanes[80];
    for (int k = 0; k < 10; ++k)
        for (int l = 0; l < 8; ++l)
            lanes[8 * k + l] = weight == NULL && k == 0 ? (double)eights : s[k][l / K_WIDE][l % K_WIDE];
    for (int64_t i = whole; i < n; ++i)
        k_add_atom(3, atom + 3 * i, weight == NULL ? 1.0 : weight[i], w, co, lanes, (int)(i - whole));
    for (int k = 0; k < 10; ++k)
        sums[k] = k_add_lanes(lanes + (ptrdiff_t)8 * k);
}

/* The same in the plane; sums [6]. */
static inline void k_moments2(const double *atom, const double *weight, int64_t n, const double w[2], double co,
                              double sums[6])
{
    const int64_t eights = n / 8, whole = 8 * eights;
    k_wide s[6][K_HALVES];
    for (int k = 0; k < 6; ++k)
        for (int h = 0; h < K_HALVES; ++h)
            s[k][h] = (k_wide){0};
    for (int64_t i = 0; i < whole; i += 8) {
        __builtin_prefetch(atom + 2 * i + 512);
        __builtin_prefetch(atom + 2 * i + 520);
        for (int h = 0; h < K_HALVES; ++h) {
            k_wide x, y;
            k_load_atoms2(atom + 2 * (i + (int64_t)K_WIDE * h), &x, &y);
            x -= w[0];
            y -= w[1];
            const k_wide f = co / (x * x + y * y);
            x *= f;
            y *= f;
            if (weight == NULL) {
                s[1][h] += x;
                s[2][h] += y;
                s[3][h] += x * x;
                s[4][h] += x * y;
                s[5][h] += y * y;
            } else {
                const k_wide p = K_WIDE_LOAD(weight + i + (int64_t)K_WIDE * h), px = p * x, py = p * y;
                s[0][h] += p;
                s[1][h] += px;
                s[2][h] += py;
                s[3][h] += px * x;
                s[4][h] += px * y;
                s[5][h] += py * y;
            }
        }
    }
    double lanes[48];
    for (int k = 0; k < 6; ++k)
        for (int l = 0; l < 8; ++l)
            lanes[8 * k + l] = weight == NULL && k == 0 ? (double)eights : s[k][l / K_WIDE][l % K_WIDE];
    for (int64_t i = whole; i < n; ++i)
        k_add_atom(2, atom + 2 * i, weight == NULL ? 1.0 : weight[i], w, co, lanes, (int)(i - whole));
    for (int k = 0; k < 6; ++k)
        sums[k] = k_add_lanes(lanes + (ptrdiff_t)8 * k);
}

static inline void k_look_at_atom(int d, const double *x, double p, k_first_look *look)
{
    double square = x[0] * x[0];
    for (int k = 1; k < d; ++k)
        square += x[k] * x[k];
    const double off = (square - 1.0) * (square - 1.0);
    look->off = off > look->off ? off : look->off;
    look->least = p < look->least ? p : look->least;
}

/* k_moments2, k_moments3 from the centre for unit vectors, which this looks at: there v is x, and nothing is divided. d: 2 or 3. */
static inline void k_first_moments(int d, const double *atom, const double *weight, int64_t n, double *sums,
                                   k_first_look *look)
{
    static const double centre[3] = {0.0, 0.0, 0.0};
    const int n_sums = d == 3 ? 10 : 6;
    const int64_t eights = n / 8, whole = 8 * eights;
    k_wide s[10][K_HALVES], off[K_HALVES], least[K_HALVES];
    for (int h = 0; h < K_HALVES; ++h) {
        off[h] = (k_wide){0};
        least[h] = (k_wide){0} + 1.0;
        for (int k = 0; k < n_sums; ++k)
            s[k][h] = (k_wide){0};
    }
    for (int64_t i = 0; i < whole; i += 8) {
        for (int c = 0; c < d; ++c)
            __builtin_prefetch(atom + d * i + 512 + (ptrdiff_t)8 * c);
        for (int h = 0; h < K_HALVES; ++h) {
            k_wide x[3], px[3];
            if (d == 3)
                k_load_atoms3(atom + 3 * (i + (int64_t)K_WIDE * h), &x[0], &x[1], &x[2]);
            else
                k_load_atoms2(atom + 2 * (i + (int64_t)K_WIDE * h), &x[0], &x[1]);
            k_wide square = x[0] * x[0] + x[1] * x[1];
            if (d == 3) square += x[2] * x[2];
            square = (square - 1.0) * (square - 1.0);
            off[h] = K_WIDE_CHOOSE(square > off[h], square, off[h]);
            for (int k = 0; k < d; ++k)
                px[k] = x[k];
            if (weight != NULL) {
                const k_wide p = K_WIDE_LOAD(weight + i + (int64_t)K_WIDE * h);
                least[h] = K_WIDE_CHOOSE(p < least[h], p, least[h]);
                s[0][h] += p;
                for (int k = 0; k < d; ++k)
                    px[k] = p * x[k];
            }
            for (int k = 0, at = 1 + d; k < d; ++k) {
                s[1 + k][h] += px[k];
                for (int j = k; j < d; ++j, ++at)
                    s[at][h] += px[k] * x[j];
            }
        }
    }
    double lanes[80];
    *look = (k_first_look){.off = 0.0, .least = 1.0};
    for (int l = 0; l < 8; ++l) {
        for (int k = 0; k < n_sums; ++k)
            lanes[8 * k + l] = weight == NULL && k == 0 ? (double)eights : s[k][l / K_WIDE][l % K_WIDE];
        look->off = off[l / K_WIDE][l % K_WIDE] > look->off ? off[l / K_WIDE][l % K_WIDE] : look->off;
        look->least = least[l / K_WIDE][l % K_WIDE] < look->least ? least[l / K_WIDE][l % K_WIDE] : look->least;
    }
    for (int64_t i = whole; i < n; ++i) {
        const double p = weight == NULL ? 1.0 : weight[i];
        k_look_at_atom(d, atom + d * i, p, look);
        k_add_atom(d, atom + d * i, p, centre, 1.0, lanes, (int)(i - whole));
    }
    for (int k = 0; k < n_sums; ++k)
        sums[k] = k_add_lanes(lanes + (ptrdiff_t)8 * k);
}

#endif
