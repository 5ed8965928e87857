/* measures.c: the distance between two sequences with one connectivity: vertex errors; orientation, area and
 * planarity of faces. Poses are measured independently, several in parallel; their sums are added in pose order, so
 * that the result does not depend on the number of threads. The inner loop over faces is in measures_kernel.c;
 * pairing and tolerances are in vg-diff.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/measures_kernel.h"
#include "numeric/vec3.h"

#include <math.h>

/* The histogram for p95 bins errors by their upper bits: 11 of exponent and 8 of mantissa. So a bin is at most 1/256
 * of its value wide, and its middle is off by at most half of that. */
enum { BIN_SHIFT = 64 - 1 - 11 - 8, NBINS = 1 << (11 + 8) };

const double vg_error_edges[VG_ERROR_BINS] = {
    0, 1e-12, 2e-12, 5e-12, 1e-11, 2e-11, 5e-11, 1e-10, 2e-10, 5e-10, 1e-9, 2e-9, 5e-9, 1e-8, 2e-8, 5e-8, 1e-7,
    2e-7, 5e-7, 1e-6, 2e-6, 5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 1e-1,
    2e-1, 5e-1, 1e0, 2e0, 5e0,
};

/* The measures of one pose. */
typedef struct pose {
    double sum, squares, largest; /* of the vertex errors */
    uint64_t histogram[VG_ERROR_BINS];
    vgi_face_sums faces;
} pose;

/* For each exponent, the last edge below all numbers with that exponent: start of the search. */
enum { EXPONENT_SHIFT = 52, NEXPONENTS = 1 << 11 };

struct vg_measures {
    const vg_mesh *m;
    bool centred;
    int threads;
    size_t frames;
    double diagonal;
    double sum, sum_squares, max;
    size_t max_vertex, max_frame;
    double *vertex_mean, *vertex_squares; /* nv: Welford's sums over poses */
    uint64_t *bins;                       /* NBINS */
    uint64_t histogram[VG_ERROR_BINS];
    double edges[VG_ERROR_BINS];          /* the least error of each bin of the histogram, in mesh units */
    unsigned char edge_below[NEXPONENTS];
    vgi_face_class *classes;              /* of faces with 3 or more corners, by face number */
    size_t nclasses;
    vgi_face_sums faces;
    pose *poses; /* of the current call */
    size_t poses_cap;
};

/* ---- construction ---- */

/* The least error that is at least `edge` in units of D; if D is 0, any error except 0. */
static double least_error(double edge, double diagonal)
{
    double x = edge * diagonal;
    if (diagonal == 0) return edge > 0 ? nextafter(0, 1) : 0;
    while (x > 0 && x / diagonal >= edge) x = nextafter(x, 0);
    while (x / diagonal < edge) x = nextafter(x, INFINITY);
    return x;
}

static void place_edges(vg_measures *x)
{
    for (size_t i = 0; i < VG_ERROR_BINS; i++) x->edges[i] = least_error(vg_error_edges[i], x->diagonal);
    for (uint64_t i = 0, at = 0; i < NEXPONENTS; i++) {
        uint64_t bits = i << EXPONENT_SHIFT;
        double least;
        memcpy(&least, &bits, sizeof least);
        while (at + 1 < VG_ERROR_BINS && x->edges[at + 1] <= least) at++;
        x->edge_below[i] = (unsigned char)at;
    }
}

static size_t face_size(const vg_mesh *m, size_t f)
{
    return m->start[f + 1] - m->start[f];
}

/* faces[r]: the number of faces with r corners, then the number of their class. */
static int make_classes(vg_measures *x, size_t *faces, size_t most, vg_err *e)
{
    for (size_t r = 3; r <= most; r++) x->nclasses += faces[r] > 0;
    if (!(x->classes = vgi_array(x->nclasses, sizeof *x->classes, e))) return VG_ENOMEM;
    vgi_face_class *c = x->classes;
    for (size_t r = 3; r <= most; r++) {
        if (!faces[r]) continue;
        size_t groups = (faces[r] + VGI_LANES - 1) / VGI_LANES;
        faces[r] = (size_t)(c - x->classes);
        c->r = r;
        if (!(c++->corners = vgi_array_raw(groups, VGI_LANES * r * sizeof *c->corners, e))) return VG_ENOMEM;
    }
    return VG_OK;
}

static void put_face(vgi_face_class *c, size_t at, const uint32_t *vert)
{
    uint32_t *to = c->corners + at / VGI_LANES * VGI_LANES * c->r + at % VGI_LANES;
    for (size_t i = 0; i < c->r; i++) to[i * VGI_LANES] = vert[i];
}

static void fill_classes(vg_measures *x, const size_t *class_of)
{
    const vg_mesh *m = x->m;
    for (size_t f = 0; f < m->nf; f++) {
        if (face_size(m, f) < 3) continue;
        vgi_face_class *c = &x->classes[class_of[face_size(m, f)]];
        put_face(c, c->faces++, m->vert + m->start[f]);
    }
    for (size_t k = 0; k < x->nclasses; k++) {
        vgi_face_class *c = &x->classes[k];
        size_t lanes = c->faces % VGI_LANES;
        uint32_t *last = c->corners + (c->faces - lanes) * c->r;
        for (size_t i = 0; i < c->r && lanes; i++)
            for (size_t lane = lanes; lane < VGI_LANES; lane++)
                last[i * VGI_LANES + lane] = last[i * VGI_LANES + lanes - 1];
    }
}

static int classify_faces(vg_measures *x, vg_err *e)
{
    size_t most = 0;
    for (size_t f = 0; f < x->m->nf; f++)
        if (face_size(x->m, f) > most) most = face_size(x->m, f);
    size_t *faces = vgi_array(most + 1, sizeof *faces, e);
    if (!faces) return VG_ENOMEM;
    for (size_t f = 0; f < x->m->nf; f++) faces[face_size(x->m, f)]++;
    int r = make_classes(x, faces, most, e);
    if (r == VG_OK) fill_classes(x, faces);
    free(faces);
    return r;
}

int vg_measures_new(vg_measures **out, const vg_mesh *m, const double *reference, bool centred, int threads,
                    vg_err *e)
{
    vg_measures *x = *out = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    x->m = m, x->centred = centred, x->threads = threads;
    x->diagonal = reference ? vg_diagonal(reference, m->nv) : 0;
    place_edges(x);
    x->vertex_mean = vgi_array(m->nv, sizeof *x->vertex_mean, e);
    x->vertex_squares = vgi_array(m->nv, sizeof *x->vertex_squares, e);
    x->bins = vgi_array(NBINS, sizeof *x->bins, e);
    int r = x->vertex_mean && x->vertex_squares && x->bins ? classify_faces(x, e) : VG_ENOMEM;
    if (r < 0) vg_measures_free(out);
    return r;
}

void vg_measures_free(vg_measures **measures)
{
    vg_measures *x = *measures;
    if (!x) return;
    for (size_t i = 0; i < x->nclasses && x->classes; i++) free(x->classes[i].corners);
    free(x->classes);
    free(x->vertex_mean);
    free(x->vertex_squares);
    free(x->bins);
    free(x->poses);
    free(x);
    *measures = NULL;
}

/* ---- errors and their histograms ---- */

static double length_of(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static size_t bin_of(double error)
{
    uint64_t bits;
    memcpy(&bits, &error, sizeof bits);
    return (size_t)(bits >> BIN_SHIFT) & (NBINS - 1); /* the sign bit is 0 except for a NaN */
}

static double bin_middle(size_t bin)
{
    if (bin == 0) return 0; /* zero and denormals */
    uint64_t low = (uint64_t)bin << BIN_SHIFT, high = ((uint64_t)bin + 1) << BIN_SHIFT;
    double a, b;
    memcpy(&a, &low, sizeof a);
    memcpy(&b, &high, sizeof b);
    return 0.5 * (a + b);
}

/* The last edge not above the error. */
static size_t edge_below(const vg_measures *x, double error)
{
    uint64_t bits;
    memcpy(&bits, &error, sizeof bits);
    size_t at = x->edge_below[(bits >> EXPONENT_SHIFT) & (NEXPONENTS - 1)];
    while (at + 1 < VG_ERROR_BINS && error >= x->edges[at + 1]) at++;
    return at;
}

double vg_error_p95(double *x, size_t n)
{
    return vgi_percentile(x, n, 95);
}

/* ---- poses ---- */

/* The poses of one call. */
typedef struct call {
    vg_measures *x;
    size_t n;
    const double *const *truth, *const *result;
    double *const *errors;
} call;

/* The displacement that centring adds. */
static void find_shift(const vg_measures *x, const double *truth, const double *result, double shift[3])
{
    double a[3] = {0, 0, 0}, b[3] = {0, 0, 0};
    if (x->centred) {
        vg_centroid(truth, x->m->nv, a);
        vg_centroid(result, x->m->nv, b);
    }
    vgi_subtract(a, b, shift);
}

static void measure_vertices(const vg_measures *x, const double *truth, const double *result, double *errors, pose *p)
{
    size_t nv = x->m->nv;
    double shift[3];
    find_shift(x, truth, result, shift);
    for (size_t v = 0; v < nv; v++) {
        const double *a = truth + 3 * v, *b = result + 3 * v;
        errors[v] = length_of((double[3]){b[0] - a[0] + shift[0], b[1] - a[1] + shift[1], b[2] - a[2] + shift[2]});
    }
    for (size_t v = 0; v < nv; v++) {
        p->sum += errors[v];
        p->squares += errors[v] * errors[v];
        if (errors[v] > p->largest) p->largest = errors[v];
        p->histogram[edge_below(x, errors[v])]++;
    }
}

static void measure_pose(void *context, size_t i)
{
    const call *c = context;
    const vg_measures *x = c->x;
    const double *const poses[2] = {c->truth[i], c->result[i]};
    pose p = {0};
    measure_vertices(x, poses[0], poses[1], c->errors[i], &p);
    for (size_t k = 0; k < x->nclasses; k++) vgi_measures_kernel_now()->faces(&x->classes[k], x->diagonal, poses, &p.faces);
    x->poses[i] = p;
}

/* Means and deviations of a range of vertices over the poses. */
enum { SOME_VERTICES = 1024 };
static void add_vertices(const call *c, size_t first, size_t last)
{
    for (size_t i = 0; i < c->n; i++) {
        const double *errors = c->errors[i], poses = (double)(c->x->frames + i + 1);
        double *restrict mean = c->x->vertex_mean, *restrict squares = c->x->vertex_squares;
        for (size_t v = first; v < last; v++) {
            double d = errors[v] - mean[v];
            mean[v] += d / poses;
            squares[v] += d * (errors[v] - mean[v]);
        }
    }
}

/* One share of the work over all poses; shares are disjoint: first histogram bins, then vertices. */
static void add_share(void *context, size_t i)
{
    const call *c = context;
    size_t nv = c->x->m->nv, first = (i - 1) * SOME_VERTICES;
    if (i > 0) return add_vertices(c, first, nv - first < SOME_VERTICES ? nv : first + SOME_VERTICES);
    for (size_t k = 0; k < c->n; k++)
        for (size_t v = 0; v < nv; v++) c->x->bins[bin_of(c->errors[k][v])]++;
}

static size_t vertex_of(const double *errors, double error)
{
    size_t v = 0;
    while (errors[v] != error) v++;
    return v;
}

static void add_pose(vg_measures *x, const pose *p, const double *errors)
{
    x->sum += p->sum;
    x->sum_squares += p->squares;
    if (p->largest > x->max) x->max = p->largest, x->max_vertex = vertex_of(errors, x->max), x->max_frame = x->frames;
    for (size_t i = 0; i < VG_ERROR_BINS; i++) x->histogram[i] += p->histogram[i];
    vgi_running_merge(&x->faces.orientation, &p->faces.orientation);
    vgi_running_merge(&x->faces.area, &p->faces.area);
    for (int k = 0; k < 2; k++) {
        vgi_running_merge(&x->faces.planarity[k], &p->faces.planarity[k]);
        for (int i = 0; i < 10; i++) x->faces.planarity_histogram[k][i] += p->faces.planarity_histogram[k][i];
    }
    x->frames++;
}

int vg_measures_add(vg_measures *x, size_t n, const double *const *truth, const double *const *result,
                    double *const *errors, vg_pose_error *found, vg_err *e)
{
    call c = {x, n, truth, result, errors};
    double nv = (double)x->m->nv;
    int r = vgi_grow(&x->poses, &x->poses_cap, n, sizeof *x->poses, e);
    if (r < 0) return r;
    vgi_parallel(x->threads, n, measure_pose, &c);
    double squares = x->sum_squares;
    for (size_t i = 0; i < n; i++)
        if (!isfinite(squares += x->poses[i].squares))
            return vg_fail(e, VG_EINPUT, "frame %zu: its coordinates are too large to be compared", x->frames + i);
    vgi_parallel(x->threads, 1 + (x->m->nv + SOME_VERTICES - 1) / SOME_VERTICES, add_share, &c);
    for (size_t i = 0; i < n; i++) {
        add_pose(x, &x->poses[i], errors[i]);
        if (found) found[i] = (vg_pose_error){nv > 0 ? x->poses[i].sum / nv : 0, x->poses[i].largest};
    }
    return VG_OK;
}

/* ---- the report ---- */

/* The smallest error that 95 % of the errors do not exceed. */
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

void vg_measures_get_stats(const vg_measures *x, vg_measure_stats *r)
{
    double n = (double)x->m->nv * (double)x->frames;
    *r = (vg_measure_stats){.frames = x->frames, .vertices = x->m->nv, .faces = x->m->nf, .diagonal = x->diagonal};
    r->mean = n > 0 ? x->sum / n : 0;
    r->rms = n > 0 ? sqrt(x->sum_squares / n) : 0;
    r->max = x->max, r->max_vertex = x->max_vertex, r->max_frame = x->max_frame;
    r->p95 = percentile_95(x);
    memcpy(r->histogram, x->histogram, sizeof r->histogram);
    double worst = 0;
    for (size_t v = 0; v < x->m->nv; v++)
        if (x->vertex_squares[v] > worst) worst = x->vertex_squares[v], r->sigma_vertex = v;
    r->sigma = x->frames ? sqrt(worst / (double)x->frames) : 0;
    const vgi_face_sums *f = &x->faces;
    r->orientation_mean = f->orientation.mean, r->orientation_max = f->orientation.max;
    r->orientation_sd = vgi_running_deviation(&f->orientation);
    r->area_mean = f->area.mean, r->area_max = f->area.max, r->area_sd = vgi_running_deviation(&f->area);
    r->faces_measured = (size_t)f->orientation.n;
    for (int i = 0; i < 2; i++) {
        r->planarity_mean[i] = f->planarity[i].mean;
        r->planarity_max[i] = f->planarity[i].max;
        r->planarity_faces[i] = (size_t)f->planarity[i].n;
        memcpy(r->planarity_histogram[i], f->planarity_histogram[i], sizeof r->planarity_histogram[i]);
    }
}
