/* SPDX-License-Identifier: MIT
 * Inside of the parallel heat method: its workspace, laid out once, and the phases of a solve. */
#ifndef LOXO_GEODESIC_PARALLEL_HEAT_INTERNAL_H
#define LOXO_GEODESIC_PARALLEL_HEAT_INTERNAL_H

#include "base/arena.h"
#include "base/context.h"
#include "kernel/diffusion_kernel.h"
#include "kernel/variants.h"
#include "mesh/mesh_internal.h"
#include "mesh/topology.h"
#include "solver/geodesic/engine.h"

#define MAX_UPDATES 400 /* a level that has not settled after so many is left to settle.c */
/* Rows of a level are relaxed in blocks of so many; neighbours in other blocks of the level count with their value of
 * the step before. Part of the answer: another number gives other bits. */
#define BLOCK_ROWS 64
/* Of LOXO_DIFFUSION_SWEEPS: scales of a level, and of a vertex and its inner neighbours, are at most so far apart. */
#define OCTAVES_APART 32

/* Blocks, counted in their level, that a block's rows have neighbours in: first to last of the level inside, of its own and
 * of the level outside; last before first: none. */
typedef struct block_reach {
    int32_t first[3], last[3];
} block_reach;

/* Where the rows of a level in flight stand: one more than it has places, which ends the last, and their entries. */
typedef struct level_rows {
    int64_t row, entry, n_entries;
} level_rows;

/* Arrays in breadth-first order stand at index p («place»), those of the mesh at v or f or h. */
typedef struct parallel_heat {
    const geodesic_problem *problem;
    loxo_context *ctx;
    const loxo_mesh *mesh;
    loxo_mesh_view m;
    loxo_geodesic_settings settings;
    const k_variant *kernels;

    double mean_edge_length, time;
    double area; /* in units of mean_edge_length^2 */
    int64_t n_boundary_edges;
    loxo_chains cycles;
    double clock_s;
    bool has_heat;
    bool is_rank_clear;        /* no vertex has a rank */
    const loxo_index *touched; /* [n_touched] vertices that the last solve was limited to; NULL: none */
    int64_t n_touched;
    int64_t last_needed;       /* level that a limited solve needs; see limited.c */
    const double *given_value; /* of the next solve, caller's order; NULL: none */
    const int32_t *given_scale;
    /* During a solve with sources inside faces or edges; else NULL. */
    double *start_heat, *start_distance; /* of each place of level 0 */
    const geodesic_seed *seeds;          /* [n_seeds] */
    int64_t n_seeds;
    bool is_given; /* the heat of this solve: nothing is known of its sources */

    loxo_arena arena;
    size_t loose_begin; /* from here on the block is a solve's own */
    /* breadth-first levels of the current sources: 3 arrays of 4 bytes a vertex, and a little */
    loxo_index *order;       /* [n_vertices] place -> vertex; the reached ones first */
    loxo_index *rank;        /* [n_vertices] vertex -> place; -1 not reached */
    loxo_index *parent;      /* [n_vertices] place -> place of the vertex that found it, -1 at sources */
    loxo_index *level_begin; /* [most_levels + 1] level -> its first place */
    loxo_index *more_levels; /* where level_begin stands when a surface is long and thin; an allocation of its own */
    int64_t most_levels, n_levels, n_reached;

    /* heat: value * 2^scale, at place p in value[2 p] and, once final, also in value[2 p + 1] */
    double *value;  /* [2 n_vertices]; after the recovery value[2 p + 1] is the distance */
    int32_t *scale; /* [n_vertices] */

    /* one stretch of memory, used by the diffusion first, then by the recovery */
    float *first;       /* [n_vertices] first estimate, in the unit of scale */
    k_change *change;   /* [n_ring] of the blocks of the levels in flight, and */
    block_reach *reach; /* [n_ring] whom they look at, see heat_block */
    int64_t n_ring;
    uint32_t *degree;    /* [n_vertices] entries of a place, until first takes its room */
    k_row *ring_row;     /* [n_ring_rows] */
    k_entry *ring_entry; /* [n_ring_entries] */
    int64_t n_ring_rows, n_ring_entries;
    /* rows of the levels in flight, see window.c */
    k_row *row;     /* [row_room] */
    k_entry *entry; /* [entry_room] */
    int64_t row_room, entry_room, row_end, entry_end, oldest_level;
    bool has_all_levels;
    level_rows *level_rows; /* during a diffusion */
    k_row *more_rows;       /* where row and entry stand when the rings do not hold the window; */
    k_entry *more_entries;  /* allocations of their own */

    double *distance; /* [n_vertices] the result in the mesh's order; of ADMM over found_by and what follows */
    /* recovery by unfolding, after distance; see unfold.c */
    uint32_t *heat_key;    /* [n_vertices] */
    loxo_index *waits_for; /* [n_vertices] edges to hotter neighbours that are not done */
    loxo_index *queue;     /* [n_vertices] over order */

    loxo_index *found_by; /* [n_vertices] in the mesh's order: the vertex above in the tree, see tree.h; -1: none */
    /* heat in the mesh's order, while the directions are made */
    double *vertex_value;  /* [n_vertices] */
    int32_t *vertex_scale; /* [n_vertices] K_NOT_REACHED where there is none */

    /* edge-based recovery, over the same stretch; see admm_edge.c */
    double *closure;      /* [n_faces], over vertex_value and vertex_scale */
    double *multiplier;   /* [n_faces] */
    double *potential[2]; /* [n_faces] */
    double *difference;   /* [3 n_faces], over multiplier and potential, before ADMM begins */
    /* face-based recovery, over the same stretch; see admm_face.c */
    double *face_area;          /* [n_faces] */
    double (*side_square)[3];   /* [n_faces] squared lengths of its half-edges */
    double (*target)[2];        /* [n_faces] h, by its products with the first two half-edges */
    double (*face_gradient)[2]; /* [n_faces] g, alike */
    double *push[2];            /* [3 n_faces]; over the second vertex_value and vertex_scale */
} parallel_heat;

/* What a phase tells besides its status. */
typedef struct diffusion_result {
    int64_t n_updates, max_window, n_nonpositive;
    int64_t n_reached;   /* places */
    int64_t needed_step; /* in which level last_needed was left */
    int64_t n_forced;    /* levels left before they were calm; settling makes that good */
    int64_t n_unsettled; /* cells of 64 places that settling could not calm either */
    double change;       /* estimate of the directions' change still to come */
    bool is_settled;     /* it is within the tolerance everywhere */
    bool stopped;
} diffusion_result;

/* Where block b of a level stands in the ring. Levels of the window never meet there: it has room for all blocks of the
 * mesh were they full, and for one that is not in each of MAX_UPDATES levels and some more. */
static inline int64_t heat_block(const parallel_heat *g, int64_t level, int64_t b)
{
    return (g->level_begin[level] / BLOCK_ROWS + level + b) % g->n_ring;
}

/* levels.c: breadth-first levels from sources (places 0..n-1, sorted, without repeats), and degree. */
loxo_status heat_find_levels(parallel_heat *g, const loxo_index *sources, int64_t n_sources);

/* parallel_heat.c: names the pieces of the workspace, twice: to add up their sizes, and to hand them out. */
void heat_lay_out(parallel_heat *g);
/* From the seeds to distances in the mesh's order; then heat_end. */
loxo_status heat_find_distances(parallel_heat *g, const geodesic_seed *seeds, int64_t n_seeds, double *distance,
                                diffusion_result *diffusion, loxo_geodesic_info *info);

/* limited.c: the same within settings.max_distance. *is_done false: the ball is too large for the room, nothing was done. */
loxo_status heat_solve_limited(parallel_heat *g, const geodesic_seed *seeds, int64_t n_seeds, double *distance,
                               diffusion_result *diffusion, loxo_geodesic_info *info, bool *is_done);

/* starts.c: levels from the seeds; then until heat_end level 0 has what it starts with. */
loxo_status heat_begin(parallel_heat *g, const geodesic_seed *seeds, int64_t n_seeds);
void heat_end(parallel_heat *g);
/* ... and what faces with sources inside want, over what heat wants there, as heat_fill_flat_faces. */
loxo_status heat_aim_from_seeds(parallel_heat *g, double *difference);

/* diffusion.c */
loxo_status heat_march(parallel_heat *g, diffusion_result *result);
loxo_status heat_sweep(parallel_heat *g, diffusion_result *result);

/* settle.c: relaxes places that the march left unsettled until they are not. Not of a method that unfolds. */
void heat_settle(parallel_heat *g, double tolerance, diffusion_result *result);

/* window.c: room for a level's rows, from when it is taken in until the oldest one that is needed is a later one.
 * LOXO_ERR_MEMORY: the window is wider than the workspace's rings, and there is no memory for more. */
loxo_status heat_window_begin(parallel_heat *g, bool all);
void heat_window_end(parallel_heat *g);
loxo_status heat_window_take_in(parallel_heat *g, int64_t level);
void heat_window_leave(parallel_heat *g, int64_t oldest);
/* That of a place of a level in flight; those of the level's other places stand beside it. */
k_row *heat_row(const parallel_heat *g, int64_t level, int64_t place);

/* diffusion_rows.c: rows of all places after the diffusion, for relaxing in place; row [n_reached + 1]. */
void heat_make_all_rows(const parallel_heat *g, k_row *row, k_entry *entry);
/* ... the three acts that make the rows of a block of places of one level. */
void heat_build_rows(parallel_heat *g, int64_t level, int64_t begin, int64_t end, bool is_plain);
void heat_link_level(parallel_heat *g, int64_t level, int64_t begin, int64_t end);
void heat_link_outward(parallel_heat *g, int64_t level, int64_t begin, int64_t end);

/* Chains of global constraints: cycles of the mesh and paths between sources. */
loxo_status heat_find_chains(parallel_heat *g, int64_t n_sources, loxo_chains *chains);

/* admm_edge.c, admm_face.c: from the heat to differences along the tree's edges, in value[2 p + 1]. */
loxo_status heat_recover_edge(parallel_heat *g, const loxo_chains *chains, loxo_geodesic_info *info);
loxo_status heat_recover_face(parallel_heat *g, const loxo_chains *chains, loxo_geodesic_info *info);

/* flat_faces.c: differences along the three half-edges of each face that has no direction, in place, and of the
 * face-based method targets. LOXO_OK, LOXO_ERR_MEMORY. */
loxo_status heat_fill_flat_faces(parallel_heat *g, double *difference);

/* From value, scale and parent, at places, to vertex_value, vertex_scale and found_by. */
void heat_to_vertices(parallel_heat *g);

/* The settings', or what unfolding needs where that is not said: an order of neighbours is soon right. */
double heat_tolerance(const loxo_geodesic_settings *settings);
/* Whether distances are found by unfolding. */
bool heat_unfolds(const loxo_geodesic_settings *settings);
/* unfold.c: from the heat to distances in the mesh's order. True: stopped, what was not done yet is not a number. */
bool heat_unfold(parallel_heat *g, double *distance, int64_t *n_passes);

/* integrate.c: sums the differences outward, in place. */
void heat_integrate(parallel_heat *g);

/* parallel_heat.c: adds the time since the last call to a phase; tells the monitor of an ADMM iteration. */
void heat_clock(parallel_heat *g, loxo_geodesic_phase phase, loxo_geodesic_info *info);
bool heat_tell_iteration(parallel_heat *g, int64_t iteration, const loxo_geodesic_info *info);

#endif
