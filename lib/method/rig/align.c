/* align.c: aligns the rest poses of two skeletons by the directions of their bones.
 *
 * By default limbs are aligned when any of them differs by more than APART degrees; then all limbs that differ by more
 * than ALIKE degrees are aligned. Arms that differ by 15 degrees make a body miss by 3 % of its size. The spine,
 * clavicles, feet and fingers are left alone: skeletons differ more in where they place these joints than in their rest
 * poses.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/align.h"
#include "numeric/polar.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

static const uint32_t NONE = UINT32_MAX;
static const double APART = 8, ALIKE = 3;
/* APART for bones of unknown role, such as breasts and tails: bodies differ in them. */
static const double STRANGERS = 20;
static const double LONG = 0.1; /* a bone of unknown role counts as a limb if it is at least this long, relative to
                                 * the skeleton's diagonal */

int vgi_rests_new(vgi_rests *x, const vg_skeleton *of, const vg_skeleton *by, const uint32_t *from, vg_err *e)
{
    size_t n = of->njoints, m = by->njoints;
    *x = (vgi_rests){.of = of, .by = by, .from = from};
    x->roles = vgi_array(n, sizeof *x->roles, e), x->their_roles = vgi_array(m, sizeof *x->their_roles, e);
    x->rest = vgi_array(7 * n, sizeof *x->rest, e), x->theirs = vgi_array(7 * m, sizeof *x->theirs, e);
    if (!x->roles || !x->their_roles || !x->rest || !x->theirs) return VG_ENOMEM;
    vg_skeleton_pose(of, NULL, x->rest, x->rest + 3 * n);
    vg_skeleton_pose(by, NULL, x->theirs, x->theirs + 3 * m);
    int r = vgi_joint_roles(of, x->roles, &x->guessed[0], e);
    return r < 0 ? r : vgi_joint_roles(by, x->their_roles, &x->guessed[1], e);
}

void vgi_rests_clear(vgi_rests *x)
{
    free(x->roles);
    free(x->their_roles);
    free(x->rest);
    free(x->theirs);
    *x = (vgi_rests){0};
}

void vgi_between(const double *positions, size_t a, size_t b, double d[3])
{
    vgi_subtract(positions + 3 * b, positions + 3 * a, d);
}

uint32_t vgi_find_role(const vg_skeleton *s, const vgi_role *roles, vgi_part part, int side)
{
    for (size_t j = 0; j < s->njoints; j++)
        if (roles[j].part == part && roles[j].side == side) return (uint32_t)j;
    return NONE;
}

/* Vector from the first joint of a limb to the first joint of the next part. */
static bool span_limb(const vg_skeleton *s, const vgi_role *roles, const double *positions, vgi_role limb,
                      double d[3])
{
    uint32_t a = vgi_find_role(s, roles, limb.part, limb.side),
             b = vgi_find_role(s, roles, (vgi_part)(limb.part + 1), limb.side);
    if (a == NONE || b == NONE) return false;
    vgi_between(positions, a, b, d);
    return vgi_length(d) > 0;
}

double vgi_leg_length(const vg_skeleton *s, const vgi_role *roles, const double *positions)
{
    double sum = 0, d[3];
    int legs = 0;
    for (int side = -1; side <= 1; side += 2) {
        vgi_role thigh = {VGI_THIGH, (int8_t)side}, shin = {VGI_SHIN, (int8_t)side};
        double length = span_limb(s, roles, positions, thigh, d) ? vgi_length(d) : 0;
        if (!(length > 0) || !span_limb(s, roles, positions, shin, d)) continue;
        sum += length + vgi_length(d);
        legs++;
    }
    return legs ? sum / legs : 0;
}

/* ---- directions of one pair of joints ---- */

/* Unit vectors from joint j to the joints below it, in both skeletons, at most `most`. */
typedef struct directions {
    size_t n;
    double ours[3], theirs[3]; /* of the last direction: unit vectors */
    double length;             /* of our vector before normalisation */
    double b[9];               /* sum of theirs ours^T */
} directions;

static void add_direction(directions *x, const double ours[3], const double theirs[3])
{
    double a = vgi_length(ours), b = vgi_length(theirs);
    if (!(a > 0 && b > 0)) return;
    vgi_divided(ours, a, x->ours), vgi_divided(theirs, b, x->theirs);
    for (int k = 0; k < 9; k++) x->b[k] += x->theirs[k / 3] * x->ours[k % 3];
    x->length = a;
    x->n++;
}

static directions children_of(const vgi_rests *x, size_t j)
{
    directions d = {0};
    for (size_t c = j + 1; c < x->of->njoints; c++) {
        double ours[3], theirs[3];
        if (x->of->joints[c].parent != j || x->from[c] == NONE || x->from[j] == NONE) continue;
        vgi_between(x->rest, j, c, ours);
        vgi_between(x->theirs, x->from[j], x->from[c], theirs);
        add_direction(&d, ours, theirs);
    }
    return d;
}

/* For a limb, the direction along it; for other joints, the directions to their children. */
static directions directions_of(const vgi_rests *x, size_t j)
{
    directions d = {0};
    double ours[3], theirs[3];
    if (x->from[j] == NONE || !vgi_role_is_limb(x->roles[j]) ||
        !span_limb(x->of, x->roles, x->rest, x->roles[j], ours) ||
        !span_limb(x->by, x->their_roles, x->theirs, x->roles[j], theirs))
        return children_of(x, j);
    add_direction(&d, ours, theirs);
    return d;
}

static double degrees_between(const double a[3], const double b[3])
{
    return acos(fmax(-1, fmin(1, vgi_dot(a, b)))) * (180 / M_PI);
}

/* Agreement of the directions after rotating ours by q: sum of cosines. */
static double agreement(const directions *d, const double q[4])
{
    double m[9], sum = 0;
    vg_quat_matrix(q, m);
    for (int k = 0; k < 9; k++) sum += m[k] * d->b[k];
    return sum;
}

/* ---- choice of joints, rotations ---- */

/* Angle in degrees between the rest directions of joint j if it is a limb, otherwise 0. */
static double limb_apart(const vgi_rests *x, size_t j, double shortest)
{
    if (x->from[j] == NONE) return 0;
    bool limb = vgi_role_is_limb(x->roles[j]);
    if (!limb && x->roles[j].part != VGI_NO_PART) return 0;
    directions d = directions_of(x, j);
    if (d.n != 1 || (!limb && d.length < shortest)) return 0;
    return degrees_between(d.ours, d.theirs);
}

static void choose_limbs(const vgi_rests *x, bool *wanted)
{
    double shortest = LONG * vg_diagonal(x->rest, x->of->njoints);
    bool apart = false;
    for (size_t j = 0; j < x->of->njoints; j++)
        if (limb_apart(x, j, shortest) > (vgi_role_is_limb(x->roles[j]) ? APART : STRANGERS)) apart = true;
    for (size_t j = 0; j < x->of->njoints && apart; j++) wanted[j] = limb_apart(x, j, shortest) > ALIKE;
}

/* Change q, the rotation of the joint above, so that the directions of both skeletons agree. */
static double align_joint(const directions *d, double q[4])
{
    if (d->n == 0) return 0;
    if (d->n > 1) vgi_best_turn_near(d->b, 1e-9, q, q);
    else vgi_turn_between(d->ours, d->theirs, q);
    return 2 * atan2(vgi_length(q + 1), fabs(q[0])) * (180 / M_PI);
}

int vgi_align(const vgi_rests *x, vg_align align, const bool *chosen, double *before, double *degrees, vg_err *e)
{
    static const double unturned[4] = {1, 0, 0, 0};
    size_t n = x->of->njoints;
    bool *wanted = vgi_array(n, sizeof *wanted, e);
    if (!wanted) return VG_ENOMEM;
    if (align == VG_ALIGN_CHOSEN) memcpy(wanted, chosen, n * sizeof *wanted);
    if (align == VG_ALIGN_AUTO) choose_limbs(x, wanted);
    for (size_t j = 0; j < n; j++) {
        uint32_t parent = x->of->joints[j].parent;
        double *q = before + 4 * j;
        memcpy(q, parent == NONE ? unturned : before + 4 * (size_t)parent, 4 * sizeof *q);
        degrees[j] = 0;
        if (align == VG_ALIGN_NONE || x->from[j] == NONE) continue;
        directions d = directions_of(x, j);
        if (align == VG_ALIGN_ALL || wanted[j]) degrees[j] = align_joint(&d, q);
        else if (agreement(&d, unturned) > agreement(&d, q)) memcpy(q, unturned, 4 * sizeof *q);
    }
    free(wanted);
    return VG_OK;
}
