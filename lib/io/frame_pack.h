/* frame_pack.h: a frame as one block of bytes, for frames that wait in memory or in a temporary file. Internal,
 * and not a format: it contains addresses in the machine's byte order.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FRAME_PACK_H
#define VG_FRAME_PACK_H

#include "io/io.h"

/* What a packed frame contains. */
typedef struct vgi_packing {
    const vg_head *h;
    size_t values; /* numbers of a frame; 0: they are stored elsewhere */
} vgi_packing;

/* The header of a packed frame's name, records, channels and values. */
typedef struct vgi_packed {
    size_t bytes; /* size of the whole frame with this header */
    size_t name, records, channels;
    double time, root[3];
    bool has_time;
} vgi_packed;

/* vgi_packing_make: h is borrowed. values: pack the values, too. */
int vgi_packing_make(vgi_packing *p, const vg_head *h, bool values, vg_err *e) VG_MUST_CHECK;
/* vgi_pack_measure: the packed size of f, in to->bytes. vgi_pack: pack f into that many bytes. */
int vgi_pack_measure(const vgi_packing *s, const vg_frame *f, vgi_packed *to, vg_err *e) VG_MUST_CHECK;
void vgi_pack(const vgi_packing *s, const vg_frame *f, const vgi_packed *head, unsigned char *to);
/* vgi_unpack: restore the frame; its values are undefined if they were not packed. */
int vgi_unpack(const vgi_packing *s, const unsigned char *from, vg_frame *f, vg_err *e) VG_MUST_CHECK;
/* vgi_pack_write: write n bytes at a position of a file; `name` is the frame's, for the message. */
int vgi_pack_write(int fd, uint64_t off, const void *from, size_t n, const char *name, vg_err *e) VG_MUST_CHECK;

#endif
