/* SPDX-License-Identifier: MIT
 * Levels of a multigrid hierarchy and the steps of its set-up. */
#ifndef LOXO_ALGEBRA_MULTIGRID_INTERNAL_H
#define LOXO_ALGEBRA_MULTIGRID_INTERNAL_H

#include "algebra/multigrid.h"
#include "kernel/sparse_kernel.h"

#define MG_MAX_LEVELS 24
#define MG_NONE       ((loxo_index)-1)

/* A prolongation or its transpose. Entries are whole multiples of 1 / MG_ONE, so that rows of a prolongation sum to 1
 * without rounding: on a long strip a constant can be 10^9 times as large as what it stands for on the finer level.
 * Offsets fit 32 bits: these rows have two to three entries, and there are 2^31 of them at most; set-up counts and
 * refuses more. */
#define MG_ONE 16384.0
typedef struct mg_map {
    int64_t n_rows;
    uint32_t *begin; /* [n_rows + 1] */
    loxo_index *column;
    int16_t *value;
} mg_map;

#define MG_BLOCK_ROWS 4096 /* of the smoother, at most; a power of two */
#define MG_MOST_STIFF 8

/* Groups of variables that are corrected together, all from one residual. */
typedef struct mg_stiff {
    int64_t n_groups;
    loxo_index *begin;  /* [n_groups + 1] */
    loxo_index *member; /* [begin[n_groups]] */
    double *step;       /* [begin[n_groups]] what is added to members next */
    int64_t *at;        /* [n_groups] where factors begin */
    float *factor;      /* L D L^T by rows of the lower triangle, with D on the diagonal */
} mg_stiff;

typedef struct mg_level {
    int64_t n, block_rows;
    /* As k_smooth_level; row and column are the caller's matrix's on level 0. */
    int64_t *row;
    loxo_index *column;
    float *weight, *inverse;
    float *excess;     /* NULL: all 0 */
    float *strongest;  /* [n] the largest weight of a row, 0 where none is positive; while the level is set up */
    mg_map up, down;   /* from the next level to this one, and its transpose; none on the last */
    double *x, *y, *b; /* of level 0 only y: x and b are the caller's */
    mg_stiff stiff;
    double *x_more, *b_more; /* of levels that are visited twice a cycle */
} mg_level;

/* A cycle is a list of steps, each one pass over the rows of a level. b NULL: what the cycle is applied to; in, out NULL:
 * its result. */
typedef enum mg_act {
    MG_FORWARD,  /* out from b */
    MG_RESIDUAL, /* out = b - A in */
    MG_BACKWARD, /* out from b and in */
    MG_RESTRICT, /* out = down in; rows of the next level */
    MG_PROLONG,  /* out = in + up b, b of the next level */
    MG_ADD,      /* out += in */
    MG_FIND,     /* steps of stiff groups from b and in */
    MG_TAKE,     /* out changed by them */
    MG_SOLVE,    /* out from b, by the dense factor */
} mg_act;

typedef struct mg_step {
    mg_act act;
    const mg_level *level;
    const double *b, *in;
    double *out;
} mg_step;

struct loxo_multigrid {
    loxo_context *ctx;
    const loxo_csr *matrix;
    double scale; /* level 0 is the matrix times this power of two */
    int n_levels;
    mg_level level[MG_MAX_LEVELS];
    int64_t n_steps;
    mg_step *step; /* [n_steps] of a cycle */
    double *dense; /* factor of the last level; NULL: that one is only smoothed */
};

static inline k_smooth_level mg_rows(const mg_level *level)
{
    return (k_smooth_level){level->row, level->column, level->weight, level->excess, level->inverse};
}

static inline double mg_excess(const mg_level *level, int64_t i)
{
    return level->excess != NULL ? (double)level->excess[i] : 0.0;
}

/* Numbers of the aggregates that variables belong to: aggregate [n] out, MG_NONE for a variable that the smoother alone
 * takes care of. */
loxo_status mg_aggregate(loxo_context *ctx, const mg_level *level, loxo_index *aggregate, int64_t *n_aggregates);
/* transfer.c: level->up and level->down. */
loxo_status mg_make_maps(loxo_context *ctx, mg_level *level, const loxo_index *aggregate, int64_t n_aggregates);
/* coarsen.c: rows of the next level, fine->down * fine * fine->up. */
loxo_status mg_make_coarse(loxo_context *ctx, const mg_level *fine, mg_level *coarse);

/* stiff.c: level->stiff; and, of groups begin..end-1, the steps from the residual of x, and x after them. */
loxo_status mg_find_stiff(loxo_context *ctx, mg_level *level);
void mg_destroy_stiff(loxo_context *ctx, mg_level *level);
void mg_find_steps(const mg_level *level, int64_t begin, int64_t end, const double *b, const double *x);
void mg_take_steps(const mg_level *level, int64_t begin, int64_t end, double *x);
/* cycle.c: the list of steps. */
loxo_status mg_plan_cycle(loxo_multigrid *mg);

/* An edge is strong when its weight is at least this share of the largest weight of either end. */
#define MG_STRONG 0.25f

#endif
