/* SPDX-License-Identifier: MIT
 * Atomic output: a temporary neighbour, fsync, rename, fsync of the directory. Every call is checked: a full disk may
 * show only at the last of them. */
#define _GNU_SOURCE /* O_DIRECTORY, openat and friends */
#include "base/context.h"
#include "base/os.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define MAX_TRANSFER ((size_t)1 << 30)

static loxo_status fail_write(loxo_context *ctx, const char *path, const char *what, int error)
{
    const loxo_place place = {.file = path, .byte = -1, .element = -1};
    return loxo_fail_at(ctx, LOXO_ERR_WRITE, place, "cannot %s: %s", what, strerror(error));
}

/* Splits the path, after following a symbolic link at its end, into an open directory and a name in it. */
static loxo_status find_target(loxo_context *ctx, const char *path, loxo_os_output *out)
{
    char resolved[PATH_MAX];
    struct stat st;
    const char *real = path;
    if (path[0] == '\0') return fail_write(ctx, path, "write", ENOENT);
    if (strlen(path) >= sizeof out->path) return fail_write(ctx, path, "write", ENAMETOOLONG);
    if (lstat(path, &st) == 0 && S_ISLNK(st.st_mode) && realpath(path, resolved) != NULL) real = resolved;
    if (stat(real, &st) == 0 && !S_ISREG(st.st_mode)) {
        const loxo_place place = {.file = path, .byte = -1, .element = -1};
        return loxo_fail_at(ctx, LOXO_ERR_WRITE, place, "cannot write: it is %s, not a regular file",
                            S_ISDIR(st.st_mode) ? "a directory" : "a device or another special file");
    }
    const char *slash = strrchr(real, '/');
    const char *name = slash != NULL ? slash + 1 : real;
    if (name[0] == '\0') return fail_write(ctx, path, "write", EISDIR);
    snprintf(out->path, sizeof out->path, "%s", path);
    snprintf(out->target, sizeof out->target, "%s", name);
    char directory[PATH_MAX];
    if (slash == NULL)
        snprintf(directory, sizeof directory, ".");
    else
        snprintf(directory, sizeof directory, "%.*s", slash == real ? 1 : (int)(slash - real), real);
    out->directory_fd = open(directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (out->directory_fd < 0) return fail_write(ctx, path, "open the directory of the output", errno);
    return LOXO_OK;
}

loxo_status loxo_os_output_check(loxo_context *ctx, const char *path)
{
    loxo_os_output out = {.fd = -1, .directory_fd = -1};
    if (strcmp(path, "-") == 0) return LOXO_OK;
    const loxo_status status = find_target(ctx, path, &out);
    if (status < 0) return status;
    const bool writable = faccessat(out.directory_fd, ".", W_OK | X_OK, AT_EACCESS) == 0;
    const int error = errno;
    close(out.directory_fd);
    return writable ? LOXO_OK : fail_write(ctx, path, "write into the directory of the output", error);
}

/* Name of the temporary neighbour: hidden, with process and time in it; O_EXCL settles what is left of chance. */
static void name_temporary(loxo_os_output *out, int attempt)
{
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    snprintf(out->temporary, sizeof out->temporary, ".%.200s.%ld.%08lx.%d.tmp", out->target, (long)getpid(),
             (unsigned long)t.tv_nsec, attempt);
}

loxo_status loxo_os_output_create(loxo_context *ctx, const char *path, loxo_os_output *out)
{
    *out = (loxo_os_output){.fd = -1, .directory_fd = -1};
    if (strcmp(path, "-") == 0) {
        out->is_stream = true;
        snprintf(out->path, sizeof out->path, "-");
        out->fd = dup(STDOUT_FILENO);
        return out->fd >= 0 ? LOXO_OK : fail_write(ctx, "standard output", "open", errno);
    }
    const loxo_status status = find_target(ctx, path, out);
    if (status < 0) return status;
    for (int attempt = 0; attempt < 100 && out->fd < 0; ++attempt) {
        name_temporary(out, attempt);
        out->fd = openat(out->directory_fd, out->temporary, O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
        if (out->fd < 0 && errno != EEXIST && errno != EINTR) break;
    }
    if (out->fd >= 0) return LOXO_OK;
    const int error = errno;
    close(out->directory_fd);
    out->directory_fd = -1;
    return fail_write(ctx, path, "create a file beside the output", error);
}

loxo_status loxo_os_output_write(loxo_context *ctx, loxo_os_output *out, const void *bytes, size_t n)
{
    const unsigned char *p = bytes;
    while (n > 0) {
        const ssize_t w = write(out->fd, p, n < MAX_TRANSFER ? n : MAX_TRANSFER);
        if (w < 0 && errno == EINTR) continue;
        if (w < 0) return fail_write(ctx, out->path, "write", errno);
        p += w;
        n -= (size_t)w;
        out->n_bytes += w;
    }
    return LOXO_OK;
}

loxo_status loxo_os_output_write_at(loxo_context *ctx, loxo_os_output *out, int64_t offset, const void *bytes, size_t n)
{
    const unsigned char *p = bytes;
    if (out->is_stream) return fail_write(ctx, out->path, "go back in a stream", ESPIPE);
    while (n > 0) {
        const ssize_t w = pwrite(out->fd, p, n < MAX_TRANSFER ? n : MAX_TRANSFER, (off_t)offset);
        if (w < 0 && errno == EINTR) continue;
        if (w < 0) return fail_write(ctx, out->path, "write", errno);
        p += w;
        n -= (size_t)w;
        offset += w;
    }
    return LOXO_OK;
}

static int close_fd(int *fd)
{
    const int result = *fd >= 0 ? close(*fd) : 0;
    *fd = -1;
    return result;
}

loxo_status loxo_os_output_commit(loxo_context *ctx, loxo_os_output *out)
{
    struct stat st;
    if (out->is_stream) {
        if (close_fd(&out->fd) != 0) return fail_write(ctx, "standard output", "close", errno);
        return LOXO_OK;
    }
    /* The new file takes the old one's permissions. */
    if (fstatat(out->directory_fd, out->target, &st, 0) == 0 && fchmod(out->fd, st.st_mode & 0777) != 0 &&
        errno != EPERM) {
        const int error = errno;
        loxo_os_output_abandon(out);
        return fail_write(ctx, out->path, "set the permissions", error);
    }
    if (fsync(out->fd) != 0 || close_fd(&out->fd) != 0 ||
        renameat(out->directory_fd, out->temporary, out->directory_fd, out->target) != 0) {
        const int error = errno;
        loxo_os_output_abandon(out);
        return fail_write(ctx, out->path, "finish the file", error);
    }
    out->temporary[0] = '\0';
    /* The name is in place; a directory that cannot be synced (some network systems) is no failure of ours. */
    (void)fsync(out->directory_fd);
    close_fd(&out->directory_fd);
    return LOXO_OK;
}

void loxo_os_output_abandon(loxo_os_output *out)
{
    if (out->target[0] == '\0' && !out->is_stream) return; /* {0}: nothing was created */
    close_fd(&out->fd);
    if (out->temporary[0] != '\0' && out->directory_fd >= 0) (void)unlinkat(out->directory_fd, out->temporary, 0);
    out->temporary[0] = '\0';
    close_fd(&out->directory_fd);
    out->target[0] = '\0';
    out->is_stream = false;
}
