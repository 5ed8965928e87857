/* limbs.h: how parts of a mesh turn in a pose: the whole, and the neighbourhood of each face.
 * Internal. Maps of single faces come from transfer_kernel.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_LIMBS_H
#define VG_LIMBS_H

#include "method/pairs/transfer_kernel.h"

typedef struct vgi_limbs vgi_limbs;

/* vgi_limbs_new: the mesh is borrowed for this call only. O(faces), times the number of cells that overlap. */
int vgi_limbs_new(vgi_limbs **r, const vg_mesh *m, const double *reference, vg_err *e) VG_MUST_CHECK;
void vgi_limbs_free(vgi_limbs **r);

/* vgi_limbs_measure: from the maps of all faces in eight poses; bad: lanes in which a face has none. */
void vgi_limbs_measure(vgi_limbs *r, const vgi_map *maps, const unsigned char *bad, int threads);
/* vgi_limbs_whole: the rotation of most of the mesh: the median of its parts' rotations. */
const vgi_map *vgi_limbs_whole(const vgi_limbs *r);
/* vgi_limbs_spread: the share of the surface that is turned against it by more than some degrees, of eight poses. */
const double *vgi_limbs_spread(const vgi_limbs *r);
/* vgi_limbs_share: how far a pose is no sum of shapes because limbs turn, from 0 to 1, of eight poses. */
const double *vgi_limbs_share(const vgi_limbs *r);
/* vgi_limbs_around: the mean map of the surface around face f. */
void vgi_limbs_around(const vgi_limbs *r, size_t f, vgi_map *mean);

/* vgi_limbs_turn: the rotation of what another mesh differs by at face f, whose map is `map`, in a sum of shapes: that of
 * the whole, what the neighbourhood turns far, and what the face turns far beyond that. bad: lanes without a map, all if
 * map is NULL. `turn` may be `map`. */
void vgi_limbs_turn(const vgi_limbs *r, size_t f, const vgi_map *map, unsigned bad, vgi_map *turn);

#endif
