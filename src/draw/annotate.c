/* SPDX-License-Identifier: MIT */
#include "draw/annotate.h"

#include "draw/colormap.h"
#include "draw/shade.h"

#include <math.h>
#include <stdio.h>

#define INK         38   /* of letters and frames */
#define MARGIN      0.04 /* of the picture's shorter side */
#define TITLE_SIZE  1.25 /* capitals, in those of the numbers */
#define BAR_WIDTH   1.7
#define TICK_LENGTH 0.5
#define NUMBER_GAP  0.9
#define GAP_TEXT    "none" /* beside the grey of values that are not finite */

static double number_width(const loxo_draw_layout *l)
{
    double width = 0.0;
    for (int64_t i = l->ticks.first; i <= l->ticks.last; ++i) {
        char text[64];
        loxo_draw_tick_text(&l->ticks, i, text);
        width = fmax(width, loxo_draw_text_width(text, l->cap_height));
    }
    return width;
}

loxo_draw_layout loxo_draw_lay_out(const loxo_draw_scene *scene)
{
    const loxo_draw_settings *s = scene->settings;
    const double width = s->width, height = s->height, shorter = fmin(width, height);
    const double margin = MARGIN * shorter, cap = fmax(0.0165 * fmin(height, 0.9 * width), 6.0);
    loxo_draw_layout l = {.cap_height = cap, .clip = {0.0, 0.0, width, height}};
    l.fit = (loxo_draw_rectangle){margin, margin, width - margin, height - margin};
    if (s->title != NULL && s->title[0] != '\0') {
        l.clip.top = fmin(margin + 1.6 * TITLE_SIZE * cap, 0.5 * height);
        l.fit.top = fmin(l.clip.top + 0.5 * margin, 0.5 * height);
    }
    if (scene->value == NULL || !s->scale_bar) return l;

    l.bar.top = 0.5 * (l.clip.top + height) - 0.31 * height;
    l.bar.bottom = l.bar.top + 0.60 * height;
    if (scene->has_range)
        l.ticks = loxo_draw_ticks_find(scene->value_min, scene->value_max,
                                       fmin(fmax((l.bar.bottom - l.bar.top) / (4.5 * cap), 2.0), 7.0));
    else
        l.ticks = (loxo_draw_ticks){.last = -1};
    double beside = fmax(number_width(&l), scene->has_gaps ? loxo_draw_text_width(GAP_TEXT, cap) : 2.0 * cap);
    l.has_numbers = (BAR_WIDTH + NUMBER_GAP) * cap + beside + 2.0 * margin < 0.4 * width;
    if (!l.has_numbers) beside = 0.0;
    l.has_bar = BAR_WIDTH * cap + 2.0 * margin < 0.4 * width;
    if (!l.has_bar) return l;
    l.bar.right = width - margin - beside - (l.has_numbers ? NUMBER_GAP * cap : 0.0);
    l.bar.left = l.bar.right - BAR_WIDTH * cap;
    l.clip.right = floor(l.bar.left - 0.5 * margin);
    l.fit.right = l.bar.left - margin;
    return l;
}

static void fill(const loxo_draw_canvas *canvas, const loxo_draw_rectangle *r, const uint8_t rgb[3])
{
    for (int y = (int)r->top; y < (int)r->bottom && y < canvas->height; ++y)
        for (int x = (int)r->left; x < (int)r->right && x < canvas->width; ++x)
            for (int k = 0; k < 3; ++k)
                canvas->rgb[3 * ((size_t)y * (size_t)canvas->width + (size_t)x) + (size_t)k] = rgb[k];
}

static void frame(const loxo_draw_canvas *canvas, const loxo_draw_rectangle *r, double width)
{
    loxo_draw_stroke(canvas, r->left, r->top, r->right, r->top, width, INK);
    loxo_draw_stroke(canvas, r->right, r->top, r->right, r->bottom, width, INK);
    loxo_draw_stroke(canvas, r->right, r->bottom, r->left, r->bottom, width, INK);
    loxo_draw_stroke(canvas, r->left, r->bottom, r->left, r->top, width, INK);
}

/* "x 10" with the power raised, then the unit; over the bar, left edges together unless it would leave the picture. */
static void draw_unit(const loxo_draw_scene *scene, const loxo_draw_layout *l, const loxo_draw_rectangle *bar,
                      const loxo_draw_canvas *canvas)
{
    const char *unit = scene->settings->unit != NULL ? scene->settings->unit : "";
    const double cap = l->cap_height, y = bar->top - 1.3 * cap;
    char power[16] = "";
    double power_width = 0.0, unit_width = loxo_draw_text_width(unit, cap);
    if (l->has_numbers && scene->has_range && l->ticks.shift != 0) {
        snprintf(power, sizeof power, "%d", l->ticks.shift);
        power_width = loxo_draw_text_width("x 10", cap) + loxo_draw_text_width(power, 0.7 * cap) + 0.8 * cap;
    }
    double x = fmin(bar->left, canvas->width - 0.5 * cap - power_width - unit_width);
    if (power[0] != '\0') {
        loxo_draw_text(canvas, "x 10", x, y, cap, LOXO_DRAW_LEFT, INK);
        loxo_draw_text(canvas, power, x + loxo_draw_text_width("x 10", cap) + 0.2 * cap, y - 0.6 * cap, 0.7 * cap,
                       LOXO_DRAW_LEFT, INK);
        x += power_width;
    }
    loxo_draw_text(canvas, unit, x, y, cap, LOXO_DRAW_LEFT, INK);
}

static void draw_bar(const loxo_draw_scene *scene, const loxo_draw_layout *l, const loxo_draw_canvas *canvas)
{
    static const uint8_t grey[3] = {LOXO_DRAW_GAP, LOXO_DRAW_GAP, LOXO_DRAW_GAP};
    const double cap = l->cap_height, line = fmax(cap / 11.0, 1.0);
    const loxo_draw_rectangle bar = {floor(l->bar.left), floor(l->bar.top), floor(l->bar.right), floor(l->bar.bottom)};
    const double length = bar.bottom - bar.top;
    if (scene->has_range) {
        for (int64_t i = 0; i < (int64_t)length; ++i) {
            const double y = bar.top + (double)i;
            const loxo_draw_rectangle row = {bar.left, y, bar.right, y + 1.0};
            double color[3];
            uint8_t rgb[3];
            loxo_draw_color(scene->settings->colormap, (bar.bottom - y - 0.5) / length, color);
            for (int k = 0; k < 3; ++k)
                rgb[k] = (uint8_t)lround(255.0 * color[k]);
            fill(canvas, &row, rgb);
        }
        frame(canvas, &bar, line);
        for (int64_t i = l->ticks.first; i <= l->ticks.last && l->has_numbers; ++i) {
            const double place = loxo_draw_place(scene, loxo_draw_tick_value(&l->ticks, i));
            const double y = bar.bottom - length * fmin(fmax(place, 0.0), 1.0);
            char text[64];
            loxo_draw_stroke(canvas, bar.right, y, bar.right + TICK_LENGTH * cap, y, line, INK);
            loxo_draw_tick_text(&l->ticks, i, text);
            loxo_draw_text(canvas, text, bar.right + NUMBER_GAP * cap, y + 0.5 * cap, cap, LOXO_DRAW_LEFT, INK);
        }
        draw_unit(scene, l, &bar, canvas);
    }
    if (scene->has_gaps) {
        const double y = floor(bar.bottom + 1.6 * cap);
        const loxo_draw_rectangle box = {bar.left, y, bar.right, floor(y + 1.3 * cap)};
        fill(canvas, &box, grey);
        frame(canvas, &box, line);
        if (l->has_numbers)
            loxo_draw_text(canvas, GAP_TEXT, bar.right + NUMBER_GAP * cap, 0.5 * (box.top + box.bottom) + 0.5 * cap,
                           cap, LOXO_DRAW_LEFT, INK);
    }
}

void loxo_draw_annotate(const loxo_draw_scene *scene, const loxo_draw_layout *layout, uint8_t *rgb)
{
    const loxo_draw_settings *s = scene->settings;
    const loxo_draw_canvas canvas = {rgb, s->width, s->height};
    if (s->title != NULL && s->title[0] != '\0') {
        const double margin = MARGIN * fmin(s->width, s->height), room = s->width - 2.0 * margin;
        double cap = TITLE_SIZE * layout->cap_height;
        const double width = loxo_draw_text_width(s->title, cap);
        const double y = margin + cap;
        if (width > room) cap *= room / width;
        loxo_draw_text(&canvas, s->title, 0.5 * s->width, y, cap, LOXO_DRAW_CENTRE, INK);
    }
    if (layout->has_bar) draw_bar(scene, layout, &canvas);
}
