/* reach.c: finds initial states of the recurrent layers from which a run ends near a wanted frame (L 4.4; MATH 12).
 * The print searches by sampling (CMA-ES); with the exact gradient about twenty rounds suffice.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/runner.h"
#include "numeric/minimise.h"

#include <math.h>
#include <stdlib.h>

static const double gain = 1e-4; /* relative to the distance: the search ends when a round gains less */

typedef struct reaching {
    vgi_runner *r;
    net_chains chains;
    net_drive drive;
    net_lanes *given, *start, *slope; /* given frames; initial states, and the gradient with respect to them */
    const double *target;
    double far[NET_LANES];
    float *ignored; /* gradient with respect to the parameters */
} reaching;

static void give(const void *context, size_t t, net_lanes *frame)
{
    const reaching *j = context;
    size_t n = j->r->shape.numbers;
    memcpy(frame, j->given + t * n, n * sizeof *frame);
}

/* gradient of the distance between the last frame and the target */
static void add_distance_gradient(void *context, size_t t, net_lanes *g)
{
    const reaching *j = context;
    size_t n = j->r->shape.numbers;
    if (t + 1 < j->chains.steps) return;
    const net_lanes *last = j->chains.state + t * n;
    for (size_t k = 0; k < n; k++)
        for (int i = 0; i < NET_LANES; i++) g[k][i] += (real)(((double)last[k][i] - j->target[k]) / j->far[i]);
}

static void measure_gradient(reaching *j)
{
    size_t n = j->r->shape.numbers;
    const net_lanes *last = j->chains.state + (j->chains.steps - 1) * n;
    for (int i = 0; i < NET_LANES; i++) {
        double sum = 1e-24;
        for (size_t k = 0; k < n; k++) sum += ((double)last[k][i] - j->target[k]) * ((double)last[k][i] - j->target[k]);
        j->far[i] = sqrt(sum);
    }
}

static void evaluate_distance(void *context, double *const *x, double *f, double *const *g)
{
    reaching *j = context;
    size_t rows = 2 * j->r->shape.layers * j->r->shape.hidden;
    const net_lanes none = {0};
    for (size_t k = 0; k < rows; k++)
        for (int i = 0; i < NET_LANES; i++) j->start[k][i] = (real)x[i][k];
    net_chains_begin(&j->chains, j->start);
    net_chains_forward(&j->chains, &j->drive);
    measure_gradient(j);
    net_chains_backward(&j->chains, &j->drive, add_distance_gradient, j, 0, &none, j->ignored, j->slope);
    for (int i = 0; i < NET_LANES; i++) {
        f[i] = j->far[i];
        for (size_t k = 0; k < rows; k++) g[i][k] = (double)j->slope[k][i];
    }
}

/* Copy the given frames to all lanes; before a single one, insert those that the regression predicts. */
static size_t take_given(reaching *j, size_t given, const double *in)
{
    size_t n = j->r->shape.numbers, first = 0;
    net_lanes *at = j->given;
    if (given == 1) {
        for (size_t k = 0; k < n; k++) at[2 * n + k] = (net_lanes){0} + (real)in[k];
        if (vgi_runner_reach_back(j->r, at + 2 * n, at + n, at)) first = 2;
    }
    for (size_t k = 0; k < given * n; k++) at[first * n + k] = (net_lanes){0} + (real)in[k];
    return first + given;
}

static int prepare_reaching(reaching *j, size_t given, const double *in, size_t n, vg_err *e)
{
    vgi_runner *runner = j->r;
    size_t rows = 2 * runner->shape.layers * runner->shape.hidden;
    j->given = net_array((given + 2) * runner->shape.numbers + 2 * rows, e);
    j->ignored = vgi_array(runner->net->nparameters, sizeof *j->ignored, e);
    if (!j->given || !j->ignored) return VG_ENOMEM;
    j->start = j->given + (given + 2) * runner->shape.numbers, j->slope = j->start + rows;
    vgi_runner_begin(runner, false);
    j->drive = runner->drive;
    j->drive.given = take_given(j, given, in);
    j->drive.truth = give, j->drive.context = j;
    return net_chains_make(&j->chains, &runner->shape, j->drive.given + n, 1, e);
}

int vgi_runner_reach(vgi_runner *runner, size_t given, const double *in, size_t n, const double *target, size_t rounds,
                     vgi_reach *found, vg_err *e)
{
    reaching j = {.r = runner, .target = target};
    size_t rows = 2 * runner->shape.layers * runner->shape.hidden;
    vgi_function f = {.n = rows, .look = evaluate_distance, .context = &j};
    vgi_minimum m;
    double *x = vgi_array_raw(rows, sizeof *x, e);
    int r = x ? prepare_reaching(&j, given, in, n, e) : VG_ENOMEM;
    if (r == VG_OK) {
        for (size_t k = 0; k < rows; k++) x[k] = (double)runner->start[k][0];
        vgi_blas_alone();
        r = vgi_minimise(&f, x, rounds, gain, &m, e);
        vgi_blas_shared();
    }
    if (r == VG_OK) {
        for (size_t k = 0; k < rows; k++) runner->start[k] = (net_lanes){0} + (real)x[k];
        *found = (vgi_reach){m.first, m.value, m.rounds};
    }
    net_chains_clear(&j.chains);
    free(j.given);
    free(j.ignored);
    free(x);
    return r;
}
