/* test_minimise.c: L-BFGS on functions whose minimum is known.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/minimise.h"
#include "test.h"

#include <math.h>

enum { TRIALS = VGI_MINIMISE_TRIALS, MOST = 50 };

/* Rosenbrock's valley in MOST dimensions: the minimum is 0 at (1, ..., 1). */
static void valley(void *context, double *const *x, double *f, double *const *g)
{
    size_t n = *(size_t *)context;
    for (int k = 0; k < TRIALS; k++) {
        f[k] = 0;
        for (size_t i = 0; i < n; i++) g[k][i] = 0;
        for (size_t i = 0; i + 1 < n; i++) {
            double a = x[k][i + 1] - x[k][i] * x[k][i], b = 1 - x[k][i];
            f[k] += 100 * a * a + b * b;
            g[k][i] += -400 * a * x[k][i] - 2 * b;
            g[k][i + 1] += 200 * a;
        }
    }
}

static void valley_is_crossed(void)
{
    size_t n = MOST;
    double x[MOST];
    vg_err e = {0, ""};
    vgi_minimum m;
    for (size_t i = 0; i < n; i++) x[i] = i % 2 ? 1 : -1.2;
    vgi_function f = {n, valley, &n};
    CHECK(vgi_minimise(&f, x, 1000, 0, &m, &e) == VG_OK);
    CHECK(m.value < 1e-16 && m.first > 100 && m.rounds < 400);
    for (size_t i = 0; i < n; i++) CHECK_NEAR(x[i], 1, 1e-7);
}

/* |x - a|, not smooth at its minimum: the value never grows, and the search ends */
static void cone(void *context, double *const *x, double *f, double *const *g)
{
    const double *a = context;
    for (int k = 0; k < TRIALS; k++) {
        double far = hypot(x[k][0] - a[0], x[k][1] - a[1]) + 1e-300;
        f[k] = far;
        for (int i = 0; i < 2; i++) g[k][i] = (x[k][i] - a[i]) / far;
    }
}

static void cone_and_few_rounds(void)
{
    double a[2] = {3, -4}, x[2] = {0, 0};
    vg_err e = {0, ""};
    vgi_minimum m;
    vgi_function f = {2, cone, a};
    CHECK(vgi_minimise(&f, x, 1, 0, &m, &e) == VG_OK);
    CHECK(m.rounds == 1 && m.first == 5 && m.value < 5);
    double once = m.value;
    CHECK(vgi_minimise(&f, x, 100, 1e-6, &m, &e) == VG_OK);
    CHECK(m.first == once && m.value <= once && m.value < 0.05);
    CHECK(vgi_minimise(&f, a, 100, 1e-6, &m, &e) == VG_OK); /* begins at the minimum */
    CHECK(m.value <= 1e-12);
}

TESTS({"Rosenbrock's valley is crossed", valley_is_crossed}, {"a cone; few rounds", cone_and_few_rounds})
