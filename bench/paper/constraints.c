/* SPDX-License-Identifier: MIT
 * What Figures 7 and 8 share: both methods with and without the global conditions (23)-(26), at several numbers of
 * iterations. */
#include "paper.h"

#include <stdio.h>

loxo_status paper_with_and_without(paper_subject *s, const char *name, const loxo_index *sources, int64_t n_sources,
                                   bench_table *table)
{
    static const char *const methods[2] = {"edge", "face"};
    static const int iterations[] = {10, 100, 1000};
    loxo_status status = LOXO_OK;
    for (int m = 0; m < 2; ++m)
        for (size_t i = 0; i < sizeof iterations / sizeof iterations[0]; ++i) {
            double error[2], seconds[2];
            loxo_geodesic_info info[2];
            char text[2][32], time[2][32];
            for (int on = 0; on < 2; ++on) {
                char method[128], title[128], suffix[64];
                snprintf(method, sizeof method, "%s,iterations=%d,global-constraints=%s", methods[m], iterations[i],
                         on == 1 ? "true" : "false");
                if ((status = paper_subject_solve(s, method, sources, n_sources, &info[on])) < 0) return status;
                error[on] = paper_subject_error(s, s->truth);
                seconds[on] = info[on].total_s;
                bench_record(s->b, "constraints",
                             json_pack("{s:s, s:s, s:i, s:b, s:o, s:I, s:f, s:f}", "mesh", name, "method", methods[m],
                                       "iterations", iterations[i], "global_constraints", on, "mean_relative",
                                       paper_json(error[on]), "n_constraints", (json_int_t)info[on].n_constraints,
                                       "constraint_residual", info[on].constraint_residual, "seconds", seconds[on]));
                if (m != 1 || iterations[i] != 10) continue; /* the paper's: face-based, 10 iterations */
                snprintf(title, sizeof title, "%s, face-based, %s the conditions, error %s", name,
                         on == 1 ? "with" : "without", paper_percent(error[on], text[0], 32));
                snprintf(suffix, sizeof suffix, "%s", on == 1 ? "with" : "without");
                if ((status = paper_picture(s, suffix, title)) < 0) return status;
            }
            bench_table_row(table, "%s|%lld|%s|%d|%s|%s|%lld|%s|%s", name, (long long)s->soup.n_vertices, methods[m],
                            iterations[i], paper_percent(error[0], text[0], 32), paper_percent(error[1], text[1], 32),
                            (long long)info[1].n_constraints, paper_number(seconds[0], time[0], 32),
                            paper_number(seconds[1], time[1], 32));
        }
    return LOXO_OK;
}
