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
#define net_chains_state NET(chains_state)
#define net_chains_state_ahead NET(chains_state_ahead)
#define net_chains_variance NET(chains_variance)

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
    size_t apart;      /* every apart-th state is kept, the others are computed again; 1: all are kept */
    bool late;         /* the gradient of the variance is made after all others, by net_chains_variance */
    net_lanes *memory; /* one block for all arrays below */
    net_lanes *state;  /* numbers each: frames 0, apart, 2 apart, ... of the chains */
    net_lanes *near;   /* (apart - 1) x numbers: the states between two that are kept: of `segment` */
    net_lanes *ahead;  /* numbers: state `ahead_at`, which moves on frame by frame */
    size_t segment, ahead_at;
    net_lanes *latent, *spread, *noise; /* steps x latent: mean; log variance and noise of an uncertain network */
    net_lanes *input[VGI_NET_LAYERS];   /* (steps + 1) x (input + hidden): input of layer l, and its h before */
    net_lanes *gates[VGI_NET_LAYERS];   /* steps x 4 hidden: i f g o */
    net_lanes *cell[VGI_NET_LAYERS];    /* (steps + 1) x hidden: c before each step */
    net_lanes *top;                     /* steps x hidden: h of the last layer */
    /* workspace of numbers each; inner: outputs of convolutions; room: a given frame */
    net_lanes *inner[VGI_NET_CONVOLUTIONS + 1], *work, *dy, *other, *dstate, *dinput, *room[2];
    net_lanes *from_behind, *later; /* of coordinates */
    net_lanes *row;    /* workspace: 16 x max(latent, 4 hidden) */
    real *pack;        /* workspace of products over several steps, aligned for vectors */
    size_t packed; /* packed: steps in one product of a full layer */
} net_chains;

/* net_chains_make: apart: as above; 0: what suits the size of the states. */
int net_chains_make(net_chains *c, const vgi_shape *s, size_t steps, size_t apart, vg_err *e) VG_MUST_CHECK;
void net_chains_clear(net_chains *c);
/* net_chains_begin: set h and c of all layers: `start` holds layers x 2 x hidden rows (h, then c). */
void net_chains_begin(net_chains *c, const net_lanes *start);
/* net_chains_step: the next frame from the inputs x and before (NULL in the first step), using the memory of step
 * t. */
void net_chains_step(net_chains *c, const net_drive *d, size_t t, const net_lanes *x, const net_lanes *before,
                     net_lanes *next);
/* net_chains_forward: all steps. c->noise must be set if it is used. */
void net_chains_forward(net_chains *c, const net_drive *d);
/* net_chains_state: frame t of the chains, after net_chains_forward; for t that falls. net_chains_state_ahead: for t
 * that rises. Both may use the workspace inner, work and room, and are valid until the next call. */
const net_lanes *net_chains_state(net_chains *c, const net_drive *d, size_t t);
const net_lanes *net_chains_state_ahead(net_chains *c, const net_drive *d, size_t t);
/* net_chains_backward: pull(context, t, g) adds the gradient of the loss with respect to frame t to g. divergence:
 * weight of the mean KL divergence; lane i has the share shares[0][i]. Adds to `gradient` (laid out as the
 * parameters; if c->late, without the matrix of the variance, whose place the next ones take) and sets `start` (as in
 * begin; may be NULL). */
void net_chains_backward(net_chains *c, const net_drive *d, void (*pull)(void *context, size_t t, net_lanes *g),
                         void *context, double divergence, const net_lanes *shares, real *gradient, net_lanes *start);
/* net_chains_variance: adds to the gradient of the matrix of the variance, after net_chains_backward, if c->late. */
void net_chains_variance(net_chains *c, const net_drive *d, real *gradient);

#endif
