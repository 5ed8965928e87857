/* learn.h: what weights and motions are learned from in turn: all vertices of a mesh, or every so many of them.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_LEARN_H
#define VG_LEARN_H

#include "core/core.h"

typedef struct vgi_learning {
    vg_rig rig;           /* its skin belongs to the learning, all else is borrowed */
    size_t nv, n;         /* vertices, poses */
    double *reference;    /* nv points */
    double **poses;       /* n times nv points */
    double **transforms;  /* n times 7 per bone; borrowed */
    double *at;           /* 3 per bone; borrowed */
    double *left;         /* nv: root mean square distance that skinning leaves of each vertex */
    int threads;
} vgi_learning;

/* vgi_learning_gather: at most `most` vertices, evenly strided, of the reference and the poses. */
int vgi_learning_gather(vgi_learning *l, size_t nv, const double *reference, size_t n, const double *const *poses,
                        size_t most, vg_err *e) VG_MUST_CHECK;
/* vgi_learning_clear: what gather has made, and the skin. */
void vgi_learning_clear(vgi_learning *l);
/* vgi_learning_weights: the skin for the motions that are there. miss: the mean of `left`. */
int vgi_learning_weights(vgi_learning *l, double *miss, vg_err *e) VG_MUST_CHECK;
/* vgi_learning_alternate: motions(l, context, begun, e) and weights in turn, until a round lowers `miss` by less than
 * 0.4 %. begun: the transforms are there to begin with. */
int vgi_learning_alternate(vgi_learning *l, int (*motions)(vgi_learning *, void *, bool, vg_err *), void *context,
                           bool begun, double *miss, vg_err *e) VG_MUST_CHECK;
/* vgi_learning_keep: the skin becomes that of rig r. */
void vgi_learning_keep(vgi_learning *l, vg_rig *r);

#endif
