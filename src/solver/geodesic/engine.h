/* SPDX-License-Identifier: MIT
 * What a method of geodesic distance is to geodesic.c, and what it is given: one table of functions a method. */
#ifndef LOXO_SOLVER_GEODESIC_ENGINE_H
#define LOXO_SOLVER_GEODESIC_ENGINE_H

#include "base/context.h"
#include "mesh/mesh_internal.h"

#include <loxo/geodesic.h>

/* Where a solve starts: a point of the surface, in the mesh's own numbers. Sorted by vertex, then by face, without
 * repeats. A point on an edge or at a vertex names any one face that has it. */
typedef struct geodesic_seed {
    loxo_index vertex; /* the vertex that it is, -1 when it is inside a face or an edge */
    loxo_index face;
    double weight[3];  /* barycentric, of the face's corners; >= 0, sum 1 */
    loxo_index source; /* number of the caller's source, the lowest where several are one point */
} geodesic_seed;

struct line_builder; /* mesh/lines/builder.h */

/* What all methods share; lives as long as the solver, at one place. settings.max_distance may be another in each solve:
 * look it up there. */
typedef struct geodesic_problem {
    loxo_context *ctx;
    const loxo_mesh *mesh;
    loxo_mesh_view m;
    loxo_geodesic_settings settings;
    double mean_edge_length;
    double area;
    int64_t n_boundary_edges;
} geodesic_problem;

/* Arrays are in the mesh's order. */
typedef struct geodesic_engine {
    /* Workspace of create. In problem only ctx, m's counts, n_boundary_edges and settings are set. */
    size_t (*bytes)(const geodesic_problem *problem);
    /* Nanoseconds of create and a solve a vertex, one thread, measured at 1M vertices; a vertex of n costs (n / 1M)^growth
     * times that. For estimates. */
    double vertex_ns, growth;
    /* Everything that no source changes. *state is set also on failure, and destroyed by the caller. */
    loxo_status (*create)(const geodesic_problem *problem, void **state);
    /* distance [n_vertices] out, +infinity where nothing reaches or beyond settings.max_distance; nearest [n_vertices] out,
     * geodesic_seed.source of the seed that is nearest, -1 where there is none; NULL: not wanted. Of info it fills what
     * is its own, workspace_bytes too; total_s, peak_bytes, what concerns sources and the check are the caller's. A
     * distance that came out not finite is left as NaN: the check refuses it. Negative status: outputs are undefined;
     * LOXO_STOPPED, LOXO_NOT_CONVERGED, after loxo_fail: usable. */
    loxo_status (*solve)(void *state, const geodesic_seed *seeds, int64_t n_seeds, double *distance,
                         loxo_index *nearest, loxo_geodesic_info *info);
    void (*destroy)(void *state); /* NULL is fine */

    /* The distances are lengths of ways: faces that are coarse, compared with how the front bends, may show any gradient,
     * so the check of the answer counts breaches only. */
    bool is_of_ways;

    /* The rest may be NULL. */

    /* Room for n_vertices distances inside the workspace, which stands until the next solve and which solve may be given
     * as distance; without it such an array is allocated once. */
    double *(*room)(void *state);
    /* The vertices that the last solve may have given a distance, ascending, for methods that keep a list of them: what is
     * done with the distances then costs as little as the solve. It stands until the next solve. NULL: all of them. */
    const loxo_index *(*touched)(void *state, int64_t *n);
    /* The shortest way of the last solve from a point to its nearest source, for methods that know it: adds its points, the
     * point first, the source last, without ending the line. Of others it is traced down the distances. */
    loxo_status (*trace)(void *state, const geodesic_seed *from, struct line_builder *builder);
    /* Of methods that diffuse heat: loxo_geodesic_heat, and a heat that the next solve takes instead of diffusing.
     * LOXO_ERR_ARGUMENT: no heat yet; not finite. */
    loxo_status (*heat)(const void *state, double *value, int32_t *scale);
    loxo_status (*give_heat)(void *state, const double *value, const int32_t *scale);
} geodesic_engine;

/* nearest.c: for methods that do not carry the sources along: nearest [n_vertices] out, from distances in the mesh's order.
 * Allocates 32 bytes a vertex for its time. LOXO_OK, LOXO_ERR_MEMORY, LOXO_ERR_STOPPED. */
loxo_status geodesic_label_nearest(const geodesic_problem *problem, const geodesic_seed *seeds, int64_t n_seeds,
                                   const double *distance, loxo_index *nearest);

/* One a method: geodesic_engine_edge and so on. */
#define GEODESIC_ENGINE_ROW(NAME, name, help) extern const geodesic_engine geodesic_engine_##name;
LOXO_GEODESIC_METHOD_LIST(GEODESIC_ENGINE_ROW)
#undef GEODESIC_ENGINE_ROW

#endif
