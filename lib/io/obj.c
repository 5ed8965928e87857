/* obj.c: reads Wavefront OBJ: vertices, texture coordinates, faces, lines, and the names of groups and materials.
 * Normals (they change with the pose), vertex colours, points and free-form surfaces are ignored; material files are
 * read in mtl.c. Writing is in obj_write.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

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
    size_t vertices_cap, start_cap, vert_cap, tex_cap, labels_cap;
    size_t corners;
    bool textured;      /* corner_tex exists, with capacity vert_cap */
    size_t sought_face; /* find_face: stop after this face ... */
    const char *found;  /* ... and store the position of its statement */
    size_t bad_tex;     /* number of malformed texture coordinates */
};

static size_t line_of(const struct reading *r, const char *p)
{
    size_t n = 1;
    for (const char *q = r->data; q < p && (q = memchr(q, r->line_end, (size_t)(p - q))); q++) n++;
    return n;
}

static bool is_line_end(const struct reading *r, const char *p)
{
    return p == r->end || *p == r->line_end;
}

/* A backslash before a line end joins two lines: the first byte of the second line, or NULL. */
static const char *continuation(const struct reading *r, const char *p)
{
    if (*p++ != '\\') return NULL;
    if (p < r->end && *p == '\r' && r->line_end != '\r') p++;
    if (p == r->end) return p;
    return *p == r->line_end ? p + 1 : NULL;
}

static bool is_odd_blank(const struct reading *r, char c)
{
    return c == ' ' || c == '\t' || (c == '\r' && r->line_end != '\r');
}

/* Between numbers a backslash followed by blanks, which editors leave there, also joins lines. A name may end like
 * that. */
static const char *loose_continuation(const struct reading *r, const char *p)
{
    if (*p++ != '\\') return NULL;
    while (p < r->end && is_odd_blank(r, *p)) p++;
    return p == r->end ? p : *p == r->line_end ? p + 1 : NULL;
}

static const char *skip_odd_blanks(const struct reading *r, const char *p)
{
    while (p < r->end) {
        const char *next;
        if (is_odd_blank(r, *p)) p++;
        else if (*p == '\\' && (next = loose_continuation(r, p))) p = next;
        else break;
    }
    return p;
}

/* Skip blanks and joined lines. Nearly all files have one blank before something visible. */
static inline const char *skip_blanks(const struct reading *r, const char *p)
{
    if (p < r->end && *p == ' ') p++;
    if (p < r->end && (unsigned char)*p > ' ' && *p != '\\') return p;
    return skip_odd_blanks(r, p);
}

static inline bool at_end(const struct reading *r, const char *p)
{
    return is_line_end(r, p) || *p == '#';
}

/* The next line that does not continue the statement. */
static const char *skip_statement(const struct reading *r, const char *p)
{
    while (p < r->end) {
        const char *q = memchr(p, r->line_end, (size_t)(r->end - p));
        if (!q) return r->end;
        const char *last = q;
        if (last > p && last[-1] == '\r') last--;
        p = q + 1;
        if (last == r->data || last[-1] != '\\') break;
    }
    return p;
}

static const char *skip_comment(const struct reading *r, const char *p)
{
    const char *q = memchr(p, r->line_end, (size_t)(r->end - p));
    return q ? q + 1 : r->end;
}

/* Whether a word ends before p. */
static inline bool ends_word(const struct reading *r, const char *p)
{
    return is_line_end(r, p) || *p == ' ' || *p == '\t' || *p == '\r' || *p == '\\';
}

/* Skip words up to the end of the statement or a comment. */
static const char *skip_words(const struct reading *r, const char *p)
{
    for (p = skip_blanks(r, p); !at_end(r, p); p = skip_blanks(r, p))
        do p++;
        while (!ends_word(r, p));
    return p;
}

/* Whether the word at p equals `word`. */
static bool is_word(const struct reading *r, const char *p, const char *word)
{
    size_t n = strlen(word);
    return (size_t)(r->end - p) >= n && !memcmp(p, word, n) && ends_word(r, p + n);
}

/* VG_EINPUT: unexpected text at p, which is quoted from the file. */
static int fail_at(const struct reading *r, const char *p, const char *expected)
{
    size_t n = 0;
    while (n < SHOWN && !is_line_end(r, p + n) && p[n] != ' ' && p[n] != '\t' && p[n] != '\r') n++;
    if (n == 0) return vg_fail(r->e, VG_EINPUT, "%s line %zu: %s expected", r->subject, line_of(r, p), expected);
    return vg_fail(r->e, VG_EINPUT, "%s line %zu: %s expected, not '%.*s'", r->subject, line_of(r, p), expected,
                   (int)n, p);
}

/* VG_EINPUT: the word at p begins like a number but is not one, or not finite; Windows writes NaN as "-1.#IND". */
static int fail_number(const struct reading *r, const char *p)
{
    size_t n = 0;
    while (n < SHOWN && !ends_word(r, p + n)) n++;
    return vg_fail(r->e, VG_EINPUT, "%s line %zu: '%.*s' is not a finite number", r->subject, line_of(r, p), (int)n, p);
}

/* One coordinate of a vertex at p, after blanks; returns the address after it, or NULL. */
static inline const char *read_coordinate(struct reading *r, const char *p, double *x)
{
    const char *word = skip_blanks(r, p);
    const char *next = word > p && !is_line_end(r, word) ? vgi_parse_double(word, r->end, x) : NULL;
    if (next && isfinite(*x) && ends_word(r, next)) return next;
    if (next) fail_number(r, word);
    else fail_at(r, word, "a number");
    return NULL;
}

static const char *read_vertex(struct reading *r, const char *p)
{
    vg_model *m = r->m;
    if (m->mesh.nv >= UINT32_MAX - 1) {
        vg_fail(r->e, VG_EINPUT, "%s has too many vertices (the limit is 2^32 - 2)", r->subject);
        return NULL;
    }
    if (m->mesh.nv >= r->vertices_cap &&
        vgi_grow(&m->vertices, &r->vertices_cap, m->mesh.nv + 1, 3 * sizeof *m->vertices, r->e) < 0)
        return NULL;
    const char *statement = p;
    double *to = m->vertices + 3 * m->mesh.nv++;
    for (int k = 0; k < 3 && p; k++) {
        if (at_end(r, skip_blanks(r, p))) {
            vg_fail(r->e, VG_EINPUT, "%s line %zu: vertex with %d numbers (expected x y z)", r->subject,
                    line_of(r, statement), k);
            return NULL;
        }
        p = read_coordinate(r, p, to + k);
    }
    if (!p) return NULL;
    return skip_words(r, p);
}

/* One to three finite numbers and nothing else; returns their number, or 0. */
static uint32_t take_tex(const struct reading *r, const char *p, double x[3])
{
    for (uint32_t n = 0;; n++) {
        const char *word = skip_blanks(r, p);
        if (at_end(r, word)) return n;
        const char *next = word > p && n < 3 ? vgi_parse_double(word, r->end, &x[n]) : NULL;
        if (!next || !ends_word(r, next) || !isfinite(x[n])) return 0;
        p = next;
    }
}

/* Three numbers are stored for each; finish_tex packs them to the width of the file. A malformed one is marked by a
 * NaN. */
static const char *read_tex(struct reading *r, const char *p)
{
    vg_attributes *a = &r->m->attributes;
    if (a->ntex >= UINT32_MAX - 1) {
        vg_fail(r->e, VG_EINPUT, "%s has too many texture coordinates (the limit is 2^32 - 2)", r->subject);
        return NULL;
    }
    if (a->ntex >= r->tex_cap && vgi_grow(&a->tex, &r->tex_cap, a->ntex + 1, 3 * sizeof *a->tex, r->e) < 0)
        return NULL;
    double *x = a->tex + 3 * a->ntex++;
    x[0] = x[1] = x[2] = 0;
    uint32_t n = take_tex(r, p, x);
    if (n == 0) r->bad_tex++, x[0] = NAN;
    if (n > a->tex_dim) a->tex_dim = n;
    return skip_words(r, p);
}

/* An index at p, counted from 1, or from the end if negative, into *index, counted from 0. It may precede the vertex
 * that it names, so it is compared with the final count at the end of the file. */
static inline const char *read_index(const struct reading *r, const char *p, size_t count, uint32_t *index)
{
    const char *s = p, *end = r->end;
    bool negative = s < end && *s == '-';
    s += negative;
    uint64_t x = 0;
    const char *digits = s;
    for (unsigned c; s < end && (c = (unsigned char)*s - (unsigned)'0') < 10; s++) x = x * 10 + c;
    if (s == digits) {
        fail_at(r, p, "an index");
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
        vg_fail(r->e, VG_EINPUT, "%s line %zu: index 0 (indices count from 1, or back from -1)", r->subject,
                line_of(r, p));
    else
        vg_fail(r->e, VG_EINPUT, "%s line %zu: index %.*s is out of range", r->subject, line_of(r, p),
                s - p > SHOWN ? SHOWN : (int)(s - p), p);
    return NULL;
}

/* The same for a texture coordinate. An impossible one only marks the corner: it becomes UINT32_MAX - 1. */
static const char *read_tex_index(const struct reading *r, const char *p, uint32_t *index)
{
    int64_t x;
    const char *s = *p == '+' ? NULL : vgi_parse_int(p, r->end, &x);
    if (!s) {
        fail_at(r, p, "an index");
        return NULL;
    }
    if (x < 0) x += (int64_t)r->m->attributes.ntex + 1;
    *index = x > 0 && x < UINT32_MAX ? (uint32_t)(x - 1) : UINT32_MAX - 1;
    return s;
}

static int grow_corners(struct reading *r, size_t need)
{
    vg_model *m = r->m;
    size_t old_cap = r->vert_cap, tex_cap = old_cap;
    if (need >= UINT32_MAX)
        return vg_fail(r->e, VG_EINPUT, "%s has too many corners of faces (the limit is 2^32 - 2)", r->subject);
    if (vgi_grow(&m->mesh.vert, &r->vert_cap, need, sizeof *m->mesh.vert, r->e) < 0) return VG_ENOMEM;
    if (r->textured &&
        vgi_grow(&m->attributes.corner_tex, &tex_cap, r->vert_cap, sizeof *m->attributes.corner_tex, r->e) < 0)
        return VG_ENOMEM;
    return VG_OK;
}

/* Give every corner from now on a texture coordinate, or UINT32_MAX. */
static int start_texture(struct reading *r)
{
    uint32_t *tex = vgi_array_raw(r->vert_cap, sizeof *tex, r->e);
    if (!tex) return VG_ENOMEM;
    for (size_t c = 0; c <= r->corners && c < r->vert_cap; c++) tex[c] = UINT32_MAX;
    r->m->attributes.corner_tex = tex;
    r->textured = true;
    return VG_OK;
}

/* One corner: v, v/vt, v//vn or v/vt/vn, where vt and vn may be empty. The normal is read and dropped. */
static inline const char *read_corner(struct reading *r, const char *p)
{
    vg_model *m = r->m;
    if (r->corners >= r->vert_cap && grow_corners(r, r->corners + 1) < 0) return NULL;
    p = read_index(r, p, m->mesh.nv, &m->mesh.vert[r->corners]);
    if (!p) return NULL;
    uint32_t tex = UINT32_MAX;
    if (p < r->end && *p == '/') {
        p++;
        if (p < r->end && (unsigned char)*p > ' ' && *p != '/' && *p != '\\') {
            p = read_tex_index(r, p, &tex);
            if (!p || (!r->textured && start_texture(r) < 0)) return NULL;
        }
        if (p < r->end && *p == '/') {
            p++;
            if (p < r->end && *p == '-') p++;
            while (p < r->end && (unsigned char)(*p - '0') < 10) p++;
        }
    }
    if (r->textured) m->attributes.corner_tex[r->corners] = tex;
    r->corners++;
    return p;
}

/* Make a face of the corners from `first` on. */
static inline int end_face(struct reading *r, size_t first, size_t size)
{
    vg_mesh *mesh = &r->m->mesh;
    if (mesh->nf + 2 > r->start_cap &&
        vgi_grow(&mesh->start, &r->start_cap, mesh->nf + 2, sizeof *mesh->start, r->e) < 0)
        return VG_ENOMEM;
    mesh->start[++mesh->nf] = (uint32_t)(first + size);
    return VG_OK;
}

/* Make a polyline of the n >= 2 corners from `first` on: every two of them are a face. */
static int end_line(struct reading *r, size_t first, size_t n)
{
    size_t segments = n - 1;
    if (first + 2 * segments > r->vert_cap && grow_corners(r, first + 2 * segments) < 0) return VG_ENOMEM;
    uint32_t *vert = r->m->mesh.vert + first, *tex = r->textured ? r->m->attributes.corner_tex + first : NULL;
    for (size_t i = segments; i-- > 0;) { /* backwards, because they move apart in place */
        uint32_t a = vert[i], b = vert[i + 1];
        vert[2 * i] = a, vert[2 * i + 1] = b;
        if (!tex) continue;
        a = tex[i], b = tex[i + 1];
        tex[2 * i] = a, tex[2 * i + 1] = b;
    }
    r->corners = first + 2 * segments;
    for (size_t i = 0; i < segments; i++) {
        int result = end_face(r, first + 2 * i, 2);
        if (result < 0) return result;
    }
    return VG_OK;
}

static const char *read_face(struct reading *r, const char *p, bool line)
{
    const char *statement = p;
    size_t first = r->corners;
    for (;;) {
        const char *word = skip_blanks(r, p);
        if (at_end(r, word)) {
            p = word;
            break;
        }
        if (word == p) {
            fail_at(r, word, "a blank between corners");
            return NULL;
        }
        p = read_corner(r, word);
        if (!p) return NULL;
    }
    size_t n = r->corners - first;
    if ((line && n > 2 ? end_line(r, first, n) : end_face(r, first, n)) < 0) return NULL;
    if (r->m->mesh.nf > r->sought_face) {
        r->found = statement;
        return r->end;
    }
    return p;
}

/* The text [p, end) as UTF-8, trimmed, with joined lines as one blank. */
static char *label_text(struct reading *r, const char *p, const char *end)
{
    size_t n = 0, first = 0;
    char *plain = vgi_array_raw((size_t)(end - p), 1, r->e);
    if (!plain) return NULL;
    while (p < end) {
        const char *next = continuation(r, p);
        plain[n++] = next || *p == '\r' ? ' ' : *p;
        p = !next ? p + 1 : next < end ? next : end;
    }
    while (first < n && (plain[first] == ' ' || plain[first] == '\t')) first++;
    while (n > first && (plain[n - 1] == ' ' || plain[n - 1] == '\t')) n--;
    char *text = vgi_to_utf8(plain + first, n - first, r->e);
    free(plain);
    return text;
}

static const char *read_label(struct reading *r, const char *p, vg_label_kind kind)
{
    vg_attributes *a = &r->m->attributes;
    const char *next = skip_statement(r, p);
    const char *end = next > p && next[-1] == r->line_end ? next - 1 : next;
    if (memchr(p, 0, (size_t)(end - p))) {
        vg_fail(r->e, VG_EINPUT, "%s line %zu: a name with a zero byte", r->subject, line_of(r, p));
        return NULL;
    }
    if (a->nlabels >= r->labels_cap &&
        vgi_grow(&a->labels, &r->labels_cap, a->nlabels + 1, sizeof *a->labels, r->e) < 0)
        return NULL;
    char *text = label_text(r, p, end);
    if (!text) return NULL;
    a->labels[a->nlabels++] = (vg_label){r->m->mesh.nf, kind, text};
    return next;
}

/* One statement at p, which is not a blank; returns the address after it. NULL: failed. */
static const char *read_statement(struct reading *r, const char *p)
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
        if (ends_word(r, p + 1)) return read_vertex(r, p + 1);
        if (is_word(r, p, "vt")) return read_tex(r, p + 2);
        break;
    case 'f':
        if (ends_word(r, p + 1)) return read_face(r, p + 1, false);
        if (is_word(r, p, "fo")) return read_face(r, p + 2, false); /* name of the statement in version 2 of the
                                                                       format */
        break;
    case 'l':
        if (ends_word(r, p + 1)) return read_face(r, p + 1, true);
        break;
    case '#': return skip_comment(r, p);
    default:
        for (size_t i = 0; i < sizeof labels / sizeof *labels; i++)
            if (is_word(r, p, labels[i].word)) return read_label(r, p + strlen(labels[i].word), labels[i].kind);
    }
    return skip_statement(r, p);
}

static int read_statements(struct reading *r)
{
    const char *p = r->data;
    if (vgi_grow(&r->m->mesh.start, &r->start_cap, 1, sizeof *r->m->mesh.start, r->e) < 0) return VG_ENOMEM;
    r->m->mesh.start[0] = 0;
    while (p < r->end) {
        if (*p == r->line_end) {
            p++;
            continue;
        }
        p = skip_blanks(r, p);
        if (p < r->end && *p != r->line_end) p = read_statement(r, p);
        if (!p) return r->e->code;
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
static size_t line_of_face(const struct reading *r, size_t face)
{
    vg_model again = {0};
    vg_err ignored;
    struct reading s = start_reading(&again, r->data, (size_t)(r->end - r->data), r->subject, &ignored);
    s.sought_face = face;
    size_t line = read_statements(&s) == VG_OK && s.found ? line_of(r, s.found) : 0;
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
static int check_vertices(const struct reading *r)
{
    const vg_mesh *m = &r->m->mesh;
    for (size_t c = 0; c < r->corners; c++)
        if (m->vert[c] >= m->nv)
            return vg_fail(r->e, VG_EINPUT, "%s line %zu: vertex %zu is out of range, there are %zu", r->subject,
                           line_of_face(r, face_of_corner(m, c)), (size_t)m->vert[c] + 1, m->nv);
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
static size_t renumber_tex(const struct reading *r, const uint32_t *number_of, size_t n)
{
    uint32_t *tex = r->m->attributes.corner_tex;
    size_t missing = 0;
    for (size_t c = 0; c < r->corners; c++) {
        missing += tex[c] != UINT32_MAX && tex[c] >= n;
        tex[c] = tex[c] < n ? number_of[tex[c]] : UINT32_MAX;
    }
    return missing;
}

/* Reduce texture coordinates to the longest width used, with an entry for each corner; malformed ones are dropped. */
static int finish_tex(struct reading *r)
{
    vg_attributes *a = &r->m->attributes;
    const size_t n = a->ntex;
    if (!r->textured && n) {
        a->corner_tex = vgi_array_raw(r->corners, sizeof *a->corner_tex, r->e);
        if (!a->corner_tex) return VG_ENOMEM;
        memset(a->corner_tex, 0xff, r->corners * sizeof *a->corner_tex);
    }
    uint32_t *number_of = vgi_array_raw(n, sizeof *number_of, r->e);
    if (!number_of) return VG_ENOMEM;
    pack_tex(a, number_of);
    size_t missing = a->corner_tex ? renumber_tex(r, number_of, n) : 0;
    free(number_of);
    if (r->bad_tex) vgi_note(&r->m->note, "left out %zu texture coordinates that are no finite numbers", r->bad_tex);
    if (missing) vgi_note(&r->m->note, "%zu corners name texture coordinates that are not there", missing);
    if (a->ntex) return VG_OK;
    free(a->tex);
    free(a->corner_tex);
    a->tex = NULL, a->corner_tex = NULL, a->tex_dim = 0;
    return VG_OK;
}

int vgi_obj_read(vg_model *m, const char *data, size_t n, const char *subject, vg_err *e)
{
    vg_err own;
    struct reading r = start_reading(m, data, n, subject, e ? e : &own);
    int result = read_statements(&r);
    if (result < 0) return result;
    if (m->mesh.nv == 0) return vg_fail(e, VG_EINPUT, "%s has no vertices (no line 'v x y z')", subject);
    result = check_vertices(&r);
    return result == VG_OK ? finish_tex(&r) : result;
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
    struct reading r = start_reading(NULL, (const char *)data, n, NULL, NULL);
    const char *p = r.data;
    for (;;) {
        while ((p = skip_blanks(&r, p)) < r.end && *p == r.line_end) p++;
        if (p == r.end) return false;
        if (*p != '#') break;
        p = skip_comment(&r, p);
    }
    if (memchr(data, 0, (size_t)(skip_comment(&r, p) - r.data))) return false;
    for (size_t i = 0; i < sizeof named / sizeof *named; i++)
        if (is_word(&r, p, named[i])) return true;
    for (size_t i = 0; i < sizeof numeric / sizeof *numeric; i++) {
        if (!is_word(&r, p, numeric[i])) continue;
        p = skip_blanks(&r, p + strlen(numeric[i]));
        return p < r.end && (*p == '-' || *p == '+' || *p == '.' || (unsigned char)(*p - '0') < 10);
    }
    return false;
}

const vgi_format vgi_format_obj = {"obj", ".obj", sniff_obj, read_obj, vgi_obj_write, vgi_obj_rest,
                                     VGI_KEEPS_FACES | VGI_KEEPS_POLYGONS | VGI_KEEPS_ORDER | VGI_KEEPS_TEXTURE |
                                         VGI_KEEPS_LABELS | VGI_KEEPS_DOUBLES};
