/* rig_choice.h: --method auto of vg-fitmap: mix envelope and skinning, vertex by vertex, by held-out poses.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RIG_CHOICE_H
#define VG_RIG_CHOICE_H

#include "fitting.h"

typedef struct rig_choice {
    size_t bones_per_corner; /* of the envelope */
    double refine;
    double *share;           /* nv: of the envelope, in [0, 1]; the rest is skinning */
    double mean;             /* of the shares */
    size_t folds;
} rig_choice;

/* rig_choose: divide the fitted poses of f into blocks and leave each block out of a fit once, by skinning and by envelopes
 * with several ridges and numbers of bones per corner; choose those of least error in the blocks left out.
 * transforms: of all poses. A refine or bones_per_corner that the user gave is kept. */
void rig_choose(const fitting *f, double *const *transforms, const vg_rig_options *o, bool corners_given,
                bool refine_given, rig_choice *choice);

#endif
