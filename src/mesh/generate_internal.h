/* SPDX-License-Identifier: MIT
 * Inside of the generators: a shape is two functions of an element's number, so any range of it can be made alone, by
 * any thread, in memory or on the way to a file, with the same bits. */
#ifndef LOXO_MESH_GENERATE_INTERNAL_H
#define LOXO_MESH_GENERATE_INTERNAL_H

#include <loxo/mesh.h>

#define LOXO_N_WAVES 24

typedef struct loxo_generator loxo_generator;

/* Elements begin..end-1 into position[0], triangle[0] and on. */
typedef void (*loxo_positions_fn)(const loxo_generator *g, int64_t begin, int64_t end, double (*position)[3]);
typedef void (*loxo_faces_fn)(const loxo_generator *g, int64_t begin, int64_t end, loxo_index (*triangle)[3]);

struct loxo_generator {
    loxo_shape shape;
    uint64_t seed;
    double params[4];             /* with defaults filled in */
    int64_t n_vertices;           /* wanted, then that of the shape */
    int64_t n_faces;              /* 0 until made */
    int64_t smallest;             /* vertices of the smallest mesh of this shape and these params */
    int64_t n_u, n_v;             /* frequency, grid sizes, first and last ring: the shape's own meaning */
    double scale;                 /* the shape's own meaning */
    double wave[LOXO_N_WAVES][4]; /* brain: wave vectors and phases */
    loxo_positions_fn positions;
    loxo_faces_fn faces;
};

/* Checks the settings and makes the generator ready; allocates nothing. LOXO_ERR_ARGUMENT or LOXO_ERR_LIMIT. */
loxo_status loxo_generator_make(loxo_context *ctx, const loxo_generate_settings *settings, loxo_generator *g);
/* In parallel, by the shape's functions. */
void loxo_generator_positions(loxo_context *ctx, const loxo_generator *g, int64_t begin, int64_t end,
                              double (*position)[3]);
void loxo_generator_float_positions(loxo_context *ctx, const loxo_generator *g, int64_t begin, int64_t end,
                                    float (*position)[3]);
void loxo_generator_faces(loxo_context *ctx, const loxo_generator *g, int64_t begin, int64_t end,
                          loxo_index (*triangle)[3]);

/* The shapes: choose the sizes nearest to g->n_vertices and set counts, smallest and functions. */
void loxo_make_icosphere(loxo_generator *g); /* and ellipsoid, bumpy, noisy, brain */
void loxo_make_latlong(loxo_generator *g);
void loxo_make_lattice(loxo_generator *g); /* grid, strip, cylinder, torus */
void loxo_make_rings(loxo_generator *g);   /* disk, annulus */
void loxo_make_genus(loxo_generator *g);

#endif
