/* payload.h: the contents of FORM, frames and FAIL (fmt/STREAM.md, section 3). Each has a _decode into a head or
 * frame, which checks everything, and an _encode that appends to bytes. Messages call the record `where`.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PAYLOAD_H
#define VG_PAYLOAD_H

#include "model/form.h"

typedef struct vgi_payload {
    const unsigned char *data;
    size_t size;
    const char *where;
} vgi_payload;

int vgi_form_decode(const vgi_payload *p, vg_head *h, vg_err *e) VG_MUST_CHECK;
int vgi_form_encode(vg_bytes *b, const vg_head *h, vg_err *e) VG_MUST_CHECK;

/* vgi_fram_decode: f->raw holds the payload. On a little-endian machine binary64 values are used in place. */
int vgi_fram_decode(vg_frame *f, const vgi_form *h, const char *where, vg_err *e) VG_MUST_CHECK;
/* vgi_fram_encode: everything before the values. */
int vgi_fram_encode(vg_bytes *b, const vgi_form *h, const vg_frame *f, vg_err *e) VG_MUST_CHECK;
/* vgi_values_encode: n numbers as bytes of the stream, padded: x itself if no conversion is needed, otherwise a copy
 * in b.
 */
int vgi_values_encode(vg_bytes *b, const double *x, size_t n, vg_precision precision, const void **data,
                      size_t *bytes, vg_err *e) VG_MUST_CHECK;

/* FAIL: VG_ETRUNC with a message that names the program that failed. */
int vgi_fail_decode(vg_failure *f, const vgi_payload *p, const char *stream, vg_err *e) VG_MUST_CHECK;
void vgi_failure_clear(vg_failure *f);
int vgi_fail_encode(vg_bytes *b, const char *program, int status, const char *message, vg_err *e) VG_MUST_CHECK;

#endif
