/* signal_texts.c: files of vg-fitsignal --place, vg-sample --retime and --curve.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal_texts.h"
#include "lines.h"

double *read_places(const char *file, size_t frames)
{
    size_t n = 0;
    double *place = cli_allocate(frames, 2 * sizeof *place, "places");
    lines l = lines_open(file);
    for (; lines_next(&l); n++) {
        if (n == frames) lines_stop(&l, "there are only %zu frames to place", frames);
        if (lines_numbers(&l, place + 2 * n, 2) != 2) lines_stop(&l, "two numbers expected");
    }
    if (n < frames) cli_stop(VG_EINPUT, "'%s' places %zu frames of %zu", file, n, frames);
    lines_close(&l);
    return place;
}

void read_retime(const char *file, size_t frames, vg_retime *r)
{
    vg_err e;
    lines l = lines_open(file);
    double x[2];
    while (lines_next(&l)) {
        if (lines_numbers(&l, x, 2) != 2) lines_stop(&l, "an old and a new time expected");
        if (!(x[0] >= 1 && x[0] <= (double)frames))
            lines_stop(&l, "time %g is not in the sequence, which is from 1 to %zu", x[0], frames);
        if (vg_retime_add(r, x[0], x[1], &e) < 0) lines_stop(&l, "%s", e.message);
    }
    if (r->n < 2) cli_stop(VG_EINPUT, "'%s' has fewer than two pairs of times", file);
    lines_close(&l);
}

double *read_curve(const char *file, size_t *n, bool *controls)
{
    lines l = lines_open(file);
    size_t cap = 0;
    double *point = NULL;
    *n = 0, *controls = false;
    while (lines_next(&l)) {
        bool control = lines_word(&l, "control");
        if (*n == cap) cap = cap ? 2 * cap : 64, point = cli_resize(point, cap, 2 * sizeof *point, "the curve");
        if (lines_numbers(&l, point + 2 * *n, 2) != 2) lines_stop(&l, "'X Y' or 'control X Y' expected");
        if (*n && control != *controls) lines_stop(&l, "control points and points that the curve goes through are mixed");
        *controls = control;
        ++*n;
    }
    lines_close(&l);
    return point;
}
