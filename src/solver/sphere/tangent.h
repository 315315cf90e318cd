/* SPDX-License-Identifier: MIT
 * The energy that newton makes small, as a function of unit vectors: its value, gradient and Hessian in tangent vectors, and what
 * preconditions it. README.md derives all of it. */
#ifndef LOXO_SOLVER_SPHERE_TANGENT_H
#define LOXO_SOLVER_SPHERE_TANGENT_H

#include "algebra/cholesky.h"
#include "solver/sphere/sphere_internal.h"

typedef struct sphere_tangent {
    const sphere_problem *p;
    const sphere_pull *pull; /* NULL: none */
    bool is_gauged;          /* held at sum of A_i f_i = 0 */
    double multiplier[3], mean[3];
    double shift;       /* of the Hessian, times L: shorter steps, as smooth */
    sphere_const_map f; /* where the rest was made */
    sphere_map normal;  /* [n_faces] k_image_face */
    double (*cotangent)[3];
    sphere_map gradient; /* [n] tangent */
    double *radial;      /* [n] what of the gradient points outward */
    bool *is_held;       /* [n] vertices that stay where they are */
    loxo_multigrid *multigrid;
    loxo_cholesky *cholesky;
    loxo_csr shifted; /* what it was made of: L, with a diagonal of its own */
    double precondition_scale;
    loxo_status failure; /* of a solve with the factor; the next product returns it */
    double *r, *z;       /* [n] */
} sphere_tangent;

/* The preconditioner is that of L and of the image's areas in f. */
loxo_status sphere_tangent_create(const sphere_problem *p, const sphere_pull *pull, sphere_const_map f,
                                  sphere_tangent *t);
void sphere_tangent_destroy(sphere_tangent *t);
size_t sphere_tangent_bytes(int64_t n_vertices, int64_t n_faces); /* without the preconditioner */

/* newton.c: with the vectors of the steps. */
size_t sphere_newton_bytes(int64_t n_vertices, int64_t n_faces);

/* Goes to f: gradient, multipliers and all that products with the Hessian there need. */
loxo_status sphere_tangent_go(sphere_tangent *t, sphere_const_map f);
/* What is made small, at any g, with the multipliers of the last go. */
loxo_status sphere_tangent_value(const sphere_tangent *t, sphere_const_map g, sphere_energy *energy, double *value);
/* state is the sphere_tangent; v and hv tangent vectors [n][3]: callbacks of loxo_quadratic. */
loxo_status sphere_tangent_hessian(void *state, const double *v, double *hv);
void sphere_tangent_precondition(void *state, const double *r, double *z);

#endif
