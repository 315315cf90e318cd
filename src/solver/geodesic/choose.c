/* SPDX-License-Identifier: MIT
 * Which method, where it is left to the library: from the settings, the size of the mesh and the
 * shape of its triangles. */
#include "base/allocate.h"
#include "base/options.h"
#include "kernel/layout_kernel.h"
#include "solver/geodesic/geodesic_internal.h"

#include <math.h>

/* Exact distances of so many vertices take less than a tenth of a second, and no memory to speak of. */
#define MOST_FOR_EXACT 20000
/* Vertices times solves: some seconds. Fast takes a tenth of that. */
#define MOST_FOR_EXACT_IN_ALL 2000000
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
            const double sum = own[k] + other[twin % 3], size = 1.0 + fabs(own[k]) + fabs(other[twin % 3]);
            n_bad += sum < -1e-9 * size; /* rectangles are not bad */
        }
    }
    return n_inner > 0 ? (double)n_bad / (double)n_inner : 0.0;
}

loxo_status loxo_geodesic_resolve(loxo_context *ctx, int64_t n_vertices, int64_t n_solves,
                                  loxo_geodesic_settings *settings)
{
    if (ctx == NULL) return LOXO_ERR_ARGUMENT;
    if (settings == NULL || n_vertices < 0 || n_solves < 1)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "geodesic: no settings, vertices or solves to choose a method for");
    if (settings->method != LOXO_GEODESIC_AUTO) return LOXO_OK;
    const uint32_t methods = geodesic_methods_of(settings);
    const bool is_small = n_vertices <= MOST_FOR_EXACT && n_solves <= MOST_FOR_EXACT_IN_ALL / (n_vertices + 1);
    if (methods == 0)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "geodesic: no method has everything that the settings ask for");
    if ((methods & 1U << LOXO_GEODESIC_FAST) != 0) {
        settings->method = is_small ? LOXO_GEODESIC_EXACT : LOXO_GEODESIC_FAST;
        return LOXO_OK;
    }
    int method = 0; /* they are listed by what they take */
    while ((methods & 1U << method) == 0)
        ++method;
    settings->method = (loxo_geodesic_method)method;
    return LOXO_OK;
}

static const char *reason_of(const loxo_geodesic_choice *choice, bool was_asked, bool is_by_setting, bool is_for_many)
{
    if (was_asked) return "it was asked for";
    if (is_by_setting) return "a setting that it has and exact and fast have not is not its default";
    if (choice->method == LOXO_GEODESIC_EXACT) return "the mesh is small enough for exact distances";
    if (is_for_many) return "the mesh is small enough for exact distances, but not for so many solves";
    return "the most accurate method of linear time, and the one of least memory";
}

loxo_status loxo_geodesic_choose(loxo_context *ctx, const loxo_mesh *mesh, const loxo_geodesic_settings *settings,
                                 int64_t n_solves, loxo_geodesic_choice *choice)
{
    if (ctx == NULL) return LOXO_ERR_ARGUMENT;
    if (mesh == NULL || choice == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "geodesic: an argument of choose is NULL");
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    loxo_geodesic_settings chosen = settings != NULL ? *settings : loxo_geodesic_settings_default();
    const bool was_asked = chosen.method != LOXO_GEODESIC_AUTO;
    loxo_status status = loxo_options_check(ctx, "geodesic", loxo_geodesic_options, &chosen);
    if (status >= 0) status = loxo_geodesic_resolve(ctx, m.n_vertices, n_solves, &chosen);
    if (status < 0) return status;
    *choice = (loxo_geodesic_choice){.method = chosen.method, .share_nondelaunay = share_nondelaunay(&m)};
    choice->intrinsic = choice->method != LOXO_GEODESIC_EXACT && m.halfedge_length == NULL &&
                        choice->share_nondelaunay > SHARE_FOR_INTRINSIC;
    const bool is_by_setting = choice->method != LOXO_GEODESIC_EXACT && choice->method != LOXO_GEODESIC_FAST;
    choice->reason = reason_of(choice, was_asked, is_by_setting, m.n_vertices <= MOST_FOR_EXACT);
    return LOXO_OK;
}
