/* interpolate.c: a path through key poses. Each vector rotates and stretches from one key to the next along the
 * geodesic (MATH 7; T 6.1), or on a curve whose velocity is continuous at the keys. Directions of rotation are chosen
 * in unwrap.c; vertices are reconstructed in reconstruct.c.
 *
 * Logarithms are those of quaternions: axis times half angle, and half the logarithm of the scale.
 *
 * From key a to key b a corner rotates by Q = exp(turn) exp(rest), and at u in [0, 1] by exp(u turn) exp(u rest). If
 * nothing rotates by more than half a turn, turn is the logarithm of Q and rest is 0: the geodesic of (T 6.25).
 * Beyond half a turn the logarithms of single corners are unusable, because near a whole turn the axis depends on
 * small differences between neighbours. There turn is a vector field that varies smoothly over the mesh, and rest,
 * applied first, is the remaining rotation of each corner.
 *
 * The vectors of anchors, relative to the anchors' mean, are treated alike and stored after those of the corners,
 * with the mean rotation of all.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/vec3.h"
#include "method/vectors/unwrap.h"
#include "method/vectors/deform.h"
#include "model/incidence.h"
#include "numeric/polar.h"

#include <math.h>
#include <stdlib.h>

enum { CHUNK = 1024, /* corners per task */
       SLOTS = 3 };  /* a smooth curve uses the segments before and after its own */
static const double shortest = 1e-9; /* in D: a shorter vector has no direction */
static const double exact = 1e-13;   /* in D: smaller residuals of rotation and scale are rounding errors */

/* From one key to the next. */
typedef struct segment {
    size_t number; /* SIZE_MAX: unused */
    double *from;  /* 3 per element (corners, then anchors): the vectors at the first key */
    double *turn;  /* 3 */
    double *rest;  /* 3, if has_rest */
    double *scale; /* 1: half the logarithm */
    double *drift; /* 3, if has_drift: residual rotation, applied before the rotation, and scale: degenerate corners,
                      anchors */
    bool has_rest, has_drift;
    double root[2][3], middle[2][3]; /* root, and mean of the anchors, at both keys */
} segment;

struct vg_path {
    const vg_graph *g;
    vg_path_options o;
    const vg_key *keys;
    size_t nkeys, corners, elements;
    double diagonal, shortest2, exact; /* mesh units */
    double *reference; /* vectors, if the keys hold deformations */
    segment slots[SLOTS];
    double *to, *q;    /* of the segment under construction: vectors at its second key, one quaternion per element */
    vgi_incidence around; /* only with line segments */
    vg_path_stats stats;
};

/* ---- keys ---- */

static void load_vectors(const vg_path *p, const vg_key *key, double *w)
{
    if (p->o.kind == VG_VERTICES) {
        vg_graph_vectors(p->g, key->values, w);
    } else if (p->o.kind == VG_VECTORS) {
        memcpy(w, key->values, 3 * p->corners * sizeof *w);
    } else {
        for (size_t c = 0; c < p->corners; c++) vg_quat_apply(key->values + 4 * c, p->reference + 3 * c, w + 3 * c);
    }
}

/* The anchors' mean, and the anchors relative to it. */
static void load_anchors(const vg_path *p, const vg_key *key, double *w, double middle[3])
{
    vg_centroid(key->anchors, p->o.nanchors, middle);
    for (size_t i = 0; i < 3 * p->o.nanchors; i++) w[3 * p->corners + i] = key->anchors[i] - middle[i % 3];
}

static double length_of(const vg_path *p, size_t s)
{
    return p->keys[s + 1].place - p->keys[s].place;
}

/* ---- line segments ---- */

/* Two vectors do not determine the rotation of a line segment about itself. It follows the best common rotation of
 * the vectors around it, or where these are not sufficient, that of the whole body; then the smallest rotation is
 * applied. */
static void add_moment(const vg_path *p, const double *from, size_t f, double b[9], double *size)
{
    for (size_t c = p->g->faces.start[f]; c < p->g->faces.start[f + 1]; c++) {
        const double *was = from + 3 * c, *is = p->to + 3 * c;
        for (int i = 0; i < 9; i++) b[i] += is[i / 3] * was[i % 3];
        *size += sqrt(vgi_dot(was, was) * vgi_dot(is, is));
    }
}

static void turn_line(vg_path *p, const double *from, size_t f, const double body[9])
{
    static const double little = 0.01;
    const vg_graph *g = p->g;
    double b[9] = {0}, size = 0, base[4], turned[3], more[4], *q = p->q + 4 * (size_t)g->faces.start[f];
    const double *was = from + 3 * (size_t)g->faces.start[f], *is = p->to + 3 * (size_t)g->faces.start[f];
    for (size_t end = g->faces.start[f]; end < g->faces.start[f + 1]; end++) {
        uint32_t v = g->faces.vert[end];
        for (uint32_t i = p->around.first[v]; i < p->around.first[v + 1]; i++)
            if (p->around.face[i] < g->faces.nf - g->nlinks) add_moment(p, from, p->around.face[i], b, &size);
    }
    for (int i = 0; i < 9; i++) b[i] = (size > 0 ? b[i] / size : 0) + little * body[i];
    vgi_best_turn(b, base);
    memcpy(q, base, sizeof base);
    if (vgi_dot(was, was) > p->shortest2 && vgi_dot(is, is) > p->shortest2) {
        vg_quat_apply(base, was, turned);
        vg_quat_between(turned, is, more);
        vg_quat_multiply(more, base, q);
    }
    memcpy(q + 4, q, 4 * sizeof *q);
}

static void turn_lines(vg_path *p, const double *from)
{
    double body[9] = {0}, size = 0;
    if (!p->around.first) return;
    for (size_t f = 0; f < p->g->faces.nf - p->g->nlinks; f++) add_moment(p, from, f, body, &size);
    for (int i = 0; i < 9; i++) body[i] = size > 0 ? body[i] / size : i % 4 == 0;
    for (size_t f = 0; f < p->g->faces.nf; f++)
        if (p->g->faces.start[f + 1] - p->g->faces.start[f] == 2) turn_line(p, from, f, body);
}

/* ---- a segment ---- */

static int measure_segment(vg_path *p, const segment *s, vg_err *e)
{
    vg_deformer *d;
    const double *to = p->to;
    double *q = p->q;
    if (vgi_deformer_of_vectors(&d, p->g, s->from, p->diagonal, p->o.threads, e) < 0) return VG_ENOMEM;
    vg_deformer_measure(d, 1, VG_VECTORS, &to, &q);
    vg_deform_stats counts = vg_deformer_get_stats(d);
    p->stats.degenerate.corners += counts.corners;
    if (counts.first_face < p->stats.degenerate.first_face) p->stats.degenerate.first_face = counts.first_face;
    vg_deformer_free(&d);
    turn_lines(p, s->from);
    return VG_OK;
}

/* Q = exp(turn) exp(rest), and half the logarithm of the scale. turn: on input the rotation of the face. */
static void split(const double *q, const double face[3], bool beyond, double *turn, double *rest, double *scale)
{
    double length = sqrt(q[0] * q[0] + vgi_dot(q + 1, q + 1)), unit[4];
    for (int k = 0; k < 4; k++) unit[k] = q[k] / length;
    *scale = log(length);
    if (!beyond) {
        vgi_branch_near(unit, face, turn);
        return;
    }
    double back[4] = {0, -face[0], -face[1], -face[2]}, left[4], l[4];
    vg_quat_exp(back, back);
    vg_quat_multiply(back, unit, left);
    vgi_shorter(left);
    vg_quat_log(left, l);
    memcpy(turn, face, 3 * sizeof *turn);
    memcpy(rest, l + 1, 3 * sizeof *rest);
}

/* Anchors follow the body as a whole: the mean rotation over its corners, weighted by squared length. */
static void turn_anchors(const vg_path *p, segment *s)
{
    double mean[4] = {0, 0, 0, 0}, weight = 0;
    for (size_t c = 0; c < p->corners; c++) {
        double w = vgi_dot(s->from + 3 * c, s->from + 3 * c);
        weight += w;
        vgi_add_scaled(mean + 1, w, s->turn + 3 * c);
    }
    for (int k = 1; k < 4 && weight > 0; k++) mean[k] /= weight;
    for (size_t i = p->corners; i < p->elements; i++) {
        memcpy(s->turn + 3 * i, mean + 1, 3 * sizeof *mean);
        memset(s->rest + 3 * i, 0, 3 * sizeof *mean);
        s->scale[i] = 0;
    }
}

static void find_drift(vg_path *p, segment *s)
{
    s->has_drift = false;
    for (size_t i = 0; i < p->elements; i++) {
        double a[4] = {s->scale[i]}, b[4] = {0}, q[4], got[3];
        const double *want = p->to + 3 * i;
        memcpy(a + 1, s->turn + 3 * i, 3 * sizeof *a);
        vg_quat_exp(a, q);
        if (s->has_rest) {
            memcpy(b + 1, s->rest + 3 * i, 3 * sizeof *b);
            vg_quat_exp(b, b);
            vg_quat_multiply(q, b, q);
        }
        vg_quat_apply(q, s->from + 3 * i, got);
        memset(s->drift + 3 * i, 0, 3 * sizeof *s->drift);
        if (vgi_square(got, want) <= p->exact * p->exact) continue;
        double length2 = exp(2 * s->scale[i]), *drift = s->drift + 3 * i;
        const double back[4] = {q[0] / length2, -q[1] / length2, -q[2] / length2, -q[3] / length2};
        vg_quat_apply(back, want, drift);
        vgi_deduct(drift, s->from + 3 * i);
        s->has_drift = true;
    }
}

static int fill_segment(vg_path *p, segment *s, size_t number, vg_err *e)
{
    const vg_graph *g = p->g;
    const vg_key *key = p->keys + number;
    bool beyond;
    s->number = SIZE_MAX;
    load_vectors(p, key, s->from);
    load_vectors(p, key + 1, p->to);
    for (int k = 0; k < 2; k++) {
        memcpy(s->root[k], key[k].root, sizeof s->root[k]);
        load_anchors(p, key + k, k ? p->to : s->from, s->middle[k]);
    }
    double *face = vgi_array_raw(g->faces.nf, 3 * sizeof *face, e);
    int r = face ? measure_segment(p, s, e) : VG_ENOMEM;
    if (r == VG_OK) r = vgi_choose_turns(g, p->q, face, &beyond, e);
    for (size_t f = 0; r == VG_OK && f < g->faces.nf; f++)
        for (size_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++)
            split(p->q + 4 * c, face + 3 * f, beyond, s->turn + 3 * c, s->rest + 3 * c, s->scale + c);
    free(face);
    if (r < 0) return r;
    s->has_rest = beyond;
    p->stats.beyond += beyond;
    p->stats.segments++;
    turn_anchors(p, s);
    find_drift(p, s);
    s->number = number;
    return VG_OK;
}

/* Segments in use at one time differ by less than SLOTS in number. */
static int get_segment(vg_path *p, size_t number, const segment **s, vg_err *e)
{
    segment *slot = &p->slots[p->o.smooth ? number % SLOTS : 0];
    *s = slot;
    return slot->number == number ? VG_OK : fill_segment(p, slot, number, e);
}

/* ---- velocities at keys ---- */

/* A key between segments of lengths h0 and h1 with velocities v0 and v1 (per segment). Its velocity is that of the
 * parabola through three keys, v = before v0 + after v1, per unit of place. At the first and last key: that of the
 * adjacent parabola. */
typedef struct knot {
    const segment *first, *second;
    double before, after;
} knot;

static void make_knot(const vg_path *p, size_t key, knot *x)
{
    size_t s = key == 0 ? 1 : key == p->nkeys - 1 ? key - 1 : key; /* the key between the two segments */
    double h0 = length_of(p, s - 1), h1 = length_of(p, s);
    x->before = h1 / (h0 * (h0 + h1)), x->after = h0 / (h1 * (h0 + h1));
    if (key < s) x->before = 2 / h0 - x->before, x->after = -x->after;
    if (key > s) x->before = -x->before, x->after = 2 / h1 - x->after;
}

/* ---- a pose ---- */

/* Position in a segment. Q(u) = exp(A) exp(along turn) exp(along rest) exp(B). On the geodesic A = B = 0. On a
 * curve through keys, let alpha and beta be the differences of the keys' velocities at its last and first key from
 * the segment's own; then A = (u^3 - u^2) alpha and B = u (1 - u)^2 beta. This is a cubic Hermite curve on the
 * group, and the ordinary one if all rotations share an axis. Before the first and after the last key the velocity
 * is constant. */
typedef struct moment {
    const vg_path *p;
    const segment *s;
    bool bent;
    double along, drift;
    double alpha, last_own, beta, first_own; /* weights in A and B: of the difference, and of the segment's own
                                                velocity */
    double length; /* of s in places */
    knot first, last;
    double *vectors, *offsets;
} moment;

/* Change of an element's rotation and scale per unit of u, at the first (0) or last (1) key of a segment. */
static void velocity(const segment *s, size_t i, int end, double v[4])
{
    const double *turn = s->turn + 3 * i;
    double r[3] = {0, 0, 0};
    if (s->has_rest) memcpy(r, s->rest + 3 * i, sizeof r);
    if (s->has_rest && end) {
        double q[4] = {0, turn[0], turn[1], turn[2]};
        vg_quat_exp(q, q);
        vg_quat_apply(q, s->rest + 3 * i, r);
    }
    v[0] = s->scale[i];
    vgi_sum(turn, r, v + 1);
}

/* own: the segment's velocity there; excess: velocity at the knot minus own. */
static void look_at_knot(const moment *m, const knot *x, size_t i, int end, double own[4], double excess[4])
{
    double v0[4], v1[4];
    velocity(m->s, i, end, own);
    velocity(x->first, i, 1, v0);
    velocity(x->second, i, 0, v1);
    for (int k = 0; k < 4; k++) excess[k] = m->length * (x->before * v0[k] + x->after * v1[k]) - own[k];
}

static void turn_by(double weight, const double *turn, double q[4])
{
    double l[4] = {0, weight * turn[0], weight * turn[1], weight * turn[2]}, more[4], product[4];
    vg_quat_exp(l, more);
    vg_quat_multiply(q, more, product);
    memcpy(q, product, sizeof product);
}

static void turn_bent(const moment *m, size_t i, double q[4])
{
    const segment *s = m->s;
    double own[4], excess[4], A[4], B[4];
    look_at_knot(m, &m->last, i, 1, own, excess);
    for (int k = 0; k < 4; k++) A[k] = m->alpha * excess[k] + m->last_own * own[k];
    look_at_knot(m, &m->first, i, 0, own, excess);
    for (int k = 0; k < 4; k++) B[k] = m->beta * excess[k] + m->first_own * own[k];
    A[0] += B[0] + m->along * s->scale[i];
    vg_quat_exp(A, q);
    turn_by(m->along, s->turn + 3 * i, q);
    if (s->has_rest) turn_by(m->along, s->rest + 3 * i, q);
    turn_by(1, B + 1, q);
}

static void turn_element(const moment *m, size_t i, double *to)
{
    const segment *s = m->s;
    double q[4], w[3];
    memcpy(w, s->from + 3 * i, sizeof w);
    if (s->has_drift) vgi_add_scaled(w, m->drift, s->drift + 3 * i);
    if (m->bent) {
        turn_bent(m, i, q);
    } else {
        double l[4] = {m->along * s->scale[i]};
        vgi_scaled(m->along, s->turn + 3 * i, l + 1);
        vg_quat_exp(l, q);
        if (s->has_rest) turn_by(m->along, s->rest + 3 * i, q);
    }
    vg_quat_apply(q, w, to);
}

static void turn_chunk(void *context, size_t chunk)
{
    const moment *m = context;
    size_t corners = m->p->corners, first = chunk * CHUNK, end = first + CHUNK;
    if (end > m->p->elements) end = m->p->elements;
    for (size_t i = first; i < end; i++)
        turn_element(m, i, i < corners ? m->vectors + 3 * i : m->offsets + 3 * (i - corners));
}

/* The same for a point that does not rotate. points: the point at both keys of a segment. */
static void glide(const moment *m, double points(const segment *s, int key, int k), double to[3])
{
    for (int k = 0; k < 3; k++) {
        double own = points(m->s, 1, k) - points(m->s, 0, k);
        to[k] = points(m->s, 0, k) + m->along * own;
        if (!m->bent) continue;
        double excess[2];
        for (int i = 0; i < 2; i++) {
            const knot *x = i ? &m->last : &m->first;
            excess[i] = m->length * (x->before * (points(x->first, 1, k) - points(x->first, 0, k)) +
                                     x->after * (points(x->second, 1, k) - points(x->second, 0, k))) - own;
        }
        to[k] += m->beta * excess[0] + m->first_own * own + m->alpha * excess[1] + m->last_own * own;
    }
}

static double root_of(const segment *s, int key, int k)
{
    return s->root[key][k];
}

static double middle_of(const segment *s, int key, int k)
{
    return s->middle[key][k];
}

static int find_moment(vg_path *p, double t, moment *m, vg_err *e)
{
    size_t last = p->nkeys - 2, number = t > 0 ? (t < (double)last ? (size_t)t : last) : 0;
    double u = t - (double)number;
    *m = (moment){.p = p, .along = u, .drift = u, .bent = p->o.smooth && p->nkeys > 2};
    int r = get_segment(p, number, &m->s, e);
    if (r < 0 || !m->bent) return r;
    const segment *beside[3] = {NULL, m->s, NULL};
    if (number > 0) r = get_segment(p, number - 1, &beside[0], e);
    if (r == VG_OK && number < last) r = get_segment(p, number + 1, &beside[2], e);
    if (r < 0) return r;
    m->length = length_of(p, number);
    m->first = (knot){.first = beside[number == 0], .second = beside[1 + (number == 0)]};
    m->last = (knot){.first = beside[number < last], .second = beside[1 + (number < last)]};
    make_knot(p, number, &m->first);
    make_knot(p, number + 1, &m->last);
    m->along = u < 0 ? 0 : u > 1 ? 1 : u;
    m->drift = m->along * m->along * (3 - 2 * m->along);
    if (u < 0) {
        m->beta = m->first_own = u;
    } else if (u > 1) {
        m->alpha = m->last_own = u - 1;
    } else {
        m->alpha = u * u * (u - 1), m->beta = u * (1 - u) * (1 - u);
    }
    return VG_OK;
}

int vg_path_at(vg_path *p, double t, double *vectors, double root[3], double *anchors, vg_err *e)
{
    moment m;
    double middle[3];
    if (find_moment(p, t, &m, e) < 0) return VG_ENOMEM;
    m.vectors = vectors, m.offsets = anchors;
    vgi_parallel(p->o.threads, (p->elements + CHUNK - 1) / CHUNK, turn_chunk, &m);
    glide(&m, root_of, root);
    glide(&m, middle_of, middle);
    for (size_t i = 0; i < 3 * p->o.nanchors; i++) anchors[i] += middle[i % 3];
    return VG_OK;
}

/* ---- construction ---- */

static bool has_lines(const vg_graph *g)
{
    for (size_t f = 0; f < g->faces.nf; f++)
        if (g->faces.start[f + 1] - g->faces.start[f] == 2) return true;
    return false;
}

static int make_slot(vg_path *p, segment *s, vg_err *e)
{
    size_t n = p->elements;
    s->number = SIZE_MAX;
    s->from = vgi_array_raw(n, 3 * sizeof *s->from, e);
    s->turn = vgi_array_raw(n, 3 * sizeof *s->turn, e);
    s->rest = vgi_array_raw(n, 3 * sizeof *s->rest, e);
    s->drift = vgi_array_raw(n, 3 * sizeof *s->drift, e);
    s->scale = vgi_array_raw(n, sizeof *s->scale, e);
    return s->from && s->turn && s->rest && s->drift && s->scale ? VG_OK : VG_ENOMEM;
}

static int make_arrays(vg_path *p, const double *reference, vg_err *e)
{
    const vg_graph *g = p->g;
    int r = VG_OK;
    p->to = vgi_array_raw(p->elements, 3 * sizeof *p->to, e);
    p->q = vgi_array_raw(p->corners, 4 * sizeof *p->q, e);
    if (!p->to || !p->q) return VG_ENOMEM;
    if (p->o.kind == VG_DEFORMATIONS) {
        p->reference = vgi_array_raw(p->corners, 3 * sizeof *p->reference, e);
        if (!p->reference) return VG_ENOMEM;
        vg_graph_vectors(g, reference, p->reference);
    }
    if (has_lines(g)) r = vgi_incidence_make(&p->around, &g->faces, e);
    for (int i = 0; r == VG_OK && i < (p->o.smooth ? SLOTS : 1); i++) r = make_slot(p, &p->slots[i], e);
    return r;
}

int vg_path_new(vg_path **out, const vg_graph *g, const double *reference, const vg_key *keys, size_t nkeys,
                const vg_path_options *o, vg_err *e)
{
    *out = NULL;
    if (nkeys < 2) return vg_fail(e, VG_EARG, "a path needs at least two poses");
    for (size_t i = 0; i + 1 < nkeys; i++)
        if (!(keys[i + 1].place > keys[i].place)) return vg_fail(e, VG_EARG, "the positions of a path's keys must "
                                                                             "ascend");
    vg_path *p = *out = vgi_array(1, sizeof *p, e);
    if (!p) return VG_ENOMEM;
    double D = vg_diagonal(reference, g->faces.nv);
    p->g = g, p->o = *o, p->keys = keys, p->nkeys = nkeys;
    p->diagonal = D;
    p->corners = vg_graph_corners(g), p->elements = p->corners + o->nanchors;
    p->shortest2 = shortest * D * shortest * D, p->exact = exact * D;
    p->stats.degenerate.first_face = UINT64_MAX;
    int r = make_arrays(p, reference, e);
    if (r < 0) vg_path_free(out);
    return r;
}

void vg_path_free(vg_path **out)
{
    vg_path *p = *out;
    if (!p) return;
    for (int i = 0; i < SLOTS; i++) {
        segment *s = &p->slots[i];
        free(s->from);
        free(s->turn);
        free(s->rest);
        free(s->drift);
        free(s->scale);
    }
    vgi_incidence_clear(&p->around);
    free(p->reference);
    free(p->to);
    free(p->q);
    free(p);
    *out = NULL;
}

vg_path_stats vg_path_get_stats(const vg_path *p)
{
    return p->stats;
}
