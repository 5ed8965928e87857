/* test_limbs.c: how the whole of a mesh and the neighbourhoods of its faces turn, against the rotations that made the
 * pose.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "meshes.h"
#include "method/pairs/limbs.h"

enum { LONG = 100, WIDE = 10, FACES = LONG * WIDE }; /* a strip of unit squares; face i WIDE + k is at x = i, y = k */

static void add_strip(vg_head *h, double z)
{
    uint32_t first = (uint32_t)h->body.mesh.nv;
    for (uint32_t i = 0; i <= LONG; i++)
        for (uint32_t k = 0; k <= WIDE; k++) add_vertex(h, i, k, z);
    for (uint32_t i = 0; i < LONG; i++)
        for (uint32_t k = 0; k < WIDE; k++) {
            uint32_t a = first + i * (WIDE + 1) + k, b = a + WIDE + 1;
            FACE(h, a, b, b + 1, a + 1);
        }
}

static void set_map(vgi_map *map, const motion *m)
{
    for (int i = 0; i < 9; i++)
        for (int lane = 0; lane < VGI_LANES; lane++) map->m[i][lane] = m->m[i];
}

/* The angle in degrees between two rotations. */
static double between(const vgi_map *a, const motion *b, int lane)
{
    double trace = 0;
    for (int i = 0; i < 9; i++) trace += a->m[i][lane] * b->m[i];
    return 180 / M_PI * acos(fmax(-1, fmin((trace - 1) / 2, 1)));
}

typedef struct trial {
    vg_head h;
    vgi_limbs *r;
    vgi_map *maps;
    unsigned char *bad;
} trial;

static trial make_trial(size_t strips)
{
    trial t = {.h = new_shape()};
    vg_err e;
    for (size_t i = 0; i < strips; i++) add_strip(&t.h, 0.5 * (double)i);
    CHECK(vgi_limbs_new(&t.r, &t.h.body.mesh, t.h.body.reference, &e) == VG_OK);
    t.maps = aligned_alloc(64, t.h.body.mesh.nf * sizeof *t.maps);
    t.bad = room(t.h.body.mesh.nf, 1);
    return t;
}

static void clear_trial(trial *t)
{
    vgi_limbs_free(&t->r);
    vg_head_clear(&t->h);
    free(t->maps);
    free(t->bad);
}

static double turned_around(const trial *t, size_t f, const motion *m)
{
    vgi_map mean, turned;
    vgi_limbs_around(t->r, f, &mean);
    vgi_transfer_kernel_now()->polar(&mean, &turned);
    return between(&turned, m, 3);
}

/* Most of the strip turns by a, three tenths at its end by b. */
static void test_limb(void)
{
    for (int n = 0; n < 2; n++) {
        motion a = turn(n ? 1.1 : 0, 1, 0), b = turn((n ? 1.1 : 0) + M_PI / 6, 1, 0);
        trial t = make_trial(1);
        for (size_t f = 0; f < FACES; f++) set_map(&t.maps[f], f < 7 * FACES / 10 ? &a : &b);
        vgi_limbs_measure(t.r, t.maps, t.bad, 2);
        CHECK(between(vgi_limbs_whole(t.r), &a, 0) < 0.5);
        CHECK_NEAR(vgi_limbs_spread(t.r)[5], 0.3, 0.03);
        CHECK(turned_around(&t, 5, &a) < 1e-6);
        CHECK(turned_around(&t, 95 * WIDE + 5, &b) < 1e-6);
        double last = 30; /* the way from one to the other is smooth */
        for (size_t i = 50; i < 90; i++) {
            double now = turned_around(&t, i * WIDE + 5, &b);
            CHECK(now < last + 1e-4 && now > last - 4);
            last = now;
        }
        clear_trial(&t);
    }
}

/* A fold of a few faces hardly turns what is around it. */
static void test_fold(void)
{
    motion flat = turn(0, 1, 0), folded = turn(1.4, 1, 0);
    trial t = make_trial(1);
    for (size_t f = 0; f < FACES; f++) set_map(&t.maps[f], f / WIDE == 50 ? &folded : &flat);
    vgi_limbs_measure(t.r, t.maps, t.bad, 1);
    CHECK(between(vgi_limbs_whole(t.r), &flat, 7) < 0.01);
    CHECK(turned_around(&t, 50 * WIDE + 5, &flat) < 10);
    clear_trial(&t);
}

/* Two strips beside each other that turn apart: only what is connected counts. Faces without a map do not. */
static void test_components(void)
{
    motion a = turn(0, 1, 0), b = turn(2, 1, 0), wrong = turn(3, 1, 0);
    trial t = make_trial(2);
    for (size_t f = 0; f < 2 * FACES; f++) {
        set_map(&t.maps[f], f % 3 == 0 ? &wrong : f < FACES ? &a : &b);
        if (f % 3 == 0) t.bad[f] = 0xff;
    }
    vgi_limbs_measure(t.r, t.maps, t.bad, 1);
    for (size_t f = 0; f < 2 * FACES; f += 37) CHECK(turned_around(&t, f, f < FACES ? &a : &b) < 1e-6);
    clear_trial(&t);
}

TESTS({"a limb and the rest", test_limb}, {"a fold is not a limb", test_fold}, {"parts that touch nowhere", test_components})
