/* layout.c: chooses the distances between positions in the plane, and measures how good the motion between frames
 * then is.
 *
 * If only distances of shapes counted, similar shapes of different moments would lie together, and the surface
 * through them could not tell how either continues. A further coordinate separates them: time, or the phase of a
 * cycle. Positions are computed from distances in plane.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/blas.h"
#include "numeric/lapack.h"
#include "numeric/stats.h"
#include "signal/signal.h"

#include <math.h>
#include <stdlib.h>

enum { AXES = 30, MORE = 2 }; /* principal coordinates from which a start is computed, and further ones */
static const double good = 0.6; /* a candidate with at most this ratio is accepted */

/* ---- the length of a cycle ---- */

static double median(double *x, size_t n)
{
    qsort(x, n, sizeof *x, vgi_by_number);
    return n % 2 ? x[n / 2] : (x[n / 2 - 1] + x[n / 2]) / 2;
}

/* middle[T]: the median distance of frames T apart, relative to that of all pairs */
static void lag_medians(size_t n, const double *square, double *middle, double *room)
{
    size_t count = 0;
    for (size_t i = 0; i < n; i++)
        for (size_t j = i + 1; j < n; j++) room[count++] = sqrt(square[i * n + j]);
    double all = median(room, count);
    for (size_t lag = 4; lag < n; lag++) {
        for (size_t i = 0; i + lag < n; i++) room[i] = sqrt(square[i * n + i + lag]);
        middle[lag] = all > 0 ? median(room, n - lag) / all : INFINITY;
    }
}

static double refine_minimum(double a, double b, double c)
{
    double bend = a - 2 * b + c, off = bend > 0 ? fmin(fmax(0.5 * (a - c) / bend, -0.5), 0.5) : 0;
    return fabs(off) > 0.05 ? off : 0;
}

int vgi_period(size_t n, const double *square, double *period, vg_err *e)
{
    *period = 0;
    if (n < 5) return VG_OK;
    double *room = vgi_array_raw(n * n, sizeof *room, e), *middle = vgi_array(n + 1, sizeof *middle, e);
    if (room && middle) {
        for (size_t i = 0; i <= n; i++) middle[i] = INFINITY;
        lag_medians(n, square, middle, room);
        for (size_t lag = 4; lag < n && !*period; lag++)
            if (middle[lag] < 0.05 && middle[lag] <= middle[lag - 1] && middle[lag] <= middle[lag + 1])
                *period = (double)lag + (lag + 1 < n && isfinite(middle[lag - 1])
                                             ? refine_minimum(middle[lag - 1], middle[lag], middle[lag + 1]) : 0);
    }
    int r = room && middle ? VG_OK : VG_ENOMEM;
    free(room);
    free(middle);
    return r;
}

/* ---- positions ---- */

/* Coordinates in addition to those of the shapes, n x MORE. Returns their number. */
static size_t further_coordinates(const vg_layout_trial *w, double period, size_t n, size_t m, const double *x, double *more)
{
    double size = 0, length = 0, weight = w->weight;
    for (size_t i = 0; i < n * m; i++) size += x[i] * x[i] / (double)n;
    size = sqrt(size);
    for (size_t i = 0; i < n; i++) {
        double phase = period > 0 ? 2 * M_PI * (double)i / period : 0, square = 0;
        if (w->layout == VG_LAYOUT_RING) {
            more[MORE * i] = weight * size * cos(phase) / M_SQRT2;
            more[MORE * i + 1] = weight * size * sin(phase) / M_SQRT2;
            continue;
        }
        for (size_t c = 0; c < m && i; c++) square += pow(x[i * m + c] - x[(i - 1) * m + c], 2);
        length += sqrt(square);
        more[MORE * i] = length;
        more[MORE * i + 1] = 0;
    }
    if (w->layout == VG_LAYOUT_TIME)
        for (size_t i = 0; i < n; i++) more[MORE * i] = length > 0 ? weight * size * (more[MORE * i] / length - 0.5) : 0;
    for (size_t c = 0; c < MORE; c++) {
        double mean = 0;
        for (size_t i = 0; i < n; i++) mean += more[MORE * i + c] / (double)n;
        for (size_t i = 0; i < n; i++) more[MORE * i + c] -= mean;
    }
    return w->layout == VG_LAYOUT_RING ? 2 : w->layout == VG_LAYOUT_TIME ? 1 : 0;
}

/* The first three principal coordinates (n x 3) of shapes and further coordinates together. */
static int principal(size_t n, size_t m, const double *x, size_t nmore, const double *more, double *axes, vg_err *e)
{
    size_t few = m < AXES ? m : AXES, w = few + nmore, count = w < 3 ? w : 3;
    double *all = vgi_array(n * w, sizeof *all, e), *c = vgi_array(w * w, sizeof *c, e);
    double value[3], *vector = vgi_array(3 * w, sizeof *vector, e);
    int r = all && c && vector ? VG_OK : VG_ENOMEM;
    memset(axes, 0, 3 * n * sizeof *axes);
    if (r == VG_OK && w) {
        for (size_t i = 0; i < n; i++)
            for (size_t k = 0; k < w; k++) all[i * w + k] = k < few ? x[i * m + k] : more[MORE * i + k - few];
        vgi_product_transposed_double(w, w, n, all, w, all, w, c, w);
        if ((r = vgi_eigen(w, c, count, value, vector, e)) == VG_OK)
            vgi_product_double_transposed(n, count, w, all, w, vector, w, axes, 3);
    }
    free(all);
    free(c);
    free(vector);
    return r;
}

/* From the best of three starts. */
static int settle_freely(size_t n, const double *distance, const double *axes, double *p, double *best, vg_err *e)
{
    static const size_t pairs[3][2] = {{0, 1}, {0, 2}, {1, 2}};
    double least = INFINITY;
    for (int start = 0; start < 3; start++) {
        vgi_stress_stats f;
        for (size_t i = 0; i < n; i++)
            for (int k = 0; k < 2; k++) p[2 * i + (size_t)k] = axes[3 * i + pairs[start][k]];
        if (start && !(vgi_plane_radius(n, p, NULL) > 0)) break;
        if (vgi_plane_settle(n, distance, NULL, p, &f, e) < 0) return VG_ENOMEM;
        if (f.stress < least) least = f.stress, memcpy(best, p, 2 * n * sizeof *p);
    }
    return VG_OK;
}

/* Move p rigidly, possibly mirrored, so that its pinned frames are nearest to their pins. */
static void move_to_pins(size_t n, double *p, const vg_pin *pins, size_t npins)
{
    double a[2] = {0, 0}, b[2] = {0, 0}, plain[2] = {0, 0}, mirrored[2] = {0, 0};
    for (size_t i = 0; i < npins; i++)
        for (int k = 0; k < 2; k++) a[k] += p[2 * pins[i].frame + (size_t)k] / (double)npins, b[k] += pins[i].at[k] / (double)npins;
    for (size_t i = 0; i < npins; i++) {
        double u = p[2 * pins[i].frame] - a[0], v = p[2 * pins[i].frame + 1] - a[1];
        double x = pins[i].at[0] - b[0], y = pins[i].at[1] - b[1];
        plain[0] += u * x + v * y, plain[1] += u * y - v * x;
        mirrored[0] += u * x - v * y, mirrored[1] += u * y + v * x;
    }
    bool mirror = hypot(mirrored[0], mirrored[1]) > hypot(plain[0], plain[1]);
    const double *turn = mirror ? mirrored : plain;
    double size = hypot(turn[0], turn[1]), c = size > 0 ? turn[0] / size : 1, s = size > 0 ? turn[1] / size : 0;
    for (size_t i = 0; i < n; i++) {
        double u = p[2 * i] - a[0], v = (mirror ? -1 : 1) * (p[2 * i + 1] - a[1]);
        p[2 * i] = b[0] + c * u - s * v;
        p[2 * i + 1] = b[1] + s * u + c * v;
    }
}

static int settle_pinned(size_t n, const double *distance, const vg_pin *pins, size_t npins, double *p, vg_err *e)
{
    bool *held = vgi_array(n, sizeof *held, e);
    if (!held) return VG_ENOMEM;
    move_to_pins(n, p, pins, npins);
    for (size_t i = 0; i < npins; i++) {
        held[pins[i].frame] = true;
        memcpy(p + 2 * pins[i].frame, pins[i].at, sizeof pins[i].at);
    }
    int r = vgi_plane_settle(n, distance, held, p, NULL, e);
    free(held);
    return r;
}

/* Positions p with rms radius 1; with pins about 1, and the pins are met exactly. x: n x m principal coordinates. square: their
 * squared distances. period: for VG_LAYOUT_RING. */
static int make_layout(const vg_layout_trial *layout, double period, size_t n, size_t m, const double *x, const double *square,
                       const vg_pin *pins, size_t npins, double *p, vg_err *e)
{
    int r = VG_ENOMEM;
    double *distance = vgi_array_raw(n * n, sizeof *distance, e), *more = vgi_array(n, MORE * sizeof *more, e);
    double *axes = vgi_array(n, 3 * sizeof *axes, e), *best = vgi_array(n, 2 * sizeof *best, e), add[MORE];
    if (!distance || !more || !axes || !best) goto out;
    size_t nmore = layout->layout == VG_LAYOUT_PLAIN ? 0 : further_coordinates(layout, period, n, m, x, more);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            for (size_t k = 0; k < MORE; k++) add[k] = more[MORE * i + k] - more[MORE * j + k];
            distance[i * n + j] = sqrt(square[i * n + j] + add[0] * add[0] + add[1] * add[1]);
        }
    if ((r = principal(n, m, x, nmore, more, axes, e)) < 0 || (r = settle_freely(n, distance, axes, p, best, e)) < 0)
        goto out;
    double centre[2], radius = vgi_plane_radius(n, best, centre);
    if (!(radius > 0)) radius = 1;
    for (size_t i = 0; i < 2 * n; i++) p[i] = (best[i] - centre[i & 1]) / radius;
    for (size_t i = 0; i < n * n; i++) distance[i] /= radius;
    if (npins) r = settle_pinned(n, distance, pins, npins, p, e);
out:
    free(distance);
    free(more);
    free(axes);
    free(best);
    return r;
}

/* ---- quality of a layout ---- */

typedef struct judge {
    size_t n, m;
    const double *x, *p;
    double *second, *fitted, *functions, *coefficients, *row;
    vgi_plate plate;
    vgi_curve curve;
} judge;

static int prepare_judge(judge *j, vg_err *e)
{
    size_t n = j->n, m = j->m;
    double *t = vgi_array(n, sizeof *t, e);
    uint32_t *all = vgi_array(n, sizeof *all, e);
    int r = VG_ENOMEM;
    if (!t || !all || !(j->second = vgi_array(n * m, sizeof *j->second, e)) || !(j->row = vgi_array(m + n, sizeof(double), e)) ||
        !(j->fitted = vgi_array(3 * n * m, sizeof *j->fitted, e)) ||
        !(j->functions = vgi_array(3 * n * n, sizeof *j->functions, e)) ||
        !(j->coefficients = vgi_array(n * m, sizeof *j->coefficients, e)) ||
        vgi_plate_order(&j->plate, n, m, j->p, j->x, m, VGI_FARTHEST, e) < 0)
        goto out;
    vgi_natural_make(n, m, j->x, j->second, j->row);
    vgi_plate_solve(&j->plate, j->plate.apart, m, j->x, m, j->coefficients);
    for (size_t i = 0; i < n; i++) all[i] = (uint32_t)i;
    vgi_parameters(n, j->p, t);
    r = vgi_curve_fit(&j->curve, n, j->p, t, all, n, e);
out:
    free(t);
    free(all);
    return r;
}

static double time_between(size_t index) /* times i + 1/4, 1/2, 3/4 */
{
    const size_t whole = index / 3;
    return 1 + (double)whole + 0.25 * (double)(1 + index % 3);
}

/* Squared deviation at each intermediate time. Returns the mean square for straight lines. */
static double measure_deviation(judge *j, double *square)
{
    size_t n = j->n, m = j->m, l = j->plate.apart, times = 3 * (n - 1);
    double straight = 0;
    for (size_t i = 0; i < times; i++) {
        double p[2];
        vgi_curve_at(&j->curve, time_between(i), p);
        vgi_plate_functions(&j->plate, l, p, j->functions + i * l);
    }
    vgi_product_double(times, m, l, j->functions, l, j->coefficients, m, j->fitted, m);
    for (size_t i = 0; i < times; i++) {
        const double *a = j->x + i / 3 * m, *b = a + m;
        double share = 0.25 * (double)(1 + i % 3);
        vgi_natural_at(n, m, j->x, j->second, time_between(i), j->row);
        square[i] = 0;
        for (size_t c = 0; c < m; c++) {
            double line = a[c] * (1 - share) + b[c] * share - j->row[c], off = j->fitted[i * m + c] - j->row[c];
            square[i] += off * off;
            straight += line * line / (double)times;
        }
    }
    return straight;
}

int vgi_layout_judge(size_t n, size_t m, const double *x, const double *p, double *ratio, double *deviation, vg_err *e)
{
    judge j = {.n = n, .m = m, .x = x, .p = p};
    size_t times = 3 * (n - 1);
    double *square = vgi_array(times, sizeof *square, e), sum = 0, straight = 0;
    *ratio = 0;
    int r = square ? VG_OK : VG_ENOMEM;
    if (r == VG_OK && m && n > 2 && (r = prepare_judge(&j, e)) == VG_OK) {
        straight = measure_deviation(&j, square);
        for (size_t i = 0; i < times; i++) sum += square[i] / (double)times;
        if (straight > 0) *ratio = sqrt(sum / straight);
    }
    for (size_t i = 0; r == VG_OK && deviation && i < times; i++) deviation[i] = straight > 0 ? square[i] / straight : 0;
    free(square);
    free(j.second);
    free(j.fitted);
    free(j.functions);
    free(j.coefficients);
    free(j.row);
    vgi_plate_clear(&j.plate);
    vgi_curve_clear(&j.curve);
    return r;
}

/* ---- the choice ---- */

typedef struct choice {
    size_t n, m;
    const double *x;
    double *square; /* n x n: of the distances between rows of x */
    const vg_pin *pins;
    size_t npins;
    double period;
    vg_layout_trial *tried;
    double *p; /* 2 n per candidate tried */
    size_t first;
    int status[VG_LAYOUT_TRIALS];
} choice;

static void try_one(void *context, size_t index)
{
    choice *c = context;
    size_t i = c->first + index;
    double *p = c->p + 2 * c->n * i;
    c->status[i] = make_layout(&c->tried[i], c->period, c->n, c->m, c->x, c->square, c->pins, c->npins, p,
                                  NULL);
    if (c->status[i] == VG_OK)
        c->status[i] = vgi_layout_judge(c->n, c->m, c->x, p, &c->tried[i].ratio, NULL, NULL);
}

static size_t list_candidates(vg_layout_trial *list, double period, const vg_layout_trial *only)
{
    static const double rings[] = {1, 2, 3, 4}, times[] = {1, 1.5, 2, 3, 4, 6, 8, 12, 16, 24};
    size_t count = 0, nrings = period > 0 ? sizeof rings / sizeof *rings : 0;
    if (only && (only->weight > 0 || only->layout == VG_LAYOUT_PLAIN)) {
        *list = *only;
        return 1;
    }
    if (!only) list[count++] = (vg_layout_trial){.layout = VG_LAYOUT_PLAIN};
    for (size_t i = 0; i < nrings && !(only && only->layout != VG_LAYOUT_RING); i++)
        list[count++] = (vg_layout_trial){.layout = VG_LAYOUT_RING, .weight = rings[i]};
    for (size_t i = 0; i < sizeof times / sizeof *times && !(only && only->layout != VG_LAYOUT_TIME); i++)
        list[count++] = (vg_layout_trial){.layout = VG_LAYOUT_TIME, .weight = times[i]};
    return count;
}

/* The first good candidate, or after the last one the best; SIZE_MAX: continue. */
static size_t decide(const choice *c, size_t done, size_t count)
{
    size_t best = 0;
    for (size_t i = 0; i < done; i++) {
        if (c->tried[i].ratio <= good) return i;
        if (c->tried[i].ratio < c->tried[best].ratio) best = i;
    }
    return done == count ? best : SIZE_MAX;
}

int vgi_layout_choose(size_t n, size_t m, const double *x, const vg_pin *pins, size_t npins,
                      const vg_layout_trial *only, int threads, double *p, vg_layout_trial *chosen, double *period,
                      vg_layout_trial *tried, size_t *ntried, vg_err *e)
{
    choice c = {.n = n, .m = m, .x = x, .pins = pins, .npins = npins, .tried = tried};
    if (!(c.square = vgi_array_raw(n * n, sizeof *c.square, e))) return VG_ENOMEM;
    vgi_distances(n, m, x, m, c.square);
    int r = vgi_period(n, c.square, &c.period, e);
    if (r == VG_OK && only && only->layout == VG_LAYOUT_RING && !(c.period > 0))
        r = vg_fail(e, VG_EINPUT, "no cycle was found in these frames, so a ring layout is impossible");
    size_t count = list_candidates(tried, c.period, only), found = SIZE_MAX, done = 0, wave = (size_t)threads;
    if (r == VG_OK && !(c.p = vgi_array(2 * n * count, sizeof *c.p, e))) r = VG_ENOMEM;
    vgi_blas_alone();
    while (found == SIZE_MAX && r == VG_OK) {
        c.first = done;
        size_t now = count - done < wave ? count - done : wave;
        if (!done) now = 1; /* most sequences need only one */
        vgi_parallel(threads, now, try_one, &c);
        for (size_t i = done; i < done + now; i++)
            if (c.status[i] < 0) r = vg_fail(e, c.status[i], "not enough memory for the layout of %zu frames", n);
        done += now;
        found = decide(&c, done, count);
    }
    vgi_blas_shared();
    if (r == VG_OK) {
        memcpy(p, c.p + 2 * n * found, 2 * n * sizeof *p);
        *chosen = tried[found];
        *period = c.period;
        *ntried = tried[found].ratio <= good ? found + 1 : count;
    }
    free(c.p);
    free(c.square);
    return r;
}

/* ---- crossings ---- */

static bool cross_segments(const double *a, const double *b, double *s, double *t)
{
    double u[2] = {a[2] - a[0], a[3] - a[1]}, v[2] = {b[2] - b[0], b[3] - b[1]}, w[2] = {b[0] - a[0], b[1] - a[1]};
    double det = u[0] * v[1] - u[1] * v[0];
    if (!(fabs(det) > 1e-300)) return false;
    *s = (w[0] * v[1] - w[1] * v[0]) / det;
    *t = (w[0] * u[1] - w[1] * u[0]) / det;
    return *s >= 0 && *s < 1 && *t >= 0 && *t < 1;
}

int vgi_crossings(size_t n, const double *p, vgi_crossing **list, size_t *count, vg_err *e)
{
    size_t cap = 0;
    double s, t;
    *list = NULL;
    *count = 0;
    for (size_t i = 0; i + 3 < n; i++)
        for (size_t j = i + 2; j + 1 < n; j++) {
            if (!cross_segments(p + 2 * i, p + 2 * j, &s, &t)) continue;
            if (vgi_grow(list, &cap, *count + 1, sizeof **list, e) < 0) {
                free(*list);
                *list = NULL;
                return VG_ENOMEM;
            }
            (*list)[(*count)++] = (vgi_crossing){1 + (double)i + s, 1 + (double)j + t};
        }
    return VG_OK;
}
