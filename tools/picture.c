/* SPDX-License-Identifier: MIT */
#include "picture.h"

#include "base/os.h"

/* By the order and not by the origin: of vertices that were welded every one gets its position back. */
static void take_positions(const loxo_mesh_view *view, const loxo_index *order, loxo_soup *soup)
{
    const int64_t n = 3 * soup->n_vertices;
    if (view->position != NULL && soup->position != NULL)
        for (int64_t i = 0; i < n; ++i)
            soup->position[i] = view->position[order[i / 3]][i % 3];
    if (view->position_float != NULL && soup->position_float != NULL)
        for (int64_t i = 0; i < n; ++i)
            soup->position_float[i] = view->position_float[order[i / 3]][i % 3];
}

loxo_status cli_soup_of_mesh(cli_run *run, const loxo_mesh *mesh, loxo_soup *soup)
{
    const loxo_mesh_view view = loxo_mesh_get_view(mesh);
    const int64_t n_vertices = loxo_mesh_n_vertices(mesh), n_corners = 3 * view.n_faces;
    loxo_index *order = loxo_allocate(run->ctx, n_vertices, sizeof *order);
    loxo_status status = LOXO_ERR_MEMORY;
    *soup = (loxo_soup){.n_vertices = n_vertices, .n_faces = view.n_faces};
    soup->triangle = loxo_allocate(run->ctx, n_corners, sizeof *soup->triangle);
    if (view.position != NULL)
        soup->position = loxo_allocate(run->ctx, 3 * n_vertices, sizeof *soup->position);
    else
        soup->position_float = loxo_allocate(run->ctx, 3 * n_vertices, sizeof *soup->position_float);
    if (order == NULL || soup->triangle == NULL || (soup->position == NULL && soup->position_float == NULL)) goto fail;
    if ((status = loxo_mesh_vertex_order(mesh, order)) < 0) goto fail;
    take_positions(&view, order, soup);
    for (int64_t h = 0; h < n_corners; ++h) {
        const loxo_index v = view.halfedge_vertex[h];
        soup->triangle[h] = view.vertex_origin != NULL ? view.vertex_origin[v] : v;
    }
    loxo_release(run->ctx, order);
    return LOXO_OK;
fail:
    loxo_release(run->ctx, order);
    loxo_soup_destroy(run->ctx, soup);
    return status;
}

loxo_status cli_picture(cli_run *run, const loxo_soup *soup, const double *value, const loxo_draw_settings *settings,
                        const char *path)
{
    const double start_s = loxo_os_clock_s();
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    const loxo_status status = loxo_draw_png(run->ctx, &arrays, value, settings, path);
    if (status < 0) return status;
    (void)cli_seconds(run, "draw", start_s);
    cli_wrote(run, path);
    return status;
}
