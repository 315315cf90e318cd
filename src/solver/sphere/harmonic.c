/* SPDX-License-Identifier: MIT
 * The harmonic map of a surface to the plane that sends one of its faces to infinity, and from there to the sphere. README.md,
 * «harmonic». */
#include "algebra/cg.h"
#include "base/allocate.h"
#include "base/sort.h"
#include "kernel/conformal_kernel.h"
#include "par/range.h"
#include "solver/sphere/plane.h"

/* Of the planar coordinates, which are largest at the pole: the other side has to be resolved, too. */
#define PLANE_TOLERANCE  1e-9
#define MOST_PLANE_STEPS 300
#define N_SAMPLES        20000

/* How near to equilateral: 1 where it is, 0 without area. */
static double regularity(const loxo_mesh_view *m, int64_t f)
{
    const loxo_index *v = &m->halfedge_vertex[3 * f];
    const loxo_vec3 a = k_position(m, v[0]), b = k_position(m, v[1]), c = k_position(m, v[2]);
    const loxo_vec3 ab = v3_sub(b, a), bc = v3_sub(c, b), ca = v3_sub(a, c);
    const double squares = v3_dot(ab, ab) + v3_dot(bc, bc) + v3_dot(ca, ca);
    return squares > 0.0 ? 2.0 * sqrt(3.0) * v3_norm(v3_cross(ab, ca)) / squares : 0.0;
}

int64_t sphere_most_regular_face(const sphere_problem *p)
{
    int64_t best = 0;
    double most = -1.0;
    for (int64_t f = 0; f < p->m.n_faces; ++f) {
        const double r = regularity(&p->m, f);
        if (r > most) {
            most = r;
            best = f;
        }
    }
    return best;
}

/* Right sides: a dipole at the face, which is the derivative of a point source along the face's own directions; on the flat face the map is
 * then like 1 / w. Haker et al. 2000, (3) there. Sums are 0. */
static void set_dipole(const loxo_mesh_view *m, int64_t face, double *real, double *imaginary)
{
    const loxo_index *v = &m->halfedge_vertex[3 * face];
    const loxo_vec3 a = k_position(m, v[0]), b = k_position(m, v[1]), c = k_position(m, v[2]);
    const loxo_vec3 ab = v3_sub(b, a), ac = v3_sub(c, a);
    const double along = v3_dot(ab, ac) / v3_dot(ab, ab), base = v3_norm(ab);
    const double height = v3_norm(v3_axpy(ac, -along, ab));
    real[v[0]] = -1.0 / base;
    real[v[1]] = 1.0 / base;
    imaginary[v[0]] = (1.0 - along) / height;
    imaginary[v[1]] = along / height;
    imaginary[v[2]] = -1.0 / height;
}

typedef struct weighted_value {
    double value, weight;
} weighted_value;

static bool is_less(const void *arg, const void *a, const void *b)
{
    (void)arg;
    return ((const weighted_value *)a)->value < ((const weighted_value *)b)->value;
}

/* Value up to which half of the weight lies. */
static double weighted_median(weighted_value *samples, int64_t n)
{
    double total = 0.0, sum = 0.0;
    int64_t i = 0;
    loxo_sort(samples, n, sizeof *samples, is_less, NULL);
    for (int64_t k = 0; k < n; ++k)
        total += samples[k].weight;
    for (; i < n - 1 && sum + samples[i].weight < 0.5 * total; ++i)
        sum += samples[i].weight;
    return samples[i].value;
}

/* The middle of the surface in the plane, and how far from it its half is: by medians, which some far points do not move. */
static loxo_status find_middle(const sphere_problem *p, const double *x, const double *y, double middle[2],
                               double *size)
{
    const int64_t n = p->m.n_vertices, stride = (n + N_SAMPLES - 1) / N_SAMPLES, n_samples = (n + stride - 1) / stride;
    weighted_value *samples = loxo_allocate(p->ctx, n_samples, sizeof *samples);
    if (samples == NULL) return LOXO_ERR_MEMORY;
    for (int of = 0; of < 3; ++of) {
        for (int64_t k = 0; k < n_samples; ++k) {
            const int64_t i = k * stride;
            const double value = of == 0 ? x[i] : of == 1 ? y[i] : hypot(x[i] - middle[0], y[i] - middle[1]);
            samples[k] = (weighted_value){.value = value, .weight = p->area[i]};
        }
        *(of < 2 ? &middle[of] : size) = weighted_median(samples, n_samples);
    }
    loxo_release(p->ctx, samples);
    return LOXO_OK;
}

/* To the sphere, such that the middle goes to the south pole and half of the surface to the southern half. */
static loxo_status put_on_sphere(const sphere_problem *p, const plane_map *h, sphere_map f)
{
    double middle[2] = {0.0, 0.0}, size = 0.0;
    const loxo_status status = find_middle(p, h->x, h->y, middle, &size);
    if (status < 0) return status;
    if (!(size > 0.0) || !isfinite(size))
        return loxo_fail(p->ctx, LOXO_ERR_NUMERIC, "sphere: the harmonic map has no size");
#pragma omp parallel num_threads(loxo_threads_for(p->ctx, p->m.n_vertices, 2.0))
    {
        const loxo_range r = loxo_thread_range(p->m.n_vertices);
        for (int64_t i = r.begin; i < r.end; ++i) {
            /* The right side has the face's orientation as seen from inside: y is mirrored. */
            h->x[i] = (h->x[i] - middle[0]) / size;
            h->y[i] = (middle[1] - h->y[i]) / size;
        }
    }
    plane_to_sphere(p->ctx, p->m.n_vertices, h, PLANE_SOUTH, NULL, f);
    return LOXO_OK;
}

/* Both coordinates by conjugate gradients. */
static loxo_status solve_plane(const sphere_problem *p, double *b, double *xy, loxo_sphere_info *info)
{
    const int64_t n = p->m.n_vertices;
    loxo_multigrid *mg = NULL;
    loxo_cg *cg = NULL;
    loxo_cg_settings how = loxo_cg_settings_default();
    how.tolerance = PLANE_TOLERANCE;
    how.max_iterations = MOST_PLANE_STEPS;
    loxo_status status = loxo_multigrid_create(p->ctx, &p->laplacian, NULL, &mg);
    if (status >= 0) status = loxo_cg_create(p->ctx, &p->laplacian, &cg);
    sphere_note_bytes(p, info);
    for (int k = 0; k < 2 && status >= 0; ++k) {
        const loxo_preconditioner m = {.apply = loxo_multigrid_apply, .state = mg};
        loxo_cg_info solved = {.n_iterations = 0};
        status = loxo_cg_solve(cg, &m, &how, b + k * n, xy + k * n, &solved);
        info->n_linear_steps += solved.n_iterations;
        if (status == LOXO_NOT_CONVERGED) status = LOXO_OK; /* a start all the same; folds are counted */
        if (status == LOXO_STOPPED)
            status = loxo_fail(p->ctx, LOXO_ERR_STOPPED, "sphere: stopped before there was a map");
    }
    loxo_cg_destroy(cg);
    loxo_multigrid_destroy(mg);
    return status;
}

loxo_status sphere_map_harmonic(const sphere_problem *p, sphere_map f, loxo_sphere_info *info)
{
    const int64_t n = p->m.n_vertices;
    double *b = loxo_allocate_zero(p->ctx, 2 * n, sizeof *b);
    double *xy = loxo_allocate_zero(p->ctx, 2 * n, sizeof *xy);
    loxo_status status = b == NULL || xy == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
    if (status >= 0) {
        set_dipole(&p->m, sphere_most_regular_face(p), b, b + n);
        status = solve_plane(p, b, xy, info);
    }
    if (status >= 0) status = put_on_sphere(p, &(plane_map){.x = xy, .y = xy + n}, f);
    loxo_release(p->ctx, xy);
    loxo_release(p->ctx, b);
    if (status < 0) return status;
    return sphere_center(p, f, NULL);
}
