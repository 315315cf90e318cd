/* SPDX-License-Identifier: MIT
 * Repair works on a copy of the triangles and on two maps between vertices before and now; the soup itself is changed
 * at the very end, by steps that cannot fail. */
#include "mesh/repair.h"

#include "base/allocate.h"
#include "base/options.h"
#include "mesh/halfedge.h"
#include "mesh/soup.h"
#include "par/range.h"

#include <string.h>

const loxo_option loxo_repair_options[] = {
    {.name = "weld",
     .type = LOXO_OPTION_BOOL,
     .offset = offsetof(loxo_repair_settings, weld),
     .help = "join vertices with exactly the same position"},
    {.name = "drop-duplicate-faces",
     .type = LOXO_OPTION_BOOL,
     .offset = offsetof(loxo_repair_settings, drop_duplicate_faces),
     .help = "of faces with the same three vertices keep the first"},
    {.name = "split-nonmanifold",
     .type = LOXO_OPTION_BOOL,
     .offset = offsetof(loxo_repair_settings, split_nonmanifold),
     .help = "cut the surface open at non-manifold edges and vertices"},
    {.name = "drop-unreferenced",
     .type = LOXO_OPTION_BOOL,
     .offset = offsetof(loxo_repair_settings, drop_unreferenced),
     .help = "drop vertices without a face"},
    {.name = NULL},
};

loxo_repair_settings loxo_repair_settings_default(void)
{
    return (loxo_repair_settings){
        .weld = true,
        .drop_duplicate_faces = true,
        .split_nonmanifold = true,
        .drop_unreferenced = false, /* a vertex without a face harms nobody, and its number may matter */
    };
}

void loxo_warn_degenerate(loxo_context *ctx, int64_t n, int64_t first)
{
    loxo_warn(ctx, "degenerate", n, "%lld degenerate face%s dropped (first: face %lld)", (long long)n,
              n == 1 ? "" : "s", (long long)first);
}

void loxo_warn_turned(loxo_context *ctx, int64_t n, int64_t first)
{
    loxo_warn(ctx, "turned", n, "%lld face%s turned to agree with the neighbours (first: face %lld)", (long long)n,
              n == 1 ? "" : "s", (long long)first);
}

/* The state between steps. */
typedef struct work {
    loxo_context *ctx;
    const loxo_mesh_arrays *before;
    int64_t n_vertices, n_faces;
    loxo_index *triangle, *twin;
    loxo_index *face_origin; /* [n_faces] number before; NULL: the same */
    /* Maps of vertices, both or none: none while vertices are what they were. */
    loxo_index *origin; /* [n_vertices] number before */
    loxo_index *result; /* [before->n_vertices] number now, -1 when dropped */
    loxo_repair_info info;
} work;

static int64_t face_number(const work *w, int64_t f) { return w->face_origin == NULL ? f : w->face_origin[f]; }

static loxo_status need_maps(work *w)
{
    if (w->origin != NULL) return LOXO_OK;
    const int64_t n = w->n_vertices;
    w->origin = loxo_allocate(w->ctx, n, sizeof *w->origin);
    if (w->origin == NULL) return LOXO_ERR_MEMORY;
    w->result = loxo_allocate(w->ctx, n, sizeof *w->result);
    if (w->result == NULL) return LOXO_ERR_MEMORY;
    for (int64_t v = 0; v < n; ++v)
        w->origin[v] = w->result[v] = (loxo_index)v;
    return LOXO_OK;
}

/* target[v]: the vertex, v or a lower one, that v becomes one with; -1: v goes. Renumbers what is left, in order. */
static loxo_status merge_vertices(work *w, loxo_index *target)
{
    loxo_status status = need_maps(w);
    if (status < 0) return status;
    int64_t n = 0;
    for (int64_t v = 0; v < w->n_vertices; ++v) {
        if (target[v] == v) {
            w->origin[n] = w->origin[v];
            target[v] = (loxo_index)n++;
        } else if (target[v] >= 0) {
            target[v] = target[target[v]]; /* already renumbered */
        }
    }
    for (int64_t v = 0; v < w->before->n_vertices; ++v)
        if (w->result[v] >= 0) w->result[v] = target[w->result[v]];
#pragma omp parallel num_threads(loxo_threads_for(w->ctx, w->n_faces, 10))
    {
        const loxo_range r = loxo_thread_range(3 * w->n_faces);
        for (int64_t h = r.begin; h < r.end; ++h)
            w->triangle[h] = target[w->triangle[h]];
    }
    w->n_vertices = n;
    return LOXO_OK;
}

/* ---- steps --------------------------------------------------------------------------------------------------- */

static loxo_status weld(work *w)
{
    loxo_index *first = loxo_allocate(w->ctx, w->n_vertices, sizeof *first);
    if (first == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = loxo_find_duplicate_vertices(w->ctx, w->before, first);
    if (status >= 0) {
        int64_t n = 0;
        for (int64_t v = 0; v < w->n_vertices; ++v)
            n += first[v] != v;
        w->info.n_vertices_welded = n;
        if (n > 0) status = merge_vertices(w, first);
    }
    loxo_release(w->ctx, first);
    return status;
}

static loxo_status drop_faces(work *w, bool drop_duplicates)
{
    loxo_status status = LOXO_OK;
    int64_t n_dropped = 0, first_degenerate = -1;
    uint8_t *drop = loxo_allocate_zero(w->ctx, w->n_faces, sizeof *drop);
    if (drop == NULL) return LOXO_ERR_MEMORY;
    if (drop_duplicates) {
        status = loxo_mark_duplicate_faces(w->ctx, w->n_vertices, w->n_faces, w->triangle, drop);
        if (status < 0) goto done;
    }
    for (int64_t f = 0; f < w->n_faces; ++f) {
        n_dropped += drop[f];
        if (!loxo_is_degenerate(&w->triangle[3 * f])) continue;
        if (first_degenerate < 0) first_degenerate = f;
        w->info.n_degenerate_dropped += 1;
        drop[f] = 1;
    }
    w->info.n_duplicate_faces_dropped = n_dropped;
    n_dropped += w->info.n_degenerate_dropped;
    if (n_dropped == 0) goto done;
    w->face_origin = loxo_allocate(w->ctx, w->n_faces - n_dropped, sizeof *w->face_origin);
    if (w->face_origin == NULL) {
        status = LOXO_ERR_MEMORY;
        goto done;
    }
    int64_t n = 0;
    for (int64_t f = 0; f < w->n_faces; ++f) {
        if (drop[f]) continue;
        memmove(&w->triangle[3 * n], &w->triangle[3 * f], 3 * sizeof *w->triangle);
        w->face_origin[n++] = (loxo_index)f;
    }
    w->n_faces = n;
    if (first_degenerate >= 0) loxo_warn_degenerate(w->ctx, w->info.n_degenerate_dropped, first_degenerate);
done:
    loxo_release(w->ctx, drop);
    return status;
}

static loxo_status turn(work *w)
{
    int64_t conflict = -1, first = -1;
    uint8_t *turned = loxo_allocate(w->ctx, w->n_faces, sizeof *turned);
    if (turned == NULL) return LOXO_ERR_MEMORY;
    loxo_status status =
        loxo_find_orientation(w->ctx, w->n_faces, w->triangle, w->twin, turned, &w->info.n_faces_turned, &conflict);
    if (status < 0) goto done;
    if (conflict >= 0) {
        conflict = face_number(w, conflict);
        status = loxo_fail_at(w->ctx, LOXO_ERR_MESH, (loxo_place){.byte = -1, .element = conflict},
                              "not orientable: a way around the surface comes back to face %lld turned over",
                              (long long)conflict);
        goto done;
    }
    for (int64_t f = w->n_faces - 1; f >= 0; --f)
        if (turned[f]) first = face_number(w, f);
    loxo_turn_faces(w->ctx, w->n_faces, turned, w->triangle);
    loxo_warn_turned(w->ctx, w->info.n_faces_turned, first);
done:
    loxo_release(w->ctx, turned);
    return status;
}

static loxo_status append_copy(work *w, loxo_index of, int64_t *capacity)
{
    if (w->n_vertices >= LOXO_INDEX_MAX)
        return loxo_fail(w->ctx, LOXO_ERR_LIMIT, "repair: the vertices split exceed the ids of %d bits",
                         (int)(8 * sizeof(loxo_index)));
    if (w->n_vertices == *capacity) {
        loxo_index *larger;
        *capacity += *capacity / 2 + 64;
        larger = loxo_reallocate(w->ctx, w->origin, *capacity, sizeof *w->origin);
        if (larger == NULL) return LOXO_ERR_MEMORY;
        w->origin = larger;
    }
    w->origin[w->n_vertices++] = w->origin[of];
    w->info.n_vertices_split += 1;
    return LOXO_OK;
}

/* The first corner of h's fan in counter-clockwise order: after a boundary, or h itself in a closed fan. */
static loxo_index fan_start(const work *w, loxo_index h)
{
    loxo_index i = h;
    while (loxo_is_paired(w->twin, i)) {
        i = loxo_halfedge_next(w->twin[i]);
        if (i == h) break;
    }
    return i;
}

/* Gives every fan of faces around a vertex a vertex of its own; the fan of the lowest corner keeps the number. Edges
 * with more than two faces count as boundaries: a fan ends there. Two faces that are the two ends of the same fan at
 * both vertices of such an edge stay joined. */
static loxo_status split_fans(work *w)
{
    enum { SEEN = 1 };
    loxo_status status = need_maps(w);
    uint8_t *corner = NULL, *vertex = NULL;
    int64_t capacity = w->n_vertices;
    if (status < 0) return status;
    status = LOXO_ERR_MEMORY;
    corner = loxo_allocate_zero(w->ctx, 3 * w->n_faces, sizeof *corner);
    if (corner == NULL) goto done;
    vertex = loxo_allocate_zero(w->ctx, w->n_vertices, sizeof *vertex);
    if (vertex == NULL) goto done;
    status = LOXO_OK;
    for (int64_t h = 0; h < 3 * w->n_faces; ++h) {
        if (corner[h] == SEEN) continue;
        loxo_index own = w->triangle[h];
        if (vertex[own] == SEEN) {
            if ((status = append_copy(w, own, &capacity)) < 0) goto done;
            own = (loxo_index)(w->n_vertices - 1);
        } else {
            vertex[own] = SEEN;
        }
        const loxo_index start = fan_start(w, (loxo_index)h);
        for (loxo_index i = start;;) {
            corner[i] = SEEN;
            w->triangle[i] = own;
            const loxo_index before = loxo_halfedge_previous(i);
            if (!loxo_is_paired(w->twin, before)) break;
            i = w->twin[before];
            if (i == start) break;
        }
    }
done:
    loxo_release(w->ctx, vertex);
    loxo_release(w->ctx, corner);
    return status;
}

/* True where a vertex has more than one fan; only asked when no edge has more than two faces. */
static loxo_status has_bow_tie(work *w, bool *has)
{
    loxo_index *vertex_halfedge = loxo_allocate(w->ctx, w->n_vertices, sizeof *vertex_halfedge);
    if (vertex_halfedge == NULL) return LOXO_ERR_MEMORY;
    *has =
        loxo_link_vertices(w->ctx, w->n_vertices, w->n_faces, w->triangle, w->twin, vertex_halfedge) < 3 * w->n_faces;
    loxo_release(w->ctx, vertex_halfedge);
    return LOXO_OK;
}

static loxo_status orient_and_split(work *w, bool is_split_wanted)
{
    loxo_edge_counts edges;
    bool has = true;
    loxo_status status;
    w->twin = loxo_allocate(w->ctx, 3 * w->n_faces, sizeof *w->twin);
    if (w->twin == NULL) return LOXO_ERR_MEMORY;
    status = loxo_match_halfedges(w->ctx, w->n_vertices, w->n_faces, w->triangle, w->twin, &edges);
    if (status < 0) return status;
    if (edges.n_same_way > 0) {
        if ((status = turn(w)) < 0) return status;
        status = loxo_match_halfedges(w->ctx, w->n_vertices, w->n_faces, w->triangle, w->twin, &edges);
        if (status < 0) return status;
    }
    if (!is_split_wanted) return LOXO_OK;
    if (edges.n_nonmanifold == 0 && (status = has_bow_tie(w, &has)) < 0) return status;
    return has ? split_fans(w) : LOXO_OK;
}

static loxo_status drop_unreferenced(work *w)
{
    int64_t n = 0;
    loxo_index *target = loxo_allocate(w->ctx, w->n_vertices, sizeof *target);
    if (target == NULL) return LOXO_ERR_MEMORY;
    for (int64_t v = 0; v < w->n_vertices; ++v)
        target[v] = -1;
    for (int64_t h = 0; h < 3 * w->n_faces; ++h)
        target[w->triangle[h]] = w->triangle[h];
    for (int64_t v = 0; v < w->n_vertices; ++v)
        n += target[v] < 0;
    w->info.n_unreferenced_dropped = n;
    const loxo_status status = n > 0 ? merge_vertices(w, target) : LOXO_OK;
    loxo_release(w->ctx, target);
    return status;
}

/* ---- all of it ----------------------------------------------------------------------------------------------- */

static loxo_status stop(const work *w, double fraction)
{
    if (!loxo_stop_wanted(w->ctx, "repair", fraction)) return LOXO_OK;
    return loxo_fail(w->ctx, LOXO_ERR_STOPPED, "repair: stopped by the monitor; nothing was changed");
}

loxo_status loxo_repair(loxo_context *ctx, loxo_soup *soup, const loxo_repair_settings *settings,
                        loxo_index **vertex_origin, loxo_index **vertex_result, loxo_index **face_origin,
                        loxo_repair_info *info)
{
    const loxo_mesh_arrays before = loxo_soup_arrays(soup);
    work w = {.ctx = ctx, .before = &before, .n_vertices = before.n_vertices, .n_faces = before.n_faces};
    int64_t n_degenerate, first_degenerate;
    loxo_status status = loxo_arrays_check_counts(ctx, "repair", &before);
    if (status < 0) return status;
    if ((status = loxo_arrays_check_ids(ctx, &before, &n_degenerate, &first_degenerate)) < 0) return status;
    w.triangle = loxo_allocate(ctx, w.n_faces, 3 * sizeof *w.triangle);
    if (w.triangle == NULL) return LOXO_ERR_MEMORY;
    if (w.n_faces > 0) memcpy(w.triangle, before.triangle, (size_t)w.n_faces * 3 * sizeof *w.triangle);
    if ((status = stop(&w, 0.0)) < 0) goto fail;
    if (settings->weld && (status = weld(&w)) < 0) goto fail;
    if ((status = stop(&w, 0.4)) < 0) goto fail;
    if ((status = drop_faces(&w, settings->drop_duplicate_faces)) < 0) goto fail;
    if ((status = stop(&w, 0.6)) < 0) goto fail;
    if ((status = orient_and_split(&w, settings->split_nonmanifold)) < 0) goto fail;
    if (settings->drop_unreferenced && (status = drop_unreferenced(&w)) < 0) goto fail;
    if ((status = stop(&w, 0.9)) < 0) goto fail;

    loxo_release(ctx, w.twin);
    w.twin = NULL;
    if (w.origin != NULL && (status = loxo_soup_gather_vertices(ctx, soup, w.origin, w.n_vertices)) < 0) goto fail;
    loxo_release(ctx, soup->triangle);
    soup->triangle = w.triangle;
    soup->n_faces = w.n_faces;
    *vertex_origin = w.origin;
    *vertex_result = w.result;
    *face_origin = w.face_origin;
    *info = w.info;
    return loxo_repair_changed_surface(info) || info->n_degenerate_dropped + info->n_faces_turned > 0 ? LOXO_REPAIRED
                                                                                                      : LOXO_OK;
fail:
    loxo_release(ctx, w.twin);
    loxo_release(ctx, w.triangle);
    loxo_release(ctx, w.face_origin);
    loxo_release(ctx, w.origin);
    loxo_release(ctx, w.result);
    return status;
}

loxo_status loxo_soup_repair(loxo_context *ctx, loxo_soup *soup, const loxo_repair_settings *settings,
                             loxo_index **vertex_origin, loxo_repair_info *info)
{
    const loxo_repair_settings defaults = loxo_repair_settings_default();
    loxo_index *origin = NULL, *result = NULL, *faces = NULL, *identity = NULL;
    loxo_repair_info own_info;
    loxo_status status;
    if (ctx == NULL || soup == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "repair: no context or no soup");
    loxo_progress_begin(ctx);
    if (vertex_origin != NULL) {
        /* made first, so that nothing can fail once the soup has changed */
        *vertex_origin = NULL;
        identity = loxo_allocate(ctx, soup->n_vertices < 0 ? 0 : soup->n_vertices, sizeof *identity);
        if (identity == NULL) return LOXO_ERR_MEMORY;
        for (int64_t v = 0; v < soup->n_vertices; ++v)
            identity[v] = (loxo_index)v;
    }
    status = loxo_repair(ctx, soup, settings == NULL ? &defaults : settings, &origin, &result, &faces,
                         info != NULL ? info : &own_info);
    loxo_release(ctx, faces);
    loxo_release(ctx, result);
    if (status >= 0 && vertex_origin != NULL) {
        *vertex_origin = origin != NULL ? origin : identity;
        if (origin != NULL) loxo_release(ctx, identity);
    } else {
        loxo_release(ctx, origin);
        loxo_release(ctx, identity);
    }
    return status;
}
