/* test_robust.c: the search for the least absolute misfit ends where the energy, written down from its definition and
 * minimised by reweighted dense solutions, is as low; a few wrong faces do not move the rest; anchors, roots and
 * consistent vectors are met; no pose depends on those beside it, on threads or on units.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "dense.h"

enum { POSES = 11 };

typedef struct problem {
    const vg_graph *g;
    const double *reference;
    const uint32_t *anchors;
    size_t nanchors, rounds;
    double *w[POSES], *at[POSES]; /* vectors; anchors, or the root */
    double eps;
    vg_weights weights;
} problem;

typedef struct answer {
    double *plain[POSES], *x[POSES];
    vg_robust_stats stats;
} answer;

static void clear(answer *a)
{
    for (size_t i = 0; i < POSES; i++) free(a->plain[i]), free(a->x[i]);
}

static answer solve(const problem *q, int threads, size_t batch)
{
    answer a = {0};
    vg_solver *s;
    vg_robust *r;
    vg_err e = {0, ""};
    double *rhs[POSES], sizes[POSES];
    float *misfits[POSES];
    if (vg_solver_new(&s, q->g, q->anchors, q->nanchors, q->reference, q->weights, threads, &e) < 0 ||
        vg_robust_new(&r, s, q->rounds, q->eps, &e) < 0) {
        printf("%s\n", e.message);
        exit(1);
    }
    for (size_t i = 0; i < POSES; i++) {
        a.x[i] = room(3 * q->g->faces.nv, sizeof(double)), a.plain[i] = room(3 * q->g->faces.nv, sizeof(double));
        rhs[i] = room(3 * q->g->faces.nv, sizeof(double)), misfits[i] = room(vg_robust_misfits(r), sizeof(float));
    }
    const double *const *at = (const double *const *)q->at, *const *b = (const double *const *)rhs;
    const double *const *anchors = q->nanchors ? at : NULL, *const *roots = q->nanchors ? NULL : at;
    vg_solver_load(s, POSES, (const double *const *)q->w, anchors, a.x, rhs);
    vg_robust_load(r, POSES, (const double *const *)q->w, (const double *const *)a.x, misfits, sizes);
    for (size_t i = 0; i < POSES; i++) memcpy(a.plain[i], a.x[i], 3 * q->g->faces.nv * sizeof(double));
    vg_solver_solve(s, POSES, b, a.plain, anchors, roots);
    for (size_t i = 0; i < POSES; i += batch) {
        size_t some = POSES - i < batch ? POSES - i : batch;
        if (vg_robust_solve(r, some, NULL, b + i, (const float *const *)misfits + i, sizes + i, a.x + i,
                            anchors ? anchors + i : NULL, roots ? roots + i : NULL, &e) < 0) {
            printf("%s\n", e.message);
            exit(1);
        }
    }
    a.stats = vg_robust_get_stats(r);
    for (size_t i = 0; i < POSES; i++) free(rhs[i]), free(misfits[i]);
    vg_robust_free(&r);
    vg_solver_free(&s);
    CHECK(r == NULL);
    return a;
}

/* Poses of h, warped more and more, their vectors disturbed; anchors or roots elsewhere in each. */
static problem make_problem(const vg_head *h, const vg_graph *g, const uint32_t *anchors, size_t nanchors,
                            double disturb)
{
    problem q = {.g = g, .reference = h->body.reference, .anchors = anchors, .nanchors = nanchors, .rounds = 200,
                 .eps = 0.3};
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
    for (size_t k = 0; k < POSES; k++) free(q->w[k]), free(q->at[k]);
}

/* ---- the energy by its definition ---- */

static double *face_matrix(const problem *q, const double *rest, size_t f)
{
    size_t begin = q->g->faces.start[f], r = q->g->faces.start[f + 1] - begin;
    double *G = room(r * r, sizeof *G);
    for (size_t i = 0; i < r * r; i++) G[i] = (i % (r + 1) == 0) - 1.0 / (double)r;
    if (q->weights == VG_WEIGHTS_AREA && r > 2) face_metric(rest + 3 * begin, r, G);
    return G;
}

/* The misfit of every face in pose x. */
static void misfits_of(const problem *q, size_t k, const double *rest, const double *x, double *e)
{
    const vg_graph *g = q->g;
    double *v = vectors_of(g, x);
    for (size_t f = 0; f < g->faces.nf; f++) {
        size_t begin = g->faces.start[f], r = g->faces.start[f + 1] - begin;
        double *G = face_matrix(q, rest, f), sum = 0;
        for (size_t a = 0; a < r; a++)
            for (size_t b = 0; b < r; b++)
                for (size_t i = 0; i < 3; i++)
                    sum += G[a * r + b] * (v[3 * (begin + a) + i] - q->w[k][3 * (begin + a) + i]) *
                           (v[3 * (begin + b) + i] - q->w[k][3 * (begin + b) + i]);
        e[f] = sqrt(fmax(sum, 0));
        free(G);
    }
    free(v);
}

static double total(const double *e, size_t n, double c)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += hypot(e[i], c);
    return sum;
}

/* One step of reweighting: the pose of least squares with weight 1 / hypot(e, c) for each face; no anchors: vertex 0
 * is at 0. */
static double *reweighted(const problem *q, size_t k, const double *rest, const double *e, double c)
{
    const vg_graph *g = q->g;
    size_t n = g->faces.nv;
    double *M = room(n * n, sizeof *M), *b = room(3 * n, sizeof *b);
    for (size_t f = 0; f < g->faces.nf; f++) {
        size_t begin = g->faces.start[f], r = g->faces.start[f + 1] - begin;
        double *G = face_matrix(q, rest, f), weight = 1 / hypot(e[f], c);
        for (size_t p = 0; p < r; p++)
            for (size_t s = 0; s < r; s++) {
                M[g->faces.vert[begin + p] * n + g->faces.vert[begin + s]] += weight * G[p * r + s];
                for (size_t i = 0; i < 3; i++)
                    b[3 * g->faces.vert[begin + p] + i] += weight * G[p * r + s] * q->w[k][3 * (begin + s) + i];
            }
        free(G);
    }
    for (size_t v = 0, a = 0; v < n; v++) {
        bool anchor = a < q->nanchors && q->anchors[a] == v;
        if (!g->in_face[v] || anchor || (!q->nanchors && v == 0)) {
            memset(M + v * n, 0, n * sizeof *M);
            M[v * n + v] = 1;
            for (size_t i = 0; i < 3; i++) b[3 * v + i] = anchor ? q->at[k][3 * a + i] : 0;
        }
        a += anchor;
    }
    eliminate(M, b, n, 3);
    free(M);
    return b;
}

static double least_energy(const problem *q, size_t k, const double *rest, const double *plain, double c)
{
    double *e = room(q->g->faces.nf, sizeof *e);
    misfits_of(q, k, rest, plain, e);
    for (int i = 0; i < 60; i++) {
        double *x = reweighted(q, k, rest, e, c);
        misfits_of(q, k, rest, x, e);
        free(x);
    }
    double least = total(e, q->g->faces.nf, c);
    free(e);
    return least;
}

/* Rounds end when they gain less than 0.1 %; what is left then is 1 % of the whole way at most, as measured. */
static void against_dense(vg_head *h, const char *name, vg_weights weights, size_t nanchors)
{
    static const uint32_t list[] = {1, 2, 5};
    vg_graph *g = graph_of(h);
    problem q = make_problem(h, g, list, nanchors, 0.02);
    q.weights = weights;
    answer a = solve(&q, 2, POSES);
    CHECK(a.stats.unfinished == 0 && a.stats.most_rounds > 1);
    double *rest = vectors_of(g, q.reference), *e = room(g->faces.nf, sizeof *e), worst = 0;
    for (size_t k = 0; k < POSES; k += 5) {
        misfits_of(&q, k, rest, a.plain[k], e);
        double c = q.eps * total(e, g->faces.nf, 0) / (double)g->faces.nf, before = total(e, g->faces.nf, c);
        double least = least_energy(&q, k, rest, a.plain[k], c);
        misfits_of(&q, k, rest, a.x[k], e);
        double after = total(e, g->faces.nf, c);
        CHECK(after >= least * (1 - 1e-6));
        worst = fmax(worst, (after - least) / least);
        CHECK(before > least);
    }
    if (!(worst <= 2e-3)) printf("%s, %zu anchors, weights %d: %g\n", name, nanchors, (int)weights, worst);
    CHECK_NEAR(worst, 0, 2e-3);
    clear(&a);
    free(e);
    free(rest);
    clear_problem(&q);
    vg_graph_free(&g);
}

static void test_dense(void)
{
    vg_head shapes[] = {make_torus(10, 7), make_rod(6, 6, false), make_rod(7, 5, true), make_mixed(5),
                        make_flower(14), make_pieces()};
    const char *names[] = {"torus", "rod", "triangles", "mixed", "flower of 14", "pieces"};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        against_dense(&shapes[i], names[i], VG_WEIGHTS_UNIFORM, 0);
        if (i < 3) against_dense(&shapes[i], names[i], VG_WEIGHTS_AREA, 0);
        if (i < 3) against_dense(&shapes[i], names[i], VG_WEIGHTS_AREA, 3);
        vg_head_clear(&shapes[i]);
    }
}

/* ---- what it is for ---- */

/* One face in forty wants something else: it moves all others, which fit together, at least four times less than by least
 * squares. (Were the minimum found to the last digit, it would not move them at all; rounds end before.) */
static void test_wrong_faces(void)
{
    vg_head h = make_torus(24, 15);
    vg_graph *g = graph_of(&h);
    problem q = make_problem(&h, g, NULL, 0, 0);
    double D = vg_diagonal(q.reference, g->faces.nv);
    q.eps = 1e-3;
    for (size_t k = 0; k < POSES; k++) {
        vg_graph_root(g, q.reference, q.at[k]);
        for (size_t f = k; f < g->faces.nf; f += 40)
            for (uint32_t i = 3 * g->faces.start[f]; i < 3 * g->faces.start[f + 1]; i++) q.w[k][i] += 0.1 * D * noise();
    }
    answer a = solve(&q, 1, POSES);
    for (size_t k = 0; k < POSES; k++) {
        double *pose = warp(q.reference, g->faces.nv, 0.15 * (double)k), root[3], moved[2] = {0, 0};
        vg_graph_root(g, pose, root);
        for (size_t v = 0; v < g->faces.nv; v++)
            for (size_t i = 0; i < 3; i++) {
                double at = pose[3 * v + i] - root[i] + q.at[k][i];
                moved[0] += fabs(a.plain[k][3 * v + i] - at), moved[1] += fabs(a.x[k][3 * v + i] - at);
            }
        CHECK(moved[1] < 0.25 * moved[0]);
        free(pose);
    }
    clear(&a);
    clear_problem(&q);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

static void test_consistent(void)
{
    vg_head h;
    const char *name;
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        vg_graph *g = graph_of(&h);
        problem q = make_problem(&h, g, NULL, 0, 0);
        q.weights = i % 2 ? VG_WEIGHTS_AREA : VG_WEIGHTS_UNIFORM;
        answer a = solve(&q, 1, POSES);
        CHECK(a.stats.most_rounds == 0);
        for (size_t k = 0; k < POSES; k++) CHECK(!memcmp(a.x[k], a.plain[k], 3 * g->faces.nv * sizeof(double)));
        clear(&a);
        clear_problem(&q);
        vg_graph_free(&g);
        vg_head_clear(&h);
    }
}

/* ---- what must stay ---- */

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
        clear(&a);
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
    CHECK(a.stats.unfinished == 0);
    for (size_t k = 0; k < POSES; k++) CHECK(!memcmp(a.x[k], q.at[k], 18 * sizeof(double)));
    clear(&a);
    clear_problem(&q);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

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
            CHECK(a.stats.most_rounds == one.stats.most_rounds);
            clear(&a);
        }
    clear(&one);
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
    double before = 1;
    static const double units[] = {0x1p-300, 0x1p-60, 0x1p60, 0x1p300};
    for (size_t u = 0; u < sizeof units / sizeof *units; u++) {
        for (size_t k = 0; k < POSES; k++) {
            for (size_t c = 0; c < 3 * vg_graph_corners(g); c++) q.w[k][c] *= units[u] / before;
            for (int i = 0; i < 3; i++) q.at[k][i] *= units[u] / before;
        }
        before = units[u];
        answer a = solve(&q, 1, POSES);
        for (size_t k = 0; k < POSES; k++)
            for (size_t i = 0; i < 3 * g->faces.nv; i++) CHECK(a.x[k][i] == units[u] * one.x[k][i]);
        clear(&a);
    }
    clear(&one);
    clear_problem(&q);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

static void test_rounds_and_arguments(void)
{
    vg_head h = make_torus(15, 11);
    vg_graph *g = graph_of(&h);
    problem q = make_problem(&h, g, NULL, 0, 0.02);
    q.rounds = 1;
    answer a = solve(&q, 2, POSES);
    CHECK(a.stats.unfinished == POSES && a.stats.most_rounds == 1);
    clear(&a);
    vg_solver *s;
    vg_robust *r;
    vg_err e;
    CHECK(vg_solver_new(&s, g, NULL, 0, q.reference, VG_WEIGHTS_AREA, 1, &e) == VG_OK);
    CHECK(vg_robust_new(&r, s, 8, 0, &e) == VG_EARG && r == NULL);
    CHECK(vg_robust_new(&r, s, 8, INFINITY, &e) == VG_EARG && r == NULL);
    vg_solver_free(&s);
    clear_problem(&q);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

TESTS({"the least energy of dense reweighting", test_dense}, {"wrong faces leave the others alone", test_wrong_faces},
      {"consistent vectors: the plain solution, to the bit", test_consistent},
      {"anchors are met to the bit, roots and isolated vertices stay", test_anchors_roots_isolated},
      {"all vertices anchored", test_everything_anchored},
      {"threads and batches change no bit", test_threads_and_batches}, {"units change no bit", test_units},
      {"too few rounds are told; what is refused", test_rounds_and_arguments})
