/* cursor.h: a cursor that takes numbers, lists and texts from a payload, and the same for writing. Shared by the
 * files that know the contents of records (payload.c, frame_io.c, artefact_io.c); no other file includes it.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CURSOR_H
#define VG_CURSOR_H

#include "io/payload.h"

#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
enum { NATIVE = 1 };
#else
enum { NATIVE = 0 };
#endif

/* a cursor that never passes the end of the payload */

typedef struct cursor {
    const unsigned char *at, *end;
    bool bad;
} cursor;

static inline cursor start(const vgi_payload *p)
{
    return (cursor){p->data, p->size ? p->data + p->size : p->data, false};
}

static inline const unsigned char *take(cursor *c, size_t n)
{
    if (c->bad || (size_t)(c->end - c->at) < n) {
        c->bad = true;
        return NULL;
    }
    const unsigned char *p = c->at;
    c->at += n;
    return p;
}

static inline uint32_t take32(cursor *c)
{
    const unsigned char *p = take(c, 4);
    return p ? vgi_get32(p) : 0;
}

static inline uint64_t take64(cursor *c)
{
    const unsigned char *p = take(c, 8);
    return p ? vgi_get64(p) : 0;
}

/* n elements of `size` bytes, if they are present */
static inline const unsigned char *take_array(cursor *c, uint64_t n, size_t size)
{
    if (n > (size_t)(c->end - c->at) / size) {
        c->bad = true;
        return NULL;
    }
    return take(c, (size_t)n * size);
}

static inline size_t left(const cursor *c)
{
    return (size_t)(c->end - c->at);
}

static inline void copy32(uint32_t *to, const unsigned char *from, size_t n)
{
    for (size_t i = 0; i < n; i++) to[i] = vgi_get32(from + 4 * i);
}

static inline void copy_doubles(double *to, const unsigned char *from, size_t n)
{
    if (n == 0) return;
    if (NATIVE) {
        memcpy(to, from, n * sizeof *to);
        return;
    }
    for (size_t i = 0; i < n; i++) to[i] = vgi_as_double(vgi_get64(from + 8 * i));
}

static inline void copy_floats(double *to, const unsigned char *from, size_t n)
{
    for (size_t i = 0; i < n; i++) to[i] = (double)vgi_as_float(vgi_get32(from + 4 * i));
}

static inline int put64(vg_bytes *b, uint64_t x, vg_err *e)
{
    unsigned char p[8];
    vgi_put64(p, x);
    return vgi_bytes_append(b, p, sizeof p, e);
}

/* Readers refuse numbers that are not finite, so they must not be written. */
static inline int put_doubles(vg_bytes *b, const double *x, size_t n, vg_err *e)
{
    if (!vgi_finite(x, n)) return vg_fail(e, VG_EINPUT, "the result holds a number that is not finite");
    if (NATIVE) return vgi_bytes_append(b, x, n * sizeof *x, e);
    int r = vgi_bytes_reserve(b, b->size + 8 * n, e);
    for (size_t i = 0; r == VG_OK && i < n; i++, b->size += 8)
        vgi_put64(b->data + b->size, vgi_double_bits(x[i]));
    return r;
}

/* zero bytes up to the next multiple of 8 from `from` */
static inline int put_padding(vg_bytes *b, size_t from, vg_err *e)
{
    static const unsigned char zeros[8];
    return vgi_bytes_append(b, zeros, (from - b->size) & 7, e);
}

static inline int put_text(vg_bytes *b, const char *s, vg_err *e)
{
    size_t n = s ? strlen(s) : 0;
    int r = put64(b, n, e);
    if (r == VG_OK) r = vgi_bytes_append(b, s, n, e);
    return r < 0 ? r : put_padding(b, 0, e);
}

static inline int put_indices(vg_bytes *b, const uint32_t *x, size_t n, vg_err *e)
{
    int r = vgi_bytes_reserve(b, b->size + 4 * n, e);
    if (r < 0) return r;
    for (size_t i = 0; i < n; i++) vgi_put32(b->data + b->size + 4 * i, x[i]);
    b->size += 4 * n;
    return VG_OK;
}

static inline int wrong(const vgi_payload *p, const char *what, vg_err *e)
{
    return vg_fail(e, VG_EINPUT, "%s: %s", p->where, what);
}

static inline bool take_padding(cursor *c, size_t n)
{
    const unsigned char *p = take(c, n);
    for (size_t i = 0; p && i < n; i++)
        if (p[i]) return false;
    return p != NULL;
}

/* A text: its length, bytes and padding. Returns its address in the payload and sets *n; NULL and *r if it is
 * malformed. */
static inline const char *peek_text(cursor *c, size_t *n, const vgi_payload *p, int *r, vg_err *e)
{
    uint64_t length = take64(c);
    const char *s = (const char *)take_array(c, length, 1);
    *n = (size_t)length;
    if (!s) *r = wrong(p, "a text is longer than its record", e);
    else if (!vgi_is_utf8(s, *n)) *r = wrong(p, "a text is not UTF-8", e);
    else if (!take_padding(c, -length & 7)) *r = wrong(p, "padding is missing or not zero", e);
    else return s;
    return NULL;
}

/* The same, copied. */
static inline char *take_text(cursor *c, const vgi_payload *p, int *r, vg_err *e)
{
    size_t n;
    const char *s = peek_text(c, &n, p, r, e);
    char *copy = s ? vgi_copy_string(s, n, e) : NULL;
    if (s && !copy) *r = VG_ENOMEM;
    return copy;
}

#endif
