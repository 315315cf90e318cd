/* SPDX-License-Identifier: MIT
 * Somebody else's program on the same mesh, in the same run. */
#include "base/os.h"
#include "bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct replacement {
    const char *key, *text;
} replacement;

/* Puts the replacements into a command; texts are quoted for the shell. false: too long. */
static bool fill_in(const char *command, const replacement *with, char *out, size_t n)
{
    size_t used = 0;
    while (*command != '\0') {
        const replacement *r = with;
        while (r->key != NULL && strncmp(command, r->key, strlen(r->key)) != 0)
            ++r;
        const int wrote = r->key != NULL ? snprintf(out + used, n - used, "'%s'", r->text)
                                         : snprintf(out + used, n - used, "%c", *command);
        if (wrote < 0 || (size_t)wrote >= n - used) return false;
        used += (size_t)wrote;
        command += r->key != NULL ? strlen(r->key) : 1;
    }
    return true;
}

/* The number behind a word at the start of a line; NaN when there is no such line. */
static double value_of(const char *text, const char *word)
{
    const size_t n = strlen(word);
    for (const char *line = text; line != NULL; line = strchr(line, '\n')) {
        if (*line == '\n') ++line;
        if (strncmp(line, word, n) == 0 && line[n] == ' ') return strtod(line + n, NULL);
    }
    return NAN;
}

loxo_status bench_peer_run(bench *b, const bench_peer *peer, const char *mesh, const char *out, int n_threads,
                           const char *method, bench_peer_result *result)
{
    char command[4 * BENCH_PATH], threads[16], source[32];
    bench_child child;
    *result = (bench_peer_result){NAN, NAN, 0, false};
    (void)unlink(out); /* of a round before */
    snprintf(threads, sizeof threads, "%d", n_threads);
    snprintf(source, sizeof source, "%lld", (long long)b->settings.source);
    const replacement with[] = {{"{mesh}", mesh},       {"{sources}", source}, {"{out}", out},
                                {"{threads}", threads}, {"{method}", method},  {NULL, NULL}};
    if (strchr(mesh, '\'') != NULL || strchr(out, '\'') != NULL ||
        !fill_in(peer->command, with, command, sizeof command))
        return bench_fail(b, LOXO_ERR_ARGUMENT, "--compare-with: %s: the command cannot be built", peer->name);
    const loxo_status status = bench_child_run(b->ctx, (const char *const[]){"/bin/sh", "-c", command, NULL}, &child);
    if (status < 0) return status;
    result->seconds = value_of(child.text, "seconds");
    result->diffusion_s = value_of(child.text, "phase diffusion");
    const double bytes = value_of(child.text, "bytes");
    result->peak_bytes = bytes > 0.0 ? (size_t)bytes : 0;
    result->has_written = access(out, R_OK) == 0;
    loxo_release(b->ctx, child.text);
    if (child.exit_code == 0 && result->seconds > 0.0) return LOXO_OK;
    return bench_fail(b, LOXO_ERR_UNSUPPORTED, "%s: exit code %d%s: %s", peer->name, child.exit_code,
                      child.exit_code == 0 ? ", but no line `seconds X`" : "", command);
}

loxo_status bench_read_distances(bench *b, const char *path, int64_t n, double **distance)
{
    loxo_os_file file;
    char magic[6] = {0};
    size_t got = 0;
    int64_t n_read = 0;
    *distance = NULL;
    loxo_status status = loxo_os_open(b->ctx, path, &file);
    if (status < 0) return status;
    if ((status = loxo_os_read_at(b->ctx, &file, 0, magic, sizeof magic, &got)) < 0) goto done;
    if (memcmp(magic, "\x93NUMPY", 6) == 0) {
        status = loxo_read_field(b->ctx, path, distance, &n_read);
    } else if (file.n_bytes != n * (int64_t)sizeof **distance) {
        status = bench_fail(b, LOXO_ERR_MALFORMED, "%s: %lld bytes, not %lld float64 values", path,
                            (long long)file.n_bytes, (long long)n);
    } else {
        *distance = loxo_allocate(b->ctx, n, sizeof **distance);
        status = *distance == NULL ? LOXO_ERR_MEMORY
                                   : loxo_os_read(b->ctx, &file, *distance, (size_t)n * sizeof **distance, &got);
        n_read = (int64_t)(got / sizeof **distance);
    }
    if (status >= 0 && n_read != n)
        status = bench_fail(b, LOXO_ERR_MALFORMED, "%s: %lld values for %lld vertices", path, (long long)n_read,
                            (long long)n);
    if (status < 0) {
        loxo_release(b->ctx, *distance);
        *distance = NULL;
    }
done:
    loxo_os_close(&file);
    return status;
}
