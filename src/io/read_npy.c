/* SPDX-License-Identifier: MIT */
#include "base/context.h"
#include "io/bytes.h"
#include "io/field.h"

#include <inttypes.h>
#include <math.h>

typedef struct header {
    const char *at, *end; /* of the dictionary that is left */
    char kind;            /* f i u b, as in '<f8' */
    int width;
    bool is_big;
    int n_dimensions;
    int64_t dimension[2]; /* of more, the product stands in the second */
    int64_t shape[3];     /* the first ones */
    bool has_descr, has_order, has_shape;
    bool is_fortran;
} header;

static loxo_status fail(loxo_context *ctx, const char *name, int64_t byte, loxo_status status, const char *text)
{
    return loxo_fail_at(ctx, status, (loxo_place){.file = name, .byte = byte, .element = -1}, ".npy: %s", text);
}

static void skip_blanks(header *npy)
{
    while (npy->at < npy->end && (*npy->at == ' ' || *npy->at == '\n' || *npy->at == '\t'))
        ++npy->at;
}

static bool take(header *npy, char c)
{
    skip_blanks(npy);
    if (npy->at == npy->end || *npy->at != c) return false;
    ++npy->at;
    return true;
}

/* 'text' or "text". */
static bool take_text(header *npy, const char **text, size_t *n)
{
    skip_blanks(npy);
    if (npy->at == npy->end || (*npy->at != '\'' && *npy->at != '"')) return false;
    const char *begin = npy->at + 1;
    const char *close = memchr(begin, *npy->at, (size_t)(npy->end - begin));
    if (close == NULL) return false;
    *text = begin;
    *n = (size_t)(close - begin);
    npy->at = close + 1;
    return true;
}

static bool take_word(header *npy, const char *word)
{
    const size_t n = strlen(word);
    skip_blanks(npy);
    if ((size_t)(npy->end - npy->at) < n || memcmp(npy->at, word, n) != 0) return false;
    npy->at += n;
    return true;
}

static bool take_count(header *npy, int64_t *count)
{
    skip_blanks(npy);
    const char *begin = npy->at;
    *count = 0;
    for (; npy->at < npy->end && *npy->at >= '0' && *npy->at <= '9'; ++npy->at)
        if (__builtin_mul_overflow(*count, 10, count) || __builtin_add_overflow(*count, *npy->at - '0', count))
            return false;
    if (npy->at > begin && npy->at < npy->end && *npy->at == 'L') ++npy->at; /* written by Python 2 */
    return npy->at > begin;
}

/* (n,) or (n, 1) and the like. */
static bool take_shape(header *npy)
{
    if (!take(npy, '(')) return false;
    npy->n_dimensions = 0;
    npy->dimension[0] = npy->dimension[1] = 1;
    while (!take(npy, ')')) {
        int64_t count, *product = &npy->dimension[npy->n_dimensions == 0 ? 0 : 1];
        if (npy->n_dimensions > 0 && !take(npy, ',')) return false;
        if (npy->n_dimensions > 0 && take(npy, ')')) return true;
        if (npy->n_dimensions == 64 || !take_count(npy, &count) || __builtin_mul_overflow(*product, count, product))
            return false;
        if (npy->n_dimensions < 3) npy->shape[npy->n_dimensions] = count;
        ++npy->n_dimensions;
    }
    return true;
}

/* '<f8' */
static bool take_type(header *npy)
{
    const char *text;
    size_t n;
    if (!take_text(npy, &text, &n) || n < 2) return false;
    npy->is_big = text[0] == '>' || (text[0] == '=' && LOXO_HOST_IS_BIG);
    if (text[0] == '<' || text[0] == '>' || text[0] == '=' || text[0] == '|') {
        ++text;
        --n;
    }
    npy->kind = text[0];
    npy->width = n == 2 && text[1] >= '0' && text[1] <= '9' ? text[1] - '0' : 0;
    return true;
}

static loxo_status parse_dictionary(loxo_context *ctx, const char *name, header *npy)
{
    bool is_good = take(npy, '{');
    while (is_good && !take(npy, '}')) {
        const char *key;
        size_t n;
        is_good = take_text(npy, &key, &n) && take(npy, ':');
        if (!is_good) break;
        if (n == 5 && memcmp(key, "descr", n) == 0) {
            skip_blanks(npy);
            if (npy->at < npy->end && *npy->at == '[')
                return fail(ctx, name, -1, LOXO_ERR_UNSUPPORTED, "records of several fields");
            is_good = !npy->has_descr && take_type(npy);
            npy->has_descr = true;
        } else if (n == 13 && memcmp(key, "fortran_order", n) == 0) {
            npy->is_fortran = take_word(npy, "True");
            is_good = !npy->has_order && (npy->is_fortran || take_word(npy, "False"));
            npy->has_order = true;
        } else if (n == 5 && memcmp(key, "shape", n) == 0) {
            is_good = !npy->has_shape && take_shape(npy);
            npy->has_shape = true;
        } else {
            is_good = false;
        }
        if (is_good && !take(npy, ',')) {
            is_good = take(npy, '}');
            break;
        }
    }
    skip_blanks(npy);
    if (!is_good || npy->at != npy->end || !npy->has_descr || !npy->has_order || !npy->has_shape)
        return fail(ctx, name, 10, LOXO_ERR_MALFORMED, "the header is not the dictionary that it must be");
    return LOXO_OK;
}

static bool is_known_type(const header *npy)
{
    switch (npy->kind) {
    case 'f': return npy->width == 2 || npy->width == 4 || npy->width == 8;
    case 'i':
    case 'u': return npy->width == 1 || npy->width == 2 || npy->width == 4 || npy->width == 8;
    case 'b': return npy->width == 1;
    default: return false;
    }
}

/* IEEE half precision. */
static double load_half(const uint8_t *p, bool swap)
{
    const uint16_t bits = loxo_load_u16(p, swap);
    const int exponent = bits >> 10 & 31, fraction = bits & 1023;
    double value;
    if (exponent == 31) {
        value = fraction == 0 ? (double)INFINITY : (double)NAN;
    } else if (exponent == 0) {
        value = fraction * 0x1p-24;
    } else {
        value = ldexp(1024 + fraction, exponent - 25);
    }
    return bits >> 15 != 0 ? -value : value;
}

static double load_number(const header *npy, const uint8_t *p, bool swap)
{
    if (npy->kind == 'f') {
        if (npy->width == 8) return loxo_load_double(p, swap);
        return npy->width == 4 ? (double)loxo_load_float(p, swap) : load_half(p, swap);
    }
    if (npy->kind == 'b') return *p != 0 ? 1.0 : 0.0;
    const bool is_signed = npy->kind == 'i';
    switch (npy->width) {
    case 1: return is_signed ? (int8_t)*p : *p;
    case 2: return is_signed ? (int16_t)loxo_load_u16(p, swap) : loxo_load_u16(p, swap);
    case 4: return is_signed ? (double)(int32_t)loxo_load_u32(p, swap) : (double)loxo_load_u32(p, swap);
    default: return is_signed ? (double)(int64_t)loxo_load_u64(p, swap) : (double)loxo_load_u64(p, swap);
    }
}

/* Finds the dictionary; *data is where the numbers begin. */
static loxo_status find_dictionary(loxo_context *ctx, const char *name, const uint8_t *bytes, size_t n, header *npy,
                                   size_t *data)
{
    if (n < 10 || memcmp(bytes, "\x93NUMPY", 6) != 0)
        return fail(ctx, name, 0, LOXO_ERR_MALFORMED, n == 0 ? "empty file" : "the magic bytes are missing");
    if (bytes[6] < 1 || bytes[6] > 3) return fail(ctx, name, 6, LOXO_ERR_UNSUPPORTED, "of a version that is not known");
    const size_t begin = bytes[6] == 1 ? 10 : 12;
    if (n < begin) return fail(ctx, name, (int64_t)n, LOXO_ERR_MALFORMED, "the file ends within its header");
    const size_t n_header =
        bytes[6] == 1 ? loxo_load_u16(bytes + 8, LOXO_HOST_IS_BIG) : loxo_load_u32(bytes + 8, LOXO_HOST_IS_BIG);
    if (n_header > n - begin) return fail(ctx, name, (int64_t)n, LOXO_ERR_MALFORMED, "the file ends within its header");
    npy->at = (const char *)bytes + begin;
    npy->end = npy->at + n_header;
    *data = begin + n_header;
    return LOXO_OK;
}

static loxo_status read_header(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name, header *npy,
                               size_t *data)
{
    loxo_status status = find_dictionary(ctx, name, bytes, n_bytes, npy, data);
    if (status >= 0) status = parse_dictionary(ctx, name, npy);
    if (status >= 0 && !is_known_type(npy))
        status = fail(ctx, name, 10, LOXO_ERR_UNSUPPORTED, "neither integers nor floats of 2, 4, 8 bytes");
    return status;
}

/* The numbers of [a][b][c], the last index fastest. */
static loxo_status read_numbers(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                const header *npy, size_t data, int64_t a, int64_t b, int64_t c, double **value)
{
    int64_t n_wanted, n_numbers = 0;
    const int64_t n_left = (int64_t)(n_bytes - data);
    if (__builtin_mul_overflow(a, b, &n_numbers) || __builtin_mul_overflow(n_numbers, c, &n_numbers) ||
        __builtin_mul_overflow(n_numbers, (int64_t)npy->width, &n_wanted) || n_wanted > n_left)
        return loxo_fail_at(
            ctx, LOXO_ERR_MALFORMED, (loxo_place){.file = name, .byte = (int64_t)n_bytes, .element = -1},
            ".npy: %" PRId64 " numbers are announced, the file holds %" PRId64, n_numbers, n_left / npy->width);
    if (n_wanted < n_left)
        loxo_warn(ctx, "npy-trailing", n_left - n_wanted, "%s: %" PRId64 " bytes behind the array are ignored", name,
                  n_left - n_wanted);
    const bool swap = npy->is_big != LOXO_HOST_IS_BIG;
    double *out = loxo_allocate(ctx, n_numbers, sizeof *out);
    if (out == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < n_numbers; ++i) {
        const int64_t k = i % c, j = i / c % b;
        const int64_t at = npy->is_fortran ? (k * b + j) * a + i / c / b : i;
        out[i] = load_number(npy, bytes + data + at * npy->width, swap);
    }
    *value = out;
    return LOXO_OK;
}

/* Rows of so many columns: [*n_rows][n_columns]. */
static loxo_status read_rows(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                             int64_t n_columns, double **value, int64_t *n_rows)
{
    header npy = {0};
    size_t data = 0;
    loxo_status status = read_header(ctx, bytes, n_bytes, name, &npy, &data);
    if (status < 0) return status;
    if (npy.n_dimensions == 0 || npy.dimension[1] != n_columns)
        return fail(ctx, name, 10, LOXO_ERR_UNSUPPORTED, n_columns == 1 ? "not of one dimension" : "not of 3 columns");
    status = read_numbers(ctx, bytes, n_bytes, name, &npy, data, npy.dimension[0], 1, n_columns, value);
    if (status >= 0) *n_rows = npy.dimension[0];
    return status;
}

static loxo_status read_shape(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name, header *npy,
                              size_t *data, loxo_array *array)
{
    const loxo_status status = read_header(ctx, bytes, n_bytes, name, npy, data);
    if (status < 0) return status;
    if (npy->n_dimensions < 1 || npy->n_dimensions > 3)
        return fail(ctx, name, 10, LOXO_ERR_UNSUPPORTED, "not of one to three dimensions");
    *array = (loxo_array){.n_dimensions = npy->n_dimensions};
    for (int k = 0; k < npy->n_dimensions; ++k) {
        array->shape[k] = npy->shape[k];
        if (npy->shape[k] == 0) return fail(ctx, name, -1, LOXO_ERR_MALFORMED, "no number in it");
    }
    return LOXO_OK;
}

loxo_status loxo_read_npy_shape(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                loxo_array *array)
{
    header npy = {0};
    size_t data = 0;
    return read_shape(ctx, bytes, n_bytes, name, &npy, &data, array);
}

loxo_status loxo_read_npy_array(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                loxo_array *array)
{
    header npy = {0};
    size_t data = 0;
    loxo_array own;
    int64_t full[3] = {1, 1, 1};
    loxo_status status = read_shape(ctx, bytes, n_bytes, name, &npy, &data, &own);
    if (status < 0) return status;
    memcpy(full, own.shape, (size_t)own.n_dimensions * sizeof *full);
    status = read_numbers(ctx, bytes, n_bytes, name, &npy, data, full[0], full[1], full[2], &own.value);
    if (status >= 0) *array = own;
    return status;
}

loxo_status loxo_read_npy(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name, double **value,
                          int64_t *n)
{
    return read_rows(ctx, bytes, n_bytes, name, 1, value, n);
}

loxo_status loxo_read_npy_points(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                 double **position, int64_t *n)
{
    return read_rows(ctx, bytes, n_bytes, name, 3, position, n);
}
