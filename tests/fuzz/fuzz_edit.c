/* fuzz_edit.c: lines that change a signal: whatever they say, the signal is refused or can be sampled, with finite numbers.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "vg.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FRAMES = 6, POINTS = 2 };

static int fit(vg_signal *s)
{
    vg_signal_stats r;
    double reference[3 * POINTS] = {0, 0, 0, 1, 0, 0}, *poses = calloc(FRAMES * 3 * POINTS, sizeof *poses);
    vg_body body = {.mesh = {.nv = POINTS}, .reference = reference};
    const vg_signal_options o = {.tolerance = 1e-3, .threads = 1};
    if (!poses) abort();
    for (size_t i = 0; i < FRAMES * 3 * POINTS; i++) poses[i] = sin((double)(i * i));
    int result = vg_signal_fit(s, &body, poses, FRAMES, &o, &r, NULL);
    if (result == VG_OK) vg_signal_stats_clear(&r);
    return result;
}

static void sample(const vg_signal *s)
{
    vg_sampler *p;
    double *x = calloc(s->m + 1, sizeof *x), shape[3 * POINTS], *shapes[] = {shape}, at[2];
    if (!x || vg_sampler_new(&p, s, false, NULL) < 0) abort();
    for (double time = 0.5; time < FRAMES + 1; time += 0.25) {
        vg_sampler_position(p, time, at);
        if (!isfinite(at[0]) || !isfinite(at[1])) abort();
        vg_sampler_coordinates(p, 1, at, x);
        vg_sampler_shapes(p, 1, x, shapes);
    }
    vg_sampler_free(&p);
    free(x);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    vg_signal s;
    vg_retime r = {0};
    vg_err e;
    if (size > 4096) return 0;
    if (fit(&s) < 0) abort();
    if (vg_signal_edit(&s, &r, (const char *)data, size, "edits.txt", &e) == VG_OK) {
        sample(&s);
        double old_time;
        for (double t = -1; t < FRAMES + 2 && r.n; t += 0.5)
            if (vg_retime_at(&r, t, &old_time, &e) < 0 || !isfinite(old_time)) abort();
    } else if (e.code != VG_EINPUT && e.code != VG_ENOMEM) abort();
    vg_retime_clear(&r);
    vg_signal_clear(&s);
    return 0;
}
