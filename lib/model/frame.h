/* frame.h: declarations for readers of frames in addition to vg.h. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FRAME_H
#define VG_FRAME_H

#include "core/core.h"

/* vgi_frame_add: vg_frame_add with texts without terminators and the element by name. */
typedef struct vgi_channel_texts {
    const char *name, *unit, *element;
    size_t name_bytes, unit_bytes, element_bytes;
} vgi_channel_texts;
int vgi_frame_add(vg_frame *f, const vgi_channel_texts *t, size_t width, size_t count, vg_channel **c,
                  vg_err *e) VG_MUST_CHECK;

#endif
