/* SPDX-License-Identifier: MIT
 * Gauss and Bonnet: what the angles around the vertices lack of a full turn, at a boundary of a half one, adds up to 2 pi
 * times the Euler number, whatever the surface looks like. Holds together positions, triangles, the topology of the
 * report and that of the mesh. */
#include "../solver/surfaces.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

static double angle_at(const double *a, const double *b, const double *c)
{
    double u[3], v[3], cross[3], dot = 0.0;
    for (int i = 0; i < 3; ++i) {
        u[i] = b[i] - a[i];
        v[i] = c[i] - a[i];
        dot += u[i] * v[i];
    }
    for (int i = 0; i < 3; ++i)
        cross[i] = u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3];
    return atan2(sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]), dot);
}

/* Sum of the angle defects, by the mesh's own half-edges. */
static double total_defect(const loxo_mesh_view *m)
{
    double sum = 0.0;
    for (int64_t v = 0; v < m->n_vertices; ++v) {
        const loxo_index first = m->vertex_halfedge[v];
        loxo_index h = first;
        double angles = 0.0;
        if (first < 0) continue;
        do {
            const loxo_index *corner = &m->halfedge_vertex[h - h % 3];
            const int k = h % 3;
            angles +=
                angle_at(m->position[corner[k]], m->position[corner[(k + 1) % 3]], m->position[corner[(k + 2) % 3]]);
            h = m->halfedge_twin[h - k + (k + 2) % 3];
        } while (h >= 0 && h != first);
        sum += (h < 0 ? pi : 2.0 * pi) - angles;
    }
    return sum;
}

static void check_shape(loxo_shape shape, double param, int64_t euler)
{
    surface s = surface_make(test_context, shape, 3000, param);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    loxo_mesh_report report;
    CHECK_OK(loxo_mesh_check(test_context, &s.arrays, &report));
    CHECK_EQUAL(report.euler, euler);
    CHECK_EQUAL(2 - 2 * m.genus - m.n_boundary_loops, euler);
    /* About 18000 angles, each to a few roundings of pi. */
    CHECK_NEAR(total_defect(&m), 2.0 * pi * (double)euler, 1e-9);
    surface_destroy(&s);
}

TEST(closed_surfaces)
{
    check_shape(LOXO_SHAPE_ICOSPHERE, NAN, 2);
    check_shape(LOXO_SHAPE_ELLIPSOID, NAN, 2);
    check_shape(LOXO_SHAPE_NOISY, NAN, 2);
    check_shape(LOXO_SHAPE_BRAIN, NAN, 2);
    check_shape(LOXO_SHAPE_TORUS, NAN, 0);
    for (int genus = 1; genus <= 16; genus *= 2)
        check_shape(LOXO_SHAPE_GENUS, genus, 2 - 2 * genus);
}

TEST(open_surfaces)
{
    check_shape(LOXO_SHAPE_DISK, NAN, 1);
    check_shape(LOXO_SHAPE_GRID, NAN, 1);
    check_shape(LOXO_SHAPE_STRIP, NAN, 1);
    check_shape(LOXO_SHAPE_CYLINDER, NAN, 0);
    check_shape(LOXO_SHAPE_ANNULUS, NAN, 0);
}

/* Holes in a surface of genus 3: each takes one off the Euler number. */
TEST(surfaces_with_holes)
{
    loxo_soup soup = soup_make(test_context, LOXO_SHAPE_GENUS, 3000, 3);
    const int64_t n_faces = soup.n_faces;
    loxo_mesh_info info;
    for (int n_holes = 1; n_holes <= 4; ++n_holes) {
        loxo_mesh *mesh;
        loxo_index *last = &soup.triangle[3 * (soup.n_faces - 1)], *hole = &soup.triangle[3 * (n_holes * n_faces / 6)];
        memcpy(hole, last, 3 * sizeof *hole); /* faces far from each other */
        soup.n_faces -= 1;
        const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
        CHECK_OK(loxo_mesh_create(test_context, &arrays, LOXO_BORROW, NULL, &info, &mesh));
        const loxo_mesh_view m = loxo_mesh_get_view(mesh);
        CHECK_EQUAL(info.euler, -4 - n_holes);
        CHECK_EQUAL(info.n_boundary_loops, n_holes);
        CHECK_EQUAL(info.genus, 3);
        CHECK_NEAR(total_defect(&m), 2.0 * pi * (double)info.euler, 1e-9);
        loxo_mesh_destroy(mesh);
    }
    soup.n_faces = n_faces;
    loxo_soup_destroy(test_context, &soup);
}
