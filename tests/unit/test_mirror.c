/* test_mirror.c: the vertices that change places in a mirror: on a body whose partners are known in closed form, in poses
 * that are not symmetric, and by given pairs.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "meshes.h"

enum { AROUND = 12, ACROSS = 8 }; /* of the torus: vertex AROUND i + k is at the angles 2 pi i / AROUND, 2 pi k / ACROSS */

/* -x has the angle pi - a: i and AROUND / 2 - i change places. */
static uint32_t partner_of(uint32_t v)
{
    uint32_t i = v / ACROSS, k = v % ACROSS;
    return (AROUND + AROUND / 2 - i) % AROUND * ACROSS + k;
}

static void test_torus(void)
{
    vg_head h = make_torus(AROUND, ACROSS);
    const double *rest = h.body.reference;
    vg_mirror m;
    vg_err e;
    CHECK(vg_mirror_find(&m, &h.body.mesh, rest, 0, NULL, &e) == VG_OK);
    CHECK_NEAR(m.plane, 0, 1e-14);
    CHECK_NEAR(m.largest, 0, 1e-14);
    CHECK(m.edges == 2 * AROUND * ACROSS && m.broken == 0);
    for (uint32_t v = 0; v < m.nv; v++) CHECK(m.partner[v] == partner_of(v));
    double *pose = warp(rest, m.nv, 0.3), *once = room(3 * m.nv, sizeof *once), *twice = room(3 * m.nv, sizeof *twice);
    vg_mirror_pose(&m, pose, once);
    for (size_t v = 0; v < m.nv; v++) {
        const double *from = pose + 3 * (size_t)partner_of((uint32_t)v);
        CHECK_NEAR(once[3 * v], -from[0], 1e-14);
        CHECK(once[3 * v + 1] == from[1] && once[3 * v + 2] == from[2]);
    }
    vg_mirror_pose(&m, once, twice);
    CHECK_NEAR(farthest(twice, pose, m.nv), 0, 1e-14);
    vg_mirror_clear(&m);
    CHECK(m.partner == NULL);
    vg_head_clear(&h);
    free(pose), free(once), free(twice);
}

/* Other axes and another plane. Vertices that are a little off are paired all the same, and that is measured. */
static void test_off(void)
{
    vg_head h = make_torus(AROUND, ACROSS);
    const size_t nv = h.body.mesh.nv;
    double *rest = h.body.reference;
    for (size_t axis = 0; axis < 3; axis++) {
        vg_mirror m;
        vg_err e;
        double *moved = room(3 * nv, sizeof *moved);
        for (size_t i = 0; i < 3 * nv; i++) moved[i] = rest[i] + (i % 3 == axis ? 5 : 0);
        moved[3 * 9 + (axis + 1) % 3] += 1e-3;
        CHECK(vg_mirror_find(&m, &h.body.mesh, moved, axis, NULL, &e) == VG_OK);
        CHECK_NEAR(m.plane, 5, 1e-12);
        CHECK(m.axis == axis);
        CHECK_NEAR(m.largest, 1e-3, 1e-12);
        CHECK(m.partner[9] != 9 && (m.farthest == 9 || m.farthest == m.partner[9]));
        CHECK_NEAR(m.mean, 2e-3 / (double)nv, 1e-12);
        for (uint32_t v = 0; v < nv; v++) CHECK(m.partner[m.partner[v]] == v);
        vg_mirror_clear(&m);
        free(moved);
    }
    vg_head_clear(&h);
}

/* Without a partner within 2 % of D: refused, and nothing is left. */
static void test_lopsided(void)
{
    vg_head h = make_torus(AROUND, ACROSS);
    vg_mirror m;
    vg_err e;
    h.body.reference[3 * 9 + 2] += 0.05 * vg_diagonal(h.body.reference, h.body.mesh.nv);
    CHECK(vg_mirror_find(&m, &h.body.mesh, h.body.reference, 0, NULL, &e) == VG_EINPUT);
    CHECK(m.partner == NULL);
    vg_head_clear(&h);
}

/* Given pairs are taken, even where they lie apart; the others are their own partners. */
static void test_pairs(void)
{
    vg_head h = make_torus(AROUND, ACROSS);
    vg_marker at[] = {{.source = 0, .target = 11, .line = 1}, {.source = 30, .target = 2, .line = 2}};
    const vg_markers pairs = {.n = 2, .at = at};
    vg_mirror m;
    vg_err e;
    CHECK(vg_mirror_find(&m, &h.body.mesh, h.body.reference, 1, &pairs, &e) == VG_OK);
    CHECK(m.partner[0] == 11 && m.partner[11] == 0 && m.partner[30] == 2 && m.partner[2] == 30 && m.partner[5] == 5);
    CHECK(m.broken > 0);
    vg_mirror_clear(&m);
    at[1].target = (long)h.body.mesh.nv;
    CHECK(vg_mirror_find(&m, &h.body.mesh, h.body.reference, 1, &pairs, &e) < 0);
    CHECK(m.partner == NULL);
    vg_head_clear(&h);
}

TESTS({"a torus: partners of the closed form, poses, and back", test_torus}, {"other axes, vertices that are off", test_off},
      {"a body that is not symmetric", test_lopsided}, {"pairs that are given", test_pairs})
