/* root.h: motion of the whole body: steps of the root and of the components, predicted from the pose (MATH 12).
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_NET_ROOT_H
#define VG_NET_ROOT_H

#include "net/dataset.h"

/* vgi_root_fit: n->root: ridge regression of the steps of all training frames on their coordinates and the change of
 * those. */
int vgi_root_fit(const vgi_dataset *s, vg_network *n, vg_err *e) VG_MUST_CHECK;
/* vgi_root_predict: numbers of the step between two frames, from coordinates c and those before: turn (3), shift in the root's
 * frame (3, in D), and the position of each other component relative to the largest at the end of the step (3 each, in D). */
void vgi_root_predict(const vg_network *n, const double *c, const double *before, double *steps);
/* vgi_root_move: advance root and centroids by the steps. */
void vgi_root_move(const vg_network *n, size_t main_part, const double *steps, double root[4], double *centroids);

#endif
