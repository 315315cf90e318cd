/* SPDX-License-Identifier: MIT
 * Output is atomic: the whole new file, or what was there before. */
#define _GNU_SOURCE /* symlink, O_TMPFILE */
#include "base/os.h"
#include "test.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/syscall.h>

/* Takes the place of the C library's: some file systems have no files without names. */
static bool all_have_names;

int openat(int folder, const char *path, int flags, ...)
{
    va_list args;
    va_start(args, flags);
    const unsigned mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(args, unsigned) : 0;
    va_end(args);
    if (all_have_names && (flags & O_TMPFILE) == O_TMPFILE) {
        errno = EOPNOTSUPP;
        return -1;
    }
    return (int)syscall(SYS_openat, folder, path, flags, mode);
}

static void write_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "wb");
    CHECK(file != NULL);
    fputs(text, file);
    CHECK(fclose(file) == 0);
}

static void check_holds(const char *path, const char *text)
{
    char found[256] = {0};
    FILE *file = fopen(path, "rb");
    CHECK(file != NULL);
    found[fread(found, 1, sizeof found - 1, file)] = '\0';
    fclose(file);
    CHECK_TEXT(found, text);
}

static int n_neighbours(void)
{
    int n = 0;
    DIR *folder = opendir(test_scratch_folder);
    CHECK(folder != NULL);
    for (const struct dirent *e = readdir(folder); e != NULL; e = readdir(folder))
        n += strcmp(e->d_name, ".") != 0 && strcmp(e->d_name, "..") != 0;
    closedir(folder);
    return n;
}

static void replace_and_abandon(bool has_name)
{
    const char *path = test_scratch("file");
    loxo_os_output out;
    all_have_names = has_name;
    write_text(path, "old");
    CHECK_OK(loxo_os_output_create(test_context, path, &out));
    CHECK_OK(loxo_os_output_write(test_context, &out, "newer", 5));
    check_holds(path, "old");
    CHECK(!has_name || n_neighbours() == 2);
    loxo_os_output_abandon(&out);
    loxo_os_output_abandon(&out);
    check_holds(path, "old");
    CHECK_EQUAL(n_neighbours(), 1);

    CHECK_OK(loxo_os_output_create(test_context, path, &out));
    CHECK_OK(loxo_os_output_write(test_context, &out, "newer", 5));
    CHECK_OK(loxo_os_output_write_at(test_context, &out, 1, "E", 1));
    CHECK_EQUAL(out.n_bytes, 5);
    CHECK_OK(loxo_os_output_commit(test_context, &out));
    loxo_os_output_abandon(&out);
    check_holds(path, "nEwer");
    CHECK_EQUAL(n_neighbours(), 1);
    remove(path);
}

TEST(commit_replaces_and_abandon_leaves_the_old_file)
{
    replace_and_abandon(false);
    replace_and_abandon(true);
    all_have_names = false;
}

static loxo_status write_one(const char *path, const char *text)
{
    loxo_os_output out;
    loxo_status status = loxo_os_output_create(test_context, path, &out);
    if (status >= 0) status = loxo_os_output_write(test_context, &out, text, strlen(text));
    if (status >= 0) status = loxo_os_output_commit(test_context, &out);
    loxo_os_output_abandon(&out);
    return status;
}

static void remove_folder(const char *path)
{
    DIR *folder = opendir(path);
    CHECK(folder != NULL);
    for (const struct dirent *e = readdir(folder); e != NULL; e = readdir(folder))
        if (strcmp(e->d_name, ".") != 0 && strcmp(e->d_name, "..") != 0)
            CHECK(unlinkat(dirfd(folder), e->d_name, 0) == 0);
    closedir(folder);
    CHECK(rmdir(path) == 0);
}

static void gather(bool has_name)
{
    const char *a = test_scratch("a"), *b = test_scratch("b"), *folder = test_scratch("folder"),
               *lost = test_scratch("folder/lost");
    all_have_names = has_name;
    write_text(a, "old");
    loxo_os_gather_begin(test_context);
    CHECK_OK(write_one(a, "new a"));
    CHECK_OK(write_one(b, "new b"));
    check_holds(a, "old"); /* complete, but unseen */
    CHECK(access(b, F_OK) != 0);
    CHECK_EQUAL(loxo_os_gathered_bytes(test_context, a), 5);
    CHECK_EQUAL(loxo_os_gathered_bytes(test_context, "else"), -1);
    loxo_os_gather_abandon(test_context);
    check_holds(a, "old");
    CHECK_EQUAL(n_neighbours(), 1);

    loxo_os_gather_begin(test_context);
    CHECK_OK(write_one(a, "new a"));
    CHECK_OK(write_one(b, "new b"));
    CHECK_OK(loxo_os_gather_commit(test_context));
    check_holds(a, "new a");
    check_holds(b, "new b");
    CHECK_EQUAL(n_neighbours(), 2);
    CHECK_OK(write_one(a, "alone")); /* at once again */
    check_holds(a, "alone");

    /* The directory of the second goes away: the first has its name by then, the third gets none. */
    loxo_os_gather_begin(test_context);
    CHECK(mkdir(folder, 0700) == 0);
    CHECK_OK(write_one(a, "first"));
    CHECK_OK(write_one(lost, "second"));
    CHECK_OK(write_one(b, "third"));
    remove_folder(folder);
    CHECK_STATUS(test_context, loxo_os_gather_commit(test_context), LOXO_ERR_WRITE);
    check_holds(a, "first");
    check_holds(b, "new b");
    CHECK_EQUAL(n_neighbours(), 2);
    CHECK_EQUAL(loxo_context_memory(test_context).current_bytes, 0);
    remove(a);
    remove(b);
}

TEST(files_appear_together)
{
    gather(false);
    gather(true);
    all_have_names = false;
}

TEST(a_context_drops_what_it_keeps)
{
    loxo_context *ctx = test_context_with_threads(1);
    loxo_os_output out;
    loxo_os_gather_begin(ctx);
    CHECK_STATUS(ctx, loxo_os_output_create(ctx, test_scratch("x"), &out), LOXO_OK);
    CHECK_STATUS(ctx, loxo_os_output_commit(ctx, &out), LOXO_OK);
    loxo_context_destroy(ctx);
    CHECK_EQUAL(n_neighbours(), 0);
}

TEST(a_link_is_followed_and_stays)
{
    const char *path = test_scratch("linked"), *link = test_scratch("link");
    char target[16];
    loxo_os_output out;
    write_text(path, "old");
    CHECK(symlink("linked", link) == 0);
    CHECK_OK(loxo_os_output_create(test_context, link, &out));
    CHECK_OK(loxo_os_output_write(test_context, &out, "new", 3));
    CHECK_OK(loxo_os_output_commit(test_context, &out));
    check_holds(path, "new");
    CHECK_EQUAL(readlink(link, target, sizeof target), 6);
    remove(link);
    remove(path);
}

TEST(what_cannot_be_written_is_said_before_the_work)
{
    const char *bad[] = {"/no/such/folder/x.ply", "", "/dev/null", "/dev/full", test_scratch("not-there/x.ply"),
                         test_scratch_folder};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
        loxo_os_output out;
        CHECK_STATUS(test_context, loxo_os_output_check(test_context, bad[i]), LOXO_ERR_WRITE);
        CHECK_STATUS(test_context, loxo_os_output_create(test_context, bad[i], &out), LOXO_ERR_WRITE);
        loxo_os_output_abandon(&out);
    }
    CHECK_OK(loxo_os_output_check(test_context, test_scratch("fine.ply")));
    CHECK_OK(loxo_os_output_check(test_context, "-"));
}

TEST(reading_meets_files_folders_and_nothing)
{
    const char *path = test_scratch("read");
    char bytes[16];
    size_t got;
    loxo_os_file file;
    write_text(path, "0123456789");
    CHECK_OK(loxo_os_open(test_context, path, &file));
    CHECK(file.is_regular);
    CHECK_EQUAL(file.n_bytes, 10);
    CHECK_OK(loxo_os_read_at(test_context, &file, 4, bytes, 3, &got));
    CHECK(got == 3 && memcmp(bytes, "456", 3) == 0);
    CHECK_OK(loxo_os_read(test_context, &file, bytes, sizeof bytes, &got));
    CHECK_EQUAL(got, 10);
    CHECK_OK(loxo_os_read_at(test_context, &file, 100, bytes, 3, &got));
    CHECK_EQUAL(got, 0);
    loxo_os_close(&file);
    loxo_os_close(&file);
    CHECK_STATUS(test_context, loxo_os_open(test_context, test_scratch_folder, &file), LOXO_ERR_READ);
    CHECK_STATUS(test_context, loxo_os_open(test_context, test_scratch("absent"), &file), LOXO_ERR_READ);
    CHECK(strstr(loxo_context_failure(test_context)->file, "absent") != NULL);
    remove(path);
}

TEST(the_machine_has_a_clock_and_processors)
{
    const double start = loxo_os_clock_s();
    CHECK(loxo_os_clock_s() >= start);
    CHECK(loxo_os_n_processors() >= 1);
    CHECK(loxo_os_peak_rss() > 100000);
    CHECK(loxo_os_memory_limit() <= loxo_os_memory());
}
