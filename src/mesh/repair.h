/* SPDX-License-Identifier: MIT
 * Repair with the way of every vertex: what loxo_soup_repair and the repair inside loxo_mesh_create share. */
#ifndef LOXO_MESH_REPAIR_H
#define LOXO_MESH_REPAIR_H

#include <loxo/mesh.h>

/* As loxo_soup_repair. Three arrays, owned by the caller then; NULL when the vertices, or faces, stayed what they were:
 *   vertex_origin  [soup->n_vertices] number before of every vertex now
 *   vertex_result  [n_vertices before] number now of every vertex before: of a welded one the vertex it became, of a
 *                  split one its first copy, -1 of a dropped one
 *   face_origin    [soup->n_faces] number before of every face now */
loxo_status loxo_repair(loxo_context *ctx, loxo_soup *soup, const loxo_repair_settings *settings,
                        loxo_index **vertex_origin, loxo_index **vertex_result, loxo_index **face_origin,
                        loxo_repair_info *info);

/* The surface itself was changed, not only faces without area dropped or turned. */
static inline bool loxo_repair_changed_surface(const loxo_repair_info *info)
{
    return info->n_vertices_welded + info->n_duplicate_faces_dropped + info->n_vertices_split +
               info->n_unreferenced_dropped >
           0;
}

/* The warnings of what is harmless; first: caller's number of the first face concerned. */
void loxo_warn_degenerate(loxo_context *ctx, int64_t n, int64_t first);
void loxo_warn_turned(loxo_context *ctx, int64_t n, int64_t first);

#endif
