/* wide_polar.h: the rotation nearest to a 3 x 3 matrix in every lane. Included by *_kernel.c alone.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_WIDE_POLAR_H
#define VG_WIDE_POLAR_H

#include "core/wide.h"
#include "numeric/polar.h"

/* Stopping rule of the iteration. Pass a constant. */
typedef struct vgi_polar_stop {
    int scaled;    /* steps with scaling; later ones converge quadratically */
    double enough; /* squared change below which a step is the last; the error is then smaller still */
    bool alone;    /* each lane stops separately, so that its last bits do not depend on its neighbours */
} vgi_polar_stop;

/* The factors g / 2 of x and 1 / (2 g det) of its cofactors c in a step that balances the norms of x and x^-T. g is found
 * in binary32, since any near it does; 1 / g is refined to rounding, since the two belong together. */
VGI_INLINE void vgi_polar_scale(const vgi_wide *x, const vgi_wide *c, vgi_wide det, vgi_wide *a, vgi_wide *b)
{
    vgi_rough xx = __builtin_convertvector(vgi_wide_squares(x), vgi_rough),
              cc = __builtin_convertvector(vgi_wide_squares(c), vgi_rough),
              g = vgi_rough_roots(vgi_rough_roots(cc / xx) / __builtin_convertvector(det, vgi_rough));
    vgi_wide scale = __builtin_convertvector(g, vgi_wide), inverse = __builtin_convertvector(1 / g, vgi_wide);
    inverse *= 2 - scale * inverse;
    *a = 0.5 * scale, *b = inverse * (0.5 / det);
}

/* One Newton step in the active lanes, scaled or not. Returns the squared change. */
VGI_INLINE vgi_wide vgi_polar_step(vgi_wide *x, bool scaled, bool all, vgi_mask going)
{
    vgi_wide c[9], det = vgi_wide_cofactors(x, c), a, b, change = {0}; /* c: det x^-T */
    if (scaled) {
        vgi_polar_scale(x, c, det, &a, &b);
    } else {
        a = vgi_same(0.5), b = 0.5 / det;
    }
#pragma GCC unroll 9
    for (int i = 0; i < 9; i++) {
        vgi_wide y = a * x[i] + b * c[i], d = y - x[i];
        change += d * d;
        x[i] = all ? y : vgi_either(going, y, x[i]);
    }
    return change;
}

/* vgi_wide_polar: x := the rotation nearest to m, row-major: Newton's iteration (Higham 1986) where m is not nearly
 * flat, vgi_fit_rotation in the other lanes. */
VGI_INLINE void vgi_wide_polar(const vgi_wide *m, vgi_wide *x, vgi_polar_stop stop)
{
    enum { MOST = 16 };
    static const double thin = 1e-3; /* for a matrix of norm 1, smallest determinant for Newton's iteration */
    vgi_wide size2 = vgi_wide_squares(m), c[9];
    vgi_wide shrink = vgi_roots(3.0 / size2);
#pragma GCC unroll 9
    for (int i = 0; i < 9; i++) x[i] = m[i] * shrink;
    vgi_mask good = vgi_wide_cofactors(x, c) > vgi_same(5.2 * thin), going = ~(vgi_mask){0}; /* false for NaN */
    unsigned bad = vgi_bits(~good);
    if (bad)
        for (int i = 0; i < 9; i++) x[i] = vgi_either(good, x[i], vgi_same(i % 4 == 0)); /* inactive */
    for (int step = 0; step < MOST; step++) {
        vgi_wide change = vgi_polar_step(x, step < stop.scaled, !stop.alone, going);
        vgi_mask more = change >= vgi_same(stop.enough);
        if (stop.alone) more = going = step < stop.scaled ? going : going & more;
        if (!vgi_bits(more)) break;
    }
    for (int k = 0; bad >> k; k++) {
        if (!(bad >> k & 1)) continue;
        double one[9], r[9];
        for (int i = 0; i < 9; i++) one[i] = m[i][k];
        vgi_fit_rotation(one, r);
        for (int i = 0; i < 9; i++) x[i][k] = r[i];
    }
}

#endif
