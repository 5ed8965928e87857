/* frame.h: what readers of frames need beside vg.h.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FRAME_H
#define VG_FRAME_H

#include "core/core.h"

/* vgi_frame_scalars: vg_frame_scalars whose numbers are still to be set; texts without terminators. */
int vgi_frame_scalars(vg_frame *f, const char *name, size_t name_bytes, const char *unit, size_t unit_bytes,
                      size_t nv, vg_err *e) VG_MUST_CHECK;

#endif
