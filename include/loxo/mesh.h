/* SPDX-License-Identifier: MIT
 * Triangle meshes: polygon soup as files hold it, its check and repair, and the immutable directed-edge mesh that
 * solvers work on. */
#ifndef LOXO_MESH_H
#define LOXO_MESH_H

#include <loxo/context.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- soup: owned arrays, nothing assumed of them ------------------------------------------------------------- */

/* One named scalar per vertex. */
typedef struct loxo_field {
    char name[64];
    double *value; /* [n_vertices] */
} loxo_field;

/* Triangle soup: what a reader makes and a writer takes. All arrays come from loxo_allocate of the same context.
 * Exactly one of position and position_float is set (the width that the source had), unless n_vertices is 0. */
typedef struct loxo_soup {
    int64_t n_vertices, n_faces;
    double *position;      /* [n_vertices][3] or NULL */
    float *position_float; /* [n_vertices][3] or NULL */
    loxo_index *triangle;  /* [n_faces][3], counter-clockwise, ids in 0..n_vertices-1 */
    int n_fields;
    loxo_field *fields; /* [n_fields], may be NULL */
} loxo_soup;

LOXO_API void loxo_soup_destroy(loxo_context *ctx, loxo_soup *soup); /* frees the arrays and clears the struct */

/* Arrays as a library user holds them; used by check, repair and create. */
typedef struct loxo_mesh_arrays {
    int64_t n_vertices, n_faces;
    const double *position;      /* [n_vertices][3], or NULL if position_float is set */
    const float *position_float; /* [n_vertices][3], or NULL */
    const loxo_index *triangle;  /* [n_faces][3] */
} loxo_mesh_arrays;

LOXO_API loxo_mesh_arrays loxo_soup_arrays(const loxo_soup *soup);

/* ---- check --------------------------------------------------------------------------------------------------- */

/* A kind of fault: how many, and the first offenders, ascending. */
#define LOXO_N_OFFENDERS 8
typedef struct loxo_fault {
    int64_t count;
    int n_first;
    int64_t first[LOXO_N_OFFENDERS]; /* vertex or face numbers */
} loxo_fault;

/* min and max are exact. The others are the numbers of nearest rank, known to one part in 2^20, the same for any
 * number of threads. All 0 when there is nothing to count. */
typedef struct loxo_statistics {
    double min, max, mean, median, percentile_1, percentile_99;
} loxo_statistics;

/* Degenerate faces count in n_faces and in their fault, and take no part in anything else. Shape is that of faces whose
 * corners are finite; faces without area have no angles. */
typedef struct loxo_mesh_report {
    int64_t n_vertices, n_edges, n_faces;
    int64_t n_components; /* pieces of faces that share edges or vertices */
    int64_t n_boundary_edges;
    int64_t n_boundary_loops; /* -1 when non-manifold */
    int64_t euler;            /* referenced vertices - edges + faces */
    int64_t genus;            /* summed over components; -1 when non-manifold or not orientable */
    bool is_manifold, is_orientable, is_oriented, is_closed;
    loxo_fault nonmanifold_edges;    /* first: one of the faces at it */
    loxo_fault nonmanifold_vertices; /* bow ties: the faces at the vertex form more than one fan */
    loxo_fault inconsistent_faces;   /* faces that must be turned so that neighbours agree; orientable meshes */
    loxo_fault duplicate_vertices;   /* bitwise the same position as a vertex of a lower number (-0 equals 0) */
    loxo_fault unreferenced_vertices;
    loxo_fault degenerate_faces; /* a vertex repeated */
    loxo_fault zero_area_faces;  /* three vertices, no area */
    loxo_fault duplicate_faces;  /* the same three vertices as a face of a lower number, either orientation */
    loxo_fault nonfinite_vertices;
    double area;   /* of all faces */
    double volume; /* signed; 0 for meshes that are open or not oriented */
    double bounding_box[2][3];
    loxo_statistics edge_length;
    loxo_statistics angle_rad;       /* of all corners */
    double share_obtuse;             /* of the faces */
    double share_nondelaunay;        /* of the interior edges: opposite angles sum to more than pi */
    double share_negative_cotangent; /* of the edges: cot a + cot b < 0, of boundary edges cot a < 0; not by rounding */
    double quality; /* tau of eq. (27), parallel heat paper: mean of 2 sqrt(3) inradius / longest edge */
} loxo_mesh_report;

/* Looks at arrays and reports; changes nothing.
 * returns  LOXO_OK, whatever was found; LOXO_ERR_ARGUMENT (NULL, negative counts, both or no positions);
 *          LOXO_ERR_MALFORMED (a vertex number out of range: element is the face); LOXO_ERR_MEMORY; LOXO_ERR_STOPPED
 * cost     linear time; about 60 bytes a vertex of workspace */
LOXO_API loxo_status loxo_mesh_check(loxo_context *ctx, const loxo_mesh_arrays *arrays, loxo_mesh_report *report);

/* A third of the areas of the faces around each vertex, added up in the order of the faces. Nothing else is asked of the mesh.
 *   area     [n_vertices] out; 0 where there are no faces
 * returns  LOXO_OK; LOXO_ERR_ARGUMENT (NULL, negative counts, both or no positions); LOXO_ERR_MALFORMED (a vertex number out of
 *          range: element is the face); LOXO_ERR_MESH (an area that is not finite: element is the vertex); LOXO_ERR_LIMIT;
 *          LOXO_ERR_MEMORY
 * cost     linear; where neighbours have numbers far apart every thread looks at every face. Same bits for any number of threads */
LOXO_API loxo_status loxo_mesh_vertex_areas(loxo_context *ctx, const loxo_mesh_arrays *arrays, double *area);

/* ---- repair -------------------------------------------------------------------------------------------------- */

typedef struct loxo_repair_settings {
    bool weld;                 /* exact duplicate vertices become one */
    bool drop_duplicate_faces; /* keeps the one of the lowest number */
    bool split_nonmanifold;    /* vertices and edges: the surface is cut open there */
    bool drop_unreferenced;    /* vertices without a face */
} loxo_repair_settings;

LOXO_API loxo_repair_settings loxo_repair_settings_default(void); /* the first three on, the last off */

typedef struct loxo_repair_info {
    int64_t n_degenerate_dropped; /* harmless: always done */
    int64_t n_faces_turned;       /* harmless: always done */
    int64_t n_vertices_welded;
    int64_t n_duplicate_faces_dropped;
    int64_t n_vertices_split; /* copies added */
    int64_t n_unreferenced_dropped;
} loxo_repair_info;

/* Mends soup in place. What is harmless (degenerate faces dropped, inconsistent orientation turned) is always done and
 * leaves a counted warning; the rest as the settings ask. vertex_origin, when not NULL, receives a new array
 * [soup->n_vertices] from loxo_allocate: for every vertex of the result, its number before. Fields follow.
 * returns  LOXO_OK (nothing had to change), LOXO_REPAIRED, LOXO_ERR_MESH (not orientable), LOXO_ERR_MALFORMED,
 *          LOXO_ERR_ARGUMENT, LOXO_ERR_MEMORY, LOXO_ERR_STOPPED: soup is then as it was */
LOXO_API loxo_status loxo_soup_repair(loxo_context *ctx, loxo_soup *soup, const loxo_repair_settings *settings,
                                      loxo_index **vertex_origin, loxo_repair_info *info);

/* Midpoint subdivision, one triangle into four, n_times over: the surface and its metric stay the same, old vertices
 * keep their numbers, fields are averaged. Degenerate faces are dropped with a counted warning. LOXO_ERR_LIMIT when the
 * ids run out, LOXO_ERR_ARGUMENT, LOXO_ERR_MALFORMED: the soup is as it was; LOXO_ERR_MEMORY, LOXO_ERR_STOPPED: it holds
 * the last subdivision that was finished. */
LOXO_API loxo_status loxo_soup_subdivide(loxo_context *ctx, loxo_soup *soup, int n_times);
/* Renumbers vertices and faces at random (seeded); vertex_origin as in loxo_soup_repair, may be NULL. */
LOXO_API loxo_status loxo_soup_shuffle(loxo_context *ctx, loxo_soup *soup, uint64_t seed, loxo_index **vertex_origin);

/* ---- mesh ---------------------------------------------------------------------------------------------------- */

typedef struct loxo_mesh loxo_mesh;

/* Order of vertices and faces in memory. Results always come back in the caller's order. */
typedef enum loxo_order {
    LOXO_ORDER_AUTO, /* as given if that is local enough, else Hilbert */
    LOXO_ORDER_GIVEN,
    LOXO_ORDER_MORTON,
    LOXO_ORDER_HILBERT,
    LOXO_ORDER_BFS,
    LOXO_ORDER_METIS,    /* parts by METIS, breadth-first inside; LOXO_ERR_UNSUPPORTED where METIS is off */
    LOXO_ORDER_METIS_ND, /* METIS nested dissection */
} loxo_order;

typedef struct loxo_mesh_settings {
    loxo_order order;
    size_t part_bytes; /* size of a part's data; 0: what fits one core's L2 */
    bool repair;       /* as loxo_soup_repair with its defaults; vertices that were split share their result */
} loxo_mesh_settings;

LOXO_API loxo_mesh_settings loxo_mesh_settings_default(void);

/* Plain arrays of a mesh, in its own order. Directed edges: half-edge h = 3 f + c runs from corner c of face f to the
 * next corner; face(h) = h / 3; next and previous are arithmetic. One of position and position_float is set. */
typedef struct loxo_mesh_view {
    int64_t n_vertices, n_faces;
    const double (*position)[3];
    const float (*position_float)[3];
    const loxo_index *halfedge_vertex; /* [3 n_faces] where it starts */
    const loxo_index *halfedge_twin;   /* [3 n_faces] -1 at a boundary */
    const loxo_index *vertex_halfedge; /* [n_vertices] a half-edge that starts there, -1 without faces; at a boundary
                                          vertex the one without a twin, so that turning counter-clockwise
                                          (h = twin(previous(h))) from it meets every face */
    const loxo_index *vertex_origin;   /* [n_vertices] the caller's number; NULL: the same */
    const double *halfedge_length;   /* [3 n_faces] of an intrinsic triangulation, twins alike: its edges are geodesics
                                          of the surface, not chords between positions; an edge may then join a vertex
                                          to itself, and a face its own neighbour. Faces of a part
                                          may then have corners of another only. NULL: straight edges */
    int64_t genus, n_boundary_loops; /* summed over the components; -1: not known */
    int64_t n_parts;
    const int64_t *part_vertex; /* [n_parts + 1] parts are ranges of vertices ... */
    const int64_t *part_face;   /* [n_parts + 1] ... and of faces */
} loxo_mesh_view;

typedef struct loxo_mesh_info {
    loxo_order order; /* the one taken */
    int64_t n_components, n_boundary_loops, euler, genus;
    int64_t n_unreferenced;
    loxo_repair_info repair; /* degenerate faces dropped and faces turned even without repair asked */
    size_t mesh_bytes;       /* half-edges and positions */
    size_t order_bytes;      /* permutation and parts on top */
    size_t peak_bytes;       /* most that was allocated while building, the mesh included */
    double reorder_s, halfedge_s, total_s;
} loxo_mesh_info;

/* Builds the directed-edge mesh. Degenerate faces are dropped and inconsistently oriented ones turned (in each
 * component the fewer), with counted warnings; boundaries, several components, unreferenced vertices and no faces at all
 * are legal and warned of.
 *   arrays     the caller's; LOXO_ADOPT and LOXO_BORROW are for positions and triangles alike; after LOXO_ADOPT they
 *              belong to the mesh (or are freed), also when the call fails. Borrowed arrays are never written: what an
 *              order or a repair changes is copied
 *   settings   may be NULL: the defaults
 * Results per vertex are always given for the caller's vertices. The mesh's own may be others: view.vertex_origin[i] is
 * the caller's number of vertex i (NULL: the same numbers). After a repair, vertices that were welded share one vertex
 * of the mesh and one result; of a vertex that was split every copy has that vertex as its origin, and the smallest of
 * their results is given; a caller's number given to a solver means the first copy.
 *   info       out, may be NULL
 * returns      LOXO_OK; LOXO_REPAIRED (settings->repair changed the surface);
 *              LOXO_ERR_MESH: non-manifold edge or vertex, not orientable (element is the face or vertex);
 *              LOXO_ERR_MALFORMED: vertex number out of range, coordinate not finite at a vertex that a face uses;
 *              LOXO_ERR_LIMIT: 3 n_faces or n_vertices over LOXO_INDEX_MAX; LOXO_ERR_MEMORY: before any work when the
 *              estimate exceeds the limit; LOXO_ERR_ARGUMENT; LOXO_ERR_STOPPED
 * cost         linear time; the mesh takes 76 bytes a vertex (64 with float positions), the peak is at most twice that */
LOXO_API loxo_status loxo_mesh_create(loxo_context *ctx, const loxo_mesh_arrays *arrays, loxo_ownership ownership,
                                      const loxo_mesh_settings *settings, loxo_mesh_info *info, loxo_mesh **out);
LOXO_API void loxo_mesh_destroy(loxo_mesh *mesh);
LOXO_API int64_t loxo_mesh_n_vertices(const loxo_mesh *mesh); /* of the caller's arrays */
LOXO_API int64_t loxo_mesh_n_faces(const loxo_mesh *mesh);    /* after degenerate ones were dropped */
LOXO_API loxo_mesh_view loxo_mesh_get_view(const loxo_mesh *mesh);
/* The mesh's own number of every caller's vertex, [loxo_mesh_n_vertices] out: of a welded one that of the vertex it
 * became, of a split one that of its first copy. LOXO_OK, LOXO_ERR_ARGUMENT (NULL). */
LOXO_API loxo_status loxo_mesh_vertex_order(const loxo_mesh *mesh, loxo_index *original_to_mesh);
/* Which connected piece of the surface every caller's vertex lies in.
 *   component      [loxo_mesh_n_vertices] out: numbers from 0 on, in the order of their lowest vertices; -1: a vertex without
 *                  faces. Of a vertex that a repair has split, that of its first copy
 *   n_components   out, may be NULL
 * returns          LOXO_OK; LOXO_ERR_ARGUMENT (NULL); LOXO_ERR_MEMORY: 4 bytes a vertex for its time
 * cost             a pass over the faces */
LOXO_API loxo_status loxo_mesh_components(const loxo_mesh *mesh, loxo_index *component, int64_t *n_components);
/* A point on the surface: a barycentric combination of up to three of the caller's vertices, of one face. */
typedef struct loxo_surface_point {
    loxo_index vertex[3]; /* -1 where unused */
    double weight[3];     /* of each; >= 0, sum 1 within 1e-6 (then made 1 exactly); not looked at where unused */
} loxo_surface_point;

/* The points of the surface nearest to points of space, over all faces.
 *   position   [n][3]
 *   point      [n] out; corners with a weight, in the order of the face
 *   away       [n] out, how far each is; may be NULL
 * returns      LOXO_OK; LOXO_ERR_ARGUMENT: NULL, a position that is not finite (element: which), an intrinsic triangulation;
 *              LOXO_ERR_MESH: no faces; LOXO_ERR_MEMORY; LOXO_ERR_STOPPED
 * cost         some 5 ns a face and point, on all threads; of equally near faces the first is taken */
LOXO_API loxo_status loxo_mesh_nearest_points(const loxo_mesh *mesh, int64_t n, const double (*position)[3],
                                              loxo_surface_point *point, double *away);
/* Values at points of what is linear on every face: sums of the weights times the values at the vertices.
 *   field    [n_vertices][n_columns]
 *   value    [n][n_columns] out
 * returns    LOXO_OK; LOXO_ERR_ARGUMENT: NULL, a negative count, a vertex out of range (element: which point) */
LOXO_API loxo_status loxo_surface_interpolate(loxo_context *ctx, int64_t n, const loxo_surface_point *point,
                                              int64_t n_vertices, int64_t n_columns, const double *field,
                                              double *value);
/* Bytes that loxo_mesh_create will hold and need at its peak, at most: LOXO_ORDER_AUTO may turn out to need no
 * permutation. Nothing is allocated. */
LOXO_API loxo_status loxo_mesh_estimate(int64_t n_vertices, int64_t n_faces, bool is_float,
                                        const loxo_mesh_settings *settings, size_t *mesh_bytes, size_t *peak_bytes);

/* ---- intrinsic Delaunay triangulation ------------------------------------------------------------------------- */

typedef struct loxo_intrinsic_settings {
    int64_t max_flips;     /* at most so many; 0: as many as it takes */
    double flip_tolerance; /* flipped is where the cotangents of the opposite angles sum to less than minus this */
    double mollify;        /* where the excess of a face's shorter sides over its longest is less than this, in mean
                              edge lengths, all edges are made longer by what is missing */
    bool traceable;        /* keep the way to the surface and back: 48 bytes a vertex */
} loxo_intrinsic_settings;

LOXO_API loxo_intrinsic_settings loxo_intrinsic_settings_default(void); /* 0, 1e-10, 1e-9, true */

typedef struct loxo_intrinsic_info {
    int64_t n_edges, n_flips;
    double share_nondelaunay_before, share_nondelaunay_after; /* of the interior edges, by flip_tolerance */
    double quality_before, quality_after; /* tau of eq. (27), parallel heat paper, by the lengths of the edges */
    double lengthened;                    /* what was added to every edge so that no face is flat; 0: nothing */
    int64_t n_loops;                      /* edges of the result from a vertex to itself */
    size_t mesh_bytes;                    /* of the result, on top of the surface's */
    size_t peak_bytes;                    /* most that was allocated on top of it while flipping */
    double seconds;
} loxo_intrinsic_info;

/* The intrinsic Delaunay triangulation of a mesh's surface: the same vertices, joined by other straight lines on the
 * surface, which may cross its edges, so that the angles opposite each interior edge sum to at most pi: its cotangent
 * weight is not negative. Edges are flipped until that holds. Distances, areas and angles on the surface stay what they are,
 * up to rounding (and `lengthened`). Boundary edges stay. The result's view has halfedge_length.
 *   surface   must outlive the result, which borrows its positions and its order: vertices keep their numbers, in the mesh's order
 *             and in the caller's; faces have new corners, each near where it was in memory
 *   settings  may be NULL: the defaults
 *   info      out, may be NULL
 * returns     LOXO_OK; LOXO_NOT_CONVERGED: max_flips were not enough, the result is a triangulation of the surface all
 *             the same; LOXO_ERR_MESH: edge lengths too large or small to compute with; LOXO_ERR_ARGUMENT (NULL, a setting
 *             out of range, a mesh that is intrinsic already); LOXO_ERR_LIMIT; LOXO_ERR_MEMORY; LOXO_ERR_STOPPED
 * cost        linear in practice, quadratic at worst; one thread flips. 100 bytes a vertex, 48 more when traceable, and
 *             48 while it works. The bits do not depend on the number of threads. Where four vertices lie on a circle either
 *             diagonal will do; which one is taken depends on the order of the faces, nothing else does
 * source      Bobenko, Springborn 2007, A Discrete Laplace-Beltrami Operator for Simplicial Surfaces; Fisher, Springborn,
 *             Schroeder, Bobenko 2007, An Algorithm for the Construction of Intrinsic Delaunay Triangulations; Sharp,
 *             Crane 2020, A Laplacian for Nonmanifold Triangle Meshes (mollification) */
LOXO_API loxo_status loxo_mesh_create_intrinsic(loxo_context *ctx, const loxo_mesh *surface,
                                                const loxo_intrinsic_settings *settings, loxo_intrinsic_info *info,
                                                loxo_mesh **out);
/* Bytes that loxo_mesh_create_intrinsic holds and needs at its peak, on top of the surface. Nothing is allocated. */
LOXO_API void loxo_mesh_estimate_intrinsic(int64_t n_vertices, int64_t n_faces, const loxo_intrinsic_settings *settings,
                                           size_t *mesh_bytes, size_t *peak_bytes);

/* ---- generate ------------------------------------------------------------------------------------------------ */

typedef enum loxo_shape {
    LOXO_SHAPE_ICOSPHERE, /* unit sphere, icosahedron split to any frequency */
    LOXO_SHAPE_LATLONG,   /* unit sphere, meridians and parallels */
    LOXO_SHAPE_ELLIPSOID, /* icosphere times (1, 0.8, 0.6) or params */
    LOXO_SHAPE_TORUS,     /* radii 1 and 0.4 or params */
    LOXO_SHAPE_GENUS,     /* closed surface of genus params[0] */
    LOXO_SHAPE_BUMPY,     /* the bumpy sphere of the benchmarks */
    LOXO_SHAPE_NOISY,     /* icosphere, vertices moved at random by params[0] mean edge lengths, seeded */
    LOXO_SHAPE_DISK,      /* flat unit disk */
    LOXO_SHAPE_GRID,      /* flat unit square */
    LOXO_SHAPE_STRIP,     /* flat strip one quad wide, unit squares */
    LOXO_SHAPE_CYLINDER,  /* open, radius 1, height 2 or params */
    LOXO_SHAPE_ANNULUS,   /* flat, radii 0.5 and 1 or params */
    LOXO_SHAPE_BRAIN,     /* folded sphere, seeded */
    LOXO_N_SHAPES
} loxo_shape;

typedef struct loxo_generate_settings {
    loxo_shape shape;
    int64_t n_vertices; /* wanted; the result has the nearest number that the shape can have */
    uint64_t seed;
    double params[4]; /* of the shape; NaN: its default */
} loxo_generate_settings;

LOXO_API loxo_generate_settings loxo_generate_settings_default(void);
LOXO_API const char *loxo_shape_name(loxo_shape shape);                  /* "icosphere", ... */
LOXO_API const char *loxo_shape_help(loxo_shape shape);                  /* one line with its params */
LOXO_API bool loxo_shape_from_name(const char *name, loxo_shape *shape); /* false: no such shape */

/* Makes the arrays. Positions are float when is_float. */
LOXO_API loxo_status loxo_generate(loxo_context *ctx, const loxo_generate_settings *settings, bool is_float,
                                   loxo_soup *soup);
/* Makes it and writes binary PLY as it goes: memory does not grow with the mesh. Atomic as all writers; the bits are those
 * of loxo_generate. n_vertices, n_faces: out, may be NULL. */
LOXO_API loxo_status loxo_generate_to_ply(loxo_context *ctx, const loxo_generate_settings *settings, bool is_float,
                                          const char *path, int64_t *n_vertices, int64_t *n_faces);
/* Distance on the smooth shape from vertex `source` to every vertex, where a closed form is known: icosphere, latlong
 * (sphere), cylinder, disk and grid and strip (flat, convex), annulus.
 * returns  LOXO_ERR_UNSUPPORTED where none is known */
LOXO_API loxo_status loxo_generate_exact_distance(loxo_context *ctx, const loxo_generate_settings *settings,
                                                  const loxo_soup *soup, loxo_index source, double *distance);

#ifdef __cplusplus
}
#endif
#endif
