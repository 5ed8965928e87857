/* weights.c: the linear filters in time (low-pass and polynomial) as weights of frames. The window of frames is in
 * window.c; the robust filter, whose weights depend on the data, is in robust_time.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/lapack.h"
#include "signal/smooth.h"

#include <math.h>
#include <stdlib.h>

enum { DEGREE = 3 };
static const double negligible = 1e-7; /* weights of the low-pass below this are dropped */

/* Impulse response of the biquad: a Butterworth low-pass of second order whose amplitude after two passes is
 * 1/sqrt(2) at `frequency` (cycles per frame). */
static void respond(double frequency, size_t n, double *h)
{
    double w = tan(M_PI * frequency) / pow(sqrt(2) - 1, 0.25), scale = 1 / (1 + sqrt(2) * w + w * w);
    double b[3] = {w * w * scale, 2 * w * w * scale, w * w * scale};
    double a1 = 2 * (w * w - 1) * scale, a2 = (1 - sqrt(2) * w + w * w) * scale;
    for (size_t i = 0; i < n; i++)
        h[i] = (i < 3 ? b[i] : 0) - (i > 0 ? a1 * h[i - 1] : 0) - (i > 1 ? a2 * h[i - 2] : 0);
}

/* forward and back: the response correlated with itself */
static int make_lowpass(vgi_time_filter *t, vg_err *e)
{
    size_t n = (size_t)ceil(16 * t->span) + 32, last = 0;
    double *h = vgi_array(n, sizeof *h, e), sum = 0;
    t->kernel = vgi_array(n, sizeof *t->kernel, e);
    if (h && t->kernel) {
        respond(fmin(0.5 / t->span, 0.49), n, h);
        for (size_t k = 0; k < n; k++)
            for (size_t i = 0; i + k < n; i++) t->kernel[k] += h[i] * h[i + k];
        for (size_t k = 1; k < n; k++)
            if (fabs(t->kernel[k]) > negligible * t->kernel[0]) last = k;
        for (size_t k = 0; k <= last; k++) sum += (k ? 2 : 1) * t->kernel[k];
        for (size_t k = 0; k <= last; k++) t->kernel[k] /= sum;
        t->reach = last;
    }
    free(h);
    return t->kernel ? VG_OK : VG_ENOMEM;
}

int vgi_time_filter_make(vgi_time_filter *t, vg_filter filter, double span, vg_err *e)
{
    *t = (vgi_time_filter){.filter = filter, .span = span};
    if (span == 0) return VG_OK;
    double most = filter == VG_ROBUST ? (VGI_MOST_ROBUST - 1) / 2 : 1000;
    if (!(span > 1 && span <= most))
        return vg_fail(e, VG_EARG, "the span of this filter must be above 1 frame and at most %g, not %g", most, span);
    if (filter == VG_LOWPASS) return make_lowpass(t, e);
    t->reach = (size_t)fmax(lround(span), 2);
    return VG_OK;
}

void vgi_time_filter_clear(vgi_time_filter *t)
{
    free(t->kernel);
    *t = (vgi_time_filter){0};
}

void vgi_time_window(const vgi_time_filter *t, size_t i, size_t known, bool ended, size_t *lo, size_t *n)
{
    size_t width = 2 * t->reach + 1;
    *lo = i > t->reach ? i - t->reach : 0;
    if (ended && *lo + width > known) *lo = known > width ? known - width : 0;
    *n = known - *lo < width ? known - *lo : width;
}

/* Add a frame beyond the ends as weights of existing frames: each reflection at an end adds twice the end frame and
 * changes the sign. */
static void add_reflected(ptrdiff_t at, ptrdiff_t end, double w, size_t lo, double *weight)
{
    while (at < 0 || at > end) {
        ptrdiff_t mirror = at < 0 ? 0 : end;
        weight[(size_t)mirror - lo] += 2 * w;
        w = -w;
        at = 2 * mirror - at;
    }
    weight[(size_t)at - lo] += w;
}

static void weigh_lowpass(const vgi_time_filter *t, size_t i, size_t known, size_t lo, double *weight)
{
    ptrdiff_t reach = (ptrdiff_t)t->reach, end = (ptrdiff_t)known - 1;
    if (end == 0) {
        weight[0] = 1;
        return;
    }
    for (ptrdiff_t k = -reach; k <= reach; k++)
        add_reflected((ptrdiff_t)i + k, end, t->kernel[k < 0 ? -k : k], lo, weight);
}

/* the value at 0 of the least-squares polynomial: with V its powers, row 0 of (V'V)^-1 V' */
static void weigh_polynomial(const vgi_time_filter *t, size_t i, size_t lo, size_t n, double *weight)
{
    size_t terms = n > DEGREE ? DEGREE + 1 : n;
    double a[(DEGREE + 1) * (DEGREE + 1)] = {0}, c[DEGREE + 1] = {1}, power[2 * DEGREE + 1];
    for (size_t j = 0; j < n; j++) {
        power[0] = 1;
        for (size_t k = 1; k < 2 * terms - 1; k++)
            power[k] = power[k - 1] * ((double)(lo + j) - (double)i) / (double)t->reach;
        for (size_t r = 0; r < terms; r++)
            for (size_t k = 0; k < terms; k++) a[r * terms + k] += power[r + k];
    }
    if (!vgi_spd_factor(terms, a)) abort(); /* times are distinct, so the powers are independent */
    vgi_spd_solve(terms, a, 1, c);
    for (size_t j = 0; j < n; j++) {
        double x = ((double)(lo + j) - (double)i) / (double)t->reach;
        for (size_t k = terms; k-- > 0;) weight[j] = weight[j] * x + c[k];
    }
}

void vgi_time_weights(const vgi_time_filter *t, size_t i, size_t known, size_t lo, size_t n, double *weight)
{
    memset(weight, 0, n * sizeof *weight);
    if (t->span == 0) weight[i - lo] = 1;
    else if (t->filter == VG_LOWPASS) weigh_lowpass(t, i, known, lo, weight);
    else weigh_polynomial(t, i, lo, n, weight);
}
