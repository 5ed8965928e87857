/* unshape.h: poses of a fit whose shapes are not vertices, and the errors of the reconstruction. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SIGNAL_UNSHAPE_H
#define VG_SIGNAL_UNSHAPE_H

#include "signal/signal.h"
#include "signal/space.h"

typedef struct vgi_unshape {
    vgi_space space;
    vg_solver *solver;
    size_t batch;
    double root[3];      /* root of the reference, at which all poses are */
    double *poses;       /* n x 3 nv */
    double *home;
    double *shape, *vectors, *x, *rhs; /* of one batch */
    double *distance;    /* n: largest distance per frame */
    double *squares;     /* n: sums over the points of each frame */
    double most;         /* its square */
    size_t worst;        /* the frame with the largest error, evaluated first */
} vgi_unshape;

int vgi_unshape_make(vgi_unshape *u, vg_space kind, const vg_graph *g, const double *reference, int threads,
                     vg_err *e) VG_MUST_CHECK;
void vgi_unshape_clear(vgi_unshape *u);
/* vgi_unshape_error: like vgi_basis_error, for u->poses. Stops when some frame exceeds the limit; rms and errors of
 * frames are then undefined. */
int vgi_unshape_error(vgi_unshape *u, const vgi_basis *b, const double *x, size_t stride, size_t m, double limit,
                      vgi_error *error, vg_err *e) VG_MUST_CHECK;

/* vgi_unshaper_vertices: a shape of a signal as nv points, without the root motion. The first call prepares the
 * solver. */
int vgi_unshaper_vertices(vg_unshaper *u, const double *shape, double *vertices, vg_err *e) VG_MUST_CHECK;

#endif
