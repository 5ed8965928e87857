/* driving.h: pairs the joints of a skeleton with those of a rig, and aligns their rest poses, for vg-play and vg-deform.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_DRIVING_H
#define VG_DRIVING_H

#include "cli.h"

typedef struct driving_options {
    const char *align;  /* "auto", "none", "all", or names of bones with commas; NULL: auto */
    const char *joints; /* a file of pairs of joints; NULL: by their names */
} driving_options;

/* A skeleton that drives a rig. Lives until the program ends. */
typedef struct driving {
    vg_skeleton by;
    vg_joint_fitter *fitter; /* for frames that do not say how joints have turned */
    vg_driver *driver;       /* NULL: not started */
    const vg_rig *rig;       /* borrowed, as is `name` */
    const char *name;
    bool begun;              /* a frame has been taken */
} driving;

/* driving_start: drive a rig (borrowed) by a skeleton (copied); warns of bones without a partner. Messages call the rig `name`
 * (borrowed). */
void driving_start(driving *d, const driving_options *o, const vg_rig *rig, const char *name, const vg_skeleton *by);
/* driving_take: the rotations of the joints in the next frame of the motion, as driving_turns. At the first one it finds which
 * axis is up, and warns of this and of the limbs that are aligned. */
const double *driving_take(driving *d, const vg_frame *f);
/* driving_turns: the rotations of the joints in a frame: those it has, or fitted to the positions. Borrowed until the next
 * call. */
const double *driving_turns(vg_joint_fitter *fitter, const vg_frame *f);

#endif
