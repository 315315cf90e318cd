/* SPDX-License-Identifier: MIT
 * Exact polyhedral distances against closed forms. */
#include "surfaces.h"

#include <loxo/geodesic.h>

static loxo_geodesic_settings exact_settings(void)
{
    loxo_geodesic_settings settings = loxo_geodesic_settings_default();
    settings.method = LOXO_GEODESIC_EXACT;
    return settings;
}

/* On a convex plane the distance is that through the air, whatever the triangles: rounding only, some 1e3 faces. */
TEST(planes_are_flat)
{
    static const loxo_shape shapes[] = {LOXO_SHAPE_DISK, LOXO_SHAPE_GRID, LOXO_SHAPE_STRIP};
    const loxo_geodesic_settings settings = exact_settings();
    for (int i = 0; i < 3; ++i) {
        surface s = surface_make(test_context, shapes[i], 2000, NAN);
        double *distance = loxo_allocate(test_context, s.soup.n_vertices, sizeof *distance);
        const loxo_index source = (loxo_index)(s.soup.n_vertices / 3);
        const double *a = &s.soup.position[3 * source];
        CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &settings, &source, 1, distance, NULL));
        for (int64_t v = 0; v < s.soup.n_vertices; ++v) {
            const double *p = &s.soup.position[3 * v];
            const double d = hypot(p[0] - a[0], p[1] - a[1]);
            CHECK_NEAR(distance[v], d, 1e-13 * (d + 1.0));
        }
        loxo_release(test_context, distance);
        surface_destroy(&s);
    }
}
