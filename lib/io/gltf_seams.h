/* gltf_seams.h: vertices as glTF has them, one texture coordinate and one normal each; used by the glTF writers.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_SEAMS_H
#define VG_GLTF_SEAMS_H

#include "core/core.h"

typedef struct vgi_gltf_seams {
    size_t nv, n;      /* vertices of the mesh, and of the file: those of the mesh followed by copies */
    uint32_t *from;    /* n: the vertex of the mesh for each */
    uint32_t *corner;  /* per corner of the mesh: the vertex of the file */
    float *uv;         /* n x 2, v downwards; NULL without texture coordinates */
} vgi_gltf_seams;

/* vgi_gltf_seams_make: split a vertex where its corners have different texture coordinates or groups. group (may be
 * NULL): per corner; UINT32_MAX: any. Without texture coordinates of two numbers in a, and without groups: the
 * vertices of the mesh. */
int vgi_gltf_seams_make(vgi_gltf_seams *s, const vg_mesh *m, const vg_attributes *a, const uint32_t *group,
                        vg_err *e) VG_MUST_CHECK;
void vgi_gltf_seams_clear(vgi_gltf_seams *s);

#endif
