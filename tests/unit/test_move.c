/* test_move.c: where the whole body goes and which vertices stay when a motion is carried over, counted vertex by
 * vertex.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "meshes.h"

/* ---- where the body goes ---- */

/* A torus with two isolated vertices, and the same twice as large and elsewhere. */
static void moved(bool stay, double times)
{
    static const uint32_t anchors[] = {2, 7};
    vg_head h = make_torus(7, 5);
    add_isolated(&h);
    vg_graph *g = graph_of(&h);
    motion far = turn(0, 2, 3), step = turn(0.4, 1, 5);
    double *target = move_points(&far, h.body.reference, g->faces.nv), *pose = move_points(&step, h.body.reference, g->faces.nv);
    double roots[3][3], *at, *to;
    vg_frame in = {0}, out = {0};
    vg_mover *m;
    vg_err e;
    CHECK(vg_frame_make_anchors(&in, 2, &at, &e) == VG_OK && vg_frame_make_anchors(&out, 2, &to, &e) == VG_OK);
    CHECK(vg_mover_new(&m, g, h.body.reference, g, target, anchors, 2, stay, &e) == VG_OK);
    vg_graph_root(g, h.body.reference, roots[0]), vg_graph_root(g, target, roots[1]),
        vg_graph_root(g, pose, roots[2]);
    memcpy(in.root, roots[2], sizeof in.root);
    vg_graph_anchors(pose, anchors, 2, at);
    vg_mover_move(m, &in, &out);
    for (size_t k = 0; k < 3; k++) {
        CHECK_NEAR(out.root[k], roots[1][k] + times * (roots[2][k] - roots[0][k]), 1e-12);
        for (size_t i = 0; i < 2; i++) {
            size_t x = 3 * anchors[i] + k;
            CHECK_NEAR(to[3 * i + k], target[x] + times * (pose[x] - h.body.reference[x]), 1e-12);
        }
    }
    double *placed = move_points(&step, target, g->faces.nv),
           *before = vgi_copy_array(placed, 3 * g->faces.nv, sizeof *placed, &e);
    vg_mover_place(m, out.root, placed);
    vg_graph_root(g, placed, roots[2]);
    for (int k = 0; k < 3; k++) CHECK_NEAR(roots[2][k], out.root[k], 1e-12);
    for (size_t x = 0; x < 3 * g->faces.nv; x++)
        CHECK_NEAR(placed[x] - before[x], g->in_face[x / 3] ? placed[x % 3] - before[x % 3] : 0, 1e-12);
    vg_mover_free(&m);
    CHECK(m == NULL);
    vg_frame_clear(&in), vg_frame_clear(&out);
    free(target), free(pose), free(placed), free(before);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

static void test_moves(void)
{
    moved(false, 2); /* as much further as the target is larger */
}

static void test_stays(void)
{
    moved(true, 0);
}

/* A source of one point only has no size. */
static void test_without_size(void)
{
    vg_head h = new_shape();
    add_vertex(&h, 1, 1, 1);
    add_vertex(&h, 1, 1, 1);
    FACE(&h, 0, 1);
    vg_graph *g = graph_of(&h);
    static const double target[6] = {0, 0, 0, 4, 4, 4};
    vg_frame in = {.root = {2, 1, 1}}, out = {0};
    vg_mover *m;
    vg_err e;
    CHECK(vg_mover_new(&m, g, h.body.reference, g, target, NULL, 0, false, &e) == VG_OK);
    vg_mover_move(m, &in, &out);
    CHECK(out.root[0] == 3 && out.root[1] == 2 && out.root[2] == 2);
    vg_mover_free(&m);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

/* ---- what stays ---- */

static bool face_has(const vg_graph *g, size_t f, uint32_t v)
{
    for (uint32_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++)
        if (g->faces.vert[c] == v) return true;
    return false;
}

/* Does any source vertex that moves lie in a face that drives face f? */
static bool is_driven(const vg_graph *from, const vg_correspondence *pairs, const bool *moves, size_t f)
{
    for (uint32_t v = 0; v < from->faces.nv; v++) {
        if (!moves[v]) continue;
        if (!pairs && face_has(from, f, v)) return true;
        for (uint32_t i = pairs ? pairs->first[f] : 0; pairs && i < pairs->first[f + 1]; i++)
            if (face_has(from, pairs->source[i], v)) return true;
    }
    return false;
}

static void against_counting(const vg_graph *from, const double *reference, const vg_graph *to,
                             const vg_correspondence *pairs, const bool *moves)
{
    double *pose = room(3 * from->faces.nv, sizeof *pose), D = vg_diagonal(reference, from->faces.nv);
    vg_pinner *p;
    vg_err e;
    const uint32_t *list;
    size_t n, found = 0;
    memcpy(pose, reference, 3 * from->faces.nv * sizeof *pose);
    for (size_t v = 0; v < from->faces.nv; v++) pose[3 * v + v % 3] += (moves[v] ? 2e-6 : 0.5e-6) * D;
    CHECK(vg_pinner_new(&p, from, reference, to, pairs, true, &e) == VG_OK);
    n = vg_pinner_find(p, pose, &list);
    for (uint32_t v = 0; v < to->faces.nv; v++) {
        bool stays = to->in_face[v];
        for (size_t f = 0; stays && f < to->faces.nf; f++) stays = !face_has(to, f, v) || !is_driven(from, pairs, moves, f);
        CHECK(stays == (found < n && list[found] == v));
        found += stays;
    }
    CHECK(found == n && n > 0 && n < to->attached);
    vg_pinner_free(&p);
    CHECK(p == NULL);
    free(pose);
}

static void test_same_faces(void)
{
    vg_head h = make_torus(12, 9);
    add_isolated(&h);
    vg_graph *g = graph_of(&h);
    bool *moves = room(g->faces.nv, sizeof *moves);
    for (size_t v = 0; v < g->faces.nv; v += 31) moves[v] = true;
    against_counting(g, h.body.reference, g, NULL, moves);
    free(moves);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

/* Each face of a rod is driven by two of a torus. */
static void test_correspondence(void)
{
    vg_head torus = make_torus(12, 9), rod = make_rod(6, 8, true);
    vg_graph *from = graph_of(&torus), *to = graph_of(&rod);
    bool *moves = room(from->faces.nv, sizeof *moves);
    vg_correspondence pairs = {.first = room(to->faces.nf + 1, sizeof *pairs.first),
                               .source = room(2 * to->faces.nf, sizeof *pairs.source)};
    for (uint32_t f = 0; f < to->faces.nf; f++) {
        pairs.first[f + 1] = 2 * f + 2;
        pairs.source[2 * f] = f % (uint32_t)from->faces.nf, pairs.source[2 * f + 1] = 7 * f % (uint32_t)from->faces.nf;
    }
    moves[5] = moves[40] = true;
    against_counting(from, torus.body.reference, to, &pairs, moves);
    free(moves), free(pairs.first), free(pairs.source);
    vg_graph_free(&from), vg_graph_free(&to);
    vg_head_clear(&torus), vg_head_clear(&rod);
}

/* A ring of rings of three, of which the first few stay: those between two others have only faces that stay. Less
 * than a tenth of the vertices holds nothing, unless it always shall. */
static void test_few(void)
{
    enum { RINGS = 40 };
    vg_head h = make_torus(RINGS, 3);
    vg_graph *g = graph_of(&h);
    for (int always = 0; always < 2; always++)
        for (size_t rings = 0; rings <= RINGS; rings++) {
            double *pose = room(3 * g->faces.nv, sizeof *pose);
            const uint32_t *list;
            vg_pinner *p;
            vg_err e;
            for (size_t x = 0; x < 3 * g->faces.nv; x++) pose[x] = h.body.reference[x] + (x / 9 >= rings);
            CHECK(vg_pinner_new(&p, g, h.body.reference, g, NULL, always, &e) == VG_OK);
            size_t want = rings == RINGS ? 3 * RINGS : rings > 2 ? 3 * (rings - 2) : 0;
            if (!always && 10 * rings < RINGS) want = 0;
            CHECK(vg_pinner_find(p, pose, &list) == want);
            vg_pinner_free(&p);
            free(pose);
        }
    vg_graph_free(&g);
    vg_head_clear(&h);
}

TESTS({"roots and anchors go by the ratio of sizes", test_moves}, {"they stay", test_stays},
      {"a source without size", test_without_size}, {"what stays, face by face", test_same_faces},
      {"what stays, by a correspondence", test_correspondence}, {"a few that stay hold nothing", test_few})
