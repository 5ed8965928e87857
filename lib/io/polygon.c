/* polygon.c: where a face with more than three corners can be cut into triangles. Each format cuts in its own order
 * (stl.c, gltf_faces.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/polygon.h"
#include "numeric/face.h"

/* Positive if the triangle has the orientation of the face; 0 if it has no area. */
static double facing(const double *points, uint32_t a, uint32_t b, uint32_t c, const double normal[3])
{
    double n[3];
    vgi_triangle_normal(points + 3 * (size_t)a, points + 3 * (size_t)b, points + 3 * (size_t)c, n);
    return vgi_dot(n, normal);
}

bool vgi_is_fan(const double *points, const uint32_t *v, size_t n, const double normal[3])
{
    for (size_t i = 1; i + 1 < n; i++)
        if (!(facing(points, v[0], v[i], v[i + 1], normal) >= 0)) return false;
    return true;
}

bool vgi_is_ear(const double *points, const uint32_t *v, size_t n, size_t i, const double normal[3])
{
    uint32_t a = v[(i + n - 1) % n], b = v[i], c = v[(i + 1) % n];
    if (!(facing(points, a, b, c, normal) > 0)) return false;
    for (size_t k = 0; k < n; k++) {
        uint32_t p = v[k];
        if (p != a && p != b && p != c && facing(points, a, b, p, normal) >= 0 &&
            facing(points, b, c, p, normal) >= 0 && facing(points, c, a, p, normal) >= 0)
            return false;
    }
    return true;
}
