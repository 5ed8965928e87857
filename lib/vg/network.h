/* vg/network.h: a network that has learned how a sequence goes on.
 * A part of vg.h, which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_NETWORK_H
#define VG_PART_NETWORK_H

#include "vg/body.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A network that has learned how the features of a sequence go on (L 3; MATH 12). */
typedef enum vg_network_model {
    VG_NETWORK_AUTO = 1, /* a regression on principal coordinates, corrected by recurrent layers */
    VG_NETWORK_PCA = 2,  /* recurrent layers on principal coordinates */
    VG_NETWORK_FC = 3,   /* ... behind one full layer */
    VG_NETWORK_CONV = 4  /* ... behind mesh convolutions and one full layer, as printed */
} vg_network_model;
const char *vg_network_model_name(vg_network_model m); /* "auto", "pca", "fc", "conv" */
/* Chains of frames run forward and backward, with the same weights or their own; or forward only. */
typedef enum vg_direction { VG_SHARED = 0, VG_SEPARATE = 1, VG_FORWARD = 2 } vg_direction;

enum { VG_NETWORK_FRAMES = 3, VG_NETWORK_METHODS = 5 };
/* Mean distance of vertices from the truth, in % of D, in frames that were held out: centroids and root aside, at the
 * 5th, 10th and 15th frame behind 1 and 3 given ones, by method: repeat the last frame, go on in a line, go on damped,
 * the regression alone, the network. NaN: not measured. */
typedef struct vg_network_errors {
    size_t windows;
    double at[2][VG_NETWORK_METHODS][VG_NETWORK_FRAMES];
} vg_network_errors;

typedef struct vg_network {
    vg_network_model model; /* 0: there is no network */
    vg_direction direction;
    uint64_t mesh_digest;   /* vg_mesh_digest of the mesh */
    uint64_t data_digest;   /* of the frames that it was trained on */
    size_t nv, parts, width; /* of features: numbers per vertex; components */
    size_t numbers;         /* of a frame as the layers see it: rank, or nv * width */
    size_t rank;            /* principal coordinates */
    size_t layers, hidden, convolutions;
    bool uncertain;         /* the latent numbers have a variance */
    size_t sets, nparameters; /* sets of weights: 1, or 2 of separate directions; parameters of one */
    uint64_t seed, frames, iterations; /* frames: how many it was trained on */
    size_t step;            /* it was trained on every step-th frame */
    double diagonal;        /* D */
    double low[2], high[2]; /* range of w, and of S and the rest, in training: brought to -0.95 .. 0.95 */
    double change;          /* mean change of a feature from frame to frame in training */
    double ridge, damping;  /* of the regression, as validated */
    double *errors;         /* 2 x methods x frames, as in vg_network_errors; -1: not measured */
    size_t windows;         /* that they were measured in */
    float *parameters;      /* sets * nparameters */
    float *basis;           /* rank x nv * width: orthonormal rows */
    double *mean;           /* nv * width */
    double *scale;          /* 2 x rank: coordinates in, changes out */
    double *range;          /* 2 x rank: least and most in training */
    double *regression;     /* auto, forward and backward: turn, change (rank x rank), shift, and of a first frame turn
                               and shift: 2 x (3 rank^2 + 2 rank); else none */
    double *root;           /* (2 rank + 1) x nroot: the root's steps from coordinates and their change */
    size_t ncurve, ncurve_block; /* iterations of the training; the first ncurve_block beside a validation block */
    float *curve;           /* 3 of each: loss, length of the gradient, error then in the validation block */
    double curve_start;     /* that error before the first iteration; -1: not measured */
    bool open;              /* training has not ended: */
    uint64_t phase, best_iteration;
    double best_error;
    float *moments;         /* 2 x sets * nparameters */
    float *best;            /* sets * nparameters: the parameters at the best iteration so far */
} vg_network;

void vg_network_clear(vg_network *n);
int vg_network_copy(vg_network *to, const vg_network *from, vg_err *e) VG_MUST_CHECK;
/* vg_network_fits: VG_EINPUT, naming `subject`, when the network was made for another mesh. */
int vg_network_fits(const vg_network *n, const vg_mesh *m, const char *subject, vg_err *e) VG_MUST_CHECK;

#ifdef __cplusplus
}
#endif
#endif
