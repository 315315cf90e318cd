/* SPDX-License-Identifier: MIT
 * Thin names over cmocka. Write TEST(name) { ... } as often as you like: each registers itself, and
 * main() stands here, so a test program is one file. A word on its command line filters the tests (? and * match).
 *
 * Every test finds a fresh test_context and fails when it leaves bytes allocated in it. */
#ifndef LOXO_TEST_H
#define LOXO_TEST_H

#include <loxo/context.h>

#include <dirent.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* cmocka.h stands on the headers above. */
/* clang-format off */
#include <cmocka.h>
/* clang-format on */

#define TEST_MAX_CASES 256

typedef void (*test_body_fn)(void);

static struct CMUnitTest test_cases[TEST_MAX_CASES];
static test_body_fn test_bodies[TEST_MAX_CASES];
static int test_n_cases;
static loxo_context *test_context;

/* A test of the name; constructors run in the order of the file. */
#define TEST(name)                                                                                                     \
    static void case_##name(void);                                                                                     \
    __attribute__((constructor)) static void register_##name(void) { test_register(#name, case_##name); }              \
    static void case_##name(void)

/* ---- checks; each ends the test when it fails ---- */

#define CHECK(condition) test_check((condition), #condition, __FILE__, __LINE__)
/* Numbers of any type, compared exactly. */
#define CHECK_EQUAL(a, b) test_check_equal((long double)(a), (long double)(b), #a, #b, __FILE__, __LINE__)
/* |a - b| <= tolerance; equal infinities are near, NaN is near nothing. */
#define CHECK_NEAR(a, b, tolerance) test_check_near((a), (b), (tolerance), #a, #b, __FILE__, __LINE__)
/* The same for each of three coordinates. */
#define CHECK_NEAR3(a, b, tolerance) test_check_near3((a), (b), (tolerance), #a, #b, __FILE__, __LINE__)
#define CHECK_TEXT(a, b)             test_check_text((a), (b), #a, __FILE__, __LINE__)
/* The call returns that status; else its failure's text is shown. */
#define CHECK_STATUS(ctx, call, expected) test_check_status((ctx), (call), (expected), #call, __FILE__, __LINE__)
#define CHECK_OK(call)                    CHECK_STATUS(test_context, call, LOXO_OK)
#define SKIP()                            _skip(__FILE__, __LINE__)
/* For tests that count to n elements: skipped in the build with 16-bit ids when they do not fit there. */
#define NEEDS_IDS(n) (test_ids_fit(n) ? (void)0 : SKIP())

/* A function, as a comparison of constants would be warned about. */
static inline bool test_ids_fit(int64_t n) { return n <= LOXO_INDEX_MAX; }

static inline void test_check(bool good, const char *text, const char *file, int line)
{
    if (good) return;
    print_error("not so: %s\n", text);
    _fail(file, line);
}

static inline void test_check_equal(long double a, long double b, const char *a_text, const char *b_text,
                                    const char *file, int line)
{
    if (a == b) return;
    print_error("%s is %.21Lg, not %s, which is %.21Lg\n", a_text, a, b_text, b);
    _fail(file, line);
}

static inline void test_check_near(double a, double b, double tolerance, const char *a_text, const char *b_text,
                                   const char *file, int line)
{
    if (a == b || fabs(a - b) <= tolerance) return;
    print_error("%s is %.17g, %s is %.17g: off by %.3g, not within %.3g\n", a_text, a, b_text, b, fabs(a - b),
                tolerance);
    _fail(file, line);
}

static inline void test_check_near3(const double *a, const double *b, double tolerance, const char *a_text,
                                    const char *b_text, const char *file, int line)
{
    for (int i = 0; i < 3; ++i)
        test_check_near(a[i], b[i], tolerance, a_text, b_text, file, line);
}

static inline void test_check_text(const char *a, const char *b, const char *text, const char *file, int line)
{
    if (strcmp(a, b) == 0) return;
    print_error("%s is\n\"%s\"\nnot\n\"%s\"\n", text, a, b);
    _fail(file, line);
}

static inline void test_check_status(loxo_context *ctx, loxo_status status, loxo_status expected, const char *text,
                                     const char *file, int line)
{
    if (status == expected) return;
    print_error("%s gave %s, not %s: %s\n", text, loxo_status_name(status), loxo_status_name(expected),
                ctx == NULL ? "no context" : loxo_context_failure(ctx)->text);
    _fail(file, line);
}

/* ---- contexts ---- */

/* A context with so many threads, for thread ladders; the caller destroys it. */
static inline loxo_context *test_context_with_threads(int n_threads)
{
    loxo_context_settings settings = loxo_context_settings_default();
    loxo_context *ctx = NULL;
    settings.n_threads = n_threads;
    CHECK_STATUS(NULL, loxo_context_create(&settings, &ctx), LOXO_OK);
    return ctx;
}

/* An allocator over malloc whose n-th call from now fails, and all after it: fail_at counts down to it. */
typedef struct test_allocator {
    int64_t fail_at; /* 1: the next call; 0: has failed, fails on; -1: never fails */
    int64_t n_calls;
    size_t live_bytes;
} test_allocator;

static inline void *test_allocator_allocate(void *user, size_t n_bytes)
{
    test_allocator *a = user;
    void *block;
    a->n_calls += 1;
    if (a->fail_at > 0) a->fail_at -= 1;
    if (a->fail_at == 0) return NULL;
    block = malloc(n_bytes == 0 ? 1 : n_bytes);
    if (block != NULL) a->live_bytes += n_bytes;
    return block;
}

static inline void test_allocator_release(void *user, void *block, size_t n_bytes)
{
    test_allocator *a = user;
    if (block == NULL) return;
    a->live_bytes -= n_bytes;
    free(block);
}

/* Runs call once to count its allocations, then once for each of them with that one failing: it must return
 * LOXO_ERR_MEMORY and leave nothing allocated. call undoes all it made before it returns; `create` and `destroy` of
 * what is not under test belong outside, in a context of their own. Returns the number of allocations. */
static inline int64_t test_each_allocation_fails(loxo_status (*call)(loxo_context *ctx, void *arg), void *arg)
{
    int64_t n_calls = 0;
    for (int64_t i = 0; i <= n_calls; ++i) { /* i == 0: none fails */
        test_allocator allocator = {.fail_at = -1};
        loxo_context_settings settings = loxo_context_settings_default();
        loxo_context *ctx = NULL;
        loxo_status status;
        size_t before_bytes;
        settings.allocator = (loxo_allocator){test_allocator_allocate, test_allocator_release, &allocator};
        settings.n_threads = 2;
        CHECK_STATUS(NULL, loxo_context_create(&settings, &ctx), LOXO_OK);
        before_bytes = allocator.live_bytes;
        allocator.n_calls = 0;
        allocator.fail_at = i == 0 ? -1 : i;
        status = call(ctx, arg);
        allocator.fail_at = -1;
        if (i == 0) {
            CHECK_STATUS(ctx, (status < 0 ? status : LOXO_OK), LOXO_OK);
            n_calls = allocator.n_calls;
        } else if (status != LOXO_ERR_MEMORY) {
            print_error("with allocation %lld of %lld failing:\n", (long long)i, (long long)n_calls);
            CHECK_STATUS(ctx, status, LOXO_ERR_MEMORY);
        }
        if (allocator.live_bytes != before_bytes) {
            print_error("with allocation %lld of %lld failing, %zu bytes leak\n", (long long)i, (long long)n_calls,
                        allocator.live_bytes - before_bytes);
            CHECK_EQUAL(allocator.live_bytes, before_bytes);
        }
        CHECK_EQUAL(loxo_context_memory(ctx).current_bytes, 0);
        loxo_context_destroy(ctx);
        CHECK_EQUAL(allocator.live_bytes, 0);
    }
    return n_calls;
}

/* ---- bits, files ---- */

/* FNV-1a, 64 bits: equal bits give equal hashes. */
static inline uint64_t test_hash(const void *bytes, size_t n)
{
    const unsigned char *b = bytes;
    uint64_t hash = 0xcbf29ce484222325u;
    for (size_t i = 0; i < n; ++i)
        hash = (hash ^ b[i]) * 0x100000001b3u;
    return hash;
}

/* The ladder of threads: what hash tells of a call on 1 thread it tells of the same call on 2, 3 and 7, and leaves nothing allocated. */
static inline void test_same_for_any_threads(uint64_t (*hash)(loxo_context *ctx, const void *arg), const void *arg)
{
    static const int ladder[] = {1, 2, 3, 7};
    uint64_t first = 0;
    for (int i = 0; i < 4; ++i) {
        loxo_context *ctx = test_context_with_threads(ladder[i]);
        const uint64_t now = hash(ctx, arg);
        if (i == 0) first = now;
        if (now != first) print_error("with %d threads:\n", ladder[i]);
        CHECK(now == first);
        CHECK_EQUAL(loxo_context_memory(ctx).current_bytes, 0);
        loxo_context_destroy(ctx);
    }
}

/* The ladder of instruction sets: what call makes of a copy of n bytes is the same with each that this processor has. out: the
 * copy that the first has worked on. */
static inline void test_same_for_any_isa(void (*call)(loxo_isa isa, void *data), const void *in, size_t n, void *out)
{
    const size_t room = (n + 63) / 64 * 64;
    void *copy = aligned_alloc(64, room);
    CHECK(copy != NULL);
    memcpy(out, in, n);
    call(LOXO_ISA_BASELINE, out);
    for (int isa = LOXO_ISA_BASELINE + 1; isa <= LOXO_ISA_AVX512; ++isa) {
        loxo_context_settings settings = loxo_context_settings_default();
        loxo_context *probe = NULL;
        settings.isa = (loxo_isa)isa;
        if (loxo_context_create(&settings, &probe) != LOXO_OK) continue; /* not of this processor */
        loxo_context_destroy(probe);
        memcpy(copy, in, n);
        call((loxo_isa)isa, copy);
        if (memcmp(copy, out, n) != 0) print_error("with instruction set %d:\n", isa);
        CHECK(memcmp(copy, out, n) == 0);
    }
    free(copy);
}

/* Path of a file that stands beside the project, in $LOXO_SHARED; NULL when it is not there. Valid for four calls. */
static inline const char *test_shared(const char *name)
{
    static char paths[4][4096];
    static int next;
    const char *root = getenv("LOXO_SHARED");
    char *path = paths[next++ % 4];
    if (root == NULL || snprintf(path, 4096, "%s/%s", root, name) >= 4096) return NULL;
    return access(path, R_OK) == 0 ? path : NULL;
}

static char test_scratch_folder[2048];

/* Path of a file in a folder of this process's own, which goes with all files in it at the end. Valid for four calls. */
static inline const char *test_scratch(const char *name)
{
    static char paths[4][4096];
    static int next;
    char *path = paths[next++ % 4];
    if (test_scratch_folder[0] == 0) {
        const char *root = getenv("TMPDIR");
        bool is_made = false; /* numbers of processes come again, and those that were killed left their folders */
        for (int k = 0; k < 1000 && !is_made; ++k) {
            const int n = snprintf(test_scratch_folder, sizeof test_scratch_folder, "%s/loxo-test-%ld-%d",
                                   root == NULL || root[0] == 0 ? "/tmp" : root, (long)getpid(), k);
            CHECK(n > 0 && (size_t)n < sizeof test_scratch_folder);
            is_made = mkdir(test_scratch_folder, 0700) == 0;
        }
        CHECK(is_made);
    }
    CHECK(snprintf(path, 4096, "%s/%s", test_scratch_folder, name) < 4096);
    return path;
}

static inline void test_scratch_remove(void)
{
    DIR *folder = test_scratch_folder[0] == 0 ? NULL : opendir(test_scratch_folder);
    if (folder == NULL) return;
    for (const struct dirent *entry = readdir(folder); entry != NULL; entry = readdir(folder)) {
        char path[4096];
        if (snprintf(path, sizeof path, "%s/%s", test_scratch_folder, entry->d_name) < (int)sizeof path) remove(path);
    }
    closedir(folder);
    rmdir(test_scratch_folder);
}

/* ---- the runner ---- */

static inline void test_run(void **state)
{
    test_bodies[(struct CMUnitTest *)*state - test_cases]();
    CHECK_EQUAL(loxo_context_memory(test_context).current_bytes, 0); /* the test leaks */
}

static inline int test_setup(void **state)
{
    (void)state;
    return loxo_context_create(NULL, &test_context) == LOXO_OK ? 0 : -1;
}

static inline int test_teardown(void **state)
{
    (void)state;
    loxo_context_destroy(test_context);
    test_context = NULL;
    return 0;
}

static inline void test_register(const char *name, test_body_fn body)
{
    if (test_n_cases == TEST_MAX_CASES) abort();
    test_bodies[test_n_cases] = body;
    test_cases[test_n_cases] =
        (struct CMUnitTest){name, test_run, test_setup, test_teardown, &test_cases[test_n_cases]};
    test_n_cases += 1;
}

int main(int argc, char **argv)
{
    int n_failed;
    if (argc > 1) cmocka_set_test_filter(argv[1]);
    n_failed = _cmocka_run_group_tests(argv[0], test_cases, (size_t)test_n_cases, NULL, NULL);
    test_scratch_remove();
    return n_failed == 0 ? 0 : 1;
}

#endif
