/* stl.c: STL, text and binary: triangles, each with its own three corners. Normals and names of solids are skipped; so are
 * the two bytes behind a triangle of a binary file, in which some programs keep its colour, but these are counted.
 *
 * A corner has no number in STL. Corners at exactly the same position (-0 is 0) become one vertex, numbered in order
 * of first appearance; near positions are not merged. A triangle with two corners at one position is not a face: it
 * is dropped and counted (vgi_note_dropped).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"
#include "io/polygon.h"
#include "numeric/face.h"

#include <math.h>
#include <stdlib.h>
#include <strings.h>

enum { HEADER = 84, FACET = 50, COUNT_OFF = 80, SHOWN = 40, MOST_NUMBER = 26 };

/* ------------------------------------------------------------------------------------------- reading -- */

struct reading {
    const char *data, *p, *end;
    const char *subject;
    vg_err *e;
    vg_model *m;
    size_t vertices_cap, start_cap, vert_cap, triangles, dropped;
    size_t marked;   /* triangles with attribute bytes */
    uint32_t *slots; /* hash table of vertices + 1; 0: free; nslots is a power of two */
    size_t nslots;
};

static size_t hash_point(const double x[3])
{
    uint64_t h = 0;
    for (int k = 0; k < 3; k++) {
        h = (h ^ vgi_double_bits(x[k])) * 0x9e3779b97f4a7c15u;
        h ^= h >> 29;
    }
    return (size_t)h;
}

static size_t find_slot(const struct reading *in, const double x[3])
{
    size_t i = hash_point(x) & (in->nslots - 1);
    while (in->slots[i] && memcmp(in->m->vertices + 3 * (size_t)(in->slots[i] - 1), x, 3 * sizeof *x) != 0)
        i = (i + 1) & (in->nslots - 1);
    return i;
}

static int grow_slots(struct reading *in)
{
    if (2 * (in->m->mesh.nv + 1) <= in->nslots) return VG_OK;
    size_t n = in->nslots ? 2 * in->nslots : 256;
    uint32_t *slots = vgi_array(n, sizeof *slots, in->e);
    if (!slots) return VG_ENOMEM;
    free(in->slots);
    in->slots = slots, in->nslots = n;
    for (size_t v = 0; v < in->m->mesh.nv; v++) slots[find_slot(in, in->m->vertices + 3 * v)] = (uint32_t)(v + 1);
    return VG_OK;
}

/* The vertex at this position, added if it is new. */
static int weld_corner(struct reading *in, const double x[3], uint32_t *v)
{
    vg_mesh *m = &in->m->mesh;
    int r = grow_slots(in);
    if (r < 0) return r;
    size_t slot = find_slot(in, x);
    if (!in->slots[slot]) {
        if (m->nv >= UINT32_MAX - 1) return vg_fail(in->e, VG_EINPUT, "%s has too many vertices", in->subject);
        if ((r = vgi_grow(&in->m->vertices, &in->vertices_cap, 3 * (m->nv + 1), sizeof *x, in->e)) < 0)
            return r;
        memcpy(in->m->vertices + 3 * m->nv, x, 3 * sizeof *x);
        in->slots[slot] = (uint32_t)++m->nv;
    }
    *v = in->slots[slot] - 1;
    return VG_OK;
}

static int add_triangle(struct reading *in, double x[9])
{
    vg_mesh *m = &in->m->mesh;
    uint32_t v[3];
    for (int k = 0; k < 9; k++) {
        if (!isfinite(x[k]))
            return vg_fail(in->e, VG_EINPUT, "%s: corner %d of triangle %zu is not finite", in->subject, k / 3,
                           in->triangles);
        x[k] += 0.0; /* -0 becomes 0 */
    }
    for (int k = 0; k < 3; k++) {
        int r = weld_corner(in, x + 3 * k, &v[k]);
        if (r < 0) return r;
    }
    in->triangles++;
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) {
        in->dropped++;
        return VG_OK;
    }
    if (3 * (m->nf + 1) >= UINT32_MAX) return vg_fail(in->e, VG_EINPUT, "%s has too many triangles", in->subject);
    int r = vgi_grow(&m->vert, &in->vert_cap, 3 * (m->nf + 1), sizeof *m->vert, in->e);
    if (r == VG_OK) r = vgi_grow(&m->start, &in->start_cap, m->nf + 2, sizeof *m->start, in->e);
    if (r < 0) return r;
    memcpy(m->vert + 3 * m->nf, v, sizeof v);
    m->nf++;
    m->start[0] = 0;
    m->start[m->nf] = (uint32_t)(3 * m->nf);
    return VG_OK;
}

static float float_at(const char *p)
{
    return vgi_as_float(vgi_get32((const unsigned char *)p));
}

static bool has_attribute(const char *facet)
{
    return facet[48] || facet[49];
}

static int read_binary(struct reading *in)
{
    size_t n = (size_t)(in->end - in->data);
    if (n < HEADER) return vg_fail(in->e, VG_ETRUNC, "%s ends within its header", in->subject);
    uint64_t count = vgi_get32((const unsigned char *)in->data + COUNT_OFF), there = (n - HEADER) / FACET;
    if (there < count)
        return vg_fail(in->e, VG_ETRUNC, "%s announces %llu triangles, but ends after %llu", in->subject,
                       (unsigned long long)count, (unsigned long long)there);
    if (n - HEADER > count * FACET)
        vgi_note(&in->m->note, "left out %llu bytes after the last triangle",
                 (unsigned long long)(n - HEADER - count * FACET));
    int r = VG_OK;
    const char *p = in->data + HEADER;
    for (uint64_t i = 0; i < count && r == VG_OK; i++, p += FACET) {
        double x[9];
        for (int k = 0; k < 9; k++) x[k] = float_at(p + 12 + 4 * k);
        in->marked += has_attribute(p);
        r = add_triangle(in, x);
    }
    if (in->marked)
        vgi_note(&in->m->note, "left out the attribute bytes of %zu triangles, which may be colours", in->marked);
    return r;
}

/* ---- text ---- */

static bool is_space(char c)
{
    return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\v' || c == '\f';
}

static void skip_spaces(struct reading *in)
{
    while (in->p < in->end && is_space(*in->p)) in->p++;
}

static const char *next_word(struct reading *in, size_t *n)
{
    skip_spaces(in);
    const char *word = in->p;
    while (in->p < in->end && !is_space(*in->p)) in->p++;
    *n = (size_t)(in->p - word);
    return word;
}

static bool is(const char *word, size_t n, const char *what)
{
    return n == strlen(what) && !strncasecmp(word, what, n);
}

static size_t line_of(const struct reading *in, const char *p)
{
    size_t n = 1;
    for (const char *q = in->data; q < p && (q = memchr(q, '\n', (size_t)(p - q))); q++) n++;
    return n;
}

static int unexpected(const struct reading *in, const char *word, size_t n, const char *wanted)
{
    if (n == 0) return vg_fail(in->e, VG_ETRUNC, "%s ends where '%s' is expected", in->subject, wanted);
    return vg_fail(in->e, VG_EINPUT, "%s, line %zu: '%.*s' where '%s' is expected", in->subject, line_of(in, word),
                   (int)(n < SHOWN ? n : SHOWN), word, wanted);
}

static int expect(struct reading *in, const char *what)
{
    size_t n;
    const char *word = next_word(in, &n);
    return is(word, n, what) ? VG_OK : unexpected(in, word, n, what);
}

static int read_corner(struct reading *in, double x[3])
{
    for (int k = 0; k < 3; k++) {
        size_t n;
        const char *word = next_word(in, &n);
        if (n == 0 || vgi_parse_double(word, word + n, &x[k]) != word + n) return unexpected(in, word, n, "a number");
    }
    return VG_OK;
}

/* A normal is not used, so anything is accepted: "nan", "-1.#IND", fewer or more words. */
static int skip_normal(struct reading *in)
{
    enum { MOST = 8 };
    size_t n;
    const char *word = next_word(in, &n);
    for (int i = 0; i < MOST && n && !is(word, n, "outer"); i++) word = next_word(in, &n);
    return is(word, n, "outer") ? VG_OK : unexpected(in, word, n, "outer");
}

static int read_facet(struct reading *in)
{
    double x[9];
    int r = skip_normal(in);
    if (r == VG_OK) r = expect(in, "loop");
    for (int k = 0; k < 3 && r == VG_OK; k++) {
        r = expect(in, "vertex");
        if (r == VG_OK) r = read_corner(in, x + 3 * k);
    }
    if (r == VG_OK) r = expect(in, "endloop");
    if (r == VG_OK) r = expect(in, "endfacet");
    return r == VG_OK ? add_triangle(in, x) : r;
}

/* The name of a solid is the rest of its line, whatever it contains. */
static void skip_line(struct reading *in)
{
    while (in->p < in->end && *in->p != '\n' && *in->p != '\r') in->p++;
}

static int read_solid(struct reading *in)
{
    int r = expect(in, "solid");
    skip_line(in);
    while (r == VG_OK) {
        size_t n;
        const char *word = next_word(in, &n);
        if (is(word, n, "endsolid")) break;
        r = is(word, n, "facet") ? read_facet(in) : unexpected(in, word, n, "facet");
    }
    skip_line(in);
    return r;
}

/* One solid after another; other text after the last one is ignored. */
static int read_text(struct reading *in)
{
    int r;
    do {
        r = read_solid(in);
        skip_spaces(in);
    } while (r == VG_OK && in->end - in->p >= 5 && !strncasecmp(in->p, "solid", 5));
    if (r == VG_OK && in->p < in->end)
        vgi_note(&in->m->note, "left out data after the last solid, from line %zu on", line_of(in, in->p));
    return r;
}

/* ---- text or binary ---- */

static bool starts_as_text(const unsigned char *data, size_t n)
{
    while (n > 0 && is_space((char)*data)) data++, n--;
    return n > 5 && !strncasecmp((const char *)data, "solid", 5) && is_space((char)data[5]);
}

/* The corners of a triangle are finite; and with attribute bytes, its normal has length 1 or 0. */
static bool looks_like_facet(const char *p)
{
    double length = 0;
    for (int k = 0; k < 9; k++)
        if (!(fabsf(float_at(p + 12 + 4 * k)) < 1e20f)) return false;
    if (!has_attribute(p)) return true;
    for (int k = 0; k < 3; k++) length += (double)float_at(p + 4 * k) * (double)float_at(p + 4 * k);
    return length == 0 || (length > 0.9 && length < 1.1);
}

/* Whether it looks like binary STL, whose header may begin like text. The count agrees with the size; or, for the
 * start of a larger file, the triangles seen look like triangles. */
static bool looks_binary(const unsigned char *data, size_t n)
{
    if (n < HEADER + FACET) return n == HEADER && vgi_get32(data + COUNT_OFF) == 0;
    uint64_t count = vgi_get32(data + COUNT_OFF), seen = (n - HEADER) / FACET;
    if (n - HEADER == count * FACET) return true;
    if (count == 0) return false;
    if (seen > count) seen = count; /* bytes after the last triangle */
    if (seen > 80) seen = 80;
    for (uint64_t i = 0; i < seen; i++)
        if (!looks_like_facet((const char *)data + HEADER + i * FACET)) return false;
    return true;
}

static bool has_zero_byte(const unsigned char *data, size_t n)
{
    return memchr(data, 0, n) != NULL;
}

static bool sniff_stl(const unsigned char *data, size_t n)
{
    return (starts_as_text(data, n) && !has_zero_byte(data, n)) || looks_binary(data, n);
}

static int read_stl(vg_model *m, const char *data, size_t n, const char *subject, vg_err *e)
{
    const unsigned char *bytes = (const unsigned char *)data;
    struct reading in = {.data = data, .p = data, .end = data + n, .subject = subject, .e = e, .m = m};
    bool text = starts_as_text(bytes, n) && !has_zero_byte(bytes, n);
    int r = text ? read_text(&in) : read_binary(&in);
    free(in.slots);
    vgi_note_dropped(&m->note, in.dropped);
    if (r == VG_OK && in.triangles == 0) return vg_fail(e, VG_EINPUT, "%s has no triangles", subject);
    if (r == VG_OK && m->mesh.nf == 0)
        return vg_fail(e, VG_EINPUT, "%s has no triangle with three different corners", subject);
    return r;
}

/* ------------------------------------------------------------------------------------------- writing -- */

struct writing {
    vg_bytes *out;
    const vgi_writing *w;
    bool text;
    uint64_t triangles;
    uint32_t *ring; /* the remainder of a face that is clipped */
    size_t ring_cap;
    vg_err *e;
};

static const double *point_of(const struct writing *x, uint32_t v)
{
    return x->w->vertices + 3 * (size_t)v;
}

/* Words, followed by the three numbers of p unless it is NULL, and the end of the line. */
static int put_line(struct writing *x, const char *words, const double *p, bool full)
{
    char numbers[3 * MOST_NUMBER + 1], *to = numbers;
    int r = vgi_bytes_append(x->out, words, strlen(words), x->e);
    if (r < 0 || !p) return r;
    for (int k = 0; k < 3; k++) {
        *to++ = ' ';
        to += full ? vgi_print_double(to, p[k]) : vgi_print_float(to, p[k]);
    }
    *to++ = '\n';
    return vgi_bytes_append(x->out, numbers, (size_t)(to - numbers), x->e);
}

static int put_text(struct writing *x, const double normal[3], const uint32_t v[3])
{
    int r = put_line(x, "facet normal", normal, false);
    if (r == VG_OK) r = put_line(x, "outer loop\n", NULL, false);
    for (int k = 0; k < 3 && r == VG_OK; k++) r = put_line(x, "vertex", point_of(x, v[k]), x->w->full_precision);
    return r == VG_OK ? put_line(x, "endloop\nendfacet\n", NULL, false) : r;
}

static int put_triangle(struct writing *x, uint32_t a, uint32_t b, uint32_t c)
{
    const uint32_t v[3] = {a, b, c};
    double n[3];
    vgi_triangle_normal(point_of(x, a), point_of(x, b), point_of(x, c), n);
    if (!isfinite(vgi_make_unit(n))) n[0] = n[1] = n[2] = 0;
    x->triangles++;
    if (x->text) return put_text(x, n, v);
    unsigned char facet[FACET] = {0};
    for (int k = 0; k < 3; k++) vgi_put32(facet + 4 * k, vgi_float_bits((float)n[k]));
    for (int i = 0; i < 9; i++)
        vgi_put32(facet + 12 + 4 * i, vgi_float_bits((float)point_of(x, v[i / 3])[i % 3]));
    return vgi_bytes_append(x->out, facet, sizeof facet, x->e);
}

static int put_fan(struct writing *x, const uint32_t *v, size_t n)
{
    int r = VG_OK;
    for (size_t i = 1; i + 1 < n && r == VG_OK; i++) r = put_triangle(x, v[0], v[i], v[i + 1]);
    return r;
}

/* Cut ears; if none is left (the face crosses itself), use a fan. */
static int clip_ears(struct writing *x, const uint32_t *v, size_t n, const double normal[3])
{
    int r = vgi_grow(&x->ring, &x->ring_cap, n, sizeof *x->ring, x->e);
    if (r < 0) return r;
    memcpy(x->ring, v, n * sizeof *v);
    while (n > 3 && r == VG_OK) {
        size_t i = 0;
        while (i < n && !vgi_is_ear(x->w->shape, x->ring, n, i, normal)) i++;
        if (i == n) break;
        r = put_triangle(x, x->ring[(i + n - 1) % n], x->ring[i], x->ring[(i + 1) % n]);
        memmove(x->ring + i, x->ring + i + 1, (n - i - 1) * sizeof *x->ring);
        n--;
    }
    return r == VG_OK ? put_fan(x, x->ring, n) : r;
}

/* A fan if it covers the face. */
static int put_face(struct writing *x, const uint32_t *v, size_t n)
{
    double normal[3];
    if (n <= 3 || n > VGI_MOST_CLIPPED) return put_fan(x, v, n);
    vgi_face_area(x->w->shape, v, n, normal);
    return vgi_is_fan(x->w->shape, v, n, normal) ? put_fan(x, v, n) : clip_ears(x, v, n, normal);
}

static int check_singles(const vgi_writing *w, vg_err *e)
{
    for (size_t i = 0; i < 3 * w->mesh->nv; i++)
        if (!isfinite((float)w->vertices[i]))
            return vg_fail(e, VG_EINPUT, "vertex %zu does not fit binary32 (%g)", i / 3, w->vertices[i]);
    return VG_OK;
}

static int write_stl(vg_bytes *out, const vgi_writing *w, bool text, vg_err *e)
{
    static const char header[HEADER] = "binary STL";
    const vg_mesh *m = w->mesh;
    struct writing x = {.out = out, .w = w, .text = text, .e = e};
    size_t start = out->size;
    int r = text ? put_line(&x, "solid\n", NULL, false) : check_singles(w, e);
    if (r == VG_OK && !text) r = vgi_bytes_append(out, header, HEADER, e);
    for (size_t f = 0; f < m->nf && r == VG_OK; f++)
        r = put_face(&x, m->vert + m->start[f], m->start[f + 1] - m->start[f]);
    if (r == VG_OK && text) r = put_line(&x, "endsolid\n", NULL, false);
    free(x.ring);
    if (r < 0) return r;
    if (x.triangles == 0) return vg_fail(e, VG_EINPUT, "there are no faces, and STL holds nothing else");
    if (x.triangles > UINT32_MAX) return vg_fail(e, VG_EINPUT, "STL holds at most 2^32 - 1 triangles");
    if (!text) vgi_put32(out->data + start + COUNT_OFF, (uint32_t)x.triangles);
    return VG_OK;
}

static int write_binary(vg_bytes *out, const vgi_writing *w, vg_err *e)
{
    return write_stl(out, w, false, e);
}

static int write_ascii(vg_bytes *out, const vgi_writing *w, vg_err *e)
{
    return write_stl(out, w, true, e);
}

const vgi_format vgi_format_stl = {"stl", ".stl", sniff_stl, read_stl, write_binary, NULL, VGI_KEEPS_FACES};
const vgi_format vgi_format_stl_ascii = {"stl-ascii", ".stl", sniff_stl, read_stl, write_ascii, NULL,
                                         VGI_KEEPS_FACES | VGI_KEEPS_DOUBLES};
