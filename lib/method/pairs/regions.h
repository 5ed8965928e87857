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
/* vgi_regions_spread: the share of the surface that is turned against it by more than some degrees, of eight poses. */
const double *vgi_regions_spread(const vgi_regions *r);
/* vgi_regions_limbs: how far a pose is no sum of shapes because limbs turn, from 0 to 1, of eight poses. */
const double *vgi_regions_limbs(const vgi_regions *r);
/* vgi_regions_around: the mean map of the surface around face f. */
void vgi_regions_around(const vgi_regions *r, size_t f, vgi_map *mean);

/* vgi_regions_turn: the rotation of what another mesh differs by at face f, whose map is `map`, in a sum of shapes: that of
 * the whole, what the neighbourhood turns far, and what the face turns far beyond that. bad: lanes without a map, all if
 * map is NULL. `turn` may be `map`. */
void vgi_regions_turn(const vgi_regions *r, size_t f, const vgi_map *map, unsigned bad, vgi_map *turn);

#endif
