/* SPDX-License-Identifier: MIT
 * Facts of pictures: areas, colours, lines, symmetry; the same bits for any number of threads. */
#include "../test.h"
#include "draw/colormap.h"
#include "draw/font.h"
#include "draw/ticks.h"
#include "loxo_config.h"

#include <loxo/loxo.h>

#if defined(LOXO_WITH_PNG)
#include <png.h>
#endif

/* ---- shapes ---- */

typedef struct shape {
    int64_t n_vertices, n_faces;
    double *position;
    loxo_index *triangle;
    double *value;
} shape;

static loxo_mesh_arrays arrays_of(const shape *s)
{
    return (loxo_mesh_arrays){
        .n_vertices = s->n_vertices, .n_faces = s->n_faces, .position = s->position, .triangle = s->triangle};
}

static shape shape_make(int64_t n_vertices, int64_t n_faces)
{
    shape s = {n_vertices, n_faces, malloc((size_t)n_vertices * 24), malloc((size_t)n_faces * 3 * sizeof(loxo_index)),
               calloc((size_t)n_vertices, 8)};
    CHECK(s.position != NULL && s.triangle != NULL && s.value != NULL);
    return s;
}

static void shape_free(shape *s) { free(s->position), free(s->triangle), free(s->value); }

/* A sphere of meridians and parallels, poles on z, outward; mirror images of itself in all three axes when n is even. */
static shape make_sphere(int n)
{
    const int64_t around = 2 * (int64_t)n;
    shape s = shape_make(2 + (n - 1) * around, 2 * around * (n - 1));
    int64_t f = 0;
    memcpy(s.position, (double[6]){0, 0, 1, 0, 0, -1}, 48);
    for (int64_t i = 1; i < n; ++i)
        for (int64_t j = 0; j < around; ++j) {
            const double t = acos(-1.0) * (double)i / n, p = acos(-1.0) * (double)j / n;
            double *x = &s.position[3 * (2 + (i - 1) * around + j)];
            x[0] = sin(t) * cos(p), x[1] = sin(t) * sin(p), x[2] = cos(t);
        }
    for (int64_t i = 0; i < n; ++i)
        for (int64_t j = 0; j < around; ++j) {
            const int64_t next = (j + 1) % around, row = 2 + (i - 1) * around;
            const int64_t a = i == 0 ? 0 : row + j, b = i == 0 ? 0 : row + next;
            const int64_t c = i == n - 1 ? 1 : row + around + j, d = i == n - 1 ? 1 : row + around + next;
            if (i < n - 1)
                memcpy(&s.triangle[3 * f++], (loxo_index[3]){(loxo_index)a, (loxo_index)c, (loxo_index)d},
                       sizeof(loxo_index[3]));
            if (i > 0)
                memcpy(&s.triangle[3 * f++], (loxo_index[3]){(loxo_index)a, (loxo_index)d, (loxo_index)b},
                       sizeof(loxo_index[3]));
        }
    CHECK_EQUAL(f, s.n_faces);
    for (int64_t v = 0; v < s.n_vertices; ++v)
        s.value[v] = acos(fmin(fmax(s.position[3 * v + 2], -1.0), 1.0));
    return s;
}

/* The unit square in the plane x = 0, n cells along each side, facing +x; the value is y. */
static shape make_square(int n)
{
    shape s = shape_make((int64_t)(n + 1) * (n + 1), (int64_t)2 * n * n);
    int64_t f = 0;
    for (int64_t i = 0; i <= n; ++i)
        for (int64_t j = 0; j <= n; ++j) {
            double *x = &s.position[3 * (i * (n + 1) + j)];
            x[0] = 0.0, x[1] = (double)j / n, x[2] = (double)i / n;
            s.value[i * (n + 1) + j] = x[1];
        }
    for (int64_t i = 0; i < n; ++i)
        for (int64_t j = 0; j < n; ++j) {
            const loxo_index a = (loxo_index)(i * (n + 1) + j), b = (loxo_index)(a + 1), c = (loxo_index)(a + n + 1);
            const loxo_index d = (loxo_index)(c + 1);
            memcpy(&s.triangle[3 * f++], (loxo_index[3]){a, b, d}, sizeof(loxo_index[3]));
            memcpy(&s.triangle[3 * f++], (loxo_index[3]){a, d, c}, sizeof(loxo_index[3]));
        }
    return s;
}

static void turn_faces(shape *s)
{
    for (int64_t f = 0; f < s->n_faces; ++f) {
        const loxo_index a = s->triangle[3 * f];
        s->triangle[3 * f] = s->triangle[3 * f + 1];
        s->triangle[3 * f + 1] = a;
    }
}

/* ---- pictures ---- */

static loxo_draw_settings small_settings(int width, int height)
{
    loxo_draw_settings s = loxo_draw_settings_default();
    s.width = width, s.height = height;
    s.scale_bar = false, s.n_isolines = 0;
    s.azimuth_deg = s.elevation_deg = 0.0;
    return s;
}

static uint8_t *draw(loxo_context *ctx, const shape *mesh, const double *value, const loxo_draw_settings *s)
{
    const loxo_mesh_arrays arrays = arrays_of(mesh);
    uint8_t *rgb = malloc((size_t)3 * (size_t)s->width * (size_t)s->height);
    CHECK(rgb != NULL);
    CHECK_STATUS(ctx, loxo_draw(ctx, &arrays, value, s, rgb), LOXO_OK);
    return rgb;
}

static const uint8_t *pixel(const uint8_t *rgb, const loxo_draw_settings *s, int x, int y)
{
    return &rgb[3 * ((int64_t)y * s->width + x)];
}

static bool is_background(const uint8_t *p) { return p[0] == 255 && p[1] == 255 && p[2] == 255; }

static double light_of(const uint8_t *p)
{
    return loxo_draw_decode(p[0] / 255.0) + loxo_draw_decode(p[1] / 255.0) + loxo_draw_decode(p[2] / 255.0);
}

static int64_t n_unlike(const uint8_t *a, const uint8_t *b, const loxo_draw_settings *s, int tolerance)
{
    int64_t n = 0;
    for (int64_t i = 0; i < (int64_t)3 * s->width * s->height; ++i)
        n += abs(a[i] - b[i]) > tolerance ? 1 : 0;
    return n;
}

TEST(a_sphere_is_a_disc_of_its_area)
{
    const loxo_draw_settings s = small_settings(400, 300);
    shape sphere = make_sphere(60);
    uint8_t *rgb = draw(test_context, &sphere, NULL, &s);
    double n_inside = 0.0;
    for (int y = 0; y < s.height; ++y)
        for (int x = 0; x < s.width; ++x)
            n_inside += is_background(pixel(rgb, &s, x, y)) ? 0.0 : 1.0;
    /* The margin is 4 % of the shorter side, all around. A pixel cut by the rim counts whole: half a pixel more of
     * radius on average; chords lie inside the circle by 1 - cos(3 degrees / 2) at most. */
    const double radius = 0.5 * 300 * (1.0 - 2 * 0.04);
    CHECK_NEAR(sqrt(n_inside / acos(-1.0)), radius + 0.4, 0.4);
    const int corners[4][2] = {{0, 0}, {399, 0}, {0, 299}, {399, 299}};
    for (int i = 0; i < 4; ++i)
        CHECK(is_background(pixel(rgb, &s, corners[i][0], corners[i][1])));
    free(rgb);
    shape_free(&sphere);
}

TEST(a_symmetric_shape_has_a_symmetric_outline)
{
    const loxo_draw_settings s = small_settings(300, 300);
    shape sphere = make_sphere(24);
    uint8_t *rgb = draw(test_context, &sphere, NULL, &s);
    int n_unlike_sides = 0;
    for (int y = 0; y < s.height; ++y)
        for (int x = 0; x < s.width; ++x) {
            const bool here = is_background(pixel(rgb, &s, x, y));
            n_unlike_sides += here != is_background(pixel(rgb, &s, s.width - 1 - x, y)) ? 1 : 0;
            n_unlike_sides += here != is_background(pixel(rgb, &s, x, s.height - 1 - y)) ? 1 : 0;
        }
    CHECK(n_unlike_sides <= 8); /* a corner that is rounded to one side of a sample */
    free(rgb);
    shape_free(&sphere);
}

TEST(turning_mesh_and_camera_together_changes_nothing)
{
    loxo_draw_settings s = small_settings(320, 240);
    shape sphere = make_sphere(40);
    s.n_isolines = 10;
    for (int64_t v = 0; v < sphere.n_vertices; ++v)
        sphere.position[3 * v + 1] *= 0.7, sphere.position[3 * v + 2] += 0.3 * sphere.position[3 * v];
    s.azimuth_deg = 30.0, s.elevation_deg = 20.0;
    uint8_t *before = draw(test_context, &sphere, sphere.value, &s);
    for (int64_t v = 0; v < sphere.n_vertices; ++v) { /* a quarter turn about z */
        double *p = &sphere.position[3 * v];
        const double x = p[0];
        p[0] = -p[1], p[1] = x;
    }
    s.azimuth_deg = 120.0;
    uint8_t *after = draw(test_context, &sphere, sphere.value, &s);
    CHECK(n_unlike(before, after, &s, 3) < 200); /* of 230,400: rounding to 1/256 sample moves some rims */
    free(before);
    free(after);
    shape_free(&sphere);
}

TEST(another_axis_may_point_up)
{
    loxo_draw_settings s = small_settings(320, 240);
    shape sphere = make_sphere(30);
    s.azimuth_deg = 30.0, s.elevation_deg = 20.0;
    for (int64_t v = 0; v < sphere.n_vertices; ++v)
        sphere.position[3 * v + 1] *= 0.7, sphere.position[3 * v + 2] *= 1.4;
    uint8_t *z_up = draw(test_context, &sphere, sphere.value, &s);
    const loxo_draw_up ups[2] = {LOXO_DRAW_UP_Y, LOXO_DRAW_UP_X};
    for (int i = 0; i < 2; ++i) {
        for (int64_t v = 0; v < sphere.n_vertices; ++v) { /* x, y, z becomes y, z, x: what was up is y, then x */
            double *p = &sphere.position[3 * v];
            const double x = p[0];
            p[0] = p[1], p[1] = p[2], p[2] = x;
        }
        s.up = ups[i];
        uint8_t *other = draw(test_context, &sphere, sphere.value, &s);
        CHECK_EQUAL(n_unlike(z_up, other, &s, 1), 0);
        free(other);
    }
    free(z_up);
    shape_free(&sphere);
}

TEST(size_and_place_do_not_matter)
{
    loxo_draw_settings s = small_settings(160, 160);
    shape sphere = make_sphere(16);
    s.n_isolines = 8;
    uint8_t *plain = draw(test_context, &sphere, sphere.value, &s);
    double exponent_before = 0.0;
    const double exponents[4] = {900.0, 1023.0, -900.0, -1010.0}; /* powers of two: the same digits */
    for (int i = 0; i < 4; ++i) {
        for (int64_t k = 0; k < 3 * sphere.n_vertices; ++k)
            sphere.position[k] = ldexp(sphere.position[k], (int)(exponents[i] - exponent_before));
        exponent_before = exponents[i];
        uint8_t *scaled = draw(test_context, &sphere, sphere.value, &s);
        CHECK(n_unlike(plain, scaled, &s, 2) < 60); /* -1010: small coordinates have lost their last digits */
        free(scaled);
    }
    free(plain);
    shape_free(&sphere);
}

TEST(values_have_the_colours_of_the_bar)
{
    loxo_draw_settings s = small_settings(64, 64);
    shape square = make_square(2);
    s.value_min = 0.0, s.value_max = 1.0;
    for (int map = 0; map < 3; ++map) {
        for (int i = 0; i <= 4; ++i) {
            double color[3];
            s.colormap = (loxo_colormap)map;
            for (int64_t v = 0; v < square.n_vertices; ++v)
                square.value[v] = i == 4 ? 7.0 : 0.5 * i - 0.5; /* below, at the lower end, half, upper end, above */
            loxo_draw_color(s.colormap, square.value[0], color);
            uint8_t *rgb = draw(test_context, &square, square.value, &s);
            for (int k = 0; k < 3; ++k) /* seen straight on, light is a little below 1 */
                CHECK_NEAR(pixel(rgb, &s, 32, 32)[k], 255.0 * color[k], 26.0);
            free(rgb);
        }
    }
    shape_free(&square);
}

TEST(colour_maps_grow_lighter_all_the_way)
{
    for (int map = 0; map < 3; ++map) {
        double before = -1.0;
        for (int i = 0; i <= 100; ++i) {
            double c[3];
            loxo_draw_color((loxo_colormap)map, i / 100.0, c);
            const double y =
                0.2126 * loxo_draw_decode(c[0]) + 0.7152 * loxo_draw_decode(c[1]) + 0.0722 * loxo_draw_decode(c[2]);
            CHECK(y > before);
            before = y;
        }
    }
    for (int i = 0; i <= 255; ++i)
        CHECK_NEAR(255.0 * loxo_draw_encode(loxo_draw_decode(i / 255.0)), i, 0.01); /* the two pieces meet to 1e-5 */
}

TEST(values_that_are_not_finite_are_grey)
{
    loxo_draw_settings s = small_settings(200, 160);
    shape square = make_square(8);
    s.scale_bar = true;
    const double bad[3] = {(double)NAN, INFINITY, -INFINITY};
    for (int i = 0; i < 3; ++i) {
        square.value[4 * 9 + 4] = bad[i]; /* the middle */
        uint8_t *rgb = draw(test_context, &square, square.value, &s);
        int n_grey = 0, n_colored = 0;
        for (int y = 0; y < s.height; ++y)
            for (int x = 0; x < 140; ++x) { /* left of the bar */
                const uint8_t *p = pixel(rgb, &s, x, y);
                if (is_background(p)) continue;
                if (abs(p[0] - p[1]) <= 2 && abs(p[1] - p[2]) <= 2)
                    n_grey += 1;
                else
                    n_colored += 1;
            }
        /* Six of 128 triangles. */
        CHECK_NEAR((double)n_grey / (n_grey + n_colored), 6.0 / 128.0, 0.01);
        free(rgb);
    }
    for (int64_t v = 0; v < square.n_vertices; ++v)
        square.value[v] = (double)NAN;
    s.n_isolines = 10;
    uint8_t *rgb = draw(test_context, &square, square.value, &s); /* nothing finite: a grey shape, no numbers */
    const uint8_t *p = pixel(rgb, &s, 60, 80);
    CHECK(!is_background(p) && p[0] == p[1] && p[1] == p[2]);
    free(rgb);
    shape_free(&square);
}

/* Light that a line takes from a row of the square, in pixels: against the mean of the pixels from 12 to 5 before the
 * column, and of as many behind it (one alone is known to 1 % only). */
static double missing_light(const uint8_t *rgb, const loxo_draw_settings *s, int x)
{
    double a = 0.0, b = 0.0, sum = 0.0;
    for (int i = 5; i <= 12; ++i)
        a += light_of(pixel(rgb, s, x - i, 250)) / 8.0, b += light_of(pixel(rgb, s, x + i, 250)) / 8.0;
    for (int i = -4; i <= 4; ++i)
        sum += 1.0 - light_of(pixel(rgb, s, x + i, 250)) / (a + (b - a) * (i + 8.5) / 17.0);
    return sum;
}

TEST(lines_are_where_the_value_is_round_and_equally_wide)
{
    loxo_draw_settings s = small_settings(500, 500);
    shape square = make_square(64);
    s.n_isolines = 10;
    s.colormap = LOXO_COLORMAP_GRAY;
    uint8_t *rgb = draw(test_context, &square, square.value, &s); /* the square spans columns 20 to 480 */
    for (int k = 1; k <= 9; ++k) {
        const int x = 20 + 46 * k;
        CHECK(light_of(pixel(rgb, &s, x, 250)) < 0.7 * light_of(pixel(rgb, &s, x - 8, 250)));
        /* One pixel at 16 % of the light. */
        CHECK_NEAR(missing_light(rgb, &s, x), 0.84, 0.08);
    }
    CHECK_NEAR(missing_light(rgb, &s, 43), 0.0, 0.1); /* none in between */
    free(rgb);
    for (int64_t v = 0; v < square.n_vertices; ++v) /* steeper to the right: lines nearer, not thinner */
        square.value[v] *= square.value[v];
    rgb = draw(test_context, &square, square.value, &s);
    for (int k = 1; k <= 9; k += 2) {
        const int x = (int)lrint(20.0 + 460.0 * sqrt(k / 10.0));
        CHECK_NEAR(missing_light(rgb, &s, x), 0.84, 0.1);
    }
    free(rgb);
    for (int64_t v = 0; v < square.n_vertices; ++v) /* a plateau at a round value is no line */
        square.value[v] = v == 0 ? 0.0 : v == 1 ? 1.0 : 0.5;
    rgb = draw(test_context, &square, square.value, &s);
    CHECK_NEAR(missing_light(rgb, &s, 250), 0.0, 0.01);
    free(rgb);
    shape_free(&square);
}

TEST(triangles_smaller_than_a_sample_leave_no_holes)
{
    loxo_draw_settings s = small_settings(120, 120);
#if defined(LOXO_INDEX_BITS) && LOXO_INDEX_BITS == 16
    shape square = make_square(150);
#else
    shape square = make_square(700);
#endif
    s.zoom = 1.7; /* beyond the picture on all sides; a width that no sample divides */
    uint8_t *rgb = draw(test_context, &square, NULL, &s);
    for (int i = 1; i < s.width * s.height; ++i)
        for (int k = 0; k < 3; ++k)
            CHECK(abs(rgb[3 * i + k] - rgb[k]) <= 1);
    CHECK(!is_background(rgb));
    free(rgb);
    shape_free(&square);
}

TEST(inner_sides_are_darker_and_closed_shapes_may_be_inside_out)
{
    const loxo_draw_settings s = small_settings(96, 96);
    shape square = make_square(2), sphere = make_sphere(20);
    uint8_t *front = draw(test_context, &square, NULL, &s), *outward = draw(test_context, &sphere, NULL, &s);
    turn_faces(&square);
    turn_faces(&sphere);
    uint8_t *back = draw(test_context, &square, NULL, &s), *inward = draw(test_context, &sphere, NULL, &s);
    CHECK(light_of(pixel(back, &s, 48, 48)) < 0.7 * light_of(pixel(front, &s, 48, 48)));
    CHECK_EQUAL(n_unlike(outward, inward, &s, 2), 0);
    free(front), free(back), free(outward), free(inward);
    shape_free(&square);
    shape_free(&sphere);
}

TEST(hollows_are_darker_and_flat_faces_are_not)
{
    loxo_draw_settings s = small_settings(200, 200);
    shape square = make_square(2), groove = make_square(2);
    s.azimuth_deg = 40.0, s.elevation_deg = 30.0;
    uint8_t *flat = draw(test_context, &square, NULL, &s);
    const uint8_t *middle = pixel(flat, &s, 100, 100);
    int n_other = 0, n_inside = 0;
    for (int64_t i = 0; i < (int64_t)s.width * s.height; ++i) {
        if (is_background(&flat[3 * i])) continue;
        n_inside += 1;
        n_other += abs(flat[3 * i] - middle[0]) > 2 ? 1 : 0;
    }
    CHECK(n_other < n_inside / 30); /* the rim, where pixels are cut: its length, some 450, of 16,000 */
    s.azimuth_deg = s.elevation_deg = 0.0;
    for (int64_t v = 0; v < groove.n_vertices; ++v) /* the middle column goes back */
        groove.position[3 * v] = v % 3 == 1 ? -0.8 : 0.0;
    uint8_t *rgb = draw(test_context, &groove, NULL, &s);
    CHECK(light_of(pixel(rgb, &s, 102, 100)) < 0.9 * light_of(pixel(rgb, &s, 150, 100))); /* the same face */
    free(flat), free(rgb);
    shape_free(&square);
    shape_free(&groove);
}

TEST(nearer_faces_hide_farther_ones)
{
    loxo_draw_settings s = small_settings(96, 96);
    shape square = make_square(1), two = shape_make(8, 4);
    for (int64_t i = 0; i < 2; ++i) /* the second square, of value 1, is behind the first, of value 0, and after it */
        for (int64_t v = 0; v < 4; ++v) {
            memcpy(&two.position[3 * (4 * i + v)], &square.position[3 * v], 24);
            two.position[3 * (4 * i + v)] = -0.1 * (double)i;
            two.value[4 * i + v] = (double)i;
        }
    for (int k = 0; k < 12; ++k)
        two.triangle[k] = (loxo_index)(square.triangle[k % 6] + (k < 6 ? 0 : 4));
    uint8_t *rgb = draw(test_context, &two, two.value, &s);
    CHECK(pixel(rgb, &s, 48, 48)[0] < 100); /* violet; yellow has red near 255 */
    s.azimuth_deg = 180.0;
    uint8_t *other = draw(test_context, &two, two.value, &s);
    CHECK(pixel(other, &s, 48, 48)[0] > pixel(other, &s, 48, 48)[2]); /* yellow, in the shade */
    free(rgb), free(other);
    shape_free(&square);
    shape_free(&two);
}

TEST(threads_bands_and_floats_change_no_bit)
{
    loxo_draw_settings s = small_settings(301, 203);
    shape sphere = make_sphere(110);
    s.azimuth_deg = 33.0, s.elevation_deg = 21.0;
    s.scale_bar = true, s.n_isolines = 12, s.title = "Threads & bands, 0-9", s.unit = "m/s";
    sphere.value[17] = (double)NAN;
    for (int64_t v = 0; v < sphere.n_vertices; ++v) /* folds hide each other; then all fit into floats */
        for (int k = 0; k < 3; ++k)
            sphere.position[3 * v + k] =
                (double)(float)(sphere.position[3 * v + k] * (1.0 + 0.3 * sin(9.0 * sphere.value[v] + k)));
    uint8_t *one = NULL;
    const int ladder[4] = {1, 2, 3, 7};
    for (int i = 0; i < 4; ++i) {
        loxo_context *ctx = test_context_with_threads(ladder[i]);
        uint8_t *rgb = draw(ctx, &sphere, sphere.value, &s);
        if (one == NULL) {
            one = rgb;
        } else {
            CHECK(memcmp(one, rgb, (size_t)3 * 301 * 203) == 0);
            free(rgb);
        }
        loxo_context_destroy(ctx);
    }
    loxo_context_settings poor = loxo_context_settings_default();
    loxo_context *ctx = NULL;
    /* 56 bytes a pixel for the hollows; what is left holds some rows of samples. */
    poor.memory_limit_bytes = (size_t)20 * (size_t)sphere.n_vertices + (size_t)56 * 301 * 203 + 1000000;
    CHECK_STATUS(NULL, loxo_context_create(&poor, &ctx), LOXO_OK);
    uint8_t *rgb = draw(ctx, &sphere, sphere.value, &s);
    CHECK(memcmp(one, rgb, (size_t)3 * 301 * 203) == 0);
    free(rgb);
    loxo_context_destroy(ctx);

    float *narrow = malloc((size_t)sphere.n_vertices * 12);
    loxo_mesh_arrays arrays = arrays_of(&sphere);
    CHECK(narrow != NULL);
    for (int64_t k = 0; k < 3 * sphere.n_vertices; ++k)
        narrow[k] = (float)sphere.position[k];
    arrays.position = NULL, arrays.position_float = narrow;
    rgb = malloc((size_t)3 * 301 * 203);
    CHECK_OK(loxo_draw(test_context, &arrays, sphere.value, &s, rgb));
    CHECK(memcmp(one, rgb, (size_t)3 * 301 * 203) == 0);
    free(narrow), free(rgb), free(one);
    shape_free(&sphere);
}

TEST(a_part_of_a_mesh_is_drawn_by_any_threads)
{
    const loxo_draw_settings s = small_settings(64, 64);
    shape sphere = make_sphere(110); /* vertices enough for several threads, most of which have nothing to draw */
    sphere.n_faces /= 20;
    uint8_t *one = NULL;
    const int ladder[3] = {1, 2, 7};
    for (int i = 0; i < 3; ++i) {
        loxo_context *ctx = test_context_with_threads(ladder[i]);
        uint8_t *rgb = draw(ctx, &sphere, NULL, &s);
        int64_t n_drawn = 0;
        for (int64_t k = 0; k < 4096; ++k)
            n_drawn += !is_background(&rgb[3 * k]);
        CHECK(n_drawn > 50); /* it fills its picture along one axis */
        CHECK(one == NULL || memcmp(one, rgb, (size_t)3 * 4096) == 0);
        if (one == NULL)
            one = rgb;
        else
            free(rgb);
        loxo_context_destroy(ctx);
    }
    free(one);
    shape_free(&sphere);
}

TEST(no_faces_give_an_empty_picture)
{
    const loxo_draw_settings s = small_settings(32, 32);
    shape square = make_square(1);
    square.n_faces = 0;
    uint8_t *rgb = draw(test_context, &square, square.value, &s);
    for (int64_t i = 0; i < 1024; ++i)
        CHECK(is_background(&rgb[3 * i]));
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 1);
    free(rgb);
    square.n_vertices = 0;
    rgb = draw(test_context, &square, NULL, &s);
    CHECK(is_background(rgb));
    free(rgb);
    shape_free(&square);
}

TEST(odd_meshes_are_drawn_as_far_as_they_go)
{
    loxo_draw_settings s = small_settings(64, 64);
    shape square = make_square(4);
    s.scale_bar = true, s.n_isolines = 7;
    square.position[0] = (double)NAN; /* one corner's face goes, and the box is that of the others */
    square.triangle[9] = square.triangle[10];
    uint8_t *rgb = draw(test_context, &square, square.value, &s);
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 1);
    free(rgb);
    for (int64_t k = 0; k < 3 * square.n_vertices; ++k) /* all in one point: no area, nothing to see */
        square.position[k] = 5.0;
    rgb = draw(test_context, &square, square.value, &s);
    CHECK(is_background(pixel(rgb, &s, 20, 32)));
    free(rgb);
    for (int64_t k = 0; k < 3 * square.n_vertices; ++k)
        square.position[k] = (double)NAN;
    rgb = draw(test_context, &square, square.value, &s);
    CHECK(is_background(pixel(rgb, &s, 20, 32)));
    free(rgb);
    shape_free(&square);
}

TEST(fields_of_any_range_have_a_bar)
{
    loxo_draw_settings s = small_settings(120, 90);
    shape square = make_square(4);
    const double ranges[7][2] = {{0.0, 0.0},       {3.0, 3.0},     {-1.7e308, 1.7e308}, {1e-320, 3e-320},
                                 {1e15, 1e15 + 1}, {-2e-9, 5e-10}, {1.7e308, 1.7e308}};
    s.scale_bar = true, s.n_isolines = 10, s.supersample = 1, s.unit = "mm";
    for (int i = 0; i < 7; ++i) {
        for (int64_t v = 0; v < square.n_vertices; ++v)
            square.value[v] = v % 2 == 0 ? ranges[i][0] : ranges[i][1];
        free(draw(test_context, &square, square.value, &s));
        s.value_min = ranges[i][1]; /* everything below the end that is set */
        free(draw(test_context, &square, square.value, &s));
        s.value_min = -INFINITY;
    }
    shape_free(&square);
}

TEST(bad_arguments_are_refused)
{
    shape square = make_square(1);
    loxo_mesh_arrays arrays = arrays_of(&square);
    uint8_t rgb[3 * 32 * 32];
    const loxo_draw_settings good = small_settings(32, 32);
    loxo_draw_settings bad[10];
    for (int i = 0; i < 10; ++i)
        bad[i] = good;
    bad[0].width = 15, bad[1].height = 16385, bad[2].supersample = 0, bad[3].supersample = 5, bad[4].zoom = 0.0;
    bad[5].azimuth_deg = (double)NAN, bad[6].elevation_deg = 91.0, bad[7].n_isolines = -1;
    bad[8].value_min = 1.0, bad[8].value_max = 1.0;
    bad[9].colormap = (loxo_colormap)3;
    for (int i = 0; i < 10; ++i)
        CHECK_STATUS(test_context, loxo_draw(test_context, &arrays, NULL, &bad[i], rgb), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_draw(test_context, NULL, NULL, &good, rgb), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_draw(test_context, &arrays, NULL, NULL, rgb), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_draw(test_context, &arrays, NULL, &good, NULL), LOXO_ERR_ARGUMENT);
    square.triangle[4] = 4;
    CHECK_STATUS(test_context, loxo_draw(test_context, &arrays, NULL, &good, rgb), LOXO_ERR_MALFORMED);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 1);
    square.triangle[4] = -1;
    CHECK_STATUS(test_context, loxo_draw(test_context, &arrays, NULL, &good, rgb), LOXO_ERR_MALFORMED);
    arrays.position = NULL;
    CHECK_STATUS(test_context, loxo_draw(test_context, &arrays, NULL, &good, rgb), LOXO_ERR_ARGUMENT);
    arrays.n_faces = -1;
    CHECK_STATUS(test_context, loxo_draw(test_context, &arrays, NULL, &good, rgb), LOXO_ERR_ARGUMENT);
    shape_free(&square);
}

static int stop_at_once(void *user, const loxo_progress *progress)
{
    (void)user, (void)progress;
    return 1;
}

TEST(the_monitor_can_stop_it)
{
    loxo_draw_settings s = small_settings(400, 400);
    shape sphere = make_sphere(100);
    const loxo_mesh_arrays arrays = arrays_of(&sphere);
    s.supersample = 4;
    uint8_t *rgb = malloc((size_t)3 * 400 * 400);
    loxo_context_set_monitor(test_context, stop_at_once, NULL);
    CHECK_STATUS(test_context, loxo_draw(test_context, &arrays, NULL, &s, rgb), LOXO_ERR_STOPPED);
    free(rgb);
    shape_free(&sphere);
}

TEST(ticks_are_round_and_their_text_is_exact)
{
    static const struct {
        double low, high, n;
        const char *first, *second, *last;
        int shift;
    } rows[] = {
        {0.0, 1.0, 5.0, "0.0", "0.2", "1.0", 0},
        {0.0, 1.0, 10.0, "0.0", "0.1", "1.0", 0},
        {-3.3, 7.1, 5.0, "-2", "0", "6", 0},
        {0.0, 12345.0, 6.0, "0", "2000", "12000", 0},
        {0.0, 3.0e6, 6.0, "0.0", "0.5", "3.0", 6},
        {1.0e-7, 9.0e-7, 4.0, "2", "4", "8", -7},
        {99.95, 100.05, 5.0, "99.96", "99.98", "100.04", 0},
        {0.0, 0.05, 5.0, "0.00", "0.01", "0.05", 0},
        {-0.004, 0.0, 4.0, "-0.004", "-0.003", "0.000", 0},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; ++i) {
        char text[64];
        const loxo_draw_ticks t = loxo_draw_ticks_find(rows[i].low, rows[i].high, rows[i].n);
        loxo_draw_tick_text(&t, t.first, text);
        CHECK_TEXT(text, rows[i].first);
        loxo_draw_tick_text(&t, t.first + 1, text);
        CHECK_TEXT(text, rows[i].second);
        loxo_draw_tick_text(&t, t.last, text);
        CHECK_TEXT(text, rows[i].last);
        CHECK_EQUAL(t.shift, rows[i].shift);
    }
    const loxo_draw_ticks tenths = loxo_draw_ticks_find(0.0, 1.0, 10.0);
    CHECK_EQUAL(loxo_draw_tick_value(&tenths, 3), 0.3); /* not 0.30000000000000004 */
    const loxo_draw_ticks none = loxo_draw_ticks_find(1e15, 1e15 + 1.0, 5.0);
    CHECK(none.last < none.first);
}

TEST(letters_stay_in_their_place)
{
    enum { W = 900, H = 40 };
    uint8_t *rgb = malloc((size_t)3 * W * H);
    const loxo_draw_canvas canvas = {rgb, W, H};
    char all[96];
    for (int i = 0; i < 95; ++i)
        all[i] = (char)(' ' + i);
    all[95] = '\0';
    for (int i = 0; i < 95; ++i) { /* every glyph but the blank leaves ink, and only between its own ends */
        const char one[2] = {all[i], '\0'};
        int n_inked = 0;
        memset(rgb, 255, (size_t)3 * W * H);
        loxo_draw_text(&canvas, one, 30.0, 26.0, 14.0, LOXO_DRAW_LEFT, 0);
        const double width = loxo_draw_text_width(one, 14.0);
        for (int64_t y = 0; y < H; ++y)
            for (int64_t x = 0; x < W; ++x) {
                if (rgb[3 * (y * W + x)] == 255) continue;
                n_inked += 1;
                CHECK((double)x + 1.0 > 30.0 - 2.0 && (double)x < 30.0 + width + 2.0 && y + 1 > 26 - 19 && y < 26 + 7);
            }
        CHECK(i == 0 ? n_inked == 0 : n_inked > 5);
    }
    loxo_draw_text(&canvas, all, 450.0, 26.0, 14.0, LOXO_DRAW_CENTRE, 0);
    loxo_draw_text(&canvas, "\xc3\xa9\n over the edge", 890.0, 39.0, 30.0, LOXO_DRAW_LEFT, 0); /* clipped */
    loxo_draw_text(&canvas, "left and up", 4.0, 2.0, 30.0, LOXO_DRAW_RIGHT, 0);
    free(rgb);
}

static loxo_status draw_once(loxo_context *ctx, void *arg)
{
    const loxo_draw_settings s = small_settings(32, 32);
    const loxo_mesh_arrays arrays = arrays_of(arg);
    return loxo_draw_png(ctx, &arrays, ((const shape *)arg)->value, &s, test_scratch("failing.png"));
}

#if defined(LOXO_WITH_PNG)

TEST(every_allocation_may_fail)
{
    shape sphere = make_sphere(12);
    CHECK(test_each_allocation_fails(draw_once, &sphere) >= 6);
    shape_free(&sphere);
}

TEST(the_png_holds_the_picture)
{
    static const unsigned char signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    loxo_draw_settings s = small_settings(131, 77);
    shape sphere = make_sphere(12);
    const loxo_mesh_arrays arrays = arrays_of(&sphere);
    const char *path = test_scratch("sphere.png");
    CHECK_OK(loxo_draw_png(test_context, &arrays, sphere.value, &s, path));
    uint8_t *rgb = draw(test_context, &sphere, sphere.value, &s);
    unsigned char head[8];
    FILE *file = fopen(path, "rb");
    CHECK(file != NULL && fread(head, 1, 8, file) == 8);
    fclose(file);
    CHECK(memcmp(head, signature, 8) == 0);
    png_image image = {.version = PNG_IMAGE_VERSION};
    CHECK(png_image_begin_read_from_file(&image, path) != 0);
    CHECK_EQUAL(image.width, 131);
    CHECK_EQUAL(image.height, 77);
    image.format = PNG_FORMAT_RGB;
    uint8_t *read = malloc((size_t)3 * 131 * 77);
    CHECK(png_image_finish_read(&image, NULL, read, 0, NULL) != 0);
    CHECK(memcmp(read, rgb, (size_t)3 * 131 * 77) == 0);
    free(read), free(rgb);
    CHECK_STATUS(test_context, loxo_draw_png(test_context, &arrays, NULL, &s, test_scratch("no/such/folder.png")),
                 LOXO_ERR_WRITE);
    s.zoom = -1.0;
    CHECK_STATUS(test_context, loxo_draw_png(test_context, &arrays, NULL, &s, test_scratch("none.png")),
                 LOXO_ERR_ARGUMENT);
    CHECK(access(test_scratch("none.png"), F_OK) != 0);
    CHECK_STATUS(test_context, loxo_draw_png(test_context, &arrays, NULL, &s, NULL), LOXO_ERR_ARGUMENT);
    shape_free(&sphere);
}

#else

TEST(without_libpng_files_are_refused)
{
    shape sphere = make_sphere(12);
    CHECK_STATUS(test_context, draw_once(test_context, &sphere), LOXO_ERR_UNSUPPORTED);
    shape_free(&sphere);
}

#endif
