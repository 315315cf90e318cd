/* SPDX-License-Identifier: MIT
 * Atomic output: a temporary neighbour, fsync, rename, fsync of the directory. Every call is checked: a full disk may
 * show only at the last of them. */
#define _GNU_SOURCE /* O_DIRECTORY, O_TMPFILE, openat and friends */
#include "base/allocate.h"
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

#define MAX_ATTEMPTS 100

#ifdef O_TMPFILE

/* By which a file without a name gets one. */
static void fd_path(const loxo_os_output *out, char path[64]) { snprintf(path, 64, "/proc/self/fd/%d", out->fd); }

/* False where the file system, or the system, cannot. */
static bool open_unnamed(loxo_os_output *out)
{
    char path[64];
    struct stat of_fd, of_path;
    out->fd = openat(out->directory_fd, ".", O_RDWR | O_TMPFILE | O_CLOEXEC, 0666);
    if (out->fd < 0) return false;
    fd_path(out, path);
    if (fstat(out->fd, &of_fd) == 0 && stat(path, &of_path) == 0 && of_fd.st_ino == of_path.st_ino) return true;
    close(out->fd);
    out->fd = -1;
    return false;
}

static bool give_temporary_name(loxo_os_output *out)
{
    char path[64];
    fd_path(out, path);
    for (int attempt = 0; attempt < MAX_ATTEMPTS; ++attempt) {
        name_temporary(out, attempt);
        if (linkat(AT_FDCWD, path, out->directory_fd, out->temporary, AT_SYMLINK_FOLLOW) == 0) return true;
        if (errno != EEXIST) break;
    }
    out->temporary[0] = '\0';
    return false;
}

#else

static bool open_unnamed(loxo_os_output *out)
{
    (void)out;
    return false;
}

static bool give_temporary_name(loxo_os_output *out)
{
    (void)out;
    return false;
}

#endif

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
    if (open_unnamed(out)) return LOXO_OK;
    for (int attempt = 0; attempt < MAX_ATTEMPTS && out->fd < 0; ++attempt) {
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

static loxo_status fail_finish(loxo_context *ctx, loxo_os_output *out, const char *what)
{
    const int error = errno;
    loxo_os_output_abandon(out);
    return fail_write(ctx, out->path, what, error);
}

/* All of it is on the disk; a file that has a name is closed, too. */
static loxo_status complete(loxo_context *ctx, loxo_os_output *out)
{
    struct stat st;
    /* The new file takes the old one's permissions. */
    if (fstatat(out->directory_fd, out->target, &st, 0) == 0 && fchmod(out->fd, st.st_mode & 0777) != 0 &&
        errno != EPERM)
        return fail_finish(ctx, out, "set the permissions");
    if (fsync(out->fd) != 0 || (out->temporary[0] != '\0' && close_fd(&out->fd) != 0))
        return fail_finish(ctx, out, "finish the file");
    return LOXO_OK;
}

static loxo_status put_in_place(loxo_context *ctx, loxo_os_output *out)
{
    if ((out->temporary[0] == '\0' && !give_temporary_name(out)) || close_fd(&out->fd) != 0 ||
        renameat(out->directory_fd, out->temporary, out->directory_fd, out->target) != 0)
        return fail_finish(ctx, out, "finish the file");
    out->temporary[0] = '\0';
    /* The name is in place; a directory that cannot be synced (some network systems) is no failure of ours. */
    (void)fsync(out->directory_fd);
    close_fd(&out->directory_fd);
    return LOXO_OK;
}

/* Moves a complete file to those that wait for their names. */
static loxo_status keep(loxo_context *ctx, loxo_os_output *out)
{
    loxo_os_output *kept = NULL;
    if (ctx->n_gathered < LOXO_MAX_GATHERED) kept = loxo_allocate(ctx, 1, sizeof *kept);
    if (kept == NULL) {
        loxo_os_output_abandon(out);
        if (ctx->n_gathered < LOXO_MAX_GATHERED) return LOXO_ERR_MEMORY;
        return loxo_fail(ctx, LOXO_ERR_LIMIT, "more than %d files at once", LOXO_MAX_GATHERED);
    }
    *kept = *out;
    *out = (loxo_os_output){.fd = -1, .directory_fd = -1};
    ctx->gathered[ctx->n_gathered++] = kept;
    return LOXO_OK;
}

loxo_status loxo_os_output_commit(loxo_context *ctx, loxo_os_output *out)
{
    if (out->is_stream) {
        if (close_fd(&out->fd) != 0) return fail_write(ctx, "standard output", "close", errno);
        return LOXO_OK;
    }
    const loxo_status status = complete(ctx, out);
    if (status < 0) return status;
    return ctx->is_gathering ? keep(ctx, out) : put_in_place(ctx, out);
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

/* ---- files that appear together --------------------------------------------------------------------------------- */

void loxo_os_gather_begin(loxo_context *ctx) { ctx->is_gathering = true; }

void loxo_os_gather_abandon(loxo_context *ctx)
{
    for (int i = 0; i < ctx->n_gathered; ++i) {
        loxo_os_output_abandon(ctx->gathered[i]);
        loxo_release(ctx, ctx->gathered[i]);
    }
    ctx->n_gathered = 0;
    ctx->is_gathering = false;
}

loxo_status loxo_os_gather_commit(loxo_context *ctx)
{
    loxo_status status = LOXO_OK;
    for (int i = 0; i < ctx->n_gathered && status >= 0; ++i) {
        status = put_in_place(ctx, ctx->gathered[i]);
        if (status >= 0) ctx->gathered[i]->target[0] = '\0'; /* no longer ours */
    }
    loxo_os_gather_abandon(ctx);
    return status;
}

int64_t loxo_os_gathered_bytes(const loxo_context *ctx, const char *path)
{
    for (int i = 0; i < ctx->n_gathered; ++i)
        if (strcmp(ctx->gathered[i]->path, path) == 0) return ctx->gathered[i]->n_bytes;
    return -1;
}
