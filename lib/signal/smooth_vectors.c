/* smooth_vectors.c: the vector graph filtered in time: how each vector turns and stretches against the reference pose, as
 * in MATH 4, filtered in the logarithm. A limb that swings keeps its length, where the mean of its vertices would be
 * shorter.
 * The window of frames is in window.c, the filters are in weights.c and robust_time.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/smooth.h"
#include "numeric/polar.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

enum { CHUNK = 128 }; /* corners of a task */

struct vg_vector_smoother {
    vgi_window window; /* a pose without the rigid motion: the anchors; per corner: ln(scale) / 2; unit quaternion */
    const vg_graph *g;
    size_t corners, nanchors;
    int threads;
    double *reference;  /* vectors of the reference pose, one per corner */
    vg_deformer *deformer;
    double *quaternion, *scale; /* per corner: room for a pose with its rigid motion, and its ln(scale) / 2 */
};

int vg_vector_smoother_new(vg_vector_smoother **out, const vg_smoother_options *o, const vg_graph *g,
                           const double *reference, size_t nanchors, vg_err *e)
{
    vg_vector_smoother *s = *out = vgi_array(1, sizeof *s, e);
    if (!s) return VG_ENOMEM;
    *s = (vg_vector_smoother){
        .g = g, .corners = vg_graph_corners(g), .nanchors = nanchors, .threads = o->threads};
    s->reference = vgi_array(3 * s->corners, sizeof *s->reference, e);
    s->quaternion = vgi_array(4 * s->corners, sizeof *s->quaternion, e);
    s->scale = vgi_array(s->corners, sizeof *s->scale, e);
    int r = s->reference && s->quaternion && s->scale ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) {
        vg_graph_vectors(g, reference, s->reference);
        r = vg_deformer_new(&s->deformer, g, reference, o->threads, e);
    }
    if (r == VG_OK) r = vg_deformer_target(s->deformer, s->reference, VG_BY_POSE, e);
    if (r == VG_OK) r = vgi_window_make(&s->window, o, 3 * nanchors + 5 * s->corners, e);
    if (r < 0) vg_vector_smoother_free(out);
    return r;
}

void vg_vector_smoother_free(vg_vector_smoother **out)
{
    vg_vector_smoother *s = *out;
    if (!s) return;
    vgi_window_clear(&s->window);
    vg_deformer_free(&s->deformer);
    free(s->reference);
    free(s->quaternion);
    free(s->scale);
    free(s);
    *out = NULL;
}

/* where the scales and the rotations begin in a frame of the window */
static size_t scales_of(const vg_vector_smoother *s)
{
    return VGI_MOVED + 3 * s->nanchors;
}

static size_t rotations_of(const vg_vector_smoother *s)
{
    return scales_of(s) + s->corners;
}

size_t vg_vector_smoother_reach(const vg_vector_smoother *s)
{
    return s->window.reach;
}

vg_deform_stats vg_vector_smoother_get_stats(const vg_vector_smoother *s)
{
    return vg_deformer_get_stats(s->deformer);
}

/* ---- a frame without its rigid motion ---- */

/* The rotation that takes the reference vectors nearest to these ones. If they do not determine it, the previous
 * frame's is kept. */
static void find_turn(const vg_vector_smoother *s, const double *vectors, const double before[4], double turn[4])
{
    double b[9] = {0}, size = 0;
    for (size_t c = 0; c < s->corners; c++) vgi_add_outer(b, 1, vectors + 3 * c, s->reference + 3 * c);
    for (int k = 0; k < 9; k++) size += fabs(b[k]);
    vgi_best_turn_near(b, size > 0 ? 1e-12 * size : 1, before, turn);
    vgi_same_side(before, turn);
}

typedef struct parting {
    const vg_vector_smoother *s;
    const double *before;  /* quaternions of the previous frame, or NULL */
    const double *turn;
    double *scales, *pose; /* out */
} parting;

static void part_chunk(void *context, size_t task)
{
    const parting *p = context;
    const double *turn = p->turn, back[4] = {turn[0], -turn[1], -turn[2], -turn[3]}, none[4] = {1, 0, 0, 0};
    size_t to = task * CHUNK + CHUNK < p->s->corners ? task * CHUNK + CHUNK : p->s->corners;
    for (size_t c = task * CHUNK; c < to; c++) {
        double *q = p->pose + 4 * c, length = 0;
        vg_quat_multiply(back, p->s->quaternion + 4 * c, q);
        for (int k = 0; k < 4; k++) length += q[k] * q[k];
        for (int k = 0; k < 4; k++) q[k] /= sqrt(length);
        p->scales[c] = 0.5 * log(length);
        vgi_same_side(p->before ? p->before + 4 * c : none, q);
    }
}

static void part_anchors(const vg_vector_smoother *s, const double root[VGI_MOVED], const double *anchors, double *pose)
{
    const double back[4] = {root[0], -root[1], -root[2], -root[3]};
    for (size_t i = 0; i < s->nanchors; i++) {
        double away[3];
        vgi_subtract(anchors + 3 * i, root + 4, away);
        vg_quat_apply(back, away, pose + 3 * i);
    }
}

void vg_vector_smoother_add(vg_vector_smoother *s, const double *vectors, const double root[3], const double *anchors)
{
    vgi_window *w = &s->window;
    double *moved = vgi_window_place(w, w->known), *last = w->known ? vgi_window_place(w, w->known - 1) : NULL;
    double before[4] = {1, 0, 0, 0};
    if (last) memcpy(before, last, sizeof before);
    find_turn(s, vectors, before, moved);
    memcpy(moved + 4, root, 3 * sizeof *root);
    vg_deformer_measure(s->deformer, 1, VG_VECTORS, &vectors, &s->quaternion);
    part_anchors(s, moved, anchors, moved + VGI_MOVED);
    parting p = {s, last ? last + rotations_of(s) : NULL, moved, moved + scales_of(s), moved + rotations_of(s)};
    vgi_parallel(s->threads, (s->corners + CHUNK - 1) / CHUNK, part_chunk, &p);
    w->known++;
}

void vg_vector_smoother_end(vg_vector_smoother *s)
{
    s->window.ended = true;
}

/* ---- the filter ---- */

/* Where the logarithm is taken: at the mean of the quaternions as 4 numbers, which is near to the result; if they are all
 * over the place, at the one of the frame itself. */
static void find_base(const vgi_window *w, size_t first, bool weighted, double base[4])
{
    double sum[4] = {0}, length = 0;
    for (size_t j = 0; j < w->n; j++)
        for (int k = 0; k < 4; k++) sum[k] += (weighted ? w->weight[j] : 1.0 / (double)w->n) * w->frame[j][first + (size_t)k];
    for (int k = 0; k < 4; k++) length += sum[k] * sum[k];
    for (int k = 0; k < 4; k++) base[k] = length > 0.01 ? sum[k] / sqrt(length) : w->frame[w->at][first + (size_t)k];
}

/* The logarithm of a unit quaternion, as vg_quat_log's last three. Small ones by the series of the arcsine; of large ones
 * the branch nearest to `before`, the logarithm of the next frame: a wheel is followed through any number of turns. */
static void log_rotation(const double q[4], const double before[3], double l[3])
{
    static const double series[] = {1, 1.0 / 6, 3.0 / 40, 5.0 / 112, 35.0 / 1152, 63.0 / 2816, 231.0 / 13312, 143.0 / 10240};
    double sine2 = q[1] * q[1] + q[2] * q[2] + q[3] * q[3], ratio = 0, all[4], angle;
    if (q[0] > 0 && sine2 < 0.02) {
        for (int k = 8; k-- > 0;) ratio = ratio * sine2 + series[k];
        vgi_scaled(ratio, q + 1, l);
        if (vgi_dot(before, before) < 1) return;
    } else {
        vg_quat_log(q, all);
        memcpy(l, all + 1, 3 * sizeof *l);
    }
    angle = vgi_length(l);
    if (!(angle > 0)) return;
    vgi_scale(l, 1 + 2 * M_PI * round((vgi_dot(before, l) / angle - angle) / (2 * M_PI)) / angle);
}

/* Add frame j to a filter of the logarithms, seen from where `back` leads. last: of its neighbour nearer to the middle, and
 * then its own. */
static void add_logarithm(const vgi_window *w, size_t j, size_t first, const double back[4], double last[3],
                          double (*room)[3], double sum[3])
{
    double step[4], l[3];
    vg_quat_multiply(back, w->frame[j] + first, step);
    log_rotation(step, last, l);
    memcpy(last, l, sizeof l);
    if (room) memcpy(room[j], l, sizeof l);
    else vgi_add_scaled(sum, w->weight[j], l);
}

/* The filter of the logarithms of all rotations of the window, seen from `base`. */
static void filter_logarithms(const vgi_window *w, const vgi_time_filter *t, size_t first, const double base[4],
                              double (*room)[3], double sum[3])
{
    const double back[4] = {base[0], -base[1], -base[2], -base[3]};
    double last[3] = {0}, next[3];
    double(*kept)[3] = vgi_window_robust(t) ? room : NULL;
    sum[0] = sum[1] = sum[2] = 0;
    add_logarithm(w, w->at, first, back, last, kept, sum);
    memcpy(next, last, sizeof next);
    for (size_t j = w->at; j-- > 0;) add_logarithm(w, j, first, back, last, kept, sum);
    for (size_t j = w->at + 1; j < w->n; j++) add_logarithm(w, j, first, back, next, kept, sum);
    if (kept) {
        const double *place[VGI_MOST_ROBUST];
        for (size_t j = 0; j < w->n; j++) place[j] = kept[j];
        vgi_robust_points(1, 3, w->n, place, w->at, (double)t->reach, sum);
    }
}

/* One corner: base exp(filter of log(base^-1 q)), again from where it arrives until that is near to the base. */
static void filter_rotation(const vgi_window *w, const vgi_time_filter *t, size_t first, double (*room)[3], double out[4])
{
    enum { MOST = 4 };
    double step[4] = {0}, turn[4], moved[4], far = 1;
    find_base(w, first, !vgi_window_robust(t), out);
    for (int round = 0; round < MOST && far > 0.01; round++) {
        filter_logarithms(w, t, first, out, room, step + 1);
        vg_quat_exp(step, turn);
        vg_quat_multiply(out, turn, moved);
        memcpy(out, moved, sizeof moved);
        far = vgi_length(step + 1);
    }
}

typedef struct filtering {
    const vg_vector_smoother *s;
    const double *turn; /* filtered rotation of the body */
} filtering;

static void filter_chunk(void *context, size_t task)
{
    const filtering *f = context;
    const vg_vector_smoother *s = f->s;
    size_t to = task * CHUNK + CHUNK < s->corners ? task * CHUNK + CHUNK : s->corners;
    double room[VGI_MOST_ROBUST][3], q[4];
    for (size_t c = task * CHUNK; c < to; c++) {
        filter_rotation(&s->window, &s->window.pose, rotations_of(s) + 4 * c, room, q);
        vg_quat_multiply(f->turn, q, s->quaternion + 4 * c);
        for (int k = 0; k < 4; k++) s->quaternion[4 * c + (size_t)k] *= exp(s->scale[c]);
    }
}

bool vg_vector_smoother_next(vg_vector_smoother *s, double *vectors, double root[3], double *anchors)
{
    double moved[VGI_MOVED];
    const double *quaternions = s->quaternion;
    if (!vgi_window_ready(&s->window)) return false;
    vgi_window_root(&s->window, moved);
    vgi_window_filter(&s->window, &s->window.pose, s->threads, VGI_MOVED, 3, 3 * s->nanchors, anchors);
    for (size_t i = 0; i < s->nanchors; i++) {
        vg_quat_apply(moved, anchors + 3 * i, anchors + 3 * i);
        vgi_add(anchors + 3 * i, moved + 4);
    }
    vgi_window_filter(&s->window, &s->window.pose, s->threads, scales_of(s), 1, s->corners, s->scale);
    filtering f = {s, moved};
    vgi_parallel(s->threads, (s->corners + CHUNK - 1) / CHUNK, filter_chunk, &f);
    vg_deformer_apply(s->deformer, 1, &quaternions, &vectors);
    memcpy(root, moved + 4, 3 * sizeof *root);
    s->window.given++;
    return true;
}
