/* lanes.h: eight poses side by side in memory, the unit that callers pass to the numeric kernels. Kernels compute in
 * vectors as wide as their instruction set has (wide.h).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_LANES_H
#define VG_LANES_H

#include "core/core.h"

enum { VGI_LANES = 8 };
typedef double vgi_lanes[VGI_LANES] __attribute__((aligned(64))); /* the same number of eight poses */

#endif
