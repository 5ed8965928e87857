/* measures.c: how far two sequences of one connectivity are apart: vertices; orientation, area, planarity of faces.
 * Leaves out pairing of frames and tolerances: those are vg-diff's.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"

#include <math.h>

/* The histogram for p95 counts by the upper bits of the error: 11 of exponent and 8 of mantissa, so that a bin is at
 * most 1/256 of its value wide; its middle is off by half of that. */
enum { BIN_SHIFT = 64 - 1 - 11 - 8, NBINS = 1 << (11 + 8) };

/* A face has a normal when its area exceeds this times D times its perimeter: below, it is rounding. */
static const double FLAT = 1e-14;

const double vg_error_edges[VG_ERROR_BINS] = {
    0, 1e-12, 2e-12, 5e-12, 1e-11, 2e-11, 5e-11, 1e-10, 2e-10, 5e-10, 1e-9, 2e-9, 5e-9, 1e-8, 2e-8, 5e-8, 1e-7,
    2e-7, 5e-7, 1e-6, 2e-6, 5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 1e-1,
    2e-1, 5e-1, 1e0, 2e0, 5e0,
};

typedef struct running { /* Welford: mean and squared deviations without cancellation */
    size_t n;
    double mean, squares, max;
} running;

struct vg_measures {
    const vg_mesh *m;
    bool centred;
    size_t frames;
    double diagonal;
    double sum, sum_squares, max;
    size_t max_vertex, max_frame;
    double *vertex_mean, *vertex_squares; /* nv: Welford over poses */
    uint64_t *bins;                       /* NBINS */
    uint64_t histogram[VG_ERROR_BINS];
    running orientation, area, planarity[2];
    uint64_t planarity_histogram[2][10];
};

int vg_measures_new(vg_measures **out, const vg_mesh *m, const double *reference, bool centred, vg_err *e)
{
    vg_measures *x = vgi_array(1, sizeof *x, e);
    *out = NULL;
    if (!x) return VG_ENOMEM;
    x->m = m, x->centred = centred;
    x->diagonal = reference ? vg_diagonal(reference, m->nv) : 0;
    x->vertex_mean = vgi_array(m->nv, sizeof *x->vertex_mean, e);
    x->vertex_squares = vgi_array(m->nv, sizeof *x->vertex_squares, e);
    x->bins = vgi_array(NBINS, sizeof *x->bins, e);
    if (!x->vertex_mean || !x->vertex_squares || !x->bins) {
        vg_measures_free(&x);
        return VG_ENOMEM;
    }
    *out = x;
    return VG_OK;
}

void vg_measures_free(vg_measures **x)
{
    if (!*x) return;
    free((*x)->vertex_mean);
    free((*x)->vertex_squares);
    free((*x)->bins);
    free(*x);
    *x = NULL;
}

static void running_add(running *r, double value)
{
    double d = value - r->mean;
    r->n++;
    r->mean += d / (double)r->n;
    r->squares += d * (value - r->mean);
    if (value > r->max) r->max = value;
}

static double running_sd(const running *r)
{
    return r->n ? sqrt(r->squares / (double)r->n) : 0;
}

static double length_of(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static size_t bin_of(double error)
{
    uint64_t bits;
    memcpy(&bits, &error, sizeof bits);
    return (size_t)(bits >> BIN_SHIFT) & (NBINS - 1); /* the sign bit is 0, but for a NaN */
}

static double bin_middle(size_t bin)
{
    if (bin == 0) return 0; /* zero and what is next to it */
    uint64_t low = (uint64_t)bin << BIN_SHIFT, high = ((uint64_t)bin + 1) << BIN_SHIFT;
    double a, b;
    memcpy(&a, &low, sizeof a);
    memcpy(&b, &high, sizeof b);
    return 0.5 * (a + b);
}

/* The last edge that is not above the error; one without D is nothing or beyond all. */
static size_t edge_below(double error, double diagonal)
{
    double in_diagonals = error == 0 ? 0 : error / diagonal;
    size_t low = 0, high = VG_ERROR_BINS - 1;
    while (low < high) {
        size_t middle = (low + high + 1) / 2;
        if (vg_error_edges[middle] <= in_diagonals) low = middle;
        else high = middle - 1;
    }
    return low;
}

double vg_error_p95(double *x, size_t n)
{
    if (n == 0) return 0;
    size_t low = 0, high = n - 1, rank = n - n / 20 - 1;
    while (low < high) { /* Hoare: only the part that holds the rank is looked at again */
        double pivot = x[low + (high - low) / 2];
        size_t i = low, j = high;
        for (;;) {
            while (x[i] < pivot) i++;
            while (x[j] > pivot) j--;
            if (i >= j) break;
            double t = x[i];
            x[i++] = x[j], x[j--] = t;
        }
        if (rank <= j) high = j;
        else low = j + 1;
    }
    return x[rank];
}

/* Vertex errors of one pose; shift is what centring adds to the result. Returns the pose's largest error. */
static double add_vertices(vg_measures *x, const double *truth, const double *result, const double shift[3],
                           double *frame_mean, double *errors)
{
    double sum = 0, squares = 0, largest = 0, poses = (double)(x->frames + 1);
    for (size_t v = 0; v < x->m->nv; v++) {
        const double *a = truth + 3 * v, *b = result + 3 * v;
        double apart[3] = {b[0] - a[0] + shift[0], b[1] - a[1] + shift[1], b[2] - a[2] + shift[2]};
        double error = length_of(apart), d = error - x->vertex_mean[v];
        sum += error;
        squares += error * error;
        x->vertex_mean[v] += d / poses;
        x->vertex_squares[v] += d * (error - x->vertex_mean[v]);
        x->bins[bin_of(error)]++;
        x->histogram[edge_below(error, x->diagonal)]++;
        if (error > largest) largest = error;
        if (error > x->max) x->max = error, x->max_vertex = v, x->max_frame = x->frames;
        if (errors) errors[v] = error;
    }
    x->sum += sum;
    x->sum_squares += squares;
    *frame_mean = x->m->nv ? sum / (double)x->m->nv : 0;
    return largest;
}

static double perimeter_of(const uint32_t *vert, size_t r, const double *points)
{
    double sum = 0;
    for (size_t i = 0; i < r; i++) {
        const double *p = points + 3 * (size_t)vert[i], *q = points + 3 * (size_t)vert[i + 1 < r ? i + 1 : 0];
        sum += length_of((double[3]){q[0] - p[0], q[1] - p[1], q[2] - p[2]});
    }
    return sum;
}

/* A face of one pose: its centroid, unit normal (Newell's: the sum of the cross products of successive corner
 * vectors, here those from the centroid) and area. Returns false when it has no normal; then normal and area are 0.
 * Called with a constant r for triangles and quads. */
static inline __attribute__((always_inline)) bool face_shape(const vg_measures *x, const uint32_t *vert, size_t r,
                                                             const double *points, double centroid[3],
                                                             double normal[3], double *area)
{
    double n[3] = {0, 0, 0}, edges = 0, a[3], share = 1 / (double)r;
    centroid[0] = centroid[1] = centroid[2] = 0;
    for (size_t i = 0; i < r; i++)
        for (int k = 0; k < 3; k++) centroid[k] += share * points[3 * (size_t)vert[i] + k];
    for (int k = 0; k < 3; k++) a[k] = points[3 * (size_t)vert[r - 1] + k] - centroid[k];
    for (size_t i = 0; i < r; i++) {
        const double *q = points + 3 * (size_t)vert[i];
        double b[3] = {q[0] - centroid[0], q[1] - centroid[1], q[2] - centroid[2]};
        n[0] += a[1] * b[2] - a[2] * b[1];
        n[1] += a[2] * b[0] - a[0] * b[2];
        n[2] += a[0] * b[1] - a[1] * b[0];
        for (int k = 0; k < 3; k++) edges += (b[k] - a[k]) * (b[k] - a[k]), a[k] = b[k];
    }
    double length = length_of(n), least = FLAT * x->diagonal, half = 0.5 * length;
    /* the perimeter is no longer than the root of r times the squared edges:
     * most faces need no roots of their edges */
    bool ok = half * half > 1.001 * least * least * (double)r * edges || half > least * perimeter_of(vert, r, points);
    double scale = ok ? 1 / length : 0;
    *area = ok ? half : 0;
    for (int k = 0; k < 3; k++) normal[k] = scale * n[k];
    return ok;
}

/* Mean over the corners of |unit corner vector . normal|; a corner at the centroid has no direction: not counted. */
static double face_planarity(const uint32_t *vert, size_t r, const double *points, const double centroid[3],
                             const double normal[3])
{
    double sum = 0;
    size_t n = 0;
    for (size_t i = 0; i < r; i++) {
        const double *p = points + 3 * (size_t)vert[i];
        double w[3] = {p[0] - centroid[0], p[1] - centroid[1], p[2] - centroid[2]};
        double length = length_of(w);
        if (length <= 0) continue;
        sum += fabs(w[0] * normal[0] + w[1] * normal[1] + w[2] * normal[2]) / length;
        n++;
    }
    return n ? fmin(sum / (double)n, 1) : 0;
}

/* 1 - a.b of two unit vectors, as half the squared distance of their ends: exact near 0, and 0 for equal ones. */
static double normals_apart(const double a[3], const double b[3])
{
    double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return fmin(0.5 * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), 2);
}

static inline __attribute__((always_inline)) void add_face(vg_measures *x, const uint32_t *vert, size_t r,
                                                           const double *const *poses)
{
    double centroid[2][3], normal[2][3], area[2];
    bool has_normal[2];
    for (int i = 0; i < 2; i++) {
        has_normal[i] = face_shape(x, vert, r, poses[i], centroid[i], normal[i], &area[i]);
        if (r < 4 || !has_normal[i]) continue;
        double p = face_planarity(vert, r, poses[i], centroid[i], normal[i]);
        running_add(&x->planarity[i], p);
        x->planarity_histogram[i][p < 1 ? (int)(10 * p) : 9]++;
    }
    if (!has_normal[0]) return;
    /* a result that collapsed a face has no normal there: N.N~ is 0, and all of its area is wrong */
    running_add(&x->orientation, has_normal[1] ? normals_apart(normal[0], normal[1]) : 1);
    running_add(&x->area, fabs(1 - area[1] / area[0]));
}

static void add_faces(vg_measures *x, const double *truth, const double *result)
{
    const double *const poses[2] = {truth, result};
    for (size_t f = 0; f < x->m->nf; f++) {
        const uint32_t *vert = x->m->vert + x->m->start[f];
        size_t r = x->m->start[f + 1] - x->m->start[f];
        if (r == 3) add_face(x, vert, 3, poses);
        else if (r == 4) add_face(x, vert, 4, poses);
        else if (r > 4) add_face(x, vert, r, poses);
    }
}

int vg_measures_add(vg_measures *x, const double *truth, const double *result, double *frame_mean, double *frame_max,
                    double *errors, vg_err *e)
{
    double shift[3] = {0, 0, 0}, mean;
    if (x->centred) {
        double a[3], b[3];
        vg_centroid(truth, x->m->nv, a);
        vg_centroid(result, x->m->nv, b);
        for (int k = 0; k < 3; k++) shift[k] = a[k] - b[k];
    }
    double largest = add_vertices(x, truth, result, shift, &mean, errors);
    if (!isfinite(x->sum_squares))
        return vg_fail(e, VG_EINPUT, "frame %zu: its coordinates are too large to be compared", x->frames);
    add_faces(x, truth, result);
    x->frames++;
    if (frame_mean) *frame_mean = mean;
    if (frame_max) *frame_max = largest;
    return VG_OK;
}

/* The smallest error that 95 of 100 do not exceed. */
static double percentile_95(const vg_measures *x)
{
    uint64_t n = 0, seen = 0;
    for (size_t i = 0; i < NBINS; i++) n += x->bins[i];
    uint64_t rank = n - n / 20;
    for (size_t i = 0; i < NBINS && rank > 0; i++) {
        seen += x->bins[i];
        if (seen >= rank) return fmin(bin_middle(i), x->max);
    }
    return 0;
}

void vg_measures_get(const vg_measures *x, vg_measure_report *r)
{
    double n = (double)x->m->nv * (double)x->frames;
    *r = (vg_measure_report){.frames = x->frames, .vertices = x->m->nv, .faces = x->m->nf, .diagonal = x->diagonal};
    r->mean = n > 0 ? x->sum / n : 0;
    r->rms = n > 0 ? sqrt(x->sum_squares / n) : 0;
    r->max = x->max, r->max_vertex = x->max_vertex, r->max_frame = x->max_frame;
    r->p95 = percentile_95(x);
    memcpy(r->histogram, x->histogram, sizeof r->histogram);
    double worst = 0;
    for (size_t v = 0; v < x->m->nv; v++)
        if (x->vertex_squares[v] > worst) worst = x->vertex_squares[v], r->sigma_vertex = v;
    r->sigma = x->frames ? sqrt(worst / (double)x->frames) : 0;
    r->orientation_mean = x->orientation.mean, r->orientation_max = x->orientation.max;
    r->orientation_sd = running_sd(&x->orientation);
    r->area_mean = x->area.mean, r->area_max = x->area.max, r->area_sd = running_sd(&x->area);
    r->faces_measured = x->orientation.n;
    for (int i = 0; i < 2; i++) {
        r->planarity_mean[i] = x->planarity[i].mean;
        r->planarity_max[i] = x->planarity[i].max;
        r->planarity_faces[i] = x->planarity[i].n;
        memcpy(r->planarity_histogram[i], x->planarity_histogram[i], sizeof r->planarity_histogram[i]);
    }
}
