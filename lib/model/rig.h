/* rig.h: how the bones of a rig hang together.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_MODEL_RIG_H
#define VG_MODEL_RIG_H

#include "core/core.h"

#define VGI_NO_BONE UINT32_MAX

/* vgi_rig_movers: for each joint the bone it moves with: itself, or the next above that turns; VGI_NO_BONE: there is
 * none. */
void vgi_rig_movers(const vg_rig *r, uint32_t *mover);
/* vgi_rig_parents: for each bone the bone that carries its joint; the first bone has none,
 * and other roots hang on the first. */
int vgi_rig_parents(const vg_rig *r, uint32_t *parent, vg_err *e) VG_MUST_CHECK;
/* vgi_rig_is_free: there are several bones, and none is the parent of another (vg_rig_decompose). */
bool vgi_rig_is_free(const vg_rig *r);

#endif
