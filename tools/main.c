/* SPDX-License-Identifier: MIT
 * The loxo command: finds the command that was named and runs it. */
#include "commands.h"
#include "run.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

static const cli_command *const commands[] = {&command_info,     &command_convert,
                                              &command_generate, &command_geodesic,
                                              &command_sample,   &command_render,
                                              &command_measure,  &command_sphere,
                                              &command_center,   &command_barycenter,
                                              &command_polygon,  &command_extend,
                                              &command_register, NULL};

static const char general_help[] =
    "\nloxo help COMMAND tells all of one; loxo --version [--verbose] what this build can do.\n"
    "\nResults go to -o FILE (format by suffix, - is standard output), rows for people to standard error, --json "
    "FILE|-\n"
    "is for machines. Files appear whole or not at all. Ctrl-C leaves none.\n"
    "\nexit codes\n"
    "  0  good                             5  valid, but not supported\n"
    "  1  warnings, with --strict          6  mesh not valid for the operation\n"
    "  2  usage                            7  limit or memory\n"
    "  3  cannot open or read              8  tolerance not met (output written and marked), or not finite\n"
    "  4  malformed input                  9  cannot write\n"
    "  128 + n  ended by signal n\n";

static int usage_error(const char *text)
{
    (void)fprintf(stderr, "loxo: error: %s\n", text_path(text));
    return loxo_status_exit_code(LOXO_ERR_ARGUMENT);
}

/* What was printed has to arrive: a full disk shows at the latest here. */
static int end_of_output(void)
{
    const bool failed = ferror(stdout) != 0;
    if (fflush(stdout) == 0 && !failed) return 0;
    if (errno == EPIPE) return 128 + 13;
    (void)fprintf(stderr, "standard output: error: cannot write: %s\n", strerror(errno));
    return loxo_status_exit_code(LOXO_ERR_WRITE);
}

static int print_help(void)
{
    (void)printf("loxo %s: geometry on huge meshes\n\nusage: loxo COMMAND OPERANDS [options]\n\n", loxo_version());
    for (size_t i = 0; commands[i] != NULL; ++i)
        (void)printf("  %-10s %s\n", commands[i]->name, commands[i]->summary);
    (void)fputs(general_help, stdout);
    return end_of_output();
}

static void print_machine(loxo_context *ctx)
{
    loxo_machine m = {0};
    (void)printf("%s\n", loxo_build_features());
    (void)printf("ids %d bits, kernels %s, threads %d\n", (int)(8 * sizeof(loxo_index)),
                 cli_isa_name(loxo_context_isa(ctx)), loxo_context_n_threads(ctx));
    if (loxo_machine_get(ctx, &m) < 0) return;
    (void)printf("machine (%s): %d processors for this process, %d cores, %d NUMA nodes\n",
                 m.from_hwloc ? "hwloc" : "operating system", m.n_processors, m.n_cores, m.n_numa_nodes);
    (void)printf("caches of a core: L1 %s, L2 %s, L3 %s\n", text_bytes((double)m.l1_bytes),
                 text_bytes((double)m.l2_bytes), text_bytes((double)m.l3_bytes));
    (void)printf("memory %s, granted %s\n", text_bytes((double)m.memory_bytes),
                 text_bytes((double)m.memory_limit_bytes));
}

static int print_version(int argc, char **argv)
{
    loxo_context *ctx = NULL;
    if (argc > 1 || (argc == 1 && strcmp(argv[0], "--verbose") != 0))
        return usage_error("--version takes --verbose and nothing else");
    (void)printf("loxo %s\n", loxo_version());
    if (argc == 1 && loxo_context_create(NULL, &ctx) == LOXO_OK) print_machine(ctx);
    loxo_context_destroy(ctx);
    return end_of_output();
}

static const cli_command *find_command(const char *name)
{
    for (size_t i = 0; commands[i] != NULL; ++i)
        if (strcmp(commands[i]->name, name) == 0) return commands[i];
    return NULL;
}

static int unknown_command(const char *name)
{
    char text[256];
    const char *best = "";
    int best_distance = 3; /* two slips at most */
    for (size_t i = 0; commands[i] != NULL; ++i) {
        const int distance = cli_edit_distance(name, strlen(name), commands[i]->name);
        if (distance < best_distance) best = commands[i]->name, best_distance = distance;
    }
    if (best[0] != '\0')
        (void)snprintf(text, sizeof text, "there is no command '%.60s' (did you mean %s?)", name, best);
    else
        (void)snprintf(text, sizeof text, "there is no command '%.60s'; see loxo help", name);
    return usage_error(text);
}

/* --settings: what would be used, and nothing else. Standard output is the report's where that was asked. */
static loxo_status print_settings(cli_run *run, void *state)
{
    const bool taken = run->json_path != NULL && strcmp(run->json_path, "-") == 0;
    cli_common *common = state;
    common->n_threads = loxo_context_n_threads(run->ctx);
    common->max_memory = run->limit_bytes;
    common->isa = (int)loxo_context_isa(run->ctx);
    cli_settings_print(run->command, state, taken ? stderr : stdout);
    return LOXO_OK;
}

static int run_command(const cli_command *command, int argc, char **argv)
{
    cli_run run = {0};
    loxo_context *ctx = NULL; /* for messages of the parser: the real one needs the options first */
    char text[512] = "";
    int code;
    void *state = calloc(1, command->state_bytes);
    if (state == NULL || loxo_context_create(NULL, &ctx) < 0) {
        free(state);
        (void)fprintf(stderr, "loxo: error: no memory\n");
        return loxo_status_exit_code(LOXO_ERR_MEMORY);
    }
    command->defaults(state);
    loxo_status status = cli_args_parse(command, ctx, argc, argv, state, &run.args, text, sizeof text);
    loxo_context_destroy(ctx);
    if (status < 0) {
        cli_args_destroy(&run.args);
        free(state);
        (void)usage_error(text);
        return loxo_status_exit_code(status);
    }
    if (run.args.help) {
        cli_args_destroy(&run.args);
        free(state);
        cli_help(command, stdout);
        return end_of_output();
    }
    status = cli_run_begin(&run, command, state);
    const bool only_settings = ((const cli_common *)state)->settings;
    if (status >= 0 && !only_settings) cli_warn_needs(&run);
    if (status >= 0) status = only_settings ? print_settings(&run, state) : command->main(&run, state);
    code = cli_run_end(&run, status);
    free(state);
    const int printed = end_of_output();
    return code != 0 ? code : printed;
}

int main(int argc, char **argv)
{
    if (argc < 2) return usage_error("no command; see loxo help");
    const char *name = argv[1];
    const bool is_help = strcmp(name, "help") == 0 || strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0;
    if (is_help && argc > 3) return usage_error("help takes one command");
    if (is_help && argc == 2) return print_help();
    if (is_help) {
        const cli_command *command = find_command(argv[2]);
        if (command == NULL) return unknown_command(argv[2]);
        cli_help(command, stdout);
        return end_of_output();
    }
    if (strcmp(name, "--version") == 0) return print_version(argc - 2, argv + 2);
    const cli_command *command = find_command(name);
    if (command == NULL) return unknown_command(name);
    return run_command(command, argc - 2, argv + 2);
}
