/* stl.c: STL, text and binary: triangles, each with its own three corners. Normals, colours and names of solids are
 * skipped.
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

static size_t find_slot(const struct reading *r, const double x[3])
{
    size_t i = hash_point(x) & (r->nslots - 1);
    while (r->slots[i] && memcmp(r->m->vertices + 3 * (size_t)(r->slots[i] - 1), x, 3 * sizeof *x) != 0)
        i = (i + 1) & (r->nslots - 1);
    return i;
}

static int grow_slots(struct reading *r)
{
    if (2 * (r->m->mesh.nv + 1) <= r->nslots) return VG_OK;
    size_t n = r->nslots ? 2 * r->nslots : 256;
    uint32_t *slots = vgi_array(n, sizeof *slots, r->e);
    if (!slots) return VG_ENOMEM;
    free(r->slots);
    r->slots = slots, r->nslots = n;
    for (size_t v = 0; v < r->m->mesh.nv; v++) slots[find_slot(r, r->m->vertices + 3 * v)] = (uint32_t)(v + 1);
    return VG_OK;
}

/* The vertex at this position, added if it is new. */
static int weld(struct reading *r, const double x[3], uint32_t *v)
{
    vg_mesh *m = &r->m->mesh;
    int result = grow_slots(r);
    if (result < 0) return result;
    size_t slot = find_slot(r, x);
    if (!r->slots[slot]) {
        if (m->nv >= UINT32_MAX - 1) return vg_fail(r->e, VG_EINPUT, "%s has too many vertices", r->subject);
        if ((result = vgi_grow(&r->m->vertices, &r->vertices_cap, 3 * (m->nv + 1), sizeof *x, r->e)) < 0)
            return result;
        memcpy(r->m->vertices + 3 * m->nv, x, 3 * sizeof *x);
        r->slots[slot] = (uint32_t)++m->nv;
    }
    *v = r->slots[slot] - 1;
    return VG_OK;
}

static int add_triangle(struct reading *r, double x[9])
{
    vg_mesh *m = &r->m->mesh;
    uint32_t v[3];
    for (int k = 0; k < 9; k++) {
        if (!isfinite(x[k]))
            return vg_fail(r->e, VG_EINPUT, "%s: corner %d of triangle %zu is not finite", r->subject, k / 3,
                           r->triangles);
        x[k] += 0.0; /* -0 becomes 0 */
    }
    for (int k = 0; k < 3; k++) {
        int result = weld(r, x + 3 * k, &v[k]);
        if (result < 0) return result;
    }
    r->triangles++;
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) {
        r->dropped++;
        return VG_OK;
    }
    if (3 * (m->nf + 1) >= UINT32_MAX) return vg_fail(r->e, VG_EINPUT, "%s has too many triangles", r->subject);
    int result = vgi_grow(&m->vert, &r->vert_cap, 3 * (m->nf + 1), sizeof *m->vert, r->e);
    if (result == VG_OK) result = vgi_grow(&m->start, &r->start_cap, m->nf + 2, sizeof *m->start, r->e);
    if (result < 0) return result;
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

static int read_binary(struct reading *r)
{
    size_t n = (size_t)(r->end - r->data);
    if (n < HEADER) return vg_fail(r->e, VG_ETRUNC, "%s ends within its header", r->subject);
    uint64_t count = vgi_get32((const unsigned char *)r->data + COUNT_OFF), there = (n - HEADER) / FACET;
    if (there < count)
        return vg_fail(r->e, VG_ETRUNC, "%s announces %llu triangles, but ends after %llu", r->subject,
                       (unsigned long long)count, (unsigned long long)there);
    if (n - HEADER > count * FACET)
        vgi_note(&r->m->note, "left out %llu bytes behind the last triangle",
                 (unsigned long long)(n - HEADER - count * FACET));
    int result = VG_OK;
    const char *p = r->data + HEADER;
    for (uint64_t i = 0; i < count && result == VG_OK; i++, p += FACET) {
        double x[9];
        for (int k = 0; k < 9; k++) x[k] = float_at(p + 12 + 4 * k);
        result = add_triangle(r, x);
    }
    return result;
}

/* ---- text ---- */

static bool is_space(char c)
{
    return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\v' || c == '\f';
}

static void skip_spaces(struct reading *r)
{
    while (r->p < r->end && is_space(*r->p)) r->p++;
}

static const char *next_word(struct reading *r, size_t *n)
{
    skip_spaces(r);
    const char *word = r->p;
    while (r->p < r->end && !is_space(*r->p)) r->p++;
    *n = (size_t)(r->p - word);
    return word;
}

static bool is(const char *word, size_t n, const char *what)
{
    return n == strlen(what) && !strncasecmp(word, what, n);
}

static size_t line_of(const struct reading *r, const char *p)
{
    size_t n = 1;
    for (const char *q = r->data; q < p && (q = memchr(q, '\n', (size_t)(p - q))); q++) n++;
    return n;
}

static int unexpected(const struct reading *r, const char *word, size_t n, const char *wanted)
{
    if (n == 0) return vg_fail(r->e, VG_ETRUNC, "%s ends where '%s' should come", r->subject, wanted);
    return vg_fail(r->e, VG_EINPUT, "%s, line %zu: '%.*s' where '%s' should come", r->subject, line_of(r, word),
                   (int)(n < SHOWN ? n : SHOWN), word, wanted);
}

static int expect(struct reading *r, const char *what)
{
    size_t n;
    const char *word = next_word(r, &n);
    return is(word, n, what) ? VG_OK : unexpected(r, word, n, what);
}

static int read_corner(struct reading *r, double x[3])
{
    for (int k = 0; k < 3; k++) {
        size_t n;
        const char *word = next_word(r, &n);
        if (n == 0 || vgi_parse_double(word, word + n, &x[k]) != word + n) return unexpected(r, word, n, "a number");
    }
    return VG_OK;
}

/* A normal is not used, so anything is accepted: "nan", "-1.#IND", fewer or more words. */
static int skip_normal(struct reading *r)
{
    enum { MOST = 8 };
    size_t n;
    const char *word = next_word(r, &n);
    for (int i = 0; i < MOST && n && !is(word, n, "outer"); i++) word = next_word(r, &n);
    return is(word, n, "outer") ? VG_OK : unexpected(r, word, n, "outer");
}

static int read_facet(struct reading *r)
{
    double x[9];
    int result = skip_normal(r);
    if (result == VG_OK) result = expect(r, "loop");
    for (int k = 0; k < 3 && result == VG_OK; k++) {
        result = expect(r, "vertex");
        if (result == VG_OK) result = read_corner(r, x + 3 * k);
    }
    if (result == VG_OK) result = expect(r, "endloop");
    if (result == VG_OK) result = expect(r, "endfacet");
    return result == VG_OK ? add_triangle(r, x) : result;
}

/* The name of a solid is the rest of its line, whatever it contains. */
static void skip_line(struct reading *r)
{
    while (r->p < r->end && *r->p != '\n' && *r->p != '\r') r->p++;
}

static int read_solid(struct reading *r)
{
    int result = expect(r, "solid");
    skip_line(r);
    while (result == VG_OK) {
        size_t n;
        const char *word = next_word(r, &n);
        if (is(word, n, "endsolid")) break;
        result = is(word, n, "facet") ? read_facet(r) : unexpected(r, word, n, "facet");
    }
    skip_line(r);
    return result;
}

/* One solid after another; other text after the last one is ignored. */
static int read_text(struct reading *r)
{
    int result;
    do {
        result = read_solid(r);
        skip_spaces(r);
    } while (result == VG_OK && r->end - r->p >= 5 && !strncasecmp(r->p, "solid", 5));
    if (result == VG_OK && r->p < r->end)
        vgi_note(&r->m->note, "left out what stands behind the last solid, from line %zu on", line_of(r, r->p));
    return result;
}

/* ---- text or binary ---- */

static bool starts_as_text(const unsigned char *data, size_t n)
{
    while (n > 0 && is_space((char)*data)) data++, n--;
    return n > 5 && !strncasecmp((const char *)data, "solid", 5) && is_space((char)data[5]);
}

/* Whether it looks like binary STL, whose header may begin like text. The count agrees with the size; or, for the
 * start of a larger file, the triangles seen have finite corners and no attribute. */
static bool looks_binary(const unsigned char *data, size_t n)
{
    if (n < HEADER + FACET) return n == HEADER && vgi_get32(data + COUNT_OFF) == 0;
    uint64_t count = vgi_get32(data + COUNT_OFF), seen = (n - HEADER) / FACET;
    if (n - HEADER == count * FACET) return true;
    if (count == 0) return false;
    if (seen > count) seen = count; /* bytes after the last triangle */
    if (seen > 80) seen = 80;
    for (uint64_t i = 0; i < seen; i++) {
        const unsigned char *p = data + HEADER + i * FACET;
        if (p[48] || p[49]) return false;
        for (int k = 0; k < 9; k++)
            if (!(fabsf(float_at((const char *)p + 12 + 4 * k)) < 1e20f)) return false;
    }
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
    struct reading r = {.data = data, .p = data, .end = data + n, .subject = subject, .e = e, .m = m};
    bool text = starts_as_text(bytes, n) && !has_zero_byte(bytes, n);
    int result = text ? read_text(&r) : read_binary(&r);
    free(r.slots);
    vgi_note_dropped(&m->note, r.dropped);
    if (result == VG_OK && r.triangles == 0) return vg_fail(e, VG_EINPUT, "%s has no triangles", subject);
    if (result == VG_OK && m->mesh.nf == 0)
        return vg_fail(e, VG_EINPUT, "%s has no triangle whose three corners are apart", subject);
    return result;
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

static const double *point(const struct writing *x, uint32_t v)
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
    for (int k = 0; k < 3 && r == VG_OK; k++) r = put_line(x, "vertex", point(x, v[k]), x->w->full_precision);
    return r == VG_OK ? put_line(x, "endloop\nendfacet\n", NULL, false) : r;
}

static int put_triangle(struct writing *x, uint32_t a, uint32_t b, uint32_t c)
{
    const uint32_t v[3] = {a, b, c};
    double n[3];
    vgi_triangle_normal(point(x, a), point(x, b), point(x, c), n);
    if (!isfinite(vgi_make_unit(n))) n[0] = n[1] = n[2] = 0;
    x->triangles++;
    if (x->text) return put_text(x, n, v);
    unsigned char facet[FACET] = {0};
    for (int k = 0; k < 3; k++) vgi_put32(facet + 4 * k, vgi_float_bits((float)n[k]));
    for (int i = 0; i < 9; i++)
        vgi_put32(facet + 12 + 4 * i, vgi_float_bits((float)point(x, v[i / 3])[i % 3]));
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
            return vg_fail(e, VG_EINPUT, "vertex %zu does not fit single precision (%g)", i / 3, w->vertices[i]);
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
    if (x.triangles == 0) return vg_fail(e, VG_EINPUT, "there is no face, and STL holds nothing else");
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
