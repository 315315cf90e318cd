/* SPDX-License-Identifier: MIT
 * What the methods for spherical maps take, of a test's surface. */
#ifndef LOXO_TESTS_SOLVER_SPHERE_PROBLEM_H
#define LOXO_TESTS_SOLVER_SPHERE_PROBLEM_H

#include "solver/sphere/sphere_internal.h"
#include "surfaces.h"

/* Freed by sphere_problem_destroy. */
static inline sphere_problem problem_make(const surface *s)
{
    const loxo_mesh_view view = loxo_mesh_get_view(s->mesh);
    const loxo_sphere_settings settings = loxo_sphere_settings_default();
    sphere_problem p;
    CHECK_STATUS(s->ctx, sphere_problem_create(s->ctx, &view, &view, &settings, &p), LOXO_OK);
    return p;
}

#endif
