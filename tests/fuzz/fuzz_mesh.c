/* SPDX-License-Identifier: MIT
 * Arrays as a library user might hand them over: check, repair, directed edges. What comes out must keep its promises,
 * whatever went in. */
#include "harness.h"
#include "mesh/intrinsic/overlay.h"

#include <math.h>

#define MAX_FACES 96

/* Three bytes steer, then three bytes a vertex, then three a face; most ids are brought into range. */
static loxo_soup make_soup(loxo_context *ctx, const uint8_t *bytes, size_t n)
{
    const int64_t n_vertices = 1 + bytes[1] % 48;
    const size_t n_positions = (size_t)(3 * n_vertices), n_rest = n - 3 > n_positions ? n - 3 - n_positions : 0;
    const int64_t n_faces = (int64_t)(n_rest / 3 < MAX_FACES ? n_rest / 3 : MAX_FACES);
    const bool is_float = (bytes[0] & 1) != 0;
    loxo_soup soup = {.n_vertices = n_vertices, .n_faces = n_faces, .n_fields = 1};
    soup.triangle = loxo_allocate(ctx, n_faces, 3 * sizeof *soup.triangle);
    soup.fields = loxo_allocate(ctx, 1, sizeof *soup.fields);
    FUZZ_CHECK(soup.triangle != NULL && soup.fields != NULL);
    soup.fields[0] = (loxo_field){.name = "number", .value = loxo_allocate(ctx, n_vertices, sizeof(double))};
    if (is_float)
        soup.position_float = loxo_allocate(ctx, n_vertices, 3 * sizeof *soup.position_float);
    else
        soup.position = loxo_allocate(ctx, n_vertices, 3 * sizeof *soup.position);
    for (int64_t v = 0; v < n_vertices; ++v)
        soup.fields[0].value[v] = (double)v;
    for (size_t i = 0; i < n_positions; ++i) {
        const uint8_t b = 3 + i < n ? bytes[3 + i] : (uint8_t)(i * 37u);
        const double x = b == 0x80 ? (double)(0.0f / 0.0f) : (double)b - 100.0;
        if (is_float)
            soup.position_float[i] = (float)x;
        else
            soup.position[i] = x;
    }
    for (int64_t i = 0; i < 3 * n_faces; ++i) {
        const uint8_t b = bytes[3 + n_positions + (size_t)i];
        soup.triangle[i] = (loxo_index)(b < 0xfc ? b % n_vertices : (int8_t)b + (b & 1) * 100);
    }
    return soup;
}

static void check_fault(const loxo_fault *fault, int64_t n)
{
    FUZZ_CHECK(fault->count >= 0 && fault->n_first >= 0 && fault->n_first <= LOXO_N_OFFENDERS);
    FUZZ_CHECK(fault->count >= fault->n_first && (fault->count == 0) == (fault->n_first == 0));
    for (int i = 0; i < fault->n_first; ++i)
        FUZZ_CHECK(fault->first[i] >= 0 && fault->first[i] < n && (i == 0 || fault->first[i] >= fault->first[i - 1]));
}

static void check_report(const loxo_mesh_report *report)
{
    check_fault(&report->nonmanifold_edges, report->n_faces);
    check_fault(&report->nonmanifold_vertices, report->n_vertices);
    check_fault(&report->inconsistent_faces, report->n_faces);
    check_fault(&report->duplicate_vertices, report->n_vertices);
    check_fault(&report->unreferenced_vertices, report->n_vertices);
    check_fault(&report->degenerate_faces, report->n_faces);
    check_fault(&report->zero_area_faces, report->n_faces);
    check_fault(&report->duplicate_faces, report->n_faces);
    check_fault(&report->nonfinite_vertices, report->n_vertices);
    FUZZ_CHECK(report->n_components >= 0 && report->n_boundary_edges >= 0 &&
               report->n_boundary_edges <= report->n_edges);
    FUZZ_CHECK(report->is_manifold == (report->n_boundary_loops >= 0));
    FUZZ_CHECK(!report->is_closed || report->n_boundary_edges == 0);
}

static void check_halfedges(const loxo_mesh_view *view, bool may_loop)
{
    const int64_t n_halfedges = 3 * view->n_faces;
    for (int64_t h = 0; h < n_halfedges; ++h) {
        const int64_t twin = view->halfedge_twin[h], next = h % 3 == 2 ? h - 2 : h + 1;
        FUZZ_CHECK(view->halfedge_vertex[h] >= 0 && view->halfedge_vertex[h] < view->n_vertices);
        FUZZ_CHECK(may_loop || view->halfedge_vertex[h] != view->halfedge_vertex[next]);
        if (twin < 0) continue;
        FUZZ_CHECK(twin < n_halfedges && view->halfedge_twin[twin] == h);
        FUZZ_CHECK(view->halfedge_vertex[twin] == view->halfedge_vertex[next]);
    }
    int64_t n_met = 0;
    for (int64_t v = 0; v < view->n_vertices; ++v) {
        const int64_t first = view->vertex_halfedge[v];
        FUZZ_CHECK(first >= -1 && first < n_halfedges);
        int64_t h = first;
        while (h >= 0) { /* counter-clockwise, twin(previous(h)), meets every face at v */
            FUZZ_CHECK(view->halfedge_vertex[h] == v);
            FUZZ_CHECK(++n_met <= n_halfedges);
            h = view->halfedge_twin[h % 3 == 0 ? h + 2 : h - 1];
            if (h == first) break;
        }
    }
    FUZZ_CHECK(n_met == n_halfedges);
    FUZZ_CHECK(view->n_parts >= 0);
    for (int64_t p = 0; p < view->n_parts; ++p)
        FUZZ_CHECK(view->part_vertex[p] <= view->part_vertex[p + 1] && view->part_face[p] <= view->part_face[p + 1]);
}

static void check_point(const loxo_face_point *p, int64_t n_faces)
{
    FUZZ_CHECK(p->face >= 0 && p->face < n_faces);
    for (int k = 0; k < 3; ++k)
        FUZZ_CHECK(p->weight[k] >= 0.0 && p->weight[k] <= 1.0);
}

/* Flips end, lengths are sound, and every way over the surface ends where it must, however flat the faces are. */
static void make_intrinsic(loxo_context *ctx, const loxo_mesh *surface)
{
    loxo_intrinsic_info info;
    loxo_mesh *mesh = NULL;
    const loxo_status status = loxo_mesh_create_intrinsic(ctx, surface, NULL, &info, &mesh);
    fuzz_check_status(ctx, status);
    FUZZ_CHECK((status >= 0) == (mesh != NULL) && (status == LOXO_OK || status == LOXO_ERR_MESH));
    if (status < 0) return;
    const loxo_mesh_view m = loxo_mesh_get_view(mesh), s = loxo_mesh_get_view(surface);
    check_halfedges(&m, true);
    for (int64_t h = 0; h < 3 * m.n_faces; ++h) {
        loxo_edge_point crossing[512];
        const int64_t n = loxo_edge_n_crossings(mesh, (loxo_index)h), twin = m.halfedge_twin[h];
        FUZZ_CHECK(m.halfedge_length[h] > 0.0 && m.halfedge_length[h] < 1e6);
        FUZZ_CHECK(twin < 0 ||
                   (m.halfedge_length[h] == m.halfedge_length[twin] && mesh->crossing[h] == mesh->crossing[twin]));
        FUZZ_CHECK(n <= 512 && isfinite(loxo_trace_edge(mesh, (loxo_index)h, crossing)));
        for (int64_t i = 0; i < n; ++i) {
            FUZZ_CHECK(crossing[i].share >= 0.0 && crossing[i].share <= 1.0);
            FUZZ_CHECK(i == 0 || s.halfedge_twin[crossing[i - 1].halfedge] / 3 == crossing[i].halfedge / 3);
        }
        if (n > 0) {
            const int64_t last = s.halfedge_twin[crossing[n - 1].halfedge], first = crossing[0].halfedge;
            FUZZ_CHECK(s.halfedge_vertex[first % 3 == 0 ? first + 2 : first - 1] == m.halfedge_vertex[h]);
            FUZZ_CHECK(s.halfedge_vertex[last % 3 == 0 ? last + 2 : last - 1] ==
                       m.halfedge_vertex[h % 3 == 2 ? h - 2 : h + 1]);
        }
        FUZZ_CHECK(isfinite(loxo_trace_surface_edge(mesh, (loxo_index)h, NULL, NULL)));
        const loxo_face_point p = {(loxo_index)(h / 3), {0.5, 0.125, 0.375}};
        const loxo_face_point to = loxo_to_intrinsic(mesh, &p), from = loxo_to_surface(mesh, &p);
        check_point(&to, m.n_faces);
        check_point(&from, s.n_faces);
    }
    loxo_mesh_destroy(mesh);
}

/* must_fit: the arrays come from a repair that cut what is not manifold. */
static void create(loxo_context *ctx, const loxo_soup *soup, loxo_order order, bool repair, bool must_fit)
{
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    loxo_mesh_settings settings = loxo_mesh_settings_default();
    loxo_mesh_info info;
    loxo_mesh *mesh = NULL;
    settings.order = order;
    settings.repair = repair;
    const loxo_status status = loxo_mesh_create(ctx, &arrays, LOXO_COPY, &settings, &info, &mesh);
    fuzz_check_status(ctx, status);
    FUZZ_CHECK((status >= 0) == (mesh != NULL));
    FUZZ_CHECK(!must_fit || status != LOXO_ERR_MESH);
    if (status >= 0) {
        const loxo_mesh_view view = loxo_mesh_get_view(mesh);
        check_halfedges(&view, false);
        make_intrinsic(ctx, mesh);
        FUZZ_PLANT(view.n_faces == 5 && info.n_boundary_loops == 1 && info.euler == 1);
    }
    loxo_mesh_destroy(mesh);
}

static void fuzz_one(loxo_context *ctx, const uint8_t *bytes, size_t n)
{
    if (n < 6) return;
    loxo_soup soup = make_soup(ctx, bytes, n);
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    const loxo_order order = (loxo_order)((bytes[0] >> 2) % (LOXO_ORDER_BFS + 1));
    loxo_mesh_report report;
    loxo_status status;
    uint32_t mix = 0;
    for (size_t i = 0; i < n; ++i)
        mix = (mix + bytes[i]) * 0x9e3779b1u;
    if (mix >> 27 == 0) { /* one in 32: the report's quantiles cost as much as many of the rest */
        status = loxo_mesh_check(ctx, &arrays, &report);
        fuzz_check_status(ctx, status);
        if (status >= 0) check_report(&report);
    }
    create(ctx, &soup, order, (bytes[0] & 2) != 0, false);

    const loxo_repair_settings settings = {.weld = (bytes[2] & 1) != 0,
                                           .drop_duplicate_faces = (bytes[2] & 2) != 0,
                                           .split_nonmanifold = (bytes[2] & 4) != 0,
                                           .drop_unreferenced = (bytes[2] & 8) != 0};
    const int64_t n_before = soup.n_vertices;
    loxo_index *origin = NULL;
    loxo_repair_info info;
    status = loxo_soup_repair(ctx, &soup, &settings, &origin, &info);
    fuzz_check_status(ctx, status);
    if (status >= 0) {
        FUZZ_CHECK(origin != NULL);
        for (int64_t v = 0; v < soup.n_vertices; ++v) {
            FUZZ_CHECK(origin[v] >= 0 && origin[v] < n_before);
            FUZZ_CHECK(soup.fields[0].value[v] == (double)origin[v]);
        }
        create(ctx, &soup, order, false, settings.split_nonmanifold);
    }
    loxo_release(ctx, origin);
    loxo_soup_destroy(ctx, &soup);
}
