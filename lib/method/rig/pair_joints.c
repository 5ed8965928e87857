/* pair_joints.c: matches the joints of two skeletons: first those with equal names, then those with equal roles.
 * Roles come from joint_roles.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/joint_roles.h"

#include <stdlib.h>

static const uint32_t NONE = UINT32_MAX;

static uint32_t find_joint(const vg_skeleton *s, const char *name)
{
    for (size_t j = 0; j < s->njoints; j++)
        if (!strcmp(s->joints[j].name, name)) return (uint32_t)j;
    return NONE;
}

/* The joints of one role in skeleton order, which is outward: their number, the number before joint j, and the joint
 * with k before it. */
static size_t count_role(const vgi_role *roles, size_t n, vgi_role role)
{
    size_t count = 0;
    for (size_t j = 0; j < n; j++) count += roles[j].part == role.part && roles[j].side == role.side;
    return count;
}

static uint32_t find_role(const vgi_role *roles, size_t n, vgi_role role, size_t k)
{
    for (size_t j = 0; j < n; j++)
        if (roles[j].part == role.part && roles[j].side == role.side && k-- == 0) return (uint32_t)j;
    return NONE;
}

/* The joint, of m in the chain, that matches joint k of n. Fingers are counted from the hand. Other chains are
 * aligned at their ends, so that the last spine joints match. */
static size_t place_in_chain(vgi_role role, size_t k, size_t n, size_t m)
{
    if (role.part >= VGI_THUMB && role.part <= VGI_PINKY) return k < m ? k : m - 1;
    return ((k + 1) * m + n - 1) / n - 1;
}

static void pair_by_names(const vg_skeleton *of, const vg_skeleton *by, uint32_t *partner)
{
    for (size_t j = 0; j < of->njoints; j++)
        if (partner[j] == NONE) partner[j] = find_joint(by, of->joints[j].name);
}

static void pair_by_roles(const vg_skeleton *of, const vgi_role *a, const vg_skeleton *by, const vgi_role *b,
                          uint32_t *partner)
{
    for (size_t j = 0; j < of->njoints; j++) {
        if (partner[j] != NONE || a[j].part == VGI_NO_PART) continue;
        size_t n = count_role(a, of->njoints, a[j]), m = count_role(b, by->njoints, a[j]);
        if (m) partner[j] = find_role(b, by->njoints, a[j], place_in_chain(a[j], count_role(a, j, a[j]), n, m));
    }
}

/* Whether most joints of the smaller skeleton have a namesake. If so, equal names mean equal joints. */
static bool share_names(const vg_skeleton *of, const vg_skeleton *by)
{
    size_t same = 0, a = 0, b = 0;
    for (size_t j = 0; j < of->njoints; j++) {
        a += of->joints[j].nchannels > 0;
        same += of->joints[j].nchannels > 0 && find_joint(by, of->joints[j].name) != NONE;
    }
    for (size_t j = 0; j < by->njoints; j++) b += by->joints[j].nchannels > 0;
    return 2 * same >= (a < b ? a : b);
}

int vg_skeleton_pair(const vg_skeleton *of, const vg_skeleton *by, uint32_t *partner, vg_err *e)
{
    vgi_role *a = vgi_array(of->njoints, sizeof *a, e), *b = vgi_array(by->njoints, sizeof *b, e);
    int r = a && b ? vgi_joint_roles(of, a, NULL, e) : VG_ENOMEM;
    if (r == VG_OK) r = vgi_joint_roles(by, b, NULL, e);
    if (r == VG_OK) {
        for (size_t j = 0; j < of->njoints; j++) partner[j] = NONE;
        bool names_first = share_names(of, by);
        if (names_first) pair_by_names(of, by, partner);
        pair_by_roles(of, a, by, b, partner);
        if (!names_first) pair_by_names(of, by, partner);
    }
    free(a);
    free(b);
    return r;
}
