/* SPDX-License-Identifier: MIT
 * Intrinsic Delaunay triangulations: flips in the plane, what flips must not change, what holds at the end, and the usual
 * ways to fail. */
#include "../shapes.h"
#include "base/context.h"
#include "kernel/layout_kernel.h"
#include "mesh/mesh_internal.h"

#include <loxo/io.h>

#define PI 3.14159265358979323846

static loxo_mesh *mesh_of(loxo_context *ctx, loxo_soup *soup)
{
    loxo_mesh *mesh = NULL;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    const loxo_status status = loxo_mesh_create(ctx, &arrays, LOXO_ADOPT, NULL, NULL, &mesh);
    *soup = (loxo_soup){0};
    CHECK_STATUS(ctx, status, LOXO_OK);
    return mesh;
}

/* Twins, fans, boundaries, lengths: what the header promises of a view; edges from a vertex to itself are legal. */
static void check_view(const loxo_mesh *mesh)
{
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    int64_t n_met = 0;
    CHECK(m.halfedge_length != NULL);
    for (int64_t h = 0; h < 3 * m.n_faces; ++h) {
        const loxo_index t = m.halfedge_twin[h];
        CHECK(m.halfedge_length[h] > 0.0 && isfinite(m.halfedge_length[h]));
        if (t < 0) {
            CHECK_EQUAL(m.vertex_halfedge[m.halfedge_vertex[h]], h);
            continue;
        }
        CHECK(t != h);
        CHECK_EQUAL(m.halfedge_twin[t], h);
        CHECK_EQUAL(m.halfedge_vertex[t], k_head(&m, (loxo_index)h));
        CHECK_EQUAL(m.halfedge_vertex[h], k_head(&m, t));
        CHECK(memcmp(&m.halfedge_length[h], &m.halfedge_length[t], sizeof(double)) == 0);
    }
    for (int64_t v = 0; v < m.n_vertices; ++v) {
        loxo_index h = m.vertex_halfedge[v];
        if (h < 0) continue;
        do {
            CHECK_EQUAL(m.halfedge_vertex[h], v);
            n_met += 1;
            h = m.halfedge_twin[k_previous(h)];
        } while (h >= 0 && h != m.vertex_halfedge[v]);
    }
    CHECK_EQUAL(n_met, 3 * m.n_faces);
}

/* No angles opposite an edge sum to more than pi; 1e-9 of their cotangents is what rounding may leave undecided. */
static void check_delaunay(const loxo_mesh *mesh)
{
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    for (int64_t h = 0; h < 3 * m.n_faces; ++h) {
        const int64_t t = m.halfedge_twin[h];
        double a[3], b[3];
        if (t < 0) continue;
        k_cotangents_of(&m.halfedge_length[h - h % 3], a);
        k_cotangents_of(&m.halfedge_length[t - t % 3], b);
        CHECK(a[h % 3] + b[t % 3] >= -1e-9 * (1.0 + fabs(a[h % 3]) + fabs(b[t % 3])));
    }
}

static double angle_at(const double length[3], int corner)
{
    double cotangent[3];
    k_cotangents_of(length, cotangent);
    return atan2(1.0, cotangent[(corner + 1) % 3]);
}

typedef struct measures {
    double area, boundary, *angle; /* [n_vertices] around each vertex */
} measures;

static measures measure(const loxo_mesh *mesh, double lengthened)
{
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    measures all = {0.0, 0.0, calloc((size_t)m.n_vertices, sizeof(double))};
    for (int64_t f = 0; f < m.n_faces; ++f) {
        double length[3];
        k_face_lengths(&m, f, length);
        for (int k = 0; k < 3; ++k)
            length[k] += lengthened;
        all.area += k_area_of(length);
        for (int k = 0; k < 3; ++k) {
            all.angle[m.halfedge_vertex[3 * f + k]] += angle_at(length, k);
            if (m.halfedge_twin[3 * f + k] < 0) all.boundary += length[k];
        }
    }
    return all;
}

/* Makes it intrinsic and holds it against the surface: area, angles (so curvature, Gauss-Bonnet), boundary. Relative
 * errors: a flip adds some 1e-16 of its longest edge, which thin faces magnify; `tolerance` says by how much here. */
static loxo_intrinsic_info check_intrinsic(loxo_soup soup, double tolerance)
{
    loxo_intrinsic_info info;
    loxo_mesh *surface = mesh_of(test_context, &soup), *mesh;
    const int64_t n = loxo_mesh_n_vertices(surface);
    CHECK_OK(loxo_mesh_create_intrinsic(test_context, surface, NULL, &info, &mesh));
    check_view(mesh);
    check_delaunay(mesh);
    CHECK_EQUAL(loxo_mesh_n_vertices(mesh), n);
    CHECK_EQUAL(loxo_mesh_n_faces(mesh), loxo_mesh_n_faces(surface));
    CHECK_EQUAL(info.share_nondelaunay_after, 0.0);
    CHECK(info.quality_after >= info.quality_before - 1e-12 || info.n_flips > 0);
    measures before = measure(surface, info.lengthened), after = measure(mesh, 0.0);
    CHECK_NEAR(after.area, before.area, tolerance * before.area);
    CHECK_NEAR(after.boundary, before.boundary, 1e-13 * before.boundary);
    for (int64_t v = 0; v < loxo_mesh_get_view(mesh).n_vertices; ++v)
        CHECK_NEAR(after.angle[v], before.angle[v], tolerance);
    free(before.angle);
    free(after.angle);
    loxo_mesh_destroy(mesh);
    loxo_mesh_destroy(surface);
    return info;
}

TEST(a_long_diagonal_is_exchanged_for_the_short_one)
{
    static const double p[4][3] = {{-3, 0, 0}, {0, -1, 0}, {3, 0, 0}, {0, 1, 0}};
    static const int wrong[2][3] = {{0, 1, 2}, {0, 2, 3}}, right[2][3] = {{0, 1, 3}, {1, 2, 3}};
    for (int i = 0; i < 2; ++i) {
        loxo_soup soup = shape_of(test_context, 4, p, 2, i == 0 ? wrong : right);
        loxo_intrinsic_info info;
        loxo_mesh *surface = mesh_of(test_context, &soup), *mesh;
        CHECK_OK(loxo_mesh_create_intrinsic(test_context, surface, NULL, &info, &mesh));
        const loxo_mesh_view m = loxo_mesh_get_view(mesh);
        int n_inner = 0;
        check_view(mesh);
        CHECK_EQUAL(info.n_flips, i == 0 ? 1 : 0);
        CHECK_EQUAL(info.n_edges, 5);
        CHECK_EQUAL(info.share_nondelaunay_before, i == 0 ? 1.0 : 0.0);
        for (int h = 0; h < 6; ++h) {
            if (m.halfedge_twin[h] < 0) continue;
            ++n_inner;
            CHECK_NEAR(m.halfedge_length[h], 2.0, 4e-15); /* the sides are rounded roots */
            CHECK_EQUAL(m.halfedge_vertex[h] % 2, 1);
        }
        CHECK_EQUAL(n_inner, 2);
        CHECK(m.position == loxo_mesh_get_view(surface).position);
        loxo_mesh_destroy(mesh);
        loxo_mesh_destroy(surface);
    }
}

TEST(four_on_a_circle_are_left_alone)
{
    static const double p[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    static const int t[2][3] = {{0, 1, 2}, {0, 2, 3}};
    const loxo_intrinsic_info info = check_intrinsic(shape_of(test_context, 4, p, 2, t), 1e-15);
    CHECK_EQUAL(info.n_flips, 0);
}

TEST(random_quadrangles_of_the_plane_flip_right)
{
    for (uint64_t seed = 0; seed < 200; ++seed) {
        double p[4][3] = {{0}};
        static const int t[2][3] = {{0, 1, 2}, {0, 2, 3}};
        for (int i = 0; i < 4; ++i) { /* convex: one in each quadrant */
            const uint64_t key = 12 * seed + 3 * (uint64_t)i;
            const double angle = 0.5 * PI * (i + (double)((key * 2654435761u) % 1000) / 1001.0);
            const double r = 0.2 + (double)((key * 40503u) % 997) / 500.0;
            p[i][0] = r * cos(angle);
            p[i][1] = r * sin(angle);
        }
        const double x = p[3][0] - p[1][0], y = p[3][1] - p[1][1];
        const double a = p[2][0] - p[0][0], b = p[2][1] - p[0][1];
        const double side_1 = a * (p[1][1] - p[0][1]) - b * (p[1][0] - p[0][0]);
        const double side_3 = a * (p[3][1] - p[0][1]) - b * (p[3][0] - p[0][0]);
        if (side_1 > -0.01 || side_3 < 0.01) continue; /* the diagonal would run outside */
        loxo_soup soup = shape_of(test_context, 4, (const double(*)[3])p, 2, t);
        loxo_intrinsic_info info;
        loxo_mesh *surface = mesh_of(test_context, &soup), *mesh;
        CHECK_OK(loxo_mesh_create_intrinsic(test_context, surface, NULL, &info, &mesh));
        const loxo_mesh_view m = loxo_mesh_get_view(mesh);
        check_delaunay(mesh);
        for (int h = 0; h < 6 && info.n_flips == 1; ++h)
            if (m.halfedge_twin[h] >= 0)
                CHECK_NEAR(m.halfedge_length[h], sqrt(x * x + y * y), 1e-13); /* heights >= 0.002 */
        loxo_mesh_destroy(mesh);
        loxo_mesh_destroy(surface);
    }
}

TEST(shapes_become_delaunay_and_stay_what_they_are)
{
    check_intrinsic(shape_tetrahedron(test_context), 1e-14);
    check_intrinsic(shape_cube(test_context), 1e-14);
    check_intrinsic(shape_hub(test_context, 40), 1e-12);
    check_intrinsic(shape_torus(test_context, 30, 7), 1e-12);
    check_intrinsic(shape_annulus(test_context, 50, 3), 1e-12);
    check_intrinsic(shape_genus(test_context, 3, 700), 1e-12);
    check_intrinsic(shape_stretched(LOXO_SHAPE_LATLONG, 2000, (double)NAN, 1.0, 0.0), 1e-12);
    check_intrinsic(shape_stretched(LOXO_SHAPE_NOISY, 2000, 0.4, 1.0, 0.0), 1e-12);
    check_intrinsic(shape_stretched(LOXO_SHAPE_BUMPY, 3000, (double)NAN, 1.0, 0.0), 1e-12);
    check_intrinsic(shape_stretched(LOXO_SHAPE_DISK, 2000, (double)NAN, 10.0, 0.0),
                    1e-11); /* heights a tenth of edges */
    CHECK(check_intrinsic(shape_stretched(LOXO_SHAPE_GRID, 900, (double)NAN, 1.0, 30.0), 1e-10).n_flips > 2000);
}

TEST(edges_from_a_vertex_to_itself_are_legal)
{
    const loxo_intrinsic_info info =
        check_intrinsic(shape_stretched(LOXO_SHAPE_NOISY, 3000, 0.5, 30.0, 0.0), 1e-9); /* needles, 30 to 1 */
    CHECK(info.n_loops > 0);
    check_intrinsic(shape_stretched(LOXO_SHAPE_CYLINDER, 60, 0.05, 1.0, 0.0), 1e-12);
}

TEST(two_sides_of_one_triangle)
{
    static const double p[3][3] = {{0, 0, 0}, {5, 0, 0}, {2, 1, 0}};
    static const int t[2][3] = {{0, 1, 2}, {0, 2, 1}};
    const loxo_intrinsic_info info = check_intrinsic(shape_of(test_context, 3, p, 2, t), 1e-13);
    CHECK_EQUAL(info.n_edges, 3);
}

TEST(the_plane_has_no_negative_weights_in_the_end)
{
    const loxo_intrinsic_info info =
        check_intrinsic(shape_stretched(LOXO_SHAPE_DISK, 3000, (double)NAN, 8.0, 0.0), 1e-11);
    CHECK(info.share_nondelaunay_before > 0.3);
    CHECK(info.quality_after > 3.0 * info.quality_before);
}

/* Up to ties the result is one: generic vertices, any order of the faces. */
TEST(another_order_gives_the_same_triangulation)
{
    double sum[2], quality[2];
    for (int i = 0; i < 2; ++i) {
        loxo_soup soup = shape_stretched(LOXO_SHAPE_NOISY, 2000, 0.4, 3.0, 0.0);
        loxo_intrinsic_info info;
        if (i == 1) CHECK_OK(loxo_soup_shuffle(test_context, &soup, 7, NULL));
        loxo_mesh *surface = mesh_of(test_context, &soup), *mesh;
        CHECK_OK(loxo_mesh_create_intrinsic(test_context, surface, NULL, &info, &mesh));
        const loxo_mesh_view m = loxo_mesh_get_view(mesh);
        sum[i] = 0.0;
        for (int64_t h = 0; h < 3 * m.n_faces; ++h)
            sum[i] += m.halfedge_length[h];
        quality[i] = info.quality_after;
        loxo_mesh_destroy(mesh);
        loxo_mesh_destroy(surface);
    }
    CHECK_NEAR(sum[0], sum[1], 1e-11 * sum[0]);
    CHECK_NEAR(quality[0], quality[1], 1e-11);
}

TEST(every_number_of_threads_gives_the_same_bits)
{
    const int n_threads[4] = {1, 2, 3, 7};
    uint64_t hash = 0;
    for (int i = 0; i < 4; ++i) {
        loxo_context *ctx = test_context_with_threads(n_threads[i]);
        loxo_generate_settings noisy = loxo_generate_settings_default();
        loxo_soup soup = {0};
        noisy.shape = LOXO_SHAPE_NOISY;
        noisy.n_vertices = 5000;
        noisy.params[0] = 0.5;
        CHECK_STATUS(ctx, loxo_generate(ctx, &noisy, false, &soup), LOXO_OK);
        loxo_mesh *surface = mesh_of(ctx, &soup), *mesh;
        loxo_intrinsic_info info;
        CHECK_STATUS(ctx, loxo_mesh_create_intrinsic(ctx, surface, NULL, &info, &mesh), LOXO_OK);
        const loxo_mesh_view m = loxo_mesh_get_view(mesh);
        const size_t n = (size_t)m.n_faces * 3;
        const uint64_t mine =
            test_hash(m.halfedge_vertex, n * sizeof(loxo_index)) ^ test_hash(m.halfedge_twin, n * sizeof(loxo_index)) ^
            test_hash(m.vertex_halfedge, (size_t)m.n_vertices * sizeof(loxo_index)) ^
            test_hash(m.halfedge_length, n * sizeof(double)) ^ test_hash(mesh->crossing, n * sizeof(int32_t)) ^
            test_hash(mesh->surface_next, n * sizeof(loxo_index)) ^ test_hash(&info.quality_after, sizeof(double));
        if (i == 0) hash = mine;
        CHECK(info.n_flips > 0 && mine == hash);
        loxo_mesh_destroy(mesh);
        loxo_mesh_destroy(surface);
        loxo_context_destroy(ctx);
    }
}

TEST(faces_without_area_are_made_to_have_some)
{
    /* A vertex on an edge, and two vertices in one place. */
    static const double p[6][3] = {{0, 0, 0}, {2, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, -1, 0}, {1, 1, 0}};
    static const int t[5][3] = {{0, 2, 3}, {2, 1, 5}, {0, 1, 2}, {1, 0, 4}, {2, 5, 3}};
    loxo_soup soup = shape_of(test_context, 6, p, 5, t);
    loxo_intrinsic_info info;
    loxo_mesh *surface = mesh_of(test_context, &soup), *mesh;
    CHECK_OK(loxo_mesh_create_intrinsic(test_context, surface, NULL, &info, &mesh));
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    check_view(mesh);
    CHECK(info.lengthened > 0.0 && info.lengthened < 3e-9);
    CHECK(info.n_flips > 0);
    for (int64_t f = 0; f < m.n_faces; ++f)
        CHECK(k_area_of(&m.halfedge_length[3 * f]) > 0.0);
    loxo_mesh_destroy(mesh);
    loxo_mesh_destroy(surface);
}

TEST(too_few_flips_leave_a_triangulation)
{
    loxo_soup soup = shape_stretched(LOXO_SHAPE_DISK, 2000, (double)NAN, 10.0, 0.0);
    loxo_mesh *surface = mesh_of(test_context, &soup), *mesh;
    loxo_intrinsic_settings settings = loxo_intrinsic_settings_default();
    loxo_intrinsic_info info;
    settings.max_flips = 100;
    settings.traceable = false;
    CHECK_STATUS(test_context, loxo_mesh_create_intrinsic(test_context, surface, &settings, &info, &mesh),
                 LOXO_NOT_CONVERGED);
    CHECK_EQUAL(info.n_flips, 100);
    CHECK(info.share_nondelaunay_after > 0.1);
    CHECK(mesh->crossing == NULL && mesh->surface_next == NULL);
    check_view(mesh);
    size_t held, peak;
    loxo_mesh_estimate_intrinsic(loxo_mesh_n_vertices(surface), loxo_mesh_n_faces(surface), &settings, &held, &peak);
    CHECK_EQUAL(held, info.mesh_bytes);
    CHECK(peak >= info.peak_bytes);
    loxo_mesh_destroy(mesh);
    loxo_mesh_destroy(surface);
}

TEST(bad_calls_are_refused)
{
    static const double p[3][3] = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
    static const int t[1][3] = {{0, 1, 2}};
    loxo_soup cube = shape_cube(test_context), point = shape_of(test_context, 3, p, 1, t);
    loxo_soup none = shape_empty(test_context, 0, 0);
    loxo_mesh *surface = mesh_of(test_context, &cube), *flat = mesh_of(test_context, &point), *mesh, *again;
    loxo_intrinsic_settings settings = loxo_intrinsic_settings_default();
    CHECK_STATUS(NULL, loxo_mesh_create_intrinsic(NULL, surface, NULL, NULL, &mesh), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_mesh_create_intrinsic(test_context, NULL, NULL, NULL, &mesh), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_mesh_create_intrinsic(test_context, surface, NULL, NULL, NULL), LOXO_ERR_ARGUMENT);
    settings.mollify = 0.0;
    CHECK_STATUS(test_context, loxo_mesh_create_intrinsic(test_context, surface, &settings, NULL, &mesh),
                 LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_mesh_create_intrinsic(test_context, flat, NULL, NULL, &mesh), LOXO_ERR_MESH);
    CHECK(mesh == NULL);
    CHECK_OK(loxo_mesh_create_intrinsic(test_context, surface, NULL, NULL, &mesh));
    CHECK_STATUS(test_context, loxo_mesh_create_intrinsic(test_context, mesh, NULL, NULL, &again), LOXO_ERR_ARGUMENT);
    loxo_mesh_destroy(mesh);
    loxo_mesh_destroy(flat);
    loxo_mesh_destroy(surface);
    surface = mesh_of(test_context, &none);
    CHECK_OK(loxo_mesh_create_intrinsic(test_context, surface, NULL, NULL, &mesh));
    CHECK_EQUAL(loxo_mesh_n_faces(mesh), 0);
    loxo_mesh_destroy(mesh);
    loxo_mesh_destroy(surface);
}

static loxo_status create_in(loxo_context *ctx, void *surface)
{
    loxo_mesh *mesh;
    const loxo_status status = loxo_mesh_create_intrinsic(ctx, surface, NULL, NULL, &mesh);
    loxo_mesh_destroy(mesh);
    return status;
}

TEST(each_allocation_may_fail)
{
    loxo_soup soup = shape_torus(test_context, 20, 7);
    loxo_mesh *surface = mesh_of(test_context, &soup);
    CHECK(test_each_allocation_fails(create_in, surface) >= 8);
    loxo_mesh_destroy(surface);
}

static int stop_at_once(void *user, const loxo_progress *progress)
{
    (void)user;
    (void)progress;
    return 1;
}

TEST(the_monitor_can_stop_it)
{
    NEEDS_IDS(1000000); /* so large that it is asked: the monitor is called every 20 ms at most */
    loxo_soup soup = shape_stretched(LOXO_SHAPE_GRID, 100000, (double)NAN, 1.0, 30.0);
    loxo_mesh *surface = mesh_of(test_context, &soup), *mesh;
    loxo_context_set_monitor(test_context, stop_at_once, NULL);
    CHECK_STATUS(test_context, loxo_mesh_create_intrinsic(test_context, surface, NULL, NULL, &mesh), LOXO_ERR_STOPPED);
    CHECK(mesh == NULL);
    loxo_mesh_destroy(surface);
}

TEST(scans_become_delaunay)
{
    static const char *const names[] = {"meshes/surfaces/moai48k-slivers.ply",     "meshes/surfaces/camel10k.off.gz",
                                        "meshes/surfaces/bunny35k-slivers.off.gz", "meshes/surfaces/fandisk.obj.gz",
                                        "meshes/surfaces/homer6k.obj.gz",          "meshes/surfaces/horse20k.off.gz"};
    NEEDS_IDS(300000);
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i) {
        const char *path = test_shared(names[i]);
        loxo_soup soup = {0};
        if (path == NULL) SKIP();
        CHECK_OK(loxo_read_mesh(test_context, path, NULL, &soup));
        loxo_context_clear(test_context);
        check_intrinsic(soup, 1e-8); /* slivers; the others keep 1e-11 */
    }
}
