/* SPDX-License-Identifier: MIT
 * Spherical conformal energy minimization: of the plane's harmonic map one hemisphere at a time is made harmonic again, seen from its
 * own pole, while the other one is held.
 * source  Yueh, Li, Lin, Yau 2019, as Tan, Li, Lin, Yau 2024 describe it; what is ours: BASELINES.md */
#include "base/allocate.h"
#include "par/range.h"
#include "solver/sphere/plane.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

/* What is free lies within this of a pole, in the plane of which the equator is at 1; vertices at it are free from both sides. */
#define RADIUS 1.25
/* A choice serves on while all that is free is within the larger, and all that is held outside of the smaller one. */
#define LEAST_RADIUS 1.2
#define MOST_RADIUS  1.3
/* Of each equation. 1e-2 would do for the energy; but errors go where they cost little, to limbs whose images are small, and fold these. */
#define TOLERANCE 1e-6
/* An image that has lost so much of its area is about to shrink to a point, where the energy is 0. */
#define LEAST_AREA 0.5

/* What is seen from one pole. */
typedef struct hemisphere {
    plane_pole pole;
    bool *is_held;        /* [n] */
    plane_solver *solver; /* NULL: none yet */
} hemisphere;

typedef struct scem {
    const sphere_problem *p;
    plane_map h;
    sphere_map next;
    hemisphere side[2];
} scem;

static void release(scem *s)
{
    loxo_context *ctx = s->p->ctx;
    for (int k = 0; k < 2; ++k) {
        plane_solver_destroy(s->side[k].solver);
        loxo_release(ctx, s->side[k].is_held);
    }
    loxo_release(ctx, s->next);
    plane_map_destroy(ctx, &s->h);
}

static loxo_status reserve(scem *s)
{
    const int64_t n = s->p->m.n_vertices;
    for (int k = 0; k < 2; ++k) {
        s->side[k].is_held = loxo_allocate(s->p->ctx, n, sizeof *s->side[k].is_held);
        if (s->side[k].is_held == NULL) return LOXO_ERR_MEMORY;
    }
    if ((s->next = loxo_allocate(s->p->ctx, n, sizeof *s->next)) == NULL) return LOXO_ERR_MEMORY;
    return plane_map_create(s->p->ctx, n, &s->h);
}

/* Chooses what is free; true where the choice before does as well, and stays. */
static bool choose_free(const scem *s, hemisphere *side)
{
    const int64_t n = s->p->m.n_vertices;
    bool is_off = side->solver == NULL;
    const plane_map *h = &s->h;
    if (!is_off) {
#pragma omp parallel num_threads(loxo_threads_for(s->p->ctx, n, 2.0)) reduction(|| : is_off)
        {
            const loxo_range r = loxo_thread_range(n);
            for (int64_t i = r.begin; i < r.end && !is_off; ++i) {
                const double square = h->x[i] * h->x[i] + h->y[i] * h->y[i];
                is_off = side->is_held[i] ? square < LEAST_RADIUS * LEAST_RADIUS : square > MOST_RADIUS * MOST_RADIUS;
            }
        }
    }
    if (!is_off) return true;
#pragma omp parallel num_threads(loxo_threads_for(s->p->ctx, n, 2.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i)
            side->is_held[i] = h->x[i] * h->x[i] + h->y[i] * h->y[i] >= RADIUS * RADIUS;
    }
    return false;
}

/* s->next: f with one hemisphere made harmonic. */
static loxo_status sweep(scem *s, hemisphere *side, sphere_const_map f, loxo_sphere_info *info)
{
    const sphere_problem *p = s->p;
    const int64_t n = p->m.n_vertices;
    loxo_status status;
    plane_from_sphere(p->ctx, n, f, side->pole, &s->h);
    if (!choose_free(s, side)) {
        plane_solver_destroy(side->solver);
        if ((status = plane_solver_create(p, side->is_held, &side->solver)) < 0) return status;
        sphere_note_bytes(p, info);
    }
    if ((status = plane_solver_solve(side->solver, TOLERANCE, &s->h, info)) != LOXO_OK) return status;
    memcpy(s->next, f, (size_t)n * sizeof *s->next);
    plane_to_sphere(p->ctx, n, &s->h, side->pole, side->is_held, s->next);
    status = sphere_center(p, s->next, NULL);
    return status < 0 || status == LOXO_STOPPED ? status : LOXO_OK;
}

static loxo_status iterate(scem *s, sphere_map f, loxo_sphere_info *info)
{
    const sphere_problem *p = s->p;
    sphere_energy before, now;
    loxo_status status = sphere_find_energy(p, (sphere_const_map)f, &before);
    if (status < 0) return status;
    const double least_area = LEAST_AREA * before.image_area;
    info->n_evaluations += 1;
    info->energy = before.energy;
    info->residual = HUGE_VAL;
    info->stop_reason = LOXO_SPHERE_STOP_MAX_ITERATIONS;
    for (int64_t k = 0; k < p->settings.max_iterations; ++k) {
        status = sphere_tell(s->p, "scem", info->n_iterations == 0, info)
                     ? LOXO_STOPPED
                     : sweep(s, &s->side[k % 2], (sphere_const_map)f, info);
        if (status == LOXO_STOPPED || status == LOXO_ERR_STOPPED) {
            info->stop_reason = LOXO_SPHERE_STOP_MONITOR;
            return LOXO_STOPPED;
        }
        if (status < 0) return status;
        if ((status = sphere_find_energy(p, (sphere_const_map)s->next, &now)) < 0) return status;
        info->n_evaluations += 1;
        info->n_iterations = k + 1;
        info->residual = fabs(before.energy - now.energy);
        if (!(now.energy <= before.energy) || now.image_area < least_area) {
            if (k == 0) continue; /* the other hemisphere has had no turn */
            info->stop_reason = LOXO_SPHERE_STOP_RISE;
            return LOXO_OK;
        }
        memcpy(f, s->next, (size_t)p->m.n_vertices * sizeof *f);
        info->energy = now.energy;
        if (k > 0 && info->residual < p->settings.tolerance) {
            info->stop_reason = LOXO_SPHERE_STOP_TOLERANCE;
            return LOXO_OK;
        }
        before = now;
    }
    return loxo_fail(p->ctx, LOXO_NOT_CONVERGED, "scem: the energy still falls by %.3g after %" PRId64 " sweeps",
                     info->residual, info->n_iterations);
}

loxo_status sphere_map_scem(const sphere_problem *p, sphere_map f, loxo_sphere_info *info)
{
    scem s = {.p = p};
    loxo_status status = sphere_map_harmonic(p, f, info);
    info->stop_reason = LOXO_SPHERE_STOP_MONITOR;
    if (status == LOXO_STOPPED || status < 0) return status; /* LOXO_STOPPED: the start */
    /* The face that was left out, where the start is at its worst, was at the north pole. */
    s.side[0].pole = PLANE_NORTH;
    s.side[1].pole = PLANE_SOUTH;
    status = reserve(&s);
    if (status >= 0) status = iterate(&s, f, info);
    release(&s);
    return status;
}
