/* SPDX-License-Identifier: MIT
 * Stiff groups. A flat triangle with an angle near 180 degrees (a cap) holds its three vertices to a line: none can move
 * alone, and relaxing them one by one hardly moves them at all. They are relaxed together. */
#include "algebra/dense.h"
#include "algebra/multigrid_internal.h"
#include "base/allocate.h"

#include <math.h>

/* A negative weight of this share of the largest of its ends is stiff; its triangle's apex hangs on both ends by at least
 * so much of it. */
#define STIFF 0.25f
#define APEX  0.5f

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

static float strongest_of(const mg_level *l, int64_t i)
{
    float most = 0.0f;
    for (int64_t k = l->row[i]; k < l->row[i + 1]; ++k)
        most = l->weight[k] > most ? l->weight[k] : most;
    return most;
}

/* Rows with a stiff edge to a later row: the ends, and every apex over it. */
static void grow(growing *g)
{
    const mg_level *l = g->level;
    for (int64_t i = 0; i < l->n; ++i) {
        float strongest = -1.0f;
        for (int64_t k = l->row[i]; k < l->row[i + 1]; ++k) {
            const int64_t j = l->column[k];
            const float w = -l->weight[k];
            if (j < i || !(w > 0.0f)) continue;
            if (strongest < 0.0f) strongest = strongest_of(l, i);
            if (w < STIFF * strongest || w < STIFF * strongest_of(l, j)) continue;
            /* Along the shorter of the two rows: one may be a hub's. */
            const bool is_shorter = l->row[j + 1] - l->row[j] < l->row[i + 1] - l->row[i];
            const int64_t short_row = is_shorter ? j : i, long_row = is_shorter ? i : j;
            for (int64_t q = l->row[short_row]; q < l->row[short_row + 1]; ++q) {
                const int64_t apex = l->column[q];
                if (l->weight[q] < APEX * w || weight_between(l, long_row, apex) < APEX * w) continue;
                join(g, i, apex);
                join(g, i, j);
            }
        }
    }
}

/* The matrix of the members, factored; false: it is not safely definite. What couples them to other groups counts on the
 * diagonal, so that all groups can be corrected from one residual and the energy cannot grow. */
static bool factor(const growing *g, int64_t n, const loxo_index *member, double *a)
{
    const mg_level *l = g->level;
    for (int64_t p = 0; p < n; ++p) {
        const int64_t i = member[p];
        double d = (double)l->excess[i];
        for (int64_t k = l->row[i]; k < l->row[i + 1]; ++k) {
            const int64_t j = l->column[k];
            d += (double)l->weight[k];
            if (g->next[j] != j && !is_in_group(g, i, j)) d += fabs((double)l->weight[k]);
        }
        for (int64_t q = 0; q < p; ++q)
            a[p * n + q] = -(double)weight_between(l, i, member[q]);
        a[p * n + p] = d;
    }
    return loxo_dense_factor(n, a, 1e-7) == 0;
}

loxo_status mg_find_stiff(loxo_context *ctx, mg_level *l)
{
    growing g = {.level = l};
    int64_t n_members = 0;
    mg_stiff *s = &l->stiff;
    loxo_status status = LOXO_ERR_MEMORY;
    if ((g.next = loxo_allocate(ctx, l->n, sizeof *g.next)) == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < l->n; ++i)
        g.next[i] = (loxo_index)i;
    grow(&g);
    for (int64_t i = 0; i < l->n; ++i)
        n_members += g.next[i] != i;
    if (n_members == 0) {
        status = LOXO_OK;
        goto done;
    }
    s->begin = loxo_allocate(ctx, n_members + 1, sizeof *s->begin);
    s->member = loxo_allocate(ctx, n_members, sizeof *s->member);
    s->step = loxo_allocate(ctx, n_members, sizeof *s->step);
    s->factor = loxo_allocate(ctx, n_members * MG_MOST_STIFF, sizeof *s->factor);
    if (s->begin == NULL || s->member == NULL || s->step == NULL || s->factor == NULL) goto done;
    s->begin[0] = 0;
    for (int64_t i = 0; i < l->n; ++i) {
        const int64_t first = s->begin[s->n_groups];
        int64_t n = 1, lowest = i;
        for (int64_t j = g.next[i]; j != i; j = g.next[j])
            lowest = j < lowest ? j : lowest;
        if (g.next[i] == i || lowest < i) continue;
        s->member[first] = (loxo_index)i;
        for (int64_t j = g.next[i]; j != i; j = g.next[j])
            s->member[first + n++] = (loxo_index)j;
        if (factor(&g, n, s->member + first, s->factor + first * MG_MOST_STIFF)) s->begin[++s->n_groups] = first + n;
    }
    status = LOXO_OK;
done:
    loxo_release(ctx, g.next);
    return status;
}

void mg_destroy_stiff(loxo_context *ctx, mg_level *l)
{
    loxo_release(ctx, l->stiff.begin);
    loxo_release(ctx, l->stiff.member);
    loxo_release(ctx, l->stiff.step);
    loxo_release(ctx, l->stiff.factor);
}

void mg_find_steps(const mg_level *l, int64_t begin, int64_t end, const double *b, const double *x)
{
    const mg_stiff *s = &l->stiff;
    const k_smooth_level rows = mg_rows(l);
    for (int64_t g = begin; g < end; ++g) {
        const int64_t first = s->begin[g], n = s->begin[g + 1] - first;
        for (int64_t k = first; k < first + n; ++k)
            s->step[k] = k_residual_at(&rows, s->member[k], b, x);
        loxo_dense_solve(n, s->factor + first * MG_MOST_STIFF, s->step + first);
    }
}

void mg_take_steps(const mg_level *l, int64_t begin, int64_t end, double *x)
{
    const mg_stiff *s = &l->stiff;
    for (int64_t k = s->begin[begin]; k < s->begin[end]; ++k)
        x[s->member[k]] += s->step[k];
}
