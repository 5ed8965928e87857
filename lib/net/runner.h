/* runner.h: a network in use: it continues given frames, eight chains at once, one frame at a time. Internal.
 * Features and vertices are elsewhere.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RUNNER_H
#define VG_RUNNER_H

#include "net/chain.h"
#include "net/network.h"
#include "net/regression.h"

enum { VGI_SHORT_RUN = 24, VGI_LONG_GIVEN = 8, VGI_LONG_STEP = 4 };

typedef struct vgi_runner {
    const vg_network *net;    /* borrowed; its parameters may change between runs */
    vgi_shape shape;
    net_drive drive;
    net_skeleton skeleton[2];
    float *scale, *matrices;  /* in the layers' type */
    vgi_regression backward, forward; /* views of net->regression */
    net_chains chains;        /* two steps: this one and the next */
    bool borrowed;            /* the chains are somebody else's */
    net_lanes *start;         /* initial states */
    net_lanes *now, *before, *next; /* numbers each */
    bool begun, waiting, back; /* waiting: no step has been made from r->now */
} vgi_runner;

/* vgi_runner_make: first, to: neighbours of each vertex, borrowed. chains: NULL, or chains of this network to use,
 * borrowed, of at least two steps. */
int vgi_runner_make(vgi_runner *r, const vg_network *n, const uint32_t *first, const uint32_t *to,
                    const net_chains *chains, vg_err *e) VG_MUST_CHECK;
void vgi_runner_clear(vgi_runner *r);

/* vgi_runner_states: initial states of all lanes: value, or with `random` value * normal numbers of that seed. */
void vgi_runner_states(vgi_runner *r, double value, bool random, uint64_t seed);
/* vgi_runner_begin: reset, and set the direction. */
void vgi_runner_begin(vgi_runner *r, bool back);
/* vgi_runner_take: the next given frame of all lanes (numbers rows). */
void vgi_runner_take(vgi_runner *r, const net_lanes *frame);
/* vgi_runner_give: the next frame from the network; borrowed until the next call. */
const net_lanes *vgi_runner_give(vgi_runner *r);
/* vgi_runner_reach_back: two frames that the regression, run backwards, puts before a single given one. False if the
 * network has no regression. */
bool vgi_runner_reach_back(const vgi_runner *r, const net_lanes *frame, net_lanes *before, net_lanes *before_that);

/* vgi_runner_go: continue `given` frames of up to eight lanes (numbers each, frame after frame) by n frames each;
 * back: in reverse order of time. */
int vgi_runner_go(vgi_runner *r, bool back, size_t lanes, size_t given, const double *const *in, size_t n, double *const *out,
                  vg_err *e) VG_MUST_CHECK;

typedef struct vgi_reach {
    double first, last; /* distance from the target with the initial states before and after the search */
    size_t rounds;
} vgi_reach;
/* vgi_runner_reach: search initial states from which frame n after the `given` ones is nearest to `target` (numbers).
 * Starts from those of lane 0; all lanes receive the result. (reach.c) */
int vgi_runner_reach(vgi_runner *r, size_t given, const double *in, size_t n, const double *target, size_t rounds,
                     vgi_reach *found, vg_err *e) VG_MUST_CHECK;

#endif
