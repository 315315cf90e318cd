/* SPDX-License-Identifier: MIT
 * Stiff groups. A flat triangle with an angle near 180 degrees (a cap) holds its three vertices to a line: none can move
 * alone, and relaxing them one by one hardly moves them at all. They are relaxed together. */
#include "algebra/dense.h"
#include "algebra/multigrid_internal.h"
#include "base/allocate.h"
#include "par/range.h"

#include <math.h>
#include <string.h>

/* A negative weight of this share of the largest of its ends is stiff; its triangle's apex hangs on both ends by at least
 * so much of it. */
#define STIFF 0.15f
#define APEX  0.5f
/* A pivot below this share of its diagonal: the group is not safely definite. */
#define LEAST_PIVOT 1e-7

/* Stiff edges; the stiffest are joined first, since groups are not allowed to grow far. */
typedef struct stiff_edges {
    int64_t n;
    loxo_index (*end)[2]; /* [n] in the order of rows */
    uint64_t *key;        /* [n] falls with the stiffness */
    uint32_t *order;      /* [n] */
} stiff_edges;

typedef struct growing {
    const mg_level *level;
    loxo_index *next; /* a ring through the members of a group; itself where it is alone */
} growing;

static int64_t group_size(const growing *g, int64_t i)
{
    int64_t n = 1;
    for (int64_t j = g->next[i]; j != i; j = g->next[j])
        ++n;
    return n;
}

static bool is_in_group(const growing *g, int64_t i, int64_t other)
{
    for (int64_t j = g->next[i]; j != i; j = g->next[j])
        if (j == other) return true;
    return i == other;
}

/* Joins the rings of i and j where the result is small enough. */
static void join(growing *g, int64_t i, int64_t j)
{
    if (is_in_group(g, i, j)) return;
    if (group_size(g, i) + group_size(g, j) > MG_MOST_STIFF) return;
    const loxo_index next = g->next[i];
    g->next[i] = g->next[j];
    g->next[j] = next;
}

static float weight_between(const mg_level *l, int64_t i, int64_t j)
{
    int64_t low = l->row[i], high = l->row[i + 1];
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (l->column[middle] < j)
            low = middle + 1;
        else
            high = middle;
    }
    return low < l->row[i + 1] && l->column[low] == j ? l->weight[low] : 0.0f;
}

/* Stiff edges from row i to later rows; returns how many. list NULL: only counts, else from place `at` on. */
static int64_t look_at_row(const mg_level *l, int64_t i, stiff_edges *list, int64_t at)
{
    int64_t n = 0;
    for (int64_t k = l->row[i]; k < l->row[i + 1]; ++k) {
        const int64_t j = l->column[k];
        const float w = -l->weight[k];
        if (j < i || !(w > 0.0f)) continue;
        const float most = l->strongest[i] > l->strongest[j] ? l->strongest[i] : l->strongest[j];
        if (w < STIFF * most) continue;
        if (list != NULL) {
            const float stiffness = w / most; /* bits of positive floats ascend as they do */
            uint32_t bits;
            memcpy(&bits, &stiffness, sizeof bits);
            list->end[at + n][0] = (loxo_index)i;
            list->end[at + n][1] = (loxo_index)j;
            list->key[at + n] = UINT32_MAX - bits;
            list->order[at + n] = (uint32_t)(at + n);
        }
        ++n;
    }
    return n;
}

static loxo_status find_edges(loxo_context *ctx, const mg_level *l, stiff_edges *list)
{
    const int n_threads = loxo_threads_for(ctx, l->n, 10.0);
    const int64_t n_shares =
        n_threads; /* of the rows, the same in both turns; how many threads come is the system's affair */
    int64_t *at = loxo_allocate(ctx, n_shares, sizeof *at);
    if (at == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = LOXO_OK;
    for (int turn = 0; turn < 2; ++turn) { /* counts, then entries */
#pragma omp parallel num_threads(n_threads)
        {
            const loxo_range mine = loxo_thread_range(n_shares);
            for (int64_t share = mine.begin; share < mine.end; ++share) {
                const loxo_range r = loxo_range_of(l->n, share, n_shares);
                int64_t n = turn == 0 ? 0 : at[share];
                for (int64_t i = r.begin; i < r.end; ++i)
                    n += look_at_row(l, i, turn == 0 ? NULL : list, n);
                at[share] = n;
            }
        }
        if (turn == 1) break;
        list->n = 0;
        for (int64_t share = 0; share < n_shares; ++share) {
            const int64_t n = at[share];
            at[share] = list->n;
            list->n += n;
        }
        if (list->n == 0) break;
        if (list->n > (int64_t)UINT32_MAX) {
            status = loxo_fail(ctx, LOXO_ERR_LIMIT, "multigrid: over 2^32 stiff edges");
            break;
        }
        list->end = loxo_allocate(ctx, list->n, sizeof *list->end);
        list->key = loxo_allocate(ctx, list->n, sizeof *list->key);
        list->order = loxo_allocate(ctx, list->n, sizeof *list->order);
        if (list->end == NULL || list->key == NULL || list->order == NULL) {
            status = LOXO_ERR_MEMORY;
            break;
        }
    }
    loxo_release(ctx, at);
    return status < 0 || list->n == 0 ? status : loxo_sort_u64(ctx, list->n, list->key, list->order, 32);
}

/* The ends of a stiff edge, and every apex over it, along the shorter of the two rows: one may be a hub's. */
static void join_over(growing *g, int64_t i, int64_t j)
{
    const mg_level *l = g->level;
    const float w = -weight_between(l, i, j);
    const bool is_shorter = l->row[j + 1] - l->row[j] < l->row[i + 1] - l->row[i];
    const int64_t short_row = is_shorter ? j : i, long_row = is_shorter ? i : j;
    for (int64_t q = l->row[short_row]; q < l->row[short_row + 1]; ++q) {
        const int64_t apex = l->column[q];
        if (l->weight[q] < APEX * w || weight_between(l, long_row, apex) < APEX * w) continue;
        join(g, i, apex);
        join(g, i, j);
    }
}

/* The matrix of the members, factored; false: it is not safely definite. What couples them to other groups counts on the
 * diagonal, so that all groups can be corrected from one residual and the energy cannot grow. */
static bool factor(const growing *g, int64_t n, const loxo_index *member, double *matrix)
{
    double *a = matrix;
    const mg_level *l = g->level;
    for (int64_t p = 0; p < n; ++p) {
        const int64_t i = member[p];
        double d = mg_excess(l, i);
        for (int64_t k = l->row[i]; k < l->row[i + 1]; ++k) {
            const int64_t j = l->column[k];
            d += (double)l->weight[k];
            if (g->next[j] != j && !is_in_group(g, i, j)) d += fabs((double)l->weight[k]);
        }
        for (int64_t q = 0; q < p; ++q)
            *a++ = -(double)weight_between(l, i, member[q]);
        *a++ = d;
    }
    return loxo_dense_factor(n, matrix, LEAST_PIVOT) == 0;
}

/* Single precision holds a factor well: a rounded entry of L moves energies by its square. */
static loxo_status keep_groups(loxo_context *ctx, const growing *g, const loxo_index *lowest, int64_t n_found,
                               mg_stiff *s)
{
    double matrix[MG_MOST_STIFF * (MG_MOST_STIFF + 1) / 2];
    int64_t n_members = 0, n_entries = 0;
    for (int64_t k = 0; k < n_found; ++k) {
        const int64_t n = group_size(g, lowest[k]);
        n_members += n;
        n_entries += n * (n + 1) / 2;
    }
    s->begin = loxo_allocate(ctx, n_found + 1, sizeof *s->begin);
    s->at = loxo_allocate(ctx, n_found, sizeof *s->at);
    s->member = loxo_allocate(ctx, n_members, sizeof *s->member);
    s->step = loxo_allocate(ctx, n_members, sizeof *s->step);
    s->factor = loxo_allocate(ctx, n_entries, sizeof *s->factor);
    if (s->begin == NULL || s->at == NULL || s->member == NULL || s->step == NULL || s->factor == NULL)
        return LOXO_ERR_MEMORY;
    s->begin[0] = 0;
    n_entries = 0;
    for (int64_t k = 0; k < n_found; ++k) {
        loxo_index *member = s->member + s->begin[s->n_groups];
        int64_t n = 0, j = lowest[k];
        do {
            member[n++] = (loxo_index)j;
            j = g->next[j];
        } while (j != lowest[k]);
        if (!factor(g, n, member, matrix)) continue;
        s->at[s->n_groups] = n_entries;
        for (int64_t q = 0; q < n * (n + 1) / 2; ++q)
            s->factor[n_entries++] = (float)matrix[q];
        s->begin[s->n_groups + 1] = (loxo_index)(s->begin[s->n_groups] + n);
        ++s->n_groups;
    }
    return LOXO_OK;
}

loxo_status mg_find_stiff(loxo_context *ctx, mg_level *l)
{
    growing g = {.level = l};
    stiff_edges list = {0};
    loxo_index *lowest = NULL; /* the first member of each group */
    int64_t n_found = 0;
    loxo_status status = find_edges(ctx, l, &list);
    if (status < 0 || list.n == 0) goto done;
    status = LOXO_ERR_MEMORY;
    if ((g.next = loxo_allocate(ctx, l->n, sizeof *g.next)) == NULL) goto done;
    if ((lowest = loxo_allocate(ctx, list.n, sizeof *lowest)) == NULL) goto done;
    for (int64_t i = 0; i < l->n; ++i)
        g.next[i] = (loxo_index)i;
    for (int64_t e = 0; e < list.n; ++e)
        join_over(&g, list.end[list.order[e]][0], list.end[list.order[e]][1]);
    /* At most one an edge: what is joined over an edge is joined to its first end. */
    for (int64_t i = 0; i < l->n; ++i) {
        int64_t j = g.next[i];
        while (j > i)
            j = g.next[j];
        if (g.next[i] != i && j == i) lowest[n_found++] = (loxo_index)i;
    }
    status = n_found > 0 ? keep_groups(ctx, &g, lowest, n_found, &l->stiff) : LOXO_OK;
done:
    loxo_release(ctx, lowest);
    loxo_release(ctx, g.next);
    loxo_release(ctx, list.end);
    loxo_release(ctx, list.key);
    loxo_release(ctx, list.order);
    return status;
}

void mg_destroy_stiff(loxo_context *ctx, mg_level *l)
{
    loxo_release(ctx, l->stiff.begin);
    loxo_release(ctx, l->stiff.member);
    loxo_release(ctx, l->stiff.step);
    loxo_release(ctx, l->stiff.at);
    loxo_release(ctx, l->stiff.factor);
}

/* As loxo_dense_solve. */
static void solve(int64_t n, const float *factor, double *x)
{
    const float *row = factor;
    for (int64_t i = 0; i < n; row += ++i)
        for (int64_t k = 0; k < i; ++k)
            x[i] -= (double)row[k] * x[k];
    row = factor;
    for (int64_t i = 0; i < n; row += ++i)
        x[i] /= (double)row[i];
    for (int64_t i = n - 1; i >= 0; --i) {
        row -= i + 1;
        for (int64_t k = 0; k < i; ++k)
            x[k] -= (double)row[k] * x[i];
    }
}

void mg_find_steps(const mg_level *l, int64_t begin, int64_t end, const double *b, const double *x)
{
    const mg_stiff *s = &l->stiff;
    const k_smooth_level rows = mg_rows(l);
    for (int64_t g = begin; g < end; ++g) {
        const int64_t first = s->begin[g], n = s->begin[g + 1] - first;
        for (int64_t k = first; k < first + n; ++k)
            s->step[k] = k_residual_at(&rows, s->member[k], b, x);
        solve(n, s->factor + s->at[g], s->step + first);
    }
}

void mg_take_steps(const mg_level *l, int64_t begin, int64_t end, double *x)
{
    const mg_stiff *s = &l->stiff;
    for (loxo_index k = s->begin[begin]; k < s->begin[end]; ++k)
        x[s->member[k]] += s->step[k];
}
