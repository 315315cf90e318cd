/* SPDX-License-Identifier: MIT */
#include "direct.h"

#include "base/os.h"

#include <math.h>
#include <string.h>
#include <suitesparse/cholmod.h>

#define N_REFINEMENTS 2

typedef struct direct_system {
    cholmod_common common;
    cholmod_sparse *matrix; /* S = A + t C, lower triangle */
    cholmod_factor *factor; /* L D L^T = P S P^T */
    loxo_context *ctx;
    int64_t n;
    long double *u, *residual, *bound, *work; /* [n] each */
} direct_system;

static void load_position(const loxo_mesh_arrays *mesh, loxo_index v, double p[3])
{
    for (int k = 0; k < 3; ++k)
        p[k] = mesh->position != NULL ? mesh->position[(int64_t)3 * v + k]
                                      : (double)mesh->position_float[(int64_t)3 * v + k];
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Triplets of C and the vertex areas. */
static bool add_faces(const loxo_mesh_arrays *mesh, cholmod_triplet *triplet, double *area)
{
    SuiteSparse_long *row = triplet->i, *column = triplet->j;
    double *x = triplet->x;
    size_t k = 0;
    for (int64_t f = 0; f < mesh->n_faces; ++f) {
        const loxo_index *v = &mesh->triangle[3 * f];
        double p[3][3], ab[3], ac[3];
        for (int c = 0; c < 3; ++c)
            load_position(mesh, v[c], p[c]);
        for (int i = 0; i < 3; ++i) {
            ab[i] = p[1][i] - p[0][i];
            ac[i] = p[2][i] - p[0][i];
        }
        const double n[3] = {ab[1] * ac[2] - ab[2] * ac[1], ab[2] * ac[0] - ab[0] * ac[2],
                             ab[0] * ac[1] - ab[1] * ac[0]};
        const double double_area = sqrt(dot(n, n));
        if (!(double_area > 0.0)) return false;
        for (int c = 0; c < 3; ++c) { /* the edge opposite corner c */
            const int a = (c + 1) % 3, b = (c + 2) % 3;
            double ca[3], cb[3];
            for (int i = 0; i < 3; ++i) {
                ca[i] = p[a][i] - p[c][i];
                cb[i] = p[b][i] - p[c][i];
            }
            const double w = 0.5 * dot(ca, cb) / double_area;
            row[k] = v[a] > v[b] ? v[a] : v[b];
            column[k] = v[a] > v[b] ? v[b] : v[a];
            x[k++] = -w;
            row[k] = column[k] = v[a];
            x[k++] = w;
            row[k] = column[k] = v[b];
            x[k++] = w;
            area[v[c]] += double_area / 6.0;
        }
    }
    triplet->nnz = k;
    return true;
}

/* Mean length over the edges: the strictly lower triangle holds each once. */
static double mean_edge_length(const loxo_mesh_arrays *mesh, const cholmod_sparse *matrix)
{
    const SuiteSparse_long *start = matrix->p, *row = matrix->i;
    long double sum = 0.0L;
    int64_t count = 0;
    for (int64_t j = 0; j < (int64_t)matrix->ncol; ++j)
        for (SuiteSparse_long k = start[j]; k < start[j + 1]; ++k) {
            double a[3], b[3];
            if (row[k] == j) continue;
            load_position(mesh, (loxo_index)j, a);
            load_position(mesh, (loxo_index)row[k], b);
            for (int i = 0; i < 3; ++i)
                a[i] -= b[i];
            sum += (long double)sqrt(dot(a, a));
            ++count;
        }
    return count > 0 ? (double)(sum / (long double)count) : 0.0;
}

static loxo_status assemble(direct_system *s, const loxo_mesh_arrays *mesh, double time_factor, bench_direct_info *info)
{
    loxo_status status = LOXO_ERR_MEMORY;
    double *area = loxo_allocate(s->ctx, s->n, sizeof *area);
    cholmod_triplet *triplet =
        cholmod_l_allocate_triplet((size_t)s->n, (size_t)s->n, (size_t)mesh->n_faces * 9, -1, CHOLMOD_REAL, &s->common);
    if (area == NULL || triplet == NULL) goto done;
    memset(area, 0, (size_t)s->n * sizeof *area);
    if (!add_faces(mesh, triplet, area)) {
        status = LOXO_ERR_NUMERIC;
        goto done;
    }
    s->matrix = cholmod_l_triplet_to_sparse(triplet, 0, &s->common);
    if (s->matrix == NULL) goto done;
    info->mean_edge_length = mean_edge_length(mesh, s->matrix);
    info->time = time_factor * info->mean_edge_length * info->mean_edge_length;
    const SuiteSparse_long *start = s->matrix->p, *row = s->matrix->i;
    double *x = s->matrix->x;
    for (int64_t j = 0; j < s->n; ++j)
        for (SuiteSparse_long k = start[j]; k < start[j + 1]; ++k)
            x[k] = x[k] * info->time + (row[k] == j ? area[j] : 0.0);
    status = LOXO_OK;
done:
    cholmod_l_free_triplet(&triplet, &s->common);
    loxo_release(s->ctx, area);
    return status;
}

static loxo_status factor(direct_system *s, bench_direct_info *info)
{
    s->common.supernodal = CHOLMOD_SIMPLICIAL;
    s->common.final_ll = 0;
    s->factor = cholmod_l_analyze(s->matrix, &s->common);
    if (s->factor == NULL || cholmod_l_factorize(s->matrix, s->factor, &s->common) == 0) return LOXO_ERR_MEMORY;
    if (s->common.status == CHOLMOD_NOT_POSDEF || s->factor->minor < s->factor->n) return LOXO_ERR_NUMERIC;
    const SuiteSparse_long *count = s->factor->nz, *start = s->factor->p;
    const double *x = s->factor->x;
    for (int64_t j = 0; j < s->n; ++j) {
        info->n_factor += count[j];
        if (!(x[start[j]] > 0.0)) return LOXO_ERR_NUMERIC; /* L D L^T goes on past a negative pivot */
    }
    return LOXO_OK;
}

/* work = S^-1 b, b and the result in the mesh's order. */
static void solve_factored(const direct_system *s, const long double *b)
{
    const SuiteSparse_long *start = s->factor->p, *row = s->factor->i, *count = s->factor->nz, *perm = s->factor->Perm;
    const double *x = s->factor->x;
    long double *y = s->work;
    for (int64_t j = 0; j < s->n; ++j)
        y[j] = b[perm[j]];
    for (int64_t j = 0; j < s->n; ++j) { /* L y = b; the first entry of a column is D's */
        if (y[j] == 0.0L) continue;
        for (SuiteSparse_long k = start[j] + 1; k < start[j] + count[j]; ++k)
            y[row[k]] -= (long double)x[k] * y[j];
    }
    for (int64_t j = s->n - 1; j >= 0; --j) { /* D L^T y = y */
        long double sum = y[j] / (long double)x[start[j]];
        for (SuiteSparse_long k = start[j] + 1; k < start[j] + count[j]; ++k)
            sum -= (long double)x[k] * y[row[k]];
        y[j] = sum;
    }
}

/* residual = b - S u and bound = |S| |u| + |b|; returns the largest ratio of the two. */
static long double find_residual(direct_system *s, const loxo_index *sources, int64_t n_sources)
{
    const SuiteSparse_long *start = s->matrix->p, *row = s->matrix->i;
    const double *x = s->matrix->x;
    long double worst = 0.0L;
    for (int64_t i = 0; i < s->n; ++i)
        s->residual[i] = s->bound[i] = 0.0L;
    for (int64_t i = 0; i < n_sources; ++i)
        s->residual[sources[i]] = s->bound[sources[i]] = 1.0L;
    for (int64_t j = 0; j < s->n; ++j)
        for (SuiteSparse_long k = start[j]; k < start[j + 1]; ++k) {
            const int64_t i = row[k];
            const long double xu = (long double)x[k] * s->u[j];
            s->residual[i] -= xu;
            s->bound[i] += fabsl(xu);
            if (i == j) continue;
            const long double xv = (long double)x[k] * s->u[i];
            s->residual[j] -= xv;
            s->bound[j] += fabsl(xv);
        }
    for (int64_t i = 0; i < s->n; ++i) {
        const long double ratio = fabsl(s->residual[i]) / s->bound[i];
        if (!(ratio <= worst)) worst = ratio; /* also when it is NaN */
    }
    return worst;
}

static loxo_status solve(direct_system *s, const loxo_index *sources, int64_t n_sources, double *value, int32_t *scale,
                         bench_direct_info *info)
{
    for (int64_t i = 0; i < s->n; ++i)
        s->u[i] = 0.0L;
    long double worst = find_residual(s, sources, n_sources);
    for (int k = 0; k <= N_REFINEMENTS; ++k) {
        solve_factored(s, s->residual);
        const SuiteSparse_long *perm = s->factor->Perm;
        for (int64_t j = 0; j < s->n; ++j)
            s->u[perm[j]] += s->work[j];
        worst = find_residual(s, sources, n_sources);
    }
    info->residual = (double)worst;
    for (int64_t i = 0; i < s->n; ++i) {
        int exponent = 0;
        value[i] = (double)frexpl(s->u[i], &exponent);
        scale[i] = exponent;
        if (!(value[i] > 0.0)) info->n_nonpositive += 1;
        if (value[i] == 0.0 || !isfinite(value[i])) return LOXO_ERR_NUMERIC;
    }
    return LOXO_OK;
}

loxo_status bench_direct_heat(loxo_context *ctx, const loxo_mesh_arrays *mesh, double time_factor,
                              const loxo_index *sources, int64_t n_sources, double *value, int32_t *scale,
                              bench_direct_info *info)
{
    direct_system s = {.ctx = ctx, .n = mesh->n_vertices};
    loxo_status status;
    *info = (bench_direct_info){0};
    cholmod_l_start(&s.common);
    s.common.print = 0;
    const double start = loxo_os_clock_s();
    if ((status = assemble(&s, mesh, time_factor, info)) < 0 || (status = factor(&s, info)) < 0) goto done;
    info->factor_s = loxo_os_clock_s() - start;
    long double **arrays[] = {&s.u, &s.residual, &s.bound, &s.work};
    for (int i = 0; i < 4; ++i)
        if ((*arrays[i] = loxo_allocate(ctx, s.n, sizeof **arrays[i])) == NULL) {
            status = LOXO_ERR_MEMORY;
            goto done;
        }
    status = solve(&s, sources, n_sources, value, scale, info);
    info->solve_s = loxo_os_clock_s() - start - info->factor_s;
done:
    loxo_release(ctx, s.u);
    loxo_release(ctx, s.residual);
    loxo_release(ctx, s.bound);
    loxo_release(ctx, s.work);
    cholmod_l_free_factor(&s.factor, &s.common);
    cholmod_l_free_sparse(&s.matrix, &s.common);
    cholmod_l_finish(&s.common);
    return status;
}
