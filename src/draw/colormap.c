/* SPDX-License-Identifier: MIT */
#include "draw/colormap.h"

#include <math.h>

#define N_NODES 33

/* Entries 0, 8, 16, ..., 248 and 255 of the published 256-entry tables, both dedicated to the public domain (CC0).
 * Between them the colours are straight in sRGB; both maps grow evenly in lightness and stay readable in grey and with
 * red-green colour blindness.
 * source  viridis: van der Walt, Smith 2015; cividis: Nunez, Anderton, Renslow 2018, Optimizing colormaps with
 *         consideration for color vision deficiency, PLOS ONE 13(7) */
static const double viridis[N_NODES][3] = {
    {0.267004, 0.004874, 0.329415}, {0.277018, 0.050344, 0.375715}, {0.282327, 0.094955, 0.417331},
    {0.282884, 0.135920, 0.453427}, {0.278826, 0.175490, 0.483397}, {0.270595, 0.214069, 0.507052},
    {0.258965, 0.251537, 0.524736}, {0.244972, 0.287675, 0.537260}, {0.229739, 0.322361, 0.545706},
    {0.214298, 0.355619, 0.551184}, {0.199430, 0.387607, 0.554642}, {0.185556, 0.418570, 0.556753},
    {0.172719, 0.448791, 0.557885}, {0.160665, 0.478540, 0.558115}, {0.149039, 0.508051, 0.557250},
    {0.137770, 0.537492, 0.554906}, {0.127568, 0.566949, 0.550556}, {0.120565, 0.596422, 0.543611},
    {0.120638, 0.625828, 0.533488}, {0.132268, 0.655014, 0.519661}, {0.157851, 0.683765, 0.501686},
    {0.196571, 0.711827, 0.479221}, {0.246070, 0.738910, 0.452024}, {0.304148, 0.764704, 0.419943},
    {0.369214, 0.788888, 0.382914}, {0.440137, 0.811138, 0.340967}, {0.515992, 0.831158, 0.294279},
    {0.595839, 0.848717, 0.243329}, {0.678489, 0.863742, 0.189503}, {0.762373, 0.876424, 0.137064},
    {0.845561, 0.887322, 0.099702}, {0.926106, 0.897330, 0.104071}, {0.993248, 0.906157, 0.143936},
};

static const double cividis[N_NODES][3] = {
    {0.000000, 0.135112, 0.304751}, {0.000000, 0.157932, 0.357521}, {0.000000, 0.178802, 0.414764},
    {0.017852, 0.198528, 0.441248}, {0.103401, 0.220406, 0.435790}, {0.154261, 0.242475, 0.430120},
    {0.195057, 0.264372, 0.425924}, {0.230871, 0.286134, 0.423498}, {0.263738, 0.307831, 0.422789},
    {0.294669, 0.329531, 0.423716}, {0.324250, 0.351289, 0.426250}, {0.352892, 0.373153, 0.430226},
    {0.380830, 0.395164, 0.435653}, {0.408226, 0.417357, 0.442570}, {0.435168, 0.439763, 0.451134},
    {0.461616, 0.462405, 0.461969}, {0.488697, 0.485318, 0.471008}, {0.517920, 0.508454, 0.472707},
    {0.547840, 0.531895, 0.471704}, {0.578236, 0.555673, 0.468724}, {0.609105, 0.579816, 0.463638},
    {0.640352, 0.604354, 0.456791}, {0.671991, 0.629316, 0.448018}, {0.704037, 0.654731, 0.437147},
    {0.736488, 0.680629, 0.424028}, {0.769353, 0.707035, 0.408516}, {0.802667, 0.733978, 0.390153},
    {0.836429, 0.761483, 0.368747}, {0.870717, 0.789572, 0.343333}, {0.905589, 0.818257, 0.312889},
    {0.941147, 0.847530, 0.275815}, {0.977780, 0.877281, 0.227954}, {0.995737, 0.909344, 0.217772},
};

void loxo_draw_color(loxo_colormap map, double t, double rgb[3])
{
    const double x = 255.0 * fmin(fmax(t, 0.0), 1.0); /* place in the published table */
    if (map == LOXO_COLORMAP_GRAY) {
        for (int k = 0; k < 3; ++k)
            rgb[k] = 0.1 + 0.8 * x / 255.0; /* neither end is lost in shadow or background */
        return;
    }
    const double(*nodes)[3] = map == LOXO_COLORMAP_CIVIDIS ? cividis : viridis;
    int i = (int)(x / 8.0);
    if (i > N_NODES - 2) i = N_NODES - 2;
    const double width = i == N_NODES - 2 ? 7.0 : 8.0, s = (x - 8.0 * i) / width;
    for (int k = 0; k < 3; ++k)
        rgb[k] = nodes[i][k] + s * (nodes[i + 1][k] - nodes[i][k]);
}

/* IEC 61966-2-1 */
double loxo_draw_decode(double srgb) { return srgb <= 0.04045 ? srgb / 12.92 : pow((srgb + 0.055) / 1.055, 2.4); }

double loxo_draw_encode(double light)
{
    return light <= 0.0031308 ? 12.92 * light : 1.055 * pow(light, 1.0 / 2.4) - 0.055;
}

void loxo_draw_palette_fill(loxo_draw_palette *palette, loxo_colormap map)
{
    for (int i = 0; i < LOXO_DRAW_N_COLORS; ++i) {
        double rgb[3];
        loxo_draw_color(map, i / (LOXO_DRAW_N_COLORS - 1.0), rgb);
        for (int k = 0; k < 3; ++k)
            palette->light[i][k] = (float)loxo_draw_decode(rgb[k]);
    }
    for (int i = 0; i <= LOXO_DRAW_N_ENCODED; ++i) {
        const double root = (double)i / LOXO_DRAW_N_ENCODED;
        palette->encoded[i] = (uint8_t)lround(255.0 * loxo_draw_encode(root * root));
    }
}
