/* signals.h: a signal in reports, and as lines for vg-sample.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CMD_SIGNALS_H
#define VG_CMD_SIGNALS_H

#include "report.h"

const char *signal_space(vg_space space); /* "vertices", ...: as vg-fitsignal --space names them */
/* report_signal: sizes and errors, as in table 1 of Cashman and Hormann. */
void report_signal(report *r, const vg_signal *s);
/* write_positions: one line per control point and frame, for vg-sample --edit; comments mark the sites. */
void write_positions(FILE *f, const vg_signal *s);
/* write_curve: points of the curve, four per frame, for vg-sample --curve; comments give times, deviations in
 * units of `diagonal`, and crossings. */
void write_curve(FILE *f, const vg_signal *s, double diagonal);

#endif
