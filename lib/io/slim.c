/* slim.c: a sequence of vertices without the loose ones, which are in no face. sink.c decides when to use it.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/sink.h"

#include <stdlib.h>

/* Mark the vertices that are in a face; release with free(). */
static bool *find_attached(const vg_mesh *m, vg_err *e)
{
    bool *attached = vgi_array(m->nv, sizeof *attached, e);
    for (size_t c = 0; attached && c < vg_mesh_corners(m); c++) attached[m->vert[c]] = true;
    return attached;
}

static size_t count_marked(const bool *x, size_t n)
{
    size_t found = 0;
    for (size_t i = 0; i < n; i++) found += x[i];
    return found;
}

int vgi_count_loose(const vg_mesh *m, size_t *loose, vg_err *e)
{
    bool *attached = find_attached(m, e);
    if (!attached) return VG_ENOMEM;
    *loose = m->nv - count_marked(attached, m->nv);
    free(attached);
    return VG_OK;
}

/* Renumber the vertices of the asset. Those that are in no face are dropped from it as well. */
static void move_asset(vg_body *b, const uint32_t *number, const bool *attached)
{
    vg_asset *a = &b->asset;
    bool whole = true;
    for (size_t i = 0; i < a->n && whole; i++) whole = attached[a->vertex[i]];
    if (!whole) vg_asset_clear(a);
    for (size_t i = 0; i < a->n; i++) a->vertex[i] = number[a->vertex[i]];
    if (a->n) a->digest = vg_mesh_digest(&b->mesh);
}

/* number: one per vertex of the whole head. */
static void close_up(vgi_slim *s, const vg_head *h, const bool *attached, uint32_t *number)
{
    vg_head *to = &s->head;
    size_t n = 0;
    for (size_t v = 0; v < h->body.mesh.nv; v++) {
        if (!attached[v]) continue;
        memcpy(to->body.reference + 3 * n, h->body.reference + 3 * v, 3 * sizeof *to->body.reference);
        if (to->body.attributes.ncolours)
            memcpy(to->body.attributes.colours + 4 * n, h->body.attributes.colours + 4 * v, 4);
        s->kept[n] = (uint32_t)v;
        number[v] = (uint32_t)n++;
    }
    for (size_t c = 0; c < vg_mesh_corners(&h->body.mesh); c++) to->body.mesh.vert[c] = number[h->body.mesh.vert[c]];
    to->body.mesh.nv = to->count = n;
    if (to->body.attributes.ncolours) to->body.attributes.ncolours = n;
    vg_skeleton_clear(&to->body.skeleton); /* its joints are vertices */
    move_asset(&to->body, number, attached);
}

int vgi_slim_make(vgi_slim *s, const vg_head *h, vg_err *e)
{
    size_t nv = h->body.mesh.nv;
    bool *attached = find_attached(&h->body.mesh, e);
    size_t kept = attached ? count_marked(attached, nv) : 0;
    uint32_t *number = NULL;
    int r = attached ? VG_OK : VG_ENOMEM;
    if (r == VG_OK && kept == 0 && nv)
        r = vg_fail(e, VG_EARG, "--drop-loose would leave nothing: no vertex is in a face");
    if (r == VG_OK && kept < nv) {
        number = vgi_array_raw(nv, sizeof *number, e);
        r = number ? vg_head_copy(&s->head, h, e) : VG_ENOMEM;
        if (r == VG_OK && !(s->kept = vgi_array_raw(kept, sizeof *s->kept, e))) r = VG_ENOMEM;
        if (r == VG_OK) close_up(s, h, attached, number);
    }
    free(attached);
    free(number);
    return r;
}

int vgi_slim_take(vgi_slim *s, const vg_frame *f, vg_err *e)
{
    vg_frame *to = &s->frame;
    int r = vg_frame_shape(to, &s->head, e);
    if (r == VG_OK) r = vg_frame_rename(to, f->name ? f->name : "", e);
    if (r < 0) return r;
    to->has_time = f->has_time, to->time = f->time;
    for (size_t i = 0; i < s->head.count; i++)
        memcpy(to->values + 3 * i, f->values + 3 * (size_t)s->kept[i], 3 * sizeof *to->values);
    return VG_OK;
}

void vgi_slim_clear(vgi_slim *s)
{
    vg_head_clear(&s->head);
    vg_frame_clear(&s->frame);
    free(s->kept);
    *s = (vgi_slim){0};
}
