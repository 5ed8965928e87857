/* face.h: geometry of one polygon: its centre, the vectors of its corners, its normal.
 * Internal. Whole meshes are elsewhere, several poses at once in wide_face.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FACE_H
#define VG_FACE_H

#include "numeric/vec3.h"

#include <stdbool.h>
#include <stdint.h>

/* vgi_face_centre: the mean of the r vertices vert[0 ..] */
static inline void vgi_face_centre(const double *points, const uint32_t *vert, size_t r, double centre[3])
{
    centre[0] = centre[1] = centre[2] = 0;
    for (size_t i = 0; i < r; i++)
        for (size_t k = 0; k < 3; k++) centre[k] += points[3 * (size_t)vert[i] + k] / (double)r;
}

/* vgi_face_vectors: w (r x 3): from the centre to each vertex */
static inline void vgi_face_vectors(const double *points, const uint32_t *vert, size_t r, double *w)
{
    double centre[3];
    vgi_face_centre(points, vert, r, centre);
    for (size_t i = 0; i < r; i++) vgi_subtract(points + 3 * (size_t)vert[i], centre, w + 3 * i);
}

/* vgi_face_area: the vector area by Newell's formula: a normal whose length is the area; 0 for line segments.
 * Relative to a corner, so that no digits are lost far from the origin. */
static inline void vgi_face_area(const double *points, const uint32_t *vert, size_t r, double area[3])
{
    const double *o = points + 3 * (size_t)vert[0];
    area[0] = area[1] = area[2] = 0;
    for (size_t i = 1; i + 1 < r; i++) {
        double u[3], v[3], n[3];
        vgi_subtract(points + 3 * (size_t)vert[i], o, u);
        vgi_subtract(points + 3 * (size_t)vert[i + 1], o, v);
        vgi_cross(u, v, n);
        vgi_add_scaled(area, 0.5, n);
    }
}

/* vgi_face_has_area: whether the face has more area than rounding leaves of one whose corners lie on a line; `area` as
 * of vgi_face_area. */
static inline bool vgi_face_has_area(const double *points, const uint32_t *vert, size_t r, double area[3])
{
    double longest = 0;
    vgi_face_area(points, vert, r, area);
    for (size_t i = 1; i < r; i++)
        longest = fmax(longest, vgi_square(points + 3 * (size_t)vert[0], points + 3 * (size_t)vert[i]));
    return vgi_dot(area, area) > 1e-24 * longest * longest;
}

/* vgi_triangle_normal: its length is twice the area */
static inline void vgi_triangle_normal(const double a[3], const double b[3], const double c[3], double n[3])
{
    double u[3], v[3];
    vgi_subtract(b, a, u), vgi_subtract(c, a, v);
    vgi_cross(u, v, n);
}

#endif
