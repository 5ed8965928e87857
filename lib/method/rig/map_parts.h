/* map_parts.h: shared by fitting, retargeting and evaluation of maps: geometry of patches, and their placement by
 * hinges or joints.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_MAP_PARTS_H
#define VG_MAP_PARTS_H

#include "core/core.h"
#include "numeric/vec3.h"

/* The vertices of each patch on one body. */
typedef struct vgi_shape {
    size_t n;
    uint32_t *first, *member; /* n + 1; the vertices of patch p start at member[first[p]] */
    double *local;            /* 3 per member: relative to the patch's centre */
    double *centre, *spread;  /* n points; n sums of squared local */
} vgi_shape;

int vgi_shape_make(vgi_shape *s, const vg_mesh *m, const vg_patches *patches, const double *points,
                   vg_err *e) VG_MUST_CHECK;
void vgi_shape_clear(vgi_shape *s);

/* A similarity x -> A x + t. */
typedef struct vgi_motion {
    double a[9], t[3], b2; /* b2: squared scale */
} vgi_motion;

/* vgi_shape_measure: the best similarity of patch p in a pose. */
void vgi_shape_measure(const vgi_shape *s, size_t p, const double *pose, vgi_motion *m);

/* vgi_move_point: y = A x + t */
static inline void vgi_move_point(const vgi_motion *m, const double x[3], double y[3])
{
    vgi_multiply_vector(m->a, x, y);
    vgi_add(y, m->t);
}

/* vgi_place_by_hinges: compute place (n x 3n) of the map from its hinges, centres and shares. */
int vgi_place_by_hinges(const vg_map *m, const double *centre, double *place, vg_err *e) VG_MUST_CHECK;

/* vgi_place_by_bones: the same from the skeleton of r, whose joints are at the map's centres. Bones keep their
 * lengths. */
int vgi_place_by_bones(const vg_rig *r, const vg_map *m, double *place, vg_err *e) VG_MUST_CHECK;

/* The body whose vertices a map moves. */
typedef struct vgi_map_body {
    const double *reference;
    const vg_rig *rig; /* with weights; NULL for a map of patches */
} vgi_map_body;

/* vgi_map_skin_row: set the weights of vertex v of a map of bones to those of linear blend skinning. */
void vgi_map_skin_row(vg_map *m, const vgi_map_body *body, size_t v);
/* vgi_map_collapse: compute the map's weights from its corners and held vertices. of_face: the patch of each face of
 * g; NULL for a map of bones. vectors: 3 per corner of g, of the body's reference. */
int vgi_map_collapse(vg_map *m, const vgi_map_body *body, const vg_graph *g, const uint32_t *of_face,
                     const double *vectors, int threads, vg_err *e) VG_MUST_CHECK;
/* vgi_graph_patches: the patch of each face of g, the graph of h. A link takes the patch of a face at its first
 * vertex. patches: those of h's mesh. Release with free(). NULL: out of memory. */
uint32_t *vgi_graph_patches(const vg_head *h, const vg_patches *patches, const vg_graph *g, vg_err *e);

#endif
