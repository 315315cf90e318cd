/* SPDX-License-Identifier: MIT
 * The cycle basis: closed chains, as many as the surface's first homology has dimensions, and independent of each other
 * and of the faces' boundaries (by elimination modulo 2). */
#include "../shapes.h"
#include "mesh/halfedge.h"
#include "mesh/topology.h"

static loxo_mesh *create(loxo_context *ctx, loxo_soup soup)
{
    loxo_mesh *mesh;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    CHECK_STATUS(ctx, loxo_mesh_create(ctx, &arrays, LOXO_ADOPT, NULL, NULL, &mesh), LOXO_OK);
    return mesh;
}

static loxo_index start_of(const loxo_mesh_view *m, const loxo_chains *chains, int64_t i)
{
    const loxo_index h = chains->halfedge[i];
    return m->halfedge_vertex[chains->sign[i] > 0 ? h : loxo_halfedge_next(h)];
}

static loxo_index end_of(const loxo_mesh_view *m, const loxo_chains *chains, int64_t i)
{
    const loxo_index h = chains->halfedge[i];
    return m->halfedge_vertex[chains->sign[i] > 0 ? loxo_halfedge_next(h) : h];
}

static void check_closed(const loxo_mesh_view *m, const loxo_chains *chains)
{
    for (int64_t c = 0; c < chains->n_chains; ++c) {
        const int64_t begin = chains->chain_begin[c], end = chains->chain_begin[c + 1];
        CHECK(end - begin >= 3);
        for (int64_t i = begin; i < end; ++i) {
            CHECK(chains->sign[i] == 1 || chains->sign[i] == -1);
            CHECK_EQUAL(end_of(m, chains, i), start_of(m, chains, i + 1 < end ? i + 1 : begin));
        }
    }
}

/* Rank over the integers modulo 2 of rows [n][n_columns], by elimination. */
static int64_t rank_modulo_2(uint8_t *rows, int64_t n, int64_t n_columns)
{
    int64_t rank = 0;
    for (int64_t column = 0; column < n_columns && rank < n; ++column) {
        int64_t pivot = rank;
        while (pivot < n && !rows[pivot * n_columns + column])
            ++pivot;
        if (pivot == n) continue;
        for (int64_t k = 0; k < n_columns; ++k) {
            const uint8_t x = rows[pivot * n_columns + k];
            rows[pivot * n_columns + k] = rows[rank * n_columns + k];
            rows[rank * n_columns + k] = x;
        }
        for (int64_t i = rank + 1; i < n; ++i) {
            if (!rows[i * n_columns + column]) continue;
            for (int64_t k = column; k < n_columns; ++k)
                rows[i * n_columns + k] ^= rows[rank * n_columns + k];
        }
        ++rank;
    }
    return rank;
}

static int64_t edge_column(const loxo_mesh_view *m, loxo_index h)
{
    return m->halfedge_twin[h] > h ? m->halfedge_twin[h] : h;
}

/* n_closed: components without a boundary, whose faces' boundaries sum to nothing. */
static void check_basis(loxo_mesh *mesh, int64_t n_wanted, int64_t n_closed)
{
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    loxo_chains chains;
    CHECK_OK(loxo_cycle_basis(test_context, &m, &chains));
    CHECK_EQUAL(chains.n_chains, n_wanted);
    check_closed(&m, &chains);
    const int64_t n_columns = 3 * m.n_faces, n_rows = m.n_faces + chains.n_chains;
    uint8_t *rows = calloc((size_t)(n_rows * n_columns), 1);
    for (int64_t h = 0; h < 3 * m.n_faces; ++h)
        rows[h / 3 * n_columns + edge_column(&m, (loxo_index)h)] ^= 1;
    for (int64_t c = 0; c < chains.n_chains; ++c)
        for (int64_t i = chains.chain_begin[c]; i < chains.chain_begin[c + 1]; ++i)
            rows[(m.n_faces + c) * n_columns + edge_column(&m, chains.halfedge[i])] ^= 1;
    CHECK_EQUAL(rank_modulo_2(rows, n_rows, n_columns), m.n_faces - n_closed + n_wanted);
    free(rows);
    loxo_chains_destroy(test_context, &chains);
    CHECK(chains.halfedge == NULL && chains.n_chains == 0);
    loxo_mesh_destroy(mesh);
}

TEST(spheres_and_disks_have_no_cycles)
{
    check_basis(create(test_context, shape_cube(test_context)), 0, 1);
    check_basis(create(test_context, shape_book(test_context, 2)), 0, 0);
}

TEST(torus_annulus_and_genus_two)
{
    check_basis(create(test_context, shape_torus(test_context, 9, 7)), 2, 1);
    check_basis(create(test_context, shape_annulus(test_context, 11, 3)), 1, 0);
    loxo_mesh *mesh = create(test_context, shape_genus(test_context, 2, 150));
    check_basis(mesh, 4, 1);
}

TEST(several_components_with_and_without_boundaries)
{
    loxo_soup soup = shape_torus(test_context, 6, 5), tube = shape_annulus(test_context, 7, 2),
              cube = shape_cube(test_context), holed = shape_torus(test_context, 7, 7);
    /* two faces that share nothing leave holes: genus 1 with two loops */
    memcpy(&holed.triangle[0], &holed.triangle[(int64_t)3 * 97], (int64_t)3 * sizeof(loxo_index));
    memcpy(&holed.triangle[(int64_t)3 * 48], &holed.triangle[(int64_t)3 * 96], (int64_t)3 * sizeof(loxo_index));
    holed.n_faces -= 2;
    shape_append(test_context, &soup, &tube);
    shape_append(test_context, &soup, &cube);
    shape_append(test_context, &soup, &holed);
    check_basis(create(test_context, soup), 2 + 1 + 0 + 3, 2);
}

/* On a torus grid of unit steps around and across, the sums of steps along the two cycles are periods: integers whose
 * matrix has determinant 1 or -1, as any basis has. */
TEST(cycles_of_a_torus_wind_around_it)
{
    enum { N = 12, M = 8 };
    loxo_mesh *mesh = create(test_context, shape_torus(test_context, N, M));
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    loxo_chains chains;
    int64_t wind[2][2] = {{0}};
    CHECK_OK(loxo_cycle_basis(test_context, &m, &chains));
    CHECK_EQUAL(chains.n_chains, 2);
    for (int c = 0; c < 2; ++c) {
        for (int64_t i = chains.chain_begin[c]; i < chains.chain_begin[c + 1]; ++i) {
            loxo_index a = start_of(&m, &chains, i), b = end_of(&m, &chains, i);
            if (m.vertex_origin != NULL) {
                a = m.vertex_origin[a];
                b = m.vertex_origin[b];
            }
            wind[c][0] += (b / M - a / M + N + N / 2) % N - N / 2;
            wind[c][1] += (b % M - a % M + M + M / 2) % M - M / 2;
        }
        CHECK_EQUAL(wind[c][0] % N, 0);
        CHECK_EQUAL(wind[c][1] % M, 0);
        CHECK(chains.chain_begin[c + 1] - chains.chain_begin[c] <= (int64_t)2 * (N + M)); /* short */
    }
    CHECK_EQUAL(llabs(wind[0][0] / N * (wind[1][1] / M) - wind[0][1] / M * (wind[1][0] / N)), 1);
    loxo_chains_destroy(test_context, &chains);
    loxo_mesh_destroy(mesh);
}

static loxo_status basis(loxo_context *ctx, void *arg)
{
    loxo_chains chains;
    const loxo_status status = loxo_cycle_basis(ctx, arg, &chains);
    loxo_chains_destroy(ctx, &chains);
    return status;
}

TEST(every_allocation_may_fail)
{
    loxo_mesh *mesh = create(test_context, shape_annulus(test_context, 9, 7));
    loxo_mesh_view m = loxo_mesh_get_view(mesh);
    CHECK(test_each_allocation_fails(basis, &m) >= 8);
    loxo_mesh_destroy(mesh);
    mesh = create(test_context, shape_genus(test_context, 3, 900));
    m = loxo_mesh_get_view(mesh);
    CHECK(test_each_allocation_fails(basis, &m) >= 8);
    loxo_mesh_destroy(mesh);
}

static int stop_at_once(void *user, const loxo_progress *progress)
{
    *(int *)user += strcmp(progress->phase, "cycles") == 0;
    return 1;
}

TEST(the_monitor_stops_it)
{
    NEEDS_IDS(3600000); /* so large that it is asked: the monitor is called every 20 ms at most */
    loxo_mesh *mesh = create(test_context, shape_torus(test_context, 1000, 600));
    loxo_mesh_view m = loxo_mesh_get_view(mesh);
    int n_calls = 0;
    loxo_context_set_monitor(test_context, stop_at_once, &n_calls);
    CHECK_STATUS(test_context, basis(test_context, &m), LOXO_ERR_STOPPED);
    CHECK_EQUAL(n_calls, 1);
    loxo_context_set_monitor(test_context, NULL, NULL);
    CHECK_OK(basis(test_context, &m));
    loxo_mesh_destroy(mesh);
}
