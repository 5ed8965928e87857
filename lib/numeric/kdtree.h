/* kdtree.h: nearest points among many, and the nearest that belongs to another.
 * Internal. Leaves out surfaces: who wants the nearest point of a face puts in points of faces and looks around them.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_KDTREE_H
#define VG_KDTREE_H

#include "core/core.h"

typedef struct vgi_kdtree vgi_kdtree;

/* A point that was found: its index and its squared distance. Of two at the same distance the lower index is nearer,
 * so that an answer never depends on the shape of the tree. */
typedef struct vgi_near {
    uint32_t index;
    double square;
} vgi_near;

/* vgi_kdtree_new: of n < 2^32 - 1 points (n x 3, finite; copied). All labels are 0. Nothing is scaled: squares of
 * distances above 1e150 or below 1e-150 overflow or vanish. O(n log n) time, at most 57 bytes a point. */
int vgi_kdtree_new(vgi_kdtree **t, const double *points, size_t n, vg_err *e) VG_MUST_CHECK;
void vgi_kdtree_free(vgi_kdtree **t);

/* vgi_kdtree_label: give point i label[i] (n of them, copied, each < 2^32 - 1). O(n). */
void vgi_kdtree_label(vgi_kdtree *t, const uint32_t *label);

/* vgi_kdtree_nearest: the k nearest points to p within the squared distance `limit` (INFINITY for no limit), nearest
 * first, into near[0..k-1]. Returns how many there are. About O(k + log n) for spread points. */
size_t vgi_kdtree_nearest(const vgi_kdtree *t, const double p[3], double limit, size_t k, vgi_near *near);

/* vgi_kdtree_nearest_other: the nearest point to p whose label is not `label`, within the squared distance `limit`;
 * false when there is none. Whole subtrees of that label are passed over. */
bool vgi_kdtree_nearest_other(const vgi_kdtree *t, const double p[3], uint32_t label, double limit, vgi_near *near);

#endif
