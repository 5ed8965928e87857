/* paint.c: anti-aliased lines, discs and rings on a canvas: coverage of a pixel is the distance of its centre inside
 * the edge.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/paint.h"

#include <math.h>

static void blend(vgi_canvas *c, size_t x, size_t y, double cover, const unsigned char colour[3])
{
    unsigned char *to = c->rgb + 3 * (y * c->w + x);
    for (int k = 0; k < 3; k++) to[k] = (unsigned char)lround(to[k] + cover * (colour[k] - (double)to[k]));
}

/* Range of pixels from least to most, clipped to the canvas; false if it is empty. */
static bool pixels_of(const vgi_canvas *c, const double least[2], const double most[2], size_t first[2], size_t last[2])
{
    const size_t size[2] = {c->w, c->h};
    for (int k = 0; k < 2; k++) {
        if (!(most[k] >= 0 && least[k] < (double)size[k])) return false;
        first[k] = least[k] > 0 ? (size_t)least[k] : 0;
        last[k] = most[k] < (double)size[k] - 1 ? (size_t)most[k] : size[k] - 1;
    }
    return true;
}

/* Paint all pixels whose distance from a segment is between `inside` and `outside`. */
static void paint(vgi_canvas *c, const double a[2], const double b[2], double inside, double outside,
                  const unsigned char colour[3])
{
    double least[2], most[2], along[2] = {b[0] - a[0], b[1] - a[1]}, square = along[0] * along[0] + along[1] * along[1];
    size_t first[2], last[2];
    for (int k = 0; k < 2; k++) {
        least[k] = fmin(a[k], b[k]) - outside - 1;
        most[k] = fmax(a[k], b[k]) + outside + 1;
    }
    if (!pixels_of(c, least, most, first, last)) return;
    for (size_t y = first[1]; y <= last[1]; y++)
        for (size_t x = first[0]; x <= last[0]; x++) {
            double u = (double)x + 0.5 - a[0], v = (double)y + 0.5 - a[1];
            double share = square > 0 ? fmin(fmax((u * along[0] + v * along[1]) / square, 0), 1) : 0;
            double far = hypot(u - share * along[0], v - share * along[1]);
            double cover = fmin(fmin(outside - far, far - inside) + 0.5, 1);
            if (cover > 0) blend(c, x, y, cover, colour);
        }
}

void vgi_paint_line(vgi_canvas *c, const double a[2], const double b[2], double width, const unsigned char colour[3])
{
    paint(c, a, b, -1, width / 2, colour);
}

void vgi_paint_disc(vgi_canvas *c, const double at[2], double radius, const unsigned char colour[3])
{
    paint(c, at, at, -1, radius, colour);
}

void vgi_paint_ring(vgi_canvas *c, const double at[2], double radius, double width, const unsigned char colour[3])
{
    paint(c, at, at, radius - width / 2, radius + width / 2, colour);
}

void vgi_paint_box(vgi_canvas *c, const double at[2], double half, double width, const unsigned char colour[3])
{
    for (int side = 0; side < 4; side++) {
        double sign = side < 2 ? -1 : 1, a[2] = {at[0] - half, at[1] - half}, b[2] = {at[0] + half, at[1] + half};
        a[side % 2] = b[side % 2] = at[side % 2] + sign * half;
        vgi_paint_line(c, a, b, width, colour);
    }
}

void vgi_paint_cross(vgi_canvas *c, const double at[2], double half, double width, const unsigned char colour[3])
{
    vgi_paint_line(c, (double[]){at[0] - half, at[1] - half}, (double[]){at[0] + half, at[1] + half}, width, colour);
    vgi_paint_line(c, (double[]){at[0] - half, at[1] + half}, (double[]){at[0] + half, at[1] - half}, width, colour);
}
