/* rig.c: a skeleton in the reference pose of a mesh; motions as transforms and their editing; linear blend skinning.
 * Weights and transforms are fitted in method/rig/skin.c and inverse_skin.c; other skeletons are in drive.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/rig.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

int vg_rig_make(vg_rig *r, const vg_skeleton *s, const double *positions, const double *turns, vg_err *e)
{
    *r = (vg_rig){0};
    size_t bones = 0;
    for (size_t j = 0; j < s->njoints; j++) bones += s->joints[j].nchannels > 0;
    if (!bones) return vg_fail(e, VG_EINPUT, "the skeleton has no joint that rotates");
    r->at = vgi_copy_array(positions, 3 * s->njoints, sizeof *r->at, e);
    r->turn = vgi_copy_array(turns, 4 * s->njoints, sizeof *r->turn, e);
    r->bone = vgi_array_raw(bones, sizeof *r->bone, e);
    if (!r->at || !r->turn || !r->bone || vg_skeleton_copy(&r->skeleton, s, e) < 0) {
        vg_rig_clear(r);
        return VG_ENOMEM;
    }
    for (size_t j = 0; j < s->njoints; j++)
        if (s->joints[j].nchannels > 0) r->bone[r->nbones++] = (uint32_t)j;
    return VG_OK;
}

void vgi_rig_movers(const vg_rig *r, uint32_t *mover)
{
    size_t b = 0;
    for (size_t j = 0; j < r->skeleton.njoints; j++) {
        uint32_t parent = r->skeleton.joints[j].parent;
        if (b < r->nbones && r->bone[b] == j) mover[j] = (uint32_t)b++;
        else mover[j] = parent == UINT32_MAX ? VGI_NO_BONE : mover[parent];
    }
}

int vgi_rig_parents(const vg_rig *r, uint32_t *parent, vg_err *e)
{
    uint32_t *mover = vgi_array(r->skeleton.njoints, sizeof *mover, e);
    if (!mover) return VG_ENOMEM;
    vgi_rig_movers(r, mover);
    for (size_t b = 0; b < r->nbones; b++) {
        uint32_t above = r->skeleton.joints[r->bone[b]].parent, up = above == UINT32_MAX ? VGI_NO_BONE : mover[above];
        parent[b] = up != VGI_NO_BONE || b == 0 ? up : 0;
    }
    free(mover);
    return VG_OK;
}

bool vgi_rig_is_free(const vg_rig *r)
{
    for (size_t b = 0; b < r->nbones; b++)
        if (r->skeleton.joints[r->bone[b]].parent != UINT32_MAX) return false;
    return r->nbones > 1;
}

void vg_rig_transforms(const vg_rig *r, const double *positions, const double *turns, double *transforms)
{
    for (size_t b = 0; b < r->nbones; b++) {
        size_t j = r->bone[b];
        const double *q = r->turn + 4 * j, back[4] = {q[0], -q[1], -q[2], -q[3]};
        double *to = transforms + 7 * b, moved[3];
        vg_quat_multiply(turns + 4 * j, back, to);
        vg_quat_apply(to, r->at + 3 * j, moved);
        vgi_subtract(positions + 3 * j, moved, to + 4);
    }
}

void vg_rig_skin(const vg_rig *r, size_t nv, const double *reference, const double *transforms, double *vertices)
{
    for (size_t v = 0; v < nv; v++) {
        double sum[3] = {0, 0, 0};
        for (size_t i = 0; i < VG_SKIN; i++) {
            double w = r->skin_weight[VG_SKIN * v + i], moved[3];
            if (!(w > 0)) break;
            const double *t = transforms + 7 * (size_t)r->skin_bone[VG_SKIN * v + i];
            vg_quat_apply(t, reference + 3 * v, moved);
            vgi_add(moved, t + 4);
            vgi_add_scaled(sum, w, moved);
        }
        memcpy(vertices + 3 * v, sum, sizeof sum);
    }
}

/* ---- editing ---- */

size_t vg_rig_find(const vg_rig *r, const char *name)
{
    size_t b = 0;
    while (b < r->nbones && strcmp(r->skeleton.joints[r->bone[b]].name, name)) b++;
    return b;
}

bool vg_rig_axis(const vg_rig *r, size_t b, double axis[3])
{
    double sum[3] = {0, 0, 0}, way[3];
    size_t own = r->bone[b];
    bool ends = false;
    for (size_t j = 0; j < r->skeleton.njoints; j++) /* an end site, if present, gives the direction */
        ends |= r->skeleton.joints[j].parent == own && !r->skeleton.joints[j].nchannels;
    for (size_t j = 0; j < r->skeleton.njoints; j++) {
        const vg_joint *joint = &r->skeleton.joints[j];
        if (joint->parent != own || (ends && joint->nchannels)) continue;
        vgi_subtract(r->at + 3 * j, r->at + 3 * own, way);
        vgi_add(sum, way);
    }
    memcpy(axis, sum, sizeof sum);
    return vgi_make_unit(axis) > 0;
}

static bool hangs_on(const vg_rig *r, size_t joint, size_t above)
{
    while (joint != above && r->skeleton.joints[joint].parent != UINT32_MAX) joint = r->skeleton.joints[joint].parent;
    return joint == above;
}

void vg_rig_edit(const vg_rig *r, size_t b, const double axis[3], double degrees, double *transforms)
{
    const double *own = transforms + 7 * b;
    double now[3], centre[3], half = degrees * (3.14159265358979323846 / 360), q[4] = {cos(half)};
    vg_quat_apply(own, axis, now);
    double size = vgi_dot(now, now);
    for (int k = 0; k < 3 && size > 0; k++) q[k + 1] = sin(half) * now[k] / sqrt(size);
    vg_quat_apply(own, r->at + 3 * (size_t)r->bone[b], centre);
    vgi_add(centre, own + 4);
    for (size_t d = 0; d < r->nbones; d++) {
        if (!hangs_on(r, r->bone[d], r->bone[b])) continue;
        double *t = transforms + 7 * d, from[3], to[3];
        vgi_subtract(t + 4, centre, from);
        vg_quat_apply(q, from, to);
        vgi_sum(to, centre, t + 4);
        vg_quat_multiply(q, t, t);
    }
}
