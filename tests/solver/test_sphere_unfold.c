/* SPDX-License-Identifier: MIT
 * Maps that may not fold: a start without folds of any surface, folds that were planted and are mended, and what stays untouched. */
#include "../shapes.h"
#include "base/rng.h"
#include "mesh/mesh_internal.h"
#include "operator/laplacian.h"
#include "solver/sphere/embedding.h"
#include "stopper.h"

#include <loxo/io.h>

#define SEED 7

/* A surface as the solver sees it, and a map of it. */
typedef struct world {
    loxo_context *ctx;
    loxo_soup soup;
    loxo_mesh *mesh;
    sphere_problem p;
    sphere_map f, before;
} world;

/* The soup becomes the world's. */
static world world_from(loxo_context *ctx, loxo_soup soup)
{
    world w = {.ctx = ctx, .soup = soup};
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    CHECK_STATUS(ctx, loxo_mesh_create(ctx, &arrays, LOXO_COPY, NULL, NULL, &w.mesh), LOXO_OK);
    w.p = (sphere_problem){.ctx = ctx, .m = loxo_mesh_get_view(w.mesh), .settings = loxo_sphere_settings_default()};
    w.p.area = loxo_allocate(ctx, w.p.m.n_vertices, sizeof *w.p.area);
    CHECK_STATUS(ctx, loxo_laplacian_create(ctx, &w.p.m, &w.p.laplacian, w.p.area), LOXO_OK);
    w.f = loxo_allocate(ctx, w.p.m.n_vertices, sizeof *w.f);
    w.before = loxo_allocate(ctx, w.p.m.n_vertices, sizeof *w.before);
    CHECK(w.p.area != NULL && w.f != NULL && w.before != NULL);
    return w;
}

static void world_free(world *w)
{
    loxo_release(w->ctx, w->before);
    loxo_release(w->ctx, w->f);
    loxo_csr_destroy(w->ctx, &w->p.laplacian);
    loxo_release(w->ctx, w->p.area);
    loxo_mesh_destroy(w->mesh);
    loxo_soup_destroy(w->ctx, &w->soup);
}

static loxo_soup generated(loxo_context *ctx, loxo_shape shape, int64_t n, double param)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    loxo_soup soup = {0};
    settings.shape = shape;
    settings.n_vertices = n;
    settings.seed = SEED;
    settings.params[0] = param;
    CHECK_STATUS(ctx, loxo_generate(ctx, &settings, false, &soup), LOXO_OK);
    return soup;
}

/* A sphere with its own positions as its map. */
static world world_of_sphere(loxo_context *ctx, int64_t n)
{
    world w = world_from(ctx, generated(ctx, LOXO_SHAPE_ICOSPHERE, n, NAN));
    for (int64_t v = 0; v < w.p.m.n_vertices; ++v)
        v3_store(w.f[v], k_unit(k_position(&w.p.m, (loxo_index)v)));
    return w;
}

static sphere_folds folds_of(const world *w)
{
    sphere_folds folds = {0};
    CHECK_STATUS(w->ctx, sphere_find_folds(&w->p, (sphere_const_map)w->f, NULL, &folds), LOXO_OK);
    return folds;
}

/* Unit vectors, degree 1, no folds. */
static void check_embedding(const world *w)
{
    const sphere_folds folds = folds_of(w);
    for (int64_t v = 0; v < w->p.m.n_vertices; ++v)
        CHECK_NEAR(v3_norm(v3_load(w->f[v])), 1.0, 4e-16); /* one root, one quotient, three products */
    CHECK_EQUAL(folds.n, 0);
    CHECK_EQUAL(folds.degree, 1);
}

static void keep(world *w) { memcpy(w->before, w->f, (size_t)w->p.m.n_vertices * sizeof *w->f); }

static bool is_as_before(const world *w, int64_t v) { return memcmp(w->before[v], w->f[v], sizeof w->f[v]) == 0; }

/* Edges to v. */
static int *rings_around(const world *w, loxo_index v)
{
    const loxo_mesh_view *m = &w->p.m;
    int *ring = malloc((size_t)m->n_vertices * sizeof *ring);
    loxo_index *queue = malloc((size_t)m->n_vertices * sizeof *queue);
    int64_t n = 1;
    CHECK(ring != NULL && queue != NULL);
    for (int64_t i = 0; i < m->n_vertices; ++i)
        ring[i] = -1;
    ring[v] = 0;
    queue[0] = v;
    for (int64_t i = 0; i < n; ++i) {
        loxo_index h = m->vertex_halfedge[queue[i]];
        do {
            const loxo_index to = k_head(m, h);
            if (ring[to] < 0) {
                ring[to] = ring[queue[i]] + 1;
                queue[n++] = to;
            }
            h = m->halfedge_twin[k_previous(h)];
        } while (h != m->vertex_halfedge[queue[i]]);
    }
    free(queue);
    return ring;
}

static void unfold(world *w)
{
    loxo_sphere_info info = {0};
    CHECK_STATUS(w->ctx, sphere_unfold(&w->p, w->f, &info), LOXO_OK);
    CHECK_EQUAL(info.n_folds, 0);
    check_embedding(w);
}

/* v goes beyond its first neighbour, by half as much again as it was away. */
static void throw_over(world *w, loxo_index v)
{
    const loxo_vec3 at = v3_load(w->f[v]), over = v3_load(w->f[k_head(&w->p.m, w->p.m.vertex_halfedge[v])]);
    v3_store(w->f[v], k_unit(v3_axpy(over, 1.5, v3_sub(over, at))));
}

/* Everything farther than that many edges from v is as it was, to the bit. */
static void check_untouched(const world *w, loxo_index v, int farthest)
{
    int *ring = rings_around(w, v);
    for (int64_t i = 0; i < w->p.m.n_vertices; ++i)
        CHECK(ring[i] <= farthest || is_as_before(w, i));
    free(ring);
}

/* Draws all points within an angle of a pole to it, by the factor shrink in the middle: angles from the pole grow by equal factors. */
static void shrink_cap(world *w, loxo_vec3 pole, double shrink)
{
    const k_frame frame = k_frame_at(pole);
    const double pi = 3.14159265358979, start = 0.5, rate = log(pi / (start * shrink)) / (pi - start);
    for (int64_t v = 0; v < w->p.m.n_vertices; ++v) {
        const loxo_vec3 q = k_frame_in(&frame, v3_load(w->f[v]));
        const double r = hypot(q.x, q.y), angle = atan2(r, q.z);
        const double now = angle < start ? shrink * angle : shrink * start * exp(rate * (angle - start));
        const double scale = r > 0.0 ? sin(now) / r : 0.0;
        v3_store(w->f[v], k_frame_out(&frame, (loxo_vec3){scale * q.x, scale * q.y, cos(now)}));
    }
}

/* ---- the triangulation ------------------------------------------------------------------------------------------ */

TEST(collapses_are_undone_to_the_bit)
{
    world w = world_from(test_context, generated(test_context, LOXO_SHAPE_BUMPY, 500, NAN));
    const size_t bytes = (size_t)(3 * w.p.m.n_faces) * sizeof(loxo_index);
    sphere_embedding e;
    CHECK_OK(sphere_embedding_create(&w.p, w.f, &e));
    while (e.n_there > 4) {
        const int64_t n_before = e.n_there;
        for (int64_t v = 0; v < w.p.m.n_vertices && e.n_there > 4; ++v) {
            if (e.degree[v] == 0) continue;
            loxo_index h = e.first[v];
            for (int64_t k = 0; k < e.degree[v] && !sphere_embedding_can_collapse(&e, h, true); ++k)
                h = embedding_turn(&e, h);
            if (sphere_embedding_can_collapse(&e, h, true)) sphere_embedding_collapse(&e, h);
        }
        CHECK(e.n_there < n_before); /* every vertex has a neighbour to be pulled onto */
    }
    for (int64_t v = 0; v < w.p.m.n_vertices; ++v)
        CHECK(e.degree[v] == 0 || e.degree[v] == 3);
    while (e.n_removed > 0)
        (void)sphere_embedding_restore(&e);
    CHECK(memcmp(e.corner, w.p.m.halfedge_vertex, bytes) == 0);
    CHECK(memcmp(e.twin, w.p.m.halfedge_twin, bytes) == 0);
    for (int64_t v = 0; v < w.p.m.n_vertices; ++v)
        CHECK_EQUAL(e.corner[e.first[v]], v);
    sphere_embedding_destroy(&e);
    world_free(&w);
}

/* The link of every vertex may be pulled onto some neighbour of it (README). */
TEST(every_vertex_can_be_taken_out)
{
    world w = world_from(test_context, shape_hub(test_context, 40));
    sphere_embedding e;
    CHECK_OK(sphere_embedding_create(&w.p, w.f, &e));
    for (int64_t v = 0; v < w.p.m.n_vertices; ++v) {
        loxo_index h = e.first[v];
        bool is_free = false;
        for (int64_t k = 0; k < e.degree[v]; ++k, h = embedding_turn(&e, h))
            is_free |= sphere_embedding_can_collapse(&e, h, true);
        CHECK(is_free);
    }
    sphere_embedding_destroy(&e);
    world_free(&w);
}

/* ---- the kernel ------------------------------------------------------------------------------------------------- */

/* A ring that ring[0] sees all of: triangles to it are positive. Sizes down to where positions have three digits left. */
TEST(the_middle_of_a_kernel_sees_the_whole_ring)
{
    const double sizes[] = {1.0, 1e-3, 1e-8, 1e-12};
    const k_frame frame = k_frame_at(k_unit((loxo_vec3){1.0, 2.0, -3.0}));
    uint64_t draw = 0;
    for (int s = 0; s < 4; ++s) {
        for (int trial = 0; trial < 500; ++trial) {
            loxo_vec3 ring[K_STAR_MOST], center = {0.0, 0.0, 0.0};
            const int n = 3 + trial % 20;
            const double turn = trial % 3 == 0 ? 5.0 : 2.5; /* of the fan at ring[0]: beyond pi, too */
            ring[0] = frame.up;
            for (int i = 1; i < n; ++i) {
                const double angle = turn * (double)(i - 1) / (double)(n - 2 > 0 ? n - 2 : 1);
                const double r = sizes[s] * (0.3 + loxo_random_unit(SEED, draw++));
                ring[i] = k_frame_out(&frame, (loxo_vec3){r * cos(angle), r * sin(angle), 1.0});
            }
            if (n == 3) ring[2] = k_frame_out(&frame, (loxo_vec3){0.0, sizes[s], 1.0});
            CHECK(k_star_center(n, ring, &center));
            for (int i = 0; i < n; ++i) {
                const loxo_vec3 b = ring[i], c = ring[i + 1 < n ? i + 1 : 0];
                CHECK(v3_dot(v3_cross(v3_sub(b, center), v3_sub(c, center)), center) > 0.0);
            }
        }
    }
}

/* In the plane, a star of the surface itself: the vertex goes back to where it came from, energy 0 but for the plumpness. */
TEST(a_star_is_settled_where_its_shape_is_the_surface_s)
{
    k_star star = {.n = 6};
    double at[6][2], x[2] = {0.2, -0.1}, energy;
    for (int i = 0; i < 6; ++i) {
        const double r = 1.0 + 0.3 * loxo_random_unit(SEED, (uint64_t)i);
        at[i][0] = star.ring[i][0] = r * cos(i);
        at[i][1] = star.ring[i][1] = r * sin(i);
    }
    for (int i = 0; i < 6; ++i) {
        const double *b = at[i], *c = at[(i + 1) % 6];
        k_star_set_face(&star, i, hypot(b[0], b[1]), hypot(c[0], c[1]), hypot(b[0] - c[0], b[1] - c[1]));
    }
    energy = k_star_energy(&star, x[0], x[1]);
    for (int k = 0; k < 20 && k_star_step(&star, x, &energy); ++k) {
    }
    CHECK_NEAR(x[0], 0.0, 0.02); /* lengths were made longer by 1 % */
    CHECK_NEAR(x[1], 0.0, 0.02);
    CHECK(energy < 1e-2);
}

/* ---- a start without folds --------------------------------------------------------------------------------------- */

static void check_positive(world *w)
{
    loxo_sphere_info info = {0};
    CHECK_STATUS(w->ctx, sphere_map_positive(&w->p, w->f, &info), LOXO_OK);
    check_embedding(w);
    world_free(w);
}

TEST(small_surfaces_have_a_map_without_folds)
{
    world tetrahedron = world_from(test_context, shape_tetrahedron(test_context));
    world cube = world_from(test_context, shape_cube(test_context));
    world hub = world_from(test_context, shape_hub(test_context, 3));
    check_positive(&tetrahedron);
    check_positive(&cube);
    check_positive(&hub);
}

TEST(generated_surfaces_have_a_map_without_folds)
{
    static const loxo_shape shapes[] = {LOXO_SHAPE_ICOSPHERE, LOXO_SHAPE_LATLONG, LOXO_SHAPE_BUMPY, LOXO_SHAPE_NOISY,
                                        LOXO_SHAPE_BRAIN};
    for (int i = 0; i < 5; ++i) {
        world w = world_from(test_context, generated(test_context, shapes[i], 3000, NAN));
        check_positive(&w);
    }
}

/* Two vertices with 5000 neighbours each. */
TEST(hubs_have_a_map_without_folds)
{
    world w = world_from(test_context, shape_hub(test_context, 5000));
    check_positive(&w);
}

TEST(a_needle_of_a_surface_has_a_map_without_folds)
{
    loxo_soup soup = shape_stretched(LOXO_SHAPE_ICOSPHERE, 4000, NAN, 1000.0, 0.0);
    world w = world_from(test_context, soup);
    check_positive(&w);
}

/* A tenth of the faces get a vertex a millionth off an edge. */
TEST(slivers_have_a_map_without_folds)
{
    loxo_soup soup = generated(test_context, LOXO_SHAPE_BUMPY, 3000, NAN);
    shape_add_caps(test_context, &soup, 10, 1e-6);
    world w = world_from(test_context, soup);
    check_positive(&w);
}

/* Positions do not matter for folds: all in one place. */
TEST(a_surface_without_size_has_a_map_without_folds)
{
    loxo_soup soup = generated(test_context, LOXO_SHAPE_ICOSPHERE, 500, NAN);
    for (int64_t i = 0; i < 3 * soup.n_vertices; ++i)
        soup.position[i] = 0.0;
    world w = world_from(test_context, soup);
    w.p.area[0] = 1.0;
    check_positive(&w);
}

/* Limbs: the points within 0.3 of twelve directions are drawn out to length 20 and to a tenth of their width. A conformal map makes a limb's
 * tip smaller than any double tells. */
static loxo_soup limbs(loxo_context *ctx, int64_t n)
{
    loxo_soup soup = generated(ctx, LOXO_SHAPE_ICOSPHERE, n, NAN);
    for (int64_t v = 0; v < soup.n_vertices; ++v) {
        const loxo_vec3 p = v3_load(&soup.position[3 * v]);
        const double longest = fmax(fabs(p.x), fmax(fabs(p.y), fabs(p.z)));
        const loxo_vec3 axis = longest == fabs(p.x)   ? (loxo_vec3){copysign(1.0, p.x), 0.0, 0.0}
                               : longest == fabs(p.y) ? (loxo_vec3){0.0, copysign(1.0, p.y), 0.0}
                                                      : (loxo_vec3){0.0, 0.0, copysign(1.0, p.z)};
        const double off = v3_norm(v3_sub(p, axis)), along = off < 0.3 ? 20.0 * (0.3 - off) / 0.3 : 0.0;
        v3_store(&soup.position[3 * v], v3_axpy(p, along, axis));
    }
    return soup;
}

TEST(long_limbs_have_a_map_without_folds)
{
    NEEDS_IDS(80000);
    world w = world_from(test_context, limbs(test_context, 12000));
    check_positive(&w);
}

TEST(two_triangles_are_too_few)
{
    static const double p[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    static const int t[2][3] = {{0, 1, 2}, {0, 2, 1}};
    world w = world_from(test_context, shape_of(test_context, 3, p, 2, t));
    loxo_sphere_info info = {0};
    CHECK_STATUS(test_context, sphere_map_positive(&w.p, w.f, &info), LOXO_ERR_MESH);
    world_free(&w);
}

/* ---- folds that were planted ------------------------------------------------------------------------------------ */

TEST(a_map_without_folds_stays_as_it_is)
{
    world w = world_of_sphere(test_context, 1000);
    keep(&w);
    unfold(&w);
    CHECK(memcmp(w.f, w.before, (size_t)w.p.m.n_vertices * sizeof *w.f) == 0);
    world_free(&w);
}

TEST(a_vertex_thrown_over_its_neighbour_comes_back)
{
    world w = world_of_sphere(test_context, 1000);
    const loxo_index v = 321;
    throw_over(&w, v);
    keep(&w);
    CHECK(folds_of(&w).n > 0);
    unfold(&w);
    check_untouched(&w, v, 2);
    world_free(&w);
}

/* All vertices within three edges of one, thrown about by three edge lengths. */
TEST(a_scrambled_patch_is_mended)
{
    world w = world_of_sphere(test_context, 4000);
    const loxo_index middle = 1234;
    int *ring = rings_around(&w, middle);
    const double size = 3.0 * sqrt(4.0 * 3.14159265358979 / 4000.0);
    for (int64_t v = 0; v < w.p.m.n_vertices; ++v) {
        if (ring[v] > 3) continue;
        for (int k = 0; k < 3; ++k)
            w.f[v][k] += size * (loxo_random_unit(SEED, (uint64_t)(3 * v + k)) - 0.5);
        v3_store(w.f[v], k_unit(v3_load(w.f[v])));
    }
    free(ring);
    keep(&w);
    CHECK(folds_of(&w).n > 10);
    unfold(&w);
    check_untouched(&w, middle, 8);
    world_free(&w);
}

/* In a patch of size 1e-8, positions have eight digits of a neighbour's distance left. */
TEST(a_fold_in_a_tiny_patch_is_mended)
{
    NEEDS_IDS(130000);
    world w = world_of_sphere(test_context, 20000);
    const loxo_vec3 pole = k_unit((loxo_vec3){1.0, 2.0, 3.0});
    loxo_index v = 0;
    shrink_cap(&w, pole, 1e-8);
    check_embedding(&w);
    for (int64_t i = 0; i < w.p.m.n_vertices; ++i)
        if (v3_dot(k_position(&w.p.m, (loxo_index)i), pole) > v3_dot(k_position(&w.p.m, v), pole)) v = (loxo_index)i;
    throw_over(&w, v);
    keep(&w);
    CHECK(folds_of(&w).n > 0);
    unfold(&w);
    check_untouched(&w, v, 2);
    world_free(&w);
}

/* The patch is drawn into one point: nothing of its map is left, and room has to be made. */
TEST(a_patch_in_one_point_is_spread)
{
    world w = world_of_sphere(test_context, 4000);
    int *ring = rings_around(&w, 77);
    for (int64_t v = 0; v < w.p.m.n_vertices; ++v)
        if (ring[v] < 8) memcpy(w.f[v], w.f[77], sizeof w.f[v]);
    free(ring);
    keep(&w);
    unfold(&w);
    check_untouched(&w, 77, 12);
    world_free(&w);
}

/* Algorithm 2 alone leaves the others: many single folds far from each other. */
TEST(many_folds_are_mended_each_in_its_place)
{
    NEEDS_IDS(70000);
    world w = world_of_sphere(test_context, 10000);
    int *nearest = malloc((size_t)w.p.m.n_vertices * sizeof *nearest);
    CHECK(nearest != NULL);
    for (int64_t v = 0; v < w.p.m.n_vertices; ++v)
        nearest[v] = 1000;
    for (loxo_index v = 0; v < w.p.m.n_vertices; v = (loxo_index)(v + 499)) {
        int *ring = rings_around(&w, v);
        for (int64_t i = 0; i < w.p.m.n_vertices; ++i)
            if (ring[i] < nearest[i]) nearest[i] = ring[i];
        free(ring);
        throw_over(&w, v);
    }
    keep(&w);
    unfold(&w);
    for (int64_t v = 0; v < w.p.m.n_vertices; ++v)
        CHECK(nearest[v] <= 4 || is_as_before(&w, v));
    free(nearest);
    world_free(&w);
}

/* No part of these maps is of use: all vertices at random, all in one point, inside out. */
TEST(maps_of_no_use_are_made_anew)
{
    for (int kind = 0; kind < 3; ++kind) {
        world w = world_of_sphere(test_context, 1500);
        for (int64_t v = 0; v < w.p.m.n_vertices; ++v) {
            loxo_vec3 at = v3_load(w.f[v]);
            if (kind == 0)
                at = (loxo_vec3){loxo_random_unit(SEED, (uint64_t)(3 * v)) - 0.5,
                                 loxo_random_unit(SEED, (uint64_t)(3 * v + 1)) - 0.5,
                                 loxo_random_unit(SEED, (uint64_t)(3 * v + 2)) - 0.5};
            if (kind == 1) at = (loxo_vec3){0.6, 0.0, 0.8};
            v3_store(w.f[v], k_unit(kind == 2 ? v3_scale(-1.0, at) : at));
        }
        unfold(&w);
        world_free(&w);
    }
}

/* ---- calls ------------------------------------------------------------------------------------------------------ */

typedef struct job {
    bool is_positive;
    int64_t n;
} job;

/* A map with single folds and a patch in one point. */
static world world_to_mend(loxo_context *ctx, int64_t n)
{
    world w = world_of_sphere(ctx, n);
    int *ring = rings_around(&w, 5);
    for (int64_t v = 0; v < w.p.m.n_vertices; ++v)
        if (ring[v] < 4) memcpy(w.f[v], w.f[5], sizeof w.f[v]);
    free(ring);
    for (loxo_index v = 100; v < w.p.m.n_vertices; v = (loxo_index)(v + 99))
        throw_over(&w, v);
    return w;
}

static uint64_t hash_job(loxo_context *ctx, const void *arg)
{
    const job *j = arg;
    loxo_sphere_info info = {0};
    world w = j->is_positive ? world_from(ctx, generated(ctx, LOXO_SHAPE_BUMPY, j->n, NAN)) : world_to_mend(ctx, j->n);
    CHECK_STATUS(ctx, j->is_positive ? sphere_map_positive(&w.p, w.f, &info) : sphere_unfold(&w.p, w.f, &info),
                 LOXO_OK);
    const uint64_t hash = test_hash(w.f, (size_t)w.p.m.n_vertices * sizeof *w.f);
    world_free(&w);
    return hash;
}

TEST(same_bits_for_any_number_of_threads)
{
    test_same_for_any_threads(hash_job, &(job){.is_positive = true, .n = 5000});
    test_same_for_any_threads(hash_job, &(job){.is_positive = false, .n = 5000});
}

typedef struct call {
    job job;
    world w;
} call;

/* The problem was made in a context of its own. */
static loxo_status call_in(loxo_context *ctx, void *arg)
{
    call *c = arg;
    loxo_sphere_info info = {0};
    sphere_problem p = c->w.p;
    p.ctx = ctx;
    memcpy(c->w.f, c->w.before, (size_t)p.m.n_vertices * sizeof *c->w.f);
    return c->job.is_positive ? sphere_map_positive(&p, c->w.f, &info) : sphere_unfold(&p, c->w.f, &info);
}

TEST(every_allocation_may_fail)
{
    for (int k = 0; k < 2; ++k) {
        call c = {.job = {.is_positive = k == 0}, .w = world_to_mend(test_context, 600)};
        keep(&c.w);
        CHECK(test_each_allocation_fails(call_in, &c) >= 3);
        world_free(&c.w);
    }
}

/* Stopped at the first question, the second, ...: unit vectors are left. */
TEST(a_monitor_stops_it)
{
    for (int k = 0; k < 2; ++k) {
        call c = {.job = {.is_positive = k == 0}, .w = world_to_mend(test_context, 3000)};
        int n_stopped = 0;
        keep(&c.w);
        for (int stop_at = 1; stop_at < 60; stop_at += 7) {
            stopper s;
            stopper_begin(&s, test_context, stop_at);
            const loxo_status status = call_in(test_context, &c);
            stopper_end(&s);
            CHECK(status == LOXO_STOPPED || status == LOXO_OK);
            n_stopped += status == LOXO_STOPPED;
            for (int64_t v = 0; v < c.w.p.m.n_vertices; ++v)
                CHECK_NEAR(v3_norm(v3_load(c.w.f[v])), 1.0, 4e-16);
        }
        CHECK(n_stopped >= 1);
        world_free(&c.w);
    }
}

/* ---- surfaces that defeat other ways ----------------------------------------------------------------------------- */

/* Positions seen from their middle are a map that is folded wherever a limb bends. */
TEST(hard_scans_have_a_map_without_folds_and_are_unfolded)
{
    static const char *const files[] = {"camel10k.off.gz", "homer6k.obj.gz", "horse20k.off.gz", "moai48k-slivers.ply",
                                        "bunny35k-slivers.off.gz"};
    for (int i = 0; i < 5; ++i) {
        char name[128];
        loxo_soup soup;
        CHECK(snprintf(name, sizeof name, "meshes/surfaces/%s", files[i]) > 0);
        if (test_shared(name) == NULL) SKIP();
        NEEDS_IDS(300000);
        CHECK_OK(loxo_read_mesh(test_context, test_shared(name), NULL, &soup));
        world w = world_from(test_context, soup);
        loxo_sphere_info info = {0};
        CHECK_OK(sphere_map_positive(&w.p, w.f, &info));
        check_embedding(&w);
        loxo_vec3 middle = {0.0, 0.0, 0.0};
        for (int64_t v = 0; v < w.p.m.n_vertices; ++v)
            middle = v3_axpy(middle, 1.0 / (double)w.p.m.n_vertices, k_position(&w.p.m, (loxo_index)v));
        for (int64_t v = 0; v < w.p.m.n_vertices; ++v)
            v3_store(w.f[v], k_unit(v3_sub(k_position(&w.p.m, (loxo_index)v), middle)));
        unfold(&w);
        world_free(&w);
    }
}
