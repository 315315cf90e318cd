/* SPDX-License-Identifier: MIT
 * Closing polygons: lengths stay, the gap goes, whatever the size, the scale, the number of edges; those that cannot are told. */
#include "base/allocate.h"
#include "base/rng.h"
#include "stopper.h"
#include "test.h"

#include <loxo/barycenter.h>
#include <loxo/polygon.h>

#define PI 3.14159265358979323846

static double normal(uint64_t seed, uint64_t i)
{
    const double r = sqrt(-2.0 * log(1.0 - loxo_random_unit(seed, 2 * i)));
    return r * cos(2.0 * PI * loxo_random_unit(seed, 2 * i + 1));
}

/* A batch as open polygons, edges or directions; lengths of edges in 0.5 to 1.5 unless alike. */
typedef struct batch {
    loxo_polygons p;
    double *x, *out, *w;
    loxo_polygon_report *report;
} batch;

static batch batch_make(loxo_context *ctx, int64_t n_polygons, int64_t n, int d, loxo_polygon_form form)
{
    batch b = {.p = {.n_polygons = n_polygons, .n_edges = n, .d = d, .form = form}};
    b.x = loxo_allocate(ctx, n_polygons * (n + 1) * d, sizeof *b.x);
    b.out = loxo_allocate(ctx, n_polygons * n * d, sizeof *b.out);
    b.w = loxo_allocate(ctx, n_polygons * d, sizeof *b.w);
    b.report = loxo_allocate(ctx, n_polygons, sizeof *b.report);
    b.p.x = b.x;
    return b;
}

static void batch_free(loxo_context *ctx, batch *b)
{
    loxo_release(ctx, b->x);
    loxo_release(ctx, b->out);
    loxo_release(ctx, b->w);
    loxo_release(ctx, b->report);
}

static void batch_fill(batch *b, uint64_t seed, double pull, bool alike, double scale, double offset)
{
    const int d = b->p.d;
    const int64_t n = b->p.n_edges, rows = n + (b->p.form == LOXO_POLYGON_VERTICES ? 1 : 0);
    for (int64_t i = 0; i < b->p.n_polygons; ++i) {
        double *x = b->x + i * rows * d, at[8] = {0};
        for (int k = 0; k < d; ++k)
            at[k] = offset;
        for (int64_t j = 0; j < n; ++j) {
            double e[8], square = 0.0;
            const uint64_t number = (uint64_t)(i * n + j);
            for (int k = 0; k < d; ++k) {
                e[k] = normal(seed, number * (uint64_t)d + (uint64_t)k) + (k == 0 ? pull : 0.0);
                square += e[k] * e[k];
            }
            const double length = scale * (alike ? 1.0 : 0.5 + loxo_random_unit(seed + 1, number));
            for (int k = 0; k < d; ++k) {
                e[k] *= length / sqrt(square);
                x[j * d + k] = b->p.form == LOXO_POLYGON_VERTICES ? at[k] : e[k];
                at[k] += e[k];
            }
        }
        if (b->p.form == LOXO_POLYGON_VERTICES) memcpy(x + n * d, at, (size_t)d * sizeof *x);
    }
}

/* Edge j of polygon i as given. */
static long double given_length(const batch *b, int64_t i, int64_t j)
{
    const int d = b->p.d;
    const bool points = b->p.form == LOXO_POLYGON_VERTICES;
    const double *x = b->x + i * (b->p.n_edges + (points ? 1 : 0)) * d + j * d;
    long double square = 0.0L;
    if (b->p.form == LOXO_POLYGON_DIRECTIONS) return b->p.length == NULL ? 1.0L : (long double)b->p.length[j];
    for (int k = 0; k < d; ++k) {
        const long double e = points ? (long double)x[d + k] - (long double)x[k] : (long double)x[k];
        square += e * e;
    }
    return sqrtl(square);
}

/* Most that an edge of closed polygon i, the last one among them, is off its length, in ulp of the vertices' largest distance from 0. */
static double lengths_off(const batch *b, int64_t i)
{
    const int d = b->p.d;
    const int64_t n = b->p.n_edges;
    const double *y = b->out + i * n * d;
    long double most = 0.0L;
    double size = 0.0;
    for (int64_t j = 0; j < n; ++j) {
        double reach = 0.0;
        for (int k = 0; k < d; ++k)
            reach = hypot(reach, y[j * d + k]);
        size = fmax(size, reach);
    }
    for (int64_t j = 0; j < n; ++j) {
        long double square = 0.0L;
        for (int k = 0; k < d; ++k) {
            const long double e = (long double)y[(j + 1 < n ? j + 1 : 0) * d + k] - (long double)y[j * d + k];
            square += e * e;
        }
        most = fmaxl(most, fabsl(sqrtl(square) - given_length(b, i, j)));
    }
    return (double)most / (nextafter(size, HUGE_VAL) - size);
}

static void check_closed(batch *b, double ulp)
{
    loxo_polygon_info info;
    CHECK_OK(loxo_polygon_close(test_context, &b->p, NULL, b->out, b->report, b->w, &info));
    CHECK_EQUAL(info.n_closed, b->p.n_polygons);
    CHECK_EQUAL(info.first_failed, -1);
    if (info.bound_max > 1e-10 || info.gap_max > 1e-15 / sqrt((double)b->p.n_edges)) /* rounding of so many edges */
        print_error("d %d, %lld edges: bound %.2g, gap %.2g\n", b->p.d, (long long)b->p.n_edges, info.bound_max,
                    info.gap_max);
    CHECK(info.bound_max <= 1e-10 && info.gap_max <= 1e-15 / sqrt((double)b->p.n_edges));
    for (int64_t i = 0; i < b->p.n_polygons; ++i) {
        const double off = lengths_off(b, i);
        if (off > ulp)
            print_error("d %d, %lld edges, form %d, polygon %lld: %.2f ulp, gap %.2g, 1 - |w|^2 %.2g\n", b->p.d,
                        (long long)b->p.n_edges, (int)b->p.form, (long long)i, off,
                        b->report[i].gap / b->report[i].length, b->report[i].co);
        CHECK(off <= ulp);
    }
}

TEST(lengths_stay_and_the_gap_goes)
{
    static const int64_t sizes[] = {3, 4, 5, 8, 17, 64, 200, 2048, 2049, 9000};
    for (int d = 2; d <= 5; ++d)
        for (size_t s = 0; s < sizeof sizes / sizeof *sizes; ++s)
            for (int form = 0; form < 3; ++form) {
                batch b = batch_make(test_context, sizes[s] < 300 ? 19 : 2, sizes[s], d, (loxo_polygon_form)form);
                batch_fill(&b, 7, 0.1, sizes[s] < 5 || form == LOXO_POLYGON_DIRECTIONS, 1.0, 0.0);
                /* of a few edges each takes a large part of what is left, where they are not turned for it */
                check_closed(&b, sizes[s] > 8 ? 4.0 : d <= 3 ? 5.0 : 12.0);
                batch_free(test_context, &b);
            }
}

TEST(directions_have_lengths_apart)
{
    enum { LARGE = 5003 };
    static double length[LARGE];
    for (int i = 0; i < LARGE; ++i)
        length[i] = 1.0 + 0.3 * (i % 7);
    for (int d = 2; d <= 4; ++d)
        for (int n = 40; n <= LARGE; n += LARGE - 40) {
            batch b = batch_make(test_context, n == 40 ? 21 : 2, n, d, LOXO_POLYGON_DIRECTIONS);
            b.p.length = length;
            batch_fill(&b, 3, 0.2, true, 1.0, 0.0);
            check_closed(&b, 4.0);
            batch_free(test_context, &b);
        }
}

/* The first vertex stays; a large offset, a small or a large scale change nothing but rounding. */
TEST(any_scale_and_place)
{
    static const double scales[] = {1e-300, 1e-160, 1e-9, 1.0, 1e9, 1e160, 1e300};
    for (size_t s = 0; s < sizeof scales / sizeof *scales; ++s)
        for (int has_offset = 0; has_offset < 2; ++has_offset) {
            batch b = batch_make(test_context, 9, 50, 3, LOXO_POLYGON_VERTICES);
            batch_fill(&b, 11, 0.3, false, scales[s], has_offset * 1e5 * scales[s]);
            check_closed(&b, 4.0);
            for (int64_t i = 0; i < 9; ++i)
                CHECK_NEAR3(b.out + i * 150, b.x + i * 153, 0.0);
            batch_free(test_context, &b);
        }
}

/* Edges drawn far to one side: barycenters near the sphere, beyond what lanes do. */
TEST(far_from_closed)
{
    for (int d = 2; d <= 3; ++d) {
        batch b = batch_make(test_context, 24, 64, d, LOXO_POLYGON_EDGES);
        loxo_polygon_info info;
        batch_fill(&b, 5, 60.0, false, 1.0, 0.0);
        check_closed(&b, 5.0);
        CHECK_OK(loxo_polygon_close(test_context, &b.p, NULL, b.out, b.report, b.w, &info));
        CHECK_EQUAL(info.n_alone, 24);
        batch_free(test_context, &b);
    }
}

/* The same barycenter as that of the single call, and directions that are its map's images. */
TEST(as_the_barycenter_says)
{
    enum { N = 30 };
    batch b = batch_make(test_context, 13, N, 3, LOXO_POLYGON_DIRECTIONS);
    loxo_polygon_settings settings = loxo_polygon_settings_default();
    settings.edges = true;
    batch_fill(&b, 23, 0.6, true, 1.0, 0.0);
    CHECK_OK(loxo_polygon_close(test_context, &b.p, &settings, b.out, b.report, b.w, NULL));
    for (int64_t i = 0; i < 13; ++i) {
        loxo_barycenter_info info;
        double y[3 * N];
        CHECK_OK(loxo_barycenter(test_context, &(loxo_atoms){.n = N, .d = 3, .x = b.x + i * 3 * N}, NULL, &info));
        CHECK_NEAR3(info.w, b.w + 3 * i, 4e-15);
        CHECK_NEAR(info.co, b.report[i].co, 1e-14);
        CHECK_OK(loxo_moebius_map_sphere(test_context, &info.map, N, b.x + i * 3 * N, y));
        for (int k = 0; k < 3 * N; ++k)
            CHECK_NEAR(y[k], b.out[i * 3 * N + k], 2e-14);
        CHECK_NEAR(b.report[i].length, N, 1e-12);
    }
    batch_free(test_context, &b);
}

/* Barycenters alone are those of the call that writes. */
TEST(barycenters_only)
{
    static const int64_t sizes[] = {20, 3001};
    for (int d = 2; d <= 4; ++d)
        for (int s = 0; s < 2; ++s)
            for (int far = 0; far < 2; ++far) {
                batch b = batch_make(test_context, 11, sizes[s], d, LOXO_POLYGON_EDGES);
                double w[11 * 4];
                loxo_polygon_report report[11];
                batch_fill(&b, 4, far == 0 ? 0.3 : 30.0, false, 1.0, 0.0);
                CHECK_OK(loxo_polygon_close(test_context, &b.p, NULL, b.out, b.report, b.w, NULL));
                CHECK_OK(loxo_polygon_close(test_context, &b.p, NULL, NULL, report, w, NULL));
                for (int i = 0; i < 11 * d; ++i)
                    CHECK_NEAR(w[i], b.w[i], 1e-14);
                for (int i = 0; i < 11; ++i)
                    CHECK(report[i].state == LOXO_POLYGON_CLOSED && report[i].bound < 1e-9);
                batch_free(test_context, &b);
            }
}

/* The bound that a tolerance asks for is above the distance that is left, by the barycenter of the closed edges. */
TEST(bounds_hold)
{
    for (int e = 2; e <= 12; e += 2) {
        batch b = batch_make(test_context, 40, 16, 3, LOXO_POLYGON_EDGES);
        loxo_polygon_settings settings = loxo_polygon_settings_default();
        settings.edges = true;
        settings.tolerance = pow(10.0, -e);
        batch_fill(&b, 29, 0.2, true, 1.0, 0.0);
        CHECK_OK(loxo_polygon_close(test_context, &b.p, &settings, b.out, b.report, b.w, NULL));
        for (int64_t i = 0; i < 40; ++i) {
            loxo_barycenter_info info;
            double unit[48];
            for (int64_t j = 0; j < 16; ++j)
                for (int k = 0; k < 3; ++k) {
                    const double *y = b.out + (i * 16 + j) * 3;
                    unit[3 * j + k] = y[k] / sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2]);
                }
            CHECK_OK(loxo_barycenter(test_context, &(loxo_atoms){.n = 16, .d = 3, .x = unit}, NULL, &info));
            CHECK(b.report[i].bound <= settings.tolerance);
            CHECK(info.radius <= b.report[i].bound + info.bound);
        }
        batch_free(test_context, &b);
    }
}

TEST(states_of_single_polygons)
{
    static const struct {
        const char *what;
        int n;
        double e[5][2];
        loxo_polygon_state state;
    } cases[] = {
        {"one edge", 1, {{1, 0}}, LOXO_POLYGON_CANNOT},
        {"to and fro", 2, {{2, 0}, {-2, 0}}, LOXO_POLYGON_FLAT},
        {"two of one length", 2, {{2, 0}, {0, 2}}, LOXO_POLYGON_FLAT},
        {"two of different length", 2, {{2, 0}, {0, 3}}, LOXO_POLYGON_CANNOT},
        {"a long edge", 4, {{5, 0}, {0, 1}, {1, 0}, {0, -1}}, LOXO_POLYGON_CANNOT},
        {"all in one direction", 5, {{1, 1}, {2, 2}, {1, 1}, {1, 1}, {1, 1}}, LOXO_POLYGON_CANNOT},
        {"three in one direction", 5, {{1, 1}, {1, 1}, {1, 1}, {1, 0}, {0, 1}}, LOXO_POLYGON_CANNOT},
        {"half in each of two", 4, {{1, 1}, {2, 2}, {0, 3.0 * 1.4142135623730951}, {0, 0}}, LOXO_POLYGON_FLAT},
        {"a triangle", 3, {{1, 0}, {0, 1}, {-1, -1}}, LOXO_POLYGON_CLOSED},
        {"an edge of no length", 4, {{1, 0}, {0, 1}, {0, 0}, {1, -1}}, LOXO_POLYGON_CLOSED},
        {"no length at all", 3, {{0, 0}, {0, 0}, {0, 0}}, LOXO_POLYGON_BAD},
        {"not a number", 3, {{1, 0}, {0, (double)NAN}, {1, 1}}, LOXO_POLYGON_BAD},
        {"infinite", 3, {{1, 0}, {0, HUGE_VAL}, {1, 1}}, LOXO_POLYGON_BAD},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i)
        for (int form = LOXO_POLYGON_VERTICES; form <= LOXO_POLYGON_EDGES; ++form) {
            double x[12] = {0}, out[10], w[2];
            const loxo_polygons p = {
                .n_polygons = 1, .n_edges = cases[i].n, .d = 2, .form = (loxo_polygon_form)form, .x = x};
            loxo_polygon_report r;
            loxo_polygon_info info;
            for (int j = 0; j < cases[i].n; ++j)
                for (int k = 0; k < 2; ++k)
                    x[form == LOXO_POLYGON_VERTICES ? 2 * (j + 1) + k : 2 * j + k] =
                        cases[i].e[j][k] + (form == LOXO_POLYGON_VERTICES ? x[2 * j + k] : 0.0);
            const bool is_good = cases[i].state <= LOXO_POLYGON_FLAT;
            const loxo_status status = loxo_polygon_close(test_context, &p, NULL, out, &r, w, &info);
            /* sums of vertices round: what is half of the length to the last bit as edges is so nearly as vertices */
            if (r.state != cases[i].state && !(form == LOXO_POLYGON_VERTICES && cases[i].state == LOXO_POLYGON_FLAT))
                print_error("%s, form %d: %s\n", cases[i].what, form, loxo_polygon_state_name(r.state));
            if (form == LOXO_POLYGON_EDGES || cases[i].state != LOXO_POLYGON_FLAT) {
                CHECK_EQUAL(r.state, cases[i].state);
                CHECK_EQUAL(status, is_good ? LOXO_OK : LOXO_CHECK_FAILED);
                CHECK_EQUAL(info.first_failed, is_good ? -1 : 0);
            }
            for (int k = 0; k < 2 * cases[i].n; ++k)
                CHECK(isfinite(out[k]));
            CHECK(isfinite(w[0]) && isfinite(w[1]) && isfinite(r.gap) && isfinite(r.length) && isfinite(r.co));
            if (is_good) CHECK(r.gap <= 1e-15 * r.length);
            if (cases[i].state == LOXO_POLYGON_CANNOT && form == LOXO_POLYGON_EDGES) { /* as given */
                double at[2] = {0};
                for (int j = 0; j < cases[i].n; ++j)
                    for (int k = 0; k < 2; ++k) {
                        CHECK_NEAR(out[2 * j + k], at[k], 4e-15);
                        at[k] += cases[i].e[j][k];
                    }
            }
        }
}

/* One bad polygon, one that cannot: the others do not mind. */
TEST(neighbours_do_not_matter)
{
    enum { N = 20, M = 12 };
    batch a = batch_make(test_context, M, N, 3, LOXO_POLYGON_EDGES),
          b = batch_make(test_context, M, N, 3, LOXO_POLYGON_EDGES);
    loxo_polygon_info info;
    batch_fill(&a, 2, 0.2, false, 1.0, 0.0);
    batch_fill(&b, 2, 0.2, false, 1.0, 0.0);
    b.x[3 * N * 2 + 4] = (double)NAN;
    b.x[3 * N * 9 + 1] = 1e6;
    CHECK_OK(loxo_polygon_close(test_context, &a.p, NULL, a.out, a.report, a.w, NULL));
    CHECK_STATUS(test_context, loxo_polygon_close(test_context, &b.p, NULL, b.out, b.report, b.w, &info),
                 LOXO_CHECK_FAILED);
    CHECK(info.n_bad == 1 && info.n_cannot == 1 && info.n_closed == M - 2 && info.first_failed == 2 &&
          info.n_left == 0);
    for (int64_t i = 0; i < M; ++i)
        if (i != 2 && i != 9) CHECK(memcmp(a.out + i * 3 * N, b.out + i * 3 * N, 3 * N * sizeof *a.out) == 0);
    batch_free(test_context, &a);
    batch_free(test_context, &b);
}

static uint64_t hash_of_batch(loxo_context *ctx, const void *arg)
{
    const int64_t *how = arg; /* polygons, edges, dimension, form */
    batch b = batch_make(ctx, how[0], how[1], (int)how[2], (loxo_polygon_form)how[3]);
    batch_fill(&b, 19, 0.3, how[3] == LOXO_POLYGON_DIRECTIONS, 1.0, 0.0);
    CHECK_STATUS(ctx, loxo_polygon_close(ctx, &b.p, NULL, b.out, b.report, b.w, NULL), LOXO_OK);
    uint64_t hash = test_hash(b.out, (size_t)(how[0] * how[1] * how[2]) * sizeof *b.out);
    for (int64_t i = 0; i < how[0]; ++i)
        hash = hash * 31 + test_hash(&b.report[i].bound, sizeof(double)) + test_hash(&b.report[i].gap, sizeof(double));
    batch_free(ctx, &b);
    return hash;
}

TEST(the_same_bits_for_threads_and_instruction_sets)
{
    static const int64_t cases[][4] = {
        {1003, 37, 3, 0}, {500, 64, 2, 1}, {300, 101, 3, 2}, {3, 5000, 3, 1}, {40, 33, 4, 0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        uint64_t first = 0;
        test_same_for_any_threads(hash_of_batch, cases[i]);
        for (int isa = LOXO_ISA_BASELINE; isa <= LOXO_ISA_AVX512; ++isa) {
            loxo_context_settings settings = loxo_context_settings_default();
            loxo_context *ctx;
            settings.isa = (loxo_isa)isa;
            if (loxo_context_create(&settings, &ctx) != LOXO_OK) continue; /* not of this processor */
            const uint64_t hash = hash_of_batch(ctx, cases[i]);
            if (first == 0) first = hash;
            CHECK(hash == first);
            loxo_context_destroy(ctx);
        }
    }
}

TEST(bad_calls)
{
    double x[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, -1, 0, 0}, out[12], length[4] = {1, 1, 1, 1};
    const loxo_polygons good = {
        .n_polygons = 1, .n_edges = 4, .d = 3, .form = LOXO_POLYGON_DIRECTIONS, .x = x, .length = length};
    loxo_polygons p = good;
    loxo_polygon_settings settings = loxo_polygon_settings_default();
    CHECK_OK(loxo_polygon_close(test_context, &p, NULL, out, NULL, NULL, NULL));
#define REFUSED(p, out)                                                                                                \
    CHECK_STATUS(test_context, loxo_polygon_close(test_context, p, NULL, out, NULL, NULL, NULL), LOXO_ERR_ARGUMENT)
    REFUSED(NULL, out);
    REFUSED(&p, NULL); /* and no reports, no barycenters */
    p.d = 1;
    REFUSED(&p, out);
    p.d = 65;
    REFUSED(&p, out);
    p = good;
    p.n_edges = 0;
    REFUSED(&p, out);
    p = good;
    p.n_polygons = -1;
    REFUSED(&p, out);
    p = good;
    p.form = (loxo_polygon_form)7;
    REFUSED(&p, out);
    p = good;
    p.x = NULL;
    REFUSED(&p, out);
    p = good;
    length[2] = -1.0;
    REFUSED(&p, out);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 2);
    length[2] = (double)NAN;
    REFUSED(&p, out);
    length[2] = 1.0;
    p.n_polygons = INT64_MAX / 16;
    CHECK_STATUS(test_context, loxo_polygon_close(test_context, &p, NULL, out, NULL, NULL, NULL), LOXO_ERR_LIMIT);
    settings.tolerance = -1.0;
    CHECK_STATUS(test_context, loxo_polygon_close(test_context, &good, &settings, out, NULL, NULL, NULL),
                 LOXO_ERR_ARGUMENT);
    p = good;
    p.n_polygons = 0;
    CHECK_OK(loxo_polygon_close(test_context, &p, NULL, out, NULL, NULL, NULL));
    /* directions that are none */
    loxo_polygon_report r;
    x[4] = 1.1;
    CHECK_STATUS(test_context, loxo_polygon_close(test_context, &good, NULL, out, &r, NULL, NULL), LOXO_CHECK_FAILED);
    CHECK_EQUAL(r.state, LOXO_POLYGON_BAD);
    /* a tolerance that doubles do not certify */
    settings = loxo_polygon_settings_default();
    settings.tolerance = 1e-300;
    x[4] = 1.0;
    CHECK_STATUS(test_context, loxo_polygon_close(test_context, &good, &settings, out, &r, NULL, NULL),
                 LOXO_NOT_CONVERGED);
    CHECK_EQUAL(r.state, LOXO_POLYGON_LOOSE);
    CHECK(r.gap <= 1e-15);
}

/* Too few iterations: the state says so, and lengths are what they were. */
TEST(iterations_used_up)
{
    for (int d = 2; d <= 4; ++d)
        for (int most = 0; most < 2; ++most) {
            batch b = batch_make(test_context, 9, 30, d, LOXO_POLYGON_EDGES);
            loxo_polygon_settings settings = loxo_polygon_settings_default();
            loxo_polygon_info info;
            settings.max_iterations = most;
            settings.edges = true;
            batch_fill(&b, 6, 1.0, false, 1.0, 0.0);
            CHECK_STATUS(test_context, loxo_polygon_close(test_context, &b.p, &settings, b.out, b.report, b.w, &info),
                         LOXO_NOT_CONVERGED);
            CHECK_EQUAL(info.n_loose, 9);
            for (int64_t i = 0; i < 9; ++i) {
                CHECK(b.report[i].gap > 1e-3 * b.report[i].length);
                for (int64_t j = 0; j < 30; ++j) {
                    double length = 0.0;
                    for (int k = 0; k < d; ++k)
                        length = hypot(length, b.out[(i * 30 + j) * d + k]);
                    CHECK_NEAR(length, (double)given_length(&b, i, j), 4e-15);
                }
            }
            settings.edges = false;
            CHECK_STATUS(test_context, loxo_polygon_close(test_context, &b.p, &settings, b.out, b.report, b.w, NULL),
                         LOXO_NOT_CONVERGED);
            for (int64_t i = 0; i < 9; ++i) {
                double length = 0.0;
                for (int k = 0; k < d; ++k)
                    length = hypot(length, b.out[(i * 30 + 1) * d + k] - b.out[i * 30 * d + k]);
                CHECK_NEAR(length, (double)given_length(&b, i, 0), 4e-15);
            }
            batch_free(test_context, &b);
        }
}

static loxo_status close_without_reports(loxo_context *ctx, void *arg)
{
    const batch *b = arg;
    return loxo_polygon_close(ctx, &b->p, NULL, b->out, NULL, NULL, NULL);
}

TEST(each_allocation_fails)
{
    for (int k = 0; k < 2; ++k) {
        batch b = batch_make(test_context, 3, 40, k == 0 ? 3 : 4, LOXO_POLYGON_EDGES);
        batch_fill(&b, 1, k == 0 ? 0.1 : 30.0, false, 1.0, 0.0);
        CHECK(test_each_allocation_fails(close_without_reports, &b) >= 4);
        batch_free(test_context, &b);
    }
}

TEST(the_monitor_stops_it)
{
    batch b = batch_make(test_context, 4000, 1000, 2, LOXO_POLYGON_EDGES);
    loxo_polygon_info info;
    stopper stop;
    batch_fill(&b, 1, 0.1, true, 1.0, 0.0);
    stopper_begin(&stop, test_context, 2);
    CHECK_STATUS(test_context, loxo_polygon_close(test_context, &b.p, NULL, b.out, b.report, NULL, &info),
                 LOXO_STOPPED);
    stopper_end(&stop);
    CHECK(info.n_closed > 0 && info.n_left > 0 && info.n_closed + info.n_left == 4000);
    CHECK_EQUAL(b.report[0].state, LOXO_POLYGON_CLOSED);
    CHECK_EQUAL(b.report[3999].state, LOXO_POLYGON_LEFT);
    batch_free(test_context, &b);
}
