/* signal_texts.c: files of vg-fitsignal --place, vg-sample --retime and --curve.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal_texts.h"
#include "lines.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The frame that a line "frame I X Y" places; without "frame I" the next one. */
static size_t read_place(lines *l, size_t next, size_t frames, double at[2])
{
    double x[3];
    bool named = lines_word(l, "frame");
    size_t n = lines_numbers(l, x, 3);
    if (n != (named ? 3 : 2)) lines_stop(l, named ? "'frame NUMBER X Y' expected" : "two numbers expected");
    if (named && !(x[0] >= 1 && x[0] <= (double)frames && x[0] == floor(x[0])))
        lines_stop(l, "there is no frame %g: they are numbered from 1 to %zu", x[0], frames);
    at[0] = x[n - 2], at[1] = x[n - 1];
    return named ? (size_t)x[0] - 1 : next;
}

double *read_places(const char *file, size_t frames)
{
    size_t n = 0;
    double *place = cli_allocate(frames, 2 * sizeof *place, "places"), at[2];
    bool *known = cli_allocate(frames, sizeof *known, "places");
    lines l = lines_open(file);
    memset(known, 0, frames * sizeof *known);
    while (lines_next(&l)) {
        if (lines_word(&l, "control")) continue; /* of vg-info --positions: the curve is fitted to the frames */
        if (n == frames) lines_stop(&l, "there are only %zu frames to place", frames);
        size_t i = read_place(&l, n, frames, at);
        if (known[i]) lines_stop(&l, "frame %zu is placed twice", i + 1);
        memcpy(place + 2 * i, at, sizeof at);
        known[i] = true;
        n++;
    }
    if (n < frames) cli_stop(VG_EINPUT, "'%s' places %zu frames of %zu", file, n, frames);
    lines_close(&l);
    free(known);
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
