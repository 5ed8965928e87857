/* gltf_seams.h: vertices as glTF has them, one texture coordinate and one normal each: what the writers of glTF ask of gltf_seams.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_SEAMS_H
#define VG_GLTF_SEAMS_H

#include "core/core.h"

typedef struct vgi_gltf_seams {
    size_t nv, n;      /* vertices of the mesh, and of the file: those of the mesh, and copies of some behind them */
    uint32_t *from;    /* n: the vertex of the mesh that each is */
    uint32_t *corner;  /* of each corner of the mesh: the vertex of the file */
    float *uv;         /* n x 2, v downwards; NULL: there are no texture coordinates */
} vgi_gltf_seams;

/* vgi_gltf_seams_make: where corners of one vertex have different texture coordinates, or are of different groups, it is cut
 * apart. group (may be NULL): of each corner; UINT32_MAX: any. a without texture coordinates of two numbers, and no groups:
 * the vertices of the mesh. */
int vgi_gltf_seams_make(vgi_gltf_seams *s, const vg_mesh *m, const vg_attributes *a, const uint32_t *group,
                        vg_err *e) VG_MUST_CHECK;
void vgi_gltf_seams_clear(vgi_gltf_seams *s);

#endif
