/* SPDX-License-Identifier: MIT
 * What the methods for spherical maps share. All arrays here are in the mesh's order. */
#ifndef LOXO_SOLVER_SPHERE_INTERNAL_H
#define LOXO_SOLVER_SPHERE_INTERNAL_H

#include "algebra/csr.h"
#include "algebra/multigrid.h"
#include "base/context.h"

#include <loxo/sphere.h>

/* A map: unit vectors [n_vertices]. */
typedef double (*sphere_map)[3];
typedef const double (*sphere_const_map)[3];

/* Of one surface, as loxo_sphere_create leaves it. */
typedef struct sphere_problem {
    loxo_context *ctx;
    loxo_mesh_view m; /* closed, one piece, genus 0; every vertex has faces */
    loxo_sphere_settings settings;
    loxo_csr laplacian; /* L of (3.4) */
    double *area;       /* [n] lumped areas of the surface, sum 1 */
    size_t base_bytes;  /* of the context before there was any of this */
} sphere_problem;

/* weights: of whose triangulation L is, m's own or the intrinsic one. On failure nothing is held. */
loxo_status sphere_problem_create(loxo_context *ctx, const loxo_mesh_view *m, const loxo_mesh_view *weights,
                                  const loxo_sphere_settings *settings, sphere_problem *p);
void sphere_problem_destroy(sphere_problem *p); /* cleared, or destroyed before: nothing */
/* To be called where a method holds most: what the info tells as its workspace. */
void sphere_note_bytes(const sphere_problem *p, loxo_sphere_info *info);
/* Tells the monitor how far a method is, by its info; true when it shall stop. As loxo_progress_tell. */
bool sphere_tell(const sphere_problem *p, const char *phase, bool always, const loxo_sphere_info *info);

/* ---- energy.c: sums over faces and vertices; same bits for any number of threads ------------------------------ */

typedef struct sphere_energy {
    double dirichlet;  /* 1/2 <L f, f>, from differences along edges */
    double image_area; /* signed: a face counts as its side that looks outward does */
    double energy;     /* E_C: the difference */
} sphere_energy;

loxo_status sphere_find_energy(const sphere_problem *p, sphere_const_map f, sphere_energy *out);

typedef struct sphere_folds {
    int64_t n; /* faces whose signed area, by differences of corners, is not positive */
    int degree;
} sphere_folds;

/* is_folded [n_faces] out, may be NULL. */
loxo_status sphere_find_folds(const sphere_problem *p, sphere_const_map f, bool *is_folded, sphere_folds *out);

/* Points of the surface that are drawn to places in space: weight / (2 n) sum_i |sum_k share_ik f(vertex_ik) - target_i|^2,
 * (6.2) times lambda. */
typedef struct sphere_pull {
    int64_t n;
    const loxo_index (*vertex)[3]; /* in the mesh's order; where a share is 0 any */
    const double (*share)[3];
    const double (*target)[3];
    double weight; /* lambda */
} sphere_pull;

/* The sum, without the weight. */
double sphere_pull_loss(const sphere_pull *pull, sphere_const_map f);

/* Moves the area-weighted mean to 0 by a Moebius map; info may be NULL. As loxo_moebius_center. */
loxo_status sphere_center(const sphere_problem *p, sphere_map f, loxo_center_info *info);
/* The face nearest to equilateral, the first of several. */
int64_t sphere_most_regular_face(const sphere_problem *p);

/* ---- the methods: f out, or in and out; info: what they know of it. May return LOXO_NOT_CONVERGED, LOXO_STOPPED. ------ */

/* The harmonic map of all but one face to the plane, and from there to the sphere, centred. */
loxo_status sphere_map_harmonic(const sphere_problem *p, sphere_map f, loxo_sphere_info *info);
loxo_status sphere_map_scem(const sphere_problem *p, sphere_map f, loxo_sphere_info *info);
loxo_status sphere_map_flash(const sphere_problem *p, sphere_map f, loxo_sphere_info *info);
loxo_status sphere_map_cmcf(const sphere_problem *p, sphere_map f, loxo_sphere_info *info);
/* Without folds, whatever the surface; centred where that turns nothing over. */
loxo_status sphere_map_positive(const sphere_problem *p, sphere_map f, loxo_sphere_info *info);
/* f in: where to begin. */
loxo_status sphere_map_hbtr(const sphere_problem *p, sphere_map f, loxo_sphere_info *info);
/* pull NULL: none. With one the map is held centred, too, unless the settings free it: REGISTER.md. */
loxo_status sphere_map_newton(const sphere_problem *p, const sphere_pull *pull, sphere_map f, loxo_sphere_info *info);
/* Mends faces that are turned over. Algorithm 2, and where that leaves some, a new embedding of the patches around them. */
loxo_status sphere_unfold(const sphere_problem *p, sphere_map f, loxo_sphere_info *info);

#endif
