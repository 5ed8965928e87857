/* gltf_pack.h: a GLB assembled in memory from parts of files; shared by gltf_asset.c and mtl.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_PACK_H
#define VG_GLTF_PACK_H

#include "io/gltf.h"

typedef struct vgi_gltf_packing {
    const vgi_gltf *g;  /* source of the parts, for messages */
    vgi_input *in;      /* the file beside which images are found */
    vgi_json *doc, *accessors, *views; /* the new ones; the lists are borrowed from doc */
    size_t *accessor_of; /* per old accessor: the new one + 1; 0: not yet copied */
    vg_bytes data;
    vg_note *note;
} vgi_gltf_packing;

/* vgi_gltf_pack_begin: create doc if it is NULL, with empty lists. The caller clears it in any case. */
int vgi_gltf_pack_begin(vgi_gltf_packing *k, vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_embed: embed bytes as the image of this object; type NULL: already set. */
int vgi_gltf_embed(vgi_gltf_packing *k, vgi_json *image, const unsigned char *p, size_t n, const char *type,
                   vg_err *e) VG_MUST_CHECK;
const char *vgi_gltf_image_type(const unsigned char *p, size_t n); /* "image/png", ...; NULL: unknown */
int vgi_gltf_pack_end(vgi_gltf_packing *k, vg_bytes *to, vg_err *e) VG_MUST_CHECK;
void vgi_gltf_pack_clear(vgi_gltf_packing *k);

/* ---- mtl.c ---- */
/* vgi_take_materials: read the libraries named by the labels of an OBJ, as its asset; nothing if there are none.
 * path: of the OBJ. */
int vgi_take_materials(vg_body *b, const char *path, vg_note *note, vg_err *e) VG_MUST_CHECK;

#endif
