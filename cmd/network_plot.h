/* network_plot.h: how a network was trained, as curves.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CMD_NETWORK_PLOT_H
#define VG_CMD_NETWORK_PLOT_H

#include "cli.h"

/* network_plot_write: its loss, its error in the validation block, and its errors in held-out frames beside what takes no
 * learning, as PNG or SVG, to the output. label: what it is called. */
void network_plot_write(const vg_network *n, const char *label, bool svg);

#endif
