/* SPDX-License-Identifier: MIT
 * Rows of symmetric sparse matrices: products, and the relaxation that multigrid smooths with. */
#ifndef LOXO_KERNEL_SPARSE_KERNEL_H
#define LOXO_KERNEL_SPARSE_KERNEL_H

#include <loxo/base.h>

/* y = A x for rows begin..end-1, by differences: y_i = (d_i + sum of a_ij) x_i + sum of a_ij (x_j - x_i). The row sums of
 * a Laplacian vanish, exactly when the diagonal was added up in the order of the entries, and what is left does not cancel:
 * of smooth x of any size only the differences are rounded. */
static inline void k_csr_multiply(const int64_t *restrict row, const loxo_index *restrict column,
                                  const double *restrict value, const double *restrict diagonal, int64_t begin,
                                  int64_t end, const double *restrict x, double *restrict y)
{
    for (int64_t i = begin; i < end; ++i) {
        const double own = x[i];
        double sum = 0.0, excess = 0.0;
        for (int64_t k = row[i]; k < row[i + 1]; ++k) {
            excess += value[k];
            sum += value[k] * (x[column[k]] - own);
        }
        y[i] = (diagonal[i] + excess) * own + sum;
    }
}

/* A level of a multigrid hierarchy, its matrix in single precision, as weights of edges and excesses:
 *   (A x)_i = excess_i x_i + sum_j weight_ij (x_i - x_j),   weight_ij = -a_ij, excess_i = a_ii - sum_j weight_ij.
 * Constants stay in the null space, whatever the weights were rounded to.
 *
 * excess NULL stands for zeros.
 *
 * Smoothing is Gauss-Seidel inside blocks of rows and Jacobi between them. The blocks do not depend on the threads, so
 * neither does any bit. inverse_i = 1 / d'_i, see the README of algebra for d'. */
typedef struct k_smooth_level {
    const int64_t *row;
    const loxo_index *column;
    const float *weight, *excess, *inverse;
} k_smooth_level;

/* What is left of b_i by the excess. */
static inline double k_without_excess(const k_smooth_level *m, int64_t i, const double *b, double own)
{
    return m->excess != NULL ? b[i] - (double)m->excess[i] * own : b[i];
}

/* Block begin..end-1, forward, from zero: (D' + L) x = b with L the lower triangle inside the block. */
static inline void k_smooth_forward(const k_smooth_level *m, int64_t begin, int64_t end, const double *restrict b,
                                    double *restrict x)
{
    for (int64_t i = begin; i < end; ++i) {
        double sum = b[i];
        int64_t k = m->row[i];
        const int64_t last = m->row[i + 1];
        while (k < last && m->column[k] < begin)
            ++k;
        for (; k < last && m->column[k] < i; ++k)
            sum += (double)m->weight[k] * x[m->column[k]];
        x[i] = sum * (double)m->inverse[i];
    }
}

/* (b - A x)_i */
static inline double k_residual_at(const k_smooth_level *m, int64_t i, const double *b, const double *x)
{
    const double own = x[i];
    double sum = k_without_excess(m, i, b, own);
    for (int64_t k = m->row[i]; k < m->row[i + 1]; ++k)
        sum -= (double)m->weight[k] * (own - x[m->column[k]]);
    return sum;
}

/* r = b - A x. */
static inline void k_smooth_residual(const k_smooth_level *m, int64_t begin, int64_t end, const double *restrict b,
                                     const double *restrict x, double *restrict r)
{
    for (int64_t i = begin; i < end; ++i)
        r[i] = k_residual_at(m, i, b, x);
}

/* Block begin..end-1, backward, from y: x = y + (D' + U)^-1 (b - A y) with U the upper triangle inside the block. */
static inline void k_smooth_backward(const k_smooth_level *m, int64_t begin, int64_t end, const double *restrict b,
                                     const double *restrict y, double *restrict x)
{
    for (int64_t i = end - 1; i >= begin; --i) {
        const double own = y[i];
        double sum = k_without_excess(m, i, b, own);
        const int64_t first = m->row[i];
        int64_t k = m->row[i + 1] - 1;
        for (; k >= first && m->column[k] >= end; --k)
            sum -= (double)m->weight[k] * (own - y[m->column[k]]);
        for (; k >= first && m->column[k] > i; --k)
            sum -= (double)m->weight[k] * (own - x[m->column[k]]);
        for (; k >= first; --k)
            sum -= (double)m->weight[k] * (own - y[m->column[k]]);
        x[i] = own + sum * (double)m->inverse[i];
    }
}

#endif
