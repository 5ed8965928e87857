/* error_plot.c: the plot of vg-diff: errors over the frames, and the distribution of vertices over errors, in D.
 * Charts are drawn in lib/view/plot.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "error_plot.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void error_plot_check(const char *file, const char *report, const char *stream)
{
    if (!cli_ends_with(file, ".svg") && !cli_ends_with(file, ".png"))
        cli_usage("--plot '%s': the name must end in .svg or .png", file);
    if (report && cli_same_output(file, report)) cli_usage("'%s' cannot be both the plot and the report", file);
    if (stream && cli_same_output(file, stream)) cli_usage("'%s' cannot be both the plot and the stream", file);
}

void error_curves_add(error_curves *c, const double errors[ERROR_CURVES], double diagonal)
{
    if (!(diagonal > 0)) return;
    for (size_t i = 0; i < ERROR_CURVES; i++) {
        if (c->n == c->cap[i]) {
            c->cap[i] = c->n ? 2 * c->n : 256;
            c->at[i] = cli_resize(c->at[i], c->cap[i], sizeof *c->at[i], "the errors of all frames");
        }
        c->at[i][c->n] = errors[i] / diagonal;
    }
    c->n++;
}

void error_curves_clear(error_curves *c)
{
    for (size_t i = 0; i < ERROR_CURVES; i++) free(c->at[i]);
    *c = (error_curves){0};
}

/* The bins that hold something, from the first to the last, as shares in percent. Bin 0 begins at 0, which a logarithmic axis
 * does not have: it is named in the title. Returns their number. */
static size_t used_bins(const vg_measure_stats *m, double *edges, double *shares, double *equal)
{
    double all = 0;
    size_t first = VG_ERROR_BINS, last = 0;
    for (size_t i = 0; i < VG_ERROR_BINS; i++) all += (double)m->histogram[i];
    *equal = all > 0 ? 100 * (double)m->histogram[0] / all : 0;
    for (size_t i = 1; i < VG_ERROR_BINS; i++)
        if (m->histogram[i]) {
            if (first == VG_ERROR_BINS) first = i;
            last = i;
        }
    if (first == VG_ERROR_BINS) return 0;
    for (size_t i = first; i <= last + 1; i++) edges[i - first] = i < VG_ERROR_BINS ? vg_error_edges[i] : 2 * vg_error_edges[i - 1];
    for (size_t i = first; i <= last; i++) shares[i - first] = 100 * (double)m->histogram[i] / all;
    return last - first + 1;
}

void error_plot_write(const error_curves *c, const vg_measure_stats *m, const char *truth, const char *result, const char *file)
{
    static const char *const names[ERROR_CURVES] = {"mean", "95 % of the vertices", "largest"};
    double edges[VG_ERROR_BINS + 1] = {1e-12, 1}, shares[VG_ERROR_BINS] = {0}, equal;
    size_t bins = used_bins(m, edges, shares, &equal);
    char title[2][160];
    snprintf(title[0], sizeof title[0], "%.60s beside %.60s", result, truth);
    snprintf(title[1], sizeof title[1], equal > 0 ? "distribution; %.3g %% of the vertices are within 1e-12 D" : "distribution", equal);
    vg_series curves[ERROR_CURVES], bars = {.name = "", .n = bins, .x = edges, .y = shares};
    for (size_t i = 0; i < ERROR_CURVES; i++) curves[i] = (vg_series){.name = names[i], .n = c->n, .y = c->at[i]};
    const vg_chart charts[2] = {
        {.title = title[0], .x = "frame", .y = "error of a vertex, in D", .n = ERROR_CURVES, .series = curves},
        {.title = title[1], .x = "error of a vertex, in D", .y = "% of the vertices of all frames", .log_x = true, .bars = true,
         .n = 1, .series = &bars}};
    vg_err e;
    cli_redirect(file, false);
    FILE *out = cli_text_open();
    if (vg_plot_write(charts, 2, cli_ends_with(file, ".svg"), fileno(out), file, &e) < 0) cli_die(&e);
    cli_text_end();
}
