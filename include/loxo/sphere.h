/* SPDX-License-Identifier: MIT
 * Spherical conformal maps of closed surfaces of genus 0: every vertex gets a point of the unit sphere, such that angles change as
 * little as they can.
 *
 * What is made small is the discrete conformal energy E_C(f) = 1/2 <L f, f> - A(f), (3.3): L the cotangent matrix of the surface,
 * A(f) the area of the flat triangles of the image. Areas are signed here: a triangle that is turned over counts as negative.
 *
 * source  Tan, Li, Lin, Yau 2024, A robust Hessian-based trust region algorithm for spherical conformal parameterizations. What differs,
 *         and the sources of the other methods: src/solver/sphere/README.md */
#ifndef LOXO_SPHERE_H
#define LOXO_SPHERE_H

#include <loxo/center.h>
#include <loxo/mesh.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct loxo_sphere loxo_sphere;

/* Every method, its name on the command line and what it is: the one list. */
#define LOXO_SPHERE_METHOD_LIST(X)                                                                                     \
    X(NEWTON, newton, "least energy of all centred maps, by Newton steps that turn no triangle over")                  \
    X(HBTR, hbtr, "Algorithm 1 of the paper: Newton in angles, trust region of two dimensions")                        \
    X(SCEM, scem, "the plane's harmonic map from the north and from the south, in turns")                              \
    X(FLASH, flash, "one harmonic map, mended by one quasi-conformal map")                                             \
    X(CMCF, cmcf, "conformalised mean curvature flow; slow and robust")

typedef enum loxo_sphere_method {
#define LOXO_SPHERE_METHOD_ROW(NAME, name, help) LOXO_SPHERE_##NAME,
    LOXO_SPHERE_METHOD_LIST(LOXO_SPHERE_METHOD_ROW)
#undef LOXO_SPHERE_METHOD_ROW
        LOXO_SPHERE_N_METHODS
} loxo_sphere_method;

/* "newton", and one line on it; "unknown" outside the list. */
LOXO_API const char *loxo_sphere_method_name(loxo_sphere_method method);
LOXO_API const char *loxo_sphere_method_help(loxo_sphere_method method);

/* What newton and hbtr begin with. */
#define LOXO_SPHERE_START_LIST(X)                                                                                      \
    X(AUTO, auto, "harmonic, and where that folds what is more robust")                                                \
    X(HARMONIC, harmonic, "the plane's harmonic map without one triangle, centred")                                    \
    X(SCEM, scem, "that method's map")                                                                                 \
    X(FLASH, flash, "that method's map")                                                                               \
    X(CMCF, cmcf, "that method's map")                                                                                 \
    X(POSITIVE, positive, "vertices put back one by one, each where nothing folds: of any surface, less conformal")    \
    X(GIVEN, given, "a map that the caller gives")

typedef enum loxo_sphere_start {
#define LOXO_SPHERE_START_ROW(NAME, name, help) LOXO_SPHERE_START_##NAME,
    LOXO_SPHERE_START_LIST(LOXO_SPHERE_START_ROW)
#undef LOXO_SPHERE_START_ROW
        LOXO_SPHERE_N_STARTS
} loxo_sphere_start;

LOXO_API const char *loxo_sphere_start_name(loxo_sphere_start start);

/* How linear systems are solved. */
typedef enum loxo_sphere_factor {
    LOXO_SPHERE_MULTIGRID, /* linear memory and time */
    LOXO_SPHERE_CHOLESKY,  /* factors by CHOLMOD: LOXO_ERR_UNSUPPORTED where that is off */
} loxo_sphere_factor;

typedef struct loxo_sphere_settings {
    loxo_sphere_method method;
    loxo_sphere_start start; /* of newton and hbtr */
    double
        tolerance; /* newton: gradient over that of the start's size, README; hbtr: of (4.4); scem: fall of the energy */
    int64_t max_iterations; /* of the method's outer steps, not of starts */
    loxo_sphere_factor factor;
    bool is_free;     /* newton: the energy alone, without the constraint that the map be centred */
    bool is_unfolded; /* triangles that are turned over at the end are mended */
    bool is_centred;  /* the map is moved by a Moebius map so that its area-weighted mean is 0 */
} loxo_sphere_settings;

LOXO_API loxo_sphere_settings loxo_sphere_settings_default(void);

typedef enum loxo_sphere_stop {
    LOXO_SPHERE_STOP_TOLERANCE,
    LOXO_SPHERE_STOP_ROUNDING, /* no step lowers the energy any more by what doubles can tell */
    LOXO_SPHERE_STOP_MAX_ITERATIONS,
    LOXO_SPHERE_STOP_RISE,    /* scem: the energy rose; the map before stands */
    LOXO_SPHERE_STOP_STALLED, /* newton: no step that turns nothing over lowers the energy; LOXO_NOT_CONVERGED */
    LOXO_SPHERE_STOP_MONITOR,
} loxo_sphere_stop;

LOXO_API const char *loxo_sphere_stop_name(loxo_sphere_stop stop);

typedef enum loxo_sphere_phase {
    LOXO_SPHERE_PHASE_PREPARE, /* in create: the matrix */
    LOXO_SPHERE_PHASE_START,
    LOXO_SPHERE_PHASE_ITERATE,
    LOXO_SPHERE_PHASE_UNFOLD,
    LOXO_SPHERE_PHASE_CENTER,
    LOXO_SPHERE_PHASE_CHECK,
    LOXO_SPHERE_N_PHASES
} loxo_sphere_phase;

LOXO_API const char *loxo_sphere_phase_name(loxo_sphere_phase phase);

typedef struct loxo_sphere_info {
    /* the head that every info has */
    loxo_sphere_stop stop_reason;
    int64_t n_iterations;  /* outer steps of the method, those not taken included */
    int64_t n_evaluations; /* of the energy */
    double objective;      /* E_C of the map returned */
    double residual;       /* as the tolerance, at the end */
    double phase_s[LOXO_SPHERE_N_PHASES];
    double total_s;
    size_t workspace_bytes;
    size_t peak_bytes; /* of the context, the mesh included */
    /* maps */
    loxo_sphere_method method;
    loxo_sphere_start start;  /* the one taken; of methods that need none LOXO_SPHERE_START_AUTO */
    int64_t n_linear_steps;   /* of conjugate gradients, all systems together */
    double energy_start;      /* E_C of the start */
    double energy;            /* E_C before the map was centred, as the paper's tables have it */
    int64_t n_folds_start;    /* triangles turned over, or without area, in the start ... */
    int64_t n_folds_unmended; /* ... when the method was done ... */
    int64_t n_folds;          /* ... and in the map returned */
    int64_t n_held;           /* newton: vertices that were held, since a triangle would have turned over */
    int degree;               /* of the map returned: how many times the image covers the sphere */
    double image_area;        /* A(f), signed */
    loxo_center_info center;  /* of the last step */
} loxo_sphere_info;

/* Prepares maps of a mesh, which must outlive the solver: closed, one piece, genus 0, and no vertex without a face.
 *   settings   NULL: the defaults
 * returns      LOXO_OK; LOXO_ERR_MESH: open, several pieces, of genus > 0, an intrinsic triangulation; LOXO_ERR_ARGUMENT: a setting out of
 *              its range; LOXO_ERR_MEMORY; LOXO_ERR_STOPPED
 * cost         linear */
LOXO_API loxo_status loxo_sphere_create(loxo_context *ctx, const loxo_mesh *mesh, const loxo_sphere_settings *settings,
                                        loxo_sphere **out);
/* The same with the weights L of the intrinsic Delaunay triangulation of the mesh in place of its own: never negative. E_C is then
 * that of L and of the mesh's own triangles, and has no lower bound of 0.
 *   intrinsic   made from mesh; only read by this call */
LOXO_API loxo_status loxo_sphere_create_intrinsic(loxo_context *ctx, const loxo_mesh *mesh, const loxo_mesh *intrinsic,
                                                  const loxo_sphere_settings *settings, loxo_sphere **out);
LOXO_API void loxo_sphere_destroy(loxo_sphere *sphere);

/* Bytes that a solver of these settings takes at most while it works, the mesh not counted; of factors, what is guessed of them. */
LOXO_API loxo_status loxo_sphere_estimate(loxo_context *ctx, int64_t n_vertices, int64_t n_faces,
                                          const loxo_sphere_settings *settings, size_t *bytes);
/* Makes the map.
 *   start    [n][3] a map to begin with, in the caller's order, directions; needed with LOXO_SPHERE_START_GIVEN, else NULL
 *   map      [n][3] out, unit vectors in the caller's order; may be start
 *   info     out, may be NULL
 * returns    LOXO_OK; LOXO_NOT_CONVERGED: max_iterations were not enough; LOXO_CHECK_FAILED: triangles are turned over, or the degree is
 *            not 1 (info tells); LOXO_STOPPED: the map as it then was. Of map nothing is of use with LOXO_ERR_ARGUMENT: a start that is
 *            missing or has a vertex that is 0 or not finite (element); LOXO_ERR_NUMERIC, LOXO_ERR_MEMORY
 * cost       README; same bits for any number of threads but with CHOLMOD's factors */
LOXO_API loxo_status loxo_sphere_solve(loxo_sphere *sphere, const double *start, double *map, loxo_sphere_info *info);

#ifdef __cplusplus
}
#endif
#endif
