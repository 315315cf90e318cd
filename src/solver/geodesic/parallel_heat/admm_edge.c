/* SPDX-License-Identifier: MIT
 * Edge-based recovery (section 4): differences of the distance along edges, closest to those of the heat's directions
 * and closed around every face. State and iteration: kernel/admm_kernel.h. */
#include "kernel/admm_kernel.h"
#include "par/range.h"
#include "solver/geodesic/parallel_heat/admm.h"
#include "solver/geodesic/parallel_heat/chains.h"
#include "solver/geodesic/parallel_heat/tree.h"

#include <string.h>

/* hbar along half-edge h: mean of the targets of its two sides. */
static double average_of(const parallel_heat *g, loxo_index h)
{
    const loxo_index t = g->m.halfedge_twin[h];
    return t < 0 ? g->difference[h] : 0.5 * (g->difference[h] - g->difference[t]);
}

/* x - hbar along half-edge h from the potentials. */
static double from_potential(const parallel_heat *g, loxo_index h, const double *potential)
{
    const loxo_index t = g->m.halfedge_twin[h];
    return t < 0 ? potential[h / 3] : 0.5 * (potential[h / 3] - potential[t / 3]);
}

/* All that is taken from the differences of faces begin..end-1 before their memory goes to ADMM: around each face the sum
 * of hbar; hbar along the tree's edges, into the second value of the places they lead to; in sums half the squared distance
 * between the targets of an edge's two sides, which (20) keeps whatever x is. */
static void close_faces(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const parallel_heat *g = arg;
    const double *d = g->difference;
    for (int64_t f = begin; f < end; ++f) {
        double closure = 0.0, disagreement = 0.0;
        heat_prefetch_steps(g, f);
        if ((f & 1) == 0 && f + K_AHEAD / 2 < g->m.n_faces) __builtin_prefetch(&d[3 * (f + K_AHEAD / 2)], 0, 2);
        for (loxo_index h = (loxo_index)(3 * f); h < 3 * f + 3; ++h) {
            const loxo_index t = g->m.halfedge_twin[h];
            const double other = t < 0 ? -d[h] : d[t], both = d[h] + other, average = 0.5 * (d[h] - other);
            double sign;
            const loxo_index v = heat_led_to(g, h, &sign);
            closure += average;
            disagreement += 0.125 * both * both; /* half of it on each side */
            if (v < 0) continue;
            g->value[2 * (int64_t)g->rank[v] + 1] = sign * average;
            heat_keep_halfedge(g, v, h);
        }
        g->closure[f] = closure;
        sums[0] += disagreement;
    }
}

typedef struct edge_problem {
    parallel_heat *g;
    const loxo_chains *chains;
    special_edges s;
    double theta;
} edge_problem;

/* From p = 0 and a = -closure the first iteration looks at no neighbour. */
static void iterate_first(const edge_problem *e, int64_t begin, int64_t end)
{
    const parallel_heat *g = e->g;
    for (int64_t f = begin; f < end; ++f) {
        g->multiplier[f] = 0.0;
        g->potential[0][f] = 0.0;
        g->potential[1][f] = e->theta * (0.0 - g->closure[f] * (1.0 / 3.0));
    }
}

static void iterate(void *arg, int64_t begin, int64_t end, int64_t from)
{
    const edge_problem *e = arg;
    const parallel_heat *g = e->g;
    if (from == 0)
        iterate_first(e, begin, end);
    else
        g->kernels->admm_edge(&g->m, e->theta, begin, end, g->closure, g->multiplier, g->potential[from & 1],
                              g->potential[1 - (from & 1)]);
}

typedef struct residual_arg {
    const parallel_heat *g;
    const double *now, *before;
} residual_arg;

/* sums: squared distance of the faces' three differences from closed triples, squared steps, squared d of the edges. An
 * edge counts half on each side; at a boundary its only side wants half of it, (20). */
static void partial_residuals(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const residual_arg *a = arg;
    const loxo_index *twin = a->g->m.halfedge_twin;
    for (int64_t f = begin; f < end; ++f) {
        const double own = a->now[f], step = own - a->before[f];
        double around = 0.0, square = 0.0;
        if ((f & 7) == 0 && f + K_AHEAD < a->g->m.n_faces) __builtin_prefetch(&a->now[f + K_AHEAD], 0, 2);
        for (int k = 0; k < 3; ++k) {
            const loxo_index t = twin[3 * f + k];
            const double d = 0.5 * (own - (t < 0 ? -own : a->now[k_face_of(t)]));
            around += d;
            square += d * d;
        }
        const double c = a->g->closure[f] + around;
        sums[0] += c * c / 3.0;
        sums[1] += 3.0 * step * step;
        sums[2] += 0.5 * square;
    }
}

static loxo_status find_residuals(void *arg, int64_t number, loxo_geodesic_info *info)
{
    const parallel_heat *g = ((const edge_problem *)arg)->g;
    const residual_arg both = {g, g->potential[number & 1], g->potential[1 - (number & 1)]};
    double sums[3];
    const loxo_status status = loxo_sum(g->ctx, g->m.n_faces, 3, partial_residuals, &both, sums);
    const double scale = sqrt(3.0 * (double)g->m.n_faces) * g->mean_edge_length;
    if (status < 0) return status;
    info->residual = sqrt(sums[0]) / scale;
    info->dual_residual = g->settings.penalty * sqrt(sums[1]) / scale;
    info->objective = sums[2];
    return LOXO_OK;
}

/* Starts the special edges at hbar and the chains' multipliers accordingly. */
static void start_chains(const parallel_heat *g, const loxo_chains *chains, special_edges *s)
{
    for (int64_t i = 0; i < s->n; ++i) {
        s->edge[i].average = average_of(g, s->edge[i].halfedge);
        s->edge[i].x = s->edge[i].average;
    }
    for (int64_t c = 0; c < chains->n_chains; ++c)
        for (int64_t i = chains->chain_begin[c]; i < chains->chain_begin[c + 1]; ++i)
            s->a[c] -= chain_sign(&g->m, chains, i) * s->edge[s->of_element[i]].x;
}

static double chain_sum(const parallel_heat *g, const loxo_chains *chains, const special_edges *s, int64_t c)
{
    double sum = 0.0;
    for (int64_t i = chains->chain_begin[c]; i < chains->chain_begin[c + 1]; ++i)
        sum += chain_sign(&g->m, chains, i) * s->edge[s->of_element[i]].x;
    return sum;
}

/* (22) with the copies of the chains on top of those of the faces; a face's -r / 3 is read off its potentials. */
static void update_chains(void *arg, int64_t number)
{
    edge_problem *problem = arg;
    parallel_heat *g = problem->g;
    const loxo_chains *chains = problem->chains;
    special_edges *s = &problem->s;
    const double mu = g->settings.penalty, theta = problem->theta;
    const double *next = g->potential[number & 1], *old = g->potential[1 - (number & 1)];
    for (int64_t i = 0; i < s->n; ++i)
        s->edge[i].pull = 0.0;
    for (int64_t c = 0; c < chains->n_chains; ++c) {
        const double sum = chain_sum(g, chains, s, c), r = s->a[c] + 2.0 * sum;
        const double length = (double)(chains->chain_begin[c + 1] - chains->chain_begin[c]);
        s->a[c] += sum;
        for (int64_t i = chains->chain_begin[c]; i < chains->chain_begin[c + 1]; ++i)
            s->edge[s->of_element[i]].pull += chain_sign(&g->m, chains, i) * r / length;
    }
    for (int64_t i = 0; i < s->n; ++i) {
        special_edge *e = &s->edge[i];
        const loxo_index h = e->halfedge, t = g->m.halfedge_twin[h];
        const double n_sides = t < 0 ? 1.0 : 2.0, n_copies = n_sides + (double)e->n_chains;
        double push = next[h / 3] / theta - old[h / 3];
        if (t >= 0) push -= next[t / 3] / theta - old[t / 3];
        e->x = (n_sides * e->average + mu * (n_copies * e->x + push - e->pull)) / (n_sides + mu * n_copies);
        const double correction = e->x - (e->average + from_potential(g, h, next));
        g->closure[h / 3] += correction - e->correction;
        if (t >= 0) g->closure[t / 3] -= correction - e->correction;
        e->correction = correction;
    }
}

/* The differences that came out, along the tree's edges. */
static void finish_tree(parallel_heat *g, const special_edges *s, const double *potential)
{
    const int64_t n = g->m.n_vertices;
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, n, 4.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t v = r.begin; v < r.end; ++v) {
            const loxo_index h = heat_kept_halfedge(g, v);
            const int64_t soon = v + PLACES_AHEAD < n ? g->rank[v + PLACES_AHEAD] : -1;
            if (soon >= 0) __builtin_prefetch(&g->value[2 * soon + 1], 1, 2);
            if (h < 0) continue;
            const double x = from_potential(g, h, potential);
            g->value[2 * (int64_t)g->rank[v] + 1] += g->m.halfedge_vertex[h] == v ? -x : x;
        }
    }
    for (int64_t i = 0; i < s->n; ++i) {
        const loxo_index h = s->edge[i].halfedge, t = g->m.halfedge_twin[h];
        const loxo_index ends[2] = {g->m.halfedge_vertex[h], k_head(&g->m, h)};
        for (int k = 0; k < 2; ++k) {
            const loxo_index kept = heat_kept_halfedge(g, ends[k]);
            if (kept < 0 || (kept != h && kept != t)) continue;
            g->value[2 * (int64_t)g->rank[ends[k]] + 1] += k == 1 ? s->edge[i].correction : -s->edge[i].correction;
        }
    }
}

static double worst_chain(const parallel_heat *g, const loxo_chains *chains, const special_edges *s)
{
    double worst = 0.0;
    for (int64_t c = 0; c < chains->n_chains; ++c) {
        const double length = (double)(chains->chain_begin[c + 1] - chains->chain_begin[c]);
        worst = fmax(worst, fabs(chain_sum(g, chains, s, c)) / (length * g->mean_edge_length));
    }
    return worst;
}

/* Differences and what is taken from them. */
static loxo_status make_targets(edge_problem *e, double *disagreement)
{
    parallel_heat *g = e->g;
    const int64_t n_faces = g->m.n_faces;
    loxo_status status = LOXO_OK;
    heat_to_vertices(g);
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, n_faces, 8.0))
    {
        const loxo_range r = loxo_thread_range(n_faces);
        g->kernels->face_differences(&g->m, g->vertex_value, g->vertex_scale, r.begin, r.end, g->difference);
    }
    if ((status = heat_fill_flat_faces(g, g->difference)) < 0) return status;
    if ((status = heat_aim_from_seeds(g, g->difference)) < 0) return status;
    if ((status = loxo_sum(g->ctx, n_faces, 1, close_faces, g, disagreement)) < 0) return status;
    if (e->chains->n_chains == 0) return LOXO_OK;
    if ((status = special_edges_create(g->ctx, &g->m, e->chains, &e->s)) < 0) return status;
    start_chains(g, e->chains, &e->s);
    return LOXO_OK;
}

loxo_status heat_recover_edge(parallel_heat *g, const loxo_chains *chains, loxo_geodesic_info *info)
{
    const double mu = g->settings.penalty;
    edge_problem e = {.g = g, .chains = chains, .theta = mu / (1.0 + mu)};
    double disagreement = 0.0;
    loxo_status status = make_targets(&e, &disagreement);
    if (status < 0) return status;
    heat_clock(g, LOXO_GEODESIC_PHASE_GRADIENT, info);

    const admm_problem problem = {.g = g,
                                  .arg = &e,
                                  .face_ns = 2.0,
                                  .iterate = iterate,
                                  .after = e.s.n > 0 ? update_chains : NULL,
                                  .test = find_residuals};
    if (g->settings.n_iterations == 0) memset(g->potential[0], 0, (size_t)g->m.n_faces * sizeof *g->potential[0]);
    status = heat_iterate(&problem, info);
    if (status >= 0) {
        info->objective += disagreement;
        info->constraint_residual = worst_chain(g, chains, &e.s);
        finish_tree(g, &e.s, g->potential[info->n_iterations & 1]);
        heat_clock(g, LOXO_GEODESIC_PHASE_ADMM, info);
    }
    special_edges_destroy(g->ctx, &e.s);
    return status;
}
