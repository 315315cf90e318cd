/* SPDX-License-Identifier: MIT
 * Face-based recovery (section 3.2): one gradient per face, closest to the heat's directions, with equal projections on
 * both sides of every edge. State and iteration: kernel/admm_kernel.h. */
#include "base/allocate.h"
#include "kernel/admm_kernel.h"
#include "kernel/descent_kernel.h"
#include "par/range.h"
#include "solver/geodesic/chains.h"
#include "solver/geodesic/tree.h"

#include <string.h>

#define CHECK_EVERY 10

static loxo_vec3 halfedge_vector(const loxo_geodesic *g, loxo_index h)
{
    return v3_sub(k_position(&g->m, k_head(&g->m, h)), k_position(&g->m, g->m.halfedge_vertex[h]));
}

static void find_areas(loxo_geodesic *g)
{
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, g->m.n_faces, 10.0))
    {
        const loxo_range r = loxo_thread_range(g->m.n_faces);
        for (int64_t f = r.begin; f < r.end; ++f) {
            const loxo_index h = (loxo_index)(3 * f);
            g->face_area[f] = 0.5 * v3_norm(v3_cross(halfedge_vector(g, h), halfedge_vector(g, (loxo_index)(h + 1))));
        }
    }
}

typedef struct residual_arg {
    const loxo_geodesic *g;
    const double (*now)[3], (*before)[3];
} residual_arg;

/* sums: squared distance of pairs across edges from equal projections, the pairs' areas, squared steps of the faces with
 * their areas, (10). All weighted by area. */
static void partial_residuals(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const residual_arg *a = arg;
    const loxo_geodesic *g = a->g;
    for (int64_t f = begin; f < end; ++f) {
        const double area = g->face_area[f];
        const loxo_vec3 own = v3_load(a->now[f]);
        const loxo_vec3 step = v3_sub(own, v3_load(a->before[f])), miss = v3_sub(own, v3_load(g->target[f]));
        for (int k = 0; k < 3; ++k) {
            const loxo_index h = (loxo_index)(3 * f + k), t = g->m.halfedge_twin[h];
            if (t < 0) continue;
            const double other = g->face_area[t / 3], both = area + other;
            const loxo_vec3 e = halfedge_vector(g, h);
            const double ee = v3_dot(e, e), jump = v3_dot(e, v3_sub(v3_load(a->now[t / 3]), own));
            sums[1] += area;
            sums[2] += area * v3_dot(step, step);
            if (t > h && ee > 0.0 && both > 0.0) sums[0] += jump * jump / ee * area * other / both;
        }
        sums[3] += area * v3_dot(miss, miss);
    }
}

static loxo_status find_residuals(const loxo_geodesic *g, int now, loxo_geodesic_info *info)
{
    const residual_arg arg = {g, (const double(*)[3])g->gradient[now], (const double(*)[3])g->gradient[1 - now]};
    double sums[4];
    const loxo_status status = loxo_sum(g->ctx, g->m.n_faces, 4, partial_residuals, &arg, sums);
    if (status < 0) return status;
    info->residual = sums[1] > 0.0 ? sqrt(sums[0] / sums[1]) : 0.0;
    info->dual_residual = sums[1] > 0.0 ? g->settings.penalty * sqrt(sums[2] / sums[1]) : 0.0;
    info->objective = sums[3];
    return LOXO_OK;
}

/* An element of a chain acts on the gradient of one face beside it, along the edge walked. */
typedef struct face_chains {
    double *a;        /* [n_chains] */
    loxo_index *face; /* [n] faces that chains touch, ascending */
    int64_t *of_element;
    int32_t *n_chains; /* [n] elements on the face */
    double (*pull)[3]; /* [n] */
    int64_t n;
} face_chains;

static void face_chains_destroy(loxo_context *ctx, face_chains *s)
{
    loxo_release(ctx, s->pull);
    loxo_release(ctx, s->n_chains);
    loxo_release(ctx, s->of_element);
    loxo_release(ctx, s->face);
    loxo_release(ctx, s->a);
    *s = (face_chains){0};
}

static loxo_status face_chains_create(const loxo_geodesic *g, const loxo_chains *chains, face_chains *s)
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
    s->pull = loxo_allocate(ctx, n, sizeof *s->pull);
    if (key == NULL || element == NULL || s->a == NULL || s->face == NULL || s->of_element == NULL ||
        s->n_chains == NULL || s->pull == NULL)
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

static loxo_vec3 walked(const loxo_geodesic *g, const loxo_chains *chains, int64_t i)
{
    return v3_scale((double)chains->sign[i], halfedge_vector(g, chains->halfedge[i]));
}

/* (23), (25): the line integral of the gradients along a chain. */
static double chain_sum(const loxo_geodesic *g, const loxo_chains *chains, int64_t c, const double (*gradient)[3])
{
    double sum = 0.0;
    for (int64_t i = chains->chain_begin[c]; i < chains->chain_begin[c + 1]; ++i)
        sum += v3_dot(walked(g, chains, i), v3_load(gradient[chains->halfedge[i] / 3]));
    return sum;
}

/* The g-update of the faces that chains touch, with the chains' copies on top of the edges'. */
static void update_chains(loxo_geodesic *g, const loxo_chains *chains, face_chains *s, bool is_first, int now)
{
    const double mu = g->settings.penalty;
    const double(*old)[3] = (const double(*)[3])g->gradient[1 - now];
    memset(s->pull, 0, (size_t)s->n * sizeof *s->pull);
    for (int64_t c = 0; c < chains->n_chains; ++c) {
        double norm = 0.0;
        const double sum = chain_sum(g, chains, c, old), r = is_first ? sum : s->a[c] + 2.0 * sum;
        s->a[c] = is_first ? 0.0 : s->a[c] + sum;
        for (int64_t i = chains->chain_begin[c]; i < chains->chain_begin[c + 1]; ++i) {
            const loxo_vec3 v = walked(g, chains, i);
            const double area = g->face_area[chains->halfedge[i] / 3];
            if (area > 0.0) norm += v3_dot(v, v) / area;
        }
        for (int64_t i = chains->chain_begin[c]; i < chains->chain_begin[c + 1]; ++i) {
            double *pull = s->pull[s->of_element[i]];
            const double area = g->face_area[chains->halfedge[i] / 3];
            if (area > 0.0 && norm > 0.0)
                v3_store(pull, v3_axpy(v3_load(pull), -r / (area * norm), walked(g, chains, i)));
        }
    }
    for (int64_t k = 0; k < s->n; ++k) {
        const int64_t f = s->face[k];
        double n = 0.0;
        for (int c = 0; c < 3; ++c)
            n += g->m.halfedge_twin[3 * f + c] >= 0 ? 1.0 : 0.0;
        const double n_more = (double)s->n_chains[k];
        loxo_vec3 sum = v3_scale(2.0 + mu * n, v3_load(g->gradient[now][f]));
        sum = v3_axpy(sum, mu * n_more, v3_load(old[f]));
        sum = v3_axpy(sum, mu, v3_load(s->pull[k]));
        v3_store(g->gradient[now][f], v3_scale(1.0 / (2.0 + mu * (n + n_more)), sum));
    }
}

/* (18): the step along a tree's edge, mean over the faces beside it; its half-edges become places. */
static void finish_tree(loxo_geodesic *g, const double (*gradient)[3])
{
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, g->m.n_vertices, 10.0))
    {
        const loxo_range r = loxo_thread_range(g->m.n_vertices);
        for (int64_t v = r.begin; v < r.end; ++v) {
            tree_edge edge;
            double x = 0.0;
            geodesic_prefetch_place(g, v);
            if (!geodesic_tree_edge(g, v, &edge)) continue;
            if (edge.halfedge >= 0) {
                const loxo_index h = edge.halfedge, t = g->m.halfedge_twin[h];
                const loxo_vec3 e = v3_scale(edge.sign, halfedge_vector(g, h));
                x = v3_dot(e, v3_load(gradient[h / 3]));
                if (t >= 0) x = 0.5 * (x + v3_dot(e, v3_load(gradient[t / 3])));
                g->parent[edge.place] = g->rank[edge.parent];
            }
            g->value[2 * edge.place + 1] = x;
        }
    }
}

loxo_status geodesic_recover_face(loxo_geodesic *g, const loxo_chains *chains, loxo_geodesic_info *info)
{
    const int64_t n_faces = g->m.n_faces;
    face_chains s = {0};
    loxo_status status = LOXO_OK;
    int now = 0;

    find_areas(g);
    geodesic_heat_to_vertices(g);
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, n_faces, 15.0))
    {
        const loxo_range r = loxo_thread_range(n_faces);
        g->kernels->face_directions(&g->m, g->vertex_value, g->vertex_scale, r.begin, r.end, g->target);
        if (r.end > r.begin)
            memcpy(g->gradient[0][r.begin], g->target[r.begin], (size_t)(r.end - r.begin) * sizeof *g->target);
    }
    if (chains->n_chains > 0 && (status = face_chains_create(g, chains, &s)) < 0) return status;
    geodesic_clock(g, LOXO_GEODESIC_PHASE_GRADIENT, info);

    info->stop_reason = LOXO_STOP_MAX_ITERATIONS;
    int64_t iteration = 0;
    while (iteration < g->settings.n_iterations && info->stop_reason == LOXO_STOP_MAX_ITERATIONS) {
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, n_faces, 20.0))
        {
            const loxo_range r = loxo_thread_range(n_faces);
            g->kernels->admm_face(&g->m, g->settings.penalty, iteration == 0, r.begin, r.end, g->face_area,
                                  (const double(*)[3])g->target, (const double(*)[3])g->gradient[now],
                                  g->gradient[1 - now], g->jump);
        }
        now = 1 - now;
        if (s.n > 0) update_chains(g, chains, &s, iteration == 0, now);
        ++iteration;
        if (iteration % CHECK_EVERY == 0 || iteration == g->settings.n_iterations) {
            if ((status = find_residuals(g, now, info)) < 0) goto done;
            if (info->residual <= g->settings.primal_tolerance && info->dual_residual <= g->settings.dual_tolerance)
                info->stop_reason = LOXO_STOP_TOLERANCE;
        }
        if (geodesic_tell_iteration(g, iteration, info)) info->stop_reason = LOXO_STOP_MONITOR;
    }
    if (info->stop_reason == LOXO_STOP_MONITOR && (status = find_residuals(g, now, info)) < 0) goto done;
    info->n_iterations = iteration;
    for (int64_t c = 0; c < chains->n_chains; ++c) {
        const double sum = chain_sum(g, chains, c, (const double(*)[3])g->gradient[now]);
        const double length = (double)(chains->chain_begin[c + 1] - chains->chain_begin[c]) * g->mean_edge_length;
        info->constraint_residual = fmax(info->constraint_residual, fabs(sum) / length);
    }
    finish_tree(g, (const double(*)[3])g->gradient[now]);
    geodesic_clock(g, LOXO_GEODESIC_PHASE_ADMM, info);
done:
    face_chains_destroy(g->ctx, &s);
    return status;
}
