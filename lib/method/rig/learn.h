/* learn.h: the data of alternate fitting of weights and motions: all vertices of a mesh, or an evenly strided
 * subset. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_LEARN_H
#define VG_LEARN_H

#include "method/rig/rig_sums.h"

typedef struct vgi_learning {
    vg_rig rig;           /* owns its skin, borrows the rest */
    size_t nv, n;         /* number of vertices, of poses */
    double *reference;    /* nv points */
    double **poses;       /* n times nv points */
    double **transforms;  /* n times 7 per bone; borrowed */
    double *at;           /* 3 per bone; borrowed */
    double *left;         /* nv: root mean square error of skinning */
    int threads;
    vgi_rig_sums sums;    /* kept from round to round */
} vgi_learning;

/* vgi_learning_gather: take at most `most` vertices of the reference and the poses, evenly strided. */
int vgi_learning_gather(vgi_learning *l, size_t nv, const double *reference, size_t n, const double *const *poses,
                        size_t most, vg_err *e) VG_MUST_CHECK;
/* vgi_learning_clear: free what gather allocated, and the skin. */
void vgi_learning_clear(vgi_learning *l);
/* vgi_learning_weights: fit the skin to the current motions. miss: mean of `left`. */
int vgi_learning_weights(vgi_learning *l, double *miss, vg_err *e) VG_MUST_CHECK;
/* vgi_learning_alternate: call motions(l, context, begun, e) and fit weights alternately, until a round lowers `miss`
 * by less than 0.4 %. begun: the transforms hold initial motions. */
int vgi_learning_alternate(vgi_learning *l, int (*motions)(vgi_learning *, void *, bool, vg_err *), void *context,
                           bool begun, double *miss, vg_err *e) VG_MUST_CHECK;
/* vgi_learning_keep: move the skin to rig r. */
void vgi_learning_keep(vgi_learning *l, vg_rig *r);

#endif
