/* SPDX-License-Identifier: MIT
 * FLASH without landmarks: the plane's harmonic map without a face is wrong around that face; seen from the other pole it is
 * composed with the quasi-conformal map that has the same Beltrami coefficient, the tenth of the vertices farthest from the face
 * held.
 *
 * The equations of that quasi-conformal map are those of L itself. Where g maps a plane triangle of area B, with coefficient mu, to the
 * surface's triangle T, A = 1 / (1 - |mu|^2) [|1 - mu|^2, -2 Im mu; -2 Im mu, |1 + mu|^2] is sqrt(det G) G^-1 with G = J^T J, J the
 * derivative of g: so B grad u . A grad v = |T| grad(u o g^-1) . grad(v o g^-1), the Dirichlet form of T. No coefficient is
 * computed, and both solves have the matrix of all other methods.
 * source  Choi, Lam, Lui 2015, FLASH: Fast Landmark Aligned Spherical Harmonic Parameterization for Genus-0 Closed Brain Surfaces */
#include "base/allocate.h"
#include "par/range.h"
#include "solver/sphere/plane.h"

#include <string.h>

#define HELD_SHARE 10 /* one in so many vertices is held ... */
#define LEAST_HELD 3  /* ... and so many at least */
#define TOLERANCE  1e-8

/* is_held: the vertices nearest to 0. */
static loxo_status hold_nearest(const sphere_problem *p, const plane_map *h, bool *is_held)
{
    const int64_t n = p->m.n_vertices, share = (n + HELD_SHARE / 2) / HELD_SHARE;
    const int64_t n_held = share > LEAST_HELD ? share : LEAST_HELD;
    uint64_t *key = loxo_allocate(p->ctx, n, sizeof *key);
    uint32_t *vertex = loxo_allocate(p->ctx, n, sizeof *vertex);
    loxo_status status = key == NULL || vertex == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
    for (int64_t i = 0; i < n && status >= 0; ++i) {
        const double square = h->x[i] * h->x[i] + h->y[i] * h->y[i];
        memcpy(&key[i], &square, sizeof square); /* bits of numbers that are not negative are in their order */
        vertex[i] = (uint32_t)i;
    }
    if (status >= 0) status = loxo_sort_u64(p->ctx, n, key, vertex, 64);
    for (int64_t i = 0; i < n && status >= 0; ++i)
        is_held[vertex[i]] = i < n_held;
    loxo_release(p->ctx, key);
    loxo_release(p->ctx, vertex);
    return status;
}

/* f: the sphere's map of the harmonic one; is_held: what the second step holds. */
static loxo_status map_without_face(const sphere_problem *p, plane_map *h, bool *is_held, sphere_map f,
                                    loxo_sphere_info *info)
{
    const int64_t face = sphere_most_regular_face(p);
    loxo_status status = plane_map_without_face(p, face, h, info);
    if (status < 0 || (status = plane_balance(p, face, h)) < 0) return status;
    plane_to_sphere(p->ctx, p->m.n_vertices, h, PLANE_NORTH, NULL, f);
    return hold_nearest(p, h, is_held);
}

loxo_status sphere_map_flash(const sphere_problem *p, sphere_map f, loxo_sphere_info *info)
{
    const int64_t n = p->m.n_vertices;
    plane_solver *solver = NULL;
    sphere_energy energy;
    plane_map h;
    bool *is_held = loxo_allocate(p->ctx, n, sizeof *is_held);
    if (is_held == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = plane_map_create(p->ctx, n, &h);
    if (status < 0 || (status = map_without_face(p, &h, is_held, f, info)) < 0) goto done;
    plane_from_sphere(p->ctx, n, (sphere_const_map)f, PLANE_SOUTH, &h);
    if ((status = plane_solver_create(p, is_held, &solver)) < 0) goto done;
    if ((status = plane_solver_solve(solver, TOLERANCE, &h, info)) < 0) goto done;
    info->stop_reason = LOXO_SPHERE_STOP_MONITOR;
    if (status == LOXO_STOPPED) goto done; /* f is the harmonic map */
    plane_to_sphere(p->ctx, n, &h, PLANE_SOUTH, is_held, f);
    info->stop_reason = LOXO_SPHERE_STOP_TOLERANCE;
    info->n_iterations = 1;
    info->residual = 0.0;
    if ((status = sphere_find_energy(p, (sphere_const_map)f, &energy)) < 0) goto done;
    info->n_evaluations += 1;
    info->energy = energy.energy;
done:
    plane_solver_destroy(solver);
    loxo_release(p->ctx, is_held);
    plane_map_destroy(p->ctx, &h);
    return status;
}
