/* SPDX-License-Identifier: MIT
 * Closing a batch of polygons: those that are easy side by side in lanes, the others one by one. */
#include "base/allocate.h"
#include "base/context.h"
#include "base/options.h"
#include "base/os.h"
#include "kernel/variants.h"
#include "par/range.h"
#include "solver/barycenter/polygon_internal.h"

#include <math.h>
#include <string.h>

#define SLAB_NUMBERS    (1 << 21) /* of a batch that is worked on between two questions to the monitor */
#define MOST_LANE_STEPS 14        /* lanes take fewer, and do not count */
#define MOST_FETCHED    256       /* edges of a polygon: eight of them fit the first caches beside what is worked on */
#define ATOM_NS         3.0       /* an edge, in all */

typedef struct closing {
    loxo_context *ctx;
    const loxo_polygons *polygons;
    const loxo_polygon_settings *settings;
    double *out, *w, *log_factor;
    loxo_polygon_report *report;
    const k_variant *kernels;
    bool has_lanes, is_large;
    int n_threads;
    int64_t lane_size; /* numbers of one thread's buffer */
    double *lane_buffer;
    double *large_buffer; /* of one large polygon */
    struct polygon_chunk *chunk;
    loxo_polygon_report *slab_report; /* where the caller wants none */
    polygon_room room;
    loxo_polygon_info info;
} closing;

static loxo_status check(loxo_context *ctx, const loxo_polygons *p, bool has_output)
{
    if (p == NULL || p->n_polygons < 0 || p->n_edges < 1 || !has_output || p->x == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "polygon: no polygons");
    if (p->d < 2 || p->d > LOXO_MOEBIUS_MOST_DIMENSIONS)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "polygon: %d dimensions, not 2 to %d", p->d,
                         LOXO_MOEBIUS_MOST_DIMENSIONS);
    if ((unsigned)p->form > LOXO_POLYGON_DIRECTIONS)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "polygon: no such form of polygons");
    if (p->n_edges >= INT64_MAX / 8 / p->d ||
        (p->n_polygons > 0 && (p->n_edges + 1) * p->d > INT64_MAX / 8 / p->n_polygons))
        return loxo_fail(ctx, LOXO_ERR_LIMIT, "polygon: too many edges");
    if (p->form != LOXO_POLYGON_DIRECTIONS || p->length == NULL) return LOXO_OK;
    for (int64_t i = 0; i < p->n_edges; ++i)
        if (!(p->length[i] > 1e-100 && p->length[i] < 1e100))
            return loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, (loxo_place){.byte = -1, .element = i},
                                "polygon: length %lld is %g, not in 1e-100 to 1e100", (long long)i, p->length[i]);
    return LOXO_OK;
}

/* Eight polygons from first on, of which there are count. */
static void close_eight(const closing *c, int64_t first, int64_t count, double *buffer, loxo_polygon_report *report)
{
    const loxo_polygons *p = c->polygons;
    k_lanes job = {.form = (k_lane_form)p->form,
                   .d = p->d,
                   .n = p->n_edges,
                   .tolerance = c->settings->tolerance,
                   .buffer = buffer,
                   .as_edges = c->settings->edges,
                   .log_stretch = c->log_factor != NULL,
                   .is_far = polygon_is_far(p),
                   .streams = polygon_is_far(p)};
    for (int l = 0; l < K_LANES; ++l) {
        job.x[l] = polygon_at(p, l < count ? first + l : first);
        if (p->form == LOXO_POLYGON_VERTICES) memcpy(job.start[l], job.x[l], (size_t)p->d * sizeof(double));
        job.length[l] = p->form == LOXO_POLYGON_DIRECTIONS ? p->length : NULL;
        job.out[l] = l < count && c->out != NULL ? c->out + (first + l) * p->n_edges * p->d : NULL;
        job.streams = job.streams && polygon_is_aligned(job.out[l]);
    }
    c->kernels->lanes(&job);
    for (int l = 0; l < count; ++l) {
        const bool is_met = !(c->settings->tolerance > 0.0) || job.bound[l] <= c->settings->tolerance;
        report[l] = (loxo_polygon_report){.state = !job.is_done[l] ? LOXO_POLYGON_LEFT
                                                   : is_met        ? LOXO_POLYGON_CLOSED
                                                                   : LOXO_POLYGON_LOOSE,
                                          .length = job.total[l],
                                          .gap = job.gap[l],
                                          .bound = job.bound[l],
                                          .co = job.co[l]};
        if (c->log_factor != NULL) c->log_factor[first + l] = (double)p->n_edges * log(job.co[l]) - job.stretch[l];
        if (c->w != NULL) memcpy(c->w + (first + l) * p->d, job.w[l], (size_t)p->d * sizeof(double));
    }
}

/* Asks for polygons begin..end-1, to be closed next: eight short streams at a time are more than processors foresee. */
static void fetch(const closing *c, int64_t begin, int64_t end)
{
    if (begin >= end || c->polygons->n_edges > MOST_FETCHED) return;
    const char *x = (const char *)polygon_at(c->polygons, begin);
    const char *x_end = (const char *)polygon_at(c->polygons, end);
    for (; x < x_end; x += 64)
        __builtin_prefetch(x);
}

/* Polygons begin..end-1 side by side; those that are left over are marked so. */
static void close_in_lanes(const closing *c, int64_t begin, int64_t end, loxo_polygon_report *report)
{
    const int64_t n_eights = (end - begin + K_LANES - 1) / K_LANES;
#pragma omp parallel num_threads(c->n_threads)
    {
        const loxo_range r = loxo_thread_range(n_eights);
        double *buffer = c->lane_buffer + loxo_thread_id() * c->lane_size;
        for (int64_t e = r.begin; e < r.end; ++e) {
            const int64_t first = begin + e * K_LANES;
            fetch(c, first + K_LANES, first + (int64_t)2 * K_LANES < end ? first + (int64_t)2 * K_LANES : end);
            close_eight(c, first, end - first < K_LANES ? end - first : K_LANES, buffer, report + e * K_LANES);
        }
    }
}

static void count(closing *c, int64_t p, const loxo_polygon_report *r)
{
    loxo_polygon_info *info = &c->info;
    info->n_closed += r->state == LOXO_POLYGON_CLOSED;
    info->n_loose += r->state == LOXO_POLYGON_LOOSE;
    info->n_flat += r->state == LOXO_POLYGON_FLAT;
    info->n_cannot += r->state == LOXO_POLYGON_CANNOT;
    info->n_bad += r->state == LOXO_POLYGON_BAD;
    if ((r->state == LOXO_POLYGON_CANNOT || r->state == LOXO_POLYGON_BAD) && info->first_failed < 0)
        info->first_failed = p;
    if (r->state > LOXO_POLYGON_FLAT) return;
    if (r->gap > info->gap_max * r->length) info->gap_max = r->gap / r->length;
    if (r->state < LOXO_POLYGON_FLAT && r->bound > info->bound_max) info->bound_max = r->bound;
}

/* Polygons begin..end-1. */
static loxo_status close_slab(closing *c, int64_t begin, int64_t end)
{
    const int64_t n_numbers = c->polygons->n_edges * c->polygons->d;
    loxo_polygon_report *report = c->report == NULL ? c->slab_report : c->report + begin;
    if (c->has_lanes)
        close_in_lanes(c, begin, end, report);
    else
        for (int64_t i = 0; i < end - begin; ++i)
            report[i].state = LOXO_POLYGON_LEFT;
    for (int64_t i = 0; i < end - begin; ++i) {
        if (report[i].state == LOXO_POLYGON_LEFT) {
            const int64_t p = begin + i;
            double *out = c->out == NULL ? NULL : c->out + p * n_numbers,
                   *w = c->w == NULL ? NULL : c->w + p * c->polygons->d;
            double *log_factor = c->log_factor == NULL ? NULL : c->log_factor + p;
            ++c->info.n_alone;
            if (!c->is_large || !polygon_close_large(c->ctx, c->polygons, p, c->settings, c->kernels, c->large_buffer,
                                                     c->chunk, out, &report[i], w, log_factor)) {
                const loxo_status status =
                    polygon_close_alone(c->ctx, c->polygons, p, c->settings, &c->room, out, &report[i], w, log_factor);
                if (status != LOXO_OK) return status;
            }
        }
        count(c, begin + i, &report[i]);
    }
    return LOXO_OK;
}

static loxo_status reserve(closing *c, int64_t slab)
{
    const loxo_polygons *p = c->polygons;
    c->room.x = loxo_allocate(c->ctx, p->n_edges * p->d, sizeof(double));
    c->room.length = loxo_allocate(c->ctx, p->n_edges, sizeof(double));
    if (c->room.x == NULL || c->room.length == NULL) return LOXO_ERR_MEMORY;
    if (c->has_lanes) {
        c->lane_size = p->n_edges * (p->d + 1) * K_LANES;
        c->lane_buffer = loxo_allocate(c->ctx, c->n_threads * c->lane_size, sizeof(double));
        if (c->lane_buffer == NULL) return LOXO_ERR_MEMORY;
    }
    if (c->is_large) {
        c->large_buffer = loxo_allocate(c->ctx, p->n_edges * (p->d + 1), sizeof(double));
        c->chunk = loxo_allocate(c->ctx, polygon_n_chunks(p->n_edges), polygon_chunk_bytes());
        if (c->large_buffer == NULL || c->chunk == NULL) return LOXO_ERR_MEMORY;
    }
    if (c->report == NULL) {
        c->slab_report = loxo_allocate(c->ctx, slab, sizeof *c->slab_report);
        if (c->slab_report == NULL) return LOXO_ERR_MEMORY;
    }
    return LOXO_OK;
}

static loxo_status run(closing *c, int64_t slab)
{
    const int64_t n = c->polygons->n_polygons;
    for (int64_t i = 0; i < n && c->report != NULL; ++i)
        c->report[i] = (loxo_polygon_report){.state = LOXO_POLYGON_LEFT};
    for (int64_t begin = 0; begin < n; begin += slab) {
        const loxo_status status = close_slab(c, begin, begin + slab < n ? begin + slab : n);
        if (status != LOXO_OK) return status;
        if (begin + slab < n && loxo_stop_wanted(c->ctx, "close", (double)(begin + slab) / (double)n))
            return LOXO_STOPPED;
    }
    if (c->info.n_cannot + c->info.n_bad > 0) return LOXO_CHECK_FAILED;
    return c->info.n_loose > 0 ? LOXO_NOT_CONVERGED : LOXO_OK;
}

loxo_status polygon_close_batch(loxo_context *ctx, const loxo_polygons *polygons, const loxo_polygon_settings *settings,
                                double *out, loxo_polygon_report *report, double *w, double *log_factor,
                                loxo_polygon_info *info)
{
    const loxo_polygon_settings s = settings == NULL ? loxo_polygon_settings_default() : *settings;
    const double start_s = loxo_os_clock_s();
    loxo_status status = loxo_options_check(ctx, "polygon", loxo_polygon_options, &s);
    if (status >= 0) status = check(ctx, polygons, out != NULL || w != NULL || report != NULL);
    if (status < 0) return status;
    loxo_progress_enter(ctx);
    const int64_t numbers = polygons->n_edges * polygons->d, most = (SLAB_NUMBERS + numbers - 1) / numbers;
    const int64_t eights = (most < polygons->n_polygons ? most : polygons->n_polygons) / K_LANES + 1;
    const int64_t slab = eights * K_LANES;
    closing c = {.ctx = ctx,
                 .polygons = polygons,
                 .settings = &s,
                 .out = out,
                 .w = w,
                 .log_factor = log_factor,
                 .report = report,
                 .kernels = k_variant_get(loxo_context_isa(ctx)),
                 .has_lanes = polygon_fits_lanes(polygons) && s.max_iterations >= MOST_LANE_STEPS,
                 .is_large = polygon_is_large(polygons) && s.max_iterations >= MOST_LANE_STEPS,
                 .n_threads = loxo_threads_for(ctx, slab * polygons->n_edges, ATOM_NS),
                 .info = {.first_failed = -1}};
    if ((status = reserve(&c, slab)) >= 0) status = run(&c, slab);
    loxo_release(ctx, c.room.x);
    loxo_release(ctx, c.room.length);
    loxo_release(ctx, c.lane_buffer);
    loxo_release(ctx, c.large_buffer);
    loxo_release(ctx, c.chunk);
    loxo_release(ctx, c.slab_report);
    loxo_progress_leave(ctx);
    if (status < 0 || info == NULL) return status;
    c.info.n_left =
        polygons->n_polygons - c.info.n_closed - c.info.n_loose - c.info.n_flat - c.info.n_cannot - c.info.n_bad;
    c.info.total_s = loxo_os_clock_s() - start_s;
    c.info.peak_bytes = loxo_context_memory(ctx).peak_bytes;
    *info = c.info;
    return status;
}

loxo_status loxo_polygon_close(loxo_context *ctx, const loxo_polygons *polygons, const loxo_polygon_settings *settings,
                               double *out, loxo_polygon_report *report, double *w, loxo_polygon_info *info)
{
    return polygon_close_batch(ctx, polygons, settings, out, report, w, NULL, info);
}
