/* SPDX-License-Identifier: MIT
 * Rings of vertices walked around side by side, and what is computed for many of them at once, against the same one by one. */
#include "base/rng.h"
#include "kernel/variants.h"
#include "test.h"

static double uniform(uint64_t *state, double low, double high)
{
    return low + (high - low) * loxo_random_unit(11, (*state)++);
}

static loxo_mesh *generate(loxo_shape shape, int64_t n_vertices)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    loxo_soup soup;
    loxo_mesh *mesh;
    settings.shape = shape;
    settings.n_vertices = n_vertices;
    CHECK_OK(loxo_generate(test_context, &settings, false, &soup));
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    CHECK_OK(loxo_mesh_create(test_context, &arrays, LOXO_ADOPT, NULL, NULL, &mesh));
    return mesh;
}

/* A hub with n triangles around it, closed or not. */
static loxo_mesh *fan(int64_t n, bool is_closed)
{
    loxo_soup soup = {.n_vertices = n + 1 + !is_closed, .n_faces = n};
    loxo_mesh *mesh;
    soup.position = loxo_allocate(test_context, 3 * soup.n_vertices, sizeof *soup.position);
    soup.triangle = loxo_allocate(test_context, 3 * n, sizeof *soup.triangle);
    for (int64_t i = 0; i < soup.n_vertices; ++i) {
        const double angle = 6.0 * (double)(i - 1) / (double)n;
        soup.position[3 * i] = i > 0 ? cos(angle) : 0.0;
        soup.position[3 * i + 1] = i > 0 ? sin(angle) : 0.0;
        soup.position[3 * i + 2] = i > 0 ? 0.1 * sin(7.0 * angle) : 0.3;
    }
    for (int64_t i = 0; i < n; ++i) {
        soup.triangle[3 * i] = 0;
        soup.triangle[3 * i + 1] = (loxo_index)(1 + i);
        soup.triangle[3 * i + 2] = (loxo_index)(i + 2 < soup.n_vertices ? i + 2 : 1);
    }
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    CHECK_OK(loxo_mesh_create(test_context, &arrays, LOXO_ADOPT, NULL, NULL, &mesh));
    return mesh;
}

static void check_rings(loxo_mesh *mesh)
{
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    k_rings r;
    for (int64_t begin = 0; begin < m.n_vertices; begin += K_BESIDE) {
        for (r.n = 0; r.n < K_BESIDE && begin + r.n < m.n_vertices; ++r.n)
            r.vertex[r.n] = (loxo_index)(begin + r.n);
        k_rings_walk(&m, &r, m.vertex_halfedge, sizeof *m.vertex_halfedge);
        for (int i = 0; i < r.n; ++i) {
            const loxo_index v = r.vertex[i];
            k_around around = k_around_vertex(&m, v);
            int n = 0;
            for (loxo_index to; (to = k_around_next(&m, &around)) >= 0; ++n) {
                if (n >= r.n_spokes[i] || n >= K_RING) continue;
                const loxo_index h = r.halfedge[n][i];
                const bool is_last = r.is_open[i] && n + 1 == r.n_spokes[i];
                CHECK_EQUAL(r.to[n][i], to);
                CHECK_EQUAL(m.halfedge_vertex[h], is_last ? to : v);
                CHECK_EQUAL(k_head(&m, h), is_last ? v : to);
            }
            CHECK_EQUAL(r.n_spokes[i], n <= K_RING ? n : K_RING + 1);
            if (n > 0 && n <= K_RING)
                CHECK_EQUAL(r.is_open[i], (uint32_t)n != k_degree(&m, v) || m.halfedge_twin[m.vertex_halfedge[v]] < 0);
        }
    }
    loxo_mesh_destroy(mesh);
}

TEST(rings_are_those_of_the_walk)
{
    check_rings(generate(LOXO_SHAPE_NOISY, 1000));
    check_rings(generate(LOXO_SHAPE_DISK, 1000));
    check_rings(generate(LOXO_SHAPE_STRIP, 100));
    for (int64_t n = K_RING - 2; n <= K_RING + 2; ++n) { /* just fits, just not */
        check_rings(fan(n, true));
        check_rings(fan(n, false));
    }
    check_rings(fan(1, false));
}

#define N_SPOKES 6

static void weigh(loxo_isa isa, void *data) { k_variant_get(isa)->ring_weights(N_SPOKES, data); }

static void arrive(loxo_isa isa, void *data) { k_variant_get(isa)->unfold_corners(data); }

/* Weights of closed rings of random spokes, against the faces one by one; all instruction sets. */
TEST(weights_are_those_of_the_faces)
{
    static k_spokes in, out;
    uint64_t state = 5;
    const int n = N_SPOKES;
    for (int i = 0; i < K_BESIDE; ++i)
        for (int k = 0; k < n; ++k) {
            in.x[k][i] = uniform(&state, -1.0, 1.0);
            in.y[k][i] = uniform(&state, -1.0, 1.0);
            in.z[k][i] = i == 3 && k == 2 ? in.z[1][i] : uniform(&state, -1.0, 1.0);
            if (i == 3 && k == 2) in.x[k][i] = in.x[1][i], in.y[k][i] = in.y[1][i]; /* a face without area */
        }
    for (int i = 0; i < K_BESIDE; ++i)
        in.x[n][i] = in.x[0][i], in.y[n][i] = in.y[0][i], in.z[n][i] = in.z[0][i];
    test_same_for_any_isa(weigh, &in, sizeof in, &out);
    for (int i = 0; i < K_BESIDE; ++i) {
        double weight[7] = {0.0}, twice_area = 0.0;
        for (int k = 0; k < n; ++k) {
            const double corner[9] = {
                0.0, 0.0, 0.0, in.x[k][i], in.y[k][i], in.z[k][i], in.x[k + 1][i], in.y[k + 1][i], in.z[k + 1][i]};
            const loxo_index triangle[3] = {0, 1, 2};
            const loxo_mesh_view m = {
                .n_vertices = 3, .n_faces = 1, .halfedge_vertex = triangle, .position = (const double(*)[3])corner};
            const k_face_shape s = k_shape_of_face(&m, 0);
            weight[k] += 0.5 * s.cotangent[0];     /* opposite the first spoke */
            weight[k + 1] += 0.5 * s.cotangent[2]; /* opposite the second */
            twice_area += s.twice_area;
        }
        CHECK_NEAR(out.twice_area[i], twice_area, 1e-14);
        for (int k = 0; k <= n; ++k)
            CHECK_NEAR(out.weight[k][i], weight[k], 1e-12 * (1.0 + fabs(weight[k])));
    }
}

/* Corners whose distances are those of a point, those of one across the reach, flat ones: as the formula for one. */
TEST(arrivals_are_those_of_single_corners)
{
    static k_corners in, out;
    uint64_t state = 8;
    in.n = in.n_edges = K_CORNERS - 3;
    for (int i = 0; i < in.n; ++i) {
        const double base = exp(uniform(&state, -20.0, 20.0)), x = uniform(&state, -0.5, 1.5) * base;
        const double y = i % 17 == 0 ? 0.0 : uniform(&state, 0.0, 2.0) * base;
        const double sx = uniform(&state, -1.5, 2.5) * base, sy = uniform(&state, 0.0, 3.0) * base;
        in.base[i] = base * base;
        in.left[i] = x * x + y * y;
        in.right[i] = (x - base) * (x - base) + y * y;
        in.at_a[i] = hypot(sx, sy);
        in.at_b[i] = hypot(sx - base, sy);
        in.reach_a[i] = i % 3 == 0 ? 0.0 : 0.3;
        in.reach_b[i] = i % 5 == 0 ? 0.0 : 0.3;
        in.edge_at[i] = in.at_a[i];
        in.edge_square[i] = in.left[i];
    }
    in.base[7] = 0.0;
    test_same_for_any_isa(arrive, &in, sizeof in, &out);
    int n_none = 0;
    for (int i = 0; i < in.n; ++i) {
        const double base = sqrt(in.base[i]), left = sqrt(in.left[i]), right = sqrt(in.right[i]);
        const double one = k_unfolded_distance(base, left, right, in.at_a[i], in.at_b[i], in.reach_a[i], in.reach_b[i]);
        CHECK_NEAR(out.edge_arrival[i], in.at_a[i] + left, 0.0);
        CHECK((one < HUGE_VAL) == (out.arrival[i] < HUGE_VAL));
        n_none += !(one < HUGE_VAL);
        if (one < HUGE_VAL) CHECK_NEAR(out.arrival[i], one, 1e-7 * one); /* flat ones have half the digits */
    }
    CHECK(n_none > 20 && n_none < in.n - 20);
    CHECK(!(out.arrival[7] < HUGE_VAL));
}

/* Two fronts from the ends of an edge itself: nobody has been in its middle. */
TEST(sources_at_both_ends_do_not_meet_in_one_between)
{
    static k_corners c = {.n = 1, .base = {1.0}, .left = {1.0}, .right = {1.0}, .reach_a = {0.3}, .reach_b = {0.3}};
    k_unfold_corners(&c);
    CHECK(c.arrival[0] >= 1.0);
    c.at_a[0] = c.at_b[0] = 0.5; /* one in the middle */
    k_unfold_corners(&c);
    CHECK_NEAR(c.arrival[0], sqrt(0.75), 1e-15);
}
