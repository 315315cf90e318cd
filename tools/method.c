/* SPDX-License-Identifier: MIT */
#include "method.h"

#include <string.h>

static const uint32_t all_methods = (1U << LOXO_GEODESIC_N_METHODS) - 1U;

/* "edge, face, variational" */
static void list_methods(uint32_t methods, char *text, size_t n_text)
{
    size_t used = 0;
    text[0] = '\0';
    for (int m = 0; m < LOXO_GEODESIC_N_METHODS && used < n_text; ++m)
        if ((methods & 1U << m) != 0)
            used += (size_t)snprintf(text + used, n_text - used, "%s%s", used > 0 ? ", " : "",
                                     loxo_geodesic_method_name((loxo_geodesic_method)m));
}

/* "--sweeps, --penalty": those given that not all methods have. Returns the methods that have them all. */
static uint32_t list_options(const cli_run *run, char *text, size_t n_text)
{
    uint32_t methods = all_methods;
    size_t used = 0;
    text[0] = '\0';
    for (const loxo_option *o = loxo_geodesic_options; o->name != NULL; ++o) {
        if (o->methods == 0 || !cli_args_has_option(&run->args, o)) continue;
        methods &= o->methods;
        if (used < n_text)
            used += (size_t)snprintf(text + used, n_text - used, "%s--%s", used > 0 ? ", " : "", o->name);
    }
    return methods;
}

/* Options that the method does not look at, or not with the others as they are. */
static void warn_of_idle(cli_run *run, const loxo_geodesic_settings *settings)
{
    char text[96];
    for (const loxo_option *o = loxo_geodesic_options; o->name != NULL; ++o) {
        if (!cli_args_has_option(&run->args, o)) continue;
        const char *need = loxo_option_unmet(loxo_geodesic_options, o, settings);
        if (!loxo_option_is_of_method(loxo_geodesic_options, o, settings)) {
            list_methods(o->methods, text, sizeof text);
            cli_warn(run, 1, "--%s changes nothing in method %s; it is an option of %s", o->name,
                     loxo_geodesic_method_name(settings->method), text);
        } else if (need != NULL) {
            const int n_name = (int)strcspn(need, "=");
            cli_warn(run, 1, "--%s changes nothing without --%.*s %s", o->name, n_name, need, need + n_name + 1);
        }
    }
}

loxo_status cli_method_by_options(cli_run *run, loxo_geodesic_settings *settings, cli_method *method)
{
    char options[128], methods[96];
    *method = (cli_method){.is_auto = settings->method == LOXO_GEODESIC_AUTO};
    if (!method->is_auto) {
        warn_of_idle(run, settings);
        return LOXO_OK;
    }
    const uint32_t left = list_options(run, options, sizeof options);
    const bool is_one = strchr(options, ',') == NULL;
    if (left == all_methods) return LOXO_OK;
    if (left == 0) return cli_fail(run, LOXO_ERR_ARGUMENT, "%s: no method has all of %s", run->command->name, options);
    list_methods(left, methods, sizeof methods);
    (void)snprintf(method->because, sizeof method->because, "%s %s of %s", options,
                   is_one ? "is an option" : "are options", methods);
    int first = 0;
    while ((left & 1U << first) == 0)
        ++first;
    settings->method = (loxo_geodesic_method)first;
    warn_of_idle(run, settings);
    return LOXO_OK;
}

/* Whether mesh, an intrinsic triangulation of it and the solve fit together. */
static bool intrinsic_fits(const cli_run *run, const loxo_mesh *mesh, const loxo_geodesic_settings *settings,
                           const loxo_intrinsic_settings *intrinsic)
{
    const loxo_memory memory = loxo_context_memory(run->ctx);
    const int64_t n = loxo_mesh_n_vertices(mesh), n_faces = loxo_mesh_n_faces(mesh);
    size_t held = 0, peak = 0, workspace = 0;
    loxo_mesh_estimate_intrinsic(n, n_faces, intrinsic, &held, &peak);
    if (loxo_geodesic_estimate(run->ctx, n, n_faces, settings, &workspace, NULL) < 0) return false;
    const size_t solve = held + workspace + sizeof(double) * (size_t)n;
    return memory.current_bytes + (peak > solve ? peak : solve) <= memory.limit_bytes;
}

loxo_status cli_method_by_mesh(cli_run *run, cli_method *method, const loxo_mesh *mesh, int64_t n_solves,
                               loxo_geodesic_settings *settings, const loxo_intrinsic_settings *intrinsic,
                               bool *is_intrinsic)
{
    loxo_geodesic_choice choice;
    const loxo_status status = loxo_geodesic_choose(run->ctx, mesh, settings, n_solves, &choice);
    if (status < 0) return status;
    method->share_nondelaunay = choice.share_nondelaunay;
    method->is_intrinsic_worth = choice.intrinsic;
    if (!method->is_auto) return LOXO_OK;
    if (settings->method == LOXO_GEODESIC_AUTO) {
        settings->method = choice.method;
        warn_of_idle(run, settings);
    }
    const bool is_worth = choice.intrinsic && is_intrinsic != NULL;
    const bool fits = !is_worth || intrinsic_fits(run, mesh, settings, intrinsic);
    const char *name = loxo_geodesic_method_name(choice.method);
    const bool is_asked = is_intrinsic != NULL && *is_intrinsic, is_made = is_asked || (is_worth && fits);
    const char *because = method->because[0] != '\0' ? method->because : choice.reason;
    char triangles[128] = "";
    if (is_worth)
        (void)snprintf(triangles, sizeof triangles, "; %.0f %% of the edges are not Delaunay%s",
                       100.0 * choice.share_nondelaunay,
                       fits ? "" : ", but a triangulation for that does not fit into memory");
    if (is_intrinsic != NULL) *is_intrinsic = is_made;
    report_row(&run->report, "method", "%s%s: %s%s", name, is_made ? ", intrinsic" : "", because, triangles);
    json_t *json = json_put_object(run->report.json, "choice");
    json_put_text(json, "method", name);
    json_put_bool(json, "intrinsic", is_made);
    json_put_number(json, "share_nondelaunay", choice.share_nondelaunay);
    json_put_text(json, "reason", because);
    return LOXO_OK;
}

/* Share of bad edges from which flips may be what a failed answer lacks. */
#define SHARE_FOR_FAILED 0.01

void cli_method_hint(cli_run *run, const cli_method *method, loxo_geodesic_method solved_with, loxo_status status)
{
    const bool is_bad = status == LOXO_CHECK_FAILED || status == LOXO_NOT_CONVERGED;
    const bool may_help = is_bad && method->share_nondelaunay > SHARE_FOR_FAILED;
    const bool is_worth = method->is_intrinsic_worth && !method->is_auto; /* auto makes one, where it fits */
    if (solved_with == LOXO_GEODESIC_EXACT || !(is_worth || may_help)) return;
    report_row(&run->report, "hint", "%.2g %% of the edges are not Delaunay: --intrinsic %s",
               100.0 * method->share_nondelaunay,
               is_bad ? "may mend the answer" : "makes distances better on such triangles");
}
