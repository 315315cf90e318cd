/* SPDX-License-Identifier: MIT */
#include "intrinsic.h"

static void put_info(json_t *json, const loxo_intrinsic_info *i)
{
    json_put_integer(json, "n_edges", i->n_edges);
    json_put_integer(json, "n_flips", i->n_flips);
    json_put_number(json, "share_nondelaunay_before", i->share_nondelaunay_before);
    json_put_number(json, "share_nondelaunay_after", i->share_nondelaunay_after);
    json_put_number(json, "quality_before", i->quality_before);
    json_put_number(json, "quality_after", i->quality_after);
    json_put_number(json, "lengthened", i->lengthened);
    json_put_integer(json, "n_loops", i->n_loops);
    json_put_integer(json, "mesh_bytes", (int64_t)i->mesh_bytes);
    json_put_integer(json, "peak_bytes", (int64_t)i->peak_bytes);
    json_put_number(json, "seconds", i->seconds);
}

loxo_status cli_make_intrinsic(cli_run *run, const loxo_mesh *surface, const loxo_intrinsic_settings *settings,
                               loxo_mesh **out)
{
    loxo_intrinsic_info info = {0};
    cli_report *report = &run->report;
    const loxo_status status = loxo_mesh_create_intrinsic(run->ctx, surface, settings, &info, out);
    if (status < 0) return status;
    put_info(json_put_object(report->json, "intrinsic"), &info);
    report_row(report, "intrinsic", "%s, %s flips, non-Delaunay edges %.2f %% to %.2f %%, quality %.4f to %.4f",
               text_seconds(info.seconds), text_count(info.n_flips), 100.0 * info.share_nondelaunay_before,
               100.0 * info.share_nondelaunay_after, info.quality_before, info.quality_after);
    if (info.lengthened > 0.0) report_row(report, "flat faces", "all edges made longer by %.3g", info.lengthened);
    return cli_combine(run, status);
}
