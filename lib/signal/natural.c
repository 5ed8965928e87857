/* natural.c: natural cubic splines through values at integer times. Splines with other knots are in spline_time.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/signal.h"

#include <math.h>

void vgi_natural_make(size_t n, size_t w, const double *x, double *second, double *room)
{
    memset(second, 0, n * w * sizeof *second);
    if (n < 3) return;
    double *factor = room; /* of the tridiagonal matrix 1 4 1 */
    for (size_t i = 1; i + 1 < n; i++) {
        factor[i] = i == 1 ? 0.25 : 1 / (4 - factor[i - 1]);
        for (size_t c = 0; c < w; c++) {
            double bend = x[(i + 1) * w + c] - 2 * x[i * w + c] + x[(i - 1) * w + c];
            second[i * w + c] = factor[i] * (6 * bend - second[(i - 1) * w + c]);
        }
    }
    for (size_t i = n - 2; i-- > 1;)
        for (size_t c = 0; c < w; c++) second[i * w + c] -= factor[i] * second[(i + 1) * w + c];
}

void vgi_natural_at(size_t n, size_t w, const double *x, const double *second, double t, double *out)
{
    double s = fmin(fmax(t - 1, 0), (double)(n - 1));
    size_t i = (size_t)s;
    if (i + 1 >= n) i = n > 1 ? n - 2 : 0;
    double b = s - (double)i, a = 1 - b;
    if (b == 0 || n == 1) {
        memcpy(out, x + i * w, w * sizeof *out);
        return;
    }
    if (b == 1) {
        memcpy(out, x + (i + 1) * w, w * sizeof *out);
        return;
    }
    double p = (a * a * a - a) / 6, q = (b * b * b - b) / 6;
    const double *x0 = x + i * w, *x1 = x0 + w, *s0 = second + i * w, *s1 = s0 + w;
    for (size_t c = 0; c < w; c++) out[c] = a * x0[c] + b * x1[c] + p * s0[c] + q * s1[c];
}
