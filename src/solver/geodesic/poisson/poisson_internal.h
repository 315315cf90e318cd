/* SPDX-License-Identifier: MIT
 * Inside of the heat methods that recover the distance by Poisson equations. */
#ifndef LOXO_GEODESIC_POISSON_INTERNAL_H
#define LOXO_GEODESIC_POISSON_INTERNAL_H

#include "algebra/cg.h"
#include "algebra/cholesky.h"
#include "algebra/multigrid.h"
#include "solver/geodesic/parallel_heat/parallel_heat_internal.h"

#define POISSON_TOLERANCE 1e-8 /* of conjugate gradients */

/* Vertices, ascending, and their distances where they are held. */
typedef struct poisson_held {
    int64_t n;
    loxo_index *vertex;
    double *value; /* NULL: of no use */
} poisson_held;

/* Held vertices that the factor does not know of: forces keep those of a component level. */
typedef struct poisson_ties {
    int64_t n_groups;   /* components with several; 0: nothing is tied */
    int64_t *begin;     /* [n_groups + 1] */
    loxo_index *vertex; /* [begin[n_groups]] */
    double *factor;     /* of each group of n the dense factor for n - 1, one after the other */
    double *force;      /* [size of the largest group] */
} poisson_ties;

enum { POISSON_NO_SEED, POISSON_ONE_SEED, POISSON_HELD };

typedef struct poisson {
    const geodesic_problem *problem;
    loxo_context *ctx;
    loxo_mesh_view m;
    loxo_geodesic_settings settings;
    double clock_s;
    size_t metered_bytes,
        factor_bytes[2]; /* held, by the context's meter; and what CHOLMOD holds: of the heat, of distances */
    int64_t n_rounded;   /* equations of this solve that rounding ended before the tolerance */
    double worst;        /* ... the largest residual of these */

    /* components, by the matrix: label [n_vertices], NULL where there is one */
    loxo_index *label;
    int64_t n_sets;
    double *set_shift;   /* [n_sets] what is taken off distances; +infinity: no source there */
    char *set_seed;      /* [n_sets] whether the seeds of the component are held */
    loxo_index *ground;  /* [n_sets] its first vertex, ascending */
    poisson_held held;   /* vertices of several sources, by this solve */
    poisson_held pinned; /* in the matrix or factor as it is, when is_ready: held ones; grounds, of factors */
    poisson_ties ties;   /* of held ones that are not pinned */
    bool is_ready;
    bool is_whole; /* the matrix is there, and pins none */

    /* LOXO_FACTOR_CHOLESKY */
    loxo_cholesky *poisson_factor;
    loxo_cholesky *heat_factor[2]; /* natural boundary; heat 0 at the boundary, where there is one */
    double *heat;                  /* [n_vertices] */
    int32_t *heat_scale;           /* [n_vertices] */
    /* LOXO_FACTOR_MULTIGRID */
    loxo_csr matrix;
    loxo_multigrid *multigrid;
    loxo_cg *cg;
    geodesic_problem marching_problem; /* ours, for the edge-based method, whose diffusion is used */
    parallel_heat *marching;

    double *field;      /* [3 n_faces] see poisson_kernel.h; in the marching method's workspace, where there is one */
    double *own_field;  /* else here */
    double *right_side; /* [n_vertices] */
    double *dual;       /* [2 n_faces] q of the variational method, else NULL */
} poisson;

/* The component of a vertex. */
static inline int64_t poisson_set_of(const poisson *p, int64_t v) { return p->label != NULL ? p->label[v] : 0; }

void poisson_clock(poisson *p, loxo_geodesic_phase phase, loxo_geodesic_info *info);

/* heat.c: what the mesh alone decides of the heat; then, from the seeds, field: the products of the direction in which heat
 * falls with the half-edges. */
loxo_status poisson_prepare_heat(poisson *p);
loxo_status poisson_find_field(poisson *p, const geodesic_seed *seeds, int64_t n_seeds, double *work,
                               loxo_geodesic_info *info);

/* recover.c: matrices or factors of the Poisson equation, once and again for other pinned vertices; the distance, up to
 * constants of components that hold none, from field, which is used up. */
loxo_status poisson_prepare_recovery(poisson *p);
loxo_status poisson_renew(poisson *p);
loxo_status poisson_solve_field(poisson *p, double *distance, loxo_geodesic_info *info);
/* Makes distances vanish at the seeds, and infinite in components without. */
loxo_status poisson_shift(poisson *p, const geodesic_seed *seeds, int64_t n_seeds, double *distance);

/* hold.c: what is held for these seeds, and the matrix or factor, and the ties, that hold it. Before a solve: what held distances make of the field is taken
 * out of it, and they are put to 0; after it they are put back. */
loxo_status poisson_hold(poisson *p, const geodesic_seed *seeds, int64_t n_seeds);
void poisson_take_held(poisson *p, double *distance);
void poisson_put_held(const poisson *p, double *distance);
void poisson_release_held(poisson *p, poisson_held *held);

/* ties.c: ties of the vertices held, by the factor as it is; false in *is_tied: they are not safely independent. Then, of a
 * distance y = C^-1 b by the factor, with b in right_side, the one that is level at them. */
loxo_status poisson_tie(poisson *p, bool *is_tied);
loxo_status poisson_pull_ties(poisson *p, double *distance);
void poisson_release_ties(poisson *p);

/* variational.c: moves the distance of the heat method to less (|grad d| - 1)^2. */
loxo_status poisson_vary(poisson *p, double *distance, loxo_geodesic_info *info);

#endif
