/* SPDX-License-Identifier: MIT
 * Procedural meshes: the list of shapes with their params, checks, and arrays in memory. */
#include "base/allocate.h"
#include "base/context.h"
#include "mesh/generate_internal.h"
#include "par/range.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

typedef struct shape_param {
    const char *name; /* NULL: no more */
    double value, min, max;
    bool is_whole;
} shape_param;

typedef struct shape_row {
    const char *name, *help;
    void (*make)(loxo_generator *g);
    double ns_vertex; /* to compute a position, roughly */
    shape_param params[4];
} shape_row;

#define LENGTH_MIN 1e-30
#define LENGTH_MAX 1e30
#define LENGTH(name, value)                                                                                            \
    {                                                                                                                  \
        name, value, LENGTH_MIN, LENGTH_MAX, false                                                                     \
    }

static const shape_row shapes[LOXO_N_SHAPES] = {
    [LOXO_SHAPE_ICOSPHERE] =
        {"icosphere", "unit sphere, icosahedron split to any frequency", loxo_make_icosphere, 20, {{0}}},
    [LOXO_SHAPE_LATLONG] = {"latlong", "unit sphere, meridians and parallels", loxo_make_latlong, 60, {{0}}},
    [LOXO_SHAPE_ELLIPSOID] = {"ellipsoid",
                              "icosphere stretched to three half-axes (params: 1, 0.8, 0.6)",
                              loxo_make_icosphere,
                              20,
                              {LENGTH("half-axis x", 1.0), LENGTH("half-axis y", 0.8), LENGTH("half-axis z", 0.6)}},
    [LOXO_SHAPE_TORUS] = {"torus",
                          "torus (params: radius of the ring 1, of the tube 0.4)",
                          loxo_make_lattice,
                          80,
                          {LENGTH("radius of the ring", 1.0), LENGTH("radius of the tube", 0.4)}},
    [LOXO_SHAPE_GENUS] = {"genus",
                          "slab with a row of holes, closed (params: genus 2)",
                          loxo_make_genus,
                          60,
                          {{"genus", 2, 0, 1e6, true}}},
    [LOXO_SHAPE_BUMPY] = {"bumpy", "the bumpy sphere of the benchmarks", loxo_make_icosphere, 200, {{0}}},
    [LOXO_SHAPE_NOISY] = {"noisy",
                          "icosphere, vertices moved at random (params: by how many mean edge lengths at most, 0.2)",
                          loxo_make_icosphere,
                          100,
                          {{"noise in mean edge lengths", 0.2, 0, 100, false}}},
    [LOXO_SHAPE_DISK] = {"disk", "flat unit disk of concentric rings", loxo_make_rings, 50, {{0}}},
    [LOXO_SHAPE_GRID] = {"grid", "flat unit square", loxo_make_lattice, 20, {{0}}},
    [LOXO_SHAPE_STRIP] = {"strip", "flat strip of unit squares, one wide", loxo_make_lattice, 10, {{0}}},
    [LOXO_SHAPE_CYLINDER] = {"cylinder",
                             "open cylinder (params: radius 1, height 2)",
                             loxo_make_lattice,
                             50,
                             {LENGTH("radius", 1.0), LENGTH("height", 2.0)}},
    [LOXO_SHAPE_ANNULUS] = {"annulus",
                            "flat ring (params: inner radius 0.5, outer radius 1)",
                            loxo_make_rings,
                            50,
                            {LENGTH("inner radius", 0.5), LENGTH("outer radius", 1.0)}},
    [LOXO_SHAPE_BRAIN] = {"brain",
                          "folded sphere, seeded (params: depth of the furrows 0.035, wave number 14)",
                          loxo_make_icosphere,
                          500,
                          {{"depth of the furrows", 0.035, 0, 0.9, false}, {"wave number", 14, 0, 1e4, false}}},
};

loxo_generate_settings loxo_generate_settings_default(void)
{
    return (loxo_generate_settings){
        .shape = LOXO_SHAPE_ICOSPHERE,
        .n_vertices = 100000,
        .seed = 1,
        .params = {NAN, NAN, NAN, NAN},
    };
}

static bool is_shape(loxo_shape shape) { return (int)shape >= 0 && (int)shape < LOXO_N_SHAPES; }

const char *loxo_shape_name(loxo_shape shape) { return is_shape(shape) ? shapes[shape].name : "unknown"; }

const char *loxo_shape_help(loxo_shape shape) { return is_shape(shape) ? shapes[shape].help : ""; }

bool loxo_shape_from_name(const char *name, loxo_shape *shape)
{
    for (int s = 0; name != NULL && s < LOXO_N_SHAPES; ++s) {
        if (strcmp(name, shapes[s].name) != 0) continue;
        *shape = (loxo_shape)s;
        return true;
    }
    return false;
}

static loxo_status take_params(loxo_context *ctx, const double *params, loxo_generator *g)
{
    const shape_row *row = &shapes[g->shape];
    for (int i = 0; i < 4; ++i) {
        const shape_param *p = &row->params[i];
        if (p->name == NULL) {
            if (!isnan(params[i]))
                return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "generate: %s takes no param %d", row->name, i + 1);
            continue;
        }
        g->params[i] = isnan(params[i]) ? p->value : params[i];
        if (!(g->params[i] >= p->min && g->params[i] <= p->max))
            return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "generate: %s: %s %g not in %g..%g", row->name, p->name,
                             g->params[i], p->min, p->max);
        if (p->is_whole && g->params[i] != floor(g->params[i]))
            return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "generate: %s: %s %g is no whole number", row->name, p->name,
                             g->params[i]);
    }
    if (g->shape == LOXO_SHAPE_TORUS && g->params[1] >= g->params[0])
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "generate: torus: the tube's radius %g is not below the ring's %g",
                         g->params[1], g->params[0]);
    if (g->shape == LOXO_SHAPE_ANNULUS && g->params[0] >= g->params[1])
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "generate: annulus: inner radius %g is not below the outer %g",
                         g->params[0], g->params[1]);
    return LOXO_OK;
}

loxo_status loxo_generator_make(loxo_context *ctx, const loxo_generate_settings *settings, loxo_generator *g)
{
    loxo_status status;
    *g = (loxo_generator){.shape = settings->shape, .seed = settings->seed, .n_vertices = settings->n_vertices};
    if (!is_shape(g->shape))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "generate: no shape has number %d", (int)g->shape);
    if ((status = take_params(ctx, settings->params, g)) < 0) return status;
    if (g->n_vertices > LOXO_INDEX_MAX)
        return loxo_fail(ctx, LOXO_ERR_LIMIT, "generate: %" PRId64 " vertices, more than the largest id %lld",
                         g->n_vertices, (long long)LOXO_INDEX_MAX);
    if (g->n_vertices < 1)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "generate: %" PRId64 " vertices wanted", g->n_vertices);
    shapes[g->shape].make(g);
    if (settings->n_vertices < g->smallest)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "generate: %s has %" PRId64 " vertices or more, not %" PRId64,
                         shapes[g->shape].name, g->smallest, settings->n_vertices);
    if (g->n_vertices > LOXO_INDEX_MAX || 3 * g->n_faces > LOXO_INDEX_MAX)
        return loxo_fail(ctx, LOXO_ERR_LIMIT,
                         "generate: %" PRId64 " vertices and %" PRId64 " half-edges, more than the largest id %lld",
                         g->n_vertices, 3 * g->n_faces, (long long)LOXO_INDEX_MAX);
    return LOXO_OK;
}

void loxo_generator_positions(loxo_context *ctx, const loxo_generator *g, int64_t begin, int64_t end,
                              double (*position)[3])
{
    const int n_threads = loxo_threads_for(ctx, end - begin, shapes[g->shape].ns_vertex);
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range r = loxo_thread_range(end - begin);
        if (r.begin < r.end) g->positions(g, begin + r.begin, begin + r.end, position + r.begin);
    }
}

/* Positions made in double on the stack on their way to float. */
#define PIECE 256

void loxo_generator_float_positions(loxo_context *ctx, const loxo_generator *g, int64_t begin, int64_t end,
                                    float (*position)[3])
{
    const int n_threads = loxo_threads_for(ctx, end - begin, shapes[g->shape].ns_vertex);
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range r = loxo_thread_range(end - begin);
        double piece[PIECE][3];
        for (int64_t i = r.begin; i < r.end; i += PIECE) {
            const int64_t n = r.end - i < PIECE ? r.end - i : PIECE;
            g->positions(g, begin + i, begin + i + n, piece);
            for (int64_t k = 0; k < n; ++k)
                for (int c = 0; c < 3; ++c)
                    position[i + k][c] = (float)piece[k][c];
        }
    }
}

void loxo_generator_faces(loxo_context *ctx, const loxo_generator *g, int64_t begin, int64_t end,
                          loxo_index (*triangle)[3])
{
    const int n_threads = loxo_threads_for(ctx, end - begin, 10.0);
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range r = loxo_thread_range(end - begin);
        if (r.begin < r.end) g->faces(g, begin + r.begin, begin + r.end, triangle + r.begin);
    }
}

/* Elements between two looks at the monitor. */
#define STRETCH ((int64_t)1 << 20)
static loxo_status fill(loxo_context *ctx, const loxo_generator *g, loxo_soup *soup)
{
    const double n_all = (double)(g->n_vertices + g->n_faces);
    for (int64_t begin = 0; begin < g->n_vertices; begin += STRETCH) {
        const int64_t end = begin + STRETCH < g->n_vertices ? begin + STRETCH : g->n_vertices;
        if (loxo_stop_wanted(ctx, "generate", (double)begin / n_all)) return LOXO_ERR_STOPPED;
        if (soup->position != NULL)
            loxo_generator_positions(ctx, g, begin, end, (double(*)[3])soup->position + begin);
        else
            loxo_generator_float_positions(ctx, g, begin, end, (float(*)[3])soup->position_float + begin);
    }
    for (int64_t begin = 0; begin < g->n_faces; begin += STRETCH) {
        const int64_t end = begin + STRETCH < g->n_faces ? begin + STRETCH : g->n_faces;
        if (loxo_stop_wanted(ctx, "generate", (double)(g->n_vertices + begin) / n_all)) return LOXO_ERR_STOPPED;
        loxo_generator_faces(ctx, g, begin, end, (loxo_index(*)[3])soup->triangle + begin);
    }
    return LOXO_OK;
}

loxo_status loxo_generate(loxo_context *ctx, const loxo_generate_settings *settings, bool is_float, loxo_soup *soup)
{
    const size_t position_bytes = 3 * (is_float ? sizeof(float) : sizeof(double));
    loxo_generator g;
    loxo_status status;
    loxo_soup made = {0};
    if (soup == NULL || settings == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "generate: NULL argument");
    *soup = (loxo_soup){0};
    if ((status = loxo_generator_make(ctx, settings, &g)) < 0) return status;
    loxo_progress_begin(ctx);
    status = loxo_memory_check(ctx, (size_t)g.n_vertices * position_bytes + (size_t)g.n_faces * 3 * sizeof(loxo_index),
                               "generate: positions and triangles");
    if (status < 0) return status;
    made.n_vertices = g.n_vertices;
    made.n_faces = g.n_faces;
    status = LOXO_ERR_MEMORY;
    made.triangle = loxo_allocate(ctx, g.n_faces, 3 * sizeof *made.triangle);
    if (made.triangle == NULL) goto fail;
    if (is_float)
        made.position_float = loxo_allocate(ctx, g.n_vertices, position_bytes);
    else
        made.position = loxo_allocate(ctx, g.n_vertices, position_bytes);
    if (made.position_float == NULL && made.position == NULL) goto fail;
    if (fill(ctx, &g, &made) < 0) {
        status = loxo_fail(ctx, LOXO_ERR_STOPPED, "generate: stopped");
        goto fail;
    }
    *soup = made;
    return LOXO_OK;
fail:
    loxo_release(ctx, made.position);
    loxo_release(ctx, made.position_float);
    loxo_release(ctx, made.triangle);
    return status;
}
