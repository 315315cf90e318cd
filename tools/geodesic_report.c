/* SPDX-License-Identifier: MIT */
#include "geodesic_report.h"

#include "base/os.h"

#include <math.h>

static const char *order_name(loxo_order order)
{
    const loxo_option *o = loxo_options_find(loxo_mesh_options, "order");
    for (int i = 0; o != NULL && o->choices[i] != NULL; ++i)
        if (i == (int)order) return o->choices[i];
    return "?";
}

static const char *stop_name(loxo_stop_reason reason)
{
    switch (reason) {
    case LOXO_STOP_TOLERANCE: return "tolerance";
    case LOXO_STOP_MAX_ITERATIONS: return "max iterations";
    case LOXO_STOP_MONITOR: return "stopped";
    }
    return "?";
}

void cli_report_mesh(cli_run *run, const loxo_mesh_info *info, const loxo_mesh_view *view)
{
    json_t *mesh = json_put_object(run->report.json, "mesh");
    json_put_integer(mesh, "n_vertices", view->n_vertices);
    json_put_integer(mesh, "n_faces", view->n_faces);
    json_put_integer(mesh, "n_parts", view->n_parts);
    json_put_text(mesh, "order", order_name(info->order));
    json_put_integer(mesh, "n_components", info->n_components);
    json_put_integer(mesh, "n_boundary_loops", info->n_boundary_loops);
    json_put_integer(mesh, "euler", info->euler);
    json_put_integer(mesh, "genus", info->genus);
    json_put_integer(mesh, "n_unreferenced", info->n_unreferenced);
    json_t *repair = json_put_object(mesh, "repair");
    json_put_integer(repair, "n_degenerate_dropped", info->repair.n_degenerate_dropped);
    json_put_integer(repair, "n_faces_turned", info->repair.n_faces_turned);
    json_put_integer(repair, "n_vertices_welded", info->repair.n_vertices_welded);
    json_put_integer(repair, "n_duplicate_faces_dropped", info->repair.n_duplicate_faces_dropped);
    json_put_integer(repair, "n_vertices_split", info->repair.n_vertices_split);
    json_put_integer(repair, "n_unreferenced_dropped", info->repair.n_unreferenced_dropped);
    json_put_integer(mesh, "mesh_bytes", (int64_t)info->mesh_bytes);
    json_put_integer(mesh, "order_bytes", (int64_t)info->order_bytes);
    json_put_integer(mesh, "peak_bytes", (int64_t)info->peak_bytes);
    json_put_number(mesh, "reorder_s", info->reorder_s);
    json_put_number(mesh, "halfedge_s", info->halfedge_s);
    json_put_number(mesh, "total_s", info->total_s);

    report_row(&run->report, "mesh", "%s component%s, genus %s, %s boundary loop%s", text_count(info->n_components),
               info->n_components == 1 ? "" : "s", text_count(info->genus), text_count(info->n_boundary_loops),
               info->n_boundary_loops == 1 ? "" : "s");
    report_row(&run->report, "half-edges", "%s, order %s", text_seconds(info->total_s), order_name(info->order));
}

static void put_info(json_t *json, const loxo_geodesic_info *i)
{
    json_put_text(json, "method", loxo_geodesic_method_name(i->method));
    json_put_text(json, "stop_reason", stop_name(i->stop_reason));
    json_put_integer(json, "n_iterations", i->n_iterations);
    json_put_integer(json, "n_evaluations", i->n_evaluations);
    json_put_number(json, "objective", i->objective);
    json_put_number(json, "residual", i->residual);
    json_t *phases = json_put_object(json, "phase_s");
    for (int p = 0; p < LOXO_GEODESIC_N_PHASES; ++p)
        json_put_number(phases, loxo_geodesic_phase_name((loxo_geodesic_phase)p), i->phase_s[p]);
    json_put_number(json, "total_s", i->total_s);
    json_put_integer(json, "workspace_bytes", (int64_t)i->workspace_bytes);
    json_put_integer(json, "peak_bytes", (int64_t)i->peak_bytes);
    json_put_number(json, "time", i->time);
    json_put_number(json, "mean_edge_length", i->mean_edge_length);
    json_put_integer(json, "n_sources", i->n_sources);
    json_put_integer(json, "n_levels", i->n_levels);
    json_put_integer(json, "max_window", i->max_window);
    json_put_bool(json, "diffusion_converged", i->diffusion_converged);
    json_put_number(json, "diffusion_change", i->diffusion_change);
    json_put_number(json, "dual_residual", i->dual_residual);
    json_put_integer(json, "n_constraints", i->n_constraints);
    json_put_integer(json, "n_constraints_left_out", i->n_constraints_left_out);
    json_put_number(json, "constraint_residual", i->constraint_residual);
    json_put_integer(json, "max_windows", i->max_windows);
    json_put_integer(json, "n_bends", i->n_bends);
    json_put_integer(json, "n_poisson_steps", i->n_poisson_steps);
    json_put_number(json, "poisson_residual", i->poisson_residual);
    json_put_integer(json, "n_lost_heat", i->n_lost_heat);
    json_put_number(json, "error_estimate", i->error_estimate);
    json_put_integer(json, "n_unreached", i->n_unreached);
    json_put_integer(json, "n_negative", i->n_negative);
    json_put_integer(json, "n_nonpositive_heat", i->n_nonpositive_heat);
    json_put_number(json, "breach_percentile_50", i->breach_percentile_50);
    json_put_number(json, "breach_percentile_90", i->breach_percentile_90);
    json_put_number(json, "breach_percentile_99", i->breach_percentile_99);
    json_put_number(json, "breach_max", i->breach_max);
    json_put_number(json, "gradient_share", i->gradient_share);
    json_put_number(json, "distance_max", i->distance_max);
    json_put_bool(json, "check_passed", i->check_passed);
}

/* "passed", or "FAILED for its gradient and negative distances"; by which conditions, in the JSON. */
static void judge(const loxo_geodesic_info *i, const loxo_geodesic_settings *settings, json_t *info, char *text,
                  size_t n_text)
{
    const bool is_of_ways = i->method == LOXO_GEODESIC_EXACT || i->method == LOXO_GEODESIC_FAST;
    const struct {
        const char *key, *what;
        bool is_broken;
    } conditions[] = {
        {"gradient_share", "its gradient", !is_of_ways && !(i->gradient_share <= settings->check_gradient_share)},
        {"breach_percentile_99", "breached edges", !(i->breach_percentile_99 <= settings->check_breach)},
        {"error_estimate", "the error it estimates", i->error_estimate > settings->check_estimate},
        {"n_negative", "negative distances", i->n_negative > 0},
    };
    const int n_conditions = (int)(sizeof conditions / sizeof *conditions);
    json_t *list = json_put_array(info, "check_failed_by");
    size_t used = (size_t)snprintf(text, n_text, "%s", i->check_passed ? "passed" : "FAILED");
    for (int k = 0; k < n_conditions && !i->check_passed; ++k) {
        if (!conditions[k].is_broken) continue;
        used += (size_t)snprintf(text + used, n_text - used, " %s %s", json_array_size(list) == 0 ? "for" : "and",
                                 conditions[k].what);
        json_append(list, json_string(conditions[k].key));
    }
}

/* Of small meshes the program itself is the larger part. */
#define FEW_VERTICES 10000

static void report_memory(cli_run *run, const loxo_geodesic_info *i, double n, double resident)
{
    const double program = resident > (double)run->program_bytes ? (double)run->program_bytes : resident;
    if (n >= FEW_VERTICES)
        report_row(&run->report, "memory", "%s peak, %.0f bytes a vertex; workspace %s", text_bytes(resident),
                   resident / n, text_bytes((double)i->workspace_bytes));
    else
        report_row(&run->report, "memory",
                   "%s peak, %s of it the program before; %.0f bytes a vertex besides; workspace %s",
                   text_bytes(resident), text_bytes(program), (resident - program) / n,
                   text_bytes((double)i->workspace_bytes));
}

void cli_report_geodesic(cli_run *run, const loxo_geodesic_info *i, const loxo_geodesic_settings *settings,
                         int64_t n_vertices)
{
    cli_report *out = &run->report;
    const double n = n_vertices > 0 ? (double)n_vertices : 1.0;
    const double resident = (double)loxo_os_peak_rss();
    char verdict[96];
    json_t *info = json_put_object(out->json, "info");
    put_info(info, i);
    judge(i, settings, info, verdict, sizeof verdict);
    json_put_number(info, "peak_resident_bytes_per_vertex", resident / n);

    report_row(out, "sources", "%s", text_count(i->n_sources));
    for (int p = 0; p < LOXO_GEODESIC_N_PHASES; ++p) {
        const char *name = loxo_geodesic_phase_name((loxo_geodesic_phase)p);
        if (p != LOXO_GEODESIC_PHASE_PREPARE && i->phase_s[p] == 0.0) continue; /* not of this method */
        if (p == LOXO_GEODESIC_PHASE_PROPAGATE && i->max_windows > 0)
            report_row(out, name, "%s, %.3g windows passed on a vertex, %s at most at once, %s vertices bent ways",
                       text_seconds(i->phase_s[p]), (double)i->n_evaluations / n, text_count(i->max_windows),
                       text_count(i->n_bends));
        else if (p == LOXO_GEODESIC_PHASE_PROPAGATE)
            report_row(out, name, "%s, %s rounds, %.3g updates a vertex", text_seconds(i->phase_s[p]),
                       text_count(i->n_iterations), (double)i->n_evaluations / n);
        else if (p == LOXO_GEODESIC_PHASE_POISSON && i->n_poisson_steps > 0)
            report_row(out, name, "%s, %s steps with all that followed, residual %.2g", text_seconds(i->phase_s[p]),
                       text_count(i->n_poisson_steps), i->poisson_residual);
        else if (p == LOXO_GEODESIC_PHASE_DIFFUSION && i->n_levels == 0)
            report_row(out, name, "%s, by factors", text_seconds(i->phase_s[p]));
        else if (p == LOXO_GEODESIC_PHASE_DIFFUSION)
            report_row(out, name, "%s, %s levels, window at most %s, %.3g updates a vertex, %s",
                       text_seconds(i->phase_s[p]), text_count(i->n_levels), text_count(i->max_window),
                       (double)i->n_evaluations / n,
                       i->diffusion_converged       ? "converged"
                       : isnan(i->diffusion_change) ? "not tested"
                                                    : "NOT converged");
        else if (p == LOXO_GEODESIC_PHASE_UNFOLD)
            report_row(out, name, "%s, %s passes", text_seconds(i->phase_s[p]), text_count(i->n_iterations));
        else if (p == LOXO_GEODESIC_PHASE_ADMM)
            report_row(out, name, "%s, %s iterations, residuals %.2g and %.2g", text_seconds(i->phase_s[p]),
                       text_count(i->n_iterations), i->residual, i->dual_residual);
        else
            report_row(out, name, "%s", text_seconds(i->phase_s[p]));
    }
    report_row(out, "solve", "%s", text_seconds(i->total_s));
    report_memory(run, i, n, resident);
    if (i->n_constraints > 0)
        report_row(out, "constraints", "%s, residual %.2g", text_count(i->n_constraints), i->constraint_residual);
    if (i->n_unreached > 0) report_row(out, "unreached", "%s vertices (infinity)", text_count(i->n_unreached));
    if (i->n_nonpositive_heat > 0)
        report_row(out, "heat", "not positive at %s vertices", text_count(i->n_nonpositive_heat));
    if (i->n_lost_heat > 0)
        report_row(out, "lost heat", "below the range of numbers at %s vertices", text_count(i->n_lost_heat));
    if (i->n_negative > 0)
        report_row(out, "negative", "%s vertices, by over a tenth of an edge", text_count(i->n_negative));
    report_row(out, "largest", "%.8g", i->distance_max);
    if (!isnan(i->error_estimate))
        report_row(out, "error", "about %.2g %% on average, or less", 100.0 * i->error_estimate);
    report_row(out, "answer", "%s: gradient off 1 by over 10 %% on %.2f %% of the area, breach 99 %% %.2g, max %.2g",
               verdict, 100.0 * i->gradient_share, i->breach_percentile_99, i->breach_max);
    if (!run->common->verbose) return;
    report_row(out, "breach", "50 %% %.3g, 90 %% %.3g, 99 %% %.3g, max %.3g", i->breach_percentile_50,
               i->breach_percentile_90, i->breach_percentile_99, i->breach_max);
    report_row(out, "diffusion", "time %.6g, mean edge length %.6g, change still to come %.2g", i->time,
               i->mean_edge_length, i->diffusion_change);
    if (i->phase_s[LOXO_GEODESIC_PHASE_ADMM] == 0.0) return;
    report_row(out, "ADMM", "objective %.6g, ended by %s", i->objective, stop_name(i->stop_reason));
}
