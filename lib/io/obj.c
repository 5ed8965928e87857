/* obj.c: reads Wavefront OBJ: vertices and their colours, texture coordinates, faces, lines, and the names of groups and materials.
 * Normals are read only for obj_normals.c (they change with the pose); points and free-form surfaces are ignored; material
 * files are read in mtl.c. Writing is in obj_write.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/smoothing.h"
#include "model/colour.h"

#include <math.h>
#include <stdlib.h>

enum { SHOWN = 40 }; /* bytes of the input shown in a message */

/* A file being read. Arrays are those of the model; these are their capacities. */
struct reading {
    const char *data, *end;
    char line_end; /* '\n', or '\r' in a file that has no '\n' */
    const char *subject;
    vg_err *e;
    vg_model *m;
    vgi_obj_normals *normals; /* NULL: normals are skipped */
    size_t vertices_cap, start_cap, vert_cap, tex_cap, labels_cap, colours_cap;
    size_t corners;
    bool textured;      /* corner_tex exists, with capacity vert_cap */
    size_t sought_face; /* find_face: stop after this face ... */
    const char *found;  /* ... and store the position of its statement */
    size_t bad_tex;     /* number of malformed texture coordinates */
    size_t bad_colours; /* number of malformed colours of vertices */
    size_t others;      /* number of points, curves and surfaces, which are left out */
};

static size_t line_of(const struct reading *in, const char *p)
{
    size_t n = 1;
    for (const char *q = in->data; q < p && (q = memchr(q, in->line_end, (size_t)(p - q))); q++) n++;
    return n;
}

static bool is_line_end(const struct reading *in, const char *p)
{
    return p == in->end || *p == in->line_end;
}

/* A backslash before a line end joins two lines: the first byte of the second line, or NULL. */
static const char *continuation(const struct reading *in, const char *p)
{
    if (*p++ != '\\') return NULL;
    if (p < in->end && *p == '\r' && in->line_end != '\r') p++;
    if (p == in->end) return p;
    return *p == in->line_end ? p + 1 : NULL;
}

static bool is_odd_blank(const struct reading *in, char c)
{
    return c == ' ' || c == '\t' || (c == '\r' && in->line_end != '\r');
}

/* Between numbers a backslash followed by blanks, which editors leave there, also joins lines. A name may end like
 * that. */
static const char *loose_continuation(const struct reading *in, const char *p)
{
    if (*p++ != '\\') return NULL;
    while (p < in->end && is_odd_blank(in, *p)) p++;
    return p == in->end ? p : *p == in->line_end ? p + 1 : NULL;
}

static const char *skip_odd_blanks(const struct reading *in, const char *p)
{
    while (p < in->end) {
        const char *next;
        if (is_odd_blank(in, *p)) p++;
        else if (*p == '\\' && (next = loose_continuation(in, p))) p = next;
        else break;
    }
    return p;
}

/* Skip blanks and joined lines. Nearly all files have one blank before something visible. */
static inline const char *skip_blanks(const struct reading *in, const char *p)
{
    if (p < in->end && *p == ' ') p++;
    if (p < in->end && (unsigned char)*p > ' ' && *p != '\\') return p;
    return skip_odd_blanks(in, p);
}

static inline bool at_end(const struct reading *in, const char *p)
{
    return is_line_end(in, p) || *p == '#';
}

/* The next line that does not continue the statement. */
static const char *skip_statement(const struct reading *in, const char *p)
{
    while (p < in->end) {
        const char *q = memchr(p, in->line_end, (size_t)(in->end - p));
        if (!q) return in->end;
        const char *last = q;
        if (last > p && last[-1] == '\r') last--;
        p = q + 1;
        if (last == in->data || last[-1] != '\\') break;
    }
    return p;
}

static const char *skip_comment(const struct reading *in, const char *p)
{
    const char *q = memchr(p, in->line_end, (size_t)(in->end - p));
    return q ? q + 1 : in->end;
}

/* Whether a word ends before p. */
static inline bool ends_word(const struct reading *in, const char *p)
{
    return is_line_end(in, p) || *p == ' ' || *p == '\t' || *p == '\r' || *p == '\\';
}

/* Skip words up to the end of the statement or a comment, and count them. */
static const char *count_words(const struct reading *in, const char *p, size_t *n)
{
    for (p = skip_blanks(in, p), *n = 0; !at_end(in, p); p = skip_blanks(in, p), ++*n)
        do p++;
        while (!ends_word(in, p));
    return p;
}

static const char *skip_words(const struct reading *in, const char *p)
{
    size_t n;
    return count_words(in, p, &n);
}

/* Whether the word at p equals `word`. */
static bool is_word(const struct reading *in, const char *p, const char *word)
{
    size_t n = strlen(word);
    return (size_t)(in->end - p) >= n && !memcmp(p, word, n) && ends_word(in, p + n);
}

/* VG_EINPUT: unexpected text at p, which is quoted from the file. */
static int fail_at(const struct reading *in, const char *p, const char *expected)
{
    size_t n = 0;
    while (n < SHOWN && !is_line_end(in, p + n) && p[n] != ' ' && p[n] != '\t' && p[n] != '\r') n++;
    if (n == 0) return vg_fail(in->e, VG_EINPUT, "%s line %zu: %s expected", in->subject, line_of(in, p), expected);
    return vg_fail(in->e, VG_EINPUT, "%s line %zu: %s expected, not '%.*s'", in->subject, line_of(in, p), expected,
                   (int)n, p);
}

/* VG_EINPUT: the word at p begins like a number but is not one, or not finite; Windows writes NaN as "-1.#IND". */
static int fail_number(const struct reading *in, const char *p)
{
    size_t n = 0;
    while (n < SHOWN && !ends_word(in, p + n)) n++;
    return vg_fail(in->e, VG_EINPUT, "%s line %zu: '%.*s' is not a finite number", in->subject, line_of(in, p), (int)n, p);
}

/* One coordinate of a vertex at p, after blanks; returns the address after it, or NULL. */
static inline const char *read_coordinate(struct reading *in, const char *p, double *x)
{
    const char *word = skip_blanks(in, p);
    const char *next = word > p && !is_line_end(in, word) ? vgi_parse_double(word, in->end, x) : NULL;
    if (next && isfinite(*x) && ends_word(in, next)) return next;
    if (next) fail_number(in, word);
    else fail_at(in, word, "a number");
    return NULL;
}

/* Three or four numbers from 0 to 1 at p, and nothing else, into rgba. */
static bool take_colour(const struct reading *in, const char *p, double rgba[4])
{
    for (int n = 0;; n++) {
        const char *word = skip_blanks(in, p);
        if (at_end(in, word)) return n >= 3;
        const char *next = word > p && n < 4 ? vgi_parse_double(word, in->end, &rgba[n]) : NULL;
        if (!next || !ends_word(in, next) || !(rgba[n] >= 0 && rgba[n] <= 1)) return false;
        p = next;
    }
}

/* The words behind the coordinates of the last vertex: one is a weight, three or four are the vertex's colour. Vertices
 * without a colour, or with a malformed one, are white. */
static int read_colour(struct reading *in, const char *p)
{
    vg_attributes *a = &in->m->attributes;
    double x[4] = {0, 0, 0, 1};
    size_t n;
    count_words(in, p, &n);
    if (n < 3) return VG_OK;
    if (!take_colour(in, p, x)) {
        in->bad_colours++;
        return VG_OK;
    }
    if (vgi_grow(&a->colours, &in->colours_cap, in->m->mesh.nv, 4, in->e) < 0) return VG_ENOMEM;
    memset(a->colours + 4 * a->ncolours, 255, 4 * (in->m->mesh.nv - a->ncolours));
    a->ncolours = in->m->mesh.nv;
    for (int k = 0; k < 4; k++) a->colours[4 * (a->ncolours - 1) + (size_t)k] = vgi_byte_of(x[k]);
    return VG_OK;
}

/* Vertices behind the last one with a colour are white. */
static int finish_colours(struct reading *in)
{
    vg_attributes *a = &in->m->attributes;
    const size_t nv = in->m->mesh.nv;
    if (!a->ncolours || a->ncolours == nv) return VG_OK;
    if (vgi_grow(&a->colours, &in->colours_cap, nv, 4, in->e) < 0) return VG_ENOMEM;
    memset(a->colours + 4 * a->ncolours, 255, 4 * (nv - a->ncolours));
    a->ncolours = nv;
    return VG_OK;
}

static const char *read_vertex(struct reading *in, const char *p)
{
    vg_model *m = in->m;
    if (m->mesh.nv >= UINT32_MAX - 1) {
        vg_fail(in->e, VG_EINPUT, "%s has too many vertices (the limit is 2^32 - 2)", in->subject);
        return NULL;
    }
    if (m->mesh.nv >= in->vertices_cap &&
        vgi_grow(&m->vertices, &in->vertices_cap, m->mesh.nv + 1, 3 * sizeof *m->vertices, in->e) < 0)
        return NULL;
    const char *statement = p;
    double *to = m->vertices + 3 * m->mesh.nv++;
    for (int k = 0; k < 3 && p; k++) {
        if (at_end(in, skip_blanks(in, p))) {
            vg_fail(in->e, VG_EINPUT, "%s line %zu: vertex with %d numbers (expected x y z)", in->subject,
                    line_of(in, statement), k);
            return NULL;
        }
        p = read_coordinate(in, p, to + k);
    }
    if (p && !at_end(in, skip_blanks(in, p)) && read_colour(in, p) < 0) return NULL;
    return p ? skip_words(in, p) : NULL;
}

/* One to three finite numbers and nothing else; returns their number, or 0. */
static uint32_t take_numbers(const struct reading *in, const char *p, double x[3])
{
    for (uint32_t n = 0;; n++) {
        const char *word = skip_blanks(in, p);
        if (at_end(in, word)) return n;
        const char *next = word > p && n < 3 ? vgi_parse_double(word, in->end, &x[n]) : NULL;
        if (!next || !ends_word(in, next) || !isfinite(x[n])) return 0;
        p = next;
    }
}

/* Three numbers are stored for each; finish_tex packs them to the width of the file. A malformed one is marked by a
 * NaN. */
static const char *read_tex(struct reading *in, const char *p)
{
    vg_attributes *a = &in->m->attributes;
    if (a->ntex >= UINT32_MAX - 1) {
        vg_fail(in->e, VG_EINPUT, "%s has too many texture coordinates (the limit is 2^32 - 2)", in->subject);
        return NULL;
    }
    if (a->ntex >= in->tex_cap && vgi_grow(&a->tex, &in->tex_cap, a->ntex + 1, 3 * sizeof *a->tex, in->e) < 0)
        return NULL;
    double *x = a->tex + 3 * a->ntex++;
    x[0] = x[1] = x[2] = 0;
    uint32_t n = take_numbers(in, p, x);
    if (n == 0) in->bad_tex++, x[0] = NAN;
    if (n > a->tex_dim) a->tex_dim = n;
    return skip_words(in, p);
}

/* A malformed normal is 0. */
static const char *read_normal(struct reading *in, const char *p)
{
    vgi_obj_normals *to = in->normals;
    if (vgi_grow(&to->normal, &to->cap, to->n + 1, 3 * sizeof *to->normal, in->e) < 0) return NULL;
    double *x = to->normal + 3 * to->n++;
    if (take_numbers(in, p, x) != 3) memset(x, 0, 3 * sizeof *x);
    return skip_words(in, p);
}

/* An index at p, counted from 1, or from the end if negative, into *index, counted from 0. It may precede the vertex
 * that it names, so it is compared with the final count at the end of the file. */
static inline const char *read_index(const struct reading *in, const char *p, size_t count, uint32_t *index)
{
    const char *s = p, *end = in->end;
    bool negative = s < end && *s == '-';
    s += negative;
    uint64_t x = 0;
    const char *digits = s;
    for (unsigned c; s < end && (c = (unsigned char)*s - (unsigned)'0') < 10; s++) x = x * 10 + c;
    if (s == digits) {
        fail_at(in, p, "an index");
        return NULL;
    }
    bool huge = s - digits > 18;
    if (!huge && !negative && x - 1 < UINT32_MAX - 1) {
        *index = (uint32_t)(x - 1);
        return s;
    }
    if (!huge && negative && x > 0 && x <= count) {
        *index = (uint32_t)(count - x);
        return s;
    }
    if (x == 0 && !huge)
        vg_fail(in->e, VG_EINPUT, "%s line %zu: index 0 (indices count from 1, or back from -1)", in->subject,
                line_of(in, p));
    else
        vg_fail(in->e, VG_EINPUT, "%s line %zu: index %.*s is out of range", in->subject, line_of(in, p),
                s - p > SHOWN ? SHOWN : (int)(s - p), p);
    return NULL;
}

/* The same for a texture coordinate. An impossible one only marks the corner: it becomes UINT32_MAX - 1. */
static const char *read_tex_index(const struct reading *in, const char *p, uint32_t *index)
{
    int64_t x;
    const char *s = *p == '+' ? NULL : vgi_parse_int(p, in->end, &x);
    if (!s) {
        fail_at(in, p, "an index");
        return NULL;
    }
    if (x < 0) x += (int64_t)in->m->attributes.ntex + 1;
    *index = x > 0 && x < UINT32_MAX ? (uint32_t)(x - 1) : UINT32_MAX - 1;
    return s;
}

/* The index of a normal at p, which may be empty, as read_index gives it; UINT32_MAX: none, or out of range. */
static inline const char *read_normal_index(const struct reading *in, const char *p, uint32_t *index)
{
    int64_t x = 0;
    if (in->normals && vgi_parse_int(p, in->end, &x)) {
        if (x < 0) x += (int64_t)in->normals->n + 1;
        if (x > 0 && x < UINT32_MAX) *index = (uint32_t)(x - 1);
    }
    if (p < in->end && *p == '-') p++;
    while (p < in->end && (unsigned char)(*p - '0') < 10) p++;
    return p;
}

static int grow_corners(struct reading *in, size_t need)
{
    vg_model *m = in->m;
    size_t old_cap = in->vert_cap, tex_cap = old_cap, normal_cap = old_cap;
    if (need >= UINT32_MAX)
        return vg_fail(in->e, VG_EINPUT, "%s has too many corners of faces (the limit is 2^32 - 2)", in->subject);
    if (vgi_grow(&m->mesh.vert, &in->vert_cap, need, sizeof *m->mesh.vert, in->e) < 0) return VG_ENOMEM;
    if (in->textured &&
        vgi_grow(&m->attributes.corner_tex, &tex_cap, in->vert_cap, sizeof *m->attributes.corner_tex, in->e) < 0)
        return VG_ENOMEM;
    if (!in->normals) return VG_OK;
    return vgi_grow(&in->normals->corner, &normal_cap, in->vert_cap, sizeof *in->normals->corner, in->e);
}

/* Give every corner from now on a texture coordinate, or UINT32_MAX. */
static int start_texture(struct reading *in)
{
    uint32_t *tex = vgi_array_raw(in->vert_cap, sizeof *tex, in->e);
    if (!tex) return VG_ENOMEM;
    for (size_t c = 0; c <= in->corners && c < in->vert_cap; c++) tex[c] = UINT32_MAX;
    in->m->attributes.corner_tex = tex;
    in->textured = true;
    return VG_OK;
}

/* One corner: v, v/vt, v//vn or v/vt/vn, where vt and vn may be empty. */
static inline const char *read_corner(struct reading *in, const char *p)
{
    vg_model *m = in->m;
    if (in->corners >= in->vert_cap && grow_corners(in, in->corners + 1) < 0) return NULL;
    p = read_index(in, p, m->mesh.nv, &m->mesh.vert[in->corners]);
    if (!p) return NULL;
    uint32_t tex = UINT32_MAX, normal = UINT32_MAX;
    if (p < in->end && *p == '/') {
        p++;
        if (p < in->end && (unsigned char)*p > ' ' && *p != '/' && *p != '\\') {
            p = read_tex_index(in, p, &tex);
            if (!p || (!in->textured && start_texture(in) < 0)) return NULL;
        }
        if (p < in->end && *p == '/') p = read_normal_index(in, p + 1, &normal);
    }
    if (in->normals) in->normals->corner[in->corners] = normal;
    if (in->textured) m->attributes.corner_tex[in->corners] = tex;
    in->corners++;
    return p;
}

/* Make a face of the corners from `first` on. */
static inline int end_face(struct reading *in, size_t first, size_t size)
{
    vg_mesh *mesh = &in->m->mesh;
    if (mesh->nf + 2 > in->start_cap &&
        vgi_grow(&mesh->start, &in->start_cap, mesh->nf + 2, sizeof *mesh->start, in->e) < 0)
        return VG_ENOMEM;
    mesh->start[++mesh->nf] = (uint32_t)(first + size);
    return VG_OK;
}

/* Make a polyline of the n >= 2 corners from `first` on: every two of them are a face. They have no normals. */
static int end_line(struct reading *in, size_t first, size_t n)
{
    size_t segments = n - 1;
    if (first + 2 * segments > in->vert_cap && grow_corners(in, first + 2 * segments) < 0) return VG_ENOMEM;
    uint32_t *vert = in->m->mesh.vert + first, *tex = in->textured ? in->m->attributes.corner_tex + first : NULL;
    for (size_t i = segments; i-- > 0;) { /* backwards, because they move apart in place */
        uint32_t a = vert[i], b = vert[i + 1];
        vert[2 * i] = a, vert[2 * i + 1] = b;
        if (!tex) continue;
        a = tex[i], b = tex[i + 1];
        tex[2 * i] = a, tex[2 * i + 1] = b;
    }
    in->corners = first + 2 * segments;
    for (size_t i = 0; i < segments; i++) {
        int r = end_face(in, first + 2 * i, 2);
        if (r < 0) return r;
    }
    return VG_OK;
}

static const char *read_face(struct reading *in, const char *p, bool line)
{
    const char *statement = p;
    size_t first = in->corners;
    for (;;) {
        const char *word = skip_blanks(in, p);
        if (at_end(in, word)) {
            p = word;
            break;
        }
        if (word == p) {
            fail_at(in, word, "a blank between corners");
            return NULL;
        }
        p = read_corner(in, word);
        if (!p) return NULL;
    }
    size_t n = in->corners - first;
    if ((line && n > 2 ? end_line(in, first, n) : end_face(in, first, n)) < 0) return NULL;
    if (in->m->mesh.nf > in->sought_face) {
        in->found = statement;
        return in->end;
    }
    return p;
}

/* The text [p, end) as UTF-8, trimmed, with joined lines as one blank. */
static char *label_text(struct reading *in, const char *p, const char *end)
{
    size_t n = 0, first = 0;
    char *plain = vgi_array_raw((size_t)(end - p), 1, in->e);
    if (!plain) return NULL;
    while (p < end) {
        const char *next = continuation(in, p);
        plain[n++] = next || *p == '\r' ? ' ' : *p;
        p = !next ? p + 1 : next < end ? next : end;
    }
    while (first < n && (plain[first] == ' ' || plain[first] == '\t')) first++;
    while (n > first && (plain[n - 1] == ' ' || plain[n - 1] == '\t')) n--;
    char *text = vgi_to_utf8(plain + first, n - first, in->e);
    free(plain);
    return text;
}

static const char *read_label(struct reading *in, const char *p, vg_label_kind kind)
{
    vg_attributes *a = &in->m->attributes;
    const char *next = skip_statement(in, p);
    const char *end = next > p && next[-1] == in->line_end ? next - 1 : next;
    if (memchr(p, 0, (size_t)(end - p))) {
        vg_fail(in->e, VG_EINPUT, "%s line %zu: a name with a zero byte", in->subject, line_of(in, p));
        return NULL;
    }
    if (a->nlabels >= in->labels_cap &&
        vgi_grow(&a->labels, &in->labels_cap, a->nlabels + 1, sizeof *a->labels, in->e) < 0)
        return NULL;
    char *text = label_text(in, p, end);
    if (!text) return NULL;
    a->labels[a->nlabels++] = (vg_label){in->m->mesh.nf, kind, text};
    return next;
}

/* One statement at p, which is not a blank; returns the address after it. NULL: failed. */
static const char *read_statement(struct reading *in, const char *p)
{
    static const struct {
        const char *word;
        vg_label_kind kind;
    } labels[] = {{"o", VG_LABEL_OBJECT},
                  {"g", VG_LABEL_GROUP},
                  {"usemtl", VG_LABEL_MATERIAL},
                  {"s", VG_LABEL_SMOOTHING},
                  {"mtllib", VG_LABEL_LIBRARY}};
    switch (*p) {
    case 'v':
        if (ends_word(in, p + 1)) return read_vertex(in, p + 1);
        if (is_word(in, p, "vt")) return read_tex(in, p + 2);
        if (in->normals && is_word(in, p, "vn")) return read_normal(in, p + 2);
        break;
    case 'f':
        if (ends_word(in, p + 1)) return read_face(in, p + 1, false);
        if (is_word(in, p, "fo")) return read_face(in, p + 2, false); /* name of the statement in version 2 of the
                                                                       format */
        break;
    case 'l':
        if (ends_word(in, p + 1)) return read_face(in, p + 1, true);
        break;
    case '#': return skip_comment(in, p);
    default:
        for (size_t i = 0; i < sizeof labels / sizeof *labels; i++)
            if (is_word(in, p, labels[i].word)) return read_label(in, p + strlen(labels[i].word), labels[i].kind);
        in->others += is_word(in, p, "p") || is_word(in, p, "curv") || is_word(in, p, "surf");
    }
    return skip_statement(in, p);
}

static int read_statements(struct reading *in)
{
    const char *p = in->data;
    if (vgi_grow(&in->m->mesh.start, &in->start_cap, 1, sizeof *in->m->mesh.start, in->e) < 0) return VG_ENOMEM;
    in->m->mesh.start[0] = 0;
    while (p < in->end) {
        if (*p == in->line_end) {
            p++;
            continue;
        }
        p = skip_blanks(in, p);
        if (p < in->end && *p != in->line_end) p = read_statement(in, p);
        if (!p) return in->e->code;
    }
    return VG_OK;
}

static struct reading start_reading(vg_model *m, const char *data, size_t n, const char *subject, vg_err *e)
{
    bool unix_lines = memchr(data, '\n', n) || !memchr(data, '\r', n);
    return (struct reading){.data = data,
                            .end = data + n,
                            .line_end = unix_lines ? '\n' : '\r',
                            .subject = subject,
                            .e = e,
                            .m = m,
                            .sought_face = SIZE_MAX};
}

/* Find the line of an invalid face by reading the file again, so that valid files pay nothing for it. */
static size_t line_of_face(const struct reading *in, size_t face)
{
    vg_model again = {0};
    vg_err ignored;
    struct reading s = start_reading(&again, in->data, (size_t)(in->end - in->data), in->subject, &ignored);
    s.sought_face = face;
    size_t line = read_statements(&s) == VG_OK && s.found ? line_of(in, s.found) : 0;
    vg_model_clear(&again);
    return line;
}

static size_t face_of_corner(const vg_mesh *m, size_t corner)
{
    size_t low = 0, high = m->nf;
    while (high - low > 1) {
        size_t middle = low + (high - low) / 2;
        if (m->start[middle] <= corner) low = middle;
        else high = middle;
    }
    return low;
}

/* Check that all vertices exist. */
static int check_vertices(const struct reading *in)
{
    const vg_mesh *m = &in->m->mesh;
    for (size_t c = 0; c < in->corners; c++)
        if (m->vert[c] >= m->nv)
            return vg_fail(in->e, VG_EINPUT, "%s line %zu: vertex %zu is out of range, there are %zu", in->subject,
                           line_of_face(in, face_of_corner(m, c)), (size_t)m->vert[c] + 1, m->nv);
    return VG_OK;
}

/* Compact the valid texture coordinates; number_of: their new indices. */
static void pack_tex(vg_attributes *a, uint32_t *number_of)
{
    size_t kept = 0;
    for (size_t i = 0; i < a->ntex; i++) {
        const double x[3] = {a->tex[3 * i], a->tex[3 * i + 1], a->tex[3 * i + 2]};
        number_of[i] = isnan(x[0]) ? UINT32_MAX : (uint32_t)kept;
        if (isnan(x[0])) continue;
        for (size_t k = 0; k < a->tex_dim; k++) a->tex[kept * a->tex_dim + k] = x[k];
        kept++;
    }
    a->ntex = kept;
}

/* Number of corners with a missing texture coordinate; they get none. */
static size_t renumber_tex(const struct reading *in, const uint32_t *number_of, size_t n)
{
    uint32_t *tex = in->m->attributes.corner_tex;
    size_t missing = 0;
    for (size_t c = 0; c < in->corners; c++) {
        missing += tex[c] != UINT32_MAX && tex[c] >= n;
        tex[c] = tex[c] < n ? number_of[tex[c]] : UINT32_MAX;
    }
    return missing;
}

/* Reduce texture coordinates to the longest width used, with an entry for each corner; malformed ones are dropped. */
static int finish_tex(struct reading *in)
{
    vg_attributes *a = &in->m->attributes;
    const size_t n = a->ntex;
    if (!in->textured && n) {
        a->corner_tex = vgi_array_raw(in->corners, sizeof *a->corner_tex, in->e);
        if (!a->corner_tex) return VG_ENOMEM;
        memset(a->corner_tex, 0xff, in->corners * sizeof *a->corner_tex);
    }
    uint32_t *number_of = vgi_array_raw(n, sizeof *number_of, in->e);
    if (!number_of) return VG_ENOMEM;
    pack_tex(a, number_of);
    size_t missing = a->corner_tex ? renumber_tex(in, number_of, n) : 0;
    free(number_of);
    if (in->bad_tex) vgi_note(&in->m->note, "left out %zu texture coordinates that are not finite numbers", in->bad_tex);
    if (missing) vgi_note(&in->m->note, "%zu corners name texture coordinates that are not there", missing);
    if (a->ntex) return VG_OK;
    free(a->tex);
    free(a->corner_tex);
    a->tex = NULL, a->corner_tex = NULL, a->tex_dim = 0;
    return VG_OK;
}

int vgi_obj_read(vg_model *m, const char *data, size_t n, const char *subject, vg_err *e)
{
    vg_err own;
    struct reading in = start_reading(m, data, n, subject, e ? e : &own);
    int r = read_statements(&in);
    if (r < 0) return r;
    if (m->mesh.nv == 0) return vg_fail(e, VG_EINPUT, "%s has no vertices (no line 'v x y z')", subject);
    if (in.others) vgi_note(&m->note, "left out %zu points, curves or surfaces", in.others);
    if (in.bad_colours)
        vgi_note(&m->note, "left out %zu colours of vertices that are not numbers from 0 to 1", in.bad_colours);
    r = check_vertices(&in);
    if (r == VG_OK) r = finish_colours(&in);
    return r == VG_OK ? finish_tex(&in) : r;
}

int vgi_obj_read_normals(vgi_obj_normals *to, vg_model *m, const char *data, size_t n, vg_err *e)
{
    vg_err own;
    struct reading in = start_reading(m, data, n, "OBJ", e ? e : &own);
    in.normals = to;
    return read_statements(&in);
}

static int read_obj(vg_model *m, const char *data, size_t n, const char *subject, vg_err *e)
{
    int r = vgi_obj_read(m, data, n, subject, e);
    size_t frames = r == VG_OK ? vgi_obj_frames(m) : 0;
    if (frames && vgi_obj_numbered(m, frames))
        vgi_note(&m->note, "its %zu objects are of one topology: --objects frames reads them as a sequence", frames);
    return r;
}

/* Whether the first statement is one of OBJ. Text with comments only is left to the suffix. */
static bool sniff_obj(const unsigned char *data, size_t n)
{
    static const char *const numeric[] = {"v", "vt", "vn", "vp", "f", "l", "p"};
    static const char *const named[] = {"o", "g", "s", "usemtl", "mtllib", "cstype", "deg"};
    struct reading in = start_reading(NULL, (const char *)data, n, NULL, NULL);
    const char *p = in.data;
    for (;;) {
        while ((p = skip_blanks(&in, p)) < in.end && *p == in.line_end) p++;
        if (p == in.end) return false;
        if (*p != '#') break;
        p = skip_comment(&in, p);
    }
    if (memchr(data, 0, (size_t)(skip_comment(&in, p) - in.data))) return false;
    for (size_t i = 0; i < sizeof named / sizeof *named; i++)
        if (is_word(&in, p, named[i])) return true;
    for (size_t i = 0; i < sizeof numeric / sizeof *numeric; i++) {
        if (!is_word(&in, p, numeric[i])) continue;
        p = skip_blanks(&in, p + strlen(numeric[i]));
        return p < in.end && (*p == '-' || *p == '+' || *p == '.' || (unsigned char)(*p - '0') < 10);
    }
    return false;
}

const vgi_format vgi_format_obj = {"obj", ".obj", sniff_obj, read_obj, vgi_obj_write, vgi_obj_rest,
                                     VGI_KEEPS_FACES | VGI_KEEPS_POLYGONS | VGI_KEEPS_ORDER | VGI_KEEPS_TEXTURE | VGI_KEEPS_COLOURS |
                                         VGI_KEEPS_LABELS | VGI_KEEPS_DOUBLES};
