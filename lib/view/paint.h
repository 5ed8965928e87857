/* paint.h: anti-aliased lines, discs and rings on a canvas.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_VIEW_PAINT_H
#define VG_VIEW_PAINT_H

#include "view/view.h"

/* Pixel (i, j) covers i .. i + 1, j .. j + 1. Everything is clipped to the canvas. */

/* vgi_paint_line: from a to b, with round ends. */
void vgi_paint_line(vgi_canvas *c, const double a[2], const double b[2], double width, const unsigned char colour[3]);
void vgi_paint_disc(vgi_canvas *c, const double at[2], double radius, const unsigned char colour[3]);
void vgi_paint_ring(vgi_canvas *c, const double at[2], double radius, double width, const unsigned char colour[3]);
/* vgi_paint_box: the border of a square with this half side */
void vgi_paint_box(vgi_canvas *c, const double at[2], double half, double width, const unsigned char colour[3]);
/* vgi_paint_cross: two diagonal lines */
void vgi_paint_cross(vgi_canvas *c, const double at[2], double half, double width, const unsigned char colour[3]);

#endif
