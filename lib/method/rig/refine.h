/* refine.h: the regression of what an envelope leaves of the poses, and trials of its ridge in poses left out.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_REFINE_H
#define VG_REFINE_H

#include "method/rig/rig_sums.h"

/* An envelope before refinement, with what it was fitted from. All borrowed. */
typedef struct vgi_envelope {
    const vgi_rig_sums *sums;
    const vg_rig *rig; /* with weights */
    const double *reference;
    const bool *in_face; /* per vertex: others follow their skin and are not refined */
    const vg_map *base;
    int threads;
} vgi_envelope;

/* vgi_refine: add to the rows of m, a copy of x->base, the regression with this ridge; 0: nothing. */
int vgi_refine(const vgi_envelope *x, double ridge, vg_map *m, vg_err *e) VG_MUST_CHECK;

/* The regressions of n ridges. */
typedef struct vgi_trials {
    size_t n;
    uint32_t *bone; /* per vertex: the bones of its regression */
    uint8_t *count; /* per vertex: their number */
    double *add;    /* per vertex, ridge and bone: 4 numbers, to be added to the row relative to the joint */
} vgi_trials;

int vgi_trials_make(vgi_trials *t, const vgi_envelope *x, size_t n, const double *ridge, vg_err *e) VG_MUST_CHECK;
void vgi_trials_clear(vgi_trials *t);
/* vgi_trials_judge: see vg_rig_fitter_judge. */
int vgi_trials_judge(const vgi_trials *t, const vgi_envelope *x, size_t n, const double *const *poses,
                     const double *const *transforms, double *const *sums, vg_err *e) VG_MUST_CHECK;

#endif
