/* Paths through poses (MATH 7): ends exact, rigid turns rigid, limbs keep their volume, bars unwind evenly beyond
 * a whole turn, smooth paths without jumps of velocity.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "meshes.h"
#include "method/vectors/unwrap.h"

#define DEGREES (M_PI / 180)

/* ---- a path and the way back to vertices ---- */

typedef struct trial {
    vg_head h;
    vg_graph *g;
    size_t corners;
    vg_key keys[16];
    size_t n;
    double *anchors[16];
    vg_solver *solver;
    vg_path *path;
    double *w, *rhs, D;
} trial;

static void trial_begin(trial *t, vg_head *h)
{
    *t = (trial){.h = *h};
    t->g = graph_of(&t->h);
    t->corners = vg_graph_corners(t->g);
    t->D = vg_diagonal(h->body.reference, h->body.mesh.nv);
    t->w = room(3 * t->corners, sizeof(double));
    t->rhs = room(3 * h->body.mesh.nv, sizeof(double));
}

/* takes the pose over */
static void trial_key(trial *t, double *pose)
{
    vg_key *k = &t->keys[t->n];
    k->values = pose, k->place = (double)t->n;
    vg_graph_root(t->g, pose, k->root);
    t->anchors[t->n] = room(3 * t->h.nanchors, sizeof(double));
    vg_graph_anchors(pose, t->h.anchors, t->h.nanchors, t->anchors[t->n]);
    k->anchors = t->anchors[t->n++];
}

static void trial_open(trial *t, bool smooth, int threads)
{
    vg_err e = {0, ""};
    const vg_path_options o = {.kind = VG_VERTICES, .nanchors = t->h.nanchors, .smooth = smooth, .threads = threads};
    if (vg_path_new(&t->path, t->g, t->h.body.reference, t->keys, t->n, &o, &e) < 0 ||
        vg_solver_new(&t->solver, t->g, t->h.anchors, t->h.nanchors, t->h.body.reference, VG_WEIGHTS_UNIFORM, 1, &e) <
            0)
        printf("%s\n", e.message), exit(1);
}

/* the vertices of vectors */
static double *solve(trial *t, const double *w, const double *root, const double *anchors)
{
    double *x = room(3 * t->h.body.mesh.nv, sizeof *x);
    const double *rhs = t->rhs;
    vg_solver_load(t->solver, 1, &w, &anchors, &x, &t->rhs);
    vg_solver_solve(t->solver, 1, &rhs, &x, &anchors, &root);
    return x;
}

static double *at(trial *t, double u)
{
    vg_err e = {0, ""};
    double root[3], *anchors = room(3 * t->h.nanchors, sizeof *anchors);
    if (vg_path_at(t->path, u, t->w, root, anchors, &e) < 0) printf("%s\n", e.message), exit(1);
    double *x = solve(t, t->w, root, anchors);
    free(anchors);
    return x;
}

static void trial_end(trial *t)
{
    for (size_t i = 0; i < t->n; i++) free((double *)(uintptr_t)t->keys[i].values), free(t->anchors[i]);
    vg_path_free(&t->path);
    vg_solver_free(&t->solver);
    vg_graph_free(&t->g);
    vg_head_clear(&t->h);
    free(t->w);
    free(t->rhs);
}

/* the pose at u of the plain logarithm of each corner, first key to second: what a simple tool does */
static double *plain_at(trial *t, double u)
{
    vg_deformer *d = NULL;
    vg_err e = {0, ""};
    double *q = room(4 * t->corners, sizeof *q), root[3];
    const double *pose = t->keys[1].values;
    if (vg_deformer_new(&d, t->g, t->keys[0].values, 1, &e) < 0) exit(1);
    vg_deformer_measure(d, 1, VG_VERTICES, &pose, &q);
    vg_graph_vectors(t->g, t->keys[0].values, t->w);
    for (size_t c = 0; c < t->corners; c++) {
        double l[4], r[3];
        if (q[4 * c] < 0)
            for (size_t k = 0; k < 4; k++) q[4 * c + k] = -q[4 * c + k];
        vg_quat_log(q + 4 * c, l);
        for (int k = 0; k < 4; k++) l[k] *= u;
        vg_quat_exp(l, l);
        vg_quat_apply(l, t->w + 3 * c, r);
        memcpy(t->w + 3 * c, r, sizeof r);
    }
    for (int k = 0; k < 3; k++) root[k] = (1 - u) * t->keys[0].root[k] + u * t->keys[1].root[k];
    vg_deformer_free(&d);
    free(q);
    return solve(t, t->w, root, NULL);
}

static double *linear_at(const trial *t, double u)
{
    double *x = room(3 * t->h.body.mesh.nv, sizeof *x);
    for (size_t i = 0; i < 3 * t->h.body.mesh.nv; i++)
        x[i] = (1 - u) * t->keys[0].values[i] + u * t->keys[1].values[i];
    return x;
}

static double *copy_points(const double *x, size_t n)
{
    double *y = room(3 * n, sizeof *y);
    memcpy(y, x, 3 * n * sizeof *y);
    return y;
}

/* ---- poses of rods along z ---- */

static double top_of(const vg_head *h)
{
    double top = 0;
    for (size_t v = 0; v < h->body.mesh.nv; v++) top = fmax(top, h->body.reference[3 * v + 2]);
    return top;
}

static double *twisted(const vg_head *h, double angle)
{
    double *y = room(3 * h->body.mesh.nv, sizeof *y), top = top_of(h);
    for (size_t v = 0; v < h->body.mesh.nv; v++) {
        const double *x = h->body.reference + 3 * v;
        double a = angle * x[2] / top, c = cos(a), s = sin(a);
        y[3 * v] = c * x[0] - s * x[1], y[3 * v + 1] = s * x[0] + c * x[1], y[3 * v + 2] = x[2];
    }
    return y;
}

/* The middle third bends about y, the rest stays straight. */
static double *bent(const vg_head *h, double angle)
{
    double *y = room(3 * h->body.mesh.nv, sizeof *y), top = top_of(h), arc = top / 3;
    for (size_t v = 0; v < h->body.mesh.nv; v++) {
        const double *x = h->body.reference + 3 * v;
        double s = x[2] - arc, along = s < 0 ? 0 : s > arc ? arc : s, a = angle * along / arc, R = arc / angle;
        double ahead = s < 0 ? s : s > arc ? s - arc : 0;
        y[3 * v] = R * (1 - cos(a)) + x[0] * cos(a) + ahead * sin(a);
        y[3 * v + 1] = x[1];
        y[3 * v + 2] = R * sin(a) - x[0] * sin(a) + ahead * cos(a);
    }
    return y;
}

static double volume(const vg_mesh *m, const double *x)
{
    double sum = 0;
    for (size_t f = 0; f < m->nf; f++)
        for (size_t i = m->start[f] + 1; i + 1 < m->start[f + 1]; i++) {
            const double *a = x + 3 * (size_t)m->vert[m->start[f]], *b = x + 3 * (size_t)m->vert[i];
            const double *c = x + 3 * (size_t)m->vert[i + 1];
            sum += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                   a[2] * (b[0] * c[1] - b[1] * c[0]);
        }
    return sum / 6;
}

/* The turn about z of a ring of `sides` vertices against the reference's, nearest to `expected`. */
static double twist_of_ring(const vg_head *h, const double *x, size_t ring, size_t sides, double expected)
{
    double centre[3], was[3], c = 0, s = 0;
    const double *a = h->body.reference + 3 * ring * sides, *b = x + 3 * ring * sides;
    vg_centroid(a, sides, was);
    vg_centroid(b, sides, centre);
    for (size_t i = 0; i < sides; i++) {
        double ax = a[3 * i] - was[0], ay = a[3 * i + 1] - was[1], bx = b[3 * i] - centre[0],
               by = b[3 * i + 1] - centre[1];
        c += ax * bx + ay * by, s += ax * by - ay * bx;
    }
    double angle = atan2(s, c);
    return angle + 2 * M_PI * nearbyint((expected - angle) / (2 * M_PI));
}

enum { RINGS = 61, SIDES = 12 };

/* the largest difference of a ring's twist from u times its twist, in degrees, and of a vertex from where an even
 * twist puts it, in D */
static double uneven(trial *t, const double *x, double angle, double u, double *off)
{
    double most = 0, root[3], mine[3];
    for (size_t ring = 0; ring < RINGS; ring++) {
        double want = u * angle * t->h.body.reference[3 * ring * SIDES + 2] / top_of(&t->h);
        most = fmax(most, fabs(twist_of_ring(&t->h, x, ring, SIDES, want) - want));
    }
    double *even = twisted(&t->h, u * angle);
    vg_graph_root(t->g, even, root);
    vg_graph_root(t->g, x, mine);
    for (size_t i = 0; i < 3 * t->h.body.mesh.nv; i++) even[i] += mine[i % 3] - root[i % 3];
    *off = farthest(even, x, t->h.body.mesh.nv) / t->D;
    free(even);
    return most / DEGREES;
}

/* ---- tests ---- */

static void ends_are_exact(void)
{
    vg_head h;
    const char *name;
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        for (int smooth = 0; smooth < 2; smooth++) {
            vg_head again = {0};
            vg_err e;
            if (vg_head_copy(&again, &h, &e) < 0) exit(1);
            trial t;
            trial_begin(&t, &again);
            trial_key(&t, warp(h.body.reference, h.body.mesh.nv, 0.3));
            trial_key(&t, warp(h.body.reference, h.body.mesh.nv, 1));
            trial_key(&t, warp(h.body.reference, h.body.mesh.nv, -0.8));
            trial_open(&t, smooth, 1);
            for (size_t k = 0; k < 3; k++) {
                double *x = at(&t, (double)k), *y = at(&t, (double)k + (k == 2 ? -1e-12 : 1e-12));
                /* vertices in no face are placed by the solver, at the reference */
                for (size_t v = 0; v < h.body.mesh.nv; v++) {
                    if (!t.g->in_face[v]) continue;
                    const double *key = t.keys[k].values + 3 * v;
                    double off = farthest(x + 3 * v, key, 1), near = farthest(y + 3 * v, key, 1);
                    if (!(off <= 1e-12 * t.D) || !(near <= 1e-10 * t.D))
                        printf("%s: %g %g\n", name, off / t.D, near / t.D), test_bad++;
                }
                free(x);
                free(y);
            }
            trial_end(&t);
        }
        vg_head_clear(&h);
    }
}

static void degenerate_ends_are_exact(void)
{
    vg_head h = make_degenerate();
    trial t;
    trial_begin(&t, &h);
    trial_key(&t, copy_points(h.body.reference, h.body.mesh.nv));
    trial_key(&t, warp(h.body.reference, h.body.mesh.nv, 1));
    double *apart = warp(h.body.reference, h.body.mesh.nv, -0.5); /* points that coincided come apart */
    for (size_t i = 0; i < 3 * h.body.mesh.nv; i++) apart[i] += 0.3 * noise();
    trial_key(&t, apart);
    trial_open(&t, false, 1);
    for (size_t k = 0; k < 3; k++) {
        double *x = at(&t, (double)k);
        CHECK_NEAR(farthest(x, t.keys[k].values, h.body.mesh.nv), 0, 1e-10 * t.D);
        free(x);
    }
    double *x = at(&t, 1.5);
    CHECK(farthest(x, apart, h.body.mesh.nv) < INFINITY);
    CHECK(vg_path_get_stats(t.path).degenerate.corners > 0);
    free(x);
    trial_end(&t);
}

/* |x - y| of all pairs in a ring of pairs, that no rigid motion changes */
static double shape_change(const double *a, const double *b, size_t n)
{
    double most = 0;
    for (size_t i = 0; i < n; i++)
        for (size_t step = 1; step < n; step += 1 + n / 7) {
            size_t k = (i + step) % n;
            most = fmax(most, fabs(farthest(a + 3 * i, a + 3 * k, 1) - farthest(b + 3 * i, b + 3 * k, 1)));
        }
    return most;
}

static void rigid_turns_stay_rigid(void)
{
    static const double angles[] = {30, 90, 170, 179.9, 180};
    vg_head h;
    const char *name;
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        bool isolated = strstr(name, "isolated") || strstr(name, "mixed");
        for (size_t k = 0; k < 2 * sizeof angles / sizeof *angles && !isolated; k++) {
            vg_head again = {0};
            vg_err e;
            if (vg_head_copy(&again, &h, &e) < 0) exit(1);
            trial t;
            trial_begin(&t, &again);
            motion m = turn(angles[k / 2] * DEGREES, 1, 0.7 * t.D);
            trial_key(&t, copy_points(h.body.reference, h.body.mesh.nv));
            trial_key(&t, move_points(&m, h.body.reference, h.body.mesh.nv));
            trial_open(&t, k % 2, 1);
            for (double u = -0.5; u < 1.6; u += 0.25) {
                double *x = at(&t, u), change = shape_change(h.body.reference, x, h.body.mesh.nv) / t.D;
                if (!(change <= 1e-9))
                    printf("%s, %g degrees at %g: %g D\n", name, angles[k / 2], u, change), test_bad++;
                free(x);
            }
            trial_end(&t);
        }
        vg_head_clear(&h);
    }
}

/* three keys, turns of 100 and 100 degrees about one axis; anchors keep their distances; smooth keeps it rigid too */
static void anchors_turn_with_the_body(void)
{
    for (int smooth = 0; smooth < 2; smooth++) {
        vg_head h = make_torus(9, 7);
        h.nanchors = 3;
        h.anchors = room(3, sizeof *h.anchors);
        memcpy(h.anchors, (uint32_t[]){4, 17, 40}, 3 * sizeof *h.anchors);
        trial t;
        trial_begin(&t, &h);
        for (int k = 0; k < 3; k++) {
            motion m = turn(100 * k * DEGREES, 1, 0.3 * k * k);
            trial_key(&t, move_points(&m, h.body.reference, h.body.mesh.nv));
        }
        trial_open(&t, smooth, 2);
        for (double u = 0; u <= 2; u += 0.125) {
            double *x = at(&t, u);
            CHECK_NEAR(shape_change(h.body.reference, x, h.body.mesh.nv), 0, 1e-9 * t.D);
            free(x);
        }
        trial_end(&t);
    }
}

static void limb_keeps_its_volume(void)
{
    vg_head h = make_rod(RINGS, SIDES, false);
    trial t;
    trial_begin(&t, &h);
    trial_key(&t, copy_points(h.body.reference, h.body.mesh.nv));
    trial_key(&t, bent(&h, 120 * DEGREES));
    trial_open(&t, false, 1);
    double *x = at(&t, 0.5), *y = linear_at(&t, 0.5);
    double mean = (volume(&h.body.mesh, t.keys[0].values) + volume(&h.body.mesh, t.keys[1].values)) / 2;
    double ours = volume(&h.body.mesh, x) / mean, linear = volume(&h.body.mesh, y) / mean;
    printf("volume half way, of the ends' mean: %.4f, linear %.4f\n", ours, linear);
    CHECK_NEAR(ours, 1, 0.05);
    CHECK(linear < 0.95);
    free(x);
    free(y);
    trial_end(&t);
}

static void bar_unwinds_evenly(void)
{
    static const double angles[] = {120, 200, 400, 720, -400};
    for (size_t i = 0; i < sizeof angles / sizeof *angles; i++) {
        for (int split = 0; split < 2; split++) {
            vg_head h = make_rod(RINGS, SIDES, split);
            trial t;
            trial_begin(&t, &h);
            double angle = angles[i] * DEGREES, most = 0, worst = 0, plain = 0, astray = 0, off;
            trial_key(&t, copy_points(h.body.reference, h.body.mesh.nv));
            trial_key(&t, twisted(&h, angle));
            trial_open(&t, false, 1);
            for (double u = 0.125; u < 1; u += 0.125) {
                double *x = at(&t, u), *y = plain_at(&t, u);
                most = fmax(most, uneven(&t, x, angle, u, &off)), worst = fmax(worst, off);
                plain = fmax(plain, uneven(&t, y, angle, u, &off)), astray = fmax(astray, off);
                free(x);
                free(y);
            }
            printf("%g degrees, %s: off by %.2f degrees, %.4f D; the plain logarithm by %.1f degrees, %.4f D\n",
                   angles[i], split ? "triangles" : "quads", most, worst, plain, astray);
            CHECK(most < 3);
            CHECK(worst < 0.01);
            if (fabs(angles[i]) > 180) CHECK(plain > 60 || astray > 0.1);
            CHECK(vg_path_get_stats(t.path).beyond == (fabs(angles[i]) > 180));
            trial_end(&t);
        }
    }
}

/* velocities before and after a key */
static void smooth_paths_have_no_jumps(void)
{
    for (int k = 0; k < 2; k++) {
        vg_head h = make_rod(RINGS, SIDES, false);
        trial t;
        trial_begin(&t, &h);
        motion m = turn(k ? 2.2 : 0.7, 1.3, 2);
        trial_key(&t, copy_points(h.body.reference, h.body.mesh.nv));
        trial_key(&t, warp(h.body.reference, h.body.mesh.nv, 0.5));
        double *turned = twisted(&h, (k ? 400 : 100) * DEGREES);
        trial_key(&t, move_points(&m, turned, h.body.mesh.nv));
        free(turned);
        trial_key(&t, bent(&h, 1));
        t.keys[2].place = 2.5;
        t.keys[3].place = 3.5; /* uneven steps: velocities are by place */
        for (int smooth = 0; smooth < 2; smooth++) {
            trial_open(&t, smooth, 1);
            double jump = 0, first = 0, step = 1e-4;
            for (size_t key = 0; key < 4; key++) {
                double *a = at(&t, (double)key - step), *b = at(&t, (double)key), *c = at(&t, (double)key + step);
                double before = t.keys[key ? key : 1].place - t.keys[key ? key - 1 : 0].place;
                double after = key < 3 ? t.keys[key + 1].place - t.keys[key].place : before;
                for (size_t i = 0; i < 3 * h.body.mesh.nv; i++) {
                    double v0 = (b[i] - a[i]) / step / before, v1 = (c[i] - b[i]) / step / after;
                    jump = fmax(jump, fabs(v1 - v0) / t.D), first = fmax(first, fabs(v0) / t.D);
                }
                free(a);
                free(b);
                free(c);
            }
            printf("%s: jump of velocity %.2g of %.2g\n", smooth ? "smooth" : "plain", jump, first);
            if (smooth) CHECK(jump < 0.02 * first);
            else CHECK(jump > 0.2 * first);
            vg_path_free(&t.path);
            vg_solver_free(&t.solver);
        }
        trial_end(&t);
    }
}

/* the same to the bit with any number of threads, in any order */
static void threads_change_nothing(void)
{
    vg_head h = make_rod(RINGS, SIDES, true);
    trial t;
    trial_begin(&t, &h);
    for (int k = 0; k < 5; k++) trial_key(&t, twisted(&h, 90 * k * k * DEGREES));
    double *want = room(3 * t.corners * 9, sizeof *want), root[3], *no_anchors = room(0, 1);
    vg_err e;
    for (int threads = 1; threads < 4; threads++) {
        const vg_path_options o = {.kind = VG_VERTICES, .smooth = true, .threads = threads};
        vg_path *p;
        CHECK(vg_path_new(&p, t.g, h.body.reference, t.keys, t.n, &o, &e) == VG_OK);
        for (size_t i = 0; i < 9; i++) {
            size_t k = threads == 3 ? 8 - i : i;
            double *to = threads == 1 ? want + 3 * t.corners * k : t.w;
            CHECK(vg_path_at(p, (double)k / 2, to, root, no_anchors, &e) == VG_OK);
            CHECK(!memcmp(to, want + 3 * t.corners * k, 3 * t.corners * sizeof *to));
        }
        vg_path_free(&p);
    }
    free(want);
    free(no_anchors);
    trial_end(&t);
}

/* vertices, vectors and deformations of the same keys are the same path */
static void kinds_agree(void)
{
    vg_head h = make_mixed(8);
    trial t;
    trial_begin(&t, &h);
    trial_key(&t, warp(h.body.reference, h.body.mesh.nv, 0.4));
    trial_key(&t, warp(h.body.reference, h.body.mesh.nv, 1));
    trial_open(&t, false, 1);
    double root[3], *no_anchors = room(0, 1), *vectors[2], *q[2];
    vg_key keys[2] = {t.keys[0], t.keys[1]};
    vg_deformer *d;
    vg_err e;
    CHECK(vg_deformer_new(&d, t.g, h.body.reference, 1, &e) == VG_OK);
    for (int k = 0; k < 2; k++) {
        vectors[k] = vectors_of(t.g, t.keys[k].values);
        q[k] = room(4 * t.corners, sizeof(double));
        vg_deformer_measure(d, 1, VG_VERTICES, &t.keys[k].values, &q[k]);
    }
    double *want = room(3 * t.corners, sizeof *want);
    CHECK(vg_path_at(t.path, 0.3, want, root, no_anchors, &e) == VG_OK);
    for (int kind = VG_VECTORS; kind <= VG_DEFORMATIONS; kind++) {
        const vg_path_options o = {.kind = (vg_kind)kind, .threads = 1};
        vg_path *p;
        for (int k = 0; k < 2; k++) keys[k].values = kind == VG_VECTORS ? vectors[k] : q[k];
        CHECK(vg_path_new(&p, t.g, h.body.reference, keys, 2, &o, &e) == VG_OK);
        CHECK(vg_path_at(p, 0.3, t.w, root, no_anchors, &e) == VG_OK);
        CHECK_NEAR(farthest(t.w, want, t.corners), 0, 1e-10 * t.D);
        vg_path_free(&p);
    }
    for (int k = 0; k < 2; k++) free(vectors[k]), free(q[k]);
    free(want);
    free(no_anchors);
    vg_deformer_free(&d);
    trial_end(&t);
}

static void wrong_keys_are_refused(void)
{
    vg_head h = make_torus(5, 4);
    trial t;
    trial_begin(&t, &h);
    trial_key(&t, copy_points(h.body.reference, h.body.mesh.nv));
    trial_key(&t, copy_points(h.body.reference, h.body.mesh.nv));
    const vg_path_options o = {.kind = VG_VERTICES, .threads = 1};
    vg_path *p;
    vg_err e;
    CHECK(vg_path_new(&p, t.g, h.body.reference, t.keys, 1, &o, &e) == VG_EARG && !p);
    t.keys[1].place = t.keys[0].place;
    CHECK(vg_path_new(&p, t.g, h.body.reference, t.keys, 2, &o, &e) == VG_EARG && !p);
    trial_end(&t);
}

static void nearest_branch(void)
{
    for (int i = 0; i < 1000; i++) {
        double want[4] = {0, 3 * noise(), 3 * noise(), 3 * noise()}, q[4], l[3], near[3];
        vg_quat_exp(want, q);
        for (int k = 0; k < 4 && i % 2; k++) q[k] = -q[k];
        for (int k = 0; k < 3; k++) near[k] = want[k + 1] + 1e-3 * noise();
        double length = sqrt(want[1] * want[1] + want[2] * want[2] + want[3] * want[3]);
        if (fabs(sin(length)) < 0.1 && length > 1) continue; /* the axis says nothing there */
        vgi_branch_near(q, near, l);
        CHECK_NEAR(farthest(l, want + 1, 1), 0, 1e-9);
    }
    const double one[4] = {-1, 0, 0, 0}, near[3] = {0, 0, 3.1};
    double l[3];
    CHECK(vgi_branch_near(one, near, l));
    CHECK_NEAR(l[2], M_PI, 1e-12);
}

#define T(x) {#x, x}
TESTS(T(nearest_branch), T(ends_are_exact), T(degenerate_ends_are_exact), T(rigid_turns_stay_rigid),
      T(anchors_turn_with_the_body), T(limb_keeps_its_volume), T(bar_unwinds_evenly), T(smooth_paths_have_no_jumps),
      T(threads_change_nothing), T(kinds_agree), T(wrong_keys_are_refused))
