/* SPDX-License-Identifier: MIT
 * FreeSurfer labels, and lists of vertices and points. */
#include "harness.h"
#include "io/field.h"
#include "io/vertices.h"

#define N_VERTICES 100

static void check_list(loxo_context *ctx, loxo_status status, loxo_index *vertex, int64_t n)
{
    if (status != LOXO_ERR_ARGUMENT) fuzz_check_status(ctx, status); /* a number of a list out of range */
    FUZZ_CHECK(status >= 0 ? n >= 0 : vertex == NULL && n == 0);
    for (int64_t i = 0; i < n; ++i)
        FUZZ_CHECK(vertex[i] >= 0 && vertex[i] < N_VERTICES);
    loxo_release(ctx, vertex);
}

static void fuzz_one(loxo_context *ctx, const uint8_t *bytes, size_t n)
{
    loxo_index *vertex = NULL;
    double *position = NULL, sum = 0.0;
    int64_t n_read = 0;
    loxo_status status = loxo_read_label(ctx, bytes, n, "input", N_VERTICES, &vertex, &n_read);
    FUZZ_PLANT(status >= 0 && n_read == 3);
    check_list(ctx, status, vertex, n_read);
    status = loxo_read_vertices_bytes(ctx, bytes, n, "input", NULL, N_VERTICES, &vertex, &n_read);
    check_list(ctx, status, vertex, n_read);
    status = loxo_read_points_bytes(ctx, bytes, n, "input", &position, &n_read);
    fuzz_check_status(ctx, status);
    for (int64_t i = 0; i < 3 * n_read; ++i)
        sum += position[i];
    FUZZ_CHECK(sum <= 0.0 || sum >= 0.0 || sum != sum);
    loxo_release(ctx, position);
    loxo_array array;
    status = loxo_read_array_bytes(ctx, bytes, n, "input", &array);
    fuzz_check_status(ctx, status);
    int64_t n_numbers = status >= 0 ? 1 : 0;
    for (int k = 0; k < array.n_dimensions; ++k)
        n_numbers *= array.shape[k];
    for (int64_t i = 0; i < n_numbers; ++i)
        sum += array.value[i];
    FUZZ_CHECK(sum <= 0.0 || sum >= 0.0 || sum != sum);
    loxo_array_destroy(ctx, &array);
}
