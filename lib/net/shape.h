/* shape.h: the sizes of a network and the layout of its parameters: one table, one block (MATH 12). Internal. The
 * parameters themselves are elsewhere.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_NET_SHAPE_H
#define VG_NET_SHAPE_H

#include "core/core.h"

enum { VGI_NET_CONVOLUTIONS = 8, VGI_NET_LAYERS = 8, VGI_NET_PARAMETERS = 4 * VGI_NET_CONVOLUTIONS + 3 + 2 * VGI_NET_LAYERS + 2 };

/* What is between a frame and the recurrent layers. */
typedef enum vgi_front {
    VGI_FRONT_LINEAR = 1, /* scaled coordinates; a full layer decodes */
    VGI_FRONT_MESH = 2    /* mesh convolutions (possibly none), then one full layer with tied weights in the decoder */
} vgi_front;

/* A matrix or vector of the block, row-major. */
typedef struct vgi_parameter {
    char name[20];
    size_t at, rows, columns;
} vgi_parameter;

typedef struct vgi_shape {
    vgi_front front;
    size_t vertices, channels; /* of a frame; coordinates: 1 channel */
    size_t numbers;            /* of a frame: vertices * channels */
    size_t latent;             /* numbers that the recurrent layers see; for a mesh: hidden */
    size_t hidden, layers, convolutions;
    bool uncertain;            /* the latent numbers come with a variance (KL) */
    const uint32_t *first, *to; /* of a mesh: the neighbours of vertex v are to[first[v]] .. to[first[v + 1] - 1] */
    /* offsets of the parameters in the block */
    size_t own[VGI_NET_CONVOLUTIONS], mean[VGI_NET_CONVOLUTIONS];     /* channels x channels */
    size_t bias[VGI_NET_CONVOLUTIONS], bias_back[VGI_NET_CONVOLUTIONS]; /* channels; of the mirrored layer */
    size_t full;               /* mesh: numbers x latent; coordinates: hidden x numbers */
    size_t full_bias;          /* coordinates: numbers */
    size_t variance, variance_bias; /* numbers x latent, latent */
    size_t gates[VGI_NET_LAYERS], gates_bias[VGI_NET_LAYERS]; /* (input + hidden) x 4 hidden (i f g o), 4 hidden */
    size_t total;
    size_t nparameters;
    vgi_parameter parameter[VGI_NET_PARAMETERS];
} vgi_shape;

/* vgi_shape_plan: compute latent, numbers, offsets and table from the other sizes. VG_EARG if they are out of range
 * or too large. */
int vgi_shape_plan(vgi_shape *s, vg_err *e) VG_MUST_CHECK;
/* the number of inputs of a recurrent layer */
static inline size_t vgi_shape_input(const vgi_shape *s, size_t layer)
{
    return layer ? s->hidden : s->latent;
}
/* vgi_shape_start: initial values of the parameters (total numbers), from a seed. quiet: the output weights of a
 * network that corrects a regression are 0.01 times the usual. */
int vgi_shape_start(const vgi_shape *s, uint64_t seed, bool quiet, float *parameters, vg_err *e) VG_MUST_CHECK;

#endif
