/* test_kdtree.c: the k-d tree answers what looking at every point answers, to the last bit and in every tie.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/kdtree.h"
#include "test.h"

static uint64_t state = 1;

static double uniform(void)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}

static double square_between(const double *a, const double *b)
{
    double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

/* The k nearest of another label (label NULL: of all), by looking at every point. */
static size_t look_at_all(const double *points, const uint32_t *label, size_t n, const double *p, uint32_t not_label,
                          double limit, size_t k, vgi_near *near)
{
    size_t found = 0;
    for (size_t i = 0; i < n; i++) {
        double square = square_between(points + 3 * i, p);
        if ((label && label[i] == not_label) || !(square <= limit)) continue;
        size_t at = found;
        while (at > 0 && square < near[at - 1].square) at--;
        if (at == k) continue;
        if (found < k) found++;
        memmove(near + at + 1, near + at, (found - 1 - at) * sizeof *near);
        near[at] = (vgi_near){(uint32_t)i, square};
    }
    return found;
}

static bool same(const vgi_near *a, const vgi_near *b, size_t k)
{
    for (size_t i = 0; i < k; i++)
        if (a[i].index != b[i].index || a[i].square != b[i].square) return false;
    return true;
}

enum shape { SPREAD, GRID, LINE, ONE_PLACE, CLUSTERS, SHAPES };

/* Points that bring out ties (grid), flat boxes (line), no extent at all (one place), and uneven density. */
static double *make_points(enum shape shape, size_t n)
{
    double *p = calloc(n ? 3 * n : 1, sizeof *p);
    for (size_t i = 0; i < 3 * n; i++) {
        double u = uniform();
        switch (shape) {
        case SPREAD: p[i] = u; break;
        case GRID: p[i] = floor(6 * u); break;
        case LINE: p[i] = i % 3 == 1 ? u : -2; break;
        case ONE_PLACE: p[i] = 0.5; break;
        default: p[i] = (double)(i / 3 % 4) + pow(u, 8); break;
        }
    }
    return p;
}

static void compare(const double *p, size_t n, const double *from, vgi_kdtree *t, const uint32_t *label)
{
    vgi_near mine[20], truth[20];
    size_t ks[] = {1, 2, 7, 20};
    for (int i = 0; i < 4; i++) {
        size_t k = ks[i], want = look_at_all(p, NULL, n, from, 0, INFINITY, k, truth);
        CHECK(vgi_kdtree_nearest(t, from, INFINITY, k, mine) == want && same(mine, truth, want));
        want = look_at_all(p, NULL, n, from, 0, 0.25, k, truth);
        CHECK(vgi_kdtree_nearest(t, from, 0.25, k, mine) == want && same(mine, truth, want));
    }
    for (uint32_t l = 0; l < 3; l++) {
        size_t want = look_at_all(p, label, n, from, l, INFINITY, 1, truth);
        CHECK(vgi_kdtree_nearest_other(t, from, l, INFINITY, mine) == want && same(mine, truth, want));
        want = look_at_all(p, label, n, from, l, 1, 1, truth);
        CHECK(vgi_kdtree_nearest_other(t, from, l, 1, mine) == want && same(mine, truth, want));
    }
}

static void against_looking_at_all(void)
{
    size_t sizes[] = {0, 1, 2, 8, 9, 10, 17, 100, 1000};
    for (int shape = 0; shape < SHAPES; shape++)
        for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
            size_t n = sizes[s];
            double *p = make_points(shape, n);
            uint32_t *label = calloc(n + 1, sizeof *label);
            for (size_t i = 0; i < n; i++) label[i] = n < 3 ? 1 : p[3 * i] < 0.3 ? 0 : p[3 * i + 1] < 0.5 ? 1 : 2;
            vgi_kdtree *t;
            CHECK(vgi_kdtree_new(&t, p, n, NULL) == VG_OK);
            vgi_kdtree_label(t, label);
            for (int q = 0; q < 60; q++) {
                double from[3] = {4 * uniform() - 1, 4 * uniform() - 1, 4 * uniform() - 1};
                if (q % 2 && n) memcpy(from, p + 3 * (q * 7919u % n), sizeof from);
                compare(p, n, from, t, label);
            }
            vgi_kdtree_free(&t);
            CHECK(t == NULL);
            free(p), free(label);
        }
}

static void ties_go_to_the_lowest_index(void)
{
    size_t n = 5000;
    double *p = make_points(ONE_PLACE, n), from[3] = {0, 0, 0};
    uint32_t *label = calloc(n, sizeof *label);
    for (size_t i = 0; i < n; i++) label[i] = i >= 1234;
    vgi_kdtree *t;
    CHECK(vgi_kdtree_new(&t, p, n, NULL) == VG_OK);
    vgi_kdtree_label(t, label);
    vgi_near near[3];
    CHECK(vgi_kdtree_nearest(t, from, INFINITY, 3, near) == 3);
    CHECK(near[0].index == 0 && near[1].index == 1 && near[2].index == 2);
    CHECK(vgi_kdtree_nearest_other(t, from, 0, INFINITY, near) && near[0].index == 1234);
    CHECK(vgi_kdtree_nearest_other(t, from, 1, INFINITY, near) && near[0].index == 0);
    vgi_kdtree_free(&t);
    free(p), free(label);
}

/* Sorted, reversed and alternating coordinates are where a careless selection takes quadratic time: 200,000 points
 * would then take minutes. */
static void no_order_of_points_is_slow(void)
{
    size_t n = 200000;
    double *p = calloc(3 * n, sizeof *p);
    for (int order = 0; order < 3; order++) {
        for (size_t i = 0; i < n; i++) {
            size_t x = order == 0 ? i : order == 1 ? n - i : i % 2 ? i : n - i;
            p[3 * i] = (double)x, p[3 * i + 1] = (double)(x / 2);
        }
        vgi_kdtree *t;
        CHECK(vgi_kdtree_new(&t, p, n, NULL) == VG_OK);
        vgi_near near;
        for (size_t i = 0; i < n; i += 17) {
            double from[3] = {p[3 * i] + 0.1, p[3 * i + 1], 0};
            CHECK(vgi_kdtree_nearest(t, from, INFINITY, 1, &near) == 1 && p[3 * near.index] == p[3 * i]);
        }
        vgi_kdtree_free(&t);
    }
    free(p);
}

static void nothing_to_find(void)
{
    double p[6] = {0, 0, 0, 1, 1, 1}, far[3] = {1e200, -1e200, 1e200};
    vgi_kdtree *t;
    vgi_near near;
    CHECK(vgi_kdtree_new(&t, p, 2, NULL) == VG_OK);
    CHECK(!vgi_kdtree_nearest_other(t, p, 0, INFINITY, &near)); /* all are 0 until they are labelled */
    CHECK(vgi_kdtree_nearest_other(t, p, 1, INFINITY, &near) && near.index == 0);
    CHECK(vgi_kdtree_nearest(t, p, INFINITY, 0, &near) == 0);
    CHECK(vgi_kdtree_nearest(t, (double[3]){9, 9, 9}, 1, 1, &near) == 0);
    CHECK(vgi_kdtree_nearest(t, far, INFINITY, 1, &near) == 1 && near.index == 0); /* squares overflow: a tie */
    vgi_kdtree_free(&t);
    vgi_kdtree_free(&t);
}

TESTS({"the tree answers what looking at all points answers", against_looking_at_all},
      {"ties go to the lowest index", ties_go_to_the_lowest_index},
      {"no order of the points makes it slow", no_order_of_points_is_slow},
      {"nothing to find is not found", nothing_to_find})
