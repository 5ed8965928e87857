/* batch.c: the loop that all filters share. What a filter does to frames is its step.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "batch.h"

#include <stdlib.h>

vg_frame *batch_frames(const step *t)
{
    return cli_allocate(t->batch, sizeof(vg_frame), "a batch of frames");
}

void batch_frames_free(const step *t, vg_frame *in)
{
    for (size_t i = 0; i < t->batch; i++) vg_frame_clear(&in[i]);
    free(in);
}

uint64_t batch_read(const step *t, void *work, vg_source *s, vg_frame *in)
{
    uint64_t total = 0;
    size_t n = 0;
    while (cli_next(s, &in[n])) {
        if (++n == t->batch) {
            t->process(work, n, in);
            n = 0;
        }
        cli_progress(t->unit, ++total);
    }
    if (n) t->process(work, n, in);
    return total;
}

uint64_t step_run(const step *t, void *work, vg_source *s)
{
    vg_frame *in = batch_frames(t);
    t->init(work, vg_source_head(s), in);
    cli_stream_open(vg_source_head(s));
    uint64_t total = batch_read(t, work, s, in);
    if (t->finish) t->finish(work);
    cli_stream_end(vg_source_tail(s));
    batch_frames_free(t, in);
    return total;
}
