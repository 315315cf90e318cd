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
#define UNIT        8e-16 /* |x|^2 - 1 of rounding */
#define NEAR_SPHERE 1e-5  /* of |x|^2: the error of two steps is 1e-20 */
/* Sums of weights outside are refused: their products and quotients would leave the range of doubles. */
#define LEAST_WEIGHT 1e-290
#define MOST_WEIGHT  1e290

static int64_t count_sums(int d) { return 1 + d + (int64_t)d * (d + 1) / 2; }

static int64_t triangle(int d, int i, int j) { return (int64_t)i * d - (int64_t)i * (i - 1) / 2 + (j - i); }

/* n atoms from begin on as unit vectors of doubles; of points that lie near the sphere, as nearly all do, two steps of Newton from 1 give the inverse
 * root to rounding, and no root or division is taken. */
static inline void copy_atoms_of(int d, const hyper_atoms *a, int64_t begin, int64_t n, double *x)
{
    double off = 0.0;
    for (int64_t i = 0; i < n; ++i)
        for (int k = 0; k < d; ++k)
            x[i * d + k] = a->x != NULL ? a->x[(begin + i) * d + k] : (double)a->x_float[(begin + i) * d + k];
    if (a->is_unit) return;
    for (int64_t i = 0; i < n; ++i) {
        double square = 0.0;
        for (int k = 0; k < d; ++k)
            square += x[i * d + k] * x[i * d + k];
        const double own = (square - 1.0) * (square - 1.0);
        off = off > own ? off : own;
    }
    const bool is_near = off <= NEAR_SPHERE * NEAR_SPHERE;
    for (int64_t i = 0; i < n; ++i) {
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

static void copy_atoms(const hyper_atoms *a, int64_t begin, int64_t n, double *x)
{
    if (a->d == 3)
        copy_atoms_of(3, a, begin, n, x);
    else if (a->d == 2)
        copy_atoms_of(2, a, begin, n, x);
    else
        copy_atoms_of(a->d, a, begin, n, x);
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
        copy_atoms(a, i, n, buffer);
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
            copy_atoms(atoms, i, 1, x);
            k_ball_shift(d, w, co, x, y + i * d);
        }
    }
}

typedef struct finding {
    int64_t atom; /* the first that is wrong, -1: none */
    bool is_unit;
} finding;

static finding scan(const hyper_atoms *a, int64_t begin, int64_t end)
{
    const int d = a->d;
    finding f = {-1, a->x != NULL};
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
        f.is_unit = f.is_unit && off <= UNIT;
    }
    return f;
}

/* A block of unit vectors in doubles, in the plane or in space, that is checked on the way; false: it is none. */
static bool look_at_units(const k_variant *kernels, const hyper_atoms *a, int64_t begin, int64_t end, double *sums)
{
    k_first_look look;
    double total = 0.0;
    if (a->x == NULL || a->d > 3) return false;
    kernels->first_moments(a->d, a->x + begin * a->d, a->weight == NULL ? NULL : a->weight + begin, end - begin, sums,
                           &look);
    for (int64_t k = 0; k < count_sums(a->d); ++k)
        total += fabs(sums[k]);
    return total < HUGE_VAL && look.off <= UNIT * UNIT && look.least >= 0.0;
}

/* A block, checked; its sums as seen from the centre. expects_units: what is tried first; it changes no bit. Unit vectors are then passed once, others
 * a second time in the cache. */
static finding look_first(const k_variant *kernels, const hyper_atoms *a, int64_t begin, int64_t end,
                          bool expects_units, double *sums)
{
    static const double centre[HYPER_MOST_DIMENSIONS];
    if (expects_units && look_at_units(kernels, a, begin, end, sums)) return (finding){-1, true};
    const finding f = scan(a, begin, end);
    if (f.atom >= 0) return f;
    if (f.is_unit && !expects_units && look_at_units(kernels, a, begin, end, sums)) return f;
    hyper_atoms own = *a;
    own.is_unit = f.is_unit;
    memset(sums, 0, (size_t)count_sums(a->d) * sizeof *sums);
    add_block(kernels, &own, begin, end, centre, 1.0, sums);
    return f;
}

static loxo_status refuse(loxo_context *ctx, const char *who, const hyper_atoms *a, int64_t i)
{
    const loxo_place place = {.byte = -1, .element = i};
    if (a->weight != NULL && !(a->weight[i] >= 0.0 && a->weight[i] < HUGE_VAL))
        return loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, place, "%s: the weight of atom %lld is %g", who, (long long)i,
                            a->weight[i]);
    return loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, place, "%s: atom %lld is not a point of the sphere (within 1e-6)", who,
                        (long long)i);
}

loxo_status hyper_check_atoms(loxo_context *ctx, const char *who, hyper_atoms *atoms, hyper_moments *first)
{
    static const double centre[HYPER_MOST_DIMENSIONS];
    const int64_t n_sums = count_sums(atoms->d), n_blocks = (atoms->n + BLOCK - 1) / BLOCK;
    const k_variant *kernels = k_variant_get(loxo_context_isa(ctx));
    int64_t wrong = INT64_MAX;
    bool is_unit = true;
    double *sums = loxo_allocate_zero(ctx, n_blocks * n_sums, sizeof *sums);
    if (sums == NULL) return LOXO_ERR_MEMORY;
#pragma omp parallel num_threads(loxo_threads_for(ctx, atoms->n, 0.6 * atoms->d)) reduction(min : wrong) reduction(&& : is_unit)
    {
        const loxo_range r = loxo_thread_range(n_blocks);
        for (int64_t b = r.begin; b < r.end && wrong == INT64_MAX; ++b) {
            const int64_t end = (b + 1) * BLOCK < atoms->n ? (b + 1) * BLOCK : atoms->n;
            const finding f = look_first(kernels, atoms, b * BLOCK, end, is_unit, sums + b * n_sums);
            if (f.atom >= 0) wrong = f.atom;
            is_unit = is_unit && f.is_unit;
        }
    }
    add_pairwise(sums, n_blocks, n_sums);
    const double weight = sums[0];
    if (wrong == INT64_MAX) move_to_origin(atoms->d, centre, sums, first);
    loxo_release(ctx, sums);
    if (wrong < INT64_MAX) return refuse(ctx, who, atoms, wrong);
    if (!(weight > LEAST_WEIGHT) || !(weight < MOST_WEIGHT))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "%s: the atoms' weights add up to %g, not to something in %g to %g",
                         who, weight, LEAST_WEIGHT, MOST_WEIGHT);
    atoms->is_unit = is_unit;
    return LOXO_OK;
}
