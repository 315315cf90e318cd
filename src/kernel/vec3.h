/* SPDX-License-Identifier: MIT
 * Vectors of three doubles, and positions of a mesh in whichever width it keeps them. */
#ifndef LOXO_KERNEL_VEC3_H
#define LOXO_KERNEL_VEC3_H

#include <loxo/mesh.h>

#include <math.h>

/* How many elements ahead a stream is asked for that neighbours' look-ups reach into. Those look-ups touch the coming
 * cache lines first, in no order that the processor could follow; without this each line costs a full wait for memory
 * (measured: 9.6 instead of 3.5 ns a face in ADMM). */
#define K_AHEAD 8192
/* What is read in order beside such look-ups is asked for so many elements ahead: the processor, which would see to that
 * by itself, loses these streams among the look-ups (3.0 instead of 2.0 ns a face). */
#define K_NEXT 256

typedef struct loxo_vec3 {
    double x, y, z;
} loxo_vec3;

static inline loxo_vec3 v3_load(const double *p) { return (loxo_vec3){p[0], p[1], p[2]}; }

static inline void v3_store(double *p, loxo_vec3 a)
{
    p[0] = a.x;
    p[1] = a.y;
    p[2] = a.z;
}

static inline loxo_vec3 v3_add(loxo_vec3 a, loxo_vec3 b) { return (loxo_vec3){a.x + b.x, a.y + b.y, a.z + b.z}; }

static inline loxo_vec3 v3_sub(loxo_vec3 a, loxo_vec3 b) { return (loxo_vec3){a.x - b.x, a.y - b.y, a.z - b.z}; }

static inline loxo_vec3 v3_scale(double s, loxo_vec3 a) { return (loxo_vec3){s * a.x, s * a.y, s * a.z}; }

/* a + s b */
static inline loxo_vec3 v3_axpy(loxo_vec3 a, double s, loxo_vec3 b)
{
    return (loxo_vec3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

static inline double v3_dot(loxo_vec3 a, loxo_vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

static inline loxo_vec3 v3_cross(loxo_vec3 a, loxo_vec3 b)
{
    return (loxo_vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline double v3_norm(loxo_vec3 a) { return sqrt(v3_dot(a, a)); }

/* Position of vertex v, widened to double. */
static inline loxo_vec3 k_position(const loxo_mesh_view *m, loxo_index v)
{
    if (m->position != NULL) return v3_load(m->position[v]);
    const float *p = m->position_float[v];
    return (loxo_vec3){(double)p[0], (double)p[1], (double)p[2]};
}

/* Next and previous half-edge in the face of h. */
static inline loxo_index k_next(loxo_index h) { return (loxo_index)(h % 3 == 2 ? h - 2 : h + 1); }

static inline loxo_index k_previous(loxo_index h) { return (loxo_index)(h % 3 == 0 ? h + 2 : h - 1); }

/* The face of h >= 0: h / 3. */
static inline int64_t k_face_of(loxo_index h) { return (int64_t)(((uint64_t)(uint32_t)h * 0xaaaaaaabu) >> 33); }

/* Where half-edge h ends. */
static inline loxo_index k_head(const loxo_mesh_view *m, loxo_index h) { return m->halfedge_vertex[k_next(h)]; }

#endif
