/* gltf_pack.h: a GLB in memory that is put together from parts of files: what gltf_asset.c and mtl.c share.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_PACK_H
#define VG_GLTF_PACK_H

#include "io/gltf.h"

typedef struct vgi_gltf_packing {
    const vgi_gltf *g;  /* where parts come from, for messages */
    vgi_input *in;      /* the file beside which images are */
    vgi_json *doc, *accessors, *views; /* the new ones; the lists are borrowed from doc */
    size_t *accessor_of; /* of each old accessor the new one + 1; 0: it is not there yet */
    vg_bytes data;
    vg_note *note;
} vgi_gltf_packing;

/* vgi_gltf_pack_begin: doc, when it is NULL, and its empty lists. The caller clears it, come what may. */
int vgi_gltf_pack_begin(vgi_gltf_packing *k, vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_embed: bytes as the image of this object; type NULL: it says it already. */
int vgi_gltf_embed(vgi_gltf_packing *k, vgi_json *image, const unsigned char *p, size_t n, const char *type,
                   vg_err *e) VG_MUST_CHECK;
const char *vgi_gltf_image_type(const unsigned char *p, size_t n); /* "image/png", ...; NULL: unknown */
int vgi_gltf_pack_end(vgi_gltf_packing *k, vg_bytes *to, vg_err *e) VG_MUST_CHECK;
void vgi_gltf_pack_clear(vgi_gltf_packing *k);

/* ---- mtl.c ---- */
/* vgi_take_materials: those of the libraries that the labels of an OBJ name, as its asset; nothing when there are none.
 * path: of the OBJ. */
int vgi_take_materials(vg_body *b, const char *path, vg_note *note, vg_err *e) VG_MUST_CHECK;

#endif
