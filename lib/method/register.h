/* register.h: what the parts of registration share: 3 x 3 matrices, the fit of one surface to another, the pairing of
 * faces. Internal; what a program may call is vg_register in vg.h. All lengths in here are in units of the target's
 * D.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_REGISTER_H
#define VG_REGISTER_H

#include "method/surface.h"

#include <math.h>

/* Row-major 3 x 3 matrices. */
static inline void vgi_multiply_vector(const double m[9], const double x[3], double y[3])
{
    double a = m[0] * x[0] + m[1] * x[1] + m[2] * x[2], b = m[3] * x[0] + m[4] * x[1] + m[5] * x[2];
    double c = m[6] * x[0] + m[7] * x[1] + m[8] * x[2];
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
static inline double vgi_square(const double a[3], const double b[3]) /* squared distance */
{
    double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

/* A point of the source, share-weighted mean of up to three vertices (the same one thrice for a vertex), that belongs
 * at a point of space, with a weight: 1 is as firm as the surface is stiff in the end. */
typedef struct vgi_tie {
    uint32_t vertex[3];
    double share[3], point[3], weight;
} vgi_tie;

typedef struct vgi_fitting {
    const vg_mesh *source;
    const double *rest;         /* of the source, brought onto the target as a whole */
    const vgi_surface *source_surface; /* of rest: its borders */
    const vg_mesh *target_mesh;
    const double *target_points;
    const vgi_surface *target;
    bool flipped;               /* the faces of one mesh turn the other way round: normals are to be opposite */
    const uint32_t *links;      /* nlinks pairs of source vertices */
    size_t nlinks;
    const vgi_tie *tie;
    size_t nties;
    int threads;
    void (*step)(void *context, const vg_register_step *step); /* may be NULL */
    void *context;
} vgi_fitting;

/* vgi_fit: x (nv x 3, out): the source bent so that it lies on the target. */
int vgi_fit(const vgi_fitting *in, double *x, vg_err *e) VG_MUST_CHECK;

typedef struct vgi_pairing {
    const vg_mesh *source, *target;
    const vgi_surface *source_surface, *target_surface; /* the source as fitted */
    bool flipped;
    int threads;
} vgi_pairing;

/* vgi_pair: fill first, source, weight, distance (units of D), matched of *c. */
int vgi_pair(const vgi_pairing *in, vg_correspondence *c, vg_err *e) VG_MUST_CHECK;

#endif
