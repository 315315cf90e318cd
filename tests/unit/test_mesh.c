/* SPDX-License-Identifier: MIT
 * loxo_mesh_create: the half-edge structure, orders and the way back, what is mended and what is refused. */
#include "../shapes.h"
#include "base/context.h"
#include "mesh/halfedge.h"
#include "mesh/mesh_internal.h"

static loxo_mesh_settings order_of(loxo_order order)
{
    loxo_mesh_settings settings = loxo_mesh_settings_default();
    settings.order = order;
    return settings;
}

/* What the header promises of a view, whatever the mesh. */
static void check_view(const loxo_mesh *mesh)
{
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    int64_t n_met = 0;
    CHECK((m.position == NULL) != (m.position_float == NULL) || m.n_vertices == 0);
    for (int64_t h = 0; h < 3 * m.n_faces; ++h) {
        const loxo_index t = m.halfedge_twin[h], next = loxo_halfedge_next((loxo_index)h);
        CHECK(m.halfedge_vertex[h] >= 0 && m.halfedge_vertex[h] < m.n_vertices);
        CHECK(m.halfedge_vertex[h] != m.halfedge_vertex[next]);
        CHECK(t >= -1 && t < 3 * m.n_faces);
        if (t < 0) {
            CHECK_EQUAL(m.vertex_halfedge[m.halfedge_vertex[h]], h);
            continue;
        }
        CHECK_EQUAL(m.halfedge_twin[t], h);
        CHECK_EQUAL(m.halfedge_vertex[t], m.halfedge_vertex[next]);
        CHECK_EQUAL(m.halfedge_vertex[h], m.halfedge_vertex[loxo_halfedge_next(t)]);
    }
    for (int64_t v = 0; v < m.n_vertices; ++v) {
        loxo_index h = m.vertex_halfedge[v];
        if (h < 0) continue;
        do {
            CHECK_EQUAL(m.halfedge_vertex[h], v);
            n_met += 1;
            h = m.halfedge_twin[loxo_halfedge_previous(h)];
        } while (h >= 0 && h != m.vertex_halfedge[v]);
    }
    CHECK_EQUAL(n_met, 3 * m.n_faces);
    CHECK(m.n_parts >= 1);
    CHECK_EQUAL(m.part_vertex[0], 0);
    CHECK_EQUAL(m.part_face[0], 0);
    CHECK_EQUAL(m.part_vertex[m.n_parts], m.n_vertices);
    CHECK_EQUAL(m.part_face[m.n_parts], m.n_faces);
    for (int64_t p = 0; p < m.n_parts && m.n_parts > 1; ++p) {
        for (int64_t f = m.part_face[p]; f < m.part_face[p + 1]; ++f) {
            const loxo_index *v = &m.halfedge_vertex[3 * f];
            const loxo_index low = v[0] < v[1] ? (v[0] < v[2] ? v[0] : v[2]) : (v[1] < v[2] ? v[1] : v[2]);
            CHECK(low >= m.part_vertex[p] && low < m.part_vertex[p + 1]);
        }
    }
}

/* Positions and faces are those of the soup, up to the order. */
static void check_same_surface(const loxo_mesh *mesh, const loxo_soup *soup)
{
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    uint64_t sum_mesh = 0, sum_soup = 0;
    CHECK_EQUAL(m.n_faces, soup->n_faces);
    for (int64_t v = 0; v < m.n_vertices; ++v) {
        const int64_t from = m.vertex_origin == NULL ? v : m.vertex_origin[v];
        CHECK_NEAR3(m.position[v], &soup->position[3 * from], 0.0);
    }
    for (int64_t f = 0; f < m.n_faces; ++f) { /* a sum over faces of hashes, the same for every rotation of corners */
        for (int c = 0; c < 3; ++c) {
            const loxo_index a = m.halfedge_vertex[3 * f + c], b = m.halfedge_vertex[3 * f + (c + 1) % 3];
            const int64_t pair[2] = {m.vertex_origin == NULL ? a : m.vertex_origin[a],
                                     m.vertex_origin == NULL ? b : m.vertex_origin[b]};
            const int64_t other[2] = {soup->triangle[3 * f + c], soup->triangle[3 * f + (c + 1) % 3]};
            sum_mesh += test_hash(pair, sizeof pair);
            sum_soup += test_hash(other, sizeof other);
        }
    }
    CHECK_EQUAL(sum_mesh, sum_soup);
}

static loxo_mesh *create(const loxo_soup *soup, const loxo_mesh_settings *settings, loxo_mesh_info *info)
{
    loxo_mesh *mesh;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    CHECK_OK(loxo_mesh_create(test_context, &arrays, LOXO_COPY, settings, info, &mesh));
    return mesh;
}

static loxo_status create_fails(const loxo_soup *soup, const loxo_mesh_settings *settings)
{
    loxo_mesh *mesh;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    const loxo_status status = loxo_mesh_create(test_context, &arrays, LOXO_COPY, settings, NULL, &mesh);
    CHECK(mesh == NULL);
    return status;
}

static const char *failure(void) { return loxo_context_failure(test_context)->text; }

TEST(every_order_gives_the_same_surface)
{
    loxo_soup soup = shape_torus(test_context, 24, 17);
    CHECK_OK(loxo_soup_shuffle(test_context, &soup, 2, NULL));
    for (loxo_order order = LOXO_ORDER_AUTO; order <= LOXO_ORDER_METIS_ND; ++order) {
        loxo_mesh_settings settings = order_of(order);
        const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
        loxo_mesh_info info;
        loxo_mesh *mesh;
        settings.part_bytes = 4096;
        const loxo_status status = loxo_mesh_create(test_context, &arrays, LOXO_COPY, &settings, &info, &mesh);
        if (status == LOXO_ERR_UNSUPPORTED && order >= LOXO_ORDER_METIS) continue; /* METIS is off */
        CHECK_EQUAL(status, LOXO_OK);
        CHECK(order == LOXO_ORDER_AUTO || info.order == order);
        check_view(mesh);
        check_same_surface(mesh, &soup);
        CHECK_EQUAL(info.euler, 0);
        CHECK_EQUAL(info.genus, 1);
        CHECK_EQUAL(info.n_components, 1);
        CHECK_EQUAL(info.n_boundary_loops, 0);
        CHECK_EQUAL(loxo_mesh_n_vertices(mesh), 24 * 17);

        loxo_index to_mesh[24 * 17];
        double own[24 * 17], caller[24 * 17];
        CHECK_OK(loxo_mesh_vertex_order(mesh, to_mesh));
        for (int v = 0; v < 24 * 17; ++v)
            own[to_mesh[v]] = v;
        loxo_mesh_scatter_to_caller(mesh, own, caller);
        for (int v = 0; v < 24 * 17; ++v) {
            CHECK_EQUAL(caller[v], v);
            CHECK_EQUAL(loxo_mesh_index_from_caller(mesh, v), to_mesh[v]);
        }
        loxo_index ids[12];
        for (int i = 0; i < 12; ++i)
            ids[i] = (loxo_index)(i == 11 ? 24 * 17 : 7 * i);
        CHECK_OK(loxo_mesh_indices_from_caller(mesh, 12, ids, ids));
        for (int64_t i = 0; i < 11; ++i)
            CHECK_EQUAL(ids[i], to_mesh[7 * i]);
        CHECK_EQUAL(ids[11], -1);
        loxo_mesh_destroy(mesh);
    }
    loxo_soup_destroy(test_context, &soup);
}

TEST(ownership)
{
    loxo_soup soup = shape_annulus(test_context, 12, 4);
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    const loxo_mesh_settings given = order_of(LOXO_ORDER_GIVEN);
    loxo_mesh *mesh;
    CHECK_OK(loxo_mesh_create(test_context, &arrays, LOXO_BORROW, &given, NULL, &mesh));
    CHECK(loxo_mesh_get_view(mesh).halfedge_vertex == soup.triangle);
    CHECK((const void *)loxo_mesh_get_view(mesh).position == (const void *)soup.position);
    check_view(mesh);
    loxo_mesh_destroy(mesh);
    CHECK_OK(loxo_mesh_create(test_context, &arrays, LOXO_COPY, &given, NULL, &mesh));
    CHECK(loxo_mesh_get_view(mesh).halfedge_vertex != soup.triangle);
    check_same_surface(mesh, &soup);
    loxo_mesh_destroy(mesh);
    /* borrowed arrays are never written, also where faces must turn */
    const loxo_index b = soup.triangle[1];
    soup.triangle[1] = soup.triangle[2];
    soup.triangle[2] = b;
    const uint64_t hash = test_hash(soup.triangle, (size_t)soup.n_faces * 3 * sizeof(loxo_index));
    CHECK_OK(loxo_mesh_create(test_context, &arrays, LOXO_BORROW, &given, NULL, &mesh));
    check_view(mesh);
    loxo_mesh_destroy(mesh);
    CHECK_EQUAL(test_hash(soup.triangle, (size_t)soup.n_faces * 3 * sizeof(loxo_index)), hash);
    CHECK_OK(loxo_mesh_create(test_context, &arrays, LOXO_ADOPT, NULL, NULL, &mesh)); /* soup's arrays are gone now */
    check_view(mesh);
    loxo_mesh_destroy(mesh);
}

TEST(adopted_arrays_are_freed_when_it_fails)
{
    for (int i = 0; i < 4; ++i) {
        loxo_soup soup = i == 0 ? shape_book(test_context, 3) : shape_moebius(test_context, 10);
        loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
        loxo_mesh_settings settings = loxo_mesh_settings_default();
        loxo_mesh *mesh;
        if (i == 2) soup.triangle[4] = -7;
        if (i == 3) settings.order = (loxo_order)99;
        CHECK(loxo_mesh_create(test_context, &arrays, LOXO_ADOPT, &settings, NULL, &mesh) < 0);
        CHECK(mesh == NULL);
        CHECK_EQUAL(loxo_context_memory(test_context).current_bytes, 0);
    }
}

TEST(float_positions_stay_float)
{
    loxo_generate_settings shape = loxo_generate_settings_default();
    loxo_soup soup;
    shape.n_vertices = 642;
    CHECK_OK(loxo_generate(test_context, &shape, true, &soup));
    const loxo_mesh_settings hilbert = order_of(LOXO_ORDER_HILBERT);
    loxo_mesh *mesh = create(&soup, &hilbert, NULL);
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    CHECK(m.position == NULL && m.position_float != NULL);
    for (int64_t v = 0; v < m.n_vertices; ++v)
        for (int k = 0; k < 3; ++k)
            CHECK_EQUAL(m.position_float[v][k], soup.position_float[3 * (int64_t)m.vertex_origin[v] + k]);
    check_view(mesh);
    loxo_mesh_destroy(mesh);
    loxo_soup_destroy(test_context, &soup);
}

TEST(harmless_faults_are_mended_with_a_counted_warning)
{
    loxo_soup soup = shape_torus(test_context, 8, 8);
    loxo_mesh_info info;
    soup.triangle[(int64_t)3 * 17] = soup.triangle[(int64_t)3 * 17 + 1];
    const loxo_index b = soup.triangle[(int64_t)3 * 40];
    soup.triangle[(int64_t)3 * 40] = soup.triangle[(int64_t)3 * 40 + 1];
    soup.triangle[3 * 40 + 1] = b;
    const loxo_mesh_settings orders[2] = {order_of(LOXO_ORDER_GIVEN), order_of(LOXO_ORDER_HILBERT)};
    for (int i = 0; i < 2; ++i) {
        loxo_context_clear(test_context);
        loxo_mesh *mesh = create(&soup, &orders[i], &info);
        CHECK_EQUAL(info.repair.n_degenerate_dropped, 1);
        CHECK_EQUAL(info.repair.n_faces_turned, 1);
        CHECK_EQUAL(loxo_context_n_warnings(test_context), 2);
        CHECK_TEXT(loxo_context_warning(test_context, 0)->text, "1 degenerate face dropped (first: face 17)");
        CHECK_TEXT(loxo_context_warning(test_context, 1)->text,
                   "1 face turned to agree with the neighbours (first: face 40)");
        CHECK_EQUAL(loxo_mesh_n_faces(mesh), 127);
        CHECK_EQUAL(info.n_boundary_loops, 1);
        check_view(mesh);
        loxo_mesh_destroy(mesh);
    }
    loxo_soup_destroy(test_context, &soup);
}

TEST(components_and_unreferenced_vertices_are_legal)
{
    loxo_soup soup = shape_cube(test_context), more = shape_annulus(test_context, 7, 2),
              spare = shape_empty(test_context, 3, 0);
    loxo_mesh_info info;
    for (int i = 0; i < 9; ++i)
        spare.position[i] = i == 4 ? (double)NAN : 3.0;
    shape_append(test_context, &soup, &spare);
    shape_append(test_context, &soup, &more);
    loxo_mesh *mesh = create(&soup, NULL, &info);
    CHECK_EQUAL(info.n_components, 2);
    CHECK_EQUAL(info.n_unreferenced, 3);
    CHECK_EQUAL(info.n_boundary_loops, 2);
    CHECK_EQUAL(info.euler, 2);
    CHECK_EQUAL(info.genus, 0);
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 3);
    CHECK_TEXT(loxo_context_warning(test_context, 1)->text, "3 vertices belong to no face (first: vertex 8)");
    check_view(mesh);
    loxo_mesh_destroy(mesh);
    loxo_soup_destroy(test_context, &soup);
}

TEST(empty_and_tiny)
{
    loxo_mesh_info info;
    loxo_soup nothing = {0}, points = shape_empty(test_context, 2, 0), one = shape_book(test_context, 1);
    memset(points.position, 0, 6 * sizeof(double));
    loxo_mesh *mesh = create(&nothing, NULL, &info);
    check_view(mesh);
    CHECK_EQUAL(info.n_components, 0);
    loxo_mesh_destroy(mesh);
    mesh = create(&points, NULL, &info);
    check_view(mesh);
    CHECK_EQUAL(info.n_unreferenced, 2);
    loxo_mesh_destroy(mesh);
    mesh = create(&one, NULL, &info);
    check_view(mesh);
    CHECK_EQUAL(info.euler, 1);
    CHECK_EQUAL(info.n_boundary_loops, 1);
    loxo_mesh_destroy(mesh);
    loxo_mesh_destroy(NULL);
    loxo_soup_destroy(test_context, &points);
    loxo_soup_destroy(test_context, &one);
}

TEST(non_manifold_and_not_orientable_are_refused_by_name)
{
    loxo_soup soup = shape_book(test_context, 3);
    const loxo_mesh_settings hilbert = order_of(LOXO_ORDER_HILBERT);
    for (int i = 0; i < 2; ++i) {
        CHECK_EQUAL(create_fails(&soup, i == 0 ? NULL : &hilbert), LOXO_ERR_MESH);
        CHECK(strstr(failure(), "non-manifold edge: 3 faces meet at the edge between vertices") != NULL);
        CHECK(strstr(failure(), "--repair") != NULL);
        CHECK(loxo_context_failure(test_context)->element >= 0);
    }
    loxo_soup_destroy(test_context, &soup);

    soup = shape_bow_tie(test_context);
    CHECK_EQUAL(create_fails(&soup, NULL), LOXO_ERR_MESH);
    CHECK_TEXT(failure(), "non-manifold vertex: more than one fan of faces meets at vertex 0; 1 such vertices; "
                          "--repair splits them");
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 0);
    loxo_soup_destroy(test_context, &soup);

    soup = shape_moebius(test_context, 20);
    CHECK_EQUAL(create_fails(&soup, NULL), LOXO_ERR_MESH);
    CHECK(strstr(failure(), "not orientable") != NULL);
    loxo_soup_destroy(test_context, &soup);
}

TEST(malformed_arrays_are_refused_by_name)
{
    loxo_soup soup = shape_cube(test_context);
    soup.position[3 * 6 + 1] = (double)INFINITY;
    CHECK_EQUAL(create_fails(&soup, NULL), LOXO_ERR_MALFORMED);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 6);
    soup.position[3 * 6 + 1] = (double)NAN;
    CHECK_EQUAL(create_fails(&soup, NULL), LOXO_ERR_MALFORMED);
    soup.position[3 * 6 + 1] = 1.0;
    soup.triangle[3 * 2 + 1] = 8;
    CHECK_EQUAL(create_fails(&soup, NULL), LOXO_ERR_MALFORMED);
    CHECK_TEXT(failure(), "face 2: vertex index 8 not in 0..7");
    soup.triangle[3 * 2 + 1] = -LOXO_INDEX_MAX - 1;
    CHECK_EQUAL(create_fails(&soup, NULL), LOXO_ERR_MALFORMED);
    loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    loxo_mesh *mesh = NULL;
    arrays.n_vertices = (int64_t)LOXO_INDEX_MAX + 1;
    CHECK_STATUS(test_context, loxo_mesh_create(test_context, &arrays, LOXO_COPY, NULL, NULL, &mesh), LOXO_ERR_LIMIT);
    arrays = loxo_soup_arrays(&soup);
    arrays.n_faces = LOXO_INDEX_MAX / 3 + 1;
    CHECK_STATUS(test_context, loxo_mesh_create(test_context, &arrays, LOXO_COPY, NULL, NULL, &mesh), LOXO_ERR_LIMIT);
    arrays.n_faces = -1;
    CHECK_STATUS(test_context, loxo_mesh_create(test_context, &arrays, LOXO_COPY, NULL, NULL, &mesh),
                 LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_mesh_create(test_context, NULL, LOXO_COPY, NULL, NULL, &mesh), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_mesh_create(NULL, &arrays, LOXO_COPY, NULL, NULL, &mesh), LOXO_ERR_ARGUMENT);
    arrays = loxo_soup_arrays(&soup);
    CHECK_STATUS(test_context, loxo_mesh_create(test_context, &arrays, LOXO_COPY, NULL, NULL, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_mesh_create(test_context, &arrays, (loxo_ownership)9, NULL, NULL, &mesh),
                 LOXO_ERR_ARGUMENT);
    loxo_soup_destroy(test_context, &soup);
}

TEST(repaired_meshes_answer_for_the_callers_vertices)
{
    /* a torn cube corner (8 = 0), a bow tie at the cube's vertex 2, and a fin */
    loxo_soup soup = shape_cube(test_context), tie = shape_bow_tie(test_context);
    loxo_mesh_settings settings = order_of(LOXO_ORDER_HILBERT);
    loxo_mesh_info info;
    loxo_mesh *mesh;
    for (int i = 0; i < 15; ++i)
        tie.position[i] += 5.0;
    shape_append(test_context, &soup, &tie);
    memcpy(&soup.position[(int64_t)3 * 8], &soup.position[0],
           (int64_t)3 * sizeof(double)); /* vertex 8 lies at vertex 0 */
    soup.triangle[(int64_t)3 * 12] = 2;
    soup.triangle[(int64_t)3 * 13] = 8;
    CHECK_EQUAL(create_fails(&soup, &settings), LOXO_ERR_MESH);
    settings.repair = true;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    CHECK_STATUS(test_context, loxo_mesh_create(test_context, &arrays, LOXO_COPY, &settings, &info, &mesh),
                 LOXO_REPAIRED);
    CHECK_EQUAL(info.repair.n_vertices_welded, 1);
    CHECK_EQUAL(info.repair.n_vertices_split, 2); /* 2 and 0 */
    CHECK_EQUAL(info.n_components, 3);
    CHECK_EQUAL(loxo_mesh_n_vertices(mesh), 13);
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    CHECK_EQUAL(m.n_vertices, 14);
    check_view(mesh);
    double own[14], caller[13];
    loxo_index to_mesh[13];
    CHECK_OK(loxo_mesh_vertex_order(mesh, to_mesh));
    CHECK_EQUAL(to_mesh[8], to_mesh[0]);
    for (int i = 0; i < 14; ++i) { /* the position's own number, copies 0.5 lower */
        CHECK_NEAR3(m.position[i], &soup.position[(int64_t)3 * m.vertex_origin[i]], 0.0);
        own[i] = m.vertex_origin[i] - (to_mesh[m.vertex_origin[i]] == i ? 0.0 : 0.5);
    }
    loxo_mesh_scatter_to_caller(mesh, own, caller);
    for (int v = 0; v < 13; ++v) {
        CHECK_EQUAL(caller[v], v == 8 || v == 0 ? -0.5 : v == 2 ? 1.5 : v);
        CHECK_EQUAL(loxo_mesh_index_from_caller(mesh, v), to_mesh[v]);
    }
    loxo_mesh_destroy(mesh);
    loxo_soup_destroy(test_context, &soup);
}

TEST(bytes_are_as_promised)
{
    NEEDS_IDS(400000);
    loxo_soup soup = shape_torus(test_context, 300, 200);
    loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    const loxo_mesh_settings hilbert = order_of(LOXO_ORDER_HILBERT);
    loxo_mesh_info info;
    loxo_mesh *mesh;
    size_t mesh_bytes, peak_bytes;
    CHECK_OK(loxo_mesh_estimate(60000, 120000, false, &hilbert, &mesh_bytes, &peak_bytes));
    CHECK_OK(loxo_mesh_create(test_context, &arrays, LOXO_ADOPT, &hilbert, &info, &mesh));
    CHECK_EQUAL(info.mesh_bytes, 76 * 60000);
    CHECK_EQUAL(mesh_bytes, info.mesh_bytes + 4 * 60000); /* and the permutation */
    CHECK(info.order_bytes >= 4 * 60000);
    CHECK(info.peak_bytes <= 2 * info.mesh_bytes);
    CHECK(info.peak_bytes <= peak_bytes);
    CHECK(peak_bytes <= 2 * info.mesh_bytes);
    const size_t held_bytes = loxo_context_memory(test_context).current_bytes;
    CHECK(held_bytes >= info.mesh_bytes + info.order_bytes && held_bytes < info.mesh_bytes + info.order_bytes + 4096);
    loxo_mesh_destroy(mesh);
    CHECK_OK(loxo_mesh_estimate(1000000, 2000000, true, NULL, &mesh_bytes, &peak_bytes));
    CHECK_EQUAL(mesh_bytes, 68000000);
    CHECK(peak_bytes <= 2 * mesh_bytes);
    const loxo_mesh_settings given = order_of(LOXO_ORDER_GIVEN);
    CHECK_OK(loxo_mesh_estimate(1000000, 2000000, true, &given, &mesh_bytes, &peak_bytes));
    CHECK_EQUAL(mesh_bytes, 64000000);
    CHECK_EQUAL(loxo_mesh_estimate(-1, 0, true, NULL, &mesh_bytes, &peak_bytes), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(loxo_mesh_estimate(INT64_MAX, INT64_MAX, true, NULL, &mesh_bytes, &peak_bytes), LOXO_ERR_LIMIT);
}

TEST(what_does_not_fit_is_refused_before_any_work)
{
    loxo_context_settings settings = loxo_context_settings_default();
    loxo_context *ctx;
    loxo_mesh *mesh;
    settings.memory_limit_bytes = 200000;
    CHECK_STATUS(NULL, loxo_context_create(&settings, &ctx), LOXO_OK);
    loxo_soup soup = shape_torus(test_context, 50, 50);
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    CHECK_STATUS(ctx, loxo_mesh_create(ctx, &arrays, LOXO_COPY, NULL, NULL, &mesh), LOXO_ERR_MEMORY);
    CHECK(strstr(loxo_context_failure(ctx)->text, "the mesh needs") != NULL);
    CHECK_EQUAL(loxo_context_memory(ctx).peak_bytes, 0);
    loxo_soup_destroy(test_context, &soup);
    loxo_context_destroy(ctx);
}

static loxo_status create_copy(loxo_context *ctx, void *arg)
{
    loxo_mesh_settings settings = order_of(LOXO_ORDER_HILBERT);
    const loxo_soup *soup = arg;
    loxo_mesh *mesh = NULL;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    settings.repair = soup->n_fields == 1; /* the test's mark */
    const loxo_status status = loxo_mesh_create(ctx, &arrays, LOXO_COPY, &settings, NULL, &mesh);
    loxo_mesh_destroy(mesh);
    return status;
}

TEST(every_allocation_may_fail)
{
    loxo_soup soup = shape_torus(test_context, 16, 12);
    soup.triangle[30] = soup.triangle[31];
    const loxo_index b = soup.triangle[61];
    soup.triangle[61] = soup.triangle[62];
    soup.triangle[62] = b;
    CHECK(test_each_allocation_fails(create_copy, &soup) > 12);
    soup.n_fields = 1;
    CHECK(test_each_allocation_fails(create_copy, &soup) > 12);
    loxo_soup_destroy(test_context, &(loxo_soup){.position = soup.position, .triangle = soup.triangle});
    loxo_soup broken = shape_bow_tie(test_context), rest = shape_book(test_context, 4);
    shape_append(test_context, &broken, &rest);
    broken.n_fields = 1;
    CHECK(test_each_allocation_fails(create_copy, &broken) > 12);
    broken.n_fields = 0;
    loxo_soup_destroy(test_context, &broken);
}

/* Two tetrahedra, a vertex of no face between them, and two triangles that touch in one vertex, which a repair splits. */
TEST(pieces_are_numbered)
{
    loxo_soup soup = shape_tetrahedron(test_context), lone = shape_empty(test_context, 1, 0),
              second = shape_tetrahedron(test_context), tie = shape_bow_tie(test_context);
    static const loxo_index want[14] = {0, 0, 0, 0, -1, 1, 1, 1, 1, 2, 2, 2, 3, 3};
    shape_append(test_context, &soup, &lone);
    shape_append(test_context, &soup, &second);
    shape_append(test_context, &soup, &tie);
    for (int i = 0; i < 14; ++i) /* nothing is welded */
        soup.position[3 * i] += 0.01 * i;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    for (int order = LOXO_ORDER_GIVEN; order <= LOXO_ORDER_BFS; ++order) {
        loxo_mesh_settings settings = order_of((loxo_order)order);
        loxo_mesh *mesh = NULL;
        loxo_index component[14];
        int64_t n = 0;
        settings.repair = true;
        CHECK(loxo_mesh_create(test_context, &arrays, LOXO_COPY, &settings, NULL, &mesh) >= 0);
        CHECK_OK(loxo_mesh_components(mesh, component, &n));
        CHECK_EQUAL(n, 4);
        CHECK(memcmp(component, want, 9 * sizeof *want) == 0);
        /* the split vertex is of its first copy's piece: which of the two that is, depends on the order */
        CHECK(component[10] == component[11] && component[12] == component[13] && component[10] != component[12]);
        CHECK(component[9] == component[10] || component[9] == component[12]);
        CHECK_STATUS(test_context, loxo_mesh_components(mesh, NULL, NULL), LOXO_ERR_ARGUMENT);
        loxo_mesh_destroy(mesh);
    }
    loxo_soup_destroy(test_context, &soup);
}

static int stop_at_once(void *user, const loxo_progress *progress)
{
    (void)user;
    (void)progress;
    return 1;
}

TEST(the_monitor_can_stop_it)
{
    NEEDS_IDS(3600000); /* so large that it is asked: the monitor is called every 20 ms at most */
    loxo_soup soup = shape_torus(test_context, 1000, 600);
    const loxo_mesh_settings hilbert = order_of(LOXO_ORDER_HILBERT);
    loxo_context_set_monitor(test_context, stop_at_once, NULL);
    const loxo_status status = create_fails(&soup, &hilbert);
    CHECK_EQUAL(status, LOXO_ERR_STOPPED);
    loxo_soup_destroy(test_context, &soup);
}

TEST(every_number_of_threads_gives_the_same_bits)
{
    const int n_threads[4] = {1, 2, 3, 7};
    for (loxo_order order = LOXO_ORDER_GIVEN; order <= LOXO_ORDER_BFS; ++order) {
        uint64_t hash = 0;
        for (int i = 0; i < 4; ++i) {
            loxo_context *ctx = test_context_with_threads(n_threads[i]);
            loxo_soup soup = shape_band(ctx, 100, 45, order % 2 == 0, false);
            const loxo_mesh_settings settings = order_of(order);
            loxo_mesh *mesh;
            CHECK_STATUS(ctx, loxo_soup_shuffle(ctx, &soup, 5, NULL), LOXO_OK);
            const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
            CHECK_STATUS(ctx, loxo_mesh_create(ctx, &arrays, LOXO_ADOPT, &settings, NULL, &mesh), LOXO_OK);
            const loxo_mesh_view m = loxo_mesh_get_view(mesh);
            const uint64_t mine = test_hash(m.halfedge_vertex, (size_t)m.n_faces * 3 * sizeof(loxo_index)) ^
                                  test_hash(m.halfedge_twin, (size_t)m.n_faces * 3 * sizeof(loxo_index)) ^
                                  test_hash(m.vertex_halfedge, (size_t)m.n_vertices * sizeof(loxo_index)) ^
                                  test_hash(m.position, (size_t)m.n_vertices * 3 * sizeof(double)) ^
                                  test_hash(m.part_face, (size_t)m.n_parts * sizeof(int64_t));
            if (i == 0) hash = mine;
            CHECK_EQUAL(mine, hash);
            loxo_mesh_destroy(mesh);
            loxo_context_destroy(ctx);
        }
    }
}

TEST(ids_end_where_they_end)
{
    /* with 16-bit ids the largest double cone there is; one face more is refused above */
    const int64_t n = LOXO_INDEX_MAX / 6;
    loxo_soup soup = shape_hub(test_context, n < 6000 ? (int)n : 6000);
    loxo_mesh_info info;
    loxo_mesh *mesh = create(&soup, NULL, &info);
    check_view(mesh);
    CHECK_EQUAL(info.genus, 0);
    loxo_mesh_destroy(mesh);
    loxo_soup_destroy(test_context, &soup);
}
