/* SPDX-License-Identifier: MIT
 * Registration of closed surfaces of genus 0: every point of a moving surface gets a point of a fixed one, such that landmarks go to
 * landmarks and angles change little.
 *
 * Both surfaces are mapped to the sphere; the moving one's map f then makes E_C(f) + lambda E_reg(f) small, (6.1), with
 * E_reg = 1 / (2 n) sum over the n landmarks of |f(p) - f_0(q)|^2, (6.2), p and q corresponding points of the moving and the fixed surface, f_0
 * the fixed one's map; of centred maps, unless the settings free them. The inverse of f_0 takes the sphere to the fixed surface.
 *
 * source  Tan, Li, Lin, Yau 2024, A robust Hessian-based trust region algorithm for spherical conformal parameterizations, section 6,
 *         Algorithm 3. What differs: src/solver/sphere/REGISTER.md */
#ifndef LOXO_REGISTER_H
#define LOXO_REGISTER_H

#include <loxo/lines.h>
#include <loxo/locate.h>
#include <loxo/sphere.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct loxo_register loxo_register;

typedef struct loxo_register_settings {
    double lambda; /* weight of the landmarks, >= 0; 0: the moving surface's own map, turned to meet them best */
    int64_t
        n_samples; /* a curve is cut to so many points, evenly spaced in length; 0: curves of as many points on both surfaces
                          are taken point by point, others get as many points as the one that has more */
    loxo_sphere_settings
        sphere; /* how both surfaces are mapped; its tolerance and max_iterations are the registration's, too */
} loxo_register_settings;

LOXO_API loxo_register_settings loxo_register_settings_default(void);

typedef enum loxo_register_phase {
    LOXO_REGISTER_PHASE_MAP,    /* the moving surface's own map */
    LOXO_REGISTER_PHASE_SAMPLE, /* landmarks on both surfaces */
    LOXO_REGISTER_PHASE_MOVE,   /* (6.1) is made small */
    LOXO_REGISTER_PHASE_LOCATE, /* the inverse of the fixed surface's map */
    LOXO_REGISTER_N_PHASES
} loxo_register_phase;

LOXO_API const char *loxo_register_phase_name(loxo_register_phase phase);

typedef struct loxo_register_info {
    /* the head that every info has */
    loxo_sphere_stop stop_reason;
    int64_t n_iterations;  /* steps on (6.1) */
    int64_t n_evaluations; /* of it */
    double objective;      /* E_C + lambda E_reg of the map returned */
    double residual;       /* as the tolerance, at the end */
    double phase_s[LOXO_REGISTER_N_PHASES];
    double total_s;
    size_t workspace_bytes;
    size_t peak_bytes; /* of the context */
    /* the registration */
    int64_t n_linear_steps; /* of conjugate gradients on (6.1) */
    int64_t n_curves;       /* that both surfaces have, by name */
    int64_t n_unpaired;     /* that only one has: left out */
    int64_t n_landmarks;    /* points */
    double energy_start,
        loss_start;      /* E_C and E_reg of the moving surface's own map, turned to meet the landmarks best */
    double energy, loss; /* of the map returned */
    double landmark_max; /* the farthest that a landmark's image is from its target */
    int64_t n_folds;     /* triangles of the map that are turned over */
    int degree;          /* how many times its image covers the sphere */
    int64_t n_held;      /* vertices that were held, since a triangle would have turned over */
    int64_t n_outside;   /* vertices that no triangle of the fixed surface's map holds: they got the nearest point */
    loxo_sphere_info moving; /* of the moving surface's own map */
} loxo_register_info;

/* Prepares a fixed surface, which must outlive the registration: its map to the sphere, and the way back.
 *   landmarks   on it, copied
 *   settings    NULL: the defaults
 *   info        of the fixed surface's map, out, may be NULL
 * returns       LOXO_OK, LOXO_NOT_CONVERGED, LOXO_CHECK_FAILED, as loxo_sphere_solve, with *out set; its failures; LOXO_ERR_ARGUMENT: NULL, a
 *               setting out of its range, no landmark, landmarks as loxo_landmarks_locate refuses them */
LOXO_API loxo_status loxo_register_create(loxo_context *ctx, const loxo_mesh *fixed, const loxo_landmarks *landmarks,
                                          const loxo_register_settings *settings, loxo_sphere_info *info,
                                          loxo_register **out);
LOXO_API void loxo_register_destroy(loxo_register *registration);
/* f_0, [n][3] unit vectors in the order of the fixed mesh's caller; as long as the registration is. */
LOXO_API const double *loxo_register_fixed_map(const loxo_register *registration);

/* Registers a moving surface. Landmarks are paired by name; of several of one name the first with the first and so on.
 *   moving      the mesh; only read by this call
 *   landmarks   on it
 *   map         [n][3] out, f: unit vectors in the order of its caller
 *   point       [n] out, where on the fixed surface each vertex goes, in its caller's vertices; may be NULL
 *   position    [n][3] out, the same as a position; may be NULL
 *   info        out, may be NULL
 * returns       LOXO_OK: every triangle of the map looks outward, and so it is a bijection of the sphere; LOXO_NOT_CONVERGED:
 *               the map as it then was; LOXO_CHECK_FAILED: triangles are turned over, or the degree is not 1; the failures of
 *               loxo_sphere_create and _solve; LOXO_ERR_ARGUMENT: NULL, no landmark has the name of one of the fixed surface, a point is paired
 *               with a curve, or a closed curve with an open one; LOXO_ERR_STOPPED
 * cost          that of the sphere's map, and steps like those of its method newton */
LOXO_API loxo_status loxo_register_solve(loxo_register *registration, const loxo_mesh *moving,
                                         const loxo_landmarks *landmarks, double *map, loxo_surface_point *point,
                                         double *position, loxo_register_info *info);

#ifdef __cplusplus
}
#endif
#endif
