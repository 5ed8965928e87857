/* figure.c: the drawable form of a mesh: faces around vertices, smooth normals with creases, triangles. Projection is
 * in camera.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/view.h"

#include <math.h>

/* Faces that meet at less than this angle are shaded as one smooth surface: a limb with eight faces around it (45
 * degrees) stays round, a box keeps its edges. */
#define CREASE_COSINE 0.64f /* 50 degrees */

/* Around a vertex with more faces than this all faces are smoothed; comparing every pair would take too long. */
enum { MOST_COMPARED = 64 };

bool *vgi_drawn_vertices(const vg_mesh *m, vg_err *e)
{
    bool *drawn = vgi_array(m->nv, sizeof *drawn, e);
    if (!drawn) return NULL;
    for (size_t c = 0; c < vg_mesh_corners(m); c++) drawn[m->vert[c]] = true;
    if (m->nf == 0) memset(drawn, 1, m->nv);
    return drawn;
}

double vgi_ground_height(const bool *drawn, size_t nv, const double *points, bool z_up)
{
    double least = INFINITY;
    for (size_t v = 0; v < nv; v++)
        if (drawn[v]) least = fmin(least, points[3 * v + (z_up ? 2 : 1)]);
    return isfinite(least) ? least : 0;
}

static void count_ring(vgi_figure *g)
{
    const vg_mesh *m = g->mesh;
    for (size_t f = 0; f < m->nf; f++) {
        size_t n = m->start[f + 1] - m->start[f];
        if (n > g->max_corners) g->max_corners = n;
        for (size_t c = m->start[f]; n > 2 && c < m->start[f + 1]; c++) g->ring_start[m->vert[c] + 1]++;
    }
    for (size_t v = 0; v < m->nv; v++) g->ring_start[v + 1] += g->ring_start[v];
}

static void fill_ring(vgi_figure *g)
{
    const vg_mesh *m = g->mesh;
    for (size_t f = 0; f < m->nf; f++)
        if (m->start[f + 1] - m->start[f] > 2)
            for (size_t c = m->start[f]; c < m->start[f + 1]; c++) g->ring[g->ring_start[m->vert[c]]++] = (uint32_t)f;
    for (size_t f = m->nf; f-- > 0;)
        if (m->start[f + 1] - m->start[f] > 2)
            for (size_t c = m->start[f]; c < m->start[f + 1]; c++) g->first[m->vert[c]] = (uint32_t)c;
    /* filling has moved each start to its end, which is the start of the next */
    for (size_t v = m->nv; v > 0; v--) g->ring_start[v] = g->ring_start[v - 1];
    g->ring_start[0] = 0;
}

int vgi_figure_init(vgi_figure *g, const vg_mesh *m, vg_err *e)
{
    *g = (vgi_figure){.mesh = m};
    g->ring_start = vgi_array(m->nv + 1, sizeof *g->ring_start, e);
    g->ring = vgi_array(vg_mesh_corners(m), sizeof *g->ring, e);
    g->first = vgi_array(m->nv, sizeof *g->first, e);
    g->drawn = vgi_drawn_vertices(m, e);
    if (!g->ring_start || !g->ring || !g->first || !g->drawn) {
        vgi_figure_clear(g);
        return VG_ENOMEM;
    }
    count_ring(g);
    fill_ring(g);
    return VG_OK;
}

void vgi_figure_clear(vgi_figure *g)
{
    free(g->ring_start);
    free(g->ring);
    free(g->first);
    free(g->drawn);
    free(g->side);
    *g = (vgi_figure){0};
}

/* ---- sides ---- */

static int compare_sides(const void *a, const void *b)
{
    const vgi_side *p = a, *q = b;
    if (p->a != q->a) return p->a < q->a ? -1 : 1;
    if (p->b != q->b) return p->b < q->b ? -1 : 1;
    return (p->face > q->face) - (p->face < q->face);
}

int vgi_figure_sides(vgi_figure *g, vg_err *e)
{
    const vg_mesh *m = g->mesh;
    if (!(g->side = vgi_array_raw(vg_mesh_corners(m), sizeof *g->side, e))) return VG_ENOMEM;
    for (size_t f = 0; f < m->nf; f++) {
        size_t first = m->start[f], n = m->start[f + 1] - first;
        for (size_t i = 0; n > 2 && i < n; i++) {
            uint32_t a = m->vert[first + i], b = m->vert[first + (i + 1) % n];
            g->side[g->nsides++] = (vgi_side){a < b ? a : b, a < b ? b : a, (uint32_t)f, a < b};
        }
    }
    qsort(g->side, g->nsides, sizeof *g->side, compare_sides);
    return VG_OK;
}

/* ---- normals ---- */

static float dot3(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Newell: the area vector of a polygon that need not be planar, relative to its first corner so that no digits are
 * lost far from the origin. */
static void area_vector(const vg_mesh *m, size_t f, const float *points, float area[3])
{
    const uint32_t *v = m->vert + m->start[f];
    size_t n = m->start[f + 1] - m->start[f];
    const float *o = points + 3 * (size_t)v[0];
    area[0] = area[1] = area[2] = 0;
    for (size_t i = 1; i + 1 < n; i++) {
        const float *p = points + 3 * (size_t)v[i], *q = points + 3 * (size_t)v[i + 1];
        float a[3] = {p[0] - o[0], p[1] - o[1], p[2] - o[2]}, b[3] = {q[0] - o[0], q[1] - o[1], q[2] - o[2]};
        area[0] += a[1] * b[2] - a[2] * b[1];
        area[1] += a[2] * b[0] - a[0] * b[2];
        area[2] += a[0] * b[1] - a[1] * b[0];
    }
}

/* The normal of corner c. If all faces around the vertex are smoothed, it equals that of the vertex's first corner,
 * which is already computed. */
static void corner_normal(const vgi_figure *g, size_t f, size_t c, const float *face, float *normals)
{
    uint32_t v = g->mesh->vert[c];
    float *normal = normals + 3 * c;
    const float *own = face + 3 * f;
    float length = sqrtf(dot3(own, own)), sum[3] = {0, 0, 0};
    uint32_t first = g->ring_start[v], end = g->ring_start[v + 1];
    bool all = end - first > MOST_COMPARED;
    if (all && c != g->first[v]) {
        memcpy(normal, normals + 3 * (size_t)g->first[v], 3 * sizeof *normal);
        return;
    }
    for (uint32_t i = first; i < end; i++) {
        const float *other = face + 3 * (size_t)g->ring[i];
        if (all || dot3(own, other) >= CREASE_COSINE * length * sqrtf(dot3(other, other)))
            for (int k = 0; k < 3; k++) sum[k] += other[k];
    }
    float size = sqrtf(dot3(sum, sum));
    for (int k = 0; k < 3; k++) normal[k] = size > 0 ? sum[k] / size : 0;
}

void vgi_figure_normals(const vgi_figure *g, const float *points, float *face, float *normals)
{
    const vg_mesh *m = g->mesh;
    for (size_t f = 0; f < m->nf; f++) area_vector(m, f, points, face + 3 * f);
    for (size_t f = 0; f < m->nf; f++)
        for (size_t c = m->start[f]; c < m->start[f + 1]; c++) {
            if (m->start[f + 1] - m->start[f] > 2) corner_normal(g, f, c, face, normals);
            else normals[3 * c] = normals[3 * c + 1] = normals[3 * c + 2] = 0;
        }
}

/* ---- concave faces ---- */

typedef struct clipping {
    const double *xy;
    double sign;               /* +1: counter-clockwise */
    size_t *before, *after;    /* the remaining corners, as doubly linked ring */
    size_t *reflex, nreflex;   /* corners that may lie inside an ear */
} clipping;

static double signed_area(const clipping *k, size_t a, size_t b, size_t c)
{
    const double *p = k->xy + 2 * a, *q = k->xy + 2 * b, *r = k->xy + 2 * c;
    return k->sign * ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]));
}

static bool is_ear(const clipping *k, size_t b)
{
    size_t a = k->before[b], c = k->after[b];
    if (signed_area(k, a, b, c) <= 0) return false;
    for (size_t i = 0; i < k->nreflex; i++) {
        size_t p = k->reflex[i];
        if (p == a || p == b || p == c) continue;
        if (signed_area(k, a, b, p) >= 0 && signed_area(k, b, c, p) >= 0 && signed_area(k, c, a, p) >= 0) return false;
    }
    return true;
}

/* Clipping an ear can make corners convex but never reflex: drop those that became convex. */
static void drop_convex(clipping *k, size_t gone)
{
    size_t n = 0;
    for (size_t i = 0; i < k->nreflex; i++) {
        size_t p = k->reflex[i];
        if (p != gone && signed_area(k, k->before[p], p, k->after[p]) <= 0) k->reflex[n++] = p;
    }
    k->nreflex = n;
}

void vgi_ear_clip(const double *xy, size_t n, size_t *work, size_t *triangles)
{
    double area = 0;
    for (size_t i = 1; i + 1 < n; i++)
        area += (xy[2 * i] - xy[0]) * (xy[2 * i + 3] - xy[1]) - (xy[2 * i + 1] - xy[1]) * (xy[2 * i + 2] - xy[0]);
    clipping k = {.xy = xy, .sign = area < 0 ? -1 : 1, .before = work, .after = work + n, .reflex = work + 2 * n};
    for (size_t i = 0; i < n; i++) k.before[i] = (i + n - 1) % n, k.after[i] = (i + 1) % n;
    for (size_t i = 0; i < n; i++)
        if (signed_area(&k, k.before[i], i, k.after[i]) <= 0) k.reflex[k.nreflex++] = i;
    size_t b = 0;
    for (size_t left = n, t = 0; left > 2; left--, t++) {
        size_t tried = 0;
        while (tried < left && !is_ear(&k, b)) b = k.after[b], tried++;
        /* no ear: the polygon touches or crosses itself. Take any corner, so that the loop ends */
        size_t a = k.before[b], c = k.after[b];
        triangles[3 * t] = a, triangles[3 * t + 1] = b, triangles[3 * t + 2] = c;
        k.after[a] = c, k.before[c] = a;
        drop_convex(&k, b);
        b = k.after[c]; /* not the neighbour, because thin fans look worse */
    }
}
