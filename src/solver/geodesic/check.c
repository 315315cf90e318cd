/* SPDX-License-Identifier: MIT
 * The answer is looked at before it is given: a distance grows along an edge by no more than the edge's length, and its
 * gradient has length 1 nearly everywhere. */
#include "base/allocate.h"
#include "kernel/variants.h"
#include "par/range.h"
#include "solver/geodesic/geodesic_internal.h"

#include <math.h>
#include <string.h>

/* Breaches |d(a) - d(b)| / |ab| - 1 are counted in bins that grow by a quarter of an octave from 2^-20 on; a percentile
 * is the upper end of its bin. Counts are integers: any split among threads gives the same. */
#define BINS_PER_OCTAVE 4
#define FIRST_OCTAVE    (-20)
#define N_BINS          (BINS_PER_OCTAVE * 40)

typedef struct breach_counts {
    int64_t n, bin[N_BINS]; /* bin[0]: no breach, or a smaller one than 2^-20 */
    double max;
} breach_counts;

static int bin_of(double breach)
{
    const double x = (log2(breach) - FIRST_OCTAVE) * BINS_PER_OCTAVE;
    if (!(x > 0.0)) return 0;
    return x < N_BINS - 2 ? (int)x + 1 : N_BINS - 1;
}

static void count_breach(breach_counts *c, double breach)
{
    ++c->bin[breach > 0.0 ? bin_of(breach) : 0];
    if (breach > c->max) c->max = breach;
}

static double bin_end(int bin) { return bin == 0 ? 0.0 : exp2(FIRST_OCTAVE + (double)bin / BINS_PER_OCTAVE); }

static double percentile(const breach_counts *c, double share)
{
    int64_t sum = 0;
    for (int b = 0; b < N_BINS; ++b) {
        sum += c->bin[b];
        if ((double)sum >= share * (double)c->n) return fmin(bin_end(b), c->max);
    }
    return c->max;
}

/* Faces to be looked at together: their edges, each at the lower of its two half-edges, and their gradients. */
typedef struct looks {
    k_looks batch;
    int n;
    uint8_t edges[K_LOOKS]; /* bit k: edge k is counted in this face */
} looks;

static void add_face(const loxo_mesh_view *m, const double *distance, int64_t f, looks *l)
{
    const loxo_index *v = &m->halfedge_vertex[3 * f], *twin = &m->halfedge_twin[3 * f];
    const double d[3] = {distance[v[0]], distance[v[1]], distance[v[2]]};
    if (!(d[0] + d[1] + d[2] < HUGE_VAL)) return;
    loxo_vec3 p[3];
    unsigned edges = 0;
    k_face_corners(m, f, p);
    for (int k = 0; k < 3; ++k) {
        l->batch.x[k][l->n] = p[k].x;
        l->batch.y[k][l->n] = p[k].y;
        l->batch.z[k][l->n] = p[k].z;
        l->batch.distance[k][l->n] = d[k];
        edges |= twin[k] < 0 || twin[k] > 3 * f + k ? 1u << k : 0u;
    }
    l->edges[l->n++] = (uint8_t)edges;
}

/* sums: area of reached faces, area where the gradient's length is off by over a tenth. */
static void look(const k_variant *kernels, looks *l, breach_counts *c, double *sums)
{
    k_looks *b = &l->batch;
    if (l->n == 0) return;
    for (int k = 0; k < 3; ++k) /* what is not used is something */
        for (int i = l->n; i < K_LOOKS; ++i)
            b->x[k][i] = b->y[k][i] = b->z[k][i] = b->distance[k][i] = 0.0;
    kernels->look(b);
    for (int i = 0; i < l->n; ++i) {
        sums[0] += b->area[i];
        sums[1] += b->area_off[i];
    }
    int n_edges = 0, n_steep = 0;
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < l->n; ++i) {
            const int is_counted = l->edges[i] >> k & 1;
            n_edges += is_counted;
            n_steep += is_counted & (b->rise_square[k][i] <= b->edge_square[k][i] ? 0 : 1);
        }
    c->n += n_edges;
    c->bin[0] += n_edges - n_steep;
    for (int k = 0; k < 3 && n_steep > 0; ++k)
        for (int i = 0; i < l->n; ++i) {
            const double square = b->rise_square[k][i], limit = b->edge_square[k][i];
            if ((l->edges[i] >> k & 1) == 0 || square <= limit) continue;
            count_breach(c, limit > 0.0 ? sqrt(square / limit) - 1.0 : HUGE_VAL);
        }
    l->n = 0;
}

typedef struct look_arg {
    const geodesic_problem *problem;
    const k_variant *kernels;
    const double *distance;
    const loxo_index *vertex; /* NULL: all */
    breach_counts *counts;    /* one a thread: whole numbers, so it does not matter which thread counts what */
} look_arg;

static void partial_look(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const look_arg *a = arg;
    breach_counts *counts = &a->counts[loxo_thread_id()];
    looks l;
    l.n = 0;
    for (int64_t f = begin; f < end; ++f) {
        add_face(&a->problem->m, a->distance, f, &l);
        if (l.n == K_LOOKS) look(a->kernels, &l, counts, sums);
    }
    look(a->kernels, &l, counts, sums);
}

/* Whether corner k is the one by which a face is looked at: its lowest vertex, of a vertex that it has more than once the first
 * corner. */
static inline bool is_lowest(const loxo_index *corner, int k)
{
    for (int j = 0; j < 3; ++j)
        if (corner[j] < corner[k] || (corner[j] == corner[k] && j < k)) return false;
    return true;
}

/* The same by vertices of the list. */
static void partial_look_around(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const look_arg *a = arg;
    const loxo_mesh_view *m = &a->problem->m;
    breach_counts *counts = &a->counts[loxo_thread_id()];
    looks l;
    l.n = 0;
    for (int64_t i = begin; i < end; ++i) {
        const loxo_index start = m->vertex_halfedge[a->vertex[i]];
        for (loxo_index h = start; h >= 0;) {
            if (is_lowest(&m->halfedge_vertex[h - h % 3], (int)(h % 3))) add_face(m, a->distance, h / 3, &l);
            if (l.n == K_LOOKS) look(a->kernels, &l, counts, sums);
            h = m->halfedge_twin[k_previous(h)];
            if (h == start) break;
        }
    }
    look(a->kernels, &l, counts, sums);
}

/* sums: not a number, below zero by more than rounding. */
static void partial_distance(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const look_arg *a = arg;
    const double least = -0.1 * a->problem->mean_edge_length;
    for (int64_t i = begin; i < end; ++i) {
        const double distance = a->distance[a->vertex != NULL ? a->vertex[i] : i];
        sums[0] += isnan(distance) ? 1.0 : 0.0;
        sums[1] += distance < least ? 1.0 : 0.0;
    }
}

loxo_status geodesic_check(const geodesic_problem *problem, const double *distance, const loxo_index *vertices,
                           int64_t n_vertices, loxo_geodesic_info *info)
{
    loxo_context *ctx = problem->ctx;
    const int64_t n = vertices != NULL ? n_vertices : problem->m.n_vertices;
    const int64_t n_looks = vertices != NULL ? n : problem->m.n_faces;
    const int n_threads = loxo_context_n_threads(ctx);
    breach_counts total, *counts = loxo_allocate_zero(ctx, n_threads, sizeof *counts);
    const look_arg arg = {problem, k_variant_get(loxo_context_isa(ctx)), distance, vertices, counts};
    double sums[2] = {0.0, 0.0}, n_bad[2] = {0.0, 0.0};
    loxo_status status = LOXO_OK;
    if (counts == NULL) return LOXO_ERR_MEMORY;
    if ((status = loxo_sum(ctx, n_looks, 2, vertices != NULL ? partial_look_around : partial_look, &arg, sums)) < 0) {
        loxo_release(ctx, counts);
        return status;
    }
    memset(&total, 0, sizeof total);
    for (int t = 0; t < n_threads; ++t) {
        total.n += counts[t].n;
        total.max = fmax(total.max, counts[t].max);
        for (int b = 0; b < N_BINS; ++b)
            total.bin[b] += counts[t].bin[b];
    }
    loxo_release(ctx, counts);
    if ((status = loxo_sum(ctx, n, 2, partial_distance, &arg, n_bad)) < 0) return status;

    double farthest = 0.0;
#pragma omp parallel for num_threads(loxo_threads_for(ctx, n, 1.0)) reduction(max : farthest)
    for (int64_t i = 0; i < n; ++i) {
        const double d = distance[vertices != NULL ? vertices[i] : i];
        if (d > farthest && d < HUGE_VAL) farthest = d;
    }
    info->distance_max = farthest;
    info->breach_percentile_50 = percentile(&total, 0.50);
    info->breach_percentile_90 = percentile(&total, 0.90);
    info->breach_percentile_99 = percentile(&total, 0.99);
    info->breach_max = total.max;
    info->gradient_share = sums[0] > 0.0 ? sums[1] / sums[0] : 0.0;
    info->n_negative = (int64_t)n_bad[1];
    info->check_passed = info->gradient_share <= problem->settings.check_gradient_share &&
                         info->breach_percentile_99 <= problem->settings.check_breach;
    if (n_bad[0] > 0.0) return loxo_fail(ctx, LOXO_ERR_NUMERIC, "geodesic: %.0f distances are not finite", n_bad[0]);
    return LOXO_OK;
}
