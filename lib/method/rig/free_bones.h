/* free_bones.h: motions of bones without a skeleton, started from known transforms.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FREE_BONES_H
#define VG_FREE_BONES_H

#include "core/core.h"

/* vgi_free_bones_continue: vg_free_bones_fit; begun: the iteration starts from the transforms given. */
void vgi_free_bones_continue(vg_free_bones *x, size_t n, const double *const *poses, double *const *transforms,
                             bool begun);

#endif
