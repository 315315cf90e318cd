/* SPDX-License-Identifier: MIT
 * Multigrid as a preconditioner. */
#include "algebra/cg.h"
#include "algebra/multigrid.h"
#include "shapes.h"
#include "unit/matrices.h"

#include <loxo/io.h>

#include <time.h>

static loxo_cg_info solve(loxo_context *ctx, const loxo_csr *a, const double *b, double *x, loxo_multigrid_info *grid)
{
    loxo_multigrid *mg;
    loxo_cg *cg;
    loxo_cg_info info;
    CHECK_STATUS(ctx, loxo_multigrid_create(ctx, a, grid, &mg), LOXO_OK);
    CHECK_STATUS(ctx, loxo_cg_create(ctx, a, &cg), LOXO_OK);
    const loxo_preconditioner m = {loxo_multigrid_apply, mg};
    CHECK_STATUS(ctx, loxo_cg_solve(cg, &m, NULL, b, x, &info), LOXO_OK);
    CHECK(info.residual <= 1e-8);
    loxo_cg_destroy(cg);
    loxo_multigrid_destroy(mg);
    return info;
}

/* Steps to 1e-8 from a right side of noise. */
static int64_t count_steps(const loxo_csr *a, loxo_multigrid_info *grid)
{
    double *b = random_vector(test_context, a->n_rows, 12), *x = zero_vector(test_context, a->n_rows);
    const int64_t n = solve(test_context, a, b, x, grid).n_iterations;
    loxo_release(test_context, b);
    loxo_release(test_context, x);
    return n;
}

/* Most bytes a row on top of the matrix, from the beginning of the set-up to the end of a solve. */
static double most_bytes(loxo_context *ctx, const loxo_csr *a)
{
    double *b = random_vector(ctx, a->n_rows, 12), *x = zero_vector(ctx, a->n_rows);
    const size_t before = loxo_context_memory(ctx).current_bytes;
    loxo_context_reset_peak(ctx);
    solve(ctx, a, b, x, NULL);
    loxo_release(ctx, b);
    loxo_release(ctx, x);
    return (double)(loxo_context_memory(ctx).peak_bytes - before) / (double)a->n_rows;
}

/* Measured: 12, 11, 12. */
TEST(steps_do_not_grow_with_the_mesh)
{
    static const int64_t sizes[] = {2562, 40962, 163842};
    int64_t steps[3];
    NEEDS_IDS(163842 * 6);
    for (int k = 0; k < 3; ++k) {
        loxo_multigrid_info grid;
        loxo_csr a = matrix_of_shape(test_context, LOXO_SHAPE_BUMPY, sizes[k], NULL);
        steps[k] = count_steps(&a, &grid);
        CHECK(grid.operator_complexity < 1.4);
        CHECK((double)grid.bytes < 105.0 * (double)a.n_rows);
        CHECK_EQUAL(grid.n_grounded, 1);
        loxo_csr_destroy(test_context, &a);
        CHECK(steps[k] <= 15);
    }
    CHECK((double)steps[2] <= 1.2 * (double)steps[0]);
}

/* Chains of lengths, slivers by construction, holes, handles, one triangle wide. */
TEST(all_shapes_converge)
{
    static const struct {
        loxo_shape shape;
        int64_t n;
        int64_t most;
    } cases[] = {{LOXO_SHAPE_LATLONG, 5000, 40}, {LOXO_SHAPE_GENUS, 5000, 25},    {LOXO_SHAPE_NOISY, 5000, 40},
                 {LOXO_SHAPE_DISK, 5000, 25},    {LOXO_SHAPE_GRID, 5000, 25},     {LOXO_SHAPE_STRIP, 4000, 60},
                 {LOXO_SHAPE_ANNULUS, 5000, 25}, {LOXO_SHAPE_CYLINDER, 5000, 25}, {LOXO_SHAPE_BRAIN, 5000, 40}};
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; ++k) {
        loxo_csr a = matrix_of_shape(test_context, cases[k].shape, cases[k].n, NULL);
        const int64_t steps = count_steps(&a, NULL);
        if (steps > cases[k].most) print_error("%s: %lld steps\n", loxo_shape_name(cases[k].shape), (long long)steps);
        CHECK(steps <= cases[k].most);
        loxo_csr_destroy(test_context, &a);
    }
}

static loxo_csr matrix_of_file(loxo_context *ctx, const char *path)
{
    loxo_soup soup = {0};
    loxo_csr a;
    CHECK_OK(loxo_read_mesh(ctx, path, NULL, &soup));
    surface s = surface_from_soup(ctx, soup, LOXO_ORDER_AUTO);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    CHECK_STATUS(ctx, loxo_laplacian_create(ctx, &m, &a, NULL), LOXO_OK);
    surface_destroy(&s);
    return a;
}

/* Obtuse, stretched and flat triangles: at most 25 steps and 150 bytes a vertex. */
TEST(hard_scans_take_few_steps_and_bytes)
{
    static const char *const files[] = {
        "meshes/surfaces/camel10k.off.gz",     "meshes/surfaces/homer6k.obj.gz",
        "meshes/surfaces/fandisk.obj.gz",      "meshes/surfaces/bunny35k-slivers.off.gz",
        "meshes/surfaces/moai48k-slivers.ply", "meshes/surfaces/armadillo50k.obj.gz"};
    NEEDS_IDS(50000 * 6);
    for (int k = 0; k < 6; ++k) { /* measured 24, 17, 13, 14, 24, 14 steps; 132, 142, 136, 125, 149, 135 bytes */
        if (test_shared(files[k]) == NULL) SKIP();
        loxo_csr a = matrix_of_file(test_context, test_shared(files[k]));
        CHECK(count_steps(&a, NULL) <= 25);
        CHECK(most_bytes(test_context, &a) <= 150.0);
        loxo_csr_destroy(test_context, &a);
    }
}

/* What each thread takes for itself does not grow with the mesh. */
TEST(threads_take_little_memory)
{
    NEEDS_IDS(160000 * 6);
    loxo_csr a = matrix_of_shape(test_context, LOXO_SHAPE_GRID, 160000, NULL);
    const double one = most_bytes(test_context, &a);
    loxo_context *ctx = test_context_with_threads(7);
    CHECK(most_bytes(ctx, &a) < one + 6.0); /* tables for the longest row of a product: 100 kB each */
    CHECK(one <= 140.0);
    loxo_context_destroy(ctx);
    loxo_csr_destroy(test_context, &a);
}

/* Every 40th face of a sphere gets a vertex 1e-5 of an edge off the middle of its first edge: a cap. Measured: 13 steps;
 * relaxed one by one they took 110. */
TEST(caps_are_relaxed_together)
{
    loxo_soup soup = soup_make(test_context, LOXO_SHAPE_ICOSPHERE, 2562, NAN);
    shape_add_caps(test_context, &soup, 40, 1e-5);
    surface s = surface_from_soup(test_context, soup, LOXO_ORDER_AUTO);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    loxo_csr a;
    CHECK_OK(loxo_laplacian_create(test_context, &m, &a, NULL));
    const int64_t steps = count_steps(&a, NULL);
    CHECK(steps <= 18);
    loxo_csr_destroy(test_context, &a);
    surface_destroy(&s);
}

/* A + t C from t = h^2 / 10 to 1000 h^2, and the rim of a disk pinned. */
TEST(shifted_and_pinned_systems)
{
    static const double times[] = {1e-4, 1e-3, 1e-2, 1.0};
    for (int k = 0; k < 4; ++k) {
        double *mass;
        loxo_csr a = matrix_of_shape(test_context, LOXO_SHAPE_ICOSPHERE, 5000, &mass);
        loxo_csr_scale_shift(test_context, &a, times[k], mass);
        CHECK(count_steps(&a, NULL) <= 18);
        loxo_csr_destroy(test_context, &a);
        loxo_release(test_context, mass);
    }
    surface s = surface_make(test_context, LOXO_SHAPE_DISK, 5000, NAN);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    bool *is_rim = loxo_allocate(test_context, m.n_vertices, sizeof *is_rim);
    loxo_multigrid_info grid;
    loxo_csr a;
    CHECK_OK(loxo_laplacian_create(test_context, &m, &a, NULL));
    for (int64_t v = 0; v < m.n_vertices; ++v)
        is_rim[v] = m.halfedge_twin[m.vertex_halfedge[v]] < 0;
    loxo_csr_pin(test_context, &a, is_rim);
    CHECK(count_steps(&a, &grid) <= 20);
    CHECK_EQUAL(grid.n_grounded, 0);
    loxo_csr_destroy(test_context, &a);
    loxo_release(test_context, is_rim);
    surface_destroy(&s);
}

/* A grid squeezed by 1 to 100 with its rim held: lines of strong edges that end at held vertices. Measured: 10 to 13. */
TEST(held_rims_of_squeezed_grids)
{
    static const double factors[] = {1.0, 0.1, 0.01};
    for (int k = 0; k < 3; ++k) {
        loxo_soup soup = soup_make(test_context, LOXO_SHAPE_GRID, 5000, NAN);
        for (int64_t v = 0; v < soup.n_vertices; ++v)
            soup.position[3 * v + 1] *= factors[k];
        surface s = surface_from_soup(test_context, soup, LOXO_ORDER_AUTO);
        const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
        bool *is_rim = loxo_allocate(test_context, m.n_vertices, sizeof *is_rim);
        loxo_csr a;
        CHECK_OK(loxo_laplacian_create(test_context, &m, &a, NULL));
        for (int64_t v = 0; v < m.n_vertices; ++v)
            is_rim[v] = m.halfedge_twin[m.vertex_halfedge[v]] < 0;
        loxo_csr_pin(test_context, &a, is_rim);
        CHECK(count_steps(&a, NULL) <= 15);
        loxo_csr_destroy(test_context, &a);
        loxo_release(test_context, is_rim);
        surface_destroy(&s);
    }
}

/* Every 30th variable has an excess of ten times its weights, and is left out of the next level; what joins others to it
 * must count there, or the coarse matrix is too small and the preconditioner indefinite. */
TEST(variables_that_stand_firm)
{
    loxo_csr a = matrix_of_shape(test_context, LOXO_SHAPE_BUMPY, 5000, NULL);
    for (int64_t i = 0; i < a.n_rows; i += 30)
        a.diagonal[i] *= 11.0;
    CHECK(count_steps(&a, NULL) <= 15);
    loxo_csr_destroy(test_context, &a);
}

/* What is left lies in the range of the matrix of one component. */
static void remove_mean(int64_t n, double *x)
{
    double sum = 0.0;
    for (int64_t i = 0; i < n; ++i)
        sum += x[i];
    for (int64_t i = 0; i < n; ++i)
        x[i] -= sum / (double)n;
}

/* x . M y = y . M x and x . M x > 0, for entries of both signs: on a noisy mesh, several blocks of the smoother. */
TEST(preconditioner_is_symmetric_and_positive)
{
    static const loxo_shape shapes[] = {LOXO_SHAPE_NOISY, LOXO_SHAPE_BUMPY, LOXO_SHAPE_STRIP};
    for (int k = 0; k < 3; ++k) {
        loxo_csr a = matrix_of_shape(test_context, shapes[k], 5000, NULL);
        const int64_t n = a.n_rows;
        loxo_multigrid *mg;
        CHECK_OK(loxo_multigrid_create(test_context, &a, NULL, &mg));
        double *mx = zero_vector(test_context, n), *my = zero_vector(test_context, n);
        for (uint64_t seed = 0; seed < 5; ++seed) {
            double *x = random_vector(test_context, n, 2 * seed), *y = random_vector(test_context, n, 2 * seed + 1);
            remove_mean(n, x);
            remove_mean(n, y);
            loxo_multigrid_apply(mg, x, mx);
            loxo_multigrid_apply(mg, y, my);
            const double xmy = dot_product(n, x, my), ymx = dot_product(n, y, mx);
            const double size = sqrt(dot_product(n, x, mx) * dot_product(n, y, my));
            CHECK(dot_product(n, x, mx) > 0.0 && dot_product(n, y, my) > 0.0);
            CHECK_NEAR(xmy / size, ymx / size, 1e-6); /* coarse matrices are rounded to floats, each entry alone */
            loxo_release(test_context, x);
            loxo_release(test_context, y);
        }
        loxo_release(test_context, mx);
        loxo_release(test_context, my);
        loxo_multigrid_destroy(mg);
        loxo_csr_destroy(test_context, &a);
    }
}

/* 300 tetrahedra, a sphere, and vertices without faces: constants of every component are free. */
TEST(many_components)
{
    loxo_soup soup = soup_make(test_context, LOXO_SHAPE_ICOSPHERE, 2562, NAN);
    for (int k = 0; k < 300; ++k) {
        loxo_soup one = k % 3 == 0 ? shape_empty(test_context, 1, 0) : shape_tetrahedron(test_context);
        if (one.n_faces == 0) memset(one.position, 0, 3 * sizeof *one.position);
        shape_append(test_context, &soup, &one);
    }
    surface s = surface_from_soup(test_context, soup, LOXO_ORDER_GIVEN);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    loxo_csr a;
    CHECK_OK(loxo_laplacian_create(test_context, &m, &a, NULL));
    CHECK(count_steps(&a, NULL) <= 25);
    loxo_csr_destroy(test_context, &a);
    surface_destroy(&s);
}

/* A hub of 20,000 spokes: no step may take the square of a row. */
TEST(a_hub)
{
    NEEDS_IDS(120000);
    surface s = surface_from_soup(test_context, shape_hub(test_context, 20000), LOXO_ORDER_GIVEN);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    loxo_csr a;
    CHECK_OK(loxo_laplacian_create(test_context, &m, &a, NULL));
    CHECK(count_steps(&a, NULL) <= 60);
    loxo_csr_destroy(test_context, &a);
    surface_destroy(&s);
}

/* A fan around its last vertex, whose rim goes in and out: the spokes to the outer ones have negative weights, half as large
 * as the largest of the hub. Seconds of processor time for its hierarchy, the best of three, on one thread: others spin. */
static double time_of_fan(int64_t n_spokes)
{
    double best = HUGE_VAL;
    loxo_soup soup = shape_empty(test_context, n_spokes + 1, n_spokes);
    for (int64_t i = 0; i < n_spokes; ++i) {
        const double angle = 2.0 * 3.14159265358979 * (double)i / (double)n_spokes, r = i % 2 == 0 ? 1.0 : 2.0;
        const loxo_index face[3] = {(loxo_index)n_spokes, (loxo_index)i, (loxo_index)((i + 1) % n_spokes)};
        const double at[3] = {r * cos(angle), r * sin(angle), 0.0};
        memcpy(&soup.position[3 * i], at, sizeof at);
        memcpy(&soup.triangle[3 * i], face, sizeof face);
    }
    memset(&soup.position[3 * n_spokes], 0, 3 * sizeof *soup.position);
    surface s = surface_from_soup(test_context, soup, LOXO_ORDER_GIVEN);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    loxo_csr a;
    CHECK_OK(loxo_laplacian_create(test_context, &m, &a, NULL));
    int64_t n_stiff = 0;
    for (int64_t k = a.begin[n_spokes]; k < a.begin[n_spokes + 1]; ++k)
        n_stiff += a.value[k] > 0.0;
    CHECK_EQUAL(n_stiff, n_spokes / 2);
    loxo_context *alone = test_context_with_threads(1);
    for (int k = 0; k < 3; ++k) {
        loxo_multigrid *mg;
        const clock_t start = clock();
        CHECK_OK(loxo_multigrid_create(alone, &a, NULL, &mg));
        best = fmin(best, (double)(clock() - start) / CLOCKS_PER_SEC);
        loxo_multigrid_destroy(mg);
    }
    loxo_context_destroy(alone);
    loxo_csr_destroy(test_context, &a);
    surface_destroy(&s);
    return best;
}

/* Eight times the spokes take eight times as long, not 64 times: measured 9. */
TEST(a_hub_of_stiff_spokes_takes_linear_time)
{
    NEEDS_IDS(600000);
    const double few = time_of_fan(12500), many = time_of_fan(200000); /* 16 times as many; their square: 256 */
    if (!(many < 80.0 * few)) print_error("12,500 spokes: %.4f s, 200,000: %.4f s\n", few, many);
    CHECK(many < 80.0 * few);
}

/* The second of two spheres weighs 2^k times as much as the first. In single precision one of them is out of range. */
TEST(weights_far_apart)
{
    static const int exponents[] = {-600, -300, -150, 150, 300, 600};
    for (int k = 0; k < 6; ++k) {
        loxo_soup soup = soup_make(test_context, LOXO_SHAPE_BUMPY, 642, NAN);
        loxo_soup other = soup_make(test_context, LOXO_SHAPE_ICOSPHERE, 162, NAN);
        shape_append(test_context, &soup, &other);
        surface s = surface_from_soup(test_context, soup, LOXO_ORDER_GIVEN);
        const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
        loxo_csr a;
        CHECK_OK(loxo_laplacian_create(test_context, &m, &a, NULL));
        for (int64_t i = 642; i < a.n_rows; ++i) {
            a.diagonal[i] = ldexp(a.diagonal[i], exponents[k]);
            for (int64_t e = a.begin[i]; e < a.begin[i + 1]; ++e)
                a.value[e] = ldexp(a.value[e], exponents[k]);
        }
        double *r = random_vector(test_context, a.n_rows, 2), *z = zero_vector(test_context, a.n_rows);
        loxo_multigrid *mg;
        CHECK_OK(loxo_multigrid_create(test_context, &a, NULL, &mg));
        loxo_multigrid_apply(mg, r, z);
        for (int64_t i = 0; i < a.n_rows; ++i)
            CHECK(isfinite(z[i]));
        CHECK(dot_product(a.n_rows, r, z) > 0.0);
        loxo_multigrid_destroy(mg);
        for (int64_t i = 0; i < 642; ++i)
            if (exponents[k] > 0) r[i] = 0.0; /* what is less by 2^k would not count in a residual of both */
        for (int64_t i = 642; i < a.n_rows; ++i)
            r[i] = exponents[k] > 0 ? r[i] : 0.0;
        memset(z, 0, (size_t)a.n_rows * sizeof *z);
        CHECK(solve(test_context, &a, r, z, NULL).n_iterations <= 15);
        loxo_release(test_context, r);
        loxo_release(test_context, z);
        loxo_csr_destroy(test_context, &a);
        surface_destroy(&s);
    }
}

TEST(units_do_not_matter)
{
    static const double factors[] = {1.0, 0x1p-300, 0x1p300};
    int64_t steps[3];
    for (int k = 0; k < 3; ++k) {
        loxo_csr a = matrix_of_shape(test_context, LOXO_SHAPE_BUMPY, 2562, NULL);
        loxo_csr_scale_shift(test_context, &a, factors[k], NULL);
        steps[k] = count_steps(&a, NULL);
        CHECK_EQUAL(steps[k], steps[0]);
        loxo_csr_destroy(test_context, &a);
    }
}

TEST(bad_matrices_are_refused)
{
    loxo_csr a = matrix_of_shape(test_context, LOXO_SHAPE_ICOSPHERE, 642, NULL);
    loxo_multigrid *mg;
    const double good = a.value[100];
    a.value[100] = NAN;
    CHECK_STATUS(test_context, loxo_multigrid_create(test_context, &a, NULL, &mg), LOXO_ERR_NUMERIC);
    CHECK(mg == NULL);
    a.value[100] = INFINITY;
    CHECK_STATUS(test_context, loxo_multigrid_create(test_context, &a, NULL, &mg), LOXO_ERR_NUMERIC);
    a.value[100] = good;
    a.diagonal[5] = -1.0;
    CHECK_STATUS(test_context, loxo_multigrid_create(test_context, &a, NULL, &mg), LOXO_ERR_NUMERIC);
    loxo_csr_destroy(test_context, &a);
    loxo_multigrid_destroy(NULL);
}

TEST(nothing_and_one_variable)
{
    const double one[1] = {2.0};
    double b = 3.0, x = 0.0;
    loxo_csr a = matrix_of_dense(test_context, 1, one);
    solve(test_context, &a, &b, &x, NULL);
    CHECK_NEAR(x, 1.5, 1e-15);
    loxo_csr_destroy(test_context, &a);
    a = matrix_of_dense(test_context, 0, one);
    solve(test_context, &a, &b, &x, NULL);
    loxo_csr_destroy(test_context, &a);
}

static loxo_status create(loxo_context *ctx, void *arg)
{
    loxo_multigrid *mg;
    const loxo_status status = loxo_multigrid_create(ctx, arg, NULL, &mg);
    loxo_multigrid_destroy(mg);
    return status;
}

TEST(each_allocation_may_fail)
{
    loxo_csr a = matrix_of_shape(test_context, LOXO_SHAPE_BUMPY, 3000, NULL);
    CHECK(test_each_allocation_fails(create, &a) >= 30);
    loxo_csr_destroy(test_context, &a);
}

TEST(any_number_of_threads_gives_the_same_bits)
{
    static const int ladder[] = {1, 2, 3, 7};
    uint64_t hash[4];
    NEEDS_IDS(100000 * 6);
    loxo_csr a = matrix_of_shape(test_context, LOXO_SHAPE_BUMPY, 100002, NULL);
    double *b = random_vector(test_context, a.n_rows, 3);
    for (int k = 0; k < 4; ++k) {
        loxo_context *ctx = test_context_with_threads(ladder[k]);
        double *x = zero_vector(ctx, a.n_rows);
        solve(ctx, &a, b, x, NULL);
        hash[k] = test_hash(x, (size_t)a.n_rows * sizeof *x);
        loxo_release(ctx, x);
        loxo_context_destroy(ctx);
        CHECK(hash[k] == hash[0]);
    }
    loxo_release(test_context, b);
    loxo_csr_destroy(test_context, &a);
}
