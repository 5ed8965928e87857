/* test_map.c: a map is its uncollapsed chain; bodies that move rigidly by patches are met; joints, paths, and other
 * bodies.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "meshes.h"
#include "method/rig/map_parts.h"

enum { POSES = 7 };

/* A rod whose faces are in `n` patches along z. */
static vg_head make_body(size_t n)
{
    vg_head h = make_rod(24, 8, false);
    vg_err e;
    h.body.patches.n = n;
    h.body.patches.of_face = room(h.body.mesh.nf, sizeof *h.body.patches.of_face);
    for (size_t f = 0; f < h.body.mesh.nf; f++) {
        double z = 0, most = 2 * M_PI * 24 / 8;
        for (uint32_t c = h.body.mesh.start[f]; c < h.body.mesh.start[f + 1]; c++)
            z += h.body.reference[3 * (size_t)h.body.mesh.vert[c] + 2] /
                 (h.body.mesh.start[f + 1] - h.body.mesh.start[f]);
        h.body.patches.of_face[f] = (uint32_t)fmin((double)n - 1, floor(z / most * (double)n));
    }
    CHECK(vg_head_prepare_vectors(&h, &e) == VG_OK);
    return h;
}

/* Bent about x by an angle that grows along z, and moved away. */
static void bend(const vg_head *h, double angle, double *pose)
{
    double most = 2 * M_PI * 24 / 8, r = most / angle;
    for (size_t v = 0; v < h->body.mesh.nv; v++) {
        const double *x = h->body.reference + 3 * v;
        double a = angle * x[2] / most;
        pose[3 * v] = x[0] + angle;
        pose[3 * v + 1] = r * (1 - cos(a)) + x[1] * cos(a) - 3 * angle;
        pose[3 * v + 2] = r * sin(a) - x[1] * sin(a);
    }
}

static void turn_all(const vg_head *h, double angle, double *pose)
{
    for (size_t v = 0; v < h->body.mesh.nv; v++) {
        const double *x = h->body.reference + 3 * v;
        pose[3 * v] = x[0] * cos(angle) - x[1] * sin(angle) + 5;
        pose[3 * v + 1] = x[0] * sin(angle) + x[1] * cos(angle) - 1;
        pose[3 * v + 2] = x[2] + 2;
    }
}

static void finish(vg_map_fitter *f, vg_head *h)
{
    vg_patches patches;
    vg_map map;
    vg_err e;
    CHECK(vg_map_fitter_finish(f, &patches, &map, &e) == VG_OK);
    vg_map_fitter_free(&f);
    vg_head_put(h, &patches, "patches");
    vg_head_put(h, &map, "map");
}

static void fit(vg_head *h, void (*make)(const vg_head *, double, double *))
{
    vg_map_fitter *f;
    vg_err e;
    double *pose = room(3 * h->body.mesh.nv, sizeof *pose);
    CHECK(vg_head_prepare_vectors(h, &e) == VG_OK);
    CHECK(vg_map_fitter_new(&f, h, 0.03, 2, &e) == VG_OK);
    for (int i = 0; i < POSES; i++) {
        const double *poses[1] = {pose};
        make(h, 0.2 * (i + 1), pose);
        CHECK(vg_map_fitter_add(f, 1, poses, &e) == VG_OK);
    }
    finish(f, h);
    free(pose);
}

static double apart(const double *a, const double *b, size_t n)
{
    double d = 0;
    for (size_t i = 0; i < n; i++) d = fmax(d, fabs(a[i] - b[i]));
    return d;
}

typedef struct played {
    vg_player *p;
    double *transforms, *vertices;
} played;

static played open_player(const vg_head *h, bool single, int threads)
{
    vg_err e;
    played x = {NULL, room(7 * h->map.n, sizeof(double)), room(3 * h->body.mesh.nv, sizeof(double))};
    CHECK(vg_player_new(&x.p, &h->body, &h->map, single, threads, &e) == VG_OK);
    return x;
}

static void measure(played *x, const double *pose)
{
    vg_player_measure(x->p, 1, &pose, &x->transforms);
}

static void play(played *x)
{
    vg_player_pose(x->p, 1, (const double *const *)&x->transforms, &x->vertices);
}

static void close_player(played *x)
{
    vg_player_free(&x->p);
    free(x->transforms);
    free(x->vertices);
}

/* The whole moves rigidly: so do all patches, and the map follows exactly, also where it was not fitted, and by
 * joints. */
static void rigid_bodies(void)
{
    vg_head h = make_body(5);
    fit(&h, turn_all);
    double D = vg_diagonal(h.body.reference, h.body.mesh.nv), *pose = room(3 * h.body.mesh.nv, sizeof *pose);
    played x = open_player(&h, false, 1);
    for (int i = 0; i < 10; i++) {
        turn_all(&h, 0.7 * i - 2, pose);
        measure(&x, pose);
        play(&x);
        CHECK_NEAR(apart(x.vertices, pose, 3 * h.body.mesh.nv), 0, 1e-9 * D);
        vg_player_place(x.p, x.transforms);
        play(&x);
        CHECK_NEAR(apart(x.vertices, pose, 3 * h.body.mesh.nv), 0, 1e-9 * D);
    }
    free(pose);
    close_player(&x);
    vg_head_clear(&h);
}

/* vgi_map_collapse against one reconstruction from the vectors that the same transforms give. */
static void collapsed_is_uncollapsed(void)
{
    vg_head h = make_body(4);
    vg_graph *g;
    vg_solver *s;
    vg_err e;
    fit(&h, bend);
    CHECK(vg_head_graph(&g, &h, &e) == VG_OK);
    uint32_t *of_face = vgi_graph_patches(&h, &h.body.patches, g, &e);
    size_t corners = vg_graph_corners(g), nv = h.body.mesh.nv;
    double *vectors = room(3 * corners, sizeof *vectors), *wanted = room(3 * corners, sizeof *wanted);
    double *anchors = room(3 * h.map.nheld, sizeof *anchors), *x = room(3 * nv, sizeof *x),
           *rhs = room(3 * nv, sizeof *rhs);
    double *pose = room(3 * nv, sizeof *pose);
    vg_graph_vectors(g, h.body.reference, vectors);
    CHECK(vgi_map_collapse(&h.map, &(vgi_map_body){.reference = h.body.reference}, g, of_face, vectors, 2, &e) == VG_OK);
    played p = open_player(&h, false, 2);
    bend(&h, 1.3, pose);
    measure(&p, pose);
    play(&p);
    for (size_t f = 0; f < g->faces.nf; f++)
        for (size_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++) {
            double u[3];
            vg_quat_apply(h.map.corner + 4 * c, vectors + 3 * c, u);
            vg_quat_apply(p.transforms + 7 * of_face[f], u, wanted + 3 * c);
        }
    for (size_t i = 0; i < h.map.nheld; i++) {
        const double *t = p.transforms + 7 * h.map.held_patch[i];
        vg_quat_apply(t, h.map.held_at + 3 * i, anchors + 3 * i);
        for (size_t k = 0; k < 3; k++) anchors[3 * i + k] += t[4 + k];
    }
    CHECK(vg_solver_new(&s, g, h.map.held, h.map.nheld, h.body.reference, VG_WEIGHTS_UNIFORM, 1, &e) == VG_OK);
    vg_solver_load(s, 1, (const double *const *)&wanted, (const double *const *)&anchors, &x, &rhs);
    vg_solver_solve(s, 1, (const double *const *)&rhs, &x, (const double *const *)&anchors,
                    (const double *const *)&anchors);
    CHECK_NEAR(apart(x, p.vertices, 3 * nv), 0, 1e-9 * vg_diagonal(h.body.reference, nv));
    vg_solver_free(&s);
    close_player(&p);
    free(of_face);
    free(vectors);
    free(wanted);
    free(anchors);
    free(x);
    free(rhs);
    free(pose);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

static void paths(void)
{
    vg_head h = make_body(6);
    fit(&h, bend);
    size_t n = h.map.n, nv = h.body.mesh.nv;
    double D = vg_diagonal(h.body.reference, nv), *a = room(7 * n, sizeof *a), *b = room(7 * n, sizeof *b),
           *pose = room(3 * nv, sizeof *pose);
    played x = open_player(&h, false, 1), single = open_player(&h, true, 2);
    bend(&h, 0.4, pose);
    measure(&x, pose);
    memcpy(a, x.transforms, 7 * n * sizeof *a);
    bend(&h, 1.2, pose);
    measure(&x, pose);
    memcpy(b, x.transforms, 7 * n * sizeof *b);
    play(&x);
    CHECK_NEAR(apart(x.vertices, pose, 3 * nv), 0, 3e-3 * D); /* training error */
    memcpy(single.transforms, b, 7 * n * sizeof *b);
    play(&single);
    CHECK_NEAR(apart(x.vertices, single.vertices, 3 * nv), 0, 1e-5 * D);
    vg_player_between(x.p, a, b, 1, x.transforms); /* both ends to rounding */
    play(&single);
    play(&x);
    memcpy(pose, x.vertices, 3 * nv * sizeof *pose);
    memcpy(x.transforms, b, 7 * n * sizeof *b);
    play(&x);
    CHECK_NEAR(apart(x.vertices, pose, 3 * nv), 0, 1e-9 * D);
    vg_player_between(x.p, a, b, 0, x.transforms);
    play(&x);
    memcpy(pose, x.vertices, 3 * nv * sizeof *pose);
    memcpy(x.transforms, a, 7 * n * sizeof *a);
    play(&x);
    CHECK_NEAR(apart(x.vertices, pose, 3 * nv), 0, 1e-9 * D);
    /* the middle of a bend is the bend by the middle angle, but for the root */
    vg_player_between(x.p, a, b, 0.5, x.transforms);
    play(&x);
    bend(&h, 0.8, pose);
    double c0[3], c1[3], worst = 0;
    vg_centroid(pose, nv, c0);
    vg_centroid(x.vertices, nv, c1);
    for (size_t i = 0; i < 3 * nv; i++) worst = fmax(worst, fabs(pose[i] - c0[i % 3] - x.vertices[i] + c1[i % 3]));
    CHECK_NEAR(worst, 0, 5e-3 * D);
    free(a);
    free(b);
    free(pose);
    close_player(&x);
    close_player(&single);
    vg_head_clear(&h);
}

/* The body turned by 170 degrees is on the way to it a rigid body, whatever t. */
static void half_turns(void)
{
    vg_head h = make_body(5);
    fit(&h, bend);
    size_t n = h.map.n, nv = h.body.mesh.nv;
    double *a = room(7 * n, sizeof *a), *b = room(7 * n, sizeof *b), *pose = room(3 * nv, sizeof *pose),
           *start = room(3 * nv, sizeof *start);
    played x = open_player(&h, false, 1);
    measure(&x, h.body.reference);
    memcpy(a, x.transforms, 7 * n * sizeof *a);
    play(&x);
    memcpy(start, x.vertices, 3 * nv * sizeof *start);
    turn_all(&h, 170 * M_PI / 180, pose);
    measure(&x, pose);
    memcpy(b, x.transforms, 7 * n * sizeof *b);
    for (double t = -0.5; t < 1.6; t += 0.25) {
        vg_player_between(x.p, a, b, t, x.transforms);
        play(&x);
        for (size_t v = 1; v < nv; v++) {
            double before = 0, after = 0;
            for (size_t k = 0; k < 3; k++) {
                before += pow(start[3 * v + k] - start[k], 2);
                after += pow(x.vertices[3 * v + k] - x.vertices[k], 2);
            }
            CHECK_NEAR(sqrt(after), sqrt(before), 1e-9 * vg_diagonal(h.body.reference, nv));
        }
    }
    free(a);
    free(b);
    free(pose);
    free(start);
    close_player(&x);
    vg_head_clear(&h);
}

/* A body of twice the size: poses of the first one give poses twice the size. Half way there: 2^0.5. */
static void other_bodies(void)
{
    for (int half = 0; half < 2; half++) {
        vg_head h = make_body(5);
        vg_err e;
        fit(&h, bend);
        size_t nv = h.body.mesh.nv;
        double D = vg_diagonal(h.body.reference, nv), c0[3], c1[3], scale = half ? sqrt(2) : 2;
        double *pose = room(3 * nv, sizeof *pose), *target = room(3 * nv, sizeof *target),
               *own = room(3 * nv, sizeof *own);
        bend(&h, 0.9, pose);
        played x = open_player(&h, false, 1);
        measure(&x, pose);
        vg_player_place(x.p, x.transforms);
        play(&x);
        memcpy(own, x.vertices, 3 * nv * sizeof *own);
        close_player(&x);
        for (size_t i = 0; i < 3 * nv; i++) target[i] = 2 * h.body.reference[i] + 1;
        vg_map moved;
        vg_rig none;
        CHECK(vg_map_retarget(&h, target, half ? 0.5 : 1, 2, &moved, &none, h.body.reference, &e) == VG_OK);
        vg_head_put(&h, &moved, "map");
        x = open_player(&h, false, 1);
        measure(&x, pose);
        play(&x);
        vg_centroid(own, nv, c0);
        vg_centroid(x.vertices, nv, c1);
        double worst = 0;
        for (size_t i = 0; i < 3 * nv; i++)
            worst = fmax(worst, fabs(scale * (own[i] - c0[i % 3]) - (x.vertices[i] - c1[i % 3])));
        CHECK_NEAR(worst, 0, 1e-8 * D);
        /* the body is between both as a whole, and goes as far as its size says */
        vg_centroid(h.body.reference, nv, c0);
        vg_centroid(target, nv, c1);
        for (int k = 0; k < 3; k++) /* target = 2 reference + 1 */
            CHECK_NEAR(c0[k], half ? (c1[k] + (c1[k] - 1) / 2) / 2 : c1[k], 1e-9);
        memcpy(own, x.vertices, 3 * nv * sizeof *own);
        for (size_t i = 0; i < 3 * nv; i++) pose[i] += (double)(i % 3) - 5;
        measure(&x, pose);
        play(&x);
        for (size_t i = 0; i < 3 * nv; i++)
            CHECK_NEAR(x.vertices[i] - own[i], scale * ((double)(i % 3) - 5), 1e-8 * D);
        free(pose);
        free(target);
        free(own);
        close_player(&x);
        vg_head_clear(&h);
    }
}

/* Patches that turn, grow and move each by themselves are measured as they do so. */
static void patches_are_measured(void)
{
    vg_head h = make_body(5);
    vgi_shape s;
    vg_err e;
    motion truth[5];
    double *pose = room(3 * h.body.mesh.nv, sizeof *pose);
    CHECK(vgi_shape_make(&s, &h.body.mesh, &h.body.patches, h.body.reference, &e) == VG_OK);
    for (uint32_t p = 0; p < 5; p++) {
        vgi_motion m;
        double b = p == 4 ? 1e-9 : 0.3 + p;
        truth[p] = turn(0.5 * p - 1, b, p);
        for (size_t f = 0; f < h.body.mesh.nf; f++)
            for (uint32_t c = h.body.mesh.start[f]; h.body.patches.of_face[f] == p && c < h.body.mesh.start[f + 1];
                 c++) {
                double *to = pose + 3 * (size_t)h.body.mesh.vert[c];
                move_vector(&truth[p], h.body.reference + 3 * (size_t)h.body.mesh.vert[c], to);
                for (int k = 0; k < 3; k++) to[k] += truth[p].shift[k];
            }
        vgi_shape_measure(&s, p, pose, &m);
        if (p == 4) { /* it vanishes: but not altogether */
            CHECK_NEAR(m.b2, 1e-12, 1e-15);
            continue;
        }
        CHECK_NEAR(m.b2, b * b, 1e-12);
        for (int k = 0; k < 9; k++) CHECK_NEAR(m.a[k], truth[p].m[k], 1e-12);
        for (int k = 0; k < 3; k++) CHECK_NEAR(m.t[k], truth[p].shift[k], 1e-11);
    }
    vgi_shape_clear(&s);
    free(pose);
    vg_head_clear(&h);
}

/* A vertex in no face goes with the patch whose centre is nearest; a second component with the patch at the end of
 * its link. */
static void what_hangs_loose(void)
{
    vg_head h = make_body(5);
    vg_err e;
    double end = h.body.reference[3 * h.body.mesh.nv - 1];
    add_vertex(&h, 0, 1.7, end - 2);
    uint32_t loose = (uint32_t)h.body.mesh.nv - 1, a = add_vertex(&h, 0, 0, end + 0.4),
             b = add_vertex(&h, 0.3, 0, end + 0.4), c = add_vertex(&h, 0, 0.3, end + 0.5);
    uint32_t *of_face = room(h.body.mesh.nf + 1, sizeof *of_face);
    memcpy(of_face, h.body.patches.of_face, h.body.mesh.nf * sizeof *of_face);
    FACE(&h, a, b, c);
    of_face[h.body.mesh.nf - 1] = 5, h.body.patches.n = 6;
    free(h.body.patches.of_face);
    h.body.patches.of_face = of_face;
    h.links.chosen = false;
    CHECK(vg_head_prepare_vectors(&h, &e) == VG_OK && h.links.n == 1);
    fit(&h, bend);
    vg_graph *g = graph_of(&h);
    uint32_t *all = vgi_graph_patches(&h, &h.body.patches, g, &e);
    CHECK(g->nlinks == 1 && all[g->faces.nf - 1] == 4); /* the rod's vertices come first */
    double *pose = room(3 * h.body.mesh.nv, sizeof *pose);
    played x = open_player(&h, false, 1);
    bend(&h, 0.8, pose);
    measure(&x, pose);
    play(&x);
    double at[3];
    vg_quat_apply(x.transforms + 7 * 4, h.body.reference + 3 * (size_t)loose, at);
    for (size_t k = 0; k < 3; k++) CHECK_NEAR(x.vertices[3 * loose + k], at[k] + x.transforms[7 * 4 + 4 + k], 1e-9);
    free(all);
    free(pose);
    vg_graph_free(&g);
    close_player(&x);
    vg_head_clear(&h);
}

/* Half of the rod turns about a point beside it: that is the joint, and turns alone say where both halves are. */
static void joints_are_found(void)
{
    static const double hinge[3] = {0.5, 3, 9};
    vg_head h = make_body(2);
    vg_err e;
    vg_map_fitter *f;
    size_t nv = h.body.mesh.nv;
    double D = vg_diagonal(h.body.reference, nv), *pose = room(3 * nv, sizeof *pose), rotation[9];
    vgi_shape shape;
    CHECK(vgi_shape_make(&shape, &h.body.mesh, &h.body.patches, h.body.reference, &e) == VG_OK);
    bool *upper = room(nv, sizeof *upper);
    for (size_t i = shape.first[1]; i < shape.first[2]; i++) upper[shape.member[i]] = true;
    CHECK(vg_head_prepare_vectors(&h, &e) == VG_OK);
    CHECK(vg_map_fitter_new(&f, &h, 0.03, 1, &e) == VG_OK);
    for (int k = 0; k < 12; k++) {
        double l[4] = {0, noise(), noise(), noise()}, q[4];
        const double *poses[1] = {pose};
        vg_quat_exp(l, q);
        vg_quat_matrix(q, rotation);
        for (size_t v = 0; v < nv; v++)
            for (size_t i = 0; i < 3; i++) {
                const double *x = h.body.reference + 3 * v, *m = rotation + 3 * i;
                double turned = m[0] * (x[0] - hinge[0]) + m[1] * (x[1] - hinge[1]) + m[2] * (x[2] - hinge[2]);
                pose[3 * v + i] = upper[v] ? turned + hinge[i] : x[i];
            }
        CHECK(vg_map_fitter_add(f, 1, poses, &e) == VG_OK);
    }
    finish(f, &h);
    CHECK(h.map.nhinges == 1);
    /* nearly: the halves share a ring, so the lower one is not quite rigid; the middle of the ring is 3.1 away */
    CHECK(farthest(h.map.hinge_at, hinge, 1) < 1);
    played x = open_player(&h, false, 1);
    measure(&x, pose);
    for (size_t i = 0; i < 3; i++) x.transforms[4 + i] += 1, x.transforms[11 + i] -= 2;
    double root[3], now[3];
    vg_centroid(pose, nv, root);
    vg_player_place(x.p, x.transforms);
    play(&x);
    vg_centroid(x.vertices, nv, now);
    for (size_t i = 0; i < 3 * nv; i++) x.vertices[i] += root[i % 3] - now[i % 3];
    CHECK(farthest(x.vertices, pose, nv) < 0.03 * D); /* without skin 0.12 */
    vgi_shape_clear(&shape);
    free(upper);
    free(pose);
    close_player(&x);
    vg_head_clear(&h);
}

/* How far a bent rod is from its map, on average, patch motions given or their turns alone. */
static void bends_are_learned(void)
{
    vg_head h = make_body(5);
    size_t nv = h.body.mesh.nv;
    double D = vg_diagonal(h.body.reference, nv), *pose = room(3 * nv, sizeof *pose), mean[2] = {0, 0};
    fit(&h, bend);
    played x = open_player(&h, false, 1);
    for (int k = 0; k < POSES; k++) {
        bend(&h, 0.2 * (k + 1), pose);
        measure(&x, pose);
        for (int placed = 0; placed < 2; placed++) {
            if (placed) vg_player_place(x.p, x.transforms);
            play(&x);
            for (size_t v = 0; v < nv; v++)
                mean[placed] += farthest(x.vertices + 3 * v, pose + 3 * v, 1) / D / (double)(nv * POSES);
        }
    }
    CHECK(mean[0] < 2.5e-4);  /* 7.5e-4 if nothing takes up what rigid patches leave */
    CHECK(mean[1] < 2.55e-4); /* 2.75e-4 if nothing takes up what joints miss */
    free(pose);
    close_player(&x);
    vg_head_clear(&h);
}

/* Powers of two, so that nothing is rounded: fits, measures and plays the same in any unit. */
static void units_do_not_matter(void)
{
    static const int powers[] = {0, -66, 66}; /* 1, 1e-20, 1e20 */
    double *first = NULL;
    for (int u = 0; u < 3; u++) {
        double unit = ldexp(1, powers[u]);
        vg_head h = make_body(5);
        vg_err e;
        vg_map_fitter *f;
        size_t n = 3 * h.body.mesh.nv;
        double *pose = room(n, sizeof *pose);
        for (size_t i = 0; i < n; i++) h.body.reference[i] *= unit;
        CHECK(vg_head_prepare_vectors(&h, &e) == VG_OK);
        CHECK(vg_map_fitter_new(&f, &h, 0.03, 2, &e) == VG_OK);
        for (int k = 0; k < POSES; k++) {
            const double *poses[1] = {pose};
            for (size_t i = 0; i < n; i++) h.body.reference[i] /= unit;
            bend(&h, 0.2 * (k + 1), pose);
            for (size_t i = 0; i < n; i++) h.body.reference[i] *= unit, pose[i] *= unit;
            CHECK(vg_map_fitter_add(f, 1, poses, &e) == VG_OK);
        }
        finish(f, &h);
        played x = open_player(&h, false, 1);
        measure(&x, pose);
        vg_player_place(x.p, x.transforms);
        play(&x);
        for (size_t i = 0; i < n; i++) x.vertices[i] /= unit;
        if (u == 0) first = vgi_copy_array(x.vertices, n, sizeof *first, &e);
        else CHECK_NEAR(apart(x.vertices, first, n), 0, 1e-10);
        free(pose);
        close_player(&x);
        vg_head_clear(&h);
    }
    free(first);
}

static void refusals(void)
{
    vg_head h = make_rod(5, 4, true);
    vg_map_fitter *f;
    vg_player *p;
    vg_patches patches;
    vg_map map;
    vg_rig rig;
    vg_err e;
    CHECK(vg_map_fitter_new(&f, &h, 0.03, 1, &e) == VG_EINPUT && !f);
    CHECK(vg_player_new(&p, &h.body, &h.map, false, 1, &e) == VG_EINPUT && !p);
    CHECK(vg_map_retarget(&h, h.body.reference, 1, 1, &map, &rig, h.body.reference, &e) == VG_EINPUT && !map.n);
    vg_head body = make_body(3);
    body.links.chosen = false;
    CHECK(vg_map_fitter_new(&f, &body, 0.03, 1, &e) == VG_EARG && !f);
    CHECK(vg_head_prepare_vectors(&body, &e) == VG_OK);
    CHECK(vg_map_fitter_new(&f, &body, 0.03, 1, &e) == VG_OK);
    CHECK(vg_map_fitter_finish(f, &patches, &map, &e) == VG_EINPUT && !map.n && !patches.n);
    vg_map_fitter_free(&f);
    vg_head_clear(&body);
    vg_head_clear(&h);
}

TESTS({"rigid bodies", rigid_bodies}, {"collapsed is uncollapsed", collapsed_is_uncollapsed}, {"paths", paths},
      {"half turns", half_turns}, {"other bodies", other_bodies},
      {"patches are measured", patches_are_measured},
      {"what hangs loose", what_hangs_loose}, {"units do not matter", units_do_not_matter},
      {"joints are found", joints_are_found}, {"bends are learned", bends_are_learned}, {"refusals", refusals})
