/* joint_roles.c: the role of a joint in the body. What names tell comes from joint_names.c; what they leave open is decided
 * here, by the other roles and the tree of joints. Joints of two skeletons are matched in pair_joints.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/joint_roles.h"

#include <stdlib.h>

static const uint32_t NONE = UINT32_MAX;

/* The joints of one side while its roles are decided; side 0 is the middle. */
typedef struct body_side {
    const vg_skeleton *s;
    vgi_role *roles;
    int side;
} body_side;

static uint32_t find_from(const body_side *x, vgi_part part, size_t first)
{
    for (size_t j = first; j < x->s->njoints; j++)
        if (x->roles[j].part == part && x->roles[j].side == x->side) return (uint32_t)j;
    return NONE;
}

static bool has_part(const body_side *x, vgi_part part)
{
    return find_from(x, part, 0) != NONE;
}

static size_t count_part(const body_side *x, vgi_part part)
{
    size_t n = 0;
    for (uint32_t j = find_from(x, part, 0); j != NONE; j = find_from(x, part, j + 1)) n++;
    return n;
}

static void rename_part(const body_side *x, vgi_part from, vgi_part to)
{
    for (uint32_t j = find_from(x, from, 0); j != NONE; j = find_from(x, from, j + 1)) x->roles[j].part = (uint8_t)to;
}

static bool is_above(const vg_skeleton *s, uint32_t above, uint32_t below)
{
    while (below != NONE && below != above) below = s->joints[below].parent;
    return below == above;
}

/* Names such as "arm_1, arm_2, arm_3": the joints of `from`, in order, are the n parts of `to`; a part that is known by its
 * own name ends them. */
static void deal_parts(const body_side *x, vgi_part from, const vgi_part *to, size_t n)
{
    for (size_t i = 0; i < n && !(i && has_part(x, to[i])); i++) {
        uint32_t j = find_from(x, from, 0);
        if (j == NONE) return;
        x->roles[j].part = (uint8_t)to[i];
    }
}

/* Whether the shoulder of the other side is a joint above its upper arm. */
static bool other_has_clavicle(const body_side *x)
{
    body_side other = {x->s, x->roles, -x->side};
    return (has_part(&other, VGI_CLAVICLE) || has_part(&other, VGI_SHOULDER)) &&
           (has_part(&other, VGI_UPPER_ARM) || has_part(&other, VGI_ARM));
}

static void decide_arm(const body_side *x)
{
    static const vgi_part whole[] = {VGI_UPPER_ARM, VGI_FOREARM, VGI_HAND};
    size_t arms = count_part(x, VGI_ARM);
    bool clavicle = has_part(x, VGI_CLAVICLE), upper = has_part(x, VGI_UPPER_ARM), fore = has_part(x, VGI_FOREARM);
    if (upper) rename_part(x, VGI_ARM, fore ? VGI_NO_PART : VGI_FOREARM);
    else if (fore) rename_part(x, VGI_ARM, VGI_UPPER_ARM);
    else deal_parts(x, VGI_ARM, whole, 3);
    bool moves_arm = !upper && !arms && (fore || clavicle || !other_has_clavicle(x)); /* not if this arm is missing */
    rename_part(x, VGI_SHOULDER, moves_arm ? VGI_UPPER_ARM : clavicle ? VGI_NO_PART : VGI_CLAVICLE);
}

static void decide_leg(const body_side *x)
{
    static const vgi_part whole[] = {VGI_THIGH, VGI_SHIN, VGI_FOOT, VGI_TOE};
    size_t legs = count_part(x, VGI_LEG);
    bool thigh = has_part(x, VGI_THIGH), shin = has_part(x, VGI_SHIN);
    if (!thigh && !shin && legs > 1) deal_parts(x, VGI_LEG, whole, 4);
    else if (!thigh && shin) rename_part(x, VGI_LEG, VGI_THIGH);
    rename_part(x, VGI_LEG, has_part(x, VGI_SHIN) ? VGI_NO_PART : VGI_SHIN);
    vgi_part above = has_part(x, VGI_THIGH) ? VGI_NO_PART : VGI_THIGH;
    rename_part(x, VGI_SIDED_HIP, above ? above : VGI_HIP_JOINT);
    if (!has_part(x, VGI_THIGH)) rename_part(x, VGI_HIP_JOINT, VGI_THIGH);
}

/* The joint called `from` becomes `to`. One below it that is called so becomes `below`; one above it stays. */
static void decide_end(const body_side *x, vgi_part from, vgi_part to, vgi_part below)
{
    uint32_t end = find_from(x, from, 0), other = find_from(x, to, 0);
    if (end != NONE && other != NONE && is_above(x->s, end, other)) rename_part(x, to, below);
    rename_part(x, from, has_part(x, to) ? VGI_NO_PART : to);
}

/* A limb whose end has no name that is known: of the nameless joints below it, the first on the way to the farthest. */
static void find_end(const body_side *x, vgi_part limb, vgi_part end, const double *at)
{
    uint32_t up = find_from(x, limb, 0), best = NONE;
    double most = 0;
    if (up == NONE || has_part(x, end)) return;
    for (size_t j = up + 1; j < x->s->njoints; j++) {
        uint32_t child = (uint32_t)j;
        if (!is_above(x->s, up, child)) continue;
        while (x->s->joints[child].parent != up) child = x->s->joints[child].parent;
        double far = 0;
        for (int k = 0; k < 3; k++) far += (at[3 * j + k] - at[3 * up + k]) * (at[3 * j + k] - at[3 * up + k]);
        if (x->roles[child].part == VGI_NO_PART && far > most * (1 + 1e-9)) best = child, most = far;
    }
    if (best != NONE) x->roles[best] = (vgi_role){.part = (uint8_t)end, .side = (int8_t)x->side};
}

static void decide_side(const body_side *x, const double *at)
{
    decide_end(x, VGI_WRIST, VGI_HAND, VGI_NO_PART);
    decide_end(x, VGI_ANKLE, VGI_FOOT, VGI_TOE);
    decide_end(x, VGI_PALM, VGI_HAND, VGI_HAND);
    decide_arm(x);
    decide_leg(x);
    find_end(x, VGI_FOREARM, VGI_HAND, at);
    find_end(x, VGI_SHIN, VGI_FOOT, at);
}

/* ---- the middle ---- */

/* The last joint that is above both thighs. */
static uint32_t find_between_thighs(const vg_skeleton *s, vgi_role *roles)
{
    uint32_t left = find_from(&(body_side){s, roles, 1}, VGI_THIGH, 0),
             right = find_from(&(body_side){s, roles, -1}, VGI_THIGH, 0);
    while (left != NONE && right != NONE && !is_above(s, left, right)) left = s->joints[left].parent;
    return right == NONE ? NONE : left;
}

/* Without a joint of this name, the hips are the joint from which the thighs branch, or the root. */
static void find_hips(const body_side *x)
{
    if (has_part(x, VGI_HIPS)) return;
    uint32_t j = find_between_thighs(x->s, x->roles);
    if (j != NONE && x->roles[j].part <= VGI_SPINE) x->roles[j] = (vgi_role){.part = VGI_HIPS};
    if (!has_part(x, VGI_HIPS)) rename_part(x, VGI_ROOT, VGI_HIPS);
}

/* below[j]: whether joint j is an upper arm or above one. */
static void find_above_arms(const body_side *x, bool *below)
{
    for (size_t j = x->s->njoints; j-- > 0;) {
        below[j] = below[j] || x->roles[j].part == VGI_UPPER_ARM;
        if (below[j] && x->s->joints[j].parent != NONE) below[x->s->joints[j].parent] = true;
    }
}

/* Rigify: spine joints above the arms are neck and head. */
static void divide_spine(const body_side *x, bool *below)
{
    uint32_t last = NONE;
    find_above_arms(x, below);
    if (has_part(x, VGI_NECK) || !below[0]) return;
    for (uint32_t j = find_from(x, VGI_SPINE, 0); j != NONE; j = find_from(x, VGI_SPINE, j + 1))
        if (!below[j]) x->roles[j].part = VGI_NECK, last = j;
    if (last != NONE && !has_part(x, VGI_HEAD)) x->roles[last].part = VGI_HEAD;
}

static bool have_limbs(const vg_skeleton *s, const vgi_role *roles)
{
    for (size_t j = 0; j < s->njoints; j++)
        if (vgi_role_is_limb(roles[j])) return true;
    return false;
}

/* Without a joint of this name, the head is the last of several joints of the neck. */
static void find_head(const body_side *x)
{
    uint32_t last = NONE;
    if (has_part(x, VGI_HEAD) || count_part(x, VGI_NECK) < 2) return;
    for (uint32_t j = find_from(x, VGI_NECK, 0); j != NONE; j = find_from(x, VGI_NECK, j + 1)) last = j;
    x->roles[last].part = VGI_HEAD;
}

int vgi_joint_roles(const vg_skeleton *s, vgi_role *roles, bool *guessed, vg_err *e)
{
    body_side middle = {s, roles, 0};
    bool *below = vgi_array(s->njoints, sizeof *below, e);
    double *at = vgi_array(7 * s->njoints, sizeof *at, e);
    int r = below && at ? vgi_name_roles(s, roles, e) : VG_ENOMEM;
    if (r == VG_OK) {
        vg_skeleton_pose(s, NULL, at, at + 3 * s->njoints);
        for (int side = -1; side <= 1; side += 2) decide_side(&(body_side){s, roles, side}, at);
        bool named = have_limbs(s, roles);
        if (!named) r = vgi_guess_roles(s, at, roles, e);
        if (guessed) *guessed = !named && have_limbs(s, roles);
        find_hips(&middle);
        divide_spine(&middle, below);
        find_head(&middle);
    }
    free(below);
    free(at);
    return r;
}

bool vgi_role_is_limb(vgi_role r)
{
    return r.part == VGI_UPPER_ARM || r.part == VGI_FOREARM || r.part == VGI_THIGH || r.part == VGI_SHIN;
}
