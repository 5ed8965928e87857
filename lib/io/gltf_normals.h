/* gltf_normals.h: normals for a mesh without any; used by the glTF writers.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_NORMALS_H
#define VG_GLTF_NORMALS_H

#include "core/core.h"

/* Groups of the corners at a vertex that are shaded as one surface. */
typedef struct vgi_gltf_normals {
    const vg_mesh *mesh;
    size_t ngroups;   /* 0 without triangles or polygons */
    uint32_t *corner; /* per corner of the mesh: its group; UINT32_MAX for lines */
    double *sum;      /* ngroups x 3: workspace */
    size_t n;         /* vertices of the file, */
    uint32_t *group;  /* n: group of each; UINT32_MAX: none */
    float *base;      /* n x 3: in the reference pose */
} vgi_gltf_normals;

/* vgi_gltf_normals_make: group the corners. Faces that share an edge are shaded as one surface if their smoothing
 * labels say so, or, without labels, if they meet at less than 60 degrees in the reference pose. m is borrowed. */
int vgi_gltf_normals_make(vgi_gltf_normals *x, const vg_mesh *m, const vg_attributes *a, const double *reference,
                          vg_err *e) VG_MUST_CHECK;
void vgi_gltf_normals_clear(vgi_gltf_normals *x);
/* vgi_gltf_normals_place: set the vertices of the file: corner c of the mesh is vertex corner[c], or (NULL) that of
 * the mesh. */
int vgi_gltf_normals_place(vgi_gltf_normals *x, size_t n, const uint32_t *corner, const double *reference,
                           vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_normals_turn: change of base in this pose of the mesh; n x 3. */
void vgi_gltf_normals_turn(vgi_gltf_normals *x, const double *pose, float *to);

#endif
