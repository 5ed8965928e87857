/* guess.h: the first guess of a pose from its vectors, and its residual.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GUESS_H
#define VG_GUESS_H

#include "core/isa.h"
#include "method/vectors/metric.h"

/* One step of the walk: x(vertex of `corner`) = x(vertex of `from`) + w(corner) - w(from),
 * both corners of one face. */
typedef struct vgi_step {
    uint32_t corner, from;
} vgi_step;

/* x, y, z and an unused number: one register of four, or two of two. */
typedef double vgi_point[4] __attribute__((aligned(32)));

typedef struct vgi_guesser { /* all borrowed */
    const vg_graph *g;
    const vgi_metric *metric;
    const vgi_step *walk;    /* steps from one vertex, or from some of the anchors, to all others */
    size_t nsteps;
    uint32_t pinned;         /* the start vertex; nv or more: from anchors */
    const uint32_t *anchors; /* the held vertices */
    size_t nanchors;
} vgi_guesser;

typedef struct vgi_guess_kernel {
    void (*guess)(const vgi_guesser *s, const double *w, const double *anchors, double *x, double *rhs,
                  vgi_point *space);
} vgi_guess_kernel;
VGI_KERNEL(vgi_guess_kernel)

/* vgi_guess: x (nv points): the pose obtained by the walk, relative to the first anchor or, without anchors, the
 * pinned vertex, so that a pose far from the origin loses no digits. rhs (nv x 3): the residual A G (W* - A' x).
 * anchors: nanchors points. space: nv + max_corners. */
static inline void vgi_guess(const vgi_guesser *s, const double *w, const double *anchors, double *x, double *rhs,
                             vgi_point *space)
{
    vgi_guess_kernel_now()->guess(s, w, anchors, x, rhs, space);
}

#endif
