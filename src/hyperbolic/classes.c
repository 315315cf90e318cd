/* SPDX-License-Identifier: MIT
 * Whether there is a barycenter at all: the heaviest points. Two candidates are kept in a pass (Misra, Gries 1982, with weights): every
 * point with over a third of the weight is one of them; a second pass weighs them. */
#include "base/allocate.h"
#include "hyperbolic/hyperbolic.h"

#include <math.h>
#include <string.h>

#define HALF 1e-14 /* relatively: sums of weights within this of one half are one half */

static double weight_of(const hyper_atoms *a, int64_t i) { return a->weight == NULL ? 1.0 : a->weight[i]; }

static void load(const hyper_atoms *a, int64_t i, double *x)
{
    double square = 0.0;
    for (int k = 0; k < a->d; ++k) {
        x[k] = a->x != NULL ? a->x[i * a->d + k] : (double)a->x_float[i * a->d + k];
        square += x[k] * x[k];
    }
    for (int k = 0; k < a->d && !a->is_unit; ++k)
        x[k] /= sqrt(square);
}

static bool is_same(const hyper_atoms *a, int64_t i, int64_t j)
{
    const size_t size = (size_t)a->d;
    for (size_t k = 0; k < size; ++k) {
        const double x = a->x != NULL ? a->x[(size_t)i * size + k] : (double)a->x_float[(size_t)i * size + k];
        const double y = a->x != NULL ? a->x[(size_t)j * size + k] : (double)a->x_float[(size_t)j * size + k];
        if (x < y || x > y) return false;
    }
    return true;
}

/* Candidates: numbers of atoms, -1: none. */
static void find_candidates(const hyper_atoms *a, int64_t candidate[2])
{
    double left[2] = {0.0, 0.0};
    candidate[0] = candidate[1] = -1;
    for (int64_t i = 0; i < a->n; ++i) {
        const double p = weight_of(a, i);
        int k = 0;
        if (!(p > 0.0)) continue;
        while (k < 2 && !(candidate[k] >= 0 && is_same(a, i, candidate[k])))
            ++k;
        if (k < 2) {
            left[k] += p;
            continue;
        }
        for (k = 0; k < 2 && candidate[k] >= 0;)
            ++k;
        if (k < 2) {
            candidate[k] = i;
            left[k] = p;
            continue;
        }
        /* three different points: the least of the three weights is taken off each */
        const double least = fmin(p, fmin(left[0], left[1]));
        for (k = 0; k < 2; ++k)
            if (!((left[k] -= least) > 0.0)) candidate[k] = -1;
        if (p - least > 0.0) {
            k = candidate[0] < 0 ? 0 : 1;
            candidate[k] = i;
            left[k] = p - least;
        }
    }
}

hyper_class hyper_classify(const hyper_atoms *atoms, double *first, double *second)
{
    int64_t candidate[2];
    double weight[2] = {0.0, 0.0}, rest = 0.0;
    find_candidates(atoms, candidate);
    for (int64_t i = 0; i < atoms->n; ++i) {
        const double p = weight_of(atoms, i);
        if (candidate[0] >= 0 && is_same(atoms, i, candidate[0]))
            weight[0] += p;
        else if (candidate[1] >= 0 && is_same(atoms, i, candidate[1]))
            weight[1] += p;
        else
            rest += p;
    }
    const int heavy = weight[1] > weight[0] ? 1 : 0;
    const double total = weight[0] + weight[1] + rest, half = 0.5 * total, low = half * (1.0 - HALF);
    if (candidate[heavy] < 0 || weight[heavy] < low) return HYPER_STABLE;
    load(atoms, candidate[heavy], first);
    if (candidate[1 - heavy] < 0 || weight[1 - heavy] < low) return HYPER_NONE;
    load(atoms, candidate[1 - heavy], second);
    return HYPER_NOT_UNIQUE;
}
