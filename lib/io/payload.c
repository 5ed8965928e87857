/* payload.c: reads and writes FORM and FAIL (fmt/STREAM.md, section 3). Other header records are in artefact_io.c,
 * frames in frame_io.c, record headers and checksums in record.c, the order of records in stream.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/cursor.h"
#include "model/form.h"

#include <stdlib.h>

/* ---- FORM ---- */

static bool needs_mesh(vg_element e)
{
    return e == VG_OF_VERTEX || e == VG_OF_CORNER || e == VG_OF_JOINT;
}

/* Why frames with h->count elements contradict the preceding records; NULL if they do not. */
static const char *refuse_form(const vg_head *h)
{
    vg_element element = vg_head_element(h);
    if (h->map.ncorners && h->map.ncorners != vg_head_elements(h, VG_OF_CORNER))
        return "the corners of record MAP do not fit the mesh";
    if (h->map.n && h->map.kind == VG_MAP_PATCHES && h->map.n != h->body.patches.n)
        return "records MAP and PTCH have different numbers of patches";
    if (h->signal.n && h->signal.space != VG_SPACE_VERTICES && !h->links.chosen)
        return "record SIGN needs a LINK record";
    if (vg_head_width(h) == 0) return "its elements have no width";
    if (needs_mesh(element) && !h->body.reference) return "a MESH and a REFP record must come before it";
    if (element == VG_OF_CORNER && !h->links.chosen) return "a LINK record must come before it";
    if (element == VG_OF_TRANSFORM || vg_head_elements(h, element) == SIZE_MAX) return NULL;
    return h->count != vg_head_elements(h, element) ? "its count does not fit its elements" : NULL;
}

/* The table gives element and width of a known form; those of an unknown form are stored as read. */
static const char *take_form(vg_head *h, char *name, char *element, uint64_t width)
{
    h->kind = vgi_form_find(name);
    h->form = name, h->form_element = element, h->width = (size_t)width;
    if (!*name) return "frames have no form";
    if (!strcmp(element, vg_element_name(VG_OF_LIST))) return "elements of frames are no lists";
    if (h->kind == VG_OTHER) return NULL;
    if (strcmp(element, vg_element_name(vg_kind_element(h->kind))) ||
        (vg_kind_width(h->kind) && vg_kind_width(h->kind) != width))
        return "its elements or their width are not those of the form";
    return NULL;
}

int vgi_form_decode(const vgi_payload *p, vg_head *h, vg_err *e)
{
    cursor c = start(p);
    int r = VG_OK;
    char *name = take_text(&c, p, &r, e), *element = name ? take_text(&c, p, &r, e) : NULL;
    uint64_t width = take64(&c), count = take64(&c), precision = take64(&c);
    if (r < 0) {
        free(name);
        return r;
    }
    const char *why = take_form(h, name, element, width);
    if (c.bad || left(&c)) return wrong(p, "it has a wrong length", e);
    if (why) return wrong(p, why, e);
    if (precision != VG_F32 && precision != VG_F64) return wrong(p, "numbers are of unknown precision", e);
    h->precision = (vg_precision)precision, h->count = (size_t)count;
    why = refuse_form(h);
    return why ? wrong(p, why, e) : VG_OK;
}

int vgi_form_encode(vg_bytes *b, const vg_head *h, vg_err *e)
{
    const char *why = refuse_form(h);
    bool other = h->kind == VG_OTHER;
    if (other && (!h->form || !h->form_element)) why = "frames have no form";
    if (why) return vg_fail(e, VG_EINPUT, "record FORM cannot be written: %s", why);
    int r = put_text(b, other ? h->form : vg_kind_name(h->kind), e);
    if (r == VG_OK) r = put_text(b, other ? h->form_element : vg_element_name(vg_kind_element(h->kind)), e);
    if (r == VG_OK) r = put64(b, vg_head_width(h), e);
    if (r == VG_OK) r = put64(b, h->count, e);
    return r < 0 ? r : put64(b, h->precision, e);
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
