/* network_plot.c: the curves of a network: loss and validation error over the iterations, errors over the frames ahead.
 * Leaves out how charts are drawn (lib/view/plot.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "network_plot.h"

#include "networks.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

enum { CHARTS = 4 };

typedef struct curves {
    const vg_network *network;
    double *x, *loss, *tried_x, *tried; /* iterations that were measured, and the error there */
    size_t ntried, best;                /* best: the place of the least error */
    char title[CHARTS][200];
    double ahead[VG_NETWORK_FRAMES], errors[2][VG_NETWORK_METHODS][VG_NETWORK_FRAMES];
    vg_series series[CHARTS][VG_PLOT_SERIES];
    vg_chart chart[CHARTS];
    size_t ncharts;
} curves;

static void add_tried(curves *c, double x, double error)
{
    if (error < 0) return;
    c->tried_x[c->ntried] = x, c->tried[c->ntried] = error;
    if (error < c->tried[c->best]) c->best = c->ntried;
    c->ntried++;
}

/* the columns of a network's curve */
static void find_columns(curves *c)
{
    const vg_network *n = c->network;
    double *room = cli_allocate(4 * n->ncurve + 2, sizeof *room, "the curves");
    c->x = room, c->loss = room + n->ncurve, c->tried_x = room + 2 * n->ncurve, c->tried = room + 3 * n->ncurve + 1;
    add_tried(c, 0, n->curve_start);
    for (size_t i = 0; i < n->ncurve; i++) {
        c->x[i] = (double)(i < n->ncurve_block ? i + 1 : i - n->ncurve_block + 1);
        c->loss[i] = n->curve[3 * i];
        add_tried(c, c->x[i], n->curve[3 * i + 2]);
    }
}

static vg_chart *add_chart(curves *c, const char *x, const char *y)
{
    vg_chart *chart = &c->chart[c->ncharts];
    *chart = (vg_chart){.title = c->title[c->ncharts], .x = x, .y = y, .series = c->series[c->ncharts]};
    c->ncharts++;
    return chart;
}

/* Whether the numbers need a logarithmic axis. */
static bool is_wide(const double *y, size_t n)
{
    double least = INFINITY, most = 0;
    for (size_t i = 0; i < n; i++) least = fmin(least, y[i]), most = fmax(most, y[i]);
    return least > 0 && most > 100 * least;
}

static void add_loss(curves *c, const char *label)
{
    const vg_network *n = c->network;
    size_t block = n->ncurve_block;
    vg_series *to = c->series[c->ncharts];
    snprintf(c->title[c->ncharts], sizeof *c->title, "%.80s: what it learns from (%s, seed %" PRIu64 ")", label,
             vg_network_model_name(n->model), n->seed);
    vg_chart *chart = add_chart(c, "iteration", "loss, a frame");
    chart->log_y = is_wide(c->loss, n->ncurve);
    if (block) to[chart->n++] = (vg_series){.name = "beside a validation block", .n = block, .x = c->x, .y = c->loss};
    if (n->ncurve > block)
        to[chart->n++] = (vg_series){.name = "all frames", .n = n->ncurve - block, .x = c->x + block, .y = c->loss + block};
}

static void add_validation(curves *c)
{
    vg_series *to = c->series[c->ncharts];
    if (!c->ntried) return;
    snprintf(c->title[c->ncharts], sizeof *c->title, "validation block: least after %.0f iterations", c->tried_x[c->best]);
    vg_chart *chart = add_chart(c, "iteration", "error, a frame");
    to[chart->n++] = (vg_series){.name = "error", .n = c->ntried, .x = c->tried_x, .y = c->tried};
    to[chart->n++] = (vg_series){.name = "least", .n = 1, .x = c->tried_x + c->best, .y = c->tried + c->best};
}

/* What is measured at some of the frames ahead is drawn at these. */
static void add_errors(curves *c, int given)
{
    const vg_network *n = c->network;
    vg_series *to = c->series[c->ncharts];
    vg_chart *chart = NULL;
    if (!n->windows) return;
    snprintf(c->title[c->ncharts], sizeof *c->title, "held-out frames: mean error of a vertex, %s", given ? "3 frames given" : "1 frame given");
    for (size_t m = 0; m < VG_NETWORK_METHODS; m++) {
        double *y = c->errors[given][m];
        size_t k = 0;
        for (size_t i = 0; i < VG_NETWORK_FRAMES; i++) {
            double error = n->errors[((size_t)given * VG_NETWORK_METHODS + m) * VG_NETWORK_FRAMES + i];
            if (error < 0) break;
            y[k++] = error;
        }
        if (!k) continue;
        if (!chart) chart = add_chart(c, "frames ahead", "% of D");
        to[chart->n++] = (vg_series){.name = network_methods[m], .n = k, .x = c->ahead, .y = y};
    }
}

void network_plot_write(const vg_network *n, const char *label, bool svg)
{
    curves c = {.network = n};
    vg_err e;
    for (int i = 0; i < VG_NETWORK_FRAMES; i++) c.ahead[i] = 5.0 * (i + 1);
    find_columns(&c);
    add_loss(&c, label);
    add_validation(&c);
    add_errors(&c, 1);
    add_errors(&c, 0);
    FILE *out = cli_text_open();
    if (vg_plot_write(c.chart, c.ncharts, svg, fileno(out), cli_output() ? cli_output() : "standard output", &e) < 0) cli_die(&e);
    cli_text_end();
    free(c.x);
}
