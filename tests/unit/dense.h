/* dense.h: what tests of reconstruction compare with: the metric of a face as it is defined, and the solution of a
 * dense system. Leaves out energies: each test writes its own from the definition.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_TEST_DENSE_H
#define VG_TEST_DENSE_H

#include "meshes.h"

/* Gaussian elimination with row pivoting: a (n x n) and b (n x m) become the solution in b. */
static inline void eliminate(double *a, double *b, size_t n, size_t m)
{
    for (size_t k = 0; k < n; k++) {
        size_t p = k;
        for (size_t i = k + 1; i < n; i++)
            if (fabs(a[i * n + k]) > fabs(a[p * n + k])) p = i;
        for (size_t j = 0; j < n + m; j++) {
            double *x = j < n ? &a[k * n + j] : &b[k * m + j - n], *y = j < n ? &a[p * n + j] : &b[p * m + j - n];
            double t = *x;
            *x = *y, *y = t;
        }
        for (size_t i = k + 1; i < n; i++) {
            double f = a[i * n + k] / a[k * n + k];
            if (f == 0) continue;
            for (size_t j = k; j < n; j++) a[i * n + j] -= f * a[k * n + j];
            for (size_t j = 0; j < m; j++) b[i * m + j] -= f * b[k * m + j];
        }
    }
    for (size_t i = n; i-- > 0;)
        for (size_t j = 0; j < m; j++) {
            for (size_t k = i + 1; k < n; k++) b[i * m + j] -= a[i * n + k] * b[k * m + j];
            b[i * m + j] /= a[i * n + i];
        }
}

/* G of a face with VG_WEIGHTS_AREA, r x r: w (B B' + 2/p (I - 11'/r - B R)) with R the vectors in the face's plane,
 * C = R R', p its larger eigenvalue, B = R' C+, w its area. The smaller eigenvalue counts as p/4 at least, p/12 in a
 * triangle. */
static inline void face_metric(const double *vectors, size_t r, double *G)
{
    double n[3] = {0, 0, 0}, C[9] = {0};
    double *R = room(3 * r, sizeof *R), *B = room(3 * r, sizeof *B);
    for (size_t i = 0; i < r; i++)
        for (int k = 0; k < 3; k++) {
            const double *a = vectors + 3 * i, *b = vectors + 3 * ((i + 1) % r);
            n[k] += a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
        }
    double twice = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (size_t i = 0; i < r; i++) {
        double along = 0;
        for (size_t k = 0; k < 3; k++) along += vectors[3 * i + k] * n[k] / twice;
        for (size_t k = 0; k < 3; k++) R[3 * i + k] = vectors[3 * i + k] - along * n[k] / twice;
        for (size_t k = 0; k < 9; k++) C[k] += R[3 * i + k / 3] * R[3 * i + k % 3];
    }
    /* C has rank 2: in the plane P = I - nn' it is (p + q)/2 P + (p - q)/2 (uu' - vv'), with the eigenvalues p >= q */
    double half = (C[0] + C[4] + C[8]) / 2, spread = 0, plane[9], inverse[9];
    for (int k = 0; k < 9; k++) {
        plane[k] = (k % 4 == 0) - n[k / 3] * n[k % 3] / (twice * twice);
        spread += (C[k] - half * plane[k]) * (C[k] - half * plane[k]) / 2;
    }
    spread = sqrt(spread);
    double p = half + spread, q = fmax(half - spread, p / (r == 3 ? 12 : 4));
    for (int k = 0; k < 9; k++) {
        inverse[k] = (1 / p + 1 / q) / 2 * plane[k];
        if (spread > 0) inverse[k] += (1 / p - 1 / q) / 2 * (C[k] - half * plane[k]) / spread;
    }
    for (size_t i = 0; i < r; i++)
        for (size_t k = 0; k < 9; k++) B[3 * i + k / 3] += inverse[k] * R[3 * i + k % 3];
    for (size_t i = 0; i < r; i++)
        for (size_t j = 0; j < r; j++) {
            double sum = ((i == j) - 1.0 / (double)r) * 2 / p;
            for (size_t k = 0; k < 3; k++)
                sum += B[3 * i + k] * B[3 * j + k] - B[3 * i + k] * R[3 * j + k] * 2 / p;
            G[i * r + j] = twice / 2 * sum;
        }
    free(R);
    free(B);
}

#endif
