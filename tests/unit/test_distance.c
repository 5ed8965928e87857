/* test_distance.c: the distance between surfaces, against integrals in closed form: parallel and inclined planes, a sphere in
 * a sphere, a hole that shows in one way alone.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "meshes.h"

/* n x n squares from `low` to `high` in x and y, at the height `slope` x + `height` */
static vg_head make_plane(uint32_t n, double low, double high, double slope, double height)
{
    vg_head h = new_shape();
    for (uint32_t i = 0; i <= n; i++)
        for (uint32_t k = 0; k <= n; k++) {
            double x = low + (high - low) * i / n, y = low + (high - low) * k / n;
            add_vertex(&h, x, y, slope * x + height);
        }
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t k = 0; k < n; k++) {
            uint32_t a = i * (n + 1) + k;
            FACE(&h, a, a + 1, a + n + 2, a + n + 1);
        }
    return h;
}

static void measure(const vg_head *truth, const vg_head *result, int threads, vg_surface_distance found[2])
{
    vg_surface_measures *x;
    vg_err e;
    double d = vg_diagonal(truth->body.reference, truth->body.mesh.nv);
    if (vg_surface_measures_new(&x, &truth->body.mesh, &result->body.mesh, d, threads, &e) < 0) abort();
    if (vg_surface_measures_add(x, truth->body.reference, result->body.reference, found, &e) < 0) abort();
    vg_surface_measures_free(&x);
    CHECK(x == NULL);
}

/* Of other squares, 0.3 apart: every point is. */
static void test_parallel(void)
{
    vg_head a = make_plane(4, 0, 1, 0, 0), b = make_plane(7, 0, 1, 0, 0.3);
    vg_surface_distance d[2];
    measure(&a, &b, 1, d);
    for (int way = 0; way < 2; way++) {
        CHECK_NEAR(d[way].mean, 0.3, 1e-14);
        CHECK_NEAR(d[way].rms, 0.3, 1e-14);
        CHECK_NEAR(d[way].max, 0.3, 1e-14);
        CHECK_NEAR(d[way].p95, 0.3, 0.003 * 0.3);
    }
    vg_head_clear(&a);
    vg_head_clear(&b);
}

/* The plane z = x / 2 over the unit square, from a larger one at z = 0: x / 2 away, whose mean is 1/4, mean square 1/12. */
static void test_inclined(void)
{
    vg_head a = make_plane(3, -2, 3, 0, 0), b = make_plane(40, 0, 1, 0.5, 0);
    vg_surface_distance d[2], again[2];
    measure(&a, &b, 1, d);
    CHECK_NEAR(d[1].mean, 0.25, 1e-13);
    CHECK_NEAR(d[1].rms, sqrt(1.0 / 12), 1e-13);
    CHECK_NEAR(d[1].max, 0.5, 1e-14);
    CHECK_NEAR(d[1].at[0], 1, 1e-14);
    CHECK_NEAR(d[1].p95, 0.475, 0.003 * 0.475 + 0.5 / 40);
    CHECK(d[0].max > 2); /* the large plane's far corner */
    measure(&a, &b, 3, again);
    CHECK(!memcmp(&d[1].mean, &again[1].mean, sizeof d[1].mean) && !memcmp(&d[0].rms, &again[0].rms, sizeof d[0].rms));
    vg_head_clear(&a);
    vg_head_clear(&b);
}

/* A square without its middle ninth: from it to the whole nothing is far; back, the middle of the hole is, by half its side. */
static void test_hole(void)
{
    vg_head whole = make_plane(30, 0, 3, 0, 0), ring = new_shape();
    for (uint32_t v = 0; v < 16; v++) add_vertex(&ring, v / 4, v % 4, 0);
    for (uint32_t i = 0; i < 9; i++) {
        uint32_t a = i / 3 * 4 + i % 3;
        if (i != 4) FACE(&ring, a, a + 1, a + 5, a + 4);
    }
    vg_surface_distance d[2];
    measure(&whole, &ring, 1, d);
    CHECK_NEAR(d[1].max, 0, 1e-14);
    CHECK_NEAR(d[0].max, 0.5, 1e-13);
    CHECK_NEAR(d[0].at[0], 1.5, 1e-13);
    /* the mean over the hole is a sixth of its side, the hole a ninth of the area; the distance has kinks, which
     * squares of 0.1 do not meet exactly */
    CHECK_NEAR(d[0].mean, 1.0 / 6 / 9, 1e-3 / 9);
    CHECK(d[0].frame == 0);
    vg_head_clear(&whole);
    vg_head_clear(&ring);
}

/* Over frames: means of all, the frame of the largest; distances of the result's vertices in the last one. */
static void test_frames(void)
{
    vg_head a = make_plane(2, 0, 1, 0, 0), b = make_plane(3, 0, 1, 0, 0);
    const size_t nv = b.body.mesh.nv;
    static const double height[] = {0.1, 0.4, 0.1};
    vg_surface_measures *x;
    vg_surface_distance d[2];
    vg_err e;
    if (vg_surface_measures_new(&x, &a.body.mesh, &b.body.mesh, 1, 2, &e) < 0) abort();
    for (size_t i = 0; i < 3; i++) {
        for (size_t v = 0; v < nv; v++) b.body.reference[3 * v + 2] = height[i];
        CHECK(vg_surface_measures_add(x, a.body.reference, b.body.reference, NULL, &e) == VG_OK);
    }
    vg_surface_measures_get(x, d);
    CHECK_NEAR(d[0].mean, 0.2, 1e-14);
    CHECK_NEAR(d[1].rms, sqrt(0.18 / 3), 1e-14);
    CHECK(d[0].frame == 1 && d[1].frame == 1);
    for (size_t v = 0; v < nv; v++) CHECK_NEAR(vg_surface_measures_vertices(x)[v], 0.1, 1e-14);
    vg_surface_measures_free(&x);
    vg_head_clear(&a);
    vg_head_clear(&b);
}

static void test_no_faces(void)
{
    vg_head a = make_plane(2, 0, 1, 0, 0), none = new_shape();
    add_vertex(&none, 0, 0, 0);
    vg_surface_measures *x;
    vg_err e;
    CHECK(vg_surface_measures_new(&x, &a.body.mesh, &none.body.mesh, 1, 1, &e) == VG_EINPUT);
    CHECK(x == NULL);
    CHECK(vg_surface_measures_new(&x, &none.body.mesh, &a.body.mesh, 1, 1, &e) == VG_EINPUT);
    vg_head_clear(&a);
    vg_head_clear(&none);
}

TESTS({"parallel planes", test_parallel}, {"an inclined plane: mean, rms, p95 of the closed form", test_inclined},
      {"a hole shows in one way", test_hole}, {"frames, and distances of vertices", test_frames},
      {"meshes without faces", test_no_faces})
