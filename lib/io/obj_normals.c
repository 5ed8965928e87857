/* obj_normals.c: reads the normals of an OBJ, a second time and only of the file that gives the mesh, to see where they are
 * sharp. All else is read in obj.c, which has found the text to be valid.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/smoothing.h"
#include "model/incidence.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

typedef struct reading {
    const char *p, *end;
    size_t n, cap, corners, corners_cap, faces;
    double *normal;   /* n x 3, of unit length; 0 if malformed */
    uint32_t *corner; /* for each corner of a face the number of its normal; UINT32_MAX: none */
    const vg_mesh *mesh;
    bool fits;        /* so far the faces are those of the mesh */
} reading;

static const char *skip_blanks(const reading *in, const char *p)
{
    while (p < in->end && (*p == ' ' || *p == '\t' || *p == '\r')) p++;
    return p;
}

static bool is_end(const reading *in, const char *p)
{
    return p == in->end || *p == '\n' || *p == '#';
}

static int read_normal(reading *in, const char *p, vg_err *e)
{
    int r = vgi_grow(&in->normal, &in->cap, in->n + 1, 3 * sizeof *in->normal, e);
    if (r < 0) return r;
    double *x = in->normal + 3 * in->n++;
    for (int k = 0; k < 3; k++) {
        p = p ? vgi_parse_double(skip_blanks(in, p), in->end, &x[k]) : NULL;
        if (!p || !isfinite(x[k])) x[k] = 0;
    }
    vgi_make_unit(x);
    return VG_OK;
}

/* The normal of "v/vt/vn" or "v//vn" at p; returns what follows the word. */
static const char *read_corner(const reading *in, const char *p, uint32_t *normal)
{
    int slashes = 0;
    int64_t x = 0;
    *normal = UINT32_MAX;
    for (; p < in->end && (unsigned char)*p > ' '; p++) {
        if (*p != '/' || ++slashes != 2 || !vgi_parse_int(p + 1, in->end, &x)) continue;
        if (x < 0) x += (int64_t)in->n + 1;
        if (x > 0 && x < UINT32_MAX) *normal = (uint32_t)(x - 1);
    }
    return p;
}

/* A line of n vertices is n - 1 faces of two. */
static int count_line(reading *in, const char *p, vg_err *e)
{
    size_t n = 0;
    uint32_t ignored;
    for (p = skip_blanks(in, p); !is_end(in, p); p = skip_blanks(in, read_corner(in, p, &ignored))) n++;
    in->faces += n > 1 ? n - 1 : 1;
    const size_t corners = n > 1 ? 2 * (n - 1) : n;
    int r = vgi_grow(&in->corner, &in->corners_cap, in->corners + corners, sizeof *in->corner, e);
    for (size_t i = 0; i < corners && r == VG_OK; i++) in->corner[in->corners++] = UINT32_MAX;
    return r;
}

static int read_face(reading *in, const char *p, vg_err *e)
{
    const size_t f = in->faces++, first = in->corners;
    int r = VG_OK;
    for (p = skip_blanks(in, p); !is_end(in, p) && r == VG_OK; p = skip_blanks(in, p)) {
        r = vgi_grow(&in->corner, &in->corners_cap, in->corners + 1, sizeof *in->corner, e);
        if (r == VG_OK) p = read_corner(in, p, &in->corner[in->corners++]);
    }
    in->fits = in->fits && f < in->mesh->nf && in->mesh->start[f] == first && in->mesh->start[f + 1] == in->corners;
    return r;
}

static bool is_word(const reading *in, const char *p, const char *word)
{
    const size_t n = strlen(word);
    return (size_t)(in->end - p) > n && !memcmp(p, word, n) && (p[n] == ' ' || p[n] == '\t');
}

static int read_lines(reading *in, vg_err *e)
{
    int r = VG_OK;
    while (in->p < in->end && in->fits && r == VG_OK) {
        const char *p = skip_blanks(in, in->p), *next = memchr(p, '\n', (size_t)(in->end - p));
        if (is_word(in, p, "vn")) r = read_normal(in, p + 2, e);
        else if (is_word(in, p, "f") || is_word(in, p, "fo")) r = read_face(in, p + (p[1] == 'o' ? 2 : 1), e);
        else if (is_word(in, p, "l")) r = count_line(in, p + 1, e);
        in->p = next ? next + 1 : in->end;
    }
    return r;
}

/* The normal of each corner; NULL: some face has none, or the text has other faces than the mesh. */
static double *spread(const reading *in, vg_err *e)
{
    double *to = in->fits && in->faces == in->mesh->nf && in->corners == vg_mesh_corners(in->mesh)
                     ? vgi_array(in->corners, 3 * sizeof *to, e) : NULL;
    for (size_t f = 0; to && f < in->mesh->nf; f++)
        for (size_t c = in->mesh->start[f]; c < in->mesh->start[f + 1]; c++) {
            const double *n = in->corner[c] < in->n ? in->normal + 3 * (size_t)in->corner[c] : NULL;
            if (n && vgi_length(n) > 0) {
                memcpy(to + 3 * c, n, 3 * sizeof *n);
            } else if (vgi_face_size(in->mesh, f) > 2) {
                free(to);
                return NULL;
            }
        }
    return to;
}

/* Joined lines, and lines that end in CR alone, are rare: such a file has no groups by its normals. */
static bool is_plain(const char *data, size_t n)
{
    return memchr(data, '\n', n) && !memchr(data, '\\', n) && vgi_format_obj.sniff((const unsigned char *)data, n);
}

int vgi_obj_take_smoothing(vg_body *b, const char *data, size_t n, vg_err *e)
{
    reading in = {.p = data, .end = data + n, .mesh = &b->mesh, .fits = true};
    vg_err own = {0};
    if (!is_plain(data, n)) return VG_OK;
    int r = read_lines(&in, &own);
    double *normal = r == VG_OK && in.n ? spread(&in, &own) : NULL;
    if (normal) r = vgi_smooth_by_normals(b, normal, &own);
    if (r < 0 && e) *e = own;
    free(normal);
    free(in.normal);
    free(in.corner);
    return r;
}
