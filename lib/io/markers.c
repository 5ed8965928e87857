/* markers.c: pairs of vertices and dense correspondences as text, a pair per line.
 * Leaves out whether the vertices exist: who has the meshes knows (register.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <stdlib.h>

enum { MOST_FIELDS = 8 };

/* One line without its comment, as fields between blanks. */
typedef struct line {
    size_t number, n;
    struct field {
        const char *begin, *end;
    } at[MOST_FIELDS];
} line;

typedef struct text {
    const char *at, *end;
    size_t number; /* of the last line taken */
    const char *name;
} text;

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == ',' || c == ';';
}

/* The next line that says something; false at the end. A field too many is counted, not kept. */
static bool next_line(text *t, line *l)
{
    while (t->at < t->end) {
        const char *begin = t->at, *end = memchr(begin, '\n', (size_t)(t->end - begin));
        if (!end) end = t->end;
        t->at = end < t->end ? end + 1 : end;
        *l = (line){.number = ++t->number};
        for (const char *p = begin; p < end && *p != '#';) {
            if (is_blank(*p)) {
                p++;
                continue;
            }
            const char *first = p;
            while (p < end && !is_blank(*p) && *p != '#') p++;
            if (l->n < MOST_FIELDS) l->at[l->n] = (struct field){first, p};
            l->n++;
        }
        if (l->n) return true;
    }
    return false;
}

static int take_vertex(const text *t, const line *l, size_t field, int base, uint32_t *vertex, vg_err *e)
{
    const struct field *f = &l->at[field];
    int64_t x;
    if (vgi_parse_int(f->begin, f->end, &x) != f->end)
        return vg_fail(e, VG_EINPUT, "'%s' line %zu: '%.*s' is no vertex number", t->name, l->number,
                       f->end - f->begin < 40 ? (int)(f->end - f->begin) : 40, f->begin);
    if (x < base || x - base >= UINT32_MAX)
        return vg_fail(e, VG_EINPUT, "'%s' line %zu: there is no vertex %lld: vertices are counted from %d", t->name,
                       l->number, (long long)x, base);
    *vertex = (uint32_t)(x - base);
    return VG_OK;
}

static int take_number(const text *t, const line *l, size_t field, double *x, vg_err *e)
{
    const struct field *f = &l->at[field];
    if (vgi_parse_double(f->begin, f->end, x) == f->end && vgi_finite(x, 1)) return VG_OK;
    return vg_fail(e, VG_EINPUT, "'%s' line %zu: '%.*s' is no number", t->name, l->number,
                   f->end - f->begin < 40 ? (int)(f->end - f->begin) : 40, f->begin);
}

/* ---- markers ---- */

void vg_markers_clear(vg_markers *m)
{
    for (size_t i = 0; i < m->n; i++) free(m->at[i].name);
    free(m->at);
    *m = (vg_markers){0};
}

static int take_marker(const text *t, const line *l, int base, vg_marker *m, vg_err *e)
{
    if (l->n != 2 && l->n != 3)
        return vg_fail(e, VG_EINPUT, "'%s' line %zu: a marker is 'SOURCE TARGET' or 'NAME SOURCE TARGET'", t->name,
                       l->number);
    size_t first = l->n - 2;
    int r = take_vertex(t, l, first, base, &m->source, e);
    if (r == VG_OK) r = take_vertex(t, l, first + 1, base, &m->target, e);
    if (r < 0) return r;
    m->line = l->number;
    m->name = NULL;
    if (first == 0) return VG_OK;
    size_t n = (size_t)(l->at[0].end - l->at[0].begin);
    if (!vgi_is_utf8(l->at[0].begin, n))
        return vg_fail(e, VG_EINPUT, "'%s' line %zu: the name is not UTF-8", t->name, l->number);
    m->name = vgi_copy_string(l->at[0].begin, n, e);
    return m->name ? VG_OK : VG_ENOMEM;
}

int vg_markers_read(vg_markers *m, const void *data, size_t n, int base, const char *name, vg_err *e)
{
    text t = {.at = data, .end = (const char *)data + n, .name = name};
    size_t cap = 0;
    line l;
    int r = VG_OK;
    *m = (vg_markers){0};
    while (r == VG_OK && next_line(&t, &l)) {
        r = vgi_grow(&m->at, &cap, m->n + 1, sizeof *m->at, e);
        if (r == VG_OK) r = take_marker(&t, &l, base, &m->at[m->n], e);
        if (r == VG_OK) m->n++;
    }
    if (r == VG_OK && m->n == 0) r = vg_fail(e, VG_EINPUT, "'%s' names no pair of vertices", name);
    if (r < 0) vg_markers_clear(m);
    return r;
}

/* ---- dense correspondences ---- */

static int take_seed(const text *t, const line *l, int base, vg_seed *s, vg_err *e)
{
    double sum = 0;
    int r = take_vertex(t, l, 0, base, &s->vertex, e);
    for (size_t k = 0; k < 3 && r == VG_OK; k++) {
        r = take_vertex(t, l, 1 + k, base, &s->on[k], e);
        if (r == VG_OK) r = take_number(t, l, 4 + k, &s->weight[k], e);
        sum += s->weight[k];
    }
    if (r < 0) return r;
    if (!(sum > 0.5 && sum < 2))
        return vg_fail(e, VG_EINPUT, "'%s' line %zu: the weights add up to %g, not 1", t->name, l->number, sum);
    for (int k = 0; k < 3; k++) s->weight[k] /= sum;
    return VG_OK;
}

static bool has_none(const line *l)
{
    return l->n > 1 && l->at[1].end - l->at[1].begin == 1 && *l->at[1].begin == '-';
}

int vg_seeds_read(vg_seed **seeds, size_t *n, const void *data, size_t bytes, int base, const char *name, vg_err *e)
{
    text t = {.at = data, .end = (const char *)data + bytes, .name = name};
    size_t cap = 0;
    line l;
    int r = VG_OK;
    *seeds = NULL, *n = 0;
    while (r == VG_OK && next_line(&t, &l)) {
        if (has_none(&l)) continue;
        if (l.n != 7)
            r = vg_fail(e, VG_EINPUT,
                        "'%s' line %zu: a point is 'VERTEX A B C WA WB WC', or 'VERTEX -' where there is none", name,
                        l.number);
        if (r == VG_OK) r = vgi_grow(seeds, &cap, *n + 1, sizeof **seeds, e);
        if (r == VG_OK) r = take_seed(&t, &l, base, &(*seeds)[*n], e);
        if (r == VG_OK) ++*n;
    }
    if (r == VG_OK && *n == 0) r = vg_fail(e, VG_EINPUT, "'%s' gives no point of any vertex", name);
    if (r < 0) free(*seeds), *seeds = NULL, *n = 0;
    return r;
}
