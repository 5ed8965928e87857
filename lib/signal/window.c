/* window.c: the moving window of frames of the filters in time, and the filters applied to its numbers.
 * The weights are in weights.c, the robust filter is in robust_time.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/smooth.h"

#include <math.h>
#include <stdlib.h>

enum { CHUNK = 3 * 512 }; /* numbers of a task; a multiple of 3 and 4 */

int vgi_window_make(vgi_window *w, const vg_smoother_options *o, size_t numbers, vg_err *e)
{
    size_t all;
    *w = (vgi_window){.numbers = VGI_MOVED + numbers};
    int r = vgi_time_filter_make(&w->pose, o->filter, o->span, e);
    if (r == VG_OK) r = vgi_time_filter_make(&w->root, o->filter, o->root_span, e);
    if (r < 0) return r;
    w->reach = w->pose.reach > w->root.reach ? w->pose.reach : w->root.reach;
    w->places = 2 * w->reach + 1;
    if (!vgi_mul(w->places, w->numbers, &all)) all = SIZE_MAX / 2;
    w->ring = vgi_array(all, sizeof *w->ring, e);
    w->weight = vgi_array(w->places, sizeof *w->weight, e);
    w->frame = vgi_array(w->places, sizeof *w->frame, e);
    return w->ring && w->weight && w->frame ? VG_OK : VG_ENOMEM;
}

void vgi_window_clear(vgi_window *w)
{
    vgi_time_filter_clear(&w->pose);
    vgi_time_filter_clear(&w->root);
    free(w->ring);
    free(w->weight);
    free(w->frame);
    *w = (vgi_window){0};
}

double *vgi_window_place(const vgi_window *w, size_t i)
{
    return w->ring + (i % w->places) * w->numbers;
}

bool vgi_window_ready(const vgi_window *w)
{
    /* the first frames wait until the window is full: near the start they depend on all of it */
    size_t needs = w->given + w->reach + 1 > w->places ? w->given + w->reach + 1 : w->places;
    return w->given < w->known && (w->ended || w->known >= needs);
}

bool vgi_window_robust(const vgi_time_filter *t)
{
    return t->filter == VG_ROBUST && t->span > 0;
}

/* Set n, at, frame, and weight unless t is the robust filter, for frame number `given`. */
static void look(vgi_window *w, const vgi_time_filter *t)
{
    size_t lo;
    vgi_time_window(t, w->given, w->known, w->ended, &lo, &w->n);
    w->at = w->given - lo;
    for (size_t j = 0; j < w->n; j++) w->frame[j] = vgi_window_place(w, lo + j);
    if (!vgi_window_robust(t)) vgi_time_weights(t, w->given, w->known, lo, w->n, w->weight);
}

/* ---- the filters ---- */

typedef struct filtering {
    const vgi_window *w;
    const vgi_time_filter *t;
    size_t first, width, numbers; /* of a frame: first number, numbers per point, total */
    double *out;
} filtering;

static void filter_chunk(void *context, size_t task)
{
    const filtering *f = context;
    size_t from = task * CHUNK, to = from + CHUNK < f->numbers ? from + CHUNK : f->numbers;
    if (vgi_window_robust(f->t)) {
        const double *frame[VGI_MOST_ROBUST];
        for (size_t j = 0; j < f->w->n; j++) frame[j] = f->w->frame[j] + f->first + from;
        vgi_robust_points((to - from) / f->width, f->width, f->w->n, frame, f->w->at, (double)f->t->reach, f->out + from);
        return;
    }
    memset(f->out + from, 0, (to - from) * sizeof *f->out);
    for (size_t j = 0; j < f->w->n; j++) {
        const double *x = f->w->frame[j] + f->first;
        double weight = f->w->weight[j];
        for (size_t i = from; i < to && weight != 0; i++) f->out[i] += weight * x[i];
    }
}

void vgi_window_filter(vgi_window *w, const vgi_time_filter *t, int threads, size_t first, size_t width, size_t numbers,
                       double *out)
{
    filtering f = {.w = w, .t = t, .first = first, .width = width, .numbers = numbers, .out = out};
    look(w, t);
    vgi_parallel(threads, (numbers + CHUNK - 1) / CHUNK, filter_chunk, &f);
}

void vgi_window_root(vgi_window *w, double root[VGI_MOVED])
{
    double length = 0;
    vgi_window_filter(w, &w->root, 1, 0, 4, 4, root);
    vgi_window_filter(w, &w->root, 1, 4, 3, 3, root + 4);
    for (int k = 0; k < 4; k++) length += root[k] * root[k];
    if (!(length > 0)) memcpy(root, vgi_window_place(w, w->given), 4 * sizeof *root), length = 1;
    for (int k = 0; k < 4; k++) root[k] /= sqrt(length);
}

void vgi_same_side(const double before[4], double q[4])
{
    double same = 0;
    for (int k = 0; k < 4; k++) same += before[k] * q[k];
    for (int k = 0; k < 4 && same < 0; k++) q[k] = -q[k];
}
