/* SPDX-License-Identifier: MIT
 * Douady and Earle's extension: settings, create, evaluate, destroy. */
#include "base/allocate.h"
#include "base/context.h"
#include "base/options.h"
#include "base/os.h"
#include "kernel/ball_kernel.h"
#include "par/range.h"
#include "solver/barycenter/extension_internal.h"
#include "solver/barycenter/search_options.h"

#include <inttypes.h>
#include <string.h>

#define NEAR_BETA   1e-4  /* of (1 - |z|) / (1 + |z|), below which nodes are kept as differences */
#define LEAST_SCALE 1e-9  /* of the measure: what is farther is one node */
#define POINTS      16    /* of a piece of work */
#define LOOK        32768 /* points between two looks at the monitor, a thread */
#define OUTSIDE     1e-12 /* |z| - 1 that is rounding */
#define ON_CIRCLE   4e-16 /* 1 - |z| of coordinates that are rounded points of the circle */

struct loxo_extension {
    loxo_context *ctx;
    loxo_extension_settings settings;
    extension_curve curve;
    extension_nodes nodes;
    double most_fixed; /* |z| up to which fixed nodes are taken */
};

loxo_extension_settings loxo_extension_settings_default(void)
{
    return (loxo_extension_settings){
        .rule = LOXO_EXTENSION_AUTO, .n_nodes = 720 /* the paper's */, .tolerance = 1e-8, .max_iterations = 50};
}

#define FIELD(name)              offsetof(loxo_extension_settings, name)
#define CHOICE(NAME, name, help) #name,

static const char *const rules[] = {LOXO_EXTENSION_RULE_LIST(CHOICE) NULL};

const loxo_option loxo_extension_options[] = {
    {.name = "rule",
     .type = LOXO_OPTION_CHOICE,
     .offset = FIELD(rule),
     .choices = rules,
     .help = "nodes that stay or move with the point"},
    {.name = "nodes",
     .type = LOXO_OPTION_INT64,
     .offset = FIELD(n_nodes),
     .min = 16.0,
     .max = 0x1p20,
     .help = "of the quadrature"},
    SEARCH_TOLERANCE(loxo_extension_settings, "hyperbolic distance from the nodes' barycenter"),
    {.name = "max-iterations",
     .type = LOXO_OPTION_INT64,
     .offset = FIELD(max_iterations),
     .min = 1.0,
     .max = 1e6,
     .help = "most passes over all nodes for a point"},
    {.name = NULL}};

/* EXTENSION.md, «Where fixed nodes are safe»: |z|^(n/2) <= tolerance. */
static double find_most_fixed(const loxo_extension_settings *s)
{
    const double tolerance = s->tolerance > 1e-15 ? fmin(s->tolerance, 1e-8) : 1e-15;
    if (s->rule == LOXO_EXTENSION_MOVING || s->rule == LOXO_EXTENSION_GRADED) return -1.0;
    return s->rule == LOXO_EXTENSION_FIXED ? 1.0 : exp(2.0 * log(tolerance) / (double)s->n_nodes);
}

loxo_status loxo_extension_create(loxo_context *ctx, const loxo_curve *curve, const loxo_extension_settings *settings,
                                  loxo_extension **out)
{
    loxo_extension_settings s = settings == NULL ? loxo_extension_settings_default() : *settings;
    loxo_extension *extension = NULL;
    if (out == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "extension: nowhere to put it");
    *out = NULL;
    loxo_status status = loxo_options_check(ctx, "extension", loxo_extension_options, &s);
    if (status < 0) return status;
    if (curve == NULL || curve->x == NULL || curve->n < 3 || curve->n > INT64_MAX / 1024 / EXTENSION_MOST_D)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "extension: a closed curve of at least 3 samples is needed");
    if (curve->d < 2 || curve->d > EXTENSION_MOST_D)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "extension: %d dimensions, not 2 to %d", curve->d, EXTENSION_MOST_D);
    s.n_nodes = (s.n_nodes + K_NODES - 1) / K_NODES * K_NODES;
    if ((extension = loxo_allocate_zero(ctx, 1, sizeof *extension)) == NULL) return LOXO_ERR_MEMORY;
    extension->ctx = ctx;
    extension->settings = s;
    extension->most_fixed = find_most_fixed(&s);
    if ((status = extension_curve_create(ctx, curve, &extension->curve)) < 0) goto fail;
    if ((status = extension_nodes_create(ctx, &extension->curve, s.n_nodes, &extension->nodes)) < 0) goto fail;
    *out = extension;
    return LOXO_OK;
fail:
    loxo_extension_destroy(extension);
    return status;
}

void loxo_extension_destroy(loxo_extension *extension)
{
    if (extension == NULL) return;
    extension_curve_destroy(extension->ctx, &extension->curve);
    extension_nodes_destroy(extension->ctx, &extension->nodes);
    loxo_release(extension->ctx, extension);
}

/* ---- one point ------------------------------------------------------------------------------------------------- */

/* What a thread works with; sums are of integers and maxima, so that they do not depend on who counts what. */
typedef struct worker {
    extension_search search;
    double *atom, *weight, *mass, *cosine, *sine;
    loxo_extension_info info;
} worker;

typedef enum rule { RULE_NONE, RULE_FIXED, RULE_MOVING, RULE_NEAR } rule;

typedef struct answer {
    double w[EXTENSION_MOST_D], co, bound, error;
    loxo_extension_kind kind;
    rule rule;
    int64_t n_passes, n_coarse_passes;
} answer;

/* A point of the disk: direction, |z|, co and beta = (1 - |z|) / (1 + |z|). */
typedef struct place {
    double z[2], direction[2], radius, co, beta;
} place;

static place place_of(const double z[2], const double *co)
{
    place p = {.z = {z[0], z[1]}, .direction = {1.0, 0.0}, .radius = hypot(z[0], z[1])};
    if (p.radius > 0.0) {
        p.direction[0] = z[0] / p.radius;
        p.direction[1] = z[1] / p.radius;
    }
    p.co = co != NULL ? *co : fabs(1.0 - p.radius) <= ON_CIRCLE ? 0.0 : (1.0 - p.radius) * (1.0 + p.radius);
    const double gap = p.co / (1.0 + sqrt(p.co < 1.0 ? 1.0 - p.co : 0.0));
    p.beta = gap / (2.0 - gap);
    return p;
}

static void rest_at(const double *x, int d, loxo_extension_kind kind, answer *out)
{
    memcpy(out->w, x, (size_t)d * sizeof *x);
    out->kind = kind;
}

/* The nodes as atoms of the search. */
static rule set_atoms(const loxo_extension *e, const place *p, worker *k)
{
    extension_search *s = &k->search;
    s->own = k->atom;
    s->atom = k->atom;
    s->weight = NULL;
    s->n_turns = 0;
    if (p->radius <= e->most_fixed) {
        s->kernels->poisson_weights(e->nodes.n, e->nodes.x, e->nodes.y, p->z, p->co, k->weight);
        s->atom = e->nodes.atom;
        s->weight = k->weight;
        return RULE_FIXED;
    }
    extension_seen seen = {.n = e->nodes.n, .cosine = e->nodes.cosine, .sine = e->nodes.sine};
    if (e->settings.rule != LOXO_EXTENSION_MOVING) {
        const extension_graded graded = {.cosine = k->cosine, .sine = k->sine, .weight = k->weight};
        extension_grade_nodes(e->nodes.n, fmax(p->beta, LEAST_SCALE), &graded);
        seen = (extension_seen){.n = e->nodes.n, .cosine = k->cosine, .sine = k->sine};
        s->weight = k->weight;
    }
    if (p->beta >= NEAR_BETA) {
        extension_move_nodes(s->kernels, &e->curve, &seen, p->direction, p->beta, k->atom);
        return RULE_MOVING;
    }
    s->turn_co[0] = extension_move_nodes_near(&e->curve, &seen, p->direction, p->beta, k->atom, s->turn[0]);
    s->n_turns = 1;
    return RULE_NEAR;
}

static void find_value(const loxo_extension *e, const place *p, worker *k, answer *out)
{
    extension_search *s = &k->search;
    const int d = e->curve.d;
    *out = (answer){.rule = RULE_NONE};
    if (!(p->co > 0.0)) {
        extension_curve_at(&e->curve, p->direction, out->w);
        out->kind = LOXO_EXTENSION_CURVE;
        return;
    }
    const int64_t rest = e->curve.n_runs == 0 ? -1 : extension_find_resting(&e->curve, p->direction, p->beta, k->mass);
    if (rest >= 0) {
        rest_at(e->curve.sample + rest * d, d, LOXO_EXTENSION_RESTING, out);
        return;
    }
    out->rule = set_atoms(e, p, k);
    if (out->rule == RULE_NEAR &&
        !(s->turn_co[0] > 0.0)) { /* all nodes rest, though not quite half of the measure does */
        rest_at(s->turn[0], d, LOXO_EXTENSION_OPEN, out);
        out->bound = out->error = HUGE_VAL;
        return;
    }
    extension_search_run(s);
    memcpy(out->w, s->w, (size_t)d * sizeof *out->w);
    out->co = s->co;
    out->bound = s->bound;
    out->error = s->error;
    out->kind = s->is_done ? LOXO_EXTENSION_INSIDE : LOXO_EXTENSION_OPEN;
    out->n_passes = s->n_passes;
    out->n_coarse_passes = s->n_coarse_passes;
}

/* ---- many points ----------------------------------------------------------------------------------------------- */

/* The first point that is none of the disk, or -1. */
static int64_t find_outside(int64_t begin, int64_t end, const double *z, const double *co)
{
    for (int64_t i = begin; i < end; ++i) {
        const double radius = hypot(z[2 * i], z[2 * i + 1]), own = fmax((1.0 - radius) * (1.0 + radius), 0.0);
        if (!(radius <= 1.0 + OUTSIDE)) return i;
        if (co != NULL && !k_ball_is_co(own, co[i])) return i;
    }
    return -1;
}

static loxo_status check_points(loxo_context *ctx, int64_t n, const double *z, const double *co)
{
    int64_t outside = INT64_MAX;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 4.0)) reduction(min : outside)
    {
        const loxo_range r = loxo_thread_range(n);
        const int64_t found = find_outside(r.begin, r.end, z, co);
        if (found >= 0) outside = found;
    }
    if (outside == INT64_MAX) return LOXO_OK;
    return loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, (loxo_place){.byte = -1, .element = outside},
                        "extension: point %" PRId64 " is not in the unit disk", outside);
}

static void keep(const answer *a, int d, int64_t i, const loxo_extension_values *v)
{
    memcpy(v->w + i * d, a->w, (size_t)d * sizeof *a->w);
    if (v->co != NULL) v->co[i] = a->co;
    if (v->bound != NULL) v->bound[i] = a->bound;
    if (v->error != NULL) v->error[i] = a->error;
    if (v->kind != NULL) v->kind[i] = (unsigned char)a->kind;
}

static void count(const answer *a, loxo_extension_info *info)
{
    info->n_points += 1;
    info->n_fixed += a->rule == RULE_FIXED;
    info->n_moving += a->rule == RULE_MOVING;
    info->n_near += a->rule == RULE_NEAR;
    info->n_curve += a->kind == LOXO_EXTENSION_CURVE;
    info->n_resting += a->kind == LOXO_EXTENSION_RESTING;
    info->n_open += a->kind == LOXO_EXTENSION_OPEN;
    info->n_passes += a->n_passes;
    info->n_coarse_passes += a->n_coarse_passes;
    if (a->kind != LOXO_EXTENSION_INSIDE) return;
    info->bound_max = fmax(info->bound_max, a->bound);
    info->error_max = fmax(info->error_max, a->error);
}

static void join(const loxo_extension_info *a, loxo_extension_info *info)
{
    info->n_points += a->n_points;
    info->n_fixed += a->n_fixed;
    info->n_moving += a->n_moving;
    info->n_near += a->n_near;
    info->n_curve += a->n_curve;
    info->n_resting += a->n_resting;
    info->n_open += a->n_open;
    info->n_passes += a->n_passes;
    info->n_coarse_passes += a->n_coarse_passes;
    info->bound_max = fmax(info->bound_max, a->bound_max);
    info->error_max = fmax(info->error_max, a->error_max);
}

/* The points begin..end-1, a piece of work for whoever is free. */
static void evaluate_some(const loxo_extension *e, int64_t begin, int64_t end, const double *z, const double *co,
                          const loxo_extension_values *values, worker *workers, int n_threads)
{
    const int64_t n_pieces = (end - begin + POINTS - 1) / POINTS;
#pragma omp parallel num_threads(n_threads)
    {
        worker *k = &workers[loxo_thread_id()];
        answer a;
#pragma omp for schedule(dynamic, 4)
        for (int64_t piece = 0; piece < n_pieces; ++piece) {
            const int64_t first = begin + piece * POINTS, last = first + POINTS < end ? first + POINTS : end;
            for (int64_t i = first; i < last; ++i) {
                const place p = place_of(z + 2 * i, co == NULL ? NULL : co + i);
                find_value(e, &p, k, &a);
                keep(&a, e->curve.d, i, values);
                count(&a, &k->info);
            }
        }
    }
}

/* One block for all threads: atoms, weights, what rests. */
static loxo_status make_workers(const loxo_extension *e, int n_threads, worker **workers, double **block)
{
    const int64_t n = e->nodes.n, each = n * (e->curve.d + 3) + e->curve.n_groups;
    *workers = loxo_allocate_zero(e->ctx, n_threads, sizeof **workers);
    *block = loxo_allocate(e->ctx, each * n_threads, sizeof **block);
    if (*workers == NULL || *block == NULL) return LOXO_ERR_MEMORY;
    for (int t = 0; t < n_threads; ++t) {
        worker *k = &(*workers)[t];
        k->atom = *block + each * t;
        k->weight = k->atom + n * e->curve.d;
        k->cosine = k->weight + n;
        k->sine = k->cosine + n;
        k->mass = k->sine + n;
        k->search = (extension_search){.kernels = k_variant_get(loxo_context_isa(e->ctx)),
                                       .d = e->curve.d,
                                       .n = n,
                                       .tolerance = e->settings.tolerance,
                                       .max_passes = e->settings.max_iterations};
    }
    return LOXO_OK;
}

static void keep_none(int d, int64_t begin, int64_t end, const loxo_extension_values *v)
{
    answer none = {.co = NAN, .bound = HUGE_VAL, .error = HUGE_VAL, .kind = LOXO_EXTENSION_OPEN};
    for (int k = 0; k < d; ++k)
        none.w[k] = NAN;
    for (int64_t i = begin; i < end; ++i)
        keep(&none, d, i, v);
}

loxo_status loxo_extension_evaluate(loxo_extension *e, int64_t n, const double *z, const double *co,
                                    const loxo_extension_values *values, loxo_extension_info *info)
{
    if (e == NULL) return LOXO_ERR_ARGUMENT;
    loxo_context *ctx = e->ctx;
    const double start_s = loxo_os_clock_s();
    if (n < 0 || (n > 0 && (z == NULL || values == NULL || values->w == NULL)))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "extension: no points, or nowhere to put their values");
    loxo_status status = check_points(ctx, n, z, co);
    if (status < 0) return status;
    loxo_progress_begin(ctx);
    const int n_threads = loxo_threads_for(ctx, n, 2.0 * (double)e->nodes.n);
    const int64_t most = (int64_t)LOOK * n_threads;
    loxo_extension_info all = {.n_points = 0};
    worker *workers = NULL;
    double *block = NULL;
    if ((status = make_workers(e, n_threads, &workers, &block)) >= 0)
        for (int64_t begin = 0; begin < n; begin += most) {
            evaluate_some(e, begin, begin + most < n ? begin + most : n, z, co, values, workers, n_threads);
            if (begin + most >= n || !loxo_stop_wanted(ctx, "extension", (double)(begin + most) / (double)n)) continue;
            keep_none(e->curve.d, begin + most, n, values);
            status = LOXO_STOPPED;
            break;
        }
    for (int t = 0; t < n_threads && status >= 0; ++t)
        join(&workers[t].info, &all);
    loxo_release(ctx, workers);
    loxo_release(ctx, block);
    if (status < 0) return status;
    all.total_s = loxo_os_clock_s() - start_s;
    all.peak_bytes = loxo_context_memory(ctx).peak_bytes;
    if (info != NULL) *info = all;
    return status == LOXO_OK && all.n_open > 0 ? LOXO_NOT_CONVERGED : status;
}
