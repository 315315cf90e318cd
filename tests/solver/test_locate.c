/* SPDX-License-Identifier: MIT
 * The inverse of a map to the sphere: images of vertices give these vertices, points lie in their triangles, all faces asked one by one
 * agree, folded maps have an answer. */
#include "base/rng.h"
#include "kernel/closest_kernel.h"
#include "kernel/locate_kernel.h"
#include "stopper.h"
#include "surfaces.h"

#include <loxo/locate.h>

#define N_VERTICES 2000
#define N_QUERIES  3000

/* A sphere whose map is its positions. */
static surface ball_make(loxo_order order)
{
    return surface_from_soup(test_context, soup_make(test_context, LOXO_SHAPE_ICOSPHERE, N_VERTICES, NAN), order);
}

static loxo_sphere_locator *locator_make(const surface *s, const double *map)
{
    loxo_sphere_locator *locator = NULL;
    CHECK_OK(loxo_sphere_locator_create(s->ctx, s->mesh, map, &locator));
    return locator;
}

/* Evenly spread, of lengths from 1e-3 to 1e3. */
static void random_direction(uint64_t i, double q[3])
{
    const double z = 2.0 * loxo_random_unit(5, 3 * i) - 1.0, angle = 6.283185307179586 * loxo_random_unit(5, 3 * i + 1);
    const double length = pow(10.0, 6.0 * loxo_random_unit(5, 3 * i + 2) - 3.0), r = sqrt(1.0 - z * z);
    q[0] = length * r * cos(angle);
    q[1] = length * r * sin(angle);
    q[2] = length * z;
}

static double *random_directions(int64_t n)
{
    double *q = loxo_allocate(test_context, 3 * n, sizeof *q);
    for (int64_t i = 0; i < n; ++i)
        random_direction((uint64_t)i, &q[3 * i]);
    return q;
}

static loxo_vec3 image(const loxo_surface_point *p, const double *map)
{
    loxo_vec3 x = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; ++k)
        if (p->vertex[k] >= 0) x = v3_axpy(x, p->weight[k], v3_load(&map[3 * (int64_t)p->vertex[k]]));
    return x;
}

/* |p x q| / |p| |q|, the sine of the angle between two directions; 2 where they are opposite. */
static double angle_between(loxo_vec3 p, loxo_vec3 q)
{
    if (v3_dot(p, q) < 0.0) return 2.0;
    return v3_norm(v3_cross(p, q)) / (v3_norm(p) * v3_norm(q));
}

TEST(images_of_vertices_give_the_vertices)
{
    static const loxo_order orders[] = {LOXO_ORDER_GIVEN, LOXO_ORDER_HILBERT};
    for (int o = 0; o < 2; ++o) {
        surface s = ball_make(orders[o]);
        const int64_t n = s.soup.n_vertices;
        loxo_sphere_locator *locator = locator_make(&s, s.soup.position);
        loxo_surface_point *point = loxo_allocate(test_context, n, sizeof *point);
        double *away = loxo_allocate(test_context, n, sizeof *away);
        CHECK_OK(loxo_sphere_locate(locator, n, s.soup.position, point, away));
        for (int64_t v = 0; v < n; ++v) {
            int n_used = 0;
            for (int k = 0; k < 3; ++k) {
                if (point[v].vertex[k] < 0) continue;
                CHECK_EQUAL(point[v].vertex[k], v);
                CHECK(point[v].weight[k] == 1.0);
                ++n_used;
            }
            CHECK_EQUAL(n_used, 1);
            CHECK(away[v] == 0.0);
        }
        loxo_release(test_context, away);
        loxo_release(test_context, point);
        loxo_sphere_locator_destroy(locator);
        surface_destroy(&s);
    }
}

/* The point found has the direction asked for, up to some roundings over the size of a triangle; weights are none but of one face. */
TEST(points_lie_in_their_triangles)
{
    surface s = ball_make(LOXO_ORDER_AUTO);
    loxo_sphere_locator *locator = locator_make(&s, s.soup.position);
    loxo_surface_point *point = loxo_allocate(test_context, N_QUERIES, sizeof *point);
    double *away = loxo_allocate(test_context, N_QUERIES, sizeof *away), *q = random_directions(N_QUERIES);
    CHECK_OK(loxo_sphere_locate(locator, N_QUERIES, q, point, away));
    for (int64_t i = 0; i < N_QUERIES; ++i) {
        double sum = 0.0;
        for (int k = 0; k < 3; ++k) {
            CHECK(point[i].weight[k] >= 0.0 && (point[i].vertex[k] >= 0) == (point[i].weight[k] > 0.0));
            sum += point[i].weight[k];
        }
        CHECK_NEAR(sum, 1.0, 4e-16);
        CHECK(angle_between(image(&point[i], s.soup.position), v3_load(&q[3 * i])) < 1e-14);
        CHECK(away[i] == 0.0);
    }
    loxo_release(test_context, q);
    loxo_release(test_context, away);
    loxo_release(test_context, point);
    loxo_sphere_locator_destroy(locator);
    surface_destroy(&s);
}

/* All faces one by one: the first that holds the direction, else the nearest. */
static void look_at_all(const surface *s, const double *map, loxo_vec3 q, loxo_surface_point *point, double *away)
{
    const loxo_mesh_view m = loxo_mesh_get_view(s->mesh);
    double least = HUGE_VAL;
    for (int64_t f = 0; f < m.n_faces; ++f) {
        loxo_vec3 c[3];
        loxo_index corner[3];
        double weight[3];
        for (int k = 0; k < 3; ++k) {
            const loxo_index v = m.halfedge_vertex[3 * f + k];
            corner[k] = m.vertex_origin != NULL ? m.vertex_origin[v] : v;
            c[k] = v3_load(&map[3 * (int64_t)corner[k]]);
        }
        const bool is_inside = k_cone_weights(q, c[0], c[1], c[2], weight);
        const double square = is_inside ? 0.0 : k_closest_in_triangle(q, c[0], c[1], c[2], weight);
        if (!is_inside && !(square < least)) continue;
        least = square;
        for (int k = 0; k < 3; ++k) {
            point->vertex[k] = weight[k] != 0.0 ? corner[k] : (loxo_index)-1;
            point->weight[k] = weight[k];
        }
        if (is_inside) break;
    }
    *away = sqrt(least);
}

/* 0: nearly all of the sphere in 1e-9 of it; 1: noise, which folds; 2: all on the northern half. */
static void make_map(int kind, const surface *s, double *map)
{
    for (int64_t v = 0; v < s->soup.n_vertices; ++v) {
        loxo_vec3 x = v3_load(&s->soup.position[3 * v]);
        if (kind == 0) { /* a boost: stereographic projection from the south pole, times 1e-9 */
            const double r = 1e-9 * hypot(x.x, x.y) / (1.0 + x.z), turn = atan2(x.y, x.x);
            if (x.z > -0.999999)
                x = v3_scale(1.0 / (1.0 + r * r), (loxo_vec3){2.0 * r * cos(turn), 2.0 * r * sin(turn), 1.0 - r * r});
        } else if (kind == 1) {
            x.x += 0.1 * (loxo_random_unit(9, (uint64_t)(3 * v)) - 0.5);
            x.y += 0.1 * (loxo_random_unit(9, (uint64_t)(3 * v + 1)) - 0.5);
            x.z += 0.1 * (loxo_random_unit(9, (uint64_t)(3 * v + 2)) - 0.5);
        } else {
            x.z = fabs(x.z) + 0.1;
        }
        v3_store(&map[3 * v], v3_scale(1.0 / v3_norm(x), x));
    }
}

TEST(all_faces_one_by_one_agree)
{
    surface s = ball_make(LOXO_ORDER_HILBERT);
    double *map = loxo_allocate(test_context, 3 * s.soup.n_vertices, sizeof *map), *q = random_directions(N_QUERIES);
    loxo_surface_point *point = loxo_allocate(test_context, N_QUERIES, sizeof *point);
    double *away = loxo_allocate(test_context, N_QUERIES, sizeof *away);
    for (int kind = 0; kind < 3; ++kind) {
        int64_t n_outside = 0;
        make_map(kind, &s, map);
        for (int64_t i = 0; i < N_QUERIES; ++i) { /* of 0 near the pole, where its triangles are */
            random_direction((uint64_t)i, &q[3 * i]);
            if (kind > 0) continue;
            for (int k = 0; k < 3; ++k)
                q[3 * i + k] = k == 2 ? 1.0 : 1e-8 * (loxo_random_unit(3, (uint64_t)(3 * i + k)) - 0.5);
        }
        for (int64_t i = 0; i < N_QUERIES; ++i) { /* unit vectors, for the same roundings */
            const double norm = v3_norm(v3_load(&q[3 * i]));
            for (int k = 0; k < 3; ++k)
                q[3 * i + k] /= norm;
        }
        loxo_sphere_locator *locator = locator_make(&s, map);
        CHECK_OK(loxo_sphere_locate(locator, N_QUERIES, q, point, away));
        for (int64_t i = 0; i < N_QUERIES; ++i) {
            loxo_surface_point want = {.vertex = {-1, -1, -1}};
            double want_away;
            look_at_all(&s, map, v3_load(&q[3 * i]), &want, &want_away);
            CHECK_NEAR(away[i], want_away, 1e-15);
            CHECK(v3_norm(v3_sub(image(&point[i], map), image(&want, map))) <= 1e-14);
            n_outside += away[i] > 0.0;
        }
        CHECK(kind == 2 ? n_outside > N_QUERIES / 4 : n_outside == 0);
        loxo_sphere_locator_destroy(locator);
    }
    loxo_release(test_context, away);
    loxo_release(test_context, point);
    loxo_release(test_context, q);
    loxo_release(test_context, map);
    surface_destroy(&s);
}

/* Middles of edges lie in one of the two faces at the edge, or in both; weights are one half to rounding over the edge's length. */
TEST(points_on_edges)
{
    surface s = ball_make(LOXO_ORDER_AUTO);
    const int64_t n = 3 * s.soup.n_faces;
    double *q = loxo_allocate(test_context, 3 * n, sizeof *q);
    loxo_surface_point *point = loxo_allocate(test_context, n, sizeof *point);
    loxo_sphere_locator *locator = locator_make(&s, s.soup.position);
    for (int64_t h = 0; h < n; ++h) {
        const loxo_index a = s.soup.triangle[h], b = s.soup.triangle[h - h % 3 + (h + 1) % 3];
        for (int k = 0; k < 3; ++k)
            q[3 * h + k] = s.soup.position[3 * (int64_t)a + k] + s.soup.position[3 * (int64_t)b + k];
    }
    CHECK_OK(loxo_sphere_locate(locator, n, q, point, NULL));
    for (int64_t h = 0; h < n; ++h) {
        const loxo_index a = s.soup.triangle[h], b = s.soup.triangle[h - h % 3 + (h + 1) % 3];
        double of_ends = 0.0;
        for (int k = 0; k < 3; ++k) {
            if (point[h].vertex[k] != a && point[h].vertex[k] != b) continue;
            CHECK_NEAR(point[h].weight[k], 0.5, 1e-13);
            of_ends += point[h].weight[k];
        }
        CHECK_NEAR(of_ends, 1.0, 1e-13);
    }
    loxo_sphere_locator_destroy(locator);
    loxo_release(test_context, point);
    loxo_release(test_context, q);
    surface_destroy(&s);
}

/* A tetrahedron: triangles that bulge more than they are wide. */
TEST(large_triangles)
{
    static const double position[12] = {1, 1, 1, -1, -1, 1, -1, 1, -1, 1, -1, -1};
    static const loxo_index triangle[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    surface s = surface_small(test_context, 4, position, 4, triangle);
    loxo_sphere_locator *locator = locator_make(&s, position);
    for (uint64_t i = 0; i < 1000; ++i) {
        loxo_surface_point point;
        double q[3], away;
        random_direction(i, q);
        CHECK_OK(loxo_sphere_locate(locator, 1, q, &point, &away));
        CHECK(away == 0.0 && angle_between(image(&point, position), v3_load(q)) < 1e-15);
    }
    loxo_sphere_locator_destroy(locator);
    surface_destroy(&s);
}

TEST(bad_input_is_named)
{
    surface s = ball_make(LOXO_ORDER_AUTO);
    loxo_sphere_locator *locator = NULL;
    loxo_surface_point point;
    double q[6] = {1, 0, 0, 0, 0, 0};
    CHECK_STATUS(test_context, loxo_sphere_locator_create(test_context, s.mesh, NULL, &locator), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_sphere_locator_create(test_context, NULL, q, &locator), LOXO_ERR_ARGUMENT);
    const double kept = s.soup.position[16];
    s.soup.position[16] = NAN;
    CHECK_STATUS(test_context, loxo_sphere_locator_create(test_context, s.mesh, s.soup.position, &locator),
                 LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 5);
    CHECK(locator == NULL);
    s.soup.position[16] = kept;
    locator = locator_make(&s, s.soup.position);
    CHECK_STATUS(test_context, loxo_sphere_locate(locator, -1, q, &point, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_sphere_locate(locator, 1, NULL, &point, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_sphere_locate(locator, 2, q, &point, NULL), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 1);
    CHECK_STATUS(test_context, loxo_sphere_locate(NULL, 1, q, &point, NULL), LOXO_ERR_ARGUMENT);
    CHECK_OK(loxo_sphere_locate(locator, 0, NULL, NULL, NULL));
    loxo_sphere_locator_destroy(locator);
    loxo_sphere_locator_destroy(NULL);
    surface_destroy(&s);
}

static uint64_t hash_of_points(loxo_context *ctx, const void *arg)
{
    surface s = surface_from_soup(ctx, soup_make(ctx, LOXO_SHAPE_ICOSPHERE, 10000, NAN), LOXO_ORDER_HILBERT);
    const double *q = arg;
    loxo_surface_point *point = loxo_allocate(ctx, N_QUERIES, sizeof *point);
    loxo_sphere_locator *locator = NULL;
    CHECK_STATUS(ctx, loxo_sphere_locator_create(ctx, s.mesh, s.soup.position, &locator), LOXO_OK);
    memset(point, 0, N_QUERIES * sizeof *point);
    CHECK_STATUS(ctx, loxo_sphere_locate(locator, N_QUERIES, q, point, NULL), LOXO_OK);
    uint64_t hash = 0;
    for (int64_t i = 0; i < N_QUERIES; ++i)
        hash = 31 * hash + (test_hash(point[i].vertex, sizeof point[i].vertex) ^
                            test_hash(point[i].weight, sizeof point[i].weight));
    loxo_sphere_locator_destroy(locator);
    loxo_release(ctx, point);
    surface_destroy(&s);
    return hash;
}

TEST(same_bits_for_any_threads)
{
    double *q = random_directions(N_QUERIES);
    NEEDS_IDS(60000);
    test_same_for_any_threads(hash_of_points, q);
    loxo_release(test_context, q);
}

static loxo_status make_one(loxo_context *ctx, void *arg)
{
    const surface *s = arg;
    loxo_sphere_locator *locator = NULL;
    const loxo_status status = loxo_sphere_locator_create(ctx, s->mesh, s->soup.position, &locator);
    CHECK((status >= 0) == (locator != NULL));
    loxo_sphere_locator_destroy(locator);
    return status;
}

TEST(every_allocation_may_fail)
{
    surface s = ball_make(LOXO_ORDER_AUTO);
    CHECK(test_each_allocation_fails(make_one, &s) >= 6);
    surface_destroy(&s);
}

TEST(a_monitor_stops_it)
{
    surface s = ball_make(LOXO_ORDER_AUTO);
    const int64_t n = 300000;
    double *q = random_directions(n);
    loxo_surface_point *point = loxo_allocate(test_context, n, sizeof *point);
    loxo_sphere_locator *locator = locator_make(&s, s.soup.position);
    stopper w;
    stopper_begin(&w, test_context, 1);
    CHECK_STATUS(test_context, loxo_sphere_locate(locator, n, q, point, NULL), LOXO_ERR_STOPPED);
    stopper_end(&w);
    loxo_sphere_locator_destroy(locator);
    loxo_release(test_context, point);
    loxo_release(test_context, q);
    surface_destroy(&s);
}
