/* test_segment.c: rotations nearest to matrices; patches of bars that turn in known pieces; pieces; threads.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "meshes.h"
#include "method/patches/join.h"
#include "method/patches/pieces.h"
#include "numeric/polar.h"

static void turn_about(const double axis[3], double angle, double m[9])
{
    double l[4] = {0, axis[0] * angle / 2, axis[1] * angle / 2, axis[2] * angle / 2}, q[4];
    vg_quat_exp(l, q);
    vg_quat_matrix(q, m);
}

static void any_axis(double axis[3])
{
    double n = 0;
    for (int k = 0; k < 3; k++) axis[k] = noise(), n += axis[k] * axis[k];
    for (int k = 0; k < 3; k++) axis[k] /= sqrt(n);
}

static double difference(const double *a, const double *b)
{
    double d = 0;
    for (int i = 0; i < 9; i++) d = fmax(d, fabs(a[i] - b[i]));
    return d;
}

/* R S with S symmetric positive (semi)definite has R as its nearest rotation, also when S has rank 2; -S of rank 3
 * turns inside out. */
static void nearest_rotations(void)
{
    for (int trial = 0; trial < 300; trial++) {
        double axis[3], other[3], r[9], v[9], m[9] = {0}, found[9], inverse[9] = {0};
        double s[3] = {1 + fabs(noise()), 0.1 + fabs(noise()), trial % 3 ? 0.01 + fabs(noise()) : 0};
        any_axis(axis);
        any_axis(other);
        turn_about(axis, 3.1 * noise(), r);
        turn_about(other, 3.1 * noise(), v);
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++)
                for (int j = 0; j < 3; j++)
                    for (int q = 0; q < 3; q++) m[3 * i + k] += r[3 * i + q] * v[3 * q + j] * s[j] * v[3 * k + j];
        vgi_fit_rotation(m, found);
        CHECK_NEAR(difference(found, r), 0, 1e-10);
        for (int i = 0; i < 9; i++) inverse[i] = -m[i];
        vgi_fit_rotation(inverse, found); /* a rotation all the same */
        double det = found[0] * (found[4] * found[8] - found[5] * found[7]) -
                     found[1] * (found[3] * found[8] - found[5] * found[6]) +
                     found[2] * (found[3] * found[7] - found[4] * found[6]);
        CHECK_NEAR(det, 1, 1e-12);
    }
    double zero[9] = {0}, r[9], unit[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, line[9] = {0, 0, 0, 2, 0, 0, 0, 0, 0};
    vgi_fit_rotation(zero, r);
    CHECK_NEAR(difference(r, unit), 0, 0);
    vgi_fit_rotation(line, r); /* x goes to y: the smallest turn that does it is about z */
    const double quarter[9] = {0, -1, 0, 1, 0, 0, 0, 0, 1};
    CHECK_NEAR(difference(r, quarter), 0, 1e-5);
}

/* A strip of quads along x; from `hinge` on it turns about z by `angle`, and the last third besides about x. */
enum { LONG = 30 };

static void strip(vg_head *h)
{
    for (int i = 0; i <= LONG; i++)
        for (int k = 0; k < 2; k++) add_vertex(h, i, k, 0.1 * i * k);
    for (uint32_t i = 0; i < LONG; i++) {
        const uint32_t face[4] = {2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1};
        add_face(h, 4, face);
    }
}

static void fold(const vg_head *h, double angle, double *pose)
{
    double r[9], z[3] = {0, 0, 1};
    turn_about(z, angle, r);
    for (size_t v = 0; v < h->body.mesh.nv; v++) {
        const double *x = h->body.reference + 3 * v;
        double d[3] = {x[0] - LONG / 3, x[1], x[2]};
        bool middle = x[0] > LONG / 3 && x[0] <= 2 * LONG / 3, far = x[0] > 2 * LONG / 3;
        for (size_t i = 0; i < 3; i++)
            pose[3 * v + i] = middle || far
                                  ? r[3 * i] * d[0] + r[3 * i + 1] * d[1] + r[3 * i + 2] * d[2] + (i == 0) * LONG / 3
                                  : x[i];
        if (far) { /* back again: as the first third */
            double at[3] = {LONG / 3 * r[0] + LONG / 3, LONG / 3 * r[3], 0};
            for (size_t i = 0; i < 3; i++) pose[3 * v + i] = at[i] + x[i] - (i == 0) * 2 * LONG / 3;
        }
    }
}

static vg_patches cut(const vg_head *h, size_t k, bool connected, int threads)
{
    vg_segmenter *s;
    vg_err e;
    vg_patches p = {0};
    vg_segment_stats report;
    double *pose = room(3 * h->body.mesh.nv, sizeof *pose);
    CHECK(vg_segmenter_new(&s, &h->body.mesh, h->body.reference, threads, &e) == VG_OK);
    for (int i = 1; i < 6; i++) {
        const double *poses[1] = {pose};
        fold(h, 0.3 * i, pose);
        CHECK(vg_segmenter_add(s, 1, poses, NULL) == VG_OK);
    }
    CHECK(vg_segmenter_cut(s, k, 7, connected, &p, &report, &e) == VG_OK);
    CHECK(report.patches == p.n);
    vg_segmenter_free(&s);
    free(pose);
    return p;
}

static void thirds(void)
{
    vg_head h = new_shape();
    strip(&h);
    vg_patches two = cut(&h, 2, false, 1), three = cut(&h, 3, true, 2), many = cut(&h, 12, false, 2),
               same = cut(&h, 12, false, 1);
    CHECK(two.n == 2);
    /* far ends turn alike */
    CHECK(two.of_face[0] == two.of_face[LONG - 1] && two.of_face[0] != two.of_face[LONG / 2]);
    CHECK(three.n == 3 && three.of_face[0] != three.of_face[LONG - 1]);
    for (int f = 1; f < LONG; f++) CHECK(three.of_face[f] >= three.of_face[f - 1]);
    CHECK(many.n == same.n && !memcmp(many.of_face, same.of_face, h.body.mesh.nf * sizeof *many.of_face));
    vg_patches_clear(&two);
    vg_patches_clear(&three);
    vg_patches_clear(&many);
    vg_patches_clear(&same);
    vg_head_clear(&h);
}

static void pieces(void)
{
    uint32_t start[] = {0, 3, 6, 9, 11}, vert[] = {0, 1, 2, 2, 1, 3, 4, 5, 6, 6, 3}, label[] = {0, 0, 0, 1};
    uint32_t piece[4], (*pair)[2], *shared;
    size_t n, npairs;
    vg_err e;
    const vg_mesh faces = {7, 4, start, vert};
    CHECK(vgi_connected_pieces(&faces, label, 2, piece, &n, &e) == VG_OK);
    CHECK(n == 3 && piece[0] == 0 && piece[1] == 0 && piece[2] == 1 && piece[3] == 2);
    CHECK(vgi_neighbours(&faces, piece, &pair, &shared, &npairs, &e) == VG_OK);
    CHECK(npairs == 2 && pair[0][0] == 0 && pair[0][1] == 2 && pair[1][0] == 1 && pair[1][1] == 2);
    CHECK(npairs == 2 && shared[0] == 1 && shared[1] == 1);
    free(pair);
    free(shared);
}

/* A fan of a hundred and thirty triangles around a hub, in three sectors: a pair shares the hub and the vertex on
 * the rim between them; those whose faces come last are no worse off. */
static void sectors_meet(void)
{
    enum { RIM = 130 };
    vg_head h = new_shape();
    uint32_t label[RIM], (*pair)[2], *shared;
    size_t n;
    vg_err e;
    add_vertex(&h, 5, 6, 7);
    for (int i = 0; i < RIM; i++) add_vertex(&h, 5 + cos(2 * M_PI * i / RIM), 6 + sin(2 * M_PI * i / RIM), 7);
    for (uint32_t i = 0; i < RIM; i++) {
        FACE(&h, 0, 1 + i, 1 + (i + 1) % RIM);
        label[i] = i < 70 ? 1 : i < 100 ? 2 : 0; /* 1 and 2 meet at rim 70, 2 and 0 at 100, 0 and 1 at 0 */
    }
    const uint32_t rim[3] = {0, 100, 70};
    double mean[9];
    const vg_mesh *m = &h.body.mesh;
    CHECK(vgi_neighbours(m, label, &pair, &shared, &n, &e) == VG_OK);
    CHECK(n == 3 && pair[0][0] == 0 && pair[0][1] == 1 && pair[1][1] == 2 && pair[2][0] == 1 && pair[2][1] == 2);
    CHECK(vgi_shared_points(m, label, pair[0], n, h.body.reference, mean, &e) == VG_OK);
    for (size_t i = 0; i < 3; i++) {
        CHECK(shared[i] == 2);
        for (size_t k = 0; k < 3; k++)
            CHECK_NEAR(mean[3 * i + k], (h.body.reference[k] + h.body.reference[3 + 3 * rim[i] + k]) / 2, 1e-15 * 8);
    }
    free(pair);
    free(shared);
    /* every face a patch: at the hub 32 of them are looked at, which makes 31 pairs each; and those over the rim */
    for (uint32_t i = 0; i < RIM; i++) label[i] = RIM - i;
    CHECK(vgi_neighbours(m, label, &pair, &shared, &n, &e) == VG_OK);
    CHECK(n == 32 * 31 / 2 + RIM - 31);
    for (size_t i = 1; i < n; i++)
        CHECK(pair[i][0] > pair[i - 1][0] || (pair[i][0] == pair[i - 1][0] && pair[i][1] > pair[i - 1][1]));
    for (size_t i = 0; i < n; i++) CHECK(pair[i][0] < pair[i][1]);
    free(pair);
    free(shared);
    vg_head_clear(&h);
}

/* ---- triangles that turn each by itself ---- */

static vg_head make_crowd(size_t n)
{
    vg_head h = new_shape();
    for (uint32_t i = 0; i < n; i++) {
        add_vertex(&h, 3 * i, 0, 0), add_vertex(&h, 3 * i + 1, 0.2, 0), add_vertex(&h, 3 * i, 1, 0.3);
        FACE(&h, 3 * i, 3 * i + 1, 3 * i + 2);
    }
    return h;
}

/* Face f turned about its first corner by rotation[f] (9 numbers). */
static void turn_crowd(const vg_head *h, const double *rotation, double *pose)
{
    for (size_t v = 0; v < h->body.mesh.nv; v++) {
        const double *m = rotation + 9 * (v / 3), *o = h->body.reference + 3 * (v - v % 3),
                     *x = h->body.reference + 3 * v;
        for (size_t i = 0; i < 3; i++) {
            pose[3 * v + i] = o[i];
            for (size_t k = 0; k < 3; k++) pose[3 * v + i] += m[3 * i + k] * (x[k] - o[k]);
        }
    }
}

static void draw_rotation(double *m)
{
    double axis[3] = {noise(), noise(), noise()}, length = 0;
    for (int k = 0; k < 3; k++) length += axis[k] * axis[k];
    for (int k = 0; k < 3; k++) axis[k] /= sqrt(length);
    turn_about(axis, 3 * noise(), m);
}

typedef struct crowd {
    vg_head h;
    vg_segmenter *s;
    double *rotation, *pose; /* of the pose that comes next */
} crowd;

static crowd open_crowd(size_t n)
{
    vg_err e;
    crowd x = {.h = make_crowd(n), .rotation = room(9 * n, sizeof(double)), .pose = room(9 * n, sizeof(double))};
    CHECK(vg_segmenter_new(&x.s, &x.h.body.mesh, x.h.body.reference, 2, &e) == VG_OK);
    return x;
}

static void add_pose(crowd *x)
{
    const double *poses[1] = {x->pose};
    turn_crowd(&x->h, x->rotation, x->pose);
    CHECK(vg_segmenter_add(x->s, 1, poses, NULL) == VG_OK);
}

static vg_segment_stats cut_crowd(crowd *x, size_t k, uint64_t seed, vg_patches *p)
{
    vg_segment_stats report;
    vg_err e;
    CHECK(vg_segmenter_cut(x->s, k, seed, false, p, &report, &e) == VG_OK);
    CHECK(report.patches == p->n);
    uint32_t next = 0; /* every patch has faces, and they are in the order of the first ones */
    for (size_t f = 0; f < x->h.body.mesh.nf; f++) {
        CHECK(p->of_face[f] <= next);
        next += p->of_face[f] == next;
    }
    CHECK(next == p->n);
    return report;
}

static void close_crowd(crowd *x)
{
    vg_segmenter_free(&x->s);
    vg_head_clear(&x->h);
    free(x->rotation);
    free(x->pose);
}

/* Two by three groups: early poses tell one number of a face's group, late ones the other. However many poses there
 * are, all of them count; and where faces turn in six ways no more patches are made. */
static void groups_are_found(void)
{
    enum { N = 61 };
    static const size_t lengths[] = {2, 14, 15, 40, 150};
    for (size_t l = 0; l < sizeof lengths / sizeof *lengths; l++) {
        crowd x = open_crowd(N);
        uint32_t group[N], first[6], groups = 0;
        for (size_t f = 0; f < N; f++) group[f] = (uint32_t)(f * 17 % 6);
        for (size_t k = 0; k < lengths[l]; k++) {
            double m[3][9];
            for (int i = 0; i < 3; i++) draw_rotation(m[i]);
            for (size_t f = 0; f < N; f++)
                memcpy(x.rotation + 9 * f, m[2 * k < lengths[l] ? group[f] % 2 : group[f] / 2], sizeof m[0]);
            add_pose(&x);
        }
        for (size_t k = 6; k <= 9; k += 3) {
            vg_patches p;
            vg_segment_stats report = cut_crowd(&x, k, 1, &p);
            CHECK(p.n == 6);
            CHECK_NEAR(report.angle, 0, 0.1);
            groups = 0;
            for (size_t f = 0; f < N && p.n == 6; f++) {
                if (p.of_face[f] == groups) first[groups++] = group[f];
                CHECK(group[f] == first[p.of_face[f]]);
            }
            vg_patches_clear(&p);
        }
        close_crowd(&x);
    }
}

/* Half of the faces turned by a few degrees one way, half the other way: one patch has this angle, whether features
 * are kept as they are or folded; and so it is where folding without signs would add up. */
static void angles_are_kept(void)
{
    enum { N = 600 };
    static const double z[3] = {0, 0, 1};
    double folded[2][2];
    for (int large = 0; large < 2; large++)
        for (int many = 0; many < 2; many++) {
            crowd x = open_crowd(N);
            vg_patches p;
            for (size_t f = 0; f < N; f++)
                turn_about(z, large ? (f % 2 ? M_PI : 0) : (f % 2 ? 5 : -5) * M_PI / 180, x.rotation + 9 * f);
            for (int k = 0; k < (many ? 300 : 10); k++) add_pose(&x);
            folded[large][many] = cut_crowd(&x, 1, 1, &p).angle;
            vg_patches_clear(&p);
            close_crowd(&x);
        }
    CHECK_NEAR(folded[0][0], 5, 0.02);
    CHECK_NEAR(folded[0][1], 5, 0.25);
    CHECK_NEAR(folded[1][1], folded[1][0], 0.05 * folded[1][0]);
}

/* A fan of turns, continuous over 190 degrees: as few patches as turn within 10 degrees of their faces. */
static void as_few_as_will_do(void)
{
    enum { N = 400 };
    static const double z[3] = {0, 0, 1};
    crowd x = open_crowd(N);
    vg_patches p, fewer;
    for (size_t f = 0; f < N; f++) turn_about(z, 190.0 * (double)f / N * M_PI / 180, x.rotation + 9 * f);
    add_pose(&x);
    vg_segment_stats report = cut_crowd(&x, 0, 1, &p), before;
    CHECK(report.angle <= 10 && (p.n == 6 || p.n == 8));
    before = cut_crowd(&x, p.n - 2, 1, &fewer);
    CHECK(before.angle > 10 && fewer.n == p.n - 2);
    /* each patch is one stretch of the fan */
    for (size_t f = 1; f < N; f++) CHECK(p.of_face[f] == p.of_face[f - 1] || p.of_face[f] == p.of_face[f - 1] + 1);
    vg_patches_clear(&p);
    vg_patches_clear(&fewer);
    close_crowd(&x);
}

/* Faces that turn as they like: nearly all are nearest to the mean of their own patch, and every patch has some. */
static void patches_are_around_their_means(void)
{
    enum { N = 300, K = 9, POSES = 3 };
    for (uint64_t seed = 1; seed < 6; seed++) {
        crowd x = open_crowd(N);
        vg_patches p;
        double *feature = room(N * 9 * POSES, sizeof *feature), mean[K][9 * POSES] = {{0}}, count[K] = {0};
        size_t astray = 0;
        for (size_t k = 0; k < POSES; k++) {
            for (size_t f = 0; f < N; f++) {
                draw_rotation(x.rotation + 9 * f);
                memcpy(feature + 9 * (POSES * f + k), x.rotation + 9 * f, 9 * sizeof *feature);
            }
            add_pose(&x);
        }
        cut_crowd(&x, K, seed, &p);
        CHECK(p.n == K);
        for (size_t f = 0; f < N; f++) {
            count[p.of_face[f]]++;
            for (size_t i = 0; i < 9 * POSES; i++) mean[p.of_face[f]][i] += feature[9 * POSES * f + i];
        }
        for (size_t f = 0; f < N; f++) {
            double least = INFINITY;
            size_t best = 0;
            for (size_t k = 0; k < K; k++) {
                double d = 0;
                for (size_t i = 0; i < 9 * POSES; i++)
                    d += pow(feature[9 * POSES * f + i] - mean[k][i] / count[k], 2);
                if (d < least) least = d, best = k;
            }
            astray += best != p.of_face[f];
        }
        CHECK(astray <= N / 50);
        vg_patches_clear(&p);
        free(feature);
        close_crowd(&x);
    }
}

/* What the sum of squared distances of members from their means grows by when two sets are joined: from the members.
 * */
static double growth(const double *x, const double *count, const uint32_t *set, size_t n, uint32_t a, uint32_t b)
{
    double square[3] = {0, 0, 0};
    for (int which = 0; which < 3; which++) { /* a, b, both */
        double mean[2] = {0, 0}, sum = 0;
        for (int pass = 0; pass < 2; pass++)
            for (size_t i = 0; i < n; i++) {
                if (!(which != 1 && set[i] == a) && !(which != 0 && set[i] == b)) continue;
                if (pass == 0) sum += count[i];
                for (size_t k = 0; k < 2; k++) {
                    double d = x[2 * i + k] - mean[k] / sum;
                    if (pass == 0) mean[k] += count[i] * x[2 * i + k];
                    else square[which] += count[i] * d * d;
                }
            }
    }
    return square[2] - square[0] - square[1];
}

/* On a graph by chance of some parts: the pieces are those that trying all pairs again after each union gives. */
static void joins_are_the_cheapest(void)
{
    enum { N = 40, PAIRS = 90 };
    for (int trial = 0; trial < 20; trial++) {
        double x[2 * N], mean[2 * N], count[N], size[N];
        uint32_t pair[PAIRS][2], truth[N], set[N];
        vg_err e;
        vgi_joining j = {.n = N, .width = 2, .mean = mean, .size = size, .pair = pair};
        for (size_t i = 0; i < N; i++) count[i] = size[i] = 1 + floor(3 * (noise() + 1)), truth[i] = (uint32_t)i;
        for (size_t i = 0; i < 2 * N; i++) x[i] = mean[i] = noise();
        for (uint32_t b = 1; b < N; b++) /* no pair joins what is left and right of 8 */
            for (uint32_t a = 0; a < b; a++)
                if (j.npairs < PAIRS && (a < 8) == (b < 8) && noise() > 0.8)
                    pair[j.npairs][0] = a, pair[j.npairs++][1] = b;
        size_t left = N, want = trial < 2 ? 1 : 2 + (size_t)trial, all = j.npairs;
        uint32_t kept[PAIRS][2];
        memcpy(kept, pair, sizeof kept);
        for (;;) {
            uint32_t best[2] = {0, 0};
            double least = INFINITY;
            for (size_t p = 0; p < all && left > want; p++) {
                uint32_t a = truth[kept[p][0]], b = truth[kept[p][1]];
                double cost = a != b ? growth(x, count, truth, N, a, b) : INFINITY;
                if (cost < least) least = cost, best[0] = a < b ? a : b, best[1] = a < b ? b : a;
            }
            if (!(least < INFINITY)) break;
            for (size_t i = 0; i < N; i++)
                if (truth[i] == best[1]) truth[i] = best[0];
            left--;
        }
        CHECK(vgi_join_pieces(&j, want, set, &e) == VG_OK);
        for (size_t i = 0; i < N; i++) CHECK(set[i] == truth[i]);
    }
}

TESTS({"nearest rotations", nearest_rotations}, {"thirds of a strip", thirds},
      {"groups are found", groups_are_found}, {"angles are kept", angles_are_kept},
      {"as few as will do", as_few_as_will_do}, {"patches are around their means", patches_are_around_their_means},
      {"pieces and neighbours", pieces},
      {"sectors of a fan meet", sectors_meet}, {"joins are the cheapest", joins_are_the_cheapest})
