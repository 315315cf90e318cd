/* SPDX-License-Identifier: MIT
 * Each vertex gathers its two rows: from the faces around it, then from its row of L. */
#include "base/allocate.h"
#include "base/sort.h"
#include "par/range.h"
#include "solver/sphere/hbtr_internal.h"

#define NS_A_VERTEX 1500.0 /* about, of two rows of the Hessian */

void hbtr_find_frames(const sphere_problem *p, const double *x, k_chart_frame *frame)
{
    const int64_t n = p->m.n_vertices;
#pragma omp parallel num_threads(loxo_threads_for(p->ctx, n, 60.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i)
            frame[i] = k_chart_frame_of(x[2 * i], x[2 * i + 1]);
    }
}

/* Place of column j in the row that begins and ends there; -1: it has none. */
static int64_t find_column(const loxo_index *column, int64_t begin, int64_t end, loxo_index j)
{
    while (begin < end) {
        const int64_t middle = begin + (end - begin) / 2;
        if (column[middle] < j)
            begin = middle + 1;
        else if (column[middle] > j)
            end = middle;
        else
            return middle;
    }
    return -1;
}

static bool is_less(const void *arg, const void *a, const void *b)
{
    (void)arg;
    return *(const loxo_index *)a < *(const loxo_index *)b;
}

/* Neighbours of i in the mesh that L does not join to it. other NULL: counted, with repeats; else listed, ascending, each once. */
static int64_t find_others(const sphere_problem *p, int64_t i, loxo_index *other)
{
    const loxo_csr *l = &p->laplacian;
    const loxo_index first = p->m.vertex_halfedge[i];
    loxo_index h = first;
    int64_t n = 0, n_kept = 0;
    if (first < 0) return 0;
    do {
        const loxo_index j = k_head(&p->m, h);
        if (j != i && find_column(l->column, l->begin[i], l->begin[i + 1], j) < 0) {
            if (other != NULL) other[n] = j;
            ++n;
        }
        h = p->m.halfedge_twin[k_previous(h)];
    } while (h >= 0 && h != first);
    if (other == NULL || n == 0) return n;
    loxo_sort(other, n, sizeof *other, is_less, NULL);
    for (int64_t k = 0; k < n; ++k)
        if (n_kept == 0 || other[n_kept - 1] != other[k]) other[n_kept++] = other[k];
    return n_kept;
}

/* Columns of the two rows of i, from both ascending lists of its neighbours and itself. */
static void fill_columns(const loxo_csr *l, int64_t i, int64_t n_others, const loxo_index *other, loxo_csr *h)
{
    int64_t to[2] = {h->begin[2 * i], h->begin[2 * i + 1]}, e = l->begin[i], o = 0;
    bool has_own = false;
    while (e < l->begin[i + 1] || o < n_others || !has_own) {
        int64_t j = e < l->begin[i + 1] ? l->column[e] : LOXO_INDEX_MAX;
        if (o < n_others && other[o] < j) j = other[o];
        if (!has_own && i < j) {
            has_own = true;
            h->column[to[0]++] = (loxo_index)(2 * i + 1);
            h->column[to[1]++] = (loxo_index)(2 * i);
            continue;
        }
        if (e < l->begin[i + 1] && l->column[e] == j)
            ++e;
        else
            ++o;
        for (int row = 0; row < 2; ++row) {
            h->column[to[row]++] = (loxo_index)(2 * j);
            h->column[to[row]++] = (loxo_index)(2 * j + 1);
        }
    }
}

loxo_status hbtr_create_pattern(const sphere_problem *p, loxo_csr *h)
{
    loxo_context *ctx = p->ctx;
    const loxo_csr *l = &p->laplacian;
    const int64_t n = p->m.n_vertices;
    loxo_status status = LOXO_ERR_MEMORY;
    *h = (loxo_csr){.n_rows = 2 * n};
    if (2 * n > LOXO_INDEX_MAX)
        return loxo_fail(ctx, LOXO_ERR_LIMIT, "hbtr: twice %lld vertices are more than this build's ids can tell apart",
                         (long long)n);
    loxo_index *other = NULL;
    int64_t *n_others = loxo_allocate(ctx, n, sizeof *n_others);
    int64_t *from = loxo_allocate(ctx, n + 1, sizeof *from);
    h->begin = loxo_allocate(ctx, 2 * n + 1, sizeof *h->begin);
    h->diagonal = loxo_allocate(ctx, 2 * n, sizeof *h->diagonal);
    if (n_others == NULL || from == NULL || h->begin == NULL || h->diagonal == NULL) goto done;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 200.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i)
            from[i] = find_others(p, i, NULL);
    }
    if ((other = loxo_allocate(ctx, loxo_scan_in_place(ctx, n, from), sizeof *other)) == NULL) goto done;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 200.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            n_others[i] = find_others(p, i, other + from[i]);
            h->begin[2 * i] = h->begin[2 * i + 1] = 2 * (l->begin[i + 1] - l->begin[i] + n_others[i]) + 1;
        }
    }
    const int64_t n_entries = loxo_scan_in_place(ctx, 2 * n, h->begin);
    h->column = loxo_allocate(ctx, n_entries, sizeof *h->column);
    h->value = loxo_allocate(ctx, n_entries, sizeof *h->value);
    if (h->column == NULL || h->value == NULL) goto done;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 100.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i)
            fill_columns(l, i, n_others[i], other + from[i], h);
    }
    status = LOXO_OK;
done:
    loxo_release(ctx, n_others);
    loxo_release(ctx, from);
    loxo_release(ctx, other);
    if (status < 0) loxo_csr_destroy(ctx, h);
    return status;
}

/* ---- values -------------------------------------------------------------------------------------------------- */

/* The two rows of a vertex. Both begin their columns at the same vertices, so that a place in one is a place in the other. */
typedef struct two_rows {
    loxo_csr *h; /* NULL: only the gradient is wanted */
    int64_t i;
    double own[4]; /* the block on the diagonal */
} two_rows;

static void add_block(const two_rows *rows, loxo_index j, const double block[4])
{
    const loxo_csr *h = rows->h;
    const int64_t begin = h->begin[2 * rows->i], end = h->begin[2 * rows->i + 1];
    const int64_t place = find_column(h->column, begin, end, (loxo_index)(2 * j)) - begin;
    double *upper = h->value + begin + place, *lower = h->value + end + place;
    upper[0] += block[0];
    upper[1] += block[1];
    lower[0] += block[2];
    lower[1] += block[3];
}

/* The face of half-edge g, which starts at the rows' vertex: its part of (p, q, r) = D(f) f, returned, and of the blocks. */
static loxo_vec3 add_face(const sphere_problem *p, const k_chart_frame *frame, loxo_index g, two_rows *rows)
{
    const int64_t t = k_face_of(g);
    const int c = (int)(g - 3 * t);
    const loxo_index *v = p->m.halfedge_vertex + 3 * t;
    const k_image_face face = k_chart_face_of(frame[v[0]].f, frame[v[1]].f, frame[v[2]].f);
    if (rows->h != NULL) {
        k_chart_add_area(&face, c, &frame[v[c]], c, &frame[v[c]], rows->own);
        for (int k = 1; k <= 2; ++k) {
            const int d = (c + k) % 3;
            double block[4] = {0.0, 0.0, 0.0, 0.0};
            if (v[d] == rows->i) continue;
            k_chart_add_area(&face, c, &frame[v[c]], d, &frame[v[d]], block);
            add_block(rows, v[d], block);
        }
    }
    return v3_scale(-1.0, k_image_area_gradient(&face, c));
}

static void fill_rows(const sphere_problem *p, const k_chart_frame *frame, int64_t i, double *gradient, loxo_csr *h)
{
    const loxo_csr *l = &p->laplacian;
    const loxo_index first = p->m.vertex_halfedge[i];
    const k_chart_frame *at = &frame[i];
    two_rows rows = {.h = h, .i = i};
    loxo_vec3 pqr = {0.0, 0.0, 0.0};
    loxo_index g = first;
    if (h != NULL)
        for (int64_t e = h->begin[2 * i]; e < h->begin[2 * i + 2]; ++e)
            h->value[e] = 0.0;
    while (g >= 0) {
        pqr = v3_add(pqr, add_face(p, frame, g, &rows));
        g = p->m.halfedge_twin[k_previous(g)];
        if (g == first) break;
    }
    for (int64_t e = l->begin[i]; e < l->begin[i + 1]; ++e) {
        const loxo_index j = l->column[e];
        pqr = v3_axpy(pqr, l->value[e], v3_sub(frame[j].f, at->f));
        if (h == NULL) continue;
        double block[4] = {0.0, 0.0, 0.0, 0.0};
        k_chart_add_matrix(l->value[e], at, &frame[j], block);
        add_block(&rows, j, block);
    }
    k_chart_gradient(at, pqr, gradient + 2 * i);
    if (h == NULL) return;
    double bending[4];
    k_chart_bending(at, pqr, bending);
    k_chart_add_matrix(l->diagonal[i], at, at, rows.own);
    const int64_t begin = h->begin[2 * i], end = h->begin[2 * i + 1];
    const int64_t place = find_column(h->column, begin, end, (loxo_index)(2 * i + 1)) - begin;
    h->diagonal[2 * i] = rows.own[0] - bending[0];
    h->value[begin + place] = h->value[end + place] = rows.own[1] - bending[1];
    h->diagonal[2 * i + 1] = rows.own[3] - bending[3];
}

void hbtr_fill(const sphere_problem *p, const k_chart_frame *frame, double *gradient, loxo_csr *h)
{
    const int64_t n = p->m.n_vertices;
#pragma omp parallel num_threads(loxo_threads_for(p->ctx, n, NS_A_VERTEX))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i)
            fill_rows(p, frame, i, gradient, h);
    }
}
