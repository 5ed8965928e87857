/* ply_write.c: writes PLY polygon files, text and binary in both byte orders: vertices with their colours, faces
 * with the colours of their patches, edges.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"
#include "model/colour.h"

enum { MOST_NUMBER = 26, MOST_SMALL_FACE = 255 }; /* bytes of a number and its separator; a length of 8 bits */

enum encoding { TEXT, LITTLE, BIG };

struct writing {
    vg_bytes *out;
    const vgi_writing *w;
    enum encoding encoding;
    size_t nfaces;  /* faces before nfaces are element face, those from there on element edge */
    bool long_list; /* list lengths need 32 bits */
    vg_err *e;
};

static void put_bits(char **to, uint64_t x, size_t bytes, enum encoding encoding)
{
    for (size_t i = 0; i < bytes; i++) (*to)[encoding == BIG ? bytes - 1 - i : i] = (char)(x >> 8 * i);
    *to += bytes;
}

static void put_integer(char **to, uint64_t x, size_t bytes, enum encoding encoding, char separator)
{
    if (encoding != TEXT) {
        put_bits(to, x, bytes, encoding);
        return;
    }
    *to += vgi_print_uint(*to, x);
    *(*to)++ = separator;
}

static void put_number(char **to, double x, bool full, enum encoding encoding, char separator)
{
    if (encoding == TEXT) {
        *to += full ? vgi_print_double(*to, x) : vgi_print_float(*to, x);
        *(*to)++ = separator;
    } else if (full) {
        put_bits(to, vgi_double_bits(x), 8, encoding);
    } else {
        put_bits(to, vgi_float_bits((float)x), 4, encoding);
    }
}

/* Two-vertex faces become edges if that keeps the order: if all of them come last. */
static void divide_faces(struct writing *x)
{
    const vg_mesh *m = x->w->mesh;
    x->nfaces = m->nf;
    while (x->nfaces > 0 && m->start[x->nfaces] - m->start[x->nfaces - 1] == 2) x->nfaces--;
    size_t pairs = 0;
    for (size_t f = 0; f < x->nfaces; f++) {
        size_t size = m->start[f + 1] - m->start[f];
        pairs += size == 2;
        x->long_list |= size > MOST_SMALL_FACE;
    }
    if (pairs) x->nfaces = m->nf;
}

static bool has_colours(const struct writing *x)
{
    return x->w->patches && x->w->patches->n;
}

/* Of the colour of a vertex: 0, 3, or 4 if some vertex is not opaque. */
static int channels_of(const struct writing *x)
{
    const vg_attributes *a = x->w->attributes;
    if (!a || !a->ncolours) return 0;
    for (size_t v = 0; v < a->ncolours; v++)
        if (a->colours[4 * v + 3] != 255) return 4;
    return 3;
}

static int write_header(struct writing *x)
{
    static const char colour[] = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    static const char *const names[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    const vg_mesh *m = x->w->mesh;
    const char *real = x->w->full_precision ? "double" : "float";
    const char *index = m->nv > (size_t)INT32_MAX + 1 ? "uint" : "int";
    char text[700];
    int n = snprintf(text, sizeof text,
                     "ply\nformat %s 1.0\nelement vertex %zu\nproperty %s x\nproperty %s y\nproperty %s z\n%s%s"
                     "element face %zu\nproperty list %s %s vertex_indices\n%s",
                     names[x->encoding], m->nv, real, real, real, channels_of(x) ? colour : "",
                     channels_of(x) > 3 ? "property uchar alpha\n" : "", x->nfaces, x->long_list ? "uint" : "uchar", index,
                     has_colours(x) ? colour : "");
    int r = vgi_bytes_append(x->out, text, (size_t)n, x->e);
    if (r == VG_OK && x->nfaces < m->nf) {
        n = snprintf(text, sizeof text, "element edge %zu\nproperty %s vertex1\nproperty %s vertex2\n",
                     m->nf - x->nfaces, index, index);
        r = vgi_bytes_append(x->out, text, (size_t)n, x->e);
    }
    return r == VG_OK ? vgi_bytes_append(x->out, "end_header\n", 11, x->e) : r;
}

/* Reserve room for n numbers of at most `most` bytes; returns its address. NULL: out of memory. */
static char *reserve_text(struct writing *x, size_t n, size_t most)
{
    if (vgi_bytes_reserve(x->out, x->out->size + n * most, x->e) < 0) return NULL;
    return (char *)x->out->data + x->out->size;
}

static void wrote(struct writing *x, const char *to)
{
    x->out->size = (size_t)(to - (char *)x->out->data);
}

static int write_vertices(struct writing *x)
{
    const vg_mesh *m = x->w->mesh;
    const size_t channels = (size_t)channels_of(x);
    for (size_t v = 0; v < m->nv; v++) {
        char *to = reserve_text(x, 7, MOST_NUMBER);
        if (!to) return VG_ENOMEM;
        for (size_t k = 0; k < 3; k++)
            put_number(&to, x->w->vertices[3 * v + k], x->w->full_precision, x->encoding, k < 2 || channels ? ' ' : '\n');
        for (size_t k = 0; k < channels; k++)
            put_integer(&to, x->w->attributes->colours[4 * v + k], 1, x->encoding, k + 1 < channels ? ' ' : '\n');
        wrote(x, to);
    }
    return VG_OK;
}

static int write_faces(struct writing *x)
{
    const vg_mesh *m = x->w->mesh;
    for (size_t f = 0; f < m->nf; f++) {
        uint32_t first = m->start[f], end = m->start[f + 1];
        bool coloured = f < x->nfaces && has_colours(x);
        char *to = reserve_text(x, (size_t)(end - first) + 4, MOST_NUMBER);
        if (!to) return VG_ENOMEM;
        if (f < x->nfaces) put_integer(&to, end - first, x->long_list ? 4 : 1, x->encoding, ' ');
        for (uint32_t c = first; c < end; c++)
            put_integer(&to, m->vert[c], 4, x->encoding, c + 1 < end || coloured ? ' ' : '\n');
        if (coloured) {
            unsigned char colour[3];
            vgi_patch_colour(x->w->patches->of_face[f], colour);
            for (int k = 0; k < 3; k++) put_integer(&to, colour[k], 1, x->encoding, k < 2 ? ' ' : '\n');
        }
        wrote(x, to);
    }
    return VG_OK;
}

static int write_ply(vg_bytes *out, const vgi_writing *w, enum encoding encoding, vg_err *e)
{
    struct writing x = {.out = out, .w = w, .encoding = encoding, .e = e};
    divide_faces(&x);
    int r = write_header(&x);
    return r == VG_OK ? write_vertices(&x) : r;
}

static int write_rest(vg_bytes *out, const vgi_writing *w, enum encoding encoding, vg_err *e)
{
    struct writing x = {.out = out, .w = w, .encoding = encoding, .e = e};
    divide_faces(&x);
    return write_faces(&x);
}

int vgi_ply_write_little(vg_bytes *out, const vgi_writing *w, vg_err *e)
{
    return write_ply(out, w, LITTLE, e);
}

int vgi_ply_write_text(vg_bytes *out, const vgi_writing *w, vg_err *e)
{
    return write_ply(out, w, TEXT, e);
}

int vgi_ply_write_big(vg_bytes *out, const vgi_writing *w, vg_err *e)
{
    return write_ply(out, w, BIG, e);
}

int vgi_ply_rest_little(vg_bytes *out, const vgi_writing *w, vg_err *e)
{
    return write_rest(out, w, LITTLE, e);
}

int vgi_ply_rest_text(vg_bytes *out, const vgi_writing *w, vg_err *e)
{
    return write_rest(out, w, TEXT, e);
}

int vgi_ply_rest_big(vg_bytes *out, const vgi_writing *w, vg_err *e)
{
    return write_rest(out, w, BIG, e);
}
