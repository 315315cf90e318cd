/* SPDX-License-Identifier: MIT */
#include "algebra/cg.h"

#include "base/allocate.h"
#include "base/arena.h"
#include "kernel/sparse_kernel.h"

#include <math.h>
#include <string.h>

#define NS_A_ROW 5.0 /* of a short pass */
#define BLOCK    LOXO_SUM_BLOCK

struct loxo_cg {
    loxo_context *ctx;
    const loxo_csr *a;
    loxo_arena arena;
    double *r, *p, *q; /* q: of A p, and of M r before the next p is made of it */
    double *part;      /* [n_blocks] sums of blocks */
    loxo_index *label; /* set of a variable; NULL where there is one set only */
    double *set_mean;  /* [n_sets] */
    double *set_size;  /* [n_sets] variables; 0: not singular */
    int64_t n_sets, n_singular;
};

loxo_cg_settings loxo_cg_settings_default(void) { return (loxo_cg_settings){.tolerance = 1e-8, .max_iterations = 500}; }

void loxo_diagonal_apply(void *diagonal, const double *r, double *z)
{
    const loxo_diagonal *m = diagonal;
    const int64_t n = m->matrix->n_rows;
#pragma omp parallel num_threads(loxo_threads_for(m->ctx, n, 2.0))
    {
        const loxo_range range = loxo_thread_range(n);
        for (int64_t i = range.begin; i < range.end; ++i) {
            const double d = m->matrix->diagonal[i];
            z[i] = d > 0.0 ? r[i] / d : 0.0;
        }
    }
}

static void lay_out(loxo_cg *cg)
{
    loxo_arena *arena = &cg->arena;
    const int64_t n = cg->a->n_rows;
    cg->r = loxo_arena_take(arena, n, sizeof *cg->r);
    cg->p = loxo_arena_take(arena, n, sizeof *cg->p);
    cg->q = loxo_arena_take(arena, n, sizeof *cg->q);
    cg->part = loxo_arena_take(arena, n / BLOCK + 1, sizeof *cg->part);
}

size_t loxo_cg_bytes(int64_t n_rows)
{
    const size_t n = (size_t)n_rows;
    return (n * 3 + n / BLOCK + 2) * sizeof(double);
}

int64_t loxo_cg_n_singular(const loxo_cg *cg) { return cg->n_singular; }

static bool has_excess(const loxo_cg *cg)
{
    const loxo_csr *a = cg->a;
    bool is_any = false;
#pragma omp parallel num_threads(loxo_threads_for(cg->ctx, a->n_rows, NS_A_ROW)) reduction(|| : is_any)
    {
        const loxo_range r = loxo_csr_share(a, loxo_thread_id(), loxo_thread_count());
        for (int64_t i = r.begin; i < r.end && !is_any; ++i)
            is_any = loxo_csr_excess(a, i) != 0.0;
    }
    return is_any;
}

/* Sets whose rows sum to zero within rounding have constants as their null space. */
static void find_singular(loxo_cg *cg)
{
    const loxo_csr *a = cg->a;
    for (int64_t s = 0; s < cg->n_sets; ++s)
        cg->set_size[s] = cg->set_mean[s] = 0.0;
    for (int64_t i = 0; i < a->n_rows; ++i)
        cg->set_size[cg->label[i]] += 1.0;
    if (has_excess(cg))
        for (int64_t i = 0; i < a->n_rows; ++i)
            if (loxo_csr_excess(a, i) != 0.0) cg->set_mean[cg->label[i]] = 1.0; /* not singular */
    for (int64_t s = 0; s < cg->n_sets; ++s) {
        if (cg->set_mean[s] != 0.0) cg->set_size[s] = 0.0;
        cg->n_singular += cg->set_size[s] > 0.0;
    }
}

loxo_status loxo_cg_create(loxo_context *ctx, const loxo_csr *matrix, loxo_cg **out)
{
    loxo_status status = LOXO_ERR_MEMORY;
    loxo_cg *cg = loxo_allocate(ctx, 1, sizeof *cg);
    *out = NULL;
    if (cg == NULL) return LOXO_ERR_MEMORY;
    *cg = (loxo_cg){.ctx = ctx, .a = matrix};
    if ((cg->label = loxo_allocate(ctx, matrix->n_rows, sizeof *cg->label)) == NULL) goto fail;
    if ((status = loxo_csr_components(ctx, matrix, cg->label, &cg->n_sets)) < 0) goto fail;
    status = LOXO_ERR_MEMORY;
    if ((cg->set_mean = loxo_allocate(ctx, cg->n_sets, sizeof *cg->set_mean)) == NULL) goto fail;
    if ((cg->set_size = loxo_allocate(ctx, cg->n_sets, sizeof *cg->set_size)) == NULL) goto fail;
    find_singular(cg);
    if (cg->n_sets == 1) {
        loxo_release(ctx, cg->label);
        cg->label = NULL;
    }
    lay_out(cg);
    if ((status = loxo_arena_reserve(ctx, &cg->arena, "conjugate gradients: the workspace")) < 0) goto fail;
    lay_out(cg);
    *out = cg;
    return LOXO_OK;
fail:
    loxo_cg_destroy(cg);
    return status;
}

void loxo_cg_destroy(loxo_cg *cg)
{
    if (cg == NULL) return;
    loxo_context *ctx = cg->ctx;
    loxo_release(ctx, cg->label);
    loxo_release(ctx, cg->set_mean);
    loxo_release(ctx, cg->set_size);
    loxo_arena_destroy(ctx, &cg->arena);
    loxo_release(ctx, cg);
}

/* ---- passes over the vectors: each block leaves its sum, and these are added in order ---------------------------- */

typedef struct pass {
    const loxo_cg *cg;
    const double *b;
    double *x;
    double alpha;
    double unit,
        back; /* b and all that follows from it are worked on times a power of two, unit; x is not: back = 1 / unit */
} pass;

/* Rows begin..end-1 of a pass, and their part of its sum. */
typedef double (*pass_fn)(const pass *s, int64_t begin, int64_t end);

static double run(const pass *s, pass_fn fn)
{
    const loxo_cg *cg = s->cg;
    const int64_t n = cg->a->n_rows;
#pragma omp parallel num_threads(loxo_threads_for(cg->ctx, n, NS_A_ROW))
    {
        const loxo_range r = loxo_csr_share(cg->a, loxo_thread_id(), loxo_thread_count());
        for (int64_t begin = r.begin; begin < r.end; begin += BLOCK)
            cg->part[begin / BLOCK] = fn(s, begin, begin + BLOCK < r.end ? begin + BLOCK : r.end);
    }
    double sum = 0.0;
    for (int64_t block = 0; block < (n + BLOCK - 1) / BLOCK; ++block)
        sum += cg->part[block];
    return sum;
}

/* r = b - A x; sum: r . r */
static double pass_residual(const pass *s, int64_t begin, int64_t end)
{
    double sum = 0.0;
    const loxo_csr *a = s->cg->a;
    double *r = s->cg->r;
    k_csr_multiply(a->begin, a->column, a->value, a->diagonal, begin, end, s->x, r);
    for (int64_t i = begin; i < end; ++i) {
        r[i] = s->unit * (s->b[i] - r[i]);
        sum += r[i] * r[i];
    }
    return sum;
}

/* q = A p; sum: p . q */
static double pass_product(const pass *s, int64_t begin, int64_t end)
{
    double sum = 0.0;
    const loxo_csr *a = s->cg->a;
    const double *p = s->cg->p;
    double *q = s->cg->q;
    k_csr_multiply(a->begin, a->column, a->value, a->diagonal, begin, end, p, q);
    for (int64_t i = begin; i < end; ++i)
        sum += p[i] * q[i];
    return sum;
}

/* x += alpha p, r -= alpha q; sum: r . r */
static double pass_step(const pass *s, int64_t begin, int64_t end)
{
    double sum = 0.0;
    const double *p = s->cg->p, *q = s->cg->q;
    double *r = s->cg->r;
    const double of_x = s->alpha * s->back;
    for (int64_t i = begin; i < end; ++i) {
        s->x[i] += of_x * p[i];
        r[i] -= s->alpha * q[i];
        sum += r[i] * r[i];
    }
    return sum;
}

/* sum: q . r, q = M r */
static double pass_products(const pass *s, int64_t begin, int64_t end)
{
    double sum = 0.0;
    const double *q = s->cg->q, *r = s->cg->r;
    for (int64_t i = begin; i < end; ++i)
        sum += q[i] * r[i];
    return sum;
}

/* p = q + alpha p, q = M r; without a p yet, alpha is 0 */
static double pass_direction(const pass *s, int64_t begin, int64_t end)
{
    const double *q = s->cg->q;
    double *p = s->cg->p;
    if (s->alpha == 0.0) {
        memcpy(p + begin, q + begin, (size_t)(end - begin) * sizeof *p);
        return 0.0;
    }
    for (int64_t i = begin; i < end; ++i)
        p[i] = q[i] + s->alpha * p[i];
    return 0.0;
}

/* q = b in its unit; sum: its square */
static double pass_take(const pass *s, int64_t begin, int64_t end)
{
    double sum = 0.0;
    double *q = s->cg->q;
    for (int64_t i = begin; i < end; ++i) {
        q[i] = s->unit * s->b[i];
        sum += q[i] * q[i];
    }
    return sum;
}

/* sum: b . b */
static double pass_square(const pass *s, int64_t begin, int64_t end)
{
    double sum = 0.0;
    for (int64_t i = begin; i < end; ++i)
        sum += s->b[i] * s->b[i];
    return sum;
}

/* The power of two that brings the largest of b to 1: squares then neither overflow nor vanish, and the solution of 2^k b
 * is 2^k times that of b, to the bit. */
static double choose_unit(const loxo_cg *cg, const double *b)
{
    double most = 0.0;
#pragma omp parallel num_threads(loxo_threads_for(cg->ctx, cg->a->n_rows, 1.0)) reduction(max : most)
    {
        const loxo_range r = loxo_thread_range(cg->a->n_rows);
        for (int64_t i = r.begin; i < r.end; ++i)
            most = fabs(b[i]) > most ? fabs(b[i]) : most;
    }
    if (most == 0.0 || !isfinite(most)) return 1.0;
    return exp2((double)-ilogb(most) < 1000.0 ? (double)-ilogb(most) : 1000.0); /* both it and 1 / it are numbers */
}

/* Takes the mean of each singular set out of v; variables that are not there are sets of their own. In order, by one thread:
 * a few times a solve. */
static void project(const loxo_cg *cg, double *v)
{
    const int64_t n = cg->a->n_rows;
    if (cg->n_singular == 0) return;
    for (int64_t s = 0; s < cg->n_sets; ++s)
        cg->set_mean[s] = 0.0;
    for (int64_t i = 0; i < n; ++i)
        cg->set_mean[cg->label != NULL ? cg->label[i] : 0] += v[i];
    for (int64_t s = 0; s < cg->n_sets; ++s)
        cg->set_mean[s] = cg->set_size[s] > 0.0 ? cg->set_mean[s] / cg->set_size[s] : 0.0;
    for (int64_t i = 0; i < n; ++i)
        v[i] -= cg->set_mean[cg->label != NULL ? cg->label[i] : 0];
}

/* r = b - A x in b's unit, projected; returns its norm. */
static double find_residual(const pass *s)
{
    const double square = run(s, pass_residual);
    if (s->cg->n_singular == 0) return sqrt(square);
    project(s->cg, s->cg->r);
    const pass of_r = {.cg = s->cg, .b = s->cg->r};
    return sqrt(run(&of_r, pass_square));
}

static bool is_stopped(const loxo_cg *cg, const loxo_cg_settings *settings, const loxo_cg_info *info)
{
    const loxo_progress p = {.phase = "conjugate gradients",
                             .fraction = -1.0,
                             .iteration = info->n_iterations,
                             .n_iterations = settings->max_iterations,
                             .objective = NAN,
                             .residual = info->residual};
    return loxo_progress_tell(cg->ctx, &p, info->n_iterations == 0);
}

/* Steps from the residual in r until it is at most goal, or something ends it. */
static loxo_cg_stop iterate(const pass *state, const loxo_preconditioner *m, const loxo_cg_settings *settings,
                            double norm_b, double goal, loxo_cg_info *info)
{
    const loxo_cg *cg = state->cg;
    pass s = *state;
    double rho = 0.0, residual = info->residual * norm_b;
    for (bool is_first = true; residual > goal; is_first = false) {
        if (info->n_iterations == settings->max_iterations) return LOXO_CG_MAX_ITERATIONS;
        if (is_stopped(cg, settings, info)) return LOXO_CG_MONITOR;
        m->apply(m->state, cg->r, cg->q);
        const double r_mr = run(&s, pass_products);
        if (!(r_mr > 0.0)) return LOXO_CG_INDEFINITE;
        s.alpha = is_first ? 0.0 : r_mr / rho;
        rho = r_mr;
        (void)run(&s, pass_direction);
        const double p_ap = run(&s, pass_product);
        if (!(p_ap > 0.0)) return LOXO_CG_INDEFINITE;
        s.alpha = rho / p_ap;
        residual = sqrt(run(&s, pass_step));
        ++info->n_iterations;
        info->residual = residual / norm_b;
        if (settings->look != NULL) settings->look(settings->look_user, info->n_iterations, s.x, info->residual);
    }
    return LOXO_CG_TOLERANCE;
}

loxo_status loxo_cg_solve(loxo_cg *cg, const loxo_preconditioner *m, const loxo_cg_settings *settings, const double *b,
                          double *x, loxo_cg_info *info)
{
    const loxo_cg_settings chosen = settings != NULL ? *settings : loxo_cg_settings_default();
    loxo_cg_info own = {0};
    pass s = {.cg = cg, .b = b, .x = x, .unit = choose_unit(cg, b)};
    s.back = 1.0 / s.unit;
    for (int64_t i = 0; i < cg->a->n_rows; ++i)
        if (!(cg->a->diagonal[i] > 0.0)) x[i] = 0.0;
    /* |b| without its share in the null space: q is free until the first step. */
    const double norm_given = sqrt(run(&s, pass_take));
    project(cg, cg->q);
    const pass of_b = {.cg = cg, .b = cg->q};
    const double norm_b = sqrt(run(&of_b, pass_square));
    if (!isfinite(norm_given))
        return loxo_fail(cg->ctx, LOXO_ERR_NUMERIC, "conjugate gradients: the right side is not finite");
    own.inconsistent = norm_given > 0.0 ? sqrt(fmax(0.0, norm_given * norm_given - norm_b * norm_b)) / norm_given : 0.0;
    double residual = find_residual(&s);
    if (!isfinite(residual))
        return loxo_fail(cg->ctx, LOXO_ERR_NUMERIC, "conjugate gradients: the start is not finite, or far too large");
    if (!(norm_b > 0.0)) { /* nothing to solve for */
        memset(x, 0, (size_t)cg->a->n_rows * sizeof *x);
        if (info != NULL) *info = own;
        return LOXO_OK;
    }
    /* The residual carried along drifts from the true one by rounding, and far from 1 even products of definite matrices
     * can turn out negative: the residual is computed anew, and the iteration begun again from it while that helps. */
    double last = HUGE_VAL;
    own.residual = residual / norm_b;
    for (;;) {
        own.stop_reason = iterate(&s, m, &chosen, norm_b, chosen.tolerance * norm_b, &own);
        own.residual = find_residual(&s) / norm_b;
        const bool may_go_on = own.stop_reason == LOXO_CG_TOLERANCE || own.stop_reason == LOXO_CG_INDEFINITE;
        if (own.residual <= chosen.tolerance && may_go_on) own.stop_reason = LOXO_CG_TOLERANCE;
        if (own.residual <= chosen.tolerance || !may_go_on) break;
        if (own.stop_reason == LOXO_CG_TOLERANCE) own.stop_reason = LOXO_CG_STALLED;
        if (!(own.residual < 0.5 * last)) break;
        last = own.residual;
    }
    if (!isfinite(own.residual))
        return loxo_fail(cg->ctx, LOXO_ERR_NUMERIC, "conjugate gradients: the solution is beyond the range of numbers");
    project(cg, x);
    if (info != NULL) *info = own;
    if (own.stop_reason == LOXO_CG_MONITOR) return LOXO_STOPPED;
    return own.stop_reason == LOXO_CG_TOLERANCE ? LOXO_OK : LOXO_NOT_CONVERGED;
}
