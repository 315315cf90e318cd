/* SPDX-License-Identifier: MIT
 * Linux and POSIX: clock, memory, processors, reading. */
#define _GNU_SOURCE /* sched_getaffinity, strtod_l */
#include "base/context.h"
#include "base/os.h"

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <locale.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define LARGE_PAGE ((size_t)2 << 20)
/* Linux moves at most 0x7ffff000 bytes in one call; smaller slices also let a stop be seen. */
#define MAX_TRANSFER ((size_t)1 << 30)

double loxo_os_clock_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

double loxo_os_cpu_s(void)
{
    struct rusage u;
    if (getrusage(RUSAGE_SELF, &u) != 0) return 0.0;
    return (double)(u.ru_utime.tv_sec + u.ru_stime.tv_sec) + 1e-6 * (double)(u.ru_utime.tv_usec + u.ru_stime.tv_usec);
}

double loxo_os_thread_cpu_s(void)
{
    struct timespec t;
    if (clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t) != 0) return 0.0;
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

size_t loxo_os_memory(void)
{
    const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    return pages > 0 && page > 0 ? (size_t)pages * (size_t)page : 0;
}

/* The beginning of a small file in buffer; false when it cannot be read. */
static bool read_small(const char *path, char *buffer, size_t n)
{
    const int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) return false;
    const ssize_t got = read(fd, buffer, n - 1);
    close(fd);
    if (got <= 0) return false;
    buffer[got] = '\0';
    return true;
}

/* What getrusage tells starts with what the process had before exec, which is that of a large parent who forked. */
size_t loxo_os_peak_rss(void)
{
    static const char key[] = "\nVmHWM:";
    char text[4096];
    struct rusage u;
    const char *at = read_small("/proc/self/status", text, sizeof text) ? strstr(text, key) : NULL;
    const long long kibibytes = at != NULL ? strtoll(at + sizeof key - 1, NULL, 10) : 0;
    if (kibibytes > 0) return (size_t)kibibytes * 1024;
    return getrusage(RUSAGE_SELF, &u) == 0 && u.ru_maxrss > 0 ? (size_t)u.ru_maxrss * 1024 : 0;
}

size_t loxo_os_memory_limit(void)
{
    static const char *const paths[] = {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"};
    size_t limit = loxo_os_memory();
    struct rlimit r;
    char text[64];
    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; ++i) {
        if (!read_small(paths[i], text, sizeof text)) continue;
        char *end = NULL;
        const unsigned long long n = strtoull(text, &end, 10); /* "max" leaves end at text */
        if (end != text && n > 0 && (limit == 0 || n < limit)) limit = (size_t)n;
    }
    if (getrlimit(RLIMIT_AS, &r) == 0 && r.rlim_cur != RLIM_INFINITY && (limit == 0 || r.rlim_cur < limit))
        limit = (size_t)r.rlim_cur;
    return limit;
}

int loxo_os_n_processors(void)
{
    cpu_set_t set;
    int n = 0;
    char text[64];
    CPU_ZERO(&set);
    if (sched_getaffinity(0, sizeof set, &set) == 0) n = CPU_COUNT(&set);
    if (n < 1) n = (int)sysconf(_SC_NPROCESSORS_ONLN);
    if (read_small("/sys/fs/cgroup/cpu.max", text, sizeof text)) {
        char *end = NULL;
        const long long quota = strtoll(text, &end, 10);
        const long long period = end != text ? strtoll(end, NULL, 10) : 0;
        if (quota > 0 && period > 0) {
            const long long granted = (quota + period - 1) / period;
            if (granted < n) n = (int)granted;
        }
    }
    return n > 0 ? n : 1;
}

void loxo_os_yield(void) { (void)sched_yield(); }

/* n_bytes in whole pages; 0 when that does not fit. */
static size_t whole_pages(size_t n_bytes)
{
    const long page = sysconf(_SC_PAGESIZE);
    const size_t mask = page > 0 ? (size_t)page - 1 : 4095;
    return n_bytes <= PTRDIFF_MAX - LARGE_PAGE - mask ? (n_bytes + mask) & ~mask : 0;
}

/* Address space that starts where a large page may; what is left over on both sides is given back. */
static unsigned char *map_aligned(size_t size, int protection)
{
    unsigned char *raw = mmap(NULL, size + LARGE_PAGE, protection, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (raw == MAP_FAILED) return NULL;
    const size_t before = (LARGE_PAGE - (uintptr_t)raw % LARGE_PAGE) % LARGE_PAGE;
    if (before > 0) (void)munmap(raw, before);
    (void)munmap(raw + before + size, LARGE_PAGE - before);
    return raw + before;
}

void *loxo_os_map(size_t n_bytes)
{
    const size_t size = whole_pages(n_bytes);
    void *block = size > 0 ? map_aligned(size, PROT_READ | PROT_WRITE) : NULL;
#ifdef MADV_HUGEPAGE
    if (block != NULL) (void)madvise(block, size, MADV_HUGEPAGE);
#endif
    return block;
}

void *loxo_os_remap(void *block, size_t old_bytes, size_t n_bytes)
{
#ifdef MREMAP_MAYMOVE
    const size_t old_size = whole_pages(old_bytes), size = whole_pages(n_bytes);
    if (size == 0) return NULL;
    void *moved = mremap(block, old_size, size, 0);
    if (moved != MAP_FAILED) return moved;
    /* To a place of the same alignment, so that large pages move as they are. */
    void *place = map_aligned(size, PROT_NONE);
    if (place == NULL) return NULL;
    moved = mremap(block, old_size, size, MREMAP_MAYMOVE | MREMAP_FIXED, place);
    if (moved != MAP_FAILED) return moved;
    (void)munmap(place, size);
#else
    (void)block, (void)old_bytes, (void)n_bytes;
#endif
    return NULL;
}

void loxo_os_unmap(void *block, size_t n_bytes) { (void)munmap(block, whole_pages(n_bytes)); }

bool loxo_os_is_terminal(int fd) { return isatty(fd) == 1; }

loxo_status loxo_os_open(loxo_context *ctx, const char *path, loxo_os_file *file)
{
    struct stat st;
    const loxo_place place = {.file = path, .byte = -1, .element = -1};
    const bool is_stdin = strcmp(path, "-") == 0;
    *file = (loxo_os_file){.fd = -1, .n_bytes = -1};
    int fd = is_stdin ? dup(STDIN_FILENO) : -1;
    if (!is_stdin) {
        do
            fd = open(path, O_RDONLY | O_CLOEXEC | O_NOCTTY);
        while (fd < 0 && errno == EINTR);
    }
    if (fd < 0) return loxo_fail_at(ctx, LOXO_ERR_READ, place, "cannot open: %s", strerror(errno));
    if (fstat(fd, &st) != 0 || S_ISDIR(st.st_mode)) {
        const bool is_directory = S_ISDIR(st.st_mode);
        const int error = errno;
        close(fd);
        return loxo_fail_at(ctx, LOXO_ERR_READ, place, "cannot open: %s",
                            is_directory ? "it is a directory" : strerror(error));
    }
    file->fd = fd;
    file->is_regular = S_ISREG(st.st_mode) && lseek(fd, 0, SEEK_CUR) == 0;
    if (file->is_regular) file->n_bytes = (int64_t)st.st_size;
    return LOXO_OK;
}

loxo_status loxo_os_read(loxo_context *ctx, const loxo_os_file *file, void *bytes, size_t n, size_t *got)
{
    unsigned char *p = bytes;
    *got = 0;
    while (*got < n) {
        const size_t ask = n - *got < MAX_TRANSFER ? n - *got : MAX_TRANSFER;
        const ssize_t r = read(file->fd, p + *got, ask);
        if (r < 0 && errno == EINTR) continue;
        if (r < 0) return loxo_fail(ctx, LOXO_ERR_READ, "cannot read: %s", strerror(errno));
        if (r == 0) break;
        *got += (size_t)r;
    }
    return LOXO_OK;
}

loxo_status loxo_os_read_at(loxo_context *ctx, const loxo_os_file *file, int64_t offset, void *bytes, size_t n,
                            size_t *got)
{
    unsigned char *p = bytes;
    *got = 0;
    while (*got < n) {
        const size_t ask = n - *got < MAX_TRANSFER ? n - *got : MAX_TRANSFER;
        const ssize_t r = pread(file->fd, p + *got, ask, (off_t)(offset + (int64_t)*got));
        if (r < 0 && errno == EINTR) continue;
        if (r < 0) return loxo_fail(ctx, LOXO_ERR_READ, "cannot read: %s", strerror(errno));
        if (r == 0) break;
        *got += (size_t)r;
    }
    return LOXO_OK;
}

void loxo_os_close(loxo_os_file *file)
{
    if (file->fd >= 0) close(file->fd);
    file->fd = -1;
}

double loxo_os_strtod(const char *text, char **end)
{
    static locale_t c_locale; /* made once, never changed: no state of a caller is in it */
    locale_t mine = __atomic_load_n(&c_locale, __ATOMIC_ACQUIRE);
    if (mine == (locale_t)0) {
        locale_t expected = (locale_t)0;
        mine = newlocale(LC_ALL_MASK, "C", (locale_t)0);
        if (!__atomic_compare_exchange_n(&c_locale, &expected, mine, false, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE)) {
            freelocale(mine);
            mine = expected;
        }
    }
    return strtod_l(text, end, mine);
}

void *loxo_os_library(const char *name) { return dlopen(name, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE); }

void (*loxo_os_function(void *library, const char *name))(void)
{
    void *symbol = dlsym(library, name);
    void (*function)(void) = NULL;
    memcpy(&function, &symbol, sizeof function); /* POSIX lets them have one form, ISO C knows no cast for it */
    return function;
}
