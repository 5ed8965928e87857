/* test.h: the whole unit-test framework: TEST(name) { CHECK(...); } and a main that runs what it is given. Each check
 * that fails prints its place and its values; every test counts once. VG_ISA chooses the kernels, as in the programs.
 * The last line is "N passed, N failed".
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_TEST_H
#define VG_TEST_H
#include "vg.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int test_bad; /* failed checks of the running test */

#define CHECK(ok) do { if (!(ok)) { test_bad++; printf("%s:%d: %s\n", __FILE__, __LINE__, #ok); } } while (0)
/* |a - b| <= tol, false for NaN */
#define CHECK_NEAR(a, b, tol)                                                                                        \
    do {                                                                                                             \
        double a_ = (a), b_ = (b), t_ = (tol);                                                                       \
        if (!(fabs(a_ - b_) <= t_)) {                                                                                \
            test_bad++;                                                                                              \
            printf("%s:%d: %s = %.17g, %s = %.17g, differ by %.3g > %.3g\n", __FILE__, __LINE__, #a, a_, #b, b_,     \
                   fabs(a_ - b_), t_);                                                                               \
        }                                                                                                            \
    } while (0)
#define CHECK_TEXT(a, b) do { const char *a_ = (a), *b_ = (b); if (strcmp(a_, b_)) { test_bad++; \
    printf("%s:%d: %s is \"%s\", not \"%s\"\n", __FILE__, __LINE__, #a, a_, b_); } } while (0)

struct test { const char *name; void (*run)(void); };

static int test_main(const struct test *tests, size_t n)
{
    int passed = 0, failed = 0;
    vg_err e;
    if (vg_isa_choose(getenv("VG_ISA"), &e) < 0) return printf("%s\n", e.message), 2;
    for (size_t i = 0; i < n; i++) {
        test_bad = 0;
        tests[i].run();
        printf("%s %s\n", test_bad ? "not ok" : "ok", tests[i].name);
        test_bad ? failed++ : passed++;
    }
    printf("%d passed, %d failed\n", passed, failed);
    return failed != 0;
}
#define TESTS(...)                                                                                                   \
    int main(void)                                                                                                   \
    {                                                                                                                \
        static const struct test all[] = {__VA_ARGS__};                                                              \
        return test_main(all, sizeof all / sizeof *all);                                                             \
    }
#endif
