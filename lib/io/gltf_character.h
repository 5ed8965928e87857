/* gltf_character.h: a glTF character that is written again in other poses; used by the writers.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_CHARACTER_H
#define VG_GLTF_CHARACTER_H

#include "io/gltf_scene.h"

/* A triangle: its unit sides, its unit normal, and the angles at its corners. */
typedef struct vgi_gltf_frame {
    double frame[4][3], angle[3];
} vgi_gltf_frame;

/* Vertices of the file are those of all parts of the scene, part after part, in the space of their mesh, before a
 * skin or node is applied. */
typedef struct vgi_gltf_character {
    vgi_gltf_scene scene;
    vgi_gltf_faces faces;   /* triangles of vertices of the file */
    size_t n;               /* vertices of the file */
    size_t nv;              /* vertices of the mesh */
    const uint32_t *vertex; /* n: of the mesh; borrowed */
    double *out, *in;       /* n x 12: from their space to the world, and back */
    bool *skinned;          /* n */
    float *base, *normal;   /* n x 3: the reference pose and its normals; normal is NULL without any */
    double *world_normal;   /* n x 3 */
    float *tangent;         /* n x 3; 0 where no normal map needs one; NULL: nowhere */
    double *world_tangent;  /* n x 3 */
    bool kept;              /* the reference pose is the one shown by the asset */
    bool touches;           /* different vertices coincide in it, and a reader could weld them */
    uint32_t *group;        /* n: vertices that are one and have one normal; UINT32_MAX without a normal */
    size_t ngroups;
    vgi_gltf_frame *rest;   /* of each triangle, in the reference pose */
    double *turn;           /* ngroups x 9: sums of the surrounding triangles, of which the rotation is the best one */
} vgi_gltf_character;

/* vgi_gltf_character_open: 1 if the body has an asset that belongs to its mesh; 0 if it has none, or an unusable one.
 * The caller clears it in any case. */
int vgi_gltf_character_open(vgi_gltf_character *c, const vg_body *b, vg_err *e) VG_MUST_CHECK;
void vgi_gltf_character_clear(vgi_gltf_character *c);
/* vgi_gltf_find_touches: look whether different vertices coincide in this base: n x 3. */
int vgi_gltf_find_touches(vgi_gltf_character *c, const float *base, vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_character_pose, _move: displacements of the file's vertices from base, for a pose of the mesh (world) or
 * for displacements of the mesh (moved). Zero displacements stay zero. */
void vgi_gltf_character_pose(const vgi_gltf_character *c, const double *world, const float *moved, float *to);
void vgi_gltf_character_move(const vgi_gltf_character *c, const float *moved, float *to);
/* vgi_gltf_character_turn: change of the normals and tangents in a pose of the mesh. tangents: NULL if there are none. */
void vgi_gltf_character_turn(vgi_gltf_character *c, const double *world, float *normals, float *tangents);
bool vgi_gltf_needs_tangents(const vgi_gltf_scene *x, size_t part); /* a material has a normal map, and there are tangents */

#endif
