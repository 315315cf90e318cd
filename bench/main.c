/* SPDX-License-Identifier: MIT
 * loxo-bench: measures Loxo and says what it measured on. */
#include "base/options.h"
#include "base/os.h"
#include "bench.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const loxo_option options[] = {
    {.name = "repeats",
     .type = LOXO_OPTION_INT,
     .offset = offsetof(bench_settings, repeats),
     .min = 1,
     .max = BENCH_MAX_REPEATS,
     .help = "measured rounds, after one of warm-up; tables show medians [min..max]"},
    {.name = "vertices",
     .type = LOXO_OPTION_INT64,
     .offset = offsetof(bench_settings, vertices),
     .min = 100,
     .max = 2e8,
     .help = "vertices of the generated meshes (accuracy: a quarter)"},
    {.name = "largest",
     .type = LOXO_OPTION_INT64,
     .offset = offsetof(bench_settings, largest),
     .min = 100,
     .max = 2e8,
     .help = "vertices of the larger mesh of scale"},
    {.name = "source",
     .type = LOXO_OPTION_INT64,
     .offset = offsetof(bench_settings, source),
     .min = 0,
     .max = LOXO_INDEX_MAX,
     .help = "source vertex of time and scale; vertex 0 of an icosphere is a corner that its levels line up with"},
    {.name = "share",
     .type = LOXO_OPTION_DOUBLE,
     .offset = offsetof(bench_settings, share),
     .min = 1e-6,
     .max = 10.0,
     .help = "paper: sizes of our meshes in those of the paper's"},
    {.name = "max-memory",
     .type = LOXO_OPTION_SIZE,
     .offset = offsetof(bench_settings, max_memory),
     .min = 0,
     .max = 1e15,
     .help = "bytes that a measured solve may take; 0: what the machine grants"},
    {.name = "search-seconds",
     .type = LOXO_OPTION_DOUBLE,
     .offset = offsetof(bench_settings, search_seconds),
     .min = 0.0,
     .max = 1e6,
     .help = "paper: of looking for the best m, each method on each mesh"},
    {.name = "solve-seconds",
     .type = LOXO_OPTION_DOUBLE,
     .offset = offsetof(bench_settings, solve_seconds),
     .min = 0.0,
     .max = 1e6,
     .help = "paper: a method of which one solve is predicted to take longer is not run; its rounds end after so many"},
    {0},
};

static const struct {
    const char *name, *help;
    loxo_status (*run)(bench *b);
    bool uses_meshes; /* of others */
} commands[] = {
    {"list", "the named cases, and whether their meshes are here", bench_list, false},
    {"micro", "STREAM triad, and every hot kernel against it", bench_micro, false},
    {"accuracy", "errors against exact distances and against a direct solve of the heat equation", bench_accuracy,
     true},
    {"time", "mesh in memory to distances: seconds, phases, bytes a vertex", bench_time, false},
    {"scale", "PLY file to distances in a file, at two sizes: growth of time and bytes a vertex", bench_scale, false},
    {"build", "half-edges of a mesh in memory", bench_build, false},
    {"orders", "orders of a mesh: what they cost and what they win", bench_orders, true},
    {"laplace", "multigrid beside a sparse factor and BoomerAMG: set-up, solve, memory, steps", bench_laplace, true},
    {"estimate", "what --estimate of the command predicts, against what a run takes", bench_estimate, false},
    {"barycenter", "polygons closed a second, barycenters of many atoms, and near the sphere", bench_barycenter, false},
};
#define N_COMMANDS (sizeof commands / sizeof commands[0])

static void print_help(const bench_settings *defaults)
{
    puts("usage: loxo-bench COMMAND [options]\n\ncommands:");
    for (size_t i = 0; i < N_COMMANDS; ++i)
        printf("  %-10s %s\n", commands[i].name, commands[i].help);
    puts("  paper      tables and figures of papers: `paper --list`, `paper NAME ... [--out FOLDER]`, `paper all`\n"
         "\noptions:");
    for (const loxo_option *o = options; o->name != NULL; ++o) {
        char value[64];
        loxo_option_print(o, defaults, value, sizeof value);
        printf("  --%-12s %s [%s]\n", o->name, o->help, value);
    }
    puts("  --method      methods to measure, as edge,face,fast; all [edge,face; of orders edge,fast; for the paper "
         "all that there are]\n"
         "  --out         paper: folder that receives NAME.txt, NAME.json and NAME-*.png\n"
         "  --threads     thread counts to measure, as 1,2 [1 and all]\n"
         "  --case        only cases, of paper meshes, whose name has this in it\n"
         "  --mesh        a mesh of your own instead of the named cases; source is vertex 0\n"
         "  --exact       its true distances (.npy)\n"
         "  --sweeps      accuracy: also the paper's plain sweeps, as 100,200,400\n"
         "  --shared      folder of the test meshes [the first that is there: $LOXO_SHARED/meshes, ../shared/meshes,\n"
         "                shared/meshes beside a folder that this program lies in]\n"
         "  --work        folder for generated meshes and results [a temporary one, removed at the end]\n"
         "  --json        write all numbers to this file\n"
         "  --compare-with [NAME=]COMMAND\n"
         "                a program to run beside ours on the same mesh, in turns; may be given several times.\n"
         "                {mesh} {sources} {out} {threads} {method} are filled in; it prints `seconds X`, and if it\n"
         "                likes `phase diffusion X` and `bytes X`, and writes float64 or .npy distances to {out}");
}

/* "1,2,4" into numbers; false when it is anything else. */
static bool parse_list(const char *text, int n_most, int64_t most, int64_t *list, int *n)
{
    *n = 0;
    for (const char *p = text; *n < n_most; ++p) {
        char *end = NULL;
        const long long value = strtoll(p, &end, 10);
        if (end == p || value < 1 || value > most) return false;
        list[(*n)++] = value;
        if (*end == '\0') return true;
        if (*end != ',') return false;
        p = end;
    }
    return false;
}

bool bench_has_method(const bench *b, const char *name)
{
    for (int i = 0; i < b->n_methods; ++i)
        if (strcmp(b->methods[i], name) == 0) return true;
    return false;
}

bool bench_is_parallel_heat(const char *name)
{
    const size_t n = strcspn(name, ",");
    return (n == 4 && (strncmp(name, "edge", n) == 0 || strncmp(name, "face", n) == 0));
}

/* "edge,face" into names of the library's own; "all": all of them but such as choose another. */
static loxo_status parse_methods(bench *b, const char *text)
{
    const bool is_all = strcmp(text, "all") == 0;
    if (strcmp(text, "both") == 0) text = "edge,face";
    b->n_methods = 0;
    for (const char *p = text;; ++p) {
        const size_t length = strcspn(p, ",");
        const int before = b->n_methods;
        for (int m = 0; m < LOXO_GEODESIC_N_METHODS && b->n_methods < BENCH_MAX_METHODS; ++m) {
            const char *name = loxo_geodesic_method_name((loxo_geodesic_method)m);
            if (is_all ? strcmp(name, "auto") != 0 : strlen(name) == length && strncmp(name, p, length) == 0)
                b->methods[b->n_methods++] = name;
        }
        if (b->n_methods == before)
            return bench_fail(b, LOXO_ERR_ARGUMENT, "--method: this build has no method %.*s", (int)length, p);
        p += length;
        if (is_all || *p == '\0') return LOXO_OK;
    }
}

static loxo_status add_peer(bench *b, const char *text)
{
    bench_peer *peer = &b->peers[b->n_peers];
    const size_t length = strspn(text, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.");
    if (b->n_peers == BENCH_MAX_PEERS) return bench_fail(b, LOXO_ERR_ARGUMENT, "--compare-with: too many");
    const bool is_named = length > 0 && length < sizeof peer->name && text[length] == '=';
    if (is_named)
        snprintf(peer->name, sizeof peer->name, "%.*s", (int)length, text);
    else
        snprintf(peer->name, sizeof peer->name, "peer%d", b->n_peers + 1);
    peer->command = is_named ? text + length + 1 : text;
    b->n_peers += 1;
    return LOXO_OK;
}

static loxo_status set_option(bench *b, const char *name, const char *value)
{
    int64_t list[BENCH_MAX_SWEEPS];
    const struct {
        const char *name, **field;
    } texts[] = {
        {"case", &b->case_filter}, {"mesh", &b->mesh}, {"exact", &b->exact}, {"json", &b->json_path}, {"out", &b->out}};
    const struct {
        const char *name;
        char *field;
    } paths[] = {{"shared", b->shared}, {"work", b->work}};
    if (loxo_options_find(options, name) != NULL)
        return loxo_options_set(b->ctx, "loxo-bench", options, &b->settings, name, value);
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; ++i)
        if (strcmp(name, texts[i].name) == 0) {
            *texts[i].field = value;
            return LOXO_OK;
        }
    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; ++i)
        if (strcmp(name, paths[i].name) == 0) {
            if (snprintf(paths[i].field, BENCH_PATH, "%s", value) < BENCH_PATH && access(value, R_OK) == 0)
                return LOXO_OK;
            return bench_fail(b, LOXO_ERR_READ, "--%s: no such folder: %s", name, value);
        }
    if (strcmp(name, "compare-with") == 0) return add_peer(b, value);
    if (strcmp(name, "method") == 0) return parse_methods(b, value);
    if (strcmp(name, "threads") == 0) {
        if (!parse_list(value, BENCH_MAX_THREADS, 4096, list, &b->n_threads))
            return bench_fail(b, LOXO_ERR_ARGUMENT, "--threads: not a list of counts: %s", value);
        for (int i = 0; i < b->n_threads; ++i)
            b->threads[i] = (int)list[i];
        return LOXO_OK;
    }
    if (strcmp(name, "sweeps") == 0) {
        if (parse_list(value, BENCH_MAX_SWEEPS, 1000000, b->sweeps, &b->n_sweeps)) return LOXO_OK;
        return bench_fail(b, LOXO_ERR_ARGUMENT, "--sweeps: not a list of counts: %s", value);
    }
    return bench_fail(b, LOXO_ERR_ARGUMENT, "no such option: --%s", name);
}

/* Takes the options out of argv; what is left are the words. */
static loxo_status parse(bench *b, int *argc, char **argv)
{
    int n_words = 0;
    for (int i = 0; i < *argc; ++i) {
        if (strncmp(argv[i], "--", 2) != 0) {
            argv[n_words++] = argv[i];
            continue;
        }
        if (strcmp(argv[i], "--list") == 0) { /* the one flag without a value */
            argv[n_words++] = argv[i];
            continue;
        }
        if (i + 1 == *argc) return bench_fail(b, LOXO_ERR_ARGUMENT, "%s: its value is missing", argv[i]);
        const loxo_status status = set_option(b, argv[i] + 2, argv[i + 1]);
        if (status < 0) return status;
        ++i;
    }
    *argc = n_words;
    return LOXO_OK;
}

/* 1, 2, 4, ... and the number of usable processors. */
static void choose_threads(bench *b)
{
    const int most = loxo_os_n_processors();
    for (int n = 1; n < most && b->n_threads < BENCH_MAX_THREADS - 1; n *= 2)
        b->threads[b->n_threads++] = n;
    b->threads[b->n_threads++] = most;
}

static loxo_status run(bench *b, int argc, char **argv)
{
    loxo_status status = parse(b, &argc, argv);
    if (status < 0) return status;
    if (argc < 1) return bench_fail(b, LOXO_ERR_ARGUMENT, "a command is missing; see loxo-bench --help");
    if (b->n_threads == 0) choose_threads(b);
    loxo_context_settings settings = loxo_context_settings_default(); /* what runs in this process has most threads */
    settings.n_threads = b->threads[b->n_threads - 1];
    if (strcmp(argv[0], "worker") == 0) settings.memory_limit_bytes = b->settings.max_memory;
    loxo_context_destroy(b->ctx);
    b->ctx = NULL;
    if ((status = loxo_context_create(&settings, &b->ctx)) < 0) return status;
    if (strcmp(argv[0], "worker") == 0) return bench_worker(b, argc - 1, argv + 1);
    bench_find_shared(b);
    if (!bench_self_path(b->self)) return bench_fail(b, LOXO_ERR_READ, "cannot find this program's own file");
    const bool is_paper = strcmp(argv[0], "paper") == 0;
    if (is_paper && argc == 2 && strcmp(argv[1], "--list") == 0) return bench_paper_list(b);
    if (is_paper && argc < 2)
        return bench_fail(b, LOXO_ERR_ARGUMENT, "which table or figure? `loxo-bench paper --list` names them");
    if (!is_paper && argc > 1) return bench_fail(b, LOXO_ERR_ARGUMENT, "what is `%s`?", argv[1]);
    const char *methods = is_paper ? "all" : strcmp(argv[0], "orders") == 0 ? "edge,fast" : "both";
    if (b->n_methods == 0 && (status = parse_methods(b, methods)) < 0) return status;
    b->keep_work = b->work[0] != '\0';
    if (!b->keep_work && !bench_make_folder(b->work)) {
        b->work[0] = '\0';
        return bench_fail(b, LOXO_ERR_WRITE, "cannot make a temporary folder");
    }
    json_object_set_new(b->report, "command", json_string(argv[0]));
    json_object_set_new(b->report, "version", json_string(loxo_version()));
    json_object_set_new(b->report, "repeats", json_integer(b->settings.repeats));
    if (is_paper) return bench_paper(b, argc - 1, argv + 1);
    for (size_t i = 0; i < N_COMMANDS; ++i) {
        if (strcmp(argv[0], commands[i].name) != 0) continue;
        if (commands[i].run != bench_list) {
            if ((status = bench_machine(b)) < 0) return status;
            if (commands[i].uses_meshes) bench_tell_shared(b);
        }
        if ((status = commands[i].run(b)) < 0) return status;
        return bench_report_write(b);
    }
    return bench_fail(b, LOXO_ERR_ARGUMENT, "no such command: %s", argv[0]);
}

/* Anywhere but where an option's value stands. */
static bool asks_for_help(int argc, char **argv)
{
    for (int i = 1; i < argc; ++i) {
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) return true;
        if (strncmp(argv[i], "--", 2) == 0 && strcmp(argv[i], "--list") != 0) ++i;
    }
    return false;
}

int main(int argc, char **argv)
{
    static bench b; /* large */
    b.settings = (bench_settings){.repeats = 5,
                                  .vertices = 1000000,
                                  .largest = 10000000,
                                  .share = 1.0,
                                  .search_seconds = 30.0,
                                  .solve_seconds = 120.0};
    if (argc < 2 || asks_for_help(argc, argv)) {
        print_help(&b.settings);
        return argc < 2 ? loxo_status_exit_code(LOXO_ERR_ARGUMENT) : 0;
    }
    loxo_status status = loxo_context_create(NULL, &b.ctx);
    b.report = json_object();
    if (status >= 0) status = run(&b, argc - 1, argv + 1);
    if (status < 0 && b.ctx != NULL) fprintf(stderr, "loxo-bench: error: %s\n", bench_message(&b));
    if (b.work[0] != '\0' && !b.keep_work) bench_remove_folder(b.work);
    json_decref(b.report);
    loxo_context_destroy(b.ctx);
    return loxo_status_exit_code(status);
}
