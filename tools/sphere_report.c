/* SPDX-License-Identifier: MIT */
#include "sphere_report.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- reading ---------------------------------------------------------------------------------------------------- */

static bool is_table(const char *path)
{
    static const char *const suffixes[] = {".npy", ".csv", ".txt"};
    const size_t n = strlen(path);
    for (size_t i = 0; i < sizeof suffixes / sizeof *suffixes; ++i)
        if (n >= 4 && strcmp(path + n - 4, suffixes[i]) == 0) return true;
    return false;
}

/* Positions of the mesh go over to *map; what is left of it is freed. */
static loxo_status take_positions(cli_run *run, loxo_soup *mesh, double **map)
{
    *map = mesh->position;
    mesh->position = NULL;
    if (*map != NULL) return LOXO_OK;
    if ((*map = loxo_allocate(run->ctx, 3 * mesh->n_vertices, sizeof **map)) == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < 3 * mesh->n_vertices; ++i)
        (*map)[i] = (double)mesh->position_float[i];
    return LOXO_OK;
}

static void compare_faces(cli_run *run, const loxo_soup *map, const loxo_soup *surface)
{
    int64_t n_other = 0;
    if (map->n_faces == 0) return;
    if (map->n_faces != surface->n_faces) {
        cli_warn(run, 1, "the map has %lld faces, the surface %lld: is this a map of it?", (long long)map->n_faces,
                 (long long)surface->n_faces);
        return;
    }
    for (int64_t f = 0; f < map->n_faces; ++f)
        n_other += memcmp(map->triangle + 3 * f, surface->triangle + 3 * f, 3 * sizeof *map->triangle) != 0;
    if (n_other > 0)
        cli_warn(run, n_other,
                 "%lld faces of the map have other corners than those of the surface: is this a map of it?",
                 (long long)n_other);
}

static loxo_status normalize(cli_run *run, const char *path, int64_t n, double *map)
{
    for (int64_t i = 0; i < n; ++i) {
        double *p = map + 3 * i;
        const double most = fmax(fabs(p[0]), fmax(fabs(p[1]), fabs(p[2])));
        if (!(most > 0.0) || !isfinite(most))
            return cli_fail_at(run, LOXO_ERR_MESH, path, 0, "vertex %lld has no direction", (long long)i);
        const double q[3] = {p[0] / most, p[1] / most, p[2] / most};
        const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
        for (int k = 0; k < 3; ++k)
            p[k] = q[k] / length;
    }
    return LOXO_OK;
}

loxo_status cli_read_sphere_map(cli_run *run, const char *path, const loxo_soup *surface, bool is_normalized,
                                double **map)
{
    loxo_soup mesh = {0};
    int64_t n = 0;
    loxo_status status;
    *map = NULL;
    if (is_table(path)) {
        status = loxo_read_points(run->ctx, path, map, &n);
    } else if ((status = loxo_read_mesh(run->ctx, path, NULL, &mesh)) >= 0) {
        n = mesh.n_vertices;
        status = take_positions(run, &mesh, map);
    }
    if (status >= 0 && n != surface->n_vertices)
        status = cli_fail_at(run, LOXO_ERR_MESH, path, 0, "has %lld vertices, the surface %lld", (long long)n,
                             (long long)surface->n_vertices);
    if (status >= 0) compare_faces(run, &mesh, surface);
    if (status >= 0 && is_normalized) status = normalize(run, path, n, *map);
    loxo_soup_destroy(run->ctx, &mesh);
    if (status >= 0) return LOXO_OK;
    loxo_release(run->ctx, *map);
    *map = NULL;
    return status;
}

/* ---- telling ---------------------------------------------------------------------------------------------------- */

static void put_distribution(json_t *object, const char *key, const loxo_distribution *d)
{
    json_t *o = json_put_object(object, key);
    json_put_integer(o, "n", d->n);
    json_put_number(o, "mean", d->mean);
    json_put_number(o, "sd", d->sd);
    json_put_number(o, "median", d->median);
    json_put_number(o, "percentile_75", d->percentile_75);
    json_put_number(o, "percentile_95", d->percentile_95);
    json_put_number(o, "percentile_99", d->percentile_99);
    json_put_number(o, "max", d->max);
}

static void tell_distribution(cli_run *run, const char *label, const loxo_distribution *d, const char *unit)
{
    report_row(&run->report, label, "mean %.4g, SD %.4g; 50 %% %.4g, 75 %% %.4g, 95 %% %.4g, 99 %% %.4g, most %.4g%s",
               d->mean, d->sd, d->median, d->percentile_75, d->percentile_95, d->percentile_99, d->max, unit);
}

/* E_C as the paper has it, and as solvers have it where that is another number. */
static const char *energy_text(const loxo_sphere_map_measure *m, char text[96])
{
    if (m->energy_signed == m->energy)
        (void)snprintf(text, 96, "E_C %.6e", m->energy);
    else
        (void)snprintf(text, 96, "E_C %.6e, %.6e with signed areas", m->energy, m->energy_signed);
    return text;
}

void cli_tell_sphere_map(cli_run *run, const char *key, const char *label, bool is_short,
                         const loxo_sphere_map_measure *m)
{
    char text[96];
    json_t *o = json_put_object(run->report.json, key);
    json_put_number(o, "energy", m->energy);
    json_put_number(o, "energy_signed", m->energy_signed);
    json_put_number(o, "dirichlet", m->dirichlet);
    json_put_number(o, "area", m->area);
    json_put_number(o, "image_area", m->image_area);
    json_put_number(o, "image_area_signed", m->image_area_signed);
    json_put_integer(o, "n_faces", m->n_faces);
    json_put_integer(o, "n_flat", m->n_flat);
    json_put_integer(o, "n_image_flat", m->n_image_flat);
    json_put_integer(o, "n_folds", m->n_folds);
    json_put_integer(o, "degree", m->degree);
    put_distribution(o, "angle_error_deg", &m->angle_error_deg);
    put_distribution(o, "beltrami", &m->beltrami);
    put_distribution(o, "area_log", &m->area_log);
    if (is_short) {
        report_row(&run->report, label, "%s; angle error mean %.4g, SD %.4g; 50 %% %.4g, 75 %% %.4g degrees",
                   energy_text(m, text), m->angle_error_deg.mean, m->angle_error_deg.sd, m->angle_error_deg.median,
                   m->angle_error_deg.percentile_75);
        return;
    }
    report_row(&run->report, label, "degree %d, %s folds; %s faces without area, %s images", m->degree,
               text_count(m->n_folds), text_count(m->n_flat), text_count(m->n_image_flat));
    report_row(&run->report, "energy", "%s (3.3), image area %.6g", energy_text(m, text), m->image_area);
    tell_distribution(run, "angle error", &m->angle_error_deg, " degrees");
    tell_distribution(run, "|mu|", &m->beltrami, "");
    tell_distribution(run, "|log area|", &m->area_log, "");
}
