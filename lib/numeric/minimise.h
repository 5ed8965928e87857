/* minimise.h: minimises a smooth function of many numbers by its gradient (L-BFGS; Nocedal and Wright 2006, algorithm
 * 7.5).
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_MINIMISE_H
#define VG_MINIMISE_H

#include "core/core.h"

enum { VGI_MINIMISE_TRIALS = 8 };

/* A function whose evaluation at eight points costs little more than at one. It is evaluated at eight steps along a
 * direction, and the best one is taken. */
typedef struct vgi_function {
    size_t n;
    /* f[i] and the gradient g[i] (n numbers) at x[i], for VGI_MINIMISE_TRIALS points */
    void (*look)(void *context, double *const *x, double *f, double *const *g);
    void *context;
} vgi_function;

typedef struct vgi_minimum {
    double first, value; /* value at the start and at the end */
    size_t rounds;
} vgi_minimum;

/* vgi_minimise: x (n numbers): the start; on return the best point found. Ends after `rounds` rounds, when a round
 * lowers the value by less than the fraction `gain`, or when no step lowers it. The value never increases. */
int vgi_minimise(const vgi_function *f, double *x, size_t rounds, double gain, vgi_minimum *m, vg_err *e) VG_MUST_CHECK;

#endif
