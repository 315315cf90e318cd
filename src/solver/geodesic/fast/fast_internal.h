/* SPDX-License-Identifier: MIT
 * Inside of the fast method: what a vertex keeps of the ray that reached it, and the rounds of the front. */
#ifndef LOXO_SOLVER_GEODESIC_FAST_INTERNAL_H
#define LOXO_SOLVER_GEODESIC_FAST_INTERNAL_H

#include "base/arena.h"
#include "kernel/variants.h"
#include "solver/geodesic/engine.h"

/* A vertex of the front becomes final when no neighbour beside its ray is both nearer and not final, and its distance is at
 * most the least of the front plus so many times the last leg of its ray. Part of the answer. */
#define FAST_WIDTH 1.5
/* A final vertex that is heard of again, earlier by so many times the last leg of its ray, goes back to the front. A
 * vertex whose own ray is told again, later by so much, was told of it before its edge knew better: it asks all its edges again. */
#define FAST_GAIN            1e-3
#define FAST_RISE            1e-2
#define FAST_RISE_OF_A_GUESS 1e-4 /* where the ray was guessed from one end of the edge */

/* A vertex is taken back so often at most: so that it ends. */
#define FAST_TAKEN_BACK_MOST 31

/* Of an edge whose ends are lit from different points, in lengths of it: what one end's circle must gain over both together, how much
 * later than it says the other end may be, and how far off what is taken may be for all that is known. Measured, see README.md. */
#define FAST_MIXED_GAIN  1e-2
#define FAST_REFUTED     3e-2
#define FAST_MIXED_DOUBT 4e-2

enum {
    FAST_QUEUED = 1,
    FAST_FINAL = 2,
    FAST_NEW = 4,
    FAST_LOCKED = 8,
    FAST_LISTED = 16,
    FAST_TAKEN_BACK = 32, /* once at least */
    FAST_GUESSED = 64     /* its ray came by one end of an edge */
};

/* The ray that reached a vertex: it leaves the vertex into the corner of half-edge `ray`, which starts there, and crosses the
 * edge across that corner at share t from the end of `ray`. */
typedef struct fast_jet {
    loxo_index ray; /* -1 at a source */
    float crossing; /* from the nearer end: t, or t - 1 < 0, so that short legs keep their direction */
    float sigma;    /* distance of the point that the ray seems to come from */
    float length;   /* of the last leg, from the crossing to the vertex */
    float doubt;    /* estimate of the distance's error, added up along the ray */
} fast_jet;

static inline float fast_crossing(double t) { return (float)(t <= 0.5 ? t : t < 1.0 ? t - 1.0 : -1e-30); }

/* An edge between two final vertices, and through it the third vertex of the face of half-edge base. */
typedef struct fast_task {
    double base_square, a_square, b_square, d_a, d_b;
    float sigma_a, sigma_b, doubt_a, doubt_b;
    loxo_index base; /* from A to B */
    loxo_index source_a, source_b;
    double renewed; /* distance of the third vertex, where it has its ray through this edge already; else HUGE_VAL */
} fast_task;

/* A ray that was told again to the vertex that has it: the distance now, and before. */
typedef struct fast_doubtful {
    double arrival, before;
    loxo_index ray;
} fast_doubtful;

/* A way along an edge, or by one end of one. */
typedef struct fast_step {
    double arrival, renewed; /* the second as of tasks */
    float sigma, length, crossing, doubt;
    loxo_index target, ray, source;
    bool is_guess; /* by one end */
} fast_step;

/* One a thread: the fans of the vertices that are worked on, one after the other, and what they emit. */
typedef struct fast_bench {
    int64_t capacity;                    /* of the fans, in spokes */
    loxo_index *halfedge;                /* [capacity] along spoke i; the last of a fan: FAN_CLOSED or FAN_OPEN */
    loxo_index *neighbour;               /* [capacity] at its end */
    double *spoke, *rim, *cosine, *sine; /* [capacity] as k_ring_corners */
    float *slope;                        /* [capacity] */
    loxo_index *woken;                   /* [capacity] */
    fast_task *task;                     /* [2 capacity] */
    fast_step *step;                     /* [3 capacity] */
} fast_bench;

typedef enum fast_stage { FAST_SELECT, FAST_EXPAND, FAST_COMMIT } fast_stage;

typedef struct fast_state {
    const geodesic_problem *problem;
    loxo_context *ctx;
    loxo_mesh_view m;
    const k_variant *kernels;
    int n_threads;
    loxo_arena arena;
    double *distance;     /* [n_vertices] */
    fast_jet *jet;        /* [n_vertices] */
    uint8_t *flags;       /* [n_vertices] */
    uint8_t *n_times;     /* [n_vertices] taken back */
    float *slope;         /* [3 n_faces] of the distance along the half-edge, at its start, once that is final */
    loxo_index *queue[2]; /* [n_vertices] reached, and to be looked at: in the present round and in the next */
    loxo_index *awaited;  /* [n_vertices] of one that is reached but not queued: a nearer neighbour that is not final */
    loxo_index *fresh;    /* [n_vertices] final since this round */
    loxo_index *nearest;  /* [n_vertices] of the present solve; NULL: not wanted */

    /* allocations of their own, which grow where a round or a fan needs more */
    loxo_arena bench_arena;
    fast_bench *bench; /* [n_benches] */
    int n_benches;     /* most threads that there can be */
    fast_task *task;
    fast_step *step;
    fast_doubtful *doubtful; /* [task_capacity + step_capacity] of the present round */
    loxo_index *
        taken_back; /* [task_capacity + step_capacity] vertices whose ray turned out too short: they ask all their edges again */
    int64_t bench_capacity, task_capacity, step_capacity;

    /* the present round */
    fast_stage stage;
    bool is_begun, is_over;
    double limit;
    int side; /* queue[side] is the present one */
    int64_t n_queue, n_next, n_fresh, n_tasks, n_steps, n_doubtful, n_taken_back;
    int64_t bench_wanted;  /* a fan, or what a piece of the round emits, did not fit */
    double horizon;        /* nothing that is not final is nearer */
    uint64_t next_horizon; /* the same of the next, as bits */
    uint64_t overhang;     /* longest edge that a ray within the limit came through, as bits */
    bool is_renewing;      /* vertices within the limit were taken back in the round before */
    int64_t n_rounds, n_final, n_updates;

    int64_t n_touched; /* what a limited solve reached stands in fresh, ascending; -1: no such list, it may be all */
} fast_state;

/* front.c: room for first rounds, where there is none: in create, and after a growth that failed. LOXO_ERR_MEMORY. */
loxo_status fast_make_ready(fast_state *s);
/* Runs rounds from what the seeds put into the front until it is empty, or beyond limit, or the monitor stops it
 * (LOXO_STOPPED without a message). LOXO_ERR_MEMORY. */
loxo_status fast_run(fast_state *s, double limit);
/* Puts a vertex into the front: a source, or a corner of the face that one is in. */
void fast_seed(fast_state *s, loxo_index v, double distance, const fast_jet *jet, loxo_index source);

/* Puts vertices that were marked so into the queue of the next round. */
void fast_queue(fast_state *s, const loxo_index *vertex, int64_t n);

/* Read while other threads may set bits that are not asked for. */
static inline unsigned fast_flags(const fast_state *s, loxo_index v)
{
    return __atomic_load_n(&s->flags[v], __ATOMIC_RELAXED);
}

/* expand.c: the vertices of fresh[begin..end-1], at most FAST_EXPAND_CHUNK: their slopes, and what they emit. */
#define FAST_EXPAND_CHUNK ((int64_t)32)
void fast_expand(fast_state *s, int64_t begin, int64_t end);
/* The same for those of taken_back[begin..end-1]: what their neighbours tell them. */
void fast_ask_again(fast_state *s, int64_t begin, int64_t end);
/* Length of the edge that a ray's last leg comes through. */
double fast_edge_across(const loxo_mesh_view *m, loxo_index ray);
/* Tasks that one vertex emits at most, and steps, for each spoke. */
#define FAST_TASKS_A_SPOKE   2
#define FAST_STEPS_A_SPOKE   3
#define FAST_SPOKES_AT_FIRST 2048
loxo_status fast_reserve_benches(fast_state *s, int64_t n_spokes);
size_t fast_bench_bytes(int64_t n_spokes);
/* Tasks and steps that there is room for at first. */
int64_t fast_lists_at_first(const loxo_mesh_view *m);

#endif
