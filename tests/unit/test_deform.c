/* test_deform.c: how vectors turn and stretch (Frames, Rodrigues, links), and the same done to another mesh: against
 * the formulas of MATH 4 written out, on every kind of mesh, with degenerate faces, rigid motions, threads and
 * batches.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "meshes.h"

static double **lists(size_t n, size_t size)
{
    double **p = room(n, sizeof *p);
    for (size_t i = 0; i < n; i++) p[i] = room(size, sizeof **p);
    return p;
}

static void free_lists(double **p, size_t n)
{
    for (size_t i = 0; i < n; i++) free(p[i]);
    free(p);
}

#define CONST(p) ((const double *const *)(p))

static vg_deformer *deformer(const vg_graph *g, const double *reference, int threads)
{
    vg_deformer *d;
    vg_err e = {0, ""};
    if (vg_deformer_new(&d, g, reference, threads, &e) < 0) printf("%s\n", e.message), exit(1);
    return d;
}

static const vg_method methods[] = {VG_BY_POSE, VG_BY_GRADIENT, VG_BY_BLEND, VG_BY_OFFSET};
enum { METHODS = sizeof methods / sizeof *methods };

static void aim_by(vg_deformer *d, const vg_graph *g, const double *target, vg_method method)
{
    double *w = vectors_of(g, target);
    vg_err e;
    CHECK(vg_deformer_target(d, w, method, &e) == VG_OK);
    free(w);
}

static void aim(vg_deformer *d, const vg_graph *g, const double *target)
{
    aim_by(d, g, target, VG_BY_POSE);
}

static double *measure(vg_head *h, const vg_graph *g, const double *pose)
{
    double *q = room(4 * vg_graph_corners(g), sizeof *q);
    vg_deformer *d = deformer(g, h->body.reference, 1);
    const double *in = pose;
    vg_deformer_measure(d, 1, VG_VERTICES, &in, &q);
    vg_deformer_free(&d);
    return q;
}

static double dot(const double *a, const double *b, size_t n)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += a[i] * b[i];
    return sum;
}

static void cross(const double a[3], const double b[3], double c[3])
{
    for (int k = 0; k < 3; k++) c[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

/* ---- against the formulas ---- */

/* Columns u, b, n of the frame of corner c, from positions: Newell's normal as the sum over edges of
 * (y - y')(z + z') etc., made perpendicular to u; b = n x u. */
static void frame_of(const vg_graph *g, size_t f, uint32_t c, const double *x, double F[9])
{
    double n[3] = {0, 0, 0}, u[3], b[3], centre[3] = {0, 0, 0}, r = g->faces.start[f + 1] - g->faces.start[f];
    for (uint32_t i = g->faces.start[f]; i < g->faces.start[f + 1]; i++)
        for (int k = 0; k < 3; k++) centre[k] += x[3 * (size_t)g->faces.vert[i] + (size_t)k] / r;
    for (uint32_t i = g->faces.start[f]; i < g->faces.start[f + 1]; i++) {
        uint32_t j = i + 1 < g->faces.start[f + 1] ? i + 1 : g->faces.start[f];
        double p[3], s[3];
        for (int k = 0; k < 3; k++) {
            p[k] = x[3 * (size_t)g->faces.vert[i] + (size_t)k] - centre[k];
            s[k] = x[3 * (size_t)g->faces.vert[j] + (size_t)k] - centre[k];
        }
        for (int k = 0; k < 3; k++) n[k] += (p[(k + 1) % 3] - s[(k + 1) % 3]) * (p[(k + 2) % 3] + s[(k + 2) % 3]);
    }
    for (int k = 0; k < 3; k++) u[k] = x[3 * (size_t)g->faces.vert[c] + (size_t)k] - centre[k];
    double length = sqrt(dot(u, u, 3)), along;
    for (int k = 0; k < 3; k++) u[k] /= length;
    along = dot(n, u, 3);
    for (int k = 0; k < 3; k++) n[k] -= along * u[k];
    length = sqrt(dot(n, n, 3));
    for (int k = 0; k < 3; k++) n[k] /= length;
    cross(n, u, b);
    for (int k = 0; k < 3; k++) F[3 * k] = u[k], F[3 * k + 1] = b[k], F[3 * k + 2] = n[k];
}

/* J = cos t I + sin t [k]x + (1 - cos t) k k', k = r x d / |r x d| */
static void rodrigues(const double r[3], const double d[3], double J[9])
{
    double k[3], rl = sqrt(dot(r, r, 3)), dl = sqrt(dot(d, d, 3));
    cross(r, d, k);
    double kl = sqrt(dot(k, k, 3)), s = kl / (rl * dl), c = dot(r, d, 3) / (rl * dl);
    for (int i = 0; i < 3; i++) k[i] = kl > 0 ? k[i] / kl : 0;
    const double K[9] = {0, -k[2], k[1], k[2], 0, -k[0], -k[1], k[0], 0};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) J[3 * i + j] = (i == j ? c : 0) + s * K[3 * i + j] + (1 - c) * k[i] * k[j];
}

/* Largest difference between the measured deformation of every corner and the formula; links are left out. */
static double against_formulas(vg_head *h, const double *pose)
{
    vg_graph *g = graph_of(h);
    double *q = measure(h, g, pose), *r = vectors_of(g, h->body.reference), *d = vectors_of(g, pose), worst = 0;
    for (size_t f = 0; f < g->faces.nf - g->nlinks; f++)
        for (uint32_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++) {
            double J[9] = {0}, F[9], R[9], M[9], unit[4], scale = dot(q + 4 * c, q + 4 * c, 4);
            if (g->faces.start[f + 1] - g->faces.start[f] == 2) {
                rodrigues(r + 3 * c, d + 3 * c, J);
            } else {
                frame_of(g, f, c, pose, F);
                frame_of(g, f, c, h->body.reference, R);
                for (int k = 0; k < 27; k++) J[k / 3] += F[k / 9 * 3 + k % 3] * R[k / 3 % 3 * 3 + k % 3];
            }
            for (int k = 0; k < 4; k++) unit[k] = q[4 * c + (size_t)k] / sqrt(scale);
            vg_quat_matrix(unit, M);
            for (int k = 0; k < 9; k++) worst = fmax(worst, fabs(M[k] - J[k]));
            double a = sqrt(dot(d + 3 * c, d + 3 * c, 3) / dot(r + 3 * c, r + 3 * c, 3));
            worst = fmax(worst, fabs(scale / a - 1));
            if (isnan(scale)) worst = INFINITY;
        }
    free(q);
    free(r);
    free(d);
    vg_graph_free(&g);
    return worst;
}

static void test_formulas(void)
{
    vg_head h;
    const char *name;
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        for (double amount = 0; amount < 1; amount += 0.4) {
            double *pose = warp(h.body.reference, h.body.mesh.nv, amount), worst = against_formulas(&h, pose);
            if (!(worst <= 1e-11)) printf("%s, warped by %g:\n", name, amount);
            CHECK_NEAR(worst, 0, 1e-11);
            free(pose);
        }
        vg_head_clear(&h);
    }
}

/* a J r = d for every corner that is not degenerate, links included */
static double misses(vg_head *h, const double *pose)
{
    vg_graph *g = graph_of(h);
    double *q = measure(h, g, pose), *r = vectors_of(g, h->body.reference), *d = vectors_of(g, pose);
    size_t n = vg_graph_corners(g);
    double D = fmax(vg_diagonal(h->body.reference, g->faces.nv), vg_diagonal(pose, g->faces.nv)), worst = 0;
    for (size_t c = 0; c < n; c++) {
        double got[3];
        vg_quat_apply(q + 4 * c, r + 3 * c, got);
        worst = fmax(worst, farthest(got, d + 3 * c, 1) / D);
    }
    free(q);
    free(r);
    free(d);
    vg_graph_free(&g);
    return worst;
}

static void test_turned_and_scaled(void)
{
    static const double units[] = {1, 1e-20, 1e20};
    vg_head h;
    const char *name;
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        for (size_t u = 0; u < 3; u++) {
            for (size_t k = 0; k < 3 * h.body.mesh.nv; k++) h.body.reference[k] *= units[u];
            double *bent = warp(h.body.reference, h.body.mesh.nv, 2);
            CHECK_NEAR(misses(&h, h.body.reference), 0, 1e-12);
            CHECK_NEAR(misses(&h, bent), 0, 1e-12);
            for (size_t k = 0; k < 3 * h.body.mesh.nv; k++)
                bent[k] = -h.body.reference[k]; /* turned inside out: half turns */
            CHECK_NEAR(misses(&h, bent), 0, 1e-12);
            free(bent);
            for (size_t k = 0; k < 3 * h.body.mesh.nv; k++) h.body.reference[k] /= units[u];
        }
        if (test_bad) printf("%s\n", name);
        vg_head_clear(&h);
    }
}

/* ---- rigid motions ---- */

/* the distance of q from +-s */
static double away(const double q[4], const double s[4])
{
    double plus = 0, minus = 0;
    for (int k = 0; k < 4; k++) plus += (q[k] - s[k]) * (q[k] - s[k]), minus += (q[k] + s[k]) * (q[k] + s[k]);
    return sqrt(plus < minus ? plus : minus);
}

static void rotates_all(vg_head *h, const char *name, double angle, double scale)
{
    vg_graph *g = graph_of(h);
    motion t = turn(angle, scale, 3 * vg_diagonal(h->body.reference, g->faces.nv)), only = turn(angle, 1, 0);
    double *pose = move_points(&t, h->body.reference, g->faces.nv), *q = measure(h, g, pose), want[4], worst = 0;
    vg_quat_from_matrix(only.m, want);
    for (int k = 0; k < 4; k++) want[k] *= sqrt(scale);
    for (size_t f = 0; f < g->faces.nf; f++) {
        if (f < g->faces.nf - g->nlinks && g->faces.start[f + 1] - g->faces.start[f] == 2) continue; /* a bone has no roll */
        for (uint32_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++) {
            const uint32_t *v = g->faces.vert + g->faces.start[f];
            /* a link between coincident vertices has no length to scale */
            bool no_length = f >= g->faces.nf - g->nlinks && farthest(h->body.reference + 3 * (size_t)v[0],
                                                                h->body.reference + 3 * (size_t)v[1], 1) < 1e-9;
            if (!no_length) worst = fmax(worst, away(q + 4 * c, want) / sqrt(scale));
        }
    }
    if (!(worst <= 1e-11)) printf("%s turned by %g, scaled by %g:\n", name, angle, scale);
    CHECK_NEAR(worst, 0, 1e-11);
    free(pose);
    free(q);
    vg_graph_free(&g);
}

static void test_rigid(void)
{
    vg_head h;
    const char *name;
    static const double angles[] = {0, 1e-9, 0.7, 2.9, M_PI, -M_PI + 1e-9};
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        for (size_t k = 0; k < sizeof angles / sizeof *angles; k++) {
            rotates_all(&h, name, angles[k], 1);
            rotates_all(&h, name, angles[k], k % 2 ? 0.3 : 40);
        }
        vg_head_clear(&h);
    }
}

/* A source that is only turned, scaled and moved does that to another body's vectors, bones aside. */
static void test_rigid_transfer(void)
{
    static const struct {
        const char *source, *target;
    } pairs[] = {{"human-man-poses.tar.xz", "human-heavy-poses.tar.xz"}, {"faceA.tar.xz", "faceB.tar.xz"},
                 {"woman-tanktop-jump.tar.xz", NULL}, {"trex-walk.tar.xz", NULL}};
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        film s = load_film(pairs[i].source, NULL, 1),
             t = load_film(pairs[i].target ? pairs[i].target : pairs[i].source, NULL, 1);
        vg_graph *g = graph_of(&s.h);
        size_t n = 3 * vg_graph_corners(g);
        motion by = turn(2, 1.5, 4);
        double *target = pairs[i].target ? t.pose[0] : warp(t.pose[0], g->faces.nv, 0.3),
               *pose = move_points(&by, s.pose[0], g->faces.nv);
        double *w = vectors_of(g, target), *got = room(n, sizeof *got);
        vg_deformer *d = deformer(g, s.h.body.reference, 2);
        aim(d, g, target);
        for (size_t c = 0; c < n / 3; c++) move_vector(&by, w + 3 * c, w + 3 * c);
        vg_deformer_transfer(d, 1, VG_VERTICES, CONST(&pose), &got);
        CHECK_NEAR(farthest(got, w, n / 3) / vg_diagonal(target, g->faces.nv), 0, 1e-11);
        CHECK(vg_deformer_get_stats(d).corners == 0);
        vg_deformer_free(&d);
        vg_graph_free(&g);
        if (!pairs[i].target) free(target);
        free(pose);
        free(w);
        free(got);
        film_clear(&s);
        film_clear(&t);
    }
}

/* A source in another unit (reference and poses) is the same source. */
static void test_unit_of_source(void)
{
    vg_head h;
    const char *name;
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        vg_graph *g = graph_of(&h);
        size_t n = 4 * vg_graph_corners(g), nv = g->faces.nv;
        double *pose = warp(h.body.reference, nv, 0.8), *before = measure(&h, g, pose), worst = 0;
        static const double units[] = {2, 0x1p-70, 0x1p70, 1e-3};
        for (size_t u = 0; u < sizeof units / sizeof *units; u++) {
            for (size_t k = 0; k < 3 * nv; k++) h.body.reference[k] *= units[u], pose[k] *= units[u];
            double *after = measure(&h, g, pose);
            for (size_t k = 0; k < n; k += 4) worst = fmax(worst, away(before + k, after + k));
            free(after);
            for (size_t k = 0; k < 3 * nv; k++) h.body.reference[k] /= units[u], pose[k] /= units[u];
        }
        if (!(worst <= 1e-12)) printf("%s:\n", name);
        CHECK_NEAR(worst, 0, 1e-12);
        free(pose);
        free(before);
        vg_graph_free(&g);
        vg_head_clear(&h);
    }
}

/* ---- the two ways: measured and applied, or transferred at once ---- */

/* poses as vertices and as vectors, through both ways onto a warped target; the largest difference in D */
static double ways_differ(vg_head *h, size_t n, const double *const *poses, const double *target)
{
    vg_graph *g = graph_of(h);
    size_t corners = vg_graph_corners(g);
    double **q = lists(n, 4 * corners), **a = lists(n, 3 * corners), **b = lists(n, 3 * corners),
           **w = lists(n, 3 * corners);
    double D = vg_diagonal(target, g->faces.nv), worst = 0;
    vg_deformer *d = deformer(g, h->body.reference, 1);
    aim(d, g, target);
    vg_deformer_measure(d, n, VG_VERTICES, poses, q);
    vg_deformer_apply(d, n, CONST(q), a);
    vg_deformer_transfer(d, n, VG_VERTICES, poses, b);
    for (size_t i = 0; i < n; i++) {
        double stretch = 1;
        for (size_t c = 0; c < corners; c++) stretch = fmax(stretch, dot(q[i] + 4 * c, q[i] + 4 * c, 4));
        worst = fmax(worst, farthest(a[i], b[i], corners) / (D * stretch));
        vg_graph_vectors(g, poses[i], w[i]);
        memset(b[i], 0, 3 * corners * sizeof(double));
    }
    vg_deformer_transfer(d, n, VG_VECTORS, CONST(w), b);
    for (size_t i = 0; i < n; i++) worst = fmax(worst, farthest(a[i], b[i], corners) / D);
    vg_deformer_measure(d, n, VG_VECTORS, CONST(w), q);
    vg_deformer_apply(d, n, CONST(q), b);
    for (size_t i = 0; i < n; i++) worst = fmax(worst, farthest(a[i], b[i], corners) / D);
    vg_deformer_free(&d);
    free_lists(q, n), free_lists(a, n), free_lists(b, n), free_lists(w, n);
    vg_graph_free(&g);
    return worst;
}

static void test_two_ways(void)
{
    enum { POSES = 9 };
    vg_head h;
    const char *name;
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        double *poses[POSES], *target = warp(h.body.reference, h.body.mesh.nv, 0.3);
        for (size_t k = 0; k < POSES; k++) poses[k] = warp(h.body.reference, h.body.mesh.nv, 0.15 * (double)k);
        double differ = ways_differ(&h, POSES, CONST(poses), target);
        if (!(differ <= 1e-12)) printf("%s:\n", name);
        CHECK_NEAR(differ, 0, 1e-12);
        for (size_t k = 0; k < POSES; k++) free(poses[k]);
        free(target);
        vg_head_clear(&h);
    }
    film f = load_film("trex-walk.tar.xz", "trex.rest.obj", 12);
    double *target = warp(f.h.body.reference, f.h.body.mesh.nv, 0.2);
    CHECK_NEAR(ways_differ(&f.h, f.n, CONST(f.pose), target), 0, 1e-12);
    free(target);
    film_clear(&f);
}

static void test_threads_and_batches(void)
{
    enum { POSES = 17 };
    vg_head shapes[] = {make_rod(70, 40, true), make_pieces(), make_degenerate(), make_mixed(12), make_degenerate()};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        vg_graph *g = graph_of(&shapes[i]);
        size_t corners = vg_graph_corners(g);
        double *poses[POSES], **q = lists(POSES, 4 * corners), **w = lists(POSES, 3 * corners);
        double **q1 = lists(POSES, 4 * corners), **w1 = lists(POSES, 3 * corners);
        for (size_t k = 0; k < POSES; k++) poses[k] = warp(shapes[i].body.reference, g->faces.nv, 0.1 * (double)k);
        vg_deformer *d = deformer(g, shapes[i].body.reference, 1);
        aim_by(d, g, poses[2], methods[i % 3]);
        for (size_t k = 0; k < POSES; k++) {
            vg_deformer_measure(d, 1, VG_VERTICES, CONST(poses + k), q1 + k);
            vg_deformer_transfer(d, 1, VG_VERTICES, CONST(poses + k), w1 + k);
        }
        vg_deform_stats counts = vg_deformer_get_stats(d);
        vg_deformer_free(&d);
        for (int threads = 1; threads <= 3; threads++) {
            for (size_t batch = 1; batch <= POSES; batch++) {
                d = deformer(g, shapes[i].body.reference, threads);
                aim_by(d, g, poses[2], methods[i % 3]);
                for (size_t k = 0; k < POSES; k += batch) {
                    size_t n = POSES - k < batch ? POSES - k : batch;
                    vg_deformer_measure(d, n, VG_VERTICES, CONST(poses + k), q + k);
                    vg_deformer_transfer(d, n, VG_VERTICES, CONST(poses + k), w + k);
                }
                bool same = true;
                for (size_t k = 0; k < POSES; k++)
                    same &= !memcmp(q[k], q1[k], 4 * corners * sizeof(double)) &&
                            !memcmp(w[k], w1[k], 3 * corners * sizeof(double));
                if (!same) printf("shape %zu, %d threads, %zu poses a call:\n", i, threads, batch);
                CHECK(same);
                CHECK(vg_deformer_get_stats(d).corners == counts.corners);
                CHECK(vg_deformer_get_stats(d).first_face == counts.first_face);
                vg_deformer_free(&d);
            }
        }
        for (size_t k = 0; k < POSES; k++) free(poses[k]);
        free_lists(q, POSES), free_lists(w, POSES), free_lists(q1, POSES), free_lists(w1, POSES);
        vg_graph_free(&g);
        vg_head_clear(&shapes[i]);
    }
}

/* ---- degenerate corners ---- */

static void test_degenerate(void)
{
    vg_head h = make_degenerate();
    vg_graph *g = graph_of(&h);
    size_t corners = vg_graph_corners(g), nv = g->faces.nv;
    CHECK(g->nlinks == 0);
    motion t = turn(1.1, 1, 2);
    double *pose = move_points(&t, h.body.reference, nv), *q = room(4 * corners, sizeof *q), want[4];
    static const double identity[4] = {1, 0, 0, 0};
    vg_quat_from_matrix(t.m, want);
    vg_deformer *d = deformer(g, h.body.reference, 1);
    CHECK(vg_deformer_get_stats(d).corners == 0 && vg_deformer_get_stats(d).first_face == UINT64_MAX);
    vg_deformer_measure(d, 1, VG_VERTICES, CONST(&pose), &q);
    /* three on the face without area, three on the point, two on the segment without length,
     * one at its face's centroid */
    CHECK(vg_deformer_get_stats(d).corners == 9 && vg_deformer_get_stats(d).first_face == 1);
    for (size_t f = 0; f < g->faces.nf; f++)
        for (uint32_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++) {
            bool alone = f >= 1 && f <= 3, bone = f == 4;
            if (!bone) CHECK_NEAR(away(q + 4 * c, alone ? identity : want), 0, 1e-12);
        }
    aim(d, g, h.body.reference);
    double *w = vectors_of(g, pose), *got = room(3 * corners, sizeof *got);
    vg_deformer_transfer(d, 1, VG_VERTICES, CONST(&pose), &got);
    CHECK(vg_deformer_get_stats(d).corners == 18);
    for (size_t f = 0; f < g->faces.nf; f++)
        for (uint32_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++)
            /* face 1 has vectors, but no turn */
            if (f != 1) CHECK_NEAR(farthest(got + 3 * c, w + 3 * c, 1), 0, 1e-12);
    vg_deformer_free(&d);
    free(pose);
    free(q);
    free(w);
    free(got);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

/* A face that collapses in one pose of a block is mended there and nowhere else. */
static void test_collapsed_in_one_pose(void)
{
    enum { POSES = 8, BAD = 3 };
    vg_head h = make_torus(12, 9);
    vg_graph *g = graph_of(&h);
    size_t corners = vg_graph_corners(g);
    double *poses[POSES], **good = lists(POSES, 3 * corners), **bad = lists(POSES, 3 * corners);
    for (size_t k = 0; k < POSES; k++) poses[k] = warp(h.body.reference, g->faces.nv, 0.1 * (double)k);
    vg_deformer *d = deformer(g, h.body.reference, 1);
    aim(d, g, poses[1]);
    vg_deformer_transfer(d, POSES, VG_VERTICES, CONST(poses), good);
    CHECK(vg_deformer_get_stats(d).corners == 0);
    for (uint32_t c = 4 * 50; c < 4 * 51; c++) memcpy(poses[BAD] + 3 * g->faces.vert[c], poses[BAD], 3 * sizeof(double));
    vg_deformer_transfer(d, POSES, VG_VERTICES, CONST(poses), bad);
    CHECK(vg_deformer_get_stats(d).corners >= 4 && vg_deformer_get_stats(d).corners < 40);
    CHECK(vg_deformer_get_stats(d).first_face <= 50 && vg_deformer_get_stats(d).first_face > 20);
    for (size_t k = 0; k < POSES; k++) {
        if (k != BAD) CHECK(!memcmp(good[k], bad[k], 3 * corners * sizeof(double)));
        CHECK(vgi_finite(bad[k], 3 * corners));
    }
    /* its own corners are not turned, for there is nothing to tell how */
    double *target = vectors_of(g, poses[1]);
    CHECK_NEAR(farthest(bad[BAD] + 3 * 200, target + 3 * 200, 4), 0, 1e-14);
    free(target);
    vg_deformer_free(&d);
    for (size_t k = 0; k < POSES; k++) free(poses[k]);
    free_lists(good, POSES), free_lists(bad, POSES);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

/* 1e-9 D is where a vector stops having a direction, in the reference as in a pose. */
static void test_where_degenerate_begins(void)
{
    for (int factor = 0; factor < 2; factor++) {
        vg_head h = new_shape();
        double tiny = factor ? 1e-8 : 1e-10; /* D is about 1 */
        add_vertex(&h, 0, 0, 0), add_vertex(&h, 0.6, 0, 0), add_vertex(&h, 0, 0.8, 0), add_vertex(&h, tiny, 0, 0);
        FACE(&h, 0, 1, 2);
        FACE(&h, 0, 3);
        vg_graph *g = graph_of(&h);
        double *q = room(4 * vg_graph_corners(g), sizeof *q);
        vg_deformer *d = deformer(g, h.body.reference, 1);
        vg_deformer_measure(d, 1, VG_VERTICES, CONST(&h.body.reference), &q);
        CHECK(vg_deformer_get_stats(d).corners == (factor ? 0 : 2));
        CHECK(vg_deformer_get_stats(d).first_face == (factor ? UINT64_MAX : 1));
        vg_deformer_free(&d);
        free(q);
        vg_graph_free(&g);
        vg_head_clear(&h);
    }
}

/* Whatever stands in a pose, no number comes out that is not finite. */
static void test_nothing_but_finite(void)
{
    vg_head h = make_degenerate();
    static const double values[] = {0, 1, -1, 1e-300, 1e-12, 1e9, 0.5};
    vg_graph *g = graph_of(&h);
    size_t corners = vg_graph_corners(g);
    double *pose = room(3 * g->faces.nv, sizeof *pose), *q = room(4 * corners, sizeof *q),
           *w = room(3 * corners, sizeof *w);
    vg_deformer *d = deformer(g, h.body.reference, 1);
    for (int trial = 0; trial < 3000; trial++) {
        for (size_t i = 0; i < 3 * g->faces.nv; i++) pose[i] = values[(size_t)((noise() + 1) * 3.4999)];
        vg_deformer_measure(d, 1, VG_VERTICES, CONST(&pose), &q);
        if (trial % 1000 == 0) aim_by(d, g, h.body.reference, methods[trial / 1000]);
        vg_deformer_transfer(d, 1, VG_VERTICES, CONST(&pose), &w);
        CHECK(vgi_finite(q, 4 * corners) && vgi_finite(w, 3 * corners));
        for (size_t c = 0; c < corners; c++) CHECK(dot(q + 4 * c, q + 4 * c, 4) > 0);
    }
    vg_deformer_free(&d);
    free(pose);
    free(q);
    free(w);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

/* ---- by gradient and blend ---- */

/* x of A x = b, A 3 x 3 (rows), by Cramer's rule */
static void solve3(const double A[9], const double b[3], double x[3])
{
    double c[9], det;
    for (size_t i = 0; i < 3; i++) cross(A + 3 * ((i + 1) % 3), A + 3 * ((i + 2) % 3), c + 3 * i);
    det = dot(A, c, 3);
    for (size_t k = 0; k < 3; k++) x[k] = (b[0] * c[k] + b[1] * c[3 + k] + b[2] * c[6 + k]) / det;
}

static void newell(const double *w, size_t r, double n[3])
{
    n[0] = n[1] = n[2] = 0;
    for (size_t i = 0; i < r; i++) {
        double part[3];
        cross(w + 3 * i, w + 3 * ((i + 1) % r), part);
        for (int k = 0; k < 3; k++) n[k] += part[k];
    }
    double length = sqrt(dot(n, n, 3));
    for (int k = 0; k < 3; k++) n[k] /= length;
}

/* D = (sum d r' + h n_d n_r') (sum r r' + h n_r n_r')^-1, h = sum |r|^2 / 2 (MATH 5); the wanted vector is D t, and
 * of what D leaves of d the part that the target's size asks for. */
static void by_gradient(const double *r, const double *d, const double *t, size_t n, double *wanted)
{
    double A[9], M[9], nr[3], nd[3], h = dot(r, r, 3 * n) / 2, rho = sqrt(dot(t, t, 3 * n) / dot(r, r, 3 * n));
    newell(r, n, nr);
    newell(d, n, nd);
    for (int k = 0; k < 9; k++) A[k] = h * nr[k / 3] * nr[k % 3], M[k] = h * nd[k / 3] * nr[k % 3];
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < 9; k++) {
            A[k] += r[3 * i + k / 3] * r[3 * i + k % 3];
            M[k] += d[3 * i + k / 3] * r[3 * i + k % 3];
        }
    for (size_t i = 0; i < n; i++) {
        double z[3], left[3];
        solve3(A, t + 3 * i, z);
        solve3(A, r + 3 * i, left);
        for (size_t k = 0; k < 3; k++)
            wanted[3 * i + k] = dot(M + 3 * k, z, 3) + rho * (d[3 * i + k] - dot(M + 3 * k, left, 3));
    }
}

static void test_gradient(void)
{
    vg_head h;
    const char *name;
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        vg_graph *g = graph_of(&h);
        size_t corners = vg_graph_corners(g);
        double *pose = warp(h.body.reference, g->faces.nv, 0.6), *target = warp(h.body.reference, g->faces.nv, -0.3), *w[3];
        double *r = vectors_of(g, h.body.reference), *p = vectors_of(g, pose), *t = vectors_of(g, target);
        double *want = room(3 * g->max_corners, sizeof *want), D = vg_diagonal(target, g->faces.nv), worst = 0, apart = 0;
        vg_deformer *d = deformer(g, h.body.reference, 1);
        for (int k = 0; k < 3; k++) {
            w[k] = room(3 * corners, sizeof(double));
            aim_by(d, g, target, methods[k]);
            vg_deformer_transfer(d, 1, VG_VERTICES, CONST(&pose), &w[k]);
        }
        for (size_t f = 0; f < g->faces.nf; f++) {
            size_t c = 3 * (size_t)g->faces.start[f], n = g->faces.start[f + 1] - g->faces.start[f];
            if (n > 2) by_gradient(r + c, p + c, t + c, n, want);
            else memcpy(want, w[0] + c, 6 * sizeof *want); /* line segments go by pose */
            worst = fmax(worst, farthest(w[1] + c, want, n));
            for (size_t k = 0; k < 3 * n; k++) want[k] = (want[k] + w[0][c + k]) / 2;
            worst = fmax(worst, farthest(w[2] + c, want, n));
            apart = fmax(apart, farthest(w[1] + c, w[0] + c, n));
        }
        if (!(worst <= 1e-12 * D)) printf("%s:\n", name);
        CHECK_NEAR(worst, 0, 1e-12 * D);
        if (g->max_corners > 2) CHECK(apart > 1e-4 * D); /* the methods are not the same thing */
        vg_deformer_free(&d);
        free(pose), free(target), free(r), free(p), free(t), free(want), free(w[0]), free(w[1]), free(w[2]);
        vg_graph_free(&g);
        vg_head_clear(&h);
    }
}

/* ---- by offset ---- */

/* A sheet that stays flat has a face's rotation in closed form: the map diag(p, q) has none, and what turns it turns
 * everything. The rotation of a corner is the smallest from r to its image. With b = t - scale r the wanted vector is
 * the turned scale diag(p, q) r + (b + b as the corner turns it) / 2. */
static void test_offset(void)
{
    static const double p = 1.7, q = 0.6, a = 0.8, b = 1.3, c = 0.8, s = 0.6; /* the sheet turns about x */
    vg_head h = make_uneven_sheet(5, 1, 1), other = make_uneven_sheet(5, a, b);
    vg_graph *g = graph_of(&h);
    size_t nv = h.body.mesh.nv, corners = vg_graph_corners(g);
    double *pose = room(3 * nv, sizeof *pose), *w = room(3 * corners, sizeof *w), worst = 0, source2 = 0, target2 = 0;
    double *r = vectors_of(g, h.body.reference), *t = vectors_of(g, other.body.reference);
    for (size_t v = 0; v < nv; v++) {
        double y = q * h.body.reference[3 * v + 1];
        memcpy(pose + 3 * v, (double[]){p * h.body.reference[3 * v], c * y, s * y}, 3 * sizeof *pose);
    }
    vg_deformer *d = deformer(g, h.body.reference, 1);
    aim_by(d, g, other.body.reference, VG_BY_OFFSET);
    vg_deformer_transfer(d, 1, VG_VERTICES, CONST(&pose), &w);
    for (size_t i = 0; i < 3 * corners; i++) source2 += r[i] * r[i], target2 += t[i] * t[i];
    double scale = sqrt(target2 / source2);
    for (size_t i = 0; i < 3 * corners; i += 3) {
        double x = r[i], y = r[i + 1], e[2] = {t[i] - scale * x, t[i + 1] - scale * y};
        double angle = atan2(q * y, p * x) - atan2(y, x);
        double u = scale * p * x + (e[0] + cos(angle) * e[0] - sin(angle) * e[1]) / 2;
        double v = scale * q * y + (e[1] + sin(angle) * e[0] + cos(angle) * e[1]) / 2;
        worst = fmax(worst, fabs(w[i] - u) + fabs(w[i + 1] - c * v) + fabs(w[i + 2] - s * v));
    }
    CHECK_NEAR(worst, 0, 1e-12);
    vg_deformer_free(&d);
    free(pose), free(w), free(r), free(t);
    vg_graph_free(&g);
    vg_head_clear(&h), vg_head_clear(&other);
}

/* Rotation of the polar decomposition of M: the limit of (M + M^-T) / 2. */
static void polar(double M[9])
{
    for (int round = 0; round < 60; round++) {
        double c[9], det;
        for (size_t i = 0; i < 3; i++) cross(M + 3 * ((i + 1) % 3), M + 3 * ((i + 2) % 3), c + 3 * i);
        det = dot(M, c, 3);
        for (int k = 0; k < 9; k++) M[k] = (M[k] + c[k] / det) / 2;
    }
}

/* Columns: the direction of v, and of what n has perpendicular to it, and their product. */
static void corner_frame(const double *v, const double n[3], double f[9])
{
    double u[3], m[3], side[3], length = sqrt(dot(v, v, 3)), along = dot(n, v, 3) / length;
    for (int k = 0; k < 3; k++) u[k] = v[k] / length, m[k] = n[k] - along * u[k];
    length = sqrt(dot(m, m, 3));
    for (int k = 0; k < 3; k++) m[k] /= length;
    cross(m, u, side);
    for (int k = 0; k < 3; k++) f[3 * k] = u[k], f[3 * k + 1] = side[k], f[3 * k + 2] = m[k];
}

/* scale d + (R + J) b / 2, b = t - scale r, R the rotation of the face and J that of the corner (MATH 5) */
static void by_offset(const double *r, const double *d, const double *t, size_t n, double scale, double *wanted)
{
    double A[9], M[9], R[9], nr[3], nd[3], h = dot(r, r, 3 * n) / 2;
    newell(r, n, nr);
    newell(d, n, nd);
    for (int k = 0; k < 9; k++) A[k] = h * nr[k / 3] * nr[k % 3], M[k] = h * nd[k / 3] * nr[k % 3];
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < 9; k++) A[k] += r[3 * i + k / 3] * r[3 * i + k % 3], M[k] += d[3 * i + k / 3] * r[3 * i + k % 3];
    for (size_t k = 0; k < 3; k++) solve3(A, M + 3 * k, R + 3 * k); /* A is symmetric */
    polar(R);
    for (size_t i = 0; i < n; i++) {
        double from[9], to[9], b[3], own[3] = {0, 0, 0};
        for (size_t k = 0; k < 3; k++) b[k] = t[3 * i + k] - scale * r[3 * i + k];
        corner_frame(r + 3 * i, nr, from);
        corner_frame(d + 3 * i, nd, to);
        for (size_t a = 0; a < 3; a++)
            for (size_t k = 0; k < 3; k++) own[a] += from[3 * k + a] * b[k];
        for (size_t k = 0; k < 3; k++) wanted[3 * i + k] = scale * d[3 * i + k] + (dot(R + 3 * k, b, 3) + dot(to + 3 * k, own, 3)) / 2;
    }
}

/* Vertices, and vectors that no vertices have: those of a face are in no plane and have a sum. */
static void test_offset_of_any(void)
{
    vg_head h;
    const char *name;
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        vg_graph *g = graph_of(&h);
        size_t corners = vg_graph_corners(g), last = 3 * (size_t)g->faces.start[g->faces.nf - g->nlinks];
        double *pose = warp(h.body.reference, g->faces.nv, 0.6), *target = warp(h.body.reference, g->faces.nv, -0.3);
        double *r = vectors_of(g, h.body.reference), *p = vectors_of(g, pose), *t = vectors_of(g, target);
        double *w = room(3 * corners, sizeof *w), *want = room(3 * g->max_corners, sizeof *want), D = vg_diagonal(target, g->faces.nv);
        double scale = sqrt(dot(t, t, last) / dot(r, r, last)), worst = 0;
        vg_deformer *d = deformer(g, h.body.reference, 1);
        aim_by(d, g, target, VG_BY_OFFSET);
        for (int apart = 0; apart < 2; apart++) {
            for (size_t c = 0; c < corners && apart; c++) {
                double size = 0.2 * sqrt(dot(p + 3 * c, p + 3 * c, 3));
                for (int k = 0; k < 3; k++) p[3 * c + k] += size * noise();
            }
            vg_deformer_transfer(d, 1, apart ? VG_VECTORS : VG_VERTICES, CONST(apart ? &p : &pose), &w);
            for (size_t f = 0; f < g->faces.nf - g->nlinks; f++) {
                size_t c = 3 * (size_t)g->faces.start[f], n = g->faces.start[f + 1] - g->faces.start[f];
                if (n < 3) continue;
                by_offset(r + c, p + c, t + c, n, scale, want);
                worst = fmax(worst, farthest(w + c, want, n));
            }
        }
        if (!(worst <= 1e-12 * D)) printf("%s:\n", name);
        CHECK_NEAR(worst, 0, 1e-12 * D);
        vg_deformer_free(&d);
        free(pose), free(target), free(r), free(p), free(t), free(w), free(want);
        vg_graph_free(&g);
        vg_head_clear(&h);
    }
}

/* ---- target = source, through the solve ---- */

static double self_transfer(vg_head *h, size_t n, const double *const *poses, vg_method method, int threads)
{
    vg_graph *g = graph_of(h);
    size_t corners = vg_graph_corners(g);
    double **w = lists(n, 3 * corners), **x = lists(n, 3 * g->faces.nv), **rhs = lists(n, 3 * g->faces.nv), **root = lists(n, 3),
           worst = 0;
    vg_err e;
    vg_solver *s;
    vg_deformer *d = deformer(g, h->body.reference, threads);
    aim_by(d, g, h->body.reference, method);
    vg_deformer_transfer(d, n, VG_VERTICES, poses, w);
    if (vg_solver_new(&s, g, NULL, 0, h->body.reference, VG_WEIGHTS_UNIFORM, threads, &e) < 0) abort();
    for (size_t i = 0; i < n; i++) vg_graph_root(g, poses[i], root[i]);
    vg_solver_load(s, n, CONST(w), NULL, x, rhs);
    vg_solver_solve(s, n, CONST(rhs), x, NULL, CONST(root));
    for (size_t i = 0; i < n; i++) {
        for (size_t v = 0; v < g->faces.nv; v++)
            if (!g->in_face[v]) memcpy(x[i] + 3 * v, poses[i] + 3 * v, 3 * sizeof(double));
        worst = fmax(worst, farthest(x[i], poses[i], g->faces.nv) / vg_diagonal(poses[i], g->faces.nv));
    }
    vg_solver_free(&s);
    vg_deformer_free(&d);
    free_lists(w, n), free_lists(x, n), free_lists(rhs, n), free_lists(root, n);
    vg_graph_free(&g);
    return worst;
}

static void test_onto_itself(void)
{
    vg_head h;
    const char *name;
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        double *pose = warp(h.body.reference, h.body.mesh.nv, 1);
        for (size_t k = 0; k < METHODS; k++) {
            double worst = self_transfer(&h, 1, CONST(&pose), methods[k], 1);
            if (!(worst <= 1e-10)) printf("%s, method %zu:\n", name, k);
            CHECK_NEAR(worst, 0, 1e-10);
        }
        free(pose);
        vg_head_clear(&h);
    }
    static const struct {
        const char *poses, *rest;
        size_t most;
    } all[] = {{"trex-walk.tar.xz", "trex.rest.obj", 34}, {"horse-run.tar.xz", "horse.rest.obj", 21},
               {"woman-tanktop-jump.tar.xz", "woman-tanktop.rest.obj", 26}, {"human-man-poses.tar.xz", NULL, 8},
               {"faceB.tar.xz", NULL, 6}};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        film f = load_film(all[i].poses, all[i].rest, all[i].most);
        for (size_t k = 0; k < METHODS; k++) {
            double worst = self_transfer(&f.h, f.n, CONST(f.pose), methods[k], 2);
            if (!(worst <= 1e-10)) printf("%s, method %zu:\n", all[i].poses, k);
            CHECK_NEAR(worst, 0, 1e-10);
        }
        film_clear(&f);
    }
}

TESTS({"Frames and Rodrigues as the formulas have them", test_formulas}, {"a J r = d", test_turned_and_scaled},
      {"rigid motions turn every corner alike, links too", test_rigid},
      {"a rigid source moves another body rigidly", test_rigid_transfer},
      {"the unit of the source does not matter", test_unit_of_source},
      {"measured and applied is transferred", test_two_ways},
      {"threads and batches change no bit", test_threads_and_batches},
      {"degenerate corners take the turn of their face", test_degenerate},
      {"a face that collapses in one pose", test_collapsed_in_one_pose},
      {"where degenerate begins", test_where_degenerate_begins},
      {"nothing but finite numbers", test_nothing_but_finite},
      {"gradient and blend as the formulas have them", test_gradient},
      {"offset on a flat sheet as the formula has it", test_offset},
      {"offset of vertices and of any vectors as the formula has it", test_offset_of_any}, {"onto itself", test_onto_itself})
