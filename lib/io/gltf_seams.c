/* gltf_seams.c: splits a mesh at the seams of its texture and at its hard edges, because a glTF vertex has one
 * texture coordinate and one normal. The file is in gltf_write.c, the inverse in gltf_weld.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_seams.h"

#include <stdlib.h>

enum { UNSET = 0 };

typedef struct look { /* attributes of which a vertex of the file has one; + 1, UNSET: none yet */
    uint32_t tex, group;
} look;

typedef struct cutting {
    vgi_gltf_seams *to;
    const vg_attributes *a;
    look *look;     /* per vertex of the file */
    uint32_t *next; /* its next copy; 0: none */
    size_t from_cap, look_cap, next_cap;
} cutting;

static bool same_place(const vg_attributes *a, uint32_t s, uint32_t t)
{
    const double *p = a->tex + (size_t)s * a->tex_dim, *q = a->tex + (size_t)t * a->tex_dim;
    return s == t || (p[0] == q[0] && p[1] == q[1]);
}

/* Whether a vertex with the attributes `has` can also have `wants`. Unset ones match any. */
static bool suits_look(const cutting *k, look has, look wants)
{
    if (has.group != UNSET && wants.group != UNSET && has.group != wants.group) return false;
    return has.tex == UNSET || wants.tex == UNSET || same_place(k->a, has.tex - 1, wants.tex - 1);
}

static void complete_look(look *has, look wants)
{
    if (has->tex == UNSET) has->tex = wants.tex;
    if (has->group == UNSET) has->group = wants.group;
}

static int add_copy(cutting *k, uint32_t v, look wants, uint32_t *copy, vg_err *e)
{
    vgi_gltf_seams *s = k->to;
    if (s->n >= UINT32_MAX - 1) return vg_fail(e, VG_EINPUT, "glTF cannot hold so many vertices");
    int r = vgi_grow(&s->from, &k->from_cap, s->n + 1, sizeof *s->from, e);
    if (r == VG_OK) r = vgi_grow(&k->look, &k->look_cap, s->n + 1, sizeof *k->look, e);
    if (r == VG_OK) r = vgi_grow(&k->next, &k->next_cap, s->n + 1, sizeof *k->next, e);
    if (r < 0) return r;
    *copy = (uint32_t)s->n++;
    s->from[*copy] = v, k->look[*copy] = wants, k->next[*copy] = 0;
    return VG_OK;
}

/* The file vertex for vertex v of the mesh with these attributes. */
static int find_vertex(cutting *k, uint32_t v, look wants, uint32_t *to, vg_err *e)
{
    *to = v;
    while (!suits_look(k, k->look[*to], wants)) {
        if (k->next[*to]) {
            *to = k->next[*to];
            continue;
        }
        uint32_t copy = 0, last = *to;
        int r = add_copy(k, v, wants, &copy, e);
        if (r == VG_OK) k->next[last] = copy, *to = copy;
        return r;
    }
    complete_look(&k->look[*to], wants);
    return VG_OK;
}

static int place_texture(const cutting *k, vg_err *e)
{
    vgi_gltf_seams *s = k->to;
    if (!(s->uv = vgi_array(s->n, 2 * sizeof *s->uv, e))) return VG_ENOMEM;
    for (size_t v = 0; v < s->n; v++) {
        if (k->look[v].tex == UNSET) continue;
        const double *p = k->a->tex + (size_t)(k->look[v].tex - 1) * k->a->tex_dim;
        s->uv[2 * v] = (float)p[0], s->uv[2 * v + 1] = (float)(1 - p[1]);
        if (!(s->uv[2 * v] - s->uv[2 * v] == 0) || !(s->uv[2 * v + 1] - s->uv[2 * v + 1] == 0))
            return vg_fail(e, VG_EINPUT, "a texture coordinate is too large for binary32");
    }
    return VG_OK;
}

static int cut_mesh(cutting *k, const vg_mesh *m, bool textured, const uint32_t *group, vg_err *e)
{
    vgi_gltf_seams *s = k->to;
    const size_t corners = vg_mesh_corners(m);
    int r = VG_OK;
    if (!(s->corner = vgi_array_raw(corners, sizeof *s->corner, e))) return VG_ENOMEM;
    for (size_t c = 0; c < corners && r == VG_OK; c++) /* UINT32_MAX + 1 is UNSET */
        r = find_vertex(k, m->vert[c], (look){textured ? k->a->corner_tex[c] + 1 : UNSET, group ? group[c] + 1 : UNSET},
                        &s->corner[c], e);
    return r == VG_OK && textured ? place_texture(k, e) : r;
}

int vgi_gltf_seams_make(vgi_gltf_seams *s, const vg_mesh *m, const vg_attributes *a, const uint32_t *group, vg_err *e)
{
    cutting k = {.to = s, .a = a};
    const bool textured = a->ntex && a->tex_dim >= 2;
    *s = (vgi_gltf_seams){.nv = m->nv, .n = m->nv};
    if (!textured && !group) return VG_OK;
    k.from_cap = k.look_cap = k.next_cap = m->nv;
    s->from = vgi_array(m->nv, sizeof *s->from, e);
    k.look = vgi_array(m->nv, sizeof *k.look, e), k.next = vgi_array(m->nv, sizeof *k.next, e);
    int r = s->from && k.look && k.next ? VG_OK : VG_ENOMEM;
    for (size_t v = 0; v < m->nv && r == VG_OK; v++) s->from[v] = (uint32_t)v;
    if (r == VG_OK) r = cut_mesh(&k, m, textured, group, e);
    free(k.look);
    free(k.next);
    if (r < 0) vgi_gltf_seams_clear(s);
    return r;
}

void vgi_gltf_seams_clear(vgi_gltf_seams *s)
{
    free(s->from);
    free(s->corner);
    free(s->uv);
    *s = (vgi_gltf_seams){0};
}
