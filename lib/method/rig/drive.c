/* drive.c: a rig driven by another skeleton.
 * Joints are paired in pair_joints.c, rest poses aligned in align.c; map_eval.c evaluates the rig's transforms.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/align.h"
#include "model/rig.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

static const uint32_t NONE = UINT32_MAX;

struct vg_driver {
    const vg_rig *r;
    const vg_skeleton *by;
    uint32_t *from;  /* per joint of the rig: the paired joint, or UINT32_MAX */
    bool *carried;   /* per joint of the rig: paired, with no paired joint above it */
    uint32_t *lead; /* per joint of the rig without a paired joint at or above it: the first carried joint below it */
    double *before;  /* per joint of the rig: a rotation applied before the other's, 4 numbers */
    double *degrees; /* per joint of the rig: the angle of alignment */
    vgi_stance stance;
    double scale;
    size_t missing;
    bool *lacks; /* per joint of the rig: no joint of the skeleton drives this part of the body */
    bool guessed;
    double *positions, *turns; /* of the joints of the rig */
};

/* Ratio of the sizes, rig to skeleton: by leg length, because legs carry the body; without legs, by all paired
 * bones. */
static double compare_sizes(const vg_driver *d, const vgi_rests *x)
{
    double legs[2] = {vgi_leg_length(x->of, x->roles, x->rest), vgi_leg_length(x->by, x->their_roles, x->theirs)};
    double sum[2] = {0, 0};
    if (legs[0] > 0 && legs[1] > 0) return legs[0] / legs[1];
    for (size_t j = 0; j < x->of->njoints; j++) {
        uint32_t p = x->of->joints[j].parent;
        if (p == NONE || d->from[j] == NONE || d->from[p] == NONE) continue;
        double a[3], b[3];
        vgi_between(x->rest, p, j, a);
        vgi_between(x->theirs, d->from[p], d->from[j], b);
        if (vgi_length(b) > 0) sum[0] += vgi_length(a), sum[1] += vgi_length(b);
    }
    return sum[0] > 0 && sum[1] > 0 ? sum[0] / sum[1] : 1;
}

/* Parts of the body whose motion is missed, unlike that of fingers and of more joints in the spine. */
static bool is_main_part(vgi_role r)
{
    return vgi_role_is_limb(r) || r.part == VGI_HIPS || r.part == VGI_HEAD || r.part == VGI_HAND ||
           r.part == VGI_FOOT;
}

static void find_lacks(vg_driver *d, const vgi_role *roles)
{
    for (size_t j = 0; j < d->r->skeleton.njoints; j++) {
        d->lacks[j] = d->from[j] == NONE && d->r->skeleton.joints[j].nchannels && is_main_part(roles[j]);
        for (size_t k = 0; d->lacks[j] && k < d->r->skeleton.njoints; k++)
            if (d->from[k] != NONE && roles[k].part == roles[j].part && roles[k].side == roles[j].side)
                d->lacks[j] = false;
    }
}

static int compare_rests(vg_driver *d, const vg_driver_options *o, vg_err *e)
{
    vgi_rests x = {0};
    int r = vgi_rests_new(&x, &d->r->skeleton, d->by, d->from, e);
    if (r == VG_OK) {
        d->scale = compare_sizes(d, &x);
        find_lacks(d, x.roles);
        d->guessed = !o->partner && (x.guessed[0] || x.guessed[1]);
        d->stance = (vgi_stance){.world = {1, 0, 0, 0}, .rest = {1, 0, 0, 0}};
        if (o->align != VG_ALIGN_NONE) vgi_rests_stand(&x, d->r->at, &d->stance);
        r = vgi_align(&x, o->align, o->chosen, d->before, d->degrees, e);
    }
    vgi_rests_clear(&x);
    for (size_t j = 0; r == VG_OK && j < d->r->skeleton.njoints; j++) { /* first back to how the other one rests */
        const double *q = d->stance.rest, back[4] = {q[0], -q[1], -q[2], -q[3]};
        vg_quat_multiply(back, d->before + 4 * j, d->before + 4 * j);
    }
    return r;
}

/* A root that the skeleton does not have, such as the one of Biped above the pelvis, moves with the joint below it. */
static void find_leads(vg_driver *d)
{
    const vg_skeleton *s = &d->r->skeleton;
    for (size_t j = 0; j < s->njoints; j++) d->lead[j] = NONE;
    for (size_t j = 0; j < s->njoints; j++) {
        uint32_t above = d->carried[j] ? s->joints[j].parent : NONE;
        for (; above != NONE && d->lead[above] == NONE; above = s->joints[above].parent) d->lead[above] = (uint32_t)j;
    }
}

static int pair_joints(vg_driver *d, const uint32_t *partner, vg_err *e)
{
    const vg_skeleton *s = &d->r->skeleton;
    size_t found = 0;
    if (partner) memcpy(d->from, partner, s->njoints * sizeof *d->from);
    else if (vg_skeleton_pair(s, d->by, d->from, e) < 0) return VG_ENOMEM;
    for (size_t j = 0; j < s->njoints; j++) {
        uint32_t above = s->joints[j].parent;
        while (above != NONE && d->from[above] == NONE) above = s->joints[above].parent;
        d->carried[j] = d->from[j] != NONE && above == NONE;
        if (s->joints[j].nchannels) *(d->from[j] != NONE ? &found : &d->missing) += 1;
    }
    find_leads(d);
    if (found) return VG_OK;
    return vg_fail(e, VG_EINPUT,
                   "no joint of the skeleton has the name of a bone of the rig, such as '%.80s', or a usual name for "
                   "the same part "
                   "of the body, and its shape does not tell its arms, legs and toes: --joints pairs them by a file",
                   s->joints[d->r->bone[0]].name);
}

int vg_driver_new(vg_driver **out, const vg_rig *g, const vg_skeleton *by, const vg_driver_options *o, vg_err *e)
{
    size_t n = g->skeleton.njoints;
    vg_driver *d = *out = vgi_array(1, sizeof *d, e);
    if (!d) return VG_ENOMEM;
    d->r = g, d->by = by;
    d->from = vgi_array(n, sizeof *d->from, e), d->before = vgi_array(4 * n, sizeof *d->before, e);
    d->carried = vgi_array(n, sizeof *d->carried, e), d->lead = vgi_array(n, sizeof *d->lead, e);
    d->lacks = vgi_array(n, sizeof *d->lacks, e);
    d->degrees = vgi_array(n, sizeof *d->degrees, e), d->positions = vgi_array(3 * n, sizeof *d->positions, e);
    d->turns = vgi_array(4 * n, sizeof *d->turns, e);
    bool all = d->from && d->before && d->carried && d->lead && d->lacks && d->degrees && d->positions && d->turns;
    int r = all ? pair_joints(d, o->partner, e) : VG_ENOMEM;
    if (r == VG_OK) r = compare_rests(d, o, e);
    if (r < 0) vg_driver_free(out);
    return r;
}

void vg_driver_free(vg_driver **out)
{
    vg_driver *d = *out;
    if (!d) return;
    free(d->from);
    free(d->carried);
    free(d->lead);
    free(d->lacks);
    free(d->before);
    free(d->degrees);
    free(d->positions);
    free(d->turns);
    free(d);
    *out = NULL;
}

size_t vg_driver_missing(const vg_driver *d)
{
    return d->missing;
}

bool vg_driver_lacks(const vg_driver *d, size_t joint)
{
    return d->lacks[joint];
}

bool vg_driver_guessed(const vg_driver *d)
{
    return d->guessed;
}

double vg_driver_aligned(const vg_driver *d, size_t joint)
{
    return d->degrees[joint];
}

void vg_driver_look(vg_driver *d, const double *positions)
{
    vgi_stance_look(&d->stance, positions);
}

void vg_driver_stands(const vg_driver *d, vg_stance *to)
{
    const vgi_stance *s = &d->stance;
    *to = (vg_stance){s->stands ? s->theirs : 0, s->moves != s->ours ? s->moves : 0, s->faces};
}

/* Offset of the other's joint k from the end of its bone, as position channels cause it. */
static void read_slip(const vg_driver *d, size_t k, const double *positions, const double *turns, double slip[3])
{
    uint32_t parent = d->by->joints[k].parent;
    double at[3] = {0, 0, 0};
    if (parent == NONE) return;
    vg_quat_apply(turns + 4 * (size_t)parent, d->by->joints[k].offset, at);
    vgi_subtract(positions + 3 * k, at, slip), vgi_deduct(slip, positions + 3 * (size_t)parent);
    vg_quat_apply(d->stance.world, slip, slip);
}

static void turn_joint(vg_driver *d, size_t j, const double *turns)
{
    uint32_t from = d->from[j], parent = d->r->skeleton.joints[j].parent;
    double *q = d->turns + 4 * j;
    if (from != NONE) {
        vg_quat_multiply(d->stance.world, turns + 4 * (size_t)from, q);
        vg_quat_multiply(q, d->before + 4 * j, q);
    } else if (parent != NONE) memcpy(q, d->turns + 4 * (size_t)parent, 4 * sizeof *q);
    else memcpy(q, (const double[4]){1, 0, 0, 0}, 4 * sizeof *q);
}

/* A joint with no paired joint above it takes the other joint's position, scaled to the rig's size. */
static void place_joint(vg_driver *d, size_t j, const double *positions, const double *turns)
{
    const vg_joint *joint = &d->r->skeleton.joints[j];
    double *p = d->positions + 3 * j, slip[3] = {0, 0, 0};
    uint32_t from = d->from[j];
    if (d->carried[j]) {
        vg_quat_apply(d->stance.world, positions + 3 * (size_t)from, p);
        vgi_scale(p, d->scale);
        return;
    }
    if (joint->parent == NONE) {
        memcpy(p, d->r->at + 3 * j, 3 * sizeof *p);
        return;
    }
    if (from != NONE) read_slip(d, from, positions, turns, slip);
    vg_quat_apply(d->turns + 4 * (size_t)joint->parent, joint->offset, p);
    for (size_t i = 0; i < 3; i++) p[i] += d->positions[3 * (size_t)joint->parent + i] + d->scale * slip[i];
}

/* Joint j as if it were rigid with the joint that it follows, as both are in the reference pose. */
static void follow_lead(vg_driver *d, size_t j, const double *positions, const double *turns)
{
    size_t lead = d->lead[j];
    const double *at = d->r->turn + 4 * lead, back[4] = {at[0], -at[1], -at[2], -at[3]};
    double way[3], turn[4], *p = d->positions + 3 * j;
    turn_joint(d, lead, turns);
    place_joint(d, lead, positions, turns);
    vg_quat_multiply(d->turns + 4 * lead, back, turn);
    vg_quat_multiply(turn, d->r->turn + 4 * j, d->turns + 4 * j);
    vgi_between(d->r->at, lead, j, way);
    vg_quat_apply(turn, way, p);
    vgi_add(p, d->positions + 3 * lead);
}

void vg_driver_joints(vg_driver *d, const double *positions, const double *turns, const double **own_positions,
                      const double **own_turns)
{
    for (size_t j = 0; j < d->r->skeleton.njoints; j++) {
        if (d->lead[j] != NONE) {
            follow_lead(d, j, positions, turns);
            continue;
        }
        turn_joint(d, j, turns);
        place_joint(d, j, positions, turns);
    }
    *own_positions = d->positions, *own_turns = d->turns;
}

void vg_driver_pose(vg_driver *d, const double *positions, const double *turns, double *transforms)
{
    const double *own_positions, *own_turns;
    vg_driver_joints(d, positions, turns, &own_positions, &own_turns);
    vg_rig_transforms(d->r, own_positions, own_turns, transforms);
}
