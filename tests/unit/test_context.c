/* SPDX-License-Identifier: MIT
 * Context: failures, warnings, metered memory, the arena, threads. */
#include "base/allocate.h"
#include "base/arena.h"
#include "base/context.h"
#include "test.h"

TEST(every_status_has_name_text_and_exit_code)
{
    CHECK_TEXT(loxo_status_name(LOXO_ERR_MESH), "LOXO_ERR_MESH");
    CHECK_TEXT(loxo_status_name((loxo_status)77), "unknown");
    CHECK(loxo_status_text((loxo_status)77) != NULL);
    CHECK_EQUAL(loxo_status_exit_code(LOXO_OK), 0);
    CHECK_EQUAL(loxo_status_exit_code(LOXO_ERR_ARGUMENT), 2);
    CHECK_EQUAL(loxo_status_exit_code(LOXO_ERR_MALFORMED), 4);
    CHECK_EQUAL(loxo_status_exit_code(LOXO_ERR_WRITE), 9);
}

TEST(context_refuses_settings_out_of_range)
{
    loxo_context_settings settings = loxo_context_settings_default();
    loxo_context *ctx = NULL;
    CHECK_EQUAL(loxo_context_create(NULL, NULL), LOXO_ERR_ARGUMENT);
    settings.n_threads = -1;
    CHECK_EQUAL(loxo_context_create(&settings, &ctx), LOXO_ERR_ARGUMENT);
    CHECK(ctx == NULL);
    settings.n_threads = 5000;
    CHECK_EQUAL(loxo_context_create(&settings, &ctx), LOXO_ERR_ARGUMENT);
    settings.n_threads = 3;
    settings.isa = (loxo_isa)9;
    CHECK_EQUAL(loxo_context_create(&settings, &ctx), LOXO_ERR_ARGUMENT);
    settings.isa = LOXO_ISA_BASELINE;
    CHECK_EQUAL(loxo_context_create(&settings, &ctx), LOXO_OK);
    CHECK_EQUAL(loxo_context_n_threads(ctx), 3);
    CHECK_EQUAL(loxo_context_isa(ctx), LOXO_ISA_BASELINE);
    loxo_context_destroy(ctx);
    loxo_context_destroy(NULL);
}

TEST(failure_keeps_place_and_escapes_control_bytes)
{
    const loxo_place place = {.file = "a\nb.off", .line = 7, .byte = -1, .element = 3};
    CHECK_EQUAL(loxo_fail_at(test_context, LOXO_ERR_MALFORMED, place, "face %d: \x1b[31m", 3), LOXO_ERR_MALFORMED);
    const loxo_failure *f = loxo_context_failure(test_context);
    CHECK_EQUAL(f->status, LOXO_ERR_MALFORMED);
    CHECK_TEXT(f->file, "a\\x0ab.off");
    CHECK_TEXT(f->text, "face 3: \\x1b[31m");
    CHECK_EQUAL(f->line, 7);
    CHECK_EQUAL(f->byte, -1);
    CHECK_EQUAL(f->element, 3);
    loxo_failure_set_file(test_context, "other");
    CHECK_TEXT(f->file, "a\\x0ab.off");
    loxo_context_clear(test_context);
    CHECK_EQUAL(loxo_context_failure(test_context)->status, LOXO_OK);
    CHECK_EQUAL(loxo_fail(NULL, LOXO_ERR_READ, "no context"), LOXO_ERR_READ);
}

TEST(long_names_and_texts_are_cut)
{
    char name[600], text[2000];
    memset(name, 'n', sizeof name - 1);
    memcpy(name + 595, ".off", 5);
    memset(text, 't', sizeof text - 1);
    text[sizeof text - 1] = '\0';
    const loxo_place place = {.file = name, .byte = -1, .element = -1};
    loxo_fail_at(test_context, LOXO_ERR_READ, place, "%s", text);
    const loxo_failure *f = loxo_context_failure(test_context);
    CHECK_EQUAL(strlen(f->file), sizeof f->file - 1);
    CHECK(strncmp(f->file, "...n", 4) == 0);
    CHECK_TEXT(f->file + strlen(f->file) - 4, ".off");
    CHECK(strlen(f->text) < sizeof f->text && strlen(f->text) > 400);
}

TEST(warnings_count_once_a_kind)
{
    loxo_warn(test_context, "degenerate", 1, "%d faces dropped", 1);
    loxo_warn(test_context, "turned", 2, "%d faces turned", 2);
    loxo_warn(test_context, "degenerate", 3, "%d faces dropped", 3);
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 2);
    CHECK_EQUAL(loxo_context_warning(test_context, 0)->count, 3);
    CHECK_TEXT(loxo_context_warning(test_context, 0)->text, "3 faces dropped");
    CHECK(loxo_context_warning(test_context, 2) == NULL);
    CHECK(loxo_context_warning(test_context, -1) == NULL);
    for (int i = 0; i < 2 * LOXO_MAX_WARNINGS; ++i) {
        char kind[16];
        snprintf(kind, sizeof kind, "kind %d", i);
        loxo_warn(test_context, kind, 1, "one");
    }
    CHECK_EQUAL(loxo_context_n_warnings(test_context), LOXO_MAX_WARNINGS);
}

TEST(memory_is_aligned_metered_and_limited)
{
    loxo_context_settings settings = loxo_context_settings_default();
    loxo_context *ctx = NULL;
    settings.memory_limit_bytes = 100000;
    CHECK_OK(loxo_context_create(&settings, &ctx));
    double *a = loxo_allocate(ctx, 1000, sizeof *a), *b = loxo_allocate_zero(ctx, 500, sizeof *b);
    CHECK(a != NULL && b != NULL);
    CHECK_EQUAL((uintptr_t)a % 64, 0);
    CHECK_EQUAL((uintptr_t)b % 64, 0);
    CHECK_EQUAL(b[499], 0.0);
    CHECK(loxo_context_memory(ctx).current_bytes >= 12000);
    CHECK(loxo_allocate(ctx, 100000, 1) == NULL);
    CHECK_EQUAL(loxo_context_failure(ctx)->status, LOXO_ERR_MEMORY);
    CHECK(loxo_allocate(ctx, INT64_MAX, 1000) == NULL);
    CHECK(loxo_allocate(ctx, -1, 8) == NULL);
    CHECK_EQUAL(loxo_memory_check(ctx, 80000, "a plan"), LOXO_OK);
    CHECK_EQUAL(loxo_memory_check(ctx, 90000, "a plan"), LOXO_ERR_MEMORY);
    CHECK_EQUAL(loxo_memory_check(ctx, SIZE_MAX, "a plan"), LOXO_ERR_MEMORY);
    loxo_release(ctx, a);
    loxo_release(ctx, NULL);
    CHECK(loxo_context_memory(ctx).peak_bytes >= 12000);
    loxo_context_reset_peak(ctx);
    CHECK(loxo_context_memory(ctx).peak_bytes < 8000);
    loxo_release(ctx, b);
    void *nothing = loxo_allocate(ctx, 0, 8);
    CHECK(nothing != NULL);
    loxo_release(ctx, nothing);
    CHECK_EQUAL(loxo_context_memory(ctx).current_bytes, 0);
    loxo_context_destroy(ctx);
}

static loxo_status grow_and_shrink(loxo_context *ctx, void *arg)
{
    loxo_status status = LOXO_ERR_MEMORY;
    uint32_t *block = NULL;
    (void)arg;
    for (int64_t n = 3; n < 1000000; n *= 7) {
        uint32_t *more = loxo_reallocate(ctx, block, n, sizeof *block);
        if (more == NULL) goto done;
        block = more;
        CHECK_EQUAL((uintptr_t)block % 64, 0);
        for (int64_t i = 0; i < n / 7; ++i)
            CHECK(block[i] == (uint32_t)i * 3u);
        for (int64_t i = 0; i < n; ++i)
            block[i] = (uint32_t)i * 3u;
    }
    uint32_t *less = loxo_reallocate(ctx, block, 10, sizeof *block);
    if (less == NULL) goto done;
    block = less;
    for (uint32_t i = 0; i < 10; ++i)
        CHECK(block[i] == i * 3u);
    status = LOXO_OK;
done:
    loxo_release(ctx, block);
    return status;
}

TEST(reallocate_keeps_the_common_part)
{
    CHECK_OK(grow_and_shrink(test_context, NULL));
    CHECK(test_each_allocation_fails(grow_and_shrink, NULL) >= 7);
}

/* Bytes of this process that are in memory now; 0 where nobody tells. */
static size_t resident_bytes(void)
{
    FILE *file = fopen("/proc/self/statm", "r");
    unsigned long size = 0, resident = 0;
    if (file == NULL) return 0;
    const int n = fscanf(file, "%lu %lu", &size, &resident);
    fclose(file);
    return n == 2 ? resident * (size_t)sysconf(_SC_PAGESIZE) : 0;
}

TEST(large_blocks_keep_their_content_on_every_way_between_sizes)
{
    static const int64_t sizes[] = {1000, 3 << 20, 5 << 20, 40 << 20, 6 << 20, 2 << 20, 9 << 20, 10};
    uint64_t *block = NULL;
    int64_t common = 0;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; ++i) {
        const int64_t n = sizes[i] / (int64_t)sizeof *block;
        block = loxo_reallocate(test_context, block, n, sizeof *block);
        CHECK(block != NULL);
        CHECK_EQUAL((uintptr_t)block % 64, 0);
        CHECK_EQUAL(loxo_context_memory(test_context).current_bytes, (size_t)n * sizeof *block + 128);
        for (int64_t k = 0; k < (common < n ? common : n); ++k)
            CHECK(block[k] == (uint64_t)k * 5);
        for (int64_t k = 0; k < n; ++k)
            block[k] = (uint64_t)k * 5;
        common = n;
    }
    loxo_release(test_context, block);
    uint64_t *zero = loxo_allocate_zero(test_context, 1 << 20, sizeof *zero);
    CHECK(zero != NULL);
    for (int64_t k = 0; k < 1 << 20; ++k)
        CHECK(zero[k] == 0);
    loxo_release(test_context, zero);
}

#if defined(__SANITIZE_ADDRESS__) /* keeps what was released, to see who still uses it */
#define RELEASED_GOES_BACK false
#elif defined(__has_feature)
#define RELEASED_GOES_BACK (!__has_feature(address_sanitizer) && !__has_feature(thread_sanitizer))
#else
#define RELEASED_GOES_BACK true
#endif

TEST(released_large_blocks_are_no_longer_resident)
{
    const int64_t n = 8 << 20;
    unsigned char *block[6];
    /* glibc's malloc takes blocks of this size off its heap once one of them was freed. */
    for (int i = 0; i < 6; ++i) {
        block[i] = loxo_allocate(test_context, n, 1);
        CHECK(block[i] != NULL);
        memset(block[i], 1, (size_t)n);
        if (i == 0) loxo_release(test_context, block[0]);
    }
    const size_t before = resident_bytes();
    for (int i = 1; i < 5; ++i) /* the last one stays, on top */
        loxo_release(test_context, block[i]);
    const size_t after = resident_bytes();
    loxo_release(test_context, block[5]);
    CHECK(!RELEASED_GOES_BACK || before == 0 || after + 3 * (size_t)n < before);
}

TEST(arena_plans_then_hands_out_the_same_places)
{
    loxo_arena arena = {0};
    CHECK(loxo_arena_take(&arena, 100, 8) == NULL);
    const size_t mark = loxo_arena_mark(&arena);
    loxo_arena_take(&arena, 1000, 1);
    loxo_arena_release(&arena, mark);
    loxo_arena_take(&arena, 10, 1);
    CHECK(!arena.overflow);
    CHECK_OK(loxo_arena_reserve(test_context, &arena, "a test"));
    unsigned char *a = loxo_arena_take(&arena, 100, 8);
    unsigned char *b = loxo_arena_take(&arena, 1000, 1);
    CHECK(a != NULL && b != NULL);
    CHECK_EQUAL((uintptr_t)a % 64, 0);
    CHECK_EQUAL((uintptr_t)b % 64, 0);
    CHECK(b >= a + 800);
    memset(a, 1, 800);
    memset(b, 2, 1000);
    loxo_arena_release(&arena, mark);
    CHECK(loxo_arena_take(&arena, 10, 1) == b);
    CHECK(loxo_arena_take(&arena, 10000, 1) == NULL);
    CHECK(arena.overflow);
    loxo_arena_destroy(test_context, &arena);
}

TEST(arena_of_a_size_beyond_any_memory_is_refused)
{
    loxo_arena arena = {0};
    loxo_arena_take(&arena, INT64_MAX, 16);
    CHECK_STATUS(test_context, loxo_arena_reserve(test_context, &arena, "a test"), LOXO_ERR_MEMORY);
    arena = (loxo_arena){0};
    loxo_arena_take(&arena, INT64_MAX / 4, 1);
    CHECK_STATUS(test_context, loxo_arena_reserve(test_context, &arena, "a test"), LOXO_ERR_MEMORY);
}

TEST(small_work_takes_one_thread)
{
    loxo_context *ctx = test_context_with_threads(7);
    CHECK_EQUAL(loxo_threads(ctx, 10.0), 1);
    CHECK_EQUAL(loxo_threads(ctx, 1e12), 7);
    loxo_context_destroy(ctx);
}

static int stop_at_once(void *user, const loxo_progress *progress)
{
    *(int *)user += progress->elapsed_s >= 0.0;
    return 1;
}

TEST(monitor_stops)
{
    int n_calls = 0;
    CHECK(!loxo_stop_wanted(test_context, "phase", 0.5));
    loxo_context_set_monitor(test_context, stop_at_once, &n_calls);
    loxo_progress_begin(test_context);
    CHECK(!loxo_stop_wanted(test_context, "phase", 0.5)); /* too soon to tell */
    CHECK(loxo_progress_tell(test_context, &(loxo_progress){.phase = "phase"}, true));
    CHECK_EQUAL(n_calls, 1);
}

static int note_elapsed(void *user, const loxo_progress *progress)
{
    *(double *)user = progress->elapsed_s;
    return 0;
}

TEST(calls_inside_a_call_do_not_start_the_clock_again)
{
    const loxo_progress p = {.phase = "phase"};
    double elapsed_s = -1.0;
    loxo_context_set_monitor(test_context, note_elapsed, &elapsed_s);
    loxo_progress_enter(test_context);
    test_context->call_start_s -= 1000.0; /* as if it had begun long ago */
    loxo_progress_begin(test_context);
    loxo_progress_tell(test_context, &p, true);
    CHECK(elapsed_s >= 1000.0);
    loxo_progress_enter(test_context);
    loxo_progress_leave(test_context);
    loxo_progress_begin(test_context);
    loxo_progress_tell(test_context, &p, true);
    CHECK(elapsed_s >= 1000.0);
    loxo_progress_leave(test_context);
    loxo_progress_begin(test_context);
    loxo_progress_tell(test_context, &p, true);
    CHECK(elapsed_s < 1000.0);
}
