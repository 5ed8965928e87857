/* artefact_io.c: reads and writes header records by the table of records (model/artefact.h; fmt/STREAM.md, section
 * 3). model/checks.c checks contents, stream.c the order of records.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/artefact_io.h"
#include "io/cursor.h"

#include <stdlib.h>

static void *member(const vgi_member *f, const void *artefact)
{
    return (void *)(uintptr_t)((const char *)artefact + f->at);
}

/* ---- reading ---- */

/* Store a u64 in the member, which may be narrower. */
static int set_number(const vgi_member *f, void *to, uint64_t x, const vgi_payload *p, vg_err *e)
{
    uint32_t word = (uint32_t)x;
    bool truth = x != 0;
    if ((f->size == sizeof word && x > UINT32_MAX) || (f->size == sizeof truth && x > 1))
        return wrong(p, "its counts are out of range", e);
    if (f->size == sizeof x) memcpy(to, &x, sizeof x);
    else if (f->size == sizeof word) memcpy(to, &word, sizeof word);
    else memcpy(to, &truth, sizeof truth);
    return VG_OK;
}

static int read_number(cursor *c, const vgi_member *f, void *to, const vgi_payload *p, vg_err *e)
{
    int r = VG_OK;
    if (f->type == VGI_TEXT) {
        *(char **)to = take_text(c, p, &r, e);
        return r;
    }
    uint64_t x = take64(c);
    if (c->bad) return wrong(p, "it is shorter than its counts say", e);
    if (f->type == VGI_U64) return set_number(f, to, x, p, e);
    double number = vgi_as_double(x);
    if (!vgi_finite(&number, 1)) return wrong(p, "a number is not finite", e);
    memcpy(to, &number, sizeof number);
    return VG_OK;
}

static bool copy_numbers(vgi_type type, void *to, const unsigned char *from, size_t n)
{
    switch (type) {
    case VGI_U32: copy32(to, from, n); return true;
    case VGI_U64:
        for (size_t i = 0; i < n; i++) ((uint64_t *)to)[i] = vgi_get64(from + 8 * i);
        return true;
    case VGI_F32:
        for (size_t i = 0; i < n; i++) {
            ((float *)to)[i] = vgi_as_float(vgi_get32(from + 4 * i));
            double x = (double)((float *)to)[i];
            if (!vgi_finite(&x, 1)) return false;
        }
        return true;
    case VGI_F64: copy_doubles(to, from, n); return vgi_finite(to, n);
    default:
        if (n) memcpy(to, from, n);
        return true;
    }
}

static int read_texts(cursor *c, const vgi_member *f, char *array, size_t n, const vgi_payload *p, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < n; i++)
        *(char **)(void *)(array + i * f->size + f->row_at) = take_text(c, p, &r, e);
    return r;
}

/* Allocate memory only when the bytes that fill it are present: at least the length of each text. */
static int read_array(cursor *c, const vgi_member *f, void **to, size_t n, size_t rows, const vgi_payload *p, vg_err *e)
{
    size_t size = f->type == VGI_TEXT ? 8 : vgi_type_size(f->type);
    if (n > left(c) / size) return wrong(p, "it is shorter than its counts say", e);
    if (!n && f->optional) return VG_OK;
    if (!*to && !(*to = vgi_array(rows, f->size, e))) return VG_ENOMEM;
    if (f->type == VGI_TEXT) return read_texts(c, f, *to, n, p, e);
    const unsigned char *data = take(c, n * size);
    bool finite = true;
    if (!f->rows) finite = copy_numbers(f->type, *to, data, n);
    else
        for (size_t i = 0; finite && i < rows; i++)
            finite = copy_numbers(f->type, (char *)*to + i * f->size + f->row_at, data + i * f->width * size, f->width);
    if (!finite) return wrong(p, "a number is not finite", e);
    return take_padding(c, -(n * size) & 7) ? VG_OK : wrong(p, "padding is missing or not zero", e);
}

static int read_field(cursor *c, const vgi_member *f, void *artefact, const vg_head *h, const vgi_payload *p, vg_err *e)
{
    if (f->derived) return VG_OK;
    if (!f->length) return read_number(c, f, member(f, artefact), p, e);
    size_t n = vgi_member_elements(f, artefact, &h->body.mesh);
    size_t rows = f->rows ? f->length(artefact, &h->body.mesh) : n;
    return read_array(c, f, member(f, artefact), n, rows, p, e);
}

int vgi_artefact_decode(const vgi_artefact *t, const vgi_payload *p, vg_head *h, vg_err *e)
{
    cursor c = start(p);
    void *artefact = NULL;
    int r = VG_OK;
    if (t->each) r = vgi_artefact_append(t, h, &artefact, e);
    else artefact = vgi_artefact_in(t, h, 0);
    if (t->marks) *((bool *)(void *)((char *)h + t->mark_at)) = true;
    for (size_t i = 0; r == VG_OK && i < t->nfields; i++) r = read_field(&c, &t->fields[i], artefact, h, p, e);
    if (r == VG_OK && left(&c)) r = wrong(p, "bytes are left over", e);
    return r == VG_OK && t->check ? t->check(h, artefact, p->where, e) : r;
}

/* ---- writing ---- */

static uint64_t get_number(const vgi_member *f, const void *from)
{
    uint64_t x = 0;
    uint32_t word = 0;
    bool truth = false;
    if (f->size == sizeof x) memcpy(&x, from, sizeof x);
    else if (f->size == sizeof word) memcpy(&word, from, sizeof word), x = word;
    else memcpy(&truth, from, sizeof truth), x = truth;
    return x;
}

static int write_number(vg_bytes *b, const vgi_member *f, const void *from, vg_err *e)
{
    if (f->type == VGI_TEXT) return put_text(b, *(char *const *)from, e);
    if (f->type == VGI_F64) return put_doubles(b, from, 1, e);
    return put64(b, get_number(f, from), e);
}

static int put_floats(vg_bytes *b, const float *x, size_t n, vg_err *e)
{
    int r = vgi_bytes_reserve(b, b->size + 4 * n, e);
    for (size_t i = 0; r == VG_OK && i < n; i++, b->size += 4) {
        if (!(x[i] - x[i] == 0)) return vg_fail(e, VG_EINPUT, "the result holds a number that is not finite");
        vgi_put32(b->data + b->size, vgi_float_bits(x[i]));
    }
    return r;
}

static int put_numbers(vg_bytes *b, vgi_type type, const void *from, size_t n, vg_err *e)
{
    int r = VG_OK;
    switch (type) {
    case VGI_U32: return put_indices(b, from, n, e);
    case VGI_U64:
        for (size_t i = 0; r == VG_OK && i < n; i++) r = put64(b, ((const uint64_t *)from)[i], e);
        return r;
    case VGI_F32: return put_floats(b, from, n, e);
    case VGI_F64: return put_doubles(b, from, n, e);
    default: return vgi_bytes_append(b, from, n, e);
    }
}

static int write_array(vg_bytes *b, const vgi_member *f, const char *from, size_t n, size_t rows, vg_err *e)
{
    int r = VG_OK;
    if (f->type == VGI_TEXT) {
        for (size_t i = 0; r == VG_OK && i < n; i++)
            r = put_text(b, *(char *const *)(const void *)(from + i * f->size + f->row_at), e);
        return r;
    }
    if (!f->rows) r = put_numbers(b, f->type, from, n, e);
    else
        for (size_t i = 0; r == VG_OK && i < rows; i++)
            r = put_numbers(b, f->type, from + i * f->size + f->row_at, f->width, e);
    return r == VG_OK ? put_padding(b, 0, e) : r;
}

/* A mesh without faces may lack its list of starts, which is then a single 0. */
static int write_field(vg_bytes *b, const vgi_member *f, const void *artefact, const vg_mesh *mesh, vg_err *e)
{
    static const uint32_t zero;
    if (f->derived) return VG_OK;
    if (!f->length) return write_number(b, f, member(f, artefact), e);
    size_t n = vgi_member_elements(f, artefact, mesh), rows = f->rows ? f->length(artefact, mesh) : n;
    const void *array = *(void **)member(f, artefact);
    return array ? write_array(b, f, array, n, rows, e) : write_array(b, f, (const char *)&zero, n == 1, 0, e);
}

int vgi_artefact_encode(const vgi_artefact *t, vg_bytes *b, const vg_head *h, size_t i, vg_err *e)
{
    const void *artefact = vgi_artefact_in(t, h, i);
    int r = VG_OK;
    for (size_t k = 0; r == VG_OK && k < t->nfields; k++) r = write_field(b, &t->fields[k], artefact, &h->body.mesh, e);
    return r;
}

/* The earlier form: two counts of 32 bits, the parents, and texts after their lengths without padding. */
bool vgi_is_earlier_provenance(const vgi_artefact *t, const vgi_payload *p)
{
    if (strcmp(t->tag, "PROV")) return false;
    cursor c = start(p);
    uint64_t nparents = take32(&c), texts = (uint64_t)take32(&c) + 2; /* plus program and version */
    take_array(&c, nparents, 4);
    while (!c.bad && texts--) take(&c, take32(&c));
    return !c.bad && !left(&c);
}
