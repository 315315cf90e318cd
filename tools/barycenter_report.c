/* SPDX-License-Identifier: MIT
 * What is told of a barycenter, wherever one is found. */
#include "barycenter_report.h"

static void append_all(json_t *array, const double *x, int d)
{
    for (int k = 0; k < d; ++k)
        json_append(array, json_of_number(x[k]));
}

void cli_put_barycenter(json_t *object, const loxo_barycenter_info *info, int d)
{
    json_put_text(object, "class", loxo_barycenter_class_name(info->kind));
    append_all(json_put_array(object, "w"), info->w, d);
    append_all(json_put_array(object, "direction"), info->direction, d);
    json_put_number(object, "gap", info->gap);
    json_put_number(object, "radius", info->radius);
    json_put_number(object, "bound", info->bound);
    json_put_number(object, "frame_bound", info->frame_bound);
    json_put_number(object, "kantorovich_bound", info->kantorovich_bound);
    json_put_number(object, "wasserstein", info->wasserstein);
    json_put_number(object, "kantorovich_wasserstein", info->kantorovich_wasserstein);
    json_put_number(object, "lambda_min", info->lambda_min);
    json_put_number(object, "q", info->q);
    json_put_number(object, "residual", info->residual);
    json_put_integer(object, "iterations", info->n_iterations);
    json_put_text(object, "stop", loxo_barycenter_stop_name(info->stop_reason));
    json_put_number(object, "total_s", info->total_s);
    if (info->kind == LOXO_BARYCENTER_NOT_UNIQUE) {
        json_t *ends = json_put_array(object, "ends");
        for (int i = 0; i < 2; ++i) {
            json_t *end = json_array();
            append_all(end, info->end[i], d);
            json_append(ends, end);
        }
    }
}
