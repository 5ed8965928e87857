/* deform.h: internal part of the measurement of deformations. The public part is in vg/vectors.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_DEFORM_H
#define VG_DEFORM_H

#include "core/core.h"

/* vgi_deformer_of_vectors: like vg_deformer_new, for a reference given by its vectors (one per corner, copied) and
 * D. */
int vgi_deformer_of_vectors(vg_deformer **d, const vg_graph *g, const double *vectors, double diagonal, int threads,
                            vg_err *e) VG_MUST_CHECK;

#endif
