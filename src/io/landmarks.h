/* SPDX-License-Identifier: MIT
 * Landmarks out of bytes, one function a format. They come behind what the struct holds already. The rules are those of formats.h. */
#ifndef LOXO_IO_LANDMARKS_H
#define LOXO_IO_LANDMARKS_H

#include <loxo/lines.h>

/* A .border file of version 3, n_vertices those of its surface. After a failure, here and in the next, part of it may be there. */
loxo_status loxo_read_border(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                             int64_t n_vertices, loxo_landmarks *landmarks);

/* Lines of a name and a vertex, a position, or three vertices and weights. */
loxo_status loxo_read_landmark_rows(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                    int64_t n_vertices, loxo_landmarks *landmarks);

/* By the content: a .border file or lines. A failure leaves landmarks as they were. */
loxo_status loxo_read_landmarks_bytes(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                      int64_t n_vertices, loxo_landmarks *landmarks);

/* ---- putting them together ----------------------------------------------------------------------------------- */

/* A curve behind the others, without points yet. name [n_name], cut to 63 bytes. */
loxo_status loxo_landmarks_add_curve(loxo_context *ctx, loxo_landmarks *landmarks, const char *name, size_t n_name,
                                     bool is_closed);
/* A point behind those of the last curve. position: NULL, or where it is; its vertices are then -1. */
loxo_status loxo_landmarks_add_point(loxo_context *ctx, loxo_landmarks *landmarks, const loxo_surface_point *point,
                                     const double *position);

/* Makes weights sum to 1; false where they are no barycentric weights: one is negative or not finite, or all are 0. */
bool loxo_landmark_normalise(double weight[3]);

#endif
