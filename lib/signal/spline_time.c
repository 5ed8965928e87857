/* spline_time.c: the time signal: a cubic B-spline with natural ends, over a parameter that increases with time.
 *
 * Control points f_0 .. f_(k-1) over knots U_0 .. U_(k+3), the first four equal and the last four equal. Natural
 * ends: f_0 / a - f_1 (1/a + 1/b) + f_2 / b = 0 with a = U_4 - U_1, b = U_5 - U_2, and the mirror image; they leave k
 * - 2 unknowns. Inner knots are parameters of frames, so that the least-squares system has full rank for any choice
 * of them. Splines at integer times are in natural.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/signal.h"
#include "numeric/stats.h"

#include <math.h>
#include <stdlib.h>

/* ---- time to parameter ---- */

void vgi_parameters(size_t n, const double *p, double *t)
{
    double mean = 0;
    for (size_t i = 0; i + 1 < n; i++) {
        t[i + 1] = sqrt(hypot(p[2 * i + 2] - p[2 * i], p[2 * i + 3] - p[2 * i + 1]));
        mean += t[i + 1] / (double)(n - 1);
    }
    if (!(mean > 0)) mean = 1;
    t[0] = 0;
    for (size_t i = 1; i < n; i++) t[i] = t[i - 1] + fmax(t[i], 1e-3 * mean);
}

static double place_of(const double *x, size_t i)
{
    return x ? x[i] : (double)i + 1;
}

static double secant(const double *x, const double *y, size_t i)
{
    return (y[i + 1] - y[i]) / (place_of(x, i + 1) - place_of(x, i));
}

/* Slope at an end, from the parabola through it and the next two points: h, d of the step there, g, c of the next. */
static double end_slope(double h, double d, double g, double c)
{
    return ((2 * h + g) * d - h * c) / (h + g);
}

/* Limit the slopes, taken together, to three times those of the secants. */
static void limit_slopes(double d, double *left, double *right)
{
    if (!(d > 0)) {
        *left = *right = 0;
        return;
    }
    double a = *left / d, b = *right / d, square = a * a + b * b;
    if (square > 9) *left = 3 / sqrt(square) * a * d, *right = 3 / sqrt(square) * b * d;
}

void vgi_monotone_slopes(size_t n, const double *x, const double *y, double *slope)
{
    if (n < 3) {
        for (size_t i = 0; i < n; i++) slope[i] = n == 2 ? fmax(secant(x, y, 0), 0) : 0;
        return;
    }
    for (size_t i = 0; i < n; i++) {
        size_t j = i == 0 ? 0 : i + 1 < n ? i - 1 : n - 3;
        double h = place_of(x, j + 1) - place_of(x, j), g = place_of(x, j + 2) - place_of(x, j + 1);
        double d = secant(x, y, j), c = secant(x, y, j + 1);
        slope[i] = i == 0 ? end_slope(h, d, g, c) : i + 1 < n ? (g * d + h * c) / (h + g) : end_slope(g, c, h, d);
        slope[i] = fmax(slope[i], 0);
    }
    for (size_t i = 0; i + 1 < n; i++)
        if (!(secant(x, y, i) > 0)) slope[i] = slope[i + 1] = 0;
    for (size_t i = 0; i + 1 < n; i++) limit_slopes(secant(x, y, i), &slope[i], &slope[i + 1]);
}

double vgi_monotone_at(size_t n, const double *x, const double *y, const double *slope, double at)
{
    if (!(at > place_of(x, 0))) return y[0];
    if (!(at < place_of(x, n - 1))) return y[n - 1];
    size_t low = 0, high = n - 1;
    if (!x) low = (size_t)at - 1, high = low + 1;
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (at < x[middle]) high = middle;
        else low = middle;
    }
    double width = place_of(x, high) - place_of(x, low), h = (at - place_of(x, low)) / width, g = 1 - h;
    if (h == 0) return y[low];
    return y[low] * (1 + 2 * h) * g * g + width * slope[low] * h * g * g + y[high] * h * h * (3 - 2 * h) -
           width * slope[high] * h * h * g;
}

/* ---- the spline ---- */

void vgi_curve_clear(vgi_curve *c)
{
    free(c->t);
    free(c->slope);
    free(c->knot);
    free(c->control);
    *c = (vgi_curve){0};
}

/* The four functions that are nonzero at u; the first has number s - 3, which is returned. */
static size_t basis_at(const double *knot, size_t k, double u, double b[4])
{
    size_t low = 3, high = k; /* knot[low] <= u < knot[high], except at the end */
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        if (u < knot[middle]) high = middle;
        else low = middle;
    }
    while (low > 3 && knot[low] == knot[low + 1]) low--;
    b[0] = 1;
    for (size_t d = 1; d < 4; d++) {
        double kept = 0;
        for (size_t a = 0; a < d; a++) {
            double right = knot[low + a + 1], left = knot[low + 1 + a - d], w = right > left ? b[a] / (right - left) : 0;
            b[a] = kept + (right - u) * w;
            kept = (u - left) * w;
        }
        b[d] = kept;
    }
    return low - 3;
}

double vgi_curve_parameter(const vgi_curve *c, double time)
{
    return vgi_monotone_at(c->n, NULL, c->t, c->slope, time);
}

void vgi_curve_point(const vgi_curve *c, double parameter, double p[2])
{
    double b[4], u = fmin(fmax(parameter, c->knot[3]), c->knot[c->k]);
    size_t first = basis_at(c->knot, c->k, u, b);
    const double *f = c->control + 2 * first;
    for (int q = 0; q < 2; q++) p[q] = (b[0] * f[q] + b[1] * f[2 + q]) + (b[2] * f[4 + q] + b[3] * f[6 + q]);
}

void vgi_curve_at(const vgi_curve *c, double time, double p[2])
{
    vgi_curve_point(c, vgi_curve_parameter(c, time), p);
}

/* ---- least squares ---- */

/* f_0 = one f_1 + two f_2, and the mirror image at the other end. */
typedef struct ends {
    double one, two;
} ends;

static ends natural_end(double a, double b) /* f_0 / a - f_1 (1 / a + 1 / b) + f_2 / b = 0 */
{
    return (ends){1 + a / b, -a / b};
}

/* Rows of the system, reduced to an upper triangle of width 4 by Givens rotations as they arrive. */
typedef struct band {
    size_t unknowns;
    double *r; /* unknowns x 4: row i holds columns i .. i + 3 */
    double *y; /* unknowns x 2 */
} band;

static void add_row(band *s, size_t at, double row[4], double right[2])
{
    for (size_t step = 0; step < 4 && at < s->unknowns; step++, at++) {
        double *r = s->r + 4 * at, *y = s->y + 2 * at, size = hypot(r[0], row[0]);
        if (row[0] != 0) {
            double c = r[0] / size, q = row[0] / size;
            for (int k = 0; k < 4; k++) {
                double a = r[k], b = row[k];
                r[k] = c * a + q * b;
                row[k] = c * b - q * a;
            }
            for (int k = 0; k < 2; k++) {
                double a = y[k], b = right[k];
                y[k] = c * a + q * b;
                right[k] = c * b - q * a;
            }
        }
        for (int k = 0; k < 3; k++) row[k] = row[k + 1];
        row[3] = 0;
    }
}

/* The row of the functions b from number `first` on, with the ends eliminated. Returns its first unknown. */
static size_t reduce(size_t k, size_t first, const double b[4], ends front, ends back, double row[4])
{
    double all[6] = {0}; /* from function first - 1 on */
    for (size_t q = 0; q < 4; q++) {
        size_t j = first + q;
        if (j == 0) all[q + 2] += front.one * b[q], all[q + 3] += front.two * b[q];
        else if (j == k - 1) all[q] += back.one * b[q], all[q - 1] += back.two * b[q];
        else all[q + 1] += b[q];
    }
    size_t at = first > 0 ? first - 1 : 0; /* unknown i is function i + 1 */
    memcpy(row, all + (first > 0 ? 1 : 2), 4 * sizeof *row);
    return at;
}

static void solve_band(const band *s)
{
    for (size_t i = s->unknowns; i-- > 0;)
        for (int k = 0; k < 2; k++) {
            double x = s->y[2 * i + k];
            for (size_t q = 1; q < 4 && i + q < s->unknowns; q++) x -= s->r[4 * i + q] * s->y[2 * (i + q) + k];
            s->y[2 * i + k] = s->r[4 * i] != 0 ? x / s->r[4 * i] : 0;
        }
}

static void solve_control(vgi_curve *c, const double *p, band *s)
{
    size_t k = c->k;
    const double *u = c->knot;
    ends front = natural_end(u[4] - u[1], u[5] - u[2]), back = natural_end(u[k + 2] - u[k - 1], u[k + 1] - u[k - 2]);
    s->unknowns = k - 2;
    memset(s->r, 0, 4 * s->unknowns * sizeof *s->r);
    memset(s->y, 0, 2 * s->unknowns * sizeof *s->y);
    for (size_t i = 0; i < c->n; i++) {
        double b[4], row[4], right[2] = {p[2 * i], p[2 * i + 1]};
        size_t first = basis_at(u, k, c->t[i], b);
        size_t at = reduce(k, first, b, front, back, row);
        add_row(s, at, row, right);
    }
    solve_band(s);
    double *f = c->control, *g = f + 2 * (k - 1);
    memcpy(f + 2, s->y, 2 * s->unknowns * sizeof *f);
    for (int q = 0; q < 2; q++) {
        f[q] = front.one * f[2 + q] + front.two * f[4 + q];
        g[q] = back.one * (g - 2)[q] + back.two * (g - 4)[q];
    }
}

/* knots at the parameters of frames */
static void set_knots(vgi_curve *c, const uint32_t *at, size_t count)
{
    c->k = count + 2;
    for (size_t i = 0; i < 3; i++) c->knot[i] = c->t[0], c->knot[c->k + 1 + i] = c->t[c->n - 1];
    for (size_t i = 0; i < count; i++) c->knot[3 + i] = c->t[at[i]];
}

static int make_room(vgi_curve *c, band *s, size_t n, const double *t, size_t most, vg_err *e)
{
    *c = (vgi_curve){.n = n};
    *s = (band){0};
    if (!(c->t = vgi_copy_array(t, n, sizeof *t, e)) || !(c->slope = vgi_array(n, sizeof *c->slope, e)) ||
        !(c->knot = vgi_array(most + 4, sizeof *c->knot, e)) ||
        !(c->control = vgi_array(most, 2 * sizeof *c->control, e)) ||
        !(s->r = vgi_array(most, 4 * sizeof *s->r, e)) || !(s->y = vgi_array(most, 2 * sizeof *s->y, e)))
        return VG_ENOMEM;
    vgi_monotone_slopes(n, NULL, c->t, c->slope);
    return VG_OK;
}

static void clear_band(band *s)
{
    free(s->r);
    free(s->y);
}

int vgi_curve_fit(vgi_curve *c, size_t n, const double *p, const double *t, const uint32_t *at, size_t count, vg_err *e)
{
    band s;
    int r = make_room(c, &s, n, t, count + 2, e);
    if (r == VG_OK) {
        set_knots(c, at, count);
        solve_control(c, p, &s);
    } else vgi_curve_clear(c);
    clear_band(&s);
    return r;
}

/* ---- choice of knots ---- */

/* The frame farthest from the curve that is not a knot; n if all are. */
static size_t farthest_frame(const vgi_curve *c, const double *p, const bool *used)
{
    size_t best = c->n;
    double most = -1;
    for (size_t i = 0; i < c->n; i++) {
        double at[2];
        if (used[i]) continue;
        vgi_curve_point(c, c->t[i], at);
        double far = hypot(at[0] - p[2 * i], at[1] - p[2 * i + 1]);
        if (far > most) most = far, best = i;
    }
    return best;
}

int vgi_curve_order(size_t n, const double *p, const double *t, uint32_t *order, vg_err *e)
{
    vgi_curve c;
    band s;
    bool *used = vgi_array(n, sizeof *used, e);
    uint32_t *sorted = vgi_array(n, sizeof *sorted, e);
    int r = make_room(&c, &s, n, t, n + 2, e);
    if (r < 0 || !used || !sorted) {
        r = VG_ENOMEM;
        goto out;
    }
    order[0] = 0, order[1] = (uint32_t)n - 1;
    used[0] = used[n - 1] = true;
    for (size_t count = 2; count < n; count++) {
        memcpy(sorted, order, count * sizeof *order);
        qsort(sorted, count, sizeof *sorted, vgi_by_index);
        set_knots(&c, sorted, count);
        solve_control(&c, p, &s);
        size_t next = farthest_frame(&c, p, used);
        order[count] = (uint32_t)next;
        used[next] = true;
    }
out:
    free(used);
    free(sorted);
    clear_band(&s);
    vgi_curve_clear(&c);
    return r;
}

/* ---- more and fewer control points ---- */

int vgi_curve_insert(vgi_curve *c, double parameter, vg_err *e)
{
    size_t k = c->k, at = 3;
    if (!(parameter > c->knot[3] && parameter < c->knot[k]))
        return vg_fail(e, VG_EARG, "a control point can only be added between the first and the last frame");
    while (at + 1 < k && c->knot[at + 1] <= parameter) at++;
    double *knot = vgi_array(k + 5, sizeof *knot, e), *control = vgi_array(k + 1, 2 * sizeof *control, e);
    if (!knot || !control) {
        free(knot);
        free(control);
        return VG_ENOMEM;
    }
    for (size_t i = 0; i <= k; i++) { /* Boehm's algorithm */
        double w = i + 3 <= at ? 1 : i > at ? 0 : (parameter - c->knot[i]) / (c->knot[i + 3] - c->knot[i]);
        for (size_t q = 0; q < 2; q++)
            control[2 * i + q] = (i < k && w > 0 ? w * c->control[2 * i + q] : 0) +
                                 (i > 0 && w < 1 ? (1 - w) * c->control[2 * (i - 1) + q] : 0);
    }
    memcpy(knot, c->knot, (at + 1) * sizeof *knot);
    knot[at + 1] = parameter;
    memcpy(knot + at + 2, c->knot + at + 1, (k + 3 - at) * sizeof *knot);
    free(c->knot);
    free(c->control);
    c->knot = knot, c->control = control, c->k = k + 1;
    return VG_OK;
}

int vgi_curve_remove(vgi_curve *c, size_t control, vg_err *e)
{
    size_t k = c->k;
    if (k <= 4) return vg_fail(e, VG_EARG, "a curve has at least 4 control points");
    if (control < 2 || control + 2 >= k)
        return vg_fail(e, VG_EARG, "the first and last two control points cannot be removed");
    memmove(c->control + 2 * control, c->control + 2 * control + 2, 2 * (k - control - 1) * sizeof *c->control);
    memmove(c->knot + control + 2, c->knot + control + 3, (k + 1 - control) * sizeof *c->knot);
    c->k = k - 1;
    return VG_OK;
}
