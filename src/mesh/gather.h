/* SPDX-License-Identifier: MIT
 * What vertices take from the faces around them, of a mesh that is only arrays. */
#ifndef LOXO_MESH_GATHER_H
#define LOXO_MESH_GATHER_H

#include "par/range.h"

#include <loxo/mesh.h>

/* Adds what faces begin..end-1 give to those of their vertices that are in own; other vertices are another thread's. */
typedef void (*loxo_take_fn)(void *arg, int64_t begin, int64_t end, loxo_range own);

/* Each thread has a range of vertices and passes over the blocks of faces that touch it, so that every vertex takes from its faces in
 * their order, whatever the number of threads.
 *   ns_each   of take, a face
 * LOXO_OK; LOXO_ERR_MALFORMED: a vertex number out of range (element is the face), nothing is taken; LOXO_ERR_MEMORY. Where neighbours
 * have numbers far apart every thread looks at every face. */
loxo_status loxo_gather_faces(loxo_context *ctx, const loxo_mesh_arrays *arrays, double ns_each, loxo_take_fn take,
                              void *arg);

static inline bool loxo_is_own(loxo_range own, int64_t v) { return v >= own.begin && v < own.end; }

#endif
