/* SPDX-License-Identifier: MIT
 * ADMM run long meets its optimality conditions: what it then gives is the solution of the constrained least squares
 * problem, found here by elimination, on surfaces of any topology and for several sources. */
#include "dense.h"
#include "kernel/gradient_kernel.h"
#include "surfaces.h"

#include <loxo/geodesic.h>

/* Heat whose directions turn all over the surface and are no gradient of anything: the recovery has much to mend. */
static void wavy_heat(const surface *s, double *value)
{
    for (int64_t v = 0; v < s->soup.n_vertices; ++v) {
        const double *x = s->soup.position + 3 * v;
        value[v] = 5.0 + sin(2.0 * x[0] + 0.3) + cos(3.0 * x[1] - 0.2) + 0.7 * sin(2.5 * x[2] + x[0] * x[1]);
    }
}

/* h of a face, eq. (3). */
static dense_vector direction_of(const loxo_mesh_arrays *m, int64_t f, const double *heat)
{
    static const int32_t scale[3] = {0, 0, 0};
    double p[9], u[3], h[3];
    for (int c = 0; c < 3; ++c) {
        u[c] = heat[m->triangle[3 * f + c]];
        memcpy(p + 3 * c, m->position + 3 * (int64_t)m->triangle[3 * f + c], 3 * sizeof *p);
    }
    CHECK(k_heat_direction(p, u, scale, h));
    return (dense_vector){(long double)h[0], (long double)h[1], (long double)h[2]};
}

/* (20): every side of an edge wants its own difference, phi wants to please all. */
static void edge_problem(const loxo_mesh_arrays *m, const double *heat, long double *s, long double *b)
{
    const int64_t n = m->n_vertices;
    memset(s, 0, (size_t)(n * n) * sizeof *s);
    for (int64_t f = 0; f < m->n_faces; ++f) {
        const dense_vector h = direction_of(m, f, heat);
        for (int c = 0; c < 3; ++c) {
            const int64_t from = m->triangle[3 * f + c], to = m->triangle[3 * f + (c + 1) % 3];
            const long double x = dense_dot(h, dense_edge(m, from, to));
            s[from * n + from] += 1.0L;
            s[to * n + to] += 1.0L;
            s[from * n + to] -= 1.0L;
            s[to * n + from] -= 1.0L;
            b[to] += x;
            b[from] -= x;
        }
    }
}

/* (10): the gradient of phi nearest to h, weighted by area: a Poisson equation with the cotangent matrix. */
static void face_problem(const loxo_mesh_arrays *m, const double *heat, long double *s, long double *b)
{
    dense_matrix(m, 0.0L, 1.0L, s);
    for (int64_t f = 0; f < m->n_faces; ++f) {
        const loxo_index *v = m->triangle + 3 * f;
        const dense_vector h = direction_of(m, f, heat);
        const dense_vector normal = dense_cross(dense_edge(m, v[0], v[1]), dense_edge(m, v[0], v[2]));
        const long double twice_area = dense_norm(normal);
        for (int c = 0; c < 3; ++c) /* area * gradient of the corner's hat function = normal x opposite edge / 2 */
            b[v[c]] +=
                dense_dot(h, dense_cross(normal, dense_edge(m, v[(c + 1) % 3], v[(c + 2) % 3]))) / (2.0L * twice_area);
    }
}

/* tolerance is relative to the mean edge length. */
static void check_optimal(const surface *s, loxo_geodesic_method method, double penalty, int64_t n_iterations,
                          const loxo_index *sources, int64_t n_sources, int64_t n_constraints, double tolerance)
{
    const int64_t n = s->soup.n_vertices;
    loxo_geodesic_settings settings = admm_settings(method);
    double *value = surface_numbers(s), *distance = surface_numbers(s), worst = 0.0;
    long double *matrix = loxo_allocate(test_context, n * n, sizeof *matrix);
    long double *phi = loxo_allocate(test_context, n, sizeof *phi);
    loxo_geodesic_info info;
    loxo_geodesic *g;
    wavy_heat(s, value);
    settings.global_constraints = true;
    settings.penalty = penalty;
    settings.n_iterations = n_iterations;
    settings.primal_tolerance = settings.dual_tolerance = 0.0;
    CHECK_OK(loxo_geodesic_create(test_context, s->mesh, &settings, &g));
    CHECK_OK(loxo_geodesic_solve_from_heat(g, sources, n_sources, value, NULL, distance, &info));
    CHECK_EQUAL(info.n_iterations, n_iterations);
    CHECK_EQUAL(info.n_constraints, n_constraints);

    memset(phi, 0, (size_t)n * sizeof *phi);
    (method == LOXO_GEODESIC_EDGE ? edge_problem : face_problem)(&s->arrays, value, matrix, phi);
    dense_ground(n, sources, n_sources, matrix, phi);
    dense_solve(n, matrix, phi);
    for (int64_t v = 0; v < n; ++v)
        worst = fmax(worst, fabs(distance[v] - (double)phi[v]) / info.mean_edge_length);
    print_message("%s, %lld vertices, %lld constraints: off by %.1e edges; residuals %.1e %.1e %.1e\n",
                  method_names[method], (long long)n, (long long)n_constraints, worst, info.residual,
                  info.dual_residual, info.constraint_residual);
    CHECK(worst < tolerance);
    CHECK(info.residual < 1e-8);
    CHECK(info.dual_residual < 1e-8);
    CHECK(info.constraint_residual < 1e-8);
    loxo_geodesic_destroy(g);
    loxo_release(test_context, value);
    loxo_release(test_context, distance);
    loxo_release(test_context, matrix);
    loxo_release(test_context, phi);
}

static void check_both(loxo_shape shape, int64_t n_vertices, double param, const loxo_index *sources, int64_t n_sources,
                       int64_t n_constraints)
{
    surface s = surface_make(test_context, shape, n_vertices, param);
    check_optimal(&s, LOXO_GEODESIC_EDGE, 3.0, 20000, sources, n_sources, n_constraints, 1e-8);
    check_optimal(&s, LOXO_GEODESIC_FACE, 3.0, 20000, sources, n_sources, n_constraints, 1e-8);
    surface_destroy(&s);
}

static const loxo_index one[] = {5}, three[] = {5, 40, 77};

TEST(optimal_on_a_sphere) { check_both(LOXO_SHAPE_NOISY, 162, 0.2, one, 1, 0); }

TEST(optimal_on_a_disk) { check_both(LOXO_SHAPE_DISK, 150, NAN, one, 1, 0); }

TEST(optimal_on_a_cylinder) { check_both(LOXO_SHAPE_CYLINDER, 150, NAN, one, 1, 1); }

TEST(optimal_on_an_annulus) { check_both(LOXO_SHAPE_ANNULUS, 150, NAN, one, 1, 1); }

TEST(optimal_on_a_torus) { check_both(LOXO_SHAPE_TORUS, 180, NAN, one, 1, 2); }

TEST(optimal_on_a_double_torus) { check_both(LOXO_SHAPE_GENUS, 250, 2.0, one, 1, 4); }

TEST(optimal_between_sources_of_a_sphere) { check_both(LOXO_SHAPE_ICOSPHERE, 162, NAN, three, 3, 2); }

TEST(optimal_between_sources_of_a_torus) { check_both(LOXO_SHAPE_TORUS, 180, NAN, three, 3, 4); }

TEST(optimal_for_other_penalties)
{
    surface s = surface_make(test_context, LOXO_SHAPE_TORUS, 120, NAN);
    for (int method = 0; method < 2; ++method) {
        check_optimal(&s, (loxo_geodesic_method)method, 10.0, 30000, one, 1, 2, 1e-8);
        check_optimal(&s, (loxo_geodesic_method)method, 100.0, 60000, one, 1, 2, 1e-8);
    }
    surface_destroy(&s);
}

/* Section 5.1: directions that wind around the ring are closed around every face but one column, and yet no gradient. */
TEST(winding_directions_on_an_annulus)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ANNULUS, 800, NAN);
    double *value = surface_numbers(&s), *distance = surface_numbers(&s);
    for (int64_t v = 0; v < s.soup.n_vertices; ++v)
        value[v] = 5.0 + atan2(s.soup.position[3 * v + 1], s.soup.position[3 * v]);
    for (int method = 0; method < 2; ++method)
        for (int is_constrained = 0; is_constrained < 2; ++is_constrained) {
            loxo_geodesic_settings settings = admm_settings((loxo_geodesic_method)method);
            loxo_geodesic_info info;
            loxo_geodesic *g;
            settings.global_constraints = is_constrained == 1;
            settings.n_iterations = 2000;
            settings.penalty = 3.0;
            CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
            CHECK_OK(loxo_geodesic_solve_from_heat(g, one, 1, value, NULL, distance, &info));
            const double jump = info.breach_max * info.mean_edge_length;
            print_message("%s, constraints %s: largest breach %.3g\n", method_names[method],
                          is_constrained ? "on" : "off", info.breach_max);
            if (is_constrained)
                CHECK(info.breach_max < 2.0); /* a function; only at the column it is steep */
            else
                CHECK(jump > 2.0); /* half a circumference at the least, where the two ways around meet */
            loxo_geodesic_destroy(g);
        }
    loxo_release(test_context, value);
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

/* Twenty cycles at once, none left out. */
TEST(optimal_on_a_surface_of_genus_ten)
{
    surface s = surface_make(test_context, LOXO_SHAPE_GENUS, 600, 10);
    CHECK_EQUAL(loxo_mesh_get_view(s.mesh).genus, 10);
    for (int method = 0; method < 2; ++method)
        check_optimal(&s, (loxo_geodesic_method)method, 100.0, 10000, one, 1, 20, 1e-8);
    surface_destroy(&s);
}
