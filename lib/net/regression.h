/* regression.h: the linear part of the prediction of the next frame (MATH 12): c+ = c + c turn + (c - before) change
 * + shift, regularised towards damped continuation, and made stable. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_REGRESSION_H
#define VG_REGRESSION_H

#include "core/core.h"

/* Frames of several sequences: rows of `numbers`; sequence i is rows start[i] .. start[i + 1] - 1. */
typedef struct vgi_frames {
    size_t numbers, n, nsequences;
    const double *row;
    const size_t *start; /* nsequences + 1 */
} vgi_frames;

typedef struct vgi_regression {
    size_t numbers;
    double *turn, *change; /* numbers x numbers */
    double *shift;
    double *first, *first_shift; /* without a previous frame: c+ = c + c first + first_shift */
} vgi_regression;

/* size of the one block for all of it, beginning with turn */
static inline size_t vgi_regression_size(size_t numbers)
{
    return 3 * numbers * numbers + 2 * numbers;
}
/* vgi_regression_view: a view of such a block, borrowed. */
static inline vgi_regression vgi_regression_view(size_t n, double *block)
{
    return (vgi_regression){n, block, block + n * n, block + 2 * n * n, block + 2 * n * n + n, block + 3 * n * n + n};
}

int vgi_regression_make(vgi_regression *r, size_t numbers, vg_err *e) VG_MUST_CHECK;
void vgi_regression_clear(vgi_regression *r);

typedef struct vgi_choice {
    double ridge, damping; /* weight of the ridge, and damping g of the continuation towards which it pulls */
    double first_ridge;    /* for the part for a first frame */
} vgi_choice;

/* vgi_regression_fit: least squares over all frames with two before them. back: frames in reverse order of time.
 * size: coordinates are divided by it. The spectral radius is limited to 1.0005. O(frames numbers^2 + numbers^3). */
int vgi_regression_fit(vgi_regression *r, const vgi_frames *f, bool back, double size, const vgi_choice *choice,
                       vg_err *e) VG_MUST_CHECK;

/* vgi_regression_even: the step from a single frame becomes the mean of the one forward and of the one backward,
 * turned round: that of the frame before is not known, and the two differ by what the motion gains in a frame. */
void vgi_regression_even(vgi_regression *there, vgi_regression *back);

/* A block that is left out of the fit and then predicted. The first two frames of each sequence in `tried` are
 * given. */
typedef struct vgi_fold {
    vgi_frames fitted, tried;
} vgi_fold;
/* vgi_regression_choose: the ridges and damping that predict the blocks best, over all folds together. */
int vgi_regression_choose(const vgi_fold *folds, size_t n, double size, int threads, vgi_choice *choice,
                          vg_err *e) VG_MUST_CHECK;

/* vgi_regression_next: next (numbers) from c and the previous frame, or NULL. */
void vgi_regression_next(const vgi_regression *r, const double *c, const double *before, double *next);

#endif
