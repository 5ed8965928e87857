/* colour.c: colour maps, and the conversion of linear light to bytes. The sequential map is a path in OKLab (Ottosson
 * 2020) whose lightness increases evenly from deep indigo over teal to light yellow, so that it can be read in grey
 * and by colour-blind people. The diverging map goes from blue over light grey to orange. Lights are in shade.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/view.h"

#include <math.h>

typedef struct stop { /* lightness, chroma, hue in degrees */
    double l, c, h;
} stop;

/* The darkest colour is light enough for shading to show the shape. Chroma stays inside sRGB. */
static const stop rising[] = {
    {0.380, 0.130, 284}, {0.490, 0.115, 258}, {0.590, 0.105, 220}, {0.690, 0.120, 178},
    {0.780, 0.150, 150}, {0.860, 0.170, 125}, {0.930, 0.175, 105},
};

/* Both ends have nearly the same lightness, so that neither dominates; the hue may jump in the middle, where there
 * is no chroma. */
static const stop parting[] = {
    {0.450, 0.150, 262}, {0.600, 0.130, 255}, {0.765, 0.080, 245}, {0.930, 0.000, 240},
    {0.930, 0.000, 62},  {0.790, 0.095, 62},  {0.640, 0.150, 50},  {0.480, 0.160, 36},
};

static void from_oklab(double l, double a, double b, float linear[3])
{
    double x = l + 0.3963377774 * a + 0.2158037573 * b;
    double y = l - 0.1055613458 * a - 0.0638541728 * b;
    double z = l - 0.0894841775 * a - 1.2914855480 * b;
    x *= x * x, y *= y * y, z *= z * z;
    double rgb[3] = {4.0767416621 * x - 3.3077115913 * y + 0.2309699292 * z,
                     -1.2684380046 * x + 2.6097574011 * y - 0.3413193965 * z,
                     -0.0041960863 * x - 0.7034186147 * y + 1.7076147010 * z};
    for (int k = 0; k < 3; k++) linear[k] = (float)fmin(fmax(rgb[k], 0), 1);
}

/* A path of n stops, t from 0 to 1. */
static void follow_path(const stop *path, size_t n, double t, float linear[3])
{
    double at = t * (double)(n - 1);
    size_t i = at >= (double)(n - 1) ? n - 2 : (size_t)at;
    double u = at - (double)i, w = 1 - u;
    const stop *p = path + i, *q = p + 1;
    double c = w * p->c + u * q->c, h = (w * p->h + u * q->h) * (M_PI / 180);
    from_oklab(w * p->l + u * q->l, c * cos(h), c * sin(h), linear);
}

void vgi_map_colour(double t, bool diverging, float linear[3])
{
    enum { RISING = sizeof rising / sizeof *rising, HALF = sizeof parting / sizeof *parting / 2 };
    double x = fmin(fmax(t, 0), 1);
    if (!diverging) follow_path(rising, RISING, x, linear);
    else if (x < 0.5) follow_path(parting, HALF, 2 * x, linear);
    else follow_path(parting + HALF, HALF, 2 * x - 1, linear);
}

float vgi_linear(unsigned char srgb)
{
    double x = srgb / 255.0;
    return (float)(x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4));
}

void vgi_palette_init(vgi_palette *p, bool diverging)
{
    for (int i = 0; i < VGI_MAP_STEPS; i++) vgi_map_colour(i / (VGI_MAP_STEPS - 1.0), diverging, p->map[i]);
    for (int i = 0; i <= VGI_GAMMA_STEPS; i++) {
        double x = i / (double)VGI_GAMMA_STEPS;
        double y = x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
        p->encode[i] = (unsigned char)(y * 255 + 0.5);
    }
}
