/* runner.c: runs chains: given frames first, then the network's own output. Training is in train.c, completion in
 * complete.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/runner.h"
#include "core/random.h"

#include <stdlib.h>

/* A view of a network's regression. */
static vgi_regression regression_of(const vg_network *n, int back)
{
    return vgi_regression_view(n->rank, n->regression + (size_t)back * vgi_regression_size(n->rank));
}

static void take_skeletons(vgi_runner *u)
{
    size_t k = u->net->rank, square = k * k, all = 3 * square + k;
    for (int back = 0; back < 2; back++) {
        vgi_regression v = regression_of(u->net, back);
        float *m = u->matrices + (size_t)back * all;
        for (size_t i = 0; i < square; i++) {
            m[i] = (float)v.turn[i], m[square + i] = (float)v.change[i];
            m[2 * square + i] = (float)(v.turn[i] + v.change[i]);
        }
        for (size_t i = 0; i < k; i++) m[3 * square + i] = (float)v.shift[i];
        u->skeleton[back] = (net_skeleton){.turn = m, .change = m + square, .sum = m + 2 * square, .shift = m + 3 * square};
    }
    u->drive.skeleton = u->skeleton;
    u->forward = regression_of(u->net, 0), u->backward = regression_of(u->net, 1);
}

static int take_numbers(vgi_runner *u, vg_err *e)
{
    const vg_network *n = u->net;
    if (!vgi_network_is_linear(n)) return VG_OK;
    size_t k = n->rank;
    u->scale = vgi_array_raw(2 * k, sizeof *u->scale, e);
    if (!u->scale) return VG_ENOMEM;
    for (size_t i = 0; i < k; i++) u->scale[i] = (float)(1 / n->scale[i]), u->scale[k + i] = (float)n->scale[k + i];
    u->drive.scale_in = u->scale, u->drive.scale_out = u->scale + k;
    if (n->model != VG_NETWORK_AUTO) return VG_OK;
    u->matrices = vgi_array_raw(2 * (3 * k * k + k), sizeof *u->matrices, e);
    if (!u->matrices) return VG_ENOMEM;
    take_skeletons(u);
    return VG_OK;
}

int vgi_runner_make(vgi_runner *u, const vg_network *n, const uint32_t *first, const uint32_t *to,
                    const net_chains *chains, vg_err *e)
{
    *u = (vgi_runner){.net = n};
    int r = vgi_network_shape(n, &u->shape, e);
    u->shape.first = first, u->shape.to = to;
    u->drive.shape = &u->shape;
    if (r == VG_OK) r = take_numbers(u, e);
    if (r == VG_OK && chains) u->chains = *chains, u->borrowed = true;
    else if (r == VG_OK) r = net_chains_make(&u->chains, &u->shape, 2, 1, e);
    if (r == VG_OK && (!(u->start = net_array(2 * n->layers * n->hidden, e)) ||
                          !(u->now = net_array(3 * n->numbers, e))))
        r = VG_ENOMEM;
    if (r < 0) return vgi_runner_clear(u), r;
    u->before = u->now + n->numbers, u->next = u->before + n->numbers;
    vgi_runner_states(u, 0.1, false, 0);
    return VG_OK;
}

void vgi_runner_clear(vgi_runner *u)
{
    if (!u->borrowed) net_chains_clear(&u->chains);
    free(u->scale);
    free(u->matrices);
    free(u->start);
    net_lanes *first = u->now < u->before ? u->now : u->before; /* they are swapped during a run but are one block */
    if (u->before) free(first < u->next ? first : u->next);
    else free(u->now);
    *u = (vgi_runner){0};
}

void vgi_runner_states(vgi_runner *u, double value, bool random, uint64_t seed)
{
    vgi_random numbers = vgi_random_start(seed, 3);
    for (size_t i = 0; i < 2 * u->shape.layers * u->shape.hidden; i++)
        for (int k = 0; k < NET_LANES; k++) u->start[i][k] = (real)(random ? value * vgi_random_normal(&numbers) : value);
}

void vgi_runner_begin(vgi_runner *u, bool back)
{
    u->begun = u->waiting = false, u->back = back;
    u->drive.parameters = u->net->parameters + (back && u->net->sets > 1 ? u->net->nparameters : 0);
    u->drive.forward = back ? 0 : NET_LANES;
    if (u->shape.uncertain) memset(u->chains.noise, 0, u->shape.latent * sizeof *u->chains.noise);
    net_chains_begin(&u->chains, u->start);
}

/* One step from u->now; the layers' memory moves from the second place to the first. */
static void advance_runner(vgi_runner *u)
{
    const vgi_shape *s = &u->shape;
    net_chains *c = &u->chains;
    net_chains_step(c, &u->drive, 0, u->now, u->begun ? u->before : NULL, u->next);
    for (size_t l = 0; l < s->layers; l++) {
        size_t in = vgi_shape_input(s, l);
        memcpy(c->input[l] + in, c->input[l] + in + s->hidden + in, s->hidden * sizeof *c->state);
        memcpy(c->cell[l], c->cell[l] + s->hidden, s->hidden * sizeof *c->state);
    }
    u->begun = true;
    net_lanes *swap = u->before;
    u->before = u->now, u->now = u->next, u->next = swap;
}

void vgi_runner_take(vgi_runner *u, const net_lanes *frame)
{
    if (u->waiting) advance_runner(u); /* the prediction is replaced by the given frame */
    memcpy(u->now, frame, u->shape.numbers * sizeof *frame);
    u->waiting = true;
}

const net_lanes *vgi_runner_give(vgi_runner *u)
{
    advance_runner(u);
    return u->now;
}

bool vgi_runner_reach_back(const vgi_runner *u, const net_lanes *frame, net_lanes *before, net_lanes *before_that)
{
    if (!u->matrices) return false;
    const vgi_regression *v = u->back ? &u->forward : &u->backward;
    size_t n = u->shape.numbers;
    for (size_t j = 0; j < n; j++) {
        net_lanes sum = frame[j] + (real)v->first_shift[j];
        for (size_t i = 0; i < n; i++) sum += frame[i] * (real)v->first[i * n + j];
        before[j] = sum;
    }
    for (size_t j = 0; j < n; j++) {
        net_lanes sum = before[j] + (real)v->shift[j];
        for (size_t i = 0; i < n; i++)
            sum += before[i] * (real)v->turn[i * n + j] + (before[i] - frame[i]) * (real)v->change[i * n + j];
        before_that[j] = sum;
    }
    return true;
}

/* frame t of all lanes; unused lanes repeat the first */
static void gather_frames(size_t lanes, size_t n, const double *const *in, size_t t, net_lanes *frame)
{
    for (size_t k = 0; k < n; k++)
        for (size_t i = 0; i < NET_LANES; i++) frame[k][i] = (real)in[i < lanes ? i : 0][t * n + k];
}

int vgi_runner_go(vgi_runner *u, bool back, size_t lanes, size_t given, const double *const *in, size_t n,
                  double *const *out, vg_err *e)
{
    size_t w = u->shape.numbers;
    net_lanes *frame = net_array(3 * w, e);
    if (!frame) return VG_ENOMEM;
    vgi_runner_begin(u, back);
    gather_frames(lanes, w, in, 0, frame);
    if (given == 1 && vgi_runner_reach_back(u, frame, frame + w, frame + 2 * w)) {
        vgi_runner_take(u, frame + 2 * w);
        vgi_runner_take(u, frame + w);
    }
    for (size_t t = 0; t < given; t++) {
        gather_frames(lanes, w, in, t, frame);
        vgi_runner_take(u, frame);
    }
    for (size_t t = 0; t < n; t++) {
        const net_lanes *x = vgi_runner_give(u);
        for (size_t k = 0; k < w; k++)
            for (size_t i = 0; i < lanes; i++) out[i][t * w + k] = (double)x[k][i];
    }
    free(frame);
    return VG_OK;
}
