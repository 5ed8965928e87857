/* turn.c: the rotation that best fits pairs of vectors. Rotations of single vectors are in rotation.c, the faster
 * polar decomposition in polar.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"
#include "numeric/turn.h"

#include <math.h>

/* The unit eigenvector of the largest eigenvalue of a symmetric matrix, by cyclic Jacobi rotations. a is
 * overwritten. */
static void largest_eigenvector(double a[4][4], double x[4])
{
    double v[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
    for (int sweep = 0; sweep < 32; sweep++) {
        double off = 0, on = 0;
        for (int p = 0; p < 4; p++)
            for (int q = 0; q < 4; q++) *(p == q ? &on : &off) += a[p][q] * a[p][q];
        if (!(off > 1e-36 * on)) break;
        for (int p = 0; p < 3; p++) {
            for (int q = p + 1; q < 4; q++) {
                if (fabs(a[p][q]) <= 1e-19 * (fabs(a[p][p]) + fabs(a[q][q]))) {
                    a[p][q] = a[q][p] = 0; /* below the last bit of its neighbours */
                    continue;
                }
                double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                double t = copysign(1, theta) / (fabs(theta) + sqrt(theta * theta + 1));
                double c = 1 / sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < 4; k++) {
                    double kp = a[k][p], kq = a[k][q];
                    a[k][p] = c * kp - s * kq, a[k][q] = s * kp + c * kq;
                }
                for (int k = 0; k < 4; k++) {
                    double pk = a[p][k], qk = a[q][k], vp = v[k][p], vq = v[k][q];
                    a[p][k] = c * pk - s * qk, a[q][k] = s * pk + c * qk;
                    v[k][p] = c * vp - s * vq, v[k][q] = s * vp + c * vq;
                }
                a[p][q] = a[q][p] = 0;
            }
        }
    }
    int best = 0;
    for (int k = 1; k < 4; k++)
        if (a[k][k] > a[best][best]) best = k;
    for (int k = 0; k < 4; k++) x[k] = v[k][best];
}

/* Davenport's q-method. */
void vgi_best_turn(const double b[9], double q[4])
{
    double xx = b[0], yy = b[4], zz = b[8];
    double yz = b[7] - b[5], zx = b[2] - b[6], xy = b[3] - b[1];
    double sxy = b[1] + b[3], szx = b[2] + b[6], syz = b[5] + b[7];
    double n[4][4] = {{xx + yy + zz, yz, zx, xy},
                      {yz, xx - yy - zz, sxy, szx},
                      {zx, sxy, yy - xx - zz, syz},
                      {xy, szx, syz, zz - xx - yy}};
    largest_eigenvector(n, q);
}

void vgi_best_turn_near(const double b[9], double weight, const double prior[4], double q[4])
{
    double m[9];
    vg_quat_matrix(prior, m);
    for (int i = 0; i < 9; i++) m[i] = b[i] + weight * m[i];
    vgi_best_turn(m, q);
}

void vgi_turn_between(const double a[3], const double b[3], double q[4])
{
    vg_quat_between(a, b, q);
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int k = 0; k < 4; k++) q[k] /= length;
}
