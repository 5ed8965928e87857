/* surface.h: the nearest point on a polygon surface whose normal fits.
 * Internal. A face with four or more corners is the fan of triangles around its centroid; a face with two is a line
 * segment. No distances between surfaces, no rays.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SURFACE_H
#define VG_SURFACE_H

#include "core/core.h"

typedef struct vgi_surface vgi_surface;

typedef struct vgi_hit {
    uint32_t face;
    bool border;     /* on an edge with one face */
    double square;   /* squared distance */
    double measure;  /* what was least: the squared distance, or see vgi_surface_alike */
    double normal[3]; /* vgi_surface_alike: the smoothed normal, not of unit length */
    double point[3];
    /* The point is a + u0 (b - a) + u1 (c - a): a is the vertex of this corner, b that of the next one; c is the vertex
     * of the third corner in a triangle, the centroid in a larger face, and b in a line segment. */
    uint32_t corner;
    double u[2];
} vgi_hit;

/* vgi_surface_new: m borrowed until free; points (nv x 3, finite) copied in part. O(n log n). */
int vgi_surface_new(vgi_surface **s, const vg_mesh *m, const double *points, vg_err *e) VG_MUST_CHECK;
/* vgi_surface_of: searches return only faces f with take[f] (NULL: all). Normals, centroids and sizes are those of
 * all faces. */
int vgi_surface_of(vgi_surface **s, const vg_mesh *m, const double *points, const bool *take,
                   vg_err *e) VG_MUST_CHECK;
void vgi_surface_free(vgi_surface **s);
const double *vgi_surface_normals(const vgi_surface *s);   /* nf x 3: unit normals (Newell), 0 where undefined */
const double *vgi_surface_centroids(const vgi_surface *s); /* nf x 3 */
/* vgi_surface_sizes: nf: square root of the area, or the length of a line segment. */
const double *vgi_surface_sizes(const vgi_surface *s);
/* vgi_surface_vertex_normals: nv x 3: as of vgi_vertex_normals. */
const double *vgi_surface_vertex_normals(const vgi_surface *s);
/* vgi_vertex_normals: normal (nv x 3, out): unit normals, area-weighted; 0 where they are undefined: without area, or
 * where the faces cancel. area: room for nv numbers. */
void vgi_vertex_normals(const vg_mesh *m, const double *points, double *normal, double *area);
/* vgi_surface_border: whether the edge from this corner to the next one is a border. */
bool vgi_surface_border(const vgi_surface *s, uint32_t corner);

/* vgi_surface_nearest: the nearest point to p within the squared distance `limit`; false if there is none. A point
 * counts only if the normal of the face, or the smoothed normal of the surface, has at least the cosine `cosine` with
 * the unit vector `normal`. Faces without a normal always count, and all do if `normal` is NULL or 0. Among points at
 * the same distance the lowest face wins, so the result does not depend on the order of the search. */
bool vgi_surface_nearest(const vgi_surface *s, const double p[3], const double *normal, double cosine, double limit,
                         vgi_hit *hit);
/* vgi_surface_alike: the point within the squared distance `limit` for which the squared distance plus `reach`^2 times
 * the squared difference of its smoothed normal from `normal` is least: on a ridge the ridge, though a point beside it
 * is nearer. hit->measure is this sum; no result has a larger one than `most`. Else like vgi_surface_nearest. */
bool vgi_surface_alike(const vgi_surface *s, const double p[3], const double *normal, double cosine, double reach,
                       double limit, double most, vgi_hit *hit);

#endif
