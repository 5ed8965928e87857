/* gltf_roots.h: used by the writers of characters.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_ROOTS_H
#define VG_GLTF_ROOTS_H

#include "io/gltf_scene.h"

/* vgi_gltf_raise_skins: doc: the document of the scene, or a changed copy with the same nodes. Nodes that have children, are
 * joints, or are animated stay where they are. */
int vgi_gltf_raise_skins(const vgi_gltf_scene *x, vgi_json *doc, vg_err *e) VG_MUST_CHECK;

#endif
