/* SPDX-License-Identifier: MIT */
#include "draw/shade.h"

#include "par/range.h"

#include <math.h>

/* What the samples of one face share. Sums over the corners of edge function * inverse depth interpolate in perspective. */
typedef struct facet {
    int64_t face;
    int64_t origin[3][2], along[3][2]; /* edge opposite corner k: a point, and its direction, in 1/256 sample */
    double nearness[3];                /* inverse depth */
    double normal[3][3];               /* at the corners, toward the camera's side of the face */
    double place[3];                   /* of the value between the ends of the map */
    double slope[2][2];                /* d/dx and d/dy of the sums of 1 and of place, one sample on */
    double area;                       /* sum of the edge functions */
    bool is_back, is_gap;
} facet;

typedef struct lamp {
    double direction[3]; /* toward it, in the mesh's space */
    double strength;
} lamp;

#define N_LAMPS 3

typedef struct studio {
    const loxo_draw_scene *scene;
    const loxo_draw_palette *palette;
    const loxo_draw_cavity *cavity;
    lamp lamps[N_LAMPS];
    double half_way[3]; /* between the key lamp and the camera: where the gloss is */
    double line_half_width;
    double n_levels, level_phase; /* lines where place * n_levels + level_phase is a whole number */
    double plain_light[3], gap_light;
} studio;

/* Light of a surface that faces the camera is near 1, so its colour is that of the bar. */
#define AMBIENT       0.18
#define SKY           0.08 /* ambient from above, more than from below */
#define GLOSS         0.035
#define BACK_LIGHT    0.45
#define LINE_LIGHT    0.16 /* of the surface's own, under a line */
#define CREASE_FLAT   0.76 /* cosine between face and vertex normal: below, the corner is part of a sharp edge */
#define CREASE_SMOOTH 0.88 /* above, of a smooth surface */
#define LINE_WIDTH    1.5  /* pixels when the shorter side has 800; at least 1 */

static double smooth_step(double low, double high, double x)
{
    const double t = fmin(fmax((x - low) / (high - low), 0.0), 1.0);
    return t * t * (3.0 - 2.0 * t);
}

static void normalise(double v[3])
{
    const double length = sqrt(loxo_draw_dot(v, v));
    for (int k = 0; k < 3; ++k)
        v[k] = length > 0.0 ? v[k] / length : 0.0;
}

static void set_lamp(lamp *l, const loxo_draw_scene *scene, double x, double y, double z, double strength)
{
    for (int k = 0; k < 3; ++k)
        l->direction[k] = x * scene->right[k] + y * scene->up[k] + z * scene->toward[k];
    normalise(l->direction);
    l->strength = strength;
}

static studio set_up(const loxo_draw_scene *scene, const loxo_draw_palette *palette, const loxo_draw_cavity *cavity)
{
    static const double plain_color[3] = {0.74, 0.78, 0.84};
    const loxo_draw_settings *s = scene->settings;
    studio room = {.scene = scene, .palette = palette, .cavity = cavity};
    set_lamp(&room.lamps[0], scene, -0.5, 0.65, 0.85, 0.68); /* key: over the left shoulder */
    set_lamp(&room.lamps[1], scene, 0.0, 0.0, 1.0, 0.16);    /* head light */
    set_lamp(&room.lamps[2], scene, 0.9, -0.1, 0.6, 0.12);   /* fill: from the right */
    for (int k = 0; k < 3; ++k) {
        room.half_way[k] = room.lamps[0].direction[k] + scene->toward[k];
        room.plain_light[k] = loxo_draw_decode(plain_color[k]);
    }
    normalise(room.half_way);
    room.gap_light = loxo_draw_decode(LOXO_DRAW_GAP / 255.0);
    const double shorter = s->height < s->width ? s->height : s->width;
    room.line_half_width = 0.5 * s->supersample * LINE_WIDTH * fmax(shorter / 800.0, 2.0 / 3.0);
    if (scene->isoline_step > 0.0) {
        room.n_levels = 2.0 * (0.5 * scene->value_max - 0.5 * scene->value_min) / scene->isoline_step;
        const double first = scene->value_min / scene->isoline_step;
        room.level_phase = first - floor(first);
    }
    return room;
}

static void set_normals(const studio *room, facet *t, const loxo_index *v)
{
    const loxo_draw_scene *scene = room->scene;
    double p[3][3], a[3], b[3], flat[3];
    for (int k = 0; k < 3; ++k)
        loxo_draw_unit_point(scene, v[k], p[k]);
    for (int k = 0; k < 3; ++k)
        a[k] = p[1][k] - p[0][k], b[k] = p[2][k] - p[0][k];
    loxo_draw_cross(a, b, flat);
    normalise(flat);
    const double sign = t->is_back != scene->inside_out ? -1.0 : 1.0;
    for (int k = 0; k < 3; ++k) {
        double n[3];
        if (!loxo_draw_vertex_normal(scene, v[k], n))
            for (int i = 0; i < 3; ++i)
                n[i] = flat[i];
        const double smooth = smooth_step(CREASE_FLAT, CREASE_SMOOTH, loxo_draw_dot(n, flat));
        for (int i = 0; i < 3; ++i)
            t->normal[k][i] = sign * (smooth * n[i] + (1.0 - smooth) * flat[i]);
    }
}

static void set_facet(const studio *room, facet *t, int64_t face)
{
    const loxo_draw_scene *scene = room->scene;
    const loxo_index *v = &scene->mesh->triangle[3 * face];
    t->face = face;
    for (int k = 0; k < 3; ++k) {
        const int32_t *from = scene->xy[v[(k + 1) % 3]], *to = scene->xy[v[(k + 2) % 3]];
        for (int i = 0; i < 2; ++i) {
            t->origin[k][i] = from[i];
            t->along[k][i] = (int64_t)to[i] - from[i];
        }
        t->nearness[k] = (double)scene->inverse_depth[v[k]];
    }
    /* y runs down: faces that are counter-clockwise on paper have negative area here. */
    const int64_t area = t->along[2][0] * t->along[0][1] - t->along[2][1] * t->along[0][0];
    t->is_back = (area > 0) != scene->inside_out;
    set_normals(room, t, v);

    t->area = (double)area;
    t->is_gap = false;
    for (int k = 0; k < 3 && scene->value != NULL; ++k) {
        const double value = scene->value[v[k]];
        t->place[k] = isfinite(value) && scene->has_range ? loxo_draw_place(scene, value) : (double)NAN;
        t->place[k] = t->place[k] > 1e6 ? 1e6 : t->place[k] < -1e6 ? -1e6 : t->place[k];
        t->is_gap = t->is_gap || isnan(t->place[k]);
    }
    const bool has_place = scene->value != NULL && !t->is_gap;
    for (int i = 0; i < 2; ++i) {
        t->slope[i][0] = t->slope[i][1] = 0.0;
        for (int k = 0; k < 3; ++k) {
            const double step = i == 0 ? -(double)t->along[k][1] : (double)t->along[k][0];
            t->slope[i][0] += LOXO_DRAW_SUBSAMPLE * step * t->nearness[k];
            t->slope[i][1] += LOXO_DRAW_SUBSAMPLE * step * t->nearness[k] * (has_place ? t->place[k] : 0.0);
        }
    }
}

/* How much of the sample a line of equal value covers. Its distance is that of the value from the nearest level over
 * the steepness on the screen, so lines are equally wide however steep the field and however tilted the face. */
static double line_cover(const studio *room, const facet *t, double place, double per_sum)
{
    double steepness = 0.0;
    for (int i = 0; i < 2; ++i) {
        const double d = (t->slope[i][1] - place * t->slope[i][0]) * per_sum;
        steepness += d * d;
    }
    steepness = room->n_levels * sqrt(steepness);
    if (!(steepness > 1e-12)) return 0.0;
    const double level_number = place * room->n_levels + room->level_phase, level = rint(level_number);
    const double level_place = (level - room->level_phase) / room->n_levels;
    if (!(level_place > 1e-6 && level_place < 1.0 - 1e-6)) return 0.0; /* the ends of the map are no lines */
    const double distance = fabs(level_number - level) / steepness, width = 2.0 * room->line_half_width;
    const double cover = fmin(fmax(room->line_half_width + 0.5 - distance, 0.0), 1.0);
    /* Where lines crowd they fade, so that steep places do not turn black. */
    return cover * smooth_step(1.0 * width, 2.5 * width, 1.0 / steepness);
}

/* Adds the light of a sample (its centre in 1/256, what it sees in that depth) to light. */
static void add_sample(const studio *room, const facet *t, int64_t x, int64_t y, double depth, double light[3])
{
    double weight[3], sum = 0.0, place = 0.0, n[3] = {0.0, 0.0, 0.0}, color[3];
    for (int k = 0; k < 3; ++k) {
        const int64_t e = t->along[k][0] * (y - t->origin[k][1]) - t->along[k][1] * (x - t->origin[k][0]);
        weight[k] = (double)e * t->nearness[k];
        sum += weight[k];
    }
    const double per_sum = 1.0 / sum; /* the face was hit, so its area is not 0 */
    for (int k = 0; k < 3; ++k) {
        weight[k] *= per_sum;
        for (int i = 0; i < 3; ++i)
            n[i] += weight[k] * t->normal[k][i];
    }
    normalise(n);

    double shade = AMBIENT + SKY * 0.5 * (1.0 + loxo_draw_dot(n, room->scene->up));
    for (int i = 0; i < N_LAMPS; ++i)
        shade += room->lamps[i].strength * fmax(0.0, loxo_draw_dot(n, room->lamps[i].direction));
    /* sum / area is the inverse depth, so the depth changes by -slope / area * depth^2. */
    const double bend = -depth * depth / t->area, slope[2] = {bend * t->slope[0][0], bend * t->slope[1][0]};
    shade *= loxo_draw_cavity_light(room->cavity, (double)x / LOXO_DRAW_SUBSAMPLE, (double)y / LOXO_DRAW_SUBSAMPLE,
                                    depth, slope);
    double gloss = fmax(0.0, loxo_draw_dot(n, room->half_way));
    for (int i = 0; i < 5; ++i)
        gloss *= gloss; /* to the 32nd in the end */
    gloss *= GLOSS;
    if (t->is_back) shade *= BACK_LIGHT, gloss = 0.0;

    if (room->scene->value == NULL) {
        for (int k = 0; k < 3; ++k)
            color[k] = room->plain_light[k];
    } else if (t->is_gap) {
        for (int k = 0; k < 3; ++k)
            color[k] = room->gap_light;
    } else {
        for (int k = 0; k < 3; ++k)
            place += weight[k] * t->place[k];
        const int i = (int)lrint(fmin(fmax(place, 0.0), 1.0) * (LOXO_DRAW_N_COLORS - 1));
        const double cover = room->scene->isoline_step > 0.0 ? line_cover(room, t, place, per_sum) : 0.0;
        shade *= 1.0 - cover * (1.0 - LINE_LIGHT);
        gloss *= 1.0 - cover;
        for (int k = 0; k < 3; ++k)
            color[k] = (double)room->palette->light[i][k];
    }
    for (int k = 0; k < 3; ++k)
        light[k] += fmin(shade * color[k] + gloss, 1.0);
}

uint8_t loxo_draw_byte(const loxo_draw_palette *palette, double light)
{
    return palette->encoded[(int)lrint(LOXO_DRAW_N_ENCODED * sqrt(fmin(fmax(light, 0.0), 1.0)))];
}

static void shade_row(const studio *room, const uint64_t *visible, int row, uint8_t *rgb)
{
    const int samples = room->scene->settings->supersample, width = room->scene->settings->width;
    const int64_t stride = (int64_t)width * samples;
    const double per_pixel = 1.0 / (samples * samples), background = loxo_draw_decode(LOXO_DRAW_BACKGROUND / 255.0);
    facet t = {.face = -1};
    for (int column = 0; column < width; ++column) {
        double light[3] = {0.0, 0.0, 0.0};
        int n_empty = 0;
        for (int j = 0; j < samples; ++j) {
            for (int i = 0; i < samples; ++i) {
                const int64_t x = (int64_t)column * samples + i;
                const uint64_t key = visible[j * stride + x];
                if (key == 0) {
                    n_empty += 1;
                    continue;
                }
                const int64_t face = (int64_t)(0xffffffffu - (key & 0xffffffffu));
                if (t.face != face) set_facet(room, &t, face);
                add_sample(room, &t, x * LOXO_DRAW_SUBSAMPLE + LOXO_DRAW_SUBSAMPLE / 2,
                           ((int64_t)row * samples + j) * LOXO_DRAW_SUBSAMPLE + LOXO_DRAW_SUBSAMPLE / 2,
                           loxo_draw_depth(key), light);
            }
        }
        for (int k = 0; k < 3; ++k)
            rgb[3 * column + k] = n_empty == samples * samples
                                      ? LOXO_DRAW_BACKGROUND
                                      : loxo_draw_byte(room->palette, (light[k] + n_empty * background) * per_pixel);
    }
}

void loxo_draw_shade(loxo_context *ctx, const loxo_draw_scene *scene, const loxo_draw_palette *palette,
                     const loxo_draw_cavity *cavity, const uint64_t *visible, int row_begin, int row_end, uint8_t *rgb)
{
    const studio room = set_up(scene, palette, cavity);
    const int samples = scene->settings->supersample, width = scene->settings->width;
    const int64_t row_samples = (int64_t)width * samples * samples;
#pragma omp parallel for num_threads(loxo_threads_for(ctx, row_end - row_begin, 50.0 * (double)row_samples))           \
    schedule(dynamic, 4)
    for (int row = row_begin; row < row_end; ++row)
        shade_row(&room, &visible[(row - row_begin) * row_samples], row, &rgb[(int64_t)3 * width * row]);
}
