/* SPDX-License-Identifier: MIT
 * Douady and Earle's extension of a closed curve on the unit sphere of R^d to the disk: the value at z is the conformal barycenter of
 * the curve as seen from z, under the harmonic measure of z. Moebius maps of the disk before the curve and of the ball
 * behind it pass through; so the extension of a circle's map to itself is as conformal as it can be, and is one-to-one where
 * the map is.
 *
 * The curve is given by samples at points of the unit circle. Between two of them it is the radial projection of the straight line
 * between both samples, run through as the radial projection of the straight line between both points of the circle: a great arc;
 * samples of a rotation give back that rotation.
 *
 * source  Cantarella, Schumacher 2022, Computing the conformal barycenter, section 6.1; Douady, Earle 1986, Conformally natural
 *         extension of homeomorphisms of the circle. Quadrature, its error and what rests are derived in
 *         src/solver/barycenter/EXTENSION.md */
#ifndef LOXO_EXTENSION_H
#define LOXO_EXTENSION_H

#include <loxo/mesh.h>
#include <loxo/moebius.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct loxo_extension loxo_extension;

/* Every rule of quadrature, its name on the command line and what it is: the one list. */
#define LOXO_EXTENSION_RULE_LIST(X)                                                                                    \
    X(AUTO, auto, "fixed where |z|^(n/2) is below the tolerance and 1e-8, else graded")                                \
    X(GRADED, graded, "moving nodes as dense, relatively, at every distance from z's direction; good at any z")        \
    X(MOVING, moving, "nodes of equal weight, moved with z by its Moebius map, as the paper's")                        \
    X(FIXED, fixed, "nodes that stay, weighted by the Poisson kernel of z; wrong near the circle")

typedef enum loxo_extension_rule {
#define LOXO_EXTENSION_RULE_ROW(NAME, name, help) LOXO_EXTENSION_##NAME,
    LOXO_EXTENSION_RULE_LIST(LOXO_EXTENSION_RULE_ROW)
#undef LOXO_EXTENSION_RULE_ROW
        LOXO_EXTENSION_N_RULES
} loxo_extension_rule;

typedef struct loxo_extension_settings {
    loxo_extension_rule rule;
    int64_t n_nodes;  /* of the quadrature, 16 to 2^20; rounded up to a multiple of 16 */
    double tolerance; /* of the certified hyperbolic distance from the nodes' barycenter; 0: as far as doubles go */
    int64_t max_iterations; /* passes over all nodes for a point */
} loxo_extension_settings;

LOXO_API loxo_extension_settings loxo_extension_settings_default(void); /* auto, 720, 1e-8, 50 */

/* Samples of a closed curve; the caller's. */
typedef struct loxo_curve {
    int64_t n;       /* 3 or more */
    int d;           /* of the space, 2 to LOXO_MOEBIUS_MOST_DIMENSIONS */
    const double *x; /* [n][d] unit vectors within 1e-6, taken as directions; neighbours are not opposite */
    const double *
        angle; /* [n] where on the circle, ascending, steps below pi, the last less than 2 pi from the first; NULL: 2 pi i / n */
} loxo_curve;

/* Prepares a curve, which is copied.
 *   settings   NULL: the defaults
 * returns      LOXO_OK; LOXO_ERR_ARGUMENT: a setting or n or d out of its range, with the number as element: a sample off the
 *              sphere or not finite, opposite to the next one, or an angle out of order; LOXO_ERR_MEMORY
 * cost         linear; 8 (4 d + 3) bytes a sample and 8 (d + 5) a node */
LOXO_API loxo_status loxo_extension_create(loxo_context *ctx, const loxo_curve *curve,
                                           const loxo_extension_settings *settings, loxo_extension **out);
LOXO_API void loxo_extension_destroy(loxo_extension *extension);

/* What a value is. (On the circle: of maps of the sphere, on the sphere.) */
typedef enum loxo_extension_kind {
    LOXO_EXTENSION_INSIDE, /* the barycenter, inside the ball */
    LOXO_EXTENSION_CURVE,  /* z is on the circle: the curve's point there */
    LOXO_EXTENSION_RESTING, /* the curve rests at one point for half of the harmonic measure or more: that point of the sphere */
    LOXO_EXTENSION_OPEN /* the search did not end within the tolerance: where it was last */
} loxo_extension_kind;

/* Results, a row a point; all but w may be NULL. */
typedef struct loxo_extension_values {
    double *w;  /* [n][d] out */
    double *co; /* [n] out, 1 - |w|^2 with its digits, which w has lost near the sphere; 0 on it */
    double *
        bound; /* [n] out, certified hyperbolic distance from the nodes' barycenter; what w's own rounding adds is not in it */
    double *error; /* [n] out, estimate of the quadrature's error, hyperbolic, by what twice the nodes would change */
    unsigned char *kind; /* [n] out, loxo_extension_kind */
} loxo_extension_values;

typedef struct loxo_extension_info {
    int64_t n_points;
    int64_t n_fixed, n_moving,
        n_near; /* by rule; near: moving, so near the circle that nodes are kept as differences */
    int64_t n_curve, n_resting, n_open;
    int64_t n_passes;            /* over all nodes of a point */
    int64_t n_coarse_passes;     /* over an eighth of them, before */
    double bound_max, error_max; /* of the points inside */
    double total_s;
    size_t peak_bytes; /* of the context */
} loxo_extension_info;

/* Values at points of the closed unit disk.
 *   z        [n][2]
 *   co       [n] 1 - |z|^2, for points so near the circle that z has lost it; NULL: from the coordinates,
 *            which within 4e-16 are on it
 *   info     out, may be NULL
 * returns    LOXO_OK; LOXO_NOT_CONVERGED: some are LOXO_EXTENSION_OPEN; LOXO_STOPPED: values from some point on are not there (NaN);
 *            LOXO_ERR_ARGUMENT: with the number as element: a point outside, not finite, or not of its co; LOXO_ERR_MEMORY
 * cost       two to three passes of 0.6 ns a node (d = 3, AVX-512) and the nodes' weights or places; 8 (d + 1) bytes a node and thread. Each
 *            point is worked on alone: same bits for any number of threads, any instruction set, and any other points */
LOXO_API loxo_status loxo_extension_evaluate(loxo_extension *extension, int64_t n, const double *z, const double *co,
                                             const loxo_extension_values *values, loxo_extension_info *info);

/* ---- maps of the sphere ------------------------------------------------------------------------------------------ */

/* A map of the unit sphere of space to that of R^d by the vertices of a mesh; between them it is the direction of a face's linear map. */
typedef struct loxo_sphere_map {
    int64_t n_vertices, n_faces;
    int d;                      /* of the image's space, 2 to LOXO_MOEBIUS_MOST_DIMENSIONS */
    const double *x;            /* [n_vertices][3] vertices on the unit sphere within 1e-6, taken as directions */
    const double *y;            /* [n_vertices][d] where they go, the same */
    const loxo_index *triangle; /* [n_faces][3]: the faces as seen from the centre cover the sphere once */
} loxo_sphere_map;

typedef struct loxo_sphere_extension_settings {
    double piece;           /* longest side of a piece of a face over its distance from z */
    double tolerance;       /* as of the disk */
    int64_t max_iterations; /* of the search, a point */
} loxo_sphere_extension_settings;

LOXO_API loxo_sphere_extension_settings loxo_sphere_extension_settings_default(void); /* 0.5, 1e-8, 50 */

typedef struct loxo_sphere_extension_info {
    int64_t n_points, n_on_sphere, n_resting, n_open;
    int64_t n_nodes;      /* all points together */
    int64_t n_iterations; /* likewise */
    double bound_max;     /* of the points inside */
    double total_s;
    size_t peak_bytes; /* of the context */
} loxo_sphere_extension_info;

/* The extension of such a map at points of the closed unit ball: the conformal barycenter of the map under the harmonic measure of z in
 * hyperbolic space, whose density is ((1 - |z|^2) / |x - z|^2)^2. Faces are cut into pieces that are small as seen from z.
 *   z          [n][3]
 *   co         [n] 1 - |z|^2; NULL: from the coordinates, which within 4e-16 are on the sphere
 *   settings   NULL: the defaults
 *   values     kind LOXO_EXTENSION_CURVE: on the sphere, the map's value; error: NaN, none is made; a kind's and what stands in w is as of the disk
 *   info       out, may be NULL
 * returns      LOXO_OK; LOXO_NOT_CONVERGED: some are LOXO_EXTENSION_OPEN; LOXO_STOPPED: values from some point on are NaN;
 *              LOXO_ERR_ARGUMENT: with the number as element: a point outside, not finite or not of its co; LOXO_ERR_MALFORMED: a
 *              vertex number out of range (element: the face); LOXO_ERR_MESH: a vertex off its sphere (element), or faces that do not
 *              cover the sphere once; LOXO_ERR_MEMORY
 * cost         six nodes a piece, at least a piece a face: some 20 ns a node for each point; 8 (d + 1) bytes a node. |x - z| loses eps / (1 - |z|).
 *              Same bits for any number of threads */
LOXO_API loxo_status loxo_sphere_extension(loxo_context *ctx, const loxo_sphere_map *map,
                                           const loxo_sphere_extension_settings *settings, int64_t n, const double *z,
                                           const double *co, const loxo_extension_values *values,
                                           loxo_sphere_extension_info *info);

#ifdef __cplusplus
}
#endif
#endif
