/* network_plot.h: how a network was trained, as curves.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CMD_NETWORK_PLOT_H
#define VG_CMD_NETWORK_PLOT_H

#include "cli.h"

/* network_plot_write: charts of the loss, the error in the validation block, and the errors in held-out frames of all methods,
 * as PNG or SVG, to the output. label: the title. */
void network_plot_write(const vg_network *n, const char *label, bool svg);

#endif
