/* runner.c: runs chains: given frames first, then the network's own output. Training is in train.c, completion in
 * complete.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/runner.h"
#include "core/random.h"

#include <stdlib.h>

/* A view of a network's regression. */
static vgi_regression view(const vg_network *n, int back)
{
    return vgi_regression_view(n->rank, n->regression + (size_t)back * vgi_regression_size(n->rank));
}

static void take_skeletons(vgi_runner *r)
{
    size_t k = r->net->rank, square = k * k, all = 3 * square + k;
    for (int back = 0; back < 2; back++) {
        vgi_regression v = view(r->net, back);
        float *m = r->matrices + (size_t)back * all;
        for (size_t i = 0; i < square; i++) {
            m[i] = (float)v.turn[i], m[square + i] = (float)v.change[i];
            m[2 * square + i] = (float)(v.turn[i] + v.change[i]);
        }
        for (size_t i = 0; i < k; i++) m[3 * square + i] = (float)v.shift[i];
        r->skeleton[back] = (net_skeleton){.turn = m, .change = m + square, .sum = m + 2 * square, .shift = m + 3 * square};
    }
    r->drive.skeleton = r->skeleton;
    r->forward = view(r->net, 0), r->backward = view(r->net, 1);
}

static int take_numbers(vgi_runner *r, vg_err *e)
{
    const vg_network *n = r->net;
    if (!vgi_network_is_linear(n)) return VG_OK;
    size_t k = n->rank;
    r->scale = vgi_array_raw(2 * k, sizeof *r->scale, e);
    if (!r->scale) return VG_ENOMEM;
    for (size_t i = 0; i < k; i++) r->scale[i] = (float)(1 / n->scale[i]), r->scale[k + i] = (float)n->scale[k + i];
    r->drive.scale_in = r->scale, r->drive.scale_out = r->scale + k;
    if (n->model != VG_NETWORK_AUTO) return VG_OK;
    r->matrices = vgi_array_raw(2 * (3 * k * k + k), sizeof *r->matrices, e);
    if (!r->matrices) return VG_ENOMEM;
    take_skeletons(r);
    return VG_OK;
}

int vgi_runner_make(vgi_runner *r, const vg_network *n, const uint32_t *first, const uint32_t *to, size_t steps,
                    vg_err *e)
{
    *r = (vgi_runner){.net = n};
    int code = vgi_network_shape(n, &r->shape, e);
    r->shape.first = first, r->shape.to = to;
    r->drive.shape = &r->shape;
    if (code == VG_OK) code = take_numbers(r, e);
    if (code == VG_OK) code = net_chains_make(&r->chains, &r->shape, steps, e);
    if (code == VG_OK && (!(r->start = net_array(2 * n->layers * n->hidden, e)) ||
                          !(r->now = net_array(3 * n->numbers, e))))
        code = VG_ENOMEM;
    if (code < 0) return vgi_runner_clear(r), code;
    r->before = r->now + n->numbers, r->next = r->before + n->numbers;
    vgi_runner_states(r, 0.1, false, 0);
    return VG_OK;
}

void vgi_runner_clear(vgi_runner *r)
{
    net_chains_clear(&r->chains);
    free(r->scale);
    free(r->matrices);
    free(r->start);
    net_lanes *first = r->now < r->before ? r->now : r->before; /* they are swapped during a run but are one block */
    if (r->before) free(first < r->next ? first : r->next);
    else free(r->now);
    *r = (vgi_runner){0};
}

void vgi_runner_states(vgi_runner *r, double value, bool random, uint64_t seed)
{
    vgi_random numbers = vgi_random_start(seed, 3);
    for (size_t i = 0; i < 2 * r->shape.layers * r->shape.hidden; i++)
        for (int k = 0; k < NET_LANES; k++) r->start[i][k] = (real)(random ? value * vgi_random_normal(&numbers) : value);
}

void vgi_runner_begin(vgi_runner *r, bool back)
{
    r->begun = r->waiting = false, r->back = back;
    r->drive.parameters = r->net->parameters + (back && r->net->sets > 1 ? r->net->nparameters : 0);
    r->drive.forward = back ? 0 : NET_LANES;
    net_chains_begin(&r->chains, r->start);
}

/* One step from r->now; the layers' memory moves from the second place to the first. */
static void advance(vgi_runner *r)
{
    const vgi_shape *s = &r->shape;
    net_chains *c = &r->chains;
    net_chains_step(c, &r->drive, 0, r->now, r->begun ? r->before : NULL, r->next);
    for (size_t l = 0; l < s->layers; l++) {
        size_t in = vgi_shape_input(s, l);
        memcpy(c->input[l] + in, c->input[l] + in + s->hidden + in, s->hidden * sizeof *c->state);
        memcpy(c->cell[l], c->cell[l] + s->hidden, s->hidden * sizeof *c->state);
    }
    r->begun = true;
    net_lanes *swap = r->before;
    r->before = r->now, r->now = r->next, r->next = swap;
}

void vgi_runner_take(vgi_runner *r, const net_lanes *frame)
{
    if (r->waiting) advance(r); /* the prediction is replaced by the given frame */
    memcpy(r->now, frame, r->shape.numbers * sizeof *frame);
    r->waiting = true;
}

const net_lanes *vgi_runner_give(vgi_runner *r)
{
    advance(r);
    return r->now;
}

bool vgi_runner_reach_back(const vgi_runner *r, const net_lanes *frame, net_lanes *before, net_lanes *before_that)
{
    if (!r->matrices) return false;
    const vgi_regression *v = r->back ? &r->forward : &r->backward;
    size_t n = r->shape.numbers;
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
static void gather(size_t lanes, size_t n, const double *const *in, size_t t, net_lanes *frame)
{
    for (size_t k = 0; k < n; k++)
        for (size_t i = 0; i < NET_LANES; i++) frame[k][i] = (real)in[i < lanes ? i : 0][t * n + k];
}

int vgi_runner_go(vgi_runner *r, bool back, size_t lanes, size_t given, const double *const *in, size_t n,
                  double *const *out, vg_err *e)
{
    size_t w = r->shape.numbers;
    net_lanes *frame = net_array(3 * w, e);
    if (!frame) return VG_ENOMEM;
    vgi_runner_begin(r, back);
    gather(lanes, w, in, 0, frame);
    if (given == 1 && vgi_runner_reach_back(r, frame, frame + w, frame + 2 * w)) {
        vgi_runner_take(r, frame + 2 * w);
        vgi_runner_take(r, frame + w);
    }
    for (size_t t = 0; t < given; t++) {
        gather(lanes, w, in, t, frame);
        vgi_runner_take(r, frame);
    }
    for (size_t t = 0; t < n; t++) {
        const net_lanes *x = vgi_runner_give(r);
        for (size_t k = 0; k < w; k++)
            for (size_t i = 0; i < lanes; i++) out[i][t * w + k] = (double)x[k][i];
    }
    free(frame);
    return VG_OK;
}
