/* payload_scal.c: a number for each vertex that comes with a frame, such as its error (fmt/STREAM.md, section 3.17).
 * Leaves out what the number means: its name and unit say so to people.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/payload.h"

enum { FRONT = 16 };

static int wrong(const vgi_payload *p, const char *what, vg_err *e)
{
    return vg_fail(e, VG_EINPUT, "%s: %s", p->where, what);
}

static double number_at(const unsigned char *p, size_t i, vg_precision precision)
{
    double x;
    float y;
    if (precision == VG_F64) {
        uint64_t bits = vgi_get64(p + 8 * i);
        memcpy(&x, &bits, sizeof x);
        return x;
    }
    uint32_t bits = vgi_get32(p + 4 * i);
    memcpy(&y, &bits, sizeof y);
    return (double)y;
}

static bool is_zero(const unsigned char *p, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (p[i]) return false;
    return true;
}

/* The texts are checked and copied one after the other, so that nothing is made that the bytes do not back. */
int vgi_scal_decode(const vgi_payload *p, const vg_head *h, vg_frame *f, vg_err *e)
{
    size_t nv = h->mesh.nv, values;
    if (h->kind != VG_VERTICES) return wrong(p, "frames are no vertices", e);
    if (f->has_scalars) return wrong(p, "the frame has another one", e);
    if (p->size < FRONT || !is_zero(p->data + 8, 8))
        return wrong(p, "it is too short, or reserved bytes are not zero", e);
    size_t name = vgi_get32(p->data), unit = vgi_get32(p->data + 4), left = p->size - FRONT;
    if (name == 0) return wrong(p, "it has no name", e);
    if (name > left || unit > left - name) return wrong(p, "a text is longer than its record", e);
    size_t padding = -(name + unit) & 7;
    if (!vgi_mul(nv, h->precision, &values) || left - name - unit < padding || left - name - unit - padding != values)
        return wrong(p, "its length does not fit the number of vertices", e);
    const char *text = (const char *)p->data + FRONT;
    if (!vgi_is_utf8(text, name) || !vgi_is_utf8(text + name, unit)) return wrong(p, "a text is no UTF-8", e);
    if (!is_zero(p->data + FRONT + name + unit, padding)) return wrong(p, "padding is missing or not zero", e);
    int r = vgi_frame_scalars(f, text, name, text + name, unit, nv, e);
    if (r < 0) return r;
    const unsigned char *from = p->data + (p->size - values);
    for (size_t v = 0; v < nv; v++) f->scalars[v] = number_at(from, v, h->precision);
    return vgi_finite(f->scalars, nv) ? VG_OK : wrong(p, "a number is not finite", e);
}

int vgi_scal_encode(vg_bytes *b, const vg_frame *f, vg_err *e)
{
    static const unsigned char zeros[8];
    size_t name = strlen(f->scalars_name), unit = strlen(f->scalars_unit);
    unsigned char front[FRONT] = {0};
    if (name == 0) return vg_fail(e, VG_EARG, "numbers of vertices need a name");
    if (name > UINT32_MAX || unit > UINT32_MAX)
        return vg_fail(e, VG_EARG, "a text of more than 4 GB is too long for a stream");
    vgi_put32(front, (uint32_t)name);
    vgi_put32(front + 4, (uint32_t)unit);
    int r = vgi_bytes_append(b, front, sizeof front, e);
    if (r == VG_OK) r = vgi_bytes_append(b, f->scalars_name, name, e);
    if (r == VG_OK) r = vgi_bytes_append(b, f->scalars_unit, unit, e);
    return r == VG_OK ? vgi_bytes_append(b, zeros, -(name + unit) & 7, e) : r;
}
