/* SPDX-License-Identifier: MIT
 * Random closed polygons: with their weights they have the moments that are known exactly; seeds, pieces and threads give the same. */
#include "base/allocate.h"
#include "stopper.h"
#include "test.h"

#include <loxo/polygon.h>

#define PI 3.14159265358979323846

typedef struct mean {
    double sum, square, weight, weight_square; /* of w f, (w f)^2, w, w^2 */
    int64_t n;
} mean;

typedef struct draw {
    int64_t n_polygons, n;
    int d;
    const double *length;
    loxo_polygon_sample_settings settings;
    double *x, *log_weight;
} draw;

static draw draw_make(int64_t n_polygons, int64_t n, int d, const double *length, loxo_polygon_measure measure)
{
    draw s = {
        .n_polygons = n_polygons, .n = n, .d = d, .length = length, .settings = loxo_polygon_sample_settings_default()};
    loxo_polygon_info info;
    s.settings.measure = measure;
    s.settings.seed = 20240;
    s.x = loxo_allocate(test_context, n_polygons * n * d, sizeof *s.x);
    s.log_weight = loxo_allocate(test_context, n_polygons, sizeof *s.log_weight);
    CHECK_OK(loxo_polygon_sample(test_context, &s.settings, 0, n_polygons, n, d, length, s.x, s.log_weight, &info));
    CHECK_EQUAL(info.n_closed, n_polygons);
    return s;
}

static void draw_free(draw *s)
{
    loxo_release(test_context, s->x);
    loxo_release(test_context, s->log_weight);
}

/* Distance of vertices 0 and k. */
static double chord(const draw *s, int64_t i, int64_t k)
{
    const double *a = s->x + i * s->n * s->d, *b = a + k * s->d;
    double square = 0.0;
    for (int j = 0; j < s->d; ++j)
        square += (a[j] - b[j]) * (a[j] - b[j]);
    return sqrt(square);
}

/* The weighted mean of a power of a chord is the value, to five standard errors of this very sample; these are small. */
static void check_chord(const draw *s, int64_t k, double power, double value)
{
    double sum = 0.0, weights = 0.0, spread = 0.0, squares = 0.0;
    for (int64_t i = 0; i < s->n_polygons; ++i) {
        const double w = exp(s->log_weight[i]);
        sum += w * pow(chord(s, i, k), power);
        weights += w;
        squares += w * w;
    }
    const double found = sum / weights;
    for (int64_t i = 0; i < s->n_polygons; ++i) {
        const double w = exp(s->log_weight[i]), off = pow(chord(s, i, k), power) - found;
        spread += w * w * off * off;
    }
    const double error = sqrt(spread) / weights;
    print_message("n %lld d %d chord %lld ^ %g: %.5f, is %.5f, standard error %.5f, effective %.1f %%\n",
                  (long long)s->n, s->d, (long long)k, power, found, value, error,
                  100.0 * weights * weights / squares / (double)s->n_polygons);
    CHECK_NEAR(found, value, 5.0 * error);
    CHECK(error < 0.02 * value);
}

/* The mean weight is the density at 0 of the sum of the edges of an open polygon. */
static void check_density(const draw *s, double value)
{
    double sum = 0.0, squares = 0.0;
    for (int64_t i = 0; i < s->n_polygons; ++i) {
        const double w = exp(s->log_weight[i]);
        sum += w;
        squares += w * w;
    }
    const double n = (double)s->n_polygons, found = sum / n, error = sqrt((squares / n - found * found) / n);
    print_message("n %lld d %d: density at 0 %.6f, is %.6f, standard error %.6f\n", (long long)s->n, s->d, found, value,
                  error);
    CHECK_NEAR(found, value, 5.0 * error);
    CHECK(error < 0.02 * value);
}

/* In space the density at 0 is an integral of sin(k l) / (k l) over the product of edges, 1/(8 pi), 5/(64 pi), 1/(16 pi), 1/(24 pi) for 4, 5, 6,
 * 8 alike (Rayleigh 1919); in the plane of J_0(k)^n k / (2 pi), here by Simpson's rule. */
TEST(mean_weights_are_densities_of_closing)
{
    static const struct {
        int n, d;
        double density;
    } cases[] = {{4, 3, 1.0 / (8.0 * PI)},  {5, 3, 5.0 / (64.0 * PI)}, {6, 3, 1.0 / (16.0 * PI)},
                 {8, 3, 1.0 / (24.0 * PI)}, {6, 2, 0.0536078351},      {8, 2, 0.0378334621}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        draw s = draw_make(40000, cases[i].n, cases[i].d, NULL, LOXO_POLYGON_WALKS);
        check_density(&s, cases[i].density);
        draw_free(&s);
    }
    static const double length[6] = {1.0, 2.0, 1.5, 0.5, 1.25, 1.0};
    draw s = draw_make(40000, 6, 3, length, LOXO_POLYGON_WALKS);
    check_density(&s, 0.0082340578196848629);
    draw_free(&s);
}

/* Walks in space that close: diagonals from one vertex are uniform on the polytope of their triangle inequalities (Millson, Kapovich 1996; Cantarella,
 * Shonkwiler 2016). For four edges on [0, 2]; for five on a square without three corners: 17/15. Other lengths: on an interval. The mean square of any chord
 * of edges alike is k (n - k) / (n - 1), as the sum of the edges is 0. */
TEST(chords_of_walks_that_close)
{
    draw s = draw_make(40000, 4, 3, NULL, LOXO_POLYGON_WALKS);
    check_chord(&s, 2, 1.0, 1.0);
    check_chord(&s, 2, 2.0, 4.0 / 3.0);
    check_chord(&s, 2, 4.0, 16.0 / 5.0);
    draw_free(&s);
    s = draw_make(40000, 5, 3, NULL, LOXO_POLYGON_WALKS);
    check_chord(&s, 2, 1.0, 17.0 / 15.0);
    check_chord(&s, 3, 2.0, 6.0 / 4.0);
    draw_free(&s);
    static const double length[4] = {1.0, 1.5, 0.75, 1.25}; /* diagonals: 0.5 to 2 */
    s = draw_make(40000, 4, 3, length, LOXO_POLYGON_WALKS);
    check_chord(&s, 2, 1.0, 1.25);
    check_chord(&s, 2, 2.0, (8.0 - 0.125) / (3.0 * 1.5));
    draw_free(&s);
    s = draw_make(20000, 64, 3, NULL, LOXO_POLYGON_WALKS);
    check_chord(&s, 20, 2.0, 20.0 * 44.0 / 63.0);
    draw_free(&s);
}

static double determinant(double a[3][3])
{
    return a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) - a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
           a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
}

/* The volume of closed polygons is that of walks times the root of the determinant of the sum of 1 - y y^T: a quadrilateral of sides 1 has its diagonal r and the
 * angle between its halves uniform for walks; so a double sum gives the mean of r. */
TEST(chords_by_volume)
{
    enum { STEPS = 400 };
    double sum[2] = {0.0, 0.0};
    for (int i = 0; i < STEPS; ++i)
        for (int j = 0; j < STEPS; ++j) {
            const double r = 2.0 * (i + 0.5) / STEPS, angle = 2.0 * PI * (j + 0.5) / STEPS,
                         h = sqrt(1.0 - 0.25 * r * r);
            const double v[5][3] = {
                {0, 0, 0}, {0.5 * r, h, 0}, {r, 0, 0}, {0.5 * r, h * cos(angle), h * sin(angle)}, {0, 0, 0}};
            double g[3][3] = {{4, 0, 0}, {0, 4, 0}, {0, 0, 4}};
            for (int e = 0; e < 4; ++e)
                for (int a = 0; a < 3; ++a)
                    for (int b = 0; b < 3; ++b)
                        g[a][b] -= (v[e + 1][a] - v[e][a]) * (v[e + 1][b] - v[e][b]);
            const double root = sqrt(determinant(g));
            sum[0] += root;
            sum[1] += root * r;
        }
    draw s = draw_make(40000, 4, 3, NULL, LOXO_POLYGON_VOLUME);
    check_chord(&s, 2, 1.0, sum[1] / sum[0]);
    CHECK(fabs(sum[1] / sum[0] - 1.0) > 0.01); /* so that the measures are told apart */
    draw_free(&s);
}

TEST(any_dimension)
{
    draw s = draw_make(20000, 7, 4, NULL, LOXO_POLYGON_WALKS);
    check_chord(&s, 3, 2.0, 3.0 * 4.0 / 6.0);
    draw_free(&s);
    s = draw_make(500, 5, 64, NULL, LOXO_POLYGON_VOLUME);
    for (int64_t i = 0; i < 500; ++i)
        CHECK(isfinite(s.log_weight[i]));
    draw_free(&s);
}

/* Numbers 100 to 199 in one piece, and in pieces of 30: the same bits. Another seed, another number: others. */
TEST(pieces_of_a_stream)
{
    enum { N = 24, M = 100 };
    double *a = loxo_allocate(test_context, (int64_t)M * N * 3, sizeof *a),
           *b = loxo_allocate(test_context, (int64_t)M * N * 3, sizeof *b);
    double wa[M], wb[M];
    loxo_polygon_sample_settings settings = loxo_polygon_sample_settings_default();
    CHECK_OK(loxo_polygon_sample(test_context, &settings, 100, M, N, 3, NULL, a, wa, NULL));
    for (int64_t i = 0; i < M; i += 30)
        CHECK_OK(loxo_polygon_sample(test_context, &settings, 100 + i, M - i < 30 ? M - i : 30, N, 3, NULL,
                                     b + i * N * 3, wb + i, NULL));
    CHECK(memcmp(a, b, (size_t)M * N * 3 * sizeof *a) == 0);
    CHECK(memcmp(wa, wb, sizeof wa) == 0);
    CHECK_OK(loxo_polygon_sample(test_context, &settings, 101, M, N, 3, NULL, b, wb, NULL));
    CHECK(memcmp(a, b, (size_t)M * N * 3 * sizeof *a) != 0 && wa[1] == wb[0]);
    settings.seed = 2;
    CHECK_OK(loxo_polygon_sample(test_context, &settings, 100, M, N, 3, NULL, b, wb, NULL));
    CHECK(wa[0] < wb[0] || wa[0] > wb[0]);
    loxo_release(test_context, a);
    loxo_release(test_context, b);
}

/* Many edges: pieces of a polygon in lanes, and where lengths are told (all 1) one edge after the other. */
TEST(large_polygons_two_ways)
{
    enum { N = 2053 + 2048, M = 3 };
    const int64_t size = (int64_t)N * M;
    double *length = loxo_allocate(test_context, N, sizeof *length), wa[M], wb[M];
    for (int d = 2; d <= 3; ++d) {
        double *a = loxo_allocate(test_context, size * d, sizeof *a),
               *b = loxo_allocate(test_context, size * d, sizeof *b);
        for (int i = 0; i < N; ++i)
            length[i] = 1.0;
        CHECK_OK(loxo_polygon_sample(test_context, NULL, 5, M, N, d, NULL, a, wa, NULL));
        CHECK_OK(loxo_polygon_sample(test_context, NULL, 5, M, N, d, length, b, wb, NULL));
        for (int64_t i = 0; i < size * d; ++i)
            CHECK_NEAR(a[i], b[i], 1e-11); /* 4101 edges that each turn by some 1e-15 */
        for (int i = 0; i < M; ++i)
            CHECK_NEAR(wa[i], wb[i], 1e-9);
        loxo_release(test_context, a);
        loxo_release(test_context, b);
    }
    loxo_release(test_context, length);
}

static uint64_t hash_of_sample(loxo_context *ctx, const void *arg)
{
    const int d = *(const int *)arg;
    double *x = loxo_allocate(ctx, (int64_t)3000 * 20 * d, sizeof *x),
           *weight = loxo_allocate(ctx, 3000, sizeof *weight);
    CHECK_STATUS(ctx, loxo_polygon_sample(ctx, NULL, 7, 3000, 20, d, NULL, x, weight, NULL), LOXO_OK);
    const uint64_t hash =
        test_hash(x, (size_t)3000 * 20 * (size_t)d * sizeof *x) * 31 + test_hash(weight, 3000 * sizeof *weight);
    loxo_release(ctx, x);
    loxo_release(ctx, weight);
    return hash;
}

TEST(the_same_for_any_threads)
{
    for (int d = 2; d <= 4; ++d)
        test_same_for_any_threads(hash_of_sample, &d);
}

TEST(edges_and_vertices_agree)
{
    enum { N = 12, M = 50 };
    static double edges[M * N * 3], vertices[M * N * 3], wa[M], wb[M];
    static const double length[N] = {1, 2, 3, 1, 2, 3, 1, 2, 3, 1, 2, 3};
    loxo_polygon_sample_settings settings = loxo_polygon_sample_settings_default();
    CHECK_OK(loxo_polygon_sample(test_context, &settings, 0, M, N, 3, length, vertices, wa, NULL));
    settings.edges = true;
    CHECK_OK(loxo_polygon_sample(test_context, &settings, 0, M, N, 3, length, edges, wb, NULL));
    for (int64_t i = 0; i < M; ++i) {
        CHECK_NEAR(wa[i], wb[i], 1e-12 * fabs(wa[i]));
        for (int64_t j = 0; j < N; ++j) {
            double square = 0.0;
            for (int k = 0; k < 3; ++k) {
                const double e = edges[(i * N + j) * 3 + k];
                square += e * e;
                CHECK_NEAR(e, vertices[(i * N + (j + 1) % N) * 3 + k] - vertices[(i * N + j) * 3 + k], 1e-14);
            }
            CHECK_NEAR(sqrt(square), length[j], 2e-15);
        }
    }
}

TEST(bad_calls)
{
    double x[64], weight[8], length[4] = {1, 1, 1, 1};
#define REFUSED(first, m, n, d, length, x)                                                                             \
    CHECK_STATUS(test_context, loxo_polygon_sample(test_context, NULL, first, m, n, d, length, x, weight, NULL),       \
                 LOXO_ERR_ARGUMENT)
    REFUSED(-1, 1, 4, 3, NULL, x);
    REFUSED(0, -1, 4, 3, NULL, x);
    REFUSED(0, 1, 2, 3, NULL, x);
    REFUSED(0, 1, 4, 1, NULL, x);
    REFUSED(0, 1, 4, 65, NULL, x);
    REFUSED(0, 1, 4, 3, NULL, NULL);
    length[2] = 3.0;
    REFUSED(0, 1, 4, 3, length, x);
    length[2] = 4.0;
    REFUSED(0, 1, 4, 3, length, x);
    length[2] = (double)NAN;
    REFUSED(0, 1, 4, 3, length, x);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 2);
    CHECK_OK(loxo_polygon_sample(test_context, NULL, 0, 0, 4, 3, NULL, x, weight, NULL));
    CHECK_STATUS(test_context, loxo_polygon_sample(test_context, NULL, 0, INT64_MAX / 8, 4, 3, NULL, x, weight, NULL),
                 LOXO_ERR_LIMIT);
    loxo_polygon_sample_settings settings = loxo_polygon_sample_settings_default();
    settings.tolerance = -1.0;
    CHECK_STATUS(test_context, loxo_polygon_sample(test_context, &settings, 0, 1, 4, 3, NULL, x, weight, NULL),
                 LOXO_ERR_ARGUMENT);
    /* triangles are rigid, and many are narrow: all of them close */
    static double triangles[9000], weights[1000];
    CHECK_OK(loxo_polygon_sample(test_context, NULL, 0, 1000, 3, 3, NULL, triangles, weights, NULL));
    for (int i = 0; i < 1000; ++i)
        CHECK(isfinite(weights[i]));
}

static loxo_status sample(loxo_context *ctx, void *arg)
{
    return loxo_polygon_sample(ctx, NULL, 0, 5, 40, 3, NULL, arg, NULL, NULL);
}

TEST(each_allocation_fails)
{
    double x[600];
    CHECK(test_each_allocation_fails(sample, x) >= 6);
}

TEST(the_monitor_stops_it)
{
    enum { M = 40000, N = 20 };
    double *x = loxo_allocate(test_context, (int64_t)M * N * 3, sizeof *x);
    loxo_polygon_info info;
    stopper stop;
    stopper_begin(&stop, test_context, 2);
    CHECK_STATUS(test_context, loxo_polygon_sample(test_context, NULL, 0, M, N, 3, NULL, x, NULL, &info), LOXO_STOPPED);
    stopper_end(&stop);
    CHECK(info.n_closed > 0 && info.n_left > 0);
    loxo_release(test_context, x);
}
