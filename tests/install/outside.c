/* SPDX-License-Identifier: MIT
 * A C program outside the project: distances on a flat square from its own arrays. Prints the largest error. */
#include <loxo/loxo.h>

#include <math.h>
#include <stdio.h>

enum { SIDE = 41, N_VERTICES = SIDE * SIDE, N_FACES = 2 * (SIDE - 1) * (SIDE - 1) };

static double position[N_VERTICES][3];
static loxo_index triangle[N_FACES][3];
static double distance[N_VERTICES];

static void make_square(void)
{
    int n = 0;
    for (int y = 0; y < SIDE; ++y) {
        for (int x = 0; x < SIDE; ++x) {
            position[y * SIDE + x][0] = x;
            position[y * SIDE + x][1] = y;
        }
    }
    for (int y = 0; y + 1 < SIDE; ++y) {
        for (int x = 0; x + 1 < SIDE; ++x) {
            const loxo_index a = (loxo_index)(y * SIDE + x), b = (loxo_index)(a + 1), c = (loxo_index)(a + SIDE),
                             d = (loxo_index)(c + 1);
            const loxo_index pair[2][2][3] = {{{a, b, d}, {a, d, c}}, {{a, b, c}, {b, d, c}}};
            for (int i = 0; i < 2; ++i, ++n)
                for (int k = 0; k < 3; ++k)
                    triangle[n][k] = pair[(x + y) % 2][i][k];
        }
    }
}

static int report(const loxo_context *ctx, loxo_status status)
{
    fprintf(stderr, "%s: %s\n", loxo_status_name(status), ctx == NULL ? "" : loxo_context_failure(ctx)->text);
    return 1;
}

int main(void)
{
    const loxo_index source = N_VERTICES / 2;
    loxo_mesh_arrays arrays = {.n_vertices = N_VERTICES, .n_faces = N_FACES};
    loxo_mesh_settings settings = loxo_mesh_settings_default();
    loxo_context *ctx = NULL;
    loxo_mesh *mesh = NULL;
    loxo_geodesic_info info;
    double worst = 0.0;
    loxo_status status;

    make_square();
    arrays.position = &position[0][0];
    arrays.triangle = &triangle[0][0];
    if ((status = loxo_context_create(NULL, &ctx)) < 0) return report(NULL, status);
    if ((status = loxo_mesh_create(ctx, &arrays, LOXO_COPY, &settings, NULL, &mesh)) < 0) return report(ctx, status);
    status = loxo_geodesic_distance(ctx, mesh, NULL, &source, 1, distance, &info);
    if (status < 0) return report(ctx, status);
    for (int v = 0; v < N_VERTICES; ++v) {
        const double exact = hypot(position[v][0] - position[source][0], position[v][1] - position[source][1]);
        if (!(fabs(distance[v] - exact) <= worst)) worst = fabs(distance[v] - exact);
    }
    loxo_mesh_destroy(mesh);
    loxo_context_destroy(ctx);
    printf("loxo %s: %d vertices, farthest %.3f, largest error %.3f\n", loxo_version(), N_VERTICES, info.distance_max,
           worst);
    return worst < 0.1 * info.distance_max ? 0 : 1; /* a coarse lattice: a few percent */
}
