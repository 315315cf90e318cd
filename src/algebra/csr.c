/* SPDX-License-Identifier: MIT */
#include "algebra/csr.h"

#include "base/allocate.h"
#include "kernel/sparse_kernel.h"

#include <float.h>
#include <inttypes.h>
#include <math.h>

#define NS_A_ROW 12.0 /* about, of a row with six entries */

void loxo_csr_destroy(loxo_context *ctx, loxo_csr *a)
{
    loxo_release(ctx, a->begin);
    loxo_release(ctx, a->column);
    loxo_release(ctx, a->value);
    loxo_release(ctx, a->diagonal);
    *a = (loxo_csr){0};
}

size_t loxo_csr_bytes(const loxo_csr *a)
{
    const size_t n = (size_t)a->n_rows, n_entries = (size_t)a->begin[a->n_rows];
    return n * (sizeof *a->diagonal + sizeof *a->begin) + sizeof *a->begin +
           n_entries * (sizeof *a->column + sizeof *a->value);
}

/* First row of which the rows before, with their entries, cost at least so much. */
static int64_t row_at_cost(const loxo_csr *a, int64_t cost)
{
    int64_t low = 0, high = a->n_rows;
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (a->begin[middle] + 3 * middle < cost)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

loxo_range loxo_csr_share(const loxo_csr *a, int64_t i, int64_t n)
{
    const int64_t total = a->begin[a->n_rows] + 3 * a->n_rows;
    int64_t end[2];
    for (int64_t side = 0; side < 2; ++side) {
        const int64_t row = row_at_cost(a, loxo_range_of(total, i, n).begin);
        end[side] = i == n ? a->n_rows : row / LOXO_SUM_BLOCK * LOXO_SUM_BLOCK;
        ++i;
    }
    return (loxo_range){end[0], end[1]};
}

void loxo_csr_multiply(loxo_context *ctx, const loxo_csr *a, const double *x, double *y)
{
#pragma omp parallel num_threads(loxo_threads_for(ctx, a->n_rows, NS_A_ROW))
    {
        const loxo_range r = loxo_csr_share(a, loxo_thread_id(), loxo_thread_count());
        k_csr_multiply(a->begin, a->column, a->value, a->diagonal, r.begin, r.end, x, y);
    }
}

double loxo_csr_excess(const loxo_csr *a, int64_t i)
{
    double sum = 0.0, size = fabs(a->diagonal[i]);
    for (int64_t k = a->begin[i]; k < a->begin[i + 1]; ++k) {
        sum += a->value[k];
        size += fabs(a->value[k]);
    }
    sum += a->diagonal[i];
    const double n_terms = (double)(a->begin[i + 1] - a->begin[i] + 1);
    return fabs(sum) <= 2.0 * n_terms * DBL_EPSILON * size ? 0.0 : sum;
}

void loxo_csr_scale_shift(loxo_context *ctx, loxo_csr *a, double factor, const double *shift)
{
#pragma omp parallel num_threads(loxo_threads_for(ctx, a->n_rows, NS_A_ROW))
    {
        const loxo_range r = loxo_csr_share(a, loxo_thread_id(), loxo_thread_count());
        for (int64_t i = r.begin; i < r.end; ++i) {
            const double excess = loxo_csr_excess(a, i);
            double sum = 0.0;
            for (int64_t k = a->begin[i]; k < a->begin[i + 1]; ++k)
                sum += a->value[k] *= factor;
            /* From the entries, so that a row that summed to 0 still does. */
            a->diagonal[i] = factor * excess + (shift != NULL ? shift[i] : 0.0) - sum;
        }
    }
}

void loxo_csr_pin(loxo_context *ctx, loxo_csr *a, const bool *is_pinned)
{
#pragma omp parallel num_threads(loxo_threads_for(ctx, a->n_rows, NS_A_ROW))
    {
        const loxo_range r = loxo_csr_share(a, loxo_thread_id(), loxo_thread_count());
        for (int64_t i = r.begin; i < r.end; ++i) {
            if (is_pinned[i]) a->diagonal[i] = 1.0;
            for (int64_t k = a->begin[i]; k < a->begin[i + 1]; ++k)
                if (is_pinned[i] || is_pinned[a->column[k]]) a->value[k] = 0.0;
        }
    }
}

/* Entry of row i in column j, or NULL. */
static const double *find_entry(const loxo_csr *a, int64_t i, int64_t j)
{
    int64_t low = a->begin[i], high = a->begin[i + 1];
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (a->column[middle] < j)
            low = middle + 1;
        else
            high = middle;
    }
    return low < a->begin[i + 1] && a->column[low] == j ? &a->value[low] : NULL;
}

/* What is wrong with a row; NULL: nothing. */
static const char *row_fault(const loxo_csr *a, int64_t i)
{
    if (!isfinite(a->diagonal[i]) || a->diagonal[i] < 0.0) return "its diagonal is negative or not finite";
    for (int64_t k = a->begin[i]; k < a->begin[i + 1]; ++k) {
        const int64_t j = a->column[k];
        if (j < 0 || j >= a->n_rows || j == i) return "a column is out of range";
        if (k > a->begin[i] && a->column[k - 1] >= j) return "its columns do not ascend";
        if (!isfinite(a->value[k])) return "a value is not finite";
        const double *mirrored = find_entry(a, j, i);
        const double bound = 1e-12 * (fabs(a->diagonal[i]) + fabs(a->diagonal[j]) + fabs(a->value[k]));
        if (mirrored == NULL || !(fabs(*mirrored - a->value[k]) <= bound)) return "it is not symmetric";
    }
    return NULL;
}

loxo_status loxo_csr_check(loxo_context *ctx, const loxo_csr *a)
{
    if (a->n_rows < 0 || a->n_rows > LOXO_INDEX_MAX)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "matrix: %" PRId64 " rows", a->n_rows);
    int64_t at = a->begin[0] == 0 ? a->n_rows : 0;
    for (int64_t i = 0; i < a->n_rows && at == a->n_rows; ++i)
        if (a->begin[i + 1] < a->begin[i]) at = i;
    if (at < a->n_rows) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "matrix: row %" PRId64 " ends before it begins", at);
    for (int64_t i = 0; i < a->n_rows; ++i) {
        const char *fault = row_fault(a, i);
        const loxo_place place = {.byte = -1, .element = i};
        if (fault != NULL) return loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, place, "matrix: row %" PRId64 ": %s", i, fault);
    }
    return LOXO_OK;
}

static loxo_index find_root(loxo_index *parent, loxo_index i)
{
    while (parent[i] != i) {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    return i;
}

/* Roots are the lowest numbers of their sets. */
loxo_status loxo_csr_components(loxo_context *ctx, const loxo_csr *a, loxo_index *label, int64_t *n_sets)
{
    loxo_index *parent = loxo_allocate(ctx, a->n_rows, sizeof *parent);
    if (parent == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < a->n_rows; ++i) {
        parent[i] = (loxo_index)i;
        for (int64_t k = a->begin[i]; k < a->begin[i + 1] && a->column[k] < i; ++k) {
            if (a->value[k] == 0.0) continue;
            const loxo_index p = find_root(parent, a->column[k]), q = find_root(parent, (loxo_index)i);
            if (p < q)
                parent[q] = p;
            else
                parent[p] = q;
        }
    }
    *n_sets = 0;
    for (int64_t i = 0; i < a->n_rows; ++i) {
        const loxo_index root = find_root(parent, (loxo_index)i);
        label[i] = root == i ? (loxo_index)(*n_sets)++ : label[root];
    }
    loxo_release(ctx, parent);
    return LOXO_OK;
}
