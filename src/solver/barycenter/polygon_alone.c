/* SPDX-License-Identifier: MIT
 * Closing one polygon by itself: any number of edges, any dimension, any scale, however near the sphere its barycenter is. */
#include "base/context.h"
#include "hyperbolic/hyperbolic.h"
#include "par/range.h"
#include "solver/barycenter/polygon_internal.h"

#include <math.h>
#include <string.h>

#define OFF_SPHERE 1e-6
#define MOST_FIXED 1e-13 /* of the length: a gap of rounding */

/* Edge i as given. */
static inline void load_edge(const double *x, int d, loxo_polygon_form form, int64_t i, double scale, double *e)
{
    for (int k = 0; k < d; ++k)
        e[k] = form == LOXO_POLYGON_VERTICES ? scale * x[(i + 1) * d + k] - scale * x[i * d + k] : scale * x[i * d + k];
}

/* Largest coordinate of a polygon from its first vertex on; infinite where one is not finite. */
static double find_size(const double *x, int d, loxo_polygon_form form, int64_t n)
{
    const int64_t count = (n + (form == LOXO_POLYGON_VERTICES ? 1 : 0)) * d;
    double size = 0.0;
    bool good = true;
    for (int64_t i = 0; i < count; ++i) {
        const double a = fabs(x[i]);
        good = good && a < HUGE_VAL;
        size = a > size ? a : size;
    }
    return good ? size : HUGE_VAL;
}

typedef struct reading {
    double length; /* of all edges */
    bool good;
} reading;

/* Unit vectors and lengths of edges begin..end-1. */
static reading read_edges(const loxo_polygons *p, const double *x, double scale, int64_t begin, int64_t end,
                          const polygon_room *room)
{
    const int d = p->d;
    reading r = {0.0, true};
    for (int64_t i = begin; i < end; ++i) {
        double *e = room->x + i * d, square = 0.0;
        load_edge(x, d, p->form, i, scale, e);
        for (int k = 0; k < d; ++k)
            square += e[k] * e[k];
        double length = sqrt(square);
        const double inverse = length > 0.0 ? 1.0 / length : 0.0;
        for (int k = 0; k < d; ++k)
            e[k] *= inverse;
        if (!(length > 0.0)) e[0] = 1.0; /* no length: any direction */
        if (p->form == LOXO_POLYGON_DIRECTIONS) {
            r.good = r.good && fabs(square - 1.0) <= 2.0 * OFF_SPHERE;
            length = p->length == NULL ? 1.0 : p->length[i];
        }
        room->length[i] = length;
        r.length += length;
    }
    return r;
}

/* Adds up the polygon with the directions of the room, compensated, and writes it if out is not NULL. fix is taken off the sums with
 * each unit of length. sum: of all edges. */
static void write_polygon(const loxo_polygons *p, const polygon_room *room, const double *start, double scale,
                          const double *fix, bool as_edges, double *out, double *sum)
{
    const int d = p->d;
    double lost[HYPER_MOST_DIMENSIONS] = {0};
    memset(sum, 0, (size_t)d * sizeof *sum);
    for (int64_t i = 0; i < p->n_edges; ++i) {
        const double length = room->length[i] * scale, *y = room->x + i * d;
        double norm = 0.0;
        for (int k = 0; k < d; ++k)
            norm += y[k] * y[k];
        const double off = 0.5 - 0.5 * norm; /* what is left to the sphere; small, and so added apart */
        for (int k = 0; k < d; ++k) {
            const double whole = length * y[k], e = whole + whole * off;
            /* the sum and what it lost (Knuth's exact addition) */
            const double next = sum[k] + e, gained = next - sum[k];
            const double at = sum[k] + lost[k];
            if (out != NULL) out[i * d + k] = as_edges ? e : start == NULL ? at : start[k] + at;
            lost[k] += (sum[k] - (next - gained)) + (e - gained) - (fix == NULL ? 0.0 : length * fix[k]);
            sum[k] = next;
        }
    }
    for (int k = 0; k < d; ++k)
        sum[k] += lost[k];
}

static double length_of(int d, const double *a)
{
    double size = 0.0, square = 0.0;
    for (int k = 0; k < d; ++k)
        size = fmax(size, fabs(a[k]));
    for (int k = 0; k < d && size > 0.0; ++k)
        square += (a[k] / size) * (a[k] / size);
    return size * sqrt(square);
}

static void write_zeros(const loxo_polygons *p, double *out, loxo_polygon_report *report, double *w)
{
    *report = (loxo_polygon_report){.state = LOXO_POLYGON_BAD, .bound = HUGE_VAL};
    if (out != NULL) memset(out, 0, (size_t)(p->n_edges * p->d) * sizeof *out);
    if (w != NULL) memset(w, 0, (size_t)p->d * sizeof *w);
}

/* Sum of log(co / |x - w|^2): the shift's factors of length. */
static double add_log_factors(const hyper_atoms *atoms, const double *w, double co)
{
    double sum = 0.0;
    for (int64_t i = 0; i < atoms->n; ++i) {
        double square = 0.0;
        for (int k = 0; k < atoms->d; ++k) {
            const double e = atoms->x[i * atoms->d + k] - w[k];
            square += e * e;
        }
        sum += log(co / square);
    }
    return sum;
}

static void shift_directions(loxo_context *ctx, const loxo_polygons *p, const polygon_room *room, const hyper_result *r,
                             double *log_factor)
{
    const hyper_atoms atoms = {.n = p->n_edges, .d = p->d, .x = room->x, .is_unit = true};
    const bool is_one = r->kind == HYPER_NOT_UNIQUE;
    for (int i = 0; i < (is_one ? 1 : r->n_shifts); ++i) {
        const double *w = is_one ? r->w : r->shift[i], co = is_one ? r->co : r->shift_co[i];
        if (log_factor != NULL) *log_factor += add_log_factors(&atoms, w, co);
        hyper_shift_atoms(ctx, &atoms, w, co, room->x);
    }
}

loxo_status polygon_close_alone(loxo_context *ctx, const loxo_polygons *polygons, int64_t p,
                                const loxo_polygon_settings *settings, polygon_room *room, double *out,
                                loxo_polygon_report *report, double *w, double *log_factor)
{
    const int d = polygons->d;
    const int64_t n = polygons->n_edges;
    const double *x = polygon_at(polygons, p), *start = polygons->form == LOXO_POLYGON_VERTICES ? x : NULL;
    const double size = find_size(x, d, polygons->form, n);
    int exponent = 0;
    if (log_factor != NULL) *log_factor = 0.0;
    if (!(size < HUGE_VAL) || !(size > 0.0)) {
        write_zeros(polygons, out, report, w);
        return LOXO_OK;
    }
    /* coordinates to at most 1, so that no square leaves the range of doubles; a power of two, so that nothing is rounded */
    (void)frexp(size, &exponent);
    if (exponent < -1000) exponent = -1000;
    const double scale = polygons->form == LOXO_POLYGON_DIRECTIONS ? 1.0 : ldexp(1.0, -exponent), back = 1.0 / scale;
    const reading r = read_edges(polygons, x, scale, 0, n, room);
    if (!r.good || !(r.length > 1e-290) || !(r.length < 1e290)) {
        write_zeros(polygons, out, report, w);
        return LOXO_OK;
    }
    const hyper_atoms atoms = {.n = n, .d = d, .x = room->x, .weight = room->length, .is_unit = true};
    hyper_settings how = hyper_settings_default();
    hyper_result result;
    how.tolerance = settings->tolerance;
    how.max_iterations = settings->max_iterations;
    const loxo_status status = hyper_barycenter(ctx, &atoms, NULL, &how, &result);
    if (status < 0 || status == LOXO_STOPPED) return status;
    *report = (loxo_polygon_report){.length = r.length * back, .bound = result.frame_bound, .co = result.co};
    report->state = result.kind == HYPER_NONE         ? LOXO_POLYGON_CANNOT
                    : result.kind == HYPER_NOT_UNIQUE ? LOXO_POLYGON_FLAT
                    : status == LOXO_OK               ? LOXO_POLYGON_CLOSED
                                                      : LOXO_POLYGON_LOOSE;
    if (result.kind != HYPER_NONE) shift_directions(ctx, polygons, room, &result, log_factor);
    double sum[HYPER_MOST_DIMENSIONS], fix[HYPER_MOST_DIMENSIONS] = {0};
    const bool fixes = result.kind != HYPER_NONE && !(settings->tolerance > 0.0) && !settings->edges;
    if (fixes) { /* what rounding that all edges share has left of the gap is spread over the vertices */
        write_polygon(polygons, room, start, 1.0, NULL, false, NULL, sum);
        const bool is_rounding = length_of(d, sum) <= MOST_FIXED * r.length; /* else iterations ended before */
        for (int k = 0; k < d; ++k)
            fix[k] = is_rounding ? sum[k] / r.length : 0.0;
    }
    write_polygon(polygons, room, start, back, fixes ? fix : NULL, settings->edges, out, sum);
    report->gap = length_of(d, sum);
    for (int k = 0; k < d && w != NULL; ++k)
        w[k] = result.kind == HYPER_NONE ? 0.0 : result.w[k];
    return LOXO_OK;
}
