/* SPDX-License-Identifier: MIT
 * Matrices for tests of algebra: of meshes, and small ones from dense arrays. */
#ifndef LOXO_TESTS_UNIT_MATRICES_H
#define LOXO_TESTS_UNIT_MATRICES_H

#include "algebra/csr.h"
#include "base/allocate.h"
#include "base/rng.h"
#include "operator/laplacian.h"
#include "solver/surfaces.h"

/* The cotangent matrix of a generated surface; mass may be NULL, else a new array. */
static inline loxo_csr matrix_of_shape(loxo_context *ctx, loxo_shape shape, int64_t n_vertices, double **mass)
{
    surface s = surface_make(ctx, shape, n_vertices, NAN);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    loxo_csr a;
    if (mass != NULL) *mass = loxo_allocate(ctx, m.n_vertices, sizeof **mass);
    CHECK_STATUS(ctx, loxo_laplacian_create(ctx, &m, &a, mass != NULL ? *mass : NULL), LOXO_OK);
    surface_destroy(&s);
    return a;
}

/* From its dense rows, n by n; zeros are no entries. */
static inline loxo_csr matrix_of_dense(loxo_context *ctx, int64_t n, const double *dense)
{
    loxo_csr a = {.n_rows = n};
    int64_t n_entries = 0;
    a.begin = loxo_allocate(ctx, n + 1, sizeof *a.begin);
    a.diagonal = loxo_allocate(ctx, n, sizeof *a.diagonal);
    a.column = loxo_allocate(ctx, n * n, sizeof *a.column);
    a.value = loxo_allocate(ctx, n * n, sizeof *a.value);
    CHECK(a.begin != NULL && a.diagonal != NULL && a.column != NULL && a.value != NULL);
    for (int64_t i = 0; i < n; ++i) {
        a.begin[i] = n_entries;
        a.diagonal[i] = dense[i * n + i];
        for (int64_t j = 0; j < n; ++j) {
            if (j == i || dense[i * n + j] == 0.0) continue;
            a.column[n_entries] = (loxo_index)j;
            a.value[n_entries++] = dense[i * n + j];
        }
    }
    a.begin[n] = n_entries;
    return a;
}

/* Numbers in -0.5 .. 0.5. */
static inline double *random_vector(loxo_context *ctx, int64_t n, uint64_t seed)
{
    double *x = loxo_allocate(ctx, n, sizeof *x);
    CHECK(x != NULL);
    for (int64_t i = 0; i < n; ++i)
        x[i] = loxo_random_unit(seed, (uint64_t)i) - 0.5;
    return x;
}

static inline double *zero_vector(loxo_context *ctx, int64_t n)
{
    double *x = loxo_allocate_zero(ctx, n, sizeof *x);
    CHECK(x != NULL);
    return x;
}

static inline double dot_product(int64_t n, const double *x, const double *y)
{
    long double sum = 0.0L;
    for (int64_t i = 0; i < n; ++i)
        sum += (long double)x[i] * (long double)y[i];
    return (double)sum;
}

#endif
