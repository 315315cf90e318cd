/* SPDX-License-Identifier: MIT
 * Geodesic distance from one or many sources on a surface: exactly, by a front of rays, or by heat; the library chooses
 * where it is left to it. Paths, nearest sources, farthest points and matrices of distances from it.
 *
 * source  of edge and face: Tao, Zhang, Deng, Fang, Peng, He 2021, Parallel and Scalable Heat Methods for Geodesic Distance Computation,
 *         IEEE TPAMI 43(2), sections 3, 4, 5.1, 5.2. What differs, and the sources of the other methods, is said in
 *         src/solver/geodesic/README.md. */
#ifndef LOXO_GEODESIC_H
#define LOXO_GEODESIC_H

#include <loxo/lines.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct loxo_geodesic loxo_geodesic;

/* Every method, its name on the command line and what it is: the one list. */
#define LOXO_GEODESIC_METHOD_LIST(X)                                                                                   \
    X(EDGE, edge, "parallel heat: its order, and lengths on unfolded faces; or section 4, ADMM on edges")              \
    X(FACE, face, "parallel heat, section 3: gradients on faces; a little more accurate")                              \
    X(EXACT, exact, "polyhedral distances to rounding, by windows; memory grows with the front")                       \
    X(FAST, fast, "a front of rays that moves outward once; an order more accurate than heat, and faster")             \
    X(HEAT, heat, "the heat method of Crane et al.: heat, directions, a Poisson equation")                             \
    X(VARIATIONAL, variational, "the same, then less of the integral of (|grad d| - 1)^2 by ADMM")                     \
    X(AUTO, auto, "exact on small meshes, else fast; a heat method where a setting that only those have is changed")

typedef enum loxo_geodesic_method {
#define LOXO_GEODESIC_METHOD_ROW(NAME, name, help) LOXO_GEODESIC_##NAME,
    LOXO_GEODESIC_METHOD_LIST(LOXO_GEODESIC_METHOD_ROW)
#undef LOXO_GEODESIC_METHOD_ROW
        LOXO_GEODESIC_N_METHODS
} loxo_geodesic_method;

/* "edge", and one line on it; "unknown" outside the list. */
LOXO_API const char *loxo_geodesic_method_name(loxo_geodesic_method method);
LOXO_API const char *loxo_geodesic_method_help(loxo_geodesic_method method);

typedef enum loxo_geodesic_diffusion {
    LOXO_DIFFUSION_MARCHING, /* a window of breadth-first levels moves outward once; stops by tolerance */
    LOXO_DIFFUSION_SWEEPS,   /* the paper's sweeps (7): every level, n_sweeps times; the baseline */
} loxo_geodesic_diffusion;

/* How the edge-based method gets from heat to distances. */
typedef enum loxo_geodesic_recovery {
    LOXO_RECOVERY_AUTO,   /* unfold; ADMM where a setting that only ADMM has is not its default */
    LOXO_RECOVERY_UNFOLD, /* the heat gives the order of the vertices, straight lines across unfolded faces the lengths */
    LOXO_RECOVERY_ADMM,   /* as the paper: directions, the closest integrable field, sums along a tree */
} loxo_geodesic_recovery;

/* How heat and variational solve their equations. */
typedef enum loxo_geodesic_factor {
    LOXO_FACTOR_MULTIGRID, /* linear memory: heat by the marching diffusion, the Poisson equation by multigrid */
    LOXO_FACTOR_CHOLESKY,  /* factors by CHOLMOD, made once: LOXO_ERR_UNSUPPORTED where that is off */
} loxo_geodesic_factor;

typedef struct loxo_geodesic_settings {
    loxo_geodesic_method method; /* LOXO_GEODESIC_AUTO: as loxo_geodesic_choose for one solve */
    /* of edge, face, heat and variational */
    loxo_geodesic_diffusion diffusion;
    double time_factor;         /* m of eq. (28): time = m * (mean edge length)^2; > 0 */
    double diffusion_tolerance; /* directions' change to come (8) when a level is left; unfolding, if not set: 0.1 */
    int64_t n_sweeps;           /* of LOXO_DIFFUSION_SWEEPS */
    loxo_geodesic_recovery recovery; /* of edge; global_constraints are ADMM's whatever it is */
    /* of edge with LOXO_RECOVERY_ADMM, face and variational */
    double penalty;              /* mu of ADMM; > 0 */
    int64_t n_iterations;        /* most ADMM iterations (I_max) */
    double primal_tolerance;     /* epsilon_1, relative to the mean edge length: scale-free */
    double dual_tolerance;       /* epsilon_2, of edge and face */
    loxo_geodesic_factor factor; /* of heat and variational */
    bool
        global_constraints; /* of edge and face, eqs. (23)-(26): cycles of surfaces that are no disk, paths between sources */
    /* of all */
    double max_distance; /* vertices farther than this get infinity; > 0, +infinity: no limit */
    bool nearest;        /* keep the nearest source of each vertex, for loxo_geodesic_nearest: 4 bytes a vertex */
    double
        check_gradient_share; /* result of a heat method fails its check when |grad d| is off 1 by over 10 % on more of the area */
    double check_breach;   /* ... or when the 99th percentile of |d(a) - d(b)| / |ab| - 1 over the edges is more */
    double check_estimate; /* ... or when `fast` estimates its mean relative error at more */
} loxo_geodesic_settings;

LOXO_API loxo_geodesic_settings loxo_geodesic_settings_default(void);

typedef enum loxo_stop_reason {
    LOXO_STOP_TOLERANCE,      /* the tolerances were met */
    LOXO_STOP_MAX_ITERATIONS, /* the iteration count was used up (ADMM: the paper's way of stopping; no failure) */
    LOXO_STOP_MONITOR,        /* the monitor asked */
} loxo_stop_reason;

typedef enum loxo_geodesic_phase {
    LOXO_GEODESIC_PHASE_PREPARE, /* in create: workspace, mean edge length, rows of the heat system, cycles */
    LOXO_GEODESIC_PHASE_LEVELS,  /* breadth-first levels */
    LOXO_GEODESIC_PHASE_DIFFUSION,
    LOXO_GEODESIC_PHASE_GRADIENT, /* directions and what ADMM starts from */
    LOXO_GEODESIC_PHASE_ADMM,
    LOXO_GEODESIC_PHASE_UNFOLD, /* of LOXO_RECOVERY_UNFOLD, in place of the two before and most of the next */
    LOXO_GEODESIC_PHASE_INTEGRATE,
    LOXO_GEODESIC_PHASE_PROPAGATE, /* of methods that move a front outward: fast, exact */
    LOXO_GEODESIC_PHASE_POISSON,   /* heat and variational: the first Poisson equation */
    LOXO_GEODESIC_PHASE_CHECK,
    LOXO_GEODESIC_N_PHASES
} loxo_geodesic_phase;

LOXO_API const char *loxo_geodesic_phase_name(loxo_geodesic_phase phase);

typedef struct loxo_geodesic_info {
    /* the head that every info has */
    loxo_stop_reason stop_reason; /* of ADMM, or LOXO_STOP_MONITOR */
    int64_t n_iterations;         /* ADMM; of LOXO_RECOVERY_UNFOLD passes over the vertices */
    int64_t n_evaluations;        /* vertex updates of the diffusion; exact: windows passed on */
    double objective;             /* (20) or (10) at the end */
    double residual;              /* primal residual at the end, relative */
    double phase_s[LOXO_GEODESIC_N_PHASES];
    double total_s;
    size_t workspace_bytes;
    size_t peak_bytes; /* of the context, the mesh included */
    /* geodesics */
    loxo_geodesic_method method; /* the one that solved; never LOXO_GEODESIC_AUTO */
    double time;                 /* of the diffusion, t = m h^2 */
    double mean_edge_length;     /* h */
    int64_t n_sources;           /* after repeats were merged */
    int64_t n_levels;
    int64_t max_window;       /* most levels in the window at once */
    bool diffusion_converged; /* of marching (where edge unfolds, of each level when it was left); else false */
    double diffusion_change;  /* estimate of the directions' change still to come, eq. (8) */
    double dual_residual;
    int64_t n_constraints;          /* cycles and paths */
    int64_t n_constraints_left_out; /* they would have been longer than the mesh allows */
    double constraint_residual;     /* largest |line integral| over its chain's length at the end */
    /* exact */
    int64_t max_windows; /* most that were kept at once; 48 bytes each */
    int64_t n_bends;     /* times that a vertex at which shortest ways may bend sent windows out */
    /* heat, variational */
    int64_t n_poisson_steps; /* of conjugate gradients, all equations together */
    double poisson_residual; /* of the last equation, relative; over 1e-8 with a warning */
    int64_t n_lost_heat;     /* vertices whose heat is below the range of doubles (factors only) */
    double
        error_estimate; /* fast: of the mean relative error (29) towards exact distances, on the high side; NaN: none is made */
    /* the check of the answer */
    int64_t n_unreached;        /* vertices at infinity: other components, unreferenced ones */
    int64_t n_negative;         /* vertices whose distance is below minus a tenth of the mean edge length */
    int64_t n_nonpositive_heat; /* vertices whose heat was not positive (negative cotangent weights) */
    double breach_percentile_50, breach_percentile_90, breach_percentile_99, breach_max;
    double gradient_share; /* share of the reached area where | |grad d| - 1 | > 0.1 */
    double distance_max;
    bool check_passed;
} loxo_geodesic_info;

/* What to solve with on a mesh, and why. */
typedef struct loxo_geodesic_choice {
    loxo_geodesic_method method;
    bool intrinsic; /* a triangulation by loxo_mesh_create_intrinsic is worth its making: the caller's business */
    double share_nondelaunay; /* of the inner edges, on a sample of the faces: opposite angles add up to more than pi */
    const char *reason;       /* of the method, one line, static storage */
} loxo_geodesic_choice;

/* Puts the method that is to be used in the place of LOXO_GEODESIC_AUTO: of those that have every setting that is not its
 * default, exact on small meshes, else fast, else the first in the list of methods. Another method stays.
 *   n_solves   how many are to come, at least 1; farthest points take as many whole ones as log2 of their number
 * returns      LOXO_OK; LOXO_ERR_ARGUMENT: settings that no one method has */
LOXO_API loxo_status loxo_geodesic_resolve(loxo_context *ctx, int64_t n_vertices, int64_t n_solves,
                                           loxo_geodesic_settings *settings);
/* The same on a mesh, with a look at 100,000 of its faces at most, and why.
 *   settings   NULL: the defaults
 * returns      as loxo_geodesic_resolve; LOXO_ERR_ARGUMENT: a setting out of its range, too */
LOXO_API loxo_status loxo_geodesic_choose(loxo_context *ctx, const loxo_mesh *mesh,
                                          const loxo_geodesic_settings *settings, int64_t n_solves,
                                          loxo_geodesic_choice *choice);

/* Prepares solves on a mesh, for any number of source sets. The mesh must outlive it.
 *   settings   copied; NULL: the defaults
 * returns      LOXO_OK; LOXO_ERR_MESH: no faces, no area; LOXO_ERR_ARGUMENT: a setting out of its range;
 *              LOXO_ERR_MEMORY: before any work, when mesh and workspace exceed the context's limit; LOXO_ERR_STOPPED */
LOXO_API loxo_status loxo_geodesic_create(loxo_context *ctx, const loxo_mesh *mesh,
                                          const loxo_geodesic_settings *settings, loxo_geodesic **out);

/* Distances from a set of source vertices.
 *   sources    [n_sources] caller's vertex numbers, n_sources >= 1, any order, repeats allowed
 *   distance   [n_vertices] out, caller's order, in the mesh's unit; +infinity where no source can be reached
 *   info       out, may be NULL
 * returns      LOXO_OK; LOXO_NOT_CONVERGED: the diffusion did not settle; LOXO_CHECK_FAILED: the answer breaks the
 *              thresholds of the settings; LOXO_STOPPED: by the monitor, distance holds what the state then gives (asked at the very
 *              end, all that there is),
 *              for exact those that were certain, to the bit, the others infinite;
 *              LOXO_ERR_STOPPED: by the monitor before there was any heat; LOXO_ERR_NUMERIC: a distance is not finite;
 *              LOXO_ERR_MEMORY: distance is untouched in all three;
 *              LOXO_ERR_ARGUMENT: no source, or one out of range (element): distance is untouched;
 *              LOXO_ERR_MESH: a source without faces; LOXO_ERR_NUMERIC: distances that are not finite, from heat that
 *              met over ways of very different edge lengths (src/solver/geodesic/parallel_heat/README.md)
 * cost         linear time; same bits for any thread count; allocates nothing that grows with the mesh for one source on
 *              a sphere or disk that is no long strip; for several sources or other surfaces what the global constraints take, and after a
 *              repair the copies of split sources */
LOXO_API loxo_status loxo_geodesic_solve(loxo_geodesic *geodesic, const loxo_index *sources, int64_t n_sources,
                                         double *distance, loxo_geodesic_info *info);

/* Distances from a set of points on the surface, which may lie inside faces and edges.
 *   points     [n_points], n_points >= 1, any order, repeats allowed
 * returns      as loxo_geodesic_solve; LOXO_ERR_ARGUMENT, with the point's number as element: weights that are negative,
 *              not finite or do not add up to 1, a vertex out of range, vertices that are not of one face */
LOXO_API loxo_status loxo_geodesic_solve_points(loxo_geodesic *geodesic, const loxo_surface_point *points,
                                                int64_t n_points, double *distance, loxo_geodesic_info *info);

/* Limits the solves that follow, as settings.max_distance does. Where the method can (edge, face, exact and fast; heat and variational solve
 * the whole and cut), a solve then costs what the ball costs, a margin around it and a pass over the distances; create costs what it does without a limit. LOXO_ERR_ARGUMENT: not above 0, NaN. */
LOXO_API loxo_status loxo_geodesic_limit(loxo_geodesic *geodesic, double max_distance);

/* The nearest source of each vertex, of the last solve: which cell of the geodesic Voronoi diagram it lies in. Where two
 * are as near, within the error of the distances, it is one of them; of sources at one point the first.
 *   source     [n_vertices] out, caller's order: index into that solve's sources or points; -1 where the distance is infinite
 * returns      LOXO_OK; LOXO_ERR_ARGUMENT: no solve yet, or settings.nearest was off; LOXO_ERR_MEMORY */
LOXO_API loxo_status loxo_geodesic_nearest(const loxo_geodesic *geodesic, loxo_index *source);

/* Ways of the last solve, from points of the surface back to their nearest sources: geodesics, straight over every edge and
 * with pi or more on both sides of every vertex that they pass, but at boundaries. Method exact gives the shortest; for the
 * others a way goes down the distances, against the gradient through each face, and is then drawn tight: it is the shortest of
 * those beside it, and near the cut locus may be another geodesic than the shortest.
 *   targets    [n_targets], as sources of loxo_geodesic_solve_points
 *   lines      out: line i begins at target i and ends at a source, its value is the target's distance as solved, linear between
 *              vertices; loxo_polyline_length tells its length. Of a target that no source reaches (another piece of the surface, a vertex
 *              without faces, beyond the limit) it has no points, and infinity as its value. Freed by loxo_polylines_destroy
 * returns      LOXO_OK; LOXO_ERR_ARGUMENT (element: the target): as for sources; before the first solve;
 *              LOXO_ERR_UNSUPPORTED: an intrinsic triangulation (use loxo_geodesic_trace on its surface); LOXO_ERR_MEMORY
 * cost         the lengths of the ways, some rounds over them and 150 bytes a face of the longest, and where the distances have
 *              low points of their own a search around them; method exact
 *              from inside a face: a solve from there as far as the sources are, 65 bytes a vertex once, and a pass over the vertices */
LOXO_API loxo_status loxo_geodesic_paths(loxo_geodesic *geodesic, const loxo_surface_point *targets, int64_t n_targets,
                                         loxo_polylines *lines);
/* The same down distances that are at hand, in the caller's order, to the sources that they are from. */
LOXO_API loxo_status loxo_geodesic_trace(loxo_context *ctx, const loxo_mesh *mesh, const double *distance,
                                         const loxo_surface_point *sources, int64_t n_sources,
                                         const loxo_surface_point *targets, int64_t n_targets, loxo_polylines *lines);

/* Farthest point sampling: to some given vertices the vertex farthest from all of them, and so on. A new point can only be
 * nearer to what is no farther from it than the farthest is now, so each solve is limited to that.
 *   start      [n_start] caller's vertices, n_start >= 1
 *   point      [n_points] out, n_points >= n_start: the given ones first. Of equally far vertices the lowest number
 *   radius     [n_points] out, may be NULL: how far the farthest vertex is from the nearest of the points up to this one;
 *              never grows; infinite while a piece of the surface has none. Of the given ones, that of all of them
 *   distance   [n_vertices] out, may be NULL: to the nearest of all points
 * returns      LOXO_OK; the statuses of solves, the worst of those that are no failures (nothing is checked);
 *              LOXO_ERR_ARGUMENT: n_points < n_start, a vertex out of range, more points than vertices that are apart
 * cost         where solves are limited (edge, face, fast) some log(n_points) whole ones, and two passes over the distances a point;
 *              8 bytes a vertex more */
LOXO_API loxo_status loxo_geodesic_farthest_points(loxo_geodesic *geodesic, const loxo_index *start, int64_t n_start,
                                                   int64_t n_points, loxo_index *point, double *radius,
                                                   double *distance);

/* Distances between points of the surface: matrix[i][j] from point i to point j, by one solve for each i, nothing averaged:
 * how far the matrix is from symmetric tells how far the distances are off. The diagonal is 0. At a point that is no
 * vertex a distance follows from those of its face's corners, straight through the edge before it: with exact, exact where
 * both ends of that edge are lit from one point.
 *   points     [n], as sources of loxo_geodesic_solve_points
 *   matrix     [n][n] out; +infinity where a point does not reach another
 * returns      as loxo_geodesic_farthest_points; LOXO_ERR_NUMERIC: a distance not finite */
LOXO_API loxo_status loxo_geodesic_matrix(loxo_geodesic *geodesic, const loxo_surface_point *points, int64_t n,
                                          double *matrix);

/* As loxo_geodesic_solve, from a heat that is given instead of diffused, as loxo_geodesic_heat returns it: value * 2^scale in the
 * caller's order; scale may be NULL (all 0). For comparisons of diffusions. LOXO_ERR_ARGUMENT: a value not finite. */
LOXO_API loxo_status loxo_geodesic_solve_from_heat(loxo_geodesic *geodesic, const loxo_index *sources,
                                                   int64_t n_sources, const double *value, const int32_t *scale,
                                                   double *distance, loxo_geodesic_info *info);

/* The heat of the last solve, caller's order: sign * 2^scale * value, so that nothing underflows at any width.
 * Where edge unfolds it is as rough as the order of neighbours allows: set recovery or diffusion_tolerance for a better one.
 *   value [n_vertices], scale [n_vertices] out. LOXO_ERR_ARGUMENT before the first solve. */
LOXO_API loxo_status loxo_geodesic_heat(const loxo_geodesic *geodesic, double *value, int32_t *scale);

LOXO_API void loxo_geodesic_destroy(loxo_geodesic *geodesic);

/* create, solve, destroy in one call. */
LOXO_API loxo_status loxo_geodesic_distance(loxo_context *ctx, const loxo_mesh *mesh,
                                            const loxo_geodesic_settings *settings, const loxo_index *sources,
                                            int64_t n_sources, double *distance, loxo_geodesic_info *info);

/* Bytes that create will take, where every vertex has a face: the workspace, boundary edges as the counts suggest them, and
 * with global constraints what finding their cycles takes besides. Seconds of preparing and one solve, from
 * figures measured on another machine: their ratio for two sizes is what carries over to this one. */
LOXO_API loxo_status loxo_geodesic_estimate(loxo_context *ctx, int64_t n_vertices, int64_t n_faces,
                                            const loxo_geodesic_settings *settings, size_t *workspace_bytes,
                                            double *solve_s);

#ifdef __cplusplus
}
#endif
#endif
