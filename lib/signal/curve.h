/* curve.h: the parts of a vg_signal in the form of the numeric code.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SIGNAL_CURVE_H
#define VG_SIGNAL_CURVE_H

#include "signal/signal.h"

/* vgi_signal_curve: the time signal of s; the caller clears it. vgi_signal_set_curve: replace its knots and control
 * points. */
int vgi_signal_curve(const vg_signal *s, vgi_curve *c, vg_err *e) VG_MUST_CHECK;
int vgi_signal_set_curve(vg_signal *s, const vgi_curve *c, vg_err *e) VG_MUST_CHECK;
/* vgi_curve_crossings: pairs of times (the caller frees them) at which the curve is at one point, found on `parts`
 * straight segments between frames. */
int vgi_curve_crossings(const vgi_curve *c, size_t parts, double **times, size_t *count, vg_err *e) VG_MUST_CHECK;
/* vgi_signal_vector: basis vector j (d numbers), from either precision. */
void vgi_signal_vector(const vg_signal *s, size_t j, double *h);

#endif
