/* SPDX-License-Identifier: MIT
 * Registration: a surface to itself, however it is turned and numbered, is the identity; the best rotation; what lambda does; curves cut to
 * length; bad input. */
#include "base/context.h"
#include "kernel/vec3.h"
#include "solver/sphere/hbtr_internal.h"
#include "surfaces.h"

#include <loxo/io.h>
#include <loxo/register.h>

#define N_VERTICES 1500

static const double turn[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0.0}, {0.48, 0.64, 0.6}};

static void turn_points(int64_t n, double *x)
{
    for (int64_t i = 0; i < n; ++i) {
        const loxo_vec3 p = v3_load(&x[3 * i]);
        for (int k = 0; k < 3; ++k)
            x[3 * i + k] = v3_dot(v3_load(turn[k]), p);
    }
}

static surface folded_make(loxo_context *ctx, int64_t n) { return surface_make(ctx, LOXO_SHAPE_BRAIN, n, 0.1); }

/* The same triangulation, bent and stretched. */
static surface bent_make(loxo_context *ctx, int64_t n)
{
    loxo_soup soup = soup_make(ctx, LOXO_SHAPE_BRAIN, n, 0.1);
    for (int64_t v = 0; v < soup.n_vertices; ++v) {
        double *x = &soup.position[3 * v];
        x[2] += 0.2 * sin(2.0 * x[0]);
        x[0] = 1.3 * x[0] + 0.15 * x[1] * x[1];
        x[1] *= 0.9;
    }
    return surface_from_soup(ctx, soup, LOXO_ORDER_AUTO);
}

/* Two curves and a point of vertices, far apart. */
static loxo_landmarks landmarks_make(loxo_context *ctx, const surface *s)
{
    static const double pole[2][3] = {{0.0, 0.0, 1.0}, {0.8, -0.6, 0.0}};
    const char *text = "p,0\n";
    loxo_landmarks l = {0};
    FILE *file = fopen(test_scratch("landmarks.csv"), "w");
    CHECK(file != NULL);
    fputs(text, file);
    for (int c = 0; c < 2; ++c)
        for (int i = 0; i < 8; ++i) { /* vertices nearest to points of a small circle */
            const double t = 0.5 * i, r = 0.5;
            const loxo_vec3 up = v3_load(pole[c]), side = {-up.z, 0.0, up.x};
            const loxo_vec3 across = v3_cross(up, side);
            loxo_vec3 q = v3_axpy(v3_axpy(v3_scale(sqrt(1.0 - r * r), up), r * cos(t), side), r * sin(t), across);
            int64_t best = 0;
            for (int64_t v = 0; v < s->soup.n_vertices; ++v) {
                const loxo_vec3 x = v3_load(&s->soup.position[3 * v]), y = v3_load(&s->soup.position[3 * best]);
                if (v3_dot(x, q) / v3_norm(x) > v3_dot(y, q) / v3_norm(y)) best = v;
            }
            fprintf(file, "c%d,%d\n", c, (int)best);
        }
    CHECK(fclose(file) == 0);
    CHECK_STATUS(ctx, loxo_read_landmarks(ctx, test_scratch("landmarks.csv"), s->soup.n_vertices, &l), LOXO_OK);
    return l;
}

/* What a registration gives. */
typedef struct result {
    double *map, *position, *fixed_map;
    loxo_surface_point *point;
    loxo_register_info info;
} result;

static result run(const surface *fixed, const loxo_landmarks *a, const surface *moving, const loxo_landmarks *b,
                  double lambda, int64_t n_samples)
{
    loxo_context *ctx = fixed->ctx;
    const int64_t n = moving->soup.n_vertices, n_fixed = fixed->soup.n_vertices;
    loxo_register_settings settings = loxo_register_settings_default();
    loxo_register *registration = NULL;
    result r = {.map = loxo_allocate(ctx, 3 * n, sizeof(double)),
                .position = loxo_allocate(ctx, 3 * n, sizeof(double)),
                .fixed_map = loxo_allocate(ctx, 3 * n_fixed, sizeof(double)),
                .point = loxo_allocate(ctx, n, sizeof *r.point)};
    settings.lambda = lambda;
    settings.n_samples = n_samples;
    CHECK_STATUS(ctx, loxo_register_create(ctx, fixed->mesh, a, &settings, NULL, &registration), LOXO_OK);
    memcpy(r.fixed_map, loxo_register_fixed_map(registration), (size_t)(3 * n_fixed) * sizeof(double));
    CHECK_STATUS(ctx, loxo_register_solve(registration, moving->mesh, b, r.map, r.point, r.position, &r.info), LOXO_OK);
    loxo_register_destroy(registration);
    return r;
}

static void result_free(loxo_context *ctx, result *r)
{
    loxo_release(ctx, r->map);
    loxo_release(ctx, r->position);
    loxo_release(ctx, r->fixed_map);
    loxo_release(ctx, r->point);
}

static double farthest(int64_t n, const double *a, const double *b)
{
    double most = 0.0;
    for (int64_t i = 0; i < 3 * n; ++i)
        most = fmax(most, fabs(a[i] - b[i]));
    return most;
}

/* ---- the best rotation ----------------------------------------------------------------------------------------- */

/* Of several that are as good the one that turns least. Of one point that stays, no turn; of one that goes across, half a turn; of
 * none, no turn. */
TEST(rotations_of_few_points)
{
    double r[3][3];
    static const double one[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    double stays[3][3] = {{0.0}};
    stays[2][2] = 1.0;
    sphere_find_rotation((const double(*)[3])stays, r);
    for (int a = 0; a < 3; ++a)
        CHECK_NEAR3(r[a], one[a], 1e-14);
    double across[3][3] = {{0.0}};
    across[2][2] = -1.0;
    sphere_find_rotation((const double(*)[3])across, r);
    CHECK_NEAR(r[2][2], -1.0, 1e-14);
    CHECK_NEAR(v3_dot(v3_load(r[0]), v3_cross(v3_load(r[1]), v3_load(r[2]))), 1.0, 1e-14);
    double none[3][3] = {{0.0}};
    sphere_find_rotation((const double(*)[3])none, r);
    for (int a = 0; a < 3; ++a)
        CHECK_NEAR3(r[a], one[a], 1e-15);
}

/* ---- registrations ----------------------------------------------------------------------------------------------- */

/* f_0 is where E_C is least among centred maps, and E_reg is 0 there: the identity is a registration, for any lambda. The map of the turned
 * surface is found anew; both are good to the tolerance of 1e-9 over the least eigenvalue, about 1e-3. */
TEST(a_surface_to_itself_is_the_identity)
{
    surface fixed = folded_make(test_context, N_VERTICES), moving = folded_make(test_context, N_VERTICES);
    const int64_t n = fixed.soup.n_vertices;
    loxo_landmarks l = landmarks_make(test_context, &fixed);
    turn_points(n, moving.soup.position);
    loxo_mesh_destroy(moving.mesh);
    loxo_mesh_settings settings = loxo_mesh_settings_default();
    settings.order = LOXO_ORDER_HILBERT;
    CHECK_OK(loxo_mesh_create(test_context, &moving.arrays, LOXO_COPY, &settings, NULL, &moving.mesh));
    result r = run(&fixed, &l, &moving, &l, 5.0, 0);
    CHECK_NEAR(farthest(n, r.map, r.fixed_map), 0.0, 1e-5);
    CHECK_NEAR(farthest(n, r.position, fixed.soup.position), 0.0, 1e-4);
    CHECK(r.info.loss < 1e-10 && r.info.n_folds == 0 && r.info.degree == 1 && r.info.n_outside == 0);
    CHECK_EQUAL(r.info.n_landmarks, 17);
    CHECK_EQUAL(r.info.n_curves, 3);
    CHECK_NEAR(r.info.energy, r.info.moving.objective, 1e-6);
    result_free(test_context, &r);
    loxo_landmarks_destroy(test_context, &l);
    surface_destroy(&moving);
    surface_destroy(&fixed);
}

/* A minimum of E_C + lambda E_reg has less E_reg and more E_C the greater lambda is: add the two inequalities that say that each is the
 * least for its own. That holds of global minima; here the steps start at one map and end in the same valley. */
TEST(lambda_trades_energy_for_loss)
{
    static const double lambdas[] = {0.0, 1.0, 10.0, 100.0};
    surface fixed = folded_make(test_context, N_VERTICES), moving = bent_make(test_context, N_VERTICES);
    loxo_landmarks l = landmarks_make(test_context, &fixed);
    double energy = 0.0, loss = HUGE_VAL, worst = 0.0;
    for (int i = 0; i < 4; ++i) {
        result r = run(&fixed, &l, &moving, &l, lambdas[i], 0);
        CHECK(r.info.n_folds == 0 && r.info.degree == 1);
        CHECK(r.info.loss < loss && r.info.energy > energy - 1e-12);
        CHECK_NEAR(r.info.objective, r.info.energy + lambdas[i] * r.info.loss, 1e-15);
        CHECK(r.info.objective <= r.info.energy_start + lambdas[i] * r.info.loss_start + 1e-12);
        if (i == 0) CHECK(r.info.n_iterations == 0 && r.info.loss == r.info.loss_start);
        loss = r.info.loss;
        energy = r.info.energy;
        worst = fmax(worst, r.info.landmark_max);
        /* the points are where the map says */
        loxo_sphere_locator *locator = NULL;
        loxo_surface_point *again = loxo_allocate(test_context, moving.soup.n_vertices, sizeof *again);
        CHECK_OK(loxo_sphere_locator_create(test_context, fixed.mesh, r.fixed_map, &locator));
        CHECK_OK(loxo_sphere_locate(locator, moving.soup.n_vertices, r.map, again, NULL));
        for (int64_t v = 0; v < moving.soup.n_vertices; ++v)
            for (int k = 0; k < 3; ++k)
                CHECK(again[v].vertex[k] == r.point[v].vertex[k] && again[v].weight[k] == r.point[v].weight[k]);
        loxo_sphere_locator_destroy(locator);
        loxo_release(test_context, again);
        result_free(test_context, &r);
    }
    CHECK(worst > 0.0 && worst < 1.0);
    loxo_landmarks_destroy(test_context, &l);
    surface_destroy(&moving);
    surface_destroy(&fixed);
}

/* Of the same curve with every other point left out, cut to the same number of points evenly in length, the registration hardly differs from
 * the identity: by less than the curves do from arcs. */
TEST(curves_of_other_points_are_cut_to_length)
{
    surface s = folded_make(test_context, N_VERTICES);
    loxo_landmarks l = landmarks_make(test_context, &s), half = landmarks_make(test_context, &s);
    half.curve_begin[2] = 1 + 4;
    for (int64_t i = 0; i < 4; ++i)
        half.point[1 + i] = half.point[1 + 2 * i + i / 3]; /* 0, 2, 4, 7: both ends */
    memmove(&half.point[5], &half.point[9], 8 * sizeof *half.point);
    half.curve_begin[3] = half.n_points = 13;
    result r = run(&s, &l, &s, &half, 5.0, 0);
    CHECK_EQUAL(r.info.n_landmarks, 17);
    CHECK(r.info.loss > 0.0 && r.info.loss < 1e-2);
    CHECK(r.info.n_folds == 0 && r.info.degree == 1);
    result_free(test_context, &r);
    r = run(&s, &l, &s, &l, 5.0, 50); /* both cut anew: the identity again */
    CHECK_EQUAL(r.info.n_landmarks, 101);
    CHECK_NEAR(farthest(s.soup.n_vertices, r.map, r.fixed_map), 0.0, 1e-6);
    result_free(test_context, &r);
    loxo_landmarks_destroy(test_context, &half);
    loxo_landmarks_destroy(test_context, &l);
    surface_destroy(&s);
}

TEST(closed_curves)
{
    surface s = folded_make(test_context, N_VERTICES);
    loxo_landmarks l = landmarks_make(test_context, &s);
    l.is_closed[1] = true;
    result r = run(&s, &l, &s, &l, 5.0, 20);
    CHECK_NEAR(farthest(s.soup.n_vertices, r.map, r.fixed_map), 0.0, 1e-6);
    result_free(test_context, &r);
    loxo_landmarks_destroy(test_context, &l);
    surface_destroy(&s);
}

/* ---- what is refused --------------------------------------------------------------------------------------------- */

static loxo_status create_one(const surface *s, const loxo_landmarks *l, const loxo_register_settings *settings)
{
    loxo_register *registration = NULL;
    const loxo_status status = loxo_register_create(test_context, s->mesh, l, settings, NULL, &registration);
    CHECK((status >= 0) == (registration != NULL));
    loxo_register_destroy(registration);
    return status;
}

TEST(bad_input_is_named)
{
    surface s = folded_make(test_context, 200), torus = surface_make(test_context, LOXO_SHAPE_TORUS, 200, NAN);
    loxo_landmarks l = landmarks_make(test_context, &s), none = {0}, other = landmarks_make(test_context, &s);
    loxo_register_settings settings = loxo_register_settings_default();
    double *map = loxo_allocate(test_context, 3 * s.soup.n_vertices, sizeof *map);
    loxo_register *r = NULL;
    settings.lambda = -1.0;
    CHECK_STATUS(test_context, create_one(&s, &l, &settings), LOXO_ERR_ARGUMENT);
    settings.lambda = NAN;
    CHECK_STATUS(test_context, create_one(&s, &l, &settings), LOXO_ERR_ARGUMENT);
    settings.lambda = 1.0;
    settings.n_samples = -1;
    CHECK_STATUS(test_context, create_one(&s, &l, &settings), LOXO_ERR_ARGUMENT);
    settings.n_samples = 0;
    settings.sphere.tolerance = -1.0;
    CHECK_STATUS(test_context, create_one(&s, &l, &settings), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, create_one(&s, &none, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, create_one(&s, NULL, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, create_one(&torus, &l, NULL), LOXO_ERR_MESH);
    CHECK_STATUS(test_context, loxo_register_create(test_context, NULL, &l, NULL, NULL, &r), LOXO_ERR_ARGUMENT);
    other.point[3].vertex[0] = (loxo_index)s.soup.n_vertices;
    CHECK_STATUS(test_context, create_one(&s, &other, NULL), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 3);
    other.point[3].vertex[0] = 3;
    CHECK_OK(loxo_register_create(test_context, s.mesh, &l, NULL, NULL, &r));
#define SOLVE(landmarks) loxo_register_solve(r, s.mesh, landmarks, map, NULL, NULL, NULL)
    CHECK_STATUS(test_context, SOLVE(NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, SOLVE(&none), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_register_solve(r, NULL, &l, map, NULL, NULL, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_register_solve(r, s.mesh, &l, NULL, NULL, NULL, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_register_solve(NULL, s.mesh, &l, map, NULL, NULL, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_register_solve(r, torus.mesh, &l, map, NULL, NULL, NULL), LOXO_ERR_MESH);
    other.is_closed[1] = true; /* of open curves there */
    CHECK_STATUS(test_context, SOLVE(&other), LOXO_ERR_ARGUMENT);
    other.is_closed[1] = false;
    memcpy(other.name[0], "c0", 3); /* a curve there, a point here */
    memcpy(other.name[1], "c1", 3);
    CHECK_STATUS(test_context, SOLVE(&other), LOXO_ERR_ARGUMENT);
    for (int i = 0; i < 3; ++i)
        memcpy(other.name[i], "x", 2);
    CHECK_STATUS(test_context, SOLVE(&other), LOXO_ERR_ARGUMENT);
    memcpy(other.name[0], "p", 2); /* one pair is enough, with a warning of the others: two here and two there */
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 0);
    CHECK_OK(SOLVE(&other));
    CHECK_EQUAL(loxo_context_warning(test_context, 0)->count, 4);
    loxo_register_destroy(r);
    loxo_register_destroy(NULL);
    CHECK(loxo_register_fixed_map(NULL) == NULL);
    loxo_release(test_context, map);
    loxo_landmarks_destroy(test_context, &other);
    loxo_landmarks_destroy(test_context, &l);
    surface_destroy(&torus);
    surface_destroy(&s);
}

typedef struct two_surfaces {
    surface fixed, moving;
    loxo_landmarks landmarks;
} two_surfaces;

static loxo_status register_two(loxo_context *ctx, void *arg)
{
    two_surfaces *t = arg;
    double *map = loxo_allocate(t->fixed.ctx, 3 * t->moving.soup.n_vertices, sizeof *map);
    loxo_register *r = NULL;
    loxo_status status = loxo_register_create(ctx, t->fixed.mesh, &t->landmarks, NULL, NULL, &r);
    if (status >= 0) status = loxo_register_solve(r, t->moving.mesh, &t->landmarks, map, NULL, NULL, NULL);
    loxo_register_destroy(r);
    loxo_release(t->fixed.ctx, map);
    return status;
}

static two_surfaces two_make(loxo_context *ctx, int64_t n)
{
    two_surfaces t = {.fixed = folded_make(ctx, n), .moving = bent_make(ctx, n)};
    t.landmarks = landmarks_make(ctx, &t.fixed);
    return t;
}

static void two_destroy(loxo_context *ctx, two_surfaces *t)
{
    loxo_landmarks_destroy(ctx, &t->landmarks);
    surface_destroy(&t->moving);
    surface_destroy(&t->fixed);
}

TEST(every_allocation_may_fail)
{
    two_surfaces t = two_make(test_context, 60);
    CHECK(test_each_allocation_fails(register_two, &t) > 40);
    two_destroy(test_context, &t);
}

static uint64_t hash_of_map(loxo_context *ctx, const void *arg)
{
    (void)arg;
    two_surfaces t = two_make(ctx, 6000);
    result r = run(&t.fixed, &t.landmarks, &t.moving, &t.landmarks, 5.0, 30);
    const int64_t n = t.moving.soup.n_vertices;
    const uint64_t hash = test_hash(r.map, (size_t)(3 * n) * sizeof *r.map) ^
                          3 * test_hash(r.position, (size_t)(3 * n) * sizeof *r.position);
    result_free(ctx, &r);
    two_destroy(ctx, &t);
    return hash;
}

TEST(same_bits_for_any_threads)
{
    NEEDS_IDS(36000);
    test_same_for_any_threads(hash_of_map, NULL);
}

typedef struct count_down {
    loxo_context *ctx;
    int n_left;
} count_down;

/* Asked every 20 ms only; here the clock of the last question is turned back. */
static int stop_at_last(void *user, const loxo_progress *progress)
{
    count_down *c = user;
    (void)progress;
    c->ctx->last_progress_s = -1e9;
    return --c->n_left <= 0;
}

TEST(a_monitor_stops_it)
{
    two_surfaces t = two_make(test_context, 500);
    for (int n = 1; n < 12; n += 2) {
        count_down c = {.ctx = test_context, .n_left = n};
        loxo_context_set_monitor(test_context, stop_at_last, &c);
        loxo_progress_enter(test_context);
        test_context->last_progress_s = -1e9;
        const loxo_status status = register_two(test_context, &t);
        loxo_progress_leave(test_context);
        CHECK_EQUAL(status, c.n_left > 0 ? LOXO_OK : LOXO_ERR_STOPPED);
    }
    loxo_context_set_monitor(test_context, NULL, NULL);
    two_destroy(test_context, &t);
}
