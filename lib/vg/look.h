/* vg/look.h: what a sheet looks at: a vertex, a joint, a part of the mesh.
 * Included by itself: vg.h says what holds for all of lib/vg.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_LOOK_H
#define VG_PART_LOOK_H

#include "vg/view.h"

#ifdef __cplusplus
extern "C" {
#endif

/* vg_look_find: the vertices that `what` names: the number of a vertex; else the name of a joint, of the skeleton that the body is or
 * of a rig (then the vertex nearest to it in the reference pose); else of an object, group or material, the vertices of its
 * faces. *n of them, at least one; free with free(). VG_EARG when there is nothing of that name. */
int vg_look_find(const vg_body *b, const char *what, uint32_t **vertices, size_t *n, vg_err *e) VG_MUST_CHECK;

/* vg_sheet_look_at: the mean of these vertices of sequence i (copied) is in the middle of each of its pictures. Call it for all sequences of
 * a sheet or for none, before vg_sheet_write. */
int vg_sheet_look_at(vg_sheet *s, size_t i, const uint32_t *vertices, size_t n, vg_err *e) VG_MUST_CHECK;

#ifdef __cplusplus
}
#endif

#endif
