/* SPDX-License-Identifier: MIT */
#define _POSIX_C_SOURCE 200809L /* stat */

#include "run.h"

#include "base/os.h"
#include "signals.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* ---- progress ------------------------------------------------------------------------------------------------ */

static void draw_bar(const loxo_progress *p)
{
    enum { WIDTH = 30 };
    char bar[WIDTH + 1];
    if (!(p->fraction >= 0)) {
        (void)fprintf(stderr, "\r%-12s %s steps  %s\033[K", p->phase, text_count(p->iteration),
                      text_seconds(p->elapsed_s));
        return;
    }
    const double fraction = p->fraction < 1 ? p->fraction : 1;
    const int full = (int)(fraction * WIDTH);
    memset(bar, '#', (size_t)full);
    memset(bar + full, '.', (size_t)(WIDTH - full));
    bar[WIDTH] = '\0';
    (void)fprintf(stderr, "\r%-12s %s %3d %%  %s\033[K", p->phase, bar, (int)(100 * fraction),
                  text_seconds(p->elapsed_s));
}

static int on_progress(void *user, const loxo_progress *progress)
{
    cli_run *run = user;
    if (run->bar) {
        draw_bar(progress);
        run->bar_drawn = true;
    }
    return signals_caught() != 0;
}

/* ---- begin --------------------------------------------------------------------------------------------------- */

/* The keys that every report starts with; status and exit code are filled in at the end. */
static void start_json(cli_run *run)
{
    json_t *json = run->report.json;
    json_put_text(json, "loxo", loxo_version());
    json_put_text(json, "command", run->command->name);
    json_put_text(json, "status", "");
    json_put_text(json, "status_text", "");
    json_put_integer(json, "exit_code", 0);
    json_put_integer(json, "threads", loxo_context_n_threads(run->ctx));
    json_put_text(json, "isa", cli_isa_name(loxo_context_isa(run->ctx)));
    json_t *settings = json_put_object(json, "settings");
    for (const cli_group *g = run->command->groups; g->title != NULL; ++g)
        json_put_settings(settings, g->title, g->options, (const unsigned char *)run->common + g->offset);
    json_put_settings(settings, "common", cli_common_options, run->common);
    (void)json_put_object(json, "seconds");
}

loxo_status cli_run_begin(cli_run *run, const cli_command *command, const cli_common *common)
{
    loxo_context_settings settings = loxo_context_settings_default();
    signals_install();
    run->command = command;
    run->common = common;
    run->start_s = loxo_os_clock_s();
    run->program_bytes = loxo_os_peak_rss();
    run->bar = !common->quiet && loxo_os_is_terminal(2);
    run->json_path = cli_args_value(&run->args, "json", 0);
    if (!report_create(&run->report)) return cli_fail(run, LOXO_ERR_MEMORY, "no memory for a report");
    settings.n_threads = common->n_threads;
    settings.memory_limit_bytes = common->max_memory;
    settings.isa = (loxo_isa)common->isa;
    settings.monitor = on_progress;
    settings.monitor_user = run;
    loxo_status status = loxo_context_create(&settings, &run->ctx);
    if (status >= 0) run->limit_bytes = loxo_context_memory(run->ctx).limit_bytes;
    if (status >= 0 && common->estimate) { /* the limit is what it is compared with */
        loxo_context_destroy(run->ctx);
        run->ctx = NULL;
        settings.memory_limit_bytes = SIZE_MAX / 2;
        status = loxo_context_create(&settings, &run->ctx);
    }
    if (status == LOXO_ERR_ARGUMENT) return cli_fail(run, status, "this processor cannot do the --isa that was asked");
    if (status < 0) return cli_fail(run, status, "%s", loxo_status_text(status));
    loxo_os_gather_begin(run->ctx);
    start_json(run);
    return run->json_path != NULL ? cli_output(run, run->json_path) : LOXO_OK;
}

/* ---- failures ------------------------------------------------------------------------------------------------ */

static __attribute__((format(printf, 5, 0))) void set_failure(cli_run *run, loxo_status status, const char *file,
                                                              int64_t line, const char *format, va_list args)
{
    run->failure = (loxo_failure){.status = status, .line = line, .byte = -1, .element = -1};
    (void)snprintf(run->failure.file, sizeof run->failure.file, "%s", file);
    (void)vsnprintf(run->failure.text, sizeof run->failure.text, format, args);
}

loxo_status cli_fail(cli_run *run, loxo_status status, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    set_failure(run, status, "", 0, format, args);
    va_end(args);
    return status;
}

loxo_status cli_fail_at(cli_run *run, loxo_status status, const char *file, int64_t line, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    set_failure(run, status, file, line, format, args);
    va_end(args);
    return status;
}

loxo_status cli_blame(cli_run *run, loxo_status status, const char *file)
{
    const loxo_failure *failure = loxo_context_failure(run->ctx);
    if (status != LOXO_ERR_ARGUMENT || failure->element < 0) return status;
    const char *text = strstr(failure->text, ": "); /* behind the name of the call */
    return cli_fail_at(run, LOXO_ERR_MALFORMED, file, 0, "%s", text != NULL ? text + 2 : failure->text);
}

loxo_status cli_combine(cli_run *run, loxo_status status)
{
    if (status <= 0) return status;
    if (run->status == LOXO_OK || loxo_status_exit_code(status) > loxo_status_exit_code(run->status))
        run->status = status;
    return status;
}

void cli_warn(cli_run *run, int64_t count, const char *format, ...)
{
    char text[256];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    json_t *warning = json_object();
    json_put_integer(warning, "count", count);
    json_put_text(warning, "text", text);
    json_append(run->report.warnings, warning);
}

static bool is_repeated(const cli_args *args, int i)
{
    for (int k = 0; k < i; ++k)
        if (args->given[k].flag == args->given[i].flag && args->given[k].option == args->given[i].option) return true;
    return false;
}

void cli_warn_idle(cli_run *run, const char *name, const char *why)
{
    for (int i = 0; i < run->args.n_given; ++i)
        if (cli_given_is(run->command, &run->args.given[i], name) && !is_repeated(&run->args, i))
            cli_warn(run, 1, "--%s changes nothing %s", cli_given_name(&run->args.given[i]), why);
}

void cli_warn_needs(cli_run *run)
{
    for (const cli_need *need = run->command->needs; need != NULL && need->name != NULL; ++need) {
        char why[64];
        bool is_met = false;
        for (int i = 0; i < run->args.n_given && need->other != NULL; ++i)
            is_met = is_met || strcmp(cli_given_name(&run->args.given[i]), need->other) == 0;
        if (is_met) continue;
        if (need->other == NULL)
            (void)snprintf(why, sizeof why, "in loxo %s", run->command->name);
        else
            (void)snprintf(why, sizeof why, "without --%s", need->other);
        cli_warn_idle(run, need->name, why);
    }
}

/* ---- files --------------------------------------------------------------------------------------------------- */

static bool same_directory(const char *a, size_t n_a, const char *b, size_t n_b)
{
    struct stat of_a, of_b;
    char *name_a = strndup(n_a > 0 ? a : "./", n_a > 0 ? n_a : 2);
    char *name_b = strndup(n_b > 0 ? b : "./", n_b > 0 ? n_b : 2);
    const bool same = name_a != NULL && name_b != NULL && stat(name_a, &of_a) == 0 && stat(name_b, &of_b) == 0 &&
                      of_a.st_dev == of_b.st_dev && of_a.st_ino == of_b.st_ino;
    free(name_a);
    free(name_b);
    return same;
}

/* Whether two paths name one file, there already or not. */
static bool same_file(const char *a, const char *b)
{
    struct stat of_a, of_b;
    if (strcmp(a, b) == 0) return true;
    if (strcmp(a, "-") == 0 || strcmp(b, "-") == 0) return false;
    if (stat(a, &of_a) == 0 && stat(b, &of_b) == 0) return of_a.st_dev == of_b.st_dev && of_a.st_ino == of_b.st_ino;
    const char *slash_a = strrchr(a, '/'), *slash_b = strrchr(b, '/');
    const char *last_a = slash_a != NULL ? slash_a + 1 : a, *last_b = slash_b != NULL ? slash_b + 1 : b;
    return strcmp(last_a, last_b) == 0 && same_directory(a, (size_t)(last_a - a), b, (size_t)(last_b - b));
}

loxo_status cli_output(cli_run *run, const char *path)
{
    for (int i = 0; i < run->n_files; ++i)
        if (same_file(run->file[i], path))
            return cli_fail(run, LOXO_ERR_ARGUMENT, "%s would be written twice",
                            strcmp(path, "-") == 0 ? "standard output" : path);
    if (run->n_files == CLI_MAX_FILES) return cli_fail(run, LOXO_ERR_ARGUMENT, "more than %d outputs", CLI_MAX_FILES);
    run->file[run->n_files++] = path;
    return loxo_write_check(run->ctx, path);
}

loxo_status cli_before_output(cli_run *run)
{
    if (signals_caught() == 0) return LOXO_OK;
    if (!run->common->keep_partial) return LOXO_ERR_STOPPED;
    loxo_context_set_monitor(run->ctx, NULL, NULL);
    return LOXO_OK;
}

void cli_wrote(cli_run *run, const char *path)
{
    const int64_t n_bytes = loxo_os_gathered_bytes(run->ctx, path);
    json_t *entry = json_object();
    json_put_text(entry, "file", path);
    if (n_bytes >= 0) {
        json_put_integer(entry, "bytes", n_bytes);
        report_row(&run->report, "wrote", "%s  %s", text_path(path), text_bytes((double)n_bytes));
    }
    json_append(run->report.files, entry);
}

typedef struct file_kind {
    const char *suffix; /* and, without its dot, the word that --format takes */
    loxo_format format;
    bool mesh, field;
} file_kind;

/* The first that fits counts. */
static const file_kind file_kinds[] = {
    {".ply", LOXO_FORMAT_PLY, true, false},        {".obj", LOXO_FORMAT_OBJ, true, false},
    {".off", LOXO_FORMAT_OFF, true, false},        {".vtp", LOXO_FORMAT_VTP, true, false},
    {".surf.gii", LOXO_FORMAT_GIFTI, true, false}, {".shape.gii", LOXO_FORMAT_GIFTI, false, true},
    {".func.gii", LOXO_FORMAT_GIFTI, false, true}, {".gii", LOXO_FORMAT_GIFTI, true, true},
    {".npy", LOXO_FORMAT_NPY, false, true},        {".csv", LOXO_FORMAT_CSV, false, true},
    {".stl", LOXO_FORMAT_STL, false, false}, /* read only */
};

static bool ends_with(const char *path, const char *end)
{
    const size_t n_path = strlen(path), n_end = strlen(end);
    if (n_path < n_end) return false;
    for (size_t i = 0; i < n_end; ++i) {
        const char c = path[n_path - n_end + i];
        if ((c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c) != end[i]) return false;
    }
    return true;
}

loxo_status cli_output_format(cli_run *run, const char *path, const char *format_name, bool meshes_only,
                              loxo_format *format, cli_kind *kind)
{
    const char *choices = meshes_only ? ".ply .obj .off .vtp .surf.gii" : ".npy .csv .shape.gii .ply .vtp .surf.gii";
    const file_kind *found = NULL;
    for (size_t i = 0; i < sizeof file_kinds / sizeof *file_kinds && found == NULL; ++i) {
        const file_kind *k = &file_kinds[i];
        if (format_name != NULL ? strcmp(format_name, k->suffix + 1) == 0 : ends_with(path, k->suffix)) found = k;
    }
    if (found == NULL && format_name != NULL)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "--format %s is not known; one of (without the dot) %s", format_name,
                        choices);
    if (found == NULL && strcmp(path, "-") == 0)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "standard output needs --format; one of (without the dot) %s", choices);
    if (found == NULL && ends_with(path, ".gz"))
        return cli_fail(run, LOXO_ERR_ARGUMENT, "%s: gzip is read, not written; pipe -o - into gzip", path);
    if (found == NULL)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "%s: the suffix names no format; one of %s", path, choices);
    if (!(found->mesh || (found->field && !meshes_only)))
        return cli_fail(run, LOXO_ERR_UNSUPPORTED, "%s cannot be written here; one of %s", found->suffix, choices);
    *format = found->format;
    if (!found->mesh || !found->field) *kind = found->mesh ? CLI_MESH : CLI_FIELD;
    return LOXO_OK;
}

double cli_seconds(cli_run *run, const char *name, double since_s)
{
    const double now = loxo_os_clock_s();
    json_t *seconds = json_object_get(run->report.json, "seconds");
    json_put_number(seconds, name, now - since_s);
    return now;
}

loxo_status cli_read_mesh(cli_run *run, const char *path, loxo_soup *soup)
{
    const loxo_read_settings settings = loxo_read_settings_default();
    const double start_s = loxo_os_clock_s();
    run->input = path;
    json_put_text(run->report.json, "input", path);
    const loxo_status status = loxo_read_mesh(run->ctx, path, &settings, soup);
    if (status < 0) return status;
    const double seconds = cli_seconds(run, "read", start_s) - start_s;
    report_row(&run->report, "input", "%s  %s vertices, %s faces%s", text_path(path), text_count(soup->n_vertices),
               text_count(soup->n_faces), soup->position_float != NULL ? ", float" : "");
    report_row(&run->report, "read", "%s", text_seconds(seconds));
    return cli_combine(run, status);
}

/* ---- end ----------------------------------------------------------------------------------------------------- */

static const char *name_of_file(const char *file, loxo_status status)
{
    if (strcmp(file, "-") != 0) return text_path(file);
    return status == LOXO_ERR_WRITE ? "standard output" : "standard input";
}

static loxo_failure last_failure(const cli_run *run, loxo_status status)
{
    loxo_failure f = {.status = status, .byte = -1, .element = -1};
    if (run->failure.status == status)
        f = run->failure;
    else if (run->ctx != NULL && loxo_context_failure(run->ctx)->status == status)
        f = *loxo_context_failure(run->ctx);
    if (status == LOXO_ERR_STOPPED) { /* whatever file was at hand is not to blame */
        f = (loxo_failure){.status = status, .byte = -1, .element = -1};
        (void)snprintf(f.text, sizeof f.text, "stopped by signal %d; nothing was written", signals_caught());
    }
    if (f.text[0] == '\0') (void)snprintf(f.text, sizeof f.text, "%s", loxo_status_text(status));
    if (f.file[0] == '\0' && run->input != NULL &&
        (status == LOXO_ERR_MESH || status == LOXO_ERR_MALFORMED || status == LOXO_ERR_LIMIT))
        (void)snprintf(f.file, sizeof f.file, "%s", run->input);
    return f;
}

static void print_error(const loxo_failure *f)
{
    if (f->file[0] == '\0')
        (void)fprintf(stderr, "loxo: error: %s\n", text_path(f->text));
    else if (f->line > 0)
        (void)fprintf(stderr, "%s:%lld: error: %s\n", name_of_file(f->file, f->status), (long long)f->line,
                      text_path(f->text));
    else if (f->byte >= 0)
        (void)fprintf(stderr, "%s: byte %lld: error: %s\n", name_of_file(f->file, f->status), (long long)f->byte,
                      text_path(f->text));
    else
        (void)fprintf(stderr, "%s: error: %s\n", name_of_file(f->file, f->status), text_path(f->text));
}

static void put_failure(cli_run *run, const loxo_failure *f)
{
    json_t *failure = json_put_object(run->report.json, "failure");
    json_put_text(failure, "text", f->text);
    if (f->file[0] != '\0') json_put_text(failure, "file", f->file);
    if (f->line > 0) json_put_integer(failure, "line", f->line);
    if (f->byte >= 0) json_put_integer(failure, "byte", f->byte);
    if (f->element >= 0) json_put_integer(failure, "element", f->element);
}

/* The context's warnings join the command's own. A failed run says one line, why; its warnings are in the report, and
 * on standard error with --verbose. Returns how many there are. */
static size_t tell_warnings(cli_run *run, loxo_status status)
{
    if (run->ctx == NULL) return 0;
    for (int i = 0; i < loxo_context_n_warnings(run->ctx); ++i) {
        const loxo_warning *w = loxo_context_warning(run->ctx, i);
        cli_warn(run, w->count, "%s", w->text);
    }
    if (status == LOXO_NOT_CONVERGED || status == LOXO_CHECK_FAILED || status == LOXO_STOPPED)
        cli_warn(run, 1, "%s", loxo_status_text(status));
    const size_t n = json_array_size(run->report.warnings);
    for (size_t i = 0; i < n && (status >= 0 || run->common->verbose); ++i) {
        const char *text = json_string_value(json_object_get(json_array_get(run->report.warnings, i), "text"));
        (void)fprintf(stderr, "%s: warning: %s\n", run->input != NULL ? name_of_file(run->input, LOXO_OK) : "loxo",
                      text != NULL ? text : "");
    }
    return n;
}

static int exit_code_of(const cli_run *run, loxo_status status, size_t n_warnings)
{
    if (status == LOXO_ERR_STOPPED || status == LOXO_STOPPED) return 128 + signals_caught();
    const int code = loxo_status_exit_code(status);
    return code == 0 && n_warnings > 0 && run->common->strict ? 1 : code;
}

static loxo_status write_json(cli_run *run, loxo_status status, int exit_code)
{
    json_t *json = run->report.json;
    const loxo_memory memory = loxo_context_memory(run->ctx);
    json_put_text(json, "status", loxo_status_name(status));
    json_put_text(json, "status_text", loxo_status_text(status));
    json_put_integer(json, "exit_code", exit_code);
    (void)cli_seconds(run, "total", run->start_s);
    json_put_number(json_object_get(json, "seconds"), "processor", loxo_os_cpu_s());
    json_t *bytes = json_put_object(json, "memory");
    json_put_integer(bytes, "peak_bytes", (int64_t)memory.peak_bytes);
    json_put_integer(bytes, "limit_bytes", (int64_t)run->limit_bytes);
    json_put_integer(bytes, "peak_resident_bytes", (int64_t)loxo_os_peak_rss());
    json_put_integer(bytes, "program_bytes", (int64_t)run->program_bytes);

    size_t n = 0;
    char *text = report_json(&run->report, &n);
    if (text == NULL) return cli_fail(run, LOXO_ERR_MEMORY, "no memory for the report");
    const loxo_status written = loxo_write_bytes(run->ctx, run->json_path, text, n);
    free(text);
    return written;
}

/* To standard error, for standard output is the results'; an estimate is itself what was asked for. */
static void print_rows(const cli_run *run)
{
    const bool taken = run->json_path != NULL && strcmp(run->json_path, "-") == 0;
    if (run->common->estimate && !taken)
        (void)fputs(run->report.text, stdout);
    else if (!run->common->quiet)
        (void)fputs(run->report.text, stderr);
}

/* The report joins the other files, and all get their names. From here on a signal comes too late. */
static loxo_status finish_files(cli_run *run, loxo_status status, int exit_code)
{
    loxo_status written = LOXO_OK;
    if (run->json_path != NULL && strcmp(run->json_path, "-") != 0) written = write_json(run, status, exit_code);
    signals_hold();
    return written < 0 ? written : loxo_os_gather_commit(run->ctx);
}

/* Who listens on standard output is told also of a failure, which leaves no file. */
static loxo_status finish_stream(cli_run *run, loxo_status status, int exit_code)
{
    if (run->json_path == NULL || strcmp(run->json_path, "-") != 0) return LOXO_OK;
    return write_json(run, status, exit_code);
}

/* A stop was asked for before the files had their names. What went to standard output is there already. */
static bool is_stopped_late(const cli_run *run)
{
    bool has_file = false;
    for (int i = 0; i < run->n_files; ++i)
        has_file = has_file || strcmp(run->file[i], "-") != 0;
    return has_file && signals_caught() != 0 && !run->common->keep_partial;
}

int cli_run_end(cli_run *run, loxo_status status)
{
    int code;
    if (run->bar_drawn) (void)fputs("\r\033[K", stderr);
    if (status >= 0) {
        (void)cli_combine(run, status);
        status = is_stopped_late(run) ? LOXO_ERR_STOPPED : run->status;
    }
    if (status == LOXO_ERR_WRITE && signals_pipe_closed()) {
        code = 128 + 13; /* as if SIGPIPE had ended it: nobody is listening */
        goto done;
    }
    const size_t n_warnings = tell_warnings(run, status);
    code = exit_code_of(run, status, n_warnings);
    if (status >= 0) {
        const loxo_status written = finish_files(run, status, code);
        if (written < 0) status = written;
        code = exit_code_of(run, status, n_warnings);
    }
    loxo_failure failure = last_failure(run, status);
    if (run->ctx != NULL) {
        if (status < 0) put_failure(run, &failure);
        loxo_os_gather_abandon(run->ctx);
        const loxo_status written = finish_stream(run, status, code);
        if (written == LOXO_ERR_WRITE && signals_pipe_closed()) {
            code = 128 + 13;
            goto done;
        }
        if (written < 0 && status >= 0) {
            status = written;
            failure = last_failure(run, status);
            code = exit_code_of(run, status, n_warnings);
        }
    }
    if (status < 0)
        print_error(&failure);
    else if (fflush(run->report.rows) == 0)
        print_rows(run);
done:
    report_destroy(&run->report);
    loxo_context_destroy(run->ctx);
    cli_args_destroy(&run->args);
    return code;
}
