/* rig.h: the hierarchy of the bones of a rig.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_MODEL_RIG_H
#define VG_MODEL_RIG_H

#include "core/core.h"

#define VGI_NO_BONE UINT32_MAX

/* vgi_rig_movers: for each joint the bone that moves it: its own, or that of the nearest joint above that rotates;
 * VGI_NO_BONE if there is none. */
void vgi_rig_movers(const vg_rig *r, uint32_t *mover);
/* vgi_rig_parents: for each bone its parent, the bone that moves its joint. The first bone has none; other roots are
 * children of the first. */
int vgi_rig_parents(const vg_rig *r, uint32_t *parent, vg_err *e) VG_MUST_CHECK;
/* vgi_rig_is_free: whether there are several bones and none is the parent of another (vg_rig_decompose). */
bool vgi_rig_is_free(const vg_rig *r);

#endif
