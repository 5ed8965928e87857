/* drive.c: a rig driven by another skeleton whose joints have the same names.
 * Leaves out what a rig does with its transforms (method/rig/map_eval.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/rig.h"
#include "numeric/turn.h"

#include <math.h>
#include <stdlib.h>

struct vg_driver {
    const vg_rig *r;
    const vg_skeleton *by;
    uint32_t *from; /* of each joint of the rig: the other's joint; UINT32_MAX: none */
    double *before; /* of each joint of the rig: a turn that comes before the other's: 4 numbers */
    double scale;
    size_t missing;
    double *positions, *turns; /* of the rig's joints */
};

static size_t find_joint(const vg_skeleton *s, const char *name)
{
    size_t j = 0;
    while (j < s->njoints && strcmp(s->joints[j].name, name)) j++;
    return j;
}

/* How far the joints that both have lie from their mean at rest: the ratio of the two. */
static double compare_sizes(const vg_driver *d, const double *rest, const double *theirs)
{
    double mean[2][3] = {{0}}, spread[2] = {0, 0};
    size_t n = 0;
    for (int pass = 0; pass < 2; pass++)
        for (size_t j = 0; j < d->r->skeleton.njoints; j++) {
            if (d->from[j] == UINT32_MAX) continue;
            const double *x[2] = {rest + 3 * j, theirs + 3 * (size_t)d->from[j]};
            n += pass == 0;
            for (int i = 0; i < 2; i++)
                for (int k = 0; k < 3; k++) {
                    double gap = x[i][k] - mean[i][k] / (double)n;
                    if (pass == 0) mean[i][k] += x[i][k];
                    else spread[i] += gap * gap;
                }
        }
    return spread[0] > 0 && spread[1] > 0 ? sqrt(spread[0] / spread[1]) : 1;
}

/* The turn of the rig's joint j, at rest, that makes what is below it point where the other's does at rest; what that
 * leaves open, and what nothing is below, goes with the joint above. */
static void align_joint(const vg_driver *d, size_t j, const double *rest, const double *their_rest)
{
    double b[9] = {0}, one[2][3], *q = d->before + 4 * j;
    size_t n = 0;
    for (size_t c = j + 1; c < d->r->skeleton.njoints; c++) {
        if (d->r->skeleton.joints[c].parent != j || d->from[c] == UINT32_MAX) continue;
        double a[3], o[3], x = 0, y = 0;
        for (size_t k = 0; k < 3; k++) {
            a[k] = rest[3 * c + k] - rest[3 * j + k];
            o[k] = their_rest[3 * (size_t)d->from[c] + k] - their_rest[3 * (size_t)d->from[j] + k];
            x += a[k] * a[k], y += o[k] * o[k];
        }
        if (!(x > 0 && y > 0)) continue;
        for (int k = 0; k < 3; k++)
            for (int l = 0; l < 3; l++) b[3 * k + l] += o[k] * a[l] / sqrt(x * y);
        memcpy(one[0], a, sizeof a);
        memcpy(one[1], o, sizeof o);
        n++;
    }
    if (n > 1) vgi_best_turn_near(b, 1e-9, q, q);
    if (n != 1) return;
    vg_quat_between(one[0], one[1], q);
    double size = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int k = 0; k < 4; k++) q[k] /= size;
}

static int compare_rests(vg_driver *d, bool align, vg_err *e)
{
    size_t n = d->r->skeleton.njoints, m = d->by->njoints;
    double *rest = vgi_array(7 * n, sizeof *rest, e), *theirs = vgi_array(7 * m, sizeof *theirs, e);
    if (rest && theirs) {
        vg_skeleton_pose(&d->r->skeleton, NULL, rest, rest + 3 * n);
        vg_skeleton_pose(d->by, NULL, theirs, theirs + 3 * m);
        d->scale = compare_sizes(d, rest, theirs);
        for (size_t j = 0; j < n && align; j++) {
            uint32_t parent = d->r->skeleton.joints[j].parent;
            if (parent != UINT32_MAX) memcpy(d->before + 4 * j, d->before + 4 * (size_t)parent, 4 * sizeof(double));
            if (d->from[j] != UINT32_MAX) align_joint(d, j, rest, theirs);
        }
    }
    bool ok = rest && theirs;
    free(rest);
    free(theirs);
    return ok ? VG_OK : VG_ENOMEM;
}

int vg_driver_new(vg_driver **out, const vg_rig *r, const vg_skeleton *by, bool align, vg_err *e)
{
    size_t n = r->skeleton.njoints, found = 0;
    vg_driver *d = *out = vgi_array(1, sizeof *d, e);
    if (!d) return VG_ENOMEM;
    d->r = r, d->by = by;
    d->from = vgi_array(n, sizeof *d->from, e), d->before = vgi_array(4 * n, sizeof *d->before, e);
    d->positions = vgi_array(3 * n, sizeof *d->positions, e), d->turns = vgi_array(4 * n, sizeof *d->turns, e);
    int code = d->from && d->before && d->positions && d->turns ? VG_OK : VG_ENOMEM;
    for (size_t j = 0; code == VG_OK && j < n; j++) {
        size_t k = find_joint(by, r->skeleton.joints[j].name);
        bool turns = r->skeleton.joints[j].nchannels > 0;
        d->from[j] = k < by->njoints ? (uint32_t)k : UINT32_MAX;
        d->before[4 * j] = 1;
        if (turns) *(k < by->njoints ? &found : &d->missing) += 1;
    }
    if (code == VG_OK && !found)
        code = vg_fail(e, VG_EINPUT, "no joint of the skeleton has the name of a bone of the rig, such as '%.80s'",
                       r->skeleton.joints[r->bone[0]].name);
    if (code == VG_OK) code = compare_rests(d, align, e);
    if (code < 0) vg_driver_free(out);
    return code;
}

void vg_driver_free(vg_driver **out)
{
    vg_driver *d = *out;
    if (!d) return;
    free(d->from);
    free(d->before);
    free(d->positions);
    free(d->turns);
    free(d);
    *out = NULL;
}

size_t vg_driver_missing(const vg_driver *d)
{
    return d->missing;
}

/* How far the other's joint k is from where its bone's length puts it: what position channels have done. */
static void read_slip(const vg_driver *d, size_t k, const double *positions, const double *turns, double slip[3])
{
    uint32_t parent = d->by->joints[k].parent;
    double at[3] = {0, 0, 0};
    if (parent != UINT32_MAX) vg_quat_apply(turns + 4 * (size_t)parent, d->by->joints[k].offset, at);
    for (size_t i = 0; i < 3; i++)
        slip[i] = positions[3 * k + i] - at[i] - (parent != UINT32_MAX ? positions[3 * (size_t)parent + i] : 0);
}

void vg_driver_pose(vg_driver *d, const double *positions, const double *turns, double *transforms)
{
    const vg_skeleton *s = &d->r->skeleton;
    for (size_t j = 0; j < s->njoints; j++) {
        uint32_t from = d->from[j], parent = s->joints[j].parent;
        double *q = d->turns + 4 * j, *p = d->positions + 3 * j, slip[3] = {0, 0, 0};
        if (from != UINT32_MAX) {
            vg_quat_multiply(turns + 4 * (size_t)from, d->before + 4 * j, q);
            if (parent == UINT32_MAX || d->by->joints[from].parent != UINT32_MAX)
                read_slip(d, from, positions, turns, slip);
        } else if (parent != UINT32_MAX) {
            memcpy(q, d->turns + 4 * (size_t)parent, 4 * sizeof *q);
        } else {
            memcpy(q, (const double[4]){1, 0, 0, 0}, 4 * sizeof *q);
        }
        if (parent == UINT32_MAX) {
            for (size_t i = 0; i < 3; i++) p[i] = from != UINT32_MAX ? d->scale * slip[i] : d->r->at[3 * j + i];
            if (from != UINT32_MAX && d->by->joints[from].parent != UINT32_MAX)
                for (size_t i = 0; i < 3; i++) p[i] = d->scale * positions[3 * (size_t)from + i];
            continue;
        }
        vg_quat_apply(d->turns + 4 * (size_t)parent, s->joints[j].offset, p);
        for (size_t i = 0; i < 3; i++) p[i] += d->positions[3 * (size_t)parent + i] + d->scale * slip[i];
    }
    vg_rig_transforms(d->r, d->positions, d->turns, transforms);
}
