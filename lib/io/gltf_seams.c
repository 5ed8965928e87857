/* gltf_seams.c: a mesh cut apart at the seams of its texture, since a vertex of glTF has one texture coordinate.
 * Leaves out what the file looks like (gltf_write.c), and the way back (gltf_weld.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_seams.h"

#include <stdlib.h>

enum { UNSET = 0 };

typedef struct cutting {
    vgi_gltf_seams *to;
    const vg_attributes *a;
    uint32_t *tex;  /* of each vertex of the file: its texture coordinate + 1; UNSET */
    uint32_t *next; /* and its next copy; 0: there is none */
    size_t from_cap, tex_cap, next_cap;
} cutting;

static bool same_place(const vg_attributes *a, uint32_t s, uint32_t t)
{
    const double *p = a->tex + (size_t)s * a->tex_dim, *q = a->tex + (size_t)t * a->tex_dim;
    return s == t || (p[0] == q[0] && p[1] == q[1]);
}

static int add_copy(cutting *k, uint32_t v, uint32_t tex, uint32_t *copy, vg_err *e)
{
    vgi_gltf_seams *s = k->to;
    if (s->n >= UINT32_MAX - 1) return vg_fail(e, VG_EINPUT, "glTF cannot hold so many vertices");
    int r = vgi_grow(&s->from, &k->from_cap, s->n + 1, sizeof *s->from, e);
    if (r == VG_OK) r = vgi_grow(&k->tex, &k->tex_cap, s->n + 1, sizeof *k->tex, e);
    if (r == VG_OK) r = vgi_grow(&k->next, &k->next_cap, s->n + 1, sizeof *k->next, e);
    if (r < 0) return r;
    *copy = (uint32_t)s->n++;
    s->from[*copy] = v, k->tex[*copy] = tex + 1, k->next[*copy] = 0;
    return VG_OK;
}

/* The vertex of the file for vertex v of the mesh with this texture coordinate; a corner without one takes any. */
static int find_vertex(cutting *k, uint32_t v, uint32_t tex, uint32_t *to, vg_err *e)
{
    *to = v;
    if (tex == UINT32_MAX) return VG_OK;
    if (k->tex[v] == UNSET) return k->tex[v] = tex + 1, VG_OK;
    while (!same_place(k->a, k->tex[*to] - 1, tex)) {
        if (k->next[*to]) {
            *to = k->next[*to];
            continue;
        }
        uint32_t copy = 0, last = *to;
        int r = add_copy(k, v, tex, &copy, e);
        if (r == VG_OK) k->next[last] = copy, *to = copy;
        return r;
    }
    return VG_OK;
}

static int cut(cutting *k, const vg_mesh *m, vg_err *e)
{
    vgi_gltf_seams *s = k->to;
    const size_t corners = vg_mesh_corners(m);
    int r = VG_OK;
    if (!(s->corner = vgi_array_raw(corners, sizeof *s->corner, e))) return VG_ENOMEM;
    for (size_t c = 0; c < corners && r == VG_OK; c++)
        r = find_vertex(k, m->vert[c], k->a->corner_tex[c], &s->corner[c], e);
    if (r < 0 || !(s->uv = vgi_array(s->n, 2 * sizeof *s->uv, e))) return r < 0 ? r : VG_ENOMEM;
    for (size_t v = 0; v < s->n; v++) {
        if (k->tex[v] == UNSET) continue;
        const double *p = k->a->tex + (size_t)(k->tex[v] - 1) * k->a->tex_dim;
        s->uv[2 * v] = (float)p[0], s->uv[2 * v + 1] = (float)(1 - p[1]);
        if (!(s->uv[2 * v] - s->uv[2 * v] == 0) || !(s->uv[2 * v + 1] - s->uv[2 * v + 1] == 0))
            return vg_fail(e, VG_EINPUT, "a texture coordinate is too large for binary32");
    }
    return VG_OK;
}

int vgi_gltf_seams_make(vgi_gltf_seams *s, const vg_mesh *m, const vg_attributes *a, vg_err *e)
{
    cutting k = {.to = s, .a = a};
    *s = (vgi_gltf_seams){.nv = m->nv, .n = m->nv};
    if (!a->ntex || a->tex_dim < 2) return VG_OK;
    k.from_cap = k.tex_cap = k.next_cap = m->nv;
    s->from = vgi_array(m->nv, sizeof *s->from, e);
    k.tex = vgi_array(m->nv, sizeof *k.tex, e), k.next = vgi_array(m->nv, sizeof *k.next, e);
    int r = s->from && k.tex && k.next ? VG_OK : VG_ENOMEM;
    for (size_t v = 0; v < m->nv && r == VG_OK; v++) s->from[v] = (uint32_t)v;
    if (r == VG_OK) r = cut(&k, m, e);
    free(k.tex);
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
