/* SPDX-License-Identifier: MIT */
#include "algebra/cholesky.h"

#include "base/allocate.h"
#include "base/os.h"
#include "loxo_config.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

size_t loxo_cholesky_guess_bytes(int64_t n_rows)
{
    const double n = (double)n_rows, entries = n > 100.0 ? 4.2 * log2(n) + 14.0 : 0.5 * n;
    return (size_t)(n * (96.0 + 8.0 * entries));
}

#ifdef LOXO_WITH_CHOLMOD

#include <suitesparse/cholmod.h>

#define TEXT_OF(x)  #x
#define VALUE_OF(x) TEXT_OF(x)
#define LIBRARY     "libcholmod.so." VALUE_OF(CHOLMOD_MAIN_VERSION)

/* What is called of it, found when the first factor is made: CHOLMOD brings BLAS, LAPACK and the runtime of Fortran, which
 * otherwise every program would load with us. The interface with 64-bit integers: the factor of a mesh of 30 million
 * vertices has over 2^31 entries. */
typedef struct cholmod_calls {
    __typeof__(&cholmod_l_start) start;
    __typeof__(&cholmod_l_finish) finish;
    __typeof__(&cholmod_l_analyze) analyze;
    __typeof__(&cholmod_l_factorize) factorize;
    __typeof__(&cholmod_l_solve2) solve2;
    __typeof__(&cholmod_l_allocate_sparse) allocate_sparse;
    __typeof__(&cholmod_l_free_sparse) free_sparse;
    __typeof__(&cholmod_l_free_factor) free_factor;
    __typeof__(&cholmod_l_free_dense) free_dense;
} cholmod_calls;

static const struct {
    const char *name;
    size_t offset;
} functions[] = {
    {"cholmod_l_start", offsetof(cholmod_calls, start)},
    {"cholmod_l_finish", offsetof(cholmod_calls, finish)},
    {"cholmod_l_analyze", offsetof(cholmod_calls, analyze)},
    {"cholmod_l_factorize", offsetof(cholmod_calls, factorize)},
    {"cholmod_l_solve2", offsetof(cholmod_calls, solve2)},
    {"cholmod_l_allocate_sparse", offsetof(cholmod_calls, allocate_sparse)},
    {"cholmod_l_free_sparse", offsetof(cholmod_calls, free_sparse)},
    {"cholmod_l_free_factor", offsetof(cholmod_calls, free_factor)},
    {"cholmod_l_free_dense", offsetof(cholmod_calls, free_dense)},
};

static bool find_calls(cholmod_calls *calls)
{
    void *library = loxo_os_library(LIBRARY);
    if (library == NULL) return false;
    for (size_t i = 0; i < sizeof functions / sizeof functions[0]; ++i) {
        void (*const function)(void) = loxo_os_function(library, functions[i].name);
        if (function == NULL) return false;
        memcpy((char *)calls + functions[i].offset, &function, sizeof function);
    }
    return true;
}

struct loxo_cholesky {
    loxo_context *ctx;
    cholmod_calls call;
    int64_t n;
    bool is_indefinite;
    int64_t fixed; /* -1: none */
    cholmod_common common;
    cholmod_factor *factor;
    cholmod_dense *x, *y, *e; /* kept from one solve to the next */
};

bool loxo_cholesky_is_there(void)
{
    cholmod_calls calls;
    return find_calls(&calls);
}

static loxo_status fail_by(const loxo_cholesky *c, const char *what)
{
    const int status = c->common.status;
    return loxo_fail(c->ctx,
                     status == CHOLMOD_OUT_OF_MEMORY ? LOXO_ERR_MEMORY
                     : status == CHOLMOD_TOO_LARGE   ? LOXO_ERR_LIMIT
                                                     : LOXO_ERR_NUMERIC,
                     "Cholesky: %s failed (CHOLMOD status %d)", what, status);
}

/* The diagonal as it is factored. */
static double pivot_of(const loxo_cholesky *c, const loxo_csr *a, int64_t i)
{
    const bool is_there =
        c->is_indefinite ? a->begin[i] < a->begin[i + 1] || a->diagonal[i] != 0.0 : a->diagonal[i] > 0.0;
    return is_there && i != c->fixed ? a->diagonal[i] : 1.0;
}

/* Lower triangle by columns, which are the rows' entries from the diagonal on. NULL: no memory. */
static cholmod_sparse *make_sparse(loxo_cholesky *c, const loxo_csr *a)
{
    const size_t n = (size_t)a->n_rows, n_most = (size_t)(a->begin[a->n_rows] / 2) + n;
    cholmod_sparse *s = c->call.allocate_sparse(n, n, n_most, 1, 1, -1, CHOLMOD_REAL, &c->common);
    if (s == NULL) return NULL;
    SuiteSparse_long *start = s->p, *row = s->i, to = 0;
    double *value = s->x;
    for (int64_t i = 0; i < a->n_rows; ++i) {
        start[i] = to;
        row[to] = i;
        value[to++] = pivot_of(c, a, i);
        for (int64_t k = a->begin[i]; k < a->begin[i + 1]; ++k) {
            if (a->column[k] < i) continue;
            row[to] = a->column[k];
            value[to++] = i == c->fixed || a->column[k] == c->fixed ? 0.0 : a->value[k];
        }
    }
    start[a->n_rows] = to;
    return s;
}

static loxo_status create(loxo_context *ctx, const loxo_csr *matrix, bool is_indefinite, int64_t fixed,
                          loxo_cholesky_info *info, loxo_cholesky **out)
{
    loxo_cholesky_info own = {0};
    loxo_status status = LOXO_OK;
    loxo_cholesky *c = loxo_allocate_zero(ctx, 1, sizeof *c);
    *out = NULL;
    if (c == NULL) return LOXO_ERR_MEMORY;
    c->ctx = ctx;
    c->n = matrix->n_rows;
    c->is_indefinite = is_indefinite;
    c->fixed = fixed;
    if (!find_calls(&c->call) || c->call.start(&c->common) == 0) {
        loxo_release(ctx, c);
        return loxo_fail(ctx, LOXO_ERR_UNSUPPORTED, "Cholesky: " LIBRARY " cannot be loaded");
    }
    c->common.print = 0;
    if (is_indefinite) c->common.supernodal = CHOLMOD_SIMPLICIAL;
    cholmod_sparse *s = make_sparse(c, matrix);
    if (s != NULL) c->factor = c->call.analyze(s, &c->common);
    c->call.free_sparse(&s, &c->common);
    if (c->factor == NULL) {
        status = fail_by(c, "the analysis");
        goto fail;
    }
    own.n_entries = c->factor->is_super ? (double)c->factor->xsize : c->common.lnz;
    own.n_flops = c->common.fl;
    own.factor_bytes = (size_t)own.n_entries * (sizeof(double) + (c->factor->is_super ? 0 : sizeof(SuiteSparse_long))) +
                       c->factor->ssize * sizeof(SuiteSparse_long) + c->factor->maxcsize * sizeof(double) +
                       (size_t)matrix->n_rows * 12 * sizeof(SuiteSparse_long);
    if (info != NULL) *info = own;
    if ((status = loxo_memory_check(ctx, own.factor_bytes, "Cholesky: the factor")) < 0) goto fail;
    *out = c;
    return LOXO_OK;
fail:
    loxo_cholesky_destroy(c);
    return status;
}

loxo_status loxo_cholesky_create(loxo_context *ctx, const loxo_csr *matrix, loxo_cholesky_info *info,
                                 loxo_cholesky **out)
{
    return create(ctx, matrix, false, -1, info, out);
}

loxo_status loxo_cholesky_create_indefinite(loxo_context *ctx, const loxo_csr *matrix, int64_t fixed,
                                            loxo_cholesky_info *info, loxo_cholesky **out)
{
    return create(ctx, matrix, true, fixed, info, out);
}

loxo_status loxo_cholesky_factor(loxo_cholesky *c, const loxo_csr *matrix)
{
    cholmod_sparse *s = make_sparse(c, matrix);
    const bool is_done = s != NULL && c->call.factorize(s, c->factor, &c->common) != 0;
    c->call.free_sparse(&s, &c->common);
    /* L D L^T goes on past a negative pivot. */
    int64_t at = is_done && c->factor->minor < c->factor->n ? (int64_t)c->factor->minor : -1;
    if (is_done && !c->factor->is_super && !c->factor->is_ll && at < 0) {
        const SuiteSparse_long *start = c->factor->p;
        const double *x = c->factor->x;
        for (int64_t j = 0; j < c->n && at < 0; ++j)
            if (!isfinite(x[start[j]]) || x[start[j]] == 0.0 || (x[start[j]] < 0.0 && !c->is_indefinite)) at = j;
    }
    if (at >= 0) {
        const SuiteSparse_long *order = c->factor->Perm;
        const loxo_place place = {.byte = -1, .element = order != NULL ? order[at] : at};
        return loxo_fail_at(c->ctx, LOXO_ERR_NUMERIC, place, "Cholesky: the matrix is %s",
                            c->is_indefinite ? "singular" : "not positive definite");
    }
    return is_done ? LOXO_OK : fail_by(c, "the factor");
}

loxo_status loxo_cholesky_solve(loxo_cholesky *c, const double *b, double *x)
{
    const size_t n = (size_t)c->n;
    cholmod_dense right = {.nrow = n, .ncol = 1, .nzmax = n, .d = n, .xtype = CHOLMOD_REAL, .dtype = CHOLMOD_DOUBLE};
    memcpy(&right.x, &b, sizeof b); /* the field is not const, but it is only read */
    if (c->call.solve2(CHOLMOD_A, c->factor, &right, NULL, &c->x, NULL, &c->y, &c->e, &c->common) == 0)
        return fail_by(c, "a solve");
    memcpy(x, c->x->x, n * sizeof *x);
    return LOXO_OK;
}

/* Neighbouring columns of L with the same rows below them: a supernode, or one column of a factor without these. Entry
 * (row[r], first + c) is x[c n_rows + r]; the first n_columns rows are those of the columns. */
typedef struct block {
    int64_t first, n_columns, n_rows;
    const SuiteSparse_long *row;
    const double *x;
} block;

static block block_of(const cholmod_factor *f, int64_t column)
{
    const double *x = f->x;
    if (!f->is_super) {
        const SuiteSparse_long *begin = f->p, *row = f->i, *n_rows = f->nz;
        return (block){column, 1, n_rows[column], row + begin[column], x + begin[column]};
    }
    const SuiteSparse_long *first = f->super, *row = f->s, *rows_at = f->pi, *x_at = f->px;
    int64_t low = 0, high = (int64_t)f->nsuper; /* first[low] <= column < first[high] */
    while (high - low > 1) {
        const int64_t middle = low + (high - low) / 2;
        if (first[middle] <= column)
            low = middle;
        else
            high = middle;
    }
    return (block){first[low], first[low + 1] - first[low], rows_at[low + 1] - rows_at[low], row + rows_at[low],
                   x + x_at[low]};
}

/* The first row below a block is that of its columns' parent in the elimination tree; -1: there is none. */
static int64_t parent_of(const block *b) { return b->n_rows > b->n_columns ? b->row[b->n_columns] : -1; }

static int64_t count_ancestors(const cholmod_factor *f, int64_t column)
{
    int64_t n = 0;
    while (column >= 0) {
        const block b = block_of(f, column);
        n += b.n_columns;
        column = parent_of(&b);
    }
    return n;
}

/* L^-1 e, e the unit vector of a column, or D^-1/2 L^-1 e where the factor is L D L^T: at most count_ancestors entries;
 * returns how many. work: zeros, before and after. */
static int64_t solve_unit(const cholmod_factor *f, int64_t column, double *work, loxo_index *at, double *value)
{
    int64_t n = 0;
    work[column] = 1.0;
    while (column >= 0) {
        const block b = block_of(f, column);
        for (int64_t c = 0; c < b.n_columns; ++c) {
            const double *x = b.x + c * b.n_rows;
            double own = work[b.first + c];
            work[b.first + c] = 0.0;
            if (own == 0.0) continue;
            if (f->is_ll) own /= x[c];
            for (int64_t r = c + 1; r < b.n_rows; ++r)
                work[b.row[r]] -= x[r] * own;
            at[n] = (loxo_index)(b.first + c);
            value[n++] = f->is_ll ? own : own / sqrt(x[c]);
        }
        column = parent_of(&b);
    }
    return n;
}

/* What L^-1 makes of unit vectors: of number i the entries begin[i] .. end[i] - 1. */
typedef struct units {
    int64_t *begin, *end;
    loxo_index *at;
    double *value;
} units;

/* inverse_ij = (L^-1 e_i) . (L^-1 e_j) for low <= j <= i < high; returns where the next number goes. */
static double *multiply_units(const units *u, int64_t low, int64_t high, double *work, double *inverse)
{
    for (int64_t i = low; i < high; ++i) {
        for (int64_t k = u->begin[i]; k < u->end[i]; ++k)
            work[u->at[k]] = u->value[k];
        for (int64_t j = low; j <= i; ++j) {
            double sum = 0.0;
            for (int64_t k = u->begin[j]; k < u->end[j]; ++k)
                sum += u->value[k] * work[u->at[k]];
            *inverse++ = sum;
        }
        for (int64_t k = u->begin[i]; k < u->end[i]; ++k)
            work[u->at[k]] = 0.0;
    }
    return inverse;
}

loxo_status loxo_cholesky_inverse(const loxo_cholesky *c, int64_t n_groups, const int64_t *begin,
                                  const loxo_index *variable, double *inverse)
{
    loxo_context *ctx = c->ctx;
    const SuiteSparse_long *order = c->factor->Perm;
    const int64_t n = begin[n_groups];
    loxo_status status = LOXO_ERR_MEMORY;
    double *work = loxo_allocate_zero(ctx, c->n, sizeof *work);
    loxo_index *position = loxo_allocate(ctx, c->n, sizeof *position);
    units u = {.begin = loxo_allocate(ctx, n + 1, sizeof *u.begin), .end = loxo_allocate(ctx, n, sizeof *u.end)};
    if (work == NULL || position == NULL || u.begin == NULL || u.end == NULL) goto done;
    for (int64_t k = 0; k < c->n; ++k)
        position[order != NULL ? order[k] : k] = (loxo_index)k;
    u.begin[0] = 0;
    for (int64_t i = 0; i < n; ++i)
        u.begin[i + 1] = u.begin[i] + count_ancestors(c->factor, position[variable[i]]);
    u.at = loxo_allocate(ctx, u.begin[n], sizeof *u.at);
    u.value = loxo_allocate(ctx, u.begin[n], sizeof *u.value);
    if (u.at == NULL || u.value == NULL) goto done;
    for (int64_t i = 0; i < n; ++i) {
        const int64_t to = u.begin[i];
        u.end[i] = to + solve_unit(c->factor, position[variable[i]], work, u.at + to, u.value + to);
    }
    for (int64_t g = 0; g < n_groups; ++g)
        inverse = multiply_units(&u, begin[g], begin[g + 1], work, inverse);
    status = LOXO_OK;
done:
    loxo_release(ctx, work);
    loxo_release(ctx, position);
    loxo_release(ctx, u.begin);
    loxo_release(ctx, u.end);
    loxo_release(ctx, u.at);
    loxo_release(ctx, u.value);
    return status;
}

void loxo_cholesky_destroy(loxo_cholesky *c)
{
    if (c == NULL) return;
    c->call.free_dense(&c->x, &c->common);
    c->call.free_dense(&c->y, &c->common);
    c->call.free_dense(&c->e, &c->common);
    c->call.free_factor(&c->factor, &c->common);
    c->call.finish(&c->common);
    loxo_release(c->ctx, c);
}

#else

bool loxo_cholesky_is_there(void) { return false; }

loxo_status loxo_cholesky_create(loxo_context *ctx, const loxo_csr *matrix, loxo_cholesky_info *info,
                                 loxo_cholesky **out)
{
    (void)matrix;
    *out = NULL;
    if (info != NULL) *info = (loxo_cholesky_info){0};
    return loxo_fail(ctx, LOXO_ERR_UNSUPPORTED, "Cholesky: this build has no CHOLMOD");
}

loxo_status loxo_cholesky_create_indefinite(loxo_context *ctx, const loxo_csr *matrix, int64_t fixed,
                                            loxo_cholesky_info *info, loxo_cholesky **out)
{
    (void)fixed;
    return loxo_cholesky_create(ctx, matrix, info, out);
}

/* None is ever made. */
loxo_status loxo_cholesky_factor(loxo_cholesky *cholesky, const loxo_csr *matrix)
{
    (void)cholesky;
    (void)matrix;
    return LOXO_ERR_UNSUPPORTED;
}

loxo_status loxo_cholesky_solve(loxo_cholesky *cholesky, const double *b, double *x)
{
    (void)cholesky;
    (void)b;
    (void)x;
    return LOXO_ERR_UNSUPPORTED;
}

loxo_status loxo_cholesky_inverse(const loxo_cholesky *cholesky, int64_t n_groups, const int64_t *begin,
                                  const loxo_index *variable, double *inverse)
{
    (void)cholesky;
    (void)n_groups;
    (void)begin;
    (void)variable;
    (void)inverse;
    return LOXO_ERR_UNSUPPORTED;
}

void loxo_cholesky_destroy(loxo_cholesky *cholesky) { (void)cholesky; }

#endif
