/* joint_transfer.c: the motion of one skeleton onto another one. The library pairs the joints, aligns the limbs, and poses
 * the target; here its pose becomes a frame of vertices.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "joint_transfer.h"

#include <stdlib.h>
#include <string.h>

struct joint_transfer {
    driving driving;
    vg_rig to; /* the target's joints, without weights */
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
    joint_transfer *t = cli_allocate(1, sizeof *t, "the joints");
    t->stay = stay;
    make_rig(&t->to, target);
    driving_start(&t->driving, o, &t->to, name, from);
    return t;
}

/* Move the mean of the joints back to where it is at rest. */
static void put_back(size_t n, const double *rest, double *positions)
{
    double home[3], now[3];
    vg_centroid(rest, n, home);
    vg_centroid(positions, n, now);
    for (size_t i = 0; i < 3 * n; i++) positions[i] += home[i % 3] - now[i % 3];
}

void joint_transfer_apply(joint_transfer *t, const vg_frame *in, vg_frame *out)
{
    vg_err e;
    size_t n = t->to.skeleton.njoints;
    const double *positions, *turns = driving_take(&t->driving, in);
    vg_driver_joints(t->driving.driver, in->values, turns, &positions, &turns);
    memcpy(out->values, positions, 3 * n * sizeof *positions);
    if (t->stay) put_back(n, t->to.at, out->values);
    if (vg_frame_turn(out, turns, n, &e) < 0) cli_die(&e);
}
