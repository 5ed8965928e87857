/* fuzz_joints.c: joints over time as text, of a skeleton that is given: refused, or finite positions and unit turns
 * of all joints.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void demand(bool holds)
{
    if (!holds) abort();
}

/* "a" with "b" and "c", "b" reaching with its end for "d", which hangs on "a". */
static vg_head *skeleton(void)
{
    static const char text[] = "a - 0 0 0 0 1 0\nb a 0 1 0 1 1 0\nc a 0 -1 0 0 -2 0\nd a 1.01 1 0 2 1 0\n";
    static vg_head h;
    vgi_input *in;
    void *state = NULL;
    vg_err e;
    if (h.count) return &h;
    demand(vgi_input_memory(&in, text, sizeof text - 1, "skeleton", &e) == VG_OK);
    demand(vgi_sequence_skeleton.open(&state, &h, in, &(vg_reading){0}, "'skeleton'", &e) == VG_OK);
    vgi_sequence_skeleton.close(state);
    vgi_input_free(&in);
    return &h;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const vgi_sequence_format *format = &vgi_sequence_joints;
    const vg_head *with = skeleton();
    if (size > 1 << 16) return 0;
    vgi_input *in;
    void *state = NULL;
    vg_head h = {0};
    vg_frame f = {0};
    vg_err e;
    (void)format->sniff(data, size < 4096 ? size : 4096);
    int r = vgi_input_memory(&in, data, size, "fuzz", &e);
    if (r == VG_OK) r = format->open(&state, &h, in, &(vg_reading){0}, "'fuzz'", &e);
    if (r == VG_OK) r = format->join(state, with, &e);
    if (r == VG_OK) r = vg_frame_shape(&f, with, &e);
    while (r >= 0 && (r = format->next(state, &f, &e)) > 0) {
        size_t n;
        const double *turns = vg_frame_turns(&f, &n);
        demand(*f.name && vgi_finite(f.values, 3 * with->count) && n == with->count);
        for (size_t j = 0; j < n; j++) {
            const double *q = turns + 4 * j;
            double square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
            demand(square > 1 - 1e-9 && square < 1 + 1e-9);
        }
    }
    format->close(state);
    vg_frame_clear(&f);
    vg_head_clear(&h);
    vgi_input_free(&in);
    return 0;
}
