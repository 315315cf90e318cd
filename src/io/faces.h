/* SPDX-License-Identifier: MIT
 * What readers do with faces and with the finished soup, whatever the format: polygons into triangles, counts of odd
 * faces, vertices that are not finite. */
#ifndef LOXO_IO_FACES_H
#define LOXO_IO_FACES_H

#include "base/context.h"

#include <loxo/mesh.h>

/* What the faces of a stretch of a file came to. */
typedef struct loxo_face_tally {
    int64_t n_triangles;
    int64_t max_corners;                /* of a face */
    int64_t n_small, first_small;       /* faces of 0, 1 or 2 corners: dropped */
    int64_t n_doubtful, first_doubtful; /* polygons that cross themselves or have no area */
    bool has_index_0;                   /* else the indices look as if they were counted from 1 */
} loxo_face_tally;

void loxo_face_tally_add(loxo_face_tally *sum, const loxo_face_tally *more); /* more follows sum in the file */
void loxo_face_tally_warn(loxo_context *ctx, const char *name, const loxo_face_tally *tally);

/* Triangles of a face with so many corners. */
static inline int64_t loxo_face_n_triangles(int64_t n_corners) { return n_corners < 3 ? 0 : n_corners - 2; }

/* Counts a face; its corners need not be known yet. */
static inline void loxo_face_count(loxo_face_tally *tally, int64_t face, int64_t n_corners)
{
    if (n_corners < 3 && tally->n_small++ == 0) tally->first_small = face;
    if (n_corners > tally->max_corners) tally->max_corners = n_corners;
    tally->n_triangles += loxo_face_n_triangles(n_corners);
}

/* Bytes of the workspace that a polygon of so many corners needs. */
size_t loxo_polygon_room_bytes(int64_t n_corners);

/* Cuts a polygon of n_corners >= 3 into n_corners - 2 triangles, of its own orientation: a fan from corner 0 when it is
 * convex, else by cutting off ears in the plane that drops the largest component of its normal.
 *   corner     [n_corners] ids of soup's vertices
 *   room       64-byte aligned, loxo_polygon_room_bytes(n_corners); NULL is allowed for 3 corners
 *   triangle   out, [n_corners - 2][3]
 * returns      whether every triangle is turned as the polygon is; false where it crosses itself or has no area
 * cost         linear for polygons that are convex or spread their dents; at most 1000 steps a corner and 1e8 in all,
 *              after which the rest is cut off blindly and false is returned */
bool loxo_polygon_triangulate(const loxo_soup *soup, const loxo_index *corner, int64_t n_corners, void *room,
                              loxo_index *triangle);

/* A strip of triangles, id by id: every id after the second makes one, of alternating orientation; -1 starts anew;
 * triangles with a repeated corner are the strip's way to turn and are left out. Starts as {0}. */
typedef struct loxo_strip {
    int64_t n; /* ids since the start */
    loxo_index last[2];
} loxo_strip;

/* Takes the next id; true when it made a triangle. */
static inline bool loxo_strip_next(loxo_strip *strip, loxo_index id, loxo_index triangle[3])
{
    const loxo_index a = strip->last[0], b = strip->last[1];
    strip->last[0] = b;
    strip->last[1] = id;
    strip->n = id < 0 ? 0 : strip->n + 1;
    if (strip->n < 3 || a == b || b == id || id == a) return false;
    triangle[0] = strip->n % 2 == 0 ? b : a;
    triangle[1] = strip->n % 2 == 0 ? a : b;
    triangle[2] = id;
    return true;
}

/* Position arrays for n_vertices; triangles for n_triangles. n_vertices and n_faces of the soup are set. */
loxo_status loxo_soup_allocate_vertices(loxo_context *ctx, loxo_soup *soup, int64_t n_vertices, bool is_float);
loxo_status loxo_soup_allocate_triangles(loxo_context *ctx, loxo_soup *soup, int64_t n_triangles);

static inline bool loxo_is_finite3(const loxo_soup *soup, int64_t vertex)
{
    if (soup->position_float != NULL) {
        const float *p = &soup->position_float[3 * vertex];
        return p[0] - p[0] == 0.0f && p[1] - p[1] == 0.0f && p[2] - p[2] == 0.0f;
    }
    const double *p = &soup->position[3 * vertex];
    return p[0] - p[0] == 0.0 && p[1] - p[1] == 0.0 && p[2] - p[2] == 0.0;
}

/* The lowest vertex that is not finite and that a face uses, or -1. */
int64_t loxo_soup_first_used_nonfinite(const loxo_context *ctx, const loxo_soup *soup);

/* The failure for the vertex that is not finite but used; line 0 or byte -1 when unknown. */
loxo_status loxo_fail_nonfinite(loxo_context *ctx, loxo_place place, const loxo_soup *soup, int64_t vertex);

/* The common end of all readers: counted warnings for vertices that are not finite but unused, for no faces. */
void loxo_soup_warn(loxo_context *ctx, const char *name, const loxo_soup *soup, int64_t n_nonfinite);

#endif
