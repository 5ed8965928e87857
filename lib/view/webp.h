/* webp.h: an animated WebP, picture by picture. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_WEBP_H
#define VG_WEBP_H

#include "core/core.h"

typedef struct vgi_webp vgi_webp;
/* vgi_webp_open: an animation of w x h pixels (at most 16383 each) that repeats for ever. */
int vgi_webp_open(vgi_webp **p, size_t w, size_t h, vg_err *e) VG_MUST_CHECK;
/* vgi_webp_add: append a picture (8-bit RGB, w x h), shown from `milliseconds` on. */
int vgi_webp_add(vgi_webp *p, const unsigned char *rgb, int milliseconds, vg_err *e) VG_MUST_CHECK;
/* vgi_webp_end: show the last picture until `milliseconds`, and append the file to out. */
int vgi_webp_end(vgi_webp *p, int milliseconds, vg_bytes *out, vg_err *e) VG_MUST_CHECK;
void vgi_webp_close(vgi_webp **p);

#endif
