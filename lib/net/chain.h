/* chain.h: eight chains of a network: forward frame by frame, and the gradients backward (MATH 12). Internal. Losses
 * are in loss.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_NET_CHAIN_H
#define VG_NET_CHAIN_H

#include "net/layer_kernel.h"
#include "net/product_kernel.h"
#include "net/shape.h"

#define net_chains_make NET(chains_make)
#define net_chains_clear NET(chains_clear)
#define net_chains_begin NET(chains_begin)
#define net_chains_step NET(chains_step)
#define net_chains_forward NET(chains_forward)
#define net_chains_backward NET(chains_backward)

/* A linear prediction of the next frame: c+ = c + c turn + (c - c_before) change + shift; matrices numbers x
 * numbers. */
typedef struct net_skeleton {
    const real *turn, *change, *shift;
    const real *sum; /* turn + change */
} net_skeleton;

/* Parameters and input of chains; all borrowed. */
typedef struct net_drive {
    const vgi_shape *shape;
    const real *parameters;
    const real *scale_in, *scale_out; /* coordinates: per number; the network receives c * scale_in and gives y *
                                         scale_out */
    const net_skeleton *skeleton;     /* NULL: none; otherwise for forward and backward chains */
    size_t forward;                   /* the first `forward` lanes run forward, the others backward */
    size_t given;                     /* number of given frames; after them a chain continues from its own output */
    void (*truth)(const void *context, size_t t, net_lanes *frame); /* frame t of all lanes */
    const void *context;
} net_drive;

typedef struct net_chains {
    const vgi_shape *shape;
    size_t steps;      /* number of frames, including the first given one */
    net_lanes *memory; /* one block for all arrays below */
    net_lanes *state;  /* steps x numbers: frame t of the chains */
    net_lanes *latent, *spread, *noise; /* steps x latent: mean; log variance and noise of an uncertain network */
    net_lanes *input[VGI_NET_LAYERS];   /* (steps + 1) x (input + hidden): input of layer l, and its h before */
    net_lanes *gates[VGI_NET_LAYERS];   /* steps x 4 hidden: i f g o */
    net_lanes *cell[VGI_NET_LAYERS];    /* (steps + 1) x hidden: c before each step */
    net_lanes *top;                     /* steps x hidden: h of the last layer */
    net_lanes *frame[2 * VGI_NET_CONVOLUTIONS + 12]; /* numbers each: workspace */
    net_lanes *row;    /* workspace: 16 x max(latent, 4 hidden) */
    real *pack;        /* workspace of products over several steps, aligned for vectors */
    size_t packed; /* packed: steps in one product of a full layer */
} net_chains;

int net_chains_make(net_chains *c, const vgi_shape *s, size_t steps, vg_err *e) VG_MUST_CHECK;
void net_chains_clear(net_chains *c);
/* net_chains_begin: set h and c of all layers: `start` holds layers x 2 x hidden rows (h, then c). */
void net_chains_begin(net_chains *c, const net_lanes *start);
/* net_chains_step: the next frame from the inputs x and before (NULL in the first step), using the memory of step
 * t. */
void net_chains_step(net_chains *c, const net_drive *d, size_t t, const net_lanes *x, const net_lanes *before,
                     net_lanes *next);
/* net_chains_forward: all steps. c->noise must be set if it is used. */
void net_chains_forward(net_chains *c, const net_drive *d);
/* net_chains_backward: pull(context, t, g) adds the gradient of the loss with respect to frame t to g. divergence:
 * weight of the mean KL divergence; lane i has the share shares[0][i]. Adds to `gradient` (laid out as the
 * parameters) and sets `start` (as in begin; may be NULL). */
void net_chains_backward(net_chains *c, const net_drive *d, void (*pull)(void *context, size_t t, net_lanes *g),
                         void *context, double divergence, const net_lanes *shares, real *gradient, net_lanes *start);

#endif
