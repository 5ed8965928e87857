/* test_planar.c: the search for planar faces finds the minimum that a dense solution of the normal equations has,
 * keeps anchors and roots, leaves alone what has no faces of four and more or is planar already, and no pose
 * depends on those beside it.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "dense.h"

enum { POSES = 11 };

typedef struct problem {
    const vg_graph *g;
    const double *reference;
    const uint32_t *anchors;
    size_t nanchors, n;
    double *w[POSES], *at[POSES]; /* vectors; anchors, or the root */
    double fidelity, planarity;
    vg_weights weights;
} problem;

typedef struct answer {
    double *plain[POSES], *x[POSES];
    size_t good;
    vg_planar_stats stats;
} answer;

static void clear(answer *a, size_t n)
{
    for (size_t i = 0; i < n; i++) free(a->plain[i]), free(a->x[i]);
}

static answer solve(const problem *q, int threads, size_t batch)
{
    answer a = {.good = q->n};
    vg_solver *s;
    vg_planar *p;
    vg_err e = {0, ""};
    double *rhs[POSES], *normals[POSES];
    if (vg_solver_new(&s, q->g, q->anchors, q->nanchors, q->reference, q->weights, threads, &e) < 0 ||
        vg_planar_new(&p, s, q->fidelity, q->planarity, &e) < 0) {
        printf("%s\n", e.message);
        exit(1);
    }
    for (size_t i = 0; i < q->n; i++) {
        a.x[i] = room(3 * q->g->faces.nv, sizeof(double)), rhs[i] = room(3 * q->g->faces.nv, sizeof(double));
        normals[i] = room(3 * vg_planar_faces(p), sizeof(double));
        vg_planar_load(p, q->w[i], normals[i]);
    }
    const double *const *at = (const double *const *)q->at;
    vg_solver_load(s, q->n, (const double *const *)q->w, q->nanchors ? at : NULL, a.x, rhs);
    vg_solver_solve(s, q->n, (const double *const *)rhs, a.x, q->nanchors ? at : NULL, q->nanchors ? NULL : at);
    for (size_t i = 0; i < q->n; i++) {
        a.plain[i] = room(3 * q->g->faces.nv, sizeof(double));
        memcpy(a.plain[i], a.x[i], 3 * q->g->faces.nv * sizeof(double));
    }
    for (size_t i = 0; i < q->n; i += batch) {
        size_t some = q->n - i < batch ? q->n - i : batch;
        size_t good = vg_planar_solve(p, some, (const double *const *)normals + i, a.x + i);
        if (good < some && i + good < a.good) a.good = i + good;
    }
    a.stats = vg_planar_get_stats(p);
    for (size_t i = 0; i < q->n; i++) free(rhs[i]), free(normals[i]);
    vg_planar_free(&p);
    vg_solver_free(&s);
    CHECK(p == NULL);
    return a;
}

/* Poses of h, warped more and more, their vectors disturbed; anchors or roots elsewhere in each. */
static problem make_problem(const vg_head *h, const vg_graph *g, const uint32_t *anchors, size_t nanchors,
                            double disturb)
{
    problem q = {.g = g,
                 .reference = h->body.reference,
                 .anchors = anchors,
                 .nanchors = nanchors,
                 .n = POSES,
                 .fidelity = 0.05,
                 .planarity = 1,
                 .weights = VG_WEIGHTS_UNIFORM};
    double D = vg_diagonal(h->body.reference, g->faces.nv);
    for (size_t k = 0; k < POSES; k++) {
        double *pose = warp(h->body.reference, g->faces.nv, 0.15 * (double)k);
        q.w[k] = vectors_of(g, pose);
        q.at[k] = room(3 * (nanchors + 1), sizeof(double));
        vg_graph_anchors(pose, anchors, nanchors, q.at[k]);
        if (!nanchors)
            for (int i = 0; i < 3; i++) q.at[k][i] = D * noise();
        for (size_t c = 0; c < 3 * vg_graph_corners(g); c++) q.w[k][c] += disturb * D * noise();
        free(pose);
    }
    return q;
}

static void clear_problem(problem *q)
{
    for (size_t k = 0; k < q->n; k++) free(q->w[k]), free(q->at[k]);
}

/* ---- the dense solution ---- */

static void cross(const double *a, const double *b, double *c)
{
    double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    c[0] += x, c[1] += y, c[2] += z;
}

static bool normalise(double *m)
{
    double length = sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
    for (int k = 0; k < 3 && length > 0; k++) m[k] /= length;
    return length > 0;
}

/* The r x r matrix of a face's energy: its metric, or the projector that takes the mean away. */
static void face_energy(const problem *q, const double *rest, size_t f, double *G)
{
    size_t begin = q->g->faces.start[f], r = q->g->faces.start[f + 1] - begin;
    for (size_t i = 0; i < r * r; i++) G[i] = (i % (r + 1) == 0) - 1.0 / (double)r;
    if (q->weights == VG_WEIGHTS_AREA && r > 2) face_metric(rest + 3 * begin, r, G);
}

/* The 3q x 3q normal equations of pose k, from the definition of the energy. */
static double *dense(const problem *q, size_t k)
{
    const vg_graph *g = q->g;
    size_t n = 3 * g->faces.nv;
    double *M = room(n * n, sizeof *M), *b = room(n, sizeof *b), *w = q->w[k], *rest = vectors_of(g, q->reference);
    for (size_t f = 0; f < g->faces.nf; f++) {
        size_t begin = g->faces.start[f], r = g->faces.start[f + 1] - begin;
        const uint32_t *vert = g->faces.vert + begin;
        double *G = room(r * r, sizeof *G), mean[3] = {0, 0, 0}, m[3] = {0, 0, 0};
        face_energy(q, rest, f, G);
        for (size_t c = 0; c < r; c++)
            for (size_t i = 0; i < 3; i++) mean[i] += w[3 * (begin + c) + i] / (double)r;
        for (size_t c = 0; c < r; c++) { /* cross products of vectors about their mean: MATH's, whose own mean is 0 */
            double x[3], y[3];
            for (size_t i = 0; i < 3; i++)
                x[i] = w[3 * (begin + c) + i] - mean[i], y[i] = w[3 * (begin + (c + 1) % r) + i] - mean[i];
            cross(x, y, m);
        }
        if (r < 4 || !normalise(m)) memset(m, 0, sizeof m);
        for (size_t c = 0; c < r; c++)
            for (size_t d = 0; d < r; d++)
                for (size_t i = 0; i < 3; i++) {
                    b[3 * vert[c] + i] += q->fidelity * G[c * r + d] * w[3 * (begin + d) + i];
                    M[(3 * vert[c] + i) * n + 3 * vert[d] + i] += q->fidelity * G[c * r + d];
                    for (size_t j = 0; j < 3; j++)
                        M[(3 * vert[c] + i) * n + 3 * vert[d] + j] +=
                            q->planarity * ((c == d) - 1.0 / (double)r) * m[i] * m[j];
                }
        free(G);
    }
    for (size_t v = 0, a = 0; v < g->faces.nv; v++) {
        bool anchor = a < q->nanchors && q->anchors[a] == v;
        for (size_t i = 0; i < 3; i++) {
            double *row = M + (3 * v + i) * n;
            if (!g->in_face[v] || anchor) {
                memset(row, 0, n * sizeof *row);
                row[3 * v + i] = 1;
                b[3 * v + i] = anchor ? q->at[k][3 * a + i] : q->reference[3 * v + i];
            } else if (!q->nanchors) { /* the mean is the root */
                for (size_t u = 0; u < g->faces.nv; u++) row[3 * u + i] += g->in_face[u];
                b[3 * v + i] += q->at[k][i] * (double)g->attached;
            }
        }
        a += anchor;
    }
    eliminate(M, b, n, 1);
    free(rest);
    free(M);
    return b;
}

static void against_dense(vg_head *h, const char *name, vg_weights weights, size_t nanchors)
{
    static const uint32_t list[] = {1, 2, 5};
    vg_graph *g = graph_of(h);
    problem q = make_problem(h, g, list, nanchors, 0.02);
    q.weights = weights;
    answer a = solve(&q, 2, POSES);
    CHECK(a.good == POSES && a.stats.worst_residual <= 1e-10);
    double D = vg_diagonal(h->body.reference, g->faces.nv), worst = 0, moved = 0;
    for (size_t k = 0; k < POSES; k += 5) {
        double *want = dense(&q, k);
        worst = fmax(worst, farthest(a.x[k], want, g->faces.nv) / D);
        moved = fmax(moved, farthest(a.x[k], a.plain[k], g->faces.nv) / D);
        free(want);
    }
    if (!(worst <= 1e-8)) printf("%s, %zu anchors:\n", name, nanchors);
    CHECK_NEAR(worst, 0, 1e-8);
    CHECK(a.stats.faces == 0 || moved > 1e-4);
    clear(&a, POSES);
    clear_problem(&q);
    vg_graph_free(&g);
}

static void test_dense(void)
{
    vg_head h;
    const char *name;
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        if (h.body.mesh.nv <= 90 && h.body.mesh.nv > 5 && strcmp(name, "mixed")) {
            against_dense(&h, name, VG_WEIGHTS_UNIFORM, 0);
            against_dense(&h, name, VG_WEIGHTS_UNIFORM, 3);
        }
        vg_head_clear(&h);
    }
    vg_head shapes[] = {make_torus(10, 7), make_rod(6, 6, false), make_mixed(5), make_flower(14)};
    const char *names[] = {"torus", "rod", "mixed", "flower of 14"};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        against_dense(&shapes[i], names[i], VG_WEIGHTS_UNIFORM, 0);
        if (i < 3) against_dense(&shapes[i], names[i], VG_WEIGHTS_AREA, 0);
        if (i < 2) against_dense(&shapes[i], names[i], VG_WEIGHTS_AREA, 2);
        vg_head_clear(&shapes[i]);
    }
}

/* ---- what must stay ---- */

static void test_nothing_to_do(void)
{
    vg_head shapes[] = {make_rod(9, 3, true), make_chain(30), make_tree(20), make_torus(8, 6)};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        vg_graph *g = graph_of(&shapes[i]);
        problem q = make_problem(&shapes[i], g, NULL, 0, 0.05);
        if (i == 3) q.planarity = 0; /* has faces of four, but they count for nothing */
        answer a = solve(&q, 1, POSES);
        CHECK(a.good == POSES && (i == 3 || a.stats.faces == 0) && a.stats.most_steps == 0);
        for (size_t k = 0; k < POSES; k++) CHECK(!memcmp(a.x[k], a.plain[k], 3 * g->faces.nv * sizeof(double)));
        clear(&a, POSES);
        clear_problem(&q);
        vg_graph_free(&g);
        vg_head_clear(&shapes[i]);
    }
}

/* Planar faces that fit together are left where they are, and flat ones too, however skewed. */
static void test_planar_stays(void)
{
    vg_head shapes[] = {make_torus(12, 8), make_rod(10, 5, false), make_ngon(9, 0.5, 0)};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        vg_graph *g = graph_of(&shapes[i]);
        problem q = {.g = g, .reference = shapes[i].body.reference, .n = 1, .fidelity = 0.05, .planarity = 1};
        double root[3], D = vg_diagonal(q.reference, g->faces.nv);
        vg_graph_root(g, q.reference, root);
        q.w[0] = vectors_of(g, q.reference), q.at[0] = root;
        answer a = solve(&q, 1, 1);
        CHECK(a.good == 1);
        CHECK_NEAR(farthest(a.x[0], q.reference, g->faces.nv), 0, 1e-12 * D);
        clear(&a, 1);
        free(q.w[0]);
        vg_graph_free(&g);
        vg_head_clear(&shapes[i]);
    }
}

static void test_anchors_roots_isolated(void)
{
    static const uint32_t anchors[] = {3, 11, 20};
    for (size_t nanchors = 0; nanchors <= 3; nanchors += 3) {
        vg_head h = make_mixed(7);
        vg_graph *g = graph_of(&h);
        problem q = make_problem(&h, g, anchors, nanchors, 0.03);
        answer a = solve(&q, 2, POSES);
        for (size_t k = 0; k < POSES; k++) {
            double root[3];
            for (size_t i = 0; i < nanchors; i++)
                CHECK(!memcmp(a.x[k] + 3 * (size_t)anchors[i], q.at[k] + 3 * i, 3 * sizeof(double)));
            vg_graph_root(g, a.x[k], root);
            for (int i = 0; !nanchors && i < 3; i++)
                CHECK_NEAR(root[i], q.at[k][i], 1e-12 * vg_diagonal(h.body.reference, g->faces.nv));
            for (size_t v = 0; v < g->faces.nv; v++)
                CHECK(g->in_face[v] || !memcmp(a.x[k] + 3 * v, h.body.reference + 3 * v, 3 * sizeof(double)));
        }
        clear(&a, POSES);
        clear_problem(&q);
        vg_graph_free(&g);
        vg_head_clear(&h);
    }
}

static void test_everything_anchored(void)
{
    vg_head h = make_ngon(6, 0.2, 0.4);
    vg_graph *g = graph_of(&h);
    uint32_t all[6] = {0, 1, 2, 3, 4, 5};
    problem q = make_problem(&h, g, all, 6, 0.1);
    answer a = solve(&q, 1, 3);
    CHECK(a.good == POSES);
    for (size_t k = 0; k < POSES; k++) CHECK(!memcmp(a.x[k], q.at[k], 18 * sizeof(double)));
    clear(&a, POSES);
    clear_problem(&q);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

/* ---- a pose does not depend on its neighbours, nor on units ---- */

static void test_threads_and_batches(void)
{
    vg_head h = make_torus(15, 11);
    vg_graph *g = graph_of(&h);
    problem q = make_problem(&h, g, NULL, 0, 0.02);
    answer one = solve(&q, 1, 1);
    for (int threads = 1; threads <= 3; threads++)
        for (size_t batch = 1; batch <= POSES; batch += 2) {
            answer a = solve(&q, threads, batch);
            bool same = true;
            for (size_t k = 0; k < POSES; k++) same &= !memcmp(a.x[k], one.x[k], 3 * g->faces.nv * sizeof(double));
            if (!same) printf("%d threads, %zu poses a call:\n", threads, batch);
            CHECK(same);
            CHECK(a.stats.most_steps == one.stats.most_steps);
            clear(&a, POSES);
        }
    CHECK(one.stats.most_steps >= 20 && one.stats.most_steps <= 60);
    clear(&one, POSES);
    clear_problem(&q);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

static void test_units(void)
{
    vg_head h = make_torus(9, 8);
    vg_graph *g = graph_of(&h);
    problem q = make_problem(&h, g, NULL, 0, 0.02);
    answer one = solve(&q, 1, POSES);
    double D = vg_diagonal(h.body.reference, g->faces.nv), before = 1;
    static const double units[] = {0x1p-300, 0x1p-60, 0x1p60, 0x1p300};
    for (size_t u = 0; u < sizeof units / sizeof *units; u++) {
        for (size_t k = 0; k < POSES; k++) {
            for (size_t c = 0; c < 3 * vg_graph_corners(g); c++) q.w[k][c] *= units[u] / before;
            for (size_t i = 0; i < 3; i++) q.at[k][i] *= units[u] / before;
        }
        before = units[u];
        answer a = solve(&q, 1, POSES);
        CHECK(a.good == POSES);
        for (size_t k = 0; k < POSES; k++) {
            for (size_t i = 0; i < 3 * g->faces.nv; i++) a.x[k][i] /= units[u];
            CHECK_NEAR(farthest(a.x[k], one.x[k], g->faces.nv), 0, 1e-12 * D);
        }
        clear(&a, POSES);
    }
    clear(&one, POSES);
    clear_problem(&q);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

/* ---- what cannot be done ---- */

static void test_degenerate(void)
{
    vg_head h = make_degenerate();
    vg_graph *g = graph_of(&h);
    problem q = make_problem(&h, g, NULL, 0, 0.02);
    memset(q.w[2], 0, 3 * vg_graph_corners(g) * sizeof(double)); /* every face a point */
    for (size_t c = 0; c < vg_graph_corners(g); c++) q.w[3][3 * c + 1] = q.w[3][3 * c + 2] = 0; /* on a line */
    for (size_t c = 0; c < vg_graph_corners(g); c++) { /* on a line that rounding does not quite meet */
        double t = noise();
        for (size_t k = 0; k < 3; k++) q.w[4][3 * c + k] = t * (const double[]){1, M_SQRT2, M_PI}[k];
    }
    answer a = solve(&q, 1, POSES);
    CHECK(a.good == POSES);
    for (size_t k = 0; k < POSES; k++) CHECK(vgi_finite(a.x[k], 3 * g->faces.nv));
    for (size_t k = 2; k < 5; k++) CHECK(!memcmp(a.x[k], a.plain[k], 3 * g->faces.nv * sizeof(double)));
    clear(&a, POSES);
    clear_problem(&q);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

static void test_not_converged(void)
{
    vg_head h = make_rod(60, 40, false);
    vg_graph *g = graph_of(&h);
    problem q = make_problem(&h, g, NULL, 0, 0.02);
    memset(q.w[0], 0, 3 * vg_graph_corners(g) * sizeof(double)); /* without normals: this one has nothing to do */
    q.fidelity = 1e-12, q.planarity = 1;
    q.n = 2;
    answer a = solve(&q, 1, 2);
    CHECK(a.good == 1 && a.stats.worst_residual > 1e-10 && a.stats.most_steps == 1000);
    clear(&a, 2);
    q.n = POSES;
    clear_problem(&q);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

static void test_weights_refused(void)
{
    vg_head h = make_torus(5, 5);
    vg_graph *g = graph_of(&h);
    vg_solver *s;
    vg_planar *p;
    vg_err e;
    static const double bad[][2] = {{0, 1}, {-1, 1}, {1, -1}, {NAN, 1}, {1, NAN}, {1, INFINITY}, {1e-300, 1e300}};
    CHECK(vg_solver_new(&s, g, NULL, 0, h.body.reference, VG_WEIGHTS_UNIFORM, 1, &e) == VG_OK);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        CHECK(vg_planar_new(&p, s, bad[i][0], bad[i][1], &e) == VG_EARG && !p);
    vg_solver_free(&s);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

TESTS({"the dense minimum", test_dense}, {"nothing to do: the plain solution, to the bit", test_nothing_to_do},
      {"what is planar stays", test_planar_stays},
      {"anchors are met to the bit, roots and isolated vertices stay", test_anchors_roots_isolated},
      {"all vertices anchored", test_everything_anchored},
      {"threads and batches change no bit", test_threads_and_batches}, {"units change nothing", test_units},
      {"faces without a normal", test_degenerate}, {"a pose that does not converge is named", test_not_converged},
      {"weights that are refused", test_weights_refused})
