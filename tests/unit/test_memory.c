/* test_memory.c: the scan for numbers that are not finite, at every place of lists of every length.
 * Leaves out allocation, which tests/alloc.bats makes fail.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "test.h"
#include "core/core.h"

#include <float.h>

static void every_place_is_looked_at(void)
{
    static const double wrong[] = {NAN, -NAN, INFINITY, -INFINITY};
    double x[43]; /* x + 1 is not aligned to lanes */
    CHECK(vgi_finite(NULL, 0));
    for (size_t n = 0; n <= 42; n++)
        for (size_t first = 0; first < 2 && first + n <= 42; first++) {
            for (size_t i = 0; i < 43; i++) x[i] = i >= first && i < first + n ? (double)i - 20.5 : NAN;
            CHECK(vgi_finite(x + first, n));
            for (size_t i = 0; i < n; i++) {
                double was = x[first + i];
                for (size_t k = 0; k < 4; k++) {
                    x[first + i] = wrong[k];
                    CHECK(!vgi_finite(x + first, n));
                }
                x[first + i] = was;
            }
        }
}

static void large_and_small_numbers_are_finite(void)
{
    const double x[] = {DBL_MAX, -DBL_MAX, DBL_MIN, 5e-324, -5e-324, 0, -0.0, 1e300, DBL_EPSILON, -1e-300};
    for (size_t n = 0; n <= sizeof x / sizeof *x; n++) CHECK(vgi_finite(x, n));
}

TESTS({"every place is looked at", every_place_is_looked_at},
      {"large and small numbers are finite", large_and_small_numbers_are_finite})
