/* fitting.h: the driver of fits: poses are collected once, then passed over any number of times; every Nth may be held
 * out; fits are judged by the distances of vertices.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FITTING_H
#define VG_FITTING_H

#include "cli.h"

enum { FITTING_BATCH = 32 };

typedef struct fitting {
    vg_head *h;
    vg_poses *poses;
    size_t holdout; /* of N poses the last is held out; 0: none is */
    size_t n;       /* poses */
} fitting;

/* fitting_collect: all frames of s. `what`: what cannot be done without poses ("fit a map to"). */
void fitting_collect(fitting *f, vg_source *s, long holdout, const char *what);
void fitting_clear(fitting *f);
bool fitting_is_held_out(const fitting *f, size_t i);

/* Some poses: n <= FITTING_BATCH numbers of poses, and their values. */
typedef struct fitting_batch {
    size_t n, index[FITTING_BATCH];
    const double *values[FITTING_BATCH];
} fitting_batch;

/* fitting_pass: step(context, batch) for all poses i that wanted(context, i) wants, in their order; wanted NULL: all. */
void fitting_pass(const fitting *f, bool (*wanted)(void *context, size_t i),
                  void (*step)(void *context, const fitting_batch *b), void *context);
/* fitting_sample: at most `most` of the poses that are not held out: those whose number is a multiple of a power of
 * two. Their numbers and copies of their values; how many. */
size_t fitting_sample(const fitting *f, size_t most, size_t *index, double **values);

/* Distances of vertices, in mesh units. */
typedef struct fitting_errors {
    double sum, most; /* of the mean distance of each pose; the largest distance */
    size_t poses;
    double *first, *second; /* per vertex: sums of the distance and of its square; NULL: not wanted */
} fitting_errors;

/* fitting_compare: add a pose. centred: after the centroids have been laid on one another. */
void fitting_compare(fitting_errors *x, const double *truth, const double *result, size_t nv, bool centred);
double fitting_mean(const fitting_errors *x); /* 0 without poses */
/* fitting_sigma: the largest over the vertices of the standard deviation over the poses (T 5.36). */
double fitting_sigma(const fitting_errors *x, size_t nv);

#endif
