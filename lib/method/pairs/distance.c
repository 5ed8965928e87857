/* distance.c: distance between two surfaces of any connectivity, in both directions, over the frames of a sequence.
 * Nearest points are found in surface.c; distances of corresponding vertices are in model/measures.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/pairs/surface.h"
#include "numeric/face.h"

#include <stdlib.h>

enum {
    BLOCK = 256,                  /* points per task */
    PER_OCTAVE = 128,             /* bins of the histogram that gives p95 */
    OCTAVES = 80,
    BINS = PER_OCTAVE * OCTAVES
};
static const double LEAST_OCTAVE = -60; /* relative to the scale; smaller distances fall into the first bin */
/* Over a triangle, weights 1/12 per corner and 3/4 for the centroid integrate quadratic functions exactly. */
static const double OF_CORNER = 1.0 / 12, OF_CENTROID = 0.75;

/* The sample points of one surface. */
typedef struct samples {
    const vg_mesh *mesh;
    size_t n; /* vertices, then centroids */
    double *point, *weight, *distance;
} samples;

typedef struct tally {
    double weight, sum, squares;
    vg_surface_distance found;
    double bins[BINS];
} tally;

struct vg_surface_measures {
    samples side[2]; /* truth, result */
    double scale;
    int threads;
    size_t frames;
    tally all[2], one; /* one: of a single frame */
};

/* ---- points ---- */

/* The centroids of triangles, and of a face of four or more corners its own: the middle of the fan. */
static size_t count_centroids(const vg_mesh *m)
{
    size_t n = 0;
    for (size_t f = 0; f < m->nf; f++) {
        size_t r = m->start[f + 1] - m->start[f];
        n += r == 3 ? 1 : r > 3 ? r + 1 : 0;
    }
    return n;
}

static int make_samples(samples *s, const vg_mesh *m, vg_err *e)
{
    s->mesh = m;
    s->n = m->nv + count_centroids(m);
    s->point = vgi_array(3 * s->n, sizeof *s->point, e);
    s->weight = vgi_array(s->n, sizeof *s->weight, e);
    s->distance = vgi_array(s->n, sizeof *s->distance, e);
    return s->point && s->weight && s->distance ? VG_OK : VG_ENOMEM;
}

static void clear_samples(samples *s)
{
    free(s->point);
    free(s->weight);
    free(s->distance);
}

/* A triangle of three samples. Its centroid is the sample `at`. */
static void add_triangle(samples *s, size_t at, size_t a, size_t b, size_t c)
{
    const double *x = s->point + 3 * a, *y = s->point + 3 * b, *z = s->point + 3 * c;
    double n[3];
    for (size_t k = 0; k < 3; k++) s->point[3 * at + k] = (x[k] + y[k] + z[k]) / 3;
    vgi_triangle_normal(x, y, z, n);
    double area = vgi_length(n) / 2;
    s->weight[at] = OF_CENTROID * area;
    s->weight[a] += OF_CORNER * area, s->weight[b] += OF_CORNER * area, s->weight[c] += OF_CORNER * area;
}

static void place_samples(samples *s, const double *points)
{
    const vg_mesh *m = s->mesh;
    size_t at = m->nv;
    memcpy(s->point, points, 3 * m->nv * sizeof *points);
    memset(s->weight, 0, s->n * sizeof *s->weight);
    for (size_t f = 0; f < m->nf; f++) {
        const uint32_t *v = m->vert + m->start[f];
        size_t r = m->start[f + 1] - m->start[f];
        if (r == 3) add_triangle(s, at++, v[0], v[1], v[2]);
        if (r <= 3) continue;
        const size_t centre = at++;
        vgi_face_centre(points, v, r, s->point + 3 * centre);
        for (size_t i = 0; i < r; i++) add_triangle(s, at++, v[i], v[i + 1 < r ? i + 1 : 0], centre);
    }
    double total = 0;
    for (size_t i = 0; i < s->n; i++) total += s->weight[i];
    if (total > 0) return;
    for (size_t i = 0; i < s->n; i++) s->weight[i] = i < m->nv; /* without area all vertices have the same weight */
}

/* ---- distances ---- */

typedef struct asking {
    samples *from;
    const vgi_surface *to;
} asking;

static void ask_block(void *context, size_t block)
{
    const asking *a = context;
    size_t end = BLOCK * (block + 1) < a->from->n ? BLOCK * (block + 1) : a->from->n;
    for (size_t i = BLOCK * block; i < end; i++) {
        vgi_hit hit;
        bool found = vgi_surface_nearest(a->to, a->from->point + 3 * i, NULL, 0, INFINITY, &hit);
        a->from->distance[i] = found ? sqrt(hit.square) : INFINITY;
    }
}

static size_t bin_of(double distance, double scale)
{
    double x = distance > 0 ? (log2(distance / scale) - LEAST_OCTAVE) * PER_OCTAVE : 0;
    return x > 0 ? x < BINS - 1 ? (size_t)x : BINS - 1 : 0;
}

static void add_to(tally *t, const samples *s, double scale, size_t frame)
{
    for (size_t i = 0; i < s->n; i++) {
        double d = s->distance[i], w = s->weight[i];
        if (!(w > 0)) continue; /* a vertex in no face is not on the surface */
        t->weight += w, t->sum += w * d, t->squares += w * d * d;
        t->bins[bin_of(d, scale)] += w;
        if (d > t->found.max || t->weight == w) {
            t->found.max = d, t->found.frame = frame;
            memcpy(t->found.at, s->point + 3 * i, sizeof t->found.at);
        }
    }
}

/* The upper edge of the bin below which 95 % of the area lies. */
static vg_surface_distance read_tally(const tally *t, double scale)
{
    vg_surface_distance d = t->found;
    double below = 0;
    size_t bin = 0;
    if (!(t->weight > 0)) return d;
    d.mean = t->sum / t->weight, d.rms = sqrt(t->squares / t->weight);
    while (bin < BINS - 1 && (below += t->bins[bin]) < 0.95 * t->weight) bin++;
    double edge = bin ? scale * exp2(LEAST_OCTAVE + (double)(bin + 1) / PER_OCTAVE) : 0;
    d.p95 = edge < d.max ? edge : d.max;
    return d;
}

/* ---- the sequence ---- */

int vg_surface_measures_new(vg_surface_measures **out, const vg_mesh *truth, const vg_mesh *result, double scale, int threads,
                            vg_err *e)
{
    *out = NULL;
    if (!truth->nf || !result->nf)
        return vg_fail(e, VG_EINPUT, "%s has no faces: there is no surface to measure", truth->nf ? "the result" : "the truth");
    vg_surface_measures *x = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    x->scale = scale > 0 ? scale : 1, x->threads = threads;
    int r = make_samples(&x->side[0], truth, e);
    if (r == VG_OK) r = make_samples(&x->side[1], result, e);
    if (r < 0) vg_surface_measures_free(&x);
    *out = x;
    return r;
}

void vg_surface_measures_free(vg_surface_measures **x)
{
    if (!*x) return;
    for (int i = 0; i < 2; i++) clear_samples(&(*x)->side[i]);
    free(*x);
    *x = NULL;
}

int vg_surface_measures_add(vg_surface_measures *x, const double *truth, const double *result,
                            vg_surface_distance found[2], vg_err *e)
{
    const double *points[2] = {truth, result};
    vgi_surface *surface[2] = {NULL, NULL};
    int r = VG_OK;
    for (int i = 0; i < 2 && r == VG_OK; i++) {
        place_samples(&x->side[i], points[i]);
        r = vgi_surface_new(&surface[i], x->side[i].mesh, points[i], e);
    }
    for (int i = 0; i < 2 && r == VG_OK; i++) {
        asking a = {&x->side[i], surface[1 - i]};
        vgi_parallel(x->threads, (x->side[i].n + BLOCK - 1) / BLOCK, ask_block, &a);
        add_to(&x->all[i], &x->side[i], x->scale, x->frames);
        if (!found) continue;
        memset(&x->one, 0, sizeof x->one);
        add_to(&x->one, &x->side[i], x->scale, x->frames);
        found[i] = read_tally(&x->one, x->scale);
    }
    x->frames += r == VG_OK;
    for (int i = 0; i < 2; i++) vgi_surface_free(&surface[i]);
    return r;
}

void vg_surface_measures_get(const vg_surface_measures *x, vg_surface_distance found[2])
{
    for (int i = 0; i < 2; i++) found[i] = read_tally(&x->all[i], x->scale);
}

const double *vg_surface_measures_vertices(const vg_surface_measures *x)
{
    return x->side[1].distance;
}
