/* SPDX-License-Identifier: MIT
 * What the tables and figures of papers share: our meshes with true distances, solves in turns, the search for the best
 * smoothing factor, plots. A table or figure is one file; paper.c lists them. */
#ifndef LOXO_BENCH_PAPER_H
#define LOXO_BENCH_PAPER_H

#include "../bench.h"

/* ---- the list (paper.c) ---- */

loxo_status paper_tao2021_table1(bench *b);
loxo_status paper_tao2021_fig2(bench *b);
loxo_status paper_tao2021_fig4(bench *b);
loxo_status paper_tao2021_fig5(bench *b);
loxo_status paper_tao2021_fig7(bench *b);
loxo_status paper_tao2021_fig8(bench *b);
loxo_status paper_tao2021_fig9(bench *b);
loxo_status paper_tao2021_fig10(bench *b);
loxo_status paper_tao2021_fig11(bench *b);
loxo_status paper_tao2021_fig12(bench *b);
loxo_status paper_tao2021_fig13(bench *b);
loxo_status paper_cantarella2022_fig2(bench *b);
loxo_status paper_cantarella2022_fig4(bench *b);
loxo_status paper_cantarella2022_fig6(bench *b);
loxo_status paper_cantarella2022_fig7(bench *b);
loxo_status paper_cantarella2022_fig8(bench *b);
loxo_status paper_tan2024_table1_2(bench *b);
loxo_status paper_tan2024_table3_fig7(bench *b);
loxo_status paper_tan2024_table4(bench *b);
loxo_status paper_tan2024_table5(bench *b);
loxo_status paper_tan2024_fig3(bench *b);
loxo_status paper_tan2024_fig4_5(bench *b);
loxo_status paper_tan2024_fig6(bench *b);

/* Whether --case lets a model in. */
bool paper_wants(const bench *b, const char *model);
/* Writes FOLDER/FIGURE.json as far as it has come, where --out was given: a run that is ended later has left it. */
loxo_status paper_keep(bench *b);
/* Writes FOLDER/FIGURE-suffix.png where --out was given and this build has PNG. */
loxo_status paper_plot(bench *b, const char *suffix, const loxo_plot *plot);
loxo_status paper_draw(bench *b, const char *suffix, const loxo_mesh_arrays *mesh, const double *value,
                       const loxo_draw_settings *settings);
/* "0.481 %"; "-" for NaN. */
const char *paper_percent(double share, char *text, size_t n);
/* A number with three digits; "-" for NaN. */
const char *paper_number(double value, char *text, size_t n);
json_t *paper_json(double value); /* null for NaN */

/* Whether this build's library has the method. */
bool paper_has_method(const char *name);
/* The methods of --method as columns of a table, with their settings: edge once as in the paper, by ADMM, and once by
 * unfolding; heat and variational once as in the paper, with factors, and once with multigrid. Returns how many. */
#define PAPER_MAX_METHODS (2 * BENCH_MAX_METHODS)
int paper_columns(const bench *b, const char *columns[PAPER_MAX_METHODS]);

/* ---- meshes (mesh.c) ---- */

typedef struct paper_model {
    const char *name;
    const char *file;  /* under the folder of the meshes; NULL: generated */
    const char *exact; /* its distances from vertex 0, under that folder; NULL: none kept there */
    loxo_shape shape;  /* when generated */
} paper_model;

extern const paper_model paper_models[];
const paper_model *paper_model_find(const char *name); /* NULL: none of that name */

/* A mesh as a file, and true distances from vertex 0 to its first n_truth vertices. Subdividing changes no distance: so
 * the truth of a scan serves for all its refinements, as in the paper's section 6.1. */
typedef struct paper_mesh {
    const paper_model *model;
    char path[BENCH_PATH], truth[BENCH_PATH]; /* truth "": not known */
    const char *truth_from;                   /* "kept file", "closed form", "method exact"; "" */
    int n_subdivisions;
    int64_t n_vertices, n_faces, n_truth;
} paper_mesh;

/* The model with about n_wanted vertices: generated, or the file subdivided as often as comes nearest. with_truth: finds
 * true distances, where need be by the method `exact`. LOXO_ERR_UNSUPPORTED when its file is not
 * here, or --case leaves it out. */
loxo_status paper_mesh_make(bench *b, const paper_model *model, double n_wanted, bool with_truth, paper_mesh *mesh);
/* Mean relative error (29) of a file of distances; NaN when the truth is not known. */
double paper_error(bench *b, const paper_mesh *mesh, const char *distances);

/* ---- solves in this process (subject.c) ---- */

/* A mesh in memory. Its pictures and curves need many solves, and no peak of memory. */
typedef struct paper_subject {
    bench *b;
    paper_mesh mesh;
    loxo_soup soup;
    loxo_mesh_arrays arrays;
    loxo_mesh *halfedges;
    double *truth;    /* [n_vertices] from vertex 0; NULL: not known */
    double *distance; /* [n_vertices] of the last solve */
} paper_subject;

/* LOXO_ERR_UNSUPPORTED, with a line printed, where the mesh is not here. */
loxo_status paper_subject_open(bench *b, const char *model, double n_wanted, bool with_truth, paper_subject *s);
/* A scan as it is, or where it is not here the generated model of n_wanted vertices; says which, and how large. */
loxo_status paper_subject_open_either(bench *b, const char *scan, const char *generated, double n_wanted,
                                      bool with_truth, paper_subject *s);
/* A shape with a generator's parameter. */
loxo_status paper_subject_generate(bench *b, loxo_shape shape, double n_wanted, double param, paper_subject *s);
void paper_subject_close(paper_subject *s);
/* Distances from sources by a method with settings. */
loxo_status paper_subject_solve(paper_subject *s, const char *method, const loxo_index *sources, int64_t n_sources,
                                loxo_geodesic_info *info);
/* Fills truth by the method `exact`, for these sources; leaves it NULL where this build lacks that. */
loxo_status paper_subject_find_truth(paper_subject *s, const loxo_index *sources, int64_t n_sources);
/* (29) of the last solve's distances against truth [n_vertices]; NaN when that is NULL. */
double paper_subject_error(paper_subject *s, const double *truth);

/* A picture of the last solve's distances, as paper_plot. */
loxo_status paper_picture(const paper_subject *s, const char *suffix, const char *title);

/* Rows with and without the global conditions (23)-(26); pictures of the paper's setting (constraints.c). Columns:
 * PAPER_CONSTRAINT_HEADS. */
#define PAPER_CONSTRAINT_HEADS                                                                                         \
    "mesh|vertices|method|iterations|error without|error with|conditions|seconds without|seconds with"
loxo_status paper_with_and_without(paper_subject *s, const char *name, const loxo_index *sources, int64_t n_sources,
                                   bench_table *table);

/* ---- other triangulations of the same surface (retriangulate.c) ---- */

/* Every edge split at a share of its length, from its lower vertex, every face in four. The old vertices come first. */
loxo_status paper_split_edges(loxo_context *ctx, const loxo_mesh_arrays *arrays, double share, loxo_soup *soup);
/* Split so at 0.5, twice; then edges inside what is flat are flipped to longer ones, as long as there are any, at a share of
 * the half-edges. */
loxo_status paper_lengthen_edges(loxo_context *ctx, const loxo_mesh_arrays *arrays, double share, loxo_soup *soup);

/* ---- solves in turns (rounds.c) ---- */

#define PAPER_MAX_JOBS (PAPER_MAX_METHODS + BENCH_MAX_PEERS)

typedef struct paper_job {
    char method[128]; /* name and settings, as "edge,time-factor=2"; of a peer its name */
    const bench_peer *peer;
    int n_threads;
    double predicted_s; /* of create and one solve; 0: not predicted yet; NaN: nothing to predict it from */
    /* results */
    char failure[BENCH_CELL]; /* "" when it ran */
    char note[BENCH_CELL];    /* name of a status other than LOXO_OK; rounds, where there were fewer; "" */
    bench_stat total_s, create_s, solve_s, peak_bytes;
    bench_stat phase_s[LOXO_GEODESIC_N_PHASES];
    bench_stat ratio; /* of a peer: its time over that of the first job in the same round */
    double updates;   /* of the diffusion, a vertex */
    double error;     /* (29); NaN: not known */
} paper_job;

/* A method's text with the paper's recovery, ADMM, where it names none; and its settings. */
void paper_method_text(const char *method, char *text, size_t size);
loxo_status paper_method_settings(bench *b, const char *method, loxo_geodesic_settings *settings);
/* Runs every job once a round, in turns, each in a process of its own, --repeats rounds; a method that has taken
 * --solve-seconds by then rests. The distances of the first round are compared with the truth. What does not fit by its own
 * estimate is not run, nor what is predicted to take longer than --solve-seconds: failure says so. */
loxo_status paper_rounds(bench *b, const paper_mesh *mesh, int n_jobs, paper_job *jobs);
/* Adds the peers of --compare-with that can run with so many threads. Returns the new number of jobs. */
int paper_add_peers(const bench *b, int n_threads, int n_jobs, paper_job jobs[PAPER_MAX_JOBS]);

/* ---- before a solve is run (predict.c) ---- */

/* Bytes that a solve will take by the library's own estimate, mesh and result included. */
size_t paper_predict_bytes(bench *b, const char *method, int64_t n_vertices, int64_t n_faces);
/* What a process may take: --max-memory, or what the context grants. */
size_t paper_memory_limit(const bench *b);
/* The same surface with about 250,000 vertices, with truth where mesh has it; mesh itself when that is no larger. */
loxo_status paper_mesh_coarsen(bench *b, const paper_mesh *mesh, paper_mesh *coarse);
/* How many times longer a solve takes on the one mesh than on the other. */
double paper_growth(bench *b, const char *method, const paper_mesh *from, const paper_mesh *to);
/* Of create and one solve, from a solve on the coarse mesh; NaN when mesh itself is that. */
double paper_predict_seconds(bench *b, const paper_mesh *mesh, const char *method, int n_threads);

/* ---- the smoothing factor m of (28) (search.c) ---- */

typedef struct paper_search {
    double m;             /* of the least error; NaN where the truth is not known or no solve succeeded */
    double error_at_one;  /* at m = 1; NaN where that was not tried */
    double predicted_s;   /* as of a job */
    char how[BENCH_CELL]; /* solves that it took, and on which mesh */
} paper_search;

/* Whether the method diffuses heat over t = m h^2. */
bool paper_is_heat(const char *method);
void paper_search_m(bench *b, const paper_mesh *mesh, const char *method, int n_threads, paper_search *found);

#endif
