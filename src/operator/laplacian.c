/* SPDX-License-Identifier: MIT
 * By counting: degrees, offsets, rows. Each vertex gathers its own row from the weights of half-edges around it. */
#include "operator/laplacian.h"

#include "base/allocate.h"
#include "kernel/laplacian_kernel.h"

size_t loxo_laplacian_bytes(int64_t n_vertices, int64_t n_faces, int64_t n_boundary_edges)
{
    const size_t n_entries = (size_t)(3 * n_faces + n_boundary_edges);
    return (size_t)n_vertices * 16 + 8 + n_entries * (sizeof(loxo_index) + sizeof(double)) +
           (size_t)n_faces * 4 * sizeof(double) + (size_t)n_vertices * sizeof(int64_t);
}

/* twice_area may be NULL. */
static void weigh_faces(loxo_context *ctx, const loxo_mesh_view *m, double *weight, double *twice_area)
{
#pragma omp parallel num_threads(loxo_threads_for(ctx, m->n_faces, 40.0))
    {
        const loxo_range r = loxo_thread_range(m->n_faces);
        for (int64_t f = r.begin; f < r.end; ++f) {
            double length[3];
            k_face_lengths(m, f, length);
            const double area = k_face_weights(length, weight + 3 * f);
            if (twice_area != NULL) twice_area[f] = area;
        }
    }
}

/* Number of edges at v; one from v to itself has two ends here. */
static int64_t count_edges(const loxo_mesh_view *m, int64_t v)
{
    const loxo_index first = m->vertex_halfedge[v];
    int64_t n = 0;
    loxo_index h = first;
    if (first < 0) return 0;
    do {
        ++n;
        h = m->halfedge_twin[k_previous(h)];
    } while (h >= 0 && h != first);
    return h < 0 ? n + 1 : n;
}

/* Shell sort: rows are short, and a hub of many thousand does not take the square of it. */
static void sort_row(int64_t n, loxo_index *column, double *value)
{
    int64_t gap = 1;
    while (gap < n / 9)
        gap = 3 * gap + 1;
    for (; gap > 0; gap /= 3)
        for (int64_t i = gap; i < n; ++i) {
            const loxo_index c = column[i];
            const double x = value[i];
            int64_t k = i;
            for (; k >= gap && column[k - gap] > c; k -= gap) {
                column[k] = column[k - gap];
                value[k] = value[k - gap];
            }
            column[k] = c;
            value[k] = x;
        }
}

/* Adds up entries of one column and drops the row's own. Returns what is left. */
static int64_t merge_row(int64_t v, int64_t n, loxo_index *column, double *value)
{
    int64_t n_kept = 0;
    for (int64_t k = 0; k < n; ++k) {
        if (column[k] == v) continue;
        if (n_kept > 0 && column[n_kept - 1] == column[k]) {
            value[n_kept - 1] += value[k];
            continue;
        }
        column[n_kept] = column[k];
        value[n_kept++] = value[k];
    }
    return n_kept;
}

/* Row of v, which has faces, and a third of the area around; returns the number of entries. Both ends of an edge add the
 * weights of its sides with the same rounding. */
static int64_t gather_row(const loxo_mesh_view *m, const double *weight, const double *twice_area, int64_t v,
                          loxo_index *column, double *value, double *mass)
{
    const loxo_index first = m->vertex_halfedge[v];
    loxo_index h = first, back;
    int64_t n = 0;
    double sum = 0.0;
    do {
        const loxo_index twin = m->halfedge_twin[h];
        back = k_previous(h);
        column[n] = k_head(m, h);
        value[n++] = -(weight[h] + (twin >= 0 ? weight[twin] : 0.0));
        if (mass != NULL) sum += twice_area[k_face_of(h)];
        h = m->halfedge_twin[back];
    } while (h >= 0 && h != first);
    if (h < 0) { /* the last neighbour at a boundary: only the half-edge towards us exists */
        column[n] = m->halfedge_vertex[back];
        value[n++] = -weight[back];
    }
    if (mass != NULL) mass[v] = sum / 6.0;
    sort_row(n, column, value);
    return merge_row(v, n, column, value);
}

/* Moves rows together that became shorter than was counted. */
static void close_gaps(loxo_csr *a, const int64_t *n_kept)
{
    int64_t to = 0;
    for (int64_t v = 0; v < a->n_rows; ++v) {
        const int64_t from = a->begin[v];
        a->begin[v] = to;
        for (int64_t k = 0; k < n_kept[v]; ++k, ++to) {
            a->column[to] = a->column[from + k];
            a->value[to] = a->value[from + k];
        }
    }
    a->begin[a->n_rows] = to;
}

loxo_status loxo_laplacian_create(loxo_context *ctx, const loxo_mesh_view *m, loxo_csr *a, double *mass)
{
    const int64_t n = m->n_vertices;
    loxo_status status = LOXO_ERR_MEMORY;
    double *weight = loxo_allocate(ctx, 3 * m->n_faces, sizeof *weight), *twice_area = NULL;
    int64_t *n_kept = NULL;
    bool is_shorter = false;
    *a = (loxo_csr){.n_rows = n};
    a->begin = loxo_allocate(ctx, n + 1, sizeof *a->begin);
    a->diagonal = loxo_allocate(ctx, n, sizeof *a->diagonal);
    if (weight == NULL || a->begin == NULL || a->diagonal == NULL) goto done;
    if (mass != NULL && (twice_area = loxo_allocate(ctx, m->n_faces, sizeof *twice_area)) == NULL) goto done;
    weigh_faces(ctx, m, weight, twice_area);
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 20.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t v = r.begin; v < r.end; ++v)
            a->begin[v] = count_edges(m, v);
    }
    const int64_t n_entries = loxo_scan_in_place(ctx, n, a->begin);
    a->column = loxo_allocate(ctx, n_entries, sizeof *a->column);
    a->value = loxo_allocate(ctx, n_entries, sizeof *a->value);
    n_kept = loxo_allocate(ctx, n, sizeof *n_kept);
    if (a->column == NULL || a->value == NULL || n_kept == NULL) goto done;
    if (loxo_stop_wanted(ctx, "laplacian", 0.5)) {
        status = LOXO_ERR_STOPPED;
        goto done;
    }
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 100.0)) reduction(|| : is_shorter)
    {
        const loxo_range r = loxo_csr_share(a, loxo_thread_id(), loxo_thread_count());
        for (int64_t v = r.begin; v < r.end; ++v) {
            loxo_index *column = a->column + a->begin[v];
            double *value = a->value + a->begin[v], sum = 0.0;
            if (mass != NULL) mass[v] = 0.0;
            n_kept[v] = m->vertex_halfedge[v] < 0 ? 0 : gather_row(m, weight, twice_area, v, column, value, mass);
            for (int64_t k = 0; k < n_kept[v]; ++k)
                sum += value[k];
            a->diagonal[v] = -sum;
            is_shorter = is_shorter || n_kept[v] < a->begin[v + 1] - a->begin[v];
        }
    }
    if (is_shorter) close_gaps(a, n_kept);
    status = LOXO_OK;
done:
    loxo_release(ctx, n_kept);
    loxo_release(ctx, twice_area);
    loxo_release(ctx, weight);
    if (status < 0) loxo_csr_destroy(ctx, a);
    return status;
}
