/* SPDX-License-Identifier: MIT
 * Output is atomic: the whole new file, or what was there before. */
#define _DEFAULT_SOURCE /* symlink */
#include "base/os.h"
#include "test.h"

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

TEST(commit_replaces_and_abandon_leaves_the_old_file)
{
    const char *path = test_scratch("file");
    loxo_os_output out;
    write_text(path, "old");
    CHECK_OK(loxo_os_output_create(test_context, path, &out));
    CHECK_OK(loxo_os_output_write(test_context, &out, "newer", 5));
    check_holds(path, "old");
    CHECK_EQUAL(n_neighbours(), 2);
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
