/* markers.c: pairs of vertices and dense correspondences as text, one per line. register.c checks that the
 * vertices exist.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"
#include "numeric/vec3.h"

#include <stdlib.h>

/* ---- markers ---- */

void vg_markers_clear(vg_markers *m)
{
    for (size_t i = 0; i < m->n; i++) free(m->at[i].name);
    free(m->at);
    *m = (vg_markers){0};
}

static int take_marker(const vgi_lines *t, const vgi_line *l, int base, vg_marker *m, vg_err *e)
{
    if (l->n != 2 && l->n != 3)
        return vg_fail(e, VG_EINPUT, "%s line %zu: a marker is 'SOURCE TARGET' or 'NAME SOURCE TARGET'", t->subject,
                       l->number);
    size_t first = l->n - 2;
    int r = vgi_line_vertex(t, l, first, base, &m->source, e);
    if (r == VG_OK) r = vgi_line_vertex(t, l, first + 1, base, &m->target, e);
    if (r < 0) return r;
    m->line = l->number;
    m->name = NULL;
    return first == 0 ? VG_OK : vgi_line_name(t, l, 0, &m->name, e);
}

int vg_markers_read(vg_markers *m, const void *data, size_t n, int base, const char *name, vg_err *e)
{
    char subject[VGI_SUBJECT];
    vgi_lines t = vgi_lines_of(data, n, vgi_quote(name, subject));
    size_t cap = 0;
    vgi_line l;
    int r = VG_OK;
    *m = (vg_markers){0};
    while (r == VG_OK && vgi_lines_next(&t, &l)) {
        r = vgi_grow(&m->at, &cap, m->n + 1, sizeof *m->at, e);
        if (r == VG_OK) r = take_marker(&t, &l, base, &m->at[m->n], e);
        if (r == VG_OK) m->n++;
    }
    if (r == VG_OK && m->n == 0) r = vg_fail(e, VG_EINPUT, "'%s' names no pair of vertices", name);
    if (r < 0) vg_markers_clear(m);
    return r;
}

/* ---- dense correspondences ---- */

static int take_seed(const vgi_lines *t, const vgi_line *l, int base, vg_seed *s, vg_err *e)
{
    double sum = 0;
    int r = vgi_line_vertex(t, l, 0, base, &s->vertex, e);
    for (size_t k = 0; k < 3 && r == VG_OK; k++) {
        r = vgi_line_vertex(t, l, 1 + k, base, &s->on[k], e);
        if (r == VG_OK) r = vgi_line_number(t, l, 4 + k, &s->weight[k], e);
        /* of a point on or near the triangle; larger ones of opposite sign could add up to anything */
        if (r == VG_OK && !(s->weight[k] >= -1 && s->weight[k] <= 2))
            r = vg_fail(e, VG_EINPUT, "%s line %zu: weight %g is not from -1 to 2", t->subject, l->number,
                        s->weight[k]);
        sum += s->weight[k];
    }
    if (r < 0) return r;
    if (!(sum > 0.5 && sum < 2))
        return vg_fail(e, VG_EINPUT, "%s line %zu: the weights add up to %g, not 1", t->subject, l->number, sum);
    vgi_divide(s->weight, sum);
    return VG_OK;
}

static bool has_none(const vgi_line *l)
{
    return l->n > 1 && vgi_field_is(&l->at[1], "-");
}

int vg_seeds_read(vg_seed **seeds, size_t *n, const void *data, size_t bytes, int base, const char *name, vg_err *e)
{
    char subject[VGI_SUBJECT];
    vgi_lines t = vgi_lines_of(data, bytes, vgi_quote(name, subject));
    size_t cap = 0;
    vgi_line l;
    int r = VG_OK;
    *seeds = NULL, *n = 0;
    while (r == VG_OK && vgi_lines_next(&t, &l)) {
        if (has_none(&l)) continue;
        if (l.n != 7)
            r = vg_fail(e, VG_EINPUT,
                        "%s line %zu: a point is 'VERTEX A B C WA WB WC', or 'VERTEX -' for none", subject,
                        l.number);
        if (r == VG_OK) r = vgi_grow(seeds, &cap, *n + 1, sizeof **seeds, e);
        if (r == VG_OK) r = take_seed(&t, &l, base, &(*seeds)[*n], e);
        if (r == VG_OK) ++*n;
    }
    if (r == VG_OK && *n == 0) r = vg_fail(e, VG_EINPUT, "'%s' gives no points", name);
    if (r < 0) free(*seeds), *seeds = NULL, *n = 0;
    return r;
}
