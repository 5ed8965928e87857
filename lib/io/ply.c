/* ply.c: reads PLY polygon files, text and binary in both byte orders: vertices, faces, triangle strips, edges. All
 * other elements and properties (colours, normals, user data) are skipped. Writing is in ply_write.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_WORDS = 6, SHOWN = 40 }; /* words per header line; bytes of the input shown in a message */

enum type { NO_TYPE, I8, U8, I16, U16, I32, U32, F32, F64 };
static const unsigned char type_bytes[] = {0, 1, 1, 2, 2, 4, 4, 4, 8};

/* The properties that are read. X, Y, Z in this order. */
enum role { PASSED_OVER, X, Y, Z, INDICES, FROM, TO };
enum kind { OTHER, VERTEX, FACE, EDGE, STRIPS };

struct property {
    enum type count, item; /* count: NO_TYPE for a scalar */
    enum role role;
};

struct element {
    enum kind kind;
    char name[SHOWN + 1];
    uint64_t count;
    size_t first, n; /* its properties */
    size_t least;    /* least number of bytes per element */
    bool fixed;      /* binary, no lists: exactly `least` bytes each */
};

struct reading {
    const char *p, *end;
    bool text, swap; /* swap: numbers are big-endian */
    const char *subject;
    vg_err *e;
    vg_model *m;
    struct element *elements;
    size_t nelements, elements_cap;
    struct property *properties;
    size_t nproperties, properties_cap;
    size_t start_cap, vert_cap, corners;
    bool has_vertices;
};

struct word {
    const char *at;
    size_t n;
};

static bool word_is(struct word w, const char *text)
{
    return strlen(text) == w.n && !memcmp(w.at, text, w.n);
}

static int shown(struct word w)
{
    return w.n > SHOWN ? SHOWN : (int)w.n;
}

static enum type type_named(struct word w)
{
    static const struct {
        const char *name;
        enum type type;
    } names[] = {{"char", I8},    {"int8", I8},     {"uchar", U8},   {"uint8", U8},   {"short", I16}, {"int16", I16},
                 {"ushort", U16}, {"uint16", U16},  {"int", I32},    {"int32", I32},  {"uint", U32},  {"uint32", U32},
                 {"float", F32},  {"float32", F32}, {"double", F64}, {"float64", F64}};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (word_is(w, names[i].name)) return names[i].type;
    return NO_TYPE;
}

/* One line of the header, split into words; lines end as the first one does. False at the end of the file. */
static bool next_line(struct reading *r, char line_end, struct word words[MOST_WORDS], size_t *n)
{
    const char *stop = memchr(r->p, line_end, (size_t)(r->end - r->p));
    if (!stop) return false;
    const char *p = r->p;
    r->p = stop + 1;
    *n = 0;
    for (;;) {
        while (p < stop && (*p == ' ' || *p == '\t' || *p == '\r')) p++;
        if (p == stop) return true;
        struct word w = {p, 0};
        while (p < stop && *p != ' ' && *p != '\t' && *p != '\r') p++;
        w.n = (size_t)(p - w.at);
        if (*n < MOST_WORDS) words[*n] = w;
        ++*n;
    }
}

static int read_encoding(struct reading *r, const struct word *words, size_t n)
{
    if (n != 3 || !word_is(words[2], "1.0"))
        return vg_fail(r->e, VG_EINPUT, "%s: the PLY header has no format and version 1.0", r->subject);
    r->text = word_is(words[1], "ascii");
    r->swap = word_is(words[1], "binary_big_endian");
    if (r->text || r->swap || word_is(words[1], "binary_little_endian")) return VG_OK;
    return vg_fail(r->e, VG_EINPUT, "%s: unknown PLY format '%.*s'", r->subject, shown(words[1]), words[1].at);
}

static int read_element_line(struct reading *r, const struct word *words, size_t n)
{
    static const struct {
        const char *name;
        enum kind kind;
    } kinds[] = {{"vertex", VERTEX}, {"face", FACE}, {"edge", EDGE}, {"tristrips", STRIPS}};
    int64_t count = -1;
    const char *stop = n == 3 ? vgi_parse_int(words[2].at, words[2].at + words[2].n, &count) : NULL;
    if (n != 3 || stop != words[2].at + words[2].n || count < 0)
        return vg_fail(r->e, VG_EINPUT, "%s: the PLY header has an element without name and count", r->subject);
    if (vgi_grow(&r->elements, &r->elements_cap, r->nelements + 1, sizeof *r->elements, r->e) < 0) return VG_ENOMEM;
    struct element *el = &r->elements[r->nelements++];
    *el = (struct element){.count = (uint64_t)count, .first = r->nproperties};
    memcpy(el->name, words[1].at, (size_t)shown(words[1]));
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (word_is(words[1], kinds[i].name)) el->kind = kinds[i].kind;
    if (el->kind == VERTEX && r->has_vertices)
        return vg_fail(r->e, VG_EINPUT, "%s: the PLY header announces vertices twice", r->subject);
    r->has_vertices |= el->kind == VERTEX;
    return VG_OK;
}

static enum role role_named(enum kind kind, struct word name, bool list)
{
    static const struct {
        enum kind kind;
        bool list;
        const char *name;
        enum role role;
    } roles[] = {{VERTEX, false, "x", X},
                 {VERTEX, false, "y", Y},
                 {VERTEX, false, "z", Z},
                 {FACE, true, "vertex_indices", INDICES},
                 {FACE, true, "vertex_index", INDICES},
                 {STRIPS, true, "vertex_indices", INDICES},
                 {STRIPS, true, "vertex_index", INDICES},
                 {EDGE, false, "vertex1", FROM},
                 {EDGE, false, "vertex2", TO}};
    for (size_t i = 0; i < sizeof roles / sizeof *roles; i++)
        if (roles[i].kind == kind && roles[i].list == list && word_is(name, roles[i].name)) return roles[i].role;
    return PASSED_OVER;
}

static bool has_role(const struct reading *r, const struct element *el, enum role role)
{
    for (size_t i = 0; i < el->n; i++)
        if (r->properties[el->first + i].role == role) return true;
    return false;
}

static int read_property_line(struct reading *r, const struct word *words, size_t n)
{
    bool list = n == 5 && word_is(words[1], "list");
    if (!list && n != 3) return vg_fail(r->e, VG_EINPUT, "%s: the PLY header has an incomplete property", r->subject);
    if (r->nelements == 0)
        return vg_fail(r->e, VG_EINPUT, "%s: the PLY header has a property before any element", r->subject);
    struct word type = words[list ? 3 : 1], name = words[list ? 4 : 2];
    struct element *el = &r->elements[r->nelements - 1];
    struct property p = {list ? type_named(words[2]) : NO_TYPE, type_named(type), role_named(el->kind, name, list)};
    if (p.item == NO_TYPE || (list && p.count == NO_TYPE))
        return vg_fail(r->e, VG_EINPUT, "%s: PLY property '%.*s' has an unknown type", r->subject, shown(name),
                       name.at);
    if (p.role && has_role(r, el, p.role))
        return vg_fail(r->e, VG_EINPUT, "%s: PLY element '%s' has '%.*s' twice", r->subject, el->name, shown(name),
                       name.at);
    if (vgi_grow(&r->properties, &r->properties_cap, r->nproperties + 1, sizeof *r->properties, r->e) < 0)
        return VG_ENOMEM;
    r->properties[r->nproperties++] = p;
    el->n++;
    return VG_OK;
}

/* Check that the required properties exist, and compute the least number of bytes per element. */
static int finish_element(struct reading *r, struct element *el)
{
    el->fixed = !r->text;
    for (size_t i = 0; i < el->n; i++) {
        const struct property *p = &r->properties[el->first + i];
        el->least += r->text ? 2 : type_bytes[p->count ? p->count : p->item]; /* text: a digit and a blank */
        if (p->count) el->fixed = false;
    }
    if (el->kind == VERTEX && !(has_role(r, el, X) && has_role(r, el, Y) && has_role(r, el, Z)))
        return vg_fail(r->e, VG_EINPUT, "%s: its vertices have no x, y and z", r->subject);
    if (el->kind == VERTEX && el->count >= UINT32_MAX)
        return vg_fail(r->e, VG_EINPUT, "%s has too many vertices (the limit is 2^32 - 2)", r->subject);
    if ((el->kind == FACE || el->kind == STRIPS) && el->count && !has_role(r, el, INDICES))
        return vg_fail(r->e, VG_EINPUT, "%s: its %s have no list vertex_indices", r->subject,
                       el->kind == FACE ? "faces" : "triangle strips");
    if (el->kind == EDGE && !(has_role(r, el, FROM) && has_role(r, el, TO))) el->kind = OTHER;
    return VG_OK;
}

static int read_header(struct reading *r)
{
    struct word words[MOST_WORDS];
    size_t n = 0, strange = 0;
    bool formatted = false;
    const char *first = r->p;
    char line_end = r->end - first > 3 && first[3] == '\r' && !(r->end - first > 4 && first[4] == '\n') ? '\r' : '\n';
    if (!next_line(r, line_end, words, &n) || n != 1 || !word_is(words[0], "ply"))
        return vg_fail(r->e, VG_EINPUT, "%s does not start like PLY", r->subject);
    for (;;) {
        if (!next_line(r, line_end, words, &n))
            return vg_fail(r->e, VG_ETRUNC, "%s ends inside the PLY header", r->subject);
        int result = VG_OK;
        if (n == 0 || word_is(words[0], "comment") || word_is(words[0], "obj_info")) continue;
        if (word_is(words[0], "end_header")) break;
        if (word_is(words[0], "format")) result = read_encoding(r, words, n), formatted = true;
        else if (word_is(words[0], "element")) result = read_element_line(r, words, n);
        else if (word_is(words[0], "property")) result = read_property_line(r, words, n);
        else strange++; /* a comment broken in two, as old versions of Blender wrote their file name */
        if (result < 0) return result;
    }
    if (strange) vgi_note(&r->m->note, "left out %zu lines of the PLY header that mean nothing", strange);
    if (!formatted) return vg_fail(r->e, VG_EINPUT, "%s: the PLY header has no format line", r->subject);
    for (size_t i = 0; i < r->nelements; i++) {
        int result = finish_element(r, &r->elements[i]);
        if (result < 0) return result;
    }
    return VG_OK;
}

static bool is_space(char c)
{
    return c == ' ' || c == '\n' || c == '\r' || c == '\t';
}

/* The next word of a text body; false at the end of the file. */
static bool next_word(struct reading *r, struct word *w)
{
    const char *p = r->p;
    while (p < r->end && is_space(*p)) p++;
    w->at = p;
    while (p < r->end && !is_space(*p)) p++;
    w->n = (size_t)(p - w->at);
    r->p = p;
    return w->n > 0;
}

static int fail_word(struct reading *r, const struct element *el, uint64_t i, struct word w)
{
    if (w.n == 0)
        return vg_fail(r->e, VG_ETRUNC, "%s ends in %s %llu of %llu", r->subject, el->name, (unsigned long long)i,
                       (unsigned long long)el->count);
    return vg_fail(r->e, VG_EINPUT, "%s: '%.*s' in %s %llu is no number that fits there", r->subject, shown(w), w.at,
                   el->name, (unsigned long long)i);
}

static inline uint64_t load(const char *p, size_t bytes, bool swap)
{
    const unsigned char *u = (const unsigned char *)p;
    switch (bytes) {
    case 1: return u[0];
    case 2: return swap ? (uint64_t)u[0] << 8 | u[1] : (uint64_t)u[1] << 8 | u[0];
    case 4: return swap ? __builtin_bswap32(vgi_get32(u)) : vgi_get32(u);
    default: return swap ? __builtin_bswap64(vgi_get64(u)) : vgi_get64(u);
    }
}

static inline int64_t integer_at(const char *p, enum type t, bool swap)
{
    uint64_t x = load(p, type_bytes[t], swap);
    switch (t) {
    case I8: return (int8_t)x;
    case I16: return (int16_t)x;
    case I32: return (int32_t)x;
    default: return (int64_t)x;
    }
}

static inline double number_at(const char *p, enum type t, bool swap)
{
    if (t == F32) return vgi_as_float((uint32_t)load(p, 4, swap));
    if (t == F64) return vgi_as_double(load(p, 8, swap));
    return (double)integer_at(p, t, swap);
}

/* An integer written in another way: "3.0", or in a floating-point type. */
static int read_whole(struct reading *r, enum type t, const struct element *el, uint64_t i, int64_t *x)
{
    double value = NAN;
    struct word w = {0};
    if (!r->text && (size_t)(r->end - r->p) < type_bytes[t]) return fail_word(r, el, i, w);
    if (!r->text) {
        value = number_at(r->p, t, r->swap);
        r->p += type_bytes[t];
    } else if (!next_word(r, &w) || vgi_parse_double(w.at, w.at + w.n, &value) != w.at + w.n) {
        return fail_word(r, el, i, w);
    }
    if (!(fabs(value) <= 9e15) || value != floor(value))
        return vg_fail(r->e, VG_EINPUT, "%s: a number in %s %llu should be whole and is %g", r->subject, el->name,
                       (unsigned long long)i, value);
    *x = (int64_t)value;
    return VG_OK;
}

static inline int read_integer(struct reading *r, enum type t, const struct element *el, uint64_t i, int64_t *x)
{
    if (t >= F32) return read_whole(r, t, el, i, x);
    if (r->text) {
        const char *before = r->p;
        struct word w;
        if (next_word(r, &w) && vgi_parse_int(w.at, w.at + w.n, x) == w.at + w.n) return VG_OK;
        r->p = before;
        return read_whole(r, t, el, i, x);
    }
    if ((size_t)(r->end - r->p) < type_bytes[t]) return fail_word(r, el, i, (struct word){0});
    *x = integer_at(r->p, t, r->swap);
    r->p += type_bytes[t];
    return VG_OK;
}

static inline int read_number(struct reading *r, enum type t, const struct element *el, uint64_t i, double *x)
{
    if (r->text) {
        struct word w;
        if (!next_word(r, &w) || vgi_parse_double(w.at, w.at + w.n, x) != w.at + w.n) return fail_word(r, el, i, w);
        return VG_OK;
    }
    if ((size_t)(r->end - r->p) < type_bytes[t]) return fail_word(r, el, i, (struct word){0});
    *x = number_at(r->p, t, r->swap);
    r->p += type_bytes[t];
    return VG_OK;
}

/* Skip n numbers. n comes from the file, so it is compared with the remaining bytes. */
static int skip_numbers(struct reading *r, enum type t, uint64_t n, const struct element *el, uint64_t i)
{
    if (r->text) {
        struct word w;
        for (; n > 0; n--)
            if (!next_word(r, &w)) return fail_word(r, el, i, w);
        return VG_OK;
    }
    if (n > (uint64_t)(r->end - r->p) / type_bytes[t]) return fail_word(r, el, i, (struct word){0});
    r->p += n * type_bytes[t];
    return VG_OK;
}

static int list_length(struct reading *r, const struct property *p, const struct element *el, uint64_t i, uint64_t *n)
{
    int64_t length;
    int result = read_integer(r, p->count, el, i, &length);
    if (result < 0) return result;
    if (length < 0)
        return vg_fail(r->e, VG_EINPUT, "%s: %s %llu has a list of negative length", r->subject, el->name,
                       (unsigned long long)i);
    *n = (uint64_t)length;
    return VG_OK;
}

static int skip_property(struct reading *r, const struct property *p, const struct element *el, uint64_t i)
{
    uint64_t n = 1;
    int result = p->count ? list_length(r, p, el, i, &n) : VG_OK;
    return result == VG_OK ? skip_numbers(r, p->item, n, el, i) : result;
}

static int add_corner(struct reading *r, enum type t, const struct element *el, uint64_t i)
{
    int64_t v;
    int result = read_integer(r, t, el, i, &v);
    if (result < 0) return result;
    if (v < 0 || v >= UINT32_MAX - 1)
        return vg_fail(r->e, VG_EINPUT, "%s: %s %llu names vertex %lld", r->subject, el->name, (unsigned long long)i,
                       (long long)v);
    r->m->mesh.vert[r->corners++] = (uint32_t)v;
    return VG_OK;
}

static int grow_corners(struct reading *r, uint64_t more)
{
    if (more >= UINT32_MAX - r->corners)
        return vg_fail(r->e, VG_EINPUT, "%s has too many corners of faces (the limit is 2^32 - 2)", r->subject);
    return vgi_grow(&r->m->mesh.vert, &r->vert_cap, r->corners + (size_t)more, sizeof *r->m->mesh.vert, r->e);
}

static int end_face(struct reading *r)
{
    vg_mesh *m = &r->m->mesh;
    if (vgi_grow(&m->start, &r->start_cap, m->nf + 2, sizeof *m->start, r->e) < 0) return VG_ENOMEM;
    m->start[++m->nf] = (uint32_t)r->corners;
    return VG_OK;
}

static int read_indices(struct reading *r, const struct property *p, const struct element *el, uint64_t i)
{
    uint64_t n = 0;
    int result = list_length(r, p, el, i, &n);
    if (result < 0) return result;
    size_t left = (size_t)(r->end - r->p), bytes = r->text ? 2 : type_bytes[p->item];
    if (n > left / bytes + 1) return fail_word(r, el, i, (struct word){0});
    result = grow_corners(r, n);
    for (uint64_t k = 0; k < n && result == VG_OK; k++) result = add_corner(r, p->item, el, i);
    return result == VG_OK ? end_face(r) : result;
}

static int put_triangle(struct reading *r, uint32_t a, uint32_t b, uint32_t c)
{
    int result = grow_corners(r, 3);
    if (result < 0) return result;
    uint32_t *v = r->m->mesh.vert + r->corners;
    v[0] = a, v[1] = b, v[2] = c;
    r->corners += 3;
    return end_face(r);
}

static int strip_index(struct reading *r, const struct property *p, const struct element *el, uint64_t i, int64_t *v)
{
    int result = read_integer(r, p->item, el, i, v);
    if (result == VG_OK && (*v < -1 || *v >= UINT32_MAX - 1))
        result = vg_fail(r->e, VG_EINPUT, "%s: %s %llu names vertex %lld", r->subject, el->name, (unsigned long long)i,
                         (long long)*v);
    return result;
}

/* Each vertex after the first two makes a triangle with the two before it, with alternating orientation; -1 ends a
 * strip. A triangle that names a vertex twice only continues the strip. */
static int read_strips(struct reading *r, const struct property *p, const struct element *el, uint64_t i)
{
    uint64_t n = 0, length = 0;
    uint32_t a = 0, b = 0;
    int result = list_length(r, p, el, i, &n);
    for (uint64_t k = 0; k < n && result == VG_OK; k++, length++) {
        int64_t v = 0;
        if ((result = strip_index(r, p, el, i, &v)) < 0) break;
        if (v < 0) {
            length = UINT64_MAX;
            continue;
        }
        const uint32_t c = (uint32_t)v;
        if (length >= 2 && a != b && b != c && a != c)
            result = length % 2 ? put_triangle(r, b, a, c) : put_triangle(r, a, b, c);
        a = b, b = c;
    }
    return result;
}

static int read_face(struct reading *r, const struct element *el, uint64_t i)
{
    for (size_t k = 0; k < el->n; k++) {
        const struct property *p = &r->properties[el->first + k];
        int result = p->role != INDICES     ? skip_property(r, p, el, i)
                     : el->kind == STRIPS ? read_strips(r, p, el, i)
                                          : read_indices(r, p, el, i);
        if (result < 0) return result;
    }
    return VG_OK;
}

static int read_edge(struct reading *r, const struct element *el, uint64_t i)
{
    int result = grow_corners(r, 2);
    size_t first = r->corners;
    bool reversed = false;
    for (size_t k = 0; k < el->n && result == VG_OK; k++) {
        const struct property *p = &r->properties[el->first + k];
        if (p->role == TO && r->corners == first) reversed = true;
        result = p->role ? add_corner(r, p->item, el, i) : skip_property(r, p, el, i);
    }
    if (result < 0) return result;
    uint32_t *v = r->m->mesh.vert + first;
    if (reversed) {
        uint32_t from = v[1];
        v[1] = v[0], v[0] = from;
    }
    return end_face(r);
}

static int read_vertex(struct reading *r, const struct element *el, uint64_t i)
{
    double *to = r->m->vertices + 3 * i;
    for (size_t k = 0; k < el->n; k++) {
        const struct property *p = &r->properties[el->first + k];
        int result = p->role ? read_number(r, p->item, el, i, to + (p->role - X)) : skip_property(r, p, el, i);
        if (result < 0) return result;
    }
    if (isfinite(to[0]) && isfinite(to[1]) && isfinite(to[2])) return VG_OK;
    return vg_fail(r->e, VG_EINPUT, "%s: vertex %llu is not finite", r->subject, (unsigned long long)i);
}

static int read_other(struct reading *r, const struct element *el, uint64_t i)
{
    for (size_t k = 0; k < el->n; k++) {
        int result = skip_property(r, &r->properties[el->first + k], el, i);
        if (result < 0) return result;
    }
    return VG_OK;
}

/* Binary vertices of fixed size: their positions are known, so the loop needs no checks. */
static void read_fixed_vertices(struct reading *r, const struct element *el)
{
    size_t offset[3] = {0}, at = 0;
    enum type type[3] = {F32, F32, F32};
    for (size_t k = 0; k < el->n; k++) {
        const struct property *p = &r->properties[el->first + k];
        if (p->role) offset[p->role - X] = at, type[p->role - X] = p->item;
        at += type_bytes[p->item];
    }
    double *to = r->m->vertices;
    const char *p = r->p;
    for (uint64_t i = 0; i < el->count; i++, to += 3, p += at)
        for (int k = 0; k < 3; k++) to[k] = number_at(p + offset[k], type[k], r->swap);
    r->p = p;
}

static int read_vertices(struct reading *r, const struct element *el)
{
    size_t n = (size_t)el->count;
    r->m->vertices = vgi_array_raw(n, 3 * sizeof *r->m->vertices, r->e);
    if (!r->m->vertices) return VG_ENOMEM;
    r->m->mesh.nv = n;
    if (el->fixed) {
        read_fixed_vertices(r, el);
        if (vgi_finite(r->m->vertices, 3 * n)) return VG_OK;
        for (size_t i = 0; i < 3 * n; i++)
            if (!isfinite(r->m->vertices[i]))
                return vg_fail(r->e, VG_EINPUT, "%s: vertex %zu is not finite", r->subject, i / 3);
    }
    int result = VG_OK;
    for (uint64_t i = 0; i < el->count && result == VG_OK; i++) result = read_vertex(r, el, i);
    return result;
}

static int read_element(struct reading *r, const struct element *el)
{
    size_t left = (size_t)(r->end - r->p);
    /* no blank is needed after the last number */
    if (el->least && el->count > (left + (r->text ? 1 : 0)) / el->least)
        return vg_fail(r->e, VG_ETRUNC, "%s announces %llu of element '%s', but ends before", r->subject,
                       (unsigned long long)el->count, el->name);
    if (el->kind == VERTEX) return read_vertices(r, el);
    if (el->n == 0) return VG_OK;
    if (el->kind == OTHER && el->fixed) {
        r->p += el->count * el->least;
        return VG_OK;
    }
    int (*one)(struct reading *, const struct element *, uint64_t) = read_other;
    if (el->kind == FACE || el->kind == STRIPS) one = read_face;
    if (el->kind == EDGE) one = read_edge;
    int result = VG_OK;
    for (uint64_t i = 0; i < el->count && result == VG_OK; i++) result = one(r, el, i);
    return result;
}

static int read_body(struct reading *r)
{
    if (vgi_grow(&r->m->mesh.start, &r->start_cap, 1, sizeof *r->m->mesh.start, r->e) < 0) return VG_ENOMEM;
    r->m->mesh.start[0] = 0;
    if (r->text) r->p += vgi_mark_bytes(r->p, (size_t)(r->end - r->p)); /* where header and body were concatenated */
    for (size_t i = 0; i < r->nelements; i++) {
        int result = read_element(r, &r->elements[i]);
        if (result < 0) return result;
    }
    while (r->text && r->p < r->end && is_space(*r->p)) r->p++;
    if (r->p < r->end)
        vgi_note(&r->m->note, "left out %zu bytes behind the last element", (size_t)(r->end - r->p));
    if (r->m->mesh.nv == 0) return vg_fail(r->e, VG_EINPUT, "%s has no vertices", r->subject);
    return VG_OK;
}

static int read_ply(vg_model *m, const char *data, size_t n, const char *subject, vg_err *e)
{
    struct reading r = {.p = data, .end = data + n, .subject = subject, .e = e, .m = m};
    int result = read_header(&r);
    if (result == VG_OK) result = read_body(&r);
    free(r.elements);
    free(r.properties);
    return result;
}

static bool sniff_ply(const unsigned char *data, size_t n)
{
    return n >= 4 && !memcmp(data, "ply", 3) && (data[3] == '\n' || data[3] == '\r');
}

enum { KEEPS = VGI_KEEPS_FACES | VGI_KEEPS_POLYGONS | VGI_KEEPS_ORDER | VGI_KEEPS_DOUBLES };

const vgi_format vgi_format_ply = {"ply", ".ply", sniff_ply, read_ply, vgi_ply_write_little, vgi_ply_rest_little,
                                   KEEPS};
const vgi_format vgi_format_ply_ascii = {"ply-ascii", ".ply", sniff_ply, read_ply, vgi_ply_write_text,
                                         vgi_ply_rest_text, KEEPS};
const vgi_format vgi_format_ply_be = {"ply-be", ".ply", sniff_ply, read_ply, vgi_ply_write_big, vgi_ply_rest_big,
                                      KEEPS};
