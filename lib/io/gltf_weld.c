/* gltf_weld.c: restores a glTF mesh as it was before export: triangles of our own files become polygons, and split
 * vertices are merged. Vertices and faces come from gltf_scene.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_scene.h"
#include "model/colour.h"
#include "io/polygon.h"

#include <stdlib.h>

/* ---- polygons of our own files ---- */

typedef struct restoring {
    const vg_mesh *from;
    size_t triangle, line; /* the next faces with three and two corners */
    vg_mesh to;
    size_t start_cap, vert_cap;
    uint32_t edge[3 * VGI_MOST_CLIPPED][2];
} restoring;

static const uint32_t *next_of_size(const vg_mesh *m, size_t *at, size_t size)
{
    while (*at < m->nf && m->start[*at + 1] - m->start[*at] != size) ++*at;
    return *at < m->nf ? m->vert + m->start[(*at)++] : NULL;
}

static bool is_inner(const restoring *k, size_t n, size_t edge)
{
    for (size_t i = 0; i < n; i++)
        if (k->edge[i][0] == k->edge[edge][1] && k->edge[i][1] == k->edge[edge][0]) return true;
    return false;
}

/* Walk once around the triangles, along edges that belong to only one of them. */
static bool walk_around(const restoring *k, size_t n, uint32_t *face)
{
    const size_t edges = 3 * (n - 2);
    uint32_t v = face[0] = k->edge[0][0];
    for (size_t i = 1; i <= n; i++) {
        size_t found = edges;
        for (size_t s = 0; s < edges && found == edges; s++)
            if (k->edge[s][0] == v && !is_inner(k, edges, s)) found = s;
        if (found == edges) return false;
        v = k->edge[found][1];
        if (i < n) face[i] = v;
    }
    return v == face[0];
}

/* One face of n corners from the next n - 2 triangles; false if they do not form one. */
static bool take_polygon(restoring *k, size_t n, uint32_t *face)
{
    bool fan = true;
    for (size_t t = 0; t + 2 < n; t++) {
        const uint32_t *v = next_of_size(k->from, &k->triangle, 3);
        if (!v) return false;
        fan &= t == 0 || (v[0] == face[0] && v[1] == face[t + 1]);
        if (!fan && n > VGI_MOST_CLIPPED) return false;
        if (fan && t == 0) face[0] = v[0], face[1] = v[1];
        if (fan) face[t + 2] = v[2];
        for (size_t s = 0; s < 3 && n <= VGI_MOST_CLIPPED; s++)
            k->edge[3 * t + s][0] = v[s], k->edge[3 * t + s][1] = v[(s + 1) % 3];
    }
    return fan || walk_around(k, n, face);
}

/* 1: done; 0: impossible. The arrays never grow beyond what the triangles fill. */
static int take_face(restoring *k, size_t n, vg_err *e)
{
    vg_mesh *m = &k->to;
    const size_t corners = vg_mesh_corners(m);
    if (n < 2 || n > k->from->nf + 2) return 0;
    int r = vgi_grow(&m->start, &k->start_cap, m->nf + 2, sizeof *m->start, e);
    if (r == VG_OK) r = vgi_grow(&m->vert, &k->vert_cap, corners + n, sizeof *m->vert, e);
    if (r < 0) return r;
    if (n == 2) {
        const uint32_t *v = next_of_size(k->from, &k->line, 2);
        if (!v) return 0;
        memcpy(m->vert + corners, v, 2 * sizeof *v);
    } else if (!take_polygon(k, n, m->vert + corners)) {
        return 0;
    }
    m->start[m->nf] = (uint32_t)corners;
    m->start[++m->nf] = (uint32_t)(corners + n);
    return 1;
}

static int take_runs(restoring *k, const vgi_json *runs, vg_err *e)
{
    int r = 1;
    for (size_t i = 0; i < vgi_json_count(runs) && r == 1; i += 2) {
        uint64_t count, size;
        if (!vgi_json_whole(vgi_json_at(runs, i), &count) || !vgi_json_whole(vgi_json_at(runs, i + 1), &size))
            return 0;
        for (; count && r == 1; count--) r = take_face(k, (size_t)size, e);
    }
    if (r == 1 && (next_of_size(k->from, &k->triangle, 3) || next_of_size(k->from, &k->line, 2))) r = 0;
    return r;
}

/* If the extras of the only mesh describe polygons, and its triangles agree, restore them. */
static int restore_polygons(vgi_gltf_scene *x, vgi_gltf_faces *f, vg_err *e)
{
    const vgi_json *mesh, *runs;
    if (x->nparts != 1) return VG_OK;
    int r = vgi_gltf_item(&x->g, vgi_json_get(x->nodes[x->parts[0].node].json, "mesh"), "meshes", &mesh, NULL, e);
    if (r < 0 || !vgi_json_is_array(runs = vgi_json_get(vgi_json_get(mesh, "extras"), VGI_GLTF_FACES))) return r;
    restoring *k = vgi_array(1, sizeof *k, e);
    if (!k) return VG_ENOMEM;
    k->from = &f->mesh;
    r = take_runs(k, runs, e);
    if (r == 1 && vgi_json_count(runs) == 0) x->own = true;
    else if (r == 1) r = vg_mesh_check(&(vg_mesh){x->all, k->to.nf, k->to.start, k->to.vert}, "it", NULL) == VG_OK;
    if (r == 1 && k->to.nf) {
        const vg_mesh old = f->mesh;
        f->mesh = k->to, k->to = old;
        x->own = true;
    }
    vg_mesh_clear(&k->to);
    free(k);
    return r < 0 ? r : VG_OK;
}

/* ---- welding: exporters split a mesh where normals or texture coordinates are discontinuous ---- */

typedef struct welding {
    const vgi_gltf_scene *x;
    uint32_t *slots;  /* positions among all vertices, + 1; 0: free */
    uint32_t *number; /* the vertex of the mesh for each; owned by the scene */
    size_t nslots;
} welding;

static const vgi_gltf_part *part_of(const vgi_gltf_scene *x, size_t v)
{
    size_t low = 0, high = x->nparts;
    while (high - low > 1) {
        size_t mid = low + (high - low) / 2;
        if (x->parts[mid].first <= v) low = mid;
        else high = mid;
    }
    return &x->parts[low];
}

static uint64_t mix(uint64_t hash, const double *p, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        hash = (hash ^ vgi_double_bits(p[i] + 0.0)) * 0x9e3779b97f4a7c15u; /* -0 is 0 */
        hash ^= hash >> 29;
    }
    return hash;
}

static uint64_t hash_of(const vgi_gltf_part *p, size_t v)
{
    double at[4];
    vgi_accessor_get(&p->position, v, at);
    uint64_t hash = mix((uint64_t)p->instance << 32 ^ (p->node + 1), at, 3);
    for (size_t s = 0; s < p->nsets; s++) {
        vgi_accessor_get(&p->joints[s], v, at);
        hash = mix(hash, at, 4);
        vgi_accessor_get(&p->shares[s], v, at);
        hash = mix(hash, at, 4);
    }
    for (size_t t = 0; t < p->ntargets; t++) {
        vgi_accessor_get(&p->moved[t], v, at);
        hash = mix(hash, at, 3);
    }
    return hash;
}

static bool same_element(const vgi_accessor *a, size_t i, const vgi_accessor *b, size_t j)
{
    double p[4], q[4];
    vgi_accessor_get(a, i, p);
    vgi_accessor_get(b, j, q);
    for (size_t k = 0; k < a->width; k++)
        if (!(p[k] == q[k])) return false;
    return true;
}

/* Whether they stay together in any motion. */
static bool are_one(const vgi_gltf_part *p, size_t v, const vgi_gltf_part *q, size_t w)
{
    if (p->node != q->node || p->instance != q->instance || p->nsets != q->nsets || p->ntargets != q->ntargets) return false;
    if (!same_element(&p->position, v, &q->position, w)) return false;
    for (size_t s = 0; s < p->nsets; s++)
        if (!same_element(&p->joints[s], v, &q->joints[s], w) || !same_element(&p->shares[s], v, &q->shares[s], w))
            return false;
    for (size_t t = 0; t < p->ntargets; t++)
        if (!same_element(&p->moved[t], v, &q->moved[t], w)) return false;
    return true;
}

static uint32_t *find_slot(const welding *k, const vgi_gltf_part *p, size_t v)
{
    size_t i = (size_t)hash_of(p, v) & (k->nslots - 1);
    for (; k->slots[i]; i = (i + 1) & (k->nslots - 1)) {
        size_t other = k->slots[i] - 1;
        const vgi_gltf_part *q = part_of(k->x, other);
        if (are_one(p, v, q, other - q->first)) break;
    }
    return &k->slots[i];
}

/* Copies made by our own writer: `number` becomes the original of each. Returns the number of vertices; 0 if the file
 * does not describe them, or incorrectly. */
static size_t own_vertices(const vgi_gltf_scene *x, uint32_t *number)
{
    const vgi_json *mesh;
    uint64_t nv, v;
    if (!x->own || vgi_gltf_item(&x->g, vgi_json_get(x->nodes[x->parts[0].node].json, "mesh"), "meshes", &mesh, NULL,
                                 NULL) < 0)
        return 0;
    const vgi_json *list = vgi_json_get(vgi_json_get(mesh, "extras"), VGI_GLTF_VERTICES);
    if (!vgi_json_whole(vgi_json_at(list, 0), &nv) || nv == 0 || nv > x->all || vgi_json_count(list) - 1 != x->all - nv)
        return 0;
    for (size_t i = 0; i < x->all; i++) {
        number[i] = (uint32_t)i;
        if (i < nv) continue;
        if (!vgi_json_whole(vgi_json_at(list, 1 + i - (size_t)nv), &v) || v >= nv) return 0;
        number[i] = (uint32_t)v;
    }
    return (size_t)nv;
}

/* Whether vertices v and w of one node, before welding, have equal positions. */
static bool at_one_place(const vgi_gltf_scene *x, size_t v, size_t w)
{
    const vgi_gltf_part *p = part_of(x, v), *q = part_of(x, w);
    return p->node == q->node && p->instance == q->instance &&
           same_element(&p->position, v - p->first, &q->position, w - q->first);
}

static bool is_whole(const uint32_t *v, size_t n, const uint32_t *number)
{
    for (size_t k = 0; k < n && n <= 3; k++)
        if (number[v[k]] == number[v[(k + 1) % n]]) return false;
    return true;
}

/* Whether these numbers give the faces of `to`, except for those that degenerate. */
static bool makes_faces(const vg_mesh *m, const uint32_t *number, const vg_mesh *to)
{
    size_t face = 0;
    for (size_t f = 0; f < m->nf; f++) {
        const uint32_t *v = m->vert + m->start[f];
        const size_t n = m->start[f + 1] - m->start[f];
        if (!is_whole(v, n, number)) continue;
        if (face == to->nf || to->start[face + 1] - to->start[face] != n) return false;
        for (size_t k = 0; k < n; k++)
            if (number[v[k]] != to->vert[to->start[face] + k]) return false;
        face++;
    }
    return face == to->nf;
}

/* Map each vertex of the file to the vertex `to` of the mesh; the file must have those of one number at one position,
 * in the order of their first ones. Returns the number of vertices; 0 if they do not fit. */
static size_t number_as(const vgi_gltf_scene *x, const uint32_t *to, uint32_t *number, uint32_t *first)
{
    size_t n = 0;
    for (size_t v = 0; v < x->all; v++) {
        const uint32_t t = to ? to[v] : (uint32_t)v;
        if (t > n || (t < n && !at_one_place(x, v, first[t]))) return 0;
        if (t == n) first[n++] = (uint32_t)v;
        number[v] = t;
    }
    return n;
}

/* As stated in a character's file that we wrote; 0 if absent or inconsistent. */
static size_t vertices_of_asset(const vgi_gltf_scene *x, uint32_t *number, uint32_t *first)
{
    const vgi_json *list = vgi_json_get(vgi_json_get(vgi_json_get(x->g.json, "asset"), "extras"), VGI_GLTF_VERTICES);
    uint64_t nv, v;
    if (x->own || x->unwelded || vgi_json_count(list) != 1 + x->all || !vgi_json_whole(vgi_json_at(list, 0), &nv)) return 0;
    for (size_t i = 0; i < x->all; i++) {
        if (!vgi_json_whole(vgi_json_at(list, 1 + i), &v) || v >= nv || nv > x->all) return 0;
        number[i] = (uint32_t)v;
    }
    return number_as(x, number, number, first) == nv ? (size_t)nv : 0;
}

/* Use the welding of another file with the same vertices, so that the same vertices are merged in both: lips that
 * touch in this pose alone stay separate. Returns the number of vertices; 0 if it does not fit. */
static size_t vertices_of_like(const vgi_gltf_scene *x, const vg_mesh *m, uint32_t *number, uint32_t *first)
{
    const vg_asset *a = x->like && x->like->asset.n ? &x->like->asset : NULL;
    if (!x->like || x->own || x->unwelded || (a ? a->n : x->like->mesh.nv) != x->all) return 0;
    if (a && a->digest != vg_mesh_digest(&x->like->mesh)) return 0;
    const size_t n = number_as(x, a ? a->vertex : NULL, number, first);
    return n == x->like->mesh.nv && makes_faces(m, number, &x->like->mesh) ? n : 0;
}

/* Represent each vertex by the first of the file's vertices that map to it. */
static int keep_listed(vgi_gltf_scene *x, const uint32_t *first, size_t n, vg_err *e)
{
    for (size_t i = 0, at = 0; i < x->nparts; i++) {
        vgi_gltf_part *p = &x->parts[i];
        if (!(p->kept = vgi_array_raw(p->count, sizeof *p->kept, e))) return VG_ENOMEM;
        while (at < n && first[at] < p->first + p->count) p->kept[p->nkept++] = (uint32_t)(first[at++] - p->first);
    }
    return VG_OK;
}

static int keep_first(vgi_gltf_part *p, size_t n, vg_err *e)
{
    if (!(p->kept = vgi_array_raw(n, sizeof *p->kept, e))) return VG_ENOMEM;
    for (size_t v = 0; v < n; v++) p->kept[v] = (uint32_t)v;
    p->nkept = n;
    return VG_OK;
}

static int weld_part(vgi_gltf_scene *x, const welding *k, vgi_gltf_part *p, size_t *n, vg_err *e)
{
    if (!(p->kept = vgi_array_raw(p->count, sizeof *p->kept, e))) return VG_ENOMEM;
    for (size_t v = 0; v < p->count; v++) {
        uint32_t *slot = x->own || x->unwelded ? NULL : find_slot(k, p, v);
        if (slot && *slot) {
            k->number[p->first + v] = k->number[*slot - 1];
            continue;
        }
        if (slot) *slot = (uint32_t)(p->first + v) + 1;
        k->number[p->first + v] = (uint32_t)(*n)++;
        p->kept[p->nkept++] = (uint32_t)v;
    }
    return VG_OK;
}

static uint32_t uv_of(const vgi_gltf_scene *x, uint32_t v)
{
    const vgi_gltf_part *p = part_of(x, v);
    return p->textured ? (uint32_t)(p->first_uv + (v - p->first)) : UINT32_MAX;
}

/* Faces of the welded vertices; degenerate ones are dropped, which strips also contain. Returns their number. uv (may
 * be NULL): texture coordinate per corner. Labels are adapted. */
static size_t renumber_faces(vgi_gltf_scene *x, vg_mesh *m, const uint32_t *number, uint32_t *uv)
{
    size_t nf = 0, corners = 0, label = 0;
    for (size_t f = 0; f < m->nf; f++) {
        const size_t start = m->start[f], n = m->start[f + 1] - start;
        bool distinct = true;
        for (; label < x->attributes.nlabels && x->attributes.labels[label].face <= f; label++)
            x->attributes.labels[label].face = nf;
        for (size_t k = 0; k < n; k++) {
            if (uv) uv[corners + k] = uv_of(x, m->vert[start + k]);
            m->vert[corners + k] = number[m->vert[start + k]];
        }
        if (n <= 3)
            for (size_t k = 0; k < n; k++) distinct &= m->vert[corners + k] != m->vert[corners + (k + 1) % n];
        if (!distinct) continue;
        m->start[nf++] = (uint32_t)corners;
        corners += n;
    }
    const size_t dropped = m->nf - nf;
    if (m->start) m->start[nf] = (uint32_t)corners;
    m->nf = nf;
    while (label < x->attributes.nlabels) x->attributes.labels[label++].face = nf;
    return dropped;
}

/* In OBJ and in the stream v grows upwards, in glTF downwards. */
static int take_uv(vgi_gltf_scene *x, const vg_mesh *m, vg_err *e)
{
    vg_attributes *a = &x->attributes;
    if (!x->nuv || x->nuv >= UINT32_MAX) return VG_OK;
    a->tex = vgi_array_raw(x->nuv, 2 * sizeof *a->tex, e);
    a->corner_tex = vgi_array_raw(vg_mesh_corners(m), sizeof *a->corner_tex, e);
    if (!a->tex || !a->corner_tex) return VG_ENOMEM;
    a->ntex = x->nuv, a->tex_dim = 2;
    for (size_t i = 0; i < x->nparts; i++) {
        const vgi_gltf_part *p = &x->parts[i];
        for (size_t v = 0; p->textured && v < p->count; v++) {
            double *to = a->tex + 2 * (p->first_uv + v);
            vgi_accessor_get(&p->uv, v, to);
            if (!vgi_finite(to, 2)) to[0] = 0, to[1] = 1;
            to[1] = 1 - to[1];
        }
    }
    return VG_OK;
}

static int begin_colours(vg_attributes *a, size_t n, vg_err *e)
{
    if (!(a->colours = vgi_array_raw(n, 4, e))) return VG_ENOMEM;
    a->ncolours = n;
    memset(a->colours, 255, 4 * n);
    return VG_OK;
}

/* Of vertices of the file that are one vertex of the mesh, the first one gives the colour. */
static int take_colours(vgi_gltf_scene *x, size_t n, vg_err *e)
{
    vg_attributes *a = &x->attributes;
    int r = VG_OK;
    for (size_t i = x->nparts; i-- > 0 && r == VG_OK;) {
        const vgi_gltf_part *p = &x->parts[i];
        const vgi_json *ref = vgi_json_get(p->attributes, "COLOR_0");
        vgi_accessor c;
        if (!ref || (vgi_gltf_accessor(&x->g, ref, 4, p->count, "colours", &c, NULL) < 0 &&
                     vgi_gltf_accessor(&x->g, ref, 3, p->count, "colours", &c, NULL) < 0))
            continue;
        if (!a->ncolours && (r = begin_colours(a, n, e)) < 0) break;
        for (size_t v = p->count; v-- > 0;) {
            double rgba[4] = {0, 0, 0, 1};
            const size_t number = x->number[p->first + v];
            uint8_t *to = a->colours + 4 * number;
            if (number >= n) continue;
            vgi_accessor_get(&c, v, rgba);
            for (int k = 0; k < 3; k++) to[k] = vgi_srgb_of_linear(rgba[k]);
            to[3] = vgi_byte_of(rgba[3]);
        }
    }
    return r;
}

static int weld_parts(vgi_gltf_scene *x, const welding *k, size_t *n, vg_err *e)
{
    int r = VG_OK;
    *n = 0;
    for (size_t i = 0; i < x->nparts && r == VG_OK; i++) r = weld_part(x, k, &x->parts[i], n, e);
    return r;
}

static int weld_vertices(vgi_gltf_scene *x, vg_mesh *m, vg_err *e)
{
    welding k = {.x = x, .nslots = 4};
    while (k.nslots < 2 * x->all) k.nslots *= 2;
    k.slots = vgi_array(k.nslots, sizeof *k.slots, e), k.number = x->number = vgi_array_raw(x->all, sizeof *k.number, e);
    int r = k.slots && k.number ? VG_OK : VG_ENOMEM;
    size_t own = r == VG_OK ? own_vertices(x, k.number) : 0, n = own;
    if (r == VG_OK && !n) n = vertices_of_like(x, m, k.number, k.slots);
    if (r == VG_OK && !n) n = vertices_of_asset(x, k.number, k.slots);
    if (own) r = keep_first(&x->parts[0], n, e);
    else if (n) r = keep_listed(x, k.slots, n, e);
    else if (r == VG_OK) {
        memset(k.slots, 0, k.nslots * sizeof *k.slots);
        r = weld_parts(x, &k, &n, e);
    }
    if (r == VG_OK) r = take_uv(x, m, e);
    if (r == VG_OK) x->dropped = renumber_faces(x, m, k.number, x->attributes.corner_tex);
    if (r == VG_OK) r = take_colours(x, n, e);
    m->nv = n;
    free(k.slots);
    return r;
}

int vgi_gltf_mend(vgi_gltf_scene *x, vgi_gltf_faces *f, vg_err *e)
{
    int r = restore_polygons(x, f, e);
    return r < 0 ? r : weld_vertices(x, &f->mesh, e);
}
