/* vg/network.h: a trained network, as an artefact.
 * A part of vg.h, which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_NETWORK_H
#define VG_PART_NETWORK_H

#include "vg/body.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A network that predicts the features of the next frame of a sequence (MATH 12; Qiao et al., see net.h). */
typedef enum vg_network_model {
    VG_NETWORK_AUTO = 1, /* a regression on principal coordinates, corrected by recurrent layers */
    VG_NETWORK_PCA = 2,  /* recurrent layers on principal coordinates */
    VG_NETWORK_FC = 3,   /* one full layer, then recurrent layers */
    VG_NETWORK_CONV = 4  /* mesh convolutions and one full layer, then recurrent layers, as published */
} vg_network_model;
const char *vg_network_model_name(vg_network_model m); /* "auto", "pca", "fc", "conv" */
/* Recurrent layers run forward and backward in time, with the same weights or with separate ones; or forward only. */
typedef enum vg_direction { VG_SHARED = 0, VG_SEPARATE = 1, VG_FORWARD = 2 } vg_direction;

enum { VG_NETWORK_FRAMES = 3, VG_NETWORK_METHODS = 5 };
/* Mean distance of vertices from the truth, in % of D, in the frames held out, with centroids and root of the truth: at the 5th,
 * 10th and 15th frame after 1 and after 3 given ones, by method: repetition of the last frame, linear extrapolation, damped
 * extrapolation, the regression alone, the network. NaN: not measured. */
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
    size_t numbers;         /* of a frame at the input of the layers: rank, or nv * width */
    size_t rank;            /* principal coordinates */
    size_t layers, hidden, convolutions;
    bool uncertain;         /* the latent numbers have a variance */
    size_t sets, nparameters; /* sets of weights: 1, or 2 of separate directions; parameters of one */
    uint64_t seed, frames, iterations; /* frames: how many it was trained on */
    size_t step;            /* it was trained on every step-th frame */
    double diagonal;        /* D */
    double low[2], high[2]; /* range of w, and of S and the rest, in training; scaled to -0.95 .. 0.95 */
    double change;          /* mean change of a feature from frame to frame in training */
    double ridge, damping;  /* of the regression, as validated */
    double *errors;         /* 2 x methods x frames, as in vg_network_errors; -1: not measured */
    size_t windows;         /* number of windows they were measured in */
    float *parameters;      /* sets * nparameters */
    float *basis;           /* rank x nv * width: orthonormal rows */
    double *mean;           /* nv * width */
    double *scale;          /* 2 x rank: coordinates in, changes out */
    double *range;          /* 2 x rank: least and largest in training */
    double *regression;     /* auto, forward and backward: the matrices of coordinates and of their change (rank x rank) and the
                               constant, then matrix and constant for a first frame: 2 x (3 rank^2 + 2 rank); else none */
    double *root;           /* (2 rank + 1) x nroot: the root's steps from coordinates and their change */
    size_t ncurve, ncurve_block; /* iterations of the training; the first ncurve_block with a validation block */
    float *curve;           /* 3 of each iteration: loss, norm of the gradient, error in the validation block */
    double curve_start;     /* that error before the first iteration; -1: not measured */
    bool open;              /* a checkpoint: training has not ended; only then: */
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
