/* off.c: OFF, the object file format of Geomview, as text: vertices with colours and texture coordinates, and faces.
 * Normals are skipped, colours of faces too; binary files and dimensions other than 3 are refused.
 *
 * OFF is a sequence of words, independent of lines, but optional data such as colours and normals ends with the line.
 * So up to three interpretations are tried until one fits: elements end with their line, whatever follows; vertices
 * are three words each, and faces end with their line; everything is words.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"
#include "model/colour.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_NUMBER = 26, MOST_INDEX = 11, SHOWN = 40 };

/* ------------------------------------------------------------------------------------------- reading -- */

struct reading {
    const char *data, *end, *p;
    bool bare_vertices, bare_faces; /* words alone: three per vertex, no colours */
    const char *subject;
    vg_err *e;
    vg_model *m;
    size_t start_cap, vert_cap, corners;
    bool normals, coloured, textured; /* by the keyword: NOFF, COFF, STOFF */
    float *colour;                    /* 4 per vertex, as the file has them; NAN: none */
    size_t bad_colours, coloured_faces;
};

static bool is_blank(char c)
{
    return c == ' ' || c == '\t';
}

static bool is_line_end(char c)
{
    return c == '\n' || c == '\r';
}

static size_t line_of(const struct reading *in, const char *p)
{
    return vgi_line_number_of(in->data, in->end, p);
}

static void skip_line(struct reading *in)
{
    while (in->p < in->end && !is_line_end(*in->p)) in->p++;
}

/* Advance to the next word; false at the end of the file. */
static bool find_word(struct reading *in)
{
    for (;;) {
        while (in->p < in->end && (is_blank(*in->p) || is_line_end(*in->p))) in->p++;
        if (in->p == in->end || *in->p != '#') return in->p < in->end;
        skip_line(in);
    }
}

/* Whether the line has another word. */
static bool line_goes_on(struct reading *in)
{
    while (in->p < in->end && is_blank(*in->p)) in->p++;
    return in->p < in->end && !is_line_end(*in->p) && *in->p != '#';
}

static bool ends_word(const struct reading *in, const char *p)
{
    return p == in->end || is_blank(*p) || is_line_end(*p);
}

static int fail_here(const struct reading *in, const char *expected)
{
    int n = 0;
    while (n < SHOWN && !ends_word(in, in->p + n)) n++;
    if (n == 0) return vg_fail(in->e, VG_ETRUNC, "%s ends where %s is expected", in->subject, expected);
    return vg_fail(in->e, VG_EINPUT, "%s line %zu: %s expected, not '%.*s'", in->subject, line_of(in, in->p), expected, n,
                   in->p);
}

static int read_count(struct reading *in, size_t *n)
{
    int64_t x = 0;
    const char *after = find_word(in) ? vgi_parse_int(in->p, in->end, &x) : NULL;
    if (!after || !ends_word(in, after) || x < 0) return fail_here(in, "a count");
    in->p = after;
    *n = (size_t)x;
    return VG_OK;
}

static int read_coordinate(struct reading *in, double *x)
{
    const char *after = find_word(in) ? vgi_parse_double(in->p, in->end, x) : NULL;
    if (!after || !ends_word(in, after) || !isfinite(*x)) return fail_here(in, "a finite number");
    in->p = after;
    return VG_OK;
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
    /* some writers omit the line end before the counts */
    bool ends = p == end || is_blank(*p) || is_line_end(*p) || *p == '#' || (*p >= '0' && *p <= '9');
    return ends ? (size_t)(p - s) : 0;
}

/* The keyword, which a file named .off may lack, and the counts: vertices, faces, and edges, which some writers
 * omit. */
static int read_header(struct reading *in, size_t *nv, size_t *nf)
{
    size_t n = find_word(in) ? keyword(in->p, in->end) : 0, edges;
    if (n == 0 && (in->p == in->end || *in->p < '0' || *in->p > '9')) return fail_here(in, "OFF");
    if (memchr(in->p, 'n', n) || memchr(in->p, '4', n))
        return vg_fail(in->e, VG_EINPUT, "%s is %.*s, whose vertices do not have 3 coordinates, which is not "
                                         "supported",
                       in->subject, (int)n, in->p);
    in->textured = !in->bare_vertices && memchr(in->p, 'S', n);
    in->coloured = !in->bare_vertices && memchr(in->p, 'C', n);
    in->normals = memchr(in->p, 'N', n);
    in->p += n;
    if (line_goes_on(in) && in->end - in->p >= 6 && !memcmp(in->p, "BINARY", 6))
        return vg_fail(in->e, VG_EINPUT, "%s is binary OFF, which is not supported: write it as text", in->subject);
    int r = read_count(in, nv);
    if (r == VG_OK) r = read_count(in, nf);
    if (r == VG_OK && (in->bare_faces || line_goes_on(in))) r = read_count(in, &edges);
    return r == VG_OK && !in->bare_vertices && line_goes_on(in) ? fail_here(in, "end of line") : r;
}

/* The shortest vertex is "0 0 0" and the shortest face "0", followed by a blank except at the end. Larger counts than
 * the rest of the file can hold are refused before memory is allocated. */
static int check_counts(const struct reading *in, size_t nv, size_t nf)
{
    size_t left = (size_t)(in->end - in->p) + 1;
    if (nv > left / 6 || nf > (left - 6 * nv) / 2)
        return vg_fail(in->e, VG_ETRUNC, "%s announces %zu vertices and %zu faces, but ends before", in->subject, nv,
                       nf);
    if (nv >= UINT32_MAX || nf >= UINT32_MAX)
        return vg_fail(in->e, VG_EINPUT, "%s has too many vertices or faces (the limit is 2^32 - 2)", in->subject);
    if (nv == 0) return vg_fail(in->e, VG_EINPUT, "%s has no vertices", in->subject);
    return VG_OK;
}

static int read_corner(struct reading *in, uint32_t *to)
{
    int64_t v = -1;
    const char *after = find_word(in) ? vgi_parse_int(in->p, in->end, &v) : NULL;
    if (!after || !ends_word(in, after) || v < 0) return fail_here(in, "the index of a vertex");
    if ((uint64_t)v >= in->m->mesh.nv) return fail_here(in, "the index of a vertex below their count");
    in->p = after;
    *to = (uint32_t)v;
    return VG_OK;
}

/* A count, followed by that many indices. */
static int read_face(struct reading *in)
{
    vg_mesh *m = &in->m->mesh;
    size_t n;
    int r = read_count(in, &n);
    if (r < 0) return r;
    if (n > (size_t)(in->end - in->p) / 2)
        return vg_fail(in->e, VG_EINPUT, "%s line %zu: face with less than the %zu vertices announced", in->subject,
                       line_of(in, in->p), n);
    if (n >= UINT32_MAX - in->corners)
        return vg_fail(in->e, VG_EINPUT, "%s has too many corners of faces (the limit is 2^32 - 2)", in->subject);
    if (vgi_grow(&m->vert, &in->vert_cap, in->corners + n, sizeof *m->vert, in->e) < 0) return VG_ENOMEM;
    for (size_t k = 0; k < n && r == VG_OK; k++) r = read_corner(in, m->vert + in->corners++);
    if (r < 0) return r;
    if (vgi_grow(&m->start, &in->start_cap, m->nf + 2, sizeof *m->start, in->e) < 0) return VG_ENOMEM;
    m->start[++m->nf] = (uint32_t)in->corners;
    return VG_OK;
}

/* Up to `most` numbers at the end of the line; returns their number, SIZE_MAX with anything else. */
static size_t read_rest(struct reading *in, double *x, size_t most)
{
    size_t n = 0;
    for (; line_goes_on(in); n++) {
        const char *after = n < most ? vgi_parse_double(in->p, in->end, &x[n]) : NULL;
        if (!after || !ends_word(in, after)) return SIZE_MAX;
        in->p = after;
    }
    return n;
}

/* What follows the coordinates: a normal, three or four numbers of a colour, a texture coordinate. */
static void read_look(struct reading *in, size_t v)
{
    double x[9];
    const size_t n = read_rest(in, x, 9), first = in->normals ? 3 : 0, last = in->textured ? 2 : 0;
    const size_t channels = n == SIZE_MAX || n < first + last ? 0 : n - first - last;
    const bool fits = n != SIZE_MAX && n >= first + last && (channels == 0 || channels == 3 || channels == 4);
    if (in->textured)
        for (size_t k = 0; k < 2; k++) in->m->attributes.tex[2 * v + k] = fits ? x[n - 2 + k] : NAN;
    if (!in->coloured) return;
    bool good = fits && channels > 0;
    for (size_t k = 0; k < channels && good; k++) good = x[first + k] >= 0 && x[first + k] <= 255;
    in->bad_colours += !good;
    for (size_t k = 0; k < 4; k++)
        in->colour[4 * v + k] = !good ? NAN : k < channels ? (float)x[first + k] : -1;
}

static int begin_looks(struct reading *in)
{
    if (in->textured && vgi_begin_texture(in->m, in->e) < 0) return VG_ENOMEM;
    if (!in->coloured) return VG_OK;
    in->colour = vgi_array_raw(in->m->mesh.nv, 4 * sizeof *in->colour, in->e);
    return in->colour ? vgi_begin_colours(in->m, in->e) : VG_ENOMEM;
}

/* Colours from 0 to 1, or, if one is larger, from 0 to 255. Vertices with a malformed one are white. */
static int end_looks(struct reading *in)
{
    const size_t n = 4 * in->m->mesh.nv;
    float most = 1;
    for (size_t i = 0; i < n && in->colour; i++)
        if (in->colour[i] > 1) most = 255;
    for (size_t i = 0; i < n && in->colour; i++)
        in->m->attributes.colours[i] = in->colour[i] >= 0 ? vgi_byte_of(in->colour[i] / most) : 255;
    if (in->bad_colours) vgi_note(&in->m->note, "left out %zu malformed colours of vertices", in->bad_colours);
    if (in->coloured_faces) vgi_note(&in->m->note, "left out the colours of %zu faces", in->coloured_faces);
    return vgi_end_texture(in->m, in->corners, in->e);
}

static int fail_short(struct reading *in, const char *what, size_t i, size_t n)
{
    return vg_fail(in->e, VG_ETRUNC, "%s ends before %s %zu of %zu", in->subject, what, i, n);
}

static int read_elements(struct reading *in, size_t nv, size_t nf)
{
    vg_model *m = in->m;
    int r = VG_OK;
    for (size_t v = 0; v < nv && r == VG_OK; v++) {
        if (!find_word(in)) return fail_short(in, "vertex", v, nv);
        for (int k = 0; k < 3 && r == VG_OK; k++) r = read_coordinate(in, m->vertices + 3 * v + k);
        if (!in->bare_vertices && r == VG_OK && (in->coloured || in->textured)) read_look(in, v);
        if (!in->bare_vertices) skip_line(in);
    }
    for (size_t f = 0; f < nf && r == VG_OK; f++) {
        if (!find_word(in)) return fail_short(in, "face", f, nf);
        r = read_face(in);
        if (in->bare_faces) continue;
        in->coloured_faces += line_goes_on(in);
        skip_line(in);
    }
    return r;
}

/* Refuse data after the last element. */
static int check_end(struct reading *in)
{
    if (!find_word(in)) return VG_OK;
    if (in->bare_vertices) return fail_here(in, "the end of the file");
    vgi_note(&in->m->note, "left out data after the last face, from line %zu on", line_of(in, in->p));
    return VG_OK;
}

/* bare: which of nothing, the vertices, or vertices and faces are words alone */
static int read_as(vg_model *m, int bare, const char *data, size_t n, const char *subject, vg_err *e)
{
    struct reading in = {.data = data, .end = data + n, .p = data, .subject = subject, .e = e, .m = m};
    in.bare_vertices = bare > 0, in.bare_faces = bare > 1;
    size_t nv = 0, nf = 0;
    int r = read_header(&in, &nv, &nf);
    if (r == VG_OK) r = check_counts(&in, nv, nf);
    if (r < 0) return r;
    m->vertices = vgi_array_raw(nv, 3 * sizeof *m->vertices, e);
    if (!m->vertices || vgi_grow(&m->mesh.start, &in.start_cap, 1, sizeof *m->mesh.start, e) < 0) return VG_ENOMEM;
    m->mesh.start[0] = 0;
    m->mesh.nv = nv;
    r = begin_looks(&in);
    if (r == VG_OK) r = read_elements(&in, nv, nf);
    if (r == VG_OK) r = check_end(&in);
    if (r == VG_OK) r = end_looks(&in);
    free(in.colour);
    return r;
}

static int read_off(vg_model *m, const char *data, size_t n, const char *subject, vg_err *e)
{
    int r = read_as(m, 0, data, n, subject, e);
    for (int bare = 1; bare <= 2 && (r == VG_EINPUT || r == VG_ETRUNC); bare++) {
        vg_model words = {0};
        int again = read_as(&words, bare, data, n, subject, NULL);
        if (again == VG_OK) {
            vg_model_clear(m);
            *m = words;
            return VG_OK;
        }
        vg_model_clear(&words);
        if (again == VG_ENOMEM) r = vg_fail(e, again, "not enough memory");
    }
    return r;
}

static bool sniff_off(const unsigned char *data, size_t n)
{
    const char *p = (const char *)data, *end = (const char *)data + n;
    for (;;) {
        while (p < end && (is_blank(*p) || is_line_end(*p))) p++;
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
