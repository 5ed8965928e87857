/* map.h: the arrays of a map, one by one, so that copying, releasing, reading and writing them are loops.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_MODEL_MAP_H
#define VG_MODEL_MAP_H

#include "core/core.h"

enum { VGI_MAP_ARRAYS = 14 };

typedef struct vgi_map_array {
    void **at;          /* where the map keeps it */
    size_t count, width;
    bool per_transform; /* its length is count * width, times the number of transforms */
    bool real;          /* doubles; else u32 */
} vgi_map_array;

/* vgi_map_arrays: in the order in which they lie in a stream: doubles, then indices. */
size_t vgi_map_arrays(vg_map *m, vgi_map_array list[VGI_MAP_ARRAYS]);
/* vgi_map_array_length: elements; SIZE_MAX when that is no size. */
size_t vgi_map_array_length(const vg_map *m, const vgi_map_array *a);

#endif
