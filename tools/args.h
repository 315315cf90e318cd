/* SPDX-License-Identifier: MIT
 * Command lines: what a command takes, how that is parsed, and its help text. Settings come from the options tables of
 * the library; what has no settings struct behind it (files, lists) is a flag. */
#ifndef LOXO_TOOLS_ARGS_H
#define LOXO_TOOLS_ARGS_H

#include "base/options.h"

#include <stdio.h>

/* An option that is kept as text. */
typedef struct cli_flag {
    const char *name;
    char letter;        /* 0: none */
    const char *values; /* as "FILE" or "V FILE" */
    int n_values;       /* 0, 1 or 2 */
    bool repeats;       /* may be given more than once */
    bool reads;         /* its value names a file that is read; - is standard input */
    const char *help;
} cli_flag;

/* Options of one table; the settings lie at an offset in the command's own struct. */
typedef struct cli_group {
    const char *title; /* in the help and in JSON */
    const loxo_option *options;
    size_t offset;
} cli_group;

/* An option, a flag or all options of a group that change nothing unless another is given; NULL: whatever is given. */
typedef struct cli_need {
    const char *name, *other;
} cli_need;

struct cli_run;

typedef struct cli_command {
    const char *name;
    const char *operands; /* as "IN -o OUT" */
    const char *summary;  /* one line */
    const char *about;    /* a few lines, each ends with a newline */
    const char *examples; /* lines, each ends with a newline */
    int min_operands, max_operands;
    const cli_flag *flags;   /* ends with name NULL */
    const cli_group *groups; /* ends with title NULL */
    const cli_need *needs;   /* ends with name NULL; may be NULL */
    size_t state_bytes;      /* the command's struct; cli_common stands first */
    void (*defaults)(void *state);
    void (*more_help)(FILE *out); /* printed behind about; may be NULL */
    loxo_status (*main)(struct cli_run *run, void *state);
} cli_command;

/* What every command takes; first in every command's struct. */
typedef struct cli_common {
    int n_threads;
    size_t max_memory;
    int isa;
    bool quiet, verbose, strict, keep_partial, settings, estimate;
} cli_common;

extern const loxo_option cli_common_options[];
extern const cli_flag cli_common_flags[];
const char *cli_isa_name(loxo_isa isa);

/* A flag, or an option of a table, whose value is in the settings. */
typedef struct cli_given {
    const cli_flag *flag;
    const loxo_option *option;
    const char *value[2];
} cli_given;

typedef struct cli_args {
    cli_given *given; /* flags and options, in the order of the command line */
    int n_given;
    const char **operand;
    int n_operands;
    bool help;
} cli_args;

/* Parses argv[0..argc-1] (the words behind the command's name) into args and the command's state.
 * On LOXO_ERR_ARGUMENT or LOXO_ERR_MEMORY text holds the one-line reason. */
loxo_status cli_args_parse(const cli_command *command, loxo_context *ctx, int argc, char **argv, void *state,
                           cli_args *args, char *text, size_t n_text);
void cli_args_destroy(cli_args *args);

/* Value i of the last time a flag was given; NULL when it was not. */
const char *cli_args_value(const cli_args *args, const char *name, int i);
bool cli_args_has(const cli_args *args, const char *name);
/* Whether an option of a table was, whatever its value. */
bool cli_args_has_option(const cli_args *args, const loxo_option *option);
const char *cli_given_name(const cli_given *given);
/* Whether it has this name, or its group this title. */
bool cli_given_is(const cli_command *command, const cli_given *given, const char *name);
/* The values of a repeatable flag one by one: *cursor starts at 0; NULL at the end. */
const char *cli_args_next(const cli_args *args, const char *name, int *cursor);

void cli_help(const cli_command *command, FILE *out);
/* Every setting as "name = value", under its group's title. */
void cli_settings_print(const cli_command *command, const void *state, FILE *out);
/* The word for a value of this option in help and messages. */
const char *cli_option_values(const loxo_option *option, char *text, size_t n_text);

/* Letters to change, add or drop to come from one name, of n_a letters, to the other; names are short. */
int cli_edit_distance(const char *a, size_t n_a, const char *b);
/* Numbers separated by commas, nothing else; how many there are, or -1 (not numbers, or more than max). */
int cli_parse_numbers(const char *text, double *number, int max);
/* A decimal integer and nothing else. */
bool cli_parse_integer(const char *text, size_t n_text, int64_t *number);

#endif
