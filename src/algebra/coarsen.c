/* SPDX-License-Identifier: MIT
 * The matrix of the next level. */
#include "algebra/adder.h"
#include "algebra/multigrid_internal.h"
#include "base/allocate.h"

#define GUESSED_ROW 12 /* entries a row that the first turn has room for */

/* Rows of the product go where there is room next, by whichever thread, and are put in order at the end. */
typedef struct product {
    const mg_level *fine;
    mg_level *coarse;
    int64_t room, used; /* entries; used counts on past the room */
    loxo_index *column; /* [room] */
    float *weight;      /* [room] */
    int64_t *place;     /* [coarse->n] of a row's first entry */
} product;

/* No row of the product has more entries: each of P^T meets rows of A, and each entry of those a row of P. */
static int64_t longest_product(loxo_context *ctx, const mg_level *l)
{
    int64_t most = 0, longest = 1;
    for (int64_t i = 0; i < l->n; ++i) {
        const int64_t n = l->up.begin[i + 1] - l->up.begin[i];
        longest = n > longest ? n : longest;
    }
#pragma omp parallel num_threads(loxo_threads_for(ctx, l->n, 5.0)) reduction(max : most)
    {
        const loxo_range r = loxo_thread_range(l->down.n_rows);
        for (int64_t i = r.begin; i < r.end; ++i) {
            int64_t n = 0;
            for (uint32_t e = l->down.begin[i]; e < l->down.begin[i + 1]; ++e)
                n += 1 + l->row[l->down.column[e] + 1] - l->row[l->down.column[e]];
            most = n > most ? n : most;
        }
    }
    return most < l->down.n_rows / longest ? most * longest : l->down.n_rows;
}

/* Row i of P^T A P, as an excess, which is returned, and entries; the diagonal's is of no use. The excess is what it makes
 * of constants, P^T A s with s = P 1: s_j is 1 almost everywhere, exactly, and what is added up then is the fine excess. */
static double add_product_row(const mg_level *l, int64_t i, mg_adder *a)
{
    const mg_map *up = &l->up;
    double total = 0.0;
    for (uint32_t e = l->down.begin[i]; e < l->down.begin[i + 1]; ++e) {
        const int64_t from = l->down.column[e];
        const double share = (double)l->down.value[e] / MG_ONE;
        double diagonal = mg_excess(l, from), own = 0.0, others = 0.0;
        for (int64_t k = l->row[from]; k < l->row[from + 1]; ++k) {
            const double w = (double)l->weight[k];
            const loxo_index j = l->column[k];
            int32_t sum = 0;
            diagonal += w;
            for (uint32_t q = up->begin[j]; q < up->begin[j + 1]; ++q) {
                mg_adder_add(a, up->column[q], share * w / MG_ONE * (double)up->value[q]);
                sum += up->value[q];
            }
            others += w * (1.0 - (double)sum / MG_ONE);
        }
        for (uint32_t q = up->begin[from]; q < up->begin[from + 1]; ++q) {
            mg_adder_add(a, up->column[q], -share * diagonal / MG_ONE * (double)up->value[q]);
            own += (double)up->value[q] / MG_ONE;
        }
        /* A s = d s_i - sum_j w_ij s_j = excess + sum_j w_ij (1 - s_j) - d (1 - s_i) */
        total += share * (mg_excess(l, from) + others - diagonal * (1.0 - own));
    }
    return total;
}

/* Rows begin..end-1; coarse->row[i + 1] gets the count of row i. */
static void make_rows(product *p, int64_t begin, int64_t end, mg_adder *a)
{
    mg_level *c = p->coarse;
    for (int64_t i = begin; i < end; ++i) {
        const double excess = add_product_row(p->fine, i, a);
        if (c->excess != NULL) c->excess[i] = (float)excess;
        int64_t n = 0;
        for (int64_t k = 0; k < a->n; ++k)
            n += a->column[k] != i && (float)a->value[k] != 0.0f;
        c->row[i] = n;
        p->place[i] = __atomic_fetch_add(&p->used, n, __ATOMIC_RELAXED);
        int64_t to = p->place[i];
        for (int64_t k = 0; k < a->n && p->place[i] + n <= p->room; ++k) {
            if (a->column[k] == i || (float)a->value[k] == 0.0f) continue;
            p->column[to] = a->column[k];
            p->weight[to++] = (float)a->value[k];
        }
        mg_adder_clear(a);
    }
}

static void put_in_order(loxo_context *ctx, const product *p)
{
    const mg_level *c = p->coarse;
#pragma omp parallel num_threads(loxo_threads_for(ctx, c->n, 100.0))
    {
        const loxo_range r = loxo_thread_range(c->n);
        for (int64_t i = r.begin; i < r.end; ++i)
            for (int64_t k = 0; k < c->row[i + 1] - c->row[i]; ++k) { /* by insertion: rows are short */
                const loxo_index column = p->column[p->place[i] + k];
                int64_t to = c->row[i] + k;
                for (; to > c->row[i] && c->column[to - 1] > column; --to) {
                    c->column[to] = c->column[to - 1];
                    c->weight[to] = c->weight[to - 1];
                }
                c->column[to] = column;
                c->weight[to] = p->weight[p->place[i] + k];
            }
    }
}

loxo_status mg_make_coarse(loxo_context *ctx, const mg_level *fine, mg_level *coarse)
{
    const int64_t n = fine->down.n_rows;
    const int n_threads = loxo_threads_for(ctx, n, 1000.0);
    product p = {.fine = fine, .coarse = coarse, .room = GUESSED_ROW * n};
    loxo_status status = LOXO_ERR_MEMORY;
    mg_adder *adders = mg_create_adders(ctx, n_threads, longest_product(ctx, fine));
    if (adders == NULL) return LOXO_ERR_MEMORY;
    coarse->n = n;
    coarse->row = loxo_allocate(ctx, n + 1, sizeof *coarse->row);
    if (fine->excess != NULL) coarse->excess = loxo_allocate(ctx, n, sizeof *coarse->excess);
    p.place = loxo_allocate(ctx, n, sizeof *p.place);
    if (coarse->row == NULL || (coarse->excess != NULL) != (fine->excess != NULL) || p.place == NULL) goto done;
    for (;;) {
        p.column = loxo_allocate(ctx, p.room, sizeof *p.column);
        p.weight = loxo_allocate(ctx, p.room, sizeof *p.weight);
        if (p.column == NULL || p.weight == NULL) goto done;
        p.used = 0;
#pragma omp parallel num_threads(n_threads)
        {
            const loxo_range r = loxo_thread_range(n);
            make_rows(&p, r.begin, r.end, &adders[loxo_thread_id()]);
        }
        if (p.used <= p.room) break;
        loxo_release(ctx, p.column);
        loxo_release(ctx, p.weight);
        p.room = p.used;
    }
    const int64_t n_entries = loxo_scan_in_place(ctx, n, coarse->row);
    coarse->column = loxo_allocate(ctx, n_entries, sizeof *coarse->column);
    coarse->weight = loxo_allocate(ctx, n_entries, sizeof *coarse->weight);
    if (coarse->column == NULL || coarse->weight == NULL) goto done;
    put_in_order(ctx, &p);
    status = LOXO_OK;
done:
    loxo_release(ctx, p.column);
    loxo_release(ctx, p.weight);
    loxo_release(ctx, p.place);
    mg_destroy_adders(ctx, n_threads, adders);
    return status;
}
