/* ply.c: reads PLY polygon files, text and binary in both byte orders: vertices, their colours and texture coordinates,
 * faces, triangle strips, edges. All other elements and properties (normals, user data) are skipped. Writing is in
 * ply_write.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"
#include "model/colour.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_WORDS = 6, SHOWN = 40 }; /* words per header line; bytes of the input shown in a message */

enum type { NO_TYPE, I8, U8, I16, U16, I32, U32, F32, F64 };
static const unsigned char type_bytes[] = {0, 1, 1, 2, 2, 4, 4, 4, 8};

/* The properties that are read. X, Y, Z, and RED, GREEN, BLUE, ALPHA, and U, V in this order. The last two are only named
 * in a note. */
enum role { PASSED_OVER, X, Y, Z, RED, GREEN, BLUE, ALPHA, U, V, INDICES, FROM, TO, FACE_COLOUR, FACE_TEXTURE };
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
    size_t bad_colours; /* number of channels out of their range */
};

struct word {
    const char *at;
    size_t n;
};

static bool word_is(struct word w, const char *text)
{
    return strlen(text) == w.n && !memcmp(w.at, text, w.n);
}

static int shown_length(struct word w)
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
static bool next_line(struct reading *in, char line_end, struct word words[MOST_WORDS], size_t *n)
{
    const char *stop = memchr(in->p, line_end, (size_t)(in->end - in->p));
    if (!stop) return false;
    const char *p = in->p;
    in->p = stop + 1;
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

static int read_encoding(struct reading *in, const struct word *words, size_t n)
{
    if (n != 3 || !word_is(words[2], "1.0"))
        return vg_fail(in->e, VG_EINPUT, "%s: the PLY header has no format and version 1.0", in->subject);
    in->text = word_is(words[1], "ascii");
    in->swap = word_is(words[1], "binary_big_endian");
    if (in->text || in->swap || word_is(words[1], "binary_little_endian")) return VG_OK;
    return vg_fail(in->e, VG_EINPUT, "%s: unknown PLY format '%.*s'", in->subject, shown_length(words[1]), words[1].at);
}

static int read_element_line(struct reading *in, const struct word *words, size_t n)
{
    static const struct {
        const char *name;
        enum kind kind;
    } kinds[] = {{"vertex", VERTEX}, {"face", FACE}, {"edge", EDGE}, {"tristrips", STRIPS}};
    int64_t count = -1;
    const char *stop = n == 3 ? vgi_parse_int(words[2].at, words[2].at + words[2].n, &count) : NULL;
    if (n != 3 || stop != words[2].at + words[2].n || count < 0)
        return vg_fail(in->e, VG_EINPUT, "%s: the PLY header has an element without name and count", in->subject);
    if (vgi_grow(&in->elements, &in->elements_cap, in->nelements + 1, sizeof *in->elements, in->e) < 0) return VG_ENOMEM;
    struct element *el = &in->elements[in->nelements++];
    *el = (struct element){.count = (uint64_t)count, .first = in->nproperties};
    memcpy(el->name, words[1].at, (size_t)shown_length(words[1]));
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (word_is(words[1], kinds[i].name)) el->kind = kinds[i].kind;
    if (el->kind == VERTEX && in->has_vertices)
        return vg_fail(in->e, VG_EINPUT, "%s: the PLY header announces vertices twice", in->subject);
    in->has_vertices |= el->kind == VERTEX;
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
                 {VERTEX, false, "red", RED},
                 {VERTEX, false, "green", GREEN},
                 {VERTEX, false, "blue", BLUE},
                 {VERTEX, false, "alpha", ALPHA},
                 {VERTEX, false, "diffuse_red", RED},
                 {VERTEX, false, "diffuse_green", GREEN},
                 {VERTEX, false, "diffuse_blue", BLUE},
                 {VERTEX, false, "s", U},
                 {VERTEX, false, "t", V},
                 {VERTEX, false, "u", U},
                 {VERTEX, false, "v", V},
                 {VERTEX, false, "texture_u", U},
                 {VERTEX, false, "texture_v", V},
                 {FACE, false, "red", FACE_COLOUR},
                 {FACE, true, "texcoord", FACE_TEXTURE},
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

static bool has_role(const struct reading *in, const struct element *el, enum role role)
{
    for (size_t i = 0; i < el->n; i++)
        if (in->properties[el->first + i].role == role) return true;
    return false;
}

static int read_property_line(struct reading *in, const struct word *words, size_t n)
{
    bool list = n == 5 && word_is(words[1], "list");
    if (!list && n != 3) return vg_fail(in->e, VG_EINPUT, "%s: the PLY header has an incomplete property", in->subject);
    if (in->nelements == 0)
        return vg_fail(in->e, VG_EINPUT, "%s: the PLY header has a property before any element", in->subject);
    struct word type = words[list ? 3 : 1], name = words[list ? 4 : 2];
    struct element *el = &in->elements[in->nelements - 1];
    struct property p = {list ? type_named(words[2]) : NO_TYPE, type_named(type), role_named(el->kind, name, list)};
    if (p.item == NO_TYPE || (list && p.count == NO_TYPE))
        return vg_fail(in->e, VG_EINPUT, "%s: PLY property '%.*s' has an unknown type", in->subject, shown_length(name),
                       name.at);
    if (((p.role >= RED && p.role <= V) || p.role >= FACE_COLOUR) && has_role(in, el, p.role)) p.role = PASSED_OVER;
    if (p.role && has_role(in, el, p.role))
        return vg_fail(in->e, VG_EINPUT, "%s: PLY element '%s' has '%.*s' twice", in->subject, el->name, shown_length(name),
                       name.at);
    if (vgi_grow(&in->properties, &in->properties_cap, in->nproperties + 1, sizeof *in->properties, in->e) < 0)
        return VG_ENOMEM;
    in->properties[in->nproperties++] = p;
    el->n++;
    return VG_OK;
}

/* Check that the required properties exist, and compute the least number of bytes per element. */
static int finish_element(struct reading *in, struct element *el)
{
    el->fixed = !in->text;
    for (size_t i = 0; i < el->n; i++) {
        const struct property *p = &in->properties[el->first + i];
        el->least += in->text ? 2 : type_bytes[p->count ? p->count : p->item]; /* text: a digit and a blank */
        if (p->count) el->fixed = false;
    }
    if (el->kind == VERTEX && !(has_role(in, el, X) && has_role(in, el, Y) && has_role(in, el, Z)))
        return vg_fail(in->e, VG_EINPUT, "%s: its vertices have no x, y and z", in->subject);
    if (el->kind == VERTEX && el->count >= UINT32_MAX)
        return vg_fail(in->e, VG_EINPUT, "%s has too many vertices (the limit is 2^32 - 2)", in->subject);
    if ((el->kind == FACE || el->kind == STRIPS) && el->count && !has_role(in, el, INDICES))
        return vg_fail(in->e, VG_EINPUT, "%s: its %s have no list vertex_indices", in->subject,
                       el->kind == FACE ? "faces" : "triangle strips");
    if (el->kind == FACE && has_role(in, el, FACE_COLOUR)) vgi_note(&in->m->note, "left out the colours of its faces");
    if (el->kind == FACE && has_role(in, el, FACE_TEXTURE))
        vgi_note(&in->m->note, "left out the texture coordinates of its faces");
    if (el->kind == EDGE && !(has_role(in, el, FROM) && has_role(in, el, TO))) el->kind = OTHER;
    return VG_OK;
}

static int read_header(struct reading *in)
{
    struct word words[MOST_WORDS];
    size_t n = 0, strange = 0;
    bool formatted = false;
    const char *first = in->p;
    char line_end = in->end - first > 3 && first[3] == '\r' && !(in->end - first > 4 && first[4] == '\n') ? '\r' : '\n';
    if (!next_line(in, line_end, words, &n) || n != 1 || !word_is(words[0], "ply"))
        return vg_fail(in->e, VG_EINPUT, "%s does not start like PLY", in->subject);
    for (;;) {
        if (!next_line(in, line_end, words, &n))
            return vg_fail(in->e, VG_ETRUNC, "%s ends inside the PLY header", in->subject);
        int r = VG_OK;
        if (n == 0 || word_is(words[0], "comment") || word_is(words[0], "obj_info")) continue;
        if (word_is(words[0], "end_header")) break;
        if (word_is(words[0], "format")) r = read_encoding(in, words, n), formatted = true;
        else if (word_is(words[0], "element")) r = read_element_line(in, words, n);
        else if (word_is(words[0], "property")) r = read_property_line(in, words, n);
        else strange++; /* a comment broken in two, as old versions of Blender wrote their file name */
        if (r < 0) return r;
    }
    if (strange) vgi_note(&in->m->note, "left out %zu meaningless lines of the PLY header", strange);
    if (!formatted) return vg_fail(in->e, VG_EINPUT, "%s: the PLY header has no format line", in->subject);
    for (size_t i = 0; i < in->nelements; i++) {
        int r = finish_element(in, &in->elements[i]);
        if (r < 0) return r;
    }
    return VG_OK;
}

static bool is_space(char c)
{
    return c == ' ' || c == '\n' || c == '\r' || c == '\t';
}

/* The next word of a text body; false at the end of the file. */
static bool next_word(struct reading *in, struct word *w)
{
    const char *p = in->p;
    while (p < in->end && is_space(*p)) p++;
    w->at = p;
    while (p < in->end && !is_space(*p)) p++;
    w->n = (size_t)(p - w->at);
    in->p = p;
    return w->n > 0;
}

static int fail_word(struct reading *in, const struct element *el, uint64_t i, struct word w)
{
    if (w.n == 0)
        return vg_fail(in->e, VG_ETRUNC, "%s ends in %s %llu of %llu", in->subject, el->name, (unsigned long long)i,
                       (unsigned long long)el->count);
    return vg_fail(in->e, VG_EINPUT, "%s: '%.*s' in %s %llu is not a valid number", in->subject, shown_length(w), w.at,
                   el->name, (unsigned long long)i);
}

static inline uint64_t load_bits(const char *p, size_t bytes, bool swap)
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
    uint64_t x = load_bits(p, type_bytes[t], swap);
    switch (t) {
    case I8: return (int8_t)x;
    case I16: return (int16_t)x;
    case I32: return (int32_t)x;
    default: return (int64_t)x;
    }
}

static inline double number_at(const char *p, enum type t, bool swap)
{
    if (t == F32) return vgi_as_float((uint32_t)load_bits(p, 4, swap));
    if (t == F64) return vgi_as_double(load_bits(p, 8, swap));
    return (double)integer_at(p, t, swap);
}

/* An integer written in another way: "3.0", or in a floating-point type. */
static int read_whole(struct reading *in, enum type t, const struct element *el, uint64_t i, int64_t *x)
{
    double value = NAN;
    struct word w = {0};
    if (!in->text && (size_t)(in->end - in->p) < type_bytes[t]) return fail_word(in, el, i, w);
    if (!in->text) {
        value = number_at(in->p, t, in->swap);
        in->p += type_bytes[t];
    } else if (!next_word(in, &w) || vgi_parse_double(w.at, w.at + w.n, &value) != w.at + w.n) {
        return fail_word(in, el, i, w);
    }
    if (!(fabs(value) <= 9e15) || value != floor(value))
        return vg_fail(in->e, VG_EINPUT, "%s: a number in %s %llu should be an integer but is %g", in->subject, el->name,
                       (unsigned long long)i, value);
    *x = (int64_t)value;
    return VG_OK;
}

static inline int read_integer(struct reading *in, enum type t, const struct element *el, uint64_t i, int64_t *x)
{
    if (t >= F32) return read_whole(in, t, el, i, x);
    if (in->text) {
        const char *before = in->p;
        struct word w;
        if (next_word(in, &w) && vgi_parse_int(w.at, w.at + w.n, x) == w.at + w.n) return VG_OK;
        in->p = before;
        return read_whole(in, t, el, i, x);
    }
    if ((size_t)(in->end - in->p) < type_bytes[t]) return fail_word(in, el, i, (struct word){0});
    *x = integer_at(in->p, t, in->swap);
    in->p += type_bytes[t];
    return VG_OK;
}

static inline int read_number(struct reading *in, enum type t, const struct element *el, uint64_t i, double *x)
{
    if (in->text) {
        struct word w;
        if (!next_word(in, &w) || vgi_parse_double(w.at, w.at + w.n, x) != w.at + w.n) return fail_word(in, el, i, w);
        return VG_OK;
    }
    if ((size_t)(in->end - in->p) < type_bytes[t]) return fail_word(in, el, i, (struct word){0});
    *x = number_at(in->p, t, in->swap);
    in->p += type_bytes[t];
    return VG_OK;
}

/* Skip n numbers. n comes from the file, so it is compared with the remaining bytes. */
static int skip_numbers(struct reading *in, enum type t, uint64_t n, const struct element *el, uint64_t i)
{
    if (in->text) {
        struct word w;
        for (; n > 0; n--)
            if (!next_word(in, &w)) return fail_word(in, el, i, w);
        return VG_OK;
    }
    if (n > (uint64_t)(in->end - in->p) / type_bytes[t]) return fail_word(in, el, i, (struct word){0});
    in->p += n * type_bytes[t];
    return VG_OK;
}

static int list_length(struct reading *in, const struct property *p, const struct element *el, uint64_t i, uint64_t *n)
{
    int64_t length;
    int r = read_integer(in, p->count, el, i, &length);
    if (r < 0) return r;
    if (length < 0)
        return vg_fail(in->e, VG_EINPUT, "%s: %s %llu has a list of negative length", in->subject, el->name,
                       (unsigned long long)i);
    *n = (uint64_t)length;
    return VG_OK;
}

static int skip_property(struct reading *in, const struct property *p, const struct element *el, uint64_t i)
{
    uint64_t n = 1;
    int r = p->count ? list_length(in, p, el, i, &n) : VG_OK;
    return r == VG_OK ? skip_numbers(in, p->item, n, el, i) : r;
}

static int add_corner(struct reading *in, enum type t, const struct element *el, uint64_t i)
{
    int64_t v;
    int r = read_integer(in, t, el, i, &v);
    if (r < 0) return r;
    if (v < 0 || v >= UINT32_MAX - 1)
        return vg_fail(in->e, VG_EINPUT, "%s: %s %llu names vertex %lld", in->subject, el->name, (unsigned long long)i,
                       (long long)v);
    in->m->mesh.vert[in->corners++] = (uint32_t)v;
    return VG_OK;
}

static int grow_corners(struct reading *in, uint64_t more)
{
    if (more >= UINT32_MAX - in->corners)
        return vg_fail(in->e, VG_EINPUT, "%s has too many corners of faces (the limit is 2^32 - 2)", in->subject);
    return vgi_grow(&in->m->mesh.vert, &in->vert_cap, in->corners + (size_t)more, sizeof *in->m->mesh.vert, in->e);
}

static int end_face(struct reading *in)
{
    vg_mesh *m = &in->m->mesh;
    if (vgi_grow(&m->start, &in->start_cap, m->nf + 2, sizeof *m->start, in->e) < 0) return VG_ENOMEM;
    m->start[++m->nf] = (uint32_t)in->corners;
    return VG_OK;
}

static int read_indices(struct reading *in, const struct property *p, const struct element *el, uint64_t i)
{
    uint64_t n = 0;
    int r = list_length(in, p, el, i, &n);
    if (r < 0) return r;
    size_t left = (size_t)(in->end - in->p), bytes = in->text ? 2 : type_bytes[p->item];
    if (n > left / bytes + 1) return fail_word(in, el, i, (struct word){0});
    r = grow_corners(in, n);
    for (uint64_t k = 0; k < n && r == VG_OK; k++) r = add_corner(in, p->item, el, i);
    return r == VG_OK ? end_face(in) : r;
}

static int put_triangle(struct reading *in, uint32_t a, uint32_t b, uint32_t c)
{
    int r = grow_corners(in, 3);
    if (r < 0) return r;
    uint32_t *v = in->m->mesh.vert + in->corners;
    v[0] = a, v[1] = b, v[2] = c;
    in->corners += 3;
    return end_face(in);
}

static int strip_index(struct reading *in, const struct property *p, const struct element *el, uint64_t i, int64_t *v)
{
    int r = read_integer(in, p->item, el, i, v);
    if (r == VG_OK && (*v < -1 || *v >= UINT32_MAX - 1))
        r = vg_fail(in->e, VG_EINPUT, "%s: %s %llu names vertex %lld", in->subject, el->name, (unsigned long long)i,
                         (long long)*v);
    return r;
}

/* Each vertex after the first two makes a triangle with the two before it, with alternating orientation; -1 ends a
 * strip. A triangle that names a vertex twice only continues the strip. */
static int read_strips(struct reading *in, const struct property *p, const struct element *el, uint64_t i)
{
    uint64_t n = 0, length = 0;
    uint32_t a = 0, b = 0;
    int r = list_length(in, p, el, i, &n);
    for (uint64_t k = 0; k < n && r == VG_OK; k++, length++) {
        int64_t v = 0;
        if ((r = strip_index(in, p, el, i, &v)) < 0) break;
        if (v < 0) {
            length = UINT64_MAX;
            continue;
        }
        const uint32_t c = (uint32_t)v;
        if (length >= 2 && a != b && b != c && a != c)
            r = length % 2 ? put_triangle(in, b, a, c) : put_triangle(in, a, b, c);
        a = b, b = c;
    }
    return r;
}

static int read_face(struct reading *in, const struct element *el, uint64_t i)
{
    for (size_t k = 0; k < el->n; k++) {
        const struct property *p = &in->properties[el->first + k];
        int r = p->role != INDICES     ? skip_property(in, p, el, i)
                     : el->kind == STRIPS ? read_strips(in, p, el, i)
                                          : read_indices(in, p, el, i);
        if (r < 0) return r;
    }
    return VG_OK;
}

static int read_edge(struct reading *in, const struct element *el, uint64_t i)
{
    int r = grow_corners(in, 2);
    size_t first = in->corners;
    bool reversed = false;
    for (size_t k = 0; k < el->n && r == VG_OK; k++) {
        const struct property *p = &in->properties[el->first + k];
        if (p->role == TO && in->corners == first) reversed = true;
        r = p->role ? add_corner(in, p->item, el, i) : skip_property(in, p, el, i);
    }
    if (r < 0) return r;
    uint32_t *v = in->m->mesh.vert + first;
    if (reversed) {
        uint32_t from = v[1];
        v[1] = v[0], v[0] = from;
    }
    return end_face(in);
}

/* A texture coordinate of vertex i; one that is not finite marks it by a NaN. */
static void put_texture(struct reading *in, const struct property *p, uint64_t i, double x)
{
    in->m->attributes.tex[2 * i + (p->role == V)] = isfinite(x) ? x : NAN;
}

/* A channel of a colour as a byte: integers of 8 and 16 bits span their type, those of 32 bits 0 to 255, binary32 and
 * binary64 0 to 1. Beyond that range the nearest end is taken; what is no number becomes black, or opaque. */
static void put_colour(struct reading *in, const struct property *p, uint64_t i, double x)
{
    uint8_t *to = in->m->attributes.colours + 4 * i + (p->role - RED);
    if (p->item >= F32) x *= 255;
    else if (p->item == I16 || p->item == U16) x /= 257;
    if (!isnan(x)) *to = vgi_byte_of(x / 255);
    in->bad_colours += !(x >= 0 && x < 255.5);
}

/* Whether the file has what belongs to a colour or texture coordinate that is not X, Y or Z. */
static bool is_wanted(const struct reading *in, enum role role)
{
    if (role >= RED && role <= ALPHA) return in->m->attributes.ncolours > 0;
    return (role == U || role == V) && in->m->attributes.ntex > 0;
}

static void put_look(struct reading *in, const struct property *p, uint64_t i, double x)
{
    if (p->role <= ALPHA) put_colour(in, p, i, x);
    else put_texture(in, p, i, x);
}

/* A word that is no number only loses itself. */
static int read_look(struct reading *in, const struct property *p, const struct element *el, uint64_t i)
{
    double x = NAN;
    struct word w;
    if (!in->text) {
        int r = read_number(in, p->item, el, i, &x);
        if (r < 0) return r;
    } else if (!next_word(in, &w)) {
        return fail_word(in, el, i, (struct word){0});
    } else if (vgi_parse_double(w.at, w.at + w.n, &x) != w.at + w.n) {
        x = NAN;
    }
    put_look(in, p, i, x);
    return VG_OK;
}

static int read_vertex(struct reading *in, const struct element *el, uint64_t i)
{
    double *to = in->m->vertices + 3 * i;
    for (size_t k = 0; k < el->n; k++) {
        const struct property *p = &in->properties[el->first + k];
        int r = p->role >= X && p->role <= Z ? read_number(in, p->item, el, i, to + (p->role - X))
                : is_wanted(in, p->role)     ? read_look(in, p, el, i)
                                             : skip_property(in, p, el, i);
        if (r < 0) return r;
    }
    if (isfinite(to[0]) && isfinite(to[1]) && isfinite(to[2])) return VG_OK;
    return vg_fail(in->e, VG_EINPUT, "%s: vertex %llu is not finite", in->subject, (unsigned long long)i);
}

static int read_other(struct reading *in, const struct element *el, uint64_t i)
{
    for (size_t k = 0; k < el->n; k++) {
        int r = skip_property(in, &in->properties[el->first + k], el, i);
        if (r < 0) return r;
    }
    return VG_OK;
}

static void read_fixed_looks(struct reading *in, const struct element *el, const struct property *p, size_t at)
{
    for (uint64_t i = 0; i < el->count; i++) put_look(in, p, i, number_at(in->p + i * el->least + at, p->item, in->swap));
}

/* Binary vertices of fixed size: their positions are known, so the loop needs no checks. */
static void read_fixed_vertices(struct reading *in, const struct element *el)
{
    size_t offset[3] = {0}, at = 0;
    enum type type[3] = {F32, F32, F32};
    for (size_t k = 0; k < el->n; k++) {
        const struct property *p = &in->properties[el->first + k];
        if (p->role >= X && p->role <= Z) offset[p->role - X] = at, type[p->role - X] = p->item;
        if (is_wanted(in, p->role)) read_fixed_looks(in, el, p, at);
        at += type_bytes[p->item];
    }
    double *to = in->m->vertices;
    const char *p = in->p;
    for (uint64_t i = 0; i < el->count; i++, to += 3, p += at)
        for (int k = 0; k < 3; k++) to[k] = number_at(p + offset[k], type[k], in->swap);
    in->p = p;
}

/* Make room for colours and texture coordinates, if they are complete. */
static int begin_looks(struct reading *in, const struct element *el)
{
    const int channels = has_role(in, el, RED) + has_role(in, el, GREEN) + has_role(in, el, BLUE);
    if (channels > 0 && channels < 3) vgi_note(&in->m->note, "left out colours of vertices without red, green and blue");
    if (channels == 3 && vgi_begin_colours(in->m, in->e) < 0) return VG_ENOMEM;
    return has_role(in, el, U) && has_role(in, el, V) ? vgi_begin_texture(in->m, in->e) : VG_OK;
}

static int read_vertices(struct reading *in, const struct element *el)
{
    size_t n = (size_t)el->count;
    in->m->vertices = vgi_array_raw(n, 3 * sizeof *in->m->vertices, in->e);
    if (!in->m->vertices) return VG_ENOMEM;
    in->m->mesh.nv = n;
    if (begin_looks(in, el) < 0) return VG_ENOMEM;
    if (el->fixed) {
        read_fixed_vertices(in, el);
        if (vgi_finite(in->m->vertices, 3 * n)) return VG_OK;
        for (size_t i = 0; i < 3 * n; i++)
            if (!isfinite(in->m->vertices[i]))
                return vg_fail(in->e, VG_EINPUT, "%s: vertex %zu is not finite", in->subject, i / 3);
    }
    int r = VG_OK;
    for (uint64_t i = 0; i < el->count && r == VG_OK; i++) r = read_vertex(in, el, i);
    return r;
}

static int read_element(struct reading *in, const struct element *el)
{
    size_t left = (size_t)(in->end - in->p);
    /* no blank is needed after the last number */
    if (el->least && el->count > (left + (in->text ? 1 : 0)) / el->least)
        return vg_fail(in->e, VG_ETRUNC, "%s announces %llu of element '%s', but ends before", in->subject,
                       (unsigned long long)el->count, el->name);
    if (el->kind == VERTEX) return read_vertices(in, el);
    if (el->n == 0) return VG_OK;
    if (el->kind == OTHER && el->fixed) {
        in->p += el->count * el->least;
        return VG_OK;
    }
    int (*one)(struct reading *, const struct element *, uint64_t) = read_other;
    if (el->kind == FACE || el->kind == STRIPS) one = read_face;
    if (el->kind == EDGE) one = read_edge;
    int r = VG_OK;
    for (uint64_t i = 0; i < el->count && r == VG_OK; i++) r = one(in, el, i);
    return r;
}

static int read_body(struct reading *in)
{
    if (vgi_grow(&in->m->mesh.start, &in->start_cap, 1, sizeof *in->m->mesh.start, in->e) < 0) return VG_ENOMEM;
    in->m->mesh.start[0] = 0;
    if (in->text) in->p += vgi_mark_bytes(in->p, (size_t)(in->end - in->p)); /* where header and body were concatenated */
    for (size_t i = 0; i < in->nelements; i++) {
        int r = read_element(in, &in->elements[i]);
        if (r < 0) return r;
    }
    while (in->text && in->p < in->end && is_space(*in->p)) in->p++;
    if (in->p < in->end)
        vgi_note(&in->m->note, "left out %zu bytes after the last element", (size_t)(in->end - in->p));
    if (in->bad_colours)
        vgi_note(&in->m->note, "%zu channels of colours are out of their range", in->bad_colours);
    if (in->m->mesh.nv == 0) return vg_fail(in->e, VG_EINPUT, "%s has no vertices", in->subject);
    return vgi_end_texture(in->m, in->corners, in->e);
}

static int read_ply(vg_model *m, const char *data, size_t n, const char *subject, vg_err *e)
{
    struct reading in = {.p = data, .end = data + n, .subject = subject, .e = e, .m = m};
    int r = read_header(&in);
    if (r == VG_OK) r = read_body(&in);
    free(in.elements);
    free(in.properties);
    return r;
}

static bool sniff_ply(const unsigned char *data, size_t n)
{
    return n >= 4 && !memcmp(data, "ply", 3) && (data[3] == '\n' || data[3] == '\r');
}

enum { KEEPS = VGI_KEEPS_FACES | VGI_KEEPS_POLYGONS | VGI_KEEPS_ORDER | VGI_KEEPS_DOUBLES | VGI_KEEPS_COLOURS };

const vgi_format vgi_format_ply = {"ply", ".ply", sniff_ply, read_ply, vgi_ply_write_little, vgi_ply_rest_little,
                                   KEEPS};
const vgi_format vgi_format_ply_ascii = {"ply-ascii", ".ply", sniff_ply, read_ply, vgi_ply_write_text,
                                         vgi_ply_rest_text, KEEPS};
const vgi_format vgi_format_ply_be = {"ply-be", ".ply", sniff_ply, read_ply, vgi_ply_write_big, vgi_ply_rest_big,
                                      KEEPS};
