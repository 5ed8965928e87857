/* off.c: OFF, the object file format of Geomview, as text: vertices and faces.
 * Leaves out normals, colours and texture coordinates (skipped), binary files and other dimensions than 3 (refused).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_NUMBER = 26, MOST_INDEX = 11, SHOWN = 40 };

/* ------------------------------------------------------------------------------------------- reading -- */

struct reading {
    const char *data, *end;
    char line_end;                /* '\n', or '\r' in a file that has no '\n' */
    const char *line, *line_stop; /* the present line without its comment; */
    const char *p;                /* what is not read of it yet */
    const char *next;             /* and the line behind it */
    const char *subject;
    vg_err *e;
    vg_model *m;
    size_t start_cap, vert_cap, corners;
};

static size_t line_number(const struct reading *r)
{
    size_t n = 1;
    for (const char *q = r->data; q < r->line && (q = memchr(q, r->line_end, (size_t)(r->line - q))); q++) n++;
    return n;
}

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r';
}

static void skip_blanks(struct reading *r)
{
    while (r->p < r->line_stop && is_blank(*r->p)) r->p++;
}

/* The next line that holds more than blanks and a comment; false at the end of the file. */
static bool next_line(struct reading *r)
{
    while (r->next < r->end) {
        r->line = r->p = r->next;
        const char *stop = memchr(r->line, r->line_end, (size_t)(r->end - r->line));
        r->next = stop ? stop + 1 : r->end;
        if (!stop) stop = r->end;
        const char *comment = memchr(r->line, '#', (size_t)(stop - r->line));
        r->line_stop = comment ? comment : stop;
        skip_blanks(r);
        if (r->p < r->line_stop) return true;
    }
    r->p = r->line_stop = r->end;
    return false;
}

static int fail_here(struct reading *r, const char *expected)
{
    int n = 0;
    while (n < SHOWN && r->p + n < r->line_stop && !is_blank(r->p[n])) n++;
    if (n == 0) return vg_fail(r->e, VG_EINPUT, "%s line %zu: %s expected", r->subject, line_number(r), expected);
    return vg_fail(r->e, VG_EINPUT, "%s line %zu: %s expected, not '%.*s'", r->subject, line_number(r), expected, n,
                   r->p);
}

/* Is the present line read up to a blank or its end? */
static bool at_word_end(const struct reading *r)
{
    return r->p == r->line_stop || is_blank(*r->p);
}

static int read_count(struct reading *r, size_t *n)
{
    int64_t x;
    skip_blanks(r);
    const char *before = r->p, *after = vgi_parse_int(r->p, r->line_stop, &x);
    if (after) r->p = after;
    if (after && at_word_end(r) && x >= 0) {
        *n = (size_t)x;
        return VG_OK;
    }
    r->p = before;
    return fail_here(r, "a count");
}

static int read_number(struct reading *r, double *x)
{
    skip_blanks(r);
    const char *before = r->p, *after = vgi_parse_double(r->p, r->line_stop, x);
    if (after) r->p = after;
    if (after && at_word_end(r)) return VG_OK;
    r->p = before;
    return fail_here(r, "a number");
}

/* The keyword at s, [ST][C][N][4][n]OFF: its length, or 0. */
static size_t keyword(const char *s, const char *end)
{
    static const char *const prefixes[] = {"ST", "C", "N", "4", "n"};
    const char *p = s;
    for (size_t i = 0; i < sizeof prefixes / sizeof *prefixes; i++) {
        size_t n = strlen(prefixes[i]);
        if ((size_t)(end - p) >= n && !memcmp(p, prefixes[i], n)) p += n;
    }
    if (end - p < 3 || memcmp(p, "OFF", 3)) return 0;
    p += 3;
    /* some writers forget the line end before the counts */
    bool ends = p == end || is_blank(*p) || *p == '\n' || *p == '#' || (*p >= '0' && *p <= '9');
    return ends ? (size_t)(p - s) : 0;
}

static int read_header(struct reading *r, size_t *nv, size_t *nf)
{
    if (!next_line(r)) return vg_fail(r->e, VG_EINPUT, "%s does not start like OFF", r->subject);
    size_t n = keyword(r->p, r->line_stop);
    if (n == 0) return fail_here(r, "OFF");
    if (memchr(r->p, 'n', n) || memchr(r->p, '4', n))
        return vg_fail(r->e, VG_EINPUT, "%s is %.*s, with vertices of other than 3 coordinates, which is not read",
                       r->subject, (int)n, r->p);
    r->p += n;
    skip_blanks(r);
    if (r->line_stop - r->p >= 6 && !memcmp(r->p, "BINARY", 6))
        return vg_fail(r->e, VG_EINPUT, "%s is binary OFF, which is not read: write it as text", r->subject);
    if (r->p == r->line_stop && !next_line(r))
        return vg_fail(r->e, VG_ETRUNC, "%s ends before the counts of vertices and faces", r->subject);
    int result = read_count(r, nv);
    if (result == VG_OK) result = read_count(r, nf);
    skip_blanks(r);
    size_t edges; /* counted by some, 0 or missing with others: of no use */
    if (result == VG_OK && r->p < r->line_stop) result = read_count(r, &edges);
    skip_blanks(r);
    return result == VG_OK && r->p < r->line_stop ? fail_here(r, "end of line") : result;
}

/* The shortest lines are "0 0 0" and "2 0 1", with a line end that the last may lack. Counts beyond what is left are
 * refused before there is memory for them. */
static int check_counts(struct reading *r, size_t nv, size_t nf)
{
    size_t left = (size_t)(r->end - r->next) / 6 + 1;
    if (nv > left || nf > left - nv)
        return vg_fail(r->e, VG_ETRUNC, "%s announces %zu vertices and %zu faces, but ends before", r->subject, nv,
                       nf);
    if (nv >= UINT32_MAX || nf >= UINT32_MAX)
        return vg_fail(r->e, VG_EINPUT, "%s has too many vertices or faces (the limit is 2^32 - 2)", r->subject);
    if (nv == 0) return vg_fail(r->e, VG_EINPUT, "%s has no vertices", r->subject);
    return VG_OK;
}

/* x y z, and perhaps more numbers: normal, colour, texture. */
static int read_vertex(struct reading *r, double *to)
{
    int result = VG_OK;
    for (int k = 0; k < 3 && result == VG_OK; k++) {
        skip_blanks(r);
        const char *word = r->p;
        result = read_number(r, to + k);
        if (result == VG_OK && !isfinite(to[k])) {
            r->p = word;
            return fail_here(r, "a finite number");
        }
    }
    double extra;
    for (skip_blanks(r); result == VG_OK && r->p < r->line_stop; skip_blanks(r)) result = read_number(r, &extra);
    return result;
}

static int read_corner(struct reading *r, uint32_t *to)
{
    int64_t v;
    skip_blanks(r);
    const char *before = r->p, *after = vgi_parse_int(r->p, r->line_stop, &v);
    if (after) r->p = after;
    if (after && at_word_end(r) && v >= 0 && (uint64_t)v < r->m->mesh.nv) {
        *to = (uint32_t)v;
        return VG_OK;
    }
    r->p = before;
    return fail_here(r, after ? "the index of a vertex below their count" : "the index of a vertex");
}

/* A count and so many indices; what follows on the line is a colour. */
static int read_face(struct reading *r)
{
    vg_mesh *m = &r->m->mesh;
    size_t n;
    int result = read_count(r, &n);
    if (result < 0) return result;
    if (n < 2) return vg_fail(r->e, VG_EINPUT, "%s line %zu: face with %zu vertices", r->subject, line_number(r), n);
    if (n > (size_t)(r->line_stop - r->p) / 2)
        return vg_fail(r->e, VG_EINPUT, "%s line %zu: face with less than the %zu vertices announced", r->subject,
                       line_number(r), n);
    if (n >= UINT32_MAX - r->corners)
        return vg_fail(r->e, VG_EINPUT, "%s has too many corners of faces (the limit is 2^32 - 2)", r->subject);
    if (vgi_grow(&m->vert, &r->vert_cap, r->corners + n, sizeof *m->vert, r->e) < 0) return VG_ENOMEM;
    for (size_t k = 0; k < n && result == VG_OK; k++) result = read_corner(r, m->vert + r->corners++);
    if (result < 0) return result;
    if (vgi_grow(&m->start, &r->start_cap, m->nf + 2, sizeof *m->start, r->e) < 0) return VG_ENOMEM;
    m->start[++m->nf] = (uint32_t)r->corners;
    return VG_OK;
}

static int fail_short(struct reading *r, const char *what, size_t i, size_t n)
{
    return vg_fail(r->e, VG_ETRUNC, "%s ends before %s %zu of %zu", r->subject, what, i, n);
}

static int read_body(struct reading *r, size_t nv, size_t nf)
{
    vg_model *m = r->m;
    m->vertices = vgi_array_raw(nv, 3 * sizeof *m->vertices, r->e);
    if (!m->vertices || vgi_grow(&m->mesh.start, &r->start_cap, 1, sizeof *m->mesh.start, r->e) < 0) return VG_ENOMEM;
    m->mesh.start[0] = 0;
    m->mesh.nv = nv;
    for (size_t v = 0; v < nv; v++) {
        if (!next_line(r)) return fail_short(r, "vertex", v, nv);
        int result = read_vertex(r, m->vertices + 3 * v);
        if (result < 0) return result;
    }
    for (size_t f = 0; f < nf; f++) {
        if (!next_line(r)) return fail_short(r, "face", f, nf);
        int result = read_face(r);
        if (result < 0) return result;
    }
    if (next_line(r))
        return vg_fail(r->e, VG_EINPUT, "%s line %zu: more lines than announced", r->subject, line_number(r));
    return VG_OK;
}

static const char *behind_mark(const char *data, size_t n)
{
    return n >= 3 && !memcmp(data, "\xef\xbb\xbf", 3) ? data + 3 : data;
}

static int read_off(vg_model *m, const char *data, size_t n, const char *subject, vg_err *e)
{
    bool unix_lines = memchr(data, '\n', n) || !memchr(data, '\r', n);
    struct reading r = {.data = data,
                        .end = data + n,
                        .line_end = unix_lines ? '\n' : '\r',
                        .subject = subject,
                        .e = e,
                        .m = m,
                        .line = data,
                        .next = behind_mark(data, n)};
    size_t nv = 0, nf = 0;
    int result = read_header(&r, &nv, &nf);
    if (result == VG_OK) result = check_counts(&r, nv, nf);
    return result == VG_OK ? read_body(&r, nv, nf) : result;
}

static bool sniff_off(const unsigned char *data, size_t n)
{
    const char *p = behind_mark((const char *)data, n), *end = (const char *)data + n;
    for (;;) {
        while (p < end && (is_blank(*p) || *p == '\n')) p++;
        if (p == end || *p != '#') break;
        while (p < end && *p != '\n' && *p != '\r') p++;
    }
    return keyword(p, end) > 0;
}

/* ------------------------------------------------------------------------------------------- writing -- */

static int write_off(vg_bytes *out, const vgi_writing *w, vg_err *e)
{
    const vg_mesh *m = w->mesh;
    char text[80];
    int n = snprintf(text, sizeof text, "OFF\n%zu %zu 0\n", m->nv, m->nf);
    if (vgi_bytes_append(out, text, (size_t)n, e) < 0) return VG_ENOMEM;
    for (size_t v = 0; v < m->nv; v++) {
        if (vgi_bytes_reserve(out, out->size + 3 * MOST_NUMBER, e) < 0) return VG_ENOMEM;
        char *to = (char *)out->data + out->size;
        for (int k = 0; k < 3; k++) {
            double x = w->vertices[3 * v + k];
            to += w->full_precision ? vgi_print_double(to, x) : vgi_print_float(to, x);
            *to++ = k < 2 ? ' ' : '\n';
        }
        out->size = (size_t)(to - (char *)out->data);
    }
    return VG_OK;
}

static int write_off_faces(vg_bytes *out, const vgi_writing *w, vg_err *e)
{
    const vg_mesh *m = w->mesh;
    for (size_t f = 0; f < m->nf; f++) {
        size_t size = m->start[f + 1] - m->start[f];
        if (vgi_bytes_reserve(out, out->size + (size + 1) * MOST_INDEX + 1, e) < 0) return VG_ENOMEM;
        char *to = (char *)out->data + out->size;
        to += vgi_print_uint(to, size);
        for (size_t k = 0; k < size; k++) {
            *to++ = ' ';
            to += vgi_print_uint(to, m->vert[m->start[f] + k]);
        }
        *to++ = '\n';
        out->size = (size_t)(to - (char *)out->data);
    }
    return VG_OK;
}

const vgi_format vgi_format_off = {"off", ".off", sniff_off, read_off, write_off, write_off_faces,
                                     VGI_KEEPS_FACES | VGI_KEEPS_POLYGONS | VGI_KEEPS_ORDER | VGI_KEEPS_DOUBLES};
