/* gradient.c: the gradient of one iteration: sequences drawn by seed and iteration, in groups of eight chains, whose
 * gradients are added in order, so that neither threads nor processes change a bit.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/trainer.h"
#include "net/ranks.h"
#include "core/random.h"

#include <stdlib.h>

enum { SINGLE = 8 }; /* one in so many iterations starts from single frames */

typedef struct working {
    vg_trainer *t;
    size_t first;  /* the group in the first buffer */
    size_t given, *start;
    bool single; /* sequences start with the frames that the regression puts before a single one */
    net_loss loss[64];
} working;

/* The gradient of a group: the first one's is where the sum of all is made. */
static float *gradient_of(const vg_trainer *t, size_t first, size_t i)
{
    return first + i ? t->gradient[i - !first] : t->total;
}

static void set_drives(const working *w, net_drive d[2])
{
    const vg_trainer *t = w->t;
    for (int k = 0; k < 2; k++) {
        d[k] = t->runner.drive;
        d[k].shape = &t->shape, d[k].given = w->given;
        d[k].parameters = t->net.parameters + (k && t->net.sets > 1 ? t->net.nparameters : 0);
    }
}

/* With n ranks, this process computes every nth group. */
static size_t group_of(size_t number)
{
    return number * vgi_ranks() + vgi_rank();
}

static void run_group(void *context, size_t number)
{
    working *w = context;
    vg_trainer *t = w->t;
    size_t i = group_of(number);
    net_group *g = &t->groups[i];
    size_t size = vgi_group_size(t->o.direction), first = (w->first + i) * size, one = t->net.nparameters;
    net_drive d[2];
    float *all = gradient_of(t, w->first, i), *gradient[2] = {all, all + (t->net.sets > 1 ? one : 0)};
    memset(all, 0, (t->net.sets * one - t->left_out) * sizeof *all);
    g->n = t->o.batch - first < size ? t->o.batch - first : size;
    for (size_t k = 0; k < g->n; k++) g->start[k] = w->start[first + k];
    g->frames = t->frames, g->batch = t->o.batch, g->before = w->single ? t->before : NULL;
    g->bidirectional = t->o.direction == VG_FORWARD ? 0 : t->o.bidirectional;
    g->divergence = t->net.uncertain ? t->o.divergence : 0;
    set_drives(w, d);
    w->loss[i % 64] = net_group_run(g, d, gradient, 0.1,
                               vgi_random_mix(t->o.seed * 7919 + t->state.iteration) + w->first + i);
}

/* where a group's gradient of the variance is made, after run_group */
static float *variance_of(const vg_trainer *t, size_t first, size_t i)
{
    return first + i ? gradient_of(t, first, i) : t->total + t->shape.variance;
}

static void run_variance(void *context, size_t number)
{
    working *w = context;
    vg_trainer *t = w->t;
    size_t i = group_of(number);
    net_drive d[2];
    float *gradient = variance_of(t, w->first, i);
    memset(gradient, 0, t->left_out * sizeof *gradient);
    set_drives(w, d);
    net_group_variance(&t->groups[i], d, gradient);
}

static void add_numbers(float *to, const float *from, size_t n)
{
    for (size_t k = 0; to != from && k < n; k++) to[k] += from[k];
}

/* The gradients of `groups` groups at a time, added in their order. */
static void add_groups(working *w, size_t groups, double *loss)
{
    vg_trainer *t = w->t;
    size_t all = t->net.sets * t->net.nparameters, ranks = vgi_ranks(), left_out = t->left_out;
    size_t middle = left_out ? t->shape.variance : all, behind = all - left_out - middle;
    for (size_t i = 0; i < groups; i++) {
        float *one = gradient_of(t, w->first, i);
        vgi_ranks_share(i % ranks, one, all - left_out);
        vgi_ranks_share_double(i % ranks, &w->loss[i % 64].frames, 1);
        *loss += w->loss[i % 64].frames;
        if (one == t->total && left_out) memmove(one + middle + left_out, one + middle, behind * sizeof *one);
        if (one == t->total) continue;
        add_numbers(t->total, one, middle);
        add_numbers(t->total + middle + left_out, one + middle, behind);
    }
}

static void add_variances(working *w, size_t groups)
{
    vg_trainer *t = w->t;
    for (size_t i = 0; i < groups; i++) {
        float *one = variance_of(t, w->first, i);
        vgi_ranks_share(i % vgi_ranks(), one, t->left_out);
        add_numbers(t->total + t->shape.variance, one, t->left_out);
    }
}

int vgi_trainer_gradient(vg_trainer *t, double *loss, vg_err *e)
{
    vgi_random numbers = vgi_random_start(t->o.seed, t->state.iteration + 1);
    working w = {.t = t, .start = vgi_array_raw(t->o.batch, sizeof *w.start, e)};
    if (!w.start) return VG_ENOMEM;
    for (size_t i = 0; i < t->o.batch; i++) w.start[i] = t->window[vgi_random_below(&numbers, t->nwindows)];
    w.given = t->o.given_least + vgi_random_below(&numbers, t->o.given_most - t->o.given_least + 1);
    if (w.given >= t->length) w.given = t->length - 1;
    w.single = t->before && t->length > 3 && vgi_random_below(&numbers, SINGLE) == 0;
    if (w.single) w.given = 3;
    *loss = 0;
    vgi_blas_alone();
    for (w.first = 0; w.first < t->ngroups; w.first += t->at_once) {
        size_t n = t->ngroups - w.first < t->at_once ? t->ngroups - w.first : t->at_once;
        size_t own = vgi_rank(), ranks = vgi_ranks(), parts = n > own ? (n - own - 1) / ranks + 1 : 0;
        vgi_parallel(t->o.threads, parts, run_group, &w);
        add_groups(&w, n, loss);
        if (!t->left_out) continue;
        vgi_parallel(t->o.threads, parts, run_variance, &w);
        add_variances(&w, n);
    }
    vgi_blas_shared();
    free(w.start);
    return VG_OK;
}
