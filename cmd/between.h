/* between.h: --interpolate, --at and --smooth of vg-deform: which moments are asked for, and the path through
 * vectors.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_BETWEEN_H
#define VG_BETWEEN_H

#include "cli.h"

extern struct between_options {
    long frames;    /* --interpolate; 0: not given */
    double *at;     /* --at; NULL: not given */
    size_t count;   /* of at */
    bool smooth;
} between;

/* between_take_at: "0,0.5,1" into between.at; to be given to cli_option. */
void between_take_at(const char *list, void *context);
/* between_wanted: is --interpolate or --at there? */
bool between_wanted(void);
/* between_count, between_moment: how many moments are asked for, and number i of them, in keys (0: the first) when
 * there are `keys` >= 1. */
size_t between_count(void);
double between_moment(size_t i, size_t keys);

/* A key of any path, for its label. */
typedef struct between_key {
    const char *name;
    bool has_time;
    double time;
} between_key;
/* between_label: name f after moment t of the keys ("a~b@0.25", at a key the key's own) and give it its time. */
void between_label(vg_frame *f, const between_key *keys, size_t nkeys, double t);

/* between_run: the whole job for a sequence of vertices, vectors or deformations,
 * from its head to the end of the output. */
void between_run(vg_source *s);

#endif
