/* SPDX-License-Identifier: MIT
 * Facts of plots: strokes have the areas of their shapes, values stand where the axis says, numbers are round. */
#include "../test.h"
#include "draw/colormap.h"
#include "draw/plot_axis.h"
#include "draw/strokes.h"
#include "loxo_config.h"

#include <loxo/loxo.h>

#include <float.h>

enum { W = 200, H = 120 };

typedef struct sheet {
    uint8_t rgb[3 * W * H];
    loxo_draw_canvas canvas;
    loxo_draw_pen pen;
} sheet;

static void sheet_clear(sheet *s)
{
    memset(s->rgb, 255, sizeof s->rgb);
    s->canvas = (loxo_draw_canvas){s->rgb, W, H};
    s->pen = (loxo_draw_pen){&s->canvas, {0.0, 0.0, W, H}, {0, 0, 0}};
}

/* Black on white, in pixels. */
static double ink_of(const sheet *s)
{
    double sum = 0.0;
    for (int i = 0; i < W * H; ++i)
        sum += (255 - s->rgb[3 * i]) / 255.0;
    return sum;
}

/* ---- strokes ---- */

TEST(a_line_has_the_area_of_its_shape)
{
    sheet s;
    for (int i = 0; i < 12; ++i) {
        const double angle = 2.0 * acos(-1.0) * (i + 0.2) / 12.0, width = 1.5 + 0.4 * i, length = 50.0;
        const double from[2] = {100.3, 60.1};
        const double to[2] = {from[0] + length * cos(angle), from[1] + length * sin(angle)};
        sheet_clear(&s);
        loxo_draw_line(&s.pen, from, to, width, 0.0, NULL);
        /* A rectangle and two half discs. Cover is taken as linear over one pixel across the rim, which is right on
         * straight rims but for the angle, to a few percent of a pixel's breadth along the line's two sides. */
        CHECK_NEAR(ink_of(&s), length * width + acos(-1.0) * width * width / 4.0, 0.02 * 2.0 * length);
    }
}

TEST(dashes_are_two_thirds_of_a_line)
{
    sheet s;
    double along = 0.0;
    sheet_clear(&s);
    const double x[4] = {10.0, 73.0, 120.0, 190.0}; /* in pieces: the pattern runs on */
    for (int i = 0; i < 3; ++i)
        loxo_draw_line(&s.pen, (double[2]){x[i], 60.0}, (double[2]){x[i + 1], 60.0}, 2.0, 8.0, &along);
    /* 15 dashes of 8 along 180, round ends of half a pixel and more each. */
    CHECK_NEAR(ink_of(&s), 15 * (8.0 * 2.0 + acos(-1.0)), 0.05 * 15 * 19.0 + 6.3);
}

TEST(lines_far_outside_are_cut)
{
    sheet s;
    sheet_clear(&s);
    const double far[2] = {1e300, 1e300};
    loxo_draw_line(&s.pen, (double[2]){-1e9, 60.0}, (double[2]){1e9, 60.0}, 3.0, 0.0, NULL);
    CHECK_NEAR(ink_of(&s), 3.0 * W, 0.01 * W);
    sheet_clear(&s);
    loxo_draw_line(&s.pen, (double[2]){-50.0, -10.0}, (double[2]){300.0, -10.0}, 3.0, 4.0, &(double){0.0});
    CHECK_EQUAL(ink_of(&s), 0.0);
    loxo_draw_line(&s.pen, far, (double[2]){1.1e300, 1e300}, 3.0, 4.0, &(double){0.0});
    loxo_draw_line(&s.pen, (double[2]){5.0, 5.0}, (double[2]){5.0, 5.0}, 3.0, 0.0, NULL); /* a dot */
    CHECK_NEAR(ink_of(&s), acos(-1.0) * 2.25, 0.5);
    s.pen.clip = (loxo_draw_rectangle){50.0, 50.0, 60.0, 60.0};
    sheet_clear(&s);
    s.pen.clip = (loxo_draw_rectangle){50.0, 50.0, 60.0, 60.0};
    loxo_draw_line(&s.pen, (double[2]){0.0, 55.0}, (double[2]){W, 55.0}, 4.0, 0.0, NULL);
    CHECK_NEAR(ink_of(&s), 40.0, 1e-9);
}

TEST(every_mark_is_of_its_size_and_has_its_own_shape)
{
    static sheet s[LOXO_DRAW_N_MARKS];
    for (int m = 0; m < LOXO_DRAW_N_MARKS; ++m) {
        sheet_clear(&s[m]);
        loxo_draw_put_mark(&s[m].pen, (loxo_draw_mark)m, 100.0, 60.0, 20.0);
        const double ink = ink_of(&s[m]);
        CHECK(ink > 0.3 * 314.0 && ink < 1.25 * 314.0); /* of a disc */
        for (int other = 0; other < m; ++other) {
            int n_unlike = 0;
            for (int i = 0; i < W * H; ++i)
                n_unlike += abs(s[m].rgb[3 * i] - s[other].rgb[3 * i]) > 128 ? 1 : 0;
            CHECK(n_unlike > 30); /* the rims of a square and a disc of one area */
        }
    }
    CHECK_NEAR(ink_of(&s[LOXO_DRAW_DISC]), acos(-1.0) * 100.0, 2.0);
    loxo_draw_put_mark(&s[0].pen, LOXO_DRAW_DISC, (double)NAN, 60.0, 20.0);
    loxo_draw_put_mark(&s[0].pen, LOXO_DRAW_DISC, 1e30, 60.0, 20.0);
    loxo_draw_put_mark(&s[0].pen, LOXO_DRAW_DISC, 0.0, 0.0, 20.0); /* a quarter of it */
}

TEST(bands_side_by_side_leave_no_seam)
{
    sheet s;
    sheet_clear(&s);
    const double x[5] = {20.3, 41.7, 41.9, 90.5, 160.1};
    for (int i = 0; i < 4; ++i)
        loxo_draw_fill_between(&s.pen, x[i], 30.25, 70.75, x[i + 1], 30.25, 70.75, 0.5);
    CHECK_NEAR(ink_of(&s), 0.5 * 40.5 * 140.0, 0.5 * 40.5 + 0.004 * 40.5 * 140.0); /* whole columns; bytes */
    for (int64_t i = 25; i < 155; ++i)
        CHECK_EQUAL(s.rgb[3 * (50 * W + i)], s.rgb[3 * (50 * W + 25)]);
}

/* CIE 1976 L*a*b* of light, by the matrix of sRGB (IEC 61966-2-1). */
static void lab_of(const double light[3], double lab[3])
{
    static const double to_xyz[3][3] = {{0.4124 / 0.9505, 0.3576 / 0.9505, 0.1805 / 0.9505},
                                        {0.2126, 0.7152, 0.0722},
                                        {0.0193 / 1.089, 0.1192 / 1.089, 0.9505 / 1.089}};
    double f[3];
    for (int i = 0; i < 3; ++i) {
        const double t = to_xyz[i][0] * light[0] + to_xyz[i][1] * light[1] + to_xyz[i][2] * light[2];
        f[i] = t > 216.0 / 24389.0 ? cbrt(t) : (24389.0 / 27.0 * t + 16.0) / 116.0;
    }
    lab[0] = 116.0 * f[1] - 16.0, lab[1] = 500.0 * (f[0] - f[1]), lab[2] = 200.0 * (f[1] - f[2]);
}

TEST(colours_differ_for_every_kind_of_eye)
{
    /* Machado, Oliveira, Fernandes 2009, A Physiologically-Based Model for Simulation of Color Vision Deficiency: full
     * eyes, then such without the long, the middle, the short cones. */
    static const double eyes[4][3][3] = {
        {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}},
        {{0.152286, 1.052583, -0.204868}, {0.114503, 0.786281, 0.099216}, {-0.003882, -0.048116, 1.051998}},
        {{0.367322, 0.860646, -0.227968}, {0.280085, 0.672501, 0.047413}, {-0.011820, 0.042940, 0.968881}},
        {{1.255528, -0.076749, -0.178779}, {-0.078411, 0.930809, 0.147602}, {0.004733, 0.691367, 0.303900}}};
    for (int e = 0; e < 4; ++e) {
        double lab[LOXO_DRAW_N_SERIES_COLORS + 1][3];
        for (int c = 0; c <= LOXO_DRAW_N_SERIES_COLORS; ++c) { /* the last is the paper */
            uint8_t rgb[3] = {255, 255, 255};
            double seen[3] = {0.0, 0.0, 0.0};
            if (c < LOXO_DRAW_N_SERIES_COLORS) loxo_draw_series_color(c, rgb);
            for (int i = 0; i < 3; ++i)
                for (int k = 0; k < 3; ++k)
                    seen[i] += eyes[e][i][k] * loxo_draw_decode(rgb[k] / 255.0);
            for (int i = 0; i < 3; ++i)
                seen[i] = fmin(fmax(seen[i], 0.0), 1.0);
            lab_of(seen, lab[c]);
        }
        for (int a = 0; a <= LOXO_DRAW_N_SERIES_COLORS; ++a)
            for (int b = 0; b < a; ++b) {
                const double d[3] = {lab[a][0] - lab[b][0], lab[a][1] - lab[b][1], lab[a][2] - lab[b][2]};
                /* 2.3 is just to be seen side by side. */
                CHECK(sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) > 3.5 * 2.3);
            }
    }
}

/* ---- axes ---- */

TEST(logarithmic_ticks_are_powers_of_ten)
{
    loxo_draw_log_tick t[LOXO_DRAW_MAX_LOG_TICKS];
    int n = loxo_draw_log_ticks_find(1.0, 1000.0, 8.0, t), n_major = 0;
    CHECK_EQUAL(n, 28); /* nine a decade, and the end */
    for (int i = 0; i < n; ++i) {
        CHECK(t[i].is_major == (t[i].factor == 1));
        n_major += t[i].is_major ? 1 : 0;
        if (i > 0) CHECK(loxo_draw_log_tick_value(&t[i]) > loxo_draw_log_tick_value(&t[i - 1]));
    }
    CHECK_EQUAL(n_major, 4);
    n = loxo_draw_log_ticks_find(0.9, 21.0, 8.0, t), n_major = 0;
    for (int i = 0; i < n; ++i)
        n_major += t[i].is_major ? 1 : 0;
    CHECK_EQUAL(n_major, 5); /* 1 2 5 10 20 */
    CHECK_EQUAL(loxo_draw_log_ticks_find(3.0, 4.0, 8.0, t), 0);
    for (int k = 1; k < 308; k += 7) {
        n = loxo_draw_log_ticks_find(pow(10.0, -k), pow(10.0, k), 8.0, t), n_major = 0;
        CHECK(n <= LOXO_DRAW_MAX_LOG_TICKS);
        for (int i = 0; i < n; ++i)
            n_major += t[i].is_major ? 1 : 0;
        CHECK(n_major >= 3 && n_major <= 10);
    }
}

TEST(an_axis_shows_its_numbers)
{
    loxo_plot_axis a;
    loxo_plot_axis_make(&a, LOXO_PLOT_LOG, 0.01, 10.0, 8.0);
    CHECK_TEXT(a.tick[0].text, "0.01");
    CHECK_TEXT(a.tick[27].text, "10");
    CHECK_NEAR(a.tick[18].place, 2.0 / 3.0, 1e-12); /* 1 */
    loxo_plot_axis_make(&a, LOXO_PLOT_LOG, 1e-8, 1.0, 8.0);
    CHECK_TEXT(a.tick[0].text, "10");
    CHECK_TEXT(a.tick[0].power, "-8");
    loxo_plot_axis_make(&a, LOXO_PLOT_LOG, 3.0, 4.0, 5.0); /* too short for powers: linear numbers */
    CHECK_TEXT(a.tick[0].text, "3.0");
    CHECK_NEAR(a.tick[0].place, 0.0, 1e-12);
    CHECK_TEXT(a.tick[a.n_ticks - 1].text, "4.0");
    loxo_plot_axis_make(&a, LOXO_PLOT_LINEAR, 0.0, 2e-6, 5.0);
    CHECK_EQUAL(a.shift, -6);
    CHECK_EQUAL(loxo_plot_axis_place(&a, 1e-6), 0.5);
    CHECK(isnan(loxo_plot_axis_place(&a, INFINITY)));
    loxo_plot_axis_make(&a, LOXO_PLOT_LINEAR, -DBL_MAX, DBL_MAX, 5.0);
    CHECK_EQUAL(loxo_plot_axis_place(&a, 0.0), 0.5);
}

TEST(ends_hold_all_values)
{
    static const double rows[][2] = {{1.0, 5.0},      {3.0, 3.0},          {0.0, 0.0},       {-2.0, 7.0},
                                     {-9.0, -8.0},    {-DBL_MAX, DBL_MAX}, {1e-300, 2e-300}, {1e9, 1e9 + 1.0},
                                     {5e-324, 1e308}, {DBL_MAX, DBL_MAX}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; ++i)
        for (int scale = 0; scale < 2; ++scale) {
            double low = rows[i][0], high = rows[i][1];
            if (scale == LOXO_PLOT_LOG && low <= 0.0) continue;
            loxo_plot_axis_ends((loxo_plot_scale)scale, &low, &high);
            CHECK(isfinite(low) && isfinite(high) && low < high);
            CHECK(low <= fmax(rows[i][0], scale == LOXO_PLOT_LOG ? DBL_MIN : -DBL_MAX) && high >= rows[i][1]);
            CHECK(scale == LOXO_PLOT_LINEAR || low > 0.0);
        }
}

/* ---- plots ---- */

static loxo_plot plot_of(const loxo_plot_series *series, int n)
{
    loxo_plot p = loxo_plot_default();
    p.width = 400, p.height = 300;
    p.series = series, p.n_series = n;
    return p;
}

/* Centre of the pixels that have the colour of series 0; their number. */
static double centre_of(const uint8_t *rgb, const loxo_plot *p, double at[2])
{
    uint8_t color[3];
    double n = 0.0;
    loxo_draw_series_color(0, color);
    at[0] = at[1] = 0.0;
    for (int y = 0; y < p->height; ++y)
        for (int x = 0; x < p->width; ++x)
            if (memcmp(&rgb[3 * (y * p->width + x)], color, 3) == 0) at[0] += x + 0.5, at[1] += y + 0.5, n += 1.0;
    at[0] /= n, at[1] /= n;
    return n;
}

TEST(points_stand_where_the_axes_say)
{
    uint8_t *rgb = malloc((size_t)3 * 400 * 300);
    const double x[5] = {1.0, 2.0, 4.0, 8.0, 16.0};
    for (int is_log = 0; is_log < 2; ++is_log) {
        double at[5][2];
        for (int i = 0; i < 5; ++i) {
            const loxo_plot_series s = {.style = LOXO_PLOT_POINTS, .n = 1, .x = &x[i], .y = &x[i]};
            loxo_plot p = plot_of(&s, 1);
            p.x_min = p.y_min = 0.5, p.x_max = p.y_max = 20.0;
            p.x_scale = p.y_scale = is_log == 1 ? LOXO_PLOT_LOG : LOXO_PLOT_LINEAR;
            CHECK_OK(loxo_plot_draw(test_context, &p, rgb));
            CHECK(centre_of(rgb, &p, at[i]) > 8.0);
        }
        for (int i = 1; i < 5; ++i)
            for (int k = 0; k < 2; ++k) { /* steps are equal, or double; half a pixel in the centre of a mark */
                const double step = at[i][k] - at[i - 1][k];
                CHECK(k == 0 ? step > 0.0 : step < 0.0);
                if (i > 1) CHECK_NEAR(step, (is_log == 1 ? 1.0 : 2.0) * (at[i - 1][k] - at[i - 2][k]), 2.0);
            }
    }
    free(rgb);
}

TEST(columns_are_as_high_as_their_values)
{
    uint8_t *rgb = malloc((size_t)3 * 400 * 300);
    const double x[2] = {0.0, 1.0}, y[2] = {2.0, 4.0}, low[2] = {0.0, 3.0};
    const char *const names[2] = {"one", "two"};
    uint8_t color[3];
    loxo_plot_series s = {.style = LOXO_PLOT_COLUMNS, .n = 2, .x = x, .y = y};
    loxo_plot p = plot_of(&s, 1);
    double n[2][2] = {{0.0}};
    p.n_x_names = 2, p.x_names = names, p.y_min = 0.0, p.y_max = 4.0;
    loxo_draw_series_color(0, color);
    for (int k = 0; k < 2; ++k) {
        s.low = k == 1 ? low : NULL;
        CHECK_OK(loxo_plot_draw(test_context, &p, rgb));
        for (int i = 0; i < 300 * 400; ++i)
            if (memcmp(&rgb[(int64_t)3 * i], color, 3) == 0) n[k][i % 400 > 210 ? 1 : 0] += 1.0;
    }
    CHECK_NEAR(n[0][1] / n[0][0], 2.0, 0.03);
    CHECK_NEAR(n[1][0] / n[0][0], 1.0, 1e-9);
    CHECK_NEAR(n[1][1] / n[0][0], 0.5, 0.03);
    free(rgb);
}

TEST(bars_go_from_each_x_to_the_next)
{
    uint8_t *rgb = malloc((size_t)3 * 400 * 300);
    const double x[4] = {0.0, 1.0, 3.0, 4.0}, y[4] = {2.0, 1.0, 0.0, 9.0}; /* the last only ends */
    uint8_t color[3];
    const loxo_plot_series s = {.style = LOXO_PLOT_BARS, .n = 4, .x = x, .y = y};
    loxo_plot p = plot_of(&s, 1);
    double n[2] = {0.0};
    int left = 400, right = 0;
    p.x_min = 0.0, p.x_max = 4.0, p.y_min = 0.0, p.y_max = 4.0;
    loxo_draw_series_color(0, color);
    CHECK_OK(loxo_plot_draw(test_context, &p, rgb));
    for (int k = 0; k < 2; ++k)
        for (int i = 0; i < 300 * 400; ++i) {
            if (memcmp(&rgb[(int64_t)3 * i], color, 3) != 0) continue;
            if (i % 400 < left) left = i % 400;
            if (i % 400 > right) right = i % 400;
            if (k == 1) n[i % 400 > left + (right - left) / 3 ? 1 : 0] += 1.0;
        }
    /* One is twice as high, the other twice as wide; a pixel's line between them, of some 90. */
    CHECK_NEAR(n[1] / n[0], 1.0, 0.04);
    free(rgb);
}

TEST(what_has_no_place_is_left_out)
{
    uint8_t *rgb = malloc((size_t)3 * 400 * 300), *other = malloc((size_t)3 * 400 * 300);
    const double x[6] = {1.0, 2.0, 3.0, 4.0, 5.0, 6.0}, y[6] = {1.0, -1.0, 0.0, (double)NAN, INFINITY, 3.0};
    loxo_plot_series s = {.name = "all", .style = LOXO_PLOT_BOTH, .n = 6, .x = x, .y = y};
    loxo_plot p = plot_of(&s, 1);
    p.y_scale = LOXO_PLOT_LOG;
    CHECK_OK(loxo_plot_draw(test_context, &p, rgb));
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 1);
    CHECK_EQUAL(loxo_context_warning(test_context, 0)->count, 2);
    s.n = 0;
    CHECK_OK(loxo_plot_draw(test_context, &p, other)); /* empty axes */
    p.n_series = 0;
    CHECK_OK(loxo_plot_draw(test_context, &p, other));
    free(rgb);
    free(other);
}

TEST(odd_values_are_drawn_as_far_as_they_go)
{
    uint8_t *rgb = malloc((size_t)3 * 400 * 300);
    const double x[6] = {-DBL_MAX, 0.0, 5e-324, 1.0, 1.0, DBL_MAX}, y[6] = {DBL_MAX, 0.0, 1.0, 1e300, -1e300, 1.0};
    for (int style = 0; style <= LOXO_PLOT_BARS; ++style)
        for (int scales = 0; scales < 4; ++scales) {
            const loxo_plot_series s = {
                .name = "a very long name that fits no line of the legend, whatever one does to make it shorter",
                .style = (loxo_plot_style)style,
                .n = 6,
                .x = x,
                .y = y,
                .low = x,
                .high = y,
                .is_dashed = true};
            const loxo_plot_series all[3] = {s, s, s};
            loxo_plot p = plot_of(all, 3);
            p.title = "odd", p.x_title = "x", p.y_title = "y";
            p.x_scale = (scales & 1) != 0 ? LOXO_PLOT_LOG : LOXO_PLOT_LINEAR;
            p.y_scale = (scales & 2) != 0 ? LOXO_PLOT_LOG : LOXO_PLOT_LINEAR;
            CHECK_OK(loxo_plot_draw(test_context, &p, rgb));
            p.width = p.height = 64;
            CHECK_OK(loxo_plot_draw(test_context, &p, rgb));
            p.x_min = 7.0; /* beyond most of them */
            p.y_max = 1e-3;
            CHECK_OK(loxo_plot_draw(test_context, &p, rgb));
        }
    free(rgb);
}

TEST(bad_arguments_are_refused)
{
    static uint8_t rgb[3 * 64 * 64];
    const double x[1] = {1.0};
    const loxo_plot_series good = {.n = 1, .x = x, .y = x};
    loxo_plot_series s = good;
    loxo_plot p = plot_of(&s, 1);
    CHECK_STATUS(test_context, loxo_plot_draw(test_context, NULL, rgb), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_plot_draw(test_context, &p, NULL), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(loxo_plot_draw(NULL, &p, rgb), LOXO_ERR_ARGUMENT);
    p.width = 63;
    CHECK_STATUS(test_context, loxo_plot_draw(test_context, &p, rgb), LOXO_ERR_ARGUMENT);
    p = plot_of(NULL, 1);
    CHECK_STATUS(test_context, loxo_plot_draw(test_context, &p, rgb), LOXO_ERR_ARGUMENT);
    p = plot_of(&s, 1);
    p.n_x_names = 2;
    CHECK_STATUS(test_context, loxo_plot_draw(test_context, &p, rgb), LOXO_ERR_ARGUMENT);
    p = plot_of(&s, 1);
    p.x_min = 2.0, p.x_max = 1.0;
    CHECK_STATUS(test_context, loxo_plot_draw(test_context, &p, rgb), LOXO_ERR_ARGUMENT);
    p.x_min = 0.0, p.x_scale = LOXO_PLOT_LOG;
    CHECK_STATUS(test_context, loxo_plot_draw(test_context, &p, rgb), LOXO_ERR_ARGUMENT);
    p = plot_of(&s, 1);
    p.y_max = INFINITY;
    CHECK_STATUS(test_context, loxo_plot_draw(test_context, &p, rgb), LOXO_ERR_ARGUMENT);
    p = plot_of(&s, 1);
    p.y_scale = (loxo_plot_scale)2;
    CHECK_STATUS(test_context, loxo_plot_draw(test_context, &p, rgb), LOXO_ERR_ARGUMENT);
    p = plot_of(&s, 1);
    s.x = NULL;
    CHECK_STATUS(test_context, loxo_plot_draw(test_context, &p, rgb), LOXO_ERR_ARGUMENT);
    s = good, s.n = -1;
    CHECK_STATUS(test_context, loxo_plot_draw(test_context, &p, rgb), LOXO_ERR_ARGUMENT);
    s = good, s.color = -1;
    CHECK_STATUS(test_context, loxo_plot_draw(test_context, &p, rgb), LOXO_ERR_ARGUMENT);
    s = good, s.style = (loxo_plot_style)5;
    CHECK_STATUS(test_context, loxo_plot_draw(test_context, &p, rgb), LOXO_ERR_ARGUMENT);
}

#if defined(LOXO_WITH_PNG)

static loxo_status plot_once(loxo_context *ctx, void *arg)
{
    const loxo_plot p = plot_of(arg, 1);
    return loxo_plot_png(ctx, &p, test_scratch("plot.png"));
}

TEST(every_allocation_may_fail_and_bad_paths_are_refused)
{
    const double x[2] = {1.0, 2.0};
    loxo_plot_series s = {.n = 2, .x = x, .y = x};
    const loxo_plot p = plot_of(&s, 1);
    CHECK(test_each_allocation_fails(plot_once, &s) >= 2);
    CHECK(access(test_scratch("plot.png"), R_OK) == 0);
    CHECK_STATUS(test_context, loxo_plot_png(test_context, &p, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_plot_png(test_context, &p, test_scratch("no/folder/plot.png")), LOXO_ERR_WRITE);
    const uint8_t rgb[6] = {0, 0, 0, 255, 255, 255};
    CHECK_OK(loxo_picture_write(test_context, test_scratch("two.png"), rgb, 2, 1));
    CHECK(access(test_scratch("two.png"), R_OK) == 0);
    CHECK_STATUS(test_context, loxo_picture_write(test_context, test_scratch("two.png"), rgb, 0, 1), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_picture_write(test_context, NULL, rgb, 2, 1), LOXO_ERR_ARGUMENT);
}

#endif
