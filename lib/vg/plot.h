/* vg/plot.h: charts of numbers: curves and bars, as PNG or SVG.
 * A part of vg.h, which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_PLOT_H
#define VG_PART_PLOT_H

#include "vg/core.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Numbers of one kind. All are finite. */
typedef struct vg_series {
    const char *name; /* in the legend; of bars it is not shown */
    size_t n;
    const double *x;  /* n; NULL: 0, 1, 2 ... Bars: n + 1 ascending edges */
    const double *y;  /* n; on a logarithmic axis numbers that are not above 0 leave a gap */
} vg_series;

typedef struct vg_chart {
    const char *title, *x, *y; /* x, y: what the axes count */
    bool log_x, log_y;         /* logarithmic axes */
    bool bars;                 /* of the first series; else curves, a point where there is one number */
    size_t n;                  /* at most VG_PLOT_SERIES */
    const vg_series *series;
} vg_chart;
enum { VG_PLOT_SERIES = 6, VG_PLOT_CHARTS = 8 };

/* vg_plot_write: n charts one below another, as SVG or PNG, to fd (borrowed). `name` is used in messages. The same
 * numbers give the same bytes. */
int vg_plot_write(const vg_chart *charts, size_t n, bool svg, int fd, const char *name, vg_err *e) VG_MUST_CHECK;

#ifdef __cplusplus
}
#endif

#endif
