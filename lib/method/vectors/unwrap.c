/* unwrap.c: unwrapping of face rotations. A rotation by a about an axis is also one by a - 2 pi or a + 2 pi, and
 * neighbouring faces must choose alike (MATH 7). A minimum spanning tree over faces and vertices, starting from the
 * face that rotates least, joins the nodes whose rotations differ least. Sweeps then correct what the tree joined
 * badly. If something rotates by more than half a turn, a smooth field of such vectors is fitted to the faces.
 * interpolate.c uses the result.
 *
 * Vectors are axis times half the angle, the logarithms of unit quaternions; so the next branch along the axis is pi
 * away.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/unwrap.h"
#include "numeric/vec3.h"
#include "model/incidence.h"

#include <math.h>
#include <stdlib.h>

enum { SWEEPS = 50,       /* at most; sweeps end when no face changes its branch */
       NEWTON_STEPS = 20, /* of the smooth field: most Newton steps, and most steps in each */
       CG_STEPS = 200 };
static const double trust = 2.5;        /* see vgi_branch_near: x / sin x for x = 2.15, a rotation by 246 degrees */
/* weight of the faces' axes in the smooth field, relative to their angles */
static const double sideways = 0.1;
static const double longest_step = 0.3; /* of one coordinate of a vector */
static const double usual = 0.3;        /* a face whose half angle relative to the field exceeds this is an
                                           exception */

/* q exp(-l) and exp(-l) q have the same angle; this is half of it, in [0, pi / 2] */
static double half_angle_between(const double q[4], const double l[3])
{
    double to[4], log[4] = {0, -l[0], -l[1], -l[2]}, rest[4];
    vg_quat_exp(log, to);
    vg_quat_multiply(to, q, rest);
    return atan2(vgi_length(rest + 1), fabs(rest[0]));
}

void vgi_shorter(double q[4])
{
    double sign = q[0] < 0 ? -1 : 1;
    for (int k = 0; k < 4; k++) q[k] *= sign;
}

bool vgi_branch_near(const double q[4], const double near[3], double l[3])
{
    static const double tiny = 1e-9;
    double sine = vgi_length(q + 1), length = vgi_length(near), axis[3] = {0, 0, 0};
    double angle = atan2(sine, q[0]);
    if (sine > tiny) vgi_divided(q + 1, sine, axis);
    else if (length > tiny) vgi_divided(near, length, axis);
    if (!(sine > tiny)) angle = 0; /* equal for q and -q, and about any axis */
    angle += M_PI * nearbyint((vgi_dot(near, axis) - angle) / M_PI);
    vgi_scaled(angle, axis, l);
    return sqrt(vgi_square(l, near)) <= trust * half_angle_between(q, near) + tiny;
}

bool vgi_branch_follow(const double q[4], const double near[3], double l[3])
{
    if (vgi_branch_near(q, near, l)) return true;
    double length2 = vgi_dot(near, near), back[4] = {0, -near[0], -near[1], -near[2]}, rest[4], more[4];
    vg_quat_exp(back, back);
    vg_quat_multiply(back, q, rest);
    vgi_shorter(rest);
    vg_quat_log(rest, more);
    double along = length2 > 0 ? vgi_dot(more + 1, near) / length2 : 0;
    vgi_scaled(1 + along, near, l);
    return false;
}

/* ---- rotations of faces and vertices ---- */

/* A candidate edge of the tree, between a face and one of its vertices, in the heap. Nodes are numbered faces first,
 * then vertices. */
typedef struct edge {
    double cost;
    uint32_t from, to;
} edge;

typedef struct choice {
    const vg_graph *g;
    vgi_incidence around;
    double *q;    /* 4 per face, then per vertex: unit quaternions, the mean rotations */
    double *turn; /* 3 per face */
    double *at;   /* 3 per vertex: from the tree, then sums or means over its faces */
    bool *reached;
    edge *heap;
    size_t n, cap;
    bool beyond;
} choice;

/* Add to a sum of quaternions, with the sign that agrees with the sum. */
static void add_quaternion(double sum[4], const double q[4])
{
    double along = 0;
    for (int k = 0; k < 4; k++) along += sum[k] * q[k];
    for (int k = 0; k < 4; k++) sum[k] += along < 0 ? -q[k] : q[k];
}

static void make_unit(double q[4])
{
    double length = 0;
    for (int k = 0; k < 4; k++) length += q[k] * q[k];
    length = sqrt(length);
    for (int k = 0; k < 4; k++) q[k] = length > 0 ? q[k] / length : k == 0;
}

static void make_means(choice *c, const double *corner)
{
    const vg_graph *g = c->g;
    for (size_t f = 0; f < g->faces.nf; f++) {
        double *mean = c->q + 4 * f;
        for (size_t i = g->faces.start[f]; i < g->faces.start[f + 1]; i++) {
            double unit[4];
            memcpy(unit, corner + 4 * i, sizeof unit);
            make_unit(unit);
            add_quaternion(mean, unit);
        }
        make_unit(mean);
    }
    for (size_t v = 0; v < g->faces.nv; v++) {
        double *mean = c->q + 4 * (g->faces.nf + v);
        for (size_t i = c->around.first[v]; i < c->around.first[v + 1]; i++)
            add_quaternion(mean, c->q + 4 * (size_t)c->around.face[i]);
        make_unit(mean);
    }
}

/* ---- the tree (Prim 1957) ---- */

static bool edge_before(const edge *a, const edge *b)
{
    return a->cost < b->cost || (a->cost == b->cost && (a->to < b->to || (a->to == b->to && a->from < b->from)));
}

static int push(choice *c, size_t from, size_t to, vg_err *e)
{
    if (c->reached[to]) return VG_OK;
    double along = 0;
    for (int k = 0; k < 4; k++) along += c->q[4 * from + (size_t)k] * c->q[4 * to + (size_t)k];
    edge it = {1 - fabs(along), (uint32_t)from, (uint32_t)to};
    if (vgi_grow(&c->heap, &c->cap, c->n + 1, sizeof *c->heap, e) < 0) return VG_ENOMEM;
    size_t i = c->n++;
    for (; i > 0 && edge_before(&it, &c->heap[(i - 1) / 2]); i = (i - 1) / 2) c->heap[i] = c->heap[(i - 1) / 2];
    c->heap[i] = it;
    return VG_OK;
}

static edge pop(choice *c)
{
    edge top = c->heap[0], last = c->heap[--c->n];
    size_t i = 0, child;
    while ((child = 2 * i + 1) < c->n) {
        if (child + 1 < c->n && edge_before(&c->heap[child + 1], &c->heap[child])) child++;
        if (!edge_before(&c->heap[child], &last)) break;
        c->heap[i] = c->heap[child];
        i = child;
    }
    c->heap[i] = last;
    return top;
}

static double *vector_of(choice *c, size_t node)
{
    return node < c->g->faces.nf ? c->turn + 3 * node : c->at + 3 * (node - c->g->faces.nf);
}

static int push_neighbours(choice *c, size_t node, vg_err *e)
{
    const vg_graph *g = c->g;
    int r = VG_OK;
    if (node < g->faces.nf) {
        for (size_t i = g->faces.start[node]; r == VG_OK && i < g->faces.start[node + 1]; i++)
            r = push(c, node, g->faces.nf + g->faces.vert[i], e);
    } else {
        const vgi_incidence *x = &c->around;
        size_t v = node - g->faces.nf;
        for (size_t i = x->first[v]; r == VG_OK && i < x->first[v + 1]; i++) r = push(c, node, x->face[i], e);
    }
    return r;
}

static int grow_tree(choice *c, size_t seed, vg_err *e)
{
    static const double none[3] = {0, 0, 0};
    vgi_branch_near(c->q + 4 * seed, none, vector_of(c, seed));
    c->reached[seed] = true;
    int r = push_neighbours(c, seed, e);
    while (r == VG_OK && c->n) {
        edge next = pop(c);
        if (c->reached[next.to]) continue;
        c->reached[next.to] = true;
        vgi_branch_follow(c->q + 4 * (size_t)next.to, vector_of(c, next.from), vector_of(c, next.to));
        r = push_neighbours(c, next.to, e);
    }
    return r;
}

typedef struct seed {
    double cost;
    size_t face;
} seed;

static int by_cost(const void *a_, const void *b_)
{
    const seed *a = a_, *b = b_;
    if (a->cost != b->cost) return a->cost < b->cost ? -1 : 1;
    return a->face < b->face ? -1 : a->face > b->face;
}

/* Start at the face that rotates least, and again in each part that no link connects. */
static int grow_trees(choice *c, vg_err *e)
{
    size_t nf = c->g->faces.nf;
    seed *seeds = vgi_array_raw(nf, sizeof *seeds, e);
    if (!seeds) return VG_ENOMEM;
    for (size_t f = 0; f < nf; f++) seeds[f] = (seed){1 - fabs(c->q[4 * f]), f};
    qsort(seeds, nf, sizeof *seeds, by_cost);
    int r = VG_OK;
    for (size_t i = 0; i < nf && r == VG_OK; i++)
        if (!c->reached[seeds[i].face]) r = grow_tree(c, seeds[i].face, e);
    free(seeds);
    return r;
}

/* ---- sweeps ---- */

static void sum_around(choice *c)
{
    const vg_graph *g = c->g;
    memset(c->at, 0, 3 * g->faces.nv * sizeof *c->at);
    for (size_t f = 0; f < g->faces.nf; f++)
        for (size_t i = g->faces.start[f]; i < g->faces.start[f + 1]; i++)
            vgi_add(c->at + 3 * (size_t)g->faces.vert[i], c->turn + 3 * f);
}

static size_t faces_around(const choice *c, size_t v)
{
    return c->around.first[v + 1] - c->around.first[v];
}

/* Mean vector of the faces that share a vertex with f; false if there are none. c->at holds sums. */
static bool mean_beside(const choice *c, size_t f, double mean[3])
{
    const vg_graph *g = c->g;
    size_t n = 0;
    memset(mean, 0, 3 * sizeof *mean);
    for (size_t i = g->faces.start[f]; i < g->faces.start[f + 1]; i++) {
        size_t v = g->faces.vert[i];
        n += faces_around(c, v) - 1;
        for (size_t k = 0; k < 3; k++) mean[k] += c->at[3 * v + k] - c->turn[3 * f + k];
    }
    if (n) vgi_divide(mean, (double)n);
    return n > 0;
}

/* Move each face to the branch with the least sum of squared differences from its neighbours, which is the one
 * nearest to their mean. Returns the number of changes. */
static size_t sweep_branches(choice *c)
{
    const vg_graph *g = c->g;
    size_t changed = 0;
    for (size_t f = 0; f < g->faces.nf; f++) {
        double mean[3], l[3], step[3], *now = c->turn + 3 * f;
        if (!mean_beside(c, f, mean)) continue;
        vgi_branch_follow(c->q + 4 * f, mean, l);
        vgi_subtract(l, now, step);
        if (!(vgi_dot(step, step) > M_PI * M_PI / 4)) continue;
        for (size_t i = g->faces.start[f]; i < g->faces.start[f + 1]; i++)
            vgi_add(c->at + 3 * (size_t)g->faces.vert[i], step);
        memcpy(now, l, sizeof l);
        changed++;
    }
    return changed;
}

/* Whether any face rotates by more than half a turn (its vector is not the shortest one), or a corner does because it
 * follows such a face. corner: a quaternion per corner. */
static bool is_beyond(const choice *c, const double *corner)
{
    const vg_graph *g = c->g;
    static const double none[3] = {0, 0, 0}, rounding = 1e-6;
    for (size_t f = 0; f < g->faces.nf; f++) {
        const double *turn = c->turn + 3 * f;
        double l[3], shortest[3], off[3];
        vgi_branch_near(c->q + 4 * f, turn, l);
        vgi_subtract(l, turn, off);
        if (!(vgi_dot(off, off) <= rounding) || !(vgi_length(turn) <= M_PI / 2 + rounding)) return true;
        for (size_t i = g->faces.start[f]; i < g->faces.start[f + 1]; i++) {
            double q[4];
            memcpy(q, corner + 4 * i, sizeof q);
            make_unit(q);
            vgi_branch_near(q, turn, l);
            vgi_branch_near(q, none, shortest);
            vgi_subtract(l, shortest, off);
            if (vgi_dot(off, off) > 1 && !(vgi_length(l) <= M_PI / 2 + rounding)) return true;
        }
    }
    return false;
}

/* ---- a smooth field of vectors (Gauss-Newton, conjugate gradients) ----
 *
 * The objective is  sum_f rest_f' W_f rest_f + turn' L turn,  exp(rest_f) = exp(-turn_f) q_f, with L the graph
 * Laplacian of faces that share vertices; the n faces at a vertex are joined with weight 1/n each. A step x changes
 * rest by -J x, J = I - (1 - cos a)/a^2 [v] + (a - sin a)/a^3 [v]^2 for the rotation vector v = 2 turn and its length
 * a. Near a whole turn J is singular perpendicular to the axis; there the neighbours determine the axis. */

typedef struct relaxation {
    double *J;      /* 9 per face */
    double *weight; /* per face */
    double *axis;   /* 3 per face: unit vector */
    double *b, *x, *r, *p, *Ap; /* 3 per face */
} relaxation;

static void make_jacobian(const double turn[3], double J[9])
{
    const double v[3] = {2 * turn[0], 2 * turn[1], 2 * turn[2]};
    double a2 = vgi_dot(v, v), a = sqrt(a2), first = 0.5, second = 1.0 / 6;
    if (a > 1e-4) first = (1 - cos(a)) / a2, second = (a - sin(a)) / (a2 * a);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) J[3 * i + k] = second * v[i] * v[k] + (i == k ? 1 - second * a2 : 0);
    J[1] += first * v[2], J[2] -= first * v[1], J[3] -= first * v[2];
    J[5] += first * v[0], J[6] += first * v[1], J[7] -= first * v[0];
}

/* y += L x; c->at is overwritten */
static void add_laplacian(choice *c, const double *x, double *y)
{
    const vg_graph *g = c->g;
    memset(c->at, 0, 3 * g->faces.nv * sizeof *c->at);
    for (size_t f = 0; f < g->faces.nf; f++)
        for (size_t i = g->faces.start[f]; i < g->faces.start[f + 1]; i++)
            vgi_add(c->at + 3 * (size_t)g->faces.vert[i], x + 3 * f);
    for (size_t v = 0; v < g->faces.nv; v++)
        if (faces_around(c, v)) vgi_divide(c->at + 3 * v, (double)faces_around(c, v));
    for (size_t f = 0; f < g->faces.nf; f++)
        for (size_t i = g->faces.start[f]; i < g->faces.start[f + 1]; i++)
            for (size_t k = 0; k < 3; k++) y[3 * f + k] += x[3 * f + k] - c->at[3 * (size_t)g->faces.vert[i] + k];
}

/* y = J' W rest. W is `weight` along the axis, which J preserves, and `sideways` times that perpendicular to it. */
static void pull_face(const relaxation *r, size_t f, const double rest[3], double y[3])
{
    const double *J = r->J + 9 * f, *axis = r->axis + 3 * f;
    double along = (1 - sideways) * vgi_dot(axis, rest);
    vgi_transposed_vector(J, rest, y);
    vgi_scale(y, sideways), vgi_add_scaled(y, along, axis), vgi_scale(y, r->weight[f]);
}

/* y = J' W (J x) + L x */
static void apply_system(choice *c, const relaxation *r, const double *x, double *y)
{
    for (size_t f = 0; f < c->g->faces.nf; f++) {
        const double *J = r->J + 9 * f, *xf = x + 3 * f;
        const double Jx[3] = {vgi_dot(J, xf), vgi_dot(J + 3, xf), vgi_dot(J + 6, xf)};
        pull_face(r, f, Jx, y + 3 * f);
    }
    add_laplacian(c, x, y);
}

static void linearise(choice *c, relaxation *r)
{
    size_t n = 3 * c->g->faces.nf;
    memset(r->b, 0, n * sizeof *r->b);
    add_laplacian(c, c->turn, r->b);
    for (size_t f = 0; f < c->g->faces.nf; f++) {
        double *turn = c->turn + 3 * f, *J = r->J + 9 * f, *b = r->b + 3 * f;
        double back[4] = {0, -turn[0], -turn[1], -turn[2]}, rest[4], l[4];
        vg_quat_exp(back, back);
        vg_quat_multiply(back, c->q + 4 * f, rest);
        vgi_shorter(rest);
        vg_quat_log(rest, l);
        make_jacobian(turn, J);
        r->weight[f] = 1 / (1 + vgi_dot(l + 1, l + 1) / (usual * usual)); /* limits the pull of a face that flips */
        double y[3];
        memcpy(r->axis + 3 * f, turn, 3 * sizeof *turn);
        vgi_make_unit(r->axis + 3 * f);
        pull_face(r, f, l + 1, y);
        vgi_subtract(y, b, b);
    }
}

static void solve_step(choice *c, relaxation *r)
{
    size_t n = 3 * c->g->faces.nf;
    memset(r->x, 0, n * sizeof *r->x);
    memcpy(r->r, r->b, n * sizeof *r->b);
    memcpy(r->p, r->b, n * sizeof *r->b);
    double rr = vgi_inner(r->r, r->r, n), enough = 1e-4 * rr;
    for (int i = 0; i < CG_STEPS && rr > enough; i++) {
        apply_system(c, r, r->p, r->Ap);
        double alpha = rr / vgi_inner(r->p, r->Ap, n), before_rr = rr;
        for (size_t k = 0; k < n; k++) r->x[k] += alpha * r->p[k], r->r[k] -= alpha * r->Ap[k];
        rr = vgi_inner(r->r, r->r, n);
        for (size_t k = 0; k < n; k++) r->p[k] = r->r[k] + rr / before_rr * r->p[k];
    }
}

static int relax(choice *c, vg_err *e)
{
    size_t nf = c->g->faces.nf;
    double *room = vgi_array_raw(nf, 28 * sizeof *room, e);
    if (!room) return VG_ENOMEM;
    relaxation r = {.J = room,
                    .weight = room + 9 * nf,
                    .axis = room + 10 * nf,
                    .b = room + 13 * nf,
                    .x = room + 16 * nf,
                    .r = room + 19 * nf,
                    .p = room + 22 * nf,
                    .Ap = room + 25 * nf};
    for (int step = 0; step < NEWTON_STEPS; step++) {
        linearise(c, &r);
        solve_step(c, &r);
        double most = 0;
        for (size_t i = 0; i < 3 * nf; i++) most = fmax(most, fabs(r.x[i]));
        for (size_t i = 0; i < 3 * nf; i++) c->turn[i] += most > longest_step ? longest_step / most * r.x[i] : r.x[i];
        if (most < 1e-2) break;
    }
    free(room);
    return VG_OK;
}

int vgi_choose_turns(const vg_graph *g, const double *q, double *turn, bool *beyond, vg_err *e)
{
    choice c = {.g = g, .turn = turn};
    int r = vgi_incidence_make(&c.around, &g->faces, e);
    if (r == VG_OK) {
        c.q = vgi_array(g->faces.nf + g->faces.nv, 4 * sizeof *c.q, e);
        c.at = vgi_array(g->faces.nv, 3 * sizeof *c.at, e);
        c.reached = vgi_array(g->faces.nf + g->faces.nv, sizeof *c.reached, e);
        r = c.q && c.at && c.reached ? VG_OK : VG_ENOMEM;
    }
    if (r == VG_OK) {
        make_means(&c, q);
        r = grow_trees(&c, e);
    }
    if (r == VG_OK) {
        sum_around(&c);
        for (int i = 0; i < SWEEPS && sweep_branches(&c); i++) continue;
        *beyond = is_beyond(&c, q);
        if (*beyond) r = relax(&c, e);
    }
    vgi_incidence_clear(&c.around);
    free(c.q);
    free(c.at);
    free(c.reached);
    free(c.heap);
    return r;
}
