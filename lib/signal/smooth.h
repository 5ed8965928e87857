/* smooth.h: filters in time, and the window of frames that they use. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SIGNAL_SMOOTH_H
#define VG_SIGNAL_SMOOTH_H

#include "core/core.h"

enum { VGI_MOST_ROBUST = 201 }; /* frames of the window of the robust filter */

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

#endif
