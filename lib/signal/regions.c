/* regions.c: overlapping regions of a mesh: the vertices nearest to one vertex along edges.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/regions.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

typedef struct growth {
    const vg_mesh *m;
    const double *points;
    uint32_t *first, *next;  /* neighbours of v: next[first[v]] .. next[first[v + 1] - 1] */
    double *distance;        /* nv: along edges from the centre; INFINITY outside the region and its front */
    bool *inside, *covered;  /* nv */
    uint32_t *front;         /* vertices adjacent to the region */
    size_t nfront;
} growth;

static void clear_growth(growth *g)
{
    free(g->first);
    free(g->next);
    free(g->distance);
    free(g->inside);
    free(g->covered);
    free(g->front);
}

/* store both directions of every edge; an edge of two faces is listed twice */
static void gather_neighbours(growth *g)
{
    const vg_mesh *m = g->m;
    for (size_t v = m->nv; v > 0; v--) g->first[v] = g->first[v - 1];
    for (size_t f = 0; f < m->nf; f++) {
        const uint32_t *vert = m->vert + m->start[f];
        size_t r = m->start[f + 1] - m->start[f];
        for (size_t i = 0; i < r; i++) {
            uint32_t a = vert[i], b = vert[i + 1 < r ? i + 1 : 0];
            g->next[g->first[a + 1]++] = b;
            g->next[g->first[b + 1]++] = a;
        }
    }
}

static int prepare_growth(growth *g, vg_err *e)
{
    const vg_mesh *m = g->m;
    size_t corners = vg_mesh_corners(m);
    g->first = vgi_array(m->nv + 2, sizeof *g->first, e);
    g->next = vgi_array_raw(2 * corners, sizeof *g->next, e);
    g->distance = vgi_array_raw(m->nv, sizeof *g->distance, e);
    g->inside = vgi_array(m->nv, sizeof *g->inside, e);
    g->covered = vgi_array(m->nv, sizeof *g->covered, e);
    g->front = vgi_array_raw(m->nv, sizeof *g->front, e);
    if (!g->first || !g->next || !g->distance || !g->inside || !g->covered || !g->front) return VG_ENOMEM;
    for (size_t v = 0; v < m->nv; v++) g->distance[v] = INFINITY;
    for (size_t f = 0; f < m->nf; f++) /* degrees: each face adds two to each of its vertices; stored one entry
                                          later */
        for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++) g->first[m->vert[c] + 1] += 2;
    for (size_t v = 0; v < m->nv; v++) g->first[v + 1] += g->first[v];
    gather_neighbours(g);
    return VG_OK;
}

static void reach_neighbours(growth *g, uint32_t v)
{
    for (uint32_t i = g->first[v]; i < g->first[v + 1]; i++) {
        uint32_t w = g->next[i];
        double d = g->distance[v] + sqrt(vgi_square(g->points + 3 * v, g->points + 3 * w));
        if (g->inside[w] || !(d < g->distance[w])) continue;
        if (isinf(g->distance[w])) g->front[g->nfront++] = w;
        g->distance[w] = d;
    }
}

/* Linear search, because the front is short. Among equal distances the lowest vertex number wins. */
static uint32_t take_nearest(growth *g)
{
    size_t best = 0;
    for (size_t i = 1; i < g->nfront; i++) {
        double d = g->distance[g->front[i]], least = g->distance[g->front[best]];
        if (d < least || (d == least && g->front[i] < g->front[best])) best = i;
    }
    uint32_t v = g->front[best];
    g->front[best] = g->front[--g->nfront];
    return v;
}

static void grow_region(growth *g, uint32_t centre, vgi_region *region)
{
    region->n = 0;
    g->nfront = 0;
    g->distance[centre] = 0;
    g->front[g->nfront++] = centre;
    while (g->nfront && region->n < VGI_REGION) {
        uint32_t v = take_nearest(g);
        g->inside[v] = true;
        region->vertex[region->n++] = v;
        reach_neighbours(g, v);
    }
    for (size_t i = 0; i < region->n; i++) g->inside[region->vertex[i]] = false, g->distance[region->vertex[i]] = INFINITY;
    for (size_t i = 0; i < g->nfront; i++) g->distance[g->front[i]] = INFINITY;
    for (size_t i = 0; i < region->n && 3 * i < region->n; i++) g->covered[region->vertex[i]] = true;
}

int vgi_regions_grow(const vg_mesh *m, const double *points, vgi_region **regions, size_t *n, vg_err *e)
{
    growth g = {.m = m, .points = points};
    size_t cap = 0;
    *regions = NULL;
    *n = 0;
    int r = prepare_growth(&g, e);
    for (uint32_t v = 0; v < m->nv && r == VG_OK; v++) {
        if (g.covered[v]) continue;
        if ((r = vgi_grow(regions, &cap, *n + 1, sizeof **regions, e)) == VG_OK) grow_region(&g, v, &(*regions)[(*n)++]);
    }
    clear_growth(&g);
    if (r < 0) {
        free(*regions);
        *regions = NULL;
    }
    return r;
}
