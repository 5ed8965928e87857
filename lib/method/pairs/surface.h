/* surface.h: the nearest point on a surface of polygons, of those whose normal fits.
 * Internal. A face of four corners or more is the fan of triangles around its centroid; a face of two is a line
 * segment. Leaves out distances between surfaces and rays.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SURFACE_H
#define VG_SURFACE_H

#include "core/core.h"

typedef struct vgi_surface vgi_surface;

typedef struct vgi_hit {
    uint32_t face;
    bool border;     /* on an edge that has only this face */
    double square;   /* squared distance */
    double point[3];
    /* The point is a + u0 (b - a) + u1 (c - a), a the vertex of this corner, b of the next one, c of the one after */
    uint32_t corner;
    double u[2];     /* that in a triangle, the centroid in a larger face, b in a line segment */
} vgi_hit;

/* vgi_surface_new: m borrowed until free; points (nv x 3, finite) copied in part. O(n log n). */
int vgi_surface_new(vgi_surface **s, const vg_mesh *m, const double *points, vg_err *e) VG_MUST_CHECK;
/* vgi_surface_of: searches find only faces f with take[f] (NULL: all); normals, centroids and sizes are those of all faces. */
int vgi_surface_of(vgi_surface **s, const vg_mesh *m, const double *points, const bool *take,
                   vg_err *e) VG_MUST_CHECK;
void vgi_surface_free(vgi_surface **s);
const double *vgi_surface_normals(const vgi_surface *s);   /* nf x 3: unit (Newell), or 0 for a face that has none */
const double *vgi_surface_centroids(const vgi_surface *s); /* nf x 3 */
/* vgi_surface_sizes: nf: square root of the area, or the length of a line segment. */
const double *vgi_surface_sizes(const vgi_surface *s);
/* vgi_surface_vertex_normals: nv x 3: unit, of the areas around; 0 where there is none. */
const double *vgi_surface_vertex_normals(const vgi_surface *s);
/* vgi_surface_border: is the edge from this corner to the next one a border? */
bool vgi_surface_border(const vgi_surface *s, uint32_t corner);

/* vgi_surface_nearest: the nearest point to p within the squared distance `limit`; false when there is none. Points
 * where neither the normal of the face nor that of the surface, smoothed over the vertices, has `cosine` with the
 * unit vector `normal` are passed over; faces without a normal, and all if `normal` is NULL or 0, are not. Of two at
 * the same distance the lower face is nearer: the answer depends on no order. */
bool vgi_surface_nearest(const vgi_surface *s, const double p[3], const double *normal, double cosine, double limit,
                         vgi_hit *hit);


#endif
