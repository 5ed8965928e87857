/* mend.c: repairs faces that are valid in a file but not in a mesh: those with fewer than 2 corners, and those that
 * name a vertex twice. All formats use it, so that they treat such faces alike.
 *
 * A vertex named twice in a row is kept once. A face with fewer than two distinct corners, or one that follows an
 * edge and returns along it, is dropped. A face with a hole has a bridge to the hole, whose ends are named twice:
 * ears are cut off as triangles until the rest names no vertex twice.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"
#include "io/polygon.h"
#include "numeric/face.h"
#include "numeric/stats.h"

#include <stdarg.h>
#include <stdlib.h>

void vgi_note(vg_note *to, const char *format, ...)
{
    size_t n = strlen(to->text);
    va_list list;
    if (n && n + 2 < sizeof to->text) memcpy(to->text + n, "; ", 3), n += 2;
    va_start(list, format);
    vsnprintf(to->text + n, sizeof to->text - n, format, list);
    va_end(list);
}

void vgi_note_dropped(vg_note *to, size_t n)
{
    if (n)
        vgi_note(to, "left out %zu face%s that name%s a vertex twice or ha%s fewer than 2 corners", n,
                 n == 1 ? "" : "s", n == 1 ? "s" : "", n == 1 ? "s" : "ve");
}

/* A corner: its vertex, and its index in the old mesh, with which its texture coordinate is found. */
typedef struct corner {
    uint32_t vertex, old;
} corner;

typedef struct mending {
    const vg_mesh *from;
    const double *points;
    corner *ring;       /* the remainder of the current face, n corners */
    uint32_t *vertices; /* the same as vertices alone, for polygon.h; or sorted */
    size_t n, ring_cap, vertices_cap;
    vg_mesh to;
    size_t start_cap, vert_cap, old_cap;
    uint32_t *old;      /* per corner of `to` */
    size_t dropped, shortened, cut, pieces;
} mending;

static bool ring_repeats(mending *k)
{
    for (size_t i = 0; i < k->n; i++) k->vertices[i] = k->ring[i].vertex;
    qsort(k->vertices, k->n, sizeof *k->vertices, vgi_by_index);
    for (size_t i = 1; i < k->n; i++)
        if (k->vertices[i] == k->vertices[i - 1]) return true;
    return false;
}

static void remove_corner(mending *k, size_t i)
{
    memmove(k->ring + i, k->ring + i + 1, (k->n - i - 1) * sizeof *k->ring);
    k->n--;
}

/* Remove repeated vertices, and edges that are followed in both directions. */
static void tidy_ring(mending *k)
{
    size_t quiet = 0; /* corners visited since the last change */
    for (size_t i = 0; k->n > 1 && quiet <= k->n; i = k->n ? (i + 1) % k->n : 0) {
        size_t next = (i + 1) % k->n, after = (i + 2) % k->n;
        quiet++;
        if (k->ring[i].vertex == k->ring[next].vertex) {
            remove_corner(k, next ? next : i);
            i = quiet = 0;
        } else if (k->n > 2 && k->ring[i].vertex == k->ring[after].vertex) {
            remove_corner(k, next > after ? next : after);
            remove_corner(k, next > after ? after : next);
            i = quiet = 0;
        }
    }
}

static int add_face(mending *k, const corner *at, size_t n, vg_err *e)
{
    vg_mesh *m = &k->to;
    const size_t corners = vg_mesh_corners(m);
    if (n >= UINT32_MAX - corners) return vg_fail(e, VG_EINPUT, "a mesh has too many corners of faces");
    int r = vgi_grow(&m->start, &k->start_cap, m->nf + 2, sizeof *m->start, e);
    if (r == VG_OK) r = vgi_grow(&m->vert, &k->vert_cap, corners + n, sizeof *m->vert, e);
    if (r == VG_OK) r = vgi_grow(&k->old, &k->old_cap, corners + n, sizeof *k->old, e);
    for (size_t i = 0; i < n && r == VG_OK; i++) m->vert[corners + i] = at[i].vertex, k->old[corners + i] = at[i].old;
    if (r < 0) return r;
    m->start[m->nf] = (uint32_t)corners;
    m->start[++m->nf] = (uint32_t)(corners + n);
    return VG_OK;
}

/* The corner to cut off next: an ear, or if there is none (the face crosses itself) any with three vertices. */
static size_t find_ear(mending *k, const double normal[3])
{
    for (size_t i = 0; i < k->n; i++) k->vertices[i] = k->ring[i].vertex;
    if (k->n <= VGI_MOST_CLIPPED)
        for (size_t i = 0; i < k->n; i++)
            if (vgi_is_ear(k->points, k->vertices, k->n, i, normal)) return i;
    for (size_t i = 0; i < k->n; i++)
        if (k->vertices[(i + k->n - 1) % k->n] != k->vertices[(i + 1) % k->n]) return i;
    return k->n;
}

static int cut_ears(mending *k, vg_err *e)
{
    double normal[3];
    int r = VG_OK;
    for (size_t i = 0; i < k->n; i++) k->vertices[i] = k->ring[i].vertex;
    vgi_face_area(k->points, k->vertices, k->n, normal);
    k->cut++;
    for (bool more = true; more && r == VG_OK; tidy_ring(k), more = k->n > 2 && ring_repeats(k)) {
        size_t i = find_ear(k, normal);
        if (i == k->n) return VG_OK;
        const corner ear[3] = {k->ring[(i + k->n - 1) % k->n], k->ring[i], k->ring[(i + 1) % k->n]};
        r = add_face(k, ear, 3, e);
        k->pieces++;
        remove_corner(k, i);
    }
    if (r < 0 || k->n < 3) return r;
    k->pieces++;
    return add_face(k, k->ring, k->n, e);
}

static int mend_face(mending *k, size_t face, vg_err *e)
{
    const size_t first = k->from->start[face], n = k->from->start[face + 1] - first;
    int r = vgi_grow(&k->ring, &k->ring_cap, n, sizeof *k->ring, e);
    if (r == VG_OK) r = vgi_grow(&k->vertices, &k->vertices_cap, n, sizeof *k->vertices, e);
    if (r < 0) return r;
    for (size_t i = 0; i < n; i++) k->ring[i] = (corner){k->from->vert[first + i], (uint32_t)(first + i)};
    k->n = n;
    if (n >= 2 && !ring_repeats(k)) return add_face(k, k->ring, n, e);
    tidy_ring(k);
    if (n < 2 || k->n < (n == 2 ? 2 : 3)) return k->dropped++, VG_OK;
    if (ring_repeats(k)) return cut_ears(k, e);
    k->shortened++;
    return add_face(k, k->ring, k->n, e);
}

/* A label stays at its face, or at the first one made from it. face_at: new index of each old face. */
static void move_labels(vg_attributes *a, const uint64_t *face_at, size_t nf)
{
    for (size_t i = 0; i < a->nlabels; i++)
        a->labels[i].face = face_at[a->labels[i].face < nf ? a->labels[i].face : nf];
}

static int move_texture(vg_attributes *a, const mending *k, vg_err *e)
{
    const size_t corners = vg_mesh_corners(&k->to);
    if (!a->corner_tex) return VG_OK;
    uint32_t *tex = vgi_array_raw(corners, sizeof *tex, e);
    if (!tex) return VG_ENOMEM;
    for (size_t c = 0; c < corners; c++) tex[c] = a->corner_tex[k->old[c]];
    free(a->corner_tex);
    a->corner_tex = tex;
    return VG_OK;
}

static int mend_all(mending *k, vg_attributes *a, vg_err *e)
{
    const vg_mesh *m = k->from;
    uint64_t *face_at = vgi_array_raw(m->nf + 1, sizeof *face_at, e);
    int r = face_at ? vgi_grow(&k->to.start, &k->start_cap, 1, sizeof *k->to.start, e) : VG_ENOMEM;
    if (r == VG_OK) k->to.start[0] = 0;
    for (size_t f = 0; f < m->nf && r == VG_OK; f++) {
        face_at[f] = k->to.nf;
        r = mend_face(k, f, e);
    }
    if (r == VG_OK && a) r = move_texture(a, k, e);
    if (r == VG_OK) face_at[m->nf] = k->to.nf;
    if (r == VG_OK && a) move_labels(a, face_at, m->nf);
    free(face_at);
    return r;
}

static bool in_range(const vg_mesh *m)
{
    const size_t corners = vg_mesh_corners(m);
    for (size_t c = 0; c < corners; c++)
        if (m->vert[c] >= m->nv) return false;
    return true;
}

static void note_mending(const mending *k, vg_note *notes)
{
    vgi_note_dropped(notes, k->dropped);
    if (k->shortened)
        vgi_note(notes, "%zu face%s a vertex twice in a row, which is kept once", k->shortened,
                 k->shortened == 1 ? " names" : "s name");
    if (k->cut)
        vgi_note(notes, "cut %zu face%s a vertex twice (around a hole) into %zu", k->cut,
                 k->cut == 1 ? " that names" : "s that name", k->pieces);
}

int vgi_mend_faces(vg_mesh *m, const double *points, vg_attributes *a, vg_note *notes, const char *subject,
                   vg_err *e)
{
    vg_err cause;
    int r = vg_mesh_check(m, subject, &cause);
    if (r != VG_EINPUT || !in_range(m)) {
        if (r < 0 && e) *e = cause;
        return r;
    }
    mending k = {.from = m, .points = points, .to = {.nv = m->nv}};
    r = mend_all(&k, a, e);
    if (r == VG_OK) {
        vg_mesh_take(m, &k.to);
        note_mending(&k, notes);
        r = vg_mesh_check(m, subject, e);
    }
    vg_mesh_clear(&k.to);
    free(k.ring);
    free(k.vertices);
    free(k.old);
    return r;
}
