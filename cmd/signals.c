/* signals.c: describes a signal in reports.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signals.h"
#include "cli.h"

#include <stdlib.h>

const char *signal_space(vg_space space)
{
    static const char *const names[] = {"unknown", "vertices", "vectors", "gradients", "rotations", "lengths"};
    return names[space];
}

void report_signal(report *r, const vg_signal *s)
{
    static const char *const layouts[] = {"unknown", "plain", "ring", "time", "placed"};
    size_t floats = vg_signal_floats(s);
    if (!s->n) return;
    report_gap(r);
    report_group(r, "signal");
    report_put(r, "frames", "signal of", report_count(s->n));
    report_put(r, "control_points", "control points", report_count(s->k));
    report_put(r, "sites", "sites", report_count(s->l));
    report_put(r, "coordinates", "coordinates", report_count(s->m));
    report_put(r, "space", "shapes of", report_text(signal_space(s->space)));
    report_put(r, "dimension", "dimension", report_count(s->d));
    report_put(r, "basis_bits", "basis bits", report_count(s->bits));
    report_put(r, "rooted", NULL, report_flag(s->rooted));
    report_put(r, NULL, "root", report_text(s->rooted ? "a separate signal" : "in the shapes"));
    report_put(r, "layout", "layout", report_text(layouts[s->layout]));
    report_put(r, "layout_weight", NULL, report_number(s->layout_weight));
    report_put(r, "layout_ratio", "deviation", report_number(s->layout_ratio));
    report_put(r, "numbers", "numbers", report_count(floats));
    report_put(r, "compression", "compression", report_number((double)s->n * (double)s->d / (double)floats));
    report_put(r, "error_shape", "error of shape, D", report_number(s->error_shape));
    report_put(r, "error_pose", "and of pose, D", report_number(s->error_pose));
    report_put(r, "error", "and of time, D", report_number(s->error_time));
    report_put(r, "error_rms", "rms, D", report_number(s->error_rms));
    report_end(r);
}

void write_positions(FILE *f, const vg_signal *s)
{
    bool *site = calloc(s->n, sizeof *site);
    for (size_t i = 0; site && i < s->l; i++) site[s->site[i]] = true;
    fprintf(f, "# %zu control points of the curve, and %zu frames in the plane: lines for vg-sample --edit\n", s->k, s->n);
    for (size_t i = 0; i < s->k; i++)
        fprintf(f, "control %zu %.17g %.17g\n", i + 1, s->control[2 * i], s->control[2 * i + 1]);
    for (size_t i = 0; i < s->n; i++)
        fprintf(f, "frame %zu %.17g %.17g%s\n", i + 1, s->position[2 * i], s->position[2 * i + 1],
                site && site[i] ? " # a site" : "");
    free(site);
}

void write_curve(FILE *f, const vg_signal *s, double diagonal)
{
    enum { PARTS = 4 };
    vg_trace t;
    vg_err e;
    if (vg_signal_trace(&t, s, PARTS, &e) < 0) cli_die(&e);
    fprintf(f, "# %zu points of the curve: X Y # time, distance from a cubic spline through the frames%s\n", t.n,
            s->space == VG_SPACE_VERTICES ? " in D (rms)" : "");
    if (s->space != VG_SPACE_VERTICES) diagonal = 1;
    for (size_t i = 0; i < t.n; i++)
        fprintf(f, "%.17g %.17g # %g %.3g\n", t.position[2 * i], t.position[2 * i + 1], 1 + (double)i / PARTS,
                diagonal > 0 ? t.deviation[i] / diagonal : 0);
    for (size_t i = 0; i < t.ncrossings; i++)
        fprintf(f, "# the curve crosses itself at the times %.6g and %.6g\n", t.crossing[2 * i], t.crossing[2 * i + 1]);
    vg_trace_clear(&t);
}
