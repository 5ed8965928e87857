/* gltf_quantize.h: what gltf_morph.c and gltf_cast.c ask of gltf_quantize.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_QUANTIZE_H
#define VG_GLTF_QUANTIZE_H

#include "io/gltf_scene.h"

#define VGI_GLTF_QUANTIZATION "KHR_mesh_quantization"

/* Positions of a node's mesh are origin + scale * q, displacements scale * q, q from -1 to 1 in steps of 1/32767. */
typedef struct vgi_gltf_grid {
    bool begun;
    double low[3], high[3], farthest; /* while it is found: bounds of positions; the largest displacement */
    double origin[3], scale;
    size_t node;                      /* of a character: the one that shows the mesh */
    bool skinned;
    size_t skin, inverse;             /* skinned: its skin, and the accessor of its new inverse bind matrices */
} vgi_gltf_grid;

void vgi_gltf_grid_base(vgi_gltf_grid *g, const float *p, size_t n);
void vgi_gltf_grid_target(vgi_gltf_grid *g, const float *d, size_t n);
void vgi_gltf_grid_close(vgi_gltf_grid *g);
/* vgi_gltf_round_positions: n positions (base) or displacements become the whole numbers 32767 q; off (3 n) gets the errors. */
void vgi_gltf_round_positions(const vgi_gltf_grid *g, bool base, float *p, size_t n, float *off);
/* vgi_gltf_round_normals: n unit vectors become 127 times themselves, rounded. */
void vgi_gltf_round_normals(float *n, size_t count);
/* vgi_gltf_round_turns: the same for what is added to the normals base (as they were before rounding). Normals that turn far
 * become shorter, so that no coordinate exceeds 1. false: some would be too short; nothing is changed. */
bool vgi_gltf_round_turns(const float *base, float *d, size_t n);
/* vgi_gltf_grid_bind: k->n matrices of 16 numbers; false: some are not finite. */
bool vgi_gltf_grid_bind(const vgi_gltf_grid *g, const vgi_gltf_skin *k, float *to);
/* vgi_gltf_put_grids: nodes and skins of a character's document apply the grids; it requires the extension. */
int vgi_gltf_put_grids(vgi_json *doc, const vgi_gltf_grid *grids, size_t n, vg_err *e) VG_MUST_CHECK;

size_t vgi_gltf_users_of(const vgi_json *document, size_t skin); /* nodes with this skin */

#endif
