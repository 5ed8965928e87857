/* regression.c: ridge regression of the change from one frame to the next, on coordinates.
 *
 * The spectral radius of the companion matrix comes from its powers by repeated squaring (Gelfand): exact to 1e-5 after
 * twenty, complex pairs or not.
 * Leaves out the network that corrects it.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/regression.h"
#include "numeric/blas.h"
#include "numeric/lapack.h"

#include <math.h>
#include <stdlib.h>

static const double most_radius = 1.0005, change_weight = 10, free_shift = 1e-6;
enum { SQUARINGS = 20, BISECTIONS = 10 };

int vgi_regression_make(vgi_regression *r, size_t n, vg_err *e)
{
    double *block = vgi_array(vgi_regression_size(n), sizeof *block, e);
    *r = (vgi_regression){0};
    if (!block) return VG_ENOMEM;
    *r = vgi_regression_view(n, block);
    return VG_OK;
}

void vgi_regression_clear(vgi_regression *r)
{
    free(r->turn);
    *r = (vgi_regression){0};
}

void vgi_regression_next(const vgi_regression *r, const double *c, const double *before, double *next)
{
    size_t n = r->numbers;
    const double *turn = before ? r->turn : r->first, *shift = before ? r->shift : r->first_shift;
    for (size_t j = 0; j < n; j++) next[j] = c[j] + shift[j];
    for (size_t i = 0; i < n; i++) {
        double d = before ? c[i] - before[i] : 0;
        for (size_t j = 0; j < n; j++) next[j] += c[i] * turn[i * n + j] + d * r->change[i * n + j];
    }
}

/* ---- stability ---- */

/* m: 2n x 2n, with c and the frame before it as one row */
static void companion(const vgi_regression *r, double part, double damping, double *m)
{
    size_t n = r->numbers, w = 2 * n;
    memset(m, 0, w * w * sizeof *m);
    for (size_t i = 0; i < n; i++) {
        m[i * w + n + i] = 1;
        for (size_t j = 0; j < n; j++) {
            double keep = i == j ? damping : 0, change = keep + part * (r->change[i * n + j] - keep);
            m[i * w + j] = part * r->turn[i * n + j] + change + (i == j);
            m[(n + i) * w + j] = -change;
        }
    }
}

/* room: 3 x (2n)^2 */
static double radius(const vgi_regression *r, double part, double damping, double *room)
{
    size_t w = 2 * r->numbers, all = w * w;
    double *a = room, *b = room + all, log_size = 0, power = 1;
    companion(r, part, damping, a);
    for (int step = 0; step <= SQUARINGS; step++) {
        double size = 0;
        for (size_t i = 0; i < all; i++) size += a[i] * a[i];
        size = sqrt(size);
        if (!(size > 0)) return 0;
        for (size_t i = 0; i < all; i++) a[i] /= size;
        log_size += log(size) / power;
        if (step == SQUARINGS) break;
        vgi_product_double(w, w, w, a, w, a, w, b, w);
        double *swap = a;
        a = b, b = swap;
        power *= 2;
    }
    return exp(log_size);
}

/* towards damped continuation, as far as it takes */
static int make_stable(vgi_regression *r, double damping, vg_err *e)
{
    size_t n = r->numbers;
    double low = 0, high = 1, *room = vgi_array_raw(12 * n * n, sizeof *room, e);
    if (!room) return VG_ENOMEM;
    bool stable = radius(r, 1, damping, room) <= most_radius;
    for (int i = 0; !stable && i < BISECTIONS; i++) {
        double middle = (low + high) / 2;
        if (radius(r, middle, damping, room) <= most_radius) low = middle;
        else high = middle;
    }
    for (size_t i = 0; !stable && i < n; i++) {
        r->shift[i] *= low;
        for (size_t j = 0; j < n; j++) {
            double keep = i == j ? damping : 0, *c = &r->change[i * n + j];
            r->turn[i * n + j] *= low;
            *c = keep + low * (*c - keep);
        }
    }
    free(room);
    return VG_OK;
}

/* ---- the fit ---- */

/* Row k of the system: what is known at a frame, and what its change adds to the damped one. */
static void put_row(const double *before, const double *c, const double *next, size_t n, double size, double *z,
                    double *y, double damping)
{
    for (size_t i = 0; i < n; i++) {
        double d = (c[i] - before[i]) / size;
        z[i] = c[i] / size;
        z[n + i] = change_weight * d;
        y[i] = (next[i] - c[i]) / size - damping * d;
    }
    z[2 * n] = 1;
}

static size_t count_rows(const vgi_frames *f)
{
    size_t rows = 0;
    for (size_t s = 0; s < f->nsequences; s++) {
        size_t length = f->start[s + 1] - f->start[s];
        rows += length > 2 ? length - 2 : 0;
    }
    return rows;
}

static void put_rows(const vgi_frames *f, bool back, double size, double damping, double *z, double *y)
{
    size_t n = f->numbers, w = 2 * n + 1, row = 0;
    for (size_t s = 0; s < f->nsequences; s++)
        for (size_t t = f->start[s]; t + 2 < f->start[s + 1]; t++, row++) {
            const double *x = f->row + t * n;
            put_row(back ? x + 2 * n : x, x + n, back ? x : x + 2 * n, n, size, z + row * w, y + row * n, damping);
        }
}

/* The same without the change: z is made of the first numbers of each row, 1 behind them. */
static int fit_first(vgi_regression *r, size_t rows, double *z, double *y, double size, double ridge, double damping,
                     vg_err *e)
{
    size_t n = r->numbers, w = n + 1;
    double *a = vgi_array(w * w + w * n, sizeof *a, e);
    if (!a) return VG_ENOMEM;
    double *x = a + w * w;
    for (size_t i = 0; i < rows; i++)
        for (size_t k = 0; k < n; k++) y[i * n + k] += damping / change_weight * z[i * (2 * n + 1) + n + k];
    for (size_t i = 0; i < rows; i++) z[i * (2 * n + 1) + n] = 1;
    if (rows) {
        vgi_product_transposed_double(w, w, rows, z, 2 * n + 1, z, 2 * n + 1, a, w);
        vgi_product_transposed_double(w, n, rows, z, 2 * n + 1, y, n, x, n);
    }
    for (size_t i = 0; i < w; i++) a[i * w + i] += ridge * (double)(rows ? rows : 1) * (i < n ? 1 : free_shift);
    int code = vgi_spd_factor(w, a) ? VG_OK : vg_fail(e, VG_EINPUT, "the frames leave a regression open");
    if (code == VG_OK) {
        vgi_spd_solve(w, a, n, x);
        memcpy(r->first, x, n * n * sizeof *x);
        for (size_t j = 0; j < n; j++) r->first_shift[j] = size * x[n * n + j];
    }
    free(a);
    return code;
}

int vgi_regression_fit(vgi_regression *r, const vgi_frames *f, bool back, double size, double ridge, double damping,
                       vg_err *e)
{
    size_t n = f->numbers, w = 2 * n + 1, rows = count_rows(f);
    double *z = vgi_array_raw(rows * (w + n) + w * w + w * n, sizeof *z, e);
    if (!z) return VG_ENOMEM;
    double *y = z + rows * w, *a = y + rows * n, *x = a + w * w;
    put_rows(f, back, size, damping, z, y);
    memset(a, 0, (w * w + w * n) * sizeof *a);
    if (rows) {
        vgi_product_transposed_double(w, w, rows, z, w, z, w, a, w);
        vgi_product_transposed_double(w, n, rows, z, w, y, n, x, n);
    }
    for (size_t i = 0; i < w; i++) a[i * w + i] += ridge * (double)(rows ? rows : 1) * (i < 2 * n ? 1 : free_shift);
    int code = vgi_spd_factor(w, a) ? VG_OK : vg_fail(e, VG_EINPUT, "the frames leave a regression open");
    if (code == VG_OK) {
        vgi_spd_solve(w, a, n, x);
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++) {
                r->turn[i * n + j] = x[i * n + j];
                r->change[i * n + j] = change_weight * x[(n + i) * n + j] + (i == j ? damping : 0);
            }
        for (size_t j = 0; j < n; j++) r->shift[j] = size * x[2 * n * n + j];
        code = make_stable(r, damping, e);
        if (code == VG_OK) code = fit_first(r, rows, z, y, size, ridge, damping, e);
    }
    free(z);
    return code;
}

/* ---- which ridge ---- */

/* mean distance per frame over runs of up to twelve frames that begin every third; room: 3 numbers */
static double try_out(const vgi_regression *r, const vgi_frames *f, double *room)
{
    enum { LONGEST = 12, SHORTEST = 5, APART = 3 };
    size_t n = r->numbers, runs = 0;
    double sum = 0;
    for (size_t s = 0; s < f->nsequences; s++)
        for (size_t t = f->start[s] + 2; t + SHORTEST <= f->start[s + 1]; t += APART, runs++) {
            size_t length = f->start[s + 1] - t < LONGEST ? f->start[s + 1] - t : LONGEST;
            double *before = room, *c = room + n, *next = room + 2 * n, run = 0;
            memcpy(room, f->row + (t - 2) * n, 2 * n * sizeof *room);
            for (size_t i = 0; i < length; i++) {
                vgi_regression_next(r, c, before, next);
                double far = 0;
                for (size_t k = 0; k < n; k++) far += (next[k] - f->row[(t + i) * n + k]) * (next[k] - f->row[(t + i) * n + k]);
                run += sqrt(far) / (double)length;
                double *swap = before;
                before = c, c = next, next = swap;
            }
            sum += run;
        }
    return runs ? sum / (double)runs : INFINITY;
}

static const double ridges[] = {1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1, 10}, dampings[] = {0.8, 0.9, 0.95};
enum { RIDGES = sizeof ridges / sizeof *ridges, DAMPINGS = sizeof dampings / sizeof *dampings };

typedef struct choosing {
    const vgi_frames *fitted, *tried;
    double size, error[RIDGES * DAMPINGS];
    int code[RIDGES * DAMPINGS];
} choosing;

static void try_one(void *context, size_t i)
{
    choosing *c = context;
    vgi_regression r;
    double *room = vgi_array_raw(3 * c->fitted->numbers, sizeof *room, NULL);
    c->error[i] = INFINITY;
    c->code[i] = room ? vgi_regression_make(&r, c->fitted->numbers, NULL) : VG_ENOMEM;
    if (c->code[i] == VG_OK) {
        c->code[i] = vgi_regression_fit(&r, c->fitted, false, c->size, ridges[i / DAMPINGS], dampings[i % DAMPINGS], NULL);
        if (c->code[i] == VG_OK) c->error[i] = try_out(&r, c->tried, room);
        vgi_regression_clear(&r);
    }
    free(room);
}

int vgi_regression_choose(const vgi_frames *fitted, const vgi_frames *tried, double size, int threads,
                          vgi_choice *choice, vg_err *e)
{
    choosing c = {.fitted = fitted, .tried = tried, .size = size};
    vgi_blas_alone();
    vgi_parallel(threads, RIDGES * DAMPINGS, try_one, &c);
    vgi_blas_shared();
    *choice = (vgi_choice){ridges[RIDGES - 1], 0.9, INFINITY}; /* nothing to try it on: nearly damped continuation */
    for (size_t i = 0; i < RIDGES * DAMPINGS; i++) {
        if (c.code[i] == VG_ENOMEM) return vg_fail(e, VG_ENOMEM, "out of memory: a regression of %zu numbers", fitted->numbers);
        if (c.error[i] < choice->error) *choice = (vgi_choice){ridges[i / DAMPINGS], dampings[i % DAMPINGS], c.error[i]};
    }
    return VG_OK;
}
