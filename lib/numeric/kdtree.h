/* kdtree.h: the nearest of many points, and the nearest with another label. Internal. For the nearest point of a
 * surface, insert points of faces and search around them.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_KDTREE_H
#define VG_KDTREE_H

#include "core/core.h"

typedef struct vgi_kdtree vgi_kdtree;

/* A found point: its index and squared distance. At equal distance the lower index is nearer, so that the result does
 * not depend on the shape of the tree. */
typedef struct vgi_near {
    uint32_t index;
    double square;
} vgi_near;

/* vgi_kdtree_new: a tree of n < 2^32 - 1 points (n x 3, finite; copied). All labels are 0. Coordinates are not
 * scaled: squared distances above 1e300 or below 1e-300 overflow or vanish. O(n log n) time, at most 57 bytes per
 * point. */
int vgi_kdtree_new(vgi_kdtree **t, const double *points, size_t n, vg_err *e) VG_MUST_CHECK;
void vgi_kdtree_free(vgi_kdtree **t);

/* vgi_kdtree_label: set the label of every point (n labels, copied, each < 2^32 - 1). O(n). */
void vgi_kdtree_label(vgi_kdtree *t, const uint32_t *label);

/* vgi_kdtree_nearest: the k points nearest to p within the squared distance `limit` (INFINITY: no limit), nearest
 * first, into near[0..k-1]. Returns the number found. About O(k + log n) for spread-out points. */
size_t vgi_kdtree_nearest(const vgi_kdtree *t, const double p[3], double limit, size_t k, vgi_near *near);

/* vgi_kdtree_nearest_other: the point nearest to p whose label is not `label`, within the squared distance
 * `limit`; false if there is none. Subtrees with that label are skipped. */
bool vgi_kdtree_nearest_other(const vgi_kdtree *t, const double p[3], uint32_t label, double limit, vgi_near *near);

#endif
