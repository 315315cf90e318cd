/* SPDX-License-Identifier: MIT
 * Extensions of maps of the sphere to the ball: what is a Moebius map of the sphere extends to that of the ball. */
#include "../shapes.h"
#include "base/rng.h"
#include "kernel/ball_kernel.h"
#include "stopper.h"

#include <loxo/extension.h>

typedef struct ball_map {
    loxo_soup soup;
    double *y;
    loxo_sphere_map map;
} ball_map;

/* The identity of an icosphere; y is to be changed. */
static ball_map map_make(int64_t n_vertices)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    ball_map m;
    settings.shape = LOXO_SHAPE_ICOSPHERE;
    settings.n_vertices = n_vertices;
    CHECK_OK(loxo_generate(test_context, &settings, false, &m.soup));
    m.y = loxo_allocate(test_context, 3 * m.soup.n_vertices, sizeof *m.y);
    memcpy(m.y, m.soup.position, (size_t)m.soup.n_vertices * 3 * sizeof *m.y);
    m.map = (loxo_sphere_map){.n_vertices = m.soup.n_vertices,
                              .n_faces = m.soup.n_faces,
                              .d = 3,
                              .x = m.soup.position,
                              .y = m.y,
                              .triangle = m.soup.triangle};
    return m;
}

static void map_free(ball_map *m)
{
    loxo_release(test_context, m->y);
    loxo_soup_destroy(test_context, &m->soup);
}

/* A direction, seeded. */
static void direction(uint64_t i, double *u)
{
    double square = 0.0;
    for (int k = 0; k < 3; ++k) {
        u[k] = 2.0 * loxo_random_unit(11, 3 * i + (uint64_t)k) - 1.0;
        square += u[k] * u[k];
    }
    for (int k = 0; k < 3; ++k)
        u[k] /= sqrt(square);
}

static double distance(const double *a, double co_a, const double *b, double co_b)
{
    double sum = 0.0;
    for (int k = 0; k < 3; ++k)
        sum += (a[k] - b[k]) * (a[k] - b[k]);
    return 2.0 * asinh(sqrt(sum / (co_a * co_b)));
}

typedef struct value {
    double w[3], co, bound;
    unsigned char kind;
} value;

static loxo_status evaluate(loxo_context *ctx, const loxo_sphere_map *map, double piece, const double *z, double co,
                            value *out)
{
    loxo_sphere_extension_settings settings = loxo_sphere_extension_settings_default();
    const loxo_extension_values values = {.w = out->w, .co = &out->co, .bound = &out->bound, .kind = &out->kind};
    settings.piece = piece;
    return loxo_sphere_extension(ctx, map, &settings, 1, z, &co, &values, NULL);
}

/* The rule of degree 4: its error is some constant times the fifth or sixth power of a piece's size, as seen from z, wherever z is. */
TEST(the_identity_at_any_distance)
{
    static const double pieces[] = {0.5, 0.25}, most[] = {2e-5, 2e-7};
    ball_map m = map_make(100);
    for (int p = 0; p < 2; ++p)
        for (int e = 0; e < 8; ++e) {
            double u[3];
            value v;
            direction((uint64_t)e, u);
            const double gap = 0.9 * pow(10.0, -e), co = gap * (2.0 - gap);
            const double z[3] = {(1.0 - gap) * u[0], (1.0 - gap) * u[1], (1.0 - gap) * u[2]};
            CHECK_OK(evaluate(test_context, &m.map, pieces[p], z, co, &v));
            CHECK(v.kind == LOXO_EXTENSION_INSIDE && v.bound <= 1e-8);
            CHECK(distance(z, co, v.w, v.co) <= most[p]);
        }
    map_free(&m);
}

static void shift_all(int64_t n, const double a[3], double *x)
{
    for (int64_t i = 0; i < n; ++i)
        k_ball_shift(3, a, 1.0 - k_ball_dot(3, a, a), x + 3 * i, x + 3 * i);
}

/* Maps whose vertices are moved by sigma_a, before or behind: between vertices linear maps are near it to the second order of the edges. */
TEST(moebius_maps_pass_through)
{
    static const double a[3] = {0.2, -0.3, 0.25}, minus[3] = {-0.2, 0.3, -0.25}, z[3] = {-0.4, 0.1, 0.3};
    const double co_a = 1.0 - k_ball_dot(3, a, a), co_z = 1.0 - k_ball_dot(3, z, z);
    double want[3], before[2] = {0.0, 0.0};
    const double co = k_ball_compose(3, minus, co_a, z, co_z, want); /* sigma_a(z) */
    for (int64_t n = 252; n <= 4002; n *= 4) {
        for (int side = 0; side < 2; ++side) {
            ball_map m = map_make(n);
            value v;
            shift_all(m.map.n_vertices, side == 0 ? a : minus, side == 0 ? m.y : m.soup.position);
            CHECK_OK(evaluate(test_context, &m.map, 0.25, z, co_z, &v));
            const double off = distance(want, co, v.w, v.co);
            CHECK(off <= 1e-3);
            if (n > 252) CHECK(before[side] / off > 3.5);
            before[side] = off;
            map_free(&m);
        }
    }
}

TEST(on_the_sphere_it_is_the_map)
{
    ball_map m = map_make(250);
    for (int64_t i = 0; i < m.map.n_vertices; ++i)
        for (int k = 0; k < 3; ++k)
            m.y[3 * i + k] = m.map.x[3 * i + (k + 1) % 3]; /* a rotation */
    for (uint64_t i = 0; i < 20; ++i) {
        double u[3];
        value v;
        direction(i, u);
        CHECK_OK(evaluate(test_context, &m.map, 0.5, u, 0.0, &v));
        CHECK(v.kind == LOXO_EXTENSION_CURVE && v.co == 0.0 && v.bound == 0.0);
        for (int k = 0; k < 3; ++k)
            CHECK_NEAR(v.w[k], u[(k + 1) % 3], 1e-15);
    }
    map_free(&m);
}

/* All faces above z = -0.2 fall to one point: they have more than half of the measure of the centre, and less than half of that far below. */
TEST(where_the_map_rests)
{
    ball_map m = map_make(2500);
    value v;
    for (int64_t i = 0; i < m.map.n_vertices; ++i)
        if (m.map.x[3 * i + 2] > -0.2) memcpy(m.y + 3 * i, (const double[3]){0.0, 0.0, 1.0}, 3 * sizeof *m.y);
    CHECK_OK(evaluate(test_context, &m.map, 0.5, (const double[3]){0.0, 0.0, 0.0}, 1.0, &v));
    CHECK(v.kind == LOXO_EXTENSION_RESTING && v.w[2] == 1.0 && v.co == 0.0);
    CHECK_OK(evaluate(test_context, &m.map, 0.5, (const double[3]){0.0, 0.0, -0.8}, 0.36, &v));
    CHECK(v.kind == LOXO_EXTENSION_INSIDE && v.w[2] < 0.0);
    map_free(&m);
}

typedef struct job {
    const loxo_sphere_map *map;
    const double *z;
} job;

static loxo_status call(loxo_context *ctx, void *arg)
{
    const job *j = arg;
    double w[9];
    const loxo_extension_values values = {.w = w};
    return loxo_sphere_extension(ctx, j->map, NULL, 3, j->z, NULL, &values, NULL);
}

static uint64_t hash_values(loxo_context *ctx, const void *arg)
{
    const job *j = arg;
    double w[9], co[3];
    const loxo_extension_values values = {.w = w, .co = co};
    CHECK_STATUS(ctx, loxo_sphere_extension(ctx, j->map, NULL, 3, j->z, NULL, &values, NULL), LOXO_OK);
    return test_hash(w, sizeof w) ^ test_hash(co, sizeof co);
}

TEST(threads_allocations_and_the_monitor)
{
    static const double z[9] = {0.1, 0.2, 0.3, 0.0, 0.0, 0.999, 0.0, -1.0, 0.0};
    ball_map m = map_make(2500);
    job j = {&m.map, z};
    m.y[0] = 0.6;
    m.y[1] = 0.8;
    m.y[2] = 0.0;
    test_same_for_any_threads(hash_values, &j);
    CHECK(test_each_allocation_fails(call, &j) >= 8);
    double w[9];
    const loxo_extension_values values = {.w = w};
    loxo_sphere_extension_info info;
    stopper stop;
    stopper_begin(&stop, test_context, 1);
    CHECK_STATUS(test_context, loxo_sphere_extension(test_context, &m.map, NULL, 3, z, NULL, &values, &info),
                 LOXO_STOPPED);
    stopper_end(&stop);
    CHECK(info.n_points < 3 && isnan(w[8]));
    map_free(&m);
}

TEST(bad_input_is_named)
{
    ball_map m = map_make(100);
    double w[3], z[3] = {0.0, 0.0, 0.0};
    const loxo_extension_values values = {.w = w};
    loxo_sphere_extension_settings settings = loxo_sphere_extension_settings_default();
    loxo_sphere_map bad;
    loxo_index *t = m.soup.triangle;
#define EXTEND(map) loxo_sphere_extension(test_context, map, &settings, 1, z, NULL, &values, NULL)
    CHECK_OK(EXTEND(&m.map));
    CHECK_STATUS(test_context, EXTEND(NULL), LOXO_ERR_ARGUMENT);
    bad = m.map;
    bad.d = 1;
    CHECK_STATUS(test_context, EXTEND(&bad), LOXO_ERR_ARGUMENT);
    bad = m.map;
    bad.n_faces -= 1; /* open */
    CHECK_STATUS(test_context, EXTEND(&bad), LOXO_ERR_MESH);
    const loxo_index swap = t[3];
    t[3] = t[4];
    t[4] = swap; /* a face turned over */
    CHECK_STATUS(test_context, EXTEND(&m.map), LOXO_ERR_MESH);
    t[4] = t[3];
    t[3] = (loxo_index)m.map.n_vertices;
    CHECK_STATUS(test_context, EXTEND(&m.map), LOXO_ERR_MALFORMED);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 1);
    t[3] = swap;
    static const double wrong[] = {2.0, 0.0, NAN};
    for (int i = 0; i < 3; ++i) {
        const double keep[3] = {m.y[6], m.y[7], m.y[8]};
        m.y[6] = m.y[7] = m.y[8] = wrong[i];
        CHECK_STATUS(test_context, EXTEND(&m.map), LOXO_ERR_MESH);
        CHECK_EQUAL(loxo_context_failure(test_context)->element, 2);
        memcpy(m.y + 6, keep, sizeof keep);
        z[1] = i == 2 ? (double)NAN : 1.5;
        CHECK_STATUS(test_context, EXTEND(&m.map), LOXO_ERR_ARGUMENT);
        CHECK_EQUAL(loxo_context_failure(test_context)->element, 0);
        z[1] = 0.0;
    }
    settings.piece = 0.0;
    CHECK_STATUS(test_context, EXTEND(&m.map), LOXO_ERR_ARGUMENT);
#undef EXTEND
    map_free(&m);
}
