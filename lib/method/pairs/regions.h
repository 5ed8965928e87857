/* regions.h: how parts of a mesh turn in a pose: the whole, and the neighbourhood of each face.
 * Internal. Maps of single faces come from transfer_kernel.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_REGIONS_H
#define VG_REGIONS_H

#include "method/pairs/transfer_kernel.h"

typedef struct vgi_regions vgi_regions;

/* vgi_regions_new: the mesh is borrowed for this call only. O(faces), times the number of cells that overlap. */
int vgi_regions_new(vgi_regions **r, const vg_mesh *m, const double *reference, vg_err *e) VG_MUST_CHECK;
void vgi_regions_free(vgi_regions **r);

/* vgi_regions_measure: from the maps of all faces in eight poses; bad: lanes in which a face has none. */
void vgi_regions_measure(vgi_regions *r, const vgi_map *maps, const unsigned char *bad, int threads);
/* vgi_regions_whole: the rotation of most of the mesh: the median of its parts' rotations. */
const vgi_map *vgi_regions_whole(const vgi_regions *r);
/* vgi_regions_spread: how far the parts are turned from it, in degrees: the mean by area, of eight poses. */
const double *vgi_regions_spread(const vgi_regions *r);
/* vgi_regions_around: the mean map of the surface around face f. */
void vgi_regions_around(const vgi_regions *r, size_t f, vgi_map *mean);

#endif
