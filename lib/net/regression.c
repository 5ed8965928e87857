/* regression.c: ridge regression of the change from one frame to the next, on coordinates.
 *
 * The spectral radius of the companion matrix comes from its powers by repeated squaring (Gelfand): accurate to 1e-5
 * after twenty squarings, also with complex pairs. The network that corrects the regression is elsewhere.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/regression.h"
#include "numeric/blas.h"
#include "numeric/lapack.h"

#include <math.h>
#include <stdlib.h>

static const double most_radius = 1.0005, change_weight = 10, free_shift = 1e-6;
enum { SQUARINGS = 20 };

int vgi_regression_make(vgi_regression *g, size_t n, vg_err *e)
{
    double *block = vgi_array(vgi_regression_size(n), sizeof *block, e);
    *g = (vgi_regression){0};
    if (!block) return VG_ENOMEM;
    *g = vgi_regression_view(n, block);
    return VG_OK;
}

void vgi_regression_clear(vgi_regression *g)
{
    free(g->turn);
    *g = (vgi_regression){0};
}

void vgi_regression_next(const vgi_regression *g, const double *c, const double *before, double *next)
{
    size_t n = g->numbers;
    const double *turn = before ? g->turn : g->first, *shift = before ? g->shift : g->first_shift;
    for (size_t j = 0; j < n; j++) next[j] = c[j] + shift[j];
    for (size_t i = 0; i < n; i++) {
        double d = before ? c[i] - before[i] : 0;
        for (size_t j = 0; j < n; j++) next[j] += c[i] * turn[i * n + j] + d * g->change[i * n + j];
    }
}

/* ---- stability ---- */

/* m: 2n x 2n, acting on c and the previous frame as one row */
static void companion(const vgi_regression *g, double *m)
{
    size_t n = g->numbers, w = 2 * n;
    memset(m, 0, w * w * sizeof *m);
    for (size_t i = 0; i < n; i++) {
        m[i * w + n + i] = 1;
        for (size_t j = 0; j < n; j++) {
            m[i * w + j] = g->turn[i * n + j] + g->change[i * n + j] + (i == j);
            m[(n + i) * w + j] = -g->change[i * n + j];
        }
    }
}

/* room: workspace of 2 x (2n)^2 */
static double radius(const vgi_regression *g, double *room)
{
    size_t w = 2 * g->numbers, all = w * w;
    double *a = room, *b = room + all, log_size = 0, power = 1;
    companion(g, a);
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

/* Multiplies all eigenvalues of the companion matrix by one factor, so that none is above the limit: of next = c P + before Q,
 * P becomes s P and Q becomes s^2 Q. A regression that is hardly unstable hardly changes. */
static int make_stable(vgi_regression *g, vg_err *e)
{
    size_t n = g->numbers;
    double *room = vgi_array_raw(8 * n * n, sizeof *room, e);
    if (!room) return VG_ENOMEM;
    double shrink = most_radius / radius(g, room);
    free(room);
    for (size_t i = 0; shrink < 1 && i < n; i++)
        for (size_t j = 0; j < n; j++) {
            double *turn = &g->turn[i * n + j], *change = &g->change[i * n + j], same = i == j;
            double next = shrink * (same + *turn + *change);
            *change *= shrink * shrink;
            *turn = next - same - *change;
        }
    return VG_OK;
}

/* ---- the fit ---- */

/* Row k of the system: the known values at a frame, and its change minus that of damped continuation. */
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

/* The same without the change: z consists of the first numbers of each row, followed by 1. */
static int fit_first(vgi_regression *g, size_t rows, double *z, double *y, double size, const vgi_choice *choice,
                     vg_err *e)
{
    size_t n = g->numbers, w = n + 1;
    double ridge = choice->first_ridge, damping = choice->damping;
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
    int r = vgi_spd_factor(w, a) ? VG_OK : vg_fail(e, VG_EINPUT, "the frames do not determine the regression");
    if (r == VG_OK) {
        vgi_spd_solve(w, a, n, x);
        memcpy(g->first, x, n * n * sizeof *x);
        for (size_t j = 0; j < n; j++) g->first_shift[j] = size * x[n * n + j];
    }
    free(a);
    return r;
}

/* The fit before stabilisation. */
static int fit_unstabilised(vgi_regression *g, const vgi_frames *f, bool back, double size, const vgi_choice *choice, vg_err *e)
{
    size_t n = f->numbers, w = 2 * n + 1, rows = count_rows(f);
    double damping = choice->damping, *z = vgi_array_raw(rows * (w + n) + w * w + w * n, sizeof *z, e);
    if (!z) return VG_ENOMEM;
    double *y = z + rows * w, *a = y + rows * n, *x = a + w * w;
    put_rows(f, back, size, damping, z, y);
    memset(a, 0, (w * w + w * n) * sizeof *a);
    if (rows) {
        vgi_product_transposed_double(w, w, rows, z, w, z, w, a, w);
        vgi_product_transposed_double(w, n, rows, z, w, y, n, x, n);
    }
    for (size_t i = 0; i < w; i++)
        a[i * w + i] += choice->ridge * (double)(rows ? rows : 1) * (i < 2 * n ? 1 : free_shift);
    int r = vgi_spd_factor(w, a) ? VG_OK : vg_fail(e, VG_EINPUT, "the frames do not determine the regression");
    if (r == VG_OK) {
        vgi_spd_solve(w, a, n, x);
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++) {
                g->turn[i * n + j] = x[i * n + j];
                g->change[i * n + j] = change_weight * x[(n + i) * n + j] + (i == j ? damping : 0);
            }
        for (size_t j = 0; j < n; j++) g->shift[j] = size * x[2 * n * n + j];
        r = fit_first(g, rows, z, y, size, choice, e);
    }
    free(z);
    return r;
}

int vgi_regression_fit(vgi_regression *g, const vgi_frames *f, bool back, double size, const vgi_choice *choice,
                       vg_err *e)
{
    int r = fit_unstabilised(g, f, back, size, choice, e);
    return r == VG_OK ? make_stable(g, e) : r;
}

void vgi_regression_even(vgi_regression *there, vgi_regression *back)
{
    size_t n = there->numbers;
    for (size_t i = 0; i < n * n; i++) back->first[i] = (back->first[i] - there->first[i]) / 2, there->first[i] = -back->first[i];
    for (size_t i = 0; i < n; i++) {
        back->first_shift[i] = (back->first_shift[i] - there->first_shift[i]) / 2;
        there->first_shift[i] = -back->first_shift[i];
    }
}

/* ---- choice of the ridge ---- */

static const double tiny = 1e-12; /* added to errors, which may be 0 */

/* A sum of errors and their number. */
typedef struct trial_sum {
    double sum;
    size_t n;
} trial_sum;

/* distances per frame over runs of up to twelve frames that start at every third frame; back: the frame before the
 * first is not given but predicted by the regression; room: workspace of 3 numbers */
static trial_sum try_out(const vgi_regression *g, const vgi_regression *back, const vgi_frames *f, double *room)
{
    enum { LONGEST = 12, SHORTEST = 5, APART = 3 };
    size_t n = g->numbers;
    trial_sum all = {0, 0};
    for (size_t s = 0; s < f->nsequences; s++)
        for (size_t t = f->start[s] + 2; t + SHORTEST <= f->start[s + 1]; t += APART, all.n++) {
            size_t length = f->start[s + 1] - t < LONGEST ? f->start[s + 1] - t : LONGEST;
            double *before = room, *c = room + n, *next = room + 2 * n, run = 0;
            memcpy(room, f->row + (t - 2) * n, 2 * n * sizeof *room);
            if (back) vgi_regression_next(back, c, NULL, before);
            for (size_t i = 0; i < length; i++) {
                vgi_regression_next(g, c, before, next);
                double far = 0;
                for (size_t k = 0; k < n; k++) far += (next[k] - f->row[(t + i) * n + k]) * (next[k] - f->row[(t + i) * n + k]);
                run += sqrt(far) / (double)length;
                double *swap = before;
                before = c, c = next, next = swap;
            }
            all.sum += run;
        }
    return all;
}

/* The last ridge leaves nothing but damped continuation. */
static const double ridges[] = {1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1, 10, 100, 1e9}, dampings[] = {0.8, 0.9, 0.95};
enum { RIDGES = sizeof ridges / sizeof *ridges, DAMPINGS = sizeof dampings / sizeof *dampings, CHOICES = RIDGES * DAMPINGS };

/* All choices in all folds: task i is choice i % n in fold i / n. */
typedef struct choosing {
    const vgi_fold *folds;
    double size;
    const vgi_choice *choices;
    size_t n;
    bool first; /* runs start from one frame */
    trial_sum *found;
    int *code;
} choosing;

static void try_one(void *context, size_t task)
{
    choosing *c = context;
    const vgi_fold *f = &c->folds[task / c->n];
    const vgi_choice *choice = &c->choices[task % c->n];
    size_t n = f->fitted.numbers;
    vgi_regression g = {0}, back = {0};
    double *room = vgi_array_raw(3 * n, sizeof *room, NULL);
    int r = room ? vgi_regression_make(&g, n, NULL) : VG_ENOMEM;
    if (r == VG_OK) r = fit_unstabilised(&g, &f->fitted, false, c->size, choice, NULL);
    if (r == VG_OK && c->first) r = vgi_regression_make(&back, n, NULL);
    if (r == VG_OK && c->first) r = fit_unstabilised(&back, &f->fitted, true, c->size, choice, NULL);
    if (r == VG_OK && c->first) vgi_regression_even(&g, &back);
    c->found[task] = r == VG_OK ? try_out(&g, c->first ? &back : NULL, &f->tried, room) : (trial_sum){INFINITY, 1};
    c->code[task] = r;
    vgi_regression_clear(&g);
    vgi_regression_clear(&back);
    free(room);
}

/* Mean logarithm of the errors of choice i over those of choice `to` in the same folds (of the errors themselves with
 * SIZE_MAX), and its standard error. Ratios, because a fold may be ten times as hard as another. */
static double compare_choices(const choosing *c, size_t folds, size_t i, size_t to, double *deviation)
{
    double sum = 0, squares = 0, n = 0;
    for (size_t f = 0; f < folds; f++) {
        const trial_sum *x = &c->found[f * c->n + i], *y = to == SIZE_MAX ? NULL : &c->found[f * c->n + to];
        if (!x->n) continue;
        double ratio = log(x->sum / (double)x->n + tiny) - (y ? log(y->sum / (double)y->n + tiny) : 0);
        sum += ratio, squares += ratio * ratio, n++;
    }
    *deviation = n > 1 ? sqrt(fmax(squares - sum * sum / n, 0) / (n - 1) / n) : 0;
    return n > 0 ? sum / n : INFINITY;
}

/* The largest ridge that is no worse than the best choice by one standard error (Breiman et al. 1984): what is hardly
 * better on the frames of the training is worse on motion unlike them. Unchanged if there is nothing to try on. */
static void pick_choice(const choosing *c, size_t folds, vgi_choice *best)
{
    size_t least = 0, picked = SIZE_MAX;
    double error = INFINITY, within = INFINITY, deviation;
    for (size_t i = 0; i < c->n; i++) {
        double mean = compare_choices(c, folds, i, SIZE_MAX, &deviation);
        if (mean < error) error = mean, least = i;
    }
    for (size_t i = c->n; error < INFINITY && i-- > 0;) { /* in order of their ridges */
        double mean = compare_choices(c, folds, i, least, &deviation);
        bool same = picked != SIZE_MAX && c->choices[i].ridge == c->choices[picked].ridge &&
                    c->choices[i].first_ridge == c->choices[picked].first_ridge;
        if (!(mean <= deviation) || (picked != SIZE_MAX && !(same && mean < within))) continue;
        within = mean, picked = i;
    }
    if (picked != SIZE_MAX) *best = c->choices[picked];
}

static int try_choices(choosing *c, size_t folds, int threads, vg_err *e)
{
    c->found = vgi_array(folds * c->n, sizeof *c->found, e);
    c->code = vgi_array(folds * c->n, sizeof *c->code, e);
    if (!c->found || !c->code) return VG_ENOMEM;
    vgi_blas_alone();
    vgi_parallel(threads, folds * c->n, try_one, c);
    vgi_blas_shared();
    for (size_t i = 0; i < folds * c->n; i++)
        if (c->code[i] == VG_ENOMEM)
            return vg_fail(e, VG_ENOMEM, "out of memory: a regression of %zu numbers", c->folds->fitted.numbers);
    return VG_OK;
}

int vgi_regression_choose(const vgi_fold *folds, size_t n, double size, int threads, vgi_choice *choice, vg_err *e)
{
    vgi_choice all[CHOICES];
    *choice = (vgi_choice){ridges[RIDGES - 1], 0.9, ridges[RIDGES - 1]}; /* nearly damped continuation */
    int r = VG_OK;
    for (int first = 0; r == VG_OK && first < 2; first++) {
        choosing c = {.folds = folds, .size = size, .choices = all, .n = first ? RIDGES : CHOICES, .first = first};
        for (size_t i = 0; i < c.n; i++) {
            all[i] = *choice;
            if (first) all[i].first_ridge = ridges[i];
            else all[i].ridge = ridges[i / DAMPINGS], all[i].damping = dampings[i % DAMPINGS], all[i].first_ridge = all[i].ridge;
        }
        r = try_choices(&c, n, threads, e);
        if (r == VG_OK) pick_choice(&c, n, choice);
        free(c.found);
        free(c.code);
    }
    return r;
}
