/* region_filter.c: removes from each frame the noise, which is what neighbouring vertices do not have in common over
 * all frames. Regions are grown in regions.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/regions.h"
#include "numeric/blas.h"
#include "numeric/lapack.h"
#include "numeric/stats.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

enum { AFFINE = 4, FEWEST = 8, ROUNDS = 20, BLOCK = 16 }; /* rank of a region that moves affinely; fewest frames;
                                                             rounds of the noise estimate; frames per block */

struct vg_region_filter {
    size_t nv, nregions, nframes;
    int threads;
    vgi_region *region;
    size_t *matrix;    /* nregions + 1: start of each matrix */
    double *matrices;  /* n x n: first sums of products of rows, then the filter */
    double *noise;     /* nregions: standard deviation per coordinate; negative: unknown */
    double *total;     /* nv: sum of the weights of all regions that contain the vertex */
};

void vg_region_filter_free(vg_region_filter **out)
{
    vg_region_filter *x = *out;
    if (!x) return;
    free(x->region);
    free(x->matrix);
    free(x->matrices);
    free(x->noise);
    free(x->total);
    free(x);
    *out = NULL;
}

/* weight of vertex i of a region; largest at its centre */
static double weight_of(const vgi_region *p, size_t i)
{
    return 1 - 0.8 * (double)i / (double)p->n;
}

static int make_room(vg_region_filter *x, vg_err *e)
{
    x->matrix = vgi_array(x->nregions + 1, sizeof *x->matrix, e);
    x->noise = vgi_array(x->nregions, sizeof *x->noise, e);
    x->total = vgi_array(x->nv, sizeof *x->total, e);
    if (!x->matrix || !x->noise || !x->total) return VG_ENOMEM;
    for (size_t i = 0; i < x->nregions; i++) {
        const vgi_region *p = &x->region[i];
        x->matrix[i + 1] = x->matrix[i] + p->n * p->n;
        for (size_t k = 0; k < p->n; k++) x->total[p->vertex[k]] += weight_of(p, k);
    }
    x->matrices = vgi_array(x->matrix[x->nregions], sizeof *x->matrices, e);
    return x->matrices ? VG_OK : VG_ENOMEM;
}

int vg_region_filter_new(vg_region_filter **out, const vg_mesh *m, const double *reference, int threads, vg_err *e)
{
    vg_region_filter *x = *out = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    *x = (vg_region_filter){.nv = m->nv, .threads = threads};
    int r = vgi_regions_grow(m, reference, &x->region, &x->nregions, e);
    if (r == VG_OK) r = make_room(x, e);
    if (r < 0) vg_region_filter_free(out);
    return r;
}

/* ---- the first pass ---- */

typedef struct looking {
    vg_region_filter *r;
    size_t n;
    const double *const *vertices;
    double origin[BLOCK][3]; /* the centroid of each frame */
} looking;

/* three rows of a region's matrix: x, y and z of its vertices in a frame, relative to the origin */
static void gather_rows(const vgi_region *p, const double *vertices, const double origin[3], double *rows)
{
    for (size_t i = 0; i < p->n; i++)
        for (size_t k = 0; k < 3; k++) rows[k * p->n + i] = vertices[3 * p->vertex[i] + k] - origin[k];
}

static void look_at_region(void *context, size_t i)
{
    const looking *l = context;
    const vgi_region *p = &l->r->region[i];
    double rows[3 * VGI_REGION], *sum = l->r->matrices + l->r->matrix[i];
    for (size_t f = 0; f < l->n; f++) {
        gather_rows(p, l->vertices[f], l->origin[f], rows);
        vgi_gemm_double(true, false, p->n, p->n, 3, rows, p->n, rows, p->n, 1, sum, p->n);
    }
}

void vg_region_filter_look(vg_region_filter *x, size_t n, const double *const *vertices)
{
    x->nframes += n;
    vgi_blas_alone();
    for (size_t from = 0; from < n; from += BLOCK) {
        looking l = {.r = x, .n = n - from < BLOCK ? n - from : BLOCK, .vertices = vertices + from};
        for (size_t f = 0; f < l.n; f++) vg_centroid(l.vertices[f], x->nv, l.origin[f]);
        vgi_parallel(x->threads, x->nregions, look_at_region, &l);
    }
    vgi_blas_shared();
}

/* ---- the filter of a region ---- */

/* Estimate the noise variance as the residual outside the rank, per degree of freedom there; the rank is the number
 * of singular values above those of noise alone. Starts at the rank of an affine motion and iterates until both
 * agree. */
static double find_noise(size_t rows, size_t n, const double *square)
{
    double variance = 0, spread = sqrt((double)rows) + sqrt((double)n);
    size_t rank = AFFINE;
    for (int round = 0; round < ROUNDS; round++) {
        double rest = 0;
        size_t above = AFFINE;
        for (size_t i = rank; i < n; i++) rest += fmax(square[i], 0);
        variance = rest / ((double)(rows - rank) * (double)(n - rank));
        while (above < n && square[above] > 1.02 * variance * spread * spread) above++;
        if (above <= rank || above + 1 >= n || above + 1 >= rows) break;
        rank = above;
    }
    return variance;
}

/* the best factor of a singular value in the Frobenius norm; `square` is in units of the noise of a row */
static double shrink(double square, double shape)
{
    double edge = 1 + sqrt(shape), a = square - shape - 1;
    return square > edge * edge ? sqrt(fmax(a * a - 4 * shape, 0)) / square : 0;
}

/* the filter: sum of factor v v' over the eigenvectors v */
static void compose_filter(size_t n, double *vectors, double *values, size_t rows, double variance, double *filter,
                    double *scaled)
{
    for (size_t i = 0; i < n; i++) {
        double factor = variance > 0 ? shrink(values[i] / (variance * (double)rows), (double)n / (double)rows) : 1;
        for (size_t k = 0; k < n; k++) scaled[i * n + k] = factor * vectors[i * n + k];
    }
    vgi_gemm_double(true, false, n, n, n, vectors, n, scaled, n, 0, filter, n);
}

static void keep_all(size_t n, double *filter)
{
    memset(filter, 0, n * n * sizeof *filter);
    for (size_t i = 0; i < n; i++) filter[i * n + i] = 1;
}

static int learn_region(vg_region_filter *x, size_t i, double *values, double *vectors, double *scaled, vg_err *e)
{
    size_t n = x->region[i].n, rows = 3 * x->nframes;
    double *filter = x->matrices + x->matrix[i];
    x->noise[i] = -1;
    if (n < 2 * AFFINE) { /* too few vertices to separate noise from motion */
        keep_all(n, filter);
        return VG_OK;
    }
    int r = vgi_eigen(n, filter, n, values, vectors, e);
    if (r < 0) return r;
    double variance = find_noise(rows, n, values);
    x->noise[i] = sqrt(variance);
    compose_filter(n, vectors, values, rows, variance, filter, scaled);
    return VG_OK;
}

int vg_region_filter_learn(vg_region_filter *x, vg_err *e)
{
    if (x->nframes < FEWEST)
        return vg_fail(e, VG_EINPUT, "%zu frames are too few to separate motion from noise: at least %d are needed",
                       x->nframes, FEWEST);
    double *room = vgi_array_raw(2 * VGI_REGION * VGI_REGION + VGI_REGION, sizeof *room, e);
    double *values = room, *vectors = room + VGI_REGION;
    int r = room ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; i < x->nregions && r == VG_OK; i++)
        r = learn_region(x, i, values, vectors, vectors + VGI_REGION * VGI_REGION, e);
    free(room);
    return r;
}

double vg_region_filter_noise(const vg_region_filter *x)
{
    vg_err e;
    size_t n = 0;
    double *known = vgi_array_raw(x->nregions, sizeof *known, &e);
    for (size_t i = 0; known && i < x->nregions; i++)
        if (x->noise[i] >= 0) known[n++] = x->noise[i];
    double middle = vgi_median(known, n);
    free(known);
    return sqrt(3) * middle;
}

/* ---- the second pass ---- */

typedef struct applying {
    const vg_region_filter *r;
    const double *const *in;
    double *const *out;
} applying;

static void add_region(const vg_region_filter *x, size_t i, const double *in, const double origin[3], double *sum)
{
    const vgi_region *p = &x->region[i];
    double rows[3 * VGI_REGION], kept[3 * VGI_REGION];
    gather_rows(p, in, origin, rows);
    vgi_product_double(3, p->n, p->n, rows, p->n, x->matrices + x->matrix[i], p->n, kept, p->n);
    for (size_t k = 0; k < p->n; k++)
        for (size_t c = 0; c < 3; c++) sum[3 * p->vertex[k] + c] += weight_of(p, k) * kept[c * p->n + k];
}

static void filter_frame(void *context, size_t f)
{
    const applying *a = context;
    const vg_region_filter *x = a->r;
    double origin[3], *out = a->out[f];
    vg_centroid(a->in[f], x->nv, origin);
    memset(out, 0, 3 * x->nv * sizeof *out);
    for (size_t i = 0; i < x->nregions; i++) add_region(x, i, a->in[f], origin, out);
    for (size_t v = 0; v < x->nv; v++)
        vgi_divide(out + 3 * v, x->total[v]), vgi_add(out + 3 * v, origin);
}

void vg_region_filter_apply(const vg_region_filter *x, size_t n, const double *const *in, double *const *out)
{
    applying a = {x, in, out};
    vgi_blas_alone();
    vgi_parallel(x->threads, n, filter_frame, &a);
    vgi_blas_shared();
}
