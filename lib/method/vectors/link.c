/* link.c: links: virtual line segments that connect the components of a mesh, so that eyes, teeth and clothes keep
 * their position in the reconstruction (MATH 2). They form a minimum spanning tree of the components (Boruvka's
 * algorithm over a k-d tree); links too short to rotate steadily are then moved by one edge. Links are deformed in
 * deform.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"
#include "model/incidence.h"
#include "numeric/kdtree.h"
#include "numeric/sets.h"

#include <math.h>
#include <stdlib.h>

static const uint32_t NONE = UINT32_MAX;

/* A pair of points (indices into `vertex`), a < b. */
struct edge {
    double square;
    uint32_t a, b;
};

struct joining {
    const vg_mesh *m;
    double *x;        /* nv points, scaled so that squares neither overflow nor vanish */
    size_t n;         /* points: the vertices that are in a face */
    uint32_t *vertex; /* n */
    uint32_t *piece;  /* n: component of the point */
    uint32_t *tree;   /* n: the lowest component in the point's tree so far */
    uint32_t *sets;   /* per component */
    vgi_near *near;   /* n: the last search result for the point, see look_around */
    vgi_kdtree *points;
    struct edge *best;   /* per component that represents a tree: its shortest connection to another tree */
    struct edge *chosen; /* components - 1 */
    size_t components, nchosen;
    vgi_incidence around;
};

static void clear_joining(struct joining *j)
{
    free(j->x);
    free(j->vertex);
    free(j->piece);
    free(j->tree);
    free(j->sets);
    free(j->near);
    vgi_kdtree_free(&j->points);
    free(j->best);
    free(j->chosen);
    vgi_incidence_clear(&j->around);
}

/* The vertices divided by a power of two, which is exact, so that the largest coordinate is about 1. */
static int scale_vertices(struct joining *j, const double *vertices, vg_err *e)
{
    size_t n = 3 * j->m->nv;
    double most = 0;
    int exponent;
    if (!vgi_finite(vertices, n)) return vg_fail(e, VG_EARG, "cannot join components: a vertex is not finite");
    j->x = vgi_array_raw(n, sizeof *j->x, e);
    if (!j->x) return VG_ENOMEM;
    for (size_t i = 0; i < n; i++) most = fmax(most, fabs(vertices[i]));
    frexp(most, &exponent);
    for (size_t i = 0; i < n; i++) j->x[i] = ldexp(vertices[i], -exponent);
    return VG_OK;
}

/* Points are the vertices in faces; label is their component, NONE for all others. */
static int gather_points(struct joining *j, const uint32_t *label, vg_err *e)
{
    for (size_t v = 0; v < j->m->nv; v++) j->n += label[v] != NONE;
    j->vertex = vgi_array_raw(j->n, sizeof *j->vertex, e);
    j->piece = vgi_array_raw(j->n, sizeof *j->piece, e);
    j->tree = vgi_array_raw(j->n, sizeof *j->tree, e);
    j->near = vgi_array_raw(j->n, sizeof *j->near, e);
    double *position = vgi_array_raw(j->n, 3 * sizeof *position, e);
    int r = j->vertex && j->piece && j->tree && j->near && position ? VG_OK : VG_ENOMEM;
    for (size_t v = 0, i = 0; r == VG_OK && v < j->m->nv; v++) {
        if (label[v] == NONE) continue;
        j->vertex[i] = (uint32_t)v;
        j->piece[i] = label[v];
        j->near[i] = (vgi_near){NONE, -1};
        memcpy(position + 3 * i++, j->x + 3 * v, 3 * sizeof *position);
    }
    if (r == VG_OK) r = vgi_kdtree_new(&j->points, position, j->n, e);
    free(position);
    return r;
}

static int prepare_joining(struct joining *j, const double *vertices, const uint32_t *label, vg_err *e)
{
    int r = scale_vertices(j, vertices, e);
    if (r == VG_OK) r = gather_points(j, label, e);
    if (r == VG_OK) r = vgi_incidence_make(&j->around, j->m, e);
    if (r < 0) return r;
    j->sets = vgi_array_raw(j->components, sizeof *j->sets, e);
    j->best = vgi_array_raw(j->components, sizeof *j->best, e);
    j->chosen = vgi_array_raw(j->components - 1, sizeof *j->chosen, e);
    if (!j->sets || !j->best || !j->chosen) return VG_ENOMEM;
    vgi_sets_init(j->sets, j->components);
    return VG_OK;
}

/* ---- the minimum spanning tree ---- */

/* A total order of pairs, with ties broken by index, so that the shortest connections never form a cycle. Among the
 * points at equal distance from i the lowest one makes the smallest pair; the k-d tree returns that one. */
static bool shorter_edge(const struct edge *p, const struct edge *q)
{
    if (p->square != q->square) return p->square < q->square;
    return p->a != q->a ? p->a < q->a : p->b < q->b;
}

static void offer(struct joining *j, uint32_t from, vgi_near to)
{
    struct edge edge = {to.square, from < to.index ? from : to.index, from < to.index ? to.index : from};
    struct edge *best = &j->best[j->tree[from]];
    if (shorter_edge(&edge, best)) *best = edge;
}

/* Find the shortest connection of every tree. near[i] caches the last search result for point i: the nearest point of
 * another tree, or NONE if there was none within the squared distance. Because trees only grow, that point stays the
 * nearest until it joins i's tree, and its distance stays a lower bound. So most points are searched once. */
static void look_around(struct joining *j)
{
    for (size_t c = 0; c < j->components; c++) j->best[c] = (struct edge){INFINITY, NONE, NONE};
    for (size_t i = 0; i < j->n; i++)
        if (j->near[i].index != NONE && j->tree[j->near[i].index] != j->tree[i]) offer(j, (uint32_t)i, j->near[i]);
    for (size_t i = 0; i < j->n; i++) {
        vgi_near *near = &j->near[i];
        double best = j->best[j->tree[i]].square;
        bool known = near->index == NONE ? near->square >= best
                                         : j->tree[near->index] != j->tree[i] || near->square > best;
        if (known) continue;
        if (vgi_kdtree_nearest_other(j->points, j->x + 3 * (size_t)j->vertex[i], j->tree[i], best, near))
            offer(j, (uint32_t)i, *near);
    }
}

/* Boruvka: every tree takes its shortest connection, until one tree is left. Each round at least halves the number of
 * trees. */
static void span(struct joining *j)
{
    while (j->nchosen < j->components - 1) {
        for (size_t i = 0; i < j->n; i++) j->tree[i] = vgi_sets_find(j->sets, j->piece[i]);
        vgi_kdtree_label(j->points, j->tree);
        look_around(j);
        for (size_t c = 0; c < j->components; c++) {
            struct edge *best = &j->best[c];
            if (best->a != NONE && vgi_sets_join(j->sets, j->piece[best->a], j->piece[best->b]))
                j->chosen[j->nchosen++] = *best;
        }
    }
}

/* ---- the links ---- */

static double vertex_distance(const struct joining *j, uint32_t u, uint32_t v)
{
    const double *p = j->x + 3 * (size_t)u, *q = j->x + 3 * (size_t)v;
    return sqrt((p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]) + (p[2] - q[2]) * (p[2] - q[2]));
}

/* End of the corners around v that are examined: at a hub with thousands of faces, thousands of links may end. */
static uint32_t last_corner(const struct joining *j, uint32_t v)
{
    enum { ENOUGH = 64 };
    uint32_t first = j->around.first[v], last = j->around.first[v + 1];
    return last - first > ENOUGH ? first + ENOUGH : last;
}

static double mean_edge(const struct joining *j, uint32_t v)
{
    uint32_t first = j->around.first[v], last = last_corner(j, v), ends[2];
    double sum = 0;
    for (uint32_t i = first; i < last; i++) {
        vgi_corner_edges(j->m->start, j->m->vert, j->around.face[i], j->around.corner[i], ends);
        sum += vertex_distance(j, v, ends[0]) + vertex_distance(j, v, ends[1]);
    }
    return sum / (2.0 * (last - first));
}

/* Among b and its edge neighbours, the one farthest from a (the first of several). */
static uint32_t farthest_around(const struct joining *j, uint32_t a, uint32_t b)
{
    uint32_t last = last_corner(j, b), farthest = b, ends[2];
    double most = vertex_distance(j, a, b);
    for (uint32_t i = j->around.first[b]; i < last; i++) {
        vgi_corner_edges(j->m->start, j->m->vert, j->around.face[i], j->around.corner[i], ends);
        for (int k = 0; k < 2; k++) {
            double length = vertex_distance(j, a, ends[k]);
            if (length > most) most = length, farthest = ends[k];
        }
    }
    return farthest;
}

/* Turn a pair of nearest points into a link. When two components separate slightly, a link between points that nearly
 * touch rotates and stretches wildly, which has no meaning on another body. A link shorter than the adjacent edges
 * therefore ends one edge further, at the end with the longer edges, so that it rotates about as those edges do. This
 * also covers coincident points: a link of length 0 could never open. */
static void place_link(const struct joining *j, const struct edge *edge, uint32_t pair[2])
{
    uint32_t a = j->vertex[edge->a], b = j->vertex[edge->b];
    double length = vertex_distance(j, a, b), edge_a = mean_edge(j, a), edge_b = mean_edge(j, b);
    if (edge_a > edge_b && length < edge_a) a = farthest_around(j, b, a);
    else if (length < edge_b) b = farthest_around(j, a, b);
    pair[0] = a < b ? a : b;
    pair[1] = a < b ? b : a;
}

static int compare_pairs(const void *p, const void *q)
{
    const uint32_t *a = p, *b = q;
    int k = a[0] == b[0];
    return (a[k] > b[k]) - (a[k] < b[k]);
}

static int list_links(const struct joining *j, uint32_t **pairs, size_t *n, vg_err *e)
{
    uint32_t *list = vgi_array_raw(j->nchosen, 2 * sizeof *list, e);
    if (!list) return VG_ENOMEM;
    for (size_t i = 0; i < j->nchosen; i++) place_link(j, &j->chosen[i], list + 2 * i);
    qsort(list, j->nchosen, 2 * sizeof *list, compare_pairs);
    *pairs = list;
    *n = j->nchosen;
    return VG_OK;
}

int vg_link_components(const vg_mesh *m, const double *vertices, uint32_t **pairs, size_t *n, vg_err *e)
{
    struct joining j = {.m = m};
    *pairs = NULL;
    *n = 0;
    uint32_t *label = vgi_array_raw(m->nv, sizeof *label, e);
    if (!label) return VG_ENOMEM;
    int r = vg_mesh_components(m, label, &j.components, e);
    if (r < 0 || j.components < 2) goto out;
    r = prepare_joining(&j, vertices, label, e);
    if (r < 0) goto out;
    span(&j);
    r = list_links(&j, pairs, n, e);
out:
    clear_joining(&j);
    free(label);
    return r;
}

int vg_head_prepare_vectors(vg_head *h, vg_err *e)
{
    if (h->links.chosen) return VG_OK;
    uint32_t *links;
    size_t n;
    int r = vg_link_components(&h->body.mesh, h->body.reference, &links, &n, e);
    if (r < 0) return r;
    free(h->links.pairs);
    h->links.pairs = links;
    h->links.n = n;
    h->links.chosen = true;
    if (n && h->map.ncorners) vg_map_clear(&h->map); /* corners are numbered without links */
    return VG_OK;
}
