/* SPDX-License-Identifier: MIT
 * Several sources from one factor. Held vertices of a component exert forces that add up to nothing and keep them level:
 *   C d = b + sum_i f_i (e_i - e_0),   d_i = d_0,   i = 1 .. n - 1.
 * With G the inverse by the factor, which has the component's ground at 0, and y = G b,
 *   d = y + sum_i f_i G (e_i - e_0) up to a constant,   sum_j K_ij f_j = y_0 - y_i,   K_ij = G_ij - G_i0 - G_0j + G_00.
 * K is a small positive definite matrix, of entries of G alone; the forces found, d takes a second solve. */
#include "algebra/dense.h"
#include "base/allocate.h"
#include "par/range.h"
#include "solver/geodesic/poisson/poisson_internal.h"

/* A pivot of K below this share of its diagonal: digits are short, and a factor that pins the vertices is better. */
#define LEAST_PIVOT 1e-9

void poisson_release_ties(poisson *p)
{
    loxo_release(p->ctx, p->ties.begin);
    loxo_release(p->ctx, p->ties.vertex);
    loxo_release(p->ctx, p->ties.factor);
    loxo_release(p->ctx, p->ties.force);
    p->ties = (poisson_ties){0};
}

/* Held vertices by their components. */
static loxo_status make_groups(poisson *p)
{
    poisson_ties *t = &p->ties;
    const int64_t n = p->held.n;
    uint64_t *key = loxo_allocate(p->ctx, n, sizeof *key);
    uint32_t *order = loxo_allocate(p->ctx, n, sizeof *order);
    t->begin = loxo_allocate(p->ctx, n + 1, sizeof *t->begin);
    t->vertex = loxo_allocate(p->ctx, n, sizeof *t->vertex);
    loxo_status status =
        key == NULL || order == NULL || t->begin == NULL || t->vertex == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
    for (int64_t k = 0; k < n && status >= 0; ++k) {
        key[k] = (uint64_t)poisson_set_of(p, p->held.vertex[k]);
        order[k] = (uint32_t)k;
    }
    if (status >= 0) status = loxo_sort_u64(p->ctx, n, key, order, 32);
    for (int64_t k = 0; k < n && status >= 0; ++k) {
        if (k == 0 || key[k] != key[k - 1]) t->begin[t->n_groups++] = k;
        t->vertex[k] = p->held.vertex[order[k]];
    }
    if (status >= 0) t->begin[t->n_groups] = n;
    loxo_release(p->ctx, key);
    loxo_release(p->ctx, order);
    return status;
}

/* Row k of a triangle of rows. */
static const double *row_of(const double *triangle, int64_t k) { return triangle + k * (k + 1) / 2; }

/* K of one group, factored; g its entries of G, but for the ground's, which the factor has as 1 and are 0. */
static bool factor_group(const poisson *p, const loxo_index *vertex, int64_t n, double *g, double *factor)
{
    const loxo_index ground = p->ground[poisson_set_of(p, vertex[0])];
    double *to = factor;
    for (int64_t i = 0; i < n; ++i)
        if (vertex[i] == ground) g[i * (i + 1) / 2 + i] = 0.0;
    for (int64_t i = 1; i < n; ++i)
        for (int64_t j = 1; j <= i; ++j)
            *to++ = row_of(g, i)[j] - row_of(g, i)[0] - row_of(g, j)[0] + g[0];
    return loxo_dense_factor(n - 1, factor, LEAST_PIVOT) == 0;
}

loxo_status poisson_tie(poisson *p, bool *is_tied)
{
    poisson_ties *t = &p->ties;
    int64_t n_inverse = 0, n_factor = 0, largest = 0;
    double *inverse = NULL;
    loxo_status status = make_groups(p);
    if (status < 0) return status;
    for (int64_t g = 0; g < t->n_groups; ++g) {
        const int64_t n = t->begin[g + 1] - t->begin[g];
        n_inverse += n * (n + 1) / 2;
        n_factor += n * (n - 1) / 2;
        largest = n > largest ? n : largest;
    }
    inverse = loxo_allocate(p->ctx, n_inverse, sizeof *inverse);
    t->factor = loxo_allocate(p->ctx, n_factor, sizeof *t->factor);
    t->force = loxo_allocate(p->ctx, largest, sizeof *t->force);
    status = LOXO_ERR_MEMORY;
    if (inverse == NULL || t->factor == NULL || t->force == NULL) goto done;
    status = loxo_cholesky_inverse(p->poisson_factor, t->n_groups, t->begin, t->vertex, inverse);
    if (status < 0) goto done;
    double *from = inverse, *factor = t->factor;
    *is_tied = true;
    for (int64_t g = 0; g < t->n_groups && *is_tied; ++g) {
        const int64_t n = t->begin[g + 1] - t->begin[g];
        *is_tied = factor_group(p, t->vertex + t->begin[g], n, from, factor);
        from += n * (n + 1) / 2;
        factor += n * (n - 1) / 2;
    }
    if (!*is_tied) poisson_release_ties(p);
done:
    loxo_release(p->ctx, inverse);
    return status;
}

loxo_status poisson_pull_ties(poisson *p, double *distance)
{
    const poisson_ties *t = &p->ties;
    const double *factor = t->factor;
    for (int64_t g = 0; g < t->n_groups; ++g) {
        const loxo_index *vertex = t->vertex + t->begin[g];
        const int64_t n = t->begin[g + 1] - t->begin[g];
        for (int64_t i = 1; i < n; ++i)
            t->force[i - 1] = distance[vertex[0]] - distance[vertex[i]];
        loxo_dense_solve(n - 1, factor, t->force);
        for (int64_t i = 1; i < n; ++i) {
            p->right_side[vertex[i]] += t->force[i - 1];
            p->right_side[vertex[0]] -= t->force[i - 1];
        }
        factor += n * (n - 1) / 2;
    }
    for (int64_t k = 0; k < p->pinned.n; ++k)
        p->right_side[p->pinned.vertex[k]] = 0.0;
    const loxo_status status = loxo_cholesky_solve(p->poisson_factor, p->right_side, distance);
    if (status < 0) return status;
    for (int64_t s = 0; s < p->n_sets; ++s)
        p->set_shift[s] = 0.0;
    for (int64_t g = 0; g < t->n_groups; ++g) {
        const loxo_index first = t->vertex[t->begin[g]];
        p->set_shift[poisson_set_of(p, first)] = distance[first];
    }
    for (int64_t v = 0; v < p->m.n_vertices; ++v)
        distance[v] -= p->set_shift[poisson_set_of(p, v)];
    return LOXO_OK;
}
