/* error_plot.h: the plot of vg-diff: errors over the frames, and how they are distributed.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef ERROR_PLOT_H
#define ERROR_PLOT_H

#include "cli.h"

enum { ERROR_CURVES = 3 }; /* mean, p95, max */

typedef struct error_curves { /* of each frame, in D */
    size_t n, cap[ERROR_CURVES];
    double *at[ERROR_CURVES];
} error_curves;

/* error_plot_check: end with usage unless the name ends in .svg or .png and the two other outputs (or NULL) are other files. */
void error_plot_check(const char *file, const char *report, const char *stream);
/* error_curves_add: the errors of the next frame, in units of the mesh; those of a mesh without extent are left out. */
void error_curves_add(error_curves *c, const double errors[ERROR_CURVES], double diagonal);
void error_curves_clear(error_curves *c);
/* error_plot_write: write to the file, which becomes the output; nothing else may be written after it. */
void error_plot_write(const error_curves *c, const vg_measure_stats *m, const char *truth, const char *result, const char *file);

#endif
