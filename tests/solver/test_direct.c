/* SPDX-License-Identifier: MIT
 * The bench's direct solve of the heat equation, which the diffusion is judged by. */
#include "../../bench/direct.h"
#include "../test.h"

/* A bent strip one quad wide: n quads, 2 (n + 1) vertices; vertex 2 i and 2 i + 1 are the rung i. */
static loxo_mesh_arrays strip(int64_t n, double **position, loxo_index **triangle)
{
    *position = loxo_allocate(test_context, 6 * (n + 1), sizeof **position);
    *triangle = loxo_allocate(test_context, 6 * n, sizeof **triangle);
    CHECK(*position != NULL && *triangle != NULL);
    for (int64_t i = 0; i <= n; ++i)
        for (int64_t side = 0; side < 2; ++side) {
            double *p = *position + 6 * i + 3 * side;
            p[0] = (double)i + 0.3 * (double)side;
            p[1] = (double)side;
            p[2] = 0.1 * sin((double)i);
        }
    for (int64_t i = 0; i < n; ++i) {
        const int64_t a = 2 * i, quad[6] = {a, a + 2, a + 3, a, a + 3, a + 1};
        for (int k = 0; k < 6; ++k)
            (*triangle)[6 * i + k] = (loxo_index)quad[k];
    }
    return (loxo_mesh_arrays){
        .n_vertices = 2 * (n + 1), .n_faces = 2 * n, .position = *position, .triangle = *triangle};
}

/* A square grid of n by n quads over a wavy height: some cotangent weights are negative. */
static loxo_mesh_arrays wavy(int64_t n, double **position, loxo_index **triangle)
{
    const int64_t w = n + 1;
    *position = loxo_allocate(test_context, 3 * w * w, sizeof **position);
    *triangle = loxo_allocate(test_context, 6 * n * n, sizeof **triangle);
    CHECK(*position != NULL && *triangle != NULL);
    for (int64_t i = 0; i < w * w; ++i) {
        const double x = (double)(i % w), y = (double)(i / w); /* NOLINT: whole numbers are wanted */
        const double p[3] = {x + 0.35 * sin(3.0 * y + x), y, 0.8 * sin(2.0 * x) * cos(y)};
        memcpy(*position + 3 * i, p, sizeof p);
    }
    for (int64_t i = 0; i < n * n; ++i) {
        const int64_t a = i / n * w + i % n, quad[6] = {a, a + 1, a + w + 1, a, a + w + 1, a + w};
        for (int k = 0; k < 6; ++k)
            (*triangle)[6 * i + k] = (loxo_index)quad[k];
    }
    return (loxo_mesh_arrays){.n_vertices = w * w, .n_faces = 2 * n * n, .position = *position, .triangle = *triangle};
}

typedef struct vector {
    long double x[3];
} vector;

static vector from_to(const loxo_mesh_arrays *m, loxo_index a, loxo_index b)
{
    vector d;
    for (int i = 0; i < 3; ++i)
        d.x[i] = (long double)m->position[3 * b + i] - (long double)m->position[3 * a + i];
    return d;
}

static long double inner(vector a, vector b) { return a.x[0] * b.x[0] + a.x[1] * b.x[1] + a.x[2] * b.x[2]; }

/* The dense matrix A + time C, cotangents by the law of cosines in long double: another way than direct.c's. */
static void dense_matrix(const loxo_mesh_arrays *m, long double time, long double *s)
{
    const int64_t n = m->n_vertices;
    memset(s, 0, (size_t)(n * n) * sizeof *s);
    for (int64_t f = 0; f < m->n_faces; ++f) {
        const loxo_index *v = m->triangle + 3 * f;
        long double l2[3]; /* of the edge opposite each corner */
        for (int c = 0; c < 3; ++c) {
            const vector e = from_to(m, v[(c + 1) % 3], v[(c + 2) % 3]);
            l2[c] = inner(e, e);
        }
        const long double sum = l2[0] + l2[1] + l2[2];
        const long double area = sqrtl(sum * sum - 2.0L * (l2[0] * l2[0] + l2[1] * l2[1] + l2[2] * l2[2])) / 4.0L;
        for (int c = 0; c < 3; ++c) {
            const int64_t a = v[(c + 1) % 3], b = v[(c + 2) % 3];
            const long double w = time * (sum - 2.0L * l2[c]) / (8.0L * area);
            s[a * n + b] -= w;
            s[b * n + a] -= w;
            s[a * n + a] += w;
            s[b * n + b] += w;
            s[v[c] * n + v[c]] += area / 3.0L;
        }
    }
}

/* Gaussian elimination without pivoting: the matrix is positive definite. u holds the right side, then the solution. */
static void dense_solve(int64_t n, long double *s, long double *u)
{
    for (int64_t k = 0; k < n; ++k)
        for (int64_t i = k + 1; i < n; ++i) {
            const long double q = s[i * n + k] / s[k * n + k];
            for (int64_t j = k; j < n; ++j)
                s[i * n + j] -= q * s[k * n + j];
            u[i] -= q * u[k];
        }
    for (int64_t i = n - 1; i >= 0; --i) {
        for (int64_t j = i + 1; j < n; ++j)
            u[i] -= s[i * n + j] * u[j];
        u[i] /= s[i * n + i];
    }
}

static void check_against_dense(const loxo_mesh_arrays *m, loxo_index source)
{
    int64_t n_negative = 0;
    const int64_t n = m->n_vertices;
    double *value = loxo_allocate(test_context, n, sizeof *value);
    int32_t *scale = loxo_allocate(test_context, n, sizeof *scale);
    long double *s = loxo_allocate(test_context, n * n, sizeof *s), *u = loxo_allocate(test_context, n, sizeof *u);
    bench_direct_info info;
    CHECK_OK(bench_direct_heat(test_context, m, 2.0, &source, 1, value, scale, &info));
    CHECK(info.time == 2.0 * info.mean_edge_length * info.mean_edge_length);
    CHECK(info.residual < 1e-17); /* refined in long double */
    for (int64_t i = 0; i < n; ++i)
        u[i] = i == source ? 1.0L : 0.0L;
    dense_matrix(m, (long double)info.time, s);
    for (int64_t i = 0; i < n * n; ++i)
        n_negative += i % (n + 1) != 0 && s[i] > 0.0L;
    CHECK(n_negative > 0); /* negative cotangent weights are what makes it hard */
    dense_solve(n, s, u);
    for (int64_t i = 0; i < n; ++i) /* relative, at every vertex; the cotangents are rounded to double */
        CHECK_NEAR((double)(ldexpl((long double)value[i], scale[i]) / u[i]), 1.0, 1e-12);
    loxo_release(test_context, value);
    loxo_release(test_context, scale);
    loxo_release(test_context, s);
    loxo_release(test_context, u);
}

TEST(direct_heat_agrees_with_a_dense_solve_at_every_vertex)
{
    double *position;
    loxo_index *triangle;
    const loxo_mesh_arrays m = wavy(15, &position, &triangle);
    check_against_dense(&m, 37);
    loxo_release(test_context, position);
    loxo_release(test_context, triangle);
}

TEST(mean_edge_length_counts_every_edge_once)
{
    const double position[] = {0, 0, 0, 3, 0, 0, 0, 4, 0, 3, 4, 0};
    const loxo_index triangle[] = {0, 1, 2, 1, 3, 2};
    const loxo_mesh_arrays m = {.n_vertices = 4, .n_faces = 2, .position = position, .triangle = triangle};
    double value[4];
    int32_t scale[4];
    bench_direct_info info;
    CHECK_OK(bench_direct_heat(test_context, &m, 1.0, (const loxo_index[]){0}, 1, value, scale, &info));
    CHECK_NEAR(info.mean_edge_length, (3.0 + 3.0 + 4.0 + 4.0 + 5.0) / 5.0, 1e-15);
}

TEST(heat_does_not_underflow_on_a_long_strip)
{
    const int64_t n = 6000;
    double *position, *value = loxo_allocate(test_context, 2 * (n + 1), sizeof *value);
    int32_t *scale = loxo_allocate(test_context, 2 * (n + 1), sizeof *scale);
    loxo_index *triangle;
    bench_direct_info info;
    const loxo_mesh_arrays m = strip(n, &position, &triangle);
    CHECK_OK(bench_direct_heat(test_context, &m, 1.0, (const loxo_index[]){0}, 1, value, scale, &info));
    CHECK(scale[2 * n] < -5000); /* far below the smallest double, 2^-1074 */
    CHECK(info.residual < 1e-17);
    CHECK_EQUAL(info.n_nonpositive, 0);
    /* Far from the source the heat falls by the same factor from rung to rung, up to the small waves. */
    for (int64_t i = 100; i + 1 < n - 100; ++i) {
        const double ratio = ldexp(value[2 * i + 2] / value[2 * i], scale[2 * i + 2] - scale[2 * i]);
        CHECK(ratio > 0.3 && ratio < 0.5);
    }
    loxo_release(test_context, position);
    loxo_release(test_context, triangle);
    loxo_release(test_context, value);
    loxo_release(test_context, scale);
}

TEST(heat_that_vanishes_is_told)
{
    const double position[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 5, 0, 0, 6, 0, 0, 5, 1, 0};
    const loxo_index triangle[] = {0, 1, 2, 3, 4, 5}; /* two pieces */
    const loxo_mesh_arrays m = {.n_vertices = 6, .n_faces = 2, .position = position, .triangle = triangle};
    double value[6];
    int32_t scale[6];
    bench_direct_info info;
    CHECK_STATUS(test_context,
                 bench_direct_heat(test_context, &m, 1.0, (const loxo_index[]){0}, 1, value, scale, &info),
                 LOXO_ERR_NUMERIC);
}
