/* SPDX-License-Identifier: MIT
 * Which method, where it is left to the library: from the size of the mesh and the shape of its triangles. */
#include "base/allocate.h"
#include "kernel/layout_kernel.h"
#include "solver/geodesic/geodesic_internal.h"

/* Exact distances of so many vertices take about a tenth of a second, and no memory to speak of. */
#define MOST_FOR_EXACT 20000
/* Edges whose opposite angles add up to more than pi, as a share of the inner ones, from which on an intrinsic triangulation
 * pays. Error of fast as given and intrinsic, by that share: moai 18 %: 0.118 and 0.043 %; camel 12 %: 0.086, 0.038; brain
 * surfaces 11 and 10 %: 0.095, 0.019 and 0.135, 0.037; bimba 10 %: 0.050, 0.039; another brain 9 %: 0.103, 0.092; one 5 %:
 * 0.041, 0.064; igea 3 %: the same. */
#define SHARE_FOR_INTRINSIC 0.08
#define MOST_LOOKED_AT      100000 /* faces */

/* Of the inner edges of faces spread evenly over the mesh. Sums that are not numbers, at flat faces, are not counted as bad. */
static double share_nondelaunay(const loxo_mesh_view *m)
{
    const int64_t stride = m->n_faces / MOST_LOOKED_AT + 1;
    int64_t n_inner = 0, n_bad = 0;
    for (int64_t f = 0; f < m->n_faces; f += stride) {
        double length[3], own[3], other[3];
        k_face_lengths(m, f, length);
        k_cotangents_of(length, own);
        for (int k = 0; k < 3; ++k) {
            const loxo_index twin = m->halfedge_twin[3 * f + k];
            if (twin < 0) continue;
            k_face_lengths(m, twin / 3, length);
            k_cotangents_of(length, other);
            ++n_inner;
            n_bad += own[k] + other[twin % 3] < 0.0;
        }
    }
    return n_inner > 0 ? (double)n_bad / (double)n_inner : 0.0;
}

loxo_geodesic_method geodesic_method_for(int64_t n_vertices)
{
    return n_vertices <= MOST_FOR_EXACT ? LOXO_GEODESIC_EXACT : LOXO_GEODESIC_FAST;
}

loxo_status loxo_geodesic_choose(loxo_context *ctx, const loxo_mesh *mesh, loxo_geodesic_choice *choice)
{
    if (ctx == NULL) return LOXO_ERR_ARGUMENT;
    if (mesh == NULL || choice == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "geodesic: an argument of choose is NULL");
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    *choice = (loxo_geodesic_choice){.method = geodesic_method_for(m.n_vertices)};
    choice->share_nondelaunay = share_nondelaunay(&m);
    if (choice->method == LOXO_GEODESIC_EXACT) {
        choice->reason = "the mesh is small enough for exact distances";
        return LOXO_OK;
    }
    choice->intrinsic = m.halfedge_length == NULL && choice->share_nondelaunay > SHARE_FOR_INTRINSIC;
    choice->reason = choice->intrinsic
                         ? "many edges are not Delaunay: on an intrinsic triangulation it is more accurate"
                         : "the most accurate method of linear time, and the one of least memory";
    return LOXO_OK;
}
