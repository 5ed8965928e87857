/* align.h: rotations that give the limbs of one resting skeleton the directions of another's.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RIG_ALIGN_H
#define VG_RIG_ALIGN_H

#include "method/rig/joint_roles.h"

typedef struct vgi_rests {
    const vg_skeleton *of, *by; /* both borrowed, as is `from` */
    const uint32_t *from;       /* per joint of `of`: the matching joint of `by`, or UINT32_MAX */
    vgi_role *roles, *their_roles;
    double *rest, *theirs; /* joint positions without rotations, 3 numbers each */
} vgi_rests;

/* How one skeleton stands and faces at rest, relative to another one: along which axes. */
typedef struct vgi_stance {
    double world[4]; /* turns the axis that is up for `by` into the one that is up for `of` */
    double rest[4];  /* turns its rest pose, so that it stands and faces alike */
    int up;          /* 0, or, if it is another one, the axis that is up for `by`: 1, 2, 3 of x, y, z, or the negative */
    bool faces;      /* whether it faces another way */
} vgi_stance;

int vgi_rests_new(vgi_rests *x, const vg_skeleton *of, const vg_skeleton *by, const uint32_t *from,
                  vg_err *e) VG_MUST_CHECK;
void vgi_rests_clear(vgi_rests *x);
/* vgi_rests_stand: by the directions from hips to head and from right to left, where both skeletons have them. Turns x->theirs
 * by stance->rest. */
void vgi_rests_stand(vgi_rests *x, vgi_stance *stance);
/* vgi_align: before: per joint of `of` the rotation (4 numbers) that gives it the direction of its partner at rest.
 * degrees: the angle by which the joint itself was aligned; 0 if it was not. chosen: for VG_ALIGN_CHOSEN. */
int vgi_align(const vgi_rests *x, vg_align align, const bool *chosen, double *before, double *degrees,
              vg_err *e) VG_MUST_CHECK;
/* vgi_leg_length: length of thigh and shin, mean of the legs; 0 without legs. positions: of the joints. */
double vgi_leg_length(const vg_skeleton *s, const vgi_role *roles, const double *positions);
/* vgi_find_role: the first joint with this part and side, or UINT32_MAX. */
uint32_t vgi_find_role(const vg_skeleton *s, const vgi_role *roles, vgi_part part, int side);
void vgi_between(const double *positions, size_t a, size_t b, double d[3]); /* from point a to point b */

#endif
