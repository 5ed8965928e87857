/* payload_scal.c: a number for each vertex that comes with a frame, such as its error (fmt/STREAM.md, section 3.17).
 * Leaves out what the number means: its name and unit say so to people.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/cursor.h"
#include "model/frame.h"

static const char *text_of(cursor *c, size_t n)
{
    const char *s = (const char *)take(c, n);
    return s && vgi_is_utf8(s, n) ? s : NULL;
}

/* Nothing is made that the bytes do not back: the numbers are there before the frame gets room for them. */
int vgi_scal_decode(const vgi_payload *p, const vg_head *h, vg_frame *f, vg_err *e)
{
    size_t nv = h->body.mesh.nv;
    cursor c = start(p);
    if (h->kind != VG_VERTICES) return wrong(p, "frames are no vertices", e);
    if (f->has_scalars) return wrong(p, "the frame has another one", e);
    size_t name_bytes = take32(&c), unit_bytes = take32(&c);
    if (!take_padding(&c, 8)) return wrong(p, "it is too short, or reserved bytes are not zero", e);
    if (name_bytes == 0) return wrong(p, "it has no name", e);
    if (name_bytes > left(&c) || unit_bytes > left(&c) - name_bytes)
        return wrong(p, "a text is longer than its record", e);
    const char *name = text_of(&c, name_bytes), *unit = text_of(&c, unit_bytes);
    if (!name || !unit) return wrong(p, "a text is no UTF-8", e);
    if (!take_padding(&c, -(name_bytes + unit_bytes) & 7)) return wrong(p, "padding is missing or not zero", e);
    const unsigned char *numbers = take_array(&c, nv, h->precision);
    if (c.bad || left(&c)) return wrong(p, "its length does not fit the number of vertices", e);
    int r = vgi_frame_scalars(f, name, name_bytes, unit, unit_bytes, nv, e);
    if (r < 0) return r;
    if (h->precision == VG_F64) copy_doubles(f->scalars, numbers, nv);
    else copy_floats(f->scalars, numbers, nv);
    return vgi_finite(f->scalars, nv) ? VG_OK : wrong(p, "a number is not finite", e);
}

int vgi_scal_encode(vg_bytes *b, const vg_frame *f, vg_err *e)
{
    size_t from = b->size, name = strlen(f->scalars_name), unit = strlen(f->scalars_unit);
    if (name == 0) return vg_fail(e, VG_EARG, "numbers of vertices need a name");
    if (name > UINT32_MAX || unit > UINT32_MAX)
        return vg_fail(e, VG_EARG, "a text of more than 4 GB is too long for a stream");
    int r = put32(b, (uint32_t)name, e);
    if (r == VG_OK) r = put32(b, (uint32_t)unit, e);
    if (r == VG_OK) r = put64(b, 0, e);
    if (r == VG_OK) r = vgi_bytes_append(b, f->scalars_name, name, e);
    if (r == VG_OK) r = vgi_bytes_append(b, f->scalars_unit, unit, e);
    return r == VG_OK ? put_padding(b, from, e) : r;
}
