/* SPDX-License-Identifier: MIT
 * From intrinsic triangulations back to their surfaces: edges as polylines, points, segments. */
#include "../shapes.h"
#include "base/rng.h"
#include "kernel/layout_kernel.h"
#include "mesh/intrinsic/overlay.h"

#include <loxo/io.h>

typedef struct pair {
    loxo_mesh *surface, *mesh;
    loxo_intrinsic_info info;
    double mean;
} pair;

static pair pair_of(loxo_soup soup)
{
    pair p = {0};
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    CHECK_OK(loxo_mesh_create(test_context, &arrays, LOXO_ADOPT, NULL, NULL, &p.surface));
    CHECK_OK(loxo_mesh_create_intrinsic(test_context, p.surface, NULL, &p.info, &p.mesh));
    const loxo_mesh_view m = loxo_mesh_get_view(p.mesh);
    for (int64_t h = 0; h < 3 * m.n_faces; ++h)
        p.mean += m.halfedge_length[h] / (double)(3 * m.n_faces);
    CHECK(loxo_is_traceable(p.mesh));
    return p;
}

static void pair_destroy(pair *p)
{
    loxo_mesh_destroy(p->mesh);
    loxo_mesh_destroy(p->surface);
}

static loxo_soup read_soup(const char *name)
{
    const char *path = test_shared(name);
    loxo_soup soup = {0};
    if (path == NULL) SKIP();
    CHECK_OK(loxo_read_mesh(test_context, path, NULL, &soup));
    loxo_context_clear(test_context);
    return soup;
}

static loxo_vec3 on_edge(const loxo_mesh_view *m, loxo_edge_point p)
{
    const loxo_vec3 a = k_position(m, m->halfedge_vertex[p.halfedge]), b = k_position(m, k_head(m, p.halfedge));
    return v3_axpy(a, p.share, v3_sub(b, a));
}

static loxo_vec3 in_face(const loxo_mesh_view *m, const loxo_face_point *p)
{
    loxo_vec3 sum = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; ++k)
        sum = v3_axpy(sum, p->weight[k], k_position(m, m->halfedge_vertex[3 * (int64_t)p->face + k]));
    return sum;
}

static double distance(loxo_vec3 a, loxo_vec3 b) { return v3_norm(v3_sub(a, b)); }

/* One intrinsic edge: begins and ends at its vertices, each of its pieces lies in one face, and the pieces, measured between
 * points in space, are together as long as the edge. */
static void check_edge(const pair *p, loxo_index h, loxo_edge_point *crossing, double tolerance)
{
    const loxo_mesh_view m = loxo_mesh_get_view(p->mesh), s = loxo_mesh_get_view(p->surface);
    const int64_t n = loxo_edge_n_crossings(p->mesh, h);
    const double length = m.halfedge_length[h], traced = loxo_trace_edge(p->mesh, h, crossing);
    const loxo_vec3 end = k_position(&m, k_head(&m, h));
    loxo_vec3 at = k_position(&m, m.halfedge_vertex[h]);
    double sum = 0.0;
    CHECK_NEAR(traced, length, tolerance * p->mean);
    for (int64_t i = 0; i < n; ++i) {
        const loxo_index leaving = crossing[i].halfedge;
        const loxo_vec3 next = on_edge(&s, crossing[i]);
        CHECK(crossing[i].share >= 0.0 && crossing[i].share <= 1.0);
        CHECK(s.halfedge_twin[leaving] >= 0);
        if (i == 0) CHECK_EQUAL(s.halfedge_vertex[k_previous(leaving)], m.halfedge_vertex[h]);
        if (i > 0) CHECK_EQUAL(leaving / 3, s.halfedge_twin[crossing[i - 1].halfedge] / 3);
        if (i == n - 1) CHECK_EQUAL(s.halfedge_vertex[k_previous(s.halfedge_twin[leaving])], k_head(&m, h));
        sum += distance(at, next);
        at = next;
    }
    sum += distance(at, end);
    /* Flat faces that were made longer by e are some sqrt(e length) high. */
    CHECK_NEAR(sum, length, tolerance * p->mean + (double)(n + 1) * sqrt(p->info.lengthened * p->mean));
}

static void count(void *user, loxo_edge_point point)
{
    (void)point;
    ++*(int64_t *)user;
}

/* All edges, both ways, and the surface's over the triangulation: each crossing is seen from both. */
static void check_edges(loxo_soup soup, double tolerance)
{
    pair p = pair_of(soup);
    const loxo_mesh_view m = loxo_mesh_get_view(p.mesh), s = loxo_mesh_get_view(p.surface);
    int64_t n_crossings = 0, n_seen = 0, most = 0;
    for (int64_t h = 0; h < 3 * m.n_faces; ++h)
        if (loxo_edge_n_crossings(p.mesh, (loxo_index)h) > most) most = loxo_edge_n_crossings(p.mesh, (loxo_index)h);
    loxo_edge_point *crossing = calloc((size_t)most + 1, sizeof *crossing);
    for (int64_t h = 0; h < 3 * m.n_faces; ++h) {
        check_edge(&p, (loxo_index)h, crossing, tolerance);
        n_crossings += loxo_edge_n_crossings(p.mesh, (loxo_index)h);
    }
    for (int64_t h = 0; h < 3 * s.n_faces; ++h) {
        double length[3];
        k_face_lengths(&s, h / 3, length);
        CHECK_NEAR(loxo_trace_surface_edge(p.mesh, (loxo_index)h, count, &n_seen), length[h % 3] + p.info.lengthened,
                   tolerance * p.mean);
    }
    CHECK_EQUAL(n_crossings, n_seen);
    CHECK(n_crossings >= p.info.n_flips / 100);
    free(crossing);
    pair_destroy(&p);
}

TEST(edges_are_polylines_on_the_surface)
{
    check_edges(shape_cube(test_context), 1e-12);
    check_edges(shape_hub(test_context, 40), 1e-12);
    check_edges(shape_torus(test_context, 30, 7), 1e-12);
    check_edges(shape_annulus(test_context, 50, 3), 1e-12);
    check_edges(shape_genus(test_context, 3, 700), 1e-12);
    check_edges(shape_stretched(LOXO_SHAPE_NOISY, 2000, 0.4, 1.0, 0.0), 1e-11);
    check_edges(shape_stretched(LOXO_SHAPE_DISK, 2000, (double)NAN, 10.0, 0.0), 1e-11);
    check_edges(shape_stretched(LOXO_SHAPE_GRID, 900, (double)NAN, 1.0, 30.0), 1e-9); /* hundreds of faces unfolded */
    check_edges(shape_stretched(LOXO_SHAPE_NOISY, 3000, 0.5, 30.0, 0.0), 1e-9); /* edges from a vertex to itself */
    check_edges(shape_stretched(LOXO_SHAPE_CYLINDER, 60, 0.05, 1.0, 0.0), 1e-12);
}

TEST(edges_of_scans_are_polylines)
{
    NEEDS_IDS(300000);
    check_edges(read_soup("meshes/surfaces/camel10k.off.gz"), 1e-9);
    check_edges(read_soup("meshes/surfaces/fandisk.obj.gz"), 1e-9);
    check_edges(read_soup("meshes/surfaces/homer6k.obj.gz"), 1e-9);
    check_edges(read_soup("meshes/surfaces/moai48k-slivers.ply"), 1e-9);
}

static loxo_face_point random_point(int64_t n_faces, uint64_t i)
{
    const double a = loxo_random_unit(11, 3 * i), b = loxo_random_unit(11, 3 * i + 1);
    loxo_face_point p = {.face = (loxo_index)((double)n_faces * loxo_random_unit(11, 3 * i + 2))};
    p.weight[0] = fmin(a, b);
    p.weight[1] = fmax(a, b) - p.weight[0];
    p.weight[2] = 1.0 - (p.weight[0] + p.weight[1]);
    return p;
}

static void check_point(const loxo_face_point *p, int64_t n_faces)
{
    CHECK(p->face >= 0 && p->face < n_faces);
    for (int k = 0; k < 3; ++k)
        CHECK(p->weight[k] >= 0.0);
    CHECK_NEAR(p->weight[0] + p->weight[1] + p->weight[2], 1.0, 1e-15);
}

/* There and back. In the plane the place over there is known, too. */
static void check_points(loxo_soup soup, bool is_flat, double tolerance)
{
    pair p = pair_of(soup);
    const loxo_mesh_view m = loxo_mesh_get_view(p.mesh), s = loxo_mesh_get_view(p.surface);
    for (uint64_t i = 0; i < 3000; ++i) {
        const loxo_face_point a = random_point(s.n_faces, i), b = loxo_to_intrinsic(p.mesh, &a);
        const loxo_face_point c = loxo_to_surface(p.mesh, &b);
        check_point(&b, m.n_faces);
        check_point(&c, s.n_faces);
        CHECK_NEAR(distance(in_face(&s, &a), in_face(&s, &c)), 0.0, tolerance * p.mean);
        if (is_flat) CHECK_NEAR(distance(in_face(&s, &a), in_face(&m, &b)), 0.0, tolerance * p.mean);
    }
    for (int64_t h = 0; h < 3 * s.n_faces; h += 7) { /* corners stay corners */
        loxo_face_point a = {.face = (loxo_index)(h / 3)};
        a.weight[h % 3] = 1.0;
        const loxo_face_point b = loxo_to_intrinsic(p.mesh, &a), c = loxo_to_surface(p.mesh, &b);
        for (int k = 0; k < 3; ++k) {
            if (b.weight[k] == 1.0) CHECK_EQUAL(m.halfedge_vertex[3 * (int64_t)b.face + k], s.halfedge_vertex[h]);
            if (c.weight[k] == 1.0) CHECK_EQUAL(s.halfedge_vertex[3 * (int64_t)c.face + k], s.halfedge_vertex[h]);
        }
    }
    pair_destroy(&p);
}

/* Corners drawn from a few places: many faces are flat, many edges have no length, many vertices coincide. Whole numbers do not
 * mind: every edge begins and ends where it should, over faces that are neighbours. */
TEST(edges_end_where_they_should_however_flat_the_faces)
{
    int64_t n_flips = 0;
    for (uint64_t seed = 0; seed < 400; ++seed) {
        const int n_places = 2 + (int)(seed % 5);
        loxo_soup soup = seed % 3 == 0   ? shape_stretched(LOXO_SHAPE_ICOSPHERE, 60, (double)NAN, 1.0, 0.0)
                         : seed % 3 == 1 ? shape_torus(test_context, 7, 5)
                                         : shape_annulus(test_context, 9, 3);
        for (int64_t i = 0; i < 3 * soup.n_vertices; ++i)
            soup.position[i] = floor(n_places * loxo_random_unit(seed, (uint64_t)i));
        pair p = pair_of(soup);
        const loxo_mesh_view m = loxo_mesh_get_view(p.mesh), s = loxo_mesh_get_view(p.surface);
        n_flips += p.info.n_flips;
        CHECK(p.info.share_nondelaunay_after <= 0.01); /* one edge of one of them, by rounding */
        for (int64_t h = 0; h < 3 * m.n_faces; ++h) {
            loxo_edge_point crossing[1024];
            const int64_t n = loxo_edge_n_crossings(p.mesh, (loxo_index)h);
            CHECK(isfinite(m.halfedge_length[h]) && m.halfedge_length[h] > 0.0);
            CHECK(n < 1024 && isfinite(loxo_trace_edge(p.mesh, (loxo_index)h, crossing)));
            for (int64_t i = 0; i < n; ++i) {
                const loxo_index leaving = crossing[i].halfedge, entered = s.halfedge_twin[leaving];
                CHECK(crossing[i].share >= 0.0 && crossing[i].share <= 1.0);
                if (i == 0) CHECK_EQUAL(s.halfedge_vertex[k_previous(leaving)], m.halfedge_vertex[h]);
                if (i > 0) CHECK_EQUAL(leaving / 3, s.halfedge_twin[crossing[i - 1].halfedge] / 3);
                if (i == n - 1) CHECK_EQUAL(s.halfedge_vertex[k_previous(entered)], k_head(&m, (loxo_index)h));
            }
            CHECK(isfinite(loxo_trace_surface_edge(p.mesh, (loxo_index)h, NULL, NULL)));
            const loxo_face_point a = {(loxo_index)(h / 3), {0.5, 0.125, 0.375}};
            const loxo_face_point to = loxo_to_intrinsic(p.mesh, &a), from = loxo_to_surface(p.mesh, &a);
            CHECK(to.face >= 0 && to.face < m.n_faces && from.face >= 0 && from.face < s.n_faces);
        }
        pair_destroy(&p);
    }
    CHECK(n_flips > 2000);
}

TEST(points_are_found_there_and_back)
{
    check_points(shape_cube(test_context), false, 1e-12);
    check_points(shape_torus(test_context, 30, 7), false, 1e-11);
    check_points(shape_annulus(test_context, 50, 3), true, 1e-11);
    check_points(shape_stretched(LOXO_SHAPE_DISK, 2000, (double)NAN, 10.0, 0.0), true, 1e-10);
    check_points(shape_stretched(LOXO_SHAPE_GRID, 900, (double)NAN, 1.0, 30.0), true, 1e-8);
    check_points(shape_stretched(LOXO_SHAPE_NOISY, 2000, 0.5, 1.0, 0.0), false, 1e-11);
    check_points(shape_stretched(LOXO_SHAPE_NOISY, 3000, 0.5, 30.0, 0.0), false, 1e-8);
}

TEST(points_of_scans_are_found_there_and_back)
{
    NEEDS_IDS(300000);
    check_points(read_soup("meshes/surfaces/camel10k.off.gz"), false, 1e-7);
    check_points(read_soup("meshes/surfaces/homer6k.obj.gz"), false, 1e-7);
    check_points(read_soup("meshes/surfaces/moai48k-slivers.ply"), false, 1e-3); /* angles of 1e-5 */
}

typedef struct polyline {
    const loxo_mesh_view *s;
    loxo_vec3 at;
    double length;
    int64_t n;
} polyline;

static void append(void *user, loxo_edge_point point)
{
    polyline *line = user;
    const loxo_vec3 next = on_edge(line->s, point);
    line->length += distance(line->at, next);
    line->at = next;
    ++line->n;
}

/* A segment inside an intrinsic face is as long on the surface, and its ends are where points are. */
static void check_segments(loxo_soup soup, double tolerance)
{
    pair p = pair_of(soup);
    const loxo_mesh_view m = loxo_mesh_get_view(p.mesh), s = loxo_mesh_get_view(p.surface);
    int64_t n_crossings = 0;
    for (uint64_t i = 0; i < 3000; ++i) {
        loxo_face_point a = random_point(m.n_faces, i), b = random_point(m.n_faces, i + 5000), ends[2];
        loxo_vec3 corner[3], at[2] = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
        b.face = a.face;
        if (i % 5 == 0) a = (loxo_face_point){a.face, {i % 2 == 0 ? 1.0 : 0.0, i % 2 == 0 ? 0.0 : 1.0, 0.0}};
        if (i % 7 == 0) b = (loxo_face_point){a.face, {0.0, 0.0, 1.0}};
        k_face_corners(&m, a.face, corner);
        for (int k = 0; k < 3; ++k) {
            at[0] = v3_axpy(at[0], a.weight[k], corner[k]);
            at[1] = v3_axpy(at[1], b.weight[k], corner[k]);
        }
        polyline line = {.s = &s};
        loxo_trace_segment(p.mesh, &a, &b, NULL, NULL, ends);
        check_point(&ends[0], s.n_faces);
        check_point(&ends[1], s.n_faces);
        line.at = in_face(&s, &ends[0]);
        loxo_trace_segment(p.mesh, &a, &b, append, &line, NULL);
        line.length += distance(line.at, in_face(&s, &ends[1]));
        CHECK_NEAR(line.length, distance(at[0], at[1]), tolerance * p.mean);
        const loxo_face_point from = loxo_to_surface(p.mesh, &a), to = loxo_to_surface(p.mesh, &b);
        CHECK_NEAR(distance(in_face(&s, &from), in_face(&s, &ends[0])), 0.0, tolerance * p.mean);
        CHECK_NEAR(distance(in_face(&s, &to), in_face(&s, &ends[1])), 0.0, tolerance * p.mean);
        n_crossings += line.n;
    }
    CHECK(n_crossings > 50);
    pair_destroy(&p);
}

TEST(segments_are_polylines_on_the_surface)
{
    check_segments(shape_stretched(LOXO_SHAPE_DISK, 2000, (double)NAN, 10.0, 0.0), 1e-10);
    check_segments(shape_stretched(LOXO_SHAPE_NOISY, 2000, 0.5, 1.0, 0.0), 1e-10);
    check_segments(shape_stretched(LOXO_SHAPE_NOISY, 3000, 0.5, 30.0, 0.0), 1e-8);
}
