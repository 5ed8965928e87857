/* keep.c: storage of a signal: the precision of its basis, the count of its numbers. The stream is in
 * model/records.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/curve.h"

#include <math.h>
#include <stdlib.h>

static int keep_short(vg_signal *s, const double *basis, vg_err *e)
{
    size_t size = s->m * s->d;
    if (!(s->basis_short = vgi_array_raw(size, 2, e)) || !(s->basis_unit = vgi_array(s->m, sizeof(double), e)))
        return VG_ENOMEM;
    for (size_t j = 0; j < s->m; j++) {
        const double *h = basis + j * s->d;
        double most = 0;
        for (size_t c = 0; c < s->d; c++) most = fmax(most, fabs(h[c]));
        double unit = s->basis_unit[j] = most > 0 ? most / 32767 : 1;
        for (size_t c = 0; c < s->d; c++) {
            uint16_t x = (uint16_t)(int16_t)lround(h[c] / unit);
            uint8_t *p = s->basis_short + 2 * (j * s->d + c);
            p[0] = (uint8_t)x, p[1] = (uint8_t)(x >> 8);
        }
    }
    return VG_OK;
}

static int keep_single(vg_signal *s, const double *basis, vg_err *e)
{
    size_t size = s->m * s->d;
    if (!(s->basis_single = vgi_array_raw(size, sizeof(float), e))) return VG_ENOMEM;
    for (size_t i = 0; i < size; i++) s->basis_single[i] = (float)basis[i];
    return VG_OK;
}

int vg_signal_store(vg_signal *s, size_t bits, vg_err *e)
{
    size_t size;
    if (bits != 16 && bits != 32 && bits != 64)
        return vg_fail(e, VG_EARG, "a basis of %zu bits a number is not known: 64, 32 or 16", bits);
    if (!vgi_mul(s->m, s->d, &size)) return vg_fail(e, VG_ENOMEM, "the basis is too large");
    double *basis = vgi_array_raw(size, sizeof *basis, e);
    if (!basis) return VG_ENOMEM;
    for (size_t j = 0; j < s->m; j++) vgi_signal_vector(s, j, basis + j * s->d);
    free(s->basis);
    free(s->basis_single);
    free(s->basis_short);
    free(s->basis_unit);
    s->basis = NULL, s->basis_single = NULL, s->basis_short = NULL, s->basis_unit = NULL;
    s->bits = bits;
    int r = VG_OK;
    if (bits == 64) s->basis = basis, basis = NULL;
    else r = bits == 32 ? keep_single(s, basis, e) : keep_short(s, basis, e);
    free(basis);
    return r;
}

size_t vg_signal_floats(const vg_signal *s)
{
    return (s->m + 1) * s->d + s->m * (s->l + 3) + 2 * s->l + 2 * s->k + s->n + s->k + 2;
}
