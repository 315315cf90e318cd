/* SPDX-License-Identifier: MIT
 * What all fuzz targets share. A target is one file that defines fuzz_one(); the harness makes libFuzzer's entry point of
 * it, with a context of one thread and little memory, and checks what every reader promises: a usable result or a
 * failure that says something, and nothing left allocated.
 *
 * With -DLOXO_FUZZ_PLANT=1 the target has a bug that only a file which was read to its end can reach (FUZZ_PLANT):
 * `tests/fuzz/run --planted` fails unless each of them is found. */
#ifndef LOXO_FUZZ_HARNESS_H
#define LOXO_FUZZ_HARNESS_H

#include <loxo/mesh.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef LOXO_FUZZ_PLANT
#define LOXO_FUZZ_PLANT 0
#endif
#define FUZZ_PLANT(condition)                                                                                          \
    do {                                                                                                               \
        if (LOXO_FUZZ_PLANT && (condition)) abort();                                                                   \
    } while (0)
#define FUZZ_CHECK(condition) fuzz_check((condition), #condition, __LINE__)

#define FUZZ_MEMORY_BYTES ((size_t)64 << 20)

static void fuzz_one(loxo_context *ctx, const uint8_t *bytes, size_t n);
int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n);

static inline void fuzz_check(bool good, const char *text, int line)
{
    if (good) return;
    fprintf(stderr, "line %d: not so: %s\n", line, text);
    abort();
}

/* A status of a reader, with what it leaves in the context. */
static inline void fuzz_check_status(const loxo_context *ctx, loxo_status status)
{
    const loxo_failure *failure = loxo_context_failure(ctx);
    if (status >= 0) return;
    FUZZ_CHECK(status == LOXO_ERR_MALFORMED || status == LOXO_ERR_UNSUPPORTED || status == LOXO_ERR_MEMORY ||
               status == LOXO_ERR_LIMIT || status == LOXO_ERR_MESH);
    FUZZ_CHECK(failure->status == status);
    FUZZ_CHECK(failure->text[0] != '\0');
    for (const char *c = failure->text; *c != '\0'; ++c)
        FUZZ_CHECK((unsigned char)*c >= 0x20 && *c != 0x7f);
}

static inline double fuzz_coordinate(const loxo_soup *soup, int64_t i)
{
    return soup->position != NULL ? soup->position[i] : (double)soup->position_float[i];
}

/* A soup as readers promise it, or an empty one. */
static inline void fuzz_check_soup(const loxo_context *ctx, loxo_status status, const loxo_soup *soup)
{
    double sum = 0.0;
    fuzz_check_status(ctx, status);
    if (status < 0) {
        FUZZ_CHECK(soup->position == NULL && soup->position_float == NULL && soup->triangle == NULL);
        FUZZ_CHECK(soup->fields == NULL && soup->n_vertices == 0 && soup->n_faces == 0 && soup->n_fields == 0);
        return;
    }
    FUZZ_CHECK(soup->n_vertices >= 0 && soup->n_faces >= 0 && soup->n_fields >= 0);
    FUZZ_CHECK(soup->n_vertices == 0 || (soup->position == NULL) != (soup->position_float == NULL));
    for (int64_t i = 0; i < 3 * soup->n_faces; ++i) {
        FUZZ_CHECK(soup->triangle[i] >= 0 && soup->triangle[i] < soup->n_vertices);
        for (int64_t c = 0; c < 3; ++c) {
            const double x = fuzz_coordinate(soup, 3 * (int64_t)soup->triangle[i] + c);
            FUZZ_CHECK(x - x == 0.0);
        }
    }
    for (int64_t i = 0; i < 3 * soup->n_vertices; ++i) /* every number is there to be read */
        sum += fuzz_coordinate(soup, i);
    for (int f = 0; f < soup->n_fields; ++f) {
        FUZZ_CHECK(memchr(soup->fields[f].name, 0, sizeof soup->fields[f].name) != NULL);
        for (int64_t v = 0; v < soup->n_vertices; ++v)
            sum += soup->fields[f].value[v];
    }
    FUZZ_CHECK(sum <= 0.0 || sum >= 0.0 || sum != sum);
}

/* The whole of a target that reads surfaces. */
#define FUZZ_READER(call, plant)                                                                                       \
    static void fuzz_one(loxo_context *ctx, const uint8_t *bytes, size_t n)                                            \
    {                                                                                                                  \
        loxo_soup soup;                                                                                                \
        const loxo_status status = (call);                                                                             \
        fuzz_check_soup(ctx, status, &soup);                                                                           \
        FUZZ_PLANT(status >= 0 && (plant));                                                                            \
        loxo_soup_destroy(ctx, &soup);                                                                                 \
    }

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n)
{
    static loxo_context *ctx; /* made once: a run takes microseconds */
    if (ctx == NULL) {
        loxo_context_settings settings = loxo_context_settings_default();
        settings.n_threads = 1;
        settings.memory_limit_bytes = FUZZ_MEMORY_BYTES;
        FUZZ_CHECK(loxo_context_create(&settings, &ctx) == LOXO_OK);
    }
    loxo_context_clear(ctx);
    fuzz_one(ctx, bytes, n);
    FUZZ_CHECK(loxo_context_memory(ctx).current_bytes == 0);
    return 0;
}

#endif
