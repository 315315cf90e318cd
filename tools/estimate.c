/* SPDX-License-Identifier: MIT */
#define _POSIX_C_SOURCE 200809L /* stat */

#include "estimate.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

/* What neither a head nor a pass could count is read after all. */
static loxo_status count_by_reading(cli_run *run, const char *path, loxo_mesh_counts *counts)
{
    const loxo_read_settings settings = loxo_read_settings_default();
    loxo_soup soup = {0};
    if (strcmp(path, "-") == 0)
        return cli_fail_at(run, LOXO_ERR_MALFORMED, path, 0, "counts nothing that its bytes could hold");
    const loxo_status status = loxo_read_mesh(run->ctx, path, &settings, &soup);
    if (status < 0) return status;
    counts->n_vertices = soup.n_vertices;
    counts->n_faces = soup.n_faces;
    counts->n_fields = soup.n_fields;
    counts->is_float = soup.position_float != NULL;
    counts->read_bytes = loxo_context_memory(run->ctx).peak_bytes;
    loxo_soup_destroy(run->ctx, &soup);
    return status;
}

loxo_status cli_count_mesh(cli_run *run, const char *path, loxo_mesh_counts *counts)
{
    const loxo_read_settings settings = loxo_read_settings_default();
    run->input = path;
    json_put_text(run->report.json, "input", path);
    loxo_status status = loxo_read_counts(run->ctx, path, &settings, true, counts);
    if (status >= 0 && counts->n_vertices < 0) status = count_by_reading(run, path, counts);
    if (status < 0) return status;
    json_t *input = json_put_object(run->report.json, "counts");
    json_put_integer(input, "n_vertices", counts->n_vertices);
    json_put_integer(input, "n_faces", counts->n_faces);
    report_row(&run->report, "input", "%s  %s%s vertices, %s faces%s", text_path(path),
               counts->format == LOXO_FORMAT_STL ? "about " : "", text_count(counts->n_vertices),
               text_count(counts->n_faces), counts->is_float ? ", float" : "");
    return cli_combine(run, status);
}

loxo_status cli_count_array(cli_run *run, const char *path, loxo_array *array, size_t *read_bytes)
{
    char shape[96] = "";
    int used = 0;
    run->input = path;
    json_put_text(run->report.json, "input", path);
    const loxo_status status = loxo_read_array_shape(run->ctx, path, array, read_bytes);
    if (status < 0) return status;
    for (int k = 0; k < array->n_dimensions; ++k)
        used += snprintf(shape + used, sizeof shape - (size_t)used, "%s%s", k > 0 ? " x " : "",
                         text_count(array->shape[k]));
    report_row(&run->report, "input", "%s  %s numbers", text_path(path), shape);
    return cli_combine(run, status);
}

size_t cli_counts_bytes(const loxo_mesh_counts *counts)
{
    const size_t position = counts->is_float ? 3 * sizeof(float) : 3 * sizeof(double);
    return (size_t)counts->n_vertices * (position + (size_t)counts->n_fields * sizeof(double)) +
           (size_t)counts->n_faces * 3 * sizeof(loxo_index);
}

void cli_estimate_part(cli_run *run, const char *what, size_t n_bytes)
{
    json_t *estimate = json_object_get(run->report.json, "estimate");
    if (estimate == NULL) estimate = json_put_object(run->report.json, "estimate");
    json_put_integer(estimate, what, (int64_t)n_bytes);
    report_row(&run->report, what, "%s", text_bytes((double)n_bytes));
}

void cli_estimate(cli_run *run, size_t peak_bytes, double seconds)
{
    const size_t limit = run->limit_bytes;
    cli_estimate_part(run, "peak_bytes", peak_bytes);
    json_t *estimate = json_object_get(run->report.json, "estimate");
    json_put_number(estimate, "seconds", seconds);
    json_put_integer(estimate, "limit_bytes", (int64_t)limit);
    json_put_bool(estimate, "fits", peak_bytes <= limit);
    if (seconds == seconds) report_row(&run->report, "seconds", "about %s", text_seconds(seconds));
    report_row(&run->report, "limit", "%s: %s", text_bytes((double)limit),
               peak_bytes <= limit ? "fits" : "does not fit");
    if (peak_bytes > limit)
        cli_warn(run, 1, "%zu bytes are needed; the limit is %zu (--max-memory)", peak_bytes, limit);
}

bool cli_peek_counts(cli_run *run, const char *path, loxo_mesh_counts *counts)
{
    const loxo_read_settings settings = loxo_read_settings_default();
    struct stat file;
    if (strcmp(path, "-") == 0 || stat(path, &file) != 0 || !S_ISREG(file.st_mode)) return false; /* read only once */
    const loxo_status status = loxo_read_counts(run->ctx, path, &settings, false, counts);
    loxo_context_clear(run->ctx);
    return status >= 0 && counts->n_vertices >= 0;
}
