/* mesh.c: a mesh of faces of mixed sizes, as offsets and indices: validity, equality, components, size. Attributes
 * and poses are in head.c, vectors in graph.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"
#include "numeric/vec3.h"
#include "numeric/sets.h"
#include "numeric/stats.h"

#include <math.h>
#include <stdlib.h>

size_t vg_mesh_corners(const vg_mesh *m)
{
    return m->nf ? m->start[m->nf] : 0;
}

void vg_mesh_clear(vg_mesh *m)
{
    free(m->start);
    free(m->vert);
    *m = (vg_mesh){0};
}

int vg_mesh_copy(vg_mesh *to, const vg_mesh *from, vg_err *e)
{
    static const uint32_t none = 0;
    *to = (vg_mesh){.nv = from->nv, .nf = from->nf};
    to->start = vgi_copy_array(from->nf ? from->start : &none, from->nf + 1, sizeof *to->start, e);
    to->vert = vgi_copy_array(from->vert, vg_mesh_corners(from), sizeof *to->vert, e);
    if (to->start && to->vert) return VG_OK;
    vg_mesh_clear(to);
    return VG_ENOMEM;
}

/* Whether a vertex occurs twice in this face: small faces by comparing pairs, large ones by sorting into `sorted`.
 * No array over all vertices is used, since nv may still be wrong. */
static bool repeats(const uint32_t *vert, size_t size, uint32_t *sorted)
{
    if (!sorted) {
        for (size_t i = 1; i < size; i++)
            for (size_t j = 0; j < i; j++)
                if (vert[i] == vert[j]) return true;
        return false;
    }
    memcpy(sorted, vert, size * sizeof *vert);
    qsort(sorted, size, sizeof *sorted, vgi_by_index);
    for (size_t i = 1; i < size; i++)
        if (sorted[i] == sorted[i - 1]) return true;
    return false;
}

int vg_mesh_check(const vg_mesh *m, const char *subject, vg_err *e)
{
    enum { SMALL = 16 };
    if (m->nv >= UINT32_MAX || m->nf >= UINT32_MAX || vg_mesh_corners(m) >= UINT32_MAX)
        return vg_fail(e, VG_EINPUT, "%s has too many vertices, faces or corners (the limit is 2^32 - 2)", subject);
    uint32_t *sorted = NULL;
    size_t cap = 0;
    int r = VG_OK;
    for (size_t f = 0; f < m->nf && r == VG_OK; f++) {
        size_t size = m->start[f + 1] - m->start[f];
        if (m->start[f + 1] < m->start[f] || size < 2)
            return free(sorted), vg_fail(e, VG_EINPUT, "%s: face %zu has fewer than 2 vertices", subject, f);
        const uint32_t *vert = m->vert + m->start[f]; /* NULL only without corners */
        for (size_t i = 0; i < size; i++)
            if (vert[i] >= m->nv)
                return free(sorted),
                       vg_fail(e, VG_EINPUT, "%s: face %zu names vertex %u of %zu", subject, f, vert[i], m->nv);
        if (size > SMALL) r = vgi_grow(&sorted, &cap, size, sizeof *sorted, e);
        if (r == VG_OK && repeats(vert, size, size > SMALL ? sorted : NULL))
            r = vg_fail(e, VG_EINPUT, "%s: face %zu names a vertex twice", subject, f);
    }
    free(sorted);
    return r;
}

int vg_mesh_same(const vg_mesh *a, const char *a_name, const vg_mesh *b, const char *b_name, vg_err *e)
{
    if (a->nv != b->nv)
        return vg_fail(e, VG_EINPUT, "%s has %zu vertices where %s has %zu", b_name, b->nv, a_name, a->nv);
    if (a->nf != b->nf)
        return vg_fail(e, VG_EINPUT, "%s has %zu faces where %s has %zu", b_name, b->nf, a_name, a->nf);
    if (a->nf == 0) return VG_OK;
    size_t corners = vg_mesh_corners(a);
    if (!memcmp(a->start, b->start, (a->nf + 1) * sizeof *a->start) &&
        !memcmp(a->vert, b->vert, corners * sizeof *a->vert))
        return VG_OK;
    for (size_t f = 0; f < a->nf; f++) {
        uint32_t na = a->start[f + 1] - a->start[f], nb = b->start[f + 1] - b->start[f];
        if (na != nb)
            return vg_fail(e, VG_EINPUT, "face %zu of %s has %u corners where that of %s has %u", f, b_name, nb,
                           a_name, na);
        for (uint32_t i = 0; i < na; i++) {
            uint32_t va = a->vert[a->start[f] + i], vb = b->vert[b->start[f] + i];
            if (va != vb)
                return vg_fail(e, VG_EINPUT, "face %zu of %s names vertex %u where that of %s names %u", f, b_name,
                               vb, a_name, va);
        }
    }
    return VG_OK;
}

int vg_mesh_components(const vg_mesh *m, uint32_t *label, size_t *count, vg_err *e)
{
    uint32_t *parent = vgi_array_raw(m->nv, sizeof *parent, e);
    if (!parent) return VG_ENOMEM;
    vgi_sets_init(parent, m->nv);
    for (size_t v = 0; v < m->nv; v++) label[v] = UINT32_MAX;
    for (size_t f = 0; f < m->nf; f++)
        for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++) {
            label[m->vert[c]] = 0;
            vgi_sets_join(parent, m->vert[m->start[f]], m->vert[c]);
        }
    /* a set is named by its lowest vertex, so that labels are in order of first vertex */
    size_t n = 0;
    for (uint32_t v = 0; v < m->nv; v++) {
        if (label[v] == UINT32_MAX) continue;
        uint32_t lowest = vgi_sets_find(parent, v);
        label[v] = lowest == v ? (uint32_t)n++ : label[lowest];
    }
    free(parent);
    *count = n;
    return VG_OK;
}

double vg_diagonal(const double *points, size_t n)
{
    double sum = 0;
    for (int k = 0; n && k < 3; k++) {
        double least = points[k], most = points[k];
        for (size_t i = 1; i < n; i++) {
            least = fmin(least, points[3 * i + k]);
            most = fmax(most, points[3 * i + k]);
        }
        sum += (most - least) * (most - least);
    }
    return sqrt(sum);
}

void vg_centroid(const double *points, size_t n, double centroid[3])
{
    double sum[3] = {0, 0, 0};
    for (size_t i = 0; i < n; i++)
        vgi_add(sum, points + 3 * i);
    for (int k = 0; k < 3; k++) centroid[k] = n ? sum[k] / (double)n : 0;
}
