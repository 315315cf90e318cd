/* SPDX-License-Identifier: MIT
 * The hierarchy and its cycle. */
#include "algebra/dense.h"
#include "algebra/multigrid_internal.h"
#include "base/allocate.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

#define N_COARSEST 200 /* variables at which a dense factor takes over */
#define MOST_DENSE 800 /* ... and what it can take where coarsening ended early */
#define NS_A_ROW   12.0
/* Entries of level 0 are below 2 to this in single precision, which ends at 2^128: sums of many on coarser levels still fit. */
#define MOST_EXPONENT 100
/* ... and inverses below this. */
#define MOST_INVERSE 0x1p126
/* A pivot of the coarsest level below this share of its diagonal is that of a constant. */
#define GROUNDED 1e-12
/* Levels from this one on, of a sixtieth of the variables and less, are visited twice a cycle: that costs a twentieth and
 * saves a fifth of the steps. */
#define FIRST_TWICE 2
/* ... where they are so much smaller than the one before: the visits together stay linear. */
#define LEAST_RATIO 4

static void destroy_map(loxo_context *ctx, mg_map *map)
{
    loxo_release(ctx, map->begin);
    loxo_release(ctx, map->column);
    loxo_release(ctx, map->value);
}

void loxo_multigrid_destroy(loxo_multigrid *mg)
{
    if (mg == NULL) return;
    loxo_context *ctx = mg->ctx;
    for (int i = 0; i < MG_MAX_LEVELS; ++i) {
        mg_level *l = &mg->level[i];
        if (i > 0) {
            loxo_release(ctx, l->row);
            loxo_release(ctx, l->column);
        }
        loxo_release(ctx, l->weight);
        loxo_release(ctx, l->excess);
        loxo_release(ctx, l->inverse);
        loxo_release(ctx, l->strongest);
        loxo_release(ctx, l->x);
        loxo_release(ctx, l->y);
        loxo_release(ctx, l->b);
        loxo_release(ctx, l->x_more);
        loxo_release(ctx, l->b_more);
        mg_destroy_stiff(ctx, l);
        destroy_map(ctx, &l->up);
        destroy_map(ctx, &l->down);
    }
    loxo_release(ctx, mg->dense);
    loxo_release(ctx, mg->step);
    loxo_release(ctx, mg);
}

/* Sum of what stands in row i, in absolute values; NaN or infinite where the row is no good. */
static double size_of_row(const loxo_csr *a, int64_t i)
{
    double size = a->diagonal[i] >= 0.0 ? a->diagonal[i] : (double)NAN;
    for (int64_t k = a->begin[i]; k < a->begin[i + 1]; ++k)
        size += fabs(a->value[k]);
    return size;
}

/* A power of two that brings diagonals to about 1, and no entry beyond single precision. */
static double choose_scale(int64_t n_there, int64_t exponents, double largest)
{
    if (n_there == 0) return 1.0;
    double exponent = -rint((double)exponents / (double)n_there);
    if (largest > 0.0) exponent = fmin(exponent, (double)(MOST_EXPONENT - 1 - ilogb(largest)));
    return exp2(fmin(exponent, 1000.0)); /* which is still a number where all entries are near the least one */
}

/* Weights and excesses of level 0, scaled. What is below the range of single precision then vanishes, from the
 * preconditioner only. */
static loxo_status take_matrix(loxo_multigrid *mg)
{
    loxo_context *ctx = mg->ctx;
    const loxo_csr *a = mg->matrix;
    mg_level *l = &mg->level[0];
    int64_t n_bad = 0, n_there = 0, exponents = 0, n_excess = 0;
    double largest = 0.0;
    *l = (mg_level){.n = a->n_rows, .row = a->begin, .column = a->column};
#pragma omp parallel num_threads(loxo_threads_for(ctx, a->n_rows, NS_A_ROW))                                           \
    reduction(+ : n_bad, n_there, exponents, n_excess) reduction(max : largest)
    {
        const loxo_range r = loxo_csr_share(a, loxo_thread_id(), loxo_thread_count());
        for (int64_t i = r.begin; i < r.end; ++i) {
            const double size = size_of_row(a, i);
            if (!isfinite(size)) {
                ++n_bad;
                continue;
            }
            largest = size > largest ? size : largest;
            n_there += a->diagonal[i] > 0.0;
            exponents += a->diagonal[i] > 0.0 ? ilogb(a->diagonal[i]) : 0;
            n_excess += loxo_csr_excess(a, i) != 0.0;
        }
    }
    if (n_bad > 0)
        return loxo_fail(ctx, LOXO_ERR_NUMERIC,
                         "multigrid: the matrix has rows that are not finite or a negative diagonal");
    mg->scale = choose_scale(n_there, exponents, largest);
    l->weight = loxo_allocate(ctx, a->begin[a->n_rows], sizeof *l->weight);
    if (l->weight == NULL) return LOXO_ERR_MEMORY;
    if (n_excess > 0 && (l->excess = loxo_allocate(ctx, a->n_rows, sizeof *l->excess)) == NULL) return LOXO_ERR_MEMORY;
#pragma omp parallel num_threads(loxo_threads_for(ctx, a->n_rows, NS_A_ROW))
    {
        const loxo_range r = loxo_csr_share(a, loxo_thread_id(), loxo_thread_count());
        for (int64_t i = r.begin; i < r.end; ++i) {
            for (int64_t k = a->begin[i]; k < a->begin[i + 1]; ++k)
                l->weight[k] = (float)(-mg->scale * a->value[k]);
            if (l->excess != NULL) l->excess[i] = (float)(mg->scale * loxo_csr_excess(a, i));
        }
    }
    return LOXO_OK;
}

/* inverse_i = 1 / d'_i with d' = max(d, (d + 1.05 o) / 2), o the sum of |a_ij| over entries that leave the block: then
 * M + M^T - A is positive definite for the smoother's M = D' + L, whatever the signs, and so is the cycle. */
static loxo_status prepare_smoother(loxo_multigrid *mg, mg_level *l)
{
    l->block_rows = MG_BLOCK_ROWS;
    while (l->block_rows > 256 && l->block_rows * 64 > l->n)
        l->block_rows /= 2;
    l->inverse = loxo_allocate(mg->ctx, l->n, sizeof *l->inverse);
    l->strongest = loxo_allocate(mg->ctx, l->n, sizeof *l->strongest);
    l->y = loxo_allocate(mg->ctx, l->n, sizeof *l->y);
    if (l->inverse == NULL || l->strongest == NULL || l->y == NULL) return LOXO_ERR_MEMORY;
    if (l != &mg->level[0]) {
        l->x = loxo_allocate(mg->ctx, l->n, sizeof *l->x);
        l->b = loxo_allocate(mg->ctx, l->n, sizeof *l->b);
        if (l->x == NULL || l->b == NULL) return LOXO_ERR_MEMORY;
    }
    if (l >= &mg->level[FIRST_TWICE] && LEAST_RATIO * l->n <= l[-1].n) {
        l->x_more = loxo_allocate(mg->ctx, l->n, sizeof *l->x_more);
        l->b_more = loxo_allocate(mg->ctx, l->n, sizeof *l->b_more);
        if (l->x_more == NULL || l->b_more == NULL) return LOXO_ERR_MEMORY;
    }
#pragma omp parallel num_threads(loxo_threads_for(mg->ctx, l->n, NS_A_ROW))
    {
        const loxo_range r = loxo_thread_range(l->n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            double d = mg_excess(l, i), size = fabs(d), outside = 0.0;
            float most = 0.0f;
            for (int64_t k = l->row[i]; k < l->row[i + 1]; ++k) {
                d += (double)l->weight[k];
                size += fabs((double)l->weight[k]);
                most = l->weight[k] > most ? l->weight[k] : most;
                if (l->column[k] / l->block_rows != i / l->block_rows) outside += fabs((double)l->weight[k]);
            }
            const double bounded = fmax(d, 0.5 * (d + 1.05 * outside));
            const bool has_vanished = size == 0.0 && l == &mg->level[0] && mg->matrix->diagonal[i] > 0.0;
            l->strongest[i] = most;
            l->inverse[i] = 0.0f;
            if (bounded > 1e-6 * size || has_vanished) l->inverse[i] = (float)fmin(1.0 / bounded, MOST_INVERSE);
        }
    }
    return mg_find_stiff(mg->ctx, l);
}

static loxo_status factor_last(loxo_multigrid *mg, loxo_multigrid_info *info)
{
    const mg_level *l = &mg->level[mg->n_levels - 1];
    info->n_coarsest = l->n;
    if (l->n > MOST_DENSE) return LOXO_OK;
    mg->dense = loxo_allocate_zero(mg->ctx, l->n * (l->n + 1) / 2, sizeof *mg->dense);
    if (mg->dense == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < l->n; ++i) {
        double d = mg_excess(l, i), *row = mg->dense + i * (i + 1) / 2;
        for (int64_t k = l->row[i]; k < l->row[i + 1]; ++k) {
            if (l->column[k] < i) row[l->column[k]] = -(double)l->weight[k];
            d += (double)l->weight[k];
        }
        row[i] = d;
    }
    info->n_grounded = loxo_dense_factor(l->n, mg->dense, GROUNDED);
    return LOXO_OK;
}

/* Makes the level after the last; false in *is_made where it would not be much smaller. */
static loxo_status add_level(loxo_multigrid *mg, bool *is_made)
{
    loxo_context *ctx = mg->ctx;
    mg_level *l = &mg->level[mg->n_levels - 1];
    int64_t n_aggregates = 0;
    loxo_status status = LOXO_ERR_MEMORY;
    loxo_index *aggregate = loxo_allocate(ctx, l->n, sizeof *aggregate);
    *is_made = false;
    if (aggregate == NULL) goto done;
    if ((status = mg_aggregate(ctx, l, aggregate, &n_aggregates)) < 0) goto done;
    if (n_aggregates == 0 || n_aggregates > l->n - l->n / 8) goto done;
    if ((status = mg_make_maps(ctx, l, aggregate, n_aggregates)) < 0) goto done;
    ++mg->n_levels;
    *is_made = true;
done:
    loxo_release(ctx, aggregate);
    return status;
}

static void release_strongest(loxo_context *ctx, mg_level *l)
{
    loxo_release(ctx, l->strongest);
    l->strongest = NULL;
}

static void fill_info(const loxo_multigrid *mg, loxo_multigrid_info *info)
{
    double n_entries = 0.0;
    info->n_levels = mg->n_levels;
    for (int i = 0; i < mg->n_levels; ++i)
        n_entries += (double)(mg->level[i].row[mg->level[i].n] + mg->level[i].n);
    const double n_first = (double)(mg->level[0].row[mg->level[0].n] + mg->level[0].n);
    info->operator_complexity = n_first > 0.0 ? n_entries / n_first : 1.0;
}

loxo_status loxo_multigrid_create(loxo_context *ctx, const loxo_csr *matrix, loxo_multigrid_info *info,
                                  loxo_multigrid **out)
{
    loxo_multigrid_info own = {0};
    loxo_status status;
    const size_t before = loxo_context_memory(ctx).current_bytes;
    loxo_multigrid *mg = loxo_allocate_zero(ctx, 1, sizeof *mg);
    *out = NULL;
    if (mg == NULL) return LOXO_ERR_MEMORY;
    mg->ctx = ctx;
    mg->matrix = matrix;
    mg->n_levels = 1;
    if ((status = take_matrix(mg)) < 0) goto fail;
    for (bool is_made = true;;) {
        mg_level *l = &mg->level[mg->n_levels - 1];
        if ((status = prepare_smoother(mg, l)) < 0) goto fail;
        if (l->n <= N_COARSEST || mg->n_levels == MG_MAX_LEVELS) break;
        if (loxo_stop_wanted(ctx, "multigrid", -1.0)) {
            status = LOXO_ERR_STOPPED;
            goto fail;
        }
        if ((status = add_level(mg, &is_made)) < 0) goto fail;
        release_strongest(ctx, l);
        if (!is_made) break;
        if ((status = mg_make_coarse(ctx, l, l + 1)) < 0) goto fail;
    }
    release_strongest(ctx, &mg->level[mg->n_levels - 1]);
    if ((status = factor_last(mg, &own)) < 0 || (status = mg_plan_cycle(mg)) < 0) goto fail;
    fill_info(mg, &own);
    own.bytes = loxo_context_memory(ctx).current_bytes - before;
    if (info != NULL) *info = own;
    *out = mg;
    return LOXO_OK;
fail:
    loxo_multigrid_destroy(mg);
    return status;
}
