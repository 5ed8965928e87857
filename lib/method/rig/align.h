/* align.h: rotations that give the limbs of one resting skeleton the directions of another's.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RIG_ALIGN_H
#define VG_RIG_ALIGN_H

#include "method/rig/joint_roles.h"

typedef struct vgi_rests {
    const vg_skeleton *of, *by; /* both borrowed, as is `from` */
    const uint32_t *from;       /* per joint of `of`: the matching joint of `by`, or UINT32_MAX */
    vgi_role *roles, *their_roles;
    bool guessed[2];       /* whether roles of `of` and of `by` come from the shape */
    double *rest, *theirs; /* joint positions without rotations, 3 numbers each */
} vgi_rests;

/* How one skeleton stands and faces, relative to another one: along which axes. An axis is 1, 2, 3 of x, y, z, or the negative;
 * 0: not known. */
typedef struct vgi_stance {
    double world[4];     /* turns the axis that is up in the motion of `by` into the one that is up for the rig */
    double rest[4];      /* turns the rest pose of `by`, so that it stands and faces as that of `of` */
    int ours;            /* the axis that is up for the rig in its reference pose */
    int theirs;          /* the axis that is up for `by` at rest */
    int moves;           /* the axis that is up in the motion of `by`; as at rest until vgi_stance_look knows better */
    bool stands, faces;  /* whether `by` rests with another axis up than `of`, and facing another way */
    uint32_t top, hips[2], below[2]; /* joints of `by`: the head, thighs and feet, or UINT32_MAX */
    double leg; /* length of a leg of `by` */
} vgi_stance;

int vgi_rests_new(vgi_rests *x, const vg_skeleton *of, const vg_skeleton *by, const uint32_t *from,
                  vg_err *e) VG_MUST_CHECK;
void vgi_rests_clear(vgi_rests *x);
/* vgi_rests_stand: by the directions from hips to head and from right to left, where both skeletons have them. Turns x->theirs
 * by stance->rest. at: the joints of `of` in the reference pose of the rig. */
void vgi_rests_stand(vgi_rests *x, const double *at, vgi_stance *stance);
/* vgi_stance_look: which axis is up in a motion, from its first pose: that of the rest pose, unless the root has turned it. */
void vgi_stance_look(vgi_stance *stance, const double *positions);
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
