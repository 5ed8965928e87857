/* stance.c: along which axes a skeleton stands and faces. Programs differ: y or z is up, z, -y or x is ahead; and the root of
 * some files turns a rest pose with one axis up into a motion with another axis up. What differs less than axes do is left to
 * align.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/align.h"
#include "numeric/vec3.h"

#include <math.h>

static const uint32_t NONE = UINT32_MAX;
static const double FIRM = 0.8;  /* least cosine of a direction with its axis, at rest */
static const double LOOSE = 0.6; /* and in motion */
static const double STANDS[2] = {0.6, 1.4}; /* the hips of who stands are this high above the ground, in legs */
static const double LIES = 0.4;             /* those of who lies are nearer to it */

/* From the right joint of a part to the left one. */
static bool find_left(const vg_skeleton *s, const vgi_role *roles, const double *at, vgi_part part, double left[3])
{
    uint32_t a = vgi_find_role(s, roles, part, -1), b = vgi_find_role(s, roles, part, 1);
    if (a == NONE || b == NONE) return false;
    vgi_between(at, a, b, left);
    return vgi_length(left) > 0;
}

/* From between the thighs to the head, or to what is nearest to it. */
static bool find_up(const vg_skeleton *s, const vgi_role *roles, const double *at, double up[3])
{
    uint32_t top = vgi_find_role(s, roles, VGI_HEAD, 0), right = vgi_find_role(s, roles, VGI_THIGH, -1),
             left = vgi_find_role(s, roles, VGI_THIGH, 1);
    if (top == NONE) top = vgi_find_role(s, roles, VGI_NECK, 0);
    if (top == NONE || right == NONE || left == NONE) return false;
    double below[3];
    vgi_mix(at + 3 * right, at + 3 * left, 0.5, below);
    vgi_subtract(at + 3 * top, below, up);
    return vgi_length(up) > 0;
}

/* The axis nearest to a direction, as 1, 2, 3 or the negative; 0 if none is near. */
static int nearest_axis(const double d[3], double firm)
{
    int best = 0;
    for (int k = 1; k < 3; k++)
        if (fabs(d[k]) > fabs(d[best])) best = k;
    if (!(fabs(d[best]) > firm * vgi_length(d))) return 0;
    return d[best] > 0 ? best + 1 : -best - 1;
}

/* 1, 2, 3 or the negative of one as a unit vector. */
static void axis_vector(int axis, double x[3])
{
    for (int k = 0; k < 3; k++) x[k] = (axis == k + 1) - (axis == -k - 1);
}

/* The axes that are up and left; false if they are not known. */
static bool find_axes(const vg_skeleton *s, const vgi_role *roles, const double *at, int axes[2])
{
    double up[3], left[3];
    if (!find_up(s, roles, at, up)) return false;
    if (!find_left(s, roles, at, VGI_THIGH, left) && !find_left(s, roles, at, VGI_UPPER_ARM, left)) return false;
    axes[0] = nearest_axis(up, FIRM), axes[1] = nearest_axis(left, FIRM);
    return axes[0] && axes[1] && axes[0] != axes[1] && axes[0] != -axes[1];
}

/* The rotation of their up and left into ours. */
static void turn_axes(const int theirs[2], const int ours[2], double q[4])
{
    double a[3][3], b[3][3], m[9];
    for (int k = 0; k < 2; k++) axis_vector(theirs[k], a[k]), axis_vector(ours[k], b[k]);
    vgi_cross(a[0], a[1], a[2]), vgi_cross(b[0], b[1], b[2]);
    for (int i = 0; i < 9; i++) m[i] = b[0][i / 3] * a[0][i % 3] + b[1][i / 3] * a[1][i % 3] + b[2][i / 3] * a[2][i % 3];
    vg_quat_from_matrix(m, q);
}

static void turn_up(int from, int to, double q[4])
{
    double a[3], b[3];
    axis_vector(from, a), axis_vector(to, b);
    vg_quat_between(a, b, q);
}

/* The joints by which vgi_stance_look tells how the body stands. */
static void find_body(const vgi_rests *x, vgi_stance *s)
{
    s->top = vgi_find_role(x->by, x->their_roles, VGI_HEAD, 0);
    if (s->top == NONE) s->top = vgi_find_role(x->by, x->their_roles, VGI_NECK, 0);
    for (int side = 0; side < 2; side++)
        s->below[side] = vgi_find_role(x->by, x->their_roles, VGI_FOOT, 2 * side - 1);
    s->hips[0] = vgi_find_role(x->by, x->their_roles, VGI_THIGH, -1);
    s->hips[1] = vgi_find_role(x->by, x->their_roles, VGI_THIGH, 1);
    s->leg = vgi_leg_length(x->by, x->their_roles, x->theirs);
}

/* The skeleton of the rig itself: whatever its motion does, the rig was fitted to it. */
static bool is_own(const vgi_rests *x)
{
    size_t n = x->of->njoints;
    if (x->by->njoints != n) return false;
    double most = 1e-6 * vg_diagonal(x->rest, n);
    for (size_t j = 0; j < n; j++) {
        const vg_joint *a = &x->of->joints[j], *b = &x->by->joints[j];
        if (strcmp(a->name, b->name) || a->parent != b->parent) return false;
        if (a->parent != NONE && vgi_square(a->offset, b->offset) > most * most) return false;
    }
    return true;
}

void vgi_rests_stand(vgi_rests *x, const double *at, vgi_stance *stance)
{
    int ours[2], theirs[2];
    double up[3], upright[4];
    *stance = (vgi_stance){.world = {1, 0, 0, 0}, .rest = {1, 0, 0, 0}};
    if (is_own(x)) return;
    if (!find_axes(x->of, x->roles, x->rest, ours) || !find_axes(x->by, x->their_roles, x->theirs, theirs)) return;
    find_body(x, stance);
    stance->ours = find_up(x->of, x->roles, at, up) ? nearest_axis(up, FIRM) : 0;
    if (!stance->ours) stance->ours = ours[0];
    stance->theirs = stance->moves = theirs[0];
    turn_up(theirs[0], stance->ours, stance->world);
    turn_axes(theirs, ours, stance->rest);
    turn_up(theirs[0], ours[0], upright);
    stance->stands = ours[0] != theirs[0];
    stance->faces = fabs(vgi_dot(upright, stance->rest) + upright[3] * stance->rest[3]) < 0.99;
    for (size_t j = 0; j < x->by->njoints; j++) vg_quat_apply(stance->rest, x->theirs + 3 * j, x->theirs + 3 * j);
}

/* ---- in motion ---- */

/* Torso: from the hips to the head. Legs: from the feet to the hips. */
static void find_posture(const vgi_stance *s, const double *positions, double hips[3], double torso[3], double legs[3])
{
    double feet[3];
    vgi_mix(positions + 3 * s->hips[0], positions + 3 * s->hips[1], 0.5, hips);
    vgi_mix(positions + 3 * s->below[0], positions + 3 * s->below[1], 0.5, feet);
    vgi_subtract(positions + 3 * s->top, hips, torso);
    vgi_subtract(hips, feet, legs);
}

static double along(const double x[3], int axis)
{
    double up[3];
    axis_vector(axis, up);
    return vgi_dot(x, up);
}

/* A body whose torso is along another axis than at rest either bends or lies, or its root has turned it. If the legs are still
 * along the axis, it bends. Otherwise the root has turned it if the hips are as high above 0 along the new axis as those of who
 * stands; for the axis that is up for the rig it is enough that they are not as low along the old one as those of who lies, or
 * that the file does not move the hips at all. */
void vgi_stance_look(vgi_stance *s, const double *positions)
{
    double hips[3], torso[3], legs[3];
    if (!s->theirs || !(s->leg > 0) || s->top == NONE || s->below[0] == NONE || s->below[1] == NONE) return;
    find_posture(s, positions, hips, torso, legs);
    int axis = nearest_axis(torso, LOOSE);
    if (!axis || axis == s->theirs || nearest_axis(legs, LOOSE) == s->theirs) return;
    double high = along(hips, axis) / s->leg, low = fabs(along(hips, s->theirs)) / s->leg;
    bool stands = high > STANDS[0] && high < STANDS[1], lies = low < LIES && vgi_length(hips) > 1e-3 * s->leg;
    if (!stands && (axis != s->ours || lies)) return;
    s->moves = axis;
    turn_up(axis, s->ours, s->world);
}
