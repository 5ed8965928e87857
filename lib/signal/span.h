/* span.h: shapes that are sums of example poses.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SIGNAL_SPAN_H
#define VG_SIGNAL_SPAN_H

#include "signal/signal.h"

typedef struct vgi_span {
    size_t d, m;        /* numbers per pose; number of examples - 1 */
    double *home;       /* d: the first example */
    double *difference; /* m x d: the other examples minus the first */
    double *factor;     /* m x m: L of the differences' products L L' */
    double *offset;     /* m: mean of the frames' orthonormal coordinates */
} vgi_span;

/* vgi_span_make: a basis of orthonormal vectors that span the differences of the examples (count x d, count >= 2),
 * and the frames' coordinates by least squares. Takes ownership of poses (n x d, from malloc), also on failure.
 * VG_EINPUT if an example is a combination of others. */
int vgi_span_make(vgi_span *s, vgi_basis *b, double *poses, size_t n, size_t d, const double *examples, size_t count,
                  int threads, vg_err *e) VG_MUST_CHECK;
void vgi_span_clear(vgi_span *s);
/* vgi_span_project: the part of the centred poses (n x d; the caller frees it) that lies in the span. */
int vgi_span_project(const vgi_basis *b, double **poses, vg_err *e) VG_MUST_CHECK;
/* vgi_span_coordinates: convert n rows of orthonormal coordinates to coordinates in the differences. */
void vgi_span_coordinates(const vgi_span *s, size_t n, double *x);

#endif
