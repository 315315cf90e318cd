/* SPDX-License-Identifier: MIT
 * Inside of the exact method: windows wait in lists on half-edges, lists and bending vertices in one queue. */
#ifndef LOXO_SOLVER_GEODESIC_EXACT_H
#define LOXO_SOLVER_GEODESIC_EXACT_H

#include "base/arena.h"
#include "kernel/window_kernel.h"
#include "solver/geodesic/engine.h"

/* ---- where shortest ways come from ---- */

/* Source of a straight piece: a vertex >= 0, or seed s as -1 - s. */
typedef int32_t exact_origin;

/* Last straight piece of a vertex's shortest way, read backwards: from the vertex across its opposite half-edge `via`, at
 * `at` along it, and on to the origin, which lies at (x, -y) in the frame of via. at < 0: it does not leave via's face, where
 * the seed lies. via < 0: the vertex is a seed. Only for vertices with a finite distance. */
typedef struct exact_reach {
    double at, x, y;
    loxo_index via;
    exact_origin origin;
} exact_reach;

/* ---- windows ---- */

#define EXACT_NONE       UINT32_MAX
#define EXACT_CHUNK_BITS 10
#define EXACT_BLOCK      7

/* Windows of one list, oldest first; only the newest block of a list, its first, may be not full. A block is five cache
 * lines: one window a node would mean one wait for memory a window. */
typedef struct exact_block {
    k_window w[EXACT_BLOCK];
    exact_origin origin[EXACT_BLOCK];
    uint32_t n;
    uint32_t next; /* older of its list, or of the free ones */
} exact_block;

/* Blocks by number; chunks stay where they are while there are more. */
typedef struct exact_pool {
    exact_block **chunk;
    int64_t n_chunks, capacity;
    uint32_t first_free;
    int64_t n_live, peak_live; /* windows */
} exact_pool;

static inline exact_block *exact_pool_block(const exact_pool *pool, uint32_t id)
{
    return &pool->chunk[id >> EXACT_CHUNK_BITS][id & ((1u << EXACT_CHUNK_BITS) - 1)];
}

/* Makes free blocks when there are none. */
loxo_status exact_pool_grow(loxo_context *ctx, exact_pool *pool);
/* Forgets all windows and keeps the chunks. */
void exact_pool_clear(exact_pool *pool);
size_t exact_pool_bytes(const exact_pool *pool);
void exact_pool_destroy(loxo_context *ctx, exact_pool *pool);

/* ---- the queue ---- */

/* Smallest key first; of equal keys the one that was put in last. Keys are the bits of floats >= 0, which are in the order of
 * the numbers; one below the last that was taken counts as that. A radix heap (Ahuja, Mehlhorn, Orlin, Tarjan 1990): bin b
 * has the keys whose highest bit that differs from the last key taken is bit b - 1; a bin that comes to the front is dealt
 * out to those before it. No comparisons, which a processor would guess wrong. */
#define EXACT_BINS 33

typedef struct exact_entry {
    uint32_t key, item; /* half-edge h, or 3 n_faces + vertex */
    uint32_t next;
} exact_entry;

typedef struct exact_queue {
    exact_entry *entry; /* [room] */
    int64_t n, room;    /* n in the bins */
    uint32_t bin[EXACT_BINS], first_free, last;
} exact_queue;

loxo_status exact_queue_push(loxo_context *ctx, exact_queue *queue, double key, uint32_t item);
uint32_t exact_queue_pop(exact_queue *queue); /* n > 0 */
void exact_queue_clear(exact_queue *queue);
void exact_queue_destroy(loxo_context *ctx, exact_queue *queue);

/* ---- a solver ---- */

/* What is known of a vertex. */
enum {
    EXACT_LOOKED_AT = 1, /* the next two are known; the surface's, kept from solve to solve */
    EXACT_BENDS = 2,     /* ways may bend there: the angles sum to over 2 pi, or it lies on a boundary */
    EXACT_ALL_ROUND = 4, /* it has a face without height: ways that bend there are sent in all directions */
    EXACT_QUEUED = 8,    /* bends, and its distance got smaller since it last sent windows */
};

typedef struct exact_taken {
    k_window w;
    exact_origin origin;
    double sight; /* where the line from the source to the apex crosses the base */
    double way;   /* length of that line and what is before its source */
} exact_taken;

/* Of the list that is passed on; all [room]. */
typedef struct exact_work {
    exact_taken *taken, *kept; /* as they came; by position, without those that others make needless */
    struct exact_place {
        double begin;
        int64_t i;
    } * place, *other_place;
    int64_t room;
} exact_work;

void exact_work_destroy(loxo_context *ctx, exact_work *work);

typedef struct exact_state {
    loxo_context *ctx;
    const geodesic_problem *problem;
    loxo_mesh_view m;
    loxo_arena arena;
    double key_scale;    /* keys are distances in this unit, that float holds them */
    double max_distance; /* ways beyond are dropped */
    /* kept from solve to solve; [3 n_faces] first node of each half-edge's list, all EXACT_NONE between solves */
    uint32_t *list;
    exact_reach *reach; /* [n_vertices] */
    uint8_t *known;     /* [n_vertices] */
    exact_pool pool;
    exact_queue queue;
    exact_work work;
    /* of the last solve */
    double *distance;           /* the caller's */
    const geodesic_seed *seeds; /* [n_seeds] */
    int64_t n_seeds;
    int64_t n_windows; /* passed on */
    int64_t n_bends;   /* times that a vertex sent windows */
    int64_t n_reached; /* vertices */
    /* ways to points inside faces, found while windows cross those; NULL: none wanted */
    const geodesic_seed *goals; /* [n_goals] by face */
    int64_t n_goals;
    double goal_distance; /* of the nearest, HUGE_VAL: none yet */
    int64_t goal;
    exact_reach goal_reach;   /* via: the half-edge of its face */
    struct exact_state *back; /* solves from points that ways are wanted from; made when needed */
    double *back_distance;
} exact_state;

/* A shorter way to a vertex: takes it over, and queues the vertex when ways may bend there. */
loxo_status exact_improve(exact_state *s, loxo_index vertex, double distance, exact_reach reach);
/* Puts a window on half-edge h, below which its source lies; queues h. */
loxo_status exact_add(exact_state *s, loxo_index h, const k_window *w, exact_origin origin, double key);
/* Takes the list of half-edge h across the face of h. */
loxo_status exact_pass_on(exact_state *s, loxo_index h);
/* Sorts n taken windows of one half-edge into kept, without what others make needless; returns how many that are. The face
 * that they have crossed lies below the edge, its third corner at (corner_x, -corner_y). */
int64_t exact_prune(exact_work *work, int64_t n, double length, double corner_x, double corner_y);
/* Windows from a seed, and from a vertex whose distance stands. */
loxo_status exact_send_from_seed(exact_state *s, int64_t seed);
loxo_status exact_send_from_vertex(exact_state *s, loxo_index vertex);
/* EXACT_LOOKED_AT and what goes with it. */
uint8_t exact_look_at(const exact_state *s, loxo_index vertex);

/* Everything from seeds outward up to a distance. */
loxo_status exact_run(exact_state *s, const geodesic_seed *seeds, int64_t n_seeds, double max_distance,
                      double *distance, bool *is_stopped);
loxo_status exact_create(const geodesic_problem *problem, void **state);
void exact_destroy(void *state);

/* ---- ways back ---- */

/* Where a seed lies that is inside the face of h, in the frame of h. */
static inline void exact_place(const geodesic_seed *seed, loxo_index h, const k_layout *face, double length, double *x,
                               double *y)
{
    const int corner = (int)(h - 3 * k_face_of(h));
    const double next = seed->weight[(corner + 1) % 3], last = seed->weight[(corner + 2) % 3];
    *x = next * length + last * face->x2;
    *y = last * face->y2;
}

/* Windows that cross a face with goals. */
void exact_meet_goals(exact_state *s, loxo_index h, const k_layout *face, const exact_taken *window, int64_t n);

/* A point of a way: a vertex, a seed inside a face, or on a half-edge at `at` of its length, 0 to 1. What it is not is -1;
 * all -1: the goal. */
typedef struct exact_stop {
    loxo_index vertex, halfedge;
    int64_t seed;
    double at;
} exact_stop;

typedef struct exact_way {
    exact_stop *stop; /* [n] */
    int64_t n, room;
} exact_way;

/* Adds the shortest way of the last solve from a vertex with a finite distance to its source, the vertex first: straight
 * between places where it bends, across every edge between. LOXO_OK, LOXO_ERR_MEMORY, LOXO_ERR_NUMERIC: lost (element). */
loxo_status exact_trace(const exact_state *s, loxo_index vertex, exact_way *way);
/* The same from the goal that the last solve met. */
loxo_status exact_trace_goal(const exact_state *s, exact_way *way);
/* The engine's: from any point. */
loxo_status exact_trace_from(void *state, const geodesic_seed *from, struct line_builder *builder);
void exact_way_destroy(loxo_context *ctx, exact_way *way);

static inline loxo_status exact_queue_halfedge(exact_state *s, loxo_index h, double key)
{
    return exact_queue_push(s->ctx, &s->queue, key * s->key_scale, (uint32_t)h);
}

static inline loxo_status exact_queue_vertex(exact_state *s, loxo_index vertex)
{
    return exact_queue_push(s->ctx, &s->queue, s->distance[vertex] * s->key_scale,
                            (uint32_t)(3 * s->m.n_faces) + (uint32_t)vertex);
}

/* A bound with its slack for windows on an edge of that length. */
static inline double exact_bound(double distance, double length)
{
    return distance + K_WINDOW_SLACK * (distance + length);
}

#endif
