/* test_reconstruct.c: vectors become the vertices they came from, on every kind of mesh, and vectors that fit no mesh
 * become the least-squares answer in either metric; anchors are met; threads and batches change nothing.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "dense.h"

static const double tight = 1e-12; /* of D: MATH 2 */
static const vg_weights all_weights[] = {VG_WEIGHTS_UNIFORM, VG_WEIGHTS_AREA};

typedef struct answer {
    int code;
    vg_err e;
    size_t n;
    double **x;
} answer;

static void clear(answer *a)
{
    for (size_t i = 0; i < a->n; i++) free(a->x[i]);
    free(a->x);
    *a = (answer){0};
}

/* n poses' vectors, with anchors or roots, solved in calls of `batch` poses. */
static answer solve(const vg_graph *g, const double *reference, const uint32_t *anchors, size_t nanchors, size_t n,
                    const double *const *vectors, const double *const *at, vg_weights weights, int threads,
                    size_t batch)
{
    answer a = {.n = n, .x = room(n, sizeof *a.x)};
    double **rhs = room(n, sizeof *rhs);
    vg_solver *s = NULL;
    for (size_t i = 0; i < n; i++) a.x[i] = room(3 * g->faces.nv, sizeof(double)), rhs[i] = room(3 * g->faces.nv, sizeof(double));
    a.code = vg_solver_new(&s, g, anchors, nanchors, reference, weights, threads, &a.e);
    for (size_t i = 0; a.code == VG_OK && i < n; i += batch) {
        size_t some = n - i < batch ? n - i : batch;
        vg_solver_load(s, some, vectors + i, nanchors ? at + i : NULL, a.x + i, rhs + i);
        vg_solver_solve(s, some, (const double *const *)rhs + i, a.x + i, nanchors ? at + i : NULL,
                        nanchors ? NULL : at + i);
    }
    vg_solver_free(&s);
    CHECK(s == NULL);
    for (size_t i = 0; i < n; i++) free(rhs[i]);
    free(rhs);
    return a;
}

/* One pose there and back, its root given; the error in units of the pose's D. Isolated vertices are expected where
 * the reference has them. */
static double there_and_back(vg_head *h, const double *pose, vg_weights weights)
{
    vg_graph *g = graph_of(h);
    double *w = vectors_of(g, pose), *want = room(3 * g->faces.nv, sizeof *want), root[3];
    const double *at = root;
    vg_graph_root(g, pose, root);
    for (size_t v = 0; v < g->faces.nv; v++)
        memcpy(want + 3 * v, (g->in_face[v] ? pose : h->body.reference) + 3 * v, 3 * sizeof *want);
    answer a = solve(g, h->body.reference, NULL, 0, 1, (const double *const *)&w, &at, weights, 1, 1);
    if (a.code < 0) printf("%s\n", a.e.message);
    double error = a.code < 0 ? INFINITY : farthest(a.x[0], want, g->faces.nv) / vg_diagonal(want, g->faces.nv);
    clear(&a);
    free(w);
    free(want);
    vg_graph_free(&g);
    return error;
}

static void select_faces(vg_head *h)
{
    vg_err e;
    free(h->selection.faces);
    CHECK(vg_select_faces(&h->body.mesh, &h->selection.faces, &h->selection.n, &e) == VG_OK);
    h->selection.chosen = true;
}

/* the reference and a strongly bent pose, through all faces and through the selected ones, with both weights */
static void gives_back(vg_head *h, const char *name)
{
    double *bent = warp(h->body.reference, h->body.mesh.nv, 1.5);
    for (int pass = 0; pass < 4; pass++) {
        vg_weights weights = all_weights[pass % 2];
        if (pass == 2) select_faces(h);
        double at_rest = there_and_back(h, h->body.reference, weights), moved = there_and_back(h, bent, weights);
        if (!(at_rest <= tight) || !(moved <= tight)) printf("%s, pass %d:\n", name, pass);
        CHECK_NEAR(at_rest, 0, tight);
        CHECK_NEAR(moved, 0, tight);
    }
    free(bent);
}

static void test_generated(void)
{
    vg_head h;
    const char *name;
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        gives_back(&h, name);
        vg_head_clear(&h);
    }
    h = make_degenerate();
    gives_back(&h, "degenerate");
    vg_head_clear(&h);
}

static void test_long_and_large(void)
{
    vg_head shapes[] = {make_chain(10000), make_rod(250, 200, false), make_rod(3000, 5, true),
                        make_ngon(10000, 0.4, 0.1)};
    const char *names[] = {"chain of 10000", "rod 250 x 200", "rod 3000 x 5", "face of 10000"};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        gives_back(&shapes[i], names[i]);
        vg_head_clear(&shapes[i]);
    }
}

static void test_units(void)
{
    static const double units[] = {1e-20, 1e-6, 1e6, 1e20};
    for (size_t u = 0; u < sizeof units / sizeof *units; u++) {
        vg_head shapes[] = {make_flower(15), make_mixed(6), make_pieces(), make_chain(50)};
        for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
            for (size_t k = 0; k < 3 * shapes[i].body.mesh.nv; k++) shapes[i].body.reference[k] *= units[u];
            gives_back(&shapes[i], "in another unit");
            vg_head_clear(&shapes[i]);
        }
    }
}

static void test_data(void)
{
    static const struct {
        const char *poses, *rest;
        size_t most;
    } all[] = {{"trex-walk.tar.xz", "trex.rest.obj", 34}, {"horse-run.tar.xz", "horse.rest.obj", 21},
               {"woman-tanktop-jump.tar.xz", "woman-tanktop.rest.obj", 6}, {"human-man-poses.tar.xz", NULL, 4},
               {"faceA.tar.xz", NULL, 4}};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        film f = load_film(all[i].poses, all[i].rest, all[i].most);
        for (int pass = 0; pass < 4; pass++) {
            double worst = 0;
            if (pass == 2) select_faces(&f.h);
            for (size_t k = (size_t)pass % 2; k < f.n; k += 2)
                worst = fmax(worst, there_and_back(&f.h, f.pose[k], all_weights[pass % 2]));
            if (!(worst <= tight)) printf("%s, pass %d:\n", all[i].poses, pass);
            CHECK_NEAR(worst, 0, tight);
        }
        CHECK(f.h.selection.n < f.h.body.mesh.nf && 2 * f.h.selection.n > f.h.body.mesh.nf);
        film_clear(&f);
    }
}

/* ---- vectors that fit no mesh, against a dense solution ---- */

/* The minimum of the energy by writing A' out as MATH 1 has it: row c is 1 at its own vertex and -1/r at all of its
 * face; between A and A' stands the metric of the face, if any. Anchored and isolated vertices get a row of their
 * own; without anchors the mean is put into the matrix. */
static double *least_squares(const vg_graph *g, const double *reference, const double *w, const uint32_t *anchors,
                             size_t nanchors, const double *at, vg_weights weights)
{
    size_t q = g->faces.nv;
    double *A = room(vg_graph_corners(g) * q, sizeof *A), *N = room(q * q, sizeof *N), *b = room(3 * q, sizeof *b);
    for (size_t f = 0; f < g->faces.nf; f++)
        for (uint32_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++) {
            A[c * q + g->faces.vert[c]] += 1;
            for (uint32_t d = g->faces.start[f]; d < g->faces.start[f + 1]; d++)
                A[c * q + g->faces.vert[d]] -= 1.0 / (g->faces.start[f + 1] - g->faces.start[f]);
        }
    double *rest = vectors_of(g, reference), *G = room(g->max_corners * g->max_corners, sizeof *G);
    for (size_t f = 0; f < g->faces.nf; f++) {
        size_t begin = g->faces.start[f], r = g->faces.start[f + 1] - begin;
        for (size_t k = 0; k < r * r; k++) G[k] = k % (r + 1) == 0;
        if (weights == VG_WEIGHTS_AREA && r > 2) face_metric(rest + 3 * begin, r, G);
        for (size_t k = 0; k < r * r * r; k++) { /* the row of a corner is 0 but at its own face's vertices */
            size_t c = begin + k / (r * r), d = begin + k / r % r, i = g->faces.vert[begin + k % r];
            double x = G[k / r] * A[c * q + i];
            for (size_t j = 0; j < r; j++) N[i * q + g->faces.vert[begin + j]] += x * A[d * q + g->faces.vert[begin + j]];
            for (size_t j = 0; j < 3; j++) b[3 * i + j] += x * w[3 * d + j];
        }
    }
    free(rest);
    free(G);
    for (size_t i = 0; i < q; i++)
        for (size_t j = 0; j < q && !nanchors; j++) {
            if (!g->in_face[i] || !g->in_face[j]) continue;
            N[i * q + j] += 1;
            for (size_t k = 0; k < 3; k++) b[3 * i + k] += at[k];
        }
    for (size_t i = 0; i < nanchors + q; i++) {
        size_t v = i < nanchors ? anchors[i] : i - nanchors;
        if (i >= nanchors && g->in_face[v]) continue;
        memset(N + v * q, 0, q * sizeof *N);
        N[v * q + v] = 1;
        memcpy(b + 3 * v, i < nanchors ? at + 3 * i : reference + 3 * v, 3 * sizeof *b);
    }
    eliminate(N, b, q, 3);
    free(A);
    free(N);
    return b;
}

static void against_dense(vg_head *h, const char *name, const uint32_t *anchors, size_t nanchors, vg_weights weights)
{
    vg_graph *g = graph_of(h);
    double D = vg_diagonal(h->body.reference, g->faces.nv), *w = vectors_of(g, h->body.reference);
    double at[64] = {0.3 * D, -0.2 * D, D};
    const double *where = at;
    for (size_t i = 0; i < 3 * nanchors; i++) at[i] = 0.4 * D * noise();
    /* no longer a mesh's, nor centred */
    for (size_t i = 0; i < 3 * vg_graph_corners(g); i++) w[i] += 0.2 * D * noise();
    double *want = least_squares(g, h->body.reference, w, anchors, nanchors, at, weights);
    answer a = solve(g, h->body.reference, anchors, nanchors, 1, (const double *const *)&w, &where, weights, 1, 1);
    CHECK(a.code == VG_OK);
    double error = farthest(a.x[0], want, g->faces.nv) / D;
    if (!(error <= 1e-10)) printf("%s with %zu anchors, weights %d:\n", name, nanchors, (int)weights);
    CHECK_NEAR(error, 0, 1e-10);
    clear(&a);
    free(want);
    free(w);
    vg_graph_free(&g);
}

static void test_least_squares(void)
{
    vg_head h;
    const char *name;
    static const uint32_t one[] = {1}, several[] = {0, 1, 2};
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        if (h.body.mesh.nv <= 200) {
            bool isolated = !strcmp(name, "mixed");
            for (int k = 0; k < 2; k++) {
                against_dense(&h, name, NULL, 0, all_weights[k]);
                against_dense(&h, name, one, 1, all_weights[k]);
                if (h.body.mesh.nv > 3 && !isolated) against_dense(&h, name, several, 3, all_weights[k]);
            }
            select_faces(&h);
            for (int k = 0; k < 2; k++) against_dense(&h, name, NULL, 0, all_weights[k]);
        }
        vg_head_clear(&h);
    }
    h = make_degenerate();
    against_dense(&h, "degenerate", NULL, 0, VG_WEIGHTS_UNIFORM);
    vg_head_clear(&h);
}

/* On large meshes: the gradient of the energy vanishes, A (A' V - W) = 0, and the mean is the root. */
static void test_normal_equations(void)
{
    film f = load_film("human-man-poses.tar.xz", NULL, 1);
    vg_head rod = make_rod(200, 60, true), *shapes[] = {&f.h, &rod};
    for (size_t i = 0; i < 2; i++) {
        if (i == 0) select_faces(shapes[i]);
        vg_graph *g = graph_of(shapes[i]);
        double D = vg_diagonal(shapes[i]->body.reference, g->faces.nv), *w = vectors_of(g, shapes[i]->body.reference);
        double root[3] = {D, 2 * D, -D}, mean[3], *left = room(3 * g->faces.nv, sizeof *left);
        const double *at = root;
        for (size_t c = 0; c < 3 * vg_graph_corners(g); c++) w[c] *= 1 + 0.3 * noise();
        answer a =
            solve(g, shapes[i]->body.reference, NULL, 0, 1, (const double *const *)&w, &at, VG_WEIGHTS_UNIFORM, 2, 1);
        CHECK(a.code == VG_OK);
        double *x = vectors_of(g, a.x[0]), most = 0;
        for (size_t face = 0; face < g->faces.nf; face++) {
            double off[3] = {0, 0, 0}, r = g->faces.start[face + 1] - g->faces.start[face];
            for (size_t c = g->faces.start[face]; c < g->faces.start[face + 1]; c++)
                for (size_t k = 0; k < 3; k++) off[k] += (x[3 * c + k] - w[3 * c + k]) / r;
            for (size_t c = g->faces.start[face]; c < g->faces.start[face + 1]; c++)
                for (size_t k = 0; k < 3; k++) left[3 * g->faces.vert[c] + k] += x[3 * c + k] - w[3 * c + k] - off[k];
        }
        for (size_t k = 0; k < 3 * g->faces.nv; k++) most = fmax(most, fabs(left[k]));
        CHECK_NEAR(most, 0, 1e-13 * D);
        vg_graph_root(g, a.x[0], mean);
        for (int k = 0; k < 3; k++) CHECK_NEAR(mean[k], root[k], 1e-12 * D);
        clear(&a);
        free(x);
        free(w);
        free(left);
        vg_graph_free(&g);
    }
    film_clear(&f);
    vg_head_clear(&rod);
}

/* ---- anchors ---- */

/* `count` anchors spread over the attached vertices, ascending */
static size_t spread_anchors(const vg_graph *g, size_t count, uint32_t *anchors)
{
    size_t n = 0, seen = 0;
    for (size_t v = 0; v < g->faces.nv; v++)
        if (g->in_face[v] && seen++ * count / g->attached >= n && n < count) anchors[n++] = (uint32_t)v;
    return n;
}

static void test_anchors(void)
{
    enum { POSES = 11 };
    vg_head h;
    const char *name;
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        vg_graph *g = graph_of(&h);
        for (size_t count = 1; count <= 7 && count <= g->attached; count += 3) {
            uint32_t anchors[8];
            double *pose[POSES], *w[POSES], *at[POSES], worst = 0;
            CHECK(spread_anchors(g, count, anchors) == count);
            for (size_t k = 0; k < POSES; k++) {
                pose[k] = warp(h.body.reference, g->faces.nv, 0.2 * (double)k);
                /* each pose has its anchors elsewhere */
                for (size_t v = 0; v < 3 * g->faces.nv; v++) pose[k][v] += (double)k;
                w[k] = vectors_of(g, pose[k]), at[k] = room(3 * count, sizeof(double));
                vg_graph_anchors(pose[k], anchors, count, at[k]);
            }
            answer a = solve(g, h.body.reference, anchors, count, POSES, (const double *const *)w,
                             (const double *const *)at, all_weights[count % 2], 2, POSES);
            CHECK(a.code == VG_OK);
            for (size_t k = 0; k < POSES; k++) {
                bool met = true, kept = true;
                for (size_t j = 0; j < count; j++)
                    met &= !memcmp(a.x[k] + 3 * (size_t)anchors[j], at[k] + 3 * j, 3 * sizeof(double));
                for (size_t v = 0; v < g->faces.nv; v++) {
                    if (g->in_face[v]) continue;
                    kept &= !memcmp(a.x[k] + 3 * v, h.body.reference + 3 * v, 3 * sizeof(double));
                    memcpy(a.x[k] + 3 * v, pose[k] + 3 * v, 3 * sizeof(double));
                }
                CHECK(met);
                CHECK(kept);
                worst = fmax(worst, farthest(a.x[k], pose[k], g->faces.nv) / vg_diagonal(pose[k], g->faces.nv));
                free(pose[k]), free(w[k]), free(at[k]);
            }
            /* positions of the size of 10 + D are given in 53 bits: that much of D cannot be had back */
            double D = vg_diagonal(h.body.reference, g->faces.nv), lost = 2e-15 * (10 + D) / D;
            if (!(worst <= tight + lost)) printf("%s, %zu anchors:\n", name, count);
            CHECK_NEAR(worst, 0, tight + lost);
            clear(&a);
        }
        vg_graph_free(&g);
        vg_head_clear(&h);
    }
}

/* The poses of vectors that nothing fits, each by a solver that is like `base`, beside those of a new one: farthest in D.
 * Solver i has the first count[i] of the anchors. */
static double apart_from_new(const vg_graph *g, vg_solver *base, const double *reference, const uint32_t *anchors,
                             size_t n, const size_t *count, vg_weights weights)
{
    enum { MOST = 4 };
    vg_solver *s[MOST + 1];
    vg_err e;
    double *w = vectors_of(g, reference), *at = room(3 * g->faces.nv, sizeof *at), root[3] = {1, 2, 3}, worst = 0;
    double *x[MOST + 1], *rhs[MOST + 1];
    const double *given[MOST + 1], *held[MOST + 1], *roots[MOST + 1];
    const uint32_t *lists[MOST];
    for (size_t c = 0; c < 3 * vg_graph_corners(g); c++) w[c] *= 1 + 0.2 * noise();
    for (size_t i = 0; i <= n; i++) {
        x[i] = room(3 * g->faces.nv, sizeof **x), rhs[i] = room(3 * g->faces.nv, sizeof **rhs);
        given[i] = w, held[i] = at, roots[i] = root;
    }
    for (size_t i = 0; i < n; i++) lists[i] = anchors;
    vg_graph_anchors(reference, anchors, count[n - 1], at);
    CHECK(vg_solver_new_like(s, n, base, lists, count, &e) == VG_OK);
    s[n] = base;
    vg_solver_load_each(n + 1, s, given, held, x, rhs);
    vg_solver_solve_each(n + 1, s, (const double *const *)rhs, x, held, roots);
    for (size_t i = 0; i < n; i++) {
        const double *where = count[i] ? at : root;
        answer fresh = solve(g, reference, anchors, count[i], 1, given, &where, weights, 1, 1);
        CHECK(fresh.code == VG_OK);
        worst = fmax(worst, farthest(x[i], fresh.x[0], g->faces.nv) / vg_diagonal(reference, g->faces.nv));
        vg_solver_load(s[i], 1, given, held, x, rhs);
        vg_solver_solve(s[i], 1, (const double *const *)rhs, x, held, roots);
        worst = fmax(worst, farthest(x[0], fresh.x[0], g->faces.nv) / vg_diagonal(reference, g->faces.nv));
        clear(&fresh);
        vg_solver_free(&s[i]);
    }
    for (size_t i = 0; i <= n; i++) free(x[i]), free(rhs[i]);
    free(w), free(at);
    return worst;
}

/* A solver that is like another one gives the answer of a new one, whatever it holds besides. */
static void test_like(void)
{
    vg_head h;
    const char *name;
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        vg_graph *g = graph_of(&h);
        size_t most = g->attached < 40 ? g->attached : 40;
        uint32_t *anchors = room(most, sizeof *anchors);
        CHECK(spread_anchors(g, most, anchors) == most);
        for (size_t held = 0; held <= 5 && held <= most; held += 5) {
            size_t count[4] = {held, held < most ? held + 1 : most, most / 2 > held ? most / 2 : most, most};
            vg_solver *base;
            vg_err e;
            vg_weights weights = all_weights[(held + i) % 2];
            CHECK(vg_solver_new(&base, g, anchors, held, h.body.reference, weights, 2, &e) == VG_OK);
            double apart = apart_from_new(g, base, h.body.reference, anchors, 4, count, weights);
            if (!(apart <= tight)) printf("%s, like one with %zu anchors:\n", name, held);
            CHECK_NEAR(apart, 0, tight);
            vg_solver_free(&base);
        }
        free(anchors);
        vg_graph_free(&g);
        vg_head_clear(&h);
    }
}

/* What the other solver holds has to be held, and a vertex without faces cannot be; on failure no solver is made. */
static void test_unlike(void)
{
    vg_head h = make_flower(14);
    vg_graph *g = graph_of(&h);
    uint32_t base_anchors[2] = {1, 3}, good[3] = {1, 2, 3}, bad[2] = {1, 2};
    const uint32_t *lists[2] = {good, bad};
    size_t counts[2] = {3, 2};
    vg_solver *base, *s[2];
    vg_err e;
    CHECK(vg_solver_new(&base, g, base_anchors, 2, h.body.reference, VG_WEIGHTS_AREA, 2, &e) == VG_OK);
    CHECK(vg_solver_new_like(s, 2, base, lists, counts, &e) == VG_EARG && !s[0] && !s[1]);
    CHECK(strstr(e.message, "vertex 3") != NULL);
    CHECK(vg_solver_new_like(s, 1, base, lists, counts, &e) == VG_OK);
    CHECK(vg_solver_new_like(s + 1, 1, s[0], lists, counts, &e) == VG_EARG);
    vg_solver_free(&s[0]);
    vg_solver_free(&base);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

/* Anchors that contradict the vectors are met to the bit, and everything may be anchored. */
static void test_contradicting_anchors(void)
{
    vg_head h = make_flower(14);
    vg_graph *g = graph_of(&h);
    double *w = vectors_of(g, h.body.reference), *at = room(3 * g->faces.nv, sizeof *at);
    uint32_t *all = room(g->faces.nv, sizeof *all);
    const double *where = at;
    for (size_t v = 0; v < g->faces.nv; v++) all[v] = (uint32_t)v;
    for (size_t i = 0; i < 3 * g->faces.nv; i++) at[i] = 1e3 * noise() / 3;
    for (size_t n = 1; n <= g->faces.nv; n += 9) {
        answer a = solve(g, h.body.reference, all, n, 1, (const double *const *)&w, &where, all_weights[n % 2], 1, 1);
        CHECK(a.code == VG_OK && !memcmp(a.x[0], at, 3 * n * sizeof *at));
        clear(&a);
    }
    free(w);
    free(at);
    free(all);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

/* ---- threads and batches ---- */

static void test_threads_and_batches(void)
{
    enum { POSES = 17 };
    film f = load_film("woman-tanktop-jump.tar.xz", "woman-tanktop.rest.obj", POSES);
    vg_head flower = make_flower(40), *shapes[] = {&f.h, &flower};
    CHECK(f.n == POSES);
    for (size_t i = 0; i < 2; i++) {
        vg_weights weights = all_weights[i];
        vg_graph *g = graph_of(shapes[i]);
        double *w[POSES], roots[POSES][3];
        const double *at[POSES];
        for (size_t k = 0; k < POSES; k++) {
            w[k] = vectors_of(g, i == 0 ? f.pose[k] : flower.body.reference);
            for (size_t c = 0; c < 3 * vg_graph_corners(g); c++) w[k][c] *= 1 + 0.2 * noise();
            for (int j = 0; j < 3; j++) roots[k][j] = noise();
            at[k] = roots[k];
        }
        answer one = solve(g, shapes[i]->body.reference, NULL, 0, POSES, (const double *const *)w, at, weights, 1, 1);
        CHECK(one.code == VG_OK);
        for (int threads = 1; threads <= 3; threads++)
            for (size_t batch = 1; batch <= POSES; batch += batch < 9 || i == 1 ? 1 : 4) {
                answer a = solve(g, shapes[i]->body.reference, NULL, 0, POSES, (const double *const *)w, at, weights,
                                 threads, batch);
                bool same = a.code == VG_OK;
                for (size_t k = 0; same && k < POSES; k++)
                    same = !memcmp(a.x[k], one.x[k], 3 * g->faces.nv * sizeof(double));
                if (!same) printf("%d threads, %zu poses a call:\n", threads, batch);
                CHECK(same);
                clear(&a);
            }
        clear(&one);
        for (size_t k = 0; k < POSES; k++) free(w[k]);
        vg_graph_free(&g);
    }
    film_clear(&f);
    vg_head_clear(&flower);
}

static void test_batch_size_and_stats(void)
{
    vg_head h = make_torus(20, 15);
    vg_graph *g = graph_of(&h);
    vg_solver *s;
    vg_err e;
    for (int threads = 1; threads <= 3; threads++) {
        if (vg_solver_new(&s, g, NULL, 0, h.body.reference, VG_WEIGHTS_UNIFORM, threads, &e) < 0) abort();
        CHECK(vg_solver_batch(s) >= 8 && vg_solver_batch(s) % (size_t)threads == 0);
        vg_solver_stats stats = vg_solver_get_stats(s);
        CHECK(stats.unknowns == 299); /* one vertex is held */
        CHECK(stats.factor_entries >= 299 && stats.analyse_seconds >= 0 && stats.factor_seconds >= 0);
        vg_solver_free(&s);
    }
    vg_graph_free(&g);
    vg_head_clear(&h);
}

/* ---- what there is nothing to solve for, and what is refused ---- */

static void test_without_faces(void)
{
    vg_head h = new_shape();
    vg_err e;
    for (int points = 0; points < 2; points++) {
        if (points) add_isolated(&h);
        vg_graph *g;
        CHECK(vg_head_prepare_vectors(&h, &e) == VG_OK && vg_head_graph(&g, &h, &e) == VG_OK);
        double none = 0, root[3] = {1, 2, 3};
        const double *w = &none, *at = root;
        answer a = solve(g, h.body.reference, NULL, 0, 1, &w, &at, all_weights[points], 1, 1);
        CHECK(a.code == VG_OK && !memcmp(a.x[0], h.body.reference, 3 * h.body.mesh.nv * sizeof(double)));
        clear(&a);
        vg_graph_free(&g);
    }
    vg_head_clear(&h);
}

static void test_refused(void)
{
    vg_head h = make_pieces();
    uint32_t lone = add_vertex(&h, 0, 0, 0);
    vg_graph *g;
    vg_solver *s;
    vg_err e;
    h.links.chosen = true; /* and none are there */
    CHECK(vg_head_graph(&g, &h, &e) == VG_OK);
    CHECK(vg_solver_new(&s, g, NULL, 0, h.body.reference, VG_WEIGHTS_UNIFORM, 1, &e) == VG_EINPUT && !s);
    CHECK(strstr(e.message, "link is missing") != NULL);
    uint32_t anchors[] = {0, 1};
    CHECK(vg_solver_new(&s, g, anchors, 2, h.body.reference, VG_WEIGHTS_UNIFORM, 1, &e) == VG_EINPUT && !s);
    vg_graph_free(&g);
    h.links.chosen = false;
    g = graph_of(&h);
    CHECK(vg_solver_new(&s, g, &lone, 1, h.body.reference, VG_WEIGHTS_AREA, 1, &e) == VG_EINPUT && !s);
    CHECK(strstr(e.message, "in no face") != NULL);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

TESTS({"every generated mesh comes back", test_generated}, {"long and large meshes come back", test_long_and_large},
      {"in tiny and huge units", test_units}, {"the data come back, from all and from selected faces", test_data},
      {"inconsistent vectors: the dense least-squares answer", test_least_squares},
      {"inconsistent vectors: the gradient vanishes on large meshes", test_normal_equations},
      {"anchors are met to the bit, isolated vertices stay", test_anchors},
      {"anchors that contradict the vectors", test_contradicting_anchors},
      {"a solver like another has answers of its own", test_like},
      {"what a solver cannot be like", test_unlike},
      {"threads and batches change no bit", test_threads_and_batches},
      {"batch size and stats", test_batch_size_and_stats}, {"meshes without faces", test_without_faces},
      {"what is refused", test_refused})
