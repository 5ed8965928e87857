/* space_relative.c: the two shape spaces that are invariant under rigid motion of the body, except for the mean
 * rotation of its surface, which is stored as three numbers.
 *
 * rotations: the rotation from each piece to its neighbour (after Lipman, Sorkine, Levin and Cohen-Or 2005), and
 * stretches. lengths: lengths of edges, and angles between neighbours (after Winkler, Drieseberg, Alexa and Hormann
 * 2010). The inverse takes two linear steps: the frames of the pieces by least squares over M_b = M_a Q_ab, one
 * factorisation per shape, each then projected to a rotation; and the vectors that follow from them.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/unwrap.h"
#include "numeric/polar.h"
#include "numeric/sparse.h"
#include "numeric/vec3.h"
#include "signal/space.h"

#include <math.h>
#include <stdlib.h>

struct vgi_relative {
    size_t root;       /* the piece whose frame is held in the solve */
    size_t nedges;     /* lengths: */
    uint32_t *edge;    /* nedges pairs of vertices */
    uint32_t *side;    /* 3 per piece: its edges, from each vertex to the next */
    double *length;    /* of the edges in the reference */
    double *edge_weight;
    size_t *at;        /* npairs + 1: index in the values where each pair begins */
    double *angle;     /* npairs: angle in the reference, for triangles that share an edge */
    double *axes;      /* lengths: 9 per piece: axes of the triangle in the reference; the identity if it has none */
    vgi_cholesky *cholesky;
    vgi_triplets triplets;
    double *q;         /* 9 per pair */
    double *x, *b, *rest; /* 9 per piece: frames, transposed; right-hand sides */
};

bool vgi_triangle_axes(const double edges[6], double m[9])
{
    double n[3], u[3], across[3], length = vgi_length(edges), size;
    vgi_cross(edges, edges + 3, n);
    size = vgi_length(n);
    if (!(size > 1e-12 * length * vgi_length(edges + 3))) return false;
    vgi_divided(edges, length, u), vgi_divide(n, size);
    vgi_cross(n, u, across);
    for (int k = 0; k < 3; k++) m[3 * k] = u[k], m[3 * k + 1] = across[k], m[3 * k + 2] = n[k];
    return true;
}

void vgi_relative_free(vgi_relative **out)
{
    vgi_relative *w = *out;
    if (!w) return;
    free(w->edge);
    free(w->side);
    free(w->length);
    free(w->edge_weight);
    free(w->at);
    free(w->angle);
    free(w->axes);
    vgi_cholesky_free(&w->cholesky);
    vgi_triplets_clear(&w->triplets);
    free(w->q);
    free(w->x);
    free(w->b);
    free(w->rest);
    free(w);
    *out = NULL;
}

/* ---- edges and angles ---- */

/* Whether the pair is measured by one angle (a hinge). */
static bool is_hinge(const vgi_space *s, size_t i)
{
    const vgi_neighbours *p = &s->pieces.pair[i];
    return s->kind == VG_SPACE_LENGTHS && p->from != VGI_NO_EDGE && vgi_is_triangle(&s->pieces, p->a) &&
           vgi_is_triangle(&s->pieces, p->b);
}

static double pair_weight(const vgi_space *s, size_t i)
{
    const vgi_neighbours *p = &s->pieces.pair[i];
    return sqrt((s->pieces.share[p->a] + s->pieces.share[p->b]) / 3);
}

/* Rotation about the shared edge from the normal of a to that of b; 0 if one is undefined. */
static double angle_of(const vgi_space *s, size_t i, const double *vertices)
{
    const vgi_neighbours *p = &s->pieces.pair[i];
    const double *from = vertices + 3 * (size_t)p->from, *to = vertices + 3 * (size_t)p->to;
    double edges[6], a[9], b[9], sine[3], axis[3] = {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
    double length = vgi_length(axis);
    vgi_piece_edges(&s->pieces, p->a, vertices, edges, edges + 3);
    bool both = vgi_triangle_axes(edges, a);
    vgi_piece_edges(&s->pieces, p->b, vertices, edges, edges + 3);
    if (!vgi_triangle_axes(edges, b) || !both || !(length > 0)) return 0;
    const double na[3] = {a[2], a[5], a[8]}, nb[3] = {b[2], b[5], b[8]};
    vgi_cross(na, nb, sine);
    return atan2(vgi_dot(sine, axis) / length, vgi_dot(na, nb));
}

static double edge_length(const double *vertices, const uint32_t *edge)
{
    return sqrt(vgi_square(vertices + 3 * (size_t)edge[0], vertices + 3 * (size_t)edge[1]));
}

void vgi_relative_lengths(const vgi_space *s, const double *pose, double *values)
{
    const vgi_relative *w = s->relative;
    for (size_t i = 0; i < w->nedges; i++)
        values[i] = (edge_length(pose, w->edge + 2 * i) - w->length[i]) * w->edge_weight[i];
    for (size_t i = 0; i < s->pieces.npairs; i++)
        if (is_hinge(s, i)) values[w->at[i]] = angle_of(s, i, pose) - w->angle[i];
}

/* ---- construction ---- */

static void number_edges(const vgi_pieces *p, vgi_relative *w, const vgi_piece_side *sides, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        if (!i || sides[i].low != sides[i - 1].low || sides[i].high != sides[i - 1].high) {
            w->edge[2 * w->nedges] = sides[i].low, w->edge[2 * w->nedges + 1] = sides[i].high;
            w->nedges++;
        }
        w->side[sides[i].at] = (uint32_t)(w->nedges - 1);
        w->edge_weight[w->nedges - 1] += p->share[sides[i].at / 3] / 3;
    }
}

static int make_edges(const vgi_space *s, const double *reference, vg_err *e)
{
    const vgi_pieces *p = &s->pieces;
    vgi_relative *w = s->relative;
    vgi_piece_side *sides = vgi_array(p->n, 3 * sizeof *sides, e);
    double least = 1e-9 * vg_diagonal(reference, s->g->faces.nv);
    int r = sides && (w->edge = vgi_array(p->n, 6 * sizeof *w->edge, e)) &&
               (w->side = vgi_array(p->n, 3 * sizeof *w->side, e)) &&
               (w->length = vgi_array(p->n, 3 * sizeof(double), e)) &&
               (w->edge_weight = vgi_array(p->n, 3 * sizeof(double), e)) &&
               (w->axes = vgi_array(p->n, 9 * sizeof(double), e)) ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) number_edges(p, w, sides, vgi_pieces_sides(p, sides));
    for (size_t i = 0; r == VG_OK && i < w->nedges; i++) {
        w->length[i] = edge_length(reference, w->edge + 2 * i);
        w->edge_weight[i] = sqrt(w->edge_weight[i]) / fmax(w->length[i], least > 0 ? least : 1);
    }
    for (size_t i = 0; r == VG_OK && i < p->n; i++)
        if (!vgi_is_triangle(p, i) || !vgi_triangle_axes(s->edges + 6 * i, w->axes + 9 * i))
            for (size_t k = 0; k < 3; k++) w->axes[9 * i + 4 * k] = 1;
    free(sides);
    return r;
}

/* Compute the index of each pair's numbers, and the size of a shape. */
static void lay_out(vgi_space *s, const double *reference)
{
    vgi_relative *w = s->relative;
    size_t at = s->kind == VG_SPACE_LENGTHS ? w->nedges : 0;
    for (size_t i = 0; i < s->pieces.npairs; i++) {
        w->at[i] = at;
        at += is_hinge(s, i) ? 1 : 3;
        if (is_hinge(s, i)) w->angle[i] = angle_of(s, i, reference);
    }
    w->at[s->pieces.npairs] = at;
    s->d = at + (s->kind == VG_SPACE_ROTATIONS ? 6 * s->pieces.n : 0) + 3;
    for (size_t i = 1; i < s->pieces.n; i++)
        if (s->pieces.share[i] > s->pieces.share[w->root]) w->root = i;
}

int vgi_relative_make(vgi_space *s, const double *reference, vg_err *e)
{
    size_t n = s->pieces.n, npairs = s->pieces.npairs;
    vgi_relative *w = s->relative = vgi_array(1, sizeof *w, e);
    if (!w) return VG_ENOMEM;
    if (s->pieces.parts != 1) return vg_fail(e, VG_EINPUT, "the mesh has %zu parts that no links join", s->pieces.parts);
    if (!(w->at = vgi_array(npairs + 1, sizeof *w->at, e)) || !(w->angle = vgi_array(npairs, sizeof(double), e)) ||
        !(w->q = vgi_array(npairs, 9 * sizeof(double), e)) || !(w->x = vgi_array(n, 9 * sizeof(double), e)) ||
        !(w->b = vgi_array(n, 9 * sizeof(double), e)) || !(w->rest = vgi_array(n, 9 * sizeof(double), e)))
        return VG_ENOMEM;
    if (s->kind == VG_SPACE_LENGTHS && make_edges(s, reference, e) < 0) return VG_ENOMEM;
    lay_out(s, reference);
    return VG_OK;
}

/* ---- from poses to numbers ---- */

/* Rotation of the whole surface: the rotation nearest to the mean of its pieces'. */
static void mean_turn(const vgi_space *s, const double *turns, double q[4])
{
    double sum[9] = {0}, m[9];
    for (size_t i = 0; i < s->pieces.n; i++) {
        vg_quat_matrix(turns + 4 * i, m);
        for (int k = 0; k < 9; k++) sum[k] += s->pieces.share[i] * m[k];
    }
    vgi_fit_rotation(sum, m);
    vg_quat_from_matrix(m, q);
}

/* The logarithm on the branch nearest to the previous one, times the weight; it replaces the previous one. */
static void put_log(const double q[4], double weight, double before[3], double *out)
{
    double l[3];
    vgi_branch_near(q, before, l);
    memcpy(before, l, sizeof l);
    vgi_scaled(weight * M_SQRT2 * 2, l, out);
}

/* An angle in a sequence of frames, without jumps by whole turns. */
static void put_angle(double weight, double *before, double *out)
{
    *out += 2 * M_PI * nearbyint((*before - *out) / (2 * M_PI));
    *before = *out;
    *out *= weight;
}

void vgi_relative_finish(const vgi_space *s, size_t n, const double *turns, double *values, size_t *jumps)
{
    const vgi_relative *w = s->relative;
    for (size_t i = 0; i <= s->pieces.npairs; i++) {
        bool last = i == s->pieces.npairs, hinge = !last && is_hinge(s, i);
        double before[3] = {0, 0, 0}, angle = 0, weight = last ? 1 : pair_weight(s, i), q[4];
        for (size_t f = 0; f < n; f++) {
            const double *t = turns + 4 * f * s->nodes;
            double *out = values + f * s->d + (last ? s->d - 3 : w->at[i]);
            if (hinge) put_angle(weight, &angle, out);
            else if (last) mean_turn(s, t, q), put_log(q, weight, before, out);
            else {
                const double *a = t + 4 * (size_t)s->pieces.pair[i].a, *b = t + 4 * (size_t)s->pieces.pair[i].b;
                vg_quat_multiply((double[]){a[0], -a[1], -a[2], -a[3]}, b, q);
                put_log(q, weight, before, out);
            }
            *jumps += hinge ? fabs(angle) > M_PI : !last && vgi_dot(before, before) > M_PI * M_PI / 4;
        }
    }
}

/* ---- inverse: rotations between neighbours ---- */

/* The two edges of a triangle with these side lengths, in its own axes. */
static void lay_triangle(const double side[3], double edges[6])
{
    double a = side[0], b = side[1], c = side[2], x = a > 0 ? (a * a + c * c - b * b) / (2 * a) : 0;
    memset(edges, 0, 6 * sizeof *edges);
    edges[0] = a;
    edges[3] = fmin(fmax(x, -c), c);
    edges[4] = sqrt(fmax(c * c - x * x, 0));
}

/* lengths: edges of the pieces in their own axes, written to s->moved. */
static void lay_pieces(const vgi_space *s, const double *values)
{
    const vgi_relative *w = s->relative;
    for (size_t i = 0; i < s->pieces.n; i++) {
        double side[3] = {0, 0, 0}, *edges = s->moved + 6 * i;
        bool triangle = vgi_is_triangle(&s->pieces, i);
        for (size_t k = 0; k < (triangle ? 3u : 1u); k++) {
            size_t j = w->side[3 * i + k];
            side[k] = fmax(w->length[j] + values[j] / w->edge_weight[j], 1e-3 * w->length[j]);
        }
        if (triangle) lay_triangle(side, edges);
        double length = vgi_length(s->edges + 6 * i);
        for (size_t k = 0; k < 3 && !triangle; k++) /* a segment is as in the reference */
            edges[k] = length > 0 ? s->edges[6 * i + k] * side[0] / length : 0;
    }
}

static void about_axis(size_t axis, double angle, double m[9])
{
    size_t a = (axis + 1) % 3, b = (axis + 2) % 3;
    memset(m, 0, 9 * sizeof *m);
    m[4 * axis] = 1;
    m[4 * a] = m[4 * b] = cos(angle);
    m[3 * b + a] = sin(angle), m[3 * a + b] = -sin(angle);
}

/* Direction, in the axes of piece i, of the edge between two of its vertices. */
static double direction(const vgi_space *s, size_t i, uint32_t from, uint32_t to)
{
    const uint32_t *v = s->pieces.vert + 3 * i;
    const double *e = s->moved + 6 * i, none[2] = {0, 0};
    const double *a = from == v[0] ? none : from == v[1] ? e : e + 3, *b = to == v[0] ? none : to == v[1] ? e : e + 3;
    return atan2(b[1] - a[1], b[0] - a[0]);
}

/* First from axes of a to axes of b by the angles; then relative to the rotations in the reference. */
static void turn_of_hinge(const vgi_space *s, size_t i, double angle, double q[9])
{
    const vgi_neighbours *p = &s->pieces.pair[i];
    const double *a = s->relative->axes + 9 * (size_t)p->a, *b = s->relative->axes + 9 * (size_t)p->b;
    double first[9], fold[9], last[9], back[9];
    about_axis(2, direction(s, p->a, p->from, p->to), first);
    about_axis(0, angle, fold);
    about_axis(2, -direction(s, p->b, p->from, p->to), last);
    vgi_multiply(first, fold, q);
    vgi_multiply(q, last, q);
    for (size_t k = 0; k < 9; k++) back[k] = b[3 * (k % 3) + k / 3];
    vgi_multiply(a, q, q);
    vgi_multiply(q, back, q);
}

static void turn_of_log(const double *values, double weight, double q[9])
{
    double l[4] = {0}, turn[4];
    vgi_divided(values, weight * M_SQRT2 * 2, l + 1);
    vg_quat_exp(l, turn);
    vg_quat_matrix(turn, q);
}

static void find_turns(const vgi_space *s, const double *values)
{
    const vgi_relative *w = s->relative;
    for (size_t i = 0; i < s->pieces.npairs; i++) {
        double weight = pair_weight(s, i);
        if (is_hinge(s, i)) turn_of_hinge(s, i, w->angle[i] + values[w->at[i]] / weight, w->q + 9 * i);
        else turn_of_log(values + w->at[i], weight, w->q + 9 * i);
    }
}

/* ---- inverse: frames by least squares ---- */

static size_t unknown(const vgi_relative *r, size_t piece) /* of all but the root */
{
    return piece - (piece > r->root);
}

/* Unknowns are the frames, transposed: X_b = Q' X_a. */
static void fill_system(const vgi_space *s)
{
    vgi_relative *w = s->relative;
    w->triplets.n = 0;
    memset(w->b, 0, 9 * s->pieces.n * sizeof *w->b);
    for (size_t i = 0; i < s->pieces.npairs; i++) {
        const vgi_neighbours *p = &s->pieces.pair[i];
        const double *q = w->q + 9 * i;
        bool a = p->a != w->root, b = p->b != w->root;
        size_t at_a = 3 * unknown(w, p->a), at_b = 3 * unknown(w, p->b);
        for (size_t k = 0; k < 3; k++) {
            if (a) vgi_triplets_put(&w->triplets, at_a + k, at_a + k, 1);
            if (b) vgi_triplets_put(&w->triplets, at_b + k, at_b + k, 1);
            for (size_t c = 0; c < 3; c++) {
                if (a && b) vgi_triplets_put(&w->triplets, at_a + k, at_b + c, -q[3 * k + c]);
                else if (b) w->b[3 * (at_b + c) + k] += q[3 * k + c];
                else w->b[3 * (at_a + k) + c] += q[3 * k + c];
            }
        }
    }
}

/* rest := b - N x, pair by pair */
static void find_rest(const vgi_space *s)
{
    vgi_relative *w = s->relative;
    memcpy(w->rest, w->b, 9 * s->pieces.n * sizeof *w->b);
    for (size_t i = 0; i < s->pieces.npairs; i++) {
        const vgi_neighbours *p = &s->pieces.pair[i];
        const double *q = w->q + 9 * i;
        bool both = p->a != w->root && p->b != w->root;
        double *xa = w->x + 9 * unknown(w, p->a), *xb = w->x + 9 * unknown(w, p->b);
        double *ra = w->rest + 9 * unknown(w, p->a), *rb = w->rest + 9 * unknown(w, p->b);
        for (size_t k = 0; k < 9 && p->a != w->root; k++) ra[k] -= xa[k];
        for (size_t k = 0; k < 9 && p->b != w->root; k++) rb[k] -= xb[k];
        for (size_t k = 0; k < 3 && both; k++)
            for (size_t c = 0; c < 3; c++)
                for (size_t m = 0; m < 3; m++) {
                    ra[3 * k + m] += q[3 * k + c] * xb[3 * c + m];
                    rb[3 * c + m] += q[3 * k + c] * xa[3 * k + m];
                }
    }
}

static int factorize_frames(const vgi_space *s, vg_err *e)
{
    vgi_relative *w = s->relative;
    vgi_sparse a = {0};
    size_t n = 3 * (s->pieces.n - 1);
    int r = w->triplets.row ? VG_OK : vgi_triplets_make(&w->triplets, 15 * s->pieces.npairs, e);
    if (r == VG_OK) {
        fill_system(s);
        r = vgi_triplets_sum(&w->triplets, n, &a, e);
    }
    if (r == VG_OK && !w->cholesky) r = vgi_cholesky_new(&w->cholesky, &a, NULL, e);
    if (r == VG_OK) r = vgi_cholesky_factorize(w->cholesky, &a, e);
    vgi_sparse_clear(&a);
    return r;
}

/* Solve, with one step of iterative refinement. */
static int solve_frames(const vgi_space *s, vg_err *e)
{
    vgi_relative *w = s->relative;
    size_t n = 9 * (s->pieces.n - 1);
    memcpy(w->x, w->b, n * sizeof *w->x);
    int r = vgi_cholesky_solve(w->cholesky, w->x, e);
    if (r < 0) return r;
    find_rest(s);
    r = vgi_cholesky_solve(w->cholesky, w->rest, e);
    for (size_t i = 0; i < n && r == VG_OK; i++) w->x[i] += w->rest[i];
    return r;
}

/* Frame of piece i before the rotation of the whole. */
static void frame_of(const vgi_space *s, size_t i, double frame[9])
{
    const vgi_relative *w = s->relative;
    double m[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const double *x = w->x + 9 * unknown(w, i);
    for (size_t k = 0; k < 9 && i != w->root; k++) m[k] = x[3 * (k % 3) + k / 3];
    vgi_fit_rotation(m, frame);
}

/* The rotation that gives the surface the wanted mean rotation. */
static void turn_whole(const vgi_space *s, const double *values, double whole[9])
{
    double sum[9] = {0}, m[9], back[9];
    for (size_t i = 0; i < s->pieces.n; i++) {
        frame_of(s, i, m);
        for (int k = 0; k < 9; k++) sum[k] += s->pieces.share[i] * m[k];
    }
    vgi_fit_rotation(sum, m);
    for (size_t k = 0; k < 9; k++) back[k] = m[3 * (k % 3) + k / 3];
    turn_of_log(values + s->d - 3, 1, m);
    vgi_multiply(m, back, whole);
}

int vgi_relative_edges(vgi_space *s, const double *values, vg_err *e)
{
    vgi_relative *w = s->relative;
    double whole[9];
    int r = VG_OK;
    if (s->kind == VG_SPACE_LENGTHS) lay_pieces(s, values);
    find_turns(s, values);
    if (s->pieces.n > 1 && ((r = factorize_frames(s, e)) < 0 || (r = solve_frames(s, e)) < 0)) return r;
    turn_whole(s, values, whole);
    for (size_t i = 0; i < s->pieces.n; i++) {
        double m[9], stretch[9], *edges = s->moved + 6 * i;
        frame_of(s, i, m);
        vgi_multiply(whole, m, m);
        if (s->kind == VG_SPACE_ROTATIONS) {
            vgi_stretch_get(values + vgi_space_stretch_at(s, i), sqrt(s->pieces.share[i]), stretch);
            vgi_multiply(m, stretch, m);
            memcpy(edges, s->edges + 6 * i, 6 * sizeof *edges);
        } else if (vgi_is_triangle(&s->pieces, i)) vgi_multiply(m, w->axes + 9 * i, m);
        vgi_multiply_vector(m, edges, edges);
        vgi_multiply_vector(m, edges + 3, edges + 3);
    }
    return r;
}
