/* smoothing.c: smoothing groups of faces: as the labels of an OBJ give them, and made from normals, which are not kept because
 * they change with the pose: the groups keep where they are sharp.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/smoothing.h"
#include "model/incidence.h"
#include "numeric/face.h"
#include "numeric/sets.h"

#include <stdlib.h>

static const double equal_cosine = 0.99985; /* of normals that are one: 1 degree, as files round them */

void vgi_smoothing_of(const vg_mesh *m, const vg_attributes *a, int64_t *of)
{
    size_t next = 0;
    int64_t now = VGI_SMOOTH_BY_ANGLE;
    for (size_t f = 0; f < m->nf; f++) {
        for (; a && next < a->nlabels && a->labels[next].face <= f; next++)
            if (a->labels[next].kind == VG_LABEL_SMOOTHING) now = labs(strtol(a->labels[next].text, NULL, 10)); /* "off" gives 0 */
        of[f] = now;
    }
}

/* An edge of a face between the vertices low < high, and the corners there. */
typedef struct edge {
    uint32_t low, high, face, at_low, at_high;
} edge;

static int by_place(const void *a, const void *b)
{
    const edge *s = a, *t = b;
    if (s->low != t->low) return s->low < t->low ? -1 : 1;
    if (s->high != t->high) return s->high < t->high ? -1 : 1;
    return (s->face > t->face) - (s->face < t->face);
}

static size_t list_edges(const vg_mesh *m, edge *to)
{
    size_t n = 0;
    for (size_t f = 0; f < m->nf; f++) {
        const uint32_t first = m->start[f], size = (uint32_t)vgi_face_size(m, f);
        for (uint32_t i = 0; i < size && size > 2; i++) {
            const uint32_t c = first + i, d = i + 1 < size ? c + 1 : first, v = m->vert[c], w = m->vert[d];
            to[n++] = v < w ? (edge){v, w, (uint32_t)f, c, d} : (edge){w, v, (uint32_t)f, d, c};
        }
    }
    qsort(to, n, sizeof *to, by_place);
    return n;
}

typedef struct smoothing {
    const vg_mesh *m;
    const double *normal; /* of corners */
    double *face;         /* normals of faces */
    int64_t *given;       /* smoothing of faces by labels */
    size_t nedges;
    edge *edges;
    uint32_t *parent;     /* faces that are joined smoothly */
} smoothing;

static bool are_equal(const smoothing *k, uint32_t c, uint32_t d)
{
    return vgi_dot(k->normal + 3 * (size_t)c, k->normal + 3 * (size_t)d) > equal_cosine;
}

static bool is_smooth(const smoothing *k, const edge *s, const edge *t)
{
    return are_equal(k, s->at_low, t->at_low) && are_equal(k, s->at_high, t->at_high);
}

static bool is_given_smooth(const smoothing *k, const edge *s, const edge *t)
{
    const int64_t group = k->given[s->face];
    if (group != k->given[t->face]) return false;
    if (group != VGI_SMOOTH_BY_ANGLE) return group != 0;
    return vgi_dot(k->face + 3 * (size_t)s->face, k->face + 3 * (size_t)t->face) > vgi_least_cosine;
}

/* Join the faces. Returns whether the labels say the same. */
static bool join_faces(smoothing *k)
{
    bool same = true;
    vgi_sets_init(k->parent, k->m->nf);
    for (size_t i = 1; i < k->nedges; i++) {
        const edge *s = &k->edges[i - 1], *t = &k->edges[i];
        if (s->low != t->low || s->high != t->high) continue;
        const bool smooth = is_smooth(k, s, t);
        if (smooth) (void)vgi_sets_join(k->parent, s->face, t->face);
        same = same && smooth == is_given_smooth(k, s, t);
    }
    return same;
}

/* ---- labels ---- */

/* Groups count from 1; a face that is joined to none has 0. given is used for them. */
static void number_groups(smoothing *k)
{
    int64_t n = 0, *number = k->given;
    for (size_t f = 0; f < k->m->nf; f++) number[f] = 0;
    for (size_t f = 0; f < k->m->nf; f++) {
        const uint32_t root = vgi_sets_find(k->parent, (uint32_t)f);
        if (root != f && !number[root]) number[root] = ++n;
    }
    for (size_t f = 0; f < k->m->nf; f++) number[f] = number[vgi_sets_find(k->parent, (uint32_t)f)];
}

static int add_group(vg_label *to, size_t face, int64_t group, vg_err *e)
{
    char text[24];
    if (group) snprintf(text, sizeof text, "%lld", (long long)group);
    else snprintf(text, sizeof text, "off");
    *to = (vg_label){face, VG_LABEL_SMOOTHING, vgi_copy_string(text, strlen(text), e)};
    return to->text ? VG_OK : VG_ENOMEM;
}

static size_t count_runs(const smoothing *k)
{
    size_t n = 0;
    for (size_t f = 0; f < k->m->nf; f++) n += f == 0 || k->given[f] != k->given[f - 1];
    return n;
}

/* The labels other than smoothing, and a group where it changes. */
static int relabel(const smoothing *k, vg_attributes *a, vg_err *e)
{
    vg_label *list = vgi_array(a->nlabels + count_runs(k), sizeof *list, e);
    size_t n = 0, next = 0;
    int r = list ? VG_OK : VG_ENOMEM;
    if (r < 0) return r;
    for (size_t f = 0; f <= k->m->nf; f++) {
        for (; next < a->nlabels && (a->labels[next].face <= f || f == k->m->nf); next++)
            if (a->labels[next].kind != VG_LABEL_SMOOTHING) list[n++] = a->labels[next], a->labels[next].text = NULL;
        if (f == k->m->nf || r < 0 || (f > 0 && k->given[f] == k->given[f - 1])) continue;
        r = add_group(&list[n], f, k->given[f], e);
        n += r == VG_OK;
    }
    for (size_t i = 0; i < a->nlabels; i++) free(a->labels[i].text);
    free(a->labels);
    a->labels = list, a->nlabels = n;
    return r;
}

static int begin(smoothing *k, const vg_body *b, vg_err *e)
{
    const size_t corners = vg_mesh_corners(k->m), nf = k->m->nf;
    k->face = vgi_array_raw(nf, 3 * sizeof *k->face, e), k->given = vgi_array_raw(nf, sizeof *k->given, e);
    k->edges = vgi_array_raw(corners, sizeof *k->edges, e), k->parent = vgi_array_raw(nf, sizeof *k->parent, e);
    if (!k->face || !k->given || !k->edges || !k->parent) return VG_ENOMEM;
    for (size_t f = 0; f < nf; f++) {
        vgi_face_area(b->reference, k->m->vert + k->m->start[f], vgi_face_size(k->m, f), k->face + 3 * f);
        vgi_make_unit(k->face + 3 * f);
    }
    vgi_smoothing_of(k->m, &b->attributes, k->given);
    k->nedges = list_edges(k->m, k->edges);
    return VG_OK;
}

int vgi_smooth_by_normals(vg_body *b, const double *normal, vg_err *e)
{
    smoothing k = {.m = &b->mesh, .normal = normal};
    int r = begin(&k, b, e);
    if (r == VG_OK && !join_faces(&k)) {
        number_groups(&k);
        r = relabel(&k, &b->attributes, e);
    }
    free(k.face);
    free(k.given);
    free(k.edges);
    free(k.parent);
    return r;
}
