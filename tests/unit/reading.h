/* SPDX-License-Identifier: MIT
 * Tables of files made in code: what each must give, read from memory and from disk, by 1, 2, 3 and 7 threads. */
#ifndef LOXO_TEST_READING_H
#define LOXO_TEST_READING_H

#include "loxo_config.h"
#include "test.h"

#include <loxo/io.h>

#include <inttypes.h>
#ifdef LOXO_WITH_ZLIB
#include <zlib.h>
#endif

/* Never NULL. */
static inline void *allocate_or_abort(size_t n)
{
    void *block = malloc(n);
    if (block == NULL) abort();
    return block;
}

/* A literal that may hold zeros. */
#define BYTES(literal) (literal), sizeof(literal) - 1

typedef struct bad_file {
    const char *what;
    const char *bytes;
    size_t n;
    loxo_status status;
    int64_t line, byte, element; /* as in loxo_failure: 0, -1, -1 when unknown */
    const char *text;            /* part of the message */
} bad_file;

typedef struct good_file {
    const char *what;
    const char *bytes;
    size_t n;
    const char *mesh;    /* as soup_text writes it */
    const char *warning; /* part of the only warning; NULL: there is none */
} good_file;

static inline void write_scratch(const char *path, const void *bytes, size_t n)
{
    FILE *file = fopen(path, "wb");
    CHECK(file != NULL);
    CHECK(fwrite(bytes, 1, n, file) == n);
    CHECK(fclose(file) == 0);
}

/* "0 0 0, 1 0 0, 0 1 0 | 0 1 2", and "| name 1 2 3" for each field. */
static inline void soup_text(const loxo_soup *soup, char *text, size_t n)
{
    size_t used = 0;
    text[0] = 0;
    for (int64_t v = 0; v < soup->n_vertices; ++v) {
        double p[3];
        for (int i = 0; i < 3; ++i)
            p[i] = soup->position_float != NULL ? (double)soup->position_float[3 * v + i] : soup->position[3 * v + i];
        used += (size_t)snprintf(text + used, n - used, "%s%g %g %g", v == 0 ? "" : ", ", p[0], p[1], p[2]);
        CHECK(used < n);
    }
    for (int64_t f = 0; f < soup->n_faces; ++f) {
        const loxo_index *t = &soup->triangle[3 * f];
        used += (size_t)snprintf(text + used, n - used, "%s%d %d %d", f == 0 ? " | " : ", ", (int)t[0], (int)t[1],
                                 (int)t[2]);
        CHECK(used < n);
    }
    for (int i = 0; i < soup->n_fields; ++i) {
        used += (size_t)snprintf(text + used, n - used, " | %s", soup->fields[i].name);
        for (int64_t v = 0; v < soup->n_vertices; ++v) {
            used += (size_t)snprintf(text + used, n - used, " %g", soup->fields[i].value[v]);
            CHECK(used < n);
        }
    }
}

static inline uint64_t soup_hash(const loxo_soup *soup)
{
    const size_t n = (size_t)soup->n_vertices;
    const uint64_t position = soup->position_float != NULL ? test_hash(soup->position_float, n * 3 * sizeof(float))
                                                           : test_hash(soup->position, n * 3 * sizeof(double));
    return position ^ (3 * test_hash(soup->triangle, (size_t)soup->n_faces * 3 * sizeof(loxo_index)));
}

static const int thread_ladder[] = {1, 2, 3, 7};

static inline void check_failure(const loxo_context *ctx, const bad_file *f, loxo_status status, const char *file)
{
    const loxo_failure *failure = loxo_context_failure(ctx);
    const bool is_right = status == f->status && failure->status == f->status && failure->line == f->line &&
                          failure->byte == f->byte && failure->element == f->element &&
                          strstr(failure->text, f->text) != NULL && strcmp(failure->file, file) == 0;
    if (is_right) return;
    print_error("%s: gave %s at %s, line %" PRId64 ", byte %" PRId64 ", element %" PRId64 ": %s\n", f->what,
                loxo_status_name(status), failure->file, failure->line, failure->byte, failure->element, failure->text);
    CHECK(is_right);
}

/* name gives the suffix: "a.ply". */
static inline void check_bad_files(const bad_file *files, size_t n, const char *name)
{
    for (size_t i = 0; i < n; ++i) {
        const bad_file *f = &files[i];
        const char *path = test_scratch(name);
        write_scratch(path, f->bytes, f->n);
        for (size_t t = 0; t < 4; ++t) {
            loxo_context *ctx = test_context_with_threads(thread_ladder[t]);
            loxo_soup soup;
            check_failure(ctx, f, loxo_read_mesh_memory(ctx, f->bytes, f->n, name, NULL, &soup), name);
            CHECK(soup.triangle == NULL && soup.position == NULL && soup.position_float == NULL);
            loxo_context_clear(ctx);
            check_failure(ctx, f, loxo_read_mesh(ctx, path, NULL, &soup), path);
            for (int is_thorough = 0; is_thorough < 2; ++is_thorough) { /* may pass over what is wrong */
                loxo_mesh_counts counts;
                (void)loxo_read_counts(ctx, path, NULL, is_thorough != 0, &counts);
            }
            CHECK_EQUAL(loxo_context_memory(ctx).current_bytes, 0);
            loxo_context_destroy(ctx);
        }
    }
}

static inline void check_warning(const loxo_context *ctx, const good_file *f)
{
    const int n = loxo_context_n_warnings(ctx);
    const bool is_right =
        f->warning == NULL ? n == 0 : n == 1 && strstr(loxo_context_warning(ctx, 0)->text, f->warning) != NULL;
    if (is_right) return;
    for (int i = 0; i < n; ++i)
        print_error("%s: warns: %s\n", f->what, loxo_context_warning(ctx, i)->text);
    CHECK(is_right);
}

/* Counting a file agrees with reading it. What is no number of its own (a strip's turns, dropped in reading) counts as a
 * triangle; STL has its vertices only once they are joined; the head alone may tell less. */
static inline void check_counts(const char *what, const char *path, const loxo_soup *soup)
{
    for (int is_thorough = 0; is_thorough < 2; ++is_thorough) {
        loxo_mesh_counts counts;
        CHECK_OK(loxo_read_counts(test_context, path, NULL, is_thorough != 0, &counts));
        if (is_thorough == 0 && counts.n_vertices < 0) continue;
        const bool is_stl = counts.format == LOXO_FORMAT_STL;
        const bool is_right = (counts.n_vertices == soup->n_vertices || is_stl) &&
                              (is_thorough == 0 ? counts.n_faces <= soup->n_faces || strstr(what, "strip") != NULL ||
                                                      strstr(what, "small faces") != NULL
                                                : counts.n_faces == soup->n_faces || strstr(what, "strip") != NULL) &&
                              counts.is_float == (soup->position_float != NULL);
        if (!is_right)
            print_error("%s: counted%s: %" PRId64 " vertices, %" PRId64 " faces, float %d; read: %" PRId64 ", %" PRId64
                        ", %d\n",
                        what, is_thorough != 0 ? " thoroughly" : "", counts.n_vertices, counts.n_faces, counts.is_float,
                        soup->n_vertices, soup->n_faces, soup->position_float != NULL);
        CHECK(is_right);
    }
}

static inline void check_good_files(const good_file *files, size_t n, const char *name)
{
    for (size_t i = 0; i < n; ++i) {
        const good_file *f = &files[i];
        const char *path = test_scratch(name);
        write_scratch(path, f->bytes, f->n);
        for (int from_disk = 0; from_disk < 2; ++from_disk) {
            char text[4096];
            loxo_soup soup;
            loxo_context_clear(test_context);
            const loxo_status status = from_disk != 0
                                           ? loxo_read_mesh(test_context, path, NULL, &soup)
                                           : loxo_read_mesh_memory(test_context, f->bytes, f->n, name, NULL, &soup);
            if (status != LOXO_OK) print_error("%s:\n", f->what);
            CHECK_OK(status);
            soup_text(&soup, text, sizeof text);
            if (strcmp(text, f->mesh) != 0) print_error("%s:\n", f->what);
            CHECK_TEXT(text, f->mesh);
            check_warning(test_context, f);
            if (from_disk != 0) check_counts(f->what, path, &soup);
            loxo_soup_destroy(test_context, &soup);
        }
    }
}

/* A file gives the same bits, or the same failure, for every number of threads. Returns the hash of its mesh. */
static inline uint64_t check_thread_ladder(const char *bytes, size_t n, const char *name, const bad_file *bad)
{
    uint64_t hash = 0;
    const char *path = test_scratch(name);
    write_scratch(path, bytes, n);
    for (size_t t = 0; t < 8; ++t) {
        loxo_context *ctx = test_context_with_threads(thread_ladder[t / 2]);
        loxo_soup soup;
        const loxo_status status = t % 2 == 0 ? loxo_read_mesh_memory(ctx, bytes, n, name, NULL, &soup)
                                              : loxo_read_mesh(ctx, path, NULL, &soup);
        if (bad != NULL) {
            check_failure(ctx, bad, status, t % 2 == 0 ? name : path);
        } else {
            CHECK_STATUS(ctx, status, LOXO_OK);
            if (t == 0) hash = soup_hash(&soup);
            CHECK(soup_hash(&soup) == hash);
        }
        loxo_soup_destroy(ctx, &soup);
        loxo_context_destroy(ctx);
    }
    return hash;
}

typedef struct memory_file {
    const char *bytes;
    size_t n;
    const char *name;
} memory_file;

static inline loxo_status read_memory_file(loxo_context *ctx, void *arg)
{
    const memory_file *f = arg;
    loxo_soup soup;
    const loxo_status status = loxo_read_mesh_memory(ctx, f->bytes, f->n, f->name, NULL, &soup);
    loxo_soup_destroy(ctx, &soup);
    return status;
}

/* Only the name counts. */
static inline loxo_status read_disk_file(loxo_context *ctx, void *arg)
{
    loxo_soup soup;
    const loxo_status status = loxo_read_mesh(ctx, ((const memory_file *)arg)->name, NULL, &soup);
    loxo_soup_destroy(ctx, &soup);
    return status;
}

/* Text being put together. */
typedef struct text_buffer {
    char *text;
    size_t n, capacity;
} text_buffer;

static inline void text_reserve(text_buffer *b, size_t n_more)
{
    if (b->text != NULL && b->n + n_more <= b->capacity) return;
    b->capacity = 2 * b->capacity + n_more;
    char *grown = realloc(b->text, b->capacity);
    if (grown == NULL) abort();
    b->text = grown;
}

__attribute__((format(printf, 2, 3))) static inline void text_add(text_buffer *b, const char *format, ...)
{
    va_list args;
    text_reserve(b, 4096);
    va_start(args, format);
    b->n += (size_t)vsnprintf(b->text + b->n, 4096, format, args);
    va_end(args);
}

static inline void bytes_add(text_buffer *b, const void *bytes, size_t n)
{
    text_reserve(b, n + 1);
    memcpy(b->text + b->n, bytes, n);
    b->n += n;
}

#ifdef LOXO_WITH_ZLIB

/* Appends a gzip member. */
static inline void gzip_add(text_buffer *out, const void *bytes, size_t n)
{
    z_stream z = {0};
    const size_t room = n + n / 10 + 1000;
    unsigned char *packed = allocate_or_abort(room);
    CHECK(deflateInit2(&z, 9, Z_DEFLATED, 15 + 16, 9, Z_DEFAULT_STRATEGY) == Z_OK);
    unsigned char *copy = allocate_or_abort(n + 1);
    memcpy(copy, bytes, n);
    z.next_in = copy;
    z.avail_in = (uInt)n;
    z.next_out = packed;
    z.avail_out = (uInt)room;
    CHECK(deflate(&z, Z_FINISH) == Z_STREAM_END);
    bytes_add(out, packed, room - z.avail_out);
    deflateEnd(&z);
    free(copy);
    free(packed);
}

#endif

static inline void text_free(text_buffer *b)
{
    free(b->text);
    *b = (text_buffer){0};
}

/* A file of the shared meshes, with its counts, the same by every number of threads; skipped where it is not there. */
typedef struct shared_file {
    const char *name;
    int64_t n_vertices, n_faces;
} shared_file;

static inline void check_shared_files(const shared_file *files, size_t n)
{
    for (size_t i = 0; i < n; ++i) {
        uint64_t hash = 0;
        const char *path = test_shared(files[i].name);
        NEEDS_IDS(3 * files[i].n_faces);
        if (path == NULL) SKIP();
        for (size_t t = 0; t < 4; ++t) {
            loxo_context *ctx = test_context_with_threads(thread_ladder[t]);
            loxo_soup soup;
            const loxo_status status = loxo_read_mesh(ctx, path, NULL, &soup);
            if (files[i].n_vertices > (int64_t)LOXO_INDEX_MAX) { /* a build with 16-bit ids */
                CHECK_STATUS(ctx, status, LOXO_ERR_LIMIT);
                loxo_context_destroy(ctx);
                continue;
            }
            CHECK_STATUS(ctx, status, LOXO_OK);
            CHECK_EQUAL(soup.n_vertices, files[i].n_vertices);
            CHECK_EQUAL(soup.n_faces, files[i].n_faces);
            CHECK_EQUAL(loxo_context_n_warnings(ctx), 0);
            if (t == 0) hash = soup_hash(&soup);
            CHECK(soup_hash(&soup) == hash);
            loxo_soup_destroy(ctx, &soup);
            loxo_context_destroy(ctx);
        }
    }
}

#endif
