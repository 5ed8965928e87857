/* rotation.c: deformations of a vector as quaternions whose squared length is the scale (MATH 4; T 3.19). The
 * rotation of a corner is chosen in deform.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"
#include "numeric/vec3.h"

#include <math.h>

void vg_quat_multiply(const double a[4], const double b[4], double ab[4])
{
    double w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3];
    double x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
    double y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1];
    double z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
    ab[0] = w, ab[1] = x, ab[2] = y, ab[3] = z;
}

/* Q r Q* = (w^2 - u.u) r + 2 (u.r) u + 2 w (u x r) */
void vg_quat_apply(const double q[4], const double r[3], double d[3])
{
    double w = q[0], x = q[1], y = q[2], z = q[3];
    double s = w * w - x * x - y * y - z * z, t = 2 * (x * r[0] + y * r[1] + z * r[2]);
    double a = s * r[0] + t * x + 2 * w * (y * r[2] - z * r[1]);
    double b = s * r[1] + t * y + 2 * w * (z * r[0] - x * r[2]);
    double c = s * r[2] + t * z + 2 * w * (x * r[1] - y * r[0]);
    d[0] = a, d[1] = b, d[2] = c;
}

void vg_quat_matrix(const double q[4], double m[9])
{
    double w = q[0], x = q[1], y = q[2], z = q[3];
    m[0] = 1 - 2 * (y * y + z * z), m[1] = 2 * (x * y - w * z), m[2] = 2 * (x * z + w * y);
    m[3] = 2 * (x * y + w * z), m[4] = 1 - 2 * (x * x + z * z), m[5] = 2 * (y * z - w * x);
    m[6] = 2 * (x * z - w * y), m[7] = 2 * (y * z + w * x), m[8] = 1 - 2 * (x * x + y * y);
}

/* Shepperd (1978): start from the largest of the four squares, so that nothing cancels. */
void vg_quat_from_matrix(const double m[9], double q[4])
{
    double trace = m[0] + m[4] + m[8];
    int i = 0;
    double most = trace;
    for (int k = 0; k < 3; k++)
        if (m[4 * k] > most) most = m[4 * k], i = k + 1;
    if (i == 0) {
        q[0] = 1 + trace, q[1] = m[7] - m[5], q[2] = m[2] - m[6], q[3] = m[3] - m[1];
    } else if (i == 1) {
        q[0] = m[7] - m[5], q[1] = 1 + m[0] - m[4] - m[8], q[2] = m[1] + m[3], q[3] = m[2] + m[6];
    } else if (i == 2) {
        q[0] = m[2] - m[6], q[1] = m[1] + m[3], q[2] = 1 - m[0] + m[4] - m[8], q[3] = m[5] + m[7];
    } else {
        q[0] = m[3] - m[1], q[1] = m[2] + m[6], q[2] = m[5] + m[7], q[3] = 1 - m[0] - m[4] + m[8];
    }
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int k = 0; k < 4; k++) q[k] /= length;
}

/* log Q = ln|Q| + axis * angle, angle = atan2(|u|, w) in [0, pi]. Exact limits at u = 0: angle 0 for w > 0; for w < 0
 * the angle is pi about any axis: x. */
void vg_quat_log(const double q[4], double l[4])
{
    double u = sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]), w = q[0];
    double angle = atan2(u, w);
    l[0] = 0.5 * log(w * w + u * u);
    if (u > 0) {
        for (int k = 1; k < 4; k++) l[k] = q[k] * (angle / u);
    } else {
        l[1] = angle, l[2] = l[3] = 0;
    }
}

void vg_quat_exp(const double l[4], double q[4])
{
    double angle = sqrt(l[1] * l[1] + l[2] * l[2] + l[3] * l[3]), length = exp(l[0]);
    double ratio = angle > 0 ? sin(angle) / angle : 1; /* in double precision sin x / x is 1 long before x is 0 */
    q[0] = length * cos(angle);
    for (int k = 1; k < 4; k++) q[k] = length * ratio * l[k];
}

/* A unit vector perpendicular to the unit vector r, always chosen in the same way: also perpendicular to the axis of
 * r's smallest component. */
static void perpendicular(const double r[3], double p[3])
{
    int k = fabs(r[0]) <= fabs(r[1]) ? (fabs(r[0]) <= fabs(r[2]) ? 0 : 2) : (fabs(r[1]) <= fabs(r[2]) ? 1 : 2);
    double axis[3] = {k == 0, k == 1, k == 2};
    p[0] = r[1] * axis[2] - r[2] * axis[1];
    p[1] = r[2] * axis[0] - r[0] * axis[2];
    p[2] = r[0] * axis[1] - r[1] * axis[0];
    double length = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    vgi_divide(p, length);
}

/* With unit vectors r and d: q = (1 + r.d, r x d), normalised, is the half-angle quaternion of Rodrigues' rotation.
 * Near half a turn 1 + r.d cancels; |r + d|^2 / 2 is the same number without cancellation. */
void vg_quat_between(const double r_in[3], const double d_in[3], double q[4])
{
    double rl = sqrt(r_in[0] * r_in[0] + r_in[1] * r_in[1] + r_in[2] * r_in[2]);
    double dl = sqrt(d_in[0] * d_in[0] + d_in[1] * d_in[1] + d_in[2] * d_in[2]);
    double r[3], s[3], sum2 = 0;
    for (int k = 0; k < 3; k++) {
        r[k] = r_in[k] / rl, s[k] = r[k] + d_in[k] / dl;
        sum2 += s[k] * s[k];
    }
    q[0] = sum2 / 2;
    q[1] = r[1] * s[2] - r[2] * s[1], q[2] = r[2] * s[0] - r[0] * s[2], q[3] = r[0] * s[1] - r[1] * s[0];
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (length < 1e-12) { /* opposite: half a turn */
        q[0] = 0;
        perpendicular(r, q + 1);
        length = 1;
    }
    double scale = sqrt(dl / rl) / length;
    for (int k = 0; k < 4; k++) q[k] *= scale;
}
