/* SPDX-License-Identifier: MIT
 * The solver for spherical maps, and newton: derivatives, what the map is, what does not change it, and what it refuses. */
#include "../shapes.h"
#include "optim/steihaug.h"
#include "solver/sphere/tangent.h"
#include "sphere_problem.h"

#include <loxo/io.h>
#include <loxo/sphere.h>

/* Directions of the ellipsoid's vertices, moved a little: no critical point of anything. */
static void put_rough(const sphere_problem *p, sphere_map f)
{
    for (int64_t i = 0; i < p->m.n_vertices; ++i) {
        double norm = 0.0;
        for (int k = 0; k < 3; ++k) {
            f[i][k] = p->m.position[i][k] + 0.02 * sin((double)(7 * i + k)) + (k == 2 ? 0.1 : 0.0);
            norm += f[i][k] * f[i][k];
        }
        for (int k = 0; k < 3; ++k)
            f[i][k] /= sqrt(norm);
    }
}

static void move_by(const sphere_problem *p, sphere_const_map f, const double *d, double t, sphere_map out)
{
    for (int64_t i = 0; i < p->m.n_vertices; ++i) {
        double norm = 0.0;
        for (int k = 0; k < 3; ++k) {
            out[i][k] = f[i][k] + t * d[3 * i + k];
            norm += out[i][k] * out[i][k];
        }
        for (int k = 0; k < 3; ++k)
            out[i][k] /= sqrt(norm);
    }
}

/* ---- derivatives --------------------------------------------------------------------------------------------------- */

/* Slope and curvature along a tangent direction, against central differences of the value with a step of 1e-4: they are off by its
 * square times a third or fourth derivative of about 1e2 (slope), and by rounding of 1e-15 / 1e-8 (curvature). With the gauge, and with points
 * that are pulled; the Hessian is symmetric. */
TEST(derivatives_agree_with_differences)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ELLIPSOID, 162, NAN);
    sphere_problem p = problem_make(&s);
    const int64_t n = p.m.n_vertices;
    const loxo_index vertex[2][3] = {{0, 1, 2}, {7, 8, 9}};
    const double share[2][3] = {{0.5, 0.25, 0.25}, {1.0, 0.0, 0.0}}, target[2][3] = {{0, 0, 1}, {0.6, 0.8, 0}};
    const sphere_pull pull = {.n = 2, .vertex = vertex, .share = share, .target = target, .weight = 3.0};
    sphere_map f = loxo_allocate(test_context, n, sizeof *f), g = loxo_allocate(test_context, n, sizeof *g);
    double *d = loxo_allocate(test_context, 9 * n, sizeof *d), *e = d + 3 * n, *hd = d + 6 * n;
    put_rough(&p, f);
    for (int which = 0; which < 3; ++which) {
        sphere_tangent t;
        sphere_energy energy;
        double value[3], slope, curvature, de, ed;
        const double step = 1e-4;
        p.settings.is_free = which == 1;
        CHECK_OK(sphere_tangent_create(&p, which == 2 ? &pull : NULL, (sphere_const_map)f, &t));
        CHECK_OK(sphere_tangent_go(&t, (sphere_const_map)f));
        for (int64_t i = 0; i < n; ++i)
            for (int pass = 0; pass < 2; ++pass) {
                double *v = (pass == 0 ? d : e) + 3 * i, along = 0.0;
                for (int k = 0; k < 3; ++k)
                    v[k] = cos((double)((3 + pass) * i + 2 * k));
                for (int k = 0; k < 3; ++k)
                    along += v[k] * f[i][k];
                for (int k = 0; k < 3; ++k)
                    v[k] -= along * f[i][k];
            }
        for (int k = 0; k < 3; ++k) {
            move_by(&p, (sphere_const_map)f, d, (k - 1) * step, g);
            CHECK_OK(sphere_tangent_value(&t, (sphere_const_map)g, &energy, &value[k]));
        }
        CHECK_OK(loxo_dot(test_context, 3 * n, t.gradient[0], d, &slope));
        CHECK_OK(sphere_tangent_hessian(&t, d, hd));
        CHECK_OK(loxo_dot(test_context, 3 * n, hd, d, &curvature));
        CHECK_OK(loxo_dot(test_context, 3 * n, hd, e, &de));
        CHECK_NEAR((value[2] - value[0]) / (2.0 * step), slope, 1e-5 * (1.0 + fabs(slope)));
        CHECK_NEAR((value[2] - 2.0 * value[1] + value[0]) / (step * step), curvature, 1e-5 * (1.0 + fabs(curvature)));
        CHECK_OK(sphere_tangent_hessian(&t, e, hd));
        CHECK_OK(loxo_dot(test_context, 3 * n, hd, d, &ed));
        CHECK_NEAR(de, ed, 1e-12 * (1.0 + fabs(de)));
        sphere_tangent_destroy(&t);
    }
    loxo_release(test_context, d);
    loxo_release(test_context, f);
    loxo_release(test_context, g);
    sphere_problem_destroy(&p);
    surface_destroy(&s);
}

/* ---- the map ------------------------------------------------------------------------------------------------------- */

typedef struct made_map {
    int64_t n;
    double *f; /* [n][3] */
    loxo_sphere_info info;
    loxo_status status;
} made_map;

static made_map map_surface(loxo_context *ctx, const loxo_mesh *mesh, const loxo_sphere_settings *settings,
                            const double *start)
{
    loxo_sphere *sphere;
    made_map m = {.n = loxo_mesh_n_vertices(mesh)};
    CHECK_STATUS(ctx, loxo_sphere_create(ctx, mesh, settings, &sphere), LOXO_OK);
    m.f = loxo_allocate(ctx, 3 * m.n, sizeof *m.f);
    m.status = loxo_sphere_solve(sphere, start, m.f, &m.info);
    loxo_sphere_destroy(sphere);
    return m;
}

/* Largest difference of scalar products of vertices: 0 for maps that differ by a rotation. */
static double off_by_rotation(int64_t n, const double *f, const double *g)
{
    double off = 0.0;
    for (int64_t i = 0; i < n; ++i) {
        const int64_t j = (7919 * i + 5) % n;
        double product = 0.0;
        for (int k = 0; k < 3; ++k)
            product += f[3 * i + k] * f[3 * j + k] - g[3 * i + k] * g[3 * j + k];
        off = fmax(off, fabs(product));
    }
    return off;
}

/* The sphere's map to itself is a rotation but for the mesh's size: h^2 = 5e-3. */
TEST(a_sphere_is_mapped_to_itself)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 2562, NAN);
    made_map m = map_surface(test_context, s.mesh, NULL, NULL);
    CHECK_EQUAL(m.status, LOXO_OK);
    CHECK(m.info.n_folds == 0 && m.info.degree == 1 && m.info.n_held == 0);
    CHECK(m.info.stop_reason == LOXO_SPHERE_STOP_TOLERANCE && m.info.n_iterations < 8);
    CHECK(m.info.objective >= -1e-13 && m.info.objective < 1e-6);
    const loxo_mesh_view view = loxo_mesh_get_view(s.mesh);
    double *own = loxo_allocate(test_context, 3 * m.n, sizeof *own);
    for (int64_t i = 0; i < m.n; ++i)
        for (int k = 0; k < 3; ++k)
            own[3 * (view.vertex_origin != NULL ? view.vertex_origin[i] : i) + k] = view.position[i][k];
    CHECK(off_by_rotation(m.n, m.f, own) < 5e-3);
    loxo_release(test_context, own);
    loxo_release(test_context, m.f);
    surface_destroy(&s);
}

/* E_C = O(h^2), and no more than what SCEM's map has. */
TEST(energies_of_ellipsoids_fall_as_the_square_of_the_size)
{
    static const int64_t sizes[] = {642, 2562, 10242};
    double before = 0.0;
    NEEDS_IDS((int64_t)6 * 10242);
    for (int level = 0; level < 3; ++level) {
        surface s = surface_make(test_context, LOXO_SHAPE_ELLIPSOID, sizes[level], NAN);
        loxo_sphere_settings scem = loxo_sphere_settings_default();
        scem.method = LOXO_SPHERE_SCEM;
        made_map m = map_surface(test_context, s.mesh, NULL, NULL),
                 other = map_surface(test_context, s.mesh, &scem, NULL);
        CHECK(m.status == LOXO_OK && other.status == LOXO_OK);
        CHECK(m.info.n_folds == 0 && m.info.degree == 1);
        CHECK(m.info.objective <= other.info.objective + 1e-12);
        if (level > 0) CHECK_NEAR(before / m.info.objective, 4.0, 0.25);
        before = m.info.objective;
        loxo_release(test_context, m.f);
        loxo_release(test_context, other.f);
        surface_destroy(&s);
    }
}

/* The constraint makes the map one but for a rotation, whatever it began with: each, moved by a Moebius map or made by another method. The
 * tolerance of the gradient, 1e-9, over the least eigenvalue, that of a boost, about 1. Centring again does nothing. */
TEST(any_start_leads_to_one_centred_map)
{
    surface s = surface_make(test_context, LOXO_SHAPE_BUMPY, 2562, NAN);
    made_map first = map_surface(test_context, s.mesh, NULL, NULL);
    CHECK(first.status == LOXO_OK && first.info.n_folds == 0);
    CHECK(first.info.center.barycenter.radius < 1e-9 && first.info.center.mean_before < 1e-9);
    for (int way = 0; way < 3; ++way) {
        loxo_sphere_settings settings = loxo_sphere_settings_default();
        double *start = NULL;
        settings.start = way == 0   ? LOXO_SPHERE_START_GIVEN
                         : way == 1 ? LOXO_SPHERE_START_SCEM
                                    : LOXO_SPHERE_START_CMCF;
        if (way == 0) {
            loxo_moebius boost = {.d = 3, .n_shifts = 1, .shift = {{0.3, -0.2, 0.1}}, .co = {0.86}};
            start = loxo_allocate(test_context, 3 * first.n, sizeof *start);
            CHECK_OK(loxo_moebius_map_sphere(test_context, &boost, first.n, first.f, start));
            CHECK(off_by_rotation(first.n, first.f, start) > 0.1);
        }
        made_map m = map_surface(test_context, s.mesh, &settings, start);
        CHECK(m.status == LOXO_OK && m.info.start == settings.start);
        CHECK(off_by_rotation(first.n, first.f, m.f) < 1e-7);
        CHECK_NEAR(m.info.objective, first.info.objective, 1e-12);
        loxo_release(test_context, m.f);
        loxo_release(test_context, start);
    }
    loxo_release(test_context, first.f);
    surface_destroy(&s);
}

/* Without the constraint the energy is less, and the map drifts off the centre. */
TEST(the_free_energy_is_less)
{
    surface s = surface_make(test_context, LOXO_SHAPE_BUMPY, 642, NAN);
    loxo_sphere_settings settings = loxo_sphere_settings_default();
    settings.is_free = true;
    made_map held = map_surface(test_context, s.mesh, NULL, NULL),
             m = map_surface(test_context, s.mesh, &settings, NULL);
    CHECK(m.status == LOXO_OK && m.info.residual <= settings.tolerance);
    CHECK(m.info.energy < held.info.energy);
    CHECK(m.info.center.mean_before > 1e-3 && m.info.center.mean_after < 1e-14);
    loxo_release(test_context, held.f);
    loxo_release(test_context, m.f);
    surface_destroy(&s);
}

/* Turned and a hundred times as large, and with other numbers, the surface has the same map: rounding of positions, 1e-16, times the condition of the
 * weights. */
TEST(rotation_scale_and_numbers_change_nothing)
{
    surface s = surface_make(test_context, LOXO_SHAPE_BUMPY, 2562, NAN);
    made_map m = map_surface(test_context, s.mesh, NULL, NULL);
    loxo_generate_settings settings = loxo_generate_settings_default();
    loxo_soup soup = {0};
    loxo_index *origin;
    settings.shape = LOXO_SHAPE_BUMPY;
    settings.n_vertices = 2562;
    CHECK_OK(loxo_generate(test_context, &settings, false, &soup));
    CHECK_OK(loxo_soup_shuffle(test_context, &soup, 3, &origin));
    for (int64_t i = 0; i < soup.n_vertices; ++i) {
        double *x = &soup.position[3 * i];
        const double y[3] = {60.0 * x[0] - 80.0 * x[1], 80.0 * x[0] + 60.0 * x[1], 100.0 * x[2]};
        memcpy(x, y, sizeof y);
    }
    surface other = surface_from_soup(test_context, soup, LOXO_ORDER_AUTO);
    made_map moved = map_surface(test_context, other.mesh, NULL, NULL);
    double *back = loxo_allocate(test_context, 3 * m.n, sizeof *back);
    CHECK_EQUAL(moved.n, m.n);
    for (int64_t i = 0; i < m.n; ++i)
        memcpy(&back[3 * origin[i]], &moved.f[3 * i], 3 * sizeof *back);
    CHECK_NEAR(moved.info.objective, m.info.objective, 1e-12);
    CHECK(off_by_rotation(m.n, m.f, back) < 1e-7);
    loxo_release(test_context, back);
    loxo_release(test_context, origin);
    loxo_release(test_context, moved.f);
    loxo_release(test_context, m.f);
    surface_destroy(&other);
    surface_destroy(&s);
}

/* Weights of the intrinsic triangulation: of a Delaunay mesh the same. */
TEST(intrinsic_weights)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 642, NAN);
    made_map m = map_surface(test_context, s.mesh, NULL, NULL);
    loxo_mesh *intrinsic;
    loxo_sphere *sphere;
    loxo_sphere_info info;
    double *f = loxo_allocate(test_context, 3 * m.n, sizeof *f);
    CHECK_OK(loxo_mesh_create_intrinsic(test_context, s.mesh, NULL, NULL, &intrinsic));
    CHECK_OK(loxo_sphere_create_intrinsic(test_context, s.mesh, intrinsic, NULL, &sphere));
    loxo_mesh_destroy(intrinsic);
    CHECK_OK(loxo_sphere_solve(sphere, NULL, f, &info));
    CHECK_NEAR(info.objective, m.info.objective, 1e-11);
    CHECK(off_by_rotation(m.n, m.f, f) < 1e-7);
    loxo_sphere_destroy(sphere);
    loxo_release(test_context, f);
    loxo_release(test_context, m.f);
    surface_destroy(&s);
}

/* Scans whose limbs shrink to 1e-10 of the sphere, or whose triangles are slivers: none is turned over, and the centred energy is no more than that of the
 * public program of SCEM's authors. */
TEST(hard_scans_have_no_folds)
{
    static const struct {
        const char *name;
        double energy;
    } scans[] = {{"homer6k.obj.gz", 0.77}, {"camel10k.off.gz", 1.87}, {"moai48k-slivers.ply", 8.45e-3}};
    enum { CAMEL = 1 }; /* on whose limbs no step lowers the energy before the residual does as it should */
    NEEDS_IDS(300000);
    for (size_t k = 0; k < sizeof scans / sizeof *scans; ++k) {
        char name[96];
        loxo_soup soup = {0};
        (void)snprintf(name, sizeof name, "meshes/surfaces/%s", scans[k].name);
        const char *path = test_shared(name);
        if (path == NULL) SKIP();
        CHECK_OK(loxo_read_mesh(test_context, path, NULL, &soup));
        surface s = surface_from_soup(test_context, soup, LOXO_ORDER_AUTO);
        made_map m = map_surface(test_context, s.mesh, NULL, NULL);
        CHECK(m.status == LOXO_OK || (m.status == LOXO_NOT_CONVERGED && k == CAMEL));
        CHECK(m.info.n_folds == 0 && m.info.degree == 1);
        CHECK(m.info.objective < scans[k].energy);
        loxo_release(test_context, m.f);
        surface_destroy(&s);
    }
}

static uint64_t hash_map(loxo_context *ctx, const void *arg)
{
    (void)arg;
    surface s = surface_make(ctx, LOXO_SHAPE_BUMPY, 10000, NAN);
    made_map m = map_surface(ctx, s.mesh, NULL, NULL);
    const uint64_t hash = test_hash(m.f, 3 * (size_t)m.n * sizeof *m.f);
    CHECK_EQUAL(m.status, LOXO_OK);
    loxo_release(ctx, m.f);
    surface_destroy(&s);
    return hash;
}

TEST(the_same_bits_for_any_threads)
{
    NEEDS_IDS(60000);
    test_same_for_any_threads(hash_map, NULL);
}

/* ---- what is refused, and what ends it ---------------------------------------------------------------------------- */

static void check_refused(surface *s, const char *why)
{
    loxo_sphere *sphere;
    CHECK_STATUS(s->ctx, loxo_sphere_create(s->ctx, s->mesh, NULL, &sphere), LOXO_ERR_MESH);
    CHECK(sphere == NULL);
    if (strstr(loxo_context_failure(s->ctx)->text, why) == NULL) CHECK_TEXT(loxo_context_failure(s->ctx)->text, why);
    surface_destroy(s);
}

TEST(surfaces_that_are_no_spheres_are_refused)
{
    surface s = surface_make(test_context, LOXO_SHAPE_TORUS, 400, NAN);
    check_refused(&s, "has genus 1");
    s = surface_make(test_context, LOXO_SHAPE_DISK, 400, NAN);
    check_refused(&s, "is open");
    loxo_soup two = shape_tetrahedron(test_context), one = shape_tetrahedron(test_context);
    loxo_soup both = {.n_vertices = 9, .n_faces = 8};
    both.position = loxo_allocate(test_context, 27, sizeof *both.position);
    both.triangle = loxo_allocate(test_context, 24, sizeof *both.triangle);
    for (int64_t i = 0; i < 27; ++i)
        both.position[i] = i < 12 ? one.position[i] : i < 24 ? two.position[i - 12] + 5.0 : 9.0;
    for (int64_t i = 0; i < 24; ++i)
        both.triangle[i] = i < 12 ? one.triangle[i] : (loxo_index)(two.triangle[i - 12] + 4);
    surface pieces = surface_from_soup(test_context, both, LOXO_ORDER_AUTO);
    check_refused(&pieces, "has 2 pieces");
    loxo_soup_destroy(test_context, &two);
    /* a vertex that no face has */
    loxo_soup bare = {.n_vertices = 5, .n_faces = 4, .triangle = one.triangle};
    bare.position = loxo_allocate(test_context, 15, sizeof *bare.position);
    for (int64_t i = 0; i < 15; ++i)
        bare.position[i] = i < 12 ? one.position[i] : 3.0;
    one.triangle = NULL;
    loxo_soup_destroy(test_context, &one);
    pieces = surface_from_soup(test_context, bare, LOXO_ORDER_AUTO);
    check_refused(&pieces, "belong to no face");
}

TEST(bad_arguments)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 162, NAN);
    loxo_sphere_settings settings = loxo_sphere_settings_default();
    loxo_sphere *sphere;
    size_t bytes;
    double f[3 * 162], start[3 * 162];
    settings.tolerance = NAN;
    CHECK_STATUS(test_context, loxo_sphere_create(test_context, s.mesh, &settings, &sphere), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_sphere_create(test_context, NULL, NULL, &sphere), LOXO_ERR_ARGUMENT);
    settings = loxo_sphere_settings_default();
    settings.start = LOXO_SPHERE_START_GIVEN;
    CHECK_OK(loxo_sphere_create(test_context, s.mesh, &settings, &sphere));
    CHECK_STATUS(test_context, loxo_sphere_solve(sphere, NULL, f, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_sphere_solve(sphere, start, NULL, NULL), LOXO_ERR_ARGUMENT);
    for (int i = 0; i < 3 * 162; ++i)
        start[i] = i / 3 == 17 ? 0.0 : 1.0 + i;
    CHECK_STATUS(test_context, loxo_sphere_solve(sphere, start, f, NULL), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 17);
    CHECK_STATUS(test_context, loxo_sphere_estimate(test_context, -1, 0, NULL, &bytes), LOXO_ERR_ARGUMENT);
    loxo_sphere_destroy(sphere);
    loxo_sphere_destroy(NULL);
    CHECK_TEXT(loxo_sphere_method_name((loxo_sphere_method)99), "unknown");
    surface_destroy(&s);
}

/* What is estimated holds, and is no third too much. */
TEST(the_estimate_holds)
{
    surface s = surface_make(test_context, LOXO_SHAPE_BUMPY, 5000, NAN);
    const size_t before = loxo_context_memory(test_context).current_bytes;
    made_map m = map_surface(test_context, s.mesh, NULL, NULL);
    size_t bytes;
    CHECK_OK(loxo_sphere_estimate(test_context, m.n, 2 * m.n - 4, NULL, &bytes));
    CHECK(m.info.workspace_bytes <= bytes && 3 * m.info.workspace_bytes >= 2 * bytes);
    CHECK(m.info.peak_bytes - before >= m.info.workspace_bytes);
    loxo_release(test_context, m.f);
    surface_destroy(&s);
}

typedef struct stop_at {
    int n_calls, at;
} stop_at;

static int stop(void *user, const loxo_progress *progress)
{
    stop_at *s = user;
    CHECK(progress->fraction <= 1.0);
    return ++s->n_calls == s->at;
}

/* Every question of the monitor may end it: with the map as it then is, or with none. */
TEST(a_monitor_ends_it)
{
    surface s = surface_make(test_context, LOXO_SHAPE_BUMPY, 642, NAN);
    stop_at when = {.at = -1};
    loxo_context_set_monitor(test_context, stop, &when);
    made_map m = map_surface(test_context, s.mesh, NULL, NULL);
    const int n_calls = when.n_calls;
    CHECK(m.status == LOXO_OK && n_calls >= 3);
    loxo_release(test_context, m.f);
    for (int at = 1; at <= n_calls; ++at) {
        when = (stop_at){.at = at};
        m = map_surface(test_context, s.mesh, NULL, NULL);
        CHECK(m.status == LOXO_STOPPED || m.status == LOXO_ERR_STOPPED || (m.status == LOXO_OK && when.n_calls < at));
        if (m.status == LOXO_STOPPED) CHECK_EQUAL(m.info.stop_reason, LOXO_SPHERE_STOP_MONITOR);
        loxo_release(test_context, m.f);
    }
    loxo_context_set_monitor(test_context, NULL, NULL);
    surface_destroy(&s);
}

static loxo_status map_all(loxo_context *ctx, void *arg)
{
    const loxo_soup *soup = arg;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    loxo_mesh *mesh = NULL;
    loxo_sphere *sphere = NULL;
    double *f = loxo_allocate(ctx, 3 * soup->n_vertices, sizeof *f);
    loxo_status status = f == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
    if (status >= 0) status = loxo_mesh_create(ctx, &arrays, LOXO_BORROW, NULL, NULL, &mesh);
    if (status >= 0) status = loxo_sphere_create(ctx, mesh, NULL, &sphere);
    if (status >= 0) status = loxo_sphere_solve(sphere, NULL, f, NULL);
    loxo_sphere_destroy(sphere);
    loxo_mesh_destroy(mesh);
    loxo_release(ctx, f);
    return status;
}

TEST(every_allocation_may_fail)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    loxo_soup soup = {0};
    settings.shape = LOXO_SHAPE_BUMPY;
    settings.n_vertices = 400;
    CHECK_OK(loxo_generate(test_context, &settings, false, &soup));
    CHECK(test_each_allocation_fails(map_all, &soup) > 30);
    loxo_soup_destroy(test_context, &soup);
}
