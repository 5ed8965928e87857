/* sequence_reader.h: a file with a whole sequence that is being read; used by source.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SEQUENCE_READER_H
#define VG_SEQUENCE_READER_H

#include "io/io.h"

typedef struct vgi_playing {
    const vgi_sequence_format *format; /* or NULL */
    void *state;
    vgi_input *in;
    char *subject, *stem; /* its name in messages; prefix for frames without names */
    uint64_t frames;      /* number read so far */
    vg_frame first;       /* the first frame, if it was requested early */
    bool waiting;         /* it has not been returned yet */
} vgi_playing;

/* vgi_play_open: fill p and h, which are empty. Takes ownership of in, subject and stem, also on failure; a NULL text
 * is VG_ENOMEM. */
int vgi_play_open(vgi_playing *p, const vgi_sequence_format *format, vgi_input *in, const vg_reading *how,
                  char *subject, char *stem, vg_head *h, vg_err *e) VG_MUST_CHECK;
/* vgi_play_borrow_faces: give h, which has no faces, those of the mesh file beside `path`, and its reference pose if
 * h has none. path NULL: there is no such file. VG_EINPUT if the format needs the file and it is missing. */
int vgi_play_borrow_faces(const vgi_playing *p, const char *path, vg_head *h, vg_err *e) VG_MUST_CHECK;
/* vgi_play_first: look at the first frame without consuming it. own: the head of frames. */
int vgi_play_first(vgi_playing *p, const vg_head *own, const vg_frame **first, vg_err *e) VG_MUST_CHECK;
/* vgi_play_next: 1 with a frame; 0 at the end, after which p is empty again. */
int vgi_play_next(vgi_playing *p, const vg_head *own, vg_frame *f, vg_err *e) VG_MUST_CHECK;
void vgi_play_stop(vgi_playing *p);
/* vgi_different_count: VG_EINPUT: h has a different number of points than the mesh. */
int vgi_different_count(const vg_head *h, const char *subject, size_t nv, const char *mesh, vg_err *e);

#endif
