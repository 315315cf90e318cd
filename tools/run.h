/* SPDX-License-Identifier: MIT
 * One run of a command: context, signals, progress, files to be written, and how it ends. */
#ifndef LOXO_TOOLS_RUN_H
#define LOXO_TOOLS_RUN_H

#include "args.h"
#include "report.h"

#include <loxo/loxo.h>

#define CLI_MAX_FILES 32

typedef struct cli_run {
    const cli_command *command;
    const cli_common *common;
    cli_args args;
    loxo_context *ctx;
    cli_report report;
    const char *input;     /* the mesh file, for messages; NULL when there is none */
    const char *json_path; /* NULL: none */
    loxo_status status;    /* the worst positive one so far */
    loxo_failure failure;  /* of the command itself; goes before the context's when its status is set */
    double start_s;
    size_t limit_bytes;              /* of memory, as asked for or granted */
    size_t program_bytes;            /* resident before anything was done */
    bool bar, bar_drawn;             /* progress is shown; a bar stands on the terminal's line now */
    const char *file[CLI_MAX_FILES]; /* to be written, in the order they were announced */
    int n_files;
} cli_run;

/* Starts: signal handlers, and the context from the common options. The arguments were parsed into run->args. */
loxo_status cli_run_begin(cli_run *run, const cli_command *command, const cli_common *common);
/* Prints warnings, the error or the rows, writes the JSON report, frees everything. Returns the exit code. */
int cli_run_end(cli_run *run, loxo_status status);

/* An error that the command itself found. Returns status. */
loxo_status cli_fail(cli_run *run, loxo_status status, const char *format, ...) __attribute__((format(printf, 3, 4)));
/* The same at a line of a file. */
loxo_status cli_fail_at(cli_run *run, loxo_status status, const char *file, int64_t line, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
/* After a call that refused something: where it names an element, this file holds it and is malformed. Returns the status. */
loxo_status cli_blame(cli_run *run, loxo_status status, const char *file);
/* Something odd but harmless that the command itself found. */
void cli_warn(cli_run *run, int64_t count, const char *format, ...) __attribute__((format(printf, 3, 4)));
/* The same for every option or flag of this name, or of a group of this title, that was given and changes nothing. why: "without
 * --picture". */
void cli_warn_idle(cli_run *run, const char *name, const char *why);
/* All that the command's list says of what was given. */
void cli_warn_needs(cli_run *run);
/* Keeps the worst positive status, by its exit code; returns it. Negative ones pass through. */
loxo_status cli_combine(cli_run *run, loxo_status status);

/* Announces a file to be written: it must be possible and new, so that no long work is done for nothing. */
loxo_status cli_output(cli_run *run, const char *path);
/* Asked before the first file is written: LOXO_ERR_STOPPED after a signal, unless partial results are wanted; those
 * are then written to the end. */
loxo_status cli_before_output(cli_run *run);
/* Notes that a file was written. It gets its name at the end of the run, together with all others, or never. */
void cli_wrote(cli_run *run, const char *path);

typedef enum cli_kind { CLI_MESH, CLI_FIELD } cli_kind; /* a file holds a mesh (with fields), or one number a vertex */

/* What to write: by --format if format_name is not NULL, else by the suffix. kind comes in as what the command writes
 * where a format can hold either (GIFTI), and goes out as what this file holds; meshes_only refuses fields. */
loxo_status cli_output_format(cli_run *run, const char *path, const char *format_name, bool meshes_only,
                              loxo_format *format, cli_kind *kind);

/* Reads the mesh and reports it; run->input is set. */
loxo_status cli_read_mesh(cli_run *run, const char *path, loxo_soup *soup);
/* Seconds under a name, in the JSON object "seconds"; returns the clock's time now. */
double cli_seconds(cli_run *run, const char *name, double since_s);

#endif
