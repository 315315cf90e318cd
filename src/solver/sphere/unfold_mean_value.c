/* SPDX-License-Identifier: MIT
 * Algorithm 2: the vertices of triangles that are turned over get the means of their neighbours by mean value weights (5.1), in
 * a plane. Each cluster of such triangles has a plane of its own, from the far side of the sphere.
 *
 * source  Tan, Li, Lin, Yau 2024, section 5.4; Floater 2003, Mean value coordinates (the angles of (5.1): README.md) */
#include "kernel/conformal_kernel.h"
#include "kernel/star_kernel.h"
#include "solver/sphere/unfold.h"

#define MAX_ROUNDS   10
#define MAX_SWEEPS   400   /* of Gauss and Seidel */
#define TOLERANCE    1e-12 /* largest move in a sweep, over the size of the cluster */
#define LEAST_FACING 0.1 /* 1 + cos of the angle to the farthest vertex: no cluster around more than that is treated */

/* The clusters, and the system of one of them. */
typedef struct clusters {
    const sphere_problem *p;
    sphere_map f;
    const bool *is_folded;
    loxo_index *place;   /* [n] where a vertex stands in its cluster + 1; 0: in none */
    loxo_index *cluster; /* [n] of which */
    loxo_index *vertex;  /* [n_vertices] cluster after cluster */
    int64_t n_vertices, n_entries;
    int64_t *begin;      /* [n_vertices + 1] rows */
    loxo_index *column;  /* [n_entries] places in the cluster */
    double *weight;      /* [n_entries] rows with what is fixed sum to 1 */
    double (*fixed)[2];  /* [n_vertices] of the neighbours outside */
    double (*at)[2];     /* [n_vertices] */
    double (*before)[3]; /* [n_vertices] */
} clusters;

static loxo_index turn(const loxo_mesh_view *m, loxo_index h) { return m->halfedge_twin[k_previous(h)]; }

/* Grows the cluster of vertex v: over triangles turned over that share a vertex. */
static void gather(clusters *c, loxo_index v, loxo_index id)
{
    const loxo_mesh_view *m = &c->p->m;
    const int64_t begin = c->n_vertices;
    c->cluster[v] = id;
    c->place[v] = 1;
    c->vertex[c->n_vertices++] = v;
    for (int64_t i = begin; i < c->n_vertices; ++i) {
        const loxo_index start = m->vertex_halfedge[c->vertex[i]];
        loxo_index h = start;
        do {
            c->n_entries += 1;
            for (int k = 0; c->is_folded[k_face_of(h)] && k < 3; ++k) {
                const loxo_index w = m->halfedge_vertex[3 * k_face_of(h) + k];
                if (c->place[w] > 0) continue;
                c->cluster[w] = id;
                c->place[w] = (loxo_index)(c->n_vertices - begin + 1);
                c->vertex[c->n_vertices++] = w;
            }
            h = turn(m, h);
        } while (h != start);
    }
}

/* (5.1) for the edge of half-edge h, from the two triangles beside it: angles at the vertex where h starts. */
static double mean_value_weight(const loxo_mesh_view *m, loxo_index h)
{
    const loxo_vec3 at = k_position(m, m->halfedge_vertex[h]);
    const loxo_vec3 edge = v3_sub(k_position(m, k_head(m, h)), at);
    const loxo_vec3 left = v3_sub(k_position(m, m->halfedge_vertex[k_previous(h)]), at);
    const loxo_vec3 right = v3_sub(k_position(m, k_head(m, k_next(m->halfedge_twin[h]))), at);
    const double length = v3_norm(edge);
    return length > 0.0 ? (k_half_tangent(edge, left) + k_half_tangent(right, edge)) / length : 0.0;
}

/* p in the plane that touches the sphere at the frame, projected from the far side; false: it is there. */
static bool to_plane(const k_frame *frame, loxo_vec3 p, double out[2])
{
    const loxo_vec3 q = k_frame_in(frame, p);
    const double facing = 1.0 + q.z;
    if (!(facing > LEAST_FACING)) return false;
    out[0] = 2.0 * q.x / facing;
    out[1] = 2.0 * q.y / facing;
    return true;
}

/* And back: (4 x, 4 y, 4 - r^2) / (4 + r^2). */
static loxo_vec3 from_plane(const k_frame *frame, const double at[2])
{
    return k_frame_out(frame, (loxo_vec3){4.0 * at[0], 4.0 * at[1], 4.0 - at[0] * at[0] - at[1] * at[1]});
}

/* The system of the cluster of vertices begin .. end - 1, and where they are; false: it is too large for one plane. */
static bool set_up(clusters *c, const k_frame *frame, int64_t begin, int64_t end)
{
    const loxo_mesh_view *m = &c->p->m;
    const loxo_index id = c->cluster[c->vertex[begin]];
    int64_t e = 0;
    for (int64_t i = begin; i < end; ++i) {
        const loxo_index v = c->vertex[i], start = m->vertex_halfedge[v];
        double sum = 0.0, degree = 0.0;
        if (!to_plane(frame, v3_load(c->f[v]), c->at[i])) return false;
        loxo_index h = start;
        do {
            sum += mean_value_weight(m, h);
            degree += 1.0;
            h = turn(m, h);
        } while (h != start);
        const bool is_even = !(sum > 0.0) || !isfinite(sum); /* a vertex of triangles without area */
        c->begin[i] = e;
        c->fixed[i][0] = c->fixed[i][1] = 0.0;
        do {
            const loxo_index w = k_head(m, h);
            const double share = is_even ? 1.0 / degree : mean_value_weight(m, h) / sum;
            double at[2];
            if (c->place[w] > 0 && c->cluster[w] == id) {
                c->column[e] = (loxo_index)(c->place[w] - 1);
                c->weight[e++] = share;
            } else if (to_plane(frame, v3_load(c->f[w]), at)) {
                c->fixed[i][0] += share * at[0];
                c->fixed[i][1] += share * at[1];
            } else {
                return false;
            }
            h = turn(m, h);
        } while (h != start);
    }
    c->begin[end] = e;
    return true;
}

/* (5.2). Rows are convex combinations: the sweeps converge, whatever the weights. */
static void solve(clusters *c, int64_t begin, int64_t end)
{
    double size = 0.0;
    for (int64_t i = begin; i < end; ++i)
        size = fmax(size, fmax(fabs(c->fixed[i][0]), fabs(c->fixed[i][1])));
    double move = HUGE_VAL;
    for (int sweep = 0; sweep < MAX_SWEEPS && move > TOLERANCE * size; ++sweep) {
        move = 0.0;
        for (int64_t i = begin; i < end; ++i) {
            double x = c->fixed[i][0], y = c->fixed[i][1];
            for (int64_t e = c->begin[i]; e < c->begin[i + 1]; ++e) {
                x += c->weight[e] * c->at[begin + c->column[e]][0];
                y += c->weight[e] * c->at[begin + c->column[e]][1];
            }
            move = fmax(move, fmax(fabs(x - c->at[i][0]), fabs(y - c->at[i][1])));
            c->at[i][0] = x;
            c->at[i][1] = y;
        }
    }
}

/* Triangles turned over among those with a vertex in the cluster, each once: at the first such vertex. */
static int64_t count_folds(const clusters *c, int64_t begin, int64_t end)
{
    const loxo_mesh_view *m = &c->p->m;
    const loxo_index id = c->cluster[c->vertex[begin]];
    int64_t n = 0;
    for (int64_t i = begin; i < end; ++i) {
        const loxo_index v = c->vertex[i], start = m->vertex_halfedge[v];
        loxo_index h = start;
        do {
            const loxo_index a = k_head(m, h), b = m->halfedge_vertex[k_previous(h)];
            const bool is_first = (a > v || c->place[a] == 0 || c->cluster[a] != id) &&
                                  (b > v || c->place[b] == 0 || c->cluster[b] != id);
            double side;
            (void)k_image_normal(v3_load(c->f[v]), v3_load(c->f[a]), v3_load(c->f[b]), &side);
            n += is_first && !(side > 0.0);
            h = turn(m, h);
        } while (h != start);
    }
    return n;
}

/* Whether fewer triangles of the cluster are turned over than before; else nothing is changed. */
static bool mend(clusters *c, int64_t begin, int64_t end)
{
    loxo_vec3 sum = {0.0, 0.0, 0.0};
    for (int64_t i = begin; i < end; ++i)
        sum = v3_add(sum, v3_load(c->f[c->vertex[i]]));
    if (!(v3_norm(sum) > 0.0)) return false;
    const k_frame frame = k_frame_at(k_unit(sum));
    if (!set_up(c, &frame, begin, end)) return false;
    const int64_t n_before = count_folds(c, begin, end);
    solve(c, begin, end);
    for (int64_t i = begin; i < end; ++i) {
        double *f = c->f[c->vertex[i]];
        v3_store(c->before[i], v3_load(f));
        v3_store(f, from_plane(&frame, c->at[i]));
    }
    if (count_folds(c, begin, end) < n_before) return true;
    for (int64_t i = begin; i < end; ++i)
        v3_store(c->f[c->vertex[i]], v3_load(c->before[i]));
    return false;
}

/* One pass over all clusters. *is_better: some were mended. */
static loxo_status mend_clusters(clusters *c, bool *is_better)
{
    const loxo_mesh_view *m = &c->p->m;
    loxo_index id = 0;
    loxo_status status = LOXO_ERR_MEMORY;
    c->n_vertices = c->n_entries = 0;
    for (int64_t v = 0; v < m->n_vertices; ++v)
        c->place[v] = 0;
    for (int64_t t = 0; t < m->n_faces; ++t)
        if (c->is_folded[t] && c->place[m->halfedge_vertex[3 * t]] == 0) gather(c, m->halfedge_vertex[3 * t], id++);
    const int64_t n = c->n_vertices;
    c->begin = loxo_allocate(c->p->ctx, n + 1, sizeof *c->begin);
    c->column = loxo_allocate(c->p->ctx, c->n_entries, sizeof *c->column);
    c->weight = loxo_allocate(c->p->ctx, c->n_entries, sizeof *c->weight);
    c->fixed = loxo_allocate(c->p->ctx, n, sizeof *c->fixed);
    c->at = loxo_allocate(c->p->ctx, n, sizeof *c->at);
    c->before = loxo_allocate(c->p->ctx, n, sizeof *c->before);
    *is_better = false;
    if (c->begin == NULL || c->column == NULL || c->weight == NULL || c->fixed == NULL || c->at == NULL ||
        c->before == NULL)
        goto done;
    status = LOXO_OK;
    for (int64_t begin = 0, end; begin < n && status == LOXO_OK; begin = end) {
        for (end = begin + 1; end < n && c->cluster[c->vertex[end]] == c->cluster[c->vertex[begin]];)
            ++end;
        *is_better |= mend(c, begin, end);
        if (loxo_stop_wanted(c->p->ctx, "unfold", (double)begin / (double)n)) status = LOXO_STOPPED;
    }
done:
    loxo_release(c->p->ctx, c->before);
    loxo_release(c->p->ctx, c->at);
    loxo_release(c->p->ctx, c->fixed);
    loxo_release(c->p->ctx, c->weight);
    loxo_release(c->p->ctx, c->column);
    loxo_release(c->p->ctx, c->begin);
    return status;
}

loxo_status sphere_unfold_mean_value(const sphere_problem *p, sphere_map f, bool *is_folded, sphere_folds *folds)
{
    clusters c = {.p = p, .f = f, .is_folded = is_folded};
    loxo_status status = LOXO_ERR_MEMORY;
    bool is_better = true;
    c.place = loxo_allocate(p->ctx, p->m.n_vertices, sizeof *c.place);
    c.cluster = loxo_allocate(p->ctx, p->m.n_vertices, sizeof *c.cluster);
    c.vertex = loxo_allocate(p->ctx, p->m.n_vertices, sizeof *c.vertex);
    if (c.place == NULL || c.cluster == NULL || c.vertex == NULL) goto done;
    status = LOXO_OK;
    for (int round = 0; round < MAX_ROUNDS && folds->n > 0 && is_better && status == LOXO_OK; ++round) {
        status = mend_clusters(&c, &is_better);
        if (status < 0) break;
        const loxo_status counted = sphere_find_folds(p, (sphere_const_map)f, is_folded, folds);
        if (counted < 0) status = counted;
    }
done:
    loxo_release(p->ctx, c.vertex);
    loxo_release(p->ctx, c.cluster);
    loxo_release(p->ctx, c.place);
    return status;
}
