/* SPDX-License-Identifier: MIT
 * A triangulation of the sphere that vertices are taken out of, and put back into, one by one. Why neither ever fails: README.md. */
#ifndef LOXO_SOLVER_SPHERE_EMBEDDING_H
#define LOXO_SOLVER_SPHERE_EMBEDDING_H

#include "base/arena.h"
#include "kernel/star_kernel.h"
#include "solver/sphere/sphere_internal.h"

/* Taken out are vertices of at most so many neighbours. */
#define EMBEDDING_MOST_NEIGHBOURS 32

/* A vertex that may have to go. */
typedef struct sphere_leaving {
    loxo_index vertex;
    loxo_index n_folds; /* of the triangles around it */
    double share;
} sphere_leaving;

/* The triangulation as it is now, of the vertices that are there. Half-edges as in the mesh's view; those of faces that are
 * gone keep what they need to come back. */
typedef struct sphere_embedding {
    const sphere_problem *p;
    sphere_map f;            /* the caller's */
    loxo_index *corner;      /* [3 n_faces] where a half-edge starts */
    loxo_index *twin;        /* [3 n_faces] */
    loxo_index *first;       /* [n] a half-edge that starts there */
    loxo_index *degree;      /* [n] neighbours; 0: not there */
    int32_t *lock;           /* [n] the last round in which the vertex was to stay */
    int32_t *listed;         /* [n] the last round in whose list it was */
    loxo_index *list;        /* [n] those that may have to go ... */
    loxo_index *next_list;   /* [n] ... and in the next round */
    sphere_leaving *leaving; /* [n] */
    loxo_index
        *removed; /* [n_removed] half-edges from vertices taken out to those that took their places, in that order */
    int32_t *removed_round; /* [n_removed] */
    loxo_index *free;       /* [n_free] vertices put back: these may be moved */
    bool *is_forced;        /* [n] must go */
    bool *is_free;          /* [n] */
    int64_t n_there, n_list, n_removed, n_free;
    int64_t n_failed; /* vertices put back that no place was found for */
    int32_t round;
    double least_radius; /* smaller stars are not moved */
    loxo_arena arena;
} sphere_embedding;

/* ---- embedding.c: the triangulation --------------------------------------------------------------------------- */

loxo_status sphere_embedding_create(const sphere_problem *p, sphere_map f, sphere_embedding *out);
void sphere_embedding_destroy(sphere_embedding *e);
/* The mesh's own triangulation again, nothing forced or free. */
void sphere_embedding_reset(sphere_embedding *e);

/* The half-edge after h around the vertex where it starts, counter-clockwise. */
static inline loxo_index embedding_turn(const sphere_embedding *e, loxo_index h) { return e->twin[k_previous(h)]; }

/* Neighbours of v, counter-clockwise, at most `most`; how many it has. */
static inline int embedding_ring(const sphere_embedding *e, loxo_index v, int most, loxo_index *ring)
{
    const int n = (int)e->degree[v];
    loxo_index h = e->first[v];
    for (int i = 0; i < n && i < most; ++i, h = embedding_turn(e, h))
        ring[i] = e->corner[k_next(h)];
    return n;
}

/* Whether the vertex where h starts can be pulled along h onto its end, and leave a triangulation: the two have but two common
 * neighbours. Two vertices of many neighbours count as neighbours unless is_patient. */
bool sphere_embedding_can_collapse(const sphere_embedding *e, loxo_index h, bool is_patient);
void sphere_embedding_collapse(sphere_embedding *e, loxo_index h);
/* Undoes the last collapse; the vertex that is there again. Its first half-edge runs to the one it was pulled onto. */
loxo_index sphere_embedding_restore(sphere_embedding *e);

/* ---- embedding_place.c: places of vertices ------------------------------------------------------------------- */

/* How many triangles around v are turned over. */
int sphere_star_folds(const sphere_embedding *e, loxo_index v);
/* Finds a place for a vertex just restored; false: none was found. */
bool sphere_place_vertex(sphere_embedding *e, loxo_index v);
/* Moves a vertex to where the triangles around it are most like those of the surface; it turns none over. */
void sphere_relax_vertex(sphere_embedding *e, loxo_index v);

/* ---- embed.c: what is done with it ----------------------------------------------------------------------------- */

/* Takes out the vertices that are forced, and those at triangles that are turned over until there is none, and puts all of them back
 * anew; others stay where they are, unless four are left: these get the corners of a regular tetrahedron. is_whole: all are forced, and f
 * is not looked at.
 * returns  LOXO_OK, n_failed tells; LOXO_STOPPED: vertices not yet there stand where others do */
loxo_status sphere_embed(sphere_embedding *e, bool is_whole, int n_sweeps);

#endif
