/* unshape.h: poses of a fit whose shapes are no vertices, and the errors of what comes back. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SIGNAL_UNSHAPE_H
#define VG_SIGNAL_UNSHAPE_H

#include "signal/signal.h"
#include "signal/space.h"

typedef struct vgi_unshape {
    vgi_space space;
    vg_solver *solver;
    size_t batch;
    double root[3];      /* of the reference, where all poses are */
    double *poses;       /* n x 3 nv */
    double *home;
    double *shape, *vectors, *x, *rhs; /* of a batch */
    double *distance;    /* n: largest of each frame */
    double most;         /* its square */
    size_t worst;        /* the frame whose error is largest: looked at first */
} vgi_unshape;

int vgi_unshape_make(vgi_unshape *u, vg_space kind, const vg_graph *g, const double *reference, int threads,
                     vg_err *e) VG_MUST_CHECK;
void vgi_unshape_clear(vgi_unshape *u);
/* vgi_unshape_error: as vgi_basis_error, of u->poses. Ends early when some frame is beyond the limit; rms and errors of
 * frames are then of no meaning. */
int vgi_unshape_error(vgi_unshape *u, const vgi_basis *b, const double *x, size_t stride, size_t m, double limit,
                      vgi_error *error, vg_err *e) VG_MUST_CHECK;

/* vgi_unshaper_vertices: a shape of a signal as nv points, without the root's motion: the solve is made ready at the first
 * call. */
int vgi_unshaper_vertices(vg_unshaper *u, const double *shape, double *vertices, vg_err *e) VG_MUST_CHECK;

#endif
