/* bvh.h: shared by bvh.c and bvh_write.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_BVH_H
#define VG_BVH_H

#include "io/io.h"

enum { VGI_BVH_NAME = 1024 }; /* most bytes in a joint's name */

extern const char vgi_bvh_end[];             /* suffix of an end site's name, after that of its parent */
extern const char *const vgi_bvh_channels[]; /* the channel keywords, in the order of vg_joint's numbers */

/* ---- bvh_write.c: for the table in bvh.c ---- */
int vgi_bvh_check(const vg_head *h, const char *output, vg_err *e);
int vgi_bvh_begin(void **state, const vg_head *h, const vg_sink_options *o, vgi_output *out, vg_err *e);
int vgi_bvh_put(void *state, const vg_frame *f, vg_err *e);
int vgi_bvh_finish(void *state, vg_err *e);
const char *vgi_bvh_warning(void *state);
void vgi_bvh_release(void *state);

#endif
