/* joint_transfer.c: the motion of one skeleton onto another one. The library pairs the joints, aligns the limbs, and poses
 * the target; here its pose becomes a frame of vertices.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "joint_transfer.h"

#include <stdlib.h>
#include <string.h>

struct joint_transfer {
    vg_skeleton from;
    vg_joint_fitter *fitter; /* for frames that do not say how joints have turned */
    vg_rig to;               /* the target's joints, without weights */
    vg_driver *driver;
    bool stay;
};

/* The target's joints at rest. */
static void make_rig(vg_rig *rig, const vg_body *target)
{
    vg_err e;
    size_t n = target->skeleton.njoints;
    double *turns = cli_allocate(4 * n, sizeof *turns, "the joints");
    for (size_t j = 0; j < n; j++) turns[4 * j] = 1;
    if (vg_rig_make(rig, &target->skeleton, target->reference, turns, &e) < 0) cli_die(&e);
    free(turns);
}

joint_transfer *joint_transfer_new(const driving_options *o, const vg_skeleton *from, const vg_body *target, const char *name,
                                   bool stay)
{
    vg_err e;
    joint_transfer *t = cli_allocate(1, sizeof *t, "the joints");
    t->stay = stay;
    if (vg_skeleton_copy(&t->from, from, &e) < 0 || vg_joint_fitter_new(&t->fitter, &t->from, &e) < 0) cli_die(&e);
    make_rig(&t->to, target);
    t->driver = driving_start(o, &t->to, name, &t->from);
    return t;
}

/* Move the mean of the joints back to where it is at rest. */
static void put_back(size_t n, const double *rest, double *positions)
{
    for (size_t k = 0; k < 3; k++) {
        double shift = 0;
        for (size_t j = 0; j < n; j++) shift += (rest[3 * j + k] - positions[3 * j + k]) / (double)n;
        for (size_t j = 0; j < n; j++) positions[3 * j + k] += shift;
    }
}

void joint_transfer_apply(joint_transfer *t, const vg_frame *in, vg_frame *out)
{
    vg_err e;
    size_t known, joint, n = t->to.skeleton.njoints;
    const double *turns = vg_frame_turns(in, &known), *positions;
    if (!known) {
        vg_joint_fitter_fit(t->fitter, in->values, NULL, NULL, &joint);
        turns = vg_joint_fitter_turns(t->fitter);
    }
    vg_driver_joints(t->driver, in->values, turns, &positions, &turns);
    memcpy(out->values, positions, 3 * n * sizeof *positions);
    if (t->stay) put_back(n, t->to.at, out->values);
    if (vg_frame_turn(out, turns, n, &e) < 0) cli_die(&e);
}
