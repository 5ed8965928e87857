/* frame_pack.h: a frame as one run of bytes, for what waits in memory or in a file of ours and is read by nobody else.
 * Internal. Not a format: it holds addresses and the byte order of the machine.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FRAME_PACK_H
#define VG_FRAME_PACK_H

#include "io/io.h"

/* What is packed of each frame of a head. */
typedef struct vgi_packing {
    const vg_head *h;
    size_t values; /* numbers of a frame; 0: they are kept elsewhere */
} vgi_packing;

/* What precedes a frame's name, records, channels and values. */
typedef struct vgi_packed {
    size_t bytes; /* of the whole frame, this included */
    size_t name, records, channels;
    double time, root[3];
    bool has_time;
} vgi_packed;

/* vgi_packing_make: h is borrowed. values: are they packed? */
int vgi_packing_make(vgi_packing *p, const vg_head *h, bool values, vg_err *e) VG_MUST_CHECK;
/* vgi_pack_measure: how many bytes f takes, in to->bytes. vgi_pack: into so many bytes. */
int vgi_pack_measure(const vgi_packing *s, const vg_frame *f, vgi_packed *to, vg_err *e) VG_MUST_CHECK;
void vgi_pack(const vgi_packing *s, const vg_frame *f, const vgi_packed *head, unsigned char *to);
/* vgi_unpack: the frame again; its values are undefined when they were not packed. */
int vgi_unpack(const vgi_packing *s, const unsigned char *from, vg_frame *f, vg_err *e) VG_MUST_CHECK;
/* vgi_pack_write: n bytes to a place in a file; `name`: the frame's, for the message. */
int vgi_pack_write(int fd, uint64_t off, const void *from, size_t n, const char *name, vg_err *e) VG_MUST_CHECK;

#endif
