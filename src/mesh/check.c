/* SPDX-License-Identifier: MIT
 * loxo_mesh_check: what a soup is like, combinatorially and in shape. */
#include "base/allocate.h"
#include "mesh/components.h"
#include "mesh/halfedge.h"
#include "mesh/soup.h"
#include "mesh/statistics.h"
#include "par/range.h"

#include <string.h>

#define PI 3.14159265358979323846

/* What the parts of a check share. Arrays that one part made and the next ones need. */
typedef struct check {
    loxo_context *ctx;
    const loxo_mesh_arrays *arrays;
    loxo_mesh_report *report;
    loxo_index *twin;
    uint32_t *degree;   /* [n_vertices] corners of faces that are not degenerate */
    loxo_index *corner; /* [n_vertices] the lowest of them, -1 */
    const void *marks;  /* of the fault being counted */
    double centre[3];
} check;

/* ---- faults -------------------------------------------------------------------------------------------------- */

typedef bool (*fault_fn)(const check *c, int64_t i);

/* Counts in parallel, then looks for the first ones, which ends early. per_number items share a number: a half-edge's
 * fault is told by its face. */
static void count_fault(const check *c, int64_t n, int per_number, fault_fn is_faulty, loxo_fault *fault)
{
    int64_t count = 0;
#pragma omp parallel num_threads(loxo_threads_for(c->ctx, n, 5)) reduction(+ : count)
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i)
            count += is_faulty(c, i);
    }
    *fault = (loxo_fault){.count = count};
    for (int64_t i = 0; i < n && fault->n_first < LOXO_N_OFFENDERS && fault->n_first < count; ++i)
        if (is_faulty(c, i)) fault->first[fault->n_first++] = i / per_number;
}

static bool is_nonfinite(const check *c, int64_t v) { return !loxo_arrays_finite(c->arrays, v); }

static bool is_duplicate_vertex(const check *c, int64_t v) { return ((const loxo_index *)c->marks)[v] != v; }

static bool is_marked(const check *c, int64_t i) { return ((const uint8_t *)c->marks)[i] != 0; }

static bool is_unreferenced(const check *c, int64_t v) { return c->degree[v] == 0; }

static bool is_degenerate_face(const check *c, int64_t f) { return loxo_is_degenerate(&c->arrays->triangle[3 * f]); }

/* The lowest half-edge of an edge with more than two. */
static bool is_nonmanifold_edge(const check *c, int64_t h)
{
    return c->twin[h] > h && !loxo_is_paired(c->twin, (loxo_index)h);
}

static bool is_bow_tie(const check *c, int64_t v)
{
    const loxo_index h = c->corner[v];
    return h >= 0 && loxo_fan_size(c->arrays->triangle, c->twin, h) < c->degree[v];
}

/* ---- combinatorics ------------------------------------------------------------------------------------------- */

static loxo_status check_duplicates(check *c)
{
    const loxo_mesh_arrays *a = c->arrays;
    loxo_index *first = loxo_allocate(c->ctx, a->n_vertices, sizeof *first);
    if (first == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = loxo_find_duplicate_vertices(c->ctx, a, first);
    if (status >= 0) {
        c->marks = first;
        count_fault(c, a->n_vertices, 1, is_duplicate_vertex, &c->report->duplicate_vertices);
    }
    loxo_release(c->ctx, first);
    if (status < 0) return status;

    uint8_t *duplicate = loxo_allocate(c->ctx, a->n_faces, sizeof *duplicate);
    if (duplicate == NULL) return LOXO_ERR_MEMORY;
    status = loxo_mark_duplicate_faces(c->ctx, a->n_vertices, a->n_faces, a->triangle, duplicate);
    if (status >= 0) {
        c->marks = duplicate;
        count_fault(c, a->n_faces, 1, is_marked, &c->report->duplicate_faces);
    }
    loxo_release(c->ctx, duplicate);
    return status;
}

static void lower_to(loxo_index *place, loxo_index mine)
{
    loxo_index seen = __atomic_load_n(place, __ATOMIC_RELAXED);
    while (seen < 0 || mine < seen)
        if (__atomic_compare_exchange_n(place, &seen, mine, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) return;
}

/* How many corners each vertex has and which is the lowest. */
static loxo_status count_corners(check *c)
{
    const loxo_mesh_arrays *a = c->arrays;
    c->degree = loxo_allocate(c->ctx, a->n_vertices, sizeof *c->degree);
    if (c->degree == NULL) return LOXO_ERR_MEMORY;
    c->corner = loxo_allocate(c->ctx, a->n_vertices, sizeof *c->corner);
    if (c->corner == NULL) return LOXO_ERR_MEMORY;
#pragma omp parallel num_threads(loxo_threads_for(c->ctx, a->n_faces, 15))
    {
        const loxo_range v = loxo_thread_range(a->n_vertices), r = loxo_thread_range(a->n_faces);
        for (int64_t i = v.begin; i < v.end; ++i) {
            c->degree[i] = 0;
            c->corner[i] = -1;
        }
#pragma omp barrier
        for (int64_t f = r.begin; f < r.end; ++f) {
            if (loxo_is_degenerate(&a->triangle[3 * f])) continue;
            for (int64_t h = 3 * f; h < 3 * f + 3; ++h) {
                __atomic_fetch_add(&c->degree[a->triangle[h]], 1, __ATOMIC_RELAXED);
                lower_to(&c->corner[a->triangle[h]], (loxo_index)h);
            }
        }
    }
    return LOXO_OK;
}

static loxo_status check_orientation(check *c, const loxo_edge_counts *edges)
{
    loxo_mesh_report *report = c->report;
    report->is_oriented = report->is_orientable = true;
    if (edges->n_same_way == 0) return LOXO_OK;
    int64_t n_turned, conflict;
    uint8_t *turn = loxo_allocate(c->ctx, c->arrays->n_faces, sizeof *turn);
    if (turn == NULL) return LOXO_ERR_MEMORY;
    const loxo_status status =
        loxo_find_orientation(c->ctx, c->arrays->n_faces, c->arrays->triangle, c->twin, turn, &n_turned, &conflict);
    if (status >= 0) {
        report->is_oriented = false;
        report->is_orientable = conflict < 0;
        c->marks = turn;
        if (report->is_orientable) count_fault(c, c->arrays->n_faces, 1, is_marked, &report->inconsistent_faces);
    }
    loxo_release(c->ctx, turn);
    return status;
}

static loxo_status check_topology(check *c)
{
    const loxo_mesh_arrays *a = c->arrays;
    loxo_mesh_report *report = c->report;
    loxo_edge_counts edges;
    loxo_status status;
    c->twin = loxo_allocate(c->ctx, 3 * a->n_faces, sizeof *c->twin);
    if (c->twin == NULL) return LOXO_ERR_MEMORY;
    status = loxo_match_halfedges(c->ctx, a->n_vertices, a->n_faces, a->triangle, c->twin, &edges);
    if (status < 0) return status;
    if ((status = count_corners(c)) < 0) return status;
    count_fault(c, a->n_vertices, 1, is_unreferenced, &report->unreferenced_vertices);
    count_fault(c, a->n_faces, 1, is_degenerate_face, &report->degenerate_faces);
    count_fault(c, 3 * a->n_faces, 3, is_nonmanifold_edge, &report->nonmanifold_edges);
    count_fault(c, a->n_vertices, 1, is_bow_tie, &report->nonmanifold_vertices);
    if ((status = check_orientation(c, &edges)) < 0) return status;

    /* the corners have served */
    loxo_index *parent = c->corner;
    const int64_t n_used = a->n_vertices - report->unreferenced_vertices.count;
    const int64_t n_sound = a->n_faces - report->degenerate_faces.count;
    report->n_edges = edges.n_edges;
    report->n_boundary_edges = edges.n_boundary;
    report->n_components = n_used - loxo_join_faces(c->ctx, a->n_vertices, a->n_faces, a->triangle, parent);
    report->euler = n_used - edges.n_edges + n_sound;
    report->is_manifold = report->nonmanifold_edges.count == 0 && report->nonmanifold_vertices.count == 0;
    report->is_closed = edges.n_boundary == 0 && n_sound > 0;
    report->n_boundary_loops = report->genus = -1;
    if (!report->is_manifold) return LOXO_OK;
    report->n_boundary_loops =
        edges.n_boundary - loxo_join_boundary(c->ctx, a->n_vertices, a->n_faces, a->triangle, c->twin, parent);
    if (report->is_orientable)
        report->genus = (2 * report->n_components - report->n_boundary_loops - report->euler) / 2;
    return LOXO_OK;
}

/* ---- shape --------------------------------------------------------------------------------------------------- */

typedef struct shape {
    double edge[3]; /* lengths; edge k is opposite corner k */
    double cot[3];  /* of the angles */
    double doubled; /* area */
    double longest;
} shape;

/* False for degenerate faces and where a corner is not finite. cot is only meaningful when doubled > 0. */
static bool face_shape(const check *c, int64_t f, shape *s)
{
    const loxo_index *v = &c->arrays->triangle[3 * f];
    double p[3][3], e[3][3];
    if (loxo_is_degenerate(v)) return false;
    for (int k = 0; k < 3; ++k) {
        loxo_arrays_position(c->arrays, v[k], p[k]);
        if (!isfinite(p[k][0]) || !isfinite(p[k][1]) || !isfinite(p[k][2])) return false;
    }
    s->longest = 0.0;
    for (int k = 0; k < 3; ++k) {
        const double *a = p[(k + 1) % 3], *b = p[(k + 2) % 3];
        for (int i = 0; i < 3; ++i)
            e[k][i] = b[i] - a[i];
        s->edge[k] = sqrt(e[k][0] * e[k][0] + e[k][1] * e[k][1] + e[k][2] * e[k][2]);
        if (s->edge[k] > s->longest) s->longest = s->edge[k];
    }
    const double n[3] = {e[0][1] * e[1][2] - e[0][2] * e[1][1], e[0][2] * e[1][0] - e[0][0] * e[1][2],
                         e[0][0] * e[1][1] - e[0][1] * e[1][0]};
    s->doubled = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int k = 0; k < 3 && s->doubled > 0.0; ++k) {
        const double *x = e[(k + 1) % 3], *y = e[(k + 2) % 3];
        s->cot[k] = -(x[0] * y[0] + x[1] * y[1] + x[2] * y[2]) / s->doubled;
    }
    return true;
}

static bool is_zero_area(const check *c, int64_t f)
{
    shape s;
    return face_shape(c, f, &s) && s.doubled == 0.0;
}

/* Lengths of the edges whose lowest half-edge is in face f. */
static int edge_lengths(const void *arg, int64_t f, double value[3])
{
    const check *c = arg;
    shape s;
    int n = 0;
    if (!face_shape(c, f, &s)) return 0;
    for (int k = 0; k < 3; ++k) {
        const int64_t h = 3 * f + k; /* from corner k to k + 1: opposite corner k + 2 */
        if (c->twin[h] < 0 || c->twin[h] > h) value[n++] = s.edge[(k + 2) % 3];
    }
    return n;
}

/* Cotangents, which fall as angles grow, stand for them: no arc function in the loop. */
static int corner_cotangents(const void *arg, int64_t f, double value[3])
{
    shape s;
    if (!face_shape(arg, f, &s) || !(s.doubled > 0.0)) return 0;
    memcpy(value, s.cot, sizeof s.cot);
    return 3;
}

/* cot is not finite only where the area underflows. */
static double angle_of(double cot) { return isfinite(cot) ? atan2(1.0, cot) : cot > 0.0 ? 0.0 : PI; }

enum { SUM_AREA, SUM_VOLUME, SUM_QUALITY, SUM_EDGE, SUM_N };

static void add_faces(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const check *c = arg;
    for (int64_t f = begin; f < end; ++f) {
        const loxo_index *v = &c->arrays->triangle[3 * f];
        double p[3][3], length[3];
        shape s;
        if (!face_shape(c, f, &s)) continue;
        for (int k = 0; k < 3; ++k) {
            loxo_arrays_position(c->arrays, v[k], p[k]);
            for (int i = 0; i < 3; ++i)
                p[k][i] -= c->centre[i];
        }
        sums[SUM_AREA] += 0.5 * s.doubled;
        sums[SUM_VOLUME] +=
            (p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) + p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
             p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0])) /
            6.0;
        /* eq. (27): 2 sqrt(3) r / longest, r = area / half the circumference */
        if (s.longest > 0.0)
            sums[SUM_QUALITY] += 2.0 * sqrt(3.0) * (s.doubled / (s.edge[0] + s.edge[1] + s.edge[2])) / s.longest;
        for (int k = edge_lengths(c, f, length) - 1; k >= 0; --k)
            sums[SUM_EDGE] += length[k];
    }
}

/* Cotangent of the angle opposite half-edge h, 0 where there is none. */
static double opposite_cotangent(const check *c, int64_t h)
{
    shape s;
    return face_shape(c, h / 3, &s) && s.doubled > 0.0 ? s.cot[(h % 3 + 2) % 3] : 0.0;
}

/* Shares of faces and edges. Opposite angles sum to more than pi where their cotangents sum to less than 0; sums within
 * rounding of 0, as in every square grid, do not count. */
static void count_shares(check *c)
{
    const int64_t n_faces = c->arrays->n_faces;
    int64_t n_obtuse = 0, n_shaped = 0, n_inner = 0, n_bad = 0, n_negative = 0;
#pragma omp parallel num_threads(loxo_threads_for(c->ctx, n_faces, 100))                                               \
    reduction(+ : n_obtuse, n_shaped, n_inner, n_bad, n_negative)
    {
        const loxo_range r = loxo_thread_range(n_faces);
        for (int64_t f = r.begin; f < r.end; ++f) {
            shape s;
            if (!face_shape(c, f, &s)) continue;
            n_shaped += 1;
            n_obtuse += s.doubled > 0.0 && (s.cot[0] < -1e-12 || s.cot[1] < -1e-12 || s.cot[2] < -1e-12);
            for (int k = 0; k < 3; ++k) {
                const loxo_index h = (loxo_index)(3 * f + k);
                const double a = s.doubled > 0.0 ? s.cot[(k + 2) % 3] : 0.0;
                if (c->twin[h] == -1) n_negative += a < -1e-12;
                if (c->twin[h] < h || !loxo_is_paired(c->twin, h)) continue;
                const double b = opposite_cotangent(c, c->twin[h]);
                const bool is_negative = a + b < -1e-12 * (1.0 + fabs(a) + fabs(b));
                n_inner += 1;
                n_bad += is_negative;
                n_negative += is_negative;
            }
        }
    }
    loxo_mesh_report *report = c->report;
    if (n_shaped > 0) report->share_obtuse = (double)n_obtuse / (double)n_shaped;
    if (n_inner > 0) report->share_nondelaunay = (double)n_bad / (double)n_inner;
    if (report->n_edges > 0) report->share_negative_cotangent = (double)n_negative / (double)report->n_edges;
}

static void find_box(check *c)
{
    double low[3] = {(double)INFINITY, (double)INFINITY, (double)INFINITY};
    double high[3] = {-(double)INFINITY, -(double)INFINITY, -(double)INFINITY};
#pragma omp parallel num_threads(loxo_threads_for(c->ctx, c->arrays->n_vertices, 5)) reduction(min                     \
                                                                                               : low)                  \
    reduction(max                                                                                                      \
              : high)
    {
        const loxo_range r = loxo_thread_range(c->arrays->n_vertices);
        for (int64_t v = r.begin; v < r.end; ++v) {
            double p[3];
            if (!loxo_arrays_finite(c->arrays, v)) continue;
            loxo_arrays_position(c->arrays, v, p);
            for (int k = 0; k < 3; ++k) {
                if (p[k] < low[k]) low[k] = p[k];
                if (p[k] > high[k]) high[k] = p[k];
            }
        }
    }
    for (int k = 0; k < 3; ++k) {
        const bool is_empty = low[k] > high[k];
        c->report->bounding_box[0][k] = is_empty ? 0.0 : low[k];
        c->report->bounding_box[1][k] = is_empty ? 0.0 : high[k];
        c->centre[k] = is_empty ? 0.0 : 0.5 * low[k] + 0.5 * high[k];
    }
}

enum { QUANTILE_1, QUANTILE_50, QUANTILE_99, N_QUANTILES };

static loxo_status check_shape(check *c)
{
    static const int per_cent[N_QUANTILES] = {1, 50, 99};
    const int64_t n_faces = c->arrays->n_faces;
    loxo_mesh_report *report = c->report;
    double sums[SUM_N];
    loxo_quantiles q;
    loxo_status status;
    find_box(c);
    count_fault(c, n_faces, 1, is_zero_area, &report->zero_area_faces);
    count_shares(c);
    if ((status = loxo_sum(c->ctx, n_faces, SUM_N, add_faces, c, sums)) < 0) return status;
    const int64_t n_sound = n_faces - report->degenerate_faces.count;
    report->area = sums[SUM_AREA];
    report->volume = report->is_closed && report->is_oriented ? sums[SUM_VOLUME] : 0.0;
    report->quality = n_sound > 0 ? sums[SUM_QUALITY] / (double)n_sound : 0.0;

    if ((status = loxo_quantiles_find(c->ctx, n_faces, edge_lengths, c, N_QUANTILES, per_cent, &q)) < 0) return status;
    if (q.n > 0)
        report->edge_length = (loxo_statistics){
            .min = q.min,
            .max = q.max,
            .mean = sums[SUM_EDGE] / (double)q.n,
            .median = q.quantile[QUANTILE_50],
            .percentile_1 = q.quantile[QUANTILE_1],
            .percentile_99 = q.quantile[QUANTILE_99],
        };
    if ((status = loxo_quantiles_find(c->ctx, n_faces, corner_cotangents, c, N_QUANTILES, per_cent, &q)) < 0)
        return status;
    if (q.n > 0)
        report->angle_rad = (loxo_statistics){
            .min = angle_of(q.max),
            .max = angle_of(q.min),
            .mean = PI / 3.0, /* the angles of every triangle sum to pi */
            .median = angle_of(q.quantile[QUANTILE_50]),
            .percentile_1 = angle_of(q.quantile[QUANTILE_99]),
            .percentile_99 = angle_of(q.quantile[QUANTILE_1]),
        };
    return LOXO_OK;
}

/* ---- all of it ----------------------------------------------------------------------------------------------- */

static loxo_status stop(loxo_context *ctx, double fraction)
{
    if (!loxo_stop_wanted(ctx, "check", fraction)) return LOXO_OK;
    return loxo_fail(ctx, LOXO_ERR_STOPPED, "check: stopped by the monitor");
}

static loxo_status run(check *c)
{
    loxo_status status;
    int64_t n_degenerate, first_degenerate;
    if ((status = loxo_arrays_check_counts(c->ctx, "check", c->arrays)) < 0) return status;
    if ((status = loxo_arrays_check_ids(c->ctx, c->arrays, &n_degenerate, &first_degenerate)) < 0) return status;
    c->report->n_vertices = c->arrays->n_vertices;
    c->report->n_faces = c->arrays->n_faces;
    count_fault(c, c->arrays->n_vertices, 1, is_nonfinite, &c->report->nonfinite_vertices);
    if ((status = stop(c->ctx, 0.0)) < 0) return status;
    if ((status = check_duplicates(c)) < 0) return status;
    if ((status = stop(c->ctx, 0.3)) < 0) return status;
    if ((status = check_topology(c)) < 0) return status;
    if ((status = stop(c->ctx, 0.6)) < 0) return status;
    return check_shape(c);
}

loxo_status loxo_mesh_check(loxo_context *ctx, const loxo_mesh_arrays *arrays, loxo_mesh_report *report)
{
    loxo_mesh_report found = {0};
    if (ctx == NULL || report == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "check: no context or no report");
    loxo_progress_begin(ctx);
    check c = {.ctx = ctx, .arrays = arrays, .report = &found};
    const loxo_status status = run(&c);
    loxo_release(ctx, c.twin);
    loxo_release(ctx, c.degree);
    loxo_release(ctx, c.corner);
    if (status >= 0) *report = found;
    return status;
}
