/* best.c: the parameters of the best iteration so far, in memory or in an unnamed file.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/best.h"
#include "core/nameless.h"

#include <errno.h>
#include <stdlib.h>
#include <unistd.h>

int vgi_best_make(vgi_best *b, size_t n, size_t most, vg_err *e)
{
    *b = (vgi_best){.n = n, .file = -1};
    if (n <= most / sizeof *b->values) return (b->values = vgi_array(n, sizeof *b->values, e)) ? VG_OK : VG_ENOMEM;
    b->file = vgi_nameless_file(e);
    if (b->file < 0) return b->file;
    if (ftruncate(b->file, (off_t)(n * sizeof *b->values)) < 0)
        return vg_fail(e, VG_ESYS, "cannot make a temporary file for %zu parameters: %s", n, strerror(errno));
    return VG_OK;
}

int vgi_best_put(vgi_best *b, const float *parameters, vg_err *e)
{
    if (b->values) {
        memcpy(b->values, parameters, b->n * sizeof *parameters);
        return VG_OK;
    }
    if (lseek(b->file, 0, SEEK_SET) < 0) return vg_fail(e, VG_ESYS, "cannot write a temporary file: %s", strerror(errno));
    return vgi_write_all(b->file, parameters, b->n * sizeof *parameters, "temporary file", e);
}

int vgi_best_get(const vgi_best *b, float *parameters, vg_err *e)
{
    if (!b->values) return vgi_read_back(b->file, 0, parameters, b->n * sizeof *parameters, e);
    memcpy(parameters, b->values, b->n * sizeof *parameters);
    return VG_OK;
}

void vgi_best_clear(vgi_best *b)
{
    free(b->values);
    if (b->n && b->file >= 0) close(b->file);
    *b = (vgi_best){.file = -1};
}
