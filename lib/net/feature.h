/* feature.h: what training asks of a vg_featurer beside its features.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FEATURE_H
#define VG_FEATURE_H

#include "net/rings.h"

/* vgi_featurer_rings: of its mesh; borrowed until free. */
const vgi_rings *vgi_featurer_rings(const vg_featurer *f);

#endif
