/* SPDX-License-Identifier: MIT
 * The conformal energy of a map, and the faces that it turns over. */
#include "kernel/conformal_kernel.h"
#include "par/range.h"
#include "solver/sphere/sphere_internal.h"

typedef struct seen_map {
    const sphere_problem *p;
    sphere_const_map f;
    bool *is_folded;
} seen_map;

/* sums: 1/2 <L f, f>; each edge from its lower vertex. */
static void add_dirichlet(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const seen_map *seen = arg;
    const loxo_csr *a = &seen->p->laplacian;
    double sum = 0.0;
    for (int64_t i = begin; i < end; ++i) {
        const loxo_vec3 x = v3_load(seen->f[i]);
        for (int64_t e = a->begin[i]; e < a->begin[i + 1]; ++e) {
            if (a->column[e] < i) continue;
            const loxo_vec3 d = v3_sub(v3_load(seen->f[a->column[e]]), x);
            sum -= 0.5 * a->value[e] * v3_dot(d, d);
        }
    }
    sums[0] += sum;
}

/* sums: signed area. */
static void add_area(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const seen_map *seen = arg;
    const loxo_index *v = seen->p->m.halfedge_vertex;
    double area = 0.0;
    for (int64_t t = begin; t < end; ++t) {
        double side;
        const loxo_vec3 n = k_image_normal(v3_load(seen->f[v[3 * t]]), v3_load(seen->f[v[3 * t + 1]]),
                                           v3_load(seen->f[v[3 * t + 2]]), &side);
        area += copysign(0.5 * v3_norm(n), side);
    }
    sums[0] += area;
}

loxo_status sphere_find_energy(const sphere_problem *p, sphere_const_map f, sphere_energy *out)
{
    const seen_map seen = {.p = p, .f = f};
    loxo_status status = loxo_sum(p->ctx, p->m.n_vertices, 1, add_dirichlet, &seen, &out->dirichlet);
    if (status >= 0) status = loxo_sum(p->ctx, p->m.n_faces, 1, add_area, &seen, &out->image_area);
    if (status < 0) return status;
    out->energy = out->dirichlet - out->image_area;
    return status;
}

/* sums: folds, solid angle. */
static void add_folds(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const seen_map *seen = arg;
    const loxo_index *v = seen->p->m.halfedge_vertex;
    double angle = 0.0;
    int64_t n = 0;
    for (int64_t t = begin; t < end; ++t) {
        const loxo_vec3 a = v3_load(seen->f[v[3 * t]]), b = v3_load(seen->f[v[3 * t + 1]]);
        const loxo_vec3 c = v3_load(seen->f[v[3 * t + 2]]);
        double side;
        (void)k_image_normal(a, b, c, &side);
        const bool is_folded = !(side > 0.0);
        n += is_folded;
        if (seen->is_folded != NULL) seen->is_folded[t] = is_folded;
        angle += k_solid_angle(a, b, c);
    }
    sums[0] += (double)n;
    sums[1] += angle;
}

loxo_status sphere_find_folds(const sphere_problem *p, sphere_const_map f, bool *is_folded, sphere_folds *out)
{
    static const double four_pi = 12.566370614359172;
    const seen_map seen = {.p = p, .f = f, .is_folded = is_folded};
    double sums[2];
    const loxo_status status = loxo_sum(p->ctx, p->m.n_faces, 2, add_folds, &seen, sums);
    if (status < 0) return status;
    out->n = (int64_t)sums[0];
    out->degree = (int)lrint(sums[1] / four_pi);
    return LOXO_OK;
}
