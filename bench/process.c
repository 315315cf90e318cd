/* SPDX-License-Identifier: MIT
 * The bench's only door to other processes. */
#define _DEFAULT_SOURCE /* wait4, mkdtemp */
#include "base/os.h"
#include "bench.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#define MAX_OUTPUT ((size_t)1 << 20)

loxo_status bench_child_run(loxo_context *ctx, const char *const *argv, bench_child *child)
{
    int pipe_fd[2], state = 0;
    struct rusage usage;
    size_t used = 0;
    *child = (bench_child){.exit_code = -1};
    child->text = loxo_allocate(ctx, (int64_t)MAX_OUTPUT + 1, 1);
    if (child->text == NULL) return LOXO_ERR_MEMORY;
    if (pipe(pipe_fd) != 0) goto fail;
    fflush(stdout);
    const double start = loxo_os_clock_s();
    const pid_t pid = fork();
    if (pid < 0) {
        close(pipe_fd[0]);
        close(pipe_fd[1]);
        goto fail;
    }
    if (pid == 0) {
        /* exec takes char *const *, though it changes nothing */
        char *arguments[64];
        int n = 0;
        for (; argv[n] != NULL && n < 63; ++n)
            memcpy(&arguments[n], &argv[n], sizeof arguments[n]);
        arguments[n] = NULL;
        if (dup2(pipe_fd[1], STDOUT_FILENO) < 0) _exit(127);
        close(pipe_fd[0]);
        close(pipe_fd[1]);
        execvp(arguments[0], arguments);
        _exit(127);
    }
    close(pipe_fd[1]);
    for (;;) {
        char scrap[4096];
        const bool is_full = used == MAX_OUTPUT;
        const ssize_t got =
            read(pipe_fd[0], is_full ? scrap : child->text + used, is_full ? sizeof scrap : MAX_OUTPUT - used);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) break;
        if (!is_full) used += (size_t)got;
    }
    child->text[used] = '\0';
    close(pipe_fd[0]);
    while (wait4(pid, &state, 0, &usage) < 0)
        if (errno != EINTR) goto fail;
    child->wall_s = loxo_os_clock_s() - start;
    child->exit_code = WIFEXITED(state) ? WEXITSTATUS(state) : 128 + WTERMSIG(state);
    child->peak_bytes = (size_t)usage.ru_maxrss * 1024;
    return LOXO_OK;
fail:
    loxo_release(ctx, child->text);
    child->text = NULL;
    return LOXO_ERR_UNSUPPORTED;
}

bool bench_self_path(char path[BENCH_PATH])
{
    const ssize_t n = readlink("/proc/self/exe", path, BENCH_PATH - 1);
    if (n <= 0) return false;
    path[n] = '\0';
    return true;
}

bool bench_make_folder(char path[BENCH_PATH])
{
    const char *root = getenv("TMPDIR");
    if (root == NULL || root[0] == '\0') root = "/tmp";
    for (int i = 0; i < 100; ++i) { /* one that is there already is somebody else's */
        const int n = snprintf(path, BENCH_PATH, "%s/loxo-bench-%ld-%d", root, (long)getpid(), i);
        if (n <= 0 || n >= BENCH_PATH) return false;
        if (mkdir(path, 0700) == 0) return true;
        if (errno != EEXIST) return false;
    }
    return false;
}

void bench_remove_folder(const char *path)
{
    DIR *folder = opendir(path);
    if (folder == NULL) return;
    for (const struct dirent *entry = readdir(folder); entry != NULL; entry = readdir(folder)) {
        char file[BENCH_PATH + 260];
        if (snprintf(file, sizeof file, "%s/%s", path, entry->d_name) < (int)sizeof file) unlink(file);
    }
    closedir(folder);
    rmdir(path);
}
