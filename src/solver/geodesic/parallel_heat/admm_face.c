/* SPDX-License-Identifier: MIT
 * Face-based recovery (section 3.2): one gradient per face, closest to the heat's directions, with equal projections on
 * both sides of every edge. State and iteration: kernel/admm_kernel.h. */
#include "base/allocate.h"
#include "kernel/admm_kernel.h"
#include "kernel/descent_kernel.h"
#include "par/range.h"
#include "solver/geodesic/parallel_heat/admm.h"
#include "solver/geodesic/parallel_heat/chains.h"
#include "solver/geodesic/parallel_heat/tree.h"

#include <string.h>

/* In three dimensions, or in the plane of its face unfolded. */
static loxo_vec3 halfedge_vector(const parallel_heat *g, loxo_index h)
{
    loxo_vec3 corner[3];
    k_face_corners(&g->m, k_face_of(h), corner);
    return v3_sub(corner[k_next(h) % 3], corner[h % 3]);
}

/* g . e along half-edge h, of its own face. */
static double along(const double (*gradient)[2], loxo_index h)
{
    const int64_t f = k_face_of(h), k = h - 3 * f;
    return k == 2 ? k_third(gradient[f][0], gradient[f][1]) : gradient[f][k];
}

typedef struct residual_arg {
    const parallel_heat *g;
    const double (*now)[2];
    const double *push, *push_before;
} residual_arg;

/* Squared length times area of the vector in a face's plane whose products with the first two half-edges are x_0 and x_1:
 * (x_0 e_1 - x_1 e_0), turned by a right angle, over twice the area. */
static double square_times_area(loxo_vec3 e_0, loxo_vec3 e_1, double x_0, double x_1, double area)
{
    const loxo_vec3 w = v3_sub(v3_scale(x_0, e_1), v3_scale(x_1, e_0));
    return area > 0.0 ? v3_dot(w, w) / (4.0 * area) : 0.0;
}

/* sums: squared distance of pairs across edges from equal projections, the pairs' areas, squared steps of the faces with
 * their areas, (10). All weighted by area. */
static void partial_residuals(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const residual_arg *a = arg;
    const parallel_heat *g = a->g;
    for (int64_t f = begin; f < end; ++f) {
        const loxo_index *twin = &g->m.halfedge_twin[3 * f];
        loxo_vec3 corner[3];
        k_face_corners(&g->m, f, corner);
        const loxo_vec3 e_0 = v3_sub(corner[1], corner[0]), e_1 = v3_sub(corner[2], corner[1]);
        const double area = g->face_area[f], *now = a->now[f], *push = &a->push[3 * f],
                     *before = &a->push_before[3 * f];
        const double x[3] = {now[0], now[1], k_third(now[0], now[1])};
        /* push - push before = 2 x - x before */
        const double step_0 = push[0] - before[0] - x[0], step_1 = push[1] - before[1] - x[1];
        double n_twins = 0.0, jumps = 0.0;
        if ((f & 3) == 0 && f + K_AHEAD / 2 < g->m.n_faces) __builtin_prefetch(a->now[f + K_AHEAD / 2], 0, 2);
        if ((f & 7) == 0 && f + K_AHEAD / 2 < g->m.n_faces) __builtin_prefetch(&g->face_area[f + K_AHEAD / 2], 0, 2);
        for (int k = 0; k < 3; ++k) {
            if (twin[k] < 0) continue;
            n_twins += 1.0;
            const double other = g->face_area[k_face_of(twin[k])], divisor = g->side_square[f][k] * (area + other);
            const double jump = x[k] + along(a->now, twin[k]);
            if (divisor > 0.0) jumps += jump * jump * area * other / divisor;
        }
        sums[0] += 0.5 * jumps; /* half on each side */
        sums[1] += n_twins * area;
        sums[2] += n_twins * square_times_area(e_0, e_1, step_0, step_1, area);
        sums[3] += square_times_area(e_0, e_1, x[0] - g->target[f][0], x[1] - g->target[f][1], area);
    }
}

/* An element of a chain acts on the gradient of one face beside it, along the edge walked. */
typedef struct face_chains {
    double *a;        /* [n_chains] */
    loxo_index *face; /* [n] faces that chains touch, ascending */
    int64_t *of_element;
    int32_t *n_chains;   /* [n] elements on the face */
    double (*before)[2]; /* [n] g before the iteration, as it is kept */
    double (*pull)[2];   /* [n] */
    int64_t n;
} face_chains;

typedef struct face_problem {
    parallel_heat *g;
    const loxo_chains *chains;
    face_chains s;
} face_problem;

/* Iterate 0 is the target itself. */
static const double (*iterate_of(const parallel_heat *g, int64_t number))[2]
{
    return number == 0 ? (const double(*)[2])g->target : (const double(*)[2])g->face_gradient;
}

static void iterate(void *arg, int64_t begin, int64_t end, int64_t from)
{
    const parallel_heat *g = ((const face_problem *)arg)->g;
    g->kernels->admm_face(&g->m, g->settings.penalty, begin, end, g->face_area, (const double(*)[3])g->side_square,
                          (const double(*)[2])g->target, iterate_of(g, from), g->face_gradient, g->push[from & 1],
                          g->push[1 - (from & 1)]);
}

static loxo_status find_residuals(void *arg, int64_t number, loxo_geodesic_info *info)
{
    const parallel_heat *g = ((const face_problem *)arg)->g;
    const residual_arg both = {g, (const double(*)[2])g->face_gradient, g->push[number & 1], g->push[1 - (number & 1)]};
    double sums[4];
    const loxo_status status = loxo_sum(g->ctx, g->m.n_faces, 4, partial_residuals, &both, sums);
    if (status < 0) return status;
    info->residual = sums[1] > 0.0 ? sqrt(sums[0] / sums[1]) : 0.0;
    info->dual_residual = sums[1] > 0.0 ? g->settings.penalty * sqrt(sums[2] / sums[1]) : 0.0;
    info->objective = sums[3];
    return LOXO_OK;
}

static void face_chains_destroy(loxo_context *ctx, face_chains *s)
{
    loxo_release(ctx, s->pull);
    loxo_release(ctx, s->before);
    loxo_release(ctx, s->n_chains);
    loxo_release(ctx, s->of_element);
    loxo_release(ctx, s->face);
    loxo_release(ctx, s->a);
    *s = (face_chains){0};
}

static loxo_status face_chains_create(const parallel_heat *g, const loxo_chains *chains, face_chains *s)
{
    loxo_context *ctx = g->ctx;
    const int64_t n = chains->chain_begin[chains->n_chains];
    uint64_t *key = loxo_allocate(ctx, n, sizeof *key);
    uint32_t *element = loxo_allocate(ctx, n, sizeof *element);
    loxo_status status = LOXO_ERR_MEMORY;
    s->a = loxo_allocate_zero(ctx, chains->n_chains, sizeof *s->a);
    s->face = loxo_allocate(ctx, n, sizeof *s->face);
    s->of_element = loxo_allocate(ctx, n, sizeof *s->of_element);
    s->n_chains = loxo_allocate_zero(ctx, n, sizeof *s->n_chains);
    s->before = loxo_allocate(ctx, n, sizeof *s->before);
    s->pull = loxo_allocate(ctx, n, sizeof *s->pull);
    if (key == NULL || element == NULL || s->a == NULL || s->face == NULL || s->of_element == NULL ||
        s->n_chains == NULL || s->before == NULL || s->pull == NULL)
        goto done;
    for (int64_t i = 0; i < n; ++i) {
        key[i] = (uint64_t)(chains->halfedge[i] / 3);
        element[i] = (uint32_t)i;
    }
    if ((status = loxo_sort_u64(ctx, n, key, element, 33)) < 0) goto done;
    for (int64_t i = 0; i < n; ++i) {
        if (i == 0 || key[i] != key[i - 1]) s->face[s->n++] = (loxo_index)key[i];
        ++s->n_chains[s->n - 1];
        s->of_element[element[i]] = s->n - 1;
    }
done:
    loxo_release(ctx, element);
    loxo_release(ctx, key);
    if (status < 0) face_chains_destroy(ctx, s);
    return status;
}

static loxo_vec3 walked(const parallel_heat *g, const loxo_chains *chains, int64_t i)
{
    return v3_scale((double)chains->sign[i], halfedge_vector(g, chains->halfedge[i]));
}

/* (23), (25): the line integral of the gradients along a chain. */
static double chain_sum(const loxo_chains *chains, int64_t c, const double (*gradient)[2])
{
    double sum = 0.0;
    for (int64_t i = chains->chain_begin[c]; i < chains->chain_begin[c + 1]; ++i)
        sum += (double)chains->sign[i] * along(gradient, chains->halfedge[i]);
    return sum;
}

/* Before an iteration: what the chains' copies pull at the gradients. */
static void pull_chains(void *arg, int64_t number)
{
    face_problem *problem = arg;
    const parallel_heat *g = problem->g;
    const loxo_chains *chains = problem->chains;
    face_chains *s = &problem->s;
    const double(*gradient)[2] = iterate_of(g, number);
    const bool is_first = number == 0;
    for (int64_t k = 0; k < s->n; ++k)
        for (int c = 0; c < 2; ++c) {
            s->before[k][c] = gradient[s->face[k]][c];
            s->pull[k][c] = 0.0;
        }
    for (int64_t c = 0; c < chains->n_chains; ++c) {
        double norm = 0.0;
        const double sum = chain_sum(chains, c, gradient), r = is_first ? sum : s->a[c] + 2.0 * sum;
        s->a[c] = is_first ? 0.0 : s->a[c] + sum;
        for (int64_t i = chains->chain_begin[c]; i < chains->chain_begin[c + 1]; ++i) {
            const loxo_vec3 v = walked(g, chains, i);
            const double area = g->face_area[chains->halfedge[i] / 3];
            if (area > 0.0) norm += v3_dot(v, v) / area;
        }
        for (int64_t i = chains->chain_begin[c]; i < chains->chain_begin[c + 1]; ++i) {
            const loxo_index f = chains->halfedge[i] / 3, h = (loxo_index)(3 * f);
            const double area = g->face_area[f];
            double *pull = s->pull[s->of_element[i]];
            if (!(area > 0.0 && norm > 0.0)) continue;
            const loxo_vec3 change = v3_scale(-r / (area * norm), walked(g, chains, i));
            pull[0] += v3_dot(change, halfedge_vector(g, h));
            pull[1] += v3_dot(change, halfedge_vector(g, (loxo_index)(h + 1)));
        }
    }
}

/* After it: the g-update of the faces that chains touch, with the chains' copies on top of the edges'. */
static void apply_pulls(void *arg, int64_t number)
{
    const parallel_heat *g = ((const face_problem *)arg)->g;
    const face_chains *s = &((const face_problem *)arg)->s;
    const double mu = g->settings.penalty;
    for (int64_t k = 0; k < s->n; ++k) {
        const int64_t f = s->face[k];
        double n = 0.0, *push = &g->push[number & 1][3 * f];
        for (int c = 0; c < 3; ++c)
            n += g->m.halfedge_twin[3 * f + c] >= 0 ? 1.0 : 0.0;
        const double n_more = (double)s->n_chains[k];
        for (int c = 0; c < 2; ++c) {
            const double x = g->face_gradient[f][c];
            const double sum = (2.0 + mu * n) * x + mu * (n_more * s->before[k][c] + s->pull[k][c]);
            g->face_gradient[f][c] = sum / (2.0 + mu * (n + n_more));
            push[c] += 2.0 * (g->face_gradient[f][c] - x);
        }
        push[2] = k_third(push[0], push[1]);
    }
}

/* (18): the step along a tree's edge, mean over the faces beside it. */
static void finish_tree(parallel_heat *g, const double (*gradient)[2])
{
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, g->m.n_faces, 3.0))
    {
        const loxo_range r = loxo_thread_range(g->m.n_faces);
        for (int64_t f = r.begin; f < r.end; ++f) {
            heat_prefetch_steps(g, f);
            for (loxo_index h = (loxo_index)(3 * f); h < 3 * f + 3; ++h) {
                double sign;
                const loxo_index v = heat_led_to(g, h, &sign), t = g->m.halfedge_twin[h];
                if (v < 0) continue;
                const double own = along(gradient, h), x = t < 0 ? own : 0.5 * (own - along(gradient, t));
                g->value[2 * (int64_t)g->rank[v] + 1] = sign * x;
            }
        }
    }
}

loxo_status heat_recover_face(parallel_heat *g, const loxo_chains *chains, loxo_geodesic_info *info)
{
    face_problem p = {.g = g, .chains = chains};
    loxo_status status = LOXO_OK;
    heat_to_vertices(g);
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, g->m.n_faces, 10.0))
    {
        const loxo_range r = loxo_thread_range(g->m.n_faces);
        g->kernels->face_targets(&g->m, g->vertex_value, g->vertex_scale, r.begin, r.end, g->face_area, g->side_square,
                                 g->target, g->push[0]);
    }
    if ((status = heat_fill_flat_faces(g, g->push[0])) < 0) return status;
    if ((status = heat_aim_from_seeds(g, g->push[0])) < 0) return status;
    if (chains->n_chains > 0 && (status = face_chains_create(g, chains, &p.s)) < 0) return status;
    heat_clock(g, LOXO_GEODESIC_PHASE_GRADIENT, info);

    const admm_problem problem = {.g = g,
                                  .arg = &p,
                                  .face_ns = 7.0,
                                  .iterate = iterate,
                                  .before = p.s.n > 0 ? pull_chains : NULL,
                                  .after = p.s.n > 0 ? apply_pulls : NULL,
                                  .test = find_residuals};
    status = heat_iterate(&problem, info);
    if (status >= 0) {
        const double(*x)[2] = iterate_of(g, info->n_iterations);
        for (int64_t c = 0; c < chains->n_chains; ++c) {
            const double length = (double)(chains->chain_begin[c + 1] - chains->chain_begin[c]) * g->mean_edge_length;
            info->constraint_residual = fmax(info->constraint_residual, fabs(chain_sum(chains, c, x)) / length);
        }
        finish_tree(g, x);
        heat_clock(g, LOXO_GEODESIC_PHASE_ADMM, info);
    }
    face_chains_destroy(g->ctx, &p.s);
    return status;
}
