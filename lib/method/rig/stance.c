/* stance.c: along which axes a skeleton stands and faces at rest. Programs differ: y or z is up, z, -y or x is ahead. What
 * differs less than axes do is left to align.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/align.h"
#include "numeric/vec3.h"

#include <math.h>

static const uint32_t NONE = UINT32_MAX;
static const double FIRM = 0.8; /* least cosine of a direction with its axis */

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
static int nearest_axis(const double d[3])
{
    int best = 0;
    for (int k = 1; k < 3; k++)
        if (fabs(d[k]) > fabs(d[best])) best = k;
    if (!(fabs(d[best]) > FIRM * vgi_length(d))) return 0;
    return d[best] > 0 ? best + 1 : -best - 1;
}

static void axis_vector(int axis, double x[3])
{
    x[0] = x[1] = x[2] = 0;
    x[(axis < 0 ? -axis : axis) - 1] = axis < 0 ? -1 : 1;
}

/* The axes that are up and left; false if they are not known. */
static bool find_axes(const vg_skeleton *s, const vgi_role *roles, const double *at, int axes[2])
{
    double up[3], left[3];
    if (!find_up(s, roles, at, up)) return false;
    if (!find_left(s, roles, at, VGI_THIGH, left) && !find_left(s, roles, at, VGI_UPPER_ARM, left)) return false;
    axes[0] = nearest_axis(up), axes[1] = nearest_axis(left);
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

void vgi_rests_stand(vgi_rests *x, vgi_stance *stance)
{
    int ours[2], theirs[2];
    *stance = (vgi_stance){.world = {1, 0, 0, 0}, .rest = {1, 0, 0, 0}};
    if (!find_axes(x->of, x->roles, x->rest, ours) || !find_axes(x->by, x->their_roles, x->theirs, theirs)) return;
    if (ours[0] == theirs[0] && ours[1] == theirs[1]) return;
    double a[3], b[3];
    axis_vector(theirs[0], a), axis_vector(ours[0], b);
    vg_quat_between(a, b, stance->world);
    turn_axes(theirs, ours, stance->rest);
    stance->up = ours[0] != theirs[0] ? theirs[0] : 0;
    double same = fabs(vgi_dot(stance->world, stance->rest) + stance->world[3] * stance->rest[3]);
    stance->faces = same < 0.99;
    for (size_t j = 0; j < x->by->njoints; j++) vg_quat_apply(stance->rest, x->theirs + 3 * j, x->theirs + 3 * j);
}
