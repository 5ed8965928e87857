/* joint_transfer.h: puts the motion of one skeleton onto another one, for vg-deform.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_JOINT_TRANSFER_H
#define VG_JOINT_TRANSFER_H

#include "driving.h"

typedef struct joint_transfer joint_transfer;

/* joint_transfer_new: from the skeleton of a sequence (copied) to that of the target (copied), which messages call
 * `name`. stay: the mean of the target's joints stays where it is at rest. */
joint_transfer *joint_transfer_new(const driving_options *o, const vg_skeleton *from, const vg_body *target, const char *name,
                                   bool stay);
/* joint_transfer_apply: the joints' positions and turns in `in` become positions and turns of the target's joints. */
void joint_transfer_apply(joint_transfer *t, const vg_frame *in, vg_frame *out);

#endif
