/* SPDX-License-Identifier: MIT
 * getopt_long fed from the tables. It runs in the mode that hands operands over in order, so that the word it looks at
 * is known: names must be written out, and options of two values are possible. */
#include "args.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const isa_names[] = {"auto", "baseline", "avx2", "avx512", NULL};

const char *cli_isa_name(loxo_isa isa) { return isa_names[isa]; }

const loxo_option cli_common_options[] = {
    {.name = "threads",
     .type = LOXO_OPTION_INT,
     .offset = offsetof(cli_common, n_threads),
     .max = 4096,
     .help = "threads; 0: OMP_NUM_THREADS, else the processors granted"},
    {.name = "max-memory",
     .type = LOXO_OPTION_SIZE,
     .offset = offsetof(cli_common, max_memory),
     .max = 0x1p62,
     .help = "memory limit, as 8G; 0: 80 % of what is granted"},
    {.name = "isa",
     .type = LOXO_OPTION_CHOICE,
     .offset = offsetof(cli_common, isa),
     .max = 3,
     .choices = isa_names,
     .help = "instruction set of the kernels; the results are the same"},
    {.name = "quiet",
     .type = LOXO_OPTION_BOOL,
     .offset = offsetof(cli_common, quiet),
     .max = 1,
     .help = "only errors and warnings on standard error"},
    {.name = "verbose",
     .type = LOXO_OPTION_BOOL,
     .offset = offsetof(cli_common, verbose),
     .max = 1,
     .help = "more rows"},
    {.name = "strict",
     .type = LOXO_OPTION_BOOL,
     .offset = offsetof(cli_common, strict),
     .max = 1,
     .help = "exit 1 when there were warnings"},
    {.name = "keep-partial",
     .type = LOXO_OPTION_BOOL,
     .offset = offsetof(cli_common, keep_partial),
     .max = 1,
     .help = "write what there is when stopped by a signal"},
    {.name = "settings",
     .type = LOXO_OPTION_BOOL,
     .offset = offsetof(cli_common, settings),
     .max = 1,
     .help = "print the settings that would be used, and stop"},
    {.name = "estimate",
     .type = LOXO_OPTION_BOOL,
     .offset = offsetof(cli_common, estimate),
     .max = 1,
     .help = "print the bytes and seconds it would take, and stop"},
    {.name = NULL},
};

const cli_flag cli_common_flags[] = {
    {.name = "json", .values = "FILE", .n_values = 1, .help = "report for machines; - is standard output"},
    {.name = "help", .letter = 'h', .help = "this text"},
    {.name = NULL},
};

static const cli_group common_group = {"common", cli_common_options, 0};

#define FIRST_TARGET 256

/* What a long option means. */
typedef struct target {
    const cli_flag *flag;
    const loxo_option *option;
    const cli_group *group;
} target;

typedef struct parser {
    const cli_command *command;
    struct option *longs; /* ends with a row of zeros */
    target *targets;
    int n_targets;
    char letters[64];
} parser;

static void add_flags(parser *p, const cli_flag *flags)
{
    size_t n = strlen(p->letters);
    for (; flags->name != NULL; ++flags) {
        p->longs[p->n_targets] = (struct option){flags->name, flags->n_values > 0 ? required_argument : no_argument,
                                                 NULL, FIRST_TARGET + p->n_targets};
        p->targets[p->n_targets++] = (target){.flag = flags};
        if (flags->letter != 0 && n + 3 < sizeof p->letters) {
            p->letters[n++] = flags->letter;
            if (flags->n_values > 0) p->letters[n++] = ':';
        }
    }
    p->letters[n] = '\0';
}

static void add_group(parser *p, const cli_group *group)
{
    for (const loxo_option *o = group->options; o->name != NULL; ++o) {
        p->longs[p->n_targets] =
            (struct option){o->name, o->type == LOXO_OPTION_BOOL ? optional_argument : required_argument, NULL,
                            FIRST_TARGET + p->n_targets};
        p->targets[p->n_targets++] = (target){.option = o, .group = group};
    }
}

static int count_flags(const cli_flag *flags)
{
    int n = 0;
    while (flags[n].name != NULL)
        ++n;
    return n;
}

static int count_options(const loxo_option *options)
{
    int n = 0;
    while (options[n].name != NULL)
        ++n;
    return n;
}

static bool parser_create(parser *p, const cli_command *command)
{
    int n = count_flags(cli_common_flags) + count_flags(command->flags) + count_options(cli_common_options);
    for (const cli_group *g = command->groups; g->title != NULL; ++g)
        n += count_options(g->options);
    *p = (parser){.command = command, .letters = "-:"};
    p->longs = calloc((size_t)n + 1, sizeof *p->longs);
    p->targets = calloc((size_t)n + 1, sizeof *p->targets);
    if (p->longs == NULL || p->targets == NULL) return false;
    add_flags(p, command->flags);
    for (const cli_group *g = command->groups; g->title != NULL; ++g)
        add_group(p, g);
    add_group(p, &common_group);
    add_flags(p, cli_common_flags);
    return true;
}

static void parser_destroy(parser *p)
{
    free(p->longs);
    free(p->targets);
}

int cli_edit_distance(const char *a, size_t n_a, const char *b)
{
    enum { MOST = 40 };
    int row[MOST + 1];
    const size_t n_b = strlen(b);
    if (n_a > MOST || n_b > MOST) return MOST;
    for (size_t j = 0; j <= n_b; ++j)
        row[j] = (int)j;
    for (size_t i = 1; i <= n_a; ++i) {
        int diagonal = row[0];
        row[0] = (int)i;
        for (size_t j = 1; j <= n_b; ++j) {
            const int changed = diagonal + (a[i - 1] != b[j - 1]);
            const int shorter = row[j] < row[j - 1] ? row[j] + 1 : row[j - 1] + 1;
            diagonal = row[j];
            row[j] = changed < shorter ? changed : shorter;
        }
    }
    return row[n_b];
}

static loxo_status unknown_option(const parser *p, const char *word, char *text, size_t n_text)
{
    const char *name = word[0] == '-' && word[1] == '-' ? word + 2 : word;
    const size_t n_name = strcspn(name, "=");
    const char *best = NULL;
    int best_distance = 3; /* two slips at most */
    if (name == word) {    /* a letter */
        (void)snprintf(text, n_text, "%s: unknown option %s (see loxo help %s)", p->command->name, word,
                       p->command->name);
        return LOXO_ERR_ARGUMENT;
    }
    for (int i = 0; i < p->n_targets; ++i) {
        const char *other = p->longs[i].name;
        const int d = n_name > 1 && strncmp(name, other, n_name) == 0 ? 0 : cli_edit_distance(name, n_name, other);
        if (d < best_distance) best = other, best_distance = d;
    }
    if (best != NULL)
        (void)snprintf(text, n_text, "%s: unknown option --%.*s (did you mean --%s?)", p->command->name, (int)n_name,
                       name, best);
    else
        (void)snprintf(text, n_text, "%s: unknown option --%.*s (see loxo help %s)", p->command->name, (int)n_name,
                       name, p->command->name);
    return LOXO_ERR_ARGUMENT;
}

static loxo_status take_flag(const parser *p, const cli_flag *flag, int argc, char **argv, cli_args *args, char *text,
                             size_t n_text)
{
    cli_given given = {.flag = flag};
    if (strcmp(flag->name, "help") == 0) {
        args->help = true;
        return LOXO_OK;
    }
    if (!flag->repeats && cli_args_has(args, flag->name)) {
        (void)snprintf(text, n_text, "%s: --%s given twice", p->command->name, flag->name);
        return LOXO_ERR_ARGUMENT;
    }
    if (flag->n_values > 0) given.value[0] = optarg;
    if (flag->n_values > 1) {
        if (optind >= argc) {
            (void)snprintf(text, n_text, "%s: --%s needs two values: %s", p->command->name, flag->name, flag->values);
            return LOXO_ERR_ARGUMENT;
        }
        given.value[1] = argv[optind++];
    }
    for (int i = 0; i < flag->n_values; ++i) {
        if (given.value[i] != NULL && given.value[i][0] != '\0') continue;
        (void)snprintf(text, n_text, "%s: --%s has an empty value", p->command->name, flag->name);
        return LOXO_ERR_ARGUMENT;
    }
    args->given[args->n_given++] = given;
    return LOXO_OK;
}

static loxo_status take_option(const target *t, const char *who, loxo_context *ctx, void *state, cli_args *args,
                               char *text, size_t n_text)
{
    void *settings = (unsigned char *)state + t->group->offset;
    const loxo_status status = loxo_options_set(ctx, who, t->group->options, settings, t->option->name, optarg);
    if (status < 0) (void)snprintf(text, n_text, "%s", loxo_context_failure(ctx)->text);
    args->given[args->n_given++] = (cli_given){.option = t->option};
    return status;
}

static const target *target_of(const parser *p, int code)
{
    if (code >= FIRST_TARGET) return &p->targets[code - FIRST_TARGET];
    for (int i = 0; i < p->n_targets; ++i)
        if (p->targets[i].flag != NULL && p->targets[i].flag->letter == code) return &p->targets[i];
    return NULL;
}

/* One step of getopt_long, word being where it stood. */
static loxo_status take(const parser *p, loxo_context *ctx, int code, const char *word, int argc, char **argv,
                        void *state, cli_args *args, char *text, size_t n_text)
{
    if (code == 1) { /* an operand */
        args->operand[args->n_operands++] = optarg;
        return LOXO_OK;
    }
    const bool is_long = word[0] == '-' && word[1] == '-';
    if (code == '?' && optopt >= FIRST_TARGET && is_long) { /* =value where none is taken */
        (void)snprintf(text, n_text, "%s: --%s takes no value", p->command->name, p->longs[optopt - FIRST_TARGET].name);
        return LOXO_ERR_ARGUMENT;
    }
    if (code == '?' && !is_long) {
        const char letter[3] = {'-', (char)optopt, '\0'};
        return unknown_option(p, letter, text, n_text);
    }
    if (code == '?') return unknown_option(p, word, text, n_text);
    const target *t = target_of(p, code == ':' ? optopt : code);
    if (t == NULL) return unknown_option(p, word, text, n_text);
    const char *name = t->flag != NULL ? t->flag->name : t->option->name;
    /* getopt_long takes any unique beginning; a script must not depend on which names exist. */
    if (is_long && (strncmp(word + 2, name, strlen(name)) != 0 || strchr("=", word[2 + strlen(name)]) == NULL))
        return unknown_option(p, word, text, n_text);
    if (code == ':') {
        char values[64];
        const char *wanted = t->flag != NULL ? t->flag->values : cli_option_values(t->option, values, sizeof values);
        (void)snprintf(text, n_text, "%s: --%s needs a value: %s", p->command->name, name, wanted);
        return LOXO_ERR_ARGUMENT;
    }
    if (t->flag != NULL) return take_flag(p, t->flag, argc, argv, args, text, n_text);
    return take_option(t, p->command->name, ctx, state, args, text, n_text);
}

/* How many of the words name standard input as a file that is read, operands among them. */
static int count_standard_inputs(const cli_args *args)
{
    int n = 0;
    for (int i = 0; i < args->n_operands; ++i)
        n += strcmp(args->operand[i], "-") == 0;
    for (int i = 0; i < args->n_given; ++i)
        n += args->given[i].flag != NULL && args->given[i].flag->reads && strcmp(args->given[i].value[0], "-") == 0;
    return n;
}

loxo_status cli_args_parse(const cli_command *command, loxo_context *ctx, int argc, char **argv, void *state,
                           cli_args *args, char *text, size_t n_text)
{
    loxo_status status = LOXO_OK;
    parser p;
    *args = (cli_args){.given = calloc((size_t)argc + 1, sizeof *args->given),
                       .operand = calloc((size_t)argc + 1, sizeof *args->operand)};
    /* getopt wants a program's name in front */
    char **words = calloc((size_t)argc + 2, sizeof *words);
    if (!parser_create(&p, command) || args->given == NULL || args->operand == NULL || words == NULL) {
        (void)snprintf(text, n_text, "no memory for the command line");
        status = LOXO_ERR_MEMORY;
        goto done;
    }
    words[0] = (char[]){"loxo"};
    for (int i = 0; i < argc; ++i)
        words[i + 1] = argv[i];

    optind = 0; /* start anew */
    opterr = 0;
    for (int at = 1; status == LOXO_OK && !args->help; at = optind) {
        const int code = getopt_long(argc + 1, words, p.letters, p.longs, NULL);
        if (code == -1) break;
        status = take(&p, ctx, code, words[at], argc + 1, words, state, args, text, n_text);
    }
    for (; status == LOXO_OK && !args->help && optind < argc + 1; ++optind)
        args->operand[args->n_operands++] = words[optind];
    const cli_common *common = state;
    if (status < 0 || args->help || common->settings) goto done;
    if (args->n_operands < command->min_operands || args->n_operands > command->max_operands) {
        const bool few = args->n_operands < command->min_operands;
        (void)snprintf(text, n_text, "%s: too %s operands; usage: loxo %s %s", command->name, few ? "few" : "many",
                       command->name, command->operands);
        status = LOXO_ERR_ARGUMENT;
    } else if (count_standard_inputs(args) > 1) {
        (void)snprintf(text, n_text, "%s: standard input can be read only once", command->name);
        status = LOXO_ERR_ARGUMENT;
    }
done:
    parser_destroy(&p);
    free(words);
    return status;
}

void cli_args_destroy(cli_args *args)
{
    free(args->given);
    free(args->operand);
    *args = (cli_args){0};
}

static bool is_flag(const cli_given *given, const char *name)
{
    return given->flag != NULL && strcmp(given->flag->name, name) == 0;
}

const char *cli_args_value(const cli_args *args, const char *name, int i)
{
    for (int k = args->n_given - 1; k >= 0; --k)
        if (is_flag(&args->given[k], name)) return args->given[k].value[i];
    return NULL;
}

bool cli_args_has(const cli_args *args, const char *name)
{
    for (int k = 0; k < args->n_given; ++k)
        if (is_flag(&args->given[k], name)) return true;
    return false;
}

bool cli_args_has_option(const cli_args *args, const loxo_option *option)
{
    for (int k = 0; k < args->n_given; ++k)
        if (args->given[k].option == option) return true;
    return false;
}

const char *cli_given_name(const cli_given *given)
{
    return given->flag != NULL ? given->flag->name : given->option->name;
}

bool cli_given_is(const cli_command *command, const cli_given *given, const char *name)
{
    if (strcmp(cli_given_name(given), name) == 0) return true;
    for (const cli_group *g = command->groups; g->title != NULL && given->option != NULL; ++g)
        for (const loxo_option *o = g->options; o->name != NULL && strcmp(g->title, name) == 0; ++o)
            if (o == given->option) return true;
    return false;
}

const char *cli_args_next(const cli_args *args, const char *name, int *cursor)
{
    while (*cursor < args->n_given) {
        const cli_given *given = &args->given[(*cursor)++];
        if (is_flag(given, name)) return given->value[0];
    }
    return NULL;
}

const char *cli_option_values(const loxo_option *option, char *text, size_t n_text)
{
    size_t used = 0;
    switch (option->type) {
    case LOXO_OPTION_BOOL: return "yes|no";
    case LOXO_OPTION_SIZE: return "BYTES";
    case LOXO_OPTION_DOUBLE: return "X";
    case LOXO_OPTION_INT:
    case LOXO_OPTION_INT64:
    case LOXO_OPTION_UINT64: return "N";
    case LOXO_OPTION_CHOICE: break;
    }
    text[0] = '\0';
    for (const char *const *c = option->choices; *c != NULL && used < n_text; ++c)
        used += (size_t)snprintf(text + used, n_text - used, "%s%s", used > 0 ? "|" : "", *c);
    return text;
}

/* The option in a column of its own; long ones push the help to the next line. */
static void help_row(FILE *out, const char *left, const char *help, const char *value)
{
    if (strlen(left) > 26)
        (void)fprintf(out, "  %s\n  %26s  %s", left, "", help);
    else
        (void)fprintf(out, "  %-26s  %s", left, help);
    if (value != NULL) (void)fprintf(out, " [%s]", value);
    (void)fputc('\n', out);
}

static void help_flags(FILE *out, const cli_flag *flags)
{
    for (; flags->name != NULL; ++flags) {
        char left[96];
        const char letter[] = {'-', flags->letter, ',', ' ', '\0'};
        (void)snprintf(left, sizeof left, "%s--%s%s%s", flags->letter != 0 ? letter : "", flags->name,
                       flags->n_values > 0 ? " " : "", flags->n_values > 0 ? flags->values : "");
        help_row(out, left, flags->help, NULL);
    }
}

static void help_group(FILE *out, const cli_group *group, const void *state)
{
    const void *settings = (const unsigned char *)state + group->offset;
    for (const loxo_option *o = group->options; o->name != NULL; ++o) {
        char left[128], values[96], value[64];
        if (o->type == LOXO_OPTION_BOOL)
            (void)snprintf(left, sizeof left, "--%s[=yes|no]", o->name);
        else
            (void)snprintf(left, sizeof left, "--%s %s", o->name, cli_option_values(o, values, sizeof values));
        (void)loxo_option_print(o, settings, value, sizeof value);
        help_row(out, left, o->help, value);
    }
}

void cli_help(const cli_command *command, FILE *out)
{
    void *state = calloc(1, command->state_bytes);
    if (state == NULL) return;
    command->defaults(state);
    (void)fprintf(out, "loxo %s: %s\n\nusage: loxo %s %s\n\n%s", command->name, command->summary, command->name,
                  command->operands, command->about);
    if (command->more_help != NULL) command->more_help(out);
    if (command->flags->name != NULL) {
        (void)fprintf(out, "\noptions\n");
        help_flags(out, command->flags);
    }
    for (const cli_group *g = command->groups; g->title != NULL; ++g) {
        (void)fprintf(out, "\n%s [default]\n", g->title);
        help_group(out, g, state);
    }
    (void)fprintf(out, "\ncommon to all commands [default]\n");
    help_group(out, &common_group, state);
    help_flags(out, cli_common_flags);
    (void)fprintf(out, "\nexamples\n%s", command->examples);
    free(state);
}

static void print_group(FILE *out, const cli_group *group, const void *state)
{
    const void *settings = (const unsigned char *)state + group->offset;
    (void)fprintf(out, "[%s]\n", group->title);
    for (const loxo_option *o = group->options; o->name != NULL; ++o) {
        char value[64];
        (void)loxo_option_print(o, settings, value, sizeof value);
        (void)fprintf(out, "%s = %s\n", o->name, value);
    }
}

void cli_settings_print(const cli_command *command, const void *state, FILE *out)
{
    for (const cli_group *g = command->groups; g->title != NULL; ++g)
        print_group(out, g, state);
    print_group(out, &common_group, state);
}

int cli_parse_numbers(const char *text, double *number, int max)
{
    int n = 0;
    for (const char *at = text;; ++at) {
        const size_t length = strcspn(at, ",");
        char *end = NULL;
        /* strtod alone would take blanks, hexadecimal digits, "inf" and "nan"; no locale is ever set here */
        if (n == max || length == 0 || strspn(at, "0123456789+-.eE") < length) return -1;
        number[n] = strtod(at, &end);
        if (end != at + length || !isfinite(number[n])) return -1;
        ++n;
        at = end;
        if (*at == '\0') return n;
    }
}

bool cli_parse_integer(const char *text, size_t n_text, int64_t *number)
{
    const size_t sign = n_text > 0 && (text[0] == '-' || text[0] == '+') ? 1 : 0;
    int64_t sum = 0;
    if (n_text == sign) return false;
    for (size_t i = sign; i < n_text; ++i) {
        if (text[i] < '0' || text[i] > '9') return false;
        if (__builtin_mul_overflow(sum, 10, &sum)) return false;
        if (__builtin_sub_overflow(sum, text[i] - '0', &sum)) return false; /* downward: the minimum fits */
    }
    if (text[0] != '-' && __builtin_sub_overflow(0, sum, &sum)) return false;
    *number = sum;
    return true;
}
