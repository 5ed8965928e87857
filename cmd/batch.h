/* batch.h: the loop that all filters share: source -> step -> stream. A program fills in a step and runs it.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_BATCH_H
#define VG_BATCH_H

#include "cli.h"

/* What a program does to a sequence. `work` is the program's own state. */
typedef struct step {
    size_t batch;     /* frames that are processed together, at least 1 */
    const char *unit; /* what progress counts: "poses" */
    /* Called once, with the head of the input, which the step changes into that of the output, and with the
     * `batch` frames that will be read into; the step may allocate them (vg_frame_shape). */
    void (*init)(void *work, vg_head *h, vg_frame *in);
    /* Called with the next 1 <= n <= batch frames; fewer than `batch` only at the end. The step may change them.
     * It writes finished frames with cli_stream_put, in this call or later. */
    void (*process)(void *work, size_t n, vg_frame *in);
    /* Called once at the end of the input, to write the remaining frames. May be NULL. */
    void (*finish)(void *work);
} step;

/* step_run: call init, open the output, process all frames, call finish, end the output. Returns the number of
 * frames read. */
uint64_t step_run(const step *t, void *work, vg_source *s);

/* batch_read: read all frames of s in batches, for programs that write no stream. init and finish are not called. */
uint64_t batch_read(const step *t, void *work, vg_source *s, vg_frame *in);
/* batch_frames, batch_frames_free: allocate and free the frames of a batch. */
vg_frame *batch_frames(const step *t);
void batch_frames_free(const step *t, vg_frame *in);

#endif
