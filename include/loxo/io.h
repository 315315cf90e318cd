/* SPDX-License-Identifier: MIT
 * Reading and writing meshes and fields. Readers treat every file as hostile; writers are atomic: the target is either
 * the whole new file or what it was before. */
#ifndef LOXO_IO_H
#define LOXO_IO_H

#include <loxo/lines.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum loxo_format {
    LOXO_FORMAT_AUTO, /* reading: from the content, the suffix as a hint; writing: from the suffix */
    LOXO_FORMAT_PLY,
    LOXO_FORMAT_OBJ,
    LOXO_FORMAT_OFF,
    LOXO_FORMAT_STL,
    LOXO_FORMAT_GIFTI,      /* .surf.gii, .shape.gii, .gii */
    LOXO_FORMAT_FREESURFER, /* binary triangle surface: lh.white, ... */
    LOXO_FORMAT_VTP,        /* writing only */
    LOXO_FORMAT_NPY,        /* fields only */
    LOXO_FORMAT_CSV,        /* fields only */
} loxo_format;

LOXO_API const char *loxo_format_name(loxo_format format);

typedef struct loxo_read_settings {
    loxo_format format;
    size_t max_bytes; /* of a decompressed stream; 0: as much as the memory limit leaves */
} loxo_read_settings;

LOXO_API loxo_read_settings loxo_read_settings_default(void);

/* Reads a surface. path "-" is standard input; gzip is seen by its first bytes. STL is welded.
 *   soup       out; freed by loxo_soup_destroy; empty when the call fails
 * returns      LOXO_OK; LOXO_ERR_READ, LOXO_ERR_MALFORMED (failure: file, line or byte, element), LOXO_ERR_UNSUPPORTED,
 *              LOXO_ERR_MEMORY, LOXO_ERR_LIMIT, LOXO_ERR_STOPPED. Odd but harmless things are counted warnings.
 * cost         binary PLY near the speed of memory; ascii 100 MB/s a core or more, in parallel */
LOXO_API loxo_status loxo_read_mesh(loxo_context *ctx, const char *path, const loxo_read_settings *settings,
                                    loxo_soup *soup);
/* The same from memory; name is used in messages only. bytes stays the caller's. */
LOXO_API loxo_status loxo_read_mesh_memory(loxo_context *ctx, const void *bytes, size_t n_bytes, const char *name,
                                           const loxo_read_settings *settings, loxo_soup *soup);

/* What a file holds, told before it is read. */
typedef struct loxo_mesh_counts {
    loxo_format format;
    int64_t n_vertices, n_faces; /* triangles, after polygons are cut; -1: the head does not tell */
    int n_fields;
    bool is_float;     /* positions will come as float */
    size_t read_bytes; /* about the most that loxo_read_mesh will hold, its result included */
} loxo_mesh_counts;

/* Counts of a surface, from the first bytes of a file where they tell: PLY, OFF, binary STL, GIFTI, FreeSurfer, gzipped
 * or not. A face may then count as one triangle, however many corners it has. When is_thorough, formats
 * and faces that the head does not tell are counted by passing over the whole. Vertices of STL are those of a closed
 * surface, as nothing but reading it tells more. Memory stays below a megabyte, whatever the file holds or claims.
 * Standard input ("-") is used up.
 * returns      LOXO_OK; the failures of loxo_read_mesh, as far as they show; counts is then not of use
 * cost         the head; for GIFTI, what stands before the triangles; when thorough, at most reading the file */
LOXO_API loxo_status loxo_read_counts(loxo_context *ctx, const char *path, const loxo_read_settings *settings,
                                      bool is_thorough, loxo_mesh_counts *counts);

/* Reads one scalar per vertex: .npy (float or integer, 1-D), .csv or .txt (one number a line, or the last column),
 * .gii (first float array), or the named vertex property of a PLY as "file.ply:name".
 *   value      out, [n] from loxo_allocate
 * returns      as loxo_read_mesh; LOXO_ERR_ARGUMENT */
LOXO_API loxo_status loxo_read_field(loxo_context *ctx, const char *path, double **value, int64_t *n);

/* Reads the numbers of vertices that a file names, such as a solver's sources: a list of numbers (text; blanks, commas or
 * lines between them, # begins a comment), a FreeSurfer .label, or of a GIFTI label, func or shape file those vertices
 * whose value is not zero, as "file.gii:KEY" those whose value is KEY or has the label of that name. gzip is seen.
 *   n_vertices   of the mesh: the numbers must be below, and GIFTI must have as many values
 *   vertex       out, [n] from loxo_allocate, in the order of the file; repeats stay
 * returns        LOXO_OK; LOXO_ERR_READ, LOXO_ERR_MALFORMED (no vertex in it, too), LOXO_ERR_UNSUPPORTED (labels that hold
 *                coordinates only), LOXO_ERR_ARGUMENT (a number of a list out of range), LOXO_ERR_MEMORY, LOXO_ERR_LIMIT,
 *                LOXO_ERR_STOPPED */
LOXO_API loxo_status loxo_read_vertices(loxo_context *ctx, const char *path, int64_t n_vertices, loxo_index **vertex,
                                        int64_t *n);

/* Reads landmarks: named points and curves of a surface.
 * A .border file of Connectome Workbench (version 3, XML): each part of a border is a curve by its name; its vertices are three a
 * point, with barycentric weights, which are made to sum to 1. Or text, a line a point, columns cut by commas or semicolons: the name,
 * and behind it a vertex; or a position of three numbers, for the nearest point of the surface; or three vertices of a face and three
 * weights. Lines of the same name that follow each other are one curve, which is closed when its last point is its first again. A first line
 * whose second column is no number is a header; # begins a comment. gzip is seen.
 *   n_vertices   of the mesh: the numbers must be below, and a border's surface must have as many
 *   landmarks    in: cleared, or as this call left it; out: that, and what the file holds behind it. A failure leaves it as it was
 * returns        LOXO_OK; LOXO_ERR_READ, LOXO_ERR_MALFORMED (nothing in it, too), LOXO_ERR_UNSUPPORTED (another version, a build without
 *                expat), LOXO_ERR_ARGUMENT, LOXO_ERR_MEMORY, LOXO_ERR_LIMIT, LOXO_ERR_STOPPED */
LOXO_API loxo_status loxo_read_landmarks(loxo_context *ctx, const char *path, int64_t n_vertices,
                                         loxo_landmarks *landmarks);

/* Reads points of space: .npy of shape (n, 3), or text with lines of three numbers (commas, semicolons or blanks between
 * them; a first line that does not begin as a number does, and # comments, are fine).
 *   position   out, [n][3] from loxo_allocate, finite
 * returns      as loxo_read_mesh; LOXO_ERR_MALFORMED: no point in it, too; LOXO_ERR_ARGUMENT */
LOXO_API loxo_status loxo_read_points(loxo_context *ctx, const char *path, double **position, int64_t *n);

/* An array of numbers of one to three dimensions, the last index fastest. */
typedef struct loxo_array {
    double *value; /* from loxo_allocate */
    int n_dimensions;
    int64_t shape[3];
} loxo_array;

/* Reads one: .npy of one to three dimensions (booleans, integers, floats), or text with as many numbers on each line as on the first
 * (as loxo_read_points): two dimensions. Those of .npy need not be finite.
 *   array      out; freed by loxo_array_destroy
 * returns      as loxo_read_mesh; LOXO_ERR_MALFORMED: no number in it, too; LOXO_ERR_ARGUMENT */
LOXO_API loxo_status loxo_read_array(loxo_context *ctx, const char *path, loxo_array *array);
LOXO_API void loxo_array_destroy(loxo_context *ctx, loxo_array *array);

/* The shape of one, and what reading it takes: of .npy the head of the file tells; text, and what is packed, is read and let go again.
 *   array      out, without values
 *   peak_bytes out: most bytes at a time of loxo_read_array
 * returns      as loxo_read_array, as far as the head shows it */
LOXO_API loxo_status loxo_read_array_shape(loxo_context *ctx, const char *path, loxo_array *array, size_t *peak_bytes);

typedef struct loxo_write_settings {
    loxo_format format;
    const char *comment; /* one line put into formats that carry comments; may be NULL */
} loxo_write_settings;

LOXO_API loxo_write_settings loxo_write_settings_default(void);

/* Writes a surface with its fields (PLY, VTP: all; GIFTI: the first into the same file as a shape array; OBJ, OFF: none, with a warning).
 * path "-" is standard output. returns LOXO_OK, LOXO_ERR_WRITE, LOXO_ERR_UNSUPPORTED, LOXO_ERR_ARGUMENT, LOXO_ERR_MEMORY */
LOXO_API loxo_status loxo_write_mesh(loxo_context *ctx, const char *path, const loxo_soup *soup,
                                     const loxo_write_settings *settings);
/* Writes one scalar per vertex: .npy (float64), .csv (header `vertex,<name>`), .shape.gii. */
LOXO_API loxo_status loxo_write_field(loxo_context *ctx, const char *path, const char *name, const double *value,
                                      int64_t n, const loxo_write_settings *settings);
/* Writes a matrix [n_rows][n_columns] as .npy (float64), or as .csv without a header. */
LOXO_API loxo_status loxo_write_matrix(loxo_context *ctx, const char *path, const double *value, int64_t n_rows,
                                       int64_t n_columns);
/* Writes an array [shape[0]][..]: .npy (float64) of as many dimensions, or .csv without a header, a line for each value of all
 * indices but the last. */
LOXO_API loxo_status loxo_write_array(loxo_context *ctx, const char *path, const double *value, int n_dimensions,
                                      const int64_t *shape);
/* Writes lines on a surface: .obj (elements l), .vtp, or .csv (line,value,x,y,z: a row a point). "-" gets csv. Lines without points are
 * left out; in the csv the others keep their numbers. */
LOXO_API loxo_status loxo_write_polylines(loxo_context *ctx, const char *path, const loxo_polylines *lines);
/* Whether path could be written now: directory there and writable, not a directory, device or other special file. */
LOXO_API loxo_status loxo_write_check(loxo_context *ctx, const char *path);
/* Writes bytes under the same promise of atomicity. */
LOXO_API loxo_status loxo_write_bytes(loxo_context *ctx, const char *path, const void *bytes, size_t n_bytes);

#ifdef __cplusplus
}
#endif
#endif
