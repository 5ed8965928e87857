/* polygon.h: how a face with more than three corners can be cut; shared by the writers of triangles. A face is a ring
 * of n vertices v; points are those of the mesh.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_POLYGON_H
#define VG_POLYGON_H

#include "core/core.h"

/* A face with more corners is split as a fan, whatever its shape, because clipping takes at least quadratic time. */
enum { VGI_MOST_CLIPPED = 512 };

/* vgi_is_fan: whether the fan of triangles around the first vertex covers the face. normal: vgi_face_area. */
bool vgi_is_fan(const double *points, const uint32_t *v, size_t n, const double normal[3]);
/* vgi_is_ear: whether corner i is convex, with no other corner inside its triangle. */
bool vgi_is_ear(const double *points, const uint32_t *v, size_t n, size_t i, const double normal[3]);

#endif
