/* SPDX-License-Identifier: MIT
 * The report on shapes whose every number is known, on broken ones, and on what must not be touched. */
#include "../shapes.h"
#include "base/rng.h"

#define PI 3.14159265358979323846

static loxo_mesh_report check(loxo_context *ctx, const loxo_soup *soup)
{
    loxo_mesh_report report;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    CHECK_STATUS(ctx, loxo_mesh_check(ctx, &arrays, &report), LOXO_OK);
    return report;
}

/* Checks and destroys. */
static loxo_mesh_report report_of(loxo_soup soup)
{
    const loxo_mesh_report report = check(test_context, &soup);
    loxo_soup_destroy(test_context, &soup);
    return report;
}

static int64_t n_faults(const loxo_mesh_report *r)
{
    return r->nonmanifold_edges.count + r->nonmanifold_vertices.count + r->inconsistent_faces.count +
           r->duplicate_vertices.count + r->unreferenced_vertices.count + r->degenerate_faces.count +
           r->zero_area_faces.count + r->duplicate_faces.count + r->nonfinite_vertices.count;
}

TEST(cube)
{
    const loxo_mesh_report r = report_of(shape_cube(test_context));
    CHECK_EQUAL(r.n_vertices, 8);
    CHECK_EQUAL(r.n_edges, 18);
    CHECK_EQUAL(r.n_faces, 12);
    CHECK_EQUAL(r.n_components, 1);
    CHECK_EQUAL(r.euler, 2);
    CHECK_EQUAL(r.genus, 0);
    CHECK_EQUAL(r.n_boundary_loops, 0);
    CHECK(r.is_manifold && r.is_orientable && r.is_oriented && r.is_closed);
    CHECK_EQUAL(n_faults(&r), 0);
    CHECK_NEAR(r.area, 6.0, 1e-14);
    CHECK_NEAR(r.volume, 1.0, 1e-14);
    CHECK_NEAR(r.edge_length.min, 1.0, 0.0);
    CHECK_NEAR(r.edge_length.max, sqrt(2.0), 1e-15);
    CHECK_NEAR(r.edge_length.mean, (12.0 + 6.0 * sqrt(2.0)) / 18.0, 1e-14);
    CHECK_NEAR(r.edge_length.median, 1.0, 1e-6); /* percentiles are known to one part in 2^20 */
    CHECK_NEAR(r.edge_length.percentile_99, sqrt(2.0), 2e-6);
    CHECK_NEAR(r.angle_rad.min, PI / 4, 1e-15);
    CHECK_NEAR(r.angle_rad.max, PI / 2, 1e-15);
    CHECK_NEAR(r.angle_rad.mean, PI / 3, 1e-15);
    CHECK_NEAR(r.angle_rad.median, PI / 4, 1e-6);
    CHECK_EQUAL(r.share_obtuse, 0.0);
    CHECK_EQUAL(r.share_nondelaunay, 0.0); /* 90 and 90 degrees across the diagonals: exactly pi */
    /* right isosceles triangle: inradius (2 - sqrt 2) / 2, longest sqrt 2 */
    CHECK_NEAR(r.quality, 2.0 * sqrt(3.0) * (2.0 - sqrt(2.0)) / 2.0 / sqrt(2.0), 1e-14);
    CHECK_NEAR3(r.bounding_box[0], ((double[3]){0, 0, 0}), 0.0);
    CHECK_NEAR3(r.bounding_box[1], ((double[3]){1, 1, 1}), 0.0);
}

TEST(tetrahedron_torus_annulus_and_genus_two)
{
    loxo_mesh_report r = report_of(shape_tetrahedron(test_context));
    CHECK_EQUAL(r.euler, 2);
    CHECK_NEAR(r.volume, 1.0 / 6.0, 1e-15);
    r = report_of(shape_torus(test_context, 9, 7));
    CHECK_EQUAL(r.euler, 0);
    CHECK_EQUAL(r.genus, 1);
    CHECK_EQUAL(n_faults(&r), 0);
    r = report_of(shape_annulus(test_context, 9, 3));
    CHECK_EQUAL(r.euler, 0);
    CHECK_EQUAL(r.genus, 0);
    CHECK_EQUAL(r.n_boundary_loops, 2);
    CHECK_EQUAL(r.n_boundary_edges, 18);
    CHECK(!r.is_closed && r.is_manifold);
    CHECK_EQUAL(r.volume, 0.0);
    r = report_of(shape_genus(test_context, 2, 1000));
    CHECK_EQUAL(r.euler, -2);
    CHECK_EQUAL(r.genus, 2);
    CHECK(r.is_closed && r.is_manifold && r.is_oriented);
}

TEST(several_components_add_up)
{
    loxo_soup soup = shape_torus(test_context, 5, 5), more = shape_cube(test_context),
              rest = shape_annulus(test_context, 6, 1);
    shape_append(test_context, &soup, &more);
    shape_append(test_context, &soup, &rest);
    const loxo_mesh_report r = report_of(soup);
    CHECK_EQUAL(r.n_components, 3);
    CHECK_EQUAL(r.genus, 1);
    CHECK_EQUAL(r.euler, 2);
    CHECK_EQUAL(r.n_boundary_loops, 2);
}

TEST(moebius_strip_is_manifold_but_not_orientable)
{
    const loxo_mesh_report r = report_of(shape_moebius(test_context, 12));
    CHECK(r.is_manifold && !r.is_orientable && !r.is_oriented);
    CHECK_EQUAL(r.n_boundary_loops, 1);
    CHECK_EQUAL(r.euler, 0);
    CHECK_EQUAL(r.genus, -1);
    CHECK_EQUAL(r.inconsistent_faces.count, 0);
}

TEST(bow_tie_and_book_are_not_manifold)
{
    loxo_mesh_report r = report_of(shape_bow_tie(test_context));
    CHECK(!r.is_manifold);
    CHECK_EQUAL(r.nonmanifold_vertices.count, 1);
    CHECK_EQUAL(r.nonmanifold_vertices.first[0], 0);
    CHECK_EQUAL(r.nonmanifold_edges.count, 0);
    CHECK_EQUAL(r.n_components, 1);
    CHECK_EQUAL(r.n_boundary_loops, -1);
    CHECK_EQUAL(r.genus, -1);
    r = report_of(shape_book(test_context, 3));
    CHECK_EQUAL(r.nonmanifold_edges.count, 1);
    CHECK_EQUAL(r.nonmanifold_edges.n_first, 1);
    CHECK_EQUAL(r.nonmanifold_edges.first[0], 0);
    CHECK_EQUAL(r.nonmanifold_vertices.count, 2);
    CHECK_EQUAL(r.n_edges, 7);
}

TEST(a_closed_fan_beside_an_open_one_is_a_bow_tie)
{
    /* a tetrahedron and a triangle at its vertex 0 */
    loxo_soup soup = shape_tetrahedron(test_context), flag = shape_bow_tie(test_context);
    shape_append(test_context, &soup, &flag); /* faces 4, 5; vertices 4..8 */
    soup.triangle[12] = 0;
    soup.triangle[15] = 0;
    loxo_mesh_report r = report_of(soup);
    CHECK_EQUAL(r.nonmanifold_vertices.count, 1);
    CHECK_EQUAL(r.nonmanifold_vertices.first[0], 0);
    CHECK_EQUAL(r.unreferenced_vertices.count, 1);
    CHECK_EQUAL(r.unreferenced_vertices.first[0], 4);
}

TEST(faults_are_counted_with_their_first_offenders)
{
    loxo_soup soup = shape_torus(test_context, 8, 8), more = shape_empty(test_context, 4, 5);
    memset(more.position, 0, 12 * sizeof(double));
    more.position[3] = more.position[6] = more.position[9] = 50.0; /* 65, 66, 67 the same, 64 alone at 0 */
    more.position[10] = -0.0;
    memset(more.triangle, 0, 15 * sizeof(loxo_index));
    shape_append(test_context, &soup, &more);
    soup.position[(int64_t)3 * 64] = (double)NAN; /* nobody uses 64 in a sound face */
    loxo_index *t = soup.triangle + (int64_t)3 * 128;
    const loxo_index faces[15] = {64,
                                  64,
                                  64,
                                  3,
                                  3,
                                  5, /* degenerate */
                                  soup.triangle[30],
                                  soup.triangle[31],
                                  soup.triangle[32], /* duplicate of 10 */
                                  soup.triangle[62],
                                  soup.triangle[61],
                                  soup.triangle[60], /* of 20, turned */
                                  65,
                                  66,
                                  67}; /* without area */
    memcpy(t, faces, sizeof faces);
    const loxo_mesh_report r = report_of(soup);
    CHECK_EQUAL(r.degenerate_faces.count, 2);
    CHECK_EQUAL(r.degenerate_faces.first[0], 128);
    CHECK_EQUAL(r.degenerate_faces.first[1], 129);
    CHECK_EQUAL(r.duplicate_faces.count, 2);
    CHECK_EQUAL(r.duplicate_faces.first[0], 130);
    CHECK_EQUAL(r.duplicate_faces.first[1], 131);
    CHECK_EQUAL(r.zero_area_faces.count, 1);
    CHECK_EQUAL(r.zero_area_faces.first[0], 132);
    CHECK_EQUAL(r.duplicate_vertices.count, 2);
    CHECK_EQUAL(r.duplicate_vertices.first[0], 66);
    CHECK_EQUAL(r.duplicate_vertices.first[1], 67);
    CHECK_EQUAL(r.nonfinite_vertices.count, 1);
    CHECK_EQUAL(r.nonfinite_vertices.first[0], 64);
    CHECK_EQUAL(r.unreferenced_vertices.count, 1);
    CHECK_EQUAL(r.nonmanifold_edges.count, 6);
    CHECK_EQUAL(r.nonmanifold_edges.n_first, 6);
    CHECK(r.nonmanifold_edges.first[0] <= 10);
    CHECK(isfinite(r.area) && isfinite(r.edge_length.mean) && isfinite(r.angle_rad.max));
}

TEST(more_offenders_than_fit_are_counted)
{
    loxo_soup soup = shape_empty(test_context, 100, 0);
    memset(soup.position, 0, 300 * sizeof(double));
    const loxo_mesh_report r = report_of(soup);
    CHECK_EQUAL(r.unreferenced_vertices.count, 100);
    CHECK_EQUAL(r.duplicate_vertices.count, 99);
    CHECK_EQUAL(r.duplicate_vertices.n_first, LOXO_N_OFFENDERS);
    CHECK_EQUAL(r.duplicate_vertices.first[7], 8);
    CHECK(!r.is_closed);
    CHECK_EQUAL(r.n_components, 0);
    CHECK_EQUAL(r.euler, 0);
}

TEST(turned_faces_are_inconsistent)
{
    loxo_soup soup = shape_cube(test_context);
    const loxo_index b = soup.triangle[3 * 5 + 1];
    soup.triangle[3 * 5 + 1] = soup.triangle[3 * 5 + 2];
    soup.triangle[3 * 5 + 2] = b;
    const loxo_mesh_report r = report_of(soup);
    CHECK(!r.is_oriented && r.is_orientable && r.is_manifold && r.is_closed);
    CHECK_EQUAL(r.inconsistent_faces.count, 1);
    CHECK_EQUAL(r.inconsistent_faces.first[0], 5);
    CHECK_EQUAL(r.genus, 0);
    CHECK_EQUAL(r.volume, 0.0);
}

TEST(nothing_is_legal)
{
    const loxo_mesh_report r = report_of((loxo_soup){0});
    CHECK_EQUAL(r.n_faces, 0);
    CHECK_EQUAL(r.n_boundary_loops, 0);
    CHECK_EQUAL(r.area, 0.0);
}

TEST(bad_arguments_and_numbers_out_of_range_are_named)
{
    loxo_soup soup = shape_cube(test_context);
    loxo_mesh_report report = {.n_faces = 77};
    loxo_mesh_arrays a = loxo_soup_arrays(&soup);
    CHECK_STATUS(test_context, loxo_mesh_check(test_context, NULL, &report), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_mesh_check(test_context, &a, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_mesh_check(NULL, &a, &report), LOXO_ERR_ARGUMENT);
    a.n_faces = -1;
    CHECK_STATUS(test_context, loxo_mesh_check(test_context, &a, &report), LOXO_ERR_ARGUMENT);
    a.n_faces = INT64_MAX / 2;
    CHECK_STATUS(test_context, loxo_mesh_check(test_context, &a, &report), LOXO_ERR_LIMIT);
    a = loxo_soup_arrays(&soup);
    a.position = NULL;
    CHECK_STATUS(test_context, loxo_mesh_check(test_context, &a, &report), LOXO_ERR_ARGUMENT);
    a = loxo_soup_arrays(&soup);
    a.triangle = NULL;
    CHECK_STATUS(test_context, loxo_mesh_check(test_context, &a, &report), LOXO_ERR_ARGUMENT);
    a = loxo_soup_arrays(&soup);
    a.position = (const double *)(const void *)((const char *)a.position + 1);
    CHECK_STATUS(test_context, loxo_mesh_check(test_context, &a, &report), LOXO_ERR_ARGUMENT);
    a = loxo_soup_arrays(&soup);
    soup.triangle[3 * 7 + 2] = 8;
    soup.triangle[(int64_t)3 * 9] = -1;
    CHECK_STATUS(test_context, loxo_mesh_check(test_context, &a, &report), LOXO_ERR_MALFORMED);
    CHECK_TEXT(loxo_context_failure(test_context)->text, "face 7: vertex index 8 not in 0..7");
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 7);
    CHECK_EQUAL(report.n_faces, 77); /* untouched */
    loxo_soup_destroy(test_context, &soup);
}

/* The median is the nearest rank of the sorted lengths, to the accuracy the header promises. */
TEST(percentiles_agree_with_sorting)
{
    enum { N = 300 };
    loxo_soup soup = shape_empty(test_context, (int64_t)3 * N, N); /* N triangles of random size, apart */
    double *length = malloc((int64_t)(size_t)3 * N * sizeof *length);
    for (int64_t i = 0; i < (int64_t)9 * N; ++i)
        soup.position[i] = exp(8.0 * loxo_random_unit(3, (uint64_t)i));
    for (int i = 0; i < 3 * N; ++i)
        soup.triangle[i] = (loxo_index)i;
    for (int i = 0; i < 3 * N; ++i) {
        const double *p = &soup.position[(int64_t)3 * i], *q = &soup.position[(int64_t)3 * (i / 3 * 3 + (i + 1) % 3)];
        length[i] = sqrt((p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]) + (p[2] - q[2]) * (p[2] - q[2]));
    }
    for (int i = 1; i < 3 * N; ++i) {
        const double x = length[i];
        int j = i;
        for (; j > 0 && length[j - 1] > x; --j)
            length[j] = length[j - 1];
        length[j] = x;
    }
    const loxo_mesh_report r = report_of(soup);
    CHECK_NEAR(r.edge_length.min, length[0], 0.0);
    CHECK_NEAR(r.edge_length.max, length[3 * N - 1], 0.0);
    CHECK_NEAR(r.edge_length.median, length[449], 1e-6 * length[449]);
    CHECK_NEAR(r.edge_length.percentile_1, length[8], 1e-6 * length[8]);
    CHECK_NEAR(r.edge_length.percentile_99, length[890], 1e-6 * length[890]);
    CHECK_EQUAL(r.n_components, N);
    free(length);
}

TEST(shares_of_obtuse_faces_and_bad_edges)
{
    /* a flat rhombus cut along its long diagonal: both opposite angles are obtuse */
    static const double p[4][3] = {{-3, 0, 0}, {0, -1, 0}, {3, 0, 0}, {0, 1, 0}};
    static const int t[2][3] = {{0, 1, 2}, {0, 2, 3}};
    const loxo_mesh_report r = report_of(shape_of(test_context, 4, p, 2, t));
    CHECK_EQUAL(r.share_obtuse, 1.0);
    CHECK_EQUAL(r.share_nondelaunay, 1.0);
    CHECK_NEAR(r.share_negative_cotangent, 0.2, 0.0);
}

TEST(numbers_are_the_same_in_other_units_and_places)
{
    loxo_soup soup = shape_genus(test_context, 2, 800);
    const loxo_mesh_report a = check(test_context, &soup);
    for (int64_t i = 0; i < 3 * soup.n_vertices; ++i)
        soup.position[i] *= 0x1p100;
    const loxo_mesh_report b = report_of(soup);
    CHECK_EQUAL(a.angle_rad.median, b.angle_rad.median);
    CHECK_EQUAL(a.edge_length.median * 0x1p100, b.edge_length.median);
    CHECK_EQUAL(a.quality, b.quality);
    CHECK_EQUAL(a.zero_area_faces.count, b.zero_area_faces.count);
}

TEST(renumbering_changes_no_count)
{
    loxo_soup soup = shape_genus(test_context, 3, 1500);
    const loxo_mesh_report a = check(test_context, &soup);
    CHECK_OK(loxo_soup_shuffle(test_context, &soup, 11, NULL));
    const loxo_mesh_report b = report_of(soup);
    CHECK_EQUAL(a.n_edges, b.n_edges);
    CHECK_EQUAL(a.genus, b.genus);
    CHECK_EQUAL(b.genus, 3);
    CHECK_EQUAL(a.edge_length.median, b.edge_length.median);
    CHECK_EQUAL(a.angle_rad.percentile_1, b.angle_rad.percentile_1);
    CHECK_NEAR(a.area, b.area, 1e-12 * a.area);
    CHECK_NEAR(a.volume, b.volume, 1e-12 * a.volume);
}

TEST(every_number_of_threads_gives_the_same_bits)
{
    uint64_t hash = 0;
    const int n_threads[4] = {1, 2, 3, 7};
    for (int i = 0; i < 4; ++i) {
        loxo_context *ctx = test_context_with_threads(n_threads[i]);
        loxo_soup soup = shape_torus(ctx, 90, 50);
        CHECK_STATUS(ctx, loxo_soup_shuffle(ctx, &soup, 5, NULL), LOXO_OK);
        for (int64_t k = 0; k < soup.n_faces; k += 7) /* turn some, repeat some corners */
            soup.triangle[3 * k + 1] = soup.triangle[3 * k + 2 - (k % 2)];
        loxo_mesh_report r;
        memset(&r, 0, sizeof r);
        r = check(ctx, &soup);
        const uint64_t mine =
            test_hash(&r.area, offsetof(loxo_mesh_report, quality) - offsetof(loxo_mesh_report, area)) ^
            test_hash(&r, offsetof(loxo_mesh_report, is_manifold)) ^
            test_hash(r.nonmanifold_vertices.first, sizeof r.nonmanifold_vertices.first);
        if (i == 0) hash = mine;
        CHECK_EQUAL(mine, hash);
        loxo_soup_destroy(ctx, &soup);
        loxo_context_destroy(ctx);
    }
}

static loxo_status check_shape(loxo_context *ctx, void *arg)
{
    loxo_mesh_report report;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(arg);
    return loxo_mesh_check(ctx, &arrays, &report);
}

TEST(every_allocation_may_fail)
{
    loxo_soup soup = shape_genus(test_context, 1, 600);
    const loxo_index b = soup.triangle[1];
    soup.triangle[1] = soup.triangle[2];
    soup.triangle[2] = b;
    CHECK(test_each_allocation_fails(check_shape, &soup) >= 8);
    loxo_soup_destroy(test_context, &soup);
}

TEST(float_positions_are_read)
{
    loxo_soup soup = shape_cube(test_context);
    soup.position_float = loxo_allocate(test_context, 8, 3 * sizeof(float));
    for (int i = 0; i < 24; ++i)
        soup.position_float[i] = (float)soup.position[i];
    loxo_release(test_context, soup.position);
    soup.position = NULL;
    const loxo_mesh_report r = report_of(soup);
    CHECK_NEAR(r.volume, 1.0, 1e-14);
    CHECK_EQUAL(r.duplicate_vertices.count, 0);
}
