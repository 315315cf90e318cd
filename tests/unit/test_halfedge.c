/* SPDX-License-Identifier: MIT
 * Twins, fans and orientation against slow obvious versions and counts in closed form. */
#include "../shapes.h"
#include "base/rng.h"
#include "mesh/halfedge.h"
#include "mesh/soup.h"

typedef struct matched {
    loxo_soup soup;
    loxo_index *twin;
    loxo_edge_counts counts;
} matched;

static matched match(loxo_context *ctx, loxo_soup soup)
{
    matched m = {.soup = soup};
    m.twin = loxo_allocate(ctx, 3 * soup.n_faces, sizeof *m.twin);
    CHECK_STATUS(ctx, loxo_match_halfedges(ctx, soup.n_vertices, soup.n_faces, soup.triangle, m.twin, &m.counts),
                 LOXO_OK);
    return m;
}

static void drop(loxo_context *ctx, matched *m)
{
    loxo_soup_destroy(ctx, &m->soup);
    loxo_release(ctx, m->twin);
}

static loxo_index end_of(const loxo_soup *soup, int64_t h) { return soup->triangle[loxo_halfedge_next((loxo_index)h)]; }

/* All pairs of half-edges. */
static void check_against_all_pairs(const matched *m)
{
    const loxo_soup *s = &m->soup;
    int64_t n_edges = 0, n_boundary = 0, n_nonmanifold = 0, n_same_way = 0;
    for (int64_t h = 0; h < 3 * s->n_faces; ++h) {
        const loxo_index a = s->triangle[h], b = end_of(s, h);
        int64_t lower = -1, highest = -1;
        int n = 0;
        bool is_same_way = false;
        if (loxo_is_degenerate(&s->triangle[h / 3 * 3])) {
            CHECK_EQUAL(m->twin[h], LOXO_NO_EDGE);
            continue;
        }
        for (int64_t i = 0; i < 3 * s->n_faces; ++i) {
            const loxo_index c = s->triangle[i], d = end_of(s, i);
            if (loxo_is_degenerate(&s->triangle[i / 3 * 3])) continue;
            if (!((a == c && b == d) || (a == d && b == c))) continue;
            n += 1;
            if (i < h) lower = i;
            if (i != h && a == c) is_same_way = true;
            highest = i;
        }
        if (n == 1)
            CHECK_EQUAL(m->twin[h], -1);
        else
            CHECK_EQUAL(m->twin[h], lower >= 0 ? lower : highest);
        if (lower >= 0) continue;
        n_edges += 1;
        n_boundary += n == 1;
        n_nonmanifold += n > 2;
        n_same_way += n == 2 && is_same_way;
    }
    CHECK_EQUAL(m->counts.n_edges, n_edges);
    CHECK_EQUAL(m->counts.n_boundary, n_boundary);
    CHECK_EQUAL(m->counts.n_nonmanifold, n_nonmanifold);
    CHECK_EQUAL(m->counts.n_same_way, n_same_way);
}

TEST(twins_of_closed_shapes_are_mutual_and_run_against_each_other)
{
    matched all[3] = {match(test_context, shape_tetrahedron(test_context)),
                      match(test_context, shape_cube(test_context)),
                      match(test_context, shape_torus(test_context, 7, 5))};
    const int64_t n_edges[3] = {6, 18, 105};
    for (int i = 0; i < 3; ++i) {
        const matched *m = &all[i];
        CHECK_EQUAL(m->counts.n_edges, n_edges[i]);
        CHECK_EQUAL(m->counts.n_boundary, 0);
        for (int64_t h = 0; h < 3 * m->soup.n_faces; ++h) {
            const loxo_index t = m->twin[h];
            CHECK(t >= 0 && m->twin[t] == h && t != h);
            CHECK_EQUAL(m->soup.triangle[h], end_of(&m->soup, t));
        }
        check_against_all_pairs(m);
        drop(test_context, &all[i]);
    }
}

TEST(random_soups_match_as_all_pairs_do)
{
    for (uint64_t seed = 0; seed < 40; ++seed) {
        const int n_vertices = 4 + (int)(seed % 7), n_faces = 1 + (int)(seed * 3 % 60);
        loxo_soup soup = shape_empty(test_context, n_vertices, n_faces);
        memset(soup.position, 0, (size_t)n_vertices * 3 * sizeof(double));
        for (int64_t i = 0; i < (int64_t)3 * n_faces; ++i)
            soup.triangle[i] = (loxo_index)(loxo_random_u64(seed, (uint64_t)i) % (uint64_t)n_vertices);
        matched m = match(test_context, soup);
        check_against_all_pairs(&m);
        drop(test_context, &m);
    }
}

TEST(an_edge_with_three_faces_is_a_ring)
{
    matched m = match(test_context, shape_book(test_context, 3));
    CHECK_EQUAL(m.counts.n_nonmanifold, 1);
    CHECK_EQUAL(m.counts.first_nonmanifold, 0);
    CHECK_EQUAL(m.counts.n_boundary, 6);
    CHECK_EQUAL(m.twin[0], 6);
    CHECK_EQUAL(m.twin[6], 3);
    CHECK_EQUAL(m.twin[3], 0);
    CHECK(!loxo_is_paired(m.twin, 0));
    drop(test_context, &m);
}

TEST(a_hub_with_many_faces_and_an_edge_with_many)
{
    const int n = LOXO_INDEX_MAX < 1000000 ? 5000 : 100000;
    matched hub = match(test_context, shape_hub(test_context, n));
    CHECK_EQUAL(hub.counts.n_edges, 3 * (int64_t)n);
    CHECK_EQUAL(hub.counts.n_boundary, 0);
    CHECK_EQUAL(hub.counts.n_same_way, 0);
    CHECK_EQUAL(loxo_fan_size(hub.soup.triangle, hub.twin, 0), n);
    drop(test_context, &hub);
    matched book = match(test_context, shape_book(test_context, n));
    CHECK_EQUAL(book.counts.n_nonmanifold, 1);
    CHECK_EQUAL(book.counts.n_boundary, 2 * (int64_t)n);
    drop(test_context, &book);
}

TEST(the_fan_of_a_boundary_vertex_begins_at_the_boundary)
{
    matched m = match(test_context, shape_annulus(test_context, 9, 3));
    loxo_index *first = loxo_allocate(test_context, m.soup.n_vertices, sizeof *first);
    const int64_t n_met =
        loxo_link_vertices(test_context, m.soup.n_vertices, m.soup.n_faces, m.soup.triangle, m.twin, first);
    CHECK_EQUAL(n_met, 3 * m.soup.n_faces);
    CHECK_EQUAL(m.counts.n_boundary, 18);
    for (int64_t h = 0; h < 3 * m.soup.n_faces; ++h)
        if (m.twin[h] < 0) CHECK_EQUAL(first[m.soup.triangle[h]], h);
    for (int64_t v = 0; v < m.soup.n_vertices; ++v)
        CHECK_EQUAL(m.soup.triangle[first[v]], v);
    loxo_release(test_context, first);
    drop(test_context, &m);
}

TEST(a_bow_tie_is_met_only_in_part)
{
    matched m = match(test_context, shape_bow_tie(test_context));
    loxo_index first[5];
    CHECK_EQUAL(loxo_link_vertices(test_context, 5, 2, m.soup.triangle, m.twin, first), 5);
    CHECK_EQUAL(loxo_fan_size(m.soup.triangle, m.twin, 0), 1);
    drop(test_context, &m);
}

TEST(turned_faces_are_found_and_the_fewer_are_turned)
{
    matched m = match(test_context, shape_torus(test_context, 6, 6));
    uint8_t mark[72] = {0}, turn[72];
    int64_t n_turned, conflict;
    mark[3] = mark[10] = mark[11] = mark[70] = 1;
    loxo_turn_faces(test_context, 72, mark, m.soup.triangle);
    CHECK_OK(loxo_match_halfedges(test_context, m.soup.n_vertices, 72, m.soup.triangle, m.twin, &m.counts));
    CHECK(m.counts.n_same_way > 0);
    CHECK_OK(loxo_find_orientation(test_context, 72, m.soup.triangle, m.twin, turn, &n_turned, &conflict));
    CHECK_EQUAL(n_turned, 4);
    CHECK_EQUAL(conflict, -1);
    CHECK(memcmp(mark, turn, sizeof mark) == 0);
    loxo_turn_faces(test_context, 72, turn, m.soup.triangle);
    CHECK_OK(loxo_match_halfedges(test_context, m.soup.n_vertices, 72, m.soup.triangle, m.twin, &m.counts));
    CHECK_EQUAL(m.counts.n_same_way, 0);
    drop(test_context, &m);
}

TEST(a_moebius_strip_has_no_orientation)
{
    matched m = match(test_context, shape_moebius(test_context, 12));
    uint8_t turn[48];
    int64_t n_turned, conflict;
    CHECK_EQUAL(m.soup.n_faces, 48);
    CHECK_OK(loxo_find_orientation(test_context, 48, m.soup.triangle, m.twin, turn, &n_turned, &conflict));
    CHECK(conflict >= 0 && conflict < 48);
    drop(test_context, &m);
}

TEST(one_two_three_and_seven_threads_give_the_same_bits)
{
    uint64_t hash[4];
    const int n_threads[4] = {1, 2, 3, 7};
    for (int i = 0; i < 4; ++i) {
        loxo_context *ctx = test_context_with_threads(n_threads[i]);
        loxo_soup soup = shape_torus(ctx, 100, 50);
        CHECK_STATUS(ctx, loxo_soup_shuffle(ctx, &soup, 5, NULL), LOXO_OK);
        matched m = match(ctx, soup);
        loxo_index *first = loxo_allocate(ctx, soup.n_vertices, sizeof *first);
        loxo_link_vertices(ctx, soup.n_vertices, soup.n_faces, soup.triangle, m.twin, first);
        hash[i] = test_hash(m.twin, (size_t)soup.n_faces * 3 * sizeof *m.twin) ^
                  test_hash(first, (size_t)soup.n_vertices * sizeof *first);
        CHECK_EQUAL(hash[i], hash[0]);
        loxo_release(ctx, first);
        drop(ctx, &m);
        loxo_context_destroy(ctx);
    }
}
