/* space.c: the shape spaces in which rotations have logarithms.
 *
 * vectors: 4 numbers per corner of the vector graph, logarithms of its rotation and scale. gradients: 9 per piece,
 * logarithm of the rotation, and the stretch, of the map of its edges and unit normal from the reference to the pose.
 * Rotations are measured from the mean of all frames, which is stored as their home. Numbers are weighted so that a
 * squared distance is a mean over the surface. Sums of them are computed in basis.c, positions by vg_solver.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/space.h"
#include "method/vectors/unwrap.h"
#include "numeric/polar.h"
#include "numeric/vec3.h"
#include "signal/branches.h"

#include <math.h>
#include <stdlib.h>

enum { BATCH = 8, OF_CORNER = 4, OF_PIECE = 9 };

void vgi_space_clear(vgi_space *s)
{
    vgi_pieces_clear(&s->pieces);
    vgi_relative_free(&s->relative);
    free(s->node_share);
    free(s->vectors);
    free(s->edges);
    free(s->inverse);
    free(s->moved);
    *s = (vgi_space){0};
}

static bool has_gradients(const vgi_space *s)
{
    return s->kind == VG_SPACE_GRADIENTS || s->kind == VG_SPACE_ROTATIONS;
}

static bool is_relative(const vgi_space *s)
{
    return s->kind == VG_SPACE_ROTATIONS || s->kind == VG_SPACE_LENGTHS;
}

size_t vgi_space_homes(const vgi_space *s)
{
    return is_relative(s) ? 0 : s->nodes;
}

static size_t node_of(const vgi_space *s, size_t piece)
{
    return s->kind == VG_SPACE_VECTORS ? s->pieces.face[piece] : piece;
}

/* ---- construction ---- */

static void invert_frames(vgi_space *s)
{
    for (size_t i = 0; i < s->pieces.n && s->inverse; i++) {
        double m[9], c[9], det;
        if (!vgi_is_triangle(&s->pieces, i) || !vgi_piece_frame(s->edges + 6 * i, s->edges + 6 * i + 3, m)) continue;
        det = vgi_cofactors(m, c);
        for (size_t k = 0; k < 9; k++) s->inverse[9 * i + k] = c[3 * (k % 3) + k / 3] / det;
    }
}

int vgi_space_make(vgi_space *s, vg_space kind, const vg_graph *g, const double *reference, vg_err *e)
{
    *s = (vgi_space){.kind = kind, .g = g};
    size_t corners = vg_graph_corners(g);
    int r = g->faces.nf ? vgi_pieces_make(&s->pieces, g, reference, e)
                  : vg_fail(e, VG_EINPUT, "the mesh has no faces: its shape space can only be vertices");
    if (r < 0) return r;
    s->nodes = kind == VG_SPACE_VECTORS ? g->faces.nf : s->pieces.n;
    s->d = kind == VG_SPACE_VECTORS ? OF_CORNER * corners : OF_PIECE * s->pieces.n;
    if ((s->vectors = vgi_array(corners, 3 * sizeof(double), e)) &&
        (s->edges = vgi_array(s->pieces.n, 6 * sizeof(double), e)) &&
        (s->moved = vgi_array(s->pieces.n, 6 * sizeof(double), e)) &&
        (s->node_share = vgi_array(s->nodes, sizeof(double), e)) &&
        (!has_gradients(s) || (s->inverse = vgi_array(s->pieces.n, 9 * sizeof(double), e)))) {
        vg_graph_vectors(g, reference, s->vectors);
        for (size_t i = 0; i < s->pieces.n; i++) {
            vgi_piece_edges(&s->pieces, i, reference, s->edges + 6 * i, s->edges + 6 * i + 3);
            s->node_share[node_of(s, i)] += s->pieces.share[i];
        }
        invert_frames(s);
        r = is_relative(s) ? vgi_relative_make(s, reference, e) : VG_OK;
    } else r = VG_ENOMEM;
    if (r < 0) vgi_space_clear(s);
    return r;
}

/* ---- stretches ---- */

static const size_t upper[6] = {0, 1, 2, 4, 5, 8};

static double twice(size_t k) /* weight of an element of a symmetric matrix: off the diagonal it occurs twice */
{
    return k == 0 || k == 3 || k == 5 ? 1 : M_SQRT2;
}

/* The inverse of vgi_stretch_get. */
static void put_stretch(const double m[9], double weight, double out[6])
{
    for (size_t k = 0; k < 6; k++) {
        size_t at = upper[k], across = 3 * (at % 3) + at / 3;
        out[k] = ((m[at] + m[across]) / 2 - (at % 4 == 0)) * twice(k) * weight;
    }
}

void vgi_stretch_get(const double in[6], double weight, double m[9])
{
    for (size_t k = 0; k < 6; k++) {
        size_t at = upper[k], across = 3 * (at % 3) + at / 3;
        m[at] = m[across] = in[k] / (twice(k) * weight) + (at % 4 == 0);
    }
}

/* ---- one pose ---- */

typedef struct measuring {
    const vgi_space *s;
    const double *poses;
    double *const *corners; /* quaternions of the corners in the frames of a batch */
    double *values, *turns; /* n x d, n x 4 nodes */
    size_t first;
} measuring;

static void make_unit(const double from[4], double q[4])
{
    double size = sqrt(from[0] * from[0] + from[1] * from[1] + from[2] * from[2] + from[3] * from[3]);
    for (int k = 0; k < 4; k++) q[k] = size > 0 ? from[k] / size : k == 0;
}

/* Rotation and stretch of a piece without a map: those of a corner. */
static void borrow_map(const double corner[4], double q[4], double stretch[9])
{
    double scale = corner[0] * corner[0] + corner[1] * corner[1] + corner[2] * corner[2] + corner[3] * corner[3];
    make_unit(corner, q);
    memset(stretch, 0, 9 * sizeof *stretch);
    for (int k = 0; k < 3; k++) stretch[4 * k] = scale > 0 ? scale : 1;
}

static void measure_gradient(const vgi_space *s, size_t i, const double *pose, const double corner[4], double q[4],
                             double stretch[9])
{
    const double *inverse = s->inverse + 9 * i;
    double first[3], second[3], m[9], r[9];
    bool any = false;
    for (int k = 0; k < 9; k++) any = any || inverse[k] != 0;
    if (!any) {
        borrow_map(corner, q, stretch);
        return;
    }
    vgi_piece_edges(&s->pieces, i, pose, first, second);
    if (!vgi_piece_frame(first, second, m))
        for (int k = 0; k < 3; k++) m[3 * k] = first[k], m[3 * k + 1] = second[k], m[3 * k + 2] = 0;
    vgi_multiply(m, inverse, m);
    vgi_fit_rotation(m, r);
    vg_quat_from_matrix(r, q);
    for (size_t a = 0; a < 3; a++)
        for (size_t b = 0; b < 3; b++) stretch[3 * a + b] = r[a] * m[b] + r[3 + a] * m[3 + b] + r[6 + a] * m[6 + b];
}

/* lengths: rotation of the frame along the first edge. */
static void measure_frame(const vgi_space *s, size_t i, const double *pose, const double corner[4], double q[4])
{
    double now[9], before[9], edge[6], inverse[9], c[9];
    double stretch[9];
    vgi_piece_edges(&s->pieces, i, pose, edge, edge + 3);
    if (!vgi_is_triangle(&s->pieces, i) || !vgi_triangle_axes(edge, now) || !vgi_triangle_axes(s->edges + 6 * i, before)) {
        borrow_map(corner, q, stretch);
        return;
    }
    for (size_t k = 0; k < 9; k++) inverse[k] = before[3 * (k % 3) + k / 3];
    vgi_multiply(now, inverse, c);
    vg_quat_from_matrix(c, q);
}

/* vectors: mean rotation of a face's corners; their own rotations and scales go to the values. */
static void measure_face(const vgi_space *s, size_t f, const double *corners, double *values, double q[4])
{
    double sum[4] = {0, 0, 0, 0};
    for (size_t i = s->g->faces.start[f]; i < s->g->faces.start[f + 1]; i++) {
        double unit[4], same = 0;
        make_unit(corners + 4 * i, unit);
        for (int k = 0; k < 4; k++) same += sum[k] * unit[k];
        for (int k = 0; k < 4; k++) sum[k] += same < 0 ? -unit[k] : unit[k];
    }
    memcpy(values + 4 * (size_t)s->g->faces.start[f], corners + 4 * (size_t)s->g->faces.start[f],
           4 * (s->g->faces.start[f + 1] - s->g->faces.start[f]) * sizeof *values);
    make_unit(sum, q);
}

static void measure_pose(void *context, size_t index)
{
    const measuring *m = context;
    const vgi_space *s = m->s;
    size_t frame = m->first + index;
    const double *pose = m->poses + frame * 3 * s->g->faces.nv, *corners = m->corners[index];
    double *values = m->values + frame * s->d, *turns = m->turns + frame * 4 * s->nodes;
    for (size_t i = 0; i < s->nodes; i++) {
        double stretch[9];
        if (s->kind == VG_SPACE_VECTORS) {
            measure_face(s, i, corners, values, turns + 4 * i);
            continue;
        }
        const double *corner = corners + 4 * (size_t)s->g->faces.start[s->pieces.face[i]];
        if (s->kind == VG_SPACE_LENGTHS) measure_frame(s, i, pose, corner, turns + 4 * i);
        else measure_gradient(s, i, pose, corner, turns + 4 * i, stretch);
        if (has_gradients(s)) put_stretch(stretch, sqrt(s->pieces.share[i]), values + vgi_space_stretch_at(s, i));
    }
    if (s->kind == VG_SPACE_LENGTHS) vgi_relative_lengths(s, pose, values);
}

/* ---- homes and branches ---- */

/* Set the homes of the rotations to the means of their logarithms; rotations are then measured from there. A mean of
 * the rotations themselves is meaningless if they go full circle. */
static void move_homes(const vgi_space *s, size_t n, const double *sum, double *turns, double *home)
{
    for (size_t i = 0; i < s->nodes; i++) {
        double l[4] = {0}, *h = home + 4 * i;
        vgi_divided(sum + 3 * i, (double)n, l + 1);
        vg_quat_exp(l, h);
        const double back[4] = {h[0], -h[1], -h[2], -h[3]};
        for (size_t f = 0; f < n; f++) {
            double *q = turns + 4 * (f * s->nodes + i);
            vg_quat_multiply(q, back, q);
        }
    }
}

/* Pairs of nodes, and for each the largest rotation between the two in any frame: 1 - |cosine of half the angle|. */
static size_t list_pairs(const vgi_space *s, size_t n, const double *turns, uint32_t *pair, double *cost)
{
    size_t count = 0;
    for (size_t i = 0; i < s->pieces.npairs; i++) {
        size_t a = node_of(s, s->pieces.pair[i].a), b = node_of(s, s->pieces.pair[i].b);
        if (a == b) continue;
        double least = 1;
        for (size_t f = 0; f < n; f++) {
            const double *p = turns + 4 * (f * s->nodes + a), *q = turns + 4 * (f * s->nodes + b);
            least = fmin(least, fabs(p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3]));
        }
        pair[2 * count] = (uint32_t)a, pair[2 * count + 1] = (uint32_t)b;
        cost[count++] = 1 - least;
    }
    return count;
}

static size_t count_jumps(size_t npairs, const uint32_t *pair, const double *l)
{
    size_t jumps = 0;
    for (size_t i = 0; i < npairs; i++)
        jumps += vgi_square(l + 3 * (size_t)pair[2 * i], l + 3 * (size_t)pair[2 * i + 1]) > M_PI * M_PI / 4;
    return jumps;
}

/* vectors: logarithms of the corners, near that of their face. */
static void put_corner_logs(const vgi_space *s, size_t f, const double home[4], const double near[3], double *values)
{
    const uint32_t *start = s->g->faces.start;
    const double back[4] = {home[0], -home[1], -home[2], -home[3]};
    double part = sqrt(s->node_share[f] / (double)(start[f + 1] - start[f]));
    for (size_t c = start[f]; c < start[f + 1]; c++) {
        double *x = values + OF_CORNER * c, unit[4], turn[3], scale[4];
        vg_quat_log(x, scale);
        make_unit(x, unit);
        vg_quat_multiply(unit, back, unit);
        vgi_branch_near(unit, near, turn);
        x[0] = part * sqrt(3) * 2 * scale[0];
        vgi_scaled(part * M_SQRT2 * 2, turn, x + 1);
    }
}

/* The values of a frame, with the logarithms nearest to the given vectors of its nodes; the vectors are replaced by
 * the logarithms. */
static void put_logs(const vgi_space *s, const double *q, const double *home, double *l, double *values)
{
    for (size_t i = 0; i < s->nodes; i++) {
        double exact[3];
        vgi_branch_near(q + 4 * i, l + 3 * i, exact);
        if (s->kind == VG_SPACE_VECTORS) put_corner_logs(s, i, home + 4 * i, l + 3 * i, values);
        for (size_t k = 0; k < 3 && s->kind == VG_SPACE_GRADIENTS; k++)
            values[OF_PIECE * i + k] = sqrt(s->node_share[i]) * M_SQRT2 * 2 * exact[k];
        memcpy(l + 3 * i, exact, sizeof exact);
    }
}

typedef struct walking {
    const vgi_space *s;
    size_t n, npairs;
    double *turns, *cost, *l, *exact; /* l: of two frames */
    uint32_t *pair;
    double *sum;                  /* for add_logs */
    const double *home;           /* for keep_logs, and so are those: */
    double *values;
    size_t *jumps;
} walking;

static void add_logs(walking *w, size_t f, const double *now)
{
    (void)f;
    for (size_t i = 0; i < 3 * w->s->nodes; i++) w->sum[i] += now[i];
}

static void keep_logs(walking *w, size_t f, const double *now)
{
    const vgi_space *s = w->s;
    memcpy(w->exact, now, 3 * s->nodes * sizeof *now);
    put_logs(s, w->turns + 4 * f * s->nodes, w->home, w->exact, w->values + f * s->d);
    *w->jumps += count_jumps(w->npairs, w->pair, w->exact);
}

/* Pass the logarithms of each frame to `take`, frame by frame. */
static int walk_frames(walking *w, void (*take)(walking *w, size_t f, const double *now), vg_err *e)
{
    const vgi_space *s = w->s;
    vgi_branches branches;
    w->npairs = list_pairs(s, w->n, w->turns, w->pair, w->cost);
    int r = vgi_branches_make(&branches, s->nodes, s->node_share, w->npairs, w->pair, w->cost, e);
    for (size_t f = 0; r == VG_OK && f < w->n; f++) {
        double *now = w->l + 3 * s->nodes * (f & 1), *before = w->l + 3 * s->nodes * (1 - (f & 1));
        vgi_branches_walk(&branches, w->turns + 4 * f * s->nodes, f ? before : NULL, now);
        take(w, f, now);
    }
    vgi_branches_clear(&branches);
    return r;
}

static int put_turns(const vgi_space *s, size_t n, double *turns, double *values, double *home, size_t *jumps, vg_err *e)
{
    walking w = {.s = s, .n = n, .turns = turns, .pair = vgi_array(s->pieces.npairs, 2 * sizeof(uint32_t), e),
                 .cost = vgi_array(s->pieces.npairs, sizeof(double), e), .l = vgi_array(2 * s->nodes, 3 * sizeof(double), e),
                 .exact = vgi_array(s->nodes, 3 * sizeof(double), e), .sum = vgi_array(s->nodes, 3 * sizeof(double), e),
                 .home = home, .values = values, .jumps = jumps};
    int r = w.pair && w.cost && w.l && w.exact && w.sum ? walk_frames(&w, add_logs, e) : VG_ENOMEM;
    if (r == VG_OK) {
        move_homes(s, n, w.sum, turns, home);
        r = walk_frames(&w, keep_logs, e);
    }
    free(w.pair);
    free(w.cost);
    free(w.l);
    free(w.exact);
    free(w.sum);
    return r;
}

/* ---- all poses ---- */

static int measure_poses(const vgi_space *s, const double *reference, size_t n, measuring *m, int threads, vg_err *e)
{
    vg_deformer *deformer = NULL;
    size_t size = 4 * vg_graph_corners(s->g);
    double *corners = vgi_array(BATCH * size, sizeof *corners, e), *list[BATCH];
    const double *poses[BATCH];
    int r = corners ? vg_deformer_new(&deformer, s->g, reference, threads, e) : VG_ENOMEM;
    for (size_t i = 0; i < BATCH && r == VG_OK; i++) list[i] = corners + i * size;
    m->corners = list;
    for (m->first = 0; r == VG_OK && m->first < n; m->first += BATCH) {
        size_t some = n - m->first < BATCH ? n - m->first : BATCH;
        for (size_t i = 0; i < some; i++) poses[i] = m->poses + (m->first + i) * 3 * s->g->faces.nv;
        vg_deformer_measure(deformer, some, VG_VERTICES, poses, list);
        vgi_parallel(threads, some, measure_pose, m);
    }
    vg_deformer_free(&deformer);
    free(corners);
    return r;
}

int vgi_space_measure(const vgi_space *s, const double *reference, size_t n, const double *poses, double *values,
                      double *home, size_t *jumps, int threads, vg_err *e)
{
    double *turns = vgi_array_raw(n * s->nodes, 4 * sizeof *turns, e);
    measuring m = {.s = s, .poses = poses, .values = values, .turns = turns};
    int r = turns ? measure_poses(s, reference, n, &m, threads, e) : VG_ENOMEM;
    *jumps = 0;
    if (r == VG_OK && is_relative(s)) vgi_relative_finish(s, n, turns, values, jumps);
    else if (r == VG_OK) r = put_turns(s, n, turns, values, home, jumps, e);
    free(turns);
    return r;
}

/* ---- inverse ---- */

static void corners_of_logs(const vgi_space *s, const double *home, const double *values, double *vectors)
{
    const vg_graph *g = s->g;
    for (size_t f = 0; f < g->faces.nf; f++) {
        size_t first = g->faces.start[f], r = g->faces.start[f + 1] - first;
        double part = sqrt(s->node_share[f] / (double)r), centre[3], *w = vectors + 3 * first;
        for (size_t i = 0; i < r; i++) {
            const double *x = values + OF_CORNER * (first + i);
            double l[4] = {x[0] / (part * sqrt(3) * 2)}, q[4];
            for (int k = 1; k < 4; k++) l[k] = x[k] / (part * M_SQRT2 * 2);
            vg_quat_exp(l, q);
            vg_quat_multiply(q, home + 4 * f, q);
            vg_quat_apply(q, s->vectors + 3 * (first + i), w + 3 * i);
        }
        vg_centroid(w, r, centre);
        for (size_t i = 0; i < 3 * r; i++) w[i] -= centre[i % 3];
    }
}

static void edges_of_logs(vgi_space *s, const double *home, const double *values)
{
    for (size_t i = 0; i < s->pieces.n; i++) {
        const double *x = values + OF_PIECE * i;
        double weight = sqrt(s->pieces.share[i]), l[4] = {0}, q[4], m[9], turn[9];
        vgi_divided(x, weight * M_SQRT2 * 2, l + 1);
        vg_quat_exp(l, q);
        vg_quat_multiply(q, home + 4 * i, q);
        vg_quat_matrix(q, turn);
        vgi_stretch_get(x + 3, weight, m);
        vgi_multiply(turn, m, m);
        vgi_multiply_vector(m, s->edges + 6 * i, s->moved + 6 * i);
        vgi_multiply_vector(m, s->edges + 6 * i + 3, s->moved + 6 * i + 3);
    }
}

int vgi_space_vectors(vgi_space *s, const double *home, const double *values, double *vectors, vg_err *e)
{
    int r = VG_OK;
    if (s->kind == VG_SPACE_VECTORS) {
        corners_of_logs(s, home, values, vectors);
        return r;
    }
    if (is_relative(s)) r = vgi_relative_edges(s, values, e);
    else edges_of_logs(s, home, values);
    if (r == VG_OK) vgi_pieces_vectors(&s->pieces, s->moved, vectors);
    return r;
}
