/* fitting.h: the driver of fits. It collects poses once and passes over them any number of times; every Nth pose
 * may be held out; fits are judged by the distances of vertices.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FITTING_H
#define VG_FITTING_H

#include "cli.h"

enum { FITTING_BATCH = 32 };

typedef struct fitting {
    vg_head *h;
    vg_poses *poses;
    size_t holdout; /* hold out every Nth pose; 0: none */
    size_t n;       /* poses */
} fitting;

/* fitting_collect: read all frames of s. `what` completes the message "no poses to ..." ("fit a map to"). */
void fitting_collect(fitting *f, vg_source *s, long holdout, const char *what);
void fitting_clear(fitting *f);
bool fitting_is_held_out(const fitting *f, size_t i);

/* Some poses: n <= FITTING_BATCH numbers of poses, and their values. */
typedef struct fitting_batch {
    size_t n, index[FITTING_BATCH];
    const double *values[FITTING_BATCH];
} fitting_batch;

typedef void fitting_step(void *context, const fitting_batch *b);

/* fitting_stream: each(context, batch) for the frames of s as they come, for fits that need each pose once. Nothing is
 * kept. Returns how many there were. */
uint64_t fitting_stream(vg_source *s, fitting_step *each, void *context);
/* fitting_pass: call each(context, batch) for all poses i with wanted(context, i), in order; wanted NULL: for all. */
void fitting_pass(const fitting *f, bool (*wanted)(void *context, size_t i),
                  fitting_step *each, void *context);
/* fitting_sample: take at most `most` of the poses that are not held out: those whose number is a multiple of a
 * power of two. Sets their numbers and copies of their values; returns the count. */
size_t fitting_sample(const fitting *f, size_t most, size_t *index, double **values);

/* Distances of vertices, in mesh units. */
typedef struct fitting_errors {
    double sum, most; /* sum of the mean distances of the poses; the largest distance */
    size_t poses;
    double *first, *second; /* per vertex: sums of the distance and of its square; NULL: not needed */
} fitting_errors;

/* fitting_compare: add a pose. centred: move both centroids to 0 first. */
void fitting_compare(fitting_errors *x, const double *truth, const double *result, size_t nv, bool centred);
double fitting_mean(const fitting_errors *x); /* 0 without poses */
/* fitting_sigma: the largest over the vertices of the standard deviation over the poses (T 5.36). */
double fitting_sigma(const fitting_errors *x, size_t nv);

#endif
