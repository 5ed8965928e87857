/* generator.h: state of a network in use. Internal; shared by generate.c and complete.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GENERATOR_H
#define VG_GENERATOR_H

#include "net/feature.h"
#include "net/root.h"
#include "net/runner.h"

enum { VGI_WATCHED = 16 }; /* frames whose change and drift are watched */

struct vg_generator {
    const vg_network *net;
    vg_generate_options o;
    vg_featurer *featurer;
    vgi_runner runner;
    size_t d, nv, main_part;
    size_t given, made;     /* poses of this run */
    double *past;           /* VGI_LONG_GIVEN * step x numbers: the last frames, latest last; npast of them */
    size_t npast;
    bool sparse;            /* they are spaced as the network's frames are; otherwise as the input poses */
    size_t part;            /* steps after the first of two network frames */
    double *x_from, *centroids_from, root_from[4]; /* state at the first of them */
    net_lanes *frame;       /* 3 x numbers */
    double *x, *before, *kept, *features; /* d each: the last frame normalised, the one before, the part outside the
                                             basis */
    double *c, *c_before, *steps;         /* rank, rank, roots */
    double root[4], *centroids;
    double *room;           /* d and the centroids */
    double *numbers;        /* numbers of one frame as the layers see it */
    double changes[VGI_WATCHED], drifts[VGI_WATCHED];
    bool begun;
};

/* vgi_generator_remember: append a frame. */
void vgi_generator_remember(vg_generator *g, const double *frame);
/* vgi_generator_thin: keep only remembered frames with the spacing of the network's frames. */
void vgi_generator_thin(vg_generator *g);
/* vgi_turn_towards: to := the rotation at the fraction `part` of the shortest way from a to b. */
void vgi_turn_towards(const double a[4], const double b[4], double part, double to[4]);
/* vgi_generator_states: initial states of all lanes: those of the training, or random ones; try: number of the random
 * draw. */
void vgi_generator_states(vg_generator *g, bool back, uint64_t try);
/* vgi_generator_move: advance root and centroids, from the coordinates g->c and those before. */
void vgi_generator_move(const vg_generator *g, const double *c, const double *before, double *root, double *centroids);
/* vgi_generator_pose: the pose (nv points) of normalised features x, with a given root and centroids. */
int vgi_generator_pose(vg_generator *g, const double *x, const double *root, const double *centroids, double *pose,
                       vg_err *e) VG_MUST_CHECK;

#endif
