/* loss.c: distances of chains from the truth and from one another, not squared; the divergence of the latent numbers.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/loss.h"
#include "core/random.h"

#include <math.h>
#include <stdlib.h>

int net_group_make(net_group *g, const vgi_shape *s, vg_direction direction, size_t steps, vg_err *e)
{
    *g = (net_group){.direction = direction, .steps = steps};
    int r = net_chains_make(&g->chains[0], s, steps, e);
    if (r == VG_OK && direction == VG_SEPARATE) r = net_chains_make(&g->chains[1], s, steps, e);
    if (r == VG_OK && !(g->norm = vgi_array(steps * 3 * NET_LANES, sizeof *g->norm, e))) r = VG_ENOMEM;
    if (r < 0) net_group_clear(g);
    return r;
}

void net_group_clear(net_group *g)
{
    net_chains_clear(&g->chains[0]);
    net_chains_clear(&g->chains[1]);
    free(g->norm);
    *g = (net_group){0};
}

/* The chains of one direction. */
typedef struct side {
    net_group *g;
    int which;
    net_lanes *truth; /* workspace of one frame */
    net_lanes ahead;  /* 1 / batch for lanes in use */
} side;

/* the frame of lane i of these chains at time t */
static const real *frame_of(const side *s, size_t lane, size_t t)
{
    const net_group *g = s->g;
    size_t half = g->direction == VG_SHARED ? NET_LANES / 2 : NET_LANES, sequence = lane % half;
    bool back = s->which == 1 || lane >= half;
    if (sequence >= g->n) sequence = 0; /* an unused lane */
    if (g->before && t < 2) {
        size_t third = g->start[sequence] + (back ? g->steps - 3 : 2);
        return g->before + ((third * 2 + back) * 2 + t) * g->chains[0].shape->numbers;
    }
    return g->frames + (g->start[sequence] + (back ? g->steps - 1 - t : t)) * g->chains[0].shape->numbers;
}

static void truth(const void *context, size_t t, net_lanes *frame)
{
    const side *s = context;
    const real *from[NET_LANES];
    for (size_t i = 0; i < NET_LANES; i++) from[i] = frame_of(s, i, t);
    for (size_t k = 0; k < s->g->chains[0].shape->numbers; k++)
        for (int i = 0; i < NET_LANES; i++) frame[k][i] = from[i][k];
}

static bool in_use(const net_group *g, size_t lane)
{
    return lane % (g->direction == VG_SHARED ? NET_LANES / 2 : NET_LANES) < g->n;
}

/* the other chains' frame at the same time of the sequence; NULL: none */
static const net_lanes *other(const side *s, size_t t)
{
    const net_group *g = s->g;
    if (g->direction == VG_FORWARD || !(g->bidirectional > 0)) return NULL;
    const net_chains *c = &g->chains[g->direction == VG_SHARED ? 0 : 1 - s->which];
    return c->state + (g->steps - 1 - t) * c->shape->numbers;
}

static double *norms(const net_group *g, int which, size_t t)
{
    return g->norm + (3 * t + (size_t)which) * NET_LANES;
}

/* Whether frame t is compared with the truth. Frames inserted before the first one are not. */
static bool is_counted(const net_group *g, size_t t)
{
    return t > (g->before ? 2 : 0);
}

/* Store distances in g->norm, add their sums to *loss. */
static void measure_losses(side *s, net_loss *loss)
{
    net_group *g = s->g;
    const net_chains *c = &g->chains[s->which];
    size_t n = c->shape->numbers, half = g->direction == VG_SHARED ? NET_LANES / 2 : NET_LANES;
    for (size_t t = 0; t < g->steps; t++) {
        double own[NET_LANES], apart[NET_LANES], *to_truth = norms(g, s->which, t), *between = norms(g, 2, t);
        truth(s, t, s->truth);
        net_differences(n, c->state + t * n, s->truth, other(s, t), g->direction == VG_SHARED ? 4 : 0, own, apart);
        for (size_t i = 0; i < NET_LANES; i++) {
            to_truth[i] = sqrt(own[i] + 1e-12);
            if (s->which == 0) between[i] = sqrt(apart[i] + 1e-12);
            if (!in_use(g, i)) continue;
            bool forward = s->which == 0 && i < half;
            if (is_counted(g, t)) loss->total += to_truth[i] / (double)g->batch;
            if (is_counted(g, t) && forward) loss->frames += to_truth[i] / (double)g->batch / (double)(g->steps - 1);
            if (forward && other(s, t)) loss->total += g->bidirectional * between[i] / (double)g->batch;
        }
    }
}

static void add_loss_gradient(void *context, size_t t, net_lanes *gradient)
{
    side *s = context;
    net_group *g = s->g;
    const net_chains *c = &g->chains[s->which];
    size_t n = c->shape->numbers;
    net_lanes by[2] = {{0}, {0}};
    for (size_t i = 0; i < NET_LANES; i++) {
        /* for the second of separate chains, time is reversed */
        const double *between = norms(g, 2, s->which ? g->steps - 1 - t : t);
        if (!in_use(g, i)) continue;
        by[0][i] = is_counted(g, t) ? (real)(1 / (norms(g, s->which, t)[i] * (double)g->batch)) : 0;
        by[1][i] = (real)(g->bidirectional / (between[i] * (double)g->batch));
    }
    truth(s, t, s->truth);
    net_pull(n, c->state + t * n, s->truth, other(s, t), g->direction == VG_SHARED ? 4 : 0, by, gradient);
}

static void begin_chains(net_group *g, int which, double start, uint64_t seed)
{
    net_chains *c = &g->chains[which];
    const vgi_shape *s = c->shape;
    size_t rows = 2 * s->layers * s->hidden, half = g->direction == VG_SHARED ? NET_LANES / 2 : NET_LANES;
    net_lanes value;
    for (size_t i = 0; i < NET_LANES; i++) value[i] = (real)(which == 1 || i >= half ? -start : start);
    for (size_t k = 0; k < rows; k++) c->row[k] = value;
    net_chains_begin(c, c->row);
    vgi_random r = vgi_random_start(seed, (uint64_t)which);
    for (size_t k = 0; s->uncertain && k < (g->steps - 1) * s->latent; k++)
        for (int i = 0; i < NET_LANES; i++) c->noise[k][i] = (real)vgi_random_normal(&r);
}

/* share of each lane in the mean divergence, and the divergence itself */
static double divergence(const net_group *g, int which, net_lanes *shares)
{
    const net_chains *c = &g->chains[which];
    const vgi_shape *s = c->shape;
    double sum = 0, share = 1 / ((double)(g->steps - 1) * (double)g->batch * (g->direction == VG_SHARED ? 2 : 1));
    for (size_t i = 0; i < NET_LANES; i++) shares[0][i] = (real)(in_use(g, i) ? share : 0);
    for (size_t k = 0; s->uncertain && k < (g->steps - 1) * s->latent; k++)
        for (int i = 0; i < NET_LANES; i++) {
            double m = (double)c->latent[k][i], v = (double)c->spread[k][i];
            sum += (double)shares[0][i] * 0.5 * (m * m + exp(v) - 1 - v);
        }
    return sum;
}

net_loss net_group_run(net_group *g, const net_drive drives[2], real *const gradient[2], double start, uint64_t seed)
{
    net_loss loss = {0};
    int sides = g->direction == VG_SEPARATE ? 2 : 1;
    side s[2];
    net_drive d[2];
    for (int w = 0; w < sides; w++) {
        const vgi_shape *shape = g->chains[w].shape;
        s[w] = (side){.g = g, .which = w, .truth = g->chains[w].frame[shape->front == VGI_FRONT_MESH ? 0 : 1]};
        d[w] = drives[w];
        d[w].truth = truth, d[w].context = &s[w];
        d[w].forward = w ? 0 : g->direction == VG_SHARED ? NET_LANES / 2 : NET_LANES;
        begin_chains(g, w, start, seed);
        net_chains_forward(&g->chains[w], &d[w]);
    }
    for (int w = 0; w < sides; w++) measure_losses(&s[w], &loss);
    for (int w = 0; w < sides; w++) {
        net_lanes shares;
        loss.total += g->divergence * divergence(g, w, &shares);
        /* a frame that the backward pass does not use at this point */
        s[w].truth = g->chains[w].frame[g->chains[w].shape->front == VGI_FRONT_MESH ? 0 : 4];
        net_chains_backward(&g->chains[w], &d[w], add_loss_gradient, &s[w], g->divergence, &shares, gradient[w], NULL);
    }
    return loss;
}
