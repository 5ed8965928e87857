/* networks.h: a network in reports.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CMD_NETWORKS_H
#define VG_CMD_NETWORKS_H

#include "report.h"

/* network_methods: names of the methods of vg_network_errors, in its order; the network is the last. */
extern const char *const network_methods[VG_NETWORK_METHODS];

/* report_network: layers, parameters, what it was trained on, and its errors in frames that were held out. */
void report_network(report *r, const vg_network *n);

#endif
