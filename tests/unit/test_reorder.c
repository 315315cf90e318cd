/* SPDX-License-Identifier: MIT
 * Orders: permutations, parts that cover, locality, the same for any number of threads. */
#include "../test.h"
#include "base/rng.h"
#include "mesh/reorder.h"
#include "mesh/reorder_internal.h"

#include <loxo/mesh.h>

static const loxo_order orders[] = {LOXO_ORDER_GIVEN, LOXO_ORDER_MORTON, LOXO_ORDER_HILBERT,
                                    LOXO_ORDER_BFS,   LOXO_ORDER_METIS,  LOXO_ORDER_METIS_ND};
#define N_ORDERS ((int)(sizeof orders / sizeof orders[0]))

static bool is_off(loxo_order order)
{
    return (order == LOXO_ORDER_METIS || order == LOXO_ORDER_METIS_ND) &&
           strstr(loxo_build_features(), "metis off") != NULL;
}

/* Numbers of vertices and of faces drawn anew. */
static void shuffle(loxo_soup *soup)
{
    const int64_t n = soup->n_vertices;
    loxo_index *rank = malloc((size_t)n * sizeof *rank);
    double *position = malloc((size_t)n * 3 * sizeof *position);
    for (int64_t v = 0; v < n; ++v)
        rank[v] = (loxo_index)v;
    for (int64_t v = n - 1; v > 0; --v) {
        const int64_t other = (int64_t)(loxo_random_u64(3, (uint64_t)v) % (uint64_t)(v + 1));
        const loxo_index swap = rank[v];
        rank[v] = rank[other];
        rank[other] = swap;
    }
    memcpy(position, soup->position, (size_t)n * 3 * sizeof *position);
    for (int64_t v = 0; v < n; ++v)
        memcpy(soup->position + 3 * (int64_t)rank[v], position + 3 * v, 3 * sizeof *position);
    for (int64_t h = 0; h < 3 * soup->n_faces; ++h)
        soup->triangle[h] = rank[soup->triangle[h]];
    for (int64_t f = soup->n_faces - 1; f > 0; --f) {
        loxo_index *a = soup->triangle + 3 * f, swap[3];
        loxo_index *b = soup->triangle + 3 * (int64_t)(loxo_random_u64(4, (uint64_t)f) % (uint64_t)(f + 1));
        memcpy(swap, a, sizeof swap);
        memmove(a, b, sizeof swap);
        memcpy(b, swap, sizeof swap);
    }
    free(position);
    free(rank);
}

static loxo_soup make(loxo_shape shape, int64_t n_vertices, bool is_shuffled)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    loxo_soup soup;
    settings.shape = shape;
    settings.n_vertices = n_vertices;
    CHECK_OK(loxo_generate(test_context, &settings, false, &soup));
    if (is_shuffled) shuffle(&soup);
    return soup;
}

/* old_to_new; every old number must come once. The caller frees it. */
static int64_t *inverse(const loxo_reordering *r, int64_t n)
{
    int64_t *rank = malloc((size_t)n * sizeof *rank);
    for (int64_t v = 0; v < n; ++v)
        rank[v] = -1;
    for (int64_t i = 0; i < n; ++i) {
        const int64_t old = r->vertex_new_to_old != NULL ? r->vertex_new_to_old[i] : i;
        CHECK(old >= 0 && old < n && rank[old] == -1);
        rank[old] = i;
    }
    return rank;
}

static void check_parts(const loxo_reordering *r, int64_t n, int64_t largest)
{
    CHECK(r->n_parts >= 1);
    CHECK_EQUAL(r->part_vertex[0], 0);
    CHECK_EQUAL(r->part_vertex[r->n_parts], n);
    for (int64_t p = 0; p < r->n_parts; ++p) {
        CHECK(r->part_vertex[p + 1] > r->part_vertex[p] || n == 0);
        CHECK(r->part_vertex[p + 1] - r->part_vertex[p] <= largest);
    }
}

/* Share of edges that run between two parts. */
static double crossing(const loxo_reordering *r, const loxo_soup *soup)
{
    int64_t *rank = inverse(r, soup->n_vertices), *part = malloc((size_t)soup->n_vertices * sizeof *part), n_cross = 0;
    for (int64_t p = 0; p < r->n_parts; ++p)
        for (int64_t i = r->part_vertex[p]; i < r->part_vertex[p + 1]; ++i)
            part[i] = p;
    for (int64_t h = 0; h < 3 * soup->n_faces; ++h)
        n_cross += part[rank[soup->triangle[h]]] != part[rank[soup->triangle[h % 3 == 2 ? h - 2 : h + 1]]];
    free(part);
    free(rank);
    return (double)n_cross / (double)(3 * soup->n_faces);
}

TEST(orders_are_permutations_and_parts_cover)
{
    const size_t part_bytes = (size_t)150 * 200;
    loxo_soup soup = make(LOXO_SHAPE_BUMPY, 5000, true);
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    for (int k = 0; k < N_ORDERS; ++k) {
        loxo_reordering r;
        if (is_off(orders[k])) {
            CHECK_STATUS(test_context, loxo_reorder(test_context, &arrays, orders[k], part_bytes, &r),
                         LOXO_ERR_UNSUPPORTED);
            CHECK(r.part_vertex == NULL && r.vertex_new_to_old == NULL);
            continue;
        }
        CHECK_OK(loxo_reorder(test_context, &arrays, orders[k], part_bytes, &r));
        CHECK_EQUAL(r.order, orders[k]);
        CHECK((r.vertex_new_to_old == NULL) == (orders[k] == LOXO_ORDER_GIVEN));
        check_parts(&r, soup.n_vertices, 210); /* METIS: 3 % more */
        const double share = crossing(&r, &soup);
        /* A square patch of 200 vertices has 600 edges, 28 of its vertices at the rim with 2 edges out each: 15 %. */
        if (orders[k] == LOXO_ORDER_GIVEN) CHECK(share > 0.9);
        if (orders[k] == LOXO_ORDER_HILBERT || orders[k] == LOXO_ORDER_MORTON) CHECK(share < 0.3);
        if (orders[k] == LOXO_ORDER_METIS) CHECK(share < 0.2);
        loxo_reordering_destroy(test_context, &r);
    }
    loxo_soup_destroy(test_context, &soup);
}

TEST(the_same_for_any_number_of_threads)
{
    static const int ladder[] = {1, 2, 3, 7};
    loxo_soup soup = make(LOXO_SHAPE_BRAIN, 5000, true);
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    for (int k = 0; k < N_ORDERS; ++k) {
        uint64_t first = 0;
        if (is_off(orders[k]) || orders[k] == LOXO_ORDER_GIVEN) continue;
        for (int t = 0; t < 4; ++t) {
            loxo_context *ctx = test_context_with_threads(ladder[t]);
            loxo_reordering r;
            CHECK_STATUS(ctx, loxo_reorder(ctx, &arrays, orders[k], (size_t)150 * 300, &r), LOXO_OK);
            const uint64_t hash = test_hash(r.vertex_new_to_old, (size_t)soup.n_vertices * sizeof(loxo_index)) ^
                                  test_hash(r.part_vertex, (size_t)(r.n_parts + 1) * sizeof(int64_t));
            if (t == 0) first = hash;
            CHECK_EQUAL(hash, first);
            loxo_reordering_destroy(ctx, &r);
            loxo_context_destroy(ctx);
        }
    }
    loxo_soup_destroy(test_context, &soup);
}

/* All points of a lattice of 16^3, each used by a triangle: consecutive ones on Hilbert's curve are neighbours. */
TEST(hilbert_steps_from_cell_to_cell)
{
    const int64_t side = 16, n = side * side * side;
    double *position = malloc((size_t)n * 3 * sizeof *position);
    loxo_index *triangle = malloc((size_t)n * 3 * sizeof *triangle);
    for (int64_t v = 0; v < n; ++v) {
        position[3 * v] = (double)(v % side);
        position[3 * v + 1] = (double)(v / side % side);
        position[3 * v + 2] = floor((double)v / (double)(side * side));
        for (int c = 0; c < 3; ++c)
            triangle[3 * v + c] = (loxo_index)((v + c) % n);
    }
    const loxo_mesh_arrays arrays = {.n_vertices = n, .n_faces = n, .position = position, .triangle = triangle};
    loxo_reordering r;
    CHECK_OK(loxo_reorder(test_context, &arrays, LOXO_ORDER_HILBERT, 0, &r));
    free(inverse(&r, n));
    for (int64_t i = 1; i < n; ++i) {
        const double *a = position + 3 * (int64_t)r.vertex_new_to_old[i - 1],
                     *b = position + 3 * (int64_t)r.vertex_new_to_old[i];
        CHECK_EQUAL(fabs(a[0] - b[0]) + fabs(a[1] - b[1]) + fabs(a[2] - b[2]), 1);
    }
    loxo_reordering_destroy(test_context, &r);
    free(triangle);
    free(position);
}

TEST(breadth_first_goes_level_by_level)
{
    loxo_soup soup = make(LOXO_SHAPE_STRIP, 2000, true);
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    loxo_reordering r;
    CHECK_OK(loxo_reorder(test_context, &arrays, LOXO_ORDER_BFS, 0, &r));
    int64_t *rank = inverse(&r, soup.n_vertices);
    /* From an end of the strip: numbers of neighbours differ by a few. */
    for (int64_t h = 0; h < 3 * soup.n_faces; ++h)
        CHECK(llabs(rank[soup.triangle[h]] - rank[soup.triangle[h % 3 == 2 ? h - 2 : h + 1]]) <= 4);
    free(rank);
    loxo_reordering_destroy(test_context, &r);
    loxo_soup_destroy(test_context, &soup);
}

TEST(auto_keeps_what_is_local)
{
    static const loxo_shape local[] = {LOXO_SHAPE_ICOSPHERE, LOXO_SHAPE_DISK, LOXO_SHAPE_GRID, LOXO_SHAPE_TORUS,
                                       LOXO_SHAPE_GENUS};
    for (int s = 0; s < 5; ++s) {
        loxo_soup soup = make(local[s], 5000, false);
        const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
        loxo_reordering r;
        CHECK_OK(loxo_reorder(test_context, &arrays, LOXO_ORDER_AUTO, (size_t)150 * 300, &r));
        CHECK_EQUAL(r.order, LOXO_ORDER_GIVEN);
        loxo_reordering_destroy(test_context, &r);
        shuffle(&soup);
        const loxo_mesh_arrays shuffled = loxo_soup_arrays(&soup);
        CHECK_OK(loxo_reorder(test_context, &shuffled, LOXO_ORDER_AUTO, (size_t)150 * 300, &r));
        CHECK_EQUAL(r.order, LOXO_ORDER_HILBERT);
        loxo_reordering_destroy(test_context, &r);
        CHECK_OK(loxo_reorder(test_context, &shuffled, LOXO_ORDER_AUTO, (size_t)1 << 30, &r));
        CHECK_EQUAL(r.order, LOXO_ORDER_GIVEN); /* one part: it all fits */
        CHECK_EQUAL(r.n_parts, 1);
        loxo_reordering_destroy(test_context, &r);
        loxo_soup_destroy(test_context, &soup);
    }
}

TEST(jumps_tell_rows_from_scatter)
{
    if (LOXO_INDEX_MAX < 6 * 100000) SKIP();
    loxo_soup soup = make(LOXO_SHAPE_GRID, 100000, false);
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    double rows = -1.0, scatter = -1.0;
    CHECK_OK(loxo_count_jumps(test_context, &arrays, &rows));
    CHECK(rows >= 0.0 && rows < 0.01);
    shuffle(&soup);
    const loxo_mesh_arrays shuffled = loxo_soup_arrays(&soup);
    CHECK_OK(loxo_count_jumps(test_context, &shuffled, &scatter));
    CHECK(scatter > 1.0 && scatter <= 6.0); /* three corners a face, two faces a vertex */
    loxo_soup_destroy(test_context, &soup);
}

/* Two tetrahedra, unused vertices between and after, some not finite. */
TEST(unused_vertices_go_last)
{
    static const double position[11][3] = {{0, 0, 0}, {1e308, 0, 0}, {1, 0, 0}, {0, 1, 0},  {NAN, 0, 0}, {0, 0, 1},
                                           {9, 9, 9}, {8, 9, 9},     {9, 8, 9}, {INFINITY}, {9, 9, 8}};
    static const loxo_index triangle[8][3] = {{0, 3, 2}, {0, 2, 5},  {0, 5, 3},  {2, 3, 5},
                                              {6, 7, 8}, {6, 8, 10}, {6, 10, 7}, {7, 10, 8}};
    const loxo_mesh_arrays arrays = {
        .n_vertices = 11, .n_faces = 8, .position = &position[0][0], .triangle = &triangle[0][0]};
    for (int k = 1; k < N_ORDERS; ++k) {
        loxo_reordering r;
        if (is_off(orders[k])) continue;
        CHECK_OK(loxo_reorder(test_context, &arrays, orders[k], 0, &r));
        free(inverse(&r, 11));
        check_parts(&r, 11, 11);
        CHECK_EQUAL(r.vertex_new_to_old[8], 1);
        CHECK_EQUAL(r.vertex_new_to_old[9], 4);
        CHECK_EQUAL(r.vertex_new_to_old[10], 9);
        loxo_reordering_destroy(test_context, &r);
    }
}

/* Coordinates that are not finite, or as large as doubles get, at used vertices: any order, but an order. */
TEST(wild_coordinates_do_no_harm)
{
    static const double position[6][3] = {{-1.7e308, 0, 0}, {1.7e308, 1, 1},   {NAN, 1e-320, 0},
                                          {INFINITY, 0, 0}, {-INFINITY, 0, 2}, {0, 0, 0}};
    static const double same[6][3] = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
    static const loxo_index triangle[4][3] = {{0, 1, 2}, {2, 1, 3}, {3, 4, 5}, {0, 0, 5}};
    for (int k = 0; k < N_ORDERS; ++k) {
        for (int wild = 0; wild < 2; ++wild) {
            const loxo_mesh_arrays arrays = {.n_vertices = 6,
                                             .n_faces = 4,
                                             .position = wild ? &position[0][0] : &same[0][0],
                                             .triangle = &triangle[0][0]};
            loxo_reordering r;
            if (is_off(orders[k])) continue;
            CHECK_OK(loxo_reorder(test_context, &arrays, orders[k], 1, &r));
            free(inverse(&r, 6));
            check_parts(&r, 6, 64);
            loxo_reordering_destroy(test_context, &r);
        }
    }
}

TEST(nothing_has_an_order_too)
{
    const loxo_mesh_arrays arrays = {0};
    for (int k = 0; k < 4; ++k) {
        loxo_reordering r;
        CHECK_OK(loxo_reorder(test_context, &arrays, orders[k], 0, &r));
        CHECK_EQUAL(r.n_parts, 1);
        check_parts(&r, 0, 0);
        loxo_reordering_destroy(test_context, &r);
    }
    loxo_reordering r;
    CHECK_STATUS(test_context, loxo_reorder(test_context, &arrays, (loxo_order)99, 0, &r), LOXO_ERR_ARGUMENT);
}

typedef struct order_call {
    const loxo_mesh_arrays *arrays;
    loxo_order order;
} order_call;

static loxo_status order_and_drop(loxo_context *ctx, void *arg)
{
    const order_call *call = arg;
    loxo_reordering r;
    const loxo_status status = loxo_reorder(ctx, call->arrays, call->order, (size_t)150 * 100, &r);
    loxo_reordering_destroy(ctx, &r);
    return status;
}

TEST(every_allocation_may_fail)
{
    loxo_soup soup = make(LOXO_SHAPE_ICOSPHERE, 5000, true);
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    for (int k = 0; k < N_ORDERS; ++k) {
        order_call call = {&arrays, orders[k]};
        if (!is_off(orders[k])) CHECK(test_each_allocation_fails(order_and_drop, &call) >= 1);
    }
    order_call call = {&arrays, LOXO_ORDER_AUTO};
    CHECK(test_each_allocation_fails(order_and_drop, &call) >= 4);
    loxo_soup_destroy(test_context, &soup);
}
