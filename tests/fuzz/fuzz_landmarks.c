/* SPDX-License-Identifier: MIT
 * Landmarks: borders of Connectome Workbench, and lines of text. */
#include "harness.h"
#include "io/landmarks.h"

#define N_VERTICES 100

static void fuzz_one(loxo_context *ctx, const uint8_t *bytes, size_t n)
{
    loxo_landmarks l = {0};
    const loxo_status status = loxo_read_landmarks_bytes(ctx, bytes, n, "input", N_VERTICES, &l);
    fuzz_check_status(ctx, status);
    FUZZ_PLANT(status >= 0 && l.n_curves == 2 && l.is_closed[1]);
    FUZZ_CHECK((status >= 0) == (l.n_curves > 0));
    for (int64_t c = 0; c < l.n_curves; ++c) {
        FUZZ_CHECK(l.curve_begin[c] < l.curve_begin[c + 1] && l.curve_begin[c + 1] <= l.n_points);
        FUZZ_CHECK(memchr(l.name[c], 0, sizeof l.name[c]) != NULL && l.name[c][0] != '\0');
    }
    for (int64_t i = 0; i < l.n_points; ++i) {
        const loxo_surface_point *p = &l.point[i];
        double sum = 0.0;
        for (int k = 0; k < 3; ++k) {
            FUZZ_CHECK(p->vertex[k] >= -1 && p->vertex[k] < N_VERTICES);
            FUZZ_CHECK(l.position[i][k] - l.position[i][k] == 0.0);
            if (p->vertex[k] < 0) continue;
            FUZZ_CHECK(p->weight[k] >= 0.0);
            sum += p->weight[k];
        }
        FUZZ_CHECK(p->vertex[0] < 0 || (sum > 0.999999 && sum < 1.000001));
    }
    loxo_landmarks_destroy(ctx, &l);
}
