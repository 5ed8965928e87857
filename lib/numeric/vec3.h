/* vec3.h: vectors of three numbers, 3 x 3 matrices, row-major, and the inner product.
 * Internal. Quaternions are in vg.h, eight poses side by side in lanes.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_VEC3_H
#define VG_VEC3_H

#include <math.h>
#include <stddef.h>
#include <string.h>

/* Written without loops, which gcc's analyser reads wrongly. */
static inline void vgi_subtract(const double a[3], const double b[3], double d[3]) /* d = a - b */
{
    d[0] = a[0] - b[0], d[1] = a[1] - b[1], d[2] = a[2] - b[2];
}
static inline void vgi_sum(const double a[3], const double b[3], double s[3])
{
    s[0] = a[0] + b[0], s[1] = a[1] + b[1], s[2] = a[2] + b[2];
}
static inline void vgi_add(double x[3], const double y[3]) /* x += y */
{
    x[0] += y[0], x[1] += y[1], x[2] += y[2];
}
static inline void vgi_deduct(double x[3], const double y[3]) /* x -= y */
{
    x[0] -= y[0], x[1] -= y[1], x[2] -= y[2];
}
static inline void vgi_add_scaled(double x[3], double s, const double y[3]) /* x += s y */
{
    x[0] += s * y[0], x[1] += s * y[1], x[2] += s * y[2];
}
static inline void vgi_scale(double x[3], double s)
{
    x[0] *= s, x[1] *= s, x[2] *= s;
}
static inline void vgi_scaled(double s, const double x[3], double y[3]) /* y = s x */
{
    y[0] = s * x[0], y[1] = s * x[1], y[2] = s * x[2];
}
static inline void vgi_divide(double x[3], double s)
{
    x[0] /= s, x[1] /= s, x[2] /= s;
}
static inline void vgi_divided(const double x[3], double s, double y[3]) /* y = x / s */
{
    y[0] = x[0] / s, y[1] = x[1] / s, y[2] = x[2] / s;
}
static inline void vgi_mix(const double a[3], const double b[3], double t, double c[3]) /* c = a + t (b - a) */
{
    c[0] = a[0] + t * (b[0] - a[0]), c[1] = a[1] + t * (b[1] - a[1]), c[2] = a[2] + t * (b[2] - a[2]);
}
static inline double vgi_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
static inline double vgi_inner(const double *a, const double *b, size_t n) /* the same for n numbers, in order */
{
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += a[i] * b[i];
    return sum;
}
static inline double vgi_length(const double a[3])
{
    return sqrt(vgi_dot(a, a));
}
static inline double vgi_make_unit(double x[3]) /* 0 stays 0; returns the original length */
{
    double length = vgi_length(x);
    if (length > 0) vgi_divide(x, length);
    else x[0] = x[1] = x[2] = 0;
    return length;
}
static inline double vgi_square(const double a[3], const double b[3]) /* squared distance */
{
    double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}
static inline void vgi_cross(const double a[3], const double b[3], double c[3])
{
    double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    c[0] = x, c[1] = y, c[2] = z;
}
/* Newell's formula: the sum of the cross products of r successive vectors: twice the area of the face, along its
 * normal. */
static inline void vgi_area_vector(const double *w, size_t r, double n[3])
{
    n[0] = n[1] = n[2] = 0;
    for (size_t i = 0; i < r; i++) {
        double part[3];
        vgi_cross(w + 3 * i, w + 3 * (i + 1 < r ? i + 1 : 0), part);
        vgi_add(n, part);
    }
}

static inline void vgi_multiply(const double a[9], const double b[9], double ab[9])
{
    double c[9];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            c[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
    memcpy(ab, c, sizeof c);
}
static inline void vgi_multiply_vector(const double m[9], const double x[3], double y[3])
{
    double a = vgi_dot(m, x), b = vgi_dot(m + 3, x), c = vgi_dot(m + 6, x);
    y[0] = a, y[1] = b, y[2] = c;
}
static inline void vgi_transposed_vector(const double m[9], const double x[3], double y[3]) /* y = m' x */
{
    double a = m[0] * x[0] + m[3] * x[1] + m[6] * x[2], b = m[1] * x[0] + m[4] * x[1] + m[7] * x[2],
           c = m[2] * x[0] + m[5] * x[1] + m[8] * x[2];
    y[0] = a, y[1] = b, y[2] = c;
}
/* m += scale a b' */
static inline void vgi_add_outer(double m[9], double scale, const double a[3], const double b[3])
{
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) m[3 * i + k] += scale * a[i] * b[k];
}
static inline double vgi_cofactors(const double m[9], double c[9]) /* m^-1 = c' / det; returns det */
{
    c[0] = m[4] * m[8] - m[5] * m[7], c[1] = m[5] * m[6] - m[3] * m[8], c[2] = m[3] * m[7] - m[4] * m[6];
    c[3] = m[2] * m[7] - m[1] * m[8], c[4] = m[0] * m[8] - m[2] * m[6], c[5] = m[1] * m[6] - m[0] * m[7];
    c[6] = m[1] * m[5] - m[2] * m[4], c[7] = m[2] * m[3] - m[0] * m[5], c[8] = m[0] * m[4] - m[1] * m[3];
    return m[0] * c[0] + m[1] * c[1] + m[2] * c[2];
}

#endif
