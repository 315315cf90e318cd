/* SPDX-License-Identifier: MIT
 * The spherical maps that others have: SCEM, FLASH, conformalized mean curvature flow; and the way by the plane that the first two
 * share. */
#include "../shapes.h"
#include "algebra/cholesky.h"
#include "kernel/laplacian_kernel.h"
#include "solver/sphere/plane.h"
#include "sphere_problem.h"

#include <loxo/center.h>
#include <loxo/io.h>

#include <complex.h>

#define IMAGINARY ((double complex)I)

typedef loxo_status (*method_fn)(const sphere_problem *p, sphere_map f, loxo_sphere_info *info);

static const method_fn methods[] = {sphere_map_scem, sphere_map_flash, sphere_map_cmcf};
enum { SCEM, FLASH, CMCF, N_METHODS };

static sphere_map map_make(const sphere_problem *p)
{
    sphere_map f = loxo_allocate(p->ctx, p->m.n_vertices, sizeof *f);
    CHECK(f != NULL);
    return f;
}

static void center(const sphere_problem *p, sphere_map f)
{
    CHECK_STATUS(p->ctx, loxo_moebius_center(p->ctx, p->m.n_vertices, &f[0][0], NULL, p->area, NULL, &f[0][0], NULL),
                 LOXO_OK);
}

static double energy_of(const sphere_problem *p, sphere_map f)
{
    sphere_energy energy;
    CHECK_STATUS(p->ctx, sphere_find_energy(p, (sphere_const_map)f, &energy), LOXO_OK);
    return energy.energy;
}

static sphere_folds folds_of(const sphere_problem *p, sphere_map f)
{
    sphere_folds folds;
    CHECK_STATUS(p->ctx, sphere_find_folds(p, (sphere_const_map)f, NULL, &folds), LOXO_OK);
    return folds;
}

/* ---- the plane ----------------------------------------------------------------------------------------------------- */

/* Of points anywhere from 1e-6 to 1e6, in the planes of both poles, to rounding: what goes to the sphere and back is off by some
 * eps of itself, and what lies on the far pole itself comes back beside it. */
TEST(stereographic_projections_are_undone)
{
    enum { N = 400 };
    plane_map h, back;
    double(*f)[3] = loxo_allocate(test_context, N, sizeof *f);
    CHECK_OK(plane_map_create(test_context, N, &h));
    CHECK_OK(plane_map_create(test_context, N, &back));
    for (int i = 0; i < N; ++i) {
        const double size = pow(10.0, 12.0 * i / N - 6.0);
        h.x[i] = size * cos(2.4 * i);
        h.y[i] = size * sin(2.4 * i);
    }
    h.x[0] = h.y[0] = 0.0;
    for (int side = 0; side < 2; ++side) {
        const plane_pole pole = side == 0 ? PLANE_NORTH : PLANE_SOUTH;
        plane_to_sphere(test_context, N, &h, pole, NULL, f);
        plane_from_sphere(test_context, N, (sphere_const_map)f, pole, &back);
        CHECK_NEAR3(f[0], ((double[3]){0.0, 0.0, (double)pole}), 0.0);
        for (int i = 0; i < N; ++i) {
            const double size = hypot(h.x[i], h.y[i]);
            CHECK_NEAR(f[i][0] * f[i][0] + f[i][1] * f[i][1] + f[i][2] * f[i][2], 1.0, 1e-15);
            CHECK_NEAR(hypot(back.x[i] - h.x[i], back.y[i] - h.y[i]), 0.0, 2e-15 * size);
        }
        /* The other pole's plane has 1 / conj(h). */
        plane_from_sphere(test_context, N, (sphere_const_map)f, pole == PLANE_NORTH ? PLANE_SOUTH : PLANE_NORTH, &back);
        CHECK_NEAR(hypot(back.x[0], back.y[0]), 2e8, 1.0);
        for (int i = 1; i < N; ++i) {
            const double square = h.x[i] * h.x[i] + h.y[i] * h.y[i];
            CHECK_NEAR(back.x[i], h.x[i] / square, 2e-15 / sqrt(square));
            CHECK_NEAR(back.y[i], h.y[i] / square, 2e-15 / sqrt(square));
        }
    }
    plane_map_destroy(test_context, &h);
    plane_map_destroy(test_context, &back);
    loxo_release(test_context, f);
}

static double turn_in_plane(const plane_map *h, const loxo_index *v)
{
    return (h->x[v[1]] - h->x[v[0]]) * (h->y[v[2]] - h->y[v[0]]) -
           (h->x[v[2]] - h->x[v[0]]) * (h->y[v[1]] - h->y[v[0]]);
}

/* Weights are positive on an icosphere, so the map is one to one (Tutte): all other faces turn as they do on the surface, and the one
 * left out, which covers the outside, the other way round. The solution is as good as its equation: L h = 0 but for 1e-10. */
TEST(the_plane_without_a_face)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 2562, NAN);
    sphere_problem p = problem_make(&s);
    const int64_t n = p.m.n_vertices, face = sphere_most_regular_face(&p);
    const loxo_index *corner = &p.m.halfedge_vertex[3 * face];
    loxo_sphere_info info = {0};
    plane_map h;
    double *residual = loxo_allocate(test_context, n, sizeof *residual);
    sphere_map f = map_make(&p);
    CHECK_OK(plane_map_create(test_context, n, &h));
    CHECK_OK(plane_map_without_face(&p, face, &h, &info));
    CHECK(info.n_linear_steps > 0 && info.n_linear_steps < 60);
    for (int64_t t = 0; t < p.m.n_faces; ++t)
        CHECK((turn_in_plane(&h, &p.m.halfedge_vertex[3 * t]) > 0.0) == (t != face));
    loxo_csr_multiply(test_context, &p.laplacian, h.x, residual);
    double pull = 0.0, rest = 0.0;
    for (int64_t i = 0; i < n; ++i) {
        const bool is_corner = i == corner[0] || i == corner[1] || i == corner[2];
        *(is_corner ? &pull : &rest) += residual[i] * residual[i];
        if (is_corner) CHECK_NEAR(hypot(h.x[i], h.y[i]), 1.0, 1e-14);
    }
    CHECK(sqrt(rest) < 1e-10 * sqrt(pull) + 1e-14);
    CHECK_OK(plane_balance(&p, face, &h));
    plane_to_sphere(test_context, n, &h, PLANE_NORTH, NULL, f);
    CHECK(folds_of(&p, f).n == 0 && folds_of(&p, f).degree == 1);
    loxo_release(test_context, f);
    loxo_release(test_context, residual);
    plane_map_destroy(test_context, &h);
    sphere_problem_destroy(&p);
    surface_destroy(&s);
}

/* Two equations with the same hierarchy and one with a factor; the tolerance is of the residual, whose share in the solution is some
 * ten times as large on 2562 vertices. All vertices held, none moves. */
TEST(equations_by_multigrid_and_by_factors)
{
    surface s = surface_make(test_context, LOXO_SHAPE_BUMPY, 2562, NAN);
    sphere_problem p = problem_make(&s);
    const int64_t n = p.m.n_vertices;
    bool *is_held = loxo_allocate(test_context, n, sizeof *is_held);
    plane_map h[2];
    loxo_sphere_info info = {0};
    for (int way = 0; way < (loxo_cholesky_is_there() ? 2 : 1); ++way) {
        plane_solver *solver;
        for (int64_t i = 0; i < n; ++i)
            is_held[i] = i % 7 == 0 || i > n / 2;
        p.settings.factor = way == 0 ? LOXO_SPHERE_MULTIGRID : LOXO_SPHERE_CHOLESKY;
        CHECK_OK(plane_map_create(test_context, n, &h[way]));
        CHECK_OK(plane_solver_create(&p, is_held, &solver));
        for (int round = 0; round < 2; ++round) {
            for (int64_t i = 0; i < n; ++i) {
                h[way].x[i] = is_held[i] ? sin((double)i) : 0.0;
                h[way].y[i] = is_held[i] ? cos((double)(i + round)) : 1.0;
            }
            CHECK_OK(plane_solver_solve(solver, 1e-10, &h[way], &info));
        }
        plane_solver_destroy(solver);
        for (int64_t i = 0; way == 1 && i < n; ++i) {
            CHECK_NEAR(h[0].x[i], h[1].x[i], 1e-9);
            CHECK_NEAR(h[0].y[i], h[1].y[i], 1e-9);
        }
        for (int64_t i = 0; i < n; ++i)
            is_held[i] = true;
        const double before = h[way].x[1];
        CHECK_OK(plane_solver_create(&p, is_held, &solver));
        CHECK_OK(plane_solver_solve(solver, 1e-10, &h[way], &info));
        CHECK_EQUAL(h[way].x[1], before);
        plane_solver_destroy(solver);
    }
    plane_map_destroy(test_context, &h[0]);
    if (loxo_cholesky_is_there()) plane_map_destroy(test_context, &h[1]);
    loxo_release(test_context, is_held);
    sphere_problem_destroy(&p);
    surface_destroy(&s);
}

/* What flash.c says of its second equation: B grad u . A grad v of a plane triangle, with A made of the Beltrami coefficient mu of the
 * map to the surface's triangle, is the form of L there. mu as g_zbar / g_z in coordinates of the surface's triangle. Values are about
 * 1 to 10; with |mu| up to 0.9 some twenty times the rounding. */
TEST(a_beltrami_equation_is_that_of_the_surface)
{
    for (int i = 0; i < 50; ++i) {
        const double complex z[3] = {0.0, 1.0 + 0.3 * sin(i),
                                     0.4 * cos(2.0 * i) + IMAGINARY * (0.8 + 0.3 * sin(3.0 * i))};
        const double complex w[3] = {0.0, 1.0, 0.5 * cos(5.0 * i) + 0.3 + IMAGINARY * (0.6 + 0.4 * cos(7.0 * i))};
        const double area = 0.5 * cimag(conj(z[1]) * z[2]);
        /* g = p z + q conj(z) with g(z_k) = w_k, z_0 = w_0 = 0 */
        const double complex wide = z[1] * conj(z[2]) - z[2] * conj(z[1]);
        const double complex g_z = (w[1] * conj(z[2]) - w[2] * conj(z[1])) / wide;
        const double complex mu = (z[1] * w[2] - z[2] * w[1]) / wide / g_z;
        const double weak = 1.0 - creal(mu * conj(mu));
        const double a[3] = {creal((1.0 - mu) * conj(1.0 - mu)) / weak, -2.0 * cimag(mu) / weak,
                             creal((1.0 + mu) * conj(1.0 + mu)) / weak};
        double weight[3];
        CHECK(area > 0.1 && weak > 0.1);
        (void)k_face_weights((double[3]){cabs(w[1] - w[0]), cabs(w[2] - w[1]), cabs(w[0] - w[2])}, weight);
        for (int k = 0; k < 3; ++k) {
            /* grad of a corner's hat is i (opposite edge) / (2 area); weight k belongs to the corners k and k + 1 */
            const double complex one = IMAGINARY * (z[(k + 2) % 3] - z[(k + 1) % 3]) / (2.0 * area);
            const double complex two = IMAGINARY * (z[k] - z[(k + 2) % 3]) / (2.0 * area);
            const double form =
                area * (a[0] * creal(one) * creal(two) + a[1] * (creal(one) * cimag(two) + cimag(one) * creal(two)) +
                        a[2] * cimag(one) * cimag(two));
            CHECK_NEAR(form, -weight[k], 1e-13);
        }
    }
}

/* ---- the maps ------------------------------------------------------------------------------------------------------ */

/* The sphere's own map is conformal up to the mesh's size h, and so is what is found: after centring, scalar products of vertices are
 * those of the surface. 2562 vertices: h^2 = 5e-3, and the energy of the identity is 1.8e-2 of which an energy's least can be no more. */
TEST(a_sphere_is_mapped_to_itself)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 2562, NAN);
    sphere_problem p = problem_make(&s);
    const int64_t n = p.m.n_vertices;
    sphere_map f = map_make(&p), own = map_make(&p);
    for (int64_t i = 0; i < n; ++i)
        memcpy(own[i], p.m.position[i], sizeof *own);
    CHECK_NEAR(energy_of(&p, own), 0.0, 1e-11);
    for (int k = 0; k < N_METHODS; ++k) {
        loxo_sphere_info info = {0};
        double off = 0.0;
        CHECK_OK(methods[k](&p, f, &info));
        CHECK(folds_of(&p, f).n == 0 && folds_of(&p, f).degree == 1);
        CHECK_NEAR(info.energy, energy_of(&p, f), 1e-14);
        CHECK(info.n_evaluations > 0 && info.n_iterations > 0 && info.n_linear_steps > 0);
        center(&p, f);
        CHECK(energy_of(&p, f) < (k == FLASH ? 1e-4 : 1e-6));
        for (int64_t i = 0; i < n; ++i) {
            const int64_t j = (7919 * i + 5) % n;
            double product = 0.0;
            for (int c = 0; c < 3; ++c)
                product += f[i][c] * f[j][c] - own[i][c] * own[j][c];
            off = fmax(off, fabs(product));
        }
        CHECK(off < (k == FLASH ? 5e-2 : 5e-3));
    }
    loxo_release(test_context, f);
    loxo_release(test_context, own);
    sphere_problem_destroy(&p);
    surface_destroy(&s);
}

/* Four, eight and fourteen vertices: no array is too small, no vertex at a pole too much. SCEM
 * folds none. FLASH holds three of the four, and on so few the flow need not come to rest, which its status tells. */
TEST(the_smallest_surfaces)
{
    for (int which = 0; which < 3; ++which) {
        loxo_soup soup = which == 0   ? shape_tetrahedron(test_context)
                         : which == 1 ? shape_cube(test_context)
                                      : shape_hub(test_context, 12);
        surface s = surface_from_soup(test_context, soup, LOXO_ORDER_AUTO);
        sphere_problem p = problem_make(&s);
        sphere_map f = map_make(&p);
        for (int k = 0; k < N_METHODS; ++k) {
            loxo_sphere_info info = {0};
            const loxo_status status = methods[k](&p, f, &info);
            CHECK(status == LOXO_OK || status == LOXO_NOT_CONVERGED);
            for (int64_t i = 0; i < p.m.n_vertices; ++i)
                CHECK_NEAR(f[i][0] * f[i][0] + f[i][1] * f[i][1] + f[i][2] * f[i][2], 1.0, 1e-15);
            if (k == SCEM) CHECK(folds_of(&p, f).n == 0 && folds_of(&p, f).degree == 1);
        }
        loxo_release(test_context, f);
        sphere_problem_destroy(&p);
        surface_destroy(&s);
    }
}

/* E_C = O(h^2): a quarter from one frequency of the icosahedron to twice that, within a twentieth. */
TEST(energies_of_ellipsoids_fall_as_the_square_of_the_size)
{
    static const int64_t sizes[] = {2562, 10242, 40962};
    static const int ones[] = {SCEM, CMCF};
    NEEDS_IDS((int64_t)6 * 40962);
    loxo_context *ctx = test_context_with_threads(1); /* most of the work is too small for more */
    for (int k = 0; k < 2; ++k) {
        double before = 0.0;
        for (int level = 0; level < 3; ++level) {
            surface s = surface_make(ctx, LOXO_SHAPE_ELLIPSOID, sizes[level], NAN);
            sphere_problem p = problem_make(&s);
            sphere_map f = map_make(&p);
            loxo_sphere_info info = {0};
            CHECK_STATUS(ctx, methods[ones[k]](&p, f, &info), LOXO_OK);
            CHECK(folds_of(&p, f).n == 0 && folds_of(&p, f).degree == 1);
            center(&p, f);
            const double energy = energy_of(&p, f);
            if (level > 0) CHECK_NEAR(before / energy, 4.0, 0.2);
            before = energy;
            loxo_release(ctx, f);
            sphere_problem_destroy(&p);
            surface_destroy(&s);
        }
    }
    loxo_context_destroy(ctx);
}

/* What public programs of the methods' authors give on the mesh of Tan et al. 2024, Table 2; two per cent leave room for what the
 * descriptions do not say. */
TEST(published_energies_of_fandisk)
{
    const char *path = test_shared("meshes/surfaces/fandisk.obj.gz");
    loxo_soup soup = {0};
    if (path == NULL) SKIP();
    NEEDS_IDS(40000);
    CHECK_OK(loxo_read_mesh(test_context, path, NULL, &soup));
    surface s = surface_from_soup(test_context, soup, LOXO_ORDER_AUTO);
    sphere_problem p = problem_make(&s);
    sphere_map f = map_make(&p);
    loxo_sphere_info info = {0};
    CHECK_OK(sphere_map_flash(&p, f, &info));
    CHECK_NEAR(info.energy, 3.504e-2, 0.02 * 3.504e-2);
    CHECK_OK(sphere_map_scem(&p, f, &info));
    CHECK_NEAR(info.energy, 1.386e-2, 0.02 * 1.386e-2); /* centred here */
    CHECK(folds_of(&p, f).n == 0 && folds_of(&p, f).degree == 1);
    center(&p, f);
    CHECK(energy_of(&p, f) <= 1.005 * 1.372e-2);
    CHECK_OK(sphere_map_cmcf(&p, f, &info));
    center(&p, f);
    CHECK(energy_of(&p, f) <= 1.02 * 1.372e-2);
    loxo_release(test_context, f);
    sphere_problem_destroy(&p);
    surface_destroy(&s);
}

/* ---- any way of solving, any number of threads --------------------------------------------------------------------- */

/* Equations are solved so far that what is left takes a millionth of a sweep's fall: the energies agree to that, and the maps to its
 * root times how far a sweep moves them. */
TEST(multigrid_and_factors_agree)
{
    if (!loxo_cholesky_is_there()) SKIP();
    surface s = surface_make(test_context, LOXO_SHAPE_BUMPY, 5000, NAN);
    sphere_problem p = problem_make(&s);
    sphere_map f[2] = {map_make(&p), map_make(&p)};
    for (int k = 0; k < N_METHODS; ++k) {
        loxo_sphere_info info[2] = {{0}, {0}};
        for (int way = 0; way < 2; ++way) {
            p.settings.factor = way == 0 ? LOXO_SPHERE_MULTIGRID : LOXO_SPHERE_CHOLESKY;
            CHECK_OK(methods[k](&p, f[way], &info[way]));
            center(&p, f[way]);
        }
        CHECK(info[1].n_linear_steps < info[0].n_linear_steps / 3); /* of scem's start, that is always by multigrid */
        CHECK_NEAR(info[0].energy, info[1].energy, 1e-7);
        for (int64_t i = 0; i < p.m.n_vertices; ++i)
            CHECK_NEAR3(f[0][i], f[1][i], 1e-4);
    }
    loxo_release(test_context, f[0]);
    loxo_release(test_context, f[1]);
    sphere_problem_destroy(&p);
    surface_destroy(&s);
}

static uint64_t hash_map(loxo_context *ctx, const void *arg)
{
    surface s = surface_make(ctx, LOXO_SHAPE_BUMPY, 10000, NAN);
    sphere_problem p = problem_make(&s);
    sphere_map f = map_make(&p);
    loxo_sphere_info info = {0};
    p.settings.max_iterations = 5; /* the first are as the others */
    CHECK(methods[*(const int *)arg](&p, f, &info) >= 0);
    const double numbers[] = {info.energy, info.residual, (double)info.n_iterations, (double)info.n_linear_steps};
    const uint64_t hash = test_hash(f, (size_t)p.m.n_vertices * sizeof *f) ^ test_hash(numbers, sizeof numbers);
    loxo_release(ctx, f);
    sphere_problem_destroy(&p);
    surface_destroy(&s);
    return hash;
}

TEST(the_same_bits_for_any_threads)
{
    NEEDS_IDS(60000);
    for (int k = 0; k < N_METHODS; ++k)
        test_same_for_any_threads(hash_map, &k);
}

/* ---- what ends them ------------------------------------------------------------------------------------------------ */

typedef struct failing {
    sphere_problem p; /* of a context of its own */
    sphere_map f;
    int method;
} failing;

static loxo_status call_method(loxo_context *ctx, void *arg)
{
    const failing *a = arg;
    sphere_problem p = a->p;
    loxo_sphere_info info = {0};
    p.ctx = ctx;
    return methods[a->method](&p, a->f, &info);
}

TEST(every_allocation_may_fail)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ELLIPSOID, 400, NAN);
    failing a = {.p = problem_make(&s)};
    a.f = map_make(&a.p);
    for (a.method = 0; a.method < N_METHODS; ++a.method)
        CHECK(test_each_allocation_fails(call_method, &a) > 20);
    loxo_release(test_context, a.f);
    sphere_problem_destroy(&a.p);
    surface_destroy(&s);
}

typedef struct stopping {
    loxo_context *ctx;
    int n_calls, stop_at;
} stopping;

static int stop_at(void *user, const loxo_progress *progress)
{
    stopping *w = user;
    (void)progress;
    w->ctx->last_progress_s = -1e9; /* asks every time, not every 20 ms */
    return ++w->n_calls == w->stop_at;
}

/* Wherever it is stopped, at once: there is no map yet, or the one there is consists of unit vectors. */
TEST(a_monitor_may_stop_them)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ELLIPSOID, 2562, NAN);
    sphere_problem p = problem_make(&s);
    sphere_map f = map_make(&p);
    for (int k = 0; k < N_METHODS; ++k) {
        int n_stopped = 0, n_nothing = 0;
        for (int at = 1; at < 200; at += at < 10 ? 1 : 9) {
            stopping w = {.ctx = test_context, .stop_at = at};
            loxo_sphere_info info = {0};
            loxo_context_set_monitor(test_context, stop_at, &w);
            loxo_progress_enter(test_context);
            test_context->last_progress_s = -1e9;
            const loxo_status status = methods[k](&p, f, &info);
            loxo_progress_leave(test_context);
            loxo_context_set_monitor(test_context, NULL, NULL);
            if (w.n_calls < at) { /* done before */
                CHECK(status == LOXO_OK);
                break;
            }
            CHECK(status == LOXO_STOPPED || status == LOXO_ERR_STOPPED);
            CHECK_EQUAL(w.n_calls, at);
            n_stopped += status == LOXO_STOPPED;
            n_nothing += status == LOXO_ERR_STOPPED;
            if (status == LOXO_ERR_STOPPED) continue;
            CHECK(info.stop_reason == LOXO_SPHERE_STOP_MONITOR);
            for (int64_t i = 0; i < p.m.n_vertices; ++i)
                CHECK_NEAR(f[i][0] * f[i][0] + f[i][1] * f[i][1] + f[i][2] * f[i][2], 1.0, 1e-15);
        }
        CHECK(n_stopped > 0 && (k == CMCF || n_nothing > 0));
    }
    loxo_release(test_context, f);
    sphere_problem_destroy(&p);
    surface_destroy(&s);
}

/* Two sweeps are not enough, and say so. */
TEST(few_iterations_do_not_converge)
{
    static const int ones[] = {SCEM, CMCF};
    surface s = surface_make(test_context, LOXO_SHAPE_BUMPY, 2562, NAN);
    sphere_problem p = problem_make(&s);
    sphere_map f = map_make(&p);
    p.settings.max_iterations = 2;
    for (int k = 0; k < 2; ++k) {
        loxo_sphere_info info = {0};
        CHECK_STATUS(test_context, methods[ones[k]](&p, f, &info), LOXO_NOT_CONVERGED);
        CHECK(info.stop_reason == LOXO_SPHERE_STOP_MAX_ITERATIONS && info.n_iterations == 2);
    }
    loxo_release(test_context, f);
    sphere_problem_destroy(&p);
    surface_destroy(&s);
}
