/* smooth.h: filters in time, and the window of frames that they use. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SIGNAL_SMOOTH_H
#define VG_SIGNAL_SMOOTH_H

#include "core/core.h"

enum { VGI_MOST_ROBUST = 201, /* frames of the window of the robust filter */
       VGI_MOVED = 7 };       /* numbers of a rigid motion: unit quaternion, position */

typedef struct vgi_time_filter {
    vg_filter filter;
    double span;    /* frames; 0: no filter */
    size_t reach;   /* frames on either side that are used */
    double *kernel; /* low-pass: reach + 1 weights, from the middle outwards */
} vgi_time_filter;

/* vgi_time_filter_make: VG_EARG if the span is out of range. */
int vgi_time_filter_make(vgi_time_filter *t, vg_filter filter, double span, vg_err *e) VG_MUST_CHECK;
void vgi_time_filter_clear(vgi_time_filter *t);
/* vgi_time_window: the frames lo .. lo + n - 1 on which frame i depends, out of `known` frames; ended: no more
 * follow. */
void vgi_time_window(const vgi_time_filter *t, size_t i, size_t known, bool ended, size_t *lo, size_t *n);
/* vgi_time_weights: frame i after a linear filter, as weights of the n frames of its window. `known` is the number of
 * all frames if i is within reach of the end. */
void vgi_time_weights(const vgi_time_filter *t, size_t i, size_t known, size_t lo, size_t n, double *weight);
/* vgi_robust_points: the robust filter of points with `width` <= 4 numbers. frame[j], j < n <= VGI_MOST_ROBUST:
 * npoints points at the time (j - at) / reach; out: npoints points at time 0. With fewer than 5 frames they are
 * unchanged. */
void vgi_robust_points(size_t npoints, size_t width, size_t n, const double *const *frame, size_t at, double reach,
                       double *out);

/* The frames that the next result depends on: a ring. A frame is the rigid motion of the body (VGI_MOVED numbers), then
 * the pose without it. */
typedef struct vgi_window {
    vgi_time_filter pose, root;
    size_t numbers;       /* of a frame */
    size_t reach, places; /* frames on either side; frames of the ring */
    double *ring;         /* places x numbers */
    size_t known, given;  /* frames added; results returned */
    bool ended;           /* no more frames will be added */
    /* set by vgi_window_filter: n frames in order, their weights in a linear filter, and which of them is filtered */
    size_t n, at;
    double *weight;
    const double **frame;
} vgi_window;

/* vgi_window_make: for a pose of `numbers` numbers. */
int vgi_window_make(vgi_window *w, const vg_smoother_options *o, size_t numbers, vg_err *e) VG_MUST_CHECK;
void vgi_window_clear(vgi_window *w);
double *vgi_window_place(const vgi_window *w, size_t i); /* of frame i */
/* vgi_window_ready: can frame number `given` be filtered? */
bool vgi_window_ready(const vgi_window *w);
/* vgi_window_robust: is t the robust filter, and on? */
bool vgi_window_robust(const vgi_time_filter *t);
/* vgi_window_filter: filter the numbers from `first` on; points of `width` <= 4 numbers move together in the robust
 * filter. */
void vgi_window_filter(vgi_window *w, const vgi_time_filter *t, int threads, size_t first, size_t width, size_t numbers,
                       double *out);
/* vgi_window_root: the rigid motion of frame number `given`, filtered; its quaternion has length 1. */
void vgi_window_root(vgi_window *w, double root[VGI_MOVED]);

/* vgi_same_side: change the sign of q if it is nearer to `before` then: both are the same rotation. */
void vgi_same_side(const double before[4], double q[4]);

#endif
