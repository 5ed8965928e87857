/* test_pair.c: which source faces drive which target faces, of surfaces that lie on one another: averages,
 * leftovers, borders, holes, folds, strangers, and bones, each against what the layout says. Lengths are those of
 * vgi_pair: 1 is the target's D. SPDX-License-Identifier: GPL-3.0-or-later */
#include "meshes.h"
#include "method/pairs/register.h"

/* A sheet of nx x ny quads of size d; over: facing down. */
static void add_sheet(vg_head *h, uint32_t nx, uint32_t ny, double x, double y, double z, double d, bool over)
{
    uint32_t first = (uint32_t)h->body.mesh.nv;
    for (uint32_t k = 0; k <= ny; k++)
        for (uint32_t i = 0; i <= nx; i++) add_vertex(h, x + i * d, y + k * d, z);
    for (uint32_t k = 0; k < ny; k++)
        for (uint32_t i = 0; i < nx; i++) {
            uint32_t a = first + k * (nx + 1) + i;
            if (over) FACE(h, a, a + nx + 1, a + nx + 2, a + 1);
            else FACE(h, a, a + 1, a + nx + 2, a + nx + 1);
        }
}

static vg_head make_sheet(uint32_t nx, uint32_t ny, double d, bool over)
{
    vg_head h = new_shape();
    add_sheet(&h, nx, ny, 0, 0, 0, d, over);
    return h;
}

static vg_correspondence paired(const vg_head *source, const vg_head *target, bool flipped)
{
    vg_err e = {0, ""};
    vg_correspondence c;
    vgi_pairing in = {.source = &source->body.mesh, .target = &target->body.mesh, .flipped = flipped, .threads = 2};
    vgi_surface *s, *t;
    CHECK(vgi_surface_new(&s, in.source, source->body.reference, &e) == VG_OK);
    CHECK(vgi_surface_new(&t, in.target, target->body.reference, &e) == VG_OK);
    in.source_surface = s, in.target_surface = t;
    if (vgi_pair(&in, &c, &e) < 0) printf("%s\n", e.message), exit(1);
    for (size_t f = 0; f < c.target_nf; f++) {
        double sum = 0;
        CHECK(c.first[f] < c.first[f + 1]);
        for (uint32_t i = c.first[f]; i < c.first[f + 1]; i++) {
            sum += c.weight[i];
            CHECK(c.source[i] < c.source_nf && c.weight[i] > 0);
        }
        CHECK_NEAR(sum, 1, 1e-12);
    }
    vgi_surface_free(&s);
    vgi_surface_free(&t);
    return c;
}

static uint32_t drivers(const vg_correspondence *c, size_t f)
{
    return c->first[f + 1] - c->first[f];
}

static bool drives(const vg_correspondence *c, size_t f, uint32_t source)
{
    for (uint32_t i = c->first[f]; i < c->first[f + 1]; i++)
        if (c->source[i] == source) return true;
    return false;
}

static bool same_drivers(const vg_correspondence *c, size_t f, size_t g)
{
    return drivers(c, f) == drivers(c, g) &&
           !memcmp(c->source + c->first[f], c->source + c->first[g], drivers(c, f) * sizeof *c->source);
}

static void close_all(vg_correspondence *c, vg_head *a, vg_head *b)
{
    vg_correspondence_clear(c);
    vg_head_clear(a);
    vg_head_clear(b);
}

/* One large face over a hundred small ones: all of them drive it, those under its middle the most; and so it is where
 * one of the meshes faces the other way, and is said to. */
static void a_fine_source_is_averaged(void)
{
    for (int over = 0; over < 2; over++) {
        vg_head source = make_sheet(10, 10, 0.1, over), target = make_sheet(1, 1, 1, false);
        vg_correspondence c = paired(&source, &target, over);
        CHECK(c.matched[0] && drivers(&c, 0) == 100);
        for (uint32_t f = 0; f < 100; f++) CHECK(drives(&c, 0, f));
        for (uint32_t i = 0; i < 4; i++) { /* the four at the middle, alike */
            uint32_t f = c.source[i];
            CHECK((f % 10 == 4 || f % 10 == 5) && (f / 10 == 4 || f / 10 == 5));
            CHECK_NEAR(c.weight[i], c.weight[0], 1e-12);
        }
        for (uint32_t i = 1; i < 100; i++) CHECK(c.weight[i] <= c.weight[i - 1] * (1 + 1e-12));
        CHECK_NEAR(c.distance[0], sqrt(0.5) * 0.1, 1e-12);
        close_all(&c, &source, &target);
    }
}

/* Three layers of one folded sheet, the first and the last of which face the same way and nearly touch: what drives a
 * face of one layer is of that layer. */
static void folds_do_not_mix(void)
{
    enum { LONG = 20, WIDE = 6 };
    vg_head heads[2];
    for (int m = 0; m < 2; m++) {
        vg_head *h = &heads[m];
        *h = new_shape();
        for (uint32_t i = 0; i <= 3 * LONG; i++) {
            uint32_t along = i % (2 * LONG), layer = i / LONG;
            double x = 0.02 * (along <= LONG ? along : 2 * LONG - along), z = 0.003 * fmin(2, layer);
            if (i % LONG == 0 && i) z = 0.003 * (layer - 0.5);
            if (i == 3 * LONG) z = 0.006;
            for (uint32_t k = 0; k <= WIDE; k++) add_vertex(h, x + 0.004 * m, 0.02 * k + 0.004 * m, z + 0.0002 * m);
        }
        for (uint32_t i = 0; i < 3 * LONG; i++)
            for (uint32_t k = 0; k < WIDE; k++) {
                uint32_t a = i * (WIDE + 1) + k;
                FACE(h, a, a + WIDE + 1, a + WIDE + 2, a + 1);
            }
    }
    vg_correspondence c = paired(&heads[0], &heads[1], false);
    for (uint32_t i = 3; i < 3 * LONG - 3; i++)
        for (uint32_t k = 0; k < WIDE; k++) {
            if (i % LONG < 3 || i % LONG > LONG - 4) continue;
            uint32_t f = i * WIDE + k;
            CHECK(c.matched[f] && drivers(&c, f) > 1);
            for (uint32_t n = c.first[f]; n < c.first[f + 1]; n++) CHECK(c.source[n] / WIDE / LONG == i / LONG);
        }
    close_all(&c, &heads[0], &heads[1]);
}

/* A target that is larger than the source: beyond the border faces are matched as far as they are large. */
static void borders_are_no_match(void)
{
    vg_head source = make_sheet(10, 10, 0.02, false), target = make_sheet(30, 10, 0.01, false);
    vg_correspondence c = paired(&source, &target, false);
    for (uint32_t i = 0; i < 30; i++) {
        double beyond = 0.01 * i + 0.005 - 0.2;
        for (uint32_t k = 0; k < 10; k++) CHECK(c.matched[30 * k + i] == (beyond <= 0.01));
    }
    /* the others ride with the last that are */
    for (uint32_t k = 2; k < 8; k++) {
        uint32_t last = 20;
        for (uint32_t i = last + 1; i < 30; i++) {
            bool one = false;
            for (uint32_t j = 0; j < 10; j++) one = one || same_drivers(&c, 30 * k + i, 30 * j + last);
            CHECK(one);
        }
    }
    close_all(&c, &source, &target);
}

/* A part of the target that is out of reach in the middle of it: what is on its rim is driven as a face beside it. */
static void holes_ride_with_their_rim(void)
{
    enum { N = 12 };
    vg_head source = make_sheet(N, N, 0.03, false), target = make_sheet(N, N, 0.03, false);
    for (uint32_t k = 4; k <= 8; k++)
        for (uint32_t i = 4; i <= 8; i++) target.body.reference[3 * (k * (N + 1) + i) + 2] = 0.5;
    vg_correspondence c = paired(&source, &target, false);
    for (uint32_t k = 0; k < N; k++)
        for (uint32_t i = 0; i < N; i++) {
            bool raised = k >= 3 && k < 9 && i >= 3 && i < 9, rim = raised && (k == 3 || k == 8 || i == 3 || i == 8);
            size_t f = k * N + i;
            CHECK(c.matched[f] == !raised);
            bool beside = false;
            for (uint32_t y = k - 1; rim && y <= k + 1; y++)
                for (uint32_t x = i - 1; x <= i + 1; x++)
                    beside = beside || (c.matched[y * N + x] && same_drivers(&c, f, y * N + x));
            CHECK(!rim || beside);
        }
    close_all(&c, &source, &target);
}

/* A component of which a few faces happen to lie on the source is a stranger all the same: all of it is driven
 * alike, by what drives the four matched faces that are nearest to it. */
static void strangers_are_rigid(void)
{
    enum { N = 10, STRIP = 9 };
    vg_head source = make_sheet(N, N, 0.04, false), target = make_sheet(N, N, 0.04, false);
    add_sheet(&target, STRIP, 1, 0.32, 0.111, 0.01, 0.04, false); /* two of nine are over the sheet */
    vg_correspondence c = paired(&source, &target, false);
    double middle[2] = {0.32 + STRIP * 0.02, 0.131}, far[N * N];
    for (uint32_t f = 0; f < N * N; f++) {
        CHECK(c.matched[f] && drivers(&c, f) == 1 && c.source[c.first[f]] == f);
        far[f] = hypot(0.04 * (f % N) + 0.02 - middle[0], 0.04 * (f / N) + 0.02 - middle[1]);
    }
    for (size_t f = N * N; f < target.body.mesh.nf; f++) {
        CHECK(!c.matched[f] && drivers(&c, f) == 4 && same_drivers(&c, f, N * N));
        for (uint32_t i = c.first[f]; i < c.first[f + 1]; i++) {
            size_t nearer = 0;
            for (size_t g = 0; g < N * N; g++) nearer += far[g] < far[c.source[i]] - 1e-12;
            CHECK(nearer < 4);
            CHECK_NEAR(c.weight[i], 0.25, 1e-12);
        }
    }
    close_all(&c, &source, &target);
}

/* Of a chain each coarse bone is driven by the one fine bone under its middle. */
static void bones_are_not_mixed(void)
{
    vg_head source = new_shape(), target = new_shape();
    for (uint32_t i = 0; i <= 30; i++) add_vertex(&source, i / 30.0, 0, 0);
    for (uint32_t i = 0; i < 30; i++) FACE(&source, i, i + 1);
    for (uint32_t i = 0; i <= 4; i++) add_vertex(&target, i / 4.0, 0, 0.001);
    for (uint32_t i = 0; i < 4; i++) FACE(&target, i, i + 1);
    vg_correspondence c = paired(&source, &target, false);
    for (uint32_t i = 0; i < 4; i++) {
        CHECK(c.matched[i] && drivers(&c, i) == 1);
        CHECK(c.source[c.first[i]] == (uint32_t)((i + 0.5) / 4 * 30));
    }
    close_all(&c, &source, &target);
}

TESTS({"a fine source is averaged", a_fine_source_is_averaged}, {"folds do not mix", folds_do_not_mix},
      {"borders are no match", borders_are_no_match}, {"holes ride with their rim", holes_ride_with_their_rim},
      {"strangers are rigid", strangers_are_rigid}, {"bones are not mixed", bones_are_not_mixed})
