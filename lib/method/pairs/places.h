/* places.h: where the vertices of a target lie on a source that was fitted to it.
 * Internal. Faces are paired in pair.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PLACES_H
#define VG_PLACES_H

#include "vg/frames.h"

/* A point of a face: the vertex a of a corner + u0 (b - a) + u1 (c - a), as in vgi_hit. */
typedef struct vgi_place {
    uint32_t face, corner; /* face UINT32_MAX: the vertex has no place */
    double u[2];
} vgi_place;

/* vgi_places_find: the nearest point of the fitted source, among faces that drive something and have a similar normal,
 * for each vertex of the target. */
int vgi_places_find(vgi_place *places, const vg_mesh *source, const double *fitted, const vg_correspondence *pairs,
                    const vg_mesh *target, const double *points, int threads, vg_err *e) VG_MUST_CHECK;

/* vgi_place_point: the point in a pose of the source. */
void vgi_place_point(const vg_mesh *source, const vgi_place *p, const double *pose, double at[3]);

/* vgi_places_share: how much each source vertex counts in the centroid of what drives the target (nv of the source, their
 * sum is 1): each vertex of the target's faces has its place, or without one the centroid of a source face that drives it.
 * places NULL: none has. */
int vgi_places_share(const vgi_place *places, const vg_mesh *source, const vg_correspondence *pairs,
                     const vg_mesh *target, double *share, vg_err *e) VG_MUST_CHECK;

/* vgi_places_size: the size of the target relative to what drives it: the root of the ratio of the mean squared distances of
 * paired faces from their centroids; 1 if there is none. */
double vgi_places_size(const vg_mesh *source, const double *reference, const vg_correspondence *pairs,
                       const vg_mesh *target, const double *points);

#endif
