/* incidence.h: the faces around each vertex, and their corners there. Internal. Edges are not listed; the two edges
 * at a corner lead to its neighbours in the face.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_INCIDENCE_H
#define VG_INCIDENCE_H

#include "core/core.h"

/* vgi_face_size: how many corners face f has. */
static inline size_t vgi_face_size(const vg_mesh *m, size_t f)
{
    return m->start[f + 1] - m->start[f];
}

/* The corners of vertex v are corner[first[v]] .. corner[first[v + 1] - 1], ascending; face[] has the face of each. */
typedef struct vgi_incidence {
    uint32_t *first; /* nv + 1 */
    uint32_t *corner, *face; /* one per corner of the mesh */
} vgi_incidence;

/* vgi_incidence_make: from a mesh, or the faces of a graph. O(nv + corners). On failure *x is 0. */
int vgi_incidence_make(vgi_incidence *x, const vg_mesh *m, vg_err *e) VG_MUST_CHECK;
void vgi_incidence_clear(vgi_incidence *x);

/* vgi_corner_edges: the vertices before and after a corner in its face: the other ends of the two edges at the corner
 * (twice the same vertex in a line segment). */
static inline void vgi_corner_edges(const uint32_t *start, const uint32_t *vert, uint32_t face, uint32_t corner,
                                    uint32_t ends[2])
{
    uint32_t begin = start[face], end = start[face + 1];
    ends[0] = vert[(corner == begin ? end : corner) - 1];
    ends[1] = vert[corner + 1 == end ? begin : corner + 1];
}

#endif
