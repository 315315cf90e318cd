/* SPDX-License-Identifier: MIT
 * Laplace equations in the plane with some vertices held. What is free has a matrix of its own, so that work and memory go with the
 * free vertices; what the held ones pull with comes from the surface's matrix. */
#include "algebra/cholesky.h"
#include "base/allocate.h"
#include "solver/sphere/plane.h"

#include <inttypes.h>
#include <string.h>

/* Steps of conjugate gradients. */
#define MAX_STEPS 2000
/* A residual that rounding ends below this is no loss. */
#define MOST_ROUNDED 1e-6
#define NS_A_ROW     12.0

struct plane_solver {
    loxo_context *ctx;
    const loxo_csr *whole; /* L */
    int64_t n_free;
    loxo_index *vertex; /* [n_free] ascending */
    loxo_csr matrix;    /* L_II; only pulled through the factor where there is one */
    loxo_multigrid *multigrid;
    loxo_cg *cg;
    loxo_cholesky *cholesky;
    double *right_side, *move; /* [n_free] */
};

void plane_solver_destroy(plane_solver *s)
{
    if (s == NULL) return;
    loxo_context *ctx = s->ctx;
    loxo_cg_destroy(s->cg);
    loxo_multigrid_destroy(s->multigrid);
    loxo_cholesky_destroy(s->cholesky);
    loxo_csr_destroy(ctx, &s->matrix);
    loxo_release(ctx, s->vertex);
    loxo_release(ctx, s->right_side);
    loxo_release(ctx, s->move);
    loxo_release(ctx, s);
}

/* place [n + 1]: how many free vertices there are before each. */
static loxo_status number_free(plane_solver *s, const bool *is_held, int64_t *place)
{
    const int64_t n = s->whole->n_rows;
    for (int64_t i = 0; i < n; ++i)
        place[i] = is_held[i] ? 0 : 1;
    s->n_free = loxo_scan_in_place(s->ctx, n, place);
    if ((s->vertex = loxo_allocate(s->ctx, s->n_free, sizeof *s->vertex)) == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < n; ++i)
        if (!is_held[i]) s->vertex[place[i]] = (loxo_index)i;
    return LOXO_OK;
}

/* Rows of free vertices, entries in held columns left out; diagonals stay, and with them the pull of what is held. */
static loxo_status extract(plane_solver *s, const bool *is_held, const int64_t *place)
{
    const loxo_csr *a = s->whole;
    loxo_csr *to = &s->matrix;
    to->n_rows = s->n_free;
    to->begin = loxo_allocate(s->ctx, s->n_free + 1, sizeof *to->begin);
    to->diagonal = loxo_allocate(s->ctx, s->n_free, sizeof *to->diagonal);
    if (to->begin == NULL || to->diagonal == NULL) return LOXO_ERR_MEMORY;
#pragma omp parallel num_threads(loxo_threads_for(s->ctx, s->n_free, NS_A_ROW))
    {
        const loxo_range r = loxo_thread_range(s->n_free);
        for (int64_t i = r.begin; i < r.end; ++i) {
            const int64_t v = s->vertex[i];
            int64_t count = 0;
            for (int64_t k = a->begin[v]; k < a->begin[v + 1]; ++k)
                count += !is_held[a->column[k]];
            to->begin[i] = count;
        }
    }
    const int64_t n_entries = loxo_scan_in_place(s->ctx, s->n_free, to->begin);
    to->column = loxo_allocate(s->ctx, n_entries, sizeof *to->column);
    to->value = loxo_allocate(s->ctx, n_entries, sizeof *to->value);
    if (to->column == NULL || to->value == NULL) return LOXO_ERR_MEMORY;
#pragma omp parallel num_threads(loxo_threads_for(s->ctx, s->n_free, NS_A_ROW))
    {
        const loxo_range r = loxo_thread_range(s->n_free);
        for (int64_t i = r.begin; i < r.end; ++i) {
            const int64_t v = s->vertex[i];
            int64_t at = to->begin[i];
            to->diagonal[i] = a->diagonal[v];
            for (int64_t k = a->begin[v]; k < a->begin[v + 1]; ++k) {
                if (is_held[a->column[k]]) continue;
                to->column[at] = (loxo_index)place[a->column[k]];
                to->value[at++] = a->value[k];
            }
        }
    }
    return LOXO_OK;
}

static loxo_status make_factor(plane_solver *s)
{
    loxo_status status = loxo_cholesky_create(s->ctx, &s->matrix, NULL, &s->cholesky);
    if (status >= 0) status = loxo_cholesky_factor(s->cholesky, &s->matrix);
    loxo_csr_destroy(s->ctx, &s->matrix);
    return status;
}

loxo_status plane_solver_create(const sphere_problem *p, const bool *is_held, plane_solver **out)
{
    loxo_context *ctx = p->ctx;
    loxo_status status = LOXO_ERR_MEMORY;
    int64_t *place = NULL;
    plane_solver *s = loxo_allocate(ctx, 1, sizeof *s);
    *out = NULL;
    if (s == NULL) return LOXO_ERR_MEMORY;
    *s = (plane_solver){.ctx = ctx, .whole = &p->laplacian};
    if ((place = loxo_allocate(ctx, p->m.n_vertices + 1, sizeof *place)) == NULL) goto fail;
    if ((status = number_free(s, is_held, place)) < 0) goto fail;
    if ((status = extract(s, is_held, place)) < 0) goto fail;
    loxo_release(ctx, place);
    place = NULL;
    s->right_side = loxo_allocate(ctx, s->n_free, sizeof *s->right_side);
    s->move = loxo_allocate(ctx, s->n_free, sizeof *s->move);
    status = LOXO_ERR_MEMORY;
    if (s->right_side == NULL || s->move == NULL) goto fail;
    if (s->n_free == 0) {
        *out = s;
        return LOXO_OK;
    }
    if (p->settings.factor == LOXO_SPHERE_CHOLESKY) {
        if ((status = make_factor(s)) < 0) goto fail;
    } else {
        if ((status = loxo_multigrid_create(ctx, &s->matrix, NULL, &s->multigrid)) < 0) goto fail;
        if ((status = loxo_cg_create(ctx, &s->matrix, &s->cg)) < 0) goto fail;
    }
    *out = s;
    return LOXO_OK;
fail:
    loxo_release(ctx, place);
    plane_solver_destroy(s);
    return status;
}

/* right_side = -(L u) of the free vertices, by differences: rows of L sum to 0. */
static void find_pull(plane_solver *s, const double *u)
{
    const loxo_csr *a = s->whole;
#pragma omp parallel num_threads(loxo_threads_for(s->ctx, s->n_free, NS_A_ROW))
    {
        const loxo_range r = loxo_thread_range(s->n_free);
        for (int64_t i = r.begin; i < r.end; ++i) {
            const int64_t v = s->vertex[i];
            double sum = 0.0;
            for (int64_t k = a->begin[v]; k < a->begin[v + 1]; ++k)
                sum += a->value[k] * (u[v] - u[a->column[k]]);
            s->right_side[i] = sum;
        }
    }
}

void plane_tell_unsolved(loxo_context *ctx, double tolerance, const loxo_cg_info *cg)
{
    if (cg->residual <= MOST_ROUNDED) return;
    loxo_warn(ctx, "sphere linear", 1,
              "sphere: linear systems were not solved to their tolerance of %.2g; the last one to %.2g in %" PRId64
              " steps",
              tolerance, cg->residual, cg->n_iterations);
}

/* move = L_II^-1 right_side */
static loxo_status find_move(plane_solver *s, double tolerance, loxo_sphere_info *info)
{
    if (s->cholesky != NULL) return loxo_cholesky_solve(s->cholesky, s->right_side, s->move);
    const loxo_preconditioner m = {loxo_multigrid_apply, s->multigrid};
    const loxo_cg_settings settings = {.tolerance = tolerance, .max_iterations = MAX_STEPS};
    loxo_cg_info cg;
    memset(s->move, 0, (size_t)s->n_free * sizeof *s->move);
    const loxo_status status = loxo_cg_solve(s->cg, &m, &settings, s->right_side, s->move, &cg);
    if (status < 0) return status;
    info->n_linear_steps += cg.n_iterations;
    if (status == LOXO_NOT_CONVERGED) plane_tell_unsolved(s->ctx, tolerance, &cg);
    return status == LOXO_NOT_CONVERGED ? LOXO_OK : status;
}

loxo_status plane_solver_solve(plane_solver *s, double tolerance, plane_map *h, loxo_sphere_info *info)
{
    double *coordinate[2] = {h->x, h->y};
    if (s->n_free == 0) return LOXO_OK;
    for (int k = 0; k < 2; ++k) {
        find_pull(s, coordinate[k]);
        const loxo_status status = find_move(s, tolerance, info);
        if (status != LOXO_OK) return status;
        for (int64_t i = 0; i < s->n_free; ++i)
            coordinate[k][s->vertex[i]] += s->move[i];
    }
    return LOXO_OK;
}
