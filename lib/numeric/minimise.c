/* minimise.c: L-BFGS with a line search that evaluates eight steps at once.
 *
 * Debian's liblbfgs asks for one point at a time. Here one point costs as much as eight, because eight chains of a
 * network always run side by side. So a round takes one evaluation, and its step is nearly the best along its
 * direction.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/minimise.h"
#include "numeric/vec3.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

enum { MEMORY = 10, TRIALS = VGI_MINIMISE_TRIALS, SHORTENINGS = 3 };
static const double sufficient = 1e-4; /* least decrease of a step, relative to the decrease that the slope predicts
                                          (Armijo) */
static const double least_curvature = 1e-10; /* relative to |s| |y|: pairs with less contain no information on the
                                                curvature */
static const double step[TRIALS] = {1, 0.5, 0.25, 2, 0.1, 4, 0.03, 0.01};

typedef struct search {
    const vgi_function *f;
    double *memory; /* one block for all arrays below */
    double *g, *d, *x[TRIALS], *gradient[TRIALS], value[TRIALS];
    double *s[MEMORY], *y[MEMORY], curvature[MEMORY]; /* the last changes of x and g, the newest at `pairs - 1` */
    size_t pairs;
} search;

static int make_search(search *s, const vgi_function *f, vg_err *e)
{
    *s = (search){.f = f};
    double *at = s->memory = vgi_array((2 + 2 * TRIALS + 2 * MEMORY) * (f->n + 1), sizeof *at, e);
    if (!at) return VG_ENOMEM;
    s->g = at, s->d = at += f->n;
    for (int i = 0; i < TRIALS; i++) s->x[i] = at += f->n, s->gradient[i] = at += f->n;
    for (int i = 0; i < MEMORY; i++) s->s[i] = at += f->n, s->y[i] = at += f->n;
    return VG_OK;
}

/* d := -H g, with H the inverse Hessian from the pairs (the two loops of algorithm 7.4) */
static void find_direction(search *s)
{
    size_t n = s->f->n;
    double by[MEMORY];
    for (size_t i = 0; i < n; i++) s->d[i] = -s->g[i];
    for (size_t k = s->pairs; k-- > 0;) {
        by[k] = vgi_inner(s->s[k], s->d, n) / s->curvature[k];
        for (size_t i = 0; i < n; i++) s->d[i] -= by[k] * s->y[k][i];
    }
    if (!s->pairs) return;
    const double *y = s->y[s->pairs - 1];
    double scale = s->curvature[s->pairs - 1] / vgi_inner(y, y, n);
    for (size_t i = 0; i < n; i++) s->d[i] *= scale;
    for (size_t k = 0; k < s->pairs; k++) {
        double more = by[k] - vgi_inner(s->y[k], s->d, n) / s->curvature[k];
        for (size_t i = 0; i < n; i++) s->d[i] += more * s->s[k][i];
    }
}

/* The lowest of eight points along d with sufficient decrease; TRIALS if none has it. */
static int try_steps(search *s, const double *x, double value, double slope, double unit)
{
    int best = TRIALS;
    for (int i = 0; i < TRIALS; i++)
        for (size_t k = 0; k < s->f->n; k++) s->x[i][k] = x[k] + unit * step[i] * s->d[k];
    s->f->look(s->f->context, s->x, s->value, s->gradient);
    for (int i = 0; i < TRIALS; i++)
        if (s->value[i] <= value + sufficient * unit * step[i] * slope && (best == TRIALS || s->value[i] < s->value[best]))
            best = i;
    return best;
}

/* Store the pair (s, y) of the step from x to point `taken`. */
static void remember(search *s, const double *x, int taken)
{
    size_t n = s->f->n, k = s->pairs < MEMORY ? s->pairs : MEMORY - 1;
    if (s->pairs == MEMORY) {
        double *oldest_s = s->s[0], *oldest_y = s->y[0];
        memmove(s->s, s->s + 1, (MEMORY - 1) * sizeof *s->s);
        memmove(s->y, s->y + 1, (MEMORY - 1) * sizeof *s->y);
        memmove(s->curvature, s->curvature + 1, (MEMORY - 1) * sizeof *s->curvature);
        s->s[k] = oldest_s, s->y[k] = oldest_y;
    }
    for (size_t i = 0; i < n; i++) {
        s->s[k][i] = s->x[taken][i] - x[i];
        s->y[k][i] = s->gradient[taken][i] - s->g[i];
    }
    s->curvature[k] = vgi_inner(s->s[k], s->y[k], n);
    double size = sqrt(vgi_inner(s->s[k], s->s[k], n) * vgi_inner(s->y[k], s->y[k], n));
    s->pairs = s->curvature[k] > least_curvature * size && size > 0 ? k + 1 : k;
}

/* One round. Returns true if it gained enough to continue. */
static bool search_on(search *s, double *x, double gain, vgi_minimum *m)
{
    size_t n = s->f->n;
    int taken = TRIALS;
    find_direction(s);
    double slope = vgi_inner(s->g, s->d, n);
    if (!(slope < 0)) return false;
    double unit = s->pairs ? 1 : fmin(1, 1 / sqrt(-slope)); /* in the first round d is the gradient: a step of length
                                                               at most 1 */
    for (int i = 0; taken == TRIALS && i < SHORTENINGS; i++, unit *= step[TRIALS - 1] / 2)
        taken = try_steps(s, x, m->value, slope, unit);
    if (taken == TRIALS) return false;
    double before = m->value;
    remember(s, x, taken);
    memcpy(x, s->x[taken], n * sizeof *x);
    memcpy(s->g, s->gradient[taken], n * sizeof *x);
    m->value = s->value[taken];
    m->rounds++;
    return before - m->value > gain * fabs(before);
}

int vgi_minimise(const vgi_function *f, double *x, size_t rounds, double gain, vgi_minimum *m, vg_err *e)
{
    search s;
    if (make_search(&s, f, e) < 0) return VG_ENOMEM;
    for (int i = 0; i < TRIALS; i++) memcpy(s.x[i], x, f->n * sizeof *x);
    f->look(f->context, s.x, s.value, s.gradient);
    *m = (vgi_minimum){s.value[0], s.value[0], 0};
    memcpy(s.g, s.gradient[0], f->n * sizeof *x);
    while (m->rounds < rounds && search_on(&s, x, gain, m))
        ;
    free(s.memory);
    return VG_OK;
}
