/* batch.h: the one loop of the filters: source -> step -> stream. A program fills in a step and runs it.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_BATCH_H
#define VG_BATCH_H

#include "cli.h"

/* What a program does to a sequence. `work` is the program's own state. */
typedef struct step {
    size_t batch;     /* frames that are processed together, at least 1 */
    const char *unit; /* what progress counts: "poses" */
    /* Called once, with the head of the input, which is to become that of the output, and the `batch` frames that will
     * be read into, which may be given room (vg_frame_shape). */
    void (*init)(void *work, vg_head *h, vg_frame *in);
    /* Called with the next 1 <= n <= batch frames; fewer than `batch` only at the end. They may be changed. What is
     * ready is written with cli_stream_put, now or later. */
    void (*process)(void *work, size_t n, vg_frame *in);
    /* Called once, when the input has ended, to write what is left; NULL: nothing is. */
    void (*finish)(void *work);
} step;

/* step_run: init, open the output, process all frames, finish, end the output. Returns the number of frames read. */
uint64_t step_run(const step *t, void *work, vg_source *s);

/* batch_read: the reading half of it, for programs that write no stream: all frames of s in batches. init and finish
 * are not called. */
uint64_t batch_read(const step *t, void *work, vg_source *s, vg_frame *in);
/* batch_frames, batch_frames_free: room for the frames of a batch. */
vg_frame *batch_frames(const step *t);
void batch_frames_free(const step *t, vg_frame *in);

#endif
