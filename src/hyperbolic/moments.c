/* SPDX-License-Identifier: MIT
 * Passes over the atoms. Blocks of 4096 are summed by kernels, and blocks pairwise: the bits depend on the atoms' order alone, and
 * rounding grows with the logarithm of their number. */
#include "base/allocate.h"
#include "hyperbolic/hyperbolic.h"
#include "kernel/ball_kernel.h"
#include "kernel/variants.h"
#include "par/range.h"

#include <string.h>

#define BLOCK       4096
#define BUFFER      1024 /* numbers: atoms that cannot be read where they lie go through here, some at a time */
#define OFF_SPHERE  1e-6
#define NEAR_SPHERE 1e-5 /* of |x|^2: the error of two steps is 1e-20 */
/* Sums of weights outside are refused: their products and quotients would leave the range of doubles. */
#define LEAST_WEIGHT 1e-290
#define MOST_WEIGHT  1e290

static int64_t count_sums(int d) { return 1 + d + (int64_t)d * (d + 1) / 2; }

static int64_t triangle(int d, int i, int j) { return (int64_t)i * d - (int64_t)i * (i - 1) / 2 + (j - i); }

/* Atoms begin..end-1 as unit vectors of doubles; of points that lie near the sphere, as nearly all do, two steps of Newton from 1 give the inverse
 * root to rounding, and no root or division is taken. */
static inline void copy_atoms_of(int d, const hyper_atoms *a, int64_t begin, int64_t end, double *x)
{
    double off = 0.0;
    for (int64_t i = 0; i < (end - begin) * d; ++i)
        x[i] = a->x != NULL ? a->x[begin * d + i] : (double)a->x_float[begin * d + i];
    if (a->is_unit) return;
    for (int64_t i = 0; i < end - begin; ++i) {
        double square = 0.0;
        for (int k = 0; k < d; ++k)
            square += x[i * d + k] * x[i * d + k];
        const double own = (square - 1.0) * (square - 1.0);
        off = off > own ? off : own;
    }
    const bool is_near = off <= NEAR_SPHERE * NEAR_SPHERE;
    for (int64_t i = 0; i < end - begin; ++i) {
        double square = 0.0, f = 1.0;
        for (int k = 0; k < d; ++k)
            square += x[i * d + k] * x[i * d + k];
        if (is_near) {
            f = 1.5 - 0.5 * square;
            f *= 1.5 - 0.5 * square * f * f;
        } else {
            f = 1.0 / sqrt(square);
        }
        for (int k = 0; k < d; ++k)
            x[i * d + k] *= f;
    }
}

static void copy_atoms(const hyper_atoms *a, int64_t begin, int64_t end, double *x)
{
    if (a->d == 3)
        copy_atoms_of(3, a, begin, end, x);
    else if (a->d == 2)
        copy_atoms_of(2, a, begin, end, x);
    else
        copy_atoms_of(a->d, a, begin, end, x);
}

/* As the kernels, any d; one lane. */
void hyper_add_moments(int d, const double *x, const double *weight, int64_t n, const double *w, double co,
                       double *sums)
{
    double *one = sums + 1, *two = one + d, v[HYPER_MOST_DIMENSIONS];
    for (int64_t i = 0; i < n; ++i, x += d) {
        const double p = weight == NULL ? 1.0 : weight[i];
        double square = 0.0, *row = two;
        for (int k = 0; k < d; ++k) {
            v[k] = x[k] - w[k];
            square += v[k] * v[k];
        }
        const double f = co / square;
        for (int k = 0; k < d; ++k)
            v[k] *= f;
        sums[0] += p;
        for (int k = 0; k < d; ++k) {
            const double pv = p * v[k];
            one[k] += pv;
            for (int j = k; j < d; ++j)
                row[j - k] += pv * v[j];
            row += d - k;
        }
    }
}

static void add(const k_variant *kernels, int d, const double *x, const double *weight, int64_t n, const double *w,
                double co, double *sums)
{
    double part[10];
    if (d > 3) {
        hyper_add_moments(d, x, weight, n, w, co, sums);
        return;
    }
    if (d == 3)
        kernels->moments3(x, weight, n, w, co, part);
    else
        kernels->moments2(x, weight, n, w, co, part);
    for (int64_t k = 0; k < count_sums(d); ++k)
        sums[k] += part[k];
}

/* Adds a block to sums, which are zero. */
static void add_block(const k_variant *kernels, const hyper_atoms *a, int64_t begin, int64_t end, const double *w,
                      double co, double *sums)
{
    const int d = a->d;
    const int64_t step = BUFFER / d;
    double buffer[BUFFER];
    if (a->x != NULL && a->is_unit) {
        add(kernels, d, a->x + begin * d, a->weight == NULL ? NULL : a->weight + begin, end - begin, w, co, sums);
        return;
    }
    for (int64_t i = begin; i < end; i += step) {
        const int64_t n = end - i < step ? end - i : step;
        copy_atoms(a, i, i + n, buffer);
        add(kernels, d, buffer, a->weight == NULL ? NULL : a->weight + i, n, w, co, sums);
    }
}

/* Sums of blocks to sums of all, in the first. */
static void add_pairwise(double *sums, int64_t n_blocks, int64_t n_sums)
{
    for (int64_t stride = 1; stride < n_blocks; stride *= 2)
        for (int64_t b = 0; b + stride < n_blocks; b += 2 * stride)
            for (int64_t k = 0; k < n_sums; ++k)
                sums[b * n_sums + k] += sums[(b + stride) * n_sums + k];
}

/* y = v - w: their moments from those of v. */
static void move_to_origin(int d, const double *w, const double *sums, hyper_moments *out)
{
    const double inverse = 1.0 / sums[0], *one = sums + 1, *two = one + d;
    out->weight = sums[0];
    for (int i = 0; i < d; ++i)
        out->mean[i] = one[i] * inverse - w[i];
    for (int i = 0; i < d; ++i)
        for (int j = i; j < d; ++j) {
            const int64_t k = triangle(d, i, j);
            out->second[k] = two[k] * inverse - out->mean[i] * w[j] - w[i] * out->mean[j] - w[i] * w[j];
        }
}

loxo_status hyper_find_moments(loxo_context *ctx, const hyper_atoms *atoms, const double *w, double co,
                               hyper_moments *out)
{
    const int64_t n_sums = count_sums(atoms->d), n_blocks = (atoms->n + BLOCK - 1) / BLOCK;
    const k_variant *kernels = k_variant_get(loxo_context_isa(ctx));
    double *sums = loxo_allocate_zero(ctx, n_blocks * n_sums, sizeof *sums);
    if (sums == NULL) return LOXO_ERR_MEMORY;
#pragma omp parallel num_threads(loxo_threads_for(ctx, atoms->n, 0.6 * atoms->d))
    {
        const loxo_range r = loxo_thread_range(n_blocks);
        for (int64_t b = r.begin; b < r.end; ++b)
            add_block(kernels, atoms, b * BLOCK, (b + 1) * BLOCK < atoms->n ? (b + 1) * BLOCK : atoms->n, w, co,
                      sums + b * n_sums);
    }
    add_pairwise(sums, n_blocks, n_sums);
    move_to_origin(atoms->d, w, sums, out);
    loxo_release(ctx, sums);
    return LOXO_OK;
}

void hyper_shift_atoms(loxo_context *ctx, const hyper_atoms *atoms, const double *w, double co, double *y)
{
    const int d = atoms->d;
#pragma omp parallel num_threads(loxo_threads_for(ctx, atoms->n, 2.0 * d))
    {
        const loxo_range r = loxo_thread_range(atoms->n);
        double x[HYPER_MOST_DIMENSIONS];
        for (int64_t i = r.begin; i < r.end; ++i) {
            copy_atoms(atoms, i, i + 1, x);
            k_ball_shift(d, w, co, x, y + i * d);
        }
    }
}

typedef struct finding {
    int64_t atom; /* the first that is wrong, -1: none */
    bool is_unit;
    double weight;
} finding;

static finding look(const hyper_atoms *a, int64_t begin, int64_t end)
{
    const int d = a->d;
    finding f = {-1, a->x != NULL, 0.0};
    for (int64_t i = begin; i < end; ++i) {
        double square = 0.0;
        for (int k = 0; k < d; ++k) {
            const double x = a->x != NULL ? a->x[i * d + k] : (double)a->x_float[i * d + k];
            square += x * x;
        }
        const double p = a->weight == NULL ? 1.0 : a->weight[i], off = fabs(square - 1.0);
        if (!(off <= 2.0 * OFF_SPHERE) || !(p >= 0.0 && p < HUGE_VAL)) {
            f.atom = i;
            return f;
        }
        f.is_unit = f.is_unit && off <= 8e-16;
        f.weight += p;
    }
    return f;
}

loxo_status hyper_check_atoms(loxo_context *ctx, const char *who, hyper_atoms *atoms)
{
    int64_t wrong = INT64_MAX;
    double weight = 0.0;
    bool is_unit = true;
#pragma omp parallel num_threads(loxo_threads_for(ctx, atoms->n, 0.6 * atoms->d)) reduction(min : wrong) reduction(+ : weight) reduction(&& : is_unit)
    {
        const loxo_range r = loxo_thread_range(atoms->n);
        const finding f = look(atoms, r.begin, r.end);
        if (f.atom >= 0) wrong = f.atom;
        weight += f.weight; /* only whether there is any */
        is_unit = is_unit && f.is_unit;
    }
    if (wrong < INT64_MAX)
        return loxo_fail_at(
            ctx, LOXO_ERR_ARGUMENT, (loxo_place){.byte = -1, .element = wrong},
            "%s: atom %lld is not a point of the sphere (within 1e-6), or its weight is negative or not finite", who,
            (long long)wrong);
    if (!(weight > LEAST_WEIGHT) || !(weight < MOST_WEIGHT))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "%s: the atoms' weights add up to %g, not to something in %g to %g",
                         who, weight, LEAST_WEIGHT, MOST_WEIGHT);
    atoms->is_unit = is_unit;
    return LOXO_OK;
}
