/* SPDX-License-Identifier: MIT
 * Closing one large polygon: pieces of it side by side in the lanes that hold polygons elsewhere, chunks of eight pieces on threads. Sums of
 * chunks are added in order, so threads change no bit. */
#include "base/context.h"
#include "kernel/variants.h"
#include "par/range.h"
#include "solver/barycenter/polygon_internal.h"

#include <math.h>
#include <string.h>

#define PIECE  ((int64_t)256) /* edges of a lane */
#define CHUNK  (PIECE * K_LANES)
#define PASSES 12
#define EPS    2.3e-16
#define AHEAD  8.0 /* as the lanes of polygons: a bound so many times the tolerance is tried */

/* What a chunk leaves: sums of its lanes, and where it begins. */
struct polygon_chunk {
    k_lane_table table;
    double sum[K_LANES][3];
    double start[K_LANES][3];
    double stretch;
    bool is_good;
};

typedef struct large {
    loxo_context *ctx;
    const loxo_polygons *polygons;
    const double *x;
    double *out, *buffer;
    struct polygon_chunk *chunk;
    int64_t n_chunks; /* the last one is shorter */
    const k_variant *kernels;
    bool as_edges, log_stretch, is_far, streams;
    k_lane_point point;
    double tolerance, weight, sum[3], fix[3];
    /* edges behind the last whole eight */
    int n_rest;
    double rest[K_LANES][3], rest_length[K_LANES];
} large;

int64_t polygon_n_chunks(int64_t n_edges) { return (n_edges + CHUNK - 1) / CHUNK; }

size_t polygon_chunk_bytes(void) { return sizeof(struct polygon_chunk); }

static int64_t n_in_lanes(const large *l) { return l->polygons->n_edges - l->n_rest; }

/* Edges of a lane in chunk c. */
static int64_t piece_of(const large *l, int64_t c)
{
    const int64_t left = n_in_lanes(l) - c * CHUNK;
    return left < CHUNK ? left / K_LANES : PIECE;
}

static void set_job(const large *l, int64_t c, k_lanes *job)
{
    const loxo_polygons *p = l->polygons;
    const int64_t piece = piece_of(l, c);
    *job = (k_lanes){.form = (k_lane_form)p->form,
                     .d = p->d,
                     .n = piece,
                     .tolerance = l->tolerance,
                     .buffer = l->buffer + c * CHUNK * (p->d + 1),
                     .as_edges = l->as_edges,
                     .log_stretch = l->log_stretch,
                     .is_far = l->is_far,
                     .streams = l->streams};
    memcpy(job->fix, l->fix, sizeof job->fix);
    for (int k = 0; k < K_LANES; ++k) {
        const int64_t first = c * CHUNK + k * piece;
        job->x[k] = l->x + first * p->d;
        if (l->out == NULL) continue;
        job->out[k] = l->out + first * p->d;
        job->streams = job->streams && polygon_is_aligned(job->out[k]);
    }
    for (int k = 0; k < K_LANES && p->form == LOXO_POLYGON_DIRECTIONS && p->length != NULL; ++k)
        job->length[k] = p->length + c * CHUNK + k * piece;
}

typedef void (*chunk_fn)(large *l, int64_t c);

static void for_chunks(large *l, double ns_each, chunk_fn work)
{
#pragma omp parallel num_threads(loxo_threads_for(l->ctx, l->polygons->n_edges, ns_each))
    {
        const loxo_range r = loxo_thread_range(l->n_chunks);
        for (int64_t c = r.begin; c < r.end; ++c)
            work(l, c);
    }
}

static void read_chunk(large *l, int64_t c)
{
    k_lanes job;
    set_job(l, c, &job);
    l->chunk[c].is_good = l->kernels->lanes_first(&job, l->chunk[c].table);
}

static void look_at_chunk(large *l, int64_t c)
{
    k_lanes job;
    set_job(l, c, &job);
    l->kernels->lanes_again(&job, l->point.w, l->point.co, l->chunk[c].table);
}

/* Without writing, or of edges with it. */
static void finish_chunk(large *l, int64_t c, bool writes)
{
    k_lanes job;
    double stretch = 0.0;
    set_job(l, c, &job);
    l->kernels->lanes_last(&job, l->point.w, l->point.co, false, writes);
    memcpy(l->chunk[c].sum, job.sum, sizeof job.sum);
    for (int k = 0; k < K_LANES && l->log_stretch; ++k)
        stretch += job.stretch[k];
    l->chunk[c].stretch = stretch;
}

static void add_up_chunk(large *l, int64_t c) { finish_chunk(l, c, false); }

static void write_edges(large *l, int64_t c) { finish_chunk(l, c, true); }

static void write_vertices(large *l, int64_t c)
{
    k_lanes job;
    set_job(l, c, &job);
    memcpy(job.start, l->chunk[c].start, sizeof job.start);
    l->kernels->lanes_last(&job, l->point.w, l->point.co, !(l->tolerance > 0.0), true);
}

/* The rest as unit vectors and lengths; false: directions that are none. */
static bool read_rest(large *l)
{
    const loxo_polygons *p = l->polygons;
    const int d = p->d;
    for (int i = 0; i < l->n_rest; ++i) {
        const double *x = l->x + (n_in_lanes(l) + i) * d;
        double *e = l->rest[i], square = 0.0;
        for (int k = 0; k < d; ++k) {
            e[k] = p->form == LOXO_POLYGON_VERTICES ? x[d + k] - x[k] : x[k];
            square += e[k] * e[k];
        }
        const double length = sqrt(square);
        if (p->form == LOXO_POLYGON_DIRECTIONS && !(fabs(square - 1.0) <= 2e-6)) return false;
        for (int k = 0; k < d; ++k)
            e[k] = length > 0.0 ? e[k] / length : k == 0 ? 1.0 : 0.0;
        l->rest_length[i] = p->form != LOXO_POLYGON_DIRECTIONS ? length
                            : p->length != NULL                ? p->length[n_in_lanes(l) + i]
                                                               : 1.0;
    }
    return true;
}

/* Adds the rest to sums, in the order of k_lane_table. */
static void add_rest(const large *l, double sums[9])
{
    const int d = l->polygons->d;
    for (int i = 0; i < l->n_rest; ++i) {
        const double p = l->rest_length[i];
        double v[3] = {0}, square = 0.0;
        for (int k = 0; k < d; ++k) {
            v[k] = l->rest[i][k] - l->point.w[k];
            square += v[k] * v[k];
        }
        for (int k = 0; k < d; ++k) {
            v[k] *= l->point.co / square;
            sums[1 + k] += p * v[k];
        }
        sums[0] += p;
        sums[4] += p * v[0] * v[0];
        sums[5] += p * v[0] * v[1];
        sums[6] += p * v[0] * v[2];
        sums[7] += p * v[1] * v[1];
        sums[8] += p * v[1] * v[2];
    }
}

/* Edge i of the rest, closed; |x - w|^2. */
static double shift_rest(const large *l, int i, double e[3])
{
    const int d = l->polygons->d;
    double square = 0.0, norm = 0.0;
    for (int k = 0; k < d; ++k) {
        e[k] = l->rest[i][k] - l->point.w[k];
        square += e[k] * e[k];
    }
    for (int k = 0; k < d; ++k) {
        e[k] = l->point.co / square * e[k] - l->point.w[k];
        norm += e[k] * e[k];
    }
    for (int k = 0; k < d; ++k) {
        const double whole = l->rest_length[i] * e[k];
        e[k] = whole + whole * (0.5 - 0.5 * norm);
    }
    return square;
}

/* Sums of all chunks: pairwise over lanes, and over chunks with what is lost. */
static void add_tables(const large *l, double sums[9])
{
    for (int k = 0; k < 9; ++k) {
        double sum = 0.0, lost = 0.0;
        for (int64_t c = 0; c < l->n_chunks; ++c) {
            const double *t = l->chunk[c].table[k];
            const double part = ((t[0] + t[4]) + (t[2] + t[6])) + ((t[1] + t[5]) + (t[3] + t[7])) + lost,
                         next = sum + part;
            lost = part - (next - sum);
            sum = next;
        }
        sums[k] = sum;
    }
    add_rest(l, sums);
}

/* Adds e to a sum, with what is lost; fix is taken off. */
static void add_exactly(double *sum, double *lost, double e, double fix)
{
    const double next = *sum + e, gained = next - *sum;
    *lost += (*sum - (next - gained)) + (e - gained) - fix;
    *sum = next;
}

/* Where pieces begin, from their sums, and the sum of all. fix is taken off with each unit of length. The rest is written if writes. */
static void find_starts(large *l, const double *start, bool writes)
{
    const int d = l->polygons->d;
    double sum[3] = {0}, lost[3] = {0}, e[3];
    for (int64_t c = 0; c < l->n_chunks; ++c)
        for (int lane = 0; lane < K_LANES; ++lane)
            for (int k = 0; k < d; ++k) {
                l->chunk[c].start[lane][k] = (start == NULL ? 0.0 : start[k]) + (sum[k] + lost[k]);
                add_exactly(&sum[k], &lost[k], l->chunk[c].sum[lane][k], l->fix[k] * l->chunk[c].table[0][lane]);
            }
    for (int i = 0; i < l->n_rest; ++i) {
        double *out = writes ? l->out + (n_in_lanes(l) + i) * d : NULL;
        (void)shift_rest(l, i, e);
        for (int k = 0; k < d; ++k) {
            if (writes) out[k] = l->as_edges ? e[k] : (start == NULL ? 0.0 : start[k]) + (sum[k] + lost[k]);
            add_exactly(&sum[k], &lost[k], e[k], l->fix[k] * l->rest_length[i]);
        }
    }
    for (int k = 0; k < d; ++k)
        l->sum[k] = sum[k] + lost[k];
}

static double length_of(const large *l)
{
    double square = 0.0;
    for (int k = 0; k < l->polygons->d; ++k)
        square += l->sum[k] * l->sum[k];
    return sqrt(square);
}

/* Adds the edges up as they are at the point; their sum is the residual, and certifies the point where the step before did not. Edges are
 * written on the way; vertices when it is known where pieces begin. False: the search goes on. */
static bool finish(large *l, const double *start)
{
    k_lane_point *p = &l->point;
    memset(l->fix, 0, sizeof l->fix);
    for_chunks(l, l->as_edges ? 0.9 : 0.5, l->as_edges ? write_edges : add_up_chunk);
    find_starts(l, NULL, l->as_edges);
    const double share = 2.0 * (length_of(l) / l->weight + 8.0 * EPS / p->co) / p->left;
    const double bound = 0.5 * share / (1.0 - share) + 16.0 * EPS / p->co;
    if (share < 0.5 && bound < p->bound) p->bound = bound;
    if (p->is_tried && p->bound > l->tolerance) return false;
    if (l->as_edges) return true;
    for (int k = 0; k < l->polygons->d && !(l->tolerance > 0.0); ++k)
        l->fix[k] = l->sum[k] / l->weight;
    find_starts(l, start, true);
    for_chunks(l, 0.9, write_vertices);
    return true;
}

/* The search, and what is written; false: leave the polygon to the way that does not mind where the barycenter lies. */
static bool search(large *l)
{
    double sums[9], ahead = l->out == NULL ? 1.0 : AHEAD;
    bool good = read_rest(l);
    for_chunks(l, 0.8, read_chunk);
    for (int64_t c = 0; c < l->n_chunks; ++c)
        good = good && l->chunk[c].is_good;
    if (!good) return false;
    l->point = (k_lane_point){.co = 1.0};
    add_tables(l, sums);
    l->weight = sums[0];
    for (int pass = 0;; ++pass) {
        l->kernels->lanes_one_step(l->polygons->d, l->tolerance, ahead, sums, &l->point);
        if (l->point.is_done) {
            if (l->out == NULL || finish(l, l->polygons->form == LOXO_POLYGON_VERTICES ? l->x : NULL)) return true;
            ahead = 1.0;
        } else if (l->point.is_over) {
            return false;
        }
        if (pass == PASSES) return false;
        for_chunks(l, 0.5, look_at_chunk);
        add_tables(l, sums);
    }
}

bool polygon_close_large(loxo_context *ctx, const loxo_polygons *polygons, int64_t p,
                         const loxo_polygon_settings *settings, const k_variant *kernels, double *buffer,
                         struct polygon_chunk *chunk, double *out, loxo_polygon_report *report, double *w,
                         double *log_factor)
{
    large l = {.ctx = ctx,
               .polygons = polygons,
               .x = polygon_at(polygons, p),
               .out = out,
               .buffer = buffer,
               .chunk = chunk,
               .n_chunks = polygon_n_chunks(polygons->n_edges),
               .n_rest = (int)(polygons->n_edges % K_LANES),
               .kernels = kernels,
               .tolerance = settings->tolerance,
               .as_edges = settings->edges,
               .log_stretch = log_factor != NULL,
               .is_far = polygon_is_far(polygons),
               .streams = polygon_is_far(polygons)};
    const bool is_exact = !(settings->tolerance > 0.0);
    if (!search(&l)) return false;
    *report = (loxo_polygon_report){.state = is_exact || l.point.bound <= settings->tolerance ? LOXO_POLYGON_CLOSED
                                                                                              : LOXO_POLYGON_LOOSE,
                                    .length = l.weight,
                                    .gap = length_of(&l),
                                    .bound = l.point.bound,
                                    .co = l.point.co};
    if (w != NULL) memcpy(w, l.point.w, (size_t)polygons->d * sizeof *w);
    if (log_factor == NULL || out == NULL) return true;
    *log_factor = (double)polygons->n_edges * log(l.point.co);
    for (int64_t c = 0; c < l.n_chunks; ++c)
        *log_factor -= chunk[c].stretch;
    for (int i = 0; i < l.n_rest; ++i) {
        double e[3];
        *log_factor -= log(shift_rest(&l, i, e));
    }
    return true;
}
