/* SPDX-License-Identifier: MIT */
#include "draw/font.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>

/* A glyph is a path on a grid: capitals are 20 high, small letters 14, descenders go to -6; x starts at 0.
 *   M x y          lift the pen and go there
 *   L x y          straight line
 *   A cx cy x y    quarter of an ellipse that leaves towards (cx, cy) and arrives from there */
typedef struct glyph {
    int width; /* of the ink */
    const char *path;
} glyph;

#define CAP_HEIGHT   20.0
#define GAP          5.0 /* between two glyphs */
#define PEN          2.3 /* width of the stroke */
#define MAX_SEGMENTS 128
#define ARC_STEPS    8

static const glyph glyphs[95] = {
    /*   */ {3, ""},
    /* ! */ {0, "M 0 20 L 0 7 M 0 0 L 0 1"},
    /* " */ {5, "M 0 20 L 0 14 M 5 20 L 5 14"},
    /* # */ {14, "M 5 19 L 2 1 M 12 19 L 9 1 M 0 13 L 14 13 M 0 7 L 14 7"},
    /* $ */ {12, "M 12 16 A 12 20 6 20 A 0 20 0 15 A 0 10 6 10 A 12 10 12 5 A 12 0 6 0 A 0 0 0 4 M 6 23 L 6 -3"},
    /* % */
    {16, "M 14 20 L 2 0 M 4 20 A 0 20 0 16 A 0 12 4 12 A 8 12 8 16 A 8 20 4 20 "
         "M 12 8 A 8 8 8 4 A 8 0 12 0 A 16 0 16 4 A 16 8 12 8"},
    /* & */ {14, "M 14 0 L 3 13 A 2 20 6 20 A 10 20 10 16 A 10 13 5 10 A 0 8 0 5 A 0 0 6 0 A 12 0 13 8"},
    /* ' */ {0, "M 0 20 L 0 14"},
    /* ( */ {4, "M 4 22 A 0 18 0 9 A 0 0 4 -4"},
    /* ) */ {4, "M 0 22 A 4 18 4 9 A 4 0 0 -4"},
    /* * */ {10, "M 5 20 L 5 8 M 0 17 L 10 11 M 10 17 L 0 11"},
    /* + */ {12, "M 6 15 L 6 3 M 0 9 L 12 9"},
    /* , */ {1, "M 1 1 L 0 -4"},
    /* - */ {9, "M 0 9 L 9 9"},
    /* . */ {1, "M 0 0 L 1 0 L 1 1 L 0 1 L 0 0"},
    /* / */ {9, "M 9 21 L 0 -3"},
    /* 0 */ {12, "M 6 20 A 0 20 0 13 L 0 7 A 0 0 6 0 A 12 0 12 7 L 12 13 A 12 20 6 20"},
    /* 1 */ {12, "M 2 16 L 7 20 L 7 0 M 2 0 L 12 0"},
    /* 2 */ {12, "M 0 15 A 0 20 6 20 A 12 20 12 15 A 12 11 9 8 L 0 0 L 12 0"},
    /* 3 */ {12, "M 0 17 A 1 20 6 20 A 11 20 11 16 A 11 11 5 11 A 12 11 12 5 A 12 0 6 0 A 0 0 0 4"},
    /* 4 */ {12, "M 9 0 L 9 20 L 0 6 L 12 6"},
    /* 5 */ {12, "M 11 20 L 1 20 L 0 10 A 2 13 6 13 A 12 13 12 6 A 12 0 6 0 A 1 0 0 3"},
    /* 6 */ {12, "M 11 17 A 10 20 6 20 A 0 20 0 11 L 0 6 A 0 0 6 0 A 12 0 12 6 A 12 12 6 12 A 0 12 0 6"},
    /* 7 */ {12, "M 0 20 L 12 20 L 4 0"},
    /* 8 */
    {12, "M 6 11 A 1 11 1 16 A 1 20 6 20 A 11 20 11 16 A 11 11 6 11 A 0 11 0 5 A 0 0 6 0 A 12 0 12 5 A 12 11 6 11"},
    /* 9 */ {12, "M 1 3 A 2 0 6 0 A 12 0 12 9 L 12 14 A 12 20 6 20 A 0 20 0 14 A 0 8 6 8 A 12 8 12 14"},
    /* : */ {1, "M 0 0 L 1 0 L 1 1 L 0 1 L 0 0 M 0 11 L 1 11 L 1 12 L 0 12 L 0 11"},
    /* ; */ {1, "M 1 1 L 0 -4 M 0 11 L 1 11 L 1 12 L 0 12 L 0 11"},
    /* < */ {11, "M 11 15 L 0 9 L 11 3"},
    /* = */ {12, "M 0 12 L 12 12 M 0 6 L 12 6"},
    /* > */ {11, "M 0 15 L 11 9 L 0 3"},
    /* ? */ {10, "M 0 16 A 0 20 5 20 A 10 20 10 15 A 10 12 7 10 A 5 9 5 6 M 5 0 L 5 1"},
    /* @ */
    {20, "M 14 9 A 14 13 10 13 A 6 13 6 9 A 6 5 10 5 A 14 5 14 9 M 14 13 L 14 7 A 14 5 16 5 A 20 5 20 10 "
         "A 20 19 10 19 A 0 19 0 9 A 0 -1 10 -1 A 13 -1 15 0"},
    /* A */ {14, "M 0 0 L 7 20 L 14 0 M 2 6 L 12 6"},
    /* B */ {12, "M 0 0 L 0 20 L 6 20 A 11 20 11 16 A 11 11 6 11 L 0 11 M 6 11 A 12 11 12 5 A 12 0 6 0 L 0 0"},
    /* C */ {13, "M 13 16 A 12 20 7 20 A 0 20 0 12 L 0 8 A 0 0 7 0 A 12 0 13 4"},
    /* D */ {13, "M 0 0 L 0 20 L 5 20 A 13 20 13 12 L 13 8 A 13 0 5 0 L 0 0"},
    /* E */ {11, "M 11 20 L 0 20 L 0 0 L 11 0 M 0 10 L 9 10"},
    /* F */ {11, "M 11 20 L 0 20 L 0 0 M 0 10 L 9 10"},
    /* G */ {13, "M 13 16 A 12 20 7 20 A 0 20 0 12 L 0 8 A 0 0 7 0 A 13 0 13 5 L 13 9 L 8 9"},
    /* H */ {13, "M 0 0 L 0 20 M 13 0 L 13 20 M 0 10 L 13 10"},
    /* I */ {0, "M 0 0 L 0 20"},
    /* J */ {8, "M 8 20 L 8 5 A 8 0 4 0 A 0 0 0 4"},
    /* K */ {12, "M 0 0 L 0 20 M 12 20 L 0 7 M 4 11 L 12 0"},
    /* L */ {10, "M 0 20 L 0 0 L 10 0"},
    /* M */ {16, "M 0 0 L 0 20 L 8 6 L 16 20 L 16 0"},
    /* N */ {13, "M 0 0 L 0 20 L 13 0 L 13 20"},
    /* O */ {14, "M 7 20 A 0 20 0 12 L 0 8 A 0 0 7 0 A 14 0 14 8 L 14 12 A 14 20 7 20"},
    /* P */ {12, "M 0 0 L 0 20 L 6 20 A 12 20 12 14 A 12 9 6 9 L 0 9"},
    /* Q */ {14, "M 7 20 A 0 20 0 12 L 0 8 A 0 0 7 0 A 14 0 14 8 L 14 12 A 14 20 7 20 M 9 5 L 14 -1"},
    /* R */ {12, "M 0 0 L 0 20 L 6 20 A 12 20 12 14 A 12 9 6 9 L 0 9 M 6 9 L 12 0"},
    /* S */ {12, "M 12 16 A 12 20 6 20 A 0 20 0 15 A 0 10 6 10 A 12 10 12 5 A 12 0 6 0 A 0 0 0 4"},
    /* T */ {12, "M 0 20 L 12 20 M 6 20 L 6 0"},
    /* U */ {12, "M 0 20 L 0 6 A 0 0 6 0 A 12 0 12 6 L 12 20"},
    /* V */ {14, "M 0 20 L 7 0 L 14 20"},
    /* W */ {20, "M 0 20 L 5 0 L 10 18 L 15 0 L 20 20"},
    /* X */ {13, "M 0 20 L 13 0 M 13 20 L 0 0"},
    /* Y */ {12, "M 0 20 L 6 10 L 12 20 M 6 10 L 6 0"},
    /* Z */ {12, "M 0 20 L 12 20 L 0 0 L 12 0"},
    /* [ */ {4, "M 4 22 L 0 22 L 0 -4 L 4 -4"},
    /* \ */ {9, "M 0 21 L 9 -3"},
    /* ] */ {4, "M 0 22 L 4 22 L 4 -4 L 0 -4"},
    /* ^ */ {10, "M 0 12 L 5 20 L 10 12"},
    /* _ */ {12, "M 0 -4 L 12 -4"},
    /* ` */ {4, "M 0 20 L 4 16"},
    /* a */ {10, "M 1 11 A 1 14 5 14 A 10 14 10 10 L 10 0 M 10 8 L 4 8 A 0 8 0 4 A 0 0 4 0 A 10 0 10 5"},
    /* b */ {11, "M 0 20 L 0 0 M 0 7 A 0 14 6 14 A 11 14 11 7 A 11 0 6 0 A 0 0 0 7"},
    /* c */ {10, "M 10 11 A 9 14 6 14 A 0 14 0 7 A 0 0 6 0 A 9 0 10 3"},
    /* d */ {11, "M 11 20 L 11 0 M 11 7 A 11 14 5 14 A 0 14 0 7 A 0 0 5 0 A 11 0 11 7"},
    /* e */ {11, "M 0 7 L 11 7 A 11 14 6 14 A 0 14 0 7 A 0 0 6 0 A 9 0 10 3"},
    /* f */ {7, "M 7 20 A 3 20 3 16 L 3 0 M 0 14 L 7 14"},
    /* g */ {11, "M 11 7 A 11 14 5 14 A 0 14 0 7 A 0 0 5 0 A 11 0 11 7 M 11 14 L 11 -1 A 11 -6 5 -6 A 1 -6 0 -4"},
    /* h */ {10, "M 0 20 L 0 0 M 0 8 A 0 14 5 14 A 10 14 10 9 L 10 0"},
    /* i */ {0, "M 0 14 L 0 0 M 0 19 L 0 20"},
    /* j */ {4, "M 4 14 L 4 -2 A 4 -6 0 -6 M 4 19 L 4 20"},
    /* k */ {10, "M 0 20 L 0 0 M 9 14 L 0 5 M 3 8 L 10 0"},
    /* l */ {3, "M 0 20 L 0 3 A 0 0 3 0"},
    /* m */ {16, "M 0 14 L 0 0 M 0 9 A 0 14 4 14 A 8 14 8 9 L 8 0 M 8 9 A 8 14 12 14 A 16 14 16 9 L 16 0"},
    /* n */ {10, "M 0 14 L 0 0 M 0 8 A 0 14 5 14 A 10 14 10 9 L 10 0"},
    /* o */ {12, "M 6 14 A 0 14 0 7 A 0 0 6 0 A 12 0 12 7 A 12 14 6 14"},
    /* p */ {11, "M 0 14 L 0 -6 M 0 7 A 0 14 6 14 A 11 14 11 7 A 11 0 6 0 A 0 0 0 7"},
    /* q */ {11, "M 11 14 L 11 -6 M 11 7 A 11 14 5 14 A 0 14 0 7 A 0 0 5 0 A 11 0 11 7"},
    /* r */ {6, "M 0 14 L 0 0 M 0 8 A 0 14 6 14"},
    /* s */ {9, "M 9 11 A 9 14 5 14 A 0 14 0 11 A 0 7 5 7 A 9 7 9 3 A 9 0 4 0 A 0 0 0 3"},
    /* t */ {7, "M 3 19 L 3 4 A 3 0 7 0 M 0 14 L 7 14"},
    /* u */ {10, "M 0 14 L 0 5 A 0 0 5 0 A 10 0 10 6 M 10 14 L 10 0"},
    /* v */ {12, "M 0 14 L 6 0 L 12 14"},
    /* w */ {16, "M 0 14 L 4 0 L 8 12 L 12 0 L 16 14"},
    /* x */ {10, "M 0 14 L 10 0 M 10 14 L 0 0"},
    /* y */ {12, "M 0 14 L 6 0 M 12 14 L 6 0 L 5 -3 A 4 -6 0 -6"},
    /* z */ {10, "M 0 14 L 10 14 L 0 0 L 10 0"},
    /* { */ {6, "M 6 22 A 3 22 3 18 L 3 13 A 3 9 0 9 A 3 9 3 5 L 3 0 A 3 -4 6 -4"},
    /* | */ {0, "M 0 22 L 0 -4"},
    /* } */ {6, "M 0 22 A 3 22 3 18 L 3 13 A 3 9 6 9 A 3 9 3 5 L 3 0 A 3 -4 0 -4"},
    /* ~ */ {12, "M 0 7 A 0 11 3 11 A 5 11 6 9 A 7 7 9 7 A 12 7 12 11"},
};

static const glyph unknown = {10, "M 0 0 L 10 0 L 10 14 L 0 14 L 0 0"};

static const glyph *glyph_of(char c) { return c >= ' ' && c <= '~' ? &glyphs[c - ' '] : &unknown; }

typedef struct segment {
    double x0, y0, x1, y1;
} segment;

/* Reads the next whole number of a path. */
static double number(const char **path)
{
    const char *p = *path;
    int sign = 1, n = 0;
    while (*p == ' ')
        ++p;
    if (*p == '-') sign = -1, ++p;
    for (; *p >= '0' && *p <= '9'; ++p)
        n = 10 * n + (*p - '0');
    *path = p;
    return sign * n;
}

/* The path as straight pieces, in grid units. */
static int flatten(const char *path, segment *pieces)
{
    int n = 0;
    double x = 0.0, y = 0.0;
    while (*path != '\0') {
        const char command = *path++;
        if (command == ' ') continue;
        if (command == 'M') {
            x = number(&path), y = number(&path);
        } else if (command == 'L') {
            const double to_x = number(&path), to_y = number(&path);
            if (n < MAX_SEGMENTS) pieces[n++] = (segment){x, y, to_x, to_y};
            x = to_x, y = to_y;
        } else {
            const double corner_x = number(&path), corner_y = number(&path);
            const double to_x = number(&path), to_y = number(&path);
            const double centre_x = x + to_x - corner_x, centre_y = y + to_y - corner_y;
            const double from_x = x, from_y = y;
            for (int i = 1; i <= ARC_STEPS; ++i) {
                const double angle = acos(0.0) * i / ARC_STEPS, c = cos(angle), s = sin(angle);
                const double px = centre_x + c * (from_x - centre_x) + s * (to_x - centre_x);
                const double py = centre_y + c * (from_y - centre_y) + s * (to_y - centre_y);
                if (n < MAX_SEGMENTS) pieces[n++] = (segment){x, y, px, py};
                x = px, y = py;
            }
        }
    }
    return n;
}

static double distance_squared(const segment *s, double x, double y)
{
    const double dx = s->x1 - s->x0, dy = s->y1 - s->y0, length = dx * dx + dy * dy;
    double t = length > 0.0 ? ((x - s->x0) * dx + (y - s->y0) * dy) / length : 0.0;
    t = fmin(fmax(t, 0.0), 1.0);
    const double ex = x - s->x0 - t * dx, ey = y - s->y0 - t * dy;
    return ex * ex + ey * ey;
}

/* Inks every pixel by how much of it the pieces cover: once, however many cross there. */
static void ink_pieces(const loxo_draw_canvas *canvas, const segment *pieces, int n, double width, uint8_t ink)
{
    const double reach = 0.5 * width + 1.0;
    double left = INFINITY, top = INFINITY, right = -INFINITY, bottom = -INFINITY;
    if (n == 0) return;
    for (int i = 0; i < n; ++i) {
        left = fmin(left, fmin(pieces[i].x0, pieces[i].x1));
        right = fmax(right, fmax(pieces[i].x0, pieces[i].x1));
        top = fmin(top, fmin(pieces[i].y0, pieces[i].y1));
        bottom = fmax(bottom, fmax(pieces[i].y0, pieces[i].y1));
    }
    const int x_begin = (int)fmax(floor(left - reach), 0.0), x_end = (int)fmin(ceil(right + reach), canvas->width);
    const int y_begin = (int)fmax(floor(top - reach), 0.0), y_end = (int)fmin(ceil(bottom + reach), canvas->height);
    for (int y = y_begin; y < y_end; ++y) {
        for (int x = x_begin; x < x_end; ++x) {
            double nearest = INFINITY;
            for (int i = 0; i < n; ++i)
                nearest = fmin(nearest, distance_squared(&pieces[i], x + 0.5, y + 0.5));
            const double cover = fmin(fmax(0.5 * width + 0.5 - sqrt(nearest), 0.0), 1.0);
            if (!(cover > 0.0)) continue;
            uint8_t *pixel = &canvas->rgb[3 * ((size_t)y * (size_t)canvas->width + (size_t)x)];
            for (int k = 0; k < 3; ++k)
                pixel[k] = (uint8_t)lrint((1.0 - cover) * pixel[k] + cover * ink);
        }
    }
}

void loxo_draw_stroke(const loxo_draw_canvas *canvas, double x0, double y0, double x1, double y1, double width,
                      uint8_t ink)
{
    const segment piece = {x0, y0, x1, y1};
    ink_pieces(canvas, &piece, 1, width, ink);
}

double loxo_draw_text_width(const char *text, double cap_height)
{
    double width = 0.0;
    for (const char *c = text; *c != '\0'; ++c)
        width += glyph_of(*c)->width + GAP;
    return fmax(width - GAP, 0.0) * cap_height / CAP_HEIGHT;
}

void loxo_draw_text(const loxo_draw_canvas *canvas, const char *text, double x, double y, double cap_height,
                    loxo_draw_anchor anchor, uint8_t ink)
{
    const double unit = cap_height / CAP_HEIGHT, width = loxo_draw_text_width(text, cap_height);
    segment pieces[MAX_SEGMENTS];
    if (anchor != LOXO_DRAW_LEFT) x -= anchor == LOXO_DRAW_CENTRE ? 0.5 * width : width;
    for (const char *c = text; *c != '\0'; ++c) {
        const glyph *g = glyph_of(*c);
        const int n = flatten(g->path, pieces);
        for (int i = 0; i < n; ++i)
            pieces[i] = (segment){x + unit * pieces[i].x0, y - unit * pieces[i].y0, x + unit * pieces[i].x1,
                                  y - unit * pieces[i].y1};
        ink_pieces(canvas, pieces, n, fmax(PEN * unit, 1.1), ink);
        x += unit * (g->width + GAP);
    }
}
