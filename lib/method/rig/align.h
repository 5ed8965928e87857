/* align.h: two skeletons at rest, and the turns that make the limbs of one point as those of the other do.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RIG_ALIGN_H
#define VG_RIG_ALIGN_H

#include "method/rig/joint_roles.h"

typedef struct vgi_rests {
    const vg_skeleton *of, *by; /* borrowed, as `from` is */
    const uint32_t *from;       /* of each joint of `of`: that of `by`; UINT32_MAX: none */
    vgi_role *roles, *their_roles;
    double *rest, *theirs; /* positions of joints, without rotations: 3 numbers each */
} vgi_rests;

int vgi_rests_new(vgi_rests *x, const vg_skeleton *of, const vg_skeleton *by, const uint32_t *from,
                  vg_err *e) VG_MUST_CHECK;
void vgi_rests_clear(vgi_rests *x);
/* vgi_align: before: of each joint of `of` the turn, 4 numbers, that makes it point as its partner does at rest.
 * degrees: by how much it was turned for its own sake; 0: it was not. chosen: for VG_ALIGN_CHOSEN. */
int vgi_align(const vgi_rests *x, vg_align align, const bool *chosen, double *before, double *degrees,
              vg_err *e) VG_MUST_CHECK;
/* vgi_leg_length: thigh and shin, the mean of the legs; 0: it has none. positions: of its joints. */
double vgi_leg_length(const vg_skeleton *s, const vgi_role *roles, const double *positions);
/* vgi_find_role: the first joint of this part and side, UINT32_MAX: none. */
uint32_t vgi_find_role(const vg_skeleton *s, const vgi_role *roles, vgi_part part, int side);
void vgi_between(const double *positions, size_t a, size_t b, double d[3]); /* from point a to point b */

#endif
