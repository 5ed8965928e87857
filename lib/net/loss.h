/* loss.h: the loss of pairs of chains, one forward and one backward over the same frames, and its gradient (L 3.3;
 * MATH 12).
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_NET_LOSS_H
#define VG_NET_LOSS_H

#include "net/chain.h"

#define net_group_make NET(group_make)
#define net_group_clear NET(group_clear)
#define net_group_run NET(group_run)
#define net_group_variance NET(group_variance)

/* Sequences per group: four with shared weights (eight lanes), eight otherwise. */
static inline size_t vgi_group_size(vg_direction d)
{
    return d == VG_SHARED ? NET_LANES / 2 : NET_LANES;
}

typedef struct net_loss {
    double frames;      /* mean distance from the truth, per frame of the forward chains */
    double total;       /* everything that is minimised except weight decay */
} net_loss;

typedef struct net_group {
    vg_direction direction;
    size_t steps;
    net_chains chains[2]; /* the second one for separate weights */
    double *norm;         /* steps x 3 x 8: distances of both from the truth, and of the first from the second */
    const real *frames;   /* all frames, a row of shape.numbers each; borrowed */
    const real *before;   /* NULL, or for sequences that start with a single frame: two frames inserted before each
                             frame, for forward chains and for backward ones: 2 x 2 rows per frame; borrowed */
    size_t start[NET_LANES], n; /* first frame of each sequence; number of sequences */
    double bidirectional, divergence; /* weights of the losses */
    size_t batch;         /* number of sequences in all groups, by which each loss is divided */
} net_group;

/* net_group_make: apart: see net_chains. Separate chains keep all states: each needs the other's. */
int net_group_make(net_group *g, const vgi_shape *s, vg_direction direction, size_t steps, size_t apart, vg_err *e) VG_MUST_CHECK;
void net_group_clear(net_group *g);
/* net_group_run: drives: forward and backward weights, the first for both if shared (truth and context are set here).
 * gradient: as for net_chains_backward, added to; the second one for separate weights. start: value of all initial
 * states, positive for forward, negative for backward chains. seed: for the noise of an uncertain network. */
net_loss net_group_run(net_group *g, const net_drive drives[2], real *const gradient[2], double start, uint64_t seed);
/* net_group_variance: after net_group_run, if chains[0].late: adds to the gradient of the matrix of the variance. */
void net_group_variance(net_group *g, const net_drive drives[2], real *gradient);

#endif
