/* feature.h: what training needs of a vg_featurer besides its features. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FEATURE_H
#define VG_FEATURE_H

#include "net/rings.h"

/* vgi_featurer_rings: those of its mesh; borrowed until free. */
const vgi_rings *vgi_featurer_rings(const vg_featurer *f);

#endif
