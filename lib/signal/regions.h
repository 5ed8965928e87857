/* regions.h: overlapping regions of a mesh that cover all its vertices. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SIGNAL_REGIONS_H
#define VG_SIGNAL_REGIONS_H

#include "core/core.h"

enum { VGI_REGION = 100 }; /* most vertices of a region */

typedef struct vgi_region {
    size_t n;
    uint32_t vertex[VGI_REGION]; /* in order of distance along edges from the first */
} vgi_region;

/* vgi_regions_grow: regions (release with free()) such that every vertex is among the nearest third of one of them. */
int vgi_regions_grow(const vg_mesh *m, const double *points, vgi_region **regions, size_t *n, vg_err *e) VG_MUST_CHECK;

#endif
