/* skeleton.c: a skeleton as a mesh of bones; its pose from channel values (forward kinematics), and channel values
 * from a pose (inverse kinematics). The file format is in bvh.c, the deformation of bones in deform.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"
#include "numeric/vec3.h"
#include "numeric/polar.h"

#include <math.h>
#include <stdlib.h>

static const uint32_t NONE = UINT32_MAX;
static const double DEGREE = 0.017453292519943295769;

static bool is_rotation(uint8_t channel)
{
    return channel >= 4;
}

size_t vg_skeleton_channels(const vg_skeleton *s)
{
    size_t n = 0;
    for (size_t j = 0; j < s->njoints; j++) n += s->joints[j].nchannels;
    return n;
}

int vg_skeleton_mesh(const vg_skeleton *s, vg_mesh *m, vg_err *e)
{
    *m = (vg_mesh){0};
    size_t bones = 0;
    for (size_t j = 0; j < s->njoints; j++) bones += s->joints[j].parent != NONE;
    m->start = vgi_array_raw(bones + 1, sizeof *m->start, e);
    m->vert = vgi_array_raw(bones, 2 * sizeof *m->vert, e);
    if (!m->start || !m->vert) {
        vg_mesh_clear(m);
        return VG_ENOMEM;
    }
    m->nv = s->njoints, m->nf = bones;
    uint32_t at = 0;
    for (size_t j = 0; j < s->njoints; j++) {
        if (s->joints[j].parent == NONE) continue;
        m->start[at / 2] = at;
        m->vert[at++] = s->joints[j].parent;
        m->vert[at++] = (uint32_t)j;
    }
    m->start[bones] = at;
    return VG_OK;
}

/* ---- forward kinematics ---- */

static void copy_turn(const double from[4], double to[4])
{
    memcpy(to, from, 4 * sizeof *to);
}

/* Multiply q by a rotation of `degrees` about axis k, on the right. */
static void turn_on(double q[4], int k, double degrees)
{
    double half = fmod(degrees, 720) * (DEGREE / 2), r[4] = {cos(half), 0, 0, 0};
    r[k + 1] = sin(half);
    vg_quat_multiply(q, r, q);
}

/* Position and rotation of joint j from those of its parent and its channel values. */
static void place_joint(const vg_skeleton *s, size_t j, const double *values, double *positions, double *turns)
{
    const vg_joint *joint = &s->joints[j];
    double offset[3], local[4] = {1, 0, 0, 0};
    memcpy(offset, joint->offset, sizeof offset);
    for (uint32_t i = 0; values && i < joint->nchannels; i++) {
        uint8_t c = joint->channels[i];
        if (is_rotation(c)) turn_on(local, c - 4, values[i]);
        else offset[c - 1] = values[i];
    }
    if (joint->parent == NONE) {
        memcpy(positions + 3 * j, offset, sizeof offset);
        copy_turn(local, turns + 4 * j);
        return;
    }
    const double *parent = turns + 4 * (size_t)joint->parent;
    vg_quat_multiply(parent, local, turns + 4 * j);
    vg_quat_apply(parent, offset, positions + 3 * j);
    vgi_add(positions + 3 * j, positions + 3 * (size_t)joint->parent);
}

void vg_skeleton_pose(const vg_skeleton *s, const double *values, double *positions, double *turns)
{
    for (size_t j = 0; j < s->njoints; j++) {
        place_joint(s, j, values, positions, turns);
        if (values) values += s->joints[j].nchannels;
    }
}

/* ---- the best rotation for several directions ---- */

/* k: the sum of d o^T over directions o of the reference and d of the pose, divided by the sum of |o|^2. What k
 * leaves undetermined (all directions on one line), or determines less precisely than its own misfit, stays as in
 * q_before. Each step pulls towards the last result, so that a well-determined rotation still ends at its optimum. */
static void fit_turn(const double k[9], const double q_before[4], double q[4])
{
    double m[9], agreement = 0, prior[4];
    copy_turn(q_before, prior);
    vgi_best_turn_near(k, 1e-9, prior, q);
    vg_quat_matrix(q, m);
    for (int i = 0; i < 9; i++) agreement += m[i] * k[i];
    double weight = 1e-9 + fmax(0, 2 * (1 - agreement));
    for (int step = 0; step < 3; step++) vgi_best_turn_near(k, weight, step ? q : prior, q);
}

/* ---- Euler angles from a rotation ---- */

/* Angle in degrees, shifted by whole turns to be nearest to that of the previous pose. */
static double near_to(double degrees, double before)
{
    return degrees + 360 * nearbyint((before - degrees) / 360);
}

/* Three different axes, or the first and third equal: such angles exist for every rotation. */
static bool is_euler(const int axis[6], uint32_t n)
{
    return n == 3 && axis[0] != axis[1] && axis[1] != axis[2];
}

/* m = R_i(a) R_j(b) R_k(c) with three different axes: 3 angles in radians. Returns false if a and c rotate about the
 * same line (gimbal lock); then only b is determined. */
static bool angles_of_three(const double m[9], int i, int j, int k, double angle[3])
{
    double s = (j - i + 3) % 3 == 1 ? 1 : -1; /* even or odd order of axes */
    double cosine = hypot(m[4 * i], m[3 * i + j]);
    angle[1] = atan2(s * m[3 * i + k], cosine);
    angle[0] = atan2(-s * m[3 * j + k], m[4 * k]);
    angle[2] = atan2(-s * m[3 * i + j], m[4 * i]);
    return cosine > 1e-7;
}

/* The same for R_i(a) R_j(b) R_i(c); l is the third axis. */
static bool angles_of_two(const double m[9], int i, int j, int l, double angle[3])
{
    double s = (j - i + 3) % 3 == 1 ? 1 : -1;
    double sine = hypot(m[3 * i + j], m[3 * i + l]);
    angle[1] = atan2(sine, m[4 * i]);
    angle[0] = atan2(m[3 * j + i], -s * m[3 * l + i]);
    angle[2] = atan2(m[3 * i + j], s * m[3 * i + l]);
    return sine > 1e-7;
}

/* The angle of a rotation about axis k. */
static double angle_about(const double q[4], int k)
{
    return 2 * atan2(q[k + 1], q[0]) / DEGREE;
}

static void conjugate(const double q[4], double c[4])
{
    c[0] = q[0], c[1] = -q[1], c[2] = -q[2], c[3] = -q[3];
}

/* Degrees of the three rotations whose product is q: among the two solutions and all whole turns, those nearest to
 * the previous angles, which they replace. */
static void euler_angles(const double q[4], const int axis[3], double *angles)
{
    double m[9], a[2][3], distance[2] = {0, 0};
    bool two = axis[0] == axis[2];
    vg_quat_matrix(q, m);
    bool free = two ? angles_of_two(m, axis[0], axis[1], 3 - axis[0] - axis[1], a[0])
                    : angles_of_three(m, axis[0], axis[1], axis[2], a[0]);
    if (!free) { /* gimbal lock: keep the first angle and assign the rest to the third */
        double done[4] = {1, 0, 0, 0}, back[4], rest[4];
        angles[1] = near_to(a[0][1] / DEGREE, angles[1]);
        turn_on(done, axis[0], angles[0]);
        turn_on(done, axis[1], angles[1]);
        conjugate(done, back);
        vg_quat_multiply(back, q, rest);
        angles[2] = near_to(angle_about(rest, axis[2]), angles[2]);
        return;
    }
    a[1][0] = a[0][0] + M_PI, a[1][1] = two ? -a[0][1] : M_PI - a[0][1], a[1][2] = a[0][2] + M_PI;
    for (int way = 0; way < 2; way++) {
        for (int i = 0; i < 3; i++) {
            a[way][i] = near_to(a[way][i] / DEGREE, angles[i]);
            distance[way] += fabs(a[way][i] - angles[i]);
        }
    }
    memcpy(angles, a[distance[1] < distance[0]], 3 * sizeof *angles);
}

static void transpose3(double m[9])
{
    double t;
    t = m[1], m[1] = m[3], m[3] = t;
    t = m[2], m[2] = m[6], m[6] = t;
    t = m[5], m[5] = m[7], m[7] = t;
}

static void matrix_of(const int *axis, const double *angles, uint32_t n, double m[9])
{
    double q[4] = {1, 0, 0, 0};
    for (uint32_t i = 0; i < n; i++) turn_on(q, axis[i], angles[i]);
    vg_quat_matrix(q, m);
}

/* For rotations that cannot reach every orientation (a hinge joint), or reach it in many ways: set each angle in turn
 * to the maximum of tr(R^T k), starting from the previous angles, until nothing changes. */
static void climb_to_angles(const double k[9], const int *axis, uint32_t n, double *angles)
{
    for (int round = 0; round < 200; round++) {
        double most = 0;
        for (uint32_t i = 0; i < n; i++) {
            double before[9], behind[9], g[9];
            matrix_of(axis, angles, i, before);
            matrix_of(axis + i + 1, angles + i + 1, n - i - 1, behind);
            transpose3(before);
            transpose3(behind);
            vgi_multiply(before, k, g);
            vgi_multiply(g, behind, g);
            int u = (axis[i] + 1) % 3, v = (axis[i] + 2) % 3;
            double sine = g[3 * v + u] - g[3 * u + v], cosine = g[4 * u] + g[4 * v];
            if (!(hypot(sine, cosine) > 1e-12)) continue;
            double angle = near_to(atan2(sine, cosine) / DEGREE, angles[i]);
            most = fmax(most, fabs(angle - angles[i]));
            angles[i] = angle;
        }
        if (!(most > 1e-10)) break;
    }
}

/* ---- channel values from a pose ---- */

/* An arm: a joint that rotates with another and lies away from it (a child, or one behind joints at the same
 * position). An arm is loose if a joint in between may rotate it independently. */
typedef struct arm {
    uint32_t joint;
    bool loose;
    double offset[3];
} arm;

struct vg_joint_fitter {
    const vg_skeleton *s;
    size_t *first_arm; /* njoints + 1 */
    arm *arms;
    double *values; /* of the previous pose */
    double *positions, *turns; /* of the joints, from these values */
};

enum { MOST_STEPS = 16 }; /* up a chain of joints at one position */

/* List the joints that have joint c among their arms, at most MOST_STEPS, in `owners`. */
static size_t list_owners(const vg_skeleton *s, size_t c, double shortest, uint32_t owners[MOST_STEPS])
{
    size_t n = 0;
    if (s->joints[c].parent == NONE || !(vgi_length(s->joints[c].offset) > shortest)) return 0;
    for (uint32_t a = s->joints[c].parent; a != NONE && n < MOST_STEPS; a = s->joints[a].parent) {
        owners[n++] = a;
        if (vgi_length(s->joints[a].offset) > shortest) break;
    }
    return n;
}

static bool has_rotations(const vg_joint *j)
{
    for (uint32_t i = 0; i < j->nchannels; i++)
        if (is_rotation(j->channels[i])) return true;
    return false;
}

static int list_arms(vg_joint_fitter *f, double shortest, vg_err *e)
{
    const vg_skeleton *s = f->s;
    uint32_t owners[MOST_STEPS];
    for (size_t j = 0; j < s->njoints; j++)
        for (size_t i = list_owners(s, j, shortest, owners); i-- > 0;) f->first_arm[owners[i] + 1]++;
    for (size_t j = 0; j < s->njoints; j++) f->first_arm[j + 1] += f->first_arm[j];
    if (!(f->arms = vgi_array_raw(f->first_arm[s->njoints], sizeof *f->arms, e))) return VG_ENOMEM;
    size_t *next = vgi_copy_array(f->first_arm, s->njoints, sizeof *next, e);
    if (!next) return VG_ENOMEM;
    for (size_t j = 0; j < s->njoints; j++) {
        size_t n = list_owners(s, j, shortest, owners);
        bool loose = false;
        for (size_t i = 0; i < n; i++) {
            arm *a = &f->arms[next[owners[i]]++];
            *a = (arm){.joint = (uint32_t)j, .loose = loose};
            memcpy(a->offset, s->joints[j].offset, sizeof a->offset);
            loose = loose || has_rotations(&s->joints[owners[i]]);
        }
    }
    free(next);
    return VG_OK;
}

int vg_joint_fitter_new(vg_joint_fitter **out, const vg_skeleton *s, vg_err *e)
{
    vg_joint_fitter *f = *out = vgi_array(1, sizeof *f, e);
    if (!f) return VG_ENOMEM;
    f->s = s;
    f->first_arm = vgi_array(s->njoints + 1, sizeof *f->first_arm, e);
    f->values = vgi_array(vg_skeleton_channels(s), sizeof *f->values, e);
    f->positions = vgi_array(s->njoints, 3 * sizeof *f->positions, e);
    f->turns = vgi_array(s->njoints, 4 * sizeof *f->turns, e);
    int r = f->first_arm && f->values && f->positions && f->turns ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) {
        vg_skeleton_pose(s, NULL, f->positions, f->turns);
        r = list_arms(f, 1e-6 * vg_diagonal(f->positions, s->njoints), e);
    }
    if (r < 0) vg_joint_fitter_free(out);
    return r;
}

void vg_joint_fitter_free(vg_joint_fitter **fitter)
{
    vg_joint_fitter *f = *fitter;
    if (!f) return;
    free(f->first_arm);
    free(f->arms);
    free(f->values);
    free(f->positions);
    free(f->turns);
    free(f);
    *fitter = NULL;
}

/* Contribution of the arms of joint j (all, or the firm ones) to its rotation: k as in fit_turn, the number of arms
 * that contribute, and the last of them. */
static size_t gather_arms(const vg_joint_fitter *f, size_t j, const double *pose, bool firm, double k[9],
                          double offset[3], double now[3])
{
    size_t n = 0;
    double total = 0;
    memset(k, 0, 9 * sizeof *k);
    for (size_t i = f->first_arm[j]; i < f->first_arm[j + 1]; i++) {
        const arm *a = &f->arms[i];
        double d[3], l = vgi_length(a->offset), dl;
        vgi_subtract(pose + 3 * (size_t)a->joint, pose + 3 * j, d);
        if ((firm && a->loose) || !((dl = vgi_length(d)) > 1e-9 * l)) continue;
        for (int x = 0; x < 3; x++)
            vgi_add_scaled(k + 3 * x, l * d[x] / dl, a->offset);
        total += l * l;
        n++;
        memcpy(offset, a->offset, 3 * sizeof *offset);
        memcpy(now, d, sizeof d);
    }
    for (int i = 0; n && i < 9; i++) k[i] /= total;
    return n;
}

/* Improve the first guess q to the rotation that fits the arms, keeping what they leave undetermined. */
static void turn_by_arms(const vg_joint_fitter *f, size_t j, const double *pose, bool firm, double k[9], double q[4])
{
    double offset[3], now[3], swing[4], carried[3];
    size_t n = gather_arms(f, j, pose, firm, k, offset, now);
    if (n > 1) {
        fit_turn(k, q, q);
    } else if (n == 1) { /* one direction: no rotation about it */
        vg_quat_apply(q, offset, carried);
        vg_quat_between(carried, now, swing);
        vg_quat_multiply(swing, q, q);
    }
    double l = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int i = 0; i < 4; i++) q[i] /= l;
}

/* The rotation of joint j, whose parent is rotated by `parent`. Loose arms can also reach their position by a
 * rotation of the joint between, so they only decide what the firm ones leave undetermined. k: of the firm arms. */
static void turn_joint(const vg_joint_fitter *f, size_t j, const double *pose, const double parent[4], double k[9],
                       double q[4])
{
    bool loose = false;
    for (size_t i = f->first_arm[j]; i < f->first_arm[j + 1]; i++) loose = loose || f->arms[i].loose;
    copy_turn(parent, q);
    if (loose) turn_by_arms(f, j, pose, false, k, q);
    turn_by_arms(f, j, pose, true, k, q);
}

/* Angles of joint j's rotations, starting from the previous ones. turn: the rotation of the joint, or NULL to find
 * it. */
static void fit_angles(const vg_joint_fitter *f, size_t j, const double *pose, const double *turn, double *values)
{
    static const double unturned[4] = {1, 0, 0, 0};
    const vg_joint *joint = &f->s->joints[j];
    int axis[6];
    double angles[6], k[9] = {0}, q[4], back[4], local[4];
    uint32_t n = 0, place[6];
    for (uint32_t i = 0; i < joint->nchannels; i++)
        if (is_rotation(joint->channels[i])) axis[n] = joint->channels[i] - 4, angles[n] = values[i], place[n++] = i;
    if (n == 0) return;
    const double *parent = joint->parent == NONE ? unturned : f->turns + 4 * (size_t)joint->parent;
    if (turn) copy_turn(turn, q);
    else turn_joint(f, j, pose, parent, k, q);
    conjugate(parent, back);
    vg_quat_multiply(back, q, local);
    if (is_euler(axis, n)) {
        euler_angles(local, axis, angles);
    } else {
        double m[9], wish[9];
        vg_quat_matrix(back, m);
        vgi_multiply(m, k, k);
        vg_quat_matrix(local, wish); /* decides what the directions leave undetermined */
        for (int i = 0; i < 9; i++) k[i] += (turn ? 1 : 1e-6) * wish[i];
        climb_to_angles(k, axis, n, angles);
    }
    for (uint32_t i = 0; i < n; i++) values[place[i]] = angles[i];
}

/* Position of joint j from its channels, in its parent's frame. */
static void fit_offset(const vg_joint_fitter *f, size_t j, const double *pose, double *values)
{
    const vg_joint *joint = &f->s->joints[j];
    double d[3], local[3];
    memcpy(local, pose + 3 * j, sizeof local);
    if (joint->parent != NONE) {
        double back[4];
        vgi_subtract(pose + 3 * j, f->positions + 3 * (size_t)joint->parent, d);
        conjugate(f->turns + 4 * (size_t)joint->parent, back);
        vg_quat_apply(back, d, local);
    }
    for (uint32_t i = 0; i < joint->nchannels; i++)
        if (!is_rotation(joint->channels[i])) values[i] = local[joint->channels[i] - 1];
}

double vg_joint_fitter_fit(vg_joint_fitter *f, const double *pose, const double *turns, double *out, size_t *joint)
{
    double most = 0, *values = f->values;
    *joint = 0;
    for (size_t j = 0; j < f->s->njoints; j++) {
        double d[3];
        fit_angles(f, j, pose, turns ? turns + 4 * j : NULL, values);
        fit_offset(f, j, pose, values);
        place_joint(f->s, j, values, f->positions, f->turns);
        vgi_subtract(f->positions + 3 * j, pose + 3 * j, d);
        if (vgi_length(d) > most) most = vgi_length(d), *joint = j;
        values += f->s->joints[j].nchannels;
    }
    if (out) memcpy(out, f->values, (size_t)(values - f->values) * sizeof *out);
    return most;
}

const double *vg_joint_fitter_turns(const vg_joint_fitter *f)
{
    return f->turns;
}
