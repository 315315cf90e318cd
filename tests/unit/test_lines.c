/* SPDX-License-Identifier: MIT
 * Isolines: circles where they must be, loops that close to the bit, values that vertices have exactly. */
#include "../solver/surfaces.h"

#include <loxo/io.h>
#include <loxo/lines.h>

static double *field_of(const surface *s, double (*f)(const double *x))
{
    double *field = surface_numbers(s);
    for (int64_t v = 0; v < s->soup.n_vertices; ++v)
        field[v] = f(&s->soup.position[3 * v]);
    return field;
}

static double radius(const double *x) { return sqrt(x[0] * x[0] + x[1] * x[1]); }

static double height(const double *x) { return x[2]; }

/* Half-edges of the soup by the vertex where they start: [begin[v], begin[v + 1]). */
typedef struct corners {
    int64_t *begin, *halfedge;
} corners;

static corners corners_of(const surface *s)
{
    const int64_t n = s->soup.n_vertices, n_halfedges = 3 * s->soup.n_faces;
    corners c = {loxo_allocate(s->ctx, n + 2, sizeof(int64_t)), loxo_allocate(s->ctx, n_halfedges, sizeof(int64_t))};
    memset(c.begin, 0, (size_t)(n + 2) * sizeof *c.begin);
    for (int64_t h = 0; h < n_halfedges; ++h)
        ++c.begin[s->soup.triangle[h] + 2];
    for (int64_t v = 0; v < n; ++v)
        c.begin[v + 2] += c.begin[v + 1];
    for (int64_t h = 0; h < n_halfedges; ++h)
        c.halfedge[c.begin[s->soup.triangle[h] + 1]++] = h;
    return c;
}

/* Whether one face has all vertices of both points. */
static bool share_a_face(const surface *s, const corners *c, const loxo_surface_point *p, const loxo_surface_point *q)
{
    loxo_index first = -1;
    for (int k = 0; k < 3 && first < 0; ++k)
        first = p->vertex[k];
    for (int64_t i = c->begin[first]; i < c->begin[first + 1]; ++i) {
        const loxo_index *corner = &s->soup.triangle[c->halfedge[i] / 3 * 3];
        bool has_all = true;
        for (int k = 0; k < 6; ++k) {
            const loxo_index v = k < 3 ? p->vertex[k] : q->vertex[k - 3];
            has_all = has_all && (v < 0 || v == corner[0] || v == corner[1] || v == corner[2]);
        }
        if (has_all) return true;
    }
    return false;
}

/* What every set of lines keeps: neighbours in one face or at one edge, closed ones closed to the bit, positions that are
 * those of the points, and no point twice in a row. */
static void check_lines(const surface *s, const loxo_polylines *l)
{
    const corners c = corners_of(s);
    CHECK_EQUAL(l->line_begin[0], 0);
    CHECK_EQUAL(l->line_begin[l->n_lines], l->n_points);
    for (int64_t i = 0; i < l->n_lines; ++i) {
        const int64_t begin = l->line_begin[i], end = l->line_begin[i + 1];
        CHECK(end - begin >= (l->is_closed[i] ? 3 : 2));
        if (l->is_closed[i]) CHECK(memcmp(l->position[begin], l->position[end - 1], sizeof l->position[0]) == 0);
        for (int64_t p = begin; p < end; ++p) {
            double x[3] = {0.0, 0.0, 0.0};
            for (int k = 0; k < 3; ++k)
                for (int j = 0; j < 3 && l->point[p].vertex[k] >= 0; ++j)
                    x[j] += l->point[p].weight[k] * s->soup.position[3 * l->point[p].vertex[k] + j];
            CHECK_NEAR3(x, l->position[p], 1e-14);
            if (p > begin) CHECK(memcmp(l->position[p], l->position[p - 1], sizeof x) != 0);
            if (p > begin) CHECK(share_a_face(s, &c, &l->point[p - 1], &l->point[p]));
        }
    }
    loxo_release(s->ctx, c.begin);
    loxo_release(s->ctx, c.halfedge);
}

/* The polygon through chords of length e on a circle of radius r is shorter than it by (e / r)^2 / 24; the field's linear
 * interpolation puts its corners off by h^2 / (8 r). */
TEST(circles_on_a_disk)
{
    NEEDS_IDS(6 * 20000);
    double before = 1.0;
    for (int64_t n = 1250; n <= 20000; n *= 4) {
        static const double level[] = {0.3, 0.55, 0.8};
        surface s = surface_make(test_context, LOXO_SHAPE_DISK, n, NAN);
        double *field = field_of(&s, radius), worst = 0.0;
        loxo_polylines lines;
        CHECK_OK(loxo_isolines(test_context, s.mesh, field, level, 3, &lines));
        check_lines(&s, &lines);
        CHECK_EQUAL(lines.n_lines, 3);
        for (int i = 0; i < 3; ++i) {
            const double circle = 2.0 * acos(-1.0) * level[i];
            CHECK(lines.is_closed[i]);
            CHECK_EQUAL(lines.value[i], level[i]);
            worst = fmax(worst, fabs(loxo_polyline_length(&lines, i) - circle) / circle);
        }
        print_message("%lld vertices: length off by %.2e\n", (long long)n, worst);
        CHECK(worst < 0.35 * before); /* four times the vertices: a fourth */
        before = worst;
        loxo_polylines_destroy(test_context, &lines);
        loxo_release(test_context, field);
        surface_destroy(&s);
    }
    CHECK(before < 2e-4);
}

/* On a sphere every height has one loop; it has what is above on its right. */
TEST(heights_of_a_sphere)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 2000, NAN);
    double *field = field_of(&s, height), level[39];
    loxo_polylines lines;
    for (int i = 0; i < 39; ++i)
        level[i] = -0.95 + 0.05 * i;
    CHECK_OK(loxo_isolines(test_context, s.mesh, field, level, 39, &lines));
    check_lines(&s, &lines);
    CHECK_EQUAL(lines.n_lines, 39);
    for (int64_t i = 0; i < 39; ++i) {
        double turn = 0.0;
        CHECK(lines.is_closed[i]);
        for (int64_t p = lines.line_begin[i]; p + 1 < lines.line_begin[i + 1]; ++p) {
            const double *a = lines.position[p], *b = lines.position[p + 1];
            CHECK_NEAR(a[2], level[i], 1e-14);
            turn += a[0] * b[1] - a[1] * b[0];
        }
        CHECK(turn < 0.0); /* clockwise seen from above: up is on the right */
    }
    loxo_polylines_destroy(test_context, &lines);
    loxo_release(test_context, field);
    surface_destroy(&s);
}

/* Whole numbers on a grid: at whole levels lines run through vertices and along edges, and still each is a loop or ends
 * at the boundary twice. */
TEST(levels_that_vertices_have)
{
    surface s = surface_make(test_context, LOXO_SHAPE_GRID, 900, NAN);
    double *field = surface_numbers(&s);
    static const double level[] = {0.0, 1.0, 2.0, 3.0, 4.0, 4.0};
    loxo_polylines lines;
    for (int seed = 0; seed < 20; ++seed) {
        for (int64_t v = 0; v < s.soup.n_vertices; ++v)
            field[v] = (double)(((uint64_t)v * 2654435761u + (uint64_t)seed * 40503u) >> 7 & 3) + 1.0;
        CHECK_OK(loxo_isolines(test_context, s.mesh, field, level, 6, &lines));
        check_lines(&s, &lines);
        for (int64_t i = 0; i < lines.n_lines; ++i) {
            CHECK(lines.value[i] > 1.0); /* nothing is below the least value */
            for (int side = 0; side < 2 && !lines.is_closed[i]; ++side) {
                const double *x = lines.position[side == 0 ? lines.line_begin[i] : lines.line_begin[i + 1] - 1];
                CHECK(x[0] == 0.0 || x[1] == 0.0 || x[0] == 1.0 || x[1] == 1.0);
            }
        }
        loxo_polylines_destroy(test_context, &lines);
    }
    loxo_release(test_context, field);
    surface_destroy(&s);
}

/* A plateau has its line on the lower side only; a single top vertex at the level has none. */
TEST(plateaus_and_tops)
{
    static const double position[21] = {0, 0, 0, 1, 0, 0, 0.5, 1, 0, -0.5, 1, 0, -1, 0, 0, -0.5, -1, 0, 0.5, -1, 0};
    static const loxo_index triangle[18] = {0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 5, 0, 5, 6, 0, 6, 1};
    static const double top[7] = {1, 0, 0, 0, 0, 0, 0}, plateau[7] = {1, 1, 1, 0, 0, 0, 0}, one = 1.0, none = 0.0;
    surface s = surface_small(test_context, 7, position, 6, triangle);
    loxo_polylines lines;
    CHECK_OK(loxo_isolines(test_context, s.mesh, top, &one, 1, &lines));
    CHECK_EQUAL(lines.n_lines, 0);
    loxo_polylines_destroy(test_context, &lines);
    CHECK_OK(loxo_isolines(test_context, s.mesh, top, &none, 1, &lines));
    CHECK_EQUAL(lines.n_lines, 0); /* nothing is below */
    loxo_polylines_destroy(test_context, &lines);
    CHECK_OK(loxo_isolines(test_context, s.mesh, plateau, &one, 1, &lines));
    CHECK_EQUAL(lines.n_lines, 1);
    check_lines(&s, &lines);
    CHECK_NEAR(loxo_polyline_length(&lines, 0), 1.0 + sqrt(1.25), 1e-15); /* 1 0 2, along edges */
    loxo_polylines_destroy(test_context, &lines);
    surface_destroy(&s);
}

TEST(infinite_values_are_left_out)
{
    surface s = surface_make(test_context, LOXO_SHAPE_GRID, 400, NAN);
    double *field = surface_numbers(&s);
    const double level = 0.5;
    loxo_polylines lines;
    for (int64_t v = 0; v < s.soup.n_vertices; ++v)
        field[v] = s.soup.position[3 * v + 1] > 0.7 ? HUGE_VAL : s.soup.position[3 * v];
    CHECK_OK(loxo_isolines(test_context, s.mesh, field, &level, 1, &lines));
    check_lines(&s, &lines);
    CHECK_EQUAL(lines.n_lines, 1);
    for (int64_t p = 0; p < lines.n_points; ++p)
        CHECK(lines.position[p][1] <= 0.7);
    loxo_polylines_destroy(test_context, &lines);
    loxo_release(test_context, field);
    surface_destroy(&s);
}

static loxo_status trace(loxo_context *ctx, void *arg)
{
    const surface *s = arg;
    loxo_mesh *mesh = NULL;
    loxo_polylines lines = {0};
    double field[1000];
    const double level[2] = {0.31, 0.62};
    for (int64_t v = 0; v < s->soup.n_vertices; ++v)
        field[v] = s->soup.position[3 * v];
    loxo_status status = loxo_mesh_create(ctx, &s->arrays, LOXO_BORROW, NULL, NULL, &mesh);
    if (status >= 0) status = loxo_isolines(ctx, mesh, field, level, 2, &lines);
    loxo_polylines_destroy(ctx, &lines);
    loxo_mesh_destroy(mesh);
    return status;
}

TEST(each_allocation_fails)
{
    surface s = surface_make(test_context, LOXO_SHAPE_GRID, 400, NAN);
    CHECK(test_each_allocation_fails(trace, &s) > 8);
    surface_destroy(&s);
}

TEST(what_has_no_isolines)
{
    surface s = surface_make(test_context, LOXO_SHAPE_GRID, 100, NAN);
    double *field = field_of(&s, radius);
    const double level[2] = {0.1, NAN};
    loxo_polylines lines;
    CHECK_STATUS(test_context, loxo_isolines(test_context, s.mesh, field, level, 2, &lines), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 1);
    CHECK(lines.line_begin == NULL);
    CHECK_STATUS(test_context, loxo_isolines(test_context, s.mesh, NULL, level, 1, &lines), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_isolines(test_context, NULL, field, level, 1, &lines), LOXO_ERR_ARGUMENT);
    CHECK_OK(loxo_isolines(test_context, s.mesh, field, NULL, 0, &lines));
    CHECK_EQUAL(lines.n_lines, 0);
    CHECK_OK(loxo_write_polylines(test_context, test_scratch("none.obj"), &lines));
    loxo_polylines_destroy(test_context, &lines);
    loxo_polylines_destroy(test_context, NULL);
    loxo_release(test_context, field);
    surface_destroy(&s);
}

static int64_t count_in_file(const char *path, const char *word)
{
    char text[65536];
    FILE *file = fopen(path, "rb");
    CHECK(file != NULL);
    const size_t n = fread(text, 1, sizeof text - 1, file);
    CHECK(fclose(file) == 0 && n < sizeof text - 1);
    text[n] = '\0';
    int64_t count = 0;
    for (const char *at = text; (at = strstr(at, word)) != NULL; at += strlen(word))
        ++count;
    return count;
}

TEST(lines_are_written)
{
    surface s = surface_make(test_context, LOXO_SHAPE_DISK, 300, NAN);
    double *field = field_of(&s, radius);
    const double level[2] = {0.4, 0.7};
    loxo_polylines lines;
    CHECK_OK(loxo_isolines(test_context, s.mesh, field, level, 2, &lines));
    CHECK_OK(loxo_write_polylines(test_context, test_scratch("a.obj"), &lines));
    CHECK_EQUAL(count_in_file(test_scratch("a.obj"), "v "), lines.n_points);
    CHECK_EQUAL(count_in_file(test_scratch("a.obj"), "\nl "), 2);
    CHECK_OK(loxo_write_polylines(test_context, test_scratch("a.csv"), &lines));
    CHECK_EQUAL(count_in_file(test_scratch("a.csv"), "\n"), lines.n_points + 1);
    CHECK_OK(loxo_write_polylines(test_context, test_scratch("a.vtp"), &lines));
    CHECK_EQUAL(count_in_file(test_scratch("a.vtp"), "NumberOfLines=\"2\""), 1);
    CHECK_STATUS(test_context, loxo_write_polylines(test_context, test_scratch("a.ply"), &lines), LOXO_ERR_UNSUPPORTED);
    CHECK_STATUS(test_context, loxo_write_polylines(test_context, "/nowhere/a.obj", &lines), LOXO_ERR_WRITE);
    loxo_polylines_destroy(test_context, &lines);
    loxo_release(test_context, field);
    surface_destroy(&s);
}

TEST(a_matrix_is_written_and_read)
{
    static const double matrix[6] = {0.0, 1.5, -2.0, 1.0 / 3.0, 4.0, 5.0};
    double *position = NULL;
    int64_t n = 0;
    CHECK_OK(loxo_write_matrix(test_context, test_scratch("m.npy"), matrix, 2, 3));
    CHECK_OK(loxo_write_matrix(test_context, test_scratch("m.csv"), matrix, 2, 3));
    CHECK_OK(loxo_read_points(test_context, test_scratch("m.npy"), &position, &n));
    CHECK(n == 2 && memcmp(position, matrix, sizeof matrix) == 0);
    loxo_release(test_context, position);
    CHECK_OK(loxo_read_points(test_context, test_scratch("m.csv"), &position, &n));
    CHECK(n == 2 && memcmp(position, matrix, sizeof matrix) == 0);
    loxo_release(test_context, position);
    CHECK_STATUS(test_context, loxo_write_matrix(test_context, test_scratch("m.ply"), matrix, 2, 3),
                 LOXO_ERR_UNSUPPORTED);
    CHECK_STATUS(test_context, loxo_write_matrix(test_context, test_scratch("m.npy"), NULL, 2, 3), LOXO_ERR_ARGUMENT);
}
