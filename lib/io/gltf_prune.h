/* gltf_prune.h: used by gltf_write.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_PRUNE_H
#define VG_GLTF_PRUNE_H

#include "io/gltf.h"

typedef struct vgi_gltf_pruned {
    const bool *meshes; /* which are used; NULL: all */
    const bool *bound;  /* skins whose inverse bind matrices are replaced, with the same result; NULL: none */
    bool replaced;      /* positions and normals of meshes without morph targets are: their accessors are not used, and references to them become 0 */
} vgi_gltf_pruned;

/* vgi_gltf_prune: accessors and views that are used get consecutive numbers in the document; the others go. The bytes of the
 * views are appended to `to`, as they will be in a single buffer; accessors that have been looked up keep the bytes of g. */
int vgi_gltf_prune(vgi_gltf *g, const vgi_gltf_pruned *which, vg_bytes *to, vg_err *e) VG_MUST_CHECK;

#endif
