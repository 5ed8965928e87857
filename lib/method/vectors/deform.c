/* deform.c: measures the rotation and stretch of each vector of a pose relative to the reference pose, and applies
 * them to the vectors of another mesh (MATH 4 and 5, pose deformation; T 3.3, T 4.2).
 *
 * There are two implementations with the same results. The kernel (deform_kernel.c) does whole faces in eight poses
 * at once and never forms a quaternion. The scalar code below does: for faces with degenerate corners, for line
 * segments, for links, and when quaternions are requested.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/deform.h"
#include "numeric/vec3.h"
#include "method/vectors/deform_kernel.h"
#include "method/vectors/moments.h"
#include "model/incidence.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>

enum { CHUNK = 1024, /* faces per task */
       ENOUGH = 64 };
static const double shortest = 1e-9;      /* in D: a shorter vector has no direction */
static const double flat = 1e-12;         /* see deform_kernel.c */

struct vg_deformer {
    const vg_graph *g;
    int threads;
    double shortest2; /* squared, in mesh units */
    size_t faces;     /* number of faces, without links */
    double *vector;   /* per corner of the reference: the vector */
    double *length;   /* its length, 0 if degenerate */
    double *frame;    /* per corner: unit quaternion of its frame; unused for 2-vertex faces */
    unsigned char *slow; /* per face: needs the scalar code */
    vgi_incidence around; /* faces at each vertex, only with links */
    double *target;   /* per corner: the target's vector */
    vgi_method method;
    double *coordinates; /* see vgi_transfer */
    vgi_gradient *gradient;
    vgi_gradient_face *gradient_face;
    atomic_uint_fast64_t degenerate, first_face;
    /* per thread: vectors and quaternions of the largest face (work_scalars numbers), then the kernel's lanes */
    double *work;
    size_t work_size, work_scalars;
};

/* ---- one face in one pose ---- */

/* The unit quaternion of the frame [u b n] of a corner; false if the corner is degenerate. */
static bool corner_frame(const vg_deformer *d, const double w[3], const double n[3], double *length, double q[4])
{
    *length = vgi_length(w);
    if (!(*length * *length > d->shortest2)) return false;
    double u[3], m[3], b[3];
    vgi_divided(w, *length, u);
    memcpy(m, n, sizeof m), vgi_add_scaled(m, -vgi_dot(u, n), u);
    double sine = vgi_length(m);
    if (!(sine > flat)) return false;
    vgi_divide(m, sine);
    vgi_cross(m, u, b);
    const double matrix[9] = {u[0], b[0], m[0], u[1], b[1], m[1], u[2], b[2], m[2]};
    vg_quat_from_matrix(matrix, q);
    return true;
}

/* Add unit quaternion q to a sum, with the sign that agrees with the sum so far. */
static void add_turn(double sum[4], const double q[4])
{
    double sign = sum[0] * q[0] + sum[1] * q[1] + sum[2] * q[2] + sum[3] * q[3] < 0 ? -1 : 1;
    for (int k = 0; k < 4; k++) sum[k] += sign * q[k];
}

static void make_unit(double q[4])
{
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (length > 0) {
        for (int k = 0; k < 4; k++) q[k] /= length;
    } else {
        q[0] = 1, q[1] = q[2] = q[3] = 0;
    }
}

/* Deformation of every corner of a face with 3 or more corners. Returns the number of degenerate ones. w: vectors of
 * the face in the pose. */
static size_t measure_polygon(const vg_deformer *d, size_t f, const double *w, double *quaternions)
{
    uint32_t begin = d->g->faces.start[f];
    size_t r = vgi_face_size(&d->g->faces, f), bad = 0;
    double n[3], mean[4] = {0, 0, 0, 0};
    bool has_normal = vgi_unit_normal(w, r, n);
    for (size_t i = 0; i < r; i++) {
        double *q = quaternions + 4 * i, now[4], length, before = d->length[begin + i];
        if (!has_normal || before == 0 || !corner_frame(d, w + 3 * i, n, &length, now)) {
            /* filled in below; Q of a valid corner is never all zero but its first number may be, so mark all four */
            q[0] = 0;
            q[1] = q[2] = q[3] = 0;
            bad++;
            continue;
        }
        const double *ref = d->frame + 4 * (size_t)(begin + i), back[4] = {ref[0], -ref[1], -ref[2], -ref[3]};
        vg_quat_multiply(now, back, q);
        add_turn(mean, q);
        double root = sqrt(length / before);
        for (int k = 0; k < 4; k++) q[k] *= root;
    }
    if (bad) {
        make_unit(mean);
        for (size_t i = 0; i < r; i++) {
            double *q = quaternions + 4 * i;
            if (q[0] == 0 && q[1] == 0 && q[2] == 0 && q[3] == 0) memcpy(q, mean, sizeof mean);
        }
    }
    return bad;
}

/* A 2-vertex face: both corners get the smallest rotation after the rotation `base` (a unit quaternion; the identity
 * for bones). */
static size_t measure_segment(const vg_deformer *d, size_t f, const double *w, const double base[4],
                              double *quaternions)
{
    uint32_t begin = d->g->faces.start[f];
    double length = vgi_length(w), before = d->length[begin];
    size_t bad = 0;
    if (before == 0 || !(length * length > d->shortest2)) {
        memcpy(quaternions, base, 4 * sizeof *base);
        bad = 2;
    } else {
        double turned[3], rest[4];
        vg_quat_apply(base, d->vector + 3 * (size_t)begin, turned);
        vg_quat_between(turned, w, rest);
        vg_quat_multiply(rest, base, quaternions);
    }
    memcpy(quaternions + 4, quaternions, 4 * sizeof *quaternions);
    return bad;
}

/* ---- loading the vectors of a face ---- */

static void face_vectors(const vg_graph *g, size_t f, vg_kind kind, const double *pose, double *w)
{
    uint32_t begin = g->faces.start[f];
    size_t r = vgi_face_size(&g->faces, f);
    if (kind == VG_VECTORS) {
        memcpy(w, pose + 3 * (size_t)begin, 3 * r * sizeof *w);
        return;
    }
    double centre[3] = {0, 0, 0};
    for (size_t i = 0; i < r; i++)
        for (int k = 0; k < 3; k++) centre[k] += w[3 * i + k] = pose[3 * (size_t)g->faces.vert[begin + i] + k];
    vgi_divide(centre, (double)r);
    for (size_t i = 0; i < r; i++)
        vgi_deduct(w + 3 * i, centre);
}

static const double identity[4] = {1, 0, 0, 0};

/* Deformation of face f (not a link) in one pose, by the scalar code. w: workspace for its vectors. */
static size_t measure_face(const vg_deformer *d, size_t f, vg_kind kind, const double *pose, double *w,
                           double *quaternions)
{
    face_vectors(d->g, f, kind, pose, w);
    if (vgi_face_size(&d->g->faces, f) == 2) return measure_segment(d, f, w, identity, quaternions);
    return measure_polygon(d, f, w, quaternions);
}

/* Mean rotation of the faces around both ends of a link, without links, from at most ENOUGH corners per end. w, q:
 * workspace. */
static void turn_beside(const vg_deformer *d, size_t link, vg_kind kind, const double *pose, double *w, double *q,
                        double mean[4])
{
    const vg_graph *g = d->g;
    memset(mean, 0, 4 * sizeof *mean);
    for (int end = 0; end < 2; end++) {
        uint32_t v = g->faces.vert[g->faces.start[link] + (uint32_t)end];
        uint32_t first = d->around.first[v], last = d->around.first[v + 1];
        if (last - first > ENOUGH) last = first + ENOUGH;
        for (uint32_t i = first; i < last; i++) {
            size_t f = d->around.face[i];
            if (f >= d->faces) continue;
            measure_face(d, f, kind, pose, w, q);
            for (size_t c = 0; c < vgi_face_size(&g->faces, f); c++) {
                make_unit(q + 4 * c);
                add_turn(mean, q + 4 * c);
            }
        }
    }
    make_unit(mean);
}

static size_t measure_link(const vg_deformer *d, size_t link, vg_kind kind, const double *pose, double *w, double *q)
{
    double mean[4];
    turn_beside(d, link, kind, pose, w, w + 3 * d->g->max_corners, mean);
    face_vectors(d->g, link, kind, pose, w);
    measure_segment(d, link, w, mean, q);
    return 0; /* a link between coincident vertices has no direction and needs none */
}

static size_t measure_any(const vg_deformer *d, size_t f, vg_kind kind, const double *pose, double *w, double *q)
{
    return f < d->faces ? measure_face(d, f, kind, pose, w, q) : measure_link(d, f, kind, pose, w, q);
}

static void apply_face(const vg_deformer *d, size_t f, const double *quaternions, double *vectors)
{
    uint32_t begin = d->g->faces.start[f];
    for (size_t i = 0; i < vgi_face_size(&d->g->faces, f); i++)
        vg_quat_apply(quaternions + 4 * i, d->target + 3 * (size_t)(begin + i), vectors + 3 * (size_t)(begin + i));
}

static void count_degenerate(vg_deformer *d, size_t f, size_t bad)
{
    if (!bad) return;
    atomic_fetch_add(&d->degenerate, bad);
    uint_fast64_t least = atomic_load(&d->first_face);
    while (f < least && !atomic_compare_exchange_weak(&d->first_face, &least, f)) continue;
}

/* ---- construction ---- */

static void measure_reference(vg_deformer *d)
{
    const vg_graph *g = d->g;
    for (size_t f = 0; f < g->faces.nf; f++) {
        size_t r = vgi_face_size(&g->faces, f);
        const double *w = d->vector + 3 * (size_t)g->faces.start[f];
        double n[3];
        bool good = r == 2 || vgi_unit_normal(w, r, n);
        d->slow[f] = r == 2 || !good;
        for (size_t i = 0; i < r; i++) {
            size_t c = g->faces.start[f] + i;
            double *length = &d->length[c];
            *length = vgi_length(d->vector + 3 * c);
            bool usable = good && *length * *length > d->shortest2;
            if (usable && r > 2) usable = corner_frame(d, d->vector + 3 * c, n, length, d->frame + 4 * c);
            if (!usable) *length = 0, d->slow[f] = 1;
        }
    }
}

static int make_workspace(vg_deformer *d, vg_err *e)
{
    size_t r = d->g->max_corners + 1, per_lane = sizeof(vgi_lanes) / sizeof(double);
    d->work_scalars = (7 * r + per_lane - 1) / per_lane * per_lane;
    d->work_size = d->work_scalars + 2 * r * 3 * per_lane;
    d->work = aligned_alloc(sizeof(vgi_lanes), (size_t)d->threads * d->work_size * sizeof *d->work);
    return d->work ? VG_OK : vg_fail(e, VG_ENOMEM, "not enough memory for faces of %zu corners", r - 1);
}

/* Everything that does not depend on the reference. diagonal: its D. */
static int make_deformer(vg_deformer **out, const vg_graph *g, double diagonal, int threads, vg_err *e)
{
    size_t corners = vg_graph_corners(g);
    vg_deformer *d = *out = vgi_array(1, sizeof *d, e);
    if (!d) return VG_ENOMEM;
    d->g = g, d->threads = threads, d->faces = g->faces.nf - g->nlinks;
    atomic_init(&d->first_face, UINT64_MAX);
    double least = shortest * diagonal;
    d->shortest2 = least * least;
    d->vector = vgi_array_raw(3 * corners, sizeof *d->vector, e);
    d->length = vgi_array_raw(corners, sizeof *d->length, e);
    d->frame = vgi_array(4 * corners, sizeof *d->frame, e);
    d->slow = vgi_array(g->faces.nf, sizeof *d->slow, e);
    bool ok = d->vector && d->length && d->frame && d->slow && make_workspace(d, e) == VG_OK;
    if (ok && g->nlinks) {
        ok = vgi_incidence_make(&d->around, &g->faces, e) == VG_OK;
    }
    if (!ok) return vg_deformer_free(out), VG_ENOMEM;
    return VG_OK;
}

int vg_deformer_new(vg_deformer **d, const vg_graph *g, const double *reference, int threads, vg_err *e)
{
    if (make_deformer(d, g, vg_diagonal(reference, g->faces.nv), threads, e) < 0) return VG_ENOMEM;
    vg_graph_vectors(g, reference, (*d)->vector);
    measure_reference(*d);
    return VG_OK;
}

int vgi_deformer_of_vectors(vg_deformer **d, const vg_graph *g, const double *vectors, double diagonal, int threads,
                            vg_err *e)
{
    if (make_deformer(d, g, diagonal, threads, e) < 0) return VG_ENOMEM;
    memcpy((*d)->vector, vectors, 3 * vg_graph_corners(g) * sizeof *vectors);
    measure_reference(*d);
    return VG_OK;
}

void vg_deformer_free(vg_deformer **out)
{
    vg_deformer *d = *out;
    if (!d) return;
    free(d->vector);
    free(d->length);
    free(d->frame);
    free(d->slow);
    vgi_incidence_clear(&d->around);
    free(d->target);
    free(d->coordinates);
    free(d->gradient);
    free(d->gradient_face);
    free(d->work);
    free(d);
    *out = NULL;
}

/* The target's size relative to the source: the root of the ratio of their sums of squared vectors. */
static double size_ratio(const vg_deformer *d)
{
    double source2 = 0, target2 = 0;
    size_t n = 3 * (size_t)d->g->faces.start[d->faces];
    for (size_t i = 0; i < n; i++) source2 += d->vector[i] * d->vector[i], target2 += d->target[i] * d->target[i];
    return source2 > 0 ? sqrt(target2 / source2) : 1;
}

/* k = F_r' r_t / |r|, by offset F_r' (r_t - scale r) */
static void make_coordinates(vg_deformer *d, double scale)
{
    bool offset = d->method == VGI_OFFSET;
    size_t corners = vg_graph_corners(d->g);
    for (size_t c = 0; c < corners; c++) {
        const double *q = d->frame + 4 * c, back[4] = {q[0], -q[1], -q[2], -q[3]};
        double b[3] = {d->target[3 * c], d->target[3 * c + 1], d->target[3 * c + 2]};
        if (offset) vgi_add_scaled(b, -scale, d->vector + 3 * c);
        vg_quat_apply(back, b, d->coordinates + 3 * c);
        if (!offset && d->length[c] > 0) vgi_divide(d->coordinates + 3 * c, d->length[c]);
    }
}

/* A face without a usable gradient (nearly a line) is done corner by corner by the scalar code. */
static void make_gradient(vg_deformer *d, size_t f, double scale)
{
    const vg_graph *g = d->g;
    size_t begin = g->faces.start[f], r = vgi_face_size(&g->faces, f);
    double P[6], size, source2 = 0, target2 = 0;
    vgi_gradient_face *face = &d->gradient_face[f];
    if (!vgi_gradient_moments(d->vector + 3 * begin, r, P, face->q, &size)) {
        d->slow[f] = 1;
        return;
    }
    for (size_t i = 3 * begin; i < 3 * (begin + r); i++) {
        source2 += d->vector[i] * d->vector[i];
        target2 += d->target[i] * d->target[i];
    }
    face->rho = d->method == VGI_OFFSET ? scale : sqrt(target2 / source2);
    for (size_t c = begin; c < begin + r; c++) {
        vgi_symmetric_times(P, d->vector + 3 * c, d->gradient[c].p);
        for (size_t k = 0; k < 3; k++) d->gradient[c].b[k] = d->target[3 * c + k] - face->rho * d->vector[3 * c + k];
    }
}

static int make_gradients(vg_deformer *d, double scale, vg_err *e)
{
    if (!d->gradient) d->gradient = vgi_array(vg_graph_corners(d->g), sizeof *d->gradient, e);
    if (!d->gradient_face) d->gradient_face = vgi_array(d->g->faces.nf, sizeof *d->gradient_face, e);
    if (!d->gradient || !d->gradient_face) return VG_ENOMEM;
    for (size_t f = 0; f < d->faces; f++)
        if (!d->slow[f]) make_gradient(d, f, scale);
    return VG_OK;
}

int vg_deformer_target(vg_deformer *d, const double *target_vectors, vg_method method, vg_err *e)
{
    size_t corners = vg_graph_corners(d->g);
    free(d->target);
    d->target = vgi_copy_array(target_vectors, 3 * corners, sizeof *d->target, e);
    if (!d->coordinates) d->coordinates = vgi_array_raw(3 * corners, sizeof *d->coordinates, e);
    if (!d->target || !d->coordinates) return VG_ENOMEM;
    static const vgi_method methods[] = {[VG_BY_POSE] = VGI_POSE, [VG_BY_GRADIENT] = VGI_GRADIENT,
                                         [VG_BY_BLEND] = VGI_BLEND, [VG_BY_OFFSET] = VGI_OFFSET};
    double scale = size_ratio(d);
    d->method = methods[method];
    make_coordinates(d, scale);
    return d->method == VGI_POSE ? VG_OK : make_gradients(d, scale, e);
}

vg_deform_stats vg_deformer_get_stats(const vg_deformer *d)
{
    return (vg_deform_stats){atomic_load(&d->degenerate), atomic_load(&d->first_face)};
}

/* ---- many faces and poses ---- */

typedef struct deform_job deform_job;
typedef void deform_step(deform_job *job, double *work, size_t first, size_t last);
struct deform_job {
    vg_deformer *d;
    size_t n;
    vg_kind kind;
    const double *const *in;
    double *const *out;
    deform_step *step;
    atomic_size_t next; /* next face to process */
};

static void run_worker(void *context, size_t worker)
{
    deform_job *j = context;
    size_t nf = j->d->g->faces.nf;
    double *work = j->d->work + worker * j->d->work_size;
    for (size_t first; (first = atomic_fetch_add(&j->next, CHUNK)) < nf;)
        j->step(j, work, first, first + CHUNK < nf ? first + CHUNK : nf);
}

static void run_deform(deform_job *j)
{
    atomic_init(&j->next, 0);
    vgi_parallel(j->d->threads, (size_t)j->d->threads, run_worker, j);
}

static void measure_step(deform_job *j, double *work, size_t first, size_t last)
{
    vg_deformer *d = j->d;
    for (size_t f = first; f < last; f++)
        for (size_t p = 0; p < j->n; p++)
            count_degenerate(d, f,
                             measure_any(d, f, j->kind, j->in[p], work, j->out[p] + 4 * (size_t)d->g->faces.start[f]));
}

void vg_deformer_measure(vg_deformer *d, size_t n, vg_kind kind, const double *const *poses,
                         double *const *quaternions)
{
    deform_job j = {.d = d, .n = n, .kind = kind, .in = poses, .out = quaternions, .step = measure_step};
    run_deform(&j);
}

static void apply_step(deform_job *j, double *work, size_t first, size_t last)
{
    (void)work;
    const vg_graph *g = j->d->g;
    for (size_t f = first; f < last; f++)
        for (size_t p = 0; p < j->n; p++) apply_face(j->d, f, j->in[p] + 4 * (size_t)g->faces.start[f], j->out[p]);
}

void vg_deformer_apply(vg_deformer *d, size_t n, const double *const *quaternions, double *const *vectors)
{
    deform_job j = {.d = d, .n = n, .in = quaternions, .out = vectors, .step = apply_step};
    run_deform(&j);
}

static void transfer_slowly(deform_job *j, double *work, size_t f, size_t p)
{
    const vg_deformer *d = j->d;
    double *quaternions = work + 3 * d->g->max_corners;
    count_degenerate(j->d, f, measure_any(d, f, j->kind, j->in[p], work, quaternions));
    apply_face(d, f, quaternions, j->out[p]);
}

/* Context of the kernel's callback for faces that are degenerate in some poses. */
typedef struct redo {
    deform_job *job;
    double *work;
    size_t first_pose;
} redo;

static void redo_slowly(void *context, size_t face, unsigned lanes)
{
    redo *r = context;
    for (size_t k = 0; k < VGI_LANES; k++)
        if (lanes >> k & 1) transfer_slowly(r->job, r->work, face, r->first_pose + k);
}

static void transfer_step(deform_job *j, double *work, size_t first, size_t last)
{
    vg_deformer *d = j->d;
    vgi_lane_point *lanes = (vgi_lane_point *)(void *)(work + d->work_scalars);
    for (size_t p = 0; p < j->n; p += VGI_LANES) {
        size_t n = j->n - p < VGI_LANES ? j->n - p : VGI_LANES;
        const double *poses[VGI_LANES];
        for (size_t k = 0; k < VGI_LANES; k++) poses[k] = j->in[p + (k < n ? k : n - 1)];
        redo again = {j, work, p};
        const vgi_transfer t = {.start = d->g->faces.start,
                                .vert = d->g->faces.vert,
                                .poses = poses,
                                .vertices = j->kind == VG_VERTICES,
                                .method = d->method,
                                .coordinates = d->coordinates,
                                .gradient = d->gradient,
                                .gradient_face = d->gradient_face,
                                .shortest2 = d->shortest2,
                                .skip = d->slow,
                                .out = j->out + p,
                                .lanes = n,
                                .bad = redo_slowly,
                                .context = &again};
        vgi_transfer_faces(&t, first, last, lanes, d->g->max_corners);
        for (size_t f = first; f < last; f++)
            for (size_t k = 0; k < n && d->slow[f]; k++) transfer_slowly(j, work, f, p + k);
    }
}

void vg_deformer_transfer(vg_deformer *d, size_t n, vg_kind kind, const double *const *poses, double *const *vectors)
{
    deform_job j = {.d = d, .n = n, .kind = kind, .in = poses, .out = vectors, .step = transfer_step};
    run_deform(&j);
}
