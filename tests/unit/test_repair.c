/* SPDX-License-Identifier: MIT
 * Repair, subdivision and shuffling of soup: counts, maps of vertices, and that repaired soup has nothing left. */
#include "../shapes.h"
#include "base/rng.h"

static loxo_mesh_report check(loxo_context *ctx, const loxo_soup *soup)
{
    loxo_mesh_report report;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    CHECK_STATUS(ctx, loxo_mesh_check(ctx, &arrays, &report), LOXO_OK);
    return report;
}

static void add_field(loxo_context *ctx, loxo_soup *soup)
{
    soup->fields = loxo_allocate(ctx, 1, sizeof *soup->fields);
    soup->n_fields = 1;
    snprintf(soup->fields[0].name, sizeof soup->fields[0].name, "number");
    soup->fields[0].value = loxo_allocate(ctx, soup->n_vertices, sizeof(double));
    for (int64_t v = 0; v < soup->n_vertices; ++v)
        soup->fields[0].value[v] = (double)v;
}

/* The field counts the vertices before, so origin and field must agree. */
static void check_origin(const loxo_soup *soup, const loxo_index *origin)
{
    for (int64_t v = 0; v < soup->n_vertices; ++v)
        CHECK_EQUAL(soup->fields[0].value[v], origin[v]);
}

TEST(sound_soup_stays_as_it_is)
{
    loxo_soup soup = shape_torus(test_context, 6, 5);
    loxo_index *origin;
    loxo_repair_info info;
    const uint64_t hash = test_hash(soup.triangle, (size_t)60 * 3 * sizeof *soup.triangle);
    add_field(test_context, &soup);
    CHECK_OK(loxo_soup_repair(test_context, &soup, NULL, &origin, &info));
    CHECK_EQUAL(soup.n_vertices, 30);
    CHECK_EQUAL(test_hash(soup.triangle, (size_t)60 * 3 * sizeof *soup.triangle), hash);
    CHECK_EQUAL(info.n_vertices_welded + info.n_vertices_split + info.n_faces_turned, 0);
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 0);
    check_origin(&soup, origin);
    for (int64_t v = 0; v < 30; ++v)
        CHECK_EQUAL(origin[v], v);
    loxo_release(test_context, origin);
    loxo_soup_destroy(test_context, &soup);
}

TEST(a_torn_torus_is_welded_together)
{
    loxo_soup whole = shape_torus(test_context, 6, 5);
    loxo_soup torn = shape_empty(test_context, 180, 60); /* every face has corners of its own */
    loxo_index *origin;
    loxo_repair_info info;
    for (int i = 0; i < 180; ++i) {
        memcpy(&torn.position[(int64_t)3 * i], &whole.position[(int64_t)3 * whole.triangle[i]],
               (int64_t)3 * sizeof(double));
        torn.triangle[i] = (loxo_index)i;
    }
    add_field(test_context, &torn);
    CHECK_STATUS(test_context, loxo_soup_repair(test_context, &torn, NULL, &origin, &info), LOXO_REPAIRED);
    CHECK_EQUAL(info.n_vertices_welded, 150);
    CHECK_EQUAL(torn.n_vertices, 30);
    check_origin(&torn, origin);
    const loxo_mesh_report r = check(test_context, &torn);
    CHECK_EQUAL(r.genus, 1);
    CHECK(r.is_closed && r.is_manifold && r.is_oriented);
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 0); /* what was asked for is no warning */
    loxo_release(test_context, origin);
    loxo_soup_destroy(test_context, &torn);
    loxo_soup_destroy(test_context, &whole);
}

TEST(degenerate_and_duplicate_faces_go_with_one_warning_each)
{
    loxo_soup soup = shape_cube(test_context), more = shape_empty(test_context, 0, 4);
    memset(more.triangle, 0, 12 * sizeof *more.triangle);
    shape_append(test_context, &soup, &more);
    const loxo_index faces[12] = {0, 0, 3, 5, 4, 6, 1, 2, 2, 0, 2, 1}; /* 13 and 15 duplicate cube faces */
    memcpy(&soup.triangle[36], faces, sizeof faces);
    loxo_repair_info info;
    CHECK_STATUS(test_context, loxo_soup_repair(test_context, &soup, NULL, NULL, &info), LOXO_REPAIRED);
    CHECK_EQUAL(info.n_degenerate_dropped, 2);
    CHECK_EQUAL(info.n_duplicate_faces_dropped, 2);
    CHECK_EQUAL(soup.n_faces, 12);
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 1);
    CHECK_TEXT(loxo_context_warning(test_context, 0)->text, "2 degenerate faces dropped (first: face 12)");
    CHECK_EQUAL(loxo_context_warning(test_context, 0)->count, 2);
    const loxo_mesh_report r = check(test_context, &soup);
    CHECK(r.is_closed && r.is_manifold);
    loxo_soup_destroy(test_context, &soup);
}

TEST(turned_faces_come_round_with_a_warning)
{
    loxo_soup soup = shape_torus(test_context, 6, 6);
    loxo_repair_info info;
    for (int f = 20; f < 23; ++f) {
        const loxo_index b = soup.triangle[(int64_t)3 * f];
        soup.triangle[(int64_t)3 * f] = soup.triangle[(int64_t)3 * f + 1];
        soup.triangle[3 * f + 1] = b;
    }
    CHECK_STATUS(test_context, loxo_soup_repair(test_context, &soup, NULL, NULL, &info), LOXO_REPAIRED);
    CHECK_EQUAL(info.n_faces_turned, 3);
    CHECK_TEXT(loxo_context_warning(test_context, 0)->text,
               "3 faces turned to agree with the neighbours (first: face 20)");
    CHECK(check(test_context, &soup).is_oriented);
    loxo_soup_destroy(test_context, &soup);
}

TEST(a_bow_tie_is_split)
{
    loxo_soup soup = shape_bow_tie(test_context);
    loxo_index *origin;
    loxo_repair_info info;
    add_field(test_context, &soup);
    CHECK_STATUS(test_context, loxo_soup_repair(test_context, &soup, NULL, &origin, &info), LOXO_REPAIRED);
    CHECK_EQUAL(info.n_vertices_split, 1);
    CHECK_EQUAL(soup.n_vertices, 6);
    CHECK_EQUAL(origin[5], 0);
    CHECK_EQUAL(soup.triangle[0], 0); /* the first fan keeps the number */
    CHECK_EQUAL(soup.triangle[3], 5);
    check_origin(&soup, origin);
    CHECK_EQUAL(check(test_context, &soup).n_components, 2);
    loxo_release(test_context, origin);
    loxo_soup_destroy(test_context, &soup);
}

TEST(the_pages_of_a_book_come_apart)
{
    loxo_soup soup = shape_book(test_context, 5);
    loxo_repair_info info;
    CHECK_STATUS(test_context, loxo_soup_repair(test_context, &soup, NULL, NULL, &info), LOXO_REPAIRED);
    CHECK_EQUAL(info.n_vertices_split, 8);
    const loxo_mesh_report r = check(test_context, &soup);
    CHECK(r.is_manifold);
    CHECK_EQUAL(r.n_components, 5);
    loxo_soup_destroy(test_context, &soup);
}

TEST(a_fin_comes_off_a_closed_surface_that_stays_closed)
{
    loxo_soup soup = shape_torus(test_context, 6, 6), fin = shape_empty(test_context, 1, 1);
    fin.position[0] = fin.position[1] = fin.position[2] = 9.0;
    memset(fin.triangle, 0, 3 * sizeof *fin.triangle);
    shape_append(test_context, &soup, &fin);
    const loxo_index face[3] = {soup.triangle[0], soup.triangle[1], 36};
    memcpy(&soup.triangle[(int64_t)3 * 72], face, sizeof face);
    loxo_repair_info info;
    CHECK_STATUS(test_context, loxo_soup_repair(test_context, &soup, NULL, NULL, &info), LOXO_REPAIRED);
    CHECK_EQUAL(info.n_vertices_split, 2);
    const loxo_mesh_report r = check(test_context, &soup);
    CHECK(r.is_manifold && r.is_oriented);
    CHECK_EQUAL(r.n_components, 2);
    CHECK_EQUAL(r.n_boundary_edges, 3);
    CHECK_EQUAL(r.genus, 1);
    loxo_soup_destroy(test_context, &soup);
}

TEST(unreferenced_vertices_go_on_request)
{
    loxo_soup soup = shape_cube(test_context), more = shape_empty(test_context, 3, 0);
    loxo_repair_settings settings = loxo_repair_settings_default();
    loxo_index *origin;
    loxo_repair_info info;
    for (int i = 0; i < 9; ++i)
        more.position[i] = 7.0 + i;
    shape_append(test_context, &more, &soup); /* the three first */
    add_field(test_context, &more);
    CHECK_OK(loxo_soup_repair(test_context, &more, &settings, NULL, &info));
    CHECK_EQUAL(more.n_vertices, 11);
    settings.drop_unreferenced = true;
    CHECK_STATUS(test_context, loxo_soup_repair(test_context, &more, &settings, &origin, &info), LOXO_REPAIRED);
    CHECK_EQUAL(info.n_unreferenced_dropped, 3);
    CHECK_EQUAL(more.n_vertices, 8);
    CHECK_EQUAL(origin[0], 3);
    check_origin(&more, origin);
    CHECK_NEAR(check(test_context, &more).volume, 1.0, 1e-14);
    loxo_release(test_context, origin);
    loxo_soup_destroy(test_context, &more);
}

TEST(what_is_not_asked_for_is_not_done)
{
    loxo_soup soup = shape_book(test_context, 3), other = shape_book(test_context, 3);
    const loxo_repair_settings none = {0};
    shape_append(test_context, &soup, &other);
    CHECK_OK(loxo_soup_repair(test_context, &soup, &none, NULL, NULL));
    CHECK_EQUAL(soup.n_vertices, 10);
    CHECK_EQUAL(check(test_context, &soup).nonmanifold_edges.count, 2);
    loxo_soup_destroy(test_context, &soup);
}

TEST(failures_leave_the_soup_as_it_was)
{
    loxo_soup soup = shape_moebius(test_context, 12);
    const uint64_t hash = test_hash(soup.triangle, (size_t)48 * 3 * sizeof *soup.triangle);
    loxo_index *origin = NULL;
    CHECK_STATUS(test_context, loxo_soup_repair(test_context, &soup, NULL, &origin, NULL), LOXO_ERR_MESH);
    CHECK(strstr(loxo_context_failure(test_context)->text, "not orientable") != NULL);
    CHECK(loxo_context_failure(test_context)->element >= 0);
    CHECK(origin == NULL);
    CHECK_EQUAL(test_hash(soup.triangle, (size_t)48 * 3 * sizeof *soup.triangle), hash);
    soup.triangle[5] = 99;
    CHECK_STATUS(test_context, loxo_soup_repair(test_context, &soup, NULL, &origin, NULL), LOXO_ERR_MALFORMED);
    CHECK_STATUS(test_context, loxo_soup_repair(test_context, NULL, NULL, &origin, NULL), LOXO_ERR_ARGUMENT);
    loxo_soup_destroy(test_context, &soup);
}

static int stop_at_once(void *user, const loxo_progress *progress)
{
    *(int *)user += strcmp(progress->phase, "repair") == 0;
    return 1;
}

TEST(the_monitor_stops_it_and_the_soup_is_as_it_was)
{
    NEEDS_IDS(3600000); /* so large that it is asked: the monitor is called every 20 ms at most */
    loxo_soup soup = shape_torus(test_context, 1000, 600);
    const size_t n_bytes = (size_t)soup.n_faces * 3 * sizeof *soup.triangle;
    loxo_index *origin = NULL;
    int n_calls = 0;
    soup.triangle[30] = soup.triangle[31];
    const uint64_t hash = test_hash(soup.triangle, n_bytes);
    loxo_context_set_monitor(test_context, stop_at_once, &n_calls);
    CHECK_STATUS(test_context, loxo_soup_repair(test_context, &soup, NULL, &origin, NULL), LOXO_ERR_STOPPED);
    CHECK_EQUAL(n_calls, 1);
    CHECK(origin == NULL);
    CHECK_EQUAL(soup.n_faces, 1200000);
    CHECK_EQUAL(test_hash(soup.triangle, n_bytes), hash);
    loxo_soup_destroy(test_context, &soup);
}

/* Any triangles whatsoever: repaired, or not orientable; a second repair finds nothing. */
TEST(random_soups_end_manifold)
{
    int n_repaired = 0;
    for (uint64_t seed = 0; seed < 300; ++seed) {
        const int n_vertices = 5 + (int)(seed % 30), n_faces = 1 + (int)(seed * 7 % 40);
        loxo_soup soup = shape_empty(test_context, n_vertices, n_faces);
        loxo_repair_info info;
        loxo_index *origin = NULL;
        for (int64_t i = 0; i < (int64_t)3 * n_vertices; ++i) /* few places: some are the same */
            soup.position[i] = (double)(loxo_random_u64(seed + 1000, (uint64_t)i) % 3);
        for (int64_t i = 0; i < (int64_t)3 * n_faces; ++i)
            soup.triangle[i] = (loxo_index)(loxo_random_u64(seed, (uint64_t)i) % (uint64_t)n_vertices);
        add_field(test_context, &soup);
        const loxo_status status = loxo_soup_repair(test_context, &soup, NULL, &origin, &info);
        if (status == LOXO_ERR_MESH) {
            CHECK_EQUAL(soup.n_faces, n_faces);
        } else {
            CHECK(status >= 0);
            n_repaired += 1;
            check_origin(&soup, origin);
            const loxo_mesh_report r = check(test_context, &soup);
            CHECK(r.is_manifold && r.is_oriented);
            CHECK_EQUAL(r.degenerate_faces.count + r.duplicate_faces.count, 0);
            const loxo_repair_settings split = {.split_nonmanifold = true}; /* welding would undo the splits */
            CHECK_OK(loxo_soup_repair(test_context, &soup, &split, NULL, &info));
        }
        loxo_release(test_context, origin);
        loxo_soup_destroy(test_context, &soup);
    }
    CHECK(n_repaired > 100);
}

TEST(subdivision_keeps_the_surface)
{
    loxo_soup soup = shape_torus(test_context, 6, 5);
    add_field(test_context, &soup);
    const loxo_mesh_report before = check(test_context, &soup);
    const loxo_index a = soup.triangle[0], b = soup.triangle[1];
    const double middle = 0.5 * a + 0.5 * b;
    CHECK_OK(loxo_soup_subdivide(test_context, &soup, 2));
    const loxo_mesh_report after = check(test_context, &soup);
    CHECK_EQUAL(soup.n_faces, 16 * 60);
    CHECK_EQUAL(after.euler, 0);
    CHECK(after.is_oriented && after.is_closed && after.is_manifold);
    CHECK_NEAR(after.area, before.area, 1e-13 * before.area);
    CHECK_NEAR(after.volume, before.volume, 1e-13);
    CHECK_NEAR(after.edge_length.max, before.edge_length.max / 4, 1e-14);
    CHECK_EQUAL(soup.fields[0].value[30], middle); /* the first edge's middle is the first new vertex */
    CHECK_NEAR(soup.position[90], 0.5 * (soup.position[(int64_t)3 * a] + soup.position[(int64_t)3 * b]), 1e-15);
    loxo_soup_destroy(test_context, &soup);
}

TEST(subdivision_of_broken_soup)
{
    loxo_soup soup = shape_book(test_context, 3);
    soup.triangle[8] = soup.triangle[7]; /* the third page is degenerate */
    CHECK_OK(loxo_soup_subdivide(test_context, &soup, 1));
    CHECK_EQUAL(soup.n_faces, 8);
    CHECK_EQUAL(soup.n_vertices, 5 + 5);
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 1);
    CHECK_STATUS(test_context, loxo_soup_subdivide(test_context, &soup, -1), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_soup_subdivide(test_context, &soup, 40), LOXO_ERR_LIMIT);
    CHECK_STATUS(test_context, loxo_soup_subdivide(test_context, &soup, INT_MAX), LOXO_ERR_LIMIT);
    CHECK_EQUAL(soup.n_faces, 8);
    loxo_soup empty = {0};
    CHECK_OK(loxo_soup_subdivide(test_context, &empty, 3));
    loxo_soup_destroy(test_context, &soup);
}

TEST(shuffling_permutes)
{
    loxo_soup soup = shape_torus(test_context, 9, 8), same = shape_torus(test_context, 9, 8);
    loxo_index *origin;
    char seen[72] = {0};
    int64_t n_moved = 0;
    add_field(test_context, &soup);
    CHECK_OK(loxo_soup_shuffle(test_context, &soup, 3, &origin));
    check_origin(&soup, origin);
    for (int v = 0; v < 72; ++v) {
        seen[origin[v]] += 1;
        n_moved += origin[v] != v;
        CHECK_NEAR3(&soup.position[(int64_t)3 * v], &same.position[(int64_t)3 * origin[v]], 0.0);
    }
    for (int v = 0; v < 72; ++v)
        CHECK_EQUAL(seen[v], 1);
    CHECK(n_moved > 60);
    CHECK_OK(loxo_soup_shuffle(test_context, &same, 3, NULL));
    CHECK(memcmp(soup.triangle, same.triangle, (size_t)144 * 3 * sizeof *same.triangle) == 0);
    CHECK_EQUAL(check(test_context, &soup).genus, 1);
    loxo_release(test_context, origin);
    loxo_soup_destroy(test_context, &soup);
    loxo_soup_destroy(test_context, &same);
}

/* Everything at once, for allocation failures and threads. */
static loxo_status make_and_mend(loxo_context *ctx, void *arg)
{
    const loxo_soup *model = arg;
    loxo_soup soup = {.n_vertices = model->n_vertices, .n_faces = model->n_faces};
    loxo_index *origin = NULL;
    loxo_status status = LOXO_ERR_MEMORY;
    soup.position = loxo_allocate(ctx, soup.n_vertices, 3 * sizeof(double));
    if (soup.position == NULL) goto done;
    soup.triangle = loxo_allocate(ctx, soup.n_faces, 3 * sizeof(loxo_index));
    if (soup.triangle == NULL) goto done;
    memcpy(soup.position, model->position, (size_t)soup.n_vertices * 3 * sizeof(double));
    memcpy(soup.triangle, model->triangle, (size_t)soup.n_faces * 3 * sizeof(loxo_index));
    const loxo_repair_settings all = {true, true, true, true};
    if ((status = loxo_soup_repair(ctx, &soup, &all, &origin, NULL)) < 0) goto done;
    loxo_release(ctx, origin);
    origin = NULL;
    if ((status = loxo_soup_shuffle(ctx, &soup, 9, &origin)) < 0) goto done;
    if ((status = loxo_soup_subdivide(ctx, &soup, 1)) < 0) goto done;
    memcpy(model->fields[0].value, soup.position, 64 * sizeof(double));
done:
    loxo_release(ctx, origin);
    loxo_soup_destroy(ctx, &soup);
    return status;
}

static loxo_soup everything_broken(void)
{
    loxo_soup soup = shape_torus(test_context, 12, 8), more = shape_book(test_context, 4),
              tie = shape_bow_tie(test_context), spare = shape_empty(test_context, 2, 0);
    memset(spare.position, 0, 6 * sizeof(double));
    shape_append(test_context, &soup, &more);
    shape_append(test_context, &soup, &tie);
    shape_append(test_context, &soup, &spare);
    soup.triangle[30] = soup.triangle[31];
    const loxo_index b = soup.triangle[61];
    soup.triangle[61] = soup.triangle[62];
    soup.triangle[62] = b;
    add_field(test_context, &soup);
    return soup;
}

TEST(every_allocation_may_fail)
{
    loxo_soup soup = everything_broken();
    CHECK(test_each_allocation_fails(make_and_mend, &soup) > 20);
    loxo_soup_destroy(test_context, &soup);
}

TEST(every_number_of_threads_gives_the_same_bits)
{
    uint64_t hash = 0;
    const int n_threads[4] = {1, 2, 3, 7};
    for (int i = 0; i < 4; ++i) {
        loxo_context *ctx = test_context_with_threads(n_threads[i]);
        const int n = LOXO_INDEX_MAX > 100000 ? 90 : 40;
        loxo_soup soup = shape_torus(ctx, n, n / 3), tie = shape_book(ctx, 30);
        shape_append(ctx, &soup, &tie);
        CHECK_STATUS(ctx, loxo_soup_shuffle(ctx, &soup, 5, NULL), LOXO_OK);
        soup.triangle[77] = soup.triangle[78];
        CHECK(loxo_soup_repair(ctx, &soup, NULL, NULL, NULL) == LOXO_REPAIRED);
        CHECK_STATUS(ctx, loxo_soup_subdivide(ctx, &soup, 1), LOXO_OK);
        const uint64_t mine = test_hash(soup.position, (size_t)soup.n_vertices * 3 * sizeof(double)) ^
                              test_hash(soup.triangle, (size_t)soup.n_faces * 3 * sizeof(loxo_index));
        if (i == 0) hash = mine;
        CHECK_EQUAL(mine, hash);
        loxo_soup_destroy(ctx, &soup);
        loxo_context_destroy(ctx);
    }
}
