/* polar.c: the rotation nearest to a matrix: Newton's iteration for the polar decomposition (Higham 1986) where it
 * converges to a rotation; otherwise, for flat, thin or orientation-reversing matrices, the largest eigenvector of a
 * 4 x 4 matrix (Davenport 1968, Horn 1987). Rotations of faces, eight poses at a time, are in polar_kernel.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/polar.h"
#include "numeric/face.h"

#include <math.h>
#include <stdlib.h>

/* ---- the best rotation, for any matrix ---- */

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
                    a[p][q] = a[q][p] = 0; /* smaller than the last bit of its neighbours */
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

/* ---- the nearest rotation, fast where possible ---- */

static const double thin = 1e-3; /* for a matrix of norm 1, smallest determinant for Newton's iteration */

static double squares(const double x[9])
{
    double s = 0;
    for (int i = 0; i < 9; i++) s += x[i] * x[i];
    return s;
}

static void newton(double x[9])
{
    enum { MOST = 30 };
    double change = 1;
    for (int step = 0; step < MOST && change > 1e-20; step++) {
        double c[9], det = vgi_cofactors(x, c), g = sqrt(sqrt(squares(c) / squares(x)) / det);
        change = 0;
        for (int i = 0; i < 9; i++) {
            double y = 0.5 * (g * x[i] + c[i] / (g * det));
            change += (y - x[i]) * (y - x[i]);
            x[i] = y;
        }
    }
}

/* For any m. Among several best rotations, the one with the smallest angle. */
static void best_rotation(const double m[9], double r[9])
{
    static const double little = 0.25e-12, unturned[4] = {1, 0, 0, 0};
    double q[4];
    vgi_best_turn_near(m, little, unturned, q);
    vg_quat_matrix(q, r);
}

void vgi_fit_rotation(const double m[9], double r[9])
{
    double size = sqrt(squares(m)), c[9];
    for (int i = 0; i < 9; i++) r[i] = i % 4 == 0;
    if (!(size > 0 && size < INFINITY)) return;
    double x[9];
    for (int i = 0; i < 9; i++) x[i] = m[i] / size;
    if (vgi_cofactors(x, c) > thin) {
        newton(x);
        memcpy(r, x, sizeof x);
    } else {
        best_rotation(x, r);
    }
}

/* ---- vectors ---- */

void vgi_turn_between(const double a[3], const double b[3], double q[4])
{
    vg_quat_between(a, b, q);
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int k = 0; k < 4; k++) q[k] /= length;
}

/* ---- faces ---- */

int vgi_turns_make(vgi_turns *t, size_t nf, const uint32_t *start, const uint32_t *vert, const double *reference,
                   vg_err *e)
{
    *t = (vgi_turns){.start = start, .vert = vert, .nf = nf};
    t->vector = vgi_array(3 * (size_t)start[nf], sizeof *t->vector, e);
    t->normal = vgi_array(3 * nf, sizeof *t->normal, e);
    if (!t->vector || !t->normal) return vgi_turns_clear(t), VG_ENOMEM;
    for (size_t f = 0; f < nf; f++) {
        size_t begin = start[f], r = start[f + 1] - begin;
        double *w = t->vector + 3 * begin, n[3], spread = 0;
        vgi_face_vectors(reference, vert + begin, r, w);
        for (size_t i = 0; i < 3 * r; i++) spread += w[i] * w[i];
        vgi_area_vector(w, r, n);
        double length = vgi_length(n);
        for (size_t k = 0; k < 3; k++)
            t->normal[3 * f + k] = length > 1e-12 * spread ? n[k] / length * (0.5 * spread) : 0;
    }
    return VG_OK;
}

void vgi_turns_clear(vgi_turns *t)
{
    free(t->vector);
    free(t->normal);
    *t = (vgi_turns){0};
}
