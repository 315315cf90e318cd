/* SPDX-License-Identifier: MIT
 * Solves that end early: no memory for them, an allocation that fails, a monitor that asks for the end. What they leave
 * behind is what the header says, and the object solves again. */
#include "base/context.h"
#include "surfaces.h"

#include <loxo/geodesic.h>

TEST(limit_of_memory_is_seen_before_work)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 5000, NAN);
    const int64_t n = s.soup.n_vertices, n_faces = s.soup.n_faces;
    surface_destroy(&s);
    for (int method = 0; method < 2; ++method) {
        loxo_geodesic_settings geodesic_settings = loxo_geodesic_settings_default();
        size_t workspace_bytes = 0;
        loxo_context *ctx;
        loxo_geodesic *g;
        double solve_s = -1.0;
        geodesic_settings.method = (loxo_geodesic_method)method;
        CHECK_OK(loxo_geodesic_estimate(test_context, n, n_faces, &geodesic_settings, &workspace_bytes, &solve_s));
        CHECK(workspace_bytes > (size_t)n * 100 && workspace_bytes < (size_t)n * 400);
        CHECK(solve_s > 0.0 && solve_s < 1.0);
        CHECK_STATUS(NULL, loxo_context_create(NULL, &ctx), LOXO_OK);
        surface small = surface_make(ctx, LOXO_SHAPE_ICOSPHERE, 5000, NAN);
        ctx->limit_bytes = loxo_context_memory(ctx).current_bytes + workspace_bytes - 1;
        const size_t before_bytes = loxo_context_memory(ctx).current_bytes;
        loxo_context_reset_peak(ctx);
        CHECK_STATUS(ctx, loxo_geodesic_create(ctx, small.mesh, &geodesic_settings, &g), LOXO_ERR_MEMORY);
        CHECK(g == NULL);
        const char *needs = strstr(loxo_context_failure(ctx)->text, " needs ");
        CHECK(needs != NULL);
        CHECK_NEAR(strtod(needs + 7, NULL), (double)workspace_bytes + 128.0,
                   128.0); /* and what a block takes besides */
        CHECK_EQUAL(loxo_context_memory(ctx).current_bytes, before_bytes);
        CHECK(loxo_context_memory(ctx).peak_bytes < before_bytes + 4096); /* nothing was tried */
        surface_destroy(&small);
        loxo_context_destroy(ctx);
    }
}

TEST(estimate_is_what_is_taken)
{
    static const loxo_shape shapes[] = {LOXO_SHAPE_ICOSPHERE, LOXO_SHAPE_TORUS, LOXO_SHAPE_DISK};
    for (int i = 0; i < 3; ++i)
        for (int method = 0; method < 2; ++method) {
            surface s = surface_make(test_context, shapes[i], 2000, NAN);
            loxo_geodesic_settings settings = unjudged_settings((loxo_geodesic_method)method);
            double *distance = surface_numbers(&s);
            size_t bytes = 0;
            loxo_geodesic_info info;
            CHECK_OK(
                loxo_geodesic_distance(test_context, s.mesh, &settings, (const loxo_index[]){0}, 1, distance, &info));
            CHECK_OK(loxo_geodesic_estimate(test_context, s.soup.n_vertices, s.soup.n_faces, &settings, &bytes, NULL));
            if (shapes[i] != LOXO_SHAPE_DISK)
                CHECK_EQUAL(info.workspace_bytes, bytes);
            else /* an Euler number of 1, not 2: two edges at its boundary more than it thinks of */
                CHECK(info.workspace_bytes >= bytes && info.workspace_bytes <= bytes + 128);
            CHECK(info.peak_bytes >= info.workspace_bytes);
            loxo_release(test_context, distance);
            surface_destroy(&s);
        }
}

/* ---- allocations that fail ---- */

typedef struct attempt {
    const loxo_soup *soup; /* in another context */
    loxo_geodesic_settings settings;
    int64_t n_sources;
} attempt;

static loxo_status build_and_solve(loxo_context *ctx, void *arg)
{
    static const loxo_index sources[] = {0, 40, 80, 120};
    const attempt *a = arg;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(a->soup);
    loxo_mesh *mesh = NULL;
    loxo_geodesic *g = NULL;
    double distance[256];
    loxo_status status = loxo_mesh_create(ctx, &arrays, LOXO_COPY, NULL, NULL, &mesh);
    if (status < 0) return status;
    distance[0] = -7.0;
    status = loxo_geodesic_create(ctx, mesh, &a->settings, &g);
    if (status >= 0) {
        status = loxo_geodesic_solve(g, sources, a->n_sources, distance, NULL);
        if (status < 0) {
            test_allocator *allocator = ctx->settings.allocator.user;
            CHECK_EQUAL(distance[0], -7.0);
            allocator->fail_at = -1; /* memory is back: the object is good for another solve */
            CHECK_STATUS(ctx, loxo_geodesic_solve(g, sources, a->n_sources, distance, NULL), LOXO_OK);
            CHECK_EQUAL(distance[0], 0.0);
        }
    }
    loxo_geodesic_destroy(g);
    loxo_mesh_destroy(mesh);
    return status;
}

static void check_allocations(loxo_shape shape, double param)
{
    loxo_soup soup = soup_make(test_context, shape, 180, param);
    CHECK(soup.n_vertices <= 256);
    for (int method = 0; method < 2; ++method)
        for (int sweeps = 0; sweeps < 2; ++sweeps)
            for (int64_t n_sources = 1; n_sources <= 4; n_sources += 3) {
                attempt a = {.soup = &soup, .settings = unjudged_settings((loxo_geodesic_method)method)};
                a.n_sources = n_sources;
                a.settings.n_sweeps = 30;
                a.settings.diffusion = sweeps ? LOXO_DIFFUSION_SWEEPS : LOXO_DIFFUSION_MARCHING;
                const int64_t n = test_each_allocation_fails(build_and_solve, &a);
                print_message("%s, %s, %lld sources: %lld allocations\n", loxo_shape_name(shape), method_names[method],
                              (long long)n_sources, (long long)n);
                CHECK(n > 5);
            }
    loxo_soup_destroy(test_context, &soup);
}

TEST(each_allocation_fails_on_a_sphere) { check_allocations(LOXO_SHAPE_ICOSPHERE, NAN); }

TEST(each_allocation_fails_on_a_torus) { check_allocations(LOXO_SHAPE_TORUS, NAN); }

TEST(each_allocation_fails_on_an_annulus) { check_allocations(LOXO_SHAPE_ANNULUS, NAN); }

/* ---- monitors ---- */

/* Asks for the end at its stop_at-th call. The library asks every 20 ms only; here every question is let through: the
 * allocator, which a solve calls before it diffuses, and the monitor turn the clock of the last question back. */
typedef struct impatient {
    loxo_context *ctx;
    int n_calls, stop_at;
    char phase[32]; /* in which it asked */
} impatient;

static void turn_back(const impatient *w)
{
    if (w->ctx != NULL) w->ctx->last_progress_s = -1e9;
}

static void *impatient_allocate(void *user, size_t n_bytes)
{
    turn_back(user);
    return malloc(n_bytes);
}

static void impatient_release(void *user, void *block, size_t n_bytes)
{
    (void)n_bytes;
    turn_back(user);
    free(block);
}

static int impatient_monitor(void *user, const loxo_progress *progress)
{
    impatient *w = user;
    turn_back(w);
    CHECK(progress->fraction >= 0.0 && progress->fraction <= 1.0);
    CHECK(progress->elapsed_s >= 0.0);
    if (++w->n_calls != w->stop_at) return 0;
    snprintf(w->phase, sizeof w->phase, "%s", progress->phase);
    return 1;
}

static loxo_context *impatient_context(impatient *w, int n_threads)
{
    loxo_context_settings settings = loxo_context_settings_default();
    settings.allocator = (loxo_allocator){impatient_allocate, impatient_release, w};
    settings.n_threads = n_threads;
    *w = (impatient){0};
    CHECK_STATUS(NULL, loxo_context_create(&settings, &w->ctx), LOXO_OK);
    return w->ctx;
}

/* Stops at call after call until a solve runs through; it then must give what a solve without a monitor gives. */
static void check_stops(loxo_shape shape, int64_t n_vertices, int n_threads, loxo_geodesic_settings settings,
                        const loxo_index *sources, int64_t n_sources)
{
    impatient w;
    loxo_context *ctx = impatient_context(&w, n_threads);
    surface s = surface_make(ctx, shape, n_vertices, NAN);
    const int64_t n = s.soup.n_vertices;
    double *truth = surface_numbers(&s), *distance = surface_numbers(&s);
    int n_in_diffusion = 0, n_in_admm = 0, n_whole = 0, n_calls = 0;
    loxo_geodesic *g;
    CHECK_STATUS(ctx, loxo_geodesic_create(ctx, s.mesh, &settings, &g), LOXO_OK);
    CHECK_STATUS(ctx, loxo_geodesic_solve(g, sources, n_sources, truth, NULL), LOXO_OK);
    loxo_context_set_monitor(ctx, impatient_monitor, &w);
    for (int k = 1; n_whole == 0; k += k < 12 ? 1 : n_calls / 60 + 1) {
        loxo_geodesic_info info;
        w.n_calls = 0;
        w.stop_at = k;
        loxo_context_clear(ctx);
        for (int64_t v = 0; v < n; ++v)
            distance[v] = -7.0;
        const loxo_status status = loxo_geodesic_solve(g, sources, n_sources, distance, &info);
        n_calls = w.n_calls > n_calls ? w.n_calls : n_calls;
        if (status == LOXO_OK) {
            CHECK(w.n_calls < k);
            CHECK(memcmp(distance, truth, (size_t)n * sizeof *truth) == 0);
            ++n_whole;
        } else if (status == LOXO_ERR_STOPPED) {
            CHECK_TEXT(w.phase, "levels");
            CHECK_EQUAL(loxo_context_failure(ctx)->status, LOXO_ERR_STOPPED);
            CHECK_EQUAL(distance[0], -7.0);
        } else {
            CHECK_STATUS(ctx, status, LOXO_STOPPED);
            CHECK_EQUAL(info.stop_reason, LOXO_STOP_MONITOR);
            CHECK_EQUAL(loxo_context_failure(ctx)->status, LOXO_STOPPED);
            for (int64_t i = 0; i < n_sources; ++i)
                CHECK_EQUAL(distance[sources[i]], 0.0);
            for (int64_t v = 0; v < n; ++v)
                CHECK(isfinite(distance[v]) || distance[v] == HUGE_VAL);
            n_in_diffusion += strcmp(w.phase, "diffusion") == 0 ? 1 : 0;
            n_in_admm += strcmp(w.phase, "ADMM") == 0 ? 1 : 0;
        }
    }
    print_message("%s, %d threads: stopped %d times while diffusing, %d times in ADMM\n", loxo_shape_name(shape),
                  n_threads, n_in_diffusion, n_in_admm);
    CHECK(n_in_diffusion > 5);
    loxo_geodesic_destroy(g);
    loxo_context_set_monitor(ctx, NULL, NULL);
    loxo_release(ctx, truth);
    loxo_release(ctx, distance);
    surface_destroy(&s);
    w.ctx = NULL;
    loxo_context_destroy(ctx);
}

static const loxo_index few[] = {3, 1000, 2000};

TEST(stopped_at_any_call_edge)
{
    check_stops(LOXO_SHAPE_NOISY, 2500, 1, unjudged_settings(LOXO_GEODESIC_EDGE), few, 1);
    check_stops(LOXO_SHAPE_TORUS, 2500, 2, unjudged_settings(LOXO_GEODESIC_EDGE), few, 3);
}

TEST(stopped_at_any_call_face)
{
    check_stops(LOXO_SHAPE_TORUS, 2500, 1, unjudged_settings(LOXO_GEODESIC_FACE), few, 3);
    check_stops(LOXO_SHAPE_ANNULUS, 2500, 2, unjudged_settings(LOXO_GEODESIC_FACE), few, 1);
}

TEST(stopped_at_any_call_sweeps)
{
    loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    settings.diffusion = LOXO_DIFFUSION_SWEEPS;
    settings.n_sweeps = 10;
    check_stops(LOXO_SHAPE_ICOSPHERE, 2500, 1, settings, few, 3);
}

/* Levels of edges around a vertex, of the caller's. */
static void find_levels(const surface *s, loxo_index source, int64_t *level)
{
    const int64_t n = s->soup.n_vertices;
    bool is_new = true;
    for (int64_t v = 0; v < n; ++v)
        level[v] = v == source ? 0 : n;
    while (is_new) {
        is_new = false;
        for (int64_t h = 0; h < 3 * s->soup.n_faces; ++h) {
            const loxo_index a = s->soup.triangle[h], b = s->soup.triangle[h % 3 == 2 ? h - 2 : h + 1];
            for (int side = 0; side < 2; ++side) {
                const loxo_index from = side == 0 ? a : b, to = side == 0 ? b : a;
                if (level[from] + 1 >= level[to]) continue;
                level[to] = level[from] + 1;
                is_new = true;
            }
        }
    }
}

typedef struct heat_field {
    double *value;
    int32_t *scale;
} heat_field;

static heat_field heat_of(loxo_geodesic *g, const surface *s)
{
    heat_field f = {surface_numbers(s), loxo_allocate(s->ctx, s->soup.n_vertices, sizeof *f.scale)};
    CHECK_STATUS(s->ctx, loxo_geodesic_heat(g, f.value, f.scale), LOXO_OK);
    return f;
}

static void release_heat(const surface *s, heat_field *f)
{
    loxo_release(s->ctx, f->value);
    loxo_release(s->ctx, f->scale);
}

static bool is_same_heat(const heat_field *a, const heat_field *b, int64_t v)
{
    return a->value[v] == b->value[v] && a->scale[v] == b->scale[v];
}

/* A level needs of its own sweep only levels inside it: stopped inside a sweep, those that it has reached hold what this many whole
 * sweeps give, to the bit, and the others what one less gives. How many it has reached the updates tell. */
TEST(a_stop_inside_a_sweep)
{
    enum { N_SWEEPS = 6 };
    const loxo_index source = 3;
    impatient w;
    loxo_context *ctx = impatient_context(&w, 1);
    surface s = surface_make(ctx, LOXO_SHAPE_ICOSPHERE, 640, NAN);
    const int64_t n = s.soup.n_vertices;
    loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_FACE);
    int64_t *level = loxo_allocate(ctx, n, sizeof *level);
    double *distance = surface_numbers(&s);
    heat_field whole[N_SWEEPS + 1];
    int n_inside = 0;
    find_levels(&s, source, level);
    settings.diffusion = LOXO_DIFFUSION_SWEEPS;
    for (int k = 1; k <= N_SWEEPS; ++k) {
        loxo_geodesic *g;
        settings.n_sweeps = k;
        CHECK_STATUS(ctx, loxo_geodesic_create(ctx, s.mesh, &settings, &g), LOXO_OK);
        CHECK_STATUS(ctx, loxo_geodesic_solve(g, &source, 1, distance, NULL), LOXO_OK);
        whole[k] = heat_of(g, &s);
        loxo_geodesic_destroy(g);
    }
    loxo_geodesic *g;
    CHECK_STATUS(ctx, loxo_geodesic_create(ctx, s.mesh, &settings, &g), LOXO_OK);
    loxo_context_set_monitor(ctx, impatient_monitor, &w);
    for (int k = 1;; ++k) {
        loxo_geodesic_info info;
        w.n_calls = 0;
        w.stop_at = k;
        const loxo_status status = loxo_geodesic_solve(g, &source, 1, distance, &info);
        if (status == LOXO_OK) break;
        if (status != LOXO_STOPPED || strcmp(w.phase, "diffusion") != 0) continue;
        const int64_t n_whole = info.n_evaluations / n, n_more = info.n_evaluations % n;
        if (n_more == 0 || info.n_unreached > 0) continue; /* between sweeps, or while levels were taken in */
        heat_field stopped = heat_of(g, &s);
        int64_t n_done = 0, outermost = 0, innermost = n;
        CHECK(n_whole >= 1 && n_whole < N_SWEEPS);
        for (int64_t v = 0; v < n; ++v) {
            const bool is_after = is_same_heat(&stopped, &whole[n_whole + 1], v);
            const bool is_before = is_same_heat(&stopped, &whole[n_whole], v);
            CHECK(is_after || is_before);
            if (is_after && !is_before && level[v] > outermost) outermost = level[v];
            if (is_before && !is_after && level[v] < innermost) innermost = level[v];
        }
        for (int64_t v = 0; v < n; ++v)
            n_done += level[v] < innermost;
        CHECK(outermost < innermost);
        CHECK_EQUAL(n_done, n_more);
        release_heat(&s, &stopped);
        ++n_inside;
    }
    print_message("%d stops inside a sweep\n", n_inside);
    CHECK(n_inside > 20);
    loxo_context_set_monitor(ctx, NULL, NULL);
    loxo_geodesic_destroy(g);
    for (int k = 1; k <= N_SWEEPS; ++k)
        release_heat(&s, &whole[k]);
    loxo_release(ctx, level);
    loxo_release(ctx, distance);
    surface_destroy(&s);
    w.ctx = NULL;
    loxo_context_destroy(ctx);
}
