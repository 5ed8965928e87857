/* record.h: the outer layer of the stream: file header, records, checksums, END (fmt/STREAM.md, sections 1 and 2).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RECORD_H
#define VG_RECORD_H

#include "io/io.h"
#include "model/artefact.h"

/* Counts for reading or writing. */
typedef struct vgi_tally {
    uint64_t records;
    void *sum; /* running XXH64 over header checksums */
} vgi_tally;

int vgi_tally_init(vgi_tally *t, vg_err *e) VG_MUST_CHECK;
void vgi_tally_clear(vgi_tally *t);

/* vgi_record_begin_read: check the file header. */
int vgi_record_begin_read(vgi_input *in, vg_err *e) VG_MUST_CHECK;
/* vgi_record_read: read the next record into *r, reusing its payload buffer. Returns 1: a record; 0: the END mark,
 * which was checked and ends the input. */
int vgi_record_read(vgi_input *in, vgi_tally *t, vg_record *r, vg_err *e) VG_MUST_CHECK;
/* vgi_record_may_wait: whether reading the next frame may wait for input: false if it comes next and has arrived. */
bool vgi_record_may_wait(const vgi_input *in);

/* Where records are written. Small ones are collected and written together, for each call of the system costs as much
 * as 20 kB: until a piece is full, until vgi_recorder_flush, or until records come slowly, so that none of them is held
 * back while the next one is computed. Large records are written from where they are. */
typedef struct vgi_recorder {
    int fd;
    const char *name; /* in messages; borrowed */
    vgi_tally tally;
    unsigned char *waiting;
    size_t nwaiting;
    int64_t last; /* when the last record came, in ns */
    bool failed;  /* what was written may end anywhere */
} vgi_recorder;

/* vgi_recorder_init: for fd, which is borrowed; the file header is the first to be written. On failure there is nothing
 * to clear. */
int vgi_recorder_init(vgi_recorder *w, int fd, const char *name, vg_err *e) VG_MUST_CHECK;
int vgi_recorder_flush(vgi_recorder *w, vg_err *e) VG_MUST_CHECK;
void vgi_recorder_clear(vgi_recorder *w); /* what waits is not written */

/* vgi_record_write: the payload is given in up to 3 parts, so that large ones need not be copied together. */
typedef struct vgi_part {
    const void *data;
    size_t size;
} vgi_part;
int vgi_record_write(vgi_recorder *w, const char *tag, uint32_t flags, const vgi_part *parts, size_t nparts,
                     vg_err *e) VG_MUST_CHECK;
/* vgi_record_end_write: the END mark; everything is written. */
int vgi_record_end_write(vgi_recorder *w, vg_err *e) VG_MUST_CHECK;

#endif
