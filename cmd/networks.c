/* networks.c: what a network is, in words and numbers.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "networks.h"

#include <inttypes.h>
#include <stdio.h>

const char *const network_methods[VG_NETWORK_METHODS] = {"repeat", "linear", "damped", "regression", "network"};

static void report_errors(report *r, const vg_network *n)
{
    static const report_column columns[] = {{"method", "error, % of D", false}, {"given", "given", false},
                                            {"frame_5", "frame 5", false}, {"frame_10", "frame 10", false},
                                            {"frame_15", "frame 15", false}};
    if (!n->errors || !n->windows) return;
    report_table(r, "errors", "", false, columns, sizeof columns / sizeof *columns);
    for (size_t given = 0; given < 2; given++)
        for (size_t m = 0; m < VG_NETWORK_METHODS; m++) {
            const double *x = n->errors + (given * VG_NETWORK_METHODS + m) * VG_NETWORK_FRAMES;
            report_value cells[] = {report_text(network_methods[m]), report_count(given ? 3 : 1), report_nothing(),
                                    report_nothing(), report_nothing()};
            for (int i = 0; i < VG_NETWORK_FRAMES; i++)
                if (x[i] >= 0) cells[2 + i] = report_number(x[i]);
            if (x[0] >= 0) report_row(r, cells);
        }
}

void report_network(report *r, const vg_network *n)
{
    static const char *const directions[] = {"shared", "separate", "forward"};
    char digest[20];
    if (!n->model) return;
    snprintf(digest, sizeof digest, "%016" PRIx64, n->data_digest);
    report_gap(r);
    report_group(r, "network");
    report_put(r, "model", "network", report_text(vg_network_model_name(n->model)));
    report_put(r, "direction", "directions", report_text(directions[n->direction]));
    report_put(r, "layers", "layers", report_count(n->layers));
    report_put(r, "hidden", "of each, hidden", report_count(n->hidden));
    report_put(r, "convolutions", "convolutions", report_count(n->convolutions));
    report_put(r, "coordinates", "coordinates", report_count(n->rank));
    report_put(r, "width", "width", report_count(n->width));
    report_put(r, "parameters", "parameters", report_count(n->sets * n->nparameters));
    report_put(r, "frames", "trained on", report_count(n->frames));
    report_put(r, "step", "every", report_count(n->step));
    report_put(r, "training", "their digest", report_text(digest));
    report_put(r, "iterations", "iterations", report_count(n->iterations));
    report_put(r, "seed", "seed", report_count(n->seed));
    report_put(r, "finished", "finished", report_flag(!n->open));
    report_put(r, "windows", "judged runs", report_count(n->windows));
    report_errors(r, n);
    report_end(r);
}
