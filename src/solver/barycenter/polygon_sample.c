/* SPDX-License-Identifier: MIT
 * Random closed polygons and their weights; README.md derives these. */
#include "base/allocate.h"
#include "base/context.h"
#include "base/options.h"
#include "base/os.h"
#include "base/rng.h"
#include "hyperbolic/hyperbolic.h"
#include "kernel/ball_kernel.h"
#include "par/range.h"
#include "solver/barycenter/polygon_internal.h"

#include <math.h>
#include <string.h>

#define MOST       LOXO_MOEBIUS_MOST_DIMENSIONS
#define PI         3.14159265358979323846
#define SLAB       (1 << 18) /* numbers that are drawn, closed and weighed at a time, in cache */
#define TRIALS     32        /* of a point of the disk: each is inside with pi / 4 */
#define DRAW_NS    10.0      /* an edge in space */
#define EDGE_PAIRS 32        /* of coordinates that an edge can have */

/* A point of the unit disk, not 0: number i of a seed. Returns its square. */
static double draw_in_disk(uint64_t seed, uint64_t i, double *u, double *v)
{
    double square = 0.0;
    for (uint64_t trial = 0; trial < TRIALS; ++trial) {
        const uint64_t at = (i * TRIALS + trial) * 2;
        *u = 2.0 * loxo_random_unit(seed, at) - 1.0;
        *v = 2.0 * loxo_random_unit(seed, at + 1) - 1.0;
        square = *u * *u + *v * *v;
        if (square < 1.0 && square > 1e-30) return square;
    }
    *u = 1e-1; /* once in 1e21 */
    *v = 0.0;
    return 1e-2;
}

/* A uniform direction: edge i of a seed.
 * source  Marsaglia 1972, Choosing a point from the surface of a sphere; Marsaglia, Bray 1964 for normal numbers */
static void draw_direction(uint64_t seed, uint64_t i, int d, double *x)
{
    double u, v, norm = 0.0;
    if (d <= 3) {
        const double square = draw_in_disk(seed, i * EDGE_PAIRS, &u, &v);
        if (d == 2) {
            x[0] = (u * u - v * v) / square;
            x[1] = 2.0 * u * v / square;
            return;
        }
        const double f = 2.0 * sqrt(1.0 - square);
        x[0] = u * f;
        x[1] = v * f;
        x[2] = 1.0 - 2.0 * square;
        return;
    }
    for (int k = 0; k < d; k += 2) {
        const double square = draw_in_disk(seed, i * EDGE_PAIRS + (uint64_t)(k / 2), &u, &v);
        const double f = sqrt(-2.0 * log(square) / square);
        x[k] = u * f;
        if (k + 1 < d) x[k + 1] = v * f;
    }
    for (int k = 0; k < d; ++k)
        norm += x[k] * x[k];
    for (int k = 0; k < d; ++k)
        x[k] /= sqrt(norm);
}

/* What the weight needs of a closed polygon: sums over edges, with s of the direction y and P = 1 - y y^T. */
typedef struct shape {
    double mean[MOST];          /* of y */
    double square[MOST * MOST]; /* mean of y y^T */
    double a[MOST * MOST];      /* sum of l P */
    double g[MOST * MOST];      /* sum of l^2 P */
} shape;

static void look_at(int d, int64_t n, const double *length, bool is_edges, const double *x, shape *s)
{
    const size_t row = (size_t)d * sizeof(double), all = (size_t)d * row;
    memset(s->mean, 0, row);
    memset(s->square, 0, all);
    memset(s->a, 0, all);
    memset(s->g, 0, all);
    for (int64_t i = 0; i < n; ++i) {
        const double *from = x + i * d, *to = x + (i + 1 < n ? i + 1 : 0) * d;
        const double l = length == NULL ? 1.0 : length[i], inverse = 1.0 / l;
        double y[MOST];
        for (int k = 0; k < d; ++k)
            y[k] = (is_edges ? from[k] : to[k] - from[k]) * inverse;
        for (int j = 0; j < d; ++j) {
            s->mean[j] += y[j];
            s->a[j * d + j] += l;
            s->g[j * d + j] += l * l;
            for (int k = j; k < d; ++k) {
                const double p = y[j] * y[k];
                s->square[j * d + k] += p;
                s->a[j * d + k] -= l * p;
                s->g[j * d + k] -= l * l * p;
            }
        }
    }
    for (int j = 0; j < d; ++j) {
        s->mean[j] /= (double)n;
        for (int k = j; k < d; ++k) {
            s->square[j * d + k] /= (double)n;
            s->square[k * d + j] = s->square[j * d + k];
            s->a[k * d + j] = s->a[j * d + k];
            s->g[k * d + j] = s->g[j * d + k];
        }
    }
}

/* log det of a positive matrix, which is destroyed; -infinity where it is singular. */
static double log_determinant(int d, double *a)
{
    double value[MOST], v[MOST * MOST], sum = 0.0;
    hyper_eigen(d, a, value, v);
    for (int k = 0; k < d; ++k)
        sum += value[k] > 0.0 ? log(value[k]) : -HUGE_VAL;
    return sum;
}

/* The centre of the density of w that is chosen: a Newton step from 0 to minus the barycenter of the directions without their lengths, which is
 * 0 where lengths are alike. Returns 1 - |centre|^2. */
static double find_centre(int d, shape *s, double *centre)
{
    double value[MOST], v[MOST * MOST], length = 0.0;
    memset(centre, 0, (size_t)d * sizeof *centre);
    for (int j = 0; j < d; ++j)
        for (int k = 0; k < d; ++k)
            s->square[j * d + k] = (j == k ? 1.0 : 0.0) - s->square[j * d + k];
    hyper_eigen(d, s->square, value, v);
    for (int j = 0; j < d; ++j) {
        const double *row = v + (ptrdiff_t)j * d;
        const double c = -0.5 * k_ball_dot(d, row, s->mean) / (value[j] > 1e-3 ? value[j] : 1e-3);
        for (int k = 0; k < d; ++k)
            centre[k] += c * row[k];
    }
    length = sqrt(k_ball_dot(d, centre, centre));
    if (!(length > 1e-12)) {
        memset(centre, 0, (size_t)d * sizeof *centre);
        return 1.0;
    }
    const double r = tanh(length);
    for (int k = 0; k < d; ++k)
        centre[k] *= r / length;
    return (1.0 - r) * (1.0 + r);
}

/* log of rho / J, README.md. */
static double weigh(int d, int64_t n, loxo_polygon_measure measure, const double *w, double co, double log_factor,
                    shape *s)
{
    const double dims = d, power = 2.0 * (double)n * (dims - 1.0) * (dims - 1.0) / dims - dims;
    const double log_mass = 0.5 * dims * log(PI) + lgamma(power + 1.0) - lgamma(power + 1.0 + 0.5 * dims);
    double centre[MOST];
    const double log_a = log_determinant(d, s->a),
                 log_g = measure == LOXO_POLYGON_VOLUME ? log_determinant(d, s->g) : 0.0;
    const double co_centre = find_centre(d, s, centre);
    double apart = 0.0;
    for (int k = 0; k < d; ++k)
        apart += (w[k] - centre[k]) * (w[k] - centre[k]);
    const double log_over =
        log(co_centre) - log(apart + co * co_centre); /* 1 - 2 <c, w> + |c|^2 |w|^2 = |c - w|^2 + co co */
    const double log_density = power * (log_over + log(co)) - log_mass + dims * log_over;
    return log_density - dims * log(2.0) - log_a + 0.5 * log_g + dims * log(co) + (dims - 1.0) * log_factor;
}

typedef struct sampling {
    loxo_context *ctx;
    const loxo_polygon_sample_settings *settings;
    int64_t first, n_polygons, n_edges;
    int d;
    const double *length;
    double *out, *log_weight;
    double *x, *w, *log_factor; /* of a slab */
    loxo_polygon_report *report;
    loxo_polygon_info info;
} sampling;

static void draw(const sampling *s, int64_t begin, int64_t end)
{
    const int d = s->d;
#pragma omp parallel num_threads(loxo_threads_for(s->ctx, (end - begin) * s->n_edges, DRAW_NS))
    {
        const loxo_range r = loxo_thread_range(end - begin);
        for (int64_t p = r.begin; p < r.end; ++p) {
            const uint64_t number = (uint64_t)(s->first + begin + p) * (uint64_t)s->n_edges;
            for (int64_t i = 0; i < s->n_edges; ++i)
                draw_direction(s->settings->seed, number + (uint64_t)i, d, s->x + (p * s->n_edges + i) * d);
        }
    }
}

static void weigh_all(const sampling *s, int64_t begin, int64_t end)
{
    const int d = s->d;
#pragma omp parallel num_threads(loxo_threads_for(s->ctx, (end - begin) * s->n_edges, 0.5 * d * d))
    {
        const loxo_range r = loxo_thread_range(end - begin);
        shape seen;
        for (int64_t p = r.begin; p < r.end; ++p) {
            double *weight = s->log_weight + begin + p;
            *weight = -HUGE_VAL;
            if (s->report[p].state > LOXO_POLYGON_LOOSE) continue;
            look_at(d, s->n_edges, s->length, s->settings->edges, s->out + (begin + p) * s->n_edges * d, &seen);
            *weight =
                weigh(d, s->n_edges, s->settings->measure, s->w + p * d, s->report[p].co, s->log_factor[p], &seen);
            if (isnan(*weight)) *weight = -HUGE_VAL;
        }
    }
}

static void add_info(loxo_polygon_info *sum, const loxo_polygon_info *part, int64_t begin)
{
    sum->n_closed += part->n_closed;
    sum->n_loose += part->n_loose;
    sum->n_flat += part->n_flat;
    sum->n_cannot += part->n_cannot;
    sum->n_bad += part->n_bad;
    sum->n_alone += part->n_alone;
    if (sum->first_failed < 0 && part->first_failed >= 0) sum->first_failed = begin + part->first_failed;
    sum->gap_max = fmax(sum->gap_max, part->gap_max);
    sum->bound_max = fmax(sum->bound_max, part->bound_max);
}

static loxo_status sample_slab(sampling *s, int64_t begin, int64_t end)
{
    const loxo_polygons polygons = {.n_polygons = end - begin,
                                    .n_edges = s->n_edges,
                                    .d = s->d,
                                    .form = LOXO_POLYGON_DIRECTIONS,
                                    .x = s->x,
                                    .length = s->length};
    const loxo_polygon_settings how = {.tolerance = s->settings->tolerance,
                                       .max_iterations = s->settings->max_iterations,
                                       .edges = s->settings->edges};
    loxo_polygon_info info;
    draw(s, begin, end);
    const loxo_status status =
        polygon_close_batch(s->ctx, &polygons, &how, s->out + begin * s->n_edges * s->d, s->report, s->w,
                            s->log_weight == NULL ? NULL : s->log_factor, &info);
    if (status < 0 || status == LOXO_STOPPED) return status;
    add_info(&s->info, &info, begin);
    if (s->log_weight != NULL) weigh_all(s, begin, end);
    return LOXO_OK;
}

static loxo_status run(sampling *s, int64_t slab)
{
    for (int64_t begin = 0; begin < s->n_polygons; begin += slab) {
        const int64_t end = begin + slab < s->n_polygons ? begin + slab : s->n_polygons;
        const loxo_status status = sample_slab(s, begin, end);
        if (status != LOXO_OK) return status;
        if (end < s->n_polygons && loxo_stop_wanted(s->ctx, "sample", (double)end / (double)s->n_polygons))
            return LOXO_STOPPED;
    }
    if (s->info.n_cannot + s->info.n_bad > 0) return LOXO_CHECK_FAILED;
    return s->info.n_loose > 0 ? LOXO_NOT_CONVERGED : LOXO_OK;
}

static loxo_status check(loxo_context *ctx, int64_t first, int64_t n_polygons, int64_t n_edges, int d,
                         const double *length, const double *out)
{
    double sum = 0.0, most = 0.0;
    if (first < 0 || n_polygons < 0 || n_edges < 3 || out == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "polygon: a polygon has three edges at least");
    if (d < 2 || d > MOST) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "polygon: %d dimensions, not 2 to %d", d, MOST);
    if (n_edges >= INT64_MAX / 8 / d || n_polygons > INT64_MAX / 8 / (n_edges * d))
        return loxo_fail(ctx, LOXO_ERR_LIMIT, "polygon: too many edges");
    for (int64_t i = 0; length != NULL && i < n_edges; ++i) {
        if (!(length[i] > 1e-100 && length[i] < 1e100))
            return loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, (loxo_place){.byte = -1, .element = i},
                                "polygon: length %lld is %g, not in 1e-100 to 1e100", (long long)i, length[i]);
        sum += length[i];
        most = fmax(most, length[i]);
    }
    if (length != NULL && !(most < 0.5 * sum * (1.0 - 1e-12)))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "polygon: an edge of %g among %g in all: no polygon closes", most,
                         sum);
    return LOXO_OK;
}

loxo_status loxo_polygon_sample(loxo_context *ctx, const loxo_polygon_sample_settings *settings, int64_t first,
                                int64_t n_polygons, int64_t n_edges, int d, const double *length, double *out,
                                double *log_weight, loxo_polygon_info *info)
{
    const loxo_polygon_sample_settings how = settings == NULL ? loxo_polygon_sample_settings_default() : *settings;
    const double start_s = loxo_os_clock_s();
    loxo_status status = loxo_options_check(ctx, "polygon", loxo_polygon_sample_options, &how);
    if (status >= 0) status = check(ctx, first, n_polygons, n_edges, d, length, out);
    if (status < 0) return status;
    loxo_progress_enter(ctx);
    int64_t slab = SLAB / (n_edges * d) / 64 * 64;
    slab = slab < 64 ? 8 : slab;
    slab = slab < n_polygons ? slab : n_polygons > 0 ? n_polygons : 1;
    sampling s = {.ctx = ctx,
                  .settings = &how,
                  .first = first,
                  .n_polygons = n_polygons,
                  .n_edges = n_edges,
                  .d = d,
                  .length = length,
                  .out = out,
                  .log_weight = log_weight,
                  .info = {.first_failed = -1}};
    s.x = loxo_allocate(ctx, slab * n_edges * d, sizeof *s.x);
    s.w = loxo_allocate(ctx, slab * d, sizeof *s.w);
    s.log_factor = loxo_allocate(ctx, slab, sizeof *s.log_factor);
    s.report = loxo_allocate(ctx, slab, sizeof *s.report);
    status = s.x == NULL || s.w == NULL || s.log_factor == NULL || s.report == NULL ? LOXO_ERR_MEMORY : run(&s, slab);
    loxo_release(ctx, s.x);
    loxo_release(ctx, s.w);
    loxo_release(ctx, s.log_factor);
    loxo_release(ctx, s.report);
    loxo_progress_leave(ctx);
    if (status < 0 || info == NULL) return status;
    s.info.n_left = n_polygons - s.info.n_closed - s.info.n_loose - s.info.n_flat - s.info.n_cannot - s.info.n_bad;
    s.info.total_s = loxo_os_clock_s() - start_s;
    s.info.peak_bytes = loxo_context_memory(ctx).peak_bytes;
    *info = s.info;
    return status;
}
