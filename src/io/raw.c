/* SPDX-License-Identifier: MIT */
#include "io/raw.h"

#include "base/context.h"
#include "io/bytes.h"
#include "io/faces.h"

#include <inttypes.h>

static int64_t number_of(const loxo_raw *raw, int64_t row, int column)
{
    return raw->is_column_major ? column * raw->n_rows + row : 3 * row + column;
}

static loxo_place place_of(const char *name, const loxo_raw *raw, int64_t number, int64_t width, int64_t row)
{
    return (loxo_place){
        .file = name, .line = raw->line, .byte = raw->byte < 0 ? -1 : raw->byte + number * width, .element = row};
}

loxo_status loxo_raw_positions(loxo_context *ctx, const char *name, const loxo_raw *raw, bool is_double,
                               loxo_soup *soup)
{
    const loxo_status status = loxo_soup_allocate_vertices(ctx, soup, raw->n_rows, !is_double);
    if (status < 0) {
        loxo_failure_set_file(ctx, name);
        return status;
    }
    for (int64_t v = 0; v < raw->n_rows; ++v)
        for (int c = 0; c < 3; ++c) {
            const int64_t i = number_of(raw, v, c);
            if (is_double)
                soup->position[3 * v + c] = loxo_load_double(raw->bytes + 8 * i, raw->swap);
            else
                soup->position_float[3 * v + c] = loxo_load_float(raw->bytes + 4 * i, raw->swap);
        }
    return LOXO_OK;
}

loxo_status loxo_raw_triangles(loxo_context *ctx, const char *name, const loxo_raw *raw, loxo_soup *soup)
{
    const int64_t n_vertices = soup->n_vertices;
    bool has_zero = false;
    const loxo_status status = loxo_soup_allocate_triangles(ctx, soup, raw->n_rows);
    if (status < 0) {
        loxo_failure_set_file(ctx, name);
        return status;
    }
    for (int64_t f = 0; f < raw->n_rows; ++f)
        for (int c = 0; c < 3; ++c) {
            const int64_t i = number_of(raw, f, c);
            const uint32_t id = loxo_load_u32(raw->bytes + 4 * i, raw->swap);
            has_zero = has_zero || id == 0;
            if (id < n_vertices) {
                soup->triangle[3 * f + c] = (loxo_index)id;
                continue;
            }
            const char *hint = !has_zero && id == n_vertices        ? " (are they counted from 1?)"
                               : __builtin_bswap32(id) < n_vertices ? " (byte order?)"
                                                                    : "";
            return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place_of(name, raw, i, 4, f),
                                "face %" PRId64 ": vertex index %" PRId32 " not in 0..%" PRId64 "%s", f, (int32_t)id,
                                n_vertices - 1, hint);
        }
    return LOXO_OK;
}

loxo_status loxo_raw_finish(loxo_context *ctx, const char *name, const loxo_raw *positions, bool is_double,
                            const loxo_soup *soup)
{
    int64_t n_nonfinite = 0;
    for (int64_t v = 0; v < soup->n_vertices; ++v)
        n_nonfinite += loxo_is_finite3(soup, v) ? 0 : 1;
    const int64_t v = n_nonfinite > 0 ? loxo_soup_first_used_nonfinite(ctx, soup) : -1;
    if (v >= 0)
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED,
                            place_of(name, positions, number_of(positions, v, 0), is_double ? 8 : 4, v),
                            "vertex %" PRId64 ": a coordinate is not a finite number", v);
    loxo_soup_warn(ctx, name, soup, n_nonfinite);
    return LOXO_OK;
}
