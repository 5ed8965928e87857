/* test_space.c: spaces of shapes that are no vertices: there and back on all kinds of faces, what a motion of the whole
 * changes, turns beyond half a turn, and numbers that are known by a formula.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "meshes.h"
#include "numeric/vec3.h"
#include "signal/branches.h"
#include "signal/space.h"
#include "vg/vectors.h"

enum { FRAMES = 5 };

static const vg_space spaces[] = {VG_SPACE_VECTORS, VG_SPACE_GRADIENTS, VG_SPACE_ROTATIONS, VG_SPACE_LENGTHS};

/* The turn about z by a, as a quaternion. */
static void about_z(double a, double q[4])
{
    q[0] = cos(a / 2), q[1] = q[2] = 0, q[3] = sin(a / 2);
}

/* Poses that bend and stretch: a map of space that is curved. */
static double *bend(const vg_head *h)
{
    size_t nv = h->body.mesh.nv;
    double *poses = room(FRAMES * nv, 3 * sizeof *poses);
    for (size_t f = 0; f < FRAMES; f++)
        for (size_t v = 0; v < nv; v++) {
            const double *p = h->body.reference + 3 * v, t = 0.15 * (double)f;
            double *to = poses + 3 * (f * nv + v), q[4];
            const double moved[3] = {p[0] * (1 + 0.2 * t) + 0.1 * t * p[1] * p[1], p[1] + 0.2 * t * sin(p[2]), p[2] - 0.3 * t * p[0]};
            about_z(t * p[2] * 0.4, q);
            vg_quat_apply(q, moved, to);
        }
    return poses;
}

typedef struct fixture {
    vg_graph *g;
    vgi_space s;
    double *values, *home;
    size_t jumps;
} fixture;

static void measure(fixture *x, const vg_head *h, vg_space kind, size_t n, const double *poses)
{
    vg_err e;
    if (vg_head_graph(&x->g, h, &e) < 0 || vgi_space_make(&x->s, kind, x->g, h->body.reference, &e) < 0) abort();
    x->values = room(n * x->s.d, sizeof *x->values);
    x->home = room(vgi_space_homes(&x->s), 4 * sizeof *x->home);
    if (vgi_space_measure(&x->s, h->body.reference, n, poses, x->values, x->home, &x->jumps, 2, &e) < 0) abort();
}

static void drop(fixture *x)
{
    vgi_space_clear(&x->s);
    vg_graph_free(&x->g);
    free(x->values);
    free(x->home);
}

/* The largest distance of vectors that come back from those of the pose. */
static double off(fixture *x, const double *pose, const double *values)
{
    size_t corners = vg_graph_corners(x->g);
    double *wanted = room(corners, 3 * sizeof *wanted), *got = room(corners, 3 * sizeof *got), most = 0;
    vg_graph_vectors(x->g, pose, wanted);
    if (vgi_space_vectors(&x->s, x->home, values, got, NULL) < 0) abort();
    for (size_t i = 0; i < 3 * corners; i++) most = fmax(most, fabs(wanted[i] - got[i]));
    free(wanted);
    free(got);
    return most;
}

static void there_and_back_on(vg_head h)
{
    vg_err e;
    if (vg_head_prepare_vectors(&h, &e) < 0) abort();
    double *poses = bend(&h), size = vg_diagonal(h.body.reference, h.body.mesh.nv);
    for (size_t k = 0; k < 4; k++) {
        fixture x;
        measure(&x, &h, spaces[k], FRAMES, poses);
        CHECK(x.jumps == 0);
        for (size_t f = 0; f < FRAMES; f++)
            CHECK_NEAR(off(&x, poses + 3 * f * h.body.mesh.nv, x.values + f * x.s.d) / size, 0, 1e-10);
        drop(&x);
    }
    free(poses);
    vg_head_clear(&h);
}

static void there_and_back(void)
{
    there_and_back_on(make_rod(6, 8, true));
    there_and_back_on(make_rod(6, 8, false));
    there_and_back_on(make_mixed(7));
    there_and_back_on(make_flower(9));
    there_and_back_on(make_chain(6));
    there_and_back_on(make_tree(12));
    there_and_back_on(make_ngon(3, 0, 0));
    vg_head two = make_torus(8, 6);
    add_torus(&two, 6, 5, (double[]){4, 0, 1});
    there_and_back_on(two);
}

/* What neighbours see of one another stays when the whole turns, all but the last three numbers, which say the turn. */
static void the_whole_turns(void)
{
    vg_head h = make_rod(6, 8, false);
    size_t nv = h.body.mesh.nv;
    double *bent = bend(&h), *poses = room(2 * nv, 3 * sizeof *poses), q[4];
    const double l[4] = {0, 0.3, -0.2, 0.4};
    vg_quat_exp(l, q);
    memcpy(poses, bent + 6 * nv, 3 * nv * sizeof *poses);
    for (size_t v = 0; v < nv; v++) vg_quat_apply(q, poses + 3 * v, poses + 3 * (nv + v));
    for (size_t k = 2; k < 4; k++) {
        fixture x;
        measure(&x, &h, spaces[k], 2, poses);
        for (size_t c = 0; c + 3 < x.s.d; c++) CHECK_NEAR(x.values[c], x.values[x.s.d + c], 1e-12);
        const double *a = x.values + x.s.d - 3, *b = x.values + 2 * x.s.d - 3; /* sqrt 2 times axis times angle */
        double first[4] = {0}, second[4] = {0}, back[4], turned[4];
        for (int i = 0; i < 3; i++) first[i + 1] = a[i] / (2 * M_SQRT2), second[i + 1] = b[i] / (2 * M_SQRT2);
        vg_quat_exp(first, first);
        vg_quat_exp(second, back);
        vg_quat_multiply(q, first, turned);
        for (int i = 0; i < 4; i++) CHECK_NEAR(turned[i], back[i], 1e-12);
        drop(&x);
    }
    free(bent);
    free(poses);
    vg_head_clear(&h);
}

/* A pose twice as large, turned: its numbers by formula. Half the frames are the reference, so that the home is half-way. */
static void known_numbers(void)
{
    vg_head h = make_rod(5, 8, true);
    size_t nv = h.body.mesh.nv;
    double *poses = room(2 * nv, 3 * sizeof *poses), q[4];
    about_z(0.8, q);
    memcpy(poses, h.body.reference, 3 * nv * sizeof *poses);
    for (size_t v = 0; v < nv; v++) {
        vg_quat_apply(q, poses + 3 * v, poses + 3 * (nv + v));
        for (size_t k = 0; k < 3; k++) poses[3 * (nv + v) + k] *= 2;
    }
    fixture x;
    measure(&x, &h, VG_SPACE_GRADIENTS, 2, poses);
    for (size_t i = 0; i < x.s.pieces.n; i++) {
        const double *a = x.values + 9 * i, *b = a + x.s.d, w = sqrt(x.s.pieces.share[i]);
        double trace = 0;
        for (int k = 0; k < 3; k++) {
            CHECK_NEAR(a[k], k == 2 ? -0.4 * w * M_SQRT2 : 0, 1e-13);
            CHECK_NEAR(b[k], k == 2 ? 0.4 * w * M_SQRT2 : 0, 1e-13);
            trace += b[3 + (k == 0 ? 0 : k == 1 ? 3 : 5)];
        }
        for (int k = 3; k < 9; k++) CHECK_NEAR(a[k], 0, 1e-13);
        CHECK_NEAR(trace, 2 * w, 1e-13); /* the surface doubles, the unit normal does not */
    }
    drop(&x);
    measure(&x, &h, VG_SPACE_VECTORS, 2, poses);
    for (size_t f = 0; f < x.g->faces.nf; f++)
        for (size_t c = x.g->faces.start[f]; c < x.g->faces.start[f + 1]; c++) {
            double w = sqrt(x.s.node_share[f] / (double)(x.g->faces.start[f + 1] - x.g->faces.start[f]));
            CHECK_NEAR(x.values[x.s.d + 4 * c], w * sqrt(3) * log(2), 1e-13);
            CHECK_NEAR(x.values[x.s.d + 4 * c + 3], w * M_SQRT2 * 0.4, 1e-13);
        }
    drop(&x);
    measure(&x, &h, VG_SPACE_LENGTHS, 2, poses);
    double sum = 0; /* of squares: every edge is twice as long, and all shares around edges are a third of 1 for triangles */
    for (size_t c = 0; c + 3 < x.s.d; c++) sum += x.values[x.s.d + c] * x.values[x.s.d + c];
    CHECK_NEAR(sum, 1, 1e-12);
    drop(&x);
    free(poses);
    vg_head_clear(&h);
}

/* A long rod is twisted by 1.8 turns, some more in each frame: logarithms follow the twist, without a jump, and half-way
 * between two of them is half the twist. */
static void beyond_half_a_turn(void)
{
    enum { RINGS = 60, SIDES = 8, N = 7 };
    vg_head h = make_rod(RINGS, SIDES, true);
    size_t nv = h.body.mesh.nv;
    double *poses = room(N * nv, 3 * sizeof *poses), length = h.body.reference[3 * nv - 1];
    for (size_t f = 0; f < N; f++)
        for (size_t v = 0; v < nv; v++) {
            const double *p = h.body.reference + 3 * v;
            double q[4];
            about_z(3.6 * M_PI * p[2] / length * (double)f / (N - 1), q);
            vg_quat_apply(q, p, poses + 3 * (f * nv + v));
        }
    for (size_t k = 0; k < 4; k++) {
        fixture x;
        measure(&x, &h, spaces[k], N, poses);
        CHECK(x.jumps == 0);
        CHECK_NEAR(off(&x, poses + 3 * 6 * nv, x.values + 6 * x.s.d), 0, 1e-9);
        double *middle = room(x.s.d, sizeof *middle);
        for (size_t c = 0; c < x.s.d; c++) middle[c] = (x.values[2 * x.s.d + c] + x.values[4 * x.s.d + c]) / 2;
        double linear = 0; /* of the vertices: what the middle of positions misses */
        for (size_t c = 0; c < 3 * nv; c++)
            linear = fmax(linear, fabs((poses[6 * nv + c] + poses[12 * nv + c]) / 2 - poses[9 * nv + c]));
        CHECK(linear > 1);
        if (k < 2) CHECK(off(&x, poses + 9 * nv, middle) < 0.05);
        free(middle);
        drop(&x);
    }
    free(poses);
    vg_head_clear(&h);
}

/* A walk over a ring of pieces that turn on by 100 degrees each: a whole number of turns cannot close, so the forest has
 * to break the ring at the costliest pair and nowhere else. */
static void forest_breaks_where_it_costs_most(void)
{
    enum { N = 9 };
    uint32_t pair[2 * N];
    double cost[N], share[N], q[4 * N], l[3 * N];
    vgi_branches b;
    for (uint32_t i = 0; i < N; i++) {
        pair[2 * i] = i, pair[2 * i + 1] = (i + 1) % N;
        cost[i] = i == 4 ? 1 : 0.5;
        share[i] = i == 0 ? 0.2 : 0.1;
        about_z(100 * M_PI / 180 * (i <= 4 ? i : (double)i - N), q + 4 * i);
    }
    if (vgi_branches_make(&b, N, share, N, pair, cost, NULL) < 0) abort();
    CHECK(b.order[0] == 0 && b.parent[0] == 0 && b.parent[4] == 3 && b.parent[5] == 6);
    vgi_branches_walk(&b, q, NULL, l);
    for (uint32_t i = 0; i < N; i++) CHECK_NEAR(2 * l[3 * i + 2], 100 * M_PI / 180 * (i <= 4 ? i : (double)i - N), 1e-12);
    double before[3 * N]; /* a frame before that had turned once more: the whole follows */
    for (uint32_t i = 0; i < 3 * N; i++) before[i] = l[i] + (i % 3 == 2 ? M_PI : 0);
    vgi_branches_walk(&b, q, before, l);
    for (uint32_t i = 0; i < N; i++) CHECK_NEAR(l[3 * i + 2], before[3 * i + 2], 1e-12);
    vgi_branches_clear(&b);
}

static void what_is_refused(void)
{
    vg_head h = new_shape();
    vg_graph *g;
    vgi_space s;
    vg_err e;
    for (int i = 0; i < 8; i++) add_vertex(&h, i, i * i, 0);
    if (vg_head_graph(&g, &h, &e) < 0) abort();
    CHECK(vgi_space_make(&s, VG_SPACE_GRADIENTS, g, h.body.reference, &e) == VG_EINPUT);
    CHECK_TEXT(e.message, "the mesh has no faces: its shape space can only be vertices");
    vg_graph_free(&g);
    FACE(&h, 0, 1, 2);
    FACE(&h, 3, 4, 5);
    if (vg_head_graph(&g, &h, &e) < 0) abort();
    CHECK(vgi_space_make(&s, VG_SPACE_ROTATIONS, g, h.body.reference, &e) == VG_EINPUT);
    CHECK_TEXT(e.message, "the mesh has 2 parts that no links join");
    vg_graph_free(&g);
    vg_head_clear(&h);
}

TESTS({"there and back", there_and_back}, {"the whole turns", the_whole_turns}, {"known numbers", known_numbers},
      {"beyond half a turn", beyond_half_a_turn}, {"the forest breaks where it costs most", forest_breaks_where_it_costs_most},
      {"what is refused", what_is_refused})
