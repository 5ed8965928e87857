/* test_carry: transfer along a correspondence, by shape, by gradients, and the area metric, against what they must
 * be.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/pairs/transfer_kernel.h"
#include "method/vectors/metric.h"
#include "test.h"
#include "meshes.h"

/* Every target face driven by `each` source faces, chosen by chance. */
static vg_correspondence chance_pairs(const vg_mesh *source, const vg_mesh *target, uint32_t each, bool matched)
{
    vg_correspondence k = {.source_nv = source->nv, .source_nf = source->nf, .source_digest = vg_mesh_digest(source),
                           .target_nv = target->nv, .target_nf = target->nf, .target_digest = vg_mesh_digest(target)};
    size_t nf = target->nf;
    k.first = room(nf + 1, sizeof *k.first);
    k.source = room(nf * each, sizeof *k.source);
    k.weight = room(nf * each, sizeof *k.weight);
    k.distance = room(nf, sizeof *k.distance);
    k.matched = room(nf, 1);
    for (size_t f = 0; f < nf; f++) {
        k.first[f + 1] = k.first[f] + each;
        k.matched[f] = matched;
        for (uint32_t i = 0; i < each; i++) {
            k.source[f * each + i] = (uint32_t)((noise() + 1) / 2 * (double)source->nf) % (uint32_t)source->nf;
            k.weight[f * each + i] = 1.0 / each;
        }
    }
    return k;
}

static vg_correspondence identity_pairs(const vg_mesh *m)
{
    vg_correspondence k = chance_pairs(m, m, 1, true);
    for (size_t f = 0; f < m->nf; f++) k.source[f] = (uint32_t)f;
    return k;
}

typedef struct carried {
    vg_graph *g;
    double *vectors, *expected; /* expected: the target's reference vectors */
} carried;

/* The target's wanted vectors for one pose of the source. */
static carried carry(const vg_head *source, vg_head *target, const vg_correspondence *k, const double *pose,
                     vg_method by, int threads)
{
    vg_err e;
    vg_cross_transfer *c;
    carried r = {.g = graph_of(target)};
    r.expected = vectors_of(r.g, target->body.reference);
    r.vectors = room(3 * vg_graph_corners(r.g), sizeof *r.vectors);
    int code = vg_cross_transfer_new(&c, &source->body.mesh, source->body.reference, k, r.g, target->body.reference, by,
                              threads, &e);
    CHECK(code == VG_OK);
    if (code < 0) abort();
    const double *in[3] = {pose, pose, pose};
    double *spare = room(3 * vg_graph_corners(r.g), sizeof *spare), *out[3] = {spare, spare, r.vectors};
    vg_cross_transfer_apply(c, 3, in, out);
    free(spare);
    vg_cross_transfer_free(&c);
    return r;
}

static void carried_clear(carried *r)
{
    vg_graph_free(&r->g);
    free(r->vectors);
    free(r->expected);
}

static const vg_method methods[] = {VG_BY_POSE, VG_BY_GRADIENT, VG_BY_BLEND, VG_BY_OFFSET};
enum { METHODS = sizeof methods / sizeof *methods };

/* A source that only turns turns every target by the same rotation, whatever drives what. */
static void rotation_passes(void)
{
    /* a line segment of the source would not tell its turn */
    vg_head source = make_torus(7, 6), target = make_mixed(6);
    vg_correspondence k = chance_pairs(&source.body.mesh, &target.body.mesh, 3, true);
    motion t = turn(2.5, 1, 3);
    double *pose = move_points(&t, source.body.reference, source.body.mesh.nv);
    for (int i = 0; i < METHODS; i++) {
        carried r = carry(&source, &target, &k, pose, methods[i], 1);
        double worst = 0;
        for (size_t c = 0; c < vg_graph_corners(r.g); c++) {
            double w[3];
            move_vector(&t, r.expected + 3 * c, w);
            for (size_t a = 0; a < 3; a++) worst = fmax(worst, fabs(w[a] - r.vectors[3 * c + a]));
        }
        CHECK_NEAR(worst, 0, 1e-12 * vg_diagonal(target.body.reference, target.body.mesh.nv));
        carried_clear(&r);
    }
    free(pose);
    vg_correspondence_clear(&k);
    vg_head_clear(&source);
    vg_head_clear(&target);
}

/* A mesh paired with itself goes corner by corner: any pose comes back, bent polygons, pieces and all. */
static void identity_is_exact(void)
{
    vg_head all[] = {make_pieces(), make_rod(9, 7, false), make_flower(9)};
    for (int n = 0; n < 3; n++) {
        vg_head *h = &all[n];
        vg_correspondence k = identity_pairs(&h->body.mesh);
        double *pose = warp(h->body.reference, h->body.mesh.nv, 0.3);
        for (int i = 0; i < METHODS; i++) {
            carried r = carry(h, h, &k, pose, methods[i], 2);
            double *truth = vectors_of(r.g, pose);
            CHECK_NEAR(farthest(truth, r.vectors, vg_graph_corners(r.g)), 0,
                       1e-12 * vg_diagonal(pose, h->body.mesh.nv));
            free(truth);
            carried_clear(&r);
        }
        free(pose);
        vg_correspondence_clear(&k);
        vg_head_clear(h);
    }
}

/* Triangles driven by themselves twice, so that one map serves all corners:
 * the gradient is the map of the triangle, and exact. */
static void triangles_onto_themselves(void)
{
    vg_head h = make_rod(9, 7, true);
    vg_correspondence k = chance_pairs(&h.body.mesh, &h.body.mesh, 2, true);
    for (size_t f = 0; f < h.body.mesh.nf; f++) k.source[2 * f] = k.source[2 * f + 1] = (uint32_t)f;
    double *pose = warp(h.body.reference, h.body.mesh.nv, 0.3);
    for (int i = 0; i < METHODS; i++) {
        carried r = carry(&h, &h, &k, pose, methods[i], 2);
        double *truth = vectors_of(r.g, pose), worst = 0, length = 0;
        for (size_t f = 0; f < h.body.mesh.nf; f++) {
            if (h.body.mesh.start[f + 1] - h.body.mesh.start[f] != 3) continue;
            for (size_t c = 3 * (size_t)h.body.mesh.start[f]; c < 3 * (size_t)h.body.mesh.start[f + 1]; c++)
                worst = fmax(worst, fabs(truth[c] - r.vectors[c])), length = fmax(length, fabs(truth[c]));
        }
        if (methods[i] == VG_BY_GRADIENT || methods[i] == VG_BY_OFFSET) CHECK_NEAR(worst, 0, 1e-12);
        else CHECK(worst < 0.2 * length && worst > 1e-6); /* one rotation a face, not one a corner: close */
        free(truth);
        carried_clear(&r);
    }
    free(pose);
    vg_correspondence_clear(&k);
    vg_head_clear(&h);
}

/* A face without a match of its own turns, but keeps its size when the source grows. */
static void unmatched_is_rigid(void)
{
    vg_head source = make_torus(8, 6), target = make_torus(5, 5);
    motion t = turn(1, 2, 0), plain = turn(1, 1, 0);
    double *pose = move_points(&t, source.body.reference, source.body.mesh.nv);
    for (int matched = 0; matched < 2; matched++) {
        vg_correspondence k = chance_pairs(&source.body.mesh, &target.body.mesh, 2, matched);
        carried r = carry(&source, &target, &k, pose, VG_BY_POSE, 1);
        double worst = 0;
        for (size_t c = 0; c < vg_graph_corners(r.g); c++) {
            double w[3], d2 = 0, w2 = 0;
            move_vector(&plain, r.expected + 3 * c, w);
            for (size_t a = 0; a < 3; a++) {
                worst = fmax(worst, matched ? 0 : fabs(w[a] - r.vectors[3 * c + a]));
                d2 += r.vectors[3 * c + a] * r.vectors[3 * c + a], w2 += w[a] * w[a];
            }
            /* matched: directions in the source's planes are doubled, those across are not */
            if (matched) CHECK(sqrt(d2 / w2) > 1 - 1e-9 && sqrt(d2 / w2) < 2 + 1e-9);
        }
        CHECK_NEAR(worst, 0, 1e-12);
        carried_clear(&r);
        vg_correspondence_clear(&k);
    }
    free(pose);
    vg_head_clear(&source);
    vg_head_clear(&target);
}

typedef struct offsets_trial {
    double a, b;      /* the target is the source's flat sheet, stretched by diag(a, b), which is also how it was fitted */
    double size;      /* of motions on it; 0: the ratio of the two sizes */
    double p, q;      /* the pose stretches the source by diag(p, q) */
    double angle;     /* and turns it about x */
    bool mixed;       /* the poses may be sums of shapes */
} offsets_trial;

/* The vectors of the target in the source's size are those of the source, scaled by `size`, and what they grow by in the pose
 * is added to the target's. Returns how far the gradient's answer is from that. */
static double check_offsets(const offsets_trial *o)
{
    double c = cos(o->angle), s = sin(o->angle), worst = 0, affine = 0;
    vg_head h = make_uneven_sheet(6, 1, 1), other = make_uneven_sheet(6, o->a, o->b);
    size_t nv = h.body.mesh.nv;
    vg_correspondence k = chance_pairs(&h.body.mesh, &other.body.mesh, 2, true);
    for (size_t f = 0; f < h.body.mesh.nf; f++) k.source[2 * f] = k.source[2 * f + 1] = (uint32_t)f;
    vg_graph *g = graph_of(&other);
    double *t = vectors_of(g, other.body.reference), *r = vectors_of(g, h.body.reference), *w = room(3 * vg_graph_corners(g), sizeof *w);
    double *pose = room(3 * nv, sizeof *pose);
    double size = o->size > 0 ? o->size : vg_diagonal(other.body.reference, nv) / vg_diagonal(h.body.reference, nv);
    for (size_t v = 0; v < nv; v++) {
        double y = o->q * h.body.reference[3 * v + 1];
        memcpy(pose + 3 * v, (double[]){o->p * h.body.reference[3 * v], c * y, s * y}, 3 * sizeof *pose);
    }
    vg_cross_transfer *x;
    vg_err e;
    CHECK(vg_cross_transfer_new(&x, &h.body.mesh, h.body.reference, &k, g, other.body.reference, VG_BY_OFFSET, 1, &e) == VG_OK);
    CHECK(vg_cross_transfer_fitted(x, other.body.reference, other.body.reference, o->mixed, &e) == VG_OK);
    const double *in = pose;
    vg_cross_transfer_apply(x, 1, &in, &w);
    for (size_t i = 0; i < 3 * vg_graph_corners(g); i += 3) {
        double along = size * o->q * r[i + 1], off = t[i + 1] - size * r[i + 1];
        double want[3] = {t[i] + size * (o->p - 1) * r[i], c * (along + off), s * (along + off)};
        for (size_t l = 0; l < 3; l++) worst = fmax(worst, fabs(w[i + l] - want[l]));
        affine = fmax(affine, fabs(want[0] - o->p * t[i]));
    }
    CHECK_NEAR(worst, 0, 1e-12 * size);
    vg_cross_transfer_free(&x);
    free(t), free(r), free(w), free(pose);
    vg_graph_free(&g);
    vg_correspondence_clear(&k);
    vg_head_clear(&h), vg_head_clear(&other);
    return affine;
}

static void offset_adds_growth(void)
{
    const offsets_trial o = {.a = 0.5, .b = 0.9, .p = 1.6, .q = 0.7, .angle = acos(0.6)};
    CHECK(check_offsets(&o) > 0.01);
}

/* Motions keep their size where two people share a unit, and take a power of ten where they do not; two copies of one shape have
 * the ratio itself. What the target differs by turns with the whole body, by any angle. */
static void expressions(void)
{
    static const offsets_trial trials[] = {{0.9, 0.95, 1, 1.2, 0.9, M_PI / 6, true},
                                           {0.9, 0.95, 1, 1.2, 0.9, M_PI / 2, true},
                                           {90, 95, 100, 1.2, 0.9, M_PI / 6, true},
                                           {1.1, 1.1, 1.1, 1.2, 0.9, M_PI / 6, true}};
    for (size_t i = 0; i < sizeof trials / sizeof *trials; i++) (void)check_offsets(&trials[i]);
}

static void threads_do_not_matter(void)
{
    vg_head source = make_torus(40, 30), target = make_mixed(24);
    vg_correspondence k = chance_pairs(&source.body.mesh, &target.body.mesh, 3, true);
    double *pose = warp(source.body.reference, source.body.mesh.nv, 0.4);
    carried a = carry(&source, &target, &k, pose, VG_BY_BLEND, 1),
            b = carry(&source, &target, &k, pose, VG_BY_BLEND, 3);
    CHECK(!memcmp(a.vectors, b.vectors, 3 * vg_graph_corners(a.g) * sizeof *a.vectors));
    carried_clear(&a);
    carried_clear(&b);
    free(pose);
    vg_correspondence_clear(&k);
    vg_head_clear(&source);
    vg_head_clear(&target);
}

static void degenerate_sources_are_counted(void)
{
    vg_head source = make_degenerate(), target = make_torus(6, 5);
    vg_correspondence k = chance_pairs(&source.body.mesh, &target.body.mesh, 1, true);
    vg_graph *g = graph_of(&target);
    vg_cross_transfer *c;
    vg_err e;
    double *out = room(3 * vg_graph_corners(g), sizeof *out);
    CHECK(vg_cross_transfer_new(&c, &source.body.mesh, source.body.reference, &k, g, target.body.reference, VG_BY_POSE, 1,
                         &e) == VG_OK);
    const double *in = source.body.reference;
    vg_cross_transfer_apply(c, 1, &in, &out);
    CHECK(vg_cross_transfer_get_stats(c).corners > 0 && vg_cross_transfer_get_stats(c).first_face < source.body.mesh.nf);
    for (size_t i = 0; i < 3 * vg_graph_corners(g); i++) CHECK(isfinite(out[i]));
    free(out);
    vg_cross_transfer_free(&c);
    vg_graph_free(&g);
    vg_correspondence_clear(&k);
    vg_head_clear(&source);
    vg_head_clear(&target);
}

/* Cycles of the target that begin elsewhere: corners find one another by where they are. */
static void cycles_find_their_beginning(void)
{
    vg_head source = make_rod(9, 7, false), target = make_rod(9, 7, false);
    for (size_t f = 0; f < target.body.mesh.nf; f++) {
        uint32_t begin = target.body.mesh.start[f], r = target.body.mesh.start[f + 1] - begin;
        for (uint32_t i = 0; i < r; i++)
            target.body.mesh.vert[begin + i] = source.body.mesh.vert[begin + (i + f) % r];
    }
    vg_correspondence k = identity_pairs(&source.body.mesh);
    k.target_digest = vg_mesh_digest(&target.body.mesh);
    double *pose = warp(source.body.reference, source.body.mesh.nv, 0.3);
    for (int i = 0; i < METHODS; i++) {
        carried r = carry(&source, &target, &k, pose, methods[i], 1);
        double *truth = vectors_of(r.g, pose);
        CHECK_NEAR(farthest(truth, r.vectors, vg_graph_corners(r.g)), 0,
                   1e-12 * vg_diagonal(pose, source.body.mesh.nv));
        free(truth);
        carried_clear(&r);
    }
    free(pose);
    vg_correspondence_clear(&k);
    vg_head_clear(&source);
    vg_head_clear(&target);
}

/* Two rings that turn against one another and part; the target is twice as large. Its link takes the mean of both
 * turns, and what the rings do beyond that: w0 - w1 = D (r0 - r1) + 2 ((c0' - c1') - D (c0 - c1)), c the middle of
 * the source's faces around an end. */
static void links_follow_both_ends(void)
{
    vg_head source = new_shape(), target = new_shape();
    for (vg_head *h = &source; h; h = h == &source ? &target : NULL) {
        add_torus(h, 9, 6, (double[3]){0, 0, 0});
        add_torus(h, 9, 6, (double[3]){3, 1, 0.5});
    }
    size_t nv = source.body.mesh.nv, ring = nv / 2;
    for (size_t i = 0; i < 3 * nv; i++) target.body.reference[i] *= 2;
    motion t[2] = {turn(0.7, 1, 0.2), turn(-0.4, 1, -0.6)};
    double *pose = room(3 * nv, sizeof *pose);
    for (size_t v = 0; v < nv; v++) {
        move_vector(&t[v >= ring], source.body.reference + 3 * v, pose + 3 * v);
        for (size_t i = 0; i < 3; i++) pose[3 * v + i] += t[v >= ring].shift[i];
    }
    vg_correspondence k =
        chance_pairs(&source.body.mesh, &target.body.mesh, 2, true); /* two: no corners are paired */
    for (uint32_t f = 0; f < source.body.mesh.nf; f++) k.source[2 * f] = k.source[2 * f + 1] = f;
    carried r = carry(&source, &target, &k, pose, VG_BY_GRADIENT, 1);
    CHECK(r.g->nlinks == 1);
    const uint32_t *end = r.g->faces.vert + r.g->faces.start[r.g->faces.nf - 1];
    const double *w = r.vectors + 3 * (size_t)r.g->faces.start[r.g->faces.nf - 1];
    double c[2][2][3] = {{{0}}}; /* of both ends: before, now */
    for (int n = 0; n < 2; n++)
        for (size_t f = 0, faces = 4; f < source.body.mesh.nf; f++) {
            const uint32_t *vert = source.body.mesh.vert + 4 * f;
            if (vert[0] != end[n] && vert[1] != end[n] && vert[2] != end[n] && vert[3] != end[n]) continue;
            for (size_t i = 0; i < 12; i++) {
                c[n][0][i % 3] += source.body.reference[3 * (size_t)vert[i / 3] + i % 3] / (4.0 * (double)faces);
                c[n][1][i % 3] += pose[3 * (size_t)vert[i / 3] + i % 3] / (4.0 * (double)faces);
            }
        }
    for (size_t i = 0; i < 3; i++) {
        double wanted = 2 * (c[0][1][i] - c[1][1][i]);
        for (size_t j = 0; j < 3; j++) {
            double D = (t[0].m[3 * i + j] + t[1].m[3 * i + j]) / 2, apart = c[0][0][j] - c[1][0][j];
            wanted += D * (target.body.reference[3 * end[0] + j] - target.body.reference[3 * end[1] + j] - 2 * apart);
        }
        CHECK_NEAR(w[i] - w[3 + i], wanted, 1e-12);
        CHECK_NEAR(w[i] + w[3 + i], 0, 1e-12);
    }
    free(pose);
    vg_correspondence_clear(&k);
    carried_clear(&r);
    vg_head_clear(&source);
    vg_head_clear(&target);
}

/* A source face that is a point in a pose drives nothing there: the other one does. */
static void points_drive_nothing(void)
{
    vg_head source = new_shape(), target = new_shape();
    for (uint32_t i = 0; i < 2; i++) {
        add_vertex(&source, 0, 3 * i, 0), add_vertex(&source, 1, 3 * i, 0), add_vertex(&source, 0, 3 * i + 1, 0.2);
        FACE(&source, 3 * i, 3 * i + 1, 3 * i + 2);
    }
    add_vertex(&target, 0, 0, 0), add_vertex(&target, 1, 0, 1), add_vertex(&target, 0, 1, 0);
    FACE(&target, 0, 1, 2);
    motion t = turn(0.9, 1, 0);
    double *pose = move_points(&t, source.body.reference, 6);
    memcpy(pose + 12, pose + 9, 3 * sizeof *pose);
    memcpy(pose + 15, pose + 9, 3 * sizeof *pose);
    vg_correspondence k = chance_pairs(&source.body.mesh, &target.body.mesh, 2, true);
    k.source[0] = 0, k.source[1] = 1;
    for (int i = 0; i < METHODS; i++) {
        carried r = carry(&source, &target, &k, pose, methods[i], 1);
        for (size_t c = 0; c < 3; c++) {
            double w[3];
            move_vector(&t, r.expected + 3 * c, w);
            for (size_t a = 0; a < 3; a++) CHECK_NEAR(r.vectors[3 * c + a], w[a], 1e-12);
        }
        carried_clear(&r);
    }
    free(pose);
    vg_correspondence_clear(&k);
    vg_head_clear(&source);
    vg_head_clear(&target);
}

static void other_meshes_are_refused(void)
{
    vg_head a = make_torus(6, 5), b = make_torus(5, 6);
    vg_correspondence k = identity_pairs(&a.body.mesh);
    vg_graph *ga = graph_of(&a), *gb = graph_of(&b);
    vg_cross_transfer *c;
    vg_err e;
    CHECK(vg_cross_transfer_new(&c, &b.body.mesh, b.body.reference, &k, ga, a.body.reference, VG_BY_POSE, 1, &e) ==
              VG_EINPUT &&
          !c);
    CHECK(strstr(e.message, "another source") != NULL);
    CHECK(vg_cross_transfer_new(&c, &a.body.mesh, a.body.reference, &k, gb, b.body.reference, VG_BY_POSE, 1, &e) ==
              VG_EINPUT &&
          !c);
    CHECK(strstr(e.message, "another target") != NULL);
    vg_graph_free(&ga);
    vg_graph_free(&gb);
    vg_correspondence_clear(&k);
    vg_head_clear(&a);
    vg_head_clear(&b);
}

/* R S with a known rotation and a known symmetric positive stretch: the polar rotation is R. */
static void polar_finds_the_rotation(void)
{
    vgi_map a, r;
    double truth[VGI_LANES][9];
    for (int lane = 0; lane < VGI_LANES; lane++) {
        double q[4], s[9], v[3] = {noise(), noise(), noise()}, length = 0;
        for (int i = 0; i < 4; i++) q[i] = noise(), length += q[i] * q[i];
        for (int i = 0; i < 4; i++) q[i] /= sqrt(length);
        vg_quat_matrix(q, truth[lane]);
        /* stretches from mild to 10^6 : 1 */
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                s[3 * i + j] = (i == j ? pow(10, -lane * 0.7 * (i == 2)) : 0) + (lane < 3 ? v[i] * v[j] : 0);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                double x = 0;
                for (int k = 0; k < 3; k++) x += truth[lane][3 * i + k] * s[3 * k + j];
                a.m[3 * i + j][lane] = x;
            }
    }
    vgi_transfer_kernel_now()->polar(&a, &r);
    for (int lane = 0; lane < VGI_LANES; lane++)
        for (int i = 0; i < 9; i++) CHECK_NEAR(r.m[i][lane], truth[lane][i], 1e-9);
}

static double determinant(const double m[9])
{
    return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
           m[2] * (m[3] * m[7] - m[4] * m[6]);
}

/* What opposite turns leave of one another when they are averaged: flat, thin, inside out, nothing. It is a rotation
 * all the same, and of all rotations none is nearer; a sound matrix in the next lane is not disturbed. */
static void polar_of_what_cancels(void)
{
    static const double left[VGI_LANES][3] = {{1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {-1. / 3, -1. / 3, -1. / 3},
                                              {1, 1, -.5}, {.2, 1e-9, -.1}, {1, -1e-14, .5}, {2, 1, .5}};
    vgi_map a, r;
    double m[VGI_LANES][9];
    for (int lane = 0; lane < VGI_LANES; lane++) {
        double q[4], u[9], length = 0;
        for (int i = 0; i < 4; i++) q[i] = noise(), length += q[i] * q[i];
        for (int i = 0; i < 4; i++) q[i] /= sqrt(length);
        vg_quat_matrix(q, u);
        for (int i = 0; i < 9; i++) {
            m[lane][i] = 0;
            for (int k = 0; k < 3; k++) m[lane][i] += u[3 * (i / 3) + k] * left[lane][k] * u[3 * (i % 3) + k];
            a.m[i][lane] = m[lane][i];
        }
    }
    vgi_transfer_kernel_now()->polar(&a, &r);
    for (int lane = 0; lane < VGI_LANES; lane++) {
        double one[9], trace = 0;
        for (int i = 0; i < 9; i++) one[i] = r.m[i][lane], trace += one[i] * m[lane][i];
        CHECK_NEAR(determinant(one), 1, 1e-12);
        for (int i = 0; i < 9; i++) {
            double dot = 0;
            for (int k = 0; k < 3; k++) dot += one[3 * (i / 3) + k] * one[3 * (i % 3) + k];
            CHECK_NEAR(dot, i % 4 == 0, 1e-12);
        }
        for (int trial = 0; trial < 1000; trial++) {
            double q[4], other[9], length = 0, its = 0;
            for (int i = 0; i < 4; i++) q[i] = noise(), length += q[i] * q[i];
            for (int i = 0; i < 4; i++) q[i] /= sqrt(length);
            vg_quat_matrix(q, other);
            for (int i = 0; i < 9; i++) its += other[i] * m[lane][i];
            CHECK(its <= trace + 1e-12);
        }
    }
}

/* A sheet that is folded flat: a target face across the crease is driven by two faces whose turns are opposite. */
static void a_fold_is_finite(void)
{
    vg_head source = new_shape(), target = new_shape();
    for (vg_head *h = &source; h; h = h == &source ? &target : NULL) {
        add_vertex(h, 0, 0, 0), add_vertex(h, 1, 0, 0), add_vertex(h, .5, 1, 0);
        if (h == &source) add_vertex(h, .5, -1, 0), FACE(h, 0, 1, 2), FACE(h, 1, 0, 3);
        else FACE(h, 0, 1, 2);
    }
    double fold[12];
    memcpy(fold, source.body.reference, sizeof fold);
    fold[10] = 1;
    for (int matched = 0; matched < 2; matched++) {
        vg_correspondence k = chance_pairs(&source.body.mesh, &target.body.mesh, 2, matched);
        k.source[0] = 0, k.source[1] = 1;
        for (int i = 0; i < METHODS; i++) {
            carried r = carry(&source, &target, &k, fold, methods[i], 1);
            for (size_t c = 0; c < vg_graph_corners(r.g); c++) {
                double d2 = 0, w2 = 0;
                for (size_t x = 3 * c; x < 3 * c + 3; x++)
                    d2 += r.vectors[x] * r.vectors[x], w2 += r.expected[x] * r.expected[x];
                if (matched) CHECK(d2 <= w2 * (1 + 1e-12)); /* a mean of turns stretches nothing */
                else CHECK_NEAR(d2, w2, 1e-12);
                CHECK_NEAR(r.vectors[3 * c], r.expected[3 * c], matched ? 1 : 1e-12); /* along the crease */
            }
            carried_clear(&r);
        }
        vg_correspondence_clear(&k);
    }
    vg_head_clear(&source);
    vg_head_clear(&target);
}

/* On triangles whose smaller moment is at least a twelfth of the larger the area metric is the cotangent Laplacian:
 * G_ij = -cot(opposite angle) / 2 times one and the same number. The sum of the moments is a third of the sum of the
 * squared sides, their product 4/3 of the squared area. */
static bool is_thin(double p[3][3])
{
    double sum = 0, a[3], b[3], cross[3], product = 0;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) sum += pow(p[i][k] - p[(i + 1) % 3][k], 2) / 3;
    for (int k = 0; k < 3; k++) a[k] = p[1][k] - p[0][k], b[k] = p[2][k] - p[0][k];
    for (int k = 0; k < 3; k++) cross[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    for (int k = 0; k < 3; k++) product += cross[k] * cross[k] / 3;
    double root = sqrt(fmax(sum * sum - 4 * product, 0));
    return 12 * (sum - root) < sum + root;
}

static void area_metric_is_cotangents(void)
{
    double ratio = 0;
    for (int trial = 0; trial < 50; trial++) {
        vg_head h = new_shape();
        double p[3][3];
        do
            for (int i = 0; i < 9; i++) p[i / 3][i % 3] = noise();
        while (is_thin(p));
        for (int i = 0; i < 3; i++) add_vertex(&h, p[i][0], p[i][1], p[i][2]);
        add_face(&h, 3, (uint32_t[]){0, 1, 2});
        vg_graph *g = graph_of(&h);
        vgi_metric m;
        vg_err e;
        CHECK(vgi_metric_make(&m, g, h.body.reference, &e) == VG_OK);
        for (int o = 0; o < 3; o++) { /* o: the corner opposite the pair i, j */
            int i = (o + 1) % 3, j = (o + 2) % 3;
            double a[3], b[3], dot = 0, cross[3], area, x = -m.face[0].weight / 3;
            for (int k = 0; k < 3; k++) a[k] = p[i][k] - p[o][k], b[k] = p[j][k] - p[o][k], dot += a[k] * b[k];
            for (int k = 0; k < 3; k++) cross[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
            area = sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
            const double *s = m.face[0].s, *u = m.plane + 3 * i, *v = m.plane + 3 * j;
            x += u[0] * (s[0] * v[0] + s[1] * v[1] + s[2] * v[2]) + u[1] * (s[1] * v[0] + s[3] * v[1] + s[4] * v[2]) +
                 u[2] * (s[2] * v[0] + s[4] * v[1] + s[5] * v[2]);
            double cot = -dot / area / 2;
            if (trial == 0 && o == 0) ratio = x / cot;
            CHECK_NEAR(x, ratio * cot, 1e-9 * (1 + fabs(x)));
        }
        vgi_metric_clear(&m);
        vg_graph_free(&g);
        vg_head_clear(&h);
    }
    CHECK(ratio > 0);
}

/* By shape a mesh onto itself is the pose. */
static void shape_onto_itself(void)
{
    vg_head h = make_rod(11, 13, false);
    vg_graph *g = graph_of(&h);
    vg_shaper *s;
    vg_err e;
    CHECK(vg_shaper_new(&s, g, h.body.reference, h.body.reference, 2, &e) == VG_OK);
    double *pose = warp(h.body.reference, h.body.mesh.nv, 0.5), *out = room(3 * h.body.mesh.nv, sizeof *out);
    const double *in = pose;
    vg_shaper_transfer(s, 1, &in, &out);
    CHECK_NEAR(farthest(pose, out, h.body.mesh.nv), 0, 1e-12 * vg_diagonal(pose, h.body.mesh.nv));
    vg_shaper_free(&s);
    free(pose);
    free(out);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

/* The reference pose of the source gives the target's own reference, exactly where corners agree. */
static void shape_of_the_reference(void)
{
    vg_head h = make_torus(12, 9);
    motion t = turn(0, 1.5, 0);
    double *target = move_points(&t, h.body.reference, h.body.mesh.nv), *out = room(3 * h.body.mesh.nv, sizeof *out);
    vg_graph *g = graph_of(&h);
    vg_shaper *s;
    vg_err e;
    CHECK(vg_shaper_new(&s, g, h.body.reference, target, 1, &e) == VG_OK);
    const double *in = h.body.reference;
    vg_shaper_transfer(s, 1, &in, &out);
    /* vectors are the target's, centroids the source's: each vertex is the mean of C_f + 1.5 w_c over its corners */
    double *truth = room(3 * h.body.mesh.nv, sizeof *truth), *count = room(h.body.mesh.nv, sizeof *count);
    double *w = vectors_of(g, h.body.reference);
    for (size_t c = 0; c < vg_graph_corners(g); c++) {
        size_t v = g->faces.vert[c];
        count[v]++;
        for (size_t k = 0; k < 3; k++) truth[3 * v + k] += h.body.reference[3 * v + k] + 0.5 * w[3 * c + k];
    }
    for (size_t v = 0; v < h.body.mesh.nv; v++)
        for (size_t k = 0; k < 3; k++) truth[3 * v + k] /= count[v];
    CHECK_NEAR(farthest(truth, out, h.body.mesh.nv), 0, 1e-12);
    vg_shaper_free(&s);
    vg_graph_free(&g);
    free(target);
    free(out);
    free(truth);
    free(count);
    free(w);
    vg_head_clear(&h);
}

TESTS({"a turning source turns every target", rotation_passes},
      {"a mesh paired with itself comes back exactly", identity_is_exact},
      {"triangles onto themselves by gradients are exact", triangles_onto_themselves},
      {"unmatched faces are rigid", unmatched_is_rigid},
      {"by offset a sheet grows as the source does", offset_adds_growth},
      {"the thread count changes no bit", threads_do_not_matter},
      {"degenerate source faces are counted and drive nothing", degenerate_sources_are_counted},
      {"cycles find their beginning", cycles_find_their_beginning},
      {"links follow both ends", links_follow_both_ends}, {"points drive nothing", points_drive_nothing},
      {"a correspondence of other meshes is refused", other_meshes_are_refused},
      {"the polar rotation of R S is R", polar_finds_the_rotation},
      {"the polar rotation of what is no rotation is one", polar_of_what_cancels},
      {"a sheet folded flat drives a face across the crease", a_fold_is_finite},
      {"the area metric of triangles that are not thin is the cotangent Laplacian", area_metric_is_cotangents},
      {"by shape: a mesh onto itself is its pose", shape_onto_itself},
      {"by shape: vectors of the target at centroids of the source", shape_of_the_reference},
      {"expressions are added", expressions})
