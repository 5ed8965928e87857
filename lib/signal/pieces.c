/* pieces.c: the triangles and segments of a vector graph, and their neighbours.
 *
 * A linear map of a whole polygon determines its corners only for a triangle, so polygons are cut into fans, from the
 * corner whose smallest triangle is largest. Neighbours share an edge; pieces connected only by vertices get one pair
 * per gap.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/pieces.h"
#include "model/incidence.h"
#include "numeric/sets.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

enum { LARGE_FACE = 64 }; /* above this many corners the fan starts anywhere */

void vgi_pieces_clear(vgi_pieces *p)
{
    free(p->face);
    free(p->first);
    free(p->apex);
    free(p->vert);
    free(p->share);
    free(p->pair);
    *p = (vgi_pieces){0};
}

void vgi_piece_edges(const vgi_pieces *p, size_t i, const double *vertices, double first[3], double second[3])
{
    const uint32_t *v = p->vert + 3 * i;
    const double *a = vertices + 3 * (size_t)v[0], *b = vertices + 3 * (size_t)v[1];
    const double *c = vgi_is_triangle(p, i) ? vertices + 3 * (size_t)v[2] : a;
    vgi_subtract(b, a, first), vgi_subtract(c, a, second);
}

bool vgi_piece_frame(const double first[3], const double second[3], double m[9])
{
    double n[3], size, sides = vgi_length(first) * vgi_length(second);
    vgi_cross(first, second, n);
    size = vgi_length(n);
    if (!(size > 1e-12 * sides)) return false;
    for (int k = 0; k < 3; k++) m[3 * k] = first[k], m[3 * k + 1] = second[k], m[3 * k + 2] = n[k] / size;
    return true;
}

static double twice_area(const double *vertices, uint32_t a, uint32_t b, uint32_t c)
{
    const double *p = vertices + 3 * (size_t)a, *q = vertices + 3 * (size_t)b, *r = vertices + 3 * (size_t)c;
    double n[3];
    vgi_cross((double[]){q[0] - p[0], q[1] - p[1], q[2] - p[2]}, (double[]){r[0] - p[0], r[1] - p[1], r[2] - p[2]}, n);
    return vgi_length(n);
}

/* ---- triangles ---- */

/* The corner whose fan has the largest smallest triangle; the first of equal ones. */
static uint32_t choose_apex(const uint32_t *vert, size_t r, const double *reference)
{
    uint32_t best = 0;
    double most = -1;
    for (uint32_t s = 0; r > 3 && r <= LARGE_FACE && s < r; s++) {
        double least = INFINITY;
        for (size_t i = 1; i + 1 < r; i++)
            least = fmin(least, twice_area(reference, vert[s], vert[(s + i) % r], vert[(s + i + 1) % r]));
        if (least > most * (1 + 1e-9)) most = least, best = s;
    }
    return best;
}

static void cut_faces(vgi_pieces *p, const double *reference)
{
    const vg_graph *g = p->g;
    size_t n = 0;
    for (size_t f = 0; f < g->faces.nf; f++) {
        const uint32_t *vert = g->faces.vert + g->faces.start[f];
        size_t r = g->faces.start[f + 1] - g->faces.start[f];
        uint32_t s = p->apex[f] = choose_apex(vert, r, reference);
        p->first[f] = (uint32_t)n;
        for (size_t i = 1; i < r && (i + 1 < r || r == 2); i++, n++) {
            p->face[n] = (uint32_t)f;
            p->vert[3 * n] = vert[s];
            p->vert[3 * n + 1] = vert[(s + i) % r];
            p->vert[3 * n + 2] = r == 2 ? VGI_NO_EDGE : vert[(s + i + 1) % r];
        }
    }
    p->first[g->faces.nf] = (uint32_t)n;
}

/* Areas, at least a thousandth of their mean; squared lengths if there are only segments. */
static void set_shares(vgi_pieces *p, const double *reference)
{
    double sum = 0, floor, all = 0;
    size_t triangles = 0;
    for (size_t i = 0; i < p->n; i++) {
        if (!vgi_is_triangle(p, i)) continue;
        sum += p->share[i] = twice_area(reference, p->vert[3 * i], p->vert[3 * i + 1], p->vert[3 * i + 2]);
        triangles++;
    }
    for (size_t i = 0; i < p->n && !triangles; i++)
        sum += p->share[i] = vgi_square(reference + 3 * (size_t)p->vert[3 * i], reference + 3 * (size_t)p->vert[3 * i + 1]);
    floor = 1e-3 * sum / (double)(triangles ? triangles : p->n);
    for (size_t i = 0; i < p->n; i++) all += p->share[i] = fmax(p->share[i], floor > 0 ? floor : 1);
    for (size_t i = 0; i < p->n; i++) p->share[i] /= all;
}

/* ---- neighbours ---- */

static int by_vertices(const void *a_, const void *b_)
{
    const vgi_piece_side *a = a_, *b = b_;
    if (a->low != b->low) return a->low < b->low ? -1 : 1;
    if (a->high != b->high) return a->high < b->high ? -1 : 1;
    return a->at < b->at ? -1 : a->at > b->at;
}

size_t vgi_pieces_sides(const vgi_pieces *p, vgi_piece_side *sides)
{
    size_t n = 0;
    for (size_t i = 0; i < p->n; i++) {
        size_t r = vgi_is_triangle(p, i) ? 3 : 1;
        for (size_t k = 0; k < r; k++, n++) {
            uint32_t a = p->vert[3 * i + k], b = p->vert[3 * i + (k + 1) % 3];
            sides[n] = (vgi_piece_side){a < b ? a : b, a < b ? b : a, (uint32_t)(3 * i + k)};
        }
    }
    qsort(sides, n, sizeof *sides, by_vertices);
    return n;
}

static void put_pair(vgi_pieces *p, uint32_t *set, uint32_t a, uint32_t b, uint32_t from, uint32_t to)
{
    p->pair[p->npairs++] = (vgi_neighbours){a, b, from, to};
    p->parts -= vgi_sets_find(set, a) != vgi_sets_find(set, b);
    set[vgi_sets_find(set, a)] = vgi_sets_find(set, b);
}

/* Pair the pieces that share an edge, then those connected by a shared vertex but by no edge. */
static void pair_pieces(vgi_pieces *p, const vgi_incidence *around, vgi_piece_side *sides, uint32_t *set)
{
    size_t n = vgi_pieces_sides(p, sides);
    p->parts = p->n;
    for (uint32_t i = 0; i < p->n; i++) set[i] = i;
    for (size_t i = 1; i < n; i++)
        if (sides[i].low == sides[i - 1].low && sides[i].high == sides[i - 1].high && sides[i].at / 3 != sides[i - 1].at / 3)
            put_pair(p, set, sides[i - 1].at / 3, sides[i].at / 3, sides[i].low, sides[i].high);
    for (size_t v = 0; v < p->g->faces.nv; v++)
        for (size_t i = around->first[v] + (size_t)1; i < around->first[v + 1]; i++) {
            uint32_t a = p->first[around->face[i - 1]], b = p->first[around->face[i]];
            if (vgi_sets_find(set, a) != vgi_sets_find(set, b)) put_pair(p, set, a, b, VGI_NO_EDGE, VGI_NO_EDGE);
        }
}

static int find_neighbours(vgi_pieces *p, vg_err *e)
{
    vgi_incidence around = {0};
    vgi_piece_side *sides = vgi_array(p->n, 3 * sizeof *sides, e);
    uint32_t *set = vgi_array(p->n, sizeof *set, e);
    int r = sides && set && (p->pair = vgi_array(p->n, 4 * sizeof *p->pair, e)) ? VG_OK : VG_ENOMEM;
    if (r == VG_OK && (r = vgi_incidence_make(&around, &p->g->faces, e)) == VG_OK) pair_pieces(p, &around, sides, set);
    vgi_incidence_clear(&around);
    free(sides);
    free(set);
    return r;
}

int vgi_pieces_make(vgi_pieces *p, const vg_graph *g, const double *reference, vg_err *e)
{
    *p = (vgi_pieces){.g = g};
    for (size_t f = 0; f < g->faces.nf; f++) {
        size_t size = g->faces.start[f + 1] - g->faces.start[f];
        p->n += size > 3 ? size - 2 : 1;
    }
    if (p->n >= VGI_NO_EDGE / 3) return vg_fail(e, VG_EINPUT, "a graph of %zu triangles is too large", p->n);
    int r = VG_ENOMEM;
    if ((p->face = vgi_array(p->n, sizeof *p->face, e)) && (p->first = vgi_array(g->faces.nf + 1, sizeof *p->first, e)) &&
        (p->apex = vgi_array(g->faces.nf, sizeof *p->apex, e)) && (p->vert = vgi_array(p->n, 3 * sizeof *p->vert, e)) &&
        (p->share = vgi_array(p->n, sizeof *p->share, e))) {
        cut_faces(p, reference);
        set_shares(p, reference);
        r = find_neighbours(p, e);
    }
    if (r < 0) vgi_pieces_clear(p);
    return r;
}

/* ---- from triangles to corners ---- */

static void place_corners(const vgi_pieces *p, size_t f, const double *edges, double *w)
{
    const vg_graph *g = p->g;
    size_t r = g->faces.start[f + 1] - g->faces.start[f], s = p->apex[f], first = p->first[f], pieces = p->first[f + 1] - first;
    memset(w, 0, 3 * r * sizeof *w);
    for (size_t i = 0; i < pieces; i++)
        for (size_t k = 0; k < 3; k++) {
            w[3 * ((s + i + 1) % r) + k] += edges[6 * (first + i) + k] * (i > 0 ? 0.5 : 1);
            if (r > 2) w[3 * ((s + i + 2) % r) + k] += edges[6 * (first + i) + 3 + k] * (i + 1 < pieces ? 0.5 : 1);
        }
}

void vgi_pieces_vectors(const vgi_pieces *p, const double *edges, double *vectors)
{
    const vg_graph *g = p->g;
    for (size_t f = 0; f < g->faces.nf; f++) {
        double *w = vectors + 3 * (size_t)g->faces.start[f], centre[3];
        size_t r = g->faces.start[f + 1] - g->faces.start[f];
        place_corners(p, f, edges, w);
        vg_centroid(w, r, centre);
        for (size_t i = 0; i < 3 * r; i++) w[i] -= centre[i % 3];
    }
}
