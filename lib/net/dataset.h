/* dataset.h: the frames on which a network is trained: features of sequences, held-out blocks, principal coordinates.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_DATASET_H
#define VG_DATASET_H

#include "net/network.h"
#include "net/regression.h"

/* A range of frames: first .. end - 1. */
typedef struct vgi_span {
    size_t first, end, sequence; /* sequence: the first frame of the sequence that contains it */
} vgi_span;

typedef struct vgi_spans {
    size_t n, cap;
    vgi_span *at;
} vgi_spans;

typedef struct vgi_dataset {
    size_t nv, parts, d, n;   /* d: numbers per frame, nv * width */
    size_t main_part;         /* index of the largest component */
    double diagonal;
    float *features;          /* n x d: from vg_featurer, lengths in D; */
    bool normal;              /* ... or as input of a network */
    float *home;              /* n x nv x 3: poses without root motion, the centroid of each part at 0 */
    double *roots, *centroids; /* n x 4, n x parts x 3 */
    size_t features_cap, home_cap, roots_cap, centroids_cap, sequences_cap;
    size_t nsequences;
    size_t *sequence;         /* first frame of each sequence */
    uint64_t digest;
    size_t repeated;          /* number of repeated poses left out */
    /* set by vgi_dataset_divide */
    vgi_spans train, held;
    /* set by vgi_dataset_find_coordinates */
    size_t rank;
    double *coordinates;      /* n x rank */
    double sigma;             /* standard deviation of the first coordinate */
} vgi_dataset;

/* vgi_dataset_add: append a frame. vertices: nv points. */
int vgi_dataset_add(vgi_dataset *s, const double *features, size_t width, const double *root, const double *centroids,
                    const double *home, vg_err *e) VG_MUST_CHECK;
int vgi_dataset_cut(vgi_dataset *s, vg_err *e) VG_MUST_CHECK; /* start another sequence */
void vgi_dataset_clear(vgi_dataset *s);

/* vgi_dataset_divide: make a sequence of every step-th frame, starting at each of the first `step` frames. Hold out a
 * share of each sequence as one block: from its frame hold_at on, at its end (SIZE_MAX), or chosen by the seed
 * (VG_HOLD_BY_SEED). The block does not depend on step. */
int vgi_dataset_divide(vgi_dataset *s, size_t step, double hold, size_t hold_at, uint64_t seed, vg_err *e) VG_MUST_CHECK;
/* vgi_dataset_find_coordinates: range and change of n's features, mean, basis, scales, and range of the coordinates,
 * from the frames in s->train. VG_EINPUT with fewer than 4. */
int vgi_dataset_find_coordinates(vgi_dataset *s, vg_network *n, size_t most, int threads, vg_err *e) VG_MUST_CHECK;
/* vgi_dataset_normalise: all features become input of n. */
void vgi_dataset_normalise(vgi_dataset *s, const vg_network *n);
/* vgi_dataset_normalised: frame i as input of n. */
void vgi_dataset_normalised(const vgi_dataset *s, const vg_network *n, size_t i, double *x);

int vgi_spans_add(vgi_spans *s, vgi_span span, vg_err *e) VG_MUST_CHECK;
size_t vgi_spans_frames(const vgi_spans *s);
/* vgi_spans_coordinates: coordinates of all frames in some spans, and the start of each span. Release with free(row),
 * free(start). */
int vgi_spans_coordinates(const vgi_spans *spans, const vgi_dataset *s, vgi_frames *f, vg_err *e) VG_MUST_CHECK;

#endif
