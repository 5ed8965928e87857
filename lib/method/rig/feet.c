/* feet.c: keeps standing feet from sliding (foot contact). While the heel or the ball of a foot is slow and low, it
 * is held in place, and thigh and shin bend so that the foot reaches it. Between two contacts the correction is
 * interpolated smoothly. The foot keeps its rotation and the body its motion, except that the body is lowered where a
 * leg would be too short. The rig is driven in drive.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/align.h"
#include "numeric/stats.h"
#include "numeric/polar.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

static const uint32_t NONE = UINT32_MAX;
static const double SLOW = 0.15;    /* a joint stands below this share of its fast speed */
static const double LOW = 0.12;     /* and below this height above its lowest position, relative to the length of the
                                     * leg */
static const double RAISED = 0.15;  /* a heel is on the ground at most this far above the ball, relative to their
                                     * distance at rest */
static const double STRETCH = 0.999; /* largest distance from hip to foot, relative to the length of the leg */
enum { SHORTEST = 3 };              /* fewest poses of a contact */

typedef enum group { BODY = 0, THIGH, SHIN, FOOT } group;

/* One leg: its joints, the group of each bone, and the correction of the foot in each pose. */
typedef struct leg {
    uint32_t thigh, shin, foot, toe; /* NONE if there is no toe */
    uint8_t *group;                  /* of each bone */
    double length[2];                /* of thigh and shin */
    double *shift;                   /* 3 per pose */
    bool *known;                     /* per pose: whether the foot is held; elsewhere the shift is interpolated */
} leg;

typedef struct feet {
    const vg_rig *r;
    size_t n;
    double *const *transforms;
    int up;      /* vertical axis */
    double sign; /* 1 if up is along the axis, -1 if against it */
    leg legs[2];
    size_t nlegs;
    double *path;  /* 3 per pose: path of the current joint */
    bool *stands;  /* per pose: whether the current joint stands */
    double *speed; /* per pose */
    double *lower; /* per pose: how far the body is lowered */
} feet;

static size_t bone_of(const vg_rig *g, uint32_t joint)
{
    size_t b = 0;
    while (b < g->nbones && g->bone[b] != joint) b++;
    return b;
}

/* Position in a pose of a point that moves with a joint and is at `rest` at rest. */
static void point_at(const vg_rig *g, uint32_t joint, const double rest[3], const double *transforms, double at[3])
{
    const double *t = transforms + 7 * bone_of(g, joint);
    vg_quat_apply(t, rest, at);
    vgi_add(at, t + 4);
}

static void joint_at(const vg_rig *g, uint32_t joint, const double *transforms, double at[3])
{
    point_at(g, joint, g->at + 3 * (size_t)joint, transforms, at);
}

static void group_bones(const vg_rig *g, leg *l)
{
    for (size_t b = 0; b < g->nbones; b++)
        for (uint32_t j = g->bone[b]; j != NONE && !l->group[b]; j = g->skeleton.joints[j].parent)
            l->group[b] = j == l->foot ? FOOT : j == l->shin ? SHIN : j == l->thigh ? THIGH : BODY;
}

static double rest_distance(const vg_rig *g, uint32_t a, uint32_t b)
{
    double d[3];
    vgi_between(g->at, a, b, d);
    return vgi_length(d);
}

/* Find the leg of a side. Returns false if the rig has none. */
static bool find_leg(const vg_rig *g, const vgi_role *roles, int side, leg *l)
{
    uint32_t *joint[4] = {&l->thigh, &l->shin, &l->foot, &l->toe};
    for (int i = 0; i < 4; i++) {
        *joint[i] = vgi_find_role(&g->skeleton, roles, (vgi_part)(VGI_THIGH + i), side);
        if (*joint[i] != NONE && bone_of(g, *joint[i]) == g->nbones) *joint[i] = NONE;
    }
    if (l->thigh == NONE || l->shin == NONE || l->foot == NONE) return false;
    l->length[0] = rest_distance(g, l->thigh, l->shin), l->length[1] = rest_distance(g, l->shin, l->foot);
    return l->length[0] > 0 && l->length[1] > 0;
}

static void find_up(feet *f)
{
    double most = 0;
    f->up = 1, f->sign = 1;
    for (int k = 0; k < 3; k++) {
        double d = 0;
        for (size_t i = 0; i < f->nlegs; i++)
            d += f->r->at[3 * (size_t)f->legs[i].thigh + k] - f->r->at[3 * (size_t)f->legs[i].foot + k];
        if (fabs(d) > most) most = fabs(d), f->up = k, f->sign = d > 0 ? 1 : -1;
    }
}

static double height(const feet *f, const double point[3])
{
    return f->sign * point[f->up];
}

static int prepare_feet(feet *f, vg_err *e)
{
    vgi_role *roles = vgi_array(f->r->skeleton.njoints, sizeof *roles, e);
    int r = roles ? vgi_joint_roles(&f->r->skeleton, roles, NULL, e) : VG_ENOMEM;
    for (int side = -1; r == VG_OK && side <= 1; side += 2) {
        leg *l = &f->legs[f->nlegs];
        if (!find_leg(f->r, roles, side, l)) continue;
        f->nlegs++;
        l->group = vgi_array(f->r->nbones, sizeof *l->group, e);
        l->shift = vgi_array(f->n, 3 * sizeof *l->shift, e), l->known = vgi_array(f->n, sizeof *l->known, e);
        if (!l->group || !l->shift || !l->known) r = VG_ENOMEM;
        else group_bones(f->r, l);
    }
    free(roles);
    if (r < 0) return r;
    if (!f->nlegs)
        return vg_fail(e, VG_EINPUT, "no bones of the rig have names of thigh, shin and foot: there are no feet to hold");
    find_up(f);
    f->path = vgi_array(f->n, 3 * sizeof *f->path, e), f->stands = vgi_array(f->n, sizeof *f->stands, e);
    f->speed = vgi_array(2 * f->n, sizeof *f->speed, e), f->lower = vgi_array(2 * f->n, sizeof *f->lower, e);
    return f->path && f->stands && f->speed && f->lower ? VG_OK : VG_ENOMEM;
}

/* ---- contacts ---- */

/* Distance between consecutive poses: the mean of those before and after. */
static void measure_speed(feet *f)
{
    double d[3];
    for (size_t i = 0; i < f->n; i++) {
        size_t a = i ? i - 1 : 0, b = i + 1 < f->n ? i + 1 : i;
        vgi_between(f->path, a, b, d);
        f->speed[i] = b > a ? vgi_length(d) / (double)(b - a) : 0;
    }
}

static void drop_short_stands(feet *f)
{
    for (size_t i = 0, end; i < f->n; i = end + 1) {
        for (end = i; end < f->n && f->stands[end]; end++) {}
        if (end - i >= SHORTEST) continue;
        while (i < end) f->stands[i++] = false;
    }
}

static void find_stands(feet *f, uint32_t joint, double leg_length)
{
    double lowest = INFINITY;
    for (size_t i = 0; i < f->n; i++) {
        joint_at(f->r, joint, f->transforms[i], f->path + 3 * i);
        lowest = fmin(lowest, height(f, f->path + 3 * i));
    }
    measure_speed(f);
    memcpy(f->speed + f->n, f->speed, f->n * sizeof *f->speed);
    double fast = f->n ? vgi_select(f->speed + f->n, f->n, f->n * 9 / 10) : 0;
    for (size_t i = 0; i < f->n; i++)
        f->stands[i] = f->speed[i] <= SLOW * fast && height(f, f->path + 3 * i) <= lowest + LOW * leg_length;
}

/* A foot does not stand on a heel that is above its ball, however low and slow the ankle is. At rest, the heel is below
 * the ankle and as low as the ball. */
static void lift_heels(feet *f, const leg *l)
{
    const double *at = f->r->at, *toe = at + 3 * (size_t)l->toe;
    double rest[3], heel[3], ball[3], high = RAISED * rest_distance(f->r, l->foot, l->toe);
    memcpy(rest, at + 3 * (size_t)l->foot, sizeof rest);
    if (height(f, toe) < height(f, rest)) rest[f->up] = toe[f->up];
    for (size_t i = 0; i < f->n; i++) {
        point_at(f->r, l->foot, rest, f->transforms[i], heel);
        joint_at(f->r, l->toe, f->transforms[i], ball);
        if (height(f, heel) > height(f, ball) + high) f->stands[i] = false;
    }
}

/* ---- target of the foot ---- */

/* A contact from pose i to end. If the foot is held already, the joint keeps its position; otherwise it is held at
 * its mean position. */
static void hold_stand(const feet *f, leg *l, size_t i, size_t end)
{
    double place[3] = {0, 0, 0};
    size_t first = i;
    while (first < end && !l->known[first]) first++;
    for (int k = 0; k < 3; k++) {
        for (size_t p = i; p < end; p++) place[k] += f->path[3 * p + (size_t)k] / (double)(end - i);
        if (first < end) place[k] = f->path[3 * first + (size_t)k] + l->shift[3 * first + (size_t)k];
    }
    for (size_t p = i; p < end; p++) {
        if (l->known[p]) continue;
        l->known[p] = true;
        vgi_subtract(place, f->path + 3 * p, l->shift + 3 * p);
    }
}

static void hold_joint(feet *f, leg *l, uint32_t joint)
{
    if (joint == NONE) return;
    find_stands(f, joint, l->length[0] + l->length[1]);
    if (joint == l->foot && l->toe != NONE) lift_heels(f, l);
    drop_short_stands(f);
    for (size_t i = 0, end; i < f->n; i = end + 1) {
        for (end = i; end < f->n && f->stands[end]; end++) {}
        if (end > i) hold_stand(f, l, i, end);
    }
}

/* Interpolate smoothly between the held poses a and b. */
static void fill_between(leg *l, size_t a, size_t b)
{
    for (size_t p = a + 1; p < b; p++) {
        double t = (double)(p - a) / (double)(b - a), s = t * t * (3 - 2 * t);
        for (size_t k = 0; k < 3; k++)
            l->shift[3 * p + k] = (1 - s) * l->shift[3 * a + k] + s * l->shift[3 * b + k];
    }
}

static void fill_shifts(const feet *f, leg *l)
{
    size_t last = f->n;
    for (size_t p = 0; p < f->n; p++) {
        if (!l->known[p]) continue;
        if (last < f->n) fill_between(l, last, p);
        for (size_t q = 0; last == f->n && q < p; q++) memcpy(l->shift + 3 * q, l->shift + 3 * p, 3 * sizeof(double));
        last = p;
    }
    for (size_t q = last + 1; last < f->n && q < f->n; q++)
        memcpy(l->shift + 3 * q, l->shift + 3 * last, 3 * sizeof(double));
}

/* ---- the body goes down where a leg is too short ---- */

static double lower_by(const feet *f, const leg *l, size_t p)
{
    double hip[3], foot[3], d[3], flat = 0, reach = STRETCH * (l->length[0] + l->length[1]);
    joint_at(f->r, l->thigh, f->transforms[p], hip);
    joint_at(f->r, l->foot, f->transforms[p], foot);
    vgi_subtract(hip, foot, d), vgi_deduct(d, l->shift + 3 * p);
    for (int k = 0; k < 3; k++) flat += k == f->up ? 0 : d[k] * d[k];
    double now = vgi_length(d);
    if (!(now > reach) || !(flat < reach * reach)) return 0;
    return fabs(d[f->up]) - sqrt(reach * reach - flat);
}

/* A smooth curve above what the legs need: the running maximum, then its running mean. */
static void lower_body(feet *f)
{
    enum { NEAR = 4 };
    double *need = f->lower + f->n, *most = f->speed;
    for (size_t p = 0; p < f->n; p++)
        for (size_t i = 0; i < f->nlegs; i++)
            if (f->legs[i].known[p]) need[p] = fmax(need[p], lower_by(f, &f->legs[i], p));
    for (size_t p = 0; p < f->n; p++) {
        most[p] = 0;
        for (size_t q = p < NEAR ? 0 : p - NEAR; q <= p + NEAR && q < f->n; q++) most[p] = fmax(most[p], need[q]);
    }
    for (size_t p = 0; p < f->n; p++) {
        double sum = 0;
        size_t n = 0;
        for (size_t q = p < NEAR ? 0 : p - NEAR; q <= p + NEAR && q < f->n; q++, n++) sum += most[q];
        f->lower[p] = sum / (double)n;
    }
}

/* ---- bending ---- */

/* Rotate a bone's transform by q and move the point `from` to `to`. */
static void move_bone(double *t, const double q[4], const double from[3], const double to[3])
{
    double d[3], turned[3];
    vgi_subtract(t + 4, from, d);
    vg_quat_apply(q, d, turned);
    vgi_sum(turned, to, t + 4);
    vg_quat_multiply(q, t, t);
}

/* Position of the knee for a foot at `foot`, which is first moved within reach of the leg. The knee stays on the side
 * to which it bends; for a straight leg `forward` decides. */
static void place_knee(const leg *l, const double hip[3], const double knee[3], const double before[3],
                       const double forward[3], double foot[3], double now[3])
{
    double a = l->length[0], b = l->length[1], u[3], old[3], q[4], thigh[3], side[3];
    vgi_subtract(foot, hip, u), vgi_subtract(before, hip, old), vgi_subtract(knee, hip, thigh);
    double d = vgi_length(u), reach = fmin(fmax(d, fabs(a - b) / STRETCH), STRETCH * (a + b));
    vgi_turn_between(old, u, q);
    vg_quat_apply(q, thigh, side);
    vgi_divide(u, d);
    memcpy(foot, hip, 3 * sizeof *foot), vgi_add_scaled(foot, reach, u);
    for (int pass = 0; pass < 2; pass++) { /* perpendicular to the leg: the thigh, or `forward` for a straight leg */
        double along = vgi_dot(side, u);
        vgi_add_scaled(side, -along, u);
        if (vgi_length(side) > 1e-3 * a) break;
        memcpy(side, forward, sizeof side);
    }
    double x = (a * a - b * b + reach * reach) / (2 * reach), y = sqrt(fmax(a * a - x * x, 0)), size = vgi_length(side);
    for (int k = 0; k < 3; k++) now[k] = hip[k] + x * u[k] + (size > 0 ? y * side[k] / size : 0);
}

static void bend_leg(const feet *f, const leg *l, size_t p)
{
    double *t = f->transforms[p], hip[3], knee[3], foot[3], to[3], now[3], forward[3] = {0}, q[2][4], was[3], is[3];
    joint_at(f->r, l->thigh, t, hip);
    joint_at(f->r, l->shin, t, knee);
    joint_at(f->r, l->foot, t, foot);
    if (f->up == 2) forward[1] = -1; /* characters with z up usually face -y */
    else forward[2] = 1;
    if (l->toe != NONE) {
        joint_at(f->r, l->toe, t, forward);
        vgi_deduct(forward, foot);
    }
    vgi_sum(foot, l->shift + 3 * p, to);
    to[f->up] += f->sign * f->lower[p]; /* the body was lowered, the foot stays */
    double away[3] = {to[0] - hip[0], to[1] - hip[1], to[2] - hip[2]};
    if (!(vgi_length(away) > 0)) return;
    place_knee(l, hip, knee, foot, forward, to, now);
    vgi_subtract(knee, hip, was), vgi_subtract(now, hip, is);
    vgi_turn_between(was, is, q[0]);
    vgi_subtract(foot, knee, was), vgi_subtract(to, now, is);
    vgi_turn_between(was, is, q[1]);
    for (size_t b = 0; b < f->r->nbones; b++) {
        if (l->group[b] == THIGH) move_bone(t + 7 * b, q[0], hip, hip);
        if (l->group[b] == SHIN) move_bone(t + 7 * b, q[1], foot, to);
        for (int k = 0; k < 3 && l->group[b] == FOOT; k++) t[7 * b + 4 + (size_t)k] += to[k] - foot[k];
    }
}

static void move_pose(const feet *f, size_t p)
{
    for (size_t b = 0; b < f->r->nbones; b++) f->transforms[p][7 * b + 4 + (size_t)f->up] -= f->sign * f->lower[p];
    for (size_t i = 0; i < f->nlegs; i++) bend_leg(f, &f->legs[i], p);
}

int vg_feet_hold(const vg_rig *g, size_t n, double *const *transforms, vg_err *e)
{
    feet f = {.r = g, .n = n, .transforms = transforms};
    int r = prepare_feet(&f, e);
    for (size_t i = 0; r == VG_OK && i < f.nlegs; i++) {
        hold_joint(&f, &f.legs[i], f.legs[i].toe);
        hold_joint(&f, &f.legs[i], f.legs[i].foot);
        fill_shifts(&f, &f.legs[i]);
    }
    if (r == VG_OK) lower_body(&f);
    for (size_t p = 0; r == VG_OK && p < n; p++) move_pose(&f, p);
    for (size_t i = 0; i < 2; i++) {
        free(f.legs[i].group);
        free(f.legs[i].shift);
        free(f.legs[i].known);
    }
    free(f.path);
    free(f.stands);
    free(f.speed);
    free(f.lower);
    return r;
}
