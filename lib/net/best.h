/* best.h: the parameters of the best iteration so far. Many are kept in an unnamed file. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_BEST_H
#define VG_BEST_H

#include "core/core.h"

typedef struct vgi_best {
    size_t n;
    float *values; /* NULL: in the file */
    int file;      /* an unnamed one, or -1 */
} vgi_best;

/* vgi_best_make: room for n parameters; in a file if they take more than `most` bytes. */
int vgi_best_make(vgi_best *b, size_t n, size_t most, vg_err *e) VG_MUST_CHECK;
int vgi_best_put(vgi_best *b, const float *parameters, vg_err *e) VG_MUST_CHECK;
int vgi_best_get(const vgi_best *b, float *parameters, vg_err *e) VG_MUST_CHECK; /* 0 before the first put */
void vgi_best_clear(vgi_best *b);

#endif
