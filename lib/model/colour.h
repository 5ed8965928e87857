/* colour.h: the colours of patches, in files and in pictures; sRGB and linear light.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_COLOUR_H
#define VG_COLOUR_H

#include <math.h>
#include <stdint.h>
#include <string.h>

/* vgi_patch_colour: an sRGB colour that differs from those of neighbouring numbers: hues by the golden ratio, in
 * three shades. */
static inline void vgi_patch_colour(uint32_t patch, unsigned char rgb[3])
{
    static const unsigned char light[3] = {230, 190, 250}, dark[3] = {90, 50, 140};
    unsigned hue = (unsigned)((patch * 0x9e3779b9u) >> 16) * 6, part = hue >> 16, at = hue >> 8 & 255,
             shade = patch % 3;
    unsigned char up = (unsigned char)(dark[shade] + (light[shade] - dark[shade]) * (int)at / 255);
    unsigned char down = (unsigned char)(light[shade] - (light[shade] - dark[shade]) * (int)at / 255);
    const unsigned char of_part[6][3] = {{light[shade], up, dark[shade]}, {down, light[shade], dark[shade]},
                                         {dark[shade], light[shade], up}, {dark[shade], down, light[shade]},
                                         {up, dark[shade], light[shade]}, {light[shade], dark[shade], down}};
    memcpy(rgb, of_part[part], 3);
}

/* sRGB of 8 bits, as PLY and OBJ have it, and linear light from 0 to 1, as glTF has it. */
static inline double vgi_linear_of_srgb(unsigned char c)
{
    const double x = c / 255.0;
    return x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4);
}

static inline unsigned char vgi_byte_of(double x)
{
    return (unsigned char)(x > 0 ? x < 1 ? lrint(255 * x) : 255 : 0);
}

static inline unsigned char vgi_srgb_of_linear(double x)
{
    return vgi_byte_of(x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055);
}

#endif
