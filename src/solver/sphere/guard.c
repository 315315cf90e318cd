/* SPDX-License-Identifier: MIT
 * Steps that turn no face over. Where one would, its vertices go along with their neighbours instead: their steps are made the mean of those
 * around, until the patch moves as one. What is small in the image, such as the tip of a limb, is thus carried along, where a step cut short would
 * leave it behind. */
#include "kernel/conformal_kernel.h"
#include "kernel/laplacian_kernel.h"
#include "par/range.h"
#include "solver/sphere/tangent.h"

#include <string.h>

/* Share of its Dirichlet energy that a face's signed area may not fall below, or where it is less already, half of what it is:
 * 1 where the map is conformal there. */
#define LEAST_QUALITY 0.05
#define MOST_ROUNDS   24
#define SWEEPS        4 /* of taking means, a round */

static double signed_area(sphere_const_map f, const loxo_index *v)
{
    double side;
    const loxo_vec3 n = k_image_normal(v3_load(f[v[0]]), v3_load(f[v[1]]), v3_load(f[v[2]]), &side);
    return copysign(0.5 * v3_norm(n), side);
}

/* Signed area over Dirichlet energy; 1 for a face that weighs nothing. */
static double quality(const sphere_problem *p, sphere_const_map f, int64_t face)
{
    const loxo_index *v = &p->m.halfedge_vertex[3 * face];
    double length[3], weight[3], dirichlet = 0.0;
    k_face_lengths(&p->m, face, length);
    (void)k_face_weights(length, weight);
    for (int k = 0; k < 3; ++k) {
        const loxo_vec3 d = v3_sub(v3_load(f[v[(k + 1) % 3]]), v3_load(f[v[k]]));
        dirichlet += 0.5 * weight[k] * v3_dot(d, d);
    }
    return dirichlet > 0.0 ? signed_area(f, v) / dirichlet : 1.0;
}

static bool is_bad(const sphere_problem *p, sphere_const_map f, sphere_const_map trial, int64_t face)
{
    const loxo_index *v = &p->m.halfedge_vertex[3 * face];
    const double before = signed_area(f, v), after = signed_area(trial, v);
    if (after > 0.5 * before && after > 0.0) return false;
    if (!(before > 0.0)) return false; /* was turned over already: its signed area wants to grow */
    if (!(after > 0.0)) return true;
    const double now = quality(p, trial, face);
    return now < LEAST_QUALITY && now < 0.5 * quality(p, f, face);
}

void sphere_move(const sphere_problem *p, sphere_const_map f, const double *d, sphere_map trial)
{
#pragma omp parallel num_threads(loxo_threads_for(p->ctx, p->m.n_vertices, 8.0))
    {
        const loxo_range r = loxo_thread_range(p->m.n_vertices);
        for (int64_t i = r.begin; i < r.end; ++i)
            v3_store(trial[i], k_retract(v3_load(f[i]), v3_load(&d[3 * i])));
    }
}

/* Marks vertices at bad faces; each looks at its own. Returns how many there were. */
int64_t sphere_mark_bad(const sphere_problem *p, sphere_const_map f, sphere_const_map trial, unsigned char *mark)
{
    const loxo_mesh_view *m = &p->m;
    int64_t n_bad = 0;
#pragma omp parallel num_threads(loxo_threads_for(p->ctx, m->n_vertices, 60.0)) reduction(+ : n_bad)
    {
        const loxo_range r = loxo_thread_range(m->n_vertices);
        for (int64_t i = r.begin; i < r.end; ++i) {
            const loxo_index first = m->vertex_halfedge[i];
            loxo_index h = first;
            bool has_bad = false;
            do {
                has_bad = is_bad(p, f, trial, k_face_of(h));
                h = m->halfedge_twin[k_previous(h)];
            } while (h != first && !has_bad);
            if (!has_bad) continue;
            mark[i] = 1;
            ++n_bad;
        }
    }
    return n_bad;
}

/* Mean step of the vertices around i, tangent at f_i. */
static loxo_vec3 mean_step(const loxo_mesh_view *m, sphere_const_map f, const double *d, int64_t i)
{
    const loxo_index first = m->vertex_halfedge[i];
    loxo_vec3 sum = {0.0, 0.0, 0.0};
    double n = 0.0;
    loxo_index h = first;
    do {
        sum = v3_add(sum, v3_load(&d[3 * (int64_t)k_head(m, h)]));
        n += 1.0;
        h = m->halfedge_twin[k_previous(h)];
    } while (h != first);
    return k_tangent(v3_load(f[i]), v3_scale(1.0 / n, sum));
}

/* The steps of marked vertices become means of those around, some times over, each from the one before. */
static void smooth(const sphere_problem *p, sphere_const_map f, const unsigned char *mark, double *d, double *work)
{
    const int64_t n = p->m.n_vertices;
    double *mean = work;
    loxo_index *list = (loxo_index *)(work + 3 * n);
    int64_t n_marked = 0;
    for (int64_t i = 0; i < n; ++i)
        if (mark[i] != 0) list[n_marked++] = (loxo_index)i;
    for (int sweep = 0; sweep < SWEEPS; ++sweep) {
        for (int64_t k = 0; k < n_marked; ++k)
            v3_store(&mean[3 * k], mean_step(&p->m, f, d, list[k]));
        for (int64_t k = 0; k < n_marked; ++k)
            v3_store(&d[3 * (int64_t)list[k]], v3_load(&mean[3 * k]));
    }
}

loxo_status sphere_guard(const sphere_problem *p, sphere_const_map f, double *d, int64_t most, double *work,
                         unsigned char *mark, sphere_map trial, int64_t *n_bad)
{
    memset(mark, 0, (size_t)p->m.n_vertices);
    for (int round = 0;; ++round) {
        sphere_move(p, f, d, trial);
        *n_bad = sphere_mark_bad(p, f, (sphere_const_map)trial, mark);
        if (*n_bad == 0 || *n_bad > most || round == MOST_ROUNDS) return LOXO_OK;
        smooth(p, f, mark, d, work);
        if (loxo_stop_wanted(p->ctx, "map", -1.0)) return LOXO_STOPPED;
    }
}
