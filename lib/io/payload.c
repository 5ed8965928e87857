/* payload.c: FORM, frames and FAIL, both directions side by side (fmt/STREAM.md, section 3).
 * Leaves out the other header records (artefact_io.c), numbers of vertices (payload_scal.c), record headers and
 * checksums (record.c) and the order of records (stream.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/numbers_kernel.h"
#include "io/cursor.h"
#include "model/artefact.h"

#include <stdlib.h>

/* ---- FORM ---- */

/* Elements that a frame of this kind must have on h's mesh, selection and links. */
static size_t graph_count(const vg_head *h, vg_kind kind)
{
    const vg_mesh *m = &h->body.mesh;
    if (kind == VG_VERTICES) return m->nv;
    if (!h->has_selection) return vg_mesh_corners(m) + 2 * h->nlinks;
    size_t corners = 2 * h->nlinks;
    for (size_t i = 0; i < h->nselected; i++) corners += m->start[h->selected[i] + 1] - m->start[h->selected[i]];
    return corners;
}

/* Why frames of h->count elements do not go with what stands before them; NULL: they do. */
static const char *refuse_form(const vg_head *h)
{
    if (h->map.ncorners && h->map.ncorners != graph_count(h, VG_VECTORS))
        return "the corners of record MAP do not fit the mesh";
    if (h->map.n && h->map.kind == VG_MAP_PATCHES && h->map.n != h->body.patches.n)
        return "record MAP has not as many patches as record PTCH";
    if (h->kind == VG_TRANSFORMS) return NULL;
    if (!h->body.reference) return "a MESH and a REFP record must come before it";
    if (h->kind != VG_VERTICES && !h->has_links) return "a LINK record must come before it";
    return h->count != graph_count(h, h->kind) ? "its count does not fit the mesh" : NULL;
}

int vgi_form_decode(const vgi_payload *p, vg_head *h, vg_err *e)
{
    cursor c = start(p);
    uint32_t kind = take32(&c), precision = take32(&c);
    uint64_t count = take64(&c);
    if (c.bad || left(&c)) return wrong(p, "it has a wrong length", e);
    if (kind < VG_VERTICES || kind > VG_TRANSFORMS) return wrong(p, "frames are of unknown kind", e);
    if (precision != VG_F32 && precision != VG_F64) return wrong(p, "numbers are of unknown precision", e);
    h->kind = (vg_kind)kind, h->precision = (vg_precision)precision, h->count = (size_t)count;
    const char *why = refuse_form(h);
    return why ? wrong(p, why, e) : VG_OK;
}

int vgi_form_encode(vg_bytes *b, const vg_head *h, vg_err *e)
{
    const char *why = refuse_form(h);
    if (why) return vg_fail(e, VG_EINPUT, "record FORM cannot be written: %s", why);
    int r = put32(b, h->kind, e);
    if (r == VG_OK) r = put32(b, h->precision, e);
    return r < 0 ? r : put64(b, h->count, e);
}

/* ---- FRAM ---- */

enum { HAS_TIME = 1u, HAS_PINS = 2u, HAS_TURNS = 4u };

static bool on_graph(const vg_head *h)
{
    return h->kind == VG_VECTORS || h->kind == VG_DEFORMATIONS;
}

static int take_pins(cursor *c, vg_frame *f, const vg_head *h, const vgi_payload *p, vg_err *e)
{
    uint32_t n = take32(c), zero = take32(c);
    const unsigned char *pins = take_array(c, n, 4);
    if (c->bad || zero || n == 0 || !take_padding(c, n % 2 * 4))
        return wrong(p, "its list of pins is cut or malformed", e);
    int r = vgi_grow(&f->pins, &f->pins_cap, n, sizeof *f->pins, e);
    if (r < 0) return r;
    copy32(f->pins, pins, n);
    f->npins = n;
    return vgi_check_ascending(p->where, f->pins, n, h->body.mesh.nv, e);
}

/* Are these the vertices of a skeleton, whose joints can say how they have turned? */
static bool may_turn(const vg_head *h)
{
    return h->kind == VG_VERTICES && h->body.skeleton.njoints > 0;
}

static int take_turns(cursor *c, vg_frame *f, size_t njoints, const vgi_payload *p, vg_err *e)
{
    const unsigned char *turns = take_array(c, njoints, 32);
    if (c->bad) return wrong(p, "it ends before its turns", e);
    int r = vgi_grow(&f->turns, &f->turns_cap, 4 * njoints, sizeof *f->turns, e);
    if (r < 0) return r;
    copy_doubles(f->turns, turns, 4 * njoints);
    f->nturns = njoints;
    return vgi_are_turns(f->turns, njoints) ? VG_OK : wrong(p, "a turn is no unit quaternion", e);
}

/* Deformations and transforms start with a quaternion. */
static bool has_zero_quaternion(const vg_head *h, const double *values)
{
    size_t width = vg_kind_width(h->kind);
    for (size_t i = 0; width > 3 && i < h->count; i++) {
        const double *q = values + i * width;
        bool zero = h->precision == VG_F64
                        ? q[0] == 0 && q[1] == 0 && q[2] == 0 && q[3] == 0
                        : (float)q[0] == 0 && (float)q[1] == 0 && (float)q[2] == 0 && (float)q[3] == 0;
        if (zero) return true;
    }
    return false;
}

static int take_values(cursor *c, vg_frame *f, const vg_head *h, const vgi_payload *p, vg_err *e)
{
    size_t n, width = vg_kind_width(h->kind);
    if (!vgi_mul(h->count, width, &n)) return wrong(p, "its length does not fit the count of FORM", e);
    const unsigned char *data = take_array(c, n, h->precision);
    if (c->bad || left(c)) return wrong(p, "its length does not fit the count of FORM", e);
    if (h->precision == VG_F64 && NATIVE && (uintptr_t)data % _Alignof(double) == 0) {
        f->values = (double *)(uintptr_t)data;
    } else {
        int r = vgi_grow(&f->values_own, &f->values_cap, n, sizeof *f->values, e);
        if (r < 0) return r;
        f->values = f->values_own;
        if (h->precision == VG_F64) copy_doubles(f->values, data, n);
        else copy_floats(f->values, data, n);
    }
    return VG_OK;
}

int vgi_fram_decode(vg_frame *f, const vg_head *h, const char *where, vg_err *e)
{
    vgi_payload p = {f->raw.data, f->raw.size, where};
    cursor c = start(&p);
    uint32_t n = take32(&c), flags = take32(&c);
    double time = take_double(&c);
    if (c.bad || (flags & ~(HAS_TIME | HAS_PINS | HAS_TURNS)) || (flags & HAS_PINS && h->kind != VG_VECTORS) ||
        (flags & HAS_TURNS && !may_turn(h)))
        return wrong(&p, "it is too short, or unknown flags are set", e);
    if (!vgi_finite(&time, 1) || (!(flags & HAS_TIME) && time != 0))
        return wrong(&p, "its time is not finite, or set without its flag", e);
    const char *name = (const char *)take(&c, n);
    if (!name || !vgi_is_utf8(name, n)) return wrong(&p, "its name is longer than the record, or no UTF-8", e);
    int r = vgi_grow(&f->name, &f->name_cap, (size_t)n + 1, 1, e);
    if (r < 0) return r;
    memcpy(f->name, name, n);
    f->name[n] = 0;
    f->has_time = flags & HAS_TIME, f->time = time, f->npins = 0, f->nturns = 0;
    if (!take_padding(&c, -n & 7)) return wrong(&p, "padding is missing or not zero", e);
    if (on_graph(h)) {
        const unsigned char *root = take(&c, 24), *anchors = take_array(&c, h->nanchors, 24);
        if (c.bad) return wrong(&p, "it ends before its root and anchors", e);
        if ((r = vgi_grow(&f->anchors, &f->anchors_cap, 3 * h->nanchors, sizeof *f->anchors, e)) < 0) return r;
        copy_doubles(f->root, root, 3);
        copy_doubles(f->anchors, anchors, 3 * h->nanchors);
        if (!vgi_finite(f->root, 3) || !vgi_finite(f->anchors, 3 * h->nanchors))
            return wrong(&p, "its root or an anchor is not finite", e);
    }
    if (flags & HAS_PINS && (r = take_pins(&c, f, h, &p, e)) < 0) return r;
    if (flags & HAS_TURNS && (r = take_turns(&c, f, h->body.skeleton.njoints, &p, e)) < 0) return r;
    if ((r = take_values(&c, f, h, &p, e)) < 0) return r;
    if (!vgi_finite(f->values, h->count * vg_kind_width(h->kind))) return wrong(&p, "a value is not finite", e);
    return has_zero_quaternion(h, f->values) ? wrong(&p, "a quaternion is zero", e) : VG_OK;
}

/* Turns of other joints than the head's are those of a skeleton that was replaced: they are left out. */
static bool has_turns(const vg_head *h, const vg_frame *f)
{
    return may_turn(h) && f->nturns == h->body.skeleton.njoints;
}

/* What a reader would refuse is not written. The values' own finiteness is vg_writer_put's to check. */
static int check_frame(const vg_head *h, const vg_frame *f, vg_err *e)
{
    const char *name = f->name ? f->name : "";
    bool finite = !f->has_time || vgi_finite(&f->time, 1);
    if (on_graph(h)) finite = finite && vgi_finite(f->root, 3) && vgi_finite(f->anchors, 3 * h->nanchors);
    if (!finite) return vg_fail(e, VG_EINPUT, "frame '%s' has a time, root or anchor that is not finite", name);
    if (has_zero_quaternion(h, f->values))
        return vg_fail(e, VG_EINPUT, "frame '%s' shrinks something to nothing: a quaternion is zero", name);
    if (has_turns(h, f) && !vgi_are_turns(f->turns, f->nturns))
        return vg_fail(e, VG_EINPUT, "frame '%s' has a joint whose turn is no unit quaternion", name);
    return VG_OK;
}

int vgi_fram_encode(vg_bytes *b, const vg_head *h, const vg_frame *f, vg_err *e)
{
    const char *name = f->name ? f->name : "";
    double time = f->has_time ? f->time : 0;
    int r = check_frame(h, f, e);
    if (r == VG_OK) r = put32(b, (uint32_t)strlen(name), e);
    bool pins = h->kind == VG_VECTORS && f->npins > 0, turns = has_turns(h, f);
    if (r == VG_OK)
        r = put32(b, (f->has_time ? HAS_TIME : 0u) | (pins ? HAS_PINS : 0u) | (turns ? HAS_TURNS : 0u), e);
    if (r == VG_OK) r = put_doubles(b, &time, 1, e);
    if (r == VG_OK) r = vgi_bytes_append(b, name, strlen(name), e);
    if (r == VG_OK) r = put_padding(b, 0, e);
    if (r == VG_OK && on_graph(h)) {
        r = put_doubles(b, f->root, 3, e);
        if (r == VG_OK) r = put_doubles(b, f->anchors, 3 * h->nanchors, e);
    }
    if (r == VG_OK && pins) {
        r = put32(b, (uint32_t)f->npins, e);
        if (r == VG_OK) r = put32(b, 0, e);
        if (r == VG_OK) r = put_indices(b, f->pins, f->npins, e);
        if (r == VG_OK) r = put_padding(b, 0, e);
    }
    if (r == VG_OK && turns) r = put_doubles(b, f->turns, 4 * f->nturns, e);
    return r;
}

int vgi_values_encode(vg_bytes *b, const double *x, size_t n, vg_precision precision, const void **data,
                      size_t *bytes, vg_err *e)
{
    *bytes = n * (size_t)precision;
    *data = x;
    if (precision == VG_F64 && NATIVE) return VG_OK;
    b->size = 0;
    int r = vgi_bytes_reserve(b, *bytes, e);
    if (r < 0) return r;
    *data = b->data;
    if (precision == VG_F64) return put_doubles(b, x, n, e);
    if (NATIVE && vgi_to_single((float *)(void *)b->data, x, n)) return VG_OK;
    for (size_t i = 0; i < n; i++) {
        float y = (float)x[i];
        if (!(y - y == 0)) return vg_fail(e, VG_EINPUT, "%g does not fit into binary32: write binary64", x[i]);
        vgi_put32(b->data + 4 * i, vgi_float_bits(y));
    }
    return VG_OK;
}

/* ---- FAIL ---- */

int vgi_fail_decode(vg_failure *f, const vgi_payload *p, const char *stream, vg_err *e)
{
    cursor c = start(p);
    int r = VG_OK;
    uint64_t status = take64(&c);
    f->program = take_text(&c, p, &r, e);
    f->message = f->program ? take_text(&c, p, &r, e) : NULL;
    f->status = status > UINT32_MAX ? UINT32_MAX : (uint32_t)status;
    if (f->message && left(&c)) r = wrong(p, "bytes are left over", e);
    else if (f->message)
        return vg_fail(e, VG_ETRUNC, "'%s' was cut short: %s failed with status %u: %s", stream, f->program,
                       f->status, f->message);
    vgi_failure_clear(f);
    return r;
}

void vgi_failure_clear(vg_failure *f)
{
    free(f->program);
    free(f->message);
    *f = (vg_failure){0};
}

int vgi_fail_encode(vg_bytes *b, const char *program, int status, const char *message, vg_err *e)
{
    int r = put64(b, (uint64_t)status, e);
    if (r == VG_OK) r = put_text(b, program, e);
    return r < 0 ? r : put_text(b, message, e);
}
