/* form.h: forms of frames by name. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FORM_H
#define VG_FORM_H

#include "core/core.h"

/* vgi_form_find, vgi_element_find: VG_OTHER, VG_OF_UNKNOWN if unknown. */
vg_kind vgi_form_find(const char *name);
vg_element vgi_element_find(const char *name);
/* vgi_form_copy: copy the description of an unknown form; `to` has none yet. */
int vgi_form_copy(vg_head *to, const vg_head *from, vg_err *e) VG_MUST_CHECK;

/* What reading and writing of frames needs, without the head. */
typedef struct vgi_form {
    vg_kind kind;
    vg_precision precision;
    size_t width, count;
    bool on_corners;
    size_t elements[VG_ELEMENTS]; /* vg_head_elements of each element */
} vgi_form;
vgi_form vgi_form_of(const vg_head *h);

#endif
