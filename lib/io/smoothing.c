/* smoothing.c: where a surface is smooth and where it is sharp, by the smoothing groups of an OBJ and by angles; and such groups
 * made from normals, which are not kept because they change with the pose: the groups keep where they are sharp.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/smoothing.h"
#include "model/incidence.h"
#include "numeric/face.h"
#include "numeric/sets.h"

#include <stdlib.h>

static const double least_cosine = 0.5; /* of faces that form one surface where nothing else is said: 60 degrees */
static const double equal_cosine = 0.99985; /* of normals that are one: 1 degree, as files round them */

enum { BY_ANGLE = -1 };

/* ---- where it is smooth ---- */

static void read_groups(const vg_mesh *m, const vg_attributes *a, int64_t *group)
{
    size_t next = 0;
    int64_t now = BY_ANGLE;
    for (size_t f = 0; f < m->nf; f++) {
        for (; a && next < a->nlabels && a->labels[next].face <= f; next++)
            if (a->labels[next].kind == VG_LABEL_SMOOTHING) now = labs(strtol(a->labels[next].text, NULL, 10)); /* "off" gives 0 */
        group[f] = now;
    }
}

/* Order of sides with the same low vertex. */
static bool is_before(const vgi_side *s, const vgi_side *t)
{
    return s->high != t->high ? s->high < t->high : s->face < t->face;
}

static void sort_few(vgi_side *s, size_t n)
{
    for (size_t i = 1; i < n; i++) {
        const vgi_side moving = s[i];
        size_t at = i;
        for (; at > 0 && is_before(&moving, &s[at - 1]); at--) s[at] = s[at - 1];
        s[at] = moving;
    }
}

static int by_high(const void *a, const void *b)
{
    return is_before(a, b) ? -1 : is_before(b, a);
}

enum { FEW = 32 };

/* Sides of faces, ordered by low, high and face. ends: where those of a low vertex start, then (nv + 1) where they end. */
static size_t list_sides(const vg_mesh *m, size_t *ends, vgi_side *to)
{
    memset(ends, 0, (m->nv + 1) * sizeof *ends);
    for (int filling = 0; filling < 2; filling++) {
        for (size_t f = 0; f < m->nf; f++) {
            const uint32_t first = m->start[f], size = (uint32_t)vgi_face_size(m, f);
            for (uint32_t i = 0; i < size && size > 2; i++) {
                const uint32_t c = first + i, d = i + 1 < size ? c + 1 : first, v = m->vert[c], w = m->vert[d];
                if (!filling) ends[(v < w ? v : w) + 1]++;
                else if (v < w) to[ends[v]++] = (vgi_side){v, w, (uint32_t)f, c, d};
                else to[ends[w]++] = (vgi_side){w, v, (uint32_t)f, d, c};
            }
        }
        for (size_t v = 0; v < m->nv && !filling; v++) ends[v + 1] += ends[v];
    }
    for (size_t v = 0; v < m->nv; v++) {
        const size_t first = v ? ends[v - 1] : 0, n = ends[v] - first;
        if (n <= FEW) sort_few(to + first, n);
        else qsort(to + first, n, sizeof *to, by_high);
    }
    return m->nv ? ends[m->nv - 1] : 0;
}

int vgi_smoothing_make(vgi_smoothing *k, const vg_mesh *m, const vg_attributes *a, const double *reference, vg_err *e)
{
    *k = (vgi_smoothing){0};
    k->group = vgi_array_raw(m->nf, sizeof *k->group, e), k->normal = vgi_array_raw(m->nf, 3 * sizeof *k->normal, e);
    k->sides = vgi_array_raw(vg_mesh_corners(m), sizeof *k->sides, e);
    size_t *ends = vgi_array_raw(m->nv + 1, sizeof *ends, e);
    int r = k->group && k->normal && k->sides && ends ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) {
        read_groups(m, a, k->group);
        for (size_t f = 0; f < m->nf; f++) {
            vgi_face_area(reference, m->vert + m->start[f], vgi_face_size(m, f), k->normal + 3 * f);
            vgi_make_unit(k->normal + 3 * f);
        }
        k->nsides = list_sides(m, ends, k->sides);
    }
    free(ends);
    return r;
}

void vgi_smoothing_clear(vgi_smoothing *k)
{
    free(k->group);
    free(k->normal);
    free(k->sides);
    *k = (vgi_smoothing){0};
}

bool vgi_on_one_edge(const vgi_side *s, const vgi_side *t)
{
    return s->low == t->low && s->high == t->high;
}

bool vgi_is_smooth(const vgi_smoothing *k, const vgi_side *s, const vgi_side *t)
{
    const int64_t group = k->group[s->face];
    if (group != k->group[t->face]) return false;
    if (group != BY_ANGLE) return group != 0;
    return vgi_dot(k->normal + 3 * (size_t)s->face, k->normal + 3 * (size_t)t->face) > least_cosine;
}

/* ---- groups by normals ---- */

typedef struct grouping {
    const vg_mesh *m;
    const double *normal; /* of corners */
    uint32_t *parent;     /* faces that are joined smoothly */
    int64_t *number;      /* of the groups, of each face */
} grouping;

static bool are_equal(const grouping *k, uint32_t c, uint32_t d)
{
    return vgi_dot(k->normal + 3 * (size_t)c, k->normal + 3 * (size_t)d) > equal_cosine;
}

/* Join the faces. Returns whether the labels say the same. */
static bool join_faces(const grouping *k, const vgi_smoothing *given)
{
    bool same = true;
    vgi_sets_init(k->parent, k->m->nf);
    for (size_t i = 1; i < given->nsides; i++) {
        const vgi_side *s = &given->sides[i - 1], *t = &given->sides[i];
        if (!vgi_on_one_edge(s, t)) continue;
        const bool smooth = are_equal(k, s->at_low, t->at_low) && are_equal(k, s->at_high, t->at_high);
        if (smooth) (void)vgi_sets_join(k->parent, s->face, t->face);
        same = same && smooth == vgi_is_smooth(given, s, t);
    }
    return same;
}

/* Groups count from 1; a face that is joined to none has 0. */
static void number_groups(const grouping *k)
{
    int64_t n = 0;
    for (size_t f = 0; f < k->m->nf; f++) {
        const uint32_t root = vgi_sets_find(k->parent, (uint32_t)f);
        k->number[f] = 0;
        if (root != f && !k->number[root]) k->number[root] = ++n;
    }
    for (size_t f = 0; f < k->m->nf; f++) k->number[f] = k->number[vgi_sets_find(k->parent, (uint32_t)f)];
}

static int add_group(vg_label *to, size_t face, int64_t group, vg_err *e)
{
    char text[24];
    if (group) snprintf(text, sizeof text, "%lld", (long long)group);
    else snprintf(text, sizeof text, "off");
    *to = (vg_label){face, VG_LABEL_SMOOTHING, vgi_copy_string(text, strlen(text), e)};
    return to->text ? VG_OK : VG_ENOMEM;
}

static size_t count_runs(const grouping *k)
{
    size_t n = 0;
    for (size_t f = 0; f < k->m->nf; f++) n += f == 0 || k->number[f] != k->number[f - 1];
    return n;
}

/* The labels other than smoothing, and a group where it changes. */
static int relabel(const grouping *k, vg_attributes *a, vg_err *e)
{
    vg_label *list = vgi_array(a->nlabels + count_runs(k), sizeof *list, e);
    size_t n = 0, next = 0;
    int r = list ? VG_OK : VG_ENOMEM;
    if (r < 0) return r;
    for (size_t f = 0; f <= k->m->nf; f++) {
        for (; next < a->nlabels && (a->labels[next].face <= f || f == k->m->nf); next++)
            if (a->labels[next].kind != VG_LABEL_SMOOTHING) list[n++] = a->labels[next], a->labels[next].text = NULL;
        if (f == k->m->nf || r < 0 || (f > 0 && k->number[f] == k->number[f - 1])) continue;
        r = add_group(&list[n], f, k->number[f], e);
        n += r == VG_OK;
    }
    for (size_t i = 0; i < a->nlabels; i++) free(a->labels[i].text);
    free(a->labels);
    a->labels = list, a->nlabels = n;
    return r;
}

int vgi_smooth_by_normals(vg_body *b, const double *normal, vg_err *e)
{
    vgi_smoothing given;
    grouping k = {.m = &b->mesh, .normal = normal};
    int r = vgi_smoothing_make(&given, &b->mesh, &b->attributes, b->reference, e);
    k.parent = vgi_array_raw(b->mesh.nf, sizeof *k.parent, e), k.number = vgi_array_raw(b->mesh.nf, sizeof *k.number, e);
    if (!k.parent || !k.number) r = VG_ENOMEM;
    if (r == VG_OK && !join_faces(&k, &given)) {
        number_groups(&k);
        r = relabel(&k, &b->attributes, e);
    }
    vgi_smoothing_clear(&given);
    free(k.parent);
    free(k.number);
    return r;
}
