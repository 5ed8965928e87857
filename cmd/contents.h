/* contents.h: vg-info: what follows from reading all frames of a sequence, and the reports of it.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CONTENTS_H
#define VG_CONTENTS_H

#include "report.h"

/* A channel of frames. */
typedef struct channel_note {
    char *name, *unit, *element; /* of the first frame that has it */
    size_t width;
    uint64_t frames;
    double least, most; /* numbers, or vertices of lists */
} channel_note;

/* Frames that are called "Walk.0001", "Walk.0002" and so on. */
typedef struct animation {
    char *name;
    uint64_t frames;
    double first_time, last_time; /* NaN: it has none */
} animation;

/* What follows from all frames. */
typedef struct contents {
    uint64_t frames, timed, turned, extra; /* turned: that say how joints have turned; extra: unknown records before
                                              frames */
    channel_note *channels;
    size_t nchannels, nanimations;
    animation *animations;
    char *first, *last;            /* names */
    double first_time, last_time;
    double D; /* of the first frame of vertices */
    uint64_t digest;
} contents;

/* contents_read: read to the end, which is what proves that the input is whole. c is empty. digested: make c->digest;
 * channels: note what comes with frames; list: gets a row per frame, or is NULL. */
void contents_read(contents *c, vg_source *s, bool digested, bool channels, report *list);

void report_frames(report *r, const vg_head *h, const contents *c);
/* report_animations: a single one is reported with the frames. */
void report_animations(report *r, const contents *c);
void report_channels(report *r, const contents *c);

#endif
