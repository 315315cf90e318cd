/* SPDX-License-Identifier: MIT
 * Inside of the exact method: windows wait in lists on half-edges; lists and bending vertices are taken in rounds. */
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
#define EXACT_CHUNK_BITS 8
#define EXACT_BLOCK      7

/* Windows of one list; what came last is in front. A block is five cache lines: one window a node would mean one wait for
 * memory a window. */
typedef struct exact_block {
    k_window w[EXACT_BLOCK];
    exact_origin origin[EXACT_BLOCK];
    uint32_t n;
    uint32_t next;  /* older of its list, or of the free ones */
    uint32_t round; /* in which its windows came; in the first of a batch of free ones: the next batch */
} exact_block;

/* Blocks by number; chunks stay where they are while there are more. Free ones lie in batches of EXACT_BATCH. */
typedef struct exact_pool {
    exact_block **chunk;
    int64_t n_chunks, capacity;
    uint32_t first_batch;
    bool is_locked;
    int64_t n_live, peak_live; /* windows, at the end of a round */
} exact_pool;

#define EXACT_BATCH 32

static inline exact_block *exact_pool_block(const exact_pool *pool, uint32_t id)
{
    return &pool->chunk[id >> EXACT_CHUNK_BITS][id & ((1u << EXACT_CHUNK_BITS) - 1)];
}

/* Makes at least so many free blocks more. */
loxo_status exact_pool_grow(loxo_context *ctx, exact_pool *pool, int64_t n_blocks);
/* All blocks are free. */
void exact_pool_clear(exact_pool *pool);
size_t exact_pool_bytes(const exact_pool *pool);
void exact_pool_destroy(loxo_context *ctx, exact_pool *pool);

/* ---- threads ---- */

/* A shorter way to a vertex, found in a round and judged at its end. */
typedef struct exact_offer {
    double distance;
    exact_reach reach;
    loxo_index vertex;
    bool is_news; /* by more than rounding errors: windows that were sent from the vertex are not as good */
} exact_offer;

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

/* What one list or vertex may take up at most. */
typedef struct exact_needs {
    int64_t n_windows, n_blocks, n_items, n_offers;
} exact_needs;

/* Everything that one thread writes but the lists. Items are half-edges h, and vertices as 3 n_faces + vertex. */
typedef struct exact_worker {
    exact_work work;
    uint32_t *item[2]; /* [item_room[.]] of this round, as far as they are not looked at yet, and of the next */
    int64_t n_items[2], item_room[2];
    exact_offer *offer; /* [offer_room] of this round */
    int64_t n_offers, offer_room;
    uint32_t first_free, first_batch; /* free blocks, fewer than a batch or one; batches */
    int64_t n_free, n_batches;
    exact_needs wanted; /* what there was no room for; {0}: nothing */
    double least;       /* key of what this round has left for the next */
    int64_t n_more;     /* windows that this round has put into lists, less those it has taken */
    int64_t n_windows, n_bends, n_reached;
    char apart[64]; /* two of them share no cache line */
} exact_worker;

/* Blocks that belong together, in the order of a list. */
typedef struct exact_chain {
    exact_block *block; /* the first */
    uint32_t head, tail;
} exact_chain;

#define EXACT_NO_CHAIN ((exact_chain){NULL, EXACT_NONE, EXACT_NONE})

/* ---- a solver ---- */

/* What is known of a vertex. */
enum {
    EXACT_LOOKED_AT = 1, /* the next two are known; the surface's, kept from solve to solve */
    EXACT_BENDS = 2,     /* ways may bend there: the angles sum to over 2 pi, or it lies on a boundary */
    EXACT_ALL_ROUND = 4, /* it has a face without height: ways that bend there are sent in all directions */
    EXACT_QUEUED = 8,    /* bends, and its distance got smaller since it last sent windows */
    EXACT_LOCKED = 16,   /* a thread judges an offer */
    EXACT_LISTED = 32,   /* in touched */
};

typedef enum exact_stage { EXACT_SELECT, EXACT_PASS_ON, EXACT_JUDGE } exact_stage;

typedef struct exact_state {
    loxo_context *ctx;
    const geodesic_problem *problem;
    loxo_mesh_view m;
    loxo_arena arena;
    double width;        /* of a round's band of keys */
    double max_distance; /* ways beyond are dropped */
    /* kept from solve to solve; [3 n_faces] first block of each half-edge's list, all EXACT_NONE between solves */
    uint32_t *list;
    exact_reach *reach; /* [n_vertices] */
    uint8_t *known;     /* [n_vertices] */
    double *distance;   /* [n_vertices] */
    exact_pool pool;
    exact_worker *worker; /* [n_workers] */
    int n_workers;        /* most threads that there can be */
    loxo_index *touched;  /* [touched_room] */
    int64_t n_touched;    /* what the last solve reached, ascending; -1: no such list, it may be all */
    int64_t touched_room;
    loxo_index *nearest; /* [n_vertices] of the present solve; NULL: not wanted */
    /* the present round */
    int n_threads;
    exact_stage stage;
    bool is_begun, is_over;
    int side;       /* worker.item[side] is the present queue */
    uint32_t round; /* its number */
    uint32_t *task; /* [task_room] items that are taken in it; EXACT_NONE: done */
    int64_t n_tasks, task_room, task_wanted;
    double horizon; /* the least key, about */
    /* of the last solve */
    const geodesic_seed *seeds; /* [n_seeds] */
    int64_t n_seeds;
    int64_t n_windows; /* passed on */
    int64_t n_bends;   /* times that a vertex sent windows */
    int64_t n_reached; /* vertices */
    int64_t n_rounds;
    /* ways to points inside faces, found while windows cross those; NULL: none wanted */
    const geodesic_seed *goals; /* [n_goals] by face */
    int64_t n_goals;
    double goal_distance; /* of the nearest, HUGE_VAL: none yet */
    int64_t goal;
    exact_reach goal_reach;   /* via: the half-edge of its face */
    struct exact_state *back; /* solves from points that ways are wanted from; made when needed */
} exact_state;

/* worker.c: whether there is room for one list or vertex; if not, wanted tells of it. */
bool exact_has_room(exact_state *s, exact_worker *worker, const exact_needs *needs);
/* Makes room for what all workers want. Not while threads are at work. */
loxo_status exact_make_room(exact_state *s);
/* Forgets all windows and keeps the memory. */
void exact_clear_workers(exact_state *s);
size_t exact_worker_bytes(const exact_worker *worker);
void exact_worker_destroy(loxo_context *ctx, exact_worker *worker);
/* Puts a window in front of a chain that is not in a list yet. */
void exact_put(exact_state *s, exact_worker *worker, exact_chain *chain, const k_window *w, exact_origin origin);
void exact_free_block(exact_state *s, exact_worker *worker, uint32_t id);
/* Puts a chain in front of the list of half-edge h, below which its sources lie; queues h. */
void exact_hang(exact_state *s, exact_worker *worker, exact_chain *chain, loxo_index h, double key);
void exact_queue(exact_state *s, exact_worker *worker, uint32_t item, double key);

/* Takes an offer for the end of the round, when it is shorter than what is known. */
static inline void exact_make_offer(exact_state *s, exact_worker *worker, loxo_index vertex, double distance,
                                    exact_reach reach)
{
    const double old = s->distance[vertex];
    if (distance < old)
        worker->offer[worker->n_offers++] = (exact_offer){distance, reach, vertex, old - distance > 1e-14 * distance};
}

/* front.c: takes over an offer that is shorter, and queues the vertex when ways may bend there. */
void exact_judge(exact_state *s, exact_worker *worker, const exact_offer *offer);
/* Rounds until nothing is on its way, or the monitor stops them (LOXO_STOPPED without a message). LOXO_ERR_MEMORY. */
loxo_status exact_run_rounds(exact_state *s);
/* After a stop: no way that was not gone yet is shorter. HUGE_VAL: there is none. */
double exact_least_to_come(const exact_state *s);

/* Takes the list of half-edge h across the face of h. false: there is no room for it yet. */
bool exact_pass_on(exact_state *s, exact_worker *worker, loxo_index h);
/* Sorts n taken windows of one half-edge into kept, without what others make needless; returns how many that are. The face
 * that they have crossed lies below the edge, its third corner at (corner_x, -corner_y). The order in which they came does not
 * matter. */
int64_t exact_prune(exact_work *work, int64_t n, double length, double corner_x, double corner_y);
/* Windows from a seed, and from a vertex whose distance stands. */
loxo_status exact_send_from_seed(exact_state *s, int64_t seed);
bool exact_send_from_vertex(exact_state *s, exact_worker *worker, loxo_index vertex);
/* EXACT_LOOKED_AT and what goes with it. */
uint8_t exact_look_at(const exact_state *s, loxo_index vertex);

/* Everything from seeds outward up to a distance. */
loxo_status exact_run(exact_state *s, const geodesic_seed *seeds, int64_t n_seeds, double max_distance,
                      bool *is_stopped);
/* What the last run may have given a distance, ascending; NULL: all n. */
const loxo_index *exact_touched(void *state, int64_t *n);
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

/* A bound with its slack for windows on an edge of that length. */
static inline double exact_bound(double distance, double length)
{
    return distance + K_WINDOW_SLACK * (distance + length);
}

#endif
