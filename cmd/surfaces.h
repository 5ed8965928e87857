/* surfaces.h: vg-diff --surface: the distance between the surfaces of two sequences, frame by frame, and its report.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SURFACES_H
#define VG_SURFACES_H

#include "report.h"

typedef struct surfaces {
    vg_surface_measures *measures;
    double diagonal; /* D of the truth's reference pose */
    report *frames;  /* a row for each; NULL: none are wanted */
} surfaces;

/* surfaces_begin: the meshes are borrowed until _end. Ends the program when there is nothing to measure. */
void surfaces_begin(surfaces *s, const vg_body *truth, const vg_body *result, report *frames);
/* surfaces_add: frame i of both. The distance of each vertex of the result, valid until the next call. */
const double *surfaces_add(surfaces *s, size_t i, const char *name, const double *truth, const double *result);
/* surfaces_report: both directions, and their explanation. found: mean, rms, p95, max, the larger of both
 * directions. */
void surfaces_report(const surfaces *s, report *r, double found[4]);
void surfaces_end(surfaces *s);

#endif
