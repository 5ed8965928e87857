/* moments.c: normal and inverse second moments of a single face.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/moments.h"
#include "numeric/face.h"
#include "numeric/vec3.h"

#include <stdlib.h>

static const double flat = 1e-12; /* relative to the sum of squared lengths: see deform_kernel.c */

/* The area vector (twice the area along the normal). Returns its length, 0 if there is none. */
static double area_vector(const double *w, size_t r, double n[3])
{
    double spread = 0;
    vgi_area_vector(w, r, n);
    for (size_t i = 0; i < r; i++) spread += vgi_dot(w + 3 * i, w + 3 * i);
    double size = vgi_length(n);
    return size > flat * spread ? size : 0;
}

bool vgi_unit_normal(const double *w, size_t r, double n[3])
{
    double size = area_vector(w, r, n);
    if (size > 0) vgi_divide(n, size);
    return size > 0;
}

/* Returns false if the matrix is singular. */
static bool invert_symmetric(const double a[6], double inverse[6])
{
    double c0 = a[3] * a[5] - a[4] * a[4], c1 = a[2] * a[4] - a[1] * a[5], c2 = a[1] * a[4] - a[2] * a[3];
    double det = a[0] * c0 + a[1] * c1 + a[2] * c2, size = a[0] + a[3] + a[5];
    if (!(det > 1e-18 * size * size * size)) return false;
    inverse[0] = c0 / det, inverse[1] = c1 / det, inverse[2] = c2 / det;
    inverse[3] = (a[0] * a[5] - a[2] * a[2]) / det, inverse[4] = (a[1] * a[2] - a[0] * a[4]) / det;
    inverse[5] = (a[0] * a[3] - a[1] * a[1]) / det;
    return true;
}

void vgi_symmetric_times(const double a[6], const double x[3], double y[3])
{
    y[0] = a[0] * x[0] + a[1] * x[1] + a[2] * x[2];
    y[1] = a[1] * x[0] + a[3] * x[1] + a[4] * x[2];
    y[2] = a[2] * x[0] + a[4] * x[1] + a[5] * x[2];
}

bool vgi_gradient_moments(const double *w, size_t r, double P[6], double q[3], double *size)
{
    double sum[6] = {0, 0, 0, 0, 0, 0}, n[3];
    for (size_t i = 0; i < r; i++) {
        const double *v = w + 3 * i;
        sum[0] += v[0] * v[0], sum[1] += v[0] * v[1], sum[2] += v[0] * v[2];
        sum[3] += v[1] * v[1], sum[4] += v[1] * v[2], sum[5] += v[2] * v[2];
    }
    *size = area_vector(w, r, n);
    if (!(*size > 0)) return false;
    vgi_divide(n, *size);
    double h = (sum[0] + sum[3] + sum[5]) / 2;
    sum[0] += h * n[0] * n[0], sum[1] += h * n[0] * n[1], sum[2] += h * n[0] * n[2];
    sum[3] += h * n[1] * n[1], sum[4] += h * n[1] * n[2], sum[5] += h * n[2] * n[2];
    if (!invert_symmetric(sum, P)) return false;
    vgi_symmetric_times(P, n, q);
    vgi_scale(q, h);
    return true;
}

static void measure_face(const double *w, size_t r, double *p, double *q, unsigned char *slow)
{
    double P[6], size;
    if (r == 2) {
        *slow = w[0] != 0 || w[1] != 0 || w[2] != 0 ? 1 : 2;
    } else if (vgi_gradient_moments(w, r, P, q, &size)) {
        vgi_divide(q, sqrt(size));
        for (size_t i = 0; i < 3 * r; i += 3) vgi_symmetric_times(P, w + i, p + i);
    } else {
        *slow = 2;
    }
}

int vgi_mesh_moments(const vg_mesh *m, const double *reference, double *p, double *q, unsigned char *slow, vg_err *e)
{
    size_t most = 0;
    for (size_t f = 0; f < m->nf; f++)
        most = m->start[f + 1] - m->start[f] > most ? m->start[f + 1] - m->start[f] : most;
    double *w = vgi_array(3 * most, sizeof *w, e); /* the vectors of a face */
    if (!w) return VG_ENOMEM;
    for (size_t f = 0; f < m->nf; f++) {
        size_t begin = m->start[f], r = m->start[f + 1] - begin;
        vgi_face_vectors(reference, m->vert + begin, r, w);
        measure_face(w, r, p + 3 * begin, q + 3 * f, &slow[f]);
    }
    free(w);
    return VG_OK;
}
