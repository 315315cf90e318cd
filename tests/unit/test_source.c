/* SPDX-License-Identifier: MIT */
#include "io/source.h"
#include "reading.h"

#include <fcntl.h>
#include <pthread.h>
#include <sys/stat.h>

static const char triangle_obj[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
static const char triangle_text[] = "0 0 0, 1 0 0, 0 1 0 | 0 1 2";

static void check_triangle(const char *path)
{
    char text[256];
    loxo_soup soup;
    CHECK_OK(loxo_read_mesh(test_context, path, NULL, &soup));
    soup_text(&soup, text, sizeof text);
    CHECK_TEXT(text, triangle_text);
    loxo_soup_destroy(test_context, &soup);
}

static void *write_fifo(void *path)
{
    const int fd = open(path, O_WRONLY);
    for (size_t i = 0; fd >= 0 && i < sizeof triangle_obj - 1; ++i) {
        if (write(fd, &triangle_obj[i], 1) != 1) break; /* short reads on the other side */
    }
    if (fd >= 0) close(fd);
    return NULL;
}

TEST(a_fifo_is_read_as_a_stream)
{
    pthread_t writer;
    char path[4096];
    snprintf(path, sizeof path, "%s", test_scratch("fifo.obj"));
    CHECK(mkfifo(path, 0600) == 0);
    CHECK(pthread_create(&writer, NULL, write_fifo, path) == 0);
    check_triangle(path);
    pthread_join(writer, NULL);
}

TEST(a_dash_is_standard_input_be_it_a_file_or_a_pipe)
{
    const int kept = dup(STDIN_FILENO);
    int ends[2];
    const char *path = test_scratch("in.obj");
    write_scratch(path, triangle_obj, sizeof triangle_obj - 1);
    const int fd = open(path, O_RDONLY);
    CHECK(fd >= 0 && dup2(fd, STDIN_FILENO) == STDIN_FILENO);
    check_triangle("-");
    close(fd);
    CHECK(pipe(ends) == 0);
    CHECK(write(ends[1], triangle_obj, sizeof triangle_obj - 1) == (ssize_t)sizeof triangle_obj - 1);
    close(ends[1]);
    CHECK(dup2(ends[0], STDIN_FILENO) == STDIN_FILENO);
    close(ends[0]);
    check_triangle("-");
    dup2(kept, STDIN_FILENO);
    close(kept);
}

TEST(what_cannot_be_read_says_why)
{
    char name[5000];
    loxo_soup soup;
    CHECK_STATUS(test_context, loxo_read_mesh(test_context, "/nowhere/a.ply", NULL, &soup), LOXO_ERR_READ);
    CHECK(strstr(loxo_context_failure(test_context)->text, "No such file") != NULL);
    CHECK_TEXT(loxo_context_failure(test_context)->file, "/nowhere/a.ply");
    CHECK_STATUS(test_context, loxo_read_mesh(test_context, "/tmp", NULL, &soup), LOXO_ERR_READ);
    CHECK(strstr(loxo_context_failure(test_context)->text, "directory") != NULL);
    memset(name, 'a', sizeof name - 1);
    name[sizeof name - 1] = 0;
    CHECK_STATUS(test_context, loxo_read_mesh(test_context, name, NULL, &soup), LOXO_ERR_READ);
    CHECK_STATUS(test_context, loxo_read_mesh(test_context, "a\nb", NULL, &soup), LOXO_ERR_READ);
    CHECK_TEXT(loxo_context_failure(test_context)->file, "a\\x0ab");
    /* An endless device is given up at its first bytes. */
    CHECK_STATUS(test_context, loxo_read_mesh(test_context, "/dev/zero", NULL, &soup), LOXO_ERR_UNSUPPORTED);
    CHECK_STATUS(test_context, loxo_read_mesh(test_context, "/dev/null", NULL, &soup), LOXO_ERR_MALFORMED);
    CHECK_STATUS(test_context, loxo_read_mesh(test_context, NULL, NULL, &soup), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_read_mesh(test_context, "a", NULL, NULL), LOXO_ERR_ARGUMENT);
    CHECK(loxo_context_memory(test_context).peak_bytes < 1000000);
}

TEST(a_stream_beyond_its_limit_is_refused)
{
    const int kept = dup(STDIN_FILENO);
    loxo_read_settings settings = loxo_read_settings_default();
    loxo_soup soup;
    const int fd = open("/dev/zero", O_RDONLY);
    CHECK(fd >= 0 && dup2(fd, STDIN_FILENO) == STDIN_FILENO);
    close(fd);
    settings.format = LOXO_FORMAT_OBJ; /* asked for, so it is not told from its head */
    settings.max_bytes = 3000000;
    CHECK_STATUS(test_context, loxo_read_mesh(test_context, "-", &settings, &soup), LOXO_ERR_LIMIT);
    dup2(kept, STDIN_FILENO);
    close(kept);
}

TEST(a_large_file_is_the_same_by_any_number_of_threads)
{
    const size_t n = 3000017;
    char *bytes = allocate_or_abort(n);
    const char *path = test_scratch("large.bin");
    for (size_t i = 0; i < n; ++i)
        bytes[i] = (char)(i * i % 251);
    write_scratch(path, bytes, n);
    for (size_t t = 0; t < 4; ++t) {
        loxo_context *ctx = test_context_with_threads(thread_ladder[t]);
        loxo_source source;
        uint8_t *read = NULL;
        size_t n_read = 0;
        CHECK_STATUS(ctx, loxo_source_open(ctx, path, &source), LOXO_OK);
        CHECK_STATUS(ctx, loxo_source_read(ctx, &source, 0, &read, &n_read), LOXO_OK);
        CHECK(n_read == n && memcmp(read, bytes, n) == 0);
        loxo_release(ctx, read);
        loxo_source_close(ctx, &source);
        loxo_context_destroy(ctx);
    }
    free(bytes);
}

TEST(a_file_that_shrinks_or_grows_meanwhile_is_an_error)
{
    const size_t n = 200000;
    char *bytes = allocate_or_abort(n);
    const char *path = test_scratch("changes.bin");
    loxo_source source;
    uint8_t *read = NULL;
    size_t n_read = 0;
    memset(bytes, 0, n);
    for (int grows = 0; grows < 2; ++grows) {
        write_scratch(path, bytes, n);
        CHECK_OK(loxo_source_open(test_context, path, &source));
        const int fd = open(path, O_WRONLY);
        CHECK(fd >= 0 && ftruncate(fd, grows != 0 ? (off_t)n + 1 : (off_t)n - 1) == 0);
        close(fd);
        CHECK_STATUS(test_context, loxo_source_read(test_context, &source, 0, &read, &n_read), LOXO_ERR_READ);
        CHECK(strstr(loxo_context_failure(test_context)->text, grows != 0 ? "longer" : "shorter") != NULL);
        loxo_source_close(test_context, &source);
    }
    free(bytes);
}

#ifdef LOXO_WITH_ZLIB

TEST(gzip_of_one_or_more_members_and_what_stands_behind_it)
{
    text_buffer b = {0};
    const char *path = test_scratch("a.obj.gz");
    gzip_add(&b, triangle_obj, 10);
    gzip_add(&b, triangle_obj + 10, sizeof triangle_obj - 1 - 10);
    write_scratch(path, b.text, b.n);
    check_triangle(path);
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 0);
    bytes_add(&b, "\0\0\0\0", 4); /* tapes pad with zeros */
    write_scratch(path, b.text, b.n);
    check_triangle(path);
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 0);
    bytes_add(&b, "junk", 4);
    write_scratch(path, b.text, b.n);
    check_triangle(path);
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 1);
    CHECK_EQUAL(loxo_context_warning(test_context, 0)->count, 8);
    text_free(&b);
}

TEST(gzip_that_is_cut_anywhere_or_has_a_flipped_bit_is_an_error)
{
    text_buffer b = {0};
    loxo_soup soup;
    gzip_add(&b, triangle_obj, sizeof triangle_obj - 1);
    for (size_t n = 2; n < b.n; ++n) {
        CHECK_STATUS(test_context, loxo_read_mesh_memory(test_context, b.text, n, "a.obj.gz", NULL, &soup),
                     LOXO_ERR_MALFORMED);
        CHECK(loxo_context_failure(test_context)->byte >= 0);
    }
    b.text[b.n - 6] = (char)(b.text[b.n - 6] ^ 1); /* of the checksum */
    CHECK_STATUS(test_context, loxo_read_mesh_memory(test_context, b.text, b.n, "a.obj.gz", NULL, &soup),
                 LOXO_ERR_MALFORMED);
    CHECK(strstr(loxo_context_failure(test_context)->text, "data check") != NULL);
    text_free(&b);
}

TEST(a_bomb_stops_at_the_limit)
{
    const size_t n = 50000000;
    char *zeros = allocate_or_abort(n);
    text_buffer b = {0}, nested = {0};
    loxo_soup soup;
    loxo_read_settings settings = loxo_read_settings_default();
    loxo_context_settings context_settings = loxo_context_settings_default();
    loxo_context *small = NULL;
    memset(zeros, 0, n);
    gzip_add(&b, zeros, n);
    free(zeros);
    settings.max_bytes = 1000000;
    CHECK_STATUS(test_context, loxo_read_mesh_memory(test_context, b.text, b.n, "a.obj.gz", &settings, &soup),
                 LOXO_ERR_LIMIT);
    CHECK(loxo_context_memory(test_context).peak_bytes < 2000000);
    context_settings.memory_limit_bytes = 4000000;
    CHECK_STATUS(NULL, loxo_context_create(&context_settings, &small), LOXO_OK);
    CHECK_STATUS(small, loxo_read_mesh_memory(small, b.text, b.n, "a.obj.gz", NULL, &soup), LOXO_ERR_MEMORY);
    loxo_context_destroy(small);
    gzip_add(&nested, b.text, b.n);
    CHECK_STATUS(test_context, loxo_read_mesh_memory(test_context, nested.text, nested.n, "a.gz", NULL, &soup),
                 LOXO_ERR_UNSUPPORTED);
    text_free(&b);
    text_free(&nested);
}

TEST(exactly_the_limit_is_fine)
{
    text_buffer b = {0};
    loxo_soup soup;
    loxo_read_settings settings = loxo_read_settings_default();
    gzip_add(&b, triangle_obj, sizeof triangle_obj - 1);
    settings.max_bytes = sizeof triangle_obj - 1;
    CHECK_OK(loxo_read_mesh_memory(test_context, b.text, b.n, "a.obj.gz", &settings, &soup));
    loxo_soup_destroy(test_context, &soup);
    settings.max_bytes -= 1;
    CHECK_STATUS(test_context, loxo_read_mesh_memory(test_context, b.text, b.n, "a.obj.gz", &settings, &soup),
                 LOXO_ERR_LIMIT);
    text_free(&b);
}

TEST(every_allocation_of_unpacking_may_fail)
{
    text_buffer b = {0};
    gzip_add(&b, triangle_obj, sizeof triangle_obj - 1);
    const char *path = test_scratch("b.obj.gz");
    write_scratch(path, b.text, b.n);
    CHECK(test_each_allocation_fails(read_memory_file, &(memory_file){b.text, b.n, "a.obj.gz"}) >= 5);
    CHECK(test_each_allocation_fails(read_disk_file, &(memory_file){.name = path}) > 5);
    text_free(&b);
}

#else

TEST(without_zlib_gzip_is_unsupported)
{
    loxo_soup soup;
    CHECK_STATUS(test_context, loxo_read_mesh_memory(test_context, "\x1f\x8b\x08", 3, "a.gz", NULL, &soup),
                 LOXO_ERR_UNSUPPORTED);
}

#endif

TEST(contents_that_are_something_else_are_named)
{
    static const bad_file files[] = {
        {"empty", BYTES(""), LOXO_ERR_MALFORMED, 0, -1, -1, "empty file"},
        {"web page", BYTES("\n<!DOCTYPE html><html><body>404</body></html>"), LOXO_ERR_MALFORMED, 0, -1, -1,
         "HTML page"},
        {"web page, bare", BYTES("<HTML>"), LOXO_ERR_MALFORMED, 0, -1, -1, "HTML page"},
        {"web page behind XML", BYTES("<?xml version=\"1.0\"?>\n<!-- a > b --> <html>"), LOXO_ERR_MALFORMED, 0, -1, -1,
         "HTML page"},
        {"pointer", BYTES("version https://git-lfs.github.com/spec/v1\noid sha256:0\n"), LOXO_ERR_MALFORMED, 0, -1, -1,
         "Git LFS pointer"},
        {"PLY", BYTES("ply\nformat ascii 1.0\n"), LOXO_ERR_MALFORMED, 0, -1, -1, "the content looks like ply"},
        {"OFF", BYTES("OFF\n0 0 0\n"), LOXO_ERR_MALFORMED, 0, -1, -1, "the content looks like off"},
        {"UTF-16, little", BYTES("\xff\xfev\0 \0"), LOXO_ERR_MALFORMED, 0, -1, -1, "UTF-16"},
        {"UTF-16, big", BYTES("\xfe\xff\0v\0 "), LOXO_ERR_MALFORMED, 0, -1, -1, "UTF-16"},
        {"zip", BYTES("PK\3\4abcdefgh"), LOXO_ERR_UNSUPPORTED, 0, -1, -1, "zip"},
        {"VTK", BYTES("# vtk DataFile Version 3.0\n"), LOXO_ERR_UNSUPPORTED, 0, -1, -1, "VTK"},
        {"XML", BYTES("<?xml version=\"1.0\"?><other/>"), LOXO_ERR_UNSUPPORTED, 0, -1, -1, "XML"},
        {"nothing", BYTES("hello\n"), LOXO_ERR_MALFORMED, 0, -1, -1, "no OBJ file"},
    };
    check_bad_files(files, sizeof files / sizeof files[0], "a.obj");
}

TEST(a_format_may_be_asked_for)
{
    loxo_soup soup;
    loxo_read_settings settings = loxo_read_settings_default();
    settings.format = LOXO_FORMAT_OBJ; /* the name says nothing, the content agrees */
    CHECK_OK(loxo_read_mesh_memory(test_context, BYTES("v 0 0 0\n"), "a", &settings, &soup));
    loxo_soup_destroy(test_context, &soup);
    CHECK_OK(loxo_read_mesh_memory(test_context, BYTES("v 0 0 0\n"), "a.ply", &settings, &soup));
    loxo_soup_destroy(test_context, &soup);
    settings.format = LOXO_FORMAT_PLY;
    CHECK_STATUS(test_context, loxo_read_mesh_memory(test_context, BYTES("v 0 0 0\n"), "a", &settings, &soup),
                 LOXO_ERR_MALFORMED);
    settings.format = LOXO_FORMAT_VTP;
    CHECK_STATUS(test_context, loxo_read_mesh_memory(test_context, BYTES("v 0 0 0\n"), "a", &settings, &soup),
                 LOXO_ERR_UNSUPPORTED);
    CHECK_STATUS(test_context, loxo_read_mesh_memory(test_context, BYTES("hello"), "a", NULL, &soup),
                 LOXO_ERR_UNSUPPORTED);
}
