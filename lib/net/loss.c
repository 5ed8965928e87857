/* loss.c: distances of chains from the truth and from one another, not squared; the divergence of the latent numbers.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/loss.h"
#include "core/random.h"

#include <math.h>
#include <stdlib.h>

int net_group_make(net_group *g, const vgi_shape *s, vg_direction direction, size_t steps, size_t apart, vg_err *e)
{
    *g = (net_group){.direction = direction, .steps = steps};
    if (direction == VG_SEPARATE) apart = 1;
    int r = net_chains_make(&g->chains[0], s, steps, apart, e);
    if (r == VG_OK && direction == VG_SEPARATE) r = net_chains_make(&g->chains[1], s, steps, apart, e);
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
    const net_drive *drive;
    net_lanes *truth; /* workspace of one frame, which the backward pass does not use while it asks for a gradient */
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
    net_group *g = s->g;
    if (g->direction == VG_FORWARD || !(g->bidirectional > 0)) return NULL;
    if (g->direction == VG_SHARED) return net_chains_state_ahead(&g->chains[0], s->drive, g->steps - 1 - t);
    const net_chains *c = &g->chains[1 - s->which]; /* it keeps all states */
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

/* Frame t of these chains, of the others, and the truth. */
typedef struct sight {
    const net_lanes *own, *other, *truth;
    unsigned turn; /* the order of the lanes of the others */
} sight;

/* Look at frame t, and store its distances in g->norm. */
static sight look_at(side *s, size_t t)
{
    net_group *g = s->g;
    net_chains *c = &g->chains[s->which];
    double own[NET_LANES], apart[NET_LANES], *to_truth = norms(g, s->which, t), *between = norms(g, 2, t);
    sight x = {net_chains_state(c, s->drive, t), other(s, t), s->truth, g->direction == VG_SHARED ? 4 : 0};
    truth(s, t, s->truth);
    net_differences(c->shape->numbers, x.own, x.truth, x.other, x.turn, own, apart);
    for (size_t i = 0; i < NET_LANES; i++) {
        to_truth[i] = sqrt(own[i] + 1e-12);
        if (s->which == 0) between[i] = sqrt(apart[i] + 1e-12);
    }
    return x;
}

static void add_loss_gradient(void *context, size_t t, net_lanes *gradient)
{
    side *s = context;
    net_group *g = s->g;
    net_lanes by[2] = {{0}, {0}};
    sight x = look_at(s, t);
    for (size_t i = 0; i < NET_LANES; i++) {
        /* for the second of separate chains, time is reversed */
        const double *between = norms(g, 2, s->which ? g->steps - 1 - t : t);
        if (!in_use(g, i)) continue;
        by[0][i] = is_counted(g, t) ? (real)(1 / (norms(g, s->which, t)[i] * (double)g->batch)) : 0;
        by[1][i] = (real)(g->bidirectional / (between[i] * (double)g->batch));
    }
    net_pull(g->chains[s->which].shape->numbers, x.own, x.truth, x.other, x.turn, by, gradient);
}

/* Add the distances in g->norm to the loss. */
static void add_losses(const side *s, net_loss *loss)
{
    const net_group *g = s->g;
    size_t half = g->direction == VG_SHARED ? NET_LANES / 2 : NET_LANES;
    bool both = g->direction != VG_FORWARD && g->bidirectional > 0;
    for (size_t t = 0; t < g->steps; t++)
        for (size_t i = 0; i < NET_LANES; i++) {
            double far = norms(g, s->which, t)[i];
            bool forward = s->which == 0 && i < half;
            if (!in_use(g, i)) continue;
            if (is_counted(g, t)) loss->total += far / (double)g->batch;
            if (is_counted(g, t) && forward) loss->frames += far / (double)g->batch / (double)(g->steps - 1);
            if (forward && both) loss->total += g->bidirectional * norms(g, 2, t)[i] / (double)g->batch;
        }
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

static side side_of(net_group *g, int which, const net_drive *given, net_drive *d)
{
    const net_chains *c = &g->chains[which];
    *d = *given;
    d->truth = truth;
    d->forward = which ? 0 : g->direction == VG_SHARED ? NET_LANES / 2 : NET_LANES;
    return (side){.g = g, .which = which, .drive = d, .truth = c->shape->front == VGI_FRONT_MESH ? c->inner[0] : c->room[1]};
}

net_loss net_group_run(net_group *g, const net_drive drives[2], real *const gradient[2], double start, uint64_t seed)
{
    net_loss loss = {0};
    int sides = g->direction == VG_SEPARATE ? 2 : 1;
    side s[2];
    net_drive d[2];
    for (int w = 0; w < sides; w++) {
        s[w] = side_of(g, w, &drives[w], &d[w]);
        d[w].context = &s[w];
        begin_chains(g, w, start, seed);
        net_chains_forward(&g->chains[w], &d[w]);
    }
    for (int w = 0; w < sides; w++) look_at(&s[w], 0); /* the second ones need a distance of the first frame */
    for (int w = 0; w < sides; w++) {
        net_lanes shares;
        loss.total += g->divergence * divergence(g, w, &shares);
        net_chains_backward(&g->chains[w], &d[w], add_loss_gradient, &s[w], g->divergence, &shares, gradient[w], NULL);
    }
    for (int w = 0; w < sides; w++) add_losses(&s[w], &loss);
    return loss;
}

void net_group_variance(net_group *g, const net_drive drives[2], real *gradient)
{
    net_drive d;
    side s = side_of(g, 0, &drives[0], &d);
    d.context = &s;
    net_chains_variance(&g->chains[0], &d, gradient);
}
