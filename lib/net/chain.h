/* chain.h: eight chains of a network: frame after frame forward, and the gradients back (MATH 12).
 * Internal. Leaves out losses (loss.h) and training.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_NET_CHAIN_H
#define VG_NET_CHAIN_H

#include "net/layer_kernel.h"
#include "net/shape.h"

#define net_chains_make NET(chains_make)
#define net_chains_clear NET(chains_clear)
#define net_chains_begin NET(chains_begin)
#define net_chains_step NET(chains_step)
#define net_chains_forward NET(chains_forward)
#define net_chains_backward NET(chains_backward)

/* A linear part of what comes next: c+ = c + c turn + (c - c_before) change + shift; matrices numbers x numbers. */
typedef struct net_skeleton {
    const real *turn, *change, *shift;
    const real *sum; /* turn + change */
} net_skeleton;

/* What chains run by; all is borrowed. */
typedef struct net_drive {
    const vgi_shape *shape;
    const real *parameters;
    const real *scale_in, *scale_out; /* coordinates: per number; the network sees c * scale_in, gives y * scale_out */
    const net_skeleton *skeleton;     /* NULL: none; else of the forward and of the backward chains */
    size_t forward;                   /* the first `forward` lanes run forward, the others backward */
    size_t given;                     /* frames that are given; from then on a chain goes on from its own */
    void (*truth)(const void *context, size_t t, net_lanes *frame); /* frame t of all lanes */
    const void *context;
} net_drive;

typedef struct net_chains {
    const vgi_shape *shape;
    size_t steps;      /* frames, the first given one among them */
    net_lanes *memory; /* all that follows */
    net_lanes *state;  /* steps x numbers: frame t as the chains have it */
    net_lanes *latent, *spread, *noise; /* steps x latent: mean; log variance and noise of an uncertain network */
    net_lanes *input[VGI_NET_LAYERS];   /* (steps + 1) x (input + hidden): what layer l sees, with its h before */
    net_lanes *gates[VGI_NET_LAYERS];   /* steps x 4 hidden: i f g o */
    net_lanes *cell[VGI_NET_LAYERS];    /* (steps + 1) x hidden: c before each step */
    net_lanes *top;                     /* steps x hidden: h of the last layer */
    net_lanes *frame[2 * VGI_NET_CONVOLUTIONS + 12]; /* numbers each: work */
    net_lanes *row;    /* work: 16 x max(latent, 4 hidden) */
    real *pack;        /* work of products over several steps */
    size_t pack_size;
} net_chains;

int net_chains_make(net_chains *c, const vgi_shape *s, size_t steps, vg_err *e) VG_MUST_CHECK;
void net_chains_clear(net_chains *c);
/* net_chains_begin: initial h and c of all layers: `start` holds layers x 2 x hidden rows (h, then c). */
void net_chains_begin(net_chains *c, const net_lanes *start);
/* net_chains_step: from the inputs x and before (NULL at the first) the next frame, with the memory of place t. */
void net_chains_step(net_chains *c, const net_drive *d, size_t t, const net_lanes *x, const net_lanes *before,
                     net_lanes *next);
/* net_chains_forward: all steps. c->noise was set if it matters. */
void net_chains_forward(net_chains *c, const net_drive *d);
/* net_chains_backward: pull(context, t, g) adds the gradient of the loss by frame t to g; divergence: weight of the
 * mean KL divergence, of which lane i counts shares[0][i]. Adds to `gradient` (as the parameters) and sets `start` (as for begin; NULL). */
void net_chains_backward(net_chains *c, const net_drive *d, void (*pull)(void *context, size_t t, net_lanes *g),
                         void *context, double divergence, const net_lanes *shares, real *gradient, net_lanes *start);

#endif
