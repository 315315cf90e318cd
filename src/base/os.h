/* SPDX-License-Identifier: MIT
 * The only door to the operating system: clock, files, memory and processor counts. */
#ifndef LOXO_BASE_OS_H
#define LOXO_BASE_OS_H

#include <loxo/context.h>

double loxo_os_clock_s(void);      /* monotonic */
double loxo_os_cpu_s(void);        /* user and system time of this process */
double loxo_os_thread_cpu_s(void); /* processor time of the calling thread: others may spin */
size_t loxo_os_peak_rss(void);     /* most resident bytes of this program so far */
size_t loxo_os_memory(void);       /* bytes of the machine, 0 when unknown */
size_t loxo_os_memory_limit(void); /* what the control group grants, or loxo_os_memory() */
int loxo_os_n_processors(void);    /* affinity and control-group quota, at least 1 */

/* Memory straight from the system, which has it back as soon as it is unmapped. It starts where a large page may, and
 * large pages are asked for: fewer faults at its first touch. NULL when there is none; all bytes are zero. n_bytes > 0. */
void *loxo_os_map(size_t n_bytes);
/* Grows or shrinks it by page tables, without copying; it may move. NULL when that cannot be done: it then stands as it
 * was. */
void *loxo_os_remap(void *block, size_t old_bytes, size_t n_bytes);
void loxo_os_unmap(void *block, size_t n_bytes);

bool loxo_os_is_terminal(int fd);
void loxo_os_yield(void); /* lets another thread have the processor */

/* A shared library, loaded now if it is not yet, and its functions; NULL: there is none. It stays loaded: threads that it
 * has started may still run in it. For large optional libraries, which would cost every start of every program else. */
void *loxo_os_library(const char *name);
void (*loxo_os_function(void *library, const char *name))(void);

/* A file or stream being read. */
typedef struct loxo_os_file {
    int fd;
    bool is_regular; /* has a size */
    int64_t n_bytes; /* of a regular file when it was opened; -1 otherwise */
} loxo_os_file;

/* Opens for reading; "-" is standard input. Directories are LOXO_ERR_READ. */
loxo_status loxo_os_open(loxo_context *ctx, const char *path, loxo_os_file *file);
/* Reads until n bytes or the end, looping over short reads and EINTR; *got says how many. */
loxo_status loxo_os_read(loxo_context *ctx, const loxo_os_file *file, void *bytes, size_t n, size_t *got);
/* Reads at an offset of a regular file without moving (threads may call it); ctx may be NULL: no message then. */
loxo_status loxo_os_read_at(loxo_context *ctx, const loxo_os_file *file, int64_t offset, void *bytes, size_t n,
                            size_t *got);
void loxo_os_close(loxo_os_file *file);

/* A file being written beside its target and renamed into place by commit. abandon leaves nothing behind. Where the file
 * system can, it has no name before commit, so that not even a kill leaves anything. */
typedef struct loxo_os_output {
    int fd, directory_fd;
    bool is_stream; /* "-": standard output, nothing to rename */
    char path[4097];
    char target[4097];    /* file name within the directory, after following a symbolic link */
    char temporary[4097]; /* its temporary neighbour; "" while it has no name */
    int64_t n_bytes;
} loxo_os_output;

loxo_status loxo_os_output_check(loxo_context *ctx, const char *path); /* could create() work? */
loxo_status loxo_os_output_create(loxo_context *ctx, const char *path, loxo_os_output *out);
loxo_status loxo_os_output_write(loxo_context *ctx, loxo_os_output *out, const void *bytes, size_t n);
/* Overwrites earlier bytes (a count that was not known); not for streams. */
loxo_status loxo_os_output_write_at(loxo_context *ctx, loxo_os_output *out, int64_t offset, const void *bytes,
                                    size_t n);
loxo_status loxo_os_output_commit(loxo_context *ctx, loxo_os_output *out); /* fsync, rename, fsync of the directory */
void loxo_os_output_abandon(loxo_os_output *out);                          /* also fine after commit or on {0} */

/* Files that shall appear together. After begin, loxo_os_output_commit completes a file on the disk and keeps it, unseen;
 * loxo_os_gather_commit then gives all of them their names, so that a full disk or a stop leaves none of the set. Only the
 * renaming itself can still fail on the way: what then has its name keeps it, the others are dropped. Streams are not
 * kept. A context that is destroyed drops what it keeps. */
void loxo_os_gather_begin(loxo_context *ctx);
loxo_status loxo_os_gather_commit(loxo_context *ctx);
void loxo_os_gather_abandon(loxo_context *ctx);
/* Of a kept file; -1: path is none. */
int64_t loxo_os_gathered_bytes(const loxo_context *ctx, const char *path);

/* strtod in the C locale, whatever the host has set: the slow, correctly rounded way for what io/scan does not do fast. */
double loxo_os_strtod(const char *text, char **end);

#endif
