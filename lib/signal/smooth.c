/* smooth.c: smoothing over a moving window of frames; rigid motion and pose are filtered separately. The filters are
 * in weights.c and robust_time.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/smooth.h"
#include "numeric/polar.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

enum { ROOT = 7, CHUNK = 3 * 512 }; /* numbers of the rigid motion (quaternion, centroid); numbers per task */

struct vg_smoother {
    vgi_time_filter pose, root;
    size_t nv, reach, places; /* places: frames in the window */
    int threads;
    const double *reference;
    double centre[3];         /* of the reference */
    double *window;           /* places x (ROOT + 3 nv): root, then the pose without it */
    double *weight;           /* places */
    const double **frame;     /* places: the frames of a window, in order */
    size_t known, given;      /* frames added, frames returned */
    bool ended;
};

static double *place_of(const vg_smoother *s, size_t i)
{
    return s->window + (i % s->places) * (ROOT + 3 * s->nv);
}

int vg_smoother_new(vg_smoother **out, const vg_smoother_options *o, size_t nv, const double *reference, vg_err *e)
{
    vg_smoother *s = *out = vgi_array(1, sizeof *s, e);
    size_t numbers;
    if (!s) return VG_ENOMEM;
    *s = (vg_smoother){.nv = nv, .reference = reference, .threads = o->threads};
    int r = vgi_time_filter_make(&s->pose, o->filter, o->span, e);
    if (r == VG_OK) r = vgi_time_filter_make(&s->root, o->filter, o->root_span, e);
    if (r == VG_OK) {
        s->reach = s->pose.reach > s->root.reach ? s->pose.reach : s->root.reach;
        s->places = 2 * s->reach + 1;
        vg_centroid(reference, nv, s->centre);
        if (!vgi_mul(s->places, ROOT + 3 * nv, &numbers)) numbers = SIZE_MAX / 2;
        s->window = vgi_array(numbers, sizeof *s->window, e);
        s->weight = vgi_array(s->places, sizeof *s->weight, e);
        s->frame = vgi_array(s->places, sizeof *s->frame, e);
        if (!s->window || !s->weight || !s->frame) r = VG_ENOMEM;
    }
    if (r < 0) vg_smoother_free(out);
    return r;
}

void vg_smoother_free(vg_smoother **out)
{
    vg_smoother *s = *out;
    if (!s) return;
    vgi_time_filter_clear(&s->pose);
    vgi_time_filter_clear(&s->root);
    free(s->window);
    free(s->weight);
    free(s->frame);
    free(s);
    *out = NULL;
}

size_t vg_smoother_reach(const vg_smoother *s)
{
    return s->reach;
}

/* ---- rigid motion and pose ---- */

/* If the reference does not determine the rotation (points on a line), the previous frame's is kept. */
static void find_turn(const vg_smoother *s, const double *vertices, const double *before, double root[ROOT])
{
    double b[9] = {0}, size = 0, same = 0;
    vg_centroid(vertices, s->nv, root + 4);
    for (size_t v = 0; v < s->nv; v++) {
        const double *p = vertices + 3 * v, *q = s->reference + 3 * v, *c = s->centre, *d = root + 4;
        vgi_add_outer(b, 1, (double[]){p[0] - d[0], p[1] - d[1], p[2] - d[2]},
                      (double[]){q[0] - c[0], q[1] - c[1], q[2] - c[2]});
    }
    for (int k = 0; k < 9; k++) size += fabs(b[k]);
    vgi_best_turn_near(b, size > 0 ? 1e-12 * size : 1, before, root);
    for (int k = 0; k < 4; k++) same += root[k] * before[k];
    for (int k = 0; k < 4 && same < 0; k++) root[k] = -root[k];
}

void vg_smoother_add(vg_smoother *s, const double *vertices)
{
    static const double none[4] = {1, 0, 0, 0};
    double m[9], before[4], *root = place_of(s, s->known), *pose = root + ROOT;
    memcpy(before, s->known ? place_of(s, s->known - 1) : none, sizeof before);
    find_turn(s, vertices, before, root);
    vg_quat_matrix((double[]){root[0], -root[1], -root[2], -root[3]}, m);
    for (size_t v = 0; v < s->nv; v++) {
        const double *p = vertices + 3 * v, *c = root + 4;
        vgi_multiply_vector(m, (double[]){p[0] - c[0], p[1] - c[1], p[2] - c[2]}, pose + 3 * v);
    }
    s->known++;
}

void vg_smoother_end(vg_smoother *s)
{
    s->ended = true;
}

/* ---- the filter ---- */

typedef struct filtering {
    const vg_smoother *s;
    const vgi_time_filter *t;
    size_t lo, n, at; /* window; the frame's place in it */
    size_t first, width, numbers; /* of a frame: first number, numbers per point, total */
    double *out;
} filtering;

static void filter_chunk(void *context, size_t task)
{
    const filtering *f = context;
    size_t from = task * CHUNK, to = from + CHUNK < f->numbers ? from + CHUNK : f->numbers;
    if (f->t->span > 0 && f->t->filter == VG_ROBUST) {
        const double *frame[VGI_MOST_ROBUST];
        for (size_t j = 0; j < f->n; j++) frame[j] = f->s->frame[j] + f->first + from;
        vgi_robust_points((to - from) / f->width, f->width, f->n, frame, f->at, (double)f->t->reach, f->out + from);
        return;
    }
    memset(f->out + from, 0, (to - from) * sizeof *f->out);
    for (size_t j = 0; j < f->n; j++) {
        const double *x = f->s->frame[j] + f->first;
        double w = f->s->weight[j];
        for (size_t i = from; i < to && w != 0; i++) f->out[i] += w * x[i];
    }
}

/* apply one filter to the numbers of frame `given` that begin at `first` */
static void filter_part(vg_smoother *s, const vgi_time_filter *t, size_t first, size_t width, size_t numbers, double *out)
{
    filtering f = {.s = s, .t = t, .first = first, .width = width, .numbers = numbers, .out = out};
    vgi_time_window(t, s->given, s->known, s->ended, &f.lo, &f.n);
    f.at = s->given - f.lo;
    for (size_t j = 0; j < f.n; j++) s->frame[j] = place_of(s, f.lo + j);
    if (t->filter != VG_ROBUST || t->span == 0) vgi_time_weights(t, s->given, s->known, f.lo, f.n, s->weight);
    vgi_parallel(s->threads, (numbers + CHUNK - 1) / CHUNK, filter_chunk, &f);
}

bool vg_smoother_next(vg_smoother *s, double *vertices)
{
    double root[ROOT], m[9], length = 0;
    /* the first frames wait until the window is full, because near the start they depend on all of it */
    size_t needs = s->given + s->reach + 1 > s->places ? s->given + s->reach + 1 : s->places;
    if (s->given == s->known || (!s->ended && s->known < needs)) return false;
    filter_part(s, &s->root, 0, 4, 4, root);
    filter_part(s, &s->root, 4, 3, 3, root + 4);
    filter_part(s, &s->pose, ROOT, 3, 3 * s->nv, vertices);
    for (int k = 0; k < 4; k++) length += root[k] * root[k];
    if (!(length > 0)) memcpy(root, place_of(s, s->given), 4 * sizeof *root), length = 1;
    for (int k = 0; k < 4; k++) root[k] /= sqrt(length);
    vg_quat_matrix(root, m);
    for (size_t v = 0; v < s->nv; v++) {
        vgi_multiply_vector(m, vertices + 3 * v, vertices + 3 * v);
        vgi_add(vertices + 3 * v, root + 4);
    }
    s->given++;
    return true;
}
