/* network.h: the layers of a network, and the meaning of its numbers. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_NETWORK_H
#define VG_NETWORK_H

#include "net/shape.h"

/* vgi_network_roots: numbers of a root step: turn and shift of the largest component, shifts of the others. */
static inline size_t vgi_network_roots(const vg_network *n)
{
    return 6 + 3 * (n->parts - 1);
}
/* vgi_network_shape: the shape of its layers; the caller sets the neighbours. VG_EINPUT if it has a different number
 * of parameters. */
int vgi_network_shape(const vg_network *n, vgi_shape *s, vg_err *e) VG_MUST_CHECK;
static inline bool vgi_network_is_linear(const vg_network *n)
{
    return n->model == VG_NETWORK_AUTO || n->model == VG_NETWORK_PCA;
}

/* Convert features of vg_featurer to the numbers that are learned (nv * width), and back. */
void vgi_network_normalise(const vg_network *n, const double *features, double *x);
void vgi_network_features(const vg_network *n, const double *x, double *features);
/* Convert those numbers to rank coordinates, and back. */
void vgi_network_encode(const vg_network *n, const double *x, double *c);
void vgi_network_decode(const vg_network *n, const double *c, double *x);
/* vgi_network_span: the diagonal of the bounding box of the training coordinates. */
double vgi_network_span(const vg_network *n);

#endif
