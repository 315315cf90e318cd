/* SPDX-License-Identifier: MIT
 * What must not change a distance: threads and instruction sets (not a bit), the run before, the place and size of the
 * surface, the numbering of its vertices, the order they are kept in, the width of the positions. */
#include "../solver/surfaces.h"

#include <loxo/geodesic.h>

/* A solve in a context of its own. */
typedef struct variation {
    loxo_context_settings context;
    loxo_geodesic_settings geodesic;
    int64_t n_sources;
} variation;

static uint64_t hash_of_solve(const loxo_soup *soup, const variation *v)
{
    loxo_context *ctx = NULL;
    loxo_mesh *mesh;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    CHECK_STATUS(NULL, loxo_context_create(&v->context, &ctx), LOXO_OK);
    CHECK_STATUS(ctx, loxo_mesh_create(ctx, &arrays, LOXO_COPY, NULL, NULL, &mesh), LOXO_OK);
    double *distance = loxo_allocate(ctx, soup->n_vertices, sizeof *distance);
    loxo_index *sources = loxo_allocate(ctx, v->n_sources, sizeof *sources);
    loxo_geodesic_info info;
    for (int64_t i = 0; i < v->n_sources; ++i)
        sources[i] = (loxo_index)(i * (soup->n_vertices / v->n_sources));
    CHECK_STATUS(ctx, loxo_geodesic_distance(ctx, mesh, &v->geodesic, sources, v->n_sources, distance, &info), LOXO_OK);
    uint64_t hash = test_hash(distance, (size_t)soup->n_vertices * sizeof *distance);
    /* What is told of it is the same, too. */
    const double told[] = {info.residual, info.objective, info.gradient_share, info.breach_max, info.diffusion_change};
    hash ^= test_hash(told, sizeof told);
    loxo_release(ctx, distance);
    loxo_release(ctx, sources);
    loxo_mesh_destroy(mesh);
    loxo_context_destroy(ctx);
    return hash;
}

static void check_ladder(loxo_shape shape, int64_t n_vertices, loxo_geodesic_method method,
                         loxo_geodesic_diffusion diffusion, int64_t n_sources)
{
    static const int threads[] = {1, 2, 3, 7};
    NEEDS_IDS(6 * n_vertices);
    loxo_soup soup = soup_make(test_context, shape, n_vertices, NAN);
    variation v = {
        .context = loxo_context_settings_default(), .geodesic = unjudged_settings(method), .n_sources = n_sources};
    uint64_t reference = 0;
    v.geodesic.diffusion = diffusion;
    v.geodesic.n_sweeps = 20;
    for (int i = 0; i < 4; ++i) {
        v.context.n_threads = threads[i];
        const uint64_t hash = hash_of_solve(&soup, &v);
        if (i == 0) reference = hash;
        CHECK(hash == reference);
    }
    for (int isa = LOXO_ISA_BASELINE; isa <= LOXO_ISA_AVX512; ++isa) {
        loxo_context *probe;
        v.context.isa = (loxo_isa)isa;
        if (loxo_context_create(&v.context, &probe) != LOXO_OK) continue; /* not of this processor */
        loxo_context_destroy(probe);
        CHECK(hash_of_solve(&soup, &v) == reference);
    }
    loxo_soup_destroy(test_context, &soup);
}

/* Levels of one source are too small to be shared out here; those of many sources are not. */
TEST(same_bits_edge) { check_ladder(LOXO_SHAPE_NOISY, 20000, LOXO_GEODESIC_EDGE, LOXO_DIFFUSION_MARCHING, 1); }

TEST(same_bits_edge_many_sources)
{
    check_ladder(LOXO_SHAPE_BUMPY, 20000, LOXO_GEODESIC_EDGE, LOXO_DIFFUSION_MARCHING, 40);
}

TEST(same_bits_face) { check_ladder(LOXO_SHAPE_TORUS, 20000, LOXO_GEODESIC_FACE, LOXO_DIFFUSION_MARCHING, 1); }

TEST(same_bits_face_many_sources)
{
    check_ladder(LOXO_SHAPE_NOISY, 20000, LOXO_GEODESIC_FACE, LOXO_DIFFUSION_MARCHING, 40);
}

TEST(same_bits_fast) { check_ladder(LOXO_SHAPE_BUMPY, 20000, LOXO_GEODESIC_FAST, LOXO_DIFFUSION_MARCHING, 1); }

/* Many rounds of many vertices, with corrections: whatever threads could do to each other shows here sooner or later. */
TEST(same_bits_fast_many_sources)
{
    for (int i = 0; i < 5; ++i)
        check_ladder(LOXO_SHAPE_NOISY, 20000, LOXO_GEODESIC_FAST, LOXO_DIFFUSION_MARCHING, 40);
}

TEST(same_bits_sweeps) { check_ladder(LOXO_SHAPE_TORUS, 20000, LOXO_GEODESIC_EDGE, LOXO_DIFFUSION_SWEEPS, 1); }

TEST(same_bits_sweeps_many_sources)
{
    check_ladder(LOXO_SHAPE_NOISY, 20000, LOXO_GEODESIC_EDGE, LOXO_DIFFUSION_SWEEPS, 40);
}

/* Vertices of no face before all others: the first parts have no faces. */
static loxo_soup soup_with_idle_vertices(loxo_shape shape, int64_t n_vertices, int64_t n_idle)
{
    loxo_soup soup = soup_make(test_context, shape, n_vertices, NAN);
    const int64_t n = soup.n_vertices;
    double *position = loxo_allocate(test_context, 3 * (n + n_idle), sizeof *position);
    memset(position, 0, (size_t)(3 * n_idle) * sizeof *position);
    memcpy(position + 3 * n_idle, soup.position, (size_t)(3 * n) * sizeof *position);
    loxo_release(test_context, soup.position);
    soup.position = position;
    soup.n_vertices = n + n_idle;
    for (int64_t i = 0; i < 3 * soup.n_faces; ++i)
        soup.triangle[i] = (loxo_index)(soup.triangle[i] + n_idle);
    return soup;
}

/* The recovery goes part by part; how large the parts are is no part of the answer. */
static void check_parts(loxo_order order, int64_t n_idle, loxo_shape shape, int64_t n_sources, bool is_constrained,
                        const size_t *part_bytes, int n_sizes)
{
    NEEDS_IDS(6 * 4000);
    loxo_soup soup = soup_with_idle_vertices(shape, 4000, n_idle);
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    double *distance = loxo_allocate(test_context, soup.n_vertices, sizeof *distance);
    uint64_t reference[2] = {0, 0};
    for (int i = 0; i < 3 * n_sizes; ++i) {
        static const int threads[] = {1, 2, 5};
        loxo_mesh_settings mesh_settings = loxo_mesh_settings_default();
        loxo_index sources[3] = {(loxo_index)n_idle, (loxo_index)(n_idle + 1500), (loxo_index)(n_idle + 3000)};
        loxo_context *ctx = test_context_with_threads(threads[i % 3]);
        loxo_mesh *mesh;
        mesh_settings.order = order;
        mesh_settings.part_bytes = part_bytes[i / 3];
        CHECK_STATUS(ctx, loxo_mesh_create(ctx, &arrays, LOXO_COPY, &mesh_settings, NULL, &mesh), LOXO_OK);
        for (int method = 0; method < 2; ++method) {
            loxo_geodesic_settings settings = unjudged_settings((loxo_geodesic_method)method);
            loxo_geodesic_info info;
            settings.global_constraints = is_constrained;
            settings.n_iterations = 23; /* tests for stopping between, and a remainder */
            CHECK_STATUS(ctx, loxo_geodesic_distance(ctx, mesh, &settings, sources, n_sources, distance, &info),
                         LOXO_OK);
            const double told[] = {info.residual, info.dual_residual, info.objective, info.constraint_residual};
            const uint64_t hash =
                test_hash(distance, (size_t)soup.n_vertices * sizeof *distance) ^ test_hash(told, sizeof told);
            if (i == 0) reference[method] = hash;
            CHECK(hash == reference[method]);
        }
        loxo_mesh_destroy(mesh);
        loxo_context_destroy(ctx);
    }
    loxo_release(test_context, distance);
    loxo_soup_destroy(test_context, &soup);
}

static const size_t part_sizes[] = {1, 20000, 77777, 0, (size_t)1 << 40};

TEST(size_of_parts_does_not_matter) { check_parts(LOXO_ORDER_HILBERT, 0, LOXO_SHAPE_NOISY, 1, false, part_sizes, 5); }

TEST(size_of_parts_does_not_matter_with_chains)
{
    check_parts(LOXO_ORDER_HILBERT, 0, LOXO_SHAPE_TORUS, 3, true, part_sizes, 5);
}

TEST(parts_without_faces_do_not_matter)
{
    check_parts(LOXO_ORDER_HILBERT, 500, LOXO_SHAPE_ANNULUS, 3, false, part_sizes, 5);
    check_parts(LOXO_ORDER_GIVEN, 500, LOXO_SHAPE_CYLINDER, 1, false, part_sizes, 4);
}

/* One object, two source sets by turns, both methods: nothing of a solve is left to the next. */
TEST(solves_do_not_remember)
{
    surface s = surface_make(test_context, LOXO_SHAPE_TORUS, 2000, NAN);
    const size_t n_bytes = (size_t)s.soup.n_vertices * sizeof(double);
    static const loxo_index near[] = {3}, far[] = {1500, 20, 700};
    double *distance = surface_numbers(&s);
    for (int method = 0; method < 2; ++method) {
        const loxo_geodesic_settings settings = unjudged_settings((loxo_geodesic_method)method);
        uint64_t first[2] = {0, 0};
        loxo_geodesic *g;
        CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
        for (int i = 0; i < 6; ++i) {
            const bool is_far = i % 2 == 1;
            CHECK_OK(loxo_geodesic_solve(g, is_far ? far : near, is_far ? 3 : 1, distance, NULL));
            if (i < 2) first[i] = test_hash(distance, n_bytes);
            CHECK(test_hash(distance, n_bytes) == first[i % 2]);
        }
        CHECK(first[0] != first[1]);
        loxo_geodesic_destroy(g);
        /* Nor does it matter that the object is new. */
        CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &settings, far, 3, distance, NULL));
        CHECK(test_hash(distance, n_bytes) == first[1]);
    }
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

/* The heat of a solve, given back, recovers the same bits. */
TEST(given_heat_recovers_the_same_bits)
{
    surface s = surface_make(test_context, LOXO_SHAPE_NOISY, 2000, NAN);
    double *distance = surface_numbers(&s), *again = surface_numbers(&s), *value = surface_numbers(&s);
    int32_t *scale = loxo_allocate(test_context, s.soup.n_vertices, sizeof *scale);
    loxo_geodesic *g;
    const loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_OK(loxo_geodesic_solve(g, (const loxo_index[]){9}, 1, distance, NULL));
    CHECK_OK(loxo_geodesic_heat(g, value, scale));
    CHECK_OK(loxo_geodesic_solve_from_heat(g, (const loxo_index[]){9}, 1, value, scale, again, NULL));
    CHECK(memcmp(distance, again, (size_t)s.soup.n_vertices * sizeof *distance) == 0);
    loxo_geodesic_destroy(g);
    loxo_release(test_context, distance);
    loxo_release(test_context, again);
    loxo_release(test_context, value);
    loxo_release(test_context, scale);
    surface_destroy(&s);
}

/* Largest difference of distances, over the largest distance. */
static double difference(int64_t n, const double *a, const double *b, double factor)
{
    double worst = 0.0, size = 0.0;
    for (int64_t v = 0; v < n; ++v) {
        worst = fmax(worst, fabs(a[v] - b[v] * factor));
        size = fmax(size, fabs(a[v]));
    }
    return worst / size;
}

/* Distances of the soup by a method, from two sources; order of the vertices as asked. Another order is another
 * breadth-first tree, which matters until ADMM has closed all loops: is_run_long. */
static void distances(const loxo_soup *soup, loxo_order order, int method, bool is_run_long,
                      const loxo_index sources[2], double *distance)
{
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    loxo_mesh_settings mesh_settings = loxo_mesh_settings_default();
    loxo_geodesic_settings settings = unjudged_settings((loxo_geodesic_method)method);
    loxo_mesh *mesh;
    mesh_settings.order = order;
    settings.diffusion_tolerance = 1e-8;
    if (is_run_long) {
        settings.penalty = 10.0;
        settings.n_iterations = 1500;
        settings.global_constraints = true; /* two sources: else the answer depends on where their trees meet */
        settings.primal_tolerance = settings.dual_tolerance = 0.0;
    }
    CHECK_OK(loxo_mesh_create(test_context, &arrays, LOXO_COPY, &mesh_settings, NULL, &mesh));
    CHECK_OK(loxo_geodesic_distance(test_context, mesh, &settings, sources, 2, distance, NULL));
    loxo_mesh_destroy(mesh);
}

static const loxo_index two[] = {7, 300};

TEST(place_and_size_do_not_matter)
{
    static const double scales[] = {1.0, 1e-3, 1e6, 0x1p-40};
    /* Rows are the images of the axes: a turn by two angles. */
    const double c = cos(0.7), d = sin(0.7), e = cos(-1.9), f = sin(-1.9);
    const double turn[3][3] = {{c, d, 0.0}, {-d * e, c * e, f}, {d * f, -c * f, e}};
    loxo_soup soup = soup_make(test_context, LOXO_SHAPE_NOISY, 1500, NAN);
    const int64_t n = soup.n_vertices;
    double *distance = loxo_allocate(test_context, n, sizeof(double));
    double *other = loxo_allocate(test_context, n, sizeof(double));
    double *position = loxo_allocate(test_context, 3 * n, sizeof(double));
    memcpy(position, soup.position, (size_t)(3 * n) * sizeof(double));
    for (int method = 0; method < 2; ++method) {
        memcpy(soup.position, position, (size_t)(3 * n) * sizeof(double));
        distances(&soup, LOXO_ORDER_GIVEN, method, false, two, distance);
        for (int i = 0; i < 4; ++i) {
            for (int64_t v = 0; v < n; ++v)
                for (int k = 0; k < 3; ++k) {
                    const double *x = position + 3 * v;
                    soup.position[3 * v + k] = scales[i] * (turn[0][k] * x[0] + turn[1][k] * x[1] + turn[2][k] * x[2]);
                }
            distances(&soup, LOXO_ORDER_GIVEN, method, false, two, other);
            const double off = difference(n, distance, other, 1.0 / scales[i]);
            print_message("%s, turned, times %g: %.1e\n", method_names[method], scales[i], off);
            CHECK(off < 1e-6); /* weights of the diffusion are kept in float */
        }
        /* Scaled by a power of two, every step rounds alike. */
        for (int64_t i = 0; i < 3 * n; ++i)
            soup.position[i] = 0x1p20 * position[i];
        distances(&soup, LOXO_ORDER_GIVEN, method, false, two, other);
        CHECK_EQUAL(difference(n, distance, other, 0x1p-20), 0.0);
    }
    loxo_release(test_context, distance);
    loxo_release(test_context, other);
    loxo_release(test_context, position);
    loxo_soup_destroy(test_context, &soup);
}

TEST(numbering_does_not_matter)
{
    loxo_soup soup = soup_make(test_context, LOXO_SHAPE_NOISY, 400, NAN);
    const int64_t n = soup.n_vertices;
    double *distance = loxo_allocate(test_context, 2 * n, sizeof(double));
    double *other = loxo_allocate(test_context, n, sizeof(double));
    double *back = loxo_allocate(test_context, n, sizeof(double));
    loxo_index *origin = NULL, sources[2] = {-1, -1};
    for (int method = 0; method < 2; ++method)
        distances(&soup, LOXO_ORDER_GIVEN, method, true, two, distance + method * n);
    CHECK_OK(loxo_soup_shuffle(test_context, &soup, 5, &origin));
    for (int64_t v = 0; v < n; ++v)
        for (int i = 0; i < 2; ++i)
            if (origin[v] == two[i]) sources[i] = (loxo_index)v;
    CHECK(sources[0] >= 0 && sources[1] >= 0);
    for (int method = 0; method < 2; ++method) {
        distances(&soup, LOXO_ORDER_GIVEN, method, true, sources, other);
        for (int64_t v = 0; v < n; ++v)
            back[origin[v]] = other[v];
        const double off = difference(n, distance + method * n, back, 1.0);
        print_message("%s, renumbered: %.1e\n", method_names[method], off);
        CHECK(off < 1e-6);
    }
    loxo_release(test_context, distance);
    loxo_release(test_context, other);
    loxo_release(test_context, back);
    loxo_release(test_context, origin);
    loxo_soup_destroy(test_context, &soup);
}

TEST(order_in_memory_does_not_matter)
{
    static const loxo_order orders[] = {LOXO_ORDER_MORTON, LOXO_ORDER_HILBERT, LOXO_ORDER_BFS, LOXO_ORDER_METIS,
                                        LOXO_ORDER_METIS_ND};
    loxo_soup soup = soup_make(test_context, LOXO_SHAPE_NOISY, 400, NAN);
    const int64_t n = soup.n_vertices;
    double *distance = loxo_allocate(test_context, n, sizeof(double));
    double *other = loxo_allocate(test_context, n, sizeof(double));
    const bool has_metis = strstr(loxo_build_features(), "metis off") == NULL;
    CHECK_OK(loxo_soup_shuffle(test_context, &soup, 5, NULL));
    for (int method = 0; method < 2; ++method) {
        distances(&soup, LOXO_ORDER_GIVEN, method, true, two, distance);
        for (int i = 0; i < (has_metis ? 5 : 3); ++i) {
            distances(&soup, orders[i], method, true, two, other);
            const double off = difference(n, distance, other, 1.0);
            print_message("%s, order %d: %.1e\n", method_names[method], (int)orders[i], off);
            CHECK(off < 1e-6);
            CHECK_EQUAL(other[two[0]], 0.0); /* they come back in the caller's order */
            CHECK_EQUAL(other[two[1]], 0.0);
        }
    }
    loxo_release(test_context, distance);
    loxo_release(test_context, other);
    loxo_soup_destroy(test_context, &soup);
}

TEST(width_of_the_positions_does_not_matter)
{
    loxo_soup soup = soup_make(test_context, LOXO_SHAPE_NOISY, 1500, NAN);
    const int64_t n = soup.n_vertices;
    double *distance = loxo_allocate(test_context, n, sizeof(double)), *position = soup.position;
    double *other = loxo_allocate(test_context, n, sizeof(double));
    float *narrow = loxo_allocate(test_context, 3 * n, sizeof(float));
    for (int64_t i = 0; i < 3 * n; ++i) {
        narrow[i] = (float)position[i];
        position[i] = (double)narrow[i];
    }
    for (int method = 0; method < 2; ++method) {
        soup.position = position;
        soup.position_float = NULL;
        distances(&soup, LOXO_ORDER_GIVEN, method, false, two, distance);
        soup.position = NULL;
        soup.position_float = narrow;
        distances(&soup, LOXO_ORDER_GIVEN, method, false, two, other);
        CHECK(memcmp(distance, other, (size_t)n * sizeof(double)) == 0); /* all arithmetic is in double */
    }
    soup.position = position;
    loxo_release(test_context, distance);
    loxo_release(test_context, other);
    loxo_soup_destroy(test_context, &soup);
}
