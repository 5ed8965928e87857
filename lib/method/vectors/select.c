/* select.c: a subset of the faces that still determines the mesh (T 3.2, Algorithm 1), completed so that every
 * component stays connected. The choice depends only on the faces and their order, not on positions, so that all
 * poses of a mesh agree.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/incidence.h"
#include "numeric/sets.h"

#include <stdlib.h>

struct selection {
    const vg_mesh *m;
    vgi_incidence around;
    bool *chosen;    /* per face */
    uint32_t *taken; /* per vertex u: the last v for which the edge u v belongs to a chosen face */
    uint32_t *sets;  /* per vertex: sets joined by chosen faces */
};

static int prepare_selection(struct selection *s, const vg_mesh *m, vg_err *e)
{
    s->m = m;
    int r = vgi_incidence_make(&s->around, m, e);
    if (r < 0) return r;
    s->chosen = vgi_array(m->nf, sizeof *s->chosen, e);
    s->taken = vgi_array_raw(m->nv, sizeof *s->taken, e);
    s->sets = vgi_array_raw(m->nv, sizeof *s->sets, e);
    if (!s->chosen || !s->taken || !s->sets) return VG_ENOMEM;
    memset(s->taken, 0xff, m->nv * sizeof *s->taken);
    vgi_sets_init(s->sets, m->nv);
    return VG_OK;
}

static void clear_selection(struct selection *s)
{
    vgi_incidence_clear(&s->around);
    free(s->chosen);
    free(s->taken);
    free(s->sets);
}

/* Algorithm 1 at one vertex. Two faces around v that share an edge share one that ends at v (unless they are folded
 * onto each other). So only the two edges of each corner at v are examined: the cost is the number of corners at v,
 * for any size of faces. */
static void select_around(struct selection *s, uint32_t v)
{
    const vg_mesh *m = s->m;
    uint32_t begin = s->around.first[v], end = s->around.first[v + 1], ends[2];
    for (uint32_t i = begin; i < end; i++) {
        if (!s->chosen[s->around.face[i]]) continue;
        vgi_corner_edges(m->start, m->vert, s->around.face[i], s->around.corner[i], ends);
        s->taken[ends[0]] = s->taken[ends[1]] = v;
    }
    for (uint32_t i = begin; i < end; i++) {
        if (s->chosen[s->around.face[i]]) continue;
        vgi_corner_edges(m->start, m->vert, s->around.face[i], s->around.corner[i], ends);
        if (s->taken[ends[0]] == v || s->taken[ends[1]] == v) continue;
        s->chosen[s->around.face[i]] = true;
        s->taken[ends[0]] = s->taken[ends[1]] = v;
    }
}

/* Join the vertices of a face; false if they were already in one set. */
static bool join_face(struct selection *s, size_t f)
{
    const uint32_t *vert = s->m->vert;
    bool joined = false;
    for (uint32_t c = s->m->start[f] + 1; c < s->m->start[f + 1]; c++)
        joined |= vgi_sets_join(s->sets, vert[c - 1], vert[c]);
    return joined;
}

/* Add faces until every component is connected. A vertex without chosen faces is a set by itself until a face joins
 * it, so this also covers all vertices. */
static void complete_selection(struct selection *s)
{
    for (size_t f = 0; f < s->m->nf; f++)
        if (s->chosen[f]) join_face(s, f);
    for (size_t f = 0; f < s->m->nf; f++)
        if (!s->chosen[f] && join_face(s, f)) s->chosen[f] = true;
}

static int list_chosen(const struct selection *s, uint32_t **faces, size_t *n, vg_err *e)
{
    size_t count = 0;
    for (size_t f = 0; f < s->m->nf; f++) count += s->chosen[f];
    uint32_t *list = vgi_array_raw(count, sizeof *list, e);
    if (!list) return VG_ENOMEM;
    count = 0;
    for (size_t f = 0; f < s->m->nf; f++)
        if (s->chosen[f]) list[count++] = (uint32_t)f;
    *faces = list;
    *n = count;
    return VG_OK;
}

int vg_select_faces(const vg_mesh *m, uint32_t **faces, size_t *n, vg_err *e)
{
    struct selection s = {0};
    *faces = NULL;
    *n = 0;
    int r = prepare_selection(&s, m, e);
    if (r < 0) goto out;
    for (size_t v = 0; v < m->nv; v++) select_around(&s, (uint32_t)v);
    complete_selection(&s);
    r = list_chosen(&s, faces, n, e);
out:
    clear_selection(&s);
    return r;
}
