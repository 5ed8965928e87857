/* mirror.c: mirror symmetry of a body: pairs of vertices that mirroring exchanges, and mirrored poses.
 * The rest pose must be symmetric; otherwise the pairs must be given.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/pairs/surface.h"
#include "numeric/kdtree.h"
#include "numeric/stats.h"
#include "numeric/vec3.h"

#include <stdlib.h>

enum { NEAREST = 6, ROUNDS = 20 };
static const double FAR = 0.02;     /* in D: largest distance between a vertex and its mirrored partner */
static const double TURNED = 1e-3;  /* in D: weight of the difference of two unit normals */

typedef struct candidate {
    double cost;
    uint32_t a, b; /* a <= b */
} candidate;

typedef struct search {
    vg_mirror *m;
    const double *points, *normals;
    double diagonal;
    vgi_kdtree *tree;
    candidate *at;
    size_t n;
} search;

void vg_mirror_clear(vg_mirror *m)
{
    free(m->partner);
    *m = (vg_mirror){0};
}

static void reflect(const vg_mirror *m, const double x[3], double y[3])
{
    for (size_t k = 0; k < 3; k++) y[k] = k == m->axis ? 2 * m->plane - x[k] : x[k];
}

void vg_mirror_pose(const vg_mirror *m, const double *in, double *out)
{
    for (size_t v = 0; v < m->nv; v++) reflect(m, in + 3 * (size_t)m->partner[v], out + 3 * v);
}

/* ---- the plane ---- */

static double middle_of_box(const double *points, size_t nv, size_t axis)
{
    double least = nv ? points[axis] : 0, most = least;
    for (size_t v = 1; v < nv; v++) {
        least = fmin(least, points[3 * v + axis]);
        most = fmax(most, points[3 * v + axis]);
    }
    return (least + most) / 2;
}

/* Move the plane from the middle of the bounding box to the median midpoint between vertices and their mirror
 * images. */
static int find_plane(search *s, vg_err *e)
{
    vg_mirror *m = s->m;
    double *middle = vgi_array_raw(m->nv, sizeof *middle, e), before;
    if (!middle) return VG_ENOMEM;
    m->plane = middle_of_box(s->points, m->nv, m->axis);
    for (int round = 0; m->nv && round < ROUNDS; round++) {
        before = m->plane;
        for (size_t v = 0; v < m->nv; v++) {
            double image[3];
            vgi_near near = {0};
            reflect(m, s->points + 3 * v, image);
            vgi_kdtree_nearest(s->tree, image, INFINITY, 1, &near);
            middle[v] = (s->points[3 * v + m->axis] + s->points[3 * (size_t)near.index + m->axis]) / 2;
        }
        m->plane = vgi_median(middle, m->nv);
        if (!(fabs(m->plane - before) > 1e-9 * s->diagonal)) break;
    }
    free(middle);
    return VG_OK;
}

/* ---- partners ---- */

static double cost_of(const search *s, uint32_t a, uint32_t b, double square)
{
    double n[3], unit = TURNED * s->diagonal;
    memcpy(n, s->normals + 3 * (size_t)a, sizeof n);
    n[s->m->axis] = -n[s->m->axis];
    return square + unit * unit * vgi_square(n, s->normals + 3 * (size_t)b);
}

static void find_candidates(search *s)
{
    double limit = FAR * s->diagonal * FAR * s->diagonal;
    for (size_t v = 0; v < s->m->nv; v++) {
        double image[3];
        vgi_near near[NEAREST];
        reflect(s->m, s->points + 3 * v, image);
        size_t n = vgi_kdtree_nearest(s->tree, image, limit, NEAREST, near);
        for (size_t i = 0; i < n; i++) {
            uint32_t a = (uint32_t)v, b = near[i].index;
            s->at[s->n++] = (candidate){cost_of(s, a, b, near[i].square), a < b ? a : b, a < b ? b : a};
        }
    }
}

static int compare_candidates(const void *x, const void *y)
{
    const candidate *a = x, *b = y;
    if (a->cost != b->cost) return a->cost < b->cost ? -1 : 1;
    if (a->a != b->a) return a->a < b->a ? -1 : 1;
    return a->b < b->b ? -1 : a->b > b->b;
}

/* Accept the cheapest pairs first; a vertex has one partner. */
static void take_candidates(search *s)
{
    vg_mirror *m = s->m;
    if (s->n) qsort(s->at, s->n, sizeof *s->at, compare_candidates);
    for (size_t i = 0; i < s->n; i++) {
        const candidate *c = &s->at[i];
        if (m->partner[c->a] != UINT32_MAX || m->partner[c->b] != UINT32_MAX) continue;
        m->partner[c->a] = c->b, m->partner[c->b] = c->a;
    }
}

/* Pair the vertices whose nearest candidates were already taken. */
static int pair_rest(search *s, vg_err *e)
{
    enum { MOST = 1000 };
    vg_mirror *m = s->m;
    uint32_t rest[MOST];
    size_t n = 0;
    for (size_t v = 0; v < m->nv; v++)
        if (m->partner[v] == UINT32_MAX && n < MOST) rest[n++] = (uint32_t)v;
    double limit = FAR * s->diagonal * FAR * s->diagonal;
    free(s->at);
    s->n = 0;
    s->at = vgi_array_raw(n * (n + 1) / 2, sizeof *s->at, e);
    if (!s->at) return VG_ENOMEM;
    for (size_t i = 0; i < n; i++)
        for (size_t k = i; k < n; k++) {
            double image[3];
            reflect(m, s->points + 3 * (size_t)rest[i], image);
            double square = vgi_square(image, s->points + 3 * (size_t)rest[k]);
            if (square < limit) s->at[s->n++] = (candidate){cost_of(s, rest[i], rest[k], square), rest[i], rest[k]};
        }
    take_candidates(s);
    return VG_OK;
}

static int check_all_paired(const vg_mirror *m, vg_err *e)
{
    size_t alone = 0, first = 0;
    for (size_t v = m->nv; v-- > 0;)
        if (m->partner[v] == UINT32_MAX) alone++, first = v;
    if (!alone) return VG_OK;
    return vg_fail(e, VG_EINPUT,
                   "the rest pose is not symmetric: %zu of %zu vertices have no partner on the other side within 2 %% of D "
                   "(the first is vertex %zu)",
                   alone, m->nv, first);
}

static int search_partners(search *s, const vg_mesh *mesh, vg_err *e)
{
    vgi_surface *surface = NULL;
    int r = vgi_kdtree_new(&s->tree, s->points, s->m->nv, e);
    if (r == VG_OK) r = vgi_surface_new(&surface, mesh, s->points, e);
    if (r < 0) goto out;
    s->normals = vgi_surface_vertex_normals(surface);
    s->at = vgi_array_raw(s->m->nv * NEAREST, sizeof *s->at, e);
    r = s->at ? find_plane(s, e) : VG_ENOMEM;
    if (r < 0) goto out;
    find_candidates(s);
    take_candidates(s);
    r = pair_rest(s, e);
    if (r == VG_OK) r = check_all_paired(s->m, e);
out:
    vgi_surface_free(&surface);
    vgi_kdtree_free(&s->tree);
    free(s->at);
    return r;
}

static int pair_up(vg_mirror *m, uint32_t v, uint32_t other, vg_err *e)
{
    if (v >= m->nv) return vg_fail(e, VG_EINPUT, "there is no vertex %u: there are %zu, counted from 0", v, m->nv);
    if (m->partner[v] == other && v != other) return vg_fail(e, VG_EINPUT, "vertices %u and %u are paired twice", v, other);
    if (m->partner[v] != UINT32_MAX && m->partner[v] != other)
        return vg_fail(e, VG_EINPUT, "vertex %u has two partners, %u and %u", v, m->partner[v], other);
    m->partner[v] = other;
    return VG_OK;
}

static int take_pairs(search *s, const vg_markers *pairs, vg_err *e)
{
    vg_mirror *m = s->m;
    double *middle = vgi_array_raw(m->nv, sizeof *middle, e);
    int r = middle ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; i < pairs->n && r == VG_OK; i++) {
        uint32_t a = pairs->at[i].source, b = pairs->at[i].target;
        r = pair_up(m, a, b, e);
        if (r == VG_OK && a != b) r = pair_up(m, b, a, e);
    }
    for (size_t v = 0; v < m->nv && r == VG_OK; v++) {
        if (m->partner[v] == UINT32_MAX) m->partner[v] = (uint32_t)v;
        middle[v] = (s->points[3 * v + m->axis] + s->points[3 * (size_t)m->partner[v] + m->axis]) / 2;
    }
    if (m->nv && r == VG_OK) m->plane = vgi_median(middle, m->nv);
    free(middle);
    return r;
}

/* ---- quality of the pairs ---- */

static void measure_pairs(search *s)
{
    vg_mirror *m = s->m;
    for (size_t v = 0; v < m->nv; v++) {
        double image[3];
        reflect(m, s->points + 3 * (size_t)m->partner[v], image);
        double d = sqrt(vgi_square(image, s->points + 3 * v));
        m->mean += d / (double)m->nv;
        if (d > m->largest) m->largest = d, m->farthest = (uint32_t)v;
    }
}

static int compare_edges(const void *x, const void *y)
{
    uint64_t a = *(const uint64_t *)x, b = *(const uint64_t *)y;
    return a < b ? -1 : a > b;
}

static uint64_t edge_of(uint32_t a, uint32_t b)
{
    return a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
}

static int count_broken(vg_mirror *m, const vg_mesh *mesh, vg_err *e)
{
    size_t n = 0;
    uint64_t *edge = vgi_array_raw(vg_mesh_corners(mesh), sizeof *edge, e);
    if (!edge) return VG_ENOMEM;
    for (size_t f = 0; f < mesh->nf; f++)
        for (uint32_t c = mesh->start[f]; c < mesh->start[f + 1]; c++)
            edge[n++] = edge_of(mesh->vert[c], mesh->vert[c + 1 < mesh->start[f + 1] ? c + 1 : mesh->start[f]]);
    if (n) qsort(edge, n, sizeof *edge, compare_edges);
    for (size_t i = 0; i < n; i++) {
        if (i && edge[i] == edge[i - 1]) continue;
        uint64_t image = edge_of(m->partner[edge[i] >> 32], m->partner[edge[i] & UINT32_MAX]);
        m->edges++, m->broken += !bsearch(&image, edge, n, sizeof *edge, compare_edges);
    }
    free(edge);
    return VG_OK;
}

int vg_mirror_find(vg_mirror *m, const vg_mesh *mesh, const double *points, size_t axis, const vg_markers *pairs, vg_err *e)
{
    search s = {.m = m, .points = points, .diagonal = vg_diagonal(points, mesh->nv)};
    *m = (vg_mirror){.nv = mesh->nv, .axis = axis};
    m->partner = vgi_array_raw(mesh->nv, sizeof *m->partner, e);
    if (!m->partner) return VG_ENOMEM;
    memset(m->partner, 0xff, mesh->nv * sizeof *m->partner);
    int r = pairs ? take_pairs(&s, pairs, e) : search_partners(&s, mesh, e);
    if (r == VG_OK) measure_pairs(&s), r = count_broken(m, mesh, e);
    if (r < 0) vg_mirror_clear(m);
    return r;
}
