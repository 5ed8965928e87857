/* frames.h: channels of frames, compared and copied. SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_TEST_FRAMES_H
#define VG_TEST_FRAMES_H

#include "vg.h"

#include <stdlib.h>
#include <string.h>

static inline bool same_channel(const vg_channel *a, const vg_channel *b)
{
    size_t n = a->width * a->count;
    if (strcmp(a->name, b->name) || strcmp(a->unit, b->unit) || strcmp(a->element_name, b->element_name)) return false;
    if (a->element != b->element || a->width != b->width || a->count != b->count) return false;
    if (!a->numbers != !b->numbers || !a->vertices != !b->vertices) return false;
    if (a->precision && b->precision && a->precision != b->precision) return false; /* 0: that of the values */
    return !n || (a->vertices ? !memcmp(a->vertices, b->vertices, n * sizeof *a->vertices)
                              : !memcmp(a->numbers, b->numbers, n * sizeof *a->numbers));
}

/* The same channels in any order. */
static inline bool same_channels(const vg_frame *a, const vg_frame *b)
{
    if (a->nchannels != b->nchannels) return false;
    for (size_t i = 0; i < a->nchannels; i++) {
        const vg_channel *c = vg_frame_channel(b, a->channels[i].name);
        if (!c || !same_channel(&a->channels[i], c)) return false;
    }
    return true;
}

static inline void copy_channels(vg_frame *to, const vg_frame *from)
{
    vg_frame_drop_all(to);
    for (size_t i = 0; i < from->nchannels; i++) {
        const vg_channel *c = &from->channels[i];
        vg_channel *d;
        if (vg_frame_add(to, c->name, c->unit, c->element, c->width, c->count, &d, NULL) < 0) abort();
        size_t n = c->width * c->count;
        if (n && c->vertices) memcpy(d->vertices, c->vertices, n * sizeof *d->vertices);
        else if (n) memcpy(d->numbers, c->numbers, n * sizeof *d->numbers);
        d->precision = c->precision;
    }
}

#endif
