/* signals.h: a signal in reports, and as the lines that vg-sample --edit takes.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CMD_SIGNALS_H
#define VG_CMD_SIGNALS_H

#include "report.h"

/* report_signal: sizes and errors, as in the source's table 1. */
void report_signal(report *r, const vg_signal *s);
/* write_positions: a line for each control point and frame; comments say which frames are sites. */
void write_positions(FILE *f, const vg_signal *s);
/* write_curve: points of the curve, four to a frame, as vg-sample --curve takes them; comments give times, deviations, in
 * units of `diagonal`, and crossings. */
void write_curve(FILE *f, const vg_signal *s, double diagonal);

#endif
