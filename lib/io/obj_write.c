/* obj_write.c: writes Wavefront OBJ as obj.c reads it.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

enum {
    MOST_NUMBER = 26,   /* bytes of a printed number and the blank before it */
    MOST_REFERENCE = 22 /* " v/vt", two 32-bit numbers */
};

static const char *label_word(uint32_t kind)
{
    switch (kind) {
    case VG_LABEL_OBJECT: return "o";
    case VG_LABEL_GROUP: return "g";
    case VG_LABEL_MATERIAL: return "usemtl";
    case VG_LABEL_SMOOTHING: return "s";
    case VG_LABEL_LIBRARY: return "mtllib";
    default: return NULL;
    }
}

static int write_label(vg_bytes *out, const vg_label *label, vg_err *e)
{
    const char *word = label_word(label->kind);
    size_t n = strlen(label->text);
    if (!word) return VG_OK; /* not a kind of label in OBJ */
    if (strpbrk(label->text, "\r\n"))
        return vg_fail(e, VG_EINPUT, "%s '%s' has a line break, which OBJ cannot hold", word, label->text);
    int r = vgi_bytes_append(out, word, strlen(word), e);
    if (r == VG_OK && n) r = vgi_bytes_append(out, " ", 1, e);
    if (r == VG_OK) r = vgi_bytes_append(out, label->text, n, e);
    /* a trailing blank keeps a final backslash from joining the next line */
    const char *stop = n && label->text[n - 1] == '\\' ? " \n" : "\n";
    return r == VG_OK ? vgi_bytes_append(out, stop, strlen(stop), e) : r;
}

/* Lines of `dim` numbers after a keyword. */
static int write_numbers(vg_bytes *out, const char *word, const double *x, size_t n, size_t dim, bool full, vg_err *e)
{
    size_t length = strlen(word);
    for (size_t i = 0; i < n; i++, x += dim) {
        if (vgi_bytes_reserve(out, out->size + length + dim * MOST_NUMBER + 1, e) < 0) return VG_ENOMEM;
        char *to = (char *)out->data + out->size;
        memcpy(to, word, length);
        to += length;
        for (size_t k = 0; k < dim; k++) {
            *to++ = ' ';
            to += full ? vgi_print_double(to, x[k]) : vgi_print_float(to, x[k]);
        }
        *to++ = '\n';
        out->size = (size_t)(to - (char *)out->data);
    }
    return VG_OK;
}

/* "v x y z r g b", colours from 0 to 1, and the opacity if it is not 1. */
static int write_coloured(vg_bytes *out, const vgi_writing *w, vg_err *e)
{
    const uint8_t *colour = w->attributes->colours;
    for (size_t v = 0; v < w->mesh->nv; v++, colour += 4) {
        if (vgi_bytes_reserve(out, out->size + 7 * MOST_NUMBER + 2, e) < 0) return VG_ENOMEM;
        char *to = (char *)out->data + out->size;
        *to++ = 'v';
        for (size_t k = 0; k < 3; k++) {
            const double x = w->vertices[3 * v + k];
            *to++ = ' ';
            to += w->full_precision ? vgi_print_double(to, x) : vgi_print_float(to, x);
        }
        for (size_t k = 0; k < (colour[3] == 255 ? 3u : 4u); k++) {
            *to++ = ' ';
            to += vgi_print_float(to, colour[k] / 255.0);
        }
        *to++ = '\n';
        out->size = (size_t)(to - (char *)out->data);
    }
    return VG_OK;
}

static int write_face(vg_bytes *out, const uint32_t *vert, const uint32_t *tex, size_t n, vg_err *e)
{
    if (vgi_bytes_reserve(out, out->size + n * MOST_REFERENCE + 2, e) < 0) return VG_ENOMEM;
    char *to = (char *)out->data + out->size;
    *to++ = n == 2 ? 'l' : 'f';
    for (size_t i = 0; i < n; i++) {
        *to++ = ' ';
        to += vgi_print_uint(to, (uint64_t)vert[i] + 1);
        if (!tex || tex[i] == UINT32_MAX) continue;
        *to++ = '/';
        to += vgi_print_uint(to, (uint64_t)tex[i] + 1);
    }
    *to++ = '\n';
    out->size = (size_t)(to - (char *)out->data);
    return VG_OK;
}

/* Labels that apply at or before face f, from *next on. Libraries are at the start of the file. */
static int write_labels(vg_bytes *out, const vg_attributes *a, size_t f, size_t *next, vg_err *e)
{
    for (; *next < a->nlabels && a->labels[*next].face <= f; ++*next) {
        if (a->labels[*next].kind == VG_LABEL_LIBRARY) continue;
        int r = write_label(out, &a->labels[*next], e);
        if (r < 0) return r;
    }
    return VG_OK;
}

static int write_libraries(vg_bytes *out, const vg_attributes *a, vg_err *e)
{
    for (size_t i = 0; i < a->nlabels; i++) {
        int r = a->labels[i].kind == VG_LABEL_LIBRARY ? write_label(out, &a->labels[i], e) : VG_OK;
        if (r < 0) return r;
    }
    return VG_OK;
}

static const vg_attributes *attributes_of(const vgi_writing *w)
{
    static const vg_attributes none;
    return w->attributes ? w->attributes : &none;
}

int vgi_obj_write(vg_bytes *out, const vgi_writing *w, vg_err *e)
{
    int r = write_libraries(out, attributes_of(w), e);
    if (r < 0 || attributes_of(w)->ncolours) return r < 0 ? r : write_coloured(out, w, e);
    return write_numbers(out, "v", w->vertices, w->mesh->nv, 3, w->full_precision, e);
}

int vgi_obj_rest(vg_bytes *out, const vgi_writing *w, vg_err *e)
{
    const vg_attributes *a = attributes_of(w);
    const vg_mesh *m = w->mesh;
    const uint32_t *tex = a->ntex ? a->corner_tex : NULL;
    int r = write_numbers(out, "vt", a->tex, a->ntex, a->tex_dim, w->full_precision, e);
    size_t next_label = 0;
    for (size_t f = 0; f < m->nf && r == VG_OK; f++) {
        uint32_t first = m->start[f];
        r = write_labels(out, a, f, &next_label, e);
        if (r == VG_OK)
            r = write_face(out, m->vert + first, tex ? tex + first : NULL, m->start[f + 1] - first, e);
    }
    return r == VG_OK ? write_labels(out, a, SIZE_MAX, &next_label, e) : r;
}
