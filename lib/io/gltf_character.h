/* gltf_character.h: a character of glTF that is written again, in other poses: what the writers ask of gltf_character.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_CHARACTER_H
#define VG_GLTF_CHARACTER_H

#include "io/gltf_scene.h"

/* Vertices of the file are those of all parts of the scene, one part after the other; their space is that of their mesh,
 * before a skin or node takes them into the world. */
typedef struct vgi_gltf_character {
    vgi_gltf_scene scene;
    vgi_gltf_faces faces;   /* triangles of vertices of the file */
    size_t n;               /* vertices of the file */
    size_t nv;              /* vertices of the mesh */
    const uint32_t *vertex; /* n: of the mesh; borrowed */
    double *out, *in;       /* n x 12: from their space into the world, and back */
    bool *skinned;          /* n */
    float *base, *normal;   /* n x 3: the reference pose and its normals; normal is NULL without any */
    double *world_normal;   /* n x 3 */
    bool kept;              /* the reference pose is the one that the asset shows */
    bool touches;           /* vertices that are not one lie on one another in it: a reader could weld them */
    uint32_t *group;        /* n: vertices that are one and have one normal; UINT32_MAX: those that have none */
    size_t ngroups;
    double *rest, *now;     /* ngroups x 3: normals of the faces around, in the reference pose and in another */
    double *twist;          /* ngroups x 2: cosine and sine of how the faces around turn about that normal, not of length 1 */
    const double *rest_world; /* nv x 3: the pose of rest; borrowed */
} vgi_gltf_character;

/* vgi_gltf_character_open: 1: the body has an asset that belongs to its mesh; 0: it has none, or one that cannot be
 * used. The caller clears it, come what may. */
int vgi_gltf_character_open(vgi_gltf_character *c, const vg_body *b, vg_err *e) VG_MUST_CHECK;
void vgi_gltf_character_clear(vgi_gltf_character *c);
/* vgi_gltf_character_pose, _move: displacements of the vertices of the file from base, for a pose of the mesh (world) or for
 * displacements of the mesh (moved). Where those are 0, they stay 0. */
void vgi_gltf_character_pose(const vgi_gltf_character *c, const double *world, const float *moved, float *to);
void vgi_gltf_character_move(const vgi_gltf_character *c, const float *moved, float *to);
/* vgi_gltf_character_turn: what is to be added to the normals, for a pose of the mesh. */
void vgi_gltf_character_turn(vgi_gltf_character *c, const double *world, float *to);

#endif
