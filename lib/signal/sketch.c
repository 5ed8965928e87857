/* sketch.c: a hand-drawn curve through the pose plane.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/signal.h"

#include <stdlib.h>

/* Uniform knots 0, 1, ..., k + 1; the curve is defined from knot 2 to knot k - 1. */
static int from_controls(vgi_curve *c, const double *points, size_t n, vg_err *e)
{
    *c = (vgi_curve){.k = n};
    if (!(c->knot = vgi_array(n + 4, sizeof *c->knot, e)) ||
        !(c->control = vgi_copy_array(points, n, 2 * sizeof *points, e)))
        return VG_ENOMEM;
    for (size_t i = 0; i < n + 4; i++) c->knot[i] = (double)i - 1;
    return VG_OK;
}

static int through_points(vgi_curve *c, const double *points, size_t n, vg_err *e)
{
    double *t = vgi_array(n, sizeof *t, e);
    uint32_t *all = vgi_array(n, sizeof *all, e);
    int r = t && all ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) {
        for (size_t i = 0; i < n; i++) all[i] = (uint32_t)i;
        vgi_parameters(n, points, t);
        r = vgi_curve_fit(c, n, points, t, all, n, e);
    }
    free(t);
    free(all);
    return r;
}

int vg_signal_sketch(const double *points, size_t n, bool controls, size_t frames, double *positions, vg_err *e)
{
    vgi_curve c = {0};
    size_t least = controls ? 4 : 2;
    if (n < least)
        return vg_fail(e, VG_EINPUT, "a curve needs at least %zu %s, but there %s %zu", least,
                       controls ? "control points" : "points", n == 1 ? "is" : "are", n);
    int r = controls ? from_controls(&c, points, n, e) : through_points(&c, points, n, e);
    for (size_t i = 0; r == VG_OK && i < frames; i++) {
        double share = frames > 1 ? (double)i / (double)(frames - 1) : 0, first = c.knot[3], last = c.knot[c.k];
        vgi_curve_point(&c, first + (last - first) * share, positions + 2 * i);
    }
    vgi_curve_clear(&c);
    return r;
}
